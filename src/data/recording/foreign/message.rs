//! Messages of ROS 1 and 2 as numbers with names, by the definition that a log carries. Faults are words: a topic that
//! cannot be read is listed with its fault.

use std::collections::BTreeMap;

/// Longest array whose entries become columns: an image is no column.
const MOST_ENTRIES: usize = 64;
/// Most numbers of a message.
const MOST_NUMBERS: usize = 4096;
/// Most fields of a message without bytes of their own: empty messages.
const MOST_EMPTY: usize = 100_000;
/// Deepest nesting of messages.
const MOST_LEVELS: usize = 16;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    /// Packed, little endian.
    Ros1,
    /// CDR with its header.
    Ros2,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Bool,
    Unsigned(usize),
    Signed(usize),
    Float(usize),
    Text,
    /// Seconds and nanoseconds.
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

impl Field {
    /// Appends its name to the path of its message, of a list with the entry.
    fn append_to(&self, path: &mut String, entry: &str) {
        if !path.is_empty() {
            path.push('.');
        }
        path.push_str(&self.name);
        if self.count != Count::One {
            path.push_str(&format!("[{entry}]"));
        }
    }
}

/// A message type with all that it is made of; the first is the message's own.
#[derive(Debug, Clone)]
pub(super) struct Definition {
    types: Vec<(String, Vec<Field>)>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value {
    Number(f64),
    /// Seconds and nanoseconds.
    Time(i64, u32),
}

#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Numbers {
    /// Their names, if these are asked for.
    pub names: Vec<String>,
    pub values: Vec<Value>,
    /// Lengths and names of its lists: messages of one type that agree in them have the same numbers in the same order.
    pub lists: Vec<u8>,
}

impl Definition {
    /// Reads a definition and those of its parts, as `ros2 bag` and `rosbag` store them.
    pub(crate) fn parse(name: &str, text: &str) -> Result<Self, String> {
        let mut texts: BTreeMap<String, Vec<&str>> = BTreeMap::new();
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

    fn add(
        &mut self,
        name: &str,
        texts: &BTreeMap<String, Vec<&str>>,
        level: usize,
    ) -> Result<usize, String> {
        if let Some(index) = self.types.iter().position(|(known, _)| known == name) {
            return Ok(index);
        }
        let lines = texts.get(name).cloned();
        // An empty message has no lines.
        let lines = lines.unwrap_or_default();
        if level > MOST_LEVELS || (lines.is_empty() && level > 0 && !name.ends_with("/Empty")) {
            return Err(undefined(name));
        }
        let index = self.types.len();
        self.types.push((name.to_owned(), Vec::new()));
        let package = name.split('/').next().unwrap_or_default();
        let mut fields = Vec::new();
        for line in lines {
            let fault = || format!("definition: found `{line}`, expected a type and a name");
            let (kind, rest) = line.split_once(char::is_whitespace).ok_or_else(fault)?;
            let field = rest.split_whitespace().next().ok_or_else(fault)?;
            if is_constant(rest) {
                continue;
            }
            let (base, count) = counted(kind).ok_or_else(fault)?;
            let kind = match primitive(base) {
                Some(kind) => kind,
                None => {
                    let full = match (base, base.contains('/')) {
                        (_, true) => short(base),
                        ("Header", false) => "std_msgs/Header".to_owned(),
                        (_, false) => format!("{package}/{base}"),
                    };
                    match &full[..] {
                        "builtin_interfaces/Time" | "builtin_interfaces/Duration" => Kind::Time,
                        _ => Kind::Message(self.add(&full, texts, level + 1)?),
                    }
                }
            };
            let name = field.to_owned();
            fields.push(Field { name, kind, count });
        }
        self.types[index].1 = fields;
        Ok(index)
    }

    /// The names of a message's numbers, if `named`, and the numbers: `pose.position.x`, `motor_state[3].q`, and
    /// `position[FR_hip_joint]` where a list of names goes with a list of numbers.
    pub(crate) fn values(
        &self,
        layout: Layout,
        bytes: &[u8],
        named: bool,
    ) -> Result<Numbers, String> {
        let (mut cursor, mut out) = (Cursor::new(layout, bytes)?, Numbers::default());
        self.message(0, &mut cursor, named, &mut String::new(), Some(&mut out))?;
        Ok(out)
    }

    fn message(
        &self,
        index: usize,
        cursor: &mut Cursor<'_>,
        named: bool,
        path: &mut String,
        mut out: Option<&mut Numbers>,
    ) -> Result<(), String> {
        let mut names: Vec<String> = Vec::new();
        let before = path.len();
        let (of_type, fields) = &self.types[index];
        for field in fields {
            let count = match field.count {
                Count::One => 1,
                Count::Fixed(count) => count,
                Count::Any => cursor.length()?,
            };
            if let (Some(out), Count::Any) = (out.as_deref_mut(), field.count) {
                let count = count.min(MOST_ENTRIES + 1) as u32;
                out.lists.extend(count.to_le_bytes());
            }
            let is_list = field.count != Count::One;
            let is_named = field.count == Count::Any && !matches!(field.kind, Kind::Message(_));
            if field.kind == Kind::Text && is_list && field.name.starts_with("name") {
                let read = (0..count).map(|_| cursor.text());
                names = read.collect::<Result<_, _>>()?;
                if let Some(out) = out.as_deref_mut() {
                    let ended = names.iter().flat_map(|name| [name.as_bytes(), &[0]]);
                    ended.for_each(|bytes| out.lists.extend(bytes));
                }
                continue;
            }
            let others = ![0, names.len()].contains(&count) && !names.is_empty();
            if is_named && others && of_type.ends_with("/JointState") {
                let names = names.len();
                return Err(format!(
                    "message: {names} names and {count} values of `{}`",
                    field.name
                ));
            }
            for entry in 0..count {
                cursor.count_field()?;
                if named {
                    let own = names.get(entry);
                    let own = own.filter(|_| is_named && names.len() == count);
                    let entry = own.map_or_else(|| entry.to_string(), String::clone);
                    path.truncate(before);
                    field.append_to(path, &entry);
                }
                let out = out.as_deref_mut().filter(|_| count <= MOST_ENTRIES);
                let value = match field.kind {
                    Kind::Message(part) => {
                        self.message(part, cursor, named, path, out)?;
                        continue;
                    }
                    kind => cursor.value(kind)?,
                };
                if let (Some(out), Some(value)) = (out, value) {
                    if out.values.len() == MOST_NUMBERS {
                        return Err(format!("message: more than {MOST_NUMBERS} numbers"));
                    }
                    out.names.extend(named.then(|| path.clone()));
                    out.values.push(value);
                }
            }
        }
        path.truncate(before);
        Ok(())
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

/// `NAME=value`, or `NAME = value`.
fn is_constant(rest: &str) -> bool {
    let name = rest.split(['=', ' ', '\t']).next().unwrap_or_default();
    rest[name.len()..].trim_start().starts_with('=')
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
        _ => return None,
    })
}

/// Bytes of a message from its first field on.
struct Cursor<'a> {
    bytes: &'a [u8],
    place: usize,
    layout: Layout,
    big_endian: bool,
    align: usize,
    fields: usize,
}

