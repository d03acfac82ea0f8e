//! The C interface: what a host hands over, and the FMU's functions behind safe methods.
//!
//! The only unsafe code of this crate is here, because the host speaks C: it gives addresses of
//! functions and of arrays, whose types and lengths can only be taken on trust. What can be seen of
//! them (NULL, lengths that overflow) is checked before the first call.
#![allow(unsafe_code)]

use std::ffi::{c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::feedback::{Closed, Controller, Feedback, Linear, Open};
use crate::instance::Instance;
use crate::run::{self, Inputs, Outputs, Run, Stop};

type Set<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *const T) -> c_int;
type Get<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *mut T) -> c_int;
type SetDerivatives =
    unsafe extern "C" fn(*mut c_void, *const u32, usize, *const c_int, *const f64) -> c_int;
type DoStep = unsafe extern "C" fn(*mut c_void, f64, f64, c_int) -> c_int;

/// An instance between two steps, and the functions of its FMU.
#[repr(C)]
pub struct CInstance {
    /// `fmi2Component`.
    pub component: *mut c_void,
    /// fmi2SetReal
    pub set_real: Set<f64>,
    /// fmi2SetInteger
    pub set_integer: Set<c_int>,
    /// fmi2SetBoolean
    pub set_boolean: Set<c_int>,
    /// fmi2SetRealInputDerivatives
    pub set_real_input_derivatives: SetDerivatives,
    /// fmi2DoStep
    pub do_step: DoStep,
    /// fmi2GetReal
    pub get_real: Get<f64>,
    /// fmi2GetInteger
    pub get_integer: Get<c_int>,
    /// fmi2GetBoolean
    pub get_boolean: Get<c_int>,
}

/// Variables of one type: `rows` × `count` values, row after row.
#[repr(C)]
pub struct CSignals<T> {
    /// How many; 0: none, and the pointers may be NULL.
    pub count: usize,
    /// Their value references.
    pub references: *const u32,
    /// Their values; of outputs, the place for them.
    pub values: *mut T,
}

/// [`Run`] with pointers.
#[repr(C)]
pub struct CRun {
    /// Communication points.
    pub rows: usize,
    /// Their times, s.
    pub time: *const f64,
    /// Inputs.
    pub reals: CSignals<f64>,
    /// As many as values of `reals`, or NULL: the inputs are held.
    pub slopes: *const f64,
    /// Inputs.
    pub integers: CSignals<c_int>,
    /// Inputs.
    pub booleans: CSignals<c_int>,
    /// Outputs.
    pub real_outputs: CSignals<f64>,
    /// Outputs.
    pub integer_outputs: CSignals<c_int>,
    /// Outputs.
    pub boolean_outputs: CSignals<c_int>,
}

/// A controller outside of this library: cycle from 0, time in s, what is measured, place for the
/// commands. Anything but 0 ends the run.
pub type Law = unsafe extern "C" fn(usize, f64, *const f64, *mut f64) -> c_int;

/// [`Feedback`] with pointers, and its controller: `law`, or if that is NULL, [`Linear`]. The run has
/// `cycles` · `parts` + 1 rows.
#[repr(C)]
pub struct CFeedback {
    /// Cycles of the controller.
    pub cycles: usize,
    /// See [`Feedback`].
    pub parts: usize,
    /// See [`Feedback`].
    pub switch: usize,
    /// See [`Feedback`].
    pub latency: usize,
    /// How many variables are measured.
    pub measured: usize,
    /// Their value references.
    pub measured_references: *const u32,
    /// How many inputs are commanded.
    pub commanded: usize,
    /// Their value references.
    pub command_references: *const u32,
    /// Place for rows × commanded values: the commands in force.
    pub commands: *mut f64,
    /// The controller, if it is not linear.
    pub law: Option<Law>,
    /// States of the linear controller.
    pub states: usize,
    /// states × states
    pub a: *const f64,
    /// states × measured
    pub b: *const f64,
    /// commanded × states
    pub c: *const f64,
    /// commanded × measured
    pub d: *const f64,
    /// cycles × measured
    pub reference: *const f64,
    /// cycles × commanded
    pub feedforward: *const f64,
    /// Four places among the measured, or NULL.
    pub quaternion: *const usize,
}

