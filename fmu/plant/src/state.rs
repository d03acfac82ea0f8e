//! The plant's state and the indices of its parts. Continuous states and event indicators are defined only in this file.

use formulas::limits::LimitedBy;
use formulas::regime::Regime;
use taylor::integrator::{MAX_MAGNITUDE, add_time};

use crate::contact::Contact;
use crate::imu::{FLICKERS, Gyro};

/// Indices of the continuous states.
/// - `THETA`, `OMEGA`: angle of the hub, rad, and its rate, rad/s.
/// - `WORK`, `HEAT`: work of actuator and external torque, and dissipated energy, since the start, J.
/// - `STUCK_TIME`: time in stiction since the start, s.
/// - `WHEEL_SPEED`: rate of the rotor relative to inertial axes, rad/s.
/// - `BRISTLE`: deflection of the bristles of LuGre friction, rad.
///
/// The index of a new state must be below [`x::SLOSH`].
#[allow(missing_docs)]
pub mod x {
    use crate::parameters::MODES;

    pub const THETA: usize = 0;
    pub const OMEGA: usize = 1;
    pub const WORK: usize = 2;
    pub const HEAT: usize = 3;
    pub const STUCK_TIME: usize = 4;
    pub const WHEEL_SPEED: usize = 5;
    pub const BRISTLE: usize = 6;
    /// Index of the first slosh coordinate. Each mode has four coordinates: radial, tangential, and the rates of both. Their
    /// unit depends on the slosh model; coordinates of unused modes are 0.
    pub const SLOSH: usize = 7;
    pub const COUNT: usize = SLOSH + 4 * MODES;
}

/// Number of continuous states.
pub const STATES: usize = x::COUNT;

/// Indices of the event indicators, which are positive between events and cross zero at events: the hub comes to rest; a
/// stuck hub breaks away; the torque command passes a torque limit of the wheel or changes its sign; the rotor reaches its
/// highest or lowest speed.
#[allow(missing_docs)]
pub mod indicator {
    pub const REST: usize = 0;
    pub const BREAK_AWAY_FORWARD: usize = 1;
    pub const BREAK_AWAY_BACKWARD: usize = 2;
    pub const TORQUE_MAX: usize = 3;
    pub const TORQUE_MIN: usize = 4;
    pub const TORQUE_SIGN: usize = 5;
    pub const SPEED_MAX: usize = 6;
    pub const SPEED_MIN: usize = 7;
    pub const COUNT: usize = 8;
}

/// Number of event indicators.
pub const INDICATORS: usize = indicator::COUNT;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ranges {
    pub regime: Regime,
    pub baffle: bool,
    pub limited_by: LimitedBy,
}

/// State of the plant. Together with parameters and inputs it determines all further motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    pub(crate) time: f64,
    pub(crate) x: [f64; STATES],
    pub(crate) contact: Contact,
    pub(crate) ranges: Ranges,
    pub(crate) event_count: i32,
    pub(crate) event_time: f64,
    /// Time since the start, s, and its rounding error. The plant adds up the lengths of all steps, because the simulation
    /// times of an importing tool may have rounding errors, may drift, or may start at 1e9 s.
    pub(crate) elapsed: [f64; 2],
    /// Specific force at the start, m/s2, to which the damping ratio of the liquid refers.
    pub(crate) start_g: f64,
    pub(crate) axial: Axial,
    pub(crate) gyro: Gyro,
}

/// The `work`, J, that a changing specific force has done since the start, and the specific force `g`, m/s2, up to which
/// this work is known. `accepted` is the last accepted step in Model Exchange. It is `None` after a step of Co-Simulation,
/// because g can then only jump, and the work of a jump depends only on the present height of the liquid.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Axial {
    pub work: f64,
    pub g: f64,
    pub accepted: Option<Accepted>,
}

/// The liquid at the end of an accepted step in Model Exchange: mass times height, kg m, and the rate of this product.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Accepted {
    pub time: f64,
    pub mass_height: f64,
    pub rate: f64,
}

impl Axial {
    pub(crate) fn is_finite(&self) -> bool {
        let Accepted { time, mass_height, rate } = self.accepted.unwrap_or_default();
        [self.work, self.g, time, mass_height, rate].iter().all(|x| x.abs() < MAX_MAGNITUDE)
    }
}

impl State {
    /// Number of 64-bit words in which a state is saved.
    pub const WORDS: usize = 2 + Self::REALS;

    const REALS: usize = 13 + FLICKERS + STATES;

    /// Returns the state as 64-bit words, from which [`State::from_words`] restores it.
    pub fn to_words(&self) -> [u64; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        let discrete = [
            self.contact as i8 as u8,
            self.ranges.regime as u8,
            u8::from(self.ranges.baffle) | u8::from(self.axial.accepted.is_some()) << 1,
        ];
        let Accepted { time, mass_height, rate } = self.axial.accepted.unwrap_or_default();
        words[0] = u64::from(self.event_count as u32)
            | u64::from(discrete[0]) << 32
            | u64::from(discrete[1]) << 40
            | u64::from(discrete[2]) << 48
            | (self.ranges.limited_by as u64) << 56;
        words[1] = self.gyro.next;
        let reals = [
            self.time,
            self.event_time,
            self.elapsed[0],
            self.elapsed[1],
            self.start_g,
            self.axial.work,
            time,
            self.axial.g,
            mass_height,
            rate,
            self.gyro.bias,
            self.gyro.held,
            self.gyro.walk,
        ];
        let all = reals.iter().chain(&self.gyro.flicker).chain(&self.x);
        for (word, real) in words[2..].iter_mut().zip(all) {
            *word = real.to_bits();
        }
        words
    }

