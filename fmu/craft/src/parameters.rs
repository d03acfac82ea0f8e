//! Parameters and initial conditions of the craft and its tanks, and the checks of their values. Messages use the names of
//! the FMU's parameters, whose indices count from 1.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Display;
use core::format_args as lazy;
use formulas::cylinder;
use taylor::integrator::Steps;
use taylor::vector::{
    Mat3, Quaternion, Vec3, add, cross, dot, largest, on_sphere, rotation, scale, sub, times,
    transposed_times, unit_quaternion,
};

use crate::appendage::{Appendage, Structure, beyond_message};
use crate::pivot::Pivot;
use crate::rigid::{Mat6, Rigid, SINGULAR, add_rank_one, along_rod, smallest_pivot};
use crate::sizes::{APPENDAGES, MODES, POINTS, TANKS};
use crate::surface::{self, Higher, Surface};
use crate::table::{FillTable, LIGHTEST, SHORTEST};

/// Symmetric inertia tensor J = integral of (|s|^2 1 - s s^T) dm, kg m2. The products of inertia are elements of this
/// matrix, so that `xy` is minus the integral of x y dm.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Inertia {
    pub xx: f64,
    pub yy: f64,
    pub zz: f64,
    pub xy: f64,
    pub xz: f64,
    pub yz: f64,
}

impl Inertia {
    /// Returns the inertia matrix by rows, kg m2.
    pub fn matrix(&self) -> [[f64; 3]; 3] {
        let Inertia { xx, yy, zz, xy, xz, yz } = *self;
        [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
    }

    /// Returns the principal moments of inertia in ascending order, kg m2: the eigenvalues of the symmetric matrix, from the
    /// roots of its characteristic cubic (Smith, Communications of the ACM 4 (1961)).
    fn principal_moments(&self) -> [f64; 3] {
        let Inertia { xx, yy, zz, xy, xz, yz } = *self;
        let mean = (xx + yy + zz) / 3.0;
        let [x, y, z] = [xx - mean, yy - mean, zz - mean];
        let square = (x * x + y * y + z * z + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0;
        let p = libm::sqrt(square);
        if p <= 1e-15 * mean {
            return [mean; 3];
        }
        let [x, y, z, xy, xz, yz] = [x, y, z, xy, xz, yz].map(|element| element / p);
        let determinant = x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz);
        let angle = libm::acos((determinant / 2.0).clamp(-1.0, 1.0)) / 3.0;
        let third = core::f64::consts::TAU / 3.0;
        let largest = mean + 2.0 * p * libm::cos(angle);
        let smallest = mean + 2.0 * p * libm::cos(angle + third);
        [smallest, 3.0 * mean - largest - smallest, largest]
    }
}

/// The craft without liquid and with its wheels at rest: `mass`, kg, centre of mass `r` from O, m, and inertia `j` about the
/// centre of mass, body axes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Craft {
    pub mass: f64,
    pub r: Vec3,
    pub j: Inertia,
}

impl Craft {
    pub(crate) fn rigid(&self) -> Rigid {
        Rigid::new(self.mass, self.r, &self.j.matrix())
    }
}

/// Mounting of the craft. In free flight gravity has no effect, because position and velocity refer to a
/// freely falling frame. If the craft is on a pivot, its point O rests on a bearing in uniform gravity, and
/// the craft turns about O, freely unless the pivot has stiffness, damping or friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[allow(missing_docs)]
pub enum Mount {
    Free = 1,
    Pivot = 2,
}

impl Mount {
    /// All values in the order of their numbers.
    pub const ALL: [Mount; 2] = [Mount::Free, Mount::Pivot];
}

/// Dependence of a mode's drag coefficient c on the natural frequency w, which grows with the acceleration along the tank.
/// `Laminar`, c ~ w^(1/2), describes a laminar layer at the wall and is for tanks without baffles. `ConstantRatio`, c ~ w,
/// keeps the damping ratio constant and is for a measured or specified ratio. `Constant` is for dissipation outside a
/// laminar layer, for example in a diaphragm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[allow(missing_docs)]
pub enum DampingLaw {
    Laminar = 1,
    ConstantRatio = 2,
    Constant = 3,
}

impl DampingLaw {
    /// All laws in the order of their numbers.
    pub const ALL: [DampingLaw; 3] =
        [DampingLaw::Laminar, DampingLaw::ConstantRatio, DampingLaw::Constant];
}

/// Parameters of the model of detached liquid, in which the liquid is one body that crosses the tank (`lump.rs`). They are
/// the FMUs' parameters `tank[].ball.…`. If `travel` is 0 the tank has no model of detached liquid. If `radius` is 0, it is
/// computed so that at the bottom of the tank the surface that bounds the liquid's centre has the curvature of the path of
/// the pendulums' common centre.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Ball {
    pub travel: f64,
    pub radius: f64,
    pub restitution: f64,
    pub contact_speed: f64,
    pub drag: f64,
}

impl Default for Ball {
    fn default() -> Self {
        Ball { travel: 0.0, radius: 0.0, restitution: 0.3, contact_speed: 1e-3, drag: 0.05 }
    }
}

/// Surface that the centre of detached liquid can reach, with its own centre at `height` on the tank's axis and the
/// semi-axes `half` (a) along the axis and `radius` (b) across it, m. `gyration` is R_p, m, of `lump.rs`, and `mass` is the
/// mass of the liquid, kg.
pub(crate) struct BallSurface {
    pub mass: f64,
    pub gyration: f64,
    pub height: f64,
    pub half: f64,
    pub radius: f64,
}

/// One tank: rigid liquid and pendulums, in the tank's own axes. Its z axis is the tank's axis; liquid at rest hangs towards
/// -z. The fields are the FMUs' parameters `tank[].…`; meanings, units and ranges are in the FMUs' variable tables.
/// Quaternions and directions need not have unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Tank {
    pub position: Vec3,
    pub q: Quaternion,
    pub diameter: f64,
    pub depth: f64,
    pub density: f64,
    pub m_0: f64,
    pub h_0: f64,
    pub i_0: f64,
    pub i_z: f64,
    pub r_0: [f64; 2],
    pub di_y: f64,
    pub products: [f64; 3],
    pub modes: usize,
    pub g_ref: f64,
    pub mass: [f64; MODES],
    pub length: [f64; MODES],
    pub frequency: [f64; MODES],
    pub hinge: [f64; MODES],
    pub direction: [[f64; 2]; MODES],
    pub arm: [f64; MODES],
    pub k: [f64; MODES],
    pub zeta: [f64; MODES],
    pub damping_law: DampingLaw,
    pub g_floor: f64,
    pub zeta_amplitude: [f64; MODES],
    pub zeta_breaking: [f64; MODES],
    pub breaking_steepness: [f64; MODES],
    pub nonlinear_inertia: [f64; MODES],
    pub nonlinear_stiffness: [f64; MODES],
    pub nonlinear_inertia_2: [f64; MODES],
    pub nonlinear_stiffness_2: [f64; MODES],
    pub rotary_inertia: [f64; MODES],
    pub rotary_inertia_2: [f64; MODES],
    pub gyroscopic: [f64; MODES],
    pub gyroscopic_stiffness: [f64; MODES],
    pub angle_limit: [f64; MODES],
    pub swirl_limit: [f64; MODES],
    pub g_bond: f64,
    pub wave: [f64; MODES],
    pub fill: FillTable,
    pub liquid_0: f64,
    pub outlet: f64,
    pub ball: Ball,
    pub spin_inertia: f64,
    pub spin_inertia_across: f64,
    pub spin_coupling: f64,
    pub spin_decay: [f64; 2],
    pub slip_0: Vec3,
    pub p_0: [Vec3; MODES],
    pub p_dot_0: [Vec3; MODES],
}

