//! The light at light probes.

use probes::{LitProbes, ProbePlaces};
use safetensors::tensor::Dtype;

use super::arrays::refuse_infinite;
use super::file::{TensorFile, Writer};
use crate::error::{Error, ErrorKind};

/// The numbers of a probe: 9 rows of red, green and blue.
const NUMBERS: usize = 27;

/// Probes with their light.
#[derive(Clone, Debug, PartialEq)]
pub struct Probes {
    /// Where they stand.
    pub places: ProbePlaces,
    /// The light of each, in the same order.
    pub light: LitProbes,
}

/// Probes with their light: `sh` [P, 9, 3] f32, radiance of degree 2, row l*l + l + m in Specula's frame;
/// `windows` \[P\] f32, the lambda of each probe's window, 0 for none; and the tensors of
/// [`encode_probe_places`](super::encode_probe_places).
///
/// # Errors
/// If a number is not finite, or there are not as many lights as places.
pub fn encode_probes(probes: &Probes, recipe: Option<&str>) -> Result<Vec<u8>, Error> {
    let Probes { places, light } = probes;
    let (count, rows) = (light.rows().len(), light.rows().as_flattened().as_flattened());
    if count != places.len() {
        let message = format!("there is light for {count} probes, and there are {}", places.len());
        return Err(Error::new(ErrorKind::Unwritable, message));
    }
    refuse_infinite("sh", rows.iter().copied(), ErrorKind::Unwritable)?;
    let mut file = Writer::new("probes", recipe);
    file.numbers("sh", &[count, NUMBERS / 3, 3], rows);
    file.numbers("windows", &[count], light.windows());
    file.places(places);
    Ok(file.finish())
}

/// Probes with their light, from a file of kind `probes`.
///
/// # Errors
/// The errors of [`super::decode_probe_places`], and errors if the light is not that of these places.
pub fn decode_probes(bytes: &[u8]) -> Result<Probes, Error> {
    let file = TensorFile::open_as(bytes, "probes")?;
    let numbers = file.array("sh", Dtype::F32, "[P, 9, 3]", &[NUMBERS / 3, 3], f32::from_le_bytes)?;
    refuse_infinite("sh", numbers.iter().copied(), ErrorKind::Damaged)?;
    let rows = numbers.as_chunks::<3>().0.as_chunks::<9>().0.to_vec();
    let windows = file.array("windows", Dtype::F32, "[P]", &[], f32::from_le_bytes)?;
    let places = file.places()?;
    if rows.len() != places.len() {
        let message = format!("there is light for {} probes, and there are {}", rows.len(), places.len());
        return Err(Error::damaged(message));
    }
    let light = LitProbes::from_parts(rows, windows)
        .ok_or_else(|| Error::damaged("tensor `windows`: expected a number of 0 or more for each probe"))?;
    Ok(Probes { places, light })
}

#[cfg(test)]
mod tests {
    use probes::{Lattice, PlacesParts, Repair, Volume};

    use super::*;
    use crate::values::tensors::{decode_probe_places, describe, encode_probe_places, read_recipe};

    /// A box of eight probes, of which one was moved, one is filled and one lost, and a point.
    fn places() -> ProbePlaces {
        let bounds = [[0.0, 0.0, -1.0], [2.0, 1.5, 1.0]];
        let volume = Volume::new("a \"hall\"".into(), bounds, [2; 3], Lattice::Corners).unwrap();
        let mut positions: Vec<[f32; 3]> =
            (0..8).map(|index| volume.position(volume.cell(index))).chain([[5.0; 3]]).collect();
        positions[3][0] += 0.25;
        let mut repairs = vec![Repair::None; 9];
        repairs[3] = Repair::Moved;
        repairs[4] = Repair::Filled(vec![(0, 0.25), (1, 0.75)]);
        repairs[6] = Repair::Lost(7);
        let mut inside_of = vec![None; 9];
        inside_of[6] = Some(12);
        ProbePlaces::from_parts(PlacesParts {
            volumes: vec![volume],
            points: vec![[5.0; 3]],
            positions,
            back_share: (0..9).map(|k| k as f32 / 9.0).collect(),
            inside_of,
            repairs,
            visible: (0..9).collect(),
            reach: (0..8 * 256).map(|k| k as u8).collect(),
        })
        .unwrap()
    }

    fn probes() -> Probes {
        let row = |k: usize| [0, 1, 2].map(|channel| (k + channel) as f32 / 7.0 - 3.0);
        let rows = (0..9).map(|probe| std::array::from_fn(|k| row(9 * probe + k))).collect();
        let windows = vec![0.0, 0.5, f32::INFINITY, 0.0, 0.0, 0.0, 0.0, 0.0, 1e-3];
        Probes { places: places(), light: LitProbes::from_parts(rows, windows).unwrap() }
    }

