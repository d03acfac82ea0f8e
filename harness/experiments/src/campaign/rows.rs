//! Rows of the tables: `features.csv` and `runs.csv`.

use anyhow::{Context, Result};
use serde::Serialize;

use super::outcome::{Estimate, Outcome};
use super::{Case, Failure};
use analysis::features::Features;
use files::input;
use files::output::hash_reader;

/// A row of `features.csv`. Values that do not exist, or that the torque cannot show, are empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FeatureRow {
    model: Option<String>,
    fill_m: Option<f64>,
    amplitude_nm: Option<f64>,
    f_res_hz: Option<f64>,
    f_dip_hz: Option<f64>,
    delta_f_hz: Option<f64>,
    notch_db: Option<f64>,
    fit_freq_pct: Option<f64>,
    fit_time_pct: Option<f64>,
    coherence: Option<f64>,
    snr_res_db: Option<f64>,
    snr_dip_db: Option<f64>,
    skewness: Option<f64>,
    kurtosis: Option<f64>,
    peak_slosh_angle_deg: Option<f64>,
    peak_radial_angle_deg: Option<f64>,
    peak_wave_height_m: Option<f64>,
    max_energy_residual: Option<f64>,
    stuck_s: Option<f64>,
    zero_hz: Option<f64>,
    zero_damping: Option<f64>,
    pole_hz: Option<f64>,
    pole_damping: Option<f64>,
    rotary_from_hz: Option<f64>,
    rotary_to_hz: Option<f64>,
    swirl: Option<f64>,
    rotary_s: Option<f64>,
    off_axis_median: Option<f64>,
    off_axis_energy: Option<f64>,
    leakage: Option<f64>,
    regime: Option<&'static str>,
    estimator: Option<&'static str>,
    not_trusted: Option<String>,
    beyond_model: Option<String>,
    f_res_std_hz: Option<f64>,
    f_dip_std_hz: Option<f64>,
    peak_rate_rad_s: Option<f64>,
    peak_acceleration_rad_s2: Option<f64>,
    plan_sha256: String,
}

impl FeatureRow {
    /// Returns the row of a run that was not analysed, with its identification, and how it left the range of
    /// its model.
    pub fn unanalysed(case: &Case, limits: &[String], plan_sha256: &str) -> FeatureRow {
        FeatureRow {
            beyond_model: super::join_sentences(limits),
            model: case.model.clone(),
            fill_m: case.fill,
            amplitude_nm: case.amplitude,
            plan_sha256: plan_sha256.into(),
            ..Default::default()
        }
    }

    pub fn new(
        run: &Outcome,
        estimate: Option<(&Estimate, &'static str)>,
        plan_sha256: &str,
    ) -> FeatureRow {
        let features = estimate.map_or(Features::default(), |(estimate, _)| estimate.features);
        let totals = &run.totals;
        let (fit, rotary, off_axis) = (run.fit(), run.rotary, run.off_axis());
        let snr_db = run.record.as_ref().and_then(|record| record.snr_db);
        FeatureRow {
            f_res_hz: features.f_res,
            f_dip_hz: features.f_dip,
            delta_f_hz: features.delta_f(),
            notch_db: features.notch_db,
            fit_freq_pct: fit.map(|fit| fit.fit_frequency),
            fit_time_pct: fit.map(|fit| fit.fit_time),
            coherence: fit.and_then(|fit| fit.coherence),
            snr_res_db: snr_db.map(|[resonance, _]| resonance),
            snr_dip_db: snr_db.map(|[_, antiresonance]| antiresonance),
            skewness: fit.map(|fit| fit.skewness),
            kurtosis: fit.map(|fit| fit.kurtosis),
            peak_slosh_angle_deg: Some(totals.peak_slosh_angle.to_degrees()),
            peak_radial_angle_deg: Some(totals.peak_radial_angle.to_degrees()),
            peak_wave_height_m: Some(totals.peak_wave_height),
            max_energy_residual: Some(totals.max_energy_residual),
            stuck_s: Some(totals.stuck),
            zero_hz: fit.and_then(|fit| fit.model.zero_frequency()),
            zero_damping: fit.and_then(|fit| fit.model.zero_damping()),
            pole_hz: fit.map(|fit| fit.model.pole_frequency()),
            pole_damping: fit.map(|fit| fit.model.pole_damping),
            rotary_from_hz: rotary.and_then(|rotary| rotary.from),
            rotary_to_hz: rotary.and_then(|rotary| rotary.to),
            swirl: rotary.map(|rotary| rotary.swirl),
            rotary_s: rotary.map(|rotary| rotary.time),
            off_axis_median: off_axis.map(|off_axis| off_axis.median),
            off_axis_energy: off_axis.map(|off_axis| off_axis.energy),
            leakage: off_axis.map(|off_axis| off_axis.leakage),
            regime: run.regime(),
            estimator: estimate.map(|(_, name)| name),
            not_trusted: estimate.and_then(|(estimate, _)| Some(estimate.doubt?.to_string())),
            beyond_model: run.beyond_model(),
            f_res_std_hz: estimate.and_then(|(estimate, _)| estimate.deviations.f_res),
            f_dip_std_hz: estimate.and_then(|(estimate, _)| estimate.deviations.f_dip),
            peak_rate_rad_s: Some(totals.peak_rate),
            peak_acceleration_rad_s2: Some(totals.peak_acceleration),
            ..FeatureRow::unanalysed(&run.case, &[], plan_sha256)
        }
    }
}

#[derive(Clone, Debug, Default, Serialize)]
pub struct MadeFrom {
    name: String,
    error: String,
    fmu_sha256: String,
    fmu_version: String,
    profile: String,
    step_s: f64,
    stop_s: f64,
    tolerance: Option<f64>,
    recording: Option<String>,
    recording_sha256: Option<String>,
}

impl MadeFrom {
    pub fn new(case: &Case, failure: Option<&Failure>, fmu: &host::fmu::Fmu) -> MadeFrom {
        let recording = case.recording.as_ref();
        let file = recording.and_then(|recording| input::open(&recording.path).ok());
        MadeFrom {
            name: case.name.clone(),
            error: failure.map_or(String::new(), |failure| failure.reason.clone()),
            fmu_sha256: fmu.hash().into(),
            fmu_version: fmu.description().version.clone(),
            profile: case.profile.clone(),
            step_s: case.step,
            stop_s: case.stop,
            tolerance: case.tolerance,
            recording: recording.map(|recording| recording.path.display().to_string()),
            recording_sha256: file.and_then(|file| hash_reader(file).ok()),
        }
    }
}

pub fn columns<Row: Serialize + Default>() -> Result<Vec<String>> {
    let [names, _] = names_and_values(&Row::default())?;
    Ok(names)
}

/// Returns a row's values as text; a non-finite number is empty.
pub fn record<Row: Serialize>(row: &Row) -> Result<Vec<String>> {
    let [_, mut values] = names_and_values(row)?;
    let finite = |value: &&mut String| value.parse::<f64>().is_ok_and(|number| !number.is_finite());
    values.iter_mut().filter(finite).for_each(String::clear);
    Ok(values)
}

fn names_and_values<Row: Serialize>(row: &Row) -> Result<[Vec<String>; 2]> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.serialize(row)?;
    let text = writer.into_inner().map_err(|error| error.into_error())?;
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(&text[..]);
    let mut records = reader.records();
    let mut next = || -> Result<Vec<String>> {
        let record = records.next().context("a row without columns")??;
        Ok(record.iter().map(String::from).collect())
    };
    Ok([next()?, next()?])
}
