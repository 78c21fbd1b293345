//! GPano, the metadata of photo spheres, in XMP or in attributes of OpenEXR.
//!
//! Google, "Photo Sphere XMP Metadata" (<https://developers.google.com/streetview/spherical-metadata>): the
//! picture is a crop of a full panorama of 360 x 180 degrees, whose sizes and place are given in pixels of
//! the full panorama. A picture that was resized later has its own pixels: lengths are scaled. The horizon of
//! the camera was at PosePitchDegrees and PoseRollDegrees; PoseHeadingDegrees is that of a compass.
//! ProjectionType is an "open choice of text": of others than "equirectangular", fisheyes are read.

use std::f64::consts::{FRAC_PI_2, PI};

use envmap::{Lens, Part};
use sphere::Rotation;

use super::panorama::{Panorama, Shows};
use super::xmp;

const NAMESPACE: &str = "http://ns.google.com/photos/1.0/panorama/";

/// The name of the metadata in a message.
const SOURCE: &str = "XMP GPano";

/// The names of the sizes and places: columns, rows.
const FULL_SIZE_KEYS: [&str; 2] = ["FullPanoWidthPixels", "FullPanoHeightPixels"];
const CROP: [&str; 2] = ["CroppedAreaImageWidthPixels", "CroppedAreaImageHeightPixels"];
const CORNER: [&str; 2] = ["CroppedAreaLeftPixels", "CroppedAreaTopPixels"];

/// The panorama that XMP makes of a picture of this size, which is upright; `None` if XMP says nothing of it.
pub(crate) fn of_xmp(xmp: &str, size: [usize; 2]) -> Option<Panorama> {
    of_properties(|name| xmp::property(xmp, NAMESPACE, "GPano", name), size)
}

/// The panorama that the properties of GPano, by their names without a prefix, make of a picture of this
/// size.
pub(crate) fn of_properties(get: impl Fn(&str) -> Option<String>, size: [usize; 2]) -> Option<Panorama> {
    let names = FULL_SIZE_KEYS.iter().chain(&CROP).chain(&CORNER).chain(&["ProjectionType"]);
    if !names.into_iter().any(|name| get(name).is_some()) {
        return None;
    }
    let read = Properties::read(&get).and_then(|properties| properties.shows(size));
    Some(read.unwrap_or_else(|why| Panorama::new(SOURCE, Shows::Unclear(why))))
}

/// The properties that were read. Sizes are positive.
struct Properties {
    projection: Option<String>,
    full: [Option<f64>; 2],
    crop: [Option<f64>; 2],
    corner: [Option<f64>; 2],
    heading: f64,
    pitch: f64,
    roll: f64,
}

