//! Friction and inertia by nonlinear least squares of the acceleration (thesis 5.2, corrected).
//!
//! ```text
//! r_k = sqrt(w_k) [ I y_k − τ_k − τ_f(ω_k) ],   y_k = (ω_{k+1} − ω_{k−1})/(t_{k+1} − t_{k−1})
//! τ_f = −[ b ω + sgn(ω) B±(θ) (c + d exp(−(ω/ω_s)²)) ],   B± = 1 ± asymmetry + harmonics of θ
//! ```
//!
//! (5.1 and 5.3 to 5.6; the difference as printed, ω_{k+1} − ω_k over two steps, is half of the acceleration).
//! It needs no simulation and no liquid that moves: its torque is not in the equation. Starts come from linear least squares on a
//! grid of Stribeck speeds (`starts.rs`). The friction law does not hold while the hub sticks. Such rows enter only as residuals
//! of the gyro's bias. Without them the bias is known 20 times less well, and the choice of rows by bias and the bias from these
//! rows may alternate without an end. Rows closer than 10 ms are taken together first. The noise's share of the power of y grows
//! with the cube of the sampling rate. I (ω̄_{k+1} − ω̄_{k−1}) = T̄_{k+1} − T̄_{k−1} also holds for means over blocks of rows,
//! with T the integral of the torque. Three things make the estimate biased, and here each is dealt with:
//!
//! * y_k is the mean of the acceleration from t_{k−1} to t_{k+1}, less than its value at t_k by (Ωh)²/6:
//!   3.2 % at 3.5 Hz and 50 Hz sampling, which goes into I. [`Form::Averaged`] takes the mean of the torques over the same
//!   interval. The commanded torque is linear or held between rows; the friction follows the rates of the parabola through three
//!   rows, whose sign may change within it.
//! * The gyro's noise is in y_k, and I multiplies it: I comes out too small by the noise's share of the
//!   power of y. The residual is r_k/I instead: y_k is then what is explained, and its noise biases nothing, however large.
//! * Near ω = 0 the measured sign is not that of ω. Expected is the mean over the noise, erf(ω/σ√2) ≈ tanh(ω/1.25σ).

mod page;
mod starts;

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use analysis::statistics::{about_mean, mean, noise_level, peak, variance};
use anyhow::{Result, bail, ensure};
use host::fmu::Fmu;
use nalgebra::{DMatrix, DVector};
use names::hubslosh::{FrictionModel, SloshModel, friction, hub, slosh, tank};
use rayon::prelude::*;
use serde::Serialize;

use super::{Method, Needs, Task};
use crate::estimate::{Estimated, prose};
use crate::fit::covariance::{self, Covariance};
use crate::fit::decomposition;
use crate::input::plausible;
use crate::input::recording::Recording;
use crate::model::bench::nominal::{self, Nominal};
use crate::model::bench::unknown::Scale;
use crate::model::unknown;
use crate::news::News;
use crate::tuning::{
    ACCELERATION_MISFIT, ACCELERATION_REACH, BLOCK, CERTAIN_SIGN, DRIVING_FRICTION, FEWEST_BLOCKS,
    FREE_TORQUE, FRICTION_BINS, FRICTION_PARTS, GRID_STRIDE, LIKELIHOOD_END, MOVING_POWER,
    MOVING_SPEED, ONE_WAY, ROUGH_ROWS, SCORE_WINDOW, SHORT_CHANGE, STICKING_ROUNDS, TOLD_SHARE,
    VAGUE_STRIBECK,
};
use crate::uncertainty::bench::sources::{self, Combination, Sources, one_way};
use crate::words::identified::{Identified, Residual};
use crate::words::page::Sections;
use crate::words::start_study::{self, Trial};
use crate::words::verdict::DOES_NOT_FIT;
use analysis::least_squares::{self, Minimum};
use starts::State;

/// Weights of the rows (thesis 5.2.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weights {
    /// All rows alike.
    #[default]
    Uniform,
    /// Each row by the time it stands for: unevenly sampled rows.
    Time,
    /// Each recording alike, so that a long sweep does not outweigh a short manoeuvre.
    Run,
    /// Each recording alike, and each row in it by its time.
    RunTime,
}

/// Torques compared with the difference of rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Torques at t_k; the residual is the thesis's, r_k (5.4).
    AtRow,
    /// Mean torques from t_{k−1} to t_{k+1}; the residual is r_k/I.
    Averaged,
}

/// Options of the method.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Weights.
    pub weights: Weights,
    /// Bounds in place of the usual ones, by FMU name (`hub.I` stands for the whole inertia).
    pub bounds: Vec<(String, f64, f64)>,
    /// Starts besides those that are found in the data, by FMU name.
    pub starts: Vec<(String, f64)>,
    /// Harmonics of the hub's angle in the friction, 0 to 2; more than 0 needs the column theta.
    pub harmonics: usize,
    /// Known values of the bench, by FMU name.
    pub settings: Vec<(String, String)>,
    /// The torque keeps a row's value until the next, else it goes to the next along a line.
    pub held: bool,
    /// Relative standard deviation of the torque's scale, which no recording shows.
    pub torque_scale: f64,
    /// Relative standard deviation of the gyro's scale.
    pub gyro_scale: f64,
    /// Number of other starts of each unknown from which the fit is repeated.
    pub start_study: usize,
}

/// The result; `measurement` is the inertia of hub and all the liquid, and each recording's gyro bias.
pub type Found = Identified<Details>;

/// Results of this method alone.
#[derive(Clone, Debug, Serialize)]
pub struct Details {
    /// Sizes.
    pub fit: Fit,
    /// The same without any of the corrections above: 5.4 to 5.6 as they stand.
    pub uncorrected: BTreeMap<String, f64>,
    /// Unknowns that ended at a bound; their standard deviation is as if there were none. Such a result does not fit.
    pub at_bound: Vec<String>,
    /// Sums and products that are known where their terms are not.
    pub combinations: Vec<Combination>,
    /// Condition number of the sensitivities with columns of unit length.
    pub condition: f64,
    /// cond₂(J) in SI units, as the thesis states it.
    pub condition_si: f64,
    /// Braking against the angle in free decay (5.4), clockwise and counter-clockwise.
    pub braking: Vec<Braking>,
    /// Measured friction against the rate.
    pub friction_points: Vec<FrictionPoint>,
    /// Ends of searches from other starts, if requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub starts: Vec<Trial>,
}

/// Mean of τ − I ω' over rows of similar rate.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FrictionPoint {
    /// Mean rate, rad/s.
    pub rate: f64,
    /// Mean friction torque, N·m; positive if it brakes a positive rate.
    pub torque: f64,
    /// Number of rows.
    pub rows: usize,
}

/// Least squares of the acceleration.
pub struct Acceleration {
    /// Options of the method.
    pub options: Options,
}

impl Method for Acceleration {
    type Details = Details;

    const NEEDS: Needs = Needs { fmu: true, validation: false };

    fn identify(&self, task: &Task, _: &mut dyn FnMut(&News)) -> Result<Found> {
        let fmu = task.fmu()?;
        let found = identify(fmu, task.recordings, &self.options)?;
        let inertia = &found.measurement["inertia"];
        if inertia.std < VAGUE_STRIBECK * inertia.value {
            let nominal = Nominal::of(fmu, &self.options.settings, &[])?;
            plausible::check_size(inertia.value, nominal.inertia)?;
        }
        Ok(found)
    }

    fn lines(found: &Found) -> Vec<String> {
        let Details { fit, condition, condition_si, .. } = &found.details;
        let mut lines = vec![
            format!(
                "residual {:.2e} rad/s² (the gyro's noise makes {:.2e}), condition number {condition:.0} \
                 ({condition_si:.0} in SI units)",
                fit.rmse, fit.expected
            ),
            "correlations:".to_string(),
        ];
        for (name, row) in found.correlations.0.iter().zip(&found.correlations.1) {
            let row: Vec<String> = row.iter().map(|r| format!("{r:>6.2}")).collect();
            lines.push(format!("{name:24} {}", row.join(" ")));
        }
        lines
    }

    fn sections(found: &Found) -> Sections {
        page::sections(found)
    }
}

