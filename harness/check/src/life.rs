//! Rules about loading, instantiation and the life cycle of instances (FMI 2.0.5, sections 2.1.5, 2.1.6 and
//! 4.2.4), and about the state of the host process that an FMU must not change.

use anyhow::Result;

use super::findings::Findings;
use super::under_test::{
    FmuUnderTest, Interface, Readings, STEPS, Session, Stage, Tested, UnderTest, Unusable, Use,
    skip, surroundings,
};
use host::description::Value;
use host::fmi2::{CallError, Callbacks, Instance, Instantiation, Status, file_uri};

/// `load.opens`: the check has already ended if no binary could be loaded. If the two interfaces have different
/// binaries, one binary may be loaded and the other broken; this function reports the broken one.
pub fn opens<V: Tested>(fmu: &UnderTest<V>, findings: &mut Findings) -> Result<()> {
    for why in fmu.callability_faults() {
        findings.at("the binary of one interface").add(why);
    }
    Ok(())
}

pub fn types_platform(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    fmu.announce("fmi2GetTypesPlatform");
    for binary in fmu.binaries() {
        let answer = binary.types_platform();
        if answer != "default" {
            findings.at("fmi2GetTypesPlatform").add(format!("{answer:?} (allowed: \"default\")"));
        }
    }
    Ok(())
}

pub fn version<V: Tested>(fmu: &UnderTest<V>, findings: &mut Findings) -> Result<()> {
    let call = format!("{}GetVersion", V::FMI);
    fmu.announce(&call);
    for binary in fmu.binaries() {
        let answer = binary.version();
        // FMI 3.0 has bug-fix releases, whose versions are for example 3.0.1.
        let is_fixed = fmu.description.words.version == "3.0" && answer.starts_with("3.0.");
        if answer != fmu.description.words.version && !is_fixed {
            findings
                .at(&call)
                .add(format!("{answer:?} (allowed: {:?})", fmu.description.words.version));
        }
    }
    Ok(())
}

pub fn instance<V: Tested>(fmu: &UnderTest<V>, findings: &mut Findings) -> Result<()> {
    for using in fmu.uses() {
        fmu.session(using)?;
    }
    if fmu.interfaces().is_empty() {
        let call = format!("{}Instantiate", V::FMI);
        findings.at(call).add("the binary lacks the functions of the declared interface");
    }
    Ok(())
}

pub fn initialises<V: Tested>(fmu: &UnderTest<V>, _: &mut Findings) -> Result<()> {
    for using in fmu.uses() {
        fmu.running(using)?;
    }
    Ok(())
}

pub fn again(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let mut runs = Vec::new();
    for copy in ["one", "one", "two"] {
        let folder = tempfile::tempdir()?;
        fmu.announce(format!("loading copy {copy} of the binary"));
        let copied = fmu.copy(folder.path())?;
        let interface = copied.first_interface()?;
        let mut session = copied.running(interface)?;
        session.advance(STEPS)?;
        runs.push(session.readings()?);
        drop(session);
        fmu.announce(format!("unloading copy {copy} of the binary"));
    }
    for run in &runs[1..] {
        if let Some(text) = fmu.session(fmu.first_interface()?)?.difference(run, &runs[0]) {
            is_deterministic(fmu, fmu.first_interface()?)?;
            findings.at("loading it again").add(text);
        }
    }
    Ok(())
}

pub fn guid(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let interface = fmu.first_interface()?;
    let wrong = format!("{}x", fmu.binary(interface)?.description().guid);
    let with = Instantiation { guid: Some(&wrong), ..fmu.arguments(interface)? };
    let place = "fmi2Instantiate with another GUID";
    fmu.announce(place);
    expect_null(findings, place, fmu.instantiate(interface, &with)?);
    Ok(())
}

fn expect_null(findings: &mut Findings, place: &str, answer: Result<Instance, CallError>) {
    match answer {
        Ok(_) => findings.at(place).add("the call returns an instance (allowed: NULL)"),
        Err(error) if error.messages.is_empty() => {
            findings.at(place).add(
                "the call returns NULL and logs no message (required: a message with the reason)",
            );
        }
        Err(_) => {}
    }
}

pub fn arguments_null(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let interface = fmu.first_interface()?;
    // The standard requires a URI, so that only an FMU without resources has to work with NULL.
    let place = "fmi2Instantiate with the resource location NULL";
    let with = Instantiation { resources: None, ..fmu.arguments(interface)? };
    let answer =
        fmu.with_undefined_effect(place, findings, || fmu.instantiate(interface, &with))?;
    if let Err(error) = answer
        && fmu.description.interface("CoSimulation").is_some()
    {
        findings.at(place).add(error.to_string());
    }
    // Hosts must not pass these arguments, so that the standard does not define their effect.
    for (what, with) in [
        ("the instance name NULL", Instantiation { name: None, ..fmu.arguments(interface)? }),
        ("an empty instance name", Instantiation { name: Some(""), ..fmu.arguments(interface)? }),
        ("the GUID NULL", Instantiation { guid: None, ..fmu.arguments(interface)? }),
    ] {
        let place = format!("fmi2Instantiate with {what}");
        let answer =
            fmu.with_undefined_effect(&place, findings, || fmu.instantiate(interface, &with))?;
        expect_null(findings, &place, answer);
    }
    Ok(())
}

