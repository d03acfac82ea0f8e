//! Damping: one law for every tank and mode ([`tank_damping`], by `formulas::damping`), the individual published
//! correlations, and ring baffles.
//!
//! Re = nu/sqrt(g R^3) throughout (an inverse Reynolds number), x = h/R is the fill, and zeta is
//! the logarithmic decrement over 2 pi. Measured tanks scatter by about 30 % around any of these
//! correlations.

use core::f64::consts::PI;

use formulas::damping as formula;

use crate::contour::Problems;
use crate::modal::{Damping, DampingPart, ModalData, Mode, ModeDamping};
use crate::shape::{self, Recognised};
use crate::table::significant;
use crate::tank::{Geometry, Shape, Tank};

const ENDS: &str = "use the low end for stability margins, check both ends for settling times";

/// Computes the damping of a tank solved as `data`, for a liquid of kinematic viscosity `nu`, m2/s, at the
/// specific force `gravity`, m/s². `springs` are the modes' centring stiffnesses, N/m, along each axis of a
/// box; empty for none. `sigma`, N/m, if known, is used for low Bond numbers.
///
/// A contour that is a sphere, an upright cylinder, a cone or a torus, to 1e-6 of its size over the wetted
/// part, has the damping of that shape. If only a part of the wall is such a shape, the factor over the
/// laminar layer is a mean by area. So the ratio is continuous in the fill and in the shape of the tank.
///
/// # Errors If there is neither gravity nor centring stiffness, because there is no natural frequency then.
pub fn tank_damping(
    tank: &Tank,
    data: &ModalData,
    nu: f64,
    gravity: f64,
    springs: [&[f64]; 2],
    sigma: Option<f64>,
) -> Result<Damping, Problems> {
    let recognised = data.wall.as_ref().and_then(|wall| shape::recognise(wall, data.fill));
    // A shape must have the same modes as its dimensions give.
    let is_given = |found: &Recognised| {
        let Geometry::Revolution { shape: Some(given), .. } = &tank.geometry else { return false };
        core::mem::discriminant(given) == core::mem::discriminant(&found.shape)
    };
    let drawn = recognised.filter(|found| !is_given(found));
    let canonical = drawn.and_then(|found| solve_shape(found, data.modes.len()));
    let modes = canonical.as_ref().map_or(&data.modes, |canonical| &canonical.modes);
    let measured = recognised.map_or(formula::Shape::Other, |found| found.measured());
    let seen = |modes: &[Mode], springs: &[f64]| -> Vec<formula::Mode> {
        let of_mode = |(n, mode): (usize, &Mode)| {
            let stiffness = springs.get(n).map_or(0.0, |k| k / mode.m);
            let omega = (gravity * mode.lambda + stiffness.max(0.0)).sqrt();
            formula::Mode { beta: mode.beta, lambda: mode.lambda, omega }
        };
        modes.iter().enumerate().map(of_mode).collect()
    };
    let along_x = seen(modes, springs[0]);
    let Some(first) = along_x.first().copied() else {
        return Err("There are no modes to be damped.".to_string().into());
    };
    if first.omega <= 0.0 {
        return Err("A damping ratio depends on the acceleration along the tank's axis, and is not defined at 0 m/s² without surface \
                    tension: give an acceleration above 0, give the surface tension, or leave out the viscosity."
            .to_string()
            .into());
    }
    let effective = first.omega * first.omega / first.lambda;
    // Of a cone too wide for its correlation the factor has no meaning.
    let counts = |part: &shape::Part| match part.found.measured() {
        cone @ formula::Shape::Cone { .. } => {
            cone.correlation(nu, effective).is_some_and(|found| found.weight > 0.0)
        }
        _ => true,
    };
    let solved = |parts: Vec<shape::Part>| -> Vec<Nearest> {
        let solve = |part: shape::Part| Nearest::solve(part.found, part.share, nu, effective);
        parts.into_iter().filter(counts).filter_map(solve).collect()
    };
    let (found, near) = match (recognised, &data.wall) {
        (Some(found), _) => {
            (Vec::from_iter(Nearest::from_whole_wall(found, first, nu)), Vec::new())
        }
        (None, Some(wall)) => {
            (solved(shape::parts(wall, data.fill)), solved(shape::nearby_shapes(wall, data.fill)))
        }
        (None, None) => (Vec::new(), Vec::new()),
    };
    let [parts, close] = [&found, &near].map(|of| of.iter().map(|n| n.part).collect::<Vec<_>>());
    let estimate = formula::estimate(&parts, &close);
    let correlation = measured.correlation(nu, effective).map(|correlation| correlation.zeta);
    // The correlation itself, not its quotient by the layer times the layer.
    let exact = correlation.filter(|_| found.iter().all(Nearest::is_measured));
    let mut warnings: Vec<String> =
        outside(measured, nu, effective).into_iter().map(|why| format!("damping: {why}")).collect();
    let layer = (2.0 * nu / first.omega).sqrt();
    if layer >= 0.1 / first.lambda {
        warnings.push(format!("damping: the layer of {layer:.3e} m is not thin against the wave"));
    }
    let mut all = |modes: &[formula::Mode]| -> Vec<ModeDamping> {
        let of_mode = |(n, mode): (usize, &formula::Mode)| {
            let laminar = mode.laminar(nu);
            let zeta = exact.filter(|_| n == 0).unwrap_or(estimate.factor * laminar);
            let expected = if n == 0 { estimate.interval } else { estimate.interval_of_others };
            let mut interval = expected.map(|factor| factor * laminar);
            if let (0, formula::Shape::Cylinder { radius, .. }, Some(sigma)) = (n, measured, sigma)
            {
                let bond = data.rho * gravity * radius * radius / sigma;
                if (10.0..=100.0).contains(&bond) {
                    let high = formula::low_bond_cylinder(radius, nu, gravity, bond);
                    interval[1] = interval[1].max(high);
                    warnings.push(format!(
                        "damping: at the Bond number {bond:.1} the contact line may dissipate more: drop-tower tests found \
                         {}, the upper end of the interval",
                        significant(high)
                    ));
                }
            }
            ModeDamping { omega: mode.omega, zeta, interval, laminar }
        };
        modes.iter().enumerate().map(of_mode).collect()
    };
    let modes = all(&along_x);
    let modes_y =
        data.axes.as_ref().map_or(Vec::new(), |axes| all(&seen(&axes.y.modes, springs[1])));
    let (basis, parts) = match (&found[..], correlation) {
        ([whole], Some(zeta)) => {
            let layers = formula::UNMEASURED * first.laminar(nu);
            (whole.basis(estimate.factor, zeta, layers), Vec::new())
        }
        _ => (
            mixture(&found, &near, estimate.factor),
            found.iter().map(Nearest::to_damping_part).collect(),
        ),
    };
    let taken = format!("{basis}; {ENDS}");
    Ok(Damping {
        nu,
        gravity,
        shape: shape_name(measured),
        correlation,
        parts,
        taken,
        modes,
        modes_y,
        warnings,
    })
}

