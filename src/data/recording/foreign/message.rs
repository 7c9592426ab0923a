//! Messages of ROS 1 and 2 as numbers with names, by the definition that a log carries. Faults are words.

use super::*;

const MOST_ENTRIES: usize = 64; // longest array whose entries become columns: an image is no column
const MOST_NUMBERS: usize = 4096; // most numbers of a message
const MOST_EMPTY: usize = 100_000; // most fields of a message without bytes of their own: empty messages
const MOST_LEVELS: usize = 16; // deepest nesting of messages

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    Ros1,
    Ros2,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Bool,
    Unsigned(usize),
    Signed(usize),
    Float(usize),
    Text,
    Time,
    Message(usize),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Count {
    One,
    Fixed(usize),
    Any,
}

#[derive(Debug, Clone)]
struct Field {
    name: String,
    kind: Kind,
    count: Count,
}

type Told<T> = Result<T, String>; // a fault is words

/// A message type with all that it is made of; the first is the message's own.
#[derive(Debug, Clone)]
pub(super) struct Definition {
    types: Vec<(String, Vec<Field>)>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Time(Instant),
}

#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Numbers {
    pub names: Vec<String>,
    pub values: Vec<Value>,
    pub lists: Vec<u8>, // lengths and names of its lists, which decide a type's numbers and their order
}

type Texts<'a> = BTreeMap<String, Vec<&'a str>>;

impl Definition {
    /// Reads a definition and those of its parts, as `ros2 bag` and `rosbag` store them.
    pub(crate) fn parse(name: &str, text: &str) -> Result<Self, String> {
        let mut texts = Texts::new();
        let mut current = short(name);
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            if let Some(next) = line.strip_prefix("MSG:") {
                current = short(next.trim());
            } else if !line.is_empty() && !line.starts_with("===") {
                texts.entry(current.clone()).or_default().push(line);
            }
        }
        let mut definition = Self { types: Vec::new() };
        definition.add(&short(name), &texts, 0)?;
        Ok(definition)
    }

    fn add(&mut self, name: &str, texts: &Texts, level: usize) -> Result<usize, String> {
        if let Some(index) = self.types.iter().position(|(known, _)| known == name) {
            return Ok(index);
        }
        let lines = texts.get(name).cloned().unwrap_or_default(); // an empty message has no lines
        if level > MOST_LEVELS || (lines.is_empty() && level > 0 && !name.ends_with("/Empty")) {
            return Err(undefined(name));
        }
        let index = self.types.len();
        self.types.push((name.to_owned(), Vec::new()));
        let package = name.split('/').next().unwrap_or_default();
        for line in lines {
            let fault = || format!("definition: found `{line}`, expected a type and a name");
            let (kind, rest) = line.split_once(char::is_whitespace).ok_or_else(fault)?;
            let field = rest.split_whitespace().next().ok_or_else(fault)?;
            let first = rest.split(['=', ' ', '\t']).next().unwrap_or_default();
            if rest[first.len()..].trim_start().starts_with('=') {
                continue; // a constant: `NAME=value`, or `NAME = value`
            }
            let (base, count) = counted(kind).ok_or_else(fault)?;
            let full = match base {
                "Header" => "std_msgs/Header".to_owned(),
                _ if base.contains('/') => short(base),
                _ => format!("{package}/{base}"),
            };
            let kind = match primitive(base).or_else(|| primitive(&full)) {
                Some(kind) => kind,
                None => Kind::Message(self.add(&full, texts, level + 1)?),
            };
            let name = field.to_owned();
            self.types[index].1.push(Field { name, kind, count });
        }
        Ok(index)
    }

    /// The numbers and, if `named`, their names: `motor_state[3].q`, `position[FR_hip_joint]` of lists with names.
    pub(crate) fn values(&self, layout: Layout, bytes: &[u8], named: bool) -> Told<Numbers> {
        let mut cursor = Cursor::new(layout, bytes, named)?;
        cursor.message(self, 0, true)?;
        Ok(cursor.out)
    }
}

pub(super) fn undefined(name: &str) -> String {
    format!("definition: `{name}` is not defined")
}

