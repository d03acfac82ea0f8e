//! The rules for FMI 3.0 (text of version 3.0.2). Rules about the archive and about XML are shared with FMI
//! 2.0.

pub mod archive;
pub mod calls;
pub mod steps;
pub mod subject;
pub mod variables;

pub use self::subject::Subject;
