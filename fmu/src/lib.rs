//! HubSlosh as an FMI 2.0 FMU.
//!
//! [`table`] says what there is, [`instance`] what may happen to it and when,
//! [`snapshot`] how it is saved, `abi` is the C face of it all and the only
//! unsafe code. The physics is the crate `plant` and knows nothing of this.

// The library's name is the FMU's modelIdentifier.
#![allow(non_snake_case)]

pub mod abi;
pub mod calls;
pub mod hash;
pub mod instance;
pub mod log;
pub mod snapshot;
pub mod table;
pub mod variable;
