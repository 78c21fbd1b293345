//! The places of probes as they are stored.

use crate::places::{ProbePlaces, Repair};
use crate::validity::LOOKS;
use crate::volume::{Volume, neighbours};

/// The parts of [`ProbePlaces`], unchecked. Probes of volumes come first, then those at points.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacesParts {
    /// The volumes.
    pub volumes: Vec<Volume>,
    /// The points, in metres.
    pub points: Vec<[f32; 3]>,
    /// See [`ProbePlaces::positions`].
    pub positions: Vec<[f32; 3]>,
    /// See [`ProbePlaces::back_share`].
    pub back_share: Vec<f32>,
    /// See [`ProbePlaces::inside_of`].
    pub inside_of: Vec<Option<u32>>,
    /// See [`ProbePlaces::repairs`].
    pub repairs: Vec<Repair>,
    /// See [`ProbePlaces::visible`].
    pub visible: Vec<u32>,
    /// See [`ProbePlaces::reach`].
    pub reach: Vec<u8>,
}

impl ProbePlaces {
    /// Places that were stored.
    ///
    /// # Errors
    /// If parts do not belong together, or a number is out of its range: the text names the part.
    pub fn from_parts(parts: PlacesParts) -> Result<Self, &'static str> {
        let PlacesParts { volumes, points, positions, back_share, inside_of, repairs, visible, reach } =
            parts;
        let is_volume = |volume: &Volume| {
            let Volume { name: _, bounds, counts, lattice } = volume;
            Volume::new(String::new(), *bounds, *counts, *lattice).is_ok()
        };
        if !volumes.iter().all(is_volume) {
            return Err("volumes");
        }
        let of_volumes = volumes.iter().try_fold(0_usize, |sum, volume| sum.checked_add(volume.len()));
        let count = of_volumes.and_then(|sum| sum.checked_add(points.len()));
        let (Some(of_volumes), Some(count)) = (of_volumes, count) else {
            return Err("numbers of probes");
        };
        if count == 0 {
            return Err("numbers of probes");
        }
        let are_finite = |places: &[[f32; 3]]| places.as_flattened().iter().all(|x| x.is_finite());
        let is_whole = |repair: &Repair| match repair {
            Repair::None | Repair::Moved => true,
            Repair::Filled(sources) => {
                let is_source = |(source, weight): &(u32, f32)| {
                    (*source as usize) < count && (0.0..=1.0).contains(weight)
                };
                !sources.is_empty() && sources.iter().all(is_source)
            }
            Repair::Lost(source) => (*source as usize) < count,
        };
        let bits = neighbours().count() as u32;
        // The memory of what is claimed is there already: the lengths are those of other parts.
        [
            (positions.len() == count && are_finite(&positions) && are_finite(&points), "positions"),
            (
                back_share.len() == count && back_share.iter().all(|share| (0.0..=1.0).contains(share)),
                "shares of backs",
            ),
            (inside_of.len() == count, "triangles that probes are inside of"),
            (repairs.len() == count && repairs.iter().all(is_whole), "repairs"),
            (visible.len() == count && visible.iter().all(|seen| seen >> bits == 0), "visible neighbours"),
            (Some(reach.len()) == of_volumes.checked_mul(LOOKS), "reaches"),
        ]
        .into_iter()
        .find(|(is_right, _)| !is_right)
        .map_or(Ok(()), |(_, what)| Err(what))?;
        let of_volume = |volume: &Volume| {
            let position = |index| volume.position(volume.cell(index));
            (0..volume.len()).map(position).collect::<Vec<_>>()
        };
        let mut grid: Vec<[f32; 3]> = volumes.iter().flat_map(of_volume).collect();
        grid.extend(&points);
        let scattered = points.len();
        Ok(Self { volumes, scattered, grid, positions, back_share, inside_of, repairs, visible, reach })
    }

    /// The points of the probes that are in no volume, in metres.
    pub fn points(&self) -> &[[f32; 3]] {
        &self.grid[self.grid.len() - self.scattered..]
    }
}
