//! Reflects a lighting off a material, and gives the reflected light field in spherical harmonics.
//!
//! ```toml
//! [stage.reflection]
//! kind = "convolve"
//! inputs = { lighting = "lighting", brdf = "coefficients" }
//! ```
//!
//! For a radially symmetric material (P = 0), such as `lambert` and `phong`, the field is a function of one
//! direction, and this is the convolution of Ramamoorthi and Hanrahan (2002):
//!
//! > B_lm = Lambda_l rho_l L_lm, with Lambda_l = sqrt(4 pi / (2 l + 1))
//!
//! In general the field depends on the view too, and its coefficients are
//!
//! > B_lmpq = L_lm rho_lpq,
//!
//! l up to F for the central direction (the reflection vector, the normal or the tangent, depending on the
//! material), p up to P for the view about it. The artifact holds the two factors. `export-shrm` makes
//! reflection maps from them with (P+1)^2 coefficients in each texel; only P+1 of these are not zero if the
//! material does not depend on the azimuth. `export-reflection-map` makes one plain map, which is exact for
//! P = 0.
//!
//! ## Degrees
//!
//! If neither `project-sh` nor `project-brdf` sets a degree, this stage chooses F and P for each pair: the
//! least P, at most 16, and then the least F, for which the truncation is not visible. To find them it
//! evaluates B toward the views of a ball, with all degrees and with fewer, and compares the two in stops,
//! |log2((cut + e) / (uncut + e))| with e = 1 % of the mean radiance. P leaves 95 % of the views within 0.06
//! stops and 99 % within 0.12, if any P up to 16 does, and F adds at most 0.015 and 0.05 to these. The
//! build notes F, P and these errors. Suns and lamps are not truncated: they stay separate from the
//! coefficients, with the material that reflects them, until an export puts them into its map.
//!
//! Every export starts from this field, so it has the degrees that the most accurate export needs; the
//! files of `export-shrm` grow with P, so it uses fewer. To make the field smaller for all exports, set
//! `accept`, the stops by which the truncation at P may change 95 % and 99 % of the views, or `error`, the
//! RMS error of the truncation as a share of the RMS radiance [RH02, sec. 5], without lamps. P is then the
//! least one up to `most-p` that meets it. If none does, it is the best of those up to 4, and a warning
//! says what error it reaches. There is no window unless you set one.
//!
//! If `project-brdf` sets degrees, lighting and material are truncated to the smaller degree of the two, so
//! light that the material blurs away, or detail that the lighting lacks, costs nothing. If the lighting
//! has the smaller degree, the note says so, because the material then looks blurrier than it is. Separate
//! lamps stay separate; `lamps = "series"` of `project-sh` puts them into the series. Only if coefficients
//! arrive without their material, from your own program, do the lamps have to go into the series, with a
//! warning.
//!
//! If such a truncation is visible, a warning says by how much: if 5 % of the views are off by more than
//! 0.1 stop, or if more than 0.5 % of them are below zero by a tenth of e, and so black in a picture. It
//! recommends the better remedy, to set no degree or to set a window, if that removes at least half of the
//! error.
//!
//! ## Parts
//!
//! A material with a matte base under a highlight has two centres. In addition to the field of both about
//! the reflection vector, which previews and reports use, this stage keeps a field for each part about its
//! own centre, with its own F and P, for exports that write a map for each. Their degrees are chosen so
//! that the truncation of their sum is not visible, by the same measure; the note has the errors.
//!
//! ## Windows
//!
//! A `window` scales the terms of each l (see `project-sh`), which reduces the ringing of a truncation and
//! blurs sharp details. `"auto"` uses the weakest window that helps if no degrees are enough, and otherwise
//! none; with degrees in the manifest, with `accept` and with `error` it uses none.

