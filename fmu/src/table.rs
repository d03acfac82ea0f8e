//! Every variable of the FMU, once.
//!
//! A variable exists exactly when it has an entry here. The model description,
//! the value references, get and set, start values, range checks, saved states
//! and the GUID follow from this table. Start values are not written here: they are
//! `plant::Parameters::default()` and `plant::Inputs::default()`, read through the
//! entry's accessor.
//!
//! Ranges keep the plant sane (positive inertia, a tank that is a tank, a
//! sampling rate that can be stepped) and are wide otherwise; what parameters
//! mean together is for the plant to judge.

use plant::{FrictionModel, INDICATORS, Inputs, Ramp, STATES, SloshModel, x};

use crate::hash::Hash;
use crate::variable::{
    Access, Causality, Enumeration, Item, Kind, Place, Value, Variable, calculated,
    calculated_per_mode, choice, coordinate, count, input, integer, local, local_choice,
    local_flag, local_integer, output, parameter, rate, switch,
};

/// The FMU's name in every sense: modelName, modelIdentifier, file name.
pub const MODEL: &str = "HubSlosh";
/// The version of model and table.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

// What follows what at once. The hub's acceleration balances all torques, the restoring
// force of the liquid (proportional to g_axial) among them, and stuck friction carries
// what is left; forces and torques of the liquid contain the hub's acceleration. Angle
// and rate are in it through the friction, wheel_speed through the wheel's limits.
#[rustfmt::skip]
const ALL_TORQUES: &[&str] = &[
    "theta", "omega", "wheel_speed",
    "slosh.q_radial", "slosh.q_tangential", "slosh.v_radial", "slosh.v_tangential",
    "tau_cmd", "tau_ext", "g_axial",
];
const HUB_AND_LIQUID: &[&str] =
    &["omega", "slosh.q_radial", "slosh.q_tangential", "slosh.v_radial", "slosh.v_tangential"];
#[rustfmt::skip]
const HEAT: &[&str] = &[
    "theta", "omega",
    "slosh.q_radial", "slosh.q_tangential", "slosh.v_radial", "slosh.v_tangential",
];
const MODE_1: &[&str] = &["slosh.q_radial[1]", "slosh.q_tangential[1]"];
const MODE_1_MOVING: &[&str] =
    &["slosh.q_radial[1]", "slosh.q_tangential[1]", "slosh.v_radial[1]", "slosh.v_tangential[1]"];
// Where they start. The damping belongs to the g_axial at the start.
#[rustfmt::skip]
const DYNAMICS: &[&str] = &[
    "tau_cmd", "tau_ext", "g_axial",
    "hub.", "tank.", "fluid.", "slosh.", "friction.", "init.", "wheel.",
];
const LIQUID: &[&str] = &["tank.", "fluid.", "slosh."];
// The plant keeps positions and velocities in space, not angles: going there and
// back mixes the directions in the last digit.
const SLOSH_START: &[&str] = &["tank.", "slosh.", "init."];

