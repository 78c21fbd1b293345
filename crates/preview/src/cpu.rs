//! Pictures on the CPU, bit-identical for any number of threads.
//!
//! A picture is drawn in bands of a few rows: for each sample the visible surface ([`rasteriser`]), its
//! shading or the background, and the development. Sums over the picture add the bands in order.

mod band_renderer;
mod cancellation;
mod clip;
mod geometry;
mod object_cache;
mod product_sampling;
mod rasteriser;
mod shader;
#[cfg(test)]
mod tests;

use rayon::prelude::*;
use sh::Stop;

use crate::diagram::Diagram;
use crate::shading::develop::codes;
use crate::shading::difference::Squares;
use crate::{Mode, Picture, RenderError, Renderer, Scene, Shot, Show};
use band_renderer::{BAND, BandRenderer};
use cancellation::{Cancellation, PeriodicCheck};
use object_cache::ObjectCache;
use shader::LookCache;

/// The most pixels of a picture, and the most samples along a side, so that 32 bits can count them.
const MOST_PIXELS: u64 = 1 << 28;
const LONGEST_SIDE: u64 = 1 << 20;

/// Draws on the CPU, on the threads of the rayon pool that it is called from.
///
/// The maps of a look are cached in the layout in which they are read, until a scene does not use the look;
/// so are the light at the vertices of an object that a BRDF table shades, the tree of triangles that cast
/// shadows, and what [`Mode::Samples`] draws points from.
#[derive(Debug, Default)]
pub struct Cpu {
    caches: Vec<LookCache>,
    objects: ObjectCache,
    diagram: Diagram,
}

impl Cpu {
    /// A renderer with empty caches.
    pub fn new() -> Self {
        Self::default()
    }

    /// The number of times that a light was brought to the vertices of objects.
    pub fn light_passes(&self) -> u32 {
        self.objects.passes()
    }

    /// Draws the surfaces and the background of a shot in a black picture of its size.
    fn surfaces(
        &mut self,
        scene: &Scene,
        shot: &Shot,
        cancellation: &Cancellation<'_>,
        picture: &mut Picture,
    ) -> Result<(), RenderError> {
        LookCache::update(&mut self.caches, scene);
        cancellation.check()?;
        self.objects.update(scene, shot)?;
        let band_renderer = BandRenderer::new(scene, shot, &self.caches, &self.objects, cancellation)?;
        let mut display = vec![[0.0; 3]; picture.radiance.len()];
        let row = shot.size[0] as usize * BAND;
        let bands = picture.radiance.par_chunks_mut(row).zip(display.par_chunks_mut(row)).enumerate();
        let squares: Vec<Squares> = bands
            .map(|(band, (radiance, display))| band_renderer.draw(band, radiance, display, cancellation))
            .collect::<Result<_, _>>()?;
        if let Show::Difference { .. } = shot.show {
            let mut all = Squares::default();
            squares.into_iter().for_each(|squares| all.join(squares));
            picture.relative_rms = all.relative_rms();
        }
        picture.codes = codes(&display);
        Ok(())
    }
}

/// The number of times, about, that [`Cpu`] asks whether to stop, for a picture of a shot.
pub fn cpu_steps(shot: &Shot) -> usize {
    let [width, height] = shot.size.map(|side| side as usize);
    let light_samples = if shot.show.modes().any(Mode::is_brute_force) {
        width * height * (shot.samples * shot.samples * shot.light_samples) as usize
    } else {
        0
    };
    height.div_ceil(BAND) + light_samples / PeriodicCheck::LIGHT_SAMPLES as usize
}

impl Renderer for Cpu {
    fn name(&self) -> String {
        match rayon::current_num_threads() {
            1 => "CPU, 1 thread".to_owned(),
            threads => format!("CPU, {threads} threads"),
        }
    }

    fn render(&mut self, scene: &Scene, shot: &Shot, stop: Stop<'_>) -> Result<Picture, RenderError> {
        let cancellation = Cancellation::new(stop);
        within_limits(shot)?;
        let shot = &shot.of(scene);
        let mut picture = Picture::black(shot.size);
        if shot.size.contains(&0) {
            return Ok(picture);
        }
        let (columns, beside) = shot.show.beside_diagram(shot.size[0]);
        if let Some(show) = beside {
            self.surfaces(scene, &Shot { show, ..shot.clone() }, &cancellation, &mut picture)?;
        }
        if !columns.is_empty() {
            cancellation.check()?;
            let diagram = self.diagram.draw(scene, shot, columns.end - columns.start);
            picture.place_diagram(columns, diagram);
        }
        Ok(picture)
    }
}

/// # Errors
/// [`RenderError::Limit`] if a picture is too large.
fn within_limits(shot: &Shot) -> Result<(), RenderError> {
    let [width, height] = shot.size.map(u64::from);
    let side = width.max(height) * u64::from(shot.samples.clamp(1, 4));
    let limit = |what: &str, asked: u64, limit: u64| match asked > limit {
        true => {
            Err(RenderError::Limit { what: format!("a picture of {width} x {height}: {what}"), asked, limit })
        }
        false => Ok(()),
    };
    limit("pixels", width * height, MOST_PIXELS)?;
    limit("samples along a side", side, LONGEST_SIDE)
}
