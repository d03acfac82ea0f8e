//! Largest numbers of tanks and modes: the lengths of arrays.
//!
//! A variant with fewer tanks and modes is built with HUBSLOSH_TANKS and HUBSLOSH_MODES in the environment
//! (`hubslosh pack --tanks 1 --modes 1`).

/// Tanks of a craft: 1 to 4.
pub const TANKS: usize = size(option_env!("HUBSLOSH_TANKS"), 4);

/// Slosh modes of a tank: 1 to 3.
pub const MODES: usize = size(option_env!("HUBSLOSH_MODES"), MOST_MODES);

/// Number of modes for which the default tank has values.
const MOST_MODES: usize = 3;

/// Largest number of points of a fill table.
pub const POINTS: usize = 12;

const fn size(chosen: Option<&str>, most: usize) -> usize {
    let Some(text) = chosen else { return most };
    assert!(text.len() == 1, "a size is one digit");
    let size = text.as_bytes()[0].wrapping_sub(b'0') as usize;
    assert!(
        1 <= size && size <= most,
        "a size is at least 1 and at most that of the FMU without variant"
    );
    size
}

/// Returns the first `MODES` of values for all modes.
pub(crate) const fn modes_of<T: Copy>(all: [T; MOST_MODES]) -> [T; MODES] {
    let mut some = [all[0]; MODES];
    let mut n = 1;
    while n < MODES {
        some[n] = all[n];
        n += 1;
    }
    some
}
