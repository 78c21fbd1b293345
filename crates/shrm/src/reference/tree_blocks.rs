//! An environment as blocks of blocks: from a few over the whole sphere to parts of its texels.
//!
//! A texel has one radiance all over its area, as in [`super::Sampled`] and in the preview. So a part of a
//! texel has its radiance and its own solid angle, and texels can be divided as finely as a lobe needs it.

use std::borrow::Cow;
use std::f64::consts::{PI, TAU};

use envmap::Environment;
use rayon::prelude::*;
use sphere::{DVec3, Direction};

/// Rows of the finest level that is kept. Finer blocks are made when they are asked for.
const ROWS: usize = 1024;

/// Rows of the coarsest level, at most.
const COARSEST: usize = 4;

/// How many times a texel is halved, at most: parts of one row of 8 are then 4e-7 radians.
const HALVINGS: i32 = 20;

/// The size and place of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TreePlace {
    /// The binary logarithm of the block's edge in texels: below 0, it is a part of a texel.
    pub(super) size: i32,
    row: usize,
    column: usize,
}

/// Light that comes from one block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TreeBlock {
    /// Radiance times solid angle.
    flux: [f32; 3],
    /// The mean direction, of length 1 or less: the shorter, the wider the light is spread.
    direction: [f32; 3],
}

/// All blocks of an environment.
#[derive(Debug)]
pub(super) struct TreeBlocks<'a> {
    environment: Cow<'a, Environment>,
    /// The size of the finest blocks that are kept.
    finest: i32,
    /// The blocks of each size from `finest` on.
    kept: Vec<Vec<TreeBlock>>,
}

impl TreePlace {
    /// Whether the block consists of whole texels.
    pub(super) fn is_of_texels(self) -> bool {
        self.size > 0
    }
}

impl TreeBlock {
    fn of(parts: impl Iterator<Item = ([f64; 3], DVec3)>) -> Self {
        let (mut flux, mut weighted, mut weights) = ([0.0; 3], DVec3::ZERO, 0.0);
        for (own, direction) in parts {
            (0..3).for_each(|channel| flux[channel] += own[channel]);
            let weight = own.iter().map(|value| value.abs()).sum::<f64>();
            weighted += direction * weight;
            weights += weight;
        }
        let direction = if weights > 0.0 { weighted / weights } else { DVec3::ZERO };
        Self { flux: flux.map(|value| value as f32), direction: direction.as_vec3().to_array() }
    }

    pub(super) fn direction(&self) -> DVec3 {
        DVec3::from_array(self.direction.map(f64::from))
    }

    pub(super) fn flux(&self) -> [f64; 3] {
        self.flux.map(f64::from)
    }

    pub(super) fn is_dark(&self) -> bool {
        self.flux == [0.0; 3]
    }
}

impl<'a> TreeBlocks<'a> {
    pub(super) fn new(environment: Cow<'a, Environment>) -> Self {
        let mut finest = 0;
        while environment.grid().height.div_ceil(1 << finest) > ROWS {
            finest += 1;
        }
        let mut blocks = Self { environment, finest, kept: Vec::new() };
        loop {
            let size = finest + blocks.kept.len() as i32;
            let [height, width] = blocks.shape(size);
            let place = |index: usize| TreePlace { size, row: index / width, column: index % width };
            let made = |index: usize| blocks.made(place(index));
            let level = (0..width * height).into_par_iter().map(made).collect();
            blocks.kept.push(level);
            if height <= COARSEST {
                return blocks;
            }
        }
    }

    /// The number of rows and columns of the blocks of a size.
    fn shape(&self, size: i32) -> [usize; 2] {
        let grid = self.environment.grid();
        [grid.height, grid.width].map(|texels| match size {
            0.. => texels.div_ceil(1 << size),
            _ => texels << -size,
        })
    }

    /// The coarsest blocks.
    pub(super) fn coarsest(&self) -> impl Iterator<Item = TreePlace> + use<> {
        let size = self.finest + self.kept.len() as i32 - 1;
        let [height, width] = self.shape(size);
        (0..height * width).map(move |index| TreePlace { size, row: index / width, column: index % width })
    }

    /// The four or fewer blocks of which a block consists, at the end of a row or a column fewer.
    pub(super) fn parts(&self, place: TreePlace) -> impl Iterator<Item = TreePlace> + use<> {
        let size = place.size - 1;
        let [height, width] = self.shape(size);
        let (row, column) = (2 * place.row, 2 * place.column);
        (row..(row + 2).min(height)).flat_map(move |row| {
            (column..(column + 2).min(width)).map(move |column| TreePlace { size, row, column })
        })
    }

