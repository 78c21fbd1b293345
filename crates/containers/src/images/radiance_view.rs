//! VIEW of a Radiance picture: how its pixels look into the scene.
//!
//! Ward, "rpict(1)" and `common/view.c` of Radiance: the view's type, its direction and up, its horizontal
//! and vertical size in degrees, and its shift and lift in sizes of the picture. Fisheyes are angular (a:
//! equidistant), hemispherical (h: orthographic) and planispheric (s: stereographic). Of several lines each
//! changes what it names, and the rest stays.

use envmap::{Lens, Part};
use sphere::{DMat3, DQuat, DVec3, Rotation};

use super::gpano::rounded;
use super::panorama::{Panorama, Shows};

/// The name of the metadata in a message.
const SOURCE: &str = "the header's VIEW";

/// The panorama that the texts of all VIEW lines, one after the other, make of a picture of this size.
pub(crate) fn of_view(text: &str, size: [usize; 2]) -> Option<Panorama> {
    let view = match View::parse(text) {
        Ok(view) => view,
        Err(why) => return Some(Panorama::new(SOURCE, Shows::Unclear(why))),
    };
    let lens = match view.kind {
        'a' => Lens::Equidistant,
        'h' => Lens::Orthographic,
        's' => Lens::Stereographic,
        kind => {
            let name = match kind {
                'v' => "a perspective view",
                'l' => "a parallel view",
                'c' => "a cylindrical panorama",
                _ => "a view of a type that is not known",
            };
            let mut panorama = Panorama::new(SOURCE, Shows::Whole);
            let warning = format!(
                "it is {name} (-vt{kind}), which is not read from the header; the picture was taken for the \
                 whole sphere"
            );
            panorama.warnings.push(warning);
            return Some(panorama);
        }
    };
    let shows = view.fisheye(size, lens).unwrap_or_else(Shows::Unclear);
    Some(Panorama::new(SOURCE, shows))
}

struct View {
    kind: char,
    direction: DVec3,
    up: DVec3,
    /// The horizontal and the vertical size in degrees.
    sizes: [f64; 2],
    /// The shift to the right and up, in sizes of the picture.
    shift: [f64; 2],
}

impl View {
    fn parse(text: &str) -> Result<Self, String> {
        let mut view =
            Self { kind: 'v', direction: DVec3::Y, up: DVec3::Z, sizes: [45.0; 2], shift: [0.0; 2] };
        let mut words = text.split_whitespace();
        while let Some(word) = words.next() {
            let mut numbers = |count: usize| -> Result<Vec<f64>, String> {
                let read = (0..count).map(|_| words.next()?.parse::<f64>().ok().filter(|n| n.is_finite()));
                read.collect::<Option<_>>().ok_or_else(|| format!("{word} lacks its numbers"))
            };
            let vector = |numbers: Vec<f64>| DVec3::new(numbers[0], numbers[1], numbers[2]);
            match word {
                "-vd" => view.direction = vector(numbers(3)?),
                "-vu" => view.up = vector(numbers(3)?),
                "-vh" => view.sizes[0] = numbers(1)?[0],
                "-vv" => view.sizes[1] = numbers(1)?[0],
                "-vs" => view.shift[0] = numbers(1)?[0],
                "-vl" => view.shift[1] = numbers(1)?[0],
                _ => {
                    if let Some(kind) = word.strip_prefix("-vt") {
                        view.kind = kind.chars().next().unwrap_or('v');
                    }
                }
            }
        }
        Ok(view)
    }

    fn fisheye(&self, size: [usize; 2], lens: Lens) -> Result<Shows, String> {
        let largest = 2.0 * lens.largest().to_degrees();
        for (name, degrees) in ["-vh", "-vv"].into_iter().zip(self.sizes) {
            if !(degrees > 0.0 && degrees <= largest + 1e-9) {
                let lens = lens.name();
                return Err(format!("{name} is {degrees}; a field of an {lens} fisheye is up to {largest}"));
            }
        }
        let right = self.direction.cross(self.up);
        let (Some(forward), Some(right)) = (self.direction.try_normalize(), right.try_normalize()) else {
            return Err("its direction and its up vector name no camera".into());
        };
        // Radiance's +Y is forward, +X to the right of it.
        let here = |v: DVec3| DVec3::new(v.y, -v.x, v.z);
        let axes = [forward, -right, right.cross(forward)].map(here);
        let [x, y, z, w] = DQuat::from_mat3(&DMat3::from_cols(axes[0], axes[1], axes[2])).to_array();
        let turn = Rotation::from_quaternion(x, y, z, w).unwrap_or(Rotation::IDENTITY);
        let lengths = size.map(|length| length as f64);
        let halves = self.sizes.map(|degrees| degrees.to_radians() / 2.0);
        let focal = [0, 1].map(|axis| lengths[axis] / 2.0 / lens.radius(halves[axis]));
        let centre = [lengths[0] * (0.5 - self.shift[0]), lengths[1] * (0.5 + self.shift[1])];
        let reach = halves[0].max(halves[1]).min(lens.largest());
        let part = Part::of_fisheye(size, lens, centre, focal, reach, turn)
            .ok_or_else(|| "its numbers make no fisheye".to_owned())?;
        let axis = here(forward);
        let elevation = rounded(math::asin(axis.z.clamp(-1.0, 1.0)).to_degrees());
        let article = if lens == Lens::Stereographic { "a" } else { "an" };
        let [across, down] = self.sizes.map(rounded);
        let degrees = if across == down { format!("{across}") } else { format!("{across} x {down}") };
        let toward = match axis.z.abs() > 1.0 - 1e-9 {
            true => String::new(),
            // To the left of the front, as yaw.
            false => format!(" and {} of yaw", rounded(math::atan2(axis.y, axis.x).to_degrees())),
        };
        let text = format!(
            "{article} {} fisheye of {degrees} degrees toward {elevation} degrees of elevation{toward}",
            lens.name()
        );
        Ok(Shows::Part(part, text))
    }
}
