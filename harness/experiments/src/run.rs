//! A single run: the simulation of one instance of the FMU under a torque history.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

use crate::profile::Torque;
use crate::rest;
use files::budget;
use host::causality::Causality;
use host::description::{ModelDescription, Type, Value, Variable};
use host::drive::Inputs;
use host::fmu::{Fmu, Instance};
use host::schedule::{self, History, Schedule};
use names::hubslosh::TAU_CMD;
use signals::recording::{self, Between, Columns, Signal, Wanted};
use signals::table::Table;

/// A simulation of an FMU.
///
/// - `settings`: start values by FMU name, as text, set in this order.
/// - `input`: name of the input that `torque` drives, if any; `others` are further inputs by FMU name, each
///   with its history in the input's unit.
/// - `sample`: time between the commands of a profile, s; see [`Torque::history`].
/// - `tolerance`: relative tolerance for the FMU's solver; `None` for the FMU's own.
/// - `hold`: true if inputs are held from row to row, and a profile from command to command; false for
///   straight lines.
#[derive(Clone, Debug)]
pub struct Run {
    pub settings: Vec<(String, String)>,
    pub input: Option<String>,
    pub torque: Torque,
    pub others: Vec<(String, Torque)>,
    pub step: f64,
    pub sample: f64,
    pub stop: f64,
    pub tolerance: Option<f64>,
    pub hold: bool,
}

/// Name of the input that the torque drives, if the FMU has this input.
pub const TORQUE: &str = TAU_CMD;

/// Returns the name of the input that the torque drives: `chosen` if given, otherwise [`TORQUE`], otherwise
/// the FMU's only Real input. Returns `None` if the FMU has no input.
///
/// # Errors
/// If the input does not exist, or several inputs are possible.
pub fn driven(description: &ModelDescription, chosen: Option<&str>) -> Result<Option<String>> {
    if let Some(name) = chosen {
        let variable = description.variable(name)?;
        ensure!(
            variable.causality == Causality::Input && variable.kind() == Type::Real,
            "{name} cannot be driven: it is not a Real input"
        );
        return Ok(Some(name.into()));
    }
    let inputs = description.variables.iter();
    let inputs = inputs.filter(|v| v.causality == Causality::Input && v.kind() == Type::Real);
    let names: Vec<&str> = inputs.map(|v| v.name.as_str()).collect();
    match names[..] {
        _ if names.contains(&TORQUE) => Ok(Some(TORQUE.into())),
        [] => Ok(None),
        [only] => Ok(Some(only.into())),
        _ => bail!(
            "the FMU has several inputs ({}): name the input that the torque drives",
            names.join(", ")
        ),
    }
}

/// Name of the column with the time derivative of [`TORQUE`] until the next row, N·m/s. This column of a torque
/// history is not an input of the FMU.
pub const SLOPE: &str = "tau_slope";

