//! Topics of an MCAP log as tables: numbers by the names that each message gives them, rows in order of time.
//!
//! A message whose lists have the names of an earlier one in another order belongs to the same table; one with other
//! names, or lists of other lengths, to another table of the topic. Rows are sorted by the time of recording, late
//! stamps into their place, and exact repeats are dropped; a note says so.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use mcap::records::{Channel as Declared, SchemaHeader};

use super::log::{Channel, Log};
use super::message::{Definition, Layout, Value, undefined, unknown_encoding};
use crate::recording::csv::MAX_ROWS;
use crate::recording::error::RecordingFault;
use crate::recording::instant::Instant;

/// Most tables of a topic.
const MOST_TABLES: usize = 16;
/// Most arrangements of lists that are kept in mind.
const MOST_ARRANGEMENTS: usize = 64;
/// Most messages in a row with earlier stamps than one before them, for which they count as late; more are another run
/// of a simulator.
const MOST_LATE: usize = 20;

#[derive(Default)]
pub(super) struct Topics {
    schemas: BTreeMap<u16, (SchemaHeader, Vec<u8>)>,
    channels: BTreeMap<u16, usize>,
    topics: Vec<Topic>,
    pub messages: usize,
}

struct Topic {
    name: String,
    definition: Result<(Layout, Definition), String>,
    declared: (String, String, String, Vec<u8>),
    tables: Vec<Table>,
    /// By lists of a message: its table, and the columns of its numbers.
    arrangements: BTreeMap<Vec<u8>, (usize, Vec<usize>)>,
    arrived: usize,
    fault: Option<String>,
}

/// Messages with the same names.
struct Table {
    log: Log,
    /// Numbers of the messages within their topic.
    arrivals: Vec<usize>,
    /// Whether a narrower table has its rows.
    is_part: bool,
}

impl Topics {
    /// Forgets the channels of the last file: numbers of channels hold within one.
    pub(crate) fn begin_file(&mut self) {
        self.schemas.clear();
        self.channels.clear();
    }

    pub(crate) fn schema(&mut self, header: SchemaHeader, text: Vec<u8>) {
        self.schemas.insert(header.id, (header, text));
    }

    /// A declared channel.
    pub(crate) fn channel(&mut self, channel: &Declared) -> Result<(), String> {
        let schema = self.schemas.get(&channel.schema_id);
        let (header, text) = schema.map_or((None, &[][..]), |(header, text)| (Some(header), text));
        let of =
            |text: fn(&SchemaHeader) -> &String| header.map_or(String::new(), |h| text(h).clone());
        let declared = (
            channel.message_encoding.clone(),
            of(|header| &header.encoding),
            of(|header| &header.name),
            text.to_vec(),
        );
        let same = |topic: &Topic| topic.name == channel.topic && topic.declared == declared;
        let index = (self.topics.iter().position(same)).unwrap_or_else(|| {
            let definition = definition(channel, header.is_some(), &declared);
            self.topics.push(Topic {
                name: channel.topic.clone(),
                definition,
                declared,
                tables: Vec::new(),
                arrangements: BTreeMap::new(),
                arrived: 0,
                fault: None,
            });
            self.topics.len() - 1
        });
        match self.channels.entry(channel.id) {
            Entry::Vacant(free) => _ = free.insert(index),
            Entry::Occupied(known) if *known.get() == index => {}
            Entry::Occupied(known) => {
                let (one, other) = (&self.topics[*known.get()].name, &channel.topic);
                return Err(format!(
                    "channel {} is of `{one}` and of `{other}`",
                    channel.id
                ));
            }
        }
        Ok(())
    }

    /// A message.
    pub(crate) fn message(
        &mut self,
        channel: u16,
        time_ns: u64,
        bytes: &[u8],
    ) -> Result<(), String> {
        let index = self.channels.get(&channel);
        let index = index
            .ok_or_else(|| format!("a message of channel {channel}, which is not declared"))?;
        let topic = &mut self.topics[*index];
        self.messages += 1;
        if topic.fault.is_none()
            && let Err(fault) = topic.push(time_ns, bytes)
        {
            topic.fault = Some(fault);
            topic.tables.clear();
        }
        Ok(())
    }

