//! Methods of identification, one a file: what each is given, and what all return.

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

/// Input of a method.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// The FMU, for methods that need it.
    pub fmu: Option<&'a Fmu>,
    /// Recordings to fit.
    pub recordings: &'a [Recording],
    /// Recordings to simulate with the result, which are not fitted.
    pub validation: &'a [Recording],
}

impl<'a> Task<'a> {
    fn fmu(&self) -> Result<&'a Fmu> {
        self.fmu.context("this method needs an FMU")
    }
}

pub trait Method {
    /// Results that only this method has.
    type Details: Serialize;

    /// Identifies the parameters from the task's recordings; `progress` receives each message.
    fn identify(
        &self,
        task: &Task,
        progress: &mut dyn FnMut(&News),
    ) -> Result<Identified<Self::Details>>;

    /// Returns the lines that a terminal shows below the table of estimates.
    fn lines(found: &Identified<Self::Details>) -> Vec<String>;

    /// Returns the sections of the page that only this method has.
    fn sections(_found: &Identified<Self::Details>) -> Sections {
        Sections::default()
    }

    /// Returns the page in HTML.
    fn page(found: &Identified<Self::Details>) -> String {
        page::of(found, &Self::sections(found))
    }
}