pub(super) fn unknown_encoding(found: &str) -> String {
    format!("encoding `{found}`, expected cdr with ros2msg or ros1 with ros1msg")
}

fn ends_early(bytes: &[u8]) -> String {
    let length = bytes.len();
    format!("message: {length} bytes, which end before its fields do")
}

/// `sensor_msgs/msg/JointState` and `sensor_msgs/JointState` are the same type.
fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

fn counted(kind: &str) -> Option<(&str, Count)> {
    let Some((base, count)) = kind.split_once('[') else {
        return Some((kind.split("<=").next()?, Count::One));
    };
    let base = base.split("<=").next()?;
    let count = count.strip_suffix(']')?;
    let count = match count.is_empty() || count.starts_with("<=") {
        true => Count::Any,
        false => Count::Fixed(count.parse().ok()?),
    };
    Some((base, count))
}

fn primitive(name: &str) -> Option<Kind> {
    Some(match name {
        "bool" => Kind::Bool,
        "byte" | "char" | "uint8" => Kind::Unsigned(1),
        "uint16" => Kind::Unsigned(2),
        "uint32" => Kind::Unsigned(4),
        "uint64" => Kind::Unsigned(8),
        "int8" => Kind::Signed(1),
        "int16" => Kind::Signed(2),
        "int32" => Kind::Signed(4),
        "int64" => Kind::Signed(8),
        "float32" => Kind::Float(4),
        "float64" => Kind::Float(8),
        "string" => Kind::Text,
        "time" | "duration" => Kind::Time,
        "builtin_interfaces/Time" | "builtin_interfaces/Duration" => Kind::Time,
        _ => return None,
    })
}

struct Cursor<'a> {
    bytes: &'a [u8],
    place: usize,
    layout: Layout,
    big_endian: bool,
    align: usize,
    fields: usize,
    named: bool,
    path: String,
    out: Numbers,
}

impl<'a> Cursor<'a> {
    /// Behind CDR's header, which states byte order and alignment.
    fn new(layout: Layout, bytes: &'a [u8], named: bool) -> Result<Self, String> {
        let (bytes, big_endian, align) = match (layout, bytes) {
            (Layout::Ros1, bytes) => (bytes, false, 1),
            (Layout::Ros2, [0, kind @ (0 | 1), _, _, rest @ ..]) => (rest, *kind == 0, 8),
            (Layout::Ros2, [0, kind @ (6 | 7), _, _, rest @ ..]) => (rest, *kind == 6, 4),
            (Layout::Ros2, [first, kind, _, _, ..]) => {
                return Err(unknown_encoding(&format!("cdr {first:#x} {kind:#x}")));
            }
            (Layout::Ros2, short) => return Err(ends_early(short)),
        };
        Ok(Self {
            bytes,
            place: 0,
            layout,
            big_endian,
            align,
            fields: 0,
            named,
            path: String::new(),
            out: Numbers::default(),
        })
    }

    /// Reads a message of this type; its numbers are kept unless it is an entry of a long list.
    fn message(&mut self, of: &Definition, index: usize, kept: bool) -> Result<(), String> {
        let mut names: Vec<String> = Vec::new();
        let before = self.path.len();
        let (of_type, fields) = &of.types[index];
        for field in fields {
            let count = match field.count {
                Count::One => 1,
                Count::Fixed(count) => count,
                Count::Any => self.length()?,
            };
            if kept && field.count == Count::Any {
                let count = count.min(MOST_ENTRIES + 1) as u32;
                self.out.lists.extend(count.to_le_bytes());
            }
            let is_list = field.count != Count::One;
            if field.kind == Kind::Text && is_list && field.name.starts_with("name") {
                let read = (0..count).map(|_| self.text());
                names = read.collect::<Result<_, _>>()?;
                if kept {
                    let ended = names.iter().flat_map(|name| [name.as_bytes(), &[0]]);
                    ended.for_each(|bytes| self.out.lists.extend(bytes));
                }
                continue;
            }
            let is_named = field.count == Count::Any && !matches!(field.kind, Kind::Message(_));
            let (known, name) = (names.len(), &field.name);
            let others = ![0, known].contains(&count) && known > 0;
            if is_named && others && of_type.ends_with("/JointState") {
                let found = format!("{known} names and {count} values of `{name}`");
                return Err(format!("message: {found}"));
            }
            let has_names = is_named && known == count;
            for entry in 0..count {
                // Each field has a byte at least, but for empty messages.
                self.fields += 1;
                self.require(self.fields <= self.bytes.len() + MOST_EMPTY)?;
                if self.named {
                    self.path.truncate(before);
                    self.append(field, entry, has_names.then(|| &names[entry][..]));
                }
                let kept = kept && count <= MOST_ENTRIES;
                if let Kind::Message(part) = field.kind {
                    self.message(of, part, kept)?;
                } else if let Some(value) = self.value(field.kind)?.filter(|_| kept) {
                    self.keep(value)?;
                }
            }
        }
        self.path.truncate(before);
        Ok(())
    }

