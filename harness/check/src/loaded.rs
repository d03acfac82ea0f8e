//! The FMU under test in any version of FMI: its binaries, what a rule does with them, and what a crash of that means.
//! [`UnderTest`] and [`Life`] are what rules for both versions need; `under_test.rs` and `v3/subject.rs` implement them.

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

/// Steps of a short run.
pub const STEPS: usize = 20;
/// Time for a call that the standard leaves open and that need not return.
const PATIENCE: Duration = Duration::from_secs(3);

/// Most rules cannot be checked: one rule gives the reason, the others are skipped.
#[derive(Debug)]
pub struct Unusable {
    /// The rule that tells; empty if it is not a fault.
    pub rule: &'static str,
    /// Reason.
    pub why: String,
}

impl std::fmt::Display for Unusable {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(&self.why)
    }
}

impl std::error::Error for Unusable {}

/// The loaded binaries of an FMU, and the calls that a rule makes.
pub struct Loaded<V: Version> {
    /// One, or two where modelIdentifier differs between the interfaces.
    binaries: Vec<Fmu<V>>,
    /// The interfaces that can be called, Co-Simulation first, and the binary of each.
    interfaces: Vec<(Interface, usize)>,
    /// The interfaces whose binary cannot be loaded, its modelIdentifier, and the reason.
    broken: Vec<(Interface, String, String)>,
    /// Rules make no instances after it.
    pub deadline: Instant,
    doing: RefCell<String>,
    crash: RefCell<Crash>,
    made: Cell<usize>,
}

impl<V: Version> Loaded<V> {
    /// Loads the binary of each interface by its modelIdentifier. Rules make no instances after `deadline`.
    ///
    /// # Errors
    /// If none can be loaded.
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

    /// Leaves interfaces out, and reasons why others cannot be called.
    pub fn retain(
        &mut self,
        callable: impl Fn(Interface, &Fmu<V>) -> bool,
        told: impl Fn(&str) -> bool,
    ) {
        self.interfaces.retain(|(interface, at)| callable(*interface, &self.binaries[*at]));
        self.broken.retain(|(_, name, _)| told(name));
    }

    /// Announces the next call: a crash or a hang is then reported at this place.
    pub fn doing(&self, what: impl Into<String>) {
        let what = what.into();
        trace::doing(&what, self.crash.borrow().clone());
        *self.doing.borrow_mut() = what;
    }

    /// Makes calls whose crash another rule reports, which makes them as well.
    pub fn told_by<T>(&self, rule: &str, calls: impl FnOnce() -> T) -> T {
        self.with_crash(Crash::ToldBy(rule.into()), calls)
    }

    /// Makes calls of which the standard does not say what they do: a crash is as bad as the rule.
    /// After [`PATIENCE`] the process tells what was found so far and that they do not return, and
    /// ends.
    pub fn left_open<T>(
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
                    .add(place, format!("no end after {PATIENCE:?} (allowed: every call returns)"));
                // if that cannot be written, the time limit tells
                let _ = trace::done(found);
                std::process::exit(0);
            }
        });
        let answer = self.with_crash(Crash::Open, || {
            self.doing(what);
            calls()
        });
        drop(returned);
        answer
    }

    /// Notes that parameters now have values that the check has chosen, with which a model may have no solution. A crash
    /// or a call without end then ends the rule, and is not a finding.
    pub fn chose_values(&self) {
        *self.crash.borrow_mut() = Crash::ToldBy(String::new());
    }

    fn with_crash<T>(&self, crash: Crash, calls: impl FnOnce() -> T) -> T {
        let before = self.crash.replace(crash);
        let answer = calls();
        self.crash.replace(before);
        // what comes next is no longer that
        self.doing(self.now());
        answer
    }

    /// Last announced call.
    pub fn now(&self) -> String {
        let doing = self.doing.borrow();
        if doing.is_empty() { "a first call".into() } else { doing.clone() }
    }

    /// The binary of an interface, if it can be called.
    pub fn binary(&self, interface: Interface) -> Result<&Fmu<V>> {
        let of = self.interfaces.iter().find(|(i, _)| *i == interface);
        of.map(|(_, at)| &self.binaries[*at]).context("no such interface")
    }

    /// The loaded binaries.
    pub fn binaries(&self) -> &[Fmu<V>] {
        &self.binaries
    }

    /// Reasons why interfaces cannot be called although there is a binary.
    pub fn broken(&self) -> impl Iterator<Item = &str> {
        self.broken.iter().map(|(.., why)| &why[..])
    }

    /// The interfaces that can be called, Co-Simulation first.
    pub fn interfaces(&self) -> Vec<Interface> {
        self.interfaces.iter().map(|(interface, _)| *interface).collect()
    }

    /// Makes an instance, unless the FMU may have one in a process and had it, or time is over.
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

