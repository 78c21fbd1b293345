//! The spherical harmonic reflection map: for each central direction on a grid, the coefficients of the light
//! reflected toward every view [RH02, sec. 4, eqs. 6 and 7].
//!
//! B(C, w_o) = sum over p <= P, |q| <= p of B_pq(C) Y_pq(w_o), real harmonics, row p*p + p + q. In a local
//! map w_o is the view in the frame of the central direction C, w_o = R^-1 V with R = R_z(beta) R_y(alpha);
//! in a global map it is the view V itself. The frames of a local map spin around the poles, so that its
//! coefficients are never blended: each texel is evaluated in its own frame, then the values are blended.

use brdf::Centre;
use envmap::{Taps, Texels};
use sh::Degree;
use sphere::{Cube, DVec3, Direction, Face, LatLong, Rotation, Zyz};

/// Where the texels of a map lie on the sphere of central directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MapGrid {
    /// Rows of constant colatitude.
    LatLong(LatLong),
    /// Six faces in file order.
    Cube(Cube),
}

impl MapGrid {
    /// The number of texels.
    pub fn len(self) -> usize {
        match self {
            Self::LatLong(grid) => grid.len(),
            Self::Cube(cube) => cube.len(),
        }
    }

    /// Whether there is no texel.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// The number of faces, rows and columns: 1, height, width of a lat-long map; 6, edge, edge of a cube.
    pub fn shape(self) -> [usize; 3] {
        match self {
            Self::LatLong(LatLong { width, height }) => [1, height, width],
            Self::Cube(Cube { edge }) => [6, edge, edge],
        }
    }

    /// The direction of a texel's centre; texels count along rows, rows along faces.
    ///
    /// # Panics
    /// If `texel` is not below [`MapGrid::len`].
    pub fn direction(self, texel: usize) -> Direction {
        match self {
            Self::LatLong(grid) => grid.direction(texel / grid.width, texel % grid.width),
            Self::Cube(cube) => {
                let (face, rest) = (texel / (cube.edge * cube.edge), texel % (cube.edge * cube.edge));
                cube.direction(Face::ALL[face], rest / cube.edge, rest % cube.edge)
            }
        }
    }

    /// The four texels around a direction and their bilinear weights, over the seam, poles, edges and
    /// corners.
    pub fn taps(self, direction: Direction) -> Taps {
        match self {
            Self::LatLong(grid) => grid.taps(direction),
            Self::Cube(cube) => cube.taps(direction),
        }
    }

    /// The solid angle of a texel, in steradians.
    pub fn solid_angle(self, texel: usize) -> f64 {
        match self {
            Self::LatLong(grid) => grid.solid_angle(texel / grid.width),
            Self::Cube(cube) => {
                let rest = texel % (cube.edge * cube.edge);
                cube.solid_angle(rest / cube.edge, rest % cube.edge)
            }
        }
    }
}

/// The frame of the views that a map's coefficients are over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum View {
    /// Views w_o = R^-1 V in the frame of the central direction.
    Local,
    /// Views V in the world's frame.
    Global,
}

impl View {
    /// The view V in the world, of one that is given in this frame about a central direction.
    pub fn to_world(self, central: Direction, view: Direction) -> Direction {
        match self {
            Self::Global => view,
            Self::Local => frame(central).apply(view),
        }
    }
}

/// Which coefficients a map keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Terms {
    /// All (P+1)^2 coefficients, row p*p + p + q.
    All,
    /// The coefficients with q = 0, row p: all that a local map of a BRDF without azimuth has.
    Zonal,
}

/// A spherical harmonic reflection map.
#[derive(Clone, Debug, PartialEq)]
pub struct Shrm {
    pub(crate) grid: MapGrid,
    pub(crate) view: View,
    pub(crate) centre: Centre,
    pub(crate) p: Degree,
    pub(crate) terms: Terms,
    pub(crate) values: Vec<[f32; 3]>,
}

impl Shrm {
    /// Makes a map from its values, shape [texels, rows], RGB; `None` if their number does not fit, there is
    /// no texel, or a global map keeps zonal terms only (a rotation mixes q).
    pub fn new(
        grid: MapGrid,
        view: View,
        centre: Centre,
        p: Degree,
        terms: Terms,
        values: Vec<[f32; 3]>,
    ) -> Option<Self> {
        let map = Self { grid, view, centre, p, terms, values };
        let fits = map.values.len() == grid.len() * map.rows() && !grid.is_empty();
        (fits && (terms, view) != (Terms::Zonal, View::Global)).then_some(map)
    }