/// Reads histories of inputs from a file. Each column must be the `time` or have the name of an input of the FMU;
/// [`SLOPE`] may accompany [`TORQUE`]. Other columns are an error, unless `ignore` is true.
///
/// The first returned history is the input `chosen`, otherwise [`TORQUE`], otherwise the first input in the file.
/// Reals are held from row to row if `held` is true, and otherwise interpolated linearly. Integers, enumerations (as
/// numbers) and Booleans (true and false, or 1 and 0) are always held. `done` receives messages about the units in
/// which the columns are read.
///
/// # Errors
/// If the file has no column of an input, or other columns. The error lists all problems of the columns.
pub fn histories(
    description: &ModelDescription,
    path: &Path,
    chosen: Option<&str>,
    held: bool,
    ignore: bool,
    done: &mut dyn FnMut(String),
) -> Result<Vec<(String, Torque)>> {
    let named = |v: &&Variable| v.causality == Causality::Input && Inputs::takes(v.kind());
    let takes: Vec<&Variable> = description.variables.iter().filter(named).collect();
    let kind = |name: &str| takes.iter().find(|v| v.name == name).map(|v| v.kind());
    let is_input = |name: &str| kind(name).is_some();
    let file = path.display();
    let signal = |name, unit| Signal { name, required: true, between: Between::Missing, unit };
    let mut signals: Vec<Signal> = takes
        .iter()
        .map(|v| match v.kind() {
            Type::Real => signal(v.name.as_str(), Some(description.unit(v))),
            _ => signal(v.name.as_str(), Some("")),
        })
        .collect();
    signals.extend([signal("time", None), signal(SLOPE, Some("N.m/s"))]);
    // columns are recognised by the names of the inputs, with or without a unit
    let there = recording::assigned(path, &signals)?;
    let columns: Vec<&str> = there
        .iter()
        .map(|(name, signal)| signal.map_or(name.as_str(), |k| signals[k].name))
        .collect();
    let (inputs, rest): (Vec<&str>, Vec<&str>) = columns.iter().partition(|name| is_input(name));
    let slope = rest.contains(&SLOPE) && inputs.contains(&TORQUE);
    let known = |name: &str| name == "time" || (slope && name == SLOPE);
    let wrong: Vec<&str> = rest.iter().copied().filter(|name| !known(name)).collect();
    let all: Vec<&str> = takes.iter().map(|v| v.name.as_str()).collect();
    let mut problems = Vec::new();
    if !columns.contains(&"time") {
        problems.push("the file has no column time".to_string());
    }
    if inputs.is_empty() {
        problems.push("none of its columns is an input of the FMU".to_string());
    }
    if !wrong.is_empty() && !ignore {
        problems.push(format!(
            "{} {} (--ignore-columns skips such columns)",
            wrong.join(", "),
            if wrong.len() == 1 { "is not an input" } else { "are not inputs" }
        ));
    }
    if let Some(chosen) = chosen.filter(|chosen| !inputs.contains(chosen)) {
        problems.push(format!("the file has no column {chosen}, which is the input to drive"));
    }
    ensure!(
        problems.is_empty(),
        "the file of inputs {file} cannot be used: {}; the FMU's inputs: {}; columns in the file: {}",
        problems.join("; "),
        if all.is_empty() { "none".to_string() } else { all.join(", ") },
        columns.join(", ")
    );
    let first = chosen.or_else(|| inputs.contains(&TORQUE).then_some(TORQUE)).unwrap_or(inputs[0]);
    let rest = inputs.iter().copied().filter(|name| *name != first);
    let ordered: Vec<&str> = [first].into_iter().chain(rest).collect();
    let wanted: Vec<Signal> = ordered
        .iter()
        .copied()
        .chain(slope.then_some(SLOPE))
        .filter_map(|name| signals.iter().find(|signal| signal.name == name).copied())
        .collect();
    let booleans: Vec<&str> =
        ordered.iter().copied().filter(|name| kind(name) == Some(Type::Boolean)).collect();
    let wanted = Wanted { signals: &wanted, columns: &Columns::default() };
    let table = recording::read_inputs(path, &wanted, &booleans, done)?;
    let column = |name| table.column(name).unwrap_or_default();
    ordered
        .into_iter()
        .map(|name| {
            let slopes = (slope && name == TORQUE && !held).then(|| column(SLOPE));
            let (values, kind) = (column(name), kind(name).unwrap_or(Type::Real));
            let allowed: fn(&f64) -> bool = match kind {
                Type::Real => |_| true,
                Type::Boolean => |value| [0.0, 1.0].contains(value),
                _ => |value| value.fract() == 0.0 && value.abs() < 2_f64.powi(31),
            };
            if let Some(row) = values.iter().position(|value| !allowed(value)) {
                bail!(
                    "the file of inputs {file} cannot be used: row {}: {name} is {} (allowed: {})",
                    row + 1,
                    values[row],
                    if kind == Type::Boolean {
                        "true and false, or 1 and 0: it is a Boolean"
                    } else {
                        "integers of 32 bits"
                    }
                );
            }
            let held = held || kind != Type::Real;
            let history = Torque::rows(column("time"), values, slopes, held);
            Ok((
                name.to_string(),
                history.with_context(|| format!("the file of inputs {file} cannot be used"))?,
            ))
        })
        .collect()
}

