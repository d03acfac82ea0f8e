//! The FMUs that this project packs. Another one is another entry in [`MODELS`].

use std::path::PathBuf;

use anyhow::{Context, Result};
use host::description::did_you_mean;

use crate::archive::read;
use crate::fmi::Fmi;
use crate::project::root;

/// The folder of the layered standard FMI-LS-REF in an FMU.
pub const REFERENCES: &str = "extra/org.fmi-standard.fmi-ls-ref";

/// An FMU of this project.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

/// Finds an FMU by its name: `Spacecraft`, for FMI 3.0 `Spacecraft-fmi3`.
pub fn named(name: &str) -> Option<(Model, Fmi)> {
    let fmi = Fmi::ALL.into_iter().rev().find(|fmi| name.ends_with(fmi.suffix()))?;
    let model = model(name.strip_suffix(fmi.suffix())?).ok()?;
    Some((*model, fmi))
}

impl Model {
    /// Returns the committed modelDescription.xml.
    pub(crate) fn description(&self, fmi: Fmi) -> Result<Vec<u8>> {
        let file = match fmi {
            Fmi::V2 => "modelDescription.xml",
            Fmi::V3 => "fmi3/modelDescription.xml",
            Fmi::V3Arrays => "fmi3-arrays/modelDescription.xml",
        };
        read(&self.folder().join(file))
    }

    /// The folder with all that travels with the binary.
    pub fn folder(&self) -> PathBuf {
        root().join("modelDescription").join(self.name)
    }

    /// The example with its reference result, in the FMU and in the model's own folder: where the layered standard
    /// FMI-LS-REF has such files. Folders in `extra` are named by reversed domain names, and the project has no domain.
    pub fn example(&self) -> PathBuf {
        self.folder().join(REFERENCES)
    }

    /// The software bill of materials (SBOM) in the FMU: what is in the binary, and under which licence.
    pub fn sbom(&self) -> String {
        format!("documentation/licenses/{}.cdx.json", self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_all_fmus_lead_back_to_them() {
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
