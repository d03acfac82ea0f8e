//! A tank's modal parameters under the names of the FMUs' variables, and files with these parameters.
//!
//! A set file is TOML with lines `"name" = value`, with the names in quotes. The SSV form is the parameter set of SSP
//! 1.0. `hubslosh run --parameters` and the Python package read both; other SSP tools read the SSV form.

use names::hubslosh::{self, DampingLaw, SloshSource, slosh};
use names::{sloshtank, spacecraft};

use crate::coefficients::{Coefficients, FiniteAmplitude};
use crate::contour::Problems;
use crate::finite_amplitude;
use formulas::limits::LOW_BOND;

use crate::low_gravity::{self, Capillary, Fluid};
use crate::modal::ModalData;
use crate::spin::spin;
use crate::table::{format_length, significant};
use crate::tank::{Fill, Geometry, Shape, Tank};
use crate::{damping, modal};

/// Largest contribution of capillarity to the stiffness of the first mode, relative to gravity, at
/// which the coefficients of finite amplitude are used.
const MOST_CAPILLARY: f64 = 0.1;

/// Surface tension divided by density, m³/s², that is assumed for a liquid whose surface tension is
/// not given. It is the value of water, the largest of common liquids (hydrazine 6.6e-5, MMH
/// 3.9e-5, liquid hydrogen 2.8e-5, NTO 1.9e-5, liquid oxygen 1.2e-5).
const LARGEST_TENSION: f64 = 7.3e-5;

/// The FMU for which the parameters are written. HubSlosh gets a table of modes (`slosh.source =
/// table`) and keeps its parameter `tank.r`, the tank's position on the hub. In Spacecraft the tank
/// has a number from 1 to 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    HubSlosh,
    SloshTank,
    Spacecraft { tank: usize },
}

impl Target {
    /// Returns the name of a tank's variable in this FMU. `of_sloshtank` is its name in SloshTank:
    /// for example, `tank.mass[1]` is `tank[2].mass[1]` in Spacecraft.
    pub(crate) fn name(self, of_sloshtank: &str) -> String {
        match self {
            Target::Spacecraft { tank } => {
                of_sloshtank.replacen("tank", &format!("tank[{tank}]"), 1)
            }
            _ => of_sloshtank.to_string(),
        }
    }
}

/// Properties of the liquid other than its density.
///
/// - `gravity`: specific force along the tank's axis, m/s², at least 0, for which damping ratios
///   and stiffnesses are computed.
/// - `nu`: kinematic viscosity, m²/s; without it the damping ratios are not set.
/// - `sigma`: surface tension, N/m; without it the stiffnesses by surface tension are 0.
/// - `contact_angle`: angle between surface and wall, measured in the liquid, degrees; 90 is a flat
///   surface.
/// - `spin`: rate at which tank and liquid rotate together about the tank's axis, rad/s, if they
///   do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Liquid {
    pub gravity: f64,
    pub nu: Option<f64>,
    pub sigma: Option<f64>,
    pub contact_angle: f64,
    pub spin: Option<f64>,
}

impl Liquid {
    fn fluid(&self, data: &ModalData) -> Option<Fluid> {
        Some(Fluid { rho: data.rho, sigma: self.sigma?, g: self.gravity })
    }

    /// Returns a warning if no surface tension is given although it may matter: with
    /// [`LARGEST_TENSION`] the Bond number would be below [`LOW_BOND`].
    fn missing_tension(&self, data: &ModalData) -> Option<String> {
        let bond = self.gravity * half_width(data).powi(2) / LARGEST_TENSION;
        let matters = self.sigma.is_none() && self.gravity > 0.0 && bond < LOW_BOND;
        (matters && !data.modes.is_empty()).then(|| {
            format!(
                "surface tension: sigma is not given. With the ratio of surface tension to density of water, \
                 {LARGEST_TENSION:e} m³/s², the Bond number would be {bond:.3}, and below {LOW_BOND} surface tension \
                 changes frequencies and masses. Give sigma, in N/m"
            )
        })
    }

