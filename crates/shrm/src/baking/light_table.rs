//! What lamps add to the views of a grid, tabulated by the angle between lamp and central direction.
//!
//! All texels share the tables: about its central direction, an isotropic material depends on the lamp's
//! angle and on the azimuth between lamp and view alone. Between the nodes they are interpolated. A lamp, or
//! a group of lamps, is a disk, and rho_hat in the mean over it depends on its radius too: there is a table
//! for each of a few radii, between which the mean is interpolated in the square of the radius, in which it
//! is smooth.

use std::f64::consts::PI;

use brdf::{Centre, SurfaceView};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use sh::f64x4::SimdLevel;
use sh::{Light, POINT};
use sphere::{DVec3, Direction};

use super::lamp_groups::{LampGroup, groups};
use super::view_grid::{MIRRORED, ViewGrid};
use super::view_sums::{F32x8, LANES, load, store};
use crate::frame;
use crate::lamps::{Lamps, TAIL, WIDEST};
use crate::mean_lobe::{angles, place};

/// Nodes of the azimuth over half a turn, besides the first.
const AZIMUTHS: usize = 64;

/// A lamp that adds less than this share of black to every view is left out of a texel.
const UNSEEN: f32 = 1e-3;

/// The ratio of the squares of two adjacent radii, if [`MOST_RADII`] are enough for that.
const RATIO: f64 = 2.0;

/// The most radii that have a table.
const MOST_RADII: usize = 8;

/// The most points over which the mean of a disk is taken.
const MOST_POINTS: usize = 128;

/// rho_hat of the views in the mean over disks of some radii.
pub(super) struct LightTable {
    angles: Vec<f64>,
    /// The number of azimuths of an angle: 1 if the material does not depend on it.
    azimuths: usize,
    /// The number of vectors of an azimuth: channel by channel and, within one, row by row of views.
    vectors: usize,
    /// From the smallest radius on.
    disks: Vec<DiskTable>,
    /// The lamps.
    pub(super) groups: Vec<LampGroup>,
}

/// The table of one radius.
struct DiskTable {
    radius: f64,
    /// The values over [angle, azimuth, channel and row of views].
    values: Vec<F32x8>,
    /// The largest value of each angle.
    largest: Vec<f32>,
}

/// A lamp or a group of lamps, and the tables between which its own lies.
pub(super) struct PlacedLamp {
    direction: DVec3,
    flux: [f32; 3],
    /// The tables with their shares, which sum to 1; the second may have none.
    disks: [(usize, f32); 2],
    /// The cosine of the least angle at which this is enough, infinite if it always is.
    most_cosine: f64,
    /// The number of those after it of which it consists.
    descendants: usize,
}

impl LightTable {
    pub(super) fn new(lamps: &Lamps, views: &ViewGrid) -> Self {
        let angles = angles(2e-4, 0.08, 0.03);
        let azimuths = if views.orders() == 0 { 1 } else { AZIMUTHS + 1 };
        let vectors = (3 * views.rows.len()).div_ceil(LANES);
        let width = lamps.material.highlight_width();
        let groups = groups(&lamps.lights, &lamps.material);
        let radii = radii(groups.iter().map(|group| group.light.radius).filter(|r| *r > POINT * width));
        let mut table = Self { angles, azimuths, vectors, disks: Vec::new(), groups };
        table.disks.push(table.points(lamps, views));
        let centre = lamps.material.centre();
        let larger: Vec<DiskTable> = radii.iter().map(|radius| table.disk(*radius, width, centre)).collect();
        table.disks.extend(larger);
        table
    }

    /// Lamps in groups, each with its place among the tables.
    pub(super) fn placed(&self, groups: &[LampGroup]) -> Vec<PlacedLamp> {
        let area = |disk: usize| self.disks[disk].radius * self.disks[disk].radius;
        let last = self.disks.len() - 1;
        let place = |group: &LampGroup| {
            let light = group.light;
            let above = self.disks.partition_point(|disk| disk.radius < light.radius).min(last);
            let below = above.saturating_sub(1);
            let span = area(above) - area(below);
            let share = if span > 0.0 { (light.radius * light.radius - area(below)) / span } else { 1.0 };
            let share = share.clamp(0.0, 1.0) as f32;
            PlacedLamp {
                direction: light.direction.vector(),
                flux: light.flux().map(|flux| flux as f32),
                disks: [(below, 1.0 - share), (above, share)],
                most_cosine: match group.least_angle {
                    0.0 => f64::INFINITY,
                    angle => math::cos(angle),
                },
                descendants: group.descendants,
            }
        };
        groups.iter().map(place).collect()
    }

