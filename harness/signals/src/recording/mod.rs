//! Reads recordings: signals in SI units from files that other programs wrote. Text in columns and Parquet are read
//! here; the Python package converts other kinds of files to text ([`crate::foreign`]). The signal and the unit of a
//! column follow from [`Columns`], from a row of units or from the name of the column (`gyro_z [deg/s]`,
//! `gyro_z_dps`). A column without a stated unit is assumed to be in SI units, and a message says so; if this is
//! implausible, the file is refused.
//!
//! The rows of a recording are the rows with a value of one signal, for example the rate. Other signals may lack values
//! in these rows, because they are slower or values were lost; missing values are replaced by the last value or by
//! linear interpolation. A recording is not resampled. Times that were printed with few digits are restored to their
//! even grid ([`stamps`]). Files of inputs ([`read_inputs`]) are read by the same rules, but keep all rows.

mod columns;
mod even;
mod stamps;
mod text;
mod time;
mod unit;

use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};

pub use self::columns::{Column, Columns, SIGNALS, quantity};
pub use self::even::{even, even_with_gaps};
use self::stamps::Stamps;
use self::unit::{Dimension, Fault};
pub use self::unit::{Quantity, conversion};
use crate::foreign::{self, Foreign, Kind};
use crate::parquet_file::{self, Found};
use crate::table::Table;

/// Names and units of a file's columns. `full` are the names as in the file, `names` are the names without a unit in
/// brackets at the end, and `row` contains the units from a row below the names.
struct Header {
    names: Vec<String>,
    full: Vec<String>,
    row: Vec<Option<String>>,
}

impl Header {
    fn from_names(names: Vec<String>, row: Option<&Vec<String>>) -> Header {
        let mut header = Header { names: Vec::new(), full: Vec::new(), row: Vec::new() };
        for (k, name) in names.into_iter().enumerate() {
            let below = row.and_then(|row| row.get(k)).map_or("", |unit| unit.as_str());
            let unit = below.trim_matches(['[', ']', '(', ')', ' ']);
            header.row.push((!unit.is_empty()).then(|| unit.to_string()));
            header.names.push(bracketed(&name).map_or(name.as_str(), |(bare, _)| bare).to_string());
            header.full.push(name);
        }
        header
    }

    /// Adds columns without a name until there are `width` columns. Such a column is named by its number: `#4`, `#5`, …
    fn widen(&mut self, width: usize) {
        for k in self.names.len()..width {
            self.names.push(format!("#{}", k + 1));
            self.full.push(format!("#{}", k + 1));
            self.row.push(None);
        }
    }

    /// Finds the position of a column. `column` is its name as in the file, its name without a unit in brackets, or its
    /// name without any unit of `dimension`.
    fn place(&self, column: &str, dimension: Option<Dimension>) -> Result<usize> {
        let number = column.strip_prefix('#').and_then(|number| number.parse::<usize>().ok());
        if let Some(place) = number.filter(|n| (1..=self.names.len()).contains(n)) {
            return Ok(place - 1);
        }
        let bare = bracketed(column).map_or(column, |(name, _)| name);
        let without_unit = |k: &usize| {
            let stated = dimension.map(|dimension| unit::find_unit(&self.full[*k], dimension));
            matches!(stated, Some(Ok(Some(unit))) if unit.is_last && unit.before == column)
        };
        let all = || 0..self.names.len();
        let mut found: Vec<usize> = all().filter(|k| self.full[*k] == column).collect();
        if found.is_empty() {
            found = all().filter(|k| self.names[*k] == bare).collect();
        }
        if found.is_empty() {
            found = all().filter(without_unit).collect();
        }
        match found[..] {
            [place] => Ok(place),
            [] => Err(anyhow!("no column {column}")),
            _ => Err(anyhow!("more than one column {column} (#{} and others)", found[0] + 1)),
        }
    }

