//! Messages of ROS 2: their definitions as text, and their bytes in CDR.
//!
//! A definition (`ros2msg`) lists fields, one a line, and carries the definitions of the types it uses behind lines of `=`.
//! The bytes are OMG's Common Data Representation, version 1: four bytes that tell the byte order, then each primitive at a multiple of its size.

use std::collections::HashMap;

use super::bytes::{Cursor, Damage, Number};

/// The definition of a message with all that it uses.
#[derive(Debug)]
pub(super) struct Schema {
    types: Vec<Vec<Field>>,
}

#[derive(Debug)]
struct Field {
    name: String,
    what: What,
    many: Many,
}

#[derive(Debug, Clone, Copy)]
enum What {
    Number(Number, usize),
    Text,
    /// `builtin_interfaces/Time`: an instant.
    Instant,
    /// Another type by its index.
    Message(usize),
}

#[derive(Debug, Clone, Copy)]
enum Many {
    One,
    Exactly(usize),
    Counted,
}

/// Elements of a list beyond this one are no channels: images, scans.
const MOST_ELEMENTS: usize = 64;

/// A number of a message.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value {
    Number(f64),
    /// Nanoseconds.
    Instant(i64),
}

impl Schema {
    /// Reads a definition.
    pub(super) fn parse(name: &str, text: &str) -> Result<Schema, Damage> {
        let mut sections: Vec<(String, Vec<&str>)> = vec![(name.to_owned(), Vec::new())];
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            match line.strip_prefix("MSG:") {
                Some(name) => sections.push((name.trim().to_owned(), Vec::new())),
                None if line.starts_with("===") || line.is_empty() => {}
                None => sections.last_mut().into_iter().for_each(|(_, lines)| lines.push(line)),
            }
        }
        // `sensor_msgs/msg/JointState` and `sensor_msgs/JointState` are one.
        let plain = |name: &str| name.replace("/msg/", "/");
        let index: HashMap<String, usize> =
            sections.iter().enumerate().map(|(at, (name, _))| (plain(name), at)).collect();
        let mut types = Vec::new();
        for (own, lines) in &sections {
            let package = plain(own).split_once('/').map_or(String::new(), |(package, _)| package.to_owned());
            let find = |kind: &str| {
                let here = format!("{package}/{kind}");
                index.get(&plain(kind)).or_else(|| index.get(&here)).copied()
            };
            types.push(lines.iter().filter_map(|line| field(line, &find).transpose()).collect::<Result<_, _>>()?);
        }
        Ok(Schema { types })
    }

    /// Visits the numbers of a message with their places: the index of a field, or of an element of a list, level by level.
    pub(super) fn visit(&self, message: &[u8], visit: &mut dyn FnMut(&[u32], Value)) -> Result<(), Damage> {
        let kind = message.get(..4).ok_or_else(|| Damage("a message has no bytes".to_owned()))?;
        let big_endian = match kind[..2] {
            [0, 0] => true,
            [0, 1] => false,
            _ => return Err(Damage(format!("a message is in representation {:02x}{:02x}, not CDR", kind[0], kind[1]))),
        };
        let mut from = Cursor { big_endian, ..Cursor::new(&message[4..]) };
        self.message(0, &mut from, &mut Vec::new(), visit)
    }

    fn message(
        &self,
        kind: usize,
        from: &mut Cursor<'_>,
        place: &mut Vec<u32>,
        visit: &mut dyn FnMut(&[u32], Value),
    ) -> Result<(), Damage> {
        const DEEPEST: usize = 32;
        if place.len() > DEEPEST {
            return Err(Damage("a message holds itself".to_owned()));
        }
        if self.types[kind].is_empty() {
            // A message without fields takes a byte.
            from.u8()?;
        }
        for (at, field) in self.types[kind].iter().enumerate() {
            place.push(at as u32);
            let count = match field.many {
                Many::One => None,
                Many::Exactly(count) => Some(count),
                Many::Counted => {
                    align(from, 4)?;
                    Some(from.u32()? as usize)
                }
            };
            match (count, field.what) {
                (None, what) => self.value(what, from, place, visit)?,
                (Some(count), What::Number(_, size)) if count > MOST_ELEMENTS => {
                    align(from, size)?;
                    from.take(count.saturating_mul(size))?;
                }
                (Some(count), what) => {
                    for element in 0..count {
                        place.push(element as u32);
                        if element < MOST_ELEMENTS {
                            self.value(what, from, place, visit)?;
                        } else {
                            self.value(what, from, place, &mut |_, _| {})?;
                        }
                        place.pop();
                    }
                }
            }
            place.pop();
        }
        Ok(())
    }

    fn value(
        &self,
        what: What,
        from: &mut Cursor<'_>,
        place: &mut Vec<u32>,
        visit: &mut dyn FnMut(&[u32], Value),
    ) -> Result<(), Damage> {
        match what {
            What::Number(number, size) => {
                align(from, size)?;
                let mut bytes = [0; 8];
                bytes[..size].copy_from_slice(from.take(size)?);
                if from.big_endian {
                    bytes[..size].reverse();
                }
                visit(place, Value::Number(number.of(&bytes[..size])));
            }
            What::Text => {
                align(from, 4)?;
                let length = from.u32()? as usize;
                from.take(length)?;
            }
            What::Instant => {
                align(from, 4)?;
                let (seconds, rest) = (from.u32()? as i32, from.u32()?);
                visit(place, Value::Instant(i64::from(seconds) * 1_000_000_000 + i64::from(rest)));
            }
            What::Message(kind) => self.message(kind, from, place, visit)?,
        }
        Ok(())
    }

    /// A place in words: `position[2]`, `header.stamp`.
    pub(super) fn name(&self, place: &[u32]) -> String {
        let (mut kind, mut name, mut rest) = (0, String::new(), place.iter());
        while let Some(at) = rest.next() {
            let field = &self.types[kind][*at as usize];
            if !name.is_empty() {
                name.push('.');
            }
            name += &field.name;
            if !matches!(field.many, Many::One)
                && let Some(element) = rest.next()
            {
                name += &format!("[{element}]");
            }
            if let What::Message(next) = field.what {
                kind = next;
            }
        }
        name
    }
}

