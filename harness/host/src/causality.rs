use std::fmt::{self, Display};

macro_rules! attribute {
    ($(#[$doc:meta])* $name:ident: $($item:ident $text:literal),+) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum $name {
            $($item,)+
            /// Any other text of the attribute, which FMI does not define; an empty text if the
            /// attribute is missing.
            Other(String),
        }

        impl $name {
            pub fn as_str(&self) -> &str {
                match self {
                    $($name::$item => $text,)+
                    $name::Other(text) => text,
                }
            }
        }

        impl From<&str> for $name {
            fn from(text: &str) -> $name {
                match text {
                    $($text => $name::$item,)+
                    other => $name::Other(other.into()),
                }
            }
        }

        impl Display for $name {
            fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
                to.pad(self.as_str())
            }
        }
    };
}

attribute! {
    Causality: Parameter "parameter", CalculatedParameter "calculatedParameter",
    StructuralParameter "structuralParameter", Input "input", Output "output", Local "local",
    Independent "independent"
}

attribute! {
    Variability: Constant "constant", Fixed "fixed", Tunable "tunable", Discrete "discrete",
    Continuous "continuous"
}