fn is_settable(variable: &Variable) -> bool {
    matches!(
        variable.causality,
        Causality::Parameter | Causality::StructuralParameter | Causality::Input
    )
}

/// Returns every parameter and input with its start value as a text: the value that the run sets, otherwise
/// the FMU's own. Inputs that are `driven` are left out. Numbers are formatted uniformly and enumerations are
/// written by name, so that equal values have equal texts.
pub fn parameters(
    description: &ModelDescription,
    settings: &[(String, String)],
    driven: &[String],
) -> BTreeMap<String, String> {
    let settable = description
        .variables
        .iter()
        .filter(|variable| is_settable(variable) && !driven.contains(&variable.name));
    settable
        .filter_map(|variable| {
            let set = settings.iter().rfind(|(name, _)| *name == variable.name);
            let text = set.map(|(_, text)| text).or(variable.attributes().start.as_ref())?;
            let items = description.items(variable);
            let text = match description.value(variable, text).ok()? {
                Value::Real(x) => x.to_string(),
                Value::Boolean(b) => b.to_string(),
                Value::String(s) => s,
                Value::Integer(i) => {
                    let item = items.iter().find(|item| item.value == i);
                    item.map_or(i.to_string(), |item| item.name.clone())
                }
            };
            Some((variable.name.clone(), text))
        })
        .collect()
}

const REPORT_EVERY: usize = 1024;

impl Run {
    pub fn start(&self) -> f64 {
        self.torque.span().0
    }

    /// Returns the number of intervals between the rows of the result, the last of which may be shorter. Returns
    /// 0 if [`Run::check`] fails.
    pub fn steps(&self) -> usize {
        budget::steps(self.stop - self.start(), self.step).unwrap_or(0)
    }

    /// Estimates the memory, bytes, for the communication points of the run and the histories of its inputs.
    pub fn course_bytes(&self) -> u64 {
        let all = [&self.torque].into_iter().chain(self.others.iter().map(|(_, other)| other));
        let counts =
            all.map(|torque| torque.row_count(self.sample, self.stop, self.hold).unwrap_or(0));
        // Each point has time, value and slope, and growing lists take twice as much memory.
        (counts.sum::<usize>() + self.steps()) as u64 * 100
    }

    fn course(&self) -> Result<(Vec<Cow<'_, History>>, Schedule)> {
        let others = self.others.iter().map(|(_, other)| other);
        let histories = [&self.torque]
            .into_iter()
            .chain(others)
            .map(|torque| torque.history(self.sample, self.stop, self.hold))
            .collect::<Result<Vec<_>>>()?;
        let rows = histories.iter().map(|history| history.time());
        let schedule = Schedule::new((self.start(), self.stop), Some(self.step), rows)?;
        Ok((histories, schedule))
    }

    /// Returns the torque as the run passes it to the FMU. The table has a row for every communication point, with
    /// `time` (s), `tau_cmd` (N·m) and `tau_slope`, the derivative of `tau_cmd` until the next point (N·m/s). The
    /// schedule states which of the communication points are rows of the result.
    ///
    /// # Errors
    /// If the profile takes too many commands.
    pub fn torque_table(&self) -> Result<(Table, Schedule)> {
        let (histories, schedule) = self.course()?;
        let mut torque = histories[0].cursor();
        let (tau, mut slope): (Vec<f64>, Vec<f64>) =
            schedule.time.iter().map(|t| torque.after(*t)).unzip();
        slope.last_mut().into_iter().for_each(|last| *last = 0.0);
        let time = schedule.time.clone();
        Ok((Table::of([("time", time), (TORQUE, tau), (SLOPE, slope)]), schedule))
    }

