//! How many of everything there can be: arrays have these lengths.

/// Tanks of a craft.
pub const TANKS: usize = 4;

/// Slosh modes of a tank.
pub const MODES: usize = 3;

/// Points of a table over a tank's fill.
pub const POINTS: usize = 8;