    /// The table of rho_hat itself.
    fn points(&self, lamps: &Lamps, views: &ViewGrid) -> DiskTable {
        let (centre, turns) = (lamps.material.centre(), lamps.material.turns());
        let of_azimuth = |azimuth: usize| {
            let phi = PI * azimuth as f64 / AZIMUTHS as f64;
            views.rows.iter().map(move |row| centre.toward(Direction::from_angles(row.0, phi)))
        };
        let seen: Vec<SurfaceView> = (0..self.azimuths).flat_map(of_azimuth).collect();
        let rows = views.rows.len();
        self.filled(0.0, |angle, slice| {
            let incident = Direction::from_angles(angle, 0.0);
            for (seen, vectors) in seen.chunks_exact(rows).zip(slice.chunks_exact_mut(self.vectors)) {
                for (row, value) in lamps.material.means_toward(turns, seen, incident).iter().enumerate() {
                    for channel in 0..3 {
                        let at = channel * rows + row;
                        vectors[at / LANES].0[at % LANES] = value[channel] as f32;
                    }
                }
            }
        })
    }

    /// The table of a disk, from that of points, for a highlight of this width.
    fn disk(&self, radius: f64, width: f64, centre: Centre) -> DiskTable {
        let level = SimdLevel::detect();
        self.filled(radius, |angle, slice| {
            let light = |width: f64| {
                Light { direction: Direction::from_angles(angle, 0.0), radius, irradiance: [1.0; 3] }
                    .points(width)
            };
            // Away from a highlight about R, rho_hat is smooth.
            let away = if centre == Centre::Reflection { TAIL * (angle - radius) } else { 0.0 };
            let mut width = away.clamp(width, WIDEST.max(width));
            let mut points = light(width);
            while points.len() > MOST_POINTS && width < WIDEST {
                width *= 1.25;
                points = light(width);
            }
            level.run(AddPoints { table: self, points: &points, slice });
        })
    }

    /// A table whose slice of each angle, [azimuth, channel and row of views], is filled from zeros.
    fn filled(&self, radius: f64, fill: impl Fn(f64, &mut [F32x8]) + Sync) -> DiskTable {
        let count = self.azimuths * self.vectors;
        let mut values = vec![F32x8::ZERO; self.angles.len() * count];
        let slices = values.par_chunks_exact_mut(count).zip(&self.angles).with_max_len(4);
        let fill = |(slice, angle): (&mut [F32x8], &f64)| {
            fill(*angle, slice);
            let larger =
                |most: [f32; LANES], value: &F32x8| std::array::from_fn(|lane| most[lane].max(value.0[lane]));
            slice.iter().fold([0.0; LANES], larger).into_iter().fold(0.0, f32::max)
        };
        let largest = slices.map(fill).collect();
        DiskTable { radius, values, largest }
    }

    /// The azimuth of the table that is the same as another.
    #[inline(always)]
    fn folded(&self, azimuth: i32) -> usize {
        let folded = azimuth.rem_euclid(2 * AZIMUTHS as i32) as usize;
        folded.min(2 * AZIMUTHS - folded).min(self.azimuths - 1)
    }

    /// The values of a disk at one node of the angle and at the next: azimuth after azimuth.
    #[inline(always)]
    fn of_angles(&self, disk: usize, angle: usize) -> [&[F32x8]; 2] {
        let count = self.azimuths * self.vectors;
        let values = &self.disks[disk].values[angle * count..][..2 * count];
        [&values[..count], &values[count..]]
    }

    /// The values at a node of the azimuth, of those at an angle.
    #[inline(always)]
    fn at_azimuth<'t>(&self, of_angle: &'t [F32x8], azimuth: usize) -> &'t [F32x8] {
        &of_angle[azimuth * self.vectors..][..self.vectors]
    }
}

