//! Results of a run of the bench: maxima and totals, the motion of the liquid and, if the torque allows it, the frequency
//! response by three estimators and a fitted model.

use std::borrow::Cow;

use anyhow::{Context, Result, ensure};
use files::budget;
use formulas::regime::Regime;
use host::description::{ModelDescription, Value};
use host::fmu::Instance;

use super::Case;
use crate::plan::RECORDING;
use crate::profile::{Profile, Torque};
use crate::run::{Run, SLOPE, TORQUE};
use crate::weight::Contents;
use analysis::features::{Deviations, Features};
use analysis::lengths::Lengths;
use analysis::linear::{Linear, Mode};
use analysis::off_axis::{self, OffAxis};
use analysis::rational::Rational;
use analysis::residual::ModelFit;
use analysis::rotary::{self, Rotary};
use analysis::sweep::Sweep;
use analysis::welch::{self, Spectra};
use analysis::{FrequencyResponse, demodulation, logarithmic_grid, noise, spa, statistics};
use formulas::similarity::Liquid;
use names::hubslosh::{
    ENERGY, F_RADIAL, F_TANGENTIAL, FrictionModel, G_AXIAL, HEAT, OMEGA, OMEGA_IMU, SLOSH_ANGLE,
    SLOSH_ANGLE_RADIAL, STUCK_TIME, SloshModel, SloshSource, TAU_CMD, WAVE_HEIGHT, WORK, fluid,
    friction, hub, slosh, tank,
};
use signals::table::Table;

/// Number of frequencies of the responses. They are 1.2 mHz apart at the antiresonance of the thesis's sweep.
const GRID_POINTS: usize = 2000;

/// Smallest separation of antiresonance and resonance, in units of the estimate's frequency resolution, at which
/// both count as resolved.
const RESOLVED: f64 = 3.0;
/// Largest residual of a fitted transfer function, relative to the rate, at which the fit counts as valid. With 0.3, a tenth
/// of the power of the rate does not follow from the torque.
const MOST_MISFIT: f64 = 0.3;
/// Limit of two frequency differences, as a fraction of the separation of antiresonance and resonance. A passing
/// sweep may shift the resonance by this fraction; if the resonance is narrow, the shift in Hz is 0.6 times the
/// square root of the sweep's rate in Hz/s. Antiresonances or resonances from two estimates of one record may differ
/// by this fraction. Beyond the limit an estimate is not valid.
const MOST_SHIFT: f64 = 0.25;

const LEAST_SNR: f64 = 0.0;

/// Fails if the frequency responses of a run of `rows` rows take more work than [`budget::PRODUCTS`]. The work is
/// large if the band begins far below one cycle per run, because the analysis windows of most frequencies then
/// contain all rows of the run.
pub(super) fn check_work(torque: &Torque, step: f64, rows: usize) -> Result<()> {
    let Some((profile, band)) = torque.profile().and_then(|p| Some((p, p.band()?))) else {
        return Ok(());
    };
    let (sweep, rows) = (profile.sweep(), rows as f64);
    let lengths = Lengths::for_record(band, sweep, step * rows, step);
    let lags = lengths.lag / (step * lengths.decimation as f64);
    let windows = sweep.map_or(0.0, |sweep| {
        let window = |f: &f64| (demodulation::cycles(sweep, *f) / f / step).min(rows);
        logarithmic_grid(band, GRID_POINTS).iter().map(window).sum()
    });
    let work = windows + GRID_POINTS as f64 * lags;
    ensure!(
        work <= budget::PRODUCTS,
        "the frequency responses of {rows} rows, {step:?} s apart, from {:?} to {:?} Hz take {work:.1e} products (allowed: {:.0e}). \
         A higher first frequency, a longer step or a shorter run needs less work",
        band.0,
        band.1,
        budget::PRODUCTS
    );
    Ok(())
}

/// Maxima and totals of a run; NaN for quantities that a recording does not contain.
///
/// - `peak_slosh_angle`, rad; `peak_rate`, rad/s: largest |gyro rate − bias|. The bias is the mean under a sweep or noise.
/// - `peak_acceleration`, rad/s²: from central differences of the gyro's rate, as in Rubaga's thesis (7.2.2).
/// - `gyro_errors`: true if the gyro's errors were enabled, so that its reading differs from the rate.
/// - `max_energy_residual`: largest |E(t) − E(0) − work + heat|, divided by the energy throughput Σ|Δwork| + heat.
/// - `stuck`: time in stiction, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    pub peak_slosh_angle: f64,
    pub peak_radial_angle: f64,
    pub peak_wave_height: f64,
    pub peak_rate: f64,
    pub peak_acceleration: f64,
    pub gyro_errors: bool,
    pub max_energy_residual: f64,
    pub stuck: f64,
}

impl Totals {
    /// Returns maxima and totals of a recording; NaN for quantities that only a simulation has, such as the energy.
    fn from_recording(table: &Table, rates: &Rates) -> Self {
        Totals {
            peak_slosh_angle: f64::NAN,
            peak_radial_angle: f64::NAN,
            peak_wave_height: f64::NAN,
            gyro_errors: true,
            max_energy_residual: f64::NAN,
            stuck: f64::NAN,
            ..Totals::from_run(table, rates)
        }
    }

