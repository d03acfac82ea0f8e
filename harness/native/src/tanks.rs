//! Modal parameters of tanks for Python, for many fills at a time.
//!
//! Worker threads compute without Python's lock, while the calling thread waits and notices Ctrl-C.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use hubslosh_tank::parameters::{self, ParameterSet, Target, Value};
use hubslosh_tank::tank::Geometry;
use hubslosh_tank::{Fill, ModalData, Problems, fill_table, finite_amplitude, picture};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::fmu::FmuError;

/// Time between two checks whether the user has pressed Ctrl-C, while the threads compute.
const CTRL_C_INTERVAL: Duration = Duration::from_millis(100);

/// A tank, read from a file or from a text.
#[pyclass(frozen, module = "hubslosh")]
pub struct Tank {
    tank: hubslosh_tank::Tank,
    /// Path of the tank's file, with which error messages begin; None if the tank was read from a text.
    file: Option<PathBuf>,
}

impl Tank {
    fn error(&self, why: &Problems) -> PyErr {
        error(self.file.as_deref(), why)
    }
}

fn error(file: Option<&Path>, why: impl std::fmt::Display) -> PyErr {
    let prefix = file.map_or(String::new(), |file| format!("{}: ", file.display()));
    FmuError::new_err(format!("{prefix}{why}"))
}

/// Amount of liquid in the forms that Python accepts.
#[derive(FromPyObject)]
pub enum Amount {
    /// Height of the free surface, m.
    Height(f64),
    /// A text with a unit: a share of the volume such as `60%`, or a height.
    Text(String),
    /// A pair of a mass and its unit, such as (120, "kg").
    Mass(f64, String),
}

impl Amount {
    fn fill(&self) -> PyResult<Fill> {
        match self {
            Amount::Height(height) => Ok(Fill::Height(*height)),
            Amount::Text(text) => text
                .parse()
                .map_err(|why: hubslosh_tank::tank::NotAFill| FmuError::new_err(why.to_string())),
            Amount::Mass(mass, unit) if unit == "kg" => Ok(Fill::Mass(*mass)),
            Amount::Mass(_, unit) => {
                Err(FmuError::new_err(format!("a fill is a mass in kg, not in {unit}")))
            }
        }
    }
}

/// Properties of a liquid other than its density, together with the specific force along the tank's axis.
#[pyclass(frozen, module = "hubslosh")]
#[derive(Clone, Copy)]
pub struct Liquid(parameters::Liquid);

#[pymethods]
impl Liquid {
    /// Create the properties: `gravity` in m/s², kinematic viscosity `nu` in m²/s, surface tension `sigma` in N/m, contact angle
    /// in degrees, rate of spin in rad/s.
    #[new]
    fn new(
        gravity: f64,
        nu: Option<f64>,
        sigma: Option<f64>,
        contact_angle: Option<f64>,
        spin: Option<f64>,
    ) -> PyResult<Liquid> {
        let mut problems = Vec::new();
        let given = [("gravity", Some(gravity)), ("nu", nu), ("sigma", sigma)];
        for (name, value) in given.into_iter().filter_map(|(name, of)| Some((name, of?))) {
            if !(value >= 0.0 && value.is_finite()) {
                problems.push(format!("{name} = {value} (allowed: 0 or more, finite)"));
            }
        }
        match contact_angle {
            Some(angle) if !(0.0..=180.0).contains(&angle) => {
                problems.push(format!("contact_angle = {angle} (allowed: 0 to 180 degrees)"));
            }
            Some(_) if sigma.is_none() => {
                problems.push("contact_angle goes with sigma, the surface tension".to_string());
            }
            _ => {}
        }
        if let Some(spin) = spin.filter(|spin| !(*spin > 0.0 && spin.is_finite())) {
            problems.push(format!("spin = {spin} (allowed: above 0 rad/s, finite)"));
        }
        if !problems.is_empty() {
            return Err(FmuError::new_err(problems.join("; ")));
        }
        let contact_angle = contact_angle.unwrap_or(90.0);
        Ok(Liquid(parameters::Liquid { gravity, nu, sigma, contact_angle, spin }))
    }
}

