//! Noise and nonlinear distortion, told apart at each frequency, from several periods of an odd multisine with
//! detection lines ([`crate::uncertainty::bench::design::Multisine`]; Pintelon & Schoukens, System Identification, 2nd ed., chapter 4).
//!
//! ```text
//! σ_n²(k) = Σ_m |Y_m(k) − Ȳ(k)|²/(M(M − 1))     from period to period: noise
//! |Ȳ(k)|² − σ_n²(k) at even lines                even distortion (ω², asymmetry)
//! |Ȳ(k)|² − σ_n²(k) at odd lines without power   odd distortion (ω³, dry friction)
//! ```
//!
//! Coherence cannot do this: it falls by either. The distortion of an excited line is that of the detection
//! lines around it, and belongs, with the noise, to the standard deviation of the response there.

use analysis::Complex64;
use anyhow::{Result, ensure};
use maud::html;
use report::page::{axis_chart, drawn, series};
use report::svg::Style;
use serde::Serialize;
use signals::fourier::Forward;

use super::{Method, Needs, Task};
use crate::input::recording::Recording;
use crate::news::News;
use crate::tuning::{DETECTION_LINES, EXCITED, SETTLING};
use crate::words::identified::Identified;
use crate::words::page::Sections;

/// Response at an excited line.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Line {
    /// Hz.
    pub frequency: f64,
    /// |Ω/τ|, (rad/s)/(N·m).
    pub gain: f64,
    /// Degrees.
    pub phase: f64,
    /// Standard deviation of the response by noise.
    pub std_noise: f64,
    /// Standard deviation of the response by odd distortion (another draw of the phases makes another response).
    pub std_distortion: f64,
}

/// Root-mean-square amplitudes of a line, rad/s, by kind of line.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Levels {
    /// Excited lines.
    pub linear: f64,
    /// Noise: variation from period to period, in the mean over the periods.
    pub noise: f64,
    /// Odd lines without power, beyond the noise.
    pub odd: f64,
    /// Even lines, beyond the noise.
    pub even: f64,
}

/// The result.
pub type Found = Identified<Details>;

/// The analysis.
#[derive(Clone, Debug, Serialize)]
pub struct Details {
    /// Periods that were used.
    pub periods: usize,
    /// Excited lines.
    pub lines: Vec<Line>,
    /// Levels over the whole band.
    pub levels: Levels,
    /// Significance of odd and even distortion, in standard deviations of noise alone.
    pub significance: (f64, f64),
}

/// Separates noise from nonlinear distortion.
pub struct Multisine {
    /// Period of the torque, s.
    pub period: f64,
}

impl Method for Multisine {
    type Details = Details;

    const NEEDS: Needs = Needs { fmu: false, validation: false };

    fn identify(&self, task: &Task, _: &mut dyn FnMut(&News)) -> Result<Found> {
        analyse(task.one()?, self.period)
    }

    fn lines(found: &Found) -> Vec<String> {
        let Details { periods, lines, levels, .. } = &found.details;
        vec![format!(
            "{periods} periods, {} lines; a line's rms: response {:.2e} rad/s, noise {:.2e}, odd distortion {:.2e}, even \
             distortion {:.2e}",
            lines.len(),
            levels.linear,
            levels.noise,
            levels.odd,
            levels.even
        )]
    }

    fn sections(found: &Found) -> Sections {
        let lines = &found.details.lines;
        let of = |value: &dyn Fn(&Line) -> f64| -> Vec<(f64, f64)> {
            lines.iter().map(|line| (line.frequency, value(line))).collect()
        };
        let gains = vec![
            series(of(&|line| line.gain), "a", Style::Dots, "response"),
            series(of(&|line| line.std_noise), "soft", Style::Cloud, "standard deviation by noise"),
            series(
                of(&|line| line.std_distortion),
                "b",
                Style::Cloud,
                "standard deviation by odd distortion",
            ),
        ];
        let phases = vec![series(of(&|line| line.phase), "a", Style::Dots, "response")];
        let frequency = "frequency, Hz";
        let figures = html! {
            h2 { "Response at the excited lines" }
            (drawn(&axis_chart("Gain from torque to rate", frequency, "rad/s/(N·m)", gains, true)))
            (drawn(&axis_chart("Phase from torque to rate", frequency, "degrees", phases, false)))
        };
        Sections { figures, ..Sections::default() }
    }
}

