//! The rules for FMI 3.0 (text of version 3.0.2). FMI 2.0 and 3.0 share rules about the archive and about XML.

pub mod archive;
pub mod calls;
pub mod steps;
pub mod subject;
pub mod variables;

pub use self::subject::Subject;
