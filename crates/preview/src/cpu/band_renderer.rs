//! Draws a picture in bands: the surface at each sample, its shading, the background, and the development.

use glam::Vec3;

use super::cancellation::{Cancellation, PeriodicCheck};
use super::geometry::Geometry;
use super::object_cache::ObjectCache;
use super::product_sampling::BandSamplers;
use super::rasteriser::{Band, Hit};
use super::shader::{BandState, LookCache, ObjectState, Shader};
use crate::shading::background::background;
use crate::shading::base_color::{BaseColorMap, base_color};
use crate::shading::develop::develop;
use crate::shading::difference::{Squares, difference};
use crate::shading::sequence::Sequence;
use crate::shading::shadows::Shadows;
use crate::shading::texture::texture;
use crate::vertex_light::VertexLight;
use crate::{Background, Light, Mode, Object, RenderError, Scene, Shot, Show, ViewTransform};

/// The number of rows of pixels in a band.
pub(super) const BAND: usize = 4;

/// Draws the bands of a picture.
pub(super) struct BandRenderer<'a> {
    shot: &'a Shot,
    light: &'a Light,
    transform: ViewTransform,
    geometry: Geometry,
    /// The triangles that may cover each band, in order.
    bins: Vec<Vec<u32>>,
    /// The shaders of all looks, for each mode of [`Show::modes`].
    shaders: Vec<Vec<Shader<'a>>>,
    /// Whether the material is seen in each of these modes.
    shows_material: Vec<bool>,
    /// The texture of each object, if it has one.
    textures: Vec<Option<&'a BaseColorMap>>,
    /// The index of each object's look.
    looks: Vec<usize>,
    /// The light at the vertices of each object in each mode, if a table shades it.
    lights: Vec<Vec<Option<&'a VertexLight>>>,
    /// The shadows of each object on itself, if there are any.
    shadows: Vec<Option<Shadows>>,
}

impl<'a> BandRenderer<'a> {
    /// Prepares the maps and the geometry of a shot.
    ///
    /// # Errors
    /// If a map cannot be made or is missing, and [`RenderError::Cancelled`].
    pub(super) fn new(
        scene: &'a Scene,
        shot: &'a Shot,
        caches: &'a [LookCache],
        objects: &'a ObjectCache,
        cancellation: &Cancellation<'_>,
    ) -> Result<Self, RenderError> {
        let transform = ViewTransform::new(shot);
        let mut shaders = Vec::new();
        for mode in shot.show.modes() {
            let of_mode = caches.iter().map(|cache| {
                cancellation.check()?;
                Shader::new(mode, cache, transform.view, shot)
            });
            shaders.push(of_mode.collect::<Result<_, _>>()?);
        }
        cancellation.check()?;
        let geometry = Geometry::new(scene, &transform);
        let rows = BAND as i32 * transform.samples as i32;
        let mut bins = vec![Vec::new(); (shot.size[1] as usize).div_ceil(BAND)];
        for (number, triangle) in geometry.triangles.iter().enumerate() {
            let (first, last) = (triangle.rows.start() / rows, triangle.rows.end() / rows);
            bins[first as usize..=last as usize].iter_mut().for_each(|bin| bin.push(number as u32));
        }
        let look = |object: &Object| LookCache::index(caches, &object.look).unwrap_or_default();
        let looks = scene.objects.iter().map(look).collect();
        let textures = scene.objects.iter().map(Object::base_color_map).collect();
        let shows_material = shot.show.modes().map(Mode::shows_material).collect();
        if shot.background == Background::Harmonics {
            // It runs on all threads, so no band may be the first to need it.
            scene.light.reconstruction();
        }
        let lights = shot.show.modes().map(|mode| objects.lights(scene, mode)).collect();
        let shadows = objects.shadows(scene, shot);
        let light = &scene.light;
        Ok(Self {
            shot,
            light,
            transform,
            geometry,
            bins,
            shaders,
            shows_material,
            textures,
            looks,
            lights,
            shadows,
        })
    }

