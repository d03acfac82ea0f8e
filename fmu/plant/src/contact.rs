//! Stick and slip.

/// Contact between hub and bearing under a law that switches at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i8)]
pub enum Contact {
    /// Turning backwards, w < 0.
    Backward = -1,
    /// At rest, held by dry friction.
    Stuck = 0,
    /// Turning forwards, w > 0.
    Forward = 1,
}
