//! MCAP, the log format of ROS 2: messages of topics, in CDR or JSON.
//!
//! The file is a row of records (the specification at mcap.dev): an opcode, a length, and the content; chunks hold records, compressed. Read here are schemas, channels and messages;
//! the crate for the whole format would add half a minute to the build.
//! The numbers of a topic's messages are its columns, `/joint_states.effort[2]`, a row a message. They count time by `header.stamp` where there is one, else by the time of logging.

use std::collections::{BTreeMap, HashMap};
use std::io::Read;

use super::bytes::{Cursor, Damage};
use super::error::RecordingError;
use super::format::Format;
use super::ros::{Schema, Value};
use super::samples::Samples;
use super::table::{ColumnHead, Table};

/// The topics of an MCAP file.
pub(super) struct McapTable {
    file: String,
    bytes: Vec<u8>,
    heads: Vec<ColumnHead>,
    topics: Vec<Topic>,
}

struct Topic {
    channels: Vec<u16>,
    decoder: Decoder,
    /// Columns by their places in a message, and the first instant of each.
    places: HashMap<ColumnSource, usize>,
    log_time: usize,
}

/// A record that is looked at.
enum Record<'a> {
    Schema { id: u16, schema: Definition },
    Channel(Channel),
    Message { channel: u16, log_time: u64, data: &'a [u8] },
}

/// How the messages of channels are defined.
struct Definition {
    name: String,
    encoding: String,
    text: Vec<u8>,
}

struct Channel {
    id: u16,
    schema: u16,
    topic: String,
    encoding: String,
}

enum Decoder {
    Cdr(Schema),
    Json,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
enum ColumnSource {
    Cdr(Vec<u32>),
    Json(String),
}

impl McapTable {
    pub(super) fn open(file: &str, bytes: Vec<u8>) -> Result<Self, RecordingError> {
        let mut table = McapTable { file: file.to_owned(), bytes: Vec::new(), heads: Vec::new(), topics: Vec::new() };
        table.survey(&bytes).map_err(|damage| damage.of(file, Format::Mcap))?;
        table.bytes = bytes;
        Ok(table)
    }

    /// Finds the topics, and their columns by their first messages.
    fn survey(&mut self, bytes: &[u8]) -> Result<(), Damage> {
        let mut schemas: HashMap<u16, Definition> = HashMap::new();
        let mut channels: BTreeMap<u16, Channel> = BTreeMap::new();
        let mut by_topic: HashMap<String, Option<usize>> = HashMap::new();
        let mut unread: Vec<String> = Vec::new();
        each_record(bytes, &mut |record| {
            let (id, data) = match record {
                Record::Schema { id, schema } => {
                    schemas.insert(id, schema);
                    return Ok(());
                }
                Record::Channel(channel) => {
                    channels.insert(channel.id, channel);
                    return Ok(());
                }
                Record::Message { channel, data, .. } => (channel, data),
            };
            let channel = channels.get(&id);
            let channel = channel.ok_or_else(|| Damage(format!("a message is of channel {id}, which there is not")))?;
            match by_topic.get(&channel.topic) {
                Some(Some(topic)) => {
                    let known = &mut self.topics[*topic].channels;
                    if !known.contains(&id) {
                        known.push(id);
                    }
                }
                Some(None) => {}
                None => {
                    let decoder = decoder(&channel.encoding, schemas.get(&channel.schema))?;
                    if decoder.is_none() {
                        unread.push(format!("{} ({})", channel.topic, channel.encoding));
                    }
                    let added = decoder.map(|decoder| self.topic(channel, decoder, data)).transpose()?;
                    by_topic.insert(channel.topic.clone(), added);
                }
            }
            Ok(())
        })?;
        if self.topics.is_empty() && !unread.is_empty() {
            return Err(Damage(format!("its messages are neither CDR with ros2msg nor JSON: {}", unread.join(", "))));
        }
        Ok(())
    }

