//! The places of light probes.

use probes::{Lattice, PlacesParts, ProbePlaces, Repair, Volume};
use safetensors::tensor::Dtype;
use serde::{Deserialize, Serialize};

use super::file::{TensorFile, Writer};
use crate::error::Error;

/// The metadata entry with the names and the lattices of the volumes, as a list in JSON.
const VOLUMES: &str = "volumes";
/// The metadata entry with the digest of the triangles.
const TRIANGLES: &str = "triangles";
/// The triangle of a probe that is inside of nothing.
const NOTHING: u32 = u32::MAX;

/// The directions in which a probe looks around: the columns of `reach`.
const DIRECTIONS: usize = 256;

/// What the metadata have of a volume.
#[derive(Serialize, Deserialize)]
struct VolumeEntry {
    name: String,
    lattice: String,
}

const LATTICES: [(&str, Lattice); 2] = [("centres", Lattice::Centres), ("corners", Lattice::Corners)];

/// The places of P probes: those of V volumes, one volume after the other, x fastest, and then those at S
/// points; metres in Specula's frame.
///
/// | tensor | shape | what |
/// | --- | --- | --- |
/// | `bounds` | [V, 2, 3] f32 | the least and the greatest coordinates of each volume |
/// | `counts` | [V, 3] u32 | the probes along x, y and z |
/// | `points` | [S, 3] f32 | the points |
/// | `positions` | [P, 3] f32 | where light is computed |
/// | `back_share` | \[P\] f32 | the share of directions in which backs of surfaces of one side are seen |
/// | `inside_of` | \[P\] u32 | a triangle of the solid around the probe's place in the grid, 4294967295 for none |
/// | `visible` | \[P\] u32 | a bit for each of the 26 neighbours that is seen and valid |
/// | `source_counts` | \[P\] u32 | how many probes each takes its light from |
/// | `sources`, `weights` | \[n\] u32 and f32 | these probes, and their weights |
/// | `repairs` | \[P\] u8 | 0 for none, 1 for moved, 2 for filled, 3 for lost: filled from the nearest |
/// | `reach` | [G, 256] u8 | how far the probes of volumes see, in 254ths of the diagonal of a cell |
///
/// The metadata have `volumes`, a list in JSON of `name` and `lattice` (`centres` or `corners`), and
/// `triangles`, the digest of the triangles of the scene in which they are.
pub fn encode_probe_places(places: &ProbePlaces, triangles: &str, recipe: Option<&str>) -> Vec<u8> {
    let mut file = Writer::new("probe-places", recipe);
    file.entry(TRIANGLES, triangles);
    file.places(places);
    file.finish()
}

/// The places of probes and the digest of the triangles, from a file of kind `probe-places`.
///
/// # Errors
/// The errors of [`super::decode_lighting`] and of [`ProbePlaces::from_parts`].
pub fn decode_probe_places(bytes: &[u8]) -> Result<(ProbePlaces, String), Error> {
    let file = TensorFile::open_as(bytes, "probe-places")?;
    Ok((file.places()?, file.digest(TRIANGLES)?))
}

impl Writer {
    /// The tensors of places, and the metadata of their volumes.
    pub(super) fn places(&mut self, places: &ProbePlaces) {
        let volumes = places.volumes();
        let entry = |volume: &Volume| VolumeEntry {
            name: volume.name.clone(),
            lattice: LATTICES[usize::from(volume.lattice == Lattice::Corners)].0.to_owned(),
        };
        let entries: Vec<VolumeEntry> = volumes.iter().map(entry).collect();
        self.entry(VOLUMES, serde_json::json!(entries).to_string());
        let bounds: Vec<f32> = volumes.iter().flat_map(|volume| volume.bounds.concat()).collect();
        self.numbers("bounds", &[volumes.len(), 2, 3], &bounds);
        let counts: Vec<u32> =
            volumes.iter().flat_map(|volume| volume.counts.map(|count| count as u32)).collect();
        self.words("counts", &[volumes.len(), 3], &counts);
        self.numbers("points", &[places.scattered(), 3], places.points().as_flattened());
        self.numbers("positions", &[places.len(), 3], places.positions().as_flattened());
        self.numbers("back_share", &[places.len()], places.back_share());
        let inside_of: Vec<u32> =
            (0..places.len()).map(|probe| places.inside_of(probe).unwrap_or(NOTHING)).collect();
        self.words("inside_of", &[places.len()], &inside_of);
        self.words("visible", &[places.len()], places.visible());
        let (mut source_counts, mut sources, mut weights) = (Vec::new(), Vec::new(), Vec::new());
        let mut repairs = Vec::with_capacity(places.len());
        for repair in places.repairs() {
            let before = sources.len();
            repairs.push(match repair {
                Repair::None => 0,
                Repair::Moved => 1,
                Repair::Filled(filled) => {
                    sources.extend(filled.iter().map(|(source, _)| *source));
                    weights.extend(filled.iter().map(|(_, weight)| *weight));
                    2
                }
                Repair::Lost(source) => {
                    sources.push(*source);
                    weights.push(1.0);
                    3
                }
            });
            source_counts.push((sources.len() - before) as u32);
        }
        self.words("source_counts", &[places.len()], &source_counts);
        self.words("sources", &[sources.len()], &sources);
        self.numbers("weights", &[weights.len()], &weights);
        self.data.extend(repairs);
        self.tensor("repairs", "U8", &[places.len()]);
        self.data.extend(places.reach());
        self.tensor("reach", "U8", &[places.len() - places.scattered(), DIRECTIONS]);
    }
}

