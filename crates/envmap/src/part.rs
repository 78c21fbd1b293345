//! Pictures of a part of the sphere: a piece of a lat-long image, and a fisheye.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use sphere::{DMat3, DVec3, Direction, LatLong, Rotation};

/// The most rows of [`Part::default_grid`]: 16384 x 8192, as large as the largest picture that is read.
const MOST_ROWS: f64 = 8192.0;

/// The largest difference, in pixels, that counts as rounding.
const ROUNDING: f64 = 1e-6;

/// A fisheye: how far from the picture's centre the light of an angle t from the axis arrives, in focal
/// lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Lens {
    /// r = t, also called an angular map.
    Equidistant,
    /// r = 2 sin(t / 2): pixels have equal solid angles.
    Equisolid,
    /// r = 2 tan(t / 2).
    Stereographic,
    /// r = sin(t), for angles up to 90 degrees.
    Orthographic,
}

impl Lens {
    /// The lens's name in a sentence.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Equidistant => "equidistant",
            Self::Equisolid => "equisolid",
            Self::Stereographic => "stereographic",
            Self::Orthographic => "orthographic",
        }
    }

    /// The distance from the centre, in focal lengths, of an angle from the axis, in radians.
    pub fn radius(self, angle: f64) -> f64 {
        match self {
            Self::Equidistant => angle,
            Self::Equisolid => 2.0 * math::sin(angle / 2.0),
            Self::Stereographic => 2.0 * math::sin(angle / 2.0) / math::cos(angle / 2.0),
            Self::Orthographic => math::sin(angle),
        }
    }

    /// The angle at a distance from the centre; `None` if no light arrives there.
    fn angle(self, radius: f64) -> Option<f64> {
        let angle = match self {
            Self::Equidistant => radius,
            Self::Equisolid => 2.0 * math::asin(half(radius)?),
            Self::Stereographic => 2.0 * math::atan2(radius / 2.0, 1.0),
            Self::Orthographic => math::asin((radius <= 1.0).then_some(radius)?),
        };
        (angle <= PI).then_some(angle)
    }

    /// Solid angle by area at an angle t, sin(t) / (r dr/dt).
    fn density(self, angle: f64) -> f64 {
        match self {
            Self::Equidistant if angle < 1e-8 => 1.0,
            Self::Equidistant => math::sin(angle) / angle,
            Self::Equisolid => 1.0,
            Self::Stereographic => math::powi(math::cos(angle / 2.0), 4),
            Self::Orthographic => 1.0 / math::cos(angle).max(1e-3),
        }
    }

    /// The largest angle from the axis.
    pub const fn largest(self) -> f64 {
        match self {
            Self::Equidistant | Self::Equisolid => PI,
            // The whole plane is no picture.
            Self::Stereographic => 0.99 * PI,
            Self::Orthographic => FRAC_PI_2,
        }
    }
}

fn half(radius: f64) -> Option<f64> {
    (radius <= 2.0).then_some(radius / 2.0)
}

/// Where the pixels of a picture that shows a part of the sphere lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    width: usize,
    height: usize,
    shape: Shape,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    /// A piece of a lat-long image of `full` columns and rows, in the picture's pixels, whose corner lies
    /// at `corner`. It may lie across the seam.
    LatLong { full: [f64; 2], corner: [f64; 2] },
    Fisheye {
        lens: Lens,
        /// The axis, in pixels from the picture's corner.
        centre: [f64; 2],
        /// The focal length, in columns and in rows.
        focal: [f64; 2],
        /// The largest angle from the axis.
        reach: f64,
        /// The rotation from the camera's frame (+X the axis, +Z the top of the picture) to Specula's.
        turn: DMat3,
    },
}

