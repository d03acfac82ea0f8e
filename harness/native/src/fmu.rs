//! FMUs and their variables.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use ::files::input;
use host::archive::{Archive, DESCRIPTION};
use host::description::{self, ModelDescription};
use host::fmu::Interface;
use host::part::{self, Limit, START_VALUES};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyUserWarning};
use pyo3::prelude::*;

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

#[pyclass(frozen, get_all, module = "hubslosh")]
pub struct Variable {
    name: String,
    reference: u32,
    /// "Real", "Integer", "Boolean", "String", "Enumeration", "Binary" or "Clock".
    kind: String,
    causality: String,
    variability: String,
    start: Option<String>,
    /// Unit in which it is exchanged; empty if it has none.
    unit: String,
    /// Display units: name, factor, offset.
    shown: Vec<(String, f64, f64)>,
    /// Unit by SI base units, if the FMU defines it: exponents, factor, offset.
    base: Option<([i32; 8], f64, f64)>,
    /// Items of an enumeration: name, number.
    items: Vec<(String, i64)>,
    /// An element of an array.
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
    /// Positions in the description by name.
    places: BTreeMap<String, usize>,
    /// The FMU loaded for Co-Simulation and for Model Exchange.
    loaded: [Mutex<Option<Arc<host::fmu::Fmu>>>; 2],
}

impl Fmu {
    /// Returns the FMU with its binary loaded for an interface; it is loaded only once.
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

    /// Returns true if it has a variable of this name.
    pub fn has(&self, name: &str) -> bool {
        self.places.contains_key(name)
    }

    /// Finds a variable by its name.
    pub fn variable(&self, name: &str) -> PyResult<&description::Variable> {
        match self.places.get(name) {
            Some(place) => Ok(&self.description.variables[*place]),
            None => self.description.variable(name).map_err(error),
        }
    }
}

#[pymethods]
impl Fmu {
    /// Read the description of a packed FMU; nothing is unpacked or loaded.
    #[new]
    fn new(py: Python, path: PathBuf) -> PyResult<Fmu> {
        let description = py.detach(|| ModelDescription::from_fmu(&path)).map_err(error)?;
        let names = description.variables.iter().map(|variable| variable.name.clone());
        let places = names.zip(0..).collect();
        Ok(Fmu { path, description, places, loaded: Default::default() })
    }

    /// Name of the model.
    #[getter]
    fn name(&self) -> &str {
        &self.description.model_name
    }

    /// True for FMI 3.0.
    #[getter]
    fn is_fmi3(&self) -> bool {
        self.description.is_fmi3()
    }

    /// All variables.
    #[getter]
    fn variables(&self) -> Vec<Variable> {
        let all = self.description.variables.iter();
        all.map(|variable| Variable::describe(&self.description, variable)).collect()
    }

    /// Start, stop and step that the FMU suggests, s.
    #[getter]
    fn experiment(&self) -> [Option<f64>; 3] {
        let of = &self.description.default_experiment;
        [of.start_time, of.stop_time, of.step_size]
    }

    /// True if the FMU has directional derivatives in Model Exchange.
    #[getter]
    fn differentiates(&self) -> bool {
        self.description.model_exchange.as_ref().is_some_and(|of| of.directional_derivatives)
    }

    /// Value references of the states' derivatives, and of the states.
    #[getter]
    fn derivatives(&self) -> Vec<(u32, u32)> {
        self.description.derivatives.clone()
    }

    /// Return the files of this Spacecraft, by their names in the archive, that change if it has fewer tanks and modes and other
    /// start values, which are texts by name: the description and the start values.
    fn part(
        &self,
        tanks: usize,
        modes: usize,
        starts: Vec<(String, String)>,
    ) -> PyResult<Vec<(&'static str, String)>> {
        let limits = names::spacecraft::SIZES.iter().map(|size| Limit {
            parameter: size.parameter,
            size: if size.parameter == "tanks" { tanks } else { modes },
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

    /// Unload the binaries that no instance uses, and remove their folders.
    fn close(&self) {
        for place in &self.loaded {
            *place.lock().unwrap_or_else(PoisonError::into_inner) = None;
        }
    }
}
