//! Names of Spacecraft.fmu. Written by `cargo run --release -p model-description`; do not edit.

pub const Q: crate::Array<1> = crate::Array("q");
pub const OMEGA: crate::Array<1> = crate::Array("omega");
pub const OMEGA_DOT: crate::Array<1> = crate::Array("omega_dot");
pub const SPECIFIC_FORCE: crate::Array<1> = crate::Array("specific_force");
pub const POSITION: crate::Array<1> = crate::Array("position");
pub const VELOCITY: crate::Array<1> = crate::Array("velocity");
pub const SLOSH_FORCE: crate::Array<1> = crate::Array("slosh_force");
pub const SLOSH_TORQUE: crate::Array<1> = crate::Array("slosh_torque");
pub const FORCE: crate::Array<1> = crate::Array("force");
pub const TORQUE: crate::Array<1> = crate::Array("torque");
pub const H_WHEELS: crate::Array<1> = crate::Array("h_wheels");
pub const MASS_FLOW: crate::Array<1> = crate::Array("mass_flow");
pub const MOMENTUM: crate::Array<1> = crate::Array("momentum");
pub const ANGULAR_MOMENTUM: crate::Array<1> = crate::Array("angular_momentum");
pub const ENERGY: &str = "energy";
pub const WORK: &str = "work";
pub const DISSIPATED: &str = "dissipated";
pub const DRAINED: &str = "drained";
pub const MASS: &str = "mass";
pub const CENTER_OF_MASS: crate::Array<1> = crate::Array("center_of_mass");
pub const INERTIA: crate::Array<2> = crate::Array("inertia");
pub const MOUNT: &str = "mount";
pub const MOUNT_KIND: &str = "mount_kind";
pub const GRAVITY: crate::Array<1> = crate::Array("gravity");
pub const TANKS: &str = "tanks";
pub const MOST_TANKS: usize = 4;
pub const APPENDAGES: &str = "appendages";
pub const MOST_APPENDAGES: usize = 6;

pub mod pivot {
    pub const TORQUE: crate::Array<1> = crate::Array("pivot.torque");
    pub const K: crate::Array<1> = crate::Array("pivot.k");
    pub const C: crate::Array<1> = crate::Array("pivot.c");

    pub mod friction {
        pub const C: crate::Array<1> = crate::Array("pivot.friction.c");
        pub const D: crate::Array<1> = crate::Array("pivot.friction.d");
        pub const OMEGA_S: &str = "pivot.friction.omega_s";
        pub const EPS: &str = "pivot.friction.eps";
    }
}