impl Part {
    /// A picture of `size` columns and rows out of a lat-long image of `full` ones, both in pixels of the
    /// picture; `corner` is the place of its upper left corner in that.
    ///
    /// A picture that reaches past the right border continues at the left one. `None` if it does not fit by
    /// more than a pixel, or a number is not finite.
    pub fn of_lat_long(size: [usize; 2], full: [f64; 2], corner: [f64; 2]) -> Option<Self> {
        let [width, height] = size.map(|length| length as f64);
        let finite = full.iter().chain(&corner).all(|value| value.is_finite()) && full[0] > 0.0;
        let fits = width <= full[0] + 1.0 && corner[1] >= -1.0 && corner[1] + height <= full[1] + 1.0;
        let [x, y] = corner;
        let y = y.clamp(0.0, (full[1] - height).max(0.0));
        let shape = Shape::LatLong { full, corner: [x.rem_euclid(full[0]), y] };
        (finite && fits && width > 0.0 && height > 0.0).then_some(Self {
            width: size[0],
            height: size[1],
            shape,
        })
    }

    /// A fisheye of `size` columns and rows: `centre` is where its axis meets the picture, `focal` the focal
    /// length, each in columns and in rows, `reach` the largest angle from the axis, in radians. Without
    /// `turn` the axis is +X and the picture's top +Z.
    ///
    /// `None` if a number is not finite, or the lens has no such angle.
    pub fn of_fisheye(
        size: [usize; 2],
        lens: Lens,
        centre: [f64; 2],
        focal: [f64; 2],
        reach: f64,
        turn: Rotation,
    ) -> Option<Self> {
        let finite = centre.iter().chain(&focal).all(|value| value.is_finite());
        let sound = finite
            && focal.iter().all(|&focal| focal > 0.0)
            && reach > 0.0
            && reach <= lens.largest() + 1e-9
            && size.iter().all(|&length| length > 0);
        let shape = Shape::Fisheye { lens, centre, focal, reach, turn: turn.matrix() };
        sound.then_some(Self { width: size[0], height: size[1], shape })
    }

    /// The number of columns and rows of the picture.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// The grid of the environment, in which texels are no larger than the picture's pixels at the equator or
    /// on the axis, with 8192 rows at most.
    pub fn default_grid(&self) -> LatLong {
        let rows = match self.shape {
            Shape::LatLong { full: [columns, rows], .. } => rows.max(columns / 2.0).round(),
            Shape::Fisheye { focal, .. } => (PI * focal[0].max(focal[1]) - ROUNDING).ceil(),
        };
        LatLong::with_rows(rows.clamp(1.0, MOST_ROWS) as usize)
    }

    /// The column and row of the picture's corner in [`Part::default_grid`] if its texels are pixels of the
    /// picture.
    pub(crate) fn aligned(&self) -> Option<[usize; 2]> {
        let Shape::LatLong { full, corner } = self.shape else { return None };
        let grid = self.default_grid();
        let whole = |value: f64| (value - value.round()).abs() < ROUNDING;
        let lengths = [grid.width, grid.height];
        let same = full.iter().zip(lengths).all(|(full, grid)| (full - grid as f64).abs() < ROUNDING);
        let inside = self.width <= grid.width && corner[1].round() as usize + self.height <= grid.height;
        (same && inside && corner.iter().all(|&value| whole(value)))
            .then(|| [corner[0].round() as usize % grid.width, corner[1].round() as usize])
    }

    /// The share of the sphere that the picture does not show.
    ///
    /// In closed form, but for a fisheye that the picture's border cuts: that is counted on 1024 x 512
    /// directions.
    pub fn missing(&self) -> f64 {
        match self.shape {
            Shape::LatLong { full, corner: [_, top] } => {
                let [from, to] = [top, top + self.height as f64].map(|y| (PI * y / full[1]).clamp(0.0, PI));
                let around = (self.width as f64 / full[0]).min(1.0);
                (1.0 - around * (math::cos(from) - math::cos(to)) / 2.0).max(0.0)
            }
            Shape::Fisheye { lens, centre, focal, reach, .. } => {
                let radius = lens.radius(reach);
                let size = self.size().map(|length| length as f64);
                let inside = (0..2).all(|axis| {
                    let (low, high) =
                        (centre[axis] - radius * focal[axis], centre[axis] + radius * focal[axis]);
                    low > -ROUNDING && high < size[axis] + ROUNDING
                });
                if inside {
                    return (1.0 + math::cos(reach)) / 2.0;
                }
                let grid = LatLong::with_rows(512);
                let row = |row: usize| {
                    let seen = (0..grid.width).filter(|&c| self.place(grid.direction(row, c)).is_some());
                    seen.count() as f64 * grid.solid_angle(row)
                };
                1.0 - (0..grid.height).map(row).sum::<f64>() / (4.0 * PI)
            }
        }
    }

