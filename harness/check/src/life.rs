//! Loading, instances and their lives (FMI 2.0.5, sections 2.1.5, 2.1.6 and 4.2.4), and what an FMU
//! must leave alone in its host.

use anyhow::Result;

use super::Findings;
use super::guest::{Guest, Interface, Reading, STEPS, Session, Stage};
use host::fmi2::{CallError, Callbacks, HostState, Instance, Instantiation, Status};

/// `load.opens`: what came before is the check, but for the second binary of two.
pub fn opens(guest: &Guest, findings: &mut Findings) -> Result<()> {
    if let Some(why) = guest.broken() {
        findings.add("the binary of one interface", why);
    }
    Ok(())
}

/// `load.types_platform`
pub fn types_platform(guest: &Guest, findings: &mut Findings) -> Result<()> {
    guest.doing("fmi2GetTypesPlatform");
    for fmu in guest.binaries() {
        let answer = fmu.types_platform();
        if answer != "default" {
            findings.add("fmi2GetTypesPlatform", format!("{answer:?} (allowed: \"default\")"));
        }
    }
    Ok(())
}

/// `load.version`
pub fn version(guest: &Guest, findings: &mut Findings) -> Result<()> {
    guest.doing("fmi2GetVersion");
    for fmu in guest.binaries() {
        let answer = fmu.version();
        if answer != "2.0" {
            findings.add("fmi2GetVersion", format!("{answer:?} (allowed: \"2.0\")"));
        }
    }
    Ok(())
}

/// `load.instance`
pub fn instance(guest: &Guest, findings: &mut Findings) -> Result<()> {
    for interface in guest.interfaces() {
        guest.session(interface)?;
    }
    if guest.interfaces().is_empty() {
        findings.add("fmi2Instantiate", "the binary lacks the functions of the declared interface");
    }
    Ok(())
}

/// `load.initialises`
pub fn initialises(guest: &Guest, _: &mut Findings) -> Result<()> {
    for interface in guest.interfaces() {
        guest.running(interface)?;
    }
    Ok(())
}

/// `load.again`
pub fn again(guest: &Guest, findings: &mut Findings) -> Result<()> {
    let mut runs = Vec::new();
    for copy in ["one", "one", "two"] {
        let folder = tempfile::tempdir()?;
        guest.doing(format!("loading copy {copy} of the binary"));
        let copied = guest.copy(folder.path())?;
        let interface = first(&copied)?;
        let mut session = copied.running(interface)?;
        session.advance(STEPS)?;
        runs.push(session.readings()?);
        drop(session);
        guest.doing(format!("unloading copy {copy} of the binary"));
    }
    for run in &runs[1..] {
        if let Some(text) = guest.session(first(guest)?)?.difference(run, &runs[0]) {
            findings.add("loading it again", text);
        }
    }
    Ok(())
}

/// The interface most rules use.
pub fn first(guest: &Guest) -> Result<Interface> {
    let why = || super::guest::Unusable {
        rule: "load.instance",
        why: "it offers no interface that can be called".into(),
    };
    Ok(*guest.interfaces().first().ok_or_else(why)?)
}

/// `instantiate.guid`
pub fn guid(guest: &Guest, findings: &mut Findings) -> Result<()> {
    let interface = first(guest)?;
    let wrong = format!("{}x", guest.fmu(interface).description().guid);
    for (what, guid) in [("another GUID", Some(wrong.as_str())), ("GUID NULL", None)] {
        refused(
            guest,
            interface,
            findings,
            what,
            &Instantiation { guid, ..arguments(guest, interface) },
        );
    }
    Ok(())
}

fn arguments(guest: &Guest, interface: Interface) -> Instantiation<'_> {
    Instantiation { kind: interface.kind(), ..guest.fmu(interface).instantiation("check") }
}

fn refused(
    guest: &Guest,
    interface: Interface,
    findings: &mut Findings,
    what: &str,
    with: &Instantiation,
) {
    let place = format!("fmi2Instantiate with {what}");
    guest.doing(&place);
    match guest.fmu(interface).instantiate_with(with) {
        Ok(_) => findings.add(place, "it gives an instance (allowed: NULL)"),
        Err(error) if error.messages.is_empty() => {
            findings
                .add(place, "NULL without a word to the logger (allowed: a message that says why)");
        }
        Err(_) => {}
    }
}

