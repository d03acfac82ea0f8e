//! The packed FMU, the documentation and the release as files.

mod archive;
mod documentation;
mod release;
