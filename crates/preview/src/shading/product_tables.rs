//! Tables from which a device draws directions in proportion to light times material, one for each cell of
//! normals.
//!
//! The sphere of light is divided into blocks of texels. A cell's table is the distribution of the light's
//! energy in the blocks times the lobe toward the viewer, turned into the frame of the cell's normal
//! (Jarosz, Carr and Jensen 2009). The lobe is the positive part of the series of rho_hat, of degree
//! `DEGREE`, and a uniform share; it is read at the mean direction of the light in a block, so that a sun is
//! where it is. Which texel of a block is drawn depends on the light alone: [`super::product_samples`].
//!
//! The tables of a view are made by a pass on the device. What does not depend on the view is made before:
//! the lobe in the frame of a normal at `ANGLES` angles of the view, and the blocks.
//!
//! The cells are squares of Lambert's equal-area disc of the normals about the direction toward a distant
//! viewer. Eyes are not distant, so a pixel takes the cell in which that viewer sees the same central
//! direction. All this only changes the noise: the density that is given is the one that is drawn.
//!
//! The numbers of the buffer:
//!
//! | count | contents |
//! | --- | --- |
//! | 4 | 1 if there are tables; the rows R and columns C of blocks; 1 if lobes are about the reflection |
//! | 8 | the axes toward the viewer and to the right; the rows H of texels; 0 |
//! | ANGLES SIDE^2 | per angle: the lobe over the directions of an octahedron |
//! | 4 R C | per block: the mean direction of its light, and its share of all light |
//! | C (H + R) | per column and row of blocks: the distribution of the block's rows of texels, and its end |
//! | CELLS^2 (R + 1 + R (C + 1)) | per cell: the distribution of rows of blocks; per row, of its blocks |

use std::f64::consts::{FRAC_PI_2, FRAC_PI_6, PI};
use std::sync::Arc;

use brdf::{BrdfCoefficients, Centre};
use glam::{Vec2, Vec3};
use sampling::{SUM, weigh};
use sh::{Basis, Degree};
use sphere::{Direction, spiral};

use super::angles::angle;
use super::light_samples::LightSamples;
use super::shader_constants::shader_constants;
use super::surface::{Surface, across};
use crate::Look;

shader_constants!("PRODUCT_TABLES_":
    /// The most rows and columns of blocks.
    ROWS: u32 = 32;
    COLUMNS: u32 = 64;
    /// The angles between normal and view, from 0 to a right angle, at which a lobe is known.
    ANGLES: u32 = 24;
    /// The texels along the side of a lobe.
    SIDE: u32 = 48;
    /// The cells of normals along the side of the disc.
    pub(crate) CELLS: u32 = 40;
    /// The first numbers of the buffer.
    pub(crate) HEADER: u32 = 12;
);

/// The highest degrees of the series.
const DEGREE: usize = 19;
const VIEW_DEGREE: usize = 16;

/// The share of a lobe's energy that its series must hold.
const HELD: f64 = 0.95;

/// The share of the series' density that is uniform, for what the series lacks of the material.
pub(crate) const UNIFORM: f32 = 0.02;

/// The constants of the shaders that read or make tables.
pub fn constants() -> &'static str {
    WGSL_CONSTANTS
}

/// The text of the shader: its constants and product_tables.wgsl.
pub fn shader() -> String {
    [WGSL_CONSTANTS, include_str!("product_tables.wgsl")].concat()
}

/// The series of a look's reflection, as far as samples of the product need it; `None` if it is not known,
/// depends on the tangent, or does not hold the lobe, which is then sampled better by its own shape.
pub(crate) fn held_series(look: &Look) -> Option<BrdfCoefficients> {
    let series = look.reflection()?.brdf();
    if series.centre() == Centre::Tangent || !is_held(look, series) {
        return None;
    }
    let most = |degree: Degree, most: usize| Some(degree.min(Degree::new(most).ok()?));
    Some(series.cut_to(most(series.f(), DEGREE)?, most(series.p(), VIEW_DEGREE)?))
}