use brdf::{BrdfCoefficients, Material};
use containers::tensors::{self, DegreeSource};
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, Reporter, Steps, parameters};
use sh::{Expansion, Lighting, Stop, Stopped};
use shrm::degrees::{BLACK_SHARE, Cut, ForLight};
use shrm::ringing::{CutError, CutStudy};
use shrm::{DegreeRule, Lamps, MOST_P, MapTolerance, Reflection, Terms, TurnedLight};

use super::degree_choice::{ACCEPT, Accept, DegreeChoice, MAX_P, missed};
use crate::values::{UntilStopped, Window, about, artifacts, percent};

parameters! {
    /// Parameters of `convolve`.
    pub(crate) struct Parameters {
        /// The window, which reduces ringing; see Windows.
        #[words(Window::Auto, Window::None, Window::Lanczos, Window::Hanning)]
        window: Window = Window::Auto,
        /// The errors in stops that 5 % and 1 % of the views may exceed because of P; see Degrees. Default:
        /// so small that the truncation is not visible.
        accept: Option<Accept> = None,
        /// The RMS error that P may leave, as a share of the RMS radiance, instead of `accept`.
        #[range(1e-6..1.0)]
        error: Option<f64> = None,
        /// With `accept` or `error`: the highest P that is tried. Default: 16.
        #[range(0..=MAX_P)]
        most_p: Option<usize> = None,
    }
}

impl Parameters {
    fn choice(&self) -> DegreeChoice {
        DegreeChoice { accept: self.accept, error: self.error, most_p: self.most_p }
    }

    /// The rule for P, if the manifest has one.
    fn rule(&self, brdf: &BrdfCoefficients) -> Option<DegreeRule> {
        let terms = if brdf.is_azimuth_free() { Terms::Zonal } else { Terms::All };
        self.choice().tolerance().map(|_| self.choice().rule(ACCEPT, MOST_P, terms))
    }
}

/// The windows that are tried, from the weakest on.
const WINDOWS: [(&str, sh::Window); 2] = [("lanczos", sh::Window::Lanczos), ("hanning", sh::Window::Hanning)];

/// The error in stops that a ring may have before it is worth a warning.
const RING: f64 = 0.1;

/// The share of samples that may be below zero.
const NEGATIVE: f64 = 0.005;

/// A remedy is named if it takes what shows to this share.
const HELPS: f64 = 0.5;

/// The kind `convolve`.
pub(crate) struct Convolve;

impl Kind for Convolve {
    type Parameters = Parameters;