impl TensorFile<'_> {
    /// The places that [`Writer::places`] wrote.
    pub(super) fn places(&self) -> Result<ProbePlaces, Error> {
        let entries = self.metadata.get(VOLUMES).and_then(|text| serde_json::from_str(text).ok());
        let entries: Vec<VolumeEntry> = entries.ok_or_else(|| {
            Error::damaged("metadata `volumes`: expected a list of names and lattices in JSON")
        })?;
        let bounds = self.array("bounds", Dtype::F32, "[V, 2, 3]", &[2, 3], f32::from_le_bytes)?;
        let counts = self.array("counts", Dtype::U32, "[V, 3]", &[3], u32::from_le_bytes)?;
        let (bounds, counts) = (bounds.as_chunks::<3>().0.as_chunks::<2>().0, counts.as_chunks::<3>().0);
        if bounds.len() != entries.len() || counts.len() != entries.len() {
            return Err(Error::damaged("metadata `volumes`: expected an entry for each row of `bounds`"));
        }
        let volume = |((entry, bounds), counts): ((VolumeEntry, &[[f32; 3]; 2]), &[u32; 3])| {
            let lattice = LATTICES.iter().find(|(word, _)| *word == entry.lattice);
            let Some((_, lattice)) = lattice else {
                let message = format!(
                    "metadata `volumes`: expected the lattice centres or corners, found {:?}",
                    entry.lattice
                );
                return Err(Error::damaged(message));
            };
            Volume::new(entry.name, *bounds, counts.map(|count| count as usize), *lattice)
                .map_err(|error| Error::damaged(error.to_string()))
        };
        let volumes = entries.into_iter().zip(bounds).zip(counts).map(volume).collect::<Result<_, _>>()?;
        let places = |name: &str, shape: &str| {
            let values = self.array(name, Dtype::F32, shape, &[3], f32::from_le_bytes)?;
            Ok::<Vec<[f32; 3]>, Error>(values.as_chunks::<3>().0.to_vec())
        };
        let words = |name: &str, shape: &str| self.array(name, Dtype::U32, shape, &[], u32::from_le_bytes);
        let inside_of = words("inside_of", "[P]")?;
        let parts = PlacesParts {
            volumes,
            points: places("points", "[S, 3]")?,
            positions: places("positions", "[P, 3]")?,
            back_share: self.array("back_share", Dtype::F32, "[P]", &[], f32::from_le_bytes)?,
            inside_of: inside_of.into_iter().map(|at| (at != NOTHING).then_some(at)).collect(),
            repairs: self.repairs()?,
            visible: words("visible", "[P]")?,
            reach: self.array("reach", Dtype::U8, "[G, 256]", &[DIRECTIONS], |[byte]| byte)?,
        };
        ProbePlaces::from_parts(parts).map_err(|what| {
            Error::damaged(format!("the {what} do not belong to these probes, or are out of their range"))
        })
    }

    /// What became of each probe.
    fn repairs(&self) -> Result<Vec<Repair>, Error> {
        let wrong = || {
            Error::damaged(
                "tensor `repairs`: expected 0 to 3, and sources for those probes that are filled or lost",
            )
        };
        let words = |name: &str, shape: &str| self.array(name, Dtype::U32, shape, &[], u32::from_le_bytes);
        let (counts, sources) = (words("source_counts", "[P]")?, words("sources", "[n]")?);
        let weights = self.array("weights", Dtype::F32, "[n]", &[], f32::from_le_bytes)?;
        let repairs = self.array("repairs", Dtype::U8, "[P]", &[], |[byte]| byte)?;
        if counts.len() != repairs.len() || sources.len() != weights.len() {
            return Err(wrong());
        }
        let mut rest: Vec<(u32, f32)> = sources.into_iter().zip(weights).collect();
        rest.reverse();
        let mut all = Vec::with_capacity(repairs.len());
        for (repair, count) in repairs.into_iter().zip(counts) {
            let left = rest.len().checked_sub(count as usize).ok_or_else(wrong)?;
            let mut own = rest.split_off(left);
            own.reverse();
            all.push(match (repair, own.as_slice()) {
                (0, []) => Repair::None,
                (1, []) => Repair::Moved,
                (2, [_, ..]) => Repair::Filled(own),
                (3, [(source, 1.0)]) => Repair::Lost(*source),
                _ => return Err(wrong()),
            });
        }
        if rest.is_empty() { Ok(all) } else { Err(wrong()) }
    }
}
