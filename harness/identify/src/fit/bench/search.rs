//! The search for a model's minimum. What is tried is a list of attempts ([`Search::attempts`]): where each starts, over
//! which part of the recordings, when it is made, and what it must do better than the best so far to be accepted.
//! They are tried in their order and told in words. Every unknown is free in all of them; what holds one of them fixed is
//! the grid of Stribeck speeds ([`crate::fit::bench::friction`]).

use anyhow::{Result, bail};
use nalgebra::DMatrix;

use crate::fit::bench::between;
use crate::fit::bench::friction;
use crate::fit::bench::goodness::{fit_pct, is_poor, tests};
use crate::fit::bench::problem::{Answer, Polished, Problem, Rough};
use crate::model::bench::simulate::Intersample;
use crate::model::bench::stribeck::Indices;
use crate::news::Since;
use crate::tuning::{BENCH_WINDOWS, LEADS, NEARLY_NOISE, ROUNDS, STRIBECK_GRID};
use analysis::innovations::Tests;
use names::hubslosh::{SloshModel, hub};

/// The search for one model's minimum.
pub struct Search<'a, 'h> {
    /// Problem to solve; noise and intersample behaviour are determined during the search.
    pub problem: Problem<'a>,
    /// Starts, the likeliest first.
    pub starts: Vec<Vec<f64>>,
    /// The first start is a user's, which may be far off.
    pub far: bool,
    /// Intersample behaviour of the torque; `None`: not known.
    pub intersample: Option<Intersample>,
    /// The rate may come before the torque.
    pub acausal: bool,
    /// No other model of the slosh is tried, which may fit where this one does not.
    pub alone: bool,
    /// Name of the model.
    pub model: &'h str,
    /// Other Stribeck speeds once they were tried: speed, rad/s, and the least increase of the sum of squares.
    pub speeds: Vec<(f64, f64)>,
    /// Other intersample behaviours of the torque, once they were tried.
    pub others: Option<between::Others>,
    /// Cost of the lines so far.
    pub since: Since,
    /// Receives progress messages.
    pub progress: &'h mut dyn FnMut(String),
}

/// A minimum that another model has near.
pub struct Sibling<'f, 'a> {
    /// Solved problem.
    pub problem: &'f Problem<'a>,
    /// The minimum.
    pub minimum: &'f Polished,
    /// True if the other model is a special case of this one. If this model then fits worse, its search has failed.
    pub is_poorer: bool,
}

/// One way to look for a minimum.
#[derive(Clone, Copy, Debug)]
struct Attempt {
    from: From,
    how: How,
    when: When,
    accept: Accept,
}

/// Start of an attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
enum From {
    /// One of the starts.
    Start(usize),
    /// The best minimum so far.
    Best,
    /// The other model's minimum, with its noise.
    Sibling,
}

/// Search method of an attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
enum How {
    /// Gauss and Newton's steps over the whole recordings, with so many sets of sensitivities at most.
    Steps(usize),
    /// The same over the loudest part of long recordings first, and over the whole only where that comes near the noise ([`NEARLY_NOISE`]).
    Glance(usize),
    /// Levenberg and Marquardt's search over the whole recordings, then such steps.
    Search,
    /// Levenberg and Marquardt's search over parts of the recordings that grow, then such steps; noise, intersample
    /// behaviour and the friction's curve are found on the way.
    Windows(&'static [f64]),
    /// The same over the loudest part of long recordings, then over the whole; over the whole from the beginning on where they are short.
    Loudest,
}

/// Condition on the best minimum so far for an attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
enum When {
    Always,
    /// Noise does not explain what a start led to, and no other model is tried that may fit where this one does not.
    Unexplained,
    /// The attempt before has moved it, and noise still does not explain it: such a torque has more minima than one, and
    /// the lowest shows from the beginning on.
    Moved,
    /// There is none, or a poor one.
    Poor,
    /// The search has not ended there, and the residual is nearly the noise ([`NEARLY_NOISE`]).
    Near,
    /// The search has not ended there, and the fit is not poor.
    Unfinished,
}

/// Condition for accepting an attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Accept {
    /// Less sum of squares, of the same noise.
    LessCost,
    /// A better fit, where each has a noise of its own.
    BetterFit,
}

/// Best result of the attempts so far.
#[derive(Default)]
struct Best {
    found: Option<Polished>,
    /// An attempt from a start was made.
    started: bool,
    /// The last attempt has moved it.
    moved: bool,
}

