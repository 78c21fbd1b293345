//! Lights probes by a pattern that shows how a program places them, and which way its axes point.
//!
//! ```toml
//! [stage.pattern]
//! kind = "probe-pattern"
//! ```
//!
//! `export-probes` writes it for an engine, and `specula test-pattern --probes` does so without a manifest.
//!
//! | `light` | what a white matte surface reflects at a place p with the normal n |
//! | --- | --- |
//! | `"axes"` | 2 + u + n / 2: red has the x of both, green y, blue z, in the axes of glTF files, +Y up. u goes from -1 to 1 over the volume. A ball in the middle is reddest on the side of +X, greenest on top, and bluest on the side of +Z; a ball moved along +X turns redder |
//! | `"noise"` | all nine rows are different at each probe, so that no exchange of two of them stays hidden: for tests of programs, by numbers |
//!
//! `places` are those of `place-probes`, so that the pattern stands where the probes of a scene stand.
//! Without them, there is one volume from `from` to `to`, in Specula's frame, with `counts` probes along x, y
//! and z. Single points have the u of the box around all of them.

use containers::tensors::Probes;
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, choice, parameters};
use probes::{Lattice, LitProbes, PlacesParts, ProbePlaces, Repair, Volume, neighbours};
use stages::artifacts;
use stages::plugin::Place;

choice! {
    /// What the light of a pattern shows.
    pub(crate) enum PatternLight {
        /// The axes.
        Axes = "axes",
        /// Every coefficient.
        Noise = "noise",
    }
}

choice! {
    /// Where the probes of the pattern's own volume stand.
    pub(crate) enum PatternLattice {
        /// In the middle of cells.
        Centres = "centres",
        /// At the corners of cells.
        Corners = "corners",
    }
}

parameters! {
    /// Parameters of `probe-pattern`.
    pub(crate) struct Parameters {
        /// What the light shows; see the table.
        light: PatternLight = PatternLight::Axes,
        /// Without `places`: the corner of the volume with the least coordinates, in metres. Default: (-2,
        /// -1.5, 0).
        from: Option<Place> = None,
        /// Without `places`: the opposite corner. Default: (2, 1.5, 2).
        to: Option<Place> = None,
        /// Without `places`: the probes along x, y and z.
        counts: Vec<usize> = vec![5, 4, 3],
        /// Without `places`: where the probes stand.
        lattice: PatternLattice = PatternLattice::Centres,
    }
}

/// The most probes of the pattern's own volume, each of which takes a quarter of a kilobyte.
const MOST_PROBES: usize = 1 << 18;

/// The kind `probe-pattern`.
pub(crate) struct ProbePattern;

impl Kind for ProbePattern {
    type Parameters = Parameters;

    const NAME: &'static str = "probe-pattern";
    const REVISION: u32 = 1;
    const TEXT: &'static str = include_str!("probe_pattern.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::ProbePlaces>("places").optional()]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Probes::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        match parameters.counts.len() {
            3 => Vec::new(),
            _ => vec![("counts", "expected three numbers, [x, y, z]".into())],
        }
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let connected = context.inputs.optional::<artifacts::ProbePlaces>("places")?;
        let places = match &connected {
            Some(places) => places.0.clone(),
            None => own_places(parameters)?,
        };
        let rows: Vec<[[f32; 3]; 9]> = match parameters.light {
            PatternLight::Axes => axes(&places),
            PatternLight::Noise => (0..places.len()).map(noise).collect(),
        };
        let windows = vec![0.0; rows.len()];
        let light = LitProbes::from_parts(rows, windows)
            .ok_or_else(|| Failure::new("the places are too far away for a pattern"))?;
        Output::artifact(artifacts::Probes(Probes { places, light }))
    }
}

