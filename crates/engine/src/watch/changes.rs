//! Attends to the places of a graph: hears and looks, gathers what came until it is quiet, and knows whether hearing
//! can be relied on.
//!
//! What is heard is gathered here, not by `notify`'s full debouncer, which merges the events of a path and so can
//! lose a change: of a file that is written beside, renamed over the old one and removed at once it tells nothing at
//! all. Here nothing is merged. An event is only a hint of where to look: contents decide.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use super::listener::{Heard, Listener, Step};
use super::places::Places;
use super::poller::Poller;
use super::probe::Probes;
#[cfg(test)]
use super::unfinished::WritePauses;
use super::unfinished::{Awaited, PATIENCE, Unfinished};
use crate::session::PathSet;
use crate::{Event, platform};

/// How often a waiting watcher asks whether it is to stop.
const PULSE: Duration = Duration::from_millis(100);

/// What came, not yet acted on.
#[derive(Debug, Default)]
pub(super) struct Hints {
    /// The paths that it concerns, as the graph spells them, and whether they led somewhere before.
    pub(super) paths: BTreeMap<PathBuf, bool>,
    /// Whether events were lost.
    pub(super) lost: bool,
    /// Whether something may have changed that cannot be told.
    perhaps: bool,
    /// When the first was heard of.
    heard: Option<Instant>,
    /// When the first and the last came that could be acted on.
    times: Option<(Instant, Instant)>,
}

impl Hints {
    fn came(&mut self) {
        let now = Instant::now();
        self.came_at(now, now, now);
    }

    /// Something was heard of at a time, could be acted on since another, and is to be from now on.
    fn came_at(&mut self, heard: Instant, since: Instant, now: Instant) {
        self.heard = Some(self.heard.map_or(heard, |first| first.min(heard)));
        let times = self.times.unwrap_or((since, now));
        self.times = Some((times.0.min(since), times.1.max(now)));
    }

    /// Takes a path out. Returns whether it led somewhere before, when it was heard of, and since when it could be acted
    /// on.
    fn take(&mut self, path: &Path) -> Option<(bool, Instant, Instant)> {
        let knew = self.paths.remove(path)?;
        let taken = (knew, self.heard?, self.times?.0);
        if self.paths.is_empty() && !self.lost && !self.perhaps {
            *self = Self::default();
        }
        Some(taken)
    }

    /// When they are to be acted on: after a quiet time.
    fn ripe(&self, quiet: Duration) -> Option<Instant> {
        self.times.map(|(first, last)| (last + quiet).min(first + quiet * PATIENCE))
    }

    /// Whether they name all that can have changed.
    pub(super) fn are_all(&self) -> bool {
        !self.lost && !self.perhaps
    }

    /// The time since the first of them came.
    pub(super) fn age(&self) -> Duration {
        self.heard.map_or(Duration::ZERO, |first| first.elapsed())
    }

    /// Adds others.
    pub(super) fn merge(&mut self, others: Self) {
        for (path, knew) in others.paths {
            self.paths.entry(path).or_insert(knew);
        }
        self.lost |= others.lost;
        self.perhaps |= others.perhaps;
        self.heard = self.heard.into_iter().chain(others.heard).min();
        self.times = match (self.times, others.times) {
            (Some((a, b)), Some((c, d))) => Some((a.min(c), b.max(d))),
            (own, others) => own.or(others),
        };
    }
}

/// Why waiting ended.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Woken {
    /// Hints came, and then it was quiet.
    Hints,
    /// The time is over.
    Due,
    /// It was told to stop.
    Stopped,
}

/// Ears and eyes.
pub(crate) struct ChangeCollector {
    heard: Receiver<Heard>,
    teller: Sender<Heard>,
    listener: Option<Listener>,
    poller: Option<Poller>,
    /// The time between two looks, should looking be necessary.
    fallback: Duration,
    quiet: Duration,
    places: Places,
    probes: Probes,
    /// The roots that have been probed, or need not be.
    probed: BTreeSet<PathBuf>,
    because: Option<String>,
    hints: Hints,
    unfinished: Unfinished,
    /// The paths of which something was heard that was not acted on yet.
    pending: Arc<PathSet>,
    /// The way that was told last: whether it polls.
    told: Option<bool>,
}