pub fn resources(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let resources = fmu.directory().join("resources");
    if !resources.is_dir() {
        return skip("the FMU has no resources");
    }
    let interface = fmu.first_interface()?;
    let run = |location: Option<&str>| -> Result<Readings> {
        let mut session = match location {
            None => fmu.session(interface)?,
            Some(_) => {
                fmu.announce("fmi2Instantiate with another resource location");
                let with = fmu.arguments(interface)?;
                let with = Instantiation { resources: location, logging: false, ..with };
                fmu.session_with(interface, &with)?
            }
        };
        session.initialise()?;
        session.advance(STEPS)?;
        let mut all = session.readings()?;
        // A text variable may contain the path of the resources, and is therefore not compared.
        all.retain(|values| !matches!(values[0], Value::String(_)));
        Ok(all)
    };
    let is_same = |one: &Readings, two: &Readings| {
        one.iter().flatten().zip(two.iter().flatten()).all(|(a, b)| a.is_identical(b))
    };
    let usual = run(None)?;
    is_deterministic(fmu, interface)?;
    let folder = tempfile::tempdir()?;
    let odd = folder.path().join("a b%41c");
    std::fs::create_dir(&odd)?;
    #[cfg(unix)]
    std::os::unix::fs::symlink(&resources, odd.join("resources"))?;
    #[cfg(not(unix))]
    super::under_test::copy_files(&resources, &odd.join("resources"))?;
    for (location, allowed) in [
        (file_uri(&odd.join("resources")), "a URI, whose %20 is a space and whose %25 is a %"),
        (file_uri(&resources).replacen("file://", "file:", 1), "file:/ as well as file:///"),
    ] {
        let place = format!("fmi2Instantiate with the resource location {location}");
        match run(Some(&location)) {
            Ok(values) if is_same(&values, &usual) => {}
            Ok(_) => {
                findings.at(place).add(format!("the values differ from those of a run with the usual resource location (allowed as resource location: {allowed})"))
            }
            Err(error) => match error.downcast::<Unusable>() {
                Ok(unusable) if unusable.rule.is_empty() => return Err(unusable.into()),
                Ok(unusable) => findings.at(place).add(format!("{unusable} (allowed: {allowed})")),
                Err(error) => findings.at(place).add(format!("{error:#} (allowed: {allowed})")),
            },
        }
    }
    Ok(())
}

/// Makes a call that the FMU must refuse, with the usual callbacks. Returns true if the FMU logs the reason. A crash
/// is reported by `values.unknown`.
fn logs_usual_refusal(fmu: &FmuUnderTest, interface: Interface) -> Result<bool> {
    let mut session = fmu.running(interface)?;
    Ok(session.provoke_refusal().is_some_and(|error| !error.messages.is_empty()))
}

pub fn callbacks(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let interface = fmu.first_interface()?;
    fmu.require(interface, "canNotUseMemoryManagementFunctions")?;
    logs_usual_refusal(fmu, interface)?;
    let place = "fmi2Instantiate with NULL for the memory functions";
    fmu.announce(place);
    let with = Instantiation { callbacks: Callbacks::Logger, ..fmu.arguments(interface)? };
    let made = fmu.instantiate(interface, &with)?;
    match made
        .map_err(anyhow::Error::from)
        .and_then(|instance| initialise_and_refuse(fmu, instance))
    {
        Ok(()) => {}
        Err(error) => {
            findings.at(place).add(format!("{error} (required: the instance can be initialised)"))
        }
    }
    // Hosts must pass a logger. An FMU may refuse an instance without one, but should not crash.
    let with = Instantiation { callbacks: Callbacks::Empty, ..fmu.arguments(interface)? };
    let place = "fmi2Instantiate with callbacks that are all NULL";
    let answer = fmu.with_undefined_effect(place, findings, || {
        fmu.instantiate(interface, &with)?
            .map_or(Ok(()), |instance| initialise_and_refuse(fmu, instance))
    });
    if let Err(error) = answer {
        findings.at(fmu.last_call()).add(format!(
            "{error} (allowed: the FMU returns no instance, or one that can be simulated)"
        ));
    }
    Ok(())
}

