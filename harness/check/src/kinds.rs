//! Rules of the attribute dependenciesKind (FMI 2.0.5, section 2.2.8), compared with the binary.
//!
//! The kind `dependent` promises nothing. Every other kind promises that the unknown is a linear function of the known,
//! with a factor that never changes (`constant`), or that changes only before initialisation has ended (`fixed`), when
//! a tunable parameter is set (`tunable`), or at events (`discrete`). The rules measure the factor by small and by
//! large finite differences, at several states and parameters.

use std::collections::BTreeSet;

use anyhow::Result;

use super::dependencies::random_session;
use super::description::{Unknown, Variable};
use super::findings::Findings;
use super::under_test::{FmuUnderTest, Interface, Session};
use host::description::Value;

const STARTS: u64 = 12;
/// Largest relative difference at which two measured factors count as equal. A factor is the derivative of an unknown
/// with respect to a known.
const AGREE: f64 = 1e-4;

struct Pair<'d> {
    list: &'static str,
    line: u64,
    unknown: &'d Variable,
    known: &'d Variable,
    kind: &'d str,
}

impl Pair<'_> {
    fn report(&self, findings: &mut Findings, a: Factor, b: Factor, when: &str) {
        findings.at(format!("line {}, {}, {}", self.line, self.list, self.unknown.name)).add(format!(
                "dependenciesKind of {} is {}, but the factor is {:.6e} and {:.6e} {when} (allowed: \
                 one factor, or \"dependent\")",
                self.known.name, self.kind, a.value, b.value
            ));
    }
}

fn pairs<'d>(
    fmu: &'d FmuUnderTest,
    list: &'static str,
    unknowns: impl Iterator<Item = &'d Unknown>,
) -> Vec<Pair<'d>> {
    let d = fmu.description;
    let mut pairs = Vec::new();
    for u in unknowns {
        let Some(unknown) = d.variable_of(u).filter(|v| v.is_continuous()) else { continue };
        let knowns = u.dependencies.iter().flatten().zip(u.kinds.iter().flatten());
        for (known, kind) in knowns.filter(|(_, kind)| *kind != "dependent") {
            let Some(known) = d.at(*known).filter(|v| v.is_real()) else { continue };
            pairs.push(Pair { list, line: u.line, unknown, known, kind });
        }
    }
    pairs
}

#[derive(Clone, Copy)]
struct Factor {
    value: f64,
    rounding: f64,
}

impl Factor {
    fn differs(&self, other: &Factor) -> bool {
        let allowed = AGREE * self.value.abs().max(other.value.abs());
        (self.value - other.value).abs() > allowed + self.rounding + other.rounding
    }
}

/// Sets a known variable to `x`. Returns false if the FMU refuses or changes the value.
fn set_known(session: &mut Session, known: &Variable, x: f64) -> Result<bool> {
    let fmu = session.fmu;
    if session.using.interface == Interface::ModelExchange
        && let Some(n) = fmu.states().iter().position(|(_, state)| state.key == known.key)
    {
        let mut all = session.states()?;
        all[n] = x;
        return Ok(session.instance.set_continuous_states(&all).is_ok());
    }
    Ok(session.set(known, &Value::Real(x)).is_ok())
}

fn factor(session: &mut Session, pair: &Pair, share: f64) -> Result<Option<Factor>> {
    let here = session.real(pair.known)?;
    let before = session.real(pair.unknown)?;
    let (min, max) = pair.known.bounds();
    let step = share * here.abs().max(0.1 * pair.known.nominal());
    let there = if here + step <= max { here + step } else { here - step };
    if there < min || there == here || !set_known(session, pair.known, there)? {
        return Ok(None);
    }
    let after = session.real(pair.unknown)?;
    set_known(session, pair.known, here)?;
    let dx = there - here;
    let size = before.abs().max(after.abs());
    let value = (after - before) / dx;
    Ok(value
        .is_finite()
        .then_some(Factor { value, rounding: 1e3 * f64::EPSILON * size / dx.abs() }))
}

