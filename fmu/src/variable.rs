//! What a variable of the FMU is: the words [`crate::table`] is written in.

use crate::calls::CType;
use plant::{Calculated, Inputs, MODES, Outputs, Parameters, Ramp, STATES};

/// The value of one scalar, as it crosses the C interface. Enumerations are
/// integers there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// fmi2Real
    Real(f64),
    /// fmi2Integer
    Integer(i32),
    /// fmi2Boolean
    Boolean(bool),
}

/// The role of a variable, as FMI names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Set by the host, at any time.
    Input,
    /// Meant to be connected or plotted.
    Output,
    /// For looking inside.
    Local,
    /// Set by the host before the end of the initialization mode.
    Parameter,
    /// Follows from the parameters.
    CalculatedParameter,
}

/// A real quantity. Units are names of [`crate::table::UNITS`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// SI; "" where it is another one in every slosh model.
    pub unit: &'static str,
    /// What people read instead.
    pub display_unit: Option<&'static str>,
    /// Smallest value allowed.
    pub min: Option<f64>,
    /// Largest value allowed.
    pub max: Option<f64>,
    /// Order of magnitude.
    pub nominal: Option<f64>,
}

/// An item of an enumeration; the first has the number 1.
#[derive(Debug)]
pub struct Item {
    /// Its name.
    pub name: &'static str,
    /// What it means.
    pub description: &'static str,
}

/// An enumeration type.
#[derive(Debug)]
pub struct Enumeration {
    /// The type's name.
    pub name: &'static str,
    /// What it chooses.
    pub description: &'static str,
    /// Its items.
    pub items: &'static [Item],
}

/// A variable's type.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// A quantity with a unit.
    Real(Quantity),
    /// A number of something.
    Integer {
        /// Smallest value allowed.
        min: Option<i32>,
        /// Largest value allowed.
        max: Option<i32>,
    },
    /// Yes or no.
    Boolean,
    /// One of several named things.
    Enumeration(&'static Enumeration),
}

/// A place among the plant's continuous states, or among their derivatives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// This one.
    Of(usize),
    /// This one of the four coordinates of each slosh mode.
    PerMode(usize),
}

impl Place {
    /// The place of a family's member, 0 for the first.
    pub const fn at(self, element: usize) -> usize {
        match self {
            Place::Of(place) => place,
            Place::PerMode(coordinate) => STATES - 4 * MODES + 4 * element + coordinate,
        }
    }
}

/// Where a variable lives in the plant.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub enum Access {
    Input(fn(&mut Inputs) -> &mut Ramp),
    ShownReal(fn(&Outputs) -> f64),
    ShownInteger(fn(&Outputs) -> i32),
    ShownBoolean(fn(&Outputs) -> bool),
    Real(fn(&mut Parameters) -> &mut f64),
    Boolean(fn(&mut Parameters) -> &mut bool),
    Integer(fn(&mut Parameters) -> &mut i32),
    /// A parameter that the plant does not keep as a plain i32.
    Number {
        get: fn(&Parameters) -> i32,
        set: fn(&mut Parameters, i32),
    },
    Calculated(fn(&Calculated) -> f64),
    CalculatedPerMode(fn(&Calculated) -> &[f64; MODES]),
    /// A continuous state that is not among the outputs.
    State,
    /// The derivative of a continuous state.
    Rate(Place),
}

/// A variable, or a family of variables with one number per slosh mode.
#[derive(Clone, Copy, Debug)]
pub struct Variable {
    /// Its name; a family's members are called name`[1]`, name`[2]`, …
    pub name: &'static str,
    /// What it is, with sign and frame.
    pub description: &'static str,
    /// Its role.
    pub causality: Causality,
    /// Its type.
    pub kind: Kind,
    /// Where it lives.
    pub access: Access,
    /// Its place, if it is a continuous state.
    pub state: Option<Place>,
    /// Whether an event can make this state jump.
    pub reinit: bool,
    /// Whether this parameter can be set while the simulation runs.
    pub tunable: bool,
    /// The inputs and continuous states it follows without delay: a name as it is, the
    /// name of a family for all members, or with "[]" for the member of the same mode.
    pub depends_on: &'static [&'static str],
    /// The parameters and inputs that its value at the start follows from besides; a
    /// name that ends with a dot stands for all parameters that begin like that.
    pub starts_from: &'static [&'static str],
}

