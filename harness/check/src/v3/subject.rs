//! The FMU 3.0 under test: loads it, calls it as a host does, and has shortcuts for the rules.

use std::ops::Deref;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};

use crate::description::{Description, Variable};
use crate::loaded::{Life, Loaded, UnderTest, Unusable, declared};
use host::c_abi::{CallError, Called, Message};
use host::causality::Causality;
use host::description::{Type, Value};
use host::fmi3::{EventInfo, Fmi3, Fmu, Instance, Instantiation, Interface, Step, Update};
use host::xml::{Element, double};

pub use crate::loaded::STEPS;

/// Number of calls of fmi3UpdateDiscreteStates after which an event iteration counts as endless.
const ITERATIONS: usize = 100;
/// Number of events in one communication step after which the simulation is abandoned.
const EVENTS: usize = 1000;

/// Callback for intermediate updates within a step. It returns the time of an early return, or `None`.
pub type Within<'a> = dyn FnMut(&Update) -> Option<f64> + 'a;

pub struct Subject {
    loaded: Loaded<Fmi3>,
    pub description: Description,
}

impl Deref for Subject {
    type Target = Loaded<Fmi3>;

    fn deref(&self) -> &Loaded<Fmi3> {
        &self.loaded
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Use {
    pub interface: Interface,
    pub event_mode: bool,
    pub early_return: bool,
    /// True if the callback intermediateUpdate is passed.
    pub updates: bool,
}

impl Use {
    /// Co-Simulation as in FMI 2.0: no event mode, no early return, no intermediate update.
    pub const PLAIN: Use = Use {
        interface: Interface::CoSimulation,
        event_mode: false,
        early_return: false,
        updates: false,
    };
    pub const EXCHANGE: Use = Use { interface: Interface::ModelExchange, ..Use::PLAIN };

    pub fn name(self) -> &'static str {
        match self {
            Use { interface: Interface::ModelExchange, .. } => "Model Exchange",
            Use { event_mode: true, early_return: true, .. } => {
                "Co-Simulation with event mode and early return"
            }
            Use { event_mode: true, .. } => "Co-Simulation with event mode",
            Use { early_return: true, .. } => "Co-Simulation with early return",
            _ => "Co-Simulation",
        }
    }
}

impl Subject {
    /// Loads the FMU that is unpacked in `directory`, with the interfaces that rules call. No instances are
    /// created after `deadline`.
    pub fn open(
        directory: &Path,
        path: &Path,
        root: Element,
        deadline: Instant,
    ) -> Result<Subject> {
        let description = Description::new(root);
        // Clocks need event mode with clock activation, which this check does not call.
        let has_clocks = description.has_clocks();
        let mut called = declared(&description.root);
        called.retain(|(of, _)| *of == Interface::ModelExchange || !has_clocks);
        called.first().context(
            "the FMU offers neither Co-Simulation nor Model Exchange, and the check calls no other interface",
        )?;
        let loaded = Loaded::new(called, deadline, |interface| {
            Fmu::load_for(Some(interface), directory, path, &description.root)
        })?;
        Ok(Subject { loaded, description })
    }

    pub fn plain_uses(&self) -> Vec<Use> {
        let uses = [Use::PLAIN, Use::EXCHANGE].into_iter();
        uses.filter(|u| self.binary(u.interface).is_ok()).collect()
    }

    fn number(&self, name: &str) -> Option<f64> {
        let experiment = self.description.root.child("DefaultExperiment");
        experiment.and_then(|e| e.number(name)).filter(|x| x.is_finite())
    }

    pub fn start(&self) -> f64 {
        self.number("startTime").unwrap_or(0.0)
    }

    /// Returns the communication step, s: a multiple of the FMU's fixed internal step, or else the suggested
    /// step or a 500th of the default experiment.
    pub fn step(&self) -> f64 {
        let fixed = self.description.interface("CoSimulation");
        let fixed = fixed.and_then(|e| e.number("fixedInternalStepSize")).filter(|h| *h > 0.0);
        let span = self.number("stopTime").map(|stop| stop - self.start()).filter(|s| *s > 0.0);
        let step = self.number("stepSize").filter(|h| *h > 0.0);
        let step = step.filter(|h| span.is_none_or(|span| *h * STEPS as f64 <= span));
        let step = step.or(span.map(|span| span / 500.0)).unwrap_or(0.01);
        match fixed {
            // A multiple of the FMU's own step, of which there may be millions in a 500th of the experiment.
            Some(own) => (step / own).round().clamp(1.0, 100.0) * own,
            None => step,
        }
    }

