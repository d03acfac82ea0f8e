//! Reads `modelDescription.xml` (FMI 2.0, section 2.2; FMI 3.0, section 2.4) as far as a host needs it to run
//! the FMU.
//!
//! Both versions are read into the same structures: a Float64 of FMI 3.0 becomes a Real, its instantiationToken becomes
//! the GUID, and an alias becomes a variable with the same value reference. An array becomes one variable for each
//! element, for example `x[1,2]`, as in FMI 2.0; [`ModelDescription::element`] returns the position of an element.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};

use crate::archive::Archive;
use crate::causality::{Causality, Variability};
use crate::xml::Element;

/// Content of modelDescription.xml.
///
/// - `variables`: the variables in the order of the file. An array of FMI 3.0 is listed as one
///   variable for each element, in row-major order.
/// - `derivatives`: pairs of value references: the derivative of a continuous state, and the state.
/// - `sizes`: numbers of continuous states and event indicators that an FMU 2.0 declares.
#[derive(Clone, Debug)]
pub struct ModelDescription {
    pub fmi_version: String,
    pub model_name: String,
    pub guid: String,
    pub version: String,
    pub description: String,
    pub generation_tool: String,
    pub co_simulation: Option<Interface>,
    pub model_exchange: Option<Interface>,
    pub units: Vec<Unit>,
    pub types: Vec<SimpleType>,
    pub default_experiment: DefaultExperiment,
    pub variables: Vec<Variable>,
    pub derivatives: Vec<(u32, u32)>,
    pub(crate) sizes: (usize, usize),
    arrays: BTreeMap<u32, Array>,
    elements: BTreeMap<u32, ArrayElement>,
}

#[derive(Clone, Debug)]
pub struct Array {
    pub length: usize,
    pub c_type: CType,
    pub start: Vec<String>,
    /// True if structural parameters have changed the size of the array. Its declared start values
    /// then have no meaning.
    pub(crate) is_resized: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArrayElement {
    pub array: u32,
    pub index: usize,
}

#[derive(Clone, Debug)]
pub struct Interface {
    pub model_identifier: String,
    /// True if the FMU accepts derivatives of inputs (FMI 2.0), or new values of inputs within a
    /// step (FMI 3.0), so that inputs can change linearly during a step.
    pub can_interpolate_inputs: bool,
    pub directional_derivatives: bool,
}

#[derive(Clone, Debug, Default)]
pub struct DefaultExperiment {
    pub start_time: Option<f64>,
    pub stop_time: Option<f64>,
    pub tolerance: Option<f64>,
    pub step_size: Option<f64>,
}

/// A unit in which an FMU exchanges values, with the display units in which users may enter values,
/// for example m and mm.
#[derive(Clone, Debug)]
pub struct Unit {
    pub name: String,
    pub display: Vec<DisplayUnit>,
    pub base: Option<BaseUnit>,
}

/// Relation of a unit to the SI base units (element `BaseUnit` of FMI and SSP): value in SI base
/// units = `factor` · value in this unit + `offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseUnit {
    pub exponents: [i32; 8],
    pub factor: f64,
    pub offset: f64,
}

impl BaseUnit {
    pub const NAMES: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

    /// Reads the child `BaseUnit` of the XML element `unit`. Returns `None` if the child is missing
    /// or one of its numbers is not valid.
    pub fn from_element(unit: &Element) -> Option<BaseUnit> {
        let base = unit.child("BaseUnit")?;
        let mut exponents = [0; 8];
        for (exponent, name) in exponents.iter_mut().zip(BaseUnit::NAMES) {
            *exponent = base.get(name).map_or(Some(0), |text| text.trim().parse().ok())?;
        }
        let number = |name: &str, absent: f64| match base.get(name) {
            Some(_) => base.number(name).filter(|number| number.is_finite()),
            None => Some(absent),
        };
        let (factor, offset) = (number("factor", 1.0)?, number("offset", 0.0)?);
        (factor != 0.0).then_some(BaseUnit { exponents, factor, offset })
    }
}

/// A display unit of FMI (element `DisplayUnit`): value in this unit = `factor` · value in the
/// variable's unit + `offset`.
#[derive(Clone, Debug)]
pub struct DisplayUnit {
    pub name: String,
    pub factor: f64,
    pub offset: f64,
}

#[derive(Clone, Debug)]
pub struct SimpleType {
    pub name: String,
    pub unit: Option<String>,
    pub items: Vec<Item>,
}

#[derive(Clone, Debug)]
pub struct Item {
    pub name: String,
    pub value: i64,
}

