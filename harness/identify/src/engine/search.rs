//! The search of a problem: from starts to a minimum, its noise, its profile and the tests of its residual.

use analysis::gauss_markov::Noise;
use analysis::innovations::Tests;
use analysis::random::Random;
use analysis::statistics::deviation;
use anyhow::{Context, Result, ensure};

use super::hold::Rival;
use super::minimum::{Curvature, End, Minimum, places, without};
use super::problem::{Part, Problem, Role, Signal, Unknown};
use super::profile::{self, Profile};
use super::{ALIKE, DECIDES, ENDS, Fit, GAIN, Hold, INFLATIONS, PRIOR_ALONE, ROUNDS, SETS};
use crate::news::News;

/// Fractions of the recordings that a search fits one after the other. Over a whole oscillation the sum of squares has a minimum
/// for each cycle, over its beginning only one.
const PARTS: [f64; 7] = [0.1, 0.2, 0.3, 0.4, 0.55, 0.75, 1.0];
/// Smallest noise that is assumed for the beginning of a recording of an arbitrary FMU, relative to the standard deviation of the
/// signal. With the noise of a precise sensor the first steps would drive unknowns to their bounds.
const BEGINNING_NOISE: f64 = 0.03;
/// Ratio of the residual's white noise to the noise between neighbouring rows, above which the residual is more than
/// noise of the sensor.
pub(super) const ABOVE: f64 = 1.5;
/// Sum of squares per row above which the alternation between noise and minimum ends. The sum of squares per row is 1 if the noise
/// matches the residual.
const SETTLED: f64 = 0.98;
/// First distance at which the likelihood on one side of an initial value is examined, standard deviations.
const FAR: f64 = 3.0;
/// At `FAR` standard deviations from the minimum, the square root of the rise of −2 ln L is equal to `FAR` if −2 ln L is a
/// parabola. Below this fraction of `FAR`, the likelihood has a kink.
const KINKED: f64 = 0.8;
/// A search from one start is given up if its sum of squares is more than three times (second number) the sum of squares of
/// the best search over the same part of the recordings. Parts of at most a quarter of the recordings (first number) are
/// not compared.
const ASTRAY: (f64, f64) = (0.25, 3.0);
/// Limits of the estimated noise while the cause of a misfit is searched, so that the misfit is not taken for noise:
/// largest white noise relative to the noise between neighbouring rows, largest standard deviation of the drift relative to
/// the white noise, and smallest correlation time of the drift, s.
pub(super) const OWN: (f64, f64, f64) = (1.1, 0.3, 50.0);

pub struct Solution<'p> {
    /// The problem with the noise and the intersample behaviour that were found.
    pub fit: Fit<'p>,
    pub minimum: Minimum,
    pub profile: Option<Profile>,
    /// Intersample behaviours that were not chosen.
    pub rivals: Vec<Rival>,
    pub tests: Vec<Tests>,
    pub at_bound: Vec<usize>,
    /// Initial values of recordings at which the likelihood has a kink, so that an interval is wider than the curvature
    /// predicts. The two numbers are the standard deviation on the lower and on the upper side, divided by the standard
    /// deviation from the curvature.
    pub sides: Vec<(usize, [f64; 2])>,
    pub starts: usize,
}

impl<'p> Solution<'p> {
    /// Creates the solution at a minimum that needs no search, for example of a planned recording.
    pub fn at(fit: Fit<'p>, minimum: Minimum) -> Self {
        let (rivals, tests, at_bound, sides) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Solution { fit, minimum, profile: None, rivals, tests, at_bound, sides, starts: 1 }
    }

    /// Returns true if the residual of every signal passes the tests for noise, and is not clearly larger than the
    /// noise between neighbouring rows.
    pub fn is_noise(&self) -> bool {
        self.tests.iter().all(Tests::passed) && !self.fit.is_loud()
    }

