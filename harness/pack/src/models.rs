//! The FMUs that this project packs. Another one is another entry in [`MODELS`].

use std::ffi::OsString;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use host::description::did_you_mean;

use crate::archive::read;
use crate::fmi::Fmi;
use crate::project::{self, root};

/// The folder of the layered standard FMI-LS-REF in an FMU.
pub const REFERENCES: &str = "extra/org.fmi-standard.fmi-ls-ref";

/// An FMU of this project.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Model {
    /// Its `modelIdentifier`, but of a variant; the folder `modelDescription/<name>` has all that travels with the
    /// binary: `modelDescription.xml`, `documentation/`, and, if
    /// there is one, `extra/`.
    pub name: &'static str,
    /// Cargo package whose cdylib is the binary.
    pub package: &'static str,
    /// Sizes of a variant for fewer tanks and modes.
    pub sizes: Option<Sizes>,
}

/// Numbers of tanks and of modes per tank in a variant of Spacecraft; those of the full FMU are the largest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// 1 to 4.
    pub tanks: usize,
    /// 1 to 3.
    pub modes: usize,
}

/// Sizes of Spacecraft.fmu.
const MOST: Sizes = Sizes { tanks: 4, modes: 3 };

/// Sizes of the variants of Spacecraft in wheels.
const VARIANTS: [Sizes; 2] = [Sizes { tanks: 1, modes: 1 }, Sizes { tanks: 2, modes: 2 }];

/// All of them; the first is packed unless another is named.
pub const MODELS: [Model; 3] = [
    Model { name: "HubSlosh", package: "hubslosh-fmu", sizes: None },
    Model { name: "Spacecraft", package: "spacecraft-fmu", sizes: None },
    Model { name: "SloshTank", package: "sloshtank-fmu", sizes: None },
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

/// FMUs in wheels: all models, and variants of Spacecraft for fewer tanks and modes.
pub fn in_wheels() -> impl Iterator<Item = Model> {
    let variants = VARIANTS.map(|sizes| Model { sizes: Some(sizes), ..MODELS[1] });
    MODELS.into_iter().chain(variants)
}

/// Finds an FMU by its name: `Spacecraft`, a variant such as `Spacecraft_2x2`, and either for FMI 3.0,
/// `Spacecraft_2x2-fmi3`.
pub fn named(name: &str) -> Option<(Model, Fmi)> {
    let fmi = Fmi::ALL.into_iter().rev().find(|fmi| name.ends_with(fmi.suffix()))?;
    let identifier = name.strip_suffix(fmi.suffix())?;
    if let Ok(model) = model(identifier) {
        return Some((*model, fmi));
    }
    let (name, sizes) = identifier.rsplit_once('_')?;
    let (tanks, modes) = sizes.split_once('x')?;
    let variant = model(name).ok()?.variant(Some(tanks.parse().ok()?), Some(modes.parse().ok()?));
    Some((variant.ok()?, fmi))
}

impl Model {
    /// The variant for fewer tanks and modes.
    ///
    /// # Errors
    /// If the FMU has no such variant.
    pub fn variant(&self, tanks: Option<usize>, modes: Option<usize>) -> Result<Model> {
        let sizes =
            Sizes { tanks: tanks.unwrap_or(MOST.tanks), modes: modes.unwrap_or(MOST.modes) };
        ensure!(
            self.name == "Spacecraft",
            "{} has no variants: --tanks and --modes are for Spacecraft",
            self.name
        );
        ensure!(
            (1..=MOST.tanks).contains(&sizes.tanks) && (1..=MOST.modes).contains(&sizes.modes),
            "--tanks {}, --modes {} (allowed: 1 to {}, 1 to {})",
            sizes.tanks,
            sizes.modes,
            MOST.tanks,
            MOST.modes
        );
        Ok(Model { sizes: Some(sizes).filter(|sizes| *sizes != MOST), ..*self })
    }

    /// Its `modelIdentifier`: the name, and of a variant its sizes, so that a host can load several.
    pub fn identifier(&self) -> String {
        match self.sizes {
            None => self.name.into(),
            Some(Sizes { tanks, modes }) => format!("{}_{tanks}x{modes}", self.name),
        }
    }

    /// Environment for Cargo: the sizes of a variant, and a target folder of its own.
    pub(crate) fn environment(&self) -> Vec<(&'static str, OsString)> {
        let Some(Sizes { tanks, modes }) = self.sizes else { return Vec::new() };
        vec![
            ("HUBSLOSH_TANKS", tanks.to_string().into()),
            ("HUBSLOSH_MODES", modes.to_string().into()),
            ("CARGO_TARGET_DIR", root().join("target/variants").into()),
        ]
    }

    /// modelDescription.xml: the committed one, or what the variant's table says.
    pub(crate) fn description(&self, fmi: Fmi) -> Result<Vec<u8>> {
        let (file, print) = match fmi {
            Fmi::V2 => ("modelDescription.xml", "--print-spacecraft"),
            Fmi::V3 => ("fmi3/modelDescription.xml", "--print-spacecraft-fmi3"),
            Fmi::V3Arrays => ("fmi3-arrays/modelDescription.xml", "--print-spacecraft-fmi3-arrays"),
        };
        match self.sizes {
            None => read(&self.folder().join(file)),
            Some(_) => project::output(
                &["run", "--release", "--quiet", "--package", "model-description"],
                &[print],
                &self.environment(),
            ),
        }
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
        for model in in_wheels() {
            for fmi in Fmi::ALL {
                let name = format!("{}{}", model.identifier(), fmi.suffix());
                assert_eq!(named(&name), Some((model, fmi)), "{name}");
            }
        }
        assert_eq!(named("Spacecraft_4x3"), Some((MODELS[1], Fmi::V2)), "the full FMU");
        for wrong in ["Spacecraft_5x1", "Spacecraft_x", "SloshTank_1x1", "Spacecraft.fmu", ""] {
            assert_eq!(named(wrong), None, "{wrong}");
        }
    }
}
