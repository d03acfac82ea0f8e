//! Every variable of the FMU, once.
//!
//! A variable exists exactly when it has an entry here. The model description,
//! the value references, get and set, start values, range checks, saved states
//! and the GUID follow from this table. Start values are not written here: they are
//! `plant::Parameters::default()`, with the liquid let go at `model::START_ANGLE`, and
//! `plant::Inputs::default()`, read through the entry's accessor.
//!
//! Ranges keep the plant sane (positive inertia, a tank that is a tank, a
//! sampling rate that can be stepped) and are wide otherwise; what parameters
//! mean together is for the plant to judge.

use plant::{DampingLaw, FrictionModel, INDICATORS, MODES, Ramp, SloshModel, SloshSource, x};
use runtime::table::{About, Scalar, Table, scalar_count, scalars};
use runtime::variable::Dimension::{Fixed, Sized};
use runtime::variable::{Dimension, Enumeration, Item, Variable};

use crate::HubSlosh;
use crate::model::SAVED_WORDS;

/// All that is said about the FMU's variables.
pub static TABLE: Table<HubSlosh> = Table::new(
    About {
        model: "HubSlosh",
        version: env!("CARGO_PKG_VERSION"),
        description: "A spacecraft hub on a bearing with dry friction that can stick, and on it a \
                      tank with sloshing liquid, a reaction wheel and a rate gyro",
        events: "Each time the hub sticks in its bearing or breaks away",
        event_indicators: INDICATORS,
        saved_words: SAVED_WORDS,
    },
    VARIABLES,
    &SCALARS,
);

static SCALARS: [Scalar<HubSlosh>; scalar_count(VARIABLES)] = scalars(VARIABLES);

// What follows what at once. The hub's acceleration balances all torques, the restoring
// force of the liquid (proportional to g_axial) among them, and stuck friction carries
// what is left; forces and torques of the liquid contain the hub's acceleration. Angle
// and rate are in it through the friction, wheel_speed through the wheel's limits.
#[rustfmt::skip]
const ALL_TORQUES: &[&str] = &[
    "theta", "omega", "wheel_speed", "bristle",
    "slosh.q_radial", "slosh.q_tangential", "slosh.v_radial", "slosh.v_tangential",
    "tau_cmd", "tau_ext", "g_axial",
];
const HUB_AND_LIQUID: &[&str] =
    &["omega", "slosh.q_radial", "slosh.q_tangential", "slosh.v_radial", "slosh.v_tangential"];
#[rustfmt::skip]
const HEAT: &[&str] = &[
    "theta", "omega", "bristle",
    "slosh.q_radial", "slosh.q_tangential", "slosh.v_radial", "slosh.v_tangential",
    "g_axial",
];
const MODE_1: &[&str] = &["slosh.q_radial[1]", "slosh.q_tangential[1]"];
const MODE_1_MOVING: &[&str] =
    &["slosh.q_radial[1]", "slosh.q_tangential[1]", "slosh.v_radial[1]", "slosh.v_tangential[1]"];
const WAVE_1: &[&str] = &[
    "slosh.q_radial[1]",
    "slosh.q_tangential[1]",
    "slosh.v_radial[1]",
    "slosh.v_tangential[1]",
    "g_axial",
];
// Where they start. The damping belongs to the g_axial at the start.
#[rustfmt::skip]
const DYNAMICS: &[&str] = &[
    "tau_cmd", "tau_ext", "g_axial",
    "hub.", "tank.", "fluid.", "slosh.", "baffle.", "bench.", "friction.", "init.", "wheel.",
];
const LIQUID: &[&str] = &["tank.", "fluid.", "slosh."];
// Modes of a surface that gravity tilts, by how the tank stands to it at the start.
const LIQUID_MODES: &[&str] = &["tank.", "fluid.", "slosh.", "bench.", "init.theta"];
// The plant keeps positions and velocities in space, not angles: going there and
// back mixes the directions in the last digit.
const SLOSH_START: &[&str] = &["tank.", "slosh.", "bench.", "init."];

/// Dimension over the modes in use.
const PER_MODE: &[Dimension] = &[Sized("slosh.modes", MODES)];
/// Dimension of a table of modes, of which those with the lowest frequencies are used.
const TABLE_OF_MODES: &[Dimension] = &[Fixed(MODES)];

type V = Variable<HubSlosh>;

