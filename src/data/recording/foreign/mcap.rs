//! MCAP files as logs, one per topic and set of names; the only file that reads with the `mcap` crate. Records are read
//! one by one and chunks unpacked one at a time. Of a file that ends early, all complete records and chunks are used.
//! Folders of ROS 2 bags contain the MCAP files of one recording that was split.

use std::fs::{self, File};
use std::io::{BufReader, Read};

use ::mcap::read::parse_record;
use ::mcap::records::{ChunkHeader, Record, op};
use flate2::Crc;
use ruzstd::decoding::{FrameDecoder, StreamingDecoder};

use super::topics::Topics;
use super::*;
use crate::files::magic::{MAGIC_BYTES, MCAP, recognised};
use crate::files::size::{Capped, Format, read_text_capped};

const RECORD_HEADER: usize = 9; // bytes of a record before its contents: its kind and their length
const LEAST_WINDOW: u64 = 1 << 23; // window of a zstd frame that every chunk may have, in bytes

/// Whether a file is an MCAP log, by its name or its first bytes, which are not read of a pipe, or a bag's folder.
pub(crate) fn is_mcap(path: &Path) -> bool {
    let ending = path.extension();
    let begins = || {
        let mut start = Vec::new();
        let file = File::open(path).map(|file| file.take(MCAP.len() as u64));
        let read = file.and_then(|mut file| file.read_to_end(&mut start));
        read.is_ok() && start == MCAP
    };
    // A bag is the folder of its files and, mostly, the list of them.
    (path.is_dir() && (path.join(METADATA).is_file() || !parts(path).is_empty()))
        || ending.is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"))
        || (path.is_file() && begins())
}

/// Reads every topic whose messages are numbers; others have their fault.
pub(crate) fn read_mcap(path: &Path) -> Outcome<Vec<Log>> {
    let mut topics = Topics::default();
    let (files, mut notes) = files(path)?;
    for file in files {
        let open = File::open(&file).map_err(|source| io_fault("read", source).of(&file))?;
        topics.begin_file();
        let mut scan = Scan {
            source: BufReader::new(open),
            topics: &mut topics,
            offset: 0,
            section: Crc::new(),
            chunks: 0,
            packed: 0,
            unpacked: 0,
        };
        let Some(early) = scan.whole(&file).map_err(|fault| fault.of(&file))? else {
            continue;
        };
        // Nothing of a recording's last file may have come to the disk.
        if topics.messages == 0 {
            return Err(RecordingFault::mcap(early).of(&file));
        }
        notes.push(match path == file {
            true => early,
            false => format!("{}: {early}", file.display()),
        });
    }
    let mut logs = topics.logs().map_err(|fault| fault.of(path))?;
    for log in &mut logs {
        log.path = path.to_owned();
        log.notes.splice(0..0, notes.iter().cloned());
    }
    Ok(logs)
}

type Raw = (u64, Vec<u8>, Vec<u8>); // of a record: first byte in the file, header, contents

struct Scan<'a, R> {
    source: R,
    topics: &'a mut Topics,
    offset: u64,
    section: Crc, // checksum of the present section: the data, or the summary behind it
    chunks: usize,
    packed: u64,
    unpacked: u64,
}

