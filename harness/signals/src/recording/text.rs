//! Reads numbers in columns of text, separated by semicolons, tabs, commas or blanks, with decimal points or decimal
//! commas. Files may have comment lines, lines above the header, a row of units below it, and dates or clock times as time.
//! The layout is detected in the first lines of a file. Columns of text are skipped.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{Read as _, Seek as _, SeekFrom};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use csv::ByteRecord;
use files::{budget, input};

use super::Header;
use super::time::{self, Moment, Times, moment};
use crate::parquet_file::Found;

const SAMPLE: usize = 200;
const NAMED: usize = 5;
const SEPARATORS: [(u8, &str); 4] =
    [(b';', "semicolons"), (b'\t', "tabs"), (b',', "commas"), (b' ', "blanks")];
const COMMENTS: [&str; 3] = ["#", "%", "//"];
/// Words in a field that mean a missing value, including the words that C libraries and spreadsheets print for NaN.
const MISSING: &str = "nan na n/a #n/a null none - -- nat -nan nan(ind) -nan(ind) 1.#qnan -1.#qnan 1.#ind -1.#ind #nv #div/0!";

/// Reason why a field is not read, as a phrase that a message puts after the text of the field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
enum Unreadable {
    #[error(
        "is read with a decimal {}, the lines above with a decimal {} (allowed: one of them in a file, and no separators of thousands)",
        name(*.sign), name(*.before)
    )]
    Decimal { sign: char, before: char },
    #[error(
        "may be {whole}{rest} or {whole}.{rest} (allowed: numbers without separators of thousands, decimal points)"
    )]
    Thousands { whole: String, rest: String },
    #[error(transparent)]
    Time(#[from] time::Unreadable),
    #[error("is a date or a clock time, where the lines above have numbers")]
    TimeAmongNumbers,
    #[error("is not a Boolean (allowed: true, false, 1, 0)")]
    Boolean,
    #[error("is not a number")]
    Number,
}

fn name(sign: char) -> &'static str {
    if sign == ',' { "comma" } else { "point" }
}

#[derive(Clone, Debug, PartialEq)]
enum Value {
    Number(f64),
    Time(Moment),
    Missing,
    /// A number or a time that has several possible meanings, such as 1,234, or that cannot be read. The
    /// payload is the reason.
    Ambiguous(Unreadable),
    Other,
}

impl Value {
    fn is_there(&self) -> bool {
        !matches!(self, Value::Missing | Value::Other)
    }

    /// Parses a field as a number, a time or a missing value. `decimal` is the decimal sign of the preceding fields; the
    /// first number with a decimal sign sets it.
    fn parse(field: &str, separator: u8, decimal: &mut Option<char>) -> Value {
        match number(field, separator, decimal) {
            Ok(Some(number)) => Value::Number(number),
            Ok(None) if field.is_empty() => Value::Missing,
            Ok(None) if MISSING.split(' ').any(|word| word.eq_ignore_ascii_case(field)) => {
                Value::Missing
            }
            Ok(None) => match moment(field) {
                Ok(Some(moment)) => Value::Time(moment),
                Ok(None) => Value::Other,
                Err(reason) => Value::Ambiguous(reason.into()),
            },
            Err(reason) => Value::Ambiguous(reason),
        }
    }
}

/// Parses a field as a number; `None` if it is not a number.
///
/// # Errors
/// If the number has two possible meanings, or another decimal sign than the preceding fields.
fn number(
    field: &str,
    separator: u8,
    decimal: &mut Option<char>,
) -> Result<Option<f64>, Unreadable> {
    if !field.contains(|c: char| c.is_ascii_digit()) {
        return Ok(None);
    }
    let text = field.replace('\u{2212}', "-");
    let sign = text.chars().find(|c| matches!(c, '.' | ','));
    let Ok(value) = text.replacen(',', ".", 1).parse::<f64>() else { return Ok(None) };
    if let (Some(sign), Some(before)) = (sign, *decimal)
        && sign != before
    {
        return Err(Unreadable::Decimal { sign, before });
    }
    // Quotes around a field with a comma show that its comma is not a separator: "1,234".
    if let (b',', Some((whole, rest)), None) = (separator, text.split_once(','), *decimal)
        && rest.len() == 3
        && (1..4).contains(&whole.trim_start_matches(['-', '+']).len())
    {
        return Err(Unreadable::Thousands { whole: whole.into(), rest: rest.into() });
    }
    *decimal = decimal.or(sign);
    Ok(value.is_finite().then_some(value))
}

