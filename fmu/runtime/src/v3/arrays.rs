//! Translation between array variables and scalars, for hosts that have read the model description in which each entry of the
//! table is one variable.
//!
//! An instance only has scalars. In this layout a value reference stands for an array, which is the list of its scalars in
//! row-major order, with the lengths that the structural parameters have at present. An element outside these lengths
//! keeps its start value.

use super::references::{scalar_reference, time_reference, type_of};
use crate::call::CType;
use crate::model::Model;
use crate::table::{Layout, Scalar};
use crate::variable::{Access, Dimension, Value, Variable};

#[derive(Clone, Debug, Default)]
pub struct Arrays {
    /// Value references of the scalars of all array variables, array by array. They are the value references in the layout
    /// of scalars, in which each element of an array is a variable.
    scalars: Vec<u32>,
    ends: Vec<usize>,
    types: Vec<CType>,
    /// For each scalar, the value reference of its array and its position in the array, counted from 1. The position is 0 if
    /// the scalar is outside the present length of the array.
    places: Vec<(u32, usize)>,
    states: Vec<usize>,
}

impl Arrays {
    /// Creates the arrays with the sizes that the `parameters` of an instance give. `parameters` are in the order of the
    /// table.
    pub fn new<M: Model>(parameters: &[Value]) -> Arrays {
        let table = M::table();
        let mut arrays = Arrays::default();
        let mut first = 0;
        for (variable, array) in table.variables.iter().zip(1..) {
            let lengths = lengths(variable, |name| size_of::<M>(parameters, name));
            let mut place = 0;
            for element in 0..variable.len() {
                let scalar = &table.scalars[first + element];
                let is_there = is_within(variable, element, &lengths);
                if is_there {
                    place += 1;
                    arrays.scalars.push(scalar_reference(scalar));
                    if matches!(scalar.access, Access::Derivative(_)) {
                        arrays.states.push(first + element - first_derivative::<M>());
                    }
                }
                arrays.places.push((array, if is_there { place } else { 0 }));
            }
            arrays.ends.push(arrays.scalars.len());
            let is_structural = table.is_structural(variable);
            let c_type = if is_structural { CType::Size } else { type_of(&table.scalars[first]) };
            arrays.types.push(c_type);
            first += variable.len();
        }
        let time = time_reference::<M>();
        arrays.scalars.push(time);
        arrays.ends.push(arrays.scalars.len());
        let indicators = table.about.event_indicators as u32;
        if indicators > 0 {
            arrays.scalars.extend(time + 1..=time + indicators);
            arrays.ends.push(arrays.scalars.len());
        }
        arrays
    }

    /// Returns the scalars of the array variable with this value reference, as value references in the layout of scalars;
    /// `None` if there is no such variable.
    pub fn scalars(&self, reference: u32) -> Option<&[u32]> {
        let n = (reference as usize).checked_sub(1)?;
        let begin = if n == 0 { 0 } else { *self.ends.get(n - 1)? };
        self.scalars.get(begin..*self.ends.get(n)?)
    }

    /// Returns the C type of the variable with this value reference. Time and event indicators, which follow the variables of
    /// the table, are real.
    pub fn c_type(&self, reference: u32) -> CType {
        let n = (reference as usize).wrapping_sub(1);
        self.types.get(n).copied().unwrap_or(CType::Real)
    }

    pub fn len(&self) -> usize {
        self.ends.len()
    }

    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Returns where a scalar is: the value reference of its array, and its position in the array, counted from 1. Returns
    /// `None` if it is outside the present length of the array.
    pub fn place(&self, scalar: u32) -> Option<(u32, usize)> {
        let place = *self.places.get((scalar as usize).checked_sub(1)?)?;
        (place.1 > 0).then_some(place)
    }

    /// Returns the continuous states that exist with the present array sizes, in the order in which the host reads them.
    /// Each is given by its position in the list of all states that exist with the largest sizes.
    pub fn states(&self) -> &[usize] {
        &self.states
    }
}

