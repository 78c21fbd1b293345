//! Bricks of probes, and which of them can be taken over from an earlier bake.
//!
//! The light of a probe is made from what is in the cells of space that its paths cross ([`crate::cells`]),
//! and from the light of the points of the cache at which they end. Those points are taken in groups: of one
//! cell, between which light goes from one to the other, if not straight then by others, so that two rooms
//! do not become one by their common wall. A brick is kept if its probes stand where they stood, nothing is
//! different in the cells that it depends on, and its groups have the light that they had. A full bake would
//! make the same bits of it.

use std::collections::{BTreeMap, HashMap};

use crate::cells::{CellGrid, CellSet, WORDS};
use crate::places::ProbePlaces;
use crate::random::{hash, hash_of};
use crate::transport::Transport;

/// The probes of a brick along each axis of a volume.
const PROBES_ALONG_BRICK: usize = 4;

/// The points of a brick of single points, at least, on average.
const POINTS_OF_BRICK: usize = 24;

/// How often the cubes of points are halved, at most.
const HALVINGS: u32 = 20;

/// Probes in bricks.
#[derive(Clone, Debug, PartialEq)]
pub struct Bricks {
    /// A box around the probes, in metres.
    pub(crate) bounds: [[f32; 3]; 2],
    /// The numbers of the probes of each brick.
    pub(crate) probes: Vec<Vec<u32>>,
}

/// What each brick of a bake was made from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BakeRecord {
    /// A hash of what all probes depend on.
    pub of_all: u64,
    /// A hash of the surfaces in each cell of space.
    pub contents: Vec<u64>,
    /// Hashes of the light of each group of points on surfaces, ascending.
    pub groups: Vec<u64>,
    /// A hash of where the probes of each brick stand.
    pub places: Vec<u64>,
    /// The cells that each brick depends on, a bit for each: [brick, word].
    pub cells: Vec<u64>,
    /// The groups that each brick depends on, a bit for each: [brick, word].
    pub light: Vec<u64>,
}

/// The last bake of some probes, of which bricks may be kept.
#[derive(Clone, Copy, Debug)]
pub struct EarlierBake<'a> {
    /// The transport that the last bake made.
    pub transport: &'a Transport,
    /// The bricks of the probes of the last bake.
    pub bricks: &'a Bricks,
    /// What the bricks of the last bake were made from.
    pub record: &'a BakeRecord,
}

/// How many bricks are kept, and why the others are baked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BrickCounts {
    /// The number of all bricks.
    pub all: usize,
    /// The bricks that are baked because what all probes depend on is different: settings, emissive
    /// materials, or the size of the level.
    pub other: usize,
    /// The bricks that are taken over from the last bake.
    pub kept: usize,
    /// The bricks that are baked because a probe stands elsewhere or is new.
    pub moved: usize,
    /// The bricks that are baked because a path of their probes crossed a cell of space with other surfaces.
    pub crossed: usize,
    /// The bricks that are baked because their probes see surfaces on which the light is different.
    pub relit: usize,
}

/// What a brick, or a probe, depends on.
#[derive(Clone, Debug)]
pub(crate) struct Dependencies {
    pub(crate) cells: CellSet,
    /// A bit for each group of points on surfaces, in the order of their hashes.
    pub(crate) groups: Vec<u64>,
}

/// Whether a brick is kept, and why not.
pub(crate) enum Fate {
    /// The brick is that with this number in the last bake.
    Kept(usize),
    /// What all probes depend on is different.
    Other,
    /// A probe of the brick stands elsewhere.
    Moved,
    /// Paths of the brick crossed a cell with other surfaces.
    Crossed,
    /// The brick sees surfaces on which the light is different.
    Relit,
}

impl Bricks {
    /// The number of bricks.
    pub fn len(&self) -> usize {
        self.probes.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.probes.is_empty()
    }
}

/// A box with a place in it.
fn grown([least, most]: [[f32; 3]; 2], at: &[f32; 3]) -> [[f32; 3]; 2] {
    [[0, 1, 2].map(|k| least[k].min(at[k])), [0, 1, 2].map(|k| most[k].max(at[k]))]
}

