//! `hubslosh identify fmu` and `hubslosh design --free …`: identification of any FMU.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use experiments::sensors::Sensor;
use identify::any_fmu;
use identify::any_fmu::foresee::{Bound, foresee};
use identify::any_fmu::likelihood::deviances;
use identify::input::names::list;
use identify::input::question::{Question, Solver};
use identify::input::record::Record;
use identify::model::simulate::Model;
use signals::recording::Columns;
use signals::table::Table;

use super::estimates::{Out, deviation};
use crate::terminal;

#[derive(clap::Args)]
#[command(next_help_heading = "Options for any FMU")]
pub struct AnyFmuArgs {
    /// Unknowns to estimate, each with an initial guess and optionally bounds [default bounds: min and max of the
    /// FMU].
    ///
    /// - NAME: a Real parameter or a start value of the FMU
    ///
    /// - NAME@each: a separate value of NAME for each recording
    ///
    /// - scale(NAME): the relative scale error of the input or output NAME; 0 means an exact scale
    #[arg(long, value_name = "NAME=START[:LOW:HIGH],…")]
    pub free: Vec<String>,
    /// Prior knowledge of an unknown: its mean and standard deviation.
    #[arg(long, value_name = "NAME=MEAN:STD,…")]
    prior: Vec<String>,
    /// Uncertainty (standard deviation) of values that are taken as known. It widens the 95 % intervals of the
    /// estimates.
    ///
    /// - NAME: a value that is given by --set
    ///
    /// - scale(NAME): the scale of an input or output
    ///
    /// - scale(time): the rate of the clock
    ///
    /// SIZE is relative (0.5% or 0.005) or, for a value that is given by --set, absolute (5mm, or ±0.1 in the unit of
    /// the variable); 0 means exact.
    #[arg(long = "tolerance", value_name = "NAME=SIZE,…")]
    pub tolerances: Vec<String>,
    /// Inputs of the FMU that are set to the values in the recordings. The values are interpolated linearly between the
    /// rows; with NAME:held each value is held until the next row.
    #[arg(long, value_name = "NAME[:held],…", requires = "free")]
    inputs: Vec<String>,
    /// Outputs of the FMU that were recorded.
    #[arg(long, value_name = "NAME,…", requires = "free")]
    outputs: Vec<String>,
    /// Sensor, such as a wave gauge, whose readings were recorded as the output NAME; for outputs that are not
    /// variables of the FMU. It is described as for `hubslosh run --sensor`. Its scale, bias and delay are known; its
    /// noise is estimated. The option may be repeated.
    #[arg(long = "sensor", value_name = "NAME=KIND:key=value,…", requires = "free")]
    sensors: Vec<Sensor>,
    /// Outputs whose sensor has an unknown constant bias, which is estimated for each recording; STD is the prior
    /// standard deviation of the bias.
    #[arg(long, value_name = "OUTPUT[=STD],…")]
    bias: Vec<String>,
    /// Three outputs A, B and C that one instrument with three axes measures. The scale errors and misalignments (rad)
    /// of the axes are estimated; SCALE and ANGLE are the prior standard deviations of these errors.
    #[arg(long, value_name = "A,B,C=SCALE:ANGLE", requires = "free")]
    triad: Vec<String>,
    /// Models the noise of every output as white noise plus a slowly drifting bias (Gauss–Markov process).
    #[arg(long)]
    drift: bool,
    /// Solver that simulates the FMU, with its relative tolerance.
    ///
    /// - own: the FMU's own solver (Co-Simulation), for example own:1e-6
    ///
    /// - host: the solver of this command (Model Exchange), for example host:1e-9; the default tolerance is 1e-8
    #[arg(
        long,
        value_name = "own|host[:TOLERANCE]",
        requires = "free",
        default_value = "own",
        value_parser = solver
    )]
    solver: Stepped,
}

#[derive(Clone, Copy)]
struct Stepped {
    solver: Solver,
    tolerance: Option<f64>,
}

fn solver(text: &str) -> Result<Stepped> {
    let (whose, tolerance) = match text.split_once(':') {
        Some((whose, number)) => {
            let number: f64 =
                number.parse().with_context(|| format!("{number} is not a number"))?;
            ensure!(
                (1e-13..=1e-2).contains(&number),
                "{number:e} (allowed: tolerances from 1e-13 to 1e-2)"
            );
            (whose, Some(number))
        }
        None => (text, None),
    };
    match whose {
        "own" => Ok(Stepped { solver: Solver::Own, tolerance }),
        "host" => Ok(Stepped { solver: Solver::Host(tolerance.unwrap_or(1e-8)), tolerance: None }),
        _ => bail!("{whose} (allowed: own, own:TOLERANCE, host, host:TOLERANCE)"),
    }
}

/// Number of random starts within the bounds. They are tried if the search from the start values of
/// the user ends without a good fit.
const STARTS: usize = 8;