impl Tank {
    /// Returns the tank with all parameters that follow from other parameters: modes and rigid liquid if the diameter is given,
    /// and pendulum lengths if frequencies are given.
    pub(crate) fn resolve(&self) -> Tank {
        let mut tank = *self;
        let modes = self.modes.min(MODES);
        if self.diameter > 0.0 {
            let (d, h) = (self.diameter, self.depth);
            let m_liq = self.density * core::f64::consts::PI * d * d / 4.0 * h;
            let pendulums: [_; MODES] =
                core::array::from_fn(|n| cylinder::pendulum(n, d, h, m_liq));
            for (n, pendulum) in pendulums.iter().enumerate() {
                (tank.mass[n], tank.length[n]) = (pendulum.mass, pendulum.length);
                (tank.hinge[n], tank.wave[n]) = (pendulum.hinge, pendulum.wave);
            }
            [tank.m_0, tank.h_0, tank.i_0] = cylinder::rest(d, h, m_liq, &pendulums[..modes]);
        }
        if (2..=POINTS).contains(&self.fill.points) {
            let curves = self.fill.curves(modes);
            let at = curves.place(self.liquid_0);
            tank.m_0 = self.liquid_0;
            for n in 0..modes {
                let mode = curves.mode(n, at).map(|jet| jet[0]);
                [tank.mass[n], tank.length[n], tank.hinge[n]] = mode;
                tank.m_0 -= tank.mass[n];
                if let Some(zeta) = curves.zeta(n, at) {
                    tank.zeta[n] = zeta;
                }
                if let Some([[s, ..], [kappa, ..]]) = curves.surface(n, at) {
                    (tank.nonlinear_inertia[n], tank.nonlinear_stiffness[n]) = (s, kappa);
                }
            }
            [tank.h_0, tank.i_0, tank.i_z] = curves.rigid(at).map(|jet| jet[0]);
            return tank;
        }
        for n in 0..modes {
            if self.frequency[n] > 0.0 {
                let w = core::f64::consts::TAU * self.frequency[n];
                // These lower bounds avoid a division by 0. They are below the allowed ranges, and values below the ranges
                // give lengths that are refused.
                let squared = w * w - self.k[n] / tank.mass[n].max(LIGHTEST);
                tank.length[n] = self.g_ref / squared.max(1e-30);
            }
        }
        tank
    }

    /// Returns the rigid liquid of the tank as a body: the fixed mass m_0 on the tank's axis at the height H_0, with
    /// the inertia J_0 = I_0 1 + (I_z - I_0) e e^T about its centre. In a tank without axial symmetry the offset r_0,
    /// the difference dI_y and the products of inertia are added.
    pub(crate) fn rigid(&self) -> Rigid {
        let axes = rotation(&unit_quaternion(self.q));
        let mut center = add(self.position, scale(self.h_0, axes.map(|row| row[2])));
        if !self.is_axial() {
            center = add(center, times(&axes, [self.r_0[0], self.r_0[1], 0.0]));
        }
        Rigid::new(self.m_0, center, &self.own_inertia())
    }