/// Analyses a recording of several periods, s each.
pub fn analyse(recording: &Recording, period: f64) -> Result<Found> {
    let (step, torque, rate) = recording.even()?;
    let rows = (period / step).round() as usize;
    let name = &recording.name;
    ensure!(
        rows > 8 && (rows as f64 * step / period - 1.0).abs() < 1e-4,
        "{name}: a period of {period} s is not a whole number of rows {step:.6} s apart"
    );
    let (all, settling) = (torque.len() / rows, (SETTLING / period).ceil() as usize);
    ensure!(
        all >= settling + 2,
        "{name}: {all} whole periods of {period} s; {} are needed, {settling} of them for the start to decay",
        settling + 2
    );
    let periods = all - settling;
    let first = torque.len() - periods * rows;
    let transform = Forward::new(rows);
    let spectra = |signal: &[f64]| -> Vec<Vec<Complex64>> {
        signal[first..]
            .chunks_exact(rows)
            .map(|chunk| {
                // amplitudes
                transform.of(chunk.to_vec()).iter().map(|v| v * (2.0 / rows as f64)).collect()
            })
            .collect()
    };
    let (u, y) = (spectra(&torque), spectra(&rate));
    let mean = |x: &[Vec<Complex64>], k: usize| {
        x.iter().map(|one| one[k]).sum::<Complex64>() / periods as f64
    };
    let noise = |k: usize| {
        let middle = mean(&y, k);
        let sum: f64 = y.iter().map(|one| (one[k] - middle).norm_sqr()).sum();
        sum / (periods * (periods - 1)) as f64
    };
    let power: Vec<f64> = (0..rows / 2).map(|k| mean(&u, k).norm_sqr()).collect();
    let largest = power.iter().skip(1).fold(0.0, |m: f64, p| m.max(*p));
    let all_power: f64 = u.iter().flatten().map(Complex64::norm_sqr).sum::<f64>() / periods as f64;
    ensure!(
        largest > 0.0 && power.iter().sum::<f64>() > 0.9 * all_power,
        "{name}: the torque does not repeat every {period} s"
    );
    let excited: Vec<usize> = (1..power.len()).filter(|&k| power[k] > EXCITED * largest).collect();
    ensure!(
        excited.len() > 2,
        "{name}: the torque has {} lines; a multisine is needed",
        excited.len()
    );
    let even_excited = excited.iter().filter(|k| *k % 2 == 0).count();
    ensure!(
        2 * even_excited < excited.len(),
        "{name}: {even_excited} of {} excited lines are even multiples of 1/{period} s. An odd multisine is \
         needed, or the period is not that of the torque",
        excited.len()
    );
    let band = excited[0]..=excited[excited.len() - 1];
    let quiet = |odd: usize| -> Vec<usize> {
        band.clone().filter(|k| k % 2 == odd && power[*k] <= EXCITED * largest).collect()
    };
    let (odd, even) = (quiet(1), quiet(0));
    ensure!(
        !odd.is_empty(),
        "{name}: every odd line of the band is excited; without detection lines odd distortion cannot be seen"
    );
    let beyond = |k: &usize| mean(&y, *k).norm_sqr() - noise(*k);
    let average = |lines: &[usize], of: &dyn Fn(&usize) -> f64| {
        lines.iter().map(of).sum::<f64>() / lines.len().max(1) as f64
    };
    let lines: Vec<Line> = excited
        .iter()
        .map(|&k| {
            let g = mean(&y, k) / mean(&u, k);
            let place = odd.partition_point(|o| *o < k);
            let near = &odd
                [place.saturating_sub(DETECTION_LINES)..(place + DETECTION_LINES).min(odd.len())];
            let distortion = average(near, &beyond).max(0.0);
            Line {
                frequency: k as f64 / period,
                gain: g.norm(),
                phase: g.arg().to_degrees(),
                std_noise: (noise(k) / power[k]).sqrt(),
                std_distortion: (distortion / power[k]).sqrt(),
            }
        })
        .collect();
    let root = |value: f64| value.max(0.0).sqrt();
    let inside: Vec<usize> = band.clone().collect();
    let levels = Levels {
        linear: root(average(&excited, &|k| mean(&y, *k).norm_sqr())),
        noise: root(average(&inside, &|k| noise(*k))),
        odd: root(average(&odd, &beyond)),
        even: root(average(&even, &beyond)),
    };
    // |Ȳ|² of noise alone is exponential about σ_n²: its mean over N lines has the deviation σ_n²/sqrt(N), and σ_n²
    // itself one of σ_n²/sqrt(N (M − 1))
    let sure = |lines: &[usize]| {
        let floor = average(lines, &|k| noise(*k));
        let spread =
            floor / (lines.len() as f64).sqrt() * (1.0 + 1.0 / (periods as f64 - 1.0)).sqrt();
        average(lines, &beyond) / spread
    };
    let significance = (sure(&odd), sure(&even));
    let verdict = words(&levels, significance);
    Ok(Found { verdict, ..Found::new(Details { periods, lines, levels, significance }) })
}