    /// Returns the unit that the file states for a signal's column, and the factor from this unit
    /// to the unit of the returned values; `None` if the file states no unit.
    fn unit(&self, place: usize, signal: &Signal) -> Result<Option<(String, f64)>> {
        let row = match &self.row[place] {
            Some(unit) => Some((unit.clone(), factor(signal, unit)?)),
            None => None,
        };
        let wanted = dimension(signal).filter(|_| self.full[place] != signal.name);
        let named = match wanted
            .map(|(dimension, own)| (unit::find_unit(&self.full[place], dimension), own))
        {
            None | Some((Ok(None), _)) => None,
            Some((Ok(Some(stated)), own)) => Some((stated.text, stated.factor / own)),
            Some((Err(Fault::Foreign(unit)), _)) => Some((unit.clone(), factor(signal, &unit)?)),
            Some((Err(Fault::Two(one, other)), _)) => {
                bail!("the name of the column states two units, {one} and {other}")
            }
        };
        match (row, named) {
            (Some((below, a)), Some((unit, b))) => {
                ensure!(
                    (a / b - 1.0).abs() < 1e-9,
                    "the name of the column states {unit}, but the row of units states {below}"
                );
                Ok(Some((unit, b)))
            }
            (row, named) => Ok(named.or(row)),
        }
    }

    /// Finds pairs of columns of which one contains whole seconds and the other fractions of a second, such
    /// as `stamp.sec` and `stamp.nanosec`. Returns the positions of both, and the factor that converts the
    /// second column to seconds.
    fn halves(&self) -> Vec<(usize, usize, f64)> {
        const RESTS: [(&str, f64); 3] = [
            ("nanoseconds nanosecs nanosec nsecs nsec ns", 1e-9),
            ("microseconds usecs usec us", 1e-6),
            ("millisec", 1e-3),
        ];
        let lower: Vec<String> = self.names.iter().map(|name| name.to_lowercase()).collect();
        let mut found = Vec::new();
        for (rest, name) in lower.iter().enumerate() {
            let stem = RESTS.iter().find_map(|(ends, factor)| {
                let stem = ends.split(' ').find_map(|end| name.strip_suffix(end));
                stem.map(|stem| (stem, *factor))
            });
            let Some((stem, factor)) = stem else { continue };
            let is_whole = |other: &String| {
                other
                    .strip_prefix(stem)
                    .is_some_and(|end| ["sec", "secs", "seconds", "s"].contains(&end))
            };
            if let Some(whole) = lower.iter().position(is_whole) {
                found.push((whole, rest, factor));
            }
        }
        found
    }
}

fn bracketed(name: &str) -> Option<(&str, &str)> {
    let (open, close) = match name.chars().last()? {
        ']' => ('[', ']'),
        ')' => ('(', ')'),
        _ => return None,
    };
    let (bare, unit) = name.rsplit_once(open)?;
    let (bare, unit) = (bare.trim(), unit.trim_end_matches(close).trim());
    // A number in brackets belongs to the name, as in `data(3)`.
    let number = unit.chars().all(|c| c.is_ascii_digit());
    (!bare.is_empty() && !number).then_some((bare, unit))
}

/// Treatment of a signal in rows without a value: keep the last value, as a held command does; interpolate linearly
/// between the last value and the next; or leave NaN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    Held,
    Line,
    Missing,
}

/// A signal to read from a recording: one of [`SIGNALS`], or a variable of an FMU. A file without a `required` signal
/// is an error. `unit` is the unit of the returned values, and the assumed unit if the file states none; `None` for SI.
#[derive(Clone, Copy, Debug)]
pub struct Signal<'a> {
    pub name: &'a str,
    pub required: bool,
    pub between: Between,
    pub unit: Option<&'a str>,
}

/// Signals to read from a recording in addition to time. A row is read if the first signal has a
/// value there, unless this signal may be missing ([`Between::Missing`]).
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    pub signals: &'a [Signal<'a>],
    pub columns: &'a Columns,
}

