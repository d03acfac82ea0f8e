//! Reads Parquet files: floating-point numbers, integers, Booleans, and timestamps as times. The Python package reads other types.

mod pages;

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};
use chrono::DateTime;
use files::{budget, bug, input};
use parquet::basic::{Compression, ConvertedType, LogicalType, TimeUnit, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

use crate::foreign::Foreign;

const BATCH: usize = 1 << 16;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Real,
    Boolean,
    Integer {
        is_signed: bool,
    },
    /// Timestamp in ticks since 1970; the field is the number of ticks in a second.
    Date(i64),
}

impl Kind {
    /// Returns the type of a column; `None` for a type that only the Python package reads.
    fn from_column(column: &ColumnDescriptor) -> Option<Kind> {
        let logical = match (column.logical_type_ref(), column.converted_type()) {
            (Some(LogicalType::Timestamp(stamp)), _) => Some(Kind::Date(match stamp.unit {
                TimeUnit::MILLIS => 1_000,
                TimeUnit::MICROS => 1_000_000,
                TimeUnit::NANOS => 1_000_000_000,
            })),
            (Some(LogicalType::Integer(integer)), _) => {
                Some(Kind::Integer { is_signed: integer.is_signed })
            }
            (None, ConvertedType::NONE) => None,
            _ => return None,
        };
        match column.physical_type() {
            _ if column.max_rep_level() > 0 => None,
            Physical::FLOAT | Physical::DOUBLE if logical.is_none() => Some(Kind::Real),
            Physical::BOOLEAN => Some(Kind::Boolean),
            Physical::INT32 | Physical::INT64 => {
                Some(logical.unwrap_or(Kind::Integer { is_signed: true }))
            }
            _ => None,
        }
    }
}

/// Columns that were read from a Parquet file; NaN marks missing values. If the file holds dates as times, `origin` is the date
/// of the first row in RFC 3339, and the returned times are seconds since this row.
pub struct Found {
    pub columns: Vec<Vec<f64>>,
    pub origin: Option<String>,
}

/// Lists the paths of the columns; `a.b` is the column b within the structure a.
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

pub fn metadata(path: &Path) -> Result<BTreeMap<String, String>> {
    guarded(|| Ok(pairs(&open(path)?)))
}

/// Returns the name of the library that wrote the file, if the file states it.
///
/// # Errors
/// If the file is incomplete.
pub fn writer(path: &Path) -> Result<Option<String>> {
    guarded(|| Ok(open(path)?.metadata().file_metadata().created_by().map(String::from)))
}

/// Reads columns of a Parquet file. `positions` receives the names of all columns, and returns the positions of the columns
/// to read. If one of these is the time, `time` contains its index among the columns to read and, if a unit is stated, the
/// length of the unit, s. Integer times need a stated unit; timestamps have their own. Columns with true in `booleans` may
/// contain Booleans.
///
/// # Errors
/// If the file cannot be read, or the stated unit of timestamps is not their own; [`Foreign`] for types that this
/// function does not read.
pub fn read(
    path: &Path,
    positions: impl Fn(&[String]) -> Result<Vec<usize>>,
    time: Option<(usize, Option<f64>)>,
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
        let mut kinds = Vec::new();
        for (k, &position) in positions.iter().enumerate() {
            let column = schema.column(position);
            let kind = Kind::from_column(&column);
            let time = time.filter(|(place, _)| *place == k);
            if let (Some(Kind::Date(ticks)), Some((_, Some(unit)))) = (kind, time) {
                ensure!(
                    (unit * ticks as f64 - 1.0).abs() < 1e-9,
                    "column {} holds timestamps, whose unit the file contains, but its name or --columns states \
                     another unit, {unit} s: leave the unit out",
                    names[position]
                );
            }
            let is_fine = match (kind, time) {
                (Some(Kind::Real), _) | (Some(Kind::Date(_)), Some(_)) => true,
                (Some(Kind::Integer { .. }), time) => time.is_none_or(|(_, unit)| unit.is_some()),
                (Some(Kind::Boolean), _) => booleans.get(k) == Some(&true),
                _ => false,
            };
            let Some(kind) = kind.filter(|_| is_fine) else {
                let kind = column
                    .logical_type_ref()
                    .map_or(column.physical_type().to_string(), |of| format!("{of:?}"));
                let allowed = match time.is_some() {
                    true => "timestamps, floating-point numbers in s, integers with a stated unit",
                    false => "numbers",
                };
                return Err(Foreign(format!(
                    "column {} holds {kind} (allowed: {allowed})",
                    names[position]
                ))
                .into());
            };
            kinds.push((kind, column.max_def_level()));
        }
        let mut columns = vec![Vec::new(); positions.len()];
        let mut first = None;
        for group in 0..metadata.num_row_groups() {
            let group = reader.get_row_group(group)?;
            let rows = group.metadata().num_rows().max(0) as usize;
            for ((&position, kind), into) in positions.iter().zip(&kinds).zip(&mut columns) {
                let chunk = group.metadata().column(position);
                let codec = chunk.compression();
                if matches!(codec, Compression::BROTLI(_) | Compression::LZO) {
                    let words = "allowed: none, Snappy, gzip, LZ4, Zstandard";
                    return Err(Foreign(format!(
                        "column {} is compressed with {codec} ({words})",
                        names[position]
                    ))
                    .into());
                }
                let (start, length) = chunk.byte_range();
                let column = || format!("column {}", names[position]);
                pages::check(&file, start, length, size).with_context(column)?;
                let reader = group.get_column_reader(position)?;
                values(reader, rows, *kind, into, &mut first).with_context(column)?;
            }
        }
        let ticks = kinds.iter().find_map(|(kind, _)| match kind {
            Kind::Date(ticks) => Some(*ticks),
            _ => None,
        });
        let origin = ticks.zip(first).and_then(|(ticks, first)| {
            let nanoseconds = first.rem_euclid(ticks) * (1_000_000_000 / ticks);
            DateTime::from_timestamp(first.div_euclid(ticks), nanoseconds as u32)
        });
        Ok(Found { columns, origin: origin.map(|at| at.to_rfc3339()) })
    })
}

