//! Light at probes: transport times the sky, emission and lamps, and what a surface takes of it.

use glam::Vec3;
use rayon::prelude::*;
use sh::{Basis, Degree, Expansion};
use sphere::{DVec3, Direction};

use crate::bake_lamps::LampColumns;
use crate::options::cosine_factor;
use crate::places::ProbePlaces;
use crate::ringing::{least_window, window_factor};
use crate::transport::Transport;
use crate::volume::{Volume, neighbours};

/// Raised when the light between probes changes: every kind of stage that blends it adds this to its own
/// revision. It begins with 0, so that kinds which learned to take probes kept theirs.
pub const REVISION: u32 = 1;

/// The rows of light at a probe.
const ROWS: usize = 9;

/// What is added to the weight of every corner of a cell.
const LEAST_WEIGHT: f32 = 1e-3;

/// The weight of corners that see a point from which on they are believed: it is more than that of all
/// corners which count only because of [`LEAST_WEIGHT`].
const LEAST_SEEING: f32 = 0.02;

/// What shines.
#[derive(Clone, Copy, Debug)]
pub struct SceneLighting<'a> {
    /// The sky; what is above the degree of the transport is not read.
    pub sky: Option<&'a Expansion>,
    /// The radiance of each emissive material.
    pub emission: &'a [[f64; 3]],
    /// The lamps, with colour times intensity of each.
    pub lamps: &'a [(&'a LampColumns, [f64; 3])],
    /// Whether what lamps send straight to the probes is part of the light, and the same of emitters.
    pub with_direct: [bool; 2],
    /// Whether the least window is applied that makes irradiance 0 or more toward all normals.
    pub is_windowed: bool,
}

impl Default for SceneLighting<'_> {
    /// Darkness; lamps without their direct light, which engines add, and a window.
    fn default() -> Self {
        Self { sky: None, emission: &[], lamps: &[], with_direct: [false, true], is_windowed: true }
    }
}

/// The reason why probes were not lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LightError {
    /// The transport is to other places.
    #[error("the transport is to {transport} probes, and there are {places}")]
    Places {
        /// The probes of the transport.
        transport: usize,
        /// The probes.
        places: usize,
    },
    /// The emission is that of another scene.
    #[error("the transport is from {transport} emissive materials, and {given} are given")]
    Emission {
        /// The emissive materials of the transport.
        transport: usize,
        /// The radiances that are given.
        given: usize,
    },
    /// A lamp's columns are to other places, or of another degree.
    #[error("the light of lamp {0} is to other probes or of another degree")]
    Lamp(usize),
}

/// The light that arrives at probes.
#[derive(Clone, Debug, PartialEq)]
pub struct LitProbes {
    rows: Vec<[[f32; 3]; ROWS]>,
    windows: Vec<f32>,
}