/// The variables. Outputs come first, in reading order: hosts plot them all.
#[rustfmt::skip]
static VARIABLES: &[Variable<HubSlosh>] = &[
    // Outputs
    V::output("theta", |o, _| o.theta, "rad",
        "Hub angle about the bearing axis, counter-clockwise from above positive, not wrapped")
        .display_unit("deg").is_state(|_| x::THETA).depends_on(&["theta"]).initial_depends_on(&["init.theta"]),
    V::output("omega", |o, _| o.omega, "rad/s",
        "Hub rate, the derivative of theta")
        .display_unit("deg/s").nominal(0.01).is_state(|_| x::OMEGA).reinit().depends_on(&["omega"]).initial_depends_on(&["init.omega"]),
    V::output("omega_dot", |o, _| o.omega_dot, "rad/s2",
        "Hub acceleration, the derivative of omega; 0 while the hub is stuck")
        .display_unit("deg/s2").depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::output("slosh_angle", |o, _| o.slosh_angle, "rad",
        "Slosh angle of mode 1, tangential, positive when the liquid is displaced towards +theta; its sine is displacement over pendulum length")
        .display_unit("deg").nominal(0.1).depends_on(MODE_1).initial_depends_on(SLOSH_START),
    V::output("slosh_rate", |o, _| o.slosh_rate, "rad/s",
        "Derivative of slosh_angle")
        .display_unit("deg/s").depends_on(MODE_1_MOVING).initial_depends_on(SLOSH_START),
    V::output("slosh_angle_radial", |o, _| o.slosh_angle_radial, "rad",
        "Slosh angle of mode 1, radial, positive when the liquid is displaced outwards, away from the bearing axis; 0 in planar models")
        .display_unit("deg").nominal(0.1).depends_on(MODE_1).initial_depends_on(SLOSH_START),
    V::output("tau_friction", |o, _| o.tau_friction, "N.m",
        "Torque of the bearing's friction on the hub, opposes omega; while stuck it balances all other torques")
        .display_unit("mN.m").nominal(0.01).depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::output("tau_fluid", |o, _| o.tau_fluid, "N.m",
        "Torque of the whole liquid, its rigid part included, on the hub: hub.I omega_dot = tau_actuator + tau_ext + tau_friction + tau_fluid (+ tau_gravity + tau_suspension)")
        .display_unit("mN.m").nominal(0.1).depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::output("F_tangential", |o, _| o.f_tangential, "N",
        "Force of the liquid, its rigid part included, on the tank, hub frame: tangential, positive towards +theta")
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::output("F_radial", |o, _| o.f_radial, "N",
        "Force of the liquid, its rigid part included, on the tank, hub frame: radial, positive outwards")
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::output("wave_height", |o, _| o.wave_height, "m",
        "Height of the wave at the tank's wall above the surface at rest, from linear theory; above a quarter of the tank's radius an indicator rather than a height")
        .display_unit("mm").nominal(0.01)
        .depends_on(&["slosh.q_radial", "slosh.q_tangential"]).initial_depends_on(SLOSH_START),
    V::output("omega_imu", |o, _| o.omega_imu, "rad/s",
        "What a rate gyro on the hub reads: sampled, noisy, quantised; equal to omega while imu.enabled is false")
        .display_unit("deg/s").nominal(0.1).depends_on(&["omega"]).initial_depends_on(&["init.omega", "imu."]),

    // Inputs
    V::input("tau_cmd", |i, _| parts(&mut i.tau_cmd), "N.m",
        "Torque command to the actuator, positive turns the hub towards +theta; held over a step unless its derivative is set, which holds for one step")
        .display_unit("mN.m").range(-1e12, 1e12).nominal(0.1),
    V::input("tau_ext", |i, _| parts(&mut i.tau_ext), "N.m",
        "Any other torque on the hub, positive towards +theta; held over a step unless its derivative is set, which holds for one step")
        .display_unit("mN.m").range(-1e12, 1e12).nominal(0.1),
    V::input("g_axial", |i, _| parts(&mut i.g_axial), "m/s2",
        "Specific force along the tank's axis, pressing the liquid to the bottom: gravity on a bench, thrust acceleration in flight; held over a step unless its derivative is set, which holds for one step")
        .range(0.0, 1e9).nominal(10.0),

    // Locals
    V::local("slosh_rate_radial", |o, _| o.slosh_rate_radial, "rad/s",
        "Derivative of slosh_angle_radial")
        .display_unit("deg/s").depends_on(MODE_1_MOVING),
    V::local("tau_gravity", |o, _| o.tau_gravity, "N.m",
        "Torque of gravity on the dry hub of a bench that leans, to be added to the other torques on the hub; 0 while bench.tilt or hub.imbalance is 0. That on the liquid is part of tau_fluid")
        .display_unit("mN.m").depends_on(&["theta", "g_axial"]).initial_depends_on(&["hub.", "bench.", "init.theta"]),
    V::local("tau_suspension", |o, _| o.tau_suspension, "N.m",
        "Torque of the suspension line on the hub, -hub.k (theta - hub.theta_0) - hub.c omega, to be added to the other torques on the hub; 0 while hub.k and hub.c are 0")
        .display_unit("mN.m").depends_on(&["theta", "omega"]).initial_depends_on(&["hub.", "init.theta", "init.omega"]),
    V::local("energy", |o, _| o.energy, "J",
        "Kinetic and potential energy of hub, suspension line and liquid, 0 at rest on an upright bench with a line that is not twisted")
        .nominal(0.01).depends_on(ALL_TORQUES),
    V::local("momentum", |o, _| o.momentum, "kg.m2/s",
        "Angular momentum of hub and liquid about the bearing axis")
        .depends_on(HUB_AND_LIQUID),
    V::local("power_dissipated", |o, _| o.power_dissipated, "W",
        "Power dissipated by bearing, suspension line and liquid together, never negative")
        .depends_on(HEAT),
    V::local("work", |o, _| o.work, "J",
        "Work done on the hub by tau_actuator and tau_ext since the start")
        .nominal(0.01).is_state(|_| x::WORK).depends_on(&["work"]),
    V::local("heat", |o, _| o.heat, "J",
        "Energy dissipated by bearing, suspension line and liquid since the start")
        .nominal(0.01).is_state(|_| x::HEAT).depends_on(&["heat"]),
    V::local("work_axial", |o, _| o.work_axial, "J",
        "Work done on the liquid through changes of g_axial since the start: energy - energy(0) = work + work_axial - heat. Co-Simulation: exact, also for jumps; Model Exchange: added up at accepted steps, to the fourth order of their length where g_axial is linear in time")
        .nominal(0.01).depends_on(&["theta", "slosh.q_radial", "slosh.q_tangential", "g_axial"]),
    V::local_of_inputs("slosh.damping", |model, inputs, n| model.damping_ratio(n, inputs), "1",
        "Damping ratio of a mode at the present g_axial, without a baffle's; 0 for modes that are not used")
        .shape(PER_MODE).depends_on(&["g_axial"]).initial_depends_on(LIQUID),
    V::local("baffle.zeta", |o, _| o.baffle_zeta, "1",
        "Damping ratio of mode 1 by the ring baffle at the present amplitude, in addition to slosh.damping[1]; 0 without one")
        .depends_on(WAVE_1).initial_depends_on(&["baffle.", "tank.", "fluid.", "slosh.", "bench.", "init."]),
    V::local("baffle.wave", |o, _| o.baffle_wave, "m",
        "Amplitude at the wall of the oscillation of mode 1, from its angle and its rate, that baffle.zeta belongs to; 0 without a baffle")
        .display_unit("mm").nominal(0.01)
        .depends_on(WAVE_1).initial_depends_on(&["baffle.", "tank.", "fluid.", "slosh.", "bench.", "init."]),
    V::local("tau_actuator", |o, _| o.tau_actuator, "N.m",
        "Torque of the actuator on the hub, positive towards +theta: tau_cmd after the wheel's limits")
        .display_unit("mN.m").depends_on(&["tau_cmd", "wheel_speed"]),
    V::local("wheel_speed", |o, _| o.wheel_speed, "rad/s",
        "Absolute speed of the wheel's rotor; a positive tau_actuator slows it down")
        .display_unit("rpm").nominal(100.0).is_state(|_| x::WHEEL_SPEED).reinit().depends_on(&["wheel_speed"]).initial_depends_on(&["wheel.speed_0"]),
    V::local_boolean("stuck", |o, _| o.discrete.stuck,
        "The hub is held by dry friction")
        .depends_on(ALL_TORQUES),
    V::local_integer("stuck_kind", |o, _| i32::from(o.discrete.stuck),
        "stuck for hosts that misread Booleans (OpenModelica up to 1.27): 0 false, 1 true")
        .depends_on(ALL_TORQUES),
    V::local_enumeration("regime", &REGIME, |o, _| o.discrete.regime as i32,
        "How far wave_height is inside the range of linear theory")
        .depends_on(&["slosh.q_radial", "slosh.q_tangential"]),
    V::local_boolean("baffle.in_range", |o, _| o.discrete.baffle_in_range,
        "The law of the ring baffle holds: the liquid's stroke at the ring is 0.64 to 6.4 of its width, the wave does not uncover it, and it covers less than a quarter of the section; true without a baffle")
        .depends_on(WAVE_1),
    V::local_integer("baffle.in_range_kind", |o, _| i32::from(o.discrete.baffle_in_range),
        "baffle.in_range for hosts that misread Booleans (OpenModelica up to 1.27): 0 false, 1 true")
        .depends_on(WAVE_1),
    V::local_integer("friction_mode", |o, _| o.discrete.friction_mode,
        "Branch of the set-valued friction law: -1 turning backwards, 0 stuck, 1 turning forwards; 1 with other laws")
        .depends_on(ALL_TORQUES),
    V::local_integer("event_count", |o, _| o.discrete.event_count,
        "How often friction_mode has changed since the start"),
    V::local("event_time", |o, _| o.discrete.event_time, "s",
        "When friction_mode changed last"),
    V::local("stuck_time", |o, _| o.stuck_time, "s",
        "Time spent stuck since the start")
        .is_state(|_| x::STUCK_TIME).depends_on(&["stuck_time"]),

    V::state("bristle", |_| x::BRISTLE, "rad",
        "Mean deflection of the bearing's bristles; 0 with other laws than lugre")
        .nominal(1e-6).depends_on(&["bristle"]),

    // The slosh modes' coordinates: with theta, omega, work, heat, stuck_time and
    // wheel_speed the continuous states
    V::state("slosh.q_radial", |n| x::SLOSH + 4 * n, "",
        "Radial coordinate of a slosh mode, positive outwards. Models linear and planar: unused; spherical: stereographic, the tangent of half the pendulum's angle from the vertical times the direction's radial part (unit 1); paraboloid and liquid: displacement (m)")
        .shape(PER_MODE)
        .nominal(1e-3).depends_on(&["slosh.q_radial[]"]).initial_depends_on(SLOSH_START),
    V::state("slosh.q_tangential", |n| x::SLOSH + 4 * n + 1, "",
        "Tangential coordinate of a slosh mode, positive towards +theta. Models linear and planar: slosh angle (rad); spherical: stereographic, as slosh.q_radial (unit 1); paraboloid and liquid: displacement (m)")
        .shape(PER_MODE)
        .nominal(1e-3).depends_on(&["slosh.q_tangential[]"]).initial_depends_on(SLOSH_START),
    V::state("slosh.v_radial", |n| x::SLOSH + 4 * n + 2, "",
        "Derivative of slosh.q_radial; its unit is that of slosh.q_radial per second")
        .shape(PER_MODE)
        .nominal(0.01).depends_on(&["slosh.v_radial[]"]).initial_depends_on(SLOSH_START),
    V::state("slosh.v_tangential", |n| x::SLOSH + 4 * n + 3, "",
        "Derivative of slosh.q_tangential; its unit is that of slosh.q_tangential per second")
        .shape(PER_MODE)
        .nominal(0.01).depends_on(&["slosh.v_tangential[]"]).initial_depends_on(SLOSH_START),

    // The derivatives of the continuous states; a Model Exchange host has them in this
    // order
    V::derivative("der(theta)", |_| x::THETA, "rad/s",
        "Derivative of theta: omega")
        .depends_on(&["omega"]).initial_depends_on(&["init.omega"]),
    V::derivative("der(omega)", |_| x::OMEGA, "rad/s2",
        "Derivative of omega: omega_dot")
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::derivative("der(work)", |_| x::WORK, "W",
        "Derivative of work: power of tau_actuator and tau_ext")
        .depends_on(&["omega", "wheel_speed", "tau_cmd", "tau_ext"]).initial_depends_on(&["init.omega", "wheel."]),
    V::derivative("der(heat)", |_| x::HEAT, "W",
        "Derivative of heat: power_dissipated")
        .depends_on(HEAT).initial_depends_on(DYNAMICS),
    V::derivative("der(stuck_time)", |_| x::STUCK_TIME, "1",
        "Derivative of stuck_time: 1 while stuck, 0 otherwise")
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::derivative("der(wheel_speed)", |_| x::WHEEL_SPEED, "rad/s2",
        "Derivative of wheel_speed: -tau_actuator/wheel.I")
        .depends_on(&["wheel_speed", "tau_cmd"]).initial_depends_on(&["wheel."]),
    V::derivative("der(bristle)", |_| x::BRISTLE, "rad/s",
        "Derivative of bristle: omega - friction.sigma0 |omega| bristle over the dry friction")
        .depends_on(&["theta", "omega", "bristle"]).initial_depends_on(&["init.theta", "init.omega", "friction."]),
    V::derivative("der(slosh.q_radial)", |n| x::SLOSH + 4 * n, "",
        "Derivative of slosh.q_radial: slosh.v_radial")
        .shape(PER_MODE)
        .depends_on(&["slosh.v_radial[]"]).initial_depends_on(SLOSH_START),
    V::derivative("der(slosh.q_tangential)", |n| x::SLOSH + 4 * n + 1, "",
        "Derivative of slosh.q_tangential: slosh.v_tangential")
        .shape(PER_MODE)
        .depends_on(&["slosh.v_tangential[]"]).initial_depends_on(SLOSH_START),
    V::derivative("der(slosh.v_radial)", |n| x::SLOSH + 4 * n + 2, "",
        "Derivative of slosh.v_radial")
        .shape(PER_MODE)
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),
    V::derivative("der(slosh.v_tangential)", |n| x::SLOSH + 4 * n + 3, "",
        "Derivative of slosh.v_tangential")
        .shape(PER_MODE)
        .depends_on(ALL_TORQUES).initial_depends_on(DYNAMICS),

    // Hub, tank, liquid
    V::parameter("hub.I", |p, _| &mut p.hub.inertia, "kg.m2",
        "Moment of inertia of hub and dry tank about the bearing axis, without the wheel's rotor")
        .range(1e-6, 1e12),
    V::parameter("hub.imbalance", |p, _| &mut p.hub.imbalance, "kg.m",
        "Mass of hub and dry tank times the distance of its centre from the bearing axis; acts where bench.tilt is not 0")
        .range(0.0, 1e6),
    V::parameter("hub.imbalance_angle", |p, _| &mut p.hub.imbalance_angle, "rad",
        "Direction of that centre in the hub's frame, from radial towards tangential")
        .display_unit("deg").range(-7.0, 7.0),
    V::parameter("hub.k", |p, _| &mut p.hub.k, "N.m/rad",
        "Torsional stiffness of a line that the hub hangs from; 0: none")
        .range(0.0, 1e6),
    V::parameter("hub.theta_0", |p, _| &mut p.hub.theta_0, "rad",
        "The theta at which that line is not twisted")
        .display_unit("deg").range(-1e6, 1e6),
    V::parameter("hub.c", |p, _| &mut p.hub.c, "N.m.s/rad",
        "Damping coefficient of that line; unlike friction.b it acts with every friction.model")
        .range(0.0, 1e6),
    V::parameter("bench.tilt", |p, _| &mut p.bench.tilt, "rad",
        "By how much the bearing's axis leans. g_axial is the part of gravity along the axis; g_axial tan(bench.tilt) across it acts on hub and liquid and tilts the liquid's surface: the modes of a tank given by its dimensions change, those of slosh.table do not")
        .display_unit("deg").range(0.0, 1.5),
    V::parameter("bench.tilt_azimuth", |p, _| &mut p.bench.tilt_azimuth, "rad",
        "The theta at which the tank is on the lowest side: where gravity's part across the axis points to")
        .display_unit("deg").range(-7.0, 7.0),
    V::parameter("tank.d", |p, _| &mut p.tank.d, "m",
        "Inner diameter of the upright cylindrical tank")
        .display_unit("mm").range(1e-3, 100.0),
    V::parameter("tank.h", |p, _| &mut p.tank.h, "m",
        "Fill height")
        .display_unit("mm").range(1e-4, 100.0),
    V::parameter("tank.r", |p, _| &mut p.tank.r, "m",
        "Distance of the tank's axis from the bearing axis")
        .display_unit("mm").range(0.0, 1000.0),
    V::parameter("tank.I_own", |p, _| &mut p.tank.own_inertia, "kg.m2",
        "Moment of inertia of the liquid that turns with the tank about the tank's own axis; 0: an upright cylinder does not turn inviscid liquid")
        .range(0.0, 1e6),
    V::parameter("fluid.rho", |p, _| &mut p.fluid.rho, "kg/m3",
        "Density of the liquid")
        .range(1e-6, 1e5),
    V::parameter("fluid.nu", |p, _| &mut p.fluid.nu, "m2/s",
        "Kinematic viscosity of the liquid")
        .display_unit("mm2/s").range(0.0, 1.0),
    V::parameter("fluid.sigma", |p, _| &mut p.fluid.sigma, "N/m",
        "Surface tension of the liquid")
        .display_unit("mN/m").range(1e-9, 10.0),

    // Slosh model
    V::choice("slosh.model", &SLOSH_MODEL, |p, _| p.slosh.model as i32,
        |p, _, n| set_item(&mut p.slosh.model, &SloshModel::ALL, n),
        "Mechanical model of the liquid"),
    V::integer("slosh.kind", |p, _| &mut p.slosh_kind,
        "For hosts that set no enumerations: 0: as slosh.model says; otherwise the number of slosh.model's item. An error if slosh.model has been set to another one")
        .between(0, SLOSH_MODEL.items.len() as i32),
    V::choice("slosh.source", &SLOSH_SOURCE, |p, _| p.slosh.source as i32,
        |p, _, n| set_item(&mut p.slosh.source, &SloshSource::ALL, n),
        "Where the modes' masses, lengths and damping come from"),
    V::integer("slosh.source_kind", |p, _| &mut p.slosh_source_kind,
        "For hosts that set no enumerations: 0: as slosh.source says; otherwise the number of slosh.source's item. An error if slosh.source has been set to another one")
        .between(0, SLOSH_SOURCE.items.len() as i32),
    V::count("slosh.modes", |p, _| p.slosh.modes as i32, |p, _, n| p.slosh.modes = n.max(0) as usize,
        "How many slosh modes are kept; the mass of the others moves with the tank")
        .between(1, MODES as i32),
    V::switch("slosh.zeta_from_correlation", |p| &mut p.slosh.zeta_from_correlation,
        "Damping ratio of mode 1 from the correlation of Mikishev and Dorozhkin (below tank.h = tank.d/4 of Stephens), of each higher mode by its laminar layer in proportion; if false it is slosh.zeta"),
    V::integer("slosh.zeta_from_correlation_kind", |p, _| &mut p.zeta_from_correlation_kind,
        "For hosts that misread Booleans (OpenModelica up to 1.27): 0: as slosh.zeta_from_correlation says; 1 false, 2 true, whatever it says")
        .between(0, 2),
    V::parameter("slosh.zeta", |p, _| &mut p.slosh.zeta, "1",
        "Damping ratio of every mode when slosh.zeta_from_correlation is false")
        .range(0.0, 0.999),
    V::choice("slosh.damping_law", &DAMPING_LAW, |p, _| p.slosh.damping_law as i32,
        |p, _, n| set_item(&mut p.slosh.damping_law, &DampingLaw::ALL, n),
        "How damping follows g_axial: a mode's viscous coefficient against its natural frequency"),
    V::integer("slosh.damping_law_kind", |p, _| &mut p.damping_law_kind,
        "For hosts that set no enumerations: 0: as slosh.damping_law says; otherwise the number of slosh.damping_law's item. An error if slosh.damping_law has been set to another one")
        .between(0, DAMPING_LAW.items.len() as i32),
    V::parameter("slosh.zeta_amplitude", |p, _| &mut p.slosh.zeta_amplitude, "1/rad",
        "Growth of every mode's damping ratio with its amplitude A (angle and rate over natural frequency, both directions together): zeta(A) = zeta + zeta_amplitude A")
        .range(0.0, 10.0),
    V::parameter("slosh.hardening", |p, _| &mut p.slosh.hardening, "1",
        "Coefficient of the quartic spring, model paraboloid only")
        .range(0.0, 100.0),
    V::switch("slosh.capillarity", |p| &mut p.slosh.capillarity,
        "Capillarity of a flat surface with a free contact line centres the liquid; source geometry only"),
    V::integer("slosh.capillarity_kind", |p, _| &mut p.capillarity_kind,
        "For hosts that misread Booleans (OpenModelica up to 1.27): 0: as slosh.capillarity says; 1 false, 2 true, whatever it says")
        .between(0, 2),

    // The modes of a tank of any shape
    V::switch("slosh.table.one_axis", |p| &mut p.slosh.table.one_axis,
        "The modes are those along one axis of the tank, a box for example, that lies along the tangent: slosh.model = spherical and paraboloid, which move along both axes, are refused"),
    V::integer("slosh.table.one_axis_kind", |p, _| &mut p.one_axis_kind,
        "For hosts that misread Booleans (OpenModelica up to 1.27): 0: as slosh.table.one_axis says; 1 false, 2 true, whatever it says")
        .between(0, 2),
    V::parameter("slosh.table.m_liq", |p, _| &mut p.slosh.table.m_liq, "kg",
        "Mass of the liquid, source table: what exceeds the modes' masses moves with the tank. tank.d is then the diameter of the free surface and tank.h is not used")
        .range(0.0, 1e9),
    V::parameter("slosh.table.g_ref", |p, _| &mut p.slosh.table.g_ref, "m/s2",
        "Specific force along the tank's axis at which slosh.table.frequency holds and modes are ordered")
        .range(1e-9, 1e4),
    V::parameter("slosh.table.mass", |p, n| &mut p.slosh.table.mass[n], "kg",
        "Sloshing mass of a mode, source table; the first slosh.modes modes are used, in the order of their frequencies")
        .shape(TABLE_OF_MODES).range(0.0, 1e9),
    V::parameter("slosh.table.length", |p, n| &mut p.slosh.table.length[n], "m",
        "Pendulum length of a mode, source table; 0: from slosh.table.frequency")
        .shape(TABLE_OF_MODES).display_unit("mm").range(0.0, 1e4),
    V::parameter("slosh.table.frequency", |p, n| &mut p.slosh.table.frequency[n], "Hz",
        "Natural frequency of a mode at slosh.table.g_ref, source table, if slosh.table.length is 0")
        .shape(TABLE_OF_MODES).range(0.0, 1e4),
    V::parameter("slosh.table.hinge", |p, n| &mut p.slosh.table.hinge[n], "m",
        "Height of a mode's hinge on the tank's axis, source table; the motion about the bearing's axis does not depend on it")
        .shape(TABLE_OF_MODES).range(-1e6, 1e6),
    V::parameter("slosh.table.k", |p, n| &mut p.slosh.table.k[n], "N/m",
        "Centring stiffness of a mode at the bob (capillarity, diaphragm), source table")
        .shape(TABLE_OF_MODES).range(0.0, 1e9),
    V::parameter("slosh.table.zeta", |p, n| &mut p.slosh.table.zeta[n], "1",
        "Damping ratio of a mode, source table")
        .shape(TABLE_OF_MODES).range(0.0, 0.999),
    V::parameter("slosh.table.wave", |p, n| &mut p.slosh.table.wave[n], "m/rad",
        "Elevation of the surface at the wall per slosh angle, source table; 0: that of an upright cylinder of the diameter tank.d")
        .shape(TABLE_OF_MODES).range(0.0, 1e4),
    V::parameter("slosh.table.direction", |p, n| &mut p.slosh.table.direction[n], "rad",
        "Direction in which a mode moves its mass, angle from the tangent, outwards positive, source table: 0 along the tangent, 90 deg along the radius; slosh.model = linear and planar. Modes of one direction in the order of their frequencies")
        .shape(TABLE_OF_MODES).display_unit("deg").range(-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2),

    // Ring baffle
    V::parameter("baffle.width", |p, _| &mut p.baffle.width, "m",
        "Width of a flat ring at the tank's wall, whose damping of mode 1 grows with the square root of the wave's amplitude (Miles 1958); 0: none")
        .display_unit("mm").range(0.0, 100.0),
    V::parameter("baffle.depth", |p, _| &mut p.baffle.depth, "m",
        "Depth of the ring below the surface at rest")
        .display_unit("mm").range(0.0, 100.0),

    // Bearing
    V::choice("friction.model", &FRICTION_MODEL, |p, _| p.friction.model as i32,
        |p, _, n| set_item(&mut p.friction.model, &FrictionModel::ALL, n),
        "Law of the bearing's friction")
        .tunable(),
    V::integer("friction.kind", |p, _| &mut p.friction_kind,
        "For hosts that set no enumerations: 0: as friction.model says; otherwise the number of friction.model's item. An error if friction.model has been set to another one")
        .between(0, FRICTION_MODEL.items.len() as i32).tunable(),
    V::parameter("friction.b", |p, _| &mut p.friction.b, "N.m.s",
        "Viscous coefficient")
        .range(0.0, 1e6).tunable(),
    V::parameter("friction.c", |p, _| &mut p.friction.c, "N.m",
        "Coulomb torque")
        .display_unit("mN.m").range(0.0, 1e6).tunable(),
    V::parameter("friction.d", |p, _| &mut p.friction.d, "N.m",
        "Static torque in excess of the Coulomb torque")
        .display_unit("mN.m").range(0.0, 1e6).tunable(),
    V::parameter("friction.omega_s", |p, _| &mut p.friction.omega_s, "rad/s",
        "Stribeck speed: the excess falls with exp(-(omega/omega_s)^2)")
        .display_unit("deg/s").range(1e-6, 1e6).tunable(),
    V::parameter("friction.eps", |p, _| &mut p.friction.eps, "rad/s",
        "Width of the smoothed sign, model stribeck_smooth only")
        .display_unit("deg/s").range(1e-7, 1e3).tunable(),
    V::parameter("friction.sigma0", |p, _| &mut p.friction.sigma0, "N.m/rad",
        "Stiffness of the bristles, model lugre only")
        .range(1e-3, 1e9).tunable(),
    V::parameter("friction.sigma1", |p, _| &mut p.friction.sigma1, "N.m.s/rad",
        "Damping of the bristles, model lugre only; at most what keeps the bearing passive: friction.b over the relative range of dry friction")
        .range(0.0, 1e6).tunable(),
    V::parameter("friction.asymmetry", |p, _| &mut p.friction.asymmetry, "1",
        "Dry friction is 1 + asymmetry times as strong forwards and 1 - asymmetry times backwards")
        .range(-0.999, 0.999).tunable(),
    V::parameter("friction.forward_cos1", |p, _| &mut p.friction.harmonics_forward[0], "1",
        "Relative variation of dry friction with cos(theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.forward_sin1", |p, _| &mut p.friction.harmonics_forward[1], "1",
        "Relative variation of dry friction with sin(theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.forward_cos2", |p, _| &mut p.friction.harmonics_forward[2], "1",
        "Relative variation of dry friction with cos(2 theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.forward_sin2", |p, _| &mut p.friction.harmonics_forward[3], "1",
        "Relative variation of dry friction with sin(2 theta) while turning forwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.backward_cos1", |p, _| &mut p.friction.harmonics_backward[0], "1",
        "Relative variation of dry friction with cos(theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.backward_sin1", |p, _| &mut p.friction.harmonics_backward[1], "1",
        "Relative variation of dry friction with sin(theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.backward_cos2", |p, _| &mut p.friction.harmonics_backward[2], "1",
        "Relative variation of dry friction with cos(2 theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),
    V::parameter("friction.backward_sin2", |p, _| &mut p.friction.harmonics_backward[3], "1",
        "Relative variation of dry friction with sin(2 theta) while turning backwards")
        .range(-1.0, 1.0).tunable(),

    // Where the motion starts
    V::parameter("init.theta", |p, _| &mut p.init.theta, "rad",
        "Hub angle at the start")
        .display_unit("deg"),
    V::parameter("init.omega", |p, _| &mut p.init.omega, "rad/s",
        "Hub rate at the start")
        .display_unit("deg/s").range(-1e3, 1e3),
    V::parameter("init.slosh_angle", |p, _| &mut p.init.slosh_angle, "rad",
        "slosh_angle at the start. Not 0, so that with nothing set something moves; 0 to start at rest. With slosh.table.direction[1] not 0, the start has to be along it")
        .display_unit("deg").range(-1.5, 1.5),
    V::parameter("init.slosh_angle_radial", |p, _| &mut p.init.slosh_angle_radial, "rad",
        "slosh_angle_radial at the start. Models linear and planar: the radial part of a start along slosh.table.direction[1]; without effect where that is 0")
        .display_unit("deg").range(-1.5, 1.5),
    V::parameter("init.slosh_rate", |p, _| &mut p.init.slosh_rate, "rad/s",
        "slosh_rate at the start. With slosh.table.direction[1] not 0, the start has to be along it")
        .display_unit("deg/s").range(-1e3, 1e3),
    V::parameter("init.slosh_rate_radial", |p, _| &mut p.init.slosh_rate_radial, "rad/s",
        "slosh_rate_radial at the start. Models linear and planar: as init.slosh_angle_radial")
        .display_unit("deg/s").range(-1e3, 1e3),

    // Reaction wheel
    V::switch("wheel.enabled", |p| &mut p.wheel.enabled,
        "The actuator is a reaction wheel with limits; if false its torque is the command"),
    V::integer("wheel.enabled_kind", |p, _| &mut p.wheel_enabled_kind,
        "For hosts that misread Booleans (OpenModelica up to 1.27): 0: as wheel.enabled says; 1 false, 2 true, whatever it says")
        .between(0, 2),
    V::parameter("wheel.I", |p, _| &mut p.wheel.inertia, "kg.m2",
        "Moment of inertia of the rotor; hub.I does not contain it")
        .range(1e-9, 1e6),
    V::parameter("wheel.speed_0", |p, _| &mut p.wheel.speed_0, "rad/s",
        "Rotor speed at the start")
        .display_unit("rpm").range(-1e5, 1e5),
    V::parameter("wheel.speed_min", |p, _| &mut p.wheel.speed_min, "rad/s",
        "Lowest rotor speed; there only torque that speeds the rotor up is given")
        .display_unit("rpm").range(-1e5, 1e5),
    V::parameter("wheel.speed_max", |p, _| &mut p.wheel.speed_max, "rad/s",
        "Highest rotor speed; there only torque that slows the rotor down is given")
        .display_unit("rpm").range(-1e5, 1e5),
    V::parameter("wheel.tau_max", |p, _| &mut p.wheel.tau_max, "N.m",
        "Largest torque of either sign")
        .display_unit("mN.m").range(0.0, 1e6),

    // Rate gyro
    V::switch("imu.enabled", |p| &mut p.imu.enabled,
        "omega_imu is sampled, noisy and quantised; if false it equals omega"),
    V::integer("imu.enabled_kind", |p, _| &mut p.imu_enabled_kind,
        "For hosts that misread Booleans (OpenModelica up to 1.27): 0: as imu.enabled says; 1 false, 2 true, whatever it says")
        .between(0, 2),
    V::parameter("imu.rate", |p, _| &mut p.imu.rate, "Hz",
        "Sampling rate")
        .range(0.1, 1e4),
    V::parameter("imu.arw", |p, _| &mut p.imu.arw, "rad/s/sqrt(Hz)",
        "Angle random walk; the standard deviation of one sample is this times the root of imu.rate")
        .range(0.0, 10.0),
    V::parameter("imu.bias_instability", |p, _| &mut p.imu.bias_instability, "rad/s",
        "Bias instability; the bias is a first-order Gauss-Markov process of standard deviation imu.bias_instability/0.664")
        .display_unit("deg/h").range(0.0, 10.0),
    V::parameter("imu.bias_time", |p, _| &mut p.imu.bias_time, "s",
        "Correlation time of the bias")
        .range(1e-3, 1e9),
    V::parameter("imu.lsb", |p, _| &mut p.imu.lsb, "rad/s",
        "Quantisation step; 0: none")
        .display_unit("deg/s").range(0.0, 10.0),
    V::integer("imu.seed", |p, _| &mut p.imu.seed,
        "Seed of the noise: the same seed gives the same noise on every platform"),

    // Solver
    V::count("solver.max_steps", |p, _| p.solver.max_steps as i32,
        |p, _, n| p.solver.max_steps = n.max(0) as usize,
        "Internal steps, and samples of the gyro, that one communication step may take: a step that needs more is refused")
        .between(1, 1_000_000_000),

    // What follows from the parameters
    V::calculated("tank.m_liq", |m, _| m.calculated().m_liq, "kg",
        "Mass of the liquid")
        .initial_depends_on(LIQUID),
    V::calculated("tank.m_0", |m, _| m.calculated().m_0, "kg",
        "Part of the liquid's mass that moves with the tank")
        .initial_depends_on(LIQUID_MODES),
    V::calculated("tank.bond", |m, _| m.calculated().bond, "1",
        "Bond number: gravity over surface tension; the model holds far above 1")
        .depends_on(&["g_axial"]).initial_depends_on(&["tank.", "fluid."]),
    V::calculated("slosh.mass", |m, n| m.calculated().mass[n], "kg",
        "Sloshing mass of a mode, on a bench that leans of a pendulum that hangs obliquely; 0 for modes that are not used")
        .shape(PER_MODE)
        .initial_depends_on(LIQUID_MODES),
    V::calculated("slosh.length", |m, n| m.calculated().length[n], "m",
        "Pendulum length of a mode, on a bench that leans of a pendulum that hangs obliquely; 0 for modes that are not used")
        .shape(PER_MODE)
        .display_unit("mm").initial_depends_on(LIQUID_MODES),
    V::calculated("slosh.frequency", |m, n| m.calculated().frequency[n], "Hz",
        "Natural frequency of a mode in the tank at rest, at the initial g_axial; 0 for modes that are not used")
        .shape(PER_MODE)
        .depends_on(&["g_axial"]).initial_depends_on(LIQUID_MODES),
];