fn initialise_and_refuse(fmu: &FmuUnderTest, mut instance: Instance) -> Result<()> {
    let experiment = fmu.experiment();
    fmu.announce("fmi2SetupExperiment to fmi2ExitInitializationMode without callbacks");
    instance.setup_experiment(None, experiment.start, None)?;
    instance.enter_initialization_mode()?;
    instance.exit_initialization_mode()?;
    fmu.announce("a refused call without callbacks");
    let _ = instance.get_real(&[u32::MAX], &mut [0.0]);
    Ok(())
}

pub fn copies(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    let interface = fmu.first_interface()?;
    let logs = logs_usual_refusal(fmu, interface)?;
    fmu.announce("fmi2Instantiate with callbacks that are wiped afterwards");
    let with = Instantiation { callbacks: Callbacks::Fleeting, ..fmu.arguments(interface)? };
    let mut instance = fmu.instantiate(interface, &with)??;
    fmu.announce("a refused call after the callbacks' struct was wiped");
    if let Err(error) = instance.get_real(&[u32::MAX], &mut [0.0])
        && error.messages.is_empty()
        && logs
    {
        findings
            .at(fmu.last_call())
            .add("no message reaches the logger after the host has overwritten its struct of callbacks (required: the FMU keeps its own copy of the struct)");
    }
    Ok(())
}

/// `instantiate.free_null`: the rule is broken if the call crashes.
pub fn free_null<V: Tested>(fmu: &UnderTest<V>, _: &mut Findings) -> Result<()> {
    fmu.announce(format!("{}FreeInstance(NULL)", V::FMI));
    for binary in fmu.binaries() {
        binary.free_null_instance();
    }
    Ok(())
}

pub fn null(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for binary in fmu.binaries() {
        let answers = fmu.with_undefined_effect("a call with the instance NULL", findings, || {
            binary.calls_with_null_instance()
        });
        for (call, status) in answers {
            if !matches!(status, Status::Error | Status::Fatal) {
                findings
                    .at(format!("{call} with the instance NULL"))
                    .add(format!("fmi2{status:?} (allowed: fmi2Error)"));
            }
        }
    }
    Ok(())
}

pub fn instances<V: Tested>(fmu: &UnderTest<V>, findings: &mut Findings) -> Result<()> {
    for using in fmu.uses() {
        let alone = {
            let mut session = fmu.running(using)?;
            session.advance(STEPS)?;
            session.readings()?
        };
        let (mut one, mut two) = (fmu.running(using)?, fmu.running(using)?);
        two.advance(3)?;
        for _ in 0..STEPS {
            one.advance(1)?;
            two.advance(1)?;
        }
        let readings = one.readings()?;
        if let Some(text) = one.difference(&readings, &alone) {
            is_deterministic(fmu, using)?;
            findings.at(format!("{using}, two instances in turn")).add(text);
        }
        drop(two);
        one.advance(1)?;
    }
    Ok(())
}

pub fn deterministic<V: Tested>(fmu: &UnderTest<V>, findings: &mut Findings) -> Result<()> {
    for using in fmu.uses() {
        if let Some(text) = differs_when_run_again(fmu, using)? {
            findings.at(format!("{using}, the same run again")).add(text);
        }
    }
    Ok(())
}

fn differs_when_run_again<V: Tested>(fmu: &UnderTest<V>, using: Use) -> Result<Option<String>> {
    let run = || -> Result<_> {
        let mut session = fmu.running(using)?;
        session.advance(STEPS)?;
        Ok((session.readings()?, session))
    };
    let (first, session) = run()?;
    drop(session);
    let (second, session) = run()?;
    Ok(session.difference(&second, &first))
}

/// Returns an error if two equal runs differ, because a comparison of runs then proves nothing.
/// `life.deterministic` reports this fault.
pub fn is_deterministic<V: Tested>(fmu: &UnderTest<V>, using: impl Into<Use>) -> Result<()> {
    match differs_when_run_again(fmu, using.into())? {
        None => Ok(()),
        Some(why) => Err(Unusable { rule: "life.deterministic", why }.into()),
    }
}

pub fn reset<V: Tested>(fmu: &UnderTest<V>, findings: &mut Findings) -> Result<()> {
    let call = format!("{}Reset", V::FMI);
    for using in fmu.uses() {
        let fresh = history(&mut fmu.session(using)?)?;
        let mut session = fmu.session(using)?;
        V::leave_trajectory(&mut session)?;
        fmu.announce(format!("{call} after steps"));
        session.instance.reset()?;
        session.rewind();
        let again = history(&mut session)
            .map_err(|error| anyhow::anyhow!("the run after {call} failed: {error:#}"))?;
        for (fresh, again) in fresh.iter().zip(&again) {
            if let Some(text) = session.difference(again, fresh) {
                is_deterministic(fmu, using)?;
                findings.at(format!("{using}, a run after {call}")).add(text);
                break;
            }
        }
    }
    Ok(())
}

