//! Contents of a tank that may drain: slosh masses, pendulum lengths and heights are functions of the mass m_liq of the
//! remaining liquid. The outflow f, kg/s, changes this mass by m_liq' = -f, and the fixed mass is m_0 = m_liq - sum of
//! m_n. A bob (slosh mass) is at rho from O, and its hinge at P; the height h, the length l and the mass m of the bob
//! change with m_liq. Newton's law for the liquid that stays in the bob determines the tension T of the rod and the motion
//! of the rod's direction p:
//! ```text
//! rho = P + l p,  P = d + h e
//! m [a + w' x rho + w x (w x rho) + 2 w x rho' + rho''] = -T p - phi
//! T = T_0 - m u.[a; w'],   u = [p; P x p]
//! T_0 = m (l |p'|^2 - p.(w x (w x rho) + 2 w x rho' + P'') - l'') - k l |p_perp|^2
//! p'' = -(1 - p p^T) G/l - |p'|^2 p
//! G = a + w' x rho + w x (w x rho) + 2 w x rho' + P'' + 2 l' p' + (c l/m) p' + (k l/m) p_perp
//! ```
//!
//! The bob of a planar mode swings in the plane through P perpendicular to b, a unit vector fixed in the tank. The tank
//! guides the bob by the force -N b, which is added to the right-hand side of Newton's law:
//!
//! ```text
//! N = -m b.G = N_0 - m u.[a; w'],  u = [b; rho x b]
//! p'' = -(1 - p p^T - b b^T) G/l - |p'|^2 p                  p.b = p'.b = 0
//! ```
//!
//! If the coefficients of the third order of a bob differ from those of a pendulum, the bob moves on another surface
//! than a sphere (`surface.rs`).
//!
//! A tank with planar modes does not drain. Perpendicular to the plane of its mode a bob moves as rigid liquid. If a tank
//! has modes along two directions, m_0 is the mass of the liquid minus the masses of the modes in both directions, so that
//! m_0 may be negative.
//!
//! Mass leaves a bob with the velocity of the bob, and leaves the craft with the velocity of the tank at the outlet, r_out =
//! d + z_out e. Between these two points it flows from each bob to the tank's axis, at the level of the bob, and then along
//! the axis. The flow within the tank has the momentum K relative to the tank and the moment of momentum L about O:
//!
//! ```text
//! K = j e + sum of m_n' l p_perp,   j = (m_0 H_0)' + sum of m_n' b_n + f z_out,   b_n = h + l e.p
//! L = d x K + e x sum of b_n m_n' l p_perp
//! ```
//!
//! In addition to their forces at constant mass, bobs and rigid liquid exert this force and torque on the craft, so that the
//! momentum of craft, liquid and outflow together is conserved exactly:
//!
//! ```text
//! force  = -2 w x K - K' - sum of m_n' rho_n'
//! torque = -I_0' w - sum of m_n' (rho x (w x rho) + rho x rho') - f r_out x (w x r_out) - w x L - L'
//! ```
//!
//! The flow reduces the total energy (outputs.rs), in addition to dissipation, by
//!
//! ```text
//! drained' = -(force.V + torque.w + m_0' |V|^2/2 + V.(w x S_0') + w.I_0' w/2)
//!     - sum of (m' |V + w x rho + rho'|^2/2 - T (h' e.p + l') - phi.(h' e + l' p) + k l l' |p_perp|^2)
//! ```
//!
//! drained' contains the power of force and torque, the energy of the mass that leaves bobs and rigid liquid, and the work
//! of rods whose ends move. S_0 and I_0 are the rigid liquid's first and second moments about O, and V is the velocity of O.
//!
//! Source: momentum and moment of momentum of a volume fixed in the craft, with d(m s)/dt = K - f r_out. The power drained'
//! is the derivative by time of the energy in `outputs.rs`.

use alloc::format;
use alloc::string::String;
use taylor::error::StepError;
use taylor::number::Number;
use taylor::runge_kutta::{self, Pace, System};
use taylor::vector::{
    Mat3, Vec3, add, constant, cross, dot, on_sphere, rotation, scale, sub, times,
    transposed_times, unit_quaternion,
};

use crate::bob::{Bob, BobNow};
use crate::damping::Law;
use crate::parameters::{Limits, Tank};
use crate::rigid::{Mat6, Rigid, add_lower_rank_one, along_rod};
use crate::sizes::MODES;
use crate::spin::{Spin, SpinNow};
use crate::state::Line;
use crate::surface::{LEAST_INERTIA, Lift, Meridian, Rotary, Surface};
use crate::table::{FillCurves, Filling, Jet};

/// A tank in its mounting position, with the quantities that do not change during a run.
#[derive(Clone, Debug)]
pub struct MountedTank {
    pub tank: Tank,
    curves: FillCurves,
    axes: Mat3,
    e: Vec3,
    d: Vec3,
    planar: bool,
    across: [Option<Vec3>; MODES],
    curved: bool,
    surfaces: [Option<Surface>; MODES], // at the start of the run
    laws: [Law; MODES],
    spin: Option<Spin>,
    still: Option<[Rigid; 2]>, // rigid liquid, and all liquid at rest; `None` if the tank drains
}

/// Returns the constant `x` as a [`Jet`], whose derivatives are 0.
fn jet<T: Number>(x: f64) -> Jet<T> {
    [x, 0.0, 0.0].map(T::constant)
}

/// A bob with the terms of its equation of motion that do not contain the accelerations [a; w']
/// (symbols of the module's head).
pub struct Swing<T> {
    m: T,
    l: T,
    p: Vec3<T>,
    p_d: Vec3<T>,
    rho: Vec3<T>,
    rho_d: Vec3<T>,
    u: [T; 6], // [p; P x p]
    t_0: T,
    phi: Vec3<T>,
    known: Vec3<T>,    // G without a + w' x rho
    centring: T,       // energy of the centring stiffness
    m_d: T,            // m'
    end_rate: Vec3<T>, // h' e + l' p, the velocity of the bob for a constant p
    centring_d: T,     // k l l' |p_perp|^2
    surface: Option<OnSurface<T>>,
}

