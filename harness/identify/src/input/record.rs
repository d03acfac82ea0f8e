//! Recordings of any FMU's inputs and outputs.

use std::path::Path;

use analysis::statistics::{deviation, noise_level, peak};
use anyhow::{Context, Result, ensure};
use host::description::ModelDescription;
use signals::recording::{self, Between, Columns, Signal, Wanted};

use crate::input::question::Question;
use crate::input::recording::{check_times, check_values};
use crate::tuning::FEWEST_VALUES;

#[derive(Clone, Debug, Default)]
pub struct Record {
    pub name: String,
    pub time: Vec<f64>,
    pub inputs: Vec<Vec<f64>>,
    /// Values of each output at the rows; NaN in rows without a measured value.
    pub outputs: Vec<Vec<f64>>,
}

impl Record {
    /// Reads a recording from a file.
    ///
    /// # Errors
    /// If the file cannot be read, lacks a signal of the question, or fails [`Record::check`].
    pub fn read(
        path: &Path,
        question: &Question,
        description: &ModelDescription,
        columns: &Columns,
        done: &mut dyn FnMut(String),
    ) -> Result<Self> {
        let names = || question.outputs.iter().chain(&question.inputs);
        let units = names().map(|name| question.unit(name, description));
        let units = units.collect::<Result<Vec<String>>>()?;
        let signals = names().zip(&units).enumerate().map(|(k, (name, unit))| Signal {
            name,
            required: true,
            between: match question.held.contains(name) {
                _ if k < question.outputs.len() => Between::Missing,
                true => Between::Held,
                false => Between::Line,
            },
            unit: Some(unit),
        });
        let signals: Vec<Signal> = signals.collect();
        let table = recording::read(path, &Wanted { signals: &signals, columns }, done)?;
        let column = |name: &str| table.column(name).unwrap_or_default().to_vec();
        let record = Record {
            name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            time: column("time"),
            inputs: question.inputs.iter().map(|name| column(name)).collect(),
            outputs: question.outputs.iter().map(|name| column(name)).collect(),
        };
        record
            .check(question)
            .with_context(|| format!("the recording {} cannot be used", path.display()))?;
        Ok(record)
    }

    /// Fails if an output has too few values, or if times or values are out of range.
    pub fn check(&self, question: &Question) -> Result<()> {
        for (output, name) in question.outputs.iter().enumerate() {
            let count = self.values(output).len();
            ensure!(
                count >= FEWEST_VALUES,
                "{name} has {count} values (allowed: at least {FEWEST_VALUES})"
            );
        }
        if self.time.len() > 1 {
            check_times(&self.time)?;
        }
        for (name, values) in question.inputs.iter().zip(&self.inputs) {
            check_values(name, values.iter().copied())?;
        }
        let outputs = question.outputs.iter().zip(&self.outputs);
        // NaN means that the output was not measured in this row
        let read = |y: &f64| if y.is_nan() { 0.0 } else { *y };
        outputs.into_iter().try_for_each(|(name, y)| check_values(name, y.iter().map(read)))
    }

    pub fn sampled(&self, output: usize) -> Vec<bool> {
        self.outputs[output].iter().map(|y| !y.is_nan()).collect()
    }

    fn values(&self, output: usize) -> Vec<f64> {
        self.outputs[output].iter().copied().filter(|y| !y.is_nan()).collect()
    }

    /// Returns the standard deviation of an output's values. If all values are equal, returns their absolute
    /// value, but at least 1.
    pub fn spread(&self, output: usize) -> f64 {
        let values = self.values(output);
        let spread = deviation(&values);
        if spread > 0.0 { spread } else { peak(&values).max(1.0) }
    }

    /// Returns the standard deviation of the noise between neighbouring rows of an output.
    pub fn noise(&self, output: usize) -> f64 {
        noise_level(&self.values(output))
    }

    pub fn first_rows(&self, rows: usize) -> Record {
        let cut = |columns: &[Vec<f64>]| columns.iter().map(|c| c[..rows].to_vec()).collect();
        Record {
            name: self.name.clone(),
            time: self.time[..rows].to_vec(),
            inputs: cut(&self.inputs),
            outputs: cut(&self.outputs),
        }
    }
}
