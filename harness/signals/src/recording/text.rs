//! Numbers in columns of text: any separator (semicolon, tab, comma, blanks, or that of Excel's `sep=`), decimal points
//! or commas, separators of thousands, lines of comment, a row of units, dates or clock times as time. The first lines
//! of a file show its layout. Columns of text are skipped.

use std::fs::File;
use std::io::{BufRead, BufReader, Read as _};
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use files::{budget, input};

use super::Header;
use super::number::Style;
use super::time::{Moment, Times, moment};
use crate::parquet_file::Found;

/// Lines from which separator and header are seen.
const SAMPLE: usize = 200;
/// Longest line, bytes.
const LONGEST_LINE: u64 = 1 << 20;
/// Faults that are named before the rest is only counted.
const NAMED: usize = 5;
/// Names of a last column that rows may leave out.
const COMMENT_COLUMNS: [&str; 4] = ["comment", "comments", "note", "notes"];
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
        let is_separator = |c: char| match self {
            Separator::Char(separator) => c == separator,
            Separator::Blanks => c.is_whitespace(),
        };
        if line.contains('"') {
            let mut quoted = false;
            let parts = line.split(|c| {
                quoted ^= c == '"';
                is_separator(c) && !quoted
            });
            fields.extend(parts.map(|field| {
                let field = field.trim();
                let inner = field.strip_prefix('"').and_then(|f| f.strip_suffix('"'));
                (inner.unwrap_or(field).trim(), inner.is_some())
            }));
        } else {
            fields.extend(line.split(is_separator).map(|field| (field.trim(), false)));
        }
        match self {
            Separator::Blanks => fields.retain(|(field, quoted)| *quoted || !field.is_empty()),
            Separator::Char(_) => {
                if let Some((stamp, rest)) = fields.first().and_then(|(field, _)| stamped(field)) {
                    fields.splice(..1, [(stamp, false), (rest, false)]);
                }
            }
        }
    }

    fn name(self) -> &'static str {
        match self {
            Separator::Char(';') => "semicolons",
            Separator::Char('\t') => "tabs",
            Separator::Char(',') => "commas",
            Separator::Char(_) => "the sign of its line sep=",
            Separator::Blanks => "blanks",
        }
    }
}

/// Value of a field.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    Number(f64),
    Time(Moment),
    Missing,
    /// A number or a time that can be read in two ways, or in none; the reason.
    Ambiguous(String),
    Other,
}

impl Value {
    /// Returns true for a number or a time.
    fn is_there(&self) -> bool {
        !matches!(self, Value::Missing | Value::Other)
    }
}

/// Divides a field into the date or clock time that a terminal program puts before each line, and the rest:
/// `12:00:00.020 -> 5`, `[12:00:00.020] 5`, `12:00:00.020 5`.
fn stamped(field: &str) -> Option<(&str, &str)> {
    if !field.contains(':') || matches!(moment(field), Ok(Some(_))) {
        return None;
    }
    let bracketed = field.strip_prefix('[').and_then(|field| field.split_once(']'));
    let (stamp, rest) =
        bracketed.or_else(|| field.split_once('>')).or_else(|| field.rsplit_once(' '))?;
    // 12:00:00 CET
    if bracketed.is_none() && rest.len() < 6 && rest.chars().all(|c| c.is_ascii_uppercase()) {
        return None;
    }
    let (stamp, rest) = (stamp.trim_end_matches([' ', '-']), rest.trim());
    (!rest.is_empty() && matches!(moment(stamp), Ok(Some(_)))).then_some((stamp, rest))
}

/// Returns true for a field that marks a missing value, or what C's library and spreadsheets print for NaN.
fn missing(field: &str) -> bool {
    const WORDS: [&str; 17] = [
        "",
        "nan",
        "na",
        "n/a",
        "#n/a",
        "null",
        "none",
        "-",
        "--",
        "nat",
        "-nan",
        "nan(ind)",
        "-nan(ind)",
        "1.#qnan",
        "-1.#ind",
        "#nv",
        "#div/0!",
    ];
    field.len() < 10 && WORDS.iter().any(|word| field.eq_ignore_ascii_case(word))
}

