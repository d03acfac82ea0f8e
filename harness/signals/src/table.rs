//! Tables of numbers in CSV or Parquet files (by the file's ending). Signals have SI units and the FMU's
//! names; `time` is in s.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, anyhow, bail, ensure};
use parquet::basic::{Compression, Encoding, Repetition, Type as Physical, ZstdLevel};
use parquet::data_type::DoubleType;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use files::output::atomically;
use files::{budget, input};

use crate::parquet_file;

/// Named columns of equal length; `gaps` are the names of the columns in which NaN marks missing values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
    gaps: BTreeSet<String>,
}

fn is_parquet(path: &Path) -> Result<bool> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_lowercase).as_deref() {
        Some("csv") => Ok(false),
        Some("parquet") => Ok(true),
        _ => bail!("{}: the name must end in .csv or .parquet", path.display()),
    }
}

/// Checks that a table can be written to `path`.
///
/// # Errors
/// If its name ends neither in .csv nor in .parquet.
pub fn check_ending(path: &Path) -> Result<()> {
    is_parquet(path).map(drop)
}

impl Table {
    /// Creates a table from columns with their names.
    ///
    /// # Panics
    /// If the columns are not equally long, or names and columns differ in number.
    pub fn new(names: Vec<String>, columns: Vec<Vec<f64>>) -> Self {
        assert_eq!(names.len(), columns.len());
        assert!(columns.windows(2).all(|pair| pair[0].len() == pair[1].len()));
        Table { names, columns, gaps: BTreeSet::new() }
    }

    /// Creates a table from pairs of name and column.
    ///
    /// # Panics
    /// If the columns are not equally long.
    pub fn of<Name: Into<String>>(pairs: impl IntoIterator<Item = (Name, Vec<f64>)>) -> Self {
        let (names, columns) =
            pairs.into_iter().map(|(name, column)| (name.into(), column)).unzip();
        Table::new(names, columns)
    }

    /// Adds a column in which NaN marks missing values. In a file, a missing value is an empty field (CSV)
    /// or a null (Parquet).
    ///
    /// # Panics
    /// If the column has another number of rows than the table.
    pub fn with_gaps(mut self, name: &str, column: Vec<f64>) -> Table {
        assert_eq!(column.len(), self.rows());
        self.names.push(name.into());
        self.gaps.insert(name.into());
        self.columns.push(column);
        self
    }

    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    pub fn names(&self) -> &[String] {
        &self.names
    }

    pub fn columns(&self) -> &[Vec<f64>] {
        &self.columns
    }

    pub fn column(&self, name: &str) -> Option<&[f64]> {
        let index = self.names.iter().position(|n| n == name)?;
        Some(&self.columns[index])
    }

    /// Returns a table with the columns `names` of this table, in the order of `names`.
    ///
    /// # Panics
    /// If a column does not exist.
    pub fn select(&self, names: &[&str]) -> Table {
        let column = |name: &&str| self.column(name).expect("a column of this table").to_vec();
        Table {
            names: names.iter().map(|n| n.to_string()).collect(),
            columns: names.iter().map(column).collect(),
            gaps: self.gaps.clone(),
        }
    }

    /// Reads the columns `wanted` from a file. The file may contain further columns.
    ///
    /// # Errors
    /// If the file cannot be read, a column is missing or exists twice, or a value is not a finite number.
    pub fn read(path: &Path, wanted: &[&str]) -> Result<Table> {
        let name = path.display();
        let read = if is_parquet(path)? { read_parquet } else { read_csv };
        let table =
            read(path, wanted).with_context(|| format!("the table {name} cannot be used"))?;
        table.all_finite().map_err(|error| anyhow!("{name}, {error}"))?;
        Ok(table)
    }

    /// Checks that all values are finite, except missing values in columns with gaps.
    ///
    /// # Errors
    /// Names the first value that is not finite.
    pub fn all_finite(&self) -> Result<()> {
        for (column, values) in self.names.iter().zip(&self.columns) {
            let gaps = self.gaps.contains(column);
            let fine = |value: &f64| value.is_finite() || (gaps && value.is_nan());
            if let Some(row) = values.iter().position(|value| !fine(value)) {
                let value = values[row];
                bail!("row {}: {column} is {value} (allowed: finite numbers)", row + 1);
            }
        }
        Ok(())
    }

    /// Checks that the written table could be read again: all values are finite, and no two columns
    /// have the same name.
    fn check(&self) -> Result<()> {
        let mut names = BTreeSet::new();
        if let Some(twice) = self.names.iter().find(|name| !names.insert(*name)) {
            bail!("two of the columns are called {twice} (allowed: each name once)");
        }
        self.all_finite()
    }

    /// Writes the table to a CSV or Parquet file. An existing file is replaced as a whole. `metadata` are
    /// key-value pairs, which only a Parquet file contains.
    ///
    /// # Errors
    /// If a value is neither finite nor missing, or the file cannot be written.
    pub fn write(&self, path: &Path, metadata: &BTreeMap<String, String>) -> Result<()> {
        let is_parquet = is_parquet(path)?;
        atomically(path, |file| match is_parquet {
            true => self.write_parquet(file, metadata),
            false => self.write_csv(file),
        })
    }

