//! The values on the edges of the graph, and the containers that hold their bytes.
//!
//! | type | value | bytes |
//! | --- | --- | --- |
//! | `environment` | [`envmap::Environment`] | safetensors: `rows`, blocks of rows that are compressed without loss |
//! | `lighting` | [`sh::Lighting`] | safetensors: `sh` [(F+1)^2, 3] f64, `lights` [n, 7] f64 |
//! | `light-field` | [`transfer::LightField`] | safetensors: `points` [P, 3], `sh` [P, (F+1)^2, 3] f64 |
//! | `material` | [`brdf::Material`], [`brdf::BaseColorTexture`] | safetensors: models as JSON in the metadata, `table0` ... [n_h, n_d, n_phi, 3] f32, and with a texture `base_color` [height, width, 3] u8 |
//! | `brdf` | [`brdf::BrdfCoefficients`], [`brdf::Material`] | safetensors: `rho` [F+1, P+1, P+1, 3] f64, and that of its parts; the material as above |
//! | `brdf-table` | [`brdf::BrdfTable`] | safetensors: `c` [Q, N, N, (F+1)^2, channels] f32 |
//! | `reflection` | [`shrm::Reflection`] | safetensors: `sh` and `rho`, and those of its parts; with lamps `lights` and the material |
//! | `shrm` | [`shrm::Shrm`] | safetensors: `shrm` [faces, height, width, (P+1)^2, 3] f32 |
//! | `prefiltered` | [`shrm::Prefiltered`] | safetensors: `sh` as above, `level0` [6, edge, edge, 3] f32, `level1` ... |
//! | `scale-space` | [`taps::ScaleSpace`], [`taps::LightPoints`] | safetensors: `level_00` [6, edge, edge, 3] f32, ..., `normal_0` ..., `points` [p, 6] f32 |
//! | `taps` | [`taps::TapTable`], [`brdf::Material`] | safetensors: `taps` [65, J, 5] and `normals` [65, K, 4] f64; the material as above |
//! | `transfer` | [`transfer::StoredTransfer`] and its mesh's digest | safetensors: `transfer` [V, (O+1)^2, (F+1)^2] f16, or another form |
//! | `vertex-radiance` | the radiance of vertices and their mesh's digest | safetensors: `radiance` [V, 3] f32 |
//! | `vertex-blend` | one number from 0 to 1 for each vertex, or two, and their mesh's digest | safetensors: `blend` \[V\] or \[V, 2\] f32 |
//! | `scene` | [`probes::Scene`] or a part of it, and the digest of its surfaces | safetensors: `triangles` [T, 3, 3] f32, ..., `texture0` [height, width, 4] u16, ...; materials, lamps and boxes as JSON in the metadata |
//! | `probe-places` | [`probes::ProbePlaces`] and the digest of its scene's triangles | safetensors: `positions` [P, 3] f32, `repairs` \[P\] u8, ... |
//! | `probe-transport` | [`probes::Transport`], its places and bricks, and their and the surfaces' digests | safetensors: `sky` [P, (F+1)^2, (O+1)^2, 1 or 3], `direct` and `indirect` [P, E, (F+1)^2, 3], f16 or f32, the places, and what the bricks were made from |
//! | `probe-lamps` | [`probes::LampColumns`] of each lamp, and the digests of places and surfaces | safetensors: `direct` and `indirect` [L, P, (F+1)^2, 3] f32 |
//! | `probes` | [`probes::LitProbes`] and their places | safetensors: `sh` [P, 9, 3] f32, and the places |
//! | `mesh` | [`mesh::Mesh`] | safetensors: `positions` [V, 3], `normals` [V, 3], `tangents` [V, 4], `coordinates` [V, 2] f32, `triangles` [T, 3] and, with materials, `ranges` [R, 2] u32 |
//!
//! The bytes do not hold the origin of a value, so equal values have equal bytes.

use std::sync::Arc;

use brdf::BaseColorTexture;
use containers::tensors;
use engine::{Artifact, Digest, Failure, Output};

