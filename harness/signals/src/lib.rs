//! Sampled signals: as columns of files, and their Fourier transforms. What needs the large generic
//! crates `parquet` and `realfft` stands here, so that their code is compiled once.

pub mod fourier;
pub mod table;