    pub(crate) fn own_inertia(&self) -> Mat3 {
        let axes = rotation(&unit_quaternion(self.q));
        let e = axes.map(|row| row[2]);
        let mut own = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let one = if i == j { self.i_0 } else { 0.0 };
                own[i][j] = one + (self.i_z - self.i_0) * e[i] * e[j];
            }
        }
        if !self.is_axial() {
            let [xy, xz, yz] = self.products;
            let more = [[0.0, xy, xz], [xy, self.di_y, yz], [xz, yz, 0.0]];
            let half = axes.map(|row| times(&more, row));
            for i in 0..3 {
                own[i] = add(own[i], times(&axes, half[i]));
            }
        }
        own
    }

    pub(crate) fn is_axial(&self) -> bool {
        let rigid = self.r_0 == [0.0; 2] && self.di_y == 0.0 && self.products == [0.0; 3];
        rigid && !self.is_planar()
    }

    pub(crate) fn is_planar(&self) -> bool {
        self.direction[..self.modes.min(MODES)].iter().any(|direction| *direction != [0.0; 2])
    }

    /// Returns the surface on which the bob of mode `n` moves (`n` counts from 0); `None` for a pendulum. If the fill table
    /// makes the mode a pendulum at only some masses of liquid, it has a surface at every mass.
    pub(crate) fn surface(&self, n: usize) -> Option<Surface> {
        let [s, kappa] = [self.nonlinear_inertia[n], self.nonlinear_stiffness[n]];
        let surface = match self.fill.has_surface(n) {
            true => Some(Surface::from_coefficients([s, kappa])),
            false => Surface::new(s, kappa, self.higher(n)),
        };
        surface.filter(|_| n < self.modes)
    }

    pub(crate) fn higher(&self, n: usize) -> Higher {
        Higher {
            inertia: self.nonlinear_inertia_2[n],
            stiffness: self.nonlinear_stiffness_2[n],
            rotary: [self.rotary_inertia[n], self.rotary_inertia_2[n]],
            gyroscopic: match [self.gyroscopic[n], self.gyroscopic_stiffness[n]] {
                [1.0, 0.0] => [0.0; 2],
                [c, stiffness] if self.spin_inertia > 0.0 => [1.0 - c, stiffness + 2.0 * c - 1.0],
                _ => [0.0; 2],
            },
        }
    }

    /// Returns the coefficients beyond the third order of mode `n`, which counts from 0, if the
    /// spin of the liquid changes this mode; otherwise `None`.
    pub(crate) fn gyroscopic(&self, n: usize) -> Option<Higher> {
        Some(self.higher(n)).filter(|higher| higher.gyroscopic != [0.0; 2])
    }

    pub(crate) fn has_surface(&self) -> bool {
        (0..MODES).any(|n| self.surface(n).is_some())
    }

    /// Returns the error message for a slosh angle of mode `n` (which counts from 0) at which the coefficients of the mode
    /// are no longer valid. `name` is the tank's name in the FMU.
    pub(crate) fn bound_message(&self, n: usize, name: &str) -> String {
        let pair = [self.nonlinear_inertia[n], self.nonlinear_stiffness[n]];
        let text = surface::bound_message(pair, self.higher(n), n, name);
        match self.fill.has_surface(n) {
            true => format!(
                "{text}. The table {name}.fill gives these coefficients at {:?} kg of liquid",
                self.liquid_0
            ),
            false => text,
        }
    }

    /// Returns true if mode `n`, which counts from 0, is not a pendulum that swings in every direction: it is planar, or its
    /// bob moves on another surface than a sphere.
    pub(crate) fn is_constrained(&self, n: usize) -> bool {
        self.surface(n).is_some() || self.plane_normal(n).is_some()
    }

    /// Returns true if `contents.rs` computes outputs and derivatives of the tank, because the tank can drain, has planar
    /// modes, has coefficients of the third order that differ from those of pendulums, or has liquid that spins.
    pub(crate) fn has_contents(&self) -> bool {
        self.fill.points > 0 || self.is_planar() || self.has_surface() || self.spin_inertia > 0.0
    }

    /// Returns the moments of inertia of the spinning liquid about the tank's x, y and z axes, kg
    /// m2. Returns `None` if the tank's liquid has no spin.
    pub(crate) fn spin_inertias(&self) -> Option<Vec3> {
        let axial = self.spin_inertia;
        let across = if self.spin_inertia_across > 0.0 { self.spin_inertia_across } else { axial };
        (axial > 0.0).then_some([across, across, axial])
    }

    /// Returns the liquid's angular momentum of spin at the start, kg m2/s, tank axes, at the angular velocity `omega` of
    /// the craft, rad/s, body axes.
    pub(crate) fn spin_at_start(&self, omega: Vec3) -> Vec3 {
        let Some(inertia) = self.spin_inertias() else { return [0.0; 3] };
        let [x, y, z] = transposed_times(&rotation(&unit_quaternion(self.q)), omega);
        let turned = add(self.slip_0, [self.spin_coupling * x, self.spin_coupling * y, z]);
        [0, 1, 2].map(|i| inertia[i] * turned[i])
    }

    pub(crate) fn whole_mass(&self) -> f64 {
        self.mass[..self.modes].iter().fold(self.m_0, |sum, m| sum + m)
    }

    /// Returns the unit vector b (tank axes) that is perpendicular to the plane in which the bob of mode `n` swings; `n`
    /// counts from 0. Its sign is such that e x b is minus the mode's direction, where e is the tank's axis. Returns `None`
    /// if the mode swings in every direction.
    pub(crate) fn plane_normal(&self, n: usize) -> Option<Vec3> {
        let [x, y] = self.direction[n];
        // Only directions longer than 1e-6 are accepted. The lower bound avoids a division by 0 if the compiler moves the
        // division in front of this check.
        let size = libm::hypot(x, y).max(1e-9);
        (self.direction[n] != [0.0; 2]).then(|| [-y / size, x / size, 0.0])
    }

    /// Returns the position of the hinge of mode `n` from O (m), and for a planar mode the unit vector b perpendicular
    /// to its plane; both in body axes. Modes count from 0.
    pub(crate) fn hinge_and_across(&self, n: usize) -> (Vec3, Option<Vec3>) {
        let axes = rotation(&unit_quaternion(self.q));
        let on_axis = add(self.position, scale(self.hinge[n], axes.map(|row| row[2])));
        match self.plane_normal(n).map(|b| times(&axes, b)) {
            Some(b) => (sub(on_axis, scale(self.arm[n], b)), Some(b)),
            None => (on_axis, None),
        }
    }

    /// Returns the position of the hinge of mode `n` from O (m), and the unit vector of the tank's axis; both in body
    /// axes. Modes count from 0.
    pub(crate) fn hinge_and_axis(&self, n: usize) -> [Vec3; 2] {
        let e = rotation(&unit_quaternion(self.q)).map(|row| row[2]);
        [self.hinge_and_across(n).0, e]
    }

    /// Returns the rigid body that stands for the bob of mode `n` in the constant added mass of
    /// [`Coupling::Lumped`](crate::Coupling). `n` counts from 0.
    pub(crate) fn lumped(&self, n: usize) -> Rigid {
        let (m, l) = (self.mass[n], self.length[n]);
        let (hinge, across) = self.hinge_and_across(n);
        if let Some(surface) = self.surface(n) {
            let r = l * surface.reach();
            let own = 2.0 * m * r * r;
            let own = [[own, 0.0, 0.0], [0.0, own, 0.0], [0.0, 0.0, own]];
            return Rigid::new(2.0 * m, hinge, &own);
        }
        let Some(b) = across else { return Rigid::new(m, hinge, &[[0.0; 3]; 3]) };
        let own = 2.0 * m * l * l;
        let element = |i: usize, j: usize| own * (if i == j { 1.0 } else { 0.0 } - b[i] * b[j]);
        let own = [0, 1, 2].map(|i| [0, 1, 2].map(|j| element(i, j)));
        Rigid::new(2.0 * m, hinge, &own)
    }

    /// Adds the bobs of planar modes to the craft's mass matrix. The rods are at `angles`, rad, from their positions at rest. A
    /// planar bob has inertia along its rod and perpendicular to its plane.
    fn add_planar_bobs(&self, matrix: &mut Mat6, angles: &[f64; MODES]) {
        let e = rotation(&unit_quaternion(self.q)).map(|row| row[2]);
        for n in 0..self.modes {
            let (hinge, Some(b)) = self.hinge_and_across(n) else { continue };
            let (sin, cos) = libm::sincos(angles[n]);
            let up = add(scale(cos, e), scale(sin, cross(b, e)));
            let rho = sub(hinge, scale(self.length[n], up));
            for u in [along_rod(up, hinge), along_rod(b, rho)] {
                add_rank_one(matrix, self.mass[n], &u);
            }
        }
    }

    /// Returns the rigid liquid in the state in which it adds least to the mass matrix: with detached liquid only the
    /// inertia that rotates with the tank, and in a draining tank the rigid liquid at the first point of the fill table.
    fn least_rigid(&self) -> Rigid {
        if self.ball.travel > 0.0 {
            return Rigid { mass: 0.0, moment: [0.0; 3], inertia: self.own_inertia() };
        }
        self.at_point(0).rigid()
    }

    /// Returns the tank with the contents of a point of its fill table, which counts from 0. If the table has no such point,
    /// returns the tank unchanged.
    fn at_point(&self, point: usize) -> Tank {
        match self.fill.masses().get(point) {
            Some(&liquid_0) => Tank { liquid_0, ..*self }.resolve(),
            None => *self,
        }
    }

    /// Returns the inertia by which bobs with s < 1 can reduce the inertia of the craft
    /// (`surface.rs`), as a body of negative mass. Slosh angles up to 45 degrees are included. The
    /// sum of this body, the craft and the rigid liquid must have positive inertia.
    fn inertia_reduction(&self) -> Rigid {
        let none = Rigid { mass: 0.0, moment: [0.0; 3], inertia: [[0.0; 3]; 3] };
        (0..self.modes).fold(none, |sum, n| {
            let reduction = self.surface(n).map_or(0.0, |surface| surface.inertia_reduction());
            sum.combined_with(&Rigid::new(
                -reduction * self.mass[n],
                self.hinge_and_across(n).0,
                &none.inertia,
            ))
        })
    }

    /// Returns direction and rate of the bob of mode `n`, which counts from 0, at the start of the simulation, tank axes.
    pub(crate) fn at_start(&self, n: usize) -> [Vec3; 2] {
        let [p, p_d] = [self.p_0[n], self.p_dot_0[n]].map(|x| match self.plane_normal(n) {
            Some(b) => sub(x, scale(dot(b, x), b)),
            None => x,
        });
        on_sphere(p, p_d)
    }

    /// Returns the specific force along the axis, m/s2, below which mode `n`, which counts from 0, does not represent
    /// liquid. It is slightly negative, so that a craft without thrust does not count as one with reversed thrust.
    pub(crate) fn lowest(&self, n: usize) -> f64 {
        -self.smallest_acceleration() - self.k[n] * self.length[n] / self.mass[n]
    }

    /// Returns the surface that the detached liquid's centre can reach; `None` if the tank has no model of detached liquid.
    /// The tank must be the result of [`Tank::resolve`].
    pub(crate) fn ball_surface(&self) -> Option<BallSurface> {
        if self.ball.travel <= 0.0 || self.modes == 0 {
            return None;
        }
        let modes = 0..self.modes.min(MODES);
        let mass = modes.clone().fold(self.m_0, |sum, n| sum + self.mass[n]);
        let moment = modes.clone().fold(self.m_0 * self.h_0, |sum, n| {
            sum + self.mass[n] * (self.hinge[n] - self.length[n])
        });
        let gyration = modes.fold(0.0, |sum, n| sum + self.mass[n] * self.length[n]) / mass;
        let half = self.ball.travel / 2.0;
        let least = libm::sqrt(half * gyration);
        let radius = if self.ball.radius > 0.0 { self.ball.radius } else { least };
        Some(BallSurface { mass, gyration, height: moment / mass + half, half, radius })
    }

    pub(crate) fn smallest_acceleration(&self) -> f64 {
        if self.g_floor > 0.0 { self.g_floor } else { 1e-4 * self.g_ref }
    }

    pub(crate) fn follows(&self, n: usize) -> bool {
        let is_viscous = self.zeta[n] > 0.0 || self.fill.has_zeta(n);
        let by_acceleration = self.damping_law != DampingLaw::Constant && is_viscous;
        by_acceleration || self.zeta_amplitude[n] > 0.0 || self.zeta_breaking[n] > 0.0
    }

    /// Returns the drag coefficient of mode `n`, which counts from 0, at the specific force g_ref, N s/m: c = 2 zeta
    /// m sqrt(g_ref/l + k/m).
    pub fn drag(&self, n: usize) -> f64 {
        let (m, l) = (self.mass[n], self.length[n]);
        2.0 * self.zeta[n] * m * libm::sqrt(self.g_ref / l + self.k[n] / m)
    }
}

