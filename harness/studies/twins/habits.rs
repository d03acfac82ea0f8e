//! Formats in which loggers, spreadsheets and scripts write a recording: writes the measurement of a twin in each of them.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use analysis::random::Random;
use anyhow::{Result, bail};
use signals::table::Table;

use crate::draw::{Measured, Twin};

pub const HABITS: [&str; 20] = [
    "slow-gyro",
    "ms-33hz",
    "us-33hz",
    "gap",
    "gaps",
    "two-delays",
    "torque-10hz",
    "torque-20hz",
    "uneven",
    "late-start",
    "text-columns",
    "excel-abroad",
    "clock-times",
    "dates",
    "thousands",
    "units-in-names",
    "no-time",
    "repeats",
    "clipped",
    "frozen",
];

/// A recording in a file, with the options that its user needs to read it: `--columns`, the first and last time (s), and
/// the rows per second.
#[derive(Default)]
pub struct Written {
    pub path: PathBuf,
    pub columns: String,
    pub trim: Option<(f64, f64)>,
    pub rate: Option<f64>,
}

/// A row of a log: time (s), torque (N·m), rate (rad/s) and angle (rad); `None` for an empty cell.
#[derive(Clone, Copy)]
struct Row {
    time: f64,
    torque: Option<f64>,
    rate: Option<f64>,
    angle: Option<f64>,
}

/// Returns the twin with the properties that recordings in the logger format `habit` have: for example a sampling rate of
/// 33 Hz for `ms-33hz`, or an encoder for `two-delays`.
pub fn of(mut twin: Twin, habit: &str) -> Twin {
    match habit {
        "ms-33hz" | "us-33hz" => twin = twin.with_rate(33.0),
        "two-delays" => twin.encoder = twin.encoder.or(Some(1e-4)),
        "late-start" => twin.delay += 0.05,
        _ => {}
    }
    twin
}

/// Writes the recording of a twin to a directory in this format.
///
/// # Errors
/// If there is no such format, or the file cannot be written.
pub fn write(twin: &Twin, habit: &str, directory: &Path) -> Result<Written> {
    let mut rows = log(twin, habit);
    let mut random = Random::new(twin.seed, 11);
    let last = rows[rows.len() - 1].time;
    match habit {
        "slow-gyro" => {
            rows.iter_mut().enumerate().filter(|(k, _)| k % 5 != 2).for_each(|(_, row)| {
                (row.rate, row.angle) = (None, None);
            })
        }
        "gap" => rows.retain(|row| !(0.0..0.2).contains(&(row.time - 0.45 * last))),
        "gaps" => rows.retain(|row| {
            [0.2, 0.45, 0.8].iter().all(|at| !(0.0..1.0).contains(&(row.time - at * last)))
        }),
        "repeats" => {
            for k in 1..rows.len() {
                if random.uniform() < 0.05 {
                    rows[k].rate = rows[k - 1].rate;
                }
            }
        }
        "clipped" => {
            let peak = rows.iter().filter_map(|row| row.rate).fold(0.0, |p: f64, w| p.max(w.abs()));
            rows.iter_mut()
                .for_each(|row| row.rate = row.rate.map(|w| w.clamp(-0.7 * peak, 0.7 * peak)));
        }
        "frozen" => {
            for from in [0.3, 0.5, 0.7] {
                let from = rows.partition_point(|row| row.time < from * last);
                let to = rows.partition_point(|row| row.time < rows[from].time + 1.0);
                let value = rows[from].rate;
                rows[from..to].iter_mut().for_each(|row| row.rate = value);
            }
        }
        _ => {}
    }
    let mut written =
        Written { path: directory.join(format!("{habit}.csv")), ..Written::default() };
    match habit {
        "late-start" => written.trim = Some((0.15 * last, last)),
        "no-time" => written.rate = Some(1.0 / (rows[1].time - rows[0].time)),
        "thousands" => "time=t:ms,tau_cmd=T:uNm".clone_into(&mut written.columns),
        "units-in-names" => {
            written.path.set_extension("parquet");
            let column = |name: &str, of: &dyn Fn(&Row) -> Option<f64>| {
                (name.to_string(), rows.iter().map(|row| of(row).unwrap_or(f64::NAN)).collect())
            };
            let mut columns: Vec<(String, Vec<f64>)> = vec![
                column("t (ms)", &|row| Some(1e3 * row.time)),
                column("T_cmd [mN.m]", &|row| row.torque.map(|t| 1e3 * t)),
                column("gyro z (deg/s)", &|row| row.rate.map(f64::to_degrees)),
            ];
            if twin.encoder.is_some() {
                columns.push(column("theta (deg)", &|row| row.angle.map(f64::to_degrees)));
            }
            let (names, columns) = columns.into_iter().unzip();
            Table::new(names, columns).write(&written.path, &BTreeMap::new())?;
            "time=t (ms),tau_cmd=T_cmd [mN.m],omega=gyro z".clone_into(&mut written.columns);
            return Ok(written);
        }
        habit if !HABITS.contains(&habit) => {
            bail!("{habit} is not a habit (allowed: {})", HABITS.join(", "))
        }
        _ => {}
    }
    std::fs::write(&written.path, text(&rows, habit, twin.encoder.is_some())?)?;
    Ok(written)
}

