//! Names of the variables of this project's FMUs, the items of their enumerations, and the sizes of their arrays.
//! The harness does not link the models. Instead, the program model-description writes one module for each FMU from
//! its variable table, so that a name that is misspelt, or no longer exists, does not compile.

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Array<const D: usize>(&'static str);

impl<const D: usize> Array<D> {
    /// Returns the name of an array element, for example `tank[2].p[1,3]`. The indices count from
    /// 1.
    pub fn element(self, indices: [usize; D]) -> String {
        let (mut name, mut left) = (self.0.to_string(), &indices[..]);
        while let (Some(place), [index, rest @ ..]) = (name.find("[]"), left) {
            name.insert_str(place + 1, &index.to_string());
            left = rest;
        }
        if !left.is_empty() {
            let left: Vec<String> = left.iter().map(usize::to_string).collect();
            name += &format!("[{}]", left.join(","));
        }
        name
    }
}

/// A parameter of an FMU that determines how many elements of its arrays are in use, for example
/// the number of tanks.
///
/// - `most`: largest value of the parameter.
/// - `has_indicators`: true if each element has its own event indicators.
/// - `arrays`: names of these arrays, each with the position of the index that counts the elements.
///   For example, in `tank[2].p[1,3]` the index at position 0 counts tanks, and the index at
///   position 1 counts modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    pub parameter: &'static str,
    pub most: usize,
    pub has_indicators: bool,
    pub arrays: &'static [(&'static str, usize)],
}

macro_rules! enumeration {
    ($name:ident: $($item:ident = $value:literal $text:literal),+) => {
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {
            $($item = $value),+
        }

        impl $name {
            pub const fn name(self) -> &'static str {
                match self {
                    $($name::$item => $text),+
                }
            }

            pub fn named(name: &str) -> Option<$name> {
                match name {
                    $($text => Some($name::$item),)+
                    _ => None,
                }
            }
        }
    };
}

pub mod hubslosh;
pub mod limits;
pub mod sloshtank;
pub mod spacecraft;