impl Attempt {
    /// Returns an attempt from a nearby minimum.
    fn near(from: From, how: How, when: When) -> Self {
        Attempt { from, how, when, accept: Accept::LessCost }
    }

    /// Returns an attempt over windows, with its own noise.
    fn over(from: From, how: How, when: When) -> Self {
        Attempt { from, how, when, accept: Accept::BetterFit }
    }

    /// Describes start and method in words.
    fn words(&self) -> String {
        let from = match self.from {
            From::Start(i) => format!("from start {}", i + 1),
            From::Best => "from the best so far".into(),
            From::Sibling => "from the other model's minimum".into(),
        };
        match self.how {
            How::Steps(rounds) => {
                format!("{from}, Gauss–Newton steps with {rounds} sets of sensitivities at most")
            }
            How::Glance(rounds) => {
                format!("{from}, a glance with {rounds} sets of sensitivities at most")
            }
            How::Search => format!("{from}, Levenberg–Marquardt over the whole recording"),
            How::Loudest => format!("{from}, the loudest part of a long recording first"),
            How::Windows(parts) => {
                let parts: Vec<String> =
                    parts.iter().map(|part| format!("{:.0}", 100.0 * part)).collect();
                format!("{from}, windows of {} % of the recording", parts.join(", "))
            }
        }
    }
}

impl When {
    fn words(self) -> &'static str {
        match self {
            When::Always => "it is the first",
            When::Unexplained => "the results of earlier starts do not fit",
            When::Moved => "the last attempt found another minimum, which does not fit",
            When::Poor => "the fit so far is poor",
            When::Near => "the search has not ended, and the residual is nearly noise",
            When::Unfinished => "the search has not ended, and the fit is not poor",
        }
    }
}