    /// The place of a direction in the picture, in pixels from its corner; `None` if it is not in it.
    pub(crate) fn place(&self, direction: Direction) -> Option<[f64; 2]> {
        let [width, height] = self.size().map(|length| length as f64);
        let [x, y] = match self.shape {
            Shape::LatLong { full, corner } => {
                let [x, y] = lat_long_place(direction, full, corner);
                [if self.is_closed() { x.min(width) } else { snapped(x, width) }, snapped(y, height)]
            }
            Shape::Fisheye { lens, centre, focal, reach, turn } => {
                let (angle, [right, up]) = from_axis(turn.transpose() * direction.vector());
                if angle > reach + 1e-12 {
                    return None;
                }
                let radius = lens.radius(angle);
                let [x, y] = [centre[0] + radius * right * focal[0], centre[1] - radius * up * focal[1]];
                [snapped(x, width), snapped(y, height)]
            }
        };
        ((0.0..=width).contains(&x) && (0.0..=height).contains(&y)).then_some([x, y])
    }

    /// The pixel that is nearest to a direction that the picture does not show.
    pub(crate) fn nearest(&self, direction: Direction) -> usize {
        let [x, y] = match self.shape {
            Shape::LatLong { full, corner } => {
                let [x, y] = lat_long_place(direction, full, corner);
                let past = x - self.width as f64;
                [if past > 0.0 && past > full[0] - x { 0.0 } else { x }, y]
            }
            Shape::Fisheye { lens, centre, focal, reach, turn } => {
                let (angle, [right, up]) = from_axis(turn.transpose() * direction.vector());
                // A pixel inside the rim.
                let rim = lens.radius(reach) - 1.0 / focal[0].min(focal[1]);
                let radius = lens.radius(angle.min(reach)).min(rim).max(0.0);
                [centre[0] + radius * right * focal[0], centre[1] - radius * up * focal[1]]
            }
        };
        let at = |value: f64, length: usize| (value.max(0.0) as usize).min(length - 1);
        at(y, self.height) * self.width + at(x, self.width)
    }

    /// Whether the picture's right border meets its left one.
    fn is_closed(&self) -> bool {
        matches!(self.shape, Shape::LatLong { full, .. } if self.width as f64 + 0.5 > full[0])
    }

    /// The column of the picture that continues it at a column outside.
    pub(crate) fn column(&self, column: isize) -> usize {
        let width = self.width as isize;
        match self.is_closed() {
            true => column.rem_euclid(width) as usize,
            false => column.clamp(0, width - 1) as usize,
        }
    }

    /// Whether the picture uses a pixel.
    pub(crate) fn uses(&self, row: usize, column: usize) -> bool {
        match self.shape {
            Shape::LatLong { .. } => row < self.height && column < self.width,
            Shape::Fisheye { lens, centre, focal, reach, .. } => {
                let right = (column as f64 + 0.5 - centre[0]) / focal[0];
                let up = (row as f64 + 0.5 - centre[1]) / focal[1];
                let rim = lens.radius(reach);
                row < self.height && column < self.width && right * right + up * up <= rim * rim
            }
        }
    }

