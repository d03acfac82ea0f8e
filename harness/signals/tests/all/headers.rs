//! Reads files with random headers and time formats whose true values are known. The reader has to return these values or refuse
//! the file, never return wrong values. Units are in brackets, behind the name, in words, in a row, on the command line, or
//! missing; times are numbers, dates, clock times, or seconds with nanoseconds.

use fastrand::Rng;
use signals::recording::{self, Between, Columns, Signal, Wanted};

const DEGREE: f64 = std::f64::consts::PI / 180.0;
type Units = &'static [(&'static str, f64)];

const TIMES: Units = &[
    ("s", 1.0),
    ("sec", 1.0),
    ("seconds", 1.0),
    ("ms", 1e-3),
    ("msec", 1e-3),
    ("milliseconds", 1e-3),
    ("us", 1e-6),
    ("µs", 1e-6),
    ("usec", 1e-6),
    ("microseconds", 1e-6),
    ("ns", 1e-9),
    ("nsec", 1e-9),
    ("nanoseconds", 1e-9),
    ("min", 60.0),
    ("minutes", 60.0),
    ("h", 3600.0),
];
const RATES: Units = &[
    ("rad/s", 1.0),
    ("rad s^-1", 1.0),
    ("rad·s⁻¹", 1.0),
    ("radians per second", 1.0),
    ("mrad/s", 1e-3),
    ("deg/s", DEGREE),
    ("°/s", DEGREE),
    ("dps", DEGREE),
    ("deg/sec", DEGREE),
    ("degrees per second", DEGREE),
    ("degrees/s", DEGREE),
    ("mdeg/s", 1e-3 * DEGREE),
    ("deg/h", DEGREE / 3600.0),
    ("rpm", 6.0 * DEGREE),
];
const TORQUES: Units = &[
    ("N.m", 1.0),
    ("N·m", 1.0),
    ("N*m", 1.0),
    ("N m", 1.0),
    ("Nm", 1.0),
    ("newton-metres", 1.0),
    ("mNm", 1e-3),
    ("mN.m", 1e-3),
    ("mN·m", 1e-3),
    ("millinewton meters", 1e-3),
    ("uNm", 1e-6),
    ("µN·m", 1e-6),
    ("Ncm", 1e-2),
    ("kN.m", 1e3),
    ("lbf.in", 4.448_221_615_260_5 * 0.0254),
    ("ozf.in", 4.448_221_615_260_5 * 0.0254 / 16.0),
];
const ANGLES: Units = &[
    ("rad", 1.0),
    ("mrad", 1e-3),
    ("deg", DEGREE),
    ("°", DEGREE),
    ("degrees", DEGREE),
    ("arcsec", DEGREE / 3600.0),
];

