//! Values that a file's numbers cannot hold: the share of the light that is lost if they are clamped, or that
//! rounding changes.
//!
//! Half floats end at 65504, and the disc of a photographed sun is brighter. A file whose container has
//! 32-bit floats gets them by itself if it needs them; every other loss is reported in shares of each
//! channel's light, which an artist can judge, and not in numbers of texels.

use std::iter;

use engine::Reporter;
use envmap::{CodedRows, Environment, Image};
use rayon::prelude::*;
use sh::{Stop, Stopped};
use shrm::MapGrid;
use sphere::LatLong;

use super::share::percent;

pub(crate) const LARGEST_HALF: f32 = 65504.0;

/// The least number whose nearest half is not 65504: what is below is rounded as every other value is.
const PAST_HALF: f32 = 65520.0;

/// What the values of a file are, which says how much each counts in the share that clamping loses.
#[derive(Clone, Copy, Debug)]
pub enum Content {
    /// Light from every direction: one map or several on this grid, weighed by solid angle.
    Light(MapGrid),
    /// Coefficients, tables and pictures of part of a sphere, weighed alike.
    Values,
}

/// The values past the largest number of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Excess {
    /// The number of values past that number.
    pub(crate) count: usize,
    /// The largest magnitude.
    pub(crate) largest: f32,
    /// The share of the light of red, green and blue that is lost if they are clamped.
    pub(crate) lost: [f64; 3],
}

impl Excess {
    /// Finds the values of texels past `limit`, of either sign.
    pub(crate) fn of(texels: &[[f32; 3]], content: Content, limit: f32) -> Self {
        let (count, largest) = past_limit(texels, limit);
        if count == 0 {
            return Self { largest, ..Self::default() };
        }
        Self { count, largest, lost: shares(lost_and_all(texels, weights(content).iter().cycle(), limit)) }
    }

    /// [`Excess::of`] of a lat-long image, of which few rows are decoded at a time.
    pub(crate) fn of_rows(environment: &Environment, limit: f32, stop: Stop<'_>) -> Result<Self, Stopped> {
        let found = environment.map_rows(stop, |_, pixels| past_limit(pixels, limit))?;
        let add = |(count, largest): (usize, f32), of_block: (usize, f32)| {
            (count + of_block.0, largest.max(of_block.1))
        };
        let (count, largest) = found.into_iter().fold((0, 0.0), add);
        if count == 0 {
            return Ok(Self { largest, ..Self::default() });
        }
        let grid = environment.grid();
        let sums = environment.map_rows(stop, |first, pixels| {
            let rows = pixels.chunks_exact(grid.width).enumerate();
            let of_row =
                |(row, pixels)| lost_and_all(pixels, iter::repeat(&weight_of_row(grid, first + row)), limit);
            total(rows.map(of_row))
        })?;
        Ok(Self { count, largest, lost: shares(total(sums.into_iter())) })
    }

    /// The excess of a file that also holds other texels: of shares, those of the part that loses more.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            largest: self.largest.max(other.largest),
            lost: [0, 1, 2].map(|channel| self.lost[channel].max(other.lost[channel])),
        }
    }

    /// "the brightest light is clamped: 40.0 % of the red light is lost, 24.0 % of the green".
    pub(crate) fn text(&self, content: Content) -> String {
        let (subject, noun) = match content {
            Content::Light(_) => ("the brightest light is", "light"),
            Content::Values => ("the largest values are", "sum"),
        };
        let shares = self.lost.map(percent);
        if shares[0] == shares[1] && shares[0] == shares[2] {
            return format!("{subject} clamped: {} of the {noun} is lost", shares[0]);
        }
        let channels = ["red", "green", "blue"].into_iter().zip(shares).zip(self.lost);
        let losing: Vec<_> = channels.filter(|(_, lost)| *lost > 0.0).map(|(named, _)| named).collect();
        let named = losing.iter().enumerate().map(|(index, (colour, share))| match index {
            0 => format!("{share} of the {colour} {noun} is lost"),
            _ => format!("{share} of the {colour}"),
        });
        format!("{subject} clamped: {}", named.collect::<Vec<_>>().join(", "))
    }
}

