//! Saved states (FMI 2.0.5, section 2.1.8).

use anyhow::Result;

use super::Findings;
use super::under_test::{FmuUnderTest, Interface, Mark, Reading, STEPS, Session, Stage, Unusable};

/// Interfaces that declare a capability; none is a reason to skip.
fn with(fmu: &FmuUnderTest, flag: &str, findings: &mut Findings) -> Vec<Interface> {
    let mut all = fmu.interfaces();
    all.retain(|interface| fmu.can(*interface, flag));
    if all.is_empty() {
        findings.skip(format!("{flag} is not declared"));
    }
    all
}

const SAVE: &str = "canGetAndSetFMUstate";
const SERIALIZE: &str = "canSerializeFMUstate";

/// Goes on by some steps from where the host was when it saved the state.
fn continued(session: &mut Session, from: &Mark) -> Result<Vec<Reading>> {
    session.go_back(from);
    session.advance(STEPS)?;
    session.readings()
}

/// Fails if a run from a saved state differs in the instance that has saved it: `states.rollback` reports that.
fn rolls_back(fmu: &FmuUnderTest, interface: Interface) -> Result<()> {
    let mut session = fmu.running(interface)?;
    session.advance(3)?;
    let (state, here) = (session.instance.get_state()?, session.mark());
    let first = continued(&mut session, &here)?;
    session.instance.set_state(&state)?;
    let second = continued(&mut session, &here)?;
    session.instance.free_state(state)?;
    match session.difference(&second, &first) {
        None => Ok(()),
        Some(why) => Err(Unusable { rule: "states.rollback", why }.into()),
    }
}

/// `states.rollback`
pub fn rollback(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in with(fmu, SAVE, findings) {
        let mut session = fmu.running(interface)?;
        session.advance(3)?;
        fmu.doing("fmi2GetFMUstate");
        let state = session.instance.get_state()?;
        let here = session.mark();
        let before = session.readings()?;
        let first = continued(&mut session, &here)?;
        fmu.doing("fmi2SetFMUstate");
        session.instance.set_state(&state)?;
        let restored = session.readings()?;
        if let Some(text) = session.difference(&restored, &before) {
            findings.add(format!("right after fmi2SetFMUstate ({})", interface.name()), text);
        }
        let second = continued(&mut session, &here)?;
        if let Some(text) = session.difference(&second, &first) {
            let place = format!("{STEPS} steps after fmi2SetFMUstate ({})", interface.name());
            findings.add(place, text);
        }
        fmu.doing("fmi2FreeFMUstate");
        session.instance.free_state(state)?;
    }
    Ok(())
}

/// `states.handle`
pub fn handle(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in with(fmu, SAVE, findings) {
        let mut session = fmu.running(interface)?;
        let mut state = session.instance.get_state()?;
        session.advance(3)?;
        fmu.doing("fmi2GetFMUstate into a handle that is there already");
        session.instance.get_state_into(&mut state)?;
        let here = session.mark();
        let first = continued(&mut session, &here)?;
        session.instance.set_state(&state)?;
        let second = continued(&mut session, &here)?;
        if let Some(text) = session.difference(&second, &first) {
            rolls_back(fmu, interface)?;
            findings.add(format!("a handle used again ({})", interface.name()), text);
        }
        session.instance.free_state(state)?;
        fmu.doing("fmi2FreeFMUstate of NULL");
        session.instance.free_state_null()?;
    }
    Ok(())
}

/// `states.bytes`
pub fn bytes(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in with(fmu, SERIALIZE, findings) {
        let (first, here, bytes) = {
            let mut session = fmu.running(interface)?;
            session.advance(3)?;
            let state = session.instance.get_state()?;
            fmu.doing("fmi2SerializeFMUstate");
            let bytes = session.instance.serialize(&state)?;
            if session.instance.serialize(&state)? != bytes {
                findings.add(
                    "fmi2SerializeFMUstate",
                    "the same state gives other bytes the second time",
                );
            }
            session.instance.free_state(state)?;
            let here = session.mark();
            (continued(&mut session, &here)?, here, bytes)
        };
        // One instance that has lived, one that was neither set up nor initialised.
        for lived in [true, false] {
            let mut other = match lived {
                true => fmu.running(interface)?,
                false => fmu.session(interface)?,
            };
            fmu.doing(match lived {
                true => "fmi2DeSerializeFMUstate in another instance",
                false => "fmi2DeSerializeFMUstate and fmi2SetFMUstate in an instance without setup",
            });
            let state = other.instance.deserialize(&bytes)?;
            other.instance.set_state(&state)?;
            let second = continued(&mut other, &here)?;
            if let Some(text) = other.difference(&second, &first) {
                let place = format!("{} ({})", fmu.now(), interface.name());
                rolls_back(fmu, interface)?;
                findings.add(place, text);
            }
            other.instance.free_state(state)?;
        }
    }
    Ok(())
}

/// `states.garbage`
pub fn garbage(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in with(fmu, SERIALIZE, findings) {
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
            let place = format!("fmi2DeSerializeFMUstate with {what} ({})", interface.name());
            let mut session = fmu.running(interface)?;
            session.advance(3)?;
            let before = session.readings()?;
            fmu.doing(&place);
            let accepted = match session.instance.deserialize(&bytes) {
                Err(_) => false,
                Ok(state) => {
                    let set = session.instance.set_state(&state).is_ok();
                    let _ = session.instance.free_state(state);
                    set
                }
            };
            if accepted {
                findings.add(place, "it is accepted (allowed: fmi2Error)");
                break;
            }
            // After an error it may refuse to be read.
            if let Ok(after) = session.readings()
                && let Some(text) = session.difference(&after, &before)
            {
                findings.add(place, format!("it is refused, but {text}"));
            }
        }
        let mut session = fmu.running(interface)?;
        fmu.doing("fmi2SetFMUstate(NULL)");
        if session.instance.set_state_null().is_ok() {
            findings.add(fmu.now(), "it is accepted (allowed: fmi2Error)");
        }
    }
    Ok(())
}

/// `states.modes`
pub fn modes(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    for interface in with(fmu, SAVE, findings) {
        for stage in [Stage::Instantiated, Stage::Initialization, Stage::Terminated] {
            let mut session = fmu.session_in(interface, stage)?;
            let mode = stage.name();
            let place =
                format!("fmi2GetFMUstate and fmi2SetFMUstate, {mode} ({})", interface.name());
            fmu.doing(&place);
            let done = session.instance.get_state().and_then(|state| {
                let set = session.instance.set_state(&state);
                session.instance.free_state(state).and(set)
            });
            if let Err(error) = done {
                findings.add(place, error.to_string());
            }
        }
    }
    Ok(())
}
