//! Catches panics of this program where a command ends, and reports them as bugs, with the files that the command has read.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::thread::{self, ThreadId};

use crate::input;

static PANICS: Mutex<Vec<(ThreadId, String)>> = Mutex::new(Vec::new());

/// Functions that are called when this process panics.
///
/// - `panics`: is called with the report before the stack is unwound. A later call could be too
///   late, because a panic inside a function that C calls ends the process.
/// - `catches`: is called when [`catch_panic`] has caught the panic.
pub struct Listener {
    pub panics: fn(&str),
    pub catches: fn(),
}

static LISTENER: OnceLock<Listener> = OnceLock::new();

pub fn set_listener(listener: Listener) {
    let _ = LISTENER.set(listener);
}

/// Makes this process store the messages of its panics instead of printing them. [`catch_panic`]
/// returns the stored messages.
pub fn keep_panics() {
    std::panic::set_hook(Box::new(|panic| {
        let place = panic.location().map(|at| format!(" ({}:{})", at.file(), at.line()));
        let text = format!("{}{}", message(panic.payload()), place.unwrap_or_default());
        let mut all = PANICS.lock().unwrap_or_else(PoisonError::into_inner);
        all.push((thread::current().id(), text.clone()));
        drop(all);
        if let Some(listener) = LISTENER.get() {
            (listener.panics)(&report(&text));
        }
    }));
}

fn message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| text.to_string());
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or("a panic".into())
}

#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Panicked(pub String);

/// Runs `work` and returns its result, or the message of its panic if it panics. If several threads
/// panic, the message of the first panic is returned, because a panic of a thread also makes the
/// thread that waits for it panic.
pub fn catch_panic<T>(work: impl FnOnce() -> T) -> Result<T, Panicked> {
    let before = PANICS.lock().unwrap_or_else(PoisonError::into_inner).len();
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
        if let Some(listener) = LISTENER.get() {
            (listener.catches)();
        }
        let mut all = PANICS.lock().unwrap_or_else(PoisonError::into_inner);
        let text = message(&*payload);
        let own = all.iter().position(|(id, _)| *id == thread::current().id());
        let at = match text.contains("scoped thread panicked") {
            true => Some(before.min(all.len().saturating_sub(1))),
            false => all.iter().position(|(_, kept)| kept.starts_with(&text)).or(own),
        };
        Panicked(match at.filter(|at| *at < all.len()) {
            Some(at) => all.remove(at).1,
            None => text,
        })
    })
}

/// Formats the message of a panic for the user: the panic itself, the files that this process has
/// read so far, and the request to report the panic as a bug.
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
