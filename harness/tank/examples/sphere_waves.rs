//! Prints the rows of `src/sphere_waves.rs`: coefficients of the first mode in a sphere that give the wave's energy.
//!
//! `cargo run --release -p hubslosh-tank --example sphere_waves` takes some minutes.

use hubslosh_tank::{Fill, Tank, finite_amplitude, parameters};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let tank = Tank::parse(
        "density = 1000.0\nshape = { sphere = { radius = 1.0 } }",
        std::path::Path::new(""),
    )?;
    let liquid =
        parameters::Liquid { gravity: 9.8, nu: None, sigma: None, contact_angle: 90.0, spin: None };
    for fill in [0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1.0, 1.05] {
        let mut data = parameters::solve(&tank, Fill::Height(fill), 1, liquid)?;
        if let Some(mode) = data.finite_amplitude.as_mut().and_then(|found| found.mode.as_mut()) {
            mode.energy = None; // of the table
        }
        finite_amplitude::add_large_waves(&tank, &mut data);
        let found = data.finite_amplitude.ok_or("no modes")?;
        let energy = found.mode.and_then(|mode| mode.energy);
        let Some(known) = energy else {
            println!("// {fill:.2}: {:?}", found.warnings);
            continue;
        };
        println!(
            "    [{fill:.2}, {:.4}, {:.4}, {:.4}, {:.3}, {:.3}, {:.3}, {:.1}], // {:.1e} {:.1e} {:.1}",
            known.nonlinear_stiffness,
            known.nonlinear_inertia,
            known.rotary_inertia,
            known.nonlinear_stiffness_2,
            known.nonlinear_inertia_2,
            known.rotary_inertia_2,
            known.frequency_limit.to_degrees(),
            known.frequency_error,
            known.energy_error,
            known.angle_limit.to_degrees(),
        );
    }
    Ok(())
}
