//! One tank on a spacecraft that another program simulates, for example the tool that imports the FMU. This spacecraft carries
//! the tank and is called the carrying craft here. In formulas and names of parameters it is called `host`.
//!
//! The inputs are the motion of the carrying craft: specific force a at O, angular velocity w and its derivative w'. The tank
//! returns the force and torque (wrench) of the liquid on the craft in two parts, because the part that depends on [a; w']
//! belongs on the left-hand side of the craft's equations:
//!
//! ```text
//! [F; torque] = bias - M_a [a; w']
//! M_a  = M_0 + sum of m u u^T,  u = [p; P x p]                 symmetric, a function of p only
//! bias = sum of (T_0 u + [phi; rho x phi]) - [m_0 w x (w x s); w x (I_s w)]
//! ```
//!
//! M_0 and I_s are the mass matrix and the inertia of the rigid liquid about O (`rigid.rs`), and T_0 is the tension at a = w' = 0
//! (`bob.rs`). A program that solves (M_host + M_a) [a; w'] = rest + bias, with all other forces and torques on the carrying
//! craft in `rest`, has no algebraic loop, at any mass ratio.
//!
//! [`Coupling::Lumped`] is for programs that can only solve with a constant matrix, which is called M_a^ here. In it each whole
//! bob counts as a point mass at its hinge:
//!
//! ```text
//! M_a^ = M_0 + sum of m [1; [P]x] [1; [P]x]^T = const,  bias^ = [F; torque] + M_a^ [a; w']
//! ```
//!
//! Here [a; w'] are the accelerations of the carrying craft that the tank has received. M_a^ - M_a is positive semidefinite for
//! every p. The remaining algebraic loop therefore converges at any mass ratio. A draining tank keeps the M_a^ of the start of
//! the run; the loop converges faster as the mass of liquid falls.
//!
//! The bob of a planar mode (`contents.rs`) moves with the tank perpendicular to its plane. It does so at the place of the
//! bob, not of the hinge. This adds m u u^T, u = [b; rho x b], to M_a. With the acceleration a_P of the hinge
//!
//! ```text
//! (u.[a; w'])^2 = (b.a_P + l w'.(p x b))^2 <= 2 (b.a_P)^2 + 2 l^2 |w' - b b.w'|^2
//! ```
//!
//! because p x b is a unit vector in the plane. The mode therefore counts with 2 m at its hinge and the inertia 2 m l^2
//! (1 - b b^T) about it.
//!
//! [`Coupling::RigidBody`] is for programs whose carrying craft is a plain rigid body with the mass matrix M_host + M_a^. The
//! equations of this body include the centrifugal and gyroscopic terms of M_a^ (mass m^, first moment S^, inertia I^), so that
//! `bias` contains these terms with the opposite sign:
//!
//! ```text
//! bias^ = [F; torque] + M_a^ [a; w'] + [w x (w x S^); w x (I^ w)]
//! ```
//!
//! Within step n a and w' are linear in time, and w = w_n + w'_n t + w''_n t^2/2 from the start of the step.
//!
//! A bob on another surface than a sphere (`surface.rs`) adds m J^T N J to M_a, where J [a; w'] = a + w' x rho and no
//! eigenvalue of N is above 1. In M_a^ the bob counts with 2 m at its hinge and the inertia 2 m r^2 about it, where r is the
//! bob's distance from the hinge within 45 degrees, because |a_P + w' x (rho - P)|^2 <= 2 |a_P|^2 + 2 r^2 |w'|^2.
//!
//! Outputs and derivatives of a tank that drains, has planar modes or has bobs on other surfaces than spheres are computed by
//! `contents.rs`. A tank that drains is integrated by Runge-Kutta methods instead of power series, as in a craft. A jump of its
//! mass flow would be an impulse on the carrying craft, which the output force cannot represent. The model therefore leaves this
//! impulse out, both for the craft and for the bobs.
//!
//! **Detached liquid** (`lump.rs`, `handover.rs`) acts on the carrying craft by impulses. M_a and bias depend on the state of the
//! liquid: in flight M_a is 0 except for the inertia that rotates with the tank; on the wall it also has m u u^T, u = [n; rho x
//! n]. M_h is the mass matrix of the carrying craft without the tank, from the parameters `host`. An impulse J along the normal n
//! changes the velocities of the craft by
//! ```text
//! [dV; dw] = (M_h + M_attached)^-1 [J n; rho x J n],   P = M_h [dV; dw]
//! ```
//!
//! M_attached is the mass matrix of the liquid that moves with the craft. P is the change of the craft's own momentum and angular
//! momentum about O, and -P is the change of the liquid's momentum. The program that simulates the craft adds M_h^-1 P to V and
//! w. The tank continues as if this had happened: within a step it uses w + dw. V is not in the equations of the tank.
//!
//! If the liquid changes its state within a step, for example hits the wall, the given a and w' belong to a craft that
//! responds to the previous state of the liquid. From the first change to the end of the step the tank therefore uses the
//! accelerations a^ and w'^ that the carrying craft would have. It assumes that the other forces on the craft (`rest`) stay as
//! they were at the change:
//!
//! ```text
//! rest = M_h [a; w'] + [w x (w x S_h); w x (I_h w)] - [F; torque]
//! (M_h + M_a) [a^; w'^] = rest - [w x (w x S_h); w x (I_h w)] + bias
//! ```
//!
//! The program that simulates the craft does not know a^ and w'^. Therefore M_h times the integral of [a^ - a; w'^ - w'] is added
//! to P, so that momentum is conserved between two communication points.

use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::ops::ControlFlow;
use taylor::at_each_order;
use taylor::error::StepError;
use taylor::integrator::{self, MAX_MAGNITUDE, Motion, RATE_FLOOR, Steps};
use taylor::number::{Dual, Number};
use taylor::runge_kutta::System;
use taylor::series::{self, ORDER, Series, ZERO};
use taylor::space::{self, Pair, Vector, ZERO_PAIR, ZERO_VECTOR, product_coefficients, products};
use taylor::vector::{Mat3, Vec3, add, constant, cross, dot, largest, part, scale, sub, times};

use crate::bob::{Bob, BobNow};
use crate::constrained::ConstrainedBob;
use crate::contents::{Drains, MountedTank, Outflow, normalise_bobs, vector_from};
use crate::handover::Carrier;
use crate::lump::{Directions, Due, Lump};
use crate::motion::{SCALE_TIME, twice_crossed};
use crate::outputs::{MassProperties, TankOutputs};
use crate::parameters::{
    Craft, Limits, MAX_STEPS, Tank, singular_where, steps_problem, tolerance_problem,
};
use crate::ranges;
use crate::rigid::{Factors, Mat6, Rigid, add_rank_one, along_rod, largest_eigenvalue};
use crate::sizes::MODES;
use crate::spin::SpinSeries;
use crate::state::{BallState, Line, Ramp, Ranges, has_direction};

/// Number of continuous states of a tank: direction p and rate p' of each mode, dissipated energy (J) and mass of liquid
/// (kg), then position from the tank's origin (m) and rate (m/s) of the detached liquid, and angular momentum of the
/// liquid's spin (kg m2/s). Vectors are in tank axes.
pub const TANK_STATES: usize = SPIN + 3;

/// Number of scalar inputs of a tank: a, omega, omega_dot, mass_flow.
pub const TANK_INPUTS: usize = 10;

/// Number of elements in the upper triangle of a symmetric 6 x 6 matrix, which is stored by rows.
pub const TRIANGLE: usize = 21;

const DISSIPATED: usize = 6 * MODES;
const LIQUID: usize = DISSIPATED + 1;
const BALL: usize = LIQUID + 1;
const SPIN: usize = BALL + 6;

/// Division of the liquid's load on the carrying craft between the outputs `bias` and `added_mass`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Coupling {
    /// `added_mass` is the current added mass M, and `bias` is force and torque at a = w' = 0. For simulators of the carrying
    /// craft that solve (M_host + M) [a; w'] = forces + bias.
    Split = 1,
    /// `added_mass` is a constant matrix M, in which each bob is a point mass at its hinge, and `bias` is the total force and
    /// torque plus M [a; w'] with the given a and w'. For simulators of the carrying craft that solve with a constant matrix.
    Lumped = 2,
    /// `added_mass` is the constant matrix M of `Lumped`, for a carrying craft that is simulated as a rigid body with M
    /// included in its mass, centre of mass and inertia. `bias` therefore also contains the centrifugal and gyroscopic terms
    /// of M, w x (w x S) and w x (I w).
    RigidBody = 3,
}

