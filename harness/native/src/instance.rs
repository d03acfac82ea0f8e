//! The class `Instance`: an instance of an FMU whose functions Python calls one by one, with variables by name.
#![allow(unsafe_code)]

use std::collections::HashSet;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use host::c_abi::Called;
use host::description::{Type, Value};
use host::fmu::{self, Interface};
use pyo3::buffer::PyBuffer;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::fmu::{Fmu, FmuError, FmuWarning, Given, error};
use crate::run::{Run, Stop, Table};
use crate::schedule::bytes;

/// An FMI instance together with the loaded FMU that it uses. The order of the fields is the order in which they are
/// dropped: the instance is freed before its library is unloaded.
pub struct Held {
    pub instance: fmu::Instance<'static>,
    /// Time derivatives of inputs for the next step: value references, and values per second.
    slopes: (Vec<u32>, Vec<f64>),
    _fmu: Arc<fmu::Fmu>,
}

// SAFETY: a mutex ensures that one thread at a time calls the instance, as FMI requires. The host sets its thread-local
// state again in each call.
unsafe impl Send for Held {}

impl Held {
    fn new(fmu: Arc<fmu::Fmu>) -> Called<Held> {
        // SAFETY: the FMU does not move within its Arc, and it is dropped after the instance.
        let borrowed: &'static fmu::Fmu = unsafe { &*Arc::as_ptr(&fmu) };
        let instance = borrowed.instantiate("hubslosh")?;
        Ok(Held { instance, slopes: Default::default(), _fmu: fmu })
    }
}

/// An instance of an FMU. If several threads call it, a call waits until the previous call has ended.
#[pyclass(frozen, module = "hubslosh")]
pub struct Instance {
    pub fmu: Py<Fmu>,
    held: Mutex<Option<Held>>,
    /// Number of the thread that is now in a call of this instance (see [`this_thread`]), or 0.
    caller: AtomicUsize,
}

/// Returns a number other than 0 that identifies the present thread.
fn this_thread() -> usize {
    thread_local!(static PLACE: u8 = const { 0 });
    PLACE.with(|place| std::ptr::from_ref(place).addr())
}

impl Instance {
    /// Runs `calls` on the instance without holding Python's lock, and then passes the FMU's warnings on to Python.
    ///
    /// # Errors
    ///
    /// If `calls` fails, if the instance is closed, or if this thread is already within a call of the instance, for example in a
    /// controller that a run calls.
    pub fn with<T: Send>(
        &self,
        py: Python,
        calls: impl FnOnce(&mut Held) -> PyResult<T> + Send,
    ) -> PyResult<T> {
        let (result, warnings) = py.detach(|| {
            self.with_exclusive_access(|held| {
                let held = held.as_mut().ok_or(FmuError::new_err("the instance is closed"))?;
                let result = calls(held);
                Ok((result, held.instance.take_warnings()))
            })
        })?;
        let kind = py.get_type::<FmuWarning>();
        for text in warnings {
            let text = std::ffi::CString::new(text).unwrap_or_default();
            PyErr::warn(py, &kind, &text, 3)?;
        }
        result
    }

    fn with_exclusive_access<T>(
        &self,
        calls: impl FnOnce(&mut Option<Held>) -> PyResult<T>,
    ) -> PyResult<T> {
        if self.caller.load(Ordering::Relaxed) == this_thread() {
            return Err(FmuError::new_err(
                "the instance cannot be closed while one of its calls is running; wait for the end of the call",
            ));
        }
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        self.caller.store(this_thread(), Ordering::Relaxed);
        let result = calls(&mut held);
        self.caller.store(0, Ordering::Relaxed);
        result
    }

    fn call<T: Send>(
        &self,
        py: Python,
        calls: impl FnOnce(&mut Held) -> Called<T> + Send,
    ) -> PyResult<T> {
        self.with(py, |held| calls(held).map_err(error))
    }
}

