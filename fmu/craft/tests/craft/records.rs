//! Reference records in ../six.json: motions that were computed with two other implementations of the equations, one of them
//! in 113-bit arithmetic. The entry `about` of the file describes the signals.

use craft::{
    Craft, DampingLaw, Inertia, Init, Inputs, Line, Mount, Parameters, Ramp, TANKS, Tank,
    TankInputs, TankParameters,
};
use serde_json::Value;

use super::component::{SloshTank, Spacecraft};

/// Communication step of the reference simulations, s. The inputs are linear in time within each
/// step.
pub const STEP: f64 = 0.02;

/// Reads the records of the kind `craft` or `tank`. The environment variable SIX_JSON may contain the path of another file
/// of the same form, for example of the complete records.
pub fn records(kind: &str) -> Vec<Value> {
    let text = match std::env::var("SIX_JSON") {
        Ok(file) => std::fs::read_to_string(file).unwrap(),
        Err(_) => include_str!("../six.json").into(),
    };
    let mut all: Value = serde_json::from_str(&text).unwrap();
    let Value::Array(records) = all["records"].take() else { panic!("no records") };
    records.into_iter().filter(|record| record["kind"] == kind).collect()
}

pub fn record(name: &str) -> Value {
    let all = records("craft").into_iter().chain(records("tank"));
    all.into_iter().find(|record| record["name"] == name).unwrap()
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

pub fn largest(record: &Value, signal: &str) -> f64 {
    record["largest"][signal].as_f64().unwrap_or_else(|| {
        numbers(&record["samples"][signal]).iter().fold(0.0, |a: f64, x| a.max(x.abs()))
    })
}

pub fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        one => vec![number(one)],
    }
}

fn array<const N: usize>(value: &Value, default: [f64; N]) -> [f64; N] {
    if value.is_null() { default } else { numbers(value).try_into().unwrap() }
}

fn tank(value: &Value) -> Tank {
    let modes = value["modes"].as_array().unwrap();
    let mut tank = Tank {
        position: array(&value["d"], [0.0; 3]),
        q: array(&value["q"], [0.0; 4]),
        m_0: number(&value["m_0"]),
        h_0: number(&value["H_0"]),
        i_0: number(&value["I_0"]),
        i_z: number(&value["I_z"]),
        modes: modes.len(),
        g_ref: 1.0,
        damping_law: DampingLaw::Constant,
        ..Tank::default()
    };
    for (n, mode) in modes.iter().enumerate() {
        let get = |name: &str| number(&mode[name]);
        (tank.mass[n], tank.length[n], tank.hinge[n]) = (get("m"), get("l"), get("h"));
        tank.k[n] = get("k");
        tank.zeta[n] = 0.5;
        // This inverts c = 2 zeta m sqrt(g_ref/l + k/m).
        tank.zeta[n] *= get("c") / tank.drag(n);
        tank.p_0[n] = array(&mode["p"], [0.0; 3]);
        tank.p_dot_0[n] = array(&mode["p_dot"], [0.0; 3]);
    }
    tank
}

pub fn parameters(record: &Value) -> Parameters {
    let (craft, init) = (&record["craft"], &record["init"]);
    let j = numbers(&craft["J"]);
    let tanks = record["tanks"].as_array().unwrap();
    let mut all = [Tank::default(); TANKS];
    for (to, from) in all.iter_mut().zip(tanks) {
        *to = tank(from);
    }
    Parameters {
        craft: Craft {
            mass: number(&craft["m"]),
            r: array(&craft["r"], [0.0; 3]),
            j: Inertia { xx: j[0], yy: j[4], zz: j[8], xy: j[1], xz: j[2], yz: j[5] },
        },
        mount: if record["mount"] == "pivot" { Mount::Pivot } else { Mount::Free },
        gravity: array(&record["g"], [0.0; 3]),
        tanks: tanks.len(),
        tank: all,
        init: Init {
            q: array(&init["q"], [1.0, 0.0, 0.0, 0.0]),
            omega: array(&init["w"], [0.0; 3]),
            position: array(&init["r"], [0.0; 3]),
            velocity: array(&init["v"], [0.0; 3]),
        },
        ..Parameters::default()
    }
}

pub fn tank_parameters(record: &Value) -> TankParameters {
    TankParameters { tank: tank(&record["tank"]), ..TankParameters::default() }
}

