//! Recordings: signals in SI units from files that others wrote. The name's ending separates
//! text in columns, Parquet and MATLAB's `.mat`. [`Columns`], a row of units or units in the names of the columns
//! (`gyro_z [deg/s]`) give the signal and the unit of each column.
//!
//! The rows of a recording are those with a value of one signal, its rows' signal. Where another one has none,
//! because it is slower or was lost, it is completed: held, or joined by lines. Nothing is resampled. Times that are
//! printed to few digits are put back onto their even grid ([`stamps`]).

mod columns;
mod even;
mod matlab;
mod number;
mod stamps;
mod text;
mod unit;

use std::io::Read as _;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};
use files::input;

pub use self::columns::{Column, Columns, SIGNALS, quantity};
pub use self::even::{even, even_with_gaps};
pub use self::unit::{Quantity, conversion};
use crate::parquet_file;
use crate::table::Table;

/// Names and units of a file's columns.
struct Header {
    names: Vec<String>,
    /// Units in the file; `None` for a column without one.
    units: Vec<Option<String>>,
}

impl Header {
    /// From names, which may end in a unit in brackets, and a row of units.
    fn of(names: Vec<String>, row: Option<Vec<String>>) -> Header {
        let mut header = Header { names: Vec::new(), units: Vec::new() };
        for (k, name) in names.into_iter().enumerate() {
            let (bare, unit) = bracketed(&name).unwrap_or((&name, ""));
            let below = row.as_ref().and_then(|row| row.get(k)).map(|unit| unit.as_str());
            let unit = below.unwrap_or(unit).trim_matches(['[', ']', '(', ')', ' ']);
            header.units.push((!unit.is_empty()).then(|| unit.to_string()));
            header.names.push(bare.to_string());
        }
        header
    }

    /// Columns without a name are called by their numbers.
    fn widen(&mut self, width: usize) {
        for k in self.names.len()..width {
            self.names.push(format!("#{}", k + 1));
            self.units.push(None);
        }
    }

    /// Position of a column.
    fn place(&self, column: &str) -> Result<usize> {
        let number = column.strip_prefix('#').and_then(|number| number.parse::<usize>().ok());
        if let Some(place) = number.filter(|n| (1..=self.names.len()).contains(n)) {
            return Ok(place - 1);
        }
        let bare = bracketed(column).map_or(column, |(name, _)| name);
        let found: Vec<usize> = (0..self.names.len()).filter(|k| self.names[*k] == bare).collect();
        match found[..] {
            [place] => Ok(place),
            [] => Err(anyhow!("no column {column}")),
            _ => Err(anyhow!("more than one column {column} (#{} and others)", found[0] + 1)),
        }
    }
}

/// Name and unit of `torque [mNm]` or `torque (mNm)`.
fn bracketed(name: &str) -> Option<(&str, &str)> {
    let (open, close) = match name.chars().last()? {
        ']' => ('[', ']'),
        ')' => ('(', ')'),
        _ => return None,
    };
    let (bare, unit) = name.rsplit_once(open)?;
    let (bare, unit) = (bare.trim(), unit.trim_end_matches(close).trim());
    // `data(3)` of a .mat file is a name
    let number = unit.chars().all(|c| c.is_ascii_digit());
    (!bare.is_empty() && !number).then_some((bare, unit))
}

/// The columns that were read; NaN where a value is missing.
struct Found {
    columns: Vec<Vec<f64>>,
    /// The first row's date, if time is dates: time counts from there.
    origin: Option<String>,
    /// True if times are in s whatever unit is stated: dates, and types with a unit.
    seconds: bool,
}

/// Treatment of a signal in rows without a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// The last value, as of a command that is held.
    Held,
    /// A line from the last value to the next.
    Line,
    /// Nothing: it stays NaN.
    Missing,
}

/// A signal that is wanted of a recording.
#[derive(Clone, Copy, Debug)]
pub struct Signal<'a> {
    /// One of [`SIGNALS`], or a variable of an FMU.
    pub name: &'a str,
    /// It must be there.
    pub required: bool,
    /// Treatment of rows without a value.
    pub between: Between,
    /// The unit in which its values are wanted, and in which they are where the file names none; `None`: SI.
    pub unit: Option<&'a str>,
}

/// Signals to read in addition to time.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// The first is the rows' signal, unless it may be missing ([`Between::Missing`]).
    pub signals: &'a [Signal<'a>],
    /// Columns of the signals.
    pub columns: &'a Columns,
}

