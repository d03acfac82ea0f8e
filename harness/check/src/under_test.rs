//! The FMU under test, for any version of FMI: its binaries, the calls that rules make, the meaning of a crash in these
//! calls, and the instances that are simulated. The trait [`Tested`] contains the differences between the versions;
//! `under_test/fmi2.rs` and `v3/subject.rs` implement it.

mod fmi2;
mod observed;

use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use host::c_abi::version::{Fmu, Instance, Version};
use host::c_abi::{CallError, Called, Message};
use host::causality::Causality;
use host::description::{CType, Type, Value};
use host::fmi2::{Fmi2, HostState};
use host::guard;
use host::xml::double;

use super::description::{Description, Variable};
use super::findings::Findings;
use super::trace::{self, Crash};

pub use self::fmi2::{FmuUnderTest, Stage, copy_files};
pub use self::observed::Observed;
pub use host::c_abi::version::Interface;

pub const STEPS: usize = 20;
/// Time limit for a call whose effect the standard does not define, because such a call may never return.
const PATIENCE: Duration = Duration::from_secs(3);

/// Error that makes it impossible to check a rule. The rule named `rule` reports the reason; other rules that meet
/// this error are skipped.
#[derive(Debug, thiserror::Error)]
#[error("{why}")]
pub struct Unusable {
    /// Identifier of the rule that reports the reason `why`; empty if the reason is not a fault, for example a
    /// missing capability.
    pub rule: &'static str,
    pub why: String,
}

/// Ends a rule that does not apply to the FMU, for example because the FMU lacks a capability.
pub fn skip<T>(why: impl Into<String>) -> Result<T> {
    Err(Unusable { rule: "", why: why.into() }.into())
}

/// A way to use an instance: the interface, and in FMI 3.0 also the optional features that the host enables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Use {
    pub interface: Interface,
    pub event_mode: bool,
    pub early_return: bool,
    pub updates: bool,
}

impl From<Interface> for Use {
    fn from(interface: Interface) -> Use {
        Use { interface, event_mode: false, early_return: false, updates: false }
    }
}

impl std::fmt::Display for Use {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        self.interface.fmt(f)?;
        f.write_str(match (self.event_mode, self.early_return) {
            (true, true) => " with event mode and early return",
            (true, false) => " with event mode",
            (false, true) => " with early return",
            (false, false) => "",
        })
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Experiment {
    pub start: f64,
    pub tolerance: Option<f64>,
    pub stop: Option<f64>,
    pub step: f64,
}

pub trait Tested: Version + 'static {
    /// Identifier of the rule that reports failing steps of Model Exchange.
    const EXCHANGE_RUNS: &'static str;
    const FMI: &'static str;
    /// Word for a saved state in the names of functions and capabilities, which differs between
    /// versions of FMI.
    const STATE: &'static str;
    /// Identifier of the rule that reports an FMU which ends the simulation when it is initialised,
    /// if there is one.
    const TERMINATION: Option<&'static str>;
    /// Description of the call that reads a Real with a value reference that no variable has.
    const UNKNOWN_READ: &'static str;
    /// True if the rule `load.opens` reports missing binaries in addition to binaries that cannot be loaded.
    const REPORTS_MISSING: bool;
    /// Smallest number of steps into which the rules divide the DefaultExperiment in Model Exchange; 0 for no limit. With
    /// this limit a simulation does not leave a short experiment, after whose end the model may do anything.
    const EXCHANGE_STEPS: f64;
    /// Number of steps that the DefaultExperiment of the FMU must contain so that the check uses its step size.
    const SUGGESTED_STEPS: f64;
    type Notes;

    /// Returns true if the rules call the functions of this interface in `binary`.
    fn is_called(description: &Description, interface: Interface, binary: &Fmu<Self>) -> bool;

    fn uses(fmu: &UnderTest<Self>) -> Vec<Use>;

    /// Creates an instance with ordinary arguments. The inner error is the FMU's refusal.
    fn make_instance(
        fmu: &UnderTest<Self>,
        using: Use,
    ) -> Result<Result<Instance<'_, Self>, CallError>>;

    fn notes(fmu: &UnderTest<Self>) -> Self::Notes;

