//! The values of options: how their texts are parsed.
//!
//! # Errors
//! Each parser says what it expects if the text is something else.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use ::preview::{Mode, SubjectRequest};
use engine::nearest;
use stages::ENGINES;

/// The parts of a subject.
const PARTS: [&str; 3] = ["environment", "material", "mesh"];

/// The longest side of a still, in pixels.
const LONGEST_SIDE: u32 = 8192;

/// A size in bytes: a number and an optional unit. K, M, G and T are powers of 1000, as in `quantity::size`,
/// Ki to Ti powers of 1024; a B may follow, and case does not count: `500M`, `1.5 GB`, `2GiB`, `1000000`.
pub(super) fn bytes(text: &str) -> Result<u64, String> {
    let expected = || "expected a number and a unit, such as 500M, 20GB, 512MiB or 0".to_owned();
    let text = text.trim();
    let split = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let number: f64 = text[..split].parse().map_err(|_| expected())?;
    let unit = text[split..].trim_start().to_ascii_lowercase();
    let factor = match unit.strip_suffix('b').unwrap_or(&unit) {
        "" => 1.0,
        unit => {
            let (letter, base) = unit.strip_suffix('i').map_or((unit, 1000.0), |letter| (letter, 1024.0));
            let power = ["", "k", "m", "g", "t"].iter().position(|known| *known == letter);
            let power = power.filter(|power| *power > 0).ok_or_else(expected)?;
            f64::powi(base, i32::try_from(power).unwrap_or_default())
        }
    };
    let bytes = (number * factor).round();
    // An f64 holds every whole number up to 2^53; no disk is so large.
    if bytes < (1_u64 << 53) as f64 { Ok(bytes as u64) } else { Err(expected()) }
}

/// `environment=sky,material=gold,mesh=sphere`: any of the parts, in any order. A name may contain commas.
pub(super) fn subject(text: &str) -> Result<SubjectRequest, String> {
    let mut parts = Vec::<(&str, String)>::new();
    for piece in text.split(',') {
        match (piece.split_once('='), parts.last_mut()) {
            (Some((part, name)), _) if PARTS.contains(&part.trim()) => {
                parts.push((part.trim(), name.trim().to_owned()));
            }
            (Some((part, _)), _) => {
                return Err(unknown(&format!("part {:?}", part.trim()), part.trim(), &PARTS));
            }
            (None, Some((_, name))) => *name = format!("{name},{piece}"),
            (None, None) => return Err("expected environment=NAME, material=NAME or mesh=NAME".into()),
        }
    }
    let mut request = SubjectRequest::default();
    for (part, name) in parts {
        if name.is_empty() {
            return Err(format!("{part} has no name"));
        }
        let field = match part {
            "environment" => &mut request.environment,
            "material" => &mut request.material,
            _ => &mut request.mesh,
        };
        if field.replace(name).is_some() {
            return Err(format!("{part} appears twice"));
        }
    }
    Ok(request)
}

/// An address to serve at: `PORT`, `IP` or `IP:PORT`.
pub(super) fn address(text: &str) -> Result<SocketAddr, String> {
    let here = IpAddr::V4(Ipv4Addr::LOCALHOST);
    let of_localhost = text.strip_prefix("localhost:").unwrap_or(text);
    text.parse::<SocketAddr>()
        .or_else(|_| of_localhost.parse::<u16>().map(|port| SocketAddr::new(here, port)))
        .or_else(|_| text.parse::<IpAddr>().map(|ip| SocketAddr::new(ip, 0)))
        .map_err(|_| {
            "expected an address such as 127.0.0.1:8080, or a port; to use the default, write other words before \
             --serve"
                .into()
        })
}

/// The help of `--preset` of `convert`, which lists the engines that load a cube.
pub(super) fn engines_of_cubes() -> String {
    let cubes = ENGINES.iter().filter(|engine| engine.loads_cube()).map(|engine| engine.name);
    let names = cubes.collect::<Vec<_>>().join(", ");
    format!("The engine for which a cube in a texture was made: {names} [default: as the file says]")
}

/// Texels of a sky, or none of it.
pub(super) fn sky(text: &str) -> Result<String, String> {
    let is_number = text.parse::<u32>().is_ok_and(|texels| texels > 0);
    match is_number || text == "none" {
        true => Ok(text.to_owned()),
        false => Err("expected a whole number of texels, or \"none\"".into()),
    }
}

pub(super) fn engine(text: &str) -> Result<String, String> {
    let names: Vec<_> = ENGINES.iter().map(|engine| engine.name).collect();
    if names.contains(&text) { Ok(text.to_owned()) } else { Err(unknown("such engine", text, &names)) }
}

/// The help of `--engine` of `convert`.
pub(super) fn engines_to_convert_for() -> String {
    format!("Write the light and the sky that an engine loads, and the code for them. {}", engines())
}

/// The help of `--engine` of `init`.
pub(super) fn engine_of_a_project() -> String {
    format!("{}, that loads the light [default: asks on a terminal, otherwise gltf]", engines())
}