/// The change of a channel's light by rounding above which it is a warning.
const ROUNDED: f64 = 1e-3;

/// The change that rounding makes to the light of red, green and blue, as a share of it: `found` is read
/// back, and values that lie past `limit` or have a sign that the format lacks are not counted.
pub(crate) fn rounded(
    given: &[[f32; 3]],
    found: &[[f32; 3]],
    content: Content,
    limit: f32,
    is_signed: bool,
) -> [f64; 3] {
    shares(change_and_all(given, found, weights(content).iter().cycle(), limit, is_signed))
}

/// What a lat-long image loses in a file.
pub(crate) struct RowsLost {
    /// The RMS difference over texels and channels.
    pub(crate) rms: f64,
    /// What [`rounded`] finds.
    pub(crate) rounded: [f64; 3],
}

impl RowsLost {
    /// Compares a lat-long image with what is read back, of which few rows are decoded at a time.
    pub(crate) fn of(environment: &Environment, found: &Image, limit: f32, is_signed: bool) -> Self {
        let (given, grid) = (environment.to_image(), environment.grid());
        let block = |scratch: &mut [Vec<[f32; 3]>; 2], block: usize| {
            let rows = CodedRows::rows(grid.height, block);
            let [of_given, of_found] = scratch;
            let (given, found) = (given.rows(rows.clone(), of_given), found.rows(rows.clone(), of_found));
            let pairs = given.chunks_exact(grid.width).zip(found.chunks_exact(grid.width));
            let of_row = |(row, (given, found))| {
                change_and_all(given, found, iter::repeat(&weight_of_row(grid, row)), limit, is_signed)
            };
            (squares(given, found), total(rows.zip(pairs).map(of_row)))
        };
        let blocks = (0..CodedRows::count(grid.height)).into_par_iter();
        let blocks: Vec<_> = blocks.map_init(Default::default, block).collect();
        let squares: f64 = blocks.iter().map(|(squares, _)| squares).sum();
        Self {
            rms: (squares / (3 * grid.len()) as f64).sqrt(),
            rounded: shares(total(blocks.into_iter().map(|(_, sums)| sums))),
        }
    }
}

/// The sum of the squares of the differences over texels and channels.
pub(crate) fn squares(given: &[[f32; 3]], found: &[[f32; 3]]) -> f64 {
    let pairs = given.as_flattened().iter().zip(found.as_flattened());
    pairs.map(|(a, b)| math::powi(f64::from(*a) - f64::from(*b), 2)).sum()
}

/// The number of values past `limit`, of either sign, and the largest magnitude.
fn past_limit(texels: &[[f32; 3]], limit: f32) -> (usize, f32) {
    let past = if limit == LARGEST_HALF { PAST_HALF } else { limit.next_up() };
    let values = texels.as_flattened().iter().map(|value| value.abs());
    let count = values.clone().filter(|value| *value >= past).count();
    (count, values.fold(0.0, f32::max))
}

/// Two sums of each channel: of a part of the light, and of all of it.
type PartAndAll = [[f64; 2]; 3];

/// What lies past `limit`, and all of it.
fn lost_and_all<'a>(
    texels: &[[f32; 3]],
    weights: impl Iterator<Item = &'a f64> + Clone,
    limit: f32,
) -> PartAndAll {
    [0, 1, 2].map(|channel| {
        let (mut lost, mut all) = (0.0, 0.0);
        for (texel, weight) in texels.iter().zip(weights.clone()) {
            let value = f64::from(texel[channel].abs());
            all += weight * value;
            lost += weight * (value - f64::from(limit)).max(0.0);
        }
        [lost, all]
    })
}

