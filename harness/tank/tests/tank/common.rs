use std::path::Path;

use hubslosh_tank::{ModalData, Tank};
use serde_json::Value;

/// Reads `tanks.json`, 23 tanks that an independent program has solved (linear potential flow, five
/// modes; the box in closed form). `error` of a tank is the largest difference between two
/// discretisations of that program, 1e-12 to 1e-10; `error_beta` is this difference for `beta`, the
/// quotient of integrals that determines the damping by the laminar layer. Values have twelve
/// digits, wave_peak nine.
pub fn reference() -> Vec<Value> {
    let all: Value = serde_json::from_str(include_str!("../tanks.json")).unwrap();
    all["cases"].as_array().unwrap().clone()
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

pub fn toml(case: &Value) -> String {
    let rho = number(&case["rho"]);
    let shape = if case["kind"] == "box" {
        format!("box = [{}, {}]", case["length_x"], case["length_y"])
    } else {
        let entries = case["profile"].as_array().unwrap().iter().map(|entry| {
            let (kind, numbers) = entry.as_object().unwrap().iter().next().unwrap();
            format!("{{ {kind} = {numbers} }}")
        });
        format!("profile = [{}]", entries.collect::<Vec<_>>().join(", "))
    };
    format!("name = {}\ndensity = {rho:?}\n{shape}\n", case["name"])
}

pub fn tank(text: &str) -> Tank {
    Tank::parse(text, Path::new("")).unwrap_or_else(|problems| panic!("{text}: {problems}"))
}

pub fn solve(text: &str, fill: f64, modes: usize) -> ModalData {
    let tank = tank(&format!("density = 1000.0\n{text}"));
    tank.solve(fill, modes).unwrap_or_else(|problems| panic!("{text}: {problems}"))
}
