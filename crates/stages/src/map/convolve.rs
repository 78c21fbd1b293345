//! Reflects a lighting off a material: the reflected light field in spherical harmonics.
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
//! material), p up to P for the view about it. The artifact holds the two factors. From them `export-shrm`
//! makes reflection maps with (P+1)^2 coefficients in each texel, of which only P+1 are not zero if the
//! material does not depend on the azimuth; `export-reflection-map` makes one plain map, which is exact for P
//! = 0.
//!
//! ## Degrees
//!
//! If neither `project-sh` nor `project-brdf` names a degree, this stage chooses F and P for each pair: the
//! least P, at most 16, and then the least F, at which the cut does not show. It tries them: at views as a
//! ball shows them, B is evaluated with all degrees and with fewer, and both are compared in stops,
//! |log2((cut + e) / (uncut + e))| with e = 1 % of the mean radiance. P leaves 95 % of the views within 0.06
//! stops and 99 % within 0.12, if any P up to 16 does, and F adds at most 0.015 and 0.05 to these. The build
//! notes F, P and these errors. Suns and lamps are not cut: they stay beside the coefficients, with the
//! material that reflects them, until an export puts them into its map.
//!
//! If `project-brdf` names degrees, lighting and material are cut to the smaller of them: light that the
//! material blurs away, or detail that the lighting does not hold, costs nothing. If the lighting's degree is
//! the smaller one, the note says so, because the material then looks blurrier than it is. Lamps beside the
//! lighting go into its series.
//!
//! If such a cut shows, a warning says by how much: if 5 % of the views are off by more than 0.1 stop, or
//! more than 0.5 % of them are below zero by a tenth of e, black in a picture. It names the remedy that was
//! found to help most here, no degree or a window, if it takes off at least half of what shows.
//!
//! ## Parts
//!
//! A material with a matte base under a highlight has two centres. Beside the field of both about the
//! reflection vector, from which a preview or a report looks, this stage keeps a field for each part about
//! its own centre, with its own F and P, for exports that write a map of each. Their degrees are those at
//! which the cut of their sum does not show, in the measure of above; the note has its errors.
//!
//! ## Windows
//!
//! A `window` scales the terms of each l (see `project-sh`), which calms the rings of a cut and blurs what
//! was sharp. `"auto"` takes the least window that helps, if no degrees are enough, and otherwise none; with
//! degrees that the manifest names it takes none.
//!
//! ## Example
//!
//! ```toml
//! [stage.reflection]
//! kind = "convolve"
//! inputs = { lighting = "lighting", brdf = "coefficients" }
//! ```

use brdf::{BrdfCoefficients, Material};
use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, Reporter, Steps, parameters};
use sh::Lighting;
use shrm::degrees::{BLACK_SHARE, Cut};
use shrm::ringing::{CutError, CutStudy, Samples};
use shrm::{Lamps, Reflection};

use crate::values::{UntilStopped, Window, about, artifacts};

parameters! {
    /// Parameters of `convolve`.
    pub(crate) struct Parameters {
        /// The window, which reduces ringing; see Windows.
        #[words(Window::Auto, Window::None, Window::Lanczos, Window::Hanning)]
        window: Window = Window::Auto,
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
    const REVISION: u32 = 1;
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

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let lighting = &context.inputs.get::<artifacts::Lighting>("lighting")?.0;
        let brdf = &context.inputs.get::<artifacts::Brdf>("brdf")?.0;
        let given = parameters.window.fixed();
        let windowed = |reflection: &Reflection| match given {
            Some(window) => reflection.windowed(window),
            None => reflection.clone(),
        };
        let dark = BLACK_SHARE * lighting.mean();
        let reflection = match &brdf.material {
            Some(material) if brdf.for_light => {
                let searches = if brdf.parts.is_some() { 3 } else { 1 };
                let steps = Steps::new(reporter, searches * shrm::degrees::STEPS);
                let (reflection, cut) = steps.until_stopped(|stop| {
                    Reflection::for_light(lighting, &brdf.coefficients, material, stop)
                })?;
                reporter.note(format!("{}; {}", degrees(&reflection, cut.f.get()), lost(&cut, &reflection)));
                let reflection = if given.is_none() && cut.shows() {
                    let whole = whole(lighting, &brdf.coefficients, material);
                    let (reflection, error) = least_window(reflection, &whole, dark, reporter)?;
                    if error.negative > NEGATIVE || error.p95 > RING {
                        reporter.warn(format!(
                            "the highest degrees are too low for a highlight this sharp: {}; a larger roughness, or the \
                             levels of prefilter and export-engine, which have no degree, show no rings",
                            told(&error)
                        ));
                    }
                    reflection
                } else {
                    windowed(&reflection)
                };
                match material.split().zip(brdf.parts.as_ref()) {
                    Some(([diffuse, specular], parts)) => {
                        let parts = [(&parts[0], &diffuse), (&parts[1], &specular)];
                        let (parts, cut) =
                            steps.until_stopped(|stop| Reflection::parts_for_light(lighting, parts, stop))?;
                        let parts = parts.map(|part| windowed(&part));
                        let [diffuse, specular] =
                            parts.each_ref().map(|part| [part.brdf().f().get(), part.brdf().p().get()]);
                        reporter.note(format!(
                            "[F, P] of its parts: diffuse {diffuse:?}, specular {specular:?}; in their sum 95 % of views are \
                             within {:.3} stops, 99 % within {:.3}",
                            cut.p95, cut.p99
                        ));
                        reflection.with_parts(parts)
                    }
                    None => reflection,
                }
            }
            material => {
                let light = lighting.whole();
                let mut reflection = Reflection::convolve(&light, &brdf.coefficients);
                if let Some(parts) = &brdf.parts {
                    reflection = reflection
                        .with_parts(parts.each_ref().map(|part| Reflection::convolve(&light, part)));
                }
                let reflection = windowed(&reflection);
                reporter.note(degrees(&reflection, brdf.coefficients.f().get()));
                if let Some(material) = material {
                    reporter.check_cancelled()?;
                    warn_of_rings(&reflection, lighting, material, dark, reporter)?;
                }
                reflection
            }
        };
        Output::artifact(artifacts::Reflection(reflection))
    }
}

