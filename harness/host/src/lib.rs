//! Loads FMUs as any host does: the packed archive, its description and its binary.
//!
//! The rest of the harness accesses an FMU only through this crate, and no code is shared with a model. Code that the
//! crates check and pack also need is here, too, for example to read binaries of any platform.

pub mod archive;
pub mod binary;
pub mod c_abi;
pub mod causality;
pub mod description;
pub mod drive;
pub mod exchange;
pub mod fmi2;
pub mod fmi3;
pub mod fmu;
pub mod guard;
pub mod parameter_set;
pub mod part;
pub mod schedule;
pub mod symbol;
pub mod xml;
