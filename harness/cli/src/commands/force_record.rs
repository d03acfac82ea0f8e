//! `hubslosh identify --tank`: from a record of force, moment and motion of a tank to its mechanical model.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use hubslosh_tank::parameters::{Liquid, ParameterSet, Target, Value, damping_of};
use hubslosh_tank::{Fill, Tank, finite_amplitude};
use identify::force_record::{self, Frame, Predicted, Prediction, Raw, Task};
use identify::input::names::list;
use identify::model::simulate::Model;
use names::sloshtank::tank::{HINGE, LENGTH, MASS, NONLINEAR_INERTIA, NONLINEAR_STIFFNESS, ZETA};
use signals::recording::Columns;

use super::DEFAULT_FMU;
use super::any_fmu::{AnyFmuArgs, Told};
use super::estimates::Out;
use crate::terminal;

/// The FMU that is fitted.
const FMU: &str = "SloshTank";
/// Value of `--tank` without a file.
const NO_DRAWING: &str = "-";

/// Options for records of force and moment.
#[derive(clap::Args)]
#[command(next_help_heading = "Force record of a tank")]
pub struct ForceRecordArgs {
    /// Fits the mechanical model of a tank to records of its force and moment: Fx, Fy, Fz (N) and Mx, My, Mz (N·m) of the liquid on
    /// the tank, of a balance or of CFD. x, y, z (m) is the displacement of the reference point, ax, ay, az (m/s²) its acceleration
    /// without gravity, rx, ry or rz (rad) a rotation. Without motion it is a free decay. With a drawing (=TANK.toml) the result is
    /// compared with `hubslosh tank`.
    #[arg(long, value_name = "TANK.toml", group = "fit", conflicts_with = "tolerances", num_args = 0..=1, require_equals = true, default_missing_value = NO_DRAWING)]
    tank: Option<PathBuf>,
    /// Height of the free surface above the tank's lowest point, m, or per cent of the volume, of --tank=TANK.toml.
    #[arg(long, value_name = "METRES|PERCENT%", requires = "tank")]
    fill: Option<Fill>,
    /// Mass of the liquid, kg, in place of --fill.
    #[arg(long, value_name = "KG", requires = "tank", conflicts_with = "fill")]
    fill_mass: Option<f64>,
    /// Kinematic viscosity, m2/s, for the damping ratio by theory.
    #[arg(long, value_name = "NUMBER", requires = "tank")]
    nu: Option<f64>,
    /// Acceleration along the tank's axis at rest, m/s².
    #[arg(long, value_name = "NUMBER", requires = "tank", default_value_t = 9.80665)]
    gravity: f64,
    /// The tank's x, y and z axes in the axes of the record; z is upwards: z,x,y if the record's y is upwards.
    #[arg(
        long,
        value_name = "X,Y,Z",
        requires = "tank",
        default_value = "x,y,z",
        allow_hyphen_values = true
    )]
    axes: String,
    /// Reference point of moments and motion in tank axes, m, from the tank's axis and the zero of its heights.
    #[arg(
        long,
        value_name = "X,Y,Z",
        requires = "tank",
        value_delimiter = ',',
        default_value = "0,0,0",
        allow_hyphen_values = true
    )]
    point: Vec<f64>,
    /// The recorded forces and moments are those of the tank on the liquid: minus those of the liquid on the tank.
    #[arg(long, requires = "tank")]
    reaction: bool,
    /// Axes and reference point of forces and moments stay fixed in space while the tank moves.
    #[arg(long, requires = "tank")]
    fixed: bool,
    /// Known slosh angles along the tank's x and y axes, degrees, at which the liquid is released at rest when the records begin
    /// (0: the tank begins to move with the liquid at rest).
    #[arg(
        long,
        value_name = "DEG[,DEG]",
        requires = "tank",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    release: Vec<f64>,
}

impl ForceRecordArgs {
    /// Returns true if `--tank` is given.
    pub fn is_asked(&self) -> bool {
        self.tank.is_some()
    }