    /// The direction of a pixel's centre; `None` if the picture does not use the pixel.
    pub fn direction(&self, row: usize, column: usize) -> Option<Direction> {
        if !self.uses(row, column) {
            return None;
        }
        let at = [column as f64 + 0.5, row as f64 + 0.5];
        match self.shape {
            Shape::LatLong { full, corner } => {
                let theta = PI * (corner[1] + at[1]) / full[1];
                Some(Direction::from_angles(theta.min(PI), TAU * (0.5 - (corner[0] + at[0]) / full[0])))
            }
            Shape::Fisheye { lens, centre, focal, reach, turn } => {
                let [right, up] = [(at[0] - centre[0]) / focal[0], (centre[1] - at[1]) / focal[1]];
                let radius = math::hypot(right, up);
                let angle = lens.angle(radius)?.min(reach);
                let scale = if radius > 0.0 { math::sin(angle) / radius } else { 1.0 };
                let seen = DVec3::new(math::cos(angle), -right * scale, up * scale);
                Some(Direction::normalised(turn * seen))
            }
        }
    }

    /// The solid angle of the part of a pixel that shows light, in steradians.
    ///
    /// Exact for a piece of a lat-long image. Pixels of a fisheye are integrated with four Gauss points, and
    /// those at its rim with the midpoints of a 16 x 16 grid.
    pub fn solid_angle(&self, row: usize, column: usize) -> f64 {
        match self.shape {
            Shape::LatLong { full, corner: [_, top] } => {
                let [from, to] = [0.0, 1.0].map(|y| (PI * (top + row as f64 + y) / full[1]).min(PI));
                TAU / full[0] * 2.0 * math::sin((from + to) / 2.0) * math::sin((to - from) / 2.0)
            }
            Shape::Fisheye { lens, centre, focal, reach, .. } => {
                let at = |x: f64, y: f64| {
                    let [right, up] =
                        [(column as f64 + x - centre[0]) / focal[0], (centre[1] - row as f64 - y) / focal[1]];
                    math::hypot(right, up)
                };
                let density = |radius: f64| match lens.angle(radius).filter(|&angle| angle <= reach) {
                    Some(angle) => lens.density(angle),
                    None => 0.0,
                };
                let (rim, pixel) = (lens.radius(reach), 1.0 / focal[0].min(focal[1]));
                let middle = at(0.5, 0.5);
                let mean = if middle - pixel > rim {
                    0.0
                } else if middle + 2.0 * pixel < rim {
                    let offset = 0.5 / 3.0_f64.sqrt();
                    let points = [0.5 - offset, 0.5 + offset];
                    points.iter().flat_map(|&y| points.map(|x| density(at(x, y)))).sum::<f64>() / 4.0
                } else {
                    const POINTS: usize = 16;
                    let point = |k: usize| (k as f64 + 0.5) / POINTS as f64;
                    let points = (0..POINTS * POINTS).map(|k| at(point(k % POINTS), point(k / POINTS)));
                    points.map(density).sum::<f64>() / (POINTS * POINTS) as f64
                };
                mean / (focal[0] * focal[1])
            }
        }
    }

    /// The side, in radians, of a square as large as the smallest pixel within `radius` of a direction; a
    /// quarter of that at the border of the part, so that the area inside is counted on more points.
    pub(crate) fn side(&self, direction: Direction, radius: f64) -> f64 {
        let side = self.side_inside(direction, radius);
        if self.is_at_border(direction, radius) { side / 4.0 } else { side }
    }

    /// Whether the border of the part is within `radius` of a direction; the picture's own border across a
    /// fisheye does not count.
    fn is_at_border(&self, direction: Direction, radius: f64) -> bool {
        match self.shape {
            Shape::LatLong { full, corner } => {
                let [x, y] = lat_long_place(direction, full, corner);
                let [width, height] = self.size().map(|length| length as f64);
                let v = direction.vector();
                let (column, row) = (TAU / full[0] * math::hypot(v.x, v.y), PI / full[1]);
                let across = x.min((x - width).abs()).min(full[0] - x) * column < radius;
                y.abs().min((y - height).abs()) * row < radius || across && !self.is_closed()
            }
            Shape::Fisheye { reach, turn, .. } => {
                let (angle, _) = from_axis(turn.transpose() * direction.vector());
                (angle - reach).abs() < radius
            }
        }
    }