impl Properties {
    fn read(get: &impl Fn(&str) -> Option<String>) -> Result<Self, String> {
        let number = |name: &str| match get(name) {
            None => Ok(None),
            Some(text) => match text.trim().parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(Some(number)),
                _ => Err(format!("GPano:{name} is {:?}, which is not a number", shortened(&text))),
            },
        };
        let size = |name: &str| match number(name)? {
            Some(length) if length < 1.0 => {
                Err(format!("GPano:{name} is {length}, and a picture has a pixel or more"))
            }
            length => Ok(length),
        };
        let angle = |name: &str, largest: f64| match number(name)? {
            Some(angle) if angle.abs() > largest => {
                Err(format!("GPano:{name} is {angle}, and the most are {largest} degrees"))
            }
            angle => Ok(angle.unwrap_or(0.0)),
        };
        Ok(Self {
            projection: get("ProjectionType"),
            full: [size(FULL_SIZE_KEYS[0])?, size(FULL_SIZE_KEYS[1])?],
            crop: [size(CROP[0])?, size(CROP[1])?],
            corner: [number(CORNER[0])?, number(CORNER[1])?],
            heading: angle("PoseHeadingDegrees", 360.0)?,
            pitch: angle("PosePitchDegrees", 90.0)?,
            roll: angle("PoseRollDegrees", 180.0)?,
        })
    }

    fn shows(&self, size: [usize; 2]) -> Result<Panorama, String> {
        let projection = self.projection.as_deref().unwrap_or("equirectangular");
        let plain: String = projection.chars().filter(|c| c.is_alphanumeric()).collect();
        let plain = plain.to_lowercase();
        let mut panorama = match plain.as_str() {
            "" | "equirectangular" | "equirect" | "spherical" | "latlong" => self.lat_long(size)?,
            _ => match fisheye(&plain) {
                Some((lens, up)) => self.fisheye(size, lens, up)?,
                None => {
                    return Err(format!(
                        "its projection is {:?}; only \"equirectangular\" and fisheyes are read from it",
                        shortened(projection)
                    ));
                }
            },
        };
        if self.heading != 0.0 {
            panorama.notes.push(format!(
                "the camera looked toward {} degrees of the compass; the light is not turned by that",
                rounded(self.heading)
            ));
        }
        if [self.pitch, self.roll] != [0.0; 2] {
            panorama.warnings.push(format!(
                "the camera was tilted (pitch {}, roll {} degrees): the light was turned so that the horizon \
                 is level",
                rounded(self.pitch),
                rounded(self.roll)
            ));
        }
        Ok(panorama)
    }

    /// How the camera stood: its forward direction is raised by the pitch, its right side lowered by the
    /// roll, which turns the horizon counter-clockwise in the picture.
    fn pose(&self) -> Rotation {
        Rotation::from_yaw_pitch_roll(0.0, -self.pitch.to_radians(), self.roll.to_radians())
    }

    fn lat_long(&self, size: [usize; 2]) -> Result<Panorama, String> {
        let mut panorama = Panorama::new(SOURCE, Shows::Whole);
        panorama.turn = self.pose();
        let sizes = [self.full, self.crop, self.corner];
        if sizes.iter().flatten().all(|value| value.is_none()) {
            return Ok(panorama);
        }
        let warnings = &mut panorama.warnings;
        let picture = size.map(|length| length as f64);
        let full = self.full_size(warnings)?;
        let crop = self.crop_size(picture, full, warnings)?;
        let scale = [picture[0] / crop[0], picture[1] / crop[1]];
        // What was taken for the full panorama has no corner but its own.
        let corner = if crop == full && self.crop != full.map(Some) {
            [0.0; 2]
        } else {
            self.corner(full, crop, warnings)
        };
        let [left, top] = corner;
        if crop[0] > full[0] + 1.0 || crop[1] > full[1] + 1.0 {
            return Err(format!(
                "the cropped area of {} pixels is larger than the full panorama of {}",
                area(crop),
                area(full)
            ));
        }
        if top < -1.0 || top + crop[1] > full[1] + 1.0 {
            return Err(format!(
                "the cropped area, rows {} to {}, is not inside the full panorama of {} rows",
                rounded(top),
                rounded(top + crop[1]),
                rounded(full[1])
            ));
        }
        if left.abs() > full[0] {
            return Err(format!(
                "GPano:{} is {}, and the full panorama has {} columns",
                CORNER[0],
                rounded(left),
                rounded(full[0])
            ));
        }
        let is_whole = (0..2).all(|axis| (full[axis] - crop[axis]).abs() <= 1.0);
        if is_whole && left.abs() <= 1.0 && size[0] == 2 * size[1] {
            return Ok(panorama);
        }
        let scaled = |lengths: [f64; 2]| [lengths[0] * scale[0], lengths[1] * scale[1]];
        let part = Part::of_lat_long(size, scaled(full), scaled(corner))
            .ok_or_else(|| format!("a cropped area of {} pixels cannot be placed", area(crop)))?;
        let degrees = 360.0 / full[0];
        let text = format!(
            "{} x {} degrees of a lat-long panorama, from {} to {} degrees of elevation",
            rounded(crop[0] * degrees),
            rounded(crop[1] * 180.0 / full[1]),
            rounded(90.0 - (top + crop[1]) * 180.0 / full[1]),
            rounded(90.0 - top * 180.0 / full[1])
        );
        panorama.shows = Shows::Part(part, text);
        Ok(panorama)
    }

    /// The size of the full panorama.
    fn full_size(&self, warnings: &mut Vec<String>) -> Result<[f64; 2], String> {
        let full = match self.full {
            [Some(width), Some(height)] => [width, height],
            [Some(width), None] => {
                warnings.push(missing(FULL_SIZE_KEYS[1], "half of the width"));
                [width, width / 2.0]
            }
            [None, Some(height)] => {
                warnings.push(missing(FULL_SIZE_KEYS[0], "twice the height"));
                [2.0 * height, height]
            }
            // A crop that would be whole.
            [None, None] => match self.crop {
                [Some(width), Some(height)] if is_twice(width, height) && self.starts_at_corner() => {
                    warnings.push(missing(FULL_SIZE_KEYS[0], "that of the cropped area"));
                    [width, height]
                }
                _ => {
                    return Err(format!(
                        "GPano:{} and {} are missing: where the cropped area lies cannot be known",
                        FULL_SIZE_KEYS[0], FULL_SIZE_KEYS[1]
                    ));
                }
            },
        };
        match is_twice(full[0], full[1]) {
            true => Ok(full),
            false => Err(format!(
                "the full panorama is {} pixels, and 360 x 180 degrees are twice as wide as high",
                area(full)
            )),
        }
    }

    fn starts_at_corner(&self) -> bool {
        self.corner.iter().flatten().all(|&at| at == 0.0)
    }

    /// The size of the cropped area, in whose pixels the place is given.
    fn crop_size(
        &self,
        picture: [f64; 2],
        full: [f64; 2],
        warnings: &mut Vec<String>,
    ) -> Result<[f64; 2], String> {
        let [width, height] = self.crop;
        let (Some(width), Some(height)) = (width, height) else {
            let name = CROP[usize::from(width.is_some())];
            // Whole if it has the shape of the whole, and nothing is known of a corner.
            let shape_of_full = (picture[0] * full[1] - picture[1] * full[0]).abs() <= full[0] + full[1];
            if self.crop == [None; 2] && shape_of_full && self.starts_at_corner() {
                return Ok(full);
            }
            warnings.push(missing(name, "the picture's own size"));
            return Ok(picture);
        };
        let crop = [width, height];
        // Each length is rounded to a pixel when a picture is resized.
        if (picture[0] * height - picture[1] * width).abs() <= width + height {
            return Ok(crop);
        }
        if picture == full {
            warnings.push(format!(
                "its cropped area is {} pixels, and the picture is as large as the full panorama: it was \
                 taken for that",
                area(crop)
            ));
            return Ok(full);
        }
        Err(format!(
            "the cropped area is {} pixels, and the picture has another shape, {}: it was cropped or \
             extended later",
            area(crop),
            area(picture)
        ))
    }

    /// The place of the cropped area, in the middle if the file does not say.
    fn corner(&self, full: [f64; 2], crop: [f64; 2], warnings: &mut Vec<String>) -> [f64; 2] {
        [0, 1].map(|axis| {
            self.corner[axis].unwrap_or_else(|| {
                let middle = (full[axis] - crop[axis]) / 2.0;
                if middle.abs() > 1.0 {
                    warnings.push(missing(CORNER[axis], "the middle"));
                }
                middle
            })
        })
    }

    /// A fisheye. A field of 180 degrees is assumed unless the size of a full panorama says another.
    fn fisheye(&self, size: [usize; 2], lens: Lens, up: bool) -> Result<Panorama, String> {
        let mut panorama = Panorama::new(SOURCE, Shows::Whole);
        let picture = size.map(|length| length as f64);
        let crop = match self.crop {
            [Some(width), Some(height)] => [width, height],
            _ => picture,
        };
        if (picture[0] * crop[1] - picture[1] * crop[0]).abs() > crop[0] + crop[1] {
            return Err(format!(
                "the cropped area is {} pixels, and the picture has another shape, {}",
                area(crop),
                area(picture)
            ));
        }
        // The pixels of half a turn through the axis, and the place of the axis.
        let middle = crop.map(|length| length / 2.0);
        let (of_180, axis) = match self.full {
            [Some(width), Some(height)] if is_twice(width, height) && lens == Lens::Equidistant => {
                let corner = [0, 1].map(|axis| self.corner[axis].map(|at| [width, height][axis] / 2.0 - at));
                (height, [corner[0].unwrap_or(middle[0]), corner[1].unwrap_or(middle[1])])
            }
            [Some(width), Some(height)] if (width - height).abs() <= 1.0 => {
                let corner = [0, 1].map(|axis| self.corner[axis].map(|at| [width, height][axis] / 2.0 - at));
                (width, [corner[0].unwrap_or(middle[0]), corner[1].unwrap_or(middle[1])])
            }
            [None, None] if (crop[0] - crop[1]).abs() <= 1.0 => (crop[0], middle),
            [None, None] => {
                return Err(format!(
                    "a fisheye of {} pixels is not square: it may hold two, or be cropped",
                    area(crop)
                ));
            }
            [width, height] => {
                return Err(format!(
                    "a full panorama of {} pixels says no field of view of a fisheye",
                    area([width.unwrap_or(0.0), height.unwrap_or(0.0)])
                ));
            }
        };
        let scale = [picture[0] / crop[0], picture[1] / crop[1]];
        let half = of_180 / 2.0 / lens.radius(FRAC_PI_2);
        let focal = scale.map(|scale| scale * half);
        // As far as the picture reaches to a side, and no farther than half a turn.
        let side = (0..2).map(|k| axis[k].max(crop[k] - axis[k])).fold(0.0, f64::max);
        let reach = if (side * 2.0 - of_180).abs() <= 1.0 || lens != Lens::Equidistant {
            FRAC_PI_2
        } else {
            (side / half).min(PI)
        };
        // A dome master looks up, its lower side toward the front.
        let turn = if up { Rotation::from_yaw_pitch_roll(0.0, -FRAC_PI_2, 0.0) } else { Rotation::IDENTITY };
        let turn = self.pose().after(turn);
        let centre = [axis[0] * scale[0], axis[1] * scale[1]];
        let part = Part::of_fisheye(size, lens, centre, focal, reach, turn)
            .ok_or_else(|| "its numbers make no fisheye".to_owned())?;
        if self.full == [None; 2] {
            panorama.warnings.push("it says no field of view: 180 degrees were assumed".into());
        }
        let degrees = rounded(2.0 * reach.to_degrees());
        let text = format!("an {} fisheye of {degrees} degrees", lens.name());
        panorama.shows = Shows::Part(part, text.replace("an stereo", "a stereo"));
        Ok(panorama)
    }
}

