use std::path::{Path, PathBuf};

use analysis::statistics;
use anyhow::{Context, Result, bail, ensure};
use experiments::campaign::{Campaign, recorded};
use experiments::plan::{AMPLITUDE, Draft, Plan, Recorded};
use experiments::profile::{Torque, Written};
use names::hubslosh::{TAU_CMD, slosh};
use signals::recording::Columns;

use super::{RunsArgs, bench_day, campaign, open, setting};

/// Analyses recordings of a bench as `hubslosh campaign` analyses simulated runs, and compares them with simulations
/// under the same torque.
///
/// A recording has torque and one to three rates: time (s), tau_cmd (N·m), omega (rad/s), and optionally omega_x and
/// omega_y; --columns names other columns and units. The command writes the same tables and report as `hubslosh
/// campaign`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    hubslosh analyse bench_050.csv bench_100.csv --columns time=t:ms,tau_cmd=T_cmd:mNm,omega=gyro_z:deg/s\n  \
    hubslosh analyse up.mat --profile lin-sweep:f0=1,f1=4,duration=600 --set tank.h=0.08 --model spherical\n  \
    hubslosh analyse --plan bench.toml\n  \
    hubslosh analyse --bench-day tuesday --out dist/tuesday\n\n\
    If a [[run]] of the plan has recording = \"FILE\" (and columns = \"…\"), the recording is analysed, and the run is\n\
    simulated for comparison.")]
pub struct AnalyseArgs {
    /// Recordings: text in columns or Parquet; also .mat, HDF5, TDMS, MDF4 and .xlsx if the Python package is installed.
    #[arg(value_name = "RECORDING", required_unless_present_any = ["plan", "bench_day"])]
    recordings: Vec<PathBuf>,
    /// Columns of the recordings that contain the signals, with units. For example, omega=gyro_z:deg/s reads the rate
    /// omega from the column gyro_z in deg/s. A signal that is not named here is read from the column that has the
    /// name of the signal.
    #[arg(long, value_name = "SIGNAL=COLUMN[:UNIT],…", default_value_t, hide_default_value = true)]
    columns: Columns,
    /// Torque profile that was commanded during the recordings. Its amplitude is read from each recording.
    #[arg(long, value_name = "PROFILE", default_value = "exp-sweep:f0=1.25,f1=3.5,duration=2700")]
    profile: String,
    /// Slosh models to simulate for comparison with the recordings.
    ///
    /// - frozen: the whole liquid is rigid
    ///
    /// - linear: linear planar pendulums
    ///
    /// - planar: nonlinear planar pendulums
    ///
    /// - spherical: spherical pendulums, which can rotate (rotary slosh)
    ///
    /// - liquid: slosh modes to third order in their amplitude
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_value = "linear,spherical")]
    model: Vec<String>,
    /// Sets a known parameter of the bench by its name in the FMU, such as tank.h, tank.d, hub.I or friction.b.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = setting)]
    settings: Vec<(String, String)>,
    /// Plan that names the recordings, in place of recordings in the command line.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["recordings", "columns", "profile", "model", "settings"])]
    plan: Option<String>,
    /// Directory with the recordings of a day and their list, day.toml. One report then covers friction runs, free
    /// decays, the gyro at rest and sweeps.
    #[arg(long, value_name = "DIRECTORY", conflicts_with_all = ["recordings", "columns", "profile", "model", "settings", "plan"])]
    bench_day: Option<PathBuf>,
    #[command(flatten)]
    pub runs: RunsArgs,
    /// Directory for runs, tables and report.html [default: dist/NAME with the name of the first recording or of the
    /// plan].
    #[arg(long, value_name = "DIRECTORY")]
    out: Option<PathBuf>,
}

impl AnalyseArgs {
    pub fn run(self) -> Result<()> {
        if let Some(directory) = &self.bench_day {
            return bench_day::run(directory, &self.runs.fmu, self.runs.jobs, self.out.clone());
        }
        let first =
            self.plan.as_ref().map(Path::new).or(self.recordings.first().map(PathBuf::as_path));
        let stem = first.and_then(Path::file_stem).context("no recording is given")?;
        let out = self.out.clone().unwrap_or_else(|| Path::new("dist").join(stem));
        let mut plan = match &self.plan {
            Some(file) => Plan::read(file)?,
            None => self.draft()?.plan()?,
        };
        let fmu = open(&self.runs.fmu)?;
        plan.convert_units(fmu.description());
        let cases = plan.cases(fmu.description())?;
        ensure!(
            cases.iter().any(|case| case.recording.is_some()),
            "no [[run]] of the plan has recording = \"FILE\"; hubslosh campaign --plan simulates the plan"
        );
        let campaign = Campaign { plan, force: false, jobs: self.runs.jobs, out };
        let store = campaign.take()?;
        ensure!(
            !campaign.holds_another() || self.out.is_some(),
            "{} contains the results of another plan: --out DIRECTORY writes the new results to another directory",
            campaign.out.display()
        );
        campaign::drive(&fmu, &campaign, store, Vec::new())
    }

    /// Returns the plan that the command line describes. It has a run for each recording, whose
    /// torque has the amplitude of the recorded torque. Each run is simulated with every slosh
    /// model, for comparison with the recording.
    fn draft(&self) -> Result<Draft> {
        let profile: Written = self.profile.parse()?;
        let torque = profile.torque()?;
        if let Torque::Rows { .. } = torque {
            bail!(
                "--profile {}: the profile must be a sweep or noise, because the analysis needs a frequency response",
                self.profile
            )
        }
        let (mut runs, mut step) = (Vec::new(), None);
        for path in &self.recordings {
            let (name, columns) = (path.display(), self.columns.clone());
            let recorded = Recorded { path: path.clone(), columns };
            // The messages about changes to the recording are discarded, because its analysis prints them later.
            let (each, table) = recorded::read(&recorded, &mut |_| {})?;
            ensure!(
                each >= 1e-6,
                "{name}: the rows are {each:.3e} s apart (allowed: at least 1e-6 s). Is the time in another unit? --columns \
                 time=COLUMN:UNIT states it"
            );
            recorded::check_rows(path, each, &torque)?;
            step.get_or_insert(each);
            let amplitude = statistics::peak(table.column(TAU_CMD).unwrap_or_default());
            ensure!(
                amplitude > 0.0,
                "{name}: the torque tau_cmd is 0 N·m in every row, so there is no response to analyse (--columns names the \
                 column of the torque)"
            );
            // The amplitude is rounded to four digits, because the commanded amplitude is probably a round number.
            let digits = 10f64.powi(3 - amplitude.log10().floor() as i32);
            let amplitude = (amplitude * digits).round() / digits;
            runs.push(Draft::run(&recorded, [(AMPLITUDE, amplitude.into())]));
        }
        Ok(Draft {
            title: "Recordings".into(),
            profile: self.profile.clone(),
            step: Some(step.map_or(0.02, |step| (step * 1e9).round() / 1e9)),
            set: self.settings.clone(),
            runs,
            vary: vec![(slosh::MODEL, self.model.clone())],
            ..Draft::default()
        })
    }
}
