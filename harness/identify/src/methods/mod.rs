//! Methods of identification, one a file: what each is given, what it needs of that, and what all return.

pub mod acceleration;
pub mod free_decay;
pub mod frequency;
pub mod identification;
pub mod output_error;

use anyhow::{Context, Result, bail};
use host::fmu::Fmu;
use serde::Serialize;

use crate::fit::bench::start;
use crate::input::plausible;
use crate::input::recording::Recording;
use crate::model::bench::nominal::Nominal;
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

    fn one(&self) -> Result<&'a Recording> {
        match self.recordings {
            [one] => Ok(one),
            _ => bail!(
                "this method takes one uninterrupted recording, not {}",
                self.recordings.len()
            ),
        }
    }

    /// Refuses recordings of another bench than the FMU's: units or inertia are wrong.
    fn check_size(&self, nominal: &Nominal) -> Result<()> {
        match start::from_data(self.recordings, nominal)? {
            (Some(found), _) => plausible::check_size(found.inertia, nominal.inertia),
            (None, _) => Ok(()),
        }
    }
}

/// Inputs that a method needs or can use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needs {
    /// The FMU.
    pub fmu: bool,
    /// Recordings that are held back.
    pub validation: bool,
}

/// A method of identification.
pub trait Method {
    /// Results that only this method has.
    type Details: Serialize;

    /// Parts of a [`Task`] that the method needs.
    const NEEDS: Needs;

    /// Identifies; `progress` receives each message.
    fn identify(
        &self,
        task: &Task,
        progress: &mut dyn FnMut(&News),
    ) -> Result<Identified<Self::Details>>;

    /// Lines for a terminal, below the table of estimates.
    fn lines(found: &Identified<Self::Details>) -> Vec<String>;

    /// Sections of the page that only this method has.
    fn sections(_found: &Identified<Self::Details>) -> Sections {
        Sections::default()
    }

    /// The page, in HTML.
    fn page(found: &Identified<Self::Details>) -> String {
        page::of(found, &Self::sections(found))
    }
}
