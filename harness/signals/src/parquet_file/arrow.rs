//! Times in Arrow's schema, which Arrow stores in addition to Parquet's own, in the entry `ARROW:schema`: an IPC message in Base64,
//! a FlatBuffer (Apache Arrow, *Schema.fbs* and *Message.fbs*). Parquet has no type for durations and for times in
//! whole seconds; pandas, Polars and arrow-rs store them as plain integers, and their unit stands here alone.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};
use base64ct::{Base64, Encoding};

use super::kind::{Temporal, Tick};

/// Deepest structure within structures.
const DEEPEST: usize = 16;
/// Most fields.
const MOST_FIELDS: usize = 100_000;

// types of Schema.fbs
const DATE: u8 = 8;
const TIME: u8 = 9;
const TIMESTAMP: u8 = 10;
const DURATION: u8 = 18;

/// The columns that are times, by path.
///
/// # Errors
/// If the text is not such a message.
pub fn temporals(text: &str) -> Result<BTreeMap<String, Temporal>> {
    let bytes = Base64::decode_vec(text.trim()).ok().context("it is not Base64")?;
    // the message follows its length, since 2019 after a word of ones
    let start = if bytes.starts_with(&[0xff; 4]) { 8 } else { 4 };
    let buffer = Buffer(bytes.get(start..).context("it ends too early")?);
    let message = buffer.at(0)?;
    let schema = buffer.table(message, 2)?.context("it has no schema")?;
    let mut found = BTreeMap::new();
    let mut left = MOST_FIELDS;
    fields(&buffer, buffer.vector(schema, 1)?, "", 0, &mut left, &mut found)?;
    Ok(found)
}

/// Goes through fields and those within them.
fn fields(
    buffer: &Buffer,
    list: Vec<usize>,
    prefix: &str,
    depth: usize,
    left: &mut usize,
    found: &mut BTreeMap<String, Temporal>,
) -> Result<()> {
    ensure!(depth < DEEPEST, "its structures are nested more than {DEEPEST} deep");
    for field in list {
        *left = left.checked_sub(1).context("it has too many fields")?;
        let name = format!("{prefix}{}", buffer.string(field, 0)?);
        let kind = buffer.field(field, 2)?.map_or(Ok(0), |at| buffer.byte(at))?;
        // Date and Time count milliseconds unless the unit is written, Timestamp seconds, Duration milliseconds
        let (absent, is_date) = match kind {
            DATE => (1, true),
            TIME | DURATION => (1, false),
            TIMESTAMP => (0, true),
            _ => {
                let children = buffer.vector(field, 5)?;
                fields(buffer, children, &format!("{name}."), depth + 1, left, found)?;
                continue;
            }
        };
        let unit = match buffer.table(field, 3)? {
            Some(table) => buffer.field(table, 0)?.map_or(Ok(absent), |at| buffer.short(at))?,
            None => absent,
        };
        let tick = match (kind, unit) {
            (DATE, 0) => Tick::Day,
            (DATE, _) => Tick::Millisecond,
            (_, 0) => Tick::Second,
            (_, 1) => Tick::Millisecond,
            (_, 2) => Tick::Microsecond,
            _ => Tick::Nanosecond,
        };
        found.insert(name, Temporal { tick, is_date });
    }
    Ok(())
}

/// A FlatBuffer; places are offsets from its beginning.
struct Buffer<'a>(&'a [u8]);

impl Buffer<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> Result<[u8; N]> {
        let bytes = at.checked_add(N).and_then(|end| self.0.get(at..end));
        bytes.and_then(|bytes| bytes.try_into().ok()).context("it ends too early")
    }

    fn byte(&self, at: usize) -> Result<u8> {
        Ok(self.bytes::<1>(at)?[0])
    }

    fn short(&self, at: usize) -> Result<u16> {
        Ok(u16::from_le_bytes(self.bytes(at)?))
    }

    /// The place to which the offset at a place leads.
    fn at(&self, at: usize) -> Result<usize> {
        let offset = u32::from_le_bytes(self.bytes(at)?) as usize;
        at.checked_add(offset).context("an offset is too large")
    }

    /// The place of a table's field, if it is there.
    fn field(&self, table: usize, slot: usize) -> Result<Option<usize>> {
        let back = i64::from(i32::from_le_bytes(self.bytes(table)?));
        let places = usize::try_from(table as i64 - back).ok().context("an offset is too large")?;
        let entry = 4 + 2 * slot;
        if entry + 2 > usize::from(self.short(places)?) {
            return Ok(None);
        }
        let offset = usize::from(self.short(places + entry)?);
        Ok((offset != 0).then_some(table + offset))
    }

    /// The table that a field leads to.
    fn table(&self, table: usize, slot: usize) -> Result<Option<usize>> {
        self.field(table, slot)?.map(|at| self.at(at)).transpose()
    }

    /// The tables of a vector; none if it is not there.
    fn vector(&self, table: usize, slot: usize) -> Result<Vec<usize>> {
        let Some(start) = self.table(table, slot)? else { return Ok(Vec::new()) };
        let length = u32::from_le_bytes(self.bytes(start)?) as usize;
        ensure!(length <= self.0.len() / 4, "a list is longer than the message");
        (0..length).map(|k| self.at(start + 4 + 4 * k)).collect()
    }

    fn string(&self, table: usize, slot: usize) -> Result<String> {
        let Some(start) = self.table(table, slot)? else { return Ok(String::new()) };
        let length = u32::from_le_bytes(self.bytes(start)?) as usize;
        let end = (start + 4).checked_add(length);
        let text = end.and_then(|end| self.0.get(start + 4..end)).context("it ends too early")?;
        Ok(String::from_utf8_lossy(text).into_owned())
    }
}
