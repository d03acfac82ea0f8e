//! Friction and inertia from recordings in which the liquid does not move, fitted by [`output_error`] with a rigid liquid. Two
//! results of the thesis (5.2 to 5.4) are added: the measured friction over the rate, and the deceleration over the hub's angle.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use analysis::innovations::LIMIT;
use analysis::statistics::{deviation, mean, peak};
use anyhow::{Result, ensure};
use host::fmu::Fmu;
use nalgebra::{DMatrix, DVector};
use names::hubslosh::{FrictionModel, SloshModel, fluid, friction, hub, tank};

use super::output_error;
use crate::bench::braking::{Braking, FrictionPoint, LEAST_STRETCHES, harmonics_at};
use crate::bench::identification::Identification;
use crate::bench::nominal::{self, Nominal};
use crate::bench::options::Options;
use crate::input::plausible;
use crate::input::recording::Recording;
use crate::news::News;
use crate::tuning::{
    BLOCK, FEWEST_BLOCKS, FREE_TORQUE, FRICTION_BINS, MOVING_SPEED, MOVING_SPREAD,
};

/// Fits friction and inertia. Unless the settings state the fill of the tank, the tank is assumed to be empty, and
/// the verdict says so.
///
/// # Errors
/// If the recordings do not show friction. The message says what to record.
pub fn identify(
    fmu: &Fmu,
    recordings: &[Recording],
    options: &Options,
    progress: &mut dyn FnMut(&News),
) -> Result<Identification> {
    check(recordings)?;
    let mut options = Options {
        models: vec![SloshModel::Frozen.name().into()],
        friction: vec![FrictionModel::Stribeck.name().into()],
        ..options.clone()
    };
    let states_liquid =
        |(name, _): &(String, String)| [tank::H, fluid::RHO].contains(&name.as_str());
    let is_assumed = !options.settings.iter().any(states_liquid);
    if is_assumed {
        options.settings.extend(empty());
    }
    let mut found = output_error::identify(fmu, recordings, &options, progress)?;
    let mut bench = nominal::initialised(fmu, &options.settings)?;
    let liquid = bench.real(tank::M_LIQ)? * bench.real(tank::R)?.powi(2);
    let number = |name: &str| found.parameters.get(name).map_or(0.0, |p| p.value);
    let inertia = number(hub::I) + liquid;
    if found.parameters.get(hub::I).is_some_and(|p| p.std < 0.3 * p.value) {
        let nominal = Nominal::of(fmu, &options.settings, &[])?;
        plausible::check_size(inertia, nominal.inertia)?;
    }
    let bias = |k: usize| {
        let name = format!("gyro_bias[{}]", k + 1);
        found.measurement.get(&name).map_or(0.0, |p| p.value)
    };
    let biases: Vec<f64> = (0..recordings.len()).map(bias).collect();
    found.details.braking = brakings(recordings, &biases);
    found.details.friction_points = friction_points(recordings, &biases, inertia);
    if is_assumed {
        found.verdict.push(
            "The tank is taken as empty, so that hub.I is the inertia of all that turns. --set tank.h=… states the height of a \
             liquid, whose inertia is then subtracted."
                .into(),
        );
    }
    if let Some(asymmetry) = found.parameters.get(friction::ASYMMETRY).filter(|a| a.determined)
        && found.fits == Some(true)
        && asymmetry.value.abs() > 3.0 * asymmetry.std
    {
        let ways = ["counter-clockwise", "clockwise"];
        let [harder, easier] = if asymmetry.value > 0.0 { ways } else { [ways[1], ways[0]] };
        found.verdict.push(format!(
            "Preferential direction {easier}: {harder} the dry friction is {:.1} % stronger than the mean of both.",
            100.0 * asymmetry.value.abs()
        ));
    }
    if let [ahead, back] = &found.details.braking[..] {
        found.verdict.push(format!(
            "Free decay: counter-clockwise {:.4} rad/s², clockwise {:.4} rad/s² on average over the angle.",
            ahead.coefficients[0], back.coefficients[0]
        ));
    }
    Ok(found)
}

