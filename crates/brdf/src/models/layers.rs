//! `layers`: several materials, one over the other: their rho_hat are summed.
//!
//! Nothing is absorbed on the way from one layer to the next: the weights of the layers say how much each reflects, and a
//! sum of albedos above 1 makes light. Layers of one centre keep it. A layer about the normal (lambert, oren-nayar)
//! beside one about the reflection vector is taken about that, which costs it degrees and changes no value. A layer
//! about the tangent beside others has no common centre: its rho_hat depends on where the tangent lies.

use sphere::Direction;

use super::{Lobe, Material};
use crate::Centre;

/// Why materials are no layers of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayersError {
    /// There is none.
    #[error("there is no layer; expected one or more")]
    None,
    /// One is taken about the tangent, another is not.
    #[error(
        "{tangent} is taken about the tangent and {other} is not: they have no common centre; expected layers of {tangent} \
         alone, or none"
    )]
    Centres {
        /// The model about the tangent.
        tangent: &'static str,
        /// One that is not.
        other: &'static str,
    },
}

impl Material {
    /// The sum of several materials.
    ///
    /// # Errors
    /// Where there is none, or one is taken about the tangent and another is not.
    pub fn layers(layers: Vec<Self>) -> Result<Self, LayersError> {
        let (tangent, others): (Vec<_>, Vec<_>) =
            layers.iter().partition(|layer| layer.centre() == Centre::Tangent);
        match (tangent.first(), others.first()) {
            (None, None) => Err(LayersError::None),
            (Some(tangent), Some(other)) => {
                Err(LayersError::Centres { tangent: tangent.name(), other: other.name() })
            }
            _ => Ok(Self::Layers(layers)),
        }
    }

    /// The layers in order, including those of layers; a material that is no sum is the only one.
    pub fn leaves(&self) -> Vec<&Self> {
        match self {
            Self::Layers(layers) => layers.iter().flat_map(Self::leaves).collect(),
            leaf => vec![leaf],
        }
    }
}

/// The lobes of all layers, each once.
pub(super) fn lobes(layers: &[Material]) -> Vec<Lobe> {
    let mut lobes = Vec::new();
    for lobe in layers.iter().flat_map(Material::lobes) {
        if !lobes.contains(&lobe) {
            lobes.push(lobe);
        }
    }
    lobes
}

/// The common centre; the reflection vector where there is none.
pub(super) fn centre(layers: &[Material]) -> Centre {
    // Each is asked once: asking twice would double with every layer in a layer.
    let mut centres = layers.iter().map(Material::centre);
    let first = centres.next().unwrap_or(Centre::Normal);
    if centres.all(|centre| centre == first) { first } else { Centre::Reflection }
}

pub(super) fn rho_hat(layers: &[Material], incident: Direction, outgoing: Direction) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for layer in layers {
        let value = layer.rho_hat(incident, outgoing);
        (0..3).for_each(|channel| sum[channel] += value[channel]);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{KajiyaKay, Lambert, Phong};

    fn lambert() -> Material {
        Material::Lambert(Lambert::new([0.5, 0.25, 0.0]).unwrap())
    }

    fn phong() -> Material {
        Material::Phong(Phong::new(4.0, [0.5; 3]).unwrap())
    }

    fn hair() -> Material {
        Material::KajiyaKay(KajiyaKay::new(4.0, [0.5; 3]).unwrap())
    }

    #[test]
    fn one_common_centre_is_kept() {
        let centre = |layers| Material::layers(layers).unwrap().centre();
        assert_eq!(centre(vec![lambert(), lambert()]), Centre::Normal);
        assert_eq!(centre(vec![phong(), phong()]), Centre::Reflection);
        assert_eq!(centre(vec![hair(), hair()]), Centre::Tangent);
        assert_eq!(centre(vec![lambert(), phong()]), Centre::Reflection);
        let nested = Material::layers(vec![lambert(), lambert()]).unwrap();
        assert_eq!(centre(vec![nested, lambert()]), Centre::Normal);
    }

    /// The work is one visit a layer: with two, 64 of them one in the other would take longer than anyone waits.
    #[test]
    fn layers_in_layers_cost_no_more_than_their_number() {
        let deep = (0..64).fold(lambert(), |layer, _| Material::layers(vec![layer]).unwrap());
        assert_eq!((deep.centre(), deep.is_isotropic()), (Centre::Normal, true));
    }

    #[test]
    fn layers_without_a_common_centre_are_an_error() {
        let error = Material::layers(vec![phong(), hair()]).unwrap_err();
        assert_eq!(error, LayersError::Centres { tangent: "kajiya-kay", other: "phong" });
        assert_eq!(Material::layers(Vec::new()), Err(LayersError::None));
    }

    /// Whatever they are taken about, a light and a view in the world see the same value.
    #[test]
    fn layers_are_summed_in_the_frame_of_the_surface() {
        let both = Material::layers(vec![lambert(), phong()]).unwrap();
        for i in 0..40 {
            let i = f64::from(i);
            let incident = Direction::from_angles((i * 0.618).fract() * 3.0, i);
            let outgoing = Direction::from_angles((i * 0.414).fract() * 1.5, 2.0 * i);
            let parts = [lambert(), phong()].map(|layer| layer.rho_hat(incident, outgoing));
            let sum = [0, 1, 2].map(|channel| parts[0][channel] + parts[1][channel]);
            assert_eq!(both.rho_hat(incident, outgoing), sum);
        }
        assert_eq!(Material::Layers(Vec::new()).rho_hat(Direction::Z, Direction::Z), [0.0; 3]);
    }
}
