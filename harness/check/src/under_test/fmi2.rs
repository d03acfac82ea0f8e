//! The FMU 2.0 under test: the calls of a host of FMI 2.0, and shortcuts for its rules.

use std::path::Path;

use anyhow::Result;

use super::{Experiment, Observed, STEPS, Session, Tested, UnderTest, Unusable, Use, start_value};
use crate::description::{Description, Variable};
use host::c_abi::version::Interface;
use host::description::Value;
use host::fmi2::{
    CO_SIMULATION, CallError, Called, Fmi2, Fmu, Instance, Instantiation, MODEL_EXCHANGE, Message,
    Status,
};

pub type FmuUnderTest = UnderTest<Fmi2>;

/// Number of calls of fmi2NewDiscreteStates after which an event iteration counts as endless.
const ITERATIONS: usize = 100;
/// Largest number of events that may follow each other at the same time. An FMU that always requests the next event
/// at once breaks a rule.
const IMMEDIATE: usize = 3;
/// Largest number of events in a session before and after which all values are compared. Only events that
/// fmi2CompletedIntegratorStep requests, without a time event or a crossing, are compared.
const MOST_COMPARED_EVENTS: usize = 20;
/// Relative change of a state at an event below which the change counts as rounding.
const JUMP: f64 = 1e-9;
const UNKNOWN_NOMINAL: f64 = 1e-3;

#[derive(Default)]
pub struct Notes {
    nominals: Vec<f64>,
    /// The first time at which nextEventTime was in the past, and this nextEventTime, s.
    pub past_event: Option<(f64, f64)>,
    immediate_events: usize,
    values_changed: bool,
    pub nominals_changed: bool,
    /// The first state that an event has changed although valuesOfContinuousStatesChanged was false: time,
    /// index, and both values.
    pub hidden_jump: Option<(f64, usize, f64, f64)>,
    compared_events: usize,
    /// The first variable that changed in an event which only fmi2CompletedIntegratorStep had requested: time of the
    /// event (s), name of the variable, and its old and new value, for example `1 to 2`.
    pub step_event: Option<(f64, String, String)>,
}

impl Tested for Fmi2 {
    const EXCHANGE_RUNS: &'static str = "exchange.run";
    const FMI: &'static str = "fmi2";
    const STATE: &'static str = "FMUstate";
    const TERMINATION: Option<&'static str> = Some("exchange.terminate_simulation");
    const UNKNOWN_READ: &'static str = "fmi2GetReal of an unknown value reference";
    const REPORTS_MISSING: bool = false;
    const EXCHANGE_STEPS: f64 = (3 * STEPS) as f64;
    const SUGGESTED_STEPS: f64 = 1.0;
    type Notes = Notes;

    fn is_called(_: &Description, interface: Interface, binary: &Fmu) -> bool {
        interface == Interface::CoSimulation || binary.has_exchange()
    }

    fn uses(fmu: &FmuUnderTest) -> Vec<Use> {
        fmu.interfaces().into_iter().map(Use::from).collect()
    }