    fn side_inside(&self, direction: Direction, radius: f64) -> f64 {
        match self.shape {
            Shape::LatLong { full, .. } => {
                let v = direction.vector();
                let sine = math::hypot(v.x, v.y);
                (TAU / full[0] * PI / full[1] * (sine - radius).max(0.0)).sqrt()
            }
            Shape::Fisheye { lens, focal, reach, turn, .. } => {
                let (angle, _) = from_axis(turn.transpose() * direction.vector());
                let density =
                    [angle - radius, angle + radius].map(|angle| lens.density(angle.clamp(0.0, reach)));
                (density[0].min(density[1]).max(0.0) / (focal[0] * focal[1])).sqrt()
            }
        }
    }
}

/// The place of a direction in pixels from the corner of a piece; the column is less than a turn.
fn lat_long_place(direction: Direction, full: [f64; 2], corner: [f64; 2]) -> [f64; 2] {
    let x = ((0.5 - direction.phi() / TAU) * full[0] - corner[0]).rem_euclid(full[0]);
    let x = if full[0] - x < ROUNDING { 0.0 } else { x };
    [x, direction.theta() / PI * full[1] - corner[1]]
}

/// Puts a place that rounding has moved out of 0 to `length` back on the end.
fn snapped(value: f64, length: f64) -> f64 {
    let inside = value.clamp(0.0, length);
    if (inside - value).abs() < ROUNDING { inside } else { value }
}

