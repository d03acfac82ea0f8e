use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use files::output;
use host::description::ModelDescription;
use hubslosh_tank::tank::Geometry;
use hubslosh_tank::{Fill, Tank};
use names::hubslosh::{SLOSH_ANGLE, TAU_CMD};
use report::view::{self, Drawing, Outline};
use signals::table::{self, Table};

use super::setting;
use crate::{fmu, set_file, terminal};

/// Makes a page that shows a run: bench or spacecraft in 3-D with its liquid, and plots that follow the time.
///
/// The page is one file that works without a network. Nothing is simulated: the page draws the columns of the run.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    hubslosh run --profile exp-sweep:amplitude=0.25 --set slosh.model=spherical --out sweep.parquet\n  \
    hubslosh view sweep.parquet\n  \
    hubslosh view sweep.parquet --from 300 --to 400 --out swirl.html\n  \
    hubslosh view drain.csv --fmu SloshTank --parameters draining.toml --tank tank.toml\n  \
    hubslosh view slew.parquet --tank 1:oxidiser.toml --tank 2:fuel.toml")]
pub struct ViewArgs {
    /// File of the run, .parquet or .csv, as `hubslosh run` and `hubslosh campaign` write it.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// File for the page, .html [default: the name of the run with .html].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Simulation time at which the page begins to show the run, s.
    #[arg(long, value_name = "SECONDS")]
    from: Option<f64>,
    /// Simulation time at which the page stops showing the run, s.
    #[arg(long, value_name = "SECONDS")]
    to: Option<f64>,
    /// Tank file, as for `hubslosh tank`, whose contour is drawn for tank 1. A number in front selects another tank:
    /// 2:fuel.toml.
    #[arg(long = "tank", value_name = "[N:]TANK.toml")]
    tanks: Vec<String>,
    /// File with the parameters of the run. It is needed if the file of the run does not contain them. Parameters
    /// given by --set replace those in this file.
    #[arg(long, visible_alias = "set-file", value_name = "FILE")]
    parameters: Option<PathBuf>,
    /// Gives the value of a parameter with which the run was simulated. This is needed if the file of the run does
    /// not contain the parameter.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// FMU of the run: a file, or the name of an FMU of this project [default: the FMU that the file of the run names,
    /// or an FMU of this project whose variables are the columns of the file].
    #[arg(long, value_name = "FILE|NAME")]
    fmu: Option<PathBuf>,
}

impl ViewArgs {
    pub fn run(self) -> Result<()> {
        let out = self.out.clone().unwrap_or_else(|| self.run.with_extension("html"));
        ensure!(
            out.extension().is_some_and(|ending| ending == "html"),
            "--out {}: the name must end in .html",
            out.display()
        );
        let is_parquet = self.run.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet"));
        let there = table::names(&self.run)?;
        let notes = if is_parquet { table::metadata(&self.run)? } else { BTreeMap::new() };
        let mut parameters = stored_parameters(&self.run, &notes)?;
        let name = match &self.fmu {
            Some(fmu) => fmu.clone(),
            None => notes.get("model").map(PathBuf::from).or_else(|| find_model(&there)).with_context(|| {
                format!(
                    "{}: no FMU of this project has the columns of the file as variables ({}): name the FMU of the run by --fmu",
                    self.run.display(),
                    there.join(", ")
                )
            })?,
        };
        let description = ModelDescription::from_fmu(&fmu::find(&name)?)?;
        let parameters_known =
            !parameters.is_empty() || self.parameters.is_some() || !self.settings.is_empty();
        if let Some(path) = &self.parameters {
            parameters.extend(set_file::read(path, &|| Ok(description.clone()))?);
        }
        parameters.extend(self.settings.iter().cloned());
        for (name, value) in &parameters {
            let variable = description.variable(name)?;
            description.value(variable, value)?;
        }
        let whole = variables_of_run(&description, &self.run, &there)?;
        let table = part(&whole, self.from, self.to)?;
        let drawings =
            self.tanks.iter().map(|text| drawing(text)).collect::<Result<BTreeMap<_, _>>>()?;
        ensure!(
            drawings.len() == self.tanks.len(),
            "--tank names a tank twice (allowed: one file for each tank)"
        );
        let shown =
            self.run.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into());
        let page = view::page(&view::Run {
            title: shown,
            source: self.run.display().to_string(),
            description: &description,
            parameters: &parameters,
            parameters_known,
            drawings: &drawings,
            table: &table,
        })?;
        for warning in page.warnings {
            terminal::warn(warning);
        }
        output::write(&out, page.html.as_bytes())?;
        done!("{} ({:.1} MB)", out.display(), page.html.len() as f64 * 1e-6);
        Ok(())
    }
}

/// Returns the page that shows a run which a campaign has stored in `file`. The parameters come
/// from the metadata of the file, and `title` becomes the title of the page.
///
/// # Errors
///
/// If the file cannot be read or its metadata are damaged.
pub fn page_of_stored_run(
    description: &ModelDescription,
    file: &Path,
    title: &str,
) -> Result<String> {
    let page = view::page(&view::Run {
        title: title.into(),
        source: file.display().to_string(),
        description,
        parameters: &stored_parameters(file, &table::metadata(file)?)?,
        parameters_known: true,
        drawings: &BTreeMap::new(),
        table: &variables_of_run(description, file, &table::names(file)?)?,
    })?;
    Ok(page.html)
}