/// A variable of an FMU, or one element of an array variable.
///
/// - `reference`: value reference, the number by which an FMU identifies a variable. An element of
///   an array has no value reference in FMI, so that the host assigns a number that no other
///   variable has.
/// - `variability`: variability; [`Variability::Other`] with an empty text if the attribute is
///   missing.
/// - `intermediate`: true if a host may set the variable (an input) or read it (an output) within a
///   step; FMI 3.0 only.
#[derive(Clone, Debug)]
pub struct Variable {
    pub name: String,
    pub reference: u32,
    pub causality: Causality,
    pub variability: Variability,
    pub description: String,
    pub intermediate: bool,
    c_type: CType,
    kind: Type,
    attributes: Attributes,
}

#[derive(Clone, Debug, Default)]
pub struct Attributes {
    pub start: Option<String>,
    pub unit: Option<String>,
    pub display_unit: Option<String>,
    pub min: Option<String>,
    pub max: Option<String>,
    pub declared_type: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    Real,
    Integer,
    Boolean,
    String,
    Enumeration,
    Binary,
    Clock,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CType {
    Float32,
    Float64,
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Boolean,
    String,
    Binary,
    Clock,
}

impl CType {
    /// Returns the C type and the type shown to users for the element `name` of ModelVariables in
    /// FMI 3.0, for example `Float64`, or `None` if FMI 3.0 has no such element.
    pub fn from_element_name(name: &str) -> Option<(CType, Type)> {
        Some(match name {
            "Float32" => (CType::Float32, Type::Real),
            "Float64" => (CType::Float64, Type::Real),
            "Int8" => (CType::Int8, Type::Integer),
            "UInt8" => (CType::UInt8, Type::Integer),
            "Int16" => (CType::Int16, Type::Integer),
            "UInt16" => (CType::UInt16, Type::Integer),
            "Int32" => (CType::Int32, Type::Integer),
            "UInt32" => (CType::UInt32, Type::Integer),
            "Int64" => (CType::Int64, Type::Integer),
            "UInt64" => (CType::UInt64, Type::Integer),
            "Boolean" => (CType::Boolean, Type::Boolean),
            "String" => (CType::String, Type::String),
            "Binary" => (CType::Binary, Type::Binary),
            "Enumeration" => (CType::Int64, Type::Enumeration),
            "Clock" => (CType::Clock, Type::Clock),
            _ => return None,
        })
    }

    /// Returns the C type and the type shown to users for the child `name` of a ScalarVariable in
    /// FMI 2.0, for example `Real`, or `None` if FMI 2.0 has no such element.
    pub fn from_child_name(name: &str) -> Option<(CType, Type)> {
        Some(match name {
            "Real" => (CType::Float64, Type::Real),
            "Integer" => (CType::Int32, Type::Integer),
            "Boolean" => (CType::Boolean, Type::Boolean),
            "String" => (CType::String, Type::String),
            "Enumeration" => (CType::Int32, Type::Enumeration),
            _ => return None,
        })
    }

    fn integer_bounds(self) -> Option<(i64, i64)> {
        Some(match self {
            CType::Int8 => (i8::MIN.into(), i8::MAX.into()),
            CType::UInt8 => (0, u8::MAX.into()),
            CType::Int16 => (i16::MIN.into(), i16::MAX.into()),
            CType::UInt16 => (0, u16::MAX.into()),
            CType::Int32 => (i32::MIN.into(), i32::MAX.into()),
            CType::UInt32 => (0, u32::MAX.into()),
            CType::Int64 => (i64::MIN, i64::MAX),
            CType::UInt64 => (0, i64::MAX),
            _ => return None,
        })
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Real(f64),
    Integer(i64),
    Boolean(bool),
    String(String),
}

impl Value {
    /// Returns the value as a number for tables of results, because these hold only numbers:
    /// Booleans become 0 and 1, texts become NaN.
    pub fn number(&self) -> f64 {
        match self {
            Value::Real(x) => *x,
            Value::Integer(n) => *n as f64,
            Value::Boolean(yes) => f64::from(u8::from(*yes)),
            Value::String(_) => f64::NAN,
        }
    }

    pub fn is_identical(&self, other: &Value) -> bool {
        match (self, other) {
            (Value::Real(a), Value::Real(b)) => a.to_bits() == b.to_bits(),
            (a, b) => a == b,
        }
    }

