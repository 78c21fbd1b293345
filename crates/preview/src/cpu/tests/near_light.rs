//! BRDF tables under light that differs from vertex to vertex.

use sh::{Expansion, rotate};
use sphere::Direction;
use transfer::{FixedLight, Frames, LightField, Viewer};

use super::vertices::{brushed, knot, tabulated, transfer_of};
use super::*;
use crate::LightAtPlaces;
use crate::vertex_light::{MeshLight, ShadedMesh, VertexLight};

const L: usize = 4;

/// Two lights beside each other, and one above.
fn field() -> LightField {
    let degree = Degree::new(L).unwrap();
    let window = |x: f64, y: f64, rgb: [f64; 3]| {
        let toward = Direction::normalised(DVec3::new(x, y, 0.4));
        sh::Light { direction: toward, radius: 0.6, irradiance: rgb }.series(degree)
    };
    let lights = vec![
        window(1.0, 1.0, [4.0, 1.0, 0.5]),
        window(1.0, -1.0, [0.5, 1.0, 4.0]),
        window(0.1, 0.2, [1.0, 3.0, 1.0]),
    ];
    LightField::new(vec![[0.3, 1.2, 0.1], [0.3, -1.2, 0.0], [0.0, 0.1, 1.5]], lights).unwrap()
}

/// A mesh of brushed metal under a field.
fn scene(field: LightField) -> Scene {
    let look = tabulated(&light(8, uneven), brushed(), L);
    let sizes = MapSizes { edge: 8, slices: 4 };
    let look = Look::without_maps(Arc::clone(look.light()), brushed(), sizes)
        .with_table(look.table().cloned())
        .with_light_field(Some(Arc::new(field)));
    let mesh = knot();
    let transfer = transfer_of(&mesh, L);
    Scene::of(mesh, Arc::new(look)).with_transfer(Some(transfer))
}

/// At a vertex, a triangle has the vertex' own light and view. The oracle blends the radiance that the kernel
/// has under the light of each point.
#[test]
fn each_vertex_has_the_light_of_its_own_place() {
    let (field, shot) = (field(), shot([8, 8], Show::One(Mode::Table)));
    let scene = scene(field.clone());
    let object = &scene.objects[0];
    let (mesh, table) = (&object.mesh, object.look.table().unwrap());
    let frames = Frames::of(mesh).unwrap();
    let viewer = Viewer::At(shot.camera.eye().to_array());
    let transfer = object.transfer.as_ref().unwrap();
    let mut arriving = vec![[0.0; 3]; frames.len()];
    for (k, light) in field.lights().iter().enumerate() {
        let own = FixedLight::with_transfer(transfer, light).shade(&frames, table, viewer);
        for (vertex, (sum, own)) in arriving.iter_mut().zip(own).enumerate() {
            let weight = field.weights(frames.positions()[vertex].map(f64::from)).nth(k).unwrap() as f32;
            (0..3).for_each(|channel| sum[channel] += weight * own[channel]);
        }
    }
    for (mode, expected) in [(Mode::Table, field.shade(&frames, table, viewer)), (Mode::Transfer, arriving)] {
        let mut lit = VertexLight::new(ShadedMesh::new(object, mode).unwrap()).unwrap();
        lit.update(object, &shot);
        let largest = expected.as_flattened().iter().fold(0.0_f32, |most, value| most.max(value.abs()));
        let mut apart: f32 = 0.0;
        for (number, corners) in mesh.triangles().iter().enumerate() {
            let vertex = corners[0] as usize;
            let found = lit.radiance(number, frames.positions()[vertex].into()).to_array();
            (0..3).for_each(|k| apart = apart.max((found[k] - expected[vertex][k]).abs()));
        }
        assert!(largest > 0.1 && apart < 1e-4 * largest, "{mode:?}: {apart} of {largest}");
    }
}

/// The light of a field, by places alone.
#[derive(Debug)]
struct ByPlace(LightField);

impl LightAtPlaces for ByPlace {
    fn degree(&self) -> Degree {
        self.0.degree()
    }