impl Appendage {
    fn find_problems(&self, name: &str, problems: &mut Problems) {
        problems.vector(lazy!("{name}.position"), &self.position, "m");
        problems.number(lazy!("{name}.frequency"), self.frequency, 1e-6, 1e6, "Hz");
        problems.number(lazy!("{name}.zeta"), self.zeta, 0.0, 10.0, "");
        problems.vector(lazy!("{name}.participation"), &self.participation, "kg^0.5, kg^0.5.m");
        problems.vector(lazy!("{name}.eta_0"), &[self.eta], "kg^0.5.m");
        problems.vector(lazy!("{name}.eta_dot_0"), &[self.eta_dot], "kg^0.5.m/s");
    }
}

/// Initial motion: attitude quaternion from body to inertial axes, scalar first, of any length; angular velocity relative to
/// the inertial frame, rad/s, body axes; position, m, and velocity, m/s, of O in inertial axes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Init {
    pub q: Quaternion,
    pub omega: Vec3,
    pub position: Vec3,
    pub velocity: Vec3,
}

/// All parameters and initial conditions of a [`Spacecraft`](crate::Spacecraft). `gravity`, m/s2, inertial axes, and `pivot`
/// have an effect only with [`Mount::Pivot`]. `tanks` is the number of tanks, 0 to [`TANKS`], and `appendages` the number of
/// modes of flexible appendages, 0 to [`APPENDAGES`]; a mode without participation has no effect. `max_steps` is the largest
/// number of internal steps in one step, at least 1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct Parameters {
    pub craft: Craft,
    pub mount: Mount,
    pub gravity: Vec3,
    pub pivot: Pivot,
    pub tanks: usize,
    pub tank: [Tank; TANKS],
    pub appendages: usize,
    pub appendage: [Appendage; APPENDAGES],
    pub init: Init,
    pub max_steps: usize,
}

// The values are those of the 1180 kg craft of the record `axial_pulse` (../tests/six.json), with a tank on its axis. The
// tank is an upright cylinder of radius 0.45 m, filled 0.6 m deep with a liquid of 1000 kg/m3. Its modes are computed from
// potential flow (Abramson, NASA SP-106). m_0, H_0 and I_0 belong to a model with one mode.
impl Default for Craft {
    fn default() -> Self {
        let j = Inertia { xx: 910.0, yy: 860.0, zz: 640.0, xy: 0.0, xz: 0.0, yz: 0.0 };
        Craft { mass: 1180.0, r: [0.0, 0.0, 0.21], j }
    }
}

/// Fill table of the default tank, an upright cylinder of R = 0.45 m with its bottom at -0.3 m and one mode, filled with
/// water 0.1, 0.2, ... 1.2 m deep. The values are computed by `formulas::cylinder`.
#[rustfmt::skip]
const CYLINDER: FillTable = FillTable {
    points: POINTS,
    liquid: [63.6173, 127.235, 190.852, 254.469, 318.086, 381.704, 445.321, 508.938, 572.555, 636.173, 699.79, 763.407],
    h_0: [-0.0636349, -0.00124903, 0.00795427, 0.0167251, 0.0330603, 0.0563967, 0.0852024, 0.118179, 0.154351, 0.192997, 0.233579, 0.275689],
    i_0: [2.50041, 3.15786, 3.14549, 3.06287, 3.15717, 3.67522, 4.92169, 7.24793, 11.0317, 16.6603, 24.5201, 34.9903],
    i_z: [0.0; POINTS],
    mass: [
        [50.4527, 87.717, 109.537, 120.617, 125.838, 128.211, 129.272, 129.743, 129.951, 130.043, 130.084, 130.102],
        [3.24612, 3.84804, 3.90955, 3.91535, 3.9159, 3.91595, 3.91595, 3.91595, 3.91595, 3.91595, 3.91595, 3.91595],
        [0.892184, 0.932325, 0.933248, 0.933269, 0.93327, 0.93327, 0.93327, 0.93327, 0.93327, 0.93327, 0.93327, 0.93327],
    ],
    length: [
        [0.63032, 0.362545, 0.290326, 0.263656, 0.252717, 0.248039, 0.246003, 0.245111, 0.244718, 0.244545, 0.244468, 0.244435],
        [0.101822, 0.0858945, 0.0845431, 0.0844178, 0.0844061, 0.084405, 0.0844049, 0.0844049, 0.0844049, 0.0844049, 0.0844049, 0.0844049],
        [0.0551436, 0.0527694, 0.0527171, 0.052716, 0.0527159, 0.0527159, 0.0527159, 0.0527159, 0.0527159, 0.0527159, 0.0527159, 0.0527159],
    ],
    hinge: [
        [0.331692, 0.0730052, 0.0230679, 0.0341225, 0.0758217, 0.136534, 0.209939, 0.29198, 0.379898, 0.4718, 0.566386, 0.662775],
        [-0.187919, -0.15404, -0.0748788, 0.0185355, 0.116497, 0.215871, 0.31568, 0.415621, 0.515603, 0.615597, 0.715596, 0.815595],
        [-0.222781, -0.148021, -0.0520051, 0.0473908, 0.1473, 0.247286, 0.347284, 0.447284, 0.547284, 0.647284, 0.747284, 0.847284],
    ],
    zeta: [[0.0; POINTS]; MODES],
    nonlinear_inertia: [[1.0; POINTS]; MODES],
    nonlinear_stiffness: [[1.0; POINTS]; MODES],
    angle_limit: [[0.0; POINTS]; MODES],
    swirl_limit: [[0.0; POINTS]; MODES],
};

impl Default for Tank {
    fn default() -> Self {
        Tank {
            position: [0.0, 0.0, -0.45],
            q: [1.0, 0.0, 0.0, 0.0],
            diameter: 0.0,
            depth: 0.6,
            density: 1000.0,
            m_0: 253.493,
            h_0: 0.0563967,
            i_0: 3.67522,
            i_z: 0.0,
            r_0: [0.0; 2],
            di_y: 0.0,
            products: [0.0; 3],
            modes: 1,
            g_ref: 1.5,
            mass: [128.211, 3.91595, 0.93327],
            length: [0.248039, 0.084405, 0.0527159],
            frequency: [0.0; MODES],
            hinge: [0.136534, 0.215871, 0.247286],
            direction: [[0.0; 2]; MODES],
            arm: [0.0; MODES],
            k: [0.0; MODES],
            zeta: [0.005; MODES],
            damping_law: DampingLaw::Laminar,
            g_floor: 0.0,
            zeta_amplitude: [0.0; MODES],
            zeta_breaking: [0.0; MODES],
            breaking_steepness: [0.0; MODES],
            nonlinear_inertia: [1.0; MODES],
            nonlinear_stiffness: [1.0; MODES],
            nonlinear_inertia_2: [0.0; MODES],
            nonlinear_stiffness_2: [0.0; MODES],
            rotary_inertia: [0.0; MODES],
            rotary_inertia_2: [0.0; MODES],
            gyroscopic: [1.0; MODES],
            gyroscopic_stiffness: [0.0; MODES],
            angle_limit: [0.0; MODES],
            swirl_limit: [0.0; MODES],
            g_bond: 0.0,
            wave: [0.376618, 0.0328144, 0.0125218],
            ball: Ball::default(),
            fill: FillTable { points: 0, ..CYLINDER },
            liquid_0: 381.704,
            outlet: -0.3,
            spin_inertia: 0.0,
            spin_inertia_across: 0.0,
            spin_coupling: 1.0,
            spin_decay: [0.0; 2],
            slip_0: [0.0; 3],
            p_0: [[0.0, 0.0, -1.0]; MODES],
            p_dot_0: [[0.0; 3]; MODES],
        }
    }
}

impl Default for Init {
    fn default() -> Self {
        let at_rest = [0.0; 3];
        Init { q: [1.0, 0.0, 0.0, 0.0], omega: at_rest, position: at_rest, velocity: at_rest }
    }
}

