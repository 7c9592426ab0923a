//! MCAP files as logs, one log per topic and set of names; the only file that reads with the `mcap` crate.
//!
//! Records are read one by one and chunks unpacked one at a time. Checksums that are there are compared. A file that ends
//! early, as after a loss of power, gives what its whole records and chunks hold.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;

use flate2::Crc;
use mcap::read::parse_record;
use mcap::records::{ChunkHeader, Record, op};
use ruzstd::decoding::{FrameDecoder, StreamingDecoder};

use super::bag;
use super::log::Log;
use super::topics::Topics;
use crate::files::magic::{MAGIC_BYTES, MCAP, recognised};
use crate::files::size::{Capped, Format};
use crate::recording::error::{RecordingError, RecordingFault};

/// Bytes of a record before its contents: its kind and their length.
const RECORD_HEADER: usize = 9;
/// Window of a zstd frame that every chunk may have, in bytes.
const LEAST_WINDOW: u64 = 1 << 23;

/// Whether a file is an MCAP log, by its name or its first bytes, or a folder with those of a bag. Pipes are not read
/// from to find out.
pub(in crate::recording) fn is_mcap(path: &Path) -> bool {
    let has_ending = |ending: &str| {
        let found = path.extension();
        found.is_some_and(|found| found.eq_ignore_ascii_case(ending))
    };
    let begins = || {
        let mut start = Vec::new();
        let file = File::open(path).map(|file| file.take(MCAP.len() as u64));
        let read = file.and_then(|mut file| file.read_to_end(&mut start));
        read.is_ok() && start == MCAP
    };
    bag::is_bag(path) || has_ending("mcap") || (path.is_file() && begins())
}

