//! Formats that are recognised by their first bytes and read by other programs, each with a line that makes a text table
//! or an MCAP log of it: one table.

use std::path::Path;

use super::shell_path;

/// Bytes that [`recognised`] needs of a file.
pub const MAGIC_BYTES: usize = 512;

/// First bytes of an MCAP file.
pub const MCAP: &[u8] = b"\x89MCAP0\r\n";

/// A row: offset of the bytes, the bytes, name of the format, and the line that converts it, in which `<in>` is the file, `<out>` its
/// name without ending; a line that begins with `:` is Python with NumPy and pandas, up to the table or the arrays `a`.
type Row = (usize, &'static [u8], &'static str, &'static str);

const PICKLE: &str = "a Python pickle, which runs code when it is read";
const FROM_PICKLE: &str =
    ":pd.DataFrame(pd.read_pickle(sys.argv[1])).to_csv(sys.argv[2], index=False)";
const SPREADSHEET: &str = "libreoffice --headless --convert-to csv <in>";
const UTF_8: &str = "iconv -f UTF-16 -t UTF-8 <in> > <out>.utf8.csv";
const WEB_PAGE: &str = "curl -L -o <in> ADDRESS_OF_THE_RAW_FILE";

/// Earlier rows apply before later ones.
const TABLE: &[Row] = &[
    (
        0,
        b"version https://git-lfs",
        "a pointer of git LFS, not the file itself",
        "git lfs pull --include <in>",
    ),
    (
        0,
        b"SQLite format 3\0",
        "an SQLite file (.db3), as ROS 2 bags are",
        "mcap convert <in> <out>.mcap",
    ),
    (
        0,
        b"#ROSBAG",
        "a bag of ROS 1",
        "mcap convert <in> <out>.mcap",
    ),
    (
        0,
        b"PAR1",
        "a Parquet file",
        ":pd.read_parquet(sys.argv[1]).to_csv(sys.argv[2], index=False)",
    ),
    (
        0,
        b"ARROW1",
        "a Feather file",
        ":pd.read_feather(sys.argv[1]).to_csv(sys.argv[2], index=False)",
    ),
    (
        0,
        b"MATLAB 7.3",
        "a .mat file of MATLAB 7.3",
        ":import mat73; a = mat73.loadmat(sys.argv[1])",
    ),
    (
        0,
        b"MATLAB 5.0",
        "a .mat file of MATLAB",
        ":import scipy.io; a = scipy.io.loadmat(sys.argv[1])",
    ),
    (
        0,
        b"\x89HDF\r\n\x1a\n",
        "an HDF5 file",
        ":import h5py; a = h5py.File(sys.argv[1])",
    ),
    (
        0,
        b"\x93NUMPY",
        "a NumPy array (.npy)",
        ":a = {'c': np.load(sys.argv[1])}",
    ),
    (30, b"[Content_Types].xml", "a spreadsheet", SPREADSHEET),
    (
        30,
        b"mimetypeapplication/vnd.oasis",
        "a spreadsheet",
        SPREADSHEET,
    ),
    (0, b"\xd0\xcf\x11\xe0", "a spreadsheet", SPREADSHEET),
    (0, b"PK\x03\x04", "a zip archive", "unzip <in>"),
    (0, b"\x80\x02", PICKLE, FROM_PICKLE),
    (0, b"\x80\x03", PICKLE, FROM_PICKLE),
    (0, b"\x80\x04", PICKLE, FROM_PICKLE),
    (0, b"\x80\x05", PICKLE, FROM_PICKLE),
    (
        0,
        b"\x28\xb5\x2f\xfd",
        "a file packed by zstd",
        "zstd -d <in> -o <out>",
    ),
    (
        0,
        b"\xfd7zXZ\0",
        "a file packed by xz",
        "xz -d -c <in> > <out>",
    ),
    (
        0,
        b"BZh",
        "a file packed by bzip2",
        "bzip2 -d -c <in> > <out>",
    ),
    (
        0,
        b"\x04\x22\x4d\x18",
        "a file packed by lz4",
        "lz4 -d <in> <out>",
    ),
    (
        0,
        b"\x1f\x8b",
        "a file packed by gzip",
        "gunzip -c <in> > <out>",
    ),
    (0, b"7z\xbc\xaf\x27\x1c", "a 7z archive", "7z x <in>"),
    (257, b"ustar", "a tar archive", "tar -xf <in>"),
    (
        0,
        b"ULog\x01\x12\x35",
        "a log of PX4 (ULog)",
        "ulog2csv <in>",
    ),
    (0, b"\xff\xfe", "text in UTF-16", UTF_8),
    (0, b"\xfe\xff", "text in UTF-16", UTF_8),
    (0, b"<!DOCTYPE html", "a web page", WEB_PAGE),
    (0, b"<!doctype html", "a web page", WEB_PAGE),
    (0, b"<html", "a web page", WEB_PAGE),
];

/// Another format: its name, and a line to type that converts it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OtherFormat {
    /// What it is, with its article.
    pub what: &'static str,
    /// The line.
    pub remedy: String,
}

/// What a file of these first bytes is, if it is in the table.
pub fn recognised(path: &Path, start: &[u8]) -> Option<OtherFormat> {
    let has = |at: usize, bytes: &[u8]| start.get(at..).is_some_and(|rest| rest.starts_with(bytes));
    let row = TABLE.iter().find(|(at, bytes, ..)| has(*at, bytes));
    let (_, _, what, line) = *row?;
    let (what, line) = match first_member(start) {
        Some(member) if member.ends_with(b".npy") => {
            ("NumPy arrays (.npz)", ":a = np.load(sys.argv[1])")
        }
        Some(_) | None => (what, line),
    };
    let stem = path.with_extension("");
    let remedy = match line.strip_prefix(':') {
        None => line
            .replace("<in>", &shell_path(path))
            .replace("<out>", &shell_path(&stem)),
        Some(code) => {
            let columns = match code.ends_with("index=False)") {
                true => "",
                false => TO_COLUMNS,
            };
            let with_ending = |end: &str| {
                let name = stem.file_name().unwrap_or_default().to_string_lossy();
                stem.with_file_name(format!("{name}{end}"))
            };
            let table = match with_ending(".csv") {
                same if same == path => with_ending("-table.csv"),
                other => other,
            };
            format!(
                "python3 -c \"import sys, numpy as np, pandas as pd; {code}{columns}\" {} {}",
                shell_path(path),
                shell_path(&table)
            )
        }
    };
    Some(OtherFormat { what, remedy })
}

/// Arrays by name become columns; those of two axes one for each of the second.
const TO_COLUMNS: &str = "; c = {k: np.squeeze(a[k]) for k in a if k[:2] != '__'}; \
     pd.DataFrame({k if v.ndim < 2 else f'{k}_{i}': v.reshape(len(v), -1)[:, i] for k, v in c.items() if v.ndim \
     for i in range(v.size // len(v))}).to_csv(sys.argv[2], index=False)";

/// The name of the first member of a zip archive.
fn first_member(start: &[u8]) -> Option<&[u8]> {
    let length = start.strip_prefix(b"PK\x03\x04")?.get(22..24)?;
    start.get(30..30 + usize::from(u16::from_le_bytes([length[0], length[1]])))
}
