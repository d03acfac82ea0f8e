//! Writes a model description that contains only part of the variables, for hosts that show every variable to the user.
//! The binary of the FMU stays the same: it reads the array sizes from the GUID, and start values other than its own
//! from a file in the resources.
//!
//! `fmu/runtime/src/extent.rs` reads both in the FMU, and describes the formats of the GUID and of the file.

use std::collections::BTreeMap;
use std::ops::Range;

use anyhow::{Context, Result, bail, ensure};
use roxmltree::{Document, Node};

use crate::description::{ModelDescription, Value};

pub const START_VALUES: &str = "resources/start_values.txt";

/// Number of tanks, modes or appendages that a reduced description keeps.
///
/// - `parameter`: the parameter of the FMU for this number, for example `tanks`.
/// - `size`, `most`: the number to keep, and the number in the full description.
/// - `has_indicators`: true if each element of the arrays has its own event indicators.
/// - `arrays`: the arrays that become shorter, each with the position of the index that counts the
///   elements. For example, in `tank[1].p[2,3]` the index at position 0 counts tanks, and the index
///   at position 1 counts modes.
#[derive(Clone, Copy, Debug)]
pub struct Limit<'a> {
    pub parameter: &'a str,
    pub size: usize,
    pub most: usize,
    pub has_indicators: bool,
    pub arrays: &'a [(&'a str, usize)],
}

#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    pub xml: String,
    pub start_values: Option<String>,
}

/// Converts `settings`, pairs of a name and a text as a user writes it (for example `50 mm`), to
/// start values in the format of FMI, by name.
///
/// # Errors
///
/// If the description has no such variable, or a text is not a value of the variable's type.
pub fn start_values(
    description: &ModelDescription,
    settings: impl IntoIterator<Item = (String, String)>,
) -> Result<BTreeMap<String, String>> {
    let start = |(name, text): (String, String)| {
        let value = match description.value(description.variable(&name)?, &text)? {
            Value::Real(x) => format!("{x:?}"),
            Value::Integer(n) => n.to_string(),
            Value::Boolean(b) => b.to_string(),
            Value::String(text) => text,
        };
        Ok((name, value))
    };
    settings.into_iter().map(start).collect()
}

/// Reduces a model description to fewer tanks, modes or appendages, so that people who click in a
/// tool see only the variables that they use. `xml` is the full description, `limits` has the
/// number of each kind, and `starts` has start values by name, in the format of FMI, that replace
/// the values in the description.
///
/// # Errors
///
/// If a limit is above the largest value, a parameter in `starts` is not in the reduced
/// description, or the XML is not a description of scalars from this project.
pub fn describe(xml: &str, limits: &[Limit], starts: &BTreeMap<String, String>) -> Result<Part> {
    for limit in limits {
        let Limit { parameter, size, most, .. } = limit;
        ensure!(size <= most, "{parameter} = {size} (allowed: 0 to {most})");
    }
    let document = Document::parse(xml).context("modelDescription.xml")?;
    let root = document.root_element();
    let fmi2 = root.attribute("fmiVersion").is_some_and(|version| version.starts_with('2'));
    let mut edits = Edits(Vec::new());
    let indicators = indicators(&root, limits);
    let mut renumbered: BTreeMap<String, String> = BTreeMap::new();
    let (mut states, mut written) = (0, String::new());
    let mut left: BTreeMap<&String, &String> = starts.iter().collect();
    let variables = child(&root, "ModelVariables")?;
    for (old, variable) in (1_usize..).zip(variables.children().filter(Node::is_element)) {
        let name = variable.attribute("name").unwrap_or_default();
        if !(is_within(name, limits) && is_indicator(name).is_none_or(|n| n <= indicators)) {
            edits.remove(xml, &variable);
            continue;
        }
        let number = if fmi2 {
            (old.to_string(), (renumbered.len() + 1).to_string())
        } else {
            let reference = variable.attribute("valueReference").unwrap_or_default();
            (reference.to_string(), reference.to_string())
        };
        renumbered.insert(number.0, number.1);
        let typed =
            if fmi2 { variable.first_element_child().unwrap_or(variable) } else { variable };
        states += usize::from(typed.has_attribute("derivative"));
        let limit = limits.iter().find(|limit| pattern(name).0 == limit.parameter);
        if let Some(limit) = limit {
            edits.set(&typed, "max", &limit.size.to_string());
        }
        let now = typed.attribute("start").unwrap_or_default();
        let clipped = limit.and_then(|limit| Some(now.parse::<usize>().ok()?.min(limit.size)));
        match left.remove_entry(&name.to_string()) {
            Some((_, start)) => {
                edits.set(&typed, "start", start);
                written += &format!("{name} = {start}\n");
            }
            None if limit.is_some() => {
                edits.set(&typed, "start", &clipped.unwrap_or_default().to_string());
            }
            None => {}
        }
    }
    if let Some(name) = left.keys().next() {
        bail!(
            "the description has no parameter {name} (allowed: parameters of its tanks and modes)"
        );
    }
    // The numbers of states are changed at the end, because the derivative of a state may precede the state.
    for node in variables.descendants().filter(|node| node.has_attribute("derivative")) {
        if let Some(new) = renumbered.get(node.attribute("derivative").unwrap_or_default()) {
            edits.set(&node, "derivative", new);
        }
    }
    let key = if fmi2 { "index" } else { "valueReference" };
    for unknown in child(&root, "ModelStructure")?.descendants().filter(|n| n.has_attribute(key)) {
        match renumbered.get(unknown.attribute(key).unwrap_or_default()) {
            None => edits.remove(xml, &unknown),
            Some(new) => {
                edits.set(&unknown, key, new);
                let listed = |name| unknown.attribute(name).unwrap_or_default().split_whitespace();
                let is_kept = |known: &&str| renumbered.contains_key(*known);
                let known: Vec<_> =
                    listed("dependencies").filter_map(|k| renumbered.get(k)).collect();
                let kinds = listed("dependencies").zip(listed("dependenciesKind"));
                let kinds = kinds.filter(|(known, _)| is_kept(known)).map(|(_, kind)| kind);
                let known: Vec<_> = known.into_iter().map(String::as_str).collect();
                edits.set(&unknown, "dependencies", &known.join(" "));
                edits.set(&unknown, "dependenciesKind", &kinds.collect::<Vec<_>>().join(" "));
            }
        }
    }
    let key = if fmi2 { "guid" } else { "instantiationToken" };
    let token = root.attribute(key).context("modelDescription.xml has no GUID")?;
    let start_values = (!written.is_empty()).then_some(written);
    edits.set(&root, key, &token_of_part(token, limits, states, start_values.as_deref())?);
    edits.set(&root, "numberOfEventIndicators", &indicators.to_string());
    Ok(Part { xml: edits.apply_to(xml), start_values })
}