/// Value of a field; `style` is how its column writes numbers so far.
fn value((field, quoted): (&str, bool), separator: Separator, style: &mut Style) -> Value {
    let comma = match separator {
        Separator::Char(',') if !quoted => super::number::Comma::Separates,
        Separator::Char(',') => super::number::Comma::Either,
        _ => super::number::Comma::Decimal,
    };
    match style.number(field, comma) {
        Ok(Some(number)) => Value::Number(number),
        Ok(None) if missing(field) => Value::Missing,
        Ok(None) => match moment(field) {
            Ok(Some(moment)) => Value::Time(moment),
            Ok(None) => Value::Other,
            Err(reason) => Value::Ambiguous(reason),
        },
        Err(reason) => Value::Ambiguous(reason),
    }
}

/// The number of a Boolean.
fn truth(field: &str) -> Result<f64, String> {
    match field.to_ascii_lowercase().as_str() {
        "true" => Ok(1.0),
        "false" => Ok(0.0),
        _ => Err("is not a Boolean (allowed: true, false, 1, 0)".into()),
    }
}

/// Values of the fields of a line in the sample.
fn values(line: &str, separator: Separator) -> Vec<Value> {
    let mut fields = Vec::new();
    separator.split(line, &mut fields);
    fields.into_iter().map(|field| value(field, separator, &mut Style::default())).collect()
}

/// Returns true if the first fields of rows are names of rows, which have no name in the header: quoted ones, or numbers
/// from 1 on, as R writes them.
fn are_row_names(rows: &[(usize, String)], separator: Separator) -> bool {
    let mut fields = Vec::new();
    rows.iter().enumerate().all(|(k, (_, row))| {
        separator.split(row, &mut fields);
        fields.first().is_some_and(|(name, quoted)| *quoted || *name == (k + 1).to_string())
    })
}

/// The separator of a line `sep=;`, with which Excel begins a file.
fn excels(line: &str) -> Option<Separator> {
    let line = line.trim_matches(['"', ' ']);
    let (name, sign) = line.split_at_checked(4)?;
    let mut signs = sign.chars();
    let sign =
        signs.next().filter(|_| name.eq_ignore_ascii_case("sep=") && signs.next().is_none())?;
    Some(Separator::Char(sign))
}

/// A way to divide the lines of a sample into columns.
struct Division {
    separator: Separator,
    width: usize,
    /// The columns of text.
    texts: Vec<usize>,
    /// True if most rows have text in a column.
    is_wordy: bool,
    /// The columns with a value in most rows; if there are none, all but those of text.
    dense: Vec<usize>,
    /// Lines whose columns hold values, but for those of text.
    rows: usize,
}

impl Division {
    /// Divides a sample; rows have at least `least` fields.
    fn of(sample: &[(usize, String)], separator: Separator, least: usize) -> Division {
        let lines: Vec<Vec<Value>> =
            sample.iter().map(|(_, line)| values(line, separator)).collect();
        // lines with a value somewhere are rows, or a row of units with a 1
        let rows = || lines.iter().filter(|l| l.len() >= least && l.iter().any(Value::is_there));
        let mut widths = std::collections::BTreeMap::new();
        rows().for_each(|line| *widths.entry(line.len()).or_insert(0_usize) += 1);
        let width = widths.iter().max_by_key(|(_, count)| **count).map_or(0, |(width, _)| *width);
        let count = widths.get(&width).copied().unwrap_or(0);
        let of = |k: usize, wanted: fn(&Value) -> bool| {
            rows().filter(|line| line.len() == width && wanted(&line[k])).count()
        };
        let others = |k| of(k, |value| *value == Value::Other);
        let there = |k| of(k, Value::is_there);
        let is_wordy = (0..width).any(|k| 2 * others(k) > count);
        // words in some rows only, where the others have nothing, are text as well
        let is_text = |k: &usize| 2 * others(*k) > count || others(*k) > 0 && there(*k) == 0;
        let (texts, numbers): (Vec<_>, Vec<_>) = (0..width).partition(is_text);
        let mut dense: Vec<usize> =
            numbers.iter().copied().filter(|k| 2 * there(*k) > count).collect();
        if dense.is_empty() {
            dense = numbers;
        }
        let mut found = Division { separator, width, texts, is_wordy, dense, rows: 0 };
        found.rows = lines.iter().filter(|line| found.is_sound(line)).count();
        found
    }