    fn from_run(table: &Table, rates: &Rates) -> Self {
        let column = |name| table.column(name).unwrap_or_default();
        let peak = |name| column(name).iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let (energy, work, heat) = (column(ENERGY), column(WORK), column(HEAT));
        let throughput: f64 = work.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>()
            + heat.last().copied().unwrap_or(0.0);
        let residual = (0..energy.len())
            .map(|i| (energy[i] - energy[0] - (work[i] - work[0]) + (heat[i] - heat[0])).abs())
            .fold(0.0, f64::max);
        Totals {
            peak_slosh_angle: peak(SLOSH_ANGLE),
            peak_radial_angle: peak(SLOSH_ANGLE_RADIAL),
            peak_wave_height: peak(WAVE_HEIGHT),
            peak_rate: statistics::peak(&rates.about_axis),
            peak_acceleration: peak_slope(column("time"), column(OMEGA_IMU)),
            gyro_errors: column(OMEGA_IMU) != column(OMEGA),
            max_energy_residual: if throughput > 0.0 { residual / throughput } else { 0.0 },
            stuck: column(STUCK_TIME).last().copied().unwrap_or(0.0),
        }
    }
}

/// Rates measured by a gyro, minus their biases, rad/s: about the hub's axis, and about x and y if a recording contains
/// them. `bias` is the bias about the hub's axis, 0 for a gyro without errors; `warnings` report large or drifting
/// means of the rates.
struct Rates {
    about_axis: Vec<f64>,
    others: [Option<Vec<f64>>; 2],
    bias: f64,
    warnings: Vec<String>,
}

/// Ratio of a rate's mean to its standard deviation above which a warning reports the mean as a possible bias of the
/// gyro. A mean of this size adds 1 % to the mean square of the rate.
const NOTABLE_MEAN: f64 = 0.1;
const PARTS: usize = 8;

impl Rates {
    /// Measures the rates and their biases. Under a sweep or noise, with which the hub oscillates, the bias is the mean of
    /// the record. Under any other torque the mean also contains motion. Then the bias of a simulated gyro is its mean
    /// difference from the true rate, and the bias of a recorded gyro is unknown and not removed.
    fn measure(table: &Table, alternates: bool, is_recording: bool) -> Rates {
        let column = |name| table.column(name).unwrap_or_default();
        let (rate, truth) = (column(OMEGA_IMU), column(OMEGA));
        let has_errors = is_recording || rate != truth;
        let bias = match (has_errors, alternates) {
            (false, _) => 0.0,
            (true, true) => statistics::mean(rate),
            (true, false) => statistics::mean(rate) - statistics::mean(truth),
        };
        let mut warnings = Vec::new();
        if has_errors && alternates {
            let names =
                [(OMEGA_IMU, "the gyro's rate"), ("omega_x", "omega_x"), ("omega_y", "omega_y")];
            for (column, name) in names {
                warnings.extend(table.column(column).and_then(|rate| notable_mean(name, rate)));
            }
        }
        let centred = |name: &str| table.column(name).map(statistics::about_mean);
        Rates {
            about_axis: rate.iter().map(|w| w - bias).collect(),
            others: if is_recording { ["omega_x", "omega_y"].map(centred) } else { [None, None] },
            bias,
            warnings,
        }
    }
}

fn notable_mean(name: &str, rate: &[f64]) -> Option<String> {
    let (mean, deviation) = (statistics::mean(rate), statistics::deviation(rate));
    let parts: Vec<f64> =
        rate.chunks(rate.len().div_ceil(PARTS).max(1)).map(statistics::mean).collect();
    let drift = statistics::deviation(&parts);
    let degrees = |rate: f64| rate.to_degrees();
    if drift > NOTABLE_MEAN * deviation {
        return Some(format!(
            "the mean of {name} drifts by {:.3} deg/s rms between eighths of the record, {:.0} % of its deviation. Only the mean \
             of the whole record, {:.3} deg/s, is removed as the gyro's bias, and the drift counts as motion in peak_rate and \
             in the cross-axis figures",
            degrees(drift),
            100.0 * drift / deviation,
            degrees(mean)
        ));
    }
    (mean.abs() > NOTABLE_MEAN * deviation).then(|| {
        format!(
            "{name} has a mean of {:.3} deg/s, {:.0} % of its deviation; it is removed as the gyro's bias",
            degrees(mean),
            100.0 * mean.abs() / deviation
        )
    })
}

fn peak_slope(time: &[f64], signal: &[f64]) -> f64 {
    let slopes = time.windows(3).zip(signal.windows(3)).map(|(t, y)| (y[2] - y[0]) / (t[2] - t[0]));
    slopes.fold(0.0, |most, slope| f64::max(most, slope.abs()))
}

/// Signals of a run by name, thinned for plots. The run is divided into at most [`History::STRETCHES`] time intervals, of
/// which the smallest and the largest value of each signal remain, in the order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    pub time: Vec<f64>,
    pub signals: Vec<(String, Vec<f64>)>,
}

impl History {
    pub const STRETCHES: usize = 300;

    pub fn thin(time: &[f64], columns: &[(&str, &[f64])]) -> History {
        let length = time.len().div_ceil(Self::STRETCHES);
        if length <= 2 {
            let copy = |(name, values): &(&str, &[f64])| (name.to_string(), values.to_vec());
            return History { time: time.to_vec(), signals: columns.iter().map(copy).collect() };
        }
        let ends = |values: &[f64]| -> Vec<f64> {
            let pair = |chunk: &[f64]| {
                let by = |a: &usize, b: &usize| chunk[*a].total_cmp(&chunk[*b]);
                let (low, high) = ((0..chunk.len()).min_by(by), (0..chunk.len()).max_by(by));
                let (low, high) = (low.unwrap_or(0), high.unwrap_or(0));
                [chunk[low.min(high)], chunk[low.max(high)]]
            };
            values.chunks(length).flat_map(pair).collect()
        };
        let step = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
        let half = length as f64 * step / 2.0;
        let points = 2 * time.len().div_ceil(length);
        History {
            time: (0..points).map(|i| time[0] + i as f64 * half).collect(),
            signals: columns
                .iter()
                .map(|(name, values)| (name.to_string(), ends(values)))
                .collect(),
        }
    }

