//! The C interface: what a host hands over, and the FMU's functions behind safe methods.
//!
//! The only unsafe code of this crate is here, because the host speaks C: it gives addresses of
//! functions and of arrays, whose types and lengths can only be taken on trust. What can be seen of
//! them (NULL, lengths that overflow) is checked before the first call.
#![allow(unsafe_code)]

use std::ffi::{c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard};
use std::thread::{self, ThreadId};

use crate::feedback::{Closed, Controller, Feedback, Linear, Open};
use crate::instance::{DISCARD, ERROR, Function, Instance, OK, WARNING};
use crate::run::{self, Inputs, Outputs, Run, Stop};

type Set<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *const T) -> c_int;
type Get<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *mut T) -> c_int;
type SetDerivatives =
    unsafe extern "C" fn(*mut c_void, *const u32, usize, *const c_int, *const f64) -> c_int;
type DoStep = unsafe extern "C" fn(*mut c_void, f64, f64, c_int) -> c_int;

type Set3<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *const T, usize) -> c_int;
type Get3<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *mut T, usize) -> c_int;
type DoStep3 =
    unsafe extern "C" fn(*mut c_void, f64, f64, u8, *mut u8, *mut u8, *mut u8, *mut f64) -> c_int;

/// Handle of an FMI 2.0 instance in Step Mode, and the addresses of its FMU's functions.
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

/// An instance of FMI 3.0 between two steps, made without event mode and early return, and the functions of its FMU.
#[repr(C)]
pub struct CInstance3 {
    /// `fmi3Instance`.
    pub component: *mut c_void,
    /// fmi3SetFloat64
    pub set_float64: Set3<f64>,
    /// fmi3SetInt32
    pub set_int32: Set3<c_int>,
    /// fmi3SetInt64
    pub set_int64: Set3<i64>,
    /// fmi3SetBoolean
    pub set_boolean: Set3<u8>,
    /// fmi3DoStep
    pub do_step: DoStep3,
    /// fmi3GetFloat64
    pub get_float64: Get3<f64>,
    /// fmi3GetInt32
    pub get_int32: Get3<c_int>,
    /// fmi3GetInt64
    pub get_int64: Get3<i64>,
    /// fmi3GetBoolean
    pub get_boolean: Get3<u8>,
    /// How many enumerations the FMU has: what is passed as Int64.
    pub enumerations: usize,
    /// Their value references, rising.
    pub enumeration_references: *const u32,
    /// The instance's environment.
    pub step: *mut CStep,
}

/// What a step of FMI 3.0 is made with, and what it said: the environment with which the instance was made if its
/// intermediateUpdate is [`hubslosh_batch_intermediate_update`]. Between [`hubslosh_batch_begin_step`] and
/// [`hubslosh_batch_end_step`] it stays where it is.
#[repr(C)]
pub struct CStep {
    /// `fmi3Instance`.
    pub component: *mut c_void,
    /// fmi3SetFloat64
    pub set_float64: Set3<f64>,
    /// How many inputs the FMU takes within a step; the arrays have as many places.
    pub taken: usize,
    /// Their value references, rising.
    pub taken_references: *const u32,
    /// How many of them go in lines through the step.
    pub count: usize,
    /// Which.
    pub references: *mut u32,
    /// Their values at `start`.
    pub values: *mut f64,
    /// Their slopes, per s.
    pub slopes: *mut f64,
    /// Room for their values at a point of the step.
    pub at: *mut f64,
    /// Where the step begins, s.
    pub start: f64,
    /// The worst status of fmi3SetFloat64 within the step.
    pub status: c_int,
    /// eventHandlingNeeded
    pub event: u8,
    /// terminateSimulation
    pub terminate: u8,
    /// earlyReturn
    pub early_return: u8,
    /// lastSuccessfulTime, s
    pub reached: f64,
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
pub const VERSION: c_int = 4;

/// The version of this interface.
#[unsafe(no_mangle)]
pub extern "C" fn hubslosh_batch_version() -> c_int {
    VERSION
}

/// The steps that are being made, each with the thread that makes it.
///
/// An FMU may hand back any pointer. intermediateUpdate looks the pointer up here and never follows it.
static STEPPING: Mutex<Vec<(ThreadId, usize)>> = Mutex::new(Vec::new());

fn stepping() -> MutexGuard<'static, Vec<(ThreadId, usize)>> {
    STEPPING.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Says that fmi3DoStep is called next, on this thread, with this step as the environment of its instance. A host that calls
/// fmi3DoStep itself calls this function before, and [`hubslosh_batch_end_step`] after it.
#[unsafe(no_mangle)]
pub extern "C" fn hubslosh_batch_begin_step(step: *mut CStep) {
    stepping().push((thread::current().id(), step as usize));
}

/// Says that fmi3DoStep has returned.
#[unsafe(no_mangle)]
pub extern "C" fn hubslosh_batch_end_step(step: *mut CStep) {
    stepping().retain(|(_, other)| *other != step as usize);
}

/// The callback intermediateUpdate of an instance of FMI 3.0: sets the inputs that go in lines to where they are at
/// `time`, s; asks for no early return. If no step that is being made has this environment, the step of this thread is
/// meant.
///
/// # Safety
/// The two answers must be NULL or writable, and the arrays of a step between [`hubslosh_batch_begin_step`] and
/// [`hubslosh_batch_end_step`] must have the lengths that it says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hubslosh_batch_intermediate_update(
    environment: *mut c_void,
    time: f64,
    set_requested: u8,
    _get_allowed: u8,
    _step_finished: u8,
    _can_return_early: u8,
    early_return_requested: *mut u8,
    early_return_time: *mut f64,
) {
    // SAFETY: as this function demands. The instance's step looks at the structure before and after fmi3DoStep alone.
    unsafe {
        if let Some(asked) = early_return_requested.as_mut() {
            *asked = 0;
        }
        if let Some(when) = early_return_time.as_mut() {
            *when = time;
        }
        let step = {
            let (all, thread) = (stepping(), thread::current().id());
            let meant = all.iter().find(|(_, step)| *step == environment as usize);
            meant.or_else(|| all.iter().rev().find(|(of, _)| *of == thread)).map(|(_, step)| *step)
        };
        let Some(step) = step.and_then(|step| (step as *mut CStep).as_mut()) else { return };
        if set_requested == 0 || step.count == 0 {
            return;
        }
        for i in 0..step.count {
            let (value, slope) = (*step.values.add(i), *step.slopes.add(i));
            *step.at.add(i) = value + slope * (time - step.start);
        }
        let (component, n) = (step.component, step.count);
        let status = (step.set_float64)(component, step.references, n, step.at, n);
        step.status = step.status.max(status);
    }
}