    /// Returns the specific force along the axis, m/s², below which the stiffnesses of the modes
    /// are wrong because of surface tension, or `None` if the stiffnesses hold down to 0.
    fn lowest_gravity(&self, data: &ModalData) -> Option<f64> {
        let mode = data.modes.first()?;
        match self.sigma {
            None => Some(LOW_BOND * LARGEST_TENSION / half_width(data).powi(2)),
            Some(sigma) if !mode.upright => {
                Some(low_gravity::least_gravity(mode, sigma / data.rho))
            }
            Some(_) => None,
        }
    }

    /// Returns `true` if the damping in `data` was computed with the viscosity, gravity, surface
    /// tension and contact angle of this liquid.
    fn damped(&self, data: &ModalData) -> bool {
        let damping = data.damping.as_ref().map(|of| (of.nu, of.gravity));
        let surface = data.capillarity.as_ref().map(|of| (of.sigma, of.contact_angle));
        damping == self.nu.map(|nu| (nu, self.gravity))
            && surface == self.sigma.map(|sigma| (sigma, self.contact_angle))
    }
}

/// Returns the radius of a tank's free surface, m. For a box it is half of the shorter side.
fn half_width(data: &ModalData) -> f64 {
    let lengths = [data.length_x, data.length_y].into_iter().flatten();
    data.r_surface.unwrap_or_else(|| 0.5 * lengths.fold(f64::INFINITY, f64::min))
}

#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Real(f64),
    Integer(i64),
    Item(&'static str),
}

/// Parameters under the names of an FMU's variables, with remarks for the user.
///
/// - `notes`: source and accuracy of the values.
/// - `warnings`: values that were left out.
/// - `unknown`: values so far outside the range of their formula that nobody should use them
///   without a check.
/// - `third_order`: the modes, counted from 1, whose coefficients of finite amplitude are among the
///   `values`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterSet {
    pub notes: Vec<String>,
    pub warnings: Vec<String>,
    pub unknown: Vec<String>,
    pub values: Vec<(String, Value)>,
    pub third_order: Vec<(usize, Coefficients)>,
}

/// Returns the effect of capillarity on `modes` for the liquid `fluid` and the contact angle
/// `angle`, degrees. It follows from the formula for a flat surface. The first mode of an upright
/// cylinder at a contact angle other than 90 degrees uses the table for a curved meniscus instead.
/// Warnings are added to `set`.
fn with_capillarity(
    tank: &Tank,
    data: &ModalData,
    modes: &[modal::Mode],
    (fluid, angle): (Fluid, f64),
    set: &mut ParameterSet,
) -> Vec<Capillary> {
    let mut all: Vec<Capillary> = modes.iter().map(|mode| low_gravity::flat(mode, fluid)).collect();
    match &tank.geometry {
        _ if angle == 90.0 => {}
        Geometry::Revolution { shape: Some(Shape::Cylinder { radius, .. }), .. } => {
            all[0] = low_gravity::cylinder(&modes[0], *radius, data.fill, angle, fluid);
            set.notes.push(format!(
                "k of mode 1: meniscus of a deep cylinder at a contact angle of {angle} degrees and the Bond \
                 number {:.4}, free contact line (table); it holds at {} m/s²",
                fluid.bond(*radius),
                fluid.g
            ));
            set.warnings.push(
                "capillarity: under a curved meniscus masses, heights, and the stiffnesses of the modes after \
                 the first are not known; the values of a flat surface are used"
                    .into(),
            );
        }
        _ => set.warnings.push(format!(
            "capillarity: the meniscus at a contact angle of {angle} degrees is known only for an upright \
             cylinder (shape = {{ cylinder = … }}); k has the value for a flat surface, 90 degrees"
        )),
    }
    for (n, Capillary { outside, unknown, .. }) in (1..).zip(&all) {
        set.warnings.extend(outside.iter().map(|why| format!("capillarity: {why}")));
        if *unknown {
            set.unknown.push(format!("k of mode {n} is not known: {}", outside.join("; ")));
        }
    }
    all
}

