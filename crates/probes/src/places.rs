//! Where probes stand: in the grids of volumes or at given points, repaired where that is inside of
//! something.
//!
//! A probe inside of a solid is moved out through the nearest back that it sees; what cannot be moved far
//! enough is filled with the light of neighbours on one side of the wall, or at last with that of the nearest
//! probe. Albedo and light have no part in this.

use glam::Vec3;
use rayon::prelude::*;
use sh::{Stop, Stopped};

use crate::surfaces::Surfaces;
use crate::validity::{LEAST_DISTANCE, LOOKS, View, Viewer, look_directions};
use crate::volume::{Volume, neighbours};

/// The most that a probe is moved out of a solid, in spacings.
const MOST_MOVE: f32 = 0.75;

/// The backs that are tried on the way out.
const WAYS_OUT: usize = 12;

/// How far neighbours are that fill a probe, in probes.
const RINGS: i32 = 3;

/// What became of a probe.
#[derive(Clone, Debug, PartialEq)]
pub enum Repair {
    /// It stands where the grid has it.
    None,
    /// It was moved to see what it should.
    Moved,
    /// It has the light of these probes, with these weights, which sum to 1.
    Filled(Vec<(u32, f32)>),
    /// No probe near it can reach it: it has the light of this one.
    Lost(u32),
}

/// The places of probes.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbePlaces {
    pub(crate) volumes: Vec<Volume>,
    pub(crate) scattered: usize,
    pub(crate) grid: Vec<[f32; 3]>,
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) back_share: Vec<f32>,
    pub(crate) inside_of: Vec<Option<u32>>,
    pub(crate) repairs: Vec<Repair>,
    pub(crate) visible: Vec<u32>,
    /// How far each probe of a volume sees in each direction, as shares of the diagonal of a cell, rounded
    /// up: [probe, direction].
    pub(crate) reach: Vec<u8>,
}

