//! The transport of light to probes: from a sky and emissive materials, and from lamps.

use half::f16;
use probes::{BakeRecord, LampColumns, ProbePlaces, Transport, TransportParts};
use safetensors::tensor::Dtype;
use sh::Degree;

use super::arrays::refuse_infinite;
use super::file::{TensorFile, Writer, degree, wrong_shape};
use crate::error::{Error, ErrorKind};

/// The metadata entry with the digest of the places.
const PLACES: &str = "places";
/// The metadata entry with the digest of the surfaces.
const SURFACES: &str = "surfaces";
/// The metadata entry with the names of the lamps, as a list in JSON.
const LAMPS: &str = "lamps";
/// The metadata entry with the digests of what their columns were made from, as a list in JSON.
const DIGESTS: &str = "digests";

/// How the numbers of a transport are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransportPrecision {
    /// In 16 bits: right to 2.4e-4 of each.
    Half,
    /// In 32 bits.
    Single,
}

/// The transport to probes, and what it belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeTransport {
    /// The transport.
    pub transport: Transport,
    /// How it is stored.
    pub precision: TransportPrecision,
    /// Where the probes stand.
    pub places: ProbePlaces,
    /// The digest of the places.
    pub places_digest: String,
    /// The digest of the surfaces of the scene: [`super::StoredScene`].
    pub surfaces: String,
    /// What its bricks were made from, if that is known.
    pub record: Option<BakeRecord>,
}

/// The transport from lamps to probes, and what it belongs to.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeLamps {
    /// The name of each lamp.
    pub names: Vec<String>,
    /// The digest of all that the columns of each lamp were made from.
    pub digests: Vec<String>,
    /// What arrives from each.
    pub columns: Vec<LampColumns>,
    /// The degree of what arrives.
    pub degree: Degree,
    /// The number of probes.
    pub probes: usize,
    /// The digest of the places.
    pub places_digest: String,
    /// The digest of the surfaces of the scene.
    pub surfaces: String,
}

/// The transport to P probes from a sky and from E emissive materials: `sky` [P, (F+1)^2, (O+1)^2, 1 or 3],
/// where rows are what arrives and columns the sky, `direct` and `indirect` [P, E, (F+1)^2, 3] for a radiance
/// of 1, all f16 or f32; `paths` \[P\] u32, `errors` \[P\] f32, the standard error of each probe; and the
/// tensors of [`encode_probe_places`](super::encode_probe_places). The metadata have the digests `places` and
/// `surfaces`. If it is known what each of B bricks was made from, all u64: `bricks.of-all` \[1\],
/// `bricks.contents` \[32^3\], `bricks.groups` \[G\], `bricks.places` \[B\], `bricks.cells` [B, 512] and
/// `bricks.light` [B, (G+63)/64] ([`BakeRecord`]).
///
/// # Errors
/// If a number is not finite, or past 65504 in 16 bits, or the places or the bricks are not those of the
/// transport.
pub fn encode_probe_transport(value: &ProbeTransport, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let ProbeTransport { transport, precision, places, .. } = value;
    let (count, emitters, rows) = (transport.len(), transport.emitters(), transport.degree().rows());
    if count != places.len() {
        let message = format!("the transport is to {count} probes, and there are {}", places.len());
        return Err(Error::new(ErrorKind::Unwritable, message));
    }
    let mut file = Writer::new("probe-transport", recipe);
    file.entry(PLACES, value.places_digest.clone());
    file.entry(SURFACES, value.surfaces.clone());
    file.words("paths", &[count], transport.paths());
    refuse_infinite("errors", transport.errors().iter().copied(), ErrorKind::Unwritable)?;
    file.numbers("errors", &[count], transport.errors());
    let columns = [count, rows, transport.sky_degree().rows(), transport.channels()];
    let emission = [count, emitters, rows, 3];
    for (name, shape, values) in [
        ("sky", columns, transport.sky()),
        ("direct", emission, transport.direct()),
        ("indirect", emission, transport.indirect()),
    ] {
        if *precision == TransportPrecision::Single {
            refuse_infinite(name, values.iter().copied(), ErrorKind::Unwritable)?;
            file.numbers(name, &shape, values);
            continue;
        }
        let halves = values.iter().map(|value| f16::from_f32(*value));
        refuse_infinite(name, halves.clone().map(f16::to_f32), ErrorKind::Unwritable)?;
        file.data.reserve(2 * values.len());
        file.data.extend(halves.flat_map(f16::to_le_bytes));
        file.tensor(name, "F16", &shape);
    }
    file.places(places);
    if let Some(record) = &value.record {
        if !record.is_consistent() {
            return Err(Error::new(ErrorKind::Unwritable, "the record of the bricks is not consistent"));
        }
        file.record(record);
    }
    Ok(file.finish())
}

