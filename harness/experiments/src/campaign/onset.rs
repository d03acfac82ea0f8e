//! Search for the onset of rotary slosh: the smallest amplitude of a sine torque with which the slosh becomes
//! rotary at any frequency.
//!
//! At each amplitude the search simulates dwells (runs at constant frequency) at all frequencies of a grid, and it bisects
//! the amplitude. The dwells have the settings, the duration and the initial state of the plan.

use anyhow::{Result, ensure};
use files::budget;
use host::fmu::Fmu;
use names::hubslosh::{SLOSH_ANGLE, SLOSH_ANGLE_RADIAL, slosh};
use rayon::prelude::*;

use super::{is_bench, outcome};
use crate::plan::{Case, Plan};
use crate::profile::Written;
use crate::progress::Progress;

const APART: f64 = 0.0025;
const WITHIN: f64 = 0.0025;
/// Number of grid steps by which the searched range of frequencies is extended at both ends when the torque is
/// reduced. The range contains the frequencies with rotary slosh at the previous, larger torque.
const MARGIN: usize = 3;

#[derive(Clone, Copy)]
struct Dwell {
    rotary: bool,
    angle: f64,
}

/// Result of a search for the onset of rotary slosh: its frequency, Hz, the largest torque without rotary slosh and the
/// smallest torque with it, N·m. If no torque makes the slosh rotary, both torques are missing, and the frequency is the
/// frequency with the largest slosh angle.
#[derive(Debug, PartialEq)]
struct Found {
    frequency: f64,
    torques: Option<[f64; 2]>,
}

/// Replaces the `[onset]` of a plan by dwells, which are sine torques of constant frequency, at the onset of rotary slosh
/// that it finds. Does nothing for a plan without `[onset]`. `jobs` dwells are simulated in parallel, or as many as there
/// are cores if it is 0.
pub fn seek_onset(
    plan: &mut Plan,
    fmu: &Fmu,
    jobs: usize,
    watch: &(dyn Fn(Progress) + Sync),
) -> Result<()> {
    let Some(onset) = plan.pending_onset() else { return Ok(()) };
    ensure!(is_bench(fmu.description()), "[onset] is possible only with HubSlosh (the bench)");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(budget::jobs(jobs, 0)?).build()?;
    let ends = [onset.amplitude[0], onset.amplitude[onset.amplitude.len() - 1]];
    let mut dwells = Vec::new();
    for case in plan.seeking(fmu.description())? {
        let dwell = |frequency: f64, torque: f64| dwell(fmu, &case, frequency, torque);
        let found = pool.install(|| search(onset.frequency, ends, &dwell))?;
        let varied = plan.varied().into_iter().zip(&case.varied);
        let name: Vec<String> = varied.map(|(name, value)| format!("{name} = {value}, ")).collect();
        let name = name.concat();
        watch(Progress::Note(match found.torques {
            Some([low, high]) => format!(
                "{name}onset of rotary slosh between {low} and {high} N·m, at {} Hz",
                found.frequency
            ),
            None => format!(
                "{name}no rotary slosh up to {} N·m; largest slosh angle at {} Hz",
                ends[1], found.frequency
            ),
        }));
        let mut torques = onset.amplitude.clone();
        torques.extend(found.torques.iter().flatten());
        torques.sort_by(f64::total_cmp);
        torques.dedup();
        dwells.push((case, found.frequency, torques));
    }
    plan.dwell(dwells);
    Ok(())
}

fn dwell(fmu: &Fmu, case: &Case, frequency: f64, torque: f64) -> Result<Dwell> {
    let mut profile: Written = case.profile.parse()?;
    profile.set("frequency", &frequency.to_string());
    profile.set("amplitude", &torque.to_string());
    let mut run = case.run();
    run.torque = profile.torque()?;
    let mut instance = run.initialise(fmu)?;
    let natural = instance.real(&slosh::FREQUENCY.element([1]))?;
    let table = run.drive(&mut instance, &[SLOSH_ANGLE_RADIAL, SLOSH_ANGLE], |_| {})?;
    table.all_finite()?;
    let angles = table.column(SLOSH_ANGLE).unwrap_or_default();
    Ok(Dwell {
        rotary: outcome::rotary_in_time(run.step, natural, &table).time > 0.0,
        angle: angles.iter().fold(0.0, |most: f64, angle| most.max(angle.abs())),
    })
}