/// The volume of the parameters, empty of walls.
fn own_places(parameters: &Parameters) -> Result<ProbePlaces, Failure> {
    let corner =
        |place: Option<Place>, default: [f64; 3]| place.map_or(default, |place| place.0).map(|x| x as f32);
    let bounds = [corner(parameters.from, [-2.0, -1.5, 0.0]), corner(parameters.to, [2.0, 1.5, 2.0])];
    let lattice = match parameters.lattice {
        PatternLattice::Centres => Lattice::Centres,
        PatternLattice::Corners => Lattice::Corners,
    };
    let counts = <[usize; 3]>::try_from(parameters.counts.as_slice())?;
    let volume = Volume::new("pattern".into(), bounds, counts, lattice)?;
    let count = volume.len();
    if count > MOST_PROBES {
        return Err(Failure::new(format!(
            "{count} probes are too many for a pattern; expected at most {MOST_PROBES}"
        ))
        .help("lower `counts`"));
    }
    let all_seen = (1 << neighbours().count()) - 1;
    let parts = PlacesParts {
        positions: (0..count).map(|index| volume.position(volume.cell(index))).collect(),
        points: Vec::new(),
        back_share: vec![0.0; count],
        inside_of: vec![None; count],
        repairs: vec![Repair::None; count],
        visible: vec![all_seen; count],
        reach: vec![u8::MAX; 256 * count],
        volumes: vec![volume],
    };
    ProbePlaces::from_parts(parts).map_err(|what| Failure::new(format!("the pattern has no {what}")))
}

/// The axes of glTF files, which are y, z and x of ours, in the order of red, green and blue.
const OF_FILES: [usize; 3] = [1, 2, 0];

/// The light of `"axes"` at each probe.
fn axes(places: &ProbePlaces) -> Vec<[[f32; 3]; 9]> {
    // pi over the factor of the cosine, over the constant of the basis.
    let mean = (4.0 * std::f32::consts::PI).sqrt();
    let slope = 1.5 / (0.75 / std::f32::consts::PI).sqrt();
    let mut boxes: Vec<([[f32; 3]; 2], usize)> =
        places.volumes().iter().map(|volume| (volume.bounds, volume.len())).collect();
    let points = places.points();
    let end = |take: fn(f32, f32) -> f32| {
        [0, 1, 2].map(|axis| points.iter().map(|point| point[axis]).reduce(take).unwrap_or(0.0))
    };
    boxes.push(([end(f32::min), end(f32::max)], points.len()));
    let boxes = boxes.into_iter().flat_map(|(bounds, count)| std::iter::repeat_n(bounds, count));
    let light = |([least, most], at): ([[f32; 3]; 2], &[f32; 3])| {
        let mut rows = [[0.0; 3]; 9];
        for (channel, axis) in OF_FILES.into_iter().enumerate() {
            let length = most[axis] - least[axis];
            let u = if length > 0.0 { 2.0 * (at[axis] - least[axis]) / length - 1.0 } else { 0.0 };
            rows[0][channel] = (2.0 + u) * mean;
            // Row 1, 2 and 3 are those of y, z and x.
            rows[[3, 1, 2][axis]][channel] = 0.5 * slope;
        }
        rows
    };
    boxes.zip(places.grid()).map(light).collect()
}

/// The light of `"noise"` at a probe: its irradiance is above 0 toward all normals.
fn noise(probe: usize) -> [[f32; 3]; 9] {
    std::array::from_fn(|row| {
        [0, 1, 2].map(|channel| {
            let mixed = ((27 * probe + 3 * row + channel) as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let value = (mixed >> 40) as f32 / (1 << 23) as f32 - 1.0;
            if row == 0 { 4.0 + value } else { 0.5 * value }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::exact;

    #[test]
    fn the_colour_is_the_place_and_the_normal() {
        let bounds = [[-2.0, -1.5, 0.0], [2.0, 1.5, 2.0]];
        let volume = Volume::new("a".into(), bounds, [4, 3, 2], Lattice::Centres).unwrap();
        let parameters = Parameters {
            light: PatternLight::Axes,
            from: None,
            to: None,
            counts: vec![4, 3, 2],
            lattice: PatternLattice::Centres,
        };
        let places = own_places(&parameters).unwrap();
        let rows = axes(&places);
        for (probe, rows) in rows.iter().enumerate() {
            let at = volume.position(volume.cell(probe));
            let normal = [0.48, -0.6, 0.64];
            let u = [0, 1, 2].map(|k| 2.0 * (at[k] - bounds[0][k]) / (bounds[1][k] - bounds[0][k]) - 1.0);
            let ours = [0, 1, 2].map(|k| 2.0 + f64::from(u[k]) + 0.5 * normal[k]);
            let found = exact(rows, normal);
            for (found, expected) in found.iter().zip([ours[1], ours[2], ours[0]]) {
                assert!((found - expected).abs() < 1e-6, "{found} {expected}");
            }
        }
    }
}
