//! The search of a problem: from starts to a minimum, its noise, its profile and what it leaves.

use analysis::gauss_markov::Noise;
use analysis::innovations::Tests;
use analysis::random::Random;
use anyhow::{Context, Result};

use super::hold::Rival;
use super::minimum::{End, Minimum, places};
use super::problem::{Part, Problem, Role, Signal};
use super::profile::{self, LOWER};
use super::{ENDS, Fit, INFLATIONS};
use crate::news::News;

/// Starts that are drawn where those of the data lead to no minimum.
const DRAWN: usize = 4;
/// Parts of the recordings in a search from a start that leads to no minimum on the whole: over a whole oscillation the sum of squares has a
/// minimum for each cycle, over its beginning only one.
const PARTS: [f64; 5] = [0.1, 0.2, 0.4, 0.7, 1.0];
/// Noise over that of neighbouring rows from which on the residual has more in it than the sensor's noise.
const ABOVE: f64 = 1.5;
/// Rounds of noise, minimum and profile at the end, each from a lower minimum.
const ROUNDS: usize = 3;
/// Drift that the noise may have where a misfit is looked at: white noise over that of rows, size and least time of the drift.
const OWN: (f64, f64, f64) = (1.1, 0.3, 50.0);

/// End of the search of one problem.
pub struct Solution<'p> {
    /// The problem, with the noise and the behaviour between rows that were found.
    pub fit: Fit<'p>,
    /// The minimum.
    pub minimum: Minimum,
    /// The unknown along which the likelihood is no parabola, and its profile.
    pub profile: Option<(usize, Vec<profile::Point>)>,
    /// Other behaviours between rows.
    pub rivals: Vec<Rival>,
    /// Tests of each signal's residual.
    pub tests: Vec<Tests>,
    /// Unknowns at a bound.
    pub at_bound: Vec<usize>,
    /// Number of starts that were tried.
    pub starts: usize,
}

impl Solution<'_> {
    /// Returns true if the residual of every signal is noise of the size that neighbouring rows show.
    pub fn is_noise(&self) -> bool {
        self.tests.iter().all(Tests::passed) && !self.fit.is_loud()
    }
}

/// Searches a problem, first from values that are given besides its starts.
///
/// # Errors
/// If no start leads anywhere.
pub fn solve<'p>(
    problem: &'p Problem<'p>,
    first: Option<Vec<f64>>,
    news: &mut dyn FnMut(&News),
) -> Result<Solution<'p>> {
    let mut fit = Fit::new(problem);
    let mut starts: Vec<Vec<f64>> = first.into_iter().chain(problem.starts.clone()).collect();
    let given = starts.len();
    let mut random = Random::new(26, 0);
    starts.extend((0..DRAWN).map(|_| drawn(problem, &mut random)));
    let mut best: Option<(f64, Minimum, Vec<Noise>, super::Hold, Vec<Rival>)> = None;
    let (mut tried, mut error) = (0, None);
    // the whole at once, then beginnings that grow; what is drawn is the last resort
    let ways = (0..given).map(|k| (k, false)).chain((0..given).map(|k| (k, true)));
    let ways = ways.chain((given..starts.len()).map(|k| (k, true)));
    for (number, grows) in ways {
        tried += 1;
        let z = fit.coordinates(&starts[number]);
        let found = match fit.from_start(&z, grows) {
            Ok(found) => found,
            Err(refused) => {
                error = error.or(Some(refused));
                continue;
            }
        };
        let (minimum, rivals) = found;
        let worst = fit.tests(&minimum.point).iter().map(Tests::worst).fold(0.0, f64::max);
        let deviance = fit.deviance(&minimum.point);
        let is_noise = worst < analysis::innovations::LIMIT && !fit.is_loud();
        let way = if grows { "beginnings that grow" } else { "the whole" };
        news(&News::Detail(format!(
            "start {}, {way}: −2 ln L {deviance:.1}, worst test {worst:.1}, {}, {:.0} simulations",
            number + 1,
            fit.hold.words(),
            fit.simulations()
        )));
        if best.as_ref().is_none_or(|(least, ..)| deviance < *least) {
            best = Some((deviance, minimum, fit.noise.clone(), fit.hold, rivals));
        }
        if is_noise {
            break;
        }
    }
    let Some((_, mut minimum, noise, hold, rivals)) = best else {
        return Err(error.context("no search was made")?);
    };
    (fit.hold, fit.inflation) = (hold, 1.0);
    fit.set(noise, 1.0);
    let mut profile = None;
    let free = fit.free.clone();
    let mut once = false;
    for _ in 0..ROUNDS {
        fit.renew_noise(&minimum.point);
        let z = minimum.point.z.clone();
        minimum = fit.minimise(&z, &free, None, End::new(8, ENDS.1))?;
        let stuck = fit.stuck(&minimum.point.z);
        if !stuck.is_empty() && !once {
            once = true;
            let mut z = minimum.point.z.clone();
            let start = fit.coordinates(&problem.starts[0]);
            stuck.iter().for_each(|j| z[*j] = start[*j]);
            if let Ok(other) = fit.minimise(&z, &free, None, End::new(8, ENDS.0))
                && other.point.cost < minimum.point.cost - LOWER
            {
                minimum = other;
                continue;
            }
        }
        profile = fit.profile(&mut minimum)?;
        let lowest = profile.iter().flat_map(|(_, points)| points);
        let lowest = lowest.min_by(|a, b| a.minimum.point.cost.total_cmp(&b.minimum.point.cost));
        match lowest {
            Some(low) if low.minimum.point.cost < minimum.point.cost - LOWER => {
                news(&News::Detail("the profile led to a lower minimum".into()));
                minimum = low.minimum.clone();
            }
            _ => break,
        }
    }
    fit.derivatives_at(&mut minimum)?;
    let tests = fit.tests(&minimum.point);
    let at_bound = fit.stuck(&minimum.point.z);
    Ok(Solution { fit, minimum, profile, rivals, tests, at_bound, starts: tried })
}