/// The angle from +X, and the direction to the right and up around it.
fn from_axis(v: DVec3) -> (f64, [f64; 2]) {
    let sine = math::hypot(v.y, v.z);
    let around = if sine > 0.0 { [-v.y / sine, v.z / sine] } else { [1.0, 0.0] };
    (math::atan2(sine, v.x), around)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENSES: [Lens; 4] = [Lens::Equidistant, Lens::Equisolid, Lens::Stereographic, Lens::Orthographic];

    /// A fisheye of this field, in degrees, that fills a square.
    fn fisheye(edge: usize, lens: Lens, degrees: f64, turn: Rotation) -> Part {
        let (half, reach) = (edge as f64 / 2.0, degrees.to_radians() / 2.0);
        Part::of_fisheye([edge; 2], lens, [half; 2], [half / lens.radius(reach); 2], reach, turn).unwrap()
    }

    /// 2 pi (1 - cos(reach)) for a cap; phi (cos - cos) for a piece of a lat-long image.
    #[test]
    fn solid_angles_make_the_part() {
        for lens in LENSES {
            for degrees in [60.0, 120.0, 170.0] {
                let part = fisheye(64, lens, degrees, Rotation::IDENTITY);
                let sum: f64 = (0..64 * 64).map(|k| part.solid_angle(k / 64, k % 64)).sum();
                let cap = TAU * (1.0 - f64::cos(degrees.to_radians() / 2.0));
                // The rim is counted on points of 1/16 of a pixel.
                assert!((sum / cap - 1.0).abs() < 1e-3, "{lens:?} {degrees}: {sum} {cap}");
                assert!((part.missing() - (1.0 - cap / (4.0 * PI))).abs() < 1e-12);
            }
        }
        let part = Part::of_lat_long([8, 4], [32.0, 16.0], [30.0, 2.0]).unwrap();
        let sum: f64 = (0..32).map(|k| part.solid_angle(k / 8, k % 8)).sum();
        let expected = TAU / 4.0 * (f64::cos(PI / 8.0) - f64::cos(3.0 * PI / 8.0));
        assert!((sum - expected).abs() < 1e-12, "{sum} {expected}");
        assert!((part.missing() - 1.0 + expected / (4.0 * PI)).abs() < 1e-12);
    }

    /// A circle that the border of the picture cuts above and below. Its share is counted on directions, the
    /// solid angles on pixels.
    #[test]
    fn a_cut_fisheye_lacks_what_is_cut() {
        let whole = fisheye(64, Lens::Equidistant, 180.0, Rotation::IDENTITY);
        let Shape::Fisheye { focal, .. } = whole.shape else { panic!() };
        let cut =
            Part::of_fisheye([64, 32], Lens::Equidistant, [32.0, 16.0], focal, FRAC_PI_2, Rotation::IDENTITY)
                .unwrap();
        let sum: f64 = (0..32 * 64).map(|k| cut.solid_angle(k / 64, k % 64)).sum();
        assert!((1.0 - cut.missing() - sum / (4.0 * PI)).abs() < 2e-3, "{} {sum}", cut.missing());
        assert!(cut.missing() > 0.55 && cut.missing() < 0.7);
    }

    #[test]
    fn a_pixel_lies_where_its_direction_does() {
        let turn = Rotation::from_yaw_pitch_roll(1.0, -0.5, 2.0);
        let parts = [
            fisheye(9, Lens::Equidistant, 360.0, turn),
            fisheye(10, Lens::Equisolid, 300.0, turn),
            fisheye(10, Lens::Stereographic, 200.0, turn),
            fisheye(10, Lens::Orthographic, 180.0, turn),
            Part::of_lat_long([10, 5], [20.0, 10.0], [15.0, 2.5]).unwrap(),
            Part::of_lat_long([20, 10], [20.0, 10.0], [0.0, 0.0]).unwrap(),
        ];
        for part in parts {
            let [width, height] = part.size();
            for (row, column) in (0..width * height).map(|k| (k / width, k % width)) {
                let Some(direction) = part.direction(row, column) else { continue };
                let [x, y] = part.place(direction).unwrap();
                let away = (x - column as f64 - 0.5).hypot(y - row as f64 - 0.5);
                assert!(away < 1e-6, "{part:?} {row} {column}: {x} {y}");
            }
        }
    }

    #[test]
    fn every_direction_is_in_the_part_or_has_a_nearest_pixel() {
        let parts = [
            fisheye(1, Lens::Equidistant, 180.0, Rotation::IDENTITY),
            fisheye(7, Lens::Orthographic, 180.0, Rotation::IDENTITY),
            Part::of_lat_long([1, 1], [20.0, 10.0], [19.0, 9.0]).unwrap(),
            Part::of_lat_long([20, 3], [20.0, 10.0], [7.0, 7.0]).unwrap(),
        ];
        let grid = LatLong { width: 40, height: 20 };
        for part in parts {
            let [width, height] = part.size();
            for k in 0..grid.len() {
                let direction = grid.direction(k / 40, k % 40);
                assert!(part.nearest(direction) < width * height);
                if let Some([x, y]) = part.place(direction) {
                    assert!(x <= width as f64 && y <= height as f64);
                }
            }
        }
    }

    #[test]
    fn what_is_no_part_is_refused() {
        assert!(Part::of_lat_long([33, 4], [20.0, 10.0], [0.0; 2]).is_none());
        assert!(Part::of_lat_long([4, 4], [20.0, 10.0], [0.0, 8.0]).is_none());
        assert!(Part::of_lat_long([4, 4], [f64::NAN, 10.0], [0.0; 2]).is_none());
        let fisheye = |focal: f64, reach: f64| {
            let turn = Rotation::IDENTITY;
            Part::of_fisheye([4, 4], Lens::Orthographic, [2.0; 2], [focal; 2], reach, turn)
        };
        assert!(fisheye(2.0, FRAC_PI_2).is_some());
        assert!(fisheye(0.0, 1.0).is_none() && fisheye(f64::INFINITY, 1.0).is_none());
        assert!(fisheye(2.0, 2.0).is_none() && fisheye(2.0, f64::NAN).is_none());
    }
}