/// The table. Outputs come first, in reading order: hosts plot them all.
#[rustfmt::skip]
pub static TABLE: &[Variable] = &[
    // Outputs
    output("theta", |o| o.theta, "rad",
        "Hub angle about the bearing axis, counter-clockwise from above positive, not wrapped")
        .shown_in("deg").state(x::THETA).follows(&["theta"]).from(&["init.theta"]),
    output("omega", |o| o.omega, "rad/s",
        "Hub rate, the derivative of theta")
        .shown_in("deg/s").about(0.01).state(x::OMEGA).reinit().follows(&["omega"]).from(&["init.omega"]),
    output("omega_dot", |o| o.omega_dot, "rad/s2",
        "Hub acceleration, the derivative of omega; 0 while the hub is stuck")
        .shown_in("deg/s2").follows(ALL_TORQUES).from(DYNAMICS),
    output("slosh_angle", |o| o.slosh_angle, "rad",
        "Slosh angle of mode 1, tangential, positive when the liquid is displaced towards +theta; its sine is displacement over pendulum length")
        .shown_in("deg").about(0.1).follows(MODE_1).from(SLOSH_START),
    output("slosh_rate", |o| o.slosh_rate, "rad/s",
        "Derivative of slosh_angle")
        .shown_in("deg/s").follows(MODE_1_MOVING).from(SLOSH_START),
    output("slosh_angle_radial", |o| o.slosh_angle_radial, "rad",
        "Slosh angle of mode 1, radial, positive when the liquid is displaced outwards, away from the bearing axis; 0 in planar models")
        .shown_in("deg").about(0.1).follows(MODE_1).from(SLOSH_START),
    output("tau_friction", |o| o.tau_friction, "N.m",
        "Torque of the bearing's friction on the hub, opposes omega; while stuck it balances all other torques")
        .shown_in("mN.m").about(0.01).follows(ALL_TORQUES).from(DYNAMICS),
    output("tau_fluid", |o| o.tau_fluid, "N.m",
        "Torque of the whole liquid, its frozen part included, on the hub: hub.I omega_dot = tau_actuator + tau_ext + tau_friction + tau_fluid")
        .shown_in("mN.m").about(0.1).follows(ALL_TORQUES).from(DYNAMICS),
    output("F_tangential", |o| o.f_tangential, "N",
        "Force of the liquid, its frozen part included, on the tank, hub frame: tangential, positive towards +theta")
        .follows(ALL_TORQUES).from(DYNAMICS),
    output("F_radial", |o| o.f_radial, "N",
        "Force of the liquid, its frozen part included, on the tank, hub frame: radial, positive outwards")
        .follows(ALL_TORQUES).from(DYNAMICS),
    output("wave_height", |o| o.wave_height, "m",
        "Height of the wave at the tank's wall above the surface at rest, from linear theory; above a quarter of the tank's radius an indicator rather than a height")
        .shown_in("mm").about(0.01)
        .follows(&["slosh.q_radial", "slosh.q_tangential"]).from(SLOSH_START),
    output("omega_imu", |o| o.omega_imu, "rad/s",
        "What a rate gyro on the hub reads: sampled, noisy, quantised; equal to omega while imu.enabled is false")
        .shown_in("deg/s").about(0.1).follows(&["omega"]).from(&["init.omega", "imu."]),

    // Inputs
    input("tau_cmd", |i| &mut i.tau_cmd, "N.m",
        "Torque command to the actuator, positive turns the hub towards +theta; held over a step unless its derivative is set, which holds for one step")
        .shown_in("mN.m").about(0.1),
    input("tau_ext", |i| &mut i.tau_ext, "N.m",
        "Any other torque on the hub, positive towards +theta; held over a step unless its derivative is set, which holds for one step")
        .shown_in("mN.m").about(0.1),
    input("g_axial", |i| &mut i.g_axial, "m/s2",
        "Specific force along the tank's axis, pressing the liquid to the bottom: gravity on a bench, thrust acceleration in flight; held over a step unless its derivative is set, which holds for one step")
        .at_least(0.0).about(10.0),

    // Locals
    local("slosh_rate_radial", |o| o.slosh_rate_radial, "rad/s",
        "Derivative of slosh_angle_radial")
        .shown_in("deg/s").follows(MODE_1_MOVING),
    local("energy", |o| o.energy, "J",
        "Kinetic and potential energy of hub and liquid, 0 at rest")
        .about(0.01).follows(ALL_TORQUES),
    local("momentum", |o| o.momentum, "kg.m2/s",
        "Angular momentum of hub and liquid about the bearing axis")
        .follows(HUB_AND_LIQUID),
    local("power_dissipated", |o| o.power_dissipated, "W",
        "Power turned into heat by bearing and liquid together, never negative")
        .follows(HEAT),
    local("work", |o| o.work, "J",
        "Work done on the hub by tau_actuator and tau_ext since the start")
        .about(0.01).state(x::WORK).follows(&["work"]),
    local("heat", |o| o.heat, "J",
        "Heat made by bearing and liquid since the start")
        .about(0.01).state(x::HEAT).follows(&["heat"]),
    local("tau_actuator", |o| o.tau_actuator, "N.m",
        "Torque of the actuator on the hub, positive towards +theta: tau_cmd after the wheel's limits")
        .shown_in("mN.m").follows(&["tau_cmd", "wheel_speed"]),
    local("wheel_speed", |o| o.wheel_speed, "rad/s",
        "Absolute speed of the wheel's rotor; a positive tau_actuator slows it down")
        .shown_in("rpm").about(100.0).state(x::WHEEL_SPEED).reinit().follows(&["wheel_speed"]).from(&["wheel.speed_0"]),
    local_flag("stuck", |o| o.discrete.stuck,
        "The hub is held by dry friction")
        .follows(ALL_TORQUES),
    local_choice("regime", &REGIME, |o| o.discrete.regime as i32,
        "How far wave_height is inside the range of linear theory")
        .follows(&["slosh.q_radial", "slosh.q_tangential"]),
    local_integer("friction_mode", |o| o.discrete.friction_mode,
        "Branch of the set-valued friction law: -1 turning backwards, 0 stuck, 1 turning forwards; 1 with other laws")
        .follows(ALL_TORQUES),
    local_integer("event_count", |o| o.discrete.event_count,
        "How often friction_mode has changed since the start"),
    local("event_time", |o| o.discrete.event_time, "s",
        "When friction_mode changed last"),
    local("stuck_time", |o| o.stuck_time, "s",
        "Time spent stuck since the start")
        .state(x::STUCK_TIME).follows(&["stuck_time"]),

    // The slosh modes' coordinates: with theta, omega, work, heat, stuck_time and
    // wheel_speed the continuous states
    coordinate("slosh.q_radial", 0,
        "Radial coordinate of a slosh mode, positive outwards. Models linear and planar: unused; spherical: stereographic, the tangent of half the pendulum's angle from the vertical times the direction's radial part (unit 1); paraboloid: displacement (m)")
        .about(1e-3).follows(&["slosh.q_radial[]"]).from(SLOSH_START),
    coordinate("slosh.q_tangential", 1,
        "Tangential coordinate of a slosh mode, positive towards +theta. Models linear and planar: slosh angle (rad); spherical: stereographic, as slosh.q_radial (unit 1); paraboloid: displacement (m)")
        .about(1e-3).follows(&["slosh.q_tangential[]"]).from(SLOSH_START),
    coordinate("slosh.v_radial", 2,
        "Derivative of slosh.q_radial; its unit is that of slosh.q_radial per second")
        .about(0.01).follows(&["slosh.v_radial[]"]).from(SLOSH_START),
    coordinate("slosh.v_tangential", 3,
        "Derivative of slosh.q_tangential; its unit is that of slosh.q_tangential per second")
        .about(0.01).follows(&["slosh.v_tangential[]"]).from(SLOSH_START),

    // The derivatives of the continuous states; a Model Exchange host has them in this
    // order
    rate("der(theta)", Place::Of(x::THETA), "rad/s",
        "Derivative of theta: omega")
        .follows(&["omega"]).from(&["init.omega"]),
    rate("der(omega)", Place::Of(x::OMEGA), "rad/s2",
        "Derivative of omega: omega_dot")
        .follows(ALL_TORQUES).from(DYNAMICS),
    rate("der(work)", Place::Of(x::WORK), "W",
        "Derivative of work: power of tau_actuator and tau_ext")
        .follows(&["omega", "wheel_speed", "tau_cmd", "tau_ext"]).from(&["init.omega", "wheel."]),
    rate("der(heat)", Place::Of(x::HEAT), "W",
        "Derivative of heat: power_dissipated")
        .follows(HEAT).from(DYNAMICS),
    rate("der(stuck_time)", Place::Of(x::STUCK_TIME), "1",
        "Derivative of stuck_time: 1 while stuck, 0 otherwise")
        .follows(ALL_TORQUES).from(DYNAMICS),
    rate("der(wheel_speed)", Place::Of(x::WHEEL_SPEED), "rad/s2",
        "Derivative of wheel_speed: -tau_actuator/wheel.I")
        .follows(&["wheel_speed", "tau_cmd"]).from(&["wheel."]),
    rate("der(slosh.q_radial)", Place::PerMode(0), "",
        "Derivative of slosh.q_radial: slosh.v_radial")
        .follows(&["slosh.v_radial[]"]).from(SLOSH_START),
    rate("der(slosh.q_tangential)", Place::PerMode(1), "",
        "Derivative of slosh.q_tangential: slosh.v_tangential")
        .follows(&["slosh.v_tangential[]"]).from(SLOSH_START),
    rate("der(slosh.v_radial)", Place::PerMode(2), "",
        "Derivative of slosh.v_radial")
        .follows(ALL_TORQUES).from(DYNAMICS),
    rate("der(slosh.v_tangential)", Place::PerMode(3), "",
        "Derivative of slosh.v_tangential")
        .follows(ALL_TORQUES).from(DYNAMICS),

    // Hub, tank, liquid
    parameter("hub.I", |p| &mut p.hub.inertia, "kg.m2",
        "Moment of inertia of hub and dry tank about the bearing axis, without the wheel's rotor")
        .range(1e-6, 1e12),
    parameter("tank.d", |p| &mut p.tank.d, "m",
        "Inner diameter of the upright cylindrical tank")
        .shown_in("mm").range(1e-3, 100.0),
    parameter("tank.h", |p| &mut p.tank.h, "m",
        "Fill height")
        .shown_in("mm").range(1e-4, 100.0),
    parameter("tank.r", |p| &mut p.tank.r, "m",
        "Distance of the tank's axis from the bearing axis")
        .shown_in("mm").range(0.0, 1000.0),
    parameter("tank.I_own", |p| &mut p.tank.own_inertia, "kg.m2",
        "Moment of inertia of the liquid that turns with the tank about the tank's own axis; 0: an upright cylinder does not turn inviscid liquid")
        .range(0.0, 1e6),
    parameter("fluid.rho", |p| &mut p.fluid.rho, "kg/m3",
        "Density of the liquid")
        .range(1e-6, 1e5),
    parameter("fluid.nu", |p| &mut p.fluid.nu, "m2/s",
        "Kinematic viscosity of the liquid")
        .shown_in("mm2/s").range(0.0, 1.0),
    parameter("fluid.sigma", |p| &mut p.fluid.sigma, "N/m",
        "Surface tension of the liquid")
        .shown_in("mN/m").range(1e-9, 10.0),

    // Slosh model
    choice("slosh.model", &SLOSH_MODEL, |p| p.slosh.model as i32,
        |p, n| set_item(&mut p.slosh.model, &SloshModel::ALL, n),
        "Mechanical model of the liquid"),
    count("slosh.modes", 1, plant::MODES as i32, |p| p.slosh.modes as i32,
        |p, n| p.slosh.modes = n.max(0) as usize,
        "How many slosh modes are kept; the mass of the others is frozen"),
    switch("slosh.zeta_from_correlation", |p| &mut p.slosh.zeta_from_correlation,
        "Damping ratio from the correlation of Mikishev and Dorozhkin; if false it is slosh.zeta"),
    parameter("slosh.zeta", |p| &mut p.slosh.zeta, "1",
        "Damping ratio of every mode when slosh.zeta_from_correlation is false")
        .range(0.0, 0.999),
    parameter("slosh.hardening", |p| &mut p.slosh.hardening, "1",
        "Coefficient of the quartic spring, model paraboloid only")
        .range(0.0, 100.0),

    // Bearing
    choice("friction.model", &FRICTION_MODEL, |p| p.friction.model as i32,
        |p, n| set_item(&mut p.friction.model, &FrictionModel::ALL, n),
        "Law of the bearing's friction")
        .tunable(),
    parameter("friction.b", |p| &mut p.friction.b, "N.m.s",
        "Viscous coefficient")
        .range(0.0, 1e6).tunable(),
    parameter("friction.c", |p| &mut p.friction.c, "N.m",
        "Coulomb torque")
        .shown_in("mN.m").range(0.0, 1e6).tunable(),
    parameter("friction.d", |p| &mut p.friction.d, "N.m",
        "Static torque in excess of the Coulomb torque")
        .shown_in("mN.m").range(0.0, 1e6).tunable(),
    parameter("friction.omega_s", |p| &mut p.friction.omega_s, "rad/s",
        "Stribeck speed: the excess falls with exp(-(omega/omega_s)^2)")
        .shown_in("deg/s").range(1e-6, 1e6).tunable(),
    parameter("friction.eps", |p| &mut p.friction.eps, "rad/s",
        "Width of the smoothed sign, model stribeck_smooth only")
        .shown_in("deg/s").range(1e-7, 1e3).tunable(),
    parameter("friction.asymmetry", |p| &mut p.friction.asymmetry, "1",
        "Dry friction is 1 + asymmetry times as strong forwards and 1 - asymmetry times backwards")
        .range(-0.999, 0.999).tunable(),
    parameter("friction.forward_cos1", |p| &mut p.friction.harmonics_forward[0], "1",
        "Relative variation of dry friction with cos(theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    parameter("friction.forward_sin1", |p| &mut p.friction.harmonics_forward[1], "1",
        "Relative variation of dry friction with sin(theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    parameter("friction.forward_cos2", |p| &mut p.friction.harmonics_forward[2], "1",
        "Relative variation of dry friction with cos(2 theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    parameter("friction.forward_sin2", |p| &mut p.friction.harmonics_forward[3], "1",
        "Relative variation of dry friction with sin(2 theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    parameter("friction.backward_cos1", |p| &mut p.friction.harmonics_backward[0], "1",
        "Relative variation of dry friction with cos(theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),
    parameter("friction.backward_sin1", |p| &mut p.friction.harmonics_backward[1], "1",
        "Relative variation of dry friction with sin(theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),
    parameter("friction.backward_cos2", |p| &mut p.friction.harmonics_backward[2], "1",
        "Relative variation of dry friction with cos(2 theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),
    parameter("friction.backward_sin2", |p| &mut p.friction.harmonics_backward[3], "1",
        "Relative variation of dry friction with sin(2 theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),

    // Where the motion starts
    parameter("init.theta", |p| &mut p.init.theta, "rad",
        "Hub angle at the start")
        .shown_in("deg"),
    parameter("init.omega", |p| &mut p.init.omega, "rad/s",
        "Hub rate at the start")
        .shown_in("deg/s").range(-1e3, 1e3),
    parameter("init.slosh_angle", |p| &mut p.init.slosh_angle, "rad",
        "slosh_angle at the start")
        .shown_in("deg").range(-1.5, 1.5),
    parameter("init.slosh_angle_radial", |p| &mut p.init.slosh_angle_radial, "rad",
        "slosh_angle_radial at the start; without meaning in planar models")
        .shown_in("deg").range(-1.5, 1.5),
    parameter("init.slosh_rate", |p| &mut p.init.slosh_rate, "rad/s",
        "slosh_rate at the start")
        .shown_in("deg/s").range(-1e3, 1e3),
    parameter("init.slosh_rate_radial", |p| &mut p.init.slosh_rate_radial, "rad/s",
        "slosh_rate_radial at the start; without meaning in planar models")
        .shown_in("deg/s").range(-1e3, 1e3),

    // Reaction wheel
    switch("wheel.enabled", |p| &mut p.wheel.enabled,
        "The actuator is a reaction wheel with limits; if false its torque is the command"),
    parameter("wheel.I", |p| &mut p.wheel.inertia, "kg.m2",
        "Moment of inertia of the rotor; hub.I does not contain it")
        .range(1e-9, 1e6),
    parameter("wheel.speed_0", |p| &mut p.wheel.speed_0, "rad/s",
        "Rotor speed at the start")
        .shown_in("rpm").range(-1e5, 1e5),
    parameter("wheel.speed_min", |p| &mut p.wheel.speed_min, "rad/s",
        "Lowest rotor speed; there only torque that speeds the rotor up is given")
        .shown_in("rpm").range(-1e5, 1e5),
    parameter("wheel.speed_max", |p| &mut p.wheel.speed_max, "rad/s",
        "Highest rotor speed; there only torque that slows the rotor down is given")
        .shown_in("rpm").range(-1e5, 1e5),
    parameter("wheel.tau_max", |p| &mut p.wheel.tau_max, "N.m",
        "Largest torque of either sign")
        .shown_in("mN.m").range(0.0, 1e6),

    // Rate gyro
    switch("imu.enabled", |p| &mut p.imu.enabled,
        "omega_imu is sampled, noisy and quantised; if false it equals omega"),
    parameter("imu.rate", |p| &mut p.imu.rate, "Hz",
        "Sampling rate")
        .range(0.1, 1e4),
    parameter("imu.arw", |p| &mut p.imu.arw, "rad/s/sqrt(Hz)",
        "Angle random walk; the standard deviation of one sample is this times the root of imu.rate")
        .range(0.0, 10.0),
    parameter("imu.bias_instability", |p| &mut p.imu.bias_instability, "rad/s",
        "Bias instability; the bias is a first-order Gauss-Markov process of standard deviation imu.bias_instability/0.664")
        .shown_in("deg/h").range(0.0, 10.0),
    parameter("imu.bias_time", |p| &mut p.imu.bias_time, "s",
        "Correlation time of the bias")
        .range(1e-3, 1e9),
    parameter("imu.lsb", |p| &mut p.imu.lsb, "rad/s",
        "Quantisation step; 0: none")
        .shown_in("deg/s").range(0.0, 10.0),
    integer("imu.seed", |p| &mut p.imu.seed,
        "Seed of the noise: the same seed gives the same noise on every platform"),

    // What follows from the parameters
    calculated("tank.m_liq", |c| c.m_liq, "kg",
        "Mass of the liquid")
        .from(&["tank.", "fluid."]),
    calculated("tank.m_0", |c| c.m_0, "kg",
        "Part of the liquid's mass that moves with the tank")
        .from(LIQUID),
    calculated("tank.bond", |c| c.bond, "1",
        "Bond number: gravity over surface tension; the model holds far above 1")
        .follows(&["g_axial"]).from(&["tank.", "fluid."]),
    calculated_per_mode("slosh.mass", |c| &c.mass, "kg",
        "Sloshing mass of a mode; 0 for modes that are not used")
        .from(LIQUID),
    calculated_per_mode("slosh.length", |c| &c.length, "m",
        "Pendulum length of a mode; 0 for modes that are not used")
        .shown_in("mm").from(LIQUID),
    calculated_per_mode("slosh.frequency", |c| &c.frequency, "Hz",
        "Natural frequency of a mode in the tank at rest, at the initial g_axial; 0 for modes that are not used")
        .follows(&["g_axial"]).from(LIQUID),
    calculated_per_mode("slosh.damping", |c| &c.damping, "1",
        "Damping ratio of a mode, at the initial g_axial; 0 for modes that are not used")
        .follows(&["g_axial"]).from(LIQUID),
];

/// The models of the liquid.
pub static SLOSH_MODEL: Enumeration = Enumeration {
    name: "SloshModel",
    description: "Mechanical models of the liquid",
    items: &[
        item("frozen", "The liquid is a rigid body"),
        item("linear", "Linear planar pendulums"),
        item("planar", "Nonlinear planar pendulums"),
        item("spherical", "Spherical pendulums: the liquid can rotate"),
        item("paraboloid", "Masses on a paraboloid with a quartic spring"),
    ],
};

/// The laws of friction.
pub static FRICTION_MODEL: Enumeration = Enumeration {
    name: "FrictionModel",
    description: "Laws of the bearing's friction",
    items: &[
        item("none", "A free bearing"),
        item("viscous", "b omega"),
        item("stribeck_smooth", "Stribeck curve, its jump at rest smoothed: creeps, never sticks"),
        item("stribeck", "Stribeck curve as a set-valued law: sticks"),
    ],
};

/// How high the wave is.
pub static REGIME: Enumeration = Enumeration {
    name: "Regime",
    description: "Wave height at the wall against the tank's radius R",
    items: &[
        item("linear", "Below 0.15 R: linear theory holds"),
        item("transitional", "0.15 R to 0.25 R"),
        item("nonlinear", "Above 0.25 R: heights and forces are indications"),
    ],
};

/// All enumeration types.
pub static ENUMERATIONS: [&Enumeration; 3] = [&SLOSH_MODEL, &FRICTION_MODEL, &REGIME];

const fn item(name: &'static str, description: &'static str) -> Item {
    Item { name, description }
}

fn set_item<T: Copy>(field: &mut T, items: &[T], number: i32) {
    if let Some(item) = usize::try_from(number).ok().and_then(|n| items.get(n.checked_sub(1)?)) {
        *field = *item;
    }
}

/// A unit as a product of powers of SI base units, and what people read instead.
#[derive(Debug)]
pub struct Unit {
    /// As variables name it.
    pub name: &'static str,
    /// Exponents of kg, m, s, rad; `None` when they are not integers.
    pub base: Option<[i32; 4]>,
    /// Units to display it in, each with the number that multiplies the value.
    pub displayed: &'static [(&'static str, f64)],
}

const DEG: f64 = 180.0 / std::f64::consts::PI;
const RPM: f64 = 30.0 / std::f64::consts::PI;

const fn unit(
    name: &'static str,
    [kg, m, s, rad]: [i32; 4],
    displayed: &'static [(&'static str, f64)],
) -> Unit {
    Unit { name, base: Some([kg, m, s, rad]), displayed }
}

