//! A model's table of variables, and everything that follows from it.
//!
//! A variable exists if and only if it has an entry in the table. The model description, the value references, reading and
//! setting, start values, range checks, saved states and the GUID follow from this entry.

use std::sync::OnceLock;

use crate::call::CType;
use crate::dynamics::Dynamics;
use crate::hash::Hash;
use crate::unit::{self, Unit};
use crate::variable::{Access, Causality, Dimension, Enumeration, Kind, Place, Value, Variable};

#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub struct About {
    /// Name of the FMU, from which modelName, modelIdentifier and the name of the file are made.
    pub model: &'static str,
    pub version: &'static str,
    pub description: &'static str,
    /// Description of the log category for events; "" if the model has no events.
    pub events: &'static str,
    pub event_indicators: usize,
    /// Number of 64-bit words that [`Dynamics::save`] writes for a saved state.
    pub saved_words: usize,
}

/// The variables of a model. The table uses no memory on the heap, so that a host may load and unload the FMU any number of
/// times.
#[derive(Debug)]
#[allow(missing_docs)]
pub struct Table<M: Dynamics> {
    pub about: About,
    pub variables: &'static [Variable<M>],
    pub scalars: &'static [Scalar<M>],
    inputs: Span,
    parameters: Span,
    derivatives: Span,
    guid: OnceLock<[u8; GUID_LENGTH]>,
    tokens: [OnceLock<[u8; GUID_LENGTH]>; 2],
}

/// Form of arrays in the model description that the host has read: in `Scalars` each element of an array is a variable, in
/// `Arrays` the array is one variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[allow(missing_docs)]
pub enum Layout {
    Scalars = 0,
    /// Each entry of the table is one variable, with dimensions if it is an array. The integer parameters that determine the
    /// lengths of arrays are then structural.
    Arrays = 1,
}

#[allow(missing_docs)]
impl Layout {
    pub const ALL: [Layout; 2] = [Layout::Scalars, Layout::Arrays];
}

/// Number of characters of a GUID with its braces.
pub const GUID_LENGTH: usize = 38;

/// Joins parts of a table to one array, at compile time. `N` is the total number of variables.
///
/// # Panics
/// If the parts together do not have `N` variables.
pub const fn join<M: Dynamics, const N: usize>(parts: &[&[Variable<M>]]) -> [Variable<M>; N] {
    let mut all = [parts[0][0]; N];
    let (mut n, mut part) = (0, 0);
    while part < parts.len() {
        let mut i = 0;
        while i < parts[part].len() {
            all[n] = parts[part][i];
            (n, i) = (n + 1, i + 1);
        }
        part += 1;
    }
    assert!(n == N, "N must be the number of variables");
    all
}

/// Range of consecutive scalars in the table: the index of the first scalar, and the index after the last one.
type Span = (usize, usize);

/// Returns the range of all scalars of one `kind`: 'i' stands for inputs, 'p' for parameters, and any other character for
/// derivatives of states. Scalars of one kind must be adjacent in the table.
const fn span<M: Dynamics>(scalars: &[Scalar<M>], kind: char) -> Span {
    let (mut begin, mut end, mut n) = (0, 0, 0);
    while n < scalars.len() {
        let is_one = match kind {
            'i' => matches!(scalars[n].access, Access::Input(_)),
            'p' => matches!(scalars[n].variable.causality, Causality::Parameter),
            _ => matches!(scalars[n].access, Access::Derivative(_)),
        };
        if is_one {
            assert!(
                begin == end || end == n,
                "inputs, parameters and derivatives of states each stand together in the table"
            );
            if begin == end {
                begin = n;
            }
            end = n + 1;
        }
        n += 1;
    }
    (begin, end)
}

/// A scalar of the table: a scalar variable, or one element of an array variable.
#[derive(Debug)]
#[allow(missing_docs)]
pub struct Scalar<M: Dynamics> {
    pub variable: &'static Variable<M>,
    /// Copy of [`Variable::access`]. Like `c_type` and `state`, it is stored in each scalar because every call needs it.
    pub access: Access<M>,
    pub c_type: CType,
    pub state: Option<Place>,
    /// Position among all scalars of the table. The value reference follows from it (see
    /// [`Version`](crate::version::Version)).
    pub index: u32,
    pub element: usize,
    /// Index under which the instance stores the value. For a parameter it is the number of scalar parameters before it in
    /// the table, and for a discrete output the number of discrete outputs before it.
    pub slot: usize,
}