pub mod tank {
    pub const FORCE: crate::Array<2> = crate::Array("tank[].force");
    pub const TORQUE: crate::Array<2> = crate::Array("tank[].torque");
    pub const WAVE_HEIGHT: crate::Array<1> = crate::Array("tank[].wave_height");
    pub const REGIME: crate::Array<1> = crate::Array("tank[].regime");
    pub const IN_RANGE: crate::Array<1> = crate::Array("tank[].in_range");
    pub const IN_RANGE_KIND: crate::Array<1> = crate::Array("tank[].in_range_kind");
    pub const LIMITED_BY: crate::Array<1> = crate::Array("tank[].limited_by");
    pub const LIMITED_BY_KIND: crate::Array<1> = crate::Array("tank[].limited_by_kind");
    pub const SPIN_RATIO: crate::Array<1> = crate::Array("tank[].spin_ratio");
    pub const SPIN_NUMBER: crate::Array<1> = crate::Array("tank[].spin_number");
    pub const ANGLE_X: crate::Array<2> = crate::Array("tank[].angle_x");
    pub const ANGLE_Y: crate::Array<2> = crate::Array("tank[].angle_y");
    pub const P: crate::Array<3> = crate::Array("tank[].p");
    pub const P_DOT: crate::Array<3> = crate::Array("tank[].p_dot");
    pub const SPIN: crate::Array<2> = crate::Array("tank[].spin");
    pub const LIQUID: crate::Array<1> = crate::Array("tank[].liquid");
    pub const POSITION: crate::Array<2> = crate::Array("tank[].position");
    pub const Q: crate::Array<2> = crate::Array("tank[].q");
    pub const DIAMETER: crate::Array<1> = crate::Array("tank[].diameter");
    pub const DEPTH: crate::Array<1> = crate::Array("tank[].depth");
    pub const DENSITY: crate::Array<1> = crate::Array("tank[].density");
    pub const M_0: crate::Array<1> = crate::Array("tank[].m_0");
    pub const H_0: crate::Array<1> = crate::Array("tank[].H_0");
    pub const I_0: crate::Array<1> = crate::Array("tank[].I_0");
    pub const I_Z: crate::Array<1> = crate::Array("tank[].I_z");
    pub const R_0: crate::Array<2> = crate::Array("tank[].r_0");
    pub const DI_Y: crate::Array<1> = crate::Array("tank[].dI_y");
    pub const I_XY: crate::Array<1> = crate::Array("tank[].I_xy");
    pub const I_XZ: crate::Array<1> = crate::Array("tank[].I_xz");
    pub const I_YZ: crate::Array<1> = crate::Array("tank[].I_yz");
    pub const MODES: crate::Array<1> = crate::Array("tank[].modes");
    pub const MOST_MODES: usize = 3;
    pub const G_REF: crate::Array<1> = crate::Array("tank[].g_ref");
    pub const MASS: crate::Array<2> = crate::Array("tank[].mass");
    pub const LENGTH: crate::Array<2> = crate::Array("tank[].length");
    pub const FREQUENCY: crate::Array<2> = crate::Array("tank[].frequency");
    pub const HINGE: crate::Array<2> = crate::Array("tank[].hinge");
    pub const DIRECTION: crate::Array<3> = crate::Array("tank[].direction");
    pub const ARM: crate::Array<2> = crate::Array("tank[].arm");
    pub const K: crate::Array<2> = crate::Array("tank[].k");
    pub const ZETA: crate::Array<2> = crate::Array("tank[].zeta");
    pub const DAMPING_LAW: crate::Array<1> = crate::Array("tank[].damping_law");
    pub const DAMPING_LAW_KIND: crate::Array<1> = crate::Array("tank[].damping_law_kind");
    pub const G_FLOOR: crate::Array<1> = crate::Array("tank[].g_floor");
    pub const ZETA_AMPLITUDE: crate::Array<2> = crate::Array("tank[].zeta_amplitude");
    pub const ZETA_BREAKING: crate::Array<2> = crate::Array("tank[].zeta_breaking");
    pub const BREAKING_STEEPNESS: crate::Array<2> = crate::Array("tank[].breaking_steepness");
    pub const NONLINEAR_INERTIA: crate::Array<2> = crate::Array("tank[].nonlinear_inertia");
    pub const NONLINEAR_STIFFNESS: crate::Array<2> = crate::Array("tank[].nonlinear_stiffness");
    pub const NONLINEAR_INERTIA_2: crate::Array<2> = crate::Array("tank[].nonlinear_inertia_2");
    pub const NONLINEAR_STIFFNESS_2: crate::Array<2> = crate::Array("tank[].nonlinear_stiffness_2");
    pub const ROTARY_INERTIA: crate::Array<2> = crate::Array("tank[].rotary_inertia");
    pub const ROTARY_INERTIA_2: crate::Array<2> = crate::Array("tank[].rotary_inertia_2");
    pub const GYROSCOPIC: crate::Array<2> = crate::Array("tank[].gyroscopic");
    pub const GYROSCOPIC_STIFFNESS: crate::Array<2> = crate::Array("tank[].gyroscopic_stiffness");
    pub const ANGLE_LIMIT: crate::Array<2> = crate::Array("tank[].angle_limit");
    pub const SWIRL_LIMIT: crate::Array<2> = crate::Array("tank[].swirl_limit");
    pub const G_BOND: crate::Array<1> = crate::Array("tank[].g_bond");
    pub const WAVE: crate::Array<2> = crate::Array("tank[].wave");
    pub const SPIN_INERTIA: crate::Array<1> = crate::Array("tank[].spin_inertia");
    pub const SPIN_INERTIA_ACROSS: crate::Array<1> = crate::Array("tank[].spin_inertia_across");
    pub const SPIN_COUPLING: crate::Array<1> = crate::Array("tank[].spin_coupling");
    pub const SPIN_DECAY: crate::Array<2> = crate::Array("tank[].spin_decay");
    pub const SLIP_0: crate::Array<2> = crate::Array("tank[].slip_0");
    pub const LIQUID_0: crate::Array<1> = crate::Array("tank[].liquid_0");
    pub const OUTLET: crate::Array<1> = crate::Array("tank[].outlet");
    pub const P_0: crate::Array<3> = crate::Array("tank[].p_0");
    pub const P_DOT_0: crate::Array<3> = crate::Array("tank[].p_dot_0");

