//! Folders of ROS 2 bags: the MCAP files that one recording was split into.

use std::fs;
use std::path::{Path, PathBuf};

use crate::files::size::{Format, read_text_capped};
use crate::recording::error::{RecordingError, RecordingFault};

/// The list of files in a bag's folder.
const METADATA: &str = "metadata.yaml";
/// Endings of files that bags are made of.
const ENDINGS: [&str; 4] = [".mcap", ".db3", ".mcap.zstd", ".mcap.zst"];

/// Whether a path is a folder with the files of a bag.
pub(super) fn is_bag(path: &Path) -> bool {
    path.is_dir() && (path.join(METADATA).is_file() || !parts(path).is_empty())
}

/// The files of a log: the path itself, or those of the bag that the folder is; and notes on files that are left out.
pub(super) fn files(path: &Path) -> Result<(Vec<PathBuf>, Vec<String>), RecordingError> {
    if !path.is_dir() {
        return Ok((vec![path.to_owned()], Vec::new()));
    }
    let listed = listed(path)?;
    if let Some(absent) = listed.iter().find(|file| !file.is_file()) {
        return Err(RecordingFault::Missing.of(absent));
    }
    let is_listed = !listed.is_empty();
    let (mut files, unlisted) = match is_listed {
        false => (parts(path), Vec::new()),
        true => {
            let others = parts(path)
                .into_iter()
                .filter(|file| !listed.contains(file));
            let note =
                |file: PathBuf| format!("{}: not in {METADATA}, and left out", file.display());
            let notes = others.map(note).collect();
            (listed, notes)
        }
    };
    // rosbag2 calls the parts of a bag NAME_0.mcap, NAME_1.mcap and so on.
    let part = |file: &Path| -> Option<(String, usize)> {
        let name = file.file_stem()?.to_str()?;
        let (name, number) = name
            .split_once('.')
            .map_or(name, |(name, _)| name)
            .rsplit_once('_')?;
        Some((name.to_owned(), number.parse().ok()?))
    };
    files.sort_by_cached_key(|file| (part(file), file.clone()));
    let is_one = |pair: &[PathBuf]| {
        let [one, other] = [&pair[0], &pair[1]].map(|file| part(file).map(|(name, _)| name));
        one.is_some() && one == other
    };
    if files.is_empty() || (!path.join(METADATA).is_file() && !files.windows(2).all(is_one)) {
        let found = format!(
            "a folder of {} MCAP files without metadata.yaml that are not NAME_0.mcap, NAME_1.mcap and so on",
            files.len()
        );
        let expected = "the parts of one bag; give separate recordings one by one: FOLDER/*.mcap";
        return Err(RecordingFault::unexpected(found, expected).of(path));
    }
    // Without a list, a number that is left out is a file that is lost.
    let lost = files.windows(2).filter(|_| !is_listed).find_map(|pair| {
        let ((name, one), (_, other)) = (part(&pair[0])?, part(&pair[1])?);
        let file = pair[0].file_name()?.to_str()?;
        let ending = file.strip_prefix(&format!("{name}_{one}"))?;
        (other > one + 1).then(|| path.join(format!("{name}_{}{ending}", one + 1)))
    });
    match lost {
        Some(lost) => Err(RecordingFault::Missing.of(&lost)),
        None => Ok((files, unlisted)),
    }
}

/// The files that a bag's list names.
fn listed(folder: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let path = folder.join(METADATA);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = read_text_capped(&path, Format::Settings)
        .map_err(|source| RecordingFault::unreadable("read", source).of(&path))?;
    let mut lines = text.lines().map(str::trim);
    let Some(first) = lines.find_map(|line| line.strip_prefix("relative_file_paths:")) else {
        return Ok(Vec::new());
    };
    let in_line = first.trim().trim_matches(['[', ']']).split(',');
    let below = lines.map_while(|line| line.strip_prefix('-'));
    let names = in_line
        .chain(below)
        .map(|name| name.trim().trim_matches(['"', '\'']));
    // A list may name the folder too; files elsewhere are not the bag's.
    let names = names.filter_map(|name| Path::new(name).file_name());
    Ok(names.map(|name| folder.join(name)).collect())
}

/// The files in a folder that bags are made of.
fn parts(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_part = |path: &PathBuf| {
        let name = path.to_string_lossy().to_lowercase();
        ENDINGS.iter().any(|ending| name.ends_with(ending)) && path.is_file()
    };
    entries.map(|entry| entry.path()).filter(is_part).collect()
}