/// The reason why there are no places.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlacesError {
    /// There is neither a volume nor a point.
    #[error("there are no volumes and no points; expected a box, such as the bounds of the scene")]
    Nothing,
    /// A point is nowhere.
    #[error("point {0} is not finite")]
    NotFinite(usize),
    /// No probe of a volume is outside of solids.
    #[error(
        "no probe of the box {volume} is outside of a solid: {part} shows its back to {share} percent of their \
         rays; if it is a room seen from inside, the winding of its triangles is turned"
    )]
    AllInside {
        /// The name of the volume.
        volume: String,
        /// The node whose backs are seen most.
        part: String,
        /// The share of rays that meet backs, in percent.
        share: u32,
    },
    /// Its caller stopped it.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl ProbePlaces {
    /// The probes of volumes, volume by volume, and then those at points, in metres.
    ///
    /// Each looks around in 256 directions; a share of [`crate::MOST_BACKS`] of backs of solids makes it
    /// invalid. It is moved by at most 0.75 of a spacing, filled from at most 3 probes away, and never from
    /// both sides of a wall. Probes nearer to a surface than [`crate::LEAST_DISTANCE`] are moved off it. Uses
    /// all threads; the result does not depend on their number. `stop` is asked before each probe.
    ///
    /// # Errors
    /// If there is neither a volume nor a point, a point is not finite, all probes of a volume are inside of
    /// something, or it was stopped.
    pub fn new(
        surfaces: &Surfaces<'_>,
        volumes: Vec<Volume>,
        points: &[[f32; 3]],
        stop: Stop<'_>,
    ) -> Result<Self, PlacesError> {
        if volumes.is_empty() && points.is_empty() {
            return Err(PlacesError::Nothing);
        }
        if let Some(at) = points.iter().position(|point| !point.iter().all(|x| x.is_finite())) {
            return Err(PlacesError::NotFinite(at));
        }
        let viewer = Viewer::new(surfaces);
        let of_volume = |(at, volume): (usize, &Volume)| {
            let position = |index| volume.position(volume.cell(index));
            (0..volume.len()).map(|index| (position(index), Some(at))).collect::<Vec<_>>()
        };
        let mut grid: Vec<([f32; 3], Option<usize>)> =
            volumes.iter().enumerate().flat_map(of_volume).collect();
        grid.extend(points.iter().map(|point| (*point, None)));
        let looked: Vec<(View, Option<Vec3>)> = grid
            .par_iter()
            .map(|(position, volume)| {
                stop.check()?;
                Ok(viewer.settle(Vec3::from(*position), volume.map(|at| &volumes[at])))
            })
            .collect::<Result<_, Stopped>>()?;
        let mut first = 0;
        for volume in &volumes {
            let own = &looked[first..first + volume.len()];
            if own.iter().all(|(_, place)| place.is_none()) {
                return Err(all_inside(surfaces, volume, own));
            }
            first += volume.len();
        }
        let place = |((position, _), (_, place)): (&([f32; 3], _), &(View, Option<Vec3>))| {
            place.map_or(*position, |place| place.to_array())
        };
        let positions: Vec<[f32; 3]> = grid.iter().zip(&looked).map(place).collect();
        let repair = |probe: usize| match looked[probe].1 {
            Some(_) if positions[probe] == grid[probe].0 => Repair::None,
            Some(_) => Repair::Moved,
            None => Repair::Lost(0),
        };
        let repairs = (0..grid.len()).map(repair).collect();
        let inside_of = |(view, _): &(View, Option<Vec3>)| {
            view.is_inside().then(|| view.backs.first().map(|(.., triangle)| *triangle)).flatten()
        };
        let reach = reach(&volumes, &looked);
        let mut places = Self {
            volumes,
            scattered: points.len(),
            grid: grid.into_iter().map(|(position, _)| position).collect(),
            positions,
            back_share: looked.iter().map(|(view, _)| view.back_share).collect(),
            inside_of: looked.iter().map(inside_of).collect(),
            repairs,
            visible: Vec::new(),
            reach,
        };
        places.fill(&viewer, stop)?;
        places.visible = places.see(&viewer, stop)?;
        Ok(places)
    }

    /// The number of probes.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are no probes, which never happens.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The volumes.
    pub fn volumes(&self) -> &[Volume] {
        &self.volumes
    }

    /// The number of probes at points, which follow those of the volumes.
    pub fn scattered(&self) -> usize {
        self.scattered
    }

    /// Where the grids have the probes, in metres.
    pub fn grid(&self) -> &[[f32; 3]] {
        &self.grid
    }

    /// Where light is computed, in metres.
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// The share of 256 directions in which each probe, where the grid has it, sees the back of a surface of
    /// one side.
    pub fn back_share(&self) -> &[f32] {
        &self.back_share
    }

    /// A triangle of the solid that a probe is inside of, where the grid has it.
    pub fn inside_of(&self, probe: usize) -> Option<u32> {
        self.inside_of.get(probe).copied().flatten()
    }

    /// What became of each probe.
    pub fn repairs(&self) -> &[Repair] {
        &self.repairs
    }

    /// Whether a probe has light of its own.
    pub fn is_valid(&self, probe: usize) -> bool {
        matches!(self.repairs.get(probe), Some(Repair::None | Repair::Moved))
    }

    /// For each probe a bit for each of [`neighbours`] that sees it and is valid, as it is itself.
    pub fn visible(&self) -> &[u32] {
        &self.visible
    }

    /// How far the probes of volumes see in each of 256 directions, as shares of the diagonal of a cell,
    /// rounded up, 254 for all of it and 255 for more: [probe, direction].
    pub fn reach(&self) -> &[u8] {
        &self.reach
    }

    /// How far a probe of a volume sees toward a point in a cell beside it, in distances to the point: the
    /// longest of the four rays that are nearest to the point's direction counts, so that a point is not
    /// hidden by its own surface.
    pub(crate) fn reach_toward(&self, volume: &Volume, probe: usize, point: Vec3) -> f32 {
        let way = point - Vec3::from(self.positions[probe]);
        let distance = way.length();
        let Some(reach) = self.reach.get(probe * LOOKS..(probe + 1) * LOOKS) else { return f32::INFINITY };
        let mut nearest = [(f32::NEG_INFINITY, 0_u8); 4];
        for (direction, reach) in look_directions().iter().zip(reach) {
            let cosine = direction.dot(way);
            if cosine > nearest[3].0 {
                nearest[3] = (cosine, *reach);
                nearest.sort_by(|a, b| b.0.total_cmp(&a.0));
            }
        }
        let longest = nearest.iter().map(|(_, reach)| *reach).max().unwrap_or(0);
        if longest == u8::MAX || distance == 0.0 {
            return f32::INFINITY;
        }
        f32::from(longest) / 254.0 * diagonal(volume) / distance
    }

    /// Replaces the light of probes that have none of their own; `light` has `length` numbers a probe.
    pub fn dilate(&self, light: &mut [f32], length: usize) {
        let before = light.to_vec();
        let of = |probe: u32| before.get(probe as usize * length..).and_then(|rest| rest.get(..length));
        for (own, repair) in light.chunks_exact_mut(length).zip(&self.repairs) {
            match repair {
                Repair::None | Repair::Moved => {}
                Repair::Filled(sources) => {
                    own.fill(0.0);
                    for (source, weight) in sources {
                        let light = of(*source).unwrap_or_default();
                        own.iter_mut().zip(light).for_each(|(sum, light)| *sum += weight * light);
                    }
                }
                Repair::Lost(source) => own.copy_from_slice(of(*source).unwrap_or(&vec![0.0; length])),
            }
        }
    }

    /// The volume of each probe and the index of its first one.
    fn ranges(&self) -> impl Iterator<Item = (&Volume, usize)> {
        self.volumes.iter().scan(0, |first, volume| {
            let own = *first;
            *first += volume.len();
            Some((volume, own))
        })
    }

    /// Finds the probes from which invalid ones take their light.
    fn fill(&mut self, viewer: &Viewer<'_>, stop: Stop<'_>) -> Result<(), Stopped> {
        let valid: Vec<bool> = (0..self.len()).map(|probe| self.is_valid(probe)).collect();
        let mut filled = Vec::new();
        for (volume, first) in self.ranges() {
            let lost: Vec<usize> = (0..volume.len()).filter(|index| !valid[first + index]).collect();
            let found = lost.par_iter().map(|&index| {
                stop.check()?;
                Ok((first + index, self.sources(viewer, volume, first, index, &valid)))
            });
            filled.extend(found.collect::<Result<Vec<_>, Stopped>>()?);
        }
        let of_volumes = self.len() - self.scattered;
        let points: Vec<usize> = (of_volumes..self.len()).filter(|probe| !valid[*probe]).collect();
        filled.extend(
            points.iter().map(|&probe| (probe, Repair::Lost(self.nearest(probe, 0..self.len(), &valid)))),
        );
        filled.into_iter().for_each(|(probe, repair)| self.repairs[probe] = repair);
        Ok(())
    }

    /// The valid probe of some that is nearest to another one.
    fn nearest(&self, probe: usize, among: std::ops::Range<usize>, valid: &[bool]) -> u32 {
        let at = Vec3::from(self.grid[probe]);
        let distance = |other: &usize| Vec3::from(self.grid[*other]).distance_squared(at);
        let found = among.filter(|other| valid[*other]).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        found.unwrap_or(probe) as u32
    }

    /// The neighbours that an invalid probe of a volume takes its light from: those that reach it through one
    /// front at most, on the side of the nearest of them.
    fn sources(
        &self,
        viewer: &Viewer<'_>,
        volume: &Volume,
        first: usize,
        index: usize,
        valid: &[bool],
    ) -> Repair {
        let (cell, at) = (volume.cell(index), Vec3::from(self.grid[first + index]));
        for ring in 1..=RINGS {
            let side = -ring..=ring;
            let mut found = Vec::new();
            for (z, y, x) in side.clone().flat_map(|z| {
                let side = -ring..=ring;
                side.clone().flat_map(move |y| (-ring..=ring).map(move |x| (z, y, x)))
            }) {
                if x.abs().max(y.abs()).max(z.abs()) != ring {
                    continue;
                }
                let Some(other) = volume.neighbour(cell, [x, y, z]).map(|other| first + other) else {
                    continue;
                };
                let from = Vec3::from(self.positions[other]);
                let [fronts, backs] = viewer.crossings(from, at);
                if valid[other] && fronts <= 1 && backs == 0 {
                    found.push((from.distance(at), other));
                }
            }
            found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let Some(&(_, leader)) = found.first() else { continue };
            let place = |probe: usize| Vec3::from(self.positions[probe]);
            found.retain(|(_, other)| *other == leader || viewer.sees(place(leader), place(*other)));
            let sum: f32 = found.iter().map(|(distance, _)| 1.0 / distance).sum();
            return Repair::Filled(
                found.into_iter().map(|(distance, other)| (other as u32, 1.0 / distance / sum)).collect(),
            );
        }
        Repair::Lost(self.nearest(first + index, first..first + volume.len(), valid))
    }

    /// The neighbours that each probe sees.
    fn see(&self, viewer: &Viewer<'_>, stop: Stop<'_>) -> Result<Vec<u32>, Stopped> {
        let mut visible = vec![0; self.len()];
        let place = |probe: usize| Vec3::from(self.positions[probe]);
        for (volume, first) in self.ranges() {
            let own = &mut visible[first..first + volume.len()];
            own.par_iter_mut().enumerate().try_for_each(|(index, bits)| {
                stop.check()?;
                for (bit, step) in neighbours().enumerate() {
                    let other = volume.neighbour(volume.cell(index), step).map(|other| first + other);
                    let is_seen = |other: usize| {
                        let are_valid = self.is_valid(first + index) && self.is_valid(other);
                        // From the one with the lower index, so that both see each other or neither does.
                        let (one, two) = (other.min(first + index), other.max(first + index));
                        are_valid && viewer.sees(place(one), place(two))
                    };
                    *bits |= u32::from(other.is_some_and(is_seen)) << bit;
                }
                Ok(())
            })?;
        }
        Ok(visible)
    }
}

