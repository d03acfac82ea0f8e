use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::{Result, bail};
use experiments::campaign::{Range, WAVE, stored_columns};
use experiments::profile::{self, SAMPLE, Written};
use experiments::rest;
use experiments::run::{self, Run, driven, histories};
use experiments::sensors::{self, Sensor, Sensors};
use experiments::weight::{Tanks, WATER_TENSION};
use host::description::{ModelDescription, Type};
use host::{guard, schedule};
use names::hubslosh::{G_AXIAL, OMEGA, OMEGA_IMU, SLOSH_ANGLE, SLOSH_ANGLE_RADIAL};
use names::limits::Limits;
use report::view;

use super::{DEFAULT_FMU, check_table_name, open_to_run, setting, write_out};
use crate::{progress, set_file, terminal};

/// Simulates an FMU under a torque profile or recorded inputs, and writes its signals.
#[derive(clap::Args)]
#[command(after_help = help())]
pub struct RunArgs {
    /// Torque profile with its settings, such as sine:amplitude=0.05,frequency=2.4. The profiles are listed at the end
    /// of this help.
    #[arg(
        long,
        value_name = "PROFILE",
        conflicts_with = "input",
        required_unless_present = "input"
    )]
    profile: Option<String>,
    /// Table of inputs over the column time: text in columns or Parquet; also .mat, HDF5, TDMS, MDF4 and .xlsx if the
    /// Python package is installed. Each column with the name of an input of the FMU, such as tau_cmd, tau_ext or
    /// g_axial, drives this input.
    ///
    /// The unit of a column is stated in its heading (`tau_cmd [mNm]`); otherwise it is the unit of the FMU. Times
    /// without a unit are in s. A column tau_slope is the derivative of tau_cmd until the next row.
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
    /// Ignores columns of --input that do not name an input of the FMU. Without this flag such a column is an error.
    #[arg(long, requires = "input")]
    ignore_columns: bool,
    /// File of parameters: TOML with lines `"name" = value`, .ssv of SSP, or the .json that `hubslosh identify`
    /// writes. A parameter that is also given by --set has the value of --set.
    #[arg(long, visible_alias = "set-file", value_name = "FILE")]
    parameters: Option<PathBuf>,
    /// Sets a parameter or an input by its name in the FMU. A number is in SI units or has a unit of the variable (50mm);
    /// an item of an enumeration is given by name or number. Structural parameters of FMI 3.0 are set first, wherever
    /// they are in the command line.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// Time between the rows of the result, s. It does not change the inputs: the FMU also steps to every row
    /// of --input, and to every jump and torque value of a profile.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.02)]
    step: f64,
    /// Time between the torque values of an oscillating profile, such as a sine or a sweep, s. The values are joined
    /// by straight lines, or held with --hold. If straight lines would differ from the profile by more than 2.5 % of
    /// its amplitude, shorter times are used, so that they differ by at most 0.1 %.
    #[arg(long, value_name = "SECONDS", default_value_t = SAMPLE, conflicts_with = "input")]
    sample: f64,
    /// Time at which the run stops, s [default: the end of the torque history].
    #[arg(long, value_name = "SECONDS")]
    stop: Option<f64>,
    /// Relative tolerance of the FMU's solver [default: the FMU's own].
    #[arg(long, value_name = "NUMBER")]
    tolerance: Option<f64>,
    /// Holds each value (zero-order hold) until the next row of --input or the next torque value of the profile,
    /// instead of joining the values by straight lines.
    #[arg(long)]
    hold: bool,
    /// Input that the profile drives [default: tau_cmd, or the FMU's only Real input].
    #[arg(long, value_name = "NAME")]
    drive: Option<String>,
    /// Surface tension of the liquid in the tanks of Spacecraft and SloshTank, N/m. From it and the density of the liquid
    /// the run computes the Bond number, and warns if the Bond number is low [default: 0.07213, the value of water].
    #[arg(long, value_name = "N/M")]
    tension: Option<f64>,
    /// Variables to record in addition to time and the driven inputs.
    ///
    /// The default is:
    ///
    /// - for HubSlosh: omega, omega_imu, slosh_angle and slosh_angle_radial
    ///
    /// - for other FMUs: all outputs and slosh angles
    ///
    /// - for every FMU also: the variables of further slosh modes and of draining tanks that `hubslosh view` draws
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    columns: Vec<String>,
    /// Also records the readings of a sensor with its sampling rate, delay, noise, bias and resolution. The kinds of
    /// sensors are listed at the end of this help; the option may be repeated.
    #[arg(long = "sensor", value_name = "NAME=KIND:key=value,…")]
    sensors: Vec<Sensor>,
    /// FMU: a file, or the name of an FMU of this project (`hubslosh fmus` lists them).
    #[arg(long, value_name = "FILE|NAME", default_value = DEFAULT_FMU)]
    pub fmu: PathBuf,
    /// File for the signals, .csv or .parquet. The value `-` prints the signals as CSV.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl RunArgs {
    pub fn run(self) -> Result<()> {
        check_table_name(&self.out)?;
        let mut settings = match &self.parameters {
            Some(path) => {
                set_file::read(path, &|| ModelDescription::from_fmu(&crate::fmu::find(&self.fmu)?))?
            }
            None => Vec::new(),
        };
        settings.extend(self.settings);
        let fmu = open_to_run(&self.fmu, &settings)?;
        let description = fmu.description();
        if description.co_simulation.is_none() {
            terminal::note(
                "the FMU offers only Model Exchange: this command integrates it (Dormand and Prince, order 5)",
            );
        }
        let clocks = description.variables.iter().filter(|v| v.kind() == Type::Clock);
        let clocks: Vec<&str> = clocks.map(|clock| clock.name.as_str()).collect();
        if !clocks.is_empty() {
            terminal::warn(format_args!(
                "the FMU has clocks ({}), and none ticks in this run: variables that a clock activates keep their start values",
                clocks.join(", ")
            ));
        }
        let drive = self.drive.as_deref();
        let (input, torque, others) = match (&self.profile, &self.input) {
            (Some(profile), _) => {
                let torque = profile.parse::<Written>()?.torque()?;
                (driven(description, drive)?, torque, Vec::new())
            }
            (None, Some(path)) => {
                let (hold, ignore) = (self.hold, self.ignore_columns);
                let all = histories(description, path, drive, hold, ignore, &mut |line| {
                    terminal::note(line);
                })?;
                let mut all = all.into_iter();
                let Some((input, history)) = all.next() else {
                    bail!("no column of {} has the name of an input of the FMU", path.display())
                };
                (Some(input), history, all.collect())
            }
            (None, None) => bail!("give the inputs of the run: --profile or --input"),
        };
        let run = Run {
            settings,
            input,
            stop: self.stop.unwrap_or(torque.span().1),
            torque,
            others,
            step: self.step,
            sample: self.sample,
            tolerance: self.tolerance,
            hold: self.hold,
        };
        let mut instance = run.initialise(&fmu)?;
        for warning in instance.take_warnings() {
            terminal::warn(warning);
        }
        let named: Vec<String> =
            run.input.iter().chain(run.others.iter().map(|(name, _)| name)).cloned().collect();
        // The bench starts at rest, unless a setting changes this.
        let rest = rest::moving_starts(description).into_iter().map(|name| (name, "0".into()));
        let settings: Vec<_> = rest.chain(run.settings.iter().cloned()).collect();
        let parameters = run::parameters(description, &settings, &named);
        let columns = match self.columns.is_empty() {
            // The table contains driven inputs in any case.
            true => default_columns(description, &parameters),
            false => whole_names(self.columns),
        };
        if let Some(i) = (1..columns.len()).find(|i| columns[..*i].contains(&columns[*i])) {
            bail!("--columns names {} twice", columns[i]);
        }
        // The table contains time and driven inputs in any case.
        let columns = run.columns_with(&[], columns.iter().map(String::as_str));
        let asked = columns.len();
        // These variables are also recorded, so that the run can report at its end if the model left its range of validity.
        let range = Range::read(description, &mut instance)?;
        let tanks = Tanks::read(description, &mut instance, self.tension.unwrap_or(WATER_TENSION))?;
        if self.tension.is_some() && tanks.is_none() {
            bail!(
                "--tension is for the tanks of Spacecraft and SloshTank (for HubSlosh set the parameter fluid.sigma)"
            );
        }
        let limits = Limits::find(|name| description.variable(name).is_ok());
        let forces = tanks.iter().flat_map(Tanks::required_variables).collect::<Vec<_>>();
        let sensors = Sensors::new(&self.sensors, description, &run.settings, run.step)?;
        let wave = range.as_ref().map(|_| WAVE);
        let needs = wave.into_iter().chain(forces.iter().map(String::as_str));
        let columns = run.columns_with(
            &columns,
            needs.chain(limits.required_columns()).chain(sensors.required_variables()),
        );
        // This is the memory for the table, for its copy with `--columns`, and for the output, where a number has up to 25
        // characters.
        let all = columns.len() + sensors.columns().len();
        guard::allow((run.steps() * (all + 3) * 50) as u64 + run.course_bytes());
        let bar = progress::steps_bar()?;
        bar.set_length(run.steps() as u64);
        let table = run.drive(&mut instance, &columns, |steps| bar.inc(steps))?;
        bar.finish_and_clear();
        for warning in instance.take_warnings() {
            terminal::warn(warning);
        }
        let mut notes = BTreeMap::from([
            ("fmu".into(), fmu.hash().into()),
            ("guid".into(), fmu.description().guid.clone()),
            ("version".into(), fmu.description().version.clone()),
            ("model".into(), description.model_name.clone()),
            ("parameters".into(), serde_json::json!(parameters).to_string()),
            ("inputs".into(), schedule::between(self.hold).into()),
            ("rows".into(), schedule::ROWS.into()),
        ]);
        if !self.sensors.is_empty() {
            notes.insert("sensors".into(), serde_json::json!(sensors.texts()).to_string());
        }
        let beyond: Vec<String> = range
            .iter()
            .filter_map(|range| Some((range, table.column(WAVE)?)))
            .flat_map(|(range, waves)| {
                [range.left(waves), range.without_weight(waves, table.column(G_AXIAL))]
            })
            .flatten()
            .chain(tanks.iter().flat_map(|tanks| tanks.without_weight(&table)))
            .chain(limits.describe(|name| table.column(name)))
            .collect();
        let driven = table.names().len() - columns.len();
        let table = sensors.recorded(table, driven + asked, "run", run.step)?;
        write_out(&table, &self.out, &notes)?;
        for how in beyond {
            terminal::warn(format_args!("the run left the range of its model: {how}"));
        }
        Ok(())
    }
}

