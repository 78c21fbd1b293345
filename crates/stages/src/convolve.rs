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
//! stops and 99 % within 0.15, if any P up to 16 does, and F adds at most 0.015 and 0.05 to these. The build
//! notes F, P and these errors. Suns and lamps are not cut: they stay beside the coefficients, with the
//! material that reflects them, until an export puts them into its map.
//!
//! If `project-brdf` names degrees, lighting and material are cut to the smaller of them: light that the
//! material blurs away, or detail that the lighting does not hold, costs nothing. If the lighting's degree is
//! the smaller one, the note says so, because the material then looks blurrier than it is.
//!
//! ## Example
//!
//! ```toml
//! [stage.reflection]
//! kind = "convolve"
//! inputs = { lighting = "lighting", brdf = "coefficients" }
//! ```

use engine::{Artifact, Context, Failure, Kind, Output, Port, Product, parameters};
use shrm::Reflection;
use shrm::degrees::Cut;

use crate::artifacts;

parameters! {
    /// `convolve` has no parameters.
    pub(crate) struct Parameters {}
}

/// The kind `convolve`.
pub(crate) struct Convolve;

impl Kind for Convolve {
    type Parameters = Parameters;

    const NAME: &'static str = "convolve";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] =
        &[sh::revisions::ROTATION, shrm::revisions::DEGREES, brdf::revisions::MODELS];
    const TEXT: &'static str = include_str!("convolve.rs");

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Lighting>("lighting"), Port::one::<artifacts::Brdf>("brdf")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Reflection::TYPE)
    }

    fn run(_: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let lighting = context.get::<artifacts::Lighting>("lighting")?;
        let brdf = context.get::<artifacts::Brdf>("brdf")?;
        let Some(material) = &brdf.material else {
            let reflection = Reflection::convolve(&lighting.0.whole(), &brdf.coefficients);
            context.note(degrees(&reflection, brdf.coefficients.f().get()));
            return Output::artifact(artifacts::Reflection(reflection));
        };
        let (reflection, cut) = Reflection::for_light(&lighting.0, &brdf.coefficients, material);
        context.note(format!("{}; {}", degrees(&reflection, cut.f.get()), lost(&cut, &reflection)));
        Output::artifact(artifacts::Reflection(reflection))
    }
}

/// What a cut at the chosen degrees loses, and what is not cut.
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
    use super::*;
    use brdf::{BrdfCoefficients, Centre};
    use sh::{Degree, Expansion};

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
