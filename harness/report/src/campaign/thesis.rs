//! Comparison of the thesis's statements about its bench and synthetic data with the campaign's runs.
//!
//! The thesis prints few numbers; its statements are quoted in our words, each with a rule that
//! decides from the runs whether a model does the same. A number in a statement is a number in its
//! rule. Every model of the plan is held against every statement that its runs can answer; a rule
//! must hold for every fill. The thesis's synthetic data have a linear liquid.

use experiments::campaign::Outcome;
use experiments::plan::RECORDING;
use maud::{Markup, html};

use super::page::{Group, cm, distinct, torque_of};

/// Findings for each fill, and true if the statement holds for all of them; `None` if runs are missing.
type Cell = Option<(Vec<String>, bool)>;

/// The smallest and the largest torque of the thesis, N·m.
const LEAST: f64 = 0.0125;
const MOST: f64 = 0.25;

/// Source of a statement in the thesis.
#[derive(Clone, Copy, PartialEq)]
enum Who {
    /// The bench, whose liquid is water.
    Bench,
    /// The synthetic data, whose liquid is linear.
    Synthetic,
}

/// Figures of a group of runs for one statement, and true if the statement holds.
type Shown = (String, bool);

struct Statement {
    section: &'static str,
    who: Who,
    /// The thesis's statement in our words.
    says: &'static str,
    /// The rule, for the reader.
    rule: &'static str,
    /// The rule; `None` where the runs it needs are not there.
    shows: fn(&Group) -> Option<Shown>,
    /// Known reason for a difference.
    why: &'static str,
}

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

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
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

