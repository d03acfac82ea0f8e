//! Reads recordings of a bench, refuses recordings that no fit can use, and cuts them at gaps.
//!
//! If torque is missing and cannot be predicted, the recording is cut there ([`crate::input::gaps`]), and each part gets initial
//! values of its own.

use std::path::Path;

use analysis::innovations;
use analysis::statistics::{correlation, deviation, mean, noise_level, peak, running_mean};
use anyhow::{Context, Result, bail, ensure};
use signals::recording::{self, Between, Columns, Signal, Wanted};
use signals::table::Table;

use crate::input::clocks::{self, Clocked, completed};
use crate::input::recording::{Recording, masked, places, take_out};
use crate::input::sensor_faults::{self, Rest};
use crate::input::{gaps, spikes};
use crate::tuning::{DECAY_ROWS, LATE_SENSOR, LONG_RECORDING, MOVING_SPREAD, SHORTEST_RECORDING};

pub const REQUIRED: [&str; 3] = ["time", "tau_cmd", "omega"];
/// Optional columns of a recording.
pub const OPTIONAL: [&str; 5] = ["theta", "g_axial", "wheel_speed", "omega_x", "omega_y"];

#[derive(Clone, Debug)]
pub struct Source {
    pub columns: Columns,
    /// Times of the first and last row that are used, s; `None` for all rows.
    pub trim: Option<(f64, f64)>,
}

/// Reads the signals [`REQUIRED`] and, if present, [`OPTIONAL`] from a file. Rows outside `trim` are left out. The mean time
/// between rows may be at most `coarsest`, s. `done` receives a sentence about each change.
pub fn read(
    path: &Path,
    source: &Source,
    coarsest: f64,
    done: &mut dyn FnMut(String),
) -> Result<Vec<Recording>> {
    let signal = |name: &'static str| Signal {
        name,
        required: REQUIRED.contains(&name),
        between: Between::Missing,
        unit: None,
    };
    let signals: Vec<Signal> =
        ["omega", "tau_cmd"].into_iter().chain(OPTIONAL).map(signal).collect();
    let wanted = Wanted { signals: &signals, columns: &source.columns };
    let table = recording::read(path, &wanted, done)?;
    let name = path.display().to_string();
    let all = assembled(&name, &table, done)
        .with_context(|| format!("the recording {name} cannot be used"))?;
    prepare(trimmed(all, source.trim, done), coarsest, done)
}

/// Returns the rows in which a torque, a rate or an angle was recorded, from the first to the last value of the torque. Signals
/// may be sampled at different rows.
fn assembled(name: &str, table: &Table, done: &mut dyn FnMut(String)) -> Result<Recording> {
    let column = |name: &str| table.column(name);
    let (time, torque) = (column("time"), column("tau_cmd"));
    let (time, torque) = time.zip(torque).context("columns that were read")?;
    let measured: Vec<&[f64]> = ["omega", "theta"].into_iter().filter_map(column).collect();
    let first = torque.iter().position(|v| !v.is_nan());
    let last = torque.iter().rposition(|v| !v.is_nan());
    let (Some(first), Some(last)) = (first, last) else { bail!("tau_cmd has no value") };
    let is_of_use =
        |k: &usize| !torque[*k].is_nan() || measured.iter().any(|values| !values[*k].is_nan());
    let rows: Vec<usize> = (first..=last).filter(is_of_use).collect();
    let at: Vec<f64> = rows.iter().map(|k| time[*k]).collect();
    let mut of = |name: &str| -> Result<Option<Clocked>> {
        let Some(values) = column(name) else { return Ok(None) };
        let values: Vec<f64> = rows.iter().map(|k| values[*k]).collect();
        let there = values.iter().filter(|v| !v.is_nan()).count();
        ensure!(there > 1, "{name} has values in {there} rows (allowed: at least 2)");
        if there < rows.len() {
            let held: Vec<f64> =
                (0..at.len()).filter(|k| !values[*k].is_nan()).map(|k| at[k]).collect();
            done(format!(
                "{name} has a value in {there} of {} rows, usually every {:.4} s; {}",
                rows.len(),
                clocks::usual(&held),
                match name {
                    "omega" | "theta" =>
                        "the other rows drive the model, but are not compared with this signal",
                    _ => "in the other rows it is interpolated",
                }
            ));
        }
        Ok(Some(completed(&at, values)))
    };
    let (rate, fresh) = of("omega")?.context("a column that was read")?;
    let (torque, commanded) = of("tau_cmd")?.context("a column that was read")?;
    let (angle, angle_fresh) = of("theta")?.unzip();
    let mut plain = |name: &str| -> Result<Option<Vec<f64>>> { Ok(of(name)?.map(|of| of.0)) };
    Ok(Recording {
        angle,
        gravity: plain("g_axial")?,
        wheel_speed: plain("wheel_speed")?,
        off_axis: [plain("omega_x")?, plain("omega_y")?],
        from_rest: false,
        fresh,
        angle_fresh: angle_fresh.flatten(),
        commanded,
        ..Recording::of(name, at.clone(), torque, rate)
    })
}