    fn text(&self) -> String {
        match self {
            Value::Real(x) => x.to_string(),
            Value::Integer(n) => n.to_string(),
            Value::Boolean(yes) => yes.to_string(),
            Value::String(text) => text.clone(),
        }
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Value::Real(x) => write!(f, "{x:?}"),
            Value::Integer(n) => write!(f, "{n}"),
            Value::Boolean(yes) => write!(f, "{yes}"),
            Value::String(text) => write!(f, "{text:?}"),
        }
    }
}

impl Variable {
    pub fn kind(&self) -> Type {
        self.kind
    }

    pub fn c_type(&self) -> CType {
        self.c_type
    }

    pub fn is_structural(&self) -> bool {
        self.causality == Causality::StructuralParameter
    }

    pub fn attributes(&self) -> &Attributes {
        &self.attributes
    }
}

fn quote_short(text: &str) -> String {
    match text.char_indices().nth(60) {
        None => format!("\"{text}\""),
        Some((at, _)) => format!("\"{}…\", {} bytes long", &text[..at], text.len()),
    }
}

#[derive(Default)]
struct Reader {
    is_fmi3: bool,
    problems: Vec<String>,
    more: usize,
}

impl Reader {
    fn problem(&mut self, element: &Element, what: &str) {
        match self.problems.len() < NAMED {
            true => {
                self.problems.push(format!("line {}, {}: {what}", element.line, element.name));
            }
            false => self.more += 1,
        }
    }

    /// Parses the required `attribute` of `element` with `read`. If the attribute is missing or
    /// `read` returns `None`, a problem is added to the list of problems and the type's default
    /// value is returned.
    fn required<T: Default>(
        &mut self,
        element: &Element,
        attribute: &str,
        read: impl Fn(&str) -> Option<T>,
    ) -> T {
        let text = element.get(attribute);
        text.and_then(read).unwrap_or_else(|| {
            let why =
                text.map_or("is missing".into(), |text| format!("cannot be {}", quote_short(text)));
            self.problem(element, &format!("{attribute} {why}"));
            T::default()
        })
    }

    fn text(&mut self, element: &Element, attribute: &str) -> String {
        self.required(element, attribute, |text| Some(text.to_string()))
    }

    fn interface(&mut self, element: &Element) -> Interface {
        Interface {
            model_identifier: self.text(element, "modelIdentifier"),
            can_interpolate_inputs: element.flag("canInterpolateInputs")
                || element.flag("providesIntermediateUpdate"),
            directional_derivatives: element.flag("providesDirectionalDerivative")
                || element.flag("providesDirectionalDerivatives"),
        }
    }

    fn unit(&mut self, element: &Element) -> Unit {
        let display = element.children.iter().filter(|child| child.name == "DisplayUnit");
        let display = display.map(|shown| DisplayUnit {
            name: self.text(shown, "name"),
            factor: shown.number("factor").unwrap_or(1.0),
            offset: shown.number("offset").unwrap_or(0.0),
        });
        let base = BaseUnit::from_element(element);
        Unit { display: display.collect(), name: self.text(element, "name"), base }
    }

    fn item(&mut self, element: &Element) -> Item {
        // Values of items have 32 bits in FMI 2.0 and 64 bits in FMI 3.0.
        let is_fmi3 = self.is_fmi3;
        let fits = |n: &i64| is_fmi3 || i32::try_from(*n).is_ok();
        let value = self.required(element, "value", |text| text.trim().parse().ok().filter(fits));
        Item { name: self.text(element, "name"), value }
    }

    fn simple_type(&mut self, element: &Element) -> SimpleType {
        if element.name.ends_with("Type") && element.name != "SimpleType" {
            let items = element.children.iter().filter(|child| child.name == "Item");
            return SimpleType {
                items: items.map(|item| self.item(item)).collect(),
                name: self.text(element, "name"),
                unit: element.get("unit").map(String::from),
            };
        }
        let items = element.list("Enumeration").filter(|child| child.name == "Item");
        SimpleType {
            items: items.map(|item| self.item(item)).collect(),
            name: self.text(element, "name"),
            unit: element.child("Real").and_then(|real| real.get("unit")).map(String::from),
        }
    }

    fn variable(&mut self, element: &Element) -> Variable {
        let children = element.children.iter();
        let mut typed =
            children.filter_map(|child| Some((CType::from_child_name(&child.name)?, child)));
        let typed = typed.next();
        if typed.is_none() {
            self.problem(element, "the variable has no type");
        }
        let types = typed.map_or((CType::Float64, Type::Real), |(types, _)| types);
        let typed = typed.map(|(_, typed)| typed);
        let start = typed.and_then(|typed| typed.get("start")).map(String::from);
        Variable {
            variability: element.get("variability").unwrap_or_default().into(),
            intermediate: false,
            ..self.common(element, typed, types, start)
        }
    }