struct OnSurface<T> {
    meridian: Meridian<T>,
    z: T,
    inner: Vec3<T>,
    e: Vec3<T>,
    rotary: Option<Rotary<T>>,
}

/// Contents of a tank at an instant, and their loads on the craft.
pub struct Contents<'a, T> {
    mounted: &'a MountedTank,
    pub rigid: Rigid<T>,
    // Force and torque about O by the flow within the tank and by the spin
    flow_wrench: [Vec3<T>; 2],
    pub flow_momentum: [Vec3<T>; 2], // K and L of the flow within the tank and of the spin
    bobs: [Option<Swing<T>>; MODES],
    pub dissipation: T,           // W
    shrinking: (T, [Vec3<T>; 2]), // m_0', S_0' and I_0' w of the rigid liquid
    spin: Option<SpinNow<T>>,
}

pub fn vector_from<T: Number>(x: &[T], at: usize) -> Vec3<T> {
    [x[at], x[at + 1], x[at + 2]]
}

impl MountedTank {
    pub fn new(tank: &Tank) -> MountedTank {
        let axes = rotation(&unit_quaternion(tank.q));
        let curves = tank.fill.curves(tank.modes);
        let (e, d) = (axes.map(|row| row[2]), tank.position);
        let across = core::array::from_fn(|n| {
            (n < tank.modes).then(|| tank.hinge_and_across(n).1).flatten()
        });
        let surfaces = core::array::from_fn(|n| tank.surface(n));
        let (planar, curved, still) = (tank.is_planar(), tank.has_surface(), None);
        let mounted = MountedTank {
            tank: *tank,
            curves,
            axes,
            e,
            d,
            planar,
            across,
            curved,
            surfaces,
            laws: core::array::from_fn(|n| Law::new(tank, n)),
            spin: Spin::new(tank),
            still,
        };
        let still = if !tank.is_axial() {
            let point = |bob: Bob| Rigid::new(bob.m, bob.at_rest(), &[[0.0; 3]; 3]);
            let bobs = (0..tank.modes).map(|n| point(Bob::new(tank, 0, n)));
            Some([tank.rigid(), bobs.fold(tank.rigid(), |sum, bob| sum.combined_with(&bob))])
        } else {
            let (m, h) = (tank.m_0, tank.h_0);
            let rigid = Rigid::on_axis([d, e], [m, m * h, m * h * h], [tank.i_0, tank.i_z]);
            (!mounted.drains()).then(|| [rigid, mounted.at_rest(0.0, None)])
        };
        MountedTank { still, ..mounted }
    }

    /// Returns the liquid at rest as a rigid body; `None` if the tank drains.
    pub fn rigid_at_rest(&self) -> Option<&Rigid> {
        self.still.as_ref().map(|[_, whole]| whole)
    }

    pub fn modes(&self) -> usize {
        self.tank.modes
    }

    pub fn follows(&self) -> bool {
        (0..self.tank.modes).any(|n| self.tank.follows(n))
    }

    /// Returns slosh modes and rigid liquid for `liquid` kg of liquid in the tank; `None` if the tank has no fill table.
    pub fn filling<T: Number>(&self, liquid: T) -> Option<Filling<T>> {
        self.drains().then(|| self.curves.filling(self.tank.modes, liquid))
    }

    /// Returns the liquid at rest as a rigid body. In a tank with a fill table, `liquid` is the
    /// mass of the liquid, kg, and `filling` is the result of [`MountedTank::filling`] for this
    /// mass. In other tanks neither argument has an effect.
    pub fn at_rest<T: Number>(&self, liquid: T, filling: Option<&Filling<T>>) -> Rigid<T> {
        let tank = &self.tank;
        if let Some(whole) = self.rigid_at_rest() {
            return whole.lift();
        }
        let c = T::constant;
        let [h_0, i_0, i_z] = match filling {
            Some(filling) => filling.rigid.map(|jet| jet[0]),
            None => [tank.h_0, tank.i_0, tank.i_z].map(c),
        };
        let mut m_0 = if filling.is_some() { liquid } else { c(tank.m_0) };
        let mut moments = [c(0.0); 3];
        let mut put = |m: T, z: T| {
            let first = m * z;
            moments = [moments[0] + m, moments[1] + first, moments[2] + first * z];
        };
        for n in 0..tank.modes {
            let [m, l, h] = match filling {
                Some(filling) => filling.modes[n].map(|jet| jet[0]),
                None => [tank.mass[n], tank.length[n], tank.hinge[n]].map(c),
            };
            if filling.is_some() {
                m_0 = m_0 - m;
            }
            put(m, h - l);
        }
        put(m_0, h_0);
        Rigid::on_axis([self.d, self.e], moments, [i_0, i_z])
    }

    /// Returns hinge, direction p and rate p' of mode `n`, which counts from 0. If the mode is planar, they are
    /// projected into its plane.
    // This is a separate function because craft without planar modes then take fewer instructions.
    #[inline(never)]
    fn guided<T: Number>(&self, n: usize, [hinge, p, p_d]: [Vec3<T>; 3]) -> [Vec3<T>; 3] {
        let Some(b) = self.across[n].map(constant) else { return [hinge, p, p_d] };
        let [p, p_d] = [p, p_d].map(|x| sub(x, scale(dot(b, x), b)));
        [sub(hinge, b.map(|b| b * self.tank.arm[n])), p, p_d]
    }