    /// Returns the value of −2 ln L above which another model is clearly worse, so that its search can end early. It is infinite
    /// if the residual of this solution is more than noise; otherwise it is the −2 ln L for a noise that is e^0.5 times as large.
    pub fn ceiling(&self) -> f64 {
        if !self.is_noise() {
            return f64::INFINITY;
        }
        self.fit.deviance(&self.minimum.point) + self.fit.sampled() as f64
    }
}

/// Searches the minimum of a problem from the values `first`, if there are any, and from the starts of the problem. `first` also
/// holds the intersample behaviour that is assumed at first.
///
/// A finite `ceiling` means that `first` comes from another model, which fits. The search then begins with the whole
/// recordings. If its minimum has a −2 ln L above the ceiling, the search ends without a comparison of intersample behaviours
/// and without a profile.
///
/// # Errors
/// If the search fails from every start.
pub fn solve<'p>(
    problem: &'p Problem<'p>,
    first: Option<(Vec<f64>, Hold)>,
    ceiling: f64,
    news: &mut dyn FnMut(&News),
) -> Result<Solution<'p>> {
    let mut fit = Fit::new(problem);
    let (first, hold) = first.map_or((None, problem.holds[0]), |(z, hold)| (Some(z), hold));
    let mut starts: Vec<Vec<f64>> = first.into_iter().chain(problem.starts.clone()).collect();
    let given = starts.len();
    let mut random = Random::new(26, 0);
    starts.extend((0..problem.drawn).map(|_| drawn(problem, &mut random)));
    let mut best: Option<Found> = None;
    // the start that led to the best minimum, and whether another one led to it too
    let (mut winner, mut is_confirmed) = (0, false);
    let (mut tried, mut error, mut course): (usize, _, Vec<(f64, f64)>) = (0, None, Vec::new());
    let ways = [(0..given, &PARTS[..]), (0..1, &[]), (given..starts.len(), &PARTS)];
    for (number, parts) in ways.into_iter().flat_map(|(all, parts)| all.map(move |k| (k, parts))) {
        let is_whole = parts.is_empty();
        if let Some(best) = best.as_mut().filter(|_| number == 0 && is_whole || number == given) {
            // the starts of the problem have led to no lower minimum: random starts are the last resort
            best.judge(&mut fit, ceiling, news)?;
            let is_found = number >= given && (!best.is_loud || is_confirmed);
            if best.is_noise || is_found || best.deviance > ceiling {
                break;
            }
        }
        tried += 1;
        let z = fit.coordinates(&starts[number]);
        let is_near = number == 0 && ceiling.is_finite() && !is_whole;
        let parts = if is_near { &PARTS[PARTS.len() - 1..] } else { parts };
        let mut own = Vec::new();
        let found = match fit.search_from(&z, hold, parts, &course, &mut own) {
            Ok(found) => found,
            Err(refused) => {
                error = error.or(Some(refused));
                continue;
            }
        };
        let deviance = match (&found, &best) {
            (Some(found), _) => fit.deviance(&found.point),
            (None, best) => best.as_ref().map_or(f64::INFINITY, |best| best.first),
        };
        let way = if parts.len() > 1 { "beginnings that grow" } else { "the whole" };
        news(&News::Detail(format!(
            "start {}, {way}: −2 ln L {deviance:.1}, {:.0} simulations",
            number + 1,
            fit.simulations()
        )));
        // a minimum that only one search has found may be a local one, unless its sum of squares is next to nothing
        let is_least = found.as_ref().is_some_and(|found| found.point.cost < DECIDES);
        let agrees =
            best.as_ref().is_some_and(|best| (best.first - deviance).abs() < 2.0 * DECIDES);
        is_confirmed |= agrees && number != winner;
        if let Some(found) = found
            && best.as_ref().is_none_or(|best| deviance < best.first)
        {
            (best, course) = (Some(Found::new(&fit, found, deviance)), own);
            (winner, is_confirmed) = (number, is_confirmed && agrees);
        }
        if let Some(best) = best.as_mut().filter(|best| is_least || agrees || best.first > ceiling)
        {
            best.judge(&mut fit, ceiling, news)?;
            if best.is_noise || best.deviance > ceiling {
                break;
            }
        }
    }
    let Some(mut best) = best else {
        return Err(error.context("the search could not start")?);
    };
    best.judge(&mut fit, ceiling, news)?;
    conclude(fit, best, tried, ceiling, news)
}

