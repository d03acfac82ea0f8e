//! The thesis's statements, in its order of sections, each with its rule.

use std::f64::consts::PI;

use analysis::statistics::mean;
use experiments::campaign::Outcome;
use experiments::scaling::{BENCH, OXYGEN, ROUND_WATER, WATER};

use super::super::page::{Group, torque_of};
use super::{Judge, Shown, Statement, Who};

/// The smallest and the largest torque of the thesis, N·m.
const LEAST: f64 = 0.0125;
const MOST: f64 = 0.25;

/// A statement without remarks.
const PLAIN: Statement = Statement {
    section: "",
    who: Who::Bench,
    says: "",
    rule: "",
    judge: Judge::Not,
    why: "",
    despite: "",
};

/// The run at a torque, N·m.
fn at<'a>(group: &'a Group, torque: f64) -> Option<&'a Outcome> {
    group.runs.iter().copied().find(|run| (torque_of(run) - torque).abs() < 1e-9)
}

/// A figure of each run from a torque on, N·m.
fn from(group: &Group, torque: f64, of: fn(&Outcome) -> Option<f64>) -> Option<Vec<f64>> {
    let runs = group.runs.iter().filter(|run| torque_of(run) > torque - 1e-9);
    let values: Vec<f64> = runs.map(|run| of(run)).collect::<Option<_>>()?;
    (values.len() > 1).then_some(values)
}

fn spread(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::MIN, f64::max)
        - values.iter().copied().fold(f64::MAX, f64::min)
}

/// Means of a figure over the smaller and over the larger torques, a third of the runs each.
fn thirds(group: &Group, of: fn(&Outcome) -> Option<f64>) -> Option<(f64, f64)> {
    let values = from(group, LEAST, of)?;
    let third = values.len().div_ceil(3);
    Some((mean(&values[..third]), mean(&values[values.len() - third..])))
}

/// A figure at the smallest torque, its largest value, and at the largest torque.
fn ends(group: &Group, of: fn(&Outcome) -> Option<f64>) -> Option<(f64, f64, f64)> {
    let values = from(group, LEAST, of)?;
    let (low, high) = (of(at(group, LEAST)?)?, of(at(group, MOST)?)?);
    Some((low, values.into_iter().fold(f64::MIN, f64::max), high))
}

fn fit_frequency(run: &Outcome) -> Option<f64> {
    Some(run.fit()?.fit_frequency)
}

fn fit_time(run: &Outcome) -> Option<f64> {
    Some(run.fit()?.fit_time)
}

fn coherence(run: &Outcome) -> Option<f64> {
    run.fit()?.coherence
}

fn notch(run: &Outcome) -> Option<f64> {
    run.spa_features().notch_db
}

/// Mean signal-to-noise ratio over the band, dB.
fn snr(run: &Outcome) -> Option<f64> {
    let values: Vec<f64> = run
        .record
        .as_ref()?
        .snr_over_band
        .iter()
        .map(|(_, v)| *v)
        .filter(|v| v.is_finite())
        .collect();
    (!values.is_empty()).then(|| mean(&values))
}

/// The smallest torque with rotary slosh, N·m.
fn onset(group: &Group) -> Option<f64> {
    let turns = |run: &&&Outcome| run.rotary.is_some_and(|rotary| rotary.from.is_some());
    group.runs.iter().find(turns).map(|run| torque_of(run))
}

fn delta_f(run: &Outcome) -> Option<f64> {
    run.spa_features().delta_f()
}

fn leakage(run: &Outcome) -> Option<f64> {
    Some(run.off_axis()?.leakage)
}

/// Largest fall from a value to a later one.
fn worst_fall(values: &[f64]) -> f64 {
    let (mut most, mut fall) = (f64::MIN, 0.0_f64);
    for value in values {
        most = most.max(*value);
        fall = fall.max(most - value);
    }
    fall
}

