//! The FMU under test, loaded and called as hosts do, and what rules need to do so shortly.

use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::description::{Description, Variable};
use super::process::Trace;
use host::description::Type;
use host::fmi2::{CO_SIMULATION, CallError, Called, Fmu, Instance, MODEL_EXCHANGE, Status};

/// Steps of a short run.
pub const STEPS: usize = 20;

/// One of the two interfaces of FMI 2.0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interface {
    /// The FMU integrates.
    CoSimulation,
    /// The host integrates.
    ModelExchange,
}

/// Nothing can be said on most rules: one rule tells why, the others are skipped.
#[derive(Debug)]
pub struct Unusable {
    /// The rule that tells.
    pub rule: &'static str,
    /// Why.
    pub why: String,
}

impl std::fmt::Display for Unusable {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.why)
    }
}

impl std::error::Error for Unusable {}

/// The loaded FMU.
pub struct Guest {
    fmu: Fmu,
    description: Description,
    trace: Trace,
    doing: RefCell<String>,
    sessions: Cell<usize>,
    directory: PathBuf,
    path: PathBuf,
}

/// A value as it was read.
#[derive(Clone, Debug)]
pub enum Reading {
    /// Of a Real.
    Real(f64),
    /// Of an Integer or an Enumeration.
    Integer(i32),
    /// Of a Boolean, as C has it.
    Boolean(i32),
    /// Of a String.
    Text(String),
}

impl Reading {
    /// Whether it is the same to the last bit.
    pub fn is(&self, other: &Reading) -> bool {
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

/// Start, stop, tolerance and step: as the FMU suggests, or what fits most.
#[derive(Clone, Copy, Debug)]
pub struct Experiment {
    /// Start time, s.
    pub start: f64,
    /// Relative tolerance, if one is suggested.
    pub tolerance: Option<f64>,
    /// Communication step, s.
    pub step: f64,
}

impl Guest {
    /// Loads the FMU that is unpacked in `directory`.
    pub fn open(directory: &Path, path: &Path, trace: Trace) -> Result<Guest> {
        let fmu = Fmu::load(directory, path)?;
        let xml = std::fs::read(directory.join("modelDescription.xml"))?;
        let description = Description::read(&xml).map_err(anyhow::Error::msg)?;
        Ok(Guest {
            fmu,
            description,
            trace,
            doing: RefCell::default(),
            sessions: Cell::new(0),
            directory: directory.to_path_buf(),
            path: path.to_path_buf(),
        })
    }

    /// Unloads it.
    pub fn close(self) -> Trace {
        self.trace
    }

    /// Copies the unpacked FMU to `directory` and loads the copy: a library of its own.
    pub fn copy(&self, directory: &Path) -> Result<Guest> {
        copy_files(&self.directory, directory)?;
        Guest::open(directory, &self.path, self.trace.again()?)
    }

    /// Tells what comes next: the place of what goes wrong then.
    pub fn doing(&self, what: impl Into<String>) {
        let what = what.into();
        self.trace.doing(&what);
        *self.doing.borrow_mut() = what;
    }

    /// What it was told last.
    pub fn now(&self) -> String {
        let doing = self.doing.borrow();
        if doing.is_empty() { "a first call".into() } else { doing.clone() }
    }

    /// The loaded binary.
    pub fn fmu(&self) -> &Fmu {
        &self.fmu
    }

    /// What the FMU says of itself.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// The variables.
    pub fn variables(&self) -> &[Variable] {
        &self.description.variables
    }

    /// The interfaces it offers, Co-Simulation first.
    pub fn interfaces(&self) -> Vec<Interface> {
        let d = &self.description;
        let stepping = d.co_simulation.is_some().then_some(Interface::CoSimulation);
        let exchange = d.model_exchange.is_some() && self.fmu.has_exchange();
        stepping.into_iter().chain(exchange.then_some(Interface::ModelExchange)).collect()
    }

    /// Whether an interface declares a capability.
    pub fn can(&self, interface: Interface, flag: &str) -> bool {
        let element = match interface {
            Interface::CoSimulation => &self.description.co_simulation,
            Interface::ModelExchange => &self.description.model_exchange,
        };
        element.as_ref().is_some_and(|element| element.flag(flag))
    }

    /// What the FMU suggests.
    pub fn experiment(&self) -> Experiment {
        let element = self.description.root.child("DefaultExperiment");
        let number = |name: &str| element.and_then(|e| e.number(name)).filter(|x| x.is_finite());
        let start = number("startTime").unwrap_or(0.0);
        let above_0 = |x: &f64| *x > 0.0;
        let span = number("stopTime").map(|stop| stop - start).filter(above_0);
        let step = number("stepSize").filter(above_0).or(span.map(|span| span / 500.0));
        Experiment {
            start,
            tolerance: number("tolerance").filter(above_0),
            step: step.unwrap_or(0.01),
        }
    }

    /// A new instance.
    pub fn session(&self, interface: Interface) -> Result<Session<'_>> {
        if self.sessions.get() > 0 && self.can(interface, "canBeInstantiatedOnlyOncePerProcess") {
            let why = "it can be instantiated only once per process".into();
            return Err(Unusable { rule: "", why }.into());
        }
        self.sessions.set(self.sessions.get() + 1);
        self.doing("fmi2Instantiate");
        let mut with = self.fmu.instantiation("check");
        with.kind = interface.kind();
        with.logging = false;
        let instance = self
            .fmu
            .instantiate_with(&with)
            .map_err(|error| Unusable { rule: "load.instance", why: error.to_string() })?;
        let Experiment { start, step, .. } = self.experiment();
        Ok(Session {
            guest: self,
            interface,
            instance,
            time: start,
            step,
            count: 0,
            next_event: None,
        })
    }

    /// A new instance, initialised with what the FMU suggests.
    pub fn running(&self, interface: Interface) -> Result<Session<'_>> {
        self.session_in(interface, Stage::Initialised)
    }