/// Drives an instance through a run; see [`run::run`] for the order of calls. Returns [`DONE`],
/// [`STOPPED`] or [`BAD_ARGUMENTS`].
///
/// # Safety
/// `instance` must be, for `fmi` = 2, a [`CInstance`] with an instance for Co-Simulation in the state stepComplete and the
/// functions of its binary; for `fmi` = 3 a [`CInstance3`] in step mode, whose arrays have the lengths they say. The
/// arrays of `run` must have the lengths they say; `stop` must be
/// writable. No other thread may use the instance meanwhile.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hubslosh_batch_run(
    fmi: c_int,
    instance: *const c_void,
    run: *const CRun,
    stop: *mut Stop,
) -> c_int {
    // A panic must not unwind into the host.
    catch_unwind(AssertUnwindSafe(|| {
        // SAFETY: as this function demands; NULL becomes None.
        let (run, stop) = unsafe { (run.as_ref(), stop.as_mut()) };
        let (Some(run), Some(stop)) = (run, stop) else { return BAD_ARGUMENTS };
        // SAFETY: as this function demands.
        let Some(mut run) = (unsafe { run.slices() }) else { return BAD_ARGUMENTS };
        // SAFETY: as this function demands.
        let Some(caller) = (unsafe { caller(fmi, instance, &run) }) else { return BAD_ARGUMENTS };
        answer(run::run(&*caller, &mut run, &mut Open), stop)
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
    fmi: c_int,
    instance: *const c_void,
    run: *const CRun,
    feedback: *const CFeedback,
    stop: *mut Stop,
) -> c_int {
    catch_unwind(AssertUnwindSafe(|| {
        // SAFETY: as this function demands; NULL becomes None.
        let (run, c, stop) = unsafe { (run.as_ref(), feedback.as_ref(), stop.as_mut()) };
        let (Some(run), Some(c), Some(stop)) = (run, c, stop) else { return BAD_ARGUMENTS };
        // SAFETY: as this function demands.
        let Some(mut run) = (unsafe { run.slices() }) else { return BAD_ARGUMENTS };
        // SAFETY: as this function demands.
        let Some(caller) = (unsafe { caller(fmi, instance, &run) }) else { return BAD_ARGUMENTS };
        let rows = c.cycles.checked_mul(c.parts).and_then(|steps| steps.checked_add(1));
        if rows != Some(run.time.len()) || c.switch >= c.parts {
            return BAD_ARGUMENTS;
        }
        // SAFETY: as this function demands.
        let result = match c.law {
            Some(law) => unsafe { c.feedback(CLaw(law)) }
                .map(|feedback| run::run(&*caller, &mut run, &mut Closed::new(feedback))),
            None => unsafe { c.linear().and_then(|controller| c.feedback(controller)) }
                .map(|feedback| run::run(&*caller, &mut run, &mut Closed::new(feedback))),
        };
        result.map_or(BAD_ARGUMENTS, |result| answer(result, stop))
    }))
    .unwrap_or(BAD_ARGUMENTS)
}

/// Converts the end of a run into the C interface's return code.
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

/// The instance of a version of FMI whose functions are called through their addresses; None if it cannot be one.
///
/// # Safety
/// As [`hubslosh_batch_run`].
unsafe fn caller<'a>(
    fmi: c_int,
    instance: *const c_void,
    run: &Run,
) -> Option<Box<dyn Instance + 'a>> {
    // SAFETY: as this function demands; NULL becomes None.
    unsafe {
        match fmi {
            2 => Some(Box::new(Caller::new(instance.cast::<CInstance>().as_ref()?, run))),
            3 => {
                let instance = instance.cast::<CInstance3>().as_ref()?;
                let step = instance.step.as_ref()?;
                Some(Box::new(Caller3 {
                    instance,
                    enumerations: slice(instance.enumeration_references, instance.enumerations)?,
                    taken: slice(step.taken_references, step.taken)?,
                }))
            }
            _ => None,
        }
    }
}

/// An instance of FMI 2.0.
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

    fn set_slopes(&self, references: &[u32], _: &[f64], slopes: &[f64]) -> c_int {
        let CInstance { component, set_real_input_derivatives, .. } = *self.instance;
        let orders = self.first_order.as_ptr();
        unsafe {
            let (first, count) = (references.as_ptr(), references.len());
            set_real_input_derivatives(component, first, count, orders, slopes.as_ptr())
        }
    }

    fn do_step(&self, time: f64, step: f64) -> (Function, c_int) {
        // 1: the past is not asked for again
        let status = unsafe { (self.instance.do_step)(self.instance.component, time, step, 1) };
        (Function::DoStep, status)
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

/// An instance of FMI 3.0.
struct Caller3<'a> {
    instance: &'a CInstance3,
    /// Value references of the enumerations, rising.
    enumerations: &'a [u32],
    /// Of the inputs that the FMU takes within a step, rising.
    taken: &'a [u32],
}

impl Caller3<'_> {
    /// Calls for one variable after the other until one fails, with the larger of the status.
    fn each(references: &[u32], mut call: impl FnMut(usize, &u32) -> c_int) -> c_int {
        let mut worst = OK;
        for (i, reference) in references.iter().enumerate() {
            worst = worst.max(call(i, reference));
            if worst > WARNING {
                break;
            }
        }
        worst
    }

    fn is_enumeration(&self, reference: &u32) -> bool {
        self.enumerations.binary_search(reference).is_ok()
    }
}

