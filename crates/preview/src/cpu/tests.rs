//! The CPU's pictures against what is known of them without it.
