//! Tests of the steps of Co-Simulation, and of inputs with slopes.

use super::*;
use crate::variable::Access;

/// Returns the level of a vessel, m, after `h` seconds, in closed form. The vessel leaks at the rate of 1/2 of its level per
/// second. The level starts at `x`, m, and the inflow at `q` with the slope `slope`.
fn level(x: f64, q: f64, slope: f64, h: f64) -> f64 {
    let e = (-0.5 * h).exp();
    x * e + 2.0 * q * (1.0 - e) + 2.0 * slope * (h - 2.0 * (1.0 - e))
}

fn slope(instance: &mut Subject, name: &str, slope: f64) -> Result<(), Fault> {
    instance.set_input_derivatives(&[reference(name)], &[1], &[slope])
}

fn rate(instance: &mut Subject, name: &str) -> Result<f64, Fault> {
    let mut answer = [0.0];
    instance.output_derivatives(&[reference(name)], &[1], &mut answer).map(|()| answer[0])
}

#[test]
fn inputs_change_along_their_derivatives_within_a_step() {
    let mut instance = started(CS, &[]);
    slope(&mut instance, "q[1]", 2.0).unwrap();
    instance.do_step(0.0, 0.5).unwrap();
    assert_eq!(instance.time(), 0.5);
    let x = level(3.0, 1.0, 2.0, 0.5);
    close(real(&mut instance, "level[1]"), x, 1e-15);
    close(real(&mut instance, "level[2]"), 4.0, 1e-15);
    assert_eq!(real(&mut instance, "q[1]"), 2.0);
    // The slope of q[1] was valid only for the first step.
    instance.do_step(0.5, 0.25).unwrap();
    close(real(&mut instance, "level[1]"), level(x, 2.0, 0.0, 0.25), 1e-15);
    assert_eq!((real(&mut instance, "q[1]"), instance.time()), (2.0, 0.75));
}