    fn numbers<'v>(&self, line: &'v [Value]) -> impl Iterator<Item = &'v Value> {
        let texts = self.texts.clone();
        line.iter().enumerate().filter(move |(k, _)| !texts.contains(k)).map(|(_, value)| value)
    }

    /// Returns true if all columns but those of text hold values, and at least one that is not missing.
    fn is_sound(&self, line: &[Value]) -> bool {
        line.len() == self.width
            && self.numbers(line).all(|value| *value != Value::Other)
            && self.numbers(line).any(Value::is_there)
    }

    /// Number of values and of words in the columns that have values in most rows.
    fn count(&self, line: &[Value]) -> (usize, usize) {
        let dense = || self.dense.iter().filter_map(|k| line.get(*k));
        let others = dense().filter(|value| **value == Value::Other).count();
        (dense().filter(|value| value.is_there()).count(), others)
    }

    /// Returns true for a row, even if a few of its values are none; a row of units may have a 1. A field more than the
    /// others have makes no other line of it.
    fn is_row(&self, line: &str) -> bool {
        let line = values(line, self.separator);
        let (there, others) = self.count(&line);
        let first = self.dense.first().and_then(|k| line.get(*k)).is_some_and(Value::is_there);
        let mostly = first && others < there;
        self.is_sound(&line) || [self.width, self.width + 1].contains(&line.len()) && mostly
    }

    /// The fields of a line.
    fn texts(&self, line: &str) -> Vec<String> {
        let mut fields = Vec::new();
        self.separator.split(line, &mut fields);
        fields.iter().map(|(field, _)| field.to_string()).collect()
    }

    /// Returns true for a line that has as many fields as the rows, or one more or less, which is the last of a row, or
    /// the first.
    fn fits(&self, line: &str) -> bool {
        self.width > 1 && self.texts(line).len().abs_diff(self.width) < 2
            || self.width == 1 && self.texts(line).len() == 1
    }

    /// Units of the columns, if a line is a row of units. A label before them says what they are: `unit`, `Y_Unit_Label`.
    fn units(&self, line: &str) -> Option<(Vec<String>, bool)> {
        let mut fields = self.texts(line);
        let labelled = fields.first().is_some_and(|field| field.to_lowercase().contains("unit"));
        if labelled {
            fields[0].clear();
        }
        let there =
            fields.iter().enumerate().filter(|(k, f)| !self.texts.contains(k) && !f.is_empty());
        let (known, unknown): (Vec<_>, Vec<_>) =
            there.partition(|(_, field)| super::unit::is_unit(field));
        (known.len() > unknown.len()).then_some((fields, labelled))
    }

    /// Returns the sample without the separators that end its rows, if they end all rows and the header names no column there.
    /// Where rows are numbered from 1 and the header has a name less, a last column without values is as likely: `None`.
    fn opened(&self, sample: &[(usize, String)]) -> Option<Vec<(usize, String)>> {
        let Separator::Char(sign) = self.separator else { return None };
        let at =
            sample.iter().position(|(_, line)| self.is_row(line)).filter(|_| self.width > 2)?;
        let (above, rows) = sample.split_at(at);
        let fields = |line: &str| self.texts(line).len();
        let is_closed = |line: &str| fields(line) == self.width && line.ends_with(sign);
        let is_numbered = |(k, (_, row)): (usize, &(usize, String))| {
            self.texts(row).first().is_some_and(|first| *first == (k + 1).to_string())
        };
        let mut heads = above.iter().map(|(_, line)| self.texts(line));
        let mut less = heads.clone().filter(|head| head.len() + 1 == self.width).peekable();
        // an empty first name is that of the rows
        let is_one_less = less.peek().is_some()
            && less.all(|head| !head[0].is_empty())
            && rows.iter().enumerate().all(is_numbered);
        let is_named =
            heads.any(|head| head.len() == self.width && !head[self.width - 1].is_empty());
        let are_closed = rows.iter().all(|(_, row)| fields(row) != self.width || is_closed(row));
        (are_closed && !is_named && !is_one_less).then(|| {
            let open = |line: &String| match is_closed(line) {
                true => line[..line.len() - sign.len_utf8()].to_string(),
                false => line.clone(),
            };
            sample.iter().map(|(number, line)| (*number, open(line))).collect()
        })
    }

    /// Fails for a file whose lines are records of several kinds, each with a name and columns of its own.
    fn refuse_kinds(&self, sample: &[(usize, String)], has_header: bool) -> Result<()> {
        if !self.texts.contains(&0) {
            return Ok(());
        }
        let mut kinds = std::collections::BTreeMap::new();
        for (line, text) in sample {
            let values = values(text, self.separator);
            let fields = self.texts(text);
            if fields.len() > 1 && !fields[0].is_empty() && values.iter().any(Value::is_there) {
                let kind = (fields[0].trim_end_matches([',', ';']).to_string(), fields.len());
                kinds.entry(kind).or_insert_with(Vec::new).push(*line);
            }
        }
        kinds.retain(|_, lines| lines.len() > 1);
        let mut kinds: Vec<_> = kinds.into_iter().collect();
        kinds.sort_by_key(|(_, lines)| lines[0]);
        if let [((word, width), lines), .., ((other, rest), more)] = &kinds[..]
            && (!has_header || kinds.iter().any(|((_, fields), _)| fields != width))
        {
            bail!(
                "its lines are records of several kinds: line {} begins with \"{word}\" and has {width} fields. Line {} begins \
                 with \"{other}\" and has {rest} (allowed: rows of one kind). Export one kind, for ArduPilot's logs by \
                 mavlogdump.py --types IMU --format csv",
                lines[0],
                more[0]
            );
        }
        Ok(())
    }
}

