//! What a picture shows: by which map the surface is shaded, and what lies behind it.

/// By what the light that a surface reflects is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// The local SHRM at every pixel: each of four texels is evaluated in its own frame, then they are blended.
    LocalShrm,
    /// The global SHRM, evaluated once a frame into a reflection map for a distant viewer (paper 1, equation 12).
    GlobalShrm,
    /// Cabral's twelve maps, blended by the icosahedron's weights of the view.
    Cabral,
    /// Kautz and McCool's 3D texture, over central direction and angle to the view.
    KautzMcCool,
    /// A white diffuse surface: irradiance over pi, from nine coefficients.
    Irradiance,
    /// One reflection map, the mean over all views.
    Prefiltered,
    /// A perfect mirror: the environment itself.
    Mirror,
    /// The sum of all light, by many samples.
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

    /// What people read in lists and beside pictures.
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

    /// The mode of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| mode.name() == name)
    }
}

/// Which modes a picture shows, and how.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Show {
    /// One mode.
    One(Mode),
    /// Two modes side by side: the divider is at this share of the width, 0 to 1.
    Split {
        /// Left of the divider.
        left: Mode,
        /// Right of it.
        right: Mode,
        /// The divider.
        at: f32,
    },
    /// The absolute difference of two modes, amplified; with the RMS of it in the picture's figures.
    Difference {
        /// What is judged.
        of: Mode,
        /// What it is judged by.
        from: Mode,
        /// How many times stronger the difference is shown.
        amplify: f32,
    },
}

impl Show {
    /// The modes that it needs, one or two.
    pub fn modes(self) -> impl Iterator<Item = Mode> {
        let (first, second) = match self {
            Self::One(mode) => (mode, None),
            Self::Split { left, right, .. } => (left, Some(right)),
            Self::Difference { of, from, .. } => (of, Some(from)),
        };
        std::iter::once(first).chain(second.filter(move |second| *second != first))
    }

    /// Of a split, the first column of the right mode in a picture of a width; the width where there is none.
    pub fn divider(self, width: u32) -> u32 {
        match self {
            Self::Split { at, .. } => (at.clamp(0.0, 1.0) * width as f32).round() as u32,
            _ => width,
        }
    }
}

/// What is seen where no surface is.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Background {
    /// The environment.
    Environment,
    /// What the lighting's coefficients hold of it.
    Harmonics,
    /// One linear radiance, which exposure leaves alone.
    Flat([f32; 3]),
}