#[test]
fn a_step_must_be_longer_than_zero_and_begin_at_the_end_of_the_step_before() {
    let mut instance = started(CS, &[]);
    for (h, text) in [(0.0, "0.0"), (-1.0, "-1.0"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        assert_eq!(
            unchanged(&mut instance, |i| i.do_step(0.0, h)),
            format!(
                "fmi2DoStep: communicationStepSize = {text} s (allowed: greater than 0, finite)"
            )
        );
    }
    assert_eq!(
        unchanged(&mut instance, |i| i.do_step(0.5, 1.0)),
        "fmi2DoStep: currentCommunicationPoint = 0.5 s, but the last step ended at 0.0 s"
    );
    assert!(unchanged(&mut instance, |i| i.do_step(f64::NAN, 1.0)).contains("= NaN s"));
    assert!(unchanged(&mut instance, |i| i.do_step(-0.5, 1.0)).contains("= -0.5 s"));
}

/// Hosts add up step sizes in different ways. Two times count as equal within 1e-9 of the step size or of the time since the
/// start, whichever is larger, plus 8 rounding errors of the largest time.
#[test]
fn communication_point_may_be_off_by_rounding_errors() {
    for (start, before, h, slack) in [
        (100.0, 100.0, 0.01, 1e-7),
        (-300.0, 200.0, 0.01, 2e-7),
        (0.0, 0.0, 1.0, 1e-9),
        (1e9, 1.0, 0.01, 1e-9 + 1.7764e-6),
        (-1e9, 1e9, 1e-9, 1.0 + 1.7764e-6),
    ] {
        for sign in [-1.0, 1.0] {
            let mut instance = fresh(CS);
            instance.setup_experiment(None, start, None).unwrap();
            instance.enter_initialization_mode().unwrap();
            instance.exit_initialization_mode().unwrap();
            if before > 0.0 {
                instance.do_step(start, before).unwrap();
            }
            let at = |share: f64| start + before + sign * share * slack;
            unchanged(&mut instance, |i| i.do_step(at(1.1), h));
            instance.do_step(at(0.9), h).unwrap();
            assert_eq!(instance.time(), at(0.9) + h);
        }
    }
}

/// The stop time may be passed by 1e-9 of the step size or of the time since the start, whichever is larger, plus 8 rounding
/// errors.
#[test]
fn the_last_step_may_pass_the_stop_time_by_rounding_errors() {
    for (start, stop, slack) in [
        (0.0, 1000.0, 1e-6),
        (-1100.0, -1000.0, 1e-7),
        (-1.0, 0.0, 1e-9),
        (1e9, 1e9 + 1.0, 1.7764e-6 + 1e-9),
    ] {
        let mut instance = fresh(CS);
        instance.setup_experiment(None, start, Some(stop)).unwrap();
        instance.enter_initialization_mode().unwrap();
        instance.exit_initialization_mode().unwrap();
        let to = |share: f64| stop + share * slack - start;
        let why = unchanged(&mut instance, |i| i.do_step(start, to(1.1)));
        assert!(why.contains(&format!("would pass the stop time {stop:?} s")), "{why}");
        for share in [0.9, 0.0] {
            assert_eq!(instance.clone().do_step(start, to(share)), Ok(()));
        }
    }
}

#[test]
fn no_step_is_allowed_after_a_step_that_ends_at_the_stop_time() {
    let mut instance = fresh(CS);
    instance.setup_experiment(None, 0.0, Some(1.0)).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance.do_step(0.0, 1.0).unwrap();
    assert_eq!(
        unchanged(&mut instance, |i| i.do_step(1.0, 0.5)),
        "fmi2DoStep: the step to 1.5 s would pass the stop time 1.0 s"
    );
}

/// The smallest allowed value of the test model's input q, an inflow, is 1. Because of rounding, a ramp that falls from 4
/// may end below 1 by up to 1e-9 of its fall; it then ends at exactly 1.
#[test]
fn an_input_ramp_down_to_the_smallest_allowed_value_is_accepted() {
    let after = |end: f64| {
        let mut instance = started(CS, &[("q[1]", 4.0)]);
        slope(&mut instance, "q[1]", end - 4.0).unwrap();
        let done = instance.do_step(0.0, 1.0);
        done.map(|()| real(&mut instance, "q[1]"))
    };
    assert_eq!(after(1.0), Ok(1.0));
    assert_eq!(after(1.0 - 2.7e-9), Ok(1.0));
    assert_eq!(after(2.5), Ok(2.5));
    assert!(refused(after(1.0 - 3.3e-9)).contains("at the end of the step q[1] = 0.9999"));
    assert!(refused(after(0.5)).contains("at the end of the step q[1] = 0.5 m/s"));
    assert!(refused(after(10.5)).contains("at the end of the step q[1] = 10.5 m/s"));
    // An input without a smallest value follows its slope to any value.
    let mut instance = started(CS, &[]);
    slope(&mut instance, "w", -2.0).unwrap();
    instance.do_step(0.0, 1.0).unwrap();
    assert_eq!((real(&mut instance, "w"), real(&mut instance, "z")), (-2.0, -1.0));
}

#[test]
fn a_refused_step_keeps_the_slopes_of_the_inputs() {
    let mut instance = started(CS, &[("w", 1.0)]);
    slope(&mut instance, "w", 2.0).unwrap();
    let why = unchanged(&mut instance, |i| i.do_step(0.0, 1.0));
    assert!(why.contains("at the end of the step w = 3.0 m/s"), "{why}");
    // A refused step also keeps the slopes of the step before it.
    instance.do_step(0.0, 0.5).unwrap();
    assert!(instance.past_slopes);
    let why = unchanged(&mut instance, |i| i.do_step(0.5, f64::MAX));
    assert!(why.contains("at the end of the step z = inf m"), "{why}");
}

#[test]
fn an_input_that_is_the_derivative_of_another_input_changes_the_other_input() {
    let mut instance = started(CS, &[("z", 1.0), ("w", 0.5)]);
    instance.do_step(0.0, 0.5).unwrap();
    assert_eq!(real(&mut instance, "z"), 1.25);
    slope(&mut instance, "w", 2.0).unwrap();
    // Output derivatives belong to the next step: the platform rises at w now, even if w changes later.
    assert_eq!(rate(&mut instance, "room"), Ok(-0.5));
    instance.do_step(0.5, 0.5).unwrap();
    assert_eq!(real(&mut instance, "w"), 1.5);
    assert_eq!(real(&mut instance, "z"), 1.25 + 0.5 * 0.5 + 0.5 * 2.0 * 0.25);
}

/// At the end of a step the outputs are limits from the left, computed with the slopes of this step. After the host has set a
/// value or slope of any input, the outputs belong to the next step and no longer use the old slopes.
#[test]
fn input_slopes_of_the_last_step_are_kept_until_an_input_is_set() {
    let ramped = || {
        let mut instance = started(CS, &[]);
        slope(&mut instance, "q[1]", 2.0).unwrap();
        assert_eq!(real(&mut instance, "trend"), 2.0);
        instance.do_step(0.0, 0.5).unwrap();
        assert!(instance.past_slopes && !instance.sloped);
        assert_eq!(real(&mut instance, "trend"), 2.0);
        instance
    };
    let mut set_anew = ramped();
    set(&mut set_anew, "q[2]", 3.0).unwrap();
    assert_eq!(real(&mut set_anew, "trend"), 0.0);
    let mut sloped_anew = ramped();
    slope(&mut sloped_anew, "q[2]", 0.25).unwrap();
    let why = unchanged(&mut ramped(), |i| slope(i, "q[2]", f64::NAN));
    assert!(why.contains("derivative of q[2] = NaN"), "{why}");
    assert_eq!(real(&mut sloped_anew, "trend"), 0.25);
    // After one more step, with constant inputs, the slopes of the first step are dropped.
    let mut held = ramped();
    held.do_step(0.5, 0.5).unwrap();
    assert_eq!(real(&mut held, "trend"), 0.0);
    assert!(!held.past_slopes);
    // Derivatives that the host reads belong to the next step, so that they do not use the old slopes, and reading them does
    // not drop the slopes.
    let mut asked = ramped();
    let net = real(&mut asked, "net[1]");
    assert_eq!(rate(&mut asked, "net[1]"), Ok(-0.5 * net));
    assert!(asked.past_slopes);
    assert_eq!(real(&mut asked, "trend"), 2.0);
}

#[test]
fn input_slopes_are_not_kept_for_a_model_whose_outputs_do_not_use_them() {
    let mut instance = spring(CS);
    let force = Spring::table().find("F").unwrap();
    instance.set_input_derivatives(&[force], &[1], &[3.0]).unwrap();
    instance.do_step(0.0, 0.5).unwrap();
    assert!(!instance.past_slopes);
    let Access::Input(ramp) = Spring::table().inputs()[0].access else { panic!("F is an input") };
    assert_eq!(ramp(&mut instance.inputs, 0).map(|x| *x), [1.5, 0.0]);
}

#[test]
fn input_slopes_that_are_not_finite_or_out_of_range_are_refused() {
    let mut instance = started(CS, &[]);
    let names = references(["q[1]", "w", "z"]);
    assert_eq!(
        unchanged(&mut instance, |i| i.set_input_derivatives(&names, &[1; 3], &[1.0, 9e9, 0.0])),
        "fmi2SetRealInputDerivatives: derivative of w = 9000000000.0 (allowed: -7999999999.999999 to \
         7999999999.999999 m/s/s)"
    );
    assert_eq!(
        unchanged(&mut instance, |i| slope(i, "z", f64::INFINITY)),
        "fmi2SetRealInputDerivatives: derivative of z = inf (allowed: any finite number)"
    );
    assert_eq!(
        unchanged(&mut instance, |i| slope(i, "sum", 1.0)),
        "fmi2SetRealInputDerivatives: sum is not an input"
    );
    assert_eq!(
        unchanged(&mut instance, |i| i.set_input_derivatives(&names, &[1, 2, 1], &[0.0; 3])),
        "fmi2SetRealInputDerivatives: derivative of order 2 of w (allowed: order 1)"
    );
    assert_eq!(
        unchanged(&mut instance, |i| i.output_derivatives(&names, &[1, 1, 0], &mut [0.0; 3])),
        "fmi2GetRealOutputDerivatives: derivative of order 0 of z (allowed: order 1)"
    );
    assert_eq!(slope(&mut instance, "w", 7.9e9), Ok(()));
    assert_eq!(slope(&mut instance, "z", 1e300), Ok(()));
}

#[test]
fn output_derivatives_follow_from_state_derivatives_and_input_derivatives() {
    let mut instance = started(CS, &[]);
    slope(&mut instance, "q[2]", 3.0).unwrap();
    // net = q - k level, and level' = net.
    assert_eq!(rate(&mut instance, "net[1]"), Ok(-0.5 * -0.5));
    assert_eq!(rate(&mut instance, "net[2]"), Ok(3.0));
    assert_eq!(rate(&mut instance, "level[1]"), Ok(-0.5));
    assert_eq!(rate(&mut instance, "sum"), Ok(-0.5));
    assert!(refused(rate(&mut instance, "leak")).contains("leak has no derivative"));
    assert!(refused(rate(&mut fresh(CS), "sum")).contains("not allowed in state"));
}

/// A valve of the test model opens if a platform, whose height is an input, is high enough. Between steps the outputs show
/// the valve in the position that the present inputs cause, but the valve in the model moves only in the next step.
#[test]
fn reading_outputs_uses_the_present_inputs_and_does_not_change_the_model() {
    let mut instance = started(CS, &[]);
    set(&mut instance, "z", 3.0).unwrap();
    assert_eq!(get(&mut instance, "open"), Ok(Value::Boolean(true)));
    set(&mut instance, "z", 1.0).unwrap();
    assert_eq!(get(&mut instance, "open"), Ok(Value::Boolean(false)));
    assert_eq!(get(&mut instance, "events"), Ok(Value::Integer(0)));
    set(&mut instance, "z", 3.0).unwrap();
    assert_eq!(get(&mut instance, "valve"), Ok(Value::Integer(2)));
    // If the valve had stayed open in the model, the step would have no event.
    instance.do_step(0.0, 1e-9).unwrap();
    assert_eq!(instance.event_count(), 1);
    close(real(&mut instance, "level[1]"), 1.5, 1e-8);
    assert_eq!(instance.last_event(), "valve opens at 0.000000001 s");
}

#[test]
fn the_model_receives_the_hosts_time_before_each_step() {
    // The event is due at 100.5 s plus half of the tolerance, and the time of the host is later.
    let mut instance = fresh(CS);
    set(&mut instance, "inspection", 100.5 + 0.5e-7).unwrap();
    instance.setup_experiment(None, 0.0, None).unwrap();
    instance.enter_initialization_mode().unwrap();
    instance.exit_initialization_mode().unwrap();
    instance.do_step(0.0, 100.0).unwrap();
    instance.do_step(100.0 + 0.9e-7, 0.5).unwrap();
    assert_eq!(instance.model.unwrap().next_time_event(), None);
}
