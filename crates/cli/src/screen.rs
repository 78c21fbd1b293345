//! The terminal as a command uses it: lines that stay, below them a progress bar, and below that pinned
//! lines. Without a terminal there are only the lines that stay.

use std::collections::BTreeMap;
use std::time::Duration;

use engine::ItemName;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use parking_lot::Mutex;

use crate::escape::{Painted, escaped};
use crate::quantity::percent_done;
use crate::{print, terminal};

/// The number of draws per second is limited: a tick shows what changed since the one before.
const TICK: Duration = Duration::from_millis(100);

/// Standard error as people see it.
pub(crate) struct Screen {
    /// Writes lines if there is no progress bar.
    plain: Box<dyn Fn(&Painted) + Send + Sync>,
    width: fn() -> usize,
    live: Option<Live>,
    /// The items that run, and the share of their work that is done if it is known.
    running: Mutex<BTreeMap<ItemName, Option<f64>>>,
}

/// The lines that are redrawn on a terminal.
struct Live {
    all: MultiProgress,
    /// The bar of the current build.
    bar: Mutex<Option<ProgressBar>>,
    pinned: ProgressBar,
}

impl Live {
    fn on(all: MultiProgress) -> Self {
        let pinned = all.add(ProgressBar::new(0).with_style(style("{msg}")));
        Self { all, bar: Mutex::default(), pinned }
    }
}

impl Screen {
    /// Standard error, with a progress bar if one can move there and `with_bar` is set.
    pub(crate) fn new(with_bar: bool) -> Self {
        let live = (with_bar && terminal::understands_sequences()).then(|| Live::on(MultiProgress::new()));
        Self { plain: Box::new(print::painted), width: terminal::width, live, running: Mutex::default() }
    }

    /// Gives lines to a test.
    #[cfg(test)]
    pub(crate) fn plain(lines: impl Fn(&str) + Send + Sync + 'static) -> Self {
        let plain = move |line: &Painted| lines(&line.to_string());
        Self {
            plain: Box::new(plain),
            width: || terminal::PLAIN_WIDTH,
            live: None,
            running: Mutex::default(),
        }
    }

    /// A terminal of a test.
    #[cfg(test)]
    fn live(terminal: MultiProgress) -> Self {
        let live = Some(Live::on(terminal));
        Self { plain: Box::new(|_| {}), width: || terminal::PLAIN_WIDTH, live, running: Mutex::default() }
    }

    /// Whether lines can be pinned; if not, the lines that stay have to say everything.
    pub(crate) fn can_pin(&self) -> bool {
        self.live.is_some()
    }

    pub(crate) fn width(&self) -> usize {
        (self.width)()
    }

    /// Writes a line that stays.
    pub(crate) fn line(&self, line: &str) {
        self.painted(&Painted::plain(line));
    }

    /// Writes lines with colours that stay.
    pub(crate) fn painted(&self, lines: &Painted) {
        match &self.live {
            // There is no other place to report that a terminal cannot be written to.
            Some(live) => _ = live.all.println(lines.to_string()),
            None => (self.plain)(lines),
        }
    }

    /// Begins the progress bar of a build of this many items.
    pub(crate) fn begin(&self, items: usize) {
        let Some(live) = &self.live else { return };
        self.clear();
        let bar =
            ProgressBar::new(items as u64).with_style(style("{bar:30} {pos}/{len} {elapsed:>4}  {wide_msg}"));
        let bar = live.all.insert_before(&live.pinned, bar);
        bar.enable_steady_tick(TICK);
        *live.bar.lock() = Some(bar);
    }

    /// Notes that an item begins to run.
    pub(crate) fn started(&self, item: &ItemName) {
        self.with_running(|running| _ = running.insert(item.clone(), None));
    }

    /// Notes that this share of a running item's work is done.
    pub(crate) fn progress(&self, item: &ItemName, share: f64) {
        self.with_running(|running| _ = running.get_mut(item).map(|known| *known = Some(share)));
    }

    /// Notes that an item ran or failed.
    pub(crate) fn ended(&self, item: &ItemName) {
        self.with_running(|running| _ = running.remove(item));
        self.settled();
    }

