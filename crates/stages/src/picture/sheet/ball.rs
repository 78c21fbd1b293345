//! A ball of a material in front of its environment.
//!
//! The camera looks along +X, up is +Z: the picture's centre is the centre of the lat-long image. A pixel
//! that looks along d and meets the ball at normal N shows the map toward the view V = -d, at its central
//! direction: R = d - 2 (d . N) N, or N, or the tangent T = Z x N.

use envmap::Environment;
use sh::{Stop, Stopped};
use shrm::{Lamps, Lookup, Shrm};
use sphere::{DVec3, Direction};

use crate::picture::ball_camera::{draw, inside, tangent};

/// Half the picture's width at distance 1: a view of 53 degrees.
const HALF_WIDTH: f64 = 0.5;
/// The ball's outline in units of half the picture's width.
const OUTLINE: f64 = 0.8;
/// The numbers of samples along each side of a pixel: of the background, on the outline, on the ball.
const SAMPLES: [usize; 3] = [1, 6, 2];

/// The radiance that an `edge` x `edge` picture sees, of a ball whose reflected light is in `field`, and that
/// of the lamps beside it.
pub(crate) fn ball(
    environment: &Environment,
    field: &Shrm,
    lamps: Option<&Lamps>,
    edge: usize,
    stop: Stop<'_>,
) -> Result<Vec<[f32; 3]>, Stopped> {
    let lamps = lamps.map(Lamps::for_views);
    // A unit ball at a distance with tan(asin(1 / distance)) = outline.
    let outline = OUTLINE * HALF_WIDTH;
    let distance = (1.0 + 1.0 / (outline * outline)).sqrt();
    let see = |lookup: &mut Lookup<'_>, [x, y]: [f64; 2], _: usize| {
        // Looking along +X, the picture's right is -Y.
        let ray = DVec3::new(1.0, -x * HALF_WIDTH, -y * HALF_WIDTH).normalize();
        Some(match hit(ray, distance) {
            Some(normal) => {
                let (central, view) = seen(field, ray, normal);
                let soft = lookup.radiance(central, view);
                match lamps.as_ref().map(|lamps| lamps.radiance(central, view)) {
                    Some(lamps) => std::array::from_fn(|c| f64::from(soft[c]).max(0.0) + lamps[c]),
                    None => soft.map(f64::from),
                }
            }
            None => environment.radiance(Direction::normalised(ray)),
        })
    };
    let side = |column: usize, row: usize| {
        let inside = inside(OUTLINE, column, row, edge);
        SAMPLES[if inside < -1.0 { 0 } else { 1 + usize::from(inside > 1.0) }]
    };
    draw(edge, stop, side, || field.lookup(), see)
}

/// The normal where a ray from the origin meets the unit ball around (distance, 0, 0).
fn hit(ray: DVec3, distance: f64) -> Option<DVec3> {
    let along = ray.x * distance;
    let discriminant = along * along - (distance * distance - 1.0);
    (discriminant > 0.0).then(|| ray * (along - discriminant.sqrt()) - DVec3::X * distance)
}

/// The central direction and the view of a ray that meets the ball at this normal.
fn seen(field: &Shrm, ray: DVec3, normal: DVec3) -> (Direction, Direction) {
    let view = Direction::normalised(-ray);
    (field.centre().central(Direction::normalised(normal), tangent(normal), view), view)
}

#[cfg(test)]
mod tests {
    use brdf::Centre;
    use sh::Degree;
    use shrm::{MapGrid, Terms, View};
    use sphere::LatLong;

    use super::*;

    /// Draws the ball without lamps, to its end.
    fn whole(environment: &Environment, field: &Shrm, edge: usize) -> Vec<[f32; 3]> {
        ball(environment, field, None, edge, Stop::NEVER).unwrap()
    }

    /// A map that shows the same toward every view: B_00 Y_00.
    fn field(centre: Centre, of: impl Fn(DVec3) -> [f32; 3]) -> Shrm {
        let map = environment(of);
        let scale = (4.0 * std::f32::consts::PI).sqrt();
        let values = map.pixels().iter().map(|pixel| pixel.map(|value| value * scale)).collect();
        Shrm::new(MapGrid::LatLong(map.grid()), View::Local, centre, Degree::ZERO, Terms::All, values)
            .unwrap()
    }

    fn environment(of: impl Fn(DVec3) -> [f32; 3]) -> Environment {
        let grid = LatLong::with_rows(64);
        let texels = (0..grid.height).flat_map(|row| (0..grid.width).map(move |column| (row, column)));
        let pixels = texels.map(|(row, column)| of(grid.direction(row, column).vector())).collect();
        Environment::new(grid, pixels).unwrap()
    }

