//! Damping of the first mode: published correlations, the laminar layer at the wall, ring baffles.
//!
//! Re = nu/sqrt(g R^3) throughout (an inverse Reynolds number), x = h/R the fill; zeta is the
//! logarithmic decrement over 2 pi. Measured tanks scatter by some 30 % around any of these.

use core::f64::consts::PI;

use formulas::damping as formula;

use crate::modal::{ModalData, Mode};

/// A damping ratio, and where the formula is used outside its range.
#[derive(Clone, Debug, PartialEq)]
pub struct Damping {
    /// Damping ratio.
    pub zeta: f64,
    /// One sentence for each range that is left; empty inside.
    pub outside: Vec<String>,
}

impl Damping {
    fn new(zeta: f64, ranges: &[(bool, String)]) -> Damping {
        let outside = ranges.iter().filter(|r| !r.0).map(|r| r.1.clone()).collect();
        Damping { zeta, outside }
    }
}

/// Laminar layer at the wetted wall of any tank, mode by mode: zeta_n = beta_n sqrt(nu/(8 omega_n)),
/// omega_n^2 = g lambda_n (Case and Parkinson 1957 for the cylinder, Keulegan 1959 for the box).
///
/// It leaves out the surface film, the contact line and everything turbulent: measured cylinders have
/// 1.4 to 1.5 times as much, see [`estimate`].
pub fn laminar(mode: &Mode, nu: f64, g: f64) -> Damping {
    let omega = (g * mode.lambda).sqrt();
    let layer = (2.0 * nu / omega).sqrt();
    let thin = layer < 0.1 * mode.l;
    let text = format!("the layer of {layer:.3e} m is not thin against the wave");
    Damping::new(formula::laminar(mode.beta, nu, omega), &[(thin, text)])
}

/// The best one can offer for a shape without measurements: 1.45 times the laminar layer, the factor
/// of measured cylinders (1.49 Stephens, 1.39 to 1.54 Mikishev and Dorozhkin).
pub fn estimate(mode: &Mode, nu: f64, g: f64) -> Damping {
    let laminar = laminar(mode, nu, g);
    Damping { zeta: 1.45 * laminar.zeta, ..laminar }
}

/// Upright cylinder, Mikishev and Dorozhkin. In shallow liquid it falls below the laminar layer, where
/// [`stephens`] is sounder.
pub fn mikishev_dorozhkin(radius: f64, fill: f64, nu: f64, g: f64) -> Damping {
    let x = fill / radius;
    let text =
        format!("h/R = {x:.3} is below 0.5, where the formula falls below the laminar layer");
    Damping::new(formula::mikishev_dorozhkin(radius, fill, nu, g), &[(x >= 0.5, text)])
}

/// Upright cylinder, Stephens, Leonard and Perry: 1.493 times the laminar layer at every depth.
pub fn stephens(radius: f64, fill: f64, nu: f64, g: f64) -> Damping {
    Damping::new(formula::stephens(radius, fill, nu, g), &[])
}

/// Sphere, see [`formula::sphere`].
pub fn sphere(radius: f64, fill: f64, nu: f64, g: f64) -> Damping {
    let (x, b) = (fill / radius, formula::sphere_number(radius, nu, g));
    Damping::new(
        formula::sphere(radius, fill, nu, g),
        &[
            ((0.1..=1.9).contains(&x), format!("h/R = {x:.3} is outside 0.1 to 1.9")),
            ((1e-2..=1.0).contains(&b), format!("B = {b:.3e} is outside the measured 0.01 to 1")),
        ],
    )
}

/// Cone with its apex down, `radius` of the free surface, `half_angle` in degrees.
pub fn cone(radius: f64, half_angle: f64, nu: f64, g: f64) -> Damping {
    let known = (0.0..=45.0).contains(&half_angle);
    let text = format!("the half angle of {half_angle} degrees is outside 0 to 45");
    Damping::new(formula::cone(radius, half_angle, nu, g), &[(known, text)])
}

/// Torus, `tube_radius` of its section.
pub fn torus(tube_radius: f64, fill: f64, nu: f64, g: f64) -> Damping {
    let (y, scale) = (0.5 * fill / tube_radius, formula::torus_number(tube_radius, nu, g));
    Damping::new(
        formula::torus(tube_radius, fill, nu, g),
        &[
            ((0.1..=0.9).contains(&y), format!("h/2a = {y:.3} is outside 0.1 to 0.9")),
            (
                (0.1..=10.0).contains(&scale),
                format!("Re is {scale:.3e} times that of the one tank measured"),
            ),
        ],
    )
}

