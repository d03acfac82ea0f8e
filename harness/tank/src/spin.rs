//! Liquid that turns with its tank about the tank's axis at a steady rate: its surface, its centre of mass, its
//! inertia, and the effect of the spin on the first slosh mode.
//!
//! The surface is at g z - Omega^2 r^2/2 = c. At the height z the liquid reaches inwards to the radius r_i, with r_i^2
//! = max(0, 2 (g z - c)/Omega^2). With integrals along the wall, up the outer wall and down the inner one,
//!
//! ```text
//! m = rho pi int (r^2 - r_i^2) dz,   I_axis = rho (pi/2) int (r^4 - r_i^4) dz,
//! I_cg = I_axis/2 + int z^2 dm - m z_cg^2
//! ```
//!
//! The first equation, with the known mass m, gives the constant c. The same equations hold with a lid, a dry
//! floor and without gravity.
//!
//! Seen from a rotating tank, the first mode of an upright cylinder runs around the axis against the spin (l > 0) and
//! with the spin (l < 0) at
//!
//!   l = C Omega +- sqrt(C^2 Omega^2 + omega_0^2)
//!
//! with C of [`SpinLimit`]. A pendulum, which does not take part in the spin, has C = 1. The FMUs model both, and
//! report the mode as out of range at the same limits as this module.
//!
//! The laminar layer at the floor brings the liquid to the tank's rate, at sqrt(nu Omega)/h (Greenspan and Howard, J.
//! Fluid Mech. 17, 1963).
//!
//! Source: derived from the equations of a rotating liquid, to the first order in Omega. A solution for all Omega differs by at
//! most 1 % at Omega^2 R/g = 0.1 and h >= R, by 4 % at h = R/4, and by 6 % at 0.3.

use core::f64::consts::{PI, TAU};

use formulas::limits::SpinLimit;

use crate::contour::{Contour, Problems, bisect};
use crate::modal::{ModalData, Spin};
use crate::tank::{Geometry, Shape, Tank};

/// Largest relative error of a pendulum's frequency, (1 - C) Omega/omega_0, that is accepted
/// without a warning. It arises because a pendulum does not take part in the spin of the liquid. C
/// is the gyroscopic coefficient, Omega the spin rate and omega_0 the frequency without spin.
const PENDULUM_ERROR: f64 = 0.05;