    /// Notes that nothing is left to do for one more item.
    pub(crate) fn settled(&self) {
        self.with_bar(|bar| bar.inc(1));
    }

    /// Removes the progress bar of a build that is over.
    pub(crate) fn clear(&self) {
        if let Some(live) = &self.live
            && let Some(bar) = live.bar.lock().take()
        {
            bar.finish_and_clear();
            live.all.remove(&bar);
        }
        self.running.lock().clear();
    }

    /// Pins these lines to the bottom, in place of those before.
    pub(crate) fn pin(&self, text: String) {
        if let Some(live) = &self.live {
            live.pinned.set_message(escaped(&text).into_owned());
            live.pinned.tick();
        }
    }

    /// Removes everything but the lines that stay.
    pub(crate) fn close(&self) {
        self.clear();
        if let Some(live) = &self.live {
            live.pinned.finish_and_clear();
        }
    }

    fn with_running(&self, change: impl FnOnce(&mut BTreeMap<ItemName, Option<f64>>)) {
        let mut running = self.running.lock();
        change(&mut running);
        self.with_bar(|bar| {
            let shown = |(item, share): (&ItemName, &Option<f64>)| match share {
                Some(share) => format!("{item} {}", percent_done(*share)),
                None => item.to_string(),
            };
            let names = running.iter().map(shown).collect::<Vec<_>>();
            bar.set_message(escaped(&names.join(", ")).into_owned());
        });
    }

    fn with_bar(&self, act: impl FnOnce(&ProgressBar)) {
        if let Some(live) = &self.live
            && let Some(bar) = live.bar.lock().as_ref()
        {
            act(bar);
        }
    }
}

/// A style by its template, or indicatif's default if the template is not valid.
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

    /// A terminal that records what is written to it, without what moves the cursor.
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
    fn a_long_item_is_shown_with_the_share_that_is_done() {
        let terminal = Terminal::default();
        let drawn_to = ProgressDrawTarget::term_like(Box::new(terminal.clone()));
        let screen = Screen::live(MultiProgress::with_draw_target(drawn_to));
        let [report, map] =
            ["report", "map"].map(|stage| ItemName { stage: stage.into(), key: ItemKey::default() });
        screen.begin(3);
        [&report, &map].into_iter().for_each(|item| screen.started(item));
        screen.progress(&report, 0.459);
        screen.line("a line");
        assert!(terminal.0.lock().contains("map, report 45 %"), "{terminal:?}");
        // What has ended is not shown again.
        screen.ended(&report);
        screen.progress(&report, 0.5);
        terminal.0.lock().clear();
        screen.line("a line");
        let written = terminal.0.lock().clone();
        assert!(written.contains("map") && !written.contains("report"), "{written:?}");
        screen.close();
    }

    #[test]
    fn bars_and_pinned_lines_are_escaped_and_painted_lines_are_not() {
        let terminal = Terminal::default();
        let drawn_to = ProgressDrawTarget::term_like(Box::new(terminal.clone()));
        let screen = Screen::live(MultiProgress::with_draw_target(drawn_to));
        let key = ItemKey::from_iter([("paint", "gold\u{1b}]0;title\u{7}")]);
        screen.begin(2);
        screen.started(&ItemName { stage: "map".into(), key });
        screen.pin("a pin\u{9b}\u{202e}".into());
        // A line redraws everything, even if the last tick was a moment ago.
        screen.line("a line\u{1b}[31m");
        let written = terminal.0.lock().clone();
        for escaped in [r"gold\u{1b}]0;title\u{7}", r"a line\u{1b}[31m", r"a pin\u{9b}\u{202e}"] {
            assert!(written.contains(escaped), "no {escaped} in {written:?}");
        }
        for raw in ["\u{1b}]", "\u{1b}[31m", "\u{7}", "\u{9b}", "\u{202e}"] {
            assert!(!written.contains(raw), "{raw:?} in {written:?}");
        }
        screen.painted(&Painted::of_escaped("\u{1b}[1mbold\u{1b}[0m".into()));
        assert!(terminal.0.lock().contains("\u{1b}[1mbold\u{1b}[0m"));
        screen.close();
    }
}
