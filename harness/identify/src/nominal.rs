//! The bench as the FMU is set up, before anything is estimated.

use anyhow::{Result, ensure};
use host::fmi2::Fmu;

/// What is known of the bench without the recording.
#[derive(Clone, Copy, Debug)]
pub struct Bench {
    /// tank.r, m.
    pub arm: f64,
    /// fluid.rho, kg/m³.
    pub density: f64,
    /// g_axial, m/s².
    pub gravity: f64,
}

/// What is estimated of the bench in the time domain, where a search starts; SI units.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[allow(missing_docs)]
pub struct Start {
    pub d: f64,
    pub h: f64,
    pub zeta: f64,
    pub hub_inertia: f64,
    pub b: f64,
    pub c: f64,
    pub stribeck: f64,
    pub omega_s: f64,
}

/// What the FMU says of the bench.
#[derive(Clone, Copy, Debug)]
pub struct Nominal {
    /// What recordings of torque and rate do not tell.
    pub bench: Bench,
    /// Its parameters.
    pub start: Start,
    /// Inertia of hub and liquid, kg·m².
    pub inertia: f64,
    /// Period of the first slosh mode, s.
    pub period: f64,
}

impl Nominal {
    /// Of the FMU with settings, and with what is `expected` of parameters that are estimated.
    pub fn of(
        fmu: &Fmu,
        settings: &[(String, String)],
        expected: &[(String, f64)],
    ) -> Result<Nominal> {
        let mut instance = fmu.instantiate("identify")?;
        for (name, value) in settings {
            let variable = fmu.description().variable(name)?;
            ensure!(
                matches!(variable.causality.as_str(), "parameter" | "input") && name != "tau_cmd",
                "{name} cannot be set: it is no parameter"
            );
            instance.set(name, value)?;
        }
        for (name, value) in expected {
            instance.set(name, &value.to_string())?;
        }
        instance.setup_experiment(None, 0.0, None)?;
        instance.enter_initialization_mode()?;
        let mut real = |name: &str| instance.real(name);
        let bench =
            Bench { arm: real("tank.r")?, density: real("fluid.rho")?, gravity: real("g_axial")? };
        let start = Start {
            d: real("tank.d")?,
            h: real("tank.h")?,
            zeta: real("slosh.damping[1]")?,
            hub_inertia: real("hub.I")?,
            b: real("friction.b")?,
            c: real("friction.c")?,
            stribeck: real("friction.d")?,
            omega_s: real("friction.omega_s")?,
        };
        let liquid = bench.density * std::f64::consts::PI / 4.0 * start.d * start.d * start.h;
        let inertia = start.hub_inertia + liquid * bench.arm.powi(2);
        Ok(Nominal { bench, start, inertia, period: 1.0 / real("slosh.frequency[1]")? })
    }

    /// Longest mean time between rows with which this bench can be identified, s: a few rows a period.
    pub fn coarsest(&self) -> f64 {
        (self.period / 5.0).max(COARSEST)
    }
}

/// [`Nominal::coarsest`] for any bench on the ground, s: slosh at 2.4 Hz needs more than two rows a period.
pub const COARSEST: f64 = 0.2;