/// `instantiate.arguments`
pub fn arguments_null(guest: &Guest, findings: &mut Findings) -> Result<()> {
    let interface = first(guest)?;
    let place = "fmi2Instantiate with the resource location NULL";
    guest.doing(place);
    let with = Instantiation { resources: None, ..arguments(guest, interface) };
    if let Err(error) = guest.fmu(interface).instantiate_with(&with)
        && guest.description().co_simulation.is_some()
    {
        findings.add(place, error.to_string());
    }
    for (what, name) in [("instance name NULL", None), ("an empty instance name", Some(""))] {
        let with = Instantiation { name, ..arguments(guest, interface) };
        refused(guest, interface, findings, what, &with);
    }
    Ok(())
}

/// `instantiate.callbacks`
pub fn callbacks(guest: &Guest, findings: &mut Findings) -> Result<()> {
    let interface = first(guest)?;
    if !guest.can(interface, "canNotUseMemoryManagementFunctions") {
        findings.skip("canNotUseMemoryManagementFunctions is not declared");
        return Ok(());
    }
    let place = "fmi2Instantiate with NULL for the memory functions";
    guest.doing(place);
    let with = Instantiation { callbacks: Callbacks::Logger, ..arguments(guest, interface) };
    let made = guest.fmu(interface).instantiate_with(&with);
    match made.map_err(anyhow::Error::from).and_then(|instance| live(guest, instance)) {
        Ok(()) => {}
        Err(error) => {
            findings.add(place, format!("{error} (allowed: an instance that initialises)"))
        }
    }
    // Without a logger it may refuse, and must not crash.
    guest.doing("fmi2Instantiate with callbacks that are all NULL");
    let with = Instantiation { callbacks: Callbacks::Empty, ..arguments(guest, interface) };
    if let Ok(instance) = guest.fmu(interface).instantiate_with(&with)
        && let Err(error) = live(guest, instance)
    {
        findings.add(guest.now(), format!("{error} (allowed: no instance, or one that works)"));
    }
    Ok(())
}

/// A refused call and an initialisation.
fn live(guest: &Guest, mut instance: Instance) -> Result<()> {
    let experiment = guest.experiment();
    guest.doing("fmi2SetupExperiment to fmi2ExitInitializationMode without callbacks");
    instance.setup_experiment(None, experiment.start, None)?;
    instance.enter_initialization_mode()?;
    instance.exit_initialization_mode()?;
    guest.doing("a refused call without callbacks");
    let _ = instance.get_real(&[u32::MAX], &mut [0.0]);
    Ok(())
}

/// `instantiate.copies`
pub fn copies(guest: &Guest, findings: &mut Findings) -> Result<()> {
    let interface = first(guest)?;
    guest.doing("fmi2Instantiate with callbacks that are wiped afterwards");
    let with = Instantiation { callbacks: Callbacks::Fleeting, ..arguments(guest, interface) };
    let mut instance = guest.fmu(interface).instantiate_with(&with)?;
    guest.doing("a refused call after the callbacks' struct was wiped");
    if let Err(error) = instance.get_real(&[u32::MAX], &mut [0.0])
        && error.messages.is_empty()
    {
        findings
            .add(guest.now(), "no message reaches the logger (allowed: a copy of the callbacks)");
    }
    Ok(())
}

/// `instantiate.null`
pub fn null(guest: &Guest, findings: &mut Findings) -> Result<()> {
    guest.doing("fmi2FreeInstance(NULL), or another call with the instance NULL");
    for fmu in guest.binaries() {
        for (call, status) in fmu.calls_with_null_instance() {
            if !matches!(status, Status::Error | Status::Fatal) {
                findings.add(
                    format!("{call} with the instance NULL"),
                    format!("fmi2{status:?} (allowed: fmi2Error)"),
                );
            }
        }
    }
    Ok(())
}

/// `life.instances`
pub fn instances(guest: &Guest, findings: &mut Findings) -> Result<()> {
    for interface in guest.interfaces() {
        let alone = {
            let mut session = guest.running(interface)?;
            session.advance(STEPS)?;
            session.readings()?
        };
        let (mut one, mut two) = (guest.running(interface)?, guest.running(interface)?);
        two.advance(3)?;
        for _ in 0..STEPS {
            one.advance(1)?;
            two.advance(1)?;
        }
        let readings = one.readings()?;
        if let Some(text) = one.difference(&readings, &alone) {
            findings.add(format!("{}, two instances in turn", interface.name()), text);
        }
        drop(two);
        one.advance(1)?;
    }
    Ok(())
}

