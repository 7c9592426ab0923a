//! The commands of `romc` on recordings and a model in Python's memory.

use std::ffi::OsString;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use pyo3::prelude::*;
use romc::cli::{Host, HostError, run_in};

use crate::errors::{python_error, usage};
use crate::model::Model;
use crate::recording::Recording;

/// Time between two looks at Ctrl-C.
const POLL: Duration = Duration::from_millis(50);

/// JSON, text and notes of a command, and the model of a training.
type CommandAnswer = (String, String, Vec<String>, Option<Model>);

/// Runs the command line; returns its exit code.
#[pyfunction]
pub fn run_command(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| romc::cli::run_with(arguments))
}

/// Runs a command; recordings have the names by which the arguments refer to them. Ctrl-C ends it early.
#[pyfunction]
pub fn command(
    py: Python<'_>,
    arguments: Vec<OsString>,
    recordings: Vec<(String, PyRef<'_, Recording>)>,
    model: Option<PyRef<'_, Model>>,
) -> PyResult<CommandAnswer> {
    let recordings = recordings.iter().map(|(name, recording)| {
        let data = romc::recording::Recording::clone(&recording.data);
        romc::recording::Recording {
            path: name.into(),
            ..data
        }
    });
    let model = model.map(|model| model.data.as_ref().clone());
    let host = Arc::new(Host::new(recordings.collect(), model));
    let (sender, mut receiver) = channel();
    let in_thread = Arc::clone(&host);
    let worker = std::thread::spawn(move || {
        // Python waits for the answer until the thread has ended.
        let _ = sender.send(run_in(&in_thread, arguments));
    });
    let mut interrupt = None;
    let answer = loop {
        let (still, received) = py.detach(move || {
            let received = receiver.recv_timeout(POLL);
            (receiver, received)
        });
        receiver = still;
        match received {
            Ok(answer) => break answer,
            Err(RecvTimeoutError::Timeout) if interrupt.is_none() => {
                interrupt = py.check_signals().err();
                host.stop.store(interrupt.is_some(), Ordering::Relaxed);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let panic = worker.join().expect_err("only a panic sends no answer");
                std::panic::resume_unwind(panic)
            }
        }
    };
    match (interrupt, answer) {
        (Some(interrupt), _) => Err(interrupt),
        (None, Ok(answer)) => {
            let model = answer.model.map(Model::new);
            Ok((answer.json.to_string(), answer.text, answer.notes, model))
        }
        (None, Err(HostError::Usage(words))) => Err(usage(py, &words)),
        (None, Err(HostError::Failed(error))) => Err(python_error(py, error)),
    }
}