/// Reads every topic whose messages are numbers; others have their fault.
pub(in crate::recording) fn read_mcap(path: &Path) -> Result<Vec<Log>, RecordingError> {
    let mut topics = Topics::default();
    let (files, mut notes) = bag::files(path)?;
    for file in files {
        let open = File::open(&file);
        let open = open.map_err(|source| RecordingFault::unreadable("read", source).of(&file))?;
        topics.begin_file();
        let mut scan = Scan::new(BufReader::new(open), &mut topics);
        let Some(early) = scan.whole(&file).map_err(|fault| fault.of(&file))? else {
            continue;
        };
        // Nothing of a recording's last file may have come to the disk.
        if topics.messages == 0 {
            return Err(RecordingFault::Mcap(early).of(&file));
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

struct Scan<'a, R> {
    source: R,
    topics: &'a mut Topics,
    offset: u64,
    /// Checksum of the present section: the data, or the summary behind it.
    section: Crc,
    chunks: usize,
    packed: u64,
    unpacked: u64,
}

impl<'a, R: Read> Scan<'a, R> {
    fn new(source: R, topics: &'a mut Topics) -> Self {
        Self {
            source,
            topics,
            offset: 0,
            section: Crc::new(),
            chunks: 0,
            packed: 0,
            unpacked: 0,
        }
    }

    /// Reads all records; words for a file that ends before its end.
    fn whole(&mut self, path: &Path) -> Result<Option<String>, RecordingFault> {
        let before = self.topics.messages;
        let mut next = match self.magic(path)? {
            true => self.next()?,
            false => None,
        };
        while let Some((at, header, body)) = next {
            if self.take(&header, &body, at)? {
                return Ok(None);
            }
            next = self.next()?;
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
    fn magic(&mut self, path: &Path) -> Result<bool, RecordingFault> {
        let mut start = self.bytes(MCAP.len() as u64)?;
        if start == MCAP {
            self.section.update(&start);
            return Ok(true);
        }
        if MCAP.starts_with(&start)
            || (start.iter().all(|byte| *byte == 0) && self.is_zero_to_the_end()?)
        {
            return Ok(false);
        }
        start.extend(self.bytes((MAGIC_BYTES - MCAP.len()) as u64)?);
        Err(match recognised(path, &start) {
            Some(format) => RecordingFault::other_format(&format),
            None => RecordingFault::Mcap("it begins with other bytes".to_owned()),
        })
    }

    /// The next record: its place, header and contents; none where the file ends before that.
    fn next(&mut self) -> Result<Option<(u64, Vec<u8>, Vec<u8>)>, RecordingFault> {
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

    /// Adds a record that begins at this byte; whether it is the last.
    fn take(&mut self, header: &[u8], body: &[u8], at: u64) -> Result<bool, RecordingFault> {
        let damaged = |words: String| damaged(&format!("the record at byte {at}"), words);
        let record = parsed(header[0], body).map_err(damaged)?;
        let is_last = matches!(record, Some(Record::Footer(_)));
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
            let found = std::mem::take(&mut self.section).sum();
            same_checksum(stated, found).map_err(damaged)?;
        }
        match record {
            Some(Record::Chunk { header, data }) => self.chunk(&header, data, at)?,
            Some(record) => add(self.topics, record).map_err(damaged)?,
            None => {}
        }
        Ok(is_last)
    }

    /// Up to so many bytes: fewer at the end of the file.
    fn bytes(&mut self, count: u64) -> Result<Vec<u8>, RecordingFault> {
        let mut bytes = Vec::new();
        let read = (&mut self.source).take(count).read_to_end(&mut bytes);
        read.map_err(|source| RecordingFault::io("read", source))?;
        self.offset += bytes.len() as u64;
        Ok(bytes)
    }

    /// Whether nothing but zeros follow, as a file system may leave them.
    fn is_zero_to_the_end(&mut self) -> Result<bool, RecordingFault> {
        loop {
            let bytes = self.bytes(1 << 16)?;
            if bytes.is_empty() {
                return Ok(true);
            }
            if bytes.iter().any(|byte| *byte != 0) {
                return Ok(false);
            }
        }
    }

    fn chunk(
        &mut self,
        header: &ChunkHeader,
        data: Cow<'_, [u8]>,
        at: u64,
    ) -> Result<(), RecordingFault> {
        self.chunks += 1;
        let damaged =
            |words: String| damaged(&format!("chunk {} at byte {at}", self.chunks), words);
        self.packed += data.len() as u64;
        let most = Format::Chunk.most_unpacked(self.packed);
        let left = most.saturating_sub(self.unpacked);
        let bytes = unpacked(header, data, left).map_err(damaged)?;
        self.unpacked += bytes.len() as u64;
        if header.uncompressed_crc != 0 {
            let mut crc = Crc::new();
            crc.update(&bytes);
            same_checksum(header.uncompressed_crc, crc.sum()).map_err(damaged)?;
        }
        let mut rest = &bytes[..];
        while !rest.is_empty() {
            let split = rest
                .split_first_chunk::<RECORD_HEADER>()
                .and_then(|(header, rest)| {
                    let length = u64::from_le_bytes(*header.last_chunk()?);
                    Some((
                        header[0],
                        rest.split_at_checked(usize::try_from(length).ok()?)?,
                    ))
                });
            let (kind, (body, behind)) =
                split.ok_or_else(|| damaged("it ends within a record".to_owned()))?;
            match parsed(kind, body).map_err(damaged)? {
                Some(Record::Chunk { .. }) => {
                    return Err(damaged("a chunk within a chunk".to_owned()));
                }
                Some(record) => add(self.topics, record).map_err(damaged)?,
                None => {}
            }
            rest = behind;
        }
        Ok(())
    }
}

/// A record; none for an attachment, whose checksum is compared.
fn parsed(kind: u8, body: &[u8]) -> Result<Option<Record<'_>>, String> {
    if kind != op::ATTACHMENT {
        return parse_record(kind, body)
            .map(Some)
            .map_err(|error| error.to_string());
    }
    let ends = "an attachment without checksum";
    let (contents, stated) = body.split_last_chunk::<4>().ok_or(ends)?;
    let mut crc = Crc::new();
    crc.update(contents);
    same_checksum(u32::from_le_bytes(*stated), crc.sum())?;
    Ok(None)
}

/// Adds what a record says of topics; indices, statistics and attachments say nothing.
fn add(topics: &mut Topics, record: Record<'_>) -> Result<(), String> {
    match record {
        Record::Schema { header, data } => topics.schema(header, data.into_owned()),
        Record::Channel(channel) => topics.channel(&channel)?,
        Record::Message { header, data } => {
            topics.message(header.channel_id, header.log_time, &data)?;
        }
        _ => {}
    }
    Ok(())
}

fn damaged(place: &str, words: String) -> RecordingFault {
    RecordingFault::Mcap(format!("{place}: {words}"))
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

fn unpacked<'a>(
    header: &ChunkHeader,
    data: Cow<'a, [u8]>,
    left: u64,
) -> Result<Cow<'a, [u8]>, String> {
    let size = header.uncompressed_size;
    if size > left {
        let packed = data.len();
        return Err(format!(
            "{packed} bytes that unpack to {size}, expected at most {left}"
        ));
    }
    let mut out = Vec::new();
    let mut read =
        |source: &mut dyn Read| Capped::new(source, Format::Chunk, size).read_to_end(&mut out);
    let read: io::Result<usize> = match &header.compression[..] {
        "" => return exact(data, size),
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
    exact(Cow::Owned(out), size)
}

fn exact(bytes: Cow<'_, [u8]>, size: u64) -> Result<Cow<'_, [u8]>, String> {
    match bytes.len() as u64 == size {
        true => Ok(bytes),
        false => Err(format!("{} bytes, expected {size}", bytes.len())),
    }
}
