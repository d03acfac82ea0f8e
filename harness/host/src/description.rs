//! Model description: `modelDescription.xml` (FMI 2.0, section 2.2; FMI 3.0, section 2.4), as far as
//! a host needs it to drive the FMU.
//!
//! Both versions are read into the same: what FMI 3.0 calls Float64 is a Real here, its instantiationToken a
//! GUID, an alias a variable with the same reference. An array is read as its elements, `x[1,2]`, each a
//! variable, as FMI 2.0 would have it; [`ModelDescription::element`] says where they are.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail, ensure};

use crate::archive::Archive;
use crate::causality::{Causality, Variability};
use crate::xml::Element;

/// The root element `fmiModelDescription`.
#[derive(Clone, Debug)]
pub struct ModelDescription {
    /// FMI version, "2.0" or "3.0" and its like.
    pub fmi_version: String,
    /// Name of the model.
    pub model_name: String,
    /// Fingerprint that XML and binary must share; the instantiationToken of FMI 3.0.
    pub guid: String,
    /// Version of the model; empty if none is given.
    pub version: String,
    /// One sentence on the model; empty if there is none.
    pub description: String,
    /// The tool that wrote the FMU; empty if none is given.
    pub generation_tool: String,
    /// Present if the FMU brings its own solver.
    pub co_simulation: Option<Interface>,
    /// Present if the host may integrate.
    pub model_exchange: Option<Interface>,
    /// Units that variables name.
    pub units: Vec<Unit>,
    /// Named types.
    pub types: Vec<SimpleType>,
    /// Start, stop, tolerance and step the author suggests.
    pub default_experiment: DefaultExperiment,
    /// The variables, in the order of the file; the elements of an array one after the other, by rows.
    pub variables: Vec<Variable>,
    /// Value references of the derivatives of the continuous states, each with that of its state.
    pub derivatives: Vec<(u32, u32)>,
    /// Continuous states and event indicators, as an FMU 2.0 declares them.
    pub(crate) sizes: (usize, usize),
    arrays: BTreeMap<u32, Array>,
    elements: BTreeMap<u32, ArrayElement>,
}

/// An array of FMI 3.0.
#[derive(Clone, Debug)]
pub struct Array {
    /// Number of elements.
    pub length: usize,
    /// Type of its elements.
    pub c_type: CType,
    /// Their start values, as written: none, one for all, or one for each.
    pub start: Vec<String>,
    /// True if its start values are for another size.
    pub(crate) is_resized: bool,
}

/// Position of an element of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArrayElement {
    /// Value reference of the array.
    pub array: u32,
    /// Place, counted from 0, by rows.
    pub index: usize,
}

/// Element `CoSimulation` or `ModelExchange`.
#[derive(Clone, Debug)]
pub struct Interface {
    /// Name of the binary, without the platform's ending.
    pub model_identifier: String,
    /// True if Co-Simulation takes derivatives of inputs (FMI 2.0), or new values of inputs within a step (FMI 3.0).
    pub can_interpolate_inputs: bool,
    /// True if there are directional derivatives.
    pub directional_derivatives: bool,
}

/// Element `DefaultExperiment`; times in s.
#[derive(Clone, Debug, Default)]
pub struct DefaultExperiment {
    /// Start time, s.
    pub start_time: Option<f64>,
    /// Stop time, s.
    pub stop_time: Option<f64>,
    /// Relative tolerance of the FMU's solver.
    pub tolerance: Option<f64>,
    /// Communication step, s.
    pub step_size: Option<f64>,
}

/// Element `Unit`: a unit in which values are exchanged, and those in which people give and read them.
#[derive(Clone, Debug)]
pub struct Unit {
    /// Name used by variables as `unit`.
    pub name: String,
    /// Elements `DisplayUnit`.
    pub display: Vec<DisplayUnit>,
    /// Element `BaseUnit`: what it is in SI.
    pub base: Option<BaseUnit>,
}