/// Searches the onset of rotary slosh between two frequencies, Hz, and two torque amplitudes, N·m.
fn search(
    band: [f64; 2],
    [mut low, mut high]: [f64; 2],
    dwell: &(dyn Fn(f64, f64) -> Result<Dwell> + Sync),
) -> Result<Found> {
    // removes rounding errors of binary fractions
    let rounded = |value: f64| (value * 1e6).round() / 1e6;
    let steps = ((band[1] - band[0]) / APART).round() as usize;
    let grid: Vec<f64> = (0..=steps).map(|k| rounded(band[0] + k as f64 * APART)).collect();
    let scan = |from: usize, to: usize, torque: f64| -> Result<Vec<Dwell>> {
        grid[from..=to].par_iter().map(|frequency| dwell(*frequency, torque)).collect()
    };
    let rotary = |from: usize, dwells: &[Dwell]| -> Vec<usize> {
        (0..dwells.len()).filter(|k| dwells[*k].rotary).map(|k| from + k).collect()
    };
    let all = scan(0, steps, high)?;
    let mut those = rotary(0, &all);
    if those.is_empty() {
        let largest = (0..=steps).max_by(|a, b| all[*a].angle.total_cmp(&all[*b].angle));
        let frequency = grid[largest.unwrap_or(0)];
        return Ok(Found { frequency, torques: None });
    }
    ensure!(
        rotary(0, &scan(0, steps, low)?).is_empty(),
        "[onset] amplitude: the slosh is rotary at the smallest torque already, {low} N·m; add a smaller one"
    );
    while high - low > WITHIN {
        let middle = rounded((low + high) / 2.0);
        let from = those[0].saturating_sub(MARGIN);
        let to = (those[those.len() - 1] + MARGIN).min(steps);
        match rotary(from, &scan(from, to, middle)?) {
            none if none.is_empty() => low = middle,
            some => (high, those) = (middle, some),
        }
    }
    let at = those[those.len() / 2];
    ensure!(
        (1..steps).contains(&at),
        "[onset] frequency: rotary slosh begins at the end of the range, {} Hz; widen the range",
        grid[at]
    );
    Ok(Found { frequency: grid[at], torques: Some([low, high]) })
}

#[cfg(test)]
mod tests {
    use super::{Dwell, Found, WITHIN, search};

    #[test]
    fn the_onset_is_the_smallest_torque_with_rotary_slosh() {
        // the range of frequencies with rotary slosh begins with 0.06 N·m at 2.4 Hz, and becomes wider and
        // shifts with the torque
        let dwell = |frequency: f64, torque: f64| {
            let (low, high) = (2.4 - 0.8 * (torque - 0.06), 2.4 + 0.3 * (torque - 0.06));
            let rotary = torque >= 0.06 && (low - 1e-9..high + 1e-9).contains(&frequency);
            Ok(Dwell { rotary, angle: torque / (0.01 + (frequency - 2.42).abs()) })
        };
        let found = search([2.3, 2.5], [0.03, 0.14], &dwell).unwrap();
        let [low, high] = found.torques.unwrap();
        assert!(low < 0.06 && high >= 0.06 && high - low <= WITHIN, "{found:?}");
        assert_eq!(found.frequency, 2.4);
        let beyond = search([2.3, 2.5], [0.07, 0.14], &dwell).unwrap_err().to_string();
        assert!(beyond.contains("at the smallest torque already, 0.07 N·m"), "{beyond}");
        let aside = search([2.4, 2.5], [0.03, 0.14], &dwell).unwrap_err().to_string();
        assert!(aside.contains("widen the range"), "{aside}");
        let none = search([2.3, 2.5], [0.03, 0.05], &dwell).unwrap();
        assert_eq!(none, Found { frequency: 2.42, torques: None });
    }
}