impl Coupling {
    /// All couplings in the order of their numbers.
    pub const ALL: [Coupling; 3] = [Coupling::Split, Coupling::Lumped, Coupling::RigidBody];
}

/// All parameters and initial conditions of a [`SloshTank`]. Position and attitude of `tank` are relative to O and the axes of
/// the craft that carries it. `host` are the mass properties of this craft without the tank, which the impulses of detached
/// liquid and [`SloshTank::coupling_ratio`] depend on; `None` if they are unknown. `max_steps` is the largest number of internal
/// steps in one step, at least 1.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct TankParameters {
    pub tank: Tank,
    pub coupling: Coupling,
    pub host: Option<Craft>,
    pub max_steps: usize,
}

impl Default for TankParameters {
    fn default() -> Self {
        TankParameters {
            tank: Tank::default(),
            coupling: Coupling::Split,
            host: None,
            max_steps: MAX_STEPS,
        }
    }
}

impl TankParameters {
    /// Returns a message for each invalid parameter or combination of parameters; empty if all are valid.
    pub fn problems(&self) -> Vec<String> {
        let mut problems = self.tank.problems("tank");
        if let Some(host) = &self.host {
            problems.extend(host.problems("host"));
        }
        problems.extend(steps_problem(self.max_steps));
        if problems.is_empty() && (!self.tank.is_axial() || self.tank.has_surface()) {
            problems.extend(self.uneven_problem());
        }
        if self.tank.ball.travel > 0.0 {
            problems.extend(self.ball_problems().into_iter().map(String::from));
        }
        problems
    }

    fn ball_problems(&self) -> Vec<&'static str> {
        let drains = self.tank.fill.points > 0;
        let all = [
            (
                self.host.is_none(),
                "tank.ball.travel cannot be combined with host.mass = 0, because impacts of detached liquid depend on the mass and \
                 inertia of the host: set host.mass to host.Jyz, or tank.ball.travel = 0",
            ),
            (
                self.coupling != Coupling::Split,
                "tank.ball.travel cannot be combined with coupling = lumped or rigid_body, because detached liquid adds no mass to the \
                 host: set coupling = split, or tank.ball.travel = 0",
            ),
            (
                drains,
                "tank.ball.travel cannot be combined with tank.fill.points, because a tank that drains has no model of detached \
                 liquid: set one of the two to 0",
            ),
        ];
        all.into_iter().filter(|(is_so, _)| *is_so).map(|(_, said)| said).collect()
    }

    /// Returns a message if the rigid liquid of a tank without axial symmetry makes the total mass of liquid negative, or if
    /// carrying craft and rigid liquid together do not have positive inertia.
    fn uneven_problem(&self) -> Option<String> {
        let tank = self.tank.resolve();
        let mass = tank.whole_mass();
        if mass <= 0.0 {
            return Some(format!(
                "tank.m_0 = {:?} kg and tank.mass of all modes add up to {mass:?} kg of liquid (allowed: more than 0)",
                tank.m_0
            ));
        }
        let host = self.host?;
        singular_where(host.rigid(), &[tank]).map(|place| {
            format!(
                "the mass matrix of host.mass, host.Jxx to host.Jyz and the tank's m_0, I_0, I_z, dI_y, I_xy, I_xz and I_yz is \
                 singular{place}. Mass of host and rigid liquid, and \
                 their inertia about every axis through their centre of mass, must be above 0: increase host.mass or \
                 host.Jxx to host.Jzz, or the tank's m_0, I_0 and I_z"
            )
        })
    }
}

/// Motion of the craft that carries the tank over one step, in the craft's axes: specific force `a` at O, m/s2, angular velocity
/// `omega` at the start of the step, rad/s, and angular acceleration `omega_dot`, rad/s2. `mass_flow` is the flow out of the
/// tank, kg/s; it is negative for inflow and has no effect in a tank without a fill table.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[allow(missing_docs)]
pub struct TankInputs {
    pub a: Ramp,
    pub omega: Vec3,
    pub omega_dot: Ramp,
    pub mass_flow: Line,
}

impl TankInputs {
    /// Returns the angular velocity of the carrying craft `t` seconds after the start of the step, rad/s: `omega` plus the
    /// integral of the ramp `omega_dot`.
    fn omega_at(&self, t: f64) -> Vec3 {
        let TankInputs { omega, omega_dot, .. } = self;
        [0, 1, 2].map(|i| omega[i] + (omega_dot.value[i] + omega_dot.slope[i] * t / 2.0) * t)
    }
}

/// Outputs of the tank at one instant. Force and torque on the carrying craft are about O. `bias` (N, N m) and the upper triangle
/// of `added_mass` by rows (kg, kg m, kg m2) are explained at [`Coupling`]. `impulse` is the sum of all impulses of detached
/// liquid on the craft since the start, N s, and of their moments about O, N m s, each in the axes that the craft had at that
/// time. If `impulse` changes by P, the simulator of the craft adds M_host^-1 P to the velocity and the angular velocity.
/// Derivatives of the outputs contain 0 for `impulse`. `liquid` is the mass of liquid, kg, which is a state if the tank drains.
/// Mass, centre of mass relative to O and inertia about the centre of mass include the whole liquid, with the bobs as point
/// masses at their current positions, in the craft's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct SloshTankOutputs {
    pub tank: TankOutputs,
    pub bias: [f64; 6],
    pub added_mass: [f64; TRIANGLE],
    pub impulse: [f64; 6],
    pub dissipated: f64,
    pub liquid: f64,
    pub mass: f64,
    pub center_of_mass: Vec3,
    pub inertia: Mat3,
}

/// Complete state of a tank: with its parameters and inputs, a tank continues from it bit-identically.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TankState {
    time: f64,
    x: [f64; TANK_STATES],
    ranges: Ranges,
    ball: BallState,
    impulse: [f64; 6],
}

impl TankState {
    /// Number of 64-bit words of a saved state.
    pub const WORDS: usize = Self::REALS + 2;

    const REALS: usize = 7 + TANK_STATES;

    /// Returns the state as 64-bit words, from which [`TankState::from_words`] restores it.
    pub fn to_words(&self) -> [u64; Self::WORDS] {
        let mut words = [self.time.to_bits(); Self::WORDS];
        for (word, number) in words[1..].iter_mut().zip(self.x.iter().chain(&self.impulse)) {
            *word = number.to_bits();
        }
        words[Self::REALS] = self.ranges.to_word();
        words[Self::REALS + 1] = self.ball as u64;
        words
    }

    /// Restores a state from the words of [`TankState::to_words`]; `None` if they are not a valid state.
    pub fn from_words(words: &[u64; Self::WORDS]) -> Option<TankState> {
        let numbers = words.map(f64::from_bits);
        let x: [f64; TANK_STATES] = core::array::from_fn(|i| numbers[1 + i]);
        let impulse = core::array::from_fn(|i| numbers[1 + TANK_STATES + i]);
        let bobs = (0..MODES).all(|n| has_direction(&part(&x, 6 * n)));
        let bounded = numbers[1..Self::REALS].iter().all(|x| x.abs() < MAX_MAGNITUDE);
        let ranges = Ranges::from_word(words[Self::REALS])?;
        let ball = BallState::ALL.into_iter().find(|it| *it as u64 == words[Self::REALS + 1])?;
        let is_state = numbers[0].is_finite() && bounded && bobs;
        is_state.then_some(TankState { time: numbers[0], x, ranges, ball, impulse })
    }
}

/// The state of the tank and the power series of its motion.
#[derive(Clone, Debug)]
struct TankMotion {
    state: TankState,
    inputs: TankInputs,
    rigid: Rigid,
    bobs: Vec<Bob>,
    constrained: Vec<ConstrainedBob>, // guided in a plane, or not pendulums
    // Constrained bob that reaches the limit of its mode at the end of the expansion
    beyond: Option<usize>,
    spin: Option<SpinSeries>,
    is_apart: bool,
    a: Vector,
    w: Vector,
    w_both: Pair, // (w, w)
    w_d: Vector,
    dissipation: Series,
    inv_allowed: f64,  // 1/allowed error of the bobs' v
    spin_allowed: f64, // 1/allowed error of the spin's I^-1 L
    ball: Option<Loose>,
}

