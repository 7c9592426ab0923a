//! Shared by all commands: recordings, allowed outputs, messages and progress.

use std::time::Duration;

use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};
use serde::de::DeserializeOwned;

use super::*;

pub(crate) use crate::files::{shell_path as quoted, shell_word as quoted_text};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Format(&'static [&'static str]);

impl Format {
    pub(super) const TABLE: Self = Self(&[".csv"]);
    pub(super) const RECORDING: Self = Self(&[".csv", ".csv.gz", ".mcap"]);
    pub(super) const MODEL: Self = Self(&[".json"]);
    pub(super) const TOML: Self = Self(&[".toml"]);
    pub(super) const PAGE: Self = Self(&[".html", ".htm"]);
}

/// The files that a command reads and never replaces; the state of its output folder when the command begins.
#[derive(Debug, Default)]
pub(super) struct Inputs<'a>(Vec<&'a Path>, Option<Emitted>);

impl<'a> Inputs<'a> {
    pub(super) fn reading(arguments: &'a ReadingArguments) -> Self {
        Self::default().and(&arguments.columns)
    }

    pub(super) fn and<P: AsRef<Path> + ?Sized + 'a>(
        mut self,
        more: impl IntoIterator<Item = &'a P>,
    ) -> Self {
        self.0.extend(more.into_iter().map(AsRef::as_ref));
        self
    }

    pub(super) fn into_folder(mut self, folder: Option<&Path>) -> Result<Self> {
        self.1 = folder.map(Emitted::of).transpose()?;
        Ok(self)
    }

    pub(super) fn and_robot(self, name: Option<&'a str>) -> Self {
        let is_file = |name: &&str| !crate::robot_file::known_names().contains(name);
        self.and(name.filter(is_file))
    }

    /// Refuses to write to an input file, or into an input folder.
    fn check(&self, output: &Path) -> Result<()> {
        let Ok(place) = output.canonicalize() else {
            return Ok(()); // a file that does not exist is no input
        };
        let is_read = |input: &&&Path| {
            (input.canonicalize())
                .is_ok_and(|input| input == place || Some(&*input) == place.parent())
        };
        let Some(input) = self.0.iter().find(is_read).filter(|_| place.is_file()) else {
            return Ok(());
        };
        let other = match output == *input {
            true => String::new(),
            false => format!(" as {}", input.display()),
        };
        let path = output.to_owned();
        let message = format!(
            "the command reads this file{other}, and does not replace it; choose another name for the output"
        );
        Err(Error::Output { path, message })
    }

    pub(super) fn check_name(&self, path: &Path, format: Format) -> Result<()> {
        let Some(name) = path.file_name().filter(|_| !path.is_dir()) else {
            let message = "is a folder; expected the name of a file";
            return Err(Error::refused(path, message));
        };
        let name = name.to_string_lossy().to_lowercase();
        let is_device = path.exists() && !path.is_file();
        if is_device || format.0.iter().any(|ending| name.ends_with(ending)) {
            return self.check(path);
        }
        let found = match path.extension() {
            Some(ending) => format!(".{}", ending.to_string_lossy()),
            None => "no ending".to_owned(),
        };
        let expected = match format.0 {
            [all @ .., last] if !all.is_empty() => format!("{} or {last}", all.join(", ")),
            all => all.concat(),
        };
        let path = path.to_owned();
        let message = format!("found {found}, expected a name that ends in {expected}");
        Err(Error::Output { path, message })
    }

    /// Refuses an output that could not be written, before long work begins.
    pub(super) fn check_output(
        &self,
        path: Option<&Path>,
        format: Format,
        overwrite: Overwrite,
    ) -> Result<()> {
        let Some(path) = path else { return Ok(()) };
        self.check_name(path, format)?;
        if !overwrite.allows(path) {
            return Err(Error::Exists(path.to_owned()));
        }
        match path.parent() {
            Some(folder) if !folder.as_os_str().is_empty() && !folder.is_dir() => {
                let folder = folder.display();
                let message = format!("there is no folder `{folder}`; make it first");
                Err(Error::refused(path, message))
            }
            Some(_) | None => Ok(()),
        }
    }

    pub(super) fn write_folder(
        &self,
        folder: &Path,
        files: &[EmittedFile],
        overwrite: Overwrite,
    ) -> Result<Vec<PathBuf>> {
        for file in files {
            self.check(&folder.join(&file.path))?;
        }
        let now = Emitted::of(folder)?;
        let begun = self.1.as_ref().unwrap_or(&now);
        Ok(write_files_since(begun, folder, files, overwrite)?)
    }

    pub(super) fn write_figures(
        &self,
        folder: Option<&Path>,
        figures: impl FnOnce() -> Result<Vec<Figure>>,
        overwrite: Overwrite,
        answer: &mut Answer,
    ) -> Result<()> {
        let Some(folder) = folder else { return Ok(()) };
        let figures = figures()?;
        let files: Vec<EmittedFile> = figures.iter().flat_map(figure_files).collect();
        let written = self.write_folder(folder, &files, overwrite)?;
        answer.text += &format!(
            "{}: {}\n",
            counted(figures.len(), "figure"),
            folder.display()
        );
        answer.json["figures"] = names(&written).into();
        Ok(())
    }
}

