//! The documentation in an FMU, from the Markdown files of this project, wherever they are, as one page ([`fmu`]).
//!
//! Equations are written in LaTeX between dollar signs, as GitHub reads them, and become MathML. A
//! link to another page or heading that does not exist, a missing figure, and an equation that is not
//! LaTeX are errors, all of them reported at once.

pub mod fmu;
pub mod page;

/// Style sheet of the page.
const CSS: &str = include_str!("page.css");