/// The help of `--preset` of `test-pattern`, which lists the engines.
pub(super) fn engines() -> String {
    let names: Vec<_> = ENGINES.iter().map(|engine| engine.name).collect();
    let (last, first) = names.split_last().map_or(("", &[][..]), |(last, first)| (*last, first));
    format!("The engine: {} or {last}", first.join(", "))
}

/// The help of `--mode`, which lists them.
pub(super) fn modes() -> String {
    let [first @ .., last] = Mode::ALL.map(Mode::name);
    format!("The first shading mode: {} or {last}", first.join(", "))
}

pub(super) fn mode(text: &str) -> Result<Mode, String> {
    Mode::from_name(text).ok_or_else(|| unknown("such mode", text, &Mode::ALL.map(Mode::name)))
}

/// `1280x720`
pub(super) fn picture_size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once(['x', 'X']);
    let sides = sides.and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    let sides = sides.filter(|sides: &[u32; 2]| sides.iter().all(|side| (1..=LONGEST_SIDE).contains(side)));
    sides.ok_or_else(|| format!("expected two numbers from 1 to {LONGEST_SIDE}, such as 1280x720"))
}

/// A number of stops.
pub(super) fn exposure(text: &str) -> Result<f64, String> {
    let stops = text.parse().ok().filter(|stops: &f64| stops.abs() <= 24.0);
    stops.ok_or_else(|| "expected a number of stops from -24 to 24, such as -1.5".into())
}

/// A number of lights, or all.
pub(super) fn lights(text: &str) -> Result<String, String> {
    let is_count = text == "all" || text.parse::<u32>().is_ok();
    let wrong = || "expected a whole number of lights, or \"all\"".into();
    is_count.then(|| text.to_owned()).ok_or_else(wrong)
}

pub(super) fn png_file(text: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(text);
    let is_png = file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
    if is_png { Ok(file) } else { Err("the picture is a PNG, so its name must end in .png".into()) }
}

fn unknown(what: &str, name: &str, known: &[&str]) -> String {
    match nearest(name, known.iter().copied()) {
        Some(near) => format!("there is no {what}; did you mean {near:?}?"),
        None => format!("there is no {what}, only {}", known.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_people_write_them() {
        for (text, expected) in [
            ("0", 0),
            ("1000000", 1_000_000),
            ("12b", 12),
            ("1k", 1000),
            ("1 kB", 1000),
            ("500M", 500_000_000),
            ("500MB", 500_000_000),
            ("20GB", 20_000_000_000),
            ("1.5 GB", 1_500_000_000),
            ("1T", 1_000_000_000_000),
            ("4KiB", 4096),
            ("64mib", 64 << 20),
            ("2gi", 2 << 30),
            ("1.5GiB", 3 << 29),
            ("2TiB", 2 << 40),
        ] {
            assert_eq!(bytes(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn other_texts_are_refused_with_an_example() {
        let texts = "|M|GiB|-1|-5M|1e3|5X|5MM|5iB|1..5M|1.2.3G|12 parsecs|1MiBs|9999999TiB|99999999T|nan";
        for text in texts.split('|') {
            let error = bytes(text).unwrap_err();
            assert!(error.contains("512MiB"), "{text}: {error}");
        }
    }

    #[test]
    fn a_subject_is_parts_with_names_that_may_contain_commas() {
        let some = |name: &str| Some(name.to_owned());
        let request = subject("material=gold, warm (shine),environment=sky").unwrap();
        let expected = SubjectRequest {
            environment: some("sky"),
            material: some("gold, warm (shine)"),
            ..SubjectRequest::default()
        };
        assert_eq!(request, expected);
        assert_eq!(
            subject("mesh=sphere").unwrap(),
            SubjectRequest { mesh: some("sphere"), ..SubjectRequest::default() }
        );
        for (text, words) in [
            ("", "expected environment=NAME"),
            ("sky", "expected environment=NAME"),
            ("enviroment=sky", "did you mean \"environment\"?"),
            ("mesh=a,colour=b", "only environment, material, mesh"),
            ("mesh=", "mesh has no name"),
            ("mesh=a,mesh=b", "mesh appears twice"),
        ] {
            let message = subject(text).unwrap_err();
            assert!(message.contains(words), "{text}: {message}");
        }
    }

    #[test]
    fn every_mode_is_known_by_its_name_and_a_near_one_is_suggested() {
        for known in Mode::ALL {
            assert_eq!(mode(known.name()), Ok(known));
        }
        assert_eq!(mode("cabrel").unwrap_err(), "there is no such mode; did you mean \"cabral\"?");
        assert!(mode("x-ray-vision").unwrap_err().contains("only local-shrm, global-shrm"));
    }

    #[test]
    fn a_page_is_served_at_an_address_or_a_port() {
        for (text, address) in [
            ("8080", "127.0.0.1:8080"),
            ("localhost:0", "127.0.0.1:0"),
            ("0.0.0.0", "0.0.0.0:0"),
            ("[::1]:80", "[::1]:80"),
            ("192.168.0.7:9000", "192.168.0.7:9000"),
        ] {
            assert_eq!(super::address(text), Ok(address.parse().unwrap()), "{text}");
        }
        for text in ["maps", "", "70000", "example.com:80"] {
            assert!(super::address(text).is_err(), "{text}");
        }
    }
}