impl ProbePlaces {
    /// The probes in bricks of 4^3 of each volume, and of some points each.
    pub fn bricks(&self) -> Bricks {
        let corners = self.volumes.iter().flat_map(|volume| &volume.bounds).chain(&self.grid);
        let bounds = corners.fold([[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]], grown);
        let (mut probes, mut first) = (Vec::new(), 0);
        for volume in &self.volumes {
            let counts = volume.counts.map(|count| count.div_ceil(PROBES_ALONG_BRICK));
            let start = probes.len();
            probes.resize(start + counts.iter().product::<usize>(), Vec::new());
            for index in 0..volume.len() {
                let [x, y, z] = volume.cell(index).map(|cell| cell / PROBES_ALONG_BRICK);
                probes[start + (z * counts[1] + y) * counts[0] + x].push((first + index) as u32);
            }
            first += volume.len();
        }
        probes.extend(bricks_of_points(&self.grid[first..], first as u32));
        Bricks { bounds, probes }
    }
}

/// Points, numbered from `first` on, in cubes of space whose sides are a power of two: the smallest of which
/// there are not more than one for every [`POINTS_OF_BRICK`] points. Points that come or go leave the other
/// cubes as they are, if that is still so.
fn bricks_of_points(points: &[[f32; 3]], first: u32) -> Vec<Vec<u32>> {
    let in_cubes = |side: f32| {
        let mut cubes = BTreeMap::<[i64; 3], Vec<u32>>::new();
        for (point, number) in points.iter().zip(first..) {
            cubes.entry(point.map(|x| (x / side).floor() as i64)).or_default().push(number);
        }
        cubes
    };
    let farthest = points.as_flattened().iter().fold(0.0, |most: f32, x| most.max(x.abs()));
    let largest = f32::from_bits(farthest.to_bits() & !((1 << 23) - 1)).max(f32::MIN_POSITIVE);
    let sides = (0..HALVINGS).map(|halvings| largest / (1_u32 << halvings) as f32);
    let cubes = sides.map(in_cubes).take_while(|cubes| cubes.len() * POINTS_OF_BRICK <= points.len()).last();
    match cubes {
        Some(cubes) => cubes.into_values().collect(),
        None if points.is_empty() => Vec::new(),
        None => vec![(first..first + points.len() as u32).collect()],
    }
}

impl Dependencies {
    pub(crate) fn new(groups: usize) -> Self {
        Self { cells: CellSet::new(), groups: vec![0; groups.div_ceil(64)] }
    }

    pub(crate) fn add_group(&mut self, group: u32) {
        if let Some(word) = self.groups.get_mut(group as usize / 64) {
            *word |= 1 << (group % 64);
        }
    }

    pub(crate) fn join(&mut self, other: &Self) {
        self.cells.join(&other.cells);
        self.groups.iter_mut().zip(&other.groups).for_each(|(own, other)| *own |= other);
    }
}

impl BakeRecord {
    /// Whether its parts belong together.
    pub fn is_consistent(&self) -> bool {
        let bricks = self.places.len();
        self.contents.len() == 64 * WORDS
            && self.cells.len() == bricks * WORDS
            && self.light.len() == bricks * self.groups.len().div_ceil(64)
    }

    /// What is known of a bake before its probes are baked.
    pub(crate) fn begin(
        of_all: u64,
        contents: Vec<u64>,
        groups: Vec<u64>,
        positions: &[[f32; 3]],
        bricks: &Bricks,
    ) -> Self {
        let place = |probes: &Vec<u32>| {
            hash_of(0, probes.iter().flat_map(|probe| positions[*probe as usize]).map(|x| x + 0.0))
        };
        let places = bricks.probes.iter().map(place).collect();
        Self { of_all, contents, groups, places, ..Self::default() }
    }

