//! MATLAB's `.mat` files of version 5 (MATLAB's `-v6` and `-v7`), as The MathWorks describe them in *MAT-File
//! Format*: a header of 128 bytes, then elements of type, length and data, arrays among them, perhaps compressed.
//! Vectors are columns under their names, matrices give `name(1)`, `name(2)`, …, fields of structures `a.b`. What
//! is not an array of real numbers (texts, cells, objects) is passed over.

use std::io::{BufReader, Read, copy, sink};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use files::{budget, input};
use flate2::read::ZlibDecoder;

use super::{Found, Header};

/// Most columns of a matrix: a longer one is not a table of signals.
const WIDEST: usize = 100;
/// Deepest structure within structures.
const DEEPEST: usize = 8;
/// Longest name or list of dimensions, bytes.
const LONGEST: u32 = 1 << 20;
/// Most columns and elements of structures in a file.
const MOST: usize = 1_000_000;

// types of elements
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
// classes of arrays
const STRUCT: u8 = 2;
const NUMBERS: std::ops::RangeInclusive<u8> = 6..=15; // double, single, integers
const INTEGERS: std::ops::RangeInclusive<u8> = 8..=15;

/// An array of numbers of which a file tells: its name, rows and columns, the longer way down.
struct Shape {
    name: String,
    rows: usize,
    columns: usize,
    /// Values of one column lie side by side (else those of one row).
    by_column: bool,
    /// True if the class is one of integers.
    integers: bool,
}

impl Shape {
    fn names(&self) -> Vec<String> {
        match self.columns {
            1 => vec![self.name.clone()],
            columns => (1..=columns).map(|k| format!("{}({k})", self.name)).collect(),
        }
    }
}

/// Visitor of an array of numbers: its shape, and its values in the file's order.
type Visit<'a> = &'a mut dyn FnMut(&Shape, &mut Numbers) -> Result<()>;

/// The names of the columns in a file.
pub(super) fn header(path: &Path) -> Result<Header> {
    let mut names = Vec::new();
    walk(path, &mut |shape, _| {
        names.extend(shape.names());
        ensure!(names.len() <= MOST, "it has more than {MOST} columns");
        Ok(())
    })?;
    ensure!(!names.is_empty(), "it holds no vector or matrix of real numbers");
    Ok(Header::of(names, None))
}

/// Reads the columns at these places of [`header`], that of the time first. `unstated`: no unit of the time is stated;
/// how to state one.
pub(super) fn read(
    path: &Path,
    header: &Header,
    places: &[usize],
    unstated: Option<&String>,
) -> Result<Found> {
    let size = path.metadata()?.len();
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); places.len()];
    let mut before = 0;
    walk(path, &mut |shape, numbers| {
        let here = before..before + shape.columns;
        before = here.end;
        if !places.iter().any(|place| here.contains(place)) {
            return Ok(());
        }
        if let Some(remedy) = unstated.filter(|_| shape.integers && here.contains(&places[0])) {
            bail!(
                "{} holds integers, and their unit of time is not known (allowed: floating-point numbers in s, integers of a \
                 unit that is stated): {remedy}",
                shape.name
            );
        }
        budget::reading(shape.rows, places.len(), size)?;
        // only columns that are wanted are kept: a matrix of bytes is eight times as large in numbers
        let mut at = 0;
        numbers.each(shape.rows * shape.columns, &mut |value| {
            let column = match shape.by_column {
                true => at / shape.rows,
                false => at % shape.columns,
            };
            at += 1;
            for (into, place) in columns.iter_mut().zip(places) {
                if *place == here.start + column {
                    into.push(value);
                }
            }
        })
    })?;
    let lengths = || columns.iter().map(Vec::len);
    if lengths().min() != lengths().max() {
        let name = |(place, column): (&usize, &Vec<f64>)| {
            format!("{} {}", header.names[*place], column.len())
        };
        let all: Vec<String> = places.iter().zip(&columns).map(name).collect();
        bail!(
            "its columns differ in length ({}): all must be sampled at the same times",
            all.join(", ")
        );
    }
    // an infinite value is refused as one that is not finite, NaN is one that is missing
    for (column, place) in columns.iter().zip(places) {
        if let Some(row) = column.iter().position(|value| value.is_infinite()) {
            let name = &header.names[*place];
            bail!(
                "element {} of {name} is {} (allowed: finite numbers, NaN where a value is missing)",
                row + 1,
                column[row]
            );
        }
    }
    Ok(Found { columns, origin: None, seconds: false })
}