/// Additional data of a tank that models detached liquid.
#[derive(Clone, Debug)]
struct Loose {
    lump: Lump,
    parked: Vec<Bob>, // bobs while the liquid is detached
    host: Rigid,      // carrying craft without the tank
    factors: Factors, // of the mass matrix of `host` with all liquid that moves with it
    turned: Vec3,     // change of w by impulses that the given w does not contain yet
    // Other loads on the craft, before the liquid's first change of state in a step
    rest: Option<[Vec3; 2]>,
    due: Option<Due>,
    inv_allowed: f64,
}

/// One tank on a spacecraft that another program simulates.
#[derive(Clone, Debug)]
pub struct SloshTank {
    motion: Box<TankMotion>,
    coupling: Coupling,
    host: Option<Craft>,
    lumped: Rigid,
    draining: Option<Box<MountedTank>>,
    limits: Limits,
    bounds: ranges::Bounds,
    first: Option<[Vec3; 2]>,
}

struct Run<'a> {
    mounted: &'a MountedTank,
    inputs: &'a TankInputs,
}

type Acting<T> = ([Vec3<T>; 3], T);

fn scales(swing: impl Fn(usize) -> f64) -> [f64; TANK_STATES] {
    // States whose scale is infinite have no allowed error, so that they do not limit the steps: dissipated energy and mass of
    // liquid follow from the other states, and a tank that drains has no detached liquid.
    let mut scale = [f64::INFINITY; TANK_STATES];
    for at in (0..DISSIPATED).step_by(6) {
        scale[at..at + 3].fill(1.0);
        scale[at + 3..at + 6].fill(swing(at + 3));
    }
    scale
}

impl System<TANK_STATES> for Run<'_> {
    fn write_rates(&self, t: f64, x: &[f64; TANK_STATES], rate: &mut [f64; TANK_STATES]) {
        *rate = [0.0; TANK_STATES];
        if self.mounted.is_curved() && self.mounted.is_beyond(x, x[LIQUID]) {
            return;
        }
        let TankInputs { a, omega_dot, mass_flow, .. } = self.inputs;
        let moved = [a.value_at(t), self.inputs.omega_at(t), omega_dot.value_at(t)];
        *rate = draining_rates(self.mounted, x, &(moved, mass_flow.value_at(t)), mass_flow.slope);
    }

    fn error_scale(
        &self,
        t: f64,
        x: &[f64; TANK_STATES],
        rate: &[f64; TANK_STATES],
        h: f64,
    ) -> [f64; TANK_STATES] {
        let turn = RATE_FLOOR + largest(self.inputs.omega_at(t));
        let time = h.min(SCALE_TIME);
        scales(|at| turn + largest(vector_from(x, at)) + largest(vector_from(rate, at)) * time)
    }
}

impl Drains<TANK_STATES> for Run<'_> {
    fn normalise(&self, x: &mut [f64; TANK_STATES], _: f64) {
        self.mounted.flatten(x);
        normalise_bobs(&mut x[..DISSIPATED]);
    }

    fn outflows(&self) -> impl Iterator<Item = Outflow<'_>> {
        let Run { mounted, inputs } = *self;
        let flow = Outflow { mounted, flow: inputs.mass_flow, at: LIQUID, tank: 0 };
        mounted.drains().then_some(flow).into_iter()
    }

    fn check_surfaces(&self, x: &[f64; TANK_STATES]) -> Result<(), StepError> {
        if self.mounted.is_curved() { self.mounted.check_surfaces(x, x[LIQUID], 0) } else { Ok(()) }
    }
}

fn draining_rates<T: Number>(
    mounted: &MountedTank,
    x: &[T; TANK_STATES],
    acting: &Acting<T>,
    slope: f64,
) -> [T; TANK_STATES] {
    let ([a, w, w_d], flow) = *acting;
    let spin = vector_from(x, SPIN);
    let contents = mounted.contents(x, spin, [a, w, w_d], (x[LIQUID], flow, slope));
    let mut rate = [T::constant(0.0); TANK_STATES];
    mounted.write_rates(&contents, [a, w_d], |at, numbers| {
        rate[at..at + numbers.len()].copy_from_slice(numbers);
    });
    rate[DISSIPATED] = contents.dissipation;
    if let Some((spin_d, _)) = contents.spin() {
        rate[SPIN..].copy_from_slice(&spin_d);
    }
    if mounted.drains() {
        rate[LIQUID] = -flow;
    }
    rate
}

fn dual_arguments(
    x: &[f64; TANK_STATES],
    inputs: &TankInputs,
    dx: &[f64; TANK_STATES],
    du: &[f64; TANK_INPUTS],
) -> ([Dual; TANK_STATES], Acting<Dual>) {
    let TankInputs { a, omega, omega_dot, mass_flow } = inputs;
    let with = |x: Vec3, at: usize| [0, 1, 2].map(|i| Dual::with_slope(x[i], du[at + i]));
    let motion = [with(a.value, 0), with(*omega, 3), with(omega_dot.value, 6)];
    let x = core::array::from_fn(|i| Dual::with_slope(x[i], dx[i]));
    (x, (motion, Dual::with_slope(mass_flow.value, du[9])))
}

impl Motion for TankMotion {
    #[inline(always)]
    fn start(&mut self, t: f64) {
        let by_impulses = if self.ball.is_some() { Some(self.start_ball()) } else { None };
        let TankInputs { a, omega_dot, .. } = &self.inputs;
        (self.a[0], self.a[1]) = (a.value_at(t), a.slope);
        (self.w_d[0], self.w_d[1]) = (omega_dot.value_at(t), omega_dot.slope);
        let mut turned = self.inputs.omega_at(t);
        if let Some(by_impulses) = by_impulses {
            turned = add(turned, by_impulses);
        }
        (self.w[0], self.w[1]) = (turned, self.w_d[0]);
        self.w[2] = scale(0.5, omega_dot.slope);
        for bob in &mut self.bobs {
            let at = 6 * bob.mode;
            bob.start(self.state.x[at..at + 6].try_into().unwrap(), turned);
        }
        if self.is_apart {
            self.start_apart();
        }
    }

    #[inline(always)]
    fn rates(&mut self, n: usize) {
        const RATES: [fn(&mut TankMotion); ORDER] = at_each_order!(TankMotion::expand_rates);
        RATES[n](self)
    }

    #[inline(always)]
    fn set_error_scale(&mut self, h: f64, allowed: f64) -> f64 {
        let swing =
            self.bobs.iter().map(Bob::rate_scale).fold(0.0, |a, b| if b > a { b } else { a });
        self.inv_allowed = 1.0 / (allowed * (RATE_FLOOR + largest(self.w[0]) + swing));
        if self.is_apart {
            self.set_error_scale_apart(h.min(SCALE_TIME), allowed);
        }
        let constrained = self.constrained.iter().map(ConstrainedBob::convergence_radius);
        self.bobs.iter().map(Bob::convergence_radius).chain(constrained).fold(h, f64::min)
    }

    #[inline(always)]
    fn coefficient_norm(&self, n: usize) -> f64 {
        let larger = |a: f64, b: f64| if b > a { b } else { a };
        let norm = self.bobs.iter().map(|bob| bob.coefficient_norm(n)).fold(0.0, larger)
            * self.inv_allowed;
        if self.is_apart { larger(norm, self.coefficient_norm_apart(n)) } else { norm }
    }

    #[inline(always)]
    fn defect(&self, n: usize, h: f64) -> f64 {
        let constrained = self.constrained.iter().map(|bob| bob.defect(n, h));
        let all = self.bobs.iter().map(|bob| bob.defect(n, h)).chain(constrained);
        all.fold(0.0, f64::max) * self.inv_allowed
    }

    #[inline(always)]
    fn event(&mut self, n: usize, h: f64) -> Option<f64> {
        if self.is_apart { self.next_event(n, h) } else { None }
    }

