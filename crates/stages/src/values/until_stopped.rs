//! Kernels that end early once their item is to stop.

use engine::{Failure, Reporter, Steps};
use sh::Stop;

/// Calls kernels so that they end early once their item is to stop. Every kernel that works for long takes a
/// [`Stop`], which it asks again and again. With [`Steps`] each of these questions counts as a step.
pub trait UntilStopped {
    /// Calls a kernel with the question whether the item is to stop.
    ///
    /// # Errors
    /// [`Failure::cancelled`] if the item is to stop, otherwise the error of the kernel.
    fn until_stopped<T, E: Into<Failure>>(
        &self,
        kernel: impl FnOnce(Stop<'_>) -> Result<T, E>,
    ) -> Result<T, Failure>;
}

impl UntilStopped for Reporter {
    fn until_stopped<T, E: Into<Failure>>(
        &self,
        kernel: impl FnOnce(Stop<'_>) -> Result<T, E>,
    ) -> Result<T, Failure> {
        let result = kernel(Stop::when(&|| self.check_cancelled().is_err()));
        self.check_cancelled()?;
        result.map_err(Into::into)
    }
}

impl UntilStopped for Steps<'_> {
    fn until_stopped<T, E: Into<Failure>>(
        &self,
        kernel: impl FnOnce(Stop<'_>) -> Result<T, E>,
    ) -> Result<T, Failure> {
        let result = kernel(Stop::when(&|| self.stop()));
        self.reporter().check_cancelled()?;
        result.map_err(Into::into)
    }
}

#[cfg(test)]
mod tests {
    use engine::Cancel;

    use super::*;

    #[test]
    fn a_kernel_that_was_stopped_cancels_its_item_and_another_error_is_its_own() {
        let cancel = Cancel::default();
        let reporter = Reporter::new(cancel.clone());
        let steps = Steps::new(&reporter, 2);
        assert_eq!(reporter.until_stopped(|stop| stop.check().map(|()| 1)), Ok(1));
        assert_eq!(steps.until_stopped(|stop| stop.check().map(|()| 2)), Ok(2));
        assert_eq!(reporter.share_done(), 0.5);
        let wrong = || Failure::new("wrong");
        assert_eq!(reporter.until_stopped(|_| Err::<(), _>(wrong())), Err(wrong()));
        cancel.cancel();
        let (whole, part) =
            (reporter.until_stopped(|stop| stop.check()), steps.until_stopped(|stop| stop.check()));
        for found in [whole, part] {
            assert_eq!(found, Err(Failure::cancelled()));
        }
        assert_eq!(reporter.until_stopped(|_| Err::<(), _>(wrong())), Err(Failure::cancelled()));
    }
}
