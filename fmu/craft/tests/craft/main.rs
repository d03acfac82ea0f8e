//! Tests of the craft and of the tank alone.
//!
//! `tests/six`, at the root of the project, shows that the packed FMUs compute the same bits, and has the coupling by
//! co-simulation.

mod appendages;
mod balances;
mod ball;
mod ball_on_host;
mod component;
mod corners;
mod decays;
mod draining;
mod equations;
mod events;
mod exchange;
mod forced_waves;
mod impulses;
mod independent;
mod invariances;
mod life;
mod limit_cases;
mod limits;
mod mass;
mod planar;
mod random;
mod records;
mod reference;
mod refusals;
mod rows;
mod seeds;
mod small_motions;
mod special_cases;
mod spinning;
mod surface;
mod tilting;
mod waves;
