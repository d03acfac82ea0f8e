//! Chapters of the report on a day at the bench that do not come from sweeps: Bond number, friction,
//! preferential direction, gyro.

use std::f64::consts::{PI, TAU};

use anyhow::{Context, Result};
use experiments::plan::Recorded;
use experiments::scaling::{OXYGEN, WATER};
use host::fmu::Fmu;
use identify::bench::braking::{Braking, LEAST_STRETCHES};
use identify::bench::identification::Identification;
use identify::bench::nominal;
use identify::bench::options::Options;
use identify::estimate::{Estimated, prose};
use identify::input::reading::{self, Source};
use identify::input::recording::Recording;
use identify::methods::friction as runs;
use names::hubslosh::{friction, hub, tank};
use report::campaign::{Chapter, Illustration};
use report::svg::{self, Axis, Chart, Series, Style};

use super::super::gyro::{analyse_recording, noise_rows};
use super::{Day, Kind};
use crate::terminal;

/// Friction parameters and hub inertia of Table 5.5 in Rubaga's thesis, in SI units, under their
/// names in the FMU.
const THESIS: [(&str, f64); 5] = [
    (friction::B, 0.03793),
    (friction::C, 0.003498),
    (friction::D, 0.002423),
    (friction::OMEGA_S, 0.08581),
    (hub::I, 0.322414),
];
/// Radius of the oxygen tank of the upper stage Centaur, m (section 7.2.1 of Rubaga's thesis).
const CENTAUR: f64 = 2.0425;
const GRAVITY: f64 = 9.81;
const POINTS: usize = 1500;
/// Largest rate in the report's figure of the friction near rest, as a multiple of the Stribeck
/// speed.
const NEAR: f64 = 5.0;

/// Computes the chapters of the report on a bench day, and the fit of friction and inertia if there
/// are recordings for it. A message for each recording that cannot be used is added to `problems`.
/// The fitted parameters of hub and bearing are added to `found`, as settings for the simulation of
/// the sweeps.
pub fn chapters(
    day: &Day,
    fmu: &Fmu,
    problems: &mut Vec<String>,
    found: &mut Vec<(String, String)>,
) -> Result<(Vec<Chapter>, Option<Identification>)> {
    let mut chapters = vec![bond_number(day, fmu)?];
    let friction = bench_recordings(day, Kind::Friction, problems);
    let decays = bench_recordings(day, Kind::Decay, problems);
    let has_friction = !friction.is_empty();
    let all: Vec<Recording> = friction.into_iter().chain(decays).collect();
    let mut settings = nominal::with_damping(day.settings.clone());
    // The tank is empty in friction runs and free decays.
    settings.extend(runs::empty());
    let options = Options {
        settings,
        tolerances: day.tolerances,
        gyro_scale: day.manifest.gyro_scale,
        ..Options::default()
    };
    let fitted = match all.is_empty() {
        true => None,
        false => match runs::identify(fmu, &all, &options, &mut |_| {}) {
            Ok(fitted) => Some(fitted),
            Err(error) => {
                problems.push(format!("friction runs and decays: {error:#}"));
                None
            }
        },
    };
    let usable = fitted.as_ref().filter(|fitted| fitted.fits == Some(true));
    if let (Some(fitted), true) = (usable, has_friction) {
        found.extend(fitted.parameters.iter().map(|(name, p)| (name.clone(), p.value.to_string())));
    }
    chapters.push(match &fitted {
        Some(fitted) => bearing(fitted, usable.is_some() && has_friction),
        None => missing_chapter("Friction and inertia (thesis 5.2)", Kind::Friction, problems),
    });
    let braking = fitted.as_ref().map_or(&[][..], |fitted| &fitted.details.braking);
    chapters.push(match braking {
        [ahead, back] => {
            let fitted = fitted.as_ref();
            let asymmetry = fitted.and_then(|fitted| fitted.parameters.get(friction::ASYMMETRY));
            preferential_direction(ahead, back, asymmetry)
        }
        _ => missing_chapter("Preferential direction (thesis 5.4)", Kind::Decay, problems),
    });
    chapters.push(gyro(day, problems));
    Ok((chapters, fitted))
}