    #[inline(always)]
    fn take(
        &mut self,
        n: usize,
        h: f64,
        t: f64,
        _: &mut Steps,
    ) -> Result<ControlFlow<f64>, StepError> {
        let w = space::value(&self.w, 2, h);
        if self.ball.is_some() {
            self.lag(h, t);
        }
        let x = &mut self.state.x;
        x[DISSIPATED] += series::integrals([&self.dissipation], n - 1, h)[0];
        let mut finite = x[DISSIPATED].abs() < MAX_MAGNITUDE && largest(w) < MAX_MAGNITUDE;
        for bob in &self.bobs {
            let at = 6 * bob.mode;
            let moved = bob.state_at(x[at..at + 6].try_into().unwrap(), n, h, w);
            finite &= moved.iter().all(|x| x.abs() < MAX_MAGNITUDE);
            x[at..at + 6].copy_from_slice(&moved);
        }
        if self.is_apart {
            finite &= self.take_apart(n, h, w)?;
        }
        if !finite {
            return Err(StepError::NotFinite { time: self.state.time + t });
        }
        if let Some(due) = self.ball.as_mut().and_then(|ball| ball.due.take()) {
            self.perform_event(due, t);
        }
        Ok(ControlFlow::Continue(()))
    }
}

#[inline(always)]
fn loose(ball: &mut Option<Loose>) -> Option<&mut Lump> {
    ball.as_mut().map(|ball| &mut ball.lump).filter(|lump| lump.is_loose())
}

impl TankMotion {
    fn evaluate(&mut self, inputs: &TankInputs) {
        self.inputs = *inputs;
        self.start(0.0);
        self.expand_rates::<0>();
    }

    fn evaluate_direction(
        &mut self,
        inputs: &TankInputs,
        dx: &[f64; TANK_STATES],
        du: &[f64; TANK_INPUTS],
    ) {
        self.evaluate(inputs);
        let dw = part(du, 3);
        (self.a[1], self.w[1], self.w_d[1]) = (part(du, 0), dw, part(du, 6));
        for bob in &mut self.bobs {
            let at = 6 * bob.mode;
            let [x, dx] = [&self.state.x, dx].map(|x| x[at..at + 6].try_into().unwrap());
            bob.seed_direction(x, dx, self.w[0], dw);
        }
        if let Some(lump) = loose(&mut self.ball) {
            lump.seed_direction(dx[BALL..SPIN].try_into().unwrap(), self.w[0], dw);
            lump.seed_shape(&directions(&self.state.x), &directions(dx));
        }
        self.expand_rates::<1>();
    }

    // The preparation of a step is a function of its own, because both take more instructions if they are compiled together.
    #[inline(never)]
    fn advance(&mut self, h: f64, limits: Limits) -> Result<(), StepError> {
        let begin = self.state.time;
        integrator::advance(self, begin, h, limits.tolerance, &mut limits.steps()).map(|_| ())
    }

    #[inline(always)]
    fn expand_rates<const N: usize>(&mut self) {
        self.w_both.set(N, self.w[N], self.w[N]);
        let w2 = twice_crossed(products::<N>(&self.w));
        let mut dissipation = 0.0;
        for bob in &mut self.bobs {
            if bob.follows() {
                let [e, turned] = bob.along_axis();
                let turning = dot(e, times(&w2, bob.hinge));
                bob.set_axial::<N>(dot(e, self.a[N]) + dot(turned, self.w_d[N]) + turning);
            }
            bob.reaction::<N>(&self.w_both, &w2);
            bob.accelerate::<N>(self.a[N], self.w_d[N]);
            dissipation += bob.dissipation::<N>();
        }
        if self.is_apart {
            dissipation += self.rates_apart(N);
        }
        self.dissipation[N] = dissipation;
    }

    fn state_rates<const N: usize>(&self) -> [f64; TANK_STATES] {
        let mut rate = [0.0; TANK_STATES];
        for bob in &self.bobs {
            let at = 6 * bob.mode;
            rate[at..at + 6].copy_from_slice(&bob.rates::<N>(&self.w, &self.w_d));
        }
        if let Some(Loose { lump, .. }) = &self.ball
            && lump.is_loose()
        {
            rate[BALL..SPIN].copy_from_slice(&lump.rates(N, &self.w, &self.w_d));
        }
        rate[DISSIPATED] = self.dissipation[N];
        rate
    }

    fn parts<T: Number>(&self) -> Parts<T> {
        let number = |a: &[Vec3]| -> Vec3<T> { [0, 1, 2].map(|i| T::with_slope(a[0][i], a[1][i])) };
        let (a, w, w_d) = (number(&self.a), number(&self.w), number(&self.w_d));
        let zero = constant::<T>([0.0; 3]);
        let lump = self.ball.as_ref().map(|ball| &ball.lump).filter(|lump| lump.is_loose());
        let rigid = lump.map_or_else(
            || self.rigid.lift::<T>(),
            |lump| self.rigid.with_inertia_slope(&lump.shape_slope),
        );
        let mut parts = Parts {
            motion: [a, w, w_d],
            wrench: rigid.inertial_wrench(a, w, w_d).map(|half| half.map(|x| -x)),
            loads: [zero; 2],
            matrix: rigid.mass_matrix(),
            rigid,
            bobs: [(); MODES].map(|()| None),
            turning: None,
            lump: None,
            ball_state: self.state_of_ball(),
        };
        for bob in &self.bobs {
            parts.wrench = plus(parts.wrench, bob.wrench());
            parts.loads = plus(parts.loads, bob.bias(w));
            add_added_mass(&mut parts.matrix, bob);
            parts.bobs[bob.mode] = Some(bob.now::<T>());
        }
        if let Some(lump) = lump {
            parts.wrench = plus(parts.wrench, lump.wrench());
            parts.loads = plus(parts.loads, lump.bias(w));
            if let Some((m, u)) = lump.added_mass() {
                add_square(&mut parts.matrix, m, &u);
            }
            parts.lump = Some(lump.now::<T>());
        }
        parts
    }
}

// Functions for constrained bobs, spin and detached liquid (lump.rs, handover.rs), which a tank with plain
// pendulums does not need.
impl TankMotion {
    /// Sets up rigid liquid and bobs for the present state of the liquid, settled or detached,
    /// without allocating. Returns the change of the craft's angular velocity by impulses of the
    /// liquid that the angular velocity in the inputs does not contain yet.
    #[inline(never)]
    fn start_ball(&mut self) -> Vec3 {
        let Some(ball) = &mut self.ball else { return [0.0; 3] };
        let was_loose = ball.lump.is_loose();
        ball.lump.state = self.state.ball;
        if ball.lump.is_loose() {
            // The shape of the detached liquid depends on the directions that the bobs had when the liquid left the bottom.
            self.rigid = ball.lump.shape(&directions(&self.state.x));
            ball.parked.append(&mut self.bobs);
        } else if was_loose {
            self.rigid = ball.lump.rigid;
            self.bobs.append(&mut ball.parked);
        }
        ball.turned
    }

    /// Computes coefficient n of the forces of constrained bobs, spin and detached liquid, and coefficient n + 1 of their
    /// motion. Returns coefficient n of their dissipated power.
    #[inline(never)]
    fn rates_apart(&mut self, n: usize) -> f64 {
        let w2 = twice_crossed(product_coefficients(n, &self.w));
        let (a, w_d, mut dissipation) = (self.a[n], self.w_d[n], 0.0);
        if let Some(spin) = &mut self.spin {
            (_, dissipation) = spin.expand(n, self.w[n], &mut self.constrained);
        }
        for bob in &mut self.constrained {
            if bob.follows() {
                let [e, turned] = bob.along_axis();
                bob.set_axial(n, dot(e, add(a, times(&w2, bob.hinge))) + dot(turned, w_d));
            }
            bob.reaction(n, self.w[n], &w2);
            bob.accelerate(n, a, w_d);
            dissipation += bob.dissipation(n);
        }
        let Some(lump) = loose(&mut self.ball) else { return dissipation };
        lump.reaction(n, &self.w, &self.w_d);
        lump.accelerate(n, a, w_d);
        lump.dissipation(n)
    }