impl<'a> Cursor<'a> {
    /// Behind CDR's header, which tells byte order and alignment.
    fn new(layout: Layout, bytes: &'a [u8]) -> Result<Self, String> {
        let (bytes, big_endian, align) = match (layout, bytes) {
            (Layout::Ros1, bytes) => (bytes, false, 1),
            (Layout::Ros2, [0, 0, _, _, rest @ ..]) => (rest, true, 8),
            (Layout::Ros2, [0, 1, _, _, rest @ ..]) => (rest, false, 8),
            (Layout::Ros2, [0, 6, _, _, rest @ ..]) => (rest, true, 4),
            (Layout::Ros2, [0, 7, _, _, rest @ ..]) => (rest, false, 4),
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
        })
    }

    /// Counts a field: each has a byte at least, but for empty messages.
    fn count_field(&mut self) -> Result<(), String> {
        self.fields += 1;
        match self.fields <= self.bytes.len() + MOST_EMPTY {
            true => Ok(()),
            false => Err(ends_early(self.bytes)),
        }
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

    /// The next number; none of a text.
    fn value(&mut self, kind: Kind) -> Result<Option<Value>, String> {
        let number = match kind {
            Kind::Text | Kind::Message(_) => {
                self.text()?;
                return Ok(None);
            }
            Kind::Time => {
                let time = Value::Time(self.signed(4)?, self.unsigned(4)? as u32);
                return Ok(Some(time));
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
        // Every entry has a byte at least.
        match length <= self.bytes.len() {
            true => Ok(length),
            false => Err(ends_early(self.bytes)),
        }
    }

    fn text(&mut self) -> Result<String, String> {
        let length = self.length()?;
        let bytes = self.take(length)?;
        let bytes = match self.layout {
            Layout::Ros1 => bytes,
            Layout::Ros2 => bytes.strip_suffix(&[0]).unwrap_or(bytes),
        };
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "Header header # stamp\nuint8 KIND=3\nbool on\nfloat64 value\nstring[] name\nfloat32[] q\n\
         Part[2] parts\nuint8[] image\nint16 last\n===\nMSG: std_msgs/Header\n\
         builtin_interfaces/Time stamp\nstring frame_id\n===\nMSG: demo_msgs/Part\nint8 a\nint64 b\n";

    /// The message in CDR, or packed as ROS 1 does.
    fn message(layout: Layout) -> Vec<u8> {
        let mut out: Vec<u8> = Vec::new();
        let put = |out: &mut Vec<u8>, size: usize, bytes: &[u8]| {
            while layout == Layout::Ros2 && !out.len().is_multiple_of(size) {
                out.push(0xee);
            }
            out.extend(bytes);
        };
        let text = |out: &mut Vec<u8>, text: &str| {
            let end = usize::from(layout == Layout::Ros2);
            put(out, 4, &((text.len() + end) as u32).to_le_bytes());
            out.extend(text.as_bytes());
            out.extend(vec![0; end]);
        };
        put(&mut out, 4, &7_i32.to_le_bytes());
        put(&mut out, 4, &250_000_000_u32.to_le_bytes());
        text(&mut out, "world");
        put(&mut out, 1, &[1]);
        put(&mut out, 8, &(-0.5_f64).to_le_bytes());
        put(&mut out, 4, &2_u32.to_le_bytes());
        text(&mut out, "hip");
        text(&mut out, "calf");
        put(&mut out, 4, &2_u32.to_le_bytes());
        put(&mut out, 4, &1.5_f32.to_le_bytes());
        put(&mut out, 4, &2.5_f32.to_le_bytes());
        for part in 0..2_i64 {
            put(&mut out, 1, &[(-1_i8 - part as i8) as u8]);
            put(&mut out, 8, &(part - 9).to_le_bytes());
        }
        put(&mut out, 4, &100_u32.to_le_bytes());
        out.extend([9; 100]);
        put(&mut out, 2, &(-300_i16).to_le_bytes());
        match layout {
            Layout::Ros1 => out,
            Layout::Ros2 => [&[0, 1, 0, 0], &out[..]].concat(),
        }
    }

    #[test]
    fn values_of_messages_of_both_systems_have_the_same_numbers_with_names() {
        let definition = Definition::parse("demo_msgs/msg/Demo", TEXT).unwrap();
        let expected = [
            ("header.stamp", Value::Time(7, 250_000_000)),
            ("on", Value::Number(1.0)),
            ("value", Value::Number(-0.5)),
            ("q[hip]", Value::Number(1.5)),
            ("q[calf]", Value::Number(2.5)),
            ("parts[0].a", Value::Number(-1.0)),
            ("parts[0].b", Value::Number(-9.0)),
            ("parts[1].a", Value::Number(-2.0)),
            ("parts[1].b", Value::Number(-8.0)),
            ("last", Value::Number(-300.0)),
        ];
        let owned = |(name, value): (&str, _)| (name.to_owned(), value);
        let (names, values): (Vec<_>, Vec<_>) = expected.into_iter().map(owned).unzip();
        for layout in [Layout::Ros1, Layout::Ros2] {
            let found = definition.values(layout, &message(layout), true).unwrap();
            assert_eq!(found.names, names, "{layout:?}");
            assert_eq!(found.values, values, "{layout:?}");
            let unnamed = definition.values(layout, &message(layout), false).unwrap();
            assert_eq!((unnamed.lists, unnamed.names.len()), (found.lists, 0));
        }
    }

    #[test]
    fn values_of_every_cut_message_are_refused() {
        let definition = Definition::parse("demo_msgs/msg/Demo", TEXT).unwrap();
        let whole = message(Layout::Ros2);
        for end in 0..whole.len() {
            let cut = definition.values(Layout::Ros2, &whole[..end], false);
            assert!(cut.is_err(), "{end}");
        }
        let mut other = whole;
        other[1] = 3;
        let fault = definition.values(Layout::Ros2, &other, false);
        assert!(fault.is_err_and(|fault| fault.starts_with("encoding `cdr 0x0 0x3`")));
    }

    #[test]
    fn parse_unknown_part_is_named() {
        let fault = Definition::parse("a/B", "Missing part\n").unwrap_err();
        assert_eq!(fault, "definition: `a/Missing` is not defined");
        let fault = Definition::parse("a/B", "float64\n").unwrap_err();
        assert_eq!(
            fault,
            "definition: found `float64`, expected a type and a name"
        );
    }
}