impl ChangeCollector {
    /// Attends to nothing yet. Looks where `poll` says so, else listens.
    pub(crate) fn new(quiet: Duration, poll: Option<Duration>, fallback: Duration) -> Self {
        let (teller, heard) = channel();
        let mut attention = Self {
            heard,
            listener: None,
            poller: poll.map(Poller::new),
            fallback,
            quiet,
            places: Places::default(),
            probes: Probes::default(),
            probed: BTreeSet::new(),
            because: None,
            hints: Hints::default(),
            unfinished: Unfinished::default(),
            pending: Arc::default(),
            told: None,
            teller,
        };
        if poll.is_none() {
            match Listener::new(attention.teller.clone()) {
                Ok(listener) => attention.listener = Some(listener),
                Err(why) => attention.poll_because(why),
            }
        }
        attention
    }

    /// Hears nothing but what it is told.
    #[cfg(test)]
    pub(crate) fn deaf(quiet: Duration) -> Self {
        let mut attention = Self::new(quiet, None, Duration::from_millis(500));
        attention.listener = None;
        attention
    }

    /// Listens to folders from which no event arrives.
    #[cfg(test)]
    pub(crate) fn unanswered(quiet: Duration, fallback: Duration) -> Self {
        let mut attention = Self::new(quiet, None, fallback);
        attention.listener = Listener::new(channel().0).ok();
        attention
    }

    /// Waits for files that are being written in other ways than by default.
    #[cfg(test)]
    pub(crate) fn with_pauses(mut self, pauses: WritePauses) -> Self {
        self.unfinished.pauses = pauses;
        self
    }

    /// The paths of which something was heard that was not acted on yet, files that are being written among them.
    pub(super) fn pending(&self) -> Arc<PathSet> {
        Arc::clone(&self.pending)
    }

    /// What came of acting on changes: the files that items failed on, and whether the build went to its end.
    pub(super) fn judge(&mut self, changed: &BTreeSet<PathBuf>, failed: &HashSet<PathBuf>, has_ended: bool) {
        self.unfinished.judge(changed, failed, has_ended, Instant::now());
    }

    /// Lets others be heard: an end of waiting, and in tests what the system may tell.
    pub(crate) fn teller(&self) -> Sender<Heard> {
        self.teller.clone()
    }

    /// Attends to these places from now on. Returns whether that is more than before: what came to the new ones until
    /// now may have gone unheard, so that everything has to be looked at again.
    pub(super) fn attend(&mut self, places: Places) -> bool {
        // What is known to have changed is told by what was there before.
        self.take_all();
        self.look();
        let mut is_more = places.exceed(&self.places);
        self.places = places;
        if let Some(listener) = &mut self.listener {
            let listened = listener.listen(&self.places);
            is_more |= listened.is_more;
            if let Some(why) = listened.failed {
                self.poll_because(why);
            }
        }
        if let Some(poller) = &mut self.poller {
            is_more |= poller.attend(&self.places);
        }
        self.probe();
        is_more
    }

    /// Asks roots that are new for proof that events arrive from there.
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
                    let root = root.display();
                    self.poll_because(format!(
                        "{root} is on {kind}: what other machines change there makes no events"
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
            // What came before the first look has to be found otherwise.
            self.hints.perhaps = true;
            self.hints.came();
        }
    }

    /// The way in which files are attended to, where it is certain and was not told yet.
    pub(super) fn way(&mut self) -> Option<Event> {
        if !self.probes.are_settled() {
            return None;
        }
        if let Some(why) = self.probes.failed().cloned() {
            self.poll_because(why);
        }
        let polls = self.poller.is_some();
        if self.told.replace(polls) == Some(polls) {
            return None;
        }
        Some(Event::Watching {
            folders: self.listener.as_ref().map_or(self.places.folders.len(), Listener::folders),
            poll_milliseconds: self.poller.as_ref().map(|poller| poller.every().as_secs_f64() * 1e3),
            because: self.because.clone(),
        })
    }

