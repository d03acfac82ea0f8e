//! The FMU 2.0 under test: loads it, calls it as a host does, and has shortcuts for the rules.

mod observed;

use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;

use super::description::{Description, Variable};
use super::loaded::{Loaded, declared};
use host::causality::Causality;
use host::description::Type;
use host::fmi2::{
    CO_SIMULATION, CallError, Called, Fmi2, Fmu, Instance, Instantiation, MODEL_EXCHANGE, Message,
    PLATFORM, Status,
};
use host::xml::Element;

pub use self::observed::Observed;
pub use super::loaded::{Life, STEPS, UnderTest, Unusable};
pub use host::fmi3::Interface;

/// Number of calls of fmi2NewDiscreteStates after which an event iteration counts as endless.
const ITERATIONS: usize = 100;
/// Largest number of immediately successive events. An FMU that always requests the next event at once breaks
/// a rule.
const IMMEDIATE: usize = 3;
/// Number of events requested only by fmi2CompletedIntegratorStep that are examined.
const ASKED: usize = 20;
/// Relative change of a state at an event below which it is rounding.
const JUMP: f64 = 1e-9;
const UNKNOWN_NOMINAL: f64 = 1e-3;

pub struct FmuUnderTest {
    loaded: Loaded<Fmi2>,
    description: &'static Description,
    pub inputs: Vec<&'static Variable>,
    pub outputs: Vec<&'static Variable>,
    directory: PathBuf,
    path: PathBuf,
    /// State of the process before the binary was loaded, by name; see [`crate::life::surroundings`].
    pub before: Vec<(&'static str, String)>,
}

impl Deref for FmuUnderTest {
    type Target = Loaded<Fmi2>;

    fn deref(&self) -> &Loaded<Fmi2> {
        &self.loaded
    }
}

#[derive(Clone, Debug)]
pub enum Reading {
    Real(f64),
    Integer(i32),
    Boolean(i32),
    Text(String),
}

impl Reading {
    /// Returns true if the two values are bit-identical.
    pub fn is_identical(&self, other: &Reading) -> bool {
        match (self, other) {
            (Reading::Real(a), Reading::Real(b)) => a.to_bits() == b.to_bits(),
            (Reading::Integer(a), Reading::Integer(b)) => a == b,
            (Reading::Boolean(a), Reading::Boolean(b)) => (*a != 0) == (*b != 0),
            (Reading::Text(a), Reading::Text(b)) => a == b,
            _ => false,
        }
    }
}

impl std::fmt::Display for Reading {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Reading::Real(x) => write!(f, "{x:?}"),
            Reading::Integer(n) => write!(f, "{n}"),
            Reading::Boolean(b) => write!(f, "{}", *b != 0),
            Reading::Text(text) => write!(f, "{text:?}"),
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Experiment {
    pub start: f64,
    /// Relative tolerance, if DefaultExperiment has one.
    pub tolerance: Option<f64>,
    /// Stop time, s, if DefaultExperiment has one.
    pub stop: Option<f64>,
    /// Communication step, s.
    pub step: f64,
}

impl FmuUnderTest {
    /// Returns the interface that most rules use: Co-Simulation if it can be called.
    pub fn first_interface(&self) -> Result<Interface> {
        let why = || Unusable {
            rule: "load.instance",
            why: "the FMU offers no interface that can be called".into(),
        };
        Ok(*self.interfaces().first().ok_or_else(why)?)
    }