impl LitProbes {
    /// Lights probes.
    ///
    /// The light of probes without their own is filled as the places say, before windows. Linear but for
    /// these. Uses all threads; the result does not depend on their number.
    ///
    /// # Errors
    /// If the transport, a lamp or the emission do not belong to the places.
    pub fn new(
        places: &ProbePlaces,
        transport: &Transport,
        lighting: &SceneLighting<'_>,
    ) -> Result<Self, LightError> {
        let (count, given) = (places.len(), lighting.emission.len());
        if transport.len() != count {
            return Err(LightError::Places { transport: transport.len(), places: count });
        }
        if transport.emitters() != given {
            return Err(LightError::Emission { transport: transport.emitters(), given });
        }
        let length = 3 * transport.degree().rows();
        for (lamp, (columns, _)) in lighting.lamps.iter().enumerate() {
            let wanted = count * length;
            if columns.direct.len() != wanted || columns.indirect.len() != wanted {
                return Err(LightError::Lamp(lamp));
            }
        }
        let [direct_lamps, direct_emission] = lighting.with_direct;
        let probe = |probe: usize| {
            let mut rows = vec![[0.0; 3]; transport.degree().rows()];
            if let Some(sky) = lighting.sky {
                transport.add_sky(probe, sky, &mut rows);
            }
            for (emitter, radiance) in lighting.emission.iter().enumerate() {
                transport.add_emission(probe, emitter, *radiance, direct_emission, &mut rows);
            }
            for (columns, color) in lighting.lamps {
                for column in [Some(&columns.indirect), direct_lamps.then_some(&columns.direct)] {
                    let Some(column) = column else { continue };
                    let column = &column[probe * length..][..length];
                    for (row, column) in rows.iter_mut().zip(column.as_chunks::<3>().0) {
                        (0..3)
                            .for_each(|channel| row[channel] += color[channel] * f64::from(column[channel]));
                    }
                }
            }
            let row = |row: usize| rows[row].map(|value| value as f32);
            std::array::from_fn::<_, ROWS, _>(row)
        };
        let mut rows: Vec<[[f32; 3]; ROWS]> =
            (0..count).into_par_iter().with_min_len(64).map(probe).collect();
        places.dilate(rows.as_flattened_mut().as_flattened_mut(), 3 * ROWS);
        let windows = rows.par_iter_mut().with_min_len(64).map(|rows| {
            let lambda = if lighting.is_windowed { least_window(rows) } else { 0.0 };
            if lambda > 0.0 {
                for (k, row) in rows.iter_mut().enumerate() {
                    let factor = window_factor(lambda, usize::from(k > 0) + usize::from(k > 3)) as f32;
                    *row = row.map(|value| factor * value);
                }
            }
            lambda as f32
        });
        let windows = windows.collect();
        Ok(Self { rows, windows })
    }

    /// Light that was stored: [`LitProbes::rows`] and [`LitProbes::windows`]. `None` if there are not as many
    /// of both, or a number is not finite; a window may be infinite.
    pub fn from_parts(rows: Vec<[[f32; 3]; ROWS]>, windows: Vec<f32>) -> Option<Self> {
        let are_finite = rows.as_flattened().as_flattened().iter().all(|value| value.is_finite());
        let are_windows = windows.iter().all(|lambda| *lambda >= 0.0);
        (rows.len() == windows.len() && are_finite && are_windows).then_some(Self { rows, windows })
    }

    /// The harmonics of the radiance that arrives at each probe: [probe, row l l + l + m, RGB].
    pub fn rows(&self) -> &[[[f32; 3]; ROWS]] {
        &self.rows
    }

    /// The factor lambda of each probe's window; 0 for none.
    pub fn windows(&self) -> &[f32] {
        &self.windows
    }

    /// The irradiance of a surface at a point with a normal, of the volumes that the point is in; the first
    /// one if it is in none. `None` if there are no volumes.
    ///
    /// The eight probes around the point are blended by their places. A probe is left out if it does not see
    /// the point as far as its rays know, if it is behind the surface, or if the probe that counts most does
    /// not see it. `None`, too, if the places are those of other probes.
    pub fn irradiance(&self, places: &ProbePlaces, point: [f32; 3], normal: [f32; 3]) -> Option<[f64; 3]> {
        if places.len() != self.rows.len() {
            return None;
        }
        let (at, normal) = (Vec3::from(point), Vec3::from(normal));
        let weights = corner_weights(places, at, normal)?;
        Some(self.blend(&weights, normal))
    }

    /// The light that arrives at a point of a surface with a normal, blended as in
    /// [`LitProbes::irradiance`]: row l l + l + m, RGB.
    pub fn light_at(
        &self,
        places: &ProbePlaces,
        point: [f32; 3],
        normal: [f32; 3],
    ) -> Option<[[f32; 3]; ROWS]> {
        if places.len() != self.rows.len() {
            return None;
        }
        let weights = corner_weights(places, Vec3::from(point), Vec3::from(normal))?;
        let mut sum = [[0.0; 3]; ROWS];
        for (probe, weight) in weights {
            for (sum, row) in sum.iter_mut().zip(&self.rows[probe as usize]) {
                (0..3).for_each(|channel| sum[channel] += weight * row[channel]);
            }
        }
        Some(sum)
    }

