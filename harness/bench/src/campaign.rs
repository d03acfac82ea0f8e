//! A campaign: the runs of a plan, made in parallel, each stored and analysed.
//!
//! A stored run is taken again, whoever made it, if `runs/<name>.parquet` is whole and its notes
//! (Parquet key-value metadata) hold the run's [recipe](Campaign::recipe), to the letter. Everything
//! in the tables comes from the run's [columns](STORED); so another importer that writes the columns
//! and the notes given by [`Campaign::list`] gets the same tables.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use serde_json::json;

use crate::analysis::features::Features;
use crate::analysis::linear::{Linear, Mode};
use crate::analysis::off_axis::{self, OffAxis};
use crate::analysis::residual::ModelFit;
use crate::analysis::rotary::{self, Rotary};
use crate::analysis::welch::{self, Spectra};
use crate::analysis::{FrequencyResponse, demodulation, logarithmic_grid, spa};
use crate::plan::{Case, Plan};
use crate::profile::Torque;
use crate::progress::Progress;
use crate::run::Run;
use crate::table::{self, Table};
use host::description::Value;
use host::fmi2::{Fmu, Instance};
use host::output;

/// Columns of a stored run, SI units, at every communication point from the torque's start to the
/// stop time; others may follow. The first six are what people look at; wave height, energy,
/// work, heat, the time stuck and the liquid's force on the tank are there for the tables.
pub const STORED: [&str; 13] = [
    "time",
    "tau_cmd",
    "omega",
    "omega_imu",
    "slosh_angle",
    "slosh_angle_radial",
    "wave_height",
    "energy",
    "work",
    "heat",
    "stuck_time",
    "F_tangential",
    "F_radial",
];

/// Frequencies at which responses are evaluated: 1.2 mHz apart at the dip of the thesis's sweep.
const GRID_POINTS: usize = 2000;

/// A plan that is carried out.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// What is to be done.
    pub plan: Plan,
    /// Do again what is there already.
    pub force: bool,
    /// Directory for runs, tables and report.
    pub out: PathBuf,
}

/// Figures of a run as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    fn of(table: &Table) -> Self {
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
            stuck: column("stuck_time").last().copied().unwrap_or(0.0),
        }
    }
}

/// The wave's path seen from above, in two short stretches of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SloshPath {
    /// Where the wave is largest: angles outwards and towards +θ, rad.
    pub largest: Vec<(f64, f64)>,
    /// Around the moment at which it begins to turn; empty if it does not.
    pub onset: Vec<(f64, f64)>,
}

impl SloshPath {
    /// Length of the stretch around the largest wave, s.
    pub const LARGEST: f64 = 3.0;
    /// Length of the stretch around the beginning, s.
    pub const ONSET: f64 = 16.0;

    fn of(table: &Table, onset: Option<f64>) -> Self {
        let column = |name| table.column(name).unwrap_or_default();
        let (time, radial, tangential) =
            (column("time"), column("slosh_angle_radial"), column("slosh_angle"));
        let size = |i: usize| radial[i].hypot(tangential[i]);
        let top = (0..time.len()).max_by(|&a, &b| size(a).total_cmp(&size(b))).map(|i| time[i]);
        let stretch = |centre: Option<f64>, length: f64| {
            let Some(centre) = centre else { return Vec::new() };
            (0..time.len())
                .filter(|&i| (time[i] - centre).abs() <= length / 2.0)
                .map(|i| (radial[i], tangential[i]))
                .collect()
        };
        SloshPath { largest: stretch(top, Self::LARGEST), onset: stretch(onset, Self::ONSET) }
    }
}

