//! The FMU's answer to a recording's torque, at the recording's instants.

use anyhow::{Context, Result};
use host::fmi2::{Fmu, Instance};

use crate::recording::Recording;

/// Instants closer than this are the same, s.
const SAME: f64 = 1e-9;

/// Hub rate and acceleration at the rows of a recording.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// rad/s.
    pub rate: Vec<f64>,
    /// rad/s².
    pub acceleration: Vec<f64>,
}

/// How the FMU is set up and driven.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Values by FMU name, as text, set first.
    pub settings: Vec<(String, String)>,
    /// Torque is held from row to row (else it is linear between them).
    pub held: bool,
}

impl Setup {
    /// Runs the FMU with these real parameters, by name, through a recording. `delay` (s) lies
    /// between the recorded torque and the recorded rate: row k sees the FMU at t_k − delay. It is
    /// stepped to these instants and to those where the torque changes, so nothing is interpolated.
    pub fn run(
        &self,
        fmu: &Fmu,
        values: &[(&str, f64)],
        recording: &Recording,
        delay: f64,
    ) -> Result<Motion> {
        let reference =
            |name: &str| Ok::<_, anyhow::Error>(fmu.description().variable(name)?.reference);
        let mut instance = fmu.instantiate("identify")?;
        for (name, value) in &self.settings {
            instance.set(name, value)?;
        }
        for (name, value) in values {
            instance.set_real(&[reference(name)?], &[*value])?;
        }
        let torque = [reference("tau_cmd")?];
        let wanted = [reference("omega")?, reference("omega_dot")?];
        let start = recording.time[0];
        instance.setup_experiment(None, start, None)?;
        instance.enter_initialization_mode()?;
        instance.set_real(&torque, &[recording.torque[0]])?;
        instance.exit_initialization_mode()?;
        self.drive(&mut instance, torque, wanted, recording, delay)
    }

    fn drive(
        &self,
        instance: &mut Instance,
        torque: [u32; 1],
        wanted: [u32; 2],
        recording: &Recording,
        delay: f64,
    ) -> Result<Motion> {
        let (time, tau) = (&recording.time, &recording.torque);
        let mut motion = Motion::default();
        let (mut t, mut knot) = (time[0], 0);
        for &row in time {
            let target = row - delay;
            while t < target - SAME {
                let end = time.get(knot + 1).copied().unwrap_or(f64::INFINITY);
                let next = if end < target + SAME { end } else { target };
                let slope = match time.get(knot + 1) {
                    Some(end) if !self.held => (tau[knot + 1] - tau[knot]) / (end - time[knot]),
                    _ => 0.0,
                };
                instance
                    .set_real(&torque, &[tau[knot] + slope * (t - time[knot])])
                    .and_then(|()| {
                        if self.held {
                            return Ok(());
                        }
                        instance.set_real_input_derivatives(&torque, &[1], &[slope])
                    })
                    .and_then(|()| instance.do_step(t, next - t))
                    .with_context(|| format!("the FMU stopped at t = {t} s"))?;
                t = next;
                if t >= end {
                    knot += 1;
                }
            }
            let mut values = [0.0; 2];
            instance.get_real(&wanted, &mut values)?;
            motion.rate.push(values[0]);
            motion.acceleration.push(values[1]);
        }
        Ok(motion)
    }
}