/// What rounding changes, and what it was given: see [`rounded`].
fn change_and_all<'a>(
    given: &[[f32; 3]],
    found: &[[f32; 3]],
    weights: impl Iterator<Item = &'a f64> + Clone,
    limit: f32,
    is_signed: bool,
) -> PartAndAll {
    let least = if is_signed { -limit } else { 0.0 };
    [0, 1, 2].map(|channel| {
        let (mut change, mut all) = (0.0, 0.0);
        for ((given, found), weight) in given.iter().zip(found).zip(weights.clone()) {
            let given = f64::from(given[channel].clamp(least, limit));
            change += weight * (f64::from(found[channel]) - given);
            all += weight * given;
        }
        [change, all]
    })
}

/// The sums over all parts, in their order.
fn total(parts: impl Iterator<Item = PartAndAll>) -> PartAndAll {
    parts.fold(PartAndAll::default(), |mut total, part| {
        let sums = total.as_flattened_mut().iter_mut().zip(part.as_flattened());
        sums.for_each(|(sum, part)| *sum += part);
        total
    })
}

/// Each part as a share of all.
fn shares(sums: PartAndAll) -> [f64; 3] {
    sums.map(|[part, all]| if all > 0.0 { part / all } else { 0.0 })
}

/// The weight of each texel of a row.
fn weight_of_row(grid: LatLong, row: usize) -> f64 {
    MapGrid::LatLong(grid).solid_angle(row * grid.width)
}

/// "rounding changes the light: red loses 1.2 %, blue gains 0.4 %", if it is more than a thousandth.
pub(crate) fn rounded_text(rounded: [f64; 3]) -> Option<String> {
    let changes = ["red", "green", "blue"].into_iter().zip(rounded);
    let changes = changes.filter(|(_, change)| change.abs() > ROUNDED).map(|(colour, change)| {
        let does = if change < 0.0 { "loses" } else { "gains" };
        format!("{colour} {does} {}", percent(change.abs()))
    });
    let changes = changes.collect::<Vec<_>>().join(", ");
    (!changes.is_empty()).then(|| format!("rounding changes the light: {changes}"))
}

/// The weights of texels, to be repeated.
fn weights(content: Content) -> Vec<f64> {
    match content {
        Content::Light(grid) => {
            (0..grid.len()).into_par_iter().map(|texel| grid.solid_angle(texel)).collect()
        }
        Content::Values => vec![1.0],
    }
}

/// Notes why a file has 32-bit floats.
pub(crate) fn note_floats(excess: &Excess, reporter: &Reporter) {
    let largest = excess.largest;
    reporter.note(format!(
        "written in 32-bit floats, because values up to {largest:.3e} exceed 65504, the largest half"
    ));
}

#[cfg(test)]
mod tests {
    use sphere::Cube;

    use super::*;

    #[test]
    fn shares_are_weighed_by_solid_angle() {
        let grid = MapGrid::LatLong(LatLong::with_rows(64));
        let mut texels = vec![[1.0; 3]; grid.len()];
        // As many texels at the pole and at the equator.
        for row in [0, 32] {
            texels[row * 128][0] = 100.0;
        }
        let of = |content| Excess::of(&texels, content, 10.0);
        let whole: f64 = 4.0 * std::f64::consts::PI;
        let weights = grid.solid_angle(0) + grid.solid_angle(32 * 128);
        let light = of(Content::Light(grid));
        assert_eq!((light.count, light.largest), (2, 100.0));
        assert!((light.lost[0] - 90.0 * weights / (whole + 99.0 * weights)).abs() < 1e-12, "{light:?}");
        assert_eq!(light.lost[1..], [0.0; 2]);
        let values = of(Content::Values);
        assert!((values.lost[0] - 180.0 / (grid.len() as f64 + 198.0)).abs() < 1e-12, "{values:?}");
    }

    #[test]
    fn maps_after_each_other_are_weighed_alike() {
        let grid = MapGrid::Cube(Cube { edge: 4 });
        let one: Vec<[f32; 3]> = (0..grid.len()).map(|texel| [texel as f32, 1.0, -50.0]).collect();
        let [a, b] = [one.clone(), [one.clone(), one].concat()]
            .map(|texels| Excess::of(&texels, Content::Light(grid), 40.0));
        assert_eq!((2 * a.count, a.lost[1]), (b.count, 0.0));
        assert!((a.lost[0] - b.lost[0]).abs() < 1e-12 && (a.lost[2] - 0.2).abs() < 1e-12, "{a:?} {b:?}");
    }

