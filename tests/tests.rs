//! Tests of the whole project in one binary, which `cargo test` has to link only once.

mod abi {
    mod abuse;
    mod calls;
    mod derivatives;
    mod model_exchange;
}
mod architecture;
mod arrays;
mod common;
mod fmi3;
mod life {
    mod allocation;
    mod effect;
    mod instance;
}
mod physics {
    // The file is shared with the crate `plant`.
    #[path = "../../fmu/plant/tests/plant/free_oscillation.rs"]
    mod free_oscillation;
    mod liquid;
    mod tanks;
}
mod python;
mod second;
mod six {
    mod bits;
    mod component;
    mod cosimulation;
    mod finite_amplitude;
    mod hubslosh;
    mod models;
    mod steps;
    // Tests of random tanks at the limits of their models, from the crate `craft`.
    #[path = "../../fmu/craft/tests/craft/limit_cases.rs"]
    mod limit_cases;
    // Random craft and reference records from the crate `craft`.
    #[path = "../../fmu/craft/tests/craft/random.rs"]
    mod random;
    #[path = "../../fmu/craft/tests/craft/records.rs"]
    #[allow(dead_code, reason = "the crate's tests use the rest of it")]
    mod records;
    #[path = "../../fmu/craft/tests/craft/waves.rs"]
    mod waves;
}
mod xml {
    mod checklist;
    mod fmi3;
    mod generated;
    mod model_description;
}