impl<'a> Search<'a, '_> {
    /// Reports progress in one line, with the number of simulations since the last line.
    fn say(&mut self, line: String) {
        (self.progress)(self.since.line(line, self.problem.simulations()));
    }

    /// Gauss and Newton's steps.
    fn polish(
        &mut self,
        x: &[f64],
        known: Option<&DMatrix<f64>>,
        rounds: usize,
    ) -> Result<Polished> {
        let answer = self.problem.answer(x)?;
        self.polish_from((x, answer), known, rounds)
    }

    /// The same where the FMU's answer at x is known.
    fn polish_from(
        &mut self,
        at: (&[f64], Answer),
        known: Option<&DMatrix<f64>>,
        rounds: usize,
    ) -> Result<Polished> {
        let polished = self.problem.polish_from(at, known, rounds)?;
        self.say(format!(
            "{}: {:.4} standard deviations from the minimum",
            self.model, polished.decrement
        ));
        Ok(polished)
    }

    /// Gauss and Newton's steps over the loudest parts, and over the whole recordings if they come near the noise there.
    fn glance(
        &mut self,
        x: &[f64],
        known: Option<&DMatrix<f64>>,
        rounds: usize,
    ) -> Result<Polished> {
        let Some(part) = self.problem.loudest() else { return self.polish(x, known, rounds) };
        let problem = Problem { recordings: &part, ..self.problem.clone() };
        let there = problem.polish(x, known, rounds)?;
        let rows: usize = part.iter().map(|r| r.of_fresh(&r.time).len()).sum();
        let excess = there.cost / rows as f64;
        self.say(format!(
            "{}: the mean square of the loudest part is {excess:.1} times that of noise",
            self.model
        ));
        if excess < NEARLY_NOISE {
            return self.polish(&there.x, Some(&there.jacobian), rounds);
        }
        let answer = self.problem.answer(&there.x)?;
        let cost = self.problem.stacked(&answer, &there.x).norm_squared();
        Ok(Polished { answer, cost, ..there })
    }

    /// Levenberg and Marquardt's search, then Gauss and Newton's steps.
    fn search(&mut self, x: &[f64], tolerance: f64) -> Result<Polished> {
        let rough = self.problem.search(x, tolerance)?;
        self.polish(&rough.x, Some(&rough.jacobian), ROUNDS)
    }

    /// Searches from x over growing windows.
    fn windows(&mut self, x: &[f64], windows: &[f64]) -> Result<Polished> {
        let (label, problem) = (self.model, &self.problem);
        let (since, progress) = (&mut self.since, &mut *self.progress);
        let mut say =
            |line| progress(since.line(format!("{label}: {line}"), problem.simulations()));
        let rough = problem.search_growing(x, windows, &mut say)?;
        self.on(rough)
    }

    /// Searches from x over the loudest parts.
    fn loudest(&mut self, x: &[f64]) -> Result<Polished> {
        let rough = self.problem.search_loudest(x)?;
        self.say(format!("{}: the loudest part", self.model));
        self.on(rough)
    }

    /// Continues from a rough estimate over the whole recordings, and estimates the noise.
    fn on(&mut self, rough: Rough) -> Result<Polished> {
        let (mut x, mut known) = (rough.x, rough.jacobian);
        let mut answer = self.problem.answer(&x)?;
        self.problem.estimate_noise(&answer);
        let mut before = f64::INFINITY;
        while is_poor(&self.problem, &answer) {
            // a model that does not fit has no minimum worth the search, unless single steps lead far
            let near = self.polish_from((&x, answer), Some(&known), 1)?;
            if !is_poor(&self.problem, &near.answer) {
                self.problem.estimate_noise(&near.answer);
            } else if near.cost > LEADS * before {
                return Ok(near);
            }
            before = near.cost;
            (x, known, answer) = (near.x, near.jacobian, near.answer);
        }
        let near = self.polish_from((&x, answer), Some(&known), ROUNDS)?;
        let near = self.joined(near)?;
        let mut best = self.friction(near)?;
        if !best.converged() {
            let other = self.search(&best.x, 1e-4)?;
            if other.cost < best.cost {
                best = other;
            }
            let before = self.problem.setup.intersample;
            best = self.joined(best)?;
            if self.problem.setup.intersample != before {
                best = self.friction(best)?;
            }
        }
        // the noise from the residual and, if it is another one, the minimum with its filter
        if self.problem.renew_noise(&mut best)? {
            let again = self.polish_from((&best.x, best.answer), Some(&best.jacobian), ROUNDS)?;
            best = self.friction(again)?;
        }
        Ok(best)
    }

    /// The minimum with what the torque does between rows, which only a minimum can tell.
    fn joined(&mut self, near: Polished) -> Result<Polished> {
        if !near.converged()
            || self.intersample.is_some()
            || !between::matters(self.problem.recordings)
        {
            return Ok(near);
        }
        let step = self.problem.recordings[0].torque_step();
        let others = between::alternatives(&self.problem, &near, self.others.as_ref());
        let said = between::evidence(&self.problem, &near, step, self.acausal, &others.all);
        self.say(format!("{}: {said}", self.model));
        let others = &self.others.insert(others).all;
        let Some(best) = between::better(near.cost, step, self.acausal, others).cloned() else {
            return Ok(near);
        };
        let before = std::mem::replace(&mut self.problem.setup.intersample, best.behaviour);
        let Polished { x, answer, jacobian, .. } = best.minimum;
        let other = self.polish_from((&x, answer), Some(&jacobian), ROUNDS)?;
        if other.cost > near.cost {
            self.problem.setup.intersample = before;
            return Ok(near);
        }
        self.say(format!("{}: the torque is {}", self.model, best.behaviour.words()));
        Ok(other)
    }

    /// Returns true for a minimum whose residual is only noise.
    fn explains(&self, found: &Polished) -> bool {
        found.converged() && tests(&self.problem, &found.answer).iter().all(Tests::passed)
    }

    /// Other friction curves, if a minimum may be one of several, and the lowest.
    fn friction(&mut self, near: Polished) -> Result<Polished> {
        let indices = Indices::of(&self.problem.unknowns);
        let Some(indices) = indices.filter(|i| friction::is_vague(&self.problem, &near, *i)) else {
            return Ok(near);
        };
        let points = friction::grid(&self.problem, &near, indices);
        let refused = STRIBECK_GRID.len() - points.len();
        if refused > 0 {
            let which = if points.is_empty() { "no" } else { "not every" };
            self.say(format!(
                "{}: {which} other friction.omega_s can be judged: the FMU refuses the runs at {refused} of {}, or they show nothing",
                self.model,
                STRIBECK_GRID.len()
            ));
        }
        for tried in &points {
            let (speed, more) = (tried.speed, tried.more);
            let adds = match tried.x {
                Some(_) => format!("adds {more:.1} to the sum of squares"),
                None => format!(
                    "adds at least {more:.1} to the sum of squares, by the loudest part alone"
                ),
            };
            self.say(format!(
                "{}: friction.omega_s held at {speed:.3e} rad/s, all else free, {adds}",
                self.model
            ));
        }
        self.speeds = points.iter().map(|tried| (tried.speed, tried.more)).collect();
        let lowest = points.iter().min_by(|a, b| a.more.total_cmp(&b.more));
        let mut best = near;
        if let Some(x) = lowest.filter(|tried| tried.more < 0.0).and_then(|tried| tried.x.as_ref())
        {
            let other = self.polish(x, Some(&best.jacobian), ROUNDS)?;
            if other.cost < best.cost {
                best = other;
            }
        }
        Ok(best)
    }

    /// The attempts, in their order: from the data's or the user's starts, or near the minimum of another model.
    fn attempts(&self, sibling: Option<&Sibling>) -> Vec<Attempt> {
        let frozen = self.model == SloshModel::Frozen.name();
        // The response that starts come from is linear: a model that is not may be far from it.
        let nonlinear = !frozen && self.model != SloshModel::Linear.name();
        let how = if self.far || nonlinear { How::Windows(&BENCH_WINDOWS) } else { How::Loudest };
        let others = (1..if frozen { 1 } else { self.starts.len() }).flat_map(|i| {
            [
                Attempt::over(From::Start(i), How::Loudest, When::Unexplained),
                Attempt::over(From::Best, How::Windows(&BENCH_WINDOWS), When::Moved),
            ]
        });
        let Some(sibling) = sibling else {
            let mut all = vec![Attempt::over(From::Start(0), how, When::Always)];
            all.extend(others);
            if self.model == SloshModel::Linear.name() && self.alone && !self.far {
                all.push(Attempt::over(From::Start(0), How::Windows(&BENCH_WINDOWS), When::Poor));
            }
            return all;
        };
        let is_explained =
            tests(sibling.problem, &sibling.minimum.answer).iter().all(Tests::passed);
        // where the residual of the other is only noise, this one is as good near there or not at all
        let how = if is_explained { How::Glance(3) } else { How::Steps(3) };
        let near = Attempt::near(From::Sibling, how, When::Always);
        if frozen {
            return vec![near];
        }
        if is_poor(sibling.problem, &sibling.minimum.answer) {
            // so nonlinear that the other model's estimate leads nowhere
            return vec![
                Attempt::over(From::Start(0), How::Windows(&BENCH_WINDOWS), When::Always),
                Attempt::over(From::Start(0), How::Loudest, When::Poor),
            ];
        }
        let mut all = vec![near, Attempt::near(From::Best, How::Steps(ROUNDS), When::Near)];
        if is_explained {
            all.push(Attempt::near(From::Best, How::Search, When::Near));
            if sibling.is_poorer {
                all.push(Attempt::over(From::Start(0), How::Windows(&BENCH_WINDOWS), When::Poor));
            }
        } else {
            // its minimum may be anywhere
            all.push(Attempt::near(From::Best, How::Search, When::Unfinished));
            all.push(Attempt::over(From::Start(0), How::Windows(&BENCH_WINDOWS), When::Poor));
            all.push(Attempt::over(From::Start(0), How::Loudest, When::Poor));
        }
        all.extend(others.filter(|_| sibling.is_poorer));
        all
    }

    /// Makes the attempts in their order, and returns the best that was accepted.
    pub fn run(&mut self, sibling: Option<&Sibling<'_, 'a>>) -> Result<Polished> {
        self.alone |= sibling.is_some_and(|s| s.is_poorer);
        let (mut best, mut failed) = (Best::default(), None);
        let attempts = self.attempts(sibling);
        for (number, attempt) in attempts.iter().enumerate() {
            let label = format!("{}, attempt {}, {}", self.model, number + 1, attempt.words());
            let is_due = self.is_due(attempt.when, &best);
            best.moved = false;
            if !is_due {
                self.say(format!("{label}: not made, only if {}", attempt.when.words()));
                continue;
            }
            best.started |= matches!(attempt.from, From::Start(_));
            let before = self.problem.clone();
            self.say(format!("{label}: made, for {}", attempt.when.words()));
            let said = match self.attempt(attempt, best.found.as_ref(), sibling) {
                Ok(found) => {
                    let (accepted, why) =
                        self.accepts(attempt.accept, &found, &before, best.found.as_ref());
                    if accepted {
                        best.moved = best.found.is_none_or(|before| before.x != found.x);
                        best.found = Some(found);
                    } else {
                        self.problem = before;
                    }
                    format!("{} {why}", if accepted { "accepted," } else { "refused," })
                }
                Err(error) => {
                    self.problem = before;
                    let said = format!("failed, {error:#}");
                    failed.get_or_insert(error);
                    said
                }
            };
            self.say(format!("{}, attempt {}: {said}", self.model, number + 1));
        }
        match (best.found, failed) {
            (Some(best), _) => Ok(best),
            (None, Some(error)) => Err(error),
            (None, None) => bail!("{}: there is no start", self.model),
        }
    }

    /// Makes one attempt.
    fn attempt(
        &mut self,
        attempt: &Attempt,
        best: Option<&Polished>,
        sibling: Option<&Sibling<'_, 'a>>,
    ) -> Result<Polished> {
        let (x, known) = match (attempt.from, best, sibling) {
            (From::Start(i), ..) => (self.starts[i].clone(), None),
            (From::Best, Some(minimum), _) => (minimum.x.clone(), Some(&minimum.jacobian)),
            (From::Sibling, _, Some(sibling)) => {
                let x = self.x_of(sibling);
                let same = x.len() == sibling.minimum.x.len();
                (x, same.then_some(&sibling.minimum.jacobian))
            }
            (From::Best | From::Sibling, ..) => bail!("there is no minimum to start from"),
        };
        let values = self.problem.unknowns.iter().zip(self.problem.values(&x));
        let free: Vec<String> =
            values.map(|(u, value)| format!("{} {value:.4e}", u.quantity.name())).collect();
        self.say(format!("{}: free, from {}", self.model, free.join(", ")));
        match attempt.how {
            How::Windows(windows) => self.windows(&x, windows),
            How::Loudest => self.loudest(&x),
            How::Steps(rounds) => self.polish(&x, known, rounds),
            How::Glance(rounds) => self.glance(&x, known, rounds),
            How::Search => self.search(&x, 1e-3),
        }
    }

    /// The other model's minimum in this one's unknowns; its noise and intersample behaviour are taken over.
    fn x_of(&mut self, sibling: &Sibling<'_, 'a>) -> Vec<f64> {
        let mut x = self.problem.start();
        let known = &sibling.problem.unknowns;
        for (x, unknown) in x.iter_mut().zip(&self.problem.unknowns) {
            if let Some(index) = known.iter().position(|u| u.quantity == unknown.quantity) {
                *x = sibling.minimum.x[index];
            }
        }
        if self.model == SloshModel::Frozen.name()
            && let Some(hub) = self.problem.index(hub::I)
        {
            // all the liquid turns with the hub: the inertia above the resonance and more
            x[hub] += 0.1;
        }
        self.problem.channels.clone_from(&sibling.problem.channels);
        self.problem.setup.intersample = sibling.problem.setup.intersample;
        x
    }

    /// Returns true if an attempt is due.
    fn is_due(&self, when: When, best: &Best) -> bool {
        let Some(minimum) = &best.found else {
            return matches!(when, When::Always | When::Unexplained | When::Poor);
        };
        let poor = is_poor(&self.problem, &minimum.answer);
        let explained = || self.explains(minimum);
        let rows = minimum.answer.residual.iter().map(Vec::len).sum::<usize>() as f64;
        match when {
            When::Always => true,
            When::Unexplained => {
                let left_to_others = poor && !self.alone && !self.far;
                best.started && !left_to_others && !explained()
            }
            When::Moved => best.moved && !explained(),
            When::Poor => poor,
            When::Near => !minimum.converged() && !poor && minimum.cost <= NEARLY_NOISE * rows,
            When::Unfinished => !minimum.converged() && !poor,
        }
    }

    /// Decides whether a result is better than the best so far, of the problem as it was then, with the reason in words.
    fn accepts(
        &self,
        rule: Accept,
        found: &Polished,
        before: &Problem,
        best: Option<&Polished>,
    ) -> (bool, String) {
        let Some(best) = best else {
            return (true, "for it is the first".into());
        };
        let fits = [(&self.problem, found), (before, best)];
        let [fit, fit_before] = fits.map(|(problem, found)| fit_pct(problem, &found.answer));
        let (cost, cost_before) = (found.cost, best.cost);
        match rule {
            Accept::LessCost => {
                let why = format!("for the sum of squares is {cost:.1}, before {cost_before:.1}");
                (cost < cost_before, why)
            }
            Accept::BetterFit => {
                (fit > fit_before, format!("for the fit is {fit:.3} %, before {fit_before:.3} %"))
            }
        }
    }
}
