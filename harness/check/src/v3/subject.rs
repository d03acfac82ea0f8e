//! The FMU 3.0 under test: the calls of a host of FMI 3.0, and shortcuts for its rules.

use anyhow::Result;

use crate::description::{Description, Variable};
use crate::under_test::{Session as Of, Tested, UnderTest, Unusable, Use};
use host::c_abi::{CallError, Called, Message};
use host::fmi3::{EventInfo, Fmi3, Fmu, Instance, Instantiation, Interface, Step, Update};
use host::xml::double;

pub use crate::under_test::{STEPS, start_values};

pub type Subject = UnderTest<Fmi3>;
pub type Session<'f> = Of<'f, Fmi3>;

/// Number of calls of fmi3UpdateDiscreteStates after which an event iteration counts as endless.
const ITERATIONS: usize = 100;
/// Number of events in one communication step after which the simulation is given up. The FMU may otherwise
/// request events for ever.
const EVENTS: usize = 1000;

/// Callback for intermediate updates within a step. It returns the time of an early return, or `None`.
pub type Within<'a> = dyn FnMut(&Update) -> Option<f64> + 'a;

#[derive(Default)]
pub struct Notes {
    pub events: usize,
    /// The first event indicator that was 0 after event mode: time and index.
    pub zero_indicator: Option<(f64, usize)>,
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
}

impl Tested for Fmi3 {
    const EXCHANGE_RUNS: &'static str = "steps.run";
    const FMI: &'static str = "fmi3";
    const STATE: &'static str = "FMUState";
    const TERMINATION: Option<&'static str> = None;
    const UNKNOWN_READ: &'static str = "fmi3GetFloat64 of a valueReference that no variable has";
    const REPORTS_MISSING: bool = true;
    const EXCHANGE_STEPS: f64 = 0.0;
    const SUGGESTED_STEPS: f64 = STEPS as f64;
    type Notes = Notes;

    /// Returns true unless the interface is Co-Simulation and the FMU has clocks. Clocks need event mode with clock
    /// activation, and no rule makes these calls.
    fn is_called(description: &Description, interface: Interface, _: &Fmu) -> bool {
        interface == Interface::ModelExchange || !description.has_clocks()
    }

    fn uses(fmu: &Subject) -> Vec<Use> {
        let mut uses = fmu.plain_uses();
        let stepping = Interface::CoSimulation;
        if fmu.has(stepping) && fmu.has_capability(stepping, "hasEventMode") {
            uses.push(Use { event_mode: true, ..Use::PLAIN });
            uses.push(Use { event_mode: true, early_return: true, ..Use::PLAIN });
        }
        if fmu.has(stepping) && fmu.has_capability(stepping, "mightReturnEarlyFromDoStep") {
            uses.push(Use { early_return: true, ..Use::PLAIN });
        }
        uses
    }

    fn make_instance(fmu: &Subject, using: Use) -> Result<Result<Instance<'_>, CallError>> {
        fmu.announce(format!("making an instance for {using}"));
        fmu.instantiate(&fmu.instantiation(using)?)
    }

    fn notes(_: &Subject) -> Notes {
        Notes::default()
    }

    fn initialise(session: &mut Session) -> Result<()> {
        session.enter_initialization()?;
        session.leave_initialization()
    }

    fn make_usual_step(session: &mut Session) -> Result<()> {
        session.stimulate()?;
        session.count += 1;
        session.advance_to(session.time + session.step)
    }

    fn magnitudes(session: &mut Session) -> Called<Vec<f64>> {
        session.nominals()
    }

    fn complete_step(session: &mut Session, crossed: bool) -> Result<()> {
        let completed = session.instance.completed_integrator_step()?;
        if completed.terminate {
            session.end("fmi3CompletedIntegratorStep");
        }
        let due = session.next_event.is_some_and(|next| session.time >= next);
        if (completed.enter_event_mode || crossed || due) && !session.is_ended() {
            session.event()?;
        }
        Ok(())
    }

    fn stimulus(v: &Variable, step: usize, n: usize) -> Vec<f64> {
        let (min, max) = v.bounds();
        let swing = 0.25 * (0.7 * (step + 3 * n) as f64 + 0.3).sin();
        let starts: Vec<f64> = v.starts.iter().filter_map(|s| double(s)).collect();
        let start = |i: usize| starts.get(i).or(starts.first()).copied().unwrap_or(0.0);
        let one = |i: usize| {
            let x = start(i);
            let size = if x == 0.0 { v.nominal() } else { x.abs() };
            (x + swing * size).max(min).min(max.max(min))
        };
        (0..v.length()).map(one).collect()
    }

    fn leave_trajectory(session: &mut Session) -> Result<()> {
        session.initialise()?;
        session.advance(STEPS)
    }

    fn provoke_messages(fmu: &Subject) -> Result<(Vec<Message>, usize)> {
        let mut session = fmu.running(fmu.plain_uses()[0])?;
        session.advance(2)?;
        let refused = session.provoke_refusal();
        let mut messages = session.instance.take_messages();
        messages.extend(refused.into_iter().flat_map(|error| error.messages));
        Ok((messages, session.instance.uncategorised()))
    }
}