    /// Loads the FMU that is unpacked in `directory`. `description` lives as long as the process of the rule.
    /// No instances are created after `deadline`.
    pub fn open(
        directory: &Path,
        path: &Path,
        description: &'static Description,
        deadline: Instant,
    ) -> Result<FmuUnderTest> {
        let root = &description.root;
        let mut loaded = Loaded::new(declared(root), deadline, |interface| {
            Fmu::load_for(Some(interface), directory, path, root)
        })?;
        // If only one of two binaries is missing, another rule reports it.
        let is_there = |identifier: &str| {
            let file = format!("binaries/{PLATFORM}/{identifier}{}", std::env::consts::DLL_SUFFIX);
            directory.join(file).exists()
        };
        loaded
            .retain(|of, binary| of == Interface::CoSimulation || binary.has_exchange(), is_there);
        let continuous = |causality| {
            let all = description.variables.iter();
            all.filter(|v| v.causality == causality && v.is_continuous()).collect()
        };
        Ok(FmuUnderTest {
            loaded,
            description,
            inputs: continuous(Causality::Input),
            outputs: continuous(Causality::Output),
            directory: directory.to_path_buf(),
            path: path.to_path_buf(),
            before: Vec::new(),
        })
    }

    /// Copies the unpacked FMU to `directory` and loads the copy, which the operating system treats as
    /// another library.
    pub fn copy(&self, directory: &Path) -> Result<FmuUnderTest> {
        copy_files(&self.directory, directory)?;
        FmuUnderTest::open(directory, &self.path, self.description, self.deadline)
    }

    pub fn directory(&self) -> &Path {
        &self.directory
    }

    pub fn description(&self) -> &Description {
        self.description
    }

    pub fn variables(&self) -> &[Variable] {
        &self.description.variables
    }

    /// Returns pairs of derivative and state, in the order of ModelStructure, which is the order of all state
    /// vectors.
    pub fn states(&self) -> Vec<(&Variable, &Variable)> {
        let d = self.description;
        let pair = |unknown| {
            let derivative = d.variable_of(unknown)?;
            Some((derivative, d.at(derivative.derivative_of()?)?))
        };
        d.unknowns(d.words.derivatives).filter_map(pair).collect()
    }

    pub fn experiment(&self) -> Experiment {
        let element = self.description.root.child("DefaultExperiment");
        let number = |name: &str| element.and_then(|e| e.number(name)).filter(|x| x.is_finite());
        let start = number("startTime").unwrap_or(0.0);
        let above_0 = |x: &f64| *x > 0.0;
        let stop = number("stopTime").filter(|stop| *stop > start);
        let span = stop.map_or(f64::INFINITY, |stop| stop - start);
        let step = number("stepSize").filter(above_0);
        // A step that passes the end at once would show nothing about the FMU.
        let step = step.filter(|step| *step <= span).unwrap_or(span / 500.0);
        let step = if step.is_finite() { step } else { 0.01 };
        Experiment { start, tolerance: number("tolerance").filter(above_0), stop, step }
    }

    /// Instantiates the FMU with the arguments `with`. The outer error means that the FMU allows only one
    /// instance in a process and already has had it, or that the deadline has passed.
    pub fn instantiate(
        &self,
        interface: Interface,
        with: &Instantiation,
    ) -> Result<Result<Instance<'_>, CallError>> {
        let is_once = self.can(interface, "canBeInstantiatedOnlyOncePerProcess");
        let binary = self.binary(interface)?;
        self.make(is_once, || binary.instantiate_with(with))
    }

    pub fn arguments(&self, interface: Interface) -> Result<Instantiation<'_>> {
        let plain = self.binary(interface)?.instantiation("check");
        Ok(Instantiation { kind: kind(interface), ..plain })
    }