    pub fn curve(&self, name: &str) -> Curve {
        let values = self.signals.iter().find(|(n, _)| n == name).map(|(_, values)| values);
        values.map_or(Curve::new(), |v| self.time.iter().copied().zip(v.iter().copied()).collect())
    }
}

/// Residual motion at the end of a run: the largest |rate|, rad/s, and |slosh_angle|, rad, after the manoeuvre, or in the
/// last fifth of the run. `manoeuvre` is the time at which the torque ends, s, if the run continues without torque.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ending {
    pub manoeuvre: Option<f64>,
    pub rate: Option<f64>,
    pub slosh_angle: Option<f64>,
}

impl Ending {
    fn measure(history: &History) -> Ending {
        let manoeuvre = manoeuvre(&history.curve(TAU_CMD));
        let largest = |signal: &str| {
            let curve = history.curve(signal);
            let (first, last) = (curve.first()?.0, curve.last()?.0);
            let from = manoeuvre.unwrap_or(first + 0.8 * (last - first));
            let late = curve.iter().filter(|(t, _)| *t > from);
            Some(late.fold(0.0, |most: f64, (_, value)| most.max(value.abs())))
        };
        Ending { manoeuvre, rate: largest(OMEGA_IMU), slosh_angle: largest(SLOSH_ANGLE) }
    }
}

fn manoeuvre(torque: &Curve) -> Option<f64> {
    let last = torque.iter().rposition(|(_, torque)| *torque != 0.0)?;
    let (end, whole) = (torque.get(last + 1)?.0, torque.last()?.0);
    (end < 0.9 * whole).then_some(end)
}

/// Path of the wave crest seen from above, in two short time intervals of a run: around the largest wave, and around the
/// onset of rotary slosh if there is one. A point is the time, s, and the slosh angles outwards and towards +θ, rad.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SloshPath {
    pub largest: Vec<[f64; 3]>,
    pub onset: Option<Vec<[f64; 3]>>,
}

impl SloshPath {
    /// Length of the time interval around the largest wave, in slosh periods.
    pub const LARGEST: f64 = 7.0;
    /// Length of the time interval around the onset of rotary slosh, in slosh periods.
    pub const ONSET: f64 = 38.0;

    fn around_extremes(table: &Table, onset: Option<f64>, frequency: f64) -> Self {
        let column = |name| table.column(name).unwrap_or_default();
        let (time, radial, tangential) =
            (column("time"), column(SLOSH_ANGLE_RADIAL), column(SLOSH_ANGLE));
        let size = |i: usize| radial[i].hypot(tangential[i]);
        let top = (0..time.len()).max_by(|&a, &b| size(a).total_cmp(&size(b))).map(|i| time[i]);
        let stretch = |centre: f64, periods: f64| {
            (0..time.len())
                .filter(|&i| (time[i] - centre).abs() * frequency <= periods / 2.0)
                .map(|i| [time[i], radial[i], tangential[i]])
                .collect()
        };
        SloshPath {
            largest: top.map_or(Vec::new(), |t| stretch(t, Self::LARGEST)),
            onset: onset.map(|t| stretch(t, Self::ONSET)),
        }
    }
}

#[derive(Clone, Debug)]
pub struct Outcome {
    pub case: Case,
    pub range: Range,
    /// Exact linear model with viscous friction, from the FMU's calculated parameters in this run.
    pub linear: Linear,
    pub totals: Totals,
    /// Estimates from the whole record, for example by `spa`; `None` if the torque is neither a sweep nor noise.
    pub record: Option<Record>,
    /// Estimates at the moments at which a sweep passes each frequency; `None` if the torque is not a sweep.
    pub passing: Option<Passing>,
    /// Rotary slosh; `None` for a recording, which contains no angles of the liquid.
    pub rotary: Option<Rotary>,
    /// Torque, rate, slosh angles, and the residual. The residual is the rate minus its bias and minus the rate of the exact
    /// linear model under the same torque.
    pub history: History,
    pub path: SloshPath,
    pub ending: Ending,
    /// Name of the force that dominates the motion of the liquid, if this force is not gravity ([`Range::without_weight`]).
    pub weightless: Option<String>,
    /// Sentence about how the run left the range of validity of the tank's model; empty if it did not.
    pub limits: Vec<String>,
    pub reused: bool,
    pub warnings: Vec<String>,
}

#[derive(Clone, Debug)]
pub struct Estimate {
    pub response: FrequencyResponse,
    /// Antiresonance and resonance of the response, both missing if they are not valid.
    pub features: Features,
    pub resolution: f64,
    /// Relative standard deviation of the magnitude, and of the phase, rad, from the part of the rate that no
    /// linear response explains; empty if unknown.
    pub deviation: Vec<f64>,
    pub deviations: Deviations,
    pub doubt: Option<Doubt>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doubt {
    /// The sweep shifts the resonance by more than a quarter of the separation from the antiresonance.
    TooFast,
    TooShort,
    Noise,
    /// Two estimates of the response differ by more than a quarter of the separation of antiresonance and resonance,
    /// because the motion is nonlinear. For example, after a fast sweep a nonlinear liquid oscillates freely, at a
    /// frequency that depends on its amplitude; this motion is not a linear response to the torque.
    Nonlinear,
}

impl std::fmt::Display for Doubt {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Doubt::TooFast => "the sweep is too fast",
            Doubt::TooShort => "the record is too short",
            Doubt::Noise => "too much noise",
            Doubt::Nonlinear => "no single linear response: it depends on the amplitude",
        })
    }
}

