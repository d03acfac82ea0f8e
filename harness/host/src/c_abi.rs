//! The C interface as a host sees it in any version of FMI: status, messages, loading of libraries, and the process
//! state that an FMU shares with its host.
#![allow(unsafe_code)]

use std::cell::Cell;
use std::collections::BTreeMap;
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::path::{Path, PathBuf};
use std::ptr::null;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use anyhow::{Context, Result, anyhow, bail};
use files::output::sha256;
use libloading::Library;

use crate::guard::{self, Calls};
use crate::symbol::readable;

pub mod version;

/// Status that a call of the FMU returned.
///
/// - `Discard`: the FMU has refused the step, because it cannot compute it.
/// - `Pending`: the step continues in the background, which only FMI 2.0 allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    Ok,
    Warning,
    Discard,
    Error,
    Fatal,
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

#[derive(Default)]
struct Sink {
    messages: Mutex<Vec<Message>>,
    uncategorised: AtomicUsize,
}

/// Receivers of the messages of all existing instances. The key is the environment pointer that the
/// host gave to the FMU and that the FMU passes back in each callback.
///
/// An FMU may pass a wrong pointer. Therefore callbacks only look the pointer up in this map, and
/// never dereference it.
static SINKS: Mutex<BTreeMap<usize, Arc<Sink>>> = Mutex::new(BTreeMap::new());

static FOREIGN: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    static CALLED: Cell<usize> = const { Cell::new(0) };
}

fn sinks() -> MutexGuard<'static, BTreeMap<usize, Arc<Sink>>> {
    SINKS.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Returns the number of callbacks in which an FMU of this process passed a pointer other than the
/// componentEnvironment (FMI 3.0: instanceEnvironment) of an existing instance. `hubslosh check`
/// reports such FMUs.
pub fn foreign_environments() -> usize {
    FOREIGN.load(Ordering::Relaxed)
}

pub(crate) fn count_foreign_environment() {
    FOREIGN.fetch_add(1, Ordering::Relaxed);
}

/// Receiver of the log messages of one instance. Its address is the environment pointer that the
/// FMU passes to the callbacks. It must be dropped after the instance is freed, because an FMU may
/// still log while it is freed.
pub(crate) struct Environment {
    sink: Arc<Sink>,
}

impl Environment {
    pub(crate) fn new() -> Environment {
        let environment = Environment { sink: Arc::default() };
        sinks().insert(environment.address(), environment.sink.clone());
        environment
    }

    fn address(&self) -> usize {
        Arc::as_ptr(&self.sink) as usize
    }

    pub(crate) fn pointer(&self) -> *mut c_void {
        Arc::as_ptr(&self.sink).cast_mut().cast()
    }

    /// Records that a call of the instance begins on this thread, so that messages with a wrong
    /// environment pointer can be assigned to this instance.
    pub(crate) fn begin_call(&self) {
        CALLED.set(self.address());
    }

    pub(crate) fn take(&self) -> Vec<Message> {
        std::mem::take(&mut *self.sink.lock())
    }

    pub(crate) fn uncategorised(&self) -> usize {
        self.sink.uncategorised.load(Ordering::Relaxed)
    }
}

impl Drop for Environment {
    fn drop(&mut self) {
        sinks().remove(&self.address());
    }
}

