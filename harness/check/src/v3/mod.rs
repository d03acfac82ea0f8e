//! The rules for FMUs 3.0, by the text of FMI 3.0.2. Those of the archive and of reading XML are shared with FMI 2.0.

pub mod archive;
pub mod calls;
pub mod definitions;
pub mod description;
pub mod schema;
pub mod steps;
pub mod structure;
pub mod subject;
pub mod variables;

pub use self::archive::Binaries;
pub use self::description::{Description, Variable};
pub use self::subject::Subject;