/// Returns the stiffnesses that surface tension adds to the modes, N/m. A negative stiffness is
/// replaced by 0, because the FMUs do not accept it. Warnings are added to `set`.
fn springs(
    tank: &Tank,
    data: &ModalData,
    modes: &[modal::Mode],
    liquid: Liquid,
    set: &mut ParameterSet,
) -> Vec<f64> {
    let Some(fluid) = liquid.fluid(data) else {
        if liquid.gravity == 0.0 {
            set.warnings.push(
                "at 0 m/s² and without surface tension the liquid has no restoring force: k is 0"
                    .to_string(),
            );
        }
        set.warnings.extend(liquid.missing_tension(data));
        return vec![0.0; modes.len()];
    };
    let all = with_capillarity(tank, data, modes, (fluid, liquid.contact_angle), set);
    let spring = |(n, (mode, capillary)): (usize, (&modal::Mode, &Capillary))| {
        let (k, gravity) = (capillary.spring, liquid.gravity * mode.lambda);
        if k < 0.0 {
            set.warnings.push(format!(
                "capillarity: k of mode {n} is {k:.3e} N/m. The FMUs do not accept a negative k, so 0 is written; this \
                 makes the frequency too high by the fraction {:.1e}",
                1.0 - (capillary.omega2 / gravity).sqrt()
            ));
        }
        if k < 0.0 { 0.0 } else { k }
    };
    (1..).zip(modes.iter().zip(&all)).map(spring).collect()
}

/// Chooses the three modes that represent a box in Spacecraft: the first mode along each axis, and
/// the heavier one of the two second modes. Returns the axis and the index of each.
fn box_modes(axes: [&[modal::Mode]; 2]) -> Vec<(usize, usize)> {
    let mass = |axis: usize| axes[axis].get(1).map_or(0.0, |mode| mode.m);
    let mut chosen = vec![(0, 0), (1, 0)];
    if axes.iter().all(|modes| modes.len() > 1) {
        chosen.push((usize::from(mass(1) > mass(0)), 1));
    }
    chosen
}

pub fn surface_tension_warnings(data: &ModalData, liquid: Liquid) -> Vec<String> {
    match &data.capillarity {
        Some(found) => found.warnings.clone(),
        None => liquid.missing_tension(data).into_iter().collect(),
    }
}

/// Returns the natural frequencies of a tank's modes with the surface tension, contact angle and
/// specific force of `liquid`, or `None` if no surface tension is given.
pub fn tank_capillarity(
    tank: &Tank,
    data: &ModalData,
    liquid: Liquid,
) -> Option<modal::Capillarity> {
    let (fluid, Liquid { contact_angle, gravity, .. }) = (liquid.fluid(data)?, liquid);
    let mut warnings = Vec::new();
    let mut of_modes = |modes: &[modal::Mode]| -> Vec<modal::CapillaryMode> {
        let mut set = ParameterSet::default();
        let all = with_capillarity(tank, data, modes, (fluid, contact_angle), &mut set);
        warnings.append(&mut set.warnings);
        warnings.extend(set.unknown.iter().map(|why| why.replacen("k of mode", "f of mode", 1)));
        let mode = |mode: &Capillary| modal::CapillaryMode {
            omega: (!mode.unknown).then(|| mode.omega2.max(0.0).sqrt()),
            k: (!mode.unknown).then_some(mode.spring),
        };
        all.iter().map(mode).collect()
    };
    let modes = if data.modes.is_empty() { Vec::new() } else { of_modes(&data.modes) };
    let modes_y = data.axes.as_ref().map_or(Vec::new(), |axes| of_modes(&axes.y.modes));
    warnings.dedup();
    let (sigma, radius) = (fluid.sigma, data.r_surface.filter(|_| fluid.sigma > 0.0));
    let bond = radius.map(|radius| fluid.bond(radius));
    Some(modal::Capillarity { sigma, contact_angle, gravity, bond, modes, modes_y, warnings })
}

