//! The figures of the talk of Jarosz, Carr and Jensen (Eurographics 2009; JCJ09), drawn and measured with the
//! crate `sampling`. The program `sampling-figures` writes them; `docs/sampling.md` shows them.
//!
//! | module | figure |
//! | --- | --- |
//! | [`spheres`] | random and stratified points on spheres |
//! | [`products`] | points that follow light, a lobe and their product |
//! | [`equal_size`] | a lobe in as many harmonics as wavelets, and what of it no point reaches |
//! | [`renders`] | a ball by both, at equal memory and at equal quality |
//! | [`speeds`] | points a second against coefficients |

pub mod equal_size;
pub mod phong;
pub mod picture;
pub mod products;
pub mod renders;
pub mod speeds;
pub mod spheres;

use sampling::Points;
use sphere::DVec3;

/// The two sets of points that figures compare: independent ones and Owen's scrambling of the Sobol (0,
/// 2)-sequence.
pub const POINTS: [Points<'static>; 2] = [Points::Random { seed: 1 }, Points::Sobol { seed: Some(1) }];

/// The first `count` points of a set.
pub fn first(points: Points<'_>, count: usize) -> Vec<[f32; 2]> {
    let mut first = vec![[0.0; 2]; count];
    points.fill(0, &mut first);
    first
}

/// The vector of a direction in single precision.
pub fn vector(direction: [f32; 3]) -> DVec3 {
    DVec3::from_array(direction.map(f64::from))
}
