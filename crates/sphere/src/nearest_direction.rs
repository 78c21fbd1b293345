//! The nearest of many directions.

use glam::DVec3;

/// Directions by height, so that a search looks only at those near the height of its own.
#[derive(Clone, Debug)]
pub struct NearestDirection {
    /// The directions with their indices, the lowest first.
    by_height: Vec<(DVec3, usize)>,
}

impl NearestDirection {
    /// Unit vectors, in any order.
    ///
    /// # Example: the pole is nearest to what looks upward
    /// ```
    /// use sphere::{DVec3, NearestDirection};
    /// let axes = NearestDirection::new(&[DVec3::X, DVec3::Z, DVec3::Y]);
    /// assert_eq!(axes.nearest(DVec3::new(0.6, 0.0, 0.8)), Some(1));
    /// ```
    pub fn new(directions: &[DVec3]) -> Self {
        let mut by_height: Vec<_> =
            directions.iter().enumerate().map(|(index, direction)| (*direction, index)).collect();
        by_height.sort_by(|a, b| a.0.z.total_cmp(&b.0.z));
        Self { by_height }
    }

    /// The index of the direction nearest to a unit vector; of equally near ones the last. `None` if there is
    /// none.
    pub fn nearest(&self, direction: DVec3) -> Option<usize> {
        let middle = self.by_height.partition_point(|(other, _)| other.z < direction.z);
        let (below, above) = self.by_height.split_at(middle);
        let mut best: Option<(f64, usize)> = None;
        let mut search = |(other, index): &(DVec3, usize)| {
            // Two directions whose cosine is c are sqrt(2 - 2 c) apart, in height at most; 1e-9 for rounding.
            let apart = other.z - direction.z;
            if best.is_some_and(|(cosine, _)| apart * apart > 2.0 - 2.0 * cosine + 1e-9) {
                return false;
            }
            let found = (other.dot(direction), *index);
            if best.is_none_or(|best| (found.0.total_cmp(&best.0)).then(found.1.cmp(&best.1)).is_gt()) {
                best = Some(found);
            }
            true
        };
        let _ = below.iter().rev().all(&mut search);
        let _ = above.iter().all(&mut search);
        best.map(|(_, index)| index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_by_height_finds_the_nearest_of_all() {
        let direction = |k: usize| {
            let k = k as f64;
            DVec3::new((1.7 * k).sin(), (2.3 * k + 1.0).cos(), (3.1 * k + 0.5).sin()).normalize()
        };
        let mut all: Vec<DVec3> = (0..200).map(direction).collect();
        // Of equal ones the last counts.
        all.extend_from_within(..20);
        let index = NearestDirection::new(&all);
        for direction in (0..2000).map(|k| direction(k + 1000)).chain(all.iter().copied()) {
            let cosines = all.iter().map(|other| other.dot(direction)).enumerate();
            let expected = cosines.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index);
            assert_eq!(index.nearest(direction), expected);
        }
        assert_eq!(NearestDirection::new(&[]).nearest(DVec3::Z), None);
    }
}
