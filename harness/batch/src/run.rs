//! The loop over the communication points.

use std::ffi::c_int;

use crate::feedback::AtPoint;
use crate::instance::{Function, Instance, OK, WARNING};

/// Inputs of one type: `references.len()` values per row, row after row.
pub struct Inputs<'a, T> {
    /// Their value references.
    pub references: &'a [u32],
    /// Their values from each communication point to the next.
    pub values: &'a [T],
}

/// Outputs of one type, as [`Inputs`].
pub struct Outputs<'a, T> {
    /// Their value references.
    pub references: &'a [u32],
    /// Their values at each communication point.
    pub values: &'a mut [T],
}

/// A run: one row per communication point.
pub struct Run<'a> {
    /// Communication points, s; the instance is at the first of them.
    pub time: &'a [f64],
    /// Real inputs.
    pub reals: Inputs<'a, f64>,
    /// Derivatives of the Real inputs from each communication point to the next, per s; `None`: the
    /// inputs are held.
    pub slopes: Option<&'a [f64]>,
    /// Integer inputs, enumerations among them.
    pub integers: Inputs<'a, c_int>,
    /// Boolean inputs.
    pub booleans: Inputs<'a, c_int>,
    /// Real outputs; not only variables with causality output, any that can be read.
    pub real_outputs: Outputs<'a, f64>,
    /// Integer outputs, enumerations among them.
    pub integer_outputs: Outputs<'a, c_int>,
    /// Boolean outputs.
    pub boolean_outputs: Outputs<'a, c_int>,
}

/// Where a run stopped: the first call that answered neither fmi2OK nor fmi2Warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Stop {
    /// Communication point, from 0. The outputs of all rows before it are there; its own, too, unless
    /// the function is one that gets.
    pub row: usize,
    /// The function.
    pub function: Function,
    /// What it returned, an `fmi2Status`.
    pub status: c_int,
}

impl<T> Inputs<'_, T> {
    /// Hands row `k` to `set`, unless there are none.
    fn set(&self, k: usize, set: impl FnOnce(&[u32], &[T]) -> c_int) -> c_int {
        let n = self.references.len();
        if n == 0 { OK } else { set(self.references, &self.values[k * n..(k + 1) * n]) }
    }
}

impl<T> Outputs<'_, T> {
    /// Has `get` fill row `k`, unless there are none.
    fn get(&mut self, k: usize, get: impl FnOnce(&[u32], &mut [T]) -> c_int) -> c_int {
        let n = self.references.len();
        if n == 0 { OK } else { get(self.references, &mut self.values[k * n..(k + 1) * n]) }
    }
}

