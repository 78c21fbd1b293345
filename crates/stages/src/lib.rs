//! The kinds of stage.
