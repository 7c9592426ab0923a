//! Where a command may write: its output says its format by its ending, and is none of the files that the command
//! reads.

use super::args::ReadingArguments;
use super::*;
use crate::files::{Emitted, write_files_since};
use crate::report::{Figure, figure_files};

/// What an output file holds: the endings that it may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Format(&'static [&'static str]);

impl Format {
    pub(super) const TABLE: Self = Self(&[".csv"]);
    pub(super) const RECORDING: Self = Self(&[".csv", ".csv.gz", ".mcap"]);
    pub(super) const MODEL: Self = Self(&[".json"]);
    pub(super) const TOML: Self = Self(&[".toml"]);
    pub(super) const PAGE: Self = Self(&[".html", ".htm"]);
}

/// The files that a command reads, none of which it may replace, forced or not; and the folder that it writes into, as
/// it is when the command begins.
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

    pub(super) fn into_folder(mut self, folder: Option<&Path>) -> Result<Self, Error> {
        self.1 = folder.map(Emitted::of).transpose()?;
        Ok(self)
    }

    /// These and the file of a robot, unless the name is that of one of romc's own.
    pub(super) fn and_robot(self, name: Option<&'a str>) -> Self {
        let is_file = |name: &&str| !crate::robot_file::known_names().contains(name);
        self.and(name.filter(is_file))
    }

    /// Refuses to write a file that is read, by whatever path: it, or the folder that it is in, is an input.
    fn check(&self, output: &Path) -> Result<(), Error> {
        let Ok(place) = output.canonicalize() else {
            return Ok(()); // what is not there is not read
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

    /// Refuses an output by its name alone: a folder, a name that says another format, one of the inputs. What is there
    /// and no file of a disk may have any name.
    pub(super) fn check_name(&self, path: &Path, format: Format) -> Result<(), Error> {
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

    /// Refuses an output that could not be written, before long work begins: by its name, as it is there and may not be
    /// replaced, or as its folder is not.
    pub(super) fn check_output(
        &self,
        path: Option<&Path>,
        format: Format,
        overwrite: Overwrite,
    ) -> Result<(), Error> {
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

    /// Writes files into a folder, none of them one of these, nor one of that name that romc did not make.
    pub(super) fn write_folder(
        &self,
        folder: &Path,
        files: &[EmittedFile],
        overwrite: Overwrite,
    ) -> Result<Vec<PathBuf>, Error> {
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
        figures: impl FnOnce() -> Result<Vec<Figure>, Error>,
        overwrite: Overwrite,
        answer: &mut Answer,
    ) -> Result<(), Error> {
        let Some(folder) = folder else { return Ok(()) };
        let figures = figures()?;
        let files: Vec<EmittedFile> = figures.iter().flat_map(figure_files).collect();
        let written = self.write_folder(folder, &files, overwrite)?;
        answer.text += &format!("{} figures: {}\n", figures.len(), folder.display());
        answer.json["figures"] = names(&written).into();
        Ok(())
    }
}
