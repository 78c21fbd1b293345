//! One loop over items in parallel. Its body is called through a pointer, so that rayon's part is compiled
//! once instead of once for each caller.

use parking_lot::Mutex;
use rayon::prelude::*;

/// The results of `each` for the indices below `count`, in their order.
pub(crate) fn map<T: Send>(count: usize, each: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    let results = (0..count).map(|_| Mutex::new(None)).collect::<Vec<_>>();
    for_each(count, &|index| *results[index].lock() = Some(each(index)));
    results.into_iter().filter_map(Mutex::into_inner).collect()
}

fn for_each(count: usize, each: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(each);
}