    fn at(&self, place: DVec3, _: DVec3) -> Expansion {
        self.0.at(place.to_array())
    }
}

/// Light at places is that of the field from which it is, wherever the object is, however light and object
/// are turned, and in a mirror image.
#[test]
fn light_at_places_is_that_of_the_field_there() {
    let plain = scene(field());
    let look = &plain.objects[0].look;
    let sizes = MapSizes { edge: 8, slices: 4 };
    let by_place = Look::without_maps(Arc::clone(look.light()), brushed(), sizes)
        .with_table(look.table().cloned())
        .with_light_at_places(Some(Arc::new(ByPlace(field()))));
    let by_place = Arc::new(by_place);
    let turn = Rotation::from_yaw_pitch_roll(0.7, -0.3, 0.2);
    for mode in [Mode::Table, Mode::Transfer] {
        let object = |look: &Arc<Look>| {
            let place = DAffine3::from_scale_rotation_translation(
                DVec3::new(-0.7, 0.7, 0.7),
                glam::DQuat::from_rotation_x(0.8),
                DVec3::new(0.2, -0.1, 0.1),
            );
            let mut object = placed(&plain.objects[0].mesh, place, look);
            object.transfer = plain.objects[0].transfer.clone();
            Scene { light: Arc::clone(look.light()), objects: vec![object] }
        };
        let shot = Shot { turn, ..shot([30, 30], Show::One(mode)) };
        let [found, expected] = [&by_place, look].map(|look| render(&object(look), &shot));
        let pairs = found.radiance.as_flattened().iter().zip(expected.radiance.as_flattened());
        let apart = pairs.map(|(one, other)| (one - other).abs()).fold(0.0, f32::max);
        assert!(apart < 1e-4, "{mode:?}: {apart}");
    }
}

/// The normals of places are those of the surface, in the coordinates of the light, also if an object is
/// stretched or turned.
#[test]
fn places_have_the_normals_of_the_surface() {
    #[derive(Debug)]
    struct Seen(std::sync::Mutex<Vec<[DVec3; 2]>>);
    impl LightAtPlaces for Seen {
        fn degree(&self) -> Degree {
            Degree::ZERO
        }

        fn at(&self, place: DVec3, normal: DVec3) -> Expansion {
            self.0.lock().unwrap().push([place, normal]);
            Expansion::zero(Degree::ZERO)
        }
    }
    let seen = Arc::new(Seen(Default::default()));
    let look = scene(field()).objects[0].look.clone();
    let sizes = MapSizes { edge: 8, slices: 4 };
    let look = Look::without_maps(Arc::clone(look.light()), brushed(), sizes)
        .with_table(look.table().cloned())
        .with_light_at_places(Some(Arc::clone(&seen) as Arc<dyn LightAtPlaces>));
    let (quarter, centre) = (glam::DQuat::from_rotation_z(0.5), DVec3::new(3.0, 1.0, 2.0));
    let place = DAffine3::from_scale_rotation_translation(DVec3::splat(2.0), quarter, centre);
    let mesh = sphere();
    let radius = mesh.positions()[0].map(f64::from);
    let radius = DVec3::from(radius).length();
    let object = placed(&mesh, place, &Arc::new(look));
    let turn = Rotation::from_yaw_pitch_roll(0.4, 0.1, 0.0);
    let shot = Shot { turn, ..shot([8, 8], Show::One(Mode::Table)) };
    VertexLight::new(ShadedMesh::new(&object, Mode::Table).unwrap()).unwrap().update(&object, &shot);
    let seen = seen.0.lock().unwrap();
    assert_eq!(seen.len(), mesh.positions().len());
    for [place, normal] in seen.iter() {
        // The ball around the turned centre.
        let centre = turn.inverse().matrix() * centre;
        let expected = (*place - centre) / (2.0 * radius);
        assert!((expected - *normal).length() < 1e-5, "{expected} {normal}");
    }
}

