//! A sampled controller in the loop with an FMU: it receives outputs of a run and sets inputs.

use host::c_abi::Called;
use host::fmu::Instance;
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::fmu::Fmu;
use crate::numbers::{Failure, Numbers};

/// A linear controller with the state x, which receives the error e = r − y of the measurements: u = C x + D
/// e + f, then x = A x + B e. Matrices are stored row after row.
///
/// Sums are computed from left to right without fused multiplication, so that a computation in Python is bit-identical.
struct Linear {
    x: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
    d: Vec<f64>,
    reference: Vec<f64>,
    feedforward: Vec<f64>,
    /// Positions of an attitude quaternion q (scalar first) among the measurements y. For the attitude, the error is not r − y,
    /// but the vector part of q⁻¹ ⊗ r. It is half of the remaining rotation about each body axis if this rotation is small; of
    /// the two possible rotations the shorter one is used.
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

enum Controller {
    Linear(Box<Linear>),
    /// A Python function. It receives the number of the cycle, the time (s) and the measurements, and returns one
    /// number for each command.
    Function(Py<PyAny>),
}

/// A reaction wheel whose torque the controller commands. `place` is the column of its torque among the commands. The
/// other fields are its axis as a unit vector in body axes, its moment of inertia (kg·m²), the largest torque on the
/// craft (N·m), to which commands are limited, the largest and the present speed relative to the body (rad/s), and the
/// value references of `h_wheels`.
struct Wheel {
    place: usize,
    axis: [f64; 3],
    inertia: f64,
    max_torque: f64,
    max_speed: f64,
    speed: f64,
}

impl Wheel {
    /// Returns the torque on the craft for the commanded torque `asked`, and the time for which it can act, s.
    ///
    /// The torque is limited to `max_torque`. At the largest speed a torque that would increase the speed has no effect.
    fn limit_torque(&self, asked: f64) -> (f64, f64) {
        let torque = asked.clamp(-self.max_torque, self.max_torque);
        let rate = -torque / self.inertia;
        let left = self.max_speed.copysign(rate) - self.speed;
        match torque == 0.0 || left * rate <= 0.0 {
            true => (0.0, f64::INFINITY),
            false => (torque, left / rate),
        }
    }
}

struct Wheels {
    each: Vec<Wheel>,
    references: [u32; 3],
    /// Total angular momentum of the wheels relative to the body, N·m·s, at the beginning of the present step.
    /// `slope` is its time derivative.
    momentum: [f64; 3],
    slope: [f64; 3],
    step: f64,
    speeds: Numbers,
}

/// The feedback loop of a run, created from the Python class `Feedback`.
///
/// A controller cycle begins at every `parts`-th row, where the controller computes its commands from the measurements. The
/// commands reach the FMU `latency` cycles and `switch` rows later, and are held until the next commands arrive.
pub struct Feedback {
    controller: Controller,
    /// Value references of the measured Reals, and their values.
    measured: (Vec<u32>, Vec<f64>),
    /// Value references of the commanded inputs, their columns among the commands, and their values.
    command: (Vec<u32>, Vec<usize>, Vec<f64>),
    wheels: Option<Wheels>,
    parts: usize,
    switch: usize,
    latency: usize,
    /// Ring buffer of the last `latency` + 1 commands, so that a command can act some cycles after it was computed. The commands
    /// of cycle k are at position k modulo `latency` + 1.
    on_the_way: Vec<f64>,
    now: Vec<f64>,
    /// One row of commands for each row of the run: the commands that act from this row to the next. Torques of
    /// wheels are limited to the torque that the wheel can give.
    commands: Numbers,
}

impl Feedback {
    /// Reads the Python object `feedback` of class `Feedback` for a run with `rows` rows.
    ///
    /// # Errors
    ///
    /// If an attribute is missing, or has another type or size.
    pub fn read(feedback: &Bound<PyAny>, fmu: &Fmu, rows: usize) -> PyResult<Self> {
        let names =
            |attribute: &str| -> PyResult<Vec<String>> { feedback.getattr(attribute)?.extract() };
        let reference = |name: &String| -> PyResult<u32> { Ok(fmu.variable(name)?.reference) };
        let size = |attribute: &str| -> PyResult<usize> { feedback.getattr(attribute)?.extract() };
        let controller = feedback.getattr("controller")?;
        let measured = names("measured")?.iter().map(reference).collect::<PyResult<Vec<_>>>()?;
        let command = names("command")?;
        let values = vec![0.0; measured.len()];
        let wheels = wheels(feedback, fmu, rows, command.len())?;
        let turned = |place: &usize| {
            wheels.iter().flat_map(|of| &of.each).any(|wheel| wheel.place == *place)
        };
        let places: Vec<usize> = (0..command.len()).filter(|place| !turned(place)).collect();
        let inputs =
            places.iter().map(|i| reference(&command[*i])).collect::<PyResult<Vec<_>>>()?;
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
            command: (inputs, places.clone(), vec![0.0; places.len()]),
            wheels,
        })
    }

    /// Runs the controller at row `row` if a cycle begins there, and writes the commands that act from this row to the next into
    /// the inputs. It is called after the outputs of the row are read and before its inputs are set.
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
            let (references, places, values) = &mut self.command;
            if !references.is_empty() {
                for (value, place) in values.iter_mut().zip(places) {
                    *value = self.now[*place];
                }
                fmu.set_real(references, values)?;
            }
        }
        let Some(wheels) = &mut self.wheels else {
            self.commands.push(&self.now);
            return Ok(());
        };
        let mut acting = self.now.clone();
        for wheel in &wheels.each {
            acting[wheel.place] = wheel.limit_torque(self.now[wheel.place]).0;
        }
        self.commands.push(&acting);
        self.record_speeds();
        Ok(())
    }

    /// Adds the present speeds of the wheels to the record. The last row has speeds, but no commands.
    pub fn record_speeds(&mut self) {
        if let Some(wheels) = &mut self.wheels {
            let speeds: Vec<f64> = wheels.each.iter().map(|wheel| wheel.speed).collect();
            wheels.speeds.push(&speeds);
        }
    }

    /// Lets the wheels turn from the time `begin` on, and returns the end of the step in which their torques are constant, s: `end`,
    /// or the time before it at which a wheel reaches its largest speed.
    pub fn turn(&mut self, fmu: &mut Instance, begin: f64, end: f64) -> Called<f64> {
        let Some(wheels) = &mut self.wheels else { return Ok(end) };
        for (h, slope) in wheels.momentum.iter_mut().zip(&mut wheels.slope) {
            // the momentum is extrapolated in the same way as the FMU extrapolates its input over the preceding step
            *h += *slope * wheels.step;
            *slope = 0.0;
        }
        let full_at = |wheel: &Wheel| begin + wheel.limit_torque(self.now[wheel.place]).1;
        for wheel in &mut wheels.each {
            if full_at(wheel) <= begin {
                wheel.speed = wheel.max_speed.copysign(-self.now[wheel.place]);
            }
        }
        let stop = wheels.each.iter().map(full_at).fold(end, f64::min);
        wheels.step = stop - begin;
        for wheel in &mut wheels.each {
            let (torque, _) = wheel.limit_torque(self.now[wheel.place]);
            for (slope, axis) in wheels.slope.iter_mut().zip(wheel.axis) {
                *slope -= torque * axis;
            }
            wheel.speed = match full_at(wheel) <= stop {
                true => wheel.max_speed.copysign(-torque),
                false => wheel.speed - torque * wheels.step / wheel.inertia,
            };
        }
        fmu.set_real(&wheels.references, &wheels.momentum)?;
        Ok(stop)
    }

    /// Returns value references, values and derivatives of the inputs that change along a line over the present step.
    pub fn lines(&self) -> Option<(&[u32], &[f64], &[f64])> {
        let wheels = self.wheels.as_ref()?;
        Some((&wheels.references, &wheels.momentum, &wheels.slope))
    }

    /// Writes the rows of commands and speeds that have been recorded to Python's arrays.
    pub fn write(&mut self, py: Python) {
        self.commands.write(py);
        if let Some(wheels) = &mut self.wheels {
            wheels.speeds.write(py);
        }
    }
}

