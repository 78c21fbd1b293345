//! The coefficients of rho_hat in spherical harmonics, and the direction that they are taken about.

use glam::{DMat3, DVec3};
use sh::Degree;
use sphere::Direction;

/// The direction that a BRDF is expanded about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Centre {
    /// The reflection vector R of the view.
    Reflection,
    /// The surface normal N.
    Normal,
    /// The surface tangent T.
    Tangent,
}

impl Centre {
    /// The central direction of a surface seen from `view`, all in the world's frame: the reflection of the
    /// view about the normal, 2 (N.V) N - V; the normal; or the tangent.
    pub fn central(self, normal: Direction, tangent: Direction, view: Direction) -> Direction {
        match self {
            Self::Reflection => {
                Direction::normalised(normal.vector() * (2.0 * normal.dot(view)) - view.vector())
            }
            Self::Normal => normal,
            Self::Tangent => tangent,
        }
    }

    /// Incident and outgoing direction in the frame of the surface (+Z the normal, +X the tangent), from the
    /// local frame whose +Z is the central direction.
    ///
    /// About R the normal lies half way from +Z to `outgoing` [RH02, sec. 3.1], and the surface's +X in the
    /// plane of both, on the side of `outgoing`. About N both frames are one. About T the normal is the local
    /// +X.
    pub fn surface(self, incident: Direction, outgoing: Direction) -> [Direction; 2] {
        let view = self.toward(outgoing);
        [view.incident(incident), view.outgoing()]
    }

    /// The part of [`Centre::surface`] that depends on the outgoing direction alone, for many incident ones.
    pub fn toward(self, outgoing: Direction) -> SurfaceView {
        let to_surface = self.surface_frame(outgoing);
        SurfaceView { to_surface, outgoing: Direction::normalised(to_surface * outgoing.vector()) }
    }

    /// The matrix that [`Centre::surface`] applies: from the local frame to that of the surface, which
    /// depends on the outgoing direction alone.
    pub fn surface_frame(self, outgoing: Direction) -> DMat3 {
        let rows = match self {
            Self::Normal => return DMat3::IDENTITY,
            Self::Tangent => [DVec3::Z, DVec3::Y * -1.0, DVec3::X],
            Self::Reflection => {
                let view = outgoing.vector();
                let across = DVec3::new(view.x, view.y, 0.0).try_normalize().unwrap_or(DVec3::X);
                let half = outgoing.theta() / 2.0;
                let normal = across * math::sin(half) + DVec3::Z * math::cos(half);
                let tangent = across * math::cos(half) - DVec3::Z * math::sin(half);
                [tangent, normal.cross(tangent), normal]
            }
        };
        DMat3::from_cols(rows[0], rows[1], rows[2]).transpose()
    }
}

/// A view of a surface in the frame of a central direction.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceView {
    to_surface: DMat3,
    outgoing: Direction,
}

impl SurfaceView {
    /// The outgoing direction in the frame of the surface.
    pub fn outgoing(&self) -> Direction {
        self.outgoing
    }

    /// An incident direction in the frame of the surface, from the frame of the central direction.
    pub fn incident(&self, incident: Direction) -> Direction {
        Direction::normalised(self.to_surface * incident.vector())
    }

    /// [`SurfaceView::incident`] up to rounding, faster.
    #[inline]
    pub(crate) fn incident_unnormalised(&self, incident: Direction) -> Direction {
        Direction::from_unit(self.to_surface * incident.vector())
    }
}

/// rho_hat(w_i, w_o) = sum rho_lpq Y*_lq(w_i) Y_pq(w_o), the BRDF times the incident cosine, in 1/sr.
///
/// `rho` has shape [F+1, P+1, P+1, 3], indexed l, p, q >= 0, RGB; it is real and even in q (isotropic).
/// Entries with q > min(l, p) are zero.
#[derive(Clone, Debug, PartialEq)]
pub struct BrdfCoefficients {
    centre: Centre,
    f: Degree,
    p: Degree,
    rho: Vec<[f64; 3]>,
}