    pub fn instantiation(&self, using: Use) -> Result<Instantiation<'_>> {
        let mut with = self.binary(using.interface)?.instantiation("check");
        with.interface = using.interface;
        with.event_mode = using.event_mode;
        with.early_return = using.early_return;
        with.intermediate_update = using.updates;
        if !using.updates {
            with.required.clear();
        }
        Ok(with)
    }

    /// Instantiates the FMU with the arguments `with`. The outer error means that the FMU allows only one
    /// instance in a process and already has had it, or that the deadline has passed.
    pub fn instantiate(&self, with: &Instantiation) -> Result<Result<Instance<'_>, CallError>> {
        let binary = self.binary(with.interface)?;
        let is_once = self.can(with.interface, "canBeInstantiatedOnlyOncePerProcess");
        self.make(is_once, || binary.instantiate_with(with))
    }

    /// Reads a value reference that no variable has, and returns the FMU's refusal with its messages. If this
    /// crashes, `values.unknown` reports it.
    pub fn refused(&self, session: &mut Session) -> Option<CallError> {
        self.with_crash_reported_by("values.unknown", || {
            self.announce("fmi3GetFloat64 of a valueReference that no variable has");
            session.instance.get_numbers(&[u32::MAX], &mut [0.0f64]).err()
        })
    }

    pub fn readable(&self) -> impl Iterator<Item = &Variable> {
        self.description.variables.iter().filter(|v| v.is_exchanged())
    }

    pub fn inputs(&self) -> impl Iterator<Item = &Variable> {
        let float = host::description::CType::Float64;
        let all = self.description.variables.iter();
        all.filter(move |v| {
            v.causality == Causality::Input && v.is_continuous() && v.c_type == float
        })
    }
}

impl UnderTest for Subject {
    type Version = Fmi3;
    type Use = Use;
    type Session<'f> = Session<'f>;
    const FMI: &'static str = "fmi3";
    const NUMBER: &'static str = "3.0";
    const STATE: &'static str = "FMUState";

    fn root(&self) -> &Element {
        &self.description.root
    }

    fn uses(&self) -> Vec<Use> {
        let mut uses = self.plain_uses();
        let stepping = Interface::CoSimulation;
        if self.binary(stepping).is_ok() && self.can(stepping, "hasEventMode") {
            uses.push(Use { event_mode: true, ..Use::PLAIN });
            uses.push(Use { event_mode: true, early_return: true, ..Use::PLAIN });
        }
        if self.binary(stepping).is_ok() && self.can(stepping, "mightReturnEarlyFromDoStep") {
            uses.push(Use { early_return: true, ..Use::PLAIN });
        }
        uses
    }

    fn name(using: Use) -> &'static str {
        using.name()
    }

    fn interface(using: Use) -> Interface {
        using.interface
    }

    fn session(&self, using: Use) -> Result<Session<'_>> {
        self.announce(format!("making an instance for {}", using.name()));
        let instance = self
            .instantiate(&self.instantiation(using)?)?
            .map_err(|error| Unusable { rule: "load.instance", why: error.to_string() })?;
        let (time, h) = (self.start(), self.step());
        Ok(Session {
            subject: self,
            using,
            instance,
            time,
            h,
            count: 0,
            next_event: None,
            events: 0,
            zero_indicator: None,
            ended: false,
        })
    }

    fn running(&self, using: Use) -> Result<Session<'_>> {
        let mut session = self.session(using)?;
        session.initialise()?;
        Ok(session)
    }

    fn provoke_messages(&self) -> Result<(Vec<Message>, usize)> {
        let mut session = self.running(self.plain_uses()[0])?;
        session.advance(2)?;
        let refused = self.refused(&mut session);
        let mut messages = session.instance.take_messages();
        messages.extend(refused.into_iter().flat_map(|error| error.messages));
        Ok((messages, session.instance.uncategorised()))
    }
}

