//! Explicit reflection maps, one for each of several views, for renderers without spherical harmonics
//! [RH02, sec. 5.2 and app. C].
//!
//! Map k holds [RH02, eq. 12] at its view: B(C, V_k) for every central direction C. All maps are looked up at
//! the same C: the warp between views that Cabral needed is the reparameterisation about R. [`MapViews`] are
//! the sets of views that renderers know, each with its own interpolation between them.

use brdf::Centre;
use sh::{Degree, Stop, Stopped};
use sphere::{Direction, LatLong};

use crate::azimuth::mean_slices;
use crate::blocks::for_each;
use crate::mean_lobe::{DiskMeans, MeanLobe};
use crate::view_table::view_table;
use crate::{Fit, FitError, Lamps, MapGrid, Shrm, View, fit_angles, fit_views, icosahedron, into_frame};

/// The views for which a [`ViewSet`] has maps.
#[derive(Clone, Debug, PartialEq)]
pub enum MapViews {
    /// The twelve vertices of an icosahedron, in the order of [`icosahedron::vertices`]: Cabral's maps
    /// (Cabral, Olano and Nemec 1999). The three maps around a view are blended by [`icosahedron::corners`].
    Icosahedron,
    /// Angles theta_o between central direction and view, in radians, rising from 0 or more to pi or less:
    /// the slices of Kautz and McCool's 3D texture (Kautz and McCool 2000). A slice is the mean around the
    /// central direction; between slices it is linear in the angle.
    Angles(Vec<f64>),
    /// T x T views, the texels of a lat-long image of T rows and T columns, row by row: theta_j = pi (j +
    /// 1/2) / T and phi_k = 2 pi (1/2 - (k + 1/2) / T). Between them it is bilinear, as in such an image.
    ///
    /// Global maps suit a renderer better: each is a plain reflection map, smooth over the sphere, while
    /// local ones turn about the poles with the frames of their texels, so that every tap needs a view of its
    /// own.
    Table {
        /// The number T.
        side: usize,
        /// The frame of the views: V in the world, or w_o in the frame of each texel (the B(alpha, beta,
        /// theta_o, phi_o) of [RH02, sec. 3.2]).
        view: View,
    },
}

impl MapViews {
    /// `count` angles from 0 to pi, both included, in radians: theta_k = pi k / (count - 1). One angle is 0.
    ///
    /// In cos(theta) they are the Chebyshev points, on which a fit is well conditioned up to P = count - 1.
    pub fn even_angles(count: usize) -> Self {
        let steps = count.saturating_sub(1).max(1) as f64;
        Self::Angles((0..count).map(|k| std::f64::consts::PI * k as f64 / steps).collect())
    }

    /// The number of maps.
    pub fn count(&self) -> usize {
        match self {
            Self::Icosahedron => icosahedron::vertices().len(),
            Self::Angles(angles) => angles.len(),
            Self::Table { side, .. } => side * side,
        }
    }

    /// The angles; none if the maps are for directions.
    pub fn angles(&self) -> &[f64] {
        if let Self::Angles(angles) = self { angles } else { &[] }
    }

    /// The views, in the frame that [`MapViews::frame`] names; none if the maps are for angles.
    pub fn directions(&self) -> Vec<Direction> {
        match self {
            Self::Icosahedron => icosahedron::vertices().to_vec(),
            Self::Angles(_) => Vec::new(),
            Self::Table { side, .. } => {
                let views = LatLong { width: *side, height: *side };
                (0..views.len()).map(|k| views.direction(k / side, k % side)).collect()
            }
        }
    }

    /// The frame of the views. Angles are in that of each texel.
    pub fn frame(&self) -> View {
        match self {
            Self::Icosahedron => View::Global,
            Self::Angles(_) => View::Local,
            Self::Table { view, .. } => *view,
        }
    }