    /// Initialises a new instance with the default experiment, so that it is ready for its first step.
    fn initialise(session: &mut Session<Self>) -> Result<()>;

    fn make_usual_step(session: &mut Session<Self>) -> Result<()>;

    /// Returns the magnitudes of the states, to which the allowed errors of the integrator are
    /// relative.
    fn magnitudes(session: &mut Session<Self>) -> Called<Vec<f64>>;

    /// Accepts a step of the integrator and handles the events that follow. `crossed` is true if an event indicator
    /// has changed its sign.
    fn complete_step(session: &mut Session<Self>, crossed: bool) -> Result<()>;

    /// Returns the values of the elements of input number `n` at a step: the start values plus a sine.
    fn stimulus(v: &Variable, step: usize, n: usize) -> Vec<f64>;

    /// Brings the instance away from its usual trajectory, so that a reset has something to undo.
    fn leave_trajectory(session: &mut Session<Self>) -> Result<()>;

    /// Provokes errors, and returns the messages that the FMU logs, with the number of messages whose category is NULL.
    fn provoke_messages(fmu: &UnderTest<Self>) -> Result<(Vec<Message>, usize)>;
}

/// The loaded FMU, with a record of the call that is being made.
pub struct UnderTest<V: Tested = Fmi2> {
    pub description: &'static Description,
    /// The continuous inputs and outputs of type Float64.
    pub inputs: Vec<&'static Variable>,
    pub outputs: Vec<&'static Variable>,
    directory: PathBuf,
    path: PathBuf,
    /// State of the process before the binary was loaded, for example its locale and its working directory, as pairs
    /// of a name and a value ([`surroundings`]).
    pub before: Vec<(&'static str, String)>,
    /// The loaded binaries: one, or two if modelIdentifier differs between the interfaces.
    binaries: Vec<Fmu<V>>,
    /// The interfaces that can be called, Co-Simulation first, each with the index of its binary.
    interfaces: Vec<(Interface, usize)>,
    /// The modelIdentifiers of the binaries that cannot be loaded, with the reasons.
    broken: Vec<(String, String)>,
    deadline: Instant,
    doing: RefCell<String>,
    crash: RefCell<Crash>,
    made: Cell<usize>,
}

fn element(interface: Interface) -> &'static str {
    match interface {
        Interface::CoSimulation => "CoSimulation",
        Interface::ModelExchange => "ModelExchange",
    }
}

impl<V: Tested> UnderTest<V> {
    /// Loads the FMU that is unpacked in `directory`. No instances are created after `deadline`.
    ///
    /// # Errors
    ///
    /// If no binary can be loaded.
    pub fn open(
        directory: &Path,
        path: &Path,
        description: &'static Description,
        deadline: Instant,
    ) -> Result<Self> {
        let continuous = |causality| {
            let fits = |v: &&Variable| {
                v.causality == causality && v.is_continuous() && v.c_type == CType::Float64
            };
            description.variables.iter().filter(fits).collect()
        };
        let mut fmu = UnderTest {
            description,
            inputs: continuous(Causality::Input),
            outputs: continuous(Causality::Output),
            directory: directory.to_path_buf(),
            path: path.to_path_buf(),
            before: surroundings(),
            binaries: Vec::new(),
            interfaces: Vec::new(),
            broken: Vec::new(),
            deadline,
            doing: RefCell::default(),
            crash: RefCell::new(Crash::Error),
            made: Cell::new(0),
        };
        let mut names: Vec<&str> = Vec::new();
        for interface in [Interface::CoSimulation, Interface::ModelExchange] {
            let identifier = description.interface(element(interface));
            let Some(name) = identifier.and_then(|e| e.get("modelIdentifier")) else { continue };
            let at = match names.iter().position(|known| *known == name) {
                Some(at) => at,
                None => match Fmu::load_for(Some(interface), directory, path, &description.root) {
                    Ok(binary) => {
                        names.push(name);
                        fmu.binaries.push(binary);
                        names.len() - 1
                    }
                    Err(error) => {
                        fmu.broken.push((name.into(), format!("{error:#}")));
                        continue;
                    }
                },
            };
            fmu.interfaces.push((interface, at));
        }
        let why = || {
            let mut all: Vec<&str> = fmu.callability_faults().collect();
            all.dedup();
            if all.is_empty() { "the FMU declares no interface".into() } else { all.join("; ") }
        };
        fmu.binaries.first().with_context(why)?;
        // In FMI 2.0 another rule reports an interface whose binary is missing.
        let file =
            |name: &str| format!("binaries/{}/{name}{}", V::PLATFORM, std::env::consts::DLL_SUFFIX);
        fmu.broken.retain(|(name, _)| V::REPORTS_MISSING || directory.join(file(name)).exists());
        let binaries = &fmu.binaries;
        fmu.interfaces.retain(|(of, at)| V::is_called(description, *of, &binaries[*at]));
        Ok(fmu)
    }