/// Sizes of a fit.
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// Rows that were used.
    pub rows: usize,
    /// Root mean square of the residual over I, rad/s².
    pub rmse: f64,
    /// Expected value from the gyro's noise, rad/s².
    pub expected: f64,
    /// The gyro's noise of one row, rad/s, for each recording.
    pub noise: Vec<f64>,
    /// Weights.
    pub weights: Weights,
}

/// α(θ) = β_0 + Σ β_h^s sin hθ + β_h^c cos hθ of one direction, where no torque acts (thesis 5.4).
#[derive(Clone, Debug, Serialize)]
pub struct Braking {
    /// `counter-clockwise` (forwards) or `clockwise`.
    pub direction: &'static str,
    /// Speed to which the fit belongs, rad/s: the mean of both directions. A parabola takes the dependence on the speed.
    pub speed: f64,
    /// β_0, then β_1^c, β_1^s, β_2^c, …, rad/s².
    pub coefficients: Vec<f64>,
    /// Their standard deviations, rad/s².
    pub std: Vec<f64>,
    /// Root mean square of the residual, rad/s².
    pub rmse: f64,
    /// Coefficient of determination.
    pub r_squared: f64,
    /// Rows.
    pub rows: usize,
    /// Stretches of these rows: parts of one decay within one revolution of the hub.
    pub stretches: usize,
    /// Angle (rad) and acceleration at `speed` (rad/s²) of each row.
    #[serde(skip)]
    pub points: Vec<(f64, f64)>,
    /// Covariance of the coefficients from the scatter between stretches; `None` if there are fewer than [`LEAST_STRETCHES`].
    #[serde(skip)]
    covariance: Option<DMatrix<f64>>,
}

/// Fewest stretches from whose scatter the uncertainty of five coefficients is computed.
pub const LEAST_STRETCHES: usize = 10;

/// Regressors of [`Braking`] at an angle: 1, then cos hθ and sin hθ of each harmonic.
fn harmonics_at(angle: f64, harmonics: usize) -> Vec<f64> {
    let each = (1..=harmonics).flat_map(|h| {
        let (sin, cos) = (angle * h as f64).sin_cos();
        [cos, sin]
    });
    [1.0].into_iter().chain(each).collect()
}

impl Braking {
    /// Returns the half-width of the fit's simultaneous 95 % band at an angle, rad/s²: with this probability the whole curve
    /// lies in the band. The residuals of one stretch count as one value, because deceleration also depends on the rate,
    /// which changes slowly within a stretch. `None` if there are too few
    /// stretches. Liang and Zeger, Biometrika 73 (1986) 13,
    /// with Scheffé's factor.
    pub fn half_width(&self, angle: f64) -> Option<f64> {
        /// 95 % quantile of χ² with five degrees of freedom.
        const CHI_SQUARE: f64 = 11.070;
        let width = self.coefficients.len();
        let row = DVector::from_vec(harmonics_at(angle, (width - 1) / 2));
        let variance = (row.transpose() * self.covariance.as_ref()? * &row)[(0, 0)];
        let few = (self.stretches - 1) as f64 / (self.stretches - width - 2) as f64;
        Some((CHI_SQUARE * few * variance).sqrt())
    }

    /// Returns the fitted acceleration at an angle, rad/s².
    pub fn at(&self, angle: f64) -> f64 {
        let [mean, harmonics @ ..] = &self.coefficients[..] else { return 0.0 };
        let each = harmonics.chunks(2).zip(1..).map(|(pair, h)| {
            let (sin, cos) = (f64::from(h) * angle).sin_cos();
            pair[0] * cos + pair[1] * sin
        });
        mean + each.sum::<f64>()
    }
}

/// Names of the first unknowns.
const FIRST: [&str; 6] =
    [hub::I, friction::B, friction::C, friction::D, friction::OMEGA_S, friction::ASYMMETRY];

/// Place of the Stribeck speed among them.
const STRIBECK: usize = 4;
/// Place of the asymmetry among them.
const ASYMMETRY: usize = 5;

/// A recording as means over blocks of rows; differenced are its rows 1 to n − 2.
#[derive(Clone)]
struct Rows {
    time: Vec<f64>,
    rate: Vec<f64>,
    torque: Vec<f64>,
    /// Integral of the torque, N·m·s.
    impulse: Vec<f64>,
    /// Angle in the middle of each block, rad.
    angle: Option<Vec<f64>>,
    /// Time between rows, s.
    step: f64,
    /// Standard deviation of the gyro's noise, rad/s.
    noise: f64,
    /// sqrt(w_k) of the rows 1 to n − 2; 0 where the hub sticks.
    weight: Vec<f64>,
    /// sqrt(w_k) of the rows where the hub rests, else 0.
    resting: Vec<f64>,
    /// sqrt(w_k) of all rows.
    all: Vec<f64>,
    /// Only every so many of them counts.
    every: usize,
    /// Reading at which the rate's slope falls by so much, rad/s and rad/s²: the gyro's bias, and the jump of the dry friction over
    /// the inertia.
    kink: (f64, f64),
}

impl Rows {
    /// `held`: the torque is held from row to row.
    fn new(recording: &Recording, held: bool) -> Self {
        let Recording { time: t, torque, .. } = recording;
        let block = ((BLOCK / recording.step() * (1.0 + 1e-9)) as usize).max(1);
        let means = |signal: &[f64]| -> Vec<f64> {
            signal.chunks_exact(block).map(analysis::statistics::mean).collect()
        };
        let mut impulse = vec![0.0];
        for k in 1..t.len() {
            let mean = if held { torque[k - 1] } else { 0.5 * (torque[k - 1] + torque[k]) };
            impulse.push(impulse[k - 1] + mean * (t[k] - t[k - 1]));
        }
        let rate = means(&recording.rate);
        let middle =
            |angle: &Vec<f64>| angle.chunks_exact(block).map(|part| part[block / 2]).collect();
        Rows {
            time: means(t),
            torque: means(torque),
            impulse: means(&impulse),
            angle: recording.angle.as_ref().map(middle),
            step: block as f64 * recording.step(),
            noise: noise_level(&rate).max(analysis::gauss_markov::FLOOR),
            weight: Vec::new(),
            resting: Vec::new(),
            all: Vec::new(),
            every: 1,
            kink: (0.0, 0.0),
            rate,
        }
    }

    fn inner(&self) -> std::iter::StepBy<std::ops::Range<usize>> {
        (1..self.time.len() - 1).step_by(self.every)
    }

    /// A signal's slope from t_{k−1} to t_{k+1}.
    fn slope(&self, signal: &[f64], k: usize) -> f64 {
        (signal[k + 1] - signal[k - 1]) / self.interval(k)
    }

    /// y_k.
    fn acceleration(&self, k: usize) -> f64 {
        self.slope(&self.rate, k)
    }

    /// τ_k, or its mean from t_{k−1} to t_{k+1}.
    fn torque(&self, form: Form, k: usize) -> f64 {
        match form {
            Form::AtRow => self.torque[k],
            Form::Averaged => self.slope(&self.impulse, k),
        }
    }

    /// Mean square of a residual over I from noise alone.
    fn noise_power(&self, k: usize) -> f64 {
        let weight = self.weight[k - 1] + self.resting[k - 1];
        2.0 * (weight * self.noise / self.interval(k)).powi(2)
    }

    /// Time from the row before to the one after, s.
    fn interval(&self, k: usize) -> f64 {
        self.time[k + 1] - self.time[k - 1]
    }

    /// Weight of a reading at rest, 1/s: its noise makes the residual that the noise of two readings makes of y_k.
    fn rest_weight(&self, k: usize) -> f64 {
        std::f64::consts::SQRT_2 * self.resting[k - 1] / self.interval(k)
    }