/// Times later than this, s, are converted to times since the first row, because they are probably seconds since 1970.
const LATE: f64 = 1e6;
/// Latest time, s since 1970, for which a file need not state a unit: the year 5138. Milliseconds
/// since 1970 are later.
const LATEST: f64 = 1e11;
/// Longest time between rows, s, for which a file need not state the unit of time, because slosh
/// has periods of about a second.
const SLOWEST: f64 = 1.0;
/// Shortest time between rows, s, for which a file need not state the unit of time: no slosh is
/// recorded at 20 kHz, but rows at 50 Hz with times in days are 2e-7 apart.
const FASTEST: f64 = 5e-5;
/// Largest absolute value in SI units that is accepted. Statistics need its fourth power, whose sum over all
/// rows is then finite.
const LARGEST: f64 = 1e60;
/// Longest gap of a slow signal that is filled, relative to the usual time between the signal's values. Gaps of up to
/// [`SHORT`] seconds are always filled.
const LOST: f64 = 10.0;
/// Ratio of the time between two values of a signal to the usual time, above which a value counts as lost.
const LATE_BY: f64 = 1.5;
const SHORT: f64 = 0.25;

/// Lists every column of a file by its name in the file, with the index in `signals` of the signal that the column
/// contains. A column contains a signal if it has the signal's name, with or without a unit.
pub fn assigned(path: &Path, signals: &[Signal]) -> Result<Vec<(String, Option<usize>)>> {
    let file = with_text_file(path, File::open)?;
    let header = file.header();
    let mut found: Vec<_> = header.full.iter().map(|name| (name.clone(), None)).collect();
    for (k, signal) in signals.iter().enumerate() {
        let dimension = dimension(signal).map(|(dimension, _)| dimension);
        if let Ok(place) = header.place(signal.name, dimension) {
            found[place].1 = Some(k);
        }
    }
    Ok(found)
}

/// Reads a recording: the time (s) and the wanted signals, as far as the file has them, in SI units. `done` receives
/// messages about values that were converted or completed.
///
/// # Errors
/// If the file cannot be read. The error lists all faults of its columns.
pub fn read(path: &Path, wanted: &Wanted, done: &mut dyn FnMut(String)) -> Result<Table> {
    let name = path.display().to_string();
    let mut done = |words| done(format!("{name}: {words}"));
    with_text_file(path, |path| read_as(path, wanted, None, &mut done))
}

/// Reads a recording if it is text in columns or Parquet. Returns `None` for other kinds of files, which the Python
/// package converts. `name` is the file's name in errors, because `path` may be temporary.
///
/// # Errors
/// If the file cannot be read. The error lists all faults of its columns.
pub fn read_here(
    path: &Path,
    name: &Path,
    wanted: &Wanted,
    done: &mut dyn FnMut(String),
) -> Result<Option<Table>> {
    match read_as(path, wanted, None, done) {
        Err(error) if error.is::<Foreign>() => Ok(None),
        read => {
            read.map(Some).with_context(|| format!("the file {} cannot be used", name.display()))
        }
    }
}

/// Reads inputs as functions of time: `time` (s) and the signals, with all rows. Signals in `booleans` may be `true`
/// and `false`, which become 1 and 0. Rows may be unevenly spaced, and each must have every value.
///
/// # Errors
/// If the file cannot be read, or a value is missing.
pub fn read_inputs(
    path: &Path,
    wanted: &Wanted,
    booleans: &[&str],
    done: &mut dyn FnMut(String),
) -> Result<Table> {
    let name = path.display().to_string();
    let mut done = |words| done(format!("{name}: {words}"));
    let table = with_text_file(path, |path| read_as(path, wanted, Some(booleans), &mut done))?;
    table.all_finite().map_err(|error| anyhow!("{name}, {error}"))?;
    Ok(table)
}

enum File {
    Text(text::Layout),
    Parquet(Header),
}

impl File {
    fn open(path: &Path) -> Result<File> {
        Ok(match foreign::kind(path)? {
            Kind::Text => File::Text(text::Layout::detect(path)?),
            Kind::Parquet => File::Parquet(Header::from_names(parquet_file::names(path)?, None)),
        })
    }

    fn header(&self) -> &Header {
        match self {
            File::Text(layout) => &layout.header,
            File::Parquet(header) => header,
        }
    }
}

