//! Simulates an FMU at the rows of a recording, with the FMU's own solver (Co-Simulation) or with the host's (Model Exchange).

use std::path::Path;

use anyhow::{Context, Result, ensure};
use experiments::rest;
use experiments::sensors::Sensor;
use experiments::sensors::quantity::Quantity;
use host::causality::Causality;
use host::description::{ModelDescription, Type};
use host::exchange;
use host::fmu::{Fmu, Instance, Interface};
use host::schedule::interpolates;
use names::hubslosh::solver::{self, MAX_STEPS};

use crate::input::question::{Question, Setting, Solver, real};
use crate::input::record::Record;
use crate::tuning::{
    COMPARED_FACTOR, COMPARED_STEPS, COMPARED_TOLERANCE, HELD_STEPS, MOST_INTERNAL_STEPS,
    SLOPE_PROBES,
};

/// Returns the value for the FMU's parameter `solver.max_steps` in runs over these instants, s. Returns `None` if the FMU has no
/// such parameter, if the settings set it, or if its default is smaller.
pub fn most_steps<'n>(
    description: &ModelDescription,
    mut set: impl Iterator<Item = &'n str>,
    time: &[f64],
) -> Option<i32> {
    let variable = description.variable(solver::MAX_STEPS).ok()?;
    let longest = time.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let most =
        (MOST_INTERNAL_STEPS.0 + MOST_INTERNAL_STEPS.1 * longest).min(f64::from(i32::MAX)) as i32;
    let default: Option<i32> = variable.attributes().start.as_ref()?.parse().ok();
    (!set.any(|name| name == solver::MAX_STEPS) && Some(most) < default).then_some(most)
}

pub enum Model {
    Own(Fmu),
    Host(Fmu),
}

impl Model {
    /// Opens an FMU for a solver.
    ///
    /// # Errors
    /// If the file is not an FMU, or the FMU lacks the interface that the solver needs.
    pub fn open(path: &Path, solver: Solver) -> Result<Self> {
        Ok(match solver {
            Solver::Own => Model::Own(Fmu::open(path)?),
            Solver::Host(_) => Model::Host(Fmu::open_for(Interface::ModelExchange, path, &[])?),
        })
    }

    fn fmu(&self) -> &Fmu {
        let (Model::Own(fmu) | Model::Host(fmu)) = self;
        fmu
    }

    pub fn description(&self) -> &ModelDescription {
        self.fmu().description()
    }

    /// Returns true if Co-Simulation is used, but the FMU also supports Model Exchange.
    pub fn offers_exchange(&self) -> bool {
        matches!(self, Model::Own(fmu) if fmu.description().model_exchange.is_some())
    }

    /// Returns the names of process-wide settings, such as the rounding mode, that loading the FMU's binary has changed.
    pub fn changed(&self) -> &[&'static str] {
        self.fmu().changed()
    }
}

#[derive(Clone, Debug)]
pub struct Setup {
    settings: Vec<Setting>,
    inputs: Vec<u32>,
    /// For each input, true if its value is held constant from row to row.
    held: Vec<bool>,
    outputs: Vec<Output>,
    reads: Vec<u32>,
    tolerance: Option<f64>,
    /// Number of communication steps from one row to the next (Co-Simulation).
    substeps: usize,
    /// Largest number of steps that the host's solver may take from one row to the next.
    most_steps: usize,
}

#[derive(Clone, Debug)]
struct Output {
    /// Index of the sensor's first variable in [`Setup::reads`].
    from: usize,
    quantity: Quantity,
    channel: usize,
    sensor: Option<Sensor>,
}

impl Output {
    fn value(&self, read: &[f64]) -> f64 {
        let needs = &read[self.from..self.from + self.quantity.needs.len()];
        let value = self.quantity.values(needs)[self.channel];
        self.sensor.as_ref().map_or(value, |sensor| sensor.expected(value))
    }
}

