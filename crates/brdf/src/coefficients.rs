//! The transfer function of a material in spherical harmonics.

use sh::Degree;

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
    /// Coefficients from their tensor; `None` where its length is not (F+1)(P+1)(P+1).
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

    /// The same coefficients cut to a lower degree in the incident direction; unchanged where `f` is not lower.
    pub fn cut(&self, f: Degree) -> Self {
        let f = f.min(self.f);
        let side = self.p.get() + 1;
        let rho = self.rho[..(f.get() + 1) * side * side].to_vec();
        Self { centre: self.centre, f, p: self.p, rho }
    }
}
