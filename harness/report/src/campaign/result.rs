//! Writes the sentence with which the page begins: the result of the campaign in numbers.

use experiments::campaign::{Outcome, Results};
use experiments::profile::Torque;
use names::hubslosh::SloshModel;

use super::page::{Axis, Group, Page, best, distinct, exact_features, manoeuvre, torque_amplitude};
use super::recordings;

/// Features of one run's frequency response: the position of the run on the axis, in the unit of the axis, and
/// antiresonance and resonance, estimated and of the exact linear plant, Hz. `swirls` is true if the slosh was
/// rotary for some time.
#[derive(Clone, Copy, Debug)]
struct Point {
    x: f64,
    antiresonance: Option<f64>,
    resonance: Option<f64>,
    exact: [Option<f64>; 2],
    swirls: bool,
}

impl Point {
    fn extrema(&self) -> [Option<f64>; 2] {
        [self.antiresonance, self.resonance]
    }
}

/// The runs of one group in the order of the axis. `plant` describes how the group differs from other groups,
/// apart from the model, for example `10 cm fill`.
#[derive(Clone, Debug)]
struct Series {
    model: String,
    plant: String,
    points: Vec<Point>,
}

impl Series {
    fn new(group: &Group, axis: Option<&Axis>) -> Series {
        let point = |run: &&Outcome| {
            let features = best(run)?.0.features;
            let exact = exact_features(run);
            Some(Point {
                x: axis.map_or(Some(0.0), |axis| axis.value(run))?,
                antiresonance: features.f_dip,
                resonance: features.f_res,
                exact: [exact.f_dip, exact.f_res],
                swirls: run.rotary.is_some_and(|rotary| rotary.time > 0.0),
            })
        };
        let mut points: Vec<Point> = group.runs.iter().filter_map(point).collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        Series { model: group.model.into(), plant: group.plant(), points }
    }

    fn is_linear(&self) -> bool {
        [SloshModel::Linear.name(), SloshModel::Frozen.name()].contains(&&*self.model)
    }

    /// Returns the smallest and the largest torque (or other value on the axis) with rotary slosh, and true if the
    /// slosh is rotary at every value from the smallest to the end of the axis. Returns `None` without rotary slosh.
    fn rotary_range(&self) -> Option<(f64, f64, bool)> {
        let first = self.points.iter().position(|p| p.swirls)?;
        let last = self.points.iter().rposition(|p| p.swirls)?;
        let on = last + 1 == self.points.len() && self.points[first..].iter().all(|p| p.swirls);
        Some((self.points[first].x, self.points[last].x, on))
    }
}

/// Returns the result in one to three sentences, or an empty text if the runs have no result that
/// a sentence could state.
pub(super) fn sentence(page: &Page, results: &Results) -> String {
    if results.recordings() > 0 {
        return recordings::result(results);
    }
    if let Some(first) = page.groups.first() {
        let axis = page.axis.as_ref();
        let has_response = page.groups.iter().any(|group| group.band().is_some());
        if has_response {
            let series: Vec<Series> =
                page.groups.iter().map(|group| Series::new(group, axis)).collect();
            return match axis {
                Some(axis) => describe_responses(&series, &axis.name, axis.unit()),
                None => describe_single_runs(&series),
            };
        }
        return match (axis, manoeuvre(first.runs[0])) {
            (_, Some(_)) => left_behind(page),
            _ => format!("{} {}", rotation(page), largest_angle(page)).trim().into(),
        };
    }
    largest_angle_of_other_fmus(results)
}

