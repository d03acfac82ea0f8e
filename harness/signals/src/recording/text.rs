//! Numbers in columns of text: any separator (semicolon, tab, comma, blanks), decimal points or commas, lines
//! of comment, a row of units, dates as time. What a file has is seen from its first lines.

use std::fs::File;
use std::io::{BufRead, BufReader, Read as _};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use chrono::{DateTime, NaiveDateTime};
use files::{budget, input};

use super::{Found, Header};

/// Lines from which separator and header are seen.
const SAMPLE: usize = 200;
/// Longest line, bytes.
const LONGEST_LINE: u64 = 1 << 20;
/// Faults that are named before the rest is only counted.
const NAMED: usize = 5;
/// Beginnings of lines of comment.
const COMMENTS: [&str; 3] = ["#", "%", "//"];

/// Separator between two fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Separator {
    Char(char),
    Blanks,
}

/// In the order in which they are preferred.
const SEPARATORS: [Separator; 4] =
    [Separator::Char(';'), Separator::Char('\t'), Separator::Char(','), Separator::Blanks];

impl Separator {
    /// The fields of a line, without blanks and quotes around them; whether one was quoted.
    fn split<'a>(self, line: &'a str, fields: &mut Vec<(&'a str, bool)>) {
        fields.clear();
        match self {
            Separator::Blanks => fields.extend(line.split_whitespace().map(|f| (f, false))),
            Separator::Char(c) if !line.contains('"') => {
                fields.extend(line.split(c).map(|field| (field.trim(), false)));
            }
            Separator::Char(c) => {
                let (mut from, mut quoted) = (0, false);
                let mut add = |field: &'a str| {
                    let field = field.trim();
                    let inner = field.strip_prefix('"').and_then(|f| f.strip_suffix('"'));
                    fields.push((inner.unwrap_or(field).trim(), inner.is_some()));
                };
                for (at, byte) in line.char_indices() {
                    quoted ^= byte == '"';
                    if byte == c && !quoted {
                        add(&line[from..at]);
                        from = at + c.len_utf8();
                    }
                }
                add(&line[from..]);
            }
        }
    }

    fn name(self) -> &'static str {
        match self {
            Separator::Char(';') => "semicolons",
            Separator::Char('\t') => "tabs",
            Separator::Char(_) => "commas",
            Separator::Blanks => "blanks",
        }
    }
}

/// Value of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Value {
    Number(f64),
    /// Nanoseconds since 1970.
    Date(i64),
    Missing,
    Other,
}

/// A number with a decimal point, or with a decimal comma if `comma`.
fn number(field: &str, comma: bool) -> Option<f64> {
    let value = match field.split_once(',') {
        None => field.parse().ok()?,
        Some((whole, rest)) => {
            let digits = rest.starts_with(|c: char| c.is_ascii_digit());
            if !comma || !digits || rest.contains([',', '.']) || whole.contains('.') {
                return None;
            }
            format!("{whole}.{rest}").parse().ok()?
        }
    };
    f64::is_finite(value).then_some(value)
}

/// Nanoseconds since 1970 of a date and time by ISO 8601, in UTC unless it says otherwise.
fn date(field: &str) -> Option<i64> {
    if field.len() < 16 || field.as_bytes()[4] != b'-' {
        return None;
    }
    let zoned = || DateTime::parse_from_rfc3339(field).ok()?.timestamp_nanos_opt();
    let plain =
        |form| NaiveDateTime::parse_from_str(field, form).ok()?.and_utc().timestamp_nanos_opt();
    zoned().or_else(|| plain("%Y-%m-%dT%H:%M:%S%.f")).or_else(|| plain("%Y-%m-%d %H:%M:%S%.f"))
}

/// Returns true for a field that marks a missing value.
fn missing(field: &str) -> bool {
    let words = ["", "nan", "na", "n/a", "null", "none", "-"];
    field.len() < 5 && words.iter().any(|word| field.eq_ignore_ascii_case(word))
}

fn value((field, quoted): (&str, bool), separator: Separator) -> Value {
    let comma = quoted || separator != Separator::Char(',');
    match number(field, comma) {
        Some(number) => Value::Number(number),
        None if missing(field) => Value::Missing,
        None => date(field).map_or(Value::Other, Value::Date),
    }
}

/// Returns true if a line holds only values, and at least one that is not missing.
fn is_data(fields: &[(&str, bool)], separator: Separator) -> bool {
    let mut values = fields.iter().map(|field| value(*field, separator));
    let some = values.clone().any(|v| matches!(v, Value::Number(_) | Value::Date(_)));
    some && values.all(|v| v != Value::Other)
}

