//! Pictures, and the tolerances within which two of them count as the same.

use std::ops::Range;

use envmap::{srgb_decode, to_srgb8};
use glam::Vec3;

use crate::shading::difference::{Squares, difference};
use crate::{Mode, Shot, Show};

/// A picture, rows from the top, pixels from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// The width and height in pixels.
    pub size: [u32; 2],
    /// The codes of the pixels: sRGB, 8 bits, after exposure and tone curve.
    pub codes: Vec<[u8; 3]>,
    /// The mean linear radiance of each pixel's samples before exposure, and the share of them that hit a
    /// surface. For a difference it is the mean absolute difference, not amplified.
    pub radiance: Vec<[f32; 4]>,
    /// The RMS of a difference over channels and the samples that hit a surface, divided by the root mean
    /// square of the reference.
    pub relative_rms: Option<f64>,
}

impl Picture {
    /// A black picture without a surface.
    pub(crate) fn black(size: [u32; 2]) -> Self {
        let pixels = size[0] as usize * size[1] as usize;
        let (codes, radiance) = (vec![[0; 3]; pixels], vec![[0.0; 4]; pixels]);
        Self { size, codes, radiance, relative_rms: None }
    }

    /// Places a diagram in some of its columns. The radiance of a diagram is the linear value of its codes,
    /// and it has no surface.
    pub(crate) fn place_diagram(&mut self, columns: Range<u32>, codes: &[[u8; 3]]) {
        let linear: [f32; 256] = std::array::from_fn(|code| srgb_decode(code as f32 / 255.0));
        let linear = |code: u8| linear[usize::from(code)];
        let columns = columns.start as usize..columns.end as usize;
        let width = self.size[0] as usize;
        let rows = self.codes.chunks_exact_mut(width).zip(self.radiance.chunks_exact_mut(width));
        for ((to, radiance), from) in rows.zip(codes.chunks_exact(columns.len())) {
            to[columns.clone()].copy_from_slice(from);
            for (radiance, [red, green, blue]) in radiance[columns.clone()].iter_mut().zip(from) {
                *radiance = [linear(*red), linear(*green), linear(*blue), 0.0];
            }
        }
    }

    /// The errors in stops that 95 and 99 of 100 samples stay below, if a picture of the same scene and shot
    /// is right: [`shrm::stops`]. The samples are the channels of the pixels whose samples all hit a surface;
    /// `None` without any. `dark` is that of the light ([`crate::Light::dark`]).
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn stops(&self, from: &Self, dark: f64) -> Option<[f64; 2]> {
        assert_eq!(self.size, from.size, "pictures of one shot");
        let pixels = self.radiance.iter().zip(&from.radiance).filter(|(of, _)| of[3] == 1.0);
        let stops = pixels.flat_map(|(of, from)| {
            [0, 1, 2].map(|k| shrm::stops::error(f64::from(of[k]), f64::from(from[k]), dark))
        });
        let mut stops: Vec<f64> = stops.collect();
        (!stops.is_empty()).then(|| shrm::stops::quantiles(&mut stops))
    }

    /// The absolute difference from a picture of the same scene and shot in another mode. One reference then
    /// serves several differences.
    ///
    /// It compares the means of pixels, while [`Show::Difference`] compares their samples: the noise of brute
    /// force is averaged before it is squared. The RMS is over the pixels whose samples all hit a surface.
    ///
    /// # Panics
    /// If the sizes differ.
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

/// The differences that pictures of one scene by two renderers may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// A pixel is an outlier if its codes differ by more than this many steps of 255.
    pub codes: u8,
    /// The largest share of outliers: pixels on outlines, and at the edges of the sun's texels.
    pub outliers: f64,
    /// The largest RMS difference of radiance over channels and the pixels that are no outliers, divided by
    /// the root mean square of the first picture.
    pub relative_rms: f64,
}

