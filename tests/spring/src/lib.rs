#![allow(non_snake_case)]

pub mod spring;

pub mod fmi2 {
    pub use runtime::v2::*;

    runtime::export_fmi2!(crate::spring::Spring);
}