fn first_derivative<M: Model>() -> usize {
    M::table().derivatives().first().map_or(0, |scalar| scalar.index as usize)
}

fn size_of<M: Model>(parameters: &[Value], name: &str) -> usize {
    let is_it = |scalar: &&Scalar<M>| scalar.variable.name == name;
    let slot = M::table().parameters().iter().find(is_it).map(|scalar| scalar.slot);
    match slot.and_then(|slot| parameters.get(slot)) {
        Some(Value::Integer(n)) => usize::try_from(*n).unwrap_or(0),
        _ => 0,
    }
}

/// Returns the length of each dimension of a variable. `size` returns the value of the structural parameter with a given
/// name.
pub fn lengths<M: Model>(variable: &Variable<M>, size: impl Fn(&str) -> usize) -> Vec<usize> {
    let length = |dimension: &Dimension| match dimension {
        Dimension::Fixed(length) | Dimension::Used(_, length) => *length,
        Dimension::Sized(name, most) => size(name).min(*most),
    };
    variable.shape.iter().map(length).collect()
}

/// Returns true if an element is within the present `lengths` of its array. `element` is its number in row-major order in the
/// array with the largest lengths.
fn is_within<M: Model>(variable: &Variable<M>, element: usize, lengths: &[usize]) -> bool {
    let mut rest = element;
    variable.lengths().zip(lengths).rev().all(|(most, length)| {
        let index = rest % most;
        rest /= most;
        index < *length
    })
}

/// Returns the value reference that an entry of the table has in the layout of arrays.
pub fn reference<M: Model>(variable: &Variable<M>) -> u32 {
    let place = M::table().variables.iter().position(|v| v.name == variable.name);
    place.map_or(0, |place| place as u32 + 1)
}

/// Returns the value reference of the independent variable, the time, which follows the variables of the table. The next
/// value reference belongs to the array of event indicators.
pub fn time<M: Model>() -> u32 {
    M::table().variables.len() as u32 + 1
}

/// Name of the array variable of event indicators, which FMI 3.0 requires in addition to the variables of the table.
pub const INDICATORS: &str = "event_indicator";

pub fn name<M: Model>(reference: u32) -> Option<String> {
    let beyond = reference.checked_sub(time::<M>());
    match beyond {
        None => {
            M::table().variables.get((reference as usize).checked_sub(1)?).map(Variable::array_name)
        }
        Some(0) => Some("time".into()),
        Some(1) if M::table().about.event_indicators > 0 => Some(INDICATORS.into()),
        Some(_) => None,
    }
}

/// Returns the name of a variable for messages, with the present lengths if it is an array, for example `tank.p[1,3,3]`.
pub fn shape<M: Model>(reference: u32, parameters: &[Value]) -> String {
    let name = name::<M>(reference).unwrap_or_default();
    let lengths = match M::table().variables.get((reference as usize).wrapping_sub(1)) {
        Some(variable) => lengths(variable, |name| size_of::<M>(parameters, name)),
        None if name == INDICATORS => vec![M::table().about.event_indicators],
        None => Vec::new(),
    };
    let lengths: Vec<_> = lengths.iter().map(usize::to_string).collect();
    if lengths.is_empty() { name } else { format!("{name}[{}]", lengths.join(",")) }
}

