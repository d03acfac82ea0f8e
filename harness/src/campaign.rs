//! A campaign: the same sweep at several fills and amplitudes, in parallel, each
//! run stored and analysed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::analysis::features::Features;
use crate::analysis::linear::{Linear, Mode};
use crate::analysis::residual::ModelFit;
use crate::analysis::rotary::{self, Rotary};
use crate::analysis::welch::Spectra;
use crate::analysis::{BAND, FrequencyResponse, demodulation, logarithmic_grid, spa};
use crate::fmi2::{Fmu, Instance};
use crate::output;
use crate::profile::{Profile, Torque};
use crate::run::Run;
use crate::table::{self, Table};

/// The thesis's fills, m.
pub const FILLS: [f64; 2] = [0.05, 0.10];
/// The thesis's amplitudes, N·m (its Table 5.2 and chapter 7).
pub const AMPLITUDES: [f64; 11] =
    [0.0125, 0.025, 0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2, 0.225, 0.25];
/// Communication step: the thesis's IMU at 50 Hz, s.
pub const STEP: f64 = 0.02;

/// Columns of a stored run.
const STORED: [&str; 6] =
    ["time", "tau_cmd", "omega", "omega_imu", "slosh_angle", "slosh_angle_radial"];
/// Variables looked at while running, beside `time` and `tau_cmd`.
const WATCHED: [&str; 8] = [
    "omega",
    "omega_imu",
    "slosh_angle",
    "slosh_angle_radial",
    "wave_height",
    "energy",
    "work",
    "heat",
];

/// Frequencies at which responses are evaluated: 1.2 mHz apart at the dip.
const GRID_POINTS: usize = 2000;

/// How the frequency grows during the sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Sweep {
    /// Exponentially.
    Exponential,
    /// Evenly.
    Linear,
}

/// What a campaign does.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Values of `slosh.model`, by name.
    pub models: Vec<String>,
    /// Fills (`tank.h`), m.
    pub fills: Vec<f64>,
    /// Torque amplitudes, N·m.
    pub amplitudes: Vec<f64>,
    /// The sweep: 1.25 to 3.5 Hz in 2700 s.
    pub sweep: Sweep,
    /// Further start values by FMU name.
    pub settings: Vec<(String, String)>,
    /// Relative tolerance of the FMU's solver; `None`: the FMU's own.
    pub tolerance: Option<f64>,
    /// Do again what is there already.
    pub force: bool,
    /// Directory for runs, features and report.
    pub out: PathBuf,
}

/// One run of a campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Value of `slosh.model`.
    pub model: String,
    /// Fill, m.
    pub fill: f64,
    /// Torque amplitude, N·m.
    pub amplitude: f64,
}

impl Case {
    /// `linear_100mm_12.5`: model, fill in mm, amplitude in mN·m.
    pub fn name(&self) -> String {
        let [fill, amplitude] = [self.fill, self.amplitude].map(thousandths);
        format!("{}_{fill}mm_{amplitude}", self.model)
    }
}

/// A quantity in thousandths of its unit, without the dust of binary fractions.
pub fn thousandths(value: f64) -> f64 {
    (value * 1e9).round() / 1e6
}

/// Figures that are collected while a run goes on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Largest |slosh_angle|, rad.
    pub peak_slosh_angle: f64,
    /// Largest |slosh_angle_radial|, rad.
    pub peak_radial_angle: f64,
    /// Largest wave height, m.
    pub peak_wave_height: f64,
    /// Largest |E(t) − E(0) − work + heat| over the energy turned over.
    pub max_energy_residual: f64,
    /// Time the bearing stuck, s.
    pub stuck: f64,
}

impl Figures {
    fn of(table: &Table, stuck: f64) -> Self {
        let column = |name| table.column(name).unwrap_or_default();
        let peak = |name| column(name).iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let (energy, work, heat) = (column("energy"), column("work"), column("heat"));
        // turned over: what went in and out through the torque, and what became heat
        let turned: f64 = work.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>()
            + heat.last().copied().unwrap_or(0.0);
        let residual = (0..energy.len())
            .map(|i| (energy[i] - energy[0] - (work[i] - work[0]) + (heat[i] - heat[0])).abs())
            .fold(0.0, f64::max);
        Figures {
            peak_slosh_angle: peak("slosh_angle"),
            peak_radial_angle: peak("slosh_angle_radial"),
            peak_wave_height: peak("wave_height"),
            max_energy_residual: if turned > 0.0 { residual / turned } else { 0.0 },
            stuck,
        }
    }
}

