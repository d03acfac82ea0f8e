//! The craft's continuous states x in their order, its inputs, and its memory.

use formulas::regime::Regime;
use taylor::integrator::MAX_MAGNITUDE;
use taylor::vector::Vec3;

use crate::sizes::{MODES, TANKS};

/// Places in x. Units: 1, rad/s, m, m/s, J, J, 1 and 1/s for each bob, kg, J, then m and m/s for each lump.
pub mod index {
    use super::{MODES, TANKS};

    /// Attitude, body to inertial, four numbers, scalar first.
    pub const Q: usize = 0;
    /// Angular velocity, three numbers, body axes.
    pub const OMEGA: usize = 4;
    /// Position of O, three numbers, inertial axes.
    pub const POSITION: usize = 7;
    /// Velocity of O, three numbers, inertial axes.
    pub const VELOCITY: usize = 10;
    /// Work of force and torque since the start.
    pub const WORK: usize = 13;
    /// Energy dissipated by the liquids since the start.
    pub const DISSIPATED: usize = 14;
    /// The bobs: for each tank, for each of its [`MODES`] modes, direction p and rate p', tank
    /// axes. Bobs that are not used stay at rest.
    pub const BOBS: usize = 15;

    /// The mass of liquid in each tank, kg; of effect in tanks that can drain.
    pub const LIQUID: usize = BOBS + 6 * TANKS * MODES;
    /// Energy that has gone with the outflow since the start, J.
    pub const DRAINED: usize = LIQUID + TANKS;

    /// The lumps: for each tank position from the tank's origin, m, and rate, m/s, tank axes. Of effect in
    /// tanks with a ball regime.
    pub const BALLS: usize = DRAINED + 1;

    /// Index of a lump's position and rate; tank from 0.
    pub const fn ball(tank: usize) -> usize {
        BALLS + 6 * tank
    }

    /// Index of a bob's direction and rate; tank and mode from 0.
    pub const fn bob(tank: usize, mode: usize) -> usize {
        BOBS + 6 * (tank * MODES + mode)
    }
}

/// Number of continuous states.
pub const STATES: usize = index::ball(TANKS);

/// Number of inputs: force, torque, h_wheels, mass flows.
pub const INPUTS: usize = 9 + TANKS;

/// A vector that is linear in time: `value + slope t`.
pub type Ramp = taylor::ramp::Ramp<Vec3>;

/// A number that is linear in time: `value + slope t`.
pub type Line = taylor::ramp::Ramp;

/// Inputs of the craft over one step; body axes.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Inputs {
    /// Force at O, N. On a pivot the bearing takes it.
    pub force: Ramp,
    /// Torque about O, N m.
    pub torque: Ramp,
    /// Angular momentum of the wheels relative to the body, N m s. Its slope turns the craft by
    /// -h_w'; a jump from one step to the next does so by an impulse, so that the angular
    /// momentum of everything is kept either way.
    pub h_wheels: Ramp,
    /// Mass that flows out of each tank, kg/s; in where below 0. Of no effect in a tank without a table
    /// over its fill. A jump from one step to the next sets what flows within in motion by an impulse.
    pub mass_flow: [Line; TANKS],
}

/// The ranges that a tank's motion is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ranges {
    /// Amplitude class of the wave.
    pub regime: Regime,
    /// True if the liquid is held at the tank's bottom, and every bob is within 45 degrees of the axis.
    pub in_range: bool,
}

impl Default for Ranges {
    fn default() -> Self {
        Ranges { regime: Regime::Linear, in_range: true }
    }
}

impl Ranges {
    /// Returns the ranges as a word, for saving.
    pub(crate) fn to_word(self) -> u64 {
        self.regime as u64 | u64::from(self.in_range) << 8
    }

    /// The reverse.
    pub(crate) fn from_word(word: u64) -> Option<Ranges> {
        let regime = Regime::from_number(word as u8)?;
        match word >> 8 {
            held @ 0..=1 => Some(Ranges { regime, in_range: held == 1 }),
            _ => None,
        }
    }
}

/// State of a tank's liquid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum BallState {
    /// It is at the bottom: rigid liquid and pendulums.
    #[default]
    Settled = 1,
    /// It flies through the tank as one lump.
    Flying = 2,
    /// The lump slides on the wall with drag.
    Sliding = 3,
    /// It slides without, so lightly that the drag's reaction on the craft would take the wall away from it.
    Light = 4,
    /// The same, when the pendulums could have taken it back but for the energy that this would have raised: they try again
    /// when it has come nearest to the tank's axis.
    Held = 5,
}

impl BallState {
    /// All, by their numbers.
    pub const ALL: [BallState; 5] = [
        BallState::Settled,
        BallState::Flying,
        BallState::Sliding,
        BallState::Light,
        BallState::Held,
    ];
}

/// The craft's memory: all that a saved state needs besides parameters and inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    pub(crate) time: f64,
    pub(crate) x: [f64; STATES],
    /// The wheels' momentum and the outflows that the motion has taken account of.
    pub(crate) h_wheels: Vec3,
    pub(crate) flow: [f64; TANKS],
    /// Ranges of the tanks' motion since the last event, for hosts that integrate themselves.
    pub(crate) ranges: [Ranges; TANKS],
    /// States of the tanks' liquids.
    pub(crate) ball: [BallState; TANKS],
}

impl State {
    /// Length of the flat form.
    pub const WORDS: usize = Self::REALS + 2 * TANKS;

    /// Number of words that are real numbers; the ranges follow.
    const REALS: usize = 4 + TANKS + STATES;

    /// The wheels' momentum that the motion has taken account of, N m s.
    pub fn h_wheels(&self) -> Vec3 {
        self.h_wheels
    }

    /// The state as plain words, for saving.
    pub fn to_words(&self) -> [u64; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        let held = self.h_wheels.iter().chain(&self.flow);
        let numbers = core::iter::once(&self.time).chain(held).chain(&self.x);
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

    /// The reverse; `None` when the words are no state.
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
        let bobs = (0..TANKS * MODES).all(|i| has_direction(&x[index::bob(0, i)..][..3]));
        let is_state = numbers[0].is_finite()
            && numbers[1..].iter().all(|x| x.abs() < MAX_MAGNITUDE)
            && has_direction(&x[index::Q..][..4])
            && bobs;
        let h_wheels = [numbers[1], numbers[2], numbers[3]];
        let flow = core::array::from_fn(|i| numbers[4 + i]);
        is_state.then_some(State { time: numbers[0], x, h_wheels, flow, ranges, ball })
    }
}

/// Returns true if a quaternion or a vector can be normalised.
pub(crate) fn has_direction(x: &[f64]) -> bool {
    x.iter().any(|x| x.abs() > 1.0 / MAX_MAGNITUDE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Parameters, Spacecraft};

    #[test]
    fn words_are_the_state_unless_a_number_is_too_large_or_a_direction_has_no_length() {
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
            // The time is the only one without squares.
            assert_eq!(with(place, 1e100).is_none(), place > 0, "{place}");
        }
        // q = (1, 0, 0, 0), p = (0, 0, -1)
        assert_eq!(with(4 + TANKS + index::Q, 1e-101), None);
        assert_eq!(with(4 + TANKS + index::bob(3, 2) + 2, 1e-101), None);
    }
}