impl BrdfCoefficients {
    /// Coefficients from their tensor; `None` if its length is not (F+1)(P+1)(P+1).
    pub fn new(centre: Centre, f: Degree, p: Degree, rho: Vec<[f64; 3]>) -> Option<Self> {
        (rho.len() == (f.get() + 1) * (p.get() + 1) * (p.get() + 1)).then_some(Self { centre, f, p, rho })
    }

    /// The direction that the expansion is about.
    pub fn centre(&self) -> Centre {
        self.centre
    }

    /// The degree in the incident direction, F.
    pub fn f(&self) -> Degree {
        self.f
    }

    /// The degree in the outgoing direction, P; 0 for a radially symmetric BRDF.
    pub fn p(&self) -> Degree {
        self.p
    }

    /// The tensor [F+1, P+1, P+1], RGB.
    pub fn rho(&self) -> &[[f64; 3]] {
        &self.rho
    }

    /// rho_lpq for q >= 0.
    pub fn get(&self, l: usize, p: usize, q: usize) -> [f64; 3] {
        let side = self.p.get() + 1;
        self.rho[(l * side + p) * side + q]
    }

    /// The highest p and the highest q with a coefficient that is not zero.
    pub fn highest(&self) -> (usize, usize) {
        let side = self.p.get() + 1;
        let used = self.rho.iter().enumerate().filter(|(_, rgb)| **rgb != [0.0; 3]);
        used.fold((0, 0), |(p, q), (index, _)| (p.max(index / side % side), q.max(index % side)))
    }

    /// Returns the coefficients with those of each l times a factor.
    #[must_use]
    pub fn scaled(&self, factor: impl Fn(usize) -> f64) -> Self {
        let per_l = (self.p.get() + 1) * (self.p.get() + 1);
        let mut rho = self.rho.clone();
        for (l, rows) in rho.chunks_exact_mut(per_l).enumerate() {
            rows.as_flattened_mut().iter_mut().for_each(|value| *value *= factor(l));
        }
        Self { rho, ..self.clone() }
    }

    /// Whether rho_hat does not depend on the azimuth between both directions: only q = 0 is used.
    pub fn is_azimuth_free(&self) -> bool {
        self.highest().1 == 0
    }

    /// Returns the same coefficients cut to a lower degree in the incident direction; unchanged if `f` is not
    /// lower.
    pub fn cut(&self, f: Degree) -> Self {
        self.cut_to(f, self.p)
    }

    /// Returns the same coefficients cut to lower degrees in the incident and the outgoing direction, as far
    /// as these are lower.
    pub fn cut_to(&self, f: Degree, p: Degree) -> Self {
        let (f, p) = (f.min(self.f), p.min(self.p));
        let (side, kept) = (self.p.get() + 1, p.get() + 1);
        let rows = self.rho.chunks_exact(side * side).take(f.get() + 1);
        let rho = rows
            .flat_map(|row| row.chunks_exact(side).take(kept).flat_map(|row| &row[..kept]))
            .copied()
            .collect();
        Self { centre: self.centre, f, p, rho }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The local frame of [`Centre::surface`] turned to the central direction holds the normal half way to
    /// the view.
    #[test]
    fn the_view_is_reflected_about_the_normal() {
        let (normal, tangent) = (Direction::Z, Direction::X);
        let view = Direction::from_angles(0.7, 1.1);
        let reflected = Centre::Reflection.central(normal, tangent, view);
        let expected = Direction::from_angles(0.7, 1.1 - std::f64::consts::PI);
        assert!((reflected.vector() - expected.vector()).length() < 1e-15);
        assert_eq!(Centre::Normal.central(normal, tangent, view), normal);
        assert_eq!(Centre::Tangent.central(normal, tangent, view), tangent);
        let [_, seen] = Centre::Reflection.surface(Direction::Z, Direction::from_angles(1.4, 0.3));
        assert!((seen.theta() - 0.7).abs() < 1e-15, "a view 1.4 from R is 0.7 from N");
    }
}
