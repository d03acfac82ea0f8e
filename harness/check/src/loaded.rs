//! The loaded FMU under test for any version of FMI: its binaries, the calls that rules make, and the meaning
//! of a crash in them. The traits [`UnderTest`] and [`Life`] contain what rules for both versions need;
//! `under_test.rs` and `v3/subject.rs` implement them.

use std::cell::{Cell, RefCell};
use std::ops::Deref;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use host::c_abi::Message;
use host::c_abi::version::{Fmu, Instance, Interface, Version};
use host::guard;
use host::xml::Element;

use super::findings::Findings;
use super::trace::{self, Crash};

pub const STEPS: usize = 20;
/// Time limit for a call whose effect the standard leaves open, because it may never return.
const PATIENCE: Duration = Duration::from_secs(3);

/// Error that makes a rule impossible to check: `rule` reports the reason, and all others that meet it are
/// skipped.
#[derive(Debug)]
pub struct Unusable {
    /// The rule that reports the reason; empty if there is no fault of the FMU.
    pub rule: &'static str,
    pub why: String,
}

impl std::fmt::Display for Unusable {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.why)
    }
}

impl std::error::Error for Unusable {}

/// Ends a rule that does not apply to the FMU, for example because the FMU lacks a capability.
pub fn skip<T>(why: impl Into<String>) -> Result<T> {
    Err(Unusable { rule: "", why: why.into() }.into())
}

/// The loaded binaries of an FMU, with a record of the call that is being made.
pub struct Loaded<V: Version> {
    /// One binary, or two if modelIdentifier differs between the interfaces.
    binaries: Vec<Fmu<V>>,
    /// The interfaces that can be called, Co-Simulation first, each with the index of its binary.
    interfaces: Vec<(Interface, usize)>,
    /// The interfaces whose binary cannot be loaded: interface, modelIdentifier and reason.
    broken: Vec<(Interface, String, String)>,
    pub deadline: Instant,
    doing: RefCell<String>,
    crash: RefCell<Crash>,
    made: Cell<usize>,
}

impl<V: Version> Loaded<V> {
    /// Loads the binary of each interface in `declared`, which has their modelIdentifiers, by `load`.
    ///
    /// # Errors
    ///
    /// If no binary can be loaded.
    pub fn new(
        declared: Vec<(Interface, String)>,
        deadline: Instant,
        load: impl Fn(Interface) -> Result<Fmu<V>>,
    ) -> Result<Self> {
        let mut loaded = Loaded {
            binaries: Vec::new(),
            interfaces: Vec::new(),
            broken: Vec::new(),
            deadline,
            doing: RefCell::default(),
            crash: RefCell::new(Crash::Error),
            made: Cell::new(0),
        };
        let mut names = Vec::new();
        for (interface, name) in declared {
            let known = names.iter().position(|known| *known == name);
            match known.map_or_else(|| load(interface).map(Some), |_| Ok(None)) {
                Ok(new) => {
                    names.extend(new.is_some().then_some(name));
                    loaded.binaries.extend(new);
                    let at = known.unwrap_or(names.len() - 1);
                    loaded.interfaces.push((interface, at));
                }
                Err(error) => loaded.broken.push((interface, name, format!("{error:#}"))),
            }
        }
        let why = || {
            let mut all: Vec<&str> = loaded.broken.iter().map(|(.., why)| &why[..]).collect();
            all.dedup();
            if all.is_empty() { "it declares no interface".into() } else { all.join("; ") }
        };
        loaded.binaries.first().with_context(why)?;
        Ok(loaded)
    }

    /// Removes the interfaces for which `callable` is false. Binaries that could not be loaded are also removed, if `told`
    /// returns false for their modelIdentifier.
    pub fn retain(
        &mut self,
        callable: impl Fn(Interface, &Fmu<V>) -> bool,
        told: impl Fn(&str) -> bool,
    ) {
        self.interfaces.retain(|(interface, at)| callable(*interface, &self.binaries[*at]));
        self.broken.retain(|(_, name, _)| told(name));
    }

    /// Announces the next call, so that a crash or a hang in it is reported with this text.
    pub fn announce(&self, what: impl Into<String>) {
        let what = what.into();
        trace::doing(&what, self.crash.borrow().clone());
        *self.doing.borrow_mut() = what;
    }

    /// Makes calls whose crash is reported by `rule`, which makes the same calls, and not by the present
    /// rule.
    pub fn with_crash_reported_by<T>(&self, rule: &str, calls: impl FnOnce() -> T) -> T {
        self.with_crash(Crash::ReportedBy(rule.into()), calls)
    }

