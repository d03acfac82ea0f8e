/// Contact between hub and bearing: the hub sticks, or it slips in one direction. The output `friction_mode` has these
/// numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i8)]
#[allow(missing_docs)]
pub enum Contact {
    Backward = -1,
    Stuck = 0,
    Forward = 1,
}