    fn topic(&mut self, channel: &Channel, decoder: Decoder, first: &[u8]) -> Result<usize, Damage> {
        let group = self.topics.len();
        let (heads, mut places) = (&mut self.heads, HashMap::new());
        let mut stamped = false;
        visit(&decoder, first, &mut |place, value| {
            let name = match (&decoder, &place) {
                (Decoder::Cdr(schema), ColumnSource::Cdr(place)) => schema.name(place),
                (_, ColumnSource::Json(name)) => name.clone(),
                _ => String::new(),
            };
            let instant = matches!(value, Value::Instant(_));
            let is_time = instant && name == "header.stamp" && value != Value::Instant(0);
            stamped |= is_time;
            places.insert(place, heads.len());
            let unit = instant.then(|| "s".to_owned());
            heads.push(ColumnHead { name: format!("{}.{name}", channel.topic), unit, group, is_time });
        })?;
        let log_time = heads.len();
        let name = format!("{}.log_time", channel.topic);
        heads.push(ColumnHead { name, unit: Some("s".to_owned()), group, is_time: !stamped });
        self.topics.push(Topic { channels: vec![channel.id], decoder, places, log_time });
        Ok(group)
    }

    fn values(&self, columns: &[usize]) -> Result<Vec<Vec<f64>>, Damage> {
        let Some(topic) = columns.first().map(|index| &self.topics[self.heads[*index].group]) else {
            return Ok(Vec::new());
        };
        let wanted: HashMap<usize, usize> = columns.iter().enumerate().map(|(at, index)| (*index, at)).collect();
        // Rows as they were logged; instants as they stand, counted from the first one at the end.
        let mut rows: Vec<(u64, Vec<Option<Value>>)> = Vec::new();
        each_record(&self.bytes, &mut |record| {
            let Record::Message { channel, log_time, data } = record else { return Ok(()) };
            if !topic.channels.contains(&channel) {
                return Ok(());
            }
            let mut row = vec![None; columns.len()];
            visit(&topic.decoder, data, &mut |place, value| {
                if let Some(at) = topic.places.get(&place).and_then(|index| wanted.get(index)) {
                    row[*at] = Some(value);
                }
            })?;
            if let Some(at) = wanted.get(&topic.log_time) {
                row[*at] = Some(Value::Instant(log_time as i64));
            }
            rows.push((log_time, row));
            Ok(())
        })?;
        rows.sort_by_key(|(log_time, _)| *log_time);
        let column = |at: usize| {
            let mut first = None;
            let number = |value: &Option<Value>| match value {
                Some(Value::Number(number)) => *number,
                Some(Value::Instant(instant)) => instant.wrapping_sub(*first.get_or_insert(*instant)) as f64 / 1e9,
                None => f64::NAN,
            };
            rows.iter().map(|(_, row)| &row[at]).map(number).collect()
        };
        Ok((0..columns.len()).map(column).collect())
    }
}

impl Table for McapTable {
    fn heads(&self) -> &[ColumnHead] {
        &self.heads
    }