    fn append(&mut self, field: &Field, entry: usize, name: Option<&str>) {
        if !self.path.is_empty() {
            self.path.push('.');
        }
        self.path.push_str(&field.name);
        if field.count != Count::One {
            let entry = name.map_or_else(|| entry.to_string(), str::to_owned);
            self.path.push_str(&format!("[{entry}]"));
        }
    }

    fn keep(&mut self, value: Value) -> Result<(), String> {
        if self.out.values.len() == MOST_NUMBERS {
            return Err(format!("message: more than {MOST_NUMBERS} numbers"));
        }
        self.out.names.extend(self.named.then(|| self.path.clone()));
        self.out.values.push(value);
        Ok(())
    }

    fn require(&self, is_there: bool) -> Result<(), String> {
        is_there.then_some(()).ok_or_else(|| ends_early(self.bytes))
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let end = self.place.checked_add(count);
        let taken = end.and_then(|end| self.bytes.get(self.place..end));
        self.place += count;
        taken.ok_or_else(|| ends_early(self.bytes))
    }

    fn unsigned(&mut self, size: usize) -> Result<u64, String> {
        let align = size.min(self.align).max(1);
        self.place = self.place.next_multiple_of(align);
        let bytes = self.take(size)?;
        let join = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
        Ok(match self.big_endian {
            true => bytes.iter().fold(0, join),
            false => bytes.iter().rev().fold(0, join),
        })
    }

    fn signed(&mut self, size: usize) -> Result<i64, String> {
        let unused = 64 - 8 * size as u32;
        Ok((self.unsigned(size)? << unused) as i64 >> unused)
    }

    fn value(&mut self, kind: Kind) -> Result<Option<Value>, String> {
        let number = match kind {
            Kind::Text | Kind::Message(_) => {
                self.text()?;
                return Ok(None);
            }
            Kind::Time => {
                let (whole, rest) = (self.signed(4)?, 1e-9 * self.unsigned(4)? as f64);
                return Ok(Some(Value::Time(Instant { whole, rest })));
            }
            Kind::Bool => f64::from(u8::from(self.unsigned(1)? != 0)),
            Kind::Unsigned(size) => self.unsigned(size)? as f64,
            Kind::Signed(size) => self.signed(size)? as f64,
            Kind::Float(4) => f64::from(f32::from_bits(self.unsigned(4)? as u32)),
            Kind::Float(_) => f64::from_bits(self.unsigned(8)?),
        };
        Ok(Some(Value::Number(number)))
    }

    fn length(&mut self) -> Result<usize, String> {
        let length = self.unsigned(4)? as usize;
        self.require(length <= self.bytes.len()).map(|()| length) // every entry has a byte at least
    }

    fn text(&mut self) -> Result<String, String> {
        let length = self.length()?;
        let bytes = self.take(length)?;
        let ended = match self.layout {
            Layout::Ros1 => bytes,
            Layout::Ros2 => bytes.strip_suffix(&[0]).unwrap_or(bytes),
        };
        Ok(String::from_utf8_lossy(ended).into_owned())
    }
}