#[pymethods]
impl Tank {
    /// Read a tank from its file.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Tank> {
        match hubslosh_tank::Tank::read(&path) {
            Ok(tank) => Ok(Tank { tank, file: Some(path) }),
            Err(why) => Err(error(Some(&path), why)),
        }
    }

    /// Read a tank from the text of a file; drawings that the text names must have absolute paths.
    #[staticmethod]
    fn parse(text: &str) -> PyResult<Tank> {
        match hubslosh_tank::Tank::parse(text, Path::new("")) {
            Ok(tank) => Ok(Tank { tank, file: None }),
            Err(why) => Err(error(None, why)),
        }
    }

    /// Return the number of modes that Spacecraft uses for this tank if `modes` modes per direction are requested. A box with two
    /// different lengths gets at most three, because its modes are along both lengths.
    fn modes(&self, modes: usize) -> usize {
        match &self.tank.geometry {
            Geometry::Box { length_x, length_y } if length_x != length_y => modes.min(2) + 1,
            _ => modes,
        }
    }

    /// Return the mass of the liquid at a fill, kg.
    fn mass(&self, py: Python, fill: Amount) -> PyResult<f64> {
        let fill = fill.fill()?;
        py.detach(|| self.tank.mass(self.tank.fill_height(fill)?)).map_err(|why| self.error(&why))
    }
}

/// Modal parameters of a tank at one fill.
#[pyclass(frozen, module = "hubslosh")]
pub struct Solved {
    tank: Py<Tank>,
    data: ModalData,
    liquid: Liquid,
}

#[pymethods]
impl Solved {
    /// Return all results as `hubslosh tank --json` prints them.
    fn result<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = serde_json::to_string(&self.data)
            .map_err(|why| PyRuntimeError::new_err(why.to_string()))?;
        py.import("json")?.call_method1("loads", (text,))
    }

    /// Return a drawing of the tank, its free surface and its mode shapes as SVG.
    fn picture(&self, py: Python) -> String {
        let tank = &self.tank.get().tank;
        py.detach(|| picture::tank(tank, &self.data, self.liquid.0.gravity))
    }

    /// Return the warnings about the surface tension.
    fn warnings(&self) -> Vec<String> {
        parameters::surface_tension_warnings(&self.data, self.liquid.0)
    }

    /// Return the tank's parameters for an FMU by name, and warnings. `model` is the name of the FMU.
    fn parameters<'py>(&self, py: Python<'py>, model: &str) -> PyResult<Parameters<'py>> {
        let target = target(model)?;
        let of = self.tank.get();
        let found =
            py.detach(|| ParameterSet::new(&of.tank, &self.data, target, checked(self.liquid)?));
        parameters_to_python(py, found.map_err(|why| of.error(&why))?)
    }
}

pub type Parameters<'py> = (Bound<'py, PyDict>, Vec<String>);

fn target(model: &str) -> PyResult<Target> {
    match model {
        "HubSlosh" => Ok(Target::HubSlosh),
        "SloshTank" => Ok(Target::SloshTank),
        "Spacecraft" => Ok(Target::Spacecraft { tank: 1 }),
        _ => Err(FmuError::new_err(format!("there are no parameters of a tank for {model}"))),
    }
}

fn checked(liquid: Liquid) -> Result<parameters::Liquid, Problems> {
    let gravity = liquid.0.gravity;
    if gravity > 0.0 && gravity < 1e-9 {
        let text = format!(
            "gravity = {gravity:e} m/s² (allowed for parameters of an FMU: 0, or at least 1e-9, because it becomes g_ref)"
        );
        return Err(text.into());
    }
    Ok(liquid.0)
}

fn parameters_to_python(py: Python, set: ParameterSet) -> PyResult<Parameters> {
    if !set.unknown.is_empty() {
        let text = format!("{} (without sigma k is 0)", set.unknown.join("; "));
        return Err(FmuError::new_err(text));
    }
    let found = PyDict::new(py);
    for (name, value) in &set.values {
        match value {
            Value::Real(x) => found.set_item(name, x)?,
            Value::Integer(n) => found.set_item(name, n)?,
            Value::Item(item) => found.set_item(name, item)?,
        }
    }
    Ok((found, set.warnings))
}

/// A tank to solve: the tank, its fill, the number of modes, the liquid, and true for the coefficients of large waves.
pub type Question = (Py<Tank>, Amount, usize, Py<Liquid>, bool);

