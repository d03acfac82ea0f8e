//! What a run of the bench shows: figures of the run as a whole, and, where its torque allows, its
//! frequency response by three estimators, a fitted model, and how the liquid moved.

use anyhow::Result;
use host::fmi2::Instance;

use super::Case;
use crate::analysis::features::Features;
use crate::analysis::linear::{Linear, Mode};
use crate::analysis::off_axis::{self, OffAxis};
use crate::analysis::residual::ModelFit;
use crate::analysis::rotary::{self, Rotary};
use crate::analysis::welch::{self, Spectra};
use crate::analysis::{FrequencyResponse, demodulation, logarithmic_grid, spa};
use crate::profile::{Profile, Sweep, Torque};
use crate::run::Run;
use crate::table::Table;

/// Frequencies at which responses are evaluated: 1.2 mHz apart at the antiresonance of the thesis's
/// sweep.
const GRID_POINTS: usize = 2000;

/// Figures of a run as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    /// Largest |slosh_angle|, rad.
    pub peak_slosh_angle: f64,
    /// Largest |slosh_angle_radial|, rad.
    pub peak_radial_angle: f64,
    /// Largest wave height, m.
    pub peak_wave_height: f64,
    /// Largest |E(t) − E(0) − work + heat| over the energy throughput Σ|Δwork| + heat.
    pub max_energy_residual: f64,
    /// Time in stiction, s.
    pub stuck: f64,
}

impl Figures {
    fn of(table: &Table) -> Self {
        let column = |name| table.column(name).unwrap_or_default();
        let peak = |name| column(name).iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let (energy, work, heat) = (column("energy"), column("work"), column("heat"));
        let throughput: f64 = work.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>()
            + heat.last().copied().unwrap_or(0.0);
        let residual = (0..energy.len())
            .map(|i| (energy[i] - energy[0] - (work[i] - work[0]) + (heat[i] - heat[0])).abs())
            .fold(0.0, f64::max);
        Figures {
            peak_slosh_angle: peak("slosh_angle"),
            peak_radial_angle: peak("slosh_angle_radial"),
            peak_wave_height: peak("wave_height"),
            max_energy_residual: if throughput > 0.0 { residual / throughput } else { 0.0 },
            stuck: column("stuck_time").last().copied().unwrap_or(0.0),
        }
    }
}

/// The path of the liquid surface's crest seen from above, in two short stretches of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SloshPath {
    /// Where the wave is largest: angles outwards and towards +θ, rad.
    pub largest: Vec<(f64, f64)>,
    /// Around the onset of rotary slosh, if there is any.
    pub onset: Option<Vec<(f64, f64)>>,
}

impl SloshPath {
    /// Length of the stretch around the largest wave, s.
    pub const LARGEST: f64 = 3.0;
    /// Length of the stretch around the onset, s.
    pub const ONSET: f64 = 16.0;

    fn of(table: &Table, onset: Option<f64>) -> Self {
        let column = |name| table.column(name).unwrap_or_default();
        let (time, radial, tangential) =
            (column("time"), column("slosh_angle_radial"), column("slosh_angle"));
        let size = |i: usize| radial[i].hypot(tangential[i]);
        let top = (0..time.len()).max_by(|&a, &b| size(a).total_cmp(&size(b))).map(|i| time[i]);
        let stretch = |centre: f64, length: f64| {
            (0..time.len())
                .filter(|&i| (time[i] - centre).abs() <= length / 2.0)
                .map(|i| (radial[i], tangential[i]))
                .collect()
        };
        SloshPath {
            largest: top.map_or(Vec::new(), |t| stretch(t, Self::LARGEST)),
            onset: onset.map(|t| stretch(t, Self::ONSET)),
        }
    }
}

/// A run of the bench, and what it shows.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Which run.
    pub case: Case,
    /// Value of `slosh.model`, by name.
    pub model: String,
    /// Fill (`tank.h`), m.
    pub fill: f64,
    /// Radius of the tank, m.
    pub tank_radius: f64,
    /// Its exact linear counterpart with viscous friction, from the FMU's calculated parameters.
    pub linear: Linear,
    /// Of the run as a whole.
    pub figures: Figures,
    /// What the whole record shows; `None` if the torque is neither sweep nor noise.
    pub record: Option<Record>,
    /// What is seen while a sweep passes; `None` if the torque is no sweep.
    pub passing: Option<Passing>,
    /// It was not simulated but read.
    pub reused: bool,
}

/// A frequency response and its features.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// Rate over torque.
    pub response: FrequencyResponse,
    /// Its antiresonance and resonance.
    pub features: Features,
}

impl Estimate {
    fn of(response: FrequencyResponse) -> Self {
        Estimate { features: Features::of(&response), response }
    }
}

/// Values over the frequency, Hz.
pub type Curve = Vec<(f64, f64)>;

/// Estimates from the whole record.
#[derive(Clone, Debug)]
pub struct Record {
    /// By `spa`.
    pub spa: Estimate,
    /// By Welch's H1.
    pub h1: Estimate,
    /// Signal-to-noise ratio of the rate at resonance and antiresonance of `spa`, dB, from its
    /// coherence with the torque; `None` if there are no such.
    pub snr_db: Option<[f64; 2]>,
    /// The same, dB, over the band.
    pub snr_over_band: Curve,
    /// The thesis's linear model, fitted to the `spa` response, and over the band the coherence of
    /// its residual with the torque; `None` if nothing can be fitted.
    pub fit: Option<(ModelFit, Curve)>,
}