    pub fn session_with(&self, interface: Interface, with: &Instantiation) -> Result<Session<'_>> {
        let instance = self
            .instantiate(interface, with)?
            .map_err(|error| Unusable { rule: "load.instance", why: error.to_string() })?;
        let Experiment { start, stop, step, .. } = self.experiment();
        // The suggested step size holds for Co-Simulation only. A run of Model Exchange ends before the
        // suggested stop time, after which a model may do anything.
        let longest = match (interface, stop) {
            (Interface::ModelExchange, Some(stop)) => (stop - start) / (3 * STEPS) as f64,
            _ => f64::INFINITY,
        };
        let states = self.states();
        let nominal = |(_, state): &(&Variable, &Variable)| {
            state.typed.number("nominal").map_or(UNKNOWN_NOMINAL, |_| state.nominal())
        };
        Ok(Session {
            fmu: self,
            interface,
            instance,
            time: start,
            step: step.min(longest),
            count: 0,
            next_event: None,
            nominals: states.iter().map(nominal).collect(),
            ended: None,
            past_event: None,
            immediate_events: 0,
            values_changed: false,
            nominals_changed: false,
            hidden_jump: None,
            asked: 0,
            step_event: None,
        })
    }

    /// Creates an instance and brings it into the state `stage` of the standard's state machine.
    pub fn session_in(&self, interface: Interface, stage: Stage) -> Result<Session<'_>> {
        let mut session = self.session(interface)?;
        match stage {
            Stage::Instantiated => {}
            Stage::Initialization => {
                session.instance.setup_experiment(None, session.time, None)?;
                session.instance.enter_initialization_mode()?;
            }
            Stage::Initialised | Stage::Terminated => {
                session.initialise()?;
                if session.is_ended() {
                    let why =
                        "the FMU asks for the end of the simulation when it is initialised".into();
                    return Err(Unusable { rule: "exchange.terminate_simulation", why }.into());
                }
                if stage == Stage::Terminated {
                    session.instance.terminate()?;
                }
            }
        }
        Ok(session)
    }
}

impl UnderTest for FmuUnderTest {
    type Version = Fmi2;
    type Use = Interface;
    type Session<'f> = Session<'f>;
    const FMI: &'static str = "fmi2";
    const NUMBER: &'static str = "2.0";
    const STATE: &'static str = "FMUstate";

    fn root(&self) -> &Element {
        &self.description.root
    }

    fn uses(&self) -> Vec<Interface> {
        self.interfaces()
    }

    fn name(interface: Interface) -> &'static str {
        match interface {
            Interface::CoSimulation => "Co-Simulation",
            Interface::ModelExchange => "Model Exchange",
        }
    }

    fn interface(interface: Interface) -> Interface {
        interface
    }

    fn session(&self, interface: Interface) -> Result<Session<'_>> {
        self.announce("fmi2Instantiate");
        let with = Instantiation { logging: false, ..self.arguments(interface)? };
        self.session_with(interface, &with)
    }

    fn running(&self, interface: Interface) -> Result<Session<'_>> {
        self.session_in(interface, Stage::Initialised)
    }

    fn provoke_messages(&self) -> Result<(Vec<Message>, usize)> {
        let interface = self.first_interface()?;
        let mut all = Vec::new();
        self.announce("fmi2Instantiate with another GUID");
        let with = Instantiation { guid: Some("another"), ..self.arguments(interface)? };
        if let Err(error) = self.instantiate(interface, &with)? {
            all.extend(error.messages);
        }
        let mut session = self.session(interface)?;
        self.announce("fmi2SetDebugLogging");
        session
            .instance
            .set_debug_logging(true, &[])
            .map_err(|error| Unusable { rule: "log.switch", why: error.to_string() })?;
        self.with_crash_reported_by("life.order", || {
            self.announce("fmi2ExitInitializationMode in state \"instantiated\"");
            let _ = session.instance.exit_initialization_mode();
        });
        if session.initialise().is_ok() {
            self.with_crash_reported_by("values.unknown", || {
                self.announce("fmi2GetReal of an unknown value reference");
                let _ = session.instance.get_real(&[u32::MAX], &mut [0.0]);
            });
            let _ = session.advance(STEPS); // after an error an FMU may refuse all calls
        }
        all.extend(session.instance.take_messages());
        Ok((all, session.instance.uncategorised()))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    Instantiated,
    Initialization,
    Initialised,
    Terminated,
}