/// The lines of a file, without comments and empty ones.
struct Lines {
    reader: BufReader<File>,
    bytes: Vec<u8>,
    /// Number of the last line, from 1.
    number: usize,
    /// That line has an end.
    ended: bool,
    /// The last comment, without its sign.
    comment: Option<String>,
}

impl Lines {
    fn open(path: &Path) -> Result<Self> {
        let file = input::open(path).context("it cannot be opened")?;
        Ok(Lines {
            reader: BufReader::with_capacity(1 << 16, file),
            bytes: Vec::new(),
            number: 0,
            ended: true,
            comment: None,
        })
    }

    /// The next line in `text`; `false` at the end.
    fn next(&mut self, text: &mut String) -> Result<bool> {
        loop {
            self.bytes.clear();
            let read = (&mut self.reader).take(LONGEST_LINE).read_until(b'\n', &mut self.bytes)?;
            self.number += 1;
            if read == 0 {
                return Ok(false);
            }
            self.ended = self.bytes.ends_with(b"\n");
            let line = self.number;
            ensure!(
                (read as u64) < LONGEST_LINE,
                "line {line} is longer than {LONGEST_LINE} bytes: it is no text"
            );
            ensure!(
                line > 1
                    || !(self.bytes.starts_with(&[0xff, 0xfe])
                        || self.bytes.starts_with(&[0xfe, 0xff])),
                "it is UTF-16; save it as UTF-8"
            );
            ensure!(!self.bytes.contains(&0), "line {line} has a byte 0: it is no text");
            text.clear();
            match std::str::from_utf8(&self.bytes) {
                Ok(valid) => text.push_str(valid),
                // names in an old code page: ° and µ become �
                Err(_) => text.push_str(&String::from_utf8_lossy(&self.bytes)),
            }
            if line == 1 && text.starts_with('\u{feff}') {
                text.drain(..'\u{feff}'.len_utf8());
            }
            text.truncate(text.trim_end_matches(['\r', '\n']).len());
            let trimmed = text.trim_start();
            match COMMENTS.iter().find_map(|sign| trimmed.strip_prefix(sign)) {
                Some(comment) => {
                    self.comment = Some(comment.trim_start_matches(['#', '%', '/']).trim().into());
                }
                None if trimmed.is_empty() => {}
                None => return Ok(true),
            }
        }
    }
}

/// Layout of a file, detected in its first lines.
pub(super) struct Layout {
    separator: Separator,
    /// Names and units of its columns.
    pub header: Header,
    /// First line of data, counted from 1.
    first: usize,
    /// Notes on the detected layout.
    pub notes: Vec<String>,
}

