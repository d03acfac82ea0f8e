//! Loads FMUs as any host does: the packed archive, what it says of itself, its binary.
//!
//! The rest of the harness meets an FMU only through this crate; no code is shared with a model.
//! Whatever check, pack and experiments need alike is here too: reading binaries of any platform, writing
//! files so that they appear whole or not at all, temporary folders, and what a command may take of
//! a machine.

pub mod archive;
pub mod binary;
pub mod budget;
pub mod bug;
pub mod c_abi;
pub mod description;
pub mod drive;
pub mod fmi2;
pub mod fmi3;
pub mod fmu;
pub mod guard;
pub mod input;
pub mod output;
pub mod temporary;
pub mod wasm;
pub mod xml;
