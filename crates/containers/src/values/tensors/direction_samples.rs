//! Directions that were drawn, for programs.

use super::file::Writer;
use crate::error::Error;
use crate::values::direction_samples::DirectionSamples;

/// Directions as a file, all f32: `point` [n, 2], in the unit square; `direction` [n, 3], +Z up; `pdf` \[n\],
/// in 1/sr; `weight` \[n\], the integrand over the density. `entries` go into the metadata.
///
/// # Errors
/// If the slices have different lengths, or a number is not finite.
pub fn encode_direction_samples(
    samples: &DirectionSamples<'_>,
    entries: &[(&str, String)],
    recipe: Option<&str>,
) -> Result<Vec<u8>, Error> {
    samples.check().map_err(|error| error.within("safetensors"))?;
    let mut file = Writer::new("direction-samples", recipe);
    for (key, value) in entries {
        file.entry(*key, value);
    }
    let count = samples.points.len();
    file.extend_f32(samples.points.as_flattened());
    file.tensor("point", "F32", &[count, 2]);
    file.extend_f32(samples.directions.as_flattened());
    file.tensor("direction", "F32", &[count, 3]);
    file.extend_f32(samples.densities);
    file.tensor("pdf", "F32", &[count]);
    file.extend_f32(samples.weights);
    file.tensor("weight", "F32", &[count]);
    Ok(file.finish())
}
