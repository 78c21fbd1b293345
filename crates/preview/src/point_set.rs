//! The points of the unit square from which samples are made.

use serde::{Deserialize, Serialize};

/// The points of the unit square from which brute force and the diagram of samples make directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PointSet {
    /// Points that fill the square evenly: Roberts' R2 with another shift at each sample of a pixel, in the
    /// diagram the Sobol sequence with Owen's scrambling.
    #[default]
    Even,
    /// Independent points, others at each sample of a pixel.
    Random,
}

impl PointSet {
    /// Every set, in the order of lists.
    pub const ALL: [Self; 2] = [Self::Even, Self::Random];

    /// The set's name in manifests.
    pub fn name(self) -> &'static str {
        match self {
            Self::Even => "even",
            Self::Random => "random",
        }
    }
}
