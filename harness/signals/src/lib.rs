//! Sampled signals: as columns of the project's own files (`table`) and of recordings made by others
//! (`recording`), and their Fourier transforms. Everything that needs the large generic crates `parquet` and
//! `realfft` is here, so that their code is compiled only once.

mod foreign;
pub mod fourier;
mod parquet_file;
pub mod recording;
pub mod table;
