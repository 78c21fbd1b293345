//! The colour spaces that a user or a file can name, in the words of the field.
//!
//! A name is compared by its letters and digits alone: OCIO's `Linear Rec.709 (sRGB)` and `ACES - ACEScg`,
//! the identifiers of the Color Interop Forum (`lin_rec709_scene`, `lin_ap1_scene`), OpenImageIO's `lin_srgb`
//! and Blender's `Linear CIE-XYZ D65` are words for the same few sets of primaries.

use super::chromaticity::Chromaticities;

/// A set of primaries with its white.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ColourSpace {
    /// ITU-R BT.709, the primaries of sRGB.
    Rec709,
    /// ITU-R BT.2020.
    Rec2020,
    /// ACEScg, the primaries AP1.
    AcesCg,
    /// ACES2065-1, the primaries AP0.
    Aces2065,
    /// P3 with white D65, the primaries of Display P3.
    P3,
    /// ProPhoto RGB.
    ProPhoto,
    /// Adobe RGB (1998).
    AdobeRgb,
    /// CIE XYZ in which D65 is white.
    Xyz,
}

impl ColourSpace {
    /// All colour spaces.
    pub const ALL: [Self; 8] = [
        Self::Rec709,
        Self::Rec2020,
        Self::AcesCg,
        Self::Aces2065,
        Self::P3,
        Self::ProPhoto,
        Self::AdobeRgb,
        Self::Xyz,
    ];

    /// The name in a manifest.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rec709 => "rec709",
            Self::Rec2020 => "rec2020",
            Self::AcesCg => "acescg",
            Self::Aces2065 => "aces2065-1",
            Self::P3 => "p3",
            Self::ProPhoto => "prophoto",
            Self::AdobeRgb => "adobergb",
            Self::Xyz => "xyz",
        }
    }

    /// The space of linear light that a name means: one of [`ColourSpace::name`], or a name of OCIO's
    /// configurations, of `colorInteropID` or of OpenImageIO.
    ///
    /// # Example: what programs call ACEScg
    /// ```
    /// use containers::ColourSpace;
    /// for name in ["acescg", "ACEScg", "ACES - ACEScg", "lin_ap1_scene"] {
    ///     assert_eq!(ColourSpace::from_name(name), Some(ColourSpace::AcesCg));
    /// }
    /// assert_eq!(ColourSpace::from_name("sRGB - Display"), None);
    /// assert_eq!(ColourSpace::from_name("sRGB"), None);
    /// ```
    pub fn from_name(name: &str) -> Option<Self> {
        let name: String = name.chars().filter(char::is_ascii_alphanumeric).collect();
        let name = name.to_ascii_lowercase();
        // What these words add to a name says nothing of the primaries.
        let name = ["scene", "scenereferred"].iter().find_map(|end| name.strip_suffix(end)).unwrap_or(&name);
        let name = name.strip_prefix("utility").unwrap_or(name);
        let linear = ["scenelinear", "linear", "lin"].iter().find_map(|start| name.strip_prefix(start));
        // Without a word of linear light, sRGB is the encoding of a display.
        if linear.is_none() && name == "srgb" {
            return None;
        }
        let name = linear.unwrap_or(name);
        Some(match name {
            "rec709" | "bt709" | "srgb" | "rec709srgb" | "srgbrec709" | "rec709d65" | "bt709d65" | "" => {
                Self::Rec709
            }
            "rec2020" | "bt2020" | "rec2020d65" | "bt2020d65" => Self::Rec2020,
            "acescg" | "acesacescg" | "ap1" => Self::AcesCg,
            "aces20651" | "acesaces20651" | "ap0" => Self::Aces2065,
            "p3" | "p3d65" | "displayp3" | "dcip3d65" => Self::P3,
            "prophoto" | "prophotorgb" | "romm" | "rommrgb" => Self::ProPhoto,
            "adobergb" | "adobergb1998" => Self::AdobeRgb,
            "xyz" | "xyzd65" | "ciexyz" | "ciexyzd65" => Self::Xyz,
            _ => return None,
        })
    }

    pub(crate) fn chromaticities(self) -> Chromaticities {
        match self {
            Self::Rec709 => Chromaticities::REC_709,
            Self::Rec2020 => Chromaticities::REC_2020,
            Self::AcesCg => Chromaticities::ACES_CG,
            Self::Aces2065 => Chromaticities::ACES_2065_1,
            Self::P3 => Chromaticities::P3_D65,
            Self::ProPhoto => Chromaticities::PRO_PHOTO,
            Self::AdobeRgb => Chromaticities::ADOBE_RGB,
            Self::Xyz => Chromaticities::XYZ_D65,
        }
    }

    /// The space to convert from: the wanted one, and a warning if the file, by `source`, declares another.
    pub(crate) fn chosen(
        wanted: Option<Self>,
        declared: Option<(&str, Chromaticities)>,
        warnings: &mut Vec<String>,
    ) -> Option<Chromaticities> {
        let Some(wanted) = wanted else { return declared.map(|(_, declared)| declared) };
        let taken = wanted.chromaticities();
        if let Some((source, declared)) = declared
            && !declared.is_near(taken)
        {
            let name = wanted.name();
            warnings.push(format!(
                "{source} names other primaries than `{name}`, which were asked for; `{name}` was taken"
            ));
        }
        Some(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_programs_are_understood() {
        for (space, names) in [
            (
                ColourSpace::Rec709,
                &[
                    "rec709",
                    "lin_rec709_scene",
                    "Linear Rec.709 (sRGB)",
                    "scene_linear",
                    "Utility - Linear - sRGB",
                    "Utility - Linear - Rec.709",
                    "lin_srgb",
                    "linear",
                    "Linear BT.709",
                ][..],
            ),
            (
                ColourSpace::Rec2020,
                &["rec2020", "lin_rec2020_scene", "Linear Rec.2020", "Utility - Linear - Rec.2020"],
            ),
            (ColourSpace::AcesCg, &["ACEScg", "lin_ap1_scene", "ACES - ACEScg", "lin_ap1"]),
            (ColourSpace::Aces2065, &["aces2065-1", "ACES2065-1", "ACES - ACES2065-1", "lin_ap0_scene"]),
            (ColourSpace::P3, &["lin_p3d65_scene", "Linear P3-D65", "Utility - Linear - P3-D65"]),
            (ColourSpace::AdobeRgb, &["lin_adobergb_scene", "Linear AdobeRGB"]),
            (ColourSpace::Xyz, &["lin_ciexyzd65_scene", "CIE XYZ-D65 - Scene-referred", "CIE-XYZ-D65"]),
        ] {
            for name in names {
                assert_eq!(ColourSpace::from_name(name), Some(space), "{name}");
            }
        }
        for space in ColourSpace::ALL {
            assert_eq!(ColourSpace::from_name(space.name()), Some(space));
        }
        // What is encoded for a display, or is not a colour, is none of them.
        for name in ["srgb_rec709_display", "Gamma 2.2 Rec.709 - Texture", "data", "unknown", "Raw"] {
            assert_eq!(ColourSpace::from_name(name), None, "{name}");
        }
    }
}
