//! Cancels a picture that the caller no longer needs.

use std::sync::atomic::{AtomicBool, Ordering};

use sh::Stop;

use crate::RenderError;

/// Asks the caller whether to stop, from any thread. Once the answer was yes, it stays yes.
pub(super) struct Cancellation<'a> {
    stop: Stop<'a>,
    is_cancelled: AtomicBool,
}

impl<'a> Cancellation<'a> {
    pub(super) fn new(stop: Stop<'a>) -> Self {
        Self { stop, is_cancelled: AtomicBool::new(false) }
    }

    /// Asks the caller.
    ///
    /// # Errors
    /// [`RenderError::Cancelled`] if the picture is cancelled.
    pub(super) fn check(&self) -> Result<(), RenderError> {
        if self.is_cancelled.load(Ordering::Relaxed) || self.stop.requested() {
            self.is_cancelled.store(true, Ordering::Relaxed);
            return Err(RenderError::Cancelled);
        }
        Ok(())
    }
}

/// Asks the caller once for every [`PeriodicCheck::LIGHT_SAMPLES`] light samples.
pub(super) struct PeriodicCheck<'a> {
    cancellation: &'a Cancellation<'a>,
    light_samples: u32,
}

impl<'a> PeriodicCheck<'a> {
    /// The most light samples of a thread between two checks.
    pub(super) const LIGHT_SAMPLES: u32 = 1 << 16;

    pub(super) fn new(cancellation: &'a Cancellation<'a>) -> Self {
        Self { cancellation, light_samples: 0 }
    }

    /// Counts light samples that are about to be taken, and asks the caller if there were enough since the
    /// last time.
    ///
    /// # Errors
    /// The errors of [`Cancellation::check`].
    pub(super) fn count(&mut self, light_samples: u32) -> Result<(), RenderError> {
        self.light_samples = self.light_samples.saturating_add(light_samples);
        if self.light_samples > Self::LIGHT_SAMPLES {
            self.light_samples = light_samples;
            self.cancellation.check()?;
        }
        Ok(())
    }
}
