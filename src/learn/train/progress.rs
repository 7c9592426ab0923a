//! Progress of a running training, and its cancellation.

use std::sync::atomic::{AtomicBool, Ordering};

#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    Stage {
        name: &'static str,
    },
    /// After a candidate or epoch of the stage: figures of the moment, ready to print.
    Done {
        text: String,
    },
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

    pub(crate) fn stage(&mut self, name: &'static str) {
        (self.listener)(Progress::Stage { name });
    }

    pub(crate) fn done(&mut self, text: String) {
        (self.listener)(Progress::Done { text });
    }
}