pub struct Session<'s> {
    pub subject: &'s Subject,
    pub using: Use,
    pub instance: Instance<'s>,
    pub time: f64,
    pub h: f64,
    /// Number of steps of [`Life::advance`] so far, from which the changing inputs follow.
    pub count: usize,
    /// Time of the next event that the FMU has announced, s.
    pub next_event: Option<f64>,
    pub events: usize,
    /// The first event indicator that was 0 after event mode: time and index.
    pub zero_indicator: Option<(f64, usize)>,
    /// True if the FMU has requested the end of the simulation.
    pub ended: bool,
}

impl Session<'_> {
    pub fn enter_initialization(&mut self) -> Result<()> {
        self.subject.announce("fmi3EnterInitializationMode");
        let tolerance = self.subject.number("tolerance").filter(|t| *t > 0.0);
        self.instance.enter_initialization_mode(tolerance, self.time, None).map_err(starts)
    }

    /// Leaves initialization mode and iterates events, so that the instance is ready for a step.
    pub fn leave_initialization(&mut self) -> Result<()> {
        self.subject.announce("fmi3ExitInitializationMode");
        self.instance.exit_initialization_mode().map_err(starts)?;
        if self.using.event_mode || self.using.interface == Interface::ModelExchange {
            self.leave_event()?;
        }
        Ok(())
    }

    /// Iterates events until no new iteration is requested, and leaves event mode. Returns the results of the
    /// last iteration.
    pub fn leave_event(&mut self) -> Result<EventInfo> {
        let info = self.iterate()?;
        if self.ended {
            return Ok(info);
        }
        match self.using.interface {
            Interface::CoSimulation => {
                self.subject.announce("fmi3EnterStepMode");
                self.instance.enter_step_mode()?;
            }
            Interface::ModelExchange => {
                self.subject.announce("fmi3EnterContinuousTimeMode");
                self.instance.enter_continuous_time_mode()?;
            }
        }
        Ok(info)
    }

    /// Calls fmi3UpdateDiscreteStates until no new iteration is requested.
    pub fn iterate(&mut self) -> Result<EventInfo> {
        self.subject.announce("fmi3UpdateDiscreteStates");
        for _ in 0..ITERATIONS {
            let info = self.instance.update_discrete_states()?;
            if info.terminate == 1 {
                self.ended = true;
            }
            if info.needs_update != 1 || self.ended {
                self.next_event = (info.next_event_defined == 1).then_some(info.next_event_time);
                return Ok(info);
            }
        }
        let why = format!(
            "discreteStatesNeedUpdate is still true after {ITERATIONS} calls of fmi3UpdateDiscreteStates at \
             t = {:?} s (allowed: an iteration that ends)",
            self.time
        );
        Err(Unusable { rule: "events.iteration", why }.into())
    }

    /// Enters event mode, iterates, leaves it, and notes event indicators that are 0 afterwards.
    pub fn event(&mut self) -> Result<EventInfo> {
        self.events += 1;
        self.subject.announce(format!("event mode at {:?} s", self.time));
        self.instance.enter_event_mode()?;
        let info = self.leave_event()?;
        if self.using.interface == Interface::ModelExchange && !self.ended {
            let mut z = vec![1.0; self.instance.number_of_indicators()?];
            self.instance.event_indicators(&mut z)?;
            let zero = z.iter().position(|z| *z == 0.0).map(|i| (self.time, i));
            self.zero_indicator = self.zero_indicator.or(zero);
        }
        Ok(info)
    }

    pub fn raw_step(&mut self, h: f64) -> Called<Step> {
        self.raw_step_with_updates(h, None)
    }

    pub fn raw_step_with_updates(&mut self, h: f64, within: Option<&mut Within>) -> Called<Step> {
        self.subject.announce(format!(
            "fmi3DoStep from {:?} s by {h:?} s ({})",
            self.time,
            self.using.name()
        ));
        let step = match within {
            Some(within) => self.instance.do_step_with_updates(self.time, h, Some(within))?,
            None => self.instance.do_step(self.time, h)?,
        };
        self.ended |= step.terminate == 1;
        // An FMU that returns early reports the time it has reached; otherwise this is the end of the step.
        self.time = match step.early_return == 1 && step.last_time.is_finite() {
            true => step.last_time,
            false => self.time + h,
        };
        Ok(step)
    }

    /// Advances to the time `until` (s), with event mode whenever the FMU requests it. Model Exchange is
    /// integrated by Euler's method, which is accurate enough for the rules; if states change fast, the run
    /// ends earlier.
    pub fn advance_to(&mut self, until: f64) -> Result<()> {
        if self.using.interface == Interface::ModelExchange {
            return self.euler_to(until);
        }
        for _ in 0..EVENTS {
            let h = until - self.time;
            if h <= 1e-12 * until.abs().max(self.h) || self.ended {
                return Ok(());
            }
            let step = self.raw_step(h).map_err(runs)?;
            if step.event == 1 && self.using.event_mode && !self.ended {
                self.event()?;
            }
        }
        let why = format!("{EVENTS} events before t = {until} s");
        Err(Unusable { rule: "events.iteration", why }.into())
    }

    fn euler_to(&mut self, until: f64) -> Result<()> {
        const PARTS: usize = 10;
        let n = self.instance.number_of_states()?;
        let nz = self.instance.number_of_indicators()?;
        let (mut x, mut dx) = (vec![0.0; n], vec![0.0; n]);
        let (mut z, mut before) = (vec![0.0; nz], vec![0.0; nz]);
        let longest = (until - self.time) / PARTS as f64;
        let mut nominals = vec![1.0; n];
        if n > 0 {
            self.instance.nominals(&mut nominals)?;
        }
        for _ in 0..PARTS {
            if self.ended {
                return Ok(());
            }
            self.subject
                .announce(format!("integrating from {:?} s by at most {longest:?} s", self.time));
            self.instance.event_indicators(&mut before)?;
            if n > 0 {
                self.instance.continuous_states(&mut x)?;
                self.instance.derivatives(&mut dx)?;
            }
            // Euler's method is stable as long as no state changes much in a step.
            let share = |i: usize| dx[i].abs() / x[i].abs().max(nominals[i].abs()).max(1e-9);
            let fastest = (0..n).map(share).fold(0.0, f64::max);
            let h = longest.min(1e-3 / fastest.max(1e-3 / longest));
            let due = self.next_event.is_some_and(|next| next <= self.time + h);
            let to = self.next_event.filter(|_| due).unwrap_or(self.time + h);
            for (x, dx) in x.iter_mut().zip(&dx) {
                *x += (to - self.time) * dx;
            }
            self.time = to;
            self.instance.set_time(to)?;
            if n > 0 {
                self.instance.set_continuous_states(&x)?;
            }
            self.instance.event_indicators(&mut z)?;
            let crossed = z.iter().zip(&before).any(|(a, b)| (*a > 0.0) != (*b > 0.0));
            let completed = self.instance.completed_integrator_step()?;
            self.ended |= completed.terminate;
            if (completed.enter_event_mode || crossed || due) && !self.ended {
                self.event()?;
            }
        }
        Ok(())
    }

    pub fn stimulate(&mut self, k: usize) -> Result<()> {
        for (n, v) in self.subject.inputs().enumerate() {
            let values = stimulus(v, k + 3 * n);
            self.instance.set_numbers(&[v.reference], &values)?;
        }
        Ok(())
    }

    /// Reads all elements of a variable. If this fails, `values.readable` reports it.
    pub fn read(&mut self, v: &Variable) -> Result<Vec<Value>> {
        self.get(v).map_err(|error| {
            let why = format!("{} cannot be read: {error}", v.name);
            Unusable { rule: "values.readable", why }.into()
        })
    }

    /// Reads all elements of a variable; the caller handles a refusal.
    pub fn get(&mut self, v: &Variable) -> Called<Vec<Value>> {
        self.instance.values(v.c_type, v.reference, v.length())
    }
}

