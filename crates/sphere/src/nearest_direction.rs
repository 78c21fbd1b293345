//! The nearest of many directions.

use glam::DVec3;

/// Directions by the cells of a cube about the sphere, so that a search looks only at those in cells near its
/// own.
#[derive(Clone, Debug)]
pub struct NearestDirection {
    /// Cells along each axis.
    count: usize,
    /// Where each cell's directions begin, x fastest.
    starts: Vec<usize>,
    /// The directions with their indices, by cell.
    by_cell: Vec<(DVec3, usize)>,
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
        // The edge of a cell is about the distance of neighbours that are spread evenly over the sphere.
        let count = (0.57 * (directions.len() as f64).sqrt()).ceil().max(1.0) as usize;
        let mut index = Self { count, starts: vec![0; count * count * count + 1], by_cell: Vec::new() };
        let cells: Vec<usize> = directions
            .iter()
            .map(|direction| {
                let [x, y, z] = index.cell(*direction);
                (z * count + y) * count + x
            })
            .collect();
        cells.iter().for_each(|cell| index.starts[cell + 1] += 1);
        (1..index.starts.len()).for_each(|cell| index.starts[cell] += index.starts[cell - 1]);
        let mut next = index.starts.clone();
        index.by_cell.resize(directions.len(), (DVec3::ZERO, 0));
        for (number, (direction, cell)) in directions.iter().zip(cells).enumerate() {
            index.by_cell[next[cell]] = (*direction, number);
            next[cell] += 1;
        }
        index
    }

    /// The index of the direction nearest to a unit vector; of equally near ones the last. `None` if there is
    /// none.
    pub fn nearest(&self, direction: DVec3) -> Option<usize> {
        self.nearest_and_cosine(direction).map(|(_, index)| index)
    }

    /// The directions, with their indices, of which one is nearest to a unit vector, for each vector that is
    /// at most `spread` away from this one.
    pub fn candidates(&self, direction: DVec3, spread: f64) -> Vec<(DVec3, usize)> {
        let Some((cosine, _)) = self.nearest_and_cosine(direction) else { return Vec::new() };
        // 1e-4 is more than the rounding of a small distance.
        let distance = (2.0 - 2.0 * cosine).max(0.0).sqrt() + 2.0 * spread + 1e-4;
        let around = (0.5 * distance * self.count as f64).ceil() as usize;
        let mut near = Vec::new();
        self.visit_around(direction, around, |other, index| {
            if (other - direction).length() <= distance {
                near.push((other, index));
            }
        });
        near
    }

    fn nearest_and_cosine(&self, direction: DVec3) -> Option<(f64, usize)> {
        let mut around = 1;
        loop {
            let mut best: Option<(f64, usize)> = None;
            self.visit_around(direction, around, |other, index| {
                let found = (other.dot(direction), index);
                if best.is_none_or(|best| found.0.total_cmp(&best.0).then(found.1.cmp(&best.1)).is_gt()) {
                    best = Some(found);
                }
            });
            // Two directions whose cosine is c are sqrt(2 - 2 c) apart; 1e-9 for rounding.
            let seen = (2 * around) as f64 / self.count as f64;
            let is_near = |(cosine, _): (f64, usize)| 2.0 - 2.0 * cosine + 1e-9 < seen * seen;
            if around >= self.count || best.is_some_and(is_near) {
                return best;
            }
            around *= 2;
        }
    }

    /// Gives a function the directions in a vector's cell and in so many to each side of it.
    fn visit_around(&self, direction: DVec3, around: usize, mut visit: impl FnMut(DVec3, usize)) {
        let [x, y, z] = self
            .cell(direction)
            .map(|cell| (cell.saturating_sub(around), cell.saturating_add(around).min(self.count - 1)));
        for z in z.0..=z.1 {
            for y in y.0..=y.1 {
                let row = (z * self.count + y) * self.count;
                for (other, index) in &self.by_cell[self.starts[row + x.0]..self.starts[row + x.1 + 1]] {
                    visit(*other, *index);
                }
            }
        }
    }

    fn cell(&self, direction: DVec3) -> [usize; 3] {
        let cells = self.count as f64;
        direction.to_array().map(|x| ((0.5 * (x + 1.0) * cells) as usize).min(self.count - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_by_cells_finds_the_nearest_of_all() {
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
            let shift = DVec3::new(0.01, -0.02, 0.005);
            let near = index.candidates((direction + shift).normalize(), 0.03).into_iter();
            let best = near.map(|(other, index)| (index, other.dot(direction)));
            let best = best.max_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
            assert_eq!(best.map(|(index, _)| index), expected);
        }
        assert_eq!(NearestDirection::new(&[]).nearest(DVec3::Z), None);
    }
}