    #[test]
    fn what_rounds_to_the_largest_half_is_not_lost() {
        let of = |value: f32| Excess::of(&[[value, -value, 0.0]], Content::Values, LARGEST_HALF).count;
        assert_eq!([65504.0, 65519.9, 65520.0, 1e6].map(of), [0, 0, 2, 2]);
    }

    /// Half of the red of one of four texels is gone; green is past the limit; blue was negative.
    #[test]
    fn rounding_is_a_share_of_what_the_format_holds() {
        let given = [[1.0, 500.0, -1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0]];
        let found = [[0.5, 100.0, 0.0], [1.0, 1.0, 1.036], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0]];
        let rounded = rounded(&given, &found, Content::Values, 100.0, false);
        for (found, expected) in rounded.into_iter().zip([-0.125, 0.0, 0.012]) {
            assert!((found - expected).abs() < 1e-8, "{rounded:?}");
        }
        assert_eq!(
            rounded_text(rounded).unwrap(),
            "rounding changes the light: red loses 12.5 %, blue gains 1.2 %"
        );
        assert_eq!(rounded_text([0.9e-3, -0.9e-3, 0.0]), None);
    }

    /// Rows that are decoded a few at a time have the sums of the whole.
    #[test]
    fn a_lat_long_image_by_rows_is_one_of_texels() {
        let grid = LatLong::with_rows(70);
        let texel = |k: usize| [(k * k % 97) as f32, 0.3 * (k % 31) as f32, 7.0];
        let pixels: Vec<[f32; 3]> = (0..grid.len()).map(texel).collect();
        let rounding = |texel: &[f32; 3]| texel.map(|value| 2.0 * (0.5 * value).round());
        let found: Vec<[f32; 3]> = pixels.iter().map(rounding).collect();
        let environment = Environment::new(grid, pixels.clone()).unwrap();
        let content = Content::Light(MapGrid::LatLong(grid));
        let close = |a: [f64; 3], b: [f64; 3]| (0..3).all(|k| (a[k] - b[k]).abs() < 1e-13);
        for limit in [40.0, 1e3] {
            let (whole, by_rows) = (
                Excess::of(&pixels, content, limit),
                Excess::of_rows(&environment, limit, Stop::NEVER).unwrap(),
            );
            assert_eq!((whole.count, whole.largest), (by_rows.count, by_rows.largest));
            assert!(whole.count > 0 || limit > 97.0);
            assert!(close(whole.lost, by_rows.lost), "{whole:?} {by_rows:?}");
            let expected = rounded(&pixels, &found, content, limit, true);
            let rms = (squares(&pixels, &found) / (3 * grid.len()) as f64).sqrt();
            let image = Image::new(grid.width, grid.height, found.clone()).unwrap();
            let lost = RowsLost::of(&environment, &image, limit, true);
            assert!(
                close(lost.rounded, expected) && expected[1].abs() > 1e-4,
                "{:?} {expected:?}",
                lost.rounded
            );
            assert!((lost.rms - rms).abs() < 1e-12 && rms > 0.1, "{} {rms}", lost.rms);
        }
    }

    #[test]
    fn a_sentence_names_the_channels_that_lose() {
        let text = |lost| Excess { lost, ..Excess::default() }.text(Content::Values);
        assert_eq!(
            text([0.4, 0.24, 0.0]),
            "the largest values are clamped: 40.0 % of the red sum is lost, 24.0 % of the green"
        );
        assert_eq!(text([0.0, 0.0, 0.5]), "the largest values are clamped: 50.0 % of the blue sum is lost");
        assert_eq!(text([0.25; 3]), "the largest values are clamped: 25.0 % of the sum is lost");
    }
}