/// A measured shape that the wetted wall is, wholly or in part, at the nearest depth that was measured.
/// `at_depth` is false if the tank has another depth.
struct Nearest {
    shape: formula::Shape,
    at_depth: bool,
    part: formula::Part,
}

impl Nearest {
    /// Creates the shape of the whole wall of a tank whose first mode is `first`.
    fn from_whole_wall(found: Recognised, first: formula::Mode, nu: f64) -> Option<Nearest> {
        let (shape, g) = (found.measured(), first.omega * first.omega / first.lambda);
        if shape != shape.at_measured_depth() {
            return Nearest::solve(found, 1.0, nu, g);
        }
        Nearest::new(shape, 1.0, nu, g, first.laminar(nu))
    }

    /// Creates the shape of a share of the wall, at the specific force `g`, by solving for the shape's own
    /// layer.
    fn solve(found: Recognised, share: f64, nu: f64, g: f64) -> Option<Nearest> {
        let shape = found.measured().at_measured_depth();
        let fill = match shape {
            formula::Shape::Sphere { depth, .. } | formula::Shape::Torus { depth, .. } => depth,
            _ => found.fill,
        };
        let own = solve_shape(Recognised { fill, ..found }, 1)?;
        let Mode { beta, lambda, .. } = *own.modes.first()?;
        let layer = formula::laminar(beta, nu, (g * lambda).sqrt());
        let nearest = Nearest::new(shape, share, nu, g, layer)?;
        Some(Nearest { at_depth: shape == found.measured(), ..nearest })
    }

