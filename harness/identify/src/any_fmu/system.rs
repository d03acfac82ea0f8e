//! An FMU and its recordings as a system that the engine can fit.

use std::borrow::Cow;

use anyhow::Result;

use crate::engine::{Drift, Hold, Motion, Problem, Recorded, Role, Signal, System, Unknown};
use crate::input::question::Question;
use crate::input::record::Record;
use crate::model::overridden::{near, refuse};
use crate::model::simulate::{Model, Setup, Value};
use crate::model::unknown::Target;

/// Smallest noise of an output before the first residual is known, relative to the output's standard deviation. It is needed
/// because simulated recordings have no noise.
const LEAST_NOISE: f64 = 1e-3;
/// Prior of the drift of an output. Its width is large because the kind of sensor is unknown.
const DRIFT: Drift = Drift { size: 0.3, time: 30.0, width: 3.0 };

pub struct FmuSystem<'a> {
    pub model: &'a Model,
    pub setup: Setup,
    pub records: &'a [Record],
    targets: Vec<(Target, Role)>,
}

impl<'a> FmuSystem<'a> {
    /// Returns the system for a question, and its unknowns in the order of the targets.
    ///
    /// # Errors
    /// If the question has a fault; the message lists all.
    pub fn new(
        model: &'a Model,
        question: &Question,
        records: &'a [Record],
    ) -> Result<(Self, Vec<Unknown>)> {
        let setup = Setup::new(question, model.description())?;
        let found = question.unknowns(model.description(), records)?;
        let targets = found.iter().map(|(unknown, target)| (*target, unknown.role)).collect();
        let (unknowns, _): (Vec<Unknown>, Vec<Target>) = found.into_iter().unzip();
        Ok((FmuSystem { model, setup, records, targets }, unknowns))
    }

    pub fn is_parameter(&self, j: usize) -> bool {
        matches!(self.targets[j].0, Target::Parameter(_))
    }

    pub fn problem(&self, unknowns: Vec<Unknown>, question: &Question) -> Problem<'_> {
        let mut signals = Vec::new();
        for (recording, record) in self.records.iter().enumerate() {
            for (output, measured) in record.outputs.iter().enumerate() {
                signals.push(Signal {
                    recording,
                    output,
                    measured: measured.clone(),
                    sampled: record.sampled(output),
                    white: record.noise(output).max(LEAST_NOISE * record.spread(output)),
                    drift: question.drift.then_some(DRIFT),
                });
            }
        }
        let recorded = |record: &Record| Recorded {
            name: record.name.clone(),
            time: record.time.clone(),
            inputs: record.inputs.clone(),
            step: 0.0,
        };
        let recordings = self.records.iter().map(recorded).collect();
        let start = unknowns.iter().map(|unknown| unknown.start).collect();
        // the question states the intersample behaviour of each input, so that none has to be estimated
        let plain = Problem::new(self, recordings, signals, unknowns, vec![start]);
        Problem { drawn: question.starts.saturating_sub(1), rough: true, ..plain }
    }

    /// Returns the FMU's warnings at the start values of the unknowns, each only once.
    ///
    /// # Errors
    /// If an unknown has no effect in any recording because another parameter replaces it.
    pub fn warnings(&self, unknowns: &[Unknown]) -> Result<Vec<String>> {
        let start: Vec<f64> = unknowns.iter().map(|u| u.start).collect();
        let moved: Vec<f64> = unknowns.iter().map(|u| near(u.start, u.bounds, u.reach)).collect();
        let of = |(number, record): (usize, &Record)| {
            let with =
                |x: &[f64]| self.setup.warnings(self.model, &self.reals(x, number), number, record);
            // values that the FMU refuses are reported later, by the search
            with(&moved).or_else(|_| with(&start)).unwrap_or_default()
        };
        let warnings: Vec<Vec<String>> = self.records.iter().enumerate().map(of).collect();
        for (unknown, (target, role)) in unknowns.iter().zip(&self.targets) {
            let (Target::Parameter(_), Role::Run(recording)) = (target, role) else { continue };
            let own = warnings.iter().enumerate().filter(|(number, _)| unknown.is_of(*number));
            let name = recording.and_then(|_| unknown.name.rsplit_once('@'));
            let name = name.map_or(&*unknown.name, |(name, _)| name);
            let refused: Vec<Result<()>> = own.map(|(_, said)| refuse(name, said)).collect();
            // one recording in which the unknown has an effect is enough
            if refused.iter().all(Result::is_err) {
                refused.into_iter().collect::<Result<()>>()?;
            }
        }
        let mut once: Vec<String> = Vec::new();
        for warning in warnings.into_iter().flatten() {
            if !once.contains(&warning) {
                once.push(warning);
            }
        }
        Ok(once)
    }

    /// Calls `use_them` with copies of this system that have smaller solver errors ([`Setup::finer`]). The first copy
    /// has a smaller tolerance.
    pub fn with_finer<T>(&self, use_them: impl FnOnce(&[&dyn System]) -> T) -> T {
        let finer = self.setup.finer(self.model);
        let mut systems: Vec<FmuSystem> = Vec::new();
        for (setup, model) in &finer {
            let (model, setup) = (model.as_ref().unwrap_or(self.model), setup.clone());
            let targets = self.targets.clone();
            systems.push(FmuSystem { model, setup, records: self.records, targets });
        }
        let systems: Vec<&dyn System> = systems.iter().map(|s| s as &dyn System).collect();
        use_them(&systems)
    }

    fn acts(&self, j: usize, recording: usize) -> bool {
        matches!(self.targets[j].1, Role::Run(of) if of.is_none_or(|of| of == recording))
    }

    fn reals(&self, values: &[f64], recording: usize) -> Vec<Value> {
        let own = (0..values.len()).filter(|j| self.acts(*j, recording));
        own.filter_map(|j| match self.targets[j].0 {
            Target::Parameter(reference) => Some((reference, values[j])),
            _ => None,
        })
        .collect()
    }

    fn acting(&self, values: &[f64], recording: usize, rows: usize) -> Cow<'_, Record> {
        let whole = &self.records[recording];
        let mut record = match rows < whole.time.len() {
            true => Cow::Owned(whole.first_rows(rows)),
            false => Cow::Borrowed(whole),
        };
        for j in (0..values.len()).filter(|j| self.acts(*j, recording) && values[*j] != 0.0) {
            let factor = 1.0 + values[j];
            match self.targets[j].0 {
                Target::Scale(input) => {
                    record.to_mut().inputs[input].iter_mut().for_each(|value| *value *= factor);
                }
                Target::Clock => {
                    let first = whole.time[0];
                    let time = &mut record.to_mut().time;
                    time.iter_mut().for_each(|t| *t = first + factor * (*t - first));
                }
                Target::Parameter(_) | Target::Reading => {}
            }
        }
        record
    }
}

impl System for FmuSystem<'_> {
    fn run(
        &self,
        values: &[f64],
        recording: usize,
        rows: usize,
        _: Hold,
        _: bool,
    ) -> Result<Motion> {
        let record = self.acting(values, recording, rows);
        let reals = self.reals(values, recording);
        let outputs = self.setup.run(self.model, &reals, recording, &record)?;
        Ok(Motion { outputs, ..Motion::default() })
    }
}
