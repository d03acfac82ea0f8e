//! The search for a model's minimum: where it starts, over which part of the recording, and when another attempt is
//! made. The attempts are data ([`Search::attempts`]), tried in their order and told in words.

use anyhow::{Result, bail};
use nalgebra::DMatrix;

use crate::fit::{Polished, Problem, WHOLE, WINDOWS};
use crate::friction;
use crate::goodness::{fit_pct, is_poor, tests};
use crate::recording::Recording;
use crate::residual::Tests;
use crate::simulate::Intersample;
use crate::stribeck::Places;
use crate::unknown::Quantity;

/// Sum of squares over the rows beyond which a model near another one, which leaves only noise, is given up.
const HOPELESS: f64 = 1.5;

/// By how much less the sum of squares must be for another torque between rows.
const JOINS: f64 = 20.0;

/// Whether it matters what the torque does between rows: where it changes a lot from one to the next.
fn varies_fast(recording: &Recording) -> bool {
    let square = |x: f64| x * x;
    let changes: f64 = recording.torque.windows(2).map(|t| square(t[1] - t[0])).sum();
    changes > 1e-4 * recording.torque.iter().map(|t| square(*t)).sum::<f64>()
}

/// A minimum, and the values' covariance if several friction curves explain the recording.
pub type Found = (Polished, Option<DMatrix<f64>>);

/// The search for one model's minimum.
pub struct Search<'a, 'h> {
    /// What is solved; noise and intersample behaviour are found on the way.
    pub problem: Problem<'a>,
    /// Where it may start, the likeliest first.
    pub starts: Vec<Vec<f64>>,
    /// The first start is a user's, which may be far off.
    pub far: bool,
    /// Intersample behaviour of the torque; `None`: not known.
    pub intersample: Option<Intersample>,
    /// No other model of the slosh is tried, which may fit where this one does not.
    pub alone: bool,
    /// Name of the model.
    pub model: &'h str,
    /// Answers of the FMU so far.
    pub simulations: usize,
    /// Is told what happens.
    pub heard: &'h mut dyn FnMut(String),
}

/// A minimum that another model has near.
pub struct Sibling<'f, 'a> {
    /// What was solved.
    pub problem: &'f Problem<'a>,
    /// The minimum.
    pub minimum: &'f Polished,
    /// Covariance of its values over several friction curves.
    pub spread: Option<&'f DMatrix<f64>>,
}

/// One way to look for a minimum.
#[derive(Clone, Copy, Debug)]
struct Attempt {
    from: From,
    /// Parts of the recording over which the fit grows.
    windows: &'static [f64],
    when: When,
}

/// Where an attempt starts.
#[derive(Clone, Copy, Debug, PartialEq)]
enum From {
    /// At one of the starts.
    Start(usize),
    /// At the best minimum so far.
    Best,
}

/// What must hold of the best minimum so far for an attempt to be made.
#[derive(Clone, Copy, Debug, PartialEq)]
enum When {
    /// Nothing.
    Always,
    /// Noise does not explain what it leaves, and no other model is tried that may fit where this one does not.
    Unexplained,
    /// The attempt before has moved it, and noise still does not explain it: such a torque has more minima than one, and
    /// the lowest shows from the beginning on.
    Moved,
    /// There is none, or a poor one.
    Nowhere,
}

impl When {
    /// Why the attempt is made, in words.
    fn words(self) -> Option<&'static str> {
        match self {
            When::Always | When::Moved => None,
            When::Unexplained => Some("noise does not explain it; from another start"),
            When::Nowhere => Some("poor fit from there; again with other windows"),
        }
    }
}

/// The attempts without regard to other models, in their order.
const AFRESH: [Attempt; 2] = [
    Attempt { from: From::Start(0), windows: &WINDOWS, when: When::Always },
    Attempt { from: From::Start(0), windows: &WHOLE, when: When::Nowhere },
];

