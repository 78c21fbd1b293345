//! Pictures by BRDF tables and transfer, and traced shadows.

use brdf::{BrdfTable, Ward, tabulate};
use sphere::Direction;
use transfer::{Directions, Frames, Occluders, Transfer, TransferDegrees, precompute};

use super::*;
use crate::shading::shadows::Shadows;
use crate::shading::surface::Surface;

pub(super) fn brushed() -> Material {
    Material::Ward(Ward::new([0.3, 0.6], [1.0, 0.8, 0.5]).unwrap())
}

/// The look of a material without maps, with its table.
pub(super) fn tabulated(light: &Arc<Light>, material: Material, l: usize) -> Arc<Look> {
    let (table, _) = tabulate(&material, Degree::new(l).unwrap(), 64, Stop::NEVER).unwrap();
    let sizes = MapSizes { edge: 8, slices: 4 };
    Arc::new(Look::without_maps(Arc::clone(light), material, sizes).with_table(Some(Arc::new(table))))
}

pub(super) fn transfer_of(mesh: &Mesh, l: usize) -> Arc<Vec<Transfer>> {
    let degree = Degree::new(l).unwrap();
    let directions = Directions::new(256, Degree::new(2 * l).unwrap()).unwrap();
    let frames = Frames::of(mesh).unwrap();
    Arc::new(vec![
        precompute(
            &frames,
            &Occluders::of(mesh),
            &directions,
            TransferDegrees { output: degree, input: degree },
            Stop::NEVER,
        )
        .unwrap()
        .0,
    ])
}

pub(super) fn knot() -> Arc<Mesh> {
    Arc::new(mesh::shape("torus-knot").unwrap())
}

/// The RMS of the difference of two modes over that of the second.
pub(super) fn rms(scene: &Scene, shot: &Shot, [of, from]: [Mode; 2]) -> f64 {
    let show = Show::Difference { of, from, amplify: 1.0 };
    render(scene, &Shot { show, ..shot.clone() }).relative_rms.unwrap()
}

/// The light has degree 4, and the table all of it: only the noise of brute force remains, and the turning of
/// normals between vertices.
#[test]
fn a_table_shades_brushed_metal_as_brute_force_does() {
    let scene = Scene::of(sphere(), tabulated(&light(32, uneven), brushed(), 6));
    let shot = Shot { light_samples: 2048, ..shot([24, 24], Show::One(Mode::Table)) };
    let error = rms(&scene, &shot, [Mode::Table, Mode::BruteForce]);
    assert!(error < 0.01, "{error}");
}

/// A knot hides much of a light from above from itself. Degree 4 blurs its shadows.
#[test]
fn transfer_has_the_shadows_of_shadowed_brute_force() {
    let sky = light(32, |w| [0.2 + 2.0 * w.z.max(0.0); 3]);
    let mesh = knot();
    let scene = Scene::of(Arc::clone(&mesh), tabulated(&sky, lambert(0.8), 4));
    let scene = scene.with_transfer(Some(transfer_of(&mesh, 4)));
    let shot = Shot { light_samples: 512, ..shot([40, 40], Show::One(Mode::Transfer)) };
    let with = rms(&scene, &shot, [Mode::Transfer, Mode::ShadowedBruteForce]);
    let without = rms(&scene, &shot, [Mode::Table, Mode::ShadowedBruteForce]);
    assert!(with < 0.05 && without > 3.0 * with, "{with} {without}");
}

/// Where the blend is 0 or 1 everywhere, a table of two materials is that of the one; half of both lies
/// between.
#[test]
fn a_blend_says_which_material_of_a_table_is_seen() {
    let mesh = knot();
    let (dark, bright) = (lambert(0.1), brushed());
    let sky = light(16, uneven);
    let tables = [&dark, &bright]
        .map(|material| tabulate(material, Degree::new(2).unwrap(), 16, Stop::NEVER).unwrap().0);
    let look = |table: BrdfTable| {
        let bare = Look::without_maps(Arc::clone(&sky), dark.clone(), MapSizes { edge: 8, slices: 4 });
        Scene::of(Arc::clone(&mesh), Arc::new(bare.with_table(Some(Arc::new(table)))))
    };
    let both = BrdfTable::joined(&tables).unwrap();
    let blended = |blend: f32| {
        let blend = Arc::new(vec![[blend, 0.0]; mesh.positions().len()]);
        look(both.clone()).with_blend(Some(blend)).with_transfer(Some(transfer_of(&mesh, 2)))
    };
    let [first, second] = tables.map(|table| look(table).with_transfer(Some(transfer_of(&mesh, 2))));
    for mode in [Mode::Table, Mode::Transfer] {
        let shot = shot([24, 24], Show::One(mode));
        let [none, half, all] = [0.0, 0.5, 1.0].map(|blend| render(&blended(blend), &shot).radiance);
        // The shares of a triangle's corners sum to 1 up to rounding.
        for (found, of) in [(&none, &first), (&all, &second)] {
            let expected = render(of, &shot).radiance;
            let pairs = found.as_flattened().iter().zip(expected.as_flattened());
            let apart = pairs.map(|(one, other)| (one - other).abs()).fold(0.0, f32::max);
            assert!(apart < 1e-5, "{mode:?}: {apart}");
        }
        let apart = |[none, half, all]: [f32; 3]| (half - 0.5 * (none + all)).abs() / (1.0 + all.abs());
        let pixels = none.as_flattened().iter().zip(half.as_flattened()).zip(all.as_flattened());
        let worst = pixels.map(|((none, half), all)| apart([*none, *half, *all])).fold(0.0, f32::max);
        assert!(worst < 1e-5 && none != all, "{mode:?}: {worst}");
    }
    // A blend of another mesh shows the first material.
    let other = look(both.clone()).with_blend(Some(Arc::new(vec![[1.0, 0.0]])));
    let shot = shot([24, 24], Show::One(Mode::Table));
    assert_eq!(render(&other, &shot).radiance, render(&first, &shot).radiance);
}