/// Answer of [`hubslosh_batch_run`]: every row is done.
pub const DONE: c_int = 0;
/// A call failed; `stop` says which.
pub const STOPPED: c_int = 1;
/// The arguments cannot be right; no function of the FMU was called.
pub const BAD_ARGUMENTS: c_int = 2;

/// Version of this interface; another one has other structures.
pub const VERSION: c_int = 2;

/// The version of this interface.
#[unsafe(no_mangle)]
pub extern "C" fn hubslosh_batch_version() -> c_int {
    VERSION
}

/// Drives an instance through a run; see [`run::run`] for the order of calls. Returns [`DONE`],
/// [`STOPPED`] or [`BAD_ARGUMENTS`].
///
/// # Safety
/// `instance` must hold an instance of FMI 2.0 for Co-Simulation in the state stepComplete and the
/// functions of its binary; the arrays of `run` must have the lengths they say; `stop` must be
/// writable. No other thread may use the instance meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hubslosh_batch_run(
    instance: *const CInstance,
    run: *const CRun,
    stop: *mut Stop,
) -> c_int {
    // A panic must not unwind into the host.
    catch_unwind(AssertUnwindSafe(|| {
        // SAFETY: as this function demands; NULL becomes None.
        let (instance, run, stop) = unsafe { (instance.as_ref(), run.as_ref(), stop.as_mut()) };
        let (Some(instance), Some(run), Some(stop)) = (instance, run, stop) else {
            return BAD_ARGUMENTS;
        };
        // SAFETY: as this function demands.
        let Some(mut run) = (unsafe { run.slices() }) else { return BAD_ARGUMENTS };
        let caller = Caller::new(instance, &run);
        answer(run::run(&caller, &mut run, &mut Open), stop)
    }))
    .unwrap_or(BAD_ARGUMENTS)
}

/// As [`hubslosh_batch_run`], with a controller that sets inputs which `run` does not have; see
/// [`crate::feedback`].
///
/// # Safety
/// As there; the arrays of `feedback` must have the lengths they say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hubslosh_batch_loop(
    instance: *const CInstance,
    run: *const CRun,
    feedback: *const CFeedback,
    stop: *mut Stop,
) -> c_int {
    catch_unwind(AssertUnwindSafe(|| {
        // SAFETY: as this function demands; NULL becomes None.
        let (instance, run, c, stop) =
            unsafe { (instance.as_ref(), run.as_ref(), feedback.as_ref(), stop.as_mut()) };
        let (Some(instance), Some(run), Some(c), Some(stop)) = (instance, run, c, stop) else {
            return BAD_ARGUMENTS;
        };
        // SAFETY: as this function demands.
        let Some(mut run) = (unsafe { run.slices() }) else { return BAD_ARGUMENTS };
        let caller = Caller::new(instance, &run);
        let rows = c.cycles.checked_mul(c.parts).and_then(|steps| steps.checked_add(1));
        if rows != Some(run.time.len()) || c.switch >= c.parts {
            return BAD_ARGUMENTS;
        }
        // SAFETY: as this function demands.
        let result = match c.law {
            Some(law) => unsafe { c.feedback(CLaw(law)) }
                .map(|feedback| run::run(&caller, &mut run, &mut Closed::new(feedback))),
            None => unsafe { c.linear().and_then(|controller| c.feedback(controller)) }
                .map(|feedback| run::run(&caller, &mut run, &mut Closed::new(feedback))),
        };
        result.map_or(BAD_ARGUMENTS, |result| answer(result, stop))
    }))
    .unwrap_or(BAD_ARGUMENTS)
}

