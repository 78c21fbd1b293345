//! The points of a lat-long image under the texels of a cube, without an arc tangent for each.
//!
//! The coordinates of the image are almost linear across a texel of the cube, so they are computed at the
//! corners of the texels and interpolated between them. On a face about the horizon that is off by no more
//! than an eighth of the squared texel, 1e-5 rad for faces of 256; toward a pole, at a distance of n texels,
//! by 1 / (8 n) of a texel, so that points near the pole are computed one by one.
//!
//! The four faces about the horizon differ by quarter turns, and the lower polar face is the upper one upside
//! down: the points of one texel serve all four or both. Their tables are symmetric and hold a quarter of a
//! face.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use rayon::prelude::*;
use sh::{Stop, Stopped};
use sphere::{Cube, Face, LatLong};

use crate::bright_texels::BrightTexels;
use crate::canvas::{Canvas, CubeCanvas, MOST_POINTS};
use crate::pixels::Pixels;
use crate::resample::{Points, by_taps};
use crate::texels::{Taps, Texels};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 2;

/// Texels around a pole whose points are computed one by one.
const NEAR_POLE: usize = 8;

/// The number of points along the side of a square texel of the image.
const PER_TEXEL: f64 = 2.0;

/// A lat-long image under a cube.
pub(crate) struct LatLongOnCube {
    picture: LatLong,
    canvas: CubeCanvas,
    edge: usize,
    /// The column of the corners of a face about the horizon, left to right: 0 in the middle.
    columns: Vec<f64>,
    /// The corners of the upper left quarter of a face.
    quarter: Vec<QuarterCorner>,
}

#[derive(Clone, Copy)]
struct QuarterCorner {
    /// The row on a face about the horizon.
    row: f64,
    /// The row on the upper polar face.
    polar_row: f64,
    /// The column on the upper polar face, between 0 toward the top of the face and a quarter of the image.
    polar_column: f64,
    /// The solid angle per area of the face.
    density: f64,
}

/// Faces whose texels have the same points, but for a turn or a reflection.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Horizon,
    Polar,
}

impl Kind {
    fn of(face: Face) -> Self {
        if matches!(face, Face::PositiveY | Face::NegativeY) { Self::Polar } else { Self::Horizon }
    }
}

/// The numbers that are interpolated over a texel: column, row, density.
type Corner = [f64; 3];

impl LatLongOnCube {
    pub(crate) fn new(picture: LatLong, cube: Cube) -> Self {
        let edge = cube.edge;
        let at = |corner: usize| 2.0 * corner as f64 / edge as f64 - 1.0;
        let (width, height) = (picture.width as f64, picture.height as f64);
        let side = edge / 2 + 1;
        let corner = |index: usize| {
            let (s, t) = (at(index % side), at(index / side));
            let squared = 1.0 + s * s + t * t;
            QuarterCorner {
                row: math::atan2((1.0 + s * s).sqrt(), -t) / PI * height,
                polar_row: math::atan((s * s + t * t).sqrt()) / PI * height,
                polar_column: math::atan2(-s, -t) / TAU * width,
                density: 1.0 / (squared * squared.sqrt()),
            }
        };
        Self {
            picture,
            canvas: CubeCanvas(cube),
            edge,
            columns: (0..=edge).map(|corner| math::atan(at(corner)) / TAU * width).collect(),
            quarter: (0..side * side).into_par_iter().with_min_len(256).map(corner).collect(),
        }
    }

    /// A corner of the texels of the upper polar face or of the face about the middle column, in coordinates
    /// of the picture from the middle column and from its upper side.
    fn corner(&self, kind: Kind, row: usize, column: usize) -> Corner {
        let (width, height) = (self.picture.width as f64, self.picture.height as f64);
        let (left, top) = (column.min(self.edge - column), row.min(self.edge - row));
        let quarter = &self.quarter[top * (self.edge / 2 + 1) + left];
        match kind {
            Kind::Horizon => {
                let y = if row == top { quarter.row } else { height - quarter.row };
                [self.columns[column], y, quarter.density]
            }
            Kind::Polar => {
                // The top of the face is a half turn from the middle column, its bottom is there.
                let from_top =
                    if row == top { 0.5 * width - quarter.polar_column } else { quarter.polar_column };
                let x = if column == left { -from_top } else { from_top };
                [x, quarter.polar_row, quarter.density]
            }
        }
    }