impl Sink {
    fn lock(&self) -> MutexGuard<'_, Vec<Message>> {
        self.messages.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

/// Returns the receiver of messages with the pointer `environment`. If no instance has this
/// pointer, the message is assigned to the instance that this thread called last. If there was no
/// call, but exactly one instance exists, the message is assigned to this instance; otherwise the
/// result is `None`.
fn find_sink(environment: *mut c_void) -> Option<Arc<Sink>> {
    let sinks = sinks();
    if let Some(sink) = sinks.get(&(environment as usize)) {
        return Some(sink.clone());
    }
    count_foreign_environment();
    let only = || sinks.values().next().filter(|_| sinks.len() == 1);
    sinks.get(&CALLED.get()).or_else(only).cloned()
}

/// Callback `logMessage` of FMI 3.0: stores a message for the instance with this `environment`. If
/// [`MESSAGES_KEPT`] messages are stored already, the message is dropped. For FMI 2.0 the C code in
/// `logger.c` formats the message and then calls this function.
pub(crate) extern "C" fn log_message(
    environment: *mut c_void,
    status: c_int,
    category: *const c_char,
    text: *const c_char,
) {
    let Some(sink) = find_sink(environment) else { return };
    if category.is_null() {
        sink.uncategorised.fetch_add(1, Ordering::Relaxed);
    }
    let mut messages = sink.lock();
    if messages.len() < MESSAGES_KEPT {
        // SAFETY: the FMU, or `logger.c`, passes terminated strings.
        let (category, text) = unsafe { (copy_text(category), copy_text(text)) };
        messages.push(Message { status: status.into(), category, text });
    }
}

/// Copies a C string of an FMU, because the FMU may overwrite it in the next call. A NULL pointer
/// gives an empty text.
///
/// # Safety
///
/// The pointer must be NULL or point to a terminated string.
pub(crate) unsafe fn copy_text(text: *const c_char) -> String {
    match text.is_null() {
        true => String::new(),
        false => unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned(),
    }
}

pub(crate) fn c_string(text: Option<&str>) -> Option<CString> {
    text.map(|text| CString::new(text).unwrap_or_default())
}

/// Returns a pointer to `text` for an argument of a C function, or NULL for `None`. `text` must
/// exist as long as the pointer is used.
pub(crate) fn pointer(text: &Option<CString>) -> *const c_char {
    text.as_ref().map_or(null(), |text| text.as_ptr())
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    pub status: Status,
    pub category: String,
    pub text: String,
}

/// Largest number of messages that are stored for one instance. The limit exists because an FMU
/// that logs in every step would otherwise fill the memory.
const MESSAGES_KEPT: usize = 1000;

unsafe extern "C" {
    fn hubslosh_float_control() -> u32;
    fn hubslosh_locale() -> *const c_char;
    fn hubslosh_signal_handlers() -> u64;
}

#[derive(Clone, Debug)]
pub struct CallError {
    pub call: &'static str,
    pub status: Status,
    pub messages: Vec<Message>,
}

impl CallError {
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
            _ if call.contains("Instantiate") => write!(f, "{call} returned no instance")?,
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

pub type Called<T = ()> = Result<T, CallError>;

#[derive(Clone, Copy)]
pub(crate) struct Function<T> {
    pub name: &'static str,
    pub call: T,
}

/// Declares a struct that holds functions of a loaded FMI library. A line such as `reset
/// "fmi2Reset" "fmi3Reset", Call;` gives a field, the symbol of its function in FMI 2.0 and in FMI
/// 3.0, and the type of the function. `load` fills the struct from a library.
macro_rules! functions {
    ($table:ident $(<$boolean:ident>)?: $($field:ident $($symbol:literal)+, $type:ty;)*) => {
        pub(crate) struct $table $(<$boolean>)? {
            $(pub(crate) $field: $crate::c_abi::Function<$type>,)*
        }

        impl $(<$boolean>)? $table $(<$boolean>)? {
            pub(crate) fn symbols(version: usize) -> Vec<&'static str> {
                vec![$([$($symbol),+][version],)*]
            }

            /// Finds the functions in `library`. `version` selects the symbol of each function if
            /// several are declared: 0 for FMI 2.0, 1 for FMI 3.0.
            ///
            /// # Safety
            ///
            /// The library must be a binary of this version of FMI, because the types of its
            /// functions cannot be checked.
            pub(crate) unsafe fn load(
                library: &libloading::Library,
                version: usize,
            ) -> Result<Self, libloading::Error> {
                Ok($table { $($field: {
                    let name = [$($symbol),+][version];
                    let call = *unsafe { library.get::<$type>(name)? };
                    $crate::c_abi::Function { name, call }
                },)* })
            }
        }
    };
}

pub(crate) use functions;

/// Settings of the process that an FMU shares with its host and must not change, for example the
/// rounding mode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostState {
    pub float_control: u32,
    pub locale: String,
    pub signal_handlers: u64,
    pub directory: Option<PathBuf>,
}

