/// Contact between hub and bearing under a friction law that switches at rest. The numbers are the values of the output
/// `friction_mode`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i8)]
#[allow(missing_docs)]
pub enum Contact {
    Backward = -1,
    Stuck = 0,
    Forward = 1,
}