/// The largest step of a figure between neighbouring torques, and the torque (N·m) at which it ends.
fn largest_step(group: &Group, of: fn(&Outcome) -> Option<f64>) -> Option<(f64, f64)> {
    let values = from(group, LEAST, of)?;
    let steps = values.windows(2).zip(&group.runs[1..]);
    steps
        .map(|(pair, run)| (torque_of(run), pair[1] - pair[0]))
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

/// Number of times a curve turns back by more than `least`.
fn swings(curve: &[f64], least: f64) -> usize {
    let (mut count, mut up, mut extreme) = (0, true, f64::MIN);
    for value in curve {
        if up && *value > extreme || !up && *value < extreme {
            extreme = *value;
        } else if (value - extreme).abs() > least {
            (up, extreme, count) = (!up, *value, count + 1);
        }
    }
    count
}

/// A figure of the thesis and ours, which must agree to a relative tolerance.
fn number(printed: f64, ours: f64, tolerance: f64) -> Shown {
    let text = format!("{}; printed {printed}", experiments::rounding::significant(ours, 4));
    (text, (printed / ours - 1.0).abs() < tolerance)
}

/// The tank's radius, m.
const RADIUS: f64 = BENCH.0;

/// The rotational Bond number of eq. 7.3 for an acceleration in rad/s².
fn rotational_bond(acceleration: f64) -> f64 {
    ROUND_WATER.rotational_bond(acceleration, RADIUS, RADIUS)
}

/// Diameter of the flight tank with the same rotational Bond number at 0.005 rad/s², m.
fn equivalent_diameter(acceleration: f64) -> f64 {
    2.0 * ROUND_WATER.radius_by_cube(rotational_bond(acceleration), 5e-3)
}

/// Mean signal-to-noise ratio of a run over the band, the deviation from it, dB, and the frequency of the largest, Hz.
fn snr_shape(run: &Outcome) -> Option<(f64, f64, f64)> {
    let curve = &run.record.as_ref().filter(|_| run.has_curves())?.snr_over_band;
    let points: Vec<(f64, f64)> = curve.iter().copied().filter(|(_, v)| v.is_finite()).collect();
    let average = mean(&points.iter().map(|p| p.1).collect::<Vec<_>>());
    let square = mean(&points.iter().map(|p| (p.1 - average).powi(2)).collect::<Vec<_>>());
    let top = points.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((average, square.sqrt(), top.0))
}

/// The group with a fill, m.
fn of_fill<'a, 'g>(groups: &'a [&'a Group<'g>], depth: f64) -> Option<&'a Group<'g>> {
    let here = |group: &&&Group| group.fill.is_some_and(|fill| (fill - depth).abs() < 1e-9);
    groups.iter().find(here).copied()
}

/// Compares a figure at 10 cm with that at 5 cm, at every torque.
fn larger_in_the_deeper(groups: &[&Group], of: fn(&Outcome) -> Option<f64>) -> Option<Shown> {
    let (shallow, deep) =
        (from(of_fill(groups, 0.05)?, LEAST, of)?, from(of_fill(groups, 0.1)?, LEAST, of)?);
    let ratios: Vec<f64> = deep.iter().zip(&shallow).map(|(d, s)| d / s).collect();
    let most = ratios.iter().copied().fold(f64::MIN, f64::max);
    let least = ratios.iter().copied().fold(f64::MAX, f64::min);
    Some((format!("{least:.2} to {most:.2} times that at 5 cm"), least > 1.0))
}

pub(super) const STATEMENTS: &[Statement] = &[
    Statement {
        section: "7.1.1, fig. 7.1",
        who: Who::Bench,
        says: "With growing torque resonance and antiresonance move apart: Δf grows.",
        rule: "Δf (spa) is at no torque more than 5 mHz below that of a smaller torque, and grows by more than 20 mHz from 0.0125 to 0.25 N·m",
        judge: Judge::Fill(|group| {
            let all = from(group, LEAST, delta_f)?;
            let (fall, growth) = (worst_fall(&all), all[all.len() - 1] - all[0]);
            let text = format!("{:+.0} mHz, falls by {:.0} mHz before", growth * 1e3, fall * 1e3);
            Some((text, fall < 5e-3 && growth > 0.02))
        }),
        why: "Every nonlinear model softens first: the resonance comes down to the antiresonance until rotary slosh begins, and jumps up there.",
        ..PLAIN
    },
    Statement {
        section: "7.1.1, 8.1",
        who: Who::Bench,
        says: "Resonance and antiresonance diverge around 0.1 N·m.",
        rule: "the largest step of Δf (spa) between neighbouring torques is upwards and ends at 0.075 to 0.125 N·m",
        judge: Judge::Fill(|group| {
            let (torque, step) = largest_step(group, delta_f)?;
            let text = format!("{:+.0} mHz at {torque} N·m", step * 1e3);
            Some((text, step > 0.0 && (0.074..0.126).contains(&torque)))
        }),
        why: "The step is the onset of rotary slosh, which is late in a sweep from rest.",
        despite: "The step is the onset of rotary slosh, not a steady growth of Δf.",
    },
    Statement {
        section: "7.1.1, 8.1",
        who: Who::Bench,
        says: "Resonance and antiresonance vary noticeably with the torque.",
        rule: "each (spa) varies by more than 10 mHz over all torques",
        judge: Judge::Fill(|group| extrema(group, LEAST, |spread| spread > 0.01)),
        why: "The antiresonance is the tank's own frequency, at which slosh is small.",
        ..PLAIN
    },
    Statement {
        section: "7.1.1, fig. 7.2",
        who: Who::Synthetic,
        says: "Δf of the synthetic data changes a little at first, then is constant.",
        rule: "Δf (spa) at 0.0125 N·m differs by 1 to 10 mHz from the mean from 0.05 N·m up, where it stays within 4 mHz",
        judge: Judge::Fill(|group| {
            let later = from(group, 0.05, delta_f)?;
            let change = delta_f(at(group, LEAST)?)? - mean(&later);
            let text = format!("{:+.1} mHz, then within {:.1}", change * 1e3, spread(&later) * 1e3);
            Some((text, (1e-3..1e-2).contains(&change.abs()) && spread(&later) < 4e-3))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.1, fig. 7.2",
        who: Who::Synthetic,
        says: "Resonance and antiresonance hardly depend on the torque; Δf is constant beyond the smallest torques.",
        rule: "both (spa) stay within 4 mHz from 0.05 N·m up",
        judge: Judge::Fill(|group| extrema(group, 0.05, |spread| spread < 4e-3)),
        ..PLAIN
    },
    Statement {
        section: "7.1.1",
        who: Who::Bench,
        says: "The resonance starts higher at the smallest torques, then comes down.",
        rule: "f_res (spa) at 0.0125 lies above that at 0.05 N·m by more than 1 mHz",
        judge: Judge::Fill(softening),
        despite: "In the linear liquid dry friction causes it, in the others mostly softening; noise does not.",
        ..PLAIN
    },
    Statement {
        section: "7.1.1",
        who: Who::Synthetic,
        says: "The synthetic data's resonance, whose liquid is linear, starts higher at the smallest torques too (the thesis suspects noise; it is dry friction).",
        rule: "the same",
        judge: Judge::Fill(softening),
        ..PLAIN
    },
    Statement {
        section: "7.1.1",
        who: Who::Bench,
        says: "At moderate and large torque the bench's resonance and antiresonance stay close to those of the linear synthetic model.",
        rule: "both (spa) stay within 0.1 Hz of the exact linear ones from 0.1 N·m up",
        judge: Judge::Fill(|group| {
            let far = |of: fn(&Outcome) -> Option<f64>, exact: f64| -> Option<f64> {
                let away = from(group, 0.1, of)?.into_iter().map(|f| f - exact);
                Some(away.fold(0.0, |m: f64, d| if d.abs() > m.abs() { d } else { m }))
            };
            let resonance = far(|run| run.spa_features().f_res, group.exact[0].f_res?)?;
            let antiresonance = far(|run| run.spa_features().f_dip, group.exact[0].f_dip?)?;
            let text = format!(
                "antiresonance up to {:+.1}, resonance up to {:+.1} mHz",
                antiresonance * 1e3,
                resonance * 1e3
            );
            Some((text, resonance.abs() < 0.1 && antiresonance.abs() < 0.1))
        }),
        why: "The conical pendulum hardens too much: once in rotary slosh it follows the sweep too far up.",
        despite: "The linear liquid is compared with its own exact response.",
    },
    Statement {
        section: "7.1.1, fig. 7.1",
        who: Who::Bench,
        says: "The notch becomes shallower with torque.",
        rule: "mean notch (spa; in brackets while the sweep passes) of the larger third of the torques is smaller by more than 0.5 dB",
        judge: Judge::Fill(|group| notch_trend(group, -1.0)),
        why: "The notch of a record with a jump in it says little: spa lays the antiresonance, the jump and the ringing over each other. While the sweep passes (in brackets) it does become shallower.",
        ..PLAIN
    },
    Statement {
        section: "7.1.1, fig. 7.2",
        who: Who::Synthetic,
        says: "The synthetic notch becomes deeper with torque.",
        rule: "larger by more than 0.5 dB",
        judge: Judge::Fill(|group| notch_trend(group, 1.0)),
        why: "It does, but by less. The liquid has no part in it (errata, interpretation); dry friction has, whose share falls.",
        ..PLAIN
    },
    Statement {
        section: "7.1.1",
        who: Who::Bench,
        says: "The bench's notch is much deeper than the synthetic one, most of all at small torque.",
        rule: "at 0.0125 N·m the notch (spa) is deeper than the exact linear one by more than 3 dB",
        judge: Judge::Fill(|group| {
            let here = notch(at(group, LEAST)?)?;
            let exact = group.exact[0].notch_db?;
            Some((format!("{here:.1} (exact {exact:.1}) dB"), here - exact > 3.0))
        }),
        why: "At small torque the same friction acts on every model; the bench's bearing must have been freer than the fitted law.",
        ..PLAIN
    },
    Statement {
        section: "7.1.2, fig. 7.3",
        who: Who::Bench,
        says: "Fit in time: an inverted U over the torque, best around 0.1 N·m; even the least remains close to 60 %.",
        rule: "the best fit lies at 0.075 to 0.125 N·m and more than 5 points above both ends; the least is 50 to 70 %",
        judge: Judge::Fill(|group| {
            let (low, best, high) = ends(group, fit_time)?;
            let best_run = group.runs.iter().find(|run| fit_time(run) == Some(best))?;
            let least = from(group, LEAST, fit_time)?.into_iter().fold(f64::MAX, f64::min);
            let torque = torque_of(best_run);
            let text =
                format!("{low:.0} → {best:.0} (at {torque} N·m) → {high:.0} %; least {least:.0} %");
            let inverted = best > low + 5.0 && best > high + 5.0;
            let there = (0.074..0.126).contains(&torque) && (50.0..=70.0).contains(&least);
            Some((text, inverted && there))
        }),
        why: "From the onset of rotary slosh on, a linear model fits the nonlinear liquid less well, and bearing friction has the largest effect at the smallest torques. The best fit is where both are small.",
        ..PLAIN
    },
    Statement {
        section: "7.1.2, fig. 7.4",
        who: Who::Synthetic,
        says: "Fit in time falls with torque to some 20 %.",
        rule: "at 0.25 N·m 15 to 25 %, and below that at 0.0125 N·m",
        judge: Judge::Fill(|group| {
            let (low, _, high) = ends(group, fit_time)?;
            let there = (15.0..=25.0).contains(&high);
            Some((format!("{low:.0} → {high:.0} %"), there && high < low))
        }),
        why: "Here the fitted function gives back what it was fitted to, as a linear model must once friction matters little. The thesis has no reason for the fall either.",
        ..PLAIN
    },
    Statement {
        section: "7.1.2, fig. 7.7",
        who: Who::Bench,
        says: "Fit in frequency falls steadily with torque.",
        rule: "at no torque more than 3 points above that of a smaller torque, and at 0.25 N·m more than 20 points below the best",
        judge: Judge::Fill(|group| {
            let all = from(group, LEAST, fit_frequency)?;
            let rise = worst_fall(&all.iter().map(|fit| -fit).collect::<Vec<_>>());
            let (_, best, high) = ends(group, fit_frequency)?;
            let text = format!("{best:.0} → {high:.0} %, rises by {rise:.0}");
            Some((text, rise < 3.0 && best - high > 20.0))
        }),
        why: "It rises first, because dry friction has the largest effect at the smallest torque.",
        ..PLAIN
    },
    Statement {
        section: "7.1.2, fig. 7.7",
        who: Who::Bench,
        says: "Fit in frequency is best at the smallest torque.",
        rule: "no other torque is better by more than 1.5 points",
        judge: Judge::Fill(|group| {
            let (low, best, _) = ends(group, fit_frequency)?;
            Some((format!("{low:.0}, best {best:.0} %"), best - low < 1.5))
        }),
        why: "At 0.0125 N·m nearly half of the torque is dry friction, noise or not; three poles and two zeros can't be that. It is so in the thesis's synthetic data (next row).",
        ..PLAIN
    },
    Statement {
        section: "7.1.2, fig. 7.8",
        who: Who::Synthetic,
        says: "Fit in frequency of the synthetic data is lowest at the smallest torque, then stable.",
        rule: "lowest at 0.0125 N·m; within 5 points from 0.1 N·m up",
        judge: Judge::Fill(|group| {
            let (low, _, high) = ends(group, fit_frequency)?;
            let all = from(group, LEAST, fit_frequency)?;
            let stable = spread(&from(group, 0.1, fit_frequency)?);
            let lowest = all.iter().all(|fit| *fit >= low);
            Some((format!("{low:.0} → {high:.0} %"), lowest && stable < 5.0))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.3, fig. 7.9",
        who: Who::Bench,
        says: "Coherence of the residual with the torque rises with the torque.",
        rule: "from 0.05 to 0.25 N·m by more than 0.2",
        judge: Judge::Fill(|group| {
            let (low, high) = (coherence(at(group, 0.05)?)?, coherence(at(group, MOST)?)?);
            Some((format!("{low:.2} → {high:.2}"), high - low > 0.2))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.3, fig. 7.9",
        who: Who::Bench,
        says: "The residual coherence lies between 0.45 and 0.65 at middle and large torque.",
        rule: "the mean from 0.15 N·m up lies there",
        judge: Judge::Fill(|group| {
            let plateau = mean(&from(group, 0.15, coherence)?);
            Some((format!("{plateau:.2}"), (0.45..=0.65).contains(&plateau)))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.3, fig. 7.9",
        who: Who::Bench,
        says: "The residual coherence is low at the smallest torques and levels off above about 0.05 N·m.",
        rule: "below 0.4 at 0.0125 N·m, and above 0.4 from 0.075 N·m up",
        judge: Judge::Fill(|group| {
            let low = coherence(at(group, LEAST)?)?;
            let least = from(group, 0.075, coherence)?.into_iter().fold(f64::MAX, f64::min);
            Some((format!("{low:.2}; least {least:.2}"), low < 0.4 && least > 0.4))
        }),
        why: "Dry friction is coherent with the torque at the smallest torques; and rotary slosh sets in later here than on the bench.",
        ..PLAIN
    },
    Statement {
        section: "7.1.3, fig. 7.10",
        who: Who::Synthetic,
        says: "The residual coherence of the synthetic data starts high and falls to a plateau of 0.25 to 0.35.",
        rule: "at 0.0125 N·m more than 0.2 above the mean from 0.125 N·m up. The level depends on the length of the segments, which is 20 s here and unknown in the thesis",
        judge: Judge::Fill(|group| {
            let low = coherence(at(group, LEAST)?)?;
            let plateau = mean(&from(group, 0.125, coherence)?);
            let there = (0.25..=0.35).contains(&plateau);
            Some((format!("{low:.2} → {plateau:.2}"), low - plateau > 0.2 && there))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.3, fig. 7.11",
        who: Who::Bench,
        says: "At middle and large torque a broad region of lower coherence stands around the resonance.",
        rule: "at 0.25 N·m the mean within 0.2 Hz of the linear resonance is more than 0.1 below that elsewhere",
        judge: Judge::Fill(|group| {
            let (near, rest) = coherence_near_and_far(group, at(group, MOST)?)?;
            Some((format!("{near:.2}, elsewhere {rest:.2}"), rest - near > 0.1))
        }),
        despite: "The linear liquid has the region too: the sweep is too fast for the resonance's width.",
        ..PLAIN
    },
    Statement {
        section: "7.1.3, fig. 7.12",
        who: Who::Synthetic,
        says: "The residual coherence of the synthetic data has no region of low coherence, apart from the smallest torques.",
        rule: "at every torque from 0.05 N·m up the mean within 0.2 Hz of the linear resonance is no more than 0.1 below that elsewhere",
        judge: Judge::Fill(|group| {
            at(group, 0.05)?;
            at(group, MOST)?;
            let runs = group.runs.iter().filter(|run| torque_of(run) > 0.05 - 1e-9);
            let gaps = runs.map(|run| {
                let (near, rest) = coherence_near_and_far(group, run)?;
                Some(rest - near)
            });
            let most = gaps.collect::<Option<Vec<_>>>()?.into_iter().fold(f64::MIN, f64::max);
            Some((format!("at most {most:.2} below"), most <= 0.1))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.4, fig. 7.13",
        who: Who::Bench,
        says: "Signal-to-noise ratio is lowest at the smallest torque and soon better.",
        rule: "the band's mean is lowest at 0.0125 N·m, and 5 dB better at 0.1 N·m. Without gyro noise, only dry friction and the liquid's nonlinearity count as noise",
        judge: Judge::Fill(snr_grows),
        ..PLAIN
    },
    Statement {
        section: "7.1.4, fig. 7.14",
        who: Who::Synthetic,
        says: "The synthetic data's signal-to-noise ratio is lowest at the smallest torque and soon better.",
        rule: "the same",
        judge: Judge::Fill(snr_grows),
        ..PLAIN
    },
    Statement {
        section: "7.1.5, fig. 7.15",
        who: Who::Bench,
        says: "Leakage off the axis rises again at large torque.",
        rule: "at 0.25 N·m more than twice that of every torque up to 0.075 N·m",
        judge: Judge::Fill(|group| {
            let few = group.runs.iter().filter(|run| torque_of(run) < 0.076);
            let low = few.filter_map(|run| leakage(run)).fold(0.0, f64::max);
            let high = leakage(at(group, MOST)?)?;
            Some((format!("{low:.4} → {high:.4}"), high > 2.0 * low && high > 1e-3))
        }),
        despite: "The leakage here is the liquid's radial force over the torque; the hub cannot tilt.",
        ..PLAIN
    },
    Statement {
        section: "7.1.5, fig. 7.16",
        who: Who::Bench,
        says: "Motion across the torque's plane (leakage) occurs only near the resonance; elsewhere there is only noise.",
        rule: "at 0.25 N·m more than 90 % of its square lies within 0.3 Hz of the linear resonance",
        judge: Judge::Fill(|group| {
            let run = at(group, MOST)?;
            let resonance = group.exact[0].f_res?;
            let (mut near, mut all) = (0.0, 0.0);
            run.off_axis()?;
            let passing = run.passing.as_ref().filter(|_| run.has_curves())?;
            for (f, l) in passing.rate.response.frequency.iter().zip(&passing.leakage) {
                let square = l * l;
                all += square;
                near += if (f - resonance).abs() < 0.3 { square } else { 0.0 };
            }
            let share = if all > 0.0 { near / all } else { 0.0 };
            Some((format!("{:.0} %", 100.0 * share), share > 0.9))
        }),
        why: "The over-long rotary branch carries it upwards.",
        ..PLAIN
    },
    Statement {
        section: "7.2.2",
        who: Who::Bench,
        says: "The hub's largest acceleration at 0.25 N·m is 2.21 rad/s².",
        rule: "within 15 %: the thesis states neither the fill nor how its gyro's rate was filtered",
        judge: Judge::Fill(|group| peak_acceleration(group, MOST, 2.21)),
        why: "The largest acceleration is at resonance, where damping decides it: here that of bare walls at small amplitude. What breaking waves and splashing dissipate is not in it.",
        ..PLAIN
    },
    Statement {
        section: "7.2.2",
        who: Who::Bench,
        says: "The hub's largest acceleration at 0.0125 N·m is 0.222 rad/s².",
        rule: "within 15 %",
        judge: Judge::Fill(|group| peak_acceleration(group, LEAST, 0.222)),
        why: "At this torque the gyro's noise, differentiated, is a fifth of what the thesis reads.",
        ..PLAIN
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "Up to 0.05 N·m the slosh stays planar.",
        rule: "no rotary slosh at 0.05 N·m or below",
        judge: Judge::Fill(|group| {
            at(group, 0.05)?.rotary?;
            Some((turning_from(group), onset(group).is_none_or(|torque| torque > 0.05)))
        }),
        despite: "Linear and planar liquid cannot leave their plane, and in the others the seed of a sweep from rest is too small up to 0.1 N·m.",
        ..PLAIN
    },
    Statement {
        section: "App. A, 8.1",
        who: Who::Bench,
        says: "Rotary slosh is visible from 0.1 N·m on, weak and intermittent at 0.075.",
        rule: "rotary slosh from 0.075 or 0.1 N·m on",
        judge: Judge::Fill(|group| {
            at(group, 0.1)?.rotary?;
            let there = onset(group).is_some_and(|torque| (0.074..0.101).contains(&torque));
            Some((turning_from(group), there))
        }),
        why: "A sweep from perfect rest has no seed but the centripetal force; a dwell at resonance becomes rotary at 0.06 N·m (plan t5_near_resonance).",
        ..PLAIN
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "In every run from 0.1 N·m on with rotary slosh the motion is planar first, then rotary.",
        rule: "rotary slosh begins above the antiresonance",
        judge: Judge::Fill(|group| {
            group.runs.first()?.rotary?;
            let turning =
                group.runs.iter().filter_map(|run| Some(run.rotary?.from? - run.features().f_dip?));
            let least = turning.fold(f64::MAX, f64::min);
            let never = "no rotary slosh".to_string();
            Some(if least < f64::MAX {
                (format!("from {:.0} mHz above the antiresonance on", least * 1e3), least > 0.0)
            } else {
                (never, false)
            })
        }),
        ..PLAIN
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "Rotary slosh comes and goes at all torques from 0.1 N·m up, and breaks down into plane swinging at 0.2 N·m, 10 cm.",
        rule: "at each of these torques the slosh is rotary for less than 90 % of the time between first and last",
        judge: Judge::Fill(|group| {
            let sweep = group.sweep?;
            let share = |run: &Outcome| -> Option<f64> {
                let rotary = run.rotary?;
                let (first, last) = (sweep.time_of(rotary.from?)?, sweep.time_of(rotary.to?)?);
                Some(rotary.time / (last - first).abs())
            };
            let runs = group.runs.iter().filter(|run| torque_of(run) > 0.099);
            let shares: Vec<Option<f64>> = runs.map(|run| share(run)).collect();
            let least = shares.iter().flatten().copied().fold(f64::MAX, f64::min);
            let most = shares.iter().flatten().copied().fold(0.0, f64::max);
            if most == 0.0 {
                return Some(("no rotary slosh".into(), false));
            }
            let text = format!("{:.0} to {:.0} % of the time", 100.0 * least, 100.0 * most);
            Some((text, shares.iter().all(|share| share.is_some_and(|share| share < 0.9))))
        }),
        why: "A pendulum loses no water: no breaking waves, no splashing, and so no reason for rotary slosh to stop.",
        ..PLAIN
    },
    Statement {
        section: "5.1.4, 7.1",
        who: Who::Synthetic,
        says: "The sweep is slow enough to show the steady response.",
        rule: "while the sweep passes, the resonance at 0.25 N·m stands within 5 mHz of the exact linear one",
        judge: Judge::Fill(|group| {
            let shift = at(group, MOST)?.features().f_res? - group.exact[0].f_res?;
            Some((format!("{:+.0} mHz", shift * 1e3), shift.abs() < 5e-3))
        }),
        why: "The sweep crosses the resonance faster than slosh settles. The whole record (spa) is free of this shift.",
        ..PLAIN
    },
    Statement {
        section: "7.1, table 5.2",
        who: Who::Thesis,
        says: "At 1200 s/Hz a sweep from 1.25 to 3.5 Hz takes 45 min.",
        rule: "2.25 Hz · 1200 s/Hz in minutes, to 0.1 %",
        judge: Judge::Number(|| number(45.0, 2.25 * 1200.0 / 60.0, 1e-3)),
        ..PLAIN
    },
    Statement {
        section: "7.1.1",
        who: Who::Bench,
        says: "The bench's notch is deeper than the synthetic one at every torque.",
        rule: "the notch (spa) is deeper than the exact linear one at every torque",
        judge: Judge::Fill(|group| {
            let exact = group.exact[0].notch_db?;
            let least = from(group, LEAST, notch)?.into_iter().fold(f64::MAX, f64::min);
            Some((format!("least {least:.1} (exact {exact:.1}) dB"), least > exact))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.1, 8.1",
        who: Who::Synthetic,
        says: "The synthetic notch is monotonic in the torque.",
        rule: "the notch (spa) is at no torque more than 0.2 dB shallower than at a smaller one",
        judge: Judge::Fill(|group| {
            let fall = worst_fall(&from(group, LEAST, notch)?);
            Some((format!("falls by {fall:.1} dB"), fall < 0.2))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.1",
        who: Who::Bench,
        says: "Deviations at small torque come from measurement limits, not from the dynamics.",
        why: "Needs the same sweeps with and without gyro noise. The plans `thesis` and `thesis_models` differ so: dry friction raises the resonance by 3 to 4 mHz without noise too.",
        ..PLAIN
    },
    Statement {
        section: "7.1.2, fig. 7.4",
        who: Who::Synthetic,
        says: "Fit in time falls steadily and then levels off.",
        rule: "at no torque more than 3 points above that of a smaller torque; within 5 points from 0.2 N·m up",
        judge: Judge::Fill(|group| {
            let all = from(group, LEAST, fit_time)?;
            let rise = worst_fall(&all.iter().map(|fit| -fit).collect::<Vec<_>>());
            let level = spread(&from(group, 0.2, fit_time)?);
            let text = format!("rises by {rise:.0} points, then within {level:.0}");
            Some((text, rise < 3.0 && level < 5.0))
        }),
        why: "The fitted function gives back what it was fitted to.",
        ..PLAIN
    },
    Statement {
        section: "7.1.2, 8.1",
        who: Who::Bench,
        says: "Around 0.1 N·m the bench is most linear.",
        rule: "the smaller of the two fits is largest at 0.075 to 0.125 N·m",
        judge: Judge::Fill(|group| {
            let both = |run: &Outcome| Some(fit_time(run)?.min(fit_frequency(run)?));
            let values = from(group, LEAST, both)?;
            let best = values.iter().copied().fold(f64::MIN, f64::max);
            let run = group.runs.iter().find(|run| both(run) == Some(best))?;
            let torque = torque_of(run);
            Some((format!("{best:.0} % at {torque} N·m"), (0.074..0.126).contains(&torque)))
        }),
        why: "At 0.1 N·m the planar resonance has softened by more than its width.",
        despite: "The linear liquid is linear at every torque; only friction makes its fits differ.",
    },
    Statement {
        section: "7.1.2, figs. 7.5 and 7.6",
        who: Who::Bench,
        says: "At 0.25 N·m the frequency response has squiggles that it does not have at 0.0125 N·m (5 cm).",
        rule: "the level (spa) turns back by more than 1 dB more often at 0.25 than at 0.0125 N·m",
        judge: Judge::Fill(|group| {
            let count = |torque| -> Option<usize> {
                let run = at(group, torque).filter(|run| run.has_curves())?;
                Some(swings(&run.record.as_ref()?.spa.response.decibels(), 1.0))
            };
            let (low, high) = (count(LEAST)?, count(MOST)?);
            Some((format!("{low} → {high} turns"), high > low))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.2",
        who: Who::Bench,
        says: "The bench's best fit in frequency lies where the synthetic one is best.",
        why: "The thesis contradicts itself: its bench fits best, and its synthetic data worst, at the smallest torque (figs. 7.7 and 7.8).",
        ..PLAIN
    },
    Statement {
        section: "8.1",
        who: Who::Bench,
        says: "Fit in time, fit in frequency and residual coherence are all degraded at the smallest torques.",
        rule: "at 0.0125 N·m both fits are more than 5 points below their best, and the coherence is above its mean from 0.05 N·m up",
        judge: Judge::Fill(|group| {
            let (time, best_time, _) = ends(group, fit_time)?;
            let (frequency, best_frequency, _) = ends(group, fit_frequency)?;
            let low = coherence(at(group, LEAST)?)?;
            let later = mean(&from(group, 0.05, coherence)?);
            let text = format!(
                "fits {:.0} and {:.0} points below the best; coherence {low:.2}, later {later:.2}",
                best_time - time,
                best_frequency - frequency
            );
            let fits = best_time - time > 5.0 && best_frequency - frequency > 5.0;
            Some((text, fits && low > later))
        }),
        why: "7.1.2 and 7.1.3 say the opposite of the fit in frequency and of the coherence.",
        ..PLAIN
    },
    Statement {
        section: "7.1.3",
        who: Who::Bench,
        says: "At middle and large torque the bench's residual coherence is above the synthetic plateau.",
        rule: "the mean from 0.15 N·m up is above 0.35",
        judge: Judge::Fill(|group| {
            let plateau = mean(&from(group, 0.15, coherence)?);
            Some((format!("{plateau:.2}"), plateau > 0.35))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.3, fig. 7.11",
        who: Who::Bench,
        says: "At the smallest torque the coherence is lower near the resonance.",
        rule: "at 0.0125 N·m the mean within 0.2 Hz of the linear resonance is more than 0.05 below that elsewhere",
        judge: Judge::Fill(|group| {
            let (near, rest) = coherence_near_and_far(group, at(group, LEAST)?)?;
            Some((format!("{near:.2}, elsewhere {rest:.2}"), rest - near > 0.05))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.3, fig. 7.11",
        who: Who::Bench,
        says: "The region of low coherence grows with the torque.",
        rule: "its depth (mean coherence elsewhere less that within 0.2 Hz of the linear resonance) is on average more than 0.05 larger in the larger third of the torques than in the middle third",
        judge: Judge::Fill(|group| {
            let depth = |run: &&&Outcome| {
                let (near, rest) = coherence_near_and_far(group, run)?;
                Some(rest - near)
            };
            let all: Vec<f64> = group.runs.iter().map(|run| depth(&run)).collect::<Option<_>>()?;
            let third = all.len() / 3;
            let (middle, high) =
                (mean(&all[third..all.len() - third]), mean(&all[all.len() - third..]));
            Some((format!("{middle:.2} → {high:.2}"), high - middle > 0.05))
        }),
        despite: "The linear liquid's region grows too; the nonlinear liquids' is as deep at middle torque already.",
        ..PLAIN
    },
    Statement {
        section: "7.1.3, fig. 7.12",
        who: Who::Synthetic,
        says: "The coherence remains high over the whole band, apart from the smallest torques.",
        why: "The thesis contradicts itself: between the extrema it prints 0.25 to 0.35, and it expects a residual without coherence.",
        ..PLAIN
    },
    Statement {
        section: "7.1.4, fig. 7.13",
        who: Who::Bench,
        says: "The signal-to-noise ratio is consistently strongest around the resonance.",
        rule: "at every torque from 0.05 N·m up the band's largest ratio lies within 0.2 Hz of the linear resonance",
        judge: Judge::Fill(|group| {
            let resonance = group.exact[0].f_res?;
            let runs = group.runs.iter().filter(|run| torque_of(run) > 0.05 - 1e-9);
            let tops: Vec<f64> = runs.map(|run| Some(snr_shape(run)?.2)).collect::<Option<_>>()?;
            let near = tops.iter().filter(|f| (*f - resonance).abs() < 0.2).count();
            Some((format!("at {near} of {} torques", tops.len()), near == tops.len()))
        }),
        why: "The ratio follows from the coherence, and the resonance is where the coherence is worst: the sweep is too fast for its width, and the liquid is nonlinear there.",
        ..PLAIN
    },
    Statement {
        section: "7.1.4, fig. 7.13",
        who: Who::Bench,
        says: "Beyond the smallest torques the signal-to-noise ratio is relatively stable.",
        rule: "the band's mean stays within 6 dB from 0.1 N·m up",
        judge: Judge::Fill(steady_snr),
        ..PLAIN
    },
    Statement {
        section: "7.1.4, fig. 7.13",
        who: Who::Bench,
        says: "At large torque the signal-to-noise ratio is slightly more irregular over the frequency.",
        rule: "its standard deviation over the band is larger at 0.25 than at 0.1 N·m, by 1 to 6 dB",
        judge: Judge::Fill(|group| {
            let (low, high) = (snr_shape(at(group, 0.1)?)?.1, snr_shape(at(group, MOST)?)?.1);
            Some((format!("{low:.1} → {high:.1} dB"), (1.0..6.0).contains(&(high - low))))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.1.4, fig. 7.14",
        who: Who::Synthetic,
        says: "The synthetic signal-to-noise ratio does not depend on the torque beyond the smallest ones.",
        rule: "the band's mean stays within 6 dB from 0.1 N·m up",
        judge: Judge::Fill(steady_snr),
        ..PLAIN
    },
    Statement {
        section: "7.1.4",
        who: Who::Bench,
        says: "Tests at small torque are limited by measurement noise.",
        why: "Needs the same sweeps with and without gyro noise (plans `thesis` and `thesis_models`).",
        ..PLAIN
    },
    Statement {
        section: "7.1.5, fig. 7.15",
        who: Who::Bench,
        says: "The cross-axis energy fraction is close to one at the smallest torques.",
        rule: "at 0.0125 N·m above 0.8 for a hub that does not tilt, with the gyro's noise on all axes",
        judge: Judge::Fill(|group| {
            let fraction = at(group, LEAST)?.passing.as_ref()?.noise_fraction?;
            Some((format!("{fraction:.2}"), fraction > 0.8))
        }),
        why: "The noise of 4.07e-4 rad/s per sample is below the hub's rate at 0.0125 N·m. A gyro bias about x and y raises the fraction to such values.",
        ..PLAIN
    },
    Statement {
        section: "7.1.5, fig. 7.15",
        who: Who::Bench,
        says: "The cross-axis energy fraction falls rapidly and is near zero above 0.1 N·m.",
        rule: "as above: below 0.02 at every torque from 0.1 N·m up, and below a tenth of that at 0.0125 N·m",
        judge: Judge::Fill(|group| {
            let fraction = |run: &Outcome| run.passing.as_ref()?.noise_fraction;
            let first = fraction(at(group, LEAST)?)?;
            let most = from(group, 0.1, fraction)?.into_iter().fold(0.0, f64::max);
            Some((format!("{first:.2} → at most {most:.4}"), most < 0.02 && most < 0.1 * first))
        }),
        despite: "Noise alone is in the figure: the hub cannot tilt. With a hub that tilts see [a platform that tilts](tilting.md).",
        ..PLAIN
    },
    Statement {
        section: "7.1.5, fig. 7.15",
        who: Who::Bench,
        says: "Leakage starts high at the smallest torques, because of noise.",
        why: "Leakage of the hub's rates needs a hub that tilts: [a platform that tilts](tilting.md). Demodulation removes most of the noise there, and leakage does not start high.",
        ..PLAIN
    },
    Statement {
        section: "7.1.5, fig. 7.15",
        who: Who::Bench,
        says: "Leakage settles on a flat plateau before it rises.",
        rule: "from 0.025 to 0.075 N·m it stays within a factor of 1.5",
        judge: Judge::Fill(|group| {
            let part = group.runs.iter().filter(|run| (0.024..0.076).contains(&torque_of(run)));
            let values: Vec<f64> = part.map(|run| leakage(run)).collect::<Option<_>>()?;
            let most = values.iter().copied().fold(f64::MIN, f64::max);
            let least = values.iter().copied().fold(f64::MAX, f64::min);
            Some((format!("{least:.1e} to {most:.1e}"), least > 0.0 && most < 1.5 * least))
        }),
        why: "Without imbalance or tilt only the liquid's radial force leaks, which grows with the wave.",
        ..PLAIN
    },
    Statement {
        section: "7.1.5, 8.1, fig. 7.15",
        who: Who::Bench,
        says: "Leakage is larger at 10 cm than at 5 cm.",
        rule: "at every torque",
        judge: Judge::Fills(|groups| larger_in_the_deeper(groups, leakage)),
        why: "In shallower liquid rotary slosh begins at a smaller torque.",
        ..PLAIN
    },
    Statement {
        section: "7.1.5, fig. 7.16",
        who: Who::Bench,
        says: "At small torque off-axis motion shows at many frequencies, and disappears as the signal grows.",
        why: "It is noise of the axes x and y, which the bench's FMU does not have.",
        ..PLAIN
    },
    Statement {
        section: "7.1.5, 8.1",
        who: Who::Bench,
        says: "Leakage leaves its small-torque level around 0.1 N·m.",
        rule: "it exceeds 1e-3 first at 0.075 to 0.125 N·m",
        judge: Judge::Fill(|group| {
            leakage(at(group, LEAST)?)?;
            let first = group.runs.iter().find(|run| leakage(run).is_some_and(|l| l > 1e-3));
            let torque = first.map(|run| torque_of(run));
            let text = torque.map_or("never".into(), |torque| format!("at {torque} N·m"));
            Some((text, torque.is_some_and(|torque| (0.074..0.126).contains(&torque))))
        }),
        why: "It is the onset of rotary slosh, which is late in a sweep from rest.",
        ..PLAIN
    },
    Statement {
        section: "8.1",
        who: Who::Synthetic,
        says: "In the synthetic data all energy stays about the commanded axis.",
        rule: "leakage below 1e-3 at every torque",
        judge: Judge::Fill(|group| {
            let most = from(group, LEAST, leakage)?.into_iter().fold(0.0, f64::max);
            Some((format!("at most {most:.1e}"), most < 1e-3))
        }),
        despite: "A linear liquid has no radial force by construction.",
        ..PLAIN
    },
    Statement {
        section: "8.1",
        who: Who::Bench,
        says: "The rotating liquid can spin faster than the sweep.",
        rule: "in some 20 s of rotary slosh at 0.1 N·m or more the crest turns more than 2 % faster than the torque's phase",
        judge: Judge::Fill(|group| {
            let runs = group.runs.iter().filter(|run| torque_of(run) > 0.099);
            runs.clone().next()?.rotary?;
            let paces = runs.filter_map(|run| run.rotary?.pace);
            let most = paces.fold(0.0, f64::max);
            if most == 0.0 {
                return Some(("no rotary slosh".into(), false));
            }
            Some((format!("{most:.3} times the sweep's frequency"), most > 1.02))
        }),
        why: "Rotary slosh is locked to the torque.",
        ..PLAIN
    },
    Statement {
        section: "8.2.3 a",
        who: Who::Bench,
        says: "At small torque the linear model has the bench's dominant frequency.",
        rule: "the resonance (spa) is within 25 mHz of the exact linear one up to 0.05 N·m",
        judge: Judge::Fill(|group| {
            let exact = group.exact[0].f_res?;
            let runs = group.runs.iter().filter(|run| torque_of(run) < 0.051);
            let away: Vec<f64> =
                runs.map(|run| Some(run.spa_features().f_res? - exact)).collect::<Option<_>>()?;
            let most = away.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
            Some((format!("within {:.1} mHz", most * 1e3), most < 0.025))
        }),
        ..PLAIN
    },
    Statement {
        section: "8.2.3 c.i",
        who: Who::Bench,
        says: "A linear model is sufficient below 0.1 N·m.",
        rule: "up to 0.075 N·m the wave stays below a quarter of the tank's radius (2.3.5) and no slosh is rotary",
        judge: Judge::Fill(|group| {
            let runs = group.runs.iter().filter(|run| torque_of(run) < 0.076);
            let wave = runs.clone().map(|run| run.totals.peak_wave_height / run.range.radius);
            let most = wave.fold(0.0, f64::max);
            let planar = onset(group).is_none_or(|torque| torque > 0.076);
            runs.clone().next()?.rotary?;
            Some((format!("wave up to {most:.2} of the radius"), most < 0.25 && planar))
        }),
        why: "At 0.075 N·m the wave is higher; 0.05 N·m is the limit.",
        ..PLAIN
    },
    Statement {
        section: "8.2.2 b",
        who: Who::Bench,
        says: "Linear, rotary and strongly nonlinear slosh can be produced.",
        rule: "the regime is linear or transitional at 0.0125 N·m, nonlinear at 0.25 N·m, and rotary slosh occurs",
        judge: Judge::Fill(|group| {
            let (low, high) = (at(group, LEAST)?.regime()?, at(group, MOST)?.regime()?);
            at(group, MOST)?.rotary?;
            let rotary = onset(group).is_some();
            let text = format!("{low} → {high}, {}", turning_from(group));
            Some((text, low != "nonlinear" && high == "nonlinear" && rotary))
        }),
        ..PLAIN
    },
    Statement {
        section: "7.2.1",
        who: Who::Thesis,
        says: "The tank's Bond number is 902.3.",
        rule: "eq. 7.1 with 997 kg/m³ and 0.072 N/m, to 0.1 %",
        judge: Judge::Number(|| number(902.3, WATER.bond(9.81, RADIUS), 1e-3)),
        ..PLAIN
    },
    Statement {
        section: "7.2.1",
        who: Who::Thesis,
        says: "The Centaur's oxygen tank has this Bond number at 0.002502 m/s².",
        rule: "eq. 7.2 with a radius of 2.0425 m, 1141 kg/m³ and 0.0132 N/m, to 0.1 %",
        judge: Judge::Number(|| number(0.002502, OXYGEN.acceleration(902.3, 2.0425), 1e-3)),
        ..PLAIN
    },
    Statement {
        section: "7.2.1",
        who: Who::Thesis,
        says: "147000/18000 is 7.8191 m/s², three orders of magnitude more.",
        rule: "the quotient, to 0.1 %",
        judge: Judge::Number(|| number(7.8191, 147_000.0 / 18_000.0, 1e-3)),
        why: "7.8191 belongs to 18800 kg. The orders of magnitude are right.",
        ..PLAIN
    },
    Statement {
        section: "7.2.1",
        who: Who::Thesis,
        says: "Six thrusters of 4.4 N accelerate 10450 kg by 0.0025 m/s².",
        rule: "the quotient, to two digits",
        judge: Judge::Number(|| number(0.0025, 4.4 * 6.0 / 10_450.0, 0.02)),
        ..PLAIN
    },
    Statement {
        section: "7.2.1",
        who: Who::Thesis,
        says: "Small tanks under a stronger acceleration are easier to represent.",
        why: "Not a statement about numbers; `hubslosh scale bond` gives the tanks that the bench represents.",
        ..PLAIN
    },
    Statement {
        section: "7.2.2",
        who: Who::Thesis,
        says: "2.21 rad/s² is a rotational Bond number of 45.87.",
        rule: "eq. 7.3 with the tank's radius, 1000 kg/m³ and 0.072 N/m, to 1 %",
        judge: Judge::Number(|| number(45.87, rotational_bond(2.21), 0.01)),
        why: "45.87 has the arm of 0.225 m in place of one radius.",
        ..PLAIN
    },
    Statement {
        section: "7.2.2",
        who: Who::Thesis,
        says: "0.222 rad/s² is a rotational Bond number of 4.62.",
        rule: "eq. 7.3, to 1 %",
        judge: Judge::Number(|| number(4.62, rotational_bond(0.222), 0.01)),
        why: "As above.",
        ..PLAIN
    },
    Statement {
        section: "7.2.2",
        who: Who::Thesis,
        says: "2.21 rad/s² represents a flight tank of 1.2416 m.",
        rule: "equal numbers of eq. 7.3 at 0.005 rad/s², to 0.2 %",
        judge: Judge::Number(|| number(1.2416, equivalent_diameter(2.21), 2e-3)),
        despite: "It follows from eq. 7.3, not from the printed Bond number.",
        ..PLAIN
    },
    Statement {
        section: "7.2.2",
        who: Who::Thesis,
        says: "0.222 rad/s² represents a flight tank of 0.5778 m.",
        rule: "equal numbers of eq. 7.3 at 0.005 rad/s², to 0.2 %",
        judge: Judge::Number(|| number(0.5778, equivalent_diameter(0.222), 2e-3)),
        despite: "It follows from eq. 7.3, not from the printed Bond number.",
        ..PLAIN
    },
    Statement {
        section: "7.2.2",
        who: Who::Thesis,
        says: "A larger tank on the bench represents smaller flight tanks.",
        rule: "the equivalent diameter falls with the bench's radius",
        judge: Judge::Number(|| {
            let ratio = equivalent_diameter(2.21) / (2.0 * RADIUS);
            (format!("{ratio:.2} times the bench's diameter at any radius"), false)
        }),
        why: "By eq. 7.3 the equivalent diameter is proportional to the bench's.",
        ..PLAIN
    },
    Statement {
        section: "7.2.2",
        who: Who::Thesis,
        says: "0.005 rad/s² is ten times the acceleration of highly agile spacecraft.",
        why: "It rests on the thesis's source [26].",
        ..PLAIN
    },
    Statement {
        section: "8.2.2 a",
        who: Who::Thesis,
        says: "A Bond number below 30 needs a tank of less than about 5 cm.",
        rule: "eq. 7.1 for a Bond number of 30, to 10 %",
        judge: Judge::Number(|| number(0.05, 2.0 * WATER.radius(30.0, 9.81), 0.1)),
        why: "5 cm is a Bond number of 85.",
        ..PLAIN
    },
    Statement {
        section: "8.6.3, table 8.1",
        who: Who::Thesis,
        says: "Table 8.1: mode 1 at 5 cm has 0.627 kg, a length of 0.0545 m and 2.133 Hz.",
        rule: "the length from the root 1.8412 and 9.81 m/s², to half of its last digit",
        judge: Judge::Number(|| {
            let root = 1.841_183_781;
            let length = RADIUS / (root * (root * 0.05 / RADIUS).tanh());
            let frequency = (9.81 / length).sqrt() / (2.0 * PI);
            let text = format!("{length:.5} m, {frequency:.4} Hz");
            (text, (length - 0.0545).abs() < 5e-5)
        }),
        why: "The length is 0.0546 m; mass and frequency are right.",
        ..PLAIN
    },
    Statement {
        section: "8.4 to 8.6",
        who: Who::Thesis,
        says: "Recommendations: gyros, cameras, bearings, ARX and ARMAX models, other tanks, physical pendulums.",
        why: "Proposals, not findings. [Section by section](thesis_sections.md) names the command for each.",
        ..PLAIN
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "At 0.075 N·m rotary slosh is weak and unstable (5 cm), or some rotation is visible (10 cm).",
        rule: "rotary slosh at 0.075 N·m",
        judge: Judge::Fill(|group| {
            let rotary = at(group, 0.075)?.rotary?;
            let text = format!("largest swirl number {:.3}", rotary.swirl.abs());
            Some((text, rotary.time > 0.0))
        }),
        why: "A sweep from perfect rest has no seed but the centripetal force.",
        ..PLAIN
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "Every run from 0.1 N·m up has rotary slosh.",
        rule: "rotary slosh at each of these torques",
        judge: Judge::Fill(|group| {
            let runs: Vec<_> = group.runs.iter().filter(|run| torque_of(run) > 0.099).collect();
            runs.first()?.rotary?;
            let rotary = |run: &&&&Outcome| run.rotary.is_some_and(|rotary| rotary.time > 0.0);
            let count = runs.iter().filter(rotary).count();
            Some((format!("in {count} of {} runs", runs.len()), count == runs.len()))
        }),
        why: "A sweep from perfect rest has no seed but the centripetal force.",
        ..PLAIN
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "From 0.125 N·m up rotary slosh is stable at 5 cm.",
        rule: "at 5 cm rotary for more than 60 s in each of these runs",
        judge: Judge::Fills(|groups| {
            let group = of_fill(groups, 0.05)?;
            let runs = group.runs.iter().filter(|run| torque_of(run) > 0.124);
            let times: Vec<f64> = runs.map(|run| Some(run.rotary?.time)).collect::<Option<_>>()?;
            let least = times.iter().copied().fold(f64::MAX, f64::min);
            Some((format!("at least {least:.0} s"), least > 60.0))
        }),
        ..PLAIN
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "The platform moves flat up to 0.05 N·m and nutates from 0.1 N·m up.",
        rule: "leakage of the liquid's force is below 1e-3 up to 0.05 N·m, above it from 0.1 N·m up",
        judge: Judge::Fill(|group| {
            let values = from(group, LEAST, leakage)?;
            let torques: Vec<f64> = group.runs.iter().map(|run| torque_of(run)).collect();
            let both = || torques.iter().zip(&values);
            let low = both().filter(|(t, _)| **t < 0.051).map(|(_, l)| *l).fold(0.0, f64::max);
            let high =
                both().filter(|(t, _)| **t > 0.099).map(|(_, l)| *l).fold(f64::MAX, f64::min);
            let text = format!("at most {low:.1e}, then at least {high:.1e}");
            Some((text, low < 1e-3 && high > 1e-3))
        }),
        why: "Nutation follows from rotary slosh, which is late in a sweep from rest.",
        ..PLAIN
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "The platform's motion grows with the torque, from extremely small at 0.0125 N·m.",
        rule: "the largest rate is larger at each torque than at the one before",
        judge: Judge::Fill(|group| {
            let rates = from(group, LEAST, |run| Some(run.totals.peak_rate))?;
            let text = format!("{:.3} → {:.3} rad/s", rates[0], rates[rates.len() - 1]);
            Some((text, rates.windows(2).all(|pair| pair[1] > pair[0])))
        }),
        ..PLAIN
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "Splashing at 0.225 N·m (5 cm) and 0.25 N·m; liquid detaches at 0.2 N·m (10 cm).",
        why: "No model of this plan has breaking waves; the plan `bench_as_built` has their dissipation.",
        ..PLAIN
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "At 0.25 N·m side-to-side motion before resonance is very small, and the transition is violent.",
        why: "An impression from a video without a number.",
        ..PLAIN
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "Water at 23.5 to 25 °C.",
        why: "A setting of the tests, not a finding.",
        ..PLAIN
    },
    Statement {
        section: "7.1.2, fig. 7.4",
        who: Who::Synthetic,
        says: "The synthetic fit in time begins at a percentage similar to the bench's.",
        why: "Both percentages are in figures only.",
        ..PLAIN
    },
    Statement {
        section: "7.1.3",
        who: Who::Bench,
        says: "The residual coherence does not grow without bound.",
        why: "No coherence exceeds 1.",
        ..PLAIN
    },
    Statement {
        section: "8.1",
        who: Who::Bench,
        says: "The synthetic model deviates more from the measured data at larger torque.",
        why: "Needs a recording: `hubslosh analyse` compares one with every model.",
        ..PLAIN
    },
    Statement {
        section: "8.1",
        who: Who::Bench,
        says: "Friction, preferential directions and liquid act together and cannot be separated at one torque.",
        why: "Needs a recording with friction runs: `hubslosh identify` fits both together.",
        ..PLAIN
    },
    Statement {
        section: "8.2.2 b.i",
        who: Who::Bench,
        says: "The recordings have no clean separation of linear and rotary regime.",
        why: "Needs recordings; in simulated sweeps the separation is a jump at the onset.",
        ..PLAIN
    },
    Statement {
        section: "8.2.2 c",
        who: Who::Bench,
        says: "Less than 5 cm of water or a smaller tank cannot be detected.",
        why: "The thesis has no run with less; `hubslosh design --snr` computes the torque that a tank needs.",
        ..PLAIN
    },
    Statement {
        section: "8.3",
        who: Who::Thesis,
        says: "Differences between plan and reality.",
        why: "The author's account of the project.",
        ..PLAIN
    },
];

/// Judges the spreads of antiresonance and resonance (spa) from a torque on, Hz.
fn extrema(group: &Group, torque: f64, is_right: fn(f64) -> bool) -> Option<Shown> {
    let antiresonance = spread(&from(group, torque, |run| run.spa_features().f_dip)?);
    let resonance = spread(&from(group, torque, |run| run.spa_features().f_res)?);
    let text =
        format!("antiresonance {:.1}, resonance {:.1} mHz", antiresonance * 1e3, resonance * 1e3);
    Some((text, is_right(antiresonance) && is_right(resonance)))
}

fn softening(group: &Group) -> Option<Shown> {
    let resonance = |torque| at(group, torque)?.spa_features().f_res;
    let (low, high) = (resonance(LEAST)?, resonance(0.05)?);
    Some((format!("{:+.1} mHz", (high - low) * 1e3), low - high > 1e-3))
}

fn steady_snr(group: &Group) -> Option<Shown> {
    let range = spread(&from(group, 0.1, snr)?);
    Some((format!("within {range:.1} dB"), range < 6.0))
}

fn notch_trend(group: &Group, sign: f64) -> Option<Shown> {
    let (low, high) = thirds(group, notch)?;
    let (swept_low, swept_high) = thirds(group, |run| run.features().notch_db)?;
    let text = format!("{low:.1} → {high:.1} ({swept_low:.1} → {swept_high:.1}) dB");
    Some((text, (high - low) * sign > 0.5))
}

/// Compares the largest acceleration at a torque (N·m) with the measured one (rad/s²), to 15 %.
fn peak_acceleration(group: &Group, torque: f64, measured: f64) -> Option<Shown> {
    let totals = &at(group, torque)?.totals;
    let (peak, rate) = (totals.peak_acceleration, totals.peak_rate);
    let gyro = if totals.gyro_errors { "" } else { ", gyro without noise" };
    let text =
        format!("{peak:.3} rad/s², {:.1} times (rate {rate:.3} rad/s{gyro})", peak / measured);
    Some((text, (peak / measured - 1.0).abs() < 0.15))
}

/// Mean residual coherence of a run within 0.2 Hz of the linear resonance, and elsewhere.
fn coherence_near_and_far(group: &Group, run: &Outcome) -> Option<(f64, f64)> {
    let resonance = group.exact[0].f_res?;
    let (_, over_band) = run.record.as_ref().filter(|_| run.has_curves())?.fit.as_ref()?;
    let (near, rest): (Vec<_>, Vec<_>) =
        over_band.iter().partition(|(f, _)| (f - resonance).abs() < 0.2);
    let values = |points: Vec<(f64, f64)>| points.iter().map(|(_, v)| *v).collect::<Vec<_>>();
    Some((mean(&values(near)), mean(&values(rest))))
}

fn snr_grows(group: &Group) -> Option<Shown> {
    let all = from(group, LEAST, snr)?;
    let (least, later) = (at(group, LEAST)?, at(group, 0.1)?);
    let (low, high) = (snr(least)?, snr(later)?);
    let lowest = all.iter().all(|v| *v >= low);
    let gyro = if least.totals.gyro_errors { "" } else { "; gyro without noise" };
    Some((format!("{low:.0} → {high:.0} dB{gyro}"), lowest && high - low > 5.0))
}

fn turning_from(group: &Group) -> String {
    match onset(group) {
        Some(torque) => format!("rotary from {torque} N·m"),
        None => "no rotary slosh".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::{Judge, STATEMENTS, number, swings, worst_fall};

    #[test]
    fn every_statement_has_a_rule_or_the_reason_for_none() {
        for (i, one) in STATEMENTS.iter().enumerate() {
            let judged = !matches!(one.judge, Judge::Not);
            assert_eq!(judged, !one.rule.is_empty(), "{}", one.says);
            assert!(judged || !one.why.is_empty(), "{}", one.says);
            assert!(!one.section.is_empty(), "{}", one.says);
            let mut others = STATEMENTS[..i].iter();
            assert!(others.all(|other| other.says != one.says), "{} twice", one.says);
        }
    }

    #[test]
    fn rules_see_what_happens_between_the_ends() {
        assert_eq!(worst_fall(&[1.0, 3.0, 2.0, 2.5, 0.5, 4.0]), 2.5);
        assert_eq!(worst_fall(&[1.0, 2.0, 3.0]), 0.0);
        assert_eq!(swings(&[0.0, 2.0, 0.0, 0.5, 0.0, 3.0], 1.0), 2);
        assert_eq!(swings(&[0.0, 0.5, 1.0], 1.0), 0);
        assert!(number(7.8191, 147_000.0 / 18_800.0, 1e-3).1);
        assert!(!number(7.8191, 147_000.0 / 18_000.0, 1e-3).1);
    }
}
