//! A picture band by band: what each sample sees, its shading, the background, and the development.

use glam::Vec3;

use super::geometry::Geometry;
use super::rasteriser::{Band, Seen};
use super::shader::{Kept, Shader};
use super::stop::{Patience, Stop};
use crate::shading::background::{Behind, background};
use crate::shading::develop::develop;
use crate::shading::difference::{Squares, difference};
use crate::{Background, Light, Object, RenderError, Scene, Shot, Show, ViewTransform};

/// Rows of pixels in a band.
pub(super) const BAND: usize = 4;

/// All that the bands of a picture are made of.
pub(super) struct Frame<'a> {
    shot: &'a Shot,
    sight: ViewTransform,
    geometry: Geometry,
    /// For each band the triangles that may reach it, in order.
    bins: Vec<Vec<u32>>,
    /// The shaders of each mode of [`Show::modes`], one for each look.
    shaders: Vec<Vec<Shader<'a>>>,
    /// The look of each object.
    looks: Vec<usize>,
    behind: Behind<'a>,
}

impl<'a> Frame<'a> {
    /// Makes ready what a shot of a scene shows.
    ///
    /// # Errors
    /// Where a map cannot be made or is missing, and [`RenderError::Cancelled`].
    pub(super) fn new(
        scene: &'a Scene,
        shot: &'a Shot,
        kept: &'a [Kept],
        stop: &Stop<'_>,
    ) -> Result<Self, RenderError> {
        let sight = ViewTransform::new(shot);
        let mut shaders = Vec::new();
        for mode in shot.show.modes() {
            let of_mode = kept.iter().map(|kept| {
                stop.check()?;
                Shader::new(mode, kept, sight.view)
            });
            shaders.push(of_mode.collect::<Result<_, _>>()?);
        }
        stop.check()?;
        let geometry = Geometry::new(scene, &sight);
        let rows = BAND as i32 * sight.samples as i32;
        let mut bins = vec![Vec::new(); (shot.size[1] as usize).div_ceil(BAND)];
        for (number, triangle) in geometry.triangles.iter().enumerate() {
            let (first, last) = (triangle.rows.start() / rows, triangle.rows.end() / rows);
            bins[first as usize..=last as usize].iter_mut().for_each(|bin| bin.push(number as u32));
        }
        let look = |object: &Object| Kept::place(kept, &object.look).unwrap_or_default();
        let looks = scene.objects.iter().map(look).collect();
        let behind = behind(shot.background, &scene.light);
        Ok(Self { shot, sight, geometry, bins, shaders, looks, behind })
    }

    /// The pixels of a band: mean radiance and cover, and display values. What squares of a difference sum to is returned.
    ///
    /// # Errors
    /// [`RenderError::Cancelled`].
    pub(super) fn draw(
        &self,
        band: usize,
        radiance: &mut [[f32; 4]],
        display: &mut [[f32; 3]],
        stop: &Stop<'_>,
    ) -> Result<Squares, RenderError> {
        stop.check()?;
        let (width, samples) = (self.shot.size[0] as usize, self.sight.samples);
        let first = (band * BAND) as u32;
        let count = (radiance.len() / width) as u32;
        let rows = first * samples..(first + count) * samples;
        let seen = Band::new(&self.geometry, &self.bins[band], self.sight.size, rows);
        let (mut squares, mut patience) = (Squares::default(), Patience::new(stop));
        let share = 1.0 / (samples * samples) as f32;
        let divider = self.shot.show.divider(self.shot.size[0]);
        for (place, (radiance, display)) in radiance.iter_mut().zip(display).enumerate() {
            let (x, y) = ((place % width) as u32, first + (place / width) as u32);
            let (mut mean, mut cover, mut shown) = (Vec3::ZERO, 0.0, Vec3::ZERO);
            for row in y * samples..(y + 1) * samples {
                for column in x * samples..(x + 1) * samples {
                    let seen = seen.seen(&self.geometry, &self.sight, column, row);
                    let sample = match &seen {
                        Some(seen) => {
                            let by = |mode| self.by(mode, seen, [column, row], &mut patience);
                            self.surface(by, x >= divider, &mut squares)?
                        }
                        None => self.nothing(column, row),
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

    /// Radiance toward the viewer of what a sample sees, by one of the modes.
    fn by(
        &self,
        mode: usize,
        seen: &Seen,
        [column, row]: [u32; 2],
        patience: &mut Patience<'_>,
    ) -> Result<Vec3, RenderError> {
        // The same mode on both sides is there once.
        let shaders = &self.shaders[mode.min(self.shaders.len() - 1)];
        let number = row.wrapping_mul(self.sight.size[0]).wrapping_add(column);
        let light_samples = self.shot.light_samples;
        shaders[self.looks[seen.object]].radiance(&seen.surface, number, light_samples, patience)
    }

    /// A sample that sees a surface, whose radiance is known by the first mode and the second.
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
        Ok(Sample { radiance, amplify, gain: self.sight.gain })
    }

    /// A sample that sees no surface. Two modes have the same background: their difference is black there.
    fn nothing(&self, column: u32, row: u32) -> Sample {
        let radiance = match self.shot.show {
            Show::Difference { .. } => Vec3::ZERO,
            _ => background(self.behind, self.sight.ray(column, row)),
        };
        let gain = if let Behind::Flat(_) = self.behind { 1.0 } else { self.sight.gain };
        Sample { radiance, amplify: 1.0, gain }
    }
}

/// What a sample shows.
struct Sample {
    radiance: Vec3,
    /// How many times stronger it is shown.
    amplify: f32,
    gain: f32,
}

fn behind(background: Background, light: &Light) -> Behind<'_> {
    match background {
        Background::Environment => {
            let (grid, pixels) = (light.environment().grid(), light.environment().pixels());
            Behind::LatLong { size: [grid.width as u32, grid.height as u32], pixels }
        }
        Background::Harmonics => {
            let (cube, texels) = light.reconstruction();
            Behind::Cube { edge: cube.edge as u32, texels }
        }
        Background::Flat(radiance) => Behind::Flat(radiance.into()),
    }
}