    /// Writes the table as CSV.
    ///
    /// # Errors
    /// If a value is neither finite nor missing, or the file cannot be written.
    pub fn write_csv(&self, file: impl Write) -> Result<()> {
        self.check()?;
        let mut out = BufWriter::new(file);
        // A comma within a name, as in p[1,2], does not separate columns if the name is in quotes (RFC 4180).
        let quoted = |name: &String| match name.contains([',', '"']) {
            true => format!("\"{}\"", name.replace('"', "\"\"")),
            false => name.clone(),
        };
        writeln!(out, "{}", self.names.iter().map(quoted).collect::<Vec<_>>().join(","))?;
        for row in 0..self.rows() {
            for (i, column) in self.columns.iter().enumerate() {
                // Written with the fewest digits that give the same number when read.
                let comma = if i == 0 { "" } else { "," };
                match column[row] {
                    value if value.is_nan() => write!(out, "{comma}")?,
                    value => write!(out, "{comma}{value:?}")?,
                }
            }
            writeln!(out)?;
        }
        out.flush()?;
        Ok(())
    }

    fn write_parquet(&self, file: &mut File, metadata: &BTreeMap<String, String>) -> Result<()> {
        self.check()?;
        let fields = self
            .names
            .iter()
            .map(|name| {
                let repetition = match self.gaps.contains(name) {
                    true => Repetition::OPTIONAL,
                    false => Repetition::REQUIRED,
                };
                Type::primitive_type_builder(name, Physical::DOUBLE)
                    .with_repetition(repetition)
                    .build()
                    .map(Arc::new)
            })
            .collect::<Result<_, _>>()?;
        let schema = Type::group_type_builder("schema").with_fields(fields).build()?;
        let metadata = metadata.iter().map(|(k, v)| KeyValue::new(k.clone(), v.clone())).collect();
        let properties = WriterProperties::builder()
            .set_dictionary_enabled(false)
            .set_encoding(Encoding::BYTE_STREAM_SPLIT) // groups the exponents, which compress well
            .set_compression(Compression::ZSTD(ZstdLevel::try_new(1)?))
            .set_key_value_metadata(Some(metadata))
            .build();
        let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))?;
        let mut group = writer.next_row_group()?;
        for (name, values) in self.names.iter().zip(&self.columns) {
            let mut column = group
                .next_column()?
                .context("the file has fewer columns than names in its header")?;
            let typed = column.typed::<DoubleType>();
            if self.gaps.contains(name) {
                let levels: Vec<i16> = values.iter().map(|v| i16::from(!v.is_nan())).collect();
                let there: Vec<f64> = values.iter().copied().filter(|v| !v.is_nan()).collect();
                typed.write_batch(&there, Some(&levels), None)?;
            } else {
                typed.write_batch(values, None, None)?;
            }
            column.close()?;
        }
        group.close()?;
        writer.close()?;
        Ok(())
    }
}

/// Returns the key-value metadata of a Parquet file.
///
/// # Errors
/// If the file is not complete.
pub fn metadata(path: &Path) -> Result<BTreeMap<String, String>> {
    parquet_file::metadata(path)
        .with_context(|| format!("the table {} cannot be used", path.display()))
}

/// Returns true if HubSlosh wrote the Parquet file, because the file then names the Parquet library of
/// HubSlosh, which programs in other languages do not use.
pub fn is_ours(path: &Path) -> bool {
    let writer = parquet_file::writer(path).ok().flatten();
    writer.is_none_or(|writer| writer.starts_with("parquet-rs"))
}

/// Lists the names of the columns of a file.
///
/// # Errors
/// If the file cannot be read or has no header.
pub fn names(path: &Path) -> Result<Vec<String>> {
    let names = match is_parquet(path)? {
        true => parquet_file::names(path),
        false => header(path).map(|(_, names)| names),
    };
    names.with_context(|| format!("the table {} cannot be used", path.display()))
}

fn header(path: &Path) -> Result<(csv::Reader<File>, Vec<String>)> {
    let file = input::open(path).context("the file cannot be opened")?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(file);
    let header = reader.headers().context("the file has no header row")?;
    let names = header.iter().map(|h| h.trim_start_matches('\u{feff}').to_string()).collect();
    Ok((reader, names))
}

fn positions(there: &[String], wanted: &[&str]) -> Result<Vec<usize>> {
    let count = |name: &&&str| there.iter().filter(|other| other.trim() == **name).count();
    let listed = |of: fn(usize) -> bool| {
        let names: Vec<&str> = wanted.iter().filter(|name| of(count(name))).copied().collect();
        names.join(", ")
    };
    let (missing, twice) = (listed(|n| n == 0), listed(|n| n > 1));
    let all = there.join(", ");
    ensure!(missing.is_empty(), "the file has no column {missing} (columns in it: {all})");
    ensure!(twice.is_empty(), "more than one of its columns is called {twice}");
    Ok(wanted.iter().flat_map(|w| there.iter().position(|t| t.trim() == *w)).collect())
}

fn read_csv(path: &Path, wanted: &[&str]) -> Result<Table> {
    let (mut reader, names) = header(path)?;
    let positions = positions(&names, wanted)?;
    let mut columns = vec![Vec::new(); wanted.len()];
    for (row, record) in reader.records().enumerate() {
        budget::table(row + 1, wanted.len())?;
        let record = record.with_context(|| format!("row {}", row + 1))?;
        for (column, &position) in columns.iter_mut().zip(&positions) {
            let text = &record[position];
            let value =
                text.parse().map_err(|_| anyhow!("row {}: \"{text}\" is not a number", row + 1))?;
            column.push(value);
        }
    }
    Ok(Table::new(wanted.iter().map(|w| w.to_string()).collect(), columns))
}

fn read_parquet(path: &Path, wanted: &[&str]) -> Result<Table> {
    let time = wanted.iter().position(|name| *name == "time").map(|place| (place, None));
    let found = parquet_file::read(path, |names| positions(names, wanted), time, &[])?;
    Ok(Table::new(wanted.iter().map(|w| w.to_string()).collect(), found.columns))
}