#[derive(clap::Args)]
pub struct PointsArgs {
    /// Table of points, with one column for each unknown. Instead of fitting, the command computes −2 ln L at each
    /// point, where L is the likelihood of the recordings, and writes the values to --out. The function
    /// `hubslosh.posterior` in Python reads them.
    #[arg(long, hide = true, value_name = "CSV", requires_all = ["free", "found"])]
    points: Option<PathBuf>,
    /// Result of an earlier identification (.json). Its estimates of the noise are used in the likelihood.
    #[arg(long, hide = true, value_name = "JSON", requires = "points")]
    found: Option<PathBuf>,
}

/// Options that `identify` and `design` have both with and without the option `--free`.
pub struct Request<'a> {
    pub data: &'a [PathBuf],
    pub settings: &'a [(String, String)],
    pub columns: &'a str,
    pub rate: Option<f64>,
    pub fmu: &'a Path,
    pub json: bool,
}

/// Parses all items of `flags`, an option that may be given several times with commas between
/// items. The error of a wrong item is added to `problems`, so that one message can list all of
/// them.
fn read<T: std::str::FromStr<Err = anyhow::Error>>(
    flags: &[String],
    problems: &mut Vec<String>,
) -> Vec<T> {
    parsed(flags.iter().flat_map(|flag| list(flag)).map(str::parse), problems)
}

fn parsed<T>(read: impl Iterator<Item = Result<T>>, problems: &mut Vec<String>) -> Vec<T> {
    read.filter_map(|item| item.map_err(|error| problems.push(format!("{error:#}"))).ok()).collect()
}

impl Request<'_> {
    fn texts(&self) -> Vec<String> {
        self.settings.iter().map(|(name, value)| format!("{name}={value}")).collect()
    }
}

impl AnyFmuArgs {
    pub fn is_asked(&self) -> bool {
        !self.free.is_empty()
    }

    fn question(&self, request: &Request) -> Result<Question> {
        let mut problems = Vec::new();
        let names = |flags: &[String]| -> Vec<String> {
            flags.iter().flat_map(|flag| list(flag)).map(String::from).collect()
        };
        let inputs: Vec<(String, bool)> = names(&self.inputs)
            .into_iter()
            .map(|name| match name.strip_suffix(":held") {
                Some(name) => (name.to_string(), true),
                None => (name, false),
            })
            .collect();
        let driven: Vec<String> = inputs.iter().map(|(name, _)| name.clone()).collect();
        for (flag, names) in [("inputs", &driven), ("outputs", &names(&self.outputs))] {
            let twice = (1..names.len()).find(|i| names[..*i].contains(&names[*i]));
            problems.extend(twice.map(|i| format!("--{flag} names {} twice", names[i])));
        }
        let question = Question {
            free: read(&self.free, &mut problems),
            priors: read(&self.prior, &mut problems),
            tolerances: read(&self.tolerances, &mut problems),
            settings: parsed(request.texts().iter().map(|text| text.parse()), &mut problems),
            held: inputs.into_iter().filter(|(_, held)| *held).map(|(name, _)| name).collect(),
            inputs: driven,
            outputs: names(&self.outputs),
            sensors: self.sensors.clone(),
            biases: read(&self.bias, &mut problems),
            // The name of a triad, which is the part before the equals sign, contains commas, so that items are
            // not split at commas.
            triads: parsed(self.triad.iter().map(|text| text.parse()), &mut problems),
            drift: self.drift,
            solver: self.solver.solver,
            tolerance: self.solver.tolerance,
            starts: STARTS,
        };
        let unread = |sensor: &&Sensor| !question.outputs.iter().any(|output| sensor.has(output));
        for sensor in self.sensors.iter().filter(unread) {
            problems.push(format!("--sensor {}: this sensor is not among the recorded outputs (--outputs must list it)", sensor.name));
        }
        ensure!(problems.is_empty(), "{}", problems.join("; "));
        Ok(question)
    }

    fn model(&self, request: &Request, question: &Question) -> Result<Model> {
        let path = crate::fmu::find(request.fmu)?;
        let model = Model::open(&path, question.solver)?;
        for what in model.changed() {
            terminal::warn(format_args!(
                "loading {} has changed the {what} of this process, which an FMU must not do",
                path.display()
            ));
        }
        Ok(model)
    }