impl Stage {
    pub fn name(self) -> &'static str {
        match self {
            Stage::Instantiated => "instantiated",
            Stage::Initialization => "initialization mode",
            Stage::Initialised => "initialised",
            Stage::Terminated => "terminated",
        }
    }
}

pub fn kind(interface: Interface) -> i32 {
    match interface {
        Interface::CoSimulation => CO_SIMULATION,
        Interface::ModelExchange => MODEL_EXCHANGE,
    }
}

pub struct Session<'f> {
    pub fmu: &'f FmuUnderTest,
    pub interface: Interface,
    pub instance: Instance<'f>,
    /// Simulation time that has been reached, s.
    pub time: f64,
    pub step: f64,
    /// Number of steps so far, from which the changing inputs follow.
    pub count: usize,
    pub(super) next_event: Option<f64>,
    nominals: Vec<f64>,
    pub(super) ended: Option<(f64, &'static str)>,
    /// The first time at which nextEventTime was in the past, and this nextEventTime, s.
    pub(super) past_event: Option<(f64, f64)>,
    immediate_events: usize,
    /// Result of the last event iteration: whether states, and whether their nominals, have changed.
    values_changed: bool,
    pub(super) nominals_changed: bool,
    /// The first state that an event has changed although valuesOfContinuousStatesChanged was false: time,
    /// index, and both values.
    pub(super) hidden_jump: Option<(f64, usize, f64, f64)>,
    asked: usize,
    /// The first of these events that has changed a value: time, name, and both values as text.
    pub(super) step_event: Option<(f64, String, String)>,
}

/// State of the host that a saved FMU state does not contain.
#[derive(Clone, Copy, Debug)]
pub struct Mark {
    time: f64,
    count: usize,
    next_event: Option<f64>,
    ended: Option<(f64, &'static str)>,
}

impl<'f> Session<'f> {
    /// Initialises with these start and stop times (s) and this tolerance.
    pub fn initialise_at(
        &mut self,
        start: f64,
        stop: Option<f64>,
        tolerance: Option<f64>,
    ) -> Result<()> {
        (self.ended, self.next_event) = (None, None);
        self.fmu.announce(format!("fmi2SetupExperiment, startTime = {start}"));
        self.instance.setup_experiment(tolerance, start, stop)?;
        self.time = start;
        self.fmu.announce("fmi2EnterInitializationMode");
        self.instance.enter_initialization_mode()?;
        self.leave_initialisation()
    }

    /// Calls fmi2ExitInitializationMode, and in Model Exchange goes on to continuous-time mode.
    pub fn leave_initialisation(&mut self) -> Result<()> {
        self.fmu.announce("fmi2ExitInitializationMode");
        self.instance.exit_initialization_mode()?;
        match self.interface {
            Interface::CoSimulation => Ok(()),
            Interface::ModelExchange => self.leave_event(),
        }
    }

    /// Iterates events until no new event is requested, and then enters continuous-time mode (Model
    /// Exchange).
    pub fn leave_event(&mut self) -> Result<()> {
        self.iterate_events()?;
        if self.is_ended() {
            return Ok(());
        }
        self.fmu.announce("fmi2EnterContinuousTimeMode");
        Ok(self.instance.enter_continuous_time_mode()?)
    }

    /// Calls fmi2NewDiscreteStates until no new iteration is requested.
    fn iterate_events(&mut self) -> Result<()> {
        self.fmu.announce("fmi2NewDiscreteStates");
        (self.values_changed, self.nominals_changed) = (false, false);
        for _ in 0..ITERATIONS {
            let info = self.instance.new_discrete_states()?;
            self.values_changed |= info.values_changed != 0;
            self.nominals_changed |= info.nominals_changed != 0;
            if info.terminate_simulation != 0 {
                self.end("fmi2NewDiscreteStates");
            }
            if info.new_discrete_states_needed == 0 || self.is_ended() {
                self.next_event =
                    (info.next_event_time_defined != 0).then_some(info.next_event_time);
                let now = self.next_event.is_some_and(|next| next == self.time);
                self.immediate_events = if now { self.immediate_events + 1 } else { 0 };
                let passed = |next: f64| next.is_nan() || next < self.time;
                if let Some(next) = self.next_event
                    && (passed(next) || self.immediate_events >= IMMEDIATE)
                {
                    self.past_event.get_or_insert((self.time, next));
                }
                return Ok(());
            }
        }
        let why = format!(
            "newDiscreteStatesNeeded is still true after {ITERATIONS} calls of \
             fmi2NewDiscreteStates at t = {:?} s, each of which returned fmi2OK (allowed: an \
             iteration that ends)",
            self.time
        );
        Err(Unusable { rule: "exchange.event_iteration", why }.into())
    }