/// Distant light as a lat-long image.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment(pub envmap::Environment);

impl Artifact for Environment {
    const TYPE: &'static str = "environment";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_environment_rows(&self.0))
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_environment(bytes)?))
    }
}

/// Distant light as spherical-harmonic coefficients, and the lights beside them.
#[derive(Clone, Debug, PartialEq)]
pub struct Lighting(pub sh::Lighting);

impl Artifact for Lighting {
    const TYPE: &'static str = "lighting";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_lighting(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_lighting(bytes)?))
    }
}

/// Light at points, between which it is blended.
#[derive(Clone, Debug, PartialEq)]
pub struct LightField(pub transfer::LightField);

impl Artifact for LightField {
    const TYPE: &'static str = "light-field";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_light_field(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_light_field(bytes)?))
    }
}

/// A reflection model and its parameters, a measured table, or several of them.
///
/// The bytes may hold the picture of its base colour, too, which only previews show: [`Material::texture`].
#[derive(Clone, Debug, PartialEq)]
pub struct Material(pub brdf::Material);

impl Material {
    /// The output of a stage that makes a material with the picture of its base colour, if it has one.
    ///
    /// # Errors
    /// If it cannot be encoded.
    pub fn output_with_texture(self, texture: Option<&BaseColorTexture>) -> Result<Output, Failure> {
        let bytes = tensors::encode_textured_material(&self.0, texture, None)?;
        Ok(Output::Artifact { bytes, value: Arc::new(self) })
    }

    /// The picture of the base colour in the bytes of a material, if they hold one.
    ///
    /// # Errors
    /// If they are not those of a material.
    pub fn texture(bytes: &[u8]) -> Result<Option<Arc<BaseColorTexture>>, Failure> {
        Ok(tensors::decode_textured_material(bytes)?.1.map(Arc::new))
    }
}

impl Artifact for Material {
    const TYPE: &'static str = "material";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_material(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_material(bytes)?))
    }
}

/// The coefficients of a material's rho_hat: its BRDF with the cosine.
#[derive(Clone, Debug, PartialEq)]
pub struct Brdf(pub tensors::Brdf);

impl From<brdf::BrdfCoefficients> for Brdf {
    /// Coefficients of fixed degrees, of a material that is not known.
    fn from(coefficients: brdf::BrdfCoefficients) -> Self {
        let degrees = tensors::DegreeSource::Named;
        Self(tensors::Brdf { coefficients, material: None, degrees, parts: None })
    }
}

impl Artifact for Brdf {
    const TYPE: &'static str = "brdf";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_brdf(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_brdf(bytes)?))
    }
}

/// The coefficients of a material's rho_hat for every view.
#[derive(Clone, Debug, PartialEq)]
pub struct BrdfTable(pub brdf::BrdfTable);

impl Artifact for BrdfTable {
    const TYPE: &'static str = "brdf-table";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_brdf_table(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_brdf_table(bytes)?))
    }
}

/// A reflected light field.
#[derive(Clone, Debug, PartialEq)]
pub struct Reflection(pub shrm::Reflection);

impl Artifact for Reflection {
    const TYPE: &'static str = "reflection";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_reflection(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_reflection(bytes)?))
    }
}

/// A spherical harmonic reflection map.
#[derive(Clone, Debug, PartialEq)]
pub struct Shrm(pub shrm::Shrm);

impl Artifact for Shrm {
    const TYPE: &'static str = "shrm";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_shrm(&self.0, &[], None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_shrm(bytes)?))
    }
}

/// An environment prefiltered for several roughnesses.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefiltered(pub shrm::Prefiltered);

impl Artifact for Prefiltered {
    const TYPE: &'static str = "prefiltered";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_prefiltered(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_prefiltered(bytes)?))
    }
}

/// An environment, blurred by Gaussians of many widths, and as points.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleSpace(pub tensors::EnvironmentScales);

