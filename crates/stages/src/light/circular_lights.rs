//! Makes lights from disks: lamps with a given direction and size, without an environment.
//!
//! ```toml
//! [stage.lamps]
//! kind = "circular-lights"
//! source = "assets/lights/studio.toml"
//! degree = 4
//! ```
//!
//! `source` names TOML files that have one table `light` for each disk:
//!
//! ```toml
//! [[light]]
//! direction = [0.3, -0.5, 0.8]     # toward the light, +Z up; its length does not matter
//! angular_radius = 15.0            # degrees from the centre to the edge, above 0, at most 180
//! radiance = [10.0, 9.0, 7.0]      # one number is grey
//!
//! [[light]]
//! direction = [0, 0, 1]
//! solid_angle = 0.2                # or this instead of the radius, in steradians, at most 4 pi
//! irradiance = 3.0                 # or this instead of the radiance: of a surface that faces the light
//! ```
//!
//! A disk of radiance 1 and angular radius a about +Z has the coefficients (Kautz, Sloan and Snyder 2002,
//! section 3, in closed form)
//!
//! > L_00 = sqrt(pi) (1 - cos(a)), L_l0 = sqrt(pi / (2 l + 1)) (P_(l-1)(cos(a)) - P_(l+1)(cos(a))),
//!
//! and about a direction d L_lm = sqrt(4 pi / (2 l + 1)) L_l0 Y_lm(d). Small disks ring if they are
//! truncated at a low degree. So the disks stay separate lights next to an empty series, as suns and lamps
//! do in `project-sh`. Kinds that can add them exactly do so; the others use their series up to `degree`.
//! Maps contain the whole disk, or the part above the horizon, to 1.2e-3 of the highlight's peak at views
//! up to 60 degrees from the normal: a sun takes one evaluation of the material, a disk as wide as the
//! highlight about thirty, and one of ten times that width a few thousand. `lamps = "series"` puts the
//! disks into the series here. A `window` requires that, because it applies to a series. Disks of more than
//! 90 degrees are always in the series.

use std::f64::consts::{FRAC_PI_2, PI};

use engine::{
    Artifact, Context, Diagnostic, Document, Entry, Failure, Kind, Output, Parameter, Port, Product, Table,
    Value, ValueKind, parameters, unexpected, unknown_keys,
};
use sh::{Degree, Expansion, Light, Lighting};
use sphere::{DVec3, Direction};

use crate::values::{Lamps, Rgb, Window, artifacts};

parameters! {
    /// Parameters of `circular-lights`.
    pub(crate) struct Parameters {
        /// The degree of the series.
        #[range(0..=Degree::MAX.get())]
        degree: usize = 4,
        /// Whether the disks are separate lights or in the series. Default: "separate", or "series" with a
        /// window.
        #[was("lights")]
        lamps: Option<Lamps> = None,
        /// A window for the series, which reduces ringing; see `project-sh`.
        #[words(Window::None, Window::Hanning, Window::Lanczos)]
        window: Window = Window::None,
    }
}

/// The kind `circular-lights`.
pub(crate) struct CircularLights;

impl Kind for CircularLights {
    type Parameters = Parameters;

    const NAME: &'static str = "circular-lights";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[sh::revisions::WINDOW];
    const TEXT: &'static str = include_str!("circular_lights.rs");
    const SOURCE: bool = true;

    fn ports() -> Vec<Port> {
        Vec::new()
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Lighting::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        if parameters.window != Window::None && parameters.lamps == Some(Lamps::Separate) {
            return vec![("window", "only lamps = \"series\" uses it".into())];
        }
        Vec::new()
    }

    fn check_source(_: &Parameters, context: &Context<'_>) -> Result<(), Failure> {
        let path = context.files.source()?;
        let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        read(&file, &context.files.read(path)?).map(drop)
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let path = context.files.source()?;
        let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let disks = read(&file, &context.files.read(path)?)?;
        let degree = Degree::new(parameters.degree)?;
        let in_series = match parameters.lamps {
            Some(lamps) => lamps == Lamps::Series,
            None => parameters.window != Window::None,
        };
        let mut lighting = Lighting::from(Expansion::zero(degree));
        for Disk { direction, radius, radiance } in &disks {
            let flux = radiance.map(|radiance| radiance * 4.0 * PI * math::powi(math::sin(radius / 2.0), 2));
            if in_series || *radius > FRAC_PI_2 {
                let series = Expansion::disk(*direction, *radius, flux, degree);
                lighting = &lighting + &series.into();
            } else {
                lighting.lights.push(Light::from_flux(*direction, *radius, flux));
            }
        }
        if let Some(window) = parameters.window.fixed() {
            lighting.series = window.apply(&lighting.series);
        }
        let beside = lighting.lights.len();
        context.reporter.note(match beside {
            0 => format!("{} disks in a series of degree {}", disks.len(), degree.get()),
            _ if beside == disks.len() => format!("{beside} disks as lights, and an empty series"),
            _ => format!(
                "{} of {} disks are larger than 90 degrees and in the series",
                disks.len() - beside,
                disks.len()
            ),
        });
        Output::artifact(artifacts::Lighting(lighting))
    }
}