/// Returns the GUID of a reduced description, from which the binary recognises the sizes: `whole`
/// is the GUID of the full description, `states` the number of continuous states, and
/// `start_values` the text of changed start values. The format is described in
/// `fmu/runtime/src/extent.rs`.
fn token_of_part(
    whole: &str,
    limits: &[Limit],
    states: usize,
    start_values: Option<&str>,
) -> Result<String> {
    ensure!(
        whole.len() == 38 && whole.is_ascii() && (1..=3).contains(&limits.len()) && states < 256,
        "tanks, modes and appendages can be left out only of FMUs of this project, and the GUID of this FMU has \
         another form"
    );
    let sizes: String = limits.iter().map(|limit| format!("{:x}", limit.size)).collect();
    let sum = start_values.map_or(0, |text| (fnv(text.as_bytes()) & 0xffff).max(1));
    Ok(format!("{}{sizes:0<3}{states:02x}{sum:04x}}}", &whole[..28]))
}

fn fnv(bytes: &[u8]) -> u128 {
    bytes.iter().fold(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d, |hash: u128, byte| {
        (hash ^ u128::from(*byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b)
    })
}

/// Splits the name of an array element into a name without indices, as [`Limit::arrays`] has it,
/// and the indices. For example, `tank[1].p[2,3]` becomes `tank[].p` and 1, 2, 3.
fn pattern(name: &str) -> (String, Vec<usize>) {
    let (mut text, mut indices, mut rest) = (String::new(), Vec::new(), name);
    while let Some((before, after)) = rest.split_once('[') {
        let Some((inside, behind)) = after.split_once(']') else { break };
        indices.extend(inside.split(',').map(|index| index.parse().unwrap_or(0)));
        text += before;
        let ends = behind.is_empty() || behind == ")";
        text += if ends { "" } else { "[]" };
        rest = behind;
    }
    (text + rest, indices)
}

fn is_within(name: &str, limits: &[Limit]) -> bool {
    let (pattern, indices) = pattern(name);
    limits.iter().all(|limit| {
        let place =
            limit.arrays.iter().find(|(array, _)| *array == pattern).map(|(_, place)| place);
        place.and_then(|place| indices.get(*place)).is_none_or(|index| *index <= limit.size)
    })
}

/// Returns the number of the event indicator for a variable with the name `event_indicator[N]` in
/// FMI 3.0, or `None` for any other variable.
fn is_indicator(name: &str) -> Option<usize> {
    name.strip_prefix("event_indicator[")?.strip_suffix(']')?.parse().ok()
}

fn indicators(root: &Node, limits: &[Limit]) -> usize {
    let named = |node: &Node| node.attribute("name").and_then(is_indicator).is_some();
    let all = match root.attribute("numberOfEventIndicators") {
        Some(count) => count.parse().unwrap_or(0),
        None => root.descendants().filter(named).count(),
    };
    let of = limits.iter().find(|limit| limit.has_indicators);
    of.map_or(all, |limit| all / limit.most * limit.size)
}

fn child<'a>(root: &Node<'a, 'a>, name: &str) -> Result<Node<'a, 'a>> {
    let found = root.children().find(|child| child.has_tag_name(name));
    found.with_context(|| format!("modelDescription.xml has no {name}"))
}

struct Edits(Vec<(Range<usize>, String)>);

impl Edits {
    fn remove(&mut self, xml: &str, node: &Node) {
        let range = node.range();
        let begin = xml[..range.start].trim_end().len();
        self.0.push((begin..range.end, String::new()));
    }

    fn set(&mut self, node: &Node, name: &str, value: &str) {
        if let Some(attribute) = node.attribute_node(name) {
            self.0.push((attribute.range_value(), value.into()));
        }
    }

    fn apply_to(mut self, xml: &str) -> String {
        self.0.sort_by_key(|(range, _)| range.start);
        let (mut text, mut at) = (String::with_capacity(xml.len()), 0);
        for (range, value) in self.0 {
            // An attribute of an element that is removed is skipped.
            if range.start < at {
                continue;
            }
            text += &xml[at..range.start];
            text += &value;
            at = range.end;
        }
        text + &xml[at..]
    }
}
