//! Collects changes of the places of a graph: listens or polls, waits until it is quiet, and knows whether
//! events can be relied on.
//!
//! Events are collected here, not by `notify`'s full debouncer, which merges the events of a path and can so
//! lose a change: it reports nothing for a file that is written, renamed over an old one and removed at once.
//! Here nothing is merged. An event is only a hint; contents decide what runs.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use notify::event::{EventKind, ModifyKind, RenameMode};

use super::listener::{FileEvent, Listener, WatchMessage, is_removal};
use super::mounts::MountListener;
use super::places::WatchedPlaces;
use super::poller::Poller;
use super::probe::Probes;
#[cfg(test)]
use super::unfinished::WritePauses;
use super::unfinished::{MOST_QUIET_TIMES, UnfinishedFile, UnfinishedFiles};
use crate::build::{HeardChanges, WatchedChanges, is_temporary};
use crate::event::Event;
use crate::plan::Plan;
use crate::platform;
use crate::platform::{has_other_names, path_text};
use crate::storage::being_written;

/// The quiet time after changes of files that are known to be complete: a program that saves several files
/// does so without a pause.
const SAVING: Duration = Duration::from_millis(2);

/// A longer quiet time than this was asked for on purpose, because of files that belong together.
const ON_PURPOSE: Duration = Duration::from_millis(20);

/// How long no exported file is removed before the removed ones are restored: a program that removes a folder
/// of them would fail if they came back meanwhile.
const REMOVING: Duration = Duration::from_millis(300);

/// Changes that have not been built yet.
#[derive(Debug, Default)]
pub(super) struct Hints {
    /// The changed paths, as the graph spells them, and whether each led to a file or folder before.
    pub(super) paths: BTreeMap<PathBuf, bool>,
    /// The exported files and folders that were removed, as the graph spells them.
    pub(super) removed_outputs: BTreeSet<PathBuf>,
    pub(super) lost: bool,
    /// Whether something may have changed that is not among the paths.
    is_uncertain: bool,
    first: Option<Instant>,
    /// Whether it is not known of some change that it is complete.
    may_go_on: bool,
    /// When the first and the last of the changes could be built.
    ready: Option<(Instant, Instant)>,
}

impl Hints {
    /// Notes that something changed now, and can be built.
    fn add_now(&mut self) {
        let now = Instant::now();
        self.may_go_on = true;
        self.add(now, now, now);
    }

    /// Notes that something changed at a time, could be built since another, and can be built from now on.
    fn add(&mut self, changed: Instant, since: Instant, now: Instant) {
        self.first = Some(self.first.map_or(changed, |first| first.min(changed)));
        let ready = self.ready.unwrap_or((since, now));
        self.ready = Some((ready.0.min(since), ready.1.max(now)));
    }

    /// Removes a path. Returns whether it existed before, when it changed, and since when it could be built.
    fn remove(&mut self, path: &Path) -> Option<(bool, Instant, Instant)> {
        let existed = self.paths.remove(path)?;
        let removed = (existed, self.first?, self.ready?.0);
        if self.paths.is_empty() && self.are_all() {
            *self = Self::default();
        }
        Some(removed)
    }

    /// When the changes are to be built: after a quiet time, which is short if all of them are complete.
    fn due(&self, quiet: Duration) -> Option<Instant> {
        let is_short = !self.may_go_on && quiet <= ON_PURPOSE;
        let quiet = if is_short { quiet.min(SAVING) } else { quiet };
        self.ready.map(|(first, last)| (last + quiet).min(first + quiet * MOST_QUIET_TIMES))
    }

    /// Notes that an exported file was removed. Whoever removes it may be about to remove others.
    fn add_removed_output(&mut self, path: PathBuf) {
        let now = Instant::now();
        self.removed_outputs.insert(path);
        self.add(now, now + REMOVING, now + REMOVING);
    }

    /// Whether nothing else can have changed.
    pub(super) fn are_all(&self) -> bool {
        !self.lost && !self.is_uncertain && self.removed_outputs.is_empty()
    }