/// A disk of constant radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Disk {
    direction: Direction,
    /// The radius in radians, above 0 to pi.
    radius: f64,
    radiance: [f64; 3],
}

/// The disks of a file; all of its errors at once.
fn read(file: &str, bytes: &[u8]) -> Result<Vec<Disk>, Failure> {
    let document = Document::parse(file, bytes).map_err(|errors| Failure::new(errors.to_string()))?;
    let mut errors = Vec::new();
    unknown_keys(&document.table, &["light".to_owned()], &mut errors);
    let mut disks = Vec::new();
    match document.table.get("light").map(|entry| (&entry.value, &entry.value.kind)) {
        Some((_, ValueKind::Array(lights))) => {
            for light in lights {
                match &light.kind {
                    ValueKind::Table(table) => disks.extend(disk(table, &mut errors)),
                    _ => errors.push(unexpected(light, "a table: [[light]]")),
                }
            }
        }
        Some((value, _)) => errors.push(unexpected(value, "tables: [[light]]")),
        None => {}
    }
    if disks.is_empty() && errors.is_empty() {
        errors.push(
            Diagnostic::of_file("there are no lights").expected("expected a table [[light]] for each disk"),
        );
    }
    if errors.is_empty() {
        return Ok(disks);
    }
    Err(Failure::new(document.diagnostics(errors).to_string()))
}

fn disk(table: &Table, errors: &mut Vec<Diagnostic>) -> Option<Disk> {
    let before = errors.len();
    let known = ["direction", "angular_radius", "solid_angle", "radiance", "irradiance"].map(str::to_owned);
    unknown_keys(table, &known, errors);
    let mut one_of = |first: &str, second: &str| {
        let given = [table.get(first), table.get(second)];
        match given {
            [Some(_), Some(both)] => {
                errors.push(Diagnostic::at(
                    both.key_span.clone(),
                    format!("{second:?} and {first:?} exclude each other"),
                ));
            }
            [None, None] => {
                errors
                    .push(Diagnostic::at(table.span.clone(), format!("{first:?} or {second:?} is missing")));
            }
            _ => {}
        }
        given
    };
    let [angle, solid_angle] = one_of("angular_radius", "solid_angle");
    let [radiance, irradiance] = one_of("radiance", "irradiance");
    let radius = match (angle, solid_angle) {
        (Some(angle), _) => number(&angle.value, 180.0, "degrees above 0, at most 180", errors).to_radians(),
        (_, Some(solid)) => {
            let value = number(&solid.value, 4.0 * PI, "steradians above 0, at most 4 pi = 12.566", errors);
            // 4 pi sin^2(a / 2).
            2.0 * math::asin((value / (4.0 * PI)).sqrt().clamp(0.0, 1.0))
        }
        (None, None) => FRAC_PI_2,
    };
    let colour = |entry: &Entry, errors: &mut Vec<Diagnostic>| {
        Rgb::parse(&entry.value).map_err(|error| errors.push(error)).ok().map(|Rgb(rgb)| rgb)
    };
    let radiance = match (radiance, irradiance) {
        (Some(radiance), _) => colour(radiance, errors),
        (_, Some(irradiance)) => {
            // A disk past 90 degrees fills the hemisphere above a surface that faces it.
            let facing = PI * math::powi(math::sin(radius.min(FRAC_PI_2)), 2);
            colour(irradiance, errors).map(|rgb| rgb.map(|value| value / facing))
        }
        (None, None) => None,
    };
    let direction = match table.get("direction") {
        Some(entry) => {
            let numbers = Vec::<f64>::parse(&entry.value).ok();
            let vector = numbers.and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
            let direction = vector.and_then(|vector| Direction::new(DVec3::from_array(vector)));
            if direction.is_none() {
                errors.push(unexpected(&entry.value, "a direction [x, y, z], not all 0"));
            }
            direction
        }
        None => {
            errors.push(Diagnostic::at(table.span.clone(), "\"direction\" is missing"));
            None
        }
    };
    let (direction, radiance) = (direction?, radiance?);
    (errors.len() == before).then_some(Disk { direction, radius, radiance })
}

/// A number above 0; if it is not one, an error and any number.
fn number(value: &Value, most: f64, expected: &str, errors: &mut Vec<Diagnostic>) -> f64 {
    match f64::parse(value) {
        Ok(number) if number > 0.0 && number <= most => return number,
        Ok(_) => errors.push(unexpected(value, expected)),
        Err(error) => errors.push(error),
    }
    most
}