    /// Radiance toward `view` (the world's frame) about a central direction, as a renderer that has only
    /// these maps interpolates it: bilinear in the maps, and between them as [`MapViews`] says; beyond the
    /// first and last angle, their slices. Of a local table each of the four texels takes the view in its own
    /// frame. `value` returns the value of a map at a texel.
    ///
    /// # Panics
    /// If there is no map.
    pub fn interpolated(
        &self,
        grid: MapGrid,
        central: Direction,
        view: Direction,
        mut value: impl FnMut(usize, usize) -> [f32; 3],
    ) -> [f32; 3] {
        let taps = grid.taps(central);
        match self {
            Self::Icosahedron => {
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
            Self::Angles(angles) => {
                let angle = math::atan2(central.vector().cross(view.vector()).length(), central.dot(view));
                let above = angles.partition_point(|slice| *slice <= angle);
                let (low, high) = (above.saturating_sub(1), above.min(angles.len() - 1));
                let share =
                    if low == high { 0.0 } else { (angle - angles[low]) / (angles[high] - angles[low]) };
                let [a, b] = [low, high].map(|slice| taps.blend_by(|texel| value(slice, texel)));
                [0, 1, 2]
                    .map(|channel| (a[channel] + share.clamp(0.0, 1.0) * (b[channel] - a[channel])) as f32)
            }
            Self::Table { side, view: kind } => {
                let views = MapGrid::LatLong(LatLong { width: *side, height: *side });
                let mut sum = [0.0; 3];
                for (texel, weight) in taps.index.into_iter().zip(taps.weight) {
                    let view = match kind {
                        View::Global => view,
                        View::Local => into_frame(grid.direction(texel), view),
                    };
                    let between = views.taps(view);
                    for (map, share) in between.index.into_iter().zip(between.weight) {
                        let value = value(map, texel);
                        for channel in 0..3 {
                            sum[channel] += weight * share * f64::from(value[channel]);
                        }
                    }
                }
                sum.map(|value| value as f32)
            }
        }
    }

    /// Whether a renderer can look up a view: there is one, and angles rise within their range.
    fn is_valid(&self) -> bool {
        let inside = |angle: &f64| (0.0..=std::f64::consts::PI).contains(angle);
        let angles = self.angles();
        self.count() > 0 && angles.iter().all(inside) && angles.windows(2).all(|pair| pair[0] < pair[1])
    }
}

/// A reflection map for each of several views.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewSet {
    views: MapViews,
    grid: MapGrid,
    centre: Centre,
    maps: Vec<[f32; 3]>,
}

