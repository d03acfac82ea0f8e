//! C as the host sees it in any version of FMI: status, messages, what an FMU shares with its host, opening its
//! library.
#![allow(unsafe_code)]

use std::ffi::{CStr, c_char, c_int};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use anyhow::{Context, Result, bail};
use libloading::Library;

use crate::guard::{self, Calls};
use crate::output::sha256;

/// `fmi2Status` and `fmi3Status`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// All well.
    Ok,
    /// All well, but look at the message.
    Warning,
    /// The step was not done.
    Discard,
    /// The call failed; the instance lives on.
    Error,
    /// All instances of the FMU are lost.
    Fatal,
    /// The step goes on in the background (FMI 2.0).
    Pending,
}

impl From<c_int> for Status {
    fn from(status: c_int) -> Self {
        match status {
            0 => Status::Ok,
            1 => Status::Warning,
            2 => Status::Discard,
            3 => Status::Error,
            5 => Status::Pending,
            _ => Status::Fatal,
        }
    }
}

/// What the FMU's logger writes to. In FMI 2.0 it is the environment handed to the logger, whose shim in
/// `logger.c` calls `write`.
#[repr(C)]
pub(crate) struct Sink {
    write: extern "C" fn(*mut Sink, c_int, *const c_char, *const c_char),
    messages: Mutex<Vec<Message>>,
}

impl Sink {
    pub(crate) fn new() -> Sink {
        Sink { write, messages: Mutex::default() }
    }

    /// Keeps a message, of the first [`MESSAGES_KEPT`].
    pub(crate) fn keep(&self, message: Message) {
        let mut messages = self.messages.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if messages.len() < MESSAGES_KEPT {
            messages.push(message);
        }
    }

    /// Everything kept since the last time somebody asked.
    pub(crate) fn take(&self) -> Vec<Message> {
        std::mem::take(&mut *self.messages.lock().unwrap_or_else(|poisoned| poisoned.into_inner()))
    }
}

/// One message of the FMU's logger.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// How bad it is.
    pub status: Status,
    /// Log category, as in modelDescription.xml.
    pub category: String,
    /// The text.
    pub text: String,
}

/// Messages kept per instance; a chatty FMU shall not eat the memory.
const MESSAGES_KEPT: usize = 1000;

extern "C" fn write(sink: *mut Sink, status: c_int, category: *const c_char, text: *const c_char) {
    // SAFETY: the shim passes on the environment given to fmi2Instantiate, which the instance
    // keeps alive, and two strings that it terminated itself or got from the FMU.
    let (sink, category, text) =
        unsafe { (&*sink, CStr::from_ptr(category), CStr::from_ptr(text)) };
    sink.keep(Message {
        status: status.into(),
        category: category.to_string_lossy().into_owned(),
        text: text.to_string_lossy().into_owned(),
    });
}

unsafe extern "C" {
    fn hubslosh_float_control() -> u32;
    fn hubslosh_locale() -> *const c_char;
    fn hubslosh_signal_handlers() -> u64;
}

/// A call that did not succeed: which, how, and what the FMU said.
#[derive(Clone, Debug)]
pub struct CallError {
    /// The C function.
    pub call: &'static str,
    /// What it returned (of a function that makes an instance and returns NULL: `Error`).
    pub status: Status,
    /// What the FMU logged during the call.
    pub messages: Vec<Message>,
}

impl CallError {
    /// What the FMU logged, in one line.
    pub fn text(&self) -> String {
        let prefix = format!("{}: ", self.call); // the FMU may name the call as well; once will do
        let text = |m: &Message| m.text.trim().trim_start_matches(&prefix).to_string();
        self.messages.iter().map(text).collect::<Vec<_>>().join("; ")
    }
}

impl std::fmt::Display for CallError {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let (call, status) = (self.call, self.status);
        match call.get(..4) {
            _ if call.contains("Instantiate") => write!(f, "{call} gave no instance")?,
            Some(version) => write!(f, "{call} returned {version}{status:?}")?,
            None => write!(f, "{call} returned {status:?}")?,
        }
        match self.text() {
            text if text.is_empty() => write!(f, " without a message"),
            text => write!(f, ": {text}"),
        }
    }
}

impl std::error::Error for CallError {}

/// Result of a call.
pub type Called<T = ()> = Result<T, CallError>;

