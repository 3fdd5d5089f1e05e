//! MDF 4, as measurement systems for vehicles and test benches write it.
//!
//! The file is a tree of blocks (ASAM MDF 4.1): header → data groups → channel groups → channels, with the records apart, plain, in lists or compressed. Read are channels of numbers,
//! with their conversions, sorted or not; strings, arrays and structures are passed over. The crates for this format read no compressed records, or panic on damaged files.

use std::collections::HashMap;
use std::io::Read;

use super::bytes::{Cursor, Damage, Number};
use super::error::RecordingError;
use super::format::Format;
use super::samples::Samples;
use super::table::{ColumnHead, Table, tell_apart};

/// The channels of an MDF file.
pub(super) struct Mdf4Table {
    file: String,
    bytes: Vec<u8>,
    heads: Vec<ColumnHead>,
    channels: Vec<Channel>,
    groups: Vec<Group>,
}

/// What a channel group says of its records.
struct Group {
    data: u64,
    record_id_size: usize,
    record_id: u64,
    rows: u64,
    record_bytes: usize,
    invalidation_bytes: usize,
    /// Sizes of all records of the data group by their number; `None` for those that state their length.
    siblings: HashMap<u64, Option<usize>>,
}

struct Channel {
    /// Its numbers are those of the rows.
    is_virtual: bool,
    number: Number,
    big_endian: bool,
    bit_offset: u32,
    byte_offset: usize,
    bit_count: u32,
    /// Bit of the record that says that a value is none.
    invalid_at: Option<usize>,
    conversion: Conversion,
}

/// From the number that is stored to the physical one.
enum Conversion {
    Identity,
    Linear { offset: f64, factor: f64 },
    Rational([f64; 6]),
    Table { pairs: Vec<[f64; 2]>, interpolated: bool },
    Ranges { ranges: Vec<[f64; 3]>, default: f64 },
    Unknown(u8),
}

impl Mdf4Table {
    pub(super) fn open(file: &str, bytes: Vec<u8>) -> Result<Self, RecordingError> {
        let mut table = Mdf4Table {
            file: file.to_owned(),
            bytes: Vec::new(),
            heads: Vec::new(),
            channels: Vec::new(),
            groups: Vec::new(),
        };
        table.tree(&bytes).map_err(|damage| damage.of(file, Format::Mdf4))?;
        table.bytes = bytes;
        Ok(table)
    }

    fn tree(&mut self, bytes: &[u8]) -> Result<(), Damage> {
        let mut names = Vec::new();
        let mut data_group = block(bytes, 64, b"##HD")?.link(0);
        let mut seen = 0;
        while data_group != 0 {
            let mut group = block(bytes, data_group, b"##DG")?;
            let (next, data) = (group.link(0), group.link(2));
            let record_id_size = usize::from(group.data.u8()?);
            let first = self.groups.len();
            let mut channel_group = group.link(1);
            while channel_group != 0 {
                names.push(self.channel_group(bytes, channel_group, data, record_id_size)?);
                channel_group = block(bytes, channel_group, b"##CG")?.link(0);
                limit(&mut seen)?;
            }
            let siblings: HashMap<u64, Option<usize>> = self.groups[first..]
                .iter()
                .map(|g| (g.record_id, (g.record_bytes != usize::MAX).then(|| g.record_bytes + g.invalidation_bytes)))
                .collect();
            self.groups[first..].iter_mut().for_each(|group| group.siblings = siblings.clone());
            data_group = next;
            limit(&mut seen)?;
        }
        tell_apart(&mut self.heads, |group| names[group].clone());
        Ok(())
    }