    fn end(&mut self, call: &'static str) {
        self.ended.get_or_insert((self.time, call));
    }

    /// Returns true if the FMU has requested the end of the simulation, after which a host makes no more
    /// steps.
    pub fn is_ended(&self) -> bool {
        self.ended.is_some()
    }

    pub(super) fn states(&self) -> usize {
        self.fmu.description.states().len()
    }

    pub(super) fn nominal(&self, state: usize) -> f64 {
        self.nominals.get(state).copied().unwrap_or(UNKNOWN_NOMINAL)
    }

    /// Calls fmi2CompletedIntegratorStep and handles the events that follow. `crossed` says that an event
    /// indicator has changed its sign.
    pub(super) fn complete_step(&mut self, crossed: bool) -> Result<()> {
        let completed = self.instance.completed_integrator_step()?;
        if completed.terminate {
            self.end("fmi2CompletedIntegratorStep");
        }
        let due = self.next_event.is_some_and(|next| self.time >= next);
        if !(completed.enter_event_mode || crossed || due) {
            return Ok(());
        }
        let is_asked = !crossed && !due && self.asked < ASKED && self.step_event.is_none();
        if !is_asked {
            return self.event();
        }
        self.asked += 1;
        let before = Observed::read(self)?;
        self.event()?;
        if !self.is_ended()
            && let Some((name, change)) = before.change(&Observed::read(self)?, self.fmu)
        {
            self.step_event = Some((self.time, name.to_string(), change));
        }
        Ok(())
    }

    pub(super) fn event(&mut self) -> Result<()> {
        let n = self.states();
        let before = self.read_states(n)?;
        self.instance.enter_event_mode()?;
        self.leave_event()?;
        if self.values_changed || self.is_ended() {
            return Ok(());
        }
        let after = self.read_states(n)?;
        let jumps = |i: &usize| {
            let size = before[*i].abs().max(after[*i].abs()).max(1e-3 * self.nominal(*i));
            (before[*i] - after[*i]).abs() > JUMP * size
        };
        if let Some(i) = (0..n).find(jumps) {
            self.hidden_jump.get_or_insert((self.time, i, before[i], after[i]));
        }
        Ok(())
    }

    /// Sets all Real inputs to values that change from step to step.
    pub fn stimulate(&mut self) -> Called {
        let fmu = self.fmu;
        for (n, v) in fmu.inputs.iter().enumerate() {
            let x = stimulus(v, self.count, n);
            self.set(v, &Reading::Real(x))?;
        }
        Ok(())
    }

    /// Advances like [`Life::advance`], but with constant inputs.
    pub fn coast(&mut self, steps: usize) -> Result<()> {
        self.steps(steps, |_| Ok(()))
    }

    fn steps(&mut self, steps: usize, prepare: fn(&mut Self) -> Called) -> Result<()> {
        let rule = match self.interface {
            Interface::CoSimulation => "steps.run",
            Interface::ModelExchange => "exchange.run",
        };
        for _ in 0..steps {
            if self.is_ended() {
                break;
            }
            let done = prepare(self).map_err(anyhow::Error::from);
            done.and_then(|()| self.make_step(self.step)).map_err(|error| {
                match error.downcast() {
                    Ok(unusable) => Unusable { ..unusable },
                    Err(error) => Unusable { rule, why: error.to_string() },
                }
            })?;
        }
        Ok(())
    }

