//! Tests of the whole project in one binary: `cargo test` links once.

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
    // As it stands in the crate `plant`.
    #[path = "../../fmu/plant/tests/plant/free_oscillation.rs"]
    mod free_oscillation;
    mod liquid;
    mod tanks;
}
mod python;
mod second;
mod six {
    mod component;
    mod cosimulation;
    mod hubslosh;
    mod steps;
    // Tests of the crate `craft`, here with the packed FMUs as `component`.
    #[path = "../../fmu/craft/tests/craft/balances.rs"]
    mod balances;
    #[path = "../../fmu/craft/tests/craft/draining.rs"]
    mod draining;
    #[path = "../../fmu/craft/tests/craft/exchange.rs"]
    mod exchange;
    #[path = "../../fmu/craft/tests/craft/invariances.rs"]
    mod invariances;
    #[path = "../../fmu/craft/tests/craft/planar.rs"]
    mod planar;
    #[path = "../../fmu/craft/tests/craft/random.rs"]
    mod random;
    #[path = "../../fmu/craft/tests/craft/records.rs"]
    mod records;
    #[path = "../../fmu/craft/tests/craft/reference.rs"]
    mod reference;
    #[path = "../../fmu/craft/tests/craft/small_motions.rs"]
    mod small_motions;
    #[path = "../../fmu/craft/tests/craft/special_cases.rs"]
    mod special_cases;
}
mod xml {
    mod checklist;
    mod fmi3;
    mod generated;
    mod model_description;
}