    fn driven(&self) -> Vec<(&str, &Torque)> {
        let first = self.input.iter().map(|name| (name.as_str(), &self.torque));
        first.chain(self.others.iter().map(|(name, history)| (name.as_str(), history))).collect()
    }

    fn inputs(&self, description: &ModelDescription) -> Result<Inputs> {
        let driven = self.driven();
        let names: Vec<&str> = driven.iter().map(|(name, _)| *name).collect();
        Ok(Inputs::new(description, &names, self.hold)?.with_tolerance(self.tolerance))
    }

    /// Checks the run's stop time, step, tolerance and inputs.
    ///
    /// # Errors
    /// If a value is not allowed; the message is one sentence about it.
    pub fn check(&self) -> Result<()> {
        ensure!(
            self.stop > self.start() && self.stop.is_finite(),
            "the stop time must be later than {} s, not {} s",
            self.start(),
            self.stop
        );
        budget::steps(self.stop - self.start(), self.step)?;
        self.torque.row_count(self.sample, self.stop, self.hold)?;
        if let Some(tolerance) = self.tolerance {
            ensure!(
                tolerance > 0.0 && tolerance.is_finite(),
                "the tolerance must be a positive number, not {tolerance}"
            );
        }
        Ok(())
    }

    /// Creates an instance with the start values set, ready for the first step.
    ///
    /// # Errors
    /// If [`Run::check`] fails, or the FMU refuses a setting.
    pub fn initialise<'fmu>(&self, fmu: &'fmu Fmu) -> Result<Instance<'fmu>> {
        self.check()?;
        let mut instance = rest::instantiate(fmu, "run")?;
        for (name, value) in &self.settings {
            let variable = fmu.description().variable(name)?;
            match &variable.causality {
                Causality::Input if self.driven().iter().any(|(driven, _)| driven == name) => {
                    bail!(
                        "{name} cannot be set, because the profile or the file of inputs drives it"
                    )
                }
                _ if is_settable(variable) => instance.set(name, value)?,
                other => bail!(
                    "{name} cannot be set: it is of causality {other}, not a parameter or an input"
                ),
            }
        }
        if !schedule::interpolates(fmu.description()) {
            let (histories, _) = self.course()?;
            let names = self.driven().into_iter().map(|(name, _)| name);
            let inputs = names.zip(histories.iter().map(|history| &**history));
            schedule::check_interpolation(fmu.description(), inputs, "--hold")?;
        }
        let first: Vec<f64> =
            self.driven().iter().map(|(_, history)| history.torque_at(self.start())).collect();
        self.inputs(fmu.description())?.initialise(
            &mut instance,
            self.tolerance,
            self.start(),
            Some(self.stop),
            &first,
        )?;
        Ok(instance)
    }

    /// Returns `columns`, followed by the variables of `needs` that the table of the run would otherwise lack, each
    /// once. Time and the inputs that the run sets are always in the table.
    pub fn columns_with<'n>(
        &self,
        columns: &[&'n str],
        needs: impl IntoIterator<Item = &'n str>,
    ) -> Vec<&'n str> {
        let driven = self.driven();
        let mut all = columns.to_vec();
        for name in needs {
            if name != "time"
                && !all.contains(&name)
                && driven.iter().all(|(driven, _)| *driven != name)
            {
                all.push(name);
            }
        }
        all
    }

    /// Simulates an initialised instance to the stop time. Every row of an input and every row of the result is a
    /// communication point. The returned table has a row every [`Run::step`] seconds, with the columns `time`, the
    /// inputs for which the run has a torque or a history, and the variables `columns`. [`schedule::ROWS`] explains
    /// which values of inputs and outputs are in the same row. `progress` receives the number of rows since its last
    /// call.
    ///
    /// # Errors
    /// If the FMU refuses a call, or a recorded value is not finite.
    pub fn drive(
        &self,
        instance: &mut Instance,
        columns: &[&str],
        progress: impl Fn(u64),
    ) -> Result<Table> {
        self.check()?;
        ensure!(
            !columns.is_empty(),
            "nothing would be recorded: the FMU has no output that is a number, and no other variable is named"
        );
        let steps = self.steps();
        budget::table(steps + 1, 1 + self.driven().len() + columns.len())?;
        let (histories, schedule) = self.course()?;
        let mut recorder = Recorder::new(instance, columns, steps + 1)?;
        let driven = self.driven();
        let rows = steps + 1;
        let mut time = Vec::with_capacity(rows);
        let mut given: Vec<Vec<f64>> = driven.iter().map(|_| Vec::with_capacity(rows)).collect();
        let inputs = self.inputs(instance.description())?;
        // if the FMU has no input, none is driven
        let mut cursors: Vec<_> = histories.iter().map(|history| history.cursor()).collect();
        let mut point = 0;
        inputs.drive(instance, self.start(), |instance, t, course| {
            for (i, cursor) in cursors.iter_mut().enumerate().take(driven.len()) {
                (course.values[i], course.slopes[i]) = cursor.after(t);
            }
            if schedule.is_row(point) {
                let row = time.len();
                for (given, value) in given.iter_mut().zip(course.values.iter()) {
                    given.push(*value);
                }
                time.push(t);
                if let Some(column) = recorder.record(instance)? {
                    bail!(
                        "the FMU gives {} = {} at t = {t} s (allowed: finite numbers)",
                        columns[column],
                        recorder.columns[column][row]
                    );
                }
                if row > 0 && row.is_multiple_of(REPORT_EVERY) {
                    progress(REPORT_EVERY as u64);
                }
            }
            point += 1;
            Ok(schedule.time.get(point).copied())
        })?;
        progress((steps % REPORT_EVERY) as u64);

        let given = driven.iter().map(|(name, _)| *name).zip(given);
        let recorded = columns.iter().copied().zip(recorder.columns());
        Ok(Table::of([("time", time)].into_iter().chain(given).chain(recorded)))
    }
}