/// A run that was made (or was there), and what it shows.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Which run.
    pub case: Case,
    /// Collected while it went on.
    pub figures: Figures,
    /// Response by sweep-synchronous demodulation.
    pub demodulated: FrequencyResponse,
    /// Response by `spa`.
    pub spa: FrequencyResponse,
    /// Dip and peak of the demodulated response.
    pub demodulated_features: Features,
    /// Dip and peak of the `spa` response.
    pub spa_features: Features,
    /// The thesis's linear model, fitted to the `spa` response.
    pub fit: Option<ModelFit>,
    /// Signal-to-noise ratio of the rate at the peak and at the dip, dB, from its coherence
    /// with the torque.
    pub snr_db: Option<[f64; 2]>,
    /// Where the liquid turned.
    pub rotary: Rotary,
    /// Its exact linear counterpart with viscous friction, from the FMU's calculated parameters.
    pub linear: Linear,
    /// Radius of the tank, m.
    pub tank_radius: f64,
    /// It was there already.
    pub reused: bool,
}

/// A run that failed, and why.
#[derive(Clone, Debug)]
pub struct Failure {
    /// Which run.
    pub case: Case,
    /// Why.
    pub reason: String,
}

/// All that a campaign found.
#[derive(Clone, Debug, Default)]
pub struct Results {
    /// Runs, by model, fill and amplitude as in the plan.
    pub outcomes: Vec<Outcome>,
    /// Runs that failed.
    pub failures: Vec<Failure>,
}

impl Plan {
    /// The thesis's 22 runs with the linear model.
    pub fn thesis(out: &Path) -> Self {
        Plan {
            models: vec!["linear".into()],
            fills: FILLS.to_vec(),
            amplitudes: AMPLITUDES.to_vec(),
            sweep: Sweep::Exponential,
            settings: Vec::new(),
            tolerance: None,
            force: false,
            out: out.to_path_buf(),
        }
    }

    /// Its runs.
    pub fn cases(&self) -> Vec<Case> {
        let mut cases = Vec::new();
        for model in &self.models {
            for &fill in &self.fills {
                for &amplitude in &self.amplitudes {
                    cases.push(Case { model: model.clone(), fill, amplitude });
                }
            }
        }
        cases
    }

    /// The sweep with the amplitude of a case.
    pub fn profile(&self, amplitude: f64) -> Profile {
        let ((f0, f1), duration) = (BAND, 2700.0);
        match self.sweep {
            Sweep::Exponential => Profile::ExpSweep { amplitude, f0, f1, duration },
            Sweep::Linear => Profile::LinSweep { amplitude, f0, f1, duration },
        }
    }

    fn run(&self, case: &Case) -> Run {
        let mut settings = vec![
            ("slosh.model".to_string(), case.model.clone()),
            ("tank.h".to_string(), case.fill.to_string()),
        ];
        settings.extend(self.settings.iter().cloned());
        let profile = self.profile(case.amplitude);
        Run {
            settings,
            torque: Torque::Profile(profile),
            step: STEP,
            stop: profile.duration(),
            tolerance: self.tolerance,
            hold: false,
        }
    }

    /// Makes all runs that are not there yet and analyses all of them.
    pub fn execute(&self, fmu: &Fmu) -> Result<Results> {
        for (name, values) in [("fills", &self.fills), ("amplitudes", &self.amplitudes)] {
            ensure!(!values.is_empty(), "a campaign needs {name}");
            if let Some(value) = values.iter().find(|v| !v.is_finite()) {
                bail!("{name} must be numbers, not {value}");
            }
        }
        for fixed in ["slosh.model", "tank.h", "tau_cmd"] {
            ensure!(
                self.settings.iter().all(|(name, _)| name != fixed),
                "{fixed} is what the campaign varies; use --model, --fills, --amplitudes"
            );
        }
        let runs = self.out.join("runs");
        output::directory(&runs)?;
        let cases = self.cases();
        let steps: u64 = cases.iter().map(|case| self.run(case).steps() as u64).sum();
        let bar = ProgressBar::new(steps).with_style(ProgressStyle::with_template(
            "{msg} {bar:40} {percent:>3} %  {elapsed} gone, {eta} to go",
        )?);
        bar.set_message(format!("{} runs", cases.len()));
        let frequencies = logarithmic_grid(BAND, GRID_POINTS);
        let results: Vec<Result<Outcome>> = cases
            .par_iter()
            .map(|case| {
                let path = runs.join(case.name() + ".parquet");
                self.outcome(fmu, case, &path, &frequencies, &bar)
            })
            .collect();
        bar.finish_and_clear();

        let mut collected = Results::default();
        for (case, result) in cases.into_iter().zip(results) {
            match result {
                Ok(outcome) => collected.outcomes.push(outcome),
                Err(error) => {
                    collected.failures.push(Failure { case, reason: format!("{error:#}") })
                }
            }
        }
        Ok(collected)
    }