/// Name of an interface as an element of modelDescription.xml.
fn element(interface: Interface) -> &'static str {
    match interface {
        Interface::CoSimulation => "CoSimulation",
        Interface::ModelExchange => "ModelExchange",
    }
}

/// The modelIdentifier of each interface that the FMU declares, Co-Simulation first.
pub fn declared(root: &Element) -> Vec<(Interface, String)> {
    let all = [Interface::CoSimulation, Interface::ModelExchange].into_iter();
    let identifier = |i: Interface| root.child(element(i))?.get("modelIdentifier");
    all.filter_map(|i| Some((i, identifier(i)?.to_string()))).collect()
}

/// An FMU under test.
pub trait UnderTest: Deref<Target = Loaded<Self::Version>> {
    /// The version of FMI that it has.
    type Version: Version;
    /// Use of an instance: an interface, and in FMI 3.0 what the host allows.
    type Use: Copy;
    /// An instance and how far it is.
    type Session<'f>: Life<'f, Self::Version>
    where
        Self: 'f;
    /// Begin of the names of calls.
    const FMI: &'static str;
    /// Result of fmi2GetVersion or fmi3GetVersion.
    const NUMBER: &'static str;

    /// A saved state in names of calls and capabilities.
    const STATE: &'static str;

    /// The tree of modelDescription.xml.
    fn root(&self) -> &Element;

    /// Every use of the interfaces that the FMU declares.
    fn uses(&self) -> Vec<Self::Use>;

    /// Name of a use in findings.
    fn name(using: Self::Use) -> &'static str;

    /// The interface of a use.
    fn interface(using: Self::Use) -> Interface;

    /// A new instance.
    fn session(&self, using: Self::Use) -> Result<Self::Session<'_>>;

    /// A new instance, initialised with what the FMU suggests and ready for a step.
    fn running(&self, using: Self::Use) -> Result<Self::Session<'_>>;

    /// Messages of the FMU about mistakes, and how many have the category NULL.
    fn complaints(&self) -> Result<(Vec<Message>, usize)>;

    /// Returns true if an interface declares a capability.
    fn can(&self, interface: Interface, flag: &str) -> bool {
        self.root().child(element(interface)).is_some_and(|element| element.flag(flag))
    }
}

/// Life of an instance, in the order of the standard's state machines.
pub trait Life<'f, V: Version + 'f> {
    /// A variable's values as they were read.
    type Reading;
    /// The host's place in the simulation, which a saved state does not contain.
    type Mark;

    /// The instance.
    fn instance(&mut self) -> &mut Instance<'f, V>;

    /// Takes a new instance up to its first step.
    fn initialise(&mut self) -> Result<()>;

    /// Makes steps of the usual size, inputs changing, until the FMU asks for the end.
    ///
    /// # Errors
    /// If one fails, which is the business of a rule of its own.
    fn advance(&mut self, steps: usize) -> Result<()>;

    /// Every value there is, one call each.
    fn readings(&mut self) -> Result<Vec<Self::Reading>>;

    /// The first variable whose value is not the same to the last bit, as a sentence.
    fn difference(&self, ours: &[Self::Reading], theirs: &[Self::Reading]) -> Option<String>;

    /// Returns the host's place in the simulation.
    fn mark(&self) -> Self::Mark;

    /// Takes the host back to an earlier place.
    fn go_back(&mut self, to: &Self::Mark);

    /// Leads the instance another way than usual, before a reset.
    fn stray(&mut self) -> Result<()>;

    /// Takes the host back to the start, where the FMU is after a reset.
    fn rewind(&mut self);
}

type Of<'f, F> = <F as UnderTest>::Session<'f>;
/// All values of an FMU's variables.
pub type Readings<'f, F> = Vec<<Of<'f, F> as Life<'f, <F as UnderTest>::Version>>::Reading>;
/// Place of the host in the simulation of an FMU.
pub type Mark<'f, F> = <Of<'f, F> as Life<'f, <F as UnderTest>::Version>>::Mark;
