//! Rules that compare the dependencies in modelDescription.xml with the binary (FMI 2.0.5, sections 2.2.8 and
//! 2.1.9).
//!
//! The rules change each input and each state separately; the outputs and derivatives that then change are the observed
//! dependencies. This is repeated from many initial points, because a dependency may show only for some parameters, and
//! because a state of 0 hides a product.

use std::collections::BTreeSet;

use anyhow::Result;

use super::description::{Unknown, Variable};
use super::findings::Findings;
use super::under_test::{FmuUnderTest, Interface, Session, skip, start_value};
use super::values::items;
use host::causality::Causality;
use host::description::{Type, Value};

/// Largest number of initial points that are tried before a declared feedthrough counts as missing in the
/// binary.
const STARTS: u64 = 600;
/// Smallest number of initial points (values of parameters, inputs and states) from which dependencies are observed.
/// This number is enough to find most dependencies that the description does not declare.
const AT_LEAST: u64 = 40;
/// Largest number of attempts to reach [`STARTS`] initial points. There are more attempts than points, because the FMU
/// may refuse parameters that are drawn at random.
const TRIES: u64 = 16 * STARTS;
/// Probability with which a random start value is divided by 100, because some dependencies show
/// only at small values.
const SMALL_VALUE_SHARE: f64 = 0.1;
/// Relative change of a value below which the change counts as rounding and not as a dependency.
const ROUNDING: f64 = 1e-9;

/// Returns an instance whose parameters, inputs and start values are drawn at random with the seed `attempt`.
/// Attempt 0 keeps the declared values.
pub fn random_session<'f>(
    fmu: &'f FmuUnderTest,
    interface: Interface,
    attempt: u64,
) -> Result<Session<'f>> {
    let mut session = fmu.session(interface)?;
    if attempt == 0 {
        return Ok(session);
    }
    fmu.chose_values();
    let mut random = fastrand::Rng::with_seed(attempt);
    let parameters = fmu.variables().iter().filter(|v| v.is_set_by_hosts());
    for v in parameters {
        let Some(start) = start_value(v) else { continue };
        // Some effects show only while the other values are at their defaults, for example at zero, so a part of the
        // attempts leaves these values unchanged.
        let kept = match attempt % 3 {
            0 => 0.0,
            1 => 1.0,
            _ => 0.6,
        };
        let is_choice = v.kind == Type::Enumeration;
        if (v.is_real() && random.f64() < kept) || (is_choice && random.f64() < 0.4) {
            continue;
        }
        let (min, max) = v.bounds();
        let value = match start {
            Value::Real(0.0) => {
                let span = if max.is_finite() { max.min(1.0) } else { v.nominal().min(1.0) };
                let size = 0.2 * span * 10f64.powf(-5.0 * random.f64());
                let moved = if random.bool() { size } else { -size };
                Value::Real(moved.max(min).min(max.max(min)))
            }
            Value::Real(x) => {
                // Some effects show only near zero, for example friction at rest.
                let share = if random.f64() < SMALL_VALUE_SHARE { 0.01 } else { 1.0 };
                let moved = share * x * (0.7 + 0.6 * random.f64());
                Value::Real(moved.max(min).min(max.max(min)))
            }
            Value::Integer(_) if v.kind == Type::Enumeration => {
                let items = items(fmu, v);
                match random.choice(&items) {
                    Some(item) => Value::Integer(*item),
                    None => continue,
                }
            }
            // The bounds are drawn more often than the values between them, because special cases are
            // often at the bounds.
            Value::Integer(_) if max - min <= 1e6 => {
                let inside = min + ((max - min + 1.0) * random.f64()).floor();
                let all = [min, max, max, inside];
                Value::Integer(random.choice(all).unwrap_or(min) as i64)
            }
            Value::Boolean(_) => Value::Boolean(random.bool()),
            _ => continue,
        };
        // A value that the FMU refuses keeps its old value.
        let _ = session.set(v, &value);
    }
    Ok(session)
}