/// Every unit the table uses.
#[rustfmt::skip]
pub static UNITS: &[Unit] = &[
    //                kg  m   s  rad
    unit("1",       [ 0,  0,  0, 0], &[]),
    unit("kg",      [ 1,  0,  0, 0], &[]),
    unit("m",       [ 0,  1,  0, 0], &[("mm", 1e3)]),
    unit("s",       [ 0,  0,  1, 0], &[]),
    unit("Hz",      [ 0,  0, -1, 0], &[]),
    unit("rad",     [ 0,  0,  0, 1], &[("deg", DEG)]),
    unit("rad/s",   [ 0,  0, -1, 1], &[("deg/s", DEG), ("deg/h", 3600.0 * DEG), ("rpm", RPM)]),
    unit("rad/s2",  [ 0,  0, -2, 1], &[("deg/s2", DEG)]),
    unit("m/s2",    [ 0,  1, -2, 0], &[]),
    unit("m2/s",    [ 0,  2, -1, 0], &[("mm2/s", 1e6)]),
    unit("kg/m3",   [ 1, -3,  0, 0], &[]),
    unit("N/m",     [ 1,  0, -2, 0], &[("mN/m", 1e3)]),
    unit("N",       [ 1,  1, -2, 0], &[]),
    unit("N.m",     [ 1,  2, -2, 0], &[("mN.m", 1e3)]),
    unit("N.m.s",   [ 1,  2, -1, 0], &[]),
    unit("kg.m2",   [ 1,  2,  0, 0], &[]),
    unit("kg.m2/s", [ 1,  2, -1, 0], &[]),
    unit("J",       [ 1,  2, -2, 0], &[]),
    unit("W",       [ 1,  2, -3, 0], &[]),
    Unit { name: "rad/s/sqrt(Hz)", base: None, displayed: &[] },
];

