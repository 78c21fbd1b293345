//! Near light: lightings at points, blended at each vertex [KSS02, sec. 4].
//!
//! Light that is not far away differs over an object. It is known at P points, as the series L_k of the light
//! that arrives there, and is blended by the squares of the inverse distances (Shepard, "A Two-Dimensional
//! Interpolation Function for Irregularly-Spaced Data", 1968):
//!
//! > L(p) = sum over k of w_k L_k, w_k = |p - x_k|^-2 / sum over j of |p - x_j|^-2
//!
//! The weights sum to 1 and are not negative, so that a blend is never brighter than all of its points. It is
//! smooth, is L_k at the point x_k itself, needs no order or connection of the points, and is their mean far
//! away from them. A factor on all distances changes nothing.
//!
//! Radiance is linear in the light: under the blend it is the blend of the radiances under each L_k, with
//! transfer of any form or without.

use std::convert::Infallible;

use brdf::BrdfTable;
use rayon::prelude::*;
use sh::{Degree, Expansion};

use crate::frames::{Frames, Viewer};
use crate::matte::NotMatte;
use crate::shading::FixedView;
use crate::stored::StoredTransfer;

/// Light at points.
#[derive(Clone, Debug, PartialEq)]
pub struct LightField {
    degree: Degree,
    points: Vec<[f64; 3]>,
    lights: Vec<Expansion>,
}

/// Why points and lights are not a light field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LightFieldError {
    /// There is no point.
    #[error("a light field needs at least one point")]
    Empty,
    /// There is not one light for each point.
    #[error("{points} points and {lights} lights")]
    Count {
        /// The number of points P.
        points: usize,
        /// The number of lights.
        lights: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("point {0} has a coordinate that is not finite")]
    NotFinite(usize),
    /// Two points are in one place, which would have two lights.
    #[error("points {0} and {1} are the same place")]
    SamePlace(usize, usize),
}

/// The square of the distance of a vertex to the nearest point, and the sum of its weights relative to that
/// of this point.
struct Nearest {
    square: f64,
    total: f64,
}

impl LightField {
    /// The light at each point, extended to the highest degree of all.
    ///
    /// # Errors
    /// If there is no point, not one light for each, a coordinate is not finite, or two points are the same.
    ///
    /// # Example: between two points lies the mean of their lights
    /// ```
    /// use sh::{Degree, Expansion};
    /// let sky = |radiance| Expansion::from_coefficients(Degree::ZERO, vec![[radiance; 3]]).unwrap();
    /// let points = vec![[0.0, 0.0, 1.0], [2.0, 0.0, 1.0]];
    /// let field = transfer::LightField::new(points, vec![sky(1.0), sky(3.0)])?;
    /// assert_eq!(field.at([1.0, 5.0, 0.0]), sky(2.0));
    /// assert_eq!(field.at([2.0, 0.0, 1.0]), sky(3.0));
    /// # Ok::<(), transfer::LightFieldError>(())
    /// ```
    pub fn new(points: Vec<[f64; 3]>, lights: Vec<Expansion>) -> Result<Self, LightFieldError> {
        if points.len() != lights.len() {
            return Err(LightFieldError::Count { points: points.len(), lights: lights.len() });
        }
        if let Some(bad) = points.iter().position(|point| !point.iter().all(|x| x.is_finite())) {
            return Err(LightFieldError::NotFinite(bad));
        }
        for (k, point) in points.iter().enumerate() {
            if let Some(same) = points[..k].iter().position(|other| other == point) {
                return Err(LightFieldError::SamePlace(same, k));
            }
        }
        let degree = lights.iter().map(Expansion::degree).max().ok_or(LightFieldError::Empty)?;
        Ok(Self { degree, points, lights: lights.iter().map(|light| light.to_degree(degree)).collect() })
    }

    /// The degree of all lights.
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// The points x_k, [P, 3].
    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// The light L_k at each point.
    pub fn lights(&self) -> &[Expansion] {
        &self.lights
    }

    /// The weight w_k of each point at a place.
    pub fn weights(&self, place: [f64; 3]) -> impl Iterator<Item = f64> {
        let nearest = self.nearest(place);
        self.points.iter().map(move |point| nearest.weight(square(*point, place)))
    }

