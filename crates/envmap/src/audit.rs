//! Bad values among the pixels of a decoded image, and their repair before the image is resampled.

use crate::coverage::Coverage;
use crate::error::Error;
use crate::image::Image;
use crate::layout::Layout;
use crate::pixel_audit::{Finding, PixelAudit, Place};

/// What is done about NaN, infinite and negative values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum BadPixels {
    /// Refuse an image with NaN or infinite values. Negative values become 0: lossy compression and the
    /// filters of renderers leave some beside lamps.
    #[default]
    ZeroNegative,
    /// Refuse the image.
    Error,
    /// Set each bad value to 0.
    Zero,
    /// NaN and negative values (including -infinity) become 0, and +infinity becomes the largest finite value
    /// of any channel among the pixels that the layout uses.
    Clamp,
}

impl BadPixels {
    /// All policies.
    pub const ALL: [Self; 4] = [Self::ZeroNegative, Self::Error, Self::Zero, Self::Clamp];

    /// The policy's name in a manifest.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ZeroNegative => "zero-negative",
            Self::Error => "error",
            Self::Zero => "zero",
            Self::Clamp => "clamp",
        }
    }

    /// The policy with a name in a manifest.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|policy| policy.name() == name)
    }

    /// Whether an image with these values is refused.
    fn refuses(self, found: &PixelAudit) -> bool {
        match self {
            Self::ZeroNegative => found.nan.is_some() || found.infinite.is_some(),
            Self::Error => !found.is_clean(),
            Self::Zero | Self::Clamp => false,
        }
    }
}

/// Counts the bad values of an image, ignoring pixels that the layout or the part does not use.
///
/// # Errors
/// [`Error::Shape`] or [`Error::PartSize`] if the image does not have the shape of the layout or the part.
pub fn audit(image: &Image, coverage: impl Into<Coverage>) -> Result<PixelAudit, Error> {
    let coverage = coverage.into();
    coverage.check(image)?;
    let mut audit = PixelAudit::default();
    let stored = image.stored();
    stored.visit_blocks(
        |block| !stored.is_clean(block),
        |first, pixels| {
            for (index, pixel) in pixels.iter().enumerate() {
                // A good value needs only this comparison.
                if pixel.iter().all(|value| (0.0..=f32::MAX).contains(value)) {
                    continue;
                }
                let (row, column) = (first + index / image.width(), index % image.width());
                let Some(direction) = coverage.direction(image, row, column) else { continue };
                for (channel, value) in pixel.iter().enumerate() {
                    let finding = if value.is_nan() {
                        &mut audit.nan
                    } else if value.is_infinite() {
                        &mut audit.infinite
                    } else if *value < 0.0 {
                        &mut audit.negative
                    } else {
                        continue;
                    };
                    let face = coverage.face(image, row, column);
                    let row =
                        if coverage == Coverage::Whole(Layout::Cube) { row % image.width() } else { row };
                    let first = Place { face, row, column, channel, direction };
                    finding.get_or_insert(Finding { count: 0, first }).count += 1;
                }
            }
        },
    );
    if audit.negative.is_some() {
        audit.negative_share = negative_share(image, coverage);
    }
    Ok(audit)
}

/// The integral of the negative values over that of the absolute values, over the sphere and the channels;
/// values that are not finite count as 0.
fn negative_share(image: &Image, coverage: Coverage) -> f64 {
    let width = image.width();
    let (mut negative, mut all) = (0.0, 0.0);
    let mut angle = 0.0;
    image.stored().visit_blocks(
        |_| true,
        |first, pixels| {
            for (index, pixel) in pixels.iter().enumerate() {
                let (row, column) = (first + index / width, index % width);
                if coverage != Coverage::Whole(Layout::LatLong) || column == 0 {
                    angle = coverage.solid_angle(image, row, column);
                }
                for value in pixel.iter().filter(|value| value.is_finite()) {
                    let value = f64::from(*value);
                    negative += angle * (-value).max(0.0);
                    all += angle * value.abs();
                }
            }
        },
    );
    if all > 0.0 { negative / all } else { 0.0 }
}

/// Audits an image, and applies the policy to its bad values.
///
/// The audit describes the image before the repair. Pixels that the layout or the part does not use are
/// repaired too, but not counted.
///
/// # Errors
/// The errors of [`audit`], and [`Error::BadPixels`] if a value is bad and the policy refuses it.
pub fn repair(
    image: Image,
    coverage: impl Into<Coverage>,
    policy: BadPixels,
) -> Result<(Image, PixelAudit), Error> {
    let coverage = coverage.into();
    let found = audit(&image, coverage)?;
    if policy.refuses(&found) {
        return Err(Error::BadPixels(Box::new(found)));
    }
    let bright = if policy == BadPixels::Clamp && found.infinite.is_some() {
        largest_finite(&image, coverage)
    } else {
        0.0
    };
    let replace = |_: usize, pixels: &mut [[f32; 3]]| {
        for value in pixels.as_flattened_mut() {
            if !(0.0..=f32::MAX).contains(value) {
                *value = if *value == f32::INFINITY { bright } else { 0.0 };
            }
        }
    };
    Ok((image.changed(replace), found))
}

