use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};
use files::output;
use hubslosh_tank::parameters::{self, Liquid, ParameterSet, Target};
use hubslosh_tank::{Fill, Problems, Tank, fill_table, finite_amplitude, picture, sweep, table};

use crate::terminal;

/// Computes the slosh modes of a tank from its drawing and a fill: a pendulum for each mode, a fixed mass, and the
/// estimated errors of their values.
///
/// A body of revolution is solved by linear potential flow, a box in closed form. Without --out the command prints a
/// table.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    hubslosh tank harness/tank/examples/capsule.toml --fill 1.2\n  \
    hubslosh tank tank.toml --fill 60% --modes 3 --out result.json --picture tank.svg\n  \
    hubslosh tank tank.toml --sweep 20%,40%,60%,80% --nu 1e-6 --out sweep.csv --picture sweep.svg\n  \
    hubslosh tank tank.toml --fill 1.2 --modes 3 --nu 1e-6 --parameters tank-1.2.toml\n  \
    hubslosh tank tank.toml --sweep 2%,98% --model SloshTank --nu 1e-6 --parameters draining.toml\n  \
    hubslosh tank harness/tank/examples/bench.toml --fill 0.1 --modes 1 --gravity 0.5 --sigma 0.073 \
    --contact-angle 5 --parameters coast.toml\n  \
    hubslosh tank harness/tank/examples/bench.toml --fill 0.1 --spin 3 --gravity 5\n  \
    hubslosh tank tank.toml --fill 1.2 --large-waves --model SloshTank --parameters tank-1.2.toml\n  \
    hubslosh run --parameters tank-1.2.toml --profile exp-sweep:amplitude=0.1 --out sweep.parquet\n\n\
    The format of TANK.toml is described in harness/tank/README.md.")]