/// The share of the lobe's energy, seen 30 degrees from the normal, that the degrees up to `DEGREE` hold:
/// by its values all around, not by the series, which may have been cut for a soft light.
fn is_held(look: &Look, series: &BrdfCoefficients) -> bool {
    const DIRECTIONS: usize = 8192;
    let Some(material) = look.material() else { return false };
    let view = Direction::from_angles(FRAC_PI_6, 0.0);
    let square = |rgb: [f64; 3]| rgb.iter().map(|value| value * value).sum::<f64>();
    let whole = (0..DIRECTIONS).map(|index| square(material.rho_hat(spiral(index, DIRECTIONS), view)));
    let whole = whole.sum::<f64>() * 4.0 * PI / DIRECTIONS as f64;
    let lobe = series.at_view(Direction::Z, Direction::X, view);
    let rows = (DEGREE + 1) * (DEGREE + 1);
    let held: f64 = lobe.coefficients().iter().take(rows).map(|rgb| square(*rgb)).sum();
    held >= HELD * whole
}

/// What the tables of all views of a look share.
#[derive(Debug)]
pub struct ProductTables {
    light: Arc<LightSamples>,
    is_reflected: bool,
    /// The rows and columns of blocks.
    blocks: [usize; 2],
    /// All numbers but the header and the cells.
    fixed: Vec<f32>,
}

/// The directions that a cell's normal is described by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewAxes {
    right: Vec3,
    up: Vec3,
    toward: Vec3,
}

impl ViewAxes {
    /// The axes of a distant viewer, whose direction is a unit vector in the light's frame.
    pub fn new(toward: Vec3) -> Self {
        let right = across(toward);
        Self { right, up: toward.cross(right), toward }
    }
}

impl ProductTables {
    /// Prepares a look; `None` if its light is black, or if its series is not known, depends on the tangent,
    /// or does not hold the lobe.
    pub fn new(look: &Look) -> Option<Self> {
        let light = look.light().samples();
        let series = held_series(look).filter(|_| light.is_lit())?;
        let mut fixed = lobes(&series);
        let blocks = blocks(light.size());
        push_blocks(light, blocks, &mut fixed);
        let is_reflected = series.centre() == Centre::Reflection;
        Some(Self { light: Arc::clone(light), is_reflected, blocks, fixed })
    }

    /// The light.
    pub fn light(&self) -> &LightSamples {
        &self.light
    }

    /// The first numbers of the buffer, which depend on the view.
    pub fn header(&self, axes: ViewAxes) -> [f32; HEADER as usize] {
        let [rows, columns] = self.blocks.map(|count| count as f32);
        let ([x, y, z], [a, b, c]) = (axes.toward.to_array(), axes.right.to_array());
        let [_, height] = self.light.size();
        [1.0, rows, columns, f32::from(self.is_reflected), x, y, z, a, b, c, height as f32, 0.0]
    }

    /// The numbers after the header that do not depend on the view.
    pub fn fixed(&self) -> &[f32] {
        &self.fixed
    }

    /// The rows and columns of blocks.
    pub(crate) fn blocks(&self) -> [usize; 2] {
        self.blocks
    }

    /// How many numbers the buffer has: 14 MB with the most blocks.
    pub fn count(&self) -> usize {
        HEADER as usize + self.fixed.len() + (CELLS * CELLS) as usize * self.stride()
    }

    /// The numbers of a cell.
    pub(crate) fn stride(&self) -> usize {
        let [rows, columns] = self.blocks;
        rows + 1 + rows * (columns + 1)
    }

    /// The distribution of the rows of texels in a block, from a row on.
    pub(crate) fn texel_rows(&self, [row, column]: [usize; 2], texel_row: usize) -> &[f32] {
        let ([rows, columns], [_, height]) = (self.blocks, self.light.size());
        let first = (ANGLES * SIDE * SIDE) as usize + 4 * rows * columns;
        &self.fixed[first + column * (height + rows) + texel_row + row..]
    }

    /// The cell of a surface.
    pub(crate) fn cell(&self, axes: ViewAxes, surface: &Surface) -> usize {
        let normal = match self.is_reflected {
            true => surface.central(Centre::Reflection) + axes.toward,
            false => surface.normal,
        };
        let (x, y, z) = (normal.dot(axes.right), normal.dot(axes.up), normal.dot(axes.toward));
        let length = Vec3::new(x, y, z).length();
        let level = 0.5 / (length * (length + z.max(0.0))).max(1e-20).sqrt();
        let place = |along: f32| (((along * level + 0.5) * CELLS as f32) as usize).min(CELLS as usize - 1);
        place(y) * CELLS as usize + place(x)
    }