/// Element `BaseUnit` of FMI and SSP: a value in SI is `factor` times the number, plus `offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseUnit {
    /// Exponents of [`BaseUnit::NAMES`].
    pub exponents: [i32; 8],
    /// Factor of the number.
    pub factor: f64,
    /// Offset, added after the factor.
    pub offset: f64,
}

impl BaseUnit {
    /// The base units of SI that FMI and SSP have, and rad.
    pub const NAMES: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

    /// The one in an element `Unit`; `None` if the element has none, or one that is not of numbers.
    pub fn of(unit: &Element) -> Option<BaseUnit> {
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

/// Element `DisplayUnit`: a number in it is `factor` times the value, plus `offset`.
#[derive(Clone, Debug)]
pub struct DisplayUnit {
    /// Name.
    pub name: String,
    /// Factor on the value.
    pub factor: f64,
    /// Offset, added after the factor.
    pub offset: f64,
}

/// Element `SimpleType`.
#[derive(Clone, Debug)]
pub struct SimpleType {
    /// Name used by variables as `declaredType`.
    pub name: String,
    /// Unit of variables of this type that name none.
    pub unit: Option<String>,
    /// The values it can take, if it is an enumeration.
    pub items: Vec<Item>,
}

/// One value of an enumeration.
#[derive(Clone, Debug)]
pub struct Item {
    /// Name.
    pub name: String,
    /// Number.
    pub value: i64,
}

/// Element `ScalarVariable`, in FMI 3.0 one of its type's name.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Name, unique in the FMU.
    pub name: String,
    /// Number by which calls refer to it (within its type); of an element of an array one of this host's own, that no
    /// other variable has.
    pub reference: u32,
    /// Role.
    pub causality: Causality,
    /// When its value can change; `Other` with an empty text if it is not given.
    pub variability: Variability,
    /// Description; empty if there is none.
    pub description: String,
    /// FMI 3.0: true if it may be set or read within a step.
    pub intermediate: bool,
    c_type: CType,
    kind: Type,
    attributes: Attributes,
}

/// Attributes of the typed child of a `ScalarVariable`.
#[derive(Clone, Debug, Default)]
pub struct Attributes {
    /// Start value, as written.
    pub start: Option<String>,
    /// Unit in which values are exchanged.
    pub unit: Option<String>,
    /// Unit in which a person likes to read it.
    pub display_unit: Option<String>,
    /// Smallest value, as written.
    pub min: Option<String>,
    /// Largest value, as written.
    pub max: Option<String>,
    /// Name of the `SimpleType`.
    pub declared_type: Option<String>,
}

/// Type of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// 64-bit real.
    Real,
    /// 32-bit integer.
    Integer,
    /// True or false.
    Boolean,
    /// Text.
    String,
    /// An integer with named values.
    Enumeration,
    /// Bytes; this host does not exchange them.
    Binary,
    /// An instant; this host does not exchange them.
    Clock,
}

