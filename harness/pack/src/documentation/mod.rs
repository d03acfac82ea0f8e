//! Renders the documentation in an FMU from Markdown files anywhere in this project as one page ([`fmu`]).
//!
//! Equations are written in LaTeX between dollar signs, as on GitHub, and become MathML. Links to pages or headings
//! that do not exist, missing figures, and equations that are not LaTeX are errors; all errors are reported at once.

pub mod fmu;
pub mod page;

const CSS: &str = include_str!("page.css");