/// Returns the columns to record by default. For HubSlosh (the FMU of the bench) these are four
/// signals; for another FMU they are all numeric outputs and the slosh angles, as in a campaign.
/// Quantities that only `hubslosh view` needs are added: the displacements of the bench's second
/// and further slosh modes, and the liquid left in draining tanks.
fn default_columns(
    description: &ModelDescription,
    parameters: &BTreeMap<String, String>,
) -> Vec<String> {
    const BENCH: [&str; 4] = [OMEGA, OMEGA_IMU, SLOSH_ANGLE, SLOSH_ANGLE_RADIAL];
    let mut names = match BENCH.iter().all(|name| description.variable(name).is_ok()) {
        true => BENCH.map(String::from).into(),
        false => stored_columns(description, None).split_off(1), // without time
    };
    let liquid = |name: &String| name.starts_with("slosh.q_") || name.ends_with(".liquid");
    names.extend(view::columns(description, parameters).into_iter().filter(liquid));
    names
}

/// Restores names with a comma in their index, such as `inertia[1,2]`, from a list that was split
/// at all commas.
fn whole_names(parts: Vec<String>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for part in parts {
        match names.last_mut().filter(|name| name.matches('[').count() > name.matches(']').count())
        {
            Some(open) => *open = format!("{open},{part}"),
            None => names.push(part),
        }
    }
    names
}

fn help() -> String {
    format!(
        "Profiles, with their defaults (torque in N·m, frequencies in Hz, times in s):\n{}\n\
         Sensors, with their defaults (SI; angles also as 90deg, lengths as 5mm):\n{}\n\
         Examples:\n  hubslosh run --profile exp-sweep:amplitude=0.1 --out sweep.parquet\n  \
         hubslosh run --profile sine:amplitude=0.05,frequency=2.344 --set friction.model=none \
         --set tank.h=50mm --step 0.005 --columns theta,omega,slosh_angle --out dwell.csv\n  \
         hubslosh run --input torque.csv --out answer.csv\n  \
         hubslosh run --parameters result.json --input bench.csv --ignore-columns --out twin.csv\n  \
         hubslosh run --profile zero --set init.slosh_angle=0.1 --out - | head\n  \
         hubslosh run --profile lin-sweep:duration=600 --sensor wave=gauge:angle=90deg,rate=25,noise=0.2mm \
         --sensor load=force:noise=0.01,quantum=0.005 --out bench.csv",
        profile::help(),
        sensors::help()
    )
}