impl<'f> Life<'f, Fmi3> for Session<'f> {
    type Reading = (String, Vec<Value>);
    /// Time (s), number of steps, and time of the next event (s).
    type Mark = (f64, usize, Option<f64>);

    fn instance(&mut self) -> &mut Instance<'f> {
        &mut self.instance
    }

    fn initialise(&mut self) -> Result<()> {
        self.enter_initialization()?;
        self.leave_initialization()
    }

    fn advance(&mut self, steps: usize) -> Result<()> {
        for _ in 0..steps {
            if self.ended {
                break;
            }
            self.stimulate(self.count)?;
            self.count += 1;
            self.advance_to(self.time + self.h)?;
        }
        Ok(())
    }

    fn readings(&mut self) -> Result<Vec<(String, Vec<Value>)>> {
        let subject = self.subject;
        subject.readable().map(|v| Ok((v.name.clone(), self.read(v)?))).collect()
    }

    fn difference(
        &self,
        ours: &[(String, Vec<Value>)],
        theirs: &[(String, Vec<Value>)],
    ) -> Option<String> {
        let same = |a: &Value, b: &Value| match (a, b) {
            (Value::Real(a), Value::Real(b)) => a.to_bits() == b.to_bits(),
            (a, b) => a == b,
        };
        let mut different = ours.iter().zip(theirs).filter_map(|((name, a), (_, b))| {
            let pair = a.iter().zip(b).find(|(a, b)| !same(a, b))?;
            Some((name, pair))
        });
        let (name, (a, b)) = different.next()?;
        let more = match different.count() {
            0 => String::new(),
            n => format!(" ({n} more differ)"),
        };
        Some(format!("{name} is {}, not {}{more}", value_text(a), value_text(b)))
    }

    fn mark(&self) -> (f64, usize, Option<f64>) {
        (self.time, self.count, self.next_event)
    }

    fn go_back(&mut self, to: &(f64, usize, Option<f64>)) {
        (self.time, self.count, self.next_event) = *to;
        self.ended = false;
    }

    fn leave_trajectory(&mut self) -> Result<()> {
        self.initialise()?;
        self.advance(STEPS)
    }

    fn rewind(&mut self) {
        self.go_back(&(self.subject.start(), 0, None));
    }
}