// Derived implementations would require the same traits of M.
impl<M: Dynamics> Clone for Scalar<M> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<M: Dynamics> Copy for Scalar<M> {}

/// Returns the number of scalars that the entries of a table have together.
pub const fn scalar_count<M: Dynamics>(variables: &[Variable<M>]) -> usize {
    let (mut count, mut entry) = (0, 0);
    while entry < variables.len() {
        count += variables[entry].len();
        entry += 1;
    }
    count
}

/// Lists the scalars of a table, at compile time. `N` must be the number that [`scalar_count`] returns.
pub const fn scalars<M: Dynamics, const N: usize>(
    variables: &'static [Variable<M>],
) -> [Scalar<M>; N] {
    let first = Scalar {
        variable: &variables[0],
        access: variables[0].access,
        c_type: variables[0].c_type(),
        state: variables[0].state,
        index: 0,
        element: 0,
        slot: 0,
    };
    let mut scalars = [first; N];
    let (mut n, mut entry, mut slot, mut discrete) = (0, 0, 0, 0);
    while entry < variables.len() {
        let variable = &variables[entry];
        let mut element = 0;
        while element < variable.len() {
            scalars[n] = Scalar {
                variable,
                access: variable.access,
                c_type: variable.c_type(),
                state: variable.state,
                index: n as u32,
                element,
                slot: if is_discrete(variable) { discrete } else { slot },
            };
            n += 1;
            element += 1;
            if matches!(variable.causality, Causality::Parameter) {
                slot += 1;
            } else if is_discrete(variable) {
                discrete += 1;
            }
        }
        entry += 1;
    }
    assert!(n == N, "N must be the result of scalar_count");
    scalars
}

const fn is_discrete<M: Dynamics>(variable: &Variable<M>) -> bool {
    matches!(variable.access, Access::OutputInteger(_) | Access::OutputBoolean(_))
}

#[allow(missing_docs)]
impl<M: Dynamics> Scalar<M> {
    pub fn name(&self) -> String {
        self.variable.element_name(self.element)
    }

    /// Returns the index of the scalar in the model's state vector; `None` if the scalar is not a continuous state.
    #[inline]
    pub fn state(&self) -> Option<usize> {
        self.state.map(|place| place(self.element))
    }

    #[inline]
    pub fn problem(&self, value: Value) -> Option<String> {
        self.variable.problem(self.element, value)
    }

    pub fn start(&self) -> Option<Value> {
        let (mut parameters, mut inputs) = (M::Parameters::default(), M::Inputs::default());
        self.variable.start(&mut parameters, &mut inputs, self.element)
    }

    /// Returns true if `names`, a list of dependencies of this scalar, contains the scalar `other`. A list may contain names
    /// of whole arrays.
    pub(crate) fn names(&self, names: &[&str], other: &Scalar<M>) -> bool {
        let v = other.variable;
        names.iter().any(|name| match name.strip_suffix("[]") {
            Some(array) => array == v.name && self.element == other.element,
            None => {
                *name == v.name
                    || (name.ends_with('.') && v.name.starts_with(name))
                    || (name.ends_with(']') && *name == other.name())
            }
        })
    }
}

#[allow(missing_docs)]
impl<M: Dynamics> Table<M> {
    /// Creates the table of a model from its entries `variables` and their `scalars` (see [`scalars`]).
    pub const fn new(
        about: About,
        variables: &'static [Variable<M>],
        scalars: &'static [Scalar<M>],
    ) -> Self {
        Table {
            about,
            variables,
            scalars,
            inputs: span(scalars, 'i'),
            parameters: span(scalars, 'p'),
            derivatives: span(scalars, 'd'),
            guid: OnceLock::new(),
            tokens: [const { OnceLock::new() }; 2],
        }
    }

    /// Returns the index of the scalar with this name, which is also its value reference in FMI 2.0.
    pub fn find(&self, name: &str) -> Option<u32> {
        self.scalars.iter().position(|s| s.name() == name).map(|n| n as u32)
    }

    /// Returns the GUID: a hash of the FMU's version and of all properties of variables on which a host depends, but not of
    /// their descriptions. A host that passes another GUID has read another model description.
    pub fn guid(&self) -> &str {
        let bytes = self.guid.get_or_init(|| {
            let mut bytes = [0; GUID_LENGTH];
            bytes.copy_from_slice(self.hash().as_bytes());
            bytes
        });
        std::str::from_utf8(bytes).unwrap_or_default()
    }