fn has_moved(v: &Variable, a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Real(a), Value::Real(b)) => {
            let size = a.abs().max(b.abs()).max(1e-3 * v.nominal());
            (a - b).abs() > ROUNDING * size
        }
        (a, b) => !a.is_identical(b),
    }
}

struct Seen {
    pairs: BTreeSet<(u32, u32)>,
    traces: BTreeSet<(u32, u32)>,
    moved: BTreeSet<u32>,
    starts: u64,
}

impl Seen {
    fn empty() -> Seen {
        Seen { pairs: BTreeSet::new(), traces: BTreeSet::new(), moved: BTreeSet::new(), starts: 0 }
    }

    fn compare(
        &mut self,
        unknowns: &[&Variable],
        known: &Variable,
        before: &[Value],
        after: &[Value],
    ) {
        self.moved.insert(known.key);
        for ((unknown, before), after) in unknowns.iter().zip(before).zip(after) {
            if !before.is_identical(after) {
                self.traces.insert((unknown.key, known.key));
            }
            if has_moved(unknown, before, after) {
                self.pairs.insert((unknown.key, known.key));
            }
        }
    }

    /// Returns true if every pair (unknown, known) of `feedthrough` has been observed at least once. A change in the
    /// last bit of a value is enough for an observation.
    fn is_complete(&self, feedthrough: &BTreeSet<(u32, u32)>) -> bool {
        feedthrough.iter().all(|pair| self.traces.contains(pair))
    }

    /// Reports the dependencies that were observed but that the description does not declare. A
    /// state's dependency on itself is left out.
    fn report(&self, fmu: &FmuUnderTest, lists: &[&Unknown], when: &str, findings: &mut Findings) {
        for unknown in lists {
            let (Some(key), Some(declared)) = (unknown.key, &unknown.dependencies) else {
                continue;
            };
            let missing =
                self.pairs.iter().filter(|(u, k)| *u == key && u != k && !declared.contains(k));
            let missing: Vec<_> = missing.map(|(_, k)| name(fmu, *k)).collect();
            if !missing.is_empty() {
                findings.at(format!("line {}, {}", unknown.line, name(fmu, key))).add(format!(
                    "{when} the variable changes with {}, which is not among its declared dependencies",
                    missing.join(", ")
                ));
            }
        }
    }
}

fn name(fmu: &FmuUnderTest, key: u32) -> &str {
    fmu.description.at(key).map_or("?", |v| v.name.as_str())
}

fn read(session: &mut Session, variables: &[&Variable]) -> Result<Vec<Value>> {
    variables.iter().map(|v| Ok(session.get(v)?)).collect()
}

pub fn running(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let d = fmu.description;
    let lists: Vec<&Unknown> = d.running_unknowns().collect();
    observe(fmu, &BTreeSet::new())?.report(fmu, &lists, "while running", findings);
    Ok(())
}

pub fn feedthrough(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let d = fmu.description;
    if !fmu.has(Interface::ModelExchange) {
        return skip("in Co-Simulation an output may wait for the next step to follow its inputs");
    }
    let is_input = |key: u32| d.at(key).is_some_and(|v| v.causality == Causality::Input);
    let declared: BTreeSet<(u32, u32)> = d
        .unknowns(d.words.outputs)
        .filter_map(|u| Some((u.key?, u.dependencies.as_ref()?)))
        .flat_map(|(key, knowns)| knowns.iter().map(move |known| (key, *known)))
        .filter(|(_, known)| is_input(*known))
        .collect();
    let seen = observe(fmu, &declared)?;
    for (output, input) in declared.iter().filter(|pair| !seen.traces.contains(pair)) {
        if seen.moved.contains(input) {
            let (output, input) = (name(fmu, *output), name(fmu, *input));
            findings.at(format!("Outputs, {output}")).add(format!(
                "the output is declared to depend on the input {input}, but at {} different starts it \
                     never changed with it: hosts see an algebraic loop where there is none",
                seen.starts
            ));
        }
    }
    Ok(())
}