fn missing_chapter(title: &str, kind: Kind, problems: &[String]) -> Chapter {
    let (word, needs) = match kind {
        Kind::Friction => ("friction", "ramps, steps and sweeps of the torque with the tank empty"),
        Kind::Decay => (
            "decay",
            "a push forwards and one backwards with the tank empty, each with its free decay and the encoder's angle (theta)",
        ),
        Kind::Rest => {
            ("rest", "recordings of the gyro while the hub stands still, for an hour or more")
        }
        Kind::Sweep => ("sweep", "sine sweeps"),
    };
    let why = if problems.is_empty() {
        ""
    } else {
        " The messages of the command say which recordings could not be used."
    };
    Chapter {
        title: title.into(),
        text: vec![format!(
            "No usable recordings with kind = \"{word}\" in day.toml. Recordings of this kind are {needs}.{why}"
        )],
        ..Chapter::default()
    }
}

/// Reads the torque and the rate of all recordings of one kind. A recording that cannot be read is
/// left out, and a message is added to `problems`.
fn bench_recordings(day: &Day, kind: Kind, problems: &mut Vec<String>) -> Vec<Recording> {
    let mut all = Vec::new();
    for item in day.items_of_kind(kind) {
        let source = Source { columns: item.recorded.columns.clone(), trim: None };
        match reading::read(&item.recorded.path, &source, f64::INFINITY, &mut |line| {
            terminal::note(line)
        }) {
            Ok(recordings) => all.extend(recordings),
            Err(error) => problems.push(format!("{error:#}")),
        }
    }
    all
}

fn chart(title: &str, x: &str, y: &str, series: Vec<Series>) -> Chart {
    let points = || series.iter().flat_map(|s| &s.points);
    let x = Axis::linear(x, points().map(|p| p.0), 0.0, 8);
    let y = Axis::linear(y, points().map(|p| p.1), 0.0, 6);
    Chart::new(title, x, y, series)
}

fn series(title: &str, style: Style, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
    svg::series(points.into_iter().collect(), "", style, title)
}

fn illustration(chart: Chart, thesis: &'static str, caption: impl Into<String>) -> Illustration {
    Illustration { chart, thesis, caption: caption.into(), equal: false }
}

/// Returns the value of the real parameter `name` in SI units: from day.toml if it sets the
/// parameter, otherwise the start value of the FMU.
fn value(day: &Day, fmu: &Fmu, name: &str) -> Result<f64> {
    let set = day.settings.iter().find(|(other, _)| other == name).map(|(_, value)| value.clone());
    let start = fmu.description().variable(name)?.attributes().start.clone();
    let text = set.or(start).with_context(|| format!("{name} has no value"))?;
    text.parse().with_context(|| format!("{name} = {text}: a number in SI units is needed"))
}

fn bond_number(day: &Day, fmu: &Fmu) -> Result<Chapter> {
    let radius = value(day, fmu, tank::D)? / 2.0;
    let bond = |radius: f64| WATER.bond(GRAVITY, radius);
    let own = bond(radius);
    let diameters = (1..=50).map(|k| f64::from(k) * radius / 20.0);
    let against = chart(
        "Bond number against the tank's diameter",
        "diameter / mm",
        "Bond number",
        vec![
            series("water at 25 °C", Style::Line, diameters.map(|r| (2e3 * r, bond(r)))),
            series("this tank", Style::Dots, [(2e3 * radius, own)]),
        ],
    );
    let acceleration = |radius: f64| OXYGEN.acceleration(own, radius);
    let radii = || (1..=100).map(|k| 0.05 * f64::from(k));
    let space = chart(
        "Acceleration of an oxygen tank with this tank's Bond number",
        "tank radius / m",
        "acceleration / (m/s²)",
        vec![
            series("liquid oxygen at −200 °C", Style::Line, radii().map(|r| (r, acceleration(r)))),
            series("Centaur's radius", Style::Dots, [(CENTAUR, acceleration(CENTAUR))]),
        ],
    );
    let space = Chart { y: Axis::decades(&space.y.label, radii().map(acceleration)), ..space };
    Ok(Chapter {
        title: "Bond number (thesis 5.1 and 7.2)".into(),
        text: vec![format!(
            "The tank has the Bond number {own:.1}: ρ g R²/σ with R = {:.1} mm, ρ = 997 kg/m³, σ = 0.072 N/m.",
            1e3 * radius
        )],
        illustrations: vec![
            illustration(against, "5.6", "The Bond number grows with the square of the diameter."),
            illustration(
                space,
                "7.17",
                format!(
                    "An oxygen tank as wide as Centaur's has this Bond number at {:.5} m/s².",
                    acceleration(CENTAUR)
                ),
            ),
        ],
        ..Chapter::default()
    })
}