    /// Returns the instantiationToken of the model description of FMI 3.0, which is a hash like the GUID. Each layout has its
    /// own token, so that the binary recognises which description the host has read.
    pub fn token(&self, layout: Layout) -> &str {
        let bytes = self.tokens[layout as usize].get_or_init(|| {
            let mut bytes = [0; GUID_LENGTH];
            let hash = Hash::new().text(self.guid());
            let hash = hash.text(match layout {
                Layout::Scalars => "FMI 3.0, scalars",
                Layout::Arrays => "FMI 3.0, arrays",
            });
            let following = self.variables.iter().filter(|v| v.follows_inputs);
            let mut hash = following.fold(hash, |h, v| h.text(v.name));
            if layout == Layout::Arrays {
                let shapes = self.variables.iter().filter(|v| !v.shape.is_empty());
                hash = shapes.fold(hash, |h, v| h.text(&format!("{:?}", v.shape)));
            }
            bytes.copy_from_slice(braced(hash).as_bytes());
            bytes
        });
        std::str::from_utf8(bytes).unwrap_or_default()
    }

    /// Returns true if this parameter determines the length of an array. In a description with array variables it is then
    /// structural.
    pub fn is_structural(&self, variable: &Variable<M>) -> bool {
        let sizes =
            |d: &Dimension| matches!(d, Dimension::Sized(name, _) if *name == variable.name);
        self.variables.iter().any(|v| v.shape.iter().any(sizes))
    }

    /// Returns the discrete outputs in the order of the table, which is also the order of [`Scalar::slot`].
    pub fn discrete(&self) -> impl Iterator<Item = &'static Scalar<M>> + use<M> {
        self.scalars.iter().filter(|scalar| is_discrete(scalar.variable))
    }

    pub fn starts(&self) -> Vec<Value> {
        let (mut parameters, mut inputs) = (M::Parameters::default(), M::Inputs::default());
        let start = |s: &Scalar<M>| s.variable.start(&mut parameters, &mut inputs, s.element);
        self.parameters().iter().filter_map(start).collect()
    }

    #[inline]
    pub const fn inputs(&self) -> &'static [Scalar<M>] {
        let (begin, end) = self.inputs;
        self.scalars.split_at(end).0.split_at(begin).1
    }

    #[inline]
    pub const fn parameters(&self) -> &'static [Scalar<M>] {
        let (begin, end) = self.parameters;
        self.scalars.split_at(end).0.split_at(begin).1
    }

    /// Returns the derivatives of the continuous states, in the order in which a host of Model Exchange reads the states and
    /// their nominal values.
    #[inline]
    pub const fn derivatives(&self) -> &'static [Scalar<M>] {
        let (begin, end) = self.derivatives;
        self.scalars.split_at(end).0.split_at(begin).1
    }

    /// Returns the indices of the continuous states in the model's state vector, in the order in which the host reads the
    /// states.
    pub fn places(&self) -> impl ExactSizeIterator<Item = usize> + use<M> {
        self.derivatives().iter().map(|s| match s.access {
            Access::Derivative(place) => place(s.element),
            _ => 0,
        })
    }

    /// Returns the scalar whose value is element `place` of the model's state vector; `None` if there is none.
    pub fn state_at(&self, place: usize) -> Option<&'static Scalar<M>> {
        self.scalars.iter().find(|s| s.state() == Some(place))
    }

    pub fn units(&self) -> impl Iterator<Item = &'static Unit> {
        let used = |unit: &&Unit| {
            self.variables
                .iter()
                .any(|v| matches!(v.kind, Kind::Real(quantity) if quantity.unit == unit.name))
        };
        unit::UNITS.iter().filter(used)
    }

    pub fn enumerations(&self) -> Vec<&'static Enumeration> {
        let mut all: Vec<&'static Enumeration> = Vec::new();
        for v in self.variables {
            if let Kind::Enumeration(of) = v.kind
                && !all.iter().any(|known| known.name == of.name)
            {
                all.push(of);
            }
        }
        all
    }

    fn hash(&self) -> String {
        let (mut parameters, mut inputs) = (M::Parameters::default(), M::Inputs::default());
        let number = |h: Hash, x: Option<f64>| match x {
            Some(x) => h.bytes(&x.to_bits().to_le_bytes()),
            None => h.text("none"),
        };
        let mut hash = Hash::new().text(self.about.model).text(self.about.version);
        hash = hash.bytes(&(self.about.event_indicators as u64).to_le_bytes());
        for v in self.variables {
            let lengths: Vec<_> = v.lengths().collect();
            hash = hash.text(v.name).text(&format!("{:?} {lengths:?}", v.causality));
            hash = hash.bytes(&[u8::from(v.reinit), u8::from(v.tunable)]);
            hash = match v.kind {
                Kind::Real(q) => {
                    let text = hash.text("Real").text(q.unit).text(q.display_unit.unwrap_or(""));
                    [q.min, q.max, q.nominal].into_iter().fold(text, number)
                }
                Kind::Integer { min, max } => hash.text(&format!("Integer {min:?} {max:?}")),
                Kind::Boolean => hash.text("Boolean"),
                Kind::Enumeration(of) => hash.text(of.name),
            };
            for element in 0..v.len() {
                hash = match v.start(&mut parameters, &mut inputs, element) {
                    Some(Value::Real(x)) => number(hash, Some(x)),
                    Some(Value::Integer(n)) => hash.bytes(&n.to_le_bytes()),
                    Some(Value::Boolean(b)) => hash.bytes(&[u8::from(b)]),
                    None => hash.text("computed"),
                };
            }
            hash = hash.text("depends on");
            hash = v.depends_on.iter().fold(hash, |h, name| h.text(name));
            hash = hash.text("initially on");
            hash = v.initial_depends_on.iter().fold(hash, |h, name| h.text(name));
        }
        for of in self.enumerations() {
            hash = of.items.iter().fold(hash.text(of.name), |h, item| h.text(item.name));
        }
        for unit in self.units() {
            hash = hash.text(unit.name).text(&format!("{:?}", unit.base));
            hash = unit
                .display_units
                .iter()
                .fold(hash, |h, (name, factor)| number(h.text(name), Some(*factor)));
        }
        braced(hash)
    }
}