    /// Rates at the ends of equal parts of the interval, on the parabola through the three rows (Lagrange). The form at a row has one
    /// part without length. Where the rate passes through zero, its slope jumps by that of the dry friction over the inertia: without
    /// this kink the parabola passes late, and the inertia comes out too large by (hΩ/π)(dry friction over torque)², 3e-4 on the bench.
    fn rates(&self, form: Form, k: usize) -> ([f64; FRICTION_PARTS + 1], usize) {
        let mut rates = [self.rate[k]; FRICTION_PARTS + 1];
        if form == Form::AtRow {
            return (rates, 1);
        }
        let t = [k - 1, k, k + 1].map(|i| self.time[i]);
        let of = [k - 1, k, k + 1].map(|i| self.rate[i]);
        let parabola = |at: f64, values: [f64; 3]| {
            let [a, b, c] = t;
            (at - b) * (at - c) / ((a - b) * (a - c)) * values[0]
                + (at - a) * (at - c) / ((b - a) * (b - c)) * values[1]
                + (at - a) * (at - b) / ((c - a) * (c - b)) * values[2]
        };
        let (bias, jump) = self.kink;
        let passes = |i: usize| {
            let (from, to) = (of[i] - bias, of[i + 1] - bias);
            (from * to < 0.0).then(|| (t[i] + (t[i + 1] - t[i]) * from / (from - to), to.signum()))
        };
        let kink = match [passes(0), passes(1)] {
            [Some(kink), None] | [None, Some(kink)] => Some(kink),
            _ => None,
        };
        let bend = |at: f64| kink.map_or(0.0, |(zero, way)| -way * jump * (at - zero).max(0.0));
        let bends = t.map(bend);
        for (part, w) in rates.iter_mut().enumerate() {
            let at = t[0] + part as f64 / FRICTION_PARTS as f64 * (t[2] - t[0]);
            *w = parabola(at, of);
            if kink.is_some() {
                *w += bend(at) - parabola(at, bends);
            }
        }
        (rates, FRICTION_PARTS)
    }
}

/// Expected sign of the true rate over a part in which the measured one goes from `from` to `to` along a line, and its derivative
/// with respect to that rate. `width` is 1.25 standard deviations of the noise.
fn mean_sign(from: f64, to: f64, width: f64) -> (f64, f64) {
    let (a, b) = (from / width, to / width);
    if a.abs().min(b.abs()) > CERTAIN_SIGN && a * b > 0.0 {
        return (a.signum(), 0.0);
    }
    if (b - a).abs() < SHORT_CHANGE {
        let sign = (0.5 * (a + b)).tanh();
        return (sign, (1.0 - sign * sign) / width);
    }
    let ln_cosh = |x: f64| x.abs() + (-2.0 * x.abs()).exp().ln_1p();
    ((ln_cosh(b) - ln_cosh(a)) / (b - a), (b.tanh() - a.tanh()) / (to - from))
}

/// Size of the torque over that of the acceleration, kg·m².
fn rough_inertia(rows: &[Rows]) -> f64 {
    let size = |of: &dyn Fn(&Rows, usize) -> f64| {
        rows.iter().flat_map(|r| r.inner().map(|k| of(r, k).powi(2))).sum::<f64>().sqrt()
    };
    size(&|r, k| r.torque[k]) / size(&|r, k| r.acceleration(k))
}

#[derive(Clone)]
struct Problem {
    rows: Vec<Rows>,
    harmonics: usize,
    form: Form,
    scales: Vec<Scale>,
    names: Vec<String>,
    /// The hub turns one way alone, so the asymmetry stays zero.
    one_way: bool,
}

impl Problem {
    fn new(fmu: &Fmu, recordings: &[Recording], options: &Options, form: Form) -> Result<Self> {
        let mut rows: Vec<Rows> =
            recordings.iter().map(|recording| Rows::new(recording, options.held)).collect();
        let count: usize = rows.iter().map(|r| r.inner().len()).sum();
        let each_alike = matches!(options.weights, Weights::Run | Weights::RunTime);
        let timed = matches!(options.weights, Weights::Time | Weights::RunTime);
        let recordings = rows.len() as f64;
        for rows in &mut rows {
            let n = rows.inner().len() as f64;
            let each = if each_alike { count as f64 / n / recordings } else { 1.0 };
            let weight = rows.inner().map(|k| match timed {
                true => each * rows.interval(k) / (2.0 * rows.step),
                false => each,
            });
            rows.all = weight.map(f64::sqrt).collect();
            rows.weight.clone_from(&rows.all);
            rows.resting = vec![0.0; rows.all.len()];
        }
        let largest = |of: &dyn Fn(&Rows) -> f64| rows.iter().map(of).fold(0.0, f64::max);
        let torque = largest(&|r| peak(&r.torque));
        // whatever the gyro's bias
        let reading = largest(&|r| peak(&r.rate));
        let speed = largest(&|r| peak(&about_mean(&r.rate)));
        let inertia = rough_inertia(&rows);
        let mut names: Vec<String> = FIRST.map(String::from).to_vec();
        let mut bounds = vec![
            (0.0, 30.0 * inertia),
            (0.0, 10.0 * torque / speed),
            (0.0, torque),
            (0.0, torque),
            (1e-3 * speed, 10.0 * speed),
            (-1.0, 1.0),
        ];
        for way in ["forward", "backward"] {
            for h in 1..=options.harmonics {
                for trig in ["cos", "sin"] {
                    names.push(format!("friction.{way}_{trig}{h}"));
                    bounds.push((-1.0, 1.0));
                }
            }
        }
        for i in 0..rows.len() {
            names.push(format!("gyro_bias[{}]", i + 1));
            bounds.push((-reading, reading));
        }
        for (place, name) in names.iter().enumerate().skip(1) {
            let Ok(variable) = fmu.description().variable(name) else { continue };
            let [low, high] = unknown::range(variable);
            let (least, most) = bounds[place];
            bounds[place] = (least.max(low), most.min(high));
            ensure!(
                bounds[place].0 < bounds[place].1,
                "torque and rate imply {name} of {least:.2e} to {most:.2e} (allowed by the FMU: {low} to {high}): check their \
                 units"
            );
        }
        for (name, low, high) in &options.bounds {
            let Some(place) = names.iter().position(|n| n == name) else {
                bail!("there is no bound to set for {name} (there are {})", names.join(", "))
            };
            ensure!(low < high, "{name}: the lower bound {low} is not below the upper one {high}");
            bounds[place] = (*low, *high);
        }
        let scales = bounds.into_iter().map(|(a, b)| Scale::Logit(a, b)).collect();
        Ok(Problem { rows, harmonics: options.harmonics, form, scales, names, one_way: false })
    }

    /// The same with so many rows, or a few more, taken evenly.
    fn thinned(&self, rows: usize) -> Self {
        let mut thinned = self.clone();
        let every = (self.count() / rows).max(1);
        thinned.rows.iter_mut().for_each(|rows| rows.every = every);
        thinned
    }

    fn values(&self, x: &[f64]) -> Vec<f64> {
        self.scales.iter().zip(x).map(|(scale, x)| scale.value(*x)).collect()
    }

    /// A value within its bounds.
    fn bounded(&self, place: usize, value: f64) -> f64 {
        match self.scales[place] {
            Scale::Logit(a, b) => value.clamp(a, b),
            _ => value,
        }
    }

    /// A value a little within its bounds, where its variable is finite.
    fn inside(&self, place: usize, value: f64) -> f64 {
        match self.scales[place] {
            Scale::Logit(a, b) => value.clamp(a + 1e-4 * (b - a), b - 1e-4 * (b - a)),
            _ => value,
        }
    }

    /// Leaves out the rows of a hub that sticks by these biases; where it rests, they show the bias. Returns true if that changes
    /// anything.
    fn leave_out_stuck(&mut self, biases: &[f64]) -> bool {
        let mut changed = false;
        for (rows, bias) in self.rows.iter_mut().zip(biases) {
            let states = rows.states(*bias);
            let weights_in = |state: State| -> Vec<f64> {
                let inner = states[1..].iter().zip(&rows.all);
                inner.map(|(of, weight)| if *of == state { *weight } else { 0.0 }).collect()
            };
            let (weight, resting) = (weights_in(State::Slips), weights_in(State::Rests));
            changed |= weight != rows.weight || resting != rows.resting;
            (rows.weight, rows.resting) = (weight, resting);
        }
        changed
    }

    /// Places the kinks of the rates by the values p.
    fn place_kinks(&mut self, p: &[f64]) {
        let (jump, first) = (2.0 * (p[2] + p[3]) / p[0], p.len() - self.rows.len());
        for (rows, bias) in self.rows.iter_mut().zip(&p[first..]) {
            rows.kink = (*bias, jump);
        }
    }

