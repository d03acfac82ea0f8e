//! Tests of the crate `signals`. They are outside the library so that its generic crates
//! are compiled only once.

mod corpus;
mod headers;
mod recording;
mod scale;
mod table;