    /// The time since the first change.
    pub(super) fn age(&self) -> Duration {
        self.first.map_or(Duration::ZERO, |first| first.elapsed())
    }

    pub(super) fn merge(&mut self, others: Self) {
        for (path, existed) in others.paths {
            self.paths.entry(path).or_insert(existed);
        }
        self.removed_outputs.extend(others.removed_outputs);
        self.lost |= others.lost;
        self.is_uncertain |= others.is_uncertain;
        self.may_go_on |= others.may_go_on;
        self.first = self.first.into_iter().chain(others.first).min();
        self.ready = match (self.ready, others.ready) {
            (Some((a, b)), Some((c, d))) => Some((a.min(c), b.max(d))),
            (own, others) => own.or(others),
        };
    }
}

#[derive(Debug, PartialEq, Eq)]
pub(super) enum Wakeup {
    Hints,
    Timeout,
    Stopped,
}

pub(crate) struct ChangeCollector {
    messages: Receiver<WatchMessage>,
    sender: Sender<WatchMessage>,
    listener: Option<Listener>,
    mounts: Option<MountListener>,
    poller: Option<Poller>,
    /// The time between two polls, if polling becomes necessary.
    fallback: Duration,
    quiet: Duration,
    places: WatchedPlaces,
    probes: Probes,
    /// The roots that have been probed or need no probe.
    probed: BTreeSet<PathBuf>,
    /// Why the collector polls.
    because: Option<String>,
    hints: Hints,
    unfinished: UnfinishedFiles,
    /// The paths of events, in folders that are listened to, that were written to and not closed since.
    open: HashSet<PathBuf>,
    /// Whether a folder or file appeared that a program may have begun to write elsewhere.
    may_have_missed_writers: Arc<AtomicBool>,
    /// The changed paths that have not been built yet.
    pending: HashSet<PathBuf>,
    /// Sends further ones to the running build.
    heard: Option<Sender<PathBuf>>,
    /// The mode that was reported last: whether the collector polls.
    reported_polling: Option<bool>,
}

impl ChangeCollector {
    /// Watches no places yet. Polls if `poll` says how often, otherwise listens.
    pub(crate) fn new(quiet: Duration, poll: Option<Duration>, fallback: Duration) -> Self {
        let (sender, messages) = channel();
        let mut collector = Self {
            messages,
            listener: None,
            mounts: None,
            poller: poll.map(Poller::new),
            fallback,
            quiet,
            places: WatchedPlaces::default(),
            probes: Probes::default(),
            probed: BTreeSet::new(),
            because: None,
            hints: Hints::default(),
            unfinished: UnfinishedFiles::default(),
            open: HashSet::new(),
            may_have_missed_writers: Arc::new(AtomicBool::new(true)),
            pending: HashSet::new(),
            heard: None,
            reported_polling: None,
            sender,
        };
        if poll.is_none() {
            match Listener::new(collector.sender.clone()) {
                Ok(listener) => {
                    collector.listener = Some(listener);
                    collector.mounts = MountListener::new(collector.sender.clone());
                }
                Err(why) => collector.poll_because(why),
            }
        }
        collector
    }

    /// Receives only the messages that a test sends.
    #[cfg(test)]
    pub(crate) fn without_listener(quiet: Duration) -> Self {
        let mut collector = Self::new(quiet, None, Duration::from_millis(500));
        collector.listener = None;
        collector
    }

    /// Listens to folders from which no event arrives.
    #[cfg(test)]
    pub(crate) fn with_silent_listener(quiet: Duration, fallback: Duration) -> Self {
        let mut collector = Self::new(quiet, None, fallback);
        collector.listener = Listener::new(channel().0).ok();
        collector
    }

    /// Waits for unfinished files with other pauses than the default.
    #[cfg(test)]
    pub(crate) fn with_pauses(mut self, pauses: WritePauses) -> Self {
        self.unfinished.pauses = pauses;
        self
    }

