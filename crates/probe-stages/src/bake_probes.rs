//! Bakes the transport of light to probes, from a sky that may be any and from emissive materials.
//!
//! ```toml
//! [stage.transport]
//! kind = "bake-probes"
//! inputs = { scene = "surfaces", places = "places" }
//! paths = 16384
//! ```
//!
//! Each probe gets a matrix from the sky's spherical harmonics to those of the light that arrives:
//!
//! > T_ij = integral over w of Y_i(w) B_j(w) dw
//!
//! where B_j(w) is the radiance that arrives from w under the sky Y_j, reflected by all surfaces in between;
//! and a column for each emissive material, for a radiance of 1. `light-probes` multiplies them by a sky and
//! by the colours of emission: a new sky, or another colour, traces no ray.
//!
//! `scene` is best connected to the part `surfaces` of `scene-part`: the bake then reruns with a triangle, a
//! material or a texture, and not with a lamp or with the colour and strength of emission. The whole scene
//! works as well, but then any change of it bakes again.
//!
//! ## Degrees
//!
//! `degree` is F, that of the light that arrives: 2, which engines take, to 4. `sky-degree` is O, that of the
//! sky: 2 to 8. A sky of degree O is exact; `light-probes` notes what is above. The numbers of a probe are
//! (F+1)^2 (O+1)^2, times 3 if surfaces have colours, and 6 (F+1)^2 for each emissive material: at F = 2 and
//! O = 4, 450 bytes of a grey scene and 1,350 of a coloured one with `precision = "half"`, twice that with
//! `"float"`. A transport of more than 4 GB is refused before the first ray.
//!
//! ## Paths
//!
//! Each probe has `paths` paths. Each ends at the first surface: points all over the surfaces of the scene
//! hold the light that arrives there, of all reflections, traced beforehand from all points at once (an
//! irradiance cache; more paths make more points with more rays). Close to a surface, where many paths
//! would end at the same point, each goes on in four directions. With `bounces = "all"` no reflection is
//! left out; `bounces = 0` is what a probe sees itself. The light of a point stands for the surface around
//! it, so that light and shadow are blurred over that distance before they reach a probe: in rooms of boxes
//! no bias of 0.25 percent of T was found. Errors of T are 0.8 to 1.3 percent RMS at 4,096 paths and 0.2 at
//! 65,536 there; those of irradiance under a soft sky are 0.3 to 2 and less.
//!
//! A note has the standard error of irradiance, over all directions and relative to it, if the sky and all
//! emission have a radiance of 1. With `error = 0.01`, the paths of each probe are doubled until its own is
//! below that, up to `paths-most`; a warning names probes that missed it, and a note, which `specula explain`
//! shows, up to 200 of them with their errors.
//!
//! The result does not depend on the number of threads, and that of a probe not on other probes.
//!
//! ## After an edit
//!
//! Bricks of 4^3 probes are kept from the last bake, in another process, too, if an edit cannot change them:
//! the bytes are those of a full bake. For each brick the artifact has which of 32^3 cells of space its paths
//! crossed, and which light on surfaces they found. A brick is baked again if a probe of it stands elsewhere,
//! if a surface in one of these cells is new, gone or different, or if that light is different: that is what
//! a change does that is seen from there, straight or by reflections. So a crate that is moved in a closed
//! room leaves the bricks of other rooms, and in rooms whose doors are open light finds its way to all of
//! them. A note, which `specula explain` shows, counts the bricks that were kept and why the others were not.
//! The light on surfaces is computed for the whole scene. What is recorded for that takes some 0.3 MB in the
//! artifact, and 5 to 20 KB for each brick.
//!
//! All bricks are baked if the settings, an emissive material or the size of the level change, and with
//! `error`, where the number of paths is known only afterwards.

use std::sync::Arc;

use containers::tensors::{self, TransportPrecision, decode_probe_transport, encode_probe_transport};
use engine::{
    Artifact, Context, Digest, Failure, Kind, Output, Parameters as _, Port, Product, Steps, choice,
    parameters,
};
use probes::{BrickCounts, EarlierBake, ScenePart, Surfaces, bake_bricks, transport_bytes};
use sh::Stop;
use stages::artifacts;
use stages::plugin::{UntilStopped, size};

use crate::baking::Baking;
use crate::scene_port::check;

/// The bytes of the largest transport, in 32-bit numbers.
const MOST_BYTES: usize = 4 << 30;

choice! {
    /// The numbers of a transport.
    pub(crate) enum Precision {
        /// 16 bits: right to 2.4e-4 of each.
        Half = "half",
        /// 32 bits.
        Float = "float",
    }
}

parameters! {
    /// Parameters of `bake-probes`.
    pub(crate) struct Parameters {
        /// F, the degree of the light that arrives.
        #[range(2..=4)]
        degree: usize = 2,
        /// O, the degree of the sky.
        #[range(2..=8)]
        sky_degree: usize = 4,
        /// How numbers are stored.
        precision: Precision = Precision::Half,
        ..baking: Baking,
    }
}

