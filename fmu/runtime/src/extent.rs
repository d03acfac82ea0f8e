//! Reduced model descriptions, which contain the variables of only some of the tanks and modes. They are for hosts that show
//! every variable to the user. The binary of the FMU is the same as with the full model description.
//!
//! The GUID (in FMI 3.0 the instantiationToken) of a reduced description equals that of the full description except for the
//! last nine hexadecimal digits. From these digits the binary learns which states and event indicators the host knows:
//!
//! ```text
//! {........-....-....-....-...tmasscccc}   t, m, a  largest values of the parameters in `Table::sizes`, 0 if there are fewer
//!                                          ss       number of continuous states
//!                                          cccc     checksum of resources/start_values.txt, 0000 without the file
//! ```
//!
//! The file resources/start_values.txt contains the start values that differ from those in the table of variables, one line
//! `name = value` each, in the order of the table.

use std::path::Path;

use crate::hash::Hash;
use crate::model::Model;
use crate::table::{GUID_LENGTH, Scalar, Table};
use crate::variable::{Access, Causality, Dimension, Value};

pub const START_VALUES: &str = "start_values.txt";

const DIGITS: usize = SIZES + 6;

const SIZES: usize = 3;

/// The part of the table of variables that a reduced model description contains.
#[derive(Clone, Debug, PartialEq)]
pub struct Extent {
    token: String,
    sizes: Vec<(&'static str, usize)>,
    places: Vec<usize>,
    indicators: usize,
    starts: Vec<Value>,
    inputs: Vec<(usize, f64)>,
}

impl Extent {
    /// Returns the extent of a reduced model description, with the start values of the table. `token` is the GUID or
    /// instantiationToken that the host passes, and `whole` the GUID or instantiationToken of the full description. Returns
    /// `None` if `token` does not belong to a reduced description of this table.
    pub fn from_token<M: Model>(token: &str, whole: &str) -> Option<Extent> {
        let kept = GUID_LENGTH - 1 - DIGITS;
        if token.len() != GUID_LENGTH || !token.is_ascii() || token[..kept] != whole[..kept] {
            return None;
        }
        let digits = token[kept..].strip_suffix('}')?;
        let table = M::table();
        if table.sizes().is_empty() {
            return None;
        }
        let mut sizes = Vec::new();
        let mut given = digits[..SIZES].chars().map(|digit| digit.to_digit(16));
        for (name, most) in table.sizes() {
            let size = given.next()?? as usize;
            sizes.push((name, size));
            if size > most {
                return None;
            }
        }
        if given.any(|rest| rest != Some(0)) {
            return None;
        }
        let within = |scalar: &Scalar<M>| scalar.is_within(&sizes);
        let kept_states = table.derivatives().iter().zip(table.places());
        let places: Vec<usize> =
            kept_states.filter(|(scalar, _)| within(scalar)).map(|(_, place)| place).collect();
        if usize::from_str_radix(&digits[SIZES..SIZES + 2], 16) != Ok(places.len()) {
            return None;
        }
        let indicators = share(table, M::INDICATORS_OF, &sizes);
        let mut starts = table.starts();
        for scalar in table.parameters() {
            let size = sizes.iter().find(|(name, _)| *name == scalar.variable.name);
            if let (Some((_, size)), Value::Integer(start)) = (size, &mut starts[scalar.slot]) {
                *start = (*start).min(*size as i32);
            }
        }
        Some(Extent { token: token.into(), sizes, places, indicators, starts, inputs: Vec::new() })
    }