    #[inline(never)]
    fn set_error_scale_apart(&mut self, time: f64, allowed: f64) {
        let swing = self.constrained.iter().map(ConstrainedBob::rate_scale).fold(0.0, f64::max);
        let fastest = 1.0 / (allowed * (RATE_FLOOR + largest(self.w[0]) + swing));
        self.inv_allowed = self.inv_allowed.min(fastest);
        if let Some(spin) = &self.spin {
            let fastest = RATE_FLOOR + f64::max(largest(self.w[0]), spin.rate_scale());
            self.spin_allowed = 1.0 / (allowed * fastest);
        }
        if let Some(ball) = &mut self.ball {
            let speed = ball.lump.speed_scale(self.w[0], time);
            ball.inv_allowed = 1.0 / (allowed * RATE_FLOOR.max(speed));
        }
    }

    #[inline(never)]
    fn coefficient_norm_apart(&self, n: usize) -> f64 {
        let larger = |a: f64, b: f64| if b > a { b } else { a };
        let bobs = self.constrained.iter().map(|bob| bob.coefficient_norm(n));
        let mut norm = bobs.fold(0.0, larger) * self.inv_allowed;
        if let Some(spin) = &self.spin {
            norm = larger(norm, spin.coefficient_norm(n) * self.spin_allowed);
        }
        match &self.ball {
            Some(ball) if ball.lump.is_loose() => {
                larger(norm, ball.lump.coefficient_norm(n) * ball.inv_allowed)
            }
            _ => norm,
        }
    }

    /// Advances the states of constrained bobs, spin and detached liquid by `h` seconds, by their
    /// series up to order `n`. `w` is the angular velocity at the end. Returns true if the new
    /// states are finite and not too large.
    ///
    /// # Errors
    ///
    /// If a slosh angle has reached the limit for which its mode is valid.
    #[inline(never)]
    fn take_apart(&mut self, n: usize, h: f64, w: Vec3) -> Result<bool, StepError> {
        if let Some(bob) = self.beyond.take() {
            return Err(StepError::Model(self.constrained[bob].bound_message("tank")));
        }
        let (x, mut finite) = (&mut self.state.x, true);
        for bob in &self.constrained {
            let moved = bob.state_at(n, h, w);
            finite &= moved.iter().all(|x| x.abs() < MAX_MAGNITUDE);
            x[6 * bob.mode..][..6].copy_from_slice(&moved);
        }
        if let Some(spin) = &self.spin {
            let l = spin.state_at(n, h);
            finite &= largest(l) < MAX_MAGNITUDE;
            x[SPIN..].copy_from_slice(&l);
        }
        if let Some(lump) = loose(&mut self.ball) {
            let moved = lump.state_at(x[BALL..SPIN].try_into().unwrap(), n, h, w);
            finite &= moved.iter().all(|x| x.abs() < MAX_MAGNITUDE);
            x[BALL..SPIN].copy_from_slice(&moved);
        }
        Ok(finite)
    }

    /// Returns the time, within `h` seconds, of the first event: an event of detached liquid, or a
    /// slosh angle that reaches the limit for which its mode is valid. Returns `None` if there is
    /// no event.
    #[inline(never)]
    fn next_event(&mut self, n: usize, h: f64) -> Option<f64> {
        let mut first = self.next_of_ball(n, h);
        self.beyond = None;
        for (i, bob) in self.constrained.iter().enumerate() {
            if let Some(t) = bob.bound(n, first.unwrap_or(h)) {
                (first, self.beyond) = (Some(t), Some(i));
            }
        }
        first
    }

    #[inline(never)]
    fn next_of_ball(&mut self, n: usize, h: f64) -> Option<f64> {
        let ball = self.ball.as_mut()?;
        let next = ball.lump.next(n, h, [&self.a, &self.w, &self.w_d], self.bobs.iter());
        ball.due = next.map(|(_, due)| due);
        next.map(|(t, _)| t)
    }

    #[inline(never)]
    fn perform_event(&mut self, due: Due, t: f64) {
        if self.loose().rest.is_none() {
            self.evaluate_at(t);
            let [a, w, w_d] = self.motion().map(|series| series[0]);
            let taken = self.loose().host.inertial_wrench(a, w, w_d);
            let wrench = self.parts::<f64>().wrench;
            self.loose_mut().rest = Some([0, 1].map(|i| sub(taken[i], wrench[i])));
        }
        self.change(0, due, t);
    }

    /// Starts the expansions of constrained bobs, spin and detached liquid. If the liquid has
    /// changed its state within the step, the given a and w' are no longer valid. They are then
    /// replaced by the constant accelerations with which the carrying craft would respond.
    #[inline(never)]
    fn start_apart(&mut self) {
        let w = self.w[0];
        for bob in &mut self.constrained {
            let at = 6 * bob.mode;
            bob.start(self.state.x[at..at + 6].try_into().unwrap(), w);
        }
        if let Some(spin) = &mut self.spin {
            spin.start(part(&self.state.x, SPIN));
        }
        if let Some(lump) = loose(&mut self.ball) {
            lump.start(self.state.x[BALL..SPIN].try_into().unwrap(), w);
        }
        let Some(rest) = self.ball.as_ref().and_then(|ball| ball.rest) else { return };
        self.expand_rates::<0>();
        self.factorise();
        let turning = self.rigid().inertial_wrench([0.0; 3], w, [0.0; 3]);
        let loads = self.parts::<f64>().loads;
        let right = [0, 1].map(|i| add(sub(rest[i], turning[i]), loads[i]));
        [self.a[0], self.w_d[0]] = self.loose().factors.solve(right);
        (self.a[1], self.w_d[1]) = ([0.0; 3], [0.0; 3]);
        (self.w[1], self.w[2]) = (self.w_d[0], [0.0; 3]);
    }

    /// Adds an impulse on the carrying craft to the output `impulse`. In the `h` seconds before `t`
    /// the craft would have had the accelerations a^, w'^ (module's head), but its given a and w'
    /// do not contain them yet. The impulse is the difference of momentum.
    #[inline(never)]
    fn lag(&mut self, h: f64, t: f64) {
        if self.loose().rest.is_none() {
            return;
        }
        let middle = t - h / 2.0;
        let TankInputs { a, omega_dot, .. } = &self.inputs;
        let dv = scale(h, sub(self.a[0], a.value_at(middle)));
        let dw = scale(h, sub(self.w_d[0], omega_dot.value_at(middle)));
        self.give(dv, dw);
    }

    fn give(&mut self, dv: Vec3, dw: Vec3) {
        let ball = self.loose_mut();
        ball.turned = add(ball.turned, dw);
        let impulse = ball.host.inertial_wrench(dv, [0.0; 3], dw);
        for (sum, given) in self.state.impulse.iter_mut().zip(impulse.as_flattened()) {
            *sum += given;
        }
    }

    fn factorise(&mut self) {
        let mut matrix = self.rigid().mass_matrix();
        for bob in &self.bobs {
            add_rank_one(&mut matrix, bob.m, &along_rod(bob.p[0], bob.hinge));
        }
        let ball = self.loose_mut();
        if let Some(u) = ball.lump.along_normal() {
            add_rank_one(&mut matrix, ball.lump.m, &u);
        }
        ball.factors.set(&matrix);
    }

    /// Performs all events that are due now (Model Exchange). Returns true if there were events.
    /// Returns `None` if states are so large that the power series could overflow.
    fn take_due(&mut self, inputs: &TankInputs) -> Option<bool> {
        self.inputs = *inputs;
        self.forget();
        let mut any = false;
        // At most four events follow each other at one instant.
        for _ in 0..4 {
            if !self.is_bounded() {
                return None;
            }
            self.evaluate_at(0.0);
            for n in 1..4 {
                self.rates(n);
            }
            self.next_of_ball(4, 0.0);
            let Some(due) = self.loose_mut().due.take() else { break };
            self.perform_event(due, 0.0);
            any = true;
        }
        let is_bounded = self.is_bounded();
        self.forget();
        is_bounded.then_some(any)
    }

    /// Returns true if the states are so small that products of their power series cannot overflow.
    fn is_bounded(&self) -> bool {
        let TankState { x, impulse, .. } = &self.state;
        let turned = self.ball.as_ref().map_or([0.0; 3], |ball| ball.turned);
        x.iter().chain(impulse).chain(&turned).all(|x| x.abs() < MAX_MAGNITUDE)
    }

    fn forget(&mut self) {
        if let Some(ball) = &mut self.ball {
            (ball.turned, ball.rest, ball.due) = ([0.0; 3], None, None);
        }
    }

    fn state_of_ball(&self) -> BallState {
        if self.ball.is_some() { self.state.ball } else { BallState::Settled }
    }

