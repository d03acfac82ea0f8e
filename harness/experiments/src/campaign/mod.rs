//! A campaign: the runs of a plan, simulated in parallel, each stored and analysed.
//!
//! A stored run is reused, whichever program wrote it, if three conditions are met: the file `runs/<name>.parquet` is
//! complete, its metadata (Parquet key-value pairs) contain the run's [recipe](recipe::recipe), and its hash is the one in
//! the manifest ([`Store`]). All tables are computed from the [columns](STORED) of the runs. Therefore another program that
//! simulates the runs of [`Campaign::list`] and writes their columns and metadata gets the same tables.
//!
//! The analysis is that of the thesis's bench. For an FMU without the bench's variables, all outputs are stored, and
//! `runs.csv` contains only the settings of each run.

mod onset;
mod outcome;
mod recipe;
pub mod recorded;
mod rows;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::{Result, anyhow};
use files::budget;
use files::output::sha256;
use files::store::{CAMPAIGN, Store};
use host::causality::Causality;
use host::description::{ModelDescription, Type, Value};
use host::fmu::Fmu;
use names::hubslosh::{
    ENERGY, F_RADIAL, F_TANGENTIAL, HEAT, OMEGA, OMEGA_IMU, SLOSH_ANGLE, SLOSH_ANGLE_RADIAL,
    STUCK_TIME, TAU_CMD, WAVE_HEIGHT, WORK, friction, hub, slosh, tank,
};
use names::limits::Limits;
use rayon::prelude::*;
use serde_json::json;
use signals::table::{self, Table};

pub use self::onset::seek_onset;
pub use self::outcome::{
    Curve, Doubt, Ending, Estimate, History, Outcome, Passing, Range, Record, SloshPath, Totals,
    WAVE,
};
use self::recipe::{Stored, Unusable};
use self::rows::{MADE_FROM, Row};
use crate::plan::{Case, Plan};
use crate::progress::Progress;
use crate::rest;
use crate::run::Run;
use crate::sensors::Sensors;

/// Columns of a stored run of HubSlosh, in SI units. Each communication point from the beginning of the torque to the
/// stop time is a row. Other columns may follow. The first six are for plots; wave height, energy, work, dissipated
/// energy, time in stiction and the liquid's force on the tank are for the tables.
pub const STORED: [&str; 13] = [
    "time",
    TAU_CMD,
    OMEGA,
    OMEGA_IMU,
    SLOSH_ANGLE,
    SLOSH_ANGLE_RADIAL,
    WAVE_HEIGHT,
    ENERGY,
    WORK,
    HEAT,
    STUCK_TIME,
    F_TANGENTIAL,
    F_RADIAL,
];

const PARAMETERS: [&str; 7] =
    [slosh::MODEL, tank::H, tank::D, tank::R, tank::M_0, hub::I, friction::B];

fn is_bench(description: &ModelDescription) -> bool {
    let has = |name: &str| description.variables.iter().any(|v| v.name == name);
    let has_all = |names: &[&str]| names.iter().all(|name| has(name));
    has_all(&STORED[1..]) && has_all(&PARAMETERS) && has(&slosh::MASS.element([1]))
}

/// Returns true if the variable is the slosh angle of a mode of a tank, for example `tank[1].angle_x[1]`.
pub fn is_slosh_angle(name: &str) -> bool {
    name.starts_with("tank") && (name.contains(".angle_x[") || name.contains(".angle_y["))
}

/// Lists the columns of a stored run: [`STORED`] for HubSlosh. For other FMUs they are the time, the input that the
/// torque drives (`input`), every numeric output, and the slosh angles.
pub fn stored_columns(description: &ModelDescription, input: Option<&str>) -> Vec<String> {
    if is_bench(description) {
        return STORED.map(String::from).to_vec();
    }
    // the outputs, and the slosh angles of a six-axis FMU, which are local variables and no outputs
    let outputs = description
        .variables
        .iter()
        .filter(|v| v.causality == Causality::Output || is_slosh_angle(&v.name));
    let outputs = outputs
        .filter(|v| !matches!(v.kind(), Type::String | Type::Binary | Type::Clock))
        .map(|v| v.name.clone());
    ["time".to_string()].into_iter().chain(input.map(String::from)).chain(outputs).collect()
}

/// Lists the columns of a run's file: [`stored_columns`], and the variables that show whether the run left the range of
/// validity of its tanks' models.
fn recorded_columns(description: &ModelDescription, input: Option<&str>) -> Vec<String> {
    let mut columns = stored_columns(description, input);
    let limits = warning_limits(description);
    columns.extend(limits.required_columns().map(String::from));
    columns
}

