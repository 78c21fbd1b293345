//! One loop over items in parallel. It calls the closure through a pointer, so that it is compiled once for each
//! type of result instead of once for each caller.

use rayon::prelude::*;

/// The results of `each` for the indices below `count`, in their order.
pub(crate) fn map<T: Send>(count: usize, each: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    (0..count).into_par_iter().map(each).collect()
}