    const NAME: &'static str = "convolve";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[
        sh::revisions::ROTATION,
        sh::revisions::WINDOW,
        shrm::revisions::DEGREES,
        brdf::revisions::MODELS,
        brdf::revisions::PROJECTION,
    ];
    const TEXT: &'static str = include_str!("convolve.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Lighting>("lighting"), Port::one::<artifacts::Brdf>("brdf")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Reflection::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        let mut errors = parameters.choice().check();
        if parameters.most_p.is_some() && parameters.choice().tolerance().is_none() {
            errors.push(("most-p", "only accept or error uses it".into()));
        }
        errors
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let lighting = &context.inputs.get::<artifacts::Lighting>("lighting")?.0;
        let brdf = &context.inputs.get::<artifacts::Brdf>("brdf")?.0;
        let (given, rule) = (parameters.window.fixed(), parameters.rule(&brdf.coefficients));
        let for_light = brdf.degrees == DegreeSource::Light;
        if rule.is_some() && !(for_light && brdf.material.is_some()) {
            let own = if parameters.error.is_some() { "error" } else { "accept" };
            let what = format!("{own} chooses P, but the coefficients already have a given P");
            let help = format!("{}, or `{own}` here", without_degrees(brdf.degrees));
            return Err(Failure::new(what).help(help));
        }
        let windowed = |reflection: &Reflection| match given {
            Some(window) => reflection.windowed(window),
            None => reflection.clone(),
        };
        let dark = BLACK_SHARE * lighting.mean();
        let reflection = match &brdf.material {
            Some(material) if for_light => {
                let searches = if brdf.parts.is_some() { 3 } else { 1 };
                let steps = Steps::new(reporter, 2 * searches * shrm::degrees::STEPS);
                let light = context.inputs.digest("lighting")?;
                let turned = |series: &Expansion, brdf: &BrdfCoefficients, stop: Stop<'_>| {
                    // One for all materials: it grows to the highest degrees that any of them needed.
                    let needed = TurnedLight::needed(series, brdf);
                    let with = |kept: &TurnedLight| std::array::from_fn(|k| kept.degrees()[k].max(needed[k]));
                    let is_enough = |kept: &TurnedLight| with(kept) == kept.degrees();
                    context.derived.get_enough("turned light", light, is_enough, |kept| {
                        let turned = TurnedLight::for_choice(series, kept.map_or(needed, with), stop)?;
                        let bytes = turned.bytes();
                        Ok((turned, bytes))
                    })
                };
                let found = steps.until_stopped(|stop| {
                    let turned = |series: &_, brdf: &_| turned(series, brdf, stop);
                    Reflection::for_light_by(rule, (lighting, &turned), &brdf.coefficients, material, stop)
                })?;
                let (reflection, cut) = (&found.reflection, found.cut);
                reporter.note(format!(
                    "{}; {}{}",
                    degrees(reflection, cut.f.get()),
                    lost(&cut, rule),
                    beside(reflection)
                ));
                if let Some(rule) = rule.filter(|_| !cut.map.is_met) {
                    reporter.warn(missed(rule, &cut.map));
                }
                let reflection = if given.is_none() && rule.is_none() && cut.shows() {
                    let (reflection, error) =
                        reporter.until_stopped(|stop| least_window(&found, dark, reporter, stop))?;
                    if error.negative > NEGATIVE || error.p95 > RING {
                        reporter.warn(format!(
                            "the highest degrees are too low for a highlight this sharp: {}; a larger \
                             roughness, or the levels of prefilter and export-engine, which have no degree, \
                             do not ring",
                            told(&error)
                        ));
                    }
                    reflection
                } else {
                    windowed(reflection)
                };
                match material.split().zip(brdf.parts.as_ref()) {
                    Some(([diffuse, specular], parts)) => {
                        let parts = [(&parts[0], &diffuse), (&parts[1], &specular)];
                        let ForLight { reflection: parts, cut, .. } = steps.until_stopped(|stop| {
                            let turned = |series: &_, brdf: &_| turned(series, brdf, stop);
                            Reflection::parts_for_light_by(rule, (lighting, &turned), parts, stop)
                        })?;
                        let parts = parts.map(|part| windowed(&part));
                        let [diffuse, specular] =
                            parts.each_ref().map(|part| [part.brdf().f().get(), part.brdf().p().get()]);
                        reporter.note(format!(
                            "[F, P] of its parts: diffuse {diffuse:?}, specular {specular:?}; in their sum 95 % of views are \
                             within {:.3} stops, 99 % within {:.3}",
                            cut.map.p95, cut.map.p99
                        ));
                        reflection.with_parts(parts)
                    }
                    None => reflection,
                }
            }
            material => {
                let reflection = windowed(&at_named_degrees(lighting, brdf, reporter));
                reporter.note(format!(
                    "{}{}",
                    degrees(&reflection, brdf.coefficients.f().get()),
                    beside(&reflection)
                ));
                if let Some(material) = material {
                    reporter.check_cancelled()?;
                    warn_of_rings(&reflection, (lighting, brdf, material), dark, reporter)?;
                }
                reflection
            }
        };
        Output::artifact(artifacts::Reflection(reflection))
    }
}

