//! Contact state of the bearing: stick or slip.

/// Contact between hub and bearing under a friction law that switches at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i8)]
pub enum Contact {
    /// Slipping backwards, w < 0.
    Backward = -1,
    /// At rest, held by dry friction.
    Stuck = 0,
    /// Slipping forwards, w > 0.
    Forward = 1,
}
