//! Damping: one function for every tank and mode ([`tank_damping`], with the correlations of `formulas::damping`).
//!
//! In this module Re = nu/sqrt(g R^3) (an inverse Reynolds number) with the kinematic viscosity nu, the specific force
//! g and the tank radius R; x = h/R is the fill with the liquid's height h; and zeta, the damping ratio, is the
//! logarithmic decrement divided by 2 pi. Measured damping scatters by about 30 % around any of these correlations.

use formulas::damping as formula;

use crate::contour::Problems;
use crate::modal::{Damping, DampingPart, ModalData, Mode, ModeDamping};
use crate::shape::{self, Recognised};
use crate::table::significant;
use crate::tank::{Geometry, Shape, Tank};

const ENDS: &str = "use the low end for stability margins, check both ends for settling times";

/// Computes the damping of the modes `data` of a tank. The liquid has the kinematic viscosity `nu`,
/// m²/s, at the specific force `gravity`, m/s². `springs` are the stiffnesses that surface tension
/// adds to the modes, N/m, for each axis of a box; they are empty without surface tension. The
/// surface tension `sigma`, N/m, if known, widens the interval at low Bond numbers.
///
/// If the wetted wall is a sphere, an upright cylinder, a cone or a torus to 1e-6 of its size, the
/// correlation that was measured for this shape gives the damping. If only a part of the wall has
/// such a shape, the factor by which the correlation exceeds the damping of a laminar boundary
/// layer is averaged by area, so that the damping ratio is a continuous function of the fill and of
/// the shape of the tank.
///
/// # Errors
/// If neither gravity nor surface tension restores the liquid, because there is no natural
/// frequency then.
pub fn tank_damping(
    tank: &Tank,
    data: &ModalData,
    nu: f64,
    gravity: f64,
    springs: [&[f64]; 2],
    sigma: Option<f64>,
) -> Result<Damping, Problems> {
    let recognised = data.wall.as_ref().and_then(|wall| shape::recognise(wall, data.fill));
    // If a drawn wall has a measured shape, the modes of a tank that is given by the dimensions of this shape are used.
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
        return Err("The tank has no modes whose damping could be computed.".to_string().into());
    };
    if first.omega <= 0.0 {
        return Err("A damping ratio depends on the acceleration along the tank's axis, and is not defined at 0 m/s² without surface \
                    tension: give an acceleration above 0, give the surface tension, or leave out the viscosity."
            .into());
    }
    let effective = first.omega * first.omega / first.lambda;
    // A cone too wide for its correlation is left out, because its factor has no meaning.
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
    // The correlation itself is returned, because the product (correlation/layer) * layer would have a rounding error.
    let exact = correlation.filter(|_| found.iter().all(Nearest::is_measured));
    let mut warnings: Vec<String> =
        outside(measured, nu, effective).into_iter().map(|why| format!("damping: {why}")).collect();
    let layer = (2.0 * nu / first.omega).sqrt();
    if layer >= 0.1 / first.lambda {
        warnings.push(format!(
            "damping: the laminar layer at the wall is {layer:.3e} m thick, but the formulas assume a layer that is thin compared \
             with the wave"
        ));
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

/// The measured shape of the wetted wall, or of a part of it. If the depth of liquid was not
/// measured for this shape, the shape has the nearest measured depth, and `at_depth` is false.
struct Nearest {
    shape: formula::Shape,
    at_depth: bool,
    part: formula::Part,
}

impl Nearest {
    fn from_whole_wall(found: Recognised, first: formula::Mode, nu: f64) -> Option<Nearest> {
        let (shape, g) = (found.measured(), first.omega * first.omega / first.lambda);
        if shape != shape.at_measured_depth() {
            return Nearest::solve(found, 1.0, nu, g);
        }
        Nearest::new(shape, 1.0, nu, g, first.laminar(nu))
    }

    /// Compares the damping by the correlation of a measured shape with the damping of the laminar
    /// layer at its wall. `share` is the part of the tank's wetted wall that has this shape, `nu`
    /// the kinematic viscosity, m²/s, and `g` the specific force, m/s². Returns `None` if the shape
    /// has no correlation or cannot be solved.
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
        // Without viscosity correlation.zeta and layer are 0.
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

    /// Returns a sentence that explains to the user how the damping ratio follows from this shape.
    /// `factor` is the damping ratio divided by the damping ratio of the laminar boundary layer,
    /// `correlation` the damping ratio by the shape's correlation, and `layers` is 1.45 times the
    /// damping ratio of the laminar layer.
    fn basis(&self, factor: f64, correlation: f64, layers: f64) -> String {
        let (name, unmeasured) = (shape_name(self.shape), formula::UNMEASURED);
        let formula::Part { weight, .. } = self.part;
        let disagree = if self.part.disagrees() {
            "; the two estimates disagree by more than the scatter of measured tanks"
        } else {
            ""
        };
        let by_correlation =
            format!("the correlation gives {}{disagree}", significant(correlation));
        if weight == 0.0 {
            return format!(
                "{unmeasured} times the damping of the laminar layer, as in measured cylinders, because this tank is outside \
                 the range in which the correlation of the {name} was measured; {by_correlation}"
            );
        }
        if weight < 1.0 {
            return format!(
                "{factor:.2} times the damping of the laminar layer, between the {unmeasured} times of measured cylinders and \
                 the correlation of the {name}, because this tank is outside the range in which the correlation was \
                 measured; {by_correlation}"
            );
        }
        if self.part.factor < 1.0 {
            return format!(
                "{factor:.2} times the damping of the laminar layer, as in measured cylinders, because the correlation of \
                 the {name} gives less than the laminar layer alone; {by_correlation}"
            );
        }
        if !self.at_depth {
            return format!(
                "{factor:.2} times the damping of the laminar layer, as measured for the {name} at the nearest depth; \
                 {unmeasured} times would give {}{disagree}",
                significant(layers)
            );
        }
        format!(
            "{}, within its measured range; {unmeasured} times the damping of the laminar layer would give {}{disagree}",
            shape_source(self.shape),
            significant(layers)
        )
    }
}

fn mixture(found: &[Nearest], near: &[Nearest], factor: f64) -> String {
    let unmeasured = formula::UNMEASURED;
    if found.is_empty() {
        let mut text = format!(
            "{unmeasured} times the damping of the laminar layer, as in measured cylinders, because no measurements of this \
             shape are known"
        );
        for nearest in near.iter().filter(|nearest| nearest.part.disagrees()) {
            text += &format!(
                "; it is nearly a {}, whose correlation gives {:.2} times, which the interval includes",
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
            "{:.0} % of the wetted wall is a {}, whose correlation gives {factor:.2} times{range}",
            100.0 * share,
            shape_name(nearest.shape)
        )
    };
    let shapes: Vec<String> = found.iter().map(of_shape).collect();
    let disagree = if found.iter().any(|nearest| nearest.part.disagrees()) {
        "; the estimates disagree by more than the scatter of measured tanks"
    } else {
        ""
    };
    format!(
        "{factor:.2} times the damping of the laminar layer: {}; the rest of the wall has {unmeasured} times, as measured \
         cylinders have{disagree}",
        shapes.join("; ")
    )
}

fn solve_shape(found: Recognised, modes: usize) -> Option<ModalData> {
    let whole = match found.shape {
        // The shape is made higher than the fill, because the tank must be open above its surface.
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

/// Returns a sentence for each measured range of a shape's correlation that the tank is outside of.
/// `nu` is the kinematic viscosity, m²/s, and `g` the specific force, m/s².
fn outside(shape: formula::Shape, nu: f64, g: f64) -> Vec<String> {
    let ranges = match shape {
        formula::Shape::Sphere { radius, depth } => {
            let (x, b) = (depth / radius, formula::sphere_number(radius, nu, g));
            let measured = format!("B = {b:.3e} is outside the measured 0.01 to 1");
            vec![
                ((0.1..=1.9).contains(&x), format!("h/R = {x:.3} is outside 0.1 to 1.9")),
                ((1e-2..=1.0).contains(&b), measured),
            ]
        }
        formula::Shape::Cone { half_angle, .. } => {
            let text = format!("the half angle of {half_angle} degrees is outside 0 to 45");
            vec![((0.0..=45.0).contains(&half_angle), text)]
        }
        formula::Shape::Torus { tube_radius, depth } => {
            let (y, scale) = (0.5 * depth / tube_radius, formula::torus_number(tube_radius, nu, g));
            let measured =
                format!("Re is {scale:.3e} times the Reynolds number of the only measured tank");
            vec![
                ((0.1..=0.9).contains(&y), format!("h/2a = {y:.3} is outside 0.1 to 0.9")),
                ((0.1..=10.0).contains(&scale), measured),
            ]
        }
        formula::Shape::Cylinder { .. } | formula::Shape::Other => Vec::new(),
    };
    ranges.into_iter().filter(|(within, _)| !within).map(|(_, text)| text).collect()
}
