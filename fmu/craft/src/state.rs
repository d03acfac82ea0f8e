//! The craft's continuous states x in their order, its inputs, and the state that is saved.

use formulas::limits::LimitedBy;
use formulas::regime::Regime;
use taylor::integrator::MAX_MAGNITUDE;
use taylor::vector::{self, Vec3};

use crate::sizes::{APPENDAGES, MODES, TANKS};

/// Indices of the continuous states in x. `Q`: attitude quaternion from body to inertial axes, scalar first. `OMEGA`:
/// angular velocity, rad/s, body axes. `POSITION`, m, and `VELOCITY`, m/s, of O in inertial axes. `WORK` of force and torque
/// and energy `DISSIPATED` by the liquids since the start, J. `BOBS`: direction p and rate p', 1/s, of each of the [`MODES`]
/// modes of each tank, tank axes. `LIQUID`: mass of liquid in each tank, kg. `DRAINED`: energy that the outflow has taken,
/// J. `BALLS`: position, m, and rate, m/s, of each tank's detached liquid from the tank's origin, tank axes. `SPINS`:
/// angular momentum of spin, kg m2/s, of each tank's liquid, tank axes. `ETA` and `ETA_DOT`: modal displacement, kg^0.5 m,
/// of each mode of the appendages and its rate. States that are not in use are constant.
#[allow(missing_docs)]
pub mod index {
    use crate::sizes::{APPENDAGES, MODES, TANKS};

    pub const Q: usize = 0;
    pub const OMEGA: usize = 4;
    pub const POSITION: usize = 7;
    pub const VELOCITY: usize = 10;
    pub const WORK: usize = 13;
    pub const DISSIPATED: usize = 14;
    pub const BOBS: usize = 15;

    pub const LIQUID: usize = BOBS + 6 * TANKS * MODES;
    pub const DRAINED: usize = LIQUID + TANKS;

    pub const BALLS: usize = DRAINED + 1;

    pub const ETA: usize = spin(TANKS);
    pub const ETA_DOT: usize = ETA + APPENDAGES;

    /// Returns the index in x of the position and rate of the detached liquid of tank number
    /// `tank`, which counts from 0.
    pub const fn ball(tank: usize) -> usize {
        BALLS + 6 * tank
    }

    pub const SPINS: usize = BALLS + 6 * TANKS;

    /// Returns the index in x of the angular momentum of the spinning liquid of tank number `tank`,
    /// which counts from 0.
    pub const fn spin(tank: usize) -> usize {
        SPINS + 3 * tank
    }

    /// Returns the index in x of direction and rate of the bob of this tank and mode; `tank` and
    /// `mode` count from 0.
    pub const fn bob(tank: usize, mode: usize) -> usize {
        BOBS + 6 * (tank * MODES + mode)
    }
}

/// Number of continuous states.
pub const STATES: usize = index::ETA_DOT + APPENDAGES;

/// Number of scalar inputs: force, torque, h_wheels and the mass flow of each tank.
pub const INPUTS: usize = 9 + TANKS;

/// A vector that is linear in time: `value + slope t`.
pub type Ramp = taylor::ramp::Ramp<Vec3>;

/// A number that is linear in time: `value + slope t`.
pub type Line = taylor::ramp::Ramp;

/// Inputs of the craft over one step, body axes. `force`, N, acts at O (on a pivot, the bearing takes it up), and `torque`,
/// N m, is about O. `h_wheels` is the angular momentum of the wheels relative to the body, N m s: its slope exerts the
/// torque -h_w' on the craft, and a jump between two steps exerts an impulse. Both conserve the total angular momentum.
/// `mass_flow` is the flow out of each tank, kg/s; it is negative for inflow and has no effect in a tank without a fill
/// table. If it jumps between two steps, the flow within the tank starts with an impulse.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[allow(missing_docs)]
pub struct Inputs {
    pub force: Ramp,
    pub torque: Ramp,
    pub h_wheels: Ramp,
    pub mass_flow: [Line; TANKS],
}