    /// The tables, and topics that are none, each with its fault.
    pub(crate) fn logs(self) -> Result<Vec<Log>, RecordingFault> {
        let mut logs = Vec::new();
        for mut topic in self.topics {
            let messages: usize = topic.tables.iter().map(|table| table.log.len()).sum();
            topic.tables.sort_by_key(|table| table.log.columns.len());
            for at in 0..topic.tables.len() {
                let (tables, wider) = topic.tables.split_at_mut(at + 1);
                wider.iter_mut().for_each(|table| tables[at].add(table));
            }
            for table in topic.tables {
                let others = messages - table.log.len();
                let what = match table.is_part {
                    true => "lack values that the others have",
                    false => "have other names or lengths and are left out",
                };
                let mut log = table.finished();
                if others > 0 {
                    let note = format!("`{}`: {others} of {messages} messages {what}", log.name);
                    log.notes.push(note);
                }
                logs.push(log);
            }
            logs.extend(topic.fault.map(|fault| Log {
                name: topic.name,
                fault: Some(fault),
                ..Log::default()
            }));
        }
        if logs.iter().all(|log| log.fault.is_some()) {
            let refused = (logs.iter()).find_map(|log| Some((&log.name, log.fault.as_ref()?)));
            let why = refused.map(|(topic, fault)| format!(" (`{topic}`: {fault})"));
            return Err(RecordingFault::NoTopic(why.unwrap_or_default()));
        }
        Ok(logs)
    }
}

fn definition(
    channel: &Declared,
    has_schema: bool,
    (message, encoding, name, text): &(String, String, String, Vec<u8>),
) -> Result<(Layout, Definition), String> {
    let layout = match (&message[..], &encoding[..]) {
        ("cdr", "ros2msg") => Layout::Ros2,
        ("ros1", "ros1msg") => Layout::Ros1,
        (message, schema) => {
            return Err(unknown_encoding(&format!("{message} with {schema}")));
        }
    };
    if !has_schema {
        return Err(undefined(&channel.topic));
    }
    Ok((
        layout,
        Definition::parse(name, &String::from_utf8_lossy(text))?,
    ))
}

impl Topic {
    fn push(&mut self, time_ns: u64, message: &[u8]) -> Result<(), String> {
        let (layout, definition) = self.definition.as_ref().map_err(Clone::clone)?;
        let found = definition.values(*layout, message, false)?;
        if !self.arrangements.contains_key(&found.lists) {
            let names = definition.values(*layout, message, true)?.names;
            let arrangement = self.arranged(names)?;
            if self.arrangements.len() == MOST_ARRANGEMENTS {
                self.arrangements.clear();
            }
            self.arrangements.insert(found.lists.clone(), arrangement);
        }
        let (table, order) = &self.arrangements[&found.lists];
        let table = &mut self.tables[*table];
        if table.log.len() == MAX_ROWS {
            return Err(format!(
                "more than {MAX_ROWS} messages, expected shorter recordings"
            ));
        }
        table.arrivals.push(self.arrived);
        self.arrived += 1;
        let (seconds, rest) = (time_ns / 1_000_000_000, time_ns % 1_000_000_000);
        let columns = &mut table.log.columns;
        columns[0].push_instant(instant(seconds as i64, rest as u32));
        for (column, value) in order.iter().zip(found.values) {
            match value {
                Value::Number(value) => columns[*column].values.push(value),
                Value::Time(seconds, nanoseconds) => {
                    columns[*column].push_instant(instant(seconds, nanoseconds));
                }
            }
        }
        Ok(())
    }

    /// The table of numbers of these names, made if there is none, and their columns in it.
    fn arranged(&mut self, names: Vec<String>) -> Result<(usize, Vec<usize>), String> {
        let mut sorted: Vec<&String> = names.iter().collect();
        sorted.sort_unstable();
        if let Some(twice) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(format!("message: `{}` twice", twice[0]));
        }
        let columns_in = |table: &Table| {
            let columns = &table.log.columns[1..];
            let places: BTreeMap<&String, usize> = columns
                .iter()
                .enumerate()
                .map(|(i, column)| (&column.name, i + 1))
                .collect();
            let found = names.iter().map(|name| places.get(name).copied());
            found
                .collect::<Option<Vec<usize>>>()
                .filter(|found| found.len() == columns.len())
        };
        let mut known = self.tables.iter().enumerate();
        if let Some(found) = known.find_map(|(table, of)| Some((table, columns_in(of)?))) {
            return Ok(found);
        }
        if self.tables.len() == MOST_TABLES {
            return Err(format!(
                "messages of more than {MOST_TABLES} lengths or sets of names, expected tables"
            ));
        }
        let order = (1..=names.len()).collect();
        let columns = ["log_time".to_owned()].into_iter().chain(names);
        let log = Log {
            name: self.name.clone(),
            columns: columns.map(|name| Channel::named(&name)).collect(),
            is_named: true,
            first_row: 1,
            ..Log::default()
        };
        self.tables.push(Table {
            log,
            arrivals: Vec::new(),
            is_part: false,
        });
        Ok((self.tables.len() - 1, order))
    }
}

