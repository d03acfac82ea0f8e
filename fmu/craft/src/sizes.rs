//! Largest numbers of tanks, modes and points: the lengths of arrays.

/// Largest number of tanks of a craft.
pub const TANKS: usize = 4;

/// Largest number of slosh modes of a tank.
pub const MODES: usize = 3;

/// Largest number of modes of a craft's flexible appendages.
pub const APPENDAGES: usize = 6;

/// Largest number of points of a fill table.
pub const POINTS: usize = 12;