/// Times from here on, s, are counted from the recording's beginning: seconds since 1970, say.
const LATE: f64 = 1e6;
/// Latest time whose unit may be unstated, s since 1970: the year 5138. Milliseconds since 1970 are later.
const LATEST: f64 = 1e11;
/// Largest magnitude of a value in SI: its fourth power, which statistics take, is finite in sums over all rows.
const LARGEST: f64 = 1e60;
/// Rows that a slow signal may miss in succession, in units of its usual spacing, and at least [`SHORT`].
const LOST: f64 = 10.0;
/// Spacing, in units of the usual one, from which on a value in between must have been lost.
const LATE_BY: f64 = 1.5;
/// Time over which any signal may be completed, s.
const SHORT: f64 = 0.25;

/// Names of a file's columns, units in brackets left out.
pub fn names(path: &Path) -> Result<Vec<String>> {
    let file = File::open(path).with_context(|| format!("{} cannot be used", path.display()))?;
    Ok(file.header().names.clone())
}

/// Reads a recording: `time` (s) and the signals that are there, in SI units. `done` hears what was done to it.
///
/// # Errors
/// If the file cannot be read so. The error lists all faults of its columns.
pub fn read(path: &Path, wanted: &Wanted, done: &mut dyn FnMut(String)) -> Result<Table> {
    let name = path.display().to_string();
    read_as(path, wanted, &mut |words| done(format!("{name}: {words}")))
        .with_context(|| format!("{name} cannot be used"))
}

/// The kinds of files.
enum File {
    Text(text::Layout),
    Parquet(Header),
    Matlab(Header),
}

impl File {
    fn open(path: &Path) -> Result<File> {
        let ending = path.extension().and_then(|e| e.to_str()).map(str::to_lowercase);
        if !matches!(ending.as_deref(), Some("parquet" | "mat")) {
            refuse_binary(path)?;
        }
        match ending.as_deref() {
            Some("csv" | "txt" | "tsv" | "dat" | "asc" | "log" | "lvm") => {
                Ok(File::Text(text::Layout::of(path)?))
            }
            Some("parquet") => {
                let header = |names| Header::of(names, None);
                Ok(File::Parquet(header(parquet_file::names(path)?)))
            }
            Some("mat") => Ok(File::Matlab(matlab::header(path)?)),
            _ => bail!(
                "the name must end in .csv, .txt, .tsv, .dat, .asc, .log or .lvm (text in columns), .parquet or .mat"
            ),
        }
    }

    fn header(&self) -> &Header {
        match self {
            File::Text(layout) => &layout.header,
            File::Parquet(header) | File::Matlab(header) => header,
        }
    }
}

/// Fails for files of formats that others call by the ending of a text, with what to do.
fn refuse_binary(path: &Path) -> Result<()> {
    const KNOWN: [(&[u8], &str); 8] = [
        (b"\x1f\x8b", "it is compressed with gzip: unpack it first (gunzip)"),
        (b"\x28\xb5\x2f\xfd", "it is compressed with zstd: unpack it first (unzstd)"),
        (
            b"PK\x03\x04",
            "it is a zip archive, as .xlsx is: save the sheet as CSV UTF-8, or unpack the archive",
        ),
        (b"\xd0\xcf\x11\xe0", "it is an old Excel workbook (.xls): save the sheet as CSV UTF-8"),
        (
            b"SQLite format 3",
            "it is an SQLite database, as a ROS 2 bag is: export its topics as CSV",
        ),
        (b"\x89HDF", "it is HDF5: read it with h5py or pandas, and write CSV or Parquet"),
        (b"TDSm", "it is TDMS: read it with npTDMS, and write CSV or Parquet"),
        (b"PAR1", "it is Parquet: give it the ending .parquet"),
    ];
    let mut start = Vec::new();
    input::open(path).context("it cannot be opened")?.take(16).read_to_end(&mut start)?;
    match KNOWN.iter().find(|(sign, _)| start.starts_with(sign)) {
        Some((_, words)) => bail!("{words}"),
        None => Ok(()),
    }
}