impl Default for Parameters {
    fn default() -> Self {
        Parameters {
            craft: Craft::default(),
            mount: Mount::Free,
            gravity: [0.0, 0.0, -9.81],
            pivot: Pivot::default(),
            tanks: 1,
            tank: [Tank::default(); TANKS],
            appendages: APPENDAGES,
            appendage: [Appendage::default(); APPENDAGES],
            init: Init::default(),
            max_steps: MAX_STEPS,
        }
    }
}

/// Upper limit of masses, inertias and stiffnesses, so that squares and products do not overflow.
const HEAVIEST: f64 = 1e12;
const FARTHEST: f64 = 1e9;

/// Smallest accepted moment of inertia of spinning liquid, kg m2; the equations divide by it.
const LEAST_SPIN: f64 = 1e-9;

/// Largest allowed ratio of a principal moment of inertia to the sum of the other two moments. The ratio of a flat plate is
/// 1; the margin allows for moments that are rounded to four digits.
const PLATE: f64 = 1.0 + 1e-3;

/// Accepted relative tolerances of the integration. With smaller ones the allowed error would be below the rounding error, with
/// larger ones the error would not be limited in effect.
const TOLERANCES: core::ops::RangeInclusive<f64> = 1e-14..=1e-1;

pub(crate) fn tolerance_problem(tolerance: f64) -> Option<String> {
    let (low, high) = (TOLERANCES.start(), TOLERANCES.end());
    let is_wrong = !TOLERANCES.contains(&tolerance);
    is_wrong.then(|| format!("tolerance = {tolerance:?} (allowed: {low:?} to {high:?})"))
}

pub(crate) const MAX_STEPS: usize = 100_000;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    pub tolerance: f64,
    pub max_steps: usize,
}

impl Limits {
    pub fn steps(&self) -> Steps {
        let advice = ", or check for a very short pendulum (length) or a very stiff one (k)";
        // A step of twelve modes is slow under a fuzzer's sanitizer.
        let max_steps = if cfg!(fuzzing) { self.max_steps.min(200) } else { self.max_steps };
        Steps::new(max_steps, advice)
    }
}

pub(crate) fn steps_problem(max_steps: usize) -> Option<String> {
    (max_steps == 0).then(|| "solver.max_steps = 0 (allowed: 1 and above)".into())
}

/// Messages about wrong parameters. Names are formatted only for a message, because a craft has hundreds of parameters.
struct Problems(Vec<String>);

impl Problems {
    fn number(&mut self, name: impl Display, value: f64, low: f64, high: f64, unit: &str) {
        if !(low..=high).contains(&value) {
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            self.0.push(format!("{name} = {value:?} (allowed: {low:?} to {high:?}{unit})"));
        }
    }

    fn vector(&mut self, name: impl Display, value: &[f64], unit: &str) {
        for (i, &x) in value.iter().enumerate() {
            self.number(lazy!("{name}[{}]", i + 1), x, -FARTHEST, FARTHEST, unit);
        }
    }

    fn direction(&mut self, name: impl Display, value: &[f64]) {
        let before = self.0.len();
        self.vector(&name, value, "");
        if self.0.len() > before {
            return;
        }
        let size = libm::sqrt(value.iter().map(|x| x * x).sum());
        if size < 1e-6 {
            self.0
                .push(format!("{name} = {value:?} has no direction (allowed: length above 1e-6)"));
        }
    }
}

impl Tank {
    fn find_problems(&self, name: &str, problems: &mut Problems) {
        let before = problems.0.len();
        problems.number(lazy!("{name}.diameter"), self.diameter, 0.0, 1e3, "m");
        if self.diameter > 0.0 {
            problems.number(lazy!("{name}.depth"), self.depth, 1e-3, 1e3, "m");
            problems.number(lazy!("{name}.density"), self.density, 1e-3, 1e5, "kg/m3");
        }
        self.find_table_problems(name, problems);
        for (n, f) in self.frequency.iter().enumerate().take(self.modes) {
            problems.number(lazy!("{name}.frequency[{}]", n + 1), *f, 0.0, 1e6, "Hz");
        }
        if problems.0.len() == before {
            self.resolve().find_resolved_problems(name, problems);
        }
    }

    fn find_table_problems(&self, name: &str, problems: &mut Problems) {
        let table = &self.fill;
        if table.points == 0 {
            return;
        }
        if !(2..=POINTS).contains(&table.points) {
            problems.0.push(format!(
                "{name}.fill.points = {} (allowed: 0 for a tank that does not drain, or 2 to {POINTS})",
                table.points
            ));
            return;
        }
        problems.number(lazy!("{name}.outlet"), self.outlet, -FARTHEST, FARTHEST, "m");
        let (masses, fill) = (table.masses(), lazy!("{name}.fill"));
        for i in 0..table.points {
            let at = i + 1;
            let low = if i == 0 { LIGHTEST } else { masses[i - 1] };
            problems.number(lazy!("{fill}.liquid[{at}]"), masses[i], low, HEAVIEST, "kg");
            if i > 0 && masses[i] == low {
                problems.0.push(format!(
                    "{name}.fill.liquid[{at}] = {low:?} kg equals the mass of the previous point (allowed: masses that \
                     increase from point to point)"
                ));
            }
            problems.number(lazy!("{fill}.H_0[{at}]"), table.h_0[i], -FARTHEST, FARTHEST, "m");
            problems.number(lazy!("{fill}.I_0[{at}]"), table.i_0[i], 0.0, HEAVIEST, "kg.m2");
            problems.number(lazy!("{fill}.I_z[{at}]"), table.i_z[i], 0.0, HEAVIEST, "kg.m2");
            let mut sum = 0.0;
            for n in 0..self.modes.min(MODES) {
                let (mass, length) = (table.mass[n][i], table.length[n][i]);
                let place = lazy!("[{},{at}]", n + 1);
                problems.number(lazy!("{fill}.mass{place}"), mass, LIGHTEST, HEAVIEST, "kg");
                problems.number(lazy!("{fill}.length{place}"), length, SHORTEST, FARTHEST, "m");
                problems.number(
                    lazy!("{fill}.hinge{place}"),
                    table.hinge[n][i],
                    -FARTHEST,
                    FARTHEST,
                    "m",
                );
                problems.number(lazy!("{fill}.zeta{place}"), table.zeta[n][i], 0.0, 10.0, "");
                for (what, column) in [
                    ("nonlinear_inertia", &table.nonlinear_inertia),
                    ("nonlinear_stiffness", &table.nonlinear_stiffness),
                ] {
                    problems.number(lazy!("{fill}.{what}{place}"), column[n][i], -1e3, 1e3, "");
                }
                for (what, column) in
                    [("angle_limit", &table.angle_limit), ("swirl_limit", &table.swirl_limit)]
                {
                    problems.number(lazy!("{fill}.{what}{place}"), column[n][i], 0.0, 1.6, "rad");
                }
                sum += mass;
            }
            if sum > masses[i] {
                problems.0.push(format!(
                    "{name}.fill.mass at point {at} adds up to {sum:?} kg (allowed: up to the {:?} kg of \
                     {name}.fill.liquid[{at}])",
                    masses[i]
                ));
            }
        }
        let (first, last) = (masses[0], masses[table.points - 1]);
        problems.number(lazy!("{name}.liquid_0"), self.liquid_0, first, last, "kg");
        for (what, is_set) in [
            ("diameter", self.diameter > 0.0),
            ("frequency", self.frequency.iter().any(|f| *f > 0.0)),
        ] {
            if is_set {
                problems.0.push(format!(
                    "{name}.{what} cannot be combined with {name}.fill.points above 0, because the fill table gives the modes: set \
                     {name}.{what} = 0, or {name}.fill.points = 0"
                ));
            }
        }
    }