/// `life.deterministic`
pub fn deterministic(guest: &Guest, findings: &mut Findings) -> Result<()> {
    for interface in guest.interfaces() {
        let mut runs = Vec::new();
        for _ in 0..2 {
            let mut session = guest.running(interface)?;
            session.advance(STEPS)?;
            runs.push(session.readings()?);
            if let [first, second] = &runs[..]
                && let Some(text) = session.difference(second, first)
            {
                findings.add(format!("{}, the same run again", interface.name()), text);
            }
        }
    }
    Ok(())
}

/// `life.reset`
pub fn reset(guest: &Guest, findings: &mut Findings) -> Result<()> {
    for interface in guest.interfaces() {
        let fresh = history(&mut guest.session(interface)?)?;
        let mut session = guest.session(interface)?;
        // Before the run that counts: another time, another tolerance, another history.
        perturb(&mut session);
        let start = guest.experiment().start;
        if session.initialise_at(start + 1.0, None, Some(1e-3)).is_ok() {
            session.count = 7;
            session.advance(5)?;
        }
        guest.doing("fmi2Reset after steps");
        session.instance.reset()?;
        session.count = 0;
        let again = history(&mut session)
            .map_err(|error| anyhow::anyhow!("a run after fmi2Reset: {error:#}"))?;
        for (fresh, again) in fresh.iter().zip(&again) {
            if let Some(text) = session.difference(again, fresh) {
                findings.add(format!("{}, a run after fmi2Reset", interface.name()), text);
                break;
            }
        }
    }
    Ok(())
}

/// All values after initialisation and after a run.
fn history(session: &mut Session) -> Result<Vec<Vec<Reading>>> {
    session.initialise()?;
    let mut all = vec![session.readings()?];
    session.advance(STEPS)?;
    all.push(session.readings()?);
    Ok(all)
}

/// Changes parameters a little, those that let it.
fn perturb(session: &mut Session) {
    let guest = session.guest;
    for v in guest.variables().iter().filter(|v| v.is_set_by_hosts() && v.is_real()) {
        let Some(Reading::Real(start)) = super::guest::start_value(v) else { continue };
        let (min, max) = v.bounds();
        let moved = start * 1.01;
        if moved >= min && moved <= max {
            // one that is refused keeps its value
            let _ = session.set(v, &Reading::Real(moved));
        }
    }
}

/// `life.reset_anywhere`
pub fn reset_anywhere(guest: &Guest, findings: &mut Findings) -> Result<()> {
    for interface in guest.interfaces() {
        guest.running(interface)?; // if that fails, another rule tells
        for (stage, from) in [
            (Stage::Instantiated, Stage::Instantiated.name()),
            (Stage::Initialization, Stage::Initialization.name()),
            (Stage::Terminated, Stage::Terminated.name()),
            (Stage::Initialised, "after an error"),
        ] {
            let mut session = guest.session_in(interface, stage)?;
            if stage == Stage::Initialised {
                let _ = session.instance.get_real(&[u32::MAX], &mut [0.0]);
            }
            let place = format!("fmi2Reset, {from} ({})", interface.name());
            guest.doing(&place);
            if let Err(error) = session.instance.reset() {
                findings.add(place, error.to_string());
                continue;
            }
            if let Err(error) = session.initialise() {
                findings.add(place, format!("it cannot be initialised again: {error}"));
            }
        }
    }
    Ok(())
}

/// `life.terminate`
pub fn terminate(guest: &Guest, findings: &mut Findings) -> Result<()> {
    for interface in guest.interfaces() {
        let mut session = guest.running(interface)?;
        session.advance(3)?;
        let before = session.readings()?;
        guest.doing("fmi2Terminate");
        session.instance.terminate()?;
        guest.doing("reading values after fmi2Terminate");
        let after = session.readings()?;
        if let Some(text) = session.difference(&after, &before) {
            findings.add(format!("after fmi2Terminate ({})", interface.name()), text);
        }
    }
    Ok(())
}

