//! rho_hat toward one view.

use sphere::Direction;

use crate::SurfaceView;

/// rho_hat toward one view of light from many directions. It may be filled again for another view.
#[derive(Clone, Debug, Default)]
pub struct ViewValues {
    values: Vec<[f64; 3]>,
    /// The directions in the frame of the surface.
    incident: Vec<Direction>,
}

impl ViewValues {
    /// Fills this with the value of each incident direction, which are in the frame of the central direction.
    /// `rho_hats` computes the values toward a view of some directions in the frame of the surface. Values of
    /// light from below the horizon are 0 if the material has one, and are not asked for.
    pub fn fill(
        &mut self,
        view: &SurfaceView,
        incident: &[Direction],
        has_horizon: bool,
        rho_hats: impl Fn(Direction, &[Direction], &mut [[f64; 3]]),
    ) {
        self.incident.clear();
        self.incident.extend(incident.iter().map(|incident| view.incident_unnormalised(*incident)));
        self.values.clear();
        self.values.resize(incident.len(), [0.0; 3]);
        let is_seen = |incident: &Direction| !has_horizon || incident.vector().z > 0.0;
        let mut rest = &mut self.values[..];
        for run in self.incident.chunk_by(|a, b| is_seen(a) == is_seen(b)) {
            let (values, after) = rest.split_at_mut(run.len());
            rest = after;
            if is_seen(&run[0]) {
                rho_hats(view.outgoing(), run, values);
            }
        }
    }

    /// The value of each incident direction.
    pub fn values(&self) -> &[[f64; 3]] {
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Centre, Material};

    /// For every model, some of which reflect light from below the horizon; and filled again.
    #[test]
    fn the_values_are_those_of_each_direction() {
        let mut found = ViewValues::default();
        for material in Material::examples().unwrap() {
            for centre in [Centre::Normal, Centre::Reflection, material.centre()] {
                // Light on two circles, which go below the horizon and come back.
                let view = centre.toward(Direction::from_angles(0.7, 0.3));
                let incident = [0.4, 1.3].into_iter().flat_map(|theta| {
                    (0..20).map(move |j| Direction::from_angles(theta, 0.1 + 0.3 * f64::from(j)))
                });
                let incident: Vec<_> = incident.collect();
                found.fill(&view, &incident, material.has_horizon(), |outgoing, incident, values| {
                    material.rho_hats_toward(outgoing, incident, values);
                });
                assert_eq!(found.values().len(), incident.len());
                for (found, incident) in found.values().iter().zip(&incident) {
                    let expected = material.rho_hat(view.incident(*incident), view.outgoing());
                    for (a, b) in found.iter().zip(expected) {
                        assert!((a - b).abs() <= 1e-12 * (1.0 + b), "{}: {a} {b}", material.name());
                    }
                }
            }
        }
    }
}