/// Changes inputs and states one by one, from many initial points, and returns the observed dependencies of outputs
/// and derivatives. Stops early when all dependencies in `wanted`, which are pairs (unknown, known), have been
/// observed. Skips the rule if there is nothing to observe.
fn observe(fmu: &FmuUnderTest, wanted: &BTreeSet<(u32, u32)>) -> Result<Seen> {
    let d = fmu.description;
    let lists: Vec<&Unknown> = d.running_unknowns().collect();
    let unknowns: Vec<&Variable> = lists.iter().filter_map(|u| d.variable_of(u)).collect();
    if unknowns.is_empty() {
        return skip("the FMU has neither outputs nor derivatives");
    }
    let exchange = fmu.has(Interface::ModelExchange);
    let interface = if exchange { Interface::ModelExchange } else { fmu.first_interface()? };
    let inputs: Vec<_> =
        fmu.variables().iter().filter(|v| v.causality == Causality::Input).collect();
    let states = fmu.states();
    let mut seen = Seen::empty();
    for attempt in 0..TRIES {
        let mut session = random_session(fmu, interface, attempt)?;
        fmu.announce(format!("initialising with other parameters, try {attempt}"));
        // The FMU refused these parameters; the next attempt draws other parameters.
        if session.initialise().is_err() || session.is_ended() {
            continue;
        }
        session.count = attempt as usize;
        // Every second attempt starts at rest with the inputs unchanged.
        let steps = if attempt % 2 == 0 { 0 } else { attempt as usize % 8 };
        if session.advance(steps).is_err() || session.is_ended() {
            continue;
        }
        // Two attempts with small changes alternate with two attempts with large changes.
        let share = if attempt / 2 % 2 == 0 { 1.0 / 1024.0 } else { 0.25 };
        fmu.announce(format!("moving inputs one by one, try {attempt}"));
        let before = read(&mut session, &unknowns)?;
        for v in &inputs {
            let start = session.get(v)?;
            let Some(other) = displaced_value(fmu, v, &start, share) else { continue };
            if session.set(v, &other).is_ok() {
                let after = read(&mut session, &unknowns)?;
                seen.compare(&unknowns, v, &before, &after);
                session.set(v, &start)?;
            }
        }
        if exchange && !states.is_empty() {
            fmu.announce(format!("moving states one by one, try {attempt}"));
            let x = session.states()?;
            for (n, (_, state)) in states.iter().enumerate() {
                let mut there = x.clone();
                there[n] += share * x[n].abs().max(0.1 * state.nominal());
                // If the model cannot be evaluated at this point, another attempt is made.
                if session.instance.set_continuous_states(&there).is_ok()
                    && let Ok(after) = read(&mut session, &unknowns)
                {
                    seen.compare(&unknowns, state, &before, &after);
                }
                session.instance.set_continuous_states(&x)?;
            }
        }
        seen.starts += 1;
        if seen.starts == STARTS || seen.starts > AT_LEAST && seen.is_complete(wanted) {
            break;
        }
    }
    Ok(seen)
}

/// Returns another value that `v` may have, which differs from `now` by about `share` of its
/// magnitude; `None` if the bounds of `v` leave no room.
pub fn displaced_value(fmu: &FmuUnderTest, v: &Variable, now: &Value, share: f64) -> Option<Value> {
    let Value::Real(x) = now else { return super::values::other_value(fmu, v, now) };
    let (min, max) = v.bounds();
    let step = share * x.abs().max(0.1 * v.nominal().min(max.abs()));
    let there = if x + step <= max { x + step } else { x - step };
    (there >= min && there != *x).then_some(Value::Real(there))
}

