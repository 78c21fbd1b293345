//! The bars of a lane: work that is too short to be seen shares a bar with its neighbours.

use super::timeline::{Index, Nanoseconds};

/// A span of work or a moment that a bar stands for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    pub(super) item: Index,
    pub(super) start: Nanoseconds,
    pub(super) end: Nanoseconds,
    pub(super) style: BarStyle,
}

/// The style of a bar. A bar of several marks shows the greatest of their styles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum BarStyle {
    UpToDate,
    Fetch,
    Publish,
    Same,
    Ran,
    Stopped,
    Failed,
}

/// One mark, or several that are too short to be distinguished.
#[derive(Clone, Debug)]
pub(super) struct Bar {
    pub(super) start: Nanoseconds,
    pub(super) end: Nanoseconds,
    pub(super) style: BarStyle,
    /// The marks in the order of their times.
    pub(super) marks: Vec<Mark>,
}

/// The bars of marks that are sorted by time and do not overlap, for a lane of this duration.
///
/// A mark of at least a thousandth of the lane has its own bar. Shorter ones share a bar of at most a
/// hundredth, so that one still sees where there are many.
pub(super) fn bars(marks: impl IntoIterator<Item = Mark>, total: Nanoseconds) -> Vec<Bar> {
    let (short, most) = (total / 1000, total / 100);
    let mut bars = Vec::<Bar>::new();
    for mark in marks {
        let is_short = mark.end - mark.start < short;
        if let Some(last) = bars.last_mut()
            && is_short
            && last.marks.last().is_some_and(|before| before.end - before.start < short)
            && mark.start.saturating_sub(last.end) < short
            && mark.end.saturating_sub(last.start) <= most
        {
            last.end = mark.end.max(last.end);
            last.style = mark.style.max(last.style);
            last.marks.push(mark);
        } else {
            bars.push(Bar { start: mark.start, end: mark.end, style: mark.style, marks: vec![mark] });
        }
    }
    bars
}