impl Estimate {
    /// Creates an estimate from a response. Its antiresonance and resonance are sought between the two frequencies
    /// `inner`, Hz. `doubt` returns the reason to reject them, if there is one.
    fn new(
        response: FrequencyResponse,
        inner: (f64, f64),
        resolution: f64,
        doubt: impl Fn(&Features) -> Option<Doubt>,
    ) -> Self {
        let found = Features::find_within(&response, inner);
        let doubt = if found.has_any() { doubt(&found) } else { None };
        let features = if doubt.is_some() { Features::default() } else { found };
        let (deviation, deviations) = (Vec::new(), Deviations::default());
        Estimate { response, features, resolution, deviation, deviations, doubt }
    }

    /// Adds the standard deviations of the response, `deviation`, and the standard deviations of antiresonance and
    /// resonance that follow from them. `slope` maps a frequency, Hz, to the rate at which the response's error
    /// changes with the frequency, relative to the error, 1/Hz.
    fn with_uncertainties(self, deviation: Vec<f64>, slope: impl Fn(f64) -> f64) -> Self {
        let deviations = self.features.deviations(&self.response, &deviation, slope);
        Estimate { deviation, deviations, ..self }
    }

    fn drop_curves(&mut self) {
        self.response = FrequencyResponse::default();
        self.deviation = Vec::new();
    }

    fn doubted(&mut self, doubt: Doubt) {
        (self.features, self.deviations) = Default::default();
        self.doubt = Some(doubt);
    }
}

/// Returns true if antiresonance and resonance exist and are less than `limit` (Hz) apart.
fn are_closer(features: &Features, limit: f64) -> bool {
    features.delta_f().is_some_and(|delta| delta < limit)
}

/// Averages each group of `count` consecutive samples. An incomplete group at the end is left out.
fn block_means(signal: &[f64], count: usize) -> Cow<'_, [f64]> {
    if count == 1 {
        return signal.into();
    }
    let mean = |chunk: &[f64]| chunk.iter().sum::<f64>() / count as f64;
    signal.chunks_exact(count).map(mean).collect::<Vec<_>>().into()
}

pub type Curve = Vec<(f64, f64)>;

#[derive(Clone, Debug)]
pub struct Record {
    pub spa: Estimate,
    pub h1: Estimate,
    /// Signal-to-noise ratio of the rate at resonance and at antiresonance, dB, from the coherence of the rate with the
    /// torque; `None` if `spa` finds no valid resonance and antiresonance.
    pub snr_db: Option<[f64; 2]>,
    pub snr_over_band: Curve,
    /// A fitted transfer function. It is computed only if the estimate of the passing sweep is not valid, or if there is no
    /// sweep and `spa` shows no resonance and no antiresonance.
    pub rational: Option<Estimate>,
    /// The thesis's linear model, fitted to the `spa` response, and the coherence of its residual with the torque over the
    /// band; `None` if nothing can be fitted.
    pub fit: Option<(ModelFit, Curve)>,
}

/// Estimates at the moments at which a sweep passes each frequency, by sweep-synchronous demodulation.
#[derive(Clone, Debug)]
pub struct Passing {
    pub rate: Estimate,
    /// Fraction of the liquid's force that does not act about the hub's axis. For a recording it is the fraction of the hub's
    /// rates about other axes, if these were recorded.
    pub off_axis: Option<OffAxis>,
    pub leakage: Vec<f64>,
}

impl Record {
    /// Estimates the frequency response from the whole record of torque `tau` (N·m) and rate `omega` (rad/s), whose
    /// rows are `step` seconds apart. `unexplained` is the power spectral density of the part of the rate that is no
    /// linear response to the torque, at the frequencies of the responses. `enough` is true if a sweep has already
    /// given a valid estimate, so that no transfer function need be fitted.
    fn estimate(
        profile: &Profile,
        step: f64,
        tau: &[f64],
        omega: &[f64],
        unexplained: &[f64],
        enough: bool,
    ) -> Option<Record> {
        let band = profile.band()?;
        let duration = step * tau.len() as f64;
        let lengths = Lengths::for_record(band, profile.sweep(), duration, step);
        let (tau, omega) =
            (block_means(tau, lengths.decimation), block_means(omega, lengths.decimation));
        let step = step * lengths.decimation as f64;
        let frequencies = logarithmic_grid(band, GRID_POINTS);
        let spectra = Spectra::estimate(step, &tau, &omega, welch::RESPONSE);
        let snr = spectra.snr_db();
        let noisy = |features: &Features| {
            // details that the segments do not resolve look like noise
            let resolved = !are_closer(features, RESOLVED / spectra.length);
            resolved && features.f_res.is_some_and(|f| spectra.value_at(&snr, f) < LEAST_SNR)
        };
        let estimate = |response: FrequencyResponse, length: f64| {
            let resolution = 1.0 / length;
            // the band is narrower by one resolution at either end, where the estimate oscillates because the band is cut off
            let inner = (band.0 + resolution, band.1 - resolution);
            Estimate::new(response, inner, resolution, |features| match features {
                features if are_closer(features, RESOLVED * resolution) => Some(Doubt::TooShort),
                features if noisy(features) => Some(Doubt::Noise),
                _ => None,
            })
        };
        let spa = spa::Estimate::new(step, &tau, &omega, &frequencies, lengths.lag);
        let (deviation, slope) = (spa.deviation(unexplained), spa.slope());
        let mut spa = estimate(spa.response, lengths.lag).with_uncertainties(deviation, |_| slope);
        // a transfer function is fitted, too, if the sweep was too fast for the estimate at the moment of passing
        let fast = profile.sweep().is_some() && !enough;
        let mut rational = (fast || !enough && !spa.features.has_any())
            .then(|| Rational::fit(step, &tau, &omega, band))
            .flatten()
            .map(|fitted| {
                let response = fitted.frequency_response(&frequencies);
                let estimate = Estimate::new(response, band, 1.0 / duration, |_| {
                    (fitted.misfit > MOST_MISFIT).then_some(Doubt::Noise)
                });
                let (deviation, deviations) = fitted.deviations(&frequencies);
                Estimate { deviation, deviations, ..estimate }
            });
        let extrema = spa.features.f_res.zip(spa.features.f_dip);
        let fit = ModelFit::fit(step, lengths.segment, &tau, &omega, &spa.response, &spa.features);
        if let (true, Some(fitted), Some(delta)) = (fast, &mut rational, spa.features.delta_f()) {
            let apart = |get: fn(&Features) -> Option<f64>| {
                let pair = get(&spa.features).zip(get(&fitted.features));
                pair.is_some_and(|(a, b)| (a - b).abs() > MOST_SHIFT * delta)
            };
            if apart(|f| f.f_dip) || apart(|f| f.f_res) {
                spa.doubted(Doubt::Nonlinear);
                fitted.doubted(Doubt::Nonlinear);
            }
        }
        Some(Record {
            h1: estimate(spectra.h1(band), spectra.length),
            snr_db: extrema.map(|(res, antiresonance)| {
                [spectra.value_at(&snr, res), spectra.value_at(&snr, antiresonance)]
            }),
            snr_over_band: spectra.values_within(band, &snr),
            rational,
            fit: fit.map(|(fit, spectra)| (fit, spectra.values_within(band, &spectra.coherence()))),
            spa,
        })
    }
}