/// The transport to probes, from a file of kind `probe-transport`.
///
/// # Errors
/// The errors of [`super::decode_probe_places`], and errors if the transport does not belong to these places.
pub fn decode_probe_transport(bytes: &[u8]) -> Result<ProbeTransport, Error> {
    const SKY: &str = "[P, (F+1)^2, (O+1)^2, 1 or 3]";
    const EMISSION: &str = "[P, E, (F+1)^2, 3]";
    let file = TensorFile::open_as(bytes, "probe-transport")?;
    let dtype = file.tensors.tensor("sky").map(|tensor| tensor.dtype());
    let precision =
        if matches!(dtype, Ok(Dtype::F16)) { TransportPrecision::Half } else { TransportPrecision::Single };
    let tensor = |name: &str, shape: &str| -> Result<(Vec<usize>, Vec<f32>), Error> {
        let values: Vec<f32>;
        let tensor = match precision {
            TransportPrecision::Half => {
                let tensor = file.tensor(name, Dtype::F16, shape)?;
                let words = tensor.data().as_chunks::<2>().0.iter();
                values = words.map(|word| f16::from_le_bytes(*word).to_f32()).collect();
                tensor
            }
            TransportPrecision::Single => {
                let tensor = file.tensor(name, Dtype::F32, shape)?;
                values =
                    tensor.data().as_chunks::<4>().0.iter().map(|word| f32::from_le_bytes(*word)).collect();
                tensor
            }
        };
        refuse_infinite(name, values.iter().copied(), ErrorKind::Damaged)?;
        Ok((tensor.shape().to_vec(), values))
    };
    let (shape, sky) = tensor("sky", SKY)?;
    let &[_, rows, columns, channels] = &shape[..] else { return Err(wrong_shape("sky", SKY, &shape)) };
    let (shape, direct) = tensor("direct", EMISSION)?;
    let &[_, emitters, _, 3] = &shape[..] else { return Err(wrong_shape("direct", EMISSION, &shape)) };
    let (_, indirect) = tensor("indirect", EMISSION)?;
    let errors = file.array("errors", Dtype::F32, "[P]", &[], f32::from_le_bytes)?;
    refuse_infinite("errors", errors.iter().copied(), ErrorKind::Damaged)?;
    let parts = TransportParts {
        degree: square("sky", rows, 2..=4)?,
        sky_degree: square("sky", columns, 2..=8)?,
        channels,
        emitters,
        sky,
        direct,
        indirect,
        paths: file.array("paths", Dtype::U32, "[P]", &[], u32::from_le_bytes)?,
        errors,
    };
    let transport = Transport::from_parts(parts)
        .ok_or_else(|| Error::damaged("the tensors of the transport do not belong together"))?;
    let places = file.places()?;
    if places.len() != transport.len() {
        let message =
            format!("the transport is to {} probes, and there are {}", transport.len(), places.len());
        return Err(Error::damaged(message));
    }
    let (places_digest, surfaces) = (file.digest(PLACES)?, file.digest(SURFACES)?);
    let record = file.record()?;
    Ok(ProbeTransport { transport, precision, places, places_digest, surfaces, record })
}

impl Writer {
    /// The tensors of a record that is consistent.
    fn record(&mut self, record: &BakeRecord) {
        let BakeRecord { of_all, contents, groups, places, cells, light } = record;
        let bricks = places.len();
        let words = |all: &[u64]| all.len().checked_div(bricks).unwrap_or(0);
        self.long_words("bricks.of-all", &[1], &[*of_all]);
        self.long_words("bricks.contents", &[contents.len()], contents);
        self.long_words("bricks.groups", &[groups.len()], groups);
        self.long_words("bricks.places", &[bricks], places);
        self.long_words("bricks.cells", &[bricks, words(cells)], cells);
        self.long_words("bricks.light", &[bricks, words(light)], light);
    }
}