    /// A new instance in a state of its life.
    pub fn session_in(&self, interface: Interface, stage: Stage) -> Result<Session<'_>> {
        let mut session = self.session(interface)?;
        match stage {
            Stage::Instantiated => {}
            Stage::Initialization => {
                session.instance.setup_experiment(None, session.time, None)?;
                session.instance.enter_initialization_mode()?;
            }
            Stage::Initialised => session.initialise()?,
            Stage::Terminated => {
                session.initialise()?;
                session.instance.terminate()?;
            }
        }
        Ok(session)
    }
}

/// The states of an instance's life in which rules call it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// After fmi2Instantiate.
    Instantiated,
    /// After fmi2EnterInitializationMode.
    Initialization,
    /// Ready for a step; in Model Exchange in continuous-time mode.
    Initialised,
    /// After fmi2Terminate.
    Terminated,
}

impl Stage {
    /// As findings name it.
    pub fn name(self) -> &'static str {
        match self {
            Stage::Instantiated => "instantiated",
            Stage::Initialization => "initialization mode",
            Stage::Initialised => "initialised",
            Stage::Terminated => "terminated",
        }
    }
}

impl Interface {
    /// `fmi2Type`.
    pub fn kind(self) -> i32 {
        match self {
            Interface::CoSimulation => CO_SIMULATION,
            Interface::ModelExchange => MODEL_EXCHANGE,
        }
    }

    /// As findings name it.
    pub fn name(self) -> &'static str {
        match self {
            Interface::CoSimulation => "Co-Simulation",
            Interface::ModelExchange => "Model Exchange",
        }
    }
}

/// An instance and how far it is.
pub struct Session<'g> {
    /// The FMU.
    pub guest: &'g Guest,
    /// What it was made for.
    pub interface: Interface,
    /// The instance.
    pub instance: Instance<'g>,
    /// Time reached, s.
    pub time: f64,
    /// Communication step, s.
    pub step: f64,
    /// Steps made; inputs follow it.
    pub count: usize,
    next_event: Option<f64>,
}

/// How far a host is.
#[derive(Clone, Copy, Debug)]
pub struct Mark {
    time: f64,
    count: usize,
    next_event: Option<f64>,
}

impl<'g> Session<'g> {
    /// fmi2SetupExperiment to fmi2ExitInitializationMode, and in Model Exchange on to
    /// continuous-time mode, with what the FMU suggests.
    pub fn initialise(&mut self) -> Result<()> {
        let Experiment { start, tolerance, .. } = self.guest.experiment();
        self.initialise_at(start, None, tolerance)
            .map_err(|error| Unusable { rule: "load.initialises", why: error.to_string() }.into())
    }