/// The field turns about the origin as the surroundings do that it was measured in.
#[test]
fn a_turned_field_is_that_of_turned_points_and_lights() {
    let turn = Rotation::from_yaw_pitch_roll(0.7, -0.3, 0.2);
    let field = field();
    let points = field.points().iter().map(|point| (turn.matrix() * DVec3::from(*point)).to_array());
    let lights = field.lights().iter().map(|light| rotate(light, turn));
    let turned = LightField::new(points.collect(), lights.collect()).unwrap();
    for mode in [Mode::Table, Mode::Transfer] {
        let still = shot([30, 30], Show::One(mode));
        let found = render(&scene(field.clone()), &Shot { turn, ..still.clone() });
        let expected = render(&scene(turned.clone()), &still);
        // The background turns too.
        let pairs = found.radiance.iter().zip(&expected.radiance).filter(|(pixel, _)| pixel[3] == 1.0);
        let apart = pairs.flat_map(|(one, other)| [0, 1, 2].map(|k| (one[k] - other[k]).abs()));
        let apart = apart.fold(0.0, f32::max);
        assert!(apart < 1e-4, "{mode:?}: {apart}");
    }
}

/// A single point has the same light everywhere, and points are in the coordinates of the scene, whatever the
/// place of the object in it.
#[test]
fn one_point_is_a_distant_light() {
    let degree = Degree::new(L).unwrap();
    let light = Arc::new(Light::new(light(16, uneven).environment().clone(), None));
    let series = light.lighting().to_degree(degree);
    let one = LightField::new(vec![[5.0, 1.0, 2.0]], vec![series]).unwrap();
    let near = scene(one);
    let look = tabulated(&light, brushed(), L);
    for mode in [Mode::Table, Mode::Transfer] {
        let object = |look: &Arc<Look>| {
            let turn = glam::DQuat::from_rotation_x(0.8);
            let place = DAffine3::from_scale_rotation_translation(
                DVec3::new(-0.7, 0.7, 0.7),
                turn,
                DVec3::new(0.2, -0.1, 0.1),
            );
            let mut object = placed(&near.objects[0].mesh, place, look);
            object.transfer = near.objects[0].transfer.clone();
            Scene { light: Arc::clone(&light), objects: vec![object] }
        };
        let turn = Rotation::from_yaw_pitch_roll(0.3, -0.4, 0.2);
        let shot = Shot { turn, ..shot([30, 30], Show::One(mode)) };
        let [found, expected] = [&near.objects[0].look, &look].map(|look| render(&object(look), &shot));
        let pairs = found.radiance.as_flattened().iter().zip(expected.radiance.as_flattened());
        let apart = pairs.map(|(one, other)| (one - other).abs()).fold(0.0, f32::max);
        assert!(apart < 1e-5, "{mode:?}: {apart}");
    }
}

/// The light of a placed object is that of its place: the field is not moved with it.
#[test]
fn an_object_takes_the_light_of_where_it_is() {
    let look = scene(field());
    let (mesh, look) = (sphere(), &look.objects[0].look);
    let small = |y: f64| {
        let place = DAffine3::from_scale_rotation_translation(
            DVec3::splat(0.01),
            glam::DQuat::IDENTITY,
            DVec3::new(0.3, y, 0.1),
        );
        let object = placed(&mesh, place, look);
        let shot = shot([8, 8], Show::One(Mode::Table));
        match ShadedMesh::new(&object, Mode::Table).unwrap().view(&object, &shot).light {
            MeshLight::Near(field) => field.at([0.0; 3]),
            MeshLight::Distant(_) | MeshLight::AtPlaces(_) => panic!("a field"),
        }
    };
    for y in [1.2, -0.4] {
        let expected: Expansion = field().at([0.3, y, 0.1]);
        for (found, expected) in small(y).coefficients().iter().zip(expected.coefficients()) {
            (0..3).for_each(|k| assert!((found[k] - expected[k]).abs() < 1e-9, "{found:?} {expected:?}"));
        }
    }
}