    fn make_instance(fmu: &FmuUnderTest, using: Use) -> Result<Result<Instance<'_>, CallError>> {
        fmu.announce("fmi2Instantiate");
        let with = Instantiation { logging: false, ..fmu.arguments(using.interface)? };
        fmu.instantiate(using.interface, &with)
    }

    fn notes(fmu: &FmuUnderTest) -> Notes {
        let nominal = |(_, state): (&Variable, &Variable)| {
            state.typed.number("nominal").map_or(UNKNOWN_NOMINAL, |_| state.nominal())
        };
        Notes { nominals: fmu.states().into_iter().map(nominal).collect(), ..Notes::default() }
    }

    fn initialise(session: &mut Session) -> Result<()> {
        let Experiment { start, tolerance, .. } = session.fmu.experiment();
        session.initialise_at(start, None, tolerance).map_err(|error| match error.downcast() {
            Ok(unusable) => Unusable { ..unusable }.into(),
            Err(error) => Unusable { rule: "load.initialises", why: error.to_string() }.into(),
        })
    }

    fn make_usual_step(session: &mut Session) -> Result<()> {
        session.steps(1, Session::stimulate)
    }

    fn magnitudes(session: &mut Session) -> Called<Vec<f64>> {
        Ok(session.notes.nominals.clone())
    }

    fn complete_step(session: &mut Session, crossed: bool) -> Result<()> {
        let completed = session.instance.completed_integrator_step()?;
        if completed.terminate {
            session.end("fmi2CompletedIntegratorStep");
        }
        let due = session.next_event.is_some_and(|next| session.time >= next);
        if !(completed.enter_event_mode || crossed || due) {
            return Ok(());
        }
        let is_asked = !crossed
            && !due
            && session.notes.compared_events < MOST_COMPARED_EVENTS
            && session.notes.step_event.is_none();
        if !is_asked {
            return session.event();
        }
        session.notes.compared_events += 1;
        let before = Observed::read(session)?;
        session.event()?;
        if !session.is_ended()
            && let Some((name, change)) = before.change(&Observed::read(session)?, session.fmu)
        {
            session.notes.step_event = Some((session.time, name.to_string(), change));
        }
        Ok(())
    }

    fn stimulus(v: &Variable, step: usize, n: usize) -> Vec<f64> {
        let start = v.typed.number("start").filter(|x| x.is_finite()).unwrap_or(0.0);
        let (min, max) = v.bounds();
        let scale = match v.typed.number("nominal") {
            Some(_) => v.nominal(),
            None => start.abs().max(0.1),
        };
        let moved = start + 0.3 * scale * (0.7 * step as f64 + 1.0 + n as f64).sin();
        // min and max are compared first, because clamp panics if min is above max.
        vec![moved.max(min).min(max.max(min))]
    }

    fn leave_trajectory(session: &mut Session) -> Result<()> {
        let fmu = session.fmu;
        for v in fmu.variables().iter().filter(|v| v.is_set_by_hosts() && v.is_real()) {
            let Some(Value::Real(start)) = start_value(v) else { continue };
            let (min, max) = v.bounds();
            let moved = start * 1.01;
            if moved >= min && moved <= max {
                // If the FMU refuses the value, the variable keeps its old value.
                let _ = session.set(v, &Value::Real(moved));
            }
        }
        if session.initialise_at(fmu.experiment().start + 1.0, None, Some(1e-3)).is_ok() {
            session.count = 7;
            let _ = session.advance(5); // these parameters may have no solution
        }
        Ok(())
    }

    fn provoke_messages(fmu: &FmuUnderTest) -> Result<(Vec<Message>, usize)> {
        let interface = fmu.first_interface()?;
        let mut all = Vec::new();
        fmu.announce("fmi2Instantiate with another GUID");
        let with = Instantiation { guid: Some("another"), ..fmu.arguments(interface)? };
        if let Err(error) = fmu.instantiate(interface, &with)? {
            all.extend(error.messages);
        }
        let mut session = fmu.session(interface)?;
        fmu.announce("fmi2SetDebugLogging");
        session
            .instance
            .set_debug_logging(true, &[])
            .map_err(|error| Unusable { rule: "log.switch", why: error.to_string() })?;
        fmu.with_crash_reported_by("life.order", || {
            fmu.announce("fmi2ExitInitializationMode in state \"instantiated\"");
            let _ = session.instance.exit_initialization_mode();
        });
        if session.initialise().is_ok() {
            session.provoke_refusal();
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

impl FmuUnderTest {
    /// Returns the interface that most rules use: Co-Simulation if it can be called.
    pub fn first_interface(&self) -> Result<Interface> {
        let why = || Unusable {
            rule: "load.instance",
            why: "the FMU offers no interface that can be called".into(),
        };
        Ok(*self.interfaces().first().ok_or_else(why)?)
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

    /// Instantiates the FMU with the arguments `with`. The outer error ends the rule ([`make`](UnderTest::make)); the
    /// inner error states why the FMU returned no instance.
    pub fn instantiate(
        &self,
        interface: Interface,
        with: &Instantiation,
    ) -> Result<Result<Instance<'_>, CallError>> {
        let binary = self.binary(interface)?;
        self.make(interface, || binary.instantiate_with(with))
    }

    pub fn arguments(&self, interface: Interface) -> Result<Instantiation<'_>> {
        let plain = self.binary(interface)?.instantiation("check");
        Ok(Instantiation { kind: kind(interface), ..plain })
    }

    pub fn session_with(&self, interface: Interface, with: &Instantiation) -> Result<Session<'_>> {
        let instance = self.instantiate(interface, with)?;
        self.session_of(interface.into(), instance)
    }

    pub fn session_in(&self, using: impl Into<Use>, stage: Stage) -> Result<Session<'_>> {
        if matches!(stage, Stage::Initialised | Stage::Terminated) {
            let mut session = self.running(using)?;
            if stage == Stage::Terminated {
                session.instance.terminate()?;
            }
            return Ok(session);
        }
        let mut session = self.session(using)?;
        if stage == Stage::Initialization {
            session.instance.setup_experiment(None, session.time, None)?;
            session.instance.enter_initialization_mode()?;
        }
        Ok(session)
    }
}

