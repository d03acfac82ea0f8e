//! Rows of the tables: `features.csv` and `runs.csv`.

use super::outcome::{Estimate, Outcome};
use super::{Case, Failure, join_sentences};
use analysis::features::Features;
use analysis::residual::ModelFit;
use files::input;
use files::output::hash_reader;
use host::fmu::Fmu;

use self::Column::{Number, Text};

/// A row of a table of results. `run` is `None` for a run that was not analysed. `estimate` is the estimate that
/// gives the antiresonance and resonance of the row, with its name. `limits` are sentences about models that left
/// their range of validity, for a run that was not analysed.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    pub case: &'a Case,
    pub run: Option<&'a Outcome>,
    pub estimate: Option<(&'a Estimate, &'static str)>,
    pub limits: &'a [String],
}

/// Columns of the table of runs. A cell is empty if the value does not exist, or if it cannot be determined under the
/// torque of the run.
enum Column {
    Number(fn(&Row) -> Option<f64>),
    Text(fn(&Row) -> Option<String>),
}

const COLUMNS: [(&str, Column); 38] = [
    ("model", Text(|row| row.case.model.clone())),
    ("fill_m", Number(|row| row.case.fill)),
    ("amplitude_nm", Number(|row| row.case.amplitude)),
    ("f_res_hz", Number(|row| row.features()?.f_res)),
    ("f_dip_hz", Number(|row| row.features()?.f_dip)),
    ("delta_f_hz", Number(|row| row.features()?.delta_f())),
    ("notch_db", Number(|row| row.features()?.notch_db)),
    ("fit_freq_pct", Number(|row| Some(row.fit()?.fit_frequency))),
    ("fit_time_pct", Number(|row| Some(row.fit()?.fit_time))),
    ("coherence", Number(|row| row.fit()?.coherence)),
    ("snr_res_db", Number(|row| Some(row.run?.record.as_ref()?.snr_db?[0]))),
    ("snr_dip_db", Number(|row| Some(row.run?.record.as_ref()?.snr_db?[1]))),
    ("skewness", Number(|row| Some(row.fit()?.skewness))),
    ("kurtosis", Number(|row| Some(row.fit()?.kurtosis))),
    ("peak_slosh_angle_deg", Number(|row| Some(row.run?.totals.peak_slosh_angle.to_degrees()))),
    ("peak_radial_angle_deg", Number(|row| Some(row.run?.totals.peak_radial_angle.to_degrees()))),
    ("peak_wave_height_m", Number(|row| Some(row.run?.totals.peak_wave_height))),
    ("max_energy_residual", Number(|row| Some(row.run?.totals.max_energy_residual))),
    ("stuck_s", Number(|row| Some(row.run?.totals.stuck))),
    ("zero_hz", Number(|row| row.fit()?.model.zero_frequency())),
    ("zero_damping", Number(|row| row.fit()?.model.zero_damping())),
    ("pole_hz", Number(|row| Some(row.fit()?.model.pole_frequency()))),
    ("pole_damping", Number(|row| Some(row.fit()?.model.pole_damping))),
    ("rotary_from_hz", Number(|row| row.run?.rotary?.from)),
    ("rotary_to_hz", Number(|row| row.run?.rotary?.to)),
    ("swirl", Number(|row| Some(row.run?.rotary?.swirl))),
    ("rotary_s", Number(|row| Some(row.run?.rotary?.time))),
    ("off_axis_median", Number(|row| Some(row.run?.off_axis()?.median))),
    ("off_axis_energy", Number(|row| Some(row.run?.off_axis()?.energy))),
    ("leakage", Number(|row| Some(row.run?.off_axis()?.leakage))),
    ("regime", Text(|row| Some(row.run?.regime()?.into()))),
    ("estimator", Text(|row| Some(row.estimate?.1.into()))),
    ("not_trusted", Text(|row| Some(row.estimate?.0.doubt?.to_string()))),
    ("beyond_model", Text(|row| row.beyond_model())),
    ("f_res_std_hz", Number(|row| row.estimate?.0.deviations.f_res)),
    ("f_dip_std_hz", Number(|row| row.estimate?.0.deviations.f_dip)),
    ("peak_rate_rad_s", Number(|row| Some(row.run?.totals.peak_rate))),
    ("peak_acceleration_rad_s2", Number(|row| Some(row.run?.totals.peak_acceleration))),
];

impl<'a> Row<'a> {
    pub fn analysed(run: &'a Outcome, estimate: Option<(&'a Estimate, &'static str)>) -> Self {
        Row { case: &run.case, run: Some(run), estimate, limits: &[] }
    }

    pub fn unanalysed(case: &'a Case, limits: &'a [String]) -> Self {
        Row { case, run: None, estimate: None, limits }
    }

    pub fn columns() -> Vec<String> {
        COLUMNS.iter().map(|(name, _)| *name).chain(["plan_sha256"]).map(String::from).collect()
    }

    pub fn values(&self, plan_sha256: &str) -> Vec<String> {
        let text = |(_, column): &(&str, Column)| match column {
            Number(value) => number(value(self)),
            Text(value) => value(self).unwrap_or_default(),
        };
        COLUMNS.iter().map(text).chain([plan_sha256.into()]).collect()
    }

    fn features(&self) -> Option<Features> {
        Some(self.estimate?.0.features)
    }

    fn fit(&self) -> Option<ModelFit> {
        self.run?.fit()
    }

    fn beyond_model(&self) -> Option<String> {
        self.run.map_or_else(|| join_sentences(self.limits), Outcome::beyond_model)
    }
}

fn number(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map_or(String::new(), |value| format!("{value:?}"))
}

/// Columns of `runs.csv` that describe the simulation or recording of a run. The features follow them.
pub const MADE_FROM: [&str; 10] = [
    "name",
    "error",
    "fmu_sha256",
    "fmu_version",
    "profile",
    "step_s",
    "stop_s",
    "tolerance",
    "recording",
    "recording_sha256",
];

pub fn made_from(case: &Case, failure: Option<&Failure>, fmu: &Fmu) -> Vec<String> {
    let recording = case.recording.as_ref();
    let file = recording.and_then(|recording| input::open(&recording.path).ok());
    vec![
        case.name.clone(),
        failure.map_or(String::new(), |failure| failure.reason.clone()),
        fmu.hash().into(),
        fmu.description().version.clone(),
        case.profile.clone(),
        number(Some(case.step)),
        number(Some(case.stop)),
        number(case.tolerance),
        recording.map_or(String::new(), |recording| recording.path.display().to_string()),
        file.and_then(|file| hash_reader(file).ok()).unwrap_or_default(),
    ]
}
