//! The CPU's pictures, compared with what is known without rendering.

mod coverage;
mod lamps;
mod lamps_beside_tables;
mod near_light;
mod parts;
mod pictures;
mod product;
mod surfaces;
mod taps;
mod textures;
mod vertices;

use std::sync::Arc;

use brdf::{Choice, Material, project};
use envmap::{Environment, ToneMap};
use glam::{DAffine3, DVec3};
use mesh::Mesh;
use sh::{Degree, Stop};
use shrm::Reflection;
use sphere::{LatLong, Rotation};

use super::geometry::Geometry;
use super::rasteriser::{Band, Hit};
use crate::{
    Background, Camera, Framing, Light, Look, MapSizes, Mode, Object, Picture, PointSet, RenderError,
    Renderer, Scene, Shot, Show, ViewTransform,
};

/// A light with a given radiance.
fn light(rows: usize, radiance: impl Fn(DVec3) -> [f64; 3]) -> Arc<Light> {
    let grid = LatLong::with_rows(rows);
    let direction = |i: usize| grid.direction(i / grid.width, i % grid.width).vector();
    let pixels = (0..grid.len()).map(|i| radiance(direction(i)).map(|value| value as f32)).collect();
    Arc::new(Light::new(Environment::new(grid, pixels).unwrap(), None))
}

/// A light without symmetry, of degree 4, that is nowhere dark.
fn uneven(w: DVec3) -> [f64; 3] {
    [2.0 + w.x * w.y + 0.3 * w.z, 2.0 + w.y.powi(3) - 0.4 * w.x, 2.5 + w.z * w.x + w.y * w.z.powi(3)]
}

/// The look of a material under a light to degrees (F, P), on faces of 32.
fn look(light: &Arc<Light>, material: &Material, [f, p]: [usize; 2]) -> Arc<Look> {
    let degree = |l| Degree::new(l).unwrap();
    let brdf =
        project(material, Choice::Degree { f: degree(f), p: degree(p) }, Stop::NEVER).unwrap().coefficients;
    let reflection = Reflection::convolve(light.lighting(), &brdf);
    let sizes = MapSizes { edge: 32, slices: 16 };
    Arc::new(Look::new(Arc::clone(light), reflection, Some(material.clone()), sizes))
}

fn lambert(albedo: f64) -> Material {
    Material::Lambert(brdf::Lambert::new([albedo; 3]).unwrap())
}

fn microfacet(sigma: f64) -> Material {
    Material::Microfacet(brdf::Microfacet::new(sigma, [1.0, 0.8, 0.5]).unwrap())
}

/// A white look, for tests in which the look does not matter.
fn plain() -> Arc<Look> {
    look(&light(4, |_| [1.0; 3]), &lambert(1.0), [0, 0])
}

fn sphere() -> Arc<Mesh> {
    Arc::new(mesh::shape("sphere").unwrap())
}

/// A mesh of triangles that share no corners, with all normals up.
fn soup(triangles: &[[[f32; 3]; 3]]) -> Arc<Mesh> {
    let positions: Vec<[f32; 3]> = triangles.concat();
    let count = positions.len();
    let corners = (0..triangles.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let (normals, tangents) = (vec![[0.0, 0.0, 1.0]; count], vec![[1.0, 0.0, 0.0, 1.0]; count]);
    Arc::new(Mesh::new(positions, normals, tangents, None, corners).unwrap())
}

fn placed(mesh: &Arc<Mesh>, place: DAffine3, look: &Arc<Look>) -> Object {
    let (mesh, look) = (Arc::clone(mesh), Arc::clone(look));
    Object { mesh, whole: None, place, look, transfer: None, blend: None }
}

/// A shot of the unit ball from slightly above, with neutral exposure and tone curve.
fn shot(size: [u32; 2], show: Show) -> Shot {
    let framing = Framing::ball(DVec3::ZERO, 1.0);
    Shot {
        size,
        samples: 1,
        camera: Camera { yaw: 0.7, ..Camera::new(framing) },
        turn: Rotation::IDENTITY,
        show,
        background: Background::Environment,
        exposure: 0.0,
        tone: ToneMap::Plain,
        light_samples: 16,
        points: PointSet::Even,
    }
}

fn render(scene: &Scene, shot: &Shot) -> Picture {
    super::Cpu::new().render(scene, shot, Stop::NEVER).unwrap()
}

/// The surface that every sample of a shot hits, row by row.
fn seen(scene: &Scene, shot: &Shot) -> Vec<Option<Hit>> {
    let transform = ViewTransform::new(shot);
    let geometry = Geometry::new(scene, &transform);
    let all: Vec<u32> = (0..geometry.triangles.len() as u32).collect();
    let [width, height] = transform.size;
    let band = Band::new(&geometry, &all, transform.size, 0..height);
    let samples = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
    samples.map(|(column, row)| band.seen(&geometry, &transform, column, row)).collect()
}