    fn find_resolved_problems(&self, name: &str, problems: &mut Problems) {
        let before_all = problems.0.len();
        problems.vector(lazy!("{name}.position"), &self.position, "m");
        problems.direction(lazy!("{name}.q"), &self.q);
        // Perpendicular to its plane the bob of a planar mode counts as rigid liquid. The sum of the bobs' masses may
        // therefore exceed the mass of the liquid, so that m_0 is negative.
        let least = if self.is_planar() { -HEAVIEST } else { 0.0 };
        problems.number(lazy!("{name}.m_0"), self.m_0, least, HEAVIEST, "kg");
        problems.number(lazy!("{name}.H_0"), self.h_0, -FARTHEST, FARTHEST, "m");
        problems.number(lazy!("{name}.I_0"), self.i_0, least, HEAVIEST, "kg.m2");
        problems.number(lazy!("{name}.I_z"), self.i_z, least, HEAVIEST, "kg.m2");
        problems.vector(lazy!("{name}.r_0"), &self.r_0, "m");
        let [xy, xz, yz] = self.products;
        for (what, value) in [("dI_y", self.di_y), ("I_xy", xy), ("I_xz", xz), ("I_yz", yz)] {
            problems.number(lazy!("{name}.{what}"), value, -HEAVIEST, HEAVIEST, "kg.m2");
        }
        self.find_axial_problems(name, problems);
        if self.modes > MODES {
            problems.0.push(format!("{name}.modes = {} (allowed: 0 to {MODES})", self.modes));
        }
        problems.number(lazy!("{name}.g_ref"), self.g_ref, 1e-9, 1e6, "m/s2");
        problems.number(lazy!("{name}.g_floor"), self.g_floor, 0.0, 1e6, "m/s2");
        problems.number(lazy!("{name}.g_bond"), self.g_bond, 0.0, 1e6, "m/s2");
        self.find_ball_problems(name, problems);
        self.find_spin_problems(name, problems);
        for n in 0..self.modes.min(MODES) {
            let i = n + 1;
            problems.number(lazy!("{name}.mass[{i}]"), self.mass[n], LIGHTEST, HEAVIEST, "kg");
            let (length, f) = (self.length[n], self.frequency[n]);
            if f > 0.0 && !(SHORTEST..=FARTHEST).contains(&length) {
                let by_k = libm::sqrt(self.k[n] / self.mass[n]) / core::f64::consts::TAU;
                let most = libm::sqrt(self.g_ref / SHORTEST) / core::f64::consts::TAU;
                problems.0.push(format!(
                    "{name}.frequency[{i}] = {f:?} Hz (allowed: above {by_k:?} Hz, the frequency from {name}.k[{i}] without thrust, and below {most:?} Hz)"
                ));
            } else {
                problems.number(lazy!("{name}.length[{i}]"), length, SHORTEST, FARTHEST, "m");
            }
            let hinge = self.hinge[n];
            problems.number(lazy!("{name}.hinge[{i}]"), hinge, -FARTHEST, FARTHEST, "m");
            problems.number(lazy!("{name}.k[{i}]"), self.k[n], 0.0, HEAVIEST, "N/m");
            problems.number(lazy!("{name}.zeta[{i}]"), self.zeta[n], 0.0, 10.0, "");
            let growth = self.zeta_amplitude[n];
            problems.number(lazy!("{name}.zeta_amplitude[{i}]"), growth, 0.0, 10.0, "1/rad");
            for (what, value) in [
                ("zeta_breaking", self.zeta_breaking[n]),
                ("breaking_steepness", self.breaking_steepness[n]),
            ] {
                problems.number(lazy!("{name}.{what}[{i}]"), value, 0.0, 10.0, "");
            }
            for (what, value) in [
                ("nonlinear_inertia", self.nonlinear_inertia[n]),
                ("nonlinear_stiffness", self.nonlinear_stiffness[n]),
            ] {
                problems.number(lazy!("{name}.{what}[{i}]"), value, -1e3, 1e3, "");
            }
            for (what, value) in self.beyond_third_order(n) {
                problems.number(lazy!("{name}.{what}[{i}]"), value, -1e5, 1e5, "");
                if value != 0.0 && self.fill.points > 0 {
                    problems.0.push(format!(
                        "{name}.{what}[{i}] = {value:?} cannot be combined with {name}.fill.points above 0, because a fill table has \
                         only coefficients of the third order: set {name}.{what}[{i}] = 0"
                    ));
                } else if value != 0.0
                    && what.starts_with("rotary")
                    && self.plane_normal(n).is_some()
                {
                    problems.0.push(format!(
                        "{name}.{what}[{i}] = {value:?} cannot be combined with {name}.direction[{i}], because a mode that swings in a \
                         plane has no rotary motion: set {name}.{what}[{i}] = 0, or {name}.direction[{i}] = 0"
                    ));
                }
            }
            let [c, epsilon] = [self.gyroscopic[n], self.gyroscopic_stiffness[n]];
            problems.number(lazy!("{name}.gyroscopic[{i}]"), c, -10.0, 10.0, "");
            problems.number(lazy!("{name}.gyroscopic_stiffness[{i}]"), epsilon, -1e3, 1e3, "");
            if self.gyroscopic(n).is_some() && self.plane_normal(n).is_some() {
                problems.0.push(format!(
                    "{name}.gyroscopic[{i}] = {c:?} and {name}.gyroscopic_stiffness[{i}] = {epsilon:?} cannot be combined with \
                     {name}.direction[{i}], because a mode that swings in a plane has no rotary motion: set {name}.gyroscopic[{i}] = 1 \
                     and {name}.gyroscopic_stiffness[{i}] = 0"
                ));
            }
            for (what, value) in
                [("angle_limit", self.angle_limit[n]), ("swirl_limit", self.swirl_limit[n])]
            {
                problems.number(lazy!("{name}.{what}[{i}]"), value, 0.0, 1.6, "rad");
            }
            problems.number(lazy!("{name}.wave[{i}]"), self.wave[n], 0.0, FARTHEST, "m/rad");
            let before = problems.0.len();
            if self.direction[n] != [0.0; 2] {
                problems.direction(lazy!("{name}.direction[{i}]"), &self.direction[n]);
                problems.number(lazy!("{name}.arm[{i}]"), self.arm[n], -FARTHEST, FARTHEST, "m");
            }
            problems.direction(lazy!("{name}.p_0[{i}]"), &self.p_0[n]);
            if problems.0.len() == before
                && let Some(b) = self.plane_normal(n)
            {
                let flat = sub(self.p_0[n], scale(dot(b, self.p_0[n]), b));
                if largest(flat) < 1e-6 {
                    problems.0.push(format!(
                        "{name}.p_0[{i}] = {:?} has no direction in the plane of {name}.direction[{i}] and the tank's \
                         axis (allowed: length above 1e-6 in it)",
                        self.p_0[n]
                    ));
                }
            }
            if problems.0.len() == before
                && let Some(surface) = self.surface(n)
            {
                let [p, _] = self.at_start(n);
                if libm::acos(-p[2].clamp(-1.0, 1.0)) >= surface.largest_angle() {
                    problems.0.push(format!("{name}.p_0[{i}]: {}", self.bound_message(n, name)));
                }
            }
            problems.vector(lazy!("{name}.p_dot_0[{i}]"), &self.p_dot_0[n], "1/s");
        }
        if problems.0.len() == before_all {
            self.find_ball_surface_problems(name, problems);
        }
    }