/// What C is told of a run's end.
fn answer(result: Result<(), Stop>, stop: &mut Stop) -> c_int {
    match result {
        Ok(()) => DONE,
        Err(why) => {
            *stop = why;
            STOPPED
        }
    }
}

/// A controller in the host's language.
struct CLaw(Law);

impl Controller for CLaw {
    fn command(
        &mut self,
        cycle: usize,
        time: f64,
        measured: &[f64],
        command: &mut [f64],
    ) -> Result<(), c_int> {
        // SAFETY: the host vouches for its function (`hubslosh_batch_loop`).
        match unsafe { (self.0)(cycle, time, measured.as_ptr(), command.as_mut_ptr()) } {
            0 => Ok(()),
            why => Err(why),
        }
    }
}

impl CFeedback {
    /// # Safety
    /// The arrays must have the lengths they say, and nobody else looks at `commands` meanwhile.
    unsafe fn feedback<'a, C>(&self, controller: C) -> Option<Feedback<'a, C>> {
        let rows = self.cycles * self.parts + 1;
        // SAFETY: as this function demands; the checks are those of `slice`.
        unsafe {
            let commands = match slice(self.commands, rows.checked_mul(self.commanded)?)?.len() {
                0 => &mut [],
                length => std::slice::from_raw_parts_mut(self.commands, length),
            };
            Some(Feedback {
                controller,
                measured: slice(self.measured_references, self.measured)?,
                command: slice(self.command_references, self.commanded)?,
                parts: self.parts,
                switch: self.switch,
                latency: self.latency,
                commands,
            })
        }
    }

    /// # Safety
    /// As [`CFeedback::feedback`].
    unsafe fn linear<'a>(&self) -> Option<Linear<'a>> {
        let matrix = |data, rows: usize, columns: usize| {
            // SAFETY: as this function demands.
            unsafe { slice::<f64>(data, rows.checked_mul(columns)?) }
        };
        // SAFETY: as this function demands.
        let quaternion = match self.quaternion.is_null() {
            true => None,
            false => Some(<[usize; 4]>::try_from(unsafe { slice(self.quaternion, 4) }?).ok()?),
        };
        if quaternion.is_some_and(|at| at.iter().any(|i| *i >= self.measured)) {
            return None;
        }
        Some(Linear {
            x: vec![0.0; self.states],
            a: matrix(self.a, self.states, self.states)?,
            b: matrix(self.b, self.states, self.measured)?,
            c: matrix(self.c, self.commanded, self.states)?,
            d: matrix(self.d, self.commanded, self.measured)?,
            reference: matrix(self.reference, self.cycles, self.measured)?,
            feedforward: matrix(self.feedforward, self.cycles, self.commanded)?,
            quaternion,
            error: vec![0.0; self.measured],
            next: vec![0.0; self.states],
        })
    }
}

/// A slice of C, or None where it cannot be one.
///
/// # Safety
/// If `data` is not NULL, `length` values must be there.
unsafe fn slice<'a, T>(data: *const T, length: usize) -> Option<&'a [T]> {
    let fits = length.checked_mul(size_of::<T>()).is_some_and(|bytes| bytes <= isize::MAX as usize);
    match length {
        0 => Some(&[]),
        // SAFETY: as this function demands.
        _ => (fits && !data.is_null()).then(|| unsafe { std::slice::from_raw_parts(data, length) }),
    }
}

impl<T> CSignals<T> {
    /// # Safety
    /// As [`slice`], `rows` × `count` values.
    unsafe fn inputs<'a>(&self, rows: usize) -> Option<Inputs<'a, T>> {
        // SAFETY: as this function demands.
        unsafe {
            Some(Inputs {
                references: slice(self.references, self.count)?,
                values: slice(self.values, rows.checked_mul(self.count)?)?,
            })
        }
    }