pub(super) fn write_file(path: &Path, contents: &[u8], overwrite: Overwrite) -> Result<()> {
    let written = write_whole(path, overwrite, |out| out.write_all(contents));
    let path = path.to_owned();
    written.map_err(|source| match source.kind() {
        std::io::ErrorKind::AlreadyExists => Error::Exists(path),
        _ => Error::Write { path, source },
    })
}

pub(super) fn read_text(path: &Path) -> Result<String> {
    read_toml(path).map_err(|source| Error::Read {
        path: path.to_owned(),
        source,
    })
}

pub(super) fn read_settings<T: DeserializeOwned>(
    path: &Path,
    check: impl Fn(&T) -> Result<(), String>,
) -> Result<T> {
    let settings = toml::from_str(&read_text(path)?)
        .map_err(|error| Error::refused(path, error.to_string().trim_end()))?;
    check(&settings).map_err(|message| Error::refused(path, message))?;
    Ok(settings)
}

pub(super) fn reader(
    arguments: &ReadingArguments,
    clocks: Clocks,
    robot: Option<&'static Robot>,
) -> Result<Reader> {
    let map = arguments.columns.as_deref().map(ColumnMap::read);
    let reader = Reader::new(map.transpose()?, arguments.clock.unwrap_or(clocks))
        .with_held(arguments.recordings());
    Ok(match robot {
        Some(robot) => reader.for_robot(robot),
        None => reader,
    })
}

pub(super) fn read_for(
    model: &ReducedModel,
    paths: &[PathBuf],
    arguments: &ReadingArguments,
) -> Result<Vec<Recording>> {
    read_recordings(paths, arguments, model.robot().ok())
}

pub(super) fn read_jump(
    model: &ReducedModel,
    path: &PathBuf,
    arguments: &ReadingArguments,
) -> Result<Segment> {
    let mut recording = read_for(model, std::slice::from_ref(path), arguments)?.swap_remove(0);
    note_mismatches(&recording, model.robot()?);
    if let found @ 2.. = recording.segments.len() {
        let message = format!("found {found} segments, expected one motion for --plan");
        return Err(Error::refused(path, message));
    }
    Ok(recording.segments.swap_remove(0))
}

/// Prints a note about motions that turn too far for a linear encoder, with the consequence.
pub(super) fn note_turns<'a>(motions: impl IntoIterator<Item = &'a Segment>, consequence: &str) {
    let turns = |motion: &Segment| motion.by_heading().len() > 1;
    let turns: Vec<bool> = motions.into_iter().map(turns).collect();
    if let turning @ 1.. = turns.iter().filter(|turns| **turns).count() {
        let all = turns.len();
        note(&format!(
            "{turning} of {all} motions turn by more than 0.25 rad: {consequence}"
        ));
    }
}

pub(super) fn motions(recordings: &[Recording]) -> impl Iterator<Item = &Segment> {
    recordings.iter().flat_map(|recording| &recording.segments)
}