    fn outcome(
        &self,
        fmu: &Fmu,
        case: &Case,
        path: &Path,
        frequencies: &[f64],
        bar: &ProgressBar,
    ) -> Result<Outcome> {
        let run = self.run(case);
        let recipe = self.recipe(fmu, &run, case);
        let mut instance = run.initialise(fmu)?;
        let linear = exact_linear(&mut instance)?;
        let tank_radius = instance.real("tank.d")? / 2.0;
        let there = if self.force { None } else { stored(path, &recipe) };
        let reused = there.is_some();
        let (table, figures) = match there {
            Some(found) => {
                bar.inc(run.steps() as u64);
                found
            }
            None => {
                let table = run.drive(&mut instance, &WATCHED, |steps| bar.inc(steps))?;
                let figures = Figures::of(&table, instance.real("stuck_time")?);
                let table = table.only(&STORED);
                let mut notes = recipe;
                notes.insert("figures".into(), serde_json::to_string(&figures)?);
                table.write(path, &notes)?;
                (table, figures)
            }
        };
        drop(instance);

        let column = |name| table.column(name).unwrap_or_default();
        let (time, tau, omega) = (column("time"), column("tau_cmd"), column("omega_imu"));
        let sweep = self.profile(case.amplitude);
        let demodulated = demodulation::frequency_response(&sweep, time, tau, omega, frequencies);
        let spa = spa::frequency_response(STEP, tau, omega, frequencies, spa::LAG);
        let spa_features = Features::of(&spa);
        let spectra = Spectra::of(STEP, tau, omega);
        let snr_db = spa_features
            .f_res
            .zip(spa_features.f_dip)
            .map(|(peak, dip)| [spectra.snr_db(peak), spectra.snr_db(dip)]);
        let slosh =
            |name| demodulation::frequency_response(&sweep, time, tau, column(name), frequencies);
        let (radial, tangential) = (slosh("slosh_angle_radial"), slosh("slosh_angle"));
        let swirl = rotary::swirl(&radial, &tangential, case.amplitude);
        Ok(Outcome {
            case: case.clone(),
            figures,
            demodulated_features: Features::of(&demodulated),
            fit: ModelFit::of(STEP, tau, omega, &spa, &spa_features),
            snr_db,
            rotary: Rotary::of(&radial.frequency, &swirl),
            spa_features,
            demodulated,
            spa,
            linear,
            tank_radius,
            reused,
        })
    }

    /// What a run was made from: two runs with the same recipe are the same run.
    fn recipe(&self, fmu: &Fmu, run: &Run, case: &Case) -> BTreeMap<String, String> {
        let settings: Vec<_> = run.settings.iter().map(|(k, v)| format!("{k}={v}")).collect();
        BTreeMap::from(
            [
                ("fmu", fmu.hash().to_string()),
                ("guid", fmu.description().guid.clone()),
                ("version", fmu.description().version.clone()),
                ("settings", settings.join(" ")),
                ("profile", self.profile(case.amplitude).to_string()),
                ("step", run.step.to_string()),
                ("stop", run.stop.to_string()),
                ("tolerance", run.tolerance.map_or("the FMU's own".into(), |t| t.to_string())),
                ("torque", "linear over each step".to_string()),
            ]
            .map(|(key, value)| (key.to_string(), value)),
        )
    }
}

/// The stored run, if it is there, whole, and of this recipe.
fn stored(path: &Path, recipe: &BTreeMap<String, String>) -> Option<(Table, Figures)> {
    let mut notes = table::notes(path).ok()?;
    let figures = serde_json::from_str(&notes.remove("figures")?).ok()?;
    if &notes != recipe {
        return None;
    }
    Some((Table::read(path, &STORED).ok()?, figures))
}