    fn new(shape: formula::Shape, share: f64, nu: f64, g: f64, layer: f64) -> Option<Nearest> {
        let correlation = shape.correlation(nu, g)?;
        // 0/0 without viscosity
        let factor = if layer > 0.0 { correlation.zeta / layer } else { formula::UNMEASURED };
        let part = formula::Part { share, factor, weight: correlation.weight };
        Some(Nearest { shape, at_depth: true, part })
    }

    fn is_measured(&self) -> bool {
        self.at_depth && self.part.is_measured()
    }

    fn to_damping_part(&self) -> DampingPart {
        let formula::Part { share, factor, .. } = self.part;
        DampingPart { shape: shape_name(self.shape), share, factor }
    }

    /// Returns a sentence about the damping of a wall that is this shape, with the ratios by its correlation
    /// and by 1.45 layers.
    fn basis(&self, factor: f64, correlation: f64, layers: f64) -> String {
        let (name, unmeasured) = (shape_name(self.shape), formula::UNMEASURED);
        let formula::Part { weight, .. } = self.part;
        let disagree = if self.part.disagrees() {
            ", more than measured tanks scatter: two estimates disagree"
        } else {
            ""
        };
        let by_correlation =
            format!("its correlation makes {}{disagree}", significant(correlation));
        if weight == 0.0 {
            return format!(
                "{unmeasured} laminar layers, as in measured cylinders: the correlation of the {name} was not measured \
                 there; {by_correlation}"
            );
        }
        if weight < 1.0 {
            return format!(
                "{factor:.2} laminar layers, between {unmeasured} of measured cylinders and the correlation of the {name}, \
                 which was not measured there; {by_correlation}"
            );
        }
        if self.part.factor < 1.0 {
            return format!(
                "{factor:.2} laminar layers, as in measured cylinders where the correlation of the {name} is far below the \
                 laminar layer; {by_correlation}"
            );
        }
        if !self.at_depth {
            return format!(
                "{factor:.2} laminar layers, as the {name} has at the nearest depth that was measured; {unmeasured} make \
                 {}{disagree}",
                significant(layers)
            );
        }
        format!(
            "{}, measured there; {unmeasured} laminar layers make {}{disagree}",
            shape_source(self.shape),
            significant(layers)
        )
    }
}

/// Returns a sentence about the damping of a wall that is no measured shape, or is one in part, with the
/// shapes that it is near.
fn mixture(found: &[Nearest], near: &[Nearest], factor: f64) -> String {
    let unmeasured = formula::UNMEASURED;
    if found.is_empty() {
        let mut text = format!(
            "{unmeasured} laminar layers, as in measured cylinders: no measurements of this shape"
        );
        for nearest in near.iter().filter(|nearest| nearest.part.disagrees()) {
            text += &format!(
                "; it is nearly a {}, whose correlation makes {:.2} layers, which the interval includes",
                shape_name(nearest.shape),
                nearest.part.factor
            );
        }
        return text;
    }
    let of_shape = |nearest: &Nearest| {
        let formula::Part { share, factor, weight } = nearest.part;
        let range = if weight < 1.0 { ", beyond its measured range" } else { "" };
        format!(
            "{:.0} % of the wetted wall is a {}, whose correlation makes {factor:.2} layers{range}",
            100.0 * share,
            shape_name(nearest.shape)
        )
    };
    let shapes: Vec<String> = found.iter().map(of_shape).collect();
    let disagree = if found.iter().any(|nearest| nearest.part.disagrees()) {
        "; the estimates disagree by more than measured tanks scatter"
    } else {
        ""
    };
    format!(
        "{factor:.2} laminar layers: {}; other walls have {unmeasured}, as measured cylinders{disagree}",
        shapes.join("; ")
    )
}