impl Passing {
    /// Estimates the frequency response at the moments at which the sweep passes each frequency, and finds rotary
    /// slosh. `arm` is the distance of the tank from the hub's axis, m. `unexplained` is the power spectral density
    /// of the part of the rate that is no linear response to the torque.
    fn demodulate(
        sweep: &Sweep,
        table: &Table,
        rates: &Rates,
        arm: f64,
        unexplained: &[f64],
    ) -> (Passing, Option<Rotary>) {
        let column = |name| table.column(name).unwrap_or_default();
        let is_recording = table.column(F_RADIAL).is_none();
        let about_axis = &rates.about_axis[..];
        // if the rate about another axis is missing, the rate about the hub's axis takes its place, and the
        // result is not used
        let other = |k: usize| rates.others[k].as_deref().unwrap_or(about_axis);
        let signals = match is_recording {
            false => {
                let [radial, tangential, force] =
                    [SLOSH_ANGLE_RADIAL, SLOSH_ANGLE, F_RADIAL].map(column);
                [about_axis, radial, tangential, force]
            }
            true => [about_axis, other(0), other(1), about_axis],
        };
        let grid = logarithmic_grid(sweep.band(), GRID_POINTS);
        let demodulation::Demodulated { responses, noise_gain } = demodulation::frequency_responses(
            sweep,
            column("time"),
            column(TAU_CMD),
            signals,
            &grid,
        );
        let [rate, second, third, fourth] = responses;
        // power spectral density of the unexplained rate at the frequencies that the sweep passes
        let unexplained: Vec<f64> = (rate.frequency.iter())
            .map(|f| unexplained.get(grid.partition_point(|g| g < f)).copied().unwrap_or(f64::NAN))
            .collect();
        let deviation = demodulation::deviation(&rate, &unexplained, &noise_gain);
        let rotary = (!is_recording).then(|| {
            let swirl = rotary::swirl(&second, &third, sweep.amplitude.abs());
            let passed = &second.frequency;
            let times: Vec<f64> =
                passed.iter().filter_map(|f| sweep.time_at_frequency(*f)).collect();
            Rotary::from_sweep(passed, &times, &swirl)
        });
        let (leakage, off_axis) = if is_recording {
            let [x, y] = rates.others.each_ref().map(Option::as_deref);
            let others: Vec<(&FrequencyResponse, &[f64])> = [(&second, x), (&third, y)]
                .into_iter()
                .filter_map(|(h, w)| Some((h, w?)))
                .collect();
            off_axis::off_axis_from_rates(&rate, about_axis, &others)
        } else {
            let leakage = off_axis::leakage(&fourth, arm);
            let off_axis = OffAxis::from_forces(column(F_RADIAL), column(F_TANGENTIAL), &leakage);
            (leakage, Some(off_axis))
        };
        // true if the window is completely within the sweep
        let whole = |f: f64| {
            let half = demodulation::cycles(sweep, f) / f / 2.0;
            sweep
                .time_at_frequency(f)
                .is_some_and(|t| t - half >= 0.0 && t + half <= sweep.duration)
        };
        let mut inner = rate.frequency.iter().copied().filter(|f| whole(*f));
        let inner = (
            inner.clone().next().unwrap_or(f64::INFINITY),
            inner.next_back().unwrap_or(f64::NEG_INFINITY),
        );
        let moves = |f: f64| sweep.rate_at(f).abs() * demodulation::cycles(sweep, f) / f;
        let middle = sweep.band();
        let mut rate = Estimate::new(rate, inner, 0.0, |features| {
            let shift = |f: f64| 0.6 * sweep.rate_at(f).abs().sqrt();
            let fast = features.f_res.is_some_and(|f| are_closer(features, shift(f) / MOST_SHIFT));
            fast.then_some(Doubt::TooFast)
        })
        .with_uncertainties(deviation, |f| demodulation::slope(sweep, f));
        rate.resolution = moves(rate.features.f_res.unwrap_or((middle.0 * middle.1).sqrt()));
        (Passing { rate, off_axis, leakage }, rotary)
    }
}

/// Returns the rotary slosh of a stored run whose torque is not a sweep; `frequency` is the natural frequency
/// of the liquid, Hz.
pub(super) fn rotary_in_time(step: f64, frequency: f64, table: &Table) -> Rotary {
    let column = |name| table.column(name).unwrap_or_default();
    Rotary::from_angles(step, frequency, column(SLOSH_ANGLE_RADIAL), column(SLOSH_ANGLE))
}