/// A call of the list of [`order`].
type Misplaced = (&'static str, fn(&mut Session) -> Result<(), CallError>);

/// `life.order`
pub fn order(guest: &Guest, findings: &mut Findings) -> Result<()> {
    let setup: Misplaced =
        ("fmi2SetupExperiment", |s| s.instance.setup_experiment(None, s.time, None));
    let enter: Misplaced =
        ("fmi2EnterInitializationMode", |s| s.instance.enter_initialization_mode());
    let exit: Misplaced = ("fmi2ExitInitializationMode", |s| s.instance.exit_initialization_mode());
    let step: Misplaced = ("fmi2DoStep", |s| s.instance.do_step(s.time, s.step));
    let terminate: Misplaced = ("fmi2Terminate", |s| s.instance.terminate());
    let event: Misplaced = ("fmi2EnterEventMode", |s| s.instance.enter_event_mode());
    let discrete: Misplaced =
        ("fmi2NewDiscreteStates", |s| s.instance.new_discrete_states().map(|_| ()));
    let continuous: Misplaced =
        ("fmi2EnterContinuousTimeMode", |s| s.instance.enter_continuous_time_mode());
    let completed: Misplaced =
        ("fmi2CompletedIntegratorStep", |s| s.instance.completed_integrator_step().map(|_| ()));
    let common: [(Stage, Vec<Misplaced>); 4] = [
        (Stage::Instantiated, vec![exit, terminate]),
        (Stage::Initialization, vec![setup, enter, terminate]),
        (Stage::Initialised, vec![setup, enter, exit]),
        (Stage::Terminated, vec![setup, enter, exit, terminate]),
    ];
    for interface in guest.interfaces() {
        let own = match interface {
            Interface::CoSimulation => vec![step],
            Interface::ModelExchange => vec![event, discrete, continuous, completed],
        };
        for (stage, calls) in &common {
            let more: &[Misplaced] = match stage {
                Stage::Initialised if interface == Interface::CoSimulation => &[],
                // continuous-time mode allows the first and the last
                Stage::Initialised => &own[1..3],
                _ => &own,
            };
            for (call, made) in calls.iter().chain(more) {
                let mut session = guest.session_in(interface, *stage)?;
                let state = stage.name();
                let place = format!("{call} in state \"{state}\" ({})", interface.name());
                guest.doing(&place);
                expect_refusal(findings, place, made(&mut session));
            }
        }
    }
    Ok(())
}

/// A call that must be refused, with a message.
pub fn expect_refusal(findings: &mut Findings, place: String, answer: Result<(), CallError>) {
    match answer {
        Ok(()) => findings.add(place, "it is accepted (allowed: fmi2Error and a message)"),
        Err(error) if error.status == Status::Fatal => {
            findings.add(place, format!("{error} (allowed: fmi2Error, the instance lives on)"));
        }
        Err(error) if error.messages.iter().all(|m| m.text.trim().is_empty()) => {
            findings
                .add(place, format!("{error} (allowed: fmi2Error and a message that says why)"));
        }
        Err(_) => {}
    }
}

// ---------------------------------------------------------------- the host

/// A life to its end, and one that an error ends.
fn ordinary_lives(guest: &Guest, interface: Interface) -> Result<()> {
    let mut session = guest.running(interface)?;
    session.advance(STEPS)?;
    guest.doing("fmi2Terminate");
    session.instance.terminate()?;
    drop(session);
    let mut session = guest.running(interface)?;
    guest.doing("fmi2GetReal of an unknown value reference");
    let _ = session.instance.get_real(&[u32::MAX], &mut [0.0]);
    Ok(())
}

/// `host.silent`: the process that runs this one looks at what is printed.
pub fn silent(guest: &Guest, _: &mut Findings) -> Result<()> {
    for interface in guest.interfaces() {
        ordinary_lives(guest, interface)?;
    }
    Ok(())
}

/// What of the process is looked at, with its name.
fn surroundings() -> Vec<(&'static str, String)> {
    let state = HostState::now();
    let count = |folder: &str| {
        std::fs::read_dir(folder).map_or(String::new(), |entries| entries.count().to_string())
    };
    let mut environment: Vec<_> = std::env::vars_os().collect();
    environment.sort();
    vec![
        ("floating-point control (rounding, exceptions)", format!("{:#x}", state.float_control)),
        ("locale", state.locale),
        ("signal handlers", format!("{:#x}", state.signal_handlers)),
        ("working directory", format!("{:?}", std::env::current_dir().ok())),
        ("environment variables", format!("{environment:?}")),
        // where the system tells
        ("number of threads", count("/proc/self/task")),
        ("number of open files", count("/proc/self/fd")),
    ]
}

/// `host.untouched`
pub fn untouched(guest: &Guest, findings: &mut Findings) -> Result<()> {
    let before = surroundings();
    for interface in guest.interfaces() {
        ordinary_lives(guest, interface)?;
    }
    for ((name, before), (_, after)) in before.into_iter().zip(surroundings()) {
        if before != after {
            let values = match name {
                "environment variables" => String::new(),
                _ => format!(": {before} before, {after} after"),
            };
            findings.add("the host's process", format!("it changes the {name}{values}"));
        }
    }
    Ok(())
}