/// Between the four corners of a square, a near viewer's directions differ much: shading at the corners alone
/// would miss the highlight in the middle. The light has degree 4, so only the noise of brute force remains.
#[test]
fn a_table_is_looked_up_between_vertices_too() {
    let corner = |x: f32, y: f32| [2.0 * x, 2.0 * y, 0.0];
    let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    let mesh = Arc::new(soup(&[[a, b, c], [a, c, d]]));
    let scene = Scene::of(Arc::clone(&mesh), tabulated(&light(32, uneven), brushed(), 6));
    let scene = scene.with_transfer(Some(transfer_of(&mesh, 6)));
    let mut shot = Shot { light_samples: 2048, ..shot([24, 24], Show::One(Mode::Table)) };
    shot.camera.field = 1.6;
    for (mode, from) in [(Mode::Table, Mode::BruteForce), (Mode::Transfer, Mode::ShadowedBruteForce)] {
        let error = rms(&scene, &shot, [mode, from]);
        assert!(error < 0.02, "{mode:?}: {error}");
    }
}

/// The oracle is a renderer that has drawn nothing before.
#[test]
fn the_light_is_brought_to_the_vertices_only_if_it_moved() {
    let mesh = knot();
    let scene = Scene::of(Arc::clone(&mesh), tabulated(&light(32, uneven), brushed(), 3));
    let scene = scene.with_transfer(Some(transfer_of(&mesh, 3)));
    for mode in [Mode::Table, Mode::Transfer] {
        let mut cpu = super::super::Cpu::new();
        let mut shot = shot([30, 30], Show::One(mode));
        let mut expect = |shot: &Shot, passes| {
            let picture = cpu.render(&scene, shot, Stop::NEVER).unwrap();
            let fresh = render(&scene, shot);
            let pairs = picture.radiance.as_flattened().iter().zip(fresh.radiance.as_flattened());
            let apart = pairs.map(|(one, other)| (one - other).abs()).fold(0.0, f32::max);
            assert_eq!((apart, cpu.light_passes()), (0.0, passes), "{mode:?}");
        };
        expect(&shot, 1);
        shot.camera.yaw += 0.3;
        expect(&shot, 1);
        shot.turn = Rotation::from_yaw_pitch_roll(0.4, 0.1, 0.0);
        expect(&shot, 2);
        shot.exposure = 1.0;
        expect(&shot, 2);
        shot.camera.yaw += 0.3;
        shot.turn = Rotation::IDENTITY;
        expect(&shot, 3);
    }
}

/// A mesh with the place of an object in its vertices.
fn moved(mesh: &Mesh, place: DAffine3) -> Mesh {
    let mirrored = place.matrix3.determinant() < 0.0;
    let turn = |[x, y, z]: [f32; 3]| {
        let turned = place.matrix3 * DVec3::new(x.into(), y.into(), z.into());
        turned.normalize().as_vec3().to_array()
    };
    let position =
        |p: &[f32; 3]| place.transform_point3(glam::Vec3::from(*p).as_dvec3()).as_vec3().to_array();
    let tangent = |&[x, y, z, w]: &[f32; 4]| {
        let [x, y, z] = turn([x, y, z]);
        [x, y, z, if mirrored { -w } else { w }]
    };
    let corners = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
    Mesh::new(
        mesh.positions().iter().map(position).collect(),
        mesh.normals().iter().map(|normal| turn(*normal)).collect(),
        mesh.tangents().iter().map(tangent).collect(),
        None,
        mesh.triangles().iter().map(corners).collect(),
    )
    .unwrap()
}