fn warning_limits(description: &ModelDescription) -> Limits {
    Limits::find(|name| description.variable(name).is_ok())
}

/// A plan with the settings for its execution. If `force` is true, stored runs are simulated again. `jobs` is the number of
/// runs that are simulated and analysed in parallel, 0 for the number of cores.
#[derive(Clone, Debug)]
pub struct Campaign {
    pub plan: Plan,
    pub force: bool,
    pub jobs: usize,
    pub out: PathBuf,
}

pub(crate) fn join_sentences(sentences: &[String]) -> Option<String> {
    (!sentences.is_empty()).then(|| sentences.join("; "))
}

#[derive(Clone, Debug)]
pub struct Failure {
    pub case: Case,
    pub reason: String,
}

/// A run of an FMU other than HubSlosh. Its stored columns are plotted, but no frequency response is estimated.
/// `history` contains all rows in a thinned form, and `tail` the last rows in full. Both are empty for most runs of a
/// large campaign ([`keeps_curves`]).
#[derive(Clone, Debug)]
pub struct Unanalysed {
    pub case: Case,
    pub history: History,
    pub tail: History,
    /// Largest slosh angle of the run, rad, and the name of its variable; `None` if the FMU has no slosh angles.
    pub largest_angle: Option<(f64, String)>,
    /// Sentences about tanks that left the range of validity of their model, one for each such tank.
    pub limits: Vec<String>,
    pub reused: bool,
}

impl Results {
    pub fn recordings(&self) -> usize {
        self.outcomes.iter().filter(|run| run.is_recording()).count()
    }

    pub fn beyond_model(&self) -> impl Iterator<Item = (&Case, String)> {
        let analysed = self.outcomes.iter().map(|run| (&run.case, run.beyond_model()));
        let others = self.unanalysed.iter().map(|run| (&run.case, join_sentences(&run.limits)));
        analysed.chain(others).filter_map(|(case, how)| Some((case, how?)))
    }

    pub fn counts(&self) -> (usize, usize) {
        let reused = self.outcomes.iter().map(|run| run.reused);
        let reused: Vec<bool> = reused.chain(self.unanalysed.iter().map(|r| r.reused)).collect();
        (reused.len(), reused.iter().filter(|reused| **reused).count())
    }
}

/// Number of runs whose curves are kept for the report. Of all other runs only numbers are kept, which limits the
/// memory of a campaign.
pub const CURVES: usize = 400;

/// Returns true if the curves of run `i` of `runs` are kept. The kept runs are spread evenly over the plan and
/// include its last run.
pub fn keeps_curves(i: usize, runs: usize) -> bool {
    i.is_multiple_of(runs.div_ceil(CURVES).max(1)) || i + 1 == runs
}

enum Done {
    Analysed(Box<Outcome>),
    Unanalysed(Box<Unanalysed>),
    Failed(anyhow::Error),
}

impl Done {
    fn without_curves(self) -> Done {
        match self {
            Done::Analysed(outcome) => Done::Analysed(Box::new(outcome.without_curves())),
            Done::Unanalysed(mut run) => {
                (run.history, run.tail) = Default::default();
                Done::Unanalysed(run)
            }
            Done::Failed(error) => Done::Failed(error),
        }
    }
}

#[derive(Clone, Debug, Default)]
pub struct Results {
    pub outcomes: Vec<Outcome>,
    pub unanalysed: Vec<Unanalysed>,
    pub failures: Vec<Failure>,
}

impl Campaign {
    /// Locks the results directory for this campaign.
    ///
    /// # Errors
    /// If another process has locked the directory, or the directory contains something other than a campaign.
    pub fn take(&self) -> Result<Store> {
        Store::take(&self.out, CAMPAIGN, &format!("the plan \"{}\"", self.plan.title), None)
    }