    #[test]
    fn the_ball_covers_its_outline() {
        let (white, black) = (field(Centre::Normal, |_| [1.0; 3]), environment(|_| [0.0; 3]));
        let edge = 200;
        let picture = whole(&black, &white, edge);
        let area = picture.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / (edge * edge) as f64;
        // A circle of radius 0.8 in a square of edge 2; 6 x 6 samples along its edge.
        assert!((area - std::f64::consts::PI * 0.16).abs() < 1e-3, "{area}");
    }

    #[test]
    fn a_mirror_ball_shows_what_lies_behind_the_camera() {
        let position = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32];
        let black = environment(|_| [0.0; 3]);
        let (edge, middle) = (201, 100);
        let close = |pixel: [f32; 3], expected: [f32; 3]| {
            // Bilinear interpolation between 2.8 degree texels errs by up to (0.049)^2 / 8.
            assert!((0..3).all(|c| (pixel[c] - expected[c]).abs() < 2e-3), "{pixel:?}, not {expected:?}");
        };
        let mirror = whole(&black, &field(Centre::Reflection, position), edge);
        close(mirror[middle * edge + middle], [-1.0, 0.0, 0.0]);
        let diffuse = whole(&black, &field(Centre::Normal, position), edge);
        close(diffuse[middle * edge + middle], [-1.0, 0.0, 0.0]);
        // Up in the picture is +Z, right is -Y; the background looks along +X.
        assert!(diffuse[30 * edge + middle][2] > 0.6 && diffuse[middle * edge + 170][1] < -0.6);
        let background = whole(&environment(position), &field(Centre::Normal, |_| [0.0; 3]), edge);
        let corner = DVec3::new(1.0, 0.5, 0.5).normalize();
        assert!((f64::from(background[0][1]) - corner.y).abs() < 5e-3, "{:?}", background[0]);
        assert!((f64::from(background[0][2]) - corner.z).abs() < 5e-3, "{:?}", background[0]);
    }

    #[test]
    fn at_the_outline_a_mirror_shows_its_background() {
        let ray = DVec3::new(1.0, 0.399, 0.0).normalize();
        let distance = (1.0_f64 + 1.0 / 0.16).sqrt();
        let normal = hit(ray, distance).unwrap();
        let (facing, view) = (Direction::normalised(normal), Direction::normalised(-ray));
        let reflected = Centre::Reflection.central(facing, Direction::Y, view).vector();
        // Grazing: the ray is turned by twice the angle to the tangent plane, about sqrt(2 * 0.0025 * ...)
        // here.
        assert!(reflected.dot(ray) > 0.97, "{}", reflected.dot(ray));
        assert!(hit(DVec3::new(1.0, 0.401, 0.0).normalize(), distance).is_none());
    }

    /// The ball of B_10 alone shows Y_10(w_o), the cosine between the view and R, 2 (N.V)^2 - 1.
    #[test]
    fn what_changes_with_the_view_is_seen_from_the_camera() {
        let grid = LatLong::with_rows(64);
        let values = (0..grid.len()).flat_map(|_| [[0.0; 3], [1.0_f32; 3]]).collect();
        let degree = Degree::new(1).unwrap();
        let centre = Centre::Reflection;
        let field =
            Shrm::new(MapGrid::LatLong(grid), View::Local, centre, degree, Terms::Zonal, values).unwrap();
        let edge = 201;
        let picture = whole(&environment(|_| [0.0; 3]), &field, edge);
        let y_10 = (0.75 / std::f64::consts::PI).sqrt();
        assert!((f64::from(picture[100 * edge + 100][0]) - y_10).abs() < 1e-3);
        for column in [60, 140, 170] {
            let at = 2.0 * (f64::from(column) + 0.5) / edge as f64 - 1.0;
            let ray = DVec3::new(1.0, -at * HALF_WIDTH, 0.0).normalize();
            let normal = hit(ray, (1.0_f64 + 1.0 / 0.16).sqrt()).unwrap();
            let expected = y_10 * (2.0 * normal.dot(ray).powi(2) - 1.0);
            let found = f64::from(picture[100 * edge + column as usize][0]);
            // 2 x 2 samples and bilinear texels: a pixel is 0.01 wide, and the curve is gentle here.
            assert!((found - expected).abs() < 5e-3, "{column}: {found}, not {expected}");
        }
    }
}
