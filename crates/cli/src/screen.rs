//! The terminal as a command uses it: lines that stay, below them a bar while something works, below that what is
//! pinned. Without a terminal only the lines are left.

use std::collections::BTreeSet;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use engine::ItemName;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use crate::{print, terminal};

/// Draws are limited to some a second: a tick shows what changed since the last one.
const TICK: Duration = Duration::from_millis(100);

/// Standard error as people see it.
pub(crate) struct Screen {
    /// Where lines go when nothing moves.
    plain: Box<dyn Fn(&str) + Send + Sync>,
    moving: Option<Moving>,
    running: Mutex<BTreeSet<ItemName>>,
}

/// What moves on a terminal.
struct Moving {
    all: MultiProgress,
    /// The bar of the build at work.
    bar: Mutex<Option<ProgressBar>>,
    pinned: ProgressBar,
}

impl Screen {
    /// Standard error; where it is a terminal and `moving` is asked for, with a bar.
    pub(crate) fn new(moving: bool) -> Self {
        let moving = (moving && terminal::is_watched()).then(|| {
            let all = MultiProgress::new();
            let pinned = all.add(ProgressBar::new(0).with_style(style("{msg}")));
            Moving { all, bar: Mutex::default(), pinned }
        });
        Self { plain: Box::new(print::message), moving, running: Mutex::default() }
    }

    /// Lines for whoever asks, and nothing that moves.
    #[cfg(test)]
    pub(crate) fn plain(lines: impl Fn(&str) + Send + Sync + 'static) -> Self {
        Self { plain: Box::new(lines), moving: None, running: Mutex::default() }
    }

    /// Whether something is pinned and moves; if not, lines have to say everything.
    pub(crate) fn moves(&self) -> bool {
        self.moving.is_some()
    }

    /// A line that stays.
    pub(crate) fn line(&self, line: &str) {
        match &self.moving {
            // What cannot be written to a terminal has nobody to be told to.
            Some(moving) => _ = moving.all.println(line),
            None => (self.plain)(line),
        }
    }

    /// A build of so many items begins.
    pub(crate) fn begin(&self, items: usize) {
        let Some(moving) = &self.moving else { return };
        self.clear();
        let bar =
            ProgressBar::new(items as u64).with_style(style("{bar:30} {pos}/{len} {elapsed:>4}  {wide_msg}"));
        let bar = moving.all.insert_before(&moving.pinned, bar);
        bar.enable_steady_tick(TICK);
        *locked(&moving.bar) = Some(bar);
    }

    /// An item begins to run.
    pub(crate) fn started(&self, item: &ItemName) {
        self.with_running(|running| _ = running.insert(item.clone()));
    }

    /// An item ran.
    pub(crate) fn ended(&self, item: &ItemName) {
        self.with_running(|running| _ = running.remove(item));
        self.settled();
    }

    /// One item less to do.
    pub(crate) fn settled(&self) {
        self.with_bar(|bar| bar.inc(1));
    }

    /// Nothing works any more: the bar goes.
    pub(crate) fn clear(&self) {
        if let Some(moving) = &self.moving
            && let Some(bar) = locked(&moving.bar).take()
        {
            bar.finish_and_clear();
            moving.all.remove(&bar);
        }
        locked(&self.running).clear();
    }

    /// What stays at the bottom from now on.
    pub(crate) fn pin(&self, text: String) {
        if let Some(moving) = &self.moving {
            moving.pinned.set_message(text);
            moving.pinned.tick();
        }
    }

    /// Takes everything away that is not a line.
    pub(crate) fn close(&self) {
        self.clear();
        if let Some(moving) = &self.moving {
            moving.pinned.finish_and_clear();
        }
    }

    fn with_running(&self, change: impl FnOnce(&mut BTreeSet<ItemName>)) {
        let mut running = locked(&self.running);
        change(&mut running);
        self.with_bar(|bar| {
            bar.set_message(running.iter().map(ItemName::to_string).collect::<Vec<_>>().join(", "));
        });
    }

    fn with_bar(&self, act: impl FnOnce(&ProgressBar)) {
        if let Some(moving) = &self.moving
            && let Some(bar) = locked(&moving.bar).as_ref()
        {
            act(bar);
        }
    }
}

/// A style by its template, or indicatif's own where the template were wrong.
fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// What a mutex holds, also after a panic.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