/// Validity of the model for the present motion of a tank: the regime of the wave, and the reason
/// if the tank is out of its range. `is_physical` is true if thrust holds the liquid at the tank's
/// bottom and every bob is within 45 degrees of the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Ranges {
    pub regime: Regime,
    pub limited_by: LimitedBy,
    pub is_physical: bool,
}

impl Default for Ranges {
    fn default() -> Self {
        Ranges { regime: Regime::Linear, limited_by: LimitedBy::None, is_physical: true }
    }
}

impl Ranges {
    /// Returns true if the pendulums represent the liquid.
    pub fn is_in_range(&self) -> bool {
        self.limited_by == LimitedBy::None
    }

    pub(crate) fn to_word(self) -> u64 {
        self.regime as u64 | (self.limited_by as u64) << 8 | u64::from(self.is_physical) << 16
    }

    pub(crate) fn from_word(word: u64) -> Option<Ranges> {
        let regime = Regime::from_number(word as u8)?;
        let limited_by = LimitedBy::from_number((word >> 8) as u8)?;
        match word >> 16 {
            flag @ 0..=1 => Some(Ranges { regime, limited_by, is_physical: flag == 1 }),
            _ => None,
        }
    }
}

/// State of a tank's liquid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum BallState {
    /// Liquid at the bottom of the tank, modelled as rigid liquid and pendulums.
    #[default]
    Settled = 1,
    /// Detached liquid in free flight through the tank.
    Flying = 2,
    /// Detached liquid that slides on the wall with drag.
    Sliding = 3,
    /// Detached liquid that slides on the wall without drag, because the wall force is so small that the reaction of the
    /// drag would push the wall away from the liquid.
    Light = 4,
    /// Detached liquid that slides without drag, like `Light`, because the pendulums could not take it over without an increase
    /// of the energy. The next attempt is made when the liquid is nearest to the tank's axis.
    Held = 5,
}

impl BallState {
    /// All states in the order of their numbers.
    pub const ALL: [BallState; 5] = [
        BallState::Settled,
        BallState::Flying,
        BallState::Sliding,
        BallState::Light,
        BallState::Held,
    ];
}

/// Complete state of a craft: with its parameters and inputs, a craft continues from it bit-identically. It includes the
/// wheels' momentum and the outflows whose jumps have already acted on the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    pub(crate) time: f64,
    pub(crate) x: [f64; STATES],
    pub(crate) h_wheels: Vec3,
    pub(crate) flow: [f64; TANKS],
    pub(crate) ranges: [Ranges; TANKS],
    pub(crate) ball: [BallState; TANKS],
    pub(crate) kept: Kept,
}

/// Start of the power series (expansion) that the next step continues if the inputs have not changed or follow their ramps:
/// the states `x` at this start. `clock` is the time at the end of the last step and `start` the time at the start of the
/// expansion; both count from the last jump of an input or a slope, and the second number of each is its rounding error.
/// `inputs` and `slopes` (of force, torque, h_wheels and mass flows) are those at this jump. If `clock` is 0, the next step
/// starts a new expansion, and the other fields have no meaning.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kept {
    pub x: [f64; STATES],
    pub clock: [f64; 2],
    pub start: [f64; 2],
    inputs: [f64; INPUTS],
    slopes: [f64; INPUTS],
}

impl Kept {
    const REALS: usize = STATES + 4 + 2 * INPUTS;

    /// Value without an expansion, after which the next step starts a new one.
    pub const NONE: Kept = Kept {
        x: [0.0; STATES],
        clock: [0.0; 2],
        start: [0.0; 2],
        inputs: [0.0; INPUTS],
        slopes: [0.0; INPUTS],
    };

    #[inline(always)]
    pub fn is_used(&self) -> bool {
        self.clock[0] > 0.0
    }

    /// Returns true if the next step, of the length `h` (s), continues the expansion, because `inputs` are constant and have
    /// not changed, or follow their ramps during the step within rounding errors.
    #[inline(always)]
    pub fn is_continued(&self, inputs: &Inputs, h: f64) -> bool {
        if !inputs.are_held() {
            return self.is_used() && self.is_followed(inputs, h);
        }
        // The comparison has no branches, which saves a hundred instructions.
        let ramps = self.inputs.iter().zip(&self.slopes);
        let same =
            |all, ((x, slope), now): ((&f64, &f64), &f64)| all & (x == now) & (*slope == 0.0);
        self.is_used() && ramps.zip(&inputs.values()).fold(true, same)
    }