pub struct TankArgs {
    /// File that describes the tank: the density of the liquid, and the contour of a body of revolution or the sides of
    /// a box.
    #[arg(value_name = "TANK.toml")]
    tank: PathBuf,
    /// Height of the free surface above the lowest point of the tank, m; or, with a % sign, share of the volume of
    /// the tank. The volume of an open tank ends at the upper end of its wall. A full tank has no free surface and no
    /// modes.
    #[arg(long, value_name = "METRES|PERCENT%", required_unless_present_any = ["sweep", "fill_mass"])]
    fill: Option<Fill>,
    /// Mass of the liquid, kg, instead of --fill.
    #[arg(long, value_name = "KG", conflicts_with = "fill")]
    fill_mass: Option<f64>,
    /// Computes the modes at several fills, m or %, and writes a table (CSV).
    ///
    /// With --parameters the command writes the fill table with which an FMU simulates a draining tank: 3 to 12 fills
    /// are the points of this table. If only two fills are given, they are its ends, and the command chooses the
    /// points between them.
    #[arg(long, value_name = "METRES|PERCENT%,…", value_delimiter = ',', conflicts_with_all = ["fill", "fill_mass"])]
    sweep: Vec<Fill>,
    /// Number of lateral modes, 1 to 20.
    #[arg(long, value_name = "NUMBER", default_value_t = 5)]
    modes: usize,
    /// Acceleration along the axis of the tank, m/s², from which the frequencies in table and picture are computed. With 0
    /// the frequencies are 0, unless surface tension (--sigma) holds the liquid.
    #[arg(long, value_name = "NUMBER", default_value_t = 9.80665)]
    gravity: f64,
    /// Prints the result as JSON instead of a table, also with --sweep.
    #[arg(long, conflicts_with = "out")]
    json: bool,
    /// File for the result, JSON (CSV with --sweep).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// File for a picture of tank, free surface and mode shapes, .svg.
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// File for the modes as parameters of an FMU, .toml (for `hubslosh run --parameters` and Python) or .ssv (SSP 1.0).
    #[arg(long, value_name = "FILE")]
    parameters: Option<PathBuf>,
    /// FMU for which --parameters writes parameters.
    #[arg(long, value_name = "MODEL", default_value = "HubSlosh", value_parser = MODELS, requires = "parameters")]
    model: String,
    /// Number of the tank, 1 to 4, in the parameters that --parameters writes for Spacecraft.
    #[arg(long, value_name = "NUMBER", default_value_t = 1, requires = "parameters")]
    tank_number: usize,
    /// Kinematic viscosity of the liquid, m²/s. From it the command computes the damping ratio of each mode, with an
    /// interval of its uncertainty, at the acceleration --gravity. The table, --out and --parameters contain the damping
    /// ratios; with --sweep they are computed at every fill [default: no viscosity, all damping ratios are 0].
    #[arg(long, value_name = "NUMBER")]
    nu: Option<f64>,
    /// Surface tension of the liquid, N/m [default: no surface tension]. It changes the frequencies and the damping
    /// at --gravity. It also gives each mode a stiffness, which --parameters writes: the surface tension returns a
    /// displaced liquid to its rest position, even without gravity.
    #[arg(long, value_name = "NUMBER", conflicts_with = "sweep")]
    sigma: Option<f64>,
    /// Contact angle between surface and wall, degrees; with 90 the surface is flat. For an upright cylinder, the
    /// meniscus at --gravity and --sigma then changes the frequency and the surface-tension stiffness of the first
    /// mode.
    #[arg(long, value_name = "DEGREES", default_value_t = 90.0, requires = "sigma")]
    contact_angle: f64,
    /// Rate at which tank and liquid rotate about the axis of the tank, rad/s. The command then computes the surface,
    /// the centre of mass and the inertias of the rotating liquid, and states the error of the modes, which are
    /// computed for liquid at rest. With --parameters for SloshTank and Spacecraft it writes the spin of the liquid.
    /// The acceleration along the axis is --gravity.
    #[arg(long, value_name = "NUMBER", conflicts_with = "sweep")]
    spin: Option<f64>,
    /// Computes coefficients of the first mode from fully nonlinear potential flow in this tank, in about 10 s. With
    /// these coefficients the pendulum of SloshTank and Spacecraft has the same energy as waves of large amplitude.
    /// Without this option the coefficients come from tables, which exist only for spheres and upright cylinders and
    /// for a range of fills.
    #[arg(long, conflicts_with = "sweep")]
    large_waves: bool,
    /// Writes the file of --parameters even if the formula for the stiffness by surface tension is far outside its range.
    #[arg(long, requires = "parameters")]
    force: bool,
}

const MODELS: [&str; 3] = ["HubSlosh", "SloshTank", "Spacecraft"];