/// The length of the diagonal of a volume's cells, in metres.
fn diagonal(volume: &Volume) -> f32 {
    Vec3::from(volume.spacing()).length()
}

/// How far the probes of volumes see: see [`ProbePlaces`].
fn reach(volumes: &[Volume], looked: &[(View, Option<Vec3>)]) -> Vec<u8> {
    let mut reach = Vec::with_capacity(looked.len() * LOOKS);
    let mut first = 0;
    for volume in volumes {
        let diagonal = diagonal(volume);
        let share = |distance: &f32| (distance / diagonal * 254.0).ceil().min(255.0) as u8;
        for (view, _) in &looked[first..first + volume.len()] {
            reach.extend(view.distances.iter().map(share));
        }
        first += volume.len();
    }
    reach
}

/// Names the node whose backs the probes of a volume see most.
fn all_inside(surfaces: &Surfaces<'_>, volume: &Volume, looked: &[(View, Option<Vec3>)]) -> PlacesError {
    let mut counts = std::collections::BTreeMap::new();
    let (mut backs, mut first) = (0, 0);
    let mut ends = Vec::new();
    for part in &surfaces.parts.parts {
        first += part.triangles;
        ends.push(first as u32);
    }
    for (.., triangle) in looked.iter().flat_map(|(view, _)| &view.backs) {
        *counts.entry(ends.partition_point(|end| end <= triangle)).or_insert(0) += 1;
        backs += 1;
    }
    let most = counts.iter().max_by_key(|(part, count)| (**count, std::cmp::Reverse(**part)));
    let part = most.and_then(|(part, _)| surfaces.parts.parts.get(*part));
    PlacesError::AllInside {
        volume: volume.name.clone(),
        part: part.map_or_else(String::new, |part| part.name.clone()),
        share: (100 * backs / (256 * looked.len()).max(1)) as u32,
    }
}