impl TensorFile<'_> {
    /// The record of bricks, if there is one.
    fn record(&self) -> Result<Option<BakeRecord>, Error> {
        if !self.has("bricks.of-all") {
            return Ok(None);
        }
        let words = |name: &str| self.array(name, Dtype::U64, "[n]", &[], u64::from_le_bytes);
        let lines = |name: &str| {
            let tensor = self.tensor(name, Dtype::U64, "[B, n]")?;
            Ok::<Vec<u64>, Error>(
                tensor.data().as_chunks::<8>().0.iter().map(|word| u64::from_le_bytes(*word)).collect(),
            )
        };
        let of_all = words("bricks.of-all")?;
        let record = BakeRecord {
            of_all: of_all.first().copied().unwrap_or_default(),
            contents: words("bricks.contents")?,
            groups: words("bricks.groups")?,
            places: words("bricks.places")?,
            cells: lines("bricks.cells")?,
            light: lines("bricks.light")?,
        };
        if of_all.len() == 1 && record.is_consistent() {
            return Ok(Some(record));
        }
        Err(Error::damaged("the tensors `bricks.*` do not belong together"))
    }
}

/// The transport from L lamps to P probes, for a colour times intensity of 1: `direct` and `indirect`
/// [L, P, (F+1)^2, 3] f32, `paths` [L, P] u32, `errors` [L, P] f32. The metadata have the names of the
/// `lamps`, a list in JSON, the list of their `digests`, and the digests `places` and `surfaces`.
///
/// # Errors
/// If a number is not finite, or the lamps are not all to the same probes.
pub fn encode_probe_lamps(lamps: &ProbeLamps, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let (count, rows) = (lamps.columns.len(), lamps.degree.rows());
    let mut file = Writer::new("probe-lamps", recipe);
    file.entry(LAMPS, serde_json::json!(lamps.names).to_string());
    file.entry(DIGESTS, serde_json::json!(lamps.digests).to_string());
    file.entry(PLACES, lamps.places_digest.clone());
    file.entry(SURFACES, lamps.surfaces.clone());
    let length = 3 * rows * lamps.probes;
    let is_whole = |columns: &LampColumns| {
        let LampColumns { direct, indirect, paths, errors } = columns;
        [direct.len(), indirect.len()] == [length; 2] && [paths.len(), errors.len()] == [lamps.probes; 2]
    };
    if [lamps.names.len(), lamps.digests.len()] != [count; 2] || !lamps.columns.iter().all(is_whole) {
        return Err(Error::new(ErrorKind::Unwritable, "the lamps are not all to the same probes"));
    }
    let floats = |file: &mut Writer, name: &str, shape: &[usize], of: fn(&LampColumns) -> &Vec<f32>| {
        let values = lamps.columns.iter().flat_map(of).copied();
        refuse_infinite(name, values.clone(), ErrorKind::Unwritable)?;
        file.numbers(name, shape, &values.collect::<Vec<f32>>());
        Ok::<(), Error>(())
    };
    floats(&mut file, "direct", &[count, lamps.probes, rows, 3], |columns| &columns.direct)?;
    floats(&mut file, "indirect", &[count, lamps.probes, rows, 3], |columns| &columns.indirect)?;
    floats(&mut file, "errors", &[count, lamps.probes], |columns| &columns.errors)?;
    let paths: Vec<u32> = lamps.columns.iter().flat_map(|columns| &columns.paths).copied().collect();
    file.words("paths", &[count, lamps.probes], &paths);
    Ok(file.finish())
}

/// The transport from lamps to probes, from a file of kind `probe-lamps`.
///
/// # Errors
/// The errors of [`super::decode_lighting`], and errors if there is not a name for each lamp.
pub fn decode_probe_lamps(bytes: &[u8]) -> Result<ProbeLamps, Error> {
    const SHAPE: &str = "[L, P, (F+1)^2, 3]";
    let file = TensorFile::open_as(bytes, "probe-lamps")?;
    let [names, digests]: [Vec<String>; 2] = [file.list(LAMPS)?, file.list(DIGESTS)?];
    let tensor = file.tensor("direct", Dtype::F32, SHAPE)?;
    let wrong = || wrong_shape("direct", SHAPE, tensor.shape());
    let &[count, probes, rows, 3] = tensor.shape() else { return Err(wrong()) };
    if count != names.len() {
        return Err(Error::damaged(format!("there are {count} lamps and {} names", names.len())));
    }
    if count != digests.len() {
        return Err(Error::damaged(format!("there are {count} lamps and {} digests", digests.len())));
    }
    let degree = square("direct", rows, 2..=4)?;
    // With lamps, what the tensors hold bounds these numbers; without them, a number of probes means nothing.
    let probes = if count == 0 { 0 } else { probes };
    let columns = [probes, rows, 3];
    let columns = if count == 0 { &tensor.shape()[1..] } else { &columns[..] };
    let column = |name: &str| {
        let values = file.array(name, Dtype::F32, SHAPE, columns, f32::from_le_bytes)?;
        refuse_infinite(name, values.iter().copied(), ErrorKind::Damaged)?;
        Ok::<Vec<f32>, Error>(values)
    };
    let (direct, indirect) = (column("direct")?, column("indirect")?);
    let each = &columns[..1];
    let errors = file.array("errors", Dtype::F32, "[L, P]", each, f32::from_le_bytes)?;
    refuse_infinite("errors", errors.iter().copied(), ErrorKind::Damaged)?;
    let paths = file.array("paths", Dtype::U32, "[L, P]", each, u32::from_le_bytes)?;
    if probes == 0 && count > 0 || [errors.len(), paths.len()] != [count * probes; 2] {
        return Err(Error::damaged("the tensors of the lamps do not belong together"));
    }
    let length = 3 * rows * probes;
    let lamp = |lamp: usize| LampColumns {
        direct: direct[lamp * length..][..length].to_vec(),
        indirect: indirect[lamp * length..][..length].to_vec(),
        paths: paths[lamp * probes..][..probes].to_vec(),
        errors: errors[lamp * probes..][..probes].to_vec(),
    };
    if indirect.len() != direct.len() {
        return Err(Error::damaged("the tensors of the lamps do not belong together"));
    }
    Ok(ProbeLamps {
        names,
        digests,
        columns: (0..count).map(lamp).collect(),
        degree,
        probes,
        places_digest: file.digest(PLACES)?,
        surfaces: file.digest(SURFACES)?,
    })
}