    pub mod ball {
        pub const STATE: crate::Array<1> = crate::Array("tank[].ball.state");
        pub const POSITION: crate::Array<2> = crate::Array("tank[].ball.position");
        pub const VELOCITY: crate::Array<2> = crate::Array("tank[].ball.velocity");
        pub const TRAVEL: crate::Array<1> = crate::Array("tank[].ball.travel");
        pub const RADIUS: crate::Array<1> = crate::Array("tank[].ball.radius");
        pub const RESTITUTION: crate::Array<1> = crate::Array("tank[].ball.restitution");
        pub const CONTACT_SPEED: crate::Array<1> = crate::Array("tank[].ball.contact_speed");
        pub const DRAG: crate::Array<1> = crate::Array("tank[].ball.drag");
    }

    pub mod fill {
        pub const POINTS: crate::Array<1> = crate::Array("tank[].fill.points");
        pub const MOST_POINTS: usize = 12;
        pub const LIQUID: crate::Array<2> = crate::Array("tank[].fill.liquid");
        pub const H_0: crate::Array<2> = crate::Array("tank[].fill.H_0");
        pub const I_0: crate::Array<2> = crate::Array("tank[].fill.I_0");
        pub const I_Z: crate::Array<2> = crate::Array("tank[].fill.I_z");
        pub const MASS: crate::Array<3> = crate::Array("tank[].fill.mass");
        pub const LENGTH: crate::Array<3> = crate::Array("tank[].fill.length");
        pub const HINGE: crate::Array<3> = crate::Array("tank[].fill.hinge");
        pub const ZETA: crate::Array<3> = crate::Array("tank[].fill.zeta");
        pub const NONLINEAR_INERTIA: crate::Array<3> =
            crate::Array("tank[].fill.nonlinear_inertia");
        pub const NONLINEAR_STIFFNESS: crate::Array<3> =
            crate::Array("tank[].fill.nonlinear_stiffness");
        pub const ANGLE_LIMIT: crate::Array<3> = crate::Array("tank[].fill.angle_limit");
        pub const SWIRL_LIMIT: crate::Array<3> = crate::Array("tank[].fill.swirl_limit");
    }
}

pub mod appendage {
    pub const ETA: crate::Array<1> = crate::Array("appendage[].eta");
    pub const ETA_DOT: crate::Array<1> = crate::Array("appendage[].eta_dot");
    pub const POSITION: crate::Array<2> = crate::Array("appendage[].position");
    pub const FREQUENCY: crate::Array<1> = crate::Array("appendage[].frequency");
    pub const ZETA: crate::Array<1> = crate::Array("appendage[].zeta");
    pub const PARTICIPATION: crate::Array<2> = crate::Array("appendage[].participation");
    pub const ETA_0: crate::Array<1> = crate::Array("appendage[].eta_0");
    pub const ETA_DOT_0: crate::Array<1> = crate::Array("appendage[].eta_dot_0");
}