    /// Copies the unpacked FMU to `directory` and loads the copy. The operating system treats the copy as another library,
    /// so that it has static variables of its own.
    pub fn copy(&self, directory: &Path) -> Result<Self> {
        copy_files(&self.directory, directory)?;
        UnderTest::open(directory, &self.path, self.description, self.deadline)
    }

    pub fn directory(&self) -> &Path {
        &self.directory
    }

    pub fn variables(&self) -> &'static [Variable] {
        &self.description.variables
    }

    /// Returns the variables that rules read and set.
    pub fn readable(&self) -> impl Iterator<Item = &'static Variable> + use<V> {
        self.description.variables.iter().filter(|v| v.is_exchanged())
    }

    pub fn experiment(&self) -> Experiment {
        let element = self.description.root.child("DefaultExperiment");
        let number = |name: &str| element.and_then(|e| e.number(name)).filter(|x| x.is_finite());
        let start = number("startTime").unwrap_or(0.0);
        let above_0 = |x: &f64| *x > 0.0;
        let stop = number("stopTime").filter(|stop| *stop > start);
        let span = stop.map_or(f64::INFINITY, |stop| stop - start);
        // If one step reached the end of the experiment, the check would learn nothing about the FMU.
        let step = number("stepSize").filter(above_0);
        let step = step.filter(|step| V::SUGGESTED_STEPS * step <= span).unwrap_or(span / 500.0);
        let step = if step.is_finite() { step } else { 0.01 };
        // The step is a multiple of the FMU's own step, because a 500th of the experiment may contain millions of its steps.
        let stepping = self.description.interface("CoSimulation");
        let own = stepping.and_then(|e| e.number("fixedInternalStepSize")).filter(above_0);
        let step = own.map_or(step, |own| (step / own).round().clamp(1.0, 100.0) * own);
        Experiment { start, tolerance: number("tolerance").filter(above_0), stop, step }
    }

    /// Announces the next call, so that a crash or a hang in it is reported with this text.
    pub fn announce(&self, what: impl Into<String>) {
        let what = what.into();
        trace::announce_call(&what, self.crash.borrow().clone());
        *self.doing.borrow_mut() = what;
    }

    /// Makes calls that `rule` also makes. If a call crashes, `rule` reports this, and not the present rule.
    pub fn with_crash_reported_by<T>(&self, rule: &str, calls: impl FnOnce() -> T) -> T {
        self.with_crash(Crash::ReportedBy(rule.into()), calls)
    }

    /// Makes calls whose effect the standard does not define. If a call crashes, the finding is an error or a
    /// warning, according to the severity of the rule. If the calls take longer than [`PATIENCE`], the process writes
    /// its findings, adds that the calls do not return, and exits.
    pub fn with_undefined_effect<T>(
        &self,
        what: impl Into<String>,
        findings: &Findings,
        calls: impl FnOnce() -> T,
    ) -> T {
        let what = what.into();
        let mut found = findings.clone();
        let place = what.clone();
        let (returned, waiting) = mpsc::channel::<()>();
        let watchdog = guard::spawn(move || {
            if waiting.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                found.at(place).add(format!(
                    "the call has not returned after {PATIENCE:?} (required: every call returns)"
                ));
                // If the findings cannot be written, the time limit of the parent process reports the hang.
                let _ = trace::done(found);
                std::process::exit(0);
            }
        });
        let answer = self.with_crash(Crash::Open, || {
            self.announce(what);
            calls()
        });
        drop(returned);
        // The watchdog thread is joined, because some rules make thousands of such calls, and waiting threads would exhaust
        // the memory that the process may use for threads.
        let _ = watchdog.join();
        answer
    }

    /// Records that the check itself has chosen the parameter values, for which the model may have no solution. A crash
    /// or a call that does not return then ends the rule without a finding.
    pub fn chose_values(&self) {
        *self.crash.borrow_mut() = Crash::ReportedBy(String::new());
    }

    fn with_crash<T>(&self, crash: Crash, calls: impl FnOnce() -> T) -> T {
        let before = self.crash.replace(crash);
        let answer = calls();
        self.crash.replace(before);
        // From the next call on, a crash has its usual meaning again.
        self.announce(self.last_call());
        answer
    }

    pub fn last_call(&self) -> String {
        let doing = self.doing.borrow();
        if doing.is_empty() { "a first call".into() } else { doing.clone() }
    }

    pub fn binary(&self, interface: Interface) -> Result<&Fmu<V>> {
        let of = self.interfaces.iter().find(|(i, _)| *i == interface);
        of.map(|(_, at)| &self.binaries[*at]).context("no such interface")
    }

    pub fn binaries(&self) -> &[Fmu<V>] {
        &self.binaries
    }

    /// Lists the reasons why interfaces cannot be called although they have a binary.
    pub fn callability_faults(&self) -> impl Iterator<Item = &str> {
        self.broken.iter().map(|(_, why)| &why[..])
    }

    pub fn interfaces(&self) -> Vec<Interface> {
        self.interfaces.iter().map(|(interface, _)| *interface).collect()
    }

    pub fn has(&self, interface: Interface) -> bool {
        self.binary(interface).is_ok()
    }

    /// Calls `make`, which creates an instance. The inner error is the error that `make` returned. The outer error
    /// means that `make` was not called: the FMU allows only one instance in a process and has already created it, or
    /// the deadline has passed.
    pub fn make<T, E>(
        &self,
        interface: Interface,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Result<T, E>> {
        let made = self.made.get();
        let why = if made > 0
            && self.has_capability(interface, "canBeInstantiatedOnlyOncePerProcess")
        {
            "the FMU can be instantiated only once per process".into()
        } else if Instant::now() > self.deadline {
            format!(
                "the time limit of the rule is reached after {made} instances (--limit allows more time)"
            )
        } else {
            let instance = make();
            self.made.set(made + usize::from(instance.is_ok()));
            return Ok(instance);
        };
        Err(Unusable { rule: "", why }.into())
    }

    pub fn uses(&self) -> Vec<Use> {
        V::uses(self)
    }

    /// Creates an instance with ordinary arguments. If this fails, `load.instance` reports it.
    pub fn session(&self, using: impl Into<Use>) -> Result<Session<'_, V>> {
        let using = using.into();
        let instance = V::make_instance(self, using)?;
        self.session_of(using, instance)
    }

    fn session_of<'f>(
        &'f self,
        using: Use,
        instance: Result<Instance<'f, V>, CallError>,
    ) -> Result<Session<'f, V>> {
        let instance =
            instance.map_err(|error| Unusable { rule: "load.instance", why: error.to_string() })?;
        let Experiment { start, stop, step, .. } = self.experiment();
        // The suggested step size is meant only for Co-Simulation.
        let longest = match (using.interface, stop) {
            (Interface::ModelExchange, Some(stop)) => (stop - start) / V::EXCHANGE_STEPS,
            _ => f64::INFINITY,
        };
        Ok(Session {
            fmu: self,
            using,
            instance,
            time: start,
            step: step.min(longest),
            count: 0,
            next_event: None,
            ended: None,
            notes: V::notes(self),
        })
    }

    /// Creates an instance and initialises it with the FMU's default experiment, so that it is ready for a
    /// step.
    pub fn running(&self, using: impl Into<Use>) -> Result<Session<'_, V>> {
        let mut session = self.session(using)?;
        session.initialise()?;
        match V::TERMINATION.filter(|_| session.is_ended()) {
            None => Ok(session),
            Some(rule) => {
                let why = "the FMU asks for the end of the simulation when it is initialised";
                Err(Unusable { rule, why: why.into() }.into())
            }
        }
    }

    /// Returns an initialised instance for Co-Simulation, or skips the rule if the FMU has no Co-Simulation.
    pub fn stepping(&self) -> Result<Session<'_, V>> {
        match self.has(Interface::CoSimulation) {
            true => self.running(Interface::CoSimulation),
            false => skip("the FMU offers no Co-Simulation"),
        }
    }

    /// Returns an initialised instance for Model Exchange, or skips the rule if the FMU has no Model Exchange.
    pub fn exchanging(&self) -> Result<Session<'_, V>> {
        match self.has(Interface::ModelExchange) {
            true => self.running(Interface::ModelExchange),
            false => skip("the FMU offers no Model Exchange"),
        }
    }

    pub fn has_capability(&self, interface: Interface, flag: &str) -> bool {
        self.description.interface(element(interface)).is_some_and(|element| element.flag(flag))
    }

    /// Skips the rule unless the element of `interface` declares the capability `flag`.
    pub fn require(&self, interface: Interface, flag: &str) -> Result<()> {
        match self.has_capability(interface, flag) {
            true => Ok(()),
            false => skip(format!("{flag} is not declared")),
        }
    }
}