impl ViewSet {
    /// The maps of a spherical harmonic reflection map, over the directions that its coefficients are over.
    /// `None` if there is no view, the angles do not rise from 0 or more to pi or less, or the map is in
    /// another frame than the views of a table. `stop` is asked once for each map or every few milliseconds.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn from_shrm(map: &Shrm, views: MapViews, stop: Stop<'_>) -> Result<Option<Self>, Stopped> {
        if !views.is_valid() {
            return Ok(None);
        }
        let maps = match &views {
            MapViews::Icosahedron => {
                let mut maps = Vec::with_capacity(views.count() * map.grid().len());
                for view in icosahedron::vertices() {
                    stop.check()?;
                    maps.extend(map.view_map(view));
                }
                maps
            }
            MapViews::Angles(angles) => mean_slices(map, angles, stop)?,
            MapViews::Table { view, .. } if *view != map.view() => return Ok(None),
            MapViews::Table { side, .. } => view_table(map, *side, stop)?,
        };
        Ok(Some(Self { views, grid: map.grid(), centre: map.centre(), maps }))
    }

    /// Adds lamps that the map did not hold: exact at the views, and for angles in the mean about each
    /// texel's central direction. `stop` is asked once for each of the [`blocks`](crate::blocks) of each map.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn with_lamps(self, lamps: &Lamps, stop: Stop<'_>) -> Result<Self, Stopped> {
        // Single views need none.
        let disks = match self.views.angles() {
            [] => DiskMeans::default(),
            _ => DiskMeans::new(&lamps.lights),
        };
        self.with_lamps_over(lamps, &disks, stop)
    }

    /// [`ViewSet::with_lamps`] with the means over the disks of the lamps, which only angles need.
    ///
    /// # Errors
    /// If it was stopped.
    pub fn with_lamps_over(
        mut self,
        lamps: &Lamps,
        disks: &DiskMeans,
        stop: Stop<'_>,
    ) -> Result<Self, Stopped> {
        let (grid, kind, for_views) = (self.grid, self.views.frame(), lamps.for_views());
        for (map, view) in self.maps.chunks_exact_mut(grid.len()).zip(self.views.directions()) {
            for_each(map, stop, |texel, value| {
                let central = grid.direction(texel);
                *value = for_views.added(*value, central, kind.to_world(central, view));
            })?;
        }
        for (slice, angle) in self.maps.chunks_exact_mut(grid.len()).zip(self.views.angles()) {
            let lobe = MeanLobe::ring(&lamps.material, *angle);
            let ring = lobe.over(&lamps.lights, disks);
            for_each(slice, stop, |texel, value| {
                let lamps = ring.radiance(grid.direction(texel));
                *value = std::array::from_fn(|c| value[c].max(0.0) + lamps[c] as f32);
            })?;
        }
        Ok(self)
    }

    /// The maps as a renderer has them, shape [views, texels]; `None` if their number does not fit, there is
    /// no texel, or as for the views of [`ViewSet::from_shrm`].
    pub fn new(views: MapViews, grid: MapGrid, centre: Centre, maps: Vec<[f32; 3]>) -> Option<Self> {
        let fits = views.is_valid() && !grid.is_empty() && maps.len() == views.count() * grid.len();
        fits.then_some(Self { views, grid, centre, maps })
    }

    /// The views, or the angles, of the maps.
    pub fn views(&self) -> &MapViews {
        &self.views
    }

    /// The grid on which the texels of a map lie.
    pub fn grid(&self) -> MapGrid {
        self.grid
    }

    /// The kind of the texels' directions: reflection vectors, normals or tangents.
    pub fn centre(&self) -> Centre {
        self.centre
    }

    /// The map of a view; shape as [`MapGrid::shape`].
    ///
    /// # Panics
    /// If there is no such view.
    pub fn map(&self, view: usize) -> &[[f32; 3]] {
        &self.maps[view * self.grid.len()..][..self.grid.len()]
    }

    /// All maps, shape [views, texels].
    pub fn maps(&self) -> &[[f32; 3]] {
        &self.maps
    }

    /// Radiance toward `view` (the world's frame) about a central direction: [`MapViews::interpolated`].
    pub fn radiance(&self, central: Direction, view: Direction) -> [f32; 3] {
        self.views.interpolated(self.grid, central, view, |map, texel| self.map(map)[texel])
    }

    /// A spherical harmonic reflection map fitted to the maps, by least squares for each texel ([`fit_views`]
    /// and [`fit_angles`]). A field of a degree that the views determine comes back to f32 rounding:
    ///
    /// - Twelve views determine P = 2 at most, of a global map: the vertices are a spherical design of
    ///   degree 5, on which the harmonics up to degree 2 are orthogonal. Degrees 4 and up fold into the
    ///   coefficients.
    /// - K angles determine P = K - 1, of a local map of zonal terms.
    /// - T x T views determine P = (T - 1) / 2, local or global as they are.
    ///
    /// # Errors
    /// The errors of [`fit_views`].
    pub fn fit(&self, p: Option<Degree>) -> Result<Fit, FitError> {
        match &self.views {
            MapViews::Angles(angles) => fit_angles(self.grid, self.centre, angles, &self.maps, p),
            views => fit_views(self.grid, self.centre, views.frame(), &views.directions(), &self.maps, p),
        }
    }
}