/// Returns the rate of the hub, rad/s, that the exact linear model predicts in each row of a run. `recorded` is the
/// torque in each row, N·m, and `start` the rate in the first row. The prediction uses `recorded` for a sweep, and
/// the plan's history for other torques, because they may jump between two rows.
fn linear_rate(
    run: &Run,
    case: &Case,
    recorded: &[f64],
    start: f64,
    linear: &Linear,
) -> Result<Vec<f64>> {
    let is_sweep =
        run.torque.profile().is_some_and(|profile| profile.sweep().is_some()) && !run.hold;
    if is_sweep && case.recording.is_some() {
        return Ok(linear.simulate(run.step, recorded, start));
    }
    let (torque, schedule) = run.torque_table()?;
    if is_sweep && schedule.rows.is_none() {
        return Ok(linear.simulate(run.step, recorded, start));
    }
    // the torque is passed with its slopes, so that a jump between two rows is not interpolated by a straight line
    let column = |name| torque.column(name).unwrap_or_default();
    let rates = linear.simulate_ramps(column("time"), column(TORQUE), column(SLOPE), start);
    let rows = rates.into_iter().enumerate().filter(|(k, _)| schedule.is_row(*k));
    Ok(rows.map(|(_, rate)| rate).collect())
}

impl Outcome {
    /// Computes the outcome of a stored run. `instance` is an initialised instance of the FMU, from which calculated
    /// parameters, such as the mass of the liquid, are read.
    pub(super) fn analyse(
        case: &Case,
        run: &Run,
        instance: &mut Instance,
        table: &Table,
        reused: bool,
    ) -> Result<Outcome> {
        let linear = exact_linear(instance)?;
        let mut range = Range::read(instance.description(), instance)?.context("not the bench")?;
        if case.recording.is_some() {
            range.model = RECORDING.into();
        }
        let column = |name| table.column(name).unwrap_or_default();
        let is_recording = case.recording.is_some();
        let profile = run.torque.profile();
        let alternates = profile.is_some_and(|profile| profile.band().is_some());
        let rates = Rates::measure(table, alternates, is_recording);
        let (record, swept) = match profile {
            None => (None, None),
            Some(profile) => {
                let (tau, omega) = (column(TAU_CMD), &rates.about_axis[..]);
                // computed at every fourth frequency, because the unexplained power changes
                // little between neighbouring frequencies
                let unexplained = profile.band().map_or(Vec::new(), |band| {
                    let grid = logarithmic_grid(band, GRID_POINTS);
                    let some: Vec<f64> = grid.into_iter().skip(1).step_by(4).collect();
                    let power = noise::power(run.step, tau, omega, &some);
                    power.into_iter().flat_map(|power| [power; 4]).collect()
                });
                let swept = profile.sweep().map(|sweep| {
                    Passing::demodulate(sweep, table, &rates, linear.arm, &unexplained)
                });
                let enough =
                    swept.as_ref().is_some_and(|(passing, _)| passing.rate.doubt.is_none());
                (Record::estimate(profile, run.step, tau, omega, &unexplained, enough), swept)
            }
        };
        // the initial rate of a recording is the measured rate minus the bias
        let start = column(OMEGA).first().copied().unwrap_or(0.0)
            - if is_recording { rates.bias } else { 0.0 };
        let modelled = linear_rate(run, case, column(TAU_CMD), start, &linear)?;
        let residual: Vec<f64> =
            rates.about_axis.iter().zip(&modelled).map(|(y, m)| y - m).collect();
        let signals = [TAU_CMD, OMEGA_IMU, SLOSH_ANGLE, SLOSH_ANGLE_RADIAL, "omega_x", "omega_y"];
        let signals = signals.into_iter().filter_map(|name| Some((name, table.column(name)?)));
        let all: Vec<(&str, &[f64])> = signals.chain([("residual", &residual[..])]).collect();
        let frequency = linear.modes.first().map_or(1.0, |mode| mode.frequency);
        let (passing, rotary) = match swept {
            Some((passing, rotary)) => (Some(passing), rotary),
            None => (None, (!is_recording).then(|| rotary_in_time(run.step, frequency, table))),
        };
        let onset = rotary.and_then(|rotary| profile?.sweep()?.time_at_frequency(rotary.from?));
        let history = History::thin(column("time"), &all);
        Ok(Outcome {
            ending: Ending::measure(&history),
            history,
            path: match case.recording {
                Some(_) => SloshPath::default(),
                None => SloshPath::around_extremes(table, onset, frequency),
            },
            totals: match case.recording {
                Some(_) => Totals::from_recording(table, &rates),
                None => Totals::from_run(table, &rates),
            },
            warnings: rates.warnings,
            case: case.clone(),
            weightless: range.without_weight(column(WAVE), table.column(G_AXIAL)),
            limits: super::warning_limits(instance.description())
                .describe(|name| table.column(name)),
            range,
            linear,
            record,
            passing,
            rotary,
            reused,
        })
    }

    /// Removes the curves of the run, which take a quarter of a megabyte; all numbers remain.
    pub fn without_curves(mut self) -> Outcome {
        (self.history, self.path) = Default::default();
        if let Some(record) = &mut self.record {
            record.spa.drop_curves();
            record.h1.drop_curves();
            record.rational.iter_mut().for_each(Estimate::drop_curves);
            record.snr_over_band = Curve::new();
            record.fit.iter_mut().for_each(|(_, coherence)| *coherence = Curve::new());
        }
        if let Some(passing) = &mut self.passing {
            passing.rate.drop_curves();
            passing.leakage = Vec::new();
        }
        self
    }

    pub fn has_curves(&self) -> bool {
        !self.history.time.is_empty()
    }

