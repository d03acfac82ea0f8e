//! A host for the HubSlosh FMU: packs it, drives it, looks at what comes out.
//!
//! It meets the FMU only as any other host does: as a packed `.fmu`, through
//! its C ABI. No code is shared with the model.

pub mod analysis;
pub mod binary;
pub mod campaign;
pub mod check;
pub mod components;
pub mod description;
pub mod documentation;
pub mod example;
pub mod fmi2;
pub mod gyro;
pub mod html;
pub mod noise;
pub mod output;
pub mod pack;
pub mod plan;
pub mod platforms;
pub mod profile;
pub mod random;
pub mod release;
pub mod report;
pub mod run;
pub mod scaling;
pub mod svg;
pub mod table;