    /// Fits the unknowns to the recordings, writes the result to the files of `out` and prints it.
    /// With the option `--points` no fit is made; −2 ln L, with the likelihood L, is written at the
    /// given points instead.
    pub fn identify(&self, request: &Request, points: &PointsArgs, out: &Out) -> Result<()> {
        let question = self.question(request)?;
        let model = self.model(request, &question)?;
        let columns = Columns::for_variables(list(request.columns))?.with_rate(request.rate)?;
        let mut notes = Vec::new();
        let mut records = Vec::new();
        for path in request.data {
            records.push(Record::read(
                path,
                &question,
                model.description(),
                &columns,
                &mut |line| {
                    terminal::note(&line);
                    notes.push(line);
                },
            )?);
        }
        if let (Some(points), Some(found)) = (&points.points, &points.found) {
            let names: Vec<String> = question
                .unknowns(model.description(), &records)?
                .into_iter()
                .map(|(unknown, _)| unknown.name)
                .collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let table = Table::read(points, &names)?;
            let columns: Vec<&[f64]> = names.iter().filter_map(|name| table.column(name)).collect();
            let rows = (0..table.rows())
                .map(|k| columns.iter().map(|c| c[k]).collect())
                .collect::<Vec<_>>();
            let result = files::input::text(found)
                .with_context(|| format!("{} cannot be read", found.display()))?;
            let deviances = deviances(&model, &question, &records, &result, &rows)?;
            return out.save(&(serde_json::to_string(&deviances)? + "\n"));
        }
        let found = out.search(|news| any_fmu::identify(&model, &question, &records, news))?;
        out.finish(found, notes)
    }

    /// Predicts the standard deviations that a fit to recordings with these inputs would have
    /// (Cramér–Rao bound), and prints them. `noise` has items `OUTPUT=STD,…`: the standard
    /// deviation of the noise in one row, in the unit of the output.
    pub fn design(&self, request: &Request, noise: &[String]) -> Result<()> {
        let question = self.question(request)?;
        let model = self.model(request, &question)?;
        let columns = Columns::for_variables(list(request.columns))?.with_rate(request.rate)?;
        let mut given = BTreeMap::new();
        for item in noise.iter().flat_map(|flag| list(flag)) {
            let (name, std) = super::setting(item)?;
            let std: f64 = std.parse().with_context(|| format!("--noise {item}"))?;
            given.insert(name, std);
        }
        let missing: Vec<&str> = question
            .outputs
            .iter()
            .filter(|name| !given.contains_key(*name))
            .map(String::as_str)
            .collect();
        ensure!(
            missing.is_empty(),
            "--noise OUTPUT=STD, the standard deviation of one sample of an output, is missing for {}",
            missing.join(", ")
        );
        let sizes: Vec<f64> = question.outputs.iter().map(|name| given[name]).collect();
        let alone = Question { outputs: Vec::new(), ..question.clone() };
        let mut records = Vec::new();
        for path in request.data {
            let read = Record::read(path, &alone, model.description(), &columns, &mut |_| {})?;
            let outputs = vec![vec![0.0; read.time.len()]; question.outputs.len()];
            records.push(Record { outputs, ..read });
        }
        ensure!(
            !records.is_empty(),
            "no table of planned inputs is given: name one or more files with times and inputs"
        );
        let bounds = foresee(&model, &question, &records, &sizes, &mut |warning| {
            terminal::warn(warning);
        })?;
        if request.json {
            terminal::print_json(&bounds)?;
        } else {
            print_predicted(&bounds);
        }
        Ok(())
    }
}

fn print_predicted(bounds: &[Bound]) {
    println!(
        "{:28} {:>12} {:>10} {:>9} {:>10}  most correlated with",
        "", "value", "std", "std %", "if alone"
    );
    for b in bounds {
        let percent = match b.value {
            0.0 => "–".into(),
            _ if b.std.is_nan() => "–".into(),
            value => format!("{:.3}", (100.0 * b.std / value).abs()),
        };
        let with = match &b.with {
            _ if b.decided_by_solver => "(hidden by errors of the solver)".into(),
            _ if !b.inseparable_from.is_empty() => {
                format!("(cannot be separated from {})", b.inseparable_from.join(", "))
            }
            with => with.as_ref().map_or(String::new(), |(name, r)| format!("{name} ({r:+.3})")),
        };
        println!(
            "{:28} {:>12.5} {:>10} {percent:>9} {:>10}  {with}",
            b.name,
            b.value,
            deviation(b.std),
            deviation(b.std_alone)
        );
    }
    let decided: Vec<&str> =
        bounds.iter().filter(|b| b.decided_by_solver).map(|b| b.name.as_str()).collect();
    if !decided.is_empty() {
        println!(
            "No bound is given for {}: errors of the FMU's solver hide its effect on the outputs. A smaller tolerance, --solver \
             own:TOLERANCE, reduces these errors. So does --solver host, unless an output depends on the slope of an input.",
            decided.join(", ")
        );
    }
    let untold = bounds.iter().filter(|b| b.is_parameter && b.not_determined);
    let untold: Vec<&str> = untold.map(|b| b.name.as_str()).collect();
    if !untold.is_empty() {
        println!("These inputs do not determine {}.", untold.join(", "));
    }
}
