//! Connection between a guarded process and its parent.
//!
//! The parent sends one request with a random nonce before it starts the process. The process keeps the nonce
//! in its memory and begins each message with it. After bytes that do not begin with the nonce the parent
//! accepts nothing more.
//!
//! On Unix the connection is a pair of sockets, one of which is the child's stdin. A socket cannot be opened through
//! /proc, so that no other process can read the messages. On Windows the standard library cannot pass a socket to a
//! child, so that the connection is a file, which a binary in the process could read.

use std::fs::File;
use std::hash::{BuildHasher, RandomState};
use std::io::{PipeWriter, Read, Write};
#[cfg(unix)]
use std::os::{fd::OwnedFd, unix::net::UnixStream};
use std::path::Path;
use std::process::Stdio;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use anyhow::Result;

const NONCE: usize = 16;
const HEAD: usize = NONCE + 1 + 4;

#[cfg(unix)]
type End = UnixStream;
#[cfg(not(unix))]
type End = File;

pub struct Parent {
    end: End,
    nonce: [u8; NONCE],
    bytes: Vec<u8>,
    /// True if the connection carried bytes that do not begin with the nonce of this connection, so
    /// that something other than our own code has written to it.
    pub is_forged: bool,
    pub is_closed: bool,
}

pub struct Process {
    end: Mutex<End>,
    nonce: [u8; NONCE],
}

pub const REQUEST: usize = 3;
const REQUEST_BYTES: usize = NONCE + 8 * REQUEST;

/// Returns random bytes with which every message of our own code begins, so that bytes from an
/// FMU's binary are recognised. They come from the hashers of the standard library's maps, which
/// are seeded with random numbers of the system.
fn nonce() -> [u8; NONCE] {
    let half = || u128::from(RandomState::new().hash_one(0));
    (half() << 64 | half()).to_ne_bytes()
}

/// Creates a connection between this program and a process to be started, with `request` already
/// waiting in it. The process receives `pipe` for its output. Returns the parent's end, and the
/// stdin to give to the process.
#[cfg(unix)]
pub fn open(
    request: [u64; REQUEST],
    pipe: Option<PipeWriter>,
    _: &Path,
) -> Result<(Parent, Stdio)> {
    use std::io::IoSlice;
    use std::os::fd::AsFd;

    use rustix::net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags, sendmsg};

    let (end, stdin) = UnixStream::pair()?;
    let parent = Parent::new(end);
    let mut space = [std::mem::MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut attached = SendAncillaryBuffer::new(&mut space);
    let pipe = pipe.as_ref().map(|pipe| [pipe.as_fd()]);
    if let Some(pipe) = &pipe {
        attached.push(SendAncillaryMessage::ScmRights(pipe));
    }
    let request = parent.request(request);
    sendmsg(&parent.end, &[IoSlice::new(&request)], &mut attached, SendFlags::empty())?;
    Ok((parent, OwnedFd::from(stdin).into()))
}

/// Creates a connection between this program and a process to be started, with `request` already
/// waiting in it. The connection is a file in `folder`. Returns the parent's end, and the stdin to
/// give to the process.
#[cfg(not(unix))]
pub fn open(
    request: [u64; REQUEST],
    _: Option<PipeWriter>,
    folder: &Path,
) -> Result<(Parent, Stdio)> {
    use std::io::{Seek, SeekFrom};

    let path = folder.join("connection");
    let mut stdin = File::options().read(true).write(true).create_new(true).open(&path)?;
    let mut parent = Parent::new(File::open(path)?);
    stdin.write_all(&parent.request(request))?;
    stdin.rewind()?;
    parent.end.seek(SeekFrom::Start(REQUEST_BYTES as u64))?;
    Ok((parent, stdin.into()))
}

impl Parent {
    fn new(end: End) -> Parent {
        Parent { end, nonce: nonce(), bytes: Vec::new(), is_forged: false, is_closed: false }
    }

    fn request(&self, numbers: [u64; REQUEST]) -> Vec<u8> {
        [&self.nonce[..], &numbers.map(u64::to_le_bytes).concat()].concat()
    }