pub struct Session<'f, V: Tested = Fmi2> {
    pub fmu: &'f UnderTest<V>,
    pub using: Use,
    pub instance: Instance<'f, V>,
    pub time: f64,
    pub step: f64,
    /// Number of steps that have been made, which determines the changing inputs.
    pub count: usize,
    pub next_event: Option<f64>,
    pub ended: Option<(f64, &'static str)>,
    pub notes: V::Notes,
}

/// Quantities that the host has stored at the instant at which it saved an FMU state, such as the time. The FMU state
/// does not contain them.
#[derive(Clone, Copy, Debug)]
pub struct Mark {
    time: f64,
    count: usize,
    next_event: Option<f64>,
    ended: Option<(f64, &'static str)>,
}

pub type Readings = Vec<Vec<Value>>;

impl<V: Tested> Session<'_, V> {
    pub fn initialise(&mut self) -> Result<()> {
        V::initialise(self)
    }

    /// Makes `steps` communication steps of the usual size with changing inputs. Stops early if the FMU
    /// requests the end of the simulation.
    ///
    /// # Errors
    ///
    /// If a step fails; `steps.run` or `exchange.run` reports this.
    pub fn advance(&mut self, steps: usize) -> Result<()> {
        for _ in 0..steps {
            if self.is_ended() {
                break;
            }
            V::make_usual_step(self)?;
        }
        Ok(())
    }