impl<R: Read> Scan<'_, R> {
    /// Reads all records; words for a file that ends before its end.
    fn whole(&mut self, path: &Path) -> Checked<Option<String>> {
        let before = self.topics.messages;
        if self.magic(path)? {
            while let Some((at, header, body)) = self.next()? {
                let damaged = |words| damaged(&format!("the record at byte {at}"), words);
                match parsed(header[0], &body).map_err(damaged)? {
                    Some(Record::Chunk { header: own, data }) => {
                        self.section.update(&header);
                        self.section.update(&body);
                        self.chunk(&own, data, at)?;
                    }
                    record => {
                        let is_last = matches!(record, Some(Record::Footer(_)));
                        self.take(&header, &body, record).map_err(damaged)?;
                        if is_last {
                            return Ok(None);
                        }
                    }
                }
            }
        }
        let messages = self.topics.messages - before;
        let (offset, chunks) = (self.offset, self.chunks);
        Ok(Some(match messages {
            0 => format!("it ends after {offset} bytes, before a whole chunk with messages"),
            _ => format!(
                "the file ends early, after {offset} bytes: {messages} messages are read, of {chunks} whole chunks"
            ),
        }))
    }

    /// The first bytes of the file; none if it ends within them or holds zeros alone.
    fn magic(&mut self, path: &Path) -> Checked<bool> {
        let mut start = self.bytes(MCAP.len() as u64)?;
        if start == MCAP {
            self.section.update(&start);
            return Ok(true);
        }
        let is_zero = start.iter().all(|byte| *byte == 0);
        if MCAP.starts_with(&start) || (is_zero && self.is_zero_to_the_end()?) {
            return Ok(false);
        }
        start.extend(self.bytes((MAGIC_BYTES - MCAP.len()) as u64)?);
        Err(match recognised(path, &start) {
            Some(format) => RecordingFault::other_format(&format),
            None => RecordingFault::mcap("it begins with other bytes"),
        })
    }

    /// The next record: its place, header and contents; none where the file ends before that.
    fn next(&mut self) -> Checked<Option<Raw>> {
        let at = self.offset;
        let header = self.bytes(RECORD_HEADER as u64)?;
        let Some(length) = header.get(1..).and_then(|length| length.try_into().ok()) else {
            return Ok(None);
        };
        let length = u64::from_le_bytes(length);
        if header[0] == 0 && length == 0 && self.is_zero_to_the_end()? {
            return Ok(None);
        }
        let refused = |words: String| Err(damaged(&format!("the record at byte {at}"), words));
        let most = Format::Chunk.most_bytes();
        if length > most {
            return refused(format!("{length} bytes, expected at most {most}"));
        }
        let body = self.bytes(length)?;
        match body.len() as u64 == length {
            true => Ok(Some((at, header, body))),
            // The end of the file is there: it was not cut off.
            false if body.ends_with(MCAP) => {
                refused(format!("{length} bytes, which the file does not have"))
            }
            false => Ok(None),
        }
    }

    /// Adds a record of the file that is no chunk.
    fn take(&mut self, header: &[u8], body: &[u8], record: Option<Record>) -> Result<(), String> {
        // How much of a record that ends a section its checksum covers, and that checksum.
        let end = match &record {
            Some(Record::DataEnd(end)) => Some((0, end.data_section_crc)),
            Some(Record::Footer(footer)) => Some((body.len() - 4, footer.summary_crc)),
            _ => None,
        };
        let covered = end.map_or(body.len(), |(covered, _)| covered);
        if end.is_none() || covered > 0 {
            self.section.update(header);
            self.section.update(&body[..covered]);
        }
        if let Some((_, stated)) = end {
            same_checksum(stated, std::mem::take(&mut self.section).sum())?;
        }
        record.map_or(Ok(()), |record| add(self.topics, record))
    }

    /// Up to so many bytes: fewer at the end of the file.
    fn bytes(&mut self, count: u64) -> Checked<Vec<u8>> {
        let mut bytes = Vec::new();
        let read = (&mut self.source).take(count).read_to_end(&mut bytes);
        read.map_err(|source| io_fault("read", source))?;
        self.offset += bytes.len() as u64;
        Ok(bytes)
    }

    /// Whether nothing but zeros follow, as a file system may leave them.
    fn is_zero_to_the_end(&mut self) -> Checked<bool> {
        loop {
            let bytes = self.bytes(1 << 16)?;
            if bytes.is_empty() || bytes.iter().any(|byte| *byte != 0) {
                return Ok(bytes.is_empty());
            }
        }
    }

    fn chunk(&mut self, header: &ChunkHeader, data: Cow<[u8]>, at: u64) -> Checked<()> {
        self.chunks += 1;
        self.packed += data.len() as u64;
        let place = format!("chunk {} at byte {at}", self.chunks);
        let read = self.records(header, data);
        read.map_err(|words| damaged(&place, words))
    }

    fn records(&mut self, header: &ChunkHeader, data: Cow<[u8]>) -> Result<(), String> {
        let most = Format::Chunk.most_unpacked(self.packed);
        let bytes = unpacked(header, data, most.saturating_sub(self.unpacked))?;
        self.unpacked += bytes.len() as u64;
        if header.uncompressed_crc != 0 {
            same_checksum(header.uncompressed_crc, checksum(&bytes))?;
        }
        let split = |rest: &[u8]| -> Option<(u8, usize)> {
            let (header, rest) = rest.split_first_chunk::<RECORD_HEADER>()?;
            let length = usize::try_from(u64::from_le_bytes(*header.last_chunk()?)).ok()?;
            (length <= rest.len()).then_some((header[0], length))
        };
        let mut rest = &bytes[..];
        while !rest.is_empty() {
            let (kind, length) = split(rest).ok_or("it ends within a record")?;
            let (body, behind) = rest[RECORD_HEADER..].split_at(length);
            match parsed(kind, body)? {
                Some(Record::Chunk { .. }) => return Err("a chunk within a chunk".to_owned()),
                Some(record) => add(self.topics, record)?,
                None => {}
            }
            rest = behind;
        }
        Ok(())
    }
}