/// A start within the bounds, or within the reach where there are none.
fn drawn(problem: &Problem, random: &mut Random) -> Vec<f64> {
    let first = &problem.starts[0];
    let one = |(unknown, start): (&super::Unknown, &f64)| {
        if unknown.part != Part::Free || !matches!(unknown.role, Role::Run(_)) {
            return *start;
        }
        let end = |value: f64| {
            if unknown.log && value <= 0.0 { f64::NEG_INFINITY } else { unknown.coordinate(value) }
        };
        let z = unknown.coordinate(*start);
        let reach = 3.0 * unknown.reach;
        let (low, high) =
            (end(unknown.bounds.0).max(z - reach), end(unknown.bounds.1).min(z + reach));
        unknown.value(low + (high - low) * random.uniform())
    };
    problem.unknowns.iter().zip(first).map(one).collect()
}

impl Fit<'_> {
    /// Returns true if a signal's noise is more than its neighbouring rows show.
    pub fn is_loud(&self) -> bool {
        self.noise.iter().zip(&self.problem.signals).any(|(n, s)| n.white > ABOVE * s.white)
    }

    /// Free unknowns at a bound.
    pub fn stuck(&self, z: &[f64]) -> Vec<usize> {
        let is_stuck = |j: &usize| {
            let ((low, high), near) = (self.ends[*j], 1e-9 * self.problem.unknowns[*j].reach);
            z[*j] - low < near || high - z[*j] < near
        };
        places(&self.free).into_iter().filter(is_stuck).collect()
    }

    /// Takes the recordings' own noise, where the residual has more in it.
    pub fn limit_noise(&mut self) {
        let own = |(noise, signal): (&Noise, &Signal)| Noise {
            white: noise.white.min(OWN.0 * signal.white),
            drift: noise.drift.min(OWN.1),
            time: noise.time.max(OWN.2),
        };
        let noise = self.noise.iter().zip(&self.problem.signals).map(own).collect();
        self.set(noise, self.part);
    }

    /// The minimum from a start, on the whole recordings with noise that counts less and less, or over beginnings that grow.
    fn from_start(&mut self, z: &[f64], grows: bool) -> Result<(Minimum, Vec<Rival>)> {
        let first = |fit: &Self| -> Vec<Noise> {
            fit.problem.signals.iter().map(Signal::first_noise).collect()
        };
        let free = self.free.clone();
        (self.hold, self.inflation) = (self.problem.holds[0], 1.0);
        let mut z = z.to_vec();
        let mut found: Option<Minimum> = None;
        if grows {
            for part in PARTS {
                let noise = first(self);
                self.set(noise, part);
                self.inflation = if part < 1.0 { 10.0 } else { 1.0 };
                let minimum = self.minimise(&z, &free, None, End::new(8, ENDS.0))?;
                z.clone_from(&minimum.point.z);
                found = Some(minimum);
            }
        } else {
            let noise = first(self);
            self.set(noise, 1.0);
            for inflation in INFLATIONS {
                self.inflation = inflation;
                let sets = if inflation > 1.0 { 8 } else { 4 };
                let searched = self.minimise(&z, &free, None, End::new(sets, ENDS.0));
                self.inflation = 1.0;
                let minimum = searched?;
                z.clone_from(&minimum.point.z);
                if inflation == INFLATIONS[1] {
                    self.renew_noise(&minimum.point);
                }
                found = Some(minimum);
            }
        }
        self.inflation = 1.0;
        let found = found.context("a search has a part")?;
        let (found, rivals) = self.compare_holds(found)?;
        self.renew_noise(&found.point);
        let minimum = self.minimise(&found.point.z, &free, None, End::new(10, ENDS.0 * 0.1))?;
        Ok((minimum, rivals))
    }
}