impl HostState {
    pub fn now() -> Self {
        // SAFETY: the three functions have no arguments; the locale's name is a terminated string of the C library.
        unsafe {
            HostState {
                float_control: hubslosh_float_control(),
                locale: CStr::from_ptr(hubslosh_locale()).to_string_lossy().into_owned(),
                signal_handlers: hubslosh_signal_handlers(),
                directory: std::env::current_dir().ok(),
            }
        }
    }

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

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let below = entries.flat_map(|entry| match entry.path() {
        path if path.is_dir() => files_below(&path),
        path => vec![path],
    });
    below.collect()
}

pub(crate) struct Loaded {
    pub library: Library,
    pub hash: String,
    pub changed: Vec<&'static str>,
    pub binary: String,
}

/// Loads the binary with the model identifier `identifier` from the FMU that is unpacked in
/// `directory`. `platform` is the folder in `binaries`, and `name` is the FMU's name in error
/// messages.
///
/// # Errors
///
/// If there is no binary for the platform, or it cannot be loaded; the message states the reason.
pub(crate) fn load(
    directory: &Path,
    name: &Path,
    platform: &str,
    identifier: &str,
) -> Result<Loaded> {
    let name = name.display();
    // The identifier must not be a path, because a library outside the archive would not be part of the FMU.
    if identifier.contains(['/', '\\', ':', '\0']) {
        bail!(
            "the FMU {name} cannot be used: modelIdentifier {identifier:?} leads out of the folder of its \
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
        bail!("{name} has no binary for this platform, {binary} (binaries in the FMU: {there})");
    }
    let bytes =
        std::fs::read(&path).with_context(|| format!("{binary} in {name} cannot be read"))?;
    let hash = sha256(&bytes);
    guard::before_loading();
    let (before, calls) = (HostState::now(), Calls::one());
    // SAFETY: loading runs the initialisers of the library, which is the purpose of opening an FMU.
    let library = unsafe { Library::new(&path) }.map_err(|error| {
        // The cause of the loader's error contains the name of the undefined symbol.
        let error = format!("{:#}", anyhow::Error::new(error));
        let needs = explain_needs(&error);
        anyhow!(with_readable_symbol(&error))
            .context(format!("{binary} in {name} cannot be loaded{needs}"))
    })?;
    drop(calls);
    Ok(Loaded { library, hash, changed: before.changed(), binary })
}

fn with_readable_symbol(error: &str) -> String {
    const UNDEFINED: &str = "undefined symbol: ";
    match error.split_once(UNDEFINED) {
        Some((before, symbol)) => {
            let name = readable(symbol).unwrap_or_else(|| "a mangled one".into());
            format!("{before}{UNDEFINED}{name}")
        }
        None => error.into(),
    }
}

/// Returns an explanation to append to the loader's message `error` if the message shows that the
/// binary needs a host process with a Python interpreter. Otherwise the result is an empty text.
fn explain_needs(error: &str) -> &'static str {
    let symbol = error.split("undefined symbol: ").nth(1).unwrap_or_default();
    match symbol.trim_start_matches('_').starts_with("Py") {
        true => {
            ": it needs a Python host, because it uses a Python interpreter but is not linked to one (allowed: FMUs \
             that load in every host)"
        }
        false => "",
    }
}

pub(crate) fn missing_functions(library: &Library, symbols: &[&'static str]) -> Vec<&'static str> {
    let is_there = |symbol: &&&str| {
        // SAFETY: the symbol is only looked up, not used.
        unsafe { library.get::<*const std::ffi::c_void>(**symbol) }.is_ok()
    };
    symbols.iter().filter(|symbol| !is_there(symbol)).copied().collect()
}