pub fn initial(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let d = fmu.description;
    let lists: Vec<&Unknown> = d.unknowns(d.words.initial_unknowns).collect();
    let unknowns: Vec<&Variable> = lists.iter().filter_map(|u| d.variable_of(u)).collect();
    if unknowns.is_empty() {
        return skip("the FMU has no InitialUnknowns");
    }
    let knowns: Vec<_> = fmu.variables().iter().filter(|v| v.is_set_by_hosts()).collect();
    let interface = fmu.first_interface()?;
    let mut seen = Seen::empty();
    for attempt in 0..AT_LEAST {
        let mut session = random_session(fmu, interface, attempt)?;
        let begun = session.instance.setup_experiment(None, session.time, None);
        match begun.and_then(|()| session.instance.enter_initialization_mode()) {
            Err(_) if attempt > 0 => continue, // these parameters may have no solution
            done => done?,
        }
        fmu.announce(format!("moving inputs and parameters in initialization mode, try {attempt}"));
        let Ok(before) = read(&mut session, &unknowns) else { continue };
        let share = if attempt / 2 % 2 == 0 { 1.0 / 1024.0 } else { 0.25 };
        for v in &knowns {
            let start = session.get(v)?;
            let Some(other) = displaced_value(fmu, v, &start, share) else { continue };
            if session.set(v, &other).is_ok() {
                if let Ok(after) = read(&mut session, &unknowns) {
                    seen.compare(&unknowns, v, &before, &after);
                }
                session.set(v, &start)?;
            }
        }
    }
    seen.report(fmu, &lists, "in initialization mode", findings);
    Ok(())
}

pub fn directional(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    /// Allowed deviation of the FMU's directional derivatives from finite differences, relative to the
    /// largest derivative of the unknown. Finite differences lose half of the digits, and more where the
    /// function is curved.
    const AGREE: f64 = 1e-3;
    let d = fmu.description;
    if !fmu.has(Interface::ModelExchange)
        || !fmu.has_capability(Interface::ModelExchange, "providesDirectionalDerivative")
    {
        return skip(
            "providesDirectionalDerivative is not declared for Model Exchange, the only interface that gives access to the states",
        );
    }
    let unknowns: Vec<&Variable> = d
        .running_unknowns()
        .filter_map(|u| d.variable_of(u))
        .filter(|v| v.is_continuous())
        .collect();
    let references: Vec<u32> = unknowns.iter().map(|v| v.reference).collect();
    let states = fmu.states();
    let inputs = &fmu.inputs;
    let mut session = fmu.running(Interface::ModelExchange)?;
    session.advance(3)?;
    let x = session.states()?;
    let knowns = inputs
        .iter()
        .map(|v| (*v, None))
        .chain(states.iter().enumerate().map(|(n, (_, state))| (*state, Some(n))));
    for (v, place) in knowns {
        fmu.announce(format!("fmi2GetDirectionalDerivative along {}", v.name));
        let given =
            session.instance.get_directional_derivative(&references, &[v.reference], &[1.0]);
        let given = match given {
            Ok(given) => given,
            Err(error) => {
                findings.at(v.place()).add(error.to_string());
                continue;
            }
        };
        let now = session.get(v)?;
        let Value::Real(here) = now else { continue };
        let values = |session: &mut Session, there: f64| -> Result<Vec<f64>> {
            match place {
                None => session.set(v, &Value::Real(there))?,
                Some(n) => {
                    let mut moved = x.clone();
                    moved[n] = there;
                    session.instance.set_continuous_states(&moved)?;
                }
            }
            let mut values = vec![0.0; references.len()];
            session.instance.get_real(&references, &mut values)?;
            Ok(values)
        };
        let h = 1e-5 * here.abs().max(0.1 * v.nominal());
        let (above, below) = (values(&mut session, here + h)?, values(&mut session, here - h)?);
        let centre = values(&mut session, here)?;
        for (n, unknown) in unknowns.iter().enumerate() {
            let (right, left) = ((above[n] - centre[n]) / h, (centre[n] - below[n]) / h);
            let rounding = 1e-13 * centre[n].abs().max(1e-3 * unknown.nominal()) / h;
            // Left out: a state that is also an output, and a kink, where no derivative exists.
            if unknown.key == v.key {
                continue;
            }
            if (right - left).abs() > 0.01 * right.abs().max(left.abs()) + rounding {
                continue;
            }
            let difference = (above[n] - below[n]) / (2.0 * h);
            if (given[n] - difference).abs() > AGREE * difference.abs() + 10.0 * rounding {
                findings.at(format!("d {} / d {}", unknown.name, v.name)).add(format!(
                    "fmi2GetDirectionalDerivative gives {}, differences {difference}",
                    given[n]
                ));
            }
        }
    }
    Ok(())
}