#[test]
fn an_object_is_shaded_as_a_mesh_that_was_moved_to_its_place() {
    let (mesh, look) = (knot(), tabulated(&light(32, uneven), brushed(), 3));
    for scale in [[0.7; 3], [-0.7, 0.7, 0.7]] {
        let turn = glam::DQuat::from_rotation_x(0.8) * glam::DQuat::from_rotation_z(0.5);
        let at = DVec3::new(0.2, -0.1, 0.1);
        let place = DAffine3::from_scale_rotation_translation(scale.into(), turn, at);
        let there = Arc::new(moved(&mesh, place));
        let mut object = placed(&mesh, place, &look);
        object.transfer = Some(transfer_of(&mesh, 3));
        let scene = Scene { light: Arc::clone(look.light()), objects: vec![object] };
        let expected = Scene::of(Arc::clone(&there), Arc::clone(&look));
        let expected = expected.with_transfer(Some(transfer_of(&there, 3)));
        // Rays from a mesh and from its mirror image meet the same edges by rounding; transfer has the error
        // of its few directions, which do not turn with the mesh.
        for (mode, allowed) in [(Mode::Table, 1e-4), (Mode::Transfer, 0.05), (Mode::ShadowedBruteForce, 0.02)]
        {
            let turn = Rotation::from_yaw_pitch_roll(0.3, -0.4, 0.2);
            let shot = Shot { turn, light_samples: 64, ..shot([40, 40], Show::One(mode)) };
            let difference = render(&scene, &shot).difference(&render(&expected, &shot), 1.0, &shot);
            let error = difference.relative_rms.unwrap();
            assert!(error < allowed, "{mode:?}, {scale:?}: {error}");
        }
    }
}

/// A square of side 2 hangs one above the ground, in an object that is placed and turned, under a light that
/// is turned too: a direction is hidden from a point if its line passes the square.
#[test]
fn a_square_hides_the_directions_that_pass_it() {
    let square = |side: f32, z: f32| {
        let corner = |x: f32, y: f32| [0.5 * side * x, 0.5 * side * y, z];
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        [[a, b, c], [a, c, d]]
    };
    let mesh = soup(&[square(20.0, 0.0), square(2.0, 1.0)].concat());
    let turn = glam::DQuat::from_rotation_y(0.6) * glam::DQuat::from_rotation_z(0.3);
    let place = DAffine3::from_scale_rotation_translation(DVec3::splat(0.5), turn, DVec3::new(0.3, 0.1, 0.0));
    let object = placed(&mesh, place, &plain());
    let turned = Rotation::from_yaw_pitch_roll(0.5, 0.2, -0.3);
    let shot = Shot { turn: turned, ..shot([8, 8], Show::One(Mode::ShadowedBruteForce)) };
    let shadows = Shadows::new(Arc::new(Occluders::of(&mesh)), &object, &shot);
    // From the light's frame to the object's.
    let to_world = turned.matrix();
    let (point, mut hidden) = (DVec3::new(0.4, -0.2, 0.0), 0);
    let up = (to_world.inverse() * (turn * DVec3::Z)).as_vec3();
    let surface = Surface::new(up, up.any_orthogonal_vector(), -up, true);
    let at = shadows.at(&surface, point.as_vec3());
    for k in 0..2000 {
        let direction =
            Direction::from_angles(std::f64::consts::PI * (f64::from(k) * 0.618).fract(), f64::from(k));
        let local = turn.inverse() * (to_world * direction.vector());
        let there = point + local / local.z;
        if local.z.abs() < 1e-3 || (there.x.abs().max(there.y.abs()) - 1.0).abs() < 0.01 {
            continue;
        }
        let expected = local.z > 0.0 && there.x.abs().max(there.y.abs()) < 1.0;
        assert_eq!(!at.sees(direction.vector().as_vec3()), expected, "{local} {there}");
        hidden += u32::from(expected);
    }
    assert!(hidden > 100, "{hidden}");
}

#[test]
fn without_a_table_or_a_transfer_brute_force_takes_their_place() {
    let look = tabulated(&light(16, uneven), lambert(0.5), 2);
    let bare = Look::without_maps(Arc::clone(look.light()), lambert(0.5), look.sizes());
    let scene = |look| Scene::of(sphere(), look);
    let show = |mode| Show::One(mode);
    let table = scene(look);
    assert!(table.offers(Mode::Table) && !table.offers(Mode::Transfer) && !table.offers(Mode::LocalShrm));
    assert_eq!(table.available(show(Mode::Transfer)), show(Mode::ShadowedBruteForce));
    assert_eq!(table.available(show(Mode::Table)), show(Mode::Table));
    assert_eq!(table.available(show(Mode::Cabral)), show(Mode::BruteForce));
    let bare = scene(Arc::new(bare)).with_transfer(Some(transfer_of(&sphere(), 1)));
    assert_eq!(bare.available(show(Mode::Transfer)), show(Mode::ShadowedBruteForce), "it needs a table too");
    assert_eq!(bare.available(show(Mode::Table)), show(Mode::BruteForce));
    let of_another = table.with_transfer(Some(transfer_of(&mesh::shape("plane").unwrap(), 1)));
    assert!(!of_another.offers(Mode::Transfer));
}