/// The models of the liquid.
static SLOSH_MODEL: Enumeration = Enumeration {
    name: "SloshModel",
    description: "Mechanical models of the liquid",
    items: &[
        Item::new("frozen", "The liquid is a rigid body"),
        Item::new("linear", "Linear planar pendulums"),
        Item::new("planar", "Nonlinear planar pendulums"),
        Item::new("spherical", "Spherical pendulums: the liquid can rotate"),
        Item::new("paraboloid", "Masses on a paraboloid with a quartic spring"),
        Item::new(
            "liquid",
            "The first mode of an upright cylinder to third order in its amplitude, from potential flow",
        ),
    ],
};

/// Source of the modal parameters.
static SLOSH_SOURCE: Enumeration = Enumeration {
    name: "SloshSource",
    description: "Sources of the modal parameters",
    items: &[
        Item::new("geometry", "An upright cylinder by tank.d, tank.h and fluid.rho"),
        Item::new("table", "slosh.table, for a tank of any shape"),
    ],
};

/// Dependence of damping on the natural frequency.
static DAMPING_LAW: Enumeration = Enumeration {
    name: "DampingLaw",
    description: "Viscous coefficient c of a mode against its natural frequency omega",
    items: &[
        Item::new("laminar", "c ~ sqrt(omega): a laminar layer at the wall, for bare tanks"),
        Item::new("constant_ratio", "c ~ omega: the damping ratio stays"),
        Item::new(
            "by_source",
            "laminar where the damping ratio comes from the correlation, constant_ratio where it is given",
        ),
    ],
};

