//! Draws a tank at a fill, and a sweep over its fills, and prints the table of its modal parameters.
//!
//! `cargo run -p hubslosh-tank --features studies --example draw -- TANK.toml FILL TANK.svg SWEEP.svg`

use std::path::Path;

use hubslosh_tank::{Problems, Tank, picture, sweep, table};

const GRAVITY: f64 = 9.80665;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, fill, tank_svg, sweep_svg] = &arguments[..] else {
        return Err("usage: draw TANK.toml FILL TANK.svg SWEEP.svg".into());
    };
    let tank = Tank::read(Path::new(file))?;
    let data = tank.solve(fill.parse()?, 5)?;
    print!("{}", table(&data, GRAVITY));
    std::fs::write(tank_svg, picture::tank(&tank, &data, GRAVITY))?;
    let depth = tank.depth().unwrap_or(data.fill);
    let fills: Vec<f64> = (1..20).map(|i| 0.05 * depth * i as f64).collect();
    // A fill at a horizontal part of the wall has no modes.
    let fills: Vec<f64> = fills.into_iter().filter(|f| tank.solve(*f, 1).is_ok()).collect();
    let swept: Result<_, Problems> = sweep::sweep(&tank, &fills, 5);
    std::fs::write(sweep_svg, picture::sweep(&tank, &swept?, GRAVITY))?;
    Ok(())
}
