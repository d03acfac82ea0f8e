//! Limits of sizes, inputs, outputs, stored runs, temporary folders, and reports of bugs.

mod budget;
mod bug;
mod input;
mod output;
mod store;
mod temporary;