/// Measures the factor of each pair, which is the derivative of its unknown with respect to its known, at three
/// points of one session. Reports each pair whose factor changes, and adds its position to `wrong`; pairs that are
/// already in `wrong` are not measured again. Returns the factors at the first point.
fn at_points(
    session: &mut Session,
    pairs: &[Pair],
    wrong: &mut BTreeSet<usize>,
    findings: &mut Findings,
    initializing: bool,
) -> Result<Vec<Option<Factor>>> {
    let fmu = session.fmu;
    let mut first_factors = vec![None; pairs.len()];
    let exchange = session.using.interface == Interface::ModelExchange;
    let stepping = !exchange && !initializing;
    let mut random = fastrand::Rng::with_seed(1);
    for point in 0..3 {
        if point > 0 && stepping {
            session.advance(2)?;
        }
        if point > 0 && exchange && !initializing {
            // the second and third point have other states, and no event is between them
            let states = fmu.states();
            let mut x = session.states()?;
            let here = x.clone();
            for (x, (_, state)) in x.iter_mut().zip(&states) {
                *x += 0.3 * (2.0 * random.f64() - 1.0) * x.abs().max(0.1 * state.nominal());
            }
            if session.instance.set_continuous_states(&x).is_err() {
                session.instance.set_continuous_states(&here)?;
            }
        }
        for (n, pair) in pairs.iter().enumerate() {
            if wrong.contains(&n) {
                continue;
            }
            for share in [1e-3, 0.1] {
                let Some(now) = factor(session, pair, share)? else { continue };
                match first_factors[n] {
                    None => first_factors[n] = Some(now),
                    Some(known) if now.differs(&known) => {
                        wrong.insert(n);
                        pair.report(findings, known, now, "at two points of one run");
                        break;
                    }
                    Some(_) => {}
                }
            }
        }
    }
    Ok(first_factors)
}

pub fn kinds(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let d = fmu.description;
    let initial = pairs(fmu, "InitialUnknowns", d.unknowns(d.words.initial_unknowns));
    let mut running = pairs(fmu, "Outputs", d.unknowns(d.words.outputs));
    running.extend(pairs(fmu, "Derivatives", d.unknowns(d.words.derivatives)));
    let mut interface = Interface::ModelExchange;
    if !fmu.has(interface) {
        interface = Interface::CoSimulation;
        // There may be events between two steps of Co-Simulation, and they may change the factor.
        running.retain(|pair| pair.kind != "discrete");
    }
    if !running.is_empty() && fmu.has(interface) {
        check_pairs(fmu, findings, &running, interface, false)?;
    }
    if !initial.is_empty() {
        check_pairs(fmu, findings, &initial, fmu.first_interface()?, true)?;
    }
    Ok(())
}

fn check_pairs(
    fmu: &FmuUnderTest,
    findings: &mut Findings,
    pairs: &[Pair],
    interface: Interface,
    initializing: bool,
) -> Result<()> {
    let mut wrong = BTreeSet::new();
    let mut always: Vec<Option<Factor>> = vec![None; pairs.len()];
    for start in 0..STARTS {
        let mut session = random_session(fmu, interface, start)?;
        fmu.announce(format!("measuring how unknowns follow knowns, start {start}"));
        let ready = if initializing {
            session
                .instance
                .setup_experiment(None, session.time, None)
                .and_then(|()| session.instance.enter_initialization_mode())
                .is_ok()
        } else {
            // In every second start the factors are measured at the initial state, without steps before it.
            session.initialise().is_ok()
                && session.advance(if start % 2 == 0 { 3 } else { 0 }).is_ok()
        };
        // A start is skipped if the FMU refuses its parameters.
        if !ready || session.is_ended() {
            continue;
        }
        let Ok(factors) = at_points(&mut session, pairs, &mut wrong, findings, initializing) else {
            continue;
        };
        for (n, (pair, now)) in pairs.iter().zip(factors).enumerate() {
            let Some(now) = now.filter(|_| pair.kind == "constant") else { continue };
            match always[n] {
                None => always[n] = Some(now),
                Some(known) if now.differs(&known) && !wrong.contains(&n) => {
                    wrong.insert(n);
                    pair.report(findings, known, now, "with other parameters");
                }
                Some(_) => {}
            }
        }
    }
    Ok(())
}