/// Solves for `modes` modes of a tank at a fill, and adds the results that depend on further
/// properties of the liquid: capillarity, damping, spin, and the amplitude dependence of the first
/// mode.
///
/// # Errors
/// The errors of [`Tank::fill_height`], [`Tank::solve`], [`spin`] and [`tank_damping`].
pub fn solve(tank: &Tank, fill: Fill, modes: usize, liquid: Liquid) -> Result<ModalData, Problems> {
    let mut data = tank.solve(tank.fill_height(fill)?, modes)?;
    data.capillarity = tank_capillarity(tank, &data, liquid);
    let spun = liquid.spin.map(|omega| spin(tank, &data, omega, liquid.gravity, liquid.nu));
    data.spin = spun.transpose()?;
    if !data.modes.is_empty() {
        data.finite_amplitude = Some(finite_amplitude::amplitude_dependence(tank, &data));
        data.damping = liquid.nu.map(|nu| tank_damping(tank, &data, nu, liquid)).transpose()?;
    }
    Ok(data)
}

/// Returns the damping of a tank's modes as [`damping::tank_damping`] does, and takes their
/// stiffness by capillarity from `liquid`. `nu` is the kinematic viscosity, m²/s.
///
/// # Errors
/// If the liquid has neither gravity nor surface tension, because there is no natural frequency
/// then.
pub fn tank_damping(
    tank: &Tank,
    data: &ModalData,
    nu: f64,
    liquid: Liquid,
) -> Result<modal::Damping, Problems> {
    let mut unused = ParameterSet::default();
    let mut stiffnesses = |modes| springs(tank, data, modes, liquid, &mut unused);
    let along_y = data.axes.as_ref().map_or(Vec::new(), |axes| stiffnesses(&axes.y.modes));
    let springs = [&stiffnesses(&data.modes)[..], &along_y[..]];
    damping::tank_damping(tank, data, nu, liquid.gravity, springs, liquid.sigma)
}

impl ParameterSet {
    /// Returns the parameters of a tank under the names of the FMU `target`. `data` are the solved
    /// modes of the tank. All of them become modes of the FMU, but at most as many as the FMU has.
    ///
    /// # Errors
    /// A tank that the FMU cannot represent (tank number above four, full tank), or a viscosity
    /// without gravity and surface tension.
    pub fn new(
        tank: &Tank,
        data: &ModalData,
        target: Target,
        liquid: Liquid,
    ) -> Result<ParameterSet, Problems> {
        ParameterSet::with_energy(tank, data, target, liquid, target != Target::HubSlosh)
    }