    /// Returns the FMU that is fitted.
    pub fn fmu<'a>(&self, named: &'a Path) -> &'a Path {
        if self.is_asked() && named == Path::new(DEFAULT_FMU) { Path::new(FMU) } else { named }
    }

    fn task(&self, any: &AnyFmuArgs, told: &Told) -> Result<Task> {
        let point = <[f64; 3]>::try_from(&self.point[..]);
        let point = point.ok().filter(|p| p.iter().all(|x| x.is_finite()));
        let release = match self.release[..] {
            [] => None,
            [x] => Some([x, 0.0]),
            [x, y] => Some([x, y]),
            _ => anyhow::bail!("--release has {} angles (allowed: one or two)", self.release.len()),
        };
        if let Some([x, y]) = release {
            ensure!(
                x.hypot(y) < 45.0,
                "--release {x},{y} (allowed: less than 45 degrees, where the model ends)"
            );
        }
        ensure!(
            self.gravity > 0.0 && self.gravity.is_finite(),
            "--gravity {} (allowed: above 0, finite)",
            self.gravity
        );
        let common = any.common(told)?;
        Ok(Task {
            frame: Frame {
                axes: Frame::axes(&self.axes).context("--axes")?,
                point: point.context("--point (allowed: three finite numbers, m)")?,
                is_reaction: self.reaction,
                is_fixed: self.fixed,
            },
            gravity: self.gravity,
            release: release.map(|angles| angles.map(f64::to_radians)),
            prediction: self.prediction()?,
            ..common
        })
    }

    /// Theory's values, if there is a drawing.
    fn prediction(&self) -> Result<Option<Prediction>> {
        let Some(path) = self.tank.as_ref().filter(|path| *path != Path::new(NO_DRAWING)) else {
            ensure!(
                self.fill.is_none() && self.fill_mass.is_none() && self.nu.is_none(),
                "--fill, --fill-mass and --nu are for a drawing: --tank=TANK.toml"
            );
            return Ok(None);
        };
        let read = || path.display().to_string();
        let tank = Tank::read(path).with_context(read)?;
        let fill = self.fill.or(self.fill_mass.map(Fill::Mass));
        let fill = fill.context("--tank=TANK.toml needs --fill or --fill-mass")?;
        let fill = tank.height_of(fill).with_context(read)?;
        let data = tank.solve(fill, 1).with_context(read)?;
        ensure!(!data.modes.is_empty(), "{}: the tank is full and does not slosh", read());
        let liquid =
            Liquid { gravity: self.gravity, nu: self.nu, sigma: None, contact_angle: 90.0 };
        let set = ParameterSet::new(&tank, &data, Target::SloshTank, liquid).with_context(read)?;
        set.warnings.iter().for_each(terminal::warn);
        let mut prediction = Prediction::default();
        for (name, value) in set.values {
            let text = match value {
                Value::Real(x) => {
                    let predicted = Predicted { value: x, interval: None };
                    prediction.values.insert(name.clone(), predicted);
                    format!("{x:?}")
                }
                Value::Integer(n) => n.to_string(),
                Value::Boolean(flag) => flag.to_string(),
                Value::Item(item) => item.to_string(),
            };
            prediction.settings.push((name, text));
        }
        let mut about = |name: String, off: f64| {
            if let Some(predicted) = prediction.values.get_mut(&name) {
                predicted.interval = Some([predicted.value - off, predicted.value + off]);
            }
        };
        let found = finite_amplitude::of_tank(&tank, &data);
        let size = data.r_surface.or(data.length_x.map(|l| 0.5 * l)).unwrap_or(0.0);
        for (k, mode) in [found.mode, found.mode_y].into_iter().enumerate() {
            let n = k + 1;
            if let Some(known) = mode {
                let (s, kappa) = (known.nonlinear_inertia, known.nonlinear_stiffness);
                about(NONLINEAR_INERTIA.at([n]), known.error * (1.0 + s.abs()));
                about(NONLINEAR_STIFFNESS.at([n]), known.error * (1.0 + kappa.abs()));
            }
            about(MASS.at([n]), data.error * data.m_liq);
            about(LENGTH.at([n]), data.error * data.modes[0].l);
            about(HINGE.at([n]), data.error * size);
        }
        match self.nu {
            Some(nu) => {
                let damping = damping_of(&tank, &data, nu, liquid).with_context(read)?;
                let axes = [damping.modes.first(), damping.modes_y.first()];
                for (k, mode) in axes.into_iter().enumerate() {
                    if let Some((predicted, mode)) =
                        prediction.values.get_mut(&ZETA.at([k + 1])).zip(mode)
                    {
                        predicted.interval = Some(mode.interval);
                    }
                }
            }
            // a ratio of 0 says that it is not known
            None => prediction.values.retain(|name, _| (1..=2).all(|n| *name != ZETA.at([n]))),
        }
        Ok(Some(prediction))
    }

    /// Identifies, writes and prints.
    pub fn identify(&self, any: &AnyFmuArgs, told: &Told, out: &Out) -> Result<()> {
        let task = self.task(any, told)?;
        let model =
            Model::open(&crate::fmu::find(told.fmu)?, identify::input::question::Solver::Own)?;
        let columns = Columns::of_variables(list(told.columns))?.with_rate(told.rate)?;
        let (mut notes, mut raws) = (Vec::new(), Vec::new());
        for path in told.data {
            raws.push(Raw::read(path, &columns, &mut |line| {
                terminal::note(&line);
                notes.push(line);
            })?);
        }
        let mut found = out.search(|news| force_record::identify(&model, &task, &raws, news))?;
        found.found.done.splice(0..0, notes);
        let text = serde_json::to_string_pretty(&found)? + "\n";
        let tables = || force_record::lines(&found).iter().for_each(|line| println!("{line}"));
        out.give(&text, found.trusted, tables, || force_record::page(&found))
    }
}
