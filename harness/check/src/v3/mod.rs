//! The rules for FMI 3.0 (text of version 3.0.2). Rules about the archive and about XML are shared with FMI
//! 2.0.

pub mod archive;
pub mod calls;
pub mod definitions;
pub mod description;
pub mod schema;
pub mod steps;
pub mod structure;
pub mod subject;
pub mod variables;

pub use self::description::{Description, Variable};
pub use self::subject::Subject;
