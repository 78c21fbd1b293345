//! View maps as sphere maps: what a mirror ball shows to the view (Cabral, Olano and Nemec 1999).
//!
//! The ball is seen from the view V: the centre of its image is the central direction V itself, its whole rim
//! the one direction -V ([`sphere::MirrorBall`] has the mapping), about which it holds little: its last texel
//! is sqrt(16 / N) radians wide on a ball of N texels. Up is toward +Z, that is against theta of V, and right
//! is along phi of V; a view along +-Z takes phi = 0.
//!
//! The map of one view is a function of the central direction of degree F + P: B_pq(C) has degree F and spin
//! q, the rotation into the world has degree p, and in their sum the spins cancel. So it is expanded exactly
//! from the rows of a lat-long grid, rotated into the frame of the ball and evaluated at each texel.

use std::f64::consts::FRAC_PI_2;

use envmap::Texels;
use rayon::prelude::*;
use sh::{Basis, Degree, Expansion, Stop, Stopped, Transform, TransformError, rotate};
use sphere::{DVec3, Direction, LatLong, MirrorBall, Rotation};

use crate::blocks::for_each;
use crate::{Lamps, MapGrid, Shrm};

/// Why there are no sphere maps.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SphereMapError {
    /// The map has so many rows that their degree is past [`Degree::MAX`].
    #[error(transparent)]
    Transform(#[from] TransformError),
    /// The maps were stopped, because the caller did not want them any more.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// The axes of the sphere map of a view, in the world's frame: right, up, and the view itself; right-handed.
pub fn sphere_map_axes(view: Direction) -> [Direction; 3] {
    let (theta, phi) = (view.theta(), view.phi());
    let right = DVec3::new(-math::sin(phi), math::cos(phi), 0.0);
    let up =
        DVec3::new(-math::cos(theta) * math::cos(phi), -math::cos(theta) * math::sin(phi), math::sin(theta));
    [Direction::normalised(right), Direction::normalised(up), view]
}

/// The rows of a lat-long map from which [`sphere_maps`] is exact for a reflection of degrees F and P.
pub fn sphere_map_rows(f: Degree, p: Degree) -> usize {
    2 * (f.get() + p.get()) + 2
}

/// Sphere maps of `edge` x `edge` texels for views in the world, shape [views, edge, edge].
///
/// From a lat-long map each is the map's field at the texel's central direction, to f32 rounding, if the map
/// was made on [`sphere_map_rows`] rows or more; work is O(F^2) per texel. Texels outside the disk repeat its
/// rim. From a cube texels are interpolated between those of the cube. `stop` is asked every few
/// milliseconds.
///
/// # Errors
/// [`SphereMapError`]
pub fn sphere_maps(
    map: &Shrm,
    views: &[Direction],
    edge: usize,
    stop: Stop<'_>,
) -> Result<Vec<[f32; 3]>, SphereMapError> {
    let mut maps = vec![[0.0; 3]; views.len() * edge * edge];
    let ball = MirrorBall { edge };
    let MapGrid::LatLong(grid) = map.grid() else {
        let lines = maps.par_chunks_mut(edge).enumerate();
        lines.try_for_each(|(row, values)| {
            stop.check()?;
            let (view, row) = (views[row / edge], row % edge);
            let (turn, mut lookup) = (ball_to_world(view), map.lookup());
            for (column, value) in values.iter_mut().enumerate() {
                *value = lookup.radiance(turn.apply(look(ball, row * edge + column)), view);
            }
            Ok::<(), Stopped>(())
        })?;
        return Ok(maps);
    };
    let fields = views.iter().map(|&view| {
        stop.check()?;
        let field = expand(grid, &map.view_map(view))?;
        Ok(rotate(&field, ball_to_world(view).inverse()))
    });
    let fields: Vec<Expansion> = fields.collect::<Result<_, SphereMapError>>()?;
    let Some(degree) = fields.first().map(Expansion::degree) else { return Ok(maps) };
    let basis = Basis::new(degree);
    // One evaluation of the harmonics serves every view.
    let rows = (0..edge * edge).into_par_iter().map_init(
        || vec![0.0; degree.rows()],
        |y, texel| {
            stop.check()?;
            basis.evaluate_into(look(ball, texel), y);
            Ok(fields.iter().map(|field| sum(field, y)).collect())
        },
    );
    let rows: Vec<Vec<[f32; 3]>> = rows.collect::<Result<_, Stopped>>()?;
    for (texel, values) in rows.into_iter().enumerate() {
        for (view, value) in values.into_iter().enumerate() {
            maps[view * edge * edge + texel] = value;
        }
    }
    Ok(maps)
}

/// Adds lamps that the map did not hold to its sphere maps, exactly at each texel. `stop` is asked once for
/// each of the [`blocks`](crate::blocks) of each map.
///
/// # Errors
/// If it was stopped; then some texels lack the lamps.
///
/// # Panics
/// If there are fewer texels than maps of `edge` x `edge`.
pub fn add_to_sphere_maps(
    maps: &mut [[f32; 3]],
    lamps: &Lamps,
    views: &[Direction],
    edge: usize,
    stop: Stop<'_>,
) -> Result<(), Stopped> {
    let (ball, lamps) = (MirrorBall { edge }, lamps.for_views());
    maps.chunks_exact_mut(edge * edge).zip(views).try_for_each(|(map, &view)| {
        let turn = ball_to_world(view);
        for_each(map, stop, |texel, value| {
            *value = lamps.added(*value, turn.apply(look(ball, texel)), view);
        })
    })
}

/// The direction of a texel in the ball's frame; past the rim, the one direction behind the ball.
fn look(ball: MirrorBall, texel: usize) -> Direction {
    ball.direction(texel / ball.edge, texel % ball.edge).unwrap_or(Direction::normalised(-DVec3::X))
}

/// Sphere maps looked up on another grid: for each map its axes as [`sphere_map_axes`] gives them, and pixels
/// of shape [views, edge, edge]; the result has shape [views, texels]. Interpolated bilinearly.
///
/// # Panics
/// If there are fewer pixels than maps of `edge` x `edge`.
pub fn from_sphere_maps(
    edge: usize,
    axes: &[[Direction; 3]],
    pixels: &[[f32; 3]],
    grid: MapGrid,
) -> Vec<[f32; 3]> {
    let mut maps = vec![[0.0; 3]; axes.len() * grid.len()];
    let ball = MirrorBall { edge };
    maps.par_chunks_mut(grid.len()).enumerate().for_each(|(view, map)| {
        let ([right, up, toward], pixels) = (axes[view], &pixels[view * edge * edge..][..edge * edge]);
        for (texel, value) in map.iter_mut().enumerate() {
            let c = grid.direction(texel);
            let inside = DVec3::new(c.dot(toward), c.dot(right), c.dot(up));
            *value = ball.taps(Direction::normalised(inside)).blend(pixels).map(|value| value as f32);
        }
    });
    maps
}

/// Takes the frame of a mirror ball (+X toward the viewer, +Y right, +Z up) to the world.
fn ball_to_world(view: Direction) -> Rotation {
    // R_z(phi) R_y(theta - pi / 2) takes +X to the view and +Z against theta.
    Rotation::from_yaw_pitch_roll(view.phi(), view.theta() - FRAC_PI_2, 0.0)
}

/// Expands an image to the degree that a grid's rows hold exactly.
fn expand(grid: LatLong, pixels: &[[f32; 3]]) -> Result<Expansion, TransformError> {
    let degree = ((grid.height.max(1) - 1) / 2).min((grid.width.max(1) - 1) / 2).min(Degree::MAX.get());
    let degree = Degree::new(degree).unwrap_or(Degree::MAX);
    Ok(Transform::new(grid, degree)?.analyse(pixels))
}

fn sum(field: &Expansion, y: &[f64]) -> [f32; 3] {
    let mut sum = [0.0; 3];
    for (row, y) in field.coefficients().iter().zip(y) {
        for channel in 0..3 {
            sum[channel] += row[channel] * y;
        }
    }
    sum.map(|value| value as f32)
}