const STATEMENTS: &[Statement] = &[
    Statement {
        section: "7.1.1, fig. 7.1",
        who: Who::Bench,
        says: "With growing torque resonance and antiresonance move apart: Δf grows.",
        rule: "Δf (spa) grows by more than 20 mHz from 0.05 to 0.25 N·m",
        shows: |group| {
            let delta = |torque| at(group, torque)?.spa_features().delta_f();
            let (low, high) = (delta(0.05)?, delta(MOST)?);
            Some((format!("{:.0} → {:.0} mHz", low * 1e3, high * 1e3), high - low > 0.02))
        },
        why: "",
    },
    Statement {
        section: "7.1.1, fig. 7.2",
        who: Who::Synthetic,
        says: "Resonance and antiresonance hardly depend on the torque; Δf is constant beyond the smallest torques.",
        rule: "both (spa) stay within 4 mHz from 0.05 N·m up",
        shows: |group| {
            let resonance = spread(&from(group, 0.05, |run| run.spa_features().f_res)?);
            let antiresonance = spread(&from(group, 0.05, |run| run.spa_features().f_dip)?);
            let text = format!(
                "antiresonance {:.1}, resonance {:.1} mHz",
                antiresonance * 1e3,
                resonance * 1e3
            );
            Some((text, antiresonance < 4e-3 && resonance < 4e-3))
        },
        why: "",
    },
    Statement {
        section: "7.1.1",
        who: Who::Bench,
        says: "The resonance starts higher at the smallest torques, then comes down.",
        rule: "f_res (spa) at 0.0125 lies above that at 0.05 N·m by more than 1 mHz",
        shows: softening,
        why: "",
    },
    Statement {
        section: "7.1.1",
        who: Who::Synthetic,
        says: "The synthetic data's resonance, whose liquid is linear, starts higher at the smallest torques too (the thesis suspects noise; it is dry friction).",
        rule: "the same",
        shows: softening,
        why: "",
    },
    Statement {
        section: "7.1.1",
        who: Who::Bench,
        says: "At moderate and large torque the bench's resonance and antiresonance stay close to those of the linear synthetic model.",
        rule: "|f_res − exact linear| (spa) stays below 0.1 Hz from 0.1 N·m up",
        shows: |group| {
            let exact = group.exact[0].f_res?;
            let resonances = from(group, 0.1, |run| run.spa_features().f_res)?;
            let away = resonances.iter().map(|f| f - exact);
            let most = away.fold(0.0, |m: f64, d| if d.abs() > m.abs() { d } else { m });
            Some((format!("up to {:+.1} mHz", most * 1e3), most.abs() < 0.1))
        },
        why: "The conical pendulum hardens too much: once in rotary slosh it follows the sweep too far up.",
    },
    Statement {
        section: "7.1.1, fig. 7.1",
        who: Who::Bench,
        says: "The notch becomes shallower with torque.",
        rule: "mean notch (spa; in brackets while the sweep passes) of the larger third of the torques is smaller by more than 0.5 dB",
        shows: |group| notch_trend(group, -1.0),
        why: "The notch of a record with a jump in it says little: spa lays the antiresonance, the jump and the ringing over each other. While the sweep passes (in brackets) it does become shallower.",
    },
    Statement {
        section: "7.1.1, fig. 7.2",
        who: Who::Synthetic,
        says: "The synthetic notch becomes deeper with torque.",
        rule: "larger by more than 0.5 dB",
        shows: |group| notch_trend(group, 1.0),
        why: "It does, but by less. The liquid has no part in it (errata, interpretation); dry friction has, whose share falls.",
    },
    Statement {
        section: "7.1.1",
        who: Who::Bench,
        says: "The bench's notch is much deeper than the synthetic one, most of all at small torque.",
        rule: "at 0.0125 N·m the notch (spa) is deeper than the exact linear one by more than 3 dB",
        shows: |group| {
            let here = notch(at(group, LEAST)?)?;
            let exact = group.exact[0].notch_db?;
            Some((format!("{here:.1} (exact {exact:.1}) dB"), here - exact > 3.0))
        },
        why: "At small torque the same friction acts on every model; the bench's bearing must have been freer than the fitted law.",
    },
    Statement {
        section: "7.1.2, fig. 7.3",
        who: Who::Bench,
        says: "Fit in time: an inverted U over the torque, best around 0.1 N·m; even the least remains close to 60 %.",
        rule: "the best fit lies at 0.075 to 0.125 N·m and more than 5 points above both ends; the least is 50 to 70 %",
        shows: |group| {
            let (low, best, high) = ends(group, fit_time)?;
            let best_run = group.runs.iter().find(|run| fit_time(run) == Some(best))?;
            let least = from(group, LEAST, fit_time)?.into_iter().fold(f64::MAX, f64::min);
            let torque = torque_of(best_run);
            let text =
                format!("{low:.0} → {best:.0} (at {torque} N·m) → {high:.0} %; least {least:.0} %");
            let inverted = best > low + 5.0 && best > high + 5.0;
            let there = (0.074..0.126).contains(&torque) && (50.0..=70.0).contains(&least);
            Some((text, inverted && there))
        },
        why: "From the onset of rotary slosh on, a linear model fits the nonlinear liquid less well, and bearing friction has the largest effect at the smallest torques. The best fit is where both are small.",
    },
    Statement {
        section: "7.1.2, fig. 7.4",
        who: Who::Synthetic,
        says: "Fit in time falls with torque to some 20 %.",
        rule: "at 0.25 N·m 15 to 25 %, and below that at 0.0125 N·m",
        shows: |group| {
            let (low, _, high) = ends(group, fit_time)?;
            let there = (15.0..=25.0).contains(&high);
            Some((format!("{low:.0} → {high:.0} %"), there && high < low))
        },
        why: "Here the fitted function gives back what it was fitted to, as a linear model must once friction matters little. The thesis has no reason for the fall either.",
    },
    Statement {
        section: "7.1.2, fig. 7.7",
        who: Who::Bench,
        says: "Fit in frequency falls steadily with torque.",
        rule: "at 0.25 N·m more than 20 points below the best",
        shows: |group| {
            let (_, best, high) = ends(group, fit_frequency)?;
            Some((format!("{best:.0} → {high:.0} %"), best - high > 20.0))
        },
        why: "",
    },
    Statement {
        section: "7.1.2, fig. 7.7",
        who: Who::Bench,
        says: "Fit in frequency is best at the smallest torque.",
        rule: "no other torque is better by more than 1.5 points",
        shows: |group| {
            let (low, best, _) = ends(group, fit_frequency)?;
            Some((format!("{low:.0}, best {best:.0} %"), best - low < 1.5))
        },
        why: "At 0.0125 N·m nearly half of the torque is dry friction, noise or not; three poles and two zeros can't be that. It is so in the thesis's synthetic data (next row).",
    },
    Statement {
        section: "7.1.2, fig. 7.8",
        who: Who::Synthetic,
        says: "Fit in frequency of the synthetic data is lowest at the smallest torque, then stable.",
        rule: "lowest at 0.0125 N·m; within 5 points from 0.1 N·m up",
        shows: |group| {
            let (low, _, high) = ends(group, fit_frequency)?;
            let all = from(group, LEAST, fit_frequency)?;
            let stable = spread(&from(group, 0.1, fit_frequency)?);
            let lowest = all.iter().all(|fit| *fit >= low);
            Some((format!("{low:.0} → {high:.0} %"), lowest && stable < 5.0))
        },
        why: "",
    },
    Statement {
        section: "7.1.3, fig. 7.9",
        who: Who::Bench,
        says: "Coherence of the residual with the torque rises with the torque.",
        rule: "from 0.05 to 0.25 N·m by more than 0.2",
        shows: |group| {
            let (low, high) = (coherence(at(group, 0.05)?)?, coherence(at(group, MOST)?)?);
            Some((format!("{low:.2} → {high:.2}"), high - low > 0.2))
        },
        why: "",
    },
    Statement {
        section: "7.1.3, fig. 7.9",
        who: Who::Bench,
        says: "The residual coherence lies between 0.45 and 0.65 at middle and large torque.",
        rule: "the mean from 0.15 N·m up lies there",
        shows: |group| {
            let plateau = mean(&from(group, 0.15, coherence)?);
            Some((format!("{plateau:.2}"), (0.45..=0.65).contains(&plateau)))
        },
        why: "",
    },
    Statement {
        section: "7.1.3, fig. 7.9",
        who: Who::Bench,
        says: "The residual coherence is low at the smallest torques and levels off above about 0.05 N·m.",
        rule: "below 0.4 at 0.0125 N·m, and above 0.4 from 0.075 N·m up",
        shows: |group| {
            let low = coherence(at(group, LEAST)?)?;
            let least = from(group, 0.075, coherence)?.into_iter().fold(f64::MAX, f64::min);
            Some((format!("{low:.2}; least {least:.2}"), low < 0.4 && least > 0.4))
        },
        why: "Dry friction is coherent with the torque at the smallest torques; and rotary slosh sets in later here than on the bench.",
    },
    Statement {
        section: "7.1.3, fig. 7.10",
        who: Who::Synthetic,
        says: "The residual coherence of the synthetic data starts high and falls to a plateau of 0.25 to 0.35.",
        rule: "at 0.0125 N·m more than 0.2 above the mean from 0.125 N·m up. The level depends on the length of the segments, which is 20 s here and unknown in the thesis",
        shows: |group| {
            let low = coherence(at(group, LEAST)?)?;
            let plateau = mean(&from(group, 0.125, coherence)?);
            let there = (0.25..=0.35).contains(&plateau);
            Some((format!("{low:.2} → {plateau:.2}"), low - plateau > 0.2 && there))
        },
        why: "",
    },
    Statement {
        section: "7.1.3, fig. 7.11",
        who: Who::Bench,
        says: "At middle and large torque a broad region of lower coherence stands around the resonance.",
        rule: "at 0.25 N·m the mean within 0.2 Hz of the linear resonance is more than 0.1 below that elsewhere",
        shows: |group| {
            let (near, rest) = coherence_near_and_far(group, at(group, MOST)?)?;
            Some((format!("{near:.2}, elsewhere {rest:.2}"), rest - near > 0.1))
        },
        why: "",
    },
    Statement {
        section: "7.1.3, fig. 7.12",
        who: Who::Synthetic,
        says: "The residual coherence of the synthetic data has no region of low coherence, apart from the smallest torques.",
        rule: "at every torque from 0.05 N·m up the mean within 0.2 Hz of the linear resonance is no more than 0.1 below that elsewhere",
        shows: |group| {
            at(group, 0.05)?;
            at(group, MOST)?;
            let runs = group.runs.iter().filter(|run| torque_of(run) > 0.05 - 1e-9);
            let gaps = runs.map(|run| {
                let (near, rest) = coherence_near_and_far(group, run)?;
                Some(rest - near)
            });
            let most = gaps.collect::<Option<Vec<_>>>()?.into_iter().fold(f64::MIN, f64::max);
            Some((format!("at most {most:.2} below"), most <= 0.1))
        },
        why: "",
    },
    Statement {
        section: "7.1.4, fig. 7.13",
        who: Who::Bench,
        says: "Signal-to-noise ratio is lowest at the smallest torque and soon better.",
        rule: "the band's mean is lowest at 0.0125 N·m, and 5 dB better at 0.1 N·m. Without gyro noise, only dry friction and the liquid's nonlinearity count as noise",
        shows: snr_grows,
        why: "",
    },
    Statement {
        section: "7.1.4, fig. 7.14",
        who: Who::Synthetic,
        says: "The synthetic data's signal-to-noise ratio is lowest at the smallest torque and soon better.",
        rule: "the same",
        shows: snr_grows,
        why: "",
    },
    Statement {
        section: "7.1.5, fig. 7.15",
        who: Who::Bench,
        says: "Leakage off the axis rises again at large torque.",
        rule: "at 0.25 N·m more than twice that at 0.05 N·m",
        shows: |group| {
            let leakage = |torque| Some(at(group, torque)?.off_axis()?.leakage);
            let (low, high) = (leakage(0.05)?, leakage(MOST)?);
            Some((format!("{low:.4} → {high:.4}"), high > 2.0 * low && high > 1e-3))
        },
        why: "",
    },
    Statement {
        section: "7.1.5, fig. 7.16",
        who: Who::Bench,
        says: "Motion across the torque's plane (leakage) occurs only near the resonance; elsewhere there is only noise.",
        rule: "at 0.25 N·m more than 90 % of its square lies within 0.3 Hz of the linear resonance",
        shows: |group| {
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
        },
        why: "The over-long rotary branch carries it upwards.",
    },
    Statement {
        section: "7.2.2",
        who: Who::Bench,
        says: "The hub's largest acceleration at 0.25 N·m is 2.21 rad/s².",
        rule: "within 15 %: the thesis states neither the fill nor how its gyro's rate was filtered",
        shows: |group| peak_acceleration(group, MOST, 2.21),
        why: "The largest acceleration is at resonance, where damping decides it: here that of bare walls at small amplitude. What breaking waves and splashing dissipate is not in it.",
    },
    Statement {
        section: "7.2.2",
        who: Who::Bench,
        says: "The hub's largest acceleration at 0.0125 N·m is 0.222 rad/s².",
        rule: "within 15 %",
        shows: |group| peak_acceleration(group, LEAST, 0.222),
        why: "At this torque the gyro's noise, differentiated, is a fifth of what the thesis reads.",
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "Up to 0.05 N·m the slosh stays planar.",
        rule: "no rotary slosh at 0.05 N·m or below",
        shows: |group| {
            at(group, 0.05)?.rotary?;
            Some((turning_from(group), onset(group).is_none_or(|torque| torque > 0.05)))
        },
        why: "",
    },
    Statement {
        section: "App. A, 8.1",
        who: Who::Bench,
        says: "Rotary slosh is visible from 0.1 N·m on, weak and intermittent at 0.075.",
        rule: "rotary slosh from 0.075 or 0.1 N·m on",
        shows: |group| {
            at(group, 0.1)?.rotary?;
            let there = onset(group).is_some_and(|torque| (0.074..0.101).contains(&torque));
            Some((turning_from(group), there))
        },
        why: "A sweep from perfect rest has no seed but the centripetal force; a dwell at resonance becomes rotary from 0.06 N·m on (plan t6_high_amplitude, and the tests).",
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "In every run from 0.1 N·m on with rotary slosh the motion is planar first, then rotary.",
        rule: "rotary slosh begins above the antiresonance",
        shows: |group| {
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
        },
        why: "",
    },
    Statement {
        section: "App. A",
        who: Who::Bench,
        says: "Rotary slosh comes and goes: intermittent at most torques, breaking down into plane swinging at 0.2 N·m, 10 cm.",
        rule: "at 0.2 N·m the slosh is rotary for less than 90 % of the time between first and last",
        shows: |group| {
            let run = at(group, 0.2)?;
            let rotary = run.rotary?;
            let Some(between) = rotary.from.zip(rotary.to) else {
                return Some(("no rotary slosh".into(), false));
            };
            let sweep = group.sweep?;
            let whole = (sweep.time_of(between.1)? - sweep.time_of(between.0)?).abs();
            let share = rotary.time / whole;
            Some((format!("{:.0} s of {whole:.0} s", rotary.time), share < 0.9))
        },
        why: "A pendulum loses no water: no breaking waves, no splashing, and so no reason for rotary slosh to stop.",
    },
    Statement {
        section: "5.1.4, 7.1",
        who: Who::Synthetic,
        says: "The sweep is slow enough to show the steady response.",
        rule: "while the sweep passes, the resonance at 0.25 N·m stands within 5 mHz of the exact linear one",
        shows: |group| {
            let shift = at(group, MOST)?.features().f_res? - group.exact[0].f_res?;
            Some((format!("{:+.0} mHz", shift * 1e3), shift.abs() < 5e-3))
        },
        why: "See below why the swept resonance lies higher. The whole record (spa) is free of it.",
    },
];