/// One scalar of the table.
#[derive(Clone, Copy, Debug)]
pub struct Scalar {
    /// Its entry.
    pub variable: &'static Variable,
    /// Its value reference, and its place among all scalars.
    pub reference: u32,
    /// Its place in the family, 0 for the first.
    pub element: usize,
    /// How many parameters come before it.
    pub slot: usize,
}

impl Scalar {
    /// Its name, with the mode's number in a family.
    pub fn name(&self) -> String {
        let name = self.variable.name;
        if self.variable.len() == 1 {
            return name.into();
        }
        match name.strip_suffix(')') {
            Some(derivative) => format!("{derivative}[{}])", self.element + 1),
            None => format!("{name}[{}]", self.element + 1),
        }
    }

    /// The inputs and continuous states that it follows without delay.
    pub fn follows(&self) -> impl Iterator<Item = &'static Scalar> {
        let known = SCALARS
            .iter()
            .filter(|s| s.variable.causality == Causality::Input || s.variable.state.is_some());
        known.filter(|s| self.is_meant(self.variable.depends_on, s))
    }

    /// The inputs and parameters that its value at the start follows from.
    pub fn starts_from(&self) -> impl Iterator<Item = &'static Scalar> {
        let known = SCALARS
            .iter()
            .filter(|s| matches!(s.variable.causality, Causality::Input | Causality::Parameter));
        known.filter(|s| {
            self.is_meant(self.variable.depends_on, s)
                || self.is_meant(self.variable.starts_from, s)
        })
    }

    fn is_meant(&self, names: &[&str], other: &Scalar) -> bool {
        let v = other.variable;
        names.iter().any(|name| match name.strip_suffix("[]") {
            Some(family) => family == v.name && self.element == other.element,
            None => {
                *name == v.name
                    || (name.ends_with('.') && v.name.starts_with(name))
                    || (name.ends_with(']') && *name == other.name())
            }
        })
    }
}