#[pymethods]
impl Instance {
    /// Create an instance of `fmu` for Model Exchange (`exchange` true) or for Co-Simulation.
    #[new]
    fn new(py: Python, fmu: Py<Fmu>, exchange: bool) -> PyResult<Instance> {
        let interface = if exchange { Interface::ModelExchange } else { Interface::CoSimulation };
        let of = fmu.get();
        let held = py.detach(|| Held::new(of.load(interface)?).map_err(error))?;
        Ok(Instance { fmu, held: Mutex::new(Some(held)), caller: AtomicUsize::new(0) })
    }

    /// Free the instance; a call that another thread is making ends first.
    fn close(&self, py: Python) -> PyResult<()> {
        py.detach(|| {
            self.with_exclusive_access(|held| {
                *held = None;
                Ok(())
            })
        })
    }

    /// Set the variable `name` to a value of its type.
    fn set(&self, py: Python, name: &str, value: Given) -> PyResult<()> {
        let variable = self.fmu.get().variable(name)?;
        let value = match (value, variable.kind()) {
            (Given::Real(x), Type::Real) => Value::Real(x),
            (Given::Integer(n), Type::Integer | Type::Enumeration) => Value::Integer(n),
            (Given::Boolean(is), Type::Boolean) => Value::Boolean(is),
            (Given::String(text), Type::String) => Value::String(text),
            (_, kind) => {
                return Err(PyValueError::new_err(format!(
                    "{name} cannot be set, because it is of type {kind:?}"
                )));
            }
        };
        self.call(py, |held| held.instance.set_value(variable, value))
    }

    /// Return the values of numeric variables as floats; a Boolean is 0 or 1.
    fn get(&self, py: Python, names: Vec<String>) -> PyResult<Vec<f64>> {
        let fmu = self.fmu.get();
        let all = names.iter().map(|name| fmu.variable(name)).collect::<PyResult<Vec<_>>>()?;
        self.call(py, |held| {
            all.into_iter().map(|variable| Ok(held.instance.value(variable)?.number())).collect()
        })
    }

    /// Enter initialization mode with the relative tolerance of the solver, the start time and the stop time (s).
    fn initialize(
        &self,
        py: Python,
        tolerance: Option<f64>,
        start: f64,
        stop: Option<f64>,
    ) -> PyResult<()> {
        self.call(py, |held| held.instance.enter_initialization_mode(tolerance, start, stop))
    }

    /// Leave initialization mode, so that steps can follow.
    fn start(&self, py: Python) -> PyResult<()> {
        self.call(py, |held| held.instance.exit_initialization_mode())
    }

    /// Set the time derivative of a Real input during the next step, in its unit per second.
    fn set_slope(&self, py: Python, name: &str, slope: f64) -> PyResult<()> {
        let reference = self.fmu.get().variable(name)?.reference;
        self.call(py, |held| {
            held.slopes.0.push(reference);
            held.slopes.1.push(slope);
            Ok(())
        })
    }

    /// Make one communication step of `step` seconds from `time` (s).
    fn step(&self, py: Python, time: f64, step: f64) -> PyResult<()> {
        self.call(py, |held| {
            let (references, slopes) = std::mem::take(&mut held.slopes);
            if references.is_empty() {
                return held.instance.do_step(time, step);
            }
            let mut values = vec![0.0; references.len()];
            held.instance.get_real(&references, &mut values)?;
            held.instance.do_step_along(time, step, &references, &values, &slopes)
        })
    }

    /// Simulate a run with a communication point at each row, and record `outputs` in each row.
    ///
    /// - `rows`: times of the rows, s, and None or one byte for each row. A byte 0 means that the outputs of this row
    ///   are not read, but copied from the row before.
    /// - `inputs`, `outputs`: a list of names, and a table of floats with one column for each name, also for Booleans
    ///   and enumerations.
    /// - `slopes`: derivatives of the inputs after each row, or None.
    /// - `feedback`: object of the Python class `Feedback`, whose controller acts during the run, or None.
    ///
    /// Return None if the run reached its end. Otherwise return the row in which the FMU stopped, the number of
    /// recorded rows, and a sentence with the reason.
    fn run(
        &self,
        py: Python,
        rows: (PyBuffer<f64>, Option<Vec<u8>>),
        inputs: Table,
        slopes: Option<&Bound<PyAny>>,
        outputs: Table,
        feedback: Option<&Bound<PyAny>>,
    ) -> PyResult<Option<Stop>> {
        let fmu = self.fmu.get();
        let rows = (rows.0.to_vec(py)?, rows.1);
        let mut run = Run::new(fmu, rows, &inputs, slopes, &outputs, feedback)?;
        self.with(py, |held| run.make(&mut held.instance))
    }

