//! MCAP files as logs, one log a topic; the only file that reads with the `mcap` crate.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use mcap::read::LinearReader;
use mcap::records::{Channel as Topic, ChunkHeader, Record, SchemaHeader};

use super::log::{Channel, Log};
use super::message::{Definition, Layout, MessageFault, Value};
use crate::recording::csv::MAX_ROWS;
use crate::recording::error::{RecordingError, RecordingFault};
use crate::recording::instant::Instant;

/// Largest chunk unpacked, in bytes.
const LARGEST_CHUNK: u64 = 1 << 30;

/// Reads every topic whose messages are numbers; those of other encodings are left out.
///
/// # Errors
/// [`RecordingFault::Mcap`] for a damaged file, [`RecordingFault::NoTopic`] if nothing can be read.
pub(in crate::recording) fn read_mcap(path: &Path) -> Result<Vec<Log>, RecordingError> {
    let bytes = std::fs::read(path)
        .map_err(|source| RecordingFault::unreadable("read", source).of(path))?;
    let logs = topics(&bytes).and_then(Topics::logs);
    let mut logs = logs.map_err(|fault| fault.of(path))?;
    logs.iter_mut().for_each(|log| log.path = path.to_owned());
    Ok(logs)
}

/// All topics and what does not fit tables.
fn topics(bytes: &[u8]) -> Result<Topics, RecordingFault> {
    let fault = |error: mcap::McapError| RecordingFault::Mcap(error.to_string());
    let mut topics = Topics::default();
    for record in LinearReader::new(bytes).map_err(fault)? {
        match record.map_err(fault)? {
            Record::Chunk { header, data } => {
                let unpacked = unpacked(&header, data).map_err(RecordingFault::Mcap)?;
                for record in LinearReader::sans_magic(&unpacked) {
                    topics.add(record.map_err(fault)?)?;
                }
            }
            record => topics.add(record)?,
        }
    }
    Ok(topics)
}

/// The records of a chunk.
fn unpacked<'a>(header: &ChunkHeader, data: Cow<'a, [u8]>) -> Result<Cow<'a, [u8]>, String> {
    let size = header.uncompressed_size;
    if size > LARGEST_CHUNK {
        return Err(format!(
            "a chunk of {size} bytes, more than {LARGEST_CHUNK}"
        ));
    }
    let mut out = Vec::new();
    let read = match &header.compression[..] {
        "" => return Ok(data),
        "zstd" => {
            let decoder = ruzstd::decoding::StreamingDecoder::new(&data[..]);
            let decoder = decoder.map_err(|error| format!("a zstd chunk: {error}"))?;
            decoder.take(size).read_to_end(&mut out)
        }
        "lz4" => {
            let decoder = lz4_flex::frame::FrameDecoder::new(&data[..]);
            decoder.take(size).read_to_end(&mut out)
        }
        other => {
            return Err(format!(
                "chunks packed by `{other}`, expected zstd, lz4 or none"
            ));
        }
    };
    read.map_err(|error| format!("a {} chunk: {error}", header.compression))?;
    match out.len() as u64 == size {
        true => Ok(Cow::Owned(out)),
        false => Err(format!("a chunk of {} bytes, expected {size}", out.len())),
    }
}

/// A topic in the making.
struct Open {
    log: Log,
    definition: Definition,
    layout: Layout,
    /// The first thing that does not fit a table.
    fault: Option<MessageFault>,
}

#[derive(Default)]
struct Topics {
    schemas: BTreeMap<u16, (SchemaHeader, Vec<u8>)>,
    open: BTreeMap<u16, Open>,
    refused: Vec<(String, MessageFault)>,
}

