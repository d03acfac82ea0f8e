//! Rules about saved states (FMI 2.0.5, section 2.1.8).

use anyhow::Result;

use super::findings::Findings;
use super::under_test::{
    FmuUnderTest, Mark, Readings, STEPS, Session, Stage, Tested, UnderTest, Unusable, Use,
};

/// Returns the uses whose interface declares a capability. The name of the capability is `can`, for
/// example "canSerialize", followed by the word for a state in this version of FMI. Skips the rule if
/// no interface declares it.
pub fn uses_with<V: Tested>(fmu: &UnderTest<V>, can: &str, findings: &mut Findings) -> Vec<Use> {
    let flag = format!("{can}{}", V::STATE);
    let mut all = fmu.uses();
    all.retain(|using| fmu.has_capability(using.interface, &flag));
    if all.is_empty() {
        findings.skip(format!("{flag} is not declared"));
    }
    all
}

const SAVE: &str = "canGetAndSet";
const SERIALIZE: &str = "canSerialize";

pub fn continue_from<V: Tested>(session: &mut Session<V>, from: &Mark) -> Result<Readings> {
    session.go_back(from);
    session.advance(STEPS)?;
    session.readings()
}

/// Returns an error if two runs of one instance from the same saved state differ. `states.rollback`
/// reports this fault.
fn rolls_back<V: Tested>(fmu: &UnderTest<V>, using: Use) -> Result<()> {
    let mut session = fmu.running(using)?;
    session.advance(3)?;
    let (state, here) = (session.instance.get_state()?, session.mark());
    let first = continue_from(&mut session, &here)?;
    session.instance.set_state(&state)?;
    let second = continue_from(&mut session, &here)?;
    session.instance.free_state(state)?;
    match session.difference(&second, &first) {
        None => Ok(()),
        Some(why) => Err(Unusable { rule: "states.rollback", why }.into()),
    }
}

pub fn rollback<V: Tested>(fmu: &UnderTest<V>, findings: &mut Findings) -> Result<()> {
    let call = |verb: &str| format!("{}{verb}{}", V::FMI, V::STATE);
    for using in uses_with(fmu, SAVE, findings) {
        let mut session = fmu.running(using)?;
        session.advance(3)?;
        fmu.announce(call("Get"));
        let state = session.instance.get_state()?;
        let here = session.mark();
        let before = session.readings()?;
        let first = continue_from(&mut session, &here)?;
        fmu.announce(call("Set"));
        session.instance.set_state(&state)?;
        let restored = session.readings()?;
        let set = format!("after {} ({using})", call("Set"));
        if let Some(text) = session.difference(&restored, &before) {
            findings.at(format!("right {set}")).add(text);
        }
        let second = continue_from(&mut session, &here)?;
        if let Some(text) = session.difference(&second, &first) {
            findings.at(format!("{STEPS} steps {set}")).add(text);
        }
        fmu.announce(call("Free"));
        session.instance.free_state(state)?;
    }
    Ok(())
}

pub fn handle(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in uses_with(fmu, SAVE, findings) {
        let mut session = fmu.running(interface)?;
        let mut state = session.instance.get_state()?;
        session.advance(3)?;
        fmu.announce("fmi2GetFMUstate with the handle of an existing state");
        session.instance.get_state_into(&mut state)?;
        let here = session.mark();
        let first = continue_from(&mut session, &here)?;
        session.instance.set_state(&state)?;
        let second = continue_from(&mut session, &here)?;
        if let Some(text) = session.difference(&second, &first) {
            rolls_back(fmu, interface)?;
            findings.at(format!("a handle used again ({interface})")).add(text);
        }
        session.instance.free_state(state)?;
        fmu.announce("fmi2FreeFMUstate of NULL");
        session.instance.free_state_null()?;
    }
    Ok(())
}