/// Signals of a free decay, in the order of preference.
pub const DECAYING: [&str; 4] = ["wave_height", "force", "theta", "omega"];

/// Reads a free decay: one signal of [`DECAYING`], without torque. The signal is the one that `source.columns` names, otherwise
/// the first that the file contains. Returns the signal's name, and a recording with the signal in place of the rate.
pub fn read_decay(
    path: &Path,
    source: &Source,
    done: &mut dyn FnMut(String),
) -> Result<(&'static str, Recording)> {
    let name = path.display().to_string();
    let given = DECAYING.iter().filter(|name| source.columns.names(name)).collect::<Vec<_>>();
    ensure!(
        given.len() < 2,
        "--columns names {} signals (allowed: one, because a free decay is a record of one signal)",
        given.len()
    );
    let signal = |name| Signal { name, required: true, between: Between::Line, unit: None };
    let there = recording::assigned(path, &DECAYING.map(signal))?;
    let own = |k: usize| there.iter().any(|(_, signal)| *signal == Some(k));
    let seen = (0..DECAYING.len()).find(|k| own(*k)).map(|k| &DECAYING[k]);
    let Some(&found) = given.first().copied().or(seen) else {
        bail!(
            "{name} has no column {} (columns in it: {}; --columns time=COLUMN,wave_height=COLUMN:UNIT names the columns)",
            DECAYING.join(", "),
            there.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
        )
    };
    let wanted = Wanted { signals: &[signal(found)], columns: &source.columns };
    let table = recording::read(path, &wanted, done)?;
    let column =
        |name: &str| table.column(name).map(<[f64]>::to_vec).context("a column that was read");
    let (time, signal) = (column("time")?, column(found)?);
    let torque = vec![0.0; time.len()];
    let all = trimmed(Recording::of(&name, time, torque, signal), source.trim, done);
    ensure!(
        all.time.len() <= DECAY_ROWS,
        "{name}: {} rows are too many for a free decay (allowed: up to {DECAY_ROWS}); --trim takes a part of them",
        all.time.len()
    );
    all.check()?;
    let seconds = all.duration();
    // the last row also counts as one step long
    ensure!(
        seconds + all.step() >= SHORTEST_RECORDING * (1.0 - 1e-9),
        "{name}: {seconds:.2} s are too few (allowed: at least {SHORTEST_RECORDING} s)"
    );
    ensure!(deviation(&all.rate) > 0.0, "{name}: {found} is constant ({})", all.rate[0]);
    Ok((found, all))
}

fn trimmed(all: Recording, trim: Option<(f64, f64)>, done: &mut dyn FnMut(String)) -> Recording {
    let Some((from, to)) = trim else { return all };
    let (before, part) = (all.time.len(), all.between(from, to));
    let left_out = before - part.time.len();
    done(format!("{}: {left_out} rows outside {from} to {to} s left out", part.name));
    part
}