    /// The light at a place.
    pub fn at(&self, place: [f64; 3]) -> Expansion {
        let mut sum = Expansion::zero(self.degree);
        for (weight, light) in self.weights(place).zip(&self.lights) {
            for (sum, row) in sum.coefficients_mut().iter_mut().zip(light.coefficients()) {
                (0..3).for_each(|channel| sum[channel] += weight * row[channel]);
            }
        }
        sum
    }

    /// The field with light from far away added, the same at all points; it has the higher of both degrees.
    #[must_use]
    pub fn plus(&self, light: &Expansion) -> Self {
        let degree = self.degree.max(light.degree());
        let plus = |own: &Expansion| {
            let mut sum = own.to_degree(degree);
            for (sum, row) in sum.coefficients_mut().iter_mut().zip(light.coefficients()) {
                (0..3).for_each(|channel| sum[channel] += row[channel]);
            }
            sum
        };
        Self { degree, points: self.points.clone(), lights: self.lights.iter().map(plus).collect() }
    }

    /// The field with another light of the same degree at each point, made from the one there.
    #[must_use]
    pub fn with_lights(&self, other: impl Fn(&Expansion) -> Expansion) -> Self {
        let lights = self.lights.iter().map(|light| other(light).to_degree(self.degree));
        Self { degree: self.degree, points: self.points.clone(), lights: lights.collect() }
    }

    /// The radiance of each vertex, RGB, as [`crate::shade`] has it under the light at the vertex. Uses all
    /// threads; the result does not depend on their number.
    pub fn shade(&self, frames: &Frames, table: &BrdfTable, viewer: Viewer) -> Vec<[f32; 3]> {
        let view = FixedView::new(frames, table, viewer);
        let found = self.blended(frames, |light| Ok::<_, Infallible>(view.shade(light)));
        found.unwrap_or_else(|never| match never {})
    }

    /// [`LightField::shade`] with what the mesh hides and, if that was baked, reflects.
    ///
    /// # Errors
    /// If the transfer is matte and the table is not.
    ///
    /// # Panics
    /// If there are not as many vertices as frames.
    pub fn shade_with_transfer(
        &self,
        frames: &Frames,
        table: &BrdfTable,
        viewer: Viewer,
        transfer: &StoredTransfer,
    ) -> Result<Vec<[f32; 3]>, NotMatte> {
        self.blended(frames, |light| transfer.shade(frames, table, viewer, light))
    }

    /// Blends the radiance that `shade` makes of the light of each point.
    fn blended<E>(
        &self,
        frames: &Frames,
        shade: impl Fn(&Expansion) -> Result<Vec<[f32; 3]>, E>,
    ) -> Result<Vec<[f32; 3]>, E> {
        let places = || frames.positions().par_iter().map(|place| place.map(f64::from));
        let nearest: Vec<Nearest> = places().map(|place| self.nearest(place)).collect();
        let mut sum = vec![[0.0; 3]; frames.len()];
        for (point, light) in self.points.iter().zip(&self.lights) {
            let own = shade(light)?;
            let of_vertex = sum.par_iter_mut().zip(own).zip(places()).zip(&nearest);
            of_vertex.for_each(|(((sum, own), place), nearest)| {
                let weight = nearest.weight(square(*point, place)) as f32;
                (0..3).for_each(|channel| sum[channel] += weight * own[channel]);
            });
        }
        Ok(sum)
    }

    fn nearest(&self, place: [f64; 3]) -> Nearest {
        let squares = || self.points.iter().map(|point| square(*point, place));
        let least = squares().fold(f64::INFINITY, f64::min);
        Nearest { square: least, total: squares().map(|square| relative(least, square)).sum() }
    }
}

impl Nearest {
    /// The weight of the point at this squared distance.
    fn weight(&self, square: f64) -> f64 {
        relative(self.square, square) / self.total
    }
}

/// The weight of a point relative to that of the nearest one; at that point itself, the others have none.
fn relative(least: f64, square: f64) -> f64 {
    if square == least { 1.0 } else { least / square }
}

fn square(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| math::powi(a[axis] - b[axis], 2)).sum()
}