    /// Returns true if a step was discarded because the FMU requests the end of the simulation
    /// (fmi2Terminated).
    pub(super) fn has_terminated(&mut self, error: &CallError) -> bool {
        const TERMINATED: i32 = 3; // fmi2Terminated of fmi2StatusKind
        error.status == Status::Discard
            && self.instance.boolean_status(TERMINATED).is_ok_and(|ended| ended)
    }

    /// Makes one step of `h` seconds without changing the inputs. In Model Exchange the step may end earlier
    /// if the states change fast.
    pub fn make_step(&mut self, h: f64) -> Result<()> {
        self.fmu.announce(format!(
            "a step from {:?} s by {h:?} s ({})",
            self.time,
            FmuUnderTest::name(self.interface)
        ));
        match self.interface {
            Interface::CoSimulation => match self.instance.do_step(self.time, h) {
                Ok(()) => self.time += h,
                Err(error) if self.has_terminated(&error) => self.end("fmi2DoStep"),
                Err(error) => return Err(error.into()),
            },
            Interface::ModelExchange => self.integrate(self.time + h)?,
        }
        self.count += 1;
        Ok(())
    }

    pub fn indicators(&self) -> usize {
        let root = &self.fmu.description.root;
        root.number("numberOfEventIndicators").unwrap_or(0.0) as usize
    }

    pub fn get(&mut self, v: &Variable) -> Called<Reading> {
        let reference = [v.reference];
        Ok(match v.kind {
            Type::Real => {
                let mut value = [f64::NAN];
                self.instance.get_real(&reference, &mut value)?;
                Reading::Real(value[0])
            }
            Type::Integer | Type::Enumeration => {
                let mut value = [0];
                self.instance.get_integer(&reference, &mut value)?;
                Reading::Integer(value[0])
            }
            Type::Boolean => {
                let mut value = [0];
                self.instance.get_boolean(&reference, &mut value)?;
                Reading::Boolean(value[0])
            }
            // FMI 2.0 has no Binary and no Clock.
            Type::String | Type::Binary | Type::Clock => {
                Reading::Text(self.instance.get_string(&reference)?.pop().unwrap_or_default())
            }
        })
    }

    pub fn set(&mut self, v: &Variable, value: &Reading) -> Called {
        let reference = [v.reference];
        match value {
            Reading::Real(x) => self.instance.set_real(&reference, &[*x]),
            Reading::Integer(n) => self.instance.set_integer(&reference, &[*n]),
            Reading::Boolean(b) => self.instance.set_boolean(&reference, &[*b]),
            Reading::Text(text) => self.instance.set_string(&reference, &[text]),
        }
    }

    pub fn real(&mut self, v: &Variable) -> Result<f64> {
        Ok(if let Reading::Real(x) = self.read(v)? { x } else { f64::NAN })
    }

    /// Reads a variable in an ordinary run. If this fails, `values.readable` reports it.
    pub fn read(&mut self, v: &Variable) -> Result<Reading> {
        self.get(v).map_err(|error| {
            let why = format!("{} cannot be read: {error}", v.name);
            Unusable { rule: "values.readable", why }.into()
        })
    }
}

impl<'f> Life<'f, Fmi2> for Session<'f> {
    type Reading = Reading;
    type Mark = Mark;

