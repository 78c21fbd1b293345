//! Panics that become errors.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use preview::RenderError;

/// Runs the work of a thread and turns a panic into an error. Otherwise the thread would end without a word,
/// and the window would wait for it forever.
pub(crate) fn guarded<T>(work: impl FnOnce() -> Result<T, RenderError>) -> Result<T, RenderError> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        Err(RenderError::Device(format!("the renderer panicked: {}", message(panic.as_ref()))))
    })
}

pub(crate) fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("it gave no message").to_owned()
}
