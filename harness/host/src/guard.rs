//! Runs foreign code in a separate process with limits. If an FMU's binary crashes, hangs or exits, only this process
//! ends, and the parent reports the reason.
//!
//! The parent ([`run`]) starts the process in a new process group with a temporary folder, and reads its output up to a
//! limit. If the process takes too long, the parent kills it and all processes that it has started. The child calls
//! [`enter`] first and [`done`] last; without [`done`] it has failed, whatever its exit code is. When the first binary
//! is loaded, the child limits its own memory and files, and reserves stdout and stderr for itself; the output of the
//! binary goes to the parent.
//!
//! The child sends messages over a connection ([`channel`]). Each message begins with a nonce that the child has read before
//! it loads a binary. If a binary writes to the connection, by mistake or to appear successful, the process is killed.
//!
//! On Linux all of this works. On other Unix systems memory is not limited, and processes that leave the group are not
//! found. On Windows only the process itself is killed.
//!
//! The guard protects against faults. It is not a sandbox: a malicious binary shares the memory of the child,
//! where it can find the nonce, and it has the rights of the user.

mod channel;

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{PipeReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, ExitStatus};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, MutexGuard, Once, OnceLock, PoisonError, Weak};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use files::{bug, temporary};

pub const OPTION: &str = "--guarded";
pub const CALL: Duration = Duration::from_secs(8);
/// Default limit of the memory that an FMU may allocate in its process, bytes.
pub const MEMORY: u64 = 320 << 20;
/// Default limit of the size of a file that the process may write, bytes. It is raised for large
/// tables of results.
pub const FILE: u64 = 64 << 20;
/// Number of bytes of the output of a guarded process that are stored, for stdout and for stderr
/// each. Further bytes are only counted.
pub const PRINTED: usize = 64 << 10;

/// Number of bytes that a process may print if its output is stored. Above this limit the process
/// is killed.
pub const FLOOD: u64 = 16 << 20;
/// Number of bytes that a process may print if its output is shown to the user. Above this limit
/// the process is killed.
pub const FLOOD_SHOWN: u64 = 4 << 30;

#[derive(Clone, Debug)]
pub struct Limits {
    pub call: Duration,
    pub total: Option<Duration>,
    /// Limit of the memory that the process may allocate after the first binary is loaded, bytes.
    /// The same limit applies to temporary files and to shared memory.
    pub memory: u64,
    pub file: u64,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    Done(u8),
    Ended(ExitStatus),
    EndlessCall,
    TooLong,
    Flood,
    /// The process was killed because its temporary files or its shared memory exceeded [`Limits::memory`].
    Hoard,
    /// The process was killed because its connection to the parent was closed, or carried bytes
    /// that the FMU's binary and not the program had sent.
    Interfered,
    Panicked(String),
}

#[derive(Debug)]
pub struct Outcome {
    pub cause: Cause,
    /// Output of the process to stdout and to stderr, each up to [`PRINTED`] bytes. With
    /// [`Output::Shown`] the first element contains both.
    pub printed: [Vec<u8>; 2],
}