    /// Returns the height of the bob of mode `n` and the surface on which it moves. `n` counts from
    /// 0. `l` is the pendulum length with its derivatives, and `turning` is the liquid's rate of
    /// spin with its derivative. `changing` are the coefficients s and kappa with their
    /// derivatives, if the fill table contains them.
    #[inline(never)]
    fn on_surface<T: Number>(
        &self,
        n: usize,
        l: Jet<T>,
        [p, p_d, w]: [Vec3<T>; 3],
        turning: [T; 2],
        changing: Option<[Jet<T>; 2]>,
    ) -> Option<(Meridian<T>, Lift<T>)> {
        let across = self.across[n].map(constant);
        let surface = match changing {
            Some([[s, ..], [kappa, ..]]) => Surface::from_coefficients([s, kappa]),
            None => self.surfaces[n]?.lift_to(),
        };
        let meridian = Meridian::new(surface, constant(self.e), p, across);
        let lift = meridian.lift(l, p_d, (w, turning), changing);
        Some((meridian, lift))
    }

    /// Returns the contents of the tank. `x` has direction p and rate p' of each mode, and `spin` is the angular momentum of
    /// the liquid's spin, both in tank axes. `motion` is [a, w, w']; a and w' determine the acceleration along the tank on
    /// which the drag depends. `flow` is the mass of liquid, its outflow and the slope of the outflow, which have an effect
    /// only in tanks with a fill table.
    pub fn contents<T: Number>(
        &self,
        x: &[T],
        spin: Vec3<T>,
        motion: [Vec3<T>; 3],
        flow: (T, T, f64),
    ) -> Contents<'_, T> {
        let mut contents = Contents::new(self);
        let filling = self.filling(flow.0);
        contents.evaluate(x, self.spin_now(x, spin, motion[1]), motion, flow, filling.as_ref());
        contents
    }

    /// Returns the motion of the tank's spinning liquid; `None` if the liquid has no spin. `l` is
    /// the angular momentum of the spin, and `x` has direction p and rate p' of each mode, both in
    /// tank axes. `w` is the angular velocity of the craft, body axes.
    pub fn spin_now<T: Number>(&self, x: &[T], l: Vec3<T>, w: Vec3<T>) -> Option<SpinNow<T>> {
        let spin = self.spin.as_ref()?;
        let mut reaction = T::constant(0.0);
        for n in 0..self.tank.modes {
            let Some(higher) = self.tank.gyroscopic(n) else { continue };
            let [p, p_d] = on_sphere(vector_from(x, 6 * n), vector_from(x, 6 * n + 3));
            let u = p[0] * p[0] + p[1] * p[1];
            let tau = p[0] * p_d[1] - p[1] * p_d[0] + dot(constant(self.e), w) * u;
            let inertia = self.tank.mass[n] * self.tank.length[n] * self.tank.length[n];
            reaction = reaction + higher.reaction(tau, spin.turning(l) * u) * inertia;
        }
        Some(spin.now(l, w, reaction))
    }

    /// Writes the derivatives p' and p'' of the bobs' states, six numbers for each bob in tank axes, for
    /// the accelerations [a; w'].
    pub fn write_rates<T: Number>(
        &self,
        contents: &Contents<'_, T>,
        [a, w_d]: [Vec3<T>; 2],
        mut put: impl FnMut(usize, &[T]),
    ) {
        let axes: Mat3<T> = self.axes.map(constant);
        for (n, bob) in contents.bobs.iter().flatten().enumerate() {
            let g = bob.acceleration(a, w_d);
            let mut across = sub(g, scale(dot(bob.p, g), bob.p));
            if let Some(surface) = &bob.surface {
                across = surface.slide(g, w_d);
            } else if self.planar
                && let Some(b) = self.across[n].map(constant)
            {
                across = sub(across, scale(dot(b, g), b));
            }
            let p_dd = add(scale(bob.l.recip(), across), scale(dot(bob.p_d, bob.p_d), bob.p));
            put(6 * n, &transposed_times(&axes, bob.p_d));
            put(6 * n + 3, &transposed_times(&axes, p_dd).map(|x| -x));
        }
    }

    pub fn bobs_now<T: Number>(&self, contents: &Contents<'_, T>) -> [Option<BobNow<T>>; MODES] {
        let axes: Mat3<T> = self.axes.map(constant);
        let mut bobs = [(); MODES].map(|()| None);
        for (n, bob) in contents.bobs.iter().flatten().enumerate() {
            bobs[n] = Some(BobNow {
                m: bob.m,
                rho: bob.rho,
                rate: bob.rho_d,
                hinge: match &bob.surface {
                    Some(on) => sub(
                        sub(bob.rho, scale(bob.l, bob.p)),
                        constant(self.e).map(|x: T| x * on.z),
                    ),
                    None => sub(bob.rho, scale(bob.l, bob.p)),
                },
                e: self.e,
                in_tank: transposed_times(&axes, bob.p),
                wave: self.tank.wave[n],
                centring: bob.centring,
                spin: bob.surface.as_ref().and_then(|on| on.spin()).map(|spin| scale(bob.m, spin)),
            });
        }
        bobs
    }

    /// Projects the direction and the rate of each bob of a planar mode into the plane of this
    /// mode. `x` has six numbers for each bob, tank axes.
    pub fn flatten(&self, x: &mut [f64]) {
        for n in 0..self.tank.modes {
            let Some(b) = self.tank.plane_normal(n) else { continue };
            for at in [6 * n, 6 * n + 3] {
                let flat = sub(vector_from(x, at), scale(dot(b, vector_from(x, at)), b));
                x[at..at + 3].copy_from_slice(&flat);
            }
        }
    }

    /// Returns true if the slosh angle of a mode is so large that its bob has too little inertia
    /// for the model. `x` has direction and rate of each bob, tank axes, and `liquid` is the mass
    /// of liquid, kg.
    #[inline(never)]
    pub fn is_beyond(&self, x: &[f64], liquid: f64) -> bool {
        (0..MODES).any(|n| self.least_inertia(n, x, liquid) < LEAST_INERTIA)
    }

    /// Returns the inertia of the bob of mode `n` (which counts from 0) along the meridian or across it, whichever is
    /// smaller, divided by the inertia of a pendulum.
    fn least_inertia(&self, n: usize, x: &[f64], liquid: f64) -> f64 {
        let Some(mut surface) = self.surfaces[n] else { return 1.0 };
        if self.tank.fill.points > 0
            && let Some([[s, ..], [kappa, ..]]) = self.curves.surface(n, self.curves.place(liquid))
        {
            surface = Surface::from_coefficients([s, kappa]);
        }
        let [p, _] = on_sphere(vector_from(x, 6 * n), [0.0; 3]);
        surface.least_inertia(p[2], p[0] * p[0] + p[1] * p[1])
    }

    /// Returns an error if the slosh angle of a mode is so large that the bob has too little
    /// inertia along the meridian of its surface. `tank` is the tank's number in the message; it
    /// counts from 1, and is 0 if the system has only one tank. The check has a tolerance of 1e-6,
    /// because a step that would pass the limit is ended just before it.
    pub fn check_surfaces(&self, x: &[f64], liquid: f64, tank: usize) -> Result<(), StepError> {
        let is_near = |n: &usize| self.least_inertia(*n, x, liquid) < LEAST_INERTIA * (1.0 + 1e-6);
        let Some(n) = (0..MODES).find(is_near) else { return Ok(()) };
        let index = if tank > 0 { format!("[{tank}]") } else { String::new() };
        let now = Tank { liquid_0: liquid, ..self.tank }.resolve();
        Err(StepError::Model(now.bound_message(n, &format!("tank{index}"))))
    }

    pub fn is_curved(&self) -> bool {
        self.curved
    }

    pub fn drains(&self) -> bool {
        self.tank.fill.points > 0
    }
}