    fn instance(&mut self) -> &mut Instance<'f> {
        &mut self.instance
    }

    /// Initialises with the FMU's default experiment, and in Model Exchange goes on to continuous-time mode.
    fn initialise(&mut self) -> Result<()> {
        let Experiment { start, tolerance, .. } = self.fmu.experiment();
        self.initialise_at(start, None, tolerance).map_err(|error| match error.downcast() {
            Ok(unusable) => Unusable { ..unusable }.into(),
            Err(error) => Unusable { rule: "load.initialises", why: error.to_string() }.into(),
        })
    }

    fn advance(&mut self, steps: usize) -> Result<()> {
        self.steps(steps, Session::stimulate)
    }

    fn readings(&mut self) -> Result<Vec<Reading>> {
        let fmu = self.fmu;
        fmu.variables().iter().map(|v| self.read(v)).collect()
    }

    fn difference(&self, ours: &[Reading], theirs: &[Reading]) -> Option<String> {
        let all = self.fmu.variables().iter().zip(ours.iter().zip(theirs));
        let mut different = all.filter(|(_, (a, b))| !a.is_identical(b));
        let (v, (a, b)) = different.next()?;
        let more = match different.count() {
            0 => String::new(),
            n => format!(" ({n} more differ)"),
        };
        Some(format!("{} is {a}, not {b}{more}", v.name))
    }

    fn mark(&self) -> Mark {
        Mark { time: self.time, count: self.count, next_event: self.next_event, ended: self.ended }
    }

    fn go_back(&mut self, to: &Mark) {
        (self.time, self.count) = (to.time, to.count);
        (self.next_event, self.ended) = (to.next_event, to.ended);
    }

    fn leave_trajectory(&mut self) -> Result<()> {
        let fmu = self.fmu;
        for v in fmu.variables().iter().filter(|v| v.is_set_by_hosts() && v.is_real()) {
            let Some(Reading::Real(start)) = start_value(v) else { continue };
            let (min, max) = v.bounds();
            let moved = start * 1.01;
            if moved >= min && moved <= max {
                // A value that the FMU refuses keeps its old value.
                let _ = self.set(v, &Reading::Real(moved));
            }
        }
        if self.initialise_at(fmu.experiment().start + 1.0, None, Some(1e-3)).is_ok() {
            self.count = 7;
            let _ = self.advance(5); // these parameters may have no solution
        }
        Ok(())
    }

    fn rewind(&mut self) {
        self.count = 0;
    }
}

/// Returns the value of input number `n` at a step: a sine around its start value, within its bounds.
pub fn stimulus(v: &Variable, step: usize, n: usize) -> f64 {
    let start = v.typed.number("start").filter(|x| x.is_finite()).unwrap_or(0.0);
    let (min, max) = v.bounds();
    let scale = match v.typed.number("nominal") {
        Some(_) => v.nominal(),
        None => start.abs().max(0.1),
    };
    let moved = start + 0.3 * scale * (0.7 * step as f64 + 1.0 + n as f64).sin();
    // Checked first, because clamp panics if min is above max.
    moved.max(min).min(max.max(min))
}

/// Reads the start value in modelDescription.xml, or returns `None` if there is none or it is not valid.
pub fn start_value(v: &Variable) -> Option<Reading> {
    let text = v.typed.get("start")?;
    Some(match v.kind {
        Type::Real => Reading::Real(host::xml::double(text)?),
        Type::Integer | Type::Enumeration => Reading::Integer(text.trim().parse().ok()?),
        Type::Boolean => Reading::Boolean(matches!(text.trim(), "true" | "1").into()),
        Type::String | Type::Binary | Type::Clock => Reading::Text(text.to_string()),
    })
}

pub(super) fn copy_files(from: &Path, to: &Path) -> Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let (path, name) = entry.map(|e| (e.path(), e.file_name()))?;
        let copy = to.join(&name);
        // A library must be copied, because otherwise the loader takes it for the one that is already
        // loaded. For all other files a hard link is enough.
        let is_library = path.extension().is_some_and(|e| e == std::env::consts::DLL_EXTENSION);
        if path.is_dir() {
            copy_files(&path, &copy)?;
        } else if is_library || std::fs::hard_link(&path, &copy).is_err() {
            std::fs::copy(&path, &copy)?;
        }
    }
    Ok(())
}