impl Artifact for ScaleSpace {
    const TYPE: &'static str = "scale-space";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_scale_space(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_scale_space(bytes)?))
    }
}

/// The look-ups by which a material reads a scale space.
#[derive(Clone, Debug, PartialEq)]
pub struct Taps(pub tensors::MaterialTaps);

impl Artifact for Taps {
    const TYPE: &'static str = "taps";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_taps(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_taps(bytes)?))
    }
}

/// Triangles with normals and tangents.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh(pub mesh::Mesh);

impl Artifact for Mesh {
    const TYPE: &'static str = "mesh";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_mesh(&self.0, None))
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_mesh(bytes)?))
    }
}

/// The transfer of each vertex of a mesh, in one of its forms.
#[derive(Clone, Debug, PartialEq)]
pub struct Transfer(pub tensors::OfMesh<transfer::StoredTransfer>);

impl Artifact for Transfer {
    const TYPE: &'static str = "transfer";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_transfer(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_transfer(bytes)?))
    }
}

/// The radiance of each vertex of a mesh, toward a viewer; signed.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexRadiance(pub tensors::OfMesh<Vec<[f32; 3]>>);

impl Artifact for VertexRadiance {
    const TYPE: &'static str = "vertex-radiance";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_vertex_radiance(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_vertex_radiance(bytes)?))
    }
}

/// Two numbers for each vertex of a mesh, from 0, the first material of a table, to 1, the last: one along
/// each parameter of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexBlend(pub tensors::OfMesh<Vec<[f32; 2]>>);

impl Artifact for VertexBlend {
    const TYPE: &'static str = "vertex-blend";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_vertex_blend(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_vertex_blend(bytes)?))
    }
}

/// A scene as light sees it, or a part of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene(pub tensors::StoredScene);

impl Scene {
    /// The digest of the triangles, which all parts of a scene have.
    pub fn triangles_digest(&self) -> String {
        let numbers = self.0.scene.parts().triangles.as_flattened().as_flattened();
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        Digest::of(&bytes).to_string()
    }
}

impl Artifact for Scene {
    const TYPE: &'static str = "scene";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_scene(&self.0, None))
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_scene(bytes)?))
    }
}

/// Where light probes stand, what they see of each other, and [`Scene::triangles_digest`] of the scene in
/// which they were placed.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbePlaces(pub probes::ProbePlaces, pub String);

impl ProbePlaces {
    /// An error if the probes were placed in another scene.
    ///
    /// # Errors
    /// If its triangles are others.
    pub fn check(&self, scene: &Scene) -> Result<(), Failure> {
        if self.1 == scene.triangles_digest() {
            return Ok(());
        }
        Err(Failure::new("the probes were placed in a scene with other triangles than that at port scene")
            .help("connect the scene of place-probes, or another part of the same stage of import-scene"))
    }
}

impl Artifact for ProbePlaces {
    const TYPE: &'static str = "probe-places";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_probe_places(&self.0, &self.1, None))
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        let (places, triangles) = tensors::decode_probe_places(bytes)?;
        Ok(Self(places, triangles))
    }
}

/// The transport from the sky and from emissive materials to probes.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeTransport(pub tensors::ProbeTransport);

impl Artifact for ProbeTransport {
    const TYPE: &'static str = "probe-transport";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_probe_transport(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_probe_transport(bytes)?))
    }
}

/// The transport from lamps to probes.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeLamps(pub tensors::ProbeLamps);

impl Artifact for ProbeLamps {
    const TYPE: &'static str = "probe-lamps";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_probe_lamps(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_probe_lamps(bytes)?))
    }
}

/// Light probes: their places, and the light at each.
#[derive(Clone, Debug, PartialEq)]
pub struct Probes(pub tensors::Probes);

impl Artifact for Probes {
    const TYPE: &'static str = "probes";

    fn encode(&self) -> Result<Vec<u8>, Failure> {
        Ok(tensors::encode_probes(&self.0, None)?)
    }

    fn decode(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(Self(tensors::decode_probes(bytes)?))
    }
}