    fn loose(&self) -> &Loose {
        self.ball.as_ref().expect("a tank with a ball regime")
    }

    fn loose_mut(&mut self) -> &mut Loose {
        self.ball.as_mut().expect("a tank with a ball regime")
    }
}

fn directions(x: &[f64; TANK_STATES]) -> Directions {
    core::array::from_fn(|n| part(x, 6 * n))
}

impl Carrier for TankMotion {
    type Memory = (TankState, Vec3);

    fn memory(&self) -> (TankState, Vec3) {
        (self.state, self.loose().turned)
    }

    fn restore(&mut self, (state, turned): &(TankState, Vec3)) {
        self.state = *state;
        self.loose_mut().turned = *turned;
    }

    #[inline(never)]
    fn evaluate_at(&mut self, t: f64) {
        self.start(t);
        self.expand_rates::<0>();
        self.factorise();
    }

    fn lump(&self, _: usize) -> &Lump {
        &self.loose().lump
    }

    fn ball_state(&mut self, _: usize) -> &mut BallState {
        &mut self.state.ball
    }

    fn ball(&mut self, _: usize) -> &mut [f64] {
        &mut self.state.x[BALL..SPIN]
    }

    fn bob(&mut self, _: usize, n: usize) -> &mut [f64] {
        &mut self.state.x[6 * n..][..6]
    }

    fn directions(&self, _: usize) -> Directions {
        directions(&self.state.x)
    }

    fn bobs_beside(&self, _: usize) -> impl Iterator<Item = BobNow<f64>> {
        self.bobs.iter().map(Bob::now::<f64>)
    }

    fn points(&self) -> impl Iterator<Item = BobNow<f64>> {
        let lump = Some(&self.loose().lump).filter(|lump| lump.is_loose()).map(Lump::now::<f64>);
        self.bobs.iter().map(Bob::now::<f64>).chain(lump)
    }

    fn rigid(&self) -> Rigid {
        self.loose().host.combined_with(&self.rigid)
    }

    fn motion(&self) -> [&Vector; 3] {
        [&self.a, &self.w, &self.w_d]
    }

    fn factors(&self) -> &Factors {
        &self.loose().factors
    }

    fn dissipated(&mut self) -> &mut f64 {
        &mut self.state.x[DISSIPATED]
    }

    fn apply_impulse(&mut self, impulse: [Vec3; 2], t: f64) -> [Vec3; 2] {
        self.evaluate_at(t);
        let [dv, dw] = self.loose().factors.solve(impulse);
        self.give(dv, dw);
        self.follow_impulse(dv, dw);
        [dv, dw]
    }

    fn shift(&mut self, _: Vec3) {}

    fn is_pressed(&mut self, _: usize, t: f64) -> bool {
        self.evaluate_at(t);
        self.loose().lump.is_pressed()
    }
}

impl TankMotion {
    /// Updates the rates of bobs and detached liquid after an impulse has changed the velocity of O by `dv` and the
    /// angular velocity of the carrying craft by `dw`; the liquid keeps a part of its own velocity. [`Motion::start`]
    /// must have been called.
    fn follow_impulse(&mut self, dv: Vec3, dw: Vec3) {
        for bob in &self.bobs {
            let at = 6 * bob.mode;
            bob.after_impulse((&mut self.state.x[at..at + 6]).try_into().unwrap(), dv, dw);
        }
        for bob in &self.constrained {
            let at = 6 * bob.mode;
            bob.after_impulse((&mut self.state.x[at..at + 6]).try_into().unwrap(), dv, dw);
        }
        if let Some(lump) = loose(&mut self.ball) {
            lump.after_impulse(&mut self.state.x[BALL..SPIN], dv, dw);
        }
    }
}

/// Quantities from which the outputs are computed.
struct Parts<T> {
    motion: [Vec3<T>; 3],
    rigid: Rigid<T>,
    wrench: [Vec3<T>; 2], // force and torque on the carrying craft about O
    loads: [Vec3<T>; 2],  // force and torque at a = w' = 0, without the rigid liquid
    matrix: Mat6<T>,      // added mass M_a
    bobs: [Option<BobNow<T>>; MODES],
    turning: Option<T>, // rate of the liquid's spin
    lump: Option<BobNow<T>>,
    ball_state: BallState,
}

fn plus<T: Number>(a: [Vec3<T>; 2], b: [Vec3<T>; 2]) -> [Vec3<T>; 2] {
    [add(a[0], b[0]), add(a[1], b[1])]
}

fn add_added_mass<T: Number>(matrix: &mut [[T; 6]; 6], bob: &Bob) {
    let p = [0, 1, 2].map(|i| T::with_slope(bob.p[0][i], bob.p[1][i]));
    let c = cross(constant(bob.hinge), p);
    add_square(matrix, T::constant(bob.m), &[p[0], p[1], p[2], c[0], c[1], c[2]]);
}

fn add_square<T: Number>(matrix: &mut [[T; 6]; 6], m: T, u: &[T; 6]) {
    for i in 0..6 {
        for j in 0..6 {
            matrix[i][j] = matrix[i][j] + u[i] * u[j] * m;
        }
    }
}

/// Returns the upper triangle, by rows, of a symmetric matrix, of which only the lower triangle is read.
fn triangle<T: Number>(matrix: &[[T; 6]; 6]) -> [f64; TRIANGLE] {
    let mut elements = [0.0; TRIANGLE];
    let places = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
    for (element, (i, j)) in elements.iter_mut().zip(places) {
        *element = matrix[j][i].result();
    }
    elements
}

impl SloshTank {
    /// Creates a tank at the start of its motion, at `start_time` (s). `tolerance` is the allowed relative error of
    /// directions and rates, 1e-14 to 0.1. If parameters are invalid, returns the messages of all problems.
    pub fn new(
        p: &TankParameters,
        inputs: &TankInputs,
        start_time: f64,
        tolerance: f64,
    ) -> Result<SloshTank, Vec<String>> {
        let mut problems = p.problems();
        problems.extend(tolerance_problem(tolerance));
        if !problems.is_empty() {
            return Err(problems);
        }
        let mut x = [0.0; TANK_STATES];
        for n in 0..MODES {
            let [direction, rate] =
                if n < p.tank.modes { p.tank.at_start(n) } else { [[0.0, 0.0, -1.0], [0.0; 3]] };
            x[6 * n..6 * n + 3].copy_from_slice(&direction);
            x[6 * n + 3..6 * n + 6].copy_from_slice(&rate);
        }
        let tank = p.tank.resolve();
        x[LIQUID] = tank.whole_mass();
        if let Some(surface) = tank.ball_surface() {
            x[BALL + 2] = surface.height - surface.half;
        }
        x[SPIN..].copy_from_slice(&tank.spin_at_start(inputs.omega));
        let (ranges, ball) = (Ranges::default(), BallState::Settled);
        let state = TankState { time: start_time, x, ranges, ball, impulse: [0.0; 6] };
        let mut tank = SloshTank::resume(p, &state, tolerance);
        tank.motion.state.ranges = tank.ranges(inputs);
        Ok(tank)
    }

    /// Creates a tank that continues from the saved state `state`. [`SloshTank::new`] must have accepted the parameters, and
    /// the state must belong to a tank with the same parameters.
    pub fn resume(p: &TankParameters, state: &TankState, tolerance: f64) -> SloshTank {
        let tank = p.tank.resolve();
        let rigid = tank.rigid();
        let free = (0..tank.modes).filter(|n| !tank.is_constrained(*n));
        let bobs: Vec<Bob> = free.map(|n| Bob::new(&tank, 0, n)).collect();
        let constrained = (0..tank.modes).filter_map(|n| ConstrainedBob::new(&tank, 0, n));
        let constrained: Vec<_> = constrained.collect();
        let lumped = (0..tank.modes).fold(rigid, |sum, n| sum.combined_with(&tank.lumped(n)));
        let ball = Lump::new(&tank, 0).map(|lump| {
            let host = p.host.unwrap_or_default().rigid();
            Loose {
                lump,
                parked: Vec::with_capacity(bobs.len()),
                host,
                factors: Factors::new(&host.mass_matrix()),
                turned: [0.0; 3],
                rest: None,
                due: None,
                inv_allowed: 0.0,
            }
        });
        let motion = TankMotion {
            state: *state,
            inputs: TankInputs::default(),
            rigid,
            bobs,
            is_apart: ball.is_some() || !constrained.is_empty() || tank.spin_inertia > 0.0,
            constrained,
            spin: SpinSeries::new(&tank, 0),
            beyond: None,
            a: ZERO_VECTOR,
            w: ZERO_VECTOR,
            w_both: ZERO_PAIR,
            w_d: ZERO_VECTOR,
            dissipation: ZERO,
            inv_allowed: 0.0,
            spin_allowed: 0.0,
            ball,
        };
        SloshTank {
            motion: Box::new(motion),
            coupling: p.coupling,
            host: p.host,
            lumped,
            draining: tank.has_contents().then(|| Box::new(MountedTank::new(&tank))),
            limits: Limits { tolerance, max_steps: p.max_steps },
            bounds: ranges::Bounds::new(&tank),
            first: (tank.modes > 0).then(|| tank.hinge_and_axis(0)),
        }
    }