/// Checks a recording, and cuts it at gaps of the torque that cannot be filled. The mean time between rows may be
/// at most `coarsest`, s.
pub fn prepare(
    all: Recording,
    coarsest: f64,
    done: &mut dyn FnMut(String),
) -> Result<Vec<Recording>> {
    let name = all.name.clone();
    check_time(&all, coarsest)?;
    let (all, gaps) = gaps::bridged(all, done);
    // each part begins and ends with a recorded torque
    let mut cuts: Vec<(usize, usize)> = Vec::new();
    let mut from = 0;
    for row in gaps {
        let is_commanded = |k: &usize| all.commanded.as_ref().is_none_or(|mask| mask[*k]);
        let Some(next) = (row + 1..all.time.len()).find(is_commanded) else { break };
        let gap = all.time[next] - all.time[row];
        done(format!(
            "{name}: cut at {:.2} s, where tau_cmd is missing for {gap:.2} s and cannot be predicted",
            all.time[row]
        ));
        cuts.push((from, row + 1));
        from = next;
    }
    cuts.push((from, all.time.len()));
    let mut parts = Vec::new();
    for (index, (from, to)) in cuts.iter().enumerate() {
        let mut part = all.rows(*from, *to);
        let (seconds, step) = match part.time.len() > 1 {
            true => (part.duration(), part.step()),
            false => (0.0, 0.0),
        };
        if seconds + step < SHORTEST_RECORDING * (1.0 - 1e-9) {
            ensure!(
                cuts.len() > 1,
                "{name}: {seconds:.2} s of data are too few (allowed: at least {SHORTEST_RECORDING} s, and {LONG_RECORDING} s where the \
                 damping of a bare tank is to be seen: its slosh decays in some 23 s, its resonance is 14 mHz wide)"
            );
            done(format!(
                "{name}: {seconds:.1} s from {:.2} s on left out: too short",
                part.time[0]
            ));
            continue;
        }
        let repeats = part.with_repeats();
        part.from_rest = starts_at_rest(&part);
        if cuts.len() > 1 {
            part.name = format!("{name}, part {}", index + 1);
        }
        done(describe(&part));
        if seconds < LONG_RECORDING {
            done(format!(
                "{}: {seconds:.0} s are short for a bare tank, whose resonance takes {LONG_RECORDING} s to be resolved; expect wide \
                 intervals of damping and mass",
                part.name
            ));
        }
        if let (Some(fresh), true) = (&part.fresh, repeats) {
            let new = fresh.iter().filter(|new| **new).count();
            done(format!(
                "{}: omega has a new value in {new} of {} rows; only these rows are fitted",
                part.name,
                fresh.len()
            ));
        }
        without_faults(&mut part, done);
        without_spikes(&mut part, done);
        if !part.from_rest {
            let rows = part.time.len();
            for row in (0..rows).take_while(|k| part.time[*k] < part.time[0] + LATE_SENSOR) {
                take_out(&mut part.fresh, row, rows);
                take_out(&mut part.angle_fresh, row, rows);
            }
        }
        check_signals(&part)?;
        parts.push(part);
    }
    ensure!(
        !parts.is_empty(),
        "{name}: every part between gaps is shorter than {SHORTEST_RECORDING} s"
    );
    let torque = parts.iter().map(|part| peak(&part.torque)).fold(0.0, f64::max);
    ensure!(
        !parts.iter().all(is_stuck),
        "{name}: the hub does not turn: omega is noise of {:.1e} rad/s and does not follow tau_cmd (up to {torque:.2e} N·m). The \
         bearing sticks under so little torque, or omega is of another axis",
        noise_level(&parts[0].rate)
    );
    Ok(parts)
}

