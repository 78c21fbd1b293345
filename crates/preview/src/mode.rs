//! What a picture shows: the map that shades the surfaces, and the background.

use std::ops::Range;

/// The source of the radiance that a surface reflects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// The local SHRM at every pixel: four texels, each evaluated in its own frame, are blended. Lamps beside
    /// it are added.
    LocalShrm,
    /// The global SHRM, evaluated once per frame for a distant viewer [RH02, eq. 12]. Lamps beside it are
    /// added at every pixel.
    GlobalShrm,
    /// Cabral's twelve maps, blended by the view's weights on the icosahedron.
    Cabral,
    /// Kautz and McCool's 3D texture over the central direction and its angle to the view.
    KautzMcCool,
    /// A white diffuse surface: irradiance over pi, from nine coefficients.
    Irradiance,
    /// One reflection map, the mean over all views; or the cube of an engine, to which the lights beside it
    /// are added.
    Prefiltered,
    /// A perfect mirror: the environment itself.
    Mirror,
    /// The integral over all light, estimated with many samples.
    BruteForce,
    /// A BRDF table at every pixel, under the light that is turned into the frame there [KSS02, eq. 1].
    Table,
    /// A BRDF table with the mesh's transfer matrices at its vertices: what the mesh hides from itself is
    /// dark [KSS02, sec. 5].
    Transfer,
    /// The integral over all light that the mesh does not hide from itself, with traced shadows.
    ShadowedBruteForce,
    /// A diagram in place of the surface: the points that importance sampling draws from the light, from the
    /// material's lobe toward the camera, and from their product.
    Samples,
    /// The taps of the material into the scale space of the light, at every pixel. The lights beside the
    /// scale space are added.
    Taps,
}

impl Mode {
    /// Every mode, in the order of lists and keys.
    pub const ALL: [Self; 13] = [
        Self::LocalShrm,
        Self::GlobalShrm,
        Self::Cabral,
        Self::KautzMcCool,
        Self::Prefiltered,
        Self::Irradiance,
        Self::Mirror,
        Self::BruteForce,
        Self::Table,
        Self::Transfer,
        Self::ShadowedBruteForce,
        Self::Samples,
        Self::Taps,
    ];

    /// The mode's name in manifests and on the command line.
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
            Self::Table => "table",
            Self::Transfer => "transfer",
            Self::ShadowedBruteForce => "shadowed-brute-force",
            Self::Samples => "samples",
            Self::Taps => "taps",
        }
    }

    /// The mode's name in the window and on pictures.
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
            Self::Table => "BRDF table",
            Self::Transfer => "transfer",
            Self::ShadowedBruteForce => "shadowed brute force",
            Self::Samples => "samples",
            Self::Taps => "taps",
        }
    }

    /// Whether the mode looks up a map of the material under the light. The others need the light alone,
    /// light and material, a BRDF table, or a compact map.
    pub fn needs_maps(self) -> bool {
        match self {
            Self::LocalShrm | Self::GlobalShrm | Self::Cabral | Self::KautzMcCool | Self::Prefiltered => true,
            Self::Irradiance | Self::Mirror | Self::Table | Self::Transfer | Self::Taps => false,
            Self::BruteForce | Self::ShadowedBruteForce | Self::Samples => false,
        }
    }

    /// Whether the mode looks up a BRDF table.
    pub fn looks_up_table(self) -> bool {
        matches!(self, Self::Table | Self::Transfer)
    }

    /// Whether the mode sums light samples.
    pub fn is_brute_force(self) -> bool {
        matches!(self, Self::BruteForce | Self::ShadowedBruteForce)
    }

    /// Whether the mode's picture is a diagram, not a shaded surface: it fills its side of the picture, and
    /// there is no difference from it.
    pub fn is_diagram(self) -> bool {
        self == Self::Samples
    }

    /// Whether the mode shows the material, so that another base colour changes its picture.
    pub(crate) fn shows_material(self) -> bool {
        !matches!(self, Self::Irradiance | Self::Mirror | Self::Samples)
    }

    /// The mode that this one approximates: brute force, with the shadows that the mode has.
    pub fn reference(self) -> Self {
        match self {
            Self::Transfer | Self::ShadowedBruteForce => Self::ShadowedBruteForce,
            _ => Self::BruteForce,
        }
    }

    /// Whether lights beside the mode's map are added at each surface.
    pub(crate) fn adds_lamps(self) -> bool {
        matches!(self, Self::LocalShrm | Self::GlobalShrm | Self::Prefiltered | Self::Table)
    }

    /// The mode with a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| mode.name() == name)
    }
}

