//! Identification of simulated benches: estimates, uncertainties and verdicts.

mod any_fmu;
#[path = "../../examples/twins/bench.rs"]
#[allow(dead_code, reason = "the example looks at more of it")]
mod bench;
mod coverage;
#[path = "../../examples/twins/draw.rs"]
#[allow(dead_code, reason = "the example says more of it")]
mod draw;
#[path = "../../examples/fmu_twin/mod.rs"]
#[allow(dead_code, reason = "the examples use the rest of it")]
mod fmu_twin;
mod force_record;
mod friction;
#[allow(dead_code, reason = "the example writes every habit")]
#[path = "../../examples/twins/habits.rs"]
mod habits;
mod other_bench;
mod out_of_range;
#[path = "../../examples/friction/runs.rs"]
mod runs;
mod sensors;
mod solver_noise;
mod twin;
mod twins;