/// Type in which calls exchange a variable, by the names of FMI 3.0. A Real of FMI 2.0 is a Float64, an Integer an Int32.
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
    /// C type and displayed type of an element of FMI 3.0.
    pub fn of_element(name: &str) -> Option<(CType, Type)> {
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

    /// The whole numbers that it has, if it has no others.
    fn whole(self) -> Option<(i64, i64)> {
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

/// A value of a variable.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Value of a Real.
    Real(f64),
    /// Value of an Integer or an Enumeration.
    Integer(i64),
    /// Value of a Boolean.
    Boolean(bool),
    /// Value of a String.
    String(String),
}

impl Value {
    /// Returns the value as tables have it: Booleans as 0 and 1, NaN for a text.
    pub fn number(&self) -> f64 {
        match self {
            Value::Real(x) => *x,
            Value::Integer(n) => *n as f64,
            Value::Boolean(yes) => f64::from(u8::from(*yes)),
            Value::String(_) => f64::NAN,
        }
    }

    /// Returns the value in the form of a description.
    fn text(&self) -> String {
        match self {
            Value::Real(x) => x.to_string(),
            Value::Integer(n) => n.to_string(),
            Value::Boolean(yes) => yes.to_string(),
            Value::String(text) => text.clone(),
        }
    }
}

impl Variable {
    /// Returns the type.
    pub fn kind(&self) -> Type {
        self.kind
    }

    /// Returns the type in which calls exchange the variable.
    pub fn c_type(&self) -> CType {
        self.c_type
    }

    /// Returns true for a structural parameter of FMI 3.0, which is set in configuration mode alone.
    pub fn is_structural(&self) -> bool {
        self.causality == Causality::StructuralParameter
    }

    /// Start, unit, bounds.
    pub fn attributes(&self) -> &Attributes {
        &self.attributes
    }
}

/// A text in quotes, or its beginning and its length.
fn short(text: &str) -> String {
    match text.char_indices().nth(60) {
        None => format!("\"{text}\""),
        Some((at, _)) => format!("\"{}…\", {} bytes long", &text[..at], text.len()),
    }
}

/// Reads elements and keeps all that is wrong with them.
#[derive(Default)]
struct Reader {
    is_fmi3: bool,
    problems: Vec<String>,
    more: usize,
}

impl Reader {
    /// Adds a problem; only the first ones are kept.
    fn problem(&mut self, element: &Element, what: &str) {
        match self.problems.len() < NAMED {
            true => {
                self.problems.push(format!("line {}, {}: {what}", element.line, element.name));
            }
            false => self.more += 1,
        }
    }

    /// An attribute that must be there and that `read` understands.
    fn must<T: Default>(
        &mut self,
        element: &Element,
        attribute: &str,
        read: impl Fn(&str) -> Option<T>,
    ) -> T {
        let text = element.get(attribute);
        text.and_then(read).unwrap_or_else(|| {
            let why = text.map_or("is missing".into(), |text| format!("cannot be {}", short(text)));
            self.problem(element, &format!("{attribute} {why}"));
            T::default()
        })
    }

    fn text(&mut self, element: &Element, attribute: &str) -> String {
        self.must(element, attribute, |text| Some(text.to_string()))
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
        let base = BaseUnit::of(element);
        Unit { display: display.collect(), name: self.text(element, "name"), base }
    }

    fn item(&mut self, element: &Element) -> Item {
        // of 32 bits in FMI 2.0, of 64 in FMI 3.0
        let is_fmi3 = self.is_fmi3;
        let fits = |n: &i64| is_fmi3 || i32::try_from(*n).is_ok();
        let value = self.must(element, "value", |text| text.trim().parse().ok().filter(fits));
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
        const TYPES: [(&str, Type); 5] = [
            ("Real", Type::Real),
            ("Integer", Type::Integer),
            ("Boolean", Type::Boolean),
            ("String", Type::String),
            ("Enumeration", Type::Enumeration),
        ];
        let typed = TYPES.iter().find_map(|(name, kind)| Some((*kind, element.child(name)?)));
        if typed.is_none() {
            self.problem(element, "it has no type");
        }
        let (kind, typed) = typed.map_or((Type::Real, None), |(kind, typed)| (kind, Some(typed)));
        let c_type = match kind {
            Type::Integer | Type::Enumeration => CType::Int32,
            Type::Boolean => CType::Boolean,
            Type::String => CType::String,
            _ => CType::Float64,
        };
        let start = typed.and_then(|typed| typed.get("start")).map(String::from);
        Variable {
            variability: element.get("variability").unwrap_or_default().into(),
            intermediate: false,
            ..self.common(element, typed, (c_type, kind), start)
        }
    }

    /// Reads what both versions say of a variable alike. `typed` has the attributes that depend on the type.
    fn common(
        &mut self,
        element: &Element,
        typed: Option<&Element>,
        (c_type, kind): (CType, Type),
        start: Option<String>,
    ) -> Variable {
        let of = |name: &str| typed.and_then(|typed| typed.get(name)).map(String::from);
        Variable {
            name: self.must(element, "name", |n| (n.len() <= LONGEST_NAME).then(|| n.into())),
            reference: self.must(element, "valueReference", |text| text.trim().parse().ok()),
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

    /// A variable of FMI 3.0 and its aliases; all its elements if it is an array. Structural parameters that are `set`, by
    /// their references, have other values than those that are written.
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
            let Some((c_type, kind)) = CType::of_element(&element.name) else {
                self.problem(element, "there is no such type");
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
                    &format!("with it the arrays have more than {MOST_ELEMENTS} elements together"),
                );
                continue;
            };
            for index in 0..length {
                let Some(own) = next else {
                    self.problem(element, "no value references are left for its elements");
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

    /// A variable of FMI 3.0 as it is written, and its start values.
    fn variable3(
        &mut self,
        element: &Element,
        c_type: CType,
        kind: Type,
    ) -> (Variable, Vec<String>) {
        let starts: Vec<String> = match c_type {
            CType::String | CType::Binary => {
                let starts = element.children.iter().filter(|child| child.name == "Start");
                starts.map(|start| start.get("value").unwrap_or_default().into()).collect()
            }
            _ => {
                let words = element.get("start").into_iter().flat_map(str::split_whitespace);
                words.map(String::from).collect()
            }
        };
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

    /// Sizes of an array, those by structural parameters from `sizes`; none of a scalar.
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
                None => self.problem(dimension, "its size is not known"),
            }
        }
        dimensions
    }

    /// A variable by its other names; it is set and recorded by its first one.
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

/// Value references of the derivatives in the model structure, each with that of its state: FMI 2.0 names variables by
/// their places, FMI 3.0 by their references.
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

/// Indices from 1, with commas between, of an element counted from 0, by rows.
fn indices(mut index: usize, dimensions: &[usize]) -> String {
    let mut all = Vec::new();
    for size in dimensions.iter().rev() {
        all.push((index % size + 1).to_string());
        index /= size;
    }
    all.reverse();
    all.join(",")
}

/// Bytes that the name of a variable may have.
const LONGEST_NAME: usize = 1024;
/// Types that a description may have, and items of one: what a variable is declared as is looked up
/// among all of them.
const MOST_TYPES: usize = 5000;
/// Elements that all arrays of an FMU may have together.
const MOST_ELEMENTS: usize = 100_000;
/// Largest number of missing items that a message names.
const NAMED: usize = 20;

impl ModelDescription {
    /// Reads the description of a packed FMU; nothing is unpacked or loaded.
    pub fn of_packed(path: &Path) -> Result<Self> {
        let name = path.display();
        let text = Archive::open(path)?.description();
        let text = text.with_context(|| format!("{name} is not an FMU"))?;
        let description = ModelDescription::from_xml(&text);
        let description = description.with_context(|| format!("{name} cannot be used"))?;
        description.check_version().with_context(|| format!("{name} cannot be used"))?;
        Ok(description)
    }

    /// Fails unless it is of FMI 2.0 or 3.
    pub fn check_version(&self) -> Result<()> {
        let version = short(&self.fmi_version).replace('"', "");
        ensure!(
            self.fmi_version == "2.0" || self.is_fmi3(),
            "it is of FMI version {version}; this host drives 2.0 and 3.0"
        );
        Ok(())
    }

    /// Returns true for FMI 3.
    pub fn is_fmi3(&self) -> bool {
        self.fmi_version.starts_with("3.")
    }

    /// Position of an array element by its variable's reference; `None` for a variable that is not an element.
    pub fn element(&self, reference: u32) -> Option<ArrayElement> {
        self.elements.get(&reference).copied()
    }

    /// The array of that value reference.
    pub fn array(&self, reference: u32) -> Option<&Array> {
        self.arrays.get(&reference)
    }

    /// The arrays with their value references.
    pub(crate) fn arrays(&self) -> impl Iterator<Item = (u32, &Array)> {
        self.arrays.iter().map(|(reference, array)| (*reference, array))
    }

    /// Start values of an array, one for each element.
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

    /// Reads the XML text.
    ///
    /// # Errors
    /// If it is not well-formed, of FMI 1, or without what a host needs; what is missing is named.
    pub fn from_xml(text: &str) -> Result<Self> {
        ModelDescription::from_xml_with(text, &BTreeMap::new())
    }

    /// The same, where structural parameters have these values, by their references: arrays have the sizes that follow. The
    /// start values of those that are longer or shorter than declared mean nothing (FMI 3.0.2, section 2.4.7.2).
    pub(crate) fn from_xml_with(text: &str, set: &BTreeMap<u32, Value>) -> Result<Self> {
        let root = Element::parse(text.as_bytes())
            .map_err(|why| anyhow!("modelDescription.xml, line and column {why}"))?;
        ModelDescription::from_element(&root, set)
    }

    /// The same from the parsed file.
    pub(crate) fn from_element(root: &Element, set: &BTreeMap<u32, Value>) -> Result<Self> {
        // what other versions have is not missing here
        let version = root.get("fmiVersion").unwrap_or("2.0");
        let is_fmi3 = version.starts_with("3.");
        if !is_fmi3 && !version.starts_with("2.") {
            let version = short(version).replace('"', "");
            bail!("it is of FMI version {version}; this host drives 2.0 and 3.0");
        }
        let mut reader = Reader { is_fmi3, ..Reader::default() };
        for list in root.children.iter().filter(|child| child.name == "TypeDefinitions") {
            let enumerations = list.children.iter().flat_map(|simple| &simple.children);
            let counts = enumerations.map(|of| of.children.len()).chain([list.children.len()]);
            let counts = counts.chain(list.children.iter().map(|of| of.children.len()));
            if let Some(count) = counts.max().filter(|count| *count > MOST_TYPES) {
                bail!(
                    "modelDescription.xml: {count} types, or items of one (allowed: {MOST_TYPES})"
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

    /// The variable of that name; if there is none, the error names those that look alike.
    pub fn variable(&self, name: &str) -> Result<&Variable> {
        self.variables.iter().find(|v| v.name == name).with_context(|| {
            let names = self.variables.iter().map(|v| v.name.as_str());
            format!("the FMU has no variable \"{name}\"{}", did_you_mean(name, names))
        })
    }

    /// The values an enumeration variable can take.
    pub fn items(&self, variable: &Variable) -> &[Item] {
        let declared = variable.attributes().declared_type.as_deref();
        let named = self.types.iter().find(|t| Some(t.name.as_str()) == declared);
        named.map_or(&[], |t| &t.items)
    }

    /// The unit in which a variable is exchanged; empty if it has none.
    pub fn unit<'a>(&'a self, variable: &'a Variable) -> &'a str {
        let declared = variable.attributes.declared_type.as_ref();
        let declared = || self.types.iter().find(|t| Some(&t.name) == declared)?.unit.as_ref();
        variable.attributes.unit.as_ref().or_else(declared).map_or("", String::as_str)
    }

    /// The units in which people may give a variable, in addition to its own.
    pub fn display_units(&self, variable: &Variable) -> &[DisplayUnit] {
        let own = self.unit(variable);
        let defined = self.units.iter().find(|unit| unit.name == own);
        defined.map_or(&[], |unit| &unit.display)
    }

    /// A number of a Real in a unit that is defined by its base units, in the variable's own unit.
    ///
    /// # Errors
    /// If the two units are not of one quantity, or the FMU does not define its own.
    pub fn converted(
        &self,
        variable: &Variable,
        number: f64,
        unit: &str,
        base: &BaseUnit,
    ) -> Result<f64> {
        let (name, own) = (&variable.name, self.unit(variable));
        let known = self.units.iter().find(|unit| unit.name == own).and_then(|unit| unit.base);
        // a variable without a unit is a plain number
        let plain = BaseUnit { exponents: [0; 8], factor: 1.0, offset: 0.0 };
        let known = if own.is_empty() { Some(plain) } else { known };
        let Some(known) = known else {
            bail!("{name}: {unit} cannot be converted, the FMU does not define {own} by base units")
        };
        ensure!(
            base.exponents == known.exponents,
            "{name}: {unit} cannot be converted to {} (allowed: {})",
            if own.is_empty() { "a number without unit" } else { own },
            self.units_of(variable)
        );
        let si = base.factor * number + base.offset;
        Ok((si - known.offset) / known.factor)
    }

    /// The units in which a variable may be given, by name.
    pub fn units_of(&self, variable: &Variable) -> String {
        let own = self.unit(variable);
        let all = self.display_units(variable).iter().map(|shown| shown.name.as_str());
        let all: Vec<&str> = [own].into_iter().chain(all).filter(|unit| !unit.is_empty()).collect();
        if all.is_empty() { "a number without unit".into() } else { all.join(", ") }
    }

    /// A number of a Real: `0.05`, or with its own unit or one of its display units, `50mm`, `50 mm`.
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
            false => bail!("{name} has no unit \"{unit}\" (allowed: {})", self.units_of(variable)),
        }
    }

    /// Reads a value of a variable from text; of a Real with or without a unit.
    ///
    /// # Errors
    /// If it is not of the variable's type; the error says what is allowed.
    pub fn value(&self, variable: &Variable, text: &str) -> Result<Value> {
        let name = &variable.name;
        let text = text.trim();
        match variable.kind() {
            Type::Real => self.real(variable, text).map(Value::Real),
            Type::Integer => {
                let (least, most) = variable.c_type.whole().unwrap_or((i64::MIN, i64::MAX));
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
                bail!("{name} is a {:?}, of which this host exchanges no values", variable.kind)
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

/// "; did you mean …?" with the (at most three) likeliest of `names`, or nothing.
pub fn did_you_mean<'a>(wrong: &str, names: impl Iterator<Item = &'a str>) -> String {
    let mut near: Vec<(f64, &str)> = names
        .map(|name| (strsim::jaro_winkler(&wrong.to_lowercase(), &name.to_lowercase()), name))
        .filter(|(likeness, _)| *likeness > 0.75)
        .collect();
    near.sort_by(|a, b| b.0.total_cmp(&a.0));
    let near: Vec<String> = near.iter().take(3).map(|(_, name)| format!("\"{name}\"")).collect();
    match near.len() {
        0 => String::new(),
        _ => format!("; did you mean {}?", near.join(" or ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const XML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="M" guid="{1}" version="0.1" numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="M" canHandleVariableCommunicationStepSize="true">
    <SourceFiles><File name="a.c"/></SourceFiles>
  </CoSimulation>
  <UnitDefinitions><Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.3"/></Unit></UnitDefinitions>
  <TypeDefinitions><SimpleType name="Model"><Enumeration><Item name="frozen" value="1"/><Item name="linear" value="2"/></Enumeration></SimpleType></TypeDefinitions>
  <LogCategories><Category name="logAll"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="10.5" tolerance="1e-6"/>
  <ModelVariables>
    <!-- a comment -->
    <ScalarVariable name="omega" valueReference="3" causality="output" variability="continuous" initial="calculated"><Real unit="rad/s"/></ScalarVariable>
    <ScalarVariable name="slosh.model" valueReference="4" causality="parameter" variability="fixed" initial="exact"><Enumeration declaredType="Model" start="2"/></ScalarVariable>
    <ScalarVariable name="wheel.enabled" valueReference="5" causality="parameter" variability="fixed"><Boolean start="false"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="1" dependencies=""/></Outputs></ModelStructure>
</fmiModelDescription>"#;

    #[test]
    fn names_types_and_enumerations_are_read() {
        let d = ModelDescription::from_xml(XML).unwrap();
        assert_eq!(d.co_simulation.as_ref().unwrap().model_identifier, "M");
        assert_eq!(d.default_experiment.stop_time, Some(10.5));
        let model = d.variable("slosh.model").unwrap();
        assert_eq!((model.kind(), model.reference), (Type::Enumeration, 4));
        assert_eq!(d.items(model)[1].name, "linear");
        assert_eq!(d.variable("omega").unwrap().attributes().unit.as_deref(), Some("rad/s"));
        assert_eq!(d.variable("wheel.enabled").unwrap().kind(), Type::Boolean);
    }

    #[test]
    fn a_number_may_have_the_variable_s_own_unit_or_a_display_unit() {
        let with_angle = XML.replace(
            "<ScalarVariable name=\"wheel.enabled\"",
            "<ScalarVariable name=\"angle\" valueReference=\"9\" causality=\"parameter\" variability=\"fixed\">\
             <Real unit=\"rad\" start=\"0\"/></ScalarVariable><ScalarVariable name=\"wheel.enabled\"",
        );
        let d = ModelDescription::from_xml(&with_angle).unwrap();
        let angle = d.variable("angle").unwrap();
        for (text, value) in [
            ("5e-1", 0.5),
            ("0.5rad", 0.5),
            (" -5E-1 rad ", -0.5),
            ("573deg", 573.0 / 57.3),
            ("+573 deg", 573.0 / 57.3),
        ] {
            assert_eq!(d.value(angle, text).unwrap(), Value::Real(value), "{text}");
        }
        for (text, why) in [
            ("5 mm", "angle has no unit \"mm\" (allowed: rad, deg)"),
            ("5 deg deg", "angle has no unit \"deg deg\" (allowed: rad, deg)"),
            ("deg", "angle expects a number, not \"deg\""),
            ("", "angle expects a number, not \"\""),
            ("µ5", "angle expects a number, not \"µ5\""),
        ] {
            assert_eq!(d.value(angle, text).unwrap_err().to_string(), why);
        }
        let omega = d.variable("omega").unwrap();
        let why = d.value(omega, "5 rpm").unwrap_err().to_string();
        assert_eq!(why, "omega has no unit \"rpm\" (allowed: rad/s)");
    }

    #[test]
    fn all_that_is_missing_is_named_with_its_line() {
        let broken = XML
            .replace(" guid=\"{1}\"", "")
            .replace("valueReference=\"3\"", "valueReference=\"x\"");
        let error = ModelDescription::from_xml(&broken).unwrap_err().to_string();
        for words in
            ["line 2, fmiModelDescription: guid is missing", "valueReference cannot be \"x\""]
        {
            assert!(error.contains(words), "{words}: {error}");
        }
    }

    const XML3: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="M" instantiationToken="{2}">
  <CoSimulation modelIdentifier="M" providesIntermediateUpdate="true"/>
  <UnitDefinitions><Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.3"/></Unit></UnitDefinitions>
  <TypeDefinitions><Float64Type name="Angle" unit="rad"/><EnumerationType name="Model"><Item name="frozen" value="1"/><Item name="linear" value="2"/></EnumerationType></TypeDefinitions>
  <ModelVariables>
    <UInt64 name="n" valueReference="7" causality="structuralParameter" start="2"/>
    <Float64 name="a" valueReference="2" causality="input" declaredType="Angle" start="1 2 3 4 5 6" intermediateUpdate="true"><Dimension start="3"/><Dimension valueReference="7"/></Float64>
    <Float64 name="y" valueReference="3" causality="output"><Alias name="z" displayUnit="deg"/></Float64>
    <Enumeration name="model" valueReference="4" causality="parameter" declaredType="Model" start="2"/>
    <UInt8 name="small" valueReference="5" causality="parameter" start="2"/>
    <String name="text" valueReference="6" causality="parameter"><Start value="one word"/></String>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>"#;

    #[test]
    fn arrays_of_fmi_3_are_read_as_their_elements_by_rows() {
        let d = ModelDescription::from_xml(XML3).unwrap();
        let elements = d.variables.iter().filter(|v| v.causality == Causality::Input);
        let elements: Vec<_> =
            elements.map(|v| (v.name.as_str(), v.attributes().start.as_deref().unwrap())).collect();
        let all = [("a[1,1]", "1"), ("a[1,2]", "2"), ("a[2,1]", "3"), ("a[2,2]", "4")];
        assert_eq!(elements[..4], all);
        let last = d.variable("a[3,2]").unwrap();
        assert_eq!(d.element(last.reference), Some(ArrayElement { array: 2, index: 5 }));
        assert!(!d.variables.iter().any(|v| v.name != "a[3,2]" && v.reference == last.reference));
        assert_eq!(d.array(2).unwrap().length, 6);
        assert_eq!((d.unit(last), last.intermediate), ("rad", true));
    }

    #[test]
    fn arrays_have_the_size_that_a_structural_parameter_is_set_to_and_no_start_values_then() {
        let set = BTreeMap::from([(7, Value::Integer(3))]);
        let mut d = ModelDescription::from_xml_with(XML3, &set).unwrap();
        assert_eq!(d.variable("n").unwrap().attributes().start.as_deref(), Some("3"));
        let last = d.variable("a[3,3]").unwrap();
        assert_eq!(d.element(last.reference), Some(ArrayElement { array: 2, index: 8 }));
        assert_eq!(d.array(2).unwrap().length, 9);
        assert_eq!(last.attributes().start, None, "those that are declared mean nothing now");
        let values: Vec<_> = (0..9).map(|n| Value::Real(f64::from(n) / 8.0)).collect();
        d.set_starts(2, &values);
        let start = |name: &str| d.variable(name).unwrap().attributes().start.clone();
        assert_eq!((start("a[1,2]"), start("a[3,3]")), (Some("0.125".into()), Some("1".into())));
        assert_eq!(start("y"), None);
    }

    #[test]
    fn an_alias_of_fmi_3_is_the_same_value_by_another_name_and_no_second_output() {
        let d = ModelDescription::from_xml(XML3).unwrap();
        let (y, z) = (d.variable("y").unwrap(), d.variable("z").unwrap());
        assert_eq!((y.reference, &y.causality), (z.reference, &Causality::Output));
        let displayed = z.attributes().display_unit.as_deref();
        assert_eq!((&z.causality, displayed), (&Causality::Local, Some("deg")));
    }

    #[test]
    fn a_whole_number_of_fmi_3_must_fit_its_type() {
        let d = ModelDescription::from_xml(XML3).unwrap();
        let small = d.variable("small").unwrap();
        assert_eq!(d.value(small, "255").unwrap(), Value::Integer(255));
        let why = d.value(small, "256").unwrap_err().to_string();
        assert_eq!(why, "small expects a whole number from 0 to 255, not 256");
        assert_eq!(d.value(d.variable("model").unwrap(), "frozen").unwrap(), Value::Integer(1));
        assert_eq!(d.variable("text").unwrap().attributes().start.as_deref(), Some("one word"));
        assert_eq!(d.variable("n").unwrap().variability, Variability::Fixed);
    }

    #[test]
    fn a_misspelt_name_brings_suggestions() {
        let d = ModelDescription::from_xml(XML).unwrap();
        let error = d.variable("slosh.modle").unwrap_err().to_string();
        assert!(error.contains("did you mean \"slosh.model\""), "{error}");
    }
}