/// Number of scalars.
pub const SCALAR_COUNT: usize = {
    let mut n = 0;
    let mut entry = 0;
    while entry < TABLE.len() {
        n += TABLE[entry].len();
        entry += 1;
    }
    n
};

/// Every scalar; the place is its value reference.
pub static SCALARS: [Scalar; SCALAR_COUNT] = {
    let mut scalars =
        [Scalar { variable: &TABLE[0], reference: 0, element: 0, slot: 0 }; SCALAR_COUNT];
    let (mut n, mut entry, mut slot) = (0, 0, 0);
    while entry < TABLE.len() {
        let mut element = 0;
        while element < TABLE[entry].len() {
            scalars[n] = Scalar { variable: &TABLE[entry], reference: n as u32, element, slot };
            n += 1;
            element += 1;
        }
        if matches!(TABLE[entry].causality, Causality::Parameter) {
            slot += 1;
        }
        entry += 1;
    }
    scalars
};

/// The derivatives of the continuous states: this is the order in which a Model
/// Exchange host has states, derivatives and nominals.
pub static RATES: [Scalar; STATES] = {
    let mut rates = [SCALARS[0]; STATES];
    let (mut n, mut reference) = (0, 0);
    while reference < SCALAR_COUNT {
        if matches!(SCALARS[reference].variable.access, Access::Rate(_)) {
            rates[n] = SCALARS[reference];
            n += 1;
        }
        reference += 1;
    }
    assert!(n == STATES, "every state has one derivative");
    rates
};