/// The modes of a picture and their arrangement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Show {
    /// One mode fills the picture.
    One(Mode),
    /// Two modes side by side.
    Split {
        /// The mode left of the divider.
        left: Mode,
        /// The mode right of the divider.
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

    /// The modes that are shown, one or two.
    pub fn modes(self) -> impl Iterator<Item = Mode> {
        let [first, second] = self.sides();
        first.into_iter().chain(second.filter(|_| second != first))
    }

    /// Returns the modes that can be drawn in place of these: the reference of each mode that is not offered.
    /// If both sides are the same then, there is only one. A diagram is shown alone in place of a difference
    /// from it.
    pub(crate) fn among(self, offers: impl Fn(Mode) -> bool) -> Self {
        if let Self::Difference { of, from, .. } = self
            && let Some(diagram) = [of, from].into_iter().find(|mode| mode.is_diagram())
        {
            return Self::One(diagram);
        }
        if self.modes().all(&offers) {
            return self;
        }
        let available = |mode: Mode| if offers(mode) { mode } else { mode.reference() };
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

    /// Returns the columns of a picture of this width that a diagram fills, none if no mode is one; and the
    /// modes to draw in the others, unless there are none.
    pub(crate) fn beside_diagram(self, width: u32) -> (Range<u32>, Option<Self>) {
        let divider = self.divider(width);
        match self {
            Self::One(mode) if mode.is_diagram() => (0..width, None),
            Self::Split { left, right, .. } if left.is_diagram() && right.is_diagram() => (0..width, None),
            Self::Split { left, right, .. } if left.is_diagram() => (0..divider, Some(Self::One(right))),
            Self::Split { left, right, .. } if right.is_diagram() => (divider..width, Some(Self::One(left))),
            _ => (0..0, Some(self)),
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

/// The background of a picture, behind the surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// The background is the environment.
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
    fn the_reference_replaces_a_mode_that_is_not_offered() {
        let without_maps = |show: Show| show.among(|mode| !mode.needs_maps());
        let brute = Show::One(Mode::BruteForce);
        for mode in Mode::ALL {
            let kept = !mode.needs_maps();
            assert_eq!(without_maps(Show::One(mode)), if kept { Show::One(mode) } else { brute });
        }
        let split = |left, right| Show::Split { left, right, at: 0.25 };
        assert_eq!(without_maps(split(Mode::Mirror, Mode::Cabral)), split(Mode::Mirror, Mode::BruteForce));
        assert_eq!(without_maps(split(Mode::Cabral, Mode::Prefiltered)), brute);
        let difference = |of, from| Show::Difference { of, from, amplify: 8.0 };
        assert_eq!(without_maps(difference(Mode::LocalShrm, Mode::BruteForce)), brute);
        assert_eq!(
            without_maps(difference(Mode::LocalShrm, Mode::Mirror)),
            difference(Mode::BruteForce, Mode::Mirror)
        );
        let itself = difference(Mode::Mirror, Mode::Mirror);
        assert_eq!(without_maps(itself), itself, "nothing was replaced");
        let shadowed = Show::One(Mode::ShadowedBruteForce);
        assert_eq!(Show::One(Mode::Transfer).among(|mode| mode != Mode::Transfer), shadowed);
        assert_eq!(Show::One(Mode::Table).among(|mode| !mode.looks_up_table()), brute);
    }

    #[test]
    fn a_diagram_fills_its_side() {
        let (diagram, mirror) = (Show::One(Mode::Samples), Show::One(Mode::Mirror));
        let split = |left, right| Show::Split { left, right, at: 0.25 };
        assert_eq!(diagram.beside_diagram(8), (0..8, None));
        assert_eq!(mirror.beside_diagram(8), (0..0, Some(mirror)));
        assert_eq!(split(Mode::Samples, Mode::Mirror).beside_diagram(8), (0..2, Some(mirror)));
        assert_eq!(split(Mode::Mirror, Mode::Samples).beside_diagram(8), (2..8, Some(mirror)));
        assert_eq!(split(Mode::Samples, Mode::Samples).beside_diagram(8), (0..8, None));
        let difference = |of, from| Show::Difference { of, from, amplify: 8.0 }.among(|_| true);
        assert_eq!(difference(Mode::Samples, Mode::Mirror), diagram);
        assert_eq!(difference(Mode::Mirror, Mode::Samples), diagram);
    }
}