    /// The corners of a texel, from its row of upper and its row of lower corners, in the order (left, top),
    /// (right, top), (left, bottom), (right, bottom). All are on the same side of the seam.
    fn corners(&self, upper: &[Corner], lower: &[Corner]) -> [Corner; 4] {
        let mut corners = [upper[0], upper[1], lower[0], lower[1]];
        let (width, first) = (self.picture.width as f64, corners[0][0]);
        for corner in &mut corners[1..] {
            if corner[0] - first > 0.5 * width {
                corner[0] -= width;
            } else if first - corner[0] > 0.5 * width {
                corner[0] += width;
            }
        }
        corners
    }

    /// Whether the points of a texel are computed one by one.
    fn is_near_pole(&self, kind: Kind, row: usize, column: usize) -> bool {
        let from_middle = |k: usize| (2 * k + 1).abs_diff(self.edge);
        kind == Kind::Polar && from_middle(row).max(from_middle(column)) < 2 * NEAR_POLE
    }

    /// A row of texels of one kind of face: its upper corners and its lower ones.
    fn corner_rows(&self, kind: Kind, row: usize) -> [Vec<Corner>; 2] {
        [row, row + 1].map(|row| (0..=self.edge).map(|column| self.corner(kind, row, column)).collect())
    }

    /// Each row of each face with its place in `rows`, in groups whose texels have the same points.
    fn groups<T>(&self, rows: impl Iterator<Item = T>) -> Vec<Group<T>> {
        let kinds = [Kind::Horizon, Kind::Polar];
        let mut groups: Vec<_> = kinds
            .into_iter()
            .flat_map(|kind| (0..self.edge).map(move |row| Group { kind, row, faces: Vec::with_capacity(4) }))
            .collect();
        for (index, of_row) in rows.enumerate() {
            let (face, row) = (Face::ALL[index / self.edge], index % self.edge);
            let place = Place::new(self.picture, face, index);
            let shared = if place.is_lower { self.edge - 1 - row } else { row };
            groups[if Kind::of(face) == Kind::Polar { self.edge } else { 0 } + shared]
                .faces
                .push((place, of_row));
        }
        groups
    }
}

/// A row of texels of several faces that have the same points.
struct Group<T> {
    kind: Kind,
    /// On the upper of polar faces.
    row: usize,
    faces: Vec<(Place, T)>,
}

/// Where a face has the points that it shares with others.
#[derive(Clone, Copy)]
struct Place {
    /// The row of the cube.
    row: usize,
    /// The picture's column, of a whole number of turns more, that is the face's column 0, and what is left.
    column: usize,
    fraction: f64,
    /// Whether the face is the polar one upside down.
    is_lower: bool,
}

impl Place {
    fn new(picture: LatLong, face: Face, row: usize) -> Self {
        // The azimuth of the middle is 0, -90, 90 or 180 degrees; columns count against it from the middle.
        let middle = match face {
            Face::PositiveX => 0.75,
            Face::NegativeX => 0.25,
            Face::PositiveZ | Face::PositiveY | Face::NegativeY => 0.5,
            Face::NegativeZ => 0.0,
        };
        // Two turns more than that, so that no column is negative; a texel's centre is at a whole number.
        let column = (middle + 2.0) * picture.width as f64 - 0.5;
        let whole = column as usize;
        Self { row, column: whole, fraction: column - whole as f64, is_lower: face == Face::NegativeY }
    }
}

/// The taps of a texel, the same on several faces.
#[derive(Default)]
struct Shared {
    /// The fraction of a column that their columns have been moved by.
    fraction: f64,
    /// The first and last column and row among the taps; columns without [`Place::column`].
    columns: [isize; 2],
    rows: [isize; 2],
    /// The weights of all pixels between these.
    weights: Vec<f64>,
    taps: Vec<Tap>,
    /// The number of points.
    points: usize,
}

/// A pixel with a weight.
struct Tap {
    /// From the first column and row among all.
    column: u32,
    row: u32,
    /// The sum over points of the solid angle per area of the face.
    weight: f64,
    /// The tap's part of the weights of all taps up to it.
    share: f32,
}

/// The first and last column and row of a part of a picture.
#[derive(Clone, Copy)]
struct Window {
    columns: [usize; 2],
    rows: [usize; 2],
    is_upside_down: bool,
}

impl Window {
    fn pixel(&self, tap: &Tap, width: usize) -> usize {
        let row = tap.row as usize;
        let row = if self.is_upside_down { self.rows[1] - row } else { self.rows[0] + row };
        row * width + self.columns[0] + tap.column as usize
    }

    /// The window of what is left of the picture if rows are taken from its top.
    fn below(self, rows: usize) -> Self {
        Self { rows: self.rows.map(|row| row - rows), ..self }
    }
}