fn softening(group: &Group) -> Option<Shown> {
    let resonance = |torque| at(group, torque)?.spa_features().f_res;
    let (low, high) = (resonance(LEAST)?, resonance(0.05)?);
    Some((format!("{:+.1} mHz", (high - low) * 1e3), low - high > 1e-3))
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

/// The table; empty where the plan has none of the runs it needs.
pub(super) fn statements(groups: &[Group]) -> Markup {
    let groups: Vec<&Group> = groups.iter().filter(|group| group.others.is_empty()).collect();
    let models = distinct(groups.iter().map(|group| group.model));
    let of = |statement: &Statement, model: &str| {
        let same: Vec<&Group> = groups.iter().copied().filter(|g| g.model == model).collect();
        shown(statement, &same)
    };
    let rows: Vec<(&Statement, Vec<Cell>)> = STATEMENTS
        .iter()
        .map(|statement| (statement, models.iter().map(|model| of(statement, model)).collect()))
        .filter(|(_, cells): &(&Statement, Vec<Cell>)| cells.iter().any(Option::is_some))
        .collect();
    if rows.is_empty() {
        return html! {};
    }
    let recorded = models.iter().position(|model| *model == RECORDING);
    html! {
        p {
            "What Rubaga's thesis says of its bench and of its synthetic data, in our words, and what these runs do. "
    "Statements on the bench that a model's runs agree with, and statements on the synthetic data: "
            @for (i, model) in models.iter().enumerate() {
                @if i > 0 { "; " }
                (model) " " (tally(&rows, i, Who::Bench)) ", " (tally(&rows, i, Who::Synthetic))
            }
            @if let Some(place) = recorded {
                ". Comparison with the recording: statements on the bench for which a model agrees with the recording, independent of the thesis (=; else ≠): "
                @for (k, (i, model)) in models.iter().enumerate().filter(|(i, _)| *i != place).enumerate() {
                    @if k > 0 { "; " }
                    (model) " " (alike(&rows, i, place))
                }
            }
            ". ✓ and ✗ say whether a model does what the statement says, at every fill. The synthetic data have a linear liquid. The thesis prints its features as figures only; where it names a number, the rule holds the model to it. Off-axis rates (7.1.5, first half) are not here: the hub of the FMU does not tilt."
        }
        div .wide {
            table .statements {
                thead {
                    tr {
                        th { "what the thesis says" }
                        @for model in &models { th { (model) } }
                    }
                }
                tbody {
                    @for (statement, cells) in &rows {
                        tr {
                            td {
                                (statement.says)
                                span .note {
                                    "Thesis " (statement.section) ", "
                                    @if statement.who == Who::Bench { "bench" } @else { "synthetic data" } "."
                                }
                                span .note { "Rule: " (statement.rule) "." }
                                @if !statement.why.is_empty() && cells.iter().flatten().any(|(_, holds)| !holds) {
                                    span .note { (statement.why) }
                                }
                            }
                            @let there = recorded.and_then(|place| cells[place].as_ref()).map(|cell| cell.1);
                            @for (i, cell) in cells.iter().enumerate() {
                                td {
                                    @if let Some((each, holds)) = cell {
                                        @if let Some(there) = there.filter(|_| statement.who == Who::Bench && recorded != Some(i)) {
                                            @if there == *holds { span .yes { "= " } } @else { span .no { "≠ " } }
                                        }
                                        @if *holds { span .yes { "✓ " } } @else { span .no { "✗ " } }
                                        @for (i, text) in each.iter().enumerate() {
                                            @if i > 0 { br; "\u{2003}" }
                                            (text)
                                        }
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// "12 of 20": in how many of the statements on one of the two that it can answer a model does the same.
fn tally(rows: &[(&Statement, Vec<Cell>)], model: usize, who: Who) -> String {
    let cells = rows.iter().filter(|(statement, _)| statement.who == who);
    let verdicts: Vec<bool> =
        cells.filter_map(|(_, cells)| Some(cells[model].as_ref()?.1)).collect();
    format!("{} of {}", verdicts.iter().filter(|holds| **holds).count(), verdicts.len())
}

/// The same of the statements in which it does what the recording does.
fn alike(rows: &[(&Statement, Vec<Cell>)], model: usize, recorded: usize) -> String {
    let bench = rows.iter().filter(|(statement, _)| statement.who == Who::Bench);
    let pairs: Vec<bool> = bench
        .filter_map(|(_, cells)| Some(cells[model].as_ref()?.1 == cells[recorded].as_ref()?.1))
        .collect();
    format!("{} of {}", pairs.iter().filter(|same| **same).count(), pairs.len())
}

/// Combines the groups of a model: the statement holds if it holds for every fill.
/// `None` without groups, or if one lacks the runs.
fn shown(statement: &Statement, groups: &[&Group]) -> Cell {
    let each: Vec<Shown> =
        groups.iter().map(|group| (statement.shows)(group)).collect::<Option<_>>()?;
    let text = groups.iter().zip(&each).map(|(group, (text, _))| match group.fill {
        Some(fill) => format!("{} cm: {text}", cm(fill)),
        None => text.clone(),
    });
    let text = text.map(|text| text.replace('-', "\u{2212}")).collect();
    (!each.is_empty()).then(|| (text, each.iter().all(|(_, holds)| *holds)))
}