/// Searches a problem from values that are near its minimum, such as the minimum of the same problem with fewer rows.
///
/// # Errors
/// If the system refuses the values.
pub fn solve_near<'p>(
    problem: &'p Problem<'p>,
    values: &[f64],
    news: &mut dyn FnMut(&News),
) -> Result<Solution<'p>> {
    let mut fit = Fit::new(problem);
    let (z, free) = (fit.coordinates(values), fit.free.clone());
    let minimum = fit.minimise(&z, &free, None, End::new(SETS, ENDS.0))?;
    fit.renew_noise(&minimum.point);
    let mut found = Found::new(&fit, minimum, 0.0);
    found.judge(&mut fit, f64::INFINITY, news)?;
    conclude(fit, found, 1, f64::INFINITY, news)
}

fn conclude<'p>(
    mut fit: Fit<'p>,
    found: Found,
    starts: usize,
    ceiling: f64,
    news: &mut dyn FnMut(&News),
) -> Result<Solution<'p>> {
    let is_beaten = found.deviance > ceiling;
    let Found { mut minimum, rivals, .. } = found;
    let mut profile = None;
    if !is_beaten {
        profile = fit.refine(&mut minimum, news)?;
        fit.derivatives_at(&mut minimum)?;
    }
    let tests = fit.tests(&minimum.point);
    let at_bound = fit.stuck(&minimum.point.z);
    let is_kinked = !is_beaten && !fit.problem.rough;
    let sides = if is_kinked { fit.sides(&minimum) } else { Vec::new() };
    Ok(Solution { fit, minimum, profile, rivals, tests, at_bound, sides, starts })
}

struct Found {
    minimum: Minimum,
    noise: Vec<Noise>,
    hold: Hold,
    rivals: Vec<Rival>,
    /// Value of −2 ln L with the intersample behaviour that is assumed at first.
    first: f64,
    /// Value of −2 ln L with the best intersample behaviour.
    deviance: f64,
    is_judged: bool,
    is_noise: bool,
    is_loud: bool,
}

impl Found {
    fn new(fit: &Fit, minimum: Minimum, first: f64) -> Self {
        Found {
            minimum,
            noise: fit.noise.clone(),
            hold: fit.hold,
            rivals: Vec::new(),
            first,
            deviance: first,
            is_judged: false,
            is_noise: false,
            is_loud: fit.is_loud(),
        }
    }

    /// Compares the intersample behaviours and tests the residual of the best one. The fit then uses the best one and its noise.
    /// Does nothing if −2 ln L is above the `ceiling`.
    fn judge(&mut self, fit: &mut Fit, ceiling: f64, news: &mut dyn FnMut(&News)) -> Result<()> {
        (fit.hold, fit.inflation) = (self.hold, 1.0);
        fit.set(self.noise.clone(), 1.0);
        if self.is_judged || self.first > ceiling {
            return Ok(());
        }
        let (minimum, rivals) = fit.compare_holds(self.minimum.clone())?;
        (self.minimum, self.rivals) = (minimum, rivals);
        fit.renew_noise(&self.minimum.point);
        let end = End { gain: ALIKE, ..End::new(SETS / 2, ENDS.0) };
        self.minimum = fit.minimise_from(&self.minimum.point, end)?;
        (self.noise, self.hold, self.is_judged) = (fit.noise.clone(), fit.hold, true);
        self.deviance = fit.deviance(&self.minimum.point);
        (self.is_noise, self.is_loud) = (fit.is_noise(&self.minimum.point), fit.is_loud());
        news(&News::Detail(format!(
            "{}: worst test {:.1}, {:.0} simulations",
            fit.hold.words(),
            fit.tests(&self.minimum.point).iter().map(Tests::worst).fold(0.0, f64::max),
            fit.simulations()
        )));
        Ok(())
    }
}