/// Calls `work` with the file `path` or, if only the Python package can read the file, with the text to which
/// that package converts it.
fn with_text_file<T>(path: &Path, mut work: impl FnMut(&Path) -> Result<T>) -> Result<T> {
    let read = match work(path) {
        Err(error) if error.is::<Foreign>() => {
            foreign::converted(path, &error).and_then(|(_folder, text)| work(&text))
        }
        read => read,
    };
    read.with_context(|| format!("the file {} cannot be used", path.display()))
}

/// Reads a recording. If `inputs` is given, the file contains inputs as functions of time instead, and `inputs`
/// lists the Boolean ones.
fn read_as(
    path: &Path,
    wanted: &Wanted,
    inputs: Option<&[&str]>,
    done: &mut dyn FnMut(String),
) -> Result<Table> {
    let file = File::open(path)?;
    let header = file.header();
    // Time first, then the signals of the file. A table with only times has no signal.
    let rows_signal = wanted.signals.first().map_or("time", |signal| signal.name);
    let time_signal = Signal { name: "time", required: true, between: Between::Line, unit: None };
    let counted = wanted.columns.rate();
    if let Some(rate) = counted {
        ensure!(
            !wanted.columns.names("time"),
            "both a sampling rate ({rate} Hz) and a column of times ({}, from --columns) are given (allowed: one of the two)",
            wanted.columns.column("time").name
        );
        if let Ok(own) = header.place("time", Some(Quantity::Time.dimension())) {
            done(format!(
                "the column {} is not read, because the times follow from the sampling rate of {rate} Hz",
                header.full[own]
            ));
        }
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
    let halves = header.halves();
    let own_time = counted.is_none().then_some(&time_signal);
    for signal in own_time.into_iter().chain(wanted.signals) {
        let column = wanted.columns.column(signal.name);
        let is_time = signal.name == "time";
        let place = match header
            .place(&column.name, dimension(signal).map(|(dimension, _)| dimension))
        {
            Ok(place) => place,
            Err(_) if !signal.required && !wanted.columns.names(signal.name) => continue,
            Err(_) if is_time && halves.len() == 1 && !wanted.columns.names("time") => halves[0].0,
            Err(error) => {
                timeless |= is_time;
                problems.push(error.to_string());
                continue;
            }
        };
        let unit = match &column.unit {
            Some(unit) => factor(signal, unit).map(|factor| Some((unit.clone(), factor))),
            None => header.unit(place, signal),
        };
        let unit = match unit {
            Ok(unit) => unit,
            Err(error) => {
                problems.push(format!(
                    "column {}: {error}; --columns {}={}:UNIT states its unit",
                    header.names[place], signal.name, column.name
                ));
                continue;
            }
        };
        if is_time {
            stated = unit.as_ref().map(|(_, factor)| *factor);
        }
        let named = match header.full[place] == signal.name {
            true => signal.name.to_string(),
            false => format!("{} = {}", signal.name, header.names[place]),
        };
        used.push(match (&unit, unstated(signal)) {
            (Some((unit, _)), _) => format!("{named} in {unit}"),
            (None, Some(unit)) => format!("{named}, no unit stated, taken as {unit}"),
            (None, None) => named,
        });
        signals.push(*signal);
        places.push(place);
        factors.push(unit.map_or(1.0, |(_, factor)| factor));
    }
    if signals.iter().all(|signal| signal.name == "time")
        && problems.is_empty()
        && !names.is_empty()
    {
        problems.push(format!("no column {}", names.join(", ")));
    }
    ensure!(
        problems.is_empty(),
        "{} (columns in it: {}{}; --columns SIGNAL=COLUMN:UNIT,... assigns columns to signals{})",
        problems.join("; "),
        header.names.join(", "),
        if let File::Text(layout) = &file { &layout.texts } else { "" },
        if timeless {
            "; --columns rate=HZ, or --rate HZ of the command gyro, reads equally spaced rows without times"
        } else {
            ""
        }
    );
    let time = header.full[places[0]].as_str();
    let timed = counted.is_none();
    // Two columns with whole seconds and fractions of a second are one time.
    let half = halves.iter().find(|(whole, rest, _)| {
        timed && (places[0] == *whole && stated.is_none_or(|s| s == 1.0) || places[0] == *rest)
    });
    if let Some((whole, rest, _)) = half {
        places[0] = *whole;
        places.push(*rest);
    }
    let booleans: Vec<bool> = (signals.iter())
        .map(|signal| inputs.is_some_and(|booleans| booleans.contains(&signal.name)))
        .chain([false])
        .collect();
    let found = match &file {
        File::Text(layout) => {
            layout.notes.iter().cloned().for_each(&mut *done);
            layout.read(path, &places, timed, &booleans, done)?
        }
        File::Parquet(_) => {
            let unit = half.map(|_| 1.0).or(stated);
            parquet_file::read(path, |_| Ok(places.clone()), timed.then_some((0, unit)), &booleans)?
        }
    };
    done(format!("columns used: {}", used.join(", ")));
    let Found { mut columns, origin } = found;
    let mut seconds = origin.is_some();
    if let Some((whole, rest, factor)) = half {
        let part = columns.pop().unwrap_or_default();
        if let Some((first, joined)) = join_seconds(&columns[0], &part, *factor) {
            columns[0] = joined;
            seconds = true;
            done(format!(
                "the times are the columns {} and {}: time counts from {first} s",
                header.full[*whole], header.full[*rest]
            ));
        } else if time == header.full[*rest] {
            // The times from the rate replace the times that the file also contains.
            columns[0] = part;
        }
    }
    for (k, (column, factor)) in columns.iter_mut().zip(&factors).enumerate() {
        if *factor != 1.0 && !(seconds && k == 0) {
            column.iter_mut().for_each(|value| *value *= factor);
        }
    }
    for (signal, column) in signals.iter().zip(&columns) {
        if let Some(row) = column.iter().position(|value| value.abs() > LARGEST) {
            bail!(
                "row {} of the values: {} is {:e} (allowed: magnitudes up to {LARGEST:e})",
                row + 1,
                signal.name,
                column[row]
            );
        }
    }
    if let Some(origin) = origin {
        done(format!("the times are dates: time counts from {origin}"));
    }
    if let Some(rate) = counted {
        let rows = columns[0].len();
        columns.insert(0, (0..rows).map(|k| k as f64 / rate).collect());
        signals.insert(0, time_signal);
        done(format!("the file has no times: its rows are taken as {rate} per second (--rate)"));
    }
    let names = signals.iter().map(|signal| signal.name.to_string()).collect();
    if inputs.is_some() {
        return Ok(Table::new(names, columns));
    }
    if timed && stated.is_none() && !seconds {
        plausible(&columns[0]).map_err(|why| {
            anyhow!("column {time} {why}: --columns time={time}:ms, or :s, :us, :ns, :min, :h, states its unit")
        })?;
    }
    match stamps::regular(&columns[0]) {
        Stamps::AsTheyAre => {}
        Stamps::On(grid) => {
            done(format!(
                "the times are rounded to {}: rows {:.6} ms apart have these times, so that the rows are taken as \
                 equally spaced",
                stamps::format_quantum(grid.quantum),
                1e3 * grid.step
            ));
            columns[0] = grid.time;
        }
        Stamps::Unknown(why) => bail!(
            "column {time}: {why} (allowed: times that grow from row to row; log them with more digits, or leave them \
             out and give the rows a second, if these are even and complete: --columns rate=HZ, or --rate HZ of the \
             command gyro)"
        ),
    }
    let columns = complete(&signals, columns, rows_signal, done)?;
    Ok(Table::new(names, columns))
}

/// Adds whole seconds and fractions of a second (multiplied by `factor`, s). Returns the first whole second, and the
/// times since then, s. Returns `None` if the columns contain anything else.
fn join_seconds(whole: &[f64], part: &[f64], factor: f64) -> Option<(f64, Vec<f64>)> {
    let first = *whole.first()?;
    let fine =
        |(whole, part): (&f64, &f64)| whole.fract() == 0.0 && (0.0..1.0).contains(&(part * factor));
    let all = || whole.iter().zip(part);
    (whole.len() == part.len() && all().all(fine))
        .then(|| (first, all().map(|(whole, part)| whole - first + part * factor).collect()))
}

/// Checks that times without a stated unit can be seconds.
///
/// # Errors
/// If they look like milliseconds or days.
fn plausible(time: &[f64]) -> Result<()> {
    if let Some(late) = time.iter().find(|t| t.abs() > LATEST) {
        bail!(
            "is {late} s, millennia after 1970 (allowed where no unit is stated: up to {LATEST:e} s)"
        );
    }
    let steps = time.windows(2).map(|pair| pair[1] - pair[0]);
    let mut steps: Vec<f64> = steps.filter(|step| step.is_finite()).collect();
    let Some(middle) = steps.len().checked_sub(1).map(|last| last / 2) else { return Ok(()) };
    let mut usual = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    if usual == 0.0 {
        usual = (time[time.len() - 1] - time[0]) / steps.len() as f64;
    }
    // The step is compared after rounding to the six digits of the message.
    let shown: f64 = format!("{usual:.5e}").parse().unwrap_or(usual);
    ensure!(
        usual < SLOWEST && (usual > FASTEST || usual <= 0.0),
        "states no unit, and its rows are {shown:?} apart (allowed where no unit is stated: between {FASTEST} and {SLOWEST} s)"
    );
    Ok(())
}

/// Returns the unit that is assumed for a signal if the file states none; `None` for an FMU's variable without a unit.
fn unstated<'a>(signal: &Signal<'a>) -> Option<&'a str> {
    let own = signal.unit.or_else(|| Some(quantity(signal.name).ok()?.unit()));
    own.filter(|unit| !unit.is_empty())
}