    /// The changes that a build which begins now is not told of, those included that come while it runs.
    pub(super) fn heard_changes(&mut self) -> HeardChanges {
        let (sender, further) = channel();
        self.heard = Some(sender);
        HeardChanges::new(self.pending.clone(), further)
    }

    /// What builds ask of the files that are being written.
    pub(super) fn watched_changes(&self) -> WatchedChanges {
        let missed = Arc::clone(&self.may_have_missed_writers);
        let sender = self.sender();
        let report = move |path| drop(sender.send(WatchMessage::BeingWritten(path)));
        WatchedChanges::new(self.unfinished.shared(), missed, Box::new(report))
    }

    /// Whether a file is still being written.
    pub(super) fn waits_for(&self, path: &Path) -> bool {
        self.unfinished.have(path)
    }

    /// Records what a build made of changes: the files on which items failed, and whether the build was
    /// completed.
    pub(super) fn record_outcome(
        &mut self,
        changed: &BTreeSet<PathBuf>,
        failed: &HashSet<PathBuf>,
        has_ended: bool,
    ) {
        self.unfinished.record_outcome(changed, failed, has_ended, Instant::now());
    }

    /// Sends messages to the collector: to wake it, and in tests what the system may send.
    pub(crate) fn sender(&self) -> Sender<WatchMessage> {
        self.sender.clone()
    }

    /// Watches these places from now on. Returns whether any is new: changes of new places may have been
    /// missed until now, so that everything has to be checked again.
    pub(super) fn watch(&mut self, places: WatchedPlaces) -> bool {
        // Whether a changed path existed before is known from the old places.
        self.receive_all();
        self.poll_now();
        let mut is_more = places.exceed(&self.places);
        self.places = places;
        is_more |= self.listen().unwrap_or(false);
        if let Some(poller) = &mut self.poller {
            is_more |= poller.watch(&self.places);
        }
        self.probe();
        is_more
    }

    /// Watches the folders of the files that a build has published. Returns whether any is new, or another
    /// folder than before: what was removed from it until now may have been missed.
    pub(super) fn watch_outputs(&mut self, plan: &Plan) -> bool {
        let is_new = self.places.add_outputs(plan);
        self.listen().unwrap_or(is_new)
    }

    /// Listens to the places. Returns whether a new watch was set; `None` if nothing is listened to.
    fn listen(&mut self) -> Option<bool> {
        let listened = self.listener.as_mut()?.listen(&self.places);
        if let Some(why) = listened.failed {
            self.poll_because(why);
        }
        Some(listened.is_more)
    }

    /// Tests whether events arrive from the roots that are new.
    fn probe(&mut self) {
        if self.listener.is_none() {
            return;
        }
        for root in self.places.roots() {
            if !self.probed.insert(root.clone()) {
                continue;
            }
            match platform::shared_file_system(&root) {
                Some(kind) => {
                    let root = path_text(root);
                    self.poll_because(format!(
                        "{root} is on {kind}: changes by other machines there send no events"
                    ));
                }
                None => self.probes.write(&root),
            }
        }
    }

    fn poll_because(&mut self, why: String) {
        if self.poller.is_none() {
            self.poller = Some(Poller::new(self.fallback));
            self.because = Some(why);
            // Polling does not find what changed before the first poll.
            self.hints.is_uncertain = true;
            self.hints.add_now();
        }
    }

    /// The event that says whether it listens or polls, if that is known and was not reported yet.
    pub(super) fn mode_event(&mut self) -> Option<Event> {
        if !self.probes.are_settled() {
            return None;
        }
        if let Some(why) = self.probes.failed().cloned() {
            self.poll_because(why);
        }
        let polls = self.poller.is_some();
        if self.reported_polling.replace(polls) == Some(polls) {
            return None;
        }
        Some(Event::Watching {
            folders: self.listener.as_ref().map_or(self.places.folders.len(), Listener::folders),
            poll_milliseconds: self.poller.as_ref().map(|poller| poller.every().as_secs_f64() * 1e3),
            because: self.because.clone(),
        })
    }

