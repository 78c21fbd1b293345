//! Hierarchical sample warping (Clarberg et al. 2005; Jarosz, Carr and Jensen 2009, JCJ09): points go down a
//! tree of masses, at each node z before phi, and each split eats bits of its uniform.
//!
//! The root is split in phi once, because the grid is twice as wide as high: then nodes have 2 x 2 children
//! down to the cells. The probability is the product of those of the splits, as rounded.

use crate::cell_distribution::{BELOW_ONE, Drawn};

/// Masses on a grid of powers of two, with the sums of 2 x 2 above them.
#[derive(Clone, Debug, Default)]
pub(crate) struct MassTree {
    /// The levels from the two halves of the sphere down to the cells.
    levels: Vec<Vec<f32>>,
}

impl MassTree {
    /// The tree of `rows` x 2 `rows` masses.
    pub(crate) fn new(rows: usize, masses: Vec<f32>) -> Self {
        let mut levels = vec![masses];
        let mut columns = 2 * rows;
        while columns > 2 {
            let fine = &levels[levels.len() - 1];
            let coarse = fine.chunks_exact(2 * columns).flat_map(|pair| {
                let (upper, lower) = pair.split_at(columns);
                let cells = upper.chunks_exact(2).zip(lower.chunks_exact(2));
                cells.map(|(a, b)| (a[0] + a[1]) + (b[0] + b[1]))
            });
            levels.push(coarse.collect());
            columns /= 2;
        }
        levels.reverse();
        Self { levels }
    }

    /// The sum of all masses.
    pub(crate) fn total(&self) -> f32 {
        self.levels[0].iter().sum()
    }

    /// The cells of pairs of uniforms below 1.
    #[inline(always)]
    pub(crate) fn draw(&self, points: &[[f32; 2]], drawn: &mut Drawn) {
        let root = &self.levels[0];
        for (i, [u, v]) in points.iter().enumerate() {
            let (mut u, mut v) = (*u, *v);
            let mut probability = 1.0;
            let mut column = split(root[0], root[1], &mut v, &mut probability);
            let mut row = 0;
            for (depth, level) in self.levels.iter().enumerate().skip(1) {
                let (upper, lower) = children(level, depth, row, column);
                let down = split(upper[0] + upper[1], lower[0] + lower[1], &mut u, &mut probability);
                let pair = if down == 0 { upper } else { lower };
                row = 2 * row + down;
                column = 2 * column + split(pair[0], pair[1], &mut v, &mut probability);
            }
            (drawn.rows[i], drawn.columns[i]) = (row as u32, column as u32);
            (drawn.rest[0][i], drawn.rest[1][i], drawn.probabilities[i]) = (u, v, probability);
        }
    }

    pub(crate) fn probability(&self, row: usize, column: usize) -> f32 {
        let mut probability = 1.0;
        self.ascend(row, column, |_, _, width| probability *= width);
        probability
    }

    /// The uniforms that lead to a place in a cell.
    pub(crate) fn invert(&self, row: usize, column: usize, mut rest: [f32; 2]) -> [f32; 2] {
        self.ascend(row, column, |axis, lower, width| rest[axis] = lower + width * rest[axis]);
        rest.map(|u| u.clamp(0.0, BELOW_ONE))
    }

    /// Calls `f(axis, where the branch begins, its probability)` for every split from the cell up.
    fn ascend(&self, mut row: usize, mut column: usize, mut f: impl FnMut(usize, f32, f32)) {
        let mut branch = |axis: usize, is_second: bool, [first, second]: [f32; 2]| {
            let share = share(first, second);
            if is_second { f(axis, share, 1.0 - share) } else { f(axis, 0.0, share) }
        };
        for (depth, level) in self.levels.iter().enumerate().skip(1).rev() {
            let (upper, lower) = children(level, depth, row / 2, column / 2);
            branch(1, column % 2 == 1, if row % 2 == 1 { lower } else { upper });
            branch(0, row % 2 == 1, [upper[0] + upper[1], lower[0] + lower[1]]);
            (row, column) = (row / 2, column / 2);
        }
        branch(1, column == 1, [self.levels[0][0], self.levels[0][1]]);
    }
}

/// The two rows of a node's children.
#[inline(always)]
fn children(level: &[f32], depth: usize, row: usize, column: usize) -> ([f32; 2], [f32; 2]) {
    let columns = 2usize << depth;
    let upper = 2 * row * columns + 2 * column;
    ([level[upper], level[upper + 1]], [level[upper + columns], level[upper + columns + 1]])
}

/// The probability of the first branch; that of the second is 1 less this, as rounded.
#[inline(always)]
fn share(first: f32, second: f32) -> f32 {
    if first > 0.0 { first / (first + second) } else { 0.0 }
}

/// Chooses the first branch (0) or the second, and keeps the remainder of the uniform.
#[inline(always)]
fn split(first: f32, second: f32, u: &mut f32, probability: &mut f32) -> usize {
    let share = share(first, second);
    let is_second = *u >= share;
    let (lower, width) = if is_second { (share, 1.0 - share) } else { (0.0, share) };
    *u = ((*u - lower) / width).clamp(0.0, BELOW_ONE);
    *probability *= width;
    usize::from(is_second)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splits_follow_masses_and_return() {
        let masses: Vec<f32> = (0..32).map(|k| if k % 5 == 0 { 0.0 } else { (k * 7 % 11) as f32 }).collect();
        let sum: f32 = masses.iter().sum();
        let tree = MassTree::new(4, masses.clone());
        assert_eq!(tree.total(), sum);
        let mut drawn = Drawn::new();
        for i in 0..50 {
            for j in 0..50 {
                let end = |k: i32| if k == 49 { BELOW_ONE } else { k as f32 / 49.0 };
                let u = [end(i), end(j)];
                tree.draw(&[u], &mut drawn);
                let (row, column) = (drawn.rows[0] as usize, drawn.columns[0] as usize);
                let mass = masses[row * 8 + column];
                assert!(mass > 0.0 && (drawn.probabilities[0] - mass / sum).abs() < 1e-6);
                assert!((tree.probability(row, column) / drawn.probabilities[0] - 1.0).abs() < 1e-6);
                let back = tree.invert(row, column, drawn.rest.map(|rest| rest[0]));
                assert!((0..2).all(|k| (back[k] - u[k]).abs() < 2e-6), "{u:?} {back:?}");
            }
        }
    }
}