/// Returns the dimension of a signal, and the SI value of the unit in which its values are
/// returned.
fn dimension(signal: &Signal) -> Option<(Dimension, f64)> {
    match signal.unit {
        Some(unit) => unit::parse_unit(unit),
        None => quantity(signal.name).ok().map(|quantity| (quantity.dimension(), 1.0)),
    }
}

/// Returns the factor from `unit` to the unit in which the values of a signal are returned.
///
/// # Errors
/// If `unit` is not a unit of the signal's quantity.
fn factor(signal: &Signal, unit: &str) -> Result<f64> {
    let Some(own) = signal.unit else {
        let quantity = quantity(signal.name)?;
        return quantity.factor(unit).with_context(|| {
            format!("\"{unit}\" is not a unit of {quantity} (allowed: {})", quantity.units())
        });
    };
    // An FMU's variable without a unit is not converted.
    let known = if own.is_empty() { Some(1.0) } else { conversion(unit, own) };
    known.with_context(|| format!("\"{unit}\" cannot be converted to {}'s \"{own}\"", signal.name))
}

/// Selects the rows in which the first signal has a value, and fills missing values of the other signals in these rows
/// as their [`Between`] says.
///
/// # Errors
/// If a gap is too long to be filled.
fn complete(
    signals: &[Signal],
    mut columns: Vec<Vec<f64>>,
    rows_signal: &str,
    done: &mut dyn FnMut(String),
) -> Result<Vec<Vec<f64>>> {
    let time = &columns[0];
    ensure!(!time.is_empty(), "the file has no rows of values");
    if let Some(row) = time.iter().position(|t| t.is_nan()) {
        bail!("row {} of the values has no time", row + 1);
    }
    let origin = if time[0].abs() > LATE { time[0] } else { 0.0 };
    if origin != 0.0 {
        done(format!("time counts from the first row, whose time is {origin} s"));
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
            Between::Line => "interpolated linearly",
            Between::Missing => continue,
        };
        done(format!(
            "{name} has a value in {} of {rows} rows, {usual:.4} s apart; between these rows it is {how}",
            there.len()
        ));
        let late = there.windows(2).filter(|k| time[k[1]] - time[k[0]] > LATE_BY * usual).count();
        if late > 0 {
            done(format!(
                "{name}: in {late} places the next value comes late, so that a value must have been lost; {name} is uncertain there"
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
        // Rows before the signal's first value and after its last value are left out. The last value of a held signal
        // is valid for one more usual spacing.
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