/// The degree of (degree + 1)^2 rows, if it is in a range.
fn square(name: &str, rows: usize, range: std::ops::RangeInclusive<usize>) -> Result<Degree, Error> {
    let side = rows.isqrt();
    if side == 0 || side * side != rows || !range.contains(&(side - 1)) {
        let (least, most) = (range.start(), range.end());
        return Err(Error::damaged(format!(
            "tensor `{name}`: expected the rows of a degree from {least} to {most}, found {rows}"
        )));
    }
    degree(name, side - 1)
}

impl TensorFile<'_> {
    /// A digest among the metadata.
    pub(super) fn digest(&self, key: &str) -> Result<String, Error> {
        let found = self.metadata.get(key).cloned();
        found.ok_or_else(|| Error::damaged(format!("metadata `{key}`: expected a digest, found none")))
    }
}

#[cfg(test)]
mod tests {
    use probes::{Lattice, PlacesParts, Repair, Volume};

    use super::*;
    use crate::values::tensors::describe;

    fn degree(l: usize) -> Degree {
        Degree::new(l).unwrap()
    }

    fn transport(precision: TransportPrecision, emitters: usize) -> ProbeTransport {
        let volume = Volume::new("b".into(), [[0.0; 3], [1.0; 3]], [2, 1, 1], Lattice::Centres).unwrap();
        let places = ProbePlaces::from_parts(PlacesParts {
            positions: vec![[0.25, 0.5, 0.5], [0.75, 0.5, 0.5]],
            volumes: vec![volume],
            points: Vec::new(),
            back_share: vec![0.0; 2],
            inside_of: vec![None; 2],
            repairs: vec![Repair::None; 2],
            visible: vec![0; 2],
            reach: vec![255; 512],
        });
        let numbers = |count: usize| (0..count).map(|k| k as f32 / 8.0 - 3.0).collect::<Vec<f32>>();
        let parts = TransportParts {
            degree: degree(2),
            sky_degree: degree(3),
            channels: 3,
            emitters,
            sky: numbers(2 * 9 * 16 * 3),
            direct: numbers(2 * emitters * 27),
            indirect: numbers(2 * emitters * 27),
            paths: vec![4096, 8192],
            errors: vec![0.25, 0.5],
        };
        ProbeTransport {
            transport: Transport::from_parts(parts).unwrap(),
            precision,
            places: places.unwrap(),
            places_digest: "ab".into(),
            surfaces: "cd".into(),
            record: None,
        }
    }

    fn record() -> BakeRecord {
        let words = |count: u64| (0..count).map(|k| k * k).collect::<Vec<u64>>();
        BakeRecord {
            of_all: 7,
            contents: words(32 * 32 * 32),
            groups: words(65),
            places: words(2),
            cells: words(2 * 512),
            light: words(2 * 2),
        }
    }

    fn lamps(count: usize) -> ProbeLamps {
        let numbers = |count: usize, k: usize| (0..count).map(|i| (i * (k + 1)) as f32).collect::<Vec<f32>>();
        let columns = |k: usize| LampColumns {
            direct: numbers(2 * 27, k),
            indirect: numbers(2 * 27, k + 5),
            paths: vec![k as u32; 2],
            errors: vec![0.5; 2],
        };
        ProbeLamps {
            names: (0..count).map(|k| format!("lamp {k}")).collect(),
            digests: (0..count).map(|k| format!("ef{k}")).collect(),
            columns: (0..count).map(columns).collect(),
            degree: degree(2),
            probes: if count == 0 { 0 } else { 2 },
            places_digest: "ab".into(),
            surfaces: "cd".into(),
        }
    }

