//! The FMUs that this project packs. Another FMU is another entry in [`MODELS`].

use std::path::PathBuf;

use anyhow::{Context, Result};
use host::description::did_you_mean;

use crate::archive::read;
use crate::fmi::Fmi;
use crate::project::root;

pub const REFERENCES: &str = "extra/org.fmi-standard.fmi-ls-ref";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Model {
    /// The `modelIdentifier`. The folder `modelDescription/<name>` contains everything that is
    /// packed with the binary: `modelDescription.xml`, `documentation/` and, if it exists,
    /// `extra/`.
    pub name: &'static str,
    pub package: &'static str,
}

pub const MODELS: [Model; 3] = [
    Model { name: "HubSlosh", package: "hubslosh-fmu" },
    Model { name: "Spacecraft", package: "spacecraft-fmu" },
    Model { name: "SloshTank", package: "sloshtank-fmu" },
];

pub const HUBSLOSH: &Model = &MODELS[0];

pub fn model(name: &str) -> Result<&'static Model> {
    MODELS.iter().find(|model| model.name == name).with_context(|| {
        let names = MODELS.iter().map(|model| model.name);
        let all: Vec<_> = names.clone().collect();
        let hint = did_you_mean(name, names);
        format!("there is no model \"{name}\" (allowed: {}){hint}", all.join(", "))
    })
}

/// Finds an FMU and its form by its file name without ending: `Spacecraft`, or `Spacecraft-fmi3`
/// and `Spacecraft-fmi3-arrays` for FMI 3.0. Returns `None` for any other name.
pub fn named(name: &str) -> Option<(Model, Fmi)> {
    let fmi = Fmi::ALL.into_iter().rev().find(|fmi| name.ends_with(fmi.suffix()))?;
    let model = model(name.strip_suffix(fmi.suffix())?).ok()?;
    Some((*model, fmi))
}

impl Model {
    pub(crate) fn description(&self, fmi: Fmi) -> Result<Vec<u8>> {
        let file = match fmi {
            Fmi::V2 => "modelDescription.xml",
            Fmi::V3 => "fmi3/modelDescription.xml",
            Fmi::V3Arrays => "fmi3-arrays/modelDescription.xml",
        };
        read(&self.folder().join(file))
    }

    pub fn folder(&self) -> PathBuf {
        root().join("modelDescription").join(self.name)
    }

    /// Returns the folder with the example and its reference result. It has the same path in the
    /// FMU and in the folder of the model. The layered standard FMI-LS-REF prescribes its name,
    /// whereas other folders in `extra` would need the reversed name of a domain, which the project
    /// does not have.
    pub fn example(&self) -> PathBuf {
        self.folder().join(REFERENCES)
    }

    pub fn sbom(&self) -> String {
        format!("documentation/licenses/{}.cdx.json", self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fmu_is_found_by_its_file_names() {
        for model in MODELS {
            for fmi in Fmi::ALL {
                let name = format!("{}{}", model.name, fmi.suffix());
                assert_eq!(named(&name), Some((model, fmi)), "{name}");
            }
        }
        for wrong in ["Spacecraft_1x1", "Spacecraft.fmu", ""] {
            assert_eq!(named(wrong), None, "{wrong}");
        }
    }
}