impl TankArgs {
    pub fn run(self) -> Result<()> {
        ensure!(
            self.gravity.is_finite() && self.gravity >= 0.0,
            "--gravity {} (allowed: 0 or more, finite)",
            self.gravity
        );
        for (flag, value) in [("--nu", self.nu), ("--sigma", self.sigma)] {
            let allowed = value.is_none_or(|value| value.is_finite() && value >= 0.0);
            ensure!(allowed, "{flag} {} (allowed: 0 or more, finite)", value.unwrap_or_default());
        }
        ensure!(
            (0.0..=180.0).contains(&self.contact_angle),
            "--contact-angle {} (allowed: 0 to 180)",
            self.contact_angle
        );
        let read = || self.tank.display().to_string();
        let tank = Tank::read(&self.tank).with_context(read)?;
        let set;
        let (text, json, picture, as_table) = match self.fill.or(self.fill_mass.map(Fill::Mass)) {
            Some(fill) => {
                let data = parameters::solve(&tank, fill, self.modes, self.liquid());
                let mut data = data.with_context(read)?;
                if self.large_waves {
                    finite_amplitude::add_large_waves(&tank, &mut data);
                }
                // If a surface tension is given, the printed table contains the warnings about it; `--parameters`
                // prints its own warnings.
                let has_table = !(self.json || self.out.is_some()) && data.capillarity.is_some();
                if self.parameters.is_none() && !has_table {
                    let found = parameters::surface_tension_warnings(&data, self.liquid());
                    found.iter().for_each(terminal::warn);
                }
                set = self
                    .set_file(|target, liquid| ParameterSet::new(&tank, &data, target, liquid))?;
                let json = serde_json::to_string_pretty(&data)? + "\n";
                let drawn = picture::tank(&tank, &data, self.gravity);
                (json.clone(), json, drawn, table(&data, self.gravity))
            }
            None => {
                let fills: Result<Vec<f64>, _> =
                    self.sweep.iter().map(|fill| tank.fill_height(*fill)).collect();
                let fills = fills.with_context(read)?;
                let (mut swept, between) = match fills[..] {
                    [low, high] if self.parameters.is_some() && low < high => {
                        let placed = fill_table::place(&tank, low, high, self.modes);
                        let placed = placed.with_context(read)?;
                        (placed.sweep, Some(placed.between))
                    }
                    _ => (sweep::sweep(&tank, &fills, self.modes).with_context(read)?, None),
                };
                swept.add_third_order(&tank);
                set = self.set_file(|target, liquid| {
                    fill_table::parameters(&tank, &swept, between.as_ref(), target, liquid)
                })?;
                if let Some(nu) = self.nu {
                    swept.add_damping(&tank, nu, self.liquid()).with_context(read)?;
                }
                let csv = swept.to_csv();
                let json = serde_json::to_string_pretty(&swept.rows)? + "\n";
                (csv.clone(), json, picture::sweep(&tank, &swept, self.gravity), csv)
            }
        };
        match &self.out {
            Some(out) => {
                output::write(out, text.as_bytes())?;
                done!("{}", out.display());
            }
            None if self.json => print!("{json}"),
            None => print!("{as_table}"),
        }
        if let Some((path, text)) = &set {
            output::write(path, text.as_bytes())?;
            done!("{}", path.display());
        }
        if let Some(path) = &self.picture {
            output::write(path, picture.as_bytes())?;
            done!("{}", path.display());
        }
        Ok(())
    }

    fn liquid(&self) -> Liquid {
        Liquid {
            gravity: self.gravity,
            nu: self.nu,
            sigma: self.sigma,
            contact_angle: self.contact_angle,
            spin: self.spin,
        }
    }

    /// Returns the path of `--parameters` and the text to write there, or `None` without this
    /// option. `make` computes the parameters for an FMU and a liquid; the ending of the path
    /// decides their format.
    fn set_file(
        &self,
        make: impl Fn(Target, Liquid) -> Result<ParameterSet, Problems>,
    ) -> Result<Option<(PathBuf, String)>> {
        let Some(path) = &self.parameters else { return Ok(None) };
        ensure!(
            self.gravity == 0.0 || self.gravity >= 1e-9,
            "--gravity {:e} m/s² (allowed with --parameters: 0, or at least 1e-9, because it becomes the FMU's parameter g_ref)",
            self.gravity
        );
        let target = match self.model.as_str() {
            "SloshTank" => Target::SloshTank,
            "Spacecraft" => Target::Spacecraft { tank: self.tank_number },
            _ => Target::HubSlosh,
        };
        let set = make(target, self.liquid()).with_context(|| self.tank.display().to_string())?;
        for warning in &set.warnings {
            terminal::warn(warning);
        }
        ensure!(
            self.force || set.unknown.is_empty(),
            "--parameters {}: {} (--force writes the file nevertheless, without --sigma k is 0)",
            path.display(),
            set.unknown.join("; ")
        );
        let text = match path.extension().and_then(|ending| ending.to_str()) {
            Some("toml") => set.to_toml(),
            Some("ssv") => set.to_ssv(),
            _ => bail!("--parameters {}: the name must end in .toml or .ssv", path.display()),
        };
        Ok(Some((path.clone(), text)))
    }
}