fn align(from: &mut Cursor<'_>, size: usize) -> Result<(), Damage> {
    let over = from.at % size.max(1);
    if over > 0 {
        from.take(size - over)?;
    }
    Ok(())
}

/// A line of a definition: `float64[] position`. Constants are no fields.
fn field(line: &str, find: &dyn Fn(&str) -> Option<usize>) -> Result<Option<Field>, Damage> {
    let Some((kind, rest)) = line.split_once(char::is_whitespace) else { return Ok(None) };
    let rest = rest.trim();
    let name = rest.split(|c: char| c.is_whitespace() || c == '=').next().unwrap_or_default();
    // `uint8 KIND=3` is a constant; `int32 x 3` and `string<=10 x` are fields.
    if rest[name.len()..].trim_start().starts_with('=') || name.is_empty() {
        return Ok(None);
    }
    let (kind, many) = match kind.split_once('[') {
        None => (kind, Many::One),
        Some((kind, bounds)) => match bounds.trim_end_matches(']') {
            "" => (kind, Many::Counted),
            bounds if bounds.starts_with("<=") => (kind, Many::Counted),
            count => match count.parse() {
                Ok(count) => (kind, Many::Exactly(count)),
                Err(_) => return Err(Damage(format!("`{line}` of a definition has no size"))),
            },
        },
    };
    let what = match kind.split("<=").next().unwrap_or_default() {
        "bool" | "byte" | "char" | "uint8" | "octet" => What::Number(Number::Unsigned, 1),
        "int8" => What::Number(Number::Signed, 1),
        "uint16" => What::Number(Number::Unsigned, 2),
        "int16" => What::Number(Number::Signed, 2),
        "uint32" => What::Number(Number::Unsigned, 4),
        "int32" => What::Number(Number::Signed, 4),
        "uint64" => What::Number(Number::Unsigned, 8),
        "int64" => What::Number(Number::Signed, 8),
        "float32" => What::Number(Number::Float, 4),
        "float64" => What::Number(Number::Float, 8),
        "string" => What::Text,
        "time" | "builtin_interfaces/Time" | "builtin_interfaces/msg/Time" => What::Instant,
        other => match find(other) {
            Some(kind) => What::Message(kind),
            None => return Err(Damage(format!("its definition lacks the type `{other}`"))),
        },
    };
    Ok(Some(Field { name: name.to_owned(), what, many }))
}
