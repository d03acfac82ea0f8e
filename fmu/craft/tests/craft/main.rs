//! Tests of a spacecraft with tanks and of the single tank.
//!
//! `tests/six`, at the root of the project, tests that the packed FMUs compute the same bits, and contains the tests
//! of coupling by co-simulation.

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