    fn beyond_third_order(&self, n: usize) -> [(&'static str, f64); 4] {
        [
            ("nonlinear_inertia_2", self.nonlinear_inertia_2[n]),
            ("nonlinear_stiffness_2", self.nonlinear_stiffness_2[n]),
            ("rotary_inertia", self.rotary_inertia[n]),
            ("rotary_inertia_2", self.rotary_inertia_2[n]),
        ]
    }

    fn find_axial_problems(&self, name: &str, problems: &mut Problems) {
        let uneven = [
            ("r_0", self.r_0 != [0.0; 2]),
            ("dI_y", self.di_y != 0.0),
            ("I_xy, I_xz, I_yz", self.products != [0.0; 3]),
            ("direction", self.is_planar()),
        ];
        let axial = [
            ("diameter", self.diameter > 0.0),
            ("fill.points", self.fill.points > 0),
            ("ball.travel", self.ball.travel > 0.0),
        ];
        if self.ball.travel > 0.0 && self.has_surface() {
            problems.0.push(format!(
                "{name}.ball.travel cannot be combined with {name}.nonlinear_inertia or {name}.nonlinear_stiffness other than 1, \
                 because the model of detached liquid takes over from pendulums only: set {name}.ball.travel = 0, or both \
                 coefficients to 1 in every mode"
            ));
        }
        for (what, _) in uneven.iter().filter(|(_, is_set)| *is_set) {
            for (other, _) in axial.iter().filter(|(_, is_set)| *is_set) {
                problems.0.push(format!(
                    "{name}.{other} cannot be combined with {name}.{what}, because {name}.{other} is for axisymmetric tanks: set one \
                     of the two to 0"
                ));
            }
        }
    }

    fn find_spin_problems(&self, name: &str, problems: &mut Problems) {
        for (what, value) in
            [("spin_inertia", self.spin_inertia), ("spin_inertia_across", self.spin_inertia_across)]
        {
            if value != 0.0 {
                problems.number(lazy!("{name}.{what}"), value, LEAST_SPIN, HEAVIEST, "kg.m2");
            }
        }
        if self.spin_inertia == 0.0 {
            return;
        }
        problems.number(lazy!("{name}.spin_coupling"), self.spin_coupling, 0.0, 1.0, "");
        for (i, decay) in self.spin_decay.iter().enumerate() {
            problems.number(lazy!("{name}.spin_decay[{}]", i + 1), *decay, 0.0, 1e3, "1/s");
        }
        for (i, slip) in self.slip_0.iter().enumerate() {
            problems.number(lazy!("{name}.slip_0[{}]", i + 1), *slip, -1e3, 1e3, "rad/s");
        }
        for (what, is_set) in
            [("fill.points", self.fill.points > 0), ("ball.travel", self.ball.travel > 0.0)]
        {
            if is_set {
                problems.0.push(format!(
                    "{name}.spin_inertia cannot be combined with {name}.{what}, because the spin of liquid that drains or detaches is \
                     not modelled: set one of the two to 0"
                ));
            }
        }
    }

    fn find_ball_problems(&self, name: &str, problems: &mut Problems) {
        let ball = &self.ball;
        problems.number(lazy!("{name}.ball.travel"), ball.travel, 0.0, 1e3, "m");
        if ball.travel <= 0.0 {
            return;
        }
        problems.number(lazy!("{name}.ball.radius"), ball.radius, 0.0, 1e3, "m");
        problems.number(lazy!("{name}.ball.restitution"), ball.restitution, 0.0, 1.0, "");
        problems.number(lazy!("{name}.ball.contact_speed"), ball.contact_speed, 1e-9, 1e3, "m/s");
        problems.number(lazy!("{name}.ball.drag"), ball.drag, 0.0, 1e3, "1/s");
    }

    fn find_ball_surface_problems(&self, name: &str, problems: &mut Problems) {
        let ball = &self.ball;
        if ball.travel <= 0.0 {
            return;
        }
        let mass = self.whole_mass();
        if mass <= 0.0 {
            problems.0.push(format!(
                "{name}.ball.travel = {:?} m needs liquid, but {name}.m_0 = {:?} kg and {name}.mass of all modes add up to {mass:?} kg \
                 (allowed: more than 0)",
                ball.travel, self.m_0
            ));
            return;
        }
        let Some(surface) = self.ball_surface() else {
            let modes = self.modes;
            problems.0.push(format!(
                "{name}.ball.travel = {:?} m cannot be combined with {name}.modes = {modes}, because the slosh angle of a mode decides \
                 when the liquid detaches: set {name}.modes to 1 or more, or {name}.ball.travel = 0",
                ball.travel
            ));
            return;
        };
        let least = 2.0 * surface.gyration;
        if ball.travel < least {
            problems.0.push(format!(
                "{name}.ball.travel = {:?} m (allowed: 0, or at least {least:?} m, which is twice the sum of {name}.mass \
                 {name}.length over all modes divided by the mass of the liquid)",
                ball.travel
            ));
            return;
        }
        let least = libm::sqrt(surface.half * surface.gyration);
        if ball.radius > 0.0 && ball.radius < least {
            problems.0.push(format!(
                "{name}.ball.radius = {:?} m (allowed: 0, or at least {least:?} m, so that the surface at the bottom \
                 is not more curved than the path of the pendulums' common centre of mass)",
                ball.radius
            ));
        }
    }

    pub(crate) fn problems(&self, name: &str) -> Vec<String> {
        let mut problems = Problems(Vec::new());
        self.find_problems(name, &mut problems);
        problems.0
    }
}

impl Craft {
    fn find_problems(&self, name: &str, problems: &mut Problems) {
        problems.number(lazy!("{name}.mass"), self.mass, LIGHTEST, HEAVIEST, "kg");
        problems.vector(lazy!("{name}.r"), &self.r, "m");
        let before = problems.0.len();
        let Inertia { xx, yy, zz, xy, xz, yz } = self.j;
        for (element, value) in [("Jxx", xx), ("Jyy", yy), ("Jzz", zz)] {
            problems.number(lazy!("{name}.{element}"), value, 0.0, HEAVIEST, "kg.m2");
        }
        for (element, value) in [("Jxy", xy), ("Jxz", xz), ("Jyz", yz)] {
            problems.number(lazy!("{name}.{element}"), value, -HEAVIEST, HEAVIEST, "kg.m2");
        }
        if problems.0.len() > before {
            return;
        }
        // This principal minor of the matrix is negative if a product of inertia is too large for its two moments of inertia.
        let minors = [
            ("Jxx", "Jyy", "Jxy", xx * yy, xy * xy),
            ("Jxx", "Jzz", "Jxz", xx * zz, xz * xz),
            ("Jyy", "Jzz", "Jyz", yy * zz, yz * yz),
        ];
        let mut indefinite = false;
        for (a, b, c, of_moments, of_product) in minors {
            if of_product > of_moments * (1.0 + 1e-12) {
                indefinite = true;
                problems.0.push(format!(
                    "{name}.{c}^2 = {of_product:?} (allowed: up to {name}.{a} {name}.{b} = \
                     {of_moments:?})"
                ));
            }
        }
        let determinant =
            xx * yy * zz + 2.0 * xy * xz * yz - xx * yz * yz - yy * xz * xz - zz * xy * xy;
        let negative = determinant < -1e-12 * xx * yy * zz;
        if !indefinite && negative {
            problems.0.push(format!(
                "{name}.Jxx to {name}.Jyz have a negative principal moment of inertia: the determinant of the inertia matrix is \
                 {determinant:?} kg3.m6 (allowed: 0 and above)"
            ));
        }
        // Each of the integrals of y^2 + z^2, x^2 + z^2 and x^2 + y^2 is at most the sum of the other two.
        let [small, middle, large] = self.j.principal_moments();
        let sum = small + middle;
        if !indefinite && !negative && large > PLATE * sum {
            // The message contains six digits of each value.
            let [small, middle, large, sum] = [small, middle, large, sum]
                .map(|moment| format!("{moment:.5e}").parse().unwrap_or(moment));
            problems.0.push(format!(
                "{name}.Jxx, {name}.Jyy, {name}.Jzz, with {name}.Jxy, {name}.Jxz, {name}.Jyz, have the principal moments \
                 {small:?}, {middle:?} and {large:?} kg.m2: the largest exceeds {sum:?}, the sum of the others (allowed: up \
                 to that sum)"
            ));
        }
    }

