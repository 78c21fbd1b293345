//! Notices that a drive was mounted or unmounted.
//!
//! A drive that is mounted over a folder hides it, and no event of the folder says so. Linux reports each
//! change of the table of mounts to whoever waits for it; on other systems the next look finds the other
//! folder.

use std::sync::mpsc::Sender;

use super::listener::WatchMessage;

/// Sends [`WatchMessage::MountsChanged`] as long as it lives.
#[cfg(target_os = "linux")]
pub(super) struct MountListener {
    /// Closed when the listener is dropped, which ends its thread.
    _alive: std::io::PipeWriter,
}

#[cfg(target_os = "linux")]
impl MountListener {
    /// `None` if the system does not allow it.
    pub(super) fn new(sender: Sender<WatchMessage>) -> Option<Self> {
        use rustix::event::{PollFd, PollFlags, poll};
        let table = std::fs::File::open("/proc/self/mountinfo").ok()?;
        let (ended, alive) = std::io::pipe().ok()?;
        let wait = move || {
            loop {
                let mut waited = [
                    // A change is reported as an urgent condition and an error.
                    PollFd::new(&table, PollFlags::PRI | PollFlags::ERR),
                    PollFd::new(&ended, PollFlags::IN),
                ];
                match poll(&mut waited, None) {
                    Err(rustix::io::Errno::INTR) => continue,
                    Err(_) => return,
                    Ok(_) => {}
                }
                let [table, ended] = &waited;
                if !ended.revents().is_empty()
                    || (!table.revents().is_empty() && sender.send(WatchMessage::MountsChanged).is_err())
                {
                    return;
                }
            }
        };
        std::thread::Builder::new().name("specula mounts".into()).spawn(wait).ok()?;
        Some(Self { _alive: alive })
    }
}

/// A listener that sends nothing, because the system does not report mounts.
#[cfg(not(target_os = "linux"))]
pub(super) struct MountListener;

#[cfg(not(target_os = "linux"))]
impl MountListener {
    pub(super) fn new(_: Sender<WatchMessage>) -> Option<Self> {
        None
    }
}