/// The kind `bake-probes`.
pub(crate) struct BakeProbes;

impl Kind for BakeProbes {
    type Parameters = Parameters;

    const NAME: &'static str = "bake-probes";
    const REVISION: u32 = 2;
    const KERNELS: &'static [u32] = &[probes::revisions::PROBES];
    const TEXT: &'static str = include_str!("bake_probes.rs");
    const SLOW: bool = true;

    fn ports() -> Vec<Port> {
        vec![Port::one::<artifacts::Scene>("scene"), Port::one::<artifacts::ProbePlaces>("places")]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::ProbeTransport::TYPE)
    }

    fn check(parameters: &Parameters) -> Vec<(&'static str, String)> {
        parameters.baking.check()
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let scene = context.inputs.get::<artifacts::Scene>("scene")?;
        check(&scene.0, ScenePart::Surfaces)?;
        let places = context.inputs.get::<artifacts::ProbePlaces>("places")?;
        places.check(&scene)?;
        let (places, stored) = (&places.0, &scene.0);
        let places_digest = context.inputs.digest("places")?;
        let options = parameters.baking.options(parameters.degree, parameters.sky_degree)?;
        let channels = if stored.scene.is_grey() { 1 } else { 3 };
        let emitters = stored.scene.emitters().len();
        let bytes = transport_bytes(places.len(), &options, channels, emitters);
        if bytes > MOST_BYTES {
            let (largest, each) = (size(MOST_BYTES as u64), size((bytes / places.len()) as u64));
            return Err(Failure::new(format!(
                "the transport of {} probes is {} in memory, {each} for each, and at most {largest} are baked",
                places.len(),
                size(bytes as u64)
            ))
            .help(format!(
                "fewer probes (a larger spacing in place-probes) make it smaller, a lower sky-degree (it is {}), or \
                 fewer emissive materials (there are {emitters})",
                parameters.sky_degree
            )));
        }
        let precision = match parameters.precision {
            Precision::Half => TransportPrecision::Half,
            Precision::Float => TransportPrecision::Single,
        };
        // In a watcher, a change of the scene that the surfaces do not see leaves the transport as it was.
        let of = [stored.surfaces.clone(), places_digest.to_string(), parameters.canonical().to_string()];
        let made = context.derived.get("bake-probes", Digest::of(of.join(" ").as_bytes()), &[], || {
            let surfaces = Surfaces::new(&stored.scene);
            let steps = Steps::new(reporter, options.steps(places.len()));
            let (at, bricks) = (places.positions(), places.bricks());
            // With an error, no brick can be kept.
            let last =
                options.error.is_none().then(|| context.earlier::<artifacts::ProbeTransport>()).flatten();
            let last_bricks = last.as_ref().map(|last| last.0.places.bricks());
            let earlier = last.as_ref().zip(last_bricks.as_ref()).and_then(|(last, bricks)| {
                let record = last.0.record.as_ref().filter(|_| last.0.precision == precision)?;
                Some(EarlierBake { transport: &last.0.transport, bricks, record })
            });
            let none = BrickCounts { all: bricks.len(), other: bricks.len(), ..BrickCounts::default() };
            let none = last.as_ref().map(|_| none);
            let bake = |stop: Stop<'_>| bake_bricks(&surfaces, at, &bricks, &options, earlier, stop);
            let baked = steps.until_stopped(bake)?;
            if let Some(counts) = baked.counts.or(none) {
                reporter.note(kept_text(&counts));
            }
            Ok::<_, Failure>((baked, bytes))
        })?;
        parameters.baking.report("transport", made.transport.errors(), places, reporter);
        let value = tensors::ProbeTransport {
            transport: made.transport.clone(),
            record: made.record.clone(),
            precision,
            places: places.clone(),
            places_digest: places_digest.to_string(),
            surfaces: stored.surfaces.clone(),
        };
        let bytes = encode_probe_transport(&value, None)?;
        // What is lit in this build is what the cache has: its numbers are rounded.
        let value = artifacts::ProbeTransport(decode_probe_transport(&bytes)?);
        Ok(Output::Artifact { bytes, value: Arc::new(value) })
    }
}

/// How many bricks are kept, and why the others are not.
fn kept_text(counts: &BrickCounts) -> String {
    let BrickCounts { all, other, kept, moved, crossed, relit } = *counts;
    if other > 0 {
        return format!(
            "all {all} bricks of probes were baked: the settings, the emissive materials or the size of the level are \
             not those of the last bake"
        );
    }
    let reasons = [
        (moved, "with probes that moved or are new"),
        (crossed, "whose paths crossed what changed"),
        (relit, "that see surfaces on which the light changed"),
    ];
    let reasons: Vec<String> = reasons
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, reason)| format!("{count} {reason}"))
        .collect();
    let others =
        if reasons.is_empty() { String::new() } else { format!("; baked again: {}", reasons.join(", ")) };
    format!("{kept} of {all} bricks of probes are as they were{others}")
}