const fn variable(
    name: &'static str,
    causality: Causality,
    kind: Kind,
    access: Access,
    description: &'static str,
) -> Variable {
    Variable {
        name,
        description,
        causality,
        kind,
        access,
        state: None,
        reinit: false,
        tunable: false,
        depends_on: &[],
        starts_from: &[],
    }
}

const fn quantity(unit: &'static str) -> Kind {
    Kind::Real(Quantity { unit, display_unit: None, min: None, max: None, nominal: None })
}

pub(crate) const fn input(
    name: &'static str,
    ramp: fn(&mut Inputs) -> &mut Ramp,
    unit: &'static str,
    description: &'static str,
) -> Variable {
    variable(name, Causality::Input, quantity(unit), Access::Input(ramp), description)
}

pub(crate) const fn output(
    name: &'static str,
    get: fn(&Outputs) -> f64,
    unit: &'static str,
    description: &'static str,
) -> Variable {
    variable(name, Causality::Output, quantity(unit), Access::ShownReal(get), description)
}

pub(crate) const fn local(
    name: &'static str,
    get: fn(&Outputs) -> f64,
    unit: &'static str,
    description: &'static str,
) -> Variable {
    variable(name, Causality::Local, quantity(unit), Access::ShownReal(get), description)
}

/// One of the four coordinates of each slosh mode.
pub(crate) const fn coordinate(
    name: &'static str,
    coordinate: usize,
    description: &'static str,
) -> Variable {
    let variable = variable(name, Causality::Local, quantity(""), Access::State, description);
    Variable { state: Some(Place::PerMode(coordinate)), ..variable }
}

/// The derivative of a continuous state; its name is "der(" the state's name ")".
pub(crate) const fn rate(
    name: &'static str,
    of: Place,
    unit: &'static str,
    description: &'static str,
) -> Variable {
    variable(name, Causality::Local, quantity(unit), Access::Rate(of), description)
}

pub(crate) const fn local_flag(
    name: &'static str,
    get: fn(&Outputs) -> bool,
    description: &'static str,
) -> Variable {
    variable(name, Causality::Local, Kind::Boolean, Access::ShownBoolean(get), description)
}

pub(crate) const fn local_integer(
    name: &'static str,
    get: fn(&Outputs) -> i32,
    description: &'static str,
) -> Variable {
    let kind = Kind::Integer { min: None, max: None };
    variable(name, Causality::Local, kind, Access::ShownInteger(get), description)
}

pub(crate) const fn local_choice(
    name: &'static str,
    of: &'static Enumeration,
    get: fn(&Outputs) -> i32,
    description: &'static str,
) -> Variable {
    let kind = Kind::Enumeration(of);
    variable(name, Causality::Local, kind, Access::ShownInteger(get), description)
}

pub(crate) const fn parameter(
    name: &'static str,
    field: fn(&mut Parameters) -> &mut f64,
    unit: &'static str,
    description: &'static str,
) -> Variable {
    variable(name, Causality::Parameter, quantity(unit), Access::Real(field), description)
}

pub(crate) const fn switch(
    name: &'static str,
    field: fn(&mut Parameters) -> &mut bool,
    description: &'static str,
) -> Variable {
    variable(name, Causality::Parameter, Kind::Boolean, Access::Boolean(field), description)
}

pub(crate) const fn integer(
    name: &'static str,
    field: fn(&mut Parameters) -> &mut i32,
    description: &'static str,
) -> Variable {
    let kind = Kind::Integer { min: None, max: None };
    variable(name, Causality::Parameter, kind, Access::Integer(field), description)
}

pub(crate) const fn count(
    name: &'static str,
    min: i32,
    max: i32,
    get: fn(&Parameters) -> i32,
    set: fn(&mut Parameters, i32),
    description: &'static str,
) -> Variable {
    let kind = Kind::Integer { min: Some(min), max: Some(max) };
    variable(name, Causality::Parameter, kind, Access::Number { get, set }, description)
}

pub(crate) const fn choice(
    name: &'static str,
    of: &'static Enumeration,
    get: fn(&Parameters) -> i32,
    set: fn(&mut Parameters, i32),
    description: &'static str,
) -> Variable {
    let kind = Kind::Enumeration(of);
    variable(name, Causality::Parameter, kind, Access::Number { get, set }, description)
}

