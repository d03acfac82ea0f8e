//! Panics of our own code: caught where a command ends, and reported as a bug of this program with the files that it had
//! read.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError};
use std::thread::{self, ThreadId};

use crate::{guard, input};

/// Messages of panics, with the thread and the place in the source.
static PANICS: Mutex<Vec<(ThreadId, String)>> = Mutex::new(Vec::new());

/// Has panics kept for [`caught`] in place of printed. The parent of a guarded process hears of a panic at once, because a
/// panic that cannot unwind ends the process.
pub fn keep_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let place = panic.location().map(|at| format!(" ({}:{})", at.file(), at.line()));
        let text = format!("{}{}", message(panic.payload()), place.unwrap_or_default());
        let mut all = PANICS.lock().unwrap_or_else(PoisonError::into_inner);
        all.push((thread::current().id(), text.clone()));
        drop(all);
        guard::panics(&report(&text));
    }));
}

fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| text.to_string());
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or("a panic".into())
}

/// Runs `work`; the message of its panic if it panics. The first panic counts: a panic of a thread makes the thread that
/// waits for it panic too.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    let before = PANICS.lock().unwrap_or_else(PoisonError::into_inner).len();
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
        guard::catches();
        let mut all = PANICS.lock().unwrap_or_else(PoisonError::into_inner);
        let text = message(&*payload);
        let own = all.iter().position(|(id, _)| *id == thread::current().id());
        let at = match text.contains("scoped thread panicked") {
            true => Some(before.min(all.len().saturating_sub(1))),
            false => all.iter().position(|(_, kept)| kept.starts_with(&text)).or(own),
        };
        match at.filter(|at| *at < all.len()) {
            Some(at) => all.remove(at).1,
            None => text,
        }
    })
}

/// Message of a panic for the user.
pub fn report(panic: &str) -> String {
    let read = input::read_so_far();
    let files = match read.is_empty() {
        true => "no file had been read".into(),
        false => format!("files read: {}", read.join(", ")),
    };
    format!(
        "this is a bug of hubslosh {}, neither of the FMU nor of your files: {panic}; {files}. Please report it with this line, \
         the command and these files",
        env!("CARGO_PKG_VERSION")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_a_message_that_blames_this_program() {
        assert_eq!(caught(|| 3), Ok(3));
        let told = caught(|| -> i32 { panic!("row {} is odd", 7) }).unwrap_err();
        assert!(told.starts_with("row 7 is odd"), "{told}");
        let report = report(&told);
        assert!(report.starts_with("this is a bug of hubslosh") && report.contains("row 7 is odd"));
    }

    /// Argument of this program by which a test knows that it is the guarded process. For the test harness it is the name
    /// of a test that is not there.
    const CHILD: &str = "guarded_process";

    /// Runs `work` in a guarded process, which runs the test `name` again, and returns the end of that process.
    fn end_of(name: &str, work: fn()) -> guard::Cause {
        if std::env::args().any(|argument| argument == CHILD) {
            keep_panics();
            guard::enter().unwrap();
            work();
        }
        let name = format!("bug::tests::{name}");
        let call = std::time::Duration::from_secs(60);
        let limits = guard::Limits { call, total: Some(call), memory: 1 << 40, file: 1 << 40 };
        let program = std::env::current_exe().unwrap();
        let arguments = ["--exact", &name, CHILD];
        guard::run(&program, arguments, &limits, guard::Output::Kept, |_| {}).unwrap().cause
    }

    #[test]
    fn a_panic_in_a_guarded_process_is_reported_to_its_parent() {
        let name = "a_panic_in_a_guarded_process_is_reported_to_its_parent";
        let cause = end_of(name, || panic!("row {} is odd", 7));
        let guard::Cause::Panicked(report) = &cause else { panic!("{cause:?}") };
        assert!(report.starts_with("this is a bug of hubslosh"), "{report}");
        assert!(report.contains("row 7 is odd (harness/host/src/bug.rs:"), "{report}");
    }

    #[test]
    fn a_panic_that_aborts_a_guarded_process_is_reported_to_its_parent() {
        extern "C" fn called_by_an_fmu() {
            panic!("row 7 is odd");
        }
        let name = "a_panic_that_aborts_a_guarded_process_is_reported_to_its_parent";
        let cause = end_of(name, || called_by_an_fmu());
        let guard::Cause::Panicked(report) = &cause else { panic!("{cause:?}") };
        assert!(report.contains("row 7 is odd (harness/host/src/bug.rs:"), "{report}");
    }

    #[test]
    fn a_panic_that_was_caught_does_not_explain_a_later_crash() {
        let cause = end_of("a_panic_that_was_caught_does_not_explain_a_later_crash", || {
            caught(|| -> i32 { panic!("a damaged file") }).unwrap_err();
            std::process::abort();
        });
        assert!(matches!(cause, guard::Cause::Ended(_)), "{cause:?}");
    }
}
