//! Measurement of the frequency of a tank's free oscillation by simulation. The tests of `tests/physics`
//! include this file, too.

use std::f64::consts::TAU;

use plant::{FrictionModel, Inputs, Parameters, Plant, SloshModel};

/// Returns a hub without damping and friction that hardly moves, because the liquid has 2 kg and the hub 1e9 kg m2.
pub fn held(model: SloshModel, depth: f64) -> Parameters {
    let mut p = Parameters::default();
    (p.slosh.model, p.friction.model) = (model, FrictionModel::None);
    p.hub.inertia = 1e9;
    p.tank.h = depth;
    (p.slosh.zeta_from_correlation, p.slosh.zeta) = (false, 0.0);
    p
}

/// Returns the mean angular frequency, rad/s, of the slosh angle, or in circular motion of its direction. It follows from the
/// instants at which the tangential angle rises through 0. Linear interpolation between samples every `h` seconds finds each
/// instant to 1e-6 of a period for 1 ms, and to 4e-7 for 0.1 ms.
fn frequency(p: &Parameters, h: f64) -> f64 {
    let inputs = Inputs::default();
    let mut plant = Plant::new(p, &inputs, 0.0, 1e-11).unwrap();
    let (mut last, mut crossings) = (plant.outputs(&inputs).slosh_angle, Vec::new());
    for k in 1..(20.0 / h).round() as i32 {
        plant.step(&inputs, h).unwrap();
        let now = plant.outputs(&inputs).slosh_angle;
        if last < 0.0 && now >= 0.0 {
            crossings.push(h * (f64::from(k) - now / (now - last)));
        }
        last = now;
    }
    let cycles = (crossings.len() - 1) as f64;
    TAU * cycles / (crossings[crossings.len() - 1] - crossings[0])
}

pub fn shifts(model: SloshModel, depth: f64, h: f64) -> [f64; 2] {
    shifts_of(held(model, depth), h)
}

/// Returns the relative change of the squared frequency per squared slosh angle, for planar and for circular motion of 0.05
/// rad. Terms of the next order change it by some 2.5e-3 of its value. The motion is sampled every `h` seconds.
pub fn shifts_of(mut p: Parameters, h: f64) -> [f64; 2] {
    let amplitude: f64 = 0.05;
    let plant = Plant::new(&p, &Inputs::default(), 0.0, 1e-9).unwrap();
    let linear = (9.81 / plant.calculated().length[0]).sqrt();
    let shift = |omega: f64| ((omega / linear).powi(2) - 1.0) / amplitude.powi(2);
    p.init.slosh_angle = amplitude.asin();
    let planar = shift(frequency(&p, h));
    // The sine of the angle is displacement divided by length. For motion on a circle the initial rate must belong to the
    // frequency of this motion.
    p.init.slosh_angle = 0.0;
    p.init.slosh_angle_radial = amplitude.asin();
    let mut omega = linear;
    for _ in 0..2 {
        p.init.slosh_rate = omega * amplitude;
        omega = frequency(&p, h);
    }
    [planar, shift(omega)]
}