    /// Returns the parameters as [`ParameterSet::new`] does. If `has_energy` is true, coefficients
    /// that also give the wave's energy replace the third-order coefficients if they are known. The
    /// FMU HubSlosh and tanks with a fill table accept only third-order coefficients.
    pub(crate) fn with_energy(
        tank: &Tank,
        data: &ModalData,
        target: Target,
        liquid: Liquid,
        has_energy: bool,
    ) -> Result<ParameterSet, Problems> {
        let name = data.name.as_deref().unwrap_or("tank");
        let (fill, ModalData { error, error_i_0, .. }) = (format_length(data.fill), data);
        let mut set = ParameterSet::default();
        set.notes.push(format!(
            "{name}, fill {fill} m: modal parameters with an error of {error:.0e}, of I_0 {error_i_0:.0e} m R^2"
        ));
        set.notes.push(format!("heights (hinge, H_0): {}", data.origin()));
        let most = match target {
            Target::HubSlosh => slosh::MOST_MODES,
            Target::SloshTank => sloshtank::tank::MOST_MODES,
            Target::Spacecraft { .. } => spacecraft::tank::MOST_MODES,
        };
        if data.modes.is_empty() {
            return Err(format!(
                "There are no modes: the tank is full and does not slosh. Its liquid is a rigid body: {:.6} kg at \
                 z = {:.6} m ({}), inertia {} kg·m² across the axis and {} kg·m² about it.",
                data.m_liq,
                data.z_cg,
                data.origin(),
                significant(data.i_eff_cg),
                significant(data.i_eff_axis.unwrap_or(0.0))
            )
            .into());
        }
        if liquid.gravity == 0.0 && liquid.nu.is_some() {
            return Err("A damping ratio depends on the acceleration along the tank's axis, and is not defined at 0 m/s²: \
                        give an acceleration above 0, or leave out the viscosity."
                .into());
        }
        let sides = match &tank.geometry {
            Geometry::Box { length_x: x, length_y: y } if x != y => Some([x, y]),
            _ => None,
        };
        // A box with unequal sides has modes along both sides; every other tank has modes along the first axis only.
        let both = data.axes.as_ref().filter(|_| sides.is_some());
        let count = match (both, target) {
            (Some(_), Target::HubSlosh) => data.modes.len().min(most / 2),
            _ => data.modes.len().min(most),
        };
        let chosen: Vec<(usize, usize)> = match (both, target) {
            // HubSlosh gets the modes of one axis first, then those of the other axis, because its outputs describe mode 1.
            (Some(_), Target::HubSlosh) => {
                (0..2).flat_map(|axis| (0..count).map(move |n| (axis, n))).collect()
            }
            (Some(axes), _) => box_modes([&axes.x.modes, &axes.y.modes]),
            (None, _) => (0..count).map(|n| (0, n)).collect(),
        };
        let of_axes = [&data.modes[..count], both.map_or(&[], |axes| &axes.y.modes[..count])];
        let modes: Vec<modal::Mode> =
            chosen.iter().map(|&(axis, n)| of_axes[axis][n].clone()).collect();
        if let Some(spin) = &data.spin {
            set.notes.push(format!(
                "masses, lengths and heights hold for liquid at rest; when the liquid rotates with the tank at {} rad/s, its centre of mass is at \
                 z = {:.6} m and its inertia about the axis {} kg·m²",
                significant(spin.omega),
                spin.z_cg,
                significant(spin.i_axis)
            ));
            let start = "the liquid starts at the rate of its tank (set init.omega)";
            set.notes.push(match (target, spin.decay) {
                (Target::HubSlosh, _) => "HubSlosh does not model a spin of the liquid".into(),
                (_, Some(_)) => start.into(),
                (_, None) => format!(
                    "{start}; spin_decay is known only for upright cylinders with nu, so the liquid has no friction at the wall here"
                ),
            });
            set.warnings.extend(spin.warnings.iter().map(|warning| format!("spin: {warning}")));
        }
        let springs = of_axes.map(|all| match all {
            [] => Vec::new(),
            _ => springs(tank, data, all, liquid, &mut set),
        });
        let ratios: Vec<f64> = match liquid.nu {
            Some(nu) => {
                let found = match &data.damping {
                    Some(known) if liquid.damped(data) => known.clone(),
                    _ => tank_damping(tank, data, nu, liquid)?,
                };
                set.notes.push(format!("damping ratio of mode 1: {}", found.taken));
                let of_axes = [&found.modes, &found.modes_y];
                let found_of = chosen.iter().map(|&(axis, n)| &of_axes[axis][n]);
                for (n, mode) in (1..).zip(found_of.clone()) {
                    let [low, high] = mode.interval.map(significant);
                    let zeta = significant(mode.zeta);
                    set.notes
                        .push(format!("zeta[{n}] = {zeta}, expected between {low} and {high}"));
                }
                let ratios = found_of.map(|mode| mode.zeta).collect();
                set.warnings.extend(found.warnings);
                ratios
            }
            None => {
                set.notes.push("no viscosity was given: the damping ratios are 0".to_string());
                vec![0.0; modes.len()]
            }
        };
        let known = data.finite_amplitude.clone();
        let mut found = known.unwrap_or_else(|| finite_amplitude::amplitude_dependence(tank, data));
        // The coefficients of finite amplitude come from potential flow without surface tension.
        let stiff = modes[0].m * modes[0].lambda * liquid.gravity * MOST_CAPILLARY;
        if springs[0].first().is_some_and(|spring| spring.abs() > stiff) {
            found = FiniteAmplitude {
                mode: None,
                mode_y: None,
                warnings: vec![
                    "finite amplitude: surface tension adds more than a tenth to the stiffness of mode 1; s and kappa, which are known \
                     without it, are left out"
                        .to_string(),
                ],
                ..found
            };
        }
        // HubSlosh has modes along both lengths of a box in its linear and planar models only.
        let is_linear = both.is_some() && target == Target::HubSlosh;
        let energy = |known: &Coefficients| known.energy.filter(|_| has_energy);
        let is_written = |known: &Coefficients| {
            let holds = known.series_limit >= finite_amplitude::LEAST_ANGLE;
            !is_linear && (holds || energy(known).is_some())
        };
        let first = (1..).zip(&chosen).filter(|(_, (_, of_axis))| *of_axis == 0);
        let mut third_order: Vec<(usize, Coefficients)> = Vec::new();
        let mut limits = Vec::new();
        for (n, (axis, _)) in first {
            let known = [found.mode, found.mode_y][*axis];
            let written = known.filter(is_written);
            // A mode without these coefficients is a pendulum in the FMU.
            let angle = match written {
                Some(known) => Some(energy(&known).map_or(known.angle_limit, |of| of.angle_limit)),
                None => [found.pendulum_limit, found.pendulum_limit_y][*axis],
            };
            if let (Some(angle), None) = (angle, written) {
                set.notes.push(format!(
                    "mode {n} is a pendulum: it is in range up to {:.1} degrees (angle_limit). Above this angle its \
                     frequency differs too much from the frequency of the liquid, which is computed to the third \
                     order of potential flow or estimated",
                    angle.to_degrees()
                ));
            }
            let swirl = known.and_then(|known| {
                energy(&known).map_or(known.swirl_limit, |with_energy| with_energy.swirl_limit)
            });
            limits.push((n, [("angle_limit", angle), ("swirl_limit", swirl)]));
            third_order.extend(written.map(|known| (n, known)));
        }
        for (n, known) in &third_order {
            if let Some(energy) = energy(known) {
                set.notes.push(format!(
                    "nonlinear_inertia[{n}] to rotary_inertia_2[{n}]: fully nonlinear potential flow in {}, frequency (error {:.0e}) and \
                     energy (error {:.0e}) of the wave up to {:.1} degrees; angle_limit is {:.1} degrees",
                    energy.source.describe(),
                    energy.frequency_error,
                    energy.energy_error,
                    energy.frequency_limit.to_degrees(),
                    energy.angle_limit.to_degrees()
                ));
                continue;
            }
            set.notes.push(format!(
                "nonlinear_inertia[{0}] = {1}, nonlinear_stiffness[{0}] = {2}: third order of potential flow, {3}, for slosh angles up \
                 to {4:.1} degrees (angle_limit, {5})",
                n,
                significant(known.nonlinear_inertia),
                significant(known.nonlinear_stiffness),
                match known.bridged {
                    true => "bridged".to_string(),
                    false => format!("error {:.0e}", known.error),
                },
                known.angle_limit.to_degrees(),
                known.angle_limit_from.describe()
            ));
        }
        if is_linear {
            set.notes.push("separate modes along both lengths have no coefficients of finite amplitude in HubSlosh".to_string());
        } else {
            set.notes.extend(found.warnings);
        }
        // The parameters of a mode have the same names in every FMU, after a prefix with the tank's name.
        let of_modes = |prefix: &str, values: &mut Vec<(String, Value)>| {
            let mut real = |n: usize, what: &str, value: f64| {
                values.push((format!("{prefix}.{what}[{n}]"), Value::Real(value)));
            };
            for (n, (mode, &(axis, of_axis))) in (1..).zip(modes.iter().zip(&chosen)) {
                real(n, "mass", mode.m);
                real(n, "length", mode.l);
                real(n, "hinge", mode.hinge.unwrap_or(0.0));
                real(n, "k", springs[axis][of_axis]);
                real(n, "zeta", ratios[n - 1]);
                real(n, "wave", mode.wave);
            }
            for (n, limits) in &limits {
                for (what, limit) in limits {
                    limit.iter().for_each(|limit| real(*n, what, *limit));
                }
            }
            for (n, known) in &third_order {
                match energy(known) {
                    Some(energy) => {
                        energy.parameters().iter().for_each(|(what, value)| real(*n, what, *value));
                    }
                    None => {
                        real(*n, "nonlinear_inertia", known.nonlinear_inertia);
                        real(*n, "nonlinear_stiffness", known.nonlinear_stiffness);
                    }
                }
            }
        };
        let values = &mut set.values;
        if let (Some([length_x, length_y]), Target::HubSlosh) = (sides, target) {
            let first_across = count + 1;
            set.notes.push(format!(
                "modes 1 to {count} move along the box's first length, {length_x} m, which is tangential on \
                 HubSlosh's hub; modes {first_across} to {} move along the second length, {length_y} m, which is \
                 radial (slosh.table.direction). The hub's rate acts on radial modes to second order: slosh.model = \
                 planar includes this, and linear does not. HubSlosh refuses slosh.model = spherical and liquid with \
                 these modes",
                2 * count
            ));
            for n in first_across..=2 * count {
                let radial = Value::Real(std::f64::consts::FRAC_PI_2);
                values.push((slosh::table::DIRECTION.element([n]), radial));
            }
        }
        let mut real = |name: String, value: f64| values.push((name, Value::Real(value)));
        match target {
            Target::HubSlosh => {
                real(slosh::table::M_LIQ.into(), data.m_liq);
                // specific force at which the damping ratios hold; there are none at 0
                if liquid.gravity > 0.0 {
                    real(slosh::table::G_REF.into(), liquid.gravity);
                }
                real(hubslosh::fluid::RHO.into(), data.rho);
                // For a box, the width is the width of the free surface along its first length.
                real(
                    hubslosh::tank::D.into(),
                    2.0 * data.r_surface.unwrap_or(data.length_x.unwrap_or(0.0) / 2.0),
                );
                real(hubslosh::tank::I_OWN.into(), data.i_eff_axis.unwrap_or(0.0));
                of_modes("slosh.table", values);
                let source = Value::Item(SloshSource::Table.name());
                values.push((slosh::SOURCE.into(), source));
                // The damping ratios were computed from the laminar layer.
                let law = Value::Item(DampingLaw::Laminar.name());
                values.push((slosh::DAMPING_LAW.into(), law));
                values.push((slosh::MODES.into(), Value::Integer(modes.len() as i64)));
            }
            Target::SloshTank | Target::Spacecraft { .. } => {
                use sloshtank::tank::{
                    DI_Y, DIRECTION, G_BOND, G_REF, GYROSCOPIC, H_0, I_0, I_Z, M_0, MODES,
                    SPIN_DECAY, SPIN_INERTIA,
                };
                if let Target::Spacecraft { tank: number } = target
                    && !(1..=spacecraft::MOST_TANKS).contains(&number)
                {
                    return Err(format!(
                        "The tank's number is {number}; Spacecraft has 1 to {}.",
                        spacecraft::MOST_TANKS
                    )
                    .into());
                }
                let rest = match both {
                    // Each slosh mass counts as rigid liquid in motion along the other axis. Rotation about x moves
                    // the liquid along y.
                    Some(axes) => modal::rest(data.m_liq, data.z_cg, axes.y.i_eff_cg, &modes),
                    None => data.rest(modes.len()),
                };
                real(target.name(M_0), rest.m_0);
                real(target.name(H_0), rest.height);
                // With the largest number of modes, rounding errors can make I_0 negative.
                let least = if both.is_some() { f64::NEG_INFINITY } else { 0.0 };
                real(target.name(I_0), rest.inertia.max(least));
                match &data.spin {
                    Some(spin) => {
                        real(target.name(I_Z), 0.0);
                        real(target.name(SPIN_INERTIA), spin.i_axis);
                        if let Some(decay) = spin.decay {
                            real(target.name(&SPIN_DECAY.element([1])), decay);
                        }
                        if let Some(coefficient) = spin.gyroscopic {
                            real(target.name(&GYROSCOPIC.element([1])), coefficient);
                        }
                    }
                    None => real(target.name(I_Z), data.i_eff_axis.unwrap_or(0.0)),
                }
                if liquid.gravity > 0.0 {
                    real(target.name(G_REF), liquid.gravity);
                }
                if let Some(lowest) = liquid.lowest_gravity(data) {
                    real(target.name(G_BOND), lowest);
                }
                if let Some(axes) = both {
                    real(target.name(DI_Y), axes.x.i_eff_cg - axes.y.i_eff_cg);
                    for (n, &(axis, _)) in chosen.iter().enumerate() {
                        real(target.name(&DIRECTION.element([n + 1, axis + 1])), 1.0);
                    }
                    set.notes.push(format!(
                        "planar modes along both lengths: m_0 = {:.6} kg is the mass of the liquid minus the masses of all modes; each slosh mass \
                         counts as rigid liquid in motion across its direction",
                        rest.m_0
                    ));
                }
                of_modes(&target.name("tank"), values);
                values.push((target.name(MODES), Value::Integer(modes.len() as i64)));
                if target != Target::SloshTank {
                    set.notes.push(
                        "set the parameter tanks to the number of tanks of the craft".to_string(),
                    );
                }
            }
        }
        let all = data.modes.len() * if both.is_some() { 2 } else { 1 };
        if modes.len() < all {
            let which = if both.is_some() { "" } else { "first " };
            set.notes.push(format!("the {which}{} of {all} modes", modes.len()));
        }
        if modes[0].height.is_none() {
            set.warnings
                .push("mode 1 has hardly any mass, so the height of its hinge is not defined: 0 is written".to_string());
        }
        set.warnings.dedup();
        Ok(ParameterSet { third_order, ..set })
    }

