//! A sampled controller between the outputs and the inputs of a run.

use std::ffi::c_int;

use crate::instance::{Function, Instance, OK, WARNING};

/// What computes the commands of a cycle.
pub trait Controller {
    /// Fills `command` from what was measured at the beginning of a cycle, counted from 0, at `time`, s.
    ///
    /// # Errors
    /// Any number; it ends the run as the status of [`Function::Controller`].
    fn command(
        &mut self,
        cycle: usize,
        time: f64,
        measured: &[f64],
        command: &mut [f64],
    ) -> Result<(), c_int>;
}

/// A linear controller with state x, which sees the error e = r − y of what is measured:
/// u = C x + D e + f, then x = A x + B e. Matrices row after row.
///
/// Sums are taken from left to right without fused multiplication, so that any host that does the same
/// has the same bits.
pub struct Linear<'a> {
    /// State, n numbers.
    pub x: Vec<f64>,
    /// n × n
    pub a: &'a [f64],
    /// n × measured
    pub b: &'a [f64],
    /// commands × n
    pub c: &'a [f64],
    /// commands × measured
    pub d: &'a [f64],
    /// What is wanted of y, a row per cycle.
    pub reference: &'a [f64],
    /// Added to u, a row per cycle.
    pub feedforward: &'a [f64],
    /// Where in y there is a quaternion, scalar first: of its vector part the error is that of q⁻¹ ⊗ r,
    /// half of what is left to turn about each body axis, the short way round.
    pub quaternion: Option<[usize; 4]>,
    /// Room for e and the next x.
    pub error: Vec<f64>,
    /// Room for the next x.
    pub next: Vec<f64>,
}

/// Row `i` of a matrix times `x`, added to `sum`.
fn add_row(mut sum: f64, matrix: &[f64], i: usize, x: &[f64]) -> f64 {
    for (m, x) in matrix[i * x.len()..(i + 1) * x.len()].iter().zip(x) {
        sum += m * x;
    }
    sum
}

/// Vector part of q⁻¹ ⊗ r, of the sign that makes the scalar part positive.
fn attitude_error(q: [f64; 4], r: [f64; 4]) -> [f64; 3] {
    let scalar = q[0] * r[0] + q[1] * r[1] + q[2] * r[2] + q[3] * r[3];
    let sign = if scalar < 0.0 { -1.0 } else { 1.0 };
    [
        sign * (q[0] * r[1] - q[1] * r[0] - q[2] * r[3] + q[3] * r[2]),
        sign * (q[0] * r[2] + q[1] * r[3] - q[2] * r[0] - q[3] * r[1]),
        sign * (q[0] * r[3] - q[1] * r[2] + q[2] * r[1] - q[3] * r[0]),
    ]
}

impl Controller for Linear<'_> {
    fn command(
        &mut self,
        cycle: usize,
        _: f64,
        measured: &[f64],
        command: &mut [f64],
    ) -> Result<(), c_int> {
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
        for (i, u) in command.iter_mut().enumerate() {
            let sum = add_row(add_row(0.0, self.c, i, &self.x), self.d, i, &self.error);
            *u = sum + self.feedforward[cycle * self.c_rows() + i];
        }
        for (i, next) in self.next.iter_mut().enumerate() {
            *next = add_row(add_row(0.0, self.a, i, &self.x), self.b, i, &self.error);
        }
        std::mem::swap(&mut self.x, &mut self.next);
        Ok(())
    }
}

impl Linear<'_> {
    /// How many commands there are.
    fn c_rows(&self) -> usize {
        self.d.len() / self.error.len().max(1)
    }
}

/// The loop around a run: at every `parts`-th communication point a cycle begins. What the controller
/// computes from the measurements there is set `latency` cycles and `switch` communication points
/// later, and held until the next command is.
pub struct Feedback<'a, C> {
    /// The controller.
    pub controller: C,
    /// Value references of what is measured, Real variables.
    pub measured: &'a [u32],
    /// Value references of the commands, Real inputs.
    pub command: &'a [u32],
    /// Communication steps in a cycle, at least 1.
    pub parts: usize,
    /// Communication point of a cycle at which a command begins to act, below `parts`.
    pub switch: usize,
    /// Whole cycles before that.
    pub latency: usize,
    /// The commands in force from each communication point on; rows × commands.
    pub commands: &'a mut [f64],
}

/// What a run does at a communication point between reading outputs and setting inputs.
pub trait AtPoint {
    /// Acts at communication point `row`, `time` in s.
    ///
    /// # Errors
    /// The function that failed and its status.
    fn act(&mut self, fmu: &dyn Instance, row: usize, time: f64) -> Result<(), (Function, c_int)>;
}

