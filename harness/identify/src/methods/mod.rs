//! Methods of identification, each in a file of its own, and the types of their inputs and results.

pub mod free_decay;
pub mod friction;
pub mod output_error;

use anyhow::{Context, Result};
use host::fmu::Fmu;
use serde::Serialize;

use crate::input::recording::Recording;
use crate::news::News;
use crate::words::identified::Identified;
use crate::words::page::{self, Sections};

#[derive(Clone, Copy)]
pub struct Task<'a> {
    pub fmu: Option<&'a Fmu>,
    pub recordings: &'a [Recording],
    pub validation: &'a [Recording],
}

impl<'a> Task<'a> {
    fn fmu(&self) -> Result<&'a Fmu> {
        self.fmu.context("this method needs an FMU")
    }
}

pub trait Method {
    type Details: Serialize;

    fn identify(
        &self,
        task: &Task,
        progress: &mut dyn FnMut(&News),
    ) -> Result<Identified<Self::Details>>;

    /// Returns the lines that a terminal shows below the table of estimates.
    fn lines(found: &Identified<Self::Details>) -> Vec<String>;

    fn sections(_found: &Identified<Self::Details>) -> Sections {
        Sections::default()
    }

    fn page(found: &Identified<Self::Details>) -> String {
        page::of(found, &Self::sections(found))
    }
}