    /// Compares the inputs at the start and at the end of the next step with their ramps. A host computes both with rounding
    /// errors, also the slope, as a difference of two values. An input whose ramp has no slope must have its value exactly.
    #[inline(never)]
    fn is_followed(&self, inputs: &Inputs, h: f64) -> bool {
        let clock = self.clock[0];
        let ramps = self.inputs.iter().zip(&self.slopes);
        ramps.zip(inputs.values().iter().zip(&inputs.slopes())).all(|((x, slope), (now, rate))| {
            let rounding = if *slope == 0.0 { 0.0 } else { 8.0 * f64::EPSILON };
            let allowed = rounding * (x.abs() + slope.abs() * (clock + h));
            [(0.0, clock), (h, clock + h)]
                .iter()
                .all(|(h, t)| (now + rate * h - (x + slope * t)).abs() <= allowed)
        })
    }

    /// Returns the inputs at the time 0 of the clock.
    pub fn inputs(&self) -> Inputs {
        let at = |i: usize| Line { value: self.inputs[i], slope: self.slopes[i] };
        let ramp = |i: usize| Ramp {
            value: vector::part(&self.inputs, i),
            slope: vector::part(&self.slopes, i),
        };
        let mass_flow = core::array::from_fn(|i| at(9 + i));
        Inputs { force: ramp(0), torque: ramp(3), h_wheels: ramp(6), mass_flow }
    }

    /// Stores the start of a new expansion: its `inputs` and the states `x`. States after the last
    /// element of `x` stay as they are.
    #[inline(always)]
    pub fn renew(&mut self, x: &[f64], inputs: &Inputs) {
        self.x[..x.len()].copy_from_slice(x);
        (self.inputs, self.slopes) = (inputs.values(), inputs.slopes());
    }

    /// Discards the expansion, so that the next step starts a new one.
    pub fn end(&mut self) {
        (self.clock, self.start) = ([0.0; 2], [0.0; 2]);
    }

    fn numbers(&self) -> impl Iterator<Item = &f64> {
        let Kept { x, clock, start, inputs, slopes } =
            if self.is_used() { self } else { &Kept::NONE };
        clock.iter().chain(start).chain(inputs).chain(slopes).chain(x)
    }

    fn from_numbers(numbers: &[f64; Self::REALS]) -> Option<Kept> {
        let (clock, rest) = numbers.split_first_chunk()?;
        let (start, rest) = rest.split_first_chunk()?;
        let (inputs, rest) = rest.split_first_chunk()?;
        let (slopes, x) = rest.split_first_chunk()?;
        let x = *x.first_chunk()?;
        let kept = Kept { x, clock: *clock, start: *start, inputs: *inputs, slopes: *slopes };
        (!kept.is_used() || has_directions(&x)).then_some(kept)
    }
}

impl PartialEq for Kept {
    fn eq(&self, other: &Kept) -> bool {
        self.numbers().eq(other.numbers())
    }
}

impl Inputs {
    #[inline(always)]
    pub(crate) fn are_held(&self) -> bool {
        let Inputs { force, torque, h_wheels, mass_flow } = self;
        [force, torque, h_wheels].iter().all(|ramp| ramp.slope == [0.0; 3])
            && mass_flow.iter().all(|flow| flow.slope == 0.0)
    }

    #[inline(always)]
    fn values(&self) -> [f64; INPUTS] {
        let Inputs { force, torque, h_wheels, mass_flow } = self;
        in_order([force.value, torque.value, h_wheels.value], mass_flow.map(|flow| flow.value))
    }

    #[inline(always)]
    fn slopes(&self) -> [f64; INPUTS] {
        let Inputs { force, torque, h_wheels, mass_flow } = self;
        in_order([force.slope, torque.slope, h_wheels.slope], mass_flow.map(|flow| flow.slope))
    }
}

