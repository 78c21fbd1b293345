//! Whether the caller still wants the picture.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::RenderError;

/// Asks the caller, from any thread; once it was said, it holds.
pub(super) struct Stop<'a> {
    ask: &'a (dyn Fn() -> bool + Sync),
    said: AtomicBool,
}

impl<'a> Stop<'a> {
    pub(super) fn new(ask: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self { ask, said: AtomicBool::new(false) }
    }

    /// Asks.
    ///
    /// # Errors
    /// [`RenderError::Cancelled`] where the picture is no longer wanted.
    pub(super) fn check(&self) -> Result<(), RenderError> {
        if self.said.load(Ordering::Relaxed) || (self.ask)() {
            self.said.store(true, Ordering::Relaxed);
            return Err(RenderError::Cancelled);
        }
        Ok(())
    }
}

/// Asks once for so many samples of light.
pub(super) struct Patience<'a> {
    stop: &'a Stop<'a>,
    spent: u32,
}

impl<'a> Patience<'a> {
    /// The most samples of light that are taken between two questions, per thread.
    pub(super) const LIGHT_SAMPLES: u32 = 1 << 16;

    pub(super) fn new(stop: &'a Stop<'a>) -> Self {
        Self { stop, spent: 0 }
    }

    /// Notes samples of light that are about to be taken, and asks where there were enough.
    ///
    /// # Errors
    /// As [`Stop::check`].
    pub(super) fn spend(&mut self, light_samples: u32) -> Result<(), RenderError> {
        self.spent = self.spent.saturating_add(light_samples);
        if self.spent > Self::LIGHT_SAMPLES {
            self.spent = light_samples;
            self.stop.check()?;
        }
        Ok(())
    }
}