    /// The table of a cell. A device makes only those of cells that touch the disc.
    pub fn table(&self, axes: ViewAxes, cell: usize) -> Vec<f32> {
        let [rows, columns] = self.blocks;
        let frame = CellFrame::new(axes, cell);
        let mut table = vec![0.0; self.stride()];
        let (of_rows, blocks) = table.split_at_mut(rows + 1);
        for (row, sums) in blocks.chunks_exact_mut(columns + 1).enumerate() {
            let mut sum = 0.0;
            for column in 0..columns {
                sum += self.mass(frame, row * columns + column);
                sums[column + 1] = sum;
            }
            of_rows[row + 1] = of_rows[row] + sum;
            scale(sums);
        }
        scale(of_rows);
        table
    }

    /// The light in a block times the lobe of a cell.
    fn mass(&self, frame: CellFrame, block: usize) -> f32 {
        let at = (ANGLES * SIDE * SIDE) as usize + 4 * block;
        let direction = Vec3::from_slice(&self.fixed[at..at + 3]);
        let [x, y, z] = [frame.tangent, frame.side, frame.normal].map(|axis| direction.dot(axis));
        let local = Vec3::new(x, y, z);
        self.fixed[at + 3] * self.fixed[(frame.angle * SIDE * SIDE) as usize + octahedron_place(local)]
    }
}

/// The frame of a cell's normal, whose tangent is on the viewer's side, and the nearest angle of lobes.
#[derive(Clone, Copy)]
struct CellFrame {
    tangent: Vec3,
    side: Vec3,
    normal: Vec3,
    angle: u32,
}

impl CellFrame {
    fn new(axes: ViewAxes, cell: usize) -> Self {
        let place = |index: usize| (index as f32 + 0.5) * (2.0 / CELLS as f32) - 1.0;
        let at = Vec2::new(place(cell % CELLS as usize), place(cell / CELLS as usize));
        let square = at.dot(at).clamp(1e-6, 1.0);
        let level = (2.0 - square).sqrt();
        let radius = square.sqrt();
        // Along the disc from its middle, the normal turns away from the viewer.
        let outward = (axes.right * at.x + axes.up * at.y) / at.length().max(1e-3);
        let (cosine, sine) = (1.0 - square, radius * level);
        let normal = outward * sine + axes.toward * cosine;
        let tangent = axes.toward * sine - outward * cosine;
        let share = angle(sine, cosine) * (2.0 / std::f32::consts::PI);
        let angle = ((share * ANGLES as f32) as u32).min(ANGLES - 1);
        Self { tangent, side: normal.cross(tangent), normal, angle }
    }
}

/// Divides sums by the last, which becomes 1 exactly, as do those that equal it. Without any mass, only the
/// last is 1.
fn scale(sums: &mut [f32]) {
    let total = sums[sums.len() - 1];
    let last = sums.len() - 1;
    for sum in &mut sums[..last] {
        *sum = if *sum < total {
            *sum / total
        } else if total > 0.0 {
            1.0
        } else {
            0.0
        };
    }
    sums[last] = 1.0;
}

/// The place of the texel of a direction on an octahedron whose lower half is folded outward.
fn octahedron_place(direction: Vec3) -> usize {
    let p = direction / (direction.x.abs() + direction.y.abs() + direction.z.abs());
    let folded = (Vec2::ONE - Vec2::new(p.y, p.x).abs()).copysign(Vec2::new(p.x, p.y));
    let at = if p.z >= 0.0 { Vec2::new(p.x, p.y) } else { folded };
    let place = |along: f32| (((0.5 * along + 0.5) * SIDE as f32) as usize).min(SIDE as usize - 1);
    place(at.y) * SIDE as usize + place(at.x)
}

/// The middle of a texel of the octahedron: |x| + |y| + |z| = 1.
fn octahedron_point(texel: usize) -> [f64; 3] {
    let place = |index: usize| (index as f64 + 0.5) * 2.0 / f64::from(SIDE) - 1.0;
    let (x, y) = (place(texel % SIDE as usize), place(texel / SIDE as usize));
    let z = 1.0 - x.abs() - y.abs();
    if z >= 0.0 { [x, y, z] } else { [(1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y), z] }
}

