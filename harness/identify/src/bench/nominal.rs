//! The bench with the FMU's settings, before anything is estimated.

use anyhow::{Result, ensure};
use experiments::rest;
use formulas::cylinder::pendulum;
use host::causality::Causality;
use host::fmu::{Fmu, Instance};
use names::hubslosh::{G_AXIAL, TAU_CMD, fluid, friction, hub, slosh, tank};

use crate::tuning::COARSEST;

#[derive(Clone, Copy, Debug)]
pub struct Bench {
    /// Distance of the tank from the axis of the bearing, m (`tank.r`).
    pub arm: f64,
    pub density: f64,
    pub gravity: f64,
}

/// Parameters of the FMU whose start is estimated from the data, in the order of [`Start`].
pub const PARAMETERS: [&str; 8] = [
    tank::D,
    tank::H,
    slosh::ZETA,
    hub::I,
    friction::B,
    friction::C,
    friction::D,
    friction::OMEGA_S,
];

/// Start values for a fit of the bench in the time domain, estimated from the data; SI units.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
#[allow(missing_docs)]
pub struct Start {
    /// Length of the pendulum that is equivalent to the first mode, m.
    pub length: f64,
    /// Inertia of the first mode's mass about the hub's axis, divided by the inertia of everything that turns with the hub.
    pub mass_ratio: f64,
    /// Inertia that turns with the hub, without the mass of the first mode, kg·m².
    pub inertia: f64,
    pub d: f64,
    pub h: f64,
    pub zeta: f64,
    pub hub_inertia: f64,
    pub b: f64,
    pub c: f64,
    pub stribeck: f64,
    pub omega_s: f64,
}

impl Start {
    pub fn parameter(mut self, name: &str) -> f64 {
        *self.parameter_mut(name)
    }

    pub fn parameter_mut(&mut self, name: &str) -> &mut f64 {
        match name {
            tank::D => &mut self.d,
            tank::H => &mut self.h,
            slosh::ZETA => &mut self.zeta,
            hub::I => &mut self.hub_inertia,
            friction::B => &mut self.b,
            friction::C => &mut self.c,
            friction::D => &mut self.stribeck,
            _ => &mut self.omega_s,
        }
    }

    /// Returns the start, completed by length, mass ratio and inertia of the first mode in its tank.
    pub fn with_modes(self, bench: Bench) -> Self {
        let liquid = bench.liquid(self.d, self.h);
        let mode = pendulum(0, self.d, self.h, liquid);
        let inertia = self.hub_inertia + bench.inertia(liquid - mode.mass);
        let mass_ratio = bench.inertia(mode.mass) / inertia;
        Start { length: mode.length, mass_ratio, inertia, ..self }
    }

    pub fn line(&self) -> String {
        format!(
            "d {:.4} m, h {:.4} m, damping ratio {:.4}, hub.I {:.4} kg·m²",
            self.d, self.h, self.zeta, self.hub_inertia
        )
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Nominal {
    pub bench: Bench,
    pub start: Start,
    /// Inertia of the hub with all liquid as a rigid body, kg·m².
    pub inertia: f64,
    /// Period of the first slosh mode, s.
    pub period: f64,
}

/// Returns an instance of the FMU that is initialised with these settings.
///
/// # Errors
/// If a name is neither a parameter nor an input, or the FMU refuses a value.
pub fn initialised<'fmu>(fmu: &'fmu Fmu, settings: &[(String, String)]) -> Result<Instance<'fmu>> {
    let mut instance = rest::instantiate(fmu, "identify")?;
    for (name, value) in settings {
        let variable = fmu.description().variable(name)?;
        ensure!(
            matches!(variable.causality, Causality::Parameter | Causality::Input)
                && name != TAU_CMD,
            "{name} cannot be set: it is not a parameter"
        );
        instance.set(name, value)?;
    }
    instance.enter_initialization_mode(None, 0.0, None)?;
    Ok(instance)
}

pub fn warnings(fmu: &Fmu, settings: &[(String, String)]) -> Result<Vec<String>> {
    let mut instance = initialised(fmu, settings)?;
    instance.exit_initialization_mode()?;
    Ok(instance.take_warnings())
}

/// Adds `slosh.zeta_from_correlation = false` to settings that have `slosh.zeta`, because the damping ratio has no effect
/// otherwise. Settings that have `slosh.zeta_from_correlation` stay as they are.
pub fn with_damping(mut settings: Vec<(String, String)>) -> Vec<(String, String)> {
    const CORRELATION: &str = slosh::ZETA_FROM_CORRELATION;
    let has = |name: &str| settings.iter().any(|(n, _)| n == name);
    if has(slosh::ZETA) && !has(CORRELATION) {
        settings.push((CORRELATION.into(), "false".into()));
    }
    settings
}

impl Bench {
    pub fn liquid(self, d: f64, h: f64) -> f64 {
        self.density * std::f64::consts::PI / 4.0 * d * d * h
    }

    pub fn slosh_mass(self, d: f64, h: f64) -> f64 {
        pendulum(0, d, h, self.liquid(d, h)).mass
    }

    /// Returns the moment of inertia about the hub's axis, kg·m², of a mass (kg) in the tank.
    pub fn inertia(self, mass: f64) -> f64 {
        mass * self.arm.powi(2)
    }
}

impl Nominal {
    /// Reads the nominal bench from the FMU with these settings and the `expected` values of estimated parameters.
    pub fn of(
        fmu: &Fmu,
        settings: &[(String, String)],
        expected: &[(String, f64)],
    ) -> Result<Nominal> {
        let expected = expected.iter().map(|(name, value)| (name.clone(), value.to_string()));
        let all: Vec<(String, String)> = settings.iter().cloned().chain(expected).collect();
        let mut instance = initialised(fmu, &all)?;
        let mut real = |name: &str| instance.real(name);
        let bench =
            Bench { arm: real(tank::R)?, density: real(fluid::RHO)?, gravity: real(G_AXIAL)? };
        let mut start = Start::default();
        for name in PARAMETERS {
            *start.parameter_mut(name) = real(name)?;
        }
        start.zeta = real(&slosh::DAMPING.element([1]))?;
        let start = start.with_modes(bench);
        let inertia = start.hub_inertia + bench.inertia(bench.liquid(start.d, start.h));
        Ok(Nominal { bench, start, inertia, period: 1.0 / real(&slosh::FREQUENCY.element([1]))? })
    }

    /// Returns the longest mean time between rows with which this bench can be identified, s: a fifth of the slosh period.
    pub fn coarsest(&self) -> f64 {
        (self.period / 5.0).max(COARSEST)
    }
}