    /// Makes calls whose effect the standard leaves open. A crash has the severity of the rule. If the calls
    /// take longer than [`PATIENCE`], the process writes the findings so far, adds that the calls do not
    /// return, and exits.
    pub fn with_open_effect<T>(
        &self,
        what: impl Into<String>,
        findings: &Findings,
        calls: impl FnOnce() -> T,
    ) -> T {
        let what = what.into();
        let mut found = findings.clone();
        let place = what.clone();
        let (returned, waiting) = mpsc::channel::<()>();
        guard::spawn(move || {
            if waiting.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                found
                    .at(place)
                    .add(format!("no end after {PATIENCE:?} (allowed: every call returns)"));
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
        answer
    }

    /// Records that the check has chosen parameter values, for which the model may have no solution. A crash
    /// or hang then ends the rule without a finding.
    pub fn chose_values(&self) {
        *self.crash.borrow_mut() = Crash::ReportedBy(String::new());
    }

    fn with_crash<T>(&self, crash: Crash, calls: impl FnOnce() -> T) -> T {
        let before = self.crash.replace(crash);
        let answer = calls();
        self.crash.replace(before);
        // The next call no longer has the special treatment.
        self.announce(self.last_call());
        answer
    }

    pub fn last_call(&self) -> String {
        let doing = self.doing.borrow();
        if doing.is_empty() { "a first call".into() } else { doing.clone() }
    }

    /// Returns the binary of an interface.
    ///
    /// # Errors
    ///
    /// If the interface cannot be called.
    pub fn binary(&self, interface: Interface) -> Result<&Fmu<V>> {
        let of = self.interfaces.iter().find(|(i, _)| *i == interface);
        of.map(|(_, at)| &self.binaries[*at]).context("no such interface")
    }

    pub fn binaries(&self) -> &[Fmu<V>] {
        &self.binaries
    }

    /// Lists the reasons why interfaces cannot be called although a binary exists.
    pub fn broken(&self) -> impl Iterator<Item = &str> {
        self.broken.iter().map(|(.., why)| &why[..])
    }

    pub fn interfaces(&self) -> Vec<Interface> {
        self.interfaces.iter().map(|(interface, _)| *interface).collect()
    }

    /// Creates an instance by `make`. The rule is abandoned (outer error) if `is_once` says that a process
    /// may create only one instance and it already did, or if the deadline has passed.
    pub fn make<T, E>(
        &self,
        is_once: bool,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Result<T, E>> {
        let made = self.made.get();
        let why = if made > 0 && is_once {
            "it can be instantiated only once per process".into()
        } else if Instant::now() > self.deadline {
            format!("the time for its calls is over after {made} instances (--limit gives more)")
        } else {
            let instance = make();
            self.made.set(made + usize::from(instance.is_ok()));
            return Ok(instance);
        };
        Err(Unusable { rule: "", why }.into())
    }
}

fn element(interface: Interface) -> &'static str {
    match interface {
        Interface::CoSimulation => "CoSimulation",
        Interface::ModelExchange => "ModelExchange",
    }
}

pub fn declared(root: &Element) -> Vec<(Interface, String)> {
    let all = [Interface::CoSimulation, Interface::ModelExchange].into_iter();
    let identifier = |i: Interface| root.child(element(i))?.get("modelIdentifier");
    all.filter_map(|i| Some((i, identifier(i)?.to_string()))).collect()
}

/// An FMU under test, for rules that hold in FMI 2.0 and in FMI 3.0.
pub trait UnderTest: Deref<Target = Loaded<Self::Version>> {
    type Version: Version;
    /// A way to use an instance: the interface, and in FMI 3.0 also the optional features that the host
    /// enables.
    type Use: Copy;
    type Session<'f>: Life<'f, Self::Version>
    where
        Self: 'f;
    const FMI: &'static str;
    const NUMBER: &'static str;

    /// Word for a saved state in the names of functions and capabilities, "FMUstate" or "FMUState".
    const STATE: &'static str;

    fn root(&self) -> &Element;

    fn uses(&self) -> Vec<Self::Use>;

    fn name(using: Self::Use) -> &'static str;

    fn interface(using: Self::Use) -> Interface;

    fn session(&self, using: Self::Use) -> Result<Self::Session<'_>>;

    /// Creates an instance and initialises it with the FMU's default experiment, so that it is ready for a
    /// step.
    fn running(&self, using: Self::Use) -> Result<Self::Session<'_>>;

    /// Provokes errors and returns the messages that the FMU logs, and how many of them have the category
    /// NULL.
    fn provoke_messages(&self) -> Result<(Vec<Message>, usize)>;

    /// Returns true if the element of `interface` declares the capability `flag`.
    fn can(&self, interface: Interface, flag: &str) -> bool {
        self.root().child(element(interface)).is_some_and(|element| element.flag(flag))
    }

    /// Skips the rule unless the element of `interface` declares the capability `flag`.
    fn require(&self, interface: Interface, flag: &str) -> Result<()> {
        match self.can(interface, flag) {
            true => Ok(()),
            false => skip(format!("{flag} is not declared")),
        }
    }
}

pub trait Life<'f, V: Version + 'f> {
    type Reading;
    /// The host's own state (for example time), which a saved FMU state does not contain.
    type Mark;

    fn instance(&mut self) -> &mut Instance<'f, V>;

    /// Initialises a new instance, so that it is ready for its first step.
    fn initialise(&mut self) -> Result<()>;

    /// Makes `steps` communication steps of the usual size with changing inputs. Stops early if the FMU
    /// requests the end of the simulation.
    ///
    /// # Errors
    ///
    /// If a step fails; `steps.run` or `exchange.run` reports this.
    fn advance(&mut self, steps: usize) -> Result<()>;

    fn readings(&mut self) -> Result<Vec<Self::Reading>>;

    /// Describes the first variable whose value differs in at least one bit, or returns `None` if all are
    /// equal.
    fn difference(&self, ours: &[Self::Reading], theirs: &[Self::Reading]) -> Option<String>;

    fn mark(&self) -> Self::Mark;

    fn go_back(&mut self, to: &Self::Mark);

    /// Brings the instance away from its usual trajectory, so that a following reset has something to undo.
    fn leave_trajectory(&mut self) -> Result<()>;

    /// Returns the host's own state to the start, which is where the FMU is after a reset.
    fn rewind(&mut self);
}

type Of<'f, F> = <F as UnderTest>::Session<'f>;
pub type Readings<'f, F> = Vec<<Of<'f, F> as Life<'f, <F as UnderTest>::Version>>::Reading>;
pub type Mark<'f, F> = <Of<'f, F> as Life<'f, <F as UnderTest>::Version>>::Mark;