fn truth(field: &str) -> Result<f64, Unreadable> {
    match field.to_ascii_lowercase().as_str() {
        "true" => Ok(1.0),
        "false" => Ok(0.0),
        _ => Err(Unreadable::Boolean),
    }
}

/// Reader of the lines of a file, split into fields. It skips comments and empty lines. `count` is the number of lines read
/// so far, and `comment` contains the fields of the last comment.
struct Lines {
    reader: csv::Reader<File>,
    record: ByteRecord,
    separator: u8,
    count: usize,
    comment: Vec<String>,
}

impl Lines {
    fn open(path: &Path, separator: u8) -> Result<Self> {
        let file = input::open(path).context("the file cannot be opened")?;
        let mut builder = csv::ReaderBuilder::new();
        let reader =
            builder.has_headers(false).flexible(true).delimiter(separator).from_reader(file);
        Ok(Lines { reader, record: ByteRecord::new(), separator, count: 0, comment: Vec::new() })
    }

    fn next(&mut self) -> Result<bool> {
        while self.reader.read_byte_record(&mut self.record)? {
            ensure!(
                !self.record.as_slice().contains(&0),
                "line {} has a byte 0: it is not text",
                self.number()
            );
            let fields = self.fields();
            match fields
                .first()
                .and_then(|first| COMMENTS.iter().find(|sign| first.starts_with(**sign)))
            {
                Some(_) => {
                    let bare = |field: &Cow<str>| {
                        field.trim_start_matches(['#', '%', '/', ' ']).to_string()
                    };
                    let from = usize::from(bare(&fields[0]).is_empty());
                    self.comment = fields[from..].iter().map(bare).collect();
                }
                None if fields.iter().all(|field| field.is_empty()) => {}
                None => {
                    self.count += 1;
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    fn number(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::line)
    }

    /// Returns the fields of the line without surrounding blanks. In files with an old code page, ° and µ
    /// become �.
    fn fields(&self) -> Vec<Cow<'_, str>> {
        let all =
            self.record.iter().map(|field| match String::from_utf8_lossy(field.trim_ascii()) {
                Cow::Borrowed(text) => Cow::Borrowed(text.trim_matches(['\u{feff}', '\u{a0}'])),
                text => text,
            });
        all.filter(|field| self.separator != b' ' || !field.is_empty()).collect()
    }
}

/// First lines of a file, split by one of the separators: line number, fields and values of each line, the positions of the
/// columns of text, and the indices in `lines` of the lines that are rows of values.
struct Sample {
    separator: (u8, &'static str),
    lines: Vec<(u64, Vec<String>, Vec<Value>)>,
    comment: Vec<String>,
    width: usize,
    texts: Vec<usize>,
    rows: Vec<usize>,
}

impl Sample {
    fn read(path: &Path, separator: (u8, &'static str), least: usize) -> Result<Sample> {
        let mut file = Lines::open(path, separator.0)?;
        let (mut lines, mut comment) = (Vec::new(), Vec::new());
        while lines.len() < SAMPLE && file.next()? {
            if lines.is_empty() {
                comment.clone_from(&file.comment);
            }
            let fields: Vec<String> = file.fields().iter().map(|field| field.to_string()).collect();
            let values =
                fields.iter().map(|field| Value::parse(field, separator.0, &mut None)).collect();
            lines.push((file.number(), fields, values));
        }
        // Lines with any value count as rows of values. However, a row of units may contain a 1.
        let valued = |(_, _, values): &&(u64, _, Vec<Value>)| {
            values.len() >= least && values.iter().any(Value::is_there)
        };
        let widths: Vec<usize> =
            lines.iter().filter(valued).map(|(_, _, values)| values.len()).collect();
        let frequency =
            |width: &usize| (widths.iter().filter(|other| *other == width).count(), *width);
        let width = widths.iter().copied().max_by_key(frequency).unwrap_or(0);
        let count = |k: usize, of: fn(&Value) -> bool| {
            lines.iter().filter(valued).filter(|(_, _, v)| v.len() == width && of(&v[k])).count()
        };
        let texts: Vec<usize> = (0..width)
            .filter(|k| count(*k, |value| *value == Value::Other) > count(*k, Value::is_there))
            .collect();
        let is_row = |(_, _, values): &(u64, _, Vec<Value>)| {
            let numbers = || {
                values
                    .iter()
                    .enumerate()
                    .filter(|(k, _)| !texts.contains(k))
                    .map(|(_, value)| value)
            };
            let others = numbers().filter(|value| **value == Value::Other).count();
            values.len() == width && numbers().filter(|value| value.is_there()).count() > others
        };
        let rows = (0..lines.len()).filter(|k| is_row(&lines[*k])).collect();
        Ok(Sample { separator, lines, comment, width, texts, rows })
    }
}

/// Layout of a file, detected in its first lines. `above` is the number of lines above the first row; `texts` lists the
/// columns of text for the message that a column is missing.
pub(super) struct Layout {
    separator: u8,
    pub header: Header,
    above: usize,
    pub notes: Vec<String>,
    pub texts: String,
}

impl Layout {
    /// Detects the layout of a file: separator, header, units and first row.
    ///
    /// # Errors
    /// If no separator gives rows of numbers.
    pub fn detect(path: &Path) -> Result<Self> {
        // A single column is enough, for a table that contains only times.
        let mut tried = Vec::new();
        for (separator, least) in
            SEPARATORS.map(|of| (of, 2)).into_iter().chain([(SEPARATORS[2], 1)])
        {
            tried.push(Sample::read(path, separator, least)?);
        }
        ensure!(tried.iter().any(|sample| !sample.lines.is_empty()), "the file is empty");
        let start = |fields: &[String], separator: u8| {
            let line = fields.join(&char::from(separator).to_string());
            line.chars().take(60).collect::<String>()
        };
        // The separator with the most rows is chosen. Separators without columns of text are preferred.
        let key = |sample: &&Sample| (sample.width > 1, sample.texts.is_empty(), sample.rows.len());
        let usable = tried
            .iter()
            .rev()
            .filter(|sample| !sample.rows.is_empty() && sample.texts.len() < sample.width);
        let Some(Sample { separator, lines, comment, width, texts, rows }) = usable.max_by_key(key)
        else {
            let (line, fields, _) = tried[2].lines.get(1).unwrap_or(&tried[2].lines[0]);
            bail!(
                "line {line}, \"{}\", is not a row of numbers (allowed: numbers with decimal point or comma, separated by semicolons, \
                 tabs, commas or blanks; decimal commas need another separator, or quotes; lines of comment begin with {})",
                start(fields, b','),
                COMMENTS.join(" or ")
            );
        };
        let (at, mut width) = (rows[0], *width);
        let mut notes = Vec::new();
        let is_units = |fields: &[String]| {
            let there = fields
                .iter()
                .enumerate()
                .filter(|(k, field)| !texts.contains(k) && !field.is_empty());
            let (known, unknown): (Vec<_>, Vec<_>) =
                there.partition(|(_, field)| super::unit::is_unit(field));
            fields.len() <= width && known.len() > unknown.len()
        };
        let units = (at > 1 && is_units(&lines[at - 1].1)).then(|| &lines[at - 1]);
        let head = at.checked_sub(1 + usize::from(units.is_some())).map(|head| &lines[head]);
        let mut names = match head {
            Some((line, fields, values)) if fields.len() > 1 || width == 1 => {
                let names: Vec<String> =
                    fields.iter().rev().skip_while(|name| name.is_empty()).cloned().collect();
                let names: Vec<String> = names.into_iter().rev().collect();
                ensure!(
                    values.iter().filter(|value| value.is_there()).count() <= values.len() / 2,
                    "line {line}, \"{}\", is neither a row of numbers nor a header (allowed: names above the rows)",
                    start(fields, separator.0)
                );
                // A last column that is empty in every row comes from separators at the ends of the lines.
                let is_empty = |k: usize| rows.iter().all(|row| lines[*row].1[k].is_empty());
                while width > names.len() && is_empty(width - 1) && fields.len() < width {
                    width -= 1;
                }
                ensure!(
                    names.len() <= width && width <= fields.len().max(names.len()),
                    "the header, line {line}, has {} names, but the rows have {width} fields (allowed: as many; decimal commas need another \
                     separator than commas, or quotes)",
                    names.len()
                );
                let passed = at - 1 - usize::from(units.is_some());
                if passed > 0 {
                    notes.push(format!("the {passed} lines above its header are not read"));
                }
                names
            }
            _ if at > 0 => {
                notes.push(format!("the {at} lines above its first row are not read"));
                Vec::new()
            }
            _ if comment.len() == width => comment.clone(),
            _ => Vec::new(),
        };
        if names.is_empty() && texts.contains(&0) {
            let kinds: BTreeSet<&str> = rows.iter().map(|row| lines[*row].1[0].as_str()).collect();
            ensure!(
                kinds.len() < 2,
                "the lines are records of several kinds, such as {} (allowed: rows of one kind, or names above them)",
                kinds.iter().take(2).copied().collect::<Vec<_>>().join(" and ")
            );
        }
        let units = units.filter(|_| !names.is_empty());
        if let Some((line, ..)) = units {
            notes.push(format!("line {line} was taken for a row of units"));
        }
        if separator.0 != b',' {
            notes.push(format!("the columns are separated by {}", separator.1));
        }
        names.truncate(width);
        let mut header = Header::from_names(names, units.map(|(_, fields, _)| fields));
        header.widen(width);
        let row = &lines[at];
        let example = |k: &usize| {
            format!("{} (\"{}\")", header.names[*k], row.1[*k].chars().take(40).collect::<String>())
        };
        let examples: Vec<String> = texts.iter().map(example).collect();
        let mut shown = String::new();
        if !texts.is_empty() {
            shown = format!("; of text, as line {} shows: {}", row.0, examples.join(", "));
            let names: Vec<&str> = texts.iter().map(|k| header.names[*k].as_str()).collect();
            notes.push(format!("columns of text are skipped: {}", names.join(", ")));
        }
        Ok(Layout { separator: separator.0, header, above: at, notes, texts: shown })
    }

    /// Reads the columns at the positions `places`. If `times` is true, the first of them is the time and may hold dates
    /// and clock times. `true` and `false` are allowed where `booleans` is true. NaN marks missing values.
    ///
    /// # Errors
    /// If a field is not a number, or has two possible meanings; the error names the lines.
    pub fn read(
        &self,
        path: &Path,
        places: &[usize],
        times: bool,
        booleans: &[bool],
        done: &mut dyn FnMut(String),
    ) -> Result<Found> {
        let mut end = input::open(path)?;
        let size = end.seek(SeekFrom::End(-1))? + 1;
        let mut last = [0];
        end.read_exact(&mut last)?;
        let mut lines = Lines::open(path, self.separator)?;
        let mut columns = vec![Vec::new(); places.len()];
        let (mut stamps, mut decimal) = (Times::default(), None);
        let (mut faults, mut count, width) = (Vec::new(), 0_usize, self.header.names.len());
        let mut fault = |words: String| {
            count += 1;
            if count <= NAMED {
                faults.push(words);
            }
        };
        while lines.next()? {
            if lines.count <= self.above {
                continue;
            }
            let (line, fields) = (lines.number(), lines.fields());
            if fields.len() < width
                && lines.reader.position().byte() == size
                && !last[0].is_ascii_whitespace()
            {
                done(format!("the last line, {line}, is not complete and was left out"));
                break;
            }
            if fields.len() < width || fields[width..].iter().any(|field| !field.is_empty()) {
                fault(format!(
                    "line {line}: {} fields, where the others have {width}",
                    fields.len()
                ));
                continue;
            }
            budget::reading(columns.first().map_or(0, Vec::len) + 1, places.len(), size)?;
            for (k, &place) in places.iter().enumerate() {
                let (is_time, field) = (times && k == 0, &*fields[place]);
                let begins = columns[k].is_empty();
                let parsed = match Value::parse(field, self.separator, &mut decimal) {
                    Value::Number(number) if !is_time || stamps.is_empty() => Ok(number),
                    Value::Missing => Ok(f64::NAN),
                    Value::Time(moment) if is_time && (begins || !stamps.is_empty()) => {
                        stamps.seconds(moment, field).map_err(Unreadable::from)
                    }
                    Value::Time(_) if is_time => Err(Unreadable::TimeAmongNumbers),
                    Value::Other if booleans[k] => truth(field),
                    Value::Ambiguous(reason) => Err(reason),
                    _ => Err(Unreadable::Number),
                };
                columns[k].push(parsed.unwrap_or_else(|reason| {
                    let field: String = field.chars().take(40).collect();
                    fault(format!(
                        "line {line}, column {}: \"{field}\" {reason}",
                        self.header.names[place]
                    ));
                    f64::NAN
                }));
            }
        }
        if count > 0 {
            let more = count.saturating_sub(NAMED);
            let more = if more > 0 { format!("; and {more} more") } else { String::new() };
            bail!(
                "{}{more} (allowed: finite numbers with decimal point or comma; nothing, NaN or NA where a value is missing; in the \
                 column of the time dates as 2026-01-31T12:00:00.020 or 31.01.2026 12:00:00.020 and clock times as 12:00:00.020)",
                faults.join("; ")
            );
        }
        Ok(Found { columns, origin: stamps.origin() })
    }
}