    /// Waits at most `pause` for messages of the process, and passes kind and content of each
    /// message to `hear`. Returns `false` if no message has arrived.
    pub fn read(&mut self, pause: Duration, mut hear: impl FnMut(u8, &[u8])) -> bool {
        #[cfg(unix)]
        let _ = self.end.set_read_timeout(Some(pause));
        let mut buffer = [0; 1 << 14];
        let read = match self.end.read(&mut buffer) {
            Ok(read) => read,
            Err(_) => return false, // nothing has arrived in time
        };
        if read == 0 {
            self.is_closed = cfg!(unix);
            std::thread::sleep(pause);
        }
        if !self.is_forged {
            self.bytes.extend(&buffer[..read]);
            self.take(&mut hear);
        }
        read > 0
    }

    fn take(&mut self, hear: &mut dyn FnMut(u8, &[u8])) {
        let mut rest = &self.bytes[..];
        loop {
            let begun = rest.len().min(NONCE);
            self.is_forged = rest[..begun] != self.nonce[..begun];
            let Some((head, content)) = rest.split_at_checked(HEAD).filter(|_| !self.is_forged)
            else {
                break;
            };
            let length = [0, 1, 2, 3].map(|k| head[NONCE + 1 + k]);
            let length = u32::from_le_bytes(length) as usize;
            let Some((content, next)) = content.split_at_checked(length) else { break };
            hear(head[NONCE], content);
            rest = next;
        }
        let taken = self.bytes.len() - rest.len();
        self.bytes.drain(..taken);
    }
}

impl Process {
    /// Takes the connection to the parent from stdin, and replaces stdin by an empty file, so that
    /// an FMU cannot read the connection. Returns the connection, the request of the parent, and
    /// the pipe for the output.
    #[cfg(unix)]
    pub fn take() -> Result<(Process, [u64; REQUEST], Option<File>)> {
        use std::io::IoSliceMut;
        use std::os::fd::AsFd;

        use rustix::net::{RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, recvmsg};

        let end = UnixStream::from(std::io::stdin().as_fd().try_clone_to_owned()?);
        let mut request = [0; REQUEST_BYTES];
        let mut space = [std::mem::MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
        let mut attached = RecvAncillaryBuffer::new(&mut space);
        let mut into = [IoSliceMut::new(&mut request)];
        let read = recvmsg(&end, &mut into, &mut attached, RecvFlags::empty())?.bytes;
        anyhow::ensure!(
            read == REQUEST_BYTES,
            "the request to the process that runs the FMU is incomplete"
        );
        rustix::stdio::dup2_stdin(File::open("/dev/null")?)?;
        let mut pipe = None;
        for message in attached.drain() {
            if let RecvAncillaryMessage::ScmRights(files) = message {
                // Programs that this process starts do not inherit the duplicated handle.
                pipe = files.last().map(|file| file.try_clone()).transpose()?.map(File::from);
            }
        }
        let (process, numbers) = Process::new(end, &request);
        Ok((process, numbers, pipe))
    }

    /// Takes over the connection from stdin. Returns the connection, the request of the parent, and
    /// `None`, because the output of the process needs no pipe on this system.
    #[cfg(not(unix))]
    pub fn take() -> Result<(Process, [u64; REQUEST], Option<File>)> {
        use std::os::windows::io::AsHandle;

        let mut end = File::from(std::io::stdin().as_handle().try_clone_to_owned()?);
        let mut request = [0; REQUEST_BYTES];
        end.read_exact(&mut request)?;
        let (process, numbers) = Process::new(end, &request);
        Ok((process, numbers, None))
    }

    fn new(end: End, request: &[u8; REQUEST_BYTES]) -> (Process, [u64; REQUEST]) {
        let number = |k| u64::from_le_bytes(std::array::from_fn(|i| request[NONCE + 8 * k + i]));
        let nonce = std::array::from_fn(|i| request[i]);
        (Process { end: Mutex::new(end), nonce }, std::array::from_fn(number))
    }

    pub fn send(&self, kind: u8, content: &[u8]) {
        let length = (content.len() as u32).to_le_bytes();
        let message = [&self.nonce, &[kind][..], &length, content].concat();
        let mut end = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        let _ = end.write_all(&message);
    }
}
