//! What is exported: the light of volumes and of points, and the checks that all presets share.

use engine::Failure;
use probes::{ProbePlaces, Volume};

use super::axes::Rows;

/// The largest half.
pub(crate) const LARGEST_HALF: f32 = 65504.0;

/// The contents of declared files; `None` for a file that is not written.
pub(crate) type MaybeFiles = Vec<Option<Vec<u8>>>;

/// The light of a volume.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LitVolume<'a> {
    /// The volume.
    pub(crate) volume: &'a Volume,
    /// The light of its probes.
    pub(crate) rows: &'a [Rows],
    /// Which of its probes have light of their own; that of the others comes from them.
    pub(crate) valid: &'a [bool],
}

/// The light of all probes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProbeLight<'a> {
    /// The places.
    pub(crate) places: &'a ProbePlaces,
    /// The light of all probes.
    pub(crate) rows: &'a [Rows],
    /// Which of the probes have light of their own.
    pub(crate) valid: &'a [bool],
}

impl<'a> ProbeLight<'a> {
    /// The volumes with their light.
    pub(crate) fn volumes(&self) -> Vec<LitVolume<'a>> {
        let (mut rows, mut valid, mut volumes) = (self.rows, self.valid, Vec::new());
        for volume in self.places.volumes() {
            let length = volume.len().min(rows.len()).min(valid.len());
            let (own, rest) = rows.split_at(length);
            let (own_valid, rest_valid) = valid.split_at(length);
            volumes.push(LitVolume { volume, rows: own, valid: own_valid });
            (rows, valid) = (rest, rest_valid);
        }
        volumes
    }

    /// The volumes, for a preset that has nothing else.
    ///
    /// # Errors
    /// If there are points, or more volumes than `most`.
    pub(crate) fn only_volumes(&self, preset: &str, most: usize) -> Result<Vec<LitVolume<'a>>, Failure> {
        let points = self.places.scattered();
        if points > 0 {
            return Err(Failure::new(format!(
                "{preset} loads grids, and {points} of the probes are scattered points"
            ))
            .help(
                "place volumes only, or export the points with preset = \"gltf\", \"unity\" or \"godot\"",
            ));
        }
        self.few_volumes(preset, most)
    }

    /// The volumes, for a preset that has a limit.
    ///
    /// # Errors
    /// If there are more than `most`.
    pub(crate) fn few_volumes(&self, preset: &str, most: usize) -> Result<Vec<LitVolume<'a>>, Failure> {
        let volumes = self.volumes();
        if volumes.len() > most {
            let message = format!("{preset} loads at most {most} volumes, and there are {}", volumes.len());
            return Err(Failure::new(message).help("place fewer or larger boxes"));
        }
        Ok(volumes)
    }
}

/// Checks that each number of some light has a half, in a file that can hold no other.
///
/// # Errors
/// The first number that has none, with what helps.
pub(crate) fn check_halves(values: &[f32], of: &str, help: &str) -> Result<(), Failure> {
    match values.iter().find(|value| value.is_nan() || value.abs() > LARGEST_HALF) {
        None => Ok(()),
        Some(value) => {
            let message = format!("{of} has light of {value}, and the largest half is {LARGEST_HALF}");
            Err(Failure::new(message).help(help.to_owned()))
        }
    }
}

/// Checks the sizes of a texture of three dimensions against the largest of an engine.
///
/// # Errors
/// If it is larger along an axis, with what helps.
pub(crate) fn check_texture(sizes: [usize; 3], most: usize, of: &str) -> Result<(), Failure> {
    if sizes.iter().all(|size| *size <= most) {
        return Ok(());
    }
    let [x, y, z] = sizes;
    let message =
        format!("the texture of {of} has {x} x {y} x {z} texels, and engines have at most {most} a side");
    Err(Failure::new(message).help("place probes farther apart, or split the box"))
}