pub mod craft {
    pub const MASS: &str = "craft.mass";
    pub const R: crate::Array<1> = crate::Array("craft.r");
    pub const JXX: &str = "craft.Jxx";
    pub const JYY: &str = "craft.Jyy";
    pub const JZZ: &str = "craft.Jzz";
    pub const JXY: &str = "craft.Jxy";
    pub const JXZ: &str = "craft.Jxz";
    pub const JYZ: &str = "craft.Jyz";
}

pub mod init {
    pub const Q: crate::Array<1> = crate::Array("init.q");
    pub const OMEGA: crate::Array<1> = crate::Array("init.omega");
    pub const POSITION: crate::Array<1> = crate::Array("init.position");
    pub const VELOCITY: crate::Array<1> = crate::Array("init.velocity");
}

pub mod solver {
    pub const MAX_STEPS: &str = "solver.max_steps";
}

/// Parameters that determine the sizes of arrays.
#[rustfmt::skip]
pub const SIZES: &[crate::Size] = &[
    crate::Size {
        parameter: "tanks",
        most: 4,
        has_indicators: true,
        arrays: &[
            ("mass_flow", 0), ("tank[].force", 0), ("tank[].torque", 0), ("tank[].wave_height", 0),
            ("tank[].regime", 0), ("tank[].in_range", 0), ("tank[].in_range_kind", 0),
            ("tank[].limited_by", 0), ("tank[].limited_by_kind", 0), ("tank[].spin_ratio", 0),
            ("tank[].spin_number", 0), ("tank[].ball.state", 0), ("tank[].angle_x", 0),
            ("tank[].angle_y", 0), ("tank[].p", 0), ("tank[].p_dot", 0),
            ("tank[].ball.position", 0), ("tank[].ball.velocity", 0), ("tank[].spin", 0),
            ("tank[].liquid", 0), ("der(tank[].liquid)", 0), ("der(tank[].p)", 0),
            ("der(tank[].p_dot)", 0), ("der(tank[].ball.position)", 0),
            ("der(tank[].ball.velocity)", 0), ("der(tank[].spin)", 0), ("tank[].position", 0),
            ("tank[].q", 0), ("tank[].diameter", 0), ("tank[].depth", 0), ("tank[].density", 0),
            ("tank[].m_0", 0), ("tank[].H_0", 0), ("tank[].I_0", 0), ("tank[].I_z", 0),
            ("tank[].r_0", 0), ("tank[].dI_y", 0), ("tank[].I_xy", 0), ("tank[].I_xz", 0),
            ("tank[].I_yz", 0), ("tank[].modes", 0), ("tank[].g_ref", 0), ("tank[].mass", 0),
            ("tank[].length", 0), ("tank[].frequency", 0), ("tank[].hinge", 0),
            ("tank[].direction", 0), ("tank[].arm", 0), ("tank[].k", 0), ("tank[].zeta", 0),
            ("tank[].damping_law", 0), ("tank[].damping_law_kind", 0), ("tank[].g_floor", 0),
            ("tank[].zeta_amplitude", 0), ("tank[].zeta_breaking", 0),
            ("tank[].breaking_steepness", 0), ("tank[].nonlinear_inertia", 0),
            ("tank[].nonlinear_stiffness", 0), ("tank[].nonlinear_inertia_2", 0),
            ("tank[].nonlinear_stiffness_2", 0), ("tank[].rotary_inertia", 0),
            ("tank[].rotary_inertia_2", 0), ("tank[].gyroscopic", 0),
            ("tank[].gyroscopic_stiffness", 0), ("tank[].angle_limit", 0),
            ("tank[].swirl_limit", 0), ("tank[].g_bond", 0), ("tank[].wave", 0),
            ("tank[].ball.travel", 0), ("tank[].ball.radius", 0), ("tank[].ball.restitution", 0),
            ("tank[].ball.contact_speed", 0), ("tank[].ball.drag", 0), ("tank[].spin_inertia", 0),
            ("tank[].spin_inertia_across", 0), ("tank[].spin_coupling", 0),
            ("tank[].spin_decay", 0), ("tank[].slip_0", 0), ("tank[].fill.points", 0),
            ("tank[].liquid_0", 0), ("tank[].outlet", 0), ("tank[].fill.liquid", 0),
            ("tank[].fill.H_0", 0), ("tank[].fill.I_0", 0), ("tank[].fill.I_z", 0),
            ("tank[].fill.mass", 0), ("tank[].fill.length", 0), ("tank[].fill.hinge", 0),
            ("tank[].fill.zeta", 0), ("tank[].fill.nonlinear_inertia", 0),
            ("tank[].fill.nonlinear_stiffness", 0), ("tank[].fill.angle_limit", 0),
            ("tank[].fill.swirl_limit", 0), ("tank[].p_0", 0), ("tank[].p_dot_0", 0),
        ],
    },
    crate::Size {
        parameter: "tank[].modes",
        most: 3,
        has_indicators: false,
        arrays: &[
            ("tank[].angle_x", 1), ("tank[].angle_y", 1), ("tank[].p", 1), ("tank[].p_dot", 1),
            ("der(tank[].p)", 1), ("der(tank[].p_dot)", 1), ("tank[].mass", 1),
            ("tank[].length", 1), ("tank[].frequency", 1), ("tank[].hinge", 1),
            ("tank[].direction", 1), ("tank[].arm", 1), ("tank[].k", 1), ("tank[].zeta", 1),
            ("tank[].zeta_amplitude", 1), ("tank[].zeta_breaking", 1),
            ("tank[].breaking_steepness", 1), ("tank[].nonlinear_inertia", 1),
            ("tank[].nonlinear_stiffness", 1), ("tank[].nonlinear_inertia_2", 1),
            ("tank[].nonlinear_stiffness_2", 1), ("tank[].rotary_inertia", 1),
            ("tank[].rotary_inertia_2", 1), ("tank[].gyroscopic", 1),
            ("tank[].gyroscopic_stiffness", 1), ("tank[].angle_limit", 1),
            ("tank[].swirl_limit", 1), ("tank[].wave", 1), ("tank[].fill.mass", 1),
            ("tank[].fill.length", 1), ("tank[].fill.hinge", 1), ("tank[].fill.zeta", 1),
            ("tank[].fill.nonlinear_inertia", 1), ("tank[].fill.nonlinear_stiffness", 1),
            ("tank[].fill.angle_limit", 1), ("tank[].fill.swirl_limit", 1), ("tank[].p_0", 1),
            ("tank[].p_dot_0", 1),
        ],
    },
    crate::Size {
        parameter: "appendages",
        most: 6,
        has_indicators: false,
        arrays: &[
            ("appendage[].eta", 0), ("appendage[].eta_dot", 0), ("der(appendage[].eta)", 0),
            ("der(appendage[].eta_dot)", 0), ("appendage[].position", 0),
            ("appendage[].frequency", 0), ("appendage[].zeta", 0),
            ("appendage[].participation", 0), ("appendage[].eta_0", 0),
            ("appendage[].eta_dot_0", 0),
        ],
    },
];

enumeration! {
    Regime: Linear = 1 "linear", Transitional = 2 "transitional", Nonlinear = 3 "nonlinear"
}

enumeration! {
    LimitedBy: None = 1 "none", ThirdOrder = 2 "third_order", Breaking = 3 "breaking", SecondaryResonance = 4 "secondary_resonance", Spin = 5 "spin", BondNumber = 6 "bond_number", Empty = 7 "empty", Contact = 8 "contact"
}

enumeration! {
    BallState: Settled = 1 "settled", Flying = 2 "flying", Sliding = 3 "sliding"
}

enumeration! {
    Mount: Free = 1 "free", Pivot = 2 "pivot"
}

enumeration! {
    DampingLaw: Laminar = 1 "laminar", ConstantRatio = 2 "constant_ratio", Constant = 3 "constant"
}
