//! What is kept of the objects of a scene between pictures: the radiance of vertices, and what casts shadows.

use std::sync::Arc;

use mesh::Mesh;
use transfer::Occluders;

use super::geometry::VertexRadiance;
use crate::shading::shadows::Shadows;
use crate::vertex_shading::{ShadedMesh, VertexPasses, VertexShading};
use crate::{Mode, RenderError, Scene, Shot};

/// The vertices and the occluders of the objects of a scene.
#[derive(Debug, Default)]
pub(super) struct ObjectCache {
    /// The shaded vertices, by the number of the object, and the mode.
    vertices: Vec<(usize, Mode, VertexShading)>,
    occluders: Vec<(Arc<Mesh>, Arc<Occluders>)>,
    /// The passes of shadings that were dropped.
    dropped: VertexPasses,
}

impl ObjectCache {
    /// Shades the vertices and builds the occluders that a shot needs, and drops what the scene does not use.
    ///
    /// # Errors
    /// If the scene lacks what a mode needs, or a mesh has no frames.
    pub(super) fn update(&mut self, scene: &Scene, shot: &Shot) -> Result<(), RenderError> {
        let is_used = |(number, mode, shading): &(usize, Mode, VertexShading)| {
            let mesh = scene.objects.get(*number).and_then(|object| ShadedMesh::new(object, *mode).ok());
            mesh.is_some_and(|mesh| shading.is_of(&mesh))
        };
        for (.., shading) in self.vertices.extract_if(.., |entry| !is_used(entry)) {
            self.dropped += shading.passes();
        }
        self.occluders.retain(|(mesh, _)| scene.objects.iter().any(|of| Arc::ptr_eq(of.occluder(), mesh)));
        for mode in shot.show.modes() {
            for (number, object) in scene.objects.iter().enumerate() {
                if mode.shades_vertices() {
                    let place = match self.place(number, mode) {
                        Some(place) => place,
                        None => {
                            let shading = VertexShading::new(ShadedMesh::new(object, mode)?)?;
                            self.vertices.push((number, mode, shading));
                            self.vertices.len() - 1
                        }
                    };
                    self.vertices[place].2.update(object, shot);
                }
                if mode == Mode::ShadowedBruteForce && self.occluders(object.occluder()).is_none() {
                    let occluders = Arc::new(Occluders::of(object.occluder()));
                    self.occluders.push((Arc::clone(object.occluder()), occluders));
                }
            }
        }
        Ok(())
    }

    fn place(&self, number: usize, mode: Mode) -> Option<usize> {
        self.vertices.iter().position(|(of, in_mode, _)| (*of, *in_mode) == (number, mode))
    }

    fn occluders(&self, mesh: &Arc<Mesh>) -> Option<&Arc<Occluders>> {
        self.occluders.iter().find(|(of, _)| Arc::ptr_eq(of, mesh)).map(|(_, occluders)| occluders)
    }

    /// The radiance of the vertices of each object in the modes of a shot.
    pub(super) fn radiance(&self, scene: &Scene, shot: &Shot) -> Vec<VertexRadiance<'_>> {
        let of = |number: usize| {
            let mut radiance: VertexRadiance<'_> = [&[], &[]];
            for (radiance, mode) in radiance.iter_mut().zip(shot.show.modes()) {
                if let Some(place) = self.place(number, mode) {
                    *radiance = self.vertices[place].2.radiance();
                }
            }
            radiance
        };
        (0..scene.objects.len()).map(of).collect()
    }

    /// The shadows of each object on itself, if a mode of the shot has any.
    pub(super) fn shadows(&self, scene: &Scene, shot: &Shot) -> Vec<Option<Shadows>> {
        let objects = scene.objects.iter();
        let of = objects.map(|object| {
            let occluders = self.occluders(object.occluder())?;
            Some(Shadows::new(Arc::clone(occluders), object, shot))
        });
        of.collect()
    }

    /// The number of times that vertices were shaded.
    pub(super) fn passes(&self) -> VertexPasses {
        let mut passes = self.dropped;
        self.vertices.iter().for_each(|(.., shading)| passes += shading.passes());
        passes
    }
}