    /// Reads the start values of the reduced description from the file [`START_VALUES`] in the folder `resources`. If the
    /// token of the description (GUID or instantiationToken) contains no checksum of this file, the description has the
    /// start values of the table, and nothing is read.
    ///
    /// # Errors
    /// If the file is missing, belongs to another description, or does not match the table.
    pub fn read_starts<M: Model>(&mut self, resources: Option<&Path>) -> Result<(), String> {
        let expected = &self.token[GUID_LENGTH - 5..GUID_LENGTH - 1];
        if expected == "0000" {
            return Ok(());
        }
        let Some(folder) = resources else {
            return Err(format!(
                "the start values of this model description are in resources/{START_VALUES}, and the host names no folder of \
                 resources"
            ));
        };
        let file = folder.join(START_VALUES);
        let text = std::fs::read_to_string(&file).map_err(|why| {
            format!("start values of the model description: {}: {why}", file.display())
        })?;
        if checksum(&text) != expected {
            return Err(format!(
                "{} is not the file of this model description: its checksum differs from the one in the GUID",
                file.display()
            ));
        }
        let wrong = |n: usize, line: &str| {
            format!(
                "{}, line {}: {line:?} is not NAME = VALUE with a variable of this FMU, in the order of its table",
                file.display(),
                n + 1
            )
        };
        let mut scalars = M::table().scalars.iter().enumerate();
        for (n, line) in text.lines().enumerate() {
            let (name, value) = line.split_once(" = ").ok_or_else(|| wrong(n, line))?;
            let scalar = scalars.find(|(_, scalar)| scalar.name() == name);
            let (place, scalar) = scalar.ok_or_else(|| wrong(n, line))?;
            if let Access::Input(_) = scalar.access {
                let start =
                    value.parse().ok().filter(|x| scalar.problem(Value::Real(*x)).is_none());
                self.inputs.push((place, start.ok_or_else(|| wrong(n, line))?));
                continue;
            }
            let is_parameter = scalar.variable.causality == Causality::Parameter;
            let start = self.starts.get_mut(scalar.slot).filter(|_| is_parameter);
            let start = start.ok_or_else(|| wrong(n, line))?;
            let read = match start {
                Value::Real(_) => value.parse().ok().map(Value::Real),
                Value::Integer(_) => value.parse().ok().map(Value::Integer),
                Value::Boolean(_) => value.parse().ok().map(Value::Boolean),
            };
            *start = read.ok_or_else(|| wrong(n, line))?;
        }
        Ok(())
    }

    pub fn token(&self) -> &str {
        &self.token
    }

    pub fn places(&self) -> &[usize] {
        &self.places
    }

    pub fn indicators(&self) -> usize {
        self.indicators
    }

    pub fn starts(&self) -> &[Value] {
        &self.starts
    }

    pub fn inputs(&self) -> &[(usize, f64)] {
        &self.inputs
    }

