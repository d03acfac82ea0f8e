//! `hubslosh tank`.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use host::output::atomically;
use hubslosh_tank::{Tank, picture, sweep, table};

/// Modal parameters of a tank: from a drawing and a fill to slosh masses, pendulum lengths, hinge
/// heights, the rigid liquid and the error of all of them.
///
/// By the linear potential-flow eigenproblem for any body of revolution, in closed form for boxes.
/// Without --out it prints a table.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    hubslosh tank harness/tank/examples/capsule.toml --fill 1.2\n  \
    hubslosh tank tank.toml --fill 1.2 --modes 3 --out result.json --picture tank.svg\n  \
    hubslosh tank tank.toml --sweep 0.2,0.4,0.6,0.8 --out sweep.csv --picture sweep.svg\n\n\
    The format of TANK.toml is described in harness/tank/README.md.")]
pub struct TankArgs {
    /// The tank: density, and contour or box.
    #[arg(value_name = "TANK.toml")]
    tank: PathBuf,
    /// Height of the free surface above the tank's lowest point, m.
    #[arg(long, value_name = "METRES", required_unless_present = "sweep")]
    fill: Option<f64>,
    /// Several fills, m: a table of them (CSV).
    #[arg(long, value_name = "METRES,…", value_delimiter = ',', conflicts_with = "fill")]
    sweep: Vec<f64>,
    /// How many lateral modes, 1 to 20.
    #[arg(long, value_name = "NUMBER", default_value_t = 5)]
    modes: usize,
    /// Acceleration along the tank's axis for the frequencies in table and picture, m/s2.
    #[arg(long, value_name = "NUMBER", default_value_t = 9.80665)]
    gravity: f64,
    /// Where to put the result, JSON (of --sweep CSV).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Where to put a drawing of tank, free surface and mode shapes, SVG.
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

impl TankArgs {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        ensure!(
            self.gravity.is_finite() && self.gravity > 0.0,
            "--gravity {} (allowed: greater than 0, finite)",
            self.gravity
        );
        let read = || self.tank.display().to_string();
        let tank = Tank::read(&self.tank).with_context(read)?;
        let (text, picture, as_table) = match self.fill {
            Some(fill) => {
                let data = tank.solve(fill, self.modes).with_context(read)?;
                let json = serde_json::to_string_pretty(&data)? + "\n";
                let drawn = picture::tank(&tank, &data, self.gravity);
                (json, drawn, table(&data, self.gravity))
            }
            None => {
                let swept = sweep::sweep(&tank, &self.sweep, self.modes).with_context(read)?;
                let csv = swept.to_csv();
                (csv.clone(), picture::sweep(&tank, &swept, self.gravity), csv)
            }
        };
        match &self.out {
            Some(out) => {
                atomically(out, |file| Ok(file.write_all(text.as_bytes())?))?;
                println!("{}", out.display());
            }
            None => print!("{as_table}"),
        }
        if let Some(path) = &self.picture {
            atomically(path, |file| Ok(file.write_all(picture.as_bytes())?))?;
            println!("{}", path.display());
        }
        Ok(())
    }
}