/// Computes the steady rotation of the liquid of a tank about the tank's axis at `omega`, rad/s.
/// `data` are the modes of the tank at rest, `gravity` is the specific force, m/s², and `nu` the
/// kinematic viscosity, m²/s.
///
/// # Errors
/// A box, because it has no axis of revolution; a tank without a free surface; a rate that is not
/// above 0; liquid that may lie in separate pools.
pub fn spin(
    tank: &Tank,
    data: &ModalData,
    omega: f64,
    gravity: f64,
    nu: Option<f64>,
) -> Result<Spin, Problems> {
    let Geometry::Revolution { contour, shape } = &tank.geometry else {
        return Err("The tank is a box. Its liquid spins about an axis of revolution only.".into());
    };
    if !(omega > 0.0 && omega.is_finite()) {
        return Err(format!("The spin is {omega} rad/s; it must be a number above 0.").into());
    }
    let Some(radius) = data.r_surface.filter(|_| !data.modes.is_empty()) else {
        return Err("The tank is full, and its liquid has no free surface: spin changes neither its centre of mass nor its \
                    inertia."
            .into());
    };
    let volume = data.m_liq / data.rho;
    let surface = Surface::with_volume(contour, volume, omega, gravity);
    if contour.count_pools(|z| surface.inner(z)) != 1 {
        return Err(format!(
            "At {omega} rad/s the surface meets the wall at several heights, so that the liquid may lie in separate pools, \
             and their shares are not known."
        )
        .into());
    }
    let [z_cg, i_axis, i_cg] = surface.moments(contour, data.rho);
    let (z_low, r_low) = contour.lowest();
    let r_dry = surface.inner(z_low).sqrt();
    let floor_is_dry = r_dry > r_low * (1.0 + 1e-9) + 1e-9 * radius;
    let z_wall = contour.highest_wetted(|z| surface.inner(z));
    let z_top = z_low + contour.depth();
    let reaches_top = z_wall > z_top - 1e-9 * contour.depth();
    let flatness = (gravity > 0.0).then(|| omega * omega * radius / gravity);
    let omega_0 = data.frequencies(gravity, false)[0].map(|f| TAU * f).filter(|rate| *rate > 0.0);
    let limit = SpinLimit::new(data.modes[0].l, radius);
    let c = limit.gyroscopic_coefficient();
    let waves = |rate: f64| {
        let root = (c * c * omega * omega + rate * rate).sqrt();
        [root + c * omega, root - c * omega].map(|l| l / TAU)
    };
    let is_cylinder = matches!(shape, Some(Shape::Cylinder { .. }));
    let ratio = omega_0.map(|rate| 2.0 * omega / rate);
    let mut warnings = Vec::new();
    let mut beyond = |is_beyond: bool, what: &str| {
        if is_beyond {
            warnings.push(format!("out of range: {what}"));
        }
        is_beyond
    };
    let out_of_range = [
        beyond(floor_is_dry, "the floor is dry in the middle"),
        beyond(reaches_top, "the liquid reaches the top of the wall"),
        match omega_0 {
            Some(rate) => beyond(
                limit.is_exceeded(omega, rate * rate),
                "at this rate no mode can be computed to a few per cent (Omega^2 R/g is above 0.3, or the wave's frequency is in the range of \
                 inertial waves)",
            ),
            None => beyond(
                true,
                "the frequency of the first mode of the liquid at rest is 0 or not known",
            ),
        },
    ];
    let in_range = !out_of_range.contains(&true);
    let error = (1.0 - c) * ratio.unwrap_or_default() / 2.0;
    // The FMUs can have the gyroscopic coefficient of an upright cylinder.
    if in_range && !is_cylinder && error > PENDULUM_ERROR {
        warnings.push(format!(
            "without gyroscopic[1] the FMUs model pendulums, whose frequencies differ by up to {:.0} % from those of the spinning liquid",
            100.0 * error
        ));
    }
    Ok(Spin {
        omega,
        gravity,
        z_cg,
        i_axis,
        i_cg,
        z_apex: (r_low < 1e-9 * radius && !floor_is_dry && gravity > 0.0)
            .then(|| surface.c / gravity),
        z_wall,
        r_dry: if floor_is_dry { r_dry } else { 0.0 },
        flatness,
        ratio,
        frequencies: omega_0.filter(|_| is_cylinder).map(waves),
        gyroscopic: is_cylinder.then_some(c),
        decay: nu
            .filter(|_| is_cylinder)
            .map(|nu| (nu * omega).sqrt() * PI * radius * radius / volume),
        in_range,
        warnings,
    })
}

/// Free surface of the rotating liquid: the heights z and radii r with g z - Omega^2 r^2/2 = c,
/// where g is the specific force, Omega the spin rate and c a constant.
struct Surface {
    omega: f64,
    gravity: f64,
    c: f64,
}

impl Surface {
    /// Returns the surface of the rotating liquid for the volume `volume`, m³, of liquid in
    /// `contour`. `omega` is the spin rate, rad/s, and `gravity` the specific force, m/s².
    fn with_volume(contour: &Contour, volume: f64, omega: f64, gravity: f64) -> Surface {
        let (bottom, top) = (contour.bottom(), contour.bottom() + contour.depth());
        let radius = contour.largest_radius();
        let low = gravity * bottom - 0.5 * omega * omega * radius * radius;
        let surface = |c: f64| Surface { omega, gravity, c };
        surface(bisect(low, gravity * top, |c| {
            let [below] = surface(c).integrate(contour, |[r, _], s| [PI * (r * r - s)]);
            below < volume
        }))
    }

    fn inner(&self, z: f64) -> f64 {
        (2.0 * (self.gravity * z - self.c) / (self.omega * self.omega)).max(0.0)
    }

    fn integrate<const N: usize>(
        &self,
        contour: &Contour,
        density: impl Fn([f64; 2], f64) -> [f64; N],
    ) -> [f64; N] {
        let apex = if self.gravity > 0.0 { vec![self.c / self.gravity] } else { Vec::new() };
        contour.integrate_wetted(|z| self.inner(z), &apex, density)
    }

    fn moments(&self, contour: &Contour, rho: f64) -> [f64; 3] {
        let [m, mz, mzz, i_axis] = self.integrate(contour, |[r, z], s| {
            let area = rho * PI * (r * r - s);
            [area, area * z, area * z * z, 0.5 * area * (r * r + s)]
        });
        let z_cg = mz / m;
        [z_cg, i_axis, 0.5 * i_axis + mzz - m * z_cg * z_cg]
    }
}