/// The reflection at degrees that the manifest names, with the lamps beside it if the material is known.
fn at_named_degrees(lighting: &Lighting, brdf: &tensors::Brdf, reporter: &Reporter) -> Reflection {
    let lamps = lighting.lights.len();
    let kept = brdf.material.as_ref().filter(|_| lamps > 0);
    if lamps > 0 && kept.is_none() {
        reporter.warn(format!(
            "the coefficients arrive without their material, so the lamps of the lighting ({lamps}) go into \
             its series, which then rings around them; set lamps = \"series\" in project-sh to confirm this"
        ));
    }
    let series = if kept.is_some() { lighting.series.clone() } else { lighting.whole() };
    let field = |coefficients: &BrdfCoefficients, material: Option<Material>| {
        let field = Reflection::convolve(&series, coefficients);
        match material {
            Some(material) => field.with_lamps(Lamps { lights: lighting.lights.clone(), material }),
            None => field,
        }
    };
    let whole = field(&brdf.coefficients, kept.cloned());
    match &brdf.parts {
        Some([diffuse, specular]) => {
            let [matte, highlight] =
                kept.and_then(Material::split).map_or([None, None], |parts| parts.map(Some));
            whole.with_parts([field(diffuse, matte), field(specular, highlight)])
        }
        None => whole,
    }
}

/// The reflection with the weakest window that takes it nearer to the one that is not cut, and its error.
fn least_window(
    found: &ForLight<Reflection>,
    dark: f64,
    reporter: &Reporter,
    stop: Stop<'_>,
) -> Result<(Reflection, CutError), Stopped> {
    let windows = [sh::Window::None].into_iter().chain(WINDOWS.map(|(_, window)| window));
    let samples = found.samples(&windows.collect::<Vec<_>>(), stop)?;
    let mut errors = samples.iter().map(|samples| samples.error(&found.uncut, dark));
    let (mut best, mut least) = (None, errors.next().unwrap_or_default());
    for ((name, window), error) in WINDOWS.into_iter().zip(errors) {
        if error.p95 < least.p95 && error.p99 < least.p99 {
            reporter.note(format!("window {name}: 95 % of views are within {:.3} stops", error.p95));
            (best, least) = (Some(window), error);
        }
    }
    let reflection = &found.reflection;
    Ok((best.map_or_else(|| reflection.clone(), |window| reflection.windowed(window)), least))
}

/// The remedy against the degrees of project-brdf: without the parameter that the manifest has there.
fn without_degrees(degrees: DegreeSource) -> &'static str {
    match degrees {
        DegreeSource::Tolerance(_) => "leave out `tolerance` in project-brdf",
        DegreeSource::Named | DegreeSource::Light => "leave out `degree` in project-brdf",
    }
}

/// Warns if a cut at degrees of the manifest shows, with the remedy that helps most.
fn warn_of_rings(
    reflection: &Reflection,
    (lighting, brdf, material): (&Lighting, &tensors::Brdf, &Material),
    dark: f64,
    reporter: &Reporter,
) -> Result<(), Failure> {
    let shows = |error: &CutError| error.negative > NEGATIVE || error.p95 > RING;
    let of = (lighting, material);
    let study = reporter.until_stopped(|stop| CutStudy::of(reflection, of, dark, shows, stop))?;
    let Some(study) = study else { return Ok(()) };
    let error = study.error;
    let mut best = (without_degrees(brdf.degrees), study.by_light);
    for (remedy, error) in
        [("set window = \"lanczos\"", study.lanczos), ("set window = \"hanning\"", study.hanning)]
    {
        if score(&error) < score(&best.1) {
            best = (remedy, error);
        }
    }
    let [f, p] = [brdf.coefficients.f().get(), brdf.coefficients.p().get()];
    let cause = match brdf.degrees {
        DegreeSource::Tolerance(tolerance) => {
            format!("tolerance {tolerance} is too large here, it takes degrees [{f}, {p}]")
        }
        DegreeSource::Named | DegreeSource::Light => format!("degree [{f}, {p}] is too low here"),
    };
    let mut text = format!("{cause}: {}", told(&error));
    if score(&best.1) < HELPS * score(&error) {
        text.push_str(&format!("; {}", best.0));
        if score(&best.1) > 1.0 {
            text.push_str(&format!(", after which {}", told(&best.1)));
        }
    }
    if study.negative_light > NEGATIVE {
        text.push_str(
            "; the series of the lighting is black around its suns: leave out `degree` and `tolerance` in \
             project-sh",
        );
    }
    reporter.warn(text);
    Ok(())
}