impl<'a> Search<'a, '_> {
    fn polish(&mut self, x: &[f64], known: Option<&DMatrix<f64>>) -> Result<Polished> {
        let polished = self.problem.polish(x, known, 6)?;
        self.simulations += polished.simulations;
        (self.heard)(format!(
            "{}: {:.4} standard deviations from the minimum after {} simulations",
            self.model, polished.decrement, polished.simulations
        ));
        Ok(polished)
    }

    /// From variables x, over windows; the noise is estimated on the way.
    fn windows(&mut self, x: &[f64], windows: &[f64]) -> Result<Found> {
        let (label, heard) = (self.model, &mut *self.heard);
        let rough = self
            .problem
            .search_growing(x, windows, &mut |line| heard(format!("{label}: {line}")))?;
        self.simulations += rough.simulations;
        let answer = self.problem.answer(&rough.x)?;
        self.problem.estimate_noise(&answer);
        if is_poor(&self.problem, &answer) {
            // a model that does not fit has no minimum worth the search
            let near = self.problem.polish(&rough.x, rough.jacobian.as_ref(), 1)?;
            self.simulations += near.simulations;
            return Ok((near, None));
        }
        let near = self.polish(&rough.x, rough.jacobian.as_ref())?;
        let near = self.joined(near)?;
        let (mut best, mut spread) = self.friction(near)?;
        if !best.converged() {
            let again = self.problem.search(&best.x, 1e-4)?;
            self.simulations += again.simulations;
            let other = self.polish(&again.x, again.jacobian.as_ref())?;
            if other.cost < best.cost {
                best = other;
            }
            let before = self.problem.setup.intersample;
            best = self.joined(best)?;
            if self.problem.setup.intersample != before {
                (best, spread) = self.friction(best)?;
            }
        }
        // the noise from what is left and, if it is another one, the minimum with its filter
        let before = self.problem.channels.clone();
        self.problem.estimate_noise(&best.answer);
        let pairs = before.iter().zip(&self.problem.channels);
        if pairs.into_iter().any(|(a, b)| (a.noise.white / b.noise.white - 1.0).abs() > 0.05) {
            let again = self.polish(&best.x, Some(&best.jacobian))?;
            (best, spread) = self.friction(again)?;
        }
        Ok((best, spread))
    }

    /// The minimum with what the torque does between rows, which only a minimum can tell.
    fn joined(&mut self, near: Polished) -> Result<Polished> {
        if !near.converged() || !self.join(&near)? {
            return Ok(near);
        }
        self.polish(&near.x, Some(&near.jacobian))
    }

    /// Tries what else the torque may do between rows: the sum of squares that is left after the best step from
    /// here, to first order. Returns whether another one was better and is set.
    fn join(&mut self, near: &Polished) -> Result<bool> {
        if self.intersample.is_some() || !self.problem.recordings.iter().any(varies_fast) {
            return Ok(false);
        }
        let now = self.problem.setup.intersample;
        let mut best = (near.cost - JOINS, now);
        for other in Intersample::ALL.into_iter().filter(|b| *b != now) {
            let mut problem = self.problem.clone();
            problem.setup.intersample = other;
            // held torque is late by half a row
            let mut x = near.x.clone();
            let late = |b: Intersample| if b == Intersample::ZeroOrderHold { 0.5 } else { 0.0 };
            if let Some(place) = problem.unknowns.iter().position(|u| u.quantity == Quantity::Delay)
            {
                let scale = problem.unknowns[place].scale;
                let rows = late(now) - late(other);
                let delay = scale.value(x[place]) + rows * problem.recordings[0].step();
                x[place] = scale.variable(delay);
            }
            self.simulations += 1;
            let Ok(answer) = problem.answer(&x) else { continue };
            let e = problem.stacked(&answer, &x);
            let gradient = near.jacobian.tr_mul(&e);
            let cost = e.norm_squared() - gradient.dot(&(&near.covariance.x * &gradient));
            if cost < best.0 {
                best = (cost, other);
            }
        }
        if best.1 == now {
            return Ok(false);
        }
        self.problem.setup.intersample = best.1;
        (self.heard)(format!("{}: the torque is {}", self.model, best.1.words()));
        Ok(true)
    }

    /// Whether it is a minimum that leaves only noise.
    fn explains(&self, found: &Polished) -> bool {
        found.converged() && tests(&self.problem, &found.answer).iter().all(Tests::passed)
    }

    /// Other friction curves, if a minimum may be one of several, and the lowest.
    fn friction(&mut self, near: Polished) -> Result<Found> {
        let places = Places::of(&self.problem.unknowns);
        let Some(places) = places.filter(|p| friction::is_vague(&self.problem, &near, *p)) else {
            return Ok((near, None));
        };
        let points = friction::profile(&self.problem, &near, places)?;
        self.simulations += points.iter().map(|p| p.simulations).sum::<usize>();
        let lowest = points.iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
        let mut best = near;
        if let Some(point) = lowest.filter(|p| p.cost < best.cost) {
            let other = self.polish(&point.x, Some(&best.jacobian))?;
            if other.cost < best.cost {
                best = other;
            }
        }
        let spread = friction::spread(&self.problem, &points, &best);
        if spread.is_some() {
            (self.heard)(format!("{}: several Stribeck speeds explain the recording", self.model));
        }
        Ok((best, spread))
    }

    /// The attempts from the data's or the user's starts, in their order.
    fn attempts(&self) -> Vec<Attempt> {
        let slosh = self.model != "frozen";
        // The response that starts come from is linear: a model that is not may be far from it.
        let nonlinear = slosh && self.model != "linear";
        let windows: &[f64] = if self.far || nonlinear { &WINDOWS } else { &WHOLE };
        let mut all = vec![Attempt { from: From::Start(0), windows, when: When::Always }];
        if slosh {
            for i in 1..self.starts.len() {
                let from = From::Start(i);
                all.push(Attempt { from, windows: &WHOLE, when: When::Unexplained });
                all.push(Attempt { from: From::Best, windows: &WINDOWS, when: When::Moved });
            }
        }
        if slosh && !nonlinear && self.alone && !self.far {
            all.push(Attempt { from: From::Start(0), windows: &WINDOWS, when: When::Nowhere });
        }
        all
    }

    /// Searches from the starts.
    pub fn from_starts(&mut self) -> Result<Found> {
        let attempts = self.attempts();
        self.make(&attempts)
    }

    /// Makes the attempts in their order, and returns what leaves least.
    fn make(&mut self, attempts: &[Attempt]) -> Result<Found> {
        let (mut best, mut failed, mut moved): (Option<Found>, _, _) = (None, None, false);
        for attempt in attempts {
            let is_due = self.is_due(attempt.when, best.as_ref().map(|found| &found.0), moved);
            moved = false;
            let x = match (attempt.from, &best) {
                (From::Start(i), _) => self.starts[i].clone(),
                (From::Best, Some((minimum, _))) => minimum.x.clone(),
                (From::Best, None) => continue,
            };
            if !is_due {
                continue;
            }
            if let Some(why) = attempt.when.words() {
                (self.heard)(format!("{}: {why}", self.model));
            }
            let before = self.problem.clone();
            match self.windows(&x, attempt.windows) {
                Ok(found) if self.is_better(&found, &before, best.as_ref()) => {
                    moved = best.as_ref().is_none_or(|before| before.0.x != found.0.x);
                    best = Some(found);
                }
                Ok(_) => self.problem = before,
                Err(error) => {
                    self.problem = before;
                    failed.get_or_insert(error);
                }
            }
        }
        match (best, failed) {
            (Some(best), _) => Ok(best),
            (None, Some(error)) => Err(error),
            (None, None) => bail!("{}: there is no start", self.model),
        }
    }

    /// Whether an attempt is to be made.
    fn is_due(&self, when: When, best: Option<&Polished>, moved: bool) -> bool {
        let explained = best.is_some_and(|found| self.explains(found));
        let poor = best.map(|found| is_poor(&self.problem, &found.answer));
        match when {
            When::Always => true,
            When::Unexplained => {
                let left_to_others = poor == Some(true) && !self.alone && !self.far;
                !explained && !left_to_others
            }
            When::Moved => moved && !explained,
            When::Nowhere => poor != Some(false),
        }
    }

    /// Whether what was found leaves less than what was found before, of the problem as it was then.
    fn is_better(&self, found: &Found, before: &Problem, best: Option<&Found>) -> bool {
        let fit = fit_pct(&self.problem, &found.0.answer);
        best.is_none_or(|best| fit > fit_pct(before, &best.0.answer))
    }

    /// Searches near the minimum of another model.
    ///
    /// `is_richer`: what the other explains this one explains too, so a poor fit is a search that went astray.
    pub fn near(&mut self, sibling: &Sibling<'_, 'a>, is_richer: bool) -> Result<Found> {
        let found = self.beside(sibling)?;
        if !is_richer || !is_poor(&self.problem, &found.0.answer) {
            return Ok(found);
        }
        self.alone = true;
        let before = self.problem.clone();
        match self.from_starts() {
            Ok(other) if self.is_better(&other, &before, Some(&found)) => Ok(other),
            _ => {
                self.problem = before;
                Ok(found)
            }
        }
    }

    fn beside(&mut self, sibling: &Sibling<'_, 'a>) -> Result<Found> {
        let frozen = self.model == "frozen";
        if !frozen && is_poor(sibling.problem, &sibling.minimum.answer) {
            // so nonlinear that the other model's estimate leads nowhere
            return self.make(&AFRESH);
        }
        // what both have, from there
        let mut x = self.problem.start();
        let known = &sibling.problem.unknowns;
        for (x, unknown) in x.iter_mut().zip(&self.problem.unknowns) {
            if let Some(place) = known.iter().position(|u| u.quantity == unknown.quantity) {
                *x = sibling.minimum.x[place];
            }
        }
        if let (true, Some(hub)) = (frozen, self.problem.place("hub.I")) {
            // all the liquid turns with the hub: the inertia above the resonance and more
            x[hub] += 0.1;
        }
        self.problem.channels.clone_from(&sibling.problem.channels);
        self.problem.setup.intersample = sibling.problem.setup.intersample;
        let same = self.problem.unknowns.len() == known.len();
        let known = same.then_some(&sibling.minimum.jacobian);
        let spread = if same { sibling.spread.cloned() } else { None };
        let mut best = self.problem.polish(&x, known, 3)?;
        self.simulations += best.simulations;
        if frozen {
            return Ok((best, spread));
        }
        // Where the other leaves only noise, this one is as good near there or not at all. Else its minimum may be
        // anywhere.
        let rows = best.answer.residual.concat().len() as f64;
        let hopeless = is_poor(&self.problem, &best.answer) || best.cost > HOPELESS * rows;
        if !best.converged() && !hopeless {
            best = self.polish(&best.x.clone(), Some(&best.jacobian.clone()))?;
        }
        let other_explains =
            tests(sibling.problem, &sibling.minimum.answer).iter().all(Tests::passed);
        if other_explains && (best.converged() || hopeless) {
            return Ok((best, spread));
        }
        if !best.converged() && !is_poor(&self.problem, &best.answer) {
            let rough = self.problem.search(&best.x, 1e-3)?;
            self.simulations += rough.simulations;
            let again = self.polish(&rough.x, rough.jacobian.as_ref())?;
            if again.cost < best.cost {
                best = again;
            }
        }
        if is_poor(&self.problem, &best.answer) {
            return self.make(&AFRESH);
        }
        Ok((best, spread))
    }
}
