//! The light of probes at the places of a mesh.

use containers::tensors::Probes;
use engine::Failure;
use preview::LightAtPlaces;
use sh::{Degree, Expansion};
use sphere::DVec3;

/// Probes that light a mesh.
#[derive(Debug)]
pub(super) struct ProbesAtPlaces(Probes);

impl ProbesAtPlaces {
    /// The light between probes.
    ///
    /// # Errors
    /// If all of them stand at points.
    pub(super) fn new(probes: Probes) -> Result<Self, Failure> {
        if probes.places.volumes().is_empty() {
            return Err(Failure::new("the probes stand at points, between which light is not blended")
                .help("place them in a box: leave out `points` of place-probes, or add `boxes`"));
        }
        Ok(Self(probes))
    }
}

impl LightAtPlaces for ProbesAtPlaces {
    fn degree(&self) -> Degree {
        Degree::new(2).unwrap_or(Degree::ZERO)
    }

    fn at(&self, place: DVec3, normal: DVec3) -> Expansion {
        let [place, normal] = [place, normal].map(|v| v.as_vec3().to_array());
        let rows = self.0.light.light_at(&self.0.places, place, normal).unwrap_or_default();
        let mut light = Expansion::zero(self.degree());
        for (sum, row) in light.coefficients_mut().iter_mut().zip(rows) {
            *sum = row.map(f64::from);
        }
        light
    }
}