fn history<V: Tested>(session: &mut Session<V>) -> Result<Vec<Readings>> {
    session.initialise()?;
    let mut all = vec![session.readings()?];
    session.advance(STEPS)?;
    all.push(session.readings()?);
    Ok(all)
}

pub fn reset_anywhere(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in fmu.interfaces() {
        fmu.running(interface)?; // if that fails, another rule tells
        for (stage, from) in [
            (Stage::Instantiated, Stage::Instantiated.name()),
            (Stage::Initialization, Stage::Initialization.name()),
            (Stage::Terminated, Stage::Terminated.name()),
            (Stage::Initialised, "after an error"),
        ] {
            let mut session = fmu.session_in(interface, stage)?;
            if stage == Stage::Initialised {
                session.provoke_refusal();
            }
            let place = format!("fmi2Reset, {from} ({interface})");
            fmu.announce(&place);
            if let Err(error) = session.instance.reset() {
                findings.at(place).add(error.to_string());
                continue;
            }
            if let Err(error) = session.initialise() {
                findings
                    .at(place)
                    .add(format!("the instance cannot be initialised again: {error}"));
            }
        }
    }
    Ok(())
}

pub fn terminate<V: Tested>(fmu: &UnderTest<V>, findings: &mut Findings) -> Result<()> {
    let call = format!("{}Terminate", V::FMI);
    for using in fmu.uses() {
        let mut session = fmu.running(using)?;
        session.advance(3)?;
        let before = session.readings()?;
        fmu.announce(&call);
        session.instance.terminate()?;
        fmu.announce(format!("reading values after {call}"));
        let after = session.readings()?;
        // FMI 3.0 requires only that values can be read; FMUs of Dymola change values slightly in fmi3Terminate.
        if fmu.description.words.version == "2.0"
            && let Some(text) = session.difference(&after, &before)
        {
            findings.at(format!("after {call} ({using})")).add(text);
        }
    }
    Ok(())
}

type Misplaced = (&'static str, fn(&mut Session) -> Result<(), CallError>);

pub fn order(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
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
    for interface in fmu.interfaces() {
        let own = match interface {
            Interface::CoSimulation => vec![step],
            Interface::ModelExchange => vec![event, discrete, continuous, completed],
        };
        for (stage, calls) in &common {
            let more: &[Misplaced] = match stage {
                Stage::Initialised if interface == Interface::CoSimulation => &[],
                // In continuous-time mode, only the first and the last of these calls are allowed.
                Stage::Initialised => &own[1..3],
                _ => &own,
            };
            for (call, made) in calls.iter().chain(more) {
                let mut session = fmu.session_in(interface, *stage)?;
                let state = stage.name();
                let place = format!("{call} in state \"{state}\" ({interface})");
                let answer = fmu.with_undefined_effect(&place, findings, || made(&mut session));
                expect_refusal(findings, place, answer);
            }
        }
    }
    Ok(())
}

/// Adds a finding unless the FMU refuses the call with fmi2Error and logs the reason.
pub fn expect_refusal(findings: &mut Findings, place: String, answer: Result<(), CallError>) {
    match answer {
        Ok(()) => findings.at(place).add("the call is accepted (allowed: fmi2Error and a message)"),
        Err(error) if error.status == Status::Fatal => {
            findings
                .at(place)
                .add(format!("{error} (allowed: fmi2Error, and the instance can still be used)"));
        }
        Err(error) if error.messages.iter().all(|m| m.text.trim().is_empty()) => {
            // The standard requires only the error, so that a missing message is only a warning.
            findings
                .at(place)
                .warn(format!("{error} (expected: fmi2Error and a message that says why)"));
        }
        Err(_) => {}
    }
}

fn run_ordinary_instances(fmu: &FmuUnderTest, interface: Interface) -> Result<()> {
    let mut session = fmu.running(interface)?;
    session.advance(STEPS)?;
    fmu.announce("fmi2Terminate");
    session.instance.terminate()?;
    drop(session);
    logs_usual_refusal(fmu, interface).map(|_| ())
}

pub fn silent(fmu: &FmuUnderTest, _: &mut Findings) -> Result<()> {
    for interface in fmu.interfaces() {
        run_ordinary_instances(fmu, interface)?;
    }
    Ok(())
}

pub fn untouched(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in fmu.interfaces() {
        run_ordinary_instances(fmu, interface)?;
    }
    // The comparison is with the state before the binary was loaded, so that changes by its constructors count.
    for ((name, before), (_, after)) in fmu.before.iter().zip(surroundings()) {
        if *before != after {
            let values = match *name {
                "environment variables" => String::new(),
                _ => format!(": {before} before, {after} after"),
            };
            findings.at("the host's process").add(format!("the FMU changes the {name}{values}"));
        }
    }
    Ok(())
}
