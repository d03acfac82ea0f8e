//! What must hold of the craft and of the tank alone.

mod balances;
mod independent;
mod random;
mod records;
mod reference;