    fn common(
        &mut self,
        element: &Element,
        typed: Option<&Element>,
        (c_type, kind): (CType, Type),
        start: Option<String>,
    ) -> Variable {
        let of = |name: &str| typed.and_then(|typed| typed.get(name)).map(String::from);
        Variable {
            name: self.required(element, "name", |n| (n.len() <= LONGEST_NAME).then(|| n.into())),
            reference: self.required(element, "valueReference", |text| text.trim().parse().ok()),
            causality: element.get("causality").map_or(Causality::Local, Causality::from),
            variability: Variability::from(""),
            description: element.get("description").unwrap_or_default().into(),
            intermediate: element.flag("intermediateUpdate"),
            c_type,
            kind,
            attributes: Attributes {
                start,
                unit: of("unit"),
                display_unit: of("displayUnit"),
                min: of("min"),
                max: of("max"),
                declared_type: of("declaredType"),
            },
        }
    }

    /// Adds the variables of an FMU 3.0 and their aliases to `to`. An array becomes one variable
    /// for each element. `set` has the values of structural parameters, by value reference, that
    /// replace the declared values and so determine the sizes of arrays.
    fn variables3(
        &mut self,
        root: &Element,
        set: &BTreeMap<u32, Value>,
        to: &mut ModelDescription,
    ) {
        let set: BTreeMap<String, String> =
            set.iter().map(|(reference, value)| (reference.to_string(), value.text())).collect();
        let value = |e: &Element, reference: &str| -> Option<u64> {
            set.get(reference).map(String::as_str).or(e.get("start"))?.trim().parse().ok()
        };
        let sizes: BTreeMap<&str, u64> = root
            .list("ModelVariables")
            .filter_map(|e| Some((e.get("valueReference")?, e)))
            .filter_map(|(reference, e)| Some((reference, value(e, reference)?)))
            .collect();
        let references = root.list("ModelVariables").filter_map(|e| e.get("valueReference"));
        let references = references.filter_map(|r| r.trim().parse::<u32>().ok());
        let mut next = references.max().map_or(Some(0), |last| last.checked_add(1));
        for element in root.list("ModelVariables") {
            let Some((c_type, kind)) = CType::from_element_name(&element.name) else {
                self.problem(element, "the declaredType does not exist");
                continue;
            };
            let (mut variable, starts) = self.variable3(element, c_type, kind);
            if let Some(value) = set.get(&variable.reference.to_string()) {
                variable.attributes.start = Some(value.clone());
            }
            let dimensions = self.dimensions(element, &sizes);
            if dimensions.is_empty() {
                let aliases = self.aliases(element, &variable);
                to.variables.push(variable);
                to.variables.extend(aliases);
                continue;
            }
            let is_resized = element.children.iter().any(|child| {
                child.name == "Dimension"
                    && child.get("valueReference").is_some_and(|r| set.contains_key(r))
            });
            let length = dimensions.iter().try_fold(1usize, |n, size| n.checked_mul(*size));
            let Some(length) = length.filter(|n| to.elements.len() + n <= MOST_ELEMENTS) else {
                self.problem(
                    element,
                    &format!("with this variable the arrays have more than {MOST_ELEMENTS} elements together"),
                );
                continue;
            };
            for index in 0..length {
                let Some(own) = next else {
                    self.problem(
                        element,
                        "no value references are left for the elements of this array",
                    );
                    break;
                };
                next = own.checked_add(1);
                let mut one = variable.clone();
                one.name = format!("{}[{}]", variable.name, indices(index, &dimensions));
                one.reference = own;
                let start = starts.get(index).or(starts.first());
                one.attributes.start = start.filter(|_| !is_resized).cloned();
                to.elements.insert(own, ArrayElement { array: variable.reference, index });
                to.variables.push(one);
            }
            let is_resized = is_resized && !starts.is_empty();
            let start = if is_resized { Vec::new() } else { starts };
            let array = Array { length, c_type, start, is_resized };
            to.arrays.insert(variable.reference, array);
        }
    }