    /// Returns the estimate of a sweep for `features.csv`, and its name. The first choice is the demodulated
    /// response, which is the hub's response at the moment at which the sweep passes a frequency; it includes the
    /// sweep's shift of the resonance (see the report). If it is not valid, `spa` is chosen, and if this is not valid
    /// either, a fitted transfer function.
    pub fn estimate(&self) -> Option<(&Estimate, &'static str)> {
        let passing = self.passing.as_ref()?;
        match (&passing.rate.doubt, &self.record) {
            (Some(_), Some(record)) if record.spa.features.has_any() => Some((&record.spa, "spa")),
            (Some(_), Some(Record { rational: Some(fitted), .. })) if fitted.features.has_any() => {
                Some((fitted, "transfer function"))
            }
            (Some(_), Some(record)) if record.spa.doubt == Some(Doubt::Nonlinear) => {
                Some((&record.spa, "spa"))
            }
            _ => Some((&passing.rate, "demodulation")),
        }
    }

    pub fn features(&self) -> Features {
        self.estimate().map_or(Features::default(), |(estimate, _)| estimate.features)
    }

    pub fn beyond_model(&self) -> Option<String> {
        let how = [self.range.left(&[self.totals.peak_wave_height]), self.weightless.clone()];
        let how = how.into_iter().flatten().chain(self.limits.iter().cloned());
        super::join_sentences(&how.collect::<Vec<_>>())
    }

    pub fn spa_features(&self) -> Features {
        self.record.as_ref().map_or(Features::default(), |record| record.spa.features)
    }

    pub fn fit(&self) -> Option<ModelFit> {
        Some(self.record.as_ref()?.fit.as_ref()?.0)
    }

    /// Returns the fraction of the liquid's force that does not act about the axis. It is known only for sweeps.
    pub fn off_axis(&self) -> Option<OffAxis> {
        self.passing.as_ref()?.off_axis
    }

    /// Returns the regime of linear slosh theory at the largest wave of the run; `None` for a
    /// recording, which has no wave.
    pub fn regime(&self) -> Option<&'static str> {
        let ratio = self.totals.peak_wave_height / self.range.radius;
        (!ratio.is_nan()).then(|| match Regime::from_ratio(ratio) {
            Regime::Linear => "linear",
            Regime::Transitional => "transitional",
            Regime::Nonlinear => "nonlinear",
        })
    }

    pub fn is_recording(&self) -> bool {
        self.case.recording.is_some()
    }
}

pub const WAVE: &str = WAVE_HEIGHT;

/// Quantities that determine in which runs the liquid's model is valid.
///
/// - `model`: value of `slosh.model`. `radius`: radius of the tank, m.
/// - `fill`: depth of the liquid, m; `None` if the modes come from a table, which does not state the depth.
/// - `liquid`: density and surface tension. `g`: value of `g_axial` at the start, m/s².
/// - `length`: pendulum length of mode 1, m; 0 if nothing sloshes.
#[derive(Clone, Debug)]
pub struct Range {
    pub model: String,
    pub radius: f64,
    pub fill: Option<f64>,
    pub liquid: Liquid,
    pub g: f64,
    pub length: f64,
}

impl Range {
    /// Reads the quantities of `Range` from an initialised instance; `None` if the FMU is not HubSlosh.
    pub fn read(description: &ModelDescription, instance: &mut Instance) -> Result<Option<Range>> {
        if !super::is_bench(description) {
            return Ok(None);
        }
        let model = item(instance, slosh::MODEL, slosh::KIND)?.unwrap_or_default();
        let source = item(instance, slosh::SOURCE, slosh::SOURCE_KIND)?;
        let fill = instance.real(tank::H)?;
        Ok(Some(Range {
            model,
            radius: instance.real(tank::D)? / 2.0,
            fill: (source.as_deref() != Some(SloshSource::Table.name())).then_some(fill),
            liquid: Liquid {
                density: instance.real(fluid::RHO)?,
                tension: instance.real(fluid::SIGMA)?,
            },
            g: instance.real(G_AXIAL)?,
            length: instance.real(&slosh::LENGTH.element([1]))?,
        }))
    }

    /// Returns a sentence about the dominant force on the liquid, or `None` if gravity dominates in every row of the
    /// run. `waves` are the wave heights in each row, m; `g` is the input `g_axial` in each row, m/s², or `None` if
    /// it is constant.
    ///
    /// The sentence has the Bond, Weber and Froude numbers in the row in which gravity dominates least. They use the
    /// tank's radius and the highest speed of the surface up to this row. For a wave height η and a pendulum length l
    /// the speed is V = η √(g/l) (thesis 2.5).
    pub fn without_weight(&self, waves: &[f64], g: Option<&[f64]>) -> Option<String> {
        if self.length <= 0.0 {
            return None;
        }
        let contents = Contents { liquid: self.liquid, radius: self.radius };
        let rows = waves.iter().enumerate().map(|(row, wave)| {
            let g = g.map_or(self.g, |g| g[row]);
            (g, wave.abs() * (g.max(0.0) / self.length).sqrt())
        });
        contents.without_weight(rows).map(|numbers| numbers.to_string())
    }

    /// Describes how a run with these wave heights, m, left the range of validity of its model. A linear model is not
    /// valid in waves above a quarter of the tank's radius (thesis 2.3.5), and no model is valid if a trough would be
    /// below the tank's bottom.
    pub fn left(&self, waves: &[f64]) -> Option<String> {
        let wave = waves.iter().fold(0.0, |most: f64, wave| most.max(wave.abs()));
        let mm = |length: f64| format!("{:.1} mm", length * 1e3);
        let linear = self.radius / 4.0;
        if self.model == SloshModel::Linear.name() && wave > linear {
            let (wave, most) = (mm(wave), mm(linear));
            return Some(format!(
                "a wave of {wave}; linear slosh theory holds up to a quarter of the tank's radius, {most}"
            ));
        }
        let fill =
            self.fill.filter(|fill| self.model != SloshModel::Frozen.name() && wave > *fill)?;
        Some(format!("a wave of {}, more than the liquid is deep, {}", mm(wave), mm(fill)))
    }
}

