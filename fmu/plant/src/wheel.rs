//! The reaction wheel that turns a torque command into torque on the hub.
//!
//! The rotor takes up the reaction, I_w W' = -tau, where W is its rate relative to inertial axes. The torque is limited to
//! tau_max. At a speed limit the wheel gives only torque that brings W back (Rubaga's thesis, Table 5.4). W depends only on
//! the command, so that a step with a linear command is cut into pieces with linear torque before the hub's motion is known.

use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

use crate::inputs::Ramp;
use crate::parameters::Wheel;

/// A part of a step during which the torque of the wheel is linear in time: its `length`, s; the `speed` of the rotor at its
/// end, rad/s; and the level (a torque limit or zero) that the torque command has `passed` at its end.
pub(crate) struct Piece {
    pub length: f64,
    pub torque: Ramp,
    pub speed: f64,
    pub passed: Option<f64>,
}

/// Returns the torque command after `t` seconds. `passed` is the level (a torque limit or zero) that the command has just
/// reached, if any; the result is then exactly this level. Rounding might otherwise leave the command one unit in the last
/// place before the level, so that it would pass the level again and again without advancing in time.
pub(crate) fn command_after(command: Ramp, t: f64, passed: Option<f64>) -> Ramp {
    let now = command.shifted(t);
    match passed {
        Some(level) if (level - now.value) / now.slope > 0.0 => Ramp { value: level, ..now },
        _ => now,
    }
}

impl Wheel {
    pub(crate) fn problems(&self) -> Vec<String> {
        if self.speed_min <= self.speed_0 && self.speed_0 <= self.speed_max {
            return Vec::new();
        }
        vec![format!(
            "wheel.speed_0 = {} rad/s (allowed: wheel.speed_min = {} rad/s to \
             wheel.speed_max = {} rad/s)",
            self.speed_0, self.speed_min, self.speed_max
        )]
    }

    /// Returns the torque of the wheel on the hub, N m, and its slope, for a rotor `speed`, rad/s, and a torque `command`. If
    /// the command equals a torque limit, its slope decides if it is within or beyond the limit.
    pub(crate) fn torque(&self, speed: f64, command: Ramp) -> Ramp {
        let Ramp { value, slope } = command;
        if !self.enabled {
            return command;
        }
        let rises = value > 0.0 || (value == 0.0 && slope > 0.0);
        let falls = value < 0.0 || (value == 0.0 && slope < 0.0);
        let blocked = (falls && speed >= self.speed_max) || (rises && speed <= self.speed_min);
        if blocked {
            Ramp { value: 0.0, slope: 0.0 }
        } else if value > self.tau_max || (value == self.tau_max && slope > 0.0) {
            Ramp { value: self.tau_max, slope: 0.0 }
        } else if value < -self.tau_max || (value == -self.tau_max && slope < 0.0) {
            Ramp { value: -self.tau_max, slope: 0.0 }
        } else {
            command
        }
    }