    fn variable3(
        &mut self,
        element: &Element,
        c_type: CType,
        kind: Type,
    ) -> (Variable, Vec<String>) {
        let starts = starts(element, c_type);
        let variability = element.get("variability").map(Variability::from);
        let variability = variability.unwrap_or_else(|| {
            let causality = element.get("causality");
            match (causality.is_some_and(|c| c.to_lowercase().ends_with("parameter")), kind) {
                (true, _) => Variability::Fixed,
                (false, Type::Real) => Variability::Continuous,
                (false, _) => Variability::Discrete,
            }
        });
        let start = starts.first().cloned();
        let common = self.common(element, Some(element), (c_type, kind), start);
        (Variable { variability, ..common }, starts)
    }

    fn dimensions(&mut self, element: &Element, sizes: &BTreeMap<&str, u64>) -> Vec<usize> {
        let mut dimensions = Vec::new();
        for dimension in element.children.iter().filter(|child| child.name == "Dimension") {
            let size = match (dimension.get("start"), dimension.get("valueReference")) {
                (Some(start), _) => start.trim().parse().ok(),
                (None, Some(reference)) => sizes.get(reference).copied(),
                (None, None) => None,
            };
            match size {
                Some(size) => dimensions.push(size as usize),
                None => self.problem(
                    dimension,
                    "the dimension has no size (allowed: start, or the valueReference of a structural parameter)",
                ),
            }
        }
        dimensions
    }

    /// Returns the aliases of `variable`, which are declared in `element`, as variables that cannot
    /// be set. A variable is set and recorded only by its own name, so that no value occurs twice.
    fn aliases(&mut self, element: &Element, variable: &Variable) -> Vec<Variable> {
        let mut aliases = Vec::new();
        for alias in element.children.iter().filter(|child| child.name == "Alias") {
            let name = self.text(alias, "name");
            let description = alias.get("description").unwrap_or_default().into();
            let mut other = Variable { name, description, ..variable.clone() };
            other.causality = Causality::Local;
            let shown = alias.get("displayUnit").map(String::from);
            other.attributes.display_unit = shown.or(other.attributes.display_unit);
            aliases.push(other);
        }
        aliases
    }
}

/// Returns the value references of each state derivative that ModelStructure lists, and of its
/// state, as pairs (derivative, state). FMI 2.0 identifies variables by their positions in
/// ModelVariables, FMI 3.0 by value references.
fn derivatives(root: &Element, is_fmi3: bool) -> Vec<(u32, u32)> {
    let all: Vec<&Element> = root.list("ModelVariables").collect();
    let reference = |variable: &Element| variable.get("valueReference")?.trim().parse::<u32>().ok();
    let places = all.iter().enumerate().filter_map(|(i, variable)| {
        let key = if is_fmi3 { reference(variable)? } else { i as u32 + 1 };
        Some((key, *variable))
    });
    let places: BTreeMap<u32, &Element> = places.collect();
    let named = |element: &Element, attribute: &str| {
        places.get(&element.get(attribute)?.trim().parse().ok()?).copied()
    };
    let unknowns = root.child("ModelStructure").into_iter().flat_map(|structure| match is_fmi3 {
        true => {
            structure.children.iter().filter(|e| e.name == "ContinuousStateDerivative").collect()
        }
        false => structure.list("Derivatives").collect::<Vec<_>>(),
    });
    let attribute = if is_fmi3 { "valueReference" } else { "index" };
    let pair = |unknown: &Element| {
        let derivative = named(unknown, attribute)?;
        let typed = if is_fmi3 { derivative } else { derivative.child("Real")? };
        Some((reference(derivative)?, reference(named(typed, "derivative")?)?))
    };
    unknowns.filter_map(pair).collect()
}

/// Returns the declared start values of a variable in FMI 3.0, as texts: one for a scalar, one for
/// each element of an array. Texts and binary values are in child elements `Start`, numbers in the
/// attribute `start`.
pub fn starts(element: &Element, c_type: CType) -> Vec<String> {
    match c_type {
        CType::String | CType::Binary => {
            let starts = element.children.iter().filter(|child| child.name == "Start");
            starts.map(|start| start.get("value").unwrap_or_default().into()).collect()
        }
        _ => {
            let words = element.get("start").into_iter().flat_map(str::split_whitespace);
            words.map(String::from).collect()
        }
    }
}

/// Converts the position of an array element, counted from 0 in row-major order, to its indices,
/// counted from 1: position 5 of a 2 by 3 array becomes `2,3`.
fn indices(mut index: usize, dimensions: &[usize]) -> String {
    let mut all = Vec::new();
    for size in dimensions.iter().rev() {
        all.push((index % size + 1).to_string());
        index /= size;
    }
    all.reverse();
    all.join(",")
}

const LONGEST_NAME: usize = 1024;
/// Largest number of types in a description, and of items of one enumeration. The number is limited
/// because the type of a variable is found by a search through all types, so that the time grows
/// with the number of variables times the number of types.
const MOST_TYPES: usize = 5000;
const MOST_ELEMENTS: usize = 100_000;
const NAMED: usize = 20;

impl ModelDescription {
    /// Reads the model description of the packed FMU at `path`. This is faster than
    /// [`Fmu::open`](crate::Fmu::open), because nothing is unpacked and no binary is loaded.
    pub fn from_fmu(path: &Path) -> Result<Self> {
        Ok(ModelDescription::from_archive(&Archive::open(path)?, path)?.1)
    }