fn solve_shape(found: Recognised, modes: usize) -> Option<ModalData> {
    let whole = match found.shape {
        // The cone is open above the fill.
        Shape::Cone { half_angle, height } => Shape::Cone { half_angle, height: 1.5 * height },
        Shape::Cylinder { radius, height } => Shape::Cylinder { radius, height: 1.5 * height },
        shape => shape,
    };
    // The density does not matter for damping.
    Tank::from_shape(whole, 1.0).ok()?.solve(found.fill, modes).ok()
}

fn shape_name(shape: formula::Shape) -> &'static str {
    match shape {
        formula::Shape::Cylinder { .. } => "upright cylinder",
        formula::Shape::Sphere { .. } => "sphere",
        formula::Shape::Cone { .. } => "cone",
        formula::Shape::Torus { .. } => "torus",
        formula::Shape::Other => "other",
    }
}

fn shape_source(shape: formula::Shape) -> &'static str {
    match shape {
        formula::Shape::Cylinder { radius, depth } if depth < 0.5 * radius => {
            "upright cylinder, shallow (Stephens, Leonard and Perry)"
        }
        formula::Shape::Cylinder { .. } => "upright cylinder (Mikishev and Dorozhkin)",
        formula::Shape::Sphere { .. } => "sphere (after Mikishev and Dorozhkin, Sumner and Stofan)",
        formula::Shape::Cone { .. } => "cone (fit of a published figure)",
        formula::Shape::Torus { .. } => "torus (one tank)",
        formula::Shape::Other => "",
    }
}

fn outside(shape: formula::Shape, nu: f64, g: f64) -> Vec<String> {
    match shape {
        formula::Shape::Sphere { radius, depth } => sphere(radius, depth, nu, g).outside,
        formula::Shape::Cone { radius, half_angle } => cone(radius, half_angle, nu, g).outside,
        formula::Shape::Torus { tube_radius, depth } => torus(tube_radius, depth, nu, g).outside,
        formula::Shape::Cylinder { .. } | formula::Shape::Other => Vec::new(),
    }
}

/// A damping ratio, with one sentence for each range of its formula that the tank is outside of.
#[derive(Clone, Debug, PartialEq)]
pub struct Formula {
    pub zeta: f64,
    pub outside: Vec<String>,
}

impl Formula {
    fn new(zeta: f64, ranges: &[(bool, String)]) -> Formula {
        let outside = ranges.iter().filter(|r| !r.0).map(|r| r.1.clone()).collect();
        Formula { zeta, outside }
    }
}

/// Computes the damping ratio of one mode from the laminar layer at the wetted wall of any tank: zeta_n =
/// beta_n sqrt(nu/(8 omega_n)), omega_n^2 = g lambda_n (cylinder: Case and Parkinson 1957, box: Keulegan
/// 1959).
///
/// Surface film, contact line and turbulence are not included. Measured cylinders have 1.4 to 1.5 times as
/// much, see [`tank_damping`].
pub fn laminar(mode: &Mode, nu: f64, g: f64) -> Formula {
    let omega = (g * mode.lambda).sqrt();
    let layer = (2.0 * nu / omega).sqrt();
    let thin = layer < 0.1 * mode.l;
    let text = format!("the layer of {layer:.3e} m is not thin against the wave");
    Formula::new(formula::laminar(mode.beta, nu, omega), &[(thin, text)])
}

