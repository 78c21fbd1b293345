//! The version of the JSON file of a report, which pages read, too.

/// It changes when a field changes its meaning or is removed.
pub(crate) const REPORT_SCHEMA: u64 = 4;