    /// Waits for changes and then for quiet; until `timeout` if there are none, or until `stop` says so and a
    /// message comes. A file that is still being written does not count as a change until it is finished.
    pub(super) fn wait(&mut self, timeout: Option<Instant>, stop: &dyn Fn() -> bool) -> Wakeup {
        loop {
            self.receive_all();
            let now = Instant::now();
            if self.poller.as_ref().is_some_and(|poller| poller.next() <= now) {
                self.poll_now();
            }
            for (path, file) in self.unfinished.take_ready(now) {
                // It was quiet for long enough, so it is built at once.
                let since = file.first;
                self.finished(path, &file, since);
            }
            let due = self.hints.due(self.quiet);
            if stop() {
                return Wakeup::Stopped;
            }
            if due.is_some_and(|due| due <= now) {
                return Wakeup::Hints;
            }
            if timeout.is_some_and(|timeout| timeout <= now) && due.is_none() {
                return Wakeup::Timeout;
            }
            let poll = self.poller.as_ref().map(Poller::next);
            let timeout = timeout.filter(|_| due.is_none());
            let next = [due, timeout, poll, self.unfinished.next()].into_iter().flatten().min();
            // Whoever changes what `stop` says sends a message.
            let message = match next {
                Some(next) => self.messages.recv_timeout(next.saturating_duration_since(now)).ok(),
                None => self.messages.recv().ok(),
            };
            message.into_iter().for_each(|message| self.receive(message));
        }
    }

    pub(super) fn take(&mut self) -> Hints {
        std::mem::take(&mut self.hints)
    }

    /// Takes the changes so far for a build, which means that they are not pending any more.
    pub(super) fn take_for_build(&mut self) -> Hints {
        let hints = self.take();
        for path in hints.paths.keys().filter(|path| !self.unfinished.have(path)) {
            self.pending.remove(path);
        }
        hints
    }

    pub(super) fn put_back(&mut self, hints: Hints) {
        self.hints.merge(hints);
    }

    /// Whether it is still unknown if the system reports events.
    pub(super) fn is_probing(&self) -> bool {
        self.reported_polling.is_none() || self.probes.are_waiting()
    }

    pub(super) fn places(&self) -> &WatchedPlaces {
        &self.places
    }

    fn receive_all(&mut self) {
        while let Ok(message) = self.messages.try_recv() {
            self.receive(message);
        }
    }

    fn receive(&mut self, message: WatchMessage) {
        match message {
            WatchMessage::Wake => {}
            WatchMessage::EventsLost => {
                self.listener.iter_mut().for_each(Listener::forget_all);
                self.hints.lost = true;
                self.hints.add_now();
                // The lost events may include that of a close.
                for (path, file) in self.unfinished.take_all() {
                    self.finished(path, &file, file.first);
                }
            }
            WatchMessage::MountsChanged => {
                // Another folder is in the place of a watched one; the pass that follows watches it.
                let replaced = self.listener.as_ref().map_or_else(Vec::new, Listener::replaced);
                for folder in replaced {
                    for path in self.places.concerned(&folder) {
                        let existed = self.places.existed(&path);
                        self.changed(path, existed);
                    }
                    self.hints.is_uncertain = true;
                    self.hints.add_now();
                }
            }
            WatchMessage::BeingWritten(path) => {
                let existed = self.places.existed(&path);
                self.unfinished.written(path, existed, None, Instant::now());
            }
            WatchMessage::Event(event) => {
                self.listener.iter_mut().for_each(|listener| listener.forget_moved(&event));
                let renamed = self.follow_writers(&event);
                for path in &event.paths {
                    if is_removal(&event.kind)
                        && let Some(output) = self.places.output_at(path)
                    {
                        self.output_removed(output);
                    }
                    self.probes.arrived(path);
                    let file_event = match &renamed {
                        Some(to) if to == path => FileEvent::Written,
                        _ => FileEvent::of(&event.kind, path),
                    };
                    for path in self.places.concerned(path) {
                        self.apply(path, file_event);
                    }
                }
            }
        }
    }

