//! The packed FMU and the release as files.

mod archive;
mod release;