/// The radii that have a table, between the smallest and the largest of these.
fn radii(radii: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
    let (least, most) = (radii.clone().fold(f64::INFINITY, f64::min), radii.fold(0.0, f64::max));
    if most == 0.0 {
        return Vec::new();
    }
    let ratio = (most / least) * (most / least);
    let steps = (math::ln(ratio) / math::ln(RATIO)).ceil().min(MOST_RADII as f64 - 1.0) as usize;
    let step =
        |k: usize| if k == steps { most } else { least * math::pow(ratio, 0.5 * k as f64 / steps as f64) };
    (0..=steps).map(step).collect()
}

/// The mean of the point table over points of a disk, at every azimuth of one angle.
struct AddPoints<'a> {
    table: &'a LightTable,
    /// The points about the central direction, with their shares.
    points: &'a [(Direction, f64)],
    slice: &'a mut [F32x8],
}

impl WithSimd for AddPoints<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { table, points, slice } = self;
        for (direction, share) in points {
            let (k, next) = place(&table.angles, direction.theta());
            let turn = -direction.phi() / PI * AZIMUTHS as f64;
            let (shift, part) = (turn.floor() as i32, turn - turn.floor());
            let weights =
                [(1.0 - next) * (1.0 - part), (1.0 - next) * part, next * (1.0 - part), next * part]
                    .map(|weight| simd.splat_f32s((share * weight) as f32));
            let [near, far] = table.of_angles(0, k);
            for (azimuth, sums) in (shift..).zip(slice.chunks_exact_mut(table.vectors)) {
                let [below, above] = [azimuth, azimuth + 1].map(|step| table.folded(step));
                let nodes = [(near, below), (near, above), (far, below), (far, above)];
                let [a, b, c, d] = nodes.map(|(of_angle, step)| table.at_azimuth(of_angle, step));
                let values = a.iter().zip(b).zip(c.iter().zip(d));
                for (sum, ((a, b), (c, d))) in sums.iter_mut().zip(values) {
                    let mut total = load(simd, sum);
                    for (value, weight) in [a, b, c, d].into_iter().zip(weights) {
                        total = simd.add_f32s(total, simd.mul_f32s(weight, load(simd, value)));
                    }
                    store(simd, total, sum);
                }
            }
        }
    }
}

/// The nodes of one disk beside an angle, and the shares of both angles.
struct Corners<'a> {
    angles: [&'a [F32x8]; 2],
    shares: [f32; 2],
}

/// The four nodes beside an angle and an azimuth, and their shares.
struct FourNodes<'a, S: Simd> {
    nodes: [&'a [F32x8]; 4],
    shares: [S::f32s; 4],
}

impl<'a> Corners<'a> {
    /// The nodes on both sides of an azimuth, at a part of the way from the first to the second.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, table: &LightTable, steps: [usize; 2], part: f32) -> FourNodes<'a, S> {
        let ([near, far], [below, above]) = (self.angles, steps);
        let nodes = [(near, below), (near, above), (far, below), (far, above)];
        let [near, far] = self.shares;
        let shares = [near * (1.0 - part), near * part, far * (1.0 - part), far * part];
        FourNodes {
            nodes: nodes.map(|(of_angle, step)| table.at_azimuth(of_angle, step)),
            shares: shares.map(|share| simd.splat_f32s(share)),
        }
    }
}

impl<S: Simd> FourNodes<'_, S> {
    /// One vector of what is between the nodes.
    #[inline(always)]
    fn value(&self, simd: S, index: usize) -> S::f32s {
        let [a, b, c, d] = self.nodes.map(|node| load(simd, &node[index]));
        let [first, second, third, fourth] = self.shares;
        let mut value = simd.mul_f32s(first, a);
        value = simd.mul_add_f32s(second, b, value);
        value = simd.mul_add_f32s(third, c, value);
        simd.mul_add_f32s(fourth, d, value)
    }
}

/// The light of the lamps at up to eight texels, a lane for each, to be added to every view.
pub(super) struct AddLights<'a> {
    pub(super) table: &'a LightTable,
    pub(super) lamps: &'a [PlacedLamp],
    /// The central direction of each texel.
    pub(super) centrals: &'a [Direction],
    /// The radiance e below which a value counts as black.
    pub(super) dark: f32,
    pub(super) views: &'a ViewGrid,
    pub(super) lit: [&'a mut [F32x8]; 3],
}