/// Reads the recorded variables with one call for each type. `places` are the columns of the values, first for the
/// Reals, then for the other types.
struct Recorder {
    reals: Vec<u32>,
    others: Vec<Variable>,
    places: Vec<usize>,
    values: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl Recorder {
    fn new(instance: &Instance, names: &[&str], points: usize) -> Result<Self> {
        let (mut reals, mut others) = (Vec::new(), Vec::new());
        let (mut real_places, mut other_places) = (Vec::new(), Vec::new());
        for (place, name) in names.iter().enumerate() {
            let variable = instance.description().variable(name)?;
            match variable.kind() {
                Type::Real => {
                    reals.push(variable.reference);
                    real_places.push(place);
                }
                Type::String | Type::Binary | Type::Clock => {
                    bail!("{name} is not a number; only numbers can be recorded")
                }
                Type::Integer | Type::Boolean | Type::Enumeration => {
                    others.push(variable.clone());
                    other_places.push(place);
                }
            }
        }
        Ok(Recorder {
            values: vec![0.0; reals.len()],
            reals,
            others,
            places: [real_places, other_places].concat(),
            columns: vec![Vec::with_capacity(points); names.len()],
        })
    }

    /// Adds the current values of the recorded variables as a row. Returns the position of the first value that is NaN
    /// or infinite, if there is one.
    fn record(&mut self, instance: &mut Instance) -> Result<Option<usize>> {
        instance.get_real(&self.reals, &mut self.values)?;
        for (value, place) in self.values.iter().zip(&self.places) {
            self.columns[*place].push(*value);
        }
        for (variable, place) in self.others.iter().zip(&self.places[self.reals.len()..]) {
            self.columns[*place].push(instance.value(variable)?.number());
        }
        let wrong = self.values.iter().position(|value| !value.is_finite());
        Ok(wrong.map(|i| self.places[i]))
    }

    fn columns(self) -> Vec<Vec<f64>> {
        self.columns
    }
}
