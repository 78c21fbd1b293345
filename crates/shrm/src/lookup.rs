//! What a renderer reads from a map: radiance at any central direction and view, and whole view maps
//! (equation 12).
//!
//! Texels are blended bilinearly, over the seam, the poles, the edges and the corners. The frames of a local
//! map spin around the poles, so that its coefficients mean different things in neighbouring texels: each
//! texel is evaluated at the view in its own frame, then the four values are blended. Global coefficients
//! share one frame; there blending values or coefficients is the same.

use std::f64::consts::PI;

use envmap::{Taps, Texels};
use rayon::prelude::*;
use sh::{Basis, zonal_into};
use sphere::Direction;

use crate::{MapGrid, Shrm, Terms, View, into_frame};

/// A map made ready for many look-ups from one thread: it keeps the harmonics' constants and their memory.
#[derive(Clone, Debug)]
pub struct Lookup<'a> {
    map: &'a Shrm,
    basis: Basis,
    harmonics: Vec<f64>,
}

impl Lookup<'_> {
    /// Radiance toward `view` (the world's frame) from a surface whose central direction is `central`: four
    /// texels around `central`, each evaluated in its own frame, blended bilinearly.
    pub fn radiance(&mut self, central: Direction, view: Direction) -> [f32; 3] {
        let Taps { index, weight } = match self.map.grid() {
            MapGrid::LatLong(grid) => grid.taps(central),
            MapGrid::Cube(cube) => cube.taps(central),
        };
        if self.map.view() == View::Global {
            self.look(index[0], view);
        }
        let mut sum = [0.0; 3];
        for (texel, weight) in index.into_iter().zip(weight) {
            if self.map.view() == View::Local {
                self.look(texel, view);
            }
            let value = self.dot(texel);
            for channel in 0..3 {
                sum[channel] += weight * value[channel];
            }
        }
        sum.map(|v| v as f32)
    }

    /// Radiance toward `view` (the world's frame) at a texel's own central direction, unfiltered.
    ///
    /// # Panics
    /// If `texel` is not below the number of texels.
    pub fn texel(&mut self, texel: usize, view: Direction) -> [f64; 3] {
        self.look(texel, view);
        self.dot(texel)
    }

    /// Sets the harmonics at a view, in the frame that a texel's coefficients are over.
    fn look(&mut self, texel: usize, view: Direction) {
        let map = self.map;
        match (map.view(), map.terms()) {
            // Y_00 alone is the same from everywhere, and is set from the start.
            _ if self.harmonics.len() == 1 => {}
            (View::Local, Terms::Zonal) => {
                let cosine = map.grid().direction(texel).dot(view).clamp(-1.0, 1.0);
                zonal_into(cosine, &mut self.harmonics);
            }
            (View::Local, Terms::All) => {
                let outgoing = into_frame(map.grid().direction(texel), view);
                self.basis.evaluate_into(outgoing, &mut self.harmonics);
            }
            (View::Global, _) => self.basis.evaluate_into(view, &mut self.harmonics),
        }
    }

    fn dot(&self, texel: usize) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (value, y) in self.map.texel(texel).iter().zip(&self.harmonics) {
            for channel in 0..3 {
                sum[channel] += f64::from(value[channel]) * y;
            }
        }
        sum
    }
}

impl Shrm {
    /// The map, ready for many look-ups.
    pub fn lookup(&self) -> Lookup<'_> {
        let y_00 = 1.0 / (4.0 * PI).sqrt();
        Lookup { map: self, basis: Basis::new(self.p()), harmonics: vec![y_00; self.rows()] }
    }

    /// One look-up: [`Lookup::radiance`].
    pub fn radiance(&self, central: Direction, view: Direction) -> [f32; 3] {
        self.lookup().radiance(central, view)
    }

    /// Equation 12: the radiance toward one view in the world's frame at every texel's central direction, a
    /// plain reflection map for a distant viewer.
    ///
    /// Shape as [`MapGrid::shape`], RGB. Work is O(P^2) per texel.
    pub fn view_map(&self, view: Direction) -> Vec<[f32; 3]> {
        const BLOCK: usize = 256;
        let mut values = vec![[0.0; 3]; self.grid().len()];
        values.par_chunks_mut(BLOCK).enumerate().for_each(|(block, values)| {
            let mut lookup = self.lookup();
            for (texel, value) in (block * BLOCK..).zip(values) {
                *value = lookup.texel(texel, view).map(|v| v as f32);
            }
        });
        values
    }
}