impl<T: Number> Swing<T> {
    fn tension(&self, a: Vec3<T>, w_d: Vec3<T>) -> T {
        let u = self.u;
        self.t_0 - self.m * (dot([u[0], u[1], u[2]], a) + dot([u[3], u[4], u[5]], w_d))
    }

    fn acceleration(&self, a: Vec3<T>, w_d: Vec3<T>) -> Vec3<T> {
        add(add(a, cross(w_d, self.rho)), self.known)
    }

    /// Returns the force of the bob on the craft and its torque about O for the accelerations [a; w'], without the force that
    /// guides a planar mode in its plane.
    fn wrench(&self, a: Vec3<T>, w_d: Vec3<T>) -> [Vec3<T>; 2] {
        match &self.surface {
            Some(surface) => {
                let slid = surface.slide(self.acceleration(a, w_d), w_d);
                let slowed = sub(self.acceleration(a, w_d), surface.meridian.apply_shear(slid));
                let force = sub(self.phi, scale(self.m, slowed));
                let mut torque = cross(self.rho, force);
                if let Some(couple) = surface.couple(slid, w_d) {
                    torque = add(torque, scale(self.m, couple));
                }
                [force, torque]
            }
            None => self.wrench_at(self.tension(a, w_d)),
        }
    }

    /// Returns the force of the bob on the craft for the accelerations [a; w'], without the force
    /// that guides a planar mode in its plane.
    fn pull(&self, a: Vec3<T>, w_d: Vec3<T>) -> Vec3<T> {
        if self.surface.is_some() {
            return self.wrench(a, w_d)[0];
        }
        add(scale(self.tension(a, w_d), self.p), self.phi)
    }

    fn load(&self) -> [Vec3<T>; 2] {
        if self.surface.is_some() {
            return self.wrench(constant([0.0; 3]), constant([0.0; 3]));
        }
        self.wrench_at(self.t_0)
    }

    fn wrench_at(&self, tension: T) -> [Vec3<T>; 2] {
        let force = add(scale(tension, self.p), self.phi);
        [force, cross(self.rho, force)]
    }
}

impl<T: Number> OnSurface<T> {
    fn slide(&self, g: Vec3<T>, w_d: Vec3<T>) -> Vec3<T> {
        let mut force = add(self.meridian.apply_shear_transposed(g), self.inner);
        if let (Some(rotary), Some(n)) = (&self.rotary, self.meridian.around()) {
            force = add(force, scale(rotary.pull(dot(self.e, w_d)), n));
        }
        self.meridian.free(force)
    }

    /// Returns the torque that the mode's rotary motion exerts on the craft about the tank's axis,
    /// divided by the bob's mass. `slid` is -l times the part of p'' that is perpendicular to the
    /// bob's direction p, and `w_d` is the craft's angular acceleration.
    fn couple(&self, slid: Vec3<T>, w_d: Vec3<T>) -> Option<Vec3<T>> {
        let (rotary, n) = (self.rotary.as_ref()?, self.meridian.around()?);
        Some(rotary.couple(dot(n, slid), dot(self.e, w_d), self.e))
    }

    /// Returns, divided by m, the angular momentum about the tank's axis that the bob has in addition to a point mass.
    fn spin(&self) -> Option<Vec3<T>> {
        Some(scale(self.rotary.as_ref()?.spin(), self.e))
    }
}