impl Layout {
    /// Detects the layout of a file.
    pub fn of(path: &Path) -> Result<Self> {
        let mut lines = Lines::open(path)?;
        let (mut sample, mut text) = (Vec::new(), String::new());
        // the comment that stands before the first line
        let mut comment = None;
        while sample.len() < SAMPLE && lines.next(&mut text)? {
            if sample.is_empty() {
                comment = lines.comment.clone();
            }
            sample.push((lines.number, text.clone()));
        }
        ensure!(!sample.is_empty(), "it is empty");
        // the separator by which most lines are values, at least two in each
        let mut fields = Vec::new();
        let mut best = (0, SEPARATORS[2], 0);
        // a table of times alone has one column
        for (least, separators) in [(2, &SEPARATORS[..]), (1, &SEPARATORS[2..3])] {
            for &separator in separators {
                let mut widths: Vec<usize> = Vec::new();
                for (_, line) in &sample {
                    separator.split(line, &mut fields);
                    if fields.len() >= least && is_data(&fields, separator) {
                        widths.push(fields.len());
                    }
                }
                let count = |width: usize| widths.iter().filter(|w| **w == width).count();
                let width = widths.iter().copied().max_by_key(|width| count(*width)).unwrap_or(0);
                if count(width) > best.0 {
                    best = (count(width), separator, width);
                }
            }
            if best.0 > 0 {
                break;
            }
        }
        let (found, separator, width) = best;
        if found == 0 {
            let (line, text) = &sample[sample.len() - 1];
            bail!(
                "line {line}, \"{}\", is no row of numbers (allowed: numbers with decimal point or comma, separated by \
                 semicolons, tabs, commas or blanks; decimal commas need another separator, or quotes; lines of \
                 comment begin with {})",
                text.chars().take(60).collect::<String>(),
                COMMENTS.join(" or ")
            );
        }
        let is_row = |line: &str| {
            let mut fields = Vec::new();
            separator.split(line, &mut fields);
            fields.len() == width && is_data(&fields, separator)
        };
        let at = sample.iter().position(|(_, line)| is_row(line)).unwrap_or(0);
        let first = sample[at].0;
        // the header: the first line above with as many fields, or one less where rows end in a separator
        let texts = |line: &str| -> Vec<String> {
            let mut fields = Vec::new();
            separator.split(line, &mut fields);
            fields.iter().map(|(field, _)| field.to_string()).collect()
        };
        let fits = |line: &str| {
            let count = texts(line).len();
            count == width || count + 1 == width
        };
        let mut notes = Vec::new();
        let head = sample[..at].iter().position(|(_, line)| fits(line));
        let (names, units) = match head {
            Some(head) => {
                let row = sample[head + 1..at].iter().rev().find(|(_, line)| fits(line));
                if head > 0 {
                    notes.push(format!("the {head} lines above its header were passed over"));
                }
                if let Some((line, _)) = row {
                    notes.push(format!("line {line} was taken for a row of units"));
                }
                (texts(&sample[head].1), row.map(|(_, line)| texts(line)))
            }
            None => {
                if let Some((line, text)) = at.checked_sub(1).map(|above| &sample[above]) {
                    let count = texts(text).len();
                    ensure!(
                        count < 2,
                        "its header, line {line}, has {count} fields, its rows have {width} (decimal commas need \
                         another separator than commas, or quotes)"
                    );
                }
                let comment = comment.map(|comment| texts(&comment)).filter(|c| c.len() == width);
                (comment.unwrap_or_default(), None)
            }
        };
        if separator != Separator::Char(',') {
            notes.push(format!("its columns are separated by {}", separator.name()));
        }
        let mut header = Header::of(names, units);
        header.widen(width);
        Ok(Layout { separator, header, first, notes })
    }

    /// Reads the columns at these places, that of the time first, in which dates are allowed; NaN where a value is
    /// missing.
    pub fn read(
        &self,
        path: &Path,
        places: &[usize],
        done: &mut dyn FnMut(String),
    ) -> Result<Found> {
        let mut lines = Lines::open(path)?;
        let size = path.metadata()?.len();
        let mut columns = vec![Vec::new(); places.len()];
        let mut text = String::new();
        let time = places[0];
        let (mut origin, mut faults, mut count) = (None, Vec::new(), 0_usize);
        let mut fault = |words: String| {
            count += 1;
            if count <= NAMED {
                faults.push(words);
            }
        };
        let width = self.header.names.len();
        while lines.next(&mut text)? {
            let line = lines.number;
            if line < self.first {
                continue;
            }
            let mut fields = Vec::with_capacity(width + 1);
            self.separator.split(&text, &mut fields);
            let closed = fields.len() == width + 1 && fields[width].0.is_empty();
            if fields.len() < width && !lines.ended {
                done(format!("its last line, {line}, is not complete and was left out"));
                break;
            }
            if fields.len() != width && !closed {
                fault(format!(
                    "line {line}: {} fields, where the others have {width}",
                    fields.len()
                ));
                continue;
            }
            budget::reading(columns[0].len() + 1, places.len(), size)?;
            for (column, &place) in columns.iter_mut().zip(places) {
                let parsed = match value(fields[place], self.separator) {
                    Value::Number(number) if place != time || origin.is_none() => number,
                    Value::Missing => f64::NAN,
                    Value::Date(at) if place == time && (origin.is_some() || column.is_empty()) => {
                        (i128::from(at) - i128::from(*origin.get_or_insert(at))) as f64 * 1e-9
                    }
                    _ => {
                        fault(format!(
                            "line {line}, column {}: \"{}\" is not a number",
                            self.header.names[place],
                            fields[place].0.chars().take(40).collect::<String>()
                        ));
                        f64::NAN
                    }
                };
                column.push(parsed);
            }
        }
        if count > 0 {
            let more = match count.saturating_sub(NAMED) {
                0 => String::new(),
                more => format!("; and {more} more"),
            };
            bail!(
                "{}{more} (allowed: finite numbers with decimal point or comma; nothing, NaN or NA where a value is \
                 missing; in the column of the time dates as 2026-01-31T12:00:00.020)",
                faults.join("; ")
            );
        }
        let origin = origin.map(|at| DateTime::from_timestamp_nanos(at).to_rfc3339());
        let seconds = origin.is_some();
        Ok(Found { columns, origin, seconds })
    }
}
