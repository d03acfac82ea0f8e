//! What must hold of the craft and of the tank alone.

mod records;
mod reference;