/// Returns the settings of a bench without liquid: the smallest density that the FMU accepts, with which the bench's
/// tank contains 2e-9 kg.
pub fn empty() -> [(String, String); 1] {
    [(fluid::RHO.into(), "1e-6".into())]
}

fn check(recordings: &[Recording]) -> Result<()> {
    ensure!(!recordings.is_empty(), "there is no recording");
    for recording in recordings {
        recording.check()?;
        ensure!(
            recording.duration() > FEWEST_BLOCKS as f64 * BLOCK,
            "{}: it lasts {:e} s (allowed: more than {} s). Record a ramp, a step and a sweep of a minute or more each",
            recording.name,
            recording.duration(),
            FEWEST_BLOCKS as f64 * BLOCK
        );
    }
    let names = || recordings.iter().map(|r| r.name.as_str()).collect::<Vec<_>>().join(", ");
    let torque = recordings.iter().map(|r| peak(&r.torque)).fold(0.0, f64::max);
    ensure!(
        torque > 0.0,
        "{}: the torque is 0 in every row. Friction and inertia need a torque; record a ramp, a step or a sweep",
        names()
    );
    let moves = |r: &Recording| deviation(&r.rate) > MOVING_SPREAD * r.rate_noise();
    ensure!(
        recordings.iter().any(moves),
        "{}: the hub does not move: the rate is constant but for the gyro's noise. Static friction holds it up to the largest torque, \
         {torque:.1e} N·m; record more torque",
        names()
    );
    Ok(())
}

/// Returns the measured friction over the rate: averages over rows of similar rate in which the hub turns. `inertia` is the
/// inertia of hub and liquid together, kg·m².
fn friction_points(recordings: &[Recording], biases: &[f64], inertia: f64) -> Vec<FrictionPoint> {
    let (count, fewest) = FRICTION_BINS;
    let mut all: Vec<(f64, f64)> = Vec::new();
    for (recording, bias) in recordings.iter().zip(biases) {
        let own = recording.of_gyro();
        // averaged over blocks of rows, because differences between neighbouring fast samples would be mostly noise
        let block = ((BLOCK / own.step() * (1.0 + 1e-9)) as usize).max(1);
        let means = |signal: &[f64]| -> Vec<f64> { signal.chunks_exact(block).map(mean).collect() };
        let [t, rate, torque] = [&own.time, &own.rate, &own.torque].map(|signal| means(signal));
        let still = LIMIT * own.rate_noise();
        for k in 1..t.len().saturating_sub(1) {
            let slips = |w: &f64| (w - bias).abs() > still;
            if rate[k - 1..=k + 1].iter().any(slips) {
                let acceleration = (rate[k + 1] - rate[k - 1]) / (t[k + 1] - t[k - 1]);
                let driving = 0.25 * (torque[k - 1] + 2.0 * torque[k] + torque[k + 1]);
                all.push((rate[k] - bias, driving - inertia * acceleration));
            }
        }
    }
    let most = all.iter().map(|(w, _)| w.abs()).fold(f64::MIN_POSITIVE, f64::max);
    // intervals are narrower near zero, where friction changes most
    let bin = |w: f64| (w.signum() * (w.abs() / most).sqrt() * count as f64 / 2.0).round() as i64;
    let mut bins: BTreeMap<i64, (f64, f64, usize)> = BTreeMap::new();
    for (w, torque) in all {
        let sum = bins.entry(bin(w)).or_default();
        *sum = (sum.0 + w, sum.1 + torque, sum.2 + 1);
    }
    let point = |(rate, torque, rows): (f64, f64, usize)| FrictionPoint {
        rate: rate / rows as f64,
        torque: torque / rows as f64,
        rows,
    };
    bins.into_values().filter(|bin| bin.2 >= fewest).map(point).collect()
}

