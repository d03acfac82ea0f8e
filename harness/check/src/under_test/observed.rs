//! Compares the quantities that an event may change before and after an event.

use anyhow::Result;
use host::causality::{Causality, Variability};
use host::description::Value;

use super::{Session, UnderTest};
use crate::description::Variable;

/// Relative change of a value at an event below which the change counts as rounding.
const ROUNDING: f64 = 1e-9;
/// Relative change of a derivative below which an event counts as not having changed it, because the error of an
/// iterative solver in the FMU can have this size.
const ITERATED: f64 = 1e-2;

pub struct Observed {
    states: Vec<f64>,
    derivatives: Vec<f64>,
    discrete: Vec<Vec<Value>>,
}

fn discrete(fmu: &UnderTest) -> impl Iterator<Item = &Variable> {
    let computed = |v: &&Variable| matches!(v.causality, Causality::Output | Causality::Local);
    fmu.variables().iter().filter(computed).filter(|v| v.variability == Variability::Discrete)
}

impl Observed {
    pub fn read(session: &mut Session) -> Result<Observed> {
        let (states, derivatives) = (session.states()?, session.derivatives()?);
        let discrete = discrete(session.fmu).map(|v| session.read(v)).collect::<Result<_>>()?;
        Ok(Observed { states, derivatives, discrete })
    }

    pub fn change<'f>(&self, after: &Observed, fmu: &'f UnderTest) -> Option<(&'f str, String)> {
        let jumps = |a: f64, b: f64, share: f64, size: f64| {
            (a - b).abs() > share * a.abs().max(b.abs()).max(size)
        };
        for (v, (a, b)) in discrete(fmu).zip(self.discrete.iter().zip(&after.discrete)) {
            let same = match (&a[0], &b[0]) {
                (Value::Real(a), Value::Real(b)) => !jumps(*a, *b, ROUNDING, 1e-3 * v.nominal()),
                (a, b) => a.is_identical(b),
            };
            if !same {
                return Some((&v.name, format!("{} to {}", a[0], b[0])));
            }
        }
        for (n, (derivative, state)) in fmu.states().into_iter().enumerate() {
            let (a, b) = (self.states[n], after.states[n]);
            if jumps(a, b, ROUNDING, 1e-3 * state.nominal()) {
                return Some((&state.name, format!("{a:?} to {b:?}")));
            }
            let (a, b) = (self.derivatives[n], after.derivatives[n]);
            if jumps(a, b, ITERATED, 1e-3 * derivative.nominal()) {
                return Some((&derivative.name, format!("{a:?} to {b:?}")));
            }
        }
        None
    }
}