    /// Returns an error message if `value` is a number of tanks or modes that is larger than the number for which the
    /// reduced description has variables; otherwise `None`.
    pub fn problem<M: Model>(&self, scalar: &Scalar<M>, value: Value) -> Option<String> {
        let (_, most) = self.sizes.iter().find(|(name, _)| *name == scalar.variable.name)?;
        match value {
            Value::Integer(n) if n > *most as i32 => Some(format!(
                "{} = {n} (allowed: at most {most}, for which this model description has variables)",
                scalar.name()
            )),
            _ => None,
        }
    }
}

/// Returns the number of event indicators in a model description that is reduced to `sizes`, the names and largest values of
/// the parameters that count elements. `of` is the name of the parameter that counts the elements with event indicators
/// ([`Dynamics::INDICATORS_OF`](crate::model::Dynamics::INDICATORS_OF)).
fn share<M: Model>(table: &Table<M>, of: Option<&str>, sizes: &[(&str, usize)]) -> usize {
    let all = table.about.event_indicators;
    let size = sizes.iter().find(|(name, _)| Some(*name) == of);
    let most = table.sizes().into_iter().find(|(name, _)| Some(*name) == of);
    match (size, most) {
        (Some((_, size)), Some((_, most))) => all / most * size,
        _ => all,
    }
}

pub fn checksum(text: &str) -> String {
    // 0 means that there is no file.
    let sum = (Hash::new().bytes(text.as_bytes()).value() & 0xffff).max(1);
    format!("{sum:04x}")
}

impl<M: Model> Table<M> {
    /// Returns name and largest value of each parameter that determines how many elements an array has, in the order in which
    /// the arrays of the table first use these parameters.
    pub fn sizes(&self) -> Vec<(&'static str, usize)> {
        let mut sizes: Vec<(&'static str, usize)> = Vec::new();
        for dimension in self.variables.iter().flat_map(|variable| variable.shape) {
            if let Dimension::Sized(name, most) | Dimension::Used(name, most) = dimension
                && !sizes.iter().any(|(known, _)| known == name)
            {
                sizes.push((name, *most));
            }
        }
        sizes
    }
}

impl<M: Model> Scalar<M> {
    /// Returns true if a reduced model description with these `sizes` contains this scalar. `sizes` are the largest values
    /// of the parameters that count elements, with their names.
    pub fn is_within(&self, sizes: &[(&str, usize)]) -> bool {
        let indices = self.variable.indices(self.element);
        self.variable.shape.iter().zip(indices).all(|(dimension, index)| match dimension {
            Dimension::Sized(name, _) | Dimension::Used(name, _) => {
                sizes.iter().all(|(sized, size)| sized != name || index < *size)
            }
            Dimension::Fixed(_) => true,
        })
    }
}

/// Converts a URI to the path of a folder; for example, FMI 2.0 passes the folder of resources as `file:///a%20b`, and on
/// Windows as `file:///C:/a`. A path that is not a URI is returned unchanged.
pub fn folder_of_uri(uri: &str) -> Option<std::path::PathBuf> {
    let Some(rest) = uri.strip_prefix("file:") else {
        return (!uri.is_empty() && !uri.contains("://")).then(|| uri.into());
    };
    let path = match rest.strip_prefix("//") {
        Some(after) => &after[after.find('/')?..],
        None => rest,
    };
    let mut bytes = Vec::with_capacity(path.len());
    let mut left = path.bytes();
    while let Some(byte) = left.next() {
        let byte = match byte {
            b'%' => {
                let digits = [left.next()?, left.next()?];
                u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?
            }
            other => other,
        };
        bytes.push(byte);
    }
    let path = String::from_utf8(bytes).ok()?;
    let is_drive = path.as_bytes().get(2) == Some(&b':');
    Some(if is_drive { path[1..].into() } else { path.into() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::trays::Trays;

    fn extent_with(digits: &str) -> Option<Extent> {
        let whole = Trays::table().guid();
        let token = format!("{}{digits}}}", &whole[..GUID_LENGTH - 1 - DIGITS]);
        Extent::from_token::<Trays>(&token, whole)
    }

    /// The test model has up to three trays, by default two, and the level of each is a continuous state.
    #[test]
    fn the_instantiation_token_of_a_reduced_description_contains_its_number_of_states() {
        assert_eq!(extent_with("000000000").unwrap().places(), [0_usize; 0]);
        assert_eq!(Trays::table().sizes(), [("rows", 3)]);
        let extent = extent_with("100010000").unwrap();
        assert_eq!((extent.places(), &extent.starts()[0]), (&[0][..], &Value::Integer(1)));
        assert_eq!(extent_with("200020000").unwrap().places(), [0, 1]);
        assert_eq!(extent_with("200020000").unwrap().starts()[0], Value::Integer(2));
        for wrong in [
            "100020000",
            "400030000",
            "000010000",
            "110010000",
            "101010000",
            "g00010000",
            "10001000",
        ] {
            assert_eq!(extent_with(wrong), None, "{wrong}");
        }
        let whole = Trays::table().guid();
        assert_eq!(Extent::from_token::<Trays>("", whole), None);
        assert_eq!(Extent::from_token::<Trays>("{é}", whole), None);
    }

    #[test]
    fn the_folder_of_a_file_uri_is_decoded() {
        let path_in =
            |uri: &str| folder_of_uri(uri).map(|path| path.to_string_lossy().into_owned());
        for (uri, path) in [
            ("file:///tmp/a%20b/resources", "/tmp/a b/resources"),
            ("file:/tmp/a", "/tmp/a"),
            ("file://localhost/tmp/%C3%A4", "/tmp/ä"),
            ("file:///C:/a/b", "C:/a/b"),
            ("/tmp/a", "/tmp/a"),
        ] {
            assert_eq!(path_in(uri).as_deref(), Some(path));
        }
        for wrong in ["", "http://a/b", "file:///%4", "file:///%zz", "file://host", "file:///%ff"] {
            assert_eq!(path_in(wrong), None, "{wrong}");
        }
    }
}