/// Nothing: inputs follow their table.
pub struct Open;

impl AtPoint for Open {
    fn act(&mut self, _: &dyn Instance, _: usize, _: f64) -> Result<(), (Function, c_int)> {
        Ok(())
    }
}

/// A [`Feedback`] on its way through a run.
pub struct Closed<'a, C> {
    feedback: Feedback<'a, C>,
    measured: Vec<f64>,
    /// The last `latency` + 1 commands, cycle k in place k modulo their number.
    on_the_way: Vec<f64>,
}

impl<'a, C: Controller> Closed<'a, C> {
    /// The loop before its first cycle: until the first command arrives, commands are 0.
    pub fn new(feedback: Feedback<'a, C>) -> Self {
        let measured = vec![0.0; feedback.measured.len()];
        let on_the_way = vec![0.0; (feedback.latency + 1) * feedback.command.len()];
        Closed { feedback, measured, on_the_way }
    }
}

impl<C: Controller> AtPoint for Closed<'_, C> {
    fn act(&mut self, fmu: &dyn Instance, row: usize, time: f64) -> Result<(), (Function, c_int)> {
        let Feedback { controller, measured, command, parts, switch, latency, commands } =
            &mut self.feedback;
        let (width, cycle) = (command.len(), row / *parts);
        if row > 0 {
            commands.copy_within((row - 1) * width..row * width, row * width);
        }
        if row.is_multiple_of(*parts) {
            match fmu.get_real(measured, &mut self.measured) {
                OK | WARNING => (),
                status => return Err((Function::GetReal, status)),
            }
            let place = cycle % (*latency + 1);
            let new = &mut self.on_the_way[place * width..(place + 1) * width];
            controller
                .command(cycle, time, &self.measured, new)
                .map_err(|why| (Function::Controller, why))?;
        }
        if row % *parts == *switch && cycle >= *latency {
            let place = (cycle - *latency) % (*latency + 1);
            let now = &self.on_the_way[place * width..(place + 1) * width];
            commands[row * width..(row + 1) * width].copy_from_slice(now);
            return match fmu.set_real(command, now) {
                OK | WARNING => Ok(()),
                status => Err((Function::SetReal, status)),
            };
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_attitude_error_is_half_of_what_is_left_to_turn_the_short_way() {
        let about_x = |angle: f64| [(angle / 2.0).cos(), (angle / 2.0).sin(), 0.0, 0.0];
        let [x, y, z] = attitude_error(about_x(0.3), about_x(0.5));
        assert!((x - 0.1_f64.sin()).abs() < 1e-15 && y == 0.0 && z == 0.0);
        // the other sign of a quaternion is the same attitude
        let other = attitude_error(about_x(0.3).map(|q| -q), about_x(0.5));
        assert_eq!(other, [x, y, z]);
        // about y, seen from a craft turned by 90° about z: body axis x
        let half = 0.5_f64.sqrt();
        let (q, turn) = ([half, 0.0, 0.0, half], [0.1_f64.cos(), 0.0, 0.1_f64.sin(), 0.0]);
        // turn ⊗ q
        let r = [turn[0] * q[0], turn[2] * q[3], turn[2] * q[0], turn[0] * q[3]];
        let seen = attitude_error(q, r);
        assert!((seen[0] - 0.1_f64.sin()).abs() < 1e-15, "{seen:?}");
        assert!(seen[1].abs() < 1e-15 && seen[2].abs() < 1e-15);
    }

    #[test]
    fn a_linear_controller_gives_its_difference_equation() {
        // x' = 0.5 x + e, u = 2 x + 3 e + f
        let mut controller = Linear {
            x: vec![0.0],
            a: &[0.5],
            b: &[1.0],
            c: &[2.0],
            d: &[3.0],
            reference: &[1.0, 1.0, 0.0],
            feedforward: &[0.0, 10.0, 0.0],
            quaternion: None,
            error: vec![0.0],
            next: vec![0.0],
        };
        let mut u = [0.0];
        let answers: Vec<f64> = [0.0, 0.5, 2.0]
            .into_iter()
            .enumerate()
            .map(|(k, y)| {
                controller.command(k, 0.0, &[y], &mut u).unwrap();
                u[0]
            })
            .collect();
        // e = 1, 0.5, -2; x = 0, 1, 1
        assert_eq!(answers, [3.0, 2.0 + 1.5 + 10.0, 2.0 - 6.0]);
    }
}
