//! Identification of simulated benches: estimates, uncertainties and verdicts. Further tests call single functions, for example
//! those that read recordings.

mod any_fmu;
#[path = "../../../studies/twins/bench.rs"]
#[allow(dead_code, reason = "the example looks at more of it")]
mod bench;
mod bench_combination;
mod bench_design;
mod bench_effect;
mod bench_simulate;
mod bench_start;
mod bench_verdict;
mod coverage;
#[path = "../../../studies/twins/draw.rs"]
#[allow(dead_code, reason = "the example says more of it")]
mod draw;
mod engine_cause;
mod engine_minimum;
mod engine_noise;
mod engine_profile;
mod estimate;
#[path = "../../../studies/fmu_twin/mod.rs"]
#[allow(dead_code, reason = "the examples use the rest of it")]
mod fmu_twin;
mod force_record;
mod friction;
#[allow(dead_code, reason = "the example writes every habit")]
#[path = "../../../studies/twins/habits.rs"]
mod habits;
mod input_clocks;
mod input_gaps;
mod input_plausible;
mod input_question;
mod input_reading;
mod input_sensor_faults;
mod input_spikes;
mod input_tolerance;
mod methods_free_decay;
mod methods_friction;
mod other_bench;
mod out_of_range;
#[path = "../../../studies/friction/runs.rs"]
mod runs;
mod sensors;
mod solver_noise;
mod twin;
mod twins;
mod words_page;
