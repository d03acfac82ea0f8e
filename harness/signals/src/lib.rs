//! Sampled signals: columns of the project's own files (`table`), and recordings that other programs
//! wrote (`recording`). All code that needs the large generic crate `parquet` is in this crate, so that
//! it is compiled only once.

mod foreign;
mod parquet_file;
pub mod recording;
pub mod table;
