//! The documentation's page of all variables, from the FMU's variable table.

use std::fmt::Write as _;
use std::path::PathBuf;

use runtime::Model;
use runtime::variable::{Causality, Kind, Value, Variable};

/// Path of the committed page.
pub fn path<M: Model>() -> PathBuf {
    crate::folder::<M>().join("documentation").join("variables.md")
}

const CHAPTERS: [(Causality, &str, &str); 5] = [
    (
        Causality::Input,
        "Inputs",
        "The host sets them at any time, also before the first step. They are held over a step, \
         or run along the slope that the host sets.",
    ),
    (Causality::Output, "Outputs", "Meant to be connected and plotted."),
    (
        Causality::Parameter,
        "Parameters",
        "The host sets them before the simulation starts; those marked *tunable* between steps \
         as well. A value outside its range is refused with its name and what is allowed; what \
         only together makes no sense is reported when initialization mode ends, all of it at \
         once.",
    ),
    (
        Causality::CalculatedParameter,
        "Calculated parameters",
        "What follows from the parameters, known when initialization mode is entered.",
    ),
    (
        Causality::Local,
        "Local variables",
        "For looking inside: balances, events, the continuous states and their derivatives.",
    ),
];

/// The page's text, Markdown.
pub fn page<M: Model>() -> String {
    let mut page = String::from(
        "<!-- Written by `cargo run --release -p model-description`; do not edit. -->\n\
         # All variables\n\n\
         Values cross the interface in the unit given first; the one in brackets is what tools \
         are asked to display. A name with [1..10] stands for ten variables. Ranges are those the FMU holds the host to.\n",
    );
    for (causality, title, introduction) in CHAPTERS {
        let _ = write!(page, "\n## {title}\n\n{introduction}\n\n");
        let set_by_host = matches!(causality, Causality::Input | Causality::Parameter);
        page.push_str(if set_by_host {
            "| name | unit | start | min | max | meaning |\n| --- | --- | --- | --- | --- | --- |\n"
        } else {
            "| name | unit | meaning |\n| --- | --- | --- |\n"
        });
        for variable in M::table().variables.iter().filter(|v| v.causality == causality) {
            let _ = write!(page, "| `{}` | {} |", name(variable), unit(variable));
            if set_by_host {
                let (min, max) = range(variable);
                let _ = write!(page, " {} | {min} | {max} |", start(variable));
            }
            let _ = writeln!(page, " {}{} |", variable.description, notes(variable));
        }
    }
    page.push_str(
        "\n## Enumerations\n\n| type | number | name | meaning |\n| --- | --- | --- | --- |\n",
    );
    for of in M::table().enumerations() {
        for (item, number) in of.items.iter().zip(1..) {
            let (name, description) = (item.name, item.description);
            let _ = writeln!(page, "| {} | {number} | `{name}` | {description} |", of.name);
        }
    }
    page
}

fn name<M: Model>(variable: &Variable<M>) -> String {
    variable.pattern()
}

fn unit<M: Model>(variable: &Variable<M>) -> String {
    match variable.kind {
        Kind::Real(quantity) => match (quantity.unit, quantity.display_unit) {
            ("", _) => "depends on `slosh.model`".into(),
            (unit, None) => unit.into(),
            (unit, Some(displayed)) => format!("{unit} ({displayed})"),
        },
        Kind::Integer { .. } => "integer".into(),
        Kind::Boolean => "true or false".into(),
        Kind::Enumeration(of) => of.name.into(),
    }
}

fn start<M: Model>(variable: &Variable<M>) -> String {
    let start = variable.start(&mut M::Parameters::default(), &mut M::Inputs::default(), 0);
    match (start, variable.kind) {
        (Some(Value::Integer(n)), Kind::Enumeration(of)) => {
            let item = usize::try_from(n - 1).ok().and_then(|n| of.items.get(n));
            format!("`{}`", item.map_or("", |item| item.name))
        }
        (Some(Value::Real(x)), _) => number(x),
        (Some(Value::Integer(n)), _) => n.to_string(),
        (Some(Value::Boolean(b)), _) => b.to_string(),
        (None, _) => String::new(),
    }
}

fn range<M: Model>(variable: &Variable<M>) -> (String, String) {
    match variable.kind {
        Kind::Real(quantity) => {
            let text = |x: Option<f64>| x.map(number).unwrap_or_default();
            (text(quantity.min), text(quantity.max))
        }
        Kind::Integer { min, max } => {
            let text = |n: Option<i32>| n.map(|n| n.to_string()).unwrap_or_default();
            (text(min), text(max))
        }
        _ => (String::new(), String::new()),
    }
}

/// Number in the usual notation: powers of ten only in place of many zeros.
fn number(x: f64) -> String {
    if x == 0.0 || (1e-4..1e5).contains(&x.abs()) { format!("{x}") } else { format!("{x:e}") }
}

fn notes<M: Model>(variable: &Variable<M>) -> &'static str {
    match (variable.tunable, variable.state.is_some()) {
        (true, _) => " (*tunable*)",
        (_, true) => " (*continuous state*)",
        _ => "",
    }
}
