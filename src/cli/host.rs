//! Commands inside another program, such as Python: recordings and a model come from its memory, the answer and its notes
//! go back to it, and nothing is printed.

use std::cell::RefCell;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

use super::*;

/// Recordings, a model and a stop for a command, from the program in which it runs.
#[derive(Debug, Default)]
pub struct Host {
    /// Recordings that a command uses as they are where its arguments name their paths.
    recordings: Arc<[Recording]>,
    /// The model in place of the file that the arguments name.
    model: Option<ReducedModel>,
    /// Ends a training or a study early once it is true.
    pub stop: AtomicBool,
    trained: Mutex<Option<ReducedModel>>,
}

impl Host {
    /// A program with these recordings, and a model if the command has one.
    pub fn new(recordings: Arc<[Recording]>, model: Option<ReducedModel>) -> Self {
        Self {
            recordings,
            model,
            ..Self::default()
        }
    }
}

/// The answer of a command that ran.
#[derive(Debug)]
pub struct HostAnswer {
    /// The text that the command line prints.
    pub text: String,
    /// The object of `--json`.
    pub json: Value,
    /// Notes that the command line prints to stderr.
    pub notes: Vec<String>,
    /// The model of a training, which is not written to a file.
    pub model: Option<ReducedModel>,
}

/// Why a command did not run to its end.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// Arguments that the command does not accept.
    #[error("{0}")]
    Usage(String),
    /// A command that failed.
    #[error(transparent)]
    Failed(#[from] Error),
}

thread_local! {
    static NOTES: RefCell<Option<Vec<String>>> = const { RefCell::new(None) };
}

/// Keeps a note for the program in which a command runs; false on the command line.
pub(super) fn keep_note(text: &str) -> bool {
    NOTES.with_borrow_mut(|notes| match notes {
        Some(notes) => {
            notes.push(text.to_owned());
            true
        }
        None => false,
    })
}

/// Runs a command by its arguments, the first of them `romc`, on the recordings and the model of the program.
///
/// # Errors
/// [`HostError::Usage`] for arguments that are not the command's, else the command's own.
pub fn run_in(
    host: &Arc<Host>,
    arguments: impl IntoIterator<Item = OsString>,
) -> Result<HostAnswer, HostError> {
    let parsed = Arguments::read(arguments);
    let mut arguments = parsed.map_err(|refusal| HostError::Usage(usage_words(&refusal)))?;
    if let Some(reading) = reading_of(&mut arguments.command) {
        reading.host = Some(Arc::clone(host));
    }
    NOTES.set(Some(Vec::new()));
    let answer = execute(&arguments);
    let notes = NOTES.take().unwrap_or_default();
    let Answer { text, json, .. } = answer?;
    let mut trained = (host.trained.lock()).unwrap_or_else(PoisonError::into_inner);
    Ok(HostAnswer {
        text,
        json,
        notes,
        model: trained.take(),
    })
}

/// A refusal without its heading and the command's usage.
fn usage_words(refusal: &clap::Error) -> String {
    let text = refusal.to_string();
    let text = text.strip_prefix("error: ").unwrap_or(&text);
    let ends = ["\n\nUsage:", "\n\nFor more information"];
    let end = ends.iter().filter_map(|end| text.find(end)).min();
    text[..end.unwrap_or(text.len())].trim_end().to_owned()
}

fn reading_of(command: &mut Command) -> Option<&mut ReadingArguments> {
    match command {
        Command::Inspect(arguments) => Some(&mut arguments.reading),
        Command::Convert(arguments) => Some(&mut arguments.reading),
        Command::Identify(arguments) => Some(&mut arguments.reading),
        Command::Train(arguments) => Some(&mut arguments.reading),
        Command::Study(arguments) => Some(&mut arguments.reading),
        Command::Import(arguments) => Some(&mut arguments.reading),
        Command::Compile(arguments) => Some(&mut arguments.simplification.reading),
        Command::Simulate(arguments) => Some(&mut arguments.reading),
        Command::Mpc(arguments) => Some(&mut arguments.reading),
        Command::Plan(arguments) => Some(&mut arguments.reading),
        Command::Report(arguments) => Some(&mut arguments.reading),
        Command::Demo(_)
        | Command::Robot(_)
        | Command::Check(_)
        | Command::Manual(_)
        | Command::Completions(_) => None,
    }
}

impl ReadingArguments {
    /// The model of the host, else that of the file.
    pub(super) fn model(&self, path: &Path) -> Result<ReducedModel> {
        match self.host.as_ref().and_then(|host| host.model.as_ref()) {
            Some(model) => Ok(model.clone()),
            None => Ok(artifact::read(path)?),
        }
    }

    pub(super) fn recordings(&self) -> Arc<[Recording]> {
        let host = self.host.as_ref();
        host.map_or_else(Arc::default, |host| Arc::clone(&host.recordings))
    }

    /// The file that a training writes; none inside another program.
    pub(super) fn file_of_model<'a>(&self, path: &'a Path) -> Option<&'a Path> {
        self.host.is_none().then_some(path)
    }

    pub(super) fn write_model(
        &self,
        path: &Path,
        model: &ReducedModel,
        overwrite: Overwrite,
    ) -> Result<()> {
        match &self.host {
            None => Ok(artifact::write(path, model, overwrite)?),
            Some(host) => {
                let mut trained = (host.trained.lock()).unwrap_or_else(PoisonError::into_inner);
                *trained = Some(model.clone());
                Ok(())
            }
        }
    }
}

#[cfg(test)]
#[path = "../../tests/units/cli_host.rs"]
mod tests;