impl Topics {
    fn add(&mut self, record: Record<'_>) -> Result<(), RecordingFault> {
        match record {
            Record::Schema { header, data } => {
                self.schemas.insert(header.id, (header, data.into_owned()));
            }
            Record::Channel(topic) => self.topic(&topic),
            Record::Message { header, data } => {
                if let Some(open) = self.open.get_mut(&header.channel_id) {
                    if open.log.len() == MAX_ROWS {
                        return Err(RecordingFault::TooManyRows(MAX_ROWS));
                    }
                    open.push(header.log_time, &data);
                }
            }
            // Indices, statistics, attachments.
            _ => {}
        }
        Ok(())
    }

    fn topic(&mut self, topic: &Topic) {
        if self.open.contains_key(&topic.id) {
            return;
        }
        match self.opened(topic) {
            Err(fault) => self.refused.push((topic.topic.clone(), fault)),
            Ok(open) => _ = self.open.insert(topic.id, open),
        }
    }

    fn opened(&self, topic: &Topic) -> Result<Open, MessageFault> {
        let schema = self.schemas.get(&topic.schema_id);
        let encoding = schema.map_or("", |(header, _)| &header.encoding);
        let layout = match (&topic.message_encoding[..], encoding) {
            ("cdr", "ros2msg") => Layout::Ros2,
            ("ros1", "ros1msg") => Layout::Ros1,
            (message, schema) => {
                return Err(MessageFault::Encoding(format!("{message} with {schema}")));
            }
        };
        let undefined = || MessageFault::Undefined(topic.topic.clone());
        let (header, text) = schema.ok_or_else(undefined)?;
        let definition = Definition::parse(&header.name, &String::from_utf8_lossy(text))?;
        let log = Log {
            path: PathBuf::new(),
            name: topic.topic.clone(),
            clock: None,
            columns: vec![Channel::named("log_time")],
            is_named: true,
            first_row: 1,
        };
        Ok(Open {
            log,
            definition,
            layout,
            fault: None,
        })
    }

    /// The topics that are tables.
    fn logs(mut self) -> Result<Vec<Log>, RecordingFault> {
        let mut logs = Vec::new();
        for open in self.open.into_values() {
            match open.fault {
                Some(fault) => self.refused.push((open.log.name, fault)),
                None if open.log.len() > 0 => logs.push(open.log.with_clock()),
                None => {}
            }
        }
        if logs.is_empty() {
            let refused = self.refused.first();
            let why = refused.map(|(topic, fault)| format!(" (`{topic}`: {fault})"));
            return Err(RecordingFault::NoTopic(why.unwrap_or_default()));
        }
        Ok(logs)
    }
}

impl Open {
    fn push(&mut self, log_time_ns: u64, message: &[u8]) {
        if self.fault.is_some() {
            return;
        }
        let is_first = self.log.len() == 0;
        let columns = &mut self.log.columns;
        columns[0].push_instant(instant(
            (log_time_ns / 1_000_000_000) as i64,
            (log_time_ns % 1_000_000_000) as u32,
        ));
        let (names, values) = match self.definition.values(self.layout, message, is_first) {
            Ok(values) => values,
            Err(fault) => return self.fault = Some(fault),
        };
        columns.extend(names.iter().map(|name| Channel::named(name)));
        if values.len() + 1 != columns.len() {
            self.fault = Some(MessageFault::Ragged);
            return;
        }
        for (column, value) in columns[1..].iter_mut().zip(values) {
            match value {
                Value::Number(value) => column.values.push(value),
                Value::Time(seconds, nanoseconds) => {
                    column.push_instant(instant(seconds, nanoseconds));
                }
            }
        }
    }
}

fn instant(seconds: i64, nanoseconds: u32) -> Instant {
    Instant {
        whole: seconds,
        rest: 1e-9 * f64::from(nanoseconds),
    }
}

impl Log {
    /// The log with the stamps of its messages as its clock, the time of recording if they have none.
    fn with_clock(mut self) -> Self {
        let is_stamp = |channel: &Channel| {
            channel.name == "header.stamp" && channel.values.iter().any(|time| *time != 0.0)
        };
        let stamp = self.columns.iter().position(is_stamp);
        self.clock = Some(stamp.unwrap_or(0));
        self
    }
}