    /// The irradiance of some probes, each with a weight.
    fn blend(&self, weights: &[(u32, f32)], normal: Vec3) -> [f64; 3] {
        let degree = Degree::new(2).unwrap_or(Degree::ZERO);
        let mut harmonics = [0.0; ROWS];
        let toward = DVec3::new(normal.x.into(), normal.y.into(), normal.z.into());
        Basis::new(degree).evaluate_into(Direction::normalised(toward), &mut harmonics);
        let mut sum = [0.0; 3];
        for (probe, weight) in weights {
            for (k, (row, y)) in self.rows[*probe as usize].iter().zip(harmonics).enumerate() {
                let factor = f64::from(*weight) * y * cosine_factor(usize::from(k > 0) + usize::from(k > 3));
                (0..3).for_each(|channel| sum[channel] += factor * f64::from(row[channel]));
            }
        }
        sum
    }
}

/// The probes that light a point with a normal, with weights that sum to 1.
pub(crate) fn corner_weights(places: &ProbePlaces, at: Vec3, normal: Vec3) -> Option<Vec<(u32, f32)>> {
    let mut first = 0;
    let mut ranges: Vec<(&Volume, usize)> = Vec::new();
    for volume in places.volumes() {
        ranges.push((volume, first));
        first += volume.len();
    }
    let (volume, first) = *ranges.iter().find(|(volume, _)| volume.contains(at)).or(ranges.first())?;
    let place = |probe: usize| Vec3::from(places.positions()[probe]);
    // A probe in the plane of the surface, or behind it, may be behind a wall.
    let is_before = |probe: usize| places.is_valid(probe) && (place(probe) - at).dot(normal) > 0.0;
    let corner = |(index, step, weight): (usize, [i32; 3], f32)| {
        let probe = first + index;
        let reach = if is_before(probe) { places.reach_toward(volume, probe, at) } else { 0.0 };
        // A corner of no weight counts if all others are hidden.
        Corner { probe, step, weight: weight + LEAST_WEIGHT, reach }
    };
    let mut corners: Vec<Corner> = volume.corners(at).map(corner).collect();
    let seeing: f32 = corners.iter().filter(|corner| corner.reach >= 1.0).map(|corner| corner.weight).sum();
    if seeing >= LEAST_SEEING {
        corners.retain(|corner| corner.reach >= 1.0);
        let leader = corners.iter().copied().max_by(|a, b| a.weight.total_cmp(&b.weight))?;
        corners.retain(|corner| leader.sees(places, corner));
    } else if corners.iter().any(|corner| corner.reach > 0.0) {
        // In a corner of a room, rays beside the point's direction end sooner. Probes of one side count
        // together, and the more, the nearer their rays come to the point.
        let most = corners.iter().map(|corner| corner.reach.min(1.0)).fold(0.0, f32::max);
        for corner in &mut corners {
            let share = corner.reach.min(1.0) / most;
            let square = share * share;
            corner.weight *= square * square * square * square;
        }
        let seen = |leader: &Corner| -> f32 {
            corners.iter().filter(|corner| leader.sees(places, corner)).map(|corner| corner.weight).sum()
        };
        let leader = corners.iter().copied().max_by(|a, b| seen(a).total_cmp(&seen(b)))?;
        corners.retain(|corner| leader.sees(places, corner));
    }
    // Otherwise nothing is known of the point's side: all corners count.
    let sum: f32 = corners.iter().map(|corner| corner.weight).sum();
    Some(corners.into_iter().map(|corner| (corner.probe as u32, corner.weight / sum)).collect())
}

/// A probe at a corner of the cell that a point is in.
#[derive(Clone, Copy, Debug)]
struct Corner {
    probe: usize,
    /// Its step from the first corner.
    step: [i32; 3],
    /// Its weight in the blend.
    weight: f32,
    /// How far it sees toward the point, in distances to it; 0 for one that is invalid or behind the surface.
    reach: f32,
}

impl Corner {
    /// Whether it sees another corner, which may light the same point.
    fn sees(&self, places: &ProbePlaces, other: &Self) -> bool {
        let way = [0, 1, 2].map(|axis| other.step[axis] - self.step[axis]);
        let bit = neighbours().position(|step| step == way);
        let bits = places.visible().get(self.probe).copied().unwrap_or(0);
        self.probe == other.probe || other.reach > 0.0 && bit.is_some_and(|bit| bits >> bit & 1 == 1)
    }
}
