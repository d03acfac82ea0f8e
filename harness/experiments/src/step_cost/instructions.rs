//! Instructions of single steps: a process traces its child (ptrace), which stops itself before and after each step, and
//! lets it make one instruction after the other in between. Every Linux has that, unlike counters of the hardware; it
//! takes microseconds per instruction, so that only some steps are counted: the slowest, and some from the middle.

use super::Spread;
#[cfg(target_os = "linux")]
use {super::Course, crate::run::Run, anyhow::Result, host::fmu::Fmu};

/// Steps that are counted around the median.
const MIDDLE: usize = 9;
/// Time after which counting stops, for steps of millions of instructions.
#[cfg(target_os = "linux")]
const TIME: std::time::Duration = std::time::Duration::from_secs(30);

/// The steps whose instructions are wanted, by the times of all: the slowest, among which are those above the percentile
/// by count, and some around the median.
pub struct Chosen {
    slowest: Vec<usize>,
    middle: Vec<usize>,
}

impl Chosen {
    /// Choice by the times of all steps.
    pub fn new(times: &[f64]) -> Chosen {
        let mut order: Vec<usize> = (0..times.len()).collect();
        order.sort_by(|i, j| times[*i].total_cmp(&times[*j]));
        let slow = (2 * (times.len() / 10_000) + 10).min(times.len());
        let around = (times.len() / 2).saturating_sub(MIDDLE / 2);
        Chosen {
            slowest: order[times.len() - slow..].to_vec(),
            middle: order[around..(around + MIDDLE).min(times.len())].to_vec(),
        }
    }

    /// All of them, rising.
    pub fn all(&self) -> Vec<usize> {
        let mut all = [self.slowest.as_slice(), &self.middle].concat();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Spread of the counts of [`Chosen::all`] over `steps` steps in all.
    pub fn spread(&self, counts: &[u64], steps: usize) -> Option<Spread<u64>> {
        let all = self.all();
        let of = |steps: &[usize]| {
            let place = |k: &usize| all.binary_search(k).ok().and_then(|i| counts.get(i)).copied();
            let mut counts: Option<Vec<u64>> = steps.iter().map(place).collect();
            counts.iter_mut().for_each(|counts| counts.sort_unstable());
            counts
        };
        let (slowest, middle) = (of(&self.slowest)?, of(&self.middle)?);
        let rank = (steps / 10_000).min(slowest.len() - 1);
        Some(Spread {
            median: middle[middle.len() / 2],
            p99_99: slowest[slowest.len() - 1 - rank],
            max: *slowest.last()?,
        })
    }
}

/// The child's part: makes the manoeuvre and stops before, in front of and after each of these steps.
///
/// # Errors
/// If the process may not be traced; what the FMU refuses.
#[cfg(target_os = "linux")]
pub fn be_counted(fmu: &Fmu, run: &Run, steps: &[usize]) -> Result<()> {
    use nix::sys::{ptrace, signal};

    let stop = || signal::raise(signal::Signal::SIGSTOP);
    let mut course = Course::new(run, fmu)?;
    // what is done the first time is not counted: symbols are looked up, memory comes
    let last = steps.last().copied().unwrap_or(0);
    ptrace::traceme()?;
    for k in 0..=last {
        course.drive()?;
        if steps.contains(&k) {
            let here = course.instance.get_state()?;
            course.try_step(run.step)?;
            course.instance.set_state(&here)?;
            stop()?;
            stop()?;
            course.try_step(run.step)?;
            stop()?;
            course.instance.set_state(&here)?;
            course.instance.free_state(here)?;
        }
        course.go_on()?;
    }
    Ok(())
}

/// The parent's part: the instructions of each of `steps` that a child counts which calls [`be_counted`].
///
/// # Errors
/// If the machine does not let a process trace its child; if the child does not end well; if it takes longer than
/// half a minute.
#[cfg(target_os = "linux")]
pub fn count(mut child: std::process::Child, steps: usize) -> Result<Vec<u64>> {
    use anyhow::{bail, ensure};
    use nix::sys::signal::Signal;
    use nix::sys::wait::{WaitStatus, waitpid};
    use nix::sys::{ptrace, wait};
    use nix::unistd::Pid;

    let pid = Pid::from_raw(i32::try_from(child.id())?);
    let mut counts = Vec::with_capacity(steps);
    // Stops of this step so far, and instructions since the last.
    let (mut stops, mut made, mut empty) = (0, 0_u64, 0);
    let begun = std::time::Instant::now();
    let done = loop {
        if made.is_multiple_of(1024) && begun.elapsed() > TIME {
            child.kill()?;
            child.wait()?;
            bail!("counting takes longer than {} s", TIME.as_secs());
        }
        match waitpid(pid, Some(wait::WaitPidFlag::empty()))? {
            WaitStatus::Stopped(_, Signal::SIGSTOP) => {
                match stops {
                    1 => empty = made,
                    2 => counts.push(made - std::cmp::min(made, empty)),
                    _ => {}
                }
                if counts.is_empty() {
                    // no process is left behind where this one is ended
                    ptrace::setoptions(pid, ptrace::Options::PTRACE_O_EXITKILL)?;
                }
                (stops, made) = ((stops + 1) % 3, 0);
                if stops == 0 { ptrace::cont(pid, None)? } else { ptrace::step(pid, None)? }
            }
            WaitStatus::Stopped(_, Signal::SIGTRAP) if stops > 0 => {
                made += 1;
                ptrace::step(pid, None)?;
            }
            WaitStatus::Stopped(_, Signal::SIGTRAP) => ptrace::cont(pid, None)?,
            WaitStatus::Stopped(_, other) => ptrace::cont(pid, Some(other))?,
            WaitStatus::Exited(_, code) => break code,
            WaitStatus::Signaled(_, signal, _) => bail!("the process was ended by {signal}"),
            _ => {}
        }
    };
    ensure!(done == 0 && counts.len() == steps, "the traced process did not make the manoeuvre");
    Ok(counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two of 20,000 steps are above the percentile.
    #[test]
    fn the_slowest_and_those_around_the_median_are_counted() {
        let times: Vec<f64> = (0..20_000).map(f64::from).collect();
        let chosen = Chosen::new(&times);
        let all = chosen.all();
        assert_eq!(all.len(), MIDDLE + 14);
        assert!(all.contains(&10_000) && all.contains(&19_999) && !all.contains(&19_000));
        let counts: Vec<u64> = all.iter().map(|k| 100 + *k as u64).collect();
        let spread = chosen.spread(&counts, times.len()).unwrap();
        assert_eq!((spread.median, spread.p99_99, spread.max), (10_100, 20_097, 20_099));
        assert!(chosen.spread(&counts[1..], times.len()).is_none());
        let one = Chosen::new(&[1.0]);
        assert_eq!(one.all(), [0]);
        assert_eq!(one.spread(&[7], 1), Some(Spread { median: 7, p99_99: 7, max: 7 }));
    }
}