/// Drives an instance through a run: at every communication point it reads the outputs, then sets
/// the inputs and steps on to the next point; after the last step it reads once more. A controller acts
/// between reading and setting (`at_point`).
///
/// An output is thus its value at the end of the step that leads to its row (at the first row: after
/// the initialisation). Where an input jumps at a row, an output that follows it at once shows the
/// jump in the next row.
///
/// # Errors
/// The first call that fails ends the run.
pub fn run(fmu: &dyn Instance, run: &mut Run, at_point: &mut impl AtPoint) -> Result<(), Stop> {
    for k in 0..run.time.len() {
        let check = |function, status| match status {
            OK | WARNING => Ok(()),
            status => Err(Stop { row: k, function, status }),
        };
        let time = run.time[k];
        check(Function::GetReal, run.real_outputs.get(k, |r, v| fmu.get_real(r, v)))?;
        check(Function::GetInteger, run.integer_outputs.get(k, |r, v| fmu.get_integer(r, v)))?;
        check(Function::GetBoolean, run.boolean_outputs.get(k, |r, v| fmu.get_boolean(r, v)))?;
        let Some(next) = run.time.get(k + 1) else { break };
        at_point.act(fmu, k, time).map_err(|(function, status)| Stop {
            row: k,
            function,
            status,
        })?;
        check(Function::SetReal, run.reals.set(k, |r, v| fmu.set_real(r, v)))?;
        check(Function::SetInteger, run.integers.set(k, |r, v| fmu.set_integer(r, v)))?;
        check(Function::SetBoolean, run.booleans.set(k, |r, v| fmu.set_boolean(r, v)))?;
        if let Some(slopes) = run.slopes {
            let n = run.reals.references.len();
            let status = run.reals.set(k, |r, v| fmu.set_slopes(r, v, &slopes[k * n..(k + 1) * n]));
            check(Function::SetRealInputDerivatives, status)?;
        }
        let (function, status) = fmu.do_step(time, next - time);
        check(function, status)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;
    use crate::feedback::{Closed, Controller, Feedback, Open};

    /// Adds up u·H + slope·H²/2; writes down every call; `fails` at the step from that time.
    #[derive(Default)]
    struct Integrator {
        sum: RefCell<[f64; 3]>, // sum, input, slope
        calls: RefCell<Vec<String>>,
        fails: Option<f64>,
    }

    impl Integrator {
        fn said(&self, call: String) -> c_int {
            self.calls.borrow_mut().push(call);
            OK
        }
    }

    impl Instance for Integrator {
        fn set_real(&self, references: &[u32], values: &[f64]) -> c_int {
            self.sum.borrow_mut()[1] = values[0];
            self.said(format!("set {references:?} {values:?}"))
        }
        fn set_integer(&self, references: &[u32], values: &[c_int]) -> c_int {
            self.said(format!("integer {references:?} {values:?}"))
        }
        fn set_boolean(&self, references: &[u32], values: &[c_int]) -> c_int {
            self.said(format!("boolean {references:?} {values:?}"))
        }
        fn set_slopes(&self, references: &[u32], values: &[f64], slopes: &[f64]) -> c_int {
            assert_eq!(values, [self.sum.borrow()[1]]);
            self.sum.borrow_mut()[2] = slopes[0];
            self.said(format!("slope {references:?} {slopes:?}"))
        }
        fn do_step(&self, time: f64, step: f64) -> (Function, c_int) {
            let [sum, input, slope] = *self.sum.borrow();
            *self.sum.borrow_mut() = [sum + step * (input + slope * step / 2.0), input, 0.0];
            self.said(format!("step {time} {step}"));
            (Function::DoStep, if self.fails == Some(time) { 3 } else { WARNING })
        }
        fn get_real(&self, references: &[u32], values: &mut [f64]) -> c_int {
            values.fill(self.sum.borrow()[0]);
            self.said(format!("get {references:?}"))
        }
        fn get_integer(&self, _: &[u32], values: &mut [c_int]) -> c_int {
            values.fill(7);
            OK
        }
        fn get_boolean(&self, _: &[u32], values: &mut [c_int]) -> c_int {
            values.fill(1);
            OK
        }
    }

    const TIME: [f64; 3] = [0.0, 1.0, 3.0];
    const INPUT: [f64; 3] = [1.0, 2.0, 5.0];

    fn drive(fmu: &Integrator, slopes: Option<&[f64]>) -> (Result<(), Stop>, [f64; 6], [c_int; 3]) {
        let (mut reals, mut integers) = ([-1.0; 6], [-1; 3]);
        let stop = run(
            fmu,
            &mut Run {
                time: &TIME,
                reals: Inputs { references: &[4], values: &INPUT },
                slopes,
                integers: Inputs { references: &[5, 6], values: &[1, 2, 3, 4, 5, 6] },
                booleans: Inputs { references: &[], values: &[] },
                real_outputs: Outputs { references: &[8, 9], values: &mut reals },
                integer_outputs: Outputs { references: &[3], values: &mut integers },
                boolean_outputs: Outputs { references: &[], values: &mut [] },
            },
            &mut Open,
        );
        (stop, reals, integers)
    }

    #[test]
    fn every_row_is_read_then_set_then_stepped_and_the_last_is_only_read() {
        let fmu = Integrator::default();
        let (stop, reals, integers) = drive(&fmu, Some(&[1.0, 1.5, 0.0]));
        assert_eq!(stop, Ok(()));
        // 1·1 + 1·1²/2, then 2·2 + 1.5·2²/2
        assert_eq!(reals, [0.0, 0.0, 1.5, 1.5, 8.5, 8.5]);
        assert_eq!(integers, [7; 3]);
        let expected = [
            "get [8, 9]",
            "set [4] [1.0]",
            "integer [5, 6] [1, 2]",
            "slope [4] [1.0]",
            "step 0 1",
            "get [8, 9]",
            "set [4] [2.0]",
            "integer [5, 6] [3, 4]",
            "slope [4] [1.5]",
            "step 1 2",
            "get [8, 9]",
        ];
        assert_eq!(*fmu.calls.borrow(), expected);
    }

    #[test]
    fn a_held_input_has_no_slope() {
        let fmu = Integrator::default();
        assert_eq!(drive(&fmu, None).1[4], 5.0);
        assert!(!fmu.calls.borrow().iter().any(|call| call.starts_with("slope")));
    }

    #[test]
    fn the_first_failure_ends_the_run_and_says_where() {
        let fmu = Integrator { fails: Some(1.0), ..Integrator::default() };
        let (stop, reals, _) = drive(&fmu, None);
        assert_eq!(stop, Err(Stop { row: 1, function: Function::DoStep, status: 3 }));
        assert_eq!(reals, [0.0, 0.0, 1.0, 1.0, -1.0, -1.0], "rows after it are left alone");
        assert_eq!(fmu.calls.borrow().last().unwrap(), "step 1 2");
    }

    /// Commands the number of the cycle, counted from 1; fails in cycle `fails`.
    struct Count {
        fails: usize,
    }

    impl Controller for Count {
        fn command(
            &mut self,
            cycle: usize,
            _: f64,
            measured: &[f64],
            command: &mut [f64],
        ) -> Result<(), c_int> {
            assert_eq!(measured.len(), 1);
            command.fill(cycle as f64 + 1.0);
            if cycle == self.fails { Err(7) } else { Ok(()) }
        }
    }

    /// Cycles of 1 s from time 0, each of two steps; commands act `latency` and a half cycle late.
    fn close(fmu: &Integrator, latency: usize, fails: usize) -> (Result<(), Stop>, [f64; 7]) {
        let (time, mut commands) = ([0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0], [0.0; 7]);
        let mut run_data = Run {
            time: &time,
            reals: Inputs { references: &[], values: &[] },
            slopes: None,
            integers: Inputs { references: &[], values: &[] },
            booleans: Inputs { references: &[], values: &[] },
            real_outputs: Outputs { references: &[], values: &mut [] },
            integer_outputs: Outputs { references: &[], values: &mut [] },
            boolean_outputs: Outputs { references: &[], values: &mut [] },
        };
        let feedback = Feedback {
            controller: Count { fails },
            measured: &[8],
            command: &[4],
            parts: 2,
            switch: 1,
            latency,
            commands: &mut commands,
        };
        (run(fmu, &mut run_data, &mut Closed::new(feedback)), commands)
    }

    #[test]
    fn a_command_acts_as_late_as_it_should_and_is_held() {
        let fmu = Integrator::default();
        let (stop, commands) = close(&fmu, 0, 9);
        assert_eq!(stop, Ok(()));
        assert_eq!(commands[..6], [0.0, 1.0, 1.0, 2.0, 2.0, 3.0]);
        let expected = ["get [8]", "step 0 0.5", "set [4] [1.0]", "step 0.5 0.5", "get [8]"];
        assert_eq!(fmu.calls.borrow()[..5], expected);
        assert_eq!(fmu.sum.borrow()[0], 0.5 * (1.0 + 1.0 + 2.0 + 2.0 + 3.0));
        let (_, late) = close(&Integrator::default(), 2, 9);
        assert_eq!(late[..6], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn a_controller_that_gives_up_ends_the_run() {
        let (stop, _) = close(&Integrator::default(), 0, 1);
        assert_eq!(stop, Err(Stop { row: 2, function: Function::Controller, status: 7 }));
    }
}
