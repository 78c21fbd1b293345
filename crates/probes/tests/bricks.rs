//! Bricks of an earlier bake, next to a full one, after edits of a scene at random.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use probes::{
    BakeOptions, BrickCounts, EarlierBake, Emission, Lattice, Material, Part, ProbePlaces, Scene, SceneParts,
    Surfaces, Volume, bake_bricks,
};
use sh::Stop;

/// Numbers that look random.
struct Random(u64);

impl Random {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % count
    }

    fn within(&mut self, least: f32, most: f32) -> f32 {
        least + (most - least) * self.below(1 << 20) as f32 / (1 << 20) as f32
    }
}

/// A box that stands somewhere, with a material.
#[derive(Clone)]
struct Crate {
    at: [f32; 3],
    size: [f32; 3],
    material: usize,
}

/// Two rooms with a door between them, a closed one behind the second, and boxes.
#[derive(Clone)]
struct Level {
    boxes: Vec<Crate>,
    albedo: [f32; 6],
    has_lamp: bool,
}

/// The corners of the six sides of a box, as triangles that are seen from outside.
fn sides([x, y, z]: [f32; 3], [dx, dy, dz]: [f32; 3]) -> Vec<[[f32; 3]; 3]> {
    let corner = |k: usize| [x + dx * (k & 1) as f32, y + dy * (k >> 1 & 1) as f32, z + dz * (k >> 2) as f32];
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).map(|t| t.map(corner)).collect()
}

impl Level {
    /// Floor, ceiling and walls, each 0.2 m thick, with windows in the first room's and the last room's
    /// ceiling.
    fn walls() -> Vec<Crate> {
        let wall = |at: [f32; 3], size: [f32; 3]| Crate { at, size, material: 0 };
        vec![
            wall([-0.2, -0.2, -0.2], [12.6, 4.4, 0.2]),
            wall([-0.2, -0.2, 0.0], [12.6, 0.2, 2.6]),
            wall([-0.2, 4.0, 0.0], [12.6, 0.2, 2.6]),
            wall([-0.2, 0.0, 0.0], [0.2, 4.0, 2.6]),
            wall([12.2, 0.0, 0.0], [0.2, 4.0, 2.6]),
            // A wall with a door.
            wall([4.0, 0.0, 0.0], [0.2, 1.5, 2.6]),
            wall([4.0, 2.5, 0.0], [0.2, 1.5, 2.6]),
            wall([4.0, 1.5, 2.0], [0.2, 1.0, 0.6]),
            // A wall without one.
            wall([8.0, 0.0, 0.0], [0.2, 4.0, 2.6]),
            // Ceilings.
            wall([-0.2, -0.2, 2.6], [2.2, 4.4, 0.2]),
            wall([3.0, -0.2, 2.6], [6.0, 4.4, 0.2]),
            wall([10.0, -0.2, 2.6], [2.4, 4.4, 0.2]),
        ]
    }

    fn new(random: &mut Random) -> Self {
        let boxes = (0..6).map(|k| Self::place(random, k)).collect();
        Self { boxes, albedo: [0.7, 0.5, 0.3, 0.6, 0.8, 0.2], has_lamp: true }
    }

    /// A box on the floor of a room.
    fn place(random: &mut Random, room: usize) -> Crate {
        let x = 4.2 * (room % 3) as f32;
        let size = [0; 3].map(|_| random.within(0.2, 0.9));
        let at = [random.within(x + 0.1, x + 2.8), random.within(0.1, 3.0), 0.0];
        Crate { at, size, material: 1 + random.below(5) }
    }

    fn scene(&self) -> Scene {
        let mut parts = SceneParts::default();
        let lamp = Crate { at: [1.0, 1.0, 2.3], size: [0.4, 0.4, 0.1], material: 6 };
        let lamp = self.has_lamp.then_some(lamp);
        for Crate { at, size, material } in Self::walls().iter().chain(&self.boxes).chain(&lamp) {
            let triangles = sides(*at, *size);
            parts.material_of.extend(vec![*material as u32; triangles.len()]);
            parts.attributes_of.extend(vec![SceneParts::NONE; triangles.len()]);
            parts.parts.push(Part { name: String::new(), triangles: triangles.len() });
            parts.triangles.extend(triangles);
        }
        let matte = |albedo: &f32| Material { base: [*albedo, *albedo, *albedo, 1.0], ..Material::default() };
        parts.materials = self.albedo.iter().map(matte).collect();
        let emission = Some(Emission { radiance: [1.0; 3], texture: None });
        parts.materials.push(Material { emission, ..matte(&0.5) });
        Scene::new(parts).unwrap()
    }

    /// Changes something.
    fn edit(&mut self, random: &mut Random) {
        let count = self.boxes.len();
        match random.below(12) {
            0 => self.boxes.push(Self::place(random, random.0 as usize % 3)),
            1 if count > 3 => drop(self.boxes.remove(random.below(count))),
            2 => self.albedo[1 + random.below(5)] = random.within(0.1, 0.9),
            3 => self.boxes[random.below(count)].material = 1 + random.below(5),
            4 if random.below(4) == 0 => self.has_lamp = !self.has_lamp,
            5 if random.below(4) == 0 => self.albedo[0] = random.within(0.4, 0.8),
            6 => self.boxes.swap(random.below(count), count - 1),
            _ => {
                let moved = random.below(count);
                let axis = random.below(2);
                self.boxes[moved].at[axis] += random.within(-0.1, 0.1);
            }
        }
    }
}