/// Returns an input of the craft between time knot `k` and the next knot, as a ramp (value and
/// slope). It is the sum of those elements of `terms` that belong to the input named `port`.
fn ramp(terms: &Value, port: &str, k: usize) -> Ramp {
    let knot = |k: usize| k as f64 * STEP;
    let mut ends = [[0.0; 3]; 2];
    let terms = terms.as_array().map_or(&[][..], |terms| terms);
    for term in terms.iter().filter(|term| term["port"] == port) {
        let (dir, get) = (numbers(&term["dir"]), |name: &str| term[name].as_f64().unwrap_or(0.0));
        let middle = knot(k) + STEP / 2.0;
        // All frequencies are multiples of 0.001 Hz, so that the number of cycles at a knot is computed from whole numbers.
        // Far from t = 0 the sine of an angle of many turns would have fewer digits.
        let cycles = |k: usize| {
            let per_knot = (get("freq") * 1000.0).round() as usize * 2;
            (per_knot * k % 100_000) as f64 / 1e5
        };
        let at = |k: usize| match term["shape"].as_str().unwrap() {
            "constant" => get("amp"),
            "pulse" if get("t0") < middle && middle < get("t1") => get("amp"),
            "pulse" => 0.0,
            "sine" => get("amp") * f64::sin(std::f64::consts::TAU * cycles(k) + get("phase")),
            "ramp" => {
                let share = ((knot(k) - get("t0")) / (get("t1") - get("t0"))).clamp(0.0, 1.0);
                get("v0") + (get("v1") - get("v0")) * share
            }
            other => panic!("shape {other}"),
        };
        for (end, value) in ends.iter_mut().zip([at(k), at(k + 1)]) {
            for i in 0..3 {
                end[i] += dir[i] * value;
            }
        }
    }
    let [from, to] = ends;
    Ramp { value: from, slope: [0, 1, 2].map(|i| (to[i] - from[i]) / STEP) }
}

pub fn inputs(record: &Value, k: usize) -> Inputs {
    let terms = &record["inputs"];
    Inputs {
        force: ramp(terms, "f", k),
        torque: ramp(terms, "tau", k),
        h_wheels: ramp(terms, "h_w", k),
        ..Inputs::default()
    }
}

pub fn at_end(inputs: &Inputs) -> Inputs {
    let end = |ramp: &Ramp| Ramp { value: ramp.value_at(STEP), slope: ramp.slope };
    Inputs {
        force: end(&inputs.force),
        torque: end(&inputs.torque),
        h_wheels: end(&inputs.h_wheels),
        mass_flow: inputs
            .mass_flow
            .map(|flow| Line { value: flow.value_at(STEP), slope: flow.slope }),
    }
}

/// Returns the motion of the body that carries the tank, between time knot k and the next. `omega` is the angular
/// velocity at knot k.
pub fn motion(record: &Value, k: usize, omega: [f64; 3]) -> TankInputs {
    let terms = &record["motion"];
    TankInputs {
        a: ramp(terms, "a", k),
        omega,
        omega_dot: ramp(terms, "w_dot", k),
        ..TankInputs::default()
    }
}

pub fn motion_at_end(inputs: &TankInputs) -> TankInputs {
    let end = |ramp: &Ramp| Ramp { value: ramp.value_at(STEP), slope: ramp.slope };
    let w_d = &inputs.omega_dot;
    let turned = [0, 1, 2].map(|i| (w_d.value[i] + w_d.slope[i] * STEP / 2.0) * STEP);
    TankInputs {
        a: end(&inputs.a),
        omega: [0, 1, 2].map(|i| inputs.omega[i] + turned[i]),
        omega_dot: end(w_d),
        ..*inputs
    }
}

pub fn spacecraft(record: &Value, tolerance: f64) -> Spacecraft {
    Spacecraft::new(&parameters(record), &inputs(record, 0), 0.0, tolerance).unwrap()
}

pub fn slosh_tank(record: &Value, tolerance: f64) -> SloshTank {
    SloshTank::new(&tank_parameters(record), &TankInputs::default(), 0.0, tolerance).unwrap()
}

pub fn steps(record: &Value) -> (usize, usize) {
    let whole = |t: f64| (t / STEP).round() as usize;
    (whole(number(&record["t_end"])), whole(number(&record["dt"])))
}