/// Returns the selected item of an enumeration of an initialised instance. `kind` is the integer parameter that selects the
/// item instead, unless it is 0. Returns `None` if the FMU has no such enumeration, because its version is older.
fn item(instance: &mut Instance, name: &str, kind: &str) -> Result<Option<String>> {
    let description = instance.description();
    let Ok(variable) = description.variable(name) else { return Ok(None) };
    let mut number = instance.value(variable)?;
    if let Ok(kind) = description.variable(kind) {
        let instead = instance.value(kind)?;
        number = if instead != Value::Integer(0) { instead } else { number };
    }
    let mut items = description.items(variable).iter();
    let found = items.find(|item| Value::Integer(item.value) == number);
    Ok(found.map(|item| item.name.clone()))
}

/// Computes the exact linear model of HubSlosh from the FMU's calculated parameters. It contains the viscous friction
/// of the bearing, and the stiffness and the damping of the line on which the thesis's bench hangs.
pub(super) fn exact_linear(instance: &mut Instance) -> Result<Linear> {
    let mut real = |name: &str| instance.real(name);
    let arm = real(tank::R)?;
    // Fraction of the modes' masses that moves with the tank across the direction of the mode.
    let (mut modes, mut carried) = (Vec::new(), 0.0);
    for n in 1..=slosh::MOST_MODES {
        let mass = real(&slosh::MASS.element([n]))?;
        if mass <= 0.0 {
            continue;
        }
        // Versions before 0.5 have only tangential modes. A mode at an angle to the tangent has the lever arm r cos. To first
        // order it is a tangential mode of mass m cos^2, and its remaining mass moves with the tank.
        let direction = real(&slosh::table::DIRECTION.element([n])).unwrap_or(0.0);
        let across = mass * direction.sin().powi(2);
        carried += across;
        if mass - across > 1e-12 * mass {
            modes.push(Mode {
                mass: mass - across,
                frequency: real(&slosh::FREQUENCY.element([n]))?,
                damping: real(&slosh::DAMPING.element([n]))?,
            });
        }
    }
    let inertia = real(hub::I)? + (real(tank::M_0)? + carried) * arm * arm;
    let viscous = real(friction::B)?;
    let law = item(instance, friction::MODEL, friction::KIND)?;
    let bearing = if law.as_deref() == Some(FrictionModel::None.name()) { 0.0 } else { viscous };
    // In versions before 0.4 the bench does not hang on a line.
    let mut line = |name: &str| instance.real(name).unwrap_or(0.0);
    let (stiffness, friction) = (line(hub::K), bearing + line(hub::C));
    Ok(Linear { inertia, friction, stiffness, arm, modes })
}

#[cfg(test)]
mod tests {
    use super::{Liquid, Range, check_work};
    use crate::profile::Written;

    /// With a sweep from 1e-9 Hz one analysis window contains all 20 million rows of a run, so that the
    /// analysis would take hours.
    #[test]
    fn a_sweep_whose_analysis_windows_contain_the_whole_long_run_is_refused() {
        let work = |profile: &str, step: f64, rows: usize| {
            check_work(&profile.parse::<Written>().unwrap().torque().unwrap(), step, rows)
        };
        // analyses that are allowed: 111 h at 50 Hz in the bench's band, and the thesis's run with a sweep from 1e-6 Hz
        work("exp-sweep:f0=1.25,f1=3.5,duration=400000", 0.02, 20_000_000).unwrap();
        work("exp-sweep:f0=1e-6,f1=3.5,duration=2700", 0.02, 135_000).unwrap();
        for profile in ["exp-sweep:f0=1e-9", "noise:f0=1e-9"] {
            let text = format!("{profile},f1=3.5,duration=400000");
            let error = work(&text, 0.02, 20_000_000).unwrap_err().to_string();
            assert!(error.contains("20000000 rows, 0.02 s apart, from 1e-9 to 3.5 Hz"), "{error}");
        }
    }

    #[test]
    fn a_liquid_that_weight_does_not_hold_is_reported_with_bond_weber_and_froude_number() {
        // water in the bench's tank, filled to 10 cm
        let range = Range {
            model: "spherical".into(),
            radius: 0.0815,
            fill: Some(0.1),
            liquid: Liquid { density: 1000.0, tension: 0.072 },
            g: 9.81,
            length: 0.045_241,
        };
        assert_eq!(range.without_weight(&[0.02; 3], None), None, "Bo 905, Fr 0.1");
        // 20 mm at 9.81 m/s²: V = 0.02 √(9.81/0.045241) = 0.2945 m/s, We = 1000 V² 0.0815/0.072 = 98.2
        let cut = range.without_weight(&[0.02; 3], Some(&[9.81, 1.0, 0.01])).unwrap();
        for words in ["Bond number 0.923", "Weber number 98.", "Froude number 106.", "inertia"] {
            assert!(cut.contains(words), "{words}: {cut}");
        }
        // the liquid at rest without any specific force
        let still = range.without_weight(&[0.0; 2], Some(&[9.81, 0.0])).unwrap();
        assert!(still.contains("Froude number infinite"), "{still}");
        assert!(still.contains("surface tension"), "{still}");
        // at a Bond number of 9 gravity still dominates, but the surface is not flat
        let low = Range { g: 0.1, ..range.clone() }.without_weight(&[1e-4], None).unwrap();
        assert!(low.contains("Bond number 9.225") && low.contains("curved"), "{low}");
        let frozen = Range { length: 0.0, ..range };
        assert_eq!(frozen.without_weight(&[0.0], Some(&[0.0])), None, "nothing sloshes");
    }
}