/// Estimates while a sweep passes, by sweep-synchronous demodulation.
#[derive(Clone, Debug)]
pub struct Passing {
    /// Response of the rate.
    pub rate: Estimate,
    /// Where in the sweep the slosh was rotary.
    pub rotary: Rotary,
    /// How much of the liquid's force was off the axis.
    pub off_axis: OffAxis,
    /// The leakage at the frequencies of `rate`.
    pub leakage: Vec<f64>,
    /// The crest's path seen from above.
    pub path: SloshPath,
}

impl Record {
    fn of(profile: &Profile, step: f64, tau: &[f64], omega: &[f64]) -> Option<Record> {
        let band = profile.band()?;
        let frequencies = logarithmic_grid(band, GRID_POINTS);
        let spa = Estimate::of(spa::frequency_response(step, tau, omega, &frequencies, spa::LAG));
        let spectra = Spectra::of(step, tau, omega, welch::RESPONSE);
        let snr = spectra.snr_db();
        let extrema = spa.features.f_res.zip(spa.features.f_dip);
        let fit = ModelFit::of(step, tau, omega, &spa.response, &spa.features);
        Some(Record {
            h1: Estimate::of(spectra.h1(band)),
            snr_db: extrema.map(|(res, antiresonance)| {
                [spectra.at(&snr, res), spectra.at(&snr, antiresonance)]
            }),
            snr_over_band: spectra.within(band, &snr),
            fit: fit.map(|(fit, spectra)| (fit, spectra.within(band, &spectra.coherence()))),
            spa,
        })
    }
}

impl Passing {
    fn of(sweep: &Sweep, table: &Table, arm: f64) -> Passing {
        let column = |name| table.column(name).unwrap_or_default();
        let signals = ["omega_imu", "slosh_angle_radial", "slosh_angle", "F_radial"];
        let [rate, radial, tangential, force] = demodulation::frequency_responses(
            sweep,
            column("time"),
            column("tau_cmd"),
            signals.map(column),
            &logarithmic_grid(sweep.band(), GRID_POINTS),
        );
        let swirl = rotary::swirl(&radial, &tangential, sweep.amplitude.abs());
        let passed = &radial.frequency;
        let times: Vec<f64> = passed.iter().filter_map(|f| sweep.time_of(*f)).collect();
        let rotary = Rotary::of(passed, &times, &swirl);
        let leakage = off_axis::leakage(&force, arm);
        Passing {
            rate: Estimate::of(rate),
            path: SloshPath::of(table, rotary.from.and_then(|f| sweep.time_of(f))),
            rotary,
            off_axis: OffAxis::of(column("F_radial"), column("F_tangential"), &leakage),
            leakage,
        }
    }
}

impl Outcome {
    /// From a stored run, and an initialised instance that tells the parameters.
    pub(super) fn of(
        case: &Case,
        run: &Run,
        instance: &mut Instance,
        table: &Table,
        reused: bool,
    ) -> Result<Outcome> {
        let linear = exact_linear(instance)?;
        let column = |name| table.column(name).unwrap_or_default();
        let (record, passing) = match &run.torque {
            Torque::Rows { .. } => (None, None),
            Torque::Profile(profile) => (
                Record::of(profile, run.step, column("tau_cmd"), column("omega_imu")),
                profile.sweep().map(|sweep| Passing::of(sweep, table, linear.arm)),
            ),
        };
        Ok(Outcome {
            case: case.clone(),
            model: case.model.clone().unwrap_or_default(),
            fill: instance.real("tank.h")?,
            tank_radius: instance.real("tank.d")? / 2.0,
            linear,
            figures: Figures::of(table),
            record,
            passing,
            reused,
        })
    }

    /// Features that go into `features.csv`: those of the demodulated response, which say what the
    /// hub did while the sweep passed, the sweep's shift of the resonance included (see the
    /// report).
    pub fn features(&self) -> Features {
        self.passing.as_ref().map_or(Features::default(), |passing| passing.rate.features)
    }

    /// Features of the `spa` response.
    pub fn spa_features(&self) -> Features {
        self.record.as_ref().map_or(Features::default(), |record| record.spa.features)
    }

    /// Features of the H1 response.
    pub fn h1_features(&self) -> Features {
        self.record.as_ref().map_or(Features::default(), |record| record.h1.features)
    }

    /// The fitted linear model.
    pub fn fit(&self) -> Option<ModelFit> {
        Some(self.record.as_ref()?.fit.as_ref()?.0)
    }

    /// Where in the sweep the slosh was rotary.
    pub fn rotary(&self) -> Option<Rotary> {
        Some(self.passing.as_ref()?.rotary)
    }

    /// How much of the liquid's force was off the axis.
    pub fn off_axis(&self) -> Option<OffAxis> {
        Some(self.passing.as_ref()?.off_axis)
    }

    /// The liquid's regime at its largest wave, from the wave height over the tank's radius (thesis
    /// 2.3.5): linear below 0.15, nonlinear above 0.25.
    pub fn regime(&self) -> &'static str {
        match self.figures.peak_wave_height / self.tank_radius {
            ratio if ratio < 0.15 => "linear",
            ratio if ratio <= 0.25 => "transitional",
            _ => "nonlinear",
        }
    }
}

/// The linear model with viscous friction that has the FMU's own (calculated) parameters.
pub(super) fn exact_linear(instance: &mut Instance) -> Result<Linear> {
    let mut real = |name: &str| instance.real(name);
    let arm = real("tank.r")?;
    let mut modes = Vec::new();
    for n in 1..=10 {
        let mass = real(&format!("slosh.mass[{n}]"))?;
        if mass > 0.0 {
            modes.push(Mode {
                mass,
                frequency: real(&format!("slosh.frequency[{n}]"))?,
                damping: real(&format!("slosh.damping[{n}]"))?,
            });
        }
    }
    let inertia = real("hub.I")? + real("tank.m_0")? * arm * arm;
    Ok(Linear { inertia, friction: real("friction.b")?, arm, modes })
}