    /// Reads a channel group with its channels; its name.
    fn channel_group(&mut self, bytes: &[u8], at: u64, data: u64, record_id_size: usize) -> Result<String, Damage> {
        let mut group = block(bytes, at, b"##CG")?;
        let number = self.groups.len();
        let name = text(bytes, group.link(2))?.filter(|name| !name.is_empty());
        let (record_id, rows, flags) = (group.data.u64()?, group.data.u64()?, group.data.u16()?);
        group.data.take(6)?;
        let (record_bytes, invalidation_bytes) = (group.data.u32()? as usize, group.data.u32()? as usize);
        let states_its_length = flags & 1 != 0;
        self.groups.push(Group {
            data,
            record_id_size,
            record_id,
            rows,
            record_bytes: if states_its_length { usize::MAX } else { record_bytes },
            invalidation_bytes,
            siblings: HashMap::new(),
        });
        let mut at = group.link(1);
        let mut seen = 0;
        while at != 0 && !states_its_length {
            let mut channel = block(bytes, at, b"##CN")?;
            at = channel.link(0);
            limit(&mut seen)?;
            let (kind, sync) = (channel.data.u8()?, channel.data.u8()?);
            let (data_type, bit_offset) = (channel.data.u8()?, channel.data.u8()?);
            let (byte_offset, bit_count) = (channel.data.u32()?, channel.data.u32()?);
            let (flags, invalid_bit) = (channel.data.u32()?, channel.data.u32()?);
            let is_virtual = matches!(kind, 3 | 6);
            let number_kind = match data_type {
                0 | 1 => Number::Unsigned,
                2 | 3 => Number::Signed,
                4 | 5 => Number::Float,
                _ if is_virtual => Number::Unsigned,
                _ => continue,
            };
            let composed = channel.link(1) != 0;
            if composed || !matches!(kind, 0 | 2 | 3 | 4 | 6) || (bit_count == 0 || bit_count > 64) && !is_virtual {
                continue;
            }
            let (conversion, converted_unit) = conversion(bytes, channel.link(4))?;
            let unit = text(bytes, channel.link(6))?.or(converted_unit);
            self.heads.push(ColumnHead {
                name: text(bytes, channel.link(2))?.unwrap_or_default(),
                unit: unit.filter(|unit| !unit.is_empty()),
                group: number,
                is_time: matches!(kind, 2 | 3) && sync <= 1,
            });
            self.channels.push(Channel {
                is_virtual,
                number: number_kind,
                big_endian: data_type % 2 == 1 && !is_virtual,
                bit_offset: u32::from(bit_offset),
                byte_offset: byte_offset as usize,
                bit_count,
                invalid_at: (flags & 2 != 0).then(|| 8 * record_bytes + invalid_bit as usize),
                conversion,
            });
        }
        Ok(name.unwrap_or_else(|| format!("group{number}")))
    }

    fn values(&self, columns: &[usize]) -> Result<Vec<Vec<f64>>, Damage> {
        let Some(group) = columns.first().map(|index| &self.groups[self.heads[*index].group]) else {
            return Ok(Vec::new());
        };
        let size = group.record_bytes.saturating_add(group.invalidation_bytes);
        let records = group.records(data(&self.bytes, group.data)?)?;
        // What is stated counts only where there are no records to count.
        let rows = match size {
            0 => group.rows.min(u64::from(u16::MAX)),
            size => (records.len() / size) as u64,
        };
        let mut all = Vec::new();
        for index in columns {
            let channel = &self.channels[*index];
            if let Conversion::Unknown(kind) = channel.conversion {
                let name = &self.heads[*index].name;
                return Err(Damage(format!(
                    "channel `{name}` has a conversion of type {kind}, which is not evaluated"
                )));
            }
            let raw: Vec<f64> = match channel.is_virtual {
                true => (0..rows).map(|row| row as f64).collect(),
                false => {
                    let end = channel.byte_offset + (channel.bit_offset + channel.bit_count).div_ceil(8) as usize;
                    if size == 0 || end > size || channel.invalid_at.is_some_and(|bit| bit / 8 >= size) {
                        return Err(Damage(format!("channel `{}` lies outside its records", self.heads[*index].name)));
                    }
                    records.chunks_exact(size).map(|record| channel.raw(record)).collect()
                }
            };
            all.push(raw.into_iter().map(|x| channel.conversion.apply(x)).collect());
        }
        Ok(all)
    }
}

impl Table for Mdf4Table {
    fn heads(&self) -> &[ColumnHead] {
        &self.heads
    }

    fn read(&mut self, columns: &[usize]) -> Result<Vec<Samples>, RecordingError> {
        let values = self.values(columns).map_err(|damage| damage.of(&self.file, Format::Mdf4))?;
        Ok(values.into_iter().map(Samples::from).collect())
    }
}

