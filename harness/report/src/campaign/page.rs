use analysis::features::Features;
use analysis::sweep::Sweep;
use analysis::{BAND, FrequencyResponse, logarithmic_grid};
use experiments::campaign::{Curve, Estimate, Outcome, Results};
use experiments::plan::{AMPLITUDE, Plan};
use host::fmu::Fmu;
use names::hubslosh::{slosh, tank};

/// Runs that differ only in the parameter on the horizontal axis of the figures.
///
/// - `fill`: depth of the liquid, m; `None` if it is on the axis.
/// - `others`: further values by which this group differs from other groups, for example `tank.d 111 mm`.
/// - `drawn`: the runs that are plotted over time.
/// - `exact`: for each run, antiresonance and resonance of the exact linear response.
pub(super) struct Group<'a> {
    pub model: &'a str,
    pub fill: Option<f64>,
    pub others: Vec<String>,
    pub runs: Vec<&'a Outcome>,
    pub drawn: Vec<&'a Outcome>,
    pub sweep: Option<&'a Sweep>,
    pub exact: Vec<Features>,
}

impl Group<'_> {
    pub fn title(&self) -> String {
        match &*self.plant() {
            "" => self.model.to_string(),
            plant => format!("{}, {plant}", self.model),
        }
    }

    /// Returns the differences from other groups of the same model, for example `10 cm fill, tank.d 111 mm`.
    pub fn plant(&self) -> String {
        let fill = self.fill.map(|fill| format!("{} cm fill", cm(fill)));
        fill.into_iter().chain(self.others.iter().cloned()).collect::<Vec<_>>().join(", ")
    }

    pub fn band(&self) -> Option<(f64, f64)> {
        band(self.runs[0])
    }

    pub fn exact_response(&self) -> FrequencyResponse {
        exact_response(self.runs[0])
    }
}

pub(super) struct Axis {
    pub place: usize,
    pub name: String,
    pub label: String,
    pub scale: f64,
}

impl Axis {
    pub fn value(&self, run: &Outcome) -> Option<f64> {
        let value: f64 = run.case.varied[self.place].parse().ok()?;
        Some((value * self.scale * 1e9).round() / 1e9)
    }

    pub fn unit(&self) -> &str {
        self.label.find(" / ").map_or("", |at| &self.label[at + 2..])
    }
}

pub(super) struct Page<'a> {
    pub plan: &'a Plan,
    pub groups: Vec<Group<'a>>,
    pub axis: Option<Axis>,
    pub varied: Vec<Option<Varied>>,
}

impl Page<'_> {
    pub fn name(&self, run: &Outcome) -> String {
        let value = self.axis.as_ref().and_then(|axis| Some((axis, axis.value(run)?)));
        match value {
            Some((axis, x)) if axis.unit().is_empty() => format!("{} {x}", axis.label),
            Some((axis, x)) => format!("{x}{}", axis.unit()),
            None => run.case.name.clone(),
        }
    }
}

pub(super) const MOST_CURVES: usize = 24;

/// Returns the estimate whose antiresonance and resonance the page shows for a run, and its name. For a sweep it is
/// the estimate in `features.csv`, otherwise `spa`.
pub(super) fn best(run: &Outcome) -> Option<(&Estimate, &'static str)> {
    run.estimate().or_else(|| Some((&run.record.as_ref()?.spa, "spa")))
}

pub(super) fn passing(run: &Outcome) -> Curve {
    let response = run.passing.as_ref().map(|passing| &passing.rate.response);
    response.map_or(Curve::new(), |r| zip(&r.frequency, &r.decibels()))
}

pub(super) fn sweep(run: &Outcome) -> Option<&Sweep> {
    run.case.torque.profile()?.sweep()
}

pub(super) fn band(run: &Outcome) -> Option<(f64, f64)> {
    run.case.torque.profile()?.band()
}

fn exact_response(run: &Outcome) -> FrequencyResponse {
    let grid = logarithmic_grid(band(run).unwrap_or(BAND), 2000);
    run.linear.frequency_response(&grid)
}

pub(super) fn exact_features(run: &Outcome) -> Features {
    Features::find(&exact_response(run))
}

pub(super) fn unit(fmu: &Fmu, name: &str) -> Option<String> {
    let unit = fmu.description().variable(name).ok()?.attributes().unit.clone()?;
    Some(printed(&unit))
}

/// Converts a unit from FMI's spelling to typographic form, for example N.m to N·m and rad/s2 to rad/s².
pub(crate) fn printed(unit: &str) -> String {
    unit.replace('.', "·").replace("m2", "m²").replace("s2", "s²")
}

/// A varied quantity with the name that readers see: the label of a parameter of the torque profile, or the
/// name of a variable. `scale` is the factor from SI to the displayed unit.
pub(super) struct Varied {
    pub name: String,
    pub unit: String,
    pub scale: f64,
}

