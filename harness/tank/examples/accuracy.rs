//! Measures accuracy and time for every tank of `tests/tanks.json`: largest deviation of five modes from the
//! reference values, the error that the solver states, and the shortest computing time of several
//! repetitions on one core.
//!
//! `cargo run --release -p hubslosh-tank --features studies --example accuracy [REPETITIONS [NAME]]`

use std::path::Path;
use std::time::Instant;

use hubslosh_tank::Tank;
use serde_json::Value;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

fn main() {
    let repetitions: usize = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(5);
    let only = std::env::args().nth(2);
    let all: Value = serde_json::from_str(include_str!("../tests/tanks.json")).unwrap();
    println!(
        "tank                  ms   lambda 1-3   lambda 4-5     m/m_liq  m H/(m R)  I/(m R^2)     wave/R |     stated"
    );
    for case in all["cases"].as_array().unwrap().iter().filter(|case| case["kind"] == "revolution")
    {
        if only.as_ref().is_some_and(|name| case["name"] != name.as_str()) {
            continue;
        }
        let entries = case["profile"].as_array().unwrap().iter().map(|entry| {
            let (kind, numbers) = entry.as_object().unwrap().iter().next().unwrap();
            format!("{{ {kind} = {numbers} }}")
        });
        let text = format!(
            "density = {:?}\nprofile = [{}]",
            number(&case["rho"]),
            entries.collect::<Vec<_>>().join(", ")
        );
        let tank = Tank::parse(&text, Path::new("")).unwrap();
        let (fill, r, m_liq) =
            (number(&case["fill"]), number(&case["R_surface"]), number(&case["m_liq"]));
        let mut least = f64::MAX;
        let mut data = None;
        for _ in 0..repetitions {
            let begin = Instant::now();
            data = Some(tank.solve(fill, 5).unwrap());
            least = least.min(begin.elapsed().as_secs_f64());
        }
        let data = data.unwrap();
        let mut worst = [0.0f64; 6];
        let mut meet = |kind: usize, value: f64| worst[kind] = worst[kind].max(value.abs());
        for (mode, expected) in data.modes.iter().zip(case["modes"].as_array().unwrap()) {
            meet(usize::from(mode.n > 3), mode.lambda / number(&expected["lambda"]) - 1.0);
            meet(2, (mode.m - number(&expected["m"])) / m_liq);
            if let (Some(height), Some(h)) = (mode.height, expected["H"].as_f64()) {
                meet(3, mode.m * (height - h) / (m_liq * r));
            }
            meet(5, (mode.wave - number(&expected["wave"])) / r);
        }
        for (rest, expected) in data.rest.iter().zip(case["rest"].as_array().unwrap()) {
            meet(4, (rest.inertia - number(&expected["I_0"])) / (m_liq * r * r));
        }
        meet(4, (data.i_eff_cg - number(&case["I_eff_cg"])) / (m_liq * r * r));
        let [a, b, c, d, e, f] = worst;
        println!(
            "{:17} {:6.1} {a:12.0e} {b:12.0e} {c:11.0e} {d:10.0e} {e:10.0e} {f:10.0e} | {:10.0e}",
            case["name"].as_str().unwrap(),
            1e3 * least,
            data.error
        );
    }
}