    /// Returns the current time, s.
    pub fn time(&self) -> f64 {
        self.motion.state.time
    }

    /// Sets the simulation time, s (Model Exchange).
    pub fn set_time(&mut self, time: f64) {
        self.motion.state.time = time;
    }

    /// Returns the complete state, for saving.
    pub fn state(&self) -> &TankState {
        &self.motion.state
    }

    /// Restores a saved state of this tank or of a tank with the same parameters.
    pub fn set_state(&mut self, state: &TankState) {
        self.motion.state = *state;
    }

    /// Advances by exactly `h` > 0 seconds, during which the inputs follow their ramps. If an error is returned,
    /// the tank is unchanged.
    pub fn step(&mut self, inputs: &TankInputs, h: f64) -> Result<(), StepError> {
        if !(h > 0.0 && h.is_finite()) {
            return Err(StepError::Length { h });
        }
        let before = self.motion.state;
        self.motion.inputs = *inputs;
        self.motion.forget();
        let given = inputs.a.value.iter().chain(&inputs.a.slope).chain(&inputs.omega);
        let mut given = given.chain(&inputs.omega_dot.value).chain(&inputs.omega_dot.slope);
        let done = if !given.all(|x| x.is_finite()) {
            Err(StepError::NotFinite { time: before.time })
        } else if let Some(mounted) = self.draining.as_ref().filter(|tank| tank.drains()) {
            let x = &mut self.motion.state.x;
            Run { mounted, inputs }.advance(x, before.time, h, self.limits)
        } else {
            self.motion.advance(h, self.limits)
        };
        self.motion.forget();
        match done {
            Ok(()) => self.motion.state.time = before.time + h,
            Err(_) => self.motion.state = before,
        }
        done
    }

    /// Returns the validity of the model for the present motion: the regime of the wave, the reason
    /// if the tank is out of its range, and whether pendulums can represent the liquid.
    pub fn ranges(&mut self, inputs: &TankInputs) -> Ranges {
        let outputs = self.outputs_held(inputs);
        self.bounds.classify(&outputs.tank, self.motion.state.x[LIQUID])
    }

    /// Returns the ranges of validity as they were determined at the last event.
    pub fn ranges_held(&self) -> Ranges {
        self.motion.state.ranges
    }

    /// Returns true if the tank models detached liquid.
    pub fn has_ball(&self) -> bool {
        self.motion.ball.is_some()
    }

    /// Returns true if the liquid is detached at present.
    pub fn has_lump(&self) -> bool {
        self.motion.state_of_ball() != BallState::Settled
    }

    /// Returns true if the pendulums represent the liquid at the end of the last step, of length `h`: slosh angles and
    /// thrust are within their limits. Always true if the tank models detached liquid.
    pub fn is_physical_after(&self, inputs: &TankInputs, h: f64) -> bool {
        let TankMotion { state, ball, .. } = &*self.motion;
        if ball.is_some() {
            return true;
        }
        let [a, w, w_d] = [inputs.a.value_at(h), inputs.omega_at(h), inputs.omega_dot.value_at(h)];
        let axial = self.first.map_or(0.0, |[hinge, e]| {
            let turning = add(cross(w_d, hinge), cross(w, cross(w, hinge)));
            dot(e, add(a, turning))
        });
        self.bounds.contain(core::array::from_fn(|n| state.x[6 * n + 2]), axial)
    }

    /// Returns the event indicators, which cross zero at events. In a tank with a model of detached liquid the first crosses
    /// zero at the end of the liquid's current state, and the second where the liquid stops sliding on the wall. In any
    /// other tank the first crosses zero where the thrust no longer holds the liquid at the bottom, so that the tank leaves
    /// its range of validity, and the second is always 1.
    pub fn event_indicators(&mut self, inputs: &TankInputs) -> [f64; 2] {
        if !self.has_ball() {
            let axial = self.outputs_held(inputs).tank.axial;
            return [self.bounds.held_indicator(axial), 1.0];
        }
        self.motion.evaluate(inputs);
        let TankMotion { bobs, a, w, w_d, .. } = &*self.motion;
        self.motion.loose().lump.indicators([a, w, w_d], bobs.iter())
    }

    /// Returns true if an external integrator (Model Exchange) has passed an event of the liquid, even if the indicators of its
    /// last steps did not show the event.
    pub fn is_event_overdue(&mut self, inputs: &TankInputs) -> bool {
        let now = self.event_indicators(inputs);
        self.has_ball() && self.motion.loose().lump.is_overdue(now)
    }

    /// Performs all events that are due: liquid leaves the bottom of the tank, hits the wall or settles, and the ranges
    /// of validity in the outputs are updated. Returns true if continuous states have changed. If an error is returned,
    /// the tank is unchanged.
    pub fn take_event(&mut self, inputs: &TankInputs) -> Result<bool, StepError> {
        let before = self.motion.state;
        let changed = if self.has_ball() { self.motion.take_due(inputs) } else { Some(false) };
        let Some(changed) = changed else {
            self.motion.state = before;
            return Err(StepError::NotFinite { time: before.time });
        };
        self.motion.state.ranges = self.ranges(inputs);
        Ok(changed)
    }

    /// Returns an error if a slosh angle that an external integrator has set is too large for the
    /// model of its mode.
    pub fn check_surfaces(&self) -> Result<(), StepError> {
        match &self.draining {
            Some(mounted) if mounted.is_curved() => {
                let x = &self.motion.state.x;
                mounted.check_surfaces(x, x[LIQUID], 0)
            }
            _ => Ok(()),
        }
    }

    /// Returns the outputs for the present values of the inputs.
    pub fn outputs(&mut self, inputs: &TankInputs) -> SloshTankOutputs {
        let mut outputs = self.outputs_held(inputs);
        let liquid = self.motion.state.x[LIQUID];
        outputs.tank.ranges = self.bounds.classify(&outputs.tank, liquid);
        outputs
    }

    /// Returns the outputs as [`SloshTank::outputs`] does, but with the ranges of validity as they were at the last event.
    pub fn outputs_held(&mut self, inputs: &TankInputs) -> SloshTankOutputs {
        let x = self.motion.state.x;
        if let Some(mounted) = &self.draining {
            let TankInputs { a, omega, omega_dot, mass_flow } = *inputs;
            let motion = [a.value, omega, omega_dot.value];
            return self.draining_outputs(
                mounted,
                &x,
                &x,
                &(motion, mass_flow.value),
                mass_flow.slope,
            );
        }
        self.motion.evaluate(inputs);
        self.outputs_from(&x, self.motion.parts::<f64>())
    }

    fn draining_outputs<T: Number>(
        &self,
        mounted: &MountedTank,
        shown: &[f64; TANK_STATES],
        x: &[T; TANK_STATES],
        ([a, w, w_d], flow): &Acting<T>,
        slope: f64,
    ) -> SloshTankOutputs {
        let spin = vector_from(x, SPIN);
        let contents = mounted.contents(x, spin, [*a, *w, *w_d], (x[LIQUID], *flow, slope));
        let mut matrix = contents.rigid.mass_matrix();
        contents.add_rods(&mut matrix);
        let parts = Parts {
            motion: [*a, *w, *w_d],
            rigid: contents.rigid,
            wrench: contents.wrench(*a, *w, *w_d),
            loads: contents.loads(),
            matrix,
            bobs: mounted.bobs_now(&contents),
            turning: contents.spin().map(|(_, [_, turning])| turning),
            lump: None,
            ball_state: BallState::Settled,
        };
        self.outputs_from(shown, parts)
    }