pub(super) const CUT: &str = "predictions are of pieces, each in the axes of its heading";
pub(super) const UNROLLED: &str =
    "a controller follows them only in the axes of their path, see docs/explanation/walking.md";

pub(super) fn read_recordings(
    paths: &[PathBuf],
    arguments: &ReadingArguments,
    robot: Option<&'static Robot>,
) -> Result<Vec<Recording>> {
    note_repeated(&[("recordings", paths.iter().map(PathBuf::as_path).collect())]);
    read_with(&reader(arguments, Clocks::Repaired, robot)?, paths)
}

pub(super) fn read_with(reader: &Reader, paths: &[PathBuf]) -> Result<Vec<Recording>> {
    let progress = progress_bar("reading recordings", paths.len());
    let mut notes = ReadingNotes::default();
    let read = (paths.iter())
        .map(|path| {
            progress.set_message(printable(&format!("reading {}", path.display())).into_owned());
            let reading = reader.read(path)?;
            notes.add(&reading);
            progress.inc(1);
            Ok(reading.recording)
        })
        .collect();
    progress.finish_and_clear();
    notes.lines().iter().for_each(|line| note(line));
    read
}

pub(super) fn note(text: &str) {
    if host::keep_note(text) {
        return;
    }
    to_stderr("note:", Style::new().cyan(), text);
}

/// Prints to stderr, with the head in this style; on a terminal, on lines that fit it.
pub(super) fn to_stderr(head: &str, style: Style, text: &str) {
    let mut line = format!("{head} {}", printable(text));
    match console::Term::stderr().is_term() {
        true => line = fitted(&line),
        false => line.push('\n'),
    }
    eprint!(
        "{}{}",
        style.for_stderr().apply_to(head),
        &line[head.len()..]
    );
}

pub(super) fn note_mismatches(recording: &Recording, robot: &Robot) {
    (mismatch::notes(recording, robot).iter()).for_each(|found| note(found));
}

/// A jump in two sets invalidates the validation, and a repeated one adds no information.
pub(super) fn note_repeated(sets: &[(&str, Vec<&Path>)]) {
    let mut first: BTreeMap<String, (&str, &Path)> = BTreeMap::new();
    let of_set = |(set, paths): &(_, Vec<_>)| paths.iter().map(|path| (*set, *path)).collect();
    let files: Vec<(&str, &Path)> = sets.iter().flat_map::<Vec<_>, _>(of_set).collect();
    for (set, path) in files.into_iter().filter(|(_, path)| path.is_file()) {
        let Ok(bytes) = std::fs::read(path) else {
            continue; // reading it as a recording gives the error
        };
        let digest = sha256(&bytes);
        let Some((other, earlier)) = first.get(&digest) else {
            first.insert(digest, (set, path));
            continue;
        };
        let what = match *other == set {
            true => "and counts twice".to_owned(),
            false => format!("which is in the {other} set: its {set} metrics are too optimistic"),
        };
        let (path, earlier) = (path.display(), earlier.display());
        note(&format!("{path}: the same recording as {earlier}, {what}"));
    }
}

pub(super) fn note_late_restarts(recordings: &[Recording], restart_every_s: f64) {
    let segments = recordings.iter().flat_map(|recording| &recording.segments);
    let longest_s = segments.map(Segment::duration_s).fold(0.0, f64::max);
    if restart_every_s >= longest_s {
        note(&format!(
            "--restart-every {restart_every_s}: no recording is longer ({longest_s:.2} s at most), so that rollouts are never restarted"
        ));
    }
}

/// Writes out control characters and other invisible ones, except line ends and tabs.
pub(super) fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c.escape_unicode().to_string())
}

pub(super) fn printable_json(text: &str) -> Cow<'_, str> {
    // JSON's own are escaped already, so all others are in strings.
    escaped(text, |c| {
        let units = c.encode_utf16(&mut [0; 2]).to_vec();
        units.iter().map(|unit| format!("\\u{unit:04x}")).collect()
    })
}

