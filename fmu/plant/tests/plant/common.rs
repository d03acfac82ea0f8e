use plant::{FrictionModel, Parameters, SloshModel};

pub const SLOSH: [SloshModel; SloshModel::ALL.len()] = SloshModel::ALL;

pub const SLOSHING: [SloshModel; SLOSH.len() - 1] = {
    let mut moving = [SloshModel::Linear; SLOSH.len() - 1];
    let mut i = 0;
    while i < moving.len() {
        moving[i] = SLOSH[i + 1];
        i += 1;
    }
    moving
};

pub fn has_rim(slosh: SloshModel) -> bool {
    slosh == SloshModel::Liquid
}

pub const FRICTION: [FrictionModel; FrictionModel::ALL.len()] = FrictionModel::ALL;

pub fn bench(slosh: SloshModel, friction: FrictionModel) -> Parameters {
    let mut p = Parameters::default();
    p.slosh.model = slosh;
    p.friction.model = friction;
    p
}

/// Returns a random plant from the whole allowed range: sizes from a small model to a launcher's stage, any fill, one to ten
/// modes, any damping and friction, and a motion at the start.
pub fn anywhere(rng: &mut fastrand::Rng, slosh: SloshModel, friction: FrictionModel) -> Parameters {
    let mut p = bench(slosh, friction);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.f64();
    p.tank.d = 10f64.powf(between(-1.5, 0.5));
    p.tank.h = p.tank.d * 10f64.powf(between(-1.5, 0.5));
    if slosh == SloshModel::Liquid {
        // The fill is neither shallow nor next to a secondary resonance, where the plant issues a warning.
        p.tank.h = p.tank.d
            * if between(0.0, 1.0) < 0.5 { between(0.22, 0.37) } else { between(0.6, 3.0) };
    }
    p.tank.r = p.tank.d * between(0.0, 5.0);
    let m_liq = 1000.0 * 0.785 * p.tank.d * p.tank.d * p.tank.h;
    p.hub.inertia = m_liq * p.tank.d * p.tank.d * 10f64.powf(between(-1.0, 2.0));
    p.slosh.zeta_from_correlation = between(0.0, 1.0) < 0.5;
    p.slosh.zeta = between(0.0, 0.3);
    let torque = p.hub.inertia * between(0.0, 1.0);
    p.friction.b = torque * between(0.0, 1.0);
    p.friction.c = torque * between(0.0, 0.1);
    p.friction.d = torque * between(0.0, 0.1);
    p.friction.omega_s = between(0.01, 0.5);
    p.friction.eps = 10f64.powf(between(-4.0, -1.0));
    // The bristles have no damping of their own, so that they are passive with any friction. They deflect by 10 mrad.
    p.friction.sigma0 = 100.0 * (p.friction.c + p.friction.d);
    p.friction.sigma1 = 0.0;
    p.friction.asymmetry = between(-0.3, 0.3);
    p.friction.harmonics_forward = core::array::from_fn(|_| between(-0.15, 0.15));
    p.friction.harmonics_backward = core::array::from_fn(|_| between(-0.15, 0.15));
    p.init.omega = between(-0.5, 0.5);
    p.init.slosh_angle = between(-0.5, 0.5);
    p.init.slosh_angle_radial = between(-0.5, 0.5);
    p.init.slosh_rate = between(-2.0, 2.0);
    p.init.slosh_rate_radial = between(-2.0, 2.0);
    p.slosh.modes = rng.usize(1..=plant::MODES);
    p
}