/// The places in the plant of the continuous states, in the host's order.
pub fn places() -> impl Iterator<Item = usize> {
    RATES.iter().filter_map(|scalar| match scalar.variable.access {
        Access::Rate(place) => Some(place.at(scalar.element)),
        _ => None,
    })
}

/// The variable of the continuous state at a place in the plant.
pub fn state_at(place: usize) -> Option<&'static Scalar> {
    SCALARS.iter().find(|s| s.variable.state.is_some_and(|state| state.at(s.element) == place))
}

/// The parameters, in the table's order.
pub fn parameters() -> impl Iterator<Item = &'static Variable> {
    TABLE.iter().filter(|v| v.causality == Causality::Parameter)
}

/// Places of the inputs in the table, found once: every step goes through them.
static INPUTS: [usize; 3] = {
    let (mut places, mut found, mut place) = ([0; 3], 0, 0);
    while place < TABLE.len() {
        if matches!(TABLE[place].access, Access::Input(_)) {
            places[found] = place;
            found += 1;
        }
        place += 1;
    }
    assert!(found == places.len(), "as many as there are inputs");
    places
};

/// The inputs' accessors, in the table's order.
pub fn ramps() -> impl Iterator<Item = (&'static Variable, fn(&mut Inputs) -> &mut Ramp)> {
    INPUTS.iter().filter_map(|&place| match TABLE[place].access {
        Access::Input(ramp) => Some((&TABLE[place], ramp)),
        _ => None,
    })
}