    /// As above, at any time.
    pub fn initialise_at(
        &mut self,
        start: f64,
        stop: Option<f64>,
        tolerance: Option<f64>,
    ) -> Called {
        self.guest.doing(format!("fmi2SetupExperiment, startTime = {start}"));
        self.instance.setup_experiment(tolerance, start, stop)?;
        self.time = start;
        self.guest.doing("fmi2EnterInitializationMode");
        self.instance.enter_initialization_mode()?;
        self.leave_initialisation()
    }

    /// fmi2ExitInitializationMode, and in Model Exchange on to continuous-time mode.
    pub fn leave_initialisation(&mut self) -> Called {
        self.guest.doing("fmi2ExitInitializationMode");
        self.instance.exit_initialization_mode()?;
        match self.interface {
            Interface::CoSimulation => Ok(()),
            Interface::ModelExchange => self.leave_event(),
        }
    }

    /// Model Exchange: iterates in event mode until nothing is new, then goes on to continuous-time
    /// mode.
    pub fn leave_event(&mut self) -> Called {
        const ITERATIONS: usize = 100;
        self.guest.doing("fmi2NewDiscreteStates");
        for _ in 0..ITERATIONS {
            let info = self.instance.new_discrete_states()?;
            self.next_event = (info.next_event_time_defined != 0).then_some(info.next_event_time);
            if info.new_discrete_states_needed == 0 {
                self.guest.doing("fmi2EnterContinuousTimeMode");
                return self.instance.enter_continuous_time_mode();
            }
        }
        Err(CallError {
            call: "fmi2NewDiscreteStates",
            status: Status::Discard,
            messages: Vec::new(),
        })
    }

    /// Sets all Real inputs to values that change from step to step.
    pub fn stimulate(&mut self) -> Called {
        let guest = self.guest;
        let inputs =
            guest.variables().iter().filter(|v| v.causality == "input" && v.is_continuous());
        for (n, v) in inputs.enumerate() {
            let x = stimulus(v, self.count, n);
            self.set(v, &Reading::Real(x))?;
        }
        Ok(())
    }

    /// Makes steps of the usual size, inputs changing.
    pub fn advance(&mut self, steps: usize) -> Called {
        for _ in 0..steps {
            self.stimulate()?;
            self.go(self.step)?;
        }
        Ok(())
    }

    /// What the host knows of how far it is; a saved state does not tell it.
    pub fn mark(&self) -> Mark {
        Mark { time: self.time, count: self.count, next_event: self.next_event }
    }

    /// Back to where the host was.
    pub fn go_back(&mut self, to: &Mark) {
        (self.time, self.count, self.next_event) = (to.time, to.count, to.next_event);
    }

    /// Whether a step was discarded because the FMU wants to end the simulation.
    pub fn has_ended(&mut self, error: &CallError) -> bool {
        const TERMINATED: i32 = 3; // fmi2Terminated of fmi2StatusKind
        error.status == Status::Discard
            && self.interface == Interface::CoSimulation
            && self.instance.boolean_status(TERMINATED).is_ok_and(|ended| ended)
    }

    /// One step of any size, inputs as they are.
    pub fn go(&mut self, h: f64) -> Called {
        self.guest.doing(format!(
            "a step from {:?} s by {h:?} s ({})",
            self.time,
            self.interface.name()
        ));
        match self.interface {
            Interface::CoSimulation => {
                self.instance.do_step(self.time, h)?;
                self.time += h;
            }
            Interface::ModelExchange => {
                // Euler, in smaller steps: it only has to stay alive, and ends where h ends.
                const PARTS: usize = 8;
                let end = self.time + h;
                let from = self.time;
                for part in 1..=PARTS {
                    let to =
                        if part == PARTS { end } else { from + h * part as f64 / PARTS as f64 };
                    self.euler(to)?;
                }
            }
        }
        self.count += 1;
        Ok(())
    }

