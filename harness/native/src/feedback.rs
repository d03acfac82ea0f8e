//! A sampled controller in the loop with an FMU: it receives outputs of a run and sets inputs.

use host::fmu::Instance;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::fmu::Fmu;
use crate::numbers::{Failure, Numbers};

/// A linear controller with the state x, which receives the error e = r − y of the measurements: u = C x + D
/// e + f, then x = A x + B e. Matrices are stored row after row.
///
/// Sums are taken from left to right without fused multiplication, so that Python computes the same bits.
struct Linear {
    x: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    d: Vec<f64>,
    /// Reference r, one row per cycle.
    reference: Vec<f64>,
    /// Feedforward f, one row per cycle.
    feedforward: Vec<f64>,
    /// Places of an attitude quaternion (scalar first) among the measurements y. For this quaternion the error is not r − y but
    /// the vector part of q⁻¹ ⊗ r: half the small rotation about each body axis that remains, by the shorter way.
    quaternion: Option<[usize; 4]>,
    /// Working memory for the error e and the next state x, so that a cycle allocates nothing.
    error: Vec<f64>,
    next: Vec<f64>,
}

/// Returns `sum` plus the product of row `i` of a matrix with `x`.
fn add_row(mut sum: f64, matrix: &[f64], i: usize, x: &[f64]) -> f64 {
    for (m, x) in matrix[i * x.len()..(i + 1) * x.len()].iter().zip(x) {
        sum += m * x;
    }
    sum
}

/// Returns the vector part of q⁻¹ ⊗ r with the sign for which the scalar part is positive: half the rotation
/// from q to r.
fn attitude_error(q: [f64; 4], r: [f64; 4]) -> [f64; 3] {
    let scalar = q[0] * r[0] + q[1] * r[1] + q[2] * r[2] + q[3] * r[3];
    let sign = if scalar < 0.0 { -1.0 } else { 1.0 };
    [
        sign * (q[0] * r[1] - q[1] * r[0] - q[2] * r[3] + q[3] * r[2]),
        sign * (q[0] * r[2] + q[1] * r[3] - q[2] * r[0] - q[3] * r[1]),
        sign * (q[0] * r[3] - q[1] * r[2] + q[2] * r[1] - q[3] * r[0]),
    ]
}

impl Linear {
    fn command(&mut self, cycle: usize, measured: &[f64], command: &mut [f64]) {
        let wanted = &self.reference[cycle * measured.len()..][..measured.len()];
        for ((e, r), y) in self.error.iter_mut().zip(wanted).zip(measured) {
            *e = r - y;
        }
        if let Some(at) = self.quaternion {
            let turn = attitude_error(at.map(|i| measured[i]), at.map(|i| wanted[i]));
            for (i, turn) in at.into_iter().skip(1).zip(turn) {
                self.error[i] = turn;
            }
        }
        let forward = &self.feedforward[cycle * command.len()..];
        for (i, u) in command.iter_mut().enumerate() {
            *u = add_row(add_row(0.0, &self.c, i, &self.x), &self.d, i, &self.error) + forward[i];
        }
        for (i, next) in self.next.iter_mut().enumerate() {
            *next = add_row(add_row(0.0, &self.a, i, &self.x), &self.b, i, &self.error);
        }
        std::mem::swap(&mut self.x, &mut self.next);
    }
}

/// Controller that computes the commands of a cycle.
enum Controller {
    Linear(Box<Linear>),
    /// A Python function of the number of the cycle, the time (s) and the measurements, which returns one number for each
    /// command.
    Function(Py<PyAny>),
}

/// The feedback loop of a run, created from the Python class `Feedback`.
///
/// A controller cycle begins at every `parts`-th row, where the controller computes its commands from the measurements. The
/// commands reach the FMU `latency` cycles and `switch` rows later, and are held until the next commands arrive.
pub struct Feedback {
    controller: Controller,
    /// Value references of the measured Reals, and their values.
    measured: (Vec<u32>, Vec<f64>),
    command: Vec<u32>,
    parts: usize,
    switch: usize,
    latency: usize,
    /// Ring buffer of the last `latency` + 1 commands, so that a command can act some cycles after it was computed. The commands
    /// of cycle k are at position k modulo `latency` + 1.
    on_the_way: Vec<f64>,
    now: Vec<f64>,
    /// Commands that act from each row on, one row of numbers per row of the run.
    pub commands: Numbers,
}