impl Shared {
    /// The taps of a texel on a face whose columns are a fraction off: only where they are.
    fn bounds(&mut self, corners: &[Corner; 4], fraction: f64) {
        // Truncation rounds down what is not negative. What this rounds to the next whole number is on it.
        const MORE: f64 = 1_073_741_824.0;
        let span = |axis: usize, by: f64| {
            let of = corners.map(|corner| corner[axis] + by + MORE);
            let (least, most) = (of.into_iter().fold(f64::MAX, f64::min), of.into_iter().fold(0.0, f64::max));
            [least, most].map(|value| value as isize - MORE as isize)
        };
        let ([left, right], [top, bottom]) = (span(0, fraction), span(1, -0.5));
        (self.columns, self.rows) = ([left, right + 1], [top, bottom + 1]);
        self.fraction = fraction;
        self.taps.clear();
    }

    /// Adds the taps of the points between the corners.
    fn fill(&mut self, corners: &[Corner; 4]) {
        let first = [self.columns[0] as f64 - self.fraction, self.rows[0] as f64 + 0.5];
        let [width, height] = [self.columns, self.rows].map(|[first, last]| (last - first + 1) as usize);
        let points = points_between(corners);
        self.points = points * points;
        self.weights.clear();
        self.weights.resize(width * height, 0.0);
        between(corners, points, |[x, y, density]| {
            let (x, y) = ((x - first[0]).max(0.0), (y - first[1]).max(0.0));
            let (column, row) = (x as u32, y as u32);
            let (right, lower) = (x - f64::from(column), density * (y - f64::from(row)));
            let at = row as usize * width + column as usize;
            for (at, weight) in [(at, density - lower), (at + width, lower)] {
                self.weights[at] += weight * (1.0 - right);
                self.weights[at + 1] += weight * right;
            }
        });
        let mut total = 0.0;
        for (row, weights) in self.weights.chunks_exact(width).enumerate() {
            for (column, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
                total += weight;
                let share = (weight / total) as f32;
                self.taps.push(Tap { column: column as u32, row: row as u32, weight: *weight, share });
            }
        }
    }

    /// The part of the picture with the taps on a face; `None` if a seam or a pole is between them.
    fn inside(&self, picture: LatLong, place: &Place) -> Option<Window> {
        let (width, height) = (picture.width as isize, picture.height as isize);
        let [[left, right], [top, bottom]] = [self.columns, self.rows];
        let first = (left + place.column as isize).rem_euclid(width);
        let last = first + right - left;
        let rows = if place.is_lower { [height - 1 - bottom, height - 1 - top] } else { [top, bottom] };
        // What follows a pixel is loaded with it, so that the last one is not inside.
        (last < width && rows[0] >= 0 && rows[1] < height - 1).then(|| Window {
            columns: [first as usize, last as usize],
            rows: rows.map(|row| row as usize),
            is_upside_down: place.is_lower,
        })
    }

    /// The first and last row with all taps, on any texel of an upper face.
    fn rows_within(&self, picture: LatLong, is_near_pole: bool) -> [usize; 2] {
        let last = picture.height as isize - 1;
        let [top, bottom] = self.rows.map(|row| row.clamp(0, last) as usize);
        [if is_near_pole { 0 } else { top }, bottom]
    }

    /// A part of the picture with all taps, on any texel.
    fn around(&self, picture: LatLong, place: &Place, is_near_pole: bool) -> Window {
        let (last, [top, bottom]) = (picture.height - 1, self.rows_within(picture, is_near_pole));
        let rows = if place.is_lower { [last - bottom, last - top] } else { [top, bottom] };
        Window { columns: [0, picture.width - 1], rows, is_upside_down: place.is_lower }
    }

    /// The mean of a picture over the points, by steps from value to value, so that a constant picture stays
    /// constant to the last bit.
    fn mean(&self, pixels: &[f32], width: usize, window: Window) -> [f32; 3] {
        let mut mean = [0.0; 4];
        for tap in &self.taps {
            // Four values are loaded at once: the last is not of this pixel.
            let value = &pixels[3 * window.pixel(tap, width)..][..4];
            (0..4).for_each(|lane| mean[lane] += tap.share * (value[lane] - mean[lane]));
        }
        let [r, g, b, _] = mean;
        [r, g, b]
    }
}

impl Points for LatLongOnCube {
    type Canvas = CubeCanvas;

    fn canvas(&self) -> &CubeCanvas {
        &self.canvas
    }