    /// The grid on which the texels lie.
    pub fn grid(&self) -> MapGrid {
        self.grid
    }

    /// The frame of the views that the coefficients are over.
    pub fn view(&self) -> View {
        self.view
    }

    /// The kind of the texels' directions: reflection vectors, normals or tangents.
    pub fn centre(&self) -> Centre {
        self.centre
    }

    /// The degree P in the view.
    pub fn p(&self) -> Degree {
        self.p
    }

    /// Which coefficients are kept.
    pub fn terms(&self) -> Terms {
        self.terms
    }

    /// The number of coefficients kept per texel: (P+1)^2, or P+1 zonal ones.
    pub fn rows(&self) -> usize {
        match self.terms {
            Terms::All => self.p.rows(),
            Terms::Zonal => self.p.get() + 1,
        }
    }

    /// The values, shape [texels, rows], RGB.
    pub fn values(&self) -> &[[f32; 3]] {
        &self.values
    }

    /// Returns the map cut at a lower degree P in the view, or the map itself if it has no more: the first
    /// coefficients of each texel. It is the map that the cut field has, but not the nearest one of so few
    /// coefficients if lamps were fitted into this one.
    #[must_use]
    pub fn cut(&self, p: Degree) -> Self {
        let (grid, view, centre, terms) = (self.grid, self.view, self.centre, self.terms);
        let mut cut = Self { grid, view, centre, p: self.p.min(p), terms, values: Vec::new() };
        let rows = cut.rows();
        let texels = self.values.chunks_exact(self.rows());
        cut.values = texels.flat_map(|texel| &texel[..rows]).copied().collect();
        cut
    }

    /// The coefficients of a texel.
    ///
    /// # Panics
    /// If `texel` is not below the number of texels.
    pub fn texel(&self, texel: usize) -> &[[f32; 3]] {
        let rows = self.rows();
        &self.values[texel * rows..][..rows]
    }
}

/// The rotation R_z(beta) R_y(alpha), which takes +Z to the central direction (alpha, beta). At the poles
/// beta is 0.
pub fn frame(central: Direction) -> Rotation {
    Rotation::from_zyz(Zyz { alpha: central.phi(), beta: central.theta(), gamma: 0.0 })
}

/// Takes a view in the world to w_o = R^-1 V, R being the [`frame`] of a central direction, without angles.
pub fn into_frame(central: Direction, view: Direction) -> Direction {
    let (c, v) = (central.vector(), view.vector());
    let sine = math::hypot(c.x, c.y);
    let (x, y) = if sine > 0.0 { (c.x / sine, c.y / sine) } else { (1.0, 0.0) };
    let south = DVec3::new(c.z * x, c.z * y, -sine);
    Direction::normalised(DVec3::new(v.dot(south), v.y * x - v.x * y, v.dot(c)))
}

#[cfg(test)]
mod tests {
    use brdf::{Choice, Lambert, Material, Microfacet, project};
    use sh::{Expansion, Stop};

    use super::*;
    use crate::Reflection;

    #[test]
    fn a_map_that_is_cut_is_that_of_the_cut_field() {
        let degree = Degree::new(6).unwrap();
        let rows = (0..degree.rows()).map(|row| [1.0 / (row + 1) as f64, 0.3, 0.2]).collect();
        let light = Expansion::from_coefficients(degree, rows).unwrap();
        let grid = MapGrid::Cube(Cube { edge: 4 });
        for material in [
            Material::Microfacet(Microfacet::new(0.3, [1.0; 3]).unwrap()),
            Material::Lambert(Lambert::new([0.5; 3]).unwrap()),
        ] {
            let brdf = project(&material, Choice::Degree { f: degree, p: degree }, Stop::NEVER).unwrap();
            let field = Reflection::convolve(&light, &brdf.coefficients);
            let map = field.synthesise(grid, View::Local, Stop::NEVER).unwrap();
            for p in [0, 2, 6].map(|p| Degree::new(p).unwrap()) {
                let cut = map.cut(p);
                let right = field.cut_in_view(p).synthesise(grid, View::Local, Stop::NEVER).unwrap();
                assert_eq!((cut.p(), cut.values().len()), (map.p().min(p), grid.len() * cut.rows()));
                for texel in 0..grid.len() {
                    for (found, right) in cut.texel(texel).iter().zip(right.texel(texel)) {
                        assert!((0..3).all(|c| (found[c] - right[c]).abs() < 1e-5), "{found:?} {right:?}");
                    }
                }
            }
        }
    }
}