/// Formats a hash as a GUID with braces, the form that FMI 2.0 requires.
fn braced(hash: Hash) -> String {
    let hex = format!("{:032x}", hash.value());
    format!("{{{}-{}-{}-{}-{}}}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;
    use crate::spring::Spring;

    #[test]
    fn value_references_and_names_are_one_to_one() {
        for (n, scalar) in Spring::table().scalars.iter().enumerate() {
            assert_eq!(Spring::table().find(&scalar.name()), Some(n as u32));
        }
    }

    #[test]
    fn the_guid_has_the_right_form_and_does_not_depend_on_descriptions() {
        let guid = Spring::table().guid();
        let dashes: Vec<_> = guid.match_indices('-').map(|(n, _)| n).collect();
        assert_eq!((guid.len(), dashes), (38, vec![9, 14, 19, 24]));
        let of = |variables: &'static [Variable<Spring>]| {
            Table::new(Spring::table().about, variables, &[]).hash()
        };
        let mut other = Spring::table().variables.to_vec();
        assert_eq!(of(other.clone().leak()), guid);
        other[0].description = "Something else";
        assert_eq!(of(other.clone().leak()), guid);
        other[0].depends_on = &[];
        assert_ne!(of(other.leak()), guid);
    }

    #[test]
    fn array_elements_are_named_with_their_indices_in_brackets() {
        let scalar = Spring::table().variables[0];
        let names = |name, lengths: &[usize]| {
            let shape: Vec<_> = lengths.iter().map(|length| Dimension::Fixed(*length)).collect();
            let shape = &*shape.leak();
            let v = Variable { name, shape, ..scalar };
            (v.element_name(0), v.element_name(v.len() - 1), v.pattern())
        };
        let all = |a: &str, b: &str, c: &str| (a.to_string(), b.to_string(), c.to_string());
        assert_eq!(names("a", &[]), all("a", "a", "a"));
        assert_eq!(names("a.b", &[3]), all("a.b[1]", "a.b[3]", "a.b[1..3]"));
        assert_eq!(names("der(a)", &[3]), all("der(a[1])", "der(a[3])", "der(a[1..3])"));
        assert_eq!(
            names("tank[].p", &[4, 3, 3]),
            all("tank[1].p[1,1]", "tank[4].p[3,3]", "tank[1..4].p[1..3,1..3]")
        );
        assert_eq!(names("tank[].m", &[4]), all("tank[1].m", "tank[4].m", "tank[1..4].m"));
    }
}
