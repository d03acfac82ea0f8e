//! The classes `Fmu` and `Variable` of the compiled half.

use std::collections::{BTreeMap, HashSet};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use ::files::input;
use host::archive::{Archive, DESCRIPTION};
use host::description::{self, BaseUnit, ModelDescription, Type, Value};
use host::fmu::Interface;
use host::parameter_set::{Parameter, Unit};
use host::part::{self, Limit, START_VALUES};
use pyo3::IntoPyObjectExt;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyUserWarning};
use pyo3::prelude::*;
use pyo3::types::PyFloat;

/// Definition of a unit: exponents of the SI base units, factor and offset.
pub type Base = ([i32; 8], f64, f64);

create_exception!(
    hubslosh,
    FmuError,
    PyException,
    "Error in the arguments of a call, of an FMU or of the program ``hubslosh``.

The message says what is wrong, where, and what is allowed; an FMU's own message is part of it.

Examples
--------
>>> import hubslosh
>>> hubslosh.simulate(parameters={'tank.h': -1}, stop=1)
Traceback (most recent call last):
hubslosh.FmuError: fmi2ExitInitializationMode returned fmi2Error: tank.h = -1.0 m (allowed: 0.0001 m to 100.0 m)
"
);
create_exception!(
    hubslosh,
    FmuWarning,
    PyUserWarning,
    "Warning of an FMU or of the program ``hubslosh``, such as parameters outside the range of its model.

Examples
--------
Make warnings errors:

>>> import warnings
>>> import hubslosh
>>> with warnings.catch_warnings():
...     warnings.simplefilter('error', hubslosh.FmuWarning)
...     run = hubslosh.simulate(stop=1)
"
);

/// Converts an error of the host to the Python exception FmuError.
pub fn error(why: impl Into<anyhow::Error>) -> PyErr {
    FmuError::new_err(input::without_error_numbers(&format!("{:#}", why.into())))
}

/// Converts a value to a Python object.
pub fn object(py: Python, value: Value) -> PyResult<Py<PyAny>> {
    match value {
        Value::Real(value) => value.into_py_any(py),
        Value::Integer(value) => value.into_py_any(py),
        Value::Boolean(value) => value.into_py_any(py),
        Value::String(value) => value.into_py_any(py),
    }
}

/// A value from Python.
pub enum Given {
    Boolean(bool),
    Integer(i64),
    Real(f64),
    String(String),
}

impl<'a, 'py> FromPyObject<'a, 'py> for Given {
    type Error = PyErr;

    fn extract(value: Borrowed<'a, 'py, PyAny>) -> PyResult<Given> {
        // Most values are floats. To try the other types first would take longer than to set the value.
        if let Ok(x) = value.cast::<PyFloat>() {
            return Ok(Given::Real(x.value()));
        }
        let integer = || value.extract().map(Given::Integer);
        let real = |_| value.extract().map(Given::Real);
        let text = |_| value.extract().map(Given::String);
        value.extract().map(Given::Boolean).or_else(|_| integer()).or_else(real).or_else(text)
    }
}

impl Given {
    /// Returns the value in the form that a variable of this type expects, if it can be converted; for example, 2.0
    /// becomes 2 for an Integer.
    pub fn for_type(self, kind: Type) -> Value {
        match self {
            Given::Boolean(is) if kind == Type::Real => Value::Real(is.into()),
            Given::Boolean(is) if kind != Type::Boolean => Value::Integer(is.into()),
            Given::Boolean(is) => Value::Boolean(is),
            Given::Integer(n) if kind == Type::Real => Value::Real(n as f64),
            Given::Integer(n) => Value::Integer(n),
            Given::Real(x) if kind != Type::Real && x.fract() == 0.0 && x.abs() < 1e15 => {
                Value::Integer(x as i64)
            }
            Given::Real(x) => Value::Real(x),
            Given::String(text) => Value::String(text),
        }
    }
}