impl Subject {
    pub fn plain_uses(&self) -> Vec<Use> {
        let uses = [Use::PLAIN, Use::EXCHANGE].into_iter();
        uses.filter(|u| self.has(u.interface)).collect()
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

    /// Instantiates the FMU with the arguments `with`. The inner error is the refusal by the FMU. The outer error ends
    /// the rule, because the check cannot create an instance at all.
    pub fn instantiate(&self, with: &Instantiation) -> Result<Result<Instance<'_>, CallError>> {
        let binary = self.binary(with.interface)?;
        self.make(with.interface, || binary.instantiate_with(with))
    }
}

impl Session<'_> {
    pub fn enter_initialization(&mut self) -> Result<()> {
        self.fmu.announce("fmi3EnterInitializationMode");
        let tolerance = self.fmu.experiment().tolerance;
        self.instance
            .enter_initialization_mode(tolerance, self.time, None)
            .map_err(initialisation_failure)
    }

    pub fn leave_initialization(&mut self) -> Result<()> {
        self.fmu.announce("fmi3ExitInitializationMode");
        self.instance.exit_initialization_mode().map_err(initialisation_failure)?;
        if self.using.event_mode || self.using.interface == Interface::ModelExchange {
            self.leave_event()?;
        }
        Ok(())
    }

    /// Iterates events until no new iteration is requested, and leaves event mode. Returns the results of the
    /// last iteration.
    pub fn leave_event(&mut self) -> Result<EventInfo> {
        let info = self.iterate()?;
        if self.is_ended() {
            return Ok(info);
        }
        match self.using.interface {
            Interface::CoSimulation => {
                self.fmu.announce("fmi3EnterStepMode");
                self.instance.enter_step_mode()?;
            }
            Interface::ModelExchange => {
                self.fmu.announce("fmi3EnterContinuousTimeMode");
                self.instance.enter_continuous_time_mode()?;
            }
        }
        Ok(info)
    }

    pub fn iterate(&mut self) -> Result<EventInfo> {
        self.fmu.announce("fmi3UpdateDiscreteStates");
        for _ in 0..ITERATIONS {
            let info = self.instance.update_discrete_states()?;
            if info.terminate == 1 {
                self.end("fmi3UpdateDiscreteStates");
            }
            if info.needs_update != 1 || self.is_ended() {
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

    /// Enters event mode, iterates until no further event is requested, leaves event mode, and
    /// notes event indicators that are 0 afterwards.
    pub fn event(&mut self) -> Result<EventInfo> {
        self.notes.events += 1;
        self.fmu.announce(format!("event mode at {:?} s", self.time));
        self.instance.enter_event_mode()?;
        let info = self.leave_event()?;
        if self.using.interface == Interface::ModelExchange && !self.is_ended() {
            let zero = self.indicators()?.iter().position(|z| *z == 0.0).map(|i| (self.time, i));
            self.notes.zero_indicator = self.notes.zero_indicator.or(zero);
        }
        Ok(info)
    }

    pub fn raw_step(&mut self, h: f64) -> Called<Step> {
        self.raw_step_with_updates(h, None)
    }

    pub fn raw_step_with_updates(&mut self, h: f64, within: Option<&mut Within>) -> Called<Step> {
        self.fmu.announce(format!("fmi3DoStep from {:?} s by {h:?} s ({})", self.time, self.using));
        let step = match within {
            Some(within) => self.instance.do_step_with_updates(self.time, h, Some(within))?,
            None => self.instance.do_step(self.time, h)?,
        };
        if step.terminate == 1 {
            self.end("fmi3DoStep");
        }
        // If the FMU returns early, it reports the time that it has reached; otherwise the time is the end of the step.
        self.time = match step.early_return == 1 && step.last_time.is_finite() {
            true => step.last_time,
            false => self.time + h,
        };
        Ok(step)
    }

    /// Advances to the time `until` (s), and enters event mode when the FMU requests it. In Model Exchange the run ends
    /// earlier if the states change fast.
    pub fn advance_to(&mut self, until: f64) -> Result<()> {
        if self.using.interface == Interface::ModelExchange {
            self.fmu.announce(format!("integrating from {:?} s", self.time));
            return self.integrate(until);
        }
        for _ in 0..EVENTS {
            let h = until - self.time;
            if h <= 1e-12 * until.abs().max(self.step) || self.is_ended() {
                return Ok(());
            }
            let step = self.raw_step(h).map_err(runs)?;
            if step.event == 1 && self.using.event_mode && !self.is_ended() {
                self.event()?;
            }
        }
        let why = format!("the FMU requests more than {EVENTS} events before t = {until} s");
        Err(Unusable { rule: "events.iteration", why }.into())
    }
}

fn initialisation_failure(error: CallError) -> anyhow::Error {
    Unusable { rule: "load.initialises", why: error.to_string() }.into()
}

fn runs(error: CallError) -> anyhow::Error {
    Unusable { rule: "steps.run", why: error.to_string() }.into()
}