    /// The biases among the values.
    fn biases<'p>(&self, p: &'p [f64]) -> &'p [f64] {
        &p[p.len() - self.rows.len()..]
    }

    /// Rows that count.
    fn used(&self) -> usize {
        let of = |rows: &Rows| {
            rows.inner().filter(|k| rows.weight[k - 1] + rows.resting[k - 1] > 0.0).count()
        };
        self.rows.iter().map(of).sum()
    }

    /// Mean of −τ_f over a part near row i with these measured rates at its ends; its derivatives with respect to the values p are
    /// added to `slope`. The expected factor is linear in the expected sign, since the square of a sign is 1.
    fn friction(
        &self,
        p: &[f64],
        rows: &Rows,
        (bias, i, rates): (usize, usize, [f64; 2]),
        slope: &mut [f64],
    ) -> f64 {
        let [_, b, c, d, speed, asymmetry] = [p[0], p[1], p[2], p[3], p[4], p[5]];
        let [from, to] = rates.map(|rate| rate - p[bias]);
        let w = 0.5 * (from + to);
        let (sign, sign_slope) = mean_sign(from, to, 1.25 * rows.noise);
        let shape = (-(w / speed).powi(2)).exp();
        let dry = c + d * shape;
        let (mut factor, mut factor_by_sign) = (sign + asymmetry, 1.0);
        let per_way = 2 * self.harmonics;
        if let (Some(angle), true) = (&rows.angle, self.harmonics > 0) {
            let (forwards, backwards) = ((1.0 + sign) / 2.0, (1.0 - sign) / 2.0);
            for h in 0..self.harmonics {
                let (sin, cos) = (angle[i] * (h + 1) as f64).sin_cos();
                for (k, trig) in [cos, sin].into_iter().enumerate() {
                    let (ahead, back) = (6 + 2 * h + k, 6 + per_way + 2 * h + k);
                    factor += trig * (p[ahead] * forwards - p[back] * backwards);
                    factor_by_sign += trig * (p[ahead] + p[back]) / 2.0;
                    slope[ahead] += dry * trig * forwards;
                    slope[back] -= dry * trig * backwards;
                }
            }
        }
        let shape_slope = 2.0 * w * d * shape / (speed * speed);
        slope[1] += w;
        slope[2] += factor;
        slope[3] += factor * shape;
        slope[4] += factor * shape_slope * w / speed;
        slope[5] += dry;
        slope[bias] -= b + sign_slope * dry * factor_by_sign - factor * shape_slope;
        b * w + factor * dry
    }

    /// Residuals at the values p and, if asked for, their derivatives.
    fn evaluate(&self, p: &[f64], mut jacobian: Option<&mut DMatrix<f64>>) -> Vec<f64> {
        let n = p.len();
        let (mut residuals, mut slopes) = (Vec::new(), vec![0.0; n]);
        for (index, rows) in self.rows.iter().enumerate() {
            let bias = n - self.rows.len() + index;
            for k in rows.inner() {
                if rows.weight[k - 1] == 0.0 {
                    let weight = match self.form {
                        Form::AtRow => 0.0,
                        Form::Averaged => rows.rest_weight(k),
                    };
                    if let Some(jacobian) = jacobian.as_deref_mut() {
                        jacobian[(residuals.len(), bias)] = -weight;
                    }
                    residuals.push(weight * (rows.rate[k] - p[bias]));
                    continue;
                }
                let (rates, parts) = rows.rates(self.form, k);
                slopes.fill(0.0);
                let mut friction = 0.0;
                for ends in rates.windows(2).take(parts) {
                    friction += self.friction(p, rows, (bias, k, [ends[0], ends[1]]), &mut slopes);
                }
                let (weight, y) = (rows.weight[k - 1], rows.acceleration(k));
                let torque = rows.torque(self.form, k);
                let acting = torque - friction / parts as f64;
                let (over, slope) = match self.form {
                    Form::AtRow => (1.0, y),
                    Form::Averaged => (p[0], acting / (p[0] * p[0])),
                };
                if let Some(jacobian) = jacobian.as_deref_mut() {
                    let row = residuals.len();
                    jacobian[(row, 0)] = weight * slope;
                    for j in 1..n {
                        jacobian[(row, j)] = weight * slopes[j] / parts as f64 / over;
                    }
                }
                residuals.push(weight * (p[0] * y - acting) / over);
            }
        }
        residuals
    }

    fn count(&self) -> usize {
        self.rows.iter().map(|r| r.inner().len()).sum()
    }

    /// Derivatives with respect to the values.
    fn jacobian(&self, p: &[f64]) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(self.count(), p.len());
        self.evaluate(p, Some(&mut jacobian));
        jacobian
    }

    /// Returns true if a search moves a variable.
    fn is_free(&self, held: &[usize], place: usize) -> bool {
        !held.contains(&place) && (!self.one_way || place != ASYMMETRY)
    }

    /// The best of the minima from these starts, without moving the variables `held`.
    fn solve(&self, starts: &[Vec<f64>], held: &[usize]) -> Minimum {
        self.solve_to(starts, held, 1e-9)
    }

    /// The same to a relative tolerance of the sum of squares and of x.
    fn solve_to(&self, starts: &[Vec<f64>], held: &[usize], tolerance: f64) -> Minimum {
        let method = least_squares::tolerances(tolerance, tolerance);
        let residuals = |x: &[f64]| self.evaluate(&self.values(x), None);
        let derivatives = |x: &[f64]| {
            let mut jacobian = self.jacobian(&self.values(x));
            for (j, mut column) in jacobian.column_iter_mut().enumerate() {
                column *= if self.is_free(held, j) { self.scales[j].slope(x[j]) } else { 0.0 };
            }
            Some(jacobian)
        };
        let minima = starts
            .iter()
            .map(|start| least_squares::minimise_by(&method, &residuals, &derivatives, start));
        let best = minima.min_by(|a, b| a.cost.total_cmp(&b.cost));
        best.expect("there is a start")
    }

    /// Returns estimates and covariance of the variables that are not `held`; `None` if some combination has no influence.
    ///
    /// # Errors
    /// If a derivative is not finite.
    fn known(&self, minimum: &Minimum, held: &[usize]) -> Result<Option<Known>> {
        let p = self.values(&minimum.x);
        // how sure the others are must not depend on a value that only a bound keeps from going on
        let whole = self.jacobian(&p);
        let free = |j: &usize| self.is_free(held, *j);
        let all = (0..p.len()).filter(free);
        let acting = all.clone().filter(|&j| whole.column(j).norm() > 0.0).collect();
        let inner = all.filter(|&j| !self.is_at_bound(j, p[j])).collect();
        let e = self.evaluate(&p, None);
        let of = |shown: Vec<usize>| -> Result<Option<Known>> {
            let jacobian = whole.select_columns(&shown);
            let names: Vec<String> = shown.iter().map(|&j| self.names[j].clone()).collect();
            let Some(covariance) = Covariance::of(&jacobian, &names)? else { return Ok(None) };
            let noise = &covariance.x * self.noise_scores(&jacobian) * &covariance.x;
            let sandwich = covariance.sandwich(&jacobian, &e, &windows(self));
            let scatter = Sources::least(&noise, &sandwich);
            let of_values = covariance::spread_out(&scatter, &shown, p.len());
            Ok(Some(Known { covariance, jacobian, shown, scatter, of_values }))
        };
        Ok(match of(acting)? {
            None => of(inner)?,
            known => known,
        })
    }

    /// Covariance of the sum of scores Jᵀe due to the gyro's white noise. The noise of one row enters the differences of both
    /// neighbouring rows, with opposite signs, and its own reading at rest. The sandwich alone says too little of what shows in a
    /// few windows, as d does.
    fn noise_scores(&self, jacobian: &DMatrix<f64>) -> DMatrix<f64> {
        let n = jacobian.ncols();
        let (mut sum, mut first) = (DMatrix::zeros(n, n), 0);
        for rows in &self.rows {
            let count = rows.inner().len();
            // row i of the recording is the difference i − 1 of the inner rows
            let score = |k: usize, weight: f64| jacobian.row(first + k) * (weight * rows.noise);
            let sloped = |k: usize| score(k, rows.weight[k] / rows.interval(k + 1));
            for i in 1..count.saturating_sub(1) {
                let of_row = sloped(i - 1) - sloped(i + 1) + score(i, rows.rest_weight(i + 1));
                sum += of_row.transpose() * of_row;
            }
            first += count;
        }
        sum
    }

    /// Rates in the rows that count, less the bias, in any unit.
    fn turned(&self, x: &[f64]) -> Vec<f64> {
        let biases = self.biases(&self.values(x)).to_vec();
        let of = |(rows, bias): (&Rows, f64)| {
            let one = |k: usize| rows.weight[k - 1] * (rows.rate[k] - bias);
            rows.inner().map(one).collect::<Vec<f64>>()
        };
        self.rows.iter().zip(biases).flat_map(of).collect()
    }

    /// Minima at the Stribeck speeds of the grid, and the 95 % intervals of b, c, d and ω_s over them.
    fn profile(&self, minimum: &Minimum, held: &[usize]) -> Result<Profile> {
        let held: Vec<usize> = held.iter().copied().chain([STRIBECK]).collect();
        let p = self.values(&minimum.x);
        let biases = self.biases(&p);
        let [low, high] = [f64::NEG_INFINITY, f64::INFINITY].map(|end| self.bounded(STRIBECK, end));
        let mut points = vec![minimum.clone()];
        for (speed, (linear, _)) in self.grid(biases).into_iter().step_by(GRID_STRIDE) {
            let start = self.start(speed.clamp(low, high), &linear, biases);
            let mut x = off_the_bounds(&minimum.x);
            (1..=STRIBECK).for_each(|place| x[place] = start[place]);
            points.push(self.solve_to(&[x], &held, 1e-6));
        }
        let speed = |point: &Minimum| self.values(&point.x)[STRIBECK];
        points.sort_by(|a, b| speed(a).total_cmp(&speed(b)));
        let least = points.iter().map(|point| point.cost).fold(f64::INFINITY, f64::min);
        let variance = least / self.used().max(1) as f64;
        let is_in: Vec<bool> =
            points.iter().map(|point| point.cost - least < LIKELIHOOD_END * variance).collect();
        let mut intervals = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
        for (point, _) in points.iter().zip(&is_in).filter(|(_, is_in)| **is_in) {
            let (p, known) = (self.values(&point.x), self.known(point, &held)?);
            for (k, interval) in intervals.iter_mut().enumerate() {
                let std =
                    known.as_ref().map_or(0.0, |known| known.of_values[(k + 1, k + 1)].sqrt());
                let end = |side: f64| self.bounded(k + 1, p[k + 1] + side * 1.96 * std);
                *interval = [interval[0].min(end(-1.0)), interval[1].max(end(1.0))];
            }
        }
        // to the neighbours that are out, for the interval ends somewhere between
        let first = is_in.iter().position(|is_in| *is_in).unwrap_or(0);
        let last = is_in.iter().rposition(|is_in| *is_in).unwrap_or(0);
        let end = |k: Option<usize>, bound: f64| k.and_then(|k| points.get(k)).map_or(bound, speed);
        let speeds = [end(first.checked_sub(1), low), end(Some(last + 1), high)];
        Ok(Profile { points, intervals, speeds })
    }

    /// Ends of searches that start with one unknown off its estimate; `square` is the mean square of the residual. The gyro's biases
    /// start at their estimates.
    fn start_study(&self, minimum: &Minimum, count: usize, square: f64) -> Vec<Trial> {
        let p = self.values(&minimum.x);
        let first = off_the_bounds(&minimum.x);
        let of = |(place, factor): (usize, f64)| {
            let mut x = first.clone();
            x[place] = self.scales[place].variable(self.inside(place, factor * p[place]));
            let found = self.solve(&[x], &[]);
            let end = self.values(&found.x)[place] / p[place];
            Trial {
                name: self.names[place].clone(),
                start: factor,
                end: Some(end),
                more: Some((found.cost - minimum.cost) / square),
            }
        };
        let starts = start_study::starts(count, ACCELERATION_REACH);
        let all: Vec<(usize, f64)> =
            (0..=STRIBECK).flat_map(|place| starts.iter().map(move |s| (place, *s))).collect();
        all.into_par_iter().map(of).collect()
    }

    /// Measured friction, mean torque less I y, over rows of similar rate in which the hub slips.
    fn friction_points(&self, p: &[f64]) -> Vec<FrictionPoint> {
        let (count, fewest) = FRICTION_BINS;
        let mut all: Vec<(f64, f64)> = Vec::new();
        for (rows, bias) in self.rows.iter().zip(self.biases(p)) {
            let slips = rows.inner().filter(|k| rows.weight[k - 1] > 0.0);
            all.extend(slips.map(|k| {
                (rows.rate[k] - bias, rows.torque(self.form, k) - p[0] * rows.acceleration(k))
            }));
        }
        let most = all.iter().map(|(w, _)| w.abs()).fold(f64::MIN_POSITIVE, f64::max);
        // finer near zero, where friction changes most
        let bin =
            |w: f64| (w.signum() * (w.abs() / most).sqrt() * count as f64 / 2.0).round() as i64;
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

    /// Measured acceleration and residual of the rows in which the hub slips; `e`: weighted residuals.
    fn residuals(&self, recordings: &[Recording], e: &[f64]) -> Vec<Residual> {
        let mut first = 0;
        let of = |(rows, recording): (&Rows, &Recording)| {
            let used = |k: &usize| rows.weight[k - 1] > 0.0;
            let inner: Vec<usize> = rows.inner().filter(used).collect();
            let residual = inner.iter().map(|k| e[first + k - 1] / rows.weight[k - 1]).collect();
            first += rows.inner().len();
            Residual {
                name: recording.name.clone(),
                label: "rad/s²".into(),
                time: inner.iter().map(|k| rows.time[*k]).collect(),
                measured: inner.iter().map(|k| rows.acceleration(*k)).collect(),
                residual,
                // differences of white noise are not white
                noise: None,
                torque: None,
            }
        };
        self.rows.iter().zip(recordings).map(of).collect()
    }

    /// Mean of the sum of w_k y_k² from the gyro's noise.
    fn noise_power(&self) -> f64 {
        self.rows.iter().flat_map(|rows| rows.inner().map(|k| rows.noise_power(k))).sum()
    }

    /// Returns true if a value of b, c or d is zero, the lowest possible.
    fn is_zero(&self, place: usize, value: f64) -> bool {
        let least = self.bounded(place, f64::NEG_INFINITY);
        let half = 0.5 * self.bounded(place, f64::INFINITY);
        (1..=3).contains(&place) && least == 0.0 && value < half && self.is_at_bound(place, value)
    }

    /// Returns true if a value is at one of its bounds.
    fn is_at_bound(&self, place: usize, value: f64) -> bool {
        match self.scales[place] {
            Scale::Logit(a, b) => (value - a).min(b - value) < 1e-5 * (b - a),
            _ => false,
        }
    }
}