impl<T: Number> Contents<'_, T> {
    pub fn new(mounted: &MountedTank) -> Contents<'_, T> {
        let zero = constant::<T>([0.0; 3]);
        let none = T::constant(0.0);
        Contents {
            mounted,
            rigid: Rigid { mass: none, moment: zero, inertia: [zero; 3] },
            flow_wrench: [zero; 2],
            flow_momentum: [zero; 2],
            bobs: core::array::from_fn(|_| None),
            dissipation: none,
            shrinking: (none, [zero; 2]),
            spin: None,
        }
    }

    /// Evaluates new contents in place, so that they are not copied. The arguments are explained at
    /// [`MountedTank::contents`] and [`MountedTank::filling`].
    pub fn evaluate(
        &mut self,
        x: &[T],
        spin: Option<SpinNow<T>>,
        [a, w, w_d]: [Vec3<T>; 3],
        (liquid, flow, slope): (T, T, f64),
        filling: Option<&Filling<T>>,
    ) {
        let mounted = self.mounted;
        let MountedTank { tank, curves, axes, .. } = mounted;
        let drains = filling.is_some();
        let c = T::constant;
        let flow = if drains { flow } else { c(0.0) };
        let slope = if drains { slope } else { 0.0 };
        // Converts derivatives by the mass of liquid to derivatives by time, with m' = -f and m'' = -f'.
        let follow = |[value, first, second]: Jet<T>| -> Jet<T> {
            [value, -(first * flow), second * flow * flow - first * slope]
        };
        let place = filling.map(|filling| filling.place);
        let (e, d) = (constant::<T>(mounted.e), constant::<T>(mounted.d));
        let outlet = add(d, e.map(|x| x * tank.outlet));
        let mut m_0 = if drains { [liquid, -flow, c(-slope)] } else { jet(tank.m_0) };
        let axes: Mat3<T> = axes.map(constant);
        let zero = constant::<T>([0.0; 3]);
        // The specific force along the tank's axis at a point r is e.a + axial.r.
        let w_e = dot(e, w);
        let axial = add(cross(e, w_d), sub(scale(w_e, w), scale(dot(w, w), e)));
        let at_origin = dot(e, a);
        // Sums over the modes: of m' l p_perp and of b m' l p_perp with their derivatives, and of m' b with its derivative.
        let (mut level, mut level_d) = ([zero; 2], [zero; 2]);
        let mut sinking = [c(0.0); 2];
        let mut turning = [c(0.0); 2];
        if let Some(now) = &spin {
            turning = now.turning;
            self.dissipation = now.dissipation;
            (self.flow_wrench[1], self.flow_momentum[1]) = (now.torque, now.momentum);
        }
        self.spin = spin;
        for n in 0..tank.modes {
            let [m, l, h] = match filling {
                Some(filling) => filling.modes[n].map(follow),
                None => [tank.mass[n], tank.length[n], tank.hinge[n]].map(jet),
            };
            let k = tank.k[n];
            if drains {
                m_0 = [m_0[0] - m[0], m_0[1] - m[1], m_0[2] - m[2]];
            }
            let mut p = times(&axes, vector_from(x, 6 * n));
            let mut p_d = times(&axes, vector_from(x, 6 * n + 3));
            let mut hinge = add(d, scale(h[0], e));
            if mounted.planar {
                [hinge, p, p_d] = mounted.guided(n, [hinge, p, p_d]);
            }
            let [p, p_d] = on_sphere(p, p_d);
            let mut rho = add(hinge, scale(l[0], p));
            let mut rho_d = add(add(scale(h[1], e), scale(l[1], p)), scale(l[0], p_d));
            let on_surface = if mounted.curved {
                let changing = place.and_then(|place| curves.surface(n, place));
                let changing = changing.map(|pair| pair.map(follow));
                mounted.on_surface(n, l, [p, p_d, w], turning, changing)
            } else {
                None
            };
            if let Some((_, lift)) = &on_surface {
                (rho, rho_d) = (add(rho, scale(lift.z, e)), add(rho_d, scale(lift.z_d, e)));
            }
            let height = dot(e, p);
            let p_perp = sub(p, scale(height, e));
            let chord = add(p, e);
            let motion = [dot(chord, chord), dot(p_d, p_d)];
            let zeta = place.and_then(|place| curves.zeta(n, place));
            let x = at_origin + dot(axial, hinge);
            let drag = mounted.laws[n].coefficient_at([m[0], l[0]], zeta, x, motion);
            let moved = match &on_surface {
                Some((meridian, _)) => meridian.apply_shear(p_d),
                None => p_d,
            };
            let phi = add(scale(drag * l[0], moved), scale(l[0] * k, p_perp));
            let turning = cross(w, rho);
            let speed = add(turning, rho_d);
            let settling = add(cross(w, add(speed, rho_d)), scale(h[2], e));
            let t_0 = m[0] * (l[0] * dot(p_d, p_d) - dot(p, settling) - l[2])
                - l[0] * dot(p_perp, p_perp) * k;
            let mut known = add(add(settling, scale(l[1] * 2.0, p_d)), scale(m[0].recip(), phi));
            let turned = cross(hinge, p);
            let mut centring = l[0] * l[0] * dot(p_perp, p_perp) * (0.5 * k);
            let (mut end_rate, mut centring_d) = (zero, c(0.0));
            // Terms of the mass flow out of the bob, for a tank that drains.
            if drains {
                let height_d = dot(e, p_d);
                let p_perp_d = sub(p_d, scale(height_d, e));
                let mut b = h[0] + l[0] * height;
                let mut b_d = h[1] + l[1] * height + l[0] * height_d;
                end_rate = add(scale(h[1], e), scale(l[1], p));
                centring_d = l[0] * l[1] * dot(p_perp, p_perp) * k;
                if let Some((_, lift)) = &on_surface {
                    (b, b_d) = (b + lift.z, b_d + lift.z_d);
                    end_rate = add(end_rate, scale(lift.z_at_rest, e));
                    centring_d = centring_d + m[0] * lift.energy_d + m[1] * lift.energy;
                }
                let lost = scale(m[1] * l[0], p_perp);
                let lost_d =
                    add(scale(m[2] * l[0] + m[1] * l[1], p_perp), scale(m[1] * l[0], p_perp_d));
                sinking = [sinking[0] + m[1] * b, sinking[1] + m[2] * b + m[1] * b_d];
                level = [add(level[0], lost), add(level[1], scale(b, lost))];
                let raised = add(scale(b, lost_d), scale(b_d, lost));
                level_d = [add(level_d[0], lost_d), add(level_d[1], raised)];
                self.flow_wrench = [
                    sub(self.flow_wrench[0], scale(m[1], rho_d)),
                    sub(self.flow_wrench[1], scale(m[1], cross(rho, speed))),
                ];
            }
            let mut squared = dot(moved, moved);
            let surface = on_surface.map(|(meridian, mut lift)| {
                if let Some((rate, more)) = meridian.inner_rate(p_d) {
                    squared = squared + more;
                    lift.inner = add(lift.inner, scale(drag * l[0] / m[0], rate));
                }
                centring = centring + m[0] * lift.energy;
                known = add(known, scale(l[2] - l[0] * dot(p_d, p_d), p));
                known = add(known, scale(lift.z_dd, e));
                OnSurface { meridian, z: lift.z, inner: lift.inner, e, rotary: lift.rotary }
            });
            self.dissipation = self.dissipation + drag * l[0] * l[0] * squared;
            self.bobs[n] = Some(Swing {
                m: m[0],
                l: l[0],
                p,
                p_d,
                rho,
                rho_d,
                u: [p[0], p[1], p[2], turned[0], turned[1], turned[2]],
                t_0,
                phi,
                known,
                centring,
                m_d: m[1],
                end_rate,
                centring_d,
                surface,
            });
        }
        if let Some([rigid, _]) = &mounted.still {
            self.rigid = rigid.lift();
        }
        let Some(filling) = filling else { return };
        let [h_0, i_0, i_z] = filling.rigid.map(follow);
        // The rigid liquid about O: m h, m h^2 and their derivatives.
        let first = m_0[0] * h_0[0];
        let moment = m_0[1] * h_0[0] + m_0[0] * h_0[1];
        if mounted.still.is_none() {
            let moments = [m_0[0], first, first * h_0[0]];
            self.rigid = Rigid::on_axis([mounted.d, mounted.e], moments, [i_0[0], i_z[0]]);
        }
        let moment_d = m_0[2] * h_0[0] + m_0[1] * h_0[1] * 2.0 + m_0[0] * h_0[2];
        let j = moment + sinking[0] + flow * tank.outlet;
        let j_d = moment_d + sinking[1] + c(slope * tank.outlet);
        let momenta = |axial: T, [sum, raised]: [Vec3<T>; 2]| {
            let k = add(scale(axial, e), sum);
            [k, add(cross(d, k), cross(e, raised))]
        };
        let [[k, l], [k_d, l_d]] = [momenta(j, level), momenta(j_d, level_d)];
        let force = add(cross(w, k).map(|x| x * 2.0), k_d);
        let moments = [m_0[1], moment, moment * h_0[0] + first * h_0[1]];
        let rate = Rigid::on_axis([mounted.d, mounted.e], moments, [i_0[1], i_z[1]]);
        let turning = times(&rate.inertia, w);
        self.shrinking = (m_0[1], [rate.moment, turning]);
        let leaving = scale(flow, cross(outlet, cross(w, outlet)));
        let torque = [turning, leaving, cross(w, l), l_d];
        self.flow_momentum = [k, l];
        self.flow_wrench = [
            sub(self.flow_wrench[0], force),
            torque.into_iter().fold(self.flow_wrench[1], |sum, part| sub(sum, part)),
        ];
    }

    /// Adds the inertia of the bobs to the lower triangle of the craft's mass matrix. A pendulum's
    /// bob has inertia only along its rod, and the bob of a planar mode also perpendicular to its
    /// plane.
    pub fn add_rods(&self, matrix: &mut Mat6<T>) {
        for bob in self.bobs.iter().flatten() {
            if let Some(surface) = &bob.surface {
                let mut held = surface.meridian.mass_matrix(bob.m, bob.rho);
                if surface.rotary.is_some() {
                    surface.meridian.add_rotary([bob.m, bob.l], bob.rho, &mut held);
                }
                for i in 0..6 {
                    for k in 0..=i {
                        matrix[i][k] = matrix[i][k] + held[i][k];
                    }
                }
                continue;
            }
            add_lower_rank_one(matrix, bob.m, &bob.u);
        }
        if self.mounted.planar {
            self.add_carried(matrix);
        }
    }

    #[inline(never)]
    fn add_carried(&self, matrix: &mut Mat6<T>) {
        for (bob, b) in self.planar() {
            add_lower_rank_one(matrix, bob.m, &along_rod(b, bob.rho));
        }
    }

    fn planar(&self) -> impl Iterator<Item = (&Swing<T>, Vec3<T>)> {
        let across = self.bobs.iter().zip(&self.mounted.across);
        let pendulums = across.filter_map(|(bob, b)| Some((bob.as_ref()?, (*b)?)));
        let pendulums = pendulums.filter(|(bob, _)| bob.surface.is_none());
        pendulums.map(|(bob, b)| (bob, constant(b)))
    }

    /// Adds the forces that guide planar modes, and their torques about O, for the accelerations [a; w'] to `sum`.
    #[inline(never)]
    fn add_guides(&self, sum: [Vec3<T>; 2], [a, w_d]: [Vec3<T>; 2]) -> [Vec3<T>; 2] {
        let guides = self.planar().map(|(bob, b)| {
            let n = -(bob.m * dot(b, bob.acceleration(a, w_d)));
            let force = scale(n, b);
            [force, cross(bob.rho, force)]
        });
        guides.fold(sum, |sum, guide| [add(sum[0], guide[0]), add(sum[1], guide[1])])
    }

    /// Returns the derivative of the angular momentum of the liquid's spin (tank axes), and the energy (J) and the rate
    /// (rad/s) of the spin. `None` if the spin is not modelled.
    pub fn spin(&self) -> Option<(Vec3<T>, [T; 2])> {
        self.spin.as_ref().map(|now| (now.rate, [now.energy, now.turning[0]]))
    }

    /// Returns the force of the liquid on the craft and its torque about O for the accelerations a
    /// = 0 and w' = 0. The inertial forces of the rigid liquid are left out.
    pub fn loads(&self) -> [Vec3<T>; 2] {
        let bobs = self.bobs.iter().flatten().map(Swing::load);
        let sum =
            bobs.fold(self.flow_wrench, |sum, bob| [add(sum[0], bob[0]), add(sum[1], bob[1])]);
        match self.mounted.planar {
            true => self.add_guides(sum, [constant([0.0; 3]); 2]),
            false => sum,
        }
    }

    pub fn wrench(&self, a: Vec3<T>, w: Vec3<T>, w_d: Vec3<T>) -> [Vec3<T>; 2] {
        let rigid = self.rigid.inertial_wrench(a, w, w_d);
        let bobs = self.bobs.iter().flatten().map(|bob| bob.wrench(a, w_d));
        let mut sum =
            bobs.fold(self.flow_wrench, |sum, bob| [add(sum[0], bob[0]), add(sum[1], bob[1])]);
        if self.mounted.planar {
            sum = self.add_guides(sum, [a, w_d]);
        }
        [sub(sum[0], rigid[0]), sub(sum[1], rigid[1])]
    }

    /// Returns the power drained', W, that the outflow takes from the energy of the system if O has the velocity `v`. For a craft
    /// on a pivot `v` is 0, and the energy includes the potential energy a.S of gravity.
    pub fn drained(&self, v: Vec3<T>, w: Vec3<T>, [a, w_d]: [Vec3<T>; 2], on_pivot: bool) -> T {
        let half = 0.5;
        let (m_0_d, [s_d, turning]) = self.shrinking;
        let [force, torque] = self.flow_wrench;
        let mut power = dot(force, v)
            + dot(torque, w)
            + dot(v, v) * m_0_d * half
            + dot(v, cross(w, s_d))
            + dot(w, turning) * half;
        let mut moment_d = s_d;
        for bob in self.bobs.iter().flatten() {
            let speed = add(v, add(cross(w, bob.rho), bob.rho_d));
            let pull = bob.pull(a, w_d);
            power = power + dot(speed, speed) * bob.m_d * half - dot(pull, bob.end_rate)
                + bob.centring_d;
            moment_d = add(moment_d, scale(bob.m_d, bob.rho));
        }
        if on_pivot {
            power = power + dot(a, moment_d);
        }
        -power
    }
}