/// The largest finite value of the pixels that are used, or 0.
fn largest_finite(image: &Image, coverage: Coverage) -> f32 {
    let mut largest = 0.0;
    image.stored().visit_blocks(
        |_| true,
        |first, pixels| {
            for (index, pixel) in pixels.iter().enumerate() {
                let brightest = pixel.iter().copied().filter(|value| value.is_finite()).fold(0.0, f32::max);
                let (row, column) = (first + index / image.width(), index % image.width());
                if brightest > largest && coverage.direction(image, row, column).is_some() {
                    largest = brightest;
                }
            }
        },
    );
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use sphere::LatLong;

    /// 8 x 4, 1 everywhere but a NaN, two infinities, a negative value and the brightest.
    fn damaged() -> Image {
        let mut image = Image::new(8, 4, vec![[1.0; 3]; 32]).unwrap();
        image.pixels_mut()[9] = [1.0, f32::NAN, -2.0];
        image.pixels_mut()[18] = [f32::INFINITY, 7.0, f32::NEG_INFINITY];
        image.pixels_mut()[31] = [-0.0, -1.0, f32::NAN];
        image
    }

    #[test]
    fn an_audit_counts_and_gives_the_first_place() {
        let audit = audit(&damaged(), Layout::LatLong).unwrap();
        let direction = |row, column| LatLong::with_rows(4).direction(row, column);
        let place = |row, column, channel| Place {
            face: None,
            row,
            column,
            channel,
            direction: direction(row, column),
        };
        assert_eq!(audit.nan, Some(Finding { count: 2, first: place(1, 1, 1) }));
        assert_eq!(audit.infinite, Some(Finding { count: 2, first: place(2, 2, 0) }));
        assert_eq!(audit.negative, Some(Finding { count: 2, first: place(1, 1, 2) }));
        assert_eq!(
            audit.to_string(),
            "2 NaN, the first at row 1, column 1, green (theta 67.5, phi 112.5 degrees); \
             2 infinite, the first at row 2, column 2, red (theta 112.5, phi 67.5 degrees); \
             2 negative, the first at row 1, column 1, blue (theta 67.5, phi 112.5 degrees)"
        );
    }

    #[test]
    fn policies_refuse_zero_or_clamp() {
        let refused = repair(damaged(), Layout::LatLong, BadPixels::Error).unwrap_err();
        assert!(matches!(refused, Error::BadPixels(audit) if audit.nan.is_some()));
        let (zeroed, found) = repair(damaged(), Layout::LatLong, BadPixels::Zero).unwrap();
        assert!(!found.is_clean());
        assert_eq!(zeroed.pixels()[9], [1.0, 0.0, 0.0]);
        assert_eq!(zeroed.pixels()[18], [0.0, 7.0, 0.0]);
        let (clamped, _) = repair(damaged(), Layout::LatLong, BadPixels::Clamp).unwrap();
        assert_eq!(clamped.pixels()[9], [1.0, 0.0, 0.0]);
        assert_eq!(clamped.pixels()[18], [7.0, 7.0, 0.0]);
        assert_eq!(clamped.pixels()[31], [0.0, 0.0, 0.0]);
        let mut cube = Image::new(2, 12, vec![[1.0; 3]; 24]).unwrap();
        cube.pixels_mut()[2 * 7 + 1][0] = f32::NAN;
        let refused = repair(cube, Layout::Cube, BadPixels::Error).unwrap_err().to_string();
        assert!(refused.contains("1 NaN, the first at face ny, row 1, column 1, red"), "{refused}");
        let clean = Image::new(2, 1, vec![[0.0, 1.0, f32::MAX]; 2]).unwrap();
        let (same, found) = repair(clean.clone(), Layout::LatLong, BadPixels::Error).unwrap();
        assert!(found.is_clean() && same == clean);
    }

    #[test]
    fn negative_values_alone_become_zero_by_default() {
        let policy = BadPixels::default();
        assert!(repair(damaged(), Layout::LatLong, policy).is_err());
        let mut image = Image::new(8, 4, vec![[1.0; 3]; 32]).unwrap();
        image.pixels_mut()[9] = [-0.5, 2.0, 1.0];
        let (repaired, found) = repair(image, Layout::LatLong, policy).unwrap();
        assert_eq!(repaired.pixels()[9], [0.0, 2.0, 1.0]);
        assert_eq!(found.negative.map(|finding| finding.count), Some(1));
        // A pixel of the second row: 2 pi / 8 (cos 45 - cos 90), of three channels of 1 over 4 pi.
        let angle = std::f64::consts::FRAC_PI_4 * 0.5_f64.sqrt();
        let expected = 0.5 * angle / (12.0 * std::f64::consts::PI + 0.5 * angle);
        assert!((found.negative_share - expected).abs() < 1e-9, "{} {expected}", found.negative_share);
    }

    #[test]
    fn pixels_that_a_layout_does_not_use_do_not_count() {
        let mut image = Image::new(8, 8, vec![[1.0; 3]; 64]).unwrap();
        image.pixels_mut()[0] = [f32::NAN, f32::INFINITY, 1e30];
        assert!(audit(&image, Layout::Probe).unwrap().is_clean());
        image.pixels_mut()[36] = [f32::INFINITY; 3];
        let (clamped, found) = repair(image, Layout::Probe, BadPixels::Clamp).unwrap();
        assert_eq!(found.infinite.map(|finding| finding.count), Some(3));
        assert_eq!(clamped.pixels()[36], [1.0; 3]);
    }
}