fn checksum(bytes: &[u8]) -> u32 {
    let mut crc = Crc::new();
    crc.update(bytes);
    crc.sum()
}

/// A record; none for an attachment, whose checksum is compared.
fn parsed(kind: u8, body: &[u8]) -> Result<Option<Record<'_>>, String> {
    if kind != op::ATTACHMENT {
        let record = parse_record(kind, body);
        return record.map(Some).map_err(|error| error.to_string());
    }
    let ends = "an attachment without checksum";
    let (contents, stated) = body.split_last_chunk::<4>().ok_or(ends)?;
    same_checksum(u32::from_le_bytes(*stated), checksum(contents))?;
    Ok(None)
}

/// Adds the definitions and messages of a record to the topics; indices, statistics and attachments are ignored.
fn add(topics: &mut Topics, record: Record<'_>) -> Result<(), String> {
    match record {
        Record::Schema { header, data } => topics.schema(header, data.into_owned()),
        Record::Channel(channel) => topics.channel(channel)?,
        Record::Message { header, data } => {
            topics.message(header.channel_id, header.log_time, &data)?;
        }
        _ => {}
    }
    Ok(())
}

fn damaged(place: &str, words: String) -> RecordingFault {
    RecordingFault::mcap(format!("{place}: {words}"))
}

/// Compares checksums; a stated one of 0 is absent.
fn same_checksum(stated: u32, found: u32) -> Result<(), String> {
    match stated == 0 || stated == found {
        true => Ok(()),
        false => Err(format!(
            "its bytes have the checksum {found:#010x}, expected {stated:#010x}: they were changed \
             (`mcap recover` keeps the sound chunks)"
        )),
    }
}

type Bytes<'a> = Cow<'a, [u8]>;