fn instant(seconds: i64, nanoseconds: u32) -> Instant {
    Instant {
        whole: seconds,
        rest: 1e-9 * f64::from(nanoseconds),
    }
}

impl Table {
    /// Adds the rows of a table that has all columns of this one and more: messages with further joints or values.
    fn add(&mut self, wider: &mut Self) {
        let columns = self.log.columns.iter();
        let place = |column: &Channel| {
            let mut own = wider.log.columns.iter();
            own.position(|other| other.name == column.name)
        };
        let Some(places) = columns.map(place).collect::<Option<Vec<usize>>>() else {
            return;
        };
        for (column, place) in self.log.columns.iter_mut().zip(places) {
            let other = &wider.log.columns[place];
            column.values.extend(&other.values);
            if let (Some(own), Some(others)) = (&mut column.instants, &other.instants) {
                own.extend(others);
            }
        }
        self.arrivals.extend(&wider.arrivals);
        let mut rows = Vec::from_iter(0..self.arrivals.len());
        rows.sort_by_key(|row| self.arrivals[*row]);
        self.log.choose(&rows);
        self.arrivals.sort_unstable();
        wider.is_part = true;
    }

    /// The table by the stamps of its messages, or the time of recording if they have none, with rows in order.
    fn finished(self) -> Log {
        let mut log = self.log;
        let (name, total) = (log.name.clone(), log.len());
        let say = |log: &mut Log, count: usize, what: &str| {
            let note = format!("`{name}`: {count} of {total} messages {what}");
            log.notes.push(note);
        };
        let recorded = log.columns[0].times();
        let early = late(&recorded);
        if early > 0 {
            log.sort_by(&recorded);
            let what = "were out of order and are sorted by their time of recording";
            say(&mut log, early, what);
        }
        let is_stamp = |channel: &Channel| {
            channel.name == "header.stamp" && channel.values.iter().any(|time| *time != 0.0)
        };
        let clock = log.columns.iter().position(is_stamp).unwrap_or(0);
        log.clock = Some(clock);
        let stamps = log.columns[clock].times();
        let mut runs = stamps
            .iter()
            .scan((f64::NEG_INFINITY, 0), |(latest, run), &time| {
                *run = if time < *latest { *run + 1 } else { 0 };
                *latest = latest.max(time);
                Some(*run)
            });
        let count = late(&stamps);
        if count > 0 && runs.all(|run| run <= MOST_LATE) {
            log.sort_by(&stamps);
            say(&mut log, count, "had late stamps and are sorted by these");
        }
        let kept = distinct(&log, clock);
        let repeated = log.len() - kept.len();
        if repeated > 0 {
            log.choose(&kept);
            say(&mut log, repeated, "were exact repeats and are left out");
        }
        log
    }
}

/// How many of some times are earlier than one before them.
fn late(times: &[f64]) -> usize {
    let mut latest = f64::NEG_INFINITY;
    let is_late = |time: &&f64| {
        let found = **time < latest;
        latest = latest.max(**time);
        found
    };
    times.iter().filter(is_late).count()
}

/// The rows that do not repeat one of the same time in all columns but that of the recording.
fn distinct(log: &Log, clock: usize) -> Vec<usize> {
    let times = log.columns[clock].times();
    let others = &log.columns[1..];
    let same = |one: usize, other: usize| {
        (others.iter()).all(|column| column.values[one].to_bits() == column.values[other].to_bits())
    };
    let mut kept: Vec<usize> = Vec::new();
    for row in 0..times.len() {
        let before = kept.iter().rev().take(MOST_LATE);
        let mut before = before.take_while(|kept| times[**kept] == times[row]);
        if !before.any(|kept| same(*kept, row)) {
            kept.push(row);
        }
    }
    kept
}
