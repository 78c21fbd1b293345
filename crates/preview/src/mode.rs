//! What a picture shows: the map that shades the surfaces, and the background.

/// The source of the radiance that a surface reflects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// The local SHRM at every pixel: four texels, each evaluated in its own frame, are blended. Lamps beside
    /// it are added.
    LocalShrm,
    /// The global SHRM, evaluated once per frame for a distant viewer (paper 1, equation 12). Lamps beside it
    /// are added at every pixel.
    GlobalShrm,
    /// Cabral's twelve maps, blended by the view's weights on the icosahedron.
    Cabral,
    /// Kautz and McCool's 3D texture over the central direction and its angle to the view.
    KautzMcCool,
    /// A white diffuse surface: irradiance over pi, from nine coefficients.
    Irradiance,
    /// One reflection map, the mean over all views.
    Prefiltered,
    /// A perfect mirror: the environment itself.
    Mirror,
    /// The integral over all light, estimated with many samples.
    BruteForce,
}

impl Mode {
    /// Every mode, in the order of lists and keys.
    pub const ALL: [Self; 8] = [
        Self::LocalShrm,
        Self::GlobalShrm,
        Self::Cabral,
        Self::KautzMcCool,
        Self::Prefiltered,
        Self::Irradiance,
        Self::Mirror,
        Self::BruteForce,
    ];

    /// The name in manifests and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::LocalShrm => "local-shrm",
            Self::GlobalShrm => "global-shrm",
            Self::Cabral => "cabral",
            Self::KautzMcCool => "kautz-mccool",
            Self::Irradiance => "irradiance",
            Self::Prefiltered => "prefiltered",
            Self::Mirror => "mirror",
            Self::BruteForce => "brute-force",
        }
    }

    /// The name in the window and on pictures.
    pub fn label(self) -> &'static str {
        match self {
            Self::LocalShrm => "local SHRM",
            Self::GlobalShrm => "global SHRM",
            Self::Cabral => "Cabral",
            Self::KautzMcCool => "Kautz-McCool",
            Self::Prefiltered => "prefiltered",
            Self::Irradiance => "irradiance",
            Self::Mirror => "mirror",
            Self::BruteForce => "brute force",
        }
    }

    /// Whether it looks up a map of the material under the light. The others need the light alone, or light
    /// and material.
    pub fn needs_maps(self) -> bool {
        match self {
            Self::LocalShrm | Self::GlobalShrm | Self::Cabral | Self::KautzMcCool | Self::Prefiltered => true,
            Self::Irradiance | Self::Mirror | Self::BruteForce => false,
        }
    }

    /// Whether the reflection's lamps are not in the mode's map but added at each surface.
    #[cfg(feature = "gpu")]
    pub(crate) fn adds_lamps(self) -> bool {
        matches!(self, Self::LocalShrm | Self::GlobalShrm)
    }

    /// The mode with a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| mode.name() == name)
    }
}

/// The modes of a picture and their arrangement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Show {
    /// One mode.
    One(Mode),
    /// Two modes side by side.
    Split {
        /// Left of the divider.
        left: Mode,
        /// Right of it.
        right: Mode,
        /// The place of the divider as a share of the width, 0 to 1.
        at: f32,
    },
    /// The absolute difference of two modes, amplified. The picture has its RMS.
    Difference {
        /// The compared mode.
        of: Mode,
        /// The reference.
        from: Mode,
        /// The factor that the difference is multiplied with.
        amplify: f32,
    },
}

impl Show {
    /// The modes of the first and the second side. A difference of a mode from itself has it on both.
    pub(crate) fn sides(self) -> [Option<Mode>; 2] {
        match self {
            Self::One(mode) => [Some(mode), None],
            Self::Split { left, right, .. } => [Some(left), Some(right)],
            Self::Difference { of, from, .. } => [Some(of), Some(from)],
        }
    }

    /// The modes that it needs, one or two.
    pub fn modes(self) -> impl Iterator<Item = Mode> {
        let [first, second] = self.sides();
        first.into_iter().chain(second.filter(|_| second != first))
    }

    /// What a scene without maps shows: brute force in place of each mode that needs a map. If both sides are
    /// the same then, there is only one.
    pub(crate) fn without_maps(self) -> Self {
        if self.modes().all(|mode| !mode.needs_maps()) {
            return self;
        }
        let available = |mode: Mode| if mode.needs_maps() { Mode::BruteForce } else { mode };
        match self {
            Self::One(mode) => Self::One(available(mode)),
            Self::Split { left, right, .. } if available(left) == available(right) => {
                Self::One(available(left))
            }
            Self::Split { left, right, at } => {
                Self::Split { left: available(left), right: available(right), at }
            }
            Self::Difference { of, from, .. } if available(of) == available(from) => Self::One(available(of)),
            Self::Difference { of, from, amplify } => {
                Self::Difference { of: available(of), from: available(from), amplify }
            }
        }
    }

    /// The first column of the right mode of a split in a picture of this width; otherwise the width.
    pub fn divider(self, width: u32) -> u32 {
        match self {
            Self::Split { at, .. } => (at.clamp(0.0, 1.0) * width as f32).round() as u32,
            _ => width,
        }
    }
}

/// What a picture shows behind the surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// The environment.
    Environment,
    /// The environment as its spherical harmonic coefficients describe it.
    Harmonics,
    /// One linear radiance, which exposure does not change.
    Flat([f32; 3]),
}

impl Background {
    /// A mid grey, on which highlights and shadows are equally visible.
    pub const MIDDLE_GREY: Self = Self::Flat([0.18; 3]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_maps_brute_force_replaces_the_modes_that_need_one() {
        let brute = Show::One(Mode::BruteForce);
        for mode in Mode::ALL {
            let kept = [Mode::Irradiance, Mode::Mirror, Mode::BruteForce].contains(&mode);
            assert_eq!(Show::One(mode).without_maps(), if kept { Show::One(mode) } else { brute });
        }
        let split = |left, right| Show::Split { left, right, at: 0.25 };
        assert_eq!(split(Mode::Mirror, Mode::Cabral).without_maps(), split(Mode::Mirror, Mode::BruteForce));
        assert_eq!(split(Mode::Cabral, Mode::Prefiltered).without_maps(), brute);
        let difference = |of, from| Show::Difference { of, from, amplify: 8.0 };
        assert_eq!(difference(Mode::LocalShrm, Mode::BruteForce).without_maps(), brute);
        assert_eq!(
            difference(Mode::LocalShrm, Mode::Mirror).without_maps(),
            difference(Mode::BruteForce, Mode::Mirror)
        );
        let itself = difference(Mode::Mirror, Mode::Mirror);
        assert_eq!(itself.without_maps(), itself, "nothing was replaced");
    }
}