    pub(crate) fn from_archive(archive: &Archive, path: &Path) -> Result<(String, Self)> {
        let name = path.display();
        let text = archive.description().with_context(|| format!("{name} is not an FMU"))?;
        let refused = || format!("the FMU {name} cannot be used");
        let description = ModelDescription::from_xml(&text).with_context(refused)?;
        description.check_version().with_context(refused)?;
        Ok((text, description))
    }

    pub fn check_version(&self) -> Result<()> {
        let version = quote_short(&self.fmi_version).replace('"', "");
        ensure!(
            self.fmi_version == "2.0" || self.is_fmi3(),
            "the FMU is of FMI version {version} (allowed: 2.0 and 3.0)"
        );
        Ok(())
    }

    pub fn is_fmi3(&self) -> bool {
        self.fmi_version.starts_with("3.")
    }

    /// Returns the array to which the value reference `reference` belongs, and the position of the
    /// element in this array. Returns `None` if the variable is not an element of an array.
    pub fn element(&self, reference: u32) -> Option<ArrayElement> {
        self.elements.get(&reference).copied()
    }

    pub fn array(&self, reference: u32) -> Option<&Array> {
        self.arrays.get(&reference)
    }

    pub(crate) fn arrays(&self) -> impl Iterator<Item = (u32, &Array)> {
        self.arrays.iter().map(|(reference, array)| (*reference, array))
    }

    pub(crate) fn set_starts(&mut self, array: u32, values: &[Value]) {
        let texts: Vec<String> = values.iter().map(Value::text).collect();
        for variable in &mut self.variables {
            let element = self.elements.get(&variable.reference);
            if let Some(element) = element.filter(|element| element.array == array) {
                variable.attributes.start = texts.get(element.index).cloned();
            }
        }
        if let Some(array) = self.arrays.get_mut(&array) {
            (array.start, array.is_resized) = (texts, false);
        }
    }

    pub fn from_xml(text: &str) -> Result<Self> {
        ModelDescription::from_xml_with(text, &BTreeMap::new())
    }

    /// Parses `text`, which is modelDescription.xml, with other values of structural parameters:
    /// `set` has them by value reference. The sizes of arrays follow from these values. The
    /// declared start values of an array whose size changes have no meaning (FMI 3.0.2, section
    /// 2.4.7.2).
    pub(crate) fn from_xml_with(text: &str, set: &BTreeMap<u32, Value>) -> Result<Self> {
        let root = Element::parse(text.as_bytes())
            .map_err(|why| anyhow!("modelDescription.xml: {why}"))?;
        ModelDescription::from_element(&root, set)
    }

