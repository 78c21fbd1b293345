//! Pictures on the CPU: the same to the bit for any number of threads.
//!
//! A picture is made in bands of a few rows, each by itself: what each of its samples sees ([`rasteriser`]), the shading of that,
//! the background, and the development. Sums over the picture go through the bands in order.

mod clip;
mod frame;
mod geometry;
mod rasteriser;
mod shader;
mod stop;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use crate::shading::develop::codes;
use crate::shading::difference::Squares;
use crate::{Picture, RenderError, Renderer, Scene, Shot, Show};
use frame::{BAND, Frame};
use shader::Kept;
use stop::Stop;

/// The most pixels of a picture, and the most samples along a side: what is drawn counts them in 32 bits.
const MOST_PIXELS: u64 = 1 << 28;
const LONGEST_SIDE: u64 = 1 << 20;

/// Draws on the CPU, on the threads of the rayon pool that it is called from.
///
/// The maps of a look are kept in the order in which they are read, and dropped with the first scene that does not use it.
#[derive(Debug, Default)]
pub struct Cpu {
    kept: Vec<Kept>,
}

impl Cpu {
    /// A renderer that has kept nothing yet.
    pub fn new() -> Self {
        Self::default()
    }
}

impl Renderer for Cpu {
    fn name(&self) -> String {
        match rayon::current_num_threads() {
            1 => "CPU, 1 thread".to_owned(),
            threads => format!("CPU, {threads} threads"),
        }
    }

    fn render(
        &mut self,
        scene: &Scene,
        shot: &Shot,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Picture, RenderError> {
        let stop = Stop::new(stop);
        within_limits(shot)?;
        let [width, height] = shot.size;
        let pixels = width as usize * height as usize;
        let mut picture = Picture {
            size: shot.size,
            codes: Vec::new(),
            radiance: vec![[0.0; 4]; pixels],
            relative_rms: None,
        };
        if pixels == 0 {
            return Ok(picture);
        }
        Kept::renew(&mut self.kept, scene);
        let frame = Frame::new(scene, shot, &self.kept, &stop)?;
        let mut display = vec![[0.0; 3]; pixels];
        let row = width as usize * BAND;
        let bands = picture.radiance.par_chunks_mut(row).zip(display.par_chunks_mut(row)).enumerate();
        let squares: Vec<Squares> = bands
            .map(|(band, (radiance, display))| frame.draw(band, radiance, display, &stop))
            .collect::<Result<_, _>>()?;
        if let Show::Difference { .. } = shot.show {
            let mut all = Squares::default();
            squares.into_iter().for_each(|squares| all.join(squares));
            picture.relative_rms = all.relative_rms();
        }
        picture.codes = codes(&display);
        Ok(picture)
    }
}

/// # Errors
/// [`RenderError::Limit`] where a picture is too large.
fn within_limits(shot: &Shot) -> Result<(), RenderError> {
    let [width, height] = shot.size.map(u64::from);
    let side = width.max(height) * u64::from(shot.samples.clamp(1, 4));
    let limit = |what: &str, asked: u64, limit: u64| match asked > limit {
        true => Err(RenderError::Limit {
            what: format!("a picture of {width} x {height}, in {what},"),
            asked,
            limit,
        }),
        false => Ok(()),
    };
    limit("pixels", width * height, MOST_PIXELS)?;
    limit("samples along a side", side, LONGEST_SIDE)
}