    /// For each brick, whether that of an earlier bake is kept. None is unless the transports are alike in
    /// shape.
    pub(crate) fn fates(&self, bricks: &[Vec<u32>], earlier: &EarlierBake<'_>, is_alike: bool) -> Vec<Fate> {
        let EarlierBake { transport, bricks: before, record } = earlier;
        let belongs = record.is_consistent() && record.places.len() == before.len();
        let are_there = before.probes.iter().flatten().all(|probe| (*probe as usize) < transport.len());
        if !(is_alike && belongs && are_there) || record.of_all != self.of_all {
            return bricks.iter().map(|_| Fate::Other).collect();
        }
        let different = CellSet::different(&self.contents, &record.contents);
        let is_missing: Vec<bool> =
            record.groups.iter().map(|group| self.groups.binary_search(group).is_err()).collect();
        let places: HashMap<u64, usize> = record.places.iter().copied().zip(0..).collect();
        let fate = |(brick, place): (usize, &u64)| {
            let is_as_long = |at: &&usize| before.probes[**at].len() == bricks[brick].len();
            let Some(&at) = places.get(place).filter(is_as_long) else { return Fate::Moved };
            let depends = record.dependencies(at);
            if depends.cells.meets(&different) {
                Fate::Crossed
            } else if depends.groups().any(|group| is_missing.get(group).copied().unwrap_or(true)) {
                Fate::Relit
            } else {
                Fate::Kept(at)
            }
        };
        self.places.iter().enumerate().map(fate).collect()
    }

    /// What a brick depends on.
    fn dependencies(&self, brick: usize) -> Dependencies {
        let words = self.groups.len().div_ceil(64);
        let cells = CellSet::of_words(
            self.cells.get(brick * WORDS..).and_then(|rest| rest.get(..WORDS)).unwrap_or(&[]),
        );
        let groups =
            self.light.get(brick * words..).and_then(|rest| rest.get(..words)).unwrap_or(&[]).to_vec();
        Dependencies { cells: cells.unwrap_or_else(CellSet::new), groups }
    }

    /// What a brick depends on that is kept, in the groups of this bake.
    pub(crate) fn dependencies_of_kept(&self, earlier: &Self, brick: usize) -> Dependencies {
        let before = earlier.dependencies(brick);
        let mut depends =
            Dependencies { cells: before.cells.clone(), ..Dependencies::new(self.groups.len()) };
        for group in before.groups() {
            if let Some(Ok(own)) = earlier.groups.get(group).map(|group| self.groups.binary_search(group)) {
                depends.add_group(own as u32);
            }
        }
        depends
    }

    /// Adds what all bricks depend on.
    pub(crate) fn finish(mut self, bricks: &[Dependencies]) -> Self {
        self.cells = bricks.iter().flat_map(|brick| brick.cells.words()).copied().collect();
        self.light = bricks.iter().flat_map(|brick| &brick.groups).copied().collect();
        self
    }
}

impl Dependencies {
    /// The numbers of the groups of points that are in the set.
    fn groups(&self) -> impl Iterator<Item = usize> {
        let bits = |(at, word): (usize, &u64)| {
            let word = *word;
            (0..64).filter(move |bit| word >> bit & 1 == 1).map(move |bit| 64 * at + bit)
        };
        self.groups.iter().enumerate().flat_map(bits)
    }
}

impl BrickCounts {
    pub(crate) fn of(fates: &[Fate]) -> Self {
        let mut counts = Self { all: fates.len(), ..Self::default() };
        for fate in fates {
            match fate {
                Fate::Kept(_) => counts.kept += 1,
                Fate::Other => counts.other += 1,
                Fate::Moved => counts.moved += 1,
                Fate::Crossed => counts.crossed += 1,
                Fate::Relit => counts.relit += 1,
            }
        }
        counts
    }
}

/// Groups of points, by the parts of the scene that light goes to and fro in and by cells.
pub(crate) struct PointGroups {
    /// The group of each point.
    pub(crate) of: Vec<u32>,
    /// A hash of the light of each group.
    pub(crate) digests: Vec<u64>,
}