    pub fn end(&mut self, call: &'static str) {
        self.ended.get_or_insert((self.time, call));
    }

    /// Returns true if the FMU has requested the end of the simulation. A host then makes no further steps.
    pub fn is_ended(&self) -> bool {
        self.ended.is_some()
    }

    /// Sets all continuous inputs to values that change from step to step.
    pub fn stimulate(&mut self) -> Called {
        for (n, v) in self.fmu.inputs.iter().enumerate() {
            let values = V::stimulus(v, self.count, n).into_iter().map(Value::Real);
            self.instance.set_values(v.c_type, v.reference, &values.collect::<Vec<_>>())?;
        }
        Ok(())
    }

    pub fn elements(&mut self, v: &Variable) -> Called<Vec<Value>> {
        self.instance.values(v.c_type, v.reference, v.length())
    }

    /// Reads all elements of a variable in an ordinary run. `values.readable` reports a failure.
    pub fn read(&mut self, v: &Variable) -> Result<Vec<Value>> {
        self.elements(v).map_err(|error| {
            let why = format!("{} cannot be read: {error}", v.name);
            Unusable { rule: "values.readable", why }.into()
        })
    }

    pub fn sizes(&mut self) -> Called<(usize, usize)> {
        V::sizes(&mut self.instance)
    }

    fn vector(
        &mut self,
        length: usize,
        read: fn(&mut Instance<V>, &mut [f64]) -> Called,
    ) -> Called<Vec<f64>> {
        let mut vector = vec![f64::NAN; length];
        // Hosts do not request vectors of length 0.
        if length > 0 {
            read(&mut self.instance, &mut vector)?;
        }
        Ok(vector)
    }