fn unpacked<'a>(header: &ChunkHeader, data: Bytes<'a>, left: u64) -> Result<Bytes<'a>, String> {
    let size = header.uncompressed_size;
    if size > left {
        let packed = format!("{} bytes that unpack to {size}", data.len());
        return Err(format!("{packed}, expected at most {left}"));
    }
    let mut out = Vec::new();
    let mut read =
        |source: &mut dyn Read| Capped::new(source, Format::Chunk, size).read_to_end(&mut out);
    let read = match &header.compression[..] {
        "" => Ok(0),
        "zstd" => {
            let mut frame = FrameDecoder::new();
            frame.set_max_window_size(size.next_power_of_two().max(LEAST_WINDOW));
            let decoder = StreamingDecoder::new_with_decoder(&data[..], frame);
            read(&mut decoder.map_err(|error| format!("zstd: {error}"))?)
        }
        "lz4" => read(&mut lz4_flex::frame::FrameDecoder::new(&data[..])),
        other => return Err(format!("packed by `{other}`, expected zstd, lz4 or none")),
    };
    read.map_err(|error| format!("{}: {error}", header.compression))?;
    let is_plain = header.compression.is_empty();
    let bytes = if is_plain { data } else { out.into() };
    match bytes.len() as u64 == size {
        true => Ok(bytes),
        false => Err(format!("{} bytes, expected {size}", bytes.len())),
    }
}

const METADATA: &str = "metadata.yaml"; // the list of files in a bag's folder
const ENDINGS: [&str; 4] = [".mcap", ".db3", ".mcap.zstd", ".mcap.zst"]; // endings of files that bags are made of

/// The files of a log: the path itself, or those of the bag that the folder is; and notes on files that are left out.
fn files(path: &Path) -> Outcome<(Vec<PathBuf>, Vec<String>)> {
    if !path.is_dir() {
        return Ok((vec![path.to_owned()], Vec::new()));
    }
    let listed = listed(path)?;
    let missing = |file: &Path| Err(text("no such file").of(file));
    if let Some(absent) = listed.iter().find(|file| !file.is_file()) {
        return missing(absent);
    }
    let is_listed = !listed.is_empty();
    let mut files = parts(path);
    let mut unlisted = Vec::new();
    if is_listed {
        let others = files.iter().filter(|file| !listed.contains(file));
        let note = |file: &PathBuf| format!("{}: not in {METADATA}, and left out", file.display());
        unlisted.extend(others.map(note));
        files = listed;
    }
    // rosbag2 calls the parts of a bag NAME_0.mcap, NAME_1.mcap and so on.
    let part = |file: &Path| -> Option<(String, usize)> {
        let stem = file.file_stem()?.to_str()?;
        let (name, number) = stem.split('.').next()?.rsplit_once('_')?;
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
        return Err(unexpected(found, expected).of(path));
    }
    // Without a list, a number that is left out is a file that is lost.
    let lost = files.windows(2).filter(|_| !is_listed).find_map(|pair| {
        let ((name, one), (_, other)) = (part(&pair[0])?, part(&pair[1])?);
        let file = pair[0].file_name()?.to_str()?;
        let ending = file.strip_prefix(&format!("{name}_{one}"))?;
        (other > one + 1).then(|| path.join(format!("{name}_{}{ending}", one + 1)))
    });
    lost.map_or(Ok((files, unlisted)), |lost| missing(&lost))
}

fn listed(folder: &Path) -> Outcome<Vec<PathBuf>> {
    let path = folder.join(METADATA);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = read_text_capped(&path, Format::Settings);
    let text = text.map_err(|source| io_fault("read", source).of(&path))?;
    let mut lines = text.lines().map(str::trim);
    let Some(first) = lines.find_map(|line| line.strip_prefix("relative_file_paths:")) else {
        return Ok(Vec::new());
    };
    let in_line = first.trim().trim_matches(['[', ']']).split(',');
    let below = lines.map_while(|line| line.strip_prefix('-'));
    let names = in_line.chain(below);
    let names = names.map(|name| name.trim().trim_matches(['"', '\'']));
    // A list may name the folder too; files elsewhere are not the bag's.
    let names = names.filter_map(|name| Path::new(name).file_name());
    Ok(names.map(|name| folder.join(name)).collect())
}

fn parts(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_part = |path: &PathBuf| {
        let name = path.to_string_lossy().to_lowercase();
        ENDINGS.iter().any(|ending| name.ends_with(ending)) && path.is_file()
    };
    entries.map(|entry| entry.path()).filter(is_part).collect()
}