#[pyclass(frozen, get_all, module = "hubslosh")]
pub struct Variable {
    name: String,
    reference: u32,
    /// Type of the variable: "Real", "Integer", "Boolean", "String", "Enumeration", "Binary" or "Clock".
    kind: String,
    causality: String,
    variability: String,
    start: Option<String>,
    /// Unit of the values in the FMU's interface; empty if the variable has none.
    unit: String,
    /// Display units of the variable, each with its name, factor and offset: displayed value =
    /// factor · value + offset.
    shown: Vec<(String, f64, f64)>,
    /// Definition of the unit by SI base units (exponents, factor, offset), if the FMU has one.
    base: Option<Base>,
    /// Items of an enumeration, each with its name and number.
    items: Vec<(String, i64)>,
    /// True if the variable is one element of an array.
    is_element: bool,
}

impl Variable {
    fn describe(description: &ModelDescription, variable: &description::Variable) -> Variable {
        let unit = description.unit(variable);
        let defined = description.units.iter().find(|defined| defined.name == unit);
        let shown = description.display_units(variable).iter();
        let items = description.items(variable).iter();
        Variable {
            name: variable.name.clone(),
            reference: variable.reference,
            kind: format!("{:?}", variable.kind()),
            causality: variable.causality.to_string(),
            variability: variable.variability.to_string(),
            start: variable.attributes().start.clone(),
            unit: unit.into(),
            shown: shown.map(|unit| (unit.name.clone(), unit.factor, unit.offset)).collect(),
            base: defined
                .and_then(|unit| unit.base)
                .map(|base| (base.exponents, base.factor, base.offset)),
            items: items.map(|item| (item.name.clone(), item.value)).collect(),
            is_element: description.element(variable.reference).is_some(),
        }
    }
}

/// A packed FMU. Its binary is loaded when the first instance of an interface is created.
#[pyclass(frozen, module = "hubslosh")]
pub struct Fmu {
    path: PathBuf,
    description: ModelDescription,
    /// Position of each variable in the description, by its name.
    places: BTreeMap<String, usize>,
    /// The FMU loaded for Co-Simulation and for Model Exchange.
    loaded: [Mutex<Option<Arc<host::fmu::Fmu>>>; 2],
    /// Value references of the states and inputs that had an effect in the last Jacobian.
    pub effective: Mutex<HashSet<u32>>,
}

impl Fmu {
    /// Returns the FMU with its binary loaded for an interface. The binary is loaded at the first call only.
    pub fn load(&self, interface: Interface) -> PyResult<Arc<host::fmu::Fmu>> {
        let place = &self.loaded[usize::from(interface == Interface::ModelExchange)];
        let mut place = place.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(loaded) = &*place {
            return Ok(loaded.clone());
        }
        let loaded = host::fmu::Fmu::open_for(interface, &self.path, &[]).map_err(error)?;
        Ok(place.insert(Arc::new(loaded)).clone())
    }

    pub fn description(&self) -> &ModelDescription {
        &self.description
    }

    /// Returns true if the FMU has a variable with this name.
    pub fn has(&self, name: &str) -> bool {
        self.places.contains_key(name)
    }

    pub fn variable(&self, name: &str) -> PyResult<&description::Variable> {
        match self.places.get(name) {
            Some(place) => Ok(&self.description.variables[*place]),
            None => self.description.variable(name).map_err(error),
        }
    }
}

#[pymethods]
impl Fmu {
    /// Read the model description of a packed FMU. Nothing is unpacked, and no binary is loaded.
    #[new]
    fn new(py: Python, path: PathBuf) -> PyResult<Fmu> {
        let description = py.detach(|| ModelDescription::from_fmu(&path)).map_err(error)?;
        let names = description.variables.iter().map(|variable| variable.name.clone());
        let places = names.zip(0..).collect();
        Ok(Fmu {
            path,
            description,
            places,
            loaded: Default::default(),
            effective: Default::default(),
        })
    }