impl PointGroups {
    /// The groups of points with a part of the scene and a place each; `light` is a hash of a point's light.
    pub(crate) fn new(grid: &CellGrid, points: &[(u32, glam::Vec3)], light: impl Fn(usize) -> u64) -> Self {
        let (mut numbers, mut groups) = (HashMap::new(), Self { of: Vec::new(), digests: Vec::new() });
        for (index, (part, at)) in points.iter().enumerate() {
            let group = *numbers.entry((*part, grid.cell_of(*at))).or_insert_with(|| {
                groups.digests.push(0);
                groups.digests.len() as u32 - 1
            });
            let digest = &mut groups.digests[group as usize];
            *digest = hash(hash_of(*digest, at.to_array()) ^ light(index));
            groups.of.push(group);
        }
        groups
    }

    /// Numbers the groups of several caches in the order of their hashes, which it returns.
    pub(crate) fn number(mut all: Vec<&mut Self>) -> Vec<u64> {
        let mut digests: Vec<u64> = all.iter().flat_map(|groups| &groups.digests).copied().collect();
        digests.sort_unstable();
        digests.dedup();
        for groups in &mut all {
            let number = |digest: &u64| digests.binary_search(digest).unwrap_or(0) as u32;
            let numbers: Vec<u32> = groups.digests.iter().map(number).collect();
            groups.of.iter_mut().for_each(|group| *group = numbers[*group as usize]);
        }
        digests
    }
}

/// The part of the scene of points that meet nothing but the sky.
const PART_OF_SKY: u32 = u32::MAX;

/// For each of some points the first of those that links lead to or from, if not straight then by others;
/// [`PART_OF_SKY`] for those without a link.
pub(crate) fn connected(count: usize, links: impl Iterator<Item = (u32, u32)>) -> Vec<u32> {
    let mut above: Vec<u32> = (0..count as u32).collect();
    fn first(above: &mut [u32], mut at: u32) -> u32 {
        while above[at as usize] != at {
            above[at as usize] = above[above[at as usize] as usize];
            at = above[at as usize];
        }
        at
    }
    for (one, other) in links {
        let [one, other] = [one, other].map(|at| first(&mut above, at));
        above[one.max(other) as usize] = one.min(other);
    }
    let first: Vec<u32> = (0..count as u32).map(|at| first(&mut above, at)).collect();
    let mut sizes = vec![0_u32; count];
    first.iter().for_each(|at| sizes[*at as usize] += 1);
    first.iter().map(|at| if sizes[*at as usize] == 1 { PART_OF_SKY } else { *at }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::share_of;

    /// Each point is in one brick, and one that goes changes its own brick alone.
    #[test]
    fn points_that_go_leave_the_bricks_of_others() {
        let number = |k: usize| 20.0 * share_of(hash(k as u64)) - 5.0;
        let mut points: Vec<[f32; 3]> =
            (0..2000).map(|k| [0, 1, 2].map(|axis| number(3 * k + axis))).collect();
        let places = |points: &[[f32; 3]]| {
            let bricks = bricks_of_points(points, 7);
            let mut all: Vec<u32> = bricks.concat();
            all.sort_unstable();
            assert!(all.into_iter().eq(7..7 + points.len() as u32));
            let of_brick =
                |brick: &Vec<u32>| brick.iter().map(|k| points[*k as usize - 7].map(f32::to_bits)).collect();
            bricks.iter().map(of_brick).collect::<Vec<Vec<_>>>()
        };
        let before = places(&points);
        assert!((16..=points.len() / POINTS_OF_BRICK).contains(&before.len()), "{}", before.len());
        points.remove(3);
        let after = places(&points);
        let changed = before.iter().filter(|brick| !after.contains(brick)).count();
        assert_eq!(changed, 1);
        for count in [0, 1, 5, 100] {
            let same = vec![[1.0, 2.0, 3.0]; count];
            assert_eq!(places(&same).len(), count.min(1));
        }
    }
}
