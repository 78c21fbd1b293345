//! The bars of a lane: what is too short to be seen is drawn together with its neighbours.

use super::{Index, Nanoseconds};

/// What a bar stands for: a piece of work, or something that took no time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    pub(super) item: Index,
    pub(super) start: Nanoseconds,
    pub(super) end: Nanoseconds,
    pub(super) look: Look,
}

/// How a bar looks; of several in one, the greatest counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Look {
    Current,
    Fetch,
    Publish,
    Same,
    Ran,
    Stopped,
    Failed,
}

/// What is drawn: one mark, or several that cannot be told apart by eye.
#[derive(Clone, Debug)]
pub(super) struct Bar {
    pub(super) start: Nanoseconds,
    pub(super) end: Nanoseconds,
    pub(super) look: Look,
    /// In order of time.
    pub(super) marks: Vec<Mark>,
}

/// The bars of marks that are sorted by time and do not overlap, in a picture of this much time.
///
/// A mark of a thousandth of the picture is a bar of its own. Shorter ones share one, of a hundredth at most, so that
/// the eye still sees where there are many.
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
            last.look = mark.look.max(last.look);
            last.marks.push(mark);
        } else {
            bars.push(Bar { start: mark.start, end: mark.end, look: mark.look, marks: vec![mark] });
        }
    }
    bars
}