impl Viewer<'_> {
    /// What a probe sees where the grid has it, and where it is to stand, with the distances from there;
    /// `None` if it remains invalid.
    fn settle(&self, grid: Vec3, volume: Option<&Volume>) -> (View, Option<Vec3>) {
        let mut view = self.view(grid);
        let place = if view.is_inside() {
            volume.and_then(|volume| self.way_out(grid, &view, volume))
        } else {
            Some(self.off_surface(grid, &view))
        };
        if let Some(place) = place.filter(|place| *place != grid) {
            view.distances = self.view(place).distances;
        }
        (view, place)
    }

    /// The nearest place outside of a solid that sees the free part of the probe's own cell.
    ///
    /// The cell ends at the box: a probe in its outer wall is moved to the inside of it.
    fn way_out(&self, grid: Vec3, view: &View, volume: &Volume) -> Option<Vec3> {
        let spacing = Vec3::from(volume.spacing());
        let most = MOST_MOVE * spacing.min_element();
        let free: Vec<Vec3> = (0..27)
            .map(|k| Vec3::new((k % 3 - 1) as f32, (k / 3 % 3 - 1) as f32, (k / 9 - 1) as f32) / 3.0)
            .map(|step| grid + step * spacing)
            .collect();
        if let Some(place) = self.off_own_surface(grid, volume) {
            return Some(place);
        }
        for &(distance, direction, _) in view.backs.iter().take(WAYS_OUT) {
            let place = grid + direction * (distance + 1.5 * LEAST_DISTANCE);
            if (place - grid).length() > most {
                break;
            }
            let view = self.view(place);
            if view.is_inside() || !volume.contains(place) {
                continue;
            }
            let place = self.off_surface(place, &view);
            let is_in_cell = ((place - grid).abs() * 2.0).cmple(spacing).all();
            let sees_free = || {
                free.iter().any(|&part| self.crossings(place, part) == [0, 0] && !self.view(part).is_inside())
            };
            if (place - grid).length() <= most && (is_in_cell || sees_free()) {
                return Some(place);
            }
        }
        None
    }

    /// The place beside a surface for a probe in its plane, as where grids and floors have the same height.
    ///
    /// Its rays start in the plane and miss it. Seen from beside, the surface shows its front there.
    fn off_own_surface(&self, grid: Vec3, volume: &Volume) -> Option<Vec3> {
        let mut best: Option<(f32, Vec3)> = None;
        for step in neighbours() {
            let direction = Vec3::from(step.map(|x| x as f32)).normalize();
            let place = grid + direction * (1.5 * LEAST_DISTANCE);
            let [fronts, backs] = self.crossings(place, grid - direction * (0.05 * LEAST_DISTANCE));
            if fronts == 0 || backs > 0 || !volume.contains(place) {
                continue;
            }
            let view = self.view(place);
            let is_better = best.is_none_or(|(share, _)| view.solid_share < share);
            if !view.is_inside() && is_better {
                best = Some((view.solid_share, self.off_surface(place, &view)));
            }
        }
        best.map(|(_, place)| place)
    }

    /// A place that is far enough from the nearest surface, if the other side has room for that.
    fn off_surface(&self, place: Vec3, view: &View) -> Vec3 {
        let Some(surface) = view.surface.filter(|_| view.nearest < LEAST_DISTANCE) else { return place };
        let moved = place + surface.normal * (LEAST_DISTANCE - view.nearest);
        let is_better = self.sees(place, moved) && self.view(moved).nearest >= view.nearest;
        if is_better { moved } else { place }
    }
}