    /// Remembers which files are being written, whatever their names. Returns the new name of one that was
    /// renamed.
    fn follow_writers(&mut self, event: &notify::Event) -> Option<PathBuf> {
        let [path, others @ ..] = &event.paths[..] else { return None };
        match &event.kind {
            EventKind::Modify(ModifyKind::Data(_)) => _ = self.open.insert(path.clone()),
            EventKind::Access(_) | EventKind::Remove(_) => _ = self.open.remove(path),
            EventKind::Modify(ModifyKind::Name(RenameMode::Both)) => {
                let to = others.first()?;
                if self.open.remove(path) {
                    self.open.insert(to.clone());
                    return Some(to.clone());
                }
            }
            // No event has said what is in a folder that appears, or what another name of a file is.
            EventKind::Create(_) | EventKind::Modify(ModifyKind::Name(RenameMode::To))
                if !self.places.concerned(path).is_empty()
                    && fs::metadata(path)
                        .is_ok_and(|found| found.is_dir() || has_other_names(path, &found)) =>
            {
                self.may_have_missed_writers.store(true, Ordering::Relaxed);
            }
            _ => {}
        }
        None
    }

    fn apply(&mut self, path: PathBuf, event: FileEvent) {
        let (existed, now) = (self.places.existed(&path), Instant::now());
        if event != FileEvent::Closed {
            let is_new = self.pending.insert(path.clone());
            if let Some(build) = self.heard.as_ref().filter(|_| is_new) {
                // The build may have ended.
                let _ = build.send(path.clone());
            }
        }
        match event {
            FileEvent::Written => {
                let pending = self.hints.remove(&path);
                self.unfinished.written(path, existed, pending, now);
            }
            FileEvent::Closed => {
                if let Some(file) = self.unfinished.closed(&path, now) {
                    let since = file.complete_since.unwrap_or(now);
                    self.finished(path, &file, since);
                }
            }
            FileEvent::Replaced => {
                // A program may put another file in the place of one that is gone, or files into a folder.
                let is_complete = fs::metadata(&path).is_ok_and(|found| found.is_file());
                self.hints.may_go_on |= !is_complete;
                let file = self.unfinished.take(&path);
                let since = file.as_ref().and_then(|file| file.complete_since).unwrap_or(now);
                let (existed, first) = file.map_or((existed, now), |file| (file.existed, file.first));
                self.hints.paths.entry(path).or_insert(existed);
                self.hints.add(first, since, now);
            }
            FileEvent::Changed => {
                if !self.unfinished.changed(&path, existed, now) {
                    self.changed(path, existed);
                }
            }
        }
    }

    /// A file is not waited for any more; it could have been built since some time.
    fn finished(&mut self, path: PathBuf, file: &UnfinishedFile, since: Instant) {
        self.hints.paths.entry(path).or_insert(file.existed);
        self.hints.add(file.first, since, Instant::now());
    }

    /// An exported file or a folder of them, or something else in `out`, was removed or renamed.
    fn output_removed(&mut self, path: PathBuf) {
        if !is_temporary(&path) && fs::symlink_metadata(&path).is_err() {
            self.hints.add_removed_output(path);
        }
    }

    fn changed(&mut self, path: PathBuf, existed: bool) {
        self.hints.paths.entry(path).or_insert(existed);
        self.hints.add_now();
    }

    /// Polls now, if polling is necessary.
    pub(super) fn poll_now(&mut self) {
        let Some(poller) = &mut self.poller else { return };
        let polled = poller.poll(&self.places);
        let outputs = self.places.output_folders().collect::<Vec<_>>();
        for path in outputs {
            // The time of the first poll that misses it counts.
            if !self.hints.removed_outputs.contains(&path) {
                self.output_removed(path);
            }
        }
        let written = being_written(polled.changed.iter().map(PathBuf::as_path));
        for path in polled.changed {
            let event = if written.contains(&path) { FileEvent::Written } else { FileEvent::Changed };
            self.apply(path, event);
        }
        if polled.is_uncertain {
            self.hints.is_uncertain = true;
            self.hints.add_now();
        }
    }
}
