//! Reads Parquet files: numbers of every type, and times in seconds. Times go by their logical type (TIMESTAMP, TIME, DATE,
//! INTERVAL, INT96) or by the type in Arrow's schema (durations of pandas and Polars). Nothing is taken for a number that is
//! none, and no unit is guessed.

mod arrow;
mod kind;
mod pages;

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};
use files::{budget, bug, input};
use parquet::basic::Compression;
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{DataType, Int96};
use parquet::file::reader::{FileReader, SerializedFileReader};

use self::kind::Kind;

/// Rows that are decoded at once.
const BATCH: usize = 1 << 16;

/// Reading of the time column.
#[derive(Clone, Copy, Debug)]
pub struct Time<'a> {
    /// Place among the wanted columns.
    pub place: usize,
    /// Seconds in the unit that the user or the column's name states; `None`: no unit is stated.
    pub stated: Option<f64>,
    /// End of an error's sentence: how to state the unit.
    pub remedy: &'a str,
}

/// Columns that were read, NaN where a value is missing.
pub struct Found {
    /// Values of each wanted column.
    pub columns: Vec<Vec<f64>>,
    /// The first row's date in RFC 3339, if the times are dates: they count from that row.
    pub origin: Option<String>,
    /// True if the type of the time column gives seconds, whatever unit is stated.
    pub seconds: bool,
}

/// Paths of the columns, `a.b` within a structure.
///
/// # Errors
/// If the file cannot be read.
pub fn names(path: &Path) -> Result<Vec<String>> {
    guarded(|| {
        let reader = open(path)?;
        let schema = reader.metadata().file_metadata().schema_descr();
        Ok(schema.columns().iter().map(|column| column.path().string()).collect())
    })
}

/// The key-value metadata.
///
/// # Errors
/// If the file is not complete.
pub fn metadata(path: &Path) -> Result<BTreeMap<String, String>> {
    guarded(|| Ok(pairs(&open(path)?)))
}

/// The library that wrote the file, if the file names it.
///
/// # Errors
/// If the file is not complete.
pub fn writer(path: &Path) -> Result<Option<String>> {
    guarded(|| Ok(open(path)?.metadata().file_metadata().created_by().map(String::from)))
}

/// Reads the columns at the places that `positions` finds among the names of all. Those at which `booleans` is true may hold true
/// and false.
///
/// # Errors
/// If the file cannot be read, a column holds no numbers, or the unit of the time is not known.
pub fn read(
    path: &Path,
    positions: impl Fn(&[String]) -> Result<Vec<usize>>,
    time: Option<Time>,
    booleans: &[bool],
) -> Result<Found> {
    guarded(|| {
        let reader = open(path)?;
        let metadata = reader.metadata();
        let schema = metadata.file_metadata().schema_descr();
        let names: Vec<String> = schema.columns().iter().map(|c| c.path().string()).collect();
        let positions = positions(&names)?;
        let file = input::open(path)?;
        let size = file.metadata()?.len();
        let rows = metadata.row_groups().iter().map(|group| group.num_rows().max(0) as usize);
        budget::reading(rows.fold(0, usize::saturating_add), positions.len(), size)?;
        let arrow = match pairs(&reader).get("ARROW:schema") {
            Some(text) => arrow::temporals(text).context("its entry ARROW:schema is damaged")?,
            None => BTreeMap::new(),
        };
        let mut kinds = Vec::new();
        for (k, &position) in positions.iter().enumerate() {
            let column = schema.column(position);
            let name = &names[position];
            let kind = Kind::of(&column, arrow.get(name).copied())
                .map_err(|why| anyhow!("column {name} does not hold numbers: {why}"))?;
            let is_time = time.filter(|time| time.place == k);
            let is_fine = match kind {
                Kind::Time(_) => is_time.is_some(),
                Kind::Boolean => booleans.get(k) == Some(&true),
                _ => true,
            };
            ensure!(is_fine, "column {name} holds {kind} (allowed: numbers)");
            if let Some(time) = is_time {
                kind.check_time(name, &time)?;
            }
            kinds.push((kind, column.max_def_level()));
        }
        let mut columns = vec![Vec::new(); positions.len()];
        let mut origins: Vec<Option<i64>> = vec![None; positions.len()];
        for group in 0..metadata.num_row_groups() {
            let group = reader.get_row_group(group)?;
            let rows = group.metadata().num_rows().max(0) as usize;
            for (k, &position) in positions.iter().enumerate() {
                let (start, length) = group.metadata().column(position).byte_range();
                let column = || format!("column {}", names[position]);
                let codec = group.metadata().column(position).compression();
                ensure!(
                    !matches!(codec, Compression::BROTLI(_) | Compression::LZO),
                    "column {} is compressed with {codec} (allowed: none, Snappy, gzip, LZ4, Zstandard); in Python \
                     pandas.read_parquet('FILE').to_parquet('FILE', compression='zstd') converts the file",
                    names[position]
                );
                pages::check(&file, start, length, size).with_context(column)?;
                let (kind, level) = &kinds[k];
                let reader = group.get_column_reader(position)?;
                let into = (&mut columns[k], &mut origins[k]);
                values(reader, rows, *level, kind, into).with_context(column)?;
            }
        }
        let place = time.map_or(usize::MAX, |time| time.place);
        let of_time = kinds.get(place).and_then(|(kind, _)| match kind {
            Kind::Time(temporal) => Some(temporal),
            _ => None,
        });
        let origin = of_time.and_then(|t| t.date(*origins.get(place)?.as_ref()?));
        Ok(Found { columns, origin, seconds: of_time.is_some() })
    })
}