pub(crate) const fn calculated(
    name: &'static str,
    get: fn(&Calculated) -> f64,
    unit: &'static str,
    description: &'static str,
) -> Variable {
    let access = Access::Calculated(get);
    variable(name, Causality::CalculatedParameter, quantity(unit), access, description)
}

pub(crate) const fn calculated_per_mode(
    name: &'static str,
    get: fn(&Calculated) -> &[f64; MODES],
    unit: &'static str,
    description: &'static str,
) -> Variable {
    let access = Access::CalculatedPerMode(get);
    variable(name, Causality::CalculatedParameter, quantity(unit), access, description)
}

impl Variable {
    /// People read it in this unit.
    pub(crate) const fn shown_in(mut self, unit: &'static str) -> Variable {
        if let Kind::Real(quantity) = &mut self.kind {
            quantity.display_unit = Some(unit);
        }
        self
    }

    /// Allowed are `min` to `max`.
    pub(crate) const fn range(mut self, min: f64, max: f64) -> Variable {
        if let Kind::Real(quantity) = &mut self.kind {
            quantity.min = Some(min);
            quantity.max = Some(max);
        }
        self
    }

    /// Allowed is `min` and more.
    pub(crate) const fn at_least(mut self, min: f64) -> Variable {
        if let Kind::Real(quantity) = &mut self.kind {
            quantity.min = Some(min);
        }
        self
    }

    /// Its order of magnitude.
    pub(crate) const fn about(mut self, nominal: f64) -> Variable {
        if let Kind::Real(quantity) = &mut self.kind {
            quantity.nominal = Some(nominal);
        }
        self
    }

    /// It is the plant's continuous state at this place.
    pub(crate) const fn state(mut self, place: usize) -> Variable {
        self.state = Some(Place::Of(place));
        self
    }

    /// An event can make this state jump.
    pub(crate) const fn reinit(mut self) -> Variable {
        self.reinit = true;
        self
    }

    /// It can be set while the simulation runs.
    pub(crate) const fn tunable(mut self) -> Variable {
        self.tunable = true;
        self
    }