/// The reflection without a cut: the lamps are beside it.
fn whole(lighting: &Lighting, brdf: &BrdfCoefficients, material: &Material) -> Reflection {
    Reflection::convolve(&lighting.series, brdf)
        .with_lamps(Lamps { lights: lighting.lights.clone(), material: material.clone() })
}

/// The reflection with the weakest window that takes it nearer to the one that is not cut, and its error.
fn least_window(
    reflection: Reflection,
    whole: &Reflection,
    dark: f64,
    reporter: &Reporter,
) -> Result<(Reflection, CutError), Failure> {
    let right = samples(whole, reporter)?;
    let (mut best, mut least) = (reflection.clone(), samples(&reflection, reporter)?.error(&right, dark));
    for (name, window) in WINDOWS {
        let windowed = reflection.windowed(window);
        let error = samples(&windowed, reporter)?.error(&right, dark);
        if error.p95 < least.p95 && error.p99 < least.p99 {
            reporter.note(format!("window {name}: 95 % of views are within {:.3} stops", error.p95));
            (best, least) = (windowed, error);
        }
    }
    Ok((best, least))
}

/// The samples of a reflection, unless the item is stopped.
fn samples(reflection: &Reflection, reporter: &Reporter) -> Result<Samples, Failure> {
    reporter.until_stopped(|stop| reflection.samples(stop))
}

/// Warns if a cut at degrees of the manifest shows, with the remedy that helps most.
fn warn_of_rings(
    reflection: &Reflection,
    lighting: &Lighting,
    material: &Material,
    dark: f64,
    reporter: &Reporter,
) -> Result<(), Failure> {
    let shows = |error: &CutError| error.negative > NEGATIVE || error.p95 > RING;
    let of = (lighting, material);
    let study = reporter.until_stopped(|stop| CutStudy::of(reflection, of, dark, shows, stop))?;
    let Some(study) = study else { return Ok(()) };
    let error = study.error;
    let mut best = ("leave out `degree` and `tolerance` in project-brdf", study.by_light);
    for (remedy, error) in
        [("set window = \"lanczos\"", study.lanczos), ("set window = \"hanning\"", study.hanning)]
    {
        if score(&error) < score(&best.1) {
            best = (remedy, error);
        }
    }
    let [f, p] = [reflection.brdf().f().get(), reflection.brdf().p().get()];
    let mut text = format!("degree [{f}, {p}] is too low here: {}", told(&error));
    if score(&best.1) < HELPS * score(&error) {
        text.push_str(&format!("; {}", best.0));
        if score(&best.1) > 1.0 {
            text.push_str(&format!(", after which {}", told(&best.1)));
        }
    }
    if study.negative_light > NEGATIVE {
        text.push_str(
            "; around its suns the lighting's own series is black: leave out `degree` and `tolerance` in project-sh",
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

/// Says what a cut at the chosen degrees loses, and what is not cut.
fn lost(cut: &Cut, reflection: &Reflection) -> String {
    let beside = match reflection.lamps().map_or(0, |lamps| lamps.lights.len()) {
        0 => String::new(),
        1 => "; 1 lamp is kept beside it".to_owned(),
        lamps => format!("; {lamps} lamps are kept beside it"),
    };
    format!("95 % of views are within {:.3} stops, 99 % within {:.3}{beside}", cut.p95, cut.p99)
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
    use sh::{Degree, Expansion};

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
