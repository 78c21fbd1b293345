//! What is kept of the objects of a scene between pictures: the light at vertices, and what casts shadows.

use std::sync::Arc;

use mesh::Mesh;
use transfer::Occluders;

use crate::shading::shadows::Shadows;
use crate::vertex_light::{ShadedMesh, VertexLight};
use crate::{Mode, RenderError, Scene, Shot};

/// The vertices and the occluders of the objects of a scene.
#[derive(Debug, Default)]
pub(super) struct ObjectCache {
    /// The light at the vertices, by the number of the object, and the mode.
    lights: Vec<(usize, Mode, VertexLight)>,
    occluders: Vec<(Arc<Mesh>, Arc<Occluders>)>,
    /// The passes of those that were dropped.
    dropped: u32,
}

impl ObjectCache {
    /// Brings the light to the vertices and builds the occluders that a shot needs, and drops what the scene
    /// does not use.
    ///
    /// # Errors
    /// If the scene lacks what a mode needs, or a mesh has no frames.
    pub(super) fn update(&mut self, scene: &Scene, shot: &Shot) -> Result<(), RenderError> {
        let is_used = |(number, mode, light): &(usize, Mode, VertexLight)| {
            let mesh = scene.objects.get(*number).and_then(|object| ShadedMesh::new(object, *mode).ok());
            mesh.is_some_and(|mesh| light.is_of(&mesh))
        };
        for (.., light) in self.lights.extract_if(.., |entry| !is_used(entry)) {
            self.dropped += light.passes();
        }
        self.occluders.retain(|(mesh, _)| scene.objects.iter().any(|of| Arc::ptr_eq(of.occluder(), mesh)));
        for mode in shot.show.modes() {
            for (number, object) in scene.objects.iter().enumerate() {
                if mode.looks_up_table() {
                    let place = match self.place(number, mode) {
                        Some(place) => place,
                        None => {
                            let light = VertexLight::new(ShadedMesh::new(object, mode)?)?;
                            self.lights.push((number, mode, light));
                            self.lights.len() - 1
                        }
                    };
                    self.lights[place].2.update(object, shot);
                }
                let lamps = || mode == Mode::Transfer && object.look.beside_table().is_some();
                if (mode == Mode::ShadowedBruteForce || lamps())
                    && self.occluders(object.occluder()).is_none()
                {
                    let occluders = Arc::new(Occluders::of(object.occluder()));
                    self.occluders.push((Arc::clone(object.occluder()), occluders));
                }
            }
        }
        Ok(())
    }

    fn place(&self, number: usize, mode: Mode) -> Option<usize> {
        self.lights.iter().position(|(of, in_mode, _)| (*of, *in_mode) == (number, mode))
    }

    fn occluders(&self, mesh: &Arc<Mesh>) -> Option<&Arc<Occluders>> {
        self.occluders.iter().find(|(of, _)| Arc::ptr_eq(of, mesh)).map(|(_, occluders)| occluders)
    }

    /// The light at the vertices of each object in a mode, if the mode looks up a table.
    pub(super) fn lights(&self, scene: &Scene, mode: Mode) -> Vec<Option<&VertexLight>> {
        let of = |number: usize| self.place(number, mode).map(|place| &self.lights[place].2);
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

    /// The number of times that a light was brought to vertices.
    pub(super) fn passes(&self) -> u32 {
        self.dropped + self.lights.iter().map(|(.., light)| light.passes()).sum::<u32>()
    }
}