/// Computes the damping ratio of an upright cylinder by Mikishev and Dorozhkin. In shallow liquid the formula
/// falls below the laminar layer; use [`stephens`] there. `radius` and `fill` in m, `nu` in m²/s, `g` in
/// m/s²; the next functions take the same units.
pub fn mikishev_dorozhkin(radius: f64, fill: f64, nu: f64, g: f64) -> Formula {
    let x = fill / radius;
    let text =
        format!("h/R = {x:.3} is below 0.5, where the formula falls below the laminar layer");
    Formula::new(formula::mikishev_dorozhkin(radius, fill, nu, g), &[(x >= 0.5, text)])
}

/// Computes the damping ratio of an upright cylinder by Stephens, Leonard and Perry, which is 1.493 times the
/// laminar layer's at every depth.
pub fn stephens(radius: f64, fill: f64, nu: f64, g: f64) -> Formula {
    Formula::new(formula::stephens(radius, fill, nu, g), &[])
}

pub fn sphere(radius: f64, fill: f64, nu: f64, g: f64) -> Formula {
    let (x, b) = (fill / radius, formula::sphere_number(radius, nu, g));
    Formula::new(
        formula::sphere(radius, fill, nu, g),
        &[
            ((0.1..=1.9).contains(&x), format!("h/R = {x:.3} is outside 0.1 to 1.9")),
            ((1e-2..=1.0).contains(&b), format!("B = {b:.3e} is outside the measured 0.01 to 1")),
        ],
    )
}

/// Computes the damping ratio of a cone with its apex down; `radius` is that of the free surface,
/// `half_angle` in degrees.
pub fn cone(radius: f64, half_angle: f64, nu: f64, g: f64) -> Formula {
    let known = (0.0..=45.0).contains(&half_angle);
    let text = format!("the half angle of {half_angle} degrees is outside 0 to 45");
    Formula::new(formula::cone(radius, half_angle, nu, g), &[(known, text)])
}

pub fn torus(tube_radius: f64, fill: f64, nu: f64, g: f64) -> Formula {
    let (y, scale) = (0.5 * fill / tube_radius, formula::torus_number(tube_radius, nu, g));
    Formula::new(
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

/// A flat ring baffle at the wall: its depth below the free surface and its width, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    pub depth: f64,
    pub width: f64,
}

/// Checks the ranges of the square-root law: 2 < UT/D < 20 with D = 2 w, ring under the wave's trough, small
/// part of the section covered. `reach` is the decay of the wave from the surface to the ring.
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

/// Computes the damping ratio of a ring baffle in an upright cylinder, for the `amplitude` (m) of the wave at
/// the wall, by [`formula::miles_ring`].
pub fn miles_ring(radius: f64, ring: Ring, amplitude: f64) -> Formula {
    let Ring { depth, width } = ring;
    let (reach, covered) =
        (formula::motion_at_ring(radius, depth), formula::covered(radius, width));
    Formula::new(
        formula::miles_ring(radius, depth, width, amplitude),
        &ring_ranges(ring, amplitude, reach, covered),
    )
}

/// Computes the damping ratio of a ring baffle at the outer wall of any tank of revolution, for the first
/// mode: zeta = 1.53 lambda w^(3/2) eta^(1/2) G^(5/2) r_b phi(R_F)^2/N. G = |phi_s|/(lambda phi(R_F)) at the
/// ring's radius r_b, and phi(R_F)^2/N = rho pi lambda wave^2/m. The law comes from Keulegan and Carpenter's
/// plates, scaled to Miles for the cylinder.
///
/// Returns `None` for a box, or if no wall is at this depth.
pub fn ring(data: &ModalData, ring: Ring, amplitude: f64) -> Option<Formula> {
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
    Some(Formula::new(zeta, &ring_ranges(ring, amplitude, at.ratio, w * (2.0 - w))))
}

/// Returns the part of a full ring's damping that a sector has: int |cos theta|^(5/2) dtheta/2.8756 between
/// two angles from the direction of slosh, rad. A half ring has half.
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