fn escaped(text: &str, written: impl Fn(char) -> String) -> Cow<'_, str> {
    let acts = |c: char| is_invisible(c) && !matches!(c, '\n' | '\t');
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let shown = |c| if acts(c) { written(c) } else { c.into() };
    text.chars().map(shown).collect()
}

/// Each item after the same words, on lines that fit a terminal.
pub(super) fn lines<T: Display>(words: &str, items: impl IntoIterator<Item = T>) -> String {
    let lines = items
        .into_iter()
        .map(|item| fitted(&format!("{words}{item}")));
    lines.collect()
}

/// Text on lines that fit a terminal; those after the first are indented by two more characters. Text with lines, such
/// as a table, is unchanged.
pub(super) fn fitted(text: &str) -> String {
    let bare = text.trim_start_matches([' ', '\n']);
    if bare.contains('\n') {
        return format!("{text}\n");
    }
    let start = &text[..text.len() - bare.len()];
    let indent = start.matches(' ').count();
    let lines = wrapped(bare, COLUMNS - 2 - indent);
    let joint = format!("\n{}", " ".repeat(indent + 2));
    format!("{start}{}\n", lines.join(&joint))
}

pub(super) fn shown(path: &Option<PathBuf>) -> Option<String> {
    path.as_ref().map(|path| path.display().to_string())
}

pub(super) fn names(paths: &[PathBuf]) -> Vec<String> {
    let names = paths.iter().map(|path| path.display().to_string());
    names.collect()
}

pub(super) fn numbered(name: &str, count: usize) -> impl Iterator<Item = String> {
    (1..=count).map(move |index| format!("{name}_{index}"))
}

pub(super) fn extend(object: &mut Value, more: Value) {
    if let (Value::Object(object), Value::Object(more)) = (object, more) {
        object.extend(more);
    }
}

pub(super) fn named(given: Option<&str>, output: &Path) -> String {
    let stem = (output.file_stem()).expect("an output without a name is refused");
    given.map_or_else(|| stem.to_string_lossy().into_owned(), str::to_owned)
}

pub(super) fn spinner(message: &'static str) -> ProgressBar {
    let bar = styled(ProgressBar::new_spinner(), ELAPSED);
    bar.enable_steady_tick(Duration::from_millis(120));
    bar.with_message(message)
}

/// Progress of work in several steps, with an estimate of the remaining time.
pub(super) fn progress_bar(message: impl Into<String>, steps: usize) -> ProgressBar {
    let bar = styled(ProgressBar::new(steps as u64), ESTIMATED);
    bar.enable_steady_tick(Duration::from_secs(1));
    bar.with_message(message.into())
}

/// Begins a part of the work with this number of steps, or an unknown number.
pub(super) fn begin_part(bar: &ProgressBar, message: &'static str, steps: Option<usize>) {
    bar.set_message(message);
    bar.set_style(style(steps.map_or(ELAPSED, |_| ESTIMATED)));
    bar.set_length(steps.unwrap_or(0) as u64);
    bar.set_position(0);
    bar.reset_eta();
}

const ELAPSED: &str = "{spinner} {msg} [{elapsed}]";
const ESTIMATED: &str = "{msg} {wide_bar} {percent} %{left}";

fn styled(bar: ProgressBar, template: &str) -> ProgressBar {
    bar.with_style(style(template))
}

fn style(template: &str) -> ProgressStyle {
    let style = ProgressStyle::with_template(template).expect("templates are constants");
    style.with_key(
        "left",
        |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            if state.pos() > 0 {
                let _ = write!(text, ", {:#} left", HumanDuration(state.eta()));
            }
        },
    )
}

pub(super) fn show_progress(bar: &ProgressBar, done: usize, total: usize) {
    bar.set_length(total as u64);
    bar.set_position(done as u64);
}

/// Paths quoted for a shell, in one line.
pub(super) fn quoted_all(paths: &[PathBuf]) -> String {
    let words: Vec<String> = paths.iter().map(|path| quoted(path)).collect();
    words.join(" ")
}

pub(super) fn set<T>(option: &mut T, given: Option<impl Into<T>>) {
    if let Some(value) = given {
        *option = value.into();
    }
}