    pub fn states(&mut self) -> Called<Vec<f64>> {
        let (states, _) = self.sizes()?;
        self.vector(states, |instance, x| instance.continuous_states(x))
    }

    pub fn derivatives(&mut self) -> Called<Vec<f64>> {
        let (states, _) = self.sizes()?;
        self.vector(states, |instance, dx| instance.derivatives(dx))
    }

    pub fn nominals(&mut self) -> Called<Vec<f64>> {
        let (states, _) = self.sizes()?;
        self.vector(states, |instance, x| instance.nominals(x))
    }

    pub fn indicators(&mut self) -> Called<Vec<f64>> {
        let (_, indicators) = self.sizes()?;
        self.vector(indicators, |instance, z| instance.event_indicators(z))
    }

    pub fn readings(&mut self) -> Result<Readings> {
        self.fmu.readable().map(|v| self.read(v)).collect()
    }

    /// Describes the first variable whose value in `ours` differs from the value in `theirs` in at
    /// least one bit, or returns `None` if all are equal.
    pub fn difference(&self, ours: &Readings, theirs: &Readings) -> Option<String> {
        let all = self.fmu.readable().zip(ours.iter().zip(theirs));
        let mut different = all.filter_map(|(v, (a, b))| {
            let pair = a.iter().zip(b).find(|(a, b)| !a.is_identical(b))?;
            Some((&v.name, pair))
        });
        let (name, (a, b)) = different.next()?;
        let more = match different.count() {
            0 => String::new(),
            n => format!(" ({n} more differ)"),
        };
        Some(format!("{name} is {a}, not {b}{more}"))
    }

    /// Reads the value of a value reference that no variable has, and returns the FMU's refusal
    /// with its messages. If this call crashes, `values.unknown` reports it.
    pub fn provoke_refusal(&mut self) -> Option<CallError> {
        self.fmu.with_crash_reported_by("values.unknown", || {
            self.fmu.announce(V::UNKNOWN_READ);
            V::reals(&mut self.instance, &[u32::MAX], &mut [0.0]).err()
        })
    }

    pub fn mark(&self) -> Mark {
        Mark { time: self.time, count: self.count, next_event: self.next_event, ended: self.ended }
    }

    pub fn go_back(&mut self, to: &Mark) {
        (self.time, self.count) = (to.time, to.count);
        (self.next_event, self.ended) = (to.next_event, to.ended);
    }

    /// Sets the time and other quantities that the host stores to their values at the start, because the FMU has been
    /// reset.
    pub fn rewind(&mut self) {
        let time = self.fmu.experiment().start;
        self.go_back(&Mark { time, count: 0, next_event: None, ended: None });
    }
}

/// Returns the start value of each element, or `None` if the description has no valid start value.
pub fn start_values(v: &Variable) -> Option<Vec<Value>> {
    let value = |text: &String| {
        Some(match v.kind {
            Type::Real if v.c_type == CType::Float32 => {
                Value::Real(f64::from(double(text)? as f32))
            }
            Type::Real => Value::Real(double(text)?),
            Type::Integer | Type::Enumeration => Value::Integer(text.trim().parse().ok()?),
            Type::Boolean => Value::Boolean(matches!(text.trim(), "true" | "1")),
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

pub fn start_value(v: &Variable) -> Option<Value> {
    start_values(v)?.into_iter().next()
}

pub fn surroundings() -> Vec<(&'static str, String)> {
    let state = HostState::now();
    // Wine has /proc, too, but it describes Wine's own process.
    let count = |folder: &str| match cfg!(target_os = "linux") {
        true => {
            std::fs::read_dir(folder).map_or(String::new(), |entries| entries.count().to_string())
        }
        false => String::new(),
    };
    let mut environment: Vec<_> = std::env::vars_os().collect();
    environment.sort();
    vec![
        ("floating-point control (rounding, exceptions)", format!("{:#x}", state.float_control)),
        ("locale", state.locale),
        ("signal handlers", format!("{:#x}", state.signal_handlers)),
        ("working directory", format!("{:?}", std::env::current_dir().ok())),
        ("environment variables", format!("{environment:?}")),
        // omitted on systems that do not report it
        ("number of threads", count("/proc/self/task")),
        ("number of open files", count("/proc/self/fd")),
    ]
}