/// Returns the rows of a log. If the torque is sampled by a slow clock of its own, its instants are rows, too.
fn log(twin: &Twin, habit: &str) -> Vec<Row> {
    let mut instants = twin.rows();
    if habit == "uneven" {
        let mut random = Random::new(twin.seed, 12);
        let step = instants[1] - instants[0];
        let inner = instants.len() - 1;
        instants[1..inner].iter_mut().for_each(|t| *t += step * (0.6 * random.uniform() - 0.3));
    }
    let slow = match habit {
        "torque-10hz" => 10.0,
        "torque-20hz" => 20.0,
        _ => 0.0,
    };
    let commands: Vec<f64> = if slow > 0.0 {
        let count = (instants[instants.len() - 1] * slow).floor() as usize;
        (0..=count).map(|k| k as f64 / slow).collect()
    } else {
        instants.clone()
    };
    let encoder_delay = if habit == "two-delays" { twin.delay + 0.015 } else { twin.delay };
    let Measured { torque, rate, angle } = twin.measure(&commands, &instants, encoder_delay);
    let angles = |k: usize| angle.as_ref().map(|angle| angle[k]);
    let mut rows: Vec<Row> = twin
        .stamps(&instants)
        .into_iter()
        .enumerate()
        .map(|(k, time)| Row { time, torque: None, rate: Some(rate[k]), angle: angles(k) })
        .collect();
    for (time, torque) in twin.stamps(&commands).into_iter().zip(torque) {
        let at = rows.partition_point(|row| row.time < time - 1e-9);
        match rows.get_mut(at) {
            Some(row) if (row.time - time).abs() < 1e-9 => row.torque = Some(torque),
            _ => rows.insert(at, Row { time, torque: Some(torque), rate: None, angle: None }),
        }
    }
    rows
}

fn text(rows: &[Row], habit: &str, encoder: bool) -> Result<String> {
    let mut text = String::new();
    let (separator, head) = match habit {
        "excel-abroad" => (";", "\u{feff}sep=;\ntime;tau_cmd;omega"),
        "text-columns" => (",", "state,time,armed,tau_cmd,omega"),
        "thousands" => (",", "t,T,omega"),
        "no-time" => (",", "tau_cmd,omega"),
        _ => (",", "time,tau_cmd,omega"),
    };
    text += head;
    text += if encoder { separator } else { "" };
    text += if encoder { "theta\n" } else { "\n" };
    for row in rows {
        let Row { time, torque, rate, angle } = *row;
        let cell = |value: Option<f64>| match (value, habit) {
            (None, _) => String::new(),
            (Some(v), "excel-abroad") => format!("{v}").replace('.', ",").replace('-', "\u{2212}"),
            (Some(v), _) => format!("{v}"),
        };
        let stamp = match habit {
            "ms-33hz" => format!("{time:.3}"),
            "us-33hz" => format!("{time:.6}"),
            // times of day, across midnight, with or without dates
            "clock-times" | "dates" => {
                let micros = ((time + 86_300.0) * 1e6).round() as u64;
                let (day, micros) = (micros / 86_400_000_000, micros % 86_400_000_000);
                let seconds = micros / 1_000_000;
                let clock =
                    format!("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60);
                match habit {
                    "dates" => {
                        format!("2026-03-{:02} {clock}.{:06}+00:00", 14 + day, micros % 1_000_000)
                    }
                    _ => format!("{clock}.{:06}", micros % 1_000_000),
                }
            }
            "thousands" => format!("\"{}\"", grouped(1e3 * time)),
            _ => cell(Some(time)),
        };
        let torque = match habit {
            "thousands" => torque.map_or(String::new(), |t| format!("\"{}\"", grouped(1e6 * t))),
            _ => cell(torque),
        };
        let mut cells = match habit {
            "text-columns" => {
                let state = if time < 1.0 { "idle" } else { "sweep, up" };
                vec![format!("\"{state}\""), stamp, "true".into(), torque, cell(rate)]
            }
            "no-time" => vec![torque, cell(rate)],
            _ => vec![stamp, torque, cell(rate)],
        };
        if encoder {
            cells.push(cell(angle));
        }
        writeln!(text, "{}", cells.join(separator))?;
    }
    Ok(text)
}

/// Formats a number as spreadsheets do: three decimals, and commas between thousands.
fn grouped(value: f64) -> String {
    let text = format!("{:.3}", value.abs());
    let (whole, rest) = text.split_once('.').unwrap_or((&text, ""));
    let mut out = String::from(if value < 0.0 { "-" } else { "" });
    for (k, digit) in whole.chars().enumerate() {
        if k > 0 && (whole.len() - k).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    format!("{out}.{rest}")
}
