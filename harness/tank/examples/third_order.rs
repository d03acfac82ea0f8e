//! Draws the figure of HubSlosh's documentation that shows how the frequency depends on the amplitude in an upright cylinder.
//!
//! `cargo run --release -p hubslosh-tank --features studies --example third_order -- modelDescription/HubSlosh/documentation/liquid.svg`

#[path = "../tests/tank/liquid_figure.rs"]
mod liquid_figure;

use hubslosh_tank::third_order::Overlaps;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("usage: third_order FILE.svg")?;
    std::fs::write(path, liquid_figure::draw(&Overlaps::new(40)))?;
    Ok(())
}
