//! Tests of the packed FMU, the documentation and the release as files.

mod archive;
mod documentation;
mod metadata;
mod release;