/// The outflow of a tank over one step. `at` is the index of the mass of liquid in the state vector; `tank` is the tank's
/// number, which counts from 1, or 0 if the system has only one tank.
#[derive(Clone, Copy)]
pub struct Outflow<'a> {
    pub mounted: &'a MountedTank,
    pub flow: Line,
    pub at: usize,
    pub tank: usize,
}

impl Outflow<'_> {
    fn left(&self, liquid: f64, t: f64) -> f64 {
        liquid - self.flow.integral(t)
    }

    /// Returns an error if the flow over the next `h` seconds would empty or overfill the tank.
    pub fn check(&self, liquid: f64, h: f64) -> Result<(), StepError> {
        let Outflow { mounted, flow, tank, .. } = *self;
        let [Some(low), Some(high)] =
            [mounted.tank.fill.masses().first(), mounted.tank.fill.masses().last()]
        else {
            return Ok(());
        };
        // Checks the mass where the flow reverses, and at the end of the step.
        let turns = flow.value * flow.slope < 0.0 && flow.value.abs() < flow.slope.abs() * h;
        let turn = if turns { -flow.value / flow.slope } else { h };
        for t in [turn, h] {
            let liquid = self.left(liquid, t);
            let slack = 1e-12 * high;
            // NaN is outside the range, too, so that it is refused.
            if !(low - slack..=high + slack).contains(&liquid) {
                let index = if tank > 0 { format!("[{tank}]") } else { String::new() };
                return Err(StepError::Model(format!(
                    "mass_flow{index} would change the liquid in tank{index} to {liquid} kg (allowed: {low} to {high} kg, \
                     the ends of tank{index}.fill.liquid)"
                )));
            }
        }
        Ok(())
    }

    /// Returns the first time after `t`, but at most `h`, at which the mass of liquid passes a point of the fill table.
    fn next_point(&self, liquid: f64, t: f64, h: f64) -> f64 {
        let (flow, mut next) = (self.flow, h);
        for point in self.mounted.tank.fill.masses() {
            // f t + f' t^2/2 = gone
            let gone = liquid - point;
            let square = flow.value * flow.value + 2.0 * flow.slope * gone;
            if square < 0.0 {
                continue; // the flow reverses before the mass reaches the point
            }
            let root = libm::sqrt(square);
            let sum = flow.value + if flow.value < 0.0 { -root } else { root };
            for (over, under) in [(2.0 * gone, sum), (-sum, flow.slope)] {
                // Skips a point that is not reached before `h`, without a division that could overflow.
                if over.abs() >= under.abs() * h {
                    continue;
                }
                let at = over / under;
                if at > t + 1e-9 * h && at < next {
                    next = at;
                }
            }
        }
        next
    }
}

