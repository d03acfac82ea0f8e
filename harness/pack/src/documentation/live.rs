//! Live pages of the book: plants that run in the page, as WebAssembly. Such a page is Markdown with a picture of itself;
//! scripts put the plant into the picture's place, so without JavaScript the picture stays.
//!
//! The scripts are files of the site that only live pages load. An FMU is one of them, as base64: a page opened from the
//! disk may load no data.

use anyhow::Result;
use base64ct::{Base64, Encoding};
use maud::{Markup, html};

use super::Files;
use super::page::Page;
use crate::archive;
use crate::fmi::Fmi;
use crate::models::Model;

/// A plant that live pages run.
pub struct Plant {
    /// Which FMU.
    pub model: &'static Model,
    /// Its module for WebAssembly.
    pub module: Vec<u8>,
}

struct Live {
    /// Name of the page.
    page: &'static str,
    /// Name of its FMU.
    model: &'static str,
    /// Names and texts of the scripts that are the page's own, in the order of their use.
    scripts: &'static [(&'static str, &'static str)],
}

const LIVE: [Live; 2] = [
    Live { page: "swirl", model: "HubSlosh", scripts: &[("swirl.js", web::SWIRL)] },
    Live {
        page: "slew",
        model: "Spacecraft",
        scripts: &[("loop.js", web::LOOP), ("slew.js", web::SLEW)],
    },
];

/// The names of the FMUs that live pages run.
pub fn models() -> impl Iterator<Item = &'static str> {
    LIVE.iter().map(|live| live.model)
}

/// What the head of a page has besides, if it is live and there is a plant for it.
pub fn head(page: &Page, plants: &[Plant]) -> Markup {
    let live = LIVE.iter().find(|live| live.page == page.name);
    let live = live.filter(|live| plants.iter().any(|plant| plant.model.name == live.model));
    html! {
        @if let Some(live) = live {
            link rel="stylesheet" href="live.css";
            @for script in ["three.js", "scene.js", "fmu.js", "live.js"] { script src=(script) defer {} }
            script src=(script_of(live.model)) defer {}
            @for (name, _) in live.scripts { script src=(name) defer {} }
        }
    }
}

/// The files that live pages load; none without plants.
///
/// # Errors
/// If an FMU's description cannot be read.
pub fn files(plants: &[Plant]) -> Result<Files> {
    let mut files = Files::new();
    if plants.is_empty() {
        return Ok(files);
    }
    let three = format!("/*\n{}*/\n{}", web::THREE_LICENSE, web::THREE);
    files.push(("three.js".into(), three.into_bytes()));
    files.push(("scene.js".into(), web::SCENE.into()));
    files.push(("fmu.js".into(), web::fmu_host().into_bytes()));
    files.push(("live.js".into(), web::LIVE.into()));
    files.push(("live.css".into(), web::LIVE_CSS.into()));
    for (name, text) in LIVE.iter().flat_map(|live| live.scripts) {
        files.push(((*name).into(), (*text).into()));
    }
    for Plant { model, module } in plants {
        let name = model.name;
        let fmu = archive::zipped(&[
            ("modelDescription.xml".into(), model.description(Fmi::V2)?),
            (format!("binaries/wasm32/{name}.wasm"), module.clone()),
        ])?;
        let fmu = Base64::encode_string(&fmu);
        let text = format!("(globalThis.FMUS ??= {{}}).{name} = \"{fmu}\";\n");
        files.push((script_of(name), text.into_bytes()));
    }
    Ok(files)
}

fn script_of(model: &str) -> String {
    format!("{model}.fmu.js")
}
