//! The FMUs that this project packs. Another one is another entry in [`MODELS`].

use std::path::PathBuf;

use anyhow::{Context, Result};
use host::description::did_you_mean;

use crate::project::root;

/// An FMU of this project.
#[derive(Debug, PartialEq, Eq)]
pub struct Model {
    /// Its `modelIdentifier`; the folder `modelDescription/<name>` has all that travels with the
    /// binary: `modelDescription.xml`, `documentation/`, and, if
    /// there is one, `extra/`.
    pub name: &'static str,
    /// Cargo package whose cdylib is the binary.
    pub package: &'static str,
}

/// All of them; the first is packed unless another is named.
pub const MODELS: [Model; 3] = [
    Model { name: "HubSlosh", package: "hubslosh-fmu" },
    Model { name: "Spacecraft", package: "spacecraft-fmu" },
    Model { name: "SloshTank", package: "sloshtank-fmu" },
];

/// The FMU that is packed unless another is named.
pub const HUBSLOSH: &Model = &MODELS[0];

/// The FMU of that name.
///
/// # Errors
/// If there is none; the error names those there are.
pub fn model(name: &str) -> Result<&'static Model> {
    MODELS.iter().find(|model| model.name == name).with_context(|| {
        let names = MODELS.iter().map(|model| model.name);
        let all: Vec<_> = names.clone().collect();
        let hint = did_you_mean(name, names);
        format!("there is no model \"{name}\" (allowed: {}){hint}", all.join(", "))
    })
}

impl Model {
    /// The folder with all that travels with the binary.
    pub fn folder(&self) -> PathBuf {
        root().join("modelDescription").join(self.name)
    }

    /// Folder in the FMU for what the standard has no place for: the model's name, where FMI asks
    /// for a reversed domain name. The project has no domain, and another's is not to be taken.
    pub fn extra(&self) -> String {
        format!("extra/{}", self.name)
    }

    /// The software bill of materials (SBOM) in the FMU.
    pub fn sbom(&self) -> String {
        format!("{}/{}.cdx.json", self.extra(), self.name)
    }
}