impl Group {
    /// The group's records, one behind the other, without their numbers.
    fn records(&self, data: Vec<u8>) -> Result<Vec<u8>, Damage> {
        if self.record_id_size == 0 {
            return Ok(data);
        }
        let mut from = Cursor::new(&data);
        let mut records = Vec::new();
        while from.left() > 0 {
            let id = match self.record_id_size {
                1 => u64::from(from.u8()?),
                2 => u64::from(from.u16()?),
                4 => u64::from(from.u32()?),
                8 => from.u64()?,
                size => return Err(Damage(format!("numbers of records have {size} bytes"))),
            };
            let size = match self.siblings.get(&id) {
                Some(Some(size)) => *size,
                Some(None) => from.u32()? as usize,
                None => return Err(Damage(format!("a record has number {id}, which no group has"))),
            };
            let record = from.take(size)?;
            if id == self.record_id {
                records.extend_from_slice(record);
            }
        }
        Ok(records)
    }
}

impl Channel {
    fn raw(&self, record: &[u8]) -> f64 {
        if self.invalid_at.is_some_and(|bit| record[bit / 8] >> (bit % 8) & 1 == 1) {
            return f64::NAN;
        }
        let bytes = (self.bit_offset + self.bit_count).div_ceil(8) as usize;
        let field = &record[self.byte_offset..self.byte_offset + bytes];
        let mut wide = [0; 16];
        match self.big_endian {
            true => wide.iter_mut().zip(field.iter().rev()).for_each(|(to, from)| *to = *from),
            false => wide[..bytes].copy_from_slice(field),
        }
        let bits = (u128::from_le_bytes(wide) >> self.bit_offset) as u64;
        let mask = if self.bit_count == 64 { u64::MAX } else { (1 << self.bit_count) - 1 };
        self.number.of_bits(bits & mask, self.bit_count)
    }
}

impl Conversion {
    fn apply(&self, x: f64) -> f64 {
        match self {
            Conversion::Identity | Conversion::Unknown(_) => x,
            Conversion::Linear { offset, factor } => offset + factor * x,
            Conversion::Rational([a, b, c, d, e, f]) => (a * x * x + b * x + c) / (d * x * x + e * x + f),
            Conversion::Table { pairs, interpolated } => {
                let above = pairs.partition_point(|pair| pair[0] <= x);
                match (above.checked_sub(1).map(|at| pairs[at]), pairs.get(above)) {
                    (Some([x0, y0]), Some([x1, y1])) if *interpolated => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
                    (Some([x0, y0]), Some([x1, y1])) => {
                        if x - x0 > x1 - x {
                            *y1
                        } else {
                            y0
                        }
                    }
                    (Some([_, y]), None) => y,
                    (None, Some([_, y])) => *y,
                    (None, None) => x,
                }
            }
            Conversion::Ranges { ranges, default } => {
                ranges.iter().find(|[low, high, _]| (*low..=*high).contains(&x)).map_or(*default, |[.., y]| *y)
            }
        }
    }
}

/// Blocks in a ring are no file.
fn limit(seen: &mut usize) -> Result<(), Damage> {
    *seen += 1;
    if *seen > 1 << 20 { Err(Damage("its blocks go round in a ring".to_owned())) } else { Ok(()) }
}

/// A block: its links and what follows them.
struct Block<'a> {
    links: Vec<u64>,
    data: Cursor<'a>,
}

impl Block<'_> {
    /// A link, 0 where there is none.
    fn link(&self, at: usize) -> u64 {
        self.links.get(at).copied().unwrap_or(0)
    }
}

fn any_block(bytes: &[u8], at: u64) -> Result<([u8; 4], Block<'_>), Damage> {
    let mut from = Cursor::new(bytes).jump(at)?;
    let id = from.array()?;
    from.take(4)?;
    let (length, links) = (from.u64()?, from.u64()?);
    let inside = usize::try_from(length).ok().and_then(|length| length.checked_sub(24));
    let inside = inside.ok_or_else(|| Damage(format!("the block at byte {at} has length {length}")))?;
    let mut data = Cursor::new(from.take(inside)?);
    let links = usize::try_from(links).ok().filter(|links| *links <= data.left() / 8);
    let links = links.ok_or_else(|| Damage(format!("the block at byte {at} has more links than bytes")))?;
    let links = (0..links).map(|_| data.u64()).collect::<Result<_, _>>()?;
    Ok((id, Block { links, data }))
}

fn block<'a>(bytes: &'a [u8], at: u64, id: &[u8; 4]) -> Result<Block<'a>, Damage> {
    let (found, block) = any_block(bytes, at)?;
    if found != *id {
        let words = [&found[..], id].map(|id| String::from_utf8_lossy(id).into_owned());
        return Err(Damage(format!("at byte {at} stands `{}`, not `{}`", words[0], words[1])));
    }
    Ok(block)
}

