//! The layers of an OpenEXR file, and which of them is the picture.
//!
//! A *layer* is a part of a multi-part file, a channel prefix (`diffuse.R`), or both (`part.prefix`). It has
//! colour with R, G and B (also `r`, `red`), with Y and the chroma RY and BY, or with Y alone (grey). X, Y
//! and Z of one layer are a position or a direction.
//!
//! Without a name, the first layer of the first line that a file has is read:
//!
//! 1. the unnamed layer of R, G and B
//! 2. one whose name, or its last part, is `beauty`, `rgba`, `rgb`, `combined`, `color`, `colour`, `image`,
//!    `main` or `default`
//! 3. another of R, G and B
//! 4. luminance and chroma
//! 5. grey
//! 6. one whose name says that it holds no light, such as `N`, `normal`, `P`, `position`, `uv`, `crypto00`

use exr::meta::header::Header;

use crate::error::{Error, ErrorKind};

const BEAUTY: [&str; 9] =
    ["beauty", "rgba", "rgb", "combined", "color", "colour", "image", "main", "default"];
const DATA: [&str; 23] = [
    "n",
    "normal",
    "normals",
    "nn",
    "p",
    "pref",
    "position",
    "positions",
    "pworld",
    "world",
    "uv",
    "st",
    "z",
    "depth",
    "motion",
    "motionvector",
    "vector",
    "velocity",
    "id",
    "objectid",
    "ao",
    "mask",
    "matte",
];

/// How the channels of a layer make its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Colour {
    Rgb,
    /// Y, (R - Y) / Y and (B - Y) / Y.
    LuminanceChroma,
    /// One channel, Y, serves as red, green and blue.
    Grey,
}

/// A layer with colour: the part that it is in, and which of the part's channels are red, green and blue, or
/// Y, RY and BY.
pub(super) struct Layer {
    pub(super) part: usize,
    pub(super) name: String,
    pub(super) channels: [usize; 3],
    pub(super) colour: Colour,
}

impl Layer {
    /// The layers with colour, each with its channels' prefix, and the channels of those without.
    pub(super) fn all(headers: &[Header]) -> (Vec<(String, Self)>, Vec<String>) {
        let mut layers = Vec::new();
        let mut colourless = Vec::new();
        for (part, header) in headers.iter().enumerate() {
            let part_name = header.own_attributes.layer_name.as_ref().map(ToString::to_string);
            let names: Vec<String> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
            let split = |name: &'_ str| match name.rsplit_once('.') {
                Some((prefix, channel)) => (prefix.to_owned(), channel.to_owned()),
                None => (String::new(), name.to_owned()),
            };
            let mut prefixes: Vec<String> = names.iter().map(|name| split(name).0).collect();
            prefixes.sort_unstable();
            prefixes.dedup();
            for prefix in prefixes {
                // The usual spelling of several first.
                let find = |spellings: &[&str]| {
                    spellings.iter().find_map(|spelling| {
                        names.iter().position(|name| split(name) == (prefix.clone(), (*spelling).to_owned()))
                    })
                };
                let [r, g, b] =
                    [&["R", "r", "red", "Red"], &["G", "g", "green", "Green"], &["B", "b", "blue", "Blue"]]
                        .map(|spellings| find(spellings));
                let [x, y] = [&["X", "x"], &["Y", "y"]].map(|spellings| find(spellings));
                let found = match ([r, g, b], y, [find(&["RY"]), find(&["BY"])]) {
                    ([Some(r), Some(g), Some(b)], ..) => Some((Colour::Rgb, [r, g, b])),
                    ([None, None, None], Some(y), [Some(ry), Some(by)]) => {
                        Some((Colour::LuminanceChroma, [y, ry, by]))
                    }
                    // Z alone is a depth beside the grey.
                    ([None, None, None], Some(y), [None, None]) if x.is_none() => {
                        Some((Colour::Grey, [y; 3]))
                    }
                    _ => None,
                };
                let name = match part_name.as_deref().unwrap_or_default() {
                    "" => prefix.clone(),
                    part if prefix.is_empty() => part.to_owned(),
                    part => format!("{part}.{prefix}"),
                };
                match found {
                    Some((colour, channels)) => layers.push((prefix, Self { part, name, channels, colour })),
                    None => colourless.extend(names.iter().filter(|name| split(name).0 == prefix).cloned()),
                }
            }
        }
        (layers, colourless)
    }

    /// The line of the module's list that a layer is in.
    fn rank(&self, prefix: &str, parts: usize) -> usize {
        let last = self.name.rsplit('.').next().unwrap_or_default().to_lowercase();
        match self.colour {
            Colour::Rgb if self.name.is_empty() || (prefix.is_empty() && parts == 1) => 1,
            Colour::Rgb if BEAUTY.contains(&last.as_str()) => 2,
            _ if DATA.contains(&last.as_str()) || last.starts_with("crypto") => 6,
            Colour::Rgb => 3,
            Colour::LuminanceChroma => 4,
            Colour::Grey => 5,
        }
    }

    pub(super) fn choose(
        headers: &[Header],
        wanted: Option<&str>,
        warnings: &mut Vec<String>,
    ) -> Result<Self, Error> {
        let (mut layers, colourless) = Self::all(headers);
        let list = |layers: &[(String, Self)]| {
            let name = |(_, layer): &(String, Self)| match layer.name.as_str() {
                "" => "the unnamed one".to_owned(),
                name => format!("`{name}`"),
            };
            layers.iter().map(name).collect::<Vec<_>>().join(", ")
        };
        let position = match wanted {
            Some(wanted) => layers
                .iter()
                .position(|(_, layer)| layer.name == wanted)
                .or_else(|| layers.iter().position(|(prefix, _)| prefix == wanted && !prefix.is_empty())),
            None => {
                let ranks = layers.iter().map(|(prefix, layer)| layer.rank(prefix, headers.len()));
                ranks.enumerate().min_by_key(|(_, rank)| *rank).map(|(position, _)| position)
            }
        };
        if let Some(position) = position {
            if wanted.is_none() && layers.len() > 1 {
                let chosen = list(&layers[position..=position]);
                warnings.push(format!(
                    "the file has the layers {}; {chosen} was read; `layer` names another",
                    list(&layers)
                ));
            }
            return Ok(layers.swap_remove(position).1);
        }
        if layers.is_empty() {
            return Err(without_colour(&colourless));
        }
        Err(Error::new(
            ErrorKind::NoSuchLayer,
            format!("there is no layer `{}`; the layers are {}", wanted.unwrap_or_default(), list(&layers)),
        ))
    }
}

/// Why a file with these channels holds no picture.
pub(super) fn without_colour(channels: &[String]) -> Error {
    let coordinates = channels.iter().any(|name| name.rsplit('.').next().is_some_and(|last| last == "X"));
    Error::unsupported(format!(
        "no layer has R, G and B, or Y; the channels are {}{}",
        channels.join(", "),
        if coordinates { "; X, Y and Z are a position or a direction, not light" } else { "" }
    ))
}
