//! Sampled signals: as columns of files, of our own (`table`) and of others (`recording`), and their Fourier
//! transforms. What needs the large generic crates `parquet` and `realfft` stands here, so that their code is
//! compiled once.

mod foreign;
pub mod fourier;
mod parquet_file;
pub mod recording;
pub mod table;