enum Initialised<'m> {
    Own(Instance<'m>),
    Host(exchange::Run<Box<Instance<'m>>>),
}

pub type Value = (u32, f64);

impl Setup {
    /// Returns the setup of the simulations for a question: the value references of the question's variables and the
    /// settings of the solver.
    ///
    /// # Errors
    /// If the FMU lacks a variable of the question; the message lists all these names.
    pub fn new(question: &Question, description: &ModelDescription) -> Result<Self> {
        let mut problems = Vec::new();
        let references = |names: &[String], problems: &mut Vec<String>| -> Vec<u32> {
            let mut found = Vec::new();
            for name in names {
                match real(description, name) {
                    Ok(variable) => found.push(variable.reference),
                    Err(error) => problems.push(error.to_string()),
                }
            }
            found
        };
        let inputs = references(&question.inputs, &mut problems);
        let (mut outputs, mut reads) = (Vec::new(), Vec::new());
        for name in &question.outputs {
            let found = match question.sensor(name, description) {
                Ok(Some((sensor, quantity, channel))) => {
                    Ok((quantity, channel, Some(sensor.clone())))
                }
                Ok(None) => Quantity::variable(description, name, None).map(|q| (q, 0, None)),
                Err(error) => Err(error),
            };
            match found {
                Ok((quantity, channel, sensor)) => {
                    let from = reads.len();
                    reads.extend(references(&quantity.needs, &mut problems));
                    outputs.push(Output { from, quantity, channel, sensor });
                }
                Err(error) => problems.push(format!("{error:#}")),
            }
        }
        for name in question.held.iter().filter(|name| !question.inputs.contains(name)) {
            problems.push(format!("{name} is held, but is not among the inputs"));
        }
        if outputs.is_empty() {
            problems.push("no output is fitted: name them with --outputs".into());
        }
        ensure!(problems.is_empty(), "{}", problems.join("; "));
        Ok(Setup {
            settings: question.settings.clone(),
            held: question.inputs.iter().map(|name| question.held.contains(name)).collect(),
            inputs,
            outputs,
            reads,
            tolerance: match question.solver {
                Solver::Own => question.tolerance,
                Solver::Host(tolerance) => Some(tolerance),
            },
            substeps: 1,
            most_steps: exchange::MOST_STEPS,
        })
    }

    /// Returns setups for the same simulations with smaller errors of the solver: with a smaller tolerance, with shorter
    /// communication steps, and with the host's solver if it can integrate the FMU ([`Setup::can_exchange`]), for which the FMU
    /// is opened again. The FMU may refuse or ignore a smaller tolerance and shorter steps. The host's solver refuses
    /// simulations that would take long.
    pub fn finer(&self, model: &Model) -> Vec<(Setup, Option<Model>)> {
        let with = |tolerance| Setup { tolerance: Some(tolerance), ..self.clone() };
        let Model::Own(fmu) = model else {
            let tolerance = COMPARED_FACTOR * self.tolerance.unwrap_or(COMPARED_TOLERANCE);
            return vec![(with(tolerance.max(1e3 * f64::EPSILON)), None)];
        };
        let suggested = fmu.description().default_experiment.tolerance.filter(|t| *t > 0.0);
        let tolerance = self.tolerance.or(suggested);
        let tolerance = tolerance.map_or(COMPARED_TOLERANCE, |t| COMPARED_FACTOR * t);
        let mut all = vec![
            (with(tolerance), None),
            (Setup { substeps: 2 * self.substeps, ..self.clone() }, None),
        ];
        if self.can_exchange(model)
            && let Ok(model) = Model::open(fmu.path(), Solver::Host(COMPARED_TOLERANCE))
        {
            let setup = Setup { most_steps: COMPARED_STEPS, ..with(COMPARED_TOLERANCE) };
            all.push((setup, Some(model)));
        }
        all
    }

    pub fn can_exchange(&self, model: &Model) -> bool {
        model.offers_exchange() && !self.slopes_act(model.fmu()).is_ok_and(|act| act)
    }

    /// Returns true if an output depends directly on the time derivative (slope) of an input. For example, the slope of the
    /// wheels' angular momentum is a torque on a spacecraft. Model Exchange passes no slopes, so the host's solver would
    /// then integrate another motion.
    fn slopes_act(&self, fmu: &Fmu) -> Result<bool> {
        let description = fmu.description();
        if !interpolates(description) {
            return Ok(false);
        }
        let outputs = description.variables.iter();
        let outputs =
            outputs.filter(|v| v.causality == Causality::Output && v.kind() == Type::Real);
        let outputs: Vec<u32> = outputs.map(|v| v.reference).collect();
        let reads = |instance: &mut Instance| -> Result<Vec<f64>> {
            let mut values = vec![0.0; outputs.len()];
            instance.get_real(&outputs, &mut values)?;
            Ok(values)
        };
        let slopes = |slope: f64| -> Vec<f64> {
            self.held.iter().map(|held| if *held { 0.0 } else { slope }).collect()
        };
        let begun = || -> Result<Instance> {
            let mut instance = rest::instantiate(fmu, "identify")?;
            for setting in self.settings.iter().filter(|setting| setting.recording.is_none()) {
                instance.set(&setting.name, &setting.value)?;
            }
            instance.enter_initialization_mode(self.tolerance, 0.0, None)?;
            instance.exit_initialization_mode()?;
            Ok(instance)
        };
        let mut instance = begun()?;
        instance.set_slopes(&self.inputs, &slopes(0.0))?;
        let without = reads(&mut instance)?;
        instance.set_slopes(&self.inputs, &slopes(1.0))?;
        if reads(&mut instance)? != without {
            return Ok(true);
        }
        // in FMI 3.0 a slope has an effect only during a step, so that steps of several sizes are compared: a direct dependence
        // on the slope does not shrink with the step
        let after = |step: f64, slope: f64| -> Result<Vec<f64>> {
            let mut instance = begun()?;
            let mut values = vec![0.0; self.inputs.len()];
            instance.get_real(&self.inputs, &mut values)?;
            instance.set_real(&self.inputs, &values)?;
            instance.do_step_along(0.0, step, &self.inputs, &values, &slopes(slope))?;
            reads(&mut instance)
        };
        let change = |step: f64| -> Result<Vec<f64>> {
            let pairs = after(step, 1.0)?.into_iter().zip(after(step, 0.0)?);
            Ok(pairs.map(|(with, without)| (with - without).abs()).collect())
        };
        let [longest, middle, shortest] = SLOPE_PROBES.map(change);
        let (longest, middle, shortest) = (longest?, middle?, shortest?);
        let remains = |k: usize| longest[k] > 0.0 && middle[k].min(shortest[k]) > 0.5 * longest[k];
        Ok((0..outputs.len()).any(remains))
    }

    /// Returns the outputs at the rows of a recording; `number` is its index.
    ///
    /// # Errors
    /// If the FMU refuses a call; the message has the time.
    pub fn run(
        &self,
        model: &Model,
        values: &[Value],
        number: usize,
        record: &Record,
    ) -> Result<Vec<Vec<f64>>> {
        match self.initialised(model, values, number, record)? {
            Initialised::Own(mut instance) => self.step(&mut instance, model.description(), record),
            Initialised::Host(run) => self.integrate(run, record),
        }
    }

    /// Returns the FMU's warnings at the beginning of a recording; `number` is its index.
    ///
    /// # Errors
    /// If the FMU refuses a call.
    pub fn warnings(
        &self,
        model: &Model,
        values: &[Value],
        number: usize,
        record: &Record,
    ) -> Result<Vec<String>> {
        Ok(match self.initialised(model, values, number, record)? {
            Initialised::Own(mut instance) => instance.take_warnings(),
            Initialised::Host(mut run) => run.instance().take_warnings(),
        })
    }

    fn initialised<'m>(
        &self,
        model: &'m Model,
        values: &[Value],
        number: usize,
        record: &Record,
    ) -> Result<Initialised<'m>> {
        let first = self.course(record, 0).0;
        let start = record.time[0];
        let fmu = model.fmu();
        let mut instance = rest::instantiate(fmu, "identify")?;
        let own = |setting: &&Setting| setting.recording.is_none_or(|of| of == number);
        for setting in self.settings.iter().filter(own) {
            instance.set(&setting.name, &setting.value)?;
        }
        let set = self.settings.iter().filter(own).map(|setting| setting.name.as_str());
        if let Some(most) = most_steps(fmu.description(), set, &record.time) {
            instance.set(MAX_STEPS, &most.to_string())?;
        }
        for (reference, value) in values {
            instance.set_real(&[*reference], &[*value])?;
        }
        let hosts = matches!(model, Model::Host(_));
        let tolerance = if hosts { None } else { self.tolerance };
        instance.enter_initialization_mode(tolerance, start, None)?;
        if !first.is_empty() {
            instance.set_real(&self.inputs, &first)?;
        }
        instance.exit_initialization_mode()?;
        if !hosts {
            return Ok(Initialised::Own(instance));
        }
        let tolerance = self.tolerance.unwrap_or(COMPARED_TOLERANCE);
        let run = exchange::Run::new(Box::new(instance), tolerance, start, self.most_steps)?;
        Ok(Initialised::Host(run))
    }

    fn integrate(
        &self,
        mut run: exchange::Run<Box<Instance>>,
        record: &Record,
    ) -> Result<Vec<Vec<f64>>> {
        let mut read = vec![Vec::with_capacity(record.time.len()); self.outputs.len()];
        for row in 0..record.time.len() {
            let (values, slopes) = self.course(record, row);
            let jumps = row > 0 && self.jumps(record, row);
            run.drive(&self.inputs, &values, &slopes, jumps)?;
            let mut at = vec![0.0; self.reads.len()];
            run.instance().get_real(&self.reads, &mut at)?;
            self.keep(&at, &mut read)?;
            if let Some(next) = record.time.get(row + 1) {
                run.integrate(*next)?;
            }
        }
        self.late(record, read)
    }

    /// Simulates with the FMU's own solver: at each row it sets the inputs (with slopes if the FMU takes them), reads the outputs
    /// and steps to the next row. If the FMU takes no slopes, the way from row to row is divided into [`HELD_STEPS`] steps, and
    /// linear inputs are held at their value in the middle of each step.
    fn step(
        &self,
        instance: &mut Instance,
        description: &ModelDescription,
        record: &Record,
    ) -> Result<Vec<Vec<f64>>> {
        let is_sloped = interpolates(description) && self.held.iter().any(|held| !held);
        let mut read = vec![Vec::with_capacity(record.time.len()); self.outputs.len()];
        for row in 0..record.time.len() {
            let (values, slopes) = self.course(record, row);
            if !values.is_empty() {
                instance.set_real(&self.inputs, &values)?;
            }
            // an output may depend on the slope of an input, which changes at this row; the slope after the row counts
            if is_sloped {
                instance.set_slopes(&self.inputs, &slopes)?;
            }
            let mut at = vec![0.0; self.reads.len()];
            instance.get_real(&self.reads, &mut at)?;
            self.keep(&at, &mut read)?;
            let Some(next) = record.time.get(row + 1) else { continue };
            let holds_lines = !is_sloped && slopes.iter().any(|slope| *slope != 0.0);
            let parts = self.substeps * if holds_lines { HELD_STEPS } else { 1 };
            let along = |by: f64| -> Vec<f64> {
                values.iter().zip(&slopes).map(|(value, slope)| value + slope * by).collect()
            };
            let part = (next - record.time[row]) / parts as f64;
            for k in 0..parts {
                let by = part * k as f64;
                let t = record.time[row] + by;
                let h = if k + 1 == parts { next - t } else { part };
                let done = if is_sloped {
                    let values = along(by);
                    if k > 0 {
                        instance.set_real(&self.inputs, &values)?;
                    }
                    instance.do_step_along(t, h, &self.inputs, &values, &slopes)
                } else {
                    if holds_lines {
                        instance.set_real(&self.inputs, &along(by + 0.5 * h))?;
                    }
                    instance.do_step(t, h)
                };
                done.with_context(|| format!("the run stopped at t = {t} s"))?;
            }
        }
        self.late(record, read)
    }

    fn keep(&self, at: &[f64], read: &mut [Vec<f64>]) -> Result<()> {
        for (output, column) in self.outputs.iter().zip(read) {
            let value = output.value(at);
            ensure!(value.is_finite(), "an output is not finite");
            column.push(value);
        }
        Ok(())
    }

    /// Delays the outputs that a sensor measures: the reading in each row is the output in the row that is earlier by the
    /// sensor's delay, or 0 if this row would be before the beginning of the recording.
    fn late(&self, record: &Record, mut read: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>> {
        for (number, (output, column)) in self.outputs.iter().zip(&mut read).enumerate() {
            let Some(sensor) = output.sensor.as_ref().filter(|s| s.errors().delay > 0.0) else {
                continue;
            };
            let (delay, truth) = (sensor.errors().delay, column.clone());
            for (row, value) in column.iter_mut().enumerate() {
                let then = record.time[row] - delay;
                // two times that differ by less than a billionth are the same row
                let slack = 1e-9 * (1.0 + record.time[row].abs());
                let at = record.time.partition_point(|t| *t < then - slack);
                let there = record.time[at] <= then + slack;
                let measured = record.outputs.get(number).is_some_and(|y| !y[row].is_nan());
                ensure!(
                    there || !measured,
                    "sensor {}: its reading at {} s is delayed by {delay} s, but the recording begins later than the measured time",
                    sensor.name,
                    record.time[row]
                );
                *value = if there { truth[at] } else { 0.0 };
            }
        }
        Ok(read)
    }

    fn course(&self, record: &Record, row: usize) -> (Vec<f64>, Vec<f64>) {
        let one = |(signal, held): (&Vec<f64>, &bool)| {
            let next = row + 1;
            let slope = match record.time.get(next) {
                Some(end) if !held => (signal[next] - signal[row]) / (end - record.time[row]),
                _ => 0.0,
            };
            (signal[row], slope)
        };
        record.inputs.iter().zip(&self.held).map(one).unzip()
    }

    fn jumps(&self, record: &Record, row: usize) -> bool {
        let held = record.inputs.iter().zip(&self.held).filter(|(_, held)| **held);
        held.into_iter().any(|(signal, _)| signal[row] != signal[row - 1])
    }
}