fn describe_responses(series: &[Series], name: &str, unit: &str) -> String {
    let mut sentences = Vec::new();
    let nonlinear: Vec<&Series> = series.iter().filter(|s| !s.is_linear()).collect();
    let several = {
        let mut plants: Vec<&str> = series.iter().map(|s| s.plant.as_str()).collect();
        plants.sort_unstable();
        plants.dedup();
        plants.len() > 1
    };
    // the results of nonlinear models are compared with the linear runs of the same plant or, without such
    // runs, with the exact linear plant
    let measured = |own: &Series| {
        series.iter().find(|s| s.model == SloshModel::Linear.name() && s.plant == own.plant)
    };
    let reference = |own: &Series, point: &Point| -> [Option<f64>; 2] {
        let run = measured(own).and_then(|s| s.points.iter().find(|p| p.x == point.x));
        run.map_or(point.exact, Point::extrema)
    };
    let linear = match nonlinear.iter().all(|s| measured(s).is_some()) {
        true => "the linear model",
        false => "the exact linear response",
    };
    if name != "torque amplitude" || nonlinear.is_empty() {
        sentences.extend(describe_shifts(series, name, unit, several));
    }
    let swirling: Vec<&&Series> = nonlinear.iter().filter(|s| s.rotary_range().is_some()).collect();
    let ends = |s: &Series| s.points.first().map(|p| p.x).zip(s.points.last().map(|p| p.x));
    // the range of torques before the first rotary slosh, or the whole axis
    let below = |s: &&Series| -> Vec<Point> {
        s.points.iter().copied().take_while(|p| !p.swirls).collect()
    };
    let apart = nonlinear.iter().flat_map(|s| below(s).into_iter().map(move |p| (s, p)));
    let apart = apart.flat_map(|(s, p)| {
        let pairs = p.extrema().into_iter().zip(reference(s, &p));
        pairs.filter_map(|(f, reference)| Some(((f? - reference?).abs(), reference?)))
    });
    let worst = apart.fold(None, |worst: Option<(f64, f64)>, (gap, f)| match worst {
        Some((most, _)) if most >= gap => worst,
        _ => Some((gap, f)),
    });
    let within = worst.map(|(gap, f)| {
        format!(
            "{linear} holds within {} mHz ({}\u{a0}%)",
            format_two_digits(1e3 * gap),
            format_two_digits(100.0 * gap / f)
        )
    });
    let holds = |where_: &str| {
        within.as_ref().map(|within| format!("{where_}{within} for antiresonance and resonance"))
    };
    if swirling.is_empty() {
        let stays = nonlinear.iter().any(|s| s.model != SloshModel::Planar.name());
        let range =
            nonlinear.iter().filter_map(|s| ends(s)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        if let (Some(holds), Some((from, to))) = (holds(""), range) {
            let plane = if stays { "No run leaves its plane (no rotary slosh): " } else { "" };
            let range = if from == to {
                format!("at {to}{unit}")
            } else {
                format!("from {from} to {to}{unit}")
            };
            sentences.push(capital(&format!("{plane}{holds}, {range}")));
        }
        return finished(&sentences);
    }
    let part = |s: &Series| {
        let (first, last, on) = s.rotary_range().expect("they swirl");
        let with = if several { format!(" ({})", s.plant) } else { String::new() };
        let with = match nonlinear.iter().any(|other| other.model != s.model) {
            true => format!("{with} ({})", s.model),
            false => with,
        };
        match (on, first == last) {
            (true, false) => format!("from {first}{unit} on{with}"),
            (_, true) => format!("at {first}{unit}{with}"),
            (false, false) => format!("between {first} and {last}{unit}{with}"),
        }
    };
    let where_ = match swirling.len() {
        0..=3 => swirling.iter().map(|s| part(s)).collect::<Vec<_>>().join(" and "),
        many => {
            let first =
                swirling.iter().filter_map(|s| Some(s.rotary_range()?.0)).fold(f64::MAX, f64::min);
            format!("in {many} of {} series, from {first}{unit} at the earliest,", series.len())
        }
    };
    // the largest shift of a resonance in rotary slosh, with its sign
    let shifts = swirling.iter().flat_map(|s| {
        let turning = s.points.iter().filter(|p| p.swirls);
        turning.filter_map(move |p| {
            let reference = reference(s, p)[1].or(p.exact[1])?;
            Some((p.resonance?, p.resonance? - reference))
        })
    });
    let far =
        shifts.fold((0.0, 0.0), |far: (f64, f64), s| if s.1.abs() > far.1.abs() { s } else { far });
    let to = match far {
        (_, shift) if shift.abs() < 5e-4 => String::new(),
        (f, shift) => {
            let way = if shift > 0.0 { "up" } else { "down" };
            format!(" and the resonance moves {way} to {f:.2} Hz")
        }
    };
    let first = capital(&format!("{where_} the liquid swirls{to}"));
    let all: Vec<Point> = nonlinear.iter().flat_map(below).collect();
    match holds("below, ").filter(|_| !all.is_empty()) {
        Some(holds) => sentences.push(format!("{first}; {holds}")),
        None => sentences.push(first),
    }
    finished(&sentences)
}

/// Describes how antiresonance and resonance depend on the varied parameter `name`, for at most three series.
/// If there are series of the linear model, only these are described.
fn describe_shifts(series: &[Series], name: &str, unit: &str, several: bool) -> Vec<String> {
    let linear = series.iter().any(|s| s.model == SloshModel::Linear.name());
    let these: Vec<&Series> = series
        .iter()
        .filter(|s| s.points.len() > 1 && (!linear || s.model == SloshModel::Linear.name()))
        .collect();
    let sentence = |s: &&Series| {
        let [antiresonance, resonance] = [|p: &Point| p.antiresonance, |p: &Point| p.resonance]
            .map(|range| {
                let values: Vec<f64> = s.points.iter().filter_map(range).collect();
                let (first, last) = (*values.first()?, *values.last()?);
                let low = values.iter().copied().fold(f64::MAX, f64::min);
                let high = values.iter().copied().fold(f64::MIN, f64::max);
                Some(match high - low < 5e-3 * high {
                    // the feature hardly changes over the axis
                    true => format!(
                        "stays within {} mHz of {:.3} Hz",
                        format_two_digits(500.0 * (high - low)),
                        (low + high) / 2.0
                    ),
                    // the feature increases or decreases from one end of the axis to the other
                    false if (last - first).abs() > 0.9 * (high - low) => {
                        format!("moves from {first:.3} to {last:.3} Hz")
                    }
                    false => format!("lies between {low:.3} and {high:.3} Hz"),
                })
            });
        let (from, to) = (s.points.first()?.x, s.points.last()?.x);
        let with = if several { format!("; {}", s.plant) } else { String::new() };
        let parts: Vec<String> = [("antiresonance", antiresonance), ("resonance", resonance)]
            .into_iter()
            .filter_map(|(what, says)| Some(format!("the {what} {}", says?)))
            .collect();
        (!parts.is_empty()).then(|| {
            capital(&format!("{} ({name} from {from} to {to}{unit}{with})", parts.join(", ")))
        })
    };
    shorten_list(these.iter().filter_map(sentence).collect(), 3)
}

fn describe_single_runs(series: &[Series]) -> String {
    let hertz = |f: Option<f64>| f.map_or("none".into(), |f| format!("{f:.4} Hz"));
    let describe = |s: &Series| {
        let point = s.points.first()?;
        let [antiresonance, resonance] = point.extrema().map(hertz);
        let exact = point.exact.map(hertz);
        let what = if series.len() > 1 { format!("{}: ", s.title()) } else { String::new() };
        Some(match point.extrema() {
            [None, None] => format!(
                "{what}No antiresonance and resonance that can be trusted; those of the exact linear plant are {} and {}",
                exact[0], exact[1]
            ),
            _ => format!(
                "{what}Antiresonance {antiresonance}, resonance {resonance}; of the exact linear plant {} and {}{}",
                exact[0],
                exact[1],
                if point.swirls { "; the liquid swirls" } else { "" }
            ),
        })
    };
    finished(&shorten_list(series.iter().filter_map(describe).collect(), 3))
}

impl Series {
    fn title(&self) -> String {
        [&*self.model, &*self.plant]
            .into_iter()
            .filter(|s| !s.is_empty())
            .collect::<Vec<_>>()
            .join(", ")
    }
}

fn names(page: &Page) -> Vec<String> {
    let plants = distinct(page.groups.iter().map(Group::plant));
    let name = |group: &Group| match plants.len() {
        1 => group.model.to_string(),
        _ => group.title(),
    };
    page.groups.iter().map(name).collect()
}

fn left_behind(page: &Page) -> String {
    let extremes = |group: &Group| {
        let rates = group.runs.iter().filter_map(|run| {
            let x = page.axis.as_ref().and_then(|axis| axis.value(run));
            Some((1e3 * run.ending.rate?, x))
        });
        let rates: Vec<(f64, Option<f64>)> = rates.collect();
        let most = rates.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let least = rates.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some((most, least))
    };
    let named = page.groups.iter().zip(names(page));
    let all: Vec<_> = named
        .filter_map(|(group, name)| extremes(group).map(|(most, least)| (name, most, least)))
        .collect();
    if all.is_empty() {
        return String::new();
    }
    let rate = |rate: f64| {
        if rate < 1e-6 { "none".into() } else { format!("{} mrad/s", format_two_digits(rate)) }
    };
    let unit = page.axis.as_ref().map_or("", Axis::unit);
    let name = page.axis.as_ref().map_or("", |axis| axis.name.as_str());
    let parts = all.iter().map(|(title, most, least)| {
        match (least.1, most.0 - least.0 > 0.05 * most.0 && most.0 >= 1e-6) {
            (Some(x), true) => {
                format!("{} with {title} (least, {}, at {x}{unit})", rate(most.0), rate(least.0))
            }
            _ => format!("{} with {title}", rate(most.0)),
        }
    });
    let along = if name.is_empty() { String::new() } else { format!(", over {name}") };
    let parts = shorten_list(parts.collect(), 4);
    finished(&[format!("Largest rate that the manoeuvre leaves{along}: {}", parts.join("; "))])
}

/// Describes for each model in how many runs the slosh was rotary, and which of these runs has the smallest
/// torque. Returns an empty text if no model can leave its plane.
fn rotation(page: &Page) -> String {
    let count = |model: &str| {
        let runs = page.groups.iter().filter(|g| g.model == model).flat_map(|g| &g.runs);
        let rotary = runs.clone().filter(|run| run.rotary.is_some_and(|rotary| rotary.time > 0.0));
        let first =
            rotary.clone().min_by(|a, b| torque_amplitude(a).total_cmp(&torque_amplitude(b)));
        let which = first.map(|run| match (&run.case.listed, &*run.case.torque) {
            (None, Torque::Profile(profile)) => {
                let at = profile.frequency().map(|f| format!(" at {f} Hz"));
                format!("smallest torque {} N·m{}", torque_amplitude(run), at.unwrap_or_default())
            }
            (name, _) => format!("run {}", name.as_deref().unwrap_or(&run.case.name)),
        });
        Swirling { model: model.into(), runs: runs.count(), rotary: rotary.count(), which }
    };
    let models = distinct(page.groups.iter().map(|group| group.model));
    let planar = [SloshModel::Frozen, SloshModel::Linear, SloshModel::Planar].map(|m| m.name());
    let models = models.into_iter().filter(|model| !planar.contains(model));
    swirling(&models.map(count).collect::<Vec<_>>())
}

struct Swirling {
    model: String,
    runs: usize,
    rotary: usize,
    which: Option<String>,
}

fn swirling(models: &[Swirling]) -> String {
    let part = |one: &Swirling| match &one.which {
        Some(which) => {
            format!("in {} of {} runs with {} ({which})", one.rotary, one.runs, one.model)
        }
        None => format!("in none of {} runs with {}", one.runs, one.model),
    };
    match models {
        [] => String::new(),
        all => finished(&[format!(
            "Rotary slosh {}",
            all.iter().map(part).collect::<Vec<_>>().join(", ")
        )]),
    }
}

fn largest_angle(page: &Page) -> String {
    let part = |model: &str| {
        let runs = page.groups.iter().filter(|g| g.model == model).flat_map(|g| &g.runs);
        let most = |angle: fn(&Outcome) -> f64| {
            runs.clone().map(|run| angle(run).to_degrees()).fold(0.0, f64::max)
        };
        let tangential = most(|run| run.totals.peak_slosh_angle);
        let radial = most(|run| run.totals.peak_radial_angle);
        let across = match radial > 0.1 * tangential {
            true => format!(", out of its plane {}°", format_two_digits(radial)),
            false => String::new(),
        };
        format!("{}° with {model}{across}", format_two_digits(tangential))
    };
    let models = distinct(page.groups.iter().map(|group| group.model));
    let parts: Vec<String> = models.into_iter().map(part).collect();
    finished(&[format!("Largest slosh angle: {}", parts.join("; "))])
}

fn largest_angle_of_other_fmus(results: &Results) -> String {
    let angles = results.unanalysed.iter().filter_map(|run| {
        let (angle, signal) = run.largest_angle.as_ref()?;
        Some((*angle, signal.as_str(), run.case.name.as_str()))
    });
    match angles.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((angle, signal, run)) if angle > 0.0 => finished(&[format!(
            "Largest slosh angle: {}° ({signal}, run {run})",
            format_two_digits(angle.to_degrees())
        )]),
        _ => String::new(),
    }
}