/// Goes through the arrays of a file.
fn walk(path: &Path, visit: Visit) -> Result<()> {
    let mut file = BufReader::new(input::open(path).context("it cannot be opened")?);
    let mut inflatable = budget::INFLATED;
    let mut start = [0; 128];
    let complete = file.read_exact(&mut start).is_ok();
    ensure!(
        !start.starts_with(b"MATLAB 7.3") && !start.starts_with(b"\x89HDF"),
        "it is a .mat file of version 7.3, which is HDF5 (allowed: version 5): in MATLAB \
         save('FILE.mat', ..., '-v7') writes version 5; in Python h5py reads it and pandas' to_parquet writes a file \
         that is read here"
    );
    let big = match &start[126..] {
        b"IM" => false,
        b"MI" => true,
        _ => bail!("it is not a .mat file of version 5 (MATLAB: save('FILE.mat', ..., '-v7'))"),
    };
    ensure!(complete, "it ends within its header");
    while let Some(tag) = Tag::next(&mut file, big)? {
        // nothing is padded here but an element that is not a compressed one
        let padding = if tag.kind == COMPRESSED { 0 } else { tag.padding() };
        let mut body = (&mut file).take(tag.bytes.into());
        match tag.kind {
            COMPRESSED => {
                let mut inflated = ZlibDecoder::new(&mut body).take(inflatable);
                if let Some(tag) = Tag::next(&mut inflated, big)?.filter(|tag| tag.kind == MATRIX) {
                    let done =
                        array(&mut (&mut inflated).take(tag.bytes.into()), big, None, 0, visit);
                    ensure!(
                        inflated.limit() > 0,
                        "it holds more than {:.1} GB when decompressed (allowed: less)",
                        budget::INFLATED as f64 / 1e9
                    );
                    done?;
                }
                inflatable = inflated.limit();
            }
            MATRIX => array(&mut body, big, None, 0, visit)?,
            _ => {}
        }
        copy(&mut body, &mut sink())?;
        let left = body.limit();
        ensure!(left == 0, "it is not complete: {left} bytes are missing");
        copy(&mut (&mut file).take(padding), &mut sink())?;
    }
    Ok(())
}

/// The tag of an element.
struct Tag {
    kind: u32,
    bytes: u32,
    /// The data stand in the tag's own eight bytes.
    small: Option<[u8; 4]>,
}

fn word(bytes: [u8; 4], big: bool) -> u32 {
    if big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
}

impl Tag {
    /// `None` at the end.
    fn next(from: &mut dyn Read, big: bool) -> Result<Option<Tag>> {
        let mut bytes = [0; 4];
        if from.read(&mut bytes[..1])? == 0 {
            return Ok(None);
        }
        let cut = "it ends within an element";
        from.read_exact(&mut bytes[1..]).context(cut)?;
        let first = word(bytes, big);
        from.read_exact(&mut bytes).context(cut)?;
        Ok(Some(match first >> 16 {
            0 => Tag { kind: first, bytes: word(bytes, big), small: None },
            length => {
                ensure!(length <= 4, "it has a small element of {length} bytes (allowed: 1 to 4)");
                Tag { kind: first & 0xffff, bytes: length, small: Some(bytes) }
            }
        }))
    }

    /// Bytes up to the next multiple of eight.
    fn padding(&self) -> u64 {
        if self.small.is_some() {
            0
        } else {
            u64::from(self.bytes).next_multiple_of(8) - u64::from(self.bytes)
        }
    }

    /// The data of a short element.
    fn data(&self, from: &mut dyn Read) -> Result<Vec<u8>> {
        if let Some(bytes) = self.small {
            return Ok(bytes[..self.bytes as usize].to_vec());
        }
        ensure!(self.bytes <= LONGEST, "it has a name or dimensions of {} bytes", self.bytes);
        let mut data = vec![0; self.bytes as usize];
        from.read_exact(&mut data).context("it ends within an element")?;
        copy(&mut from.take(self.padding()), &mut sink())?;
        Ok(data)
    }
}

/// The next short element's data.
fn short(from: &mut dyn Read, big: bool) -> Result<Vec<u8>> {
    Tag::next(from, big)?.context("it ends within an array")?.data(from)
}

/// The words of a short element.
fn words(from: &mut dyn Read, big: bool) -> Result<Vec<u32>> {
    let data = short(from, big)?;
    Ok(data.chunks_exact(4).map(|b| word([b[0], b[1], b[2], b[3]], big)).collect())
}

/// An array, after its tag; one of a structure has its `name` from there. `from` ends with it.
fn array(
    from: &mut dyn Read,
    big: bool,
    name: Option<String>,
    depth: usize,
    visit: Visit,
) -> Result<()> {
    ensure!(depth <= DEEPEST, "its structures are nested more than {DEEPEST} deep");
    let Some(flags) = Tag::next(from, big)? else { return Ok(()) }; // an empty field
    let flags = flags.data(from)?;
    ensure!(flags.len() == 8, "it has an array without flags");
    let flags = word([flags[0], flags[1], flags[2], flags[3]], big);
    let (class, complex) = ((flags & 0xff) as u8, flags & 0x800 != 0);
    if class != STRUCT && !NUMBERS.contains(&class) {
        return Ok(());
    }
    let dimensions: Vec<usize> = words(from, big)?.iter().map(|d| *d as usize).collect();
    let own = String::from_utf8_lossy(&short(from, big)?).into_owned();
    let name = name.unwrap_or(own);
    let elements = dimensions.iter().try_fold(1_usize, |product, d| product.checked_mul(*d));
    let elements = elements.context("it has an array with more elements than fit into memory")?;
    if class == STRUCT {
        return structure(from, big, &name, elements, depth, visit);
    }
    let longest = dimensions.iter().copied().max().unwrap_or(0);
    if elements == 0 {
        return Ok(());
    }
    if complex || longest < 2 || elements / longest > WIDEST || dimensions.len() > 2 {
        return Ok(());
    }
    let tag = Tag::next(from, big)?.context("it ends within an array")?;
    let shape = Shape {
        name,
        rows: longest,
        columns: elements / longest,
        by_column: dimensions[0] == longest,
        integers: INTEGERS.contains(&class),
    };
    visit(&shape, &mut Numbers { from, kind: tag.kind, bytes: tag.bytes, small: tag.small, big })
}