/// A text, or the text within the XML of a comment.
fn text(bytes: &[u8], at: u64) -> Result<Option<String>, Damage> {
    if at == 0 {
        return Ok(None);
    }
    let (id, block) = any_block(bytes, at)?;
    let text = String::from_utf8_lossy(&block.data.bytes[block.data.at..]).trim_end_matches('\0').trim().to_owned();
    if id != *b"##MD" {
        return Ok(Some(text));
    }
    let inner = text.split_once("<TX>").and_then(|(_, rest)| rest.split_once("</TX>"));
    Ok(inner.map(|(inner, _)| inner.trim().to_owned()))
}

/// A conversion and the unit of what it gives.
fn conversion(bytes: &[u8], at: u64) -> Result<(Conversion, Option<String>), Damage> {
    if at == 0 {
        return Ok((Conversion::Identity, None));
    }
    let mut block = block(bytes, at, b"##CC")?;
    let unit = text(bytes, block.link(1))?;
    let kind = block.data.u8()?;
    block.data.take(5)?;
    let count = usize::from(block.data.u16()?);
    block.data.take(16)?;
    let values = (0..count).map(|_| block.data.f64()).collect::<Result<Vec<f64>, _>>()?;
    let conversion = match (kind, &values[..]) {
        // Numbers that stand for words stay numbers.
        (0 | 7 | 8, _) => Conversion::Identity,
        (1, [offset, factor, ..]) => Conversion::Linear { offset: *offset, factor: *factor },
        (2, &[a, b, c, d, e, f, ..]) => Conversion::Rational([a, b, c, d, e, f]),
        (4 | 5, pairs) => {
            let pairs = pairs.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
            Conversion::Table { pairs, interpolated: kind == 4 }
        }
        (6, ranges) => Conversion::Ranges {
            ranges: ranges.chunks_exact(3).map(|r| [r[0], r[1], r[2]]).collect(),
            default: ranges.last().copied().unwrap_or(f64::NAN),
        },
        _ => Conversion::Unknown(kind),
    };
    Ok((conversion, unit))
}

/// All records of a data group.
fn data(bytes: &[u8], at: u64) -> Result<Vec<u8>, Damage> {
    let mut out = Vec::new();
    let mut ahead = vec![at];
    let mut seen = 0;
    while let Some(at) = ahead.pop() {
        if at == 0 {
            continue;
        }
        limit(&mut seen)?;
        let (id, mut block) = any_block(bytes, at)?;
        match &id {
            b"##DT" => out.extend_from_slice(block.data.take(block.data.left())?),
            b"##DZ" => unzip(&mut block.data, &mut out)?,
            b"##HL" => ahead.push(block.link(0)),
            // The next list comes after what this one lists.
            b"##DL" => {
                ahead.push(block.link(0));
                ahead.extend(block.links.iter().skip(1).rev());
            }
            other => {
                return Err(Damage(format!("its records are in blocks `{}`", String::from_utf8_lossy(other))));
            }
        }
    }
    Ok(out)
}

fn unzip(data: &mut Cursor<'_>, out: &mut Vec<u8>) -> Result<(), Damage> {
    data.take(2)?;
    let kind = data.u8()?;
    data.take(1)?;
    let width = data.u32()? as usize;
    let (plain_length, length) = (data.u64()?, data.u64()?);
    let packed = data.take(usize::try_from(length)?)?;
    let mut plain = Vec::new();
    match kind {
        0 | 1 => flate2::read::ZlibDecoder::new(packed).take(plain_length).read_to_end(&mut plain)?,
        kind => return Err(Damage(format!("its records are compressed by method {kind}"))),
    };
    if plain.len() as u64 != plain_length {
        return Err(Damage("compressed records are shorter than stated".to_owned()));
    }
    if kind == 1 && width > 1 {
        // Stored column by column; what fills no row stands behind.
        let rows = plain.len() / width;
        let start = out.len();
        out.resize(start + plain.len(), 0);
        for (column, bytes) in plain[..rows * width].chunks(rows.max(1)).enumerate() {
            for (row, byte) in bytes.iter().enumerate() {
                out[start + row * width + column] = *byte;
            }
        }
        let rest = rows * width;
        out[start + rest..].copy_from_slice(&plain[rest..]);
    } else {
        out.extend_from_slice(&plain);
    }
    Ok(())
}