fn read_as(path: &Path, wanted: &Wanted, done: &mut dyn FnMut(String)) -> Result<Table> {
    let file = File::open(path)?;
    let header = file.header();
    // time first, then the signals that are there
    // a table of times alone has no signal
    let rows_signal = wanted.signals.first().map_or("time", |signal| signal.name);
    let time_signal = Signal { name: "time", required: true, between: Between::Line, unit: None };
    let counted = wanted.columns.rate();
    if let Some(rate) = counted {
        let own = header.names.iter().find(|name| *name == "time");
        let own = own
            .cloned()
            .or_else(|| wanted.columns.names("time").then(|| wanted.columns.of("time").name));
        ensure!(
            own.is_none(),
            "--rate {rate} is for files without times, and column {} is this one's (allowed: --rate or times)",
            own.unwrap_or_default()
        );
    }
    let (mut signals, mut places, mut factors) = (Vec::new(), Vec::new(), Vec::new());
    let mut stated = None; // seconds in the unit of the time, if one is stated
    let (mut problems, mut used) = (Vec::new(), Vec::new());
    let of_use = |name: &str| name == "time" || wanted.signals.iter().any(|s| s.name == name);
    let names: Vec<&str> = wanted.signals.iter().map(|signal| signal.name).collect();
    problems.extend(wanted.columns.signals().filter(|name| !of_use(name)).map(|name| {
        format!("--columns {name} is of no use here (allowed: time, {})", names.join(", "))
    }));
    let mut timeless = false;
    let own_time = counted.is_none().then_some(&time_signal);
    for signal in own_time.into_iter().chain(wanted.signals) {
        let column = wanted.columns.of(signal.name);
        let place = match header.place(&column.name) {
            Ok(place) => place,
            Err(_) if !signal.required && !wanted.columns.names(signal.name) => continue,
            Err(error) => {
                timeless |= signal.name == "time";
                problems.push(error.to_string());
                continue;
            }
        };
        let unit = column.unit.clone().or_else(|| header.units[place].clone());
        let factor = match unit.as_deref().map(|unit| factor(signal, unit)) {
            None => 1.0,
            Some(Ok(factor)) => factor,
            Some(Err(error)) => {
                problems.push(format!(
                    "column {}: {error}; --columns {}={}:UNIT says which it is",
                    header.names[place], signal.name, column.name
                ));
                continue;
            }
        };
        if signal.name == "time" && unit.is_some() {
            stated = Some(factor);
        }
        used.push(match &unit {
            Some(unit) => format!("{} = {} in {unit}", signal.name, header.names[place]),
            None if header.names[place] == signal.name => signal.name.to_string(),
            None => format!("{} = {}", signal.name, header.names[place]),
        });
        signals.push(*signal);
        places.push(place);
        factors.push(factor);
    }
    ensure!(
        problems.is_empty(),
        "{} (columns in it: {}{}; --columns SIGNAL=COLUMN:UNIT,... says which is which{})",
        problems.join("; "),
        header.names.join(", "),
        if let File::Text(layout) = &file { &layout.texts } else { "" },
        if timeless { "; --rate HZ takes equally spaced rows without times" } else { "" }
    );
    ensure!(!places.is_empty(), "it has no signal that is wanted");
    let time = header.names[places[0]].as_str();
    let timed = counted.is_none();
    let remedy = format!("--columns time={time}:ms, or :s, :us, :ns, :min, :h, states it");
    let found = match &file {
        File::Text(layout) => {
            layout.notes.iter().cloned().for_each(&mut *done);
            layout.read(path, &places, timed, done)?
        }
        File::Parquet(_) => {
            let time = parquet_file::Time { place: 0, stated, remedy: &remedy };
            let found = parquet_file::read(path, |_| Ok(places.clone()), timed.then_some(time))?;
            Found { columns: found.columns, origin: found.origin, seconds: found.seconds }
        }
        File::Matlab(header) => {
            let unstated = (timed && stated.is_none()).then_some(&remedy);
            matlab::read(path, header, &places, unstated)?
        }
    };
    done(format!("columns used: {}", used.join(", ")));
    let Found { mut columns, origin, seconds } = found;
    for (k, (column, factor)) in columns.iter_mut().zip(&factors).enumerate() {
        if *factor != 1.0 && !(seconds && k == 0) {
            column.iter_mut().for_each(|value| *value *= factor);
        }
    }
    for (signal, column) in signals.iter().zip(&columns) {
        if let Some(row) = column.iter().position(|value| value.abs() > LARGEST) {
            bail!(
                "row {} of its values: {} is {:e} (allowed: magnitudes up to {LARGEST:e})",
                row + 1,
                signal.name,
                column[row]
            );
        }
    }
    if timed
        && stated.is_none()
        && !seconds
        && let Some(late) = columns[0].iter().find(|t| t.abs() > LATEST)
    {
        bail!(
            "column {time} is {late} s, millennia after 1970: it counts ms, us or ns (allowed: up to {LATEST:e} s where no unit is \
             stated): {remedy}"
        );
    }
    if let Some(origin) = origin {
        done(format!("its times are dates: time counts from {origin}"));
    }
    if let Some(rate) = counted {
        let rows = columns[0].len();
        columns.insert(0, (0..rows).map(|k| k as f64 / rate).collect());
        signals.insert(0, time_signal);
        done(format!("it has no times: its rows are taken as {rate} a second (--rate)"));
    }
    if let Some(grid) = stamps::regular(&columns[0]) {
        done(format!(
            "its times are printed to {}: rows {:.6} ms apart have these times, and are taken so",
            stamps::words(grid.quantum),
            1e3 * grid.step
        ));
        columns[0] = grid.time;
    }
    let names = signals.iter().map(|signal| signal.name.to_string()).collect();
    let columns = complete(&signals, columns, rows_signal, done)?;
    Ok(Table::new(names, columns))
}