    /// Whether a block can be divided.
    pub(super) fn has_parts(&self, place: TreePlace) -> bool {
        place.size > -HALVINGS
    }

    /// The height or the width of a block, whichever is more, in radians; at the equator.
    pub(super) fn extent(&self, place: TreePlace) -> f64 {
        let grid = self.environment.grid();
        let texel = (PI / grid.height as f64).max(TAU / grid.width as f64);
        texel * math::powi(2.0, place.size)
    }

    /// Where a direction lies, in texels from the top and from the left.
    pub(super) fn position(&self, direction: Direction) -> [f64; 2] {
        let (column, row) = self.environment.grid().position(direction);
        [row + 0.5, column + 0.5]
    }

    /// Whether a position is in a block.
    pub(super) fn holds(place: TreePlace, position: [f64; 2]) -> bool {
        let edge = math::powi(2.0, place.size);
        (position[0] / edge) as usize == place.row && (position[1] / edge) as usize == place.column
    }

    /// The light of a block.
    pub(super) fn block(&self, place: TreePlace) -> TreeBlock {
        match usize::try_from(place.size - self.finest) {
            Ok(level) => self.kept[level][place.row * self.shape(place.size)[1] + place.column],
            Err(_) => self.made(place),
        }
    }

    /// Makes the light of a block from those below it.
    fn made(&self, place: TreePlace) -> TreeBlock {
        if place.size <= 0 {
            return self.part(place);
        }
        TreeBlock::of(self.parts(place).map(|part| {
            let block = self.block(part);
            (block.flux(), block.direction())
        }))
    }

    /// The light of a texel, or of a part of one, at its middle.
    fn part(&self, place: TreePlace) -> TreeBlock {
        let (environment, halvings) = (&self.environment, -place.size);
        let grid = environment.grid();
        let [height, width] = self.shape(place.size);
        let radiance =
            environment.pixels()[(place.row >> halvings) * grid.width + (place.column >> halvings)];
        let middle = |index: usize, count: usize| (index as f64 + 0.5) / count as f64;
        let (sine, cosine) = math::sin_cos(PI * middle(place.row, height));
        let (y, x) = math::sin_cos(TAU * (0.5 - middle(place.column, width)));
        // cos(a) - cos(b) without cancellation.
        let across = 2.0 * sine * math::sin(0.5 * PI / height as f64);
        let flux = radiance.map(|value| f64::from(value) * across * TAU / width as f64);
        TreeBlock::of(std::iter::once((flux, DVec3::new(sine * x, sine * y, cosine))))
    }
}

#[cfg(test)]
mod tests {
    use sphere::LatLong;

    use super::*;

    fn blocks(grid: LatLong) -> TreeBlocks<'static> {
        let pixels = (0..grid.len()).map(|i| [1.0, (i % 5) as f32, (i % 7) as f32]).collect();
        TreeBlocks::new(Cow::Owned(Environment::new(grid, pixels).unwrap()))
    }

    #[test]
    fn the_parts_of_a_block_have_its_light_and_lie_in_it() {
        for grid in [LatLong { width: 14, height: 9 }, LatLong { width: 8, height: 2 * ROWS + 3 }] {
            let blocks = blocks(grid);
            let flux: f64 = blocks.coarsest().map(|place| blocks.block(place).flux()[0]).sum();
            assert!((flux - 4.0 * PI).abs() < 1e-4, "{flux}");
            let mut places: Vec<TreePlace> = blocks.coarsest().collect();
            for _ in 0..16 {
                let place = places[places.len() / 3];
                let parts: Vec<TreePlace> = blocks.parts(place).collect();
                let [whole, sum] = [vec![place], parts.clone()]
                    .map(|places| places.iter().map(|place| blocks.block(*place).flux()[1]).sum::<f64>());
                assert!((whole - sum).abs() <= 1e-6 * whole, "{place:?}: {whole} {sum}");
                for part in &parts {
                    let block = blocks.block(*part);
                    if part.size <= 0 && !block.is_dark() {
                        let position = blocks.position(Direction::normalised(block.direction()));
                        assert!(TreeBlocks::holds(place, position), "{place:?}");
                    }
                }
                places = parts;
            }
        }
    }
}
