//! The lights beside a series, shaded by the material itself, with shadow rays [KSS02, sec. 7].
//!
//! A series of low degree blurs a lamp and its shadow. So light is taken apart: the soft rest by the table,
//! each lamp by rho_hat, the BRDF times the cosine,
//!
//! > B(v) = sum over the lights of the integral over the disk of L V(s) rho_hat(R_p s, R_p v) ds,
//!
//! with the sum of n directions over the disk, each with an equal share of its solid angle, in place of the
//! integral, and a shadow ray in each. As with transfer, V = 1 below the vertex' own horizon: rho_hat is zero
//! there, except for phong and kajiya-kay.

use brdf::{BelowHorizon, Material};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::SimdLevel;
use sh::{Light, Stop, Stopped};
use sphere::{DMat3, DVec3, Direction};

use crate::frames::{Block, Frames, LANES, Viewer};
use crate::occluders::Occluders;
use crate::packet::{Packet, Towards, above};

/// Raised when the results of this kernel change: every kind of stage that calls it adds this to its own
/// revision.
pub const REVISION: u32 = 1;

/// A direction toward a light, and the flux of its share of the disk.
struct Sample {
    direction: Direction,
    towards: Towards,
    flux: [f64; 3],
}

/// The radiance of each vertex, RGB, under disks of light alone, each taken at `count` directions.
///
/// With `occluders` a ray in each direction says whether the mesh is in the way. A view from below the
/// horizon is taken where the material's table has it ([`BelowHorizon`]). Uses all threads; the result does
/// not depend on their number. `stop` is asked for every eight vertices, on every thread.
///
/// # Errors
/// If it was stopped.
///
/// # Example: a small lamp at the zenith gives a matte floor its irradiance
/// ```
/// use sphere::Direction;
/// let chalk = brdf::Material::Lambert(brdf::Lambert::new([0.5; 3])?);
/// let lamp = sh::Light { direction: Direction::Z, radius: 0.01, irradiance: [std::f64::consts::PI; 3] };
/// let plane = transfer::Frames::of(&mesh::shape("plane").unwrap())?;
/// let viewer = transfer::Viewer::Distant(Direction::X);
/// let seen = transfer::shade_lights(&plane, None, &chalk, viewer, &[lamp], 16, sh::Stop::NEVER)?;
/// assert!(seen.iter().flatten().all(|value| (value - 0.5).abs() < 1e-4));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn shade_lights(
    frames: &Frames,
    occluders: Option<&Occluders>,
    material: &Material,
    viewer: Viewer,
    lights: &[Light],
    count: usize,
    stop: Stop<'_>,
) -> Result<Vec<[f32; 3]>, Stopped> {
    let of_light = |light: &Light| {
        let flux = light.flux().map(|flux| flux / count as f64);
        let sample = move |direction| Sample { direction, towards: Towards::new(direction), flux };
        light.directions(count).map(sample).collect::<Vec<_>>()
    };
    let samples: Vec<Sample> = lights.iter().flat_map(of_light).collect();
    let (samples, below) = (samples.as_slice(), BelowHorizon::of(material));
    let mut radiance = vec![[0.0; 3]; frames.len()];
    let blocks = radiance.par_chunks_mut(LANES).zip(frames.blocks()).enumerate();
    let done = blocks.map(|(index, (radiance, block))| {
        stop.check()?;
        let first = index * LANES;
        let lit = Lit { frames, occluders, material, below, viewer, samples, block, first, radiance };
        SimdLevel::detect().run(lit);
        Ok(())
    });
    done.collect::<Result<(), Stopped>>()?;
    Ok(radiance)
}

/// Eight vertices under the samples.
struct Lit<'a> {
    frames: &'a Frames,
    occluders: Option<&'a Occluders>,
    material: &'a Material,
    below: BelowHorizon,
    viewer: Viewer,
    samples: &'a [Sample],
    block: &'a Block,
    /// The first vertex.
    first: usize,
    radiance: &'a mut [[f32; 3]],
}

impl WithSimd for Lit<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { frames, occluders, first, .. } = self;
        let count = self.radiance.len();
        let views = self.block.views(self.viewer);
        let of_vertex = |lane: usize| {
            let axes = frames.axes(first + lane).map(|axis| DVec3::from_array(axis.map(f64::from)));
            let view = Direction::normalised(DVec3::from_array(views.map(|axis| f64::from(axis[lane]))));
            (DMat3::from_cols_array_2d(&axes.map(|axis| axis.to_array())).transpose(), self.below.view(view))
        };
        let vertices: Vec<(DMat3, Direction)> = (0..count).map(of_vertex).collect();
        let mut packet = occluders.map(|occluders| Packet::new(occluders, frames, first, count));
        let (mut sums, mut open) = ([[0.0; 3]; LANES], Vec::new());
        for sample in self.samples {
            if let (Some(packet), Some(occluders)) = (&mut packet, occluders) {
                let above = above(frames, first, count, &sample.towards);
                if packet.aim(f32::INFINITY, |lane| above[lane]) {
                    packet.trace::<S, true>(simd, occluders, &sample.towards, &mut open);
                }
            }
            for (lane, (into_surface, view)) in vertices.iter().enumerate() {
                if packet.as_ref().is_some_and(|packet| packet.is_blocked(lane)) {
                    continue;
                }
                let incident = Direction::normalised(*into_surface * sample.direction.vector());
                let rho_hat = self.material.rho_hat(incident, *view);
                (0..3).for_each(|channel| sums[lane][channel] += sample.flux[channel] * rho_hat[channel]);
            }
        }
        for (radiance, sum) in self.radiance.iter_mut().zip(sums) {
            *radiance = sum.map(|value| value as f32);
        }
    }
}