fn stored_parameters(
    file: &Path,
    notes: &BTreeMap<String, String>,
) -> Result<BTreeMap<String, String>> {
    serde_json::from_str(notes.get("parameters").map_or("{}", String::as_str))
        .with_context(|| format!("{}: the metadata of the file are damaged", file.display()))
}

/// Reads those columns of the run's file that are variables of the FMU. Other columns, such as
/// readings of sensors, are not read, because the page does not draw them.
fn variables_of_run(
    description: &ModelDescription,
    file: &Path,
    columns: &[String],
) -> Result<Table> {
    let known: BTreeSet<&str> = description.variables.iter().map(|v| v.name.as_str()).collect();
    let columns = columns.iter().map(String::as_str);
    let wanted: Vec<&str> = columns.filter(|n| *n == "time" || known.contains(n)).collect();
    Table::read(file, &wanted)
}

fn find_model(columns: &[String]) -> Option<PathBuf> {
    let any = |beginning: &str| columns.iter().any(|name| name.starts_with(beginning));
    let name = match () {
        () if any(SLOSH_ANGLE) || any(TAU_CMD) => "HubSlosh",
        () if any("tank[") || any("q[") => "Spacecraft",
        () if any("tank.") => "SloshTank",
        () => return None,
    };
    Some(name.into())
}

fn part(table: &Table, from: Option<f64>, to: Option<f64>) -> Result<Table> {
    let time = table.column("time").unwrap_or_default();
    let (from, to) = (from.unwrap_or(f64::NEG_INFINITY), to.unwrap_or(f64::INFINITY));
    // Rounding is allowed for, because the user's limit may have fewer digits than the time in the table.
    let kept: Vec<usize> =
        (0..time.len()).filter(|k| time[*k] >= from - 1e-9 && time[*k] <= to + 1e-9).collect();
    if kept.len() < 2 && time.len() > 1 {
        bail!(
            "--from and --to leave {} row(s) (allowed: two or more, between {} and {} s)",
            kept.len(),
            time[0],
            time[time.len() - 1]
        );
    }
    let column = |name: &String| {
        let values = table.column(name).expect("a column of this table");
        kept.iter().map(|k| values[*k]).collect()
    };
    Ok(Table::new(table.names().to_vec(), table.names().iter().map(column).collect()))
}

/// Number of intervals into which each segment of a contour is divided for drawing. The range from
/// an empty to a full tank is divided into four times as many intervals of the liquid's mass, for
/// the table of surface heights.
const POINTS: usize = 24;

const STEPS: usize = 80;

fn drawing(text: &str) -> Result<(usize, Drawing)> {
    let (number, path) = match text.split_once(':') {
        Some((number, path)) if number.parse::<usize>().is_ok() => (number.parse()?, path),
        _ => (1, text),
    };
    let path = Path::new(path);
    let tank =
        Tank::read(path).map_err(|problems| anyhow::anyhow!("{}: {problems}", path.display()))?;
    let height =
        |mass| tank.fill_height(Fill::Mass(mass)).map_err(|problems| anyhow::anyhow!("{problems}"));
    let name = tank.name.clone().unwrap_or_else(|| path.display().to_string());
    Ok(match &tank.geometry {
        Geometry::Revolution { contour, .. } => {
            let mut points: Vec<[f64; 2]> = Vec::new();
            for segment in contour.segments() {
                let ends = (0..=POINTS).map(|i| segment.point_at(i as f64 / POINTS as f64));
                points.extend(ends.map(|p| [p[0].max(0.0), p[1]]));
            }
            points.dedup_by(|a, b| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9);
            let (bottom, most) = (contour.bottom(), contour.capacity() * tank.density);
            let levels = (0..=4 * POINTS)
                .map(|i| {
                    let mass = most * i as f64 / (4 * POINTS) as f64;
                    Ok([mass, bottom + height(mass)?])
                })
                .collect::<Result<_>>()?;
            let surfaces = Some(Box::new(move |mass, modes| {
                let solved =
                    tank.fill_height(Fill::Mass(mass)).and_then(|fill| tank.solve(fill, modes));
                let solved = solved.map_err(|problems| anyhow::anyhow!("{problems}"))?;
                Ok(solved.modes.iter().map(|mode| equally_spaced(&mode.shape)).collect())
            }) as Box<view::Surfaces>);
            (number, Drawing { name, outline: Outline::Revolved(points), levels, surfaces })
        }
        Geometry::Box { length_x, length_y } => {
            // A tank that is open at the top is drawn as high as it is long.
            let top = length_x.max(*length_y);
            let most = top * length_x * length_y * tank.density;
            let outline = Outline::Box([*length_x, *length_y, 0.0, top]);
            let levels = vec![[0.0, 0.0], [most, top]];
            (number, Drawing { name, outline, levels, surfaces: None })
        }
    })
}

/// Interpolates the surface elevation of a mode at equal steps of the radius, divided by the
/// elevation at the outer wall. `shape` has pairs of radius and elevation, in ascending order of
/// the radius.
fn equally_spaced(shape: &[[f64; 2]]) -> Vec<f64> {
    let (first, last) = (shape[0], shape[shape.len() - 1]);
    let at = |i: usize| {
        let r = first[0] + (last[0] - first[0]) * i as f64 / STEPS as f64;
        let after = shape.partition_point(|p| p[0] < r).clamp(1, shape.len() - 1);
        let (a, b) = (shape[after - 1], shape[after]);
        (a[1] + (b[1] - a[1]) * (r - a[0]) / (b[0] - a[0])) / last[1]
    };
    (0..=STEPS).map(at).collect()
}