/// Information at a minimum.
struct Known {
    covariance: Covariance,
    jacobian: DMatrix<f64>,
    /// Places of its columns.
    shown: Vec<usize>,
    /// Covariance of the values of these.
    scatter: DMatrix<f64>,
    /// The same of all values, with zeros for the others.
    of_values: DMatrix<f64>,
}

/// Minima along the Stribeck speed.
struct Profile {
    points: Vec<Minimum>,
    /// 95 % intervals of b, c and d.
    intervals: [[f64; 2]; 3],
    /// 95 % interval of ω_s, rad/s.
    speeds: [f64; 2],
}

/// Places and values of the user's starts.
fn given(problem: &Problem, options: &Options, liquid: f64) -> Result<Vec<(usize, f64)>> {
    let one = |(name, value): &(String, f64)| {
        let Some(place) = problem.names.iter().position(|n| n == name) else {
            bail!("there is no start to give for {name} (there are {})", problem.names.join(", "))
        };
        ensure!(value.is_finite(), "{name}: the start {value} is not a finite number");
        Ok((place, if place == 0 { value + liquid } else { *value }))
    };
    options.starts.iter().map(one).collect()
}

/// Estimates friction and inertia from recordings whose liquid does not move.
pub fn identify(fmu: &Fmu, recordings: &[Recording], options: &Options) -> Result<Found> {
    ensure!(!recordings.is_empty(), "there is no recording");
    let own: Vec<Recording> = recordings.iter().map(|r| r.of_gyro().into_owned()).collect();
    let recordings = &own[..];
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
    let moves = |r: &Recording| variance(&r.rate) > MOVING_POWER * r.rate_noise().powi(2);
    ensure!(
        recordings.iter().any(moves),
        "{}: the hub does not move: the rate is constant but for the gyro's noise. Static friction holds it up to the largest torque, \
         {torque:.1e} N·m; record more torque",
        names()
    );
    ensure!(
        options.harmonics <= 2,
        "the FMU has 2 harmonics of the angle, not {}",
        options.harmonics
    );
    if let (true, Some(without)) =
        (options.harmonics > 0, recordings.iter().find(|r| r.angle.is_none()))
    {
        bail!("{}: harmonics of the angle need the column theta (rad)", without.name);
    }
    let mut bench = nominal::initialised(fmu, &options.settings)?;
    // it turns with the hub, all of it
    let liquid = bench.real(tank::M_LIQ)? * bench.real(tank::R)?.powi(2);
    let mut plain = Problem::new(fmu, recordings, options, Form::AtRow)?;
    let given = given(&plain, options, liquid)?;
    let rests = plain.readings_at_rest();
    let biases = plain.rough_biases(&rests);
    plain.leave_out_stuck(&biases);
    plain.one_way = !plain.turns_both_ways(&biases);
    let rough = plain.thinned(ROUGH_ROWS);
    let starts = rough.starts(&biases, &given);
    ensure!(!starts.is_empty(), "inertia and friction have no influence on the recording");
    let start = rough.solve_to(&starts, &[], 1e-4);
    let near = plain.solve_to(&[off_the_bounds(&start.x)], &[], 1e-6);
    let uncorrected = plain.values(&near.x);
    let mut problem = Problem::new(fmu, recordings, options, Form::Averaged)?;
    problem.one_way = plain.one_way;
    // a fit at rows has no residuals of the rest, so its bias may be far off if the hub turns one way: then no row would be at rest
    let (mut first, mut x) = (uncorrected.clone(), off_the_bounds(&near.x));
    let place = first.len() - rests.len();
    for (place, rest) in (place..).zip(&rests) {
        if let Some(rest) = rest {
            first[place] = *rest;
            x[place] = problem.scales[place].variable(problem.inside(place, *rest));
        }
    }
    problem.leave_out_stuck(problem.biases(&first).to_vec().as_slice());
    problem.place_kinks(&first);
    let mut minimum = problem.solve_to(&[x, starts[0].clone()], &[], 1e-6);
    for _ in 0..STICKING_ROUNDS {
        let p = problem.values(&minimum.x);
        if !problem.leave_out_stuck(problem.biases(&p).to_vec().as_slice()) {
            break;
        }
        problem.place_kinks(&p);
        minimum = problem.solve_to(&[off_the_bounds(&minimum.x)], &[], 1e-6);
    }
    minimum = problem.solve(&[off_the_bounds(&minimum.x)], &[]);
    let mut held = Vec::new();
    let mut known = problem.known(&minimum, &held)?;
    let turned = problem.turned(&minimum.x);
    let way = if turned.iter().sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
    let is_vague = |known: &Option<Known>, place: usize, part: f64| {
        known.as_ref().is_none_or(|known| {
            !known.shown.contains(&place) || known.of_values[(place, place)].sqrt() > part
        })
    };
    // if the friction of a hub that turns both ways is small, its asymmetry is vague, too
    let turns_one_way = || known.is_none() || sources::way(turned.into_iter()).is_some();
    if !problem.one_way && is_vague(&known, ASYMMETRY, ONE_WAY) && turns_one_way() {
        // the dry friction of one direction alone is seen: that of both is as large
        let mut x = off_the_bounds(&minimum.x);
        let factor = 1.0 + way * problem.values(&x)[ASYMMETRY];
        for place in [2, 3] {
            let value = problem.scales[place].value(x[place]) * factor;
            x[place] = problem.scales[place].variable(problem.inside(place, value));
        }
        x[ASYMMETRY] = problem.scales[ASYMMETRY].variable(problem.inside(ASYMMETRY, 0.0));
        problem.one_way = true;
        minimum = problem.solve(&[x], &held);
        known = problem.known(&minimum, &held)?;
    }
    let values = problem.values(&minimum.x);
    let vague = |place: usize| is_vague(&known, place, VAGUE_STRIBECK * values[place]);
    let is_profiled = vague(3) || vague(STRIBECK);
    let profile = is_profiled.then(|| problem.profile(&minimum, &held)).transpose()?;
    if let Some(profile) = &profile {
        // where a bound alone keeps friction or speed from going on, a minimum within the bounds may explain the recording as well
        let is_inside = |x: &[f64]| {
            let p = problem.values(x);
            [2, 3, STRIBECK]
                .iter()
                .all(|&j| problem.is_zero(j, p[j]) || !problem.is_at_bound(j, p[j]))
        };
        if !is_inside(&minimum.x) {
            let inner = profile.points.iter().filter(|point| is_inside(&point.x));
            if let Some(point) = inner.min_by(|a, b| a.cost.total_cmp(&b.cost)) {
                minimum = point.clone();
            }
        }
        if !held.contains(&STRIBECK) {
            held.push(STRIBECK);
        }
        known = problem.known(&minimum, &held)?;
    }
    let p = problem.values(&minimum.x);
    let n = p.len();
    let Some(Known { covariance, jacobian, shown, scatter, mut of_values }) = known else {
        bail!("some combination of inertia and friction has no influence on the recording")
    };
    let e = problem.evaluate(&p, None);
    // a bearing may have no such friction at all, but it has none that drives the hub
    let newton = covariance::spread_out(&covariance.x, &shown, n)
        * problem.jacobian(&p).tr_mul(&DVector::from_column_slice(&e));
    let is_none = |j: usize| {
        problem.is_zero(j, p[j]) && p[j] - newton[j] > -DRIVING_FRICTION * of_values[(j, j)].sqrt()
    };
    let at_bound: Vec<bool> =
        (0..n).map(|j| problem.is_at_bound(j, p[j]) && !held.contains(&j) && !is_none(j)).collect();
    let correlations = Covariance::correlations(&scatter);
    let root_mean = |sum: f64| (sum / e.len() as f64).sqrt();
    let rms = root_mean(e.iter().map(|e| e * e).sum());
    let expected = root_mean(problem.noise_power());
    let fits = rms < ACCELERATION_MISFIT * expected && !at_bound.contains(&true);
    let sum_of_dry = (of_values[(2, 2)] + of_values[(3, 3)] + 2.0 * of_values[(2, 3)]).max(0.0);
    if let Some(profile) = &profile {
        for (place, [low, high]) in (1..=3).zip(profile.intervals) {
            let reach = (high - p[place]).max(p[place] - low) / 1.96;
            of_values[(place, place)] = of_values[(place, place)].max(reach * reach);
        }
    }
    let of_noise = of_values.diagonal();
    // both scales act exactly: I, b, c and d go with the torque's, I and b with the inverse of the gyro's, ω_s with it
    let by_torque = |j: usize| if j <= 3 { options.torque_scale * p[j] } else { 0.0 };
    let by_gyro = |j: usize| match j {
        0 | 1 => -options.gyro_scale * p[j],
        STRIBECK => options.gyro_scale * p[j],
        _ => 0.0,
    };
    for j in 0..n {
        of_values[(j, j)] += by_torque(j).powi(2) + by_gyro(j).powi(2);
    }
    let sum_of_dry = sum_of_dry + (by_torque(2) + by_torque(3)).powi(2);
    let estimated = |j: usize, less: f64| {
        let std = of_values[(j, j)].sqrt();
        let end = |side: f64| problem.bounded(j, p[j] + side * 1.96 * std) - less;
        let interval = [end(-1.0), end(1.0)];
        let estimated = Estimated::normal(p[j] - less, std, unit(&problem.names[j]));
        // a friction is known if it is known to half its size
        let determined = !(1..=STRIBECK).contains(&j) || std < 0.5 * p[j];
        Estimated { std_noise: of_noise[j].sqrt(), interval, determined, ..estimated }
    };
    let (mut parameters, mut measurement) = (BTreeMap::new(), BTreeMap::new());
    for (j, name) in problem.names.iter().enumerate() {
        if name.starts_with("gyro_bias") {
            measurement.insert(name.clone(), estimated(j, 0.0));
        } else {
            parameters.insert(name.clone(), estimated(j, if j == 0 { liquid } else { 0.0 }));
        }
    }
    measurement.insert("inertia".into(), estimated(0, 0.0));
    let states_liquid = nominal::states_liquid(&options.settings);
    if !states_liquid {
        // anything from no liquid to no hub has this inertia
        let whole = measurement["inertia"].interval[1];
        let hub = parameters.get_mut(hub::I).expect("one of the first");
        hub.interval = [0.0, whole.max(hub.value)];
        hub.std = hub.std.max(hub.interval[1] / 12.0_f64.sqrt());
        hub.determined = false;
    }
    let mut combinations = Vec::new();
    let may_have_none = parameters["friction.d"].interval[0] <= 0.0;
    if let Some(profile) = &profile {
        let speed = parameters.get_mut(friction::OMEGA_S).expect("one of the first");
        // without an excess of the friction at rest there is no speed at which it vanishes
        let bounds = [f64::NEG_INFINITY, f64::INFINITY].map(|end| problem.bounded(STRIBECK, end));
        speed.interval = if may_have_none { bounds } else { profile.speeds };
        speed.std = (speed.interval[1] - speed.interval[0]) / 12.0_f64.sqrt();
        speed.determined = !may_have_none && speed.std < 0.5 * speed.value;
        if !parameters["friction.c"].determined && !parameters["friction.d"].determined {
            combinations.push(Combination {
                name: "friction.c + friction.d".into(),
                of: [friction::C, friction::D].map(String::from),
                value: p[2] + p[3],
                std: sum_of_dry.sqrt(),
                unit: "N.m".into(),
                correlation: -1.0,
            });
        }
    }
    if problem.one_way {
        let bounds = [f64::NEG_INFINITY, f64::INFINITY].map(|end| problem.bounded(ASYMMETRY, end));
        combinations.extend(one_way(&mut parameters, way, bounds));
    }
    let named = |keep: &dyn Fn(usize) -> bool| -> Vec<String> {
        (0..n).filter(|&j| keep(j)).map(|j| problem.names[j].clone()).collect()
    };
    let si = decomposition::singular(jacobian.clone().qr().r())?.singular_values;
    let mut settings: BTreeMap<String, String> = options.settings.iter().cloned().collect();
    settings.insert(slosh::MODEL.into(), SloshModel::Frozen.name().into());
    settings.insert(friction::MODEL.into(), FrictionModel::Stribeck.name().into());
    let mut uncorrected: BTreeMap<String, f64> =
        problem.names.iter().cloned().zip(uncorrected).collect();
    uncorrected.entry(hub::I.into()).and_modify(|inertia| *inertia -= liquid);
    let braking = brakings(recordings, problem.biases(&p));
    let starts = problem.start_study(&minimum, options.start_study, rms * rms);
    let rests = problem.rows.iter().any(|rows| rows.resting.iter().any(|weight| *weight > 0.0));
    let share = |j: usize| (of_values[(j, j)] - of_noise[j]) / of_values[(j, j)];
    let shares: Vec<String> = (0..n)
        .filter(|j| of_noise[*j] > 0.0 && share(*j) > TOLD_SHARE)
        .map(|j| format!("{} {:.0} %", problem.names[j], 100.0 * share(j)))
        .collect();
    let assumed = nominal::assumed(fmu, &options.settings, &nominal::LIQUID)?;
    let mut remarks = vec![match (states_liquid, liquid < NO_LIQUID * p[0]) {
        (false, _) => format!(
            "hub.I is not known: the recordings show the inertia of hub and liquid, {:.4e} kg·m², and nothing states how much liquid is \
             in the tank. --empty states that there is none, --set tank.h=… its height. The value is for the liquid of the FMU, \
             {liquid:.3e} kg·m²: {assumed}.",
            p[0]
        ),
        (true, true) => "The tank is taken as empty: all inertia is the hub's.".into(),
        (true, false) => format!(
            "hub.I is the inertia less that of the liquid, {liquid:.4e} kg·m², which counts as exact: {assumed}."
        ),
    }];
    if !shares.is_empty() {
        remarks.push(format!(
            "The intervals include tolerances that no recording shows: scale of the torque {} %, scale of the gyro {} %. Their share of \
             the variance: {}. --tolerance torque=… and --gyro-scale of identify set them, tolerance and gyro_scale in day.toml.",
            100.0 * options.torque_scale,
            100.0 * options.gyro_scale,
            shares.join(", ")
        ));
    }
    if !rests {
        remarks.push(
            "No recording shows the hub at rest: the gyro's bias and the friction near zero speed come from passages through zero \
             alone. Begin a recording with some seconds without torque, and ramp the torque up until the hub breaks away."
                .into(),
        );
    }
    remarks.extend(start_study::words(&starts));
    let details = Details {
        friction_points: problem.friction_points(&p),
        starts,
        fit: Fit {
            rows: problem.used(),
            rmse: rms,
            expected,
            noise: problem.rows.iter().map(|r| r.noise).collect(),
            weights: options.weights,
        },
        uncorrected,
        at_bound: named(&|j| at_bound[j]),
        combinations,
        condition: covariance.condition,
        condition_si: si.max() / si.min(),
        braking,
    };
    let mut found = Found {
        parameters,
        measurement,
        settings,
        correlations: (named(&|j| shown.contains(&j)), correlations),
        converged: minimum.converged,
        fits: Some(fits),
        residuals: problem.residuals(recordings, &e),
        ..Found::new(details)
    };
    found.verdict = words(&found, &problem, &p);
    found.verdict.extend(remarks);
    Ok(found)
}