pub fn for_layout<M: Model>(layout: Layout, parameters: &[Value]) -> Option<Box<Arrays>> {
    (layout == Layout::Arrays).then(|| Box::new(Arrays::new::<M>(parameters)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::trays::Trays;

    fn parameters(rows: i32) -> Vec<Value> {
        let mut all = Trays::table().starts();
        all[0] = Value::Integer(rows);
        all
    }

    /// The variables of the test model have the value references 1 to 10: level, square, der(level), q, rows, w, m, k, then
    /// the time and the event indicators.
    #[test]
    fn an_array_has_the_number_of_elements_that_its_size_parameter_gives() {
        let scalars_of_rows = |rows: i32| {
            let arrays = Arrays::new::<Trays>(&parameters(rows));
            let all: Vec<Vec<u32>> =
                (1..=10).map(|n| arrays.scalars(n).unwrap().to_vec()).collect();
            assert_eq!((arrays.len(), arrays.scalars(0), arrays.scalars(11)), (10, None, None));
            assert!(!arrays.is_empty());
            all
        };
        let behind = [vec![24], vec![25], vec![26, 27]];
        let mut expected = vec![vec![1, 2, 3], vec![4], vec![5, 6, 7], vec![8, 9, 10], vec![11]];
        expected.extend([(12..18).collect(), (18..24).collect::<Vec<u32>>()]);
        expected.extend(behind.clone());
        assert_eq!(scalars_of_rows(3), expected);
        let mut expected = vec![vec![1, 2], vec![4], vec![5, 6], vec![8, 9], vec![11]];
        expected.extend([vec![12, 13, 14, 15], vec![18, 19, 21, 22]]);
        expected.extend(behind.clone());
        assert_eq!(scalars_of_rows(2), expected);
        let mut expected = vec![vec![1], vec![4], vec![5], vec![8], vec![11]];
        expected.extend([vec![12, 13], vec![18, 21]]);
        expected.extend(behind);
        assert_eq!(scalars_of_rows(1), expected);
        assert!(Arrays::default().is_empty());
    }

    #[test]
    fn every_scalar_variable_within_the_size_of_its_array_has_an_index() {
        let arrays = Arrays::new::<Trays>(&parameters(2));
        let places = [1, 2, 3, 4, 11, 15, 16, 18, 19, 20, 21, 22, 23, 24].map(|n| arrays.place(n));
        let (level, square, rows, w, m, k) = (1, 2, 5, 6, 7, 8);
        assert_eq!(
            places,
            [
                Some((level, 1)),
                Some((level, 2)),
                None,
                Some((square, 1)),
                Some((rows, 1)),
                Some((w, 4)),
                None,
                Some((m, 1)),
                Some((m, 2)),
                None,
                Some((m, 3)),
                Some((m, 4)),
                None,
                Some((k, 1)),
            ]
        );
        assert_eq!([0, 25].map(|n| arrays.place(n)), [None; 2]);
        assert_eq!(arrays.states(), [0, 1]);
        assert_eq!(Arrays::new::<Trays>(&parameters(3)).states(), [0, 1, 2]);
    }

    #[test]
    fn every_variable_of_fmi_3_has_its_value_reference_name_type_and_shape() {
        let arrays = Arrays::new::<Trays>(&parameters(2));
        let names = ["level", "square", "der(level)", "q", "rows", "w", "m", "k"];
        for (n, (variable, known)) in Trays::table().variables.iter().zip(names).enumerate() {
            let n = n as u32 + 1;
            assert_eq!((reference(variable), name::<Trays>(n).unwrap().as_str()), (n, known));
            let c_type = if known == "rows" { CType::Size } else { CType::Real };
            assert_eq!(arrays.c_type(n), c_type, "{known}");
        }
        let behind = [0, 9, 10, 11].map(name::<Trays>);
        assert_eq!(behind, [None, Some("time".into()), Some("event_indicator".into()), None]);
        assert_eq!([0, 9, 10].map(|n| arrays.c_type(n)), [CType::Real; 3]);
        assert_eq!(time::<Trays>(), 9);
        let shapes = [1, 2, 5, 6, 7, 9, 10].map(|n| shape::<Trays>(n, &parameters(2)));
        let expected =
            ["level[2]", "square", "rows", "w[2,2]", "m[2,2]", "time", "event_indicator[2]"];
        assert_eq!(shapes, expected);
        assert_eq!(shape::<Trays>(6, &parameters(1)), "w[1,2]");
        assert_eq!(
            name::<crate::spring::Spring>(13),
            None,
            "without indicators nothing is behind time"
        );
        assert!(for_layout::<Trays>(Layout::Scalars, &parameters(2)).is_none());
        assert!(for_layout::<Trays>(Layout::Arrays, &parameters(2)).is_some());
    }
}