// SAFETY of all methods: as for `Caller`; every array has the length that is passed, and those of the step as many places
// as inputs are taken.
impl Instance for Caller3<'_> {
    fn set_real(&self, references: &[u32], values: &[f64]) -> c_int {
        let CInstance3 { component, set_float64, .. } = *self.instance;
        let n = references.len();
        unsafe { set_float64(component, references.as_ptr(), n, values.as_ptr(), values.len()) }
    }

    fn set_integer(&self, references: &[u32], values: &[c_int]) -> c_int {
        let CInstance3 { component, set_int32, set_int64, .. } = *self.instance;
        Self::each(references, |i, reference| match self.is_enumeration(reference) {
            true => unsafe { set_int64(component, reference, 1, &i64::from(values[i]), 1) },
            false => unsafe { set_int32(component, reference, 1, &values[i], 1) },
        })
    }

    fn set_boolean(&self, references: &[u32], values: &[c_int]) -> c_int {
        let CInstance3 { component, set_boolean, .. } = *self.instance;
        Self::each(references, |i, reference| {
            let byte = u8::from(values[i] != 0);
            unsafe { set_boolean(component, reference, 1, &byte, 1) }
        })
    }

    fn set_slopes(&self, references: &[u32], values: &[f64], slopes: &[f64]) -> c_int {
        // The FMU calls back within fmi3DoStep alone.
        let step = unsafe { &mut *self.instance.step };
        step.count = 0;
        for ((reference, value), slope) in references.iter().zip(values).zip(slopes) {
            // Each is there once, so that there are places for all; the others hold.
            if self.taken.binary_search(reference).is_ok() && step.count < step.taken {
                unsafe {
                    *step.references.add(step.count) = *reference;
                    *step.values.add(step.count) = *value;
                    *step.slopes.add(step.count) = *slope;
                }
                step.count += 1;
            }
        }
        OK
    }

    fn do_step(&self, time: f64, step: f64) -> (Function, c_int) {
        let CInstance3 { component, do_step, step: within, .. } = *self.instance;
        // No reference to the structure lives while the FMU calls back.
        let status = unsafe {
            (*within).start = time;
            (*within).status = OK;
            ((*within).terminate, (*within).early_return) = (0, 0);
            // without inputs in lines intermediateUpdate has nothing to do
            let lines = (*within).count > 0;
            if lines {
                hubslosh_batch_begin_step(within);
            }
            let status = do_step(
                component,
                time,
                step,
                1,
                &raw mut (*within).event,
                &raw mut (*within).terminate,
                &raw mut (*within).early_return,
                &raw mut (*within).reached,
            );
            if lines {
                hubslosh_batch_end_step(within);
            }
            status
        };
        let within = unsafe { &mut *within };
        within.count = 0;
        match status {
            OK | WARNING if within.status > WARNING => {
                (Function::SetRealInputDerivatives, within.status)
            }
            // as FMI 2.0 says it: the step was not made to its end
            OK | WARNING if within.terminate != 0 => (Function::DoStep, DISCARD),
            // it was not allowed to
            OK | WARNING if within.early_return != 0 => (Function::DoStep, ERROR),
            status => (Function::DoStep, status),
        }
    }

    fn get_real(&self, references: &[u32], values: &mut [f64]) -> c_int {
        let CInstance3 { component, get_float64, .. } = *self.instance;
        let (n, m) = (references.len(), values.len());
        unsafe { get_float64(component, references.as_ptr(), n, values.as_mut_ptr(), m) }
    }

    fn get_integer(&self, references: &[u32], values: &mut [c_int]) -> c_int {
        let CInstance3 { component, get_int32, get_int64, .. } = *self.instance;
        Self::each(references, |i, reference| match self.is_enumeration(reference) {
            true => {
                let mut wide = 0;
                let status = unsafe { get_int64(component, reference, 1, &mut wide, 1) };
                // An item beyond 32 bits has no place in a row of FMI 2.0's integers.
                values[i] = c_int::try_from(wide).unwrap_or(c_int::MAX);
                status
            }
            false => unsafe { get_int32(component, reference, 1, &mut values[i], 1) },
        })
    }

    fn get_boolean(&self, references: &[u32], values: &mut [c_int]) -> c_int {
        let CInstance3 { component, get_boolean, .. } = *self.instance;
        Self::each(references, |i, reference| {
            let mut byte = 0;
            let status = unsafe { get_boolean(component, reference, 1, &mut byte, 1) };
            values[i] = c_int::from(byte != 0);
            status
        })
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::ptr::{null, null_mut};

    use super::*;

    thread_local! {
        static SET: Cell<f64> = const { Cell::new(0.0) };
    }

    extern "C" fn set(
        _: *mut c_void,
        _: *const u32,
        _: usize,
        values: *const f64,
        _: usize,
    ) -> c_int {
        // SAFETY: one value, by `update` below.
        SET.set(unsafe { *values });
        OK
    }

    /// intermediateUpdate at 0.5 s of a step from 0 s whose input has the value 1 and the slope 2 per s.
    fn update(environment: impl Fn(*mut CStep) -> *mut c_void) -> f64 {
        let (mut reference, mut value, mut slope, mut at) = (7, 1.0, 2.0, 0.0);
        let mut step = CStep {
            component: null_mut(),
            set_float64: set,
            taken: 1,
            taken_references: null(),
            count: 1,
            references: &mut reference,
            values: &mut value,
            slopes: &mut slope,
            at: &mut at,
            start: 0.0,
            status: OK,
            event: 0,
            terminate: 0,
            early_return: 0,
            reached: 0.0,
        };
        let step = &raw mut step;
        SET.set(f64::NAN);
        hubslosh_batch_begin_step(step);
        // SAFETY: the step lives, its arrays have one place each; NULL takes no answer.
        unsafe {
            hubslosh_batch_intermediate_update(
                environment(step),
                0.5,
                1,
                0,
                0,
                0,
                null_mut(),
                null_mut(),
            );
        }
        hubslosh_batch_end_step(step);
        SET.get()
    }

    #[test]
    fn intermediate_update_never_follows_the_pointer_that_an_fmu_hands_back() {
        assert_eq!(update(|step| step.cast()), 2.0);
        for foreign in [0usize, 1, 0x10] {
            assert_eq!(update(|_| foreign as *mut c_void), 2.0, "{foreign}");
        }
        SET.set(f64::NAN);
        // SAFETY: no step is being made.
        unsafe {
            hubslosh_batch_intermediate_update(
                8 as *mut c_void,
                0.5,
                1,
                0,
                0,
                0,
                null_mut(),
                null_mut(),
            );
        }
        assert!(SET.get().is_nan());
    }
}