/// A run that was made (or was there), and what it shows.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Which run.
    pub case: Case,
    /// Of the run as a whole.
    pub figures: Figures,
    /// Response by sweep-synchronous demodulation; empty if the torque is no sweep.
    pub demodulated: FrequencyResponse,
    /// Response by `spa`; empty if the torque is neither sweep nor noise.
    pub spa: FrequencyResponse,
    /// Response by Welch's H1 estimate; empty if the torque is neither sweep nor noise.
    pub h1: FrequencyResponse,
    /// Dip and peak of the demodulated response.
    pub demodulated_features: Features,
    /// Dip and peak of the `spa` response.
    pub spa_features: Features,
    /// Dip and peak of the H1 response.
    pub h1_features: Features,
    /// The thesis's linear model, fitted to the `spa` response.
    pub fit: Option<ModelFit>,
    /// Signal-to-noise ratio of the rate at the peak and at the dip, dB, from its coherence
    /// with the torque.
    pub snr_db: Option<[f64; 2]>,
    /// The same, dB, over the band: frequency (Hz) and ratio.
    pub snr_over_band: Vec<(f64, f64)>,
    /// Coherence of what the fit leaves with the torque over the band: frequency (Hz) and coherence.
    pub coherence_over_band: Vec<(f64, f64)>,
    /// Where in the sweep the liquid turned.
    pub rotary: Option<Rotary>,
    /// How much of the liquid's force was off the axis, in a sweep.
    pub off_axis: Option<OffAxis>,
    /// The leakage at the demodulated response's frequencies; empty if the torque is no sweep.
    pub leakage: Vec<f64>,
    /// The wave's path seen from above; empty if the torque is no sweep.
    pub path: SloshPath,
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