/// Solve several tanks, each given as a tuple (tank, fill, modes, liquid, large_waves), on all cores. Return for each tuple the
/// result, or the FmuError that it caused.
#[pyfunction]
pub fn solve(py: Python, questions: Vec<Question>) -> PyResult<Vec<Py<PyAny>>> {
    let mut asked = Vec::with_capacity(questions.len());
    for (tank, fill, modes, liquid, large_waves) in questions {
        asked.push((tank, fill.fill(), modes, *liquid.get(), large_waves));
    }
    let questions = Arc::new(asked);
    let theirs = questions.clone();
    let found = compute_in_threads(py, questions.len(), move |i| {
        let (tank, fill, modes, liquid, large_waves) = &theirs[i];
        let (of, fill) = (tank.get(), fill.as_ref().ok()?);
        let mut found = parameters::solve(&of.tank, *fill, *modes, liquid.0);
        if let (Ok(data), true) = (&mut found, large_waves) {
            finite_amplitude::add_large_waves(&of.tank, data);
        }
        Some(found)
    })?;
    found
        .into_iter()
        .zip(&*questions)
        .map(|(found, (tank, fill, _, liquid, _))| match (found, fill) {
            (Some(Ok(data)), _) => {
                let solved = Solved { tank: tank.clone_ref(py), data, liquid: *liquid };
                Ok(Py::new(py, solved)?.into_any())
            }
            (Some(Err(why)), _) => Ok(tank.get().error(&why).into_value(py).into_any()),
            (None, Err(why)) => Ok(why.value(py).clone().unbind().into_any()),
            (None, Ok(_)) => unreachable!("a fill that was read was solved"),
        })
        .collect()
}

/// Return the parameters of a draining tank 1 of Spacecraft (the table of modal parameters over the fill), and warnings.
/// `between` has the two fills at the ends of the table.
#[pyfunction]
pub fn table<'py>(
    py: Python<'py>,
    tank: Py<Tank>,
    between: (Amount, Amount),
    modes: usize,
    liquid: Py<Liquid>,
) -> PyResult<Parameters<'py>> {
    let (low, high) = (between.0.fill()?, between.1.fill()?);
    let (of, liquid) = (tank.clone_ref(py), *liquid.get());
    let found = compute_in_threads(py, 1, move |_| {
        let tank = &of.get().tank;
        let (low, high) = (tank.fill_height(low)?, tank.fill_height(high)?);
        if low >= high {
            return Err(format!(
                "The lower end of the fill table, {low} m, must be below its upper end, {high} m."
            )
            .into());
        }
        let placed = fill_table::place(tank, low, high, modes)?;
        let between = Some(&placed.between);
        let target = Target::Spacecraft { tank: 1 };
        fill_table::parameters(tank, &placed.sweep, between, target, checked(liquid)?)
    })?;
    let set = found.into_iter().next().expect("one question has one answer");
    parameters_to_python(py, set.map_err(|why: Problems| tank.get().error(&why))?)
}

/// Returns the results of `of(0)` to `of(count - 1)`, computed in parallel by one thread for each core.
///
/// On Ctrl-C the function returns immediately, while the threads complete their computations.
fn compute_in_threads<T: Send + 'static>(
    py: Python,
    count: usize,
    of: impl Fn(usize) -> T + Send + Sync + 'static,
) -> PyResult<Vec<T>> {
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let shared = Arc::new((of, AtomicUsize::new(0), AtomicBool::new(false)));
    let (sender, receiver) = mpsc::channel();
    for _ in 0..cores.min(count) {
        let (shared, sender) = (shared.clone(), sender.clone());
        thread::spawn(move || {
            let (of, next, stop) = &*shared;
            while !stop.load(Ordering::Relaxed) {
                let i = next.fetch_add(1, Ordering::Relaxed);
                if i >= count || sender.send((i, of(i))).is_err() {
                    break;
                }
            }
        });
    }
    drop(sender);
    let mut found: Vec<Option<T>> = (0..count).map(|_| None).collect();
    py.detach(|| -> PyResult<()> {
        let receiver = receiver;
        let mut heard = Instant::now();
        loop {
            match receiver.recv_timeout(CTRL_C_INTERVAL) {
                Ok((i, answer)) => found[i] = Some(answer),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            if heard.elapsed() >= CTRL_C_INTERVAL {
                heard = Instant::now();
                Python::attach(|py| py.check_signals())
                    .inspect_err(|_| shared.2.store(true, Ordering::Relaxed))?;
            }
        }
    })?;
    let lost = || PyRuntimeError::new_err("a thread that computes tanks has ended unexpectedly");
    found.into_iter().map(|answer| answer.ok_or_else(lost)).collect()
}