fn value_text(value: &Value) -> String {
    match value {
        Value::Real(x) => format!("{x:?}"),
        Value::Integer(n) => n.to_string(),
        Value::Boolean(yes) => yes.to_string(),
        Value::String(text) => format!("{text:?}"),
    }
}

fn starts(error: host::c_abi::CallError) -> anyhow::Error {
    Unusable { rule: "load.initialises", why: error.to_string() }.into()
}

fn runs(error: host::c_abi::CallError) -> anyhow::Error {
    Unusable { rule: "steps.run", why: error.to_string() }.into()
}

/// Returns values for the elements of an input at step `k`: its start values plus a sine of a quarter of
/// their magnitude, within the bounds.
pub fn stimulus(v: &Variable, k: usize) -> Vec<f64> {
    let (min, max) = v.bounds();
    let swing = 0.25 * (0.7 * k as f64 + 0.3).sin();
    let starts: Vec<f64> = v.starts.iter().filter_map(|s| double(s)).collect();
    let start = |i: usize| starts.get(i).or(starts.first()).copied().unwrap_or(0.0);
    let one = |i: usize| {
        let x = start(i);
        let size = if x == 0.0 { v.nominal() } else { x.abs() };
        (x + swing * size).max(min).min(max.max(min))
    };
    (0..v.length()).map(one).collect()
}

/// Returns the start value of each element, or `None` if the description has none.
pub fn start_values(v: &Variable) -> Option<Vec<Value>> {
    let value = |text: &String| {
        Some(match v.kind {
            Type::Real if v.c_type == host::description::CType::Float32 => {
                Value::Real(f64::from(double(text)? as f32))
            }
            Type::Real => Value::Real(double(text)?),
            Type::Integer | Type::Enumeration => Value::Integer(text.parse().ok()?),
            Type::Boolean => Value::Boolean(matches!(text.as_str(), "true" | "1")),
            Type::String => Value::String(text.clone()),
            Type::Binary | Type::Clock => return None,
        })
    };
    let all: Vec<Value> = v.starts.iter().map(value).collect::<Option<_>>()?;
    match all.len() {
        0 => None,
        1 => Some(vec![all[0].clone(); v.length()]),
        n => (n == v.length()).then_some(all),
    }
}
