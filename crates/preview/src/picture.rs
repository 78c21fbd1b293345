//! What a renderer makes, and when two pictures are the same.

use envmap::to_srgb8;
use glam::Vec3;

use crate::shading::difference::{Squares, difference};
use crate::{Mode, Shot, Show};

/// A picture, rows from the top, pixels from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// sRGB, 8 bits, developed: exposure and tone curve are in it.
    pub codes: Vec<[u8; 3]>,
    /// The mean linear radiance of each pixel's samples before exposure, and the share of them that see a surface.
    /// Of a difference: the mean absolute difference, not amplified.
    pub radiance: Vec<[f32; 4]>,
    /// Of a difference: the root of the mean squared difference over the samples that see a surface and over channels,
    /// divided by the root of the mean square of what is compared with.
    pub relative_rms: Option<f64>,
}

impl Picture {
    /// The absolute difference from a picture of the same scene and shot but for the mode: for several differences from
    /// one picture, which is then drawn once.
    ///
    /// It is that of the pixels' means, where [`Show::Difference`] has that of their samples: noise of brute force is
    /// averaged before it is squared. The RMS is over pixels that see a surface with all of their samples.
    ///
    /// # Panics
    /// Where the sizes differ.
    pub fn difference(&self, from: &Self, amplify: f32, shot: &Shot) -> Self {
        assert_eq!(self.size, from.size, "pictures of one shot");
        let mut squares = Squares::default();
        let apart = |(of, from): (&[f32; 4], &[f32; 4])| {
            let colour = |[red, green, blue, _]: [f32; 4]| Vec3::new(red, green, blue);
            let apart = difference(colour(*of), colour(*from));
            if of[3] == 1.0 {
                squares.add(apart, colour(*from));
            }
            apart.extend(of[3]).to_array()
        };
        let radiance: Vec<_> = self.radiance.iter().zip(&from.radiance).map(apart).collect();
        let shown: Vec<_> = radiance
            .iter()
            .map(|[red, green, blue, _]| [red, green, blue].map(|value| value * amplify))
            .collect();
        let codes = to_srgb8(&shown, shot.exposure, shot.tone);
        Self { size: self.size, codes, radiance, relative_rms: squares.relative_rms() }
    }
}

/// How far two pictures of one scene by two renderers may be apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Pixels whose codes differ by more than this many steps of 255 are counted.
    pub codes: u8,
    /// The largest share of pixels that may be counted: outlines, and texels of the sun on their edge.
    pub outliers: f64,
    /// The largest root mean square of the difference of radiance, over pixels that are not counted and over channels,
    /// divided by that of the first picture.
    pub relative_rms: f64,
}

/// The tolerance between the CPU's pictures and those of any graphics device, of modes that read maps.
///
/// Both compute in f32 by the same formulas, so that they differ by rounding and by where a pixel's middle lies on a triangle.
/// Both snap corners to 1/256 of a sample; some devices interpolate normals between corners as they were before. Then
/// these are those of a place up to sqrt(2) / 512 of a sample aside. Where the normal turns by k a sample, and a map's
/// radiance changes by g a radian, a reflection is off by 2 k g / 362: with k = 0.1, as on a tube of ten pixels' radius, and
/// g = 2, as maps of degree 12 have it on average, by 1e-3. lavapipe does so; the worst that was measured over the tests' scenes
/// is an RMS of 1.7e-3 and outliers of 0.0012.
pub const SAME_PICTURE: Tolerance = Tolerance { codes: 2, outliers: 0.002, relative_rms: 2e-3 };

/// The tolerance of modes that read light itself: mirror and brute force.
///
/// Light changes from texel to texel without bound: with texels of h radians, as in [`SAME_PICTURE`], a reflection is off by
/// 2 k / (362 h) of the difference of neighbours, 1 percent at k = 0.1 and h = 0.05. Brute force takes each texel as
/// a patch of one radiance, so that some of its samples fall on another one. The worst that was measured with lavapipe
/// is an RMS of 1.3e-2 and outliers of 0.0065.
pub const SAME_LIGHT: Tolerance = Tolerance { codes: 2, outliers: 0.01, relative_rms: 2e-2 };

impl Tolerance {
    /// The tolerance of pictures that show these modes.
    pub fn of(show: Show) -> Self {
        let light = show.modes().any(|mode| matches!(mode, Mode::Mirror | Mode::BruteForce));
        if light { SAME_LIGHT } else { SAME_PICTURE }
    }
}

#[cfg(test)]
mod tests {
    use sphere::Rotation;

    use super::*;
    use crate::{Background, Camera, Framing};

    /// Three pixels: of the surface, of its outline, of the background.
    fn picture(surface: f32) -> Picture {
        let outline = (surface + 4.0) / 2.0;
        let radiance = vec![[surface, 0.5, 0.0, 1.0], [outline, 2.25, 0.0, 0.5], [4.0; 4]];
        let mut picture = Picture { size: [3, 1], codes: Vec::new(), radiance, relative_rms: None };
        picture.radiance[2][3] = 0.0;
        picture
    }

    #[test]
    fn a_difference_of_pictures_is_that_of_their_surfaces() {
        let shot = Shot {
            size: [3, 1],
            samples: 2,
            camera: Camera::new(Framing { centre: glam::DVec3::ZERO, radius: 1.0 }),
            turn: Rotation::IDENTITY,
            show: Show::One(Mode::Mirror),
            background: Background::Environment,
            exposure: 1.0,
            tone: envmap::ToneMap::Plain,
            light_samples: 1,
        };
        let apart = picture(1.0).difference(&picture(1.25), 2.0, &shot);
        assert_eq!(apart.radiance, [[0.25, 0.0, 0.0, 1.0], [0.125, 0.0, 0.0, 0.5], [0.0; 4]]);
        // Twice as strong, and a stop brighter.
        let white = envmap::to_srgb8(&[[1.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0; 3]], 0.0, shot.tone);
        assert_eq!(apart.codes, white);
        let expected = 0.25 / f64::sqrt(1.25 * 1.25 + 0.25);
        assert!((apart.relative_rms.unwrap() - expected).abs() < 1e-12);
        assert_eq!(picture(1.0).difference(&picture(1.0), 2.0, &shot).relative_rms, Some(0.0));
    }
}