/// Box, `length` along the motion and `width` across it, first mode: the laminar layer in closed form
/// (Keulegan 1959), beta = 2/a + 2/w + 2 k (1 - 2 h/a)/sinh 2 k h, k = pi/a.
pub fn keulegan(length: f64, width: f64, fill: f64, nu: f64, g: f64) -> Damping {
    let axis = crate::closed_form::box_axis(length, width, fill, 1.0, 1);
    laminar(&axis.modes[0], nu, g)
}

/// A flat ring at the wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Depth below the free surface, m.
    pub depth: f64,
    /// Width, m.
    pub width: f64,
}

/// Ranges of the square-root law: 2 < UT/D < 20 with D = 2 w, ring under the wave's trough, little of
/// the section covered. `reach` is the wave's decay from the surface to the ring.
fn ring_ranges(ring: Ring, amplitude: f64, reach: f64, covered: f64) -> Vec<(bool, String)> {
    let Ring { depth, width } = ring;
    let stroke = amplitude / width * reach;
    vec![
        (
            depth >= amplitude,
            format!("the ring at a depth of {depth} m comes out of a wave of {amplitude} m"),
        ),
        (covered < 0.25, format!("the ring covers {covered:.3} of the section, more than 0.25")),
        (
            stroke > 0.64 && stroke < 6.4,
            format!(
                "(eta/w) times the decay is {stroke:.3}, outside 0.64 to 6.4: small waves keep more damping"
            ),
        ),
    ]
}

/// Ring baffle in an upright cylinder, `amplitude` of the wave at the wall: see [`formula::miles_ring`].
pub fn miles_ring(radius: f64, ring: Ring, amplitude: f64) -> Damping {
    let Ring { depth, width } = ring;
    let (reach, covered) =
        (formula::motion_at_ring(radius, depth), formula::covered(radius, width));
    Damping::new(
        formula::miles_ring(radius, depth, width, amplitude),
        &ring_ranges(ring, amplitude, reach, covered),
    )
}

/// Ring baffle at the outer wall of any tank of revolution, first mode: zeta = 1.53 lambda w^(3/2)
/// eta^(1/2) G^(5/2) r_b phi(R_F)^2/N, with G = |phi_s|/(lambda phi(R_F)) at the ring's radius r_b
/// (from Keulegan and Carpenter's plates, scaled to Miles for the cylinder). phi(R_F)^2/N =
/// rho pi lambda wave^2/m.
///
/// None if no wall is that deep, or for a box.
pub fn ring(data: &ModalData, ring: Ring, amplitude: f64) -> Option<Damping> {
    let (mode, wall) = (data.modes.first()?, data.wall.as_ref()?);
    let at = mode.wall_speed(wall.z_surface - ring.depth)?;
    let shape = data.rho * PI * mode.lambda * mode.wave * mode.wave / mode.m;
    let zeta = 1.53
        * mode.lambda
        * ring.width.powf(1.5)
        * amplitude.sqrt()
        * at.ratio.powf(2.5)
        * at.r
        * shape;
    let w = ring.width / at.r;
    Some(Damping::new(zeta, &ring_ranges(ring, amplitude, at.ratio, w * (2.0 - w))))
}

/// Part of a full ring's damping that a sector keeps: int |cos theta|^(5/2) dtheta/2.8756 between two
/// angles from the direction of slosh, rad. A half ring keeps half.
pub fn sector(from: f64, to: f64) -> f64 {
    let rule = crate::gauss::Gauss::new(24);
    let part = |a: f64, b: f64| -> f64 {
        let terms = rule.nodes.iter().zip(&rule.weights);
        terms.map(|(v, w)| w * (b - a) * (a + (b - a) * v).cos().abs().powf(2.5)).sum()
    };
    // in pieces between the zeros of the cosine
    let first = (from / PI - 0.5).ceil() as i64;
    let mut places = vec![from];
    places.extend((first..).map(|k| (k as f64 + 0.5) * PI).take_while(|t| *t < to));
    places.push(to);
    places.windows(2).map(|p| part(p[0], p[1])).sum::<f64>() / part_of_circle(&part)
}

fn part_of_circle(part: &impl Fn(f64, f64) -> f64) -> f64 {
    2.0 * part(-0.5 * PI, 0.5 * PI)
}
