//! Memory that an FMU takes and does not give back (FMI 2.0.5, sections 2.1.5 and 2.1.8).
//!
//! The same calls are made over and over. What is kept for the next time is taken in the first
//! window; where each window after it takes more, the memory is lost. The system tells how much the
//! process can write to (VmData), in portions of some 130 kB.

use std::time::{Duration, Instant};

use anyhow::Result;

use super::findings::Findings;
use super::under_test::{FmuUnderTest, Interface, Life, UnderTest};

/// Calls of a window.
const MOST: usize = 500;
/// Time for the first window; the others have as many calls.
const LONGEST: Duration = Duration::from_millis(500);
/// Calls in a window, enough for a result.
const FEWEST: usize = 10;
/// Windows that must take memory, each, after the first.
const WINDOWS: usize = 3;
/// Growth of memory that is a finding, bytes a step: an FMU may keep a short history.
const PER_STEP: u64 = 1024;

/// Bytes of memory that this process can write to; none where the system does not tell.
fn data() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmData:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kilobytes)
}

/// Bytes that are lost with each of the calls, if every window takes some.
fn lost(mut call: impl FnMut() -> Result<()>) -> Result<Option<u64>> {
    let started = Instant::now();
    let mut count = 0;
    while count < MOST && (count == 0 || started.elapsed() < LONGEST) {
        call()?;
        count += 1;
    }
    if count < FEWEST {
        return Ok(None);
    }
    let mut taken = 0;
    for _ in 0..WINDOWS {
        let before = data();
        for _ in 0..count {
            call()?;
        }
        let grown = before.zip(data()).map_or(0, |(before, after)| after.saturating_sub(before));
        if grown == 0 {
            return Ok(None);
        }
        taken += grown;
    }
    Ok(Some(taken / (WINDOWS * count) as u64))
}

/// `host.memory`
pub fn memory(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    if data().is_none() {
        findings.skip("this system does not tell how much memory a process has");
        return Ok(());
    }
    for interface in fmu.interfaces() {
        look(fmu, interface, findings)?;
    }
    Ok(())
}

fn look(fmu: &FmuUnderTest, interface: Interface, findings: &mut Findings) -> Result<()> {
    let name = FmuUnderTest::name(interface);
    let mut session = fmu.running(interface)?;
    let step = || -> Result<()> {
        session.advance(1)?;
        session.instance.take_messages();
        Ok(())
    };
    if let Some(bytes) = lost(step)?
        && bytes >= PER_STEP
    {
        findings.add(
            format!("steps ({name})"),
            format!(
                "the process grows by {bytes} bytes with each (allowed: {PER_STEP}, for a history)"
            ),
        );
    }
    if fmu.can(interface, "canGetAndSetFMUstate") {
        let state = || -> Result<()> {
            let state = session.instance.get_state()?;
            Ok(session.instance.free_state(state)?)
        };
        fmu.doing("fmi2GetFMUstate and fmi2FreeFMUstate");
        if let Some(bytes) = lost(state)? {
            findings.add(
                format!("fmi2FreeFMUstate ({name})"),
                format!("{bytes} bytes stay behind with each state (allowed: none)"),
            );
        }
    }
    drop(session);
    if fmu.can(interface, "canBeInstantiatedOnlyOncePerProcess") {
        return Ok(());
    }
    // a life as the standard has it: some free part of their memory in fmi2Terminate
    let instance = || -> Result<()> {
        let mut session = fmu.running(interface)?;
        session.advance(2)?;
        if !session.is_ended() {
            session.instance.terminate()?;
        }
        Ok(())
    };
    if let Some(bytes) = lost(instance)? {
        findings.add(
            format!("fmi2FreeInstance ({name})"),
            format!("{bytes} bytes stay behind with each instance (allowed: none)"),
        );
    }
    Ok(())
}
