//! Variables of an FMU: the types from which a model's table is built.

use crate::call::CType;
use crate::dynamics::Dynamics;
use crate::number::{is_finite, text};

/// The value of one scalar in the C interface. Enumerations are integers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub enum Value {
    Real(f64),
    Integer(i32),
    Boolean(bool),
}

#[allow(missing_docs)]
impl Value {
    #[inline]
    pub fn real(self) -> Option<f64> {
        match self {
            Self::Real(x) => Some(x),
            _ => None,
        }
    }

    #[inline]
    pub fn integer(self) -> Option<i32> {
        match self {
            Self::Integer(n) => Some(n),
            _ => None,
        }
    }

    #[inline]
    pub fn boolean(self) -> Option<bool> {
        match self {
            Self::Boolean(b) => Some(b),
            _ => None,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Causality {
    Input,
    Output,
    Local,
    Parameter,
    CalculatedParameter,
}

/// Type of a real variable: its unit, and optionally display unit, range and nominal value.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Quantity {
    /// SI unit of the value, for example "N.m", which must be in [`crate::unit::UNITS`]; "" if the unit depends on
    /// parameters.
    pub unit: &'static str,
    pub display_unit: Option<&'static str>,
    pub min: Option<f64>,
    pub max: Option<f64>,
    pub nominal: Option<f64>,
}

/// An item of an enumeration. The first item has the number 1.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct Item {
    pub name: &'static str,
    pub description: &'static str,
}

#[allow(missing_docs)]
impl Item {
    pub const fn new(name: &'static str, description: &'static str) -> Item {
        Item { name, description }
    }