impl WithSimd for AddLights<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { table, lamps, centrals, dark, views, mut lit } = self;
        let (rows, azimuths) = (views.rows.len(), views.quarter.len() * MIRRORED);
        let into_local: Vec<_> =
            centrals.iter().map(|central| frame(*central).matrix().transpose()).collect();
        let per_texel = azimuths * table.vectors;
        let mut sums = vec![F32x8::ZERO; centrals.len() * per_texel];
        let mut fluxes = vec![F32x8::ZERO; table.vectors];
        let of_views = (0..views.quarter.len()).flat_map(|j| views.azimuths(j)).collect::<Vec<_>>();
        // The node before each azimuth, and the part of the way to the next one.
        let mut places = vec![(0_i32, 0.0_f32); of_views.len()];
        // The first group whose lamps a texel does not have yet.
        let mut next_group = vec![0; centrals.len()];
        // Neighbouring texels read the same part of the tables for one lamp.
        for (group, lamp) in lamps.iter().enumerate() {
            if next_group.iter().all(|next| *next > group) {
                continue;
            }
            let strongest = lamp.flux.iter().fold(0.0, |most: f32, flux| most.max(*flux));
            for (channel, flux) in lamp.flux.into_iter().enumerate() {
                (channel * rows..(channel + 1) * rows).for_each(|at| fluxes[at / LANES].0[at % LANES] = flux);
            }
            let texels = into_local.iter().zip(&mut next_group).zip(sums.chunks_exact_mut(per_texel));
            for ((into_local, next_group), sums) in texels {
                let direction = *into_local * lamp.direction;
                if *next_group > group || direction.z > lamp.most_cosine {
                    continue;
                }
                *next_group = group + 1 + lamp.descendants;
                let direction = Direction::normalised(direction);
                let (k, next) = place(&table.angles, direction.theta());
                let (next, turn) = (next as f32, direction.phi());
                let largest =
                    |disk: usize| table.disks[disk].largest[k].max(table.disks[disk].largest[k + 1]);
                if strongest * lamp.disks.map(|(disk, _)| largest(disk)).into_iter().fold(0.0, f32::max)
                    < UNSEEN * dark
                {
                    continue;
                }
                for (place, azimuth) in places.iter_mut().zip(&of_views) {
                    let step = (azimuth - turn) / PI * AZIMUTHS as f64;
                    let below = step.floor();
                    *place = (below as i32, (step - below) as f32);
                }
                // Both disks at once: the sum of an azimuth is read and written once.
                let of_disk = |(disk, share): (usize, f32)| Corners {
                    angles: table.of_angles(disk, k),
                    shares: [share * (1.0 - next), share * next],
                };
                let [smaller, larger] = lamp.disks;
                let both = [smaller, larger].map(of_disk);
                let used = match (smaller.1 > 0.0, larger.1 > 0.0) {
                    (true, true) => &both[..],
                    (true, false) => &both[..1],
                    _ => &both[1..],
                };
                for ((below, part), sums) in places.iter().zip(sums.chunks_exact_mut(table.vectors)) {
                    let steps = [*below, below + 1].map(|step| table.folded(step));
                    match used {
                        [a, b] => {
                            let (a, b) = (a.at(simd, table, steps, *part), b.at(simd, table, steps, *part));
                            for (index, (sum, flux)) in sums.iter_mut().zip(&fluxes).enumerate() {
                                let flux = load(simd, flux);
                                let total = simd.mul_add_f32s(a.value(simd, index), flux, load(simd, sum));
                                store(simd, simd.mul_add_f32s(b.value(simd, index), flux, total), sum);
                            }
                        }
                        disks => {
                            for disk in disks {
                                let disk = disk.at(simd, table, steps, *part);
                                for (index, (sum, flux)) in sums.iter_mut().zip(&fluxes).enumerate() {
                                    let value = disk.value(simd, index);
                                    store(
                                        simd,
                                        simd.mul_add_f32s(value, load(simd, flux), load(simd, sum)),
                                        sum,
                                    );
                                }
                            }
                        }
                    }
                }
            }
        }
        for (lane, sums) in sums.chunks_exact(per_texel).enumerate() {
            for (azimuth, sums) in sums.chunks_exact(table.vectors).enumerate() {
                for (channel, lit) in lit.iter_mut().enumerate() {
                    for row in 0..rows {
                        let at = channel * rows + row;
                        lit[row * azimuths + azimuth].0[lane] = sums[at / LANES].0[at % LANES];
                    }
                }
            }
        }
    }
}
