//! The rooms in a box: a box for each connected free space, which ends in the middle of its walls.
//!
//! Engines clamp at the end of a box of probes, so that a box for each room keeps the light of one room out
//! of the other. Free space is found on a fine lattice, whose neighbours are connected if a ray passes from
//! one to the other. A doorway or a window connects rooms, too: a room is where a cube of a given side, wider
//! than doorways, can move about (the opening of mathematical morphology, by components). Narrower spaces
//! that no such room holds, as corridors, are rooms of their own. A room that is not a box, as an L, is cut
//! into boxes where it would hold a part of another one.

use glam::Vec3;
use rayon::prelude::*;
use sh::{Stop, Stopped};

use crate::lattice_cells::{Cells, Region};
use crate::surfaces::Surfaces;
use crate::validity::Viewer;

/// The least distance of places on the lattice, in metres.
pub const LEAST_ROOM_STEP: f32 = 0.1;

/// The most places on the lattice.
const MOST_CELLS: f32 = (1 << 21) as f32;

/// Spaces that are narrower than this along an axis are no rooms, in metres.
const NARROWEST: f32 = 0.5;

/// Walls are no thicker than this, in metres: what is behind a wall begins at the next surface.
const THICKEST: f32 = 0.5;

/// The share of a cross-section that is a wall, at which a box is cut.
const WALL: f32 = 0.5;

/// How many places of a space are looked at to know whether it is inside of a solid.
const LOOKED: usize = 9;

/// The distance of the places on the lattice on which rooms in a box are found, in metres: that in a large
/// box is longer than [`LEAST_ROOM_STEP`]. Walls and openings of about a step may be missed.
pub fn room_step(bounds: [[f32; 3]; 2]) -> f32 {
    let [least, most] = bounds.map(Vec3::from);
    let mut step = LEAST_ROOM_STEP;
    while ((most - least) / step).ceil().max(Vec3::ONE).to_array().iter().product::<f32>() > MOST_CELLS {
        step *= 1.25;
    }
    step
}

/// The boxes of the rooms in a box, in metres: none if there is no free space as wide as half a metre.
///
/// Spaces that are connected by an opening narrower or lower than `opening` metres are two rooms. Boxes end
/// in the middle of walls of up to half a metre, so that the boxes of two rooms meet in a doorway. Uses all
/// threads; the result does not depend on their number.
///
/// # Errors
/// If it was stopped.
pub fn rooms(
    surfaces: &Surfaces<'_>,
    bounds: [[f32; 3]; 2],
    opening: f32,
    stop: Stop<'_>,
) -> Result<Vec<[[f32; 3]; 2]>, Stopped> {
    let viewer = Viewer::new(surfaces);
    let cells = Cells::new(&viewer, bounds, room_step(bounds), stop)?;
    let mut search = Search { viewer: &viewer, cells: &cells, bounds, found: Vec::new() };
    // A box of n cells has n - 1 steps between its outer places: it does not fit through the opening.
    let sides = cells.step().to_array().map(|step| ((opening / step).floor() as usize).saturating_add(2));
    let wide = cells.opened(sides, stop)?;
    search.add(&wide, stop)?;
    // What is left, as far as no room holds it.
    let mut rest = cells.free();
    for region in &search.found {
        region.places().for_each(|at| rest[cells.index(at)] = false);
    }
    search.add(&cells.components(&rest, stop)?, stop)?;
    let fitted = search.found.par_iter().map(|region| {
        stop.check()?;
        Ok(search.fitted(region))
    });
    let fitted = fitted.collect::<Result<Vec<Fitted>, Stopped>>()?;
    Ok((0..fitted.len()).map(|own| met(&fitted, own, cells.step())).collect())
}

/// A box, and which of its ends are open: neither at a wall nor where the whole box ends.
#[derive(Clone, Copy, Debug)]
struct Fitted {
    ends: [[f32; 3]; 2],
    is_open: [[bool; 3]; 2],
}

/// A box whose open ends are moved by up to a step to the end of the box that they meet.
fn met(fitted: &[Fitted], own: usize, step: Vec3) -> [[f32; 3]; 2] {
    let Fitted { mut ends, is_open } = fitted[own];
    let given = ends;
    for (axis, side) in
        (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]).filter(|(axis, side)| is_open[*side][*axis])
    {
        let meets = |other: &[[f32; 3]; 2]| {
            (other[1 - side][axis] - given[side][axis]).abs() <= step[axis]
                && (0..3).all(|k| k == axis || other[0][k] < given[1][k] && given[0][k] < other[1][k])
        };
        if let Some(other) = fitted.iter().map(|other| &other.ends).find(|other| meets(other)) {
            ends[side][axis] = other[1 - side][axis];
        }
    }
    ends
}