/// Keeps every n-th of `points`, at most [`POINTS`] in all, because a figure with all samples of a
/// recording would be slow to draw.
fn thin_out(points: &[(f64, f64)]) -> impl Iterator<Item = (f64, f64)> + '_ {
    points.iter().copied().step_by(points.len().div_ceil(POINTS).max(1))
}

fn bearing(fitted: &Identification, is_used: bool) -> Chapter {
    let number = |name: &str| fitted.parameters.get(name).map_or(0.0, |p| p.value);
    let [b, c, d, speed, asymmetry] =
        [friction::B, friction::C, friction::D, friction::OMEGA_S, friction::ASYMMETRY].map(number);
    let points = &fitted.details.friction_points;
    let curve = |w: f64| {
        let sign = w.signum();
        b * w + sign * (1.0 + asymmetry * sign) * (c + d * (-(w / speed).powi(2)).exp())
    };
    let most = points.iter().fold(0.0_f64, |most, p| most.max(p.rate.abs()));
    let friction_chart = |title: &str, most: f64| {
        let rates = (-200..=200).map(|k| most * f64::from(k) / 200.0);
        // The friction law jumps at zero; NaN makes a gap between its two branches in the figure.
        let law = rates.map(|w| (w, if w == 0.0 { f64::NAN } else { 1e3 * curve(w) }));
        let within = points.iter().filter(|p| p.rate.abs() <= most);
        let measured = within.map(|p| (p.rate, 1e3 * p.torque));
        chart(
            title,
            "rate / (rad/s)",
            "friction torque / mN·m",
            vec![
                series("measured", Style::Cloud, measured),
                series("fitted law", Style::Line, law),
            ],
        )
    };
    let whole = friction_chart("Friction torque against the rate", most);
    let near = friction_chart("Friction torque near zero rate", most.min(NEAR * speed));
    let head = ["parameter", "value", "95 % interval", "noise alone", "unit", "Table 5.5"];
    let head = head.map(String::from).to_vec();
    let row = |(name, p): (&String, &Estimated)| {
        let thesis = THESIS.iter().find(|(other, _)| other == name);
        let [low, high] = p.interval;
        vec![
            name.clone(),
            format!("{:.4e}", p.value),
            format!("{low:.4e} to {high:.4e}"),
            format!("± {:.1e}", 1.96 * p.std_noise),
            prose(&p.unit),
            thesis.map_or(String::new(), |(_, value)| format!("{value}")),
        ]
    };
    let rows = fitted.parameters.iter().chain(&fitted.measurement).map(row);
    let mut text = fitted.verdict.clone();
    text.push(match is_used {
        true => "The models below use these parameters, except those that day.toml sets.".into(),
        false => "The models below do not use these parameters: they have the FMU's values, or those of day.toml.".to_string(),
    });
    Chapter {
        title: "Friction and inertia (thesis 5.2)".into(),
        text,
        table: [head].into_iter().chain(rows).collect(),
        illustrations: vec![
            illustration(
                whole,
                "5.8 and 5.9",
                "Torque less inertia times acceleration, averaged over rows of similar rate, and the law with the parameters of the table.",
            ),
            illustration(
                near,
                "5.8",
                "The friction torque of a slow hub: dry friction is largest when the hub begins to slip.",
            ),
        ],
    }
}