    /// Simulates all runs that are not stored yet and analyses all of them. Stores the runs in the directory;
    /// [`Campaign::tables`] returns the tables.
    ///
    /// # Errors
    /// If there are no runs, or a run cannot be stored. A run that cannot be simulated is a failure
    /// among the results.
    pub fn execute(
        &self,
        fmu: &Fmu,
        store: &Store,
        watch: &(dyn Fn(Progress) + Sync),
    ) -> Result<Results> {
        let cases = self.plan.cases(fmu.description())?;
        let steps: u64 = cases.iter().map(|case| case.run().steps() as u64).sum();
        let bytes = cases.iter().map(|case| {
            let run = case.run();
            let columns = recorded_columns(fmu.description(), run.input.as_deref()).len();
            (run.steps() as u64 + 1).saturating_mul(8 * columns as u64)
        });
        let jobs = budget::jobs(self.jobs, bytes.max().unwrap_or(0))?;
        watch(Progress::Begins { runs: cases.len(), steps });
        let jobs = jobs.min(cases.len().max(1));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build()?;
        let warned = Mutex::new(BTreeSet::new());
        // of several warnings that differ only in numbers, only the first is reported
        let warn = |case: &Case, warning: String| {
            let words: String = warning.chars().filter(|c| !c.is_ascii_digit()).collect();
            let mut warned = warned.lock().unwrap_or_else(PoisonError::into_inner);
            if warned.insert(words) {
                watch(Progress::Note(format!("warning of run {}: {warning}", case.name)));
            }
        };
        let done = |(i, case)| {
            let done = self.simulate_or_read(fmu, case, store, watch, &warn)?;
            Ok(if keeps_curves(i, cases.len()) { done } else { done.without_curves() })
        };
        let results: Result<Vec<Done>> =
            pool.install(|| cases.par_iter().enumerate().map(done).collect());

        let mut collected = Results::default();
        for (case, done) in cases.into_iter().zip(results?) {
            match done {
                Done::Analysed(outcome) => collected.outcomes.push(*outcome),
                Done::Unanalysed(run) => collected.unanalysed.push(*run),
                Done::Failed(error) => {
                    collected.failures.push(Failure { case, reason: format!("{error:#}") })
                }
            }
        }
        Ok(collected)
    }

    pub fn holds_another(&self) -> bool {
        files::input::text(&self.plan_file()).is_ok_and(|text| text != self.plan.text)
    }

    pub fn plan_file(&self) -> PathBuf {
        self.out.join("plan.toml")
    }

    pub fn command(&self, fmu: &Fmu) -> String {
        let word = |path: &Path| {
            let text = path.display().to_string();
            shlex::try_quote(&text).map_or(text.clone(), |quoted| quoted.into_owned())
        };
        format!(
            "hubslosh campaign --plan {} --fmu {} --out {}",
            word(&self.plan_file()),
            word(fmu.path()),
            word(&self.out)
        )
    }