/// The laws of friction.
static FRICTION_MODEL: Enumeration = Enumeration {
    name: "FrictionModel",
    description: "Laws of the bearing's friction",
    items: &[
        Item::new("none", "A free bearing"),
        Item::new("viscous", "b omega"),
        Item::new(
            "stribeck_smooth",
            "Stribeck curve, its jump at rest smoothed: creeps, never sticks",
        ),
        Item::new("stribeck", "Stribeck curve as a set-valued law: sticks"),
        Item::new("lugre", "Bristles that deflect before they slide (LuGre)"),
    ],
};

/// Amplitude class of the wave.
static REGIME: Enumeration = Enumeration {
    name: "Regime",
    description: "Wave height at the wall against the tank's radius R",
    items: &[
        Item::new("linear", "Below 0.15 R: linear theory holds"),
        Item::new("transitional", "0.15 R to 0.25 R"),
        Item::new("nonlinear", "Above 0.25 R: heights and forces are indications"),
    ],
};

pub(crate) fn set_item<T: Copy>(field: &mut T, items: &[T], number: i32) {
    if let Some(item) = usize::try_from(number).ok().and_then(|n| items.get(n.checked_sub(1)?)) {
        *field = *item;
    }
}

fn parts(ramp: &mut Ramp) -> [&mut f64; 2] {
    [&mut ramp.value, &mut ramp.slope]
}