/// The lines of a file, without comments and empty ones.
struct Lines {
    reader: BufReader<File>,
    bytes: Vec<u8>,
    /// Number of the last line, from 1.
    number: usize,
    /// True if that line has an end.
    ended: bool,
    /// The last comment, without its sign.
    comment: Option<String>,
    /// The byte that ends a line.
    end: u8,
}

impl Lines {
    fn open(path: &Path) -> Result<Self> {
        let file = input::open(path).context("it cannot be opened")?;
        let mut reader = BufReader::with_capacity(1 << 16, file);
        let start = reader.fill_buf()?;
        // lines that end in CR alone, as of old Macs and some instruments
        let is_old = start.contains(&b'\r') && !start.contains(&b'\n');
        Ok(Lines {
            reader,
            end: if is_old { b'\r' } else { b'\n' },
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
            let read =
                (&mut self.reader).take(LONGEST_LINE).read_until(self.end, &mut self.bytes)?;
            self.number += 1;
            if read == 0 {
                return Ok(false);
            }
            self.ended = self.bytes.ends_with(&[self.end]);
            let line = self.number;
            ensure!(
                (read as u64) < LONGEST_LINE,
                "line {line} is longer than {LONGEST_LINE} bytes: it is not text"
            );
            ensure!(
                line > 1
                    || !(self.bytes.starts_with(&[0xff, 0xfe])
                        || self.bytes.starts_with(&[0xfe, 0xff])),
                "it is UTF-16; save it as UTF-8"
            );
            ensure!(!self.bytes.contains(&0), "line {line} has a byte 0: it is not text");
            let cut = self.bytes.trim_ascii_end();
            ensure!(
                !cut.contains(&b'\r') && !cut.contains(&b'\n'),
                "line {line} has a carriage return within it: some lines of the file end in CR alone, others in LF (allowed: one kind \
                 of line ends)"
            );
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
    /// True if the last column holds comments, which rows may leave out.
    has_comments: bool,
    /// First line of data, counted from 1.
    first: usize,
    /// Notes on the detected layout.
    pub notes: Vec<String>,
    /// Columns of text, for the message that a column is missing.
    pub texts: String,
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
        let told = sample.first().and_then(|(_, line)| excels(line));
        if told.is_some() {
            sample.remove(0);
        }
        ensure!(!sample.is_empty(), "it is empty");
        // the separator by which most lines are values, at least two in each; columns of text count only where no
        // separator does without; a table of times alone has one column
        let of = |separator: &Separator, least| Division::of(&sample, *separator, least);
        let tried = told.as_ref().map_or(&SEPARATORS[..], std::slice::from_ref);
        let best = |divisions: Vec<Division>| {
            let found = divisions.into_iter().filter(|d| d.rows > 0 && d.texts.len() < d.width);
            found.reduce(|best, other| {
                let key = |d: &Division| (!d.is_wordy, d.rows);
                if key(&other) > key(&best) { other } else { best }
            })
        };
        let division = best(tried.iter().map(|separator| of(separator, 2)).collect())
            .or_else(|| best(vec![of(&SEPARATORS[2], 1)]));
        let Some(mut division) = division else {
            let (line, text) = sample.get(1).unwrap_or(&sample[0]);
            bail!(
                "line {line}, \"{}\", is not a row of numbers (allowed: numbers with decimal point or comma, separated by \
                 semicolons, tabs, commas or blanks; decimal commas need another separator, or quotes; lines of \
                 comment begin with {})",
                text.chars().take(60).collect::<String>(),
                COMMENTS.join(" or ")
            );
        };
        if let Some(opened) = division.opened(&sample) {
            sample = opened;
            division = Division::of(&sample, division.separator, 2);
        }
        let (separator, width) = (division.separator, division.width);
        let at = sample.iter().position(|(_, line)| division.is_row(line)).unwrap_or(0);
        let first = sample[at].0;
        let (above, rows) = sample.split_at(at);
        let mut notes = Vec::new();
        // the lines right above the first row that may be its header: names, and units below or above them
        let fitting = above.iter().rev().take_while(|(_, line)| division.fits(line)).count();
        let block = &above[at - fitting..];
        division.refuse_kinds(&sample, fitting > 0)?;
        let is_cut = |line: &str| {
            let line = values(line, separator);
            line.len() < width && line.iter().all(|value| *value != Value::Other)
        };
        // without a label it stands right above the rows, and names above it
        let units = (0..block.len()).rev().find_map(|k| {
            let (units, labelled) = division.units(&block[k].1)?;
            (labelled || k > 0 && k + 1 == block.len()).then_some((k, (units, labelled)))
        });
        let (head, units) = match units {
            Some((k, (units, labelled))) => {
                let below = block.len().checked_sub(1).filter(|last| labelled && *last > k);
                (below.or(k.checked_sub(1)), Some((k, units)))
            }
            None => (block.len().checked_sub(1), None),
        };
        let mut has_comments = false;
        let (names, units) = match head.map(|head| &block[head]) {
            // a capture that begins within a line
            Some((line, text)) if at == 1 && is_cut(text) => {
                notes.push(format!("its first line, {line}, is not complete and was left out"));
                (Vec::new(), None)
            }
            Some((line, text)) => {
                let (there, others) = division.count(&values(text, separator));
                ensure!(
                    there <= others,
                    "line {line}, \"{}\", is neither a row of numbers nor a header (allowed: names above the rows)",
                    text.chars().take(60).collect::<String>()
                );
                let mut names = division.texts(text);
                let count = names.len();
                let last = names.last().map(|name| name.to_lowercase()).unwrap_or_default();
                if count > width && last.is_empty() {
                    names.pop();
                } else if count > width && COMMENT_COLUMNS.contains(&last.as_str()) {
                    has_comments = true;
                } else if count < width && are_row_names(rows, separator) {
                    names.insert(0, String::new());
                } else {
                    let closed = division.texts(&rows[0].1).last().is_some_and(String::is_empty);
                    ensure!(
                        count == width || count < width && closed,
                        "its header, line {line}, has {count} names, its rows have {width} fields (allowed: as many, or one more that is \
                         empty; above the rows no other line with separators)"
                    );
                }
                let passed = above.iter().position(|(other, _)| other == line).unwrap_or(0);
                if passed > 0 {
                    notes.push(format!("the {passed} lines above its header were passed over"));
                }
                if let Some((k, _)) = units {
                    notes.push(format!("line {} was taken for a row of units", block[k].0));
                }
                (names, units.map(|(_, units)| units))
            }
            None => {
                if let Some((line, text)) = above.last() {
                    let count = division.texts(text).len();
                    ensure!(
                        count < 2 || at == 1 && is_cut(text),
                        "its header, line {line}, has {count} fields, its rows have {width} (decimal commas need \
                         another separator than commas, or quotes)"
                    );
                    notes.push(match count {
                        0 | 1 => format!("the {at} lines above its first row were passed over"),
                        _ => format!("its first line, {line}, is not complete and was left out"),
                    });
                }
                let comment = comment.map(|comment| division.texts(&comment));
                (comment.filter(|names| names.len() == width).unwrap_or_default(), None)
            }
        };
        if separator != Separator::Char(',') {
            notes.push(format!("its columns are separated by {}", separator.name()));
        }
        let mut header = Header::of(names, units);
        header.widen(width);
        let mut texts = String::new();
        if !division.texts.is_empty() {
            let fields = division.texts(&rows[0].1);
            let example = |k: &usize| {
                let field = fields.get(*k).map_or("", String::as_str);
                format!("{} (\"{}\")", header.names[*k], field.chars().take(40).collect::<String>())
            };
            let examples: Vec<_> = division.texts.iter().map(example).collect();
            texts = format!("; of text, as line {first} shows: {}", examples.join(", "));
            let names: Vec<&str> =
                division.texts.iter().map(|k| header.names[*k].as_str()).collect();
            notes.push(format!("columns of text are skipped: {}", names.join(", ")));
        }
        Ok(Layout { separator, header, has_comments, first, notes, texts })
    }

    /// Reads the columns at these places, that of the time first if the file has `times`: dates and clock times are
    /// allowed there. `true` and `false` are allowed where `booleans` is true. NaN where a value is missing.
    pub fn read(
        &self,
        path: &Path,
        places: &[usize],
        times: bool,
        booleans: &[bool],
        done: &mut dyn FnMut(String),
    ) -> Result<Found> {
        let mut lines = Lines::open(path)?;
        let size = path.metadata()?.len();
        let mut columns = vec![Vec::new(); places.len()];
        let mut styles = vec![Style::default(); places.len()];
        let mut text = String::new();
        let (mut stamps, mut faults, mut count) = (Times::default(), Vec::new(), 0_usize);
        let mut fault = |words: String| {
            count += 1;
            if count <= NAMED {
                faults.push(words);
            }
        };
        let width = self.header.names.len();
        let least = width - usize::from(self.has_comments);
        while lines.next(&mut text)? {
            let line = lines.number;
            if line < self.first {
                continue;
            }
            let mut fields = Vec::with_capacity(width + 1);
            self.separator.split(&text, &mut fields);
            let closed = fields.len() == width + 1 && fields[width].0.is_empty();
            if fields.len() < least && !lines.ended {
                done(format!("its last line, {line}, is not complete and was left out"));
                break;
            }
            if !(least..=width).contains(&fields.len()) && !closed {
                fault(format!(
                    "line {line}: {} fields, where the others have {least}",
                    fields.len()
                ));
                continue;
            }
            fields.resize(fields.len().max(width), ("", false));
            budget::reading(columns.first().map_or(0, Vec::len) + 1, places.len(), size)?;
            for (k, &place) in places.iter().enumerate() {
                let is_time = times && k == 0;
                let begins = columns[k].is_empty();
                let parsed = match value(fields[place], self.separator, &mut styles[k]) {
                    Value::Number(number) if !is_time || stamps.is_empty() => Ok(number),
                    Value::Missing => Ok(f64::NAN),
                    Value::Time(moment) if is_time && (begins || !stamps.is_empty()) => {
                        stamps.seconds(moment, fields[place].0)
                    }
                    Value::Time(_) if is_time => {
                        Err("is a date or a clock time, where the lines above have numbers".into())
                    }
                    Value::Other if booleans[k] => truth(fields[place].0),
                    Value::Ambiguous(reason) => Err(reason),
                    _ => Err("is not a number".into()),
                };
                columns[k].push(parsed.unwrap_or_else(|reason| {
                    fault(format!(
                        "line {line}, column {}: \"{}\" {reason}",
                        self.header.names[place],
                        fields[place].0.chars().take(40).collect::<String>()
                    ));
                    f64::NAN
                }));
            }
        }
        if count > 0 {
            let more = match count.saturating_sub(NAMED) {
                0 => String::new(),
                more => format!("; and {more} more"),
            };
            bail!(
                "{}{more} (allowed: finite numbers with decimal point or comma; nothing, NaN or NA where a value is \
                 missing; in the column of the time dates as 2026-01-31T12:00:00.020 or 31.01.2026 12:00:00.020 and clock \
                 times as 12:00:00.020)",
                faults.join("; ")
            );
        }
        let origin = stamps.origin();
        Ok(Found { columns, origin })
    }
}