/// The tolerance between pictures by the CPU and by any graphics device in the modes that read maps.
///
/// Both compute in f32 with the same formulas, so they differ by rounding and by the place of a pixel's
/// centre on its triangle. Both snap corners to 1/256 of a sample, but some devices, such as lavapipe,
/// interpolate normals between the corners before snapping. Those normals belong to a point up to sqrt(2) /
/// 512 of a sample away. If the normal turns by k per sample, and the map's radiance changes by g per radian,
/// the reflected radiance is off by 2 k g / 362. That is 1e-3 for k = 0.1, as on a tube of ten pixels'
/// radius, and g = 2, the average of maps of degree 12. The largest values measured over the tests' scenes
/// are an RMS of 1.7e-3 and outliers of 0.0012.
pub const SAME_PICTURE: Tolerance = Tolerance { codes: 2, outliers: 0.002, relative_rms: 2e-3 };

/// The tolerance of the modes that read the environment: mirror and brute force.
///
/// Neighbouring texels of the environment may differ by any amount. With texels of h radians and k as in
/// [`SAME_PICTURE`], a reflection is off by 2 k / (362 h) of their difference: 1 percent for k = 0.1 and h =
/// 0.05. Brute force treats each texel as a patch of one radiance, so some of its samples fall on a different
/// texel. The largest values measured with lavapipe are an RMS of 1.3e-2 and outliers of 0.0065.
pub const SAME_LIGHT: Tolerance = Tolerance { codes: 2, outliers: 0.01, relative_rms: 2e-2 };

impl Tolerance {
    /// The tolerance for pictures of these modes.
    pub fn of(show: Show) -> Self {
        let light = show.modes().any(|mode| mode == Mode::Mirror || mode.is_brute_force());
        if light { SAME_LIGHT } else { SAME_PICTURE }
    }
}

#[cfg(test)]
mod tests {
    use sphere::Rotation;

    use super::*;
    use crate::{Background, Camera, Framing, PointSet};

    /// A pixel in the background, and one on the outline, do not count.
    #[test]
    fn stops_count_what_an_eye_sees() {
        let picture = |radiance: Vec<[f32; 4]>| Picture {
            size: [4, 1],
            codes: Vec::new(),
            radiance,
            relative_rms: None,
        };
        let of = picture(vec![[2.0, 1.0, -1.0, 1.0], [9.0, 9.0, 9.0, 0.5], [9.0, 9.0, 9.0, 0.0], [1.0; 4]]);
        let from = picture(vec![[1.0, 1.0, 0.0, 1.0], [1.0; 4], [1.0; 4], [1.0; 4]]);
        let [p95, p99] = of.stops(&from, 0.0).unwrap();
        assert!((p95 - 1.0).abs() < 1e-9 && p95 == p99, "{p95}");
        let nothing = picture(vec![[0.0; 4]; 4]);
        assert_eq!(nothing.stops(&nothing, 0.01), None);
    }

    /// Three pixels: on the surface, on its outline, and in the background.
    fn picture(surface: f32) -> Picture {
        let outline = (surface + 4.0) / 2.0;
        let radiance = vec![[surface, 0.5, 0.0, 1.0], [outline, 2.25, 0.0, 0.5], [4.0; 4]];
        let mut picture = Picture { size: [3, 1], codes: Vec::new(), radiance, relative_rms: None };
        picture.radiance[2][3] = 0.0;
        picture
    }

    #[test]
    fn a_difference_of_pictures_compares_their_surfaces() {
        let shot = Shot {
            size: [3, 1],
            samples: 2,
            camera: Camera::new(Framing::ball(glam::DVec3::ZERO, 1.0)),
            turn: Rotation::IDENTITY,
            show: Show::One(Mode::Mirror),
            background: Background::Environment,
            exposure: 1.0,
            tone: envmap::ToneMap::Plain,
            light_samples: 1,
            points: PointSet::Even,
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