    fn visit(&self, row: usize, column: usize, mut visit: impl FnMut(Taps, f64)) {
        let (face, of_face) = (Face::ALL[row / self.edge], row % self.edge);
        let place = Place::new(self.picture, face, row);
        let (kind, of_face) =
            (Kind::of(face), if place.is_lower { self.edge - 1 - of_face } else { of_face });
        if self.is_near_pole(kind, of_face, column) {
            let (centre, extent, _) = self.canvas.extent(row, column);
            let points = PER_TEXEL * extent / self.picture.side(centre, 0.0);
            let points = ((points + 0.5) as usize).clamp(1, MOST_POINTS);
            self.canvas.points(row, column, points, points, |direction, solid_angle| {
                visit(self.picture.taps(direction), solid_angle);
            });
            return;
        }
        let of_row = |row: usize| [column, column + 1].map(|column| self.corner(kind, row, column));
        let [above, below] = [of_face, of_face + 1].map(of_row);
        let [top, bottom] = if place.is_lower { [below, above] } else { [above, below] };
        let corners = self.corners(&top, &bottom);
        let (width, height) = (self.picture.width as f64, self.picture.height as f64);
        let turn = (corners[0][0] + place.column as f64) / width;
        let shift = place.column as f64 + place.fraction - turn.floor() * width;
        let points = points_between(&corners);
        let area = 4.0 / ((self.edge * self.edge * points * points) as f64);
        between(&corners, points, |[x, y, density]| {
            let y = if place.is_lower { height - y } else { y };
            visit(Taps::of_lat_long(self.picture, x + shift, y - 0.5), area * density);
        });
    }

    fn give_to(&self, bright: &BrightTexels, stop: Stop<'_>) -> Result<(), Stopped> {
        let area = 4.0 / (self.edge * self.edge) as f64;
        let give = |shared: &mut Shared, Group { kind, row, faces }: Group<()>| {
            stop.check()?;
            let [upper, lower] = self.corner_rows(kind, row);
            for column in 0..self.edge {
                let is_near_pole = self.is_near_pole(kind, row, column);
                let corners = self.corners(&upper[column..], &lower[column..]);
                for (i, (place, ())) in faces.iter().enumerate() {
                    if i == 0 || place.fraction != shared.fraction {
                        shared.bounds(&corners, place.fraction);
                    }
                    let inside = shared.inside(self.picture, place).filter(|_| !is_near_pole);
                    let around = inside.unwrap_or_else(|| shared.around(self.picture, place, is_near_pole));
                    if !bright.is_within(around.columns, around.rows) {
                        continue;
                    }
                    let Some(window) = inside else {
                        self.visit(place.row, column, |taps, solid_angle| {
                            bright.give_taps(taps, solid_angle)
                        });
                        continue;
                    };
                    if shared.taps.is_empty() {
                        shared.fill(&corners);
                    }
                    let area = area / shared.points as f64;
                    for tap in &shared.taps {
                        bright.give(window.pixel(tap, self.picture.width), area * tap.weight);
                    }
                }
            }
            Ok(())
        };
        let groups = self.groups((0..6 * self.edge).map(|_| ()));
        groups.into_par_iter().map_init(Shared::default, give).collect()
    }

    fn means(&self, pixels: &Pixels, out: &mut [[f32; 3]], stop: Stop<'_>) -> Result<(), Stopped> {
        let (height, rows) = (self.picture.height, pixels.rows_of_band());
        if rows >= height {
            return self.means_in_band(Band { tops: 0..height, pixels: pixels.whole() }, &[], out, stop);
        }
        self.means_by_bands(rows, pixels, out, stop)
    }
}

/// Some rows of a picture, and more of them below for windows that begin there.
struct Band<'a> {
    /// The first rows of the windows.
    tops: Range<usize>,
    pixels: &'a [[f32; 3]],
}

/// The rows that the texels of a group need, in the upper of faces that are upside down.
struct Reach {
    rows: [usize; 2],
    /// The rows between the first and the last of a texel.
    tallest: usize,
}

impl Reach {
    /// Whether rows of a picture of this height are among those of a face, which may be upside down.
    fn meets(&self, rows: &Range<usize>, is_lower: bool, height: usize) -> bool {
        let [first, last] = self.rows;
        let [first, last] = if is_lower { [height - 1 - last, height - 1 - first] } else { [first, last] };
        first < rows.end && rows.start <= last
    }
}

impl LatLongOnCube {
    /// The rows that each of [`LatLongOnCube::groups`] needs.
    fn reach(&self) -> Vec<Reach> {
        let of_group = |shared: &mut Shared, Group { kind, row, .. }: Group<()>| {
            let [upper, lower] = self.corner_rows(kind, row);
            let mut reach = Reach { rows: [usize::MAX, 0], tallest: 0 };
            for column in 0..self.edge {
                shared.bounds(&self.corners(&upper[column..], &lower[column..]), 0.0);
                let [top, bottom] = shared.rows_within(self.picture, self.is_near_pole(kind, row, column));
                reach.rows = [reach.rows[0].min(top), reach.rows[1].max(bottom)];
                reach.tallest = reach.tallest.max(bottom - top);
            }
            reach
        };
        self.groups(std::iter::empty()).into_par_iter().map_init(Shared::default, of_group).collect()
    }