/// Fits [`Braking`] separately for both directions. A direction with too few rows is left out.
pub fn brakings(recordings: &[Recording], biases: &[f64]) -> Vec<Braking> {
    let mut free: [Vec<FreeRow>; 2] = Default::default();
    let mut stretch = 0;
    for (recording, bias) in recordings.iter().zip(biases) {
        let Some(angle) = &recording.angle else { continue };
        let rate: Vec<f64> = recording.rate.iter().map(|w| w - bias).collect();
        let (torque, t) = (&recording.torque, &recording.time);
        let (still, slow) = (FREE_TORQUE * peak(torque), MOVING_SPEED * peak(&rate));
        let (mut turned, mut last) = (0.0, None);
        for k in 1..t.len() - 1 {
            let step = angle[k] - angle[k - 1];
            turned += step - TAU * (step / TAU).round(); // the angle may be wrapped
            let way = rate[k].signum();
            if !(k - 1..=k + 1).all(|i| torque[i].abs() <= still && way * rate[i] > slow) {
                last = None;
                continue;
            }
            let revolution = Some((turned / TAU).floor());
            stretch += usize::from(last != revolution);
            last = revolution;
            free[usize::from(way < 0.0)].push(FreeRow {
                angle: angle[k],
                speed: rate[k].abs(),
                acceleration: (rate[k + 1] - rate[k - 1]) / (t[k + 1] - t[k - 1]),
                stretch,
            });
        }
    }
    let speeds: Vec<f64> = free.iter().flatten().map(|row| row.speed).collect();
    let speed = mean(&speeds);
    let [ahead, back] = &free;
    [("counter-clockwise", ahead), ("clockwise", back)]
        .into_iter()
        .filter_map(|(direction, rows)| braking(direction, rows, speed))
        .collect()
}

struct FreeRow {
    angle: f64,
    speed: f64,
    acceleration: f64,
    /// Number of the stretch to which the row belongs. A stretch is a part of one decay within one revolution of the hub.
    stretch: usize,
}

/// Fits the deceleration in one direction of rotation by least squares: harmonics of the angle plus a parabola in the difference
/// of the rate from `speed`, rad/s. The result is the deceleration at `speed`.
fn braking(direction: &'static str, rows: &[FreeRow], speed: f64) -> Option<Braking> {
    let (harmonics, count) = (2, rows.len());
    let (width, all) = (2 * harmonics + 1, 2 * harmonics + 3);
    if count < 20 * all {
        return None;
    }
    let regressors = rows.iter().flat_map(|row| {
        let more = row.speed - speed;
        [harmonics_at(row.angle, harmonics), vec![more, more * more]].concat()
    });
    let a = DMatrix::from_row_iterator(count, all, regressors);
    let y = DVector::from_iterator(count, rows.iter().map(|row| row.acceleration));
    let inverse = a.tr_mul(&a).try_inverse()?;
    let found = &inverse * a.tr_mul(&y);
    let residual = &y - &a * &found;
    let variance = residual.norm_squared() / (count - all) as f64;
    let at_speed = y - a.columns(width, 2) * found.rows(width, 2);
    let about = at_speed.add_scalar(-at_speed.mean());
    let mut sums: BTreeMap<usize, DVector<f64>> = BTreeMap::new();
    for (i, row) in rows.iter().enumerate() {
        let sum = sums.entry(row.stretch).or_insert_with(|| DVector::zeros(all));
        *sum += a.row(i).transpose() * residual[i];
    }
    let meat = sums.values().fold(DMatrix::zeros(all, all), |all, s| all + s * s.transpose());
    let covariance = (&inverse * meat * &inverse).view((0, 0), (width, width)).into_owned();
    let stretches = sums.len();
    Some(Braking {
        direction,
        speed,
        std: (0..width).map(|j| (variance * inverse[(j, j)]).sqrt()).collect(),
        coefficients: found.as_slice()[..width].to_vec(),
        rmse: (residual.norm_squared() / count as f64).sqrt(),
        r_squared: 1.0 - residual.norm_squared() / about.norm_squared(),
        rows: count,
        stretches,
        points: rows.iter().map(|row| row.angle).zip(at_speed.iter().copied()).collect(),
        covariance: (stretches >= LEAST_STRETCHES).then_some(covariance),
    })
}