    #[test]
    fn places_and_light_come_back() {
        let bytes = encode_probe_places(&places(), "ab", Some("{}"));
        assert_eq!(decode_probe_places(&bytes).unwrap(), (places(), "ab".to_owned()));
        assert_eq!(read_recipe(&bytes).as_deref(), Some("{}"));
        let bytes = encode_probes(&probes(), None).unwrap();
        assert_eq!(decode_probes(&bytes).unwrap(), probes());
        let tensors = describe(&bytes).unwrap().tensors;
        assert_eq!(tensors[0], ("sh".to_owned(), "F32".to_owned(), vec![9, 9, 3]));
        let bounds = [[4.0, 1.0, 0.0], [5.0, 2.0, 2.0]];
        let volume = Volume::with_spacing("b".into(), bounds, 1.0, Lattice::Centres).unwrap();
        let empty = PlacesParts {
            volumes: vec![volume],
            points: Vec::new(),
            positions: Vec::new(),
            back_share: Vec::new(),
            inside_of: Vec::new(),
            repairs: Vec::new(),
            visible: Vec::new(),
            reach: Vec::new(),
        };
        assert!(ProbePlaces::from_parts(empty).is_err());
    }

    /// Every length, and every byte changed: an error or a value that can be used, and never a panic.
    #[test]
    fn damaged_files_are_errors() {
        let whole = encode_probes(&probes(), None).unwrap();
        for length in 0..whole.len() {
            assert!(decode_probes(&whole[..length]).is_err(), "cut at {length}");
        }
        let places = encode_probe_places(&places(), "ab", None);
        for length in 0..places.len() {
            assert!(decode_probe_places(&places[..length]).is_err(), "cut at {length}");
        }
        let mut refused = 0;
        for at in 0..whole.len() {
            for change in [0x01, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] ^= change;
                match decode_probes(&bytes) {
                    Ok(Probes { places, light }) => {
                        assert_eq!(places.len(), light.rows().len());
                        let found = light.irradiance(&places, [0.5, 0.7, 0.1], [0.0, 0.0, 1.0]);
                        assert!(found.is_some());
                        places.dilate(&mut vec![1.0; places.len()], 1);
                    }
                    Err(_) => refused += 1,
                }
            }
        }
        assert!(refused > 1000, "{refused}");
    }

    #[test]
    fn errors_name_what_is_wrong() {
        let error = |change: &dyn Fn(&mut PlacesParts)| {
            let places = places();
            let mut parts = PlacesParts {
                volumes: places.volumes().to_vec(),
                points: places.points().to_vec(),
                positions: places.positions().to_vec(),
                back_share: places.back_share().to_vec(),
                inside_of: vec![None; 9],
                repairs: places.repairs().to_vec(),
                visible: places.visible().to_vec(),
                reach: places.reach().to_vec(),
            };
            change(&mut parts);
            ProbePlaces::from_parts(parts).unwrap_err()
        };
        assert_eq!(error(&|parts| parts.positions[0][1] = f32::NAN), "positions");
        assert_eq!(error(&|parts| parts.back_share[0] = 1.5), "shares of backs");
        assert_eq!(error(&|parts| parts.repairs[0] = Repair::Lost(9)), "repairs");
        assert_eq!(error(&|parts| parts.repairs[0] = Repair::Filled(vec![(1, f32::NAN)])), "repairs");
        assert_eq!(error(&|parts| parts.visible[0] = 1 << 26), "visible neighbours");
        assert_eq!(error(&|parts| parts.reach.truncate(255)), "reaches");
        assert_eq!(error(&|parts| parts.volumes[0].counts = [usize::MAX; 3]), "volumes");
        let light = LitProbes::from_parts(vec![[[0.0; 3]; 9]; 8], vec![0.0; 8]).unwrap();
        let message = encode_probes(&Probes { places: places(), light }, None).unwrap_err().to_string();
        assert_eq!(message, "there is light for 8 probes, and there are 9");
        let mut bytes = encode_probes(&probes(), None).unwrap();
        let first = bytes.windows(4).position(|word| word == (-3.0_f32).to_le_bytes()).unwrap();
        bytes[first..first + 4].copy_from_slice(&f32::NAN.to_le_bytes());
        let message = decode_probes(&bytes).unwrap_err().to_string();
        assert_eq!(message, "tensor `sh`: expected finite values; number 0 is not");
    }
}