    fn euler(&mut self, to: f64) -> Called {
        let states = self.guest.description.states().len();
        let indicators = self.indicators();
        let (mut x, mut dx) = (vec![0.0; states], vec![0.0; states]);
        let (mut before, mut after) = (vec![0.0; indicators], vec![0.0; indicators]);
        if indicators > 0 {
            self.instance.event_indicators(&mut before)?;
        }
        if states > 0 {
            self.instance.continuous_states(&mut x)?;
            self.instance.derivatives(&mut dx)?;
        }
        for (x, dx) in x.iter_mut().zip(&dx) {
            *x += (to - self.time) * dx;
        }
        self.instance.set_time(to)?;
        self.time = to;
        if states > 0 {
            self.instance.set_continuous_states(&x)?;
        }
        if indicators > 0 {
            self.instance.event_indicators(&mut after)?;
        }
        let (enter, _) = self.instance.completed_integrator_step()?;
        let crossed = before.iter().zip(&after).any(|(a, b)| (*a > 0.0) != (*b > 0.0));
        let due = self.next_event.is_some_and(|next| to >= next);
        if enter || crossed || due {
            self.instance.enter_event_mode()?;
            self.leave_event()?;
        }
        Ok(())
    }

    /// How many event indicators there are.
    pub fn indicators(&self) -> usize {
        let root = &self.guest.description.root;
        root.number("numberOfEventIndicators").unwrap_or(0.0) as usize
    }

    /// One value.
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
            Type::String => {
                Reading::Text(self.instance.get_string(&reference)?.pop().unwrap_or_default())
            }
        })
    }

    /// Sets one value.
    pub fn set(&mut self, v: &Variable, value: &Reading) -> Called {
        let reference = [v.reference];
        match value {
            Reading::Real(x) => self.instance.set_real(&reference, &[*x]),
            Reading::Integer(n) => self.instance.set_integer(&reference, &[*n]),
            Reading::Boolean(b) => self.instance.set_boolean(&reference, &[*b]),
            Reading::Text(text) => self.instance.set_string(&reference, &[text]),
        }
    }

    /// Every value there is, one call each.
    pub fn readings(&mut self) -> Result<Vec<Reading>> {
        let guest = self.guest;
        let read = |v| self.get(v).with_context(|| format!("{} cannot be read", v.name));
        guest.variables().iter().map(read).collect()
    }

    /// The first variable whose value is not the same to the last bit, as a sentence.
    pub fn difference(&self, ours: &[Reading], theirs: &[Reading]) -> Option<String> {
        let all = self.guest.variables().iter().zip(ours.iter().zip(theirs));
        let mut different = all.filter(|(_, (a, b))| !a.is(b));
        let (v, (a, b)) = different.next()?;
        let more = match different.count() {
            0 => String::new(),
            n => format!(" ({n} more differ)"),
        };
        Some(format!("{} is {a}, not {b}{more}", v.name))
    }
}

/// The value of the `n`th input at a step: within its bounds, around its start.
pub fn stimulus(v: &Variable, step: usize, n: usize) -> f64 {
    let start = v.typed.number("start").filter(|x| x.is_finite()).unwrap_or(0.0);
    let (min, max) = v.bounds();
    let scale = match v.typed.number("nominal") {
        Some(_) => v.nominal(),
        None => start.abs().max(0.1),
    };
    let moved = start + 0.3 * scale * (0.7 * step as f64 + 1.0 + n as f64).sin();
    // the bounds first: clamp panics if they are in the wrong order
    moved.max(min).min(max.max(min))
}

/// Reads the start value that the description gives.
pub fn start_value(v: &Variable) -> Option<Reading> {
    let text = v.typed.get("start")?;
    Some(match v.kind {
        Type::Real => Reading::Real(host::xml::double(text)?),
        Type::Integer | Type::Enumeration => Reading::Integer(text.trim().parse().ok()?),
        Type::Boolean => Reading::Boolean(matches!(text.trim(), "true" | "1").into()),
        Type::String => Reading::Text(text.to_string()),
    })
}

fn copy_files(from: &Path, to: &Path) -> Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let (path, name) = entry.map(|e| (e.path(), e.file_name()))?;
        match path.is_dir() {
            true => copy_files(&path, &to.join(name))?,
            false => std::fs::copy(&path, to.join(name)).map(|_| ())?,
        }
    }
    Ok(())
}