pub trait Drains<const D: usize>: System<D> + Sized {
    fn normalise(&self, x: &mut [f64; D], t: f64);

    fn outflows(&self) -> impl Iterator<Item = Outflow<'_>>;

    /// Returns an error if a slosh angle is too large for the model of its mode.
    fn check_surfaces(&self, x: &[f64; D]) -> Result<(), StepError>;

    /// Advances the states `x` by `h`, s. `begin` is the simulation time at the start, s, for
    /// messages. An internal step of the solver ends where the mass of liquid passes a point of a
    /// fill table, because the derivatives jump there.
    fn advance(
        &self,
        x: &mut [f64; D],
        begin: f64,
        h: f64,
        limits: Limits,
    ) -> Result<(), StepError> {
        for flow in self.outflows() {
            flow.check(x[flow.at], h)?;
        }
        let start = *x;
        let (mut t, mut pace) = (0.0, Pace::new(h, limits.steps()));
        while t < h {
            let end = self.outflows().fold(h, |end, flow| flow.next_point(start[flow.at], t, end));
            let done = runge_kutta::advance(self, x, (t, end), limits.tolerance, &mut pace);
            // A step that would pass the largest angle of a surface is ended just before this angle.
            self.check_surfaces(x)?;
            done.map_err(|why| why.delayed(begin))?;
            self.normalise(x, end);
            for flow in self.outflows() {
                x[flow.at] = flow.left(start[flow.at], end);
            }
            t = end;
        }
        Ok(())
    }
}