/// Returns the first `most` parts of a list, and instead of the others their number ("3 more
/// in the results table").
fn shorten_list(mut parts: Vec<String>, most: usize) -> Vec<String> {
    let further = parts.len().saturating_sub(most);
    if further > 0 {
        parts.truncate(most);
        parts.push(format!("{further} more in the results table"));
    }
    parts
}

fn format_two_digits(value: f64) -> String {
    let rounded = experiments::rounding::significant(value, 2);
    match rounded.abs() {
        size if size >= 10.0 || size == 0.0 => format!("{rounded:.0}"),
        size => format!("{rounded:.*}", (1.0 - size.log10().floor()).clamp(0.0, 9.0) as usize),
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

fn finished(sentences: &[String]) -> String {
    sentences.iter().map(|s| format!("{s}.")).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::{
        Point, Series, Swirling, describe_responses, describe_single_runs, format_two_digits,
        swirling,
    };

    /// Returns a series whose exact antiresonances and resonances are at 2 and 3 Hz. Each point is given as
    /// its position on the axis, antiresonance, resonance, and true for rotary slosh.
    fn series(model: &str, plant: &str, points: &[(f64, f64, f64, bool)]) -> Series {
        let known = |f: f64| (f > 0.0).then_some(f);
        let point = |&(x, a, r, swirls): &(f64, f64, f64, bool)| Point {
            x,
            antiresonance: known(a),
            resonance: known(r),
            exact: [Some(2.0), Some(3.0)],
            swirls,
        };
        Series {
            model: model.into(),
            plant: plant.into(),
            points: points.iter().map(point).collect(),
        }
    }

    const TORQUE: &str = "torque amplitude";

    #[test]
    fn the_report_states_where_rotary_slosh_begins_and_up_to_where_the_linear_model_holds() {
        let all = [
            series("linear", "5 cm fill", &[(50.0, 2.0, 3.0, false), (100.0, 2.0, 3.0, false)]),
            series("spherical", "5 cm fill", &[(50.0, 2.01, 2.97, false), (100.0, 2.0, 3.4, true)]),
            series("linear", "10 cm fill", &[(50.0, 2.0, 3.0, false), (100.0, 2.0, 3.0, false)]),
            series("spherical", "10 cm fill", &[(50.0, 2.0, 3.2, true), (100.0, 2.0, 3.5, true)]),
        ];
        assert_eq!(
            describe_responses(&all, TORQUE, " mN·m"),
            "At 100 mN·m (5 cm fill) and from 50 mN·m on (10 cm fill) the liquid swirls and the resonance \
             moves up to 3.50 Hz; below, the linear model holds within 30 mHz (1.0\u{a0}%) for antiresonance and resonance."
        );
    }

    #[test]
    fn if_the_first_run_is_rotary_the_report_says_nothing_about_smaller_torques() {
        let all = [series("spherical", "", &[(50.0, 2.0, 2.9, true), (100.0, 0.0, 0.0, true)])];
        assert_eq!(
            describe_responses(&all, TORQUE, " mN·m"),
            "From 50 mN·m on the liquid swirls and the resonance moves down to 2.90 Hz."
        );
    }

    #[test]
    fn the_report_states_both_torques_between_which_slosh_is_rotary() {
        let points = [
            (1.0, 2.0, 3.0, false),
            (2.0, 2.0, 3.0, true),
            (3.0, 2.0, 3.0, true),
            (4.0, 2.0, 3.0, false),
        ];
        let says = describe_responses(&[series("spherical", "", &points)], TORQUE, " mN·m");
        assert_eq!(
            says,
            "Between 2 and 3 mN·m the liquid swirls; below, the exact linear response holds within 0 mHz (0\u{a0}%) \
             for antiresonance and resonance."
        );
    }

    #[test]
    fn without_rotary_slosh_and_linear_runs_the_report_compares_with_the_exact_response() {
        let all =
            [series("spherical", "", &[(50.0, 2.0, 3.0, false), (100.0, 2.002, 2.994, false)])];
        assert_eq!(
            describe_responses(&all, TORQUE, " mN·m"),
            "No run leaves its plane (no rotary slosh): the exact linear response holds within 6.0 mHz (0.20\u{a0}%) for \
             antiresonance and resonance, from 50 to 100 mN·m."
        );
        let planar =
            [series("planar", "", &[(50.0, 2.0, 3.0, false), (100.0, 2.002, 2.994, false)])];
        assert!(
            describe_responses(&planar, TORQUE, " mN·m")
                .starts_with("The exact linear response holds")
        );
    }

    #[test]
    fn the_report_states_whether_one_linear_model_fits_all_torques() {
        let stays = [series("linear", "", &[(50.0, 2.0, 3.0, false), (100.0, 2.0, 3.002, false)])];
        assert_eq!(
            describe_responses(&stays, TORQUE, " mN·m"),
            "The antiresonance stays within 0 mHz of 2.000 Hz, the resonance stays within 1.0 mHz of 3.001 Hz \
             (torque amplitude from 50 to 100 mN·m)."
        );
        let moves = [series("linear", "", &[(111.0, 2.4, 2.9, false), (220.0, 1.7, 2.2, false)])];
        assert_eq!(
            describe_responses(&moves, "tank.d", " mm"),
            "The antiresonance moves from 2.400 to 1.700 Hz, the resonance moves from 2.900 to 2.200 Hz \
             (tank.d from 111 to 220 mm)."
        );
    }

    #[test]
    fn runs_without_a_valid_response_give_no_statement() {
        let none = [series("linear", "", &[(1.0, 0.0, 0.0, false), (2.0, 0.0, 0.0, false)])];
        assert_eq!(describe_responses(&none, TORQUE, ""), "");
        assert_eq!(describe_responses(&[series("spherical", "", &[])], TORQUE, ""), "");
        let alone = describe_single_runs(&none);
        assert!(alone.starts_with("No antiresonance and resonance that can be trusted"), "{alone}");
    }

    #[test]
    fn the_report_counts_for_each_model_the_dwells_with_rotary_slosh() {
        let counted = |model: &str, rotary: usize, which: Option<&str>| Swirling {
            model: model.into(),
            runs: 6,
            rotary,
            which: which.map(String::from),
        };
        let all = [
            counted("spherical", 4, Some("smallest torque 0.0625 N·m at 2.4 Hz")),
            counted("liquid", 0, None),
        ];
        assert_eq!(
            swirling(&all),
            "Rotary slosh in 4 of 6 runs with spherical (smallest torque 0.0625 N·m at 2.4 Hz), in none of 6 runs with liquid."
        );
        assert_eq!(swirling(&[]), "");
    }

    #[test]
    fn numbers_in_sentences_have_two_significant_digits() {
        let formatted = [0.0, 0.0123, 1.0, 1.24, 12.4, 124.0].map(format_two_digits);
        assert_eq!(formatted, ["0", "0.012", "1.0", "1.2", "12", "120"]);
    }
}