    /// It follows these inputs and states without delay.
    pub(crate) const fn follows(mut self, inputs: &'static [&'static str]) -> Variable {
        self.depends_on = inputs;
        self
    }

    /// Its first value follows from these parameters and inputs besides.
    pub(crate) const fn from(mut self, parameters: &'static [&'static str]) -> Variable {
        self.starts_from = parameters;
        self
    }

    /// How many scalars it is.
    pub const fn len(&self) -> usize {
        match self.access {
            Access::CalculatedPerMode(_) | Access::Rate(Place::PerMode(_)) => MODES,
            Access::State => MODES,
            _ => 1,
        }
    }

    /// No variable is.
    pub const fn is_empty(&self) -> bool {
        false
    }

    /// Its value before the host sets anything: `None` when it is computed.
    pub fn start(&self) -> Option<Value> {
        match self.access {
            Access::Input(ramp) => Some(Value::Real(ramp(&mut Inputs::default()).value)),
            _ => self.parameter(&Parameters::default()),
        }
    }

    /// Its value in `parameters`: `None` when it is not a parameter.
    pub fn parameter(&self, parameters: &Parameters) -> Option<Value> {
        // The accessors that lend the field mutably serve reading as well.
        let mut copy = *parameters;
        match self.access {
            Access::Real(field) => Some(Value::Real(*field(&mut copy))),
            Access::Boolean(field) => Some(Value::Boolean(*field(&mut copy))),
            Access::Integer(field) => Some(Value::Integer(*field(&mut copy))),
            Access::Number { get, .. } => Some(Value::Integer(get(parameters))),
            _ => None,
        }
    }

    /// Puts a value of its own type into `parameters`.
    pub fn set_parameter(&self, parameters: &mut Parameters, value: Value) {
        match (self.access, value) {
            (Access::Real(field), Value::Real(x)) => *field(parameters) = x,
            (Access::Boolean(field), Value::Boolean(x)) => *field(parameters) = x,
            (Access::Integer(field), Value::Integer(x)) => *field(parameters) = x,
            (Access::Number { set, .. }, Value::Integer(x)) => set(parameters, x),
            _ => {}
        }
    }

    /// Its value among what the plant shows: `None` when it is not there.
    pub fn shown(&self, outputs: &Outputs) -> Option<Value> {
        match self.access {
            Access::ShownReal(get) => Some(Value::Real(get(outputs))),
            Access::ShownInteger(get) => Some(Value::Integer(get(outputs))),
            Access::ShownBoolean(get) => Some(Value::Boolean(get(outputs))),
            _ => None,
        }
    }

    /// The value of a family's member (0 for the first) among what the plant
    /// calculates: `None` when it is not there.
    pub fn calculated(&self, calculated: &Calculated, element: usize) -> Option<Value> {
        match self.access {
            Access::Calculated(get) => Some(Value::Real(get(calculated))),
            Access::CalculatedPerMode(get) => get(calculated).get(element).map(|x| Value::Real(*x)),
            _ => None,
        }
    }

    /// The smallest value of a quantity that has one.
    pub const fn min(&self) -> Option<f64> {
        match self.kind {
            Kind::Real(quantity) => quantity.min,
            _ => None,
        }
    }

    /// The order of magnitude of a quantity; 1 if nothing else is said.
    pub const fn nominal(&self) -> f64 {
        match self.kind {
            Kind::Real(Quantity { nominal: Some(nominal), .. }) => nominal,
            _ => 1.0,
        }
    }

    /// The C type it is got and set with.
    #[inline]
    pub const fn c_type(&self) -> CType {
        match self.kind {
            Kind::Real(_) => CType::Real,
            Kind::Integer { .. } | Kind::Enumeration(_) => CType::Integer,
            Kind::Boolean => CType::Boolean,
        }
    }

    /// What is wrong with `value`, in words: `name = value unit (allowed: …)`.
    #[inline]
    pub fn problem(&self, value: Value) -> Option<String> {
        if self.allows(value) { None } else { Some(self.refusal(value)) }
    }

    fn allows(&self, value: Value) -> bool {
        match (&self.kind, value) {
            (Kind::Real(Quantity { min, max, .. }), Value::Real(x)) => {
                x.is_finite() && min.is_none_or(|m| x >= m) && max.is_none_or(|m| x <= m)
            }
            (Kind::Integer { min, max }, Value::Integer(n)) => {
                min.is_none_or(|m| n >= m) && max.is_none_or(|m| n <= m)
            }
            (Kind::Enumeration(of), Value::Integer(n)) => {
                usize::try_from(n).is_ok_and(|n| (1..=of.items.len()).contains(&n))
            }
            (Kind::Boolean, Value::Boolean(_)) => true,
            _ => false,
        }
    }

    #[cold]
    fn refusal(&self, value: Value) -> String {
        match value {
            Value::Real(x) => {
                format!("{} = {} (allowed: {})", self.name, self.with_unit(x), self.allowed())
            }
            Value::Integer(n) => format!("{} = {n} (allowed: {})", self.name, self.allowed()),
            Value::Boolean(b) => format!("{} = {b} (allowed: {})", self.name, self.allowed()),
        }
    }

    /// The range in words.
    fn allowed(&self) -> String {
        match self.kind {
            Kind::Real(Quantity { min, max, .. }) => match (min, max) {
                (Some(min), Some(max)) => {
                    format!("{} to {}", self.with_unit(min), self.with_unit(max))
                }
                (Some(min), None) => format!("at least {}, finite", self.with_unit(min)),
                (None, Some(max)) => format!("at most {}, finite", self.with_unit(max)),
                (None, None) => "any finite number".into(),
            },
            Kind::Integer { min, max } => match (min, max) {
                (Some(min), Some(max)) => format!("{min} to {max}"),
                (Some(min), None) => format!("at least {min}"),
                (None, Some(max)) => format!("at most {max}"),
                (None, None) => "any integer".into(),
            },
            Kind::Enumeration(of) => {
                let items: Vec<_> = of
                    .items
                    .iter()
                    .zip(1..)
                    .map(|(item, n)| format!("{n} {}", item.name))
                    .collect();
                items.join(", ")
            }
            Kind::Boolean => "true, false".into(),
        }
    }

    fn with_unit(&self, x: f64) -> String {
        match self.kind {
            Kind::Real(Quantity { unit, .. }) if !["", "1"].contains(&unit) => {
                format!("{x:?} {unit}")
            }
            _ => format!("{x:?}"),
        }
    }
}
