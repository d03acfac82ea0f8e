pub use craft::{SloshTank, Spacecraft};
