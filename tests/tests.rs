//! What must hold of the whole, as one test binary: `cargo test` links once.

mod abi {
    mod abuse;
    mod calls;
    mod model_exchange;
}
mod architecture;
mod common;
mod life {
    mod allocation;
    mod instance;
}
mod physics {
    mod balances;
    mod errata;
    mod rotary;
    mod trajectories;
}
mod python;
mod second;
mod xml {
    mod checklist;
    mod generated;
    mod model_description;
}