/// Declares a table of C functions once: field, symbol, type.
macro_rules! functions {
    ($table:ident: $($field:ident $symbol:literal $type:ty;)*) => {
        pub(crate) struct $table { $($field: $type,)* }

        impl $table {
            /// Names of all the functions.
            pub(crate) const SYMBOLS: &[&str] = &[$($symbol),*];

            /// # Safety
            /// The library must be a binary of that version of FMI: the types are taken on trust.
            pub(crate) unsafe fn load(library: &Library) -> Result<Self, libloading::Error> {
                Ok($table { $($field: *unsafe { library.get::<$type>($symbol)? },)* })
            }
        }
    };
}

pub(crate) use functions;

/// What of this process an FMU shares with its host and must leave as it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostState {
    /// Rounding mode, exception masks and flushing of small numbers.
    pub float_control: u32,
    /// The C library's locale.
    pub locale: String,
    /// A fingerprint of the signal handlers; 0 where there are none.
    pub signal_handlers: u64,
    /// The working directory.
    pub directory: Option<PathBuf>,
}

impl HostState {
    /// As it is now.
    pub fn now() -> Self {
        // SAFETY: the three take nothing; the locale's name is a terminated string of the C
        // library.
        unsafe {
            HostState {
                float_control: hubslosh_float_control(),
                locale: CStr::from_ptr(hubslosh_locale()).to_string_lossy().into_owned(),
                signal_handlers: hubslosh_signal_handlers(),
                directory: std::env::current_dir().ok(),
            }
        }
    }

    /// What is other now.
    pub(crate) fn changed(&self) -> Vec<&'static str> {
        let now = HostState::now();
        let parts = [
            (
                "floating-point control (rounding, flushing, traps)",
                self.float_control == now.float_control,
            ),
            ("locale", self.locale == now.locale),
            ("signal handlers", self.signal_handlers == now.signal_handlers),
            ("working directory", self.directory == now.directory),
        ];
        parts.into_iter().filter(|(_, same)| !same).map(|(part, _)| part).collect()
    }
}

/// All files below a folder; none if it cannot be read.
fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let below = entries.flat_map(|entry| match entry.path() {
        path if path.is_dir() => files_below(&path),
        path => vec![path],
    });
    below.collect()
}

/// The library of an FMU, loaded.
pub(crate) struct Loaded {
    pub library: Library,
    /// SHA-256 of its file, in hexadecimal digits.
    pub hash: String,
    /// What loading it has changed for this whole process.
    pub changed: Vec<&'static str>,
    /// Its path within the FMU.
    pub binary: String,
}

/// Loads the library `identifier` of the FMU that is unpacked in `directory`; errors speak of the FMU as `name`.
pub(crate) fn load(
    directory: &Path,
    name: &Path,
    platform: &str,
    identifier: &str,
) -> Result<Loaded> {
    let name = name.display();
    // a library outside the archive is not the FMU's
    if identifier.contains(['/', '\\', ':', '\0']) {
        bail!(
            "{name} cannot be used: modelIdentifier {identifier:?} leads out of the folder of its \
             binary (allowed: letters, digits, underscores)"
        );
    }
    let binary = format!("binaries/{platform}/{identifier}{}", std::env::consts::DLL_SUFFIX);
    let path = directory.join(&binary);
    if !path.exists() {
        let mut there = files_below(&directory.join("binaries"))
            .iter()
            .filter_map(|file| file.strip_prefix(directory).ok())
            .map(|file| file.display().to_string())
            .collect::<Vec<_>>();
        there.sort();
        let there = if there.is_empty() { "none".into() } else { there.join(", ") };
        bail!("{name} has no binary for this platform, {binary} (binaries in it: {there})");
    }
    let bytes =
        std::fs::read(&path).with_context(|| format!("{binary} in {name} cannot be read"))?;
    let hash = sha256(&bytes);
    guard::before_loading();
    let (before, calls) = (HostState::now(), Calls::one());
    // SAFETY: loading runs the library's initialisers; that is what opening an FMU means.
    let library = unsafe { Library::new(&path) }
        .with_context(|| format!("{binary} in {name} cannot be loaded"))?;
    drop(calls);
    Ok(Loaded { library, hash, changed: before.changed(), binary })
}

/// Of these functions those that a library lacks.
pub(crate) fn lacking(library: &Library, symbols: &[&'static str]) -> Vec<&'static str> {
    let is_there = |symbol: &&&str| {
        // SAFETY: only asked whether the symbol is there.
        unsafe { library.get::<*const std::ffi::c_void>(**symbol) }.is_ok()
    };
    symbols.iter().filter(|symbol| !is_there(symbol)).copied().collect()
}
