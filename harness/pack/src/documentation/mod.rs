//! The documentation, from the Markdown files of this project, wherever they are: as one page for an
//! FMU ([`fmu`]) and as a static site ([`book`]).
//!
//! Equations are written in LaTeX between dollar signs, as GitHub reads them, and become MathML. A
//! link to another page or heading that does not exist, a missing figure, and an equation that is not
//! LaTeX are errors, all of them reported at once.

pub mod book;
pub mod fmu;
pub mod page;

/// The book before it is written: name and content of each file.
pub type Files = Vec<(String, Vec<u8>)>;

/// Style sheet of book and FMU documentation.
const CSS: &str = include_str!("page.css");
