use identify::engine::cause::{Effect, cause};

#[test]
fn the_cause_is_clearly_better_than_other_effects_that_fit_and_not_clearly_worse_than_any_effect() {
    let effect = |gain: f64, fits: bool| Effect { unknown: 0, size: (1.0, 0.1), gain, fits };
    let named = |all: &[Effect]| cause(all).map(|effect| effect.gain);
    assert_eq!(named(&[effect(100.0, true), effect(80.0, true)]), Some(100.0));
    assert_eq!(named(&[effect(100.0, true), effect(95.0, true)]), None);
    assert_eq!(named(&[effect(105.0, false), effect(100.0, true)]), Some(100.0));
    assert_eq!(named(&[effect(200.0, false), effect(100.0, true)]), None);
}