/// Marks values that the sensor did not measure, for example saturated or frozen ones, as not to be fitted. `done` receives a
/// message that names them.
fn without_faults(part: &mut Recording, done: &mut dyn FnMut(String)) {
    let rows = part.time.len();
    let Recording { name, time, torque, rate, angle, fresh, angle_fresh, .. } = part;
    // a hub whose first recorded torque is zero is at rest, so that its first rate is the gyro's bias
    let rest = (torque[0] == 0.0).then_some(rate[0]);
    let sensors = [
        ("omega", Some(rate), fresh, Rest::Rate(rest)),
        ("theta", angle.as_mut(), angle_fresh, Rest::Angle),
    ];
    for (sensor, whole, mask, rest) in sensors {
        let Some(whole) = whole else { continue };
        let places = places(mask, rows);
        let (at, values): (Vec<f64>, Vec<f64>) =
            places.iter().map(|k| (time[*k], whole[*k])).unzip();
        let found = sensor_faults::find(sensor, &at, &values, rest);
        found.words.iter().for_each(|words| done(format!("{name}: {words}")));
        found.rows.iter().for_each(|k| take_out(mask, places[*k], rows));
        if let (Some(mask), false) = (&*mask, found.rows.is_empty()) {
            // interpolated values for spectra and plots
            let known =
                mask.iter().zip(whole.iter()).map(|(new, v)| if *new { *v } else { f64::NAN });
            let known = known.collect();
            *whole = completed(time, known).0;
        }
    }
}

/// Marks spikes, which are single values that no motion explains, as not to be fitted. `done` receives a message that names them.
fn without_spikes(part: &mut Recording, done: &mut dyn FnMut(String)) {
    let found = spikes::find(&part.time, &part.rate, &part.torque, part.fresh.as_deref());
    let Some(largest) = found.iter().map(|(k, y)| (part.rate[*k] - y).abs()).reduce(f64::max)
    else {
        return;
    };
    let listed = &found[..found.len().min(8)];
    let at: Vec<String> = listed.iter().map(|(k, _)| format!("{:.2}", part.time[*k])).collect();
    let more = if found.len() > listed.len() { ", …" } else { "" };
    done(format!(
        "{}: {} single values of omega differ from their neighbours by more than noise, by up to {largest:.2e} rad/s; they are \
         not fitted (at {}{more} s)",
        part.name,
        found.len(),
        at.join(", ")
    ));
    let rows = part.rate.len();
    let fresh = part.fresh.get_or_insert_with(|| vec![true; rows]);
    for (k, y) in found {
        (part.rate[k], fresh[k]) = (y, false);
    }
}

fn describe(part: &Recording) -> String {
    let step = part.step();
    let sampling = if !clocks::is_even(&part.time) {
        let off = part.time.windows(2).map(|pair| (pair[1] - pair[0] - step).abs());
        let uneven = off.fold(0.0, f64::max);
        format!(
            "uneven sampling ({:.1} ms on average, up to {:.1} ms off), used as it is",
            1e3 * step,
            1e3 * uneven
        )
    } else {
        format!("{:.4} Hz", 1.0 / step)
    };
    let start = if part.from_rest { "starts at rest" } else { "initial state unknown, estimated" };
    format!(
        "{}: {} rows, {:.1} s, {sampling}, {start}",
        part.name,
        part.time.len(),
        part.duration()
    )
}

fn check_time(all: &Recording, coarsest: f64) -> Result<()> {
    let step = all.check()?;
    let name = &all.name;
    ensure!(
        step <= coarsest,
        "{name}: rows are {step} s apart, at most {coarsest:.3} s are allowed, a fifth of the slosh's expected period{}",
        if step >= 1.0 {
            ". Is time in milliseconds? It must be in seconds. (If the slosh really is that slow, --set g_axial, or \
             --start tank.d=VALUE:STD and tank.h)"
        } else {
            ""
        }
    );
    ensure!(
        step >= 1e-4,
        "{name}: rows are {step} s apart, which is impossible: give the time in seconds, or state its unit"
    );
    let masks = [("tau_cmd", &all.commanded), ("omega", &all.fresh), ("theta", &all.angle_fresh)];
    for (signal, mask) in masks {
        let Some(mask) = mask else { continue };
        let apart = clocks::usual(&masked(&all.time, Some(mask)));
        ensure!(
            apart <= coarsest,
            "{name}: values of {signal} are {apart:.3} s apart, at most {:.3} s are allowed: the values must show the slosh. Leave the column of {signal} out, or record {signal} at a higher rate",
            coarsest
        );
    }
    Ok(())
}

