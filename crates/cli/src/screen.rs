//! The terminal as a command uses it: lines that stay, below them a bar while something works, below that what is
//! pinned. Without a terminal only the lines are left.

use std::collections::BTreeSet;
use std::time::Duration;

use engine::ItemName;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use parking_lot::Mutex;

use crate::escape::{Painted, escaped};
use crate::{print, terminal};

/// Draws are limited to some a second: a tick shows what changed since the last one.
const TICK: Duration = Duration::from_millis(100);

/// Standard error as people see it.
pub(crate) struct Screen {
    /// Where lines go when nothing moves.
    plain: Box<dyn Fn(&Painted) + Send + Sync>,
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

impl Moving {
    fn on(all: MultiProgress) -> Self {
        let pinned = all.add(ProgressBar::new(0).with_style(style("{msg}")));
        Self { all, bar: Mutex::default(), pinned }
    }
}

impl Screen {
    /// Standard error; where it is a terminal and `moving` is asked for, with a bar.
    pub(crate) fn new(moving: bool) -> Self {
        let moving = (moving && terminal::is_watched()).then(|| Moving::on(MultiProgress::new()));
        Self { plain: Box::new(print::painted), moving, running: Mutex::default() }
    }

    /// Lines for whoever asks, and nothing that moves.
    #[cfg(test)]
    pub(crate) fn plain(lines: impl Fn(&str) + Send + Sync + 'static) -> Self {
        let plain = move |line: &Painted| lines(&line.to_string());
        Self { plain: Box::new(plain), moving: None, running: Mutex::default() }
    }

    /// A terminal of a test's own.
    #[cfg(test)]
    fn moving(terminal: MultiProgress) -> Self {
        Self { plain: Box::new(|_| {}), moving: Some(Moving::on(terminal)), running: Mutex::default() }
    }

    /// Whether something is pinned and moves; if not, lines have to say everything.
    pub(crate) fn moves(&self) -> bool {
        self.moving.is_some()
    }

    /// A line that stays.
    pub(crate) fn line(&self, line: &str) {
        self.painted(&Painted::plain(line));
    }

    /// Lines with colours that stay.
    pub(crate) fn painted(&self, lines: &Painted) {
        match &self.moving {
            // What cannot be written to a terminal has nobody to be told to.
            Some(moving) => _ = moving.all.println(lines.to_string()),
            None => (self.plain)(lines),
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
        *moving.bar.lock() = Some(bar);
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
            && let Some(bar) = moving.bar.lock().take()
        {
            bar.finish_and_clear();
            moving.all.remove(&bar);
        }
        self.running.lock().clear();
    }

    /// What stays at the bottom from now on.
    pub(crate) fn pin(&self, text: String) {
        if let Some(moving) = &self.moving {
            moving.pinned.set_message(escaped(&text).into_owned());
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
        let mut running = self.running.lock();
        change(&mut running);
        self.with_bar(|bar| {
            let names = running.iter().map(ItemName::to_string).collect::<Vec<_>>();
            bar.set_message(escaped(&names.join(", ")).into_owned());
        });
    }

    fn with_bar(&self, act: impl FnOnce(&ProgressBar)) {
        if let Some(moving) = &self.moving
            && let Some(bar) = moving.bar.lock().as_ref()
        {
            act(bar);
        }
    }
}

/// A style by its template, or indicatif's own where the template were wrong.
fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::Arc;

    use engine::ItemKey;
    use indicatif::{ProgressDrawTarget, TermLike};

    use super::*;

    /// A terminal that remembers what was written to it, less what moves the cursor.
    #[derive(Clone, Debug, Default)]
    struct Terminal(Arc<Mutex<String>>);

    impl TermLike for Terminal {
        fn width(&self) -> u16 {
            200
        }

        fn height(&self) -> u16 {
            50
        }

        fn move_cursor_up(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn move_cursor_down(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn move_cursor_right(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn move_cursor_left(&self, _: usize) -> io::Result<()> {
            Ok(())
        }

        fn write_line(&self, line: &str) -> io::Result<()> {
            self.write_str(&format!("{line}\n"))
        }

        fn write_str(&self, text: &str) -> io::Result<()> {
            self.0.lock().push_str(text);
            Ok(())
        }

        fn clear_line(&self) -> io::Result<()> {
            Ok(())
        }

        fn flush(&self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn what_moves_on_a_terminal_is_escaped_and_what_is_painted_is_not() {
        let terminal = Terminal::default();
        let drawn_to = ProgressDrawTarget::term_like(Box::new(terminal.clone()));
        let screen = Screen::moving(MultiProgress::with_draw_target(drawn_to));
        let key = ItemKey::from_iter([("paint", "gold\u{1b}]0;title\u{7}")]);
        screen.begin(2);
        screen.started(&ItemName { stage: "map".into(), key });
        screen.pin("a pin\u{9b}\u{202e}".into());
        // A line draws all anew, whenever the last tick was.
        screen.line("a line\u{1b}[31m");
        let written = terminal.0.lock().clone();
        for shown in [r"gold\u{1b}]0;title\u{7}", r"a line\u{1b}[31m", r"a pin\u{9b}\u{202e}"] {
            assert!(written.contains(shown), "no {shown} in {written:?}");
        }
        for raw in ["\u{1b}]", "\u{1b}[31m", "\u{7}", "\u{9b}", "\u{202e}"] {
            assert!(!written.contains(raw), "{raw:?} in {written:?}");
        }
        screen.painted(&Painted::of_escaped("\u{1b}[1mbold\u{1b}[0m".into()));
        assert!(terminal.0.lock().contains("\u{1b}[1mbold\u{1b}[0m"));
        screen.close();
    }
}
