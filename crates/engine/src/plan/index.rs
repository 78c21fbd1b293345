//! Numbers that stand for stages and items. A file of its own, so that others can name them without the plan.

/// The index of a stage in [`Plan::stages`](crate::plan::Plan::stages).
pub type StageIndex = usize;
/// The index of an item in [`Plan::items`](crate::plan::Plan::items).
pub type ItemIndex = usize;
