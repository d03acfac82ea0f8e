//! Writes the documentation page with all variables from the variable table of an FMU.

use std::fmt::Write as _;
use std::path::PathBuf;

use runtime::Model;
use runtime::variable::{Causality, Kind, Value, Variable};

pub fn path<M: Model>() -> PathBuf {
    crate::folder::<M>().join("documentation").join("variables.md")
}

const CHAPTERS: [(Causality, &str, &str); 5] = [
    (
        Causality::Input,
        "Inputs",
        "The host may set inputs at any time, also before the first step. An input is held over a step, \
         or is linear over the step if the host sets its derivative.",
    ),
    (Causality::Output, "Outputs", "Results that a host connects to other models, or plots."),
    (
        Causality::Parameter,
        "Parameters",
        "The host sets parameters before the simulation starts, and parameters that are marked *tunable* also between \
         steps. The FMU refuses a value outside the range of its parameter; the message states the name and the range. \
         One message at the end of initialization mode lists all contradictions between parameters.",
    ),
    (
        Causality::CalculatedParameter,
        "Calculated parameters",
        "Values that follow from the parameters. They can be read from the beginning of initialization mode on.",
    ),
    (
        Causality::Local,
        "Local variables",
        "Internal values: energy balance, events, the continuous states and their derivatives.",
    ),
];

pub fn page<M: Model>() -> String {
    let model = M::table().about.model;
    let mut page = format!(
        "<!-- Written by `cargo run --release -p model-description`; do not edit. -->\n\
         # All variables of {model}\n\n\
         Which variables does the FMU have, in which units and ranges?\n\n\
         Host and FMU exchange values in the first unit of the column \"unit\"; the unit in brackets is for display. The \
         FMU refuses values outside the ranges.",
    );
    if let Some(array) = M::table().variables.iter().find(|v| !v.shape.is_empty()) {
        let _ = write!(
            page,
            " A name with ranges of indices is an array: `{}` stands for {} variables.",
            name(array),
            array.len()
        );
    }
    page.push_str(
        " A list of start values has a value for each element of an array; semicolons separate the rows of the last index. If \
         the list is shorter than the array, it is valid for each value of the first index.\n",
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
            ("", _) if has_slosh_model::<M>() => "depends on `slosh.model`".into(),
            ("", _) => "see meaning".into(),
            (unit, None) => unit.into(),
            (unit, Some(displayed)) => format!("{unit} ({displayed})"),
        },
        Kind::Integer { .. } => "integer".into(),
        Kind::Boolean => "true or false".into(),
        Kind::Enumeration(of) => of.name.into(),
    }
}

fn has_slosh_model<M: Model>() -> bool {
    M::table().variables.iter().any(|v| v.name == "slosh.model")
}

/// Returns the start values of a variable for the page of variables. If all elements have the same
/// value, only this value is returned; if all blocks along the first index are equal, only the
/// first block is returned.
fn start<M: Model>(variable: &Variable<M>) -> String {
    let (mut parameters, mut inputs) = (M::Parameters::default(), M::Inputs::default());
    let starts: Vec<_> = (0..variable.len())
        .map(|element| start_text(variable, variable.start(&mut parameters, &mut inputs, element)))
        .collect();
    if starts.iter().all(|start| *start == starts[0]) {
        return starts[0].clone();
    }
    let lengths: Vec<usize> = variable.lengths().collect();
    let block = starts.len() / lengths[0];
    let repeats = lengths.len() > 1 && starts.chunks(block).all(|other| *other == starts[..block]);
    let shown = if repeats { &starts[..block] } else { &starts[..] };
    let rows = shown.chunks(lengths[lengths.len() - 1]).map(|row| row.join(", "));
    rows.collect::<Vec<_>>().join("; ")
}

fn start_text<M: Model>(variable: &Variable<M>, start: Option<Value>) -> String {
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

/// Formats a number for the page of variables: without an exponent if it is 0 or its magnitude is
/// 1e-4 to 1e5, otherwise with a power of ten.
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