    pub(crate) fn from_element(root: &Element, set: &BTreeMap<u32, Value>) -> Result<Self> {
        // The version is checked first, because an FMU of another version would otherwise be reported as incomplete.
        let version = root.get("fmiVersion").unwrap_or("2.0");
        let is_fmi3 = version.starts_with("3.");
        if !is_fmi3 && !version.starts_with("2.") {
            let version = quote_short(version).replace('"', "");
            bail!("the FMU is of FMI version {version} (allowed: 2.0 and 3.0)");
        }
        let mut reader = Reader { is_fmi3, ..Reader::default() };
        for list in root.children.iter().filter(|child| child.name == "TypeDefinitions") {
            let enumerations = list.children.iter().flat_map(|simple| &simple.children);
            let counts = enumerations.map(|of| of.children.len()).chain([list.children.len()]);
            let counts = counts.chain(list.children.iter().map(|of| of.children.len()));
            if let Some(count) = counts.max().filter(|count| *count > MOST_TYPES) {
                bail!(
                    "modelDescription.xml has {count} types, or {count} items in one type (allowed: at most {MOST_TYPES})"
                );
            }
        }
        let optional = |name: &str| root.get(name).unwrap_or_default().to_string();
        let mut description = ModelDescription {
            fmi_version: reader.text(root, "fmiVersion"),
            model_name: reader.text(root, "modelName"),
            guid: reader.text(root, if is_fmi3 { "instantiationToken" } else { "guid" }),
            version: optional("version"),
            description: optional("description"),
            generation_tool: optional("generationTool"),
            co_simulation: root.child("CoSimulation").map(|e| reader.interface(e)),
            model_exchange: root.child("ModelExchange").map(|e| reader.interface(e)),
            units: root.list("UnitDefinitions").map(|e| reader.unit(e)).collect(),
            types: root.list("TypeDefinitions").map(|e| reader.simple_type(e)).collect(),
            default_experiment: match root.child("DefaultExperiment") {
                None => DefaultExperiment::default(),
                Some(element) => DefaultExperiment {
                    start_time: element.number("startTime"),
                    stop_time: element.number("stopTime"),
                    tolerance: element.number("tolerance"),
                    step_size: element.number("stepSize"),
                },
            },
            variables: Vec::new(),
            derivatives: derivatives(root, is_fmi3),
            sizes: (
                root.child("ModelStructure").map_or(0, |s| s.list("Derivatives").count()),
                root.number("numberOfEventIndicators").unwrap_or(0.0) as usize,
            ),
            arrays: BTreeMap::new(),
            elements: BTreeMap::new(),
        };
        if is_fmi3 {
            reader.variables3(root, set, &mut description);
        } else {
            let variables = root.list("ModelVariables").map(|e| reader.variable(e));
            description.variables = variables.collect();
        }
        let Reader { mut problems, more, .. } = reader;
        problems.extend((more > 0).then(|| format!("and {more} more like these")));
        ensure!(problems.is_empty(), "modelDescription.xml: {}", problems.join("; "));
        Ok(description)
    }

    pub fn variable(&self, name: &str) -> Result<&Variable> {
        self.variables.iter().find(|v| v.name == name).with_context(|| {
            let names = self.variables.iter().map(|v| v.name.as_str());
            format!("the FMU has no variable \"{name}\"{}", did_you_mean(name, names))
        })
    }

    pub fn items(&self, variable: &Variable) -> &[Item] {
        let declared = variable.attributes().declared_type.as_deref();
        let named = self.types.iter().find(|t| Some(t.name.as_str()) == declared);
        named.map_or(&[], |t| &t.items)
    }

    /// Returns the unit in which the FMU exchanges `variable`: its own unit, or the unit of its
    /// declared type. The text is empty if there is no unit.
    pub fn unit<'a>(&'a self, variable: &'a Variable) -> &'a str {
        let declared = variable.attributes.declared_type.as_ref();
        let declared = || self.types.iter().find(|t| Some(&t.name) == declared)?.unit.as_ref();
        variable.attributes.unit.as_ref().or_else(declared).map_or("", String::as_str)
    }

    pub fn display_units(&self, variable: &Variable) -> &[DisplayUnit] {
        let own = self.unit(variable);
        let defined = self.units.iter().find(|unit| unit.name == own);
        defined.map_or(&[], |unit| &unit.display)
    }

    /// Converts `number` to the unit in which the FMU exchanges a Real variable. `unit` is the name
    /// of the number's unit, and `base` its definition in SI base units.
    ///
    /// # Errors
    ///
    /// If the two units measure different quantities, or the FMU does not define the variable's
    /// unit.
    pub fn converted(
        &self,
        variable: &Variable,
        number: f64,
        unit: &str,
        base: &BaseUnit,
    ) -> Result<f64> {
        let (name, own) = (&variable.name, self.unit(variable));
        let known = self.units.iter().find(|unit| unit.name == own).and_then(|unit| unit.base);
        // A variable without a unit is treated as a dimensionless number.
        let plain = BaseUnit { exponents: [0; 8], factor: 1.0, offset: 0.0 };
        let known = if own.is_empty() { Some(plain) } else { known };
        let Some(known) = known else {
            bail!(
                "{name}: {unit} cannot be converted, because the FMU does not define the unit {own} by SI base units"
            )
        };
        ensure!(
            base.exponents == known.exponents,
            "{name}: {unit} cannot be converted to {} (allowed: {})",
            if own.is_empty() { "a number without unit" } else { own },
            self.unit_names(variable)
        );
        let si = base.factor * number + base.offset;
        Ok((si - known.offset) / known.factor)
    }

