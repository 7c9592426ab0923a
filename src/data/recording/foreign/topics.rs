//! Topics of an MCAP log as tables: numbers by the names in each message, rows in order of time. Messages whose lists
//! have other names or lengths belong to another table of the topic. Rows are sorted by the time of recording, late
//! stamps are moved to their place, and exact repeats are dropped; a note reports it.

use ::mcap::records::{Channel as Declared, SchemaHeader};

use super::message::{Definition, Layout, Value, undefined, unknown_encoding};
use super::*;

const MOST_TABLES: usize = 16; // most tables of a topic
const MOST_ARRANGEMENTS: usize = 64; // most arrangements of lists that are kept in mind
const MOST_LATE: usize = 20; // most messages in a row that are late; more earlier stamps are another run of a simulator

#[derive(Default)]
pub(super) struct Topics {
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, usize>,
    topics: Vec<Topic>,
    pub messages: usize,
}

type Schema = (String, String, Vec<u8>);

struct Topic {
    name: String,
    definition: Defined,
    declared: (String, Option<Schema>), // encoding of the messages, and their schema
    tables: Vec<Table>,
    arrangements: BTreeMap<Vec<u8>, (usize, Vec<usize>)>, // by lists of a message: its table, columns of its numbers
    arrived: usize,
    fault: Option<String>,
}

struct Table {
    log: Log,
    arrivals: Vec<usize>,
    is_part: bool, // whether a narrower table has its rows
}

impl Topics {
    /// Forgets the channels of the last file: numbers of channels hold within one.
    pub(crate) fn begin_file(&mut self) {
        self.schemas.clear();
        self.channels.clear();
    }

    pub(crate) fn schema(&mut self, header: SchemaHeader, text: Vec<u8>) {
        let schema = (header.encoding, header.name, text);
        self.schemas.insert(header.id, schema);
    }

    pub(crate) fn channel(&mut self, channel: Declared) -> Result<(), String> {
        let (id, name) = (channel.id, channel.topic);
        let schema = self.schemas.get(&channel.schema_id).cloned();
        let declared = (channel.message_encoding, schema);
        let same = |topic: &Topic| topic.name == name && topic.declared == declared;
        let index = self.topics.iter().position(same);
        let index = index.unwrap_or(self.topics.len());
        let known = self.channels.insert(id, index);
        if let Some(known) = known.filter(|known| *known != index) {
            let one = &self.topics[known].name;
            return Err(format!("channel {id} is of `{one}` and of `{name}`"));
        }
        if index == self.topics.len() {
            self.topics.push(Topic {
                definition: definition(&name, &declared.0, declared.1.as_ref()),
                name,
                declared,
                tables: Vec::new(),
                arrangements: BTreeMap::new(),
                arrived: 0,
                fault: None,
            });
        }
        Ok(())
    }

    pub(crate) fn message(&mut self, id: u16, time_ns: u64, bytes: &[u8]) -> Result<(), String> {
        let undeclared = || format!("a message of channel {id}, which is not declared");
        let index = self.channels.get(&id).ok_or_else(undeclared)?;
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
                let note = || format!("`{}`: {others} of {messages} messages {what}", log.name);
                let note = (others > 0).then(note);
                log.notes.extend(note);
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
            let why = why.unwrap_or_default();
            let found = "found no topic of ROS messages with numbers";
            return Err(text(format!("{found}{why}")));
        }
        Ok(logs)
    }
}

type Defined = Result<(Layout, Definition), String>;

fn definition(topic: &str, message: &str, schema: Option<&Schema>) -> Defined {
    let encoding = schema.map_or("", |(encoding, ..)| encoding);
    let layout = match (message, encoding) {
        ("cdr", "ros2msg") => Layout::Ros2,
        ("ros1", "ros1msg") => Layout::Ros1,
        _ => return Err(unknown_encoding(&format!("{message} with {encoding}"))),
    };
    let (_, name, text) = schema.ok_or_else(|| undefined(topic))?;
    let definition = Definition::parse(name, &String::from_utf8_lossy(text))?;
    Ok((layout, definition))
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
            let most = format!("more than {MAX_ROWS} messages");
            return Err(most + ", expected shorter recordings");
        }
        table.arrivals.push(self.arrived);
        self.arrived += 1;
        let (whole, rest) = (time_ns / 1_000_000_000, time_ns % 1_000_000_000);
        let (whole, rest) = (whole as i64, 1e-9 * rest as f64);
        let columns = &mut table.log.columns;
        columns[0].push_instant(Instant { whole, rest });
        for (column, value) in order.iter().zip(found.values) {
            match value {
                Value::Number(value) => columns[*column].values.push(value),
                Value::Time(instant) => columns[*column].push_instant(instant),
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
            let columns = table.log.columns.iter().zip(0..).skip(1);
            let places = BTreeMap::from_iter(columns.map(|(column, i)| (&column.name, i)));
            let found = names.iter().map(|name| places.get(name).copied());
            let found: Option<Vec<usize>> = found.collect();
            found.filter(|found| found.len() == places.len())
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

impl Table {
    /// Adds the rows of a table that has all columns of this one and more: messages with further joints or values.
    fn add(&mut self, wider: &mut Self) {
        let of_wider = &wider.log.columns;
        let place = |own: &Channel| of_wider.iter().position(|other| other.name == own.name);
        let places = self.log.columns.iter().map(place);
        let Some(places) = places.collect::<Option<Vec<usize>>>() else {
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
        let (total, mut counts) = (log.len(), Vec::new());
        let recorded = log.columns[0].times();
        let (early, _) = late(&recorded);
        if early > 0 {
            log.sort_by(&recorded);
            let what = "were out of order and are sorted by their time of recording";
            counts.push((early, what));
        }
        let has_times = |channel: &Channel| channel.values.iter().any(|time| *time != 0.0);
        let is_stamp = |channel: &Channel| channel.name == "header.stamp" && has_times(channel);
        let clock = log.columns.iter().position(is_stamp).unwrap_or(0);
        log.clock = Some(clock);
        let stamps = log.columns[clock].times();
        let (count, longest) = late(&stamps);
        if count > 0 && longest <= MOST_LATE {
            log.sort_by(&stamps);
            counts.push((count, "had late stamps and are sorted by these"));
        }
        let kept = distinct(&log, clock);
        if kept.len() < total {
            log.choose(&kept);
            counts.push((total - kept.len(), "were exact repeats and are left out"));
        }
        let name = &log.name;
        let notes = counts.iter();
        let note = |(count, what): &_| format!("`{name}`: {count} of {total} messages {what}");
        log.notes = notes.map(note).collect();
        log
    }
}

/// How many of some times are earlier than one before them, in all and at most in a row.
fn late(times: &[f64]) -> (usize, usize) {
    let (mut latest, mut run, mut longest, mut count) = (f64::NEG_INFINITY, 0, 0, 0);
    for &time in times {
        run = if time < latest { run + 1 } else { 0 };
        count += usize::from(run > 0);
        longest = longest.max(run);
        latest = latest.max(time);
    }
    (count, longest)
}

/// The rows that do not repeat one of the same time in all columns but that of the recording.
fn distinct(log: &Log, clock: usize) -> Vec<usize> {
    let times = log.columns[clock].times();
    let others = &log.columns[1..];
    let bits = |column: &Channel, row: usize| column.values[row].to_bits();
    let same = |a, b| (others.iter()).all(|column| bits(column, a) == bits(column, b));
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