    /// [`Points::means`] with so many rows of the picture at a time.
    fn means_by_bands(
        &self,
        rows: usize,
        pixels: &Pixels,
        out: &mut [[f32; 3]],
        stop: Stop<'_>,
    ) -> Result<(), Stopped> {
        let height = self.picture.height;
        let reach = self.reach();
        let mut scratch = Vec::new();
        for first in (0..height).step_by(rows) {
            let tops = first..(first + rows).min(height);
            let here = reach.iter().filter(|reach| {
                [false, true].map(|is_lower| reach.meets(&tops, is_lower, height)).contains(&true)
            });
            let tallest = here.map(|reach| reach.tallest).max().unwrap_or(0);
            // The last texel's window, and what follows its last pixel.
            let pixels = pixels.band(first..(tops.end + tallest + 1).min(height), &mut scratch);
            self.means_in_band(Band { tops, pixels }, &reach, out, stop)?;
        }
        Ok(())
    }

    /// The means over the texels whose windows begin in a band. `reach` may be empty if all do.
    fn means_in_band(
        &self,
        Band { tops, pixels }: Band<'_>,
        reach: &[Reach],
        out: &mut [[f32; 3]],
        stop: Stop<'_>,
    ) -> Result<(), Stopped> {
        let (LatLong { width, height }, flat) = (self.picture, pixels.as_flattened());
        let pixel = |texel: usize| pixels[texel - tops.start * width];
        let mean = |shared: &mut Shared, (index, group): (usize, Group<&mut [[f32; 3]]>)| {
            stop.check()?;
            let Group { kind, row, mut faces } = group;
            faces.retain(|(place, _)| {
                reach.get(index).is_none_or(|reach| reach.meets(&tops, place.is_lower, height))
            });
            if faces.is_empty() {
                return Ok(());
            }
            let [upper, lower] = self.corner_rows(kind, row);
            for column in 0..self.edge {
                let is_near_pole = self.is_near_pole(kind, row, column);
                let corners = self.corners(&upper[column..], &lower[column..]);
                for (i, (place, texels)) in faces.iter_mut().enumerate() {
                    if i == 0 || place.fraction != shared.fraction {
                        shared.bounds(&corners, place.fraction);
                    }
                    let around = shared.around(self.picture, place, is_near_pole);
                    if !tops.contains(&around.rows[0]) {
                        continue;
                    }
                    let inside = shared.inside(self.picture, place).filter(|_| !is_near_pole);
                    let Some(window) = inside else {
                        texels[column] = by_taps(self, pixel, place.row, column);
                        continue;
                    };
                    if shared.taps.is_empty() {
                        shared.fill(&corners);
                    }
                    texels[column] = shared.mean(flat, width, window.below(tops.start));
                }
            }
            Ok(())
        };
        let groups = self.groups(out.chunks_mut(self.edge));
        groups.into_par_iter().enumerate().map_init(Shared::default, mean).collect()
    }
}

/// The number of points that a texel needs along each side.
fn points_between(corners: &[Corner; 4]) -> usize {
    let diagonal = |from: usize, to: usize| [0, 1].map(|axis| corners[to][axis] - corners[from][axis]);
    let ([a, b], [c, d]) = (diagonal(0, 3), diagonal(1, 2));
    let pixels = 0.5 * (a * d - b * c).abs();
    ((PER_TEXEL * pixels.sqrt() + 0.5) as usize).clamp(1, MOST_POINTS)
}

/// Calls `visit` with the numbers at `points`^2 points spread evenly between four corners.
fn between(corners: &[Corner; 4], points: usize, mut visit: impl FnMut(Corner)) {
    let [top_left, top_right, bottom_left, bottom_right] = corners;
    let step = 1.0 / points as f64;
    let mix = |a: &Corner, b: &Corner, share: f64| -> Corner {
        std::array::from_fn(|k| a[k] + share * (b[k] - a[k]))
    };
    for y in 0..points {
        let t = (y as f64 + 0.5) * step;
        let (left, right) = (mix(top_left, bottom_left, t), mix(top_right, bottom_right, t));
        for x in 0..points {
            visit(mix(&left, &right, (x as f64 + 0.5) * step));
        }
    }
}

#[cfg(test)]
mod tests;
