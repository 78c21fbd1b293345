//! The degrees of a projection, and how fine rho_hat is sampled for them.

/// The highest F: finer than what a soft light and a highlight of GGX roughness 0.1 share.
pub(in super::super) const F: usize = 255;

/// The highest P: above the 16 that maps have, so that a cut at 16 can be compared with something.
pub(super) const P: usize = 24;

/// The degrees and the nodes of a projection.
#[derive(Clone, Copy)]
pub(in super::super) struct Grid {
    /// The highest F.
    pub(super) f: usize,
    /// The highest P.
    pub(super) p: usize,
    /// The number of nodes of theta_o, even.
    pub(super) outgoing: usize,
    /// The number of nodes of phi over half a turn, even.
    pub(super) azimuths: usize,
    /// The widest panel of theta_i. What is interpolated over it are moments up to degree P, which are smooth
    /// away from the central direction.
    pub(super) widest_panel: f64,
}

impl Grid {
    /// The grid of [`crate::Choice::Full`].
    pub(in super::super) const fn full() -> Self {
        Self { f: F, p: P, outgoing: 80, azimuths: 48, widest_panel: 0.2 }
    }

    /// A coarse grid up to this F: a third of the samples.
    pub(in super::super) fn sketch(f: usize) -> Self {
        Self { f: f.min(F), p: 20, outgoing: 48, azimuths: 32, widest_panel: 0.4 }
    }
}