fn preferential_direction(
    ahead: &Braking,
    back: &Braking,
    asymmetry: Option<&Estimated>,
) -> Chapter {
    let wrapped = |angle: f64| (angle + PI).rem_euclid(TAU) - PI;
    let degrees = |points: &[(f64, f64)], sign: f64| -> Vec<(f64, f64)> {
        thin_out(points).map(|(angle, a)| (wrapped(angle).to_degrees(), sign * a)).collect()
    };
    let angles = || (-90..=90).map(|k| 2.0 * f64::from(k));
    let ways = [("counter-clockwise", ahead, -1.0), ("clockwise", back, 1.0)];
    let fit = |(_, of, sign): (&str, &Braking, f64)| -> Vec<(f64, f64)> {
        angles().map(|angle| (angle, sign * of.at(angle.to_radians()))).collect()
    };
    // Each band is a simultaneous confidence band of the whole curve. If there are too few decays,
    // there is no band.
    let bands: Option<Vec<Vec<f64>>> = ways
        .iter()
        .map(|(_, of, _)| angles().map(|angle| of.half_width(angle.to_radians())).collect())
        .collect();
    let (x, y) = ("angle / deg", "deceleration / (rad/s²)");
    let clouds = ways.map(|(name, of, sign)| series(name, Style::Cloud, degrees(&of.points, sign)));
    let scattered = |lines: Vec<Series>| {
        let all = clouds.iter().cloned().chain(lines).collect();
        chart("Deceleration in free decay against the angle", x, y, all)
    };
    let (shown, illustrations) = match bands {
        None => {
            let text = format!(
                "The decays have {} and {} parts of a revolution (needed for an interval: {LEAST_STRETCHES} in each direction), which \
                 cannot tell friction that depends on the angle from scatter. Figures 5.11 and 5.12 of the thesis need more decays.",
                ahead.stretches, back.stretches
            );
            let figure = illustration(
                scattered(Vec::new()),
                "5.10",
                "One point for each row without torque.",
            );
            (text, vec![figure])
        }
        Some(bands) => {
            let fits = ways.map(fit);
            let [of_ahead, of_back] = &fits;
            // The fits of the two directions are independent, so that the squares of
            // their half-widths add up.
            let edges = |sign: f64| -> Vec<(f64, f64)> {
                let halves = bands[0].iter().zip(&bands[1]).map(|(a, b)| a.hypot(*b));
                let both = of_ahead.iter().zip(of_back).zip(halves);
                both.map(|((a, b), half)| (a.0, a.1 - b.1 + sign * half)).collect()
            };
            let [lower, difference, upper] = [-1.0, 0.0, 1.0].map(edges);
            let beyond = lower.iter().zip(&upper).filter(|(l, u)| l.1 > 0.0 || u.1 < 0.0).count();
            let text = match beyond {
                0 => "The 95 % interval (dashed) of the difference of the directions contains 0 at every angle: the curves of \
                      these figures show scatter, not friction that depends on the angle or the direction."
                    .to_string(),
                _ => format!(
                    "The 95 % interval (dashed) of the difference of the directions does not contain 0 over {:.0} % of the revolution.",
                    100.0 * beyond as f64 / lower.len() as f64
                ),
            };
            let round = |points: Vec<(f64, f64)>| {
                points.into_iter().map(|(angle, a)| {
                    let (sin, cos) = angle.to_radians().sin_cos();
                    (a * cos, a * sin)
                })
            };
            let names = ways.map(|(name, ..)| name);
            let mut polar = Vec::new();
            for ((name, fit), band) in names.iter().zip(&fits).zip(&bands) {
                polar.push(series(name, Style::Line, round(fit.clone())));
                for sign in [-1.0, 1.0] {
                    let edge =
                        fit.iter().zip(band).map(|((angle, a), half)| (*angle, a + sign * half));
                    let which = if sign < 0.0 { "lower" } else { "upper" };
                    let name = format!("{name}, 95 % band, {which} end");
                    polar.push(series(&name, Style::Dashed, round(edge.collect())));
                }
            }
            let lines = names.iter().zip(&fits).map(|(name, fit)| {
                series(&format!("{name}, fitted"), Style::Line, fit.iter().copied())
            });
            let figures = vec![
                illustration(
                    scattered(lines.collect()),
                    "5.10",
                    "One point for each row without torque, and the fit with two harmonics of the angle.",
                ),
                illustration(
                    chart(
                        "Directional asymmetry against the angle",
                        x,
                        "counter-clockwise less clockwise / (rad/s²)",
                        vec![
                            series("difference of the fits", Style::Line, difference),
                            series("95 % interval, lower end", Style::Dashed, lower),
                            series("95 % interval, upper end", Style::Dashed, upper),
                        ],
                    ),
                    "5.11",
                    "Positive where the fit has stronger deceleration counter-clockwise.",
                ),
                Illustration {
                    equal: true,
                    ..illustration(
                        chart(
                            "Deceleration around the revolution",
                            "deceleration · cos θ / (rad/s²)",
                            "deceleration · sin θ / (rad/s²)",
                            polar,
                        ),
                        "5.12",
                        "Distance from the origin: the fitted deceleration at the angle θ, with the 95 % band of the whole curve.",
                    )
                },
            ];
            (text, figures)
        }
    };
    let verdict = match asymmetry {
        Some(p) if p.determined => {
            let [low, high] = p.interval.map(|end| 100.0 * end);
            // digits after the decimal point, so that the width of the interval has two digits
            let places = (1.0 - (high - low).log10().floor()).clamp(1.0, 6.0) as usize;
            let size = format!(
                "Counter-clockwise dry friction is {:+.places$} % from the mean of both directions (95 %: {low:.places$} to \
                 {high:.places$} %)",
                100.0 * p.value
            );
            match () {
                () if low > 0.0 => format!("{size}: the hub turns more easily clockwise."),
                () if high < 0.0 => format!("{size}: the hub turns more easily counter-clockwise."),
                () => format!("{size}: no preferential direction is seen."),
            }
        }
        _ => "The recordings do not determine a preferential direction.".to_string(),
    };
    Chapter {
        title: "Preferential direction (thesis 5.4)".into(),
        text: vec![
            verdict,
            format!(
                "The figures show deceleration against the angle at {:.2} rad/s, the mean speed of the decays. Its dependence on the \
                 speed is removed by a parabola; the fits of the thesis do not remove it.",
                ahead.speed
            ),
            shown,
        ],
        illustrations,
        ..Chapter::default()
    }
}

