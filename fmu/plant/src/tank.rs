//! The liquid in an upright cylinder as pendulums.
//!
//! Modal masses and lengths: thesis Table 4.1, the same as Abramson NASA SP-106
//! and Dodge (2000), with the exact zeros of J1'. Damping: Mikishev-Dorozhkin.

use crate::{Fluid, MODES, Parameters, SloshModel, Tank};

/// Zeros xi_n of J1', the derivative of the Bessel function (17 digits).
const XI: [f64; MODES] = [
    1.841_183_781_340_659_5,
    5.331_442_773_525_032_5,
    8.536_316_366_346_286,
    11.706_004_902_592_063,
    14.863_588_633_909_034,
    18.015_527_862_681_804,
    21.164_369_859_188_792,
    24.311_326_857_210_776,
    27.457_050_571_059_245,
    30.601_922_972_669_094,
];

/// One slosh mode as a pendulum that hangs at the tank's axis.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Pendulum {
    /// Mass of the bob, kg.
    pub m: f64,
    /// Length, m.
    pub l: f64,
    /// Viscous coefficient of the bob against the tank, N s/m, now and at the reference g.
    pub c: f64,
    pub c_0: f64,
    /// Distance of the hinge from the bearing's axis, m.
    pub r: f64,
    /// c/m, r/l and 1/l: quotients that every order of every step needs.
    pub c_m: f64,
    pub r_l: f64,
    pub inv_l: f64,
    /// Wall elevation per slosh angle, m/rad: a_n = 2 R / (xi_n^2 - 1).
    pub wave: f64,
    /// Coefficient of the quartic spring over R^2, 1/m2 (paraboloid only).
    pub hardening: f64,
}

impl Pendulum {
    /// Sets the viscous coefficient, `factor` times that at the reference g.
    pub fn set_damping(&mut self, factor: f64) {
        self.c = factor * self.c_0;
        self.c_m = self.c / self.m;
    }
}

/// What follows from the parameters; 0 for modes that are not used.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Calculated {
    /// Mass of the liquid, kg.
    pub m_liq: f64,
    /// Mass of the liquid that moves with the tank, kg.
    pub m_0: f64,
    /// Bond number rho g R^2 / sigma.
    pub bond: f64,
    /// Pendulum masses, kg.
    pub mass: [f64; MODES],
    /// Pendulum lengths, m.
    pub length: [f64; MODES],
    /// Natural frequencies sqrt(g/l) / 2 pi, Hz.
    pub frequency: [f64; MODES],
    /// Damping ratios.
    pub damping: [f64; MODES],
}

/// Damping ratio of the first mode in a smooth upright cylinder:
/// zeta = 0.79 sqrt(Re) [1 + (0.318/sinh(1.84 h/R)) (1 + (1 - h/R)/cosh(1.84 h/R))],
/// Re = nu/sqrt(g R^3), R the tank's radius (Mikishev and Dorozhkin; Dodge 2000).
/// Measured tanks scatter by about 30 % around it.
#[allow(clippy::approx_constant)] // 0.318 is the correlation's, not 1/pi
fn mikishev_dorozhkin(tank: &Tank, fluid: &Fluid, g: f64) -> f64 {
    let radius = tank.d / 2.0;
    let fill = tank.h / radius;
    let re = fluid.nu / libm::sqrt(g * radius * radius * radius);
    // Where sinh would overflow the bottom is out of reach anyway.
    let depth = f64::min(1.84 * fill, 300.0);
    let bottom = 0.318 / libm::sinh(depth) * (1.0 + (1.0 - fill) / libm::cosh(depth));
    0.79 * libm::sqrt(re) * (1.0 + bottom)
}

impl Calculated {
    /// Modal parameters at the specific force `g` along the tank's axis, m/s2.
    ///
    /// The correlation covers the first mode; higher modes take its ratio. At
    /// g = 0 there is no restoring force and no frequency; the damping ratio,
    /// which has no meaning there, is reported as 0.
    pub fn new(p: &Parameters, g: f64) -> Calculated {
        let Parameters { tank, fluid, slosh, .. } = p;
        let radius = tank.d / 2.0;
        let m_liq = fluid.rho * core::f64::consts::PI * radius * radius * tank.h;
        let bond = fluid.rho * g * radius * radius / fluid.sigma;
        let mut all = Calculated { m_liq, m_0: m_liq, bond, ..Default::default() };
        let modes = if slosh.model == SloshModel::Frozen { 0 } else { slosh.modes.min(MODES) };
        for (n, &xi) in XI.iter().enumerate().take(modes) {
            let tanh = libm::tanh(2.0 * xi * tank.h / tank.d);
            all.mass[n] = m_liq * tank.d * tanh / (xi * (xi * xi - 1.0) * tank.h);
            all.length[n] = tank.d / (2.0 * xi * tanh);
            all.frequency[n] = libm::sqrt(g / all.length[n]) / core::f64::consts::TAU;
            all.damping[n] = match (g > 0.0, slosh.zeta_from_correlation) {
                (false, _) => 0.0,
                (_, true) => mikishev_dorozhkin(tank, fluid, g),
                (_, false) => slosh.zeta,
            };
            all.m_0 -= all.mass[n];
        }
        all
    }

    /// The pendulums in use. Their viscous coefficients c = 2 zeta omega_n m
    /// belong to the `g` of [`Calculated::new`]; `damping.rs` has them at another.
    pub fn pendulums(&self, p: &Parameters) -> impl Iterator<Item = Pendulum> {
        let radius = p.tank.d / 2.0;
        let (r, hardening) = (p.tank.r, p.slosh.hardening / (radius * radius));
        (0..MODES).take_while(|&n| self.mass[n] > 0.0).map(move |n| {
            let (m, l) = (self.mass[n], self.length[n]);
            let c = 2.0 * self.damping[n] * core::f64::consts::TAU * self.frequency[n] * m;
            let wave = 2.0 * radius / (XI[n] * XI[n] - 1.0);
            Pendulum { m, l, c, c_0: c, r, c_m: c / m, r_l: r / l, inv_l: 1.0 / l, wave, hardening }
        })
    }
}