    pub fn unit_names(&self, variable: &Variable) -> String {
        let own = self.unit(variable);
        let all = self.display_units(variable).iter().map(|shown| shown.name.as_str());
        let all: Vec<&str> = [own].into_iter().chain(all).filter(|unit| !unit.is_empty()).collect();
        if all.is_empty() { "a number without unit".into() } else { all.join(", ") }
    }

    /// Parses the value of a Real: a plain number such as `0.05`, or a number with the variable's
    /// unit or one of its display units, for example `50mm` or `50 mm`, which is converted.
    fn real(&self, variable: &Variable, text: &str) -> Result<f64> {
        if let Ok(number) = text.parse() {
            return Ok(number);
        }
        let name = &variable.name;
        let ends = text.char_indices().map(|(i, _)| i).rev();
        let split = ends.map(|i| text.split_at(i)).find_map(|(number, unit)| {
            let number: f64 = number.trim_end().parse().ok()?;
            number.is_finite().then_some((number, unit.trim_start()))
        });
        let (number, unit) =
            split.with_context(|| format!("{name} expects a number, not \"{text}\""))?;
        let own = self.unit(variable);
        if unit == own {
            return Ok(number);
        }
        let display = self.display_units(variable);
        if let Some(shown) = display.iter().find(|shown| shown.name == unit) {
            return Ok((number - shown.offset) / shown.factor);
        }
        match own.is_empty() && display.is_empty() {
            true => bail!("{name} has no unit; it expects a number, not \"{text}\""),
            false => {
                bail!("{name} has no unit \"{unit}\" (allowed: {})", self.unit_names(variable))
            }
        }
    }

    /// Parses `text` as a value of `variable`, for example `0.05`, `50 mm`, `true`, or the name of
    /// an enumeration item.
    ///
    /// # Errors
    ///
    /// If the text is not a value of the variable's type; the message states the allowed values.
    pub fn value(&self, variable: &Variable, text: &str) -> Result<Value> {
        let name = &variable.name;
        let text = text.trim();
        match variable.kind() {
            Type::Real => self.real(variable, text).map(Value::Real),
            Type::Integer => {
                let (least, most) =
                    variable.c_type.integer_bounds().unwrap_or((i64::MIN, i64::MAX));
                let number = text.parse().ok().filter(|n| (least..=most).contains(n));
                number.map(Value::Integer).with_context(|| match text.parse::<f64>() {
                    Ok(x) if x.fract() == 0.0 => {
                        format!("{name} expects a whole number from {least} to {most}, not {text}")
                    }
                    _ => format!("{name} expects a whole number, not \"{text}\""),
                })
            }
            Type::Boolean => match text {
                "true" | "1" => Ok(Value::Boolean(true)),
                "false" | "0" => Ok(Value::Boolean(false)),
                _ => bail!("{name} expects true or false, not \"{text}\""),
            },
            Type::String => Ok(Value::String(text.into())),
            Type::Binary | Type::Clock => {
                bail!("{name} is of type {:?}, whose values this command cannot set", variable.kind)
            }
            Type::Enumeration => {
                let items = self.items(variable);
                items
                    .iter()
                    .find(|i| i.name == text || i.value.to_string() == text)
                    .map(|item| Value::Integer(item.value))
                    .with_context(|| {
                        let all: Vec<_> =
                            items.iter().map(|i| format!("{} ({})", i.name, i.value)).collect();
                        format!("{name} expects one of {}, not \"{text}\"", all.join(", "))
                    })
            }
        }
    }
}

/// Returns "; did you mean …?" with at most three of `names` that are similar to `wrong`, or an empty text.
///
/// A name without its group, such as `rho` for `fluid.rho`, counts as the most similar.
pub fn did_you_mean<'a>(wrong: &str, names: impl Iterator<Item = &'a str>) -> String {
    let likeness = |name: &str| match name.rsplit_once('.') {
        Some((_, last)) if last.eq_ignore_ascii_case(wrong) => 1.0,
        _ => strsim::jaro_winkler(&wrong.to_lowercase(), &name.to_lowercase()),
    };
    let mut near: Vec<(f64, &str)> =
        names.map(|name| (likeness(name), name)).filter(|(likeness, _)| *likeness > 0.75).collect();
    near.sort_by(|a, b| b.0.total_cmp(&a.0));
    let near: Vec<String> = near.iter().take(3).map(|(_, name)| format!("\"{name}\"")).collect();
    match near.len() {
        0 => String::new(),
        _ => format!("; did you mean {}?", near.join(" or ")),
    }
}