fn words(levels: &Levels, (odd, even): (f64, f64)) -> Vec<String> {
    let decibels = |level: f64| 20.0 * (level / levels.linear).log10();
    let mut words = vec![format!("Noise is {:.1} dB below the response.", -decibels(levels.noise))];
    for (kind, level, sure, cause) in [
        ("Odd", levels.odd, odd, "dry friction, slosh of large amplitude"),
        ("Even", levels.even, even, "friction that depends on the direction, rotary slosh"),
    ] {
        words.push(if sure > 4.0 {
            format!(
                "{kind} nonlinear distortion is {:.1} dB below the response ({cause}), {:.0} standard deviations of \
                 noise.",
                -decibels(level),
                sure
            )
        } else {
            format!("{kind} nonlinear distortion is not seen above the noise.")
        });
    }
    if levels.odd > levels.noise {
        words.push(
            "Distortion limits the response, not noise: more periods do not help. Use another draw of the phases (--seed), or a \
             model with the nonlinearity."
                .into(),
        );
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uncertainty::bench::design;
    use analysis::linear::Linear;
    use analysis::random::Random;

    /// Seven periods of 50 s of a linear bench whose gyro is bent by `square` ω² + `cube` ω³.
    fn recorded(square: f64, cube: f64) -> Recording {
        let plant = Linear { friction: 0.2, ..Linear::bench_10_cm(0.02) };
        let torque = design::Multisine::new(50.0, (1.25, 3.5), 0.25, 3).unwrap();
        let time: Vec<f64> = (0..7 * 2500).map(|k| 0.02 * f64::from(k)).collect();
        let tau: Vec<f64> = time.iter().map(|&t| torque.at(t)).collect();
        let mut random = Random::new(2, 2);
        let mut rate = plant.simulate(0.02, &tau, 0.0);
        for w in &mut rate {
            *w += square * *w * *w + cube * w.powi(3) + 4e-4 * random.normal();
        }
        Recording::of("multisine", time, tau, rate)
    }

    #[test]
    fn noise_even_and_odd_distortion_are_told_apart() {
        let linear = analyse(&recorded(0.0, 0.0), 50.0).unwrap();
        // three periods are left out, four are used
        assert_eq!(linear.details.periods, 4);
        assert!(
            linear.details.significance.0.abs() < 4.0 && linear.details.significance.1.abs() < 4.0
        );
        // an amplitude of noise: σ sqrt(4/N) a period, over sqrt(4) periods; 100 lines, 3 periods' worth each: 6 %, times 4
        let expected = 4e-4 * (4.0 / 2500.0f64).sqrt() / 2.0;
        assert!(
            (linear.details.levels.noise / expected - 1.0).abs() < 0.25,
            "{:?}",
            linear.details.levels
        );
        for (square, cube) in [(0.5, 0.0), (0.0, 30.0)] {
            let bent = analyse(&recorded(square, cube), 50.0).unwrap();
            let (odd, even) = bent.details.significance;
            let (there, absent) = if cube > 0.0 { (odd, even) } else { (even, odd) };
            assert!(there > 10.0 && absent < 4.0, "{odd} {even}");
            let kind = if cube > 0.0 { "Odd nonlinear" } else { "Even nonlinear" };
            let seen = |line: &String| line.starts_with(kind) && line.contains("dB below");
            assert!(bent.verdict.iter().any(seen), "{:?}", bent.verdict);
        }
    }

    #[test]
    fn records_that_are_not_periodic_are_refused_in_a_sentence() {
        let one = recorded(0.0, 0.0);
        let said = |period: f64| analyse(&one, period).unwrap_err().to_string();
        assert!(said(50.013).contains("not a whole number of rows"), "{}", said(50.013));
        assert!(said(100.0).contains("4 are needed"), "{}", said(100.0));
        // half a period of odd lines is the other half with the other sign
        assert!(said(25.0).contains("does not repeat every 25 s"), "{}", said(25.0));
    }
}