    /// Return the saved state of the instance as bytes.
    fn save(&self, py: Python) -> PyResult<Vec<u8>> {
        self.call(py, |held| {
            let state = held.instance.get_state()?;
            let bytes = held.instance.serialize(&state);
            held.instance.free_state(state)?;
            bytes
        })
    }

    /// Restore a state that `save` returned, also in another instance of the FMU.
    fn restore(&self, py: Python, bytes: &[u8]) -> PyResult<()> {
        self.call(py, |held| {
            let state = held.instance.deserialize(bytes)?;
            let set = held.instance.set_state(&state);
            held.instance.free_state(state)?;
            set
        })
    }

    /// Initialise the instance in Model Exchange, and return derivatives as the bytes of 64-bit floats: the
    /// derivatives of all `unknowns` with respect to the first of `knowns`, then with respect to the second one, and
    /// so on. Both arguments are lists of value references.
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        unknowns: Vec<u32>,
        knowns: Vec<u32>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let columns = self.with(py, |held| {
            let instance = &mut held.instance;
            instance.enter_initialization_mode(None, 0.0, None).map_err(error)?;
            instance.exit_initialization_mode().map_err(error)?;
            loop {
                let updated = instance.update_discrete_states().map_err(error)?;
                if updated.terminate {
                    return Err(FmuError::new_err("the FMU ends the simulation at its start"));
                }
                if !updated.again {
                    break;
                }
            }
            instance.enter_continuous_time_mode().map_err(error)?;
            let known = &self.fmu.get().effective;
            let mut effective = known.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let columns = jacobian(instance, &unknowns, &knowns, &mut effective).map_err(error)?;
            *known.lock().unwrap_or_else(PoisonError::into_inner) = effective;
            Ok(columns)
        })?;
        Ok(bytes(py, &columns))
    }
}

/// Returns the derivatives of all `unknowns` with respect to the first of `knowns`, then with respect to the second
/// one, and so on.
///
/// Most knowns have no effect, because most states of a small craft belong to tanks that it does not have.
/// `effective` has the value references of the knowns that had an effect in the last Jacobian of this FMU, and is
/// updated. All other knowns are first changed together: if no unknown changes, their derivatives are 0 and need no
/// further calls.
fn jacobian(
    instance: &mut fmu::Instance,
    unknowns: &[u32],
    knowns: &[u32],
    effective: &mut HashSet<u32>,
) -> Called<Vec<f64>> {
    const BLOCK: usize = 8;
    let mut moves = |places: &[usize]| -> Called<bool> {
        let block: Vec<u32> = places.iter().map(|i| knowns[*i]).collect();
        // Each known has another weight in this direction, so that the effects of two knowns with opposite effects do not cancel.
        let direction: Vec<f64> = (1..=block.len()).map(|n| (n as f64).sqrt()).collect();
        let all = instance.directional_derivative(unknowns, &block, &direction)?;
        Ok(all.iter().any(|x| *x != 0.0))
    };
    let (mut single, rest): (Vec<usize>, Vec<usize>) =
        (0..knowns.len()).partition(|i| effective.contains(&knowns[*i]));
    if !rest.is_empty() && moves(&rest)? {
        for block in rest.chunks(BLOCK) {
            if moves(block)? {
                single.extend(block);
            }
        }
    }
    let width = unknowns.len();
    let mut columns = vec![0.0; knowns.len() * width];
    for i in single {
        let column = instance.directional_derivative(unknowns, &[knowns[i]], &[1.0])?;
        match column.iter().any(|x| *x != 0.0) {
            true => effective.insert(knowns[i]),
            false => effective.remove(&knowns[i]),
        };
        columns[i * width..][..width].copy_from_slice(&column);
    }
    Ok(columns)
}
