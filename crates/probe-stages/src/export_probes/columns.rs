//! The transport to probes, as columns of the sky, of emissive materials and of lamps.

use containers::tensors::{ProbeLamps, ProbeTransport, StoredScene};
use engine::Failure;
use probes::{Scene, ScenePart};

use crate::scene_port::check;

/// The rows of a probe that are exported.
pub(crate) const ROWS: usize = 9;

/// The columns of some lights.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Columns {
    /// The number of columns.
    pub(crate) count: usize,
    /// 1 if red, green and blue have the same numbers, else 3.
    pub(crate) channels: usize,
    /// The names of the lights, if they are known.
    pub(crate) names: Vec<String>,
    /// [probe, row, column, channel], in the order of the places and in our own axes. Probes without light of
    /// their own have that of their neighbours.
    pub(crate) numbers: Vec<f32>,
}

impl Columns {
    /// The numbers of a probe.
    pub(crate) fn length(&self) -> usize {
        ROWS * self.count * self.channels
    }

    /// A row of a probe in red, green or blue.
    pub(crate) fn row(&self, probe: usize, row: usize, channel: usize) -> impl Iterator<Item = f32> {
        let first = (probe * ROWS + row) * self.count;
        (first..first + self.count)
            .map(move |at| self.numbers[at * self.channels + channel.min(self.channels - 1)])
    }
}

/// The columns of the sky, of emissive materials with all of their light, and of lamps with what surfaces
/// reflect of them. A whole scene has the names of the emissive materials.
///
/// # Errors
/// If the lamps or the scene belong to another transport.
pub(crate) fn columns(
    stored: &ProbeTransport,
    lamps: Option<&ProbeLamps>,
    scene: Option<&StoredScene>,
) -> Result<[Columns; 3], Failure> {
    let ProbeTransport { transport, places, .. } = stored;
    let (probes, rows) = (transport.len(), transport.degree().rows());
    if let Some(lamps) = lamps {
        let is_own = lamps.places_digest == stored.places_digest && lamps.surfaces == stored.surfaces;
        if !is_own || lamps.degree != transport.degree() {
            return Err(Failure::new("the lamps belong to another transport")
                .help("bake both from the same scene and places, with the same degree"));
        }
    }
    if let Some(scene) = scene {
        check(scene, ScenePart::All)?;
        if scene.surfaces != stored.surfaces {
            return Err(Failure::new("the transport is that of another scene")
                .help("connect `scene` to the stage of import-scene that bake-probes has its scene from"));
        }
    }
    let filled = |count: usize, channels: usize, names: Vec<String>, matrix: &dyn Fn(usize) -> Vec<f32>| {
        let mut own = Columns { count, channels, names, numbers: (0..probes).flat_map(matrix).collect() };
        let length = own.length();
        if length > 0 {
            places.dilate(&mut own.numbers, length);
        }
        own
    };
    let (sky, channels) = (transport.sky_degree().rows(), transport.channels());
    let of_sky = |probe: usize| {
        let length = rows * sky * channels;
        transport.sky()[probe * length..][..ROWS * sky * channels].to_vec()
    };
    let emitters = transport.emitters();
    let of_emission = |probe: usize| {
        let of = |values: &[f32], emitter: usize, index: usize| {
            values[(probe * emitters + emitter) * 3 * rows..][index]
        };
        from_columns(emitters, |emitter, index| {
            of(transport.direct(), emitter, index) + of(transport.indirect(), emitter, index)
        })
    };
    let lit = lamps.map_or(&[][..], |lamps| &lamps.columns);
    let of_lamps = |probe: usize| {
        from_columns(lit.len(), |lamp, index| {
            lit[lamp].indirect.get(probe * 3 * rows + index).copied().unwrap_or(0.0)
        })
    };
    let lamp_names = lamps.map_or_else(Vec::new, |lamps| lamps.names.clone());
    Ok([
        filled(sky, channels, Vec::new(), &of_sky),
        filled(
            emitters,
            3,
            scene.map_or_else(Vec::new, |stored| emission_names(&stored.scene)),
            &of_emission,
        ),
        filled(lit.len(), 3, lamp_names, &of_lamps),
    ])
}

/// The names of the emissive materials, in the order of their columns.
fn emission_names(scene: &Scene) -> Vec<String> {
    let materials = &scene.parts().materials;
    let name = |material: u32| materials.get(material as usize).map_or("", |material| material.name.as_str());
    scene.emitters().into_iter().map(|material| name(material).to_owned()).collect()
}

/// The matrix of coloured columns: `value` gives a column's number of a row and channel, [row, channel].
fn from_columns(columns: usize, value: impl Fn(usize, usize) -> f32) -> Vec<f32> {
    let entry = |index: usize| {
        let (row, column, channel) = (index / (3 * columns), index / 3 % columns, index % 3);
        value(column, 3 * row + channel)
    };
    (0..3 * ROWS * columns).map(entry).collect()
}