/// Factor from a unit to SI for a signal.
fn factor(signal: &Signal, unit: &str) -> Result<f64> {
    let Some(own) = signal.unit else {
        let quantity = quantity(signal.name)?;
        return quantity.factor(unit).with_context(|| {
            format!("\"{unit}\" is not a unit of {quantity} (allowed: {})", quantity.units())
        });
    };
    // an FMU that names no unit gives no reason to convert
    let known = if own.is_empty() { Some(1.0) } else { conversion(unit, own) };
    known.with_context(|| format!("\"{unit}\" cannot be converted to {}'s \"{own}\"", signal.name))
}

/// The rows with a value of the rows' signal; the other signals completed there.
fn complete(
    signals: &[Signal],
    mut columns: Vec<Vec<f64>>,
    rows_signal: &str,
    done: &mut dyn FnMut(String),
) -> Result<Vec<Vec<f64>>> {
    let time = &columns[0];
    ensure!(!time.is_empty(), "it has no rows of values");
    if let Some(row) = time.iter().position(|t| t.is_nan()) {
        bail!("row {} of its values has no time", row + 1);
    }
    let origin = if time[0].abs() > LATE { time[0] } else { 0.0 };
    if origin != 0.0 {
        done(format!("time counts from its first row, {origin} s"));
        columns[0].iter_mut().for_each(|t| *t -= origin);
    }
    let complete = |column: &Vec<f64>| column.iter().all(|value| !value.is_nan());
    if columns.iter().all(complete) {
        return Ok(columns);
    }
    let rows = columns[0].len();
    let mut keep = vec![true; rows];
    let (time, rest) = columns.split_first_mut().context("a recording without time")?;
    for (signal, column) in signals[1..].iter().zip(rest) {
        let there: Vec<usize> = (0..rows).filter(|k| !column[*k].is_nan()).collect();
        let name = signal.name;
        ensure!(there.len() > 1, "{name} has values in {} rows (allowed: at least 2)", there.len());
        if there.len() == rows {
            continue;
        }
        if signal.between == Between::Missing {
            continue;
        }
        if name == rows_signal {
            keep.iter_mut().zip(column.iter()).for_each(|(keep, value)| *keep &= !value.is_nan());
            done(format!("{} of {rows} rows have no {name} and are left out", rows - there.len()));
            continue;
        }
        let mut spacings: Vec<f64> = there.windows(2).map(|k| time[k[1]] - time[k[0]]).collect();
        let usual = *spacings.select_nth_unstable_by((there.len() - 1) / 2, f64::total_cmp).1;
        let longest = SHORT.max(LOST * usual);
        let how = match signal.between {
            Between::Held => "held",
            Between::Line => "joined by lines",
            Between::Missing => continue,
        };
        done(format!(
            "{name} has a value in {} of {rows} rows, {usual:.4} s apart; it is {how} in between",
            there.len()
        ));
        let late = there.windows(2).filter(|k| time[k[1]] - time[k[0]] > LATE_BY * usual).count();
        if late > 0 {
            done(format!(
                "{name}: {late} times the next value comes late: one is lost, and what {name} was in between is a guess"
            ));
        }
        let mut lost = 0;
        for pair in there.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let span = time[to] - time[from];
            for k in from + 1..to {
                if span > longest {
                    keep[k] = false;
                    lost += 1;
                    continue;
                }
                column[k] = match signal.between {
                    Between::Held => column[from],
                    Between::Line if span > 0.0 => {
                        column[from] + (time[k] - time[from]) / span * (column[to] - column[from])
                    }
                    Between::Line | Between::Missing => column[from],
                };
            }
        }
        // before its first value and, unless it is held a usual spacing longer, after its last
        let last = there[there.len() - 1];
        for k in (0..there[0]).chain(last + 1..rows) {
            let holds = k > last && signal.between == Between::Held && time[k] - time[last] < usual;
            if holds {
                column[k] = column[last];
            } else {
                keep[k] = false;
                lost += 1;
            }
        }
        if lost > 0 {
            done(format!("{lost} rows in which {name} is not known are left out"));
        }
    }
    for column in &mut columns {
        let mut keep = keep.iter();
        column.retain(|_| keep.next().copied().unwrap_or(false));
    }
    ensure!(!columns[0].is_empty(), "no row of it has a value of every signal");
    Ok(columns)
}
