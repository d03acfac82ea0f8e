//! Rule about memory leaks (FMI 2.0.5, sections 2.1.5 and 2.1.8).
//!
//! The same calls are repeated in windows of equal length. Memory that is allocated once and used again is allocated in
//! the first window. If each of the following windows needs more memory, the FMU leaks. The operating system reports
//! the writable memory (VmData) in units of about 130 kB.

use std::time::{Duration, Instant};

use anyhow::Result;

use super::findings::Findings;
use super::under_test::{FmuUnderTest, Interface, skip};

const MOST: usize = 500;
/// Time limit of the first window of calls. All further windows have as many calls as were made within this time.
const LONGEST: Duration = Duration::from_millis(500);
/// Smallest number of calls in a window from which a leak can be concluded.
const FEWEST: usize = 10;
/// Number of windows after the first one, each of which must need more memory.
const WINDOWS: usize = 3;
/// Growth of the memory, in bytes per step, above which the rule reports a leak. Less growth is allowed, because an
/// FMU may store a short history.
const PER_STEP: u64 = 1024;

fn writable_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmData:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kilobytes)
}

/// Makes the same call several hundred times, and returns the average growth of the memory per call, bytes. The calls
/// are divided into windows of equally many calls. Returns `None` if the memory does not grow in one of the windows,
/// or if the calls take too long to decide.
fn leak_per_call(mut call: impl FnMut() -> Result<()>) -> Result<Option<u64>> {
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
        let before = writable_memory();
        for _ in 0..count {
            call()?;
        }
        let grown =
            before.zip(writable_memory()).map_or(0, |(before, after)| after.saturating_sub(before));
        if grown == 0 {
            return Ok(None);
        }
        taken += grown;
    }
    Ok(Some(taken / (WINDOWS * count) as u64))
}

pub fn memory(fmu: &FmuUnderTest, findings: &mut Findings) -> Result<()> {
    if writable_memory().is_none() {
        return skip("the operating system does not report how much memory a process uses");
    }
    for interface in fmu.interfaces() {
        measure_leaks(fmu, interface, findings)?;
    }
    Ok(())
}

fn measure_leaks(fmu: &FmuUnderTest, interface: Interface, findings: &mut Findings) -> Result<()> {
    let name = interface;
    let mut session = fmu.running(interface)?;
    let step = || -> Result<()> {
        session.advance(1)?;
        session.instance.take_messages();
        Ok(())
    };
    if let Some(bytes) = leak_per_call(step)?
        && bytes >= PER_STEP
    {
        findings.at(format!("steps ({name})")).add(format!(
            "the memory of the process grows by {bytes} bytes in each step (allowed: {PER_STEP} bytes, for a history)"
        ));
    }
    if fmu.has_capability(interface, "canGetAndSetFMUstate") {
        let state = || -> Result<()> {
            let state = session.instance.get_state()?;
            Ok(session.instance.free_state(state)?)
        };
        fmu.announce("fmi2GetFMUstate and fmi2FreeFMUstate");
        if let Some(bytes) = leak_per_call(state)? {
            findings
                .at(format!("fmi2FreeFMUstate ({name})"))
                .add(format!("{bytes} bytes are not freed with each saved state (allowed: 0)"));
        }
    }
    drop(session);
    if fmu.has_capability(interface, "canBeInstantiatedOnlyOncePerProcess") {
        return Ok(());
    }
    // The instance is terminated as the standard prescribes, because some FMUs free part of their memory in
    // fmi2Terminate.
    let instance = || -> Result<()> {
        let mut session = fmu.running(interface)?;
        session.advance(2)?;
        if !session.is_ended() {
            session.instance.terminate()?;
        }
        Ok(())
    };
    if let Some(bytes) = leak_per_call(instance)? {
        findings
            .at(format!("fmi2FreeInstance ({name})"))
            .add(format!("{bytes} bytes are not freed with each instance (allowed: 0)"));
    }
    Ok(())
}