    /// Draws the pixels of a band: mean radiance and coverage, and display values. Returns a difference's
    /// sums of squares.
    ///
    /// # Errors
    /// [`RenderError::Cancelled`].
    pub(super) fn draw(
        &self,
        band: usize,
        radiance: &mut [[f32; 4]],
        display: &mut [[f32; 3]],
        cancellation: &Cancellation<'_>,
    ) -> Result<Squares, RenderError> {
        cancellation.check()?;
        let (width, samples) = (self.shot.size[0] as usize, self.transform.samples);
        let first = (band * BAND) as u32;
        let count = (radiance.len() / width) as u32;
        let rows = first * samples..(first + count) * samples;
        let seen = Band::new(&self.geometry, &self.bins[band], self.transform.size, rows);
        let mut squares = Squares::default();
        let mut state =
            BandState { check: PeriodicCheck::new(cancellation), samplers: BandSamplers::new(self.shot) };
        let share = 1.0 / (samples * samples) as f32;
        let divider = self.shot.show.divider(self.shot.size[0]);
        for (place, (radiance, display)) in radiance.iter_mut().zip(display).enumerate() {
            let (x, y) = ((place % width) as u32, first + (place / width) as u32);
            let (mut mean, mut cover, mut shown) = (Vec3::ZERO, 0.0, Vec3::ZERO);
            for row in y * samples..(y + 1) * samples {
                for column in x * samples..(x + 1) * samples {
                    let seen = seen.seen(&self.geometry, &self.transform, column, row);
                    let sample = match &seen {
                        Some(seen) => {
                            let by = |mode| self.by(mode, seen, [column, row], &mut state);
                            self.surface(by, x >= divider, &mut squares)?
                        }
                        None => self.background(column, row),
                    };
                    mean += sample.radiance;
                    shown += develop(sample.radiance * sample.amplify, sample.gain, self.shot.tone);
                    cover += if seen.is_some() { 1.0 } else { 0.0 };
                }
            }
            *radiance = (mean * share).extend(cover * share).to_array();
            *display = (shown * share).to_array();
        }
        Ok(squares)
    }

    /// The radiance toward the viewer at a sample, in the first or the second mode.
    fn by(
        &self,
        mode: usize,
        seen: &Hit,
        [column, row]: [u32; 2],
        state: &mut BandState<'_>,
    ) -> Result<Vec3, RenderError> {
        // If both sides have the same mode, it has one entry.
        let mode = mode.min(self.shaders.len() - 1);
        let shaders = &self.shaders[mode];
        let number = row.wrapping_mul(self.transform.size[0]).wrapping_add(column);
        let sequence = Sequence::new(self.shot.points, number);
        let light_samples = self.shot.light_samples;
        let of = ObjectState {
            light: self.lights[mode][seen.object],
            shadows: self.shadows[seen.object].as_ref(),
        };
        let shader = &shaders[self.looks[seen.object]];
        let radiance = shader.radiance(seen, sequence, light_samples, of, state)?;
        Ok(match (self.textures[seen.object], &seen.spot) {
            (Some(map), Some(spot)) if self.shows_material[mode] => {
                base_color(&map.response, texture(&map.texture, spot), radiance, &seen.surface)
            }
            _ => radiance,
        })
    }

    /// A sample that hits a surface; `by` is its radiance in the first or the second mode.
    fn surface(
        &self,
        mut by: impl FnMut(usize) -> Result<Vec3, RenderError>,
        right: bool,
        squares: &mut Squares,
    ) -> Result<Sample, RenderError> {
        let (radiance, amplify) = match self.shot.show {
            Show::One(_) => (by(0)?, 1.0),
            Show::Split { .. } => (by(usize::from(right))?, 1.0),
            Show::Difference { amplify, .. } => {
                let from = by(1)?;
                let radiance = difference(by(0)?, from);
                squares.add(radiance, from);
                (radiance, amplify)
            }
        };
        Ok(Sample { radiance, amplify, gain: self.transform.gain })
    }

    /// A sample that hits no surface. Both modes have the same background: their difference is black.
    fn background(&self, column: u32, row: u32) -> Sample {
        let radiance = match self.shot.show {
            Show::Difference { .. } => Vec3::ZERO,
            _ => background(self.shot.background, self.light, self.transform.ray(column, row)),
        };
        let gain = if let Background::Flat(_) = self.shot.background { 1.0 } else { self.transform.gain };
        Sample { radiance, amplify: 1.0, gain }
    }
}

/// A sample of a pixel.
struct Sample {
    radiance: Vec3,
    /// The factor that the sample's radiance is multiplied with before development.
    amplify: f32,
    gain: f32,
}
