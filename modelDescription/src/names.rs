//! Writes a module of the harness with the names of an FMU (variables, items of enumerations, array sizes),
//! from the variable table.

use std::fmt::Write as _;
use std::path::PathBuf;

use runtime::Model;
use runtime::variable::{Access, Causality, Dimension, Kind, Variable};

pub fn path<M: Model>() -> PathBuf {
    let file = format!("{}.rs", M::table().about.model.to_lowercase());
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../harness/names/src").join(file)
}

#[derive(Default)]
struct Module {
    constants: Vec<String>,
    modules: Vec<(String, Module)>,
}

impl Module {
    fn inner(&mut self, name: &str) -> &mut Module {
        let at = self.modules.iter().position(|(known, _)| known == name).unwrap_or_else(|| {
            self.modules.push((name.into(), Module::default()));
            self.modules.len() - 1
        });
        &mut self.modules[at].1
    }

    fn write(&self, indent: &str, text: &mut String) {
        for constant in &self.constants {
            let line = format!("{indent}pub const {constant};");
            // rustfmt breaks lines of more than 100 columns in this way.
            let broken = format!(" =\n{indent}    ");
            let line = if line.len() > 100 { line.replacen(" = ", &broken, 1) } else { line };
            let _ = writeln!(text, "{line}");
        }
        for (name, module) in &self.modules {
            let _ = writeln!(text, "\n{indent}pub mod {name} {{");
            module.write(&format!("{indent}    "), text);
            let _ = writeln!(text, "{indent}}}");
        }
    }
}

/// Returns the source text of a module of `harness/names` with the names of an FMU's variables: a
/// constant for each variable except derivatives. Each part of a variable's name before a full stop
/// becomes a submodule.
pub fn module<M: Model>() -> String {
    let table = M::table();
    let mut root = Module::default();
    let named = |v: &&Variable<M>| !matches!(v.access, Access::Derivative(_));
    for variable in table.variables.iter().filter(named) {
        let (mut module, mut rest) = (&mut root, variable.name);
        while let Some((part, after)) = rest.split_once('.') {
            (module, rest) = (module.inner(part.trim_end_matches("[]")), after);
        }
        let (constant, name) = (rest.trim_end_matches("[]").to_uppercase(), variable.name);
        module.constants.push(match variable.shape.len() {
            0 => format!("{constant}: &str = {name:?}"),
            dimensions => {
                format!("{constant}: crate::Array<{dimensions}> = crate::Array({name:?})")
            }
        });
        if let Some(most) = size(variable) {
            module.constants.push(format!("MOST_{constant}: usize = {most}"));
        }
    }
    let mut text = format!(
        "//! Names of {}.fmu. Written by `cargo run --release -p model-description`; do not edit.\n\n",
        table.about.model
    );
    root.write("", &mut text);
    text += &sizes::<M>();
    for of in table.enumerations() {
        let items = of.items.iter().zip(1..);
        let items: Vec<_> = items
            .map(|(item, value)| format!("{} = {value} {:?}", camel(item.name), item.name))
            .collect();
        let _ = write!(text, "\nenumeration! {{\n    {}: {}\n}}\n", of.name, items.join(", "));
    }
    text
}

/// Returns the largest value of `variable` if it is an integer parameter that is the length of an
/// array. Returns `None` for the integer variables that have the same meaning as an enumeration or
/// a Boolean.
fn size<M: Model>(variable: &Variable<M>) -> Option<i32> {
    let Kind::Integer { max: Some(max), .. } = variable.kind else { return None };
    let lengths = |v: &Variable<M>| v.shape.iter().any(|d| i32::try_from(d.most()) == Ok(max));
    let counts = variable.causality == Causality::Parameter && !variable.name.ends_with("kind");
    (counts && M::table().variables.iter().any(lengths)).then_some(max)
}

fn sizes<M: Model>() -> String {
    let mut text = String::new();
    for (parameter, most) in M::table().sizes() {
        let _ = write!(
            text,
            "    crate::Size {{\n        parameter: {parameter:?},\n        most: {most},\n        \
             has_indicators: {},\n        arrays: &[\n",
            M::INDICATORS_OF == Some(parameter)
        );
        let at = |d: &Dimension| match d {
            Dimension::Sized(name, _) | Dimension::Used(name, _) => *name == parameter,
            Dimension::Fixed(_) => false,
        };
        let mut line = String::from("           ");
        for variable in M::table().variables {
            let Some(place) = variable.shape.iter().position(at) else { continue };
            let array = format!(" ({:?}, {place}),", variable.name);
            if line.len() + array.len() > 100 {
                text += &line;
                line = String::from("\n           ");
            }
            line += &array;
        }
        text += &format!("{line}\n        ],\n    }},\n");
    }
    format!(
        "\n/// Parameters that determine the sizes of arrays.\n#[rustfmt::skip]\npub const SIZES: &[crate::Size] = &[\n{text}];\n"
    )
}

fn camel(name: &str) -> String {
    let parts = name.split('_').filter_map(|part| {
        let first = part.chars().next()?.to_uppercase();
        Some(first.chain(part.chars().skip(1)).collect::<String>())
    });
    parts.collect()
}