impl Outcome {
    pub fn last_line(&self) -> Option<String> {
        let all = self.printed.concat();
        let text = String::from_utf8_lossy(&all);
        text.lines().rfind(|line| !line.trim().is_empty()).map(String::from)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Output {
    Kept,
    /// The process writes to the parent's stdout and stderr; the output of the FMU's binary goes to stderr.
    Shown,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

static RUNNING: Mutex<BTreeSet<u32>> = Mutex::new(BTreeSet::new());

/// Runs `program` with `arguments` in a process with limits of time, memory and output, so that a
/// crash or an endless call of an FMU does not stop this program. `program` must call [`enter`].
/// The function returns when this process and all processes that it has started have ended. `hear`
/// receives each answer of the process.
pub fn run<A: AsRef<OsStr>>(
    program: &Path,
    arguments: impl IntoIterator<Item = A>,
    limits: &Limits,
    output: Output,
    hear: impl FnMut(&[u8]),
) -> Result<Outcome> {
    let folder = temporary::Folder::new()?;
    let files = folder.path().join("files");
    std::fs::create_dir(&files)?;
    let (first, first_end) = std::io::pipe()?;
    let (second, second_end) = std::io::pipe()?;
    let mut command = Command::new(program);
    command.args(arguments).env("TMPDIR", &files).env("TEMP", &files).env("TMP", &files);
    let pipe = match output {
        Output::Kept => {
            command.stdout(first_end).stderr(second_end);
            None
        }
        // The child uses this pipe in place of stdout and stderr for the output of the binary.
        Output::Shown => {
            drop(second_end);
            Some(first_end)
        }
    };
    let call = limits.call.as_millis().try_into().unwrap_or(u64::MAX);
    let request = [call, limits.memory, limits.file];
    let (channel, stdin) = channel::open(request, pipe, folder.path())?;
    command.stdin(stdin);
    let mut news = Messages::new(channel, hear);
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let shown = output == Output::Shown;
    let readers = [start_reader(first, shown), start_reader(second, shown)];
    let started = Instant::now();
    let child = {
        // The process is started while the list is locked, so that [`end_all`] always finds it in the list.
        let mut running = lock(&RUNNING);
        let child =
            command.spawn().with_context(|| format!("{} cannot be run", program.display()))?;
        running.insert(child.id());
        child
    };
    drop(command); // with its ends of the pipes
    let flood = if shown { FLOOD_SHOWN } else { FLOOD };
    let floods = || readers.iter().any(|reader| lock(&reader.printed).more > flood);
    let cause = wait_for_end(child, &mut news, started, limits, &files, &floods)?;
    let printed = readers.map(|reader| {
        // A process that was not found, and therefore not killed, may keep the pipe open.
        let _ = reader.end.recv_timeout(Duration::from_millis(500));
        let printed = lock(&reader.printed);
        if shown && printed.more > 0 {
            eprintln!("(the FMU printed {} bytes more)", printed.more);
        }
        printed.kept.clone()
    });
    Ok(Outcome { cause, printed })
}

/// Waits until the process `child` ends, or kills it when it exceeds a limit. `news` receives the
/// messages of the process. Returns the reason why the process ended.
fn wait_for_end(
    mut child: Child,
    news: &mut Messages<impl FnMut(&[u8])>,
    started: Instant,
    limits: &Limits,
    files: &Path,
    floods: &dyn Fn() -> bool,
) -> Result<Cause> {
    // The process sends a sign of life four times a second, unless it is stopped. A longer silence counts as an endless call.
    let silence = limits.call.max(Duration::from_secs(3));
    let (mut done_at, mut closed_at) = (None, None);
    let mut counted_at = started;
    let mut cause = None;
    let mut pause = Duration::from_millis(1);
    while !has_ended(&mut child)? {
        news.read(pause);
        pause = (pause * 2).min(Duration::from_millis(10));
        let now = Instant::now();
        if news.done.is_some() {
            // After this message the process has only to end.
            if now - *done_at.get_or_insert(now) > Duration::from_secs(2) {
                break;
            }
        } else if news.channel.is_forged
            || news.channel.is_closed && now - *closed_at.get_or_insert(now) > CLOSED
        {
            cause = Some(Cause::Interfered);
            break;
        } else if news.is_endless || now - news.heard_at > silence {
            cause = Some(Cause::EndlessCall);
            break;
        } else if limits.total.is_some_and(|total| now - started > total) {
            cause = Some(Cause::TooLong);
            break;
        } else if floods() {
            cause = Some(Cause::Flood);
            break;
        } else if now - counted_at > COUNTING
            && let Some(before) = news.loaded
        {
            counted_at = now;
            let most = limits.memory;
            if disk_usage(files).saturating_sub(before) > most || shared_memory(child.id()) > most {
                cause = Some(Cause::Hoard);
                break;
            }
        }
    }
    let id = child.id();
    end(id, &mut child, files);
    let status = child.wait()?;
    lock(&RUNNING).remove(&id);
    while news.read(Duration::from_millis(1)) {}
    if let Some(code) = news.done {
        return Ok(Cause::Done(code));
    }
    if news.channel.is_forged {
        return Ok(Cause::Interfered);
    }
    let panic = news.panic.take().map(Cause::Panicked);
    Ok(panic.or(cause).unwrap_or(Cause::Ended(status)))
}

/// Longest time that a process may still run after it has closed its connection to the parent.
/// Afterwards the parent kills it.
const CLOSED: Duration = Duration::from_secs(1);

const COUNTING: Duration = Duration::from_millis(50);
const COUNTED: usize = 100_000;

fn disk_usage(folder: &Path) -> u64 {
    let (mut folders, mut bytes, mut entries) = (vec![folder.to_path_buf()], 0, 0);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            entries += 1;
            if entries > COUNTED {
                return u64::MAX;
            }
            // the metadata of a link are its own, and not the metadata of its target
            match entry.metadata() {
                Ok(found) if found.is_dir() => folders.push(entry.path()),
                Ok(found) => bytes += size_on_disk(&found),
                Err(_) => {} // it is gone already
            }
        }
    }
    bytes
}

#[cfg(unix)]
fn size_on_disk(file: &std::fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::blocks(file) * 512
}

#[cfg(not(unix))]
fn size_on_disk(file: &std::fs::Metadata) -> u64 {
    file.len()
}

/// Returns the memory that the process `id` shares with other processes, bytes: the mapped shared
/// memory, or the size of its open files that are in no folder, whichever is larger.
#[cfg(target_os = "linux")]
fn shared_memory(id: u32) -> u64 {
    let process = Path::new("/proc").join(id.to_string());
    let status = std::fs::read_to_string(process.join("status")).unwrap_or_default();
    let mapped = kilobytes(&status, "RssShmem:").unwrap_or(0) << 10;
    let is_hidden = |name: &str| {
        ["/dev/shm/", "/memfd:"].iter().any(|place| name.starts_with(place))
            || name.ends_with(" (deleted)")
    };
    let open = std::fs::read_dir(process.join("fd")).into_iter().flatten().flatten();
    let hidden = open.filter_map(|entry| {
        let name = std::fs::read_link(entry.path()).ok()?;
        let found = is_hidden(name.to_str()?).then(|| std::fs::metadata(entry.path()))?.ok()?;
        Some((identity(&found), size_on_disk(&found)))
    });
    // A file that is open under two descriptors counts once.
    let hidden: std::collections::BTreeMap<_, u64> = hidden.collect();
    mapped.max(hidden.values().sum())
}

#[cfg(target_os = "linux")]
fn identity(file: &std::fs::Metadata) -> (u64, u64) {
    use std::os::unix::fs::MetadataExt;
    (file.dev(), file.ino())
}

#[cfg(not(target_os = "linux"))]
fn shared_memory(_: u32) -> u64 {
    0
}

/// Kills the process `child` with its process group. Processes that have left the group are killed,
/// too: they are recognised by the temporary folder `files` in their environment.
fn end(id: u32, child: &mut Child, files: &Path) {
    kill_group(id);
    let _ = child.kill(); // it may have ended; either is fine
    for _ in 0..10 {
        if !kill_descendants(files) {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Ends all guarded processes when a signal ends this program. The processes have one second to
/// remove incomplete files, and no new process can start.
pub fn end_all() {
    let running = lock(&RUNNING);
    #[cfg(unix)]
    {
        use rustix::process::{Pid, Signal, kill_process};
        let ids = running.iter().filter_map(|id| Pid::from_raw(i32::try_from(*id).ok()?));
        let ids: Vec<Pid> = ids.collect();
        for id in &ids {
            let _ = kill_process(*id, Signal::TERM);
        }
        for _ in 0..100 {
            if ids.iter().all(|id| is_over(*id).unwrap_or(true)) {
                break;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }
    running.iter().for_each(|id| kill_group(*id));
    std::mem::forget(running);
}

#[cfg(unix)]
fn kill_group(id: u32) {
    let id = i32::try_from(id).ok().and_then(rustix::process::Pid::from_raw);
    if let Some(id) = id {
        let _ = rustix::process::kill_process_group(id, rustix::process::Signal::KILL);
    }
}

#[cfg(not(unix))]
fn kill_group(_: u32) {}

/// Returns `true` if the process has ended. The process remains a zombie, so that the system does
/// not give its identifier to another process.
#[cfg(unix)]
fn has_ended(child: &mut Child) -> Result<bool> {
    let id = rustix::process::Pid::from_raw(i32::try_from(child.id())?);
    is_over(id.context("a process without a number")?)
}

#[cfg(unix)]
fn is_over(id: rustix::process::Pid) -> Result<bool> {
    use rustix::process::{WaitId, WaitIdOptions, waitid};
    let options = WaitIdOptions::EXITED | WaitIdOptions::NOWAIT | WaitIdOptions::NOHANG;
    Ok(waitid(WaitId::Pid(id), options)?.is_some())
}

#[cfg(not(unix))]
fn has_ended(child: &mut Child) -> Result<bool> {
    Ok(child.try_wait()?.is_some())
}

/// Kills all processes whose environment variable TMPDIR is the folder `files`. Returns `true` if
/// there was such a process.
#[cfg(target_os = "linux")]
fn kill_descendants(files: &Path) -> bool {
    use rustix::process::{Pid, Signal, kill_process};
    let wanted = format!("TMPDIR={}", files.display());
    let mut any = false;
    for entry in std::fs::read_dir("/proc").into_iter().flatten().flatten() {
        let Some(id) = entry.file_name().to_str().and_then(|name| name.parse().ok()) else {
            continue;
        };
        let environment = std::fs::read(entry.path().join("environ")).unwrap_or_default();
        if environment.split(|byte| *byte == 0).any(|variable| variable == wanted.as_bytes())
            && let Some(id) = Pid::from_raw(id)
        {
            any |= kill_process(id, Signal::KILL).is_ok();
        }
    }
    any
}

#[cfg(not(target_os = "linux"))]
fn kill_descendants(_: &Path) -> bool {
    false
}

struct Messages<F> {
    channel: channel::Parent,
    hear: F,
    heard_at: Instant,
    loaded: Option<u64>,
    is_endless: bool,
    panic: Option<String>,
    done: Option<u8>,
}

// Kinds of messages from the process to its parent.
const ALIVE: u8 = b'.';
const ENDLESS: u8 = b'!';
/// Kind of the message that announces that the process is about to load its first binary. The
/// content is the size of its temporary files at this time, bytes, which does not count towards the
/// limit.
const LOADS: u8 = b'+';
const ANSWER: u8 = b'>';
/// Kind of the message that reports a panic of the program itself. The content is the report for
/// the user.
const PANICS: u8 = b'?';
const CATCHES: u8 = b'-';
/// Kind of the message that reports that the process has done its work. The content is the exit
/// code.
const DONE: u8 = b'=';

impl<F: FnMut(&[u8])> Messages<F> {
    fn new(channel: channel::Parent, hear: F) -> Messages<F> {
        let heard_at = Instant::now();
        let (loaded, panic, done) = (None, None, None);
        Messages { channel, hear, heard_at, loaded, is_endless: false, panic, done }
    }

    /// Waits at most `pause` for messages of the process and handles those that arrive. Returns
    /// `false` if none has arrived.
    fn read(&mut self, pause: Duration) -> bool {
        let text = |content: &[u8]| String::from_utf8_lossy(content).into_owned();
        self.channel.read(pause, |kind, content| {
            self.heard_at = Instant::now();
            match kind {
                ENDLESS => self.is_endless = true,
                LOADS => self.loaded = content.try_into().ok().map(u64::from_le_bytes),
                ANSWER => (self.hear)(content),
                PANICS => drop(self.panic.get_or_insert_with(|| text(content))),
                CATCHES => self.panic = None,
                DONE => self.done = content.first().copied(),
                _ => {} // ALIVE
            }
        })
    }
}

#[derive(Default)]
struct Printed {
    kept: Vec<u8>,
    more: u64,
}

struct Reader {
    printed: Arc<Mutex<Printed>>,
    end: Receiver<()>,
}

/// Starts a thread for `work`. If the system has no resources for a thread at the moment (EAGAIN),
/// the attempt is repeated for up to two seconds.
///
/// # Panics
///
/// If the system still refuses to start a thread.
pub fn spawn(work: impl FnOnce() + Send + 'static) -> JoinHandle<()> {
    let work = Arc::new(Mutex::new(Some(work)));
    let attempt = || {
        let work = work.clone();
        std::thread::Builder::new().spawn(move || {
            let work = lock(&work).take();
            if let Some(work) = work {
                work();
            }
        })
    };
    for _ in 0..40 {
        match attempt() {
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {
                std::thread::sleep(Duration::from_millis(50));
            }
            Err(error) => panic!("a thread could not be started: {error}"),
            Ok(thread) => return thread,
        }
    }
    panic!("a thread could not be started: the system is short of resources");
}

/// Starts a thread that reads `pipe` to its end and stores the beginning. The process that writes
/// to the pipe therefore never has to wait. If `shown` is true, the thread also prints the output.
fn start_reader(mut pipe: PipeReader, shown: bool) -> Reader {
    let (printed, (tell, end)) = (Arc::<Mutex<Printed>>::default(), channel());
    let to = printed.clone();
    spawn(move || {
        let mut buffer = vec![0; 1 << 16];
        while let Ok(read @ 1..) = pipe.read(&mut buffer) {
            let mut to = lock(&to);
            let kept = &buffer[..read.min(PRINTED - to.kept.len())];
            to.kept.extend(kept);
            to.more += (read - kept.len()) as u64;
            if shown {
                let _ = std::io::stderr().write_all(kept);
            }
        }
        let _ = tell.send(());
    });
    Reader { printed, end }
}

// ---------------------------------------------------------------- the child

struct Guarded {
    channel: channel::Process,
    limits: Limits,
    #[cfg(unix)]
    streams: Option<[File; 3]>,
}

static GUARDED: OnceLock<Guarded> = OnceLock::new();

/// Turns this process into the guarded process that [`run`] has started.
///
/// # Errors
///
/// If it was not started by [`run`].
pub fn enter() -> Result<()> {
    let (channel, [call, memory, file], pipe) = channel::Process::take().context(
        "this command is internal: hubslosh starts it to run an FMU in a process of its own",
    )?;
    let limits = Limits { call: Duration::from_millis(call), total: None, memory, file };
    #[cfg(unix)]
    let streams = match pipe {
        Some(pipe) => Some([pipe, copy(std::io::stdout())?, copy(std::io::stderr())?]),
        None => None,
    };
    #[cfg(not(unix))]
    let None::<File> = pipe else {
        bail!("this system cannot pass the pipe to the process that runs the FMU")
    };
    #[cfg(unix)]
    restrict(rustix::process::Resource::Core, 0);
    let guarded = Guarded {
        channel,
        limits,
        #[cfg(unix)]
        streams,
    };
    #[cfg(target_os = "linux")]
    rustix::process::set_parent_process_death_signal(Some(rustix::process::Signal::KILL))?;
    if GUARDED.set(guarded).is_err() {
        bail!("the FMU is in a guarded process already");
    }
    bug::set_listener(bug::Listener {
        panics: |report| send(PANICS, report.as_bytes()),
        catches: || send(CATCHES, &[]),
    });
    spawn(send_signs_of_life);
    Ok(())
}

#[cfg(unix)]
fn copy(stream: impl std::os::fd::AsFd) -> std::io::Result<File> {
    Ok(stream.as_fd().try_clone_to_owned()?.into())
}

fn send(kind: u8, content: &[u8]) {
    if let Some(guarded) = GUARDED.get() {
        guarded.channel.send(kind, content);
    }
}

/// Sends an answer from a guarded process to the parent, where the closure `hear` of [`run`]
/// receives it.
pub fn send_answer(content: &[u8]) {
    send(ANSWER, content);
}

/// Tells the parent that this guarded process has done its work and ends with the exit code `code`.
/// If this process is not guarded, nothing is sent.
pub fn done(code: u8) {
    send(DONE, &[code]);
}

/// Reports a panic of our own code to the parent, so that it is not taken for a crash of the FMU.
/// `report` is the text for the user. Returns `false` if this process is not guarded.
pub fn panics(report: &str) -> bool {
    send(PANICS, report.as_bytes());
    GUARDED.get().is_some()
}

/// Returns the original stdout and stderr of a guarded process. The usual file descriptors lead to
/// a pipe, so that output of the FMU's binary does not mix with results. The result is `None` if
/// this process is not guarded.
pub fn streams() -> Option<(&'static File, &'static File)> {
    #[cfg(unix)]
    if let Some([_, stdout, stderr]) = GUARDED.get().and_then(|guarded| guarded.streams.as_ref()) {
        return Some((stdout, stderr));
    }
    None
}

/// Sends a sign of life to the parent four times a second. It stops when a call of the FMU takes
/// longer than its limit; the parent then kills this process.
fn send_signs_of_life() {
    let Some(guarded) = GUARDED.get() else { return };
    let mut seen: Vec<(Weak<AtomicU64>, u64, Instant)> = Vec::new();
    loop {
        let now = Instant::now();
        let known = std::mem::take(&mut seen);
        for calls in lock(&CALLS).iter() {
            let Some(count) = calls.upgrade().map(|calls| calls.load(Ordering::Relaxed)) else {
                continue;
            };
            let before = known.iter().find(|(k, n, _)| k.ptr_eq(calls) && *n == count);
            let since = before.map_or(now, |(.., since)| *since);
            if count % 2 == 1 && now - since > guarded.limits.call {
                return send(ENDLESS, &[]);
            }
            seen.push((calls.clone(), count, since));
        }
        send(ALIVE, &[]);
        std::thread::sleep(Duration::from_millis(250));
    }
}

/// Call counters of all users of a loaded binary. A counter is odd during a call, so that the
/// parent can detect a call that does not return.
static CALLS: Mutex<Vec<Weak<AtomicU64>>> = Mutex::new(Vec::new());

/// Counter of the calls of one user of a binary. It is incremented at the beginning and at the end
/// of each call.
#[derive(Debug)]
pub(crate) struct Calls(Arc<AtomicU64>);

impl Calls {
    pub(crate) fn new() -> Calls {
        let calls = Calls(Arc::default());
        if GUARDED.get().is_some() {
            let mut all = lock(&CALLS);
            all.retain(|calls| calls.strong_count() > 0);
            all.push(Arc::downgrade(&calls.0));
        }
        calls
    }

    /// Marks the beginning of a call of a loaded binary, so that the parent can detect a call that
    /// does not return. The call ends when the returned value is dropped.
    pub(crate) fn one() -> Calls {
        let calls = Calls::new();
        calls.begin();
        calls
    }

    pub(crate) fn begin(&self) {
        self.0.store((self.0.load(Ordering::Relaxed) + 1) | 1, Ordering::Relaxed);
    }

    pub(crate) fn end(&self) {
        self.0.store((self.0.load(Ordering::Relaxed) | 1) + 1, Ordering::Relaxed);
    }
}

/// Sets the limits of the process, and redirects stdout and stderr of the binary that is loaded
/// next. In a guarded process only the first call does this; in other processes the function does
/// nothing.
pub(crate) fn before_loading() {
    static ONCE: Once = Once::new();
    let Some(guarded) = GUARDED.get() else { return };
    ONCE.call_once(|| {
        send(LOADS, &disk_usage(&std::env::temp_dir()).to_le_bytes());
        #[cfg(target_os = "linux")]
        {
            use rustix::process::Resource;
            let memory = guarded.limits.memory;
            restrict(Resource::Data, memory_in_use("VmData:").saturating_add(memory));
            // Shared memory does not count as data of the process. Each thread reserves more memory than it uses.
            let threads = std::thread::available_parallelism().map_or(1, usize::from) as u64;
            let reserved = (1 << 30) + (threads << 27);
            restrict(Resource::As, memory_in_use("VmSize:").saturating_add(memory + reserved));
        }
        #[cfg(unix)]
        {
            restrict(rustix::process::Resource::Fsize, guarded.limits.file);
            if let Some([pipe, ..]) = &guarded.streams {
                let _ = std::io::stdout().flush();
                let _ = rustix::stdio::dup2_stdout(pipe);
                let _ = rustix::stdio::dup2_stderr(pipe);
            }
        }
        #[cfg(not(unix))]
        let _ = guarded;
    });
}

/// Raises the limits of memory and file size of a guarded process by `bytes`, because the program's
/// own tables of results need memory in addition to the FMU.
pub fn allow(bytes: u64) {
    before_loading();
    #[cfg(target_os = "linux")]
    for resource in [rustix::process::Resource::Data, rustix::process::Resource::As] {
        extend(resource, bytes);
    }
    #[cfg(unix)]
    extend(rustix::process::Resource::Fsize, bytes);
    #[cfg(not(unix))]
    let _ = bytes;
}

/// Lowers the soft limit of `resource` of this process to `bytes`. The limit with which the process
/// was started is never exceeded.
#[cfg(unix)]
fn restrict(resource: rustix::process::Resource, bytes: u64) {
    let mut limit = rustix::process::getrlimit(resource);
    let mut given = lock(&GIVEN);
    let given = given.entry(resource as u32).or_insert(limit.current);
    limit.current = Some(given.map_or(bytes, |most| most.min(bytes)));
    let _ = rustix::process::setrlimit(resource, limit);
}

#[cfg(unix)]
static GIVEN: Mutex<std::collections::BTreeMap<u32, Option<u64>>> =
    Mutex::new(std::collections::BTreeMap::new());

#[cfg(unix)]
fn extend(resource: rustix::process::Resource, bytes: u64) {
    if GUARDED.get().is_some()
        && let Some(now) = rustix::process::getrlimit(resource).current
    {
        restrict(resource, now.saturating_add(bytes));
    }
}

#[cfg(target_os = "linux")]
fn memory_in_use(kind: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    kilobytes(&status, kind).unwrap_or(1 << 20) << 10
}

#[cfg(target_os = "linux")]
fn kilobytes(status: &str, kind: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix(kind))?;
    line.trim().strip_suffix("kB")?.trim().parse().ok()
}