/// The lobes of the angles: the positive part of the series, whose integral is 1 - [`UNIFORM`], and the
/// uniform share.
fn lobes(series: &BrdfCoefficients) -> Vec<f32> {
    let basis = Basis::new(series.f());
    let texels = (SIDE * SIDE) as usize;
    let seen = (0..ANGLES).map(|index| {
        let view = Direction::from_angles(FRAC_PI_2 * (f64::from(index) + 0.5) / f64::from(ANGLES), 0.0);
        weigh(&series.at_view(Direction::Z, Direction::X, view), SUM)
    });
    let seen: Vec<Vec<f64>> = seen.collect();
    let mut values = vec![0.0; seen.len() * texels];
    let mut integrals = vec![0.0; seen.len()];
    let mut rows = vec![0.0; series.f().rows()];
    // Lobes are the same on both sides of the plane of the view: only half of the rows is evaluated.
    for texel in 0..texels / 2 {
        let point = glam::DVec3::from_array(octahedron_point(texel));
        basis.evaluate_into(Direction::normalised(point), &mut rows);
        let length = point.length();
        let mirrored = texels - SIDE as usize * (texel / SIDE as usize + 1) + texel % SIDE as usize;
        for (angle, lobe) in seen.iter().enumerate() {
            let value: f64 = rows.iter().zip(lobe).map(|(row, coefficient)| row * coefficient).sum();
            let value = value.max(0.0);
            // The solid angle of a texel, and of the mirrored one.
            integrals[angle] += 2.0 * value * 4.0 / texels as f64 / (length * length * length);
            values[angle * texels + texel] = value;
            values[angle * texels + mirrored] = value;
        }
    }
    let uniform = f64::from(UNIFORM) / (4.0 * PI);
    let scaled = values.chunks_exact(texels).zip(integrals).flat_map(|(lobe, integral)| {
        let scale = if integral > 0.0 { (1.0 - f64::from(UNIFORM)) / integral } else { 0.0 };
        lobe.iter().map(move |value| (value * scale + uniform) as f32)
    });
    scaled.collect()
}

/// The rows and columns of blocks of a light of some columns and rows.
fn blocks([width, height]: [usize; 2]) -> [usize; 2] {
    [height.min(ROWS as usize), width.min(COLUMNS as usize)]
}

/// The first texel of a block, of `count` blocks over `texels`.
pub(crate) fn block_start(block: usize, count: usize, texels: usize) -> usize {
    block * texels / count
}

/// The block of a texel.
pub(crate) fn block_of(texel: usize, count: usize, texels: usize) -> usize {
    ((texel + 1) * count - 1) / texels
}

/// Appends the blocks' directions and shares, and the distributions of rows in blocks.
fn push_blocks(light: &LightSamples, blocks: [usize; 2], numbers: &mut Vec<f32>) {
    let ([rows, columns], [width, height]) = (blocks, light.size());
    let around: Vec<[f64; 2]> = (0..width)
        .map(|column| math::sin_cos(2.0 * PI * (0.5 - (column as f64 + 0.5) / width as f64)).into())
        .collect();
    let mut distributions = vec![0.0; columns * (height + rows)];
    for row in 0..rows {
        let [first, end] = [row, row + 1].map(|row| block_start(row, rows, height));
        for column in 0..columns {
            let [left, right] = [column, column + 1].map(|column| block_start(column, columns, width));
            let (mut mean, mut sums) = ([0.0; 3], vec![0.0]);
            let mut mass = 0.0;
            for texel_row in first..end {
                let (sine, cosine) = math::sin_cos(PI * (texel_row as f64 + 0.5) / height as f64);
                // Without light, the middle.
                for texel in left..right {
                    let energy = light.share_between(texel_row, texel..texel + 1) + 1e-30;
                    let [y, x] = around[texel].map(|part| part * sine);
                    (0..3).for_each(|axis| mean[axis] += energy * [x, y, cosine][axis]);
                }
                mass += light.share_between(texel_row, left..right);
                sums.push(mass);
            }
            let direction = Direction::normalised(mean.into()).vector().as_vec3();
            numbers.extend(direction.extend(mass as f32).to_array());
            let at = column * (height + rows) + first + row;
            for (place, sum) in distributions[at..].iter_mut().zip(&sums) {
                *place = if mass > 0.0 { (sum / mass) as f32 } else { 0.0 };
            }
            distributions[at + end - first] = 1.0;
        }
    }
    numbers.append(&mut distributions);
}