    pub(crate) fn next(&self, speed: f64, command: Ramp, h: f64) -> Piece {
        let torque = self.torque(speed, command);
        if !self.enabled {
            let speed = speed - torque.integral(h) / self.inertia;
            return Piece { length: h, torque, speed, passed: None };
        }
        // The piece ends where the torque command passes a torque limit or zero.
        let (mut length, mut passed) = (h, None);
        if command.slope != 0.0 {
            for level in [-self.tau_max, 0.0, self.tau_max] {
                let t = (level - command.value) / command.slope;
                if t > 0.0 && t < length {
                    (length, passed) = (t, Some(level));
                }
            }
        }
        // The rotor reaches a speed limit. Since the torque keeps its sign within a piece, this is the only root of a t + b
        // t^2/2 = (speed - limit) I_w ahead.
        let end = speed - torque.integral(length) / self.inertia;
        let limit = end.max(self.speed_min).min(self.speed_max);
        if limit != end {
            let Ramp { value: a, slope: b } = torque;
            let turn = (speed - limit) * self.inertia;
            let root = libm::sqrt(f64::max(a * a + 2.0 * b * turn, 0.0));
            let t = 2.0 * turn / (a + root.copysign(turn));
            return Piece { length: t.max(0.0).min(length), torque, speed: limit, passed: None };
        }
        Piece { length, torque, speed: end, passed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(wheel: &Wheel, command: Ramp, h: f64) -> (f64, f64, usize) {
        let (mut speed, mut t, mut impulse, mut pieces) = (wheel.speed_0, 0.0, 0.0, 0);
        let mut passed = None;
        while t < h {
            let now = command_after(command, t, passed);
            let piece = wheel.next(speed, now, h - t);
            impulse += piece.torque.integral(piece.length);
            (speed, t, pieces) = (piece.speed, t + piece.length, pieces + 1);
            passed = piece.passed.or(passed);
            assert!(
                pieces < 10,
                "a linear command must give fewer than ten pieces: {command:?} at {t}"
            );
        }
        (impulse, speed, pieces)
    }

    /// If rounding of times made the command pass a limit twice, the step would be divided at the same limit again and again,
    /// into parts of zero length, until it is refused.
    #[test]
    fn a_torque_ramp_passes_each_limit_of_the_wheel_once_despite_rounding() {
        let mut rng = fastrand::Rng::with_seed(1);
        for _ in 0..100_000 {
            let mut between = |low: f64, high: f64| low + (high - low) * rng.f64();
            let w = Wheel { tau_max: between(0.01, 0.3), ..wheel() };
            let command = Ramp { value: between(-0.5, 0.5), slope: between(-1.0, 1.0) };
            run(&w, command, between(0.1, 3.0));
        }
    }

    fn wheel() -> Wheel {
        Wheel { enabled: true, ..Wheel::default() }
    }

    #[test]
    fn a_wheel_at_a_speed_limit_gives_only_torque_that_leads_away_from_the_limit() {
        let w = wheel();
        let none = Ramp { value: 0.0, slope: 0.0 };
        for (speed, blocked) in [(w.speed_min, 1.0), (w.speed_max, -1.0)] {
            for value in [0.0, 0.1] {
                let command = |sign: f64| Ramp { value: sign * value, slope: sign };
                assert_eq!(w.torque(speed, command(blocked)), none);
                assert_eq!(w.torque(speed, command(-blocked)), command(-blocked));
            }
        }
        for sign in [1.0, -1.0] {
            let at = |slope: f64| w.torque(w.speed_0, Ramp { value: sign * w.tau_max, slope });
            let limit = Ramp { value: sign * w.tau_max, slope: 0.0 };
            assert_eq!((at(sign), at(0.0)), (limit, limit));
            assert_eq!(at(-sign), Ramp { slope: -sign, ..limit });
        }
    }

    #[test]
    fn the_torque_of_a_wheel_is_clipped_at_its_limit() {
        // A ramp through 0 from -1 to 1 N m in 2 s has zero impulse; both ends are clipped.
        let (impulse, speed, _) = run(&wheel(), Ramp { value: -0.5, slope: 0.5 }, 2.0);
        assert!(impulse.abs() < 1e-15);
        assert!((speed - wheel().speed_0).abs() < 1e-10);
        let (impulse, ..) = run(&wheel(), Ramp { value: 1.0, slope: 0.0 }, 0.01);
        assert!((impulse - 0.0026).abs() < 1e-15);
    }

    #[test]
    fn the_hub_gains_the_momentum_that_the_rotor_loses_until_saturation() {
        let w = wheel();
        // 0.1 N m brakes the rotor from 1600 to 200 rpm in 3.3 s; after that the torque is 0.
        let (impulse, speed, _) = run(&w, Ramp { value: 0.1, slope: 0.0 }, 10.0);
        assert!((impulse - w.inertia * (w.speed_0 - w.speed_min)).abs() < 1e-15);
        assert_eq!(speed, w.speed_min);
    }

    #[test]
    fn at_its_speed_limit_a_rotor_still_takes_torque_that_slows_it_down() {
        let w = Wheel { speed_0: wheel().speed_min, ..wheel() };
        assert_eq!(w.torque(w.speed_0, Ramp { value: 0.1, slope: 0.0 }).value, 0.0);
        assert_eq!(w.torque(w.speed_0, Ramp { value: -0.1, slope: 0.0 }).value, -0.1);
    }

    fn ramp(value: f64, slope: f64) -> Ramp {
        Ramp { value, slope }
    }

    #[test]
    fn an_initial_wheel_speed_outside_its_limits_is_refused_and_a_speed_at_a_limit_is_accepted() {
        let Wheel { speed_min: low, speed_max: high, .. } = wheel();
        let wrong = |speed_0: f64| !Wheel { speed_0, ..wheel() }.problems().is_empty();
        assert_eq!([low, high, low - 1e-6, high + 1e-6].map(wrong), [false, false, true, true]);
    }

    #[test]
    fn a_torque_command_that_leaves_a_limit_outwards_is_clipped_and_one_that_falls_below_is_not() {
        let w = wheel();
        let (limit, middle) = (w.tau_max, w.speed_0);
        for sign in [1.0, -1.0] {
            let held = ramp(sign * limit, 0.0);
            assert_eq!(w.torque(middle, ramp(sign * limit, sign)), held, "outwards");
            assert_eq!(w.torque(middle, held), held);
            let inwards = ramp(sign * limit, -sign);
            assert_eq!(w.torque(middle, inwards), inwards);
            assert_eq!(w.torque(middle, ramp(sign * 2.0 * limit, -sign)), held);
            let within = ramp(sign * 0.5 * limit, sign);
            assert_eq!(w.torque(middle, within), within);
        }
        // Positive torque on the hub brakes the rotor, negative torque accelerates it.
        for (speed, away) in [(w.speed_max, -1.0), (w.speed_min, 1.0)] {
            let nothing = ramp(0.0, 0.0);
            for command in [ramp(away * 0.1, 0.0), ramp(away * 0.1, -away), ramp(0.0, away)] {
                assert_eq!(w.torque(speed, command), nothing, "{command:?}");
            }
            for command in [ramp(-away * 0.1, 0.0), ramp(-away * 0.1, away), ramp(0.0, -away)] {
                assert_eq!(w.torque(speed, command), command);
            }
        }
    }

    #[test]
    fn an_integration_piece_ends_where_the_command_passes_a_limit_or_zero() {
        let w = Wheel { inertia: 1.0, ..wheel() }; // The speed limits are far away.
        let next = |command: Ramp| w.next(w.speed_0, command, 10.0).length;
        // The command starts at -0.5 N m and rises by 0.1 N m/s: to -0.26 N m in 2.4 s, to 0 in another 2.6 s, and
        // to 0.26 N m.
        for (from, length) in [(-0.5, 2.4), (-0.26, 2.6), (0.0, 2.6)] {
            assert!((next(ramp(from, 0.1)) - length).abs() < 1e-12, "{from}");
            assert!((next(ramp(-from, -0.1)) - length).abs() < 1e-12, "{from}");
        }
        assert_eq!(next(ramp(0.0, 0.0)), 10.0);
    }

    /// The expected time t is the solution of a t + b t^2/2 = I_w (W_0 - W), that is, the impulse of the torque a + b t
    /// equals the change of the rotor's angular momentum. I_w is the inertia of the rotor, W_0 its speed at the start, and W
    /// its speed limit.
    #[test]
    fn the_rotor_reaches_its_speed_limit_at_the_time_that_the_impulse_of_the_torque_gives() {
        let w = Wheel { speed_0: 100.0, speed_min: 20.0, speed_max: 150.0, ..wheel() };
        for (command, limit) in [
            (ramp(0.1, 0.0), w.speed_min),
            (ramp(0.1, 0.02), w.speed_min),
            (ramp(0.2, -0.02), w.speed_min),
            (ramp(-0.1, 0.0), w.speed_max),
            (ramp(-0.1, -0.02), w.speed_max),
            (ramp(0.0, -0.05), w.speed_max),
        ] {
            let Piece { length, torque, speed, .. } = w.next(w.speed_0, command, 10.0);
            assert_eq!((torque, speed), (command, limit));
            let turned = command.integral(length) / w.inertia;
            assert!((w.speed_0 - turned - limit).abs() < 1e-12, "{command:?} {length}");
            // Before the limit only the torque determines the rotor's speed.
            let Piece { length: all, speed: before, .. } = w.next(w.speed_0, command, length / 2.0);
            assert_eq!(all, length / 2.0);
            let turned = command.integral(length / 2.0) / w.inertia;
            assert!((w.speed_0 - turned - before).abs() < 1e-12, "{command:?}");
        }
    }

    /// Without a wheel (`wheel.enabled` = false) the torque has no limits. Its integral is still added up as a speed.
    #[test]
    fn an_actuator_without_a_wheel_gives_the_commanded_torque_and_integrates_it() {
        let w = Wheel { enabled: false, ..wheel() };
        let command = ramp(5.0, -1.0);
        assert_eq!(w.torque(1e6, command), command);
        // A torque of 5 N m that falls by 1 N m/s over 2 s has an impulse of 8 N m s.
        let Piece { length, torque, speed, .. } = w.next(100.0, command, 2.0);
        assert_eq!((length, torque), (2.0, command));
        assert!((speed - (100.0 - 8.0 / w.inertia)).abs() < 1e-9);
    }
}
