//! Explicit reflection maps for T x T views: the full four-dimensional table (paper 1, section 5.2 and appendix C).
//!
//! The views are the texels of a lat-long image of T rows and T columns: theta_j = pi (j + 1/2) / T and
//! phi_k = 2 pi (1/2 - (k + 1/2) / T). They are over V in the world where the map that they are made from is global, and
//! over w_o in the frame of each texel where it is local (the paper's B(alpha, beta, theta_o, phi_o)). Global maps suit a
//! renderer better: each is a plain reflection map, smooth over the sphere, while local ones turn about
//! the poles with the frames of their texels, so that every tap needs a view of its own.
//!
//! With Y_pq = f_p|q|(theta) times cos(q phi) or sin(|q| phi), the sums separate:
//!
//! > c_q(theta) = sum over p of B_pq f_pq(theta), s_q likewise of B_p,-q,
//! > B(theta, phi) = sum over q of c_q(theta) cos(q phi) + s_q(theta) sin(q phi),
//!
//! O(P^2) for each texel and theta, O(P) for each texel and view: O(P) for each value where T > P.

use brdf::Centre;
use rayon::prelude::*;
use sh::{Basis, Degree};
use sphere::{Direction, LatLong};

use crate::{Fit, FitError, MapGrid, Shrm, Terms, View, fit_views, into_frame};

/// Reflection maps for the T x T views of a lat-long grid.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewMaps {
    grid: MapGrid,
    view: View,
    centre: Centre,
    side: usize,
    maps: Vec<[f32; 3]>,
}

impl ViewMaps {
    /// The maps of a spherical harmonic reflection map for `side` x `side` views, over the directions that its
    /// coefficients are over; `None` where `side` is 0.
    pub fn from_shrm(map: &Shrm, side: usize) -> Option<Self> {
        if side == 0 {
            return None;
        }
        let (grid, p) = (map.grid(), map.p().get());
        let views = LatLong { width: side, height: side };
        let turns: Vec<Vec<[f64; 2]>> = (0..side)
            .map(|column| (0..=p).map(|q| (q as f64 * views.phi(column)).sin_cos().into()).collect())
            .collect();
        let basis = Basis::new(map.p());
        let mut maps = vec![[0.0; 3]; side * side * grid.len()];
        maps.par_chunks_mut(side * grid.len()).enumerate().for_each(|(row, maps)| {
            // At phi = 0 the rows q >= 0 are f_pq.
            let mut f = vec![0.0; map.p().rows()];
            basis.evaluate_into(Direction::from_angles(views.theta(row), 0.0), &mut f);
            let mut sums = vec![[[0.0; 3]; 2]; p + 1];
            for texel in 0..grid.len() {
                sum_over_p(map, texel, &f, &mut sums);
                for (column, turns) in turns.iter().enumerate() {
                    let mut value = [0.0; 3];
                    for ([c, s], [sine, cosine]) in sums.iter().zip(turns) {
                        for channel in 0..3 {
                            value[channel] += c[channel] * cosine + s[channel] * sine;
                        }
                    }
                    maps[column * grid.len() + texel] = value.map(|value| value as f32);
                }
            }
        });
        Some(Self { grid, view: map.view(), centre: map.centre(), side, maps })
    }

    /// The maps as a renderer has them, shape [T, T, texels], rows of theta, columns of phi; `None` where their
    /// number does not fit or there is none.
    pub fn new(grid: MapGrid, view: View, centre: Centre, side: usize, maps: Vec<[f32; 3]>) -> Option<Self> {
        let fits = side > 0 && !grid.is_empty() && maps.len() == side * side * grid.len();
        fits.then_some(Self { grid, view, centre, side, maps })
    }

    /// Where the texels lie.
    pub fn grid(&self) -> MapGrid {
        self.grid
    }

    /// Which directions the views are.
    pub fn view(&self) -> View {
        self.view
    }

    /// What the texels' directions are.
    pub fn centre(&self) -> Centre {
        self.centre
    }

    /// T: the views are T x T.
    pub fn side(&self) -> usize {
        self.side
    }

    /// The T x T views, row by row, in the frame that [`ViewMaps::view`] says.
    pub fn views(&self) -> Vec<Direction> {
        let views = LatLong { width: self.side, height: self.side };
        (0..views.len()).map(|k| views.direction(k / self.side, k % self.side)).collect()
    }

    /// The map of a view; shape as [`MapGrid::shape`].
    ///
    /// # Panics
    /// Where `view` is not below T x T.
    pub fn map(&self, view: usize) -> &[[f32; 3]] {
        &self.maps[view * self.grid.len()..][..self.grid.len()]
    }

    /// All maps, shape [T, T, texels].
    pub fn maps(&self) -> &[[f32; 3]] {
        &self.maps
    }

    /// Radiance toward `view` (the world's frame) about a central direction, as a renderer that has only these maps
    /// interpolates it: bilinear in the maps and bilinear between the views; of a local table each of the four
    /// texels takes the view in its own frame.
    pub fn radiance(&self, central: Direction, view: Direction) -> [f32; 3] {
        let views = MapGrid::LatLong(LatLong { width: self.side, height: self.side });
        let taps = self.grid.taps(central);
        let mut sum = [0.0; 3];
        for (texel, weight) in taps.index.into_iter().zip(taps.weight) {
            let view = match self.view {
                View::Global => view,
                View::Local => into_frame(self.grid.direction(texel), view),
            };
            let between = views.taps(view);
            for (map, share) in between.index.into_iter().zip(between.weight) {
                let value = self.maps[map * self.grid.len() + texel];
                for channel in 0..3 {
                    sum[channel] += weight * share * f64::from(value[channel]);
                }
            }
        }
        sum.map(|value| value as f32)
    }

    /// A map with all terms fitted to the views, by least squares for each texel ([`fit_views`]), local or global as
    /// these are.
    ///
    /// T x T views determine P = (T - 1) / 2: a field with no more comes back to f32 rounding.
    ///
    /// # Errors
    /// As [`fit_views`].
    pub fn fit(&self, p: Option<Degree>) -> Result<Fit, FitError> {
        fit_views(self.grid, self.centre, self.view, &self.views(), &self.maps, p)
    }
}

/// The sums over p at one theta: c_q and s_q for q = 0 to P.
fn sum_over_p(map: &Shrm, texel: usize, f: &[f64], sums: &mut [[[f64; 3]; 2]]) {
    sums.fill([[0.0; 3]; 2]);
    let values = map.texel(texel);
    for p in 0..=map.p().get() {
        let middle = p * p + p;
        if map.terms() == Terms::Zonal {
            add(&mut sums[0][0], values[p], f[middle]);
            continue;
        }
        add(&mut sums[0][0], values[middle], f[middle]);
        for q in 1..=p {
            add(&mut sums[q][0], values[middle + q], f[middle + q]);
            add(&mut sums[q][1], values[middle - q], f[middle + q]);
        }
    }
}

fn add(sum: &mut [f64; 3], value: [f32; 3], factor: f64) {
    for channel in 0..3 {
        sum[channel] += f64::from(value[channel]) * factor;
    }
}