/// Turns a panic of the Parquet library, which damaged files cause, into an error.
fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    bug::caught(work).unwrap_or_else(|panic| {
        bail!("it is damaged: the library that reads Parquet gave up: {panic}")
    })
}

fn open(path: &Path) -> Result<SerializedFileReader<File>> {
    let file = input::open(path).context("it cannot be opened")?;
    SerializedFileReader::new(file).context("it is not a complete Parquet file")
}

fn pairs(reader: &SerializedFileReader<File>) -> BTreeMap<String, String> {
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    let pairs = pairs.into_iter().flatten();
    pairs.map(|pair| (pair.key.clone(), pair.value.clone().unwrap_or_default())).collect()
}

/// Appends the values of a column, and its first value if it is a date.
fn values(
    reader: ColumnReader,
    rows: usize,
    level: i16,
    kind: &Kind,
    (into, origin): (&mut Vec<f64>, &mut Option<i64>),
) -> Result<()> {
    let mut integer = |value: i64| kind.integer(value, origin);
    match reader {
        ColumnReader::DoubleColumnReader(r) => batches(r, rows, level, into, |v| Ok(*v)),
        ColumnReader::FloatColumnReader(r) => batches(r, rows, level, into, |v| Ok(f64::from(*v))),
        ColumnReader::Int32ColumnReader(r) => {
            batches(r, rows, level, into, |v| Ok(integer(kind.widened(*v))))
        }
        ColumnReader::Int64ColumnReader(r) => batches(r, rows, level, into, |v| Ok(integer(*v))),
        ColumnReader::Int96ColumnReader(r) => batches(r, rows, level, into, |v: &Int96| {
            let nanoseconds = kind::of_int96(v.data());
            Ok(integer(nanoseconds.context("a date is outside the years 1677 to 2262")?))
        }),
        ColumnReader::FixedLenByteArrayColumnReader(r) => {
            batches(r, rows, level, into, |v| kind.bytes(v.data()))
        }
        ColumnReader::ByteArrayColumnReader(r) => {
            batches(r, rows, level, into, |v| kind.bytes(v.data()))
        }
        ColumnReader::BoolColumnReader(r) => {
            batches(r, rows, level, into, |v| Ok(f64::from(u8::from(*v))))
        }
    }
}

/// Appends `rows` values, a batch at a time; a missing one becomes NaN.
fn batches<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    level: i16,
    into: &mut Vec<f64>,
    mut convert: impl FnMut(&T::T) -> Result<f64>,
) -> Result<()> {
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    let mut done = 0;
    while done < rows {
        levels.clear();
        values.clear();
        let most = (rows - done).min(BATCH);
        let (read, _, _) = reader.read_records(most, Some(&mut levels), None, &mut values)?;
        ensure!(read > 0, "it ends too early");
        done += read;
        let mut values = values.iter();
        if level == 0 {
            ensure!(values.len() == read, "it ends too early");
            for value in values {
                into.push(convert(value)?);
            }
            continue;
        }
        ensure!(levels.len() == read, "it ends too early");
        for of_row in &levels {
            let value = if *of_row == level { values.next() } else { None };
            into.push(value.map_or(Ok(f64::NAN), &mut convert)?);
        }
    }
    Ok(())
}