/// A structure: its fields, of each element in turn.
fn structure(
    from: &mut dyn Read,
    big: bool,
    name: &str,
    elements: usize,
    depth: usize,
    visit: Visit,
) -> Result<()> {
    let length = words(from, big)?.first().copied().unwrap_or(0) as usize;
    ensure!(length > 0, "the structure {name} has no names of fields");
    let names = short(from, big)?;
    let fields = names.chunks(length).map(|name| {
        let end = name.iter().position(|byte| *byte == 0).unwrap_or(name.len());
        String::from_utf8_lossy(&name[..end]).into_owned()
    });
    let fields: Vec<String> = fields.collect();
    // without fields nothing would be read of an element, whatever number of elements the file declares
    let elements = if fields.is_empty() { 0 } else { elements };
    ensure!(
        elements.saturating_mul(fields.len()) <= MOST,
        "the structure {name} has {elements} elements of {} fields (allowed: {MOST} together)",
        fields.len()
    );
    for k in 1..=elements {
        for field in &fields {
            let Some(tag) = Tag::next(from, big)? else { return Ok(()) };
            let mut body = (&mut *from).take(tag.bytes.into());
            if tag.kind == MATRIX {
                let element = if elements > 1 { format!("{name}({k})") } else { name.to_string() };
                array(&mut body, big, Some(format!("{element}.{field}")), depth + 1, visit)?;
            }
            copy(&mut body, &mut sink())?;
            copy(&mut (&mut *from).take(tag.padding()), &mut sink())?;
        }
    }
    Ok(())
}

/// Numbers that are still in the file, of any of its types.
struct Numbers<'a> {
    from: &'a mut dyn Read,
    kind: u32,
    bytes: u32,
    small: Option<[u8; 4]>,
    big: bool,
}

/// Bytes that are decoded at once; a multiple of the width of every type.
const CHUNK: u64 = 1 << 16;

impl Numbers<'_> {
    /// Hands over each value, of which there must be `count`.
    fn each(&mut self, count: usize, with: &mut dyn FnMut(f64)) -> Result<()> {
        let width = match self.kind {
            1 | 2 => 1,
            3 | 4 => 2,
            5..=7 => 4,
            9 | 12 | 13 => 8,
            kind => bail!("it has numbers of an unknown type, {kind}"),
        };
        let (stored, bytes) = (self.bytes as usize / width, self.bytes as usize);
        ensure!(
            stored == count && bytes % width == 0,
            "an array of {count} numbers holds {stored}"
        );
        let mut data = match self.small {
            Some(bytes) => bytes[..self.bytes as usize].to_vec(),
            None => Vec::new(),
        };
        let mut left = if self.small.is_some() { 0 } else { u64::from(self.bytes) };
        loop {
            for bytes in data.chunks_exact(width) {
                with(self.number(bytes));
            }
            if left == 0 {
                return Ok(());
            }
            data.clear();
            let next = left.min(CHUNK);
            (&mut *self.from).take(next).read_to_end(&mut data)?;
            ensure!(data.len() as u64 == next, "it ends within an array");
            left -= next;
        }
    }

    /// The number in `bytes`.
    fn number(&self, bytes: &[u8]) -> f64 {
        let width = bytes.len();
        // least significant byte first
        let mut b = [0; 8];
        b[..width].copy_from_slice(bytes);
        if self.big {
            b[..width].reverse();
        }
        let [b0, b1, b2, b3, ..] = b;
        match self.kind {
            1 => f64::from(b0 as i8),
            2 => f64::from(b0),
            3 => f64::from(i16::from_le_bytes([b0, b1])),
            4 => f64::from(u16::from_le_bytes([b0, b1])),
            5 => f64::from(i32::from_le_bytes([b0, b1, b2, b3])),
            6 => f64::from(u32::from_le_bytes([b0, b1, b2, b3])),
            7 => f64::from(f32::from_le_bytes([b0, b1, b2, b3])),
            9 => f64::from_le_bytes(b),
            12 => i64::from_le_bytes(b) as f64,
            _ => u64::from_le_bytes(b) as f64,
        }
    }
}
