//! This library is empty, because the tests of the package are in `tests.rs`.