impl Campaign {
    /// Makes all runs that are not there yet and analyses all of them. Leaves the runs and the
    /// plan's text in the directory; tables are written by [`Campaign::write_tables`].
    pub fn execute(&self, fmu: &Fmu, watch: &(dyn Fn(Progress) + Sync)) -> Result<Results> {
        let cases = self.plan.cases(fmu.description())?;
        let runs = self.out.join("runs");
        output::directory(&runs)?;
        output::atomically(&self.plan_file(), |file| {
            Ok(std::io::Write::write_all(file, self.plan.text.as_bytes())?)
        })?;
        let steps: u64 = cases.iter().map(|case| case.run().steps() as u64).sum();
        watch(Progress::Begins { runs: cases.len(), steps });
        let results: Vec<Result<Outcome>> =
            cases.par_iter().map(|case| self.outcome(fmu, case, &runs, watch)).collect();

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

    /// The copy of the plan beside the results.
    fn plan_file(&self) -> PathBuf {
        self.out.join("plan.toml")
    }

    /// The command that makes everything in the directory again.
    pub fn command(&self, fmu: &Fmu) -> String {
        let word = |path: &Path| {
            let text = path.display().to_string();
            if text.contains(' ') { format!("\"{text}\"") } else { text }
        };
        format!(
            "hubslosh campaign --plan {} --fmu {} --out {}",
            word(&self.plan_file()),
            word(fmu.path()),
            word(&self.out)
        )
    }

    /// The expanded runs for another program to make: for each its name, its file in the campaign's
    /// directory, what to set, the torque (as text for `hubslosh torque`), times, and the notes
    /// that its Parquet file must carry for the analysis to take it.
    pub fn list(&self, fmu: &Fmu) -> Result<serde_json::Value> {
        let description = fmu.description();
        let mut runs = Vec::new();
        for case in self.plan.cases(description)? {
            let run = case.run();
            let mut settings = serde_json::Map::new();
            for (name, text) in &case.settings {
                let value = match description.value(description.variable(name)?, text)? {
                    // an enumeration keeps its item's name
                    Value::Integer(i) if i.to_string() == *text => json!(i),
                    Value::Integer(_) => json!(text),
                    Value::Real(x) => json!(x),
                    Value::Boolean(b) => json!(b),
                    Value::String(s) => json!(s),
                };
                settings.insert(name.clone(), value);
            }
            runs.push(json!({
                "name": case.name,
                "file": format!("runs/{}.parquet", case.name),
                "varied": self.plan.varied().into_iter().zip(&case.varied).collect::<BTreeMap<_, _>>(),
                "settings": settings,
                "profile": case.profile,
                "start": run.start(),
                "stop": run.stop,
                "step": run.step,
                "steps": run.steps(),
                "tolerance": run.tolerance,
                "hold": run.hold,
                "notes": recipe(fmu, &case),
            }));
        }
        Ok(json!({
            "title": self.plan.title,
            "fmu": {
                "path": fmu.path(),
                "sha256": fmu.hash(),
                "guid": description.guid,
                "version": description.version,
            },
            "out": self.out,
            "columns": STORED,
            "runs": runs,
        }))
    }

    fn outcome(
        &self,
        fmu: &Fmu,
        case: &Case,
        runs: &Path,
        watch: &(dyn Fn(Progress) + Sync),
    ) -> Result<Outcome> {
        let run = case.run();
        let path = runs.join(format!("{}.parquet", case.name));
        let recipe = recipe(fmu, case);
        let mut instance = run.initialise(fmu)?;
        let linear = exact_linear(&mut instance)?;
        let tank_radius = instance.real("tank.d")? / 2.0;
        let there = match self.force || !path.exists() {
            true => None,
            false => stored(&path, &run, &recipe)
                .map_err(|why| {
                    watch(Progress::Note(format!("{} is made again: {why:#}", path.display())))
                })
                .ok(),
        };
        let reused = there.is_some();
        let table = match there {
            Some(table) => {
                watch(Progress::Steps(run.steps() as u64));
                table
            }
            None => {
                // `time` and `tau_cmd` are there anyway
                let table =
                    run.drive(&mut instance, &STORED[2..], |steps| watch(Progress::Steps(steps)))?;
                table.write(&path, &recipe)?;
                table
            }
        };
        drop(instance);

        let column = |name| table.column(name).unwrap_or_default();
        let (time, tau, omega) = (column("time"), column("tau_cmd"), column("omega_imu"));
        let mut outcome = Outcome {
            case: case.clone(),
            figures: Figures::of(&table),
            demodulated: FrequencyResponse::default(),
            spa: FrequencyResponse::default(),
            h1: FrequencyResponse::default(),
            demodulated_features: Features::default(),
            spa_features: Features::default(),
            h1_features: Features::default(),
            fit: None,
            snr_db: None,
            snr_over_band: Vec::new(),
            coherence_over_band: Vec::new(),
            rotary: None,
            off_axis: None,
            leakage: Vec::new(),
            path: SloshPath::default(),
            linear,
            tank_radius,
            reused,
        };
        let Torque::Profile(profile) = &run.torque else {
            return Ok(outcome);
        };
        let Some(band) = profile.band() else {
            return Ok(outcome);
        };
        let frequencies = logarithmic_grid(band, GRID_POINTS);
        outcome.spa = spa::frequency_response(run.step, tau, omega, &frequencies, spa::LAG);
        outcome.spa_features = Features::of(&outcome.spa);
        let spectra = Spectra::of(run.step, tau, omega, welch::RESPONSE);
        outcome.h1 = spectra.h1(band);
        outcome.h1_features = Features::of(&outcome.h1);
        let snr = spectra.snr_db();
        outcome.snr_over_band = spectra.within(band, &snr);
        outcome.snr_db = outcome
            .spa_features
            .f_res
            .zip(outcome.spa_features.f_dip)
            .map(|(peak, dip)| [spectra.at(&snr, peak), spectra.at(&snr, dip)]);
        if let Some((fit, spectra)) =
            ModelFit::of(run.step, tau, omega, &outcome.spa, &outcome.spa_features)
        {
            outcome.coherence_over_band = spectra.within(band, &spectra.coherence());
            outcome.fit = Some(fit);
        }
        if let (true, Some(amplitude)) = (profile.is_sweep(), case.amplitude) {
            let signals = ["omega_imu", "slosh_angle_radial", "slosh_angle", "F_radial"];
            let [response, radial, tangential, force] = demodulation::frequency_responses(
                profile,
                time,
                tau,
                signals.map(column),
                &frequencies,
            );
            outcome.demodulated_features = Features::of(&response);
            outcome.demodulated = response;
            let swirl = rotary::swirl(&radial, &tangential, amplitude.abs());
            let passed = &radial.frequency;
            let times: Vec<f64> = passed.iter().filter_map(|f| profile.time_of(*f)).collect();
            let turned = Rotary::of(passed, &times, &swirl);
            outcome.path = SloshPath::of(&table, turned.from.and_then(|f| profile.time_of(f)));
            outcome.rotary = Some(turned);
            outcome.leakage = off_axis::leakage(&force, outcome.linear.arm);
            let (radial, tangential) = (column("F_radial"), column("F_tangential"));
            outcome.off_axis = Some(OffAxis::of(radial, tangential, &outcome.leakage));
        }
        Ok(outcome)
    }

    /// Writes `features.csv`, `features_spa.csv` and `features_h1.csv` with the same columns from the
    /// `spa` and H1 responses, and `runs.csv`: every run, failed ones too, with what it was made from and all figures.
    pub fn write_tables(&self, fmu: &Fmu, results: &Results) -> Result<()> {
        let write = |name: &str, header: &[&str], rows: Vec<Vec<String>>| {
            output::atomically(&self.out.join(name), |file| {
                let mut writer = csv::Writer::from_writer(file);
                writer.write_record(header)?;
                for row in rows {
                    writer.write_record(row)?;
                }
                writer.flush().context("the disk refused")
            })
        };
        let features = |of: fn(&Outcome) -> &Features| {
            results.outcomes.iter().map(|outcome| outcome.row(of(outcome)).to_vec()).collect()
        };
        write("features.csv", &HEADER, features(Outcome::features))?;
        write("features_spa.csv", &HEADER, features(|outcome| &outcome.spa_features))?;
        write("features_h1.csv", &HEADER, features(|outcome| &outcome.h1_features))?;

        const MADE_FROM: [&str; 8] = [
            "name",
            "error",
            "fmu_sha256",
            "fmu_version",
            "profile",
            "step_s",
            "stop_s",
            "tolerance",
        ];
        let header = [&MADE_FROM, &self.plan.varied()[..], &HEADER].concat();
        let row = |case: &Case, error: &str, figures: Vec<String>| {
            let made_from = [
                case.name.clone(),
                error.to_string(),
                fmu.hash().to_string(),
                fmu.description().version.clone(),
                case.profile.clone(),
                case.step.to_string(),
                case.stop.to_string(),
                case.tolerance.map_or(String::new(), |t| t.to_string()),
            ];
            [made_from.to_vec(), case.varied.clone(), figures].concat()
        };
        let made = results
            .outcomes
            .iter()
            .map(|outcome| row(&outcome.case, "", outcome.row(outcome.features()).to_vec()));
        let failed = results.failures.iter().map(|failure| {
            let mut figures = vec![String::new(); HEADER.len()];
            for (place, value) in figures.iter_mut().zip(identity(&failure.case)) {
                *place = value;
            }
            row(&failure.case, &failure.reason, figures)
        });
        write("runs.csv", &header, made.chain(failed).collect())
    }
}

/// What a run was made from: two runs with the same recipe are the same run. These are the notes
/// of its Parquet file, which may hold others too:
///
/// * `fmu`, `guid`, `version`: SHA-256 of the FMU's file, and what it says of itself,
/// * `settings`: what is set before the start, `name=value` in this order, parted by spaces,
/// * `profile`: the torque; `torque_sha256`: of the file, if it comes from one,
/// * `step`, `stop`: s; `tolerance`: the relative tolerance handed to the FMU,
/// * `torque`: whether the FMU is told the torque's slope over each step.
fn recipe(fmu: &Fmu, case: &Case) -> BTreeMap<String, String> {
    let settings: Vec<_> = case.settings.iter().map(|(k, v)| format!("{k}={v}")).collect();
    let torque = if case.hold { "held over each step" } else { "linear over each step" };
    let mut recipe = BTreeMap::from(
        [
            ("fmu", fmu.hash().to_string()),
            ("guid", fmu.description().guid.clone()),
            ("version", fmu.description().version.clone()),
            ("settings", settings.join(" ")),
            ("profile", case.profile.clone()),
            ("step", case.step.to_string()),
            ("stop", case.stop.to_string()),
            ("tolerance", case.tolerance.map_or("the FMU's own".into(), |t| t.to_string())),
            ("torque", torque.to_string()),
        ]
        .map(|(key, value)| (key.to_string(), value)),
    );
    if let Some(hash) = &case.torque_sha256 {
        recipe.insert("torque_sha256".into(), hash.clone());
    }
    recipe
}

/// The stored run, if it is whole and of this recipe; else why not.
fn stored(path: &Path, run: &Run, recipe: &BTreeMap<String, String>) -> Result<Table> {
    let notes = table::notes(path).context("it is not whole")?;
    for (key, wanted) in recipe {
        let found = notes.get(key).with_context(|| format!("it has no note \"{key}\""))?;
        ensure!(found == wanted, "its note \"{key}\" is \"{found}\", not \"{wanted}\"");
    }
    let table = Table::read(path, &STORED)?;
    let last = table.column("time").and_then(|time| time.last()).copied();
    ensure!(
        table.rows() == run.steps() + 1 && last == Some(run.stop),
        "it has {} rows to {:?} s, not {} to {} s",
        table.rows(),
        last.unwrap_or(f64::NAN),
        run.steps() + 1,
        run.stop
    );
    Ok(table)
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
pub const HEADER: [&str; 31] = [
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
    "rotary_s",
    "off_axis_median",
    "off_axis_energy",
    "leakage",
    "regime",
];

impl Outcome {
    /// The features that go into `features.csv`: those of the demodulated response, which say what
    /// the hub did while the sweep passed, the sweep's shift of the peak included (see the report).
    pub fn features(&self) -> &Features {
        &self.demodulated_features
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

    /// Its row with these features; figures that are not found, or that its torque cannot show,
    /// stay empty.
    fn row(&self, features: &Features) -> [String; 31] {
        let figures = &self.figures;
        let number = |value: Option<f64>| value.map_or(String::new(), |v| v.to_string());
        let mut row: [String; 31] = Default::default();
        for (place, value) in row.iter_mut().zip(identity(&self.case)) {
            *place = value;
        }
        let mut put = |name: &str, value: String| {
            let place = HEADER.iter().position(|h| *h == name).expect("a column of the header");
            row[place] = value;
        };
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
            put("coherence", number(fit.coherence));
            put("skewness", fit.skewness.to_string());
            put("kurtosis", fit.kurtosis.to_string());
            put("zero_hz", fit.model.zero_frequency().to_string());
            put("zero_damping", fit.model.zero_damping().to_string());
            put("pole_hz", fit.model.pole_frequency().to_string());
            put("pole_damping", fit.model.pole_damping.to_string());
        }
        put("snr_res_db", number(self.snr_db.map(|[peak, _]| peak)));
        put("snr_dip_db", number(self.snr_db.map(|[_, dip]| dip)));
        if let Some(rotary) = &self.rotary {
            put("rotary_from_hz", number(rotary.from));
            put("rotary_to_hz", number(rotary.to));
            put("swirl", rotary.swirl.to_string());
            put("rotary_s", rotary.time.to_string());
        }
        if let Some(off_axis) = &self.off_axis {
            put("off_axis_median", off_axis.median.to_string());
            put("off_axis_energy", off_axis.energy.to_string());
            put("leakage", off_axis.leakage.to_string());
        }
        put("regime", self.regime().into());
        row
    }
}

/// The first three columns of a row: model, fill, amplitude.
fn identity(case: &Case) -> [String; 3] {
    let amplitude = case.amplitude.map_or(String::new(), |a| a.to_string());
    [case.model.clone(), case.fill.to_string(), amplitude]
}