    fn comments(&self) -> impl Iterator<Item = String> {
        let warnings = self.warnings.iter().map(|warning| format!("warning: {warning}"));
        self.notes.iter().cloned().chain(warnings)
    }

    pub fn to_toml(&self) -> String {
        let notes = self.comments().map(|note| format!("# {}\n", note.replace('\n', " ")));
        let values = self.values.iter().map(|(name, value)| match value {
            Value::Real(x) => format!("\"{name}\" = {x:?}\n"),
            Value::Integer(n) => format!("\"{name}\" = {n}\n"),
            Value::Item(item) => format!("\"{name}\" = \"{item}\"\n"),
        });
        notes.chain(values).collect()
    }

    /// Returns the parameters as the text of an SSV file, the parameter set of SSP 1.0.
    pub fn to_ssv(&self) -> String {
        // XML forbids two hyphens in a comment.
        let notes = self.comments().map(|note| format!("  {}\n", note.replace("--", "- -")));
        let values = self.values.iter().map(|(name, value)| {
            let value = match value {
                Value::Real(x) => format!("<ssv:Real value=\"{x:?}\"/>"),
                Value::Integer(n) => format!("<ssv:Integer value=\"{n}\"/>"),
                Value::Item(item) => format!("<ssv:Enumeration value=\"{item}\"/>"),
            };
            format!("    <ssv:Parameter name=\"{name}\">{value}</ssv:Parameter>\n")
        });
        let (notes, values) = (notes.collect::<String>(), values.collect::<String>());
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!--\n{notes}-->\n<ssv:ParameterSet \
             xmlns:ssv=\"http://ssp-standard.org/SSP1/SystemStructureParameterValues\" \
             version=\"1.0\" name=\"tank\">\n  <ssv:Parameters>\n{values}  </ssv:Parameters>\n</ssv:ParameterSet>\n"
        )
    }
}