    fn outputs_from<T: Number>(&self, x: &[f64; TANK_STATES], parts: Parts<T>) -> SloshTankOutputs {
        let Parts { motion: [a, w, w_d], rigid, wrench, loads, mut matrix, bobs, lump, .. } = parts;
        let mut tank = TankOutputs::from_states(x);
        (tank.ball_position, tank.ball_velocity) = (part(x, BALL), part(x, BALL + 3));
        tank.ball_state = parts.ball_state;
        let mut all = MassProperties::from_rigid(&rigid);
        for bob in bobs.iter().flatten().chain(&lump) {
            all.add(bob.m, bob.rho);
        }
        let scale = self.bounds.spin_scale();
        tank.set_angles([a, w, w_d], bobs.iter().flatten(), parts.turning, scale);
        let zero = constant::<T>([0.0; 3]);
        let lumped = self.lumped.lift::<T>();
        let bias = match self.coupling {
            Coupling::Split => plus(loads, rigid.gyroscopic_wrench(w).map(|half| half.map(|x| -x))),
            Coupling::Lumped => plus(wrench, lumped.inertial_wrench(a, zero, w_d)),
            Coupling::RigidBody => plus(wrench, lumped.inertial_wrench(a, w, w_d)),
        };
        if self.coupling != Coupling::Split {
            matrix = lumped.mass_matrix();
        }
        tank.ranges = self.motion.state.ranges;
        (tank.force, tank.torque) = (wrench[0].map(T::result), wrench[1].map(T::result));
        let [f, tau] = bias.map(|half| half.map(T::result));
        SloshTankOutputs {
            tank,
            bias: [f[0], f[1], f[2], tau[0], tau[1], tau[2]],
            added_mass: triangle(&matrix),
            impulse: self.motion.state.impulse,
            dissipated: x[DISSIPATED],
            liquid: x[LIQUID],
            mass: all.mass.result(),
            center_of_mass: all.center().map(T::result),
            inertia: all.inertia(),
        }
    }

    /// Returns the continuous states in this order: direction p and rate p' of the pendulum of each mode, dissipated
    /// energy (J), mass of the liquid (kg), position (m) and rate (m/s) of the detached liquid, and angular momentum of
    /// the liquid's spin (kg m2/s). Vectors are in tank axes.
    pub fn continuous_states(&self) -> [f64; TANK_STATES] {
        self.motion.state.x
    }

    /// Returns [`SloshTank::continuous_states`] without a copy.
    pub fn borrow_states(&self) -> &[f64; TANK_STATES] {
        &self.motion.state.x
    }

    /// Sets the continuous states, in the order of [`SloshTank::continuous_states`]. Directions need not have unit length.
    pub fn set_continuous_states(&mut self, x: &[f64; TANK_STATES]) {
        self.motion.state.x = *x;
    }

    /// Returns the derivatives of the continuous states by time. Directions are normalised before, and rates are
    /// made perpendicular to them.
    pub fn derivatives(&mut self, inputs: &TankInputs) -> [f64; TANK_STATES] {
        if let Some(mounted) = &self.draining {
            let mut rate = [0.0; TANK_STATES];
            Run { mounted, inputs }.write_rates(0.0, &self.motion.state.x, &mut rate);
            return rate;
        }
        self.motion.evaluate(inputs);
        self.motion.state_rates::<0>()
    }

    /// Returns the exact derivative of x' for a change of the states by `dx` and of the inputs a, omega, omega_dot,
    /// mass_flow by `du`. The slope of mass_flow does not change.
    pub fn directional_derivative(
        &mut self,
        inputs: &TankInputs,
        dx: &[f64; TANK_STATES],
        du: &[f64; TANK_INPUTS],
    ) -> [f64; TANK_STATES] {
        if let Some(mounted) = &self.draining {
            let (x, acting) = dual_arguments(&self.motion.state.x, inputs, dx, du);
            let slope = inputs.mass_flow.slope;
            return draining_rates(mounted, &x, &acting, slope).map(Number::result);
        }
        self.motion.evaluate_direction(inputs, dx, du);
        self.motion.state_rates::<1>()
    }

    /// Returns the exact derivative of the outputs for a change of the states by `dx` and of the inputs by `du`.
    pub fn output_derivatives(
        &mut self,
        inputs: &TankInputs,
        dx: &[f64; TANK_STATES],
        du: &[f64; TANK_INPUTS],
    ) -> SloshTankOutputs {
        if let Some(mounted) = &self.draining {
            let (x, acting) = dual_arguments(&self.motion.state.x, inputs, dx, du);
            return self.draining_outputs(mounted, dx, &x, &acting, inputs.mass_flow.slope);
        }
        self.motion.evaluate_direction(inputs, dx, du);
        let parts = self.motion.parts::<Dual>();
        SloshTankOutputs { impulse: [0.0; 6], ..self.outputs_from(dx, parts) }
    }

    /// Updates the rates of the bobs after an impulse on the carrying craft, which changes the velocity of O by `dv` (m/s) and
    /// the craft's angular velocity by `dw` (rad/s), both in the craft's axes. The bobs keep their velocities across their rods.
    pub fn apply_host_impulse(&mut self, dv: Vec3, dw: Vec3) {
        let TankMotion { state, bobs, constrained, .. } = &mut *self.motion;
        if let Some(mounted) = &self.draining {
            mounted.flatten(&mut state.x);
            let tank = Tank { liquid_0: state.x[LIQUID], ..mounted.tank }.resolve();
            bobs.iter_mut().for_each(|bob| *bob = Bob::new(&tank, 0, bob.mode));
            for bob in constrained {
                if let Some(now) = ConstrainedBob::new(&tank, 0, bob.mode) {
                    *bob = now;
                }
            }
        }
        self.motion.start(0.0);
        self.motion.follow_impulse(dv, dw);
    }

    /// Returns the coupling ratio, which is the largest eigenvalue lambda of M_host^-1 M_a: the added mass of the liquid
    /// divided by the mass of the carrying craft, at the current directions of the pendulums. `None` if the mass properties of
    /// this craft are unknown.
    ///
    /// A simulator of the carrying craft that applies the total force and torque one step late diverges, at any step size, if the
    /// ratio is above 1 (values held over the step), 1/3 (Gauss-Seidel, linear extrapolation) or 0.155 (Jacobi, linear
    /// extrapolation).
    pub fn coupling_ratio(&mut self) -> Option<f64> {
        let host = self.host?;
        self.motion.start(0.0);
        let mut matrix = self.motion.rigid.mass_matrix();
        for bob in &self.motion.bobs {
            add_rank_one(&mut matrix, bob.m, &along_rod(bob.p[0], bob.hinge));
        }
        for bob in &self.motion.constrained {
            bob.add_inertia(&mut matrix);
        }
        Some(largest_eigenvalue(&Factors::new(&host.rigid().mass_matrix()), &matrix))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taylor::ramp::Ramp;

    /// The model is valid for an upright tank under 9.81 m/s2 along its axis. Under 30 m/s2 across the axis the pendulum has
    /// passed 45 degrees after 0.4 s, and at 1 m/s2 downwards the specific force does not hold the liquid at the bottom.
    #[test]
    fn a_tank_is_in_range_within_45_degrees_and_while_the_force_presses_the_liquid_down() {
        let after = |a: [f64; 3], h: f64| {
            let p = TankParameters::default();
            let start =
                TankInputs { a: Ramp::<[f64; 3]>::held([0.0, 0.0, 9.81]), ..TankInputs::default() };
            let mut tank = SloshTank::new(&p, &start, 0.0, 1e-9).unwrap();
            let inputs = TankInputs { a: Ramp::<[f64; 3]>::held(a), ..start };
            tank.step(&inputs, h).unwrap();
            tank.is_physical_after(&inputs, h)
        };
        assert!(after([0.0, 0.0, 9.81], 0.5));
        assert!(after([1.0, 0.0, 9.81], 0.5));
        assert!(!after([30.0, 0.0, 9.81], 0.4));
        assert!(!after([0.0, 0.0, -1.0], 0.01));
    }
}