    /// Waits for hints and then for quiet; until `due` where none came, or until `stop` says so. A file that is being
    /// written makes no hint before it is finished.
    pub(super) fn wait(&mut self, due: Option<Instant>, stop: &dyn Fn() -> bool) -> Woken {
        loop {
            self.take_all();
            let now = Instant::now();
            if self.poller.as_ref().is_some_and(|poller| poller.next() <= now) {
                self.look();
            }
            for (path, file) in self.unfinished.take_ripe(now) {
                // At once: it was waited for long enough.
                let since = file.first;
                self.finished(path, &file, since);
            }
            let ripe = self.hints.ripe(self.quiet);
            if stop() {
                return Woken::Stopped;
            }
            if ripe.is_some_and(|ripe| ripe <= now) {
                return Woken::Hints;
            }
            if due.is_some_and(|due| due <= now) && ripe.is_none() {
                return Woken::Due;
            }
            let look = self.poller.as_ref().map(Poller::next);
            let next =
                [Some(now + PULSE), ripe, due, look, self.unfinished.next()].into_iter().flatten().min();
            let pause = next.map_or(PULSE, |next| next.saturating_duration_since(now));
            match self.heard.recv_timeout(pause) {
                Ok(heard) => self.take(heard),
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
            }
        }
    }

    /// What came so far.
    pub(super) fn hints(&mut self) -> Hints {
        std::mem::take(&mut self.hints)
    }

    /// What came so far, and is acted on now.
    pub(super) fn act(&mut self) -> Hints {
        let hints = self.hints();
        let mut pending = self.pending.lock();
        for path in hints.paths.keys().filter(|path| !self.unfinished.have(path)) {
            pending.remove(path);
        }
        drop(pending);
        hints
    }

    /// Gives back what is still to be acted on.
    pub(super) fn give_back(&mut self, hints: Hints) {
        self.hints.merge(hints);
    }

    /// Whether it is still unknown if events arrive.
    pub(super) fn is_proving(&self) -> bool {
        self.told.is_none() || self.probes.are_waiting()
    }

    /// The places that are attended to.
    pub(super) fn places(&self) -> &Places {
        &self.places
    }

    fn take_all(&mut self) {
        while let Ok(heard) = self.heard.try_recv() {
            self.take(heard);
        }
    }

    fn take(&mut self, heard: Heard) {
        match heard {
            Heard::Nudge => {}
            Heard::Lost => {
                self.listener.iter_mut().for_each(Listener::forget_all);
                self.hints.lost = true;
                self.hints.came();
                // A close may be among what was lost.
                for (path, file) in self.unfinished.take_all() {
                    self.finished(path, &file, file.first);
                }
            }
            Heard::Event(event) => {
                self.listener.iter_mut().for_each(|listener| listener.forget_moved(&event));
                for path in &event.paths {
                    self.probes.heard(path);
                    let step = Step::of(&event.kind, path);
                    for path in self.places.concerned(path) {
                        self.hear(path, step);
                    }
                }
            }
        }
    }

    fn hear(&mut self, path: PathBuf, step: Step) {
        let (knew, now) = (self.places.knew(&path), Instant::now());
        if step != Step::Closed {
            self.pending.lock().insert(path.clone());
        }
        match step {
            Step::Written => {
                let pending = self.hints.take(&path);
                self.unfinished.written(path, knew, pending, now);
            }
            Step::Closed => {
                if let Some(file) = self.unfinished.closed(&path, now) {
                    let since = file.whole.unwrap_or(now);
                    self.finished(path, &file, since);
                }
            }
            Step::Replaced => match self.unfinished.take(&path) {
                Some(file) => self.finished(path, &file, file.whole.unwrap_or(now)),
                None => self.changed(path, knew),
            },
            Step::Changed => {
                if !self.unfinished.changed(&path, knew, now) {
                    self.changed(path, knew);
                }
            }
        }
    }

    /// A file is not waited for any more; it could be acted on since some time.
    fn finished(&mut self, path: PathBuf, file: &Awaited, since: Instant) {
        self.hints.paths.entry(path).or_insert(file.knew);
        self.hints.came_at(file.first, since, Instant::now());
    }

    fn changed(&mut self, path: PathBuf, knew: bool) {
        self.hints.paths.entry(path).or_insert(knew);
        self.hints.came();
    }

    /// Looks at the files now, where they are looked at.
    pub(super) fn look(&mut self) {
        let Some(poller) = &mut self.poller else { return };
        let seen = poller.look(&self.places);
        seen.changed.into_iter().for_each(|path| self.hear(path, Step::Changed));
        if seen.perhaps {
            self.hints.perhaps = true;
            self.hints.came();
        }
    }
}