    pub(crate) fn problems(&self, name: &str) -> Vec<String> {
        let mut problems = Problems(Vec::new());
        self.find_problems(name, &mut problems);
        if problems.0.is_empty() && smallest_pivot(&self.rigid().mass_matrix()) < 1e-12 {
            problems.0.push(format!(
                "{name}.Jxx to {name}.Jyz are singular: the inertia about every axis must be above 0 kg.m2"
            ));
        }
        problems.0
    }
}

/// Returns the conditions under which the mass matrix of `body` with the liquid of `tanks` is singular, as a text that continues
/// a sentence after "is singular". Returns `None` if the matrix is regular at rest, also with detached liquid. Other angles of
/// planar modes are not checked, because the mass matrices of realistic craft become singular only at angles far beyond the range
/// of the modes.
pub(crate) fn singular_where(body: Rigid, tanks: &[Tank]) -> Option<String> {
    let matrix = |rigid: fn(&Tank) -> Rigid| {
        tanks.iter().fold(body, |sum, tank| sum.combined_with(&rigid(tank))).mass_matrix()
    };
    let mut at_rest = matrix(Tank::rigid);
    tanks.iter().for_each(|tank| tank.add_planar_bobs(&mut at_rest, &[0.0; MODES]));
    if smallest_pivot(&at_rest) < SINGULAR {
        return Some(String::new());
    }
    // The smallest inertia, after the reduction by the bobs, is checked at the start and at the points of fill tables.
    let is_singular = |point: usize| {
        let least = tanks.iter().fold(body, |sum, tank| {
            let tank = tank.at_point(point);
            sum.combined_with(&tank.rigid()).combined_with(&tank.inertia_reduction())
        });
        smallest_pivot(&least.mass_matrix()) < SINGULAR
    };
    if tanks.iter().any(Tank::has_surface) && (0..=POINTS).rev().any(is_singular) {
        let within =
            " at slosh angles up to 45 degrees: a nonlinear_inertia below 1 needs a heavier craft";
        return Some(within.into());
    }
    let flies = smallest_pivot(&matrix(Tank::least_rigid)) < SINGULAR;
    (flies && !tanks.iter().any(Tank::is_planar))
        .then(|| " while the liquid is detached, or at the first point of the fill tables".into())
}

impl Parameters {
    /// Returns a message for each invalid parameter or combination of parameters; empty if all are valid.
    pub fn problems(&self) -> Vec<String> {
        let mut problems = Problems(Vec::new());
        self.craft.find_problems("craft", &mut problems);
        problems.vector("gravity", &self.gravity, "m/s2");
        for (i, k) in self.pivot.k.iter().enumerate() {
            problems.number(lazy!("pivot.k[{}]", i + 1), *k, 0.0, HEAVIEST, "N.m/rad");
        }
        for (i, c) in self.pivot.c.iter().enumerate() {
            problems.number(lazy!("pivot.c[{}]", i + 1), *c, 0.0, HEAVIEST, "N.m.s/rad");
        }
        let friction = &self.pivot.friction;
        for (name, torques) in [("c", &friction.c), ("d", &friction.d)] {
            for (i, torque) in torques.iter().enumerate() {
                let name = lazy!("pivot.friction.{name}[{}]", i + 1);
                problems.number(name, *torque, 0.0, HEAVIEST, "N.m");
            }
        }
        problems.number("pivot.friction.omega_s", friction.omega_s, 1e-6, 1e6, "rad/s");
        problems.number("pivot.friction.eps", friction.eps, 1e-7, 1e3, "rad/s");
        problems.0.extend(steps_problem(self.max_steps));
        if self.tanks > TANKS {
            problems.0.push(format!("tanks = {} (allowed: 0 to {TANKS})", self.tanks));
        }
        for (i, tank) in self.tank[..self.tanks.min(TANKS)].iter().enumerate() {
            tank.find_problems(&format!("tank[{}]", i + 1), &mut problems);
        }
        if self.appendages > APPENDAGES {
            problems
                .0
                .push(format!("appendages = {} (allowed: 0 to {APPENDAGES})", self.appendages));
        }
        let appendages = &self.appendage[..self.appendages.min(APPENDAGES)];
        for (j, appendage) in appendages.iter().enumerate() {
            appendage.find_problems(&format!("appendage[{}]", j + 1), &mut problems);
        }
        let tanks = &self.tank[..self.tanks.min(TANKS)];
        let with_ball = tanks.iter().position(|tank| tank.ball.travel > 0.0);
        let that_drains = tanks.iter().position(|tank| tank.fill.points > 0);
        if let (Some(ball), Some(drains)) = (with_ball, that_drains) {
            problems.0.push(format!(
                "tank[{}].ball.travel cannot be combined with tank[{}].fill.points, because a craft with a model of detached liquid \
                 cannot have a tank that drains: set one of the two to 0",
                ball + 1,
                drains + 1
            ));
        }
        type Feature = (fn(&Tank) -> bool, &'static str, &'static str);
        let others: [Feature; 3] = [
            (
                Tank::is_planar,
                "direction",
                ", because a craft with a model of detached liquid cannot have planar modes: set one of the two to 0",
            ),
            (
                Tank::has_surface,
                "nonlinear_inertia or nonlinear_stiffness",
                " other than 1, because a craft with a model of detached liquid can have pendulums only: set ball.travel = 0, or both \
                 coefficients to 1 in every mode",
            ),
            (
                |tank| tank.spin_inertia > 0.0,
                "spin_inertia",
                ", because a craft with a model of detached liquid cannot have liquid that spins: set one of the two to 0",
            ),
        ];
        for (has, what, remedy) in others {
            let other = tanks.iter().position(has);
            if let (Some(ball), Some(other)) = (with_ball, other)
                && ball != other
            {
                problems.0.push(format!(
                    "tank[{}].ball.travel cannot be combined with tank[{}].{what}{remedy}",
                    ball + 1,
                    other + 1
                ));
            }
        }
        if let (Some(ball), Mount::Pivot) = (with_ball, self.mount) {
            problems.0.push(format!(
                "tank[{}].ball.travel cannot be combined with mount = pivot, because detached liquid is modelled for a craft in free \
                 flight only: set ball.travel = 0",
                ball + 1
            ));
        }
        problems.direction("init.q", &self.init.q);
        problems.vector("init.omega", &self.init.omega, "rad/s");
        problems.vector("init.position", &self.init.position, "m");
        problems.vector("init.velocity", &self.init.velocity, "m/s");
        if self.mount == Mount::Pivot && self.init.velocity != [0.0; 3] {
            problems.0.push(format!(
                "init.velocity = {:?} m/s cannot be combined with mount = pivot, because the pivot holds the origin O of the body \
                 frame: set init.velocity = 0",
                self.init.velocity
            ));
        }
        if problems.0.is_empty() {
            let tanks: Vec<Tank> = self.tank[..self.tanks].iter().map(Tank::resolve).collect();
            if let Some(place) = singular_where(self.craft.rigid(), &tanks) {
                problems.0.push(format!(
                    "the mass matrix of craft.mass, craft.Jxx to craft.Jyz and the tanks' m_0, I_0 and I_z is singular{place}. Mass of craft and rigid liquid, and their inertia \
                     about every axis through their centre of mass, must be above 0: increase craft.mass or craft.Jxx to craft.Jzz, or \
                     the tanks' m_0, I_0 and I_z"
                ));
            } else if let Some(structure) =
                Structure::new(&self.appendage[..self.appendages], self.craft.rigid())
            {
                let mut eta = self.appendage.map(|appendage| appendage.eta);
                eta[structure.len()..].fill(0.0);
                if structure.is_beyond(&[0.0; APPENDAGES]) {
                    problems.0.push(
                        "appendage[].participation leaves the dry craft no mass or inertia (allowed: craft.mass and craft.J above the \
                         sums of participation[i] participation[j], about the same point). Mass and inertia of the appendages belong to \
                         craft.mass and craft.J. Check the units kg^0.5 and kg^0.5.m of modes with unit modal mass"
                            .into(),
                    );
                } else if structure.is_beyond(&eta) {
                    let message = beyond_message(&eta[..structure.len()]);
                    problems.0.push(message.replace(".eta =", ".eta_0 ="));
                }
            }
        }
        problems.0
    }
}
