//! Cabral's maps: twelve reflection maps, one for each vertex of an icosahedron as the view (Cabral, Olano
//! and Nemec 1999; [RH02, app. C]).
//!
//! Map k holds [RH02, eq. 12] at the view V_k: B(C, V_k) for every central direction C. Between vertices the
//! three maps around a view are blended by [`icosahedron::corners`]. All maps are looked up at the same C,
//! the reflection vector: the warp between views that Cabral needed is the reparameterisation about R.

use brdf::Centre;
use sh::{Degree, Stop, Stopped};
use sphere::Direction;

use crate::blocks::for_each;
use crate::{Fit, FitError, Lamps, MapGrid, Shrm, View, fit_views, icosahedron};

/// Twelve view maps at the vertices of an icosahedron.
#[derive(Clone, Debug, PartialEq)]
pub struct Cabral {
    grid: MapGrid,
    centre: Centre,
    maps: Vec<[f32; 3]>,
}

impl Cabral {
    /// Samples the maps of a spherical harmonic reflection map at the vertices, local or global.
    pub fn from_shrm(map: &Shrm) -> Self {
        let maps = icosahedron::vertices().into_iter().flat_map(|view| map.view_map(view)).collect();
        Self { grid: map.grid(), centre: map.centre(), maps }
    }

    /// Adds lamps that the map did not hold: exact at the twelve views. `stop` is asked once for each of the
    /// [`blocks`](crate::blocks) of each map.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn with_lamps(mut self, lamps: &Lamps, stop: Stop<'_>) -> Result<Self, Stopped> {
        self.add(lamps, stop)?;
        Ok(self)
    }

    fn add(&mut self, lamps: &Lamps, stop: Stop<'_>) -> Result<(), Stopped> {
        let (grid, lamps) = (self.grid, lamps.for_views());
        let mut maps = self.maps.chunks_exact_mut(grid.len()).zip(icosahedron::vertices());
        maps.try_for_each(|(map, view)| {
            for_each(map, stop, |texel, value| {
                *value = lamps.added(*value, grid.direction(texel), view);
            })
        })
    }

    /// The maps as a renderer has them, shape [12, texels], in the order of [`icosahedron::vertices`]; `None`
    /// if their number does not fit or there is no texel.
    pub fn new(grid: MapGrid, centre: Centre, maps: Vec<[f32; 3]>) -> Option<Self> {
        (maps.len() == 12 * grid.len() && !grid.is_empty()).then_some(Self { grid, centre, maps })
    }

    /// The grid on which the texels lie.
    pub fn grid(&self) -> MapGrid {
        self.grid
    }

    /// The kind of the texels' directions: reflection vectors, normals or tangents.
    pub fn centre(&self) -> Centre {
        self.centre
    }

    /// The map of a vertex; shape as [`MapGrid::shape`].
    ///
    /// # Panics
    /// If `vertex` is not below 12.
    pub fn map(&self, vertex: usize) -> &[[f32; 3]] {
        &self.maps[vertex * self.grid.len()..][..self.grid.len()]
    }

    /// All maps, shape [12, texels].
    pub fn maps(&self) -> &[[f32; 3]] {
        &self.maps
    }

    /// Radiance toward `view` (the world's frame) about a central direction, as a renderer that has only
    /// these maps interpolates it: bilinear in the maps, by the icosahedron's weights between them.
    pub fn radiance(&self, central: Direction, view: Direction) -> [f32; 3] {
        Self::interpolated(self.grid, central, view, |vertex, texel| self.map(vertex)[texel])
    }

    /// [`Cabral::radiance`] of maps that are not made: `value` returns the value of a vertex's map at a
    /// texel, of which each look-up needs twelve.
    pub fn interpolated(
        grid: MapGrid,
        central: Direction,
        view: Direction,
        mut value: impl FnMut(usize, usize) -> [f32; 3],
    ) -> [f32; 3] {
        let taps = grid.taps(central);
        let corners = icosahedron::corners(view);
        let mut sum = [0.0; 3];
        for (vertex, weight) in corners.vertices.into_iter().zip(corners.weights) {
            let value = taps.blend_by(|texel| value(vertex, texel));
            for channel in 0..3 {
                sum[channel] += weight * value[channel];
            }
        }
        sum.map(|value| value as f32)
    }

    /// A global map fitted to the twelve, by least squares for each texel ([`fit_views`]).
    ///
    /// Twelve views determine P = 2 at most. A field with P <= 2 comes back to f32 rounding: the vertices are
    /// a spherical design of degree 5, on which the harmonics up to degree 2 are orthogonal. If the field has
    /// more, degrees 4 and up fold into the coefficients.
    ///
    /// # Errors
    /// The errors of [`fit_views`].
    pub fn fit(&self, p: Option<Degree>) -> Result<Fit, FitError> {
        fit_views(self.grid, self.centre, View::Global, &icosahedron::vertices(), &self.maps, p)
    }
}