fn places(surfaces: &Surfaces<'_>) -> ProbePlaces {
    let volume = |k: usize| {
        let bounds = [[4.2 * k as f32, 0.0, 0.0], [4.2 * k as f32 + 3.8, 4.0, 2.6]];
        Volume::new(format!("room {k}"), bounds, [6, 5, 3], Lattice::Centres).unwrap()
    };
    ProbePlaces::new(surfaces, (0..3).map(volume).collect(), &[[5.0, 2.0, 1.0]], Stop::NEVER).unwrap()
}

#[test]
fn kept_bricks_are_those_of_a_full_bake() {
    let mut random = Random(7);
    let mut level = Level::new(&mut random);
    let options = BakeOptions { paths: 16, ..BakeOptions::default() };
    let scene = level.scene();
    let surfaces = Surfaces::new(&scene);
    let places_of = places(&surfaces);
    let first = (places_of.positions(), places_of.bricks());
    let mut before = bake_bricks(&surfaces, first.0, &first.1, &options, None, Stop::NEVER).unwrap();
    let mut bricks_before = first.1;
    let mut sum = BrickCounts::default();
    for edit in 0..200 {
        level.edit(&mut random);
        let scene = level.scene();
        let surfaces = Surfaces::new(&scene);
        let places = places(&surfaces);
        let bricks = places.bricks();
        let earlier = EarlierBake {
            transport: &before.transport,
            bricks: &bricks_before,
            record: before.record.as_ref().unwrap(),
        };
        let bake = |earlier| {
            bake_bricks(&surfaces, places.positions(), &bricks, &options, earlier, Stop::NEVER).unwrap()
        };
        let (whole, after) = (bake(None), bake(Some(earlier)));
        assert!(after.transport == whole.transport, "{edit}");
        assert!(after.record == whole.record, "{edit}");
        let BrickCounts { all, other, kept, moved, crossed, relit } = after.counts.unwrap();
        assert_eq!(all, other + kept + moved + crossed + relit);
        for (sum, own) in [
            (&mut sum.all, all),
            (&mut sum.other, other),
            (&mut sum.kept, kept),
            (&mut sum.moved, moved),
            (&mut sum.crossed, crossed),
            (&mut sum.relit, relit),
        ] {
            *sum += own;
        }
        (before, bricks_before) = (after, bricks);
    }
    assert!(
        sum.kept > sum.all / 4 && sum.other > 0 && sum.moved > 0 && sum.crossed > 0 && sum.relit > 0,
        "{sum:?}"
    );
}

/// Two emissive materials that have half of a closed room each, and change places in the list: they are too
/// large for shadow rays, and what each triangle looks like stays.
#[test]
fn columns_of_large_emitters_are_not_mixed_up() {
    let triangles = sides([0.0; 3], [2.0; 3]);
    let scene = |order: [usize; 2]| {
        let count = triangles.len();
        let black = Material {
            emission: Some(Emission { radiance: [1.0; 3], texture: None }),
            base: [0.0, 0.0, 0.0, 1.0],
            is_double_sided: true,
            ..Material::default()
        };
        let materials = [black.clone(), Material { metallic: 1.0, ..black }];
        Scene::new(SceneParts {
            triangles: triangles.clone(),
            material_of: (0..count).map(|k| order[k / 2 % 2] as u32).collect(),
            attributes_of: vec![SceneParts::NONE; count],
            materials: order.map(|k| materials[k].clone()).to_vec(),
            parts: vec![Part { name: String::new(), triangles: count }],
            ..SceneParts::default()
        })
        .unwrap()
    };
    let options = BakeOptions { paths: 64, bounces: Some(0), ..BakeOptions::default() };
    let [one, other] = [[0, 1], [1, 0]].map(scene);
    let [one, other] = [&one, &other].map(Surfaces::new);
    let volume = Volume::new("room".into(), [[0.5; 3], [1.5; 3]], [2, 2, 2], Lattice::Centres).unwrap();
    let places = ProbePlaces::new(&one, vec![volume], &[], Stop::NEVER).unwrap();
    let (at, bricks) = (places.positions(), places.bricks());
    let bake =
        |surfaces, earlier| bake_bricks(surfaces, at, &bricks, &options, earlier, Stop::NEVER).unwrap();
    let before = bake(&one, None);
    let record = before.record.as_ref().unwrap();
    let earlier = EarlierBake { transport: &before.transport, bricks: &bricks, record };
    let after = bake(&other, Some(earlier));
    assert!(after.transport == bake(&other, None).transport && after.transport != before.transport);
    assert_eq!(bake(&one, Some(earlier)).counts.unwrap().kept, 1);
}