    fn read(&mut self, columns: &[usize]) -> Result<Vec<Samples>, RecordingError> {
        let values = self.values(columns).map_err(|damage| damage.of(&self.file, Format::Mcap))?;
        Ok(values.into_iter().map(Samples::from).collect())
    }
}

/// How the messages of a channel are read, if they are.
fn decoder(encoding: &str, schema: Option<&Definition>) -> Result<Option<Decoder>, Damage> {
    match (encoding, schema) {
        ("json", _) => Ok(Some(Decoder::Json)),
        ("cdr", Some(Definition { name, encoding, text })) if encoding == "ros2msg" => {
            Ok(Some(Decoder::Cdr(Schema::parse(name, &String::from_utf8_lossy(text))?)))
        }
        _ => Ok(None),
    }
}

fn visit(decoder: &Decoder, message: &[u8], visit: &mut dyn FnMut(ColumnSource, Value)) -> Result<(), Damage> {
    match decoder {
        Decoder::Cdr(schema) => {
            schema.visit(message, &mut |place, value| visit(ColumnSource::Cdr(place.to_vec()), value))
        }
        Decoder::Json => {
            json("", &serde_json::from_slice(message)?, &mut |name, number| {
                visit(ColumnSource::Json(name.to_owned()), Value::Number(number));
            });
            Ok(())
        }
    }
}

fn json(name: &str, value: &serde_json::Value, visit: &mut dyn FnMut(&str, f64)) {
    match value {
        serde_json::Value::Number(number) => number.as_f64().into_iter().for_each(|number| visit(name, number)),
        serde_json::Value::Bool(yes) => visit(name, f64::from(u8::from(*yes))),
        serde_json::Value::Array(list) => {
            list.iter().take(64).enumerate().for_each(|(at, item)| json(&format!("{name}[{at}]"), item, visit));
        }
        serde_json::Value::Object(fields) => {
            let dot = if name.is_empty() { "" } else { "." };
            fields.iter().for_each(|(field, item)| json(&format!("{name}{dot}{field}"), item, visit));
        }
        _ => {}
    }
}

/// Every record that is looked at, those in chunks unpacked.
fn each_record(bytes: &[u8], each: &mut dyn FnMut(Record<'_>) -> Result<(), Damage>) -> Result<(), Damage> {
    let mut file = Cursor::new(bytes);
    file.take(MAGIC.len())?;
    while file.left() > 0 {
        if &bytes[file.at..] == MAGIC {
            return Ok(());
        }
        let (opcode, mut content) = record(&mut file)?;
        if opcode == CHUNK {
            let plain = unpacked(&mut content)?;
            let mut inside = Cursor::new(&plain);
            while inside.left() > 0 {
                let (opcode, content) = record(&mut inside)?;
                parsed(opcode, content)?.map_or(Ok(()), &mut *each)?;
            }
        } else {
            parsed(opcode, content)?.map_or(Ok(()), &mut *each)?;
        }
    }
    Err(Damage("it has no end: the recording was cut off; repair it with mcap recover".to_owned()))
}

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;

fn record<'a>(from: &mut Cursor<'a>) -> Result<(u8, Cursor<'a>), Damage> {
    let opcode = from.u8()?;
    let length = from.u64()?;
    Ok((opcode, Cursor::new(from.take(usize::try_from(length)?)?)))
}

fn text(from: &mut Cursor<'_>) -> Result<String, Damage> {
    let length = from.u32()? as usize;
    Ok(String::from_utf8_lossy(from.take(length)?).into_owned())
}

fn parsed(opcode: u8, mut from: Cursor<'_>) -> Result<Option<Record<'_>>, Damage> {
    Ok(Some(match opcode {
        SCHEMA => {
            let (id, name, encoding) = (from.u16()?, text(&mut from)?, text(&mut from)?);
            let length = from.u32()? as usize;
            Record::Schema { id, schema: Definition { name, encoding, text: from.take(length)?.to_vec() } }
        }
        CHANNEL => Record::Channel(Channel {
            id: from.u16()?,
            schema: from.u16()?,
            topic: text(&mut from)?,
            encoding: text(&mut from)?,
        }),
        MESSAGE => {
            let (channel, _sequence, log_time, _publish_time) = (from.u16()?, from.u32()?, from.u64()?, from.u64()?);
            Record::Message { channel, log_time, data: from.take(from.left())? }
        }
        _ => return Ok(None),
    }))
}

/// The records of a chunk, in plain bytes.
fn unpacked(chunk: &mut Cursor<'_>) -> Result<Vec<u8>, Damage> {
    let (_first_time, _last_time, size, _checksum) = (chunk.u64()?, chunk.u64()?, chunk.u64()?, chunk.u32()?);
    let compression = text(chunk)?;
    let packed_size = usize::try_from(chunk.u64()?)?;
    let packed = chunk.take(packed_size)?;
    let mut plain = Vec::new();
    match compression.as_str() {
        "" => plain.extend_from_slice(packed),
        "zstd" => zstd::stream::copy_decode(packed, &mut plain)?,
        "lz4" => drop(lz4_flex::frame::FrameDecoder::new(packed).read_to_end(&mut plain)?),
        other => return Err(Damage(format!("a chunk is compressed by {other}"))),
    }
    if plain.len() as u64 != size {
        return Err(Damage(format!("a chunk has {} of {size} bytes", plain.len())));
    }
    Ok(plain)
}
