//! The numbers of enumerations in shaders, where each has the same name.

use brdf::{Centre, Wrap};
use envmap::ToneMap;

use crate::{Background, Show};

/// Defines constants and a list of them.
macro_rules! numbers {
    ($($name:ident = $value:literal)*) => {
        $(const $name: u32 = $value;)*

        #[cfg(test)]
        #[cfg(feature = "gpu")]
        pub(crate) const ALL: &[(&str, u32)] = &[$((stringify!($name), $name)),*];
    };
}

numbers! {
    CENTRE_REFLECTION = 0
    CENTRE_NORMAL = 1
    CENTRE_TANGENT = 2
    BACKGROUND_LAT_LONG = 0
    BACKGROUND_CUBE = 1
    BACKGROUND_FLAT = 2
    DEVELOP_PLAIN = 0
    DEVELOP_FILMIC = 1
    SHOW_ONE = 0
    SHOW_SPLIT = 1
    SHOW_DIFFERENCE = 2
    TEXTURE_REPEAT = 0
    TEXTURE_MIRROR = 1
    TEXTURE_CLAMP = 2
}

/// The central direction of a map.
pub fn centre(centre: Centre) -> u32 {
    match centre {
        Centre::Reflection => CENTRE_REFLECTION,
        Centre::Normal => CENTRE_NORMAL,
        Centre::Tangent => CENTRE_TANGENT,
    }
}

/// The kind of the background's map.
pub fn background(background: Background) -> u32 {
    match background {
        Background::Environment => BACKGROUND_LAT_LONG,
        Background::Harmonics => BACKGROUND_CUBE,
        Background::Flat(_) => BACKGROUND_FLAT,
    }
}

/// The tone curve.
pub fn tone(tone: ToneMap) -> u32 {
    match tone {
        ToneMap::Plain => DEVELOP_PLAIN,
        ToneMap::Filmic => DEVELOP_FILMIC,
    }
}

/// The arrangement of the modes.
pub fn show(show: Show) -> u32 {
    match show {
        Show::One(_) => SHOW_ONE,
        Show::Split { .. } => SHOW_SPLIT,
        Show::Difference { .. } => SHOW_DIFFERENCE,
    }
}

/// How a texture goes on.
pub fn wrap(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => TEXTURE_REPEAT,
        Wrap::Mirror => TEXTURE_MIRROR,
        Wrap::Clamp => TEXTURE_CLAMP,
    }
}