/// Returns an error unless the number `found` of the items named `what` is `expected`.
pub fn expect(what: &str, found: usize, expected: usize) -> PyResult<()> {
    if found == expected {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{what}: {found} (expected: {expected})")))
}

fn wheels(
    feedback: &Bound<PyAny>,
    fmu: &Fmu,
    rows: usize,
    commands: usize,
) -> PyResult<Option<Wheels>> {
    /// A wheel as Python passes it: column of its torque among the commands, axis in body axes, moment of inertia,
    /// kg·m², largest torque, N·m, largest speed and present speed, rad/s.
    type Given = (usize, [f64; 3], f64, f64, f64, f64);
    let given: Vec<Given> = feedback.getattr("wheels")?.extract()?;
    if given.is_empty() {
        return Ok(None);
    }
    let mut references = [0; 3];
    for (i, reference) in references.iter_mut().enumerate() {
        *reference = fmu.variable(&format!("h_wheels[{}]", i + 1))?.reference;
    }
    let wrong = |(place, _, inertia, max_torque, max_speed, _): &Given| {
        *place >= commands || !(*inertia > 0.0 && *max_torque >= 0.0 && *max_speed >= 0.0)
    };
    if given.iter().any(wrong) {
        return Err(PyValueError::new_err(
            "wheels: the index of a command, an inertia or a limit is out of range (allowed: index below the number \
             of commands, inertia above 0, max_torque and max_speed 0 or more)",
        ));
    }
    let speeds = Numbers::borrow(&feedback.getattr("speeds")?, rows, given.len(), true)?;
    let each = given
        .into_iter()
        .map(|(place, axis, inertia, max_torque, max_speed, speed)| Wheel {
            place,
            axis,
            inertia,
            max_torque,
            max_speed,
            speed,
        })
        .collect();
    let momentum = feedback.getattr("momentum")?.extract()?;
    Ok(Some(Wheels { each, references, momentum, slope: [0.0; 3], step: 0.0, speeds }))
}

/// Reads a linear controller from the Python object `of` of class `Linear`.
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