/// Normalises the directions of bobs and makes their rates perpendicular to the directions; `x` has six states for each bob.
pub fn normalise_bobs(x: &mut [f64]) {
    for bob in x.chunks_exact_mut(6) {
        let [p, p_d] = on_sphere(vector_from(bob, 0), vector_from(bob, 3));
        bob[..3].copy_from_slice(&p);
        bob[3..].copy_from_slice(&p_d);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flow of 2 - t kg/s reverses at 2 s. The mass of liquid passes a point of the table 1.5 kg below the start at 2 t -
    /// t^2/2 = 1.5, which is at 1 s and again at 3 s. With a flow of 1 + t kg/s the mass passes this point at 1 s only.
    #[test]
    fn a_tank_passes_a_point_of_its_table_again_after_the_flow_reverses() {
        let tank = Tank::default();
        let mut mounted = MountedTank::new(&tank);
        mounted.tank.fill.points = 2;
        mounted.tank.fill.liquid[..2].copy_from_slice(&[100.0, 1000.0]);
        let passes = |value: f64, slope: f64, after: f64, liquid: f64| {
            let flow = Line { value, slope };
            Outflow { mounted: &mounted, flow, at: 0, tank: 0 }.next_point(liquid, after, 10.0)
        };
        for sign in [1.0, -1.0] {
            let liquid = 100.0 + sign * 1.5;
            assert_eq!(passes(sign * 2.0, -sign, 0.0, liquid), 1.0);
            assert_eq!(passes(sign * 2.0, -sign, 1.0, liquid), 3.0);
            assert_eq!(passes(sign * 2.0, -sign, 3.0, liquid), 10.0);
            assert_eq!(passes(sign, sign, 0.0, liquid), 1.0);
            assert_eq!(passes(sign, sign, 1.0, liquid), 10.0);
        }
        // A constant flow of 2 kg/s drains 1.5 kg in 0.75 s; a closed outlet drains nothing.
        assert_eq!(passes(2.0, 0.0, 0.0, 101.5), 0.75);
        assert_eq!(passes(-2.0, 0.0, 0.0, 98.5), 0.75);
        assert_eq!(passes(0.0, 0.0, 0.0, 101.5), 10.0);
        // With this flow the time at which the mass passes the point follows from 4 t - t^2 = 3.
        assert_eq!(passes(4.0, -2.0, 0.0, 103.0), 1.0);
        assert_eq!(passes(4.0, -2.0, 1.0, 103.0), 3.0);
    }

    /// The mass of liquid may be at the ends of its table, to rounding, and the flow is accepted while the mass
    /// stays between them. A flow of 1 - t kg/s reverses after 1 s, when half a kilogram has drained, and has
    /// returned 4 kg after 4 s.
    #[test]
    fn a_tank_drains_as_long_as_the_liquid_is_within_its_fill_table() {
        let tank = Tank::default();
        let mut mounted = MountedTank::new(&tank);
        mounted.tank.fill.points = 2;
        mounted.tank.fill.liquid[..2].copy_from_slice(&[100.0, 1000.0]);
        let goes_on = |value: f64, slope: f64, liquid: f64, h: f64| {
            let flow = Line { value, slope };
            Outflow { mounted: &mounted, flow, at: 0, tank: 0 }.check(liquid, h).is_ok()
        };
        for (liquid, allowed) in [
            (100.0, true),
            (1000.0, true),
            (100.0 - 0.9e-9, true),
            (1000.0 + 0.9e-9, true),
            (100.0 - 1.2e-9, false),
            (1000.0 + 1.2e-9, false),
            (f64::NAN, false),
        ] {
            assert_eq!(goes_on(0.0, 0.0, liquid, 1.0), allowed, "{liquid}");
        }
        for h in [0.5, 4.0] {
            assert!(goes_on(1.0, -1.0, 100.6, h) && goes_on(-1.0, 1.0, 999.4, h));
            // 0.375 kg have drained after 0.5 s; the largest drained mass is reached after 1 s.
            assert_eq!(goes_on(1.0, -1.0, 100.4, h), h < 1.0);
            assert_eq!(goes_on(-1.0, 1.0, 999.6, h), h < 1.0);
        }
        assert!(!goes_on(1.0, -1.0, 998.0, 4.0) && goes_on(1.0, -1.0, 995.0, 4.0));
        assert!(goes_on(1.0, 0.0, 101.0, 1.0) && !goes_on(1.0, 0.0, 101.0, 1.1));
    }
}