pub fn bytes(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in uses_with(fmu, SERIALIZE, findings) {
        let (first, here, bytes) = {
            let mut session = fmu.running(interface)?;
            session.advance(3)?;
            let state = session.instance.get_state()?;
            fmu.announce("fmi2SerializeFMUstate");
            let bytes = session.instance.serialize(&state)?;
            if session.instance.serialize(&state)? != bytes {
                findings
                    .at("fmi2SerializeFMUstate")
                    .add("the same state gives other bytes the second time");
            }
            session.instance.free_state(state)?;
            let here = session.mark();
            (continue_from(&mut session, &here)?, here, bytes)
        };
        // The state is restored into an instance that has been simulated, and into a new one that was neither
        // set up nor initialised.
        for lived in [true, false] {
            let mut other = match lived {
                true => fmu.running(interface)?,
                false => fmu.session(interface)?,
            };
            fmu.announce(match lived {
                true => "fmi2DeSerializeFMUstate in another instance",
                false => "fmi2DeSerializeFMUstate and fmi2SetFMUstate in an instance without setup",
            });
            let state = other.instance.deserialize(&bytes)?;
            other.instance.set_state(&state)?;
            let second = continue_from(&mut other, &here)?;
            if let Some(text) = other.difference(&second, &first) {
                let place = format!("{} ({interface})", fmu.last_call());
                rolls_back(fmu, interface)?;
                findings.at(place).add(text);
            }
            other.instance.free_state(state)?;
        }
    }
    Ok(())
}

pub fn garbage(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in uses_with(fmu, SERIALIZE, findings) {
        let mut session = fmu.running(interface)?;
        session.advance(3)?;
        let state = session.instance.get_state()?;
        let bytes = session.instance.serialize(&state)?;
        session.instance.free_state(state)?;
        drop(session);
        let mut flipped = bytes.clone();
        if let Some(byte) = flipped.get_mut(bytes.len() / 2) {
            *byte ^= 0x55;
        }
        let half = bytes[..bytes.len() / 2].to_vec();
        let longer = [&bytes[..], &[0; 8]].concat();
        for (what, bytes) in [
            ("no bytes", Vec::new()),
            ("half of the bytes", half),
            ("8 bytes too many", longer),
            ("zeros", vec![0; bytes.len()]),
            ("one byte changed", flipped),
        ] {
            let place = format!("fmi2DeSerializeFMUstate with {what} ({interface})");
            let mut session = fmu.running(interface)?;
            session.advance(3)?;
            let before = session.readings()?;
            fmu.announce(&place);
            let accepted = match session.instance.deserialize(&bytes) {
                Err(_) => false,
                Ok(state) => {
                    let set = session.instance.set_state(&state).is_ok();
                    let _ = session.instance.free_state(state);
                    set
                }
            };
            if accepted {
                findings.at(place).add("the call is accepted (allowed: fmi2Error)");
                break;
            }
            // After an error the FMU may refuse calls that read values.
            if let Ok(after) = session.readings()
                && let Some(text) = session.difference(&after, &before)
            {
                findings
                    .at(place)
                    .add(format!("the call is refused and yet changes the FMU: {text}"));
            }
        }
        let mut session = fmu.running(interface)?;
        fmu.announce("fmi2SetFMUstate(NULL)");
        if session.instance.set_state_null().is_ok() {
            findings.at(fmu.last_call()).add("the call is accepted (allowed: fmi2Error)");
        }
    }
    Ok(())
}

pub fn modes(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in uses_with(fmu, SAVE, findings) {
        for stage in [Stage::Instantiated, Stage::Initialization, Stage::Terminated] {
            let mut session = fmu.session_in(interface, stage)?;
            let mode = stage.name();
            let place = format!("fmi2GetFMUstate and fmi2SetFMUstate, {mode} ({interface})");
            fmu.announce(&place);
            let done = session.instance.get_state().and_then(|state| {
                let set = session.instance.set_state(&state);
                session.instance.free_state(state).and(set)
            });
            if let Err(error) = done {
                findings.at(place).add(error.to_string());
            }
        }
    }
    Ok(())
}
