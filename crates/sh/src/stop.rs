//! Whether long work is to stop: every function that computes for long asks its caller now and then.

/// The question whether to stop, which a function asks while it works.
///
/// # Example: a sum that ends when it is asked to
/// ```
/// use sh::{Stop, Stopped};
/// fn sum(numbers: &[f64], stop: Stop<'_>) -> Result<f64, Stopped> {
///     let add = |sum, number| stop.check().map(|()| sum + number);
///     numbers.iter().try_fold(0.0, add)
/// }
/// assert_eq!(sum(&[1.0, 2.0], Stop::NEVER), Ok(3.0));
/// assert_eq!(sum(&[1.0, 2.0], Stop::when(&|| true)), Err(Stopped));
/// ```
#[derive(Clone, Copy)]
pub struct Stop<'a>(Option<&'a (dyn Fn() -> bool + Sync)>);

impl<'a> Stop<'a> {
    /// Work that nobody stops.
    pub const NEVER: Self = Self(None);

    /// Work that stops once `asked` says so. It may be asked on any thread.
    pub fn when(asked: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self(Some(asked))
    }

    /// Asks whether to stop.
    pub fn requested(self) -> bool {
        self.0.is_some_and(|asked| asked())
    }

    /// Asks whether to stop, for functions that then return an error.
    ///
    /// # Errors
    /// If the work is to stop.
    pub fn check(self) -> Result<(), Stopped> {
        if self.requested() { Err(Stopped) } else { Ok(()) }
    }
}

/// The result of work that nobody stops, if being stopped is its only error.
pub fn unstopped<T>(work: impl FnOnce(Stop<'_>) -> Result<T, Stopped>) -> T {
    match work(Stop::NEVER) {
        Ok(result) => result,
        Err(Stopped) => unreachable!("nobody asked for it"),
    }
}

/// The work was stopped before its end, because its caller asked for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped")]
pub struct Stopped;