    /// # Safety
    /// As [`CSignals::inputs`], and nobody else looks at the values meanwhile.
    unsafe fn outputs<'a>(&self, rows: usize) -> Option<Outputs<'a, T>> {
        // SAFETY: as this function demands; the checks are those of `slice`.
        unsafe {
            let Inputs { references, values } = self.inputs(rows)?;
            let values = match values.len() {
                0 => &mut [],
                length => std::slice::from_raw_parts_mut(self.values, length),
            };
            Some(Outputs { references, values })
        }
    }
}

impl CRun {
    /// # Safety
    /// The arrays must have the lengths they say.
    unsafe fn slices<'a>(&self) -> Option<Run<'a>> {
        let rows = self.rows;
        // SAFETY: as this function demands.
        unsafe {
            Some(Run {
                time: slice(self.time, rows)?,
                reals: self.reals.inputs(rows)?,
                slopes: match self.slopes.is_null() {
                    true => None,
                    false => Some(slice(self.slopes, rows.checked_mul(self.reals.count)?)?),
                },
                integers: self.integers.inputs(rows)?,
                booleans: self.booleans.inputs(rows)?,
                real_outputs: self.real_outputs.outputs(rows)?,
                integer_outputs: self.integer_outputs.outputs(rows)?,
                boolean_outputs: self.boolean_outputs.outputs(rows)?,
            })
        }
    }
}

/// An instance whose functions are called through their addresses.
struct Caller<'a> {
    instance: &'a CInstance,
    /// A 1 for each Real input: the order of the derivatives.
    first_order: Vec<c_int>,
}

impl<'a> Caller<'a> {
    fn new(instance: &'a CInstance, run: &Run) -> Self {
        Caller { instance, first_order: vec![1; run.reals.references.len()] }
    }
}

// SAFETY of all methods: the host vouches for instance and functions (`hubslosh_batch_run`); every
// slice comes with its own length, and `first_order` has one entry for each Real input.
impl Instance for Caller<'_> {
    fn set_real(&self, references: &[u32], values: &[f64]) -> c_int {
        let CInstance { component, set_real, .. } = *self.instance;
        unsafe { set_real(component, references.as_ptr(), references.len(), values.as_ptr()) }
    }

    fn set_integer(&self, references: &[u32], values: &[c_int]) -> c_int {
        let CInstance { component, set_integer, .. } = *self.instance;
        unsafe { set_integer(component, references.as_ptr(), references.len(), values.as_ptr()) }
    }

    fn set_boolean(&self, references: &[u32], values: &[c_int]) -> c_int {
        let CInstance { component, set_boolean, .. } = *self.instance;
        unsafe { set_boolean(component, references.as_ptr(), references.len(), values.as_ptr()) }
    }

    fn set_slopes(&self, references: &[u32], slopes: &[f64]) -> c_int {
        let CInstance { component, set_real_input_derivatives, .. } = *self.instance;
        let orders = self.first_order.as_ptr();
        unsafe {
            let (first, count) = (references.as_ptr(), references.len());
            set_real_input_derivatives(component, first, count, orders, slopes.as_ptr())
        }
    }

    fn do_step(&self, time: f64, step: f64) -> c_int {
        // 1: the past is not asked for again
        unsafe { (self.instance.do_step)(self.instance.component, time, step, 1) }
    }

    fn get_real(&self, references: &[u32], values: &mut [f64]) -> c_int {
        let CInstance { component, get_real, .. } = *self.instance;
        unsafe { get_real(component, references.as_ptr(), references.len(), values.as_mut_ptr()) }
    }

    fn get_integer(&self, references: &[u32], values: &mut [c_int]) -> c_int {
        let CInstance { component, get_integer, .. } = *self.instance;
        unsafe {
            get_integer(component, references.as_ptr(), references.len(), values.as_mut_ptr())
        }
    }

    fn get_boolean(&self, references: &[u32], values: &mut [c_int]) -> c_int {
        let CInstance { component, get_boolean, .. } = *self.instance;
        unsafe {
            get_boolean(component, references.as_ptr(), references.len(), values.as_mut_ptr())
        }
    }
}