fn gyro(day: &Day, problems: &mut Vec<String>) -> Chapter {
    let title = "Gyro at rest (thesis 5.5)";
    let mut found = Vec::new();
    for item in day.items_of_kind(Kind::Rest) {
        let Recorded { path, columns } = &item.recorded;
        match analyse_recording(path, columns, None) {
            Ok(rest) => found.push((path.display().to_string(), rest)),
            Err(error) => problems.push(format!("{error:#}")),
        }
    }
    if found.is_empty() {
        return missing_chapter(title, Kind::Rest, problems);
    }
    let mut chapter = Chapter { title: title.into(), ..Chapter::default() };
    for (name, rest) in &found {
        let noise = match &rest.noise {
            Some(fit) => {
                let rows = noise_rows(fit).into_iter();
                rows.map(|(name, value)| format!("{name}: {value}")).collect::<Vec<_>>().join("; ")
            }
            None => "its Allan deviation shows no noise".into(),
        };
        chapter.text.push(format!(
            "{name}: bias {:.4e} rad/s, standard deviation of a sample {:.3e} rad/s, {noise} (thesis: N = 5.75e-5, B = 5.21e-5). \
             {:.1} % of the autocorrelations are outside the 95 % interval of white noise.",
            rest.mean,
            rest.deviation,
            100.0 * rest.outside()
        ));
        for (file, chart) in report::gyro::rest_charts(rest) {
            let (thesis, caption) = match file {
                "allan.svg" => (
                    "5.19",
                    "The white noise has the slope −1/2; the bias instability is the level part.",
                ),
                "quantiles.svg" => ("5.14", "Normal noise lies on the dashed line."),
                "histogram.svg" => ("5.15", "Normal noise has the dashed density."),
                "kolmogorov.svg" => (
                    "5.14 and 5.15",
                    "Quantisation by itself gives the readings a distance from the normal distribution; between their levels it has no effect.",
                ),
                "autocorrelation.svg" => {
                    ("5.18", "White noise stays within the frame 95 % of the time.")
                }
                _ => ("5.16 and 5.17", "A gyro with steady noise stays within the frames."),
            };
            chapter.illustrations.push(illustration(chart, thesis, caption));
        }
    }
    chapter
}
