//! Nothing: the package's tests are in `tests.rs`.