    /// Restores a state from the words that [`State::to_words`] has returned; `None` if they are not a valid state.
    pub fn from_words(words: &[u64; Self::WORDS]) -> Option<State> {
        let contact = match (words[0] >> 32) as u8 as i8 {
            -1 => Contact::Backward,
            0 => Contact::Stuck,
            1 => Contact::Forward,
            _ => return None,
        };
        let regime = Regime::from_number((words[0] >> 40) as u8)?;
        let limited_by = LimitedBy::from_number((words[0] >> 56) as u8)?;
        let flags = words[0] >> 48 & 0xff;
        let (baffle, is_accepted) = (flags & 1 != 0, flags & 2 != 0);
        let mut reals = [0.0; Self::REALS];
        for (real, word) in reals.iter_mut().zip(&words[2..]) {
            *real = f64::from_bits(*word);
        }
        let (head, rest) = reals.split_first_chunk()?;
        let (flicker, x) = rest.split_first_chunk()?;
        let [
            time,
            event_time,
            elapsed,
            rest,
            start_g,
            work,
            accepted_time,
            g,
            mass_height,
            rate,
            bias,
            held,
            walk,
        ] = *head;
        let finite = reals.iter().all(|real| real.is_finite()) && flags < 4;
        let accepted = Accepted { time: accepted_time, mass_height, rate };
        // Double precision cannot distinguish the times of samples beyond this number.
        let countable = words[1] <= 1 << f64::MANTISSA_DIGITS;
        (finite && countable).then_some(State {
            time,
            x: x.try_into().ok()?,
            contact,
            ranges: Ranges { regime, baffle, limited_by },
            event_count: words[0] as u32 as i32,
            event_time,
            elapsed: [elapsed, rest],
            start_g,
            axial: Axial { work, g, accepted: is_accepted.then_some(accepted) },
            gyro: Gyro { next: words[1], bias, held, walk, flicker: *flicker },
        })
    }

    pub(crate) fn slosh(&self) -> &[[f64; 4]] {
        self.x[x::SLOSH..].as_chunks().0
    }

    pub(crate) fn slosh_mut(&mut self) -> &mut [[f64; 4]] {
        self.x[x::SLOSH..].as_chunks_mut().0
    }

    /// Sets the clock to `t` seconds after `begin`, which contains the simulation time, s, and the time since the start with
    /// its rounding error, s.
    pub(crate) fn set_clock(&mut self, begin: (f64, [f64; 2]), t: f64) {
        let (time, elapsed) = begin;
        self.time = time + t;
        self.elapsed = add_time(elapsed, t);
    }

    pub(crate) fn record_contact(&mut self, contact: Contact, time: f64) -> bool {
        let changes = contact != self.contact;
        if changes {
            self.contact = contact;
            self.event_count = self.event_count.saturating_add(1);
            self.event_time = time;
        }
        changes
    }

    pub(crate) fn is_finite(&self, modes: usize) -> bool {
        let within = |x: &f64| x.abs() < MAX_MAGNITUDE; // NaN is not
        let hub = [x::THETA, x::OMEGA, x::WORK, x::HEAT];
        hub.iter().all(|place| within(&self.x[*place]))
            && self.slosh()[..modes].iter().flatten().all(within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saved_data_that_are_no_valid_state_of_the_plant_are_refused() {
        let state = State {
            time: 1.5,
            x: core::array::from_fn(|i| i as f64 - 3.0),
            contact: Contact::Backward,
            ranges: Ranges { regime: Regime::Nonlinear, baffle: true, limited_by: LimitedBy::Spin },
            event_count: -1,
            event_time: 0.25,
            elapsed: [8.5, 1e-16],
            start_g: 9.81,
            axial: Axial {
                work: 0.5,
                g: 2.0,
                accepted: Some(Accepted { time: 1.0, mass_height: 3.0, rate: 4.0 }),
            },
            gyro: Gyro {
                next: 12,
                bias: -1e-5,
                held: 0.125,
                walk: 2e-6,
                flicker: [3e-6; FLICKERS],
            },
        };
        let words = state.to_words();
        assert_eq!(State::from_words(&words), Some(state));
        let with = |place: usize, word: u64| {
            let mut wrong = words;
            wrong[place] = word;
            State::from_words(&wrong)
        };
        let none = 1 << 56;
        assert!(with(0, 1 << 40 | none).is_some());
        assert_eq!(with(0, 2 << 32 | 1 << 40 | none), None, "no such contact");
        assert_eq!(with(0, 1 << 32 | none), None, "no such regime");
        assert_eq!(with(0, 1 << 40 | 4 << 48 | none), None, "no such flag");
        assert_eq!(with(0, 1 << 40), None, "no such reason");
        assert_eq!(with(1, u64::MAX), None, "samples that can't be counted");
        for place in 2..State::WORDS {
            assert_eq!(with(place, f64::NAN.to_bits()), None, "{place}");
        }
    }
}
