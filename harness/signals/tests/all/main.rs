//! Tests of `signals`, outside the library: its generic crates are compiled once.

mod corpus;
mod headers;
mod recording;
mod scale;
mod table;