impl Varied {
    pub fn new(variable: &str, fmu: &Fmu, runs: &[Outcome]) -> Option<Varied> {
        let (name, unit) = match variable.strip_prefix("profile.") {
            Some(name) => {
                let mut profiles = runs.iter().filter_map(|run| run.case.torque.profile());
                let parameter = profiles.find_map(|profile| profile.parameter(name))?;
                (parameter.label, parameter.unit.to_string())
            }
            None => (variable, unit(fmu, variable).unwrap_or_default()),
        };
        let (unit, scale) = match &*unit {
            "N·m" if variable == AMPLITUDE => ("mN·m".into(), 1e3),
            "m" => ("mm".into(), 1e3),
            "1" => (String::new(), 1.0),
            _ => (unit, 1.0),
        };
        Some(Varied { name: name.into(), unit, scale })
    }

    /// Formats a value of the varied quantity with its name and unit, for example `tank.d 111 mm`
    /// or `slosh.model planar`.
    pub fn value(&self, text: &str) -> String {
        let number = text.parse::<f64>().ok().map(|value| {
            // rounded to remove the errors of binary fractions
            let value = (value * self.scale * 1e9).round() / 1e9;
            format!("{value} {}", self.unit).trim_end().to_string()
        });
        format!("{} {}", self.name, number.as_deref().unwrap_or(text))
    }

    pub fn label(&self) -> String {
        match &*self.unit {
            "" => self.name.clone(),
            unit => format!("{} / {unit}", self.name),
        }
    }
}

pub(super) fn axis(plan: &Plan, fmu: &Fmu, runs: &[Outcome]) -> Option<Axis> {
    let variable = plan.axis()?;
    let place = plan.varied().iter().position(|n| *n == variable)?;
    let varied = Varied::new(variable, fmu, runs)?;
    Some(Axis { place, label: varied.label(), name: varied.name, scale: varied.scale })
}

pub(super) fn groups<'a>(plan: &Plan, fmu: &Fmu, results: &'a Results) -> Vec<Group<'a>> {
    let axis = plan.axis().unwrap_or("");
    // indices of the varied parameters that separate groups, except model and fill
    let grouping = plan.grouping();
    let recorded = results.recordings() > 0;
    let differs = |place: usize| {
        let values = results.outcomes.iter().map(|run| &run.case.varied[place]);
        distinct(values).len() > 1
    };
    let others: Vec<(usize, Varied)> = plan
        .varied()
        .into_iter()
        .enumerate()
        .filter(|(_, name)| grouping.contains(name) && *name != axis)
        .filter(|(_, name)| ![slosh::MODEL, tank::H].contains(name))
        // A single recording needs no label with its varied values, because no other
        // recording differs from it.
        .filter(|(i, _)| !recorded || differs(*i))
        .filter_map(|(i, name)| Some((i, Varied::new(name, fmu, &results.outcomes)?)))
        .collect();
    let one_fill = axis != tank::H;
    let mut groups: Vec<Group> = Vec::new();
    for run in &results.outcomes {
        let values = others.iter().filter(|(i, _)| !run.case.varied[*i].is_empty());
        let key: Vec<String> = match &run.case.listed {
            // the name that the plan gives the group is clearer than the values
            Some(name) => vec![name.replace('_', " ")],
            None => values.map(|(i, varied)| varied.value(&run.case.varied[*i])).collect(),
        };
        let same = |g: &&mut Group| {
            g.model == run.range.model && (!one_fill || g.fill == run.range.fill) && g.others == key
        };
        let exact = exact_features(run);
        let drawn = run.has_curves().then_some(run);
        match groups.iter_mut().find(same) {
            Some(group) => {
                group.runs.push(run);
                group.drawn.extend(drawn);
                group.exact.push(exact);
            }
            None => {
                groups.push(Group {
                    model: &run.range.model,
                    fill: run.range.fill.filter(|_| one_fill),
                    others: key,
                    runs: vec![run],
                    drawn: drawn.into_iter().collect(),
                    sweep: sweep(run),
                    exact: vec![exact],
                });
            }
        }
    }
    groups
}

pub(super) fn runs(count: usize) -> String {
    format!("{count} run{}", if count == 1 { "" } else { "s" })
}

pub(super) fn manoeuvre(run: &Outcome) -> Option<f64> {
    run.ending.manoeuvre
}

pub(super) fn sentence_with_names(what: &str, things: &[String]) -> String {
    match things {
        [] => String::new(),
        few if few.len() <= 4 => format!(" {what}: {}.", few.join(", ")),
        many => format!(" {what}: {} and {} more.", many[..3].join(", "), many.len() - 3),
    }
}

pub(super) fn distinct<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}

pub(super) fn torque_amplitude(run: &Outcome) -> f64 {
    run.case.amplitude.unwrap_or(0.0)
}

pub(super) fn zip(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    x.iter().copied().zip(y.iter().copied()).collect()
}

pub(super) fn cm(length: f64) -> f64 {
    (length * 1e6).round() / 1e4
}

pub(super) fn hertz(value: Option<f64>) -> String {
    value.map_or("none".into(), |f| format!("{f:.4} Hz"))
}