/// Part of the inertia below which the liquid's counts as none.
const NO_LIQUID: f64 = 1e-6;

/// Returns a start from the end of a search. At a bound a variable hardly changes its value any more, so the start lies inside: a
/// logit of 6 is a four-hundredth of the range off.
fn off_the_bounds(x: &[f64]) -> Vec<f64> {
    x.iter().map(|x| x.clamp(-6.0, 6.0)).collect()
}

fn unit(name: &str) -> &'static str {
    match name {
        hub::I => "kg.m2",
        friction::B => "N.m.s",
        friction::C | friction::D => "N.m",
        friction::OMEGA_S => "rad/s",
        _ if name.starts_with("gyro_bias") => "rad/s",
        _ => "1",
    }
}

/// Rows of the windows, over all recordings.
fn windows(problem: &Problem) -> Vec<(usize, usize)> {
    let rows = problem.rows.iter().map(|rows| (rows.inner().len(), rows.step));
    covariance::windows(rows, SCORE_WINDOW)
}

/// Fits [`Braking`] in both directions; a direction with too few rows is left out.
fn brakings(recordings: &[Recording], biases: &[f64]) -> Vec<Braking> {
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

/// A row without torque in which the hub turns.
struct FreeRow {
    angle: f64,
    speed: f64,
    acceleration: f64,
    /// Number of the part of a decay within one revolution of the hub.
    stretch: usize,
}

/// Fits the rows of one direction by least squares, at this speed, rad/s. A parabola takes the dependence on the speed.
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

fn words(found: &Found, problem: &Problem, p: &[f64]) -> Vec<String> {
    let mut words = Vec::new();
    let Details { fit, at_bound, braking, .. } = &found.details;
    let (ratio, fits) = (fit.rmse / fit.expected, found.fits == Some(true));
    if ratio < ACCELERATION_MISFIT {
        words.extend((!at_bound.is_empty()).then(|| {
            format!(
                "{DOES_NOT_FIT}: {} ended at a bound; no number here can be trusted.",
                at_bound.join(", ")
            )
        }));
        words.push(format!(
            "The residual is that of the gyro's noise: {:.2e} rad/s², {ratio:.3} times what is expected.",
            fit.rmse
        ));
    } else {
        words.push(format!(
            "{DOES_NOT_FIT}: the residual is {:.2e} rad/s², {ratio:.2} times what the gyro's noise makes. Something acts \
             that inertia and friction do not explain (a liquid that moves, a delay); no number here can be trusted. With a \
             liquid: hubslosh identify without --method.",
            fit.rmse
        ));
    }
    for name in at_bound {
        let Some(j) = problem.names.iter().position(|n| n == name) else { continue };
        let low = problem.bounded(j, f64::NEG_INFINITY);
        let end =
            if p[j] - low < problem.bounded(j, f64::INFINITY) - p[j] { "lower" } else { "upper" };
        let cause = match (name.as_str(), end) {
            (friction::B, "lower") => {
                "The rate lags behind the torque: a torque that is held between rows (--torque held), or a delay of the rate. "
            }
            (friction::C | friction::D, "lower") => {
                "Friction that drives the hub does not exist: the torque or the rate has the wrong sign or lags, or liquid moves. "
            }
            (friction::OMEGA_S, "upper") => {
                "Friction does not level off up to the fastest rate: record a step or a ramp with more torque. "
            }
            (friction::OMEGA_S, "lower") => {
                "Friction levels off below the slowest rate that the gyro resolves: record a slow ramp through zero. "
            }
            (friction::ASYMMETRY, _) => {
                "Friction acts in one direction alone: check the gyro's bias, and record both directions. "
            }
            _ => "",
        };
        words.push(format!(
            "{name} ended at its {end} bound, {:.4e} {}. {cause}--bound {name}=LOW:HIGH moves the bound.",
            p[j],
            prose(unit(name))
        ));
    }
    if found.parameters.get(friction::OMEGA_S).is_some_and(|speed| !speed.determined) {
        words.push(
            "friction.omega_s is not determined: other Stribeck speeds explain the recording as well, each with its own friction.c \
             and friction.d. A sweep and a ramp through zero together tell them apart."
                .into(),
        );
    }
    for combination in &found.details.combinations {
        words.push(combination.words());
    }
    let (names, matrix) = &found.correlations;
    for i in 0..names.len() {
        for j in 0..i {
            if matrix[i][j].abs() > 0.95 {
                words.push(format!(
                    "{} and {} have the correlation {:.3}: only their combination is determined.",
                    names[j], names[i], matrix[i][j]
                ));
            }
        }
    }
    if let Some(asymmetry) = found.parameters.get(friction::ASYMMETRY).filter(|a| a.determined) {
        let strong = asymmetry.value.abs() > 3.0 * asymmetry.std && fits;
        if strong {
            let (harder, easier) = if asymmetry.value > 0.0 {
                ("counter-clockwise", "clockwise")
            } else {
                ("clockwise", "counter-clockwise")
            };
            words.push(format!(
                "Preferential direction {easier}: {harder} the dry friction is {:.1} % stronger than the mean of both.",
                100.0 * asymmetry.value.abs()
            ));
        }
    }
    if let [ahead, back] = &braking[..] {
        words.push(format!(
            "Free decay: counter-clockwise {:.4} rad/s², clockwise {:.4} rad/s² on average over the angle.",
            ahead.coefficients[0], back.coefficients[0]
        ));
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twelve decays in a direction from 6 rad/s, by viscous and dry friction, which depends on the angle by the share
    /// `cosine`; the gyro has noise.
    fn decays(random: &mut analysis::random::Random, way: f64, cosine: f64) -> Vec<Recording> {
        (0..12)
            .map(|_| {
                let (h, mut time, mut torque) = (0.02, Vec::new(), Vec::new());
                let (mut rate, mut angle) = (Vec::new(), Vec::new());
                let (mut w, mut at) = (6.0, 10.0 * random.normal());
                while w > 0.5 {
                    time.push(h * time.len() as f64);
                    torque.push(if time.len() < 3 { 0.1 } else { 0.0 });
                    rate.push(way * w + 2e-3 * random.normal());
                    angle.push(at);
                    for _ in 0..10 {
                        w -= 0.1 * h * (0.2 * w + 0.8 * (1.0 + cosine * f64::cos(at)));
                        at += 0.1 * h * way * w;
                    }
                }
                Recording {
                    name: String::new(),
                    time,
                    torque,
                    rate,
                    angle: Some(angle),
                    gravity: None,
                    wheel_speed: None,
                    off_axis: [None, None],
                    from_rest: false,
                    fresh: None,
                    angle_fresh: None,
                    commanded: None,
                }
            })
            .collect()
    }

    /// True if the directions' difference is outside its 95 % band somewhere.
    fn differ(seed: u64, cosine: f64) -> bool {
        let mut random = analysis::random::Random::new(seed, 0);
        let all = [decays(&mut random, 1.0, cosine), decays(&mut random, -1.0, 0.0)].concat();
        let both = brakings(&all, &[0.0; 24]);
        let [ahead, back] = &both[..] else { panic!("{both:?}") };
        (0..90).map(|k| TAU * f64::from(k) / 90.0).any(|angle| {
            let half = ahead.half_width(angle).unwrap().hypot(back.half_width(angle).unwrap());
            (-ahead.at(angle) - back.at(angle)).abs() > half
        })
    }

    #[test]
    fn scatter_of_decays_is_no_preferential_direction_and_a_tenth_of_friction_is_one() {
        let of = |cosine: f64| (0..100).filter(|seed| differ(*seed, cosine)).count();
        // 95 % for the whole curve: 5 of 100 expected, 12 are three standard deviations more
        assert!(of(0.0) <= 12, "{}", of(0.0));
        assert!(of(0.1) >= 95, "{}", of(0.1));
    }

    #[test]
    fn the_mean_sign_is_the_integral_and_its_slope_the_derivative() {
        let width = 5e-4;
        for (from, to) in [(-3e-3, 1e-3), (1e-4, 3e-4), (2e-4, 2e-4), (0.011, 0.02), (-2e-3, 2e-3)]
        {
            let (sign, slope) = mean_sign(from, to, width);
            let each = (0..10_000).map(|k| {
                let w: f64 = from + (to - from) * (f64::from(k) + 0.5) / 1e4;
                (w / width).tanh()
            });
            let mean = each.sum::<f64>() / 1e4;
            assert!((sign - mean).abs() < 1e-7, "{from} to {to}: {sign}, not {mean}");
            let at = |by: f64| mean_sign(from + by, to + by, width).0;
            let difference = (at(1e-8) - at(-1e-8)) / 2e-8;
            assert!((slope - difference).abs() < 1e-3 * (1.0 + difference.abs()), "{from} to {to}");
        }
    }

    /// A hub under a sine of torque with dry friction, which passes zero between rows: the curve through three rows follows it
    /// to 2e-5 rad/s, and without the kink to 1e-4.
    #[test]
    fn a_rate_between_rows_has_the_kink_of_dry_friction() {
        let (jump, slope, bias) = (0.028, 0.23, 0.002);
        for place in [0.1, 0.35, 0.6, 0.9] {
            for way in [1.0, -1.0] {
                let zero = 0.2 + 0.02 * place;
                let rate = |t: f64| {
                    let after = (t - zero).max(0.0);
                    bias + way * (slope * (t - zero) - 0.4 * (t - zero).powi(2) - jump * after)
                };
                let time: Vec<f64> = (0..100).map(|k| 0.02 * f64::from(k)).collect();
                let rates = time.iter().map(|t| rate(*t)).collect();
                let recording = Recording::of("kink", time.clone(), vec![0.0; 100], rates);
                let mut rows = Rows::new(&recording, false);
                let furthest = |rows: &Rows| {
                    [10, 11].into_iter().fold(0.0_f64, |most, k| {
                        let (rates, parts) = rows.rates(Form::Averaged, k);
                        (0..=parts).fold(most, |most, part| {
                            let t = time[k - 1] + 0.04 * part as f64 / parts as f64;
                            most.max((rates[part] - rate(t)).abs())
                        })
                    })
                };
                rows.kink = (bias, 0.0);
                let without = furthest(&rows);
                rows.kink = (bias, jump);
                let with = furthest(&rows);
                assert!(with < 0.2 * without && with < 2e-5, "{place}, {way}: {with}, {without}");
            }
        }
    }
}