/// Turns a panic of the Parquet library, which damaged files cause, into an error.
fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    bug::catch_panic(work).unwrap_or_else(|panic| bail!("the Parquet file is damaged: {panic}"))
}

fn open(path: &Path) -> Result<SerializedFileReader<File>> {
    let file = input::open(path).context("the file cannot be opened")?;
    SerializedFileReader::new(file).map_err(|_| anyhow!("the file is not a complete Parquet file"))
}

fn pairs(reader: &SerializedFileReader<File>) -> BTreeMap<String, String> {
    let pairs = reader.metadata().file_metadata().key_value_metadata();
    let pairs = pairs.into_iter().flatten();
    pairs.map(|pair| (pair.key.clone(), pair.value.clone().unwrap_or_default())).collect()
}

/// Appends the values of a column to `into`; a row without a value becomes NaN. `level` is the Parquet definition level of a
/// present value. Dates are converted to seconds since `first`, which is set to the date of the first row.
fn values(
    reader: ColumnReader,
    rows: usize,
    (kind, level): (Kind, i16),
    into: &mut Vec<f64>,
    first: &mut Option<i64>,
) -> Result<()> {
    let mut integer = |value: i64| match kind {
        Kind::Date(ticks) => {
            (i128::from(value) - i128::from(*first.get_or_insert(value))) as f64 / ticks as f64
        }
        Kind::Integer { is_signed: false } => value as u64 as f64,
        _ => value as f64,
    };
    match reader {
        ColumnReader::DoubleColumnReader(r) => batches(r, rows, level, into, |v| *v),
        ColumnReader::FloatColumnReader(r) => batches(r, rows, level, into, |v| f64::from(*v)),
        ColumnReader::BoolColumnReader(r) => {
            batches(r, rows, level, into, |v| f64::from(u8::from(*v)))
        }
        ColumnReader::Int32ColumnReader(r) if kind == (Kind::Integer { is_signed: false }) => {
            batches(r, rows, level, into, |v| f64::from(*v as u32))
        }
        ColumnReader::Int32ColumnReader(r) => batches(r, rows, level, into, |v| f64::from(*v)),
        ColumnReader::Int64ColumnReader(r) => batches(r, rows, level, into, |v| integer(*v)),
        _ => bail!("the type of the column differs from the type in the file's schema"),
    }
}

/// Appends `rows` values to `into` in batches. A missing value becomes NaN.
fn batches<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    level: i16,
    into: &mut Vec<f64>,
    mut convert: impl FnMut(&T::T) -> f64,
) -> Result<()> {
    let (mut levels, mut values) = (Vec::new(), Vec::new());
    let mut done = 0;
    while done < rows {
        levels.clear();
        values.clear();
        let most = (rows - done).min(BATCH);
        let (read, _, _) = reader.read_records(most, Some(&mut levels), None, &mut values)?;
        ensure!(read > 0, "the column ends too early");
        done += read;
        let mut values = values.iter();
        if level == 0 {
            ensure!(values.len() == read, "the column ends too early");
            into.extend(values.map(&mut convert));
            continue;
        }
        ensure!(levels.len() == read, "the column ends too early");
        for of_row in &levels {
            let value = if *of_row == level { values.next() } else { None };
            into.push(value.map_or(f64::NAN, &mut convert));
        }
    }
    Ok(())
}
