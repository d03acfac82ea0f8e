//! The LuGre law: the contact as bristles with the mean deflection z (rad), stiffness sigma_0
//! and damping sigma_1 (Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE Transactions on
//! Automatic Control 40 (1995) 419-425):
//!
//! ```text
//! z'    = w - sigma_0 |w| z/g,     g = T_C(w) B(theta)
//! tau_f = -(sigma_0 z + sigma_1 z' + b w)
//! ```
//!
//! with Stribeck's curve T_C and the directional factor B of the current direction of rotation. The
//! bearing stores sigma_0 z^2/2 and dissipates the rest. With u = sigma_0 z/g and s = sgn w
//!
//! ```text
//! D = -tau_f w - sigma_0 z z' = |w| [ g u^2 + |w| (b + sigma_1 (1 - s u)) ]
//! ```
//!
//! |z| never exceeds g_max/sigma_0, so |u| <= g_max/g_min, and D >= 0 at every rate exactly if
//!
//! ```text
//! sigma_1 (g_max - g_min) <= b g_min,     g_min = c B_min, g_max = (c + d) B_max
//! ```
//!
//! (the passivity condition of Barabanov and Ortega, IEEE Transactions on Automatic Control 45 (2000) 830-832). Parameters
//! with a larger sigma_1 are refused.
//!
//! |w| is not smooth at w = 0, which is therefore located as an event; the contact stores the sign of w. With this law the
//! hub does not stick: under a torque below g_max it creeps to a deflection and stays there.
//!
//! Choose this law if presliding motion, frictional lag, or a break-away torque that depends on the torque rate matters.
//! While the hub slides, z follows w within g/(sigma_0 |w|) seconds. The integrator resolves this time, so that its steps
//! are about as long. For large sigma_0 the law approaches the set-valued law `stribeck`, at increasing cost.

use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use taylor::series::{self, Series, ZERO};

use super::FrictionLaw;
use super::curve::StribeckCurve;
use super::directional::DirectionalFactor;
use crate::contact::Contact;
use crate::hub::HubMotion;
use crate::parameters::Friction;

#[derive(Clone, Debug)]
pub struct Lugre {
    b: f64,
    sigma0: f64,
    sigma1: f64,
    curve: StribeckCurve,
    factor: DirectionalFactor,
    inv_deflection: f64,
    present: Series,
    g: Series,
    rate_over_g: Series,
    relaxation: Series,
    z: Series,
    z_d: Series,
}

impl FrictionLaw for Lugre {
    const SWITCHES_AT_REST: bool = true;

    fn new(p: &Friction) -> Lugre {
        let (g_min, _) = bounds(p);
        Lugre {
            b: p.b,
            sigma0: p.sigma0,
            sigma1: p.sigma1,
            curve: StribeckCurve::new(p),
            factor: DirectionalFactor::new(p),
            inv_deflection: if g_min > 0.0 { p.sigma0 / g_min } else { 0.0 },
            present: ZERO,
            g: ZERO,
            rate_over_g: ZERO,
            relaxation: ZERO,
            z: ZERO,
            z_d: ZERO,
        }
    }

    fn problems(p: &Friction) -> Vec<String> {
        if p.c <= 0.0 {
            return vec![format!(
                "friction.c = {} N.m cannot be combined with friction.model = lugre: set friction.c above 0 N.m",
                p.c
            )];
        }
        let (g_min, g_max) = bounds(p);
        // A factor B <= 0 is reported by other checks.
        let gives_energy = p.sigma1 * (g_max - g_min) > p.b * g_min * (1.0 + 1e-12);
        if g_min <= 0.0 || !gives_energy {
            return Vec::new();
        }
        vec![format!(
            "friction.sigma1 = {} N.m.s/rad: the lugre bearing would generate energy at high rates (allowed: \
             up to friction.b g_min/(g_max - g_min) = {:.6} N.m.s/rad, with dry friction between g_min = {:.6} N.m \
             and g_max = {:.6} N.m)",
            p.sigma1,
            p.b * g_min / (g_max - g_min),
            g_min,
            g_max
        )]
    }

    fn set_state(&mut self, n: usize, z: f64) {
        self.z[n] = z;
    }

    // This function does not depend on the slosh model, so that the compiled code contains one copy of it.
    #[inline(never)]
    fn torque(&mut self, n: usize, contact: Contact, hub: &HubMotion) -> f64 {
        self.curve.expand(n, &hub.omega2);
        self.factor.expand(n, &hub.theta);
        self.present[n] = self.factor.coefficient(n, contact);
        self.g[n] = series::mul(n, &self.curve.torque, &self.present);
        let rest = series::mul_tail(n, &self.g, &self.rate_over_g);
        self.rate_over_g[n] = (hub.omega[n] - rest) / self.g[0];
        self.relaxation[n] = series::mul(n, &self.rate_over_g, &self.z);
        let sign = contact as i8 as f64;
        self.z_d[n] = hub.omega[n] - sign * self.sigma0 * self.relaxation[n];
        self.z[n + 1] = series::next(n, self.z_d[n]);
        -(self.sigma0 * self.z[n] + self.sigma1 * self.z_d[n] + self.b * hub.omega[n])
    }

    #[inline(never)]
    fn dissipation(&self, n: usize, tau_f: &Series, omega: &Series) -> f64 {
        -series::mul(n, tau_f, omega) - self.sigma0 * series::mul(n, &self.z, &self.z_d)
    }

    fn energy(&self, n: usize) -> f64 {
        self.sigma0 * series::square(n, &self.z) / 2.0
    }

    fn derivative(&self, n: usize) -> f64 {
        self.z_d[n]
    }

    fn advance(&self, n: usize, t: f64, z: &mut f64) {
        [*z] = series::values([&self.z], n, t);
    }

    /// Returns the size of coefficient n of the bristles' deflection, divided by the largest deflection. The integrator then
    /// keeps the error of the friction torque within the same tolerance as under dry friction.
    fn coefficient_norm(&self, n: usize) -> f64 {
        self.z[n].abs() * self.inv_deflection
    }

    /// Determines the direction in which a hub at rest begins to turn, from the sum of the net torque and the torque of the
    /// bristles, which also acts at rest.
    fn contact_at_rest(&self, [net, slope]: [f64; 2], _: f64, before: Contact) -> Contact {
        let torque = net - self.sigma0 * self.z[0];
        match if torque != 0.0 { torque } else { slope } {
            to if to > 0.0 => Contact::Forward,
            to if to < 0.0 => Contact::Backward,
            _ if before == Contact::Stuck => Contact::Forward,
            _ => before,
        }
    }
}

fn bounds(p: &Friction) -> (f64, f64) {
    let (lowest, highest) = DirectionalFactor::new(p).bounds();
    (p.c * lowest, (p.c + p.d) * highest)
}
