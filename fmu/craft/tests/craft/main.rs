//! What must hold of the craft and of the tank alone.

mod balances;
mod cosimulation;
mod equations;
mod independent;
mod invariances;
mod life;
mod random;
mod records;
mod reference;
mod small_motions;
mod special_cases;
