//! Sampled signals: as columns of the project's own files (`table`) and of recordings made by others
//! (`recording`). Everything that needs the large generic crate `parquet` is here, so that its code is compiled only
//! once.

mod foreign;
mod parquet_file;
pub mod recording;
pub mod table;