/// The rooms that were found so far.
struct Search<'a> {
    viewer: &'a Viewer<'a>,
    cells: &'a Cells,
    bounds: [[f32; 3]; 2],
    found: Vec<Region>,
}

impl Search<'_> {
    /// Adds the boxes of spaces: each place has the number of its space from 1 on, 0 for none.
    fn add(&mut self, space_of: &[u32], stop: Stop<'_>) -> Result<(), Stopped> {
        let count = space_of.iter().copied().max().unwrap_or(0) as usize;
        let mut spaces: Vec<Vec<[usize; 3]>> = vec![Vec::new(); count];
        for (index, space) in space_of.iter().enumerate() {
            if let Some(own) = (*space as usize).checked_sub(1) {
                spaces[own].push(self.cells.place(index));
            }
        }
        let before = self.found.clone();
        for (own, places) in (1..).zip(spaces) {
            stop.check()?;
            let is_wide = |places: &[[usize; 3]]| {
                Region::around(places).is_some_and(|region| self.cells.narrowest(&region) >= NARROWEST)
            };
            if !is_wide(&places) || self.is_solid(&places) {
                continue;
            }
            let is_foreign = |at: [usize; 3]| {
                let space = space_of[self.cells.index(at)];
                space != 0 && space != own || before.iter().any(|region| region.contains(at))
            };
            let mut waiting = vec![places];
            while let Some(places) = waiting.pop() {
                stop.check()?;
                if !is_wide(&places) {
                    continue;
                }
                let Some(region) = Region::around(&places) else { continue };
                let cut = self.cells.wall(&region).filter(|(_, share)| *share > WALL).map(|(cut, _)| cut);
                let cut = cut.or_else(|| {
                    region.places().any(is_foreign).then(|| region.tightest_cut(&places)).flatten()
                });
                let Some((axis, first)) = cut else {
                    self.found.push(region);
                    continue;
                };
                let (below, above) = places.into_iter().partition(|at| at[axis] < first);
                waiting.extend([above, below]);
            }
        }
        Ok(())
    }

    /// Whether most of some places are inside of a solid.
    fn is_solid(&self, places: &[[usize; 3]]) -> bool {
        let looked = places.iter().step_by(places.len().div_ceil(LOOKED).max(1));
        let (mut inside, mut all) = (0, 0);
        for place in looked {
            inside += usize::from(self.viewer.view(self.cells.position(*place)).is_inside());
            all += 1;
        }
        2 * inside > all
    }

    /// The box of a room: it ends in the middle of the walls beside its outer places; without a wall,
    /// halfway to the next place, or where the whole box ends.
    fn fitted(&self, region: &Region) -> Fitted {
        let step = self.cells.step();
        let (mut ends, mut is_open) = ([[0.0; 3]; 2], [[false; 3]; 2]);
        for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
            let layer = if side == 0 { region.least[axis] } else { region.most[axis] - 1 };
            let outward = if side == 0 { -1.0 } else { 1.0 };
            let mut direction = Vec3::ZERO;
            direction[axis] = outward;
            let wall = region
                .places()
                .filter(|at| at[axis] == layer)
                .filter_map(|at| self.wall_beside(self.cells.position(at), direction, step[axis]))
                .max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
            let mut place = region.least;
            place[axis] = layer;
            let last = self.cells.position(place)[axis];
            let whole = self.bounds[side][axis];
            let is_outer = layer == 0 && side == 0 || layer + 1 == self.cells.counts()[axis] && side == 1;
            let end = match wall {
                Some((distance, thickness)) => last + outward * (distance + 0.5 * thickness),
                None if is_outer => whole,
                None => last + outward * 0.5 * step[axis],
            };
            is_open[side][axis] = wall.is_none() && !is_outer;
            ends[side][axis] = if side == 0 { end.max(whole) } else { end.min(whole) };
        }
        Fitted { ends, is_open }
    }

    /// The distance of a wall within a step from a place, and its thickness: that up to the back of its other
    /// side, 0 for a sheet.
    fn wall_beside(&self, from: Vec3, direction: Vec3, step: f32) -> Option<(f32, f32)> {
        let caster = &self.viewer.surfaces.caster;
        let hit = caster.closest(from, direction, |_| true).filter(|hit| hit.distance <= 1.01 * step)?;
        let behind = caster.closest(from, direction, |next| {
            next.distance > hit.distance * (1.0 + 1e-5) && next.triangle != hit.triangle
        });
        let thickness = behind.filter(|next| !next.front).map_or(0.0, |next| next.distance - hit.distance);
        Some((hit.distance, if thickness <= THICKEST { thickness } else { 0.0 }))
    }
}