impl Session<'_> {
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

    /// Calls fmi2ExitInitializationMode and, in Model Exchange, continues to continuous-time mode.
    pub fn leave_initialisation(&mut self) -> Result<()> {
        self.fmu.announce("fmi2ExitInitializationMode");
        self.instance.exit_initialization_mode()?;
        match self.using.interface {
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

    fn iterate_events(&mut self) -> Result<()> {
        self.fmu.announce("fmi2NewDiscreteStates");
        (self.notes.values_changed, self.notes.nominals_changed) = (false, false);
        for _ in 0..ITERATIONS {
            let info = self.instance.new_discrete_states()?;
            self.notes.values_changed |= info.values_changed != 0;
            self.notes.nominals_changed |= info.nominals_changed != 0;
            if info.terminate_simulation != 0 {
                self.end("fmi2NewDiscreteStates");
            }
            if info.new_discrete_states_needed == 0 || self.is_ended() {
                self.next_event =
                    (info.next_event_time_defined != 0).then_some(info.next_event_time);
                let now = self.next_event.is_some_and(|next| next == self.time);
                self.notes.immediate_events = if now { self.notes.immediate_events + 1 } else { 0 };
                let passed = |next: f64| next.is_nan() || next < self.time;
                if let Some(next) = self.next_event
                    && (passed(next) || self.notes.immediate_events >= IMMEDIATE)
                {
                    self.notes.past_event.get_or_insert((self.time, next));
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

    pub(crate) fn event(&mut self) -> Result<()> {
        let before = self.states()?;
        self.instance.enter_event_mode()?;
        self.leave_event()?;
        if self.notes.values_changed || self.is_ended() {
            return Ok(());
        }
        let after = self.states()?;
        let jumps = |i: &usize| {
            let nominal = 1e-3 * self.notes.nominals[*i];
            let size = before[*i].abs().max(after[*i].abs()).max(nominal);
            (before[*i] - after[*i]).abs() > JUMP * size
        };
        if let Some(i) = (0..before.len()).find(jumps) {
            self.notes.hidden_jump.get_or_insert((self.time, i, before[i], after[i]));
        }
        Ok(())
    }

    /// Advances the simulation like [`Session::advance`], but with constant inputs.
    pub fn coast(&mut self, steps: usize) -> Result<()> {
        self.steps(steps, |_| Ok(()))
    }

    fn steps(&mut self, steps: usize, prepare: fn(&mut Self) -> Called) -> Result<()> {
        let rule = match self.using.interface {
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
    pub(crate) fn has_terminated(&mut self, error: &CallError) -> bool {
        const TERMINATED: i32 = 3; // fmi2Terminated of fmi2StatusKind
        error.status == Status::Discard
            && self.instance.boolean_status(TERMINATED).is_ok_and(|ended| ended)
    }

    /// Makes one step of `h` seconds without changing the inputs. In Model Exchange the step may end earlier
    /// if the states change fast.
    pub fn make_step(&mut self, h: f64) -> Result<()> {
        self.fmu.announce(format!("a step from {:?} s by {h:?} s ({})", self.time, self.using));
        match self.using.interface {
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

    pub fn get(&mut self, v: &Variable) -> Called<Value> {
        Ok(self.elements(v)?.remove(0))
    }

    pub fn set(&mut self, v: &Variable, value: &Value) -> Called {
        self.instance.set_values(v.c_type, v.reference, std::slice::from_ref(value))
    }

    pub fn real(&mut self, v: &Variable) -> Result<f64> {
        Ok(self.read(v)?[0].number())
    }
}

pub fn copy_files(from: &Path, to: &Path) -> Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let (path, name) = entry.map(|e| (e.path(), e.file_name()))?;
        let copy = to.join(&name);
        // A library must be copied, because the loader would take a link for the library that is already loaded. For
        // all other files a hard link is enough.
        let is_library = path.extension().is_some_and(|e| e == std::env::consts::DLL_EXTENSION);
        if path.is_dir() {
            copy_files(&path, &copy)?;
        } else if is_library || std::fs::hard_link(&path, &copy).is_err() {
            std::fs::copy(&path, &copy)?;
        }
    }
    Ok(())
}