    /// Name of the model in the description.
    #[getter]
    fn name(&self) -> &str {
        &self.description.model_name
    }

    /// True if the FMU is of FMI 3.0, false if it is of FMI 2.0.
    #[getter]
    fn is_fmi3(&self) -> bool {
        self.description.is_fmi3()
    }

    /// All variables in the order of the model description.
    #[getter]
    fn variables(&self) -> Vec<Variable> {
        let all = self.description.variables.iter();
        all.map(|variable| Variable::describe(&self.description, variable)).collect()
    }

    /// Start time, stop time and step size of the default experiment, s; None if the FMU does not suggest one.
    #[getter]
    fn experiment(&self) -> [Option<f64>; 3] {
        let of = &self.description.default_experiment;
        [of.start_time, of.stop_time, of.step_size]
    }

    /// True if the FMU provides directional derivatives in Model Exchange.
    #[getter]
    fn differentiates(&self) -> bool {
        self.description.model_exchange.as_ref().is_some_and(|of| of.directional_derivatives)
    }

    /// Value references of the derivatives of the continuous states, each with the value reference of its state.
    #[getter]
    fn derivatives(&self) -> Vec<(u32, u32)> {
        self.description.derivatives.clone()
    }

    /// Convert `value` to the type and the unit of the variable `name`, as `Instance.set` expects it. `unit` is the
    /// name of the value's unit; None means the variable's unit. `base` defines this unit by SI base units, so that a
    /// unit that the FMU does not list can be used.
    #[pyo3(signature = (name, value, unit=None, base=None))]
    fn convert(
        &self,
        py: Python,
        name: &str,
        value: Given,
        unit: Option<String>,
        base: Option<Base>,
    ) -> PyResult<Py<PyAny>> {
        let variable = self.variable(name)?;
        let value = value.for_type(variable.kind());
        let base = base.map(|(exponents, factor, offset)| BaseUnit { exponents, factor, offset });
        let unit = unit.map(|name| Unit { name, base });
        let text = Parameter::new(name, value, unit).text(&self.description).map_err(error)?;
        match self.description.value(variable, &text).map_err(error)? {
            Value::Real(x) if !x.is_finite() => {
                Err(FmuError::new_err(format!("{name} expects a finite number, not {x}")))
            }
            value => object(py, value),
        }
    }

    /// Return the files of a reduced copy of this Spacecraft FMU, each as its name in the archive and its text: the model
    /// description with only `tanks` tanks, `modes` modes and `appendages` modes of appendages, and the file of start values.
    /// `starts` are pairs of a name and a start value that differs from the FMU's own.
    fn part(
        &self,
        tanks: usize,
        modes: usize,
        appendages: usize,
        starts: Vec<(String, String)>,
    ) -> PyResult<Vec<(&'static str, String)>> {
        let limits = names::spacecraft::SIZES.iter().map(|size| Limit {
            parameter: size.parameter,
            size: match size.parameter {
                "tanks" => tanks,
                "appendages" => appendages,
                _ => modes,
            },
            most: size.most,
            has_indicators: size.has_indicators,
            arrays: size.arrays,
        });
        let starts = part::start_values(&self.description, starts).map_err(error)?;
        let xml = Archive::open(&self.path).and_then(|archive| archive.description());
        let limits: Vec<_> = limits.collect();
        let part = part::describe(&xml.map_err(error)?, &limits, &starts).map_err(error)?;
        let start_values = part.start_values.map(|text| (START_VALUES, text));
        Ok([(DESCRIPTION, part.xml)].into_iter().chain(start_values).collect())
    }

    /// Unload all binaries that no instance uses, and remove their temporary folders.
    fn close(&self) {
        for place in &self.loaded {
            *place.lock().unwrap_or_else(PoisonError::into_inner) = None;
        }
    }
}