/// The value reference of a name.
pub fn find(name: &str) -> Option<u32> {
    SCALARS.iter().position(|s| s.name() == name).map(|n| n as u32)
}

/// A hash of all the table says and of the version: a host that brings another
/// one has read another model description.
pub fn guid() -> String {
    let mut hash = Hash::new().text(MODEL).text(VERSION).bytes(&[INDICATORS as u8]);
    for v in TABLE {
        hash = hash.text(v.name).text(v.description).text(&format!("{:?}", v.causality));
        hash = hash.bytes(&[v.len() as u8, u8::from(v.reinit), u8::from(v.tunable)]);
        hash = match v.kind {
            Kind::Real(q) => {
                let text = hash.text("Real").text(q.unit).text(q.display_unit.unwrap_or(""));
                [q.min, q.max, q.nominal].iter().fold(text, |h, x| match x {
                    Some(x) => h.bytes(&x.to_bits().to_le_bytes()),
                    None => h.text("none"),
                })
            }
            Kind::Integer { min, max } => hash.text(&format!("Integer {min:?} {max:?}")),
            Kind::Boolean => hash.text("Boolean"),
            Kind::Enumeration(of) => hash.text(of.name),
        };
        hash = match v.start() {
            Some(Value::Real(x)) => hash.bytes(&x.to_bits().to_le_bytes()),
            Some(Value::Integer(n)) => hash.bytes(&n.to_le_bytes()),
            Some(Value::Boolean(b)) => hash.bytes(&[u8::from(b)]),
            None => hash.text("computed"),
        };
        hash = v.depends_on.iter().chain(v.starts_from).fold(hash, |h, name| h.text(name));
    }
    for of in ENUMERATIONS {
        hash = hash.text(of.name).text(of.description);
        hash = of.items.iter().fold(hash, |h, i| h.text(i.name).text(i.description));
    }
    for u in UNITS {
        hash = hash.text(u.name).text(&format!("{:?}", u.base));
        hash = u
            .displayed
            .iter()
            .fold(hash, |h, (name, factor)| h.text(name).bytes(&factor.to_bits().to_le_bytes()));
    }
    let hex = format!("{:032x}", hash.value());
    format!("{{{}-{}-{}-{}-{}}}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::Parameters;

    #[test]
    fn every_parameter_can_be_set_and_read_back_and_touches_no_other() {
        for (n, variable) in parameters().enumerate() {
            let mut all = Parameters::default();
            let other = match variable.start().unwrap() {
                Value::Real(x) => Value::Real(x + 0.125),
                Value::Integer(n) => Value::Integer(if n == 1 { 2 } else { 1 }),
                Value::Boolean(b) => Value::Boolean(!b),
            };
            variable.set_parameter(&mut all, other);
            for (m, v) in parameters().enumerate() {
                let expected = if m == n { Some(other) } else { v.start() };
                assert_eq!(v.parameter(&all), expected, "{} after {}", v.name, variable.name);
            }
        }
    }

    #[test]
    fn every_item_of_an_enumeration_can_be_set_and_read_back() {
        for variable in parameters() {
            if let Kind::Enumeration(of) = variable.kind {
                for n in 1..=of.items.len() as i32 {
                    let mut all = Parameters::default();
                    variable.set_parameter(&mut all, Value::Integer(n));
                    assert_eq!(variable.parameter(&all), Some(Value::Integer(n)));
                }
            }
        }
    }

    #[test]
    fn start_values_are_within_their_ranges() {
        for variable in TABLE {
            if let Some(start) = variable.start() {
                assert_eq!(variable.problem(start), None);
            }
        }
    }

    #[test]
    fn every_continuous_state_has_its_derivative_under_its_name() {
        for (place, rate) in places().zip(&RATES) {
            let state = state_at(place).unwrap();
            assert_eq!(rate.name(), format!("der({})", state.name()));
        }
        let mut all: Vec<usize> = places().collect();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..STATES));
        let states = SCALARS.iter().filter(|s| s.variable.state.is_some());
        assert_eq!(states.count(), STATES);
    }

    #[test]
    fn value_references_lead_back_to_their_names() {
        for (n, scalar) in SCALARS.iter().enumerate() {
            assert_eq!(find(&scalar.name()), Some(n as u32));
        }
    }

    #[test]
    fn out_of_range_values_are_reported_with_what_is_allowed() {
        let problem = |name: &str, value| {
            let scalar = SCALARS[find(name).unwrap() as usize];
            scalar.variable.problem(value).unwrap()
        };
        assert_eq!(
            problem("tank.h", Value::Real(-1.0)),
            "tank.h = -1.0 m (allowed: 0.0001 m to 100.0 m)"
        );
        assert_eq!(
            problem("g_axial", Value::Real(f64::NAN)),
            "g_axial = NaN m/s2 (allowed: at least 0.0 m/s2, finite)"
        );
        assert_eq!(
            problem("friction.model", Value::Integer(5)),
            "friction.model = 5 (allowed: 1 none, 2 viscous, 3 stribeck_smooth, 4 stribeck)"
        );
        assert_eq!(problem("slosh.modes", Value::Integer(0)), "slosh.modes = 0 (allowed: 1 to 10)");
    }

    #[test]
    fn guid_has_the_form_of_one() {
        let guid = guid();
        let dashes: Vec<_> = guid.match_indices('-').map(|(n, _)| n).collect();
        assert_eq!((guid.len(), dashes), (38, vec![9, 14, 19, 24]));
    }
}