impl Feedback {
    /// Reads the Python object `feedback` of class `Feedback` for a run with `rows` rows.
    ///
    /// # Errors
    ///
    /// If an attribute is missing, or has another type or size.
    pub fn read(feedback: &Bound<PyAny>, fmu: &Fmu, rows: usize) -> PyResult<Self> {
        let references = |attribute: &str| -> PyResult<Vec<u32>> {
            let names: Vec<String> = feedback.getattr(attribute)?.extract()?;
            names.iter().map(|name| Ok(fmu.variable(name)?.reference)).collect()
        };
        let size = |attribute: &str| -> PyResult<usize> { feedback.getattr(attribute)?.extract() };
        let controller = feedback.getattr("controller")?;
        let (measured, command) = (references("measured")?, references("command")?);
        let values = vec![0.0; measured.len()];
        let (cycles, parts, latency) = (size("cycles")?, size("parts")?, size("latency")?);
        expect("rows of the run", rows, cycles * parts + 1)?;
        let controller = match controller.is_callable() {
            true => Controller::Function(controller.unbind()),
            false => {
                let sizes = (cycles, measured.len(), command.len());
                Controller::Linear(Box::new(linear(&controller, sizes)?))
            }
        };
        Ok(Feedback {
            controller,
            measured: (measured, values),
            parts,
            switch: size("switch")?,
            latency,
            on_the_way: vec![0.0; (latency + 1) * command.len()],
            now: vec![0.0; command.len()],
            commands: Numbers::borrow(&feedback.getattr("commands")?, rows, command.len(), true)?,
            command,
        })
    }

    /// Runs the controller at row `row` if a cycle begins there, and writes the commands that act from this row on into the
    /// inputs. It is called after the outputs of the row are read and before its inputs are set.
    pub fn act(&mut self, fmu: &mut Instance, row: usize, time: f64) -> Result<(), Failure> {
        let (width, cycle) = (self.now.len(), row / self.parts);
        let place = |cycle: usize| (cycle % (self.latency + 1)) * width;
        if row.is_multiple_of(self.parts) {
            let (references, measured) = &mut self.measured;
            fmu.get_real(references, measured)?;
            let new = &mut self.on_the_way[place(cycle)..][..width];
            match &mut self.controller {
                Controller::Linear(linear) => linear.command(cycle, measured, new),
                Controller::Function(law) => Python::attach(|py| {
                    let given: Vec<f64> =
                        law.call1(py, (cycle, time, &measured[..]))?.extract(py)?;
                    expect("commands of the controller", given.len(), width)?;
                    new.copy_from_slice(&given);
                    PyResult::Ok(())
                })?,
            }
        }
        if row % self.parts == self.switch && cycle >= self.latency {
            self.now.copy_from_slice(&self.on_the_way[place(cycle - self.latency)..][..width]);
            fmu.set_real(&self.command, &self.now)?;
        }
        self.commands.push(&self.now);
        Ok(())
    }
}

/// Returns an error unless the number `found` of the items named `what` is `expected`.
fn expect(what: &str, found: usize, expected: usize) -> PyResult<()> {
    if found == expected {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{what}: {found} (expected: {expected})")))
}

/// Reads a linear controller from the Python object `of`, which has the class `Linear`.
fn linear(
    of: &Bound<PyAny>,
    (cycles, measured, commands): (usize, usize, usize),
) -> PyResult<Linear> {
    let matrix = |name: &str, rows: usize, columns: usize| -> PyResult<Vec<f64>> {
        let numbers = PyBuffer::<f64>::get(&of.getattr(name)?)?.to_vec(of.py())?;
        expect(&format!("numbers in {name}"), numbers.len(), rows * columns)?;
        Ok(numbers)
    };
    let states = of.getattr("A")?.len()?;
    let quaternion: Option<[usize; 4]> = of.getattr("quaternion")?.extract()?;
    if quaternion.is_some_and(|places| places.iter().any(|place| *place >= measured)) {
        return Err(PyValueError::new_err(
            "quaternion: an index is not below the number of measurements",
        ));
    }
    Ok(Linear {
        x: vec![0.0; states],
        a: matrix("A", states, states)?,
        b: matrix("B", states, measured)?,
        c: matrix("C", commands, states)?,
        d: matrix("D", commands, measured)?,
        reference: matrix("reference", cycles, measured)?,
        feedforward: matrix("feedforward", cycles, commands)?,
        quaternion,
        error: vec![0.0; measured],
        next: vec![0.0; states],
    })
}
