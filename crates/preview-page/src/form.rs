//! The forms of a reflection that a page shows.

use preview::Mode;

/// A form of a reflection, in the order in which a page of limited size keeps them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The compact map.
    Compact,
    /// The local SHRM.
    Shrm,
    /// Cabral's twelve maps.
    Cabral,
    /// Kautz and McCool's 3D texture.
    KautzMcCool,
    /// One reflection map, the mean over all views.
    Plain,
    /// The BRDF table.
    Table,
    /// A white diffuse surface that hides light from itself, of meshes with a matte transfer.
    Transfer,
    /// A white diffuse surface.
    Irradiance,
    /// A perfect mirror.
    Mirror,
}

impl Form {
    /// All forms.
    pub const ALL: [Self; 9] = [
        Self::Compact,
        Self::Shrm,
        Self::Cabral,
        Self::KautzMcCool,
        Self::Plain,
        Self::Table,
        Self::Transfer,
        Self::Irradiance,
        Self::Mirror,
    ];

    /// The mode of the preview that shows it.
    pub fn mode(self) -> Mode {
        match self {
            Self::Compact => Mode::Taps,
            Self::Shrm => Mode::LocalShrm,
            Self::Cabral => Mode::Cabral,
            Self::KautzMcCool => Mode::KautzMcCool,
            Self::Plain => Mode::Prefiltered,
            Self::Table => Mode::Table,
            Self::Transfer => Mode::Transfer,
            Self::Irradiance => Mode::Irradiance,
            Self::Mirror => Mode::Mirror,
        }
    }

    /// The name that people read.
    pub fn label(self) -> &'static str {
        match self {
            Self::Compact => "Compact map",
            Self::Shrm => "SHRM",
            Self::Cabral => "Cabral's maps",
            Self::KautzMcCool => "Kautz-McCool",
            Self::Plain => "Plain reflection map",
            Self::Table => "BRDF table",
            Self::Transfer => "Matte white in its own shadow",
            Self::Irradiance => "Matte white",
            Self::Mirror => "Perfect mirror",
        }
    }

    /// The kind of stage that exports it.
    pub(crate) fn exporter(self) -> Option<&'static str> {
        match self {
            Self::Compact => Some("export-taps"),
            Self::Shrm => Some("export-shrm"),
            Self::Cabral => Some("export-cabral"),
            Self::KautzMcCool => Some("export-kautz-mccool"),
            Self::Plain => Some("export-reflection-map"),
            Self::Table | Self::Transfer | Self::Irradiance | Self::Mirror => None,
        }
    }

    /// Whether its texels are on cubes, which could have fewer of them.
    pub fn has_cube(self) -> bool {
        matches!(self, Self::Shrm | Self::Cabral | Self::KautzMcCool | Self::Plain)
    }

    /// Whether it shows the material.
    pub fn shows_material(self) -> bool {
        !matches!(self, Self::Transfer | Self::Irradiance | Self::Mirror)
    }
}