/// The linear model with viscous friction that has the FMU's own (calculated) parameters.
fn exact_linear(instance: &mut Instance) -> Result<Linear> {
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

/// Columns of `features.csv`.
pub const HEADER: [&str; 26] = [
    "model",
    "fill_m",
    "amplitude_nm",
    "f_res_hz",
    "f_dip_hz",
    "delta_f_hz",
    "notch_db",
    "fit_freq_pct",
    "fit_time_pct",
    "coherence",
    "snr_res_db",
    "snr_dip_db",
    "skewness",
    "kurtosis",
    "peak_slosh_angle_deg",
    "peak_radial_angle_deg",
    "peak_wave_height_m",
    "max_energy_residual",
    "stuck_s",
    "zero_hz",
    "zero_damping",
    "pole_hz",
    "pole_damping",
    "rotary_from_hz",
    "rotary_to_hz",
    "swirl",
];

impl Outcome {
    /// The features that go into `features.csv`: those of the demodulated response, which say what
    /// the hub did while the sweep passed, the sweep's shift of the peak included (see the report).
    pub fn features(&self) -> &Features {
        &self.demodulated_features
    }

    /// Its row with these features; figures that are not found stay empty.
    fn row(&self, features: &Features) -> [String; 26] {
        let figures = &self.figures;
        let number = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
        let mut row: [String; 26] = Default::default();
        let mut put = |name: &str, value: String| {
            let place = HEADER.iter().position(|h| *h == name).expect("a column of the header");
            row[place] = value;
        };
        put("model", self.case.model.clone());
        put("fill_m", self.case.fill.to_string());
        put("amplitude_nm", self.case.amplitude.to_string());
        put("f_res_hz", number(features.f_res));
        put("f_dip_hz", number(features.f_dip));
        put("delta_f_hz", number(features.delta_f()));
        put("notch_db", number(features.notch_db));
        put("peak_slosh_angle_deg", figures.peak_slosh_angle.to_degrees().to_string());
        put("peak_radial_angle_deg", figures.peak_radial_angle.to_degrees().to_string());
        put("peak_wave_height_m", figures.peak_wave_height.to_string());
        put("max_energy_residual", figures.max_energy_residual.to_string());
        put("stuck_s", figures.stuck.to_string());
        if let Some(fit) = &self.fit {
            put("fit_freq_pct", fit.fit_frequency.to_string());
            put("fit_time_pct", fit.fit_time.to_string());
            put("coherence", fit.coherence.to_string());
            put("skewness", fit.skewness.to_string());
            put("kurtosis", fit.kurtosis.to_string());
            put("zero_hz", fit.model.zero_frequency().to_string());
            put("zero_damping", fit.model.zero_damping().to_string());
            put("pole_hz", fit.model.pole_frequency().to_string());
            put("pole_damping", fit.model.pole_damping.to_string());
        }
        put("snr_res_db", number(self.snr_db.map(|[peak, _]| peak)));
        put("snr_dip_db", number(self.snr_db.map(|[_, dip]| dip)));
        put("rotary_from_hz", number(self.rotary.from));
        put("rotary_to_hz", number(self.rotary.to));
        put("swirl", self.rotary.swirl.to_string());
        row
    }
}

/// Writes `features.csv`, and `features_spa.csv` with the same columns from the `spa` responses.
pub fn write_features(outcomes: &[Outcome], directory: &Path) -> Result<()> {
    let write = |name: &str, features: fn(&Outcome) -> &Features| {
        output::atomically(&directory.join(name), |file| {
            let mut writer = csv::Writer::from_writer(file);
            writer.write_record(HEADER)?;
            for outcome in outcomes {
                writer.write_record(outcome.row(features(outcome)))?;
            }
            writer.flush().context("the disk refused")
        })
    };
    write("features.csv", Outcome::features)?;
    write("features_spa.csv", |outcome| &outcome.spa_features)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_thesis_campaign_has_22_runs_with_plain_names() {
        let cases = Plan::thesis(Path::new("dist/campaign")).cases();
        assert_eq!(cases.len(), 22);
        assert_eq!(cases[0].name(), "linear_50mm_12.5");
        assert_eq!(cases[21].name(), "linear_100mm_250");
        let other = Case { model: "planar".into(), fill: 0.07, amplitude: 0.1 + 0.2 };
        assert_eq!(other.name(), "planar_70mm_300");
    }
}
