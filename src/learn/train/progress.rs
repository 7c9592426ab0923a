//! Progress of a running training, and its cancellation.

use std::sync::atomic::{AtomicBool, Ordering};

#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    Stage {
        name: &'static str,
        /// How many [`Self::Done`] and [`Self::Step`] follow at most; unknown for a search that ends by itself.
        steps: Option<usize>,
    },
    /// After a candidate or epoch of the stage: metrics of the moment, ready to print.
    Done { text: String },
    /// After one without metrics.
    Step,
}

/// Listens to a training and may stop it.
pub struct Monitor<'a> {
    listener: &'a mut dyn FnMut(Progress),
    pub(super) cancel: &'a AtomicBool,
}

impl<'a> Monitor<'a> {
    /// Sends progress to `listener` and stops soon after `cancel` becomes true.
    pub fn new(listener: &'a mut dyn FnMut(Progress), cancel: &'a AtomicBool) -> Self {
        Self { listener, cancel }
    }

    pub(crate) fn cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    pub(crate) fn stage(&mut self, name: &'static str, steps: impl Into<Option<usize>>) {
        let steps = steps.into();
        (self.listener)(Progress::Stage { name, steps });
    }

    pub(crate) fn done(&mut self, text: String) {
        (self.listener)(Progress::Done { text });
    }

    pub(crate) fn step(&mut self) {
        (self.listener)(Progress::Step);
    }
}