/// Returns true if rate and torque allow a start at rest: neither exceeds the values that noise, bias and the first
/// moment of motion explain. If both cross zero by chance in the middle of a motion, the answer is wrong, and the tests
/// of the residual detect it.
pub fn starts_at_rest(part: &Recording) -> bool {
    let rate = part.first_rate();
    let moves = deviation(&part.rate);
    // motion, other than the bias, that still counts as rest: 3 % of the signal plus 5 times the noise
    let is_slow = |rate: f64| rate.abs() < 5.0 * part.rate_noise() + 0.03 * moves;
    let bias = mean_reading(part);
    // a hub that begins at its mean rate is at rest, unless this mean exceeds the changes of the rate
    let rests = is_slow(rate) || bias.abs() < moves && is_slow(rate - bias);
    rests && part.torque[0].abs() < 0.1 * deviation(&part.torque)
}

/// Returns the mean of the gyro's readings minus the mean rate that the encoder shows, rad/s; without an encoder, the mean of the readings.
fn mean_reading(part: &Recording) -> f64 {
    let turned = part.angle.as_ref().map_or(0.0, |angle| {
        let (time, angle) = (part.of_fresh_angle(&part.time), part.of_fresh_angle(angle));
        let last = time.len().saturating_sub(1);
        if last > 0 { (angle[last] - angle[0]) / (time[last] - time[0]) } else { 0.0 }
    });
    mean(&part.of_fresh(&part.rate)) - turned
}

fn check_signals(part: &Recording) -> Result<()> {
    let name = &part.name;
    ensure!(
        deviation(&part.torque) > 1e-9 * peak(&part.torque).max(1e-12),
        "{name}: tau_cmd is constant ({} N·m). Without excitation nothing can be identified",
        part.torque[0]
    );
    ensure!(deviation(&part.rate) > 0.0, "{name}: omega is constant ({} rad/s)", part.rate[0]);
    // The torque of an inertia is proportional to the derivative of the rate, so it leads the rate by 90 degrees.
    let (torque, rate) = smoothed(part)?;
    let slope = |x: &[f64]| -> Vec<f64> { (1..x.len() - 1).map(|k| x[k + 1] - x[k - 1]).collect() };
    let inner = |x: &[f64]| x[1..x.len() - 1].to_vec();
    let leading = correlation(&inner(&torque), &slope(&rate));
    if leading < -0.3 {
        // of the two signals, the smoother one is the integral of the other: the ratio of rate to torque falls with frequency
        let rough = |x: &[f64]| deviation(&slope(x)) / deviation(x);
        let swapped = rough(&torque) < rough(&rate);
        let fault = if swapped {
            "the columns tau_cmd and omega are swapped: omega leads tau_cmd"
        } else {
            "omega has the wrong sign, or tau_cmd and omega are swapped: the hub seems to turn against its torque"
        };
        bail!(
            "{name}: {fault} (correlation of tau_cmd with the derivative of omega: {leading:.2})"
        );
    }
    Ok(())
}

/// Returns true if the rate is only noise, without any effect of the torque.
fn is_stuck(part: &Recording) -> bool {
    let (mean, noise) = (mean(&part.rate), noise_level(&part.rate));
    let unit: Vec<f64> = part.rate.iter().map(|w| (w - mean) / noise.max(1e-12)).collect();
    deviation(&unit) < MOVING_SPREAD
        && innovations::crossed(&unit, &part.torque, part.step()) < innovations::LIMIT
}

/// Returns torque and rate averaged over 0.1 s, so that their differences have less noise.
fn smoothed(part: &Recording) -> Result<(Vec<f64>, Vec<f64>)> {
    let (step, torque, rate) = part.even()?;
    let width = ((0.1 / step) as usize).max(1);
    Ok((running_mean(&torque, width), running_mean(&rate, width)))
}