type Kind = (&'static str, Units, &'static [&'static str]);

const KINDS: [Kind; 4] = [
    ("time", TIMES, &["time", "t", "Time", "timestamp", "boot time", "elapsed"]),
    (
        "omega",
        RATES,
        &["omega", "gyro_z", "w", "Gyro Z", "rate.z", "angularVelocity", "omega_s", "gyro_m"],
    ),
    ("tau_cmd", TORQUES, &["tau_cmd", "T_cmd", "torque", "Torque 1", "wheel.torque", "trq_h"]),
    ("theta", ANGLES, &["theta", "encoder", "angle_1", "Angle", "theta_min"]),
];

#[derive(Default)]
struct Column {
    signal: &'static str,
    header: String,
    below: String,
    option: String,
    cells: Vec<String>,
    /// True values of the column in SI units; `None` if the file does not state the unit.
    truth: Option<Vec<f64>>,
}

fn pick<T: Copy>(dice: &mut Rng, all: &[T]) -> T {
    all[dice.usize(..all.len())]
}

struct File {
    columns: Vec<Column>,
    is_clear: bool,
}

/// Appends a unit to a name in one of several common notations. Returns false if a reader cannot always recognise the unit,
/// because of capitals or of blanks that may also separate columns.
fn with_unit(dice: &mut Rng, name: &str, unit: &str) -> (String, bool) {
    let (header, fine) = match dice.u8(..12) {
        0 | 1 => (format!("{name} [{unit}]"), true),
        2 => (format!("{name} ({unit})"), true),
        3 => (format!("{name}{{{unit}}}"), true),
        4 => (format!("{name}[{unit}] raw"), true),
        5 => (format!("{name} in {unit}"), true),
        6 => (format!("{name}, {unit}"), true),
        7 => (format!("{name} / ({unit})"), true),
        8 => (format!("{name}/{unit}"), true),
        9 => (format!("{name}_{}", unit.replace(['/', ' ', '.', '*', '·'], "_")), true),
        10 => (
            format!("{name}_{}", unit.replace([' ', '.', '*', '·'], "").replace('/', "_")),
            unit.contains(' '),
        ),
        _ => (format!("{name} {unit}"), true),
    };
    match dice.u8(..12) {
        0 => (header.to_uppercase(), false),
        1 => (header.to_lowercase(), false),
        _ => (header, fine),
    }
}

fn numbers(dice: &mut Rng, (signal, units, names): Kind, si: &[f64], clear: &mut bool) -> Column {
    let (unit, factor) = pick(dice, units);
    let name = pick(dice, names);
    let cells = si.iter().map(|value| match value / factor {
        // times in a small unit are whole numbers, because a clock counts whole units
        count
            if signal == "time"
                && (count - count.round()).abs() < 1e-6 * count.abs().max(1.0)
                && factor < 1.0 =>
        {
            format!("{}", count.round())
        }
        value => format!("{value}"),
    });
    let mut column =
        Column { signal, cells: cells.collect(), truth: Some(si.to_vec()), ..Column::default() };
    let at = |header: &str| header.split([',', ':', '=']).count() == 1;
    match dice.u8(..10) {
        // a file without a unit, whose values may be in SI units or not
        0 => {
            column.header = name.into();
            column.truth = None;
            *clear = false;
        }
        1 => {
            column.header = name.into();
            column.option = format!("{signal}={name}:{unit}");
        }
        2 => {
            column.header = name.into();
            column.below = unit.into();
        }
        // two units in one header, which may contradict each other
        3 => {
            let (header, _) = with_unit(dice, name, unit);
            column.header = header;
            column.below = pick(dice, units).0.into();
            let same = units.iter().find(|(other, _)| *other == column.below).unwrap().1 == factor;
            *clear = false;
            if !same {
                column.truth = Some(vec![f64::NAN]); // must be refused
            }
        }
        // a unit of another quantity, or a text that is no known unit
        4 if dice.bool() => {
            let other = pick(dice, &["V", "furlong/s", "kg", "deg", "m/s", "mm", "Hz", "rps"]);
            column.header = format!("{name} [{other}]");
            let own = units.iter().find(|(unit, _)| *unit == other);
            column.truth = Some(match own {
                Some((_, own)) => si.iter().map(|value| value / factor * own).collect(),
                None => vec![f64::NAN],
            });
            *clear = false;
        }
        _ => {
            let (header, fine) = with_unit(dice, name, unit);
            column.header = header;
            *clear &= fine;
        }
    }
    if column.option.is_empty() {
        if at(&column.header) {
            column.option = format!("{signal}={}", column.header);
        } else {
            column.header = column.header.replace([',', ':', '='], " ");
            column.option = format!("{signal}={}", column.header);
        }
    }
    if column.header == signal && dice.bool() {
        column.option = column.option.strip_prefix(&format!("{signal}={signal}")).map_or(
            column.option.clone(),
            |rest| {
                if rest.is_empty() { String::new() } else { column.option.clone() }
            },
        );
    }
    column
}

/// Returns days since 1970 as year, month and day (the civil calendar by H. Hinnant).
fn civil(day: i64) -> (i64, i64, i64) {
    let z = day + 719_468;
    let era = z.div_euclid(146_097);
    let doe = z.rem_euclid(146_097);
    let yoe = (doe - doe / 1460 + doe / 36_524 - doe / 146_096) / 365;
    let doy = doe - (365 * yoe + yoe / 4 - yoe / 100);
    let mp = (5 * doy + 2) / 153;
    let month = if mp < 10 { mp + 3 } else { mp - 9 };
    (yoe + era * 400 + i64::from(month < 3), month, doy - (153 * mp + 2) / 5 + 1)
}

fn stamps(dice: &mut Rng, ms: &[i64], clear: &mut bool) -> Vec<Column> {
    const NAMES: [&str; 12] =
        ["Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"];
    let truth: Vec<f64> = ms.iter().map(|t| (t - ms[0]) as f64 * 1e-3).collect();
    let name = pick(dice, &["time", "t", "Time", "timestamp"]);
    let column = |header: String, cells: Vec<String>| Column {
        signal: "time",
        option: format!("time={header}"),
        header,
        cells,
        truth: Some(truth.clone()),
        ..Column::default()
    };
    let form = dice.u8(..16);
    if form < 3 {
        // names of the columns with seconds and nanoseconds in ROS, candump and Linux
        let stem = pick(dice, &["", "stamp.", "header.stamp.", "tv_", "Stamp_"]);
        let (whole, rest, unit) = pick(
            dice,
            &[("sec", "nanosec", 1_000_000), ("secs", "nsecs", 1_000_000), ("sec", "usec", 1000)],
        );
        let seconds = ms.iter().map(|t| t.div_euclid(1000).to_string()).collect();
        let parts = ms.iter().map(|t| (t.rem_euclid(1000) * unit).to_string()).collect();
        let mut first = column(format!("{stem}{whole}"), seconds);
        if dice.bool() {
            first.option.clear(); // the reader finds this pair without an option
        }
        let second = Column { header: format!("{stem}{rest}"), cells: parts, ..Column::default() };
        return vec![first, second];
    }
    if form == 3 {
        // times in whole seconds, each of which several rows share
        let cells = ms.iter().map(|t| t.div_euclid(1000).to_string()).collect();
        *clear = false;
        let is_even = ms.windows(2).all(|t| t[0] / 1000 != t[1] / 1000);
        let truth = if is_even { truth.clone() } else { vec![f64::NAN] };
        return vec![Column { truth: Some(truth), ..column(format!("{name} [s]"), cells) }];
    }
    let changes = ms[0].div_euclid(86_400_000) != ms[ms.len() - 1].div_euclid(86_400_000);
    let zone = pick(dice, &["", "", "Z", "+0100", "+01:00", " UTC", "-05"]);
    let comma = dice.bool();
    let sign = if comma { ',' } else { '.' };
    let cells = ms.iter().map(|t| {
        let (year, month, day) = civil(t.div_euclid(86_400_000));
        let t = t.rem_euclid(86_400_000);
        let (hour, minute, second, part) =
            (t / 3_600_000, t / 60_000 % 60, t / 1000 % 60, t % 1000);
        let clock = format!("{hour:02}:{minute:02}:{second:02}{sign}{part:03}");
        let half = if hour < 12 { "AM" } else { "PM" };
        let twelve = format!(
            "{}:{minute:02}:{second:02}.{part:03} {half}",
            if hour % 12 == 0 { 12 } else { hour % 12 }
        );
        let short = year % 100;
        let named = NAMES[month as usize - 1];
        match form {
            4 => format!("{year}-{month:02}-{day:02}T{clock}{zone}"),
            5 => format!("{year}-{month:02}-{day:02} {clock}{zone}"),
            6 => format!("{day:02}.{month:02}.{year} {clock}"),
            7 => format!("{day}.{month}.{short:02} {clock}"),
            8 => format!("{month}/{day}/{year} {twelve}"),
            9 => format!("{day:02}/{month:02}/{year} {clock}"),
            10 => format!("{year}/{month:02}/{day:02} {clock}"),
            11 => format!("{day:02}-{named}-{year} {twelve}"),
            12 => clock,
            13 => format!("{hour:02}:{minute:02}:{second:02}:{part:03}"),
            14 => twelve,
            _ => format!("{day:02}/{month:02}/{short:02} {clock}"),
        }
    });
    let cells: Vec<String> = cells.collect();
    // dates whose order of day and month the file does not show
    let (_, _, day) = civil(ms[0].div_euclid(86_400_000));
    if changes && (form == 15 || matches!(form, 8 | 9) && day < 12) {
        *clear = false;
    }
    vec![column(name.into(), cells)]
}

fn file(dice: &mut Rng) -> File {
    let (step, rows) = (pick(dice, &[2, 10, 20, 25, 40, 100]), dice.usize(20..45));
    let mut clear = true;
    let day = dice.i64(19_000..21_000) * 86_400_000;
    // half of the files pass midnight
    let in_day = if dice.bool() { 86_400_000 - step * 10 } else { dice.i64(0..86_000_000) };
    let ms: Vec<i64> = (0..rows).map(|k| day + in_day + step * k as i64).collect();
    let mut columns = match dice.bool() {
        true => stamps(dice, &ms, &mut clear),
        false => {
            let begin = if dice.bool() { 0 } else { dice.i64(0..1000) * step };
            let si: Vec<f64> = (0..rows).map(|k| (begin + step * k as i64) as f64 * 1e-3).collect();
            vec![numbers(dice, KINDS[0], &si, &mut clear)]
        }
    };
    for kind in &KINDS[1..] {
        let values: Vec<f64> = (0..rows).map(|_| (dice.f64() - 0.5) * 0.3).collect();
        columns.push(numbers(dice, *kind, &values, &mut clear));
    }
    dice.shuffle(&mut columns);
    let mut names: Vec<&str> = columns.iter().map(|column| column.header.as_str()).collect();
    names.sort_unstable();
    let before = names.len();
    names.dedup();
    clear &= names.len() == before;
    // a row is recognised as a row of units only if most columns have a unit
    let below = columns.iter().filter(|column| !column.below.is_empty()).count();
    clear &= below == 0;
    File { columns, is_clear: clear }
}

fn text(dice: &mut Rng, columns: &[Column]) -> String {
    let separator = pick(dice, &[";", "\t", ","]);
    let end = pick(dice, &["\n", "\r\n", "\r"]);
    let quoted = |text: &str| match text.contains(separator) || text.contains(',') {
        true => format!("\"{text}\""),
        false => text.to_string(),
    };
    let line = |of: &dyn Fn(&Column) -> String| {
        columns.iter().map(|column| quoted(&of(column))).collect::<Vec<_>>().join(separator) + end
    };
    let mut all = line(&|column| column.header.clone());
    if columns.iter().any(|column| !column.below.is_empty()) {
        all += &line(&|column| column.below.clone());
    }
    for row in 0..columns[0].cells.len() {
        all += &line(&|column| column.cells[row].clone());
    }
    all
}

/// No column of 10,000 random files, with and without units in their names, is taken for another signal or read in a wrong unit.
#[test]
fn random_headers_are_read_right_or_refused() {
    let seed = std::env::var("HUBSLOSH_FUZZ_SEED").ok().and_then(|seed| seed.parse().ok());
    let mut dice = Rng::with_seed(seed.unwrap_or(1));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("input.csv");
    let signal =
        |name| Signal { name, required: name != "theta", between: Between::Missing, unit: None };
    let signals = ["omega", "tau_cmd", "theta"].map(signal);
    let (mut clear, mut refused, mut wrong, mut read) = (0, Vec::new(), Vec::new(), 0);
    for n in 0..10_000 {
        let File { columns, is_clear } = file(&mut dice);
        let text = text(&mut dice, &columns);
        let options: Vec<&str> =
            columns.iter().map(|c| c.option.as_str()).filter(|o| !o.is_empty()).collect();
        let options = options.join(",");
        let all = || format!("file {n}, --columns {options}:\n{text}");
        let _ = std::fs::remove_file(&path);
        std::fs::write(&path, &text).unwrap();
        let given: Columns = match options.parse() {
            Ok(given) => given,
            Err(error) => panic!("{error:#}: {}", all()),
        };
        let mut notes = String::new();
        let wanted = Wanted { signals: &signals, columns: &given };
        let found = recording::read(&path, &wanted, &mut |note| notes += &(note + "\n"));
        clear += usize::from(is_clear);
        let table = match found {
            Ok(table) => table,
            Err(error) if is_clear => {
                refused.push(format!("{error:#}: {}", all()));
                continue;
            }
            Err(_) => continue,
        };
        read += 1;
        for Column { signal, header, truth, .. } in columns.iter().filter(|c| !c.signal.is_empty())
        {
            let Some(values) = table.column(signal) else { panic!("no {signal}: {}", all()) };
            let Some(truth) = truth else {
                let is_noted = notes.lines().any(|note| note.contains("no unit stated, taken as"));
                if !is_noted {
                    wrong.push(format!("{header} has no unit, and that is not said: {}", all()));
                }
                continue;
            };
            if values.len() != truth.len() {
                wrong.push(format!("{header} should be refused: {}", all()));
                continue;
            }
            // dates and large times are converted to times since the first row
            let from = if *signal == "time" { values[0] - truth[0] } else { 0.0 };
            for (value, truth) in values.iter().zip(truth) {
                let off = (value - from - truth).abs();
                let most = if *signal == "time" { 1e-6 } else { 1e-9 * truth.abs() };
                if off > most {
                    wrong.push(format!(
                        "{header}: {value} is read, {truth} is right: {notes}{}",
                        all()
                    ));
                    break;
                }
            }
        }
    }
    // the message of a failure shows the first lines of the file
    let start =
        |text: &String| text.replace('\r', "\n").lines().take(12).collect::<Vec<_>>().join("\n");
    wrong.iter().chain(&refused).take(12).for_each(|each| println!("{}\n", start(each)));
    assert!(wrong.is_empty(), "{} of {read} files are read wrongly", wrong.len());
    println!("{clear} clear files, {} refused; {read} read", refused.len());
    assert!(clear > 800 && read > 4000, "{clear} {read}");
    assert!(refused.len() * 100 < clear, "{} of {clear} clear files are refused", refused.len());
}