    #[test]
    fn transports_come_back() {
        for precision in [TransportPrecision::Half, TransportPrecision::Single] {
            for emitters in [0, 2] {
                let plain = transport(precision, emitters);
                let recorded = ProbeTransport { record: Some(record()), ..plain.clone() };
                for value in [plain, recorded] {
                    let bytes = encode_probe_transport(&value, None).unwrap();
                    assert_eq!(decode_probe_transport(&bytes).unwrap(), value);
                }
            }
        }
        for count in [0, 1, 3] {
            let bytes = encode_probe_lamps(&lamps(count), None).unwrap();
            assert_eq!(decode_probe_lamps(&bytes).unwrap(), lamps(count));
        }
        let bytes = encode_probe_transport(&transport(TransportPrecision::Half, 1), None).unwrap();
        let tensors = describe(&bytes).unwrap().tensors;
        assert_eq!(tensors[2], ("sky".to_owned(), "F16".to_owned(), vec![2, 9, 16, 3]));
    }

    /// Every length, and every byte changed: an error or a value that can be used, and never a panic.
    #[test]
    fn damaged_files_are_errors() {
        let whole = encode_probe_transport(&transport(TransportPrecision::Half, 1), None).unwrap();
        for length in 0..whole.len() {
            assert!(decode_probe_transport(&whole[..length]).is_err(), "cut at {length}");
        }
        let mut refused = 0;
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x81;
            match decode_probe_transport(&bytes) {
                Ok(value) => assert_eq!(value.places.len(), value.transport.len()),
                Err(_) => refused += 1,
            }
        }
        assert!(refused > 300, "{refused}");
        let whole = encode_probe_lamps(&lamps(2), None).unwrap();
        for length in 0..whole.len() {
            assert!(decode_probe_lamps(&whole[..length]).is_err(), "cut at {length}");
        }
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x81;
            if let Ok(value) = decode_probe_lamps(&bytes) {
                assert!(value.columns.iter().all(|columns| columns.paths.len() == value.probes));
            }
        }
    }

    #[test]
    fn a_record_of_bricks_is_consistent() {
        type Change = fn(&mut BakeRecord);
        let changes: [Change; 5] = [
            |record| record.contents.truncate(5),
            |record| record.places.truncate(1),
            |record| record.cells.extend([0; 512]),
            |record| record.light.truncate(2),
            |record| record.groups.truncate(64),
        ];
        for (at, change) in changes.iter().enumerate() {
            let mut value = transport(TransportPrecision::Half, 1);
            let mut wrong = record();
            change(&mut wrong);
            value.record = Some(wrong.clone());
            let message = encode_probe_transport(&value, None).unwrap_err().to_string();
            assert_eq!(message, "the record of the bricks is not consistent", "{at}");
            let mut file = Writer::new("probe-transport", None);
            file.record(&wrong);
            let bytes = file.finish();
            let message = TensorFile::open(&bytes).unwrap().record().unwrap_err().to_string();
            assert_eq!(message, "the tensors `bricks.*` do not belong together", "{at}");
        }
    }

    #[test]
    fn errors_name_what_is_wrong() {
        let mut value = transport(TransportPrecision::Half, 1);
        let parts = TransportParts {
            degree: degree(2),
            sky_degree: degree(2),
            channels: 1,
            emitters: 0,
            sky: vec![1e5; 2 * 81],
            direct: Vec::new(),
            indirect: Vec::new(),
            paths: vec![1; 2],
            errors: vec![0.0; 2],
        };
        value.transport = Transport::from_parts(parts.clone()).unwrap();
        let message = encode_probe_transport(&value, None).unwrap_err().to_string();
        assert_eq!(message, "tensor `sky`: expected finite values; number 0 is not");
        value.precision = TransportPrecision::Single;
        assert!(encode_probe_transport(&value, None).is_ok());
        let low = TransportParts { degree: degree(1), sky: vec![0.0; 2 * 36], ..parts };
        assert_eq!(Transport::from_parts(low), None);
        let mut wrong = lamps(2);
        wrong.names.pop();
        let message = encode_probe_lamps(&wrong, None).unwrap_err().to_string();
        assert_eq!(message, "the lamps are not all to the same probes");
    }
}