/// The fisheyes that ProjectionType may name, in small letters, and whether the picture is a dome above.
fn fisheye(plain: &str) -> Option<(Lens, bool)> {
    let lens = match plain {
        "fisheye" | "circularfisheye" | "fisheyecircular" | "equidistant" | "equidistantfisheye"
        | "fisheyeequidistant" | "angular" | "angularfisheye" | "fisheyeangular" | "hemispherical" => {
            Lens::Equidistant
        }
        "equisolid" | "equisolidfisheye" | "fisheyeequisolid" | "equisolidangle" => Lens::Equisolid,
        "stereographic" | "stereographicfisheye" | "fisheyestereographic" => Lens::Stereographic,
        "orthographic" | "orthographicfisheye" | "fisheyeorthographic" => Lens::Orthographic,
        "dome" | "domemaster" | "fulldome" => return Some((Lens::Equidistant, true)),
        _ => return None,
    };
    Some((lens, false))
}

/// Twice as wide as high, but for rounding; of large ones, to even numbers.
fn is_twice(width: f64, height: f64) -> bool {
    (width - 2.0 * height).abs() <= if width < 1000.0 { 1.0 } else { 2.0 }
}

fn missing(name: &str, instead: &str) -> String {
    format!("GPano:{name} is missing; {instead} was taken")
}

fn area([width, height]: [f64; 2]) -> String {
    format!("{} x {}", rounded(width), rounded(height))
}

/// A number with at most two digits after the point.
pub(crate) fn rounded(value: f64) -> f64 {
    // Not -0.
    (value * 100.0).round() / 100.0 + 0.0
}

fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}