#[inline(always)]
fn in_order(vectors: [Vec3; 3], flows: [f64; TANKS]) -> [f64; INPUTS] {
    let mut all = [0.0; INPUTS];
    all[..9].copy_from_slice(vectors.as_flattened());
    all[9..].copy_from_slice(&flows);
    all
}

impl State {
    /// Number of 64-bit words of a saved state.
    pub const WORDS: usize = Self::REALS + 2 * TANKS;

    const REALS: usize = 4 + TANKS + STATES + Kept::REALS;

    /// Returns the wheels' angular momentum, N m s, whose jumps have already acted on the motion.
    pub fn h_wheels(&self) -> Vec3 {
        self.h_wheels
    }

    /// Returns the state as 64-bit words, from which [`State::from_words`] restores it.
    pub fn to_words(&self) -> [u64; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        let held = self.h_wheels.iter().chain(&self.flow);
        let numbers =
            core::iter::once(&self.time).chain(held).chain(&self.x).chain(self.kept.numbers());
        for (word, number) in words.iter_mut().zip(numbers) {
            *word = number.to_bits();
        }
        for (word, ranges) in words[Self::REALS..].iter_mut().zip(self.ranges) {
            *word = ranges.to_word();
        }
        for (word, ball) in words[Self::REALS + TANKS..].iter_mut().zip(self.ball) {
            *word = ball as u64;
        }
        words
    }

    /// Restores a state from the words of [`State::to_words`]; `None` if they are not a valid state.
    pub fn from_words(words: &[u64; Self::WORDS]) -> Option<State> {
        let numbers: [f64; Self::REALS] = core::array::from_fn(|i| f64::from_bits(words[i]));
        let mut ranges = [Ranges::default(); TANKS];
        for (ranges, word) in ranges.iter_mut().zip(&words[Self::REALS..]) {
            *ranges = Ranges::from_word(*word)?;
        }
        let mut ball = [BallState::default(); TANKS];
        for (ball, word) in ball.iter_mut().zip(&words[Self::REALS + TANKS..]) {
            *ball = BallState::ALL.into_iter().find(|ball| *ball as u64 == *word)?;
        }
        let x: [f64; STATES] = core::array::from_fn(|i| numbers[4 + TANKS + i]);
        let kept = Kept::from_numbers(numbers[4 + TANKS + STATES..].first_chunk()?)?;
        let is_state = numbers[0].is_finite()
            && numbers[1..].iter().all(|x| x.abs() < MAX_MAGNITUDE)
            && has_directions(&x);
        let h_wheels = [numbers[1], numbers[2], numbers[3]];
        let flow = core::array::from_fn(|i| numbers[4 + i]);
        is_state.then_some(State { time: numbers[0], x, h_wheels, flow, ranges, ball, kept })
    }
}

fn has_directions(x: &[f64; STATES]) -> bool {
    has_direction(&x[index::Q..][..4])
        && (0..TANKS * MODES).all(|i| has_direction(&x[index::bob(0, i)..][..3]))
}

pub(crate) fn has_direction(x: &[f64]) -> bool {
    x.iter().any(|x| x.abs() > 1.0 / MAX_MAGNITUDE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Parameters, Spacecraft};

    #[test]
    fn saved_words_restore_the_state_unless_a_number_is_too_large_or_a_direction_has_no_length() {
        let inputs = Inputs::default();
        let craft = Spacecraft::new(&Parameters::default(), &inputs, 0.0, 1e-8).unwrap();
        let words = craft.state().to_words();
        assert_eq!(State::from_words(&words), Some(*craft.state()));
        let with = |place: usize, number: f64| {
            let mut words = words;
            words[place] = number.to_bits();
            State::from_words(&words)
        };
        for place in 0..State::REALS {
            assert_eq!(with(place, f64::NAN), None);
            // The time may be large, because it is never squared.
            assert_eq!(with(place, 1e30).is_none(), place > 0, "{place}");
        }
        // q = (1, 0, 0, 0), p = (0, 0, -1)
        assert_eq!(with(4 + TANKS + index::Q, 1e-101), None);
        assert_eq!(with(4 + TANKS + index::bob(3, 2) + 2, 1e-101), None);
    }
}
