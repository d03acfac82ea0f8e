//! Reads archives, descriptions, binaries and parameter files, and runs processes under the guard.

mod archive;
mod binary;
mod description;
mod fmi2;
mod fmi3;
mod guard;
mod parameter_set;
mod schedule;
mod symbol;
mod xml;