/// Draws a random start within the bounds and within three times the `reach` of each unknown.
fn drawn(problem: &Problem, random: &mut Random) -> Vec<f64> {
    let first = &problem.starts[0];
    let one = |(unknown, start): (&super::Unknown, &f64)| {
        if unknown.part != Part::Free || !matches!(unknown.role, Role::Run(_)) {
            return *start;
        }
        let (z, reach) = (unknown.coordinate(*start), 3.0 * unknown.reach);
        let (low, high) = unknown.ends();
        let (low, high) = (low.max(z - reach), high.min(z + reach));
        unknown.value(low + (high - low) * random.uniform())
    };
    problem.unknowns.iter().zip(first).map(one).collect()
}

impl Fit<'_> {
    /// Returns true if the estimated white noise of a signal is clearly larger than the noise between neighbouring rows.
    pub fn is_loud(&self) -> bool {
        self.noise.iter().zip(&self.problem.signals).any(|(n, s)| n.white > ABOVE * s.own_noise())
    }

    /// Returns the number of measured values, over all signals.
    pub fn sampled(&self) -> usize {
        self.problem.signals.iter().map(Signal::measured_row_count).sum()
    }

    pub fn stuck(&self, z: &[f64]) -> Vec<usize> {
        let is_stuck = |j: &usize| {
            let ((low, high), near) = (self.ends[*j], 1e-9 * self.problem.unknowns[*j].reach);
            z[*j] - low < near || high - z[*j] < near
        };
        places(&self.free).into_iter().filter(is_stuck).collect()
    }

    /// Returns the distance of all known values from their stated values: the root of the sum of squares of their differences,
    /// each over its standard deviation.
    pub fn pull(&self, z: &[f64]) -> f64 {
        let known = self.problem.unknowns.iter().zip(z).filter(|(u, _)| u.is_known());
        let own = known.filter_map(|(u, z)| u.prior.map(|(mean, std)| ((z - mean) / std).powi(2)));
        own.sum::<f64>().sqrt()
    }

    /// Returns the minimum, or a lower one: if a start of the problem has a smaller sum of squares than the minimum, the search
    /// is repeated from this start.
    ///
    /// # Errors
    /// If the system refuses every step of an unknown.
    pub fn not_above_starts(&mut self, mut minimum: Minimum) -> Result<Minimum> {
        for start in &self.problem.starts {
            let Ok(point) = self.at(&self.coordinates(start)) else { continue };
            if point.cost < minimum.point.cost - GAIN {
                let (free, end) = (self.free.clone(), End::new(SETS, ENDS.0));
                minimum = self.minimise_on(point, &free, None, end)?;
            }
        }
        Ok(minimum)
    }

    /// Limits the estimated noise to about the noise between neighbouring rows, so that the misfit of a model is
    /// not taken for noise.
    pub fn limit_noise(&mut self) {
        let own = |(noise, signal): (&Noise, &Signal)| Noise {
            white: noise.white.min(OWN.0 * signal.own_noise()),
            drift: noise.drift.min(OWN.1),
            time: noise.time.max(OWN.2),
        };
        let noise = self.noise.iter().zip(&self.problem.signals).map(own).collect();
        self.set(noise, self.part);
    }

    /// Completes a minimum: frees known values that the recordings determine better than their tolerances, looks for lower minima
    /// across ridges and along the profile, and frees the tolerances if the residual is noise only then. Returns the profile.
    ///
    /// # Errors
    /// If the system refuses the minimum.
    fn refine(
        &mut self,
        minimum: &mut Minimum,
        news: &mut dyn FnMut(&News),
    ) -> Result<Option<Profile>> {
        let mut at = self.not_above_starts(minimum.clone())?;
        self.free_shown(&mut at)?;
        let beyond = self.across_ridges(&mut at)?;
        let (mut found, mut profile) = self.settle(at, &beyond, news)?;
        if let Some(other) = self.with_tolerances(&found)? {
            news(&News::Detail(
                "changing known values within their tolerances makes the residual noise".into(),
            ));
            (found, profile) = self.settle(other, &[], news)?;
        }
        self.derivatives_at(&mut found)?;
        if profile.is_none() && self.find_bent(&mut found)? {
            (found, profile) = self.settle(found, &[], news)?;
        }
        *minimum = found;
        Ok(profile)
    }

    /// Estimates the noise and searches the minimum in turn, until the noise matches the residual. Returns the minimum and
    /// the profile of the bent unknown. `beyond` are points that may lie outside the range of this profile.
    ///
    /// # Errors
    /// If the system refuses the minimum.
    fn settle(
        &mut self,
        mut minimum: Minimum,
        beyond: &[profile::Point],
        news: &mut dyn FnMut(&News),
    ) -> Result<(Minimum, Option<Profile>)> {
        let free = self.free.clone();
        let (mut once, mut profile) = (false, None);
        let rows = self.sampled();
        for _ in 0..ROUNDS {
            for turn in 0..SETS {
                let before = self.noise.clone();
                self.renew_noise(&minimum.point);
                if turn > 0 && self.noise.iter().zip(before).all(|(n, b)| n.white == b.white) {
                    // the noise no longer changes, because it is at its lower limit
                    break;
                }
                let end = End { gain: GAIN, ..End::new(SETS, ENDS.1) };
                minimum = self.minimise_from(&minimum.point, end)?;
                // the minimum belongs to the noise estimated before it, which matters if the new noise is next to nothing
                if minimum.point.cost > SETTLED * rows as f64 {
                    break;
                }
            }
            let stuck = self.stuck(&minimum.point.z);
            if !stuck.is_empty() && !once {
                once = true;
                let mut z = minimum.point.z.clone();
                let start = self.coordinates(&self.problem.starts[0]);
                stuck.iter().for_each(|j| z[*j] = start[*j]);
                if let Ok(other) = self.minimise(&z, &free, None, End::new(SETS, ENDS.0))
                    && other.point.cost < minimum.point.cost - GAIN
                {
                    minimum = other;
                    continue;
                }
            }
            profile = self.profile(&mut minimum, beyond)?;
            let Some((j, points)) = &profile else { break };
            // the likelihood along the profile is known, and the other unknowns are at their minimum
            let others = without(&free, *j);
            let lowest = profile::lowest(points);
            let fall = lowest.map_or(0.0, |low| minimum.point.cost - low.minimum.point.cost);
            if let Some(low) = lowest.filter(|_| fall > 0.0) {
                minimum = Minimum { derivatives: None, free: free.clone(), ..low.minimum.clone() };
            }
            if fall <= ALIKE {
                minimum.decrement = self.decrement(&mut minimum, &others)?;
                break;
            }
            news(&News::Detail("the profile led to a lower minimum".into()));
        }
        if minimum.decrement > ENDS.0 {
            // one-sided differences may gain little although the minimum is lower, so central ones are tried
            self.central = true;
            let others =
                profile.as_ref().map_or_else(|| free.clone(), |(bent, _)| without(&free, *bent));
            let z = minimum.point.z.clone();
            let found = self.minimise(&z, &others, None, End::new(SETS, ENDS.0 * 0.2))?;
            minimum = Minimum { derivatives: None, free, ..found };
        }
        Ok((minimum, profile))
    }

    /// Frees the known values that the recordings determine about as well as their tolerances do. This happens if slosh is
    /// nonlinear, or if an encoder shows the error of the clock.
    ///
    /// # Errors
    /// If the system refuses the minimum.
    fn free_shown(&mut self, minimum: &mut Minimum) -> Result<()> {
        let unknowns = &self.problem.unknowns;
        let held: Vec<bool> =
            unknowns.iter().zip(&self.free).map(|(u, free)| u.is_held() && !free).collect();
        let own = self.derivatives_at(minimum)?.matrix;
        let known = self.derivatives(&minimum.point, &held)?.matrix;
        let covariance = Curvature::new(&own, places(&self.free)).covariance(unknowns.len());
        let rows = own.nrows() - self.priors();
        for j in places(&held) {
            let column = known.column(j).into_owned();
            let rest = &column - &own * (&covariance * own.tr_mul(&column));
            let told = rest.rows(0, rows).norm();
            let left = |std: f64| 1.0 / (told * std).hypot(1.0);
            self.free[j] = unknowns[j].prior.is_some_and(|(_, std)| left(std) < PRIOR_ALONE);
        }
        if self.free != minimum.free {
            minimum.derivatives = None;
            minimum.free.clone_from(&self.free);
        }
        Ok(())
    }

    /// Computes [`Solution::sides`]. If dry friction stops the hub before the first fitted row, the likelihood has a kink
    /// at the initial rate, and is flat beyond the kink.
    fn sides(&mut self, minimum: &Minimum) -> Vec<(usize, [f64; 2])> {
        let unknowns = &self.problem.unknowns;
        let is_start = |j: &usize| matches!(unknowns[*j].role, Role::Run(Some(_)));
        let starts: Vec<usize> = places(&self.free).into_iter().filter(is_start).collect();
        let Some(found) = minimum.derivatives.as_ref().filter(|_| !starts.is_empty()) else {
            return Vec::new();
        };
        let covariance =
            Curvature::new(&found.matrix, places(&self.free)).covariance(unknowns.len());
        let mut side = |j: usize, sign: f64| {
            let std = covariance[(j, j)].sqrt();
            let free = without(&self.free, j);
            // square root of the rise of the sum of squares at this number of standard deviations, with the other
            // unknowns at their minimum
            let mut rise = |deviations: f64| {
                let by = sign * deviations / std;
                let z: Vec<f64> = (0..unknowns.len())
                    .map(|i| minimum.point.z[i] + by * covariance[(i, j)])
                    .collect();
                let there = self.minimise(&z, &free, minimum.derivatives.clone(), End::new(1, 0.3));
                let cost = there.map_or(f64::INFINITY, |there| there.point.cost);
                (cost - minimum.point.cost).max(0.0).sqrt()
            };
            let (mut near, mut far, mut now) = ((0.0, 0.0), FAR, rise(FAR));
            for _ in 0..SETS {
                if now > KINKED * FAR {
                    break;
                }
                near = (far, now);
                far *= 2.0;
                now = rise(far);
            }
            let part = ((FAR - near.1) / (now - near.1)).clamp(0.0, 1.0);
            ((near.0 + part * (far - near.0)) / FAR).max(1.0)
        };
        starts.into_iter().map(|j| (j, [side(j, -1.0), side(j, 1.0)])).collect()
    }

    /// Returns true if the residual of every signal at a point passes the tests for noise, and is not clearly larger than the
    /// noise between neighbouring rows.
    pub fn is_noise(&self, point: &super::fit::Point) -> bool {
        self.tests(point).iter().all(Tests::passed) && !self.is_loud()
    }

    /// Searches the minimum once more with the known values free within their tolerances. Returns this minimum if its
    /// residual is noise, for example because nonlinear slosh determines a known value better than its tolerance.
    /// Otherwise, or if the residual is noise already, the known values stay fixed, and the function returns `None`.
    ///
    /// # Errors
    /// If the system refuses the minimum.
    fn with_tolerances(&mut self, minimum: &Minimum) -> Result<Option<Minimum>> {
        let unknowns = &self.problem.unknowns;
        if self.is_noise(&minimum.point) || !unknowns.iter().any(Unknown::is_held) {
            return Ok(None);
        }
        let all = unknowns.iter().zip(&self.free).map(|(u, free)| *free || u.is_held()).collect();
        let (free, noise) = (std::mem::replace(&mut self.free, all), self.noise.clone());
        self.limit_noise();
        let first = self.minimise_from(&minimum.point, End::new(10, ENDS.0 * 0.1))?;
        self.renew_noise(&first.point);
        let end = End { gain: GAIN, ..End::new(SETS, ENDS.1) };
        let found = self.minimise_from(&first.point, end)?;
        if self.is_noise(&found.point) {
            return Ok(Some(found));
        }
        self.free = free;
        self.set(noise, 1.0);
        Ok(None)
    }

    /// Searches the minimum from the start `z`. If `parts` contains fractions of the recordings, these growing parts are
    /// fitted one after the other. If `parts` is empty, the whole recordings are fitted several times, with noise that is
    /// first multiplied by a large factor ([`INFLATIONS`]). `own` receives each fraction with its smallest sum of squares;
    /// `best` contains these pairs for the best search so far. Returns `None` if the search approaches the minimum of the
    /// best search.
    fn search_from(
        &mut self,
        z: &[f64],
        hold: Hold,
        parts: &[f64],
        best: &[(f64, f64)],
        own: &mut Vec<(f64, f64)>,
    ) -> Result<Option<Minimum>> {
        let mut noise: Vec<Noise> = self.problem.signals.iter().map(Signal::first_noise).collect();
        let free = self.free.clone();
        (self.hold, self.inflation, self.central) = (hold, 1.0, self.problem.rough);
        let mut z = z.to_vec();
        let mut found: Option<Minimum> = None;
        if !parts.is_empty() {
            if self.problem.rough {
                for (noise, signal) in noise.iter_mut().zip(&self.problem.signals) {
                    let spread = deviation(&signal.picked(&signal.measured));
                    noise.white = noise.white.max(BEGINNING_NOISE * spread);
                }
            }
            for &part in parts {
                self.set(noise.clone(), part);
                // if a second model fits as well as the first one, its minimum is near the minimum of the first one
                let sets = if parts.len() > 1 { SETS } else { SETS / 2 };
                let end = End { gain: ALIKE, ..End::new(sets, ENDS.0) };
                let minimum = self.minimise(&z, &free, None, end)?;
                let cost = minimum.point.cost;
                own.push((part, cost));
                let before = best.iter().find(|(other, _)| *other == part && part > ASTRAY.0);
                if let Some((_, best)) = before {
                    ensure!(cost < ASTRAY.1 * best, "the fit is far worse than from another start");
                    if minimum.decrement < ENDS.0 && (cost - best).abs() < ALIKE {
                        return Ok(None);
                    }
                }
                z.clone_from(&minimum.point.z);
                found = Some(minimum);
            }
            if let Some(minimum) = &found {
                self.renew_noise(&minimum.point);
                let is_less = |(n, first): (&Noise, &Noise)| n.white < 0.5 * first.white;
                if self.problem.rough || self.noise.iter().zip(&noise).any(is_less) {
                    let end = End { gain: ALIKE, ..End::new(2 * SETS, ENDS.0) };
                    found = Some(self.minimise(&z, &free, None, end)?);
                }
            }
        } else {
            self.set(noise, 1.0);
            for inflation in INFLATIONS {
                self.inflation = inflation;
                let sets = if inflation > 1.0 { SETS } else { SETS / 2 };
                let end = End { gain: ALIKE, ..End::new(sets, ENDS.0) };
                let minimum = self.minimise(&z, &free, None, end)?;
                z.clone_from(&minimum.point.z);
                if inflation == INFLATIONS[1] {
                    self.renew_noise(&minimum.point);
                }
                found = Some(minimum);
            }
        }
        self.inflation = 1.0;
        let mut found = found.context("a search has a part")?;
        self.renew_noise(&found.point);
        found.point = self.point(&found.point.z, std::mem::take(&mut found.point.motion));
        found.derivatives = None;
        Ok(Some(found))
    }
}