/// The measure by which an error is past the limits.
fn score(error: &CutError) -> f64 {
    (error.p95 / RING).max(error.negative / NEGATIVE)
}

/// Says what shows of an error: `28 % of the views turn black, and 5 % are off by more than 0.45 stops`.
fn told(error: &CutError) -> String {
    let black =
        (error.negative > NEGATIVE).then(|| format!("{} of the views turn black", about(error.negative)));
    match black {
        Some(black) if error.p95 > RING => {
            format!("{black}, and 5 % are off by more than {:.2} stops", error.p95)
        }
        Some(black) => black,
        None => format!("5 % of the views are off by more than {:.2} stops", error.p95),
    }
}

/// Says what a cut at the chosen degrees loses.
fn lost(cut: &Cut, rule: Option<DegreeRule>) -> String {
    let stops = format!("95 % of views are within {:.3} stops, 99 % within {:.3}", cut.map.p95, cut.map.p99);
    match rule.map(|rule| rule.tolerance) {
        Some(MapTolerance::Rms(_)) => format!("{stops}; the RMS error of P is {}", percent(cut.map.rms)),
        Some(MapTolerance::Stops(_)) | None => stops,
    }
}

/// Says what is not cut.
fn beside(reflection: &Reflection) -> String {
    match reflection.lamps().map_or(0, |lamps| lamps.lights.len()) {
        0 => String::new(),
        1 => "; 1 lamp is kept separate".to_owned(),
        lamps => format!("; {lamps} lamps are kept separate"),
    }
}

/// The degrees of the reflection, compared with those of the material.
fn degrees(reflection: &Reflection, asked: usize) -> String {
    let (f, p) = (reflection.brdf().f().get(), reflection.brdf().p().get());
    let terms = match (p, reflection.is_azimuth_free()) {
        (0, _) => "the same for every view".to_string(),
        (_, true) => format!("{} coefficients over the view, without azimuth", p + 1),
        (_, false) => format!("{} coefficients over the view", (p + 1) * (p + 1)),
    };
    let cut = if f < asked {
        format!("; the lighting ends at degree {f}, the material at {asked}")
    } else {
        String::new()
    };
    format!("F = {f}, P = {p}: {terms}{cut}")
}

#[cfg(test)]
mod tests {
    use brdf::{BrdfCoefficients, Centre};
    use sh::Degree;

    use super::*;

    #[test]
    fn the_note_says_what_the_reflection_holds() {
        for (f, p, entry, expected) in [
            (2, 0, [0, 0], "F = 2, P = 0: the same for every view"),
            (2, 2, [1, 0], "F = 2, P = 2: 3 coefficients over the view, without azimuth"),
            (2, 2, [1, 1], "F = 2, P = 2: 9 coefficients over the view"),
            (
                5,
                0,
                [0, 0],
                "F = 3, P = 0: the same for every view; the lighting ends at degree 3, the material at 5",
            ),
        ] {
            let degree = |l| Degree::new(l).unwrap();
            let mut rho = vec![[0.0; 3]; (f + 1) * (p + 1) * (p + 1)];
            rho[((p + 1) + entry[0]) * (p + 1) + entry[1]] = [1.0; 3];
            let brdf = BrdfCoefficients::new(Centre::Reflection, degree(f), degree(p), rho).unwrap();
            let reflection = Reflection::convolve(&Expansion::zero(degree(3)), &brdf);
            assert_eq!(degrees(&reflection, f), expected);
        }
    }
}