    pub const fn list<const N: usize>(rows: [(&'static str, &'static str); N]) -> [Item; N] {
        let mut items = [Item { name: "", description: "" }; N];
        let mut i = 0;
        while i < N {
            items[i] = Item::new(rows[i].0, rows[i].1);
            i += 1;
        }
        items
    }
}

#[derive(Debug)]
#[allow(missing_docs)]
pub struct Enumeration {
    pub name: &'static str,
    pub description: &'static str,
    pub items: &'static [Item],
}

#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub enum Kind {
    Real(Quantity),
    Integer { min: Option<i32>, max: Option<i32> },
    Boolean,
    Enumeration(&'static Enumeration),
}

/// Function that returns the index of a continuous state in the model's state vector. The argument is the number of the
/// element if the state is an array; it is 0 for the first element and for a scalar.
pub type Place = fn(usize) -> usize;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Dimension {
    Fixed(usize),
    /// The length of the array is the value of the integer parameter with this name, and at most the given number. In a
    /// description with array variables the parameter is structural (see [`Layout`](crate::table::Layout)). In a description
    /// with scalars the array always has the largest length.
    Sized(&'static str, usize),
    /// The length of the array is always the given number. The value of the integer parameter with this name is the number
    /// of elements that are used. A reduced model description does not contain the unused elements.
    Used(&'static str, usize),
}

#[allow(missing_docs)]
impl Dimension {
    pub const fn most(self) -> usize {
        match self {
            Dimension::Fixed(length) | Dimension::Sized(_, length) | Dimension::Used(_, length) => {
                length
            }
        }
    }
}

/// Functions that read the value of a variable from the model, or write it. The last argument of each is the number of the
/// element in its array; it is 0 for the first element and for a scalar.
#[derive(Debug)]
#[allow(missing_docs)]
pub enum Access<M: Dynamics> {
    /// An input. The function returns references to its value and to its slope.
    Input(fn(&mut M::Inputs, usize) -> [&mut f64; 2]),
    Output(fn(&M::Outputs, usize) -> f64),
    OutputInteger(fn(&M::Outputs, usize) -> i32),
    OutputBoolean(fn(&M::Outputs, usize) -> bool),
    /// A variable that depends only on parameters and present inputs. The function returns its value, and the rate at which
    /// it changes if the inputs follow their slopes.
    OfInputs(fn(&M, &M::Inputs, usize) -> [f64; 2]),
    Real(fn(&mut M::Parameters, usize) -> &mut f64),
    Boolean(fn(&mut M::Parameters) -> &mut bool),
    Integer(fn(&mut M::Parameters, usize) -> &mut i32),
    /// A parameter that the model stores in another type than i32, so that `get` and `set` convert it.
    Choice {
        get: fn(&M::Parameters, usize) -> i32,
        set: fn(&mut M::Parameters, usize, i32),
    },
    /// A calculated parameter, which is constant in time. The function computes it from the model.
    Calculated(fn(&M, usize) -> f64),
    State,
    Derivative(Place),
}

/// An entry of the table of variables: a scalar variable or an array.
#[derive(Debug)]
#[allow(missing_docs)]
pub struct Variable<M: Dynamics> {
    /// Name of the variable. In the name of an array, empty brackets stand for the first index of an element, counted from 1;
    /// further indices follow in brackets at the end. For example, `tank[].p` with the shape 4, 3, 3 has the elements
    /// `tank[1].p[1,1]`, `tank[1].p[1,2]`, …
    pub name: &'static str,
    pub description: &'static str,
    pub causality: Causality,
    pub kind: Kind,
    pub access: Access<M>,
    /// Length of each dimension of an array; empty for a scalar.
    pub shape: &'static [Dimension],
    /// For a continuous state, the function that returns its index in the model's state vector; otherwise `None`.
    pub state: Option<Place>,
    /// True if an event can make this continuous state jump.
    pub reinit: bool,
    /// True if other inputs determine how this input changes during a step, whatever slope the host sets (see
    /// [`Dynamics::set_dependent_slopes`]).
    pub follows_inputs: bool,
    pub tunable: bool,
    /// Inputs and continuous states on which the variable depends without delay. The name of an array stands for all its
    /// elements; the name with "[]" stands for the element with the same index as the element of this variable.
    pub depends_on: &'static [&'static str],
    /// Parameters and inputs on which the initial value of the variable depends in addition to `depends_on`. A name that
    /// ends with a dot stands for all parameters whose names begin with it.
    pub initial_depends_on: &'static [&'static str],
}

// Derived implementations would require the same traits of M.
impl<M: Dynamics> Clone for Access<M> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<M: Dynamics> Copy for Access<M> {}
impl<M: Dynamics> Clone for Variable<M> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<M: Dynamics> Copy for Variable<M> {}

/// Shortest time, s, in which an input may cross its range. If an input changed faster, values that depend on its rate might
/// overflow.
const CROSSING: f64 = 1e-9;

const fn variable<M: Dynamics>(
    name: &'static str,
    causality: Causality,
    kind: Kind,
    access: Access<M>,
    description: &'static str,
) -> Variable<M> {
    Variable {
        name,
        description,
        causality,
        kind,
        access,
        shape: &[],
        state: None,
        reinit: false,
        follows_inputs: false,
        tunable: false,
        depends_on: &[],
        initial_depends_on: &[],
    }
}

const fn quantity(unit: &'static str) -> Kind {
    Kind::Real(Quantity { unit, display_unit: None, min: None, max: None, nominal: None })
}

/// Defines functions that declare a variable, one function per row. A row contains the arguments of the function between the
/// variable's name and its description, and then causality, type and access of the variable.
macro_rules! declarations {
    ($($(#[$doc:meta])* $function:ident($($argument:ident: $type:ty),*) =
        $causality:ident, $kind:expr, $access:expr;)*) => {
        #[allow(missing_docs)]
        impl<M: Dynamics> Variable<M> {
            $(
                $(#[$doc])*
                pub const fn $function(
                    name: &'static str,
                    $($argument: $type,)*
                    description: &'static str,
                ) -> Self {
                    variable(name, Causality::$causality, $kind, $access, description)
                }
            )*
        }
    };
}

const INTEGER: Kind = Kind::Integer { min: None, max: None };

declarations! {
    input(ramp: fn(&mut M::Inputs, usize) -> [&mut f64; 2], unit: &'static str) =
        Input, quantity(unit), Access::Input(ramp);
    output(get: fn(&M::Outputs, usize) -> f64, unit: &'static str) = Output, quantity(unit), Access::Output(get);
    local(get: fn(&M::Outputs, usize) -> f64, unit: &'static str) = Local, quantity(unit), Access::Output(get);
    /// Declares a real local variable that depends only on parameters and present inputs. `get` returns its value, and the
    /// rate at which it changes if the inputs follow their slopes.
    local_of_inputs(get: fn(&M, &M::Inputs, usize) -> [f64; 2], unit: &'static str) =
        Local, quantity(unit), Access::OfInputs(get);
    /// Declares the derivative of a continuous state. Its name must be "der(", the name of the state, and ")".
    derivative(of: Place, unit: &'static str) = Local, quantity(unit), Access::Derivative(of);
    local_boolean(get: fn(&M::Outputs, usize) -> bool) = Local, Kind::Boolean, Access::OutputBoolean(get);
    local_integer(get: fn(&M::Outputs, usize) -> i32) = Local, INTEGER, Access::OutputInteger(get);
    local_enumeration(of: &'static Enumeration, get: fn(&M::Outputs, usize) -> i32) =
        Local, Kind::Enumeration(of), Access::OutputInteger(get);
    parameter(field: fn(&mut M::Parameters, usize) -> &mut f64, unit: &'static str) =
        Parameter, quantity(unit), Access::Real(field);
    switch(field: fn(&mut M::Parameters) -> &mut bool) = Parameter, Kind::Boolean, Access::Boolean(field);
    integer(field: fn(&mut M::Parameters, usize) -> &mut i32) = Parameter, INTEGER, Access::Integer(field);
    /// Declares an integer parameter that the model stores in another type; `get` and `set` convert it.
    count(get: fn(&M::Parameters, usize) -> i32, set: fn(&mut M::Parameters, usize, i32)) =
        Parameter, INTEGER, Access::Choice { get, set };
    /// Declares a parameter that is an enumeration; `get` and `set` convert the number of the item.
    choice(of: &'static Enumeration, get: fn(&M::Parameters, usize) -> i32, set: fn(&mut M::Parameters, usize, i32)) =
        Parameter, Kind::Enumeration(of), Access::Choice { get, set };
    calculated(get: fn(&M, usize) -> f64, unit: &'static str) =
        CalculatedParameter, quantity(unit), Access::Calculated(get);
}

#[allow(missing_docs)]
impl<M: Dynamics> Variable<M> {
    pub const fn state(
        name: &'static str,
        place: Place,
        unit: &'static str,
        description: &'static str,
    ) -> Self {
        variable(name, Causality::Local, quantity(unit), Access::State, description).is_state(place)
    }

    pub const fn display_unit(mut self, unit: &'static str) -> Self {
        if let Kind::Real(quantity) = &mut self.kind {
            quantity.display_unit = Some(unit);
        }
        self
    }

    pub const fn range(mut self, min: f64, max: f64) -> Self {
        if let Kind::Real(quantity) = &mut self.kind {
            quantity.min = Some(min);
            quantity.max = Some(max);
        }
        self
    }

    pub const fn between(mut self, min: i32, max: i32) -> Self {
        self.kind = Kind::Integer { min: Some(min), max: Some(max) };
        self
    }

    pub const fn at_least(mut self, min: f64) -> Self {
        if let Kind::Real(quantity) = &mut self.kind {
            quantity.min = Some(min);
        }
        self
    }

    pub const fn nominal(mut self, nominal: f64) -> Self {
        if let Kind::Real(quantity) = &mut self.kind {
            quantity.nominal = Some(nominal);
        }
        self
    }

    pub const fn shape(mut self, shape: &'static [Dimension]) -> Self {
        self.shape = shape;
        self
    }

    pub const fn is_state(mut self, place: Place) -> Self {
        self.state = Some(place);
        self
    }

    /// Declares that an event can make this continuous state jump, for example a velocity at an impact.
    pub const fn reinit(mut self) -> Self {
        self.reinit = true;
        self
    }

    /// Declares that other inputs determine how this input changes during a step. For example, an angular velocity follows
    /// from the angular acceleration.
    pub const fn follows_inputs(mut self) -> Self {
        self.follows_inputs = true;
        self
    }

    pub const fn tunable(mut self) -> Self {
        self.tunable = true;
        self
    }

    pub const fn depends_on(mut self, known: &'static [&'static str]) -> Self {
        self.depends_on = known;
        self
    }

    pub const fn initial_depends_on(mut self, known: &'static [&'static str]) -> Self {
        self.initial_depends_on = known;
        self
    }

    /// Returns the number of scalars of the variable, which is the product of the largest lengths of all dimensions.
    pub const fn len(&self) -> usize {
        let (mut len, mut n) = (1, 0);
        while n < self.shape.len() {
            len *= self.shape[n].most();
            n += 1;
        }
        len
    }

    pub fn lengths(&self) -> impl DoubleEndedIterator<Item = usize> + ExactSizeIterator + use<M> {
        self.shape.iter().map(|dimension| dimension.most())
    }

    /// Returns the name of the variable in a description with array variables: `tank[].p` becomes `tank.p`.
    pub fn array_name(&self) -> String {
        self.name.replace("[]", "")
    }

    pub const fn is_empty(&self) -> bool {
        false
    }

    /// Converts the number of an element to its indices, which all count from 0 as the number does.
    pub fn indices(&self, element: usize) -> Vec<usize> {
        let mut indices = Vec::with_capacity(self.shape.len());
        let mut rest = element;
        for length in self.lengths().rev() {
            indices.push(rest % length);
            rest /= length;
        }
        indices.reverse();
        indices
    }

    /// Returns the name of an element, for example `tank[1].p[1,2]`. The first element has the number 0.
    pub fn element_name(&self, element: usize) -> String {
        let indices: Vec<_> = self.indices(element).iter().map(|i| (i + 1).to_string()).collect();
        self.indexed(&indices)
    }

    /// Returns the name of an array with the ranges of its indices, for example `slosh.mass[1..10]`.
    pub fn pattern(&self) -> String {
        let ranges: Vec<_> = self.lengths().map(|length| format!("1..{length}")).collect();
        self.indexed(&ranges)
    }

    fn indexed(&self, indices: &[String]) -> String {
        let (inner, closing) = match self.name.strip_suffix(')') {
            Some(inner) => (inner, ")"),
            None => (self.name, ""),
        };
        let mut name = String::new();
        let mut parts = inner.split("[]");
        name.push_str(parts.next().unwrap_or_default());
        let mut left = indices.iter();
        for part in parts {
            name.push_str(&format!("[{}]{part}", left.next().map_or("", String::as_str)));
        }
        let left: Vec<_> = left.map(String::as_str).collect();
        if !left.is_empty() {
            name.push_str(&format!("[{}]", left.join(",")));
        }
        name + closing
    }

    /// Returns the start value of an element, from the default `parameters` and `inputs` of the model; `None` if the value is
    /// computed. Neither argument is changed.
    pub fn start(
        &self,
        parameters: &mut M::Parameters,
        inputs: &mut M::Inputs,
        element: usize,
    ) -> Option<Value> {
        match self.access {
            Access::Input(ramp) => Some(Value::Real(*ramp(inputs, element)[0])),
            _ => self.parameter_value(parameters, element),
        }
    }

    /// Returns the value of an element in `parameters`; `None` if the variable is not a parameter. The reference is mutable
    /// only because the same functions read and write a parameter; nothing is changed.
    pub fn parameter_value(&self, parameters: &mut M::Parameters, element: usize) -> Option<Value> {
        match self.access {
            Access::Real(field) => Some(Value::Real(*field(parameters, element))),
            Access::Boolean(field) => Some(Value::Boolean(*field(parameters))),
            Access::Integer(field) => Some(Value::Integer(*field(parameters, element))),
            Access::Choice { get, .. } => Some(Value::Integer(get(parameters, element))),
            _ => None,
        }
    }

    /// Sets an element of this parameter in `parameters` to a value, which must have the type of the parameter.
    pub fn set_parameter(&self, parameters: &mut M::Parameters, element: usize, value: Value) {
        match (self.access, value) {
            (Access::Real(field), Value::Real(x)) => *field(parameters, element) = x,
            (Access::Boolean(field), Value::Boolean(x)) => *field(parameters) = x,
            (Access::Integer(field), Value::Integer(x)) => *field(parameters, element) = x,
            (Access::Choice { set, .. }, Value::Integer(x)) => set(parameters, element, x),
            _ => {}
        }
    }

    pub const fn min(&self) -> Option<f64> {
        match self.kind {
            Kind::Real(quantity) => quantity.min,
            _ => None,
        }
    }

    /// Returns the largest allowed rate of an input, in its unit per second. It is the larger magnitude of the two bounds of
    /// the input's range, divided by [`CROSSING`], or infinity if a bound is missing.
    pub fn fastest(&self) -> f64 {
        match self.kind {
            Kind::Real(Quantity { min: Some(min), max: Some(max), .. }) => {
                f64::max(min.abs(), max.abs()) / CROSSING
            }
            _ => f64::INFINITY,
        }
    }

    /// Returns true if an input may change at this rate, which must be finite and at most [`Variable::fastest`].
    #[inline]
    pub fn allows_rate(&self, rate: f64) -> bool {
        let Kind::Real(Quantity { min, max, .. }) = &self.kind else { return is_finite(rate) };
        // NaN must not be multiplied in a host that traps invalid operations, see [`is_finite`].
        let change = if is_finite(rate) { rate.abs() } else { 0.0 } * CROSSING;
        is_finite(rate)
            && (max.is_none_or(|max| change <= max) || min.is_none_or(|min| change <= -min))
    }

    pub const fn unit(&self) -> &'static str {
        match self.kind {
            Kind::Real(quantity) => quantity.unit,
            _ => "",
        }
    }

    pub const fn nominal_value(&self) -> f64 {
        match self.kind {
            Kind::Real(Quantity { nominal: Some(nominal), .. }) => nominal,
            _ => 1.0,
        }
    }

    #[inline]
    pub const fn c_type(&self) -> CType {
        match self.kind {
            Kind::Real(_) => CType::Real,
            Kind::Integer { .. } | Kind::Enumeration(_) => CType::Integer,
            Kind::Boolean => CType::Boolean,
        }
    }

    /// Returns an error message in the form `name = value unit (allowed: …)` if `value` is not allowed for an element of this
    /// variable; otherwise `None`.
    #[inline]
    pub fn problem(&self, element: usize, value: Value) -> Option<String> {
        if self.allows(value) { None } else { Some(self.refusal(element, value)) }
    }

    #[inline]
    fn allows(&self, value: Value) -> bool {
        match (&self.kind, value) {
            (Kind::Real(Quantity { min, max, .. }), Value::Real(x)) => {
                // NaN must not be compared in a host that traps invalid operations, see [`is_finite`].
                let number = if is_finite(x) { x } else { f64::INFINITY };
                is_finite(x) && min.is_none_or(|m| number >= m) && max.is_none_or(|m| number <= m)
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
    fn refusal(&self, element: usize, value: Value) -> String {
        let name = self.element_name(element);
        match value {
            Value::Real(x) => {
                format!("{name} = {} (allowed: {})", self.with_unit(x), self.allowed())
            }
            Value::Integer(n) => format!("{name} = {n} (allowed: {})", self.allowed()),
            Value::Boolean(b) => format!("{name} = {b} (allowed: {})", self.allowed()),
        }
    }

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
        let x = text(x);
        match self.kind {
            Kind::Real(Quantity { unit, .. }) if !["", "1"].contains(&unit) => {
                format!("{x} {unit}")
            }
            _ => x,
        }
    }
}