    /// Returns the runs of the plan for simulation by another program. Each has its name, its file in the campaign's
    /// directory, settings, the torque (as text for `hubslosh torque`) and times, and the metadata that its Parquet file
    /// must contain for the analysis.
    pub fn list(&self, fmu: &Fmu) -> Result<serde_json::Value> {
        let description = fmu.description();
        let (mut columns, mut kept) = (Vec::<String>::new(), Vec::new());
        let mut runs = Vec::new();
        let cases = self.plan.cases(description)?;
        for case in cases.into_iter().filter(|case| case.recording.is_none()) {
            let run = case.run();
            kept = recorded_columns(description, run.input.as_deref());
            // the variables that sensors need are recorded; their readings are computed when the run is read
            let sensors = Sensors::new(&case.sensors, description, &case.settings, case.step)?;
            for name in kept.iter().map(String::as_str).chain(sensors.required_variables()) {
                if !columns.iter().any(|column| column == name) {
                    columns.push(name.to_string());
                }
            }
            let starts = rest::moving_starts(description).into_iter();
            let at_rest = starts.filter(|name| Some(name) != run.input.as_ref());
            let mut settings: serde_json::Map<_, _> =
                at_rest.map(|name| (name, json!(0.0))).collect();
            for (name, text) in &case.settings {
                let value = match description.value(description.variable(name)?, text)? {
                    // an enumeration is given by the name of its item
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
                "file": CAMPAIGN.run_file(&case.name),
                "varied": self.plan.varied().into_iter().zip(&case.varied).collect::<BTreeMap<_, _>>(),
                "settings": settings,
                "profile": case.profile,
                "start": run.start(),
                "stop": run.stop,
                "step": run.step,
                "sample": run.sample,
                "steps": run.steps(),
                "tolerance": run.tolerance,
                "hold": run.hold,
                "notes": recipe::recipe(fmu, &case, &kept),
            }));
        }
        Ok(json!({
            "title": self.plan.title,
            "fmu": {
                "path": fmu.path(),
                "sha256": fmu.hash(),
                "binary_sha256": fmu.binary_hash(),
                "guid": description.guid,
                "version": description.version,
            },
            "out": self.out,
            "columns": columns,
            "kept": kept,
            "runs": runs,
        }))
    }

    /// Simulates one run, or reads it if it is already stored, and analyses it.
    ///
    /// # Errors
    /// If the run cannot be stored. The campaign then ends, because no other run could be stored
    /// either.
    fn simulate_or_read(
        &self,
        fmu: &Fmu,
        case: &Case,
        store: &Store,
        watch: &(dyn Fn(Progress) + Sync),
        warn: &(dyn Fn(&Case, String) + Sync),
    ) -> Result<Done> {
        let run = case.run();
        let tell = |outcome: &Outcome| {
            outcome.warnings.iter().for_each(|warning| warn(case, warning.clone()));
        };
        let columns = recorded_columns(fmu.description(), run.input.as_deref());
        let recipe = recipe::recipe(fmu, case, &columns);
        let put = |table: &Table, notes: &BTreeMap<String, String>| {
            store.add(&case.name, |path| table.write(path, notes))
        };
        // the work of the analysis is checked before the simulation, which may take hours
        let work = match is_bench(fmu.description()) && case.recording.is_none() {
            true => outcome::check_work(&case.torque, run.step, run.steps() + 1),
            false => Ok(()),
        };
        let mut instance = match work.and_then(|()| run.initialise(fmu)) {
            Ok(instance) => instance,
            Err(error) => return Ok(Done::Failed(error)),
        };
        instance.take_warnings().into_iter().for_each(|warning| warn(case, warning));
        if let Some(recorded) = &case.recording {
            watch(Progress::Steps(run.steps() as u64));
            if !is_bench(fmu.description()) {
                return Ok(Done::Failed(anyhow!(
                    "recordings can be analysed only with HubSlosh (the bench): choose its FMU, or remove `recording` from the plan"
                )));
            }
            let read = recorded::table(case, recorded, &mut |line| watch(Progress::Note(line)));
            let analysed = read.and_then(|(step, table)| {
                outcome::check_work(&case.torque, step, table.rows())?;
                put(&table, &recipe)?;
                let run = Run { step, ..run };
                Outcome::analyse(case, &run, &mut instance, &table, false)
            });
            let analysed = analysed.inspect(|outcome| tell(outcome));
            return Ok(
                analysed.map_or_else(Done::Failed, |outcome| Done::Analysed(Box::new(outcome)))
            );
        }
        let sensors = Sensors::new(&case.sensors, fmu.description(), &case.settings, case.step)?;
        let path = store.run(&case.name);
        let stored = |sum| {
            let stored = recipe::stored(&path, &run, &recipe, (&columns, &sensors))?;
            Ok((stored, sum))
        };
        let there = match self.force {
            true => Ok(None),
            false => store
                .check(&case.name, table::is_ours)
                .map_err(Unusable::Damaged)
                .and_then(|sum| sum.map(stored).transpose()),
        };
        let there = there.unwrap_or_else(|why| {
            watch(Progress::Note(recipe::because(case, &why)));
            None
        });
        let reused = there.is_some();
        let table = match there {
            Some((Stored { table, lacks_sensors }, sum)) => {
                watch(Progress::Steps(run.steps() as u64));
                if !store.lists(&case.name) {
                    watch(Progress::Note(recipe::unverified(case)));
                }
                if lacks_sensors {
                    let table = sensors.recorded(table, columns.len(), &case.name, case.step)?;
                    put(&table, &table::metadata(&path)?)?;
                    table
                } else {
                    store.adopt(&case.name, sum)?;
                    table
                }
            }
            None => {
                // without time and the driven input, because both are recorded in any case
                let others = columns[1 + usize::from(run.input.is_some())..].iter();
                let others: Vec<&str> = others.map(String::as_str).collect();
                let others = run.columns_with(&others, sensors.required_variables());
                let driven =
                    run.drive(&mut instance, &others, |steps| watch(Progress::Steps(steps)));
                instance.take_warnings().into_iter().for_each(|warning| warn(case, warning));
                let read = driven.and_then(|table| {
                    table.all_finite()?;
                    sensors.recorded(table, columns.len(), &case.name, case.step)
                });
                let table = match read {
                    Ok(table) => table,
                    Err(error) => return Ok(Done::Failed(error)),
                };
                put(&table, &recipe)?;
                table
            }
        };
        if !is_bench(fmu.description()) {
            let limits = warning_limits(fmu.description());
            let drawn = columns.len() - limits.required_columns().count();
            let limits = limits.describe(|name| table.column(name));
            let columns: Vec<(&str, &[f64])> = columns[1..drawn]
                .iter()
                .filter_map(|name| Some((name.as_str(), table.column(name)?)))
                .collect();
            let time = table.column("time").unwrap_or_default();
            let history = History::thin(time, &columns);
            let from = time.len().saturating_sub(2 * History::STRETCHES);
            let last: Vec<(&str, &[f64])> = columns.iter().map(|(n, v)| (*n, &v[from..])).collect();
            let tail = History::thin(&time[from..], &last);
            let angles = columns.iter().filter(|(name, _)| is_slosh_angle(name));
            let angles = angles.map(|(name, values)| {
                (values.iter().fold(0.0, |most: f64, angle| most.max(angle.abs())), *name)
            });
            let largest = angles.max_by(|a, b| a.0.total_cmp(&b.0));
            let largest_angle = largest.map(|(angle, name)| (angle, name.to_string()));
            let case = case.clone();
            let run = Unanalysed { case, history, tail, largest_angle, limits, reused };
            return Ok(Done::Unanalysed(Box::new(run)));
        }
        Ok(match Outcome::analyse(case, &run, &mut instance, &table, reused) {
            Ok(outcome) => {
                tell(&outcome);
                Done::Analysed(Box::new(outcome))
            }
            Err(error) => Done::Failed(error),
        })
    }

    /// Returns the tables of a campaign as pairs of a file name and the bytes of a CSV file. `features.csv` contains
    /// the antiresonance and resonance of each analysed run; `features_spa.csv` and `features_h1.csv` contain them
    /// from the estimates `spa` and H1. `runs.csv` contains every run, also failed ones, with its settings and all
    /// features. Only `runs.csv` exists if no run is of HubSlosh.
    pub fn tables(&self, fmu: &Fmu, results: &Results) -> Result<Vec<(&'static str, Vec<u8>)>> {
        let plan = sha256(self.plan.text.as_bytes());
        let Results { outcomes, unanalysed, failures } = results;
        let mut tables = Vec::new();
        type Of = dyn Fn(&Outcome) -> Option<(&Estimate, &'static str)>;
        let mut features = |name: &'static str, of: &Of| -> Result<()> {
            let rows = outcomes.iter().map(|run| Row::analysed(run, of(run)).values(&plan));
            tables.push((name, written(&Row::columns(), rows)?));
            Ok(())
        };
        if unanalysed.is_empty() {
            features("features.csv", &Outcome::estimate)?;
            features("features_spa.csv", &|run| Some((&run.record.as_ref()?.spa, "spa")))?;
            features("features_h1.csv", &|run| Some((&run.record.as_ref()?.h1, "h1")))?;
        }
        let analysed = outcomes.iter().map(|run| (None, Row::analysed(run, run.estimate())));
        let unanalysed =
            unanalysed.iter().map(|run| (None, Row::unanalysed(&run.case, &run.limits)));
        let failed = failures.iter().map(|of| (Some(of), Row::unanalysed(&of.case, &[])));
        let rows = analysed.chain(unanalysed).chain(failed).map(|(failure, row)| {
            let made_from = rows::made_from(row.case, failure, fmu);
            [made_from, row.case.varied.clone(), row.values(&plan)].concat()
        });
        let varied = self.plan.varied();
        let header = MADE_FROM.into_iter().chain(varied).map(String::from).chain(Row::columns());
        tables.push(("runs.csv", written(&header.collect::<Vec<_>>(), rows)?));
        Ok(tables)
    }
}

/// Writes a CSV table row by row, because all rows of a large campaign at the same time would take more
/// memory than its results.
fn written(header: &[String], rows: impl Iterator<Item = Vec<String>>) -> Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(header)?;
    for row in rows {
        writer.write_record(row)?;
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}

#[cfg(test)]
mod tests {
    use super::{CURVES, keeps_curves};

    #[test]
    fn reports_keep_the_curves_of_a_limited_number_of_runs() {
        for runs in [1, 2, CURVES - 1, CURVES, CURVES + 1, 2 * CURVES + 7, 100_000] {
            let kept: Vec<usize> = (0..runs).filter(|i| keeps_curves(*i, runs)).collect();
            assert!(kept.len() <= CURVES + 1, "{runs}: {}", kept.len());
            assert!(kept.len() == runs || 2 * kept.len() > CURVES, "{runs}: {}", kept.len());
            assert_eq!((kept[0], kept[kept.len() - 1]), (0, runs - 1));
        }
    }
}
