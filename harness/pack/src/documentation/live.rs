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
use crate::platforms;

/// WebAssembly module of a live page.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Needed {
    /// The FMU of that name.
    Fmu(&'static str),
    /// The tank solver.
    Tank,
}

impl Needed {
    /// The script that holds it.
    fn script(self) -> String {
        match self {
            Needed::Fmu(name) => format!("{name}.fmu.js"),
            Needed::Tank => "tank.wasm.js".into(),
        }
    }
}

/// A module for WebAssembly that a live page computes with.
pub struct Module {
    /// FMU or tank solver in the module.
    pub needed: Needed,
    /// The module.
    pub bytes: Vec<u8>,
}

struct Live {
    /// Name of the page.
    page: &'static str,
    needed: Needed,
    /// Names and texts of the scripts that are the page's own, in the order of their use.
    scripts: &'static [(&'static str, &'static str)],
}

const LIVE: [Live; 3] = [
    Live { page: "swirl", needed: Needed::Fmu("HubSlosh"), scripts: &[("swirl.js", web::SWIRL)] },
    Live {
        page: "slew",
        needed: Needed::Fmu("Spacecraft"),
        scripts: &[("loop.js", web::LOOP), ("slew.js", web::SLEW)],
    },
    Live { page: "your_tank", needed: Needed::Tank, scripts: &[("your_tank.js", web::YOUR_TANK)] },
];

/// WebAssembly modules of all live pages.
pub fn needed() -> impl Iterator<Item = Needed> {
    LIVE.iter().map(|live| live.needed)
}

/// Builds what the live pages compute with.
///
/// # Errors
/// If something is missing for it, or if it does not build.
pub fn build() -> Result<Vec<Module>> {
    let built = |needed| {
        let bytes = match needed {
            Needed::Fmu(name) => crate::wasm(crate::model(name)?)?.bytes,
            Needed::Tank => platforms::build_tank_page()?,
        };
        Ok(Module { needed, bytes })
    };
    needed().map(built).collect()
}

/// Additional head of a live page whose module is present.
pub fn head(page: &Page, modules: &[Module]) -> Markup {
    let live = LIVE.iter().find(|live| live.page == page.name);
    let live = live.filter(|live| modules.iter().any(|module| module.needed == live.needed));
    html! {
        @if let Some(live) = live {
            link rel="stylesheet" href="live.css";
            @for script in ["three.js", "scene.js", "fmu.js", "live.js"] { script src=(script) defer {} }
            script src=(live.needed.script()) defer {}
            @for (name, _) in live.scripts { script src=(name) defer {} }
        }
    }
}

/// The files that live pages load; none without modules.
///
/// # Errors
/// If an FMU's description cannot be read.
pub fn files(modules: &[Module]) -> Result<Files> {
    let mut files = Files::new();
    if modules.is_empty() {
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
    for Module { needed, bytes } in modules {
        let (global, name, packed) = match needed {
            Needed::Fmu(name) => {
                let description = crate::model(name)?.description(Fmi::V2)?;
                let module = format!("binaries/wasm32/{name}.wasm");
                let files = [("modelDescription.xml".into(), description), (module, bytes.clone())];
                ("FMUS", *name, archive::zipped(&files)?)
            }
            Needed::Tank => {
                ("MODULES", "tank", archive::zipped(&[("tank.wasm".into(), bytes.clone())])?)
            }
        };
        let packed = Base64::encode_string(&packed);
        let text = format!("(globalThis.{global} ??= {{}}).{name} = \"{packed}\";\n");
        files.push((needed.script(), text.into_bytes()));
    }
    Ok(files)
}
