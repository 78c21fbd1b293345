//! Lights probes: the transport times a sky, the colours of emission and those of lamps.
//!
//! ```toml
//! [stage.probes]
//! kind = "light-probes"
//! inputs = { transport = "transport", lamps = "lamp-light", lighting = "sky", scene = "scene" }
//! lamps-scale = 0.0014641             # 1 / 683: a scene that Blender exported
//! ```
//!
//! Nothing is traced: another sky, another colour of a lamp or of an emissive material takes milliseconds,
//! 2 for 8,192 probes on two threads, and up to 50 if each of them needs a window. The result is a series
//! of degree 2 for each probe, radiance, linear, in Specula's frame, with the places of the probes.
//! `transport` is that of `bake-probes`, `lamps` that of `bake-lamps`, and `scene` the scene of
//! `import-scene`, as a whole: it has the colours. Without `lamps`, the scene's lamps are dark; without a
//! `lighting`, the sky is black.
//!
//! The sky comes from `project-sh`, or is an environment, which is projected here. A sky of the degree O of
//! the transport is exact; unless `ground` replaces a part of it, a note has the share of energy above it,
//! which is left out. A sun that the lighting keeps beside its series is a lamp if `bake-lamps` has the same
//! lighting at its port `lights`; otherwise it is blurred into the series, and a note says so. `lamps-scale`
//! does not touch it: its unit is that of the sky.
//!
//! `ground` replaces what is below the horizon of the sky: many photographs and analytic skies have nothing
//! useful there. With an albedo it is a plain that reflects the irradiance of the upper half; suns that are
//! lamps do not light it. The scene's own floor hides it where there is one.
//!
//! | parameter | what |
//! | --- | --- |
//! | `lamps = "indirect"` | what surfaces reflect of the lamps. Engines add what a lamp sends straight to a surface at run time: three.js and Bevy would count it twice |
//! | `lamps = "all"` | that, too: for lamps that the engine does not have |
//! | `emission` | the same of emissive materials. The default is `"all"`: no engine lights a surface by another one that glows |
//!
//! ## Units
//!
//! A sky has the unit of its file, lamps have candela and lux, emission has nits. `lamps-scale` brings
//! lamps to the sky's unit, `emission-scale` does that for emission. Blender's exporter multiplies watts by
//! 683 lm/W by default (`lighting mode: standard`), so that lamps are hundreds of times as bright as its
//! own pictures show them: 1 / 683 undoes it. If lamps bring more than 1,000 times the irradiance of the
//! sky to the probes, a warning says so.
//!
//! ## Windows
//!
//! A series of degree 2 rings: behind a bright lamp its irradiance may be below zero, which is black in a
//! picture. `window = "non-negative"` softens each probe by the weakest window that leaves no direction below
//! zero: rows of degree l are divided by 1 + lambda l^2 (l + 1)^2 (Sloan 2008). A note counts these probes.
//! `window = "none"` keeps the sum as it is: linear in the light, for tests.

use std::f64::consts::PI;

use containers::tensors::{self, ProbeLamps, ProbeTransport};
use engine::{Artifact, Context, Failure, Inputs, Kind, Output, Port, Product, Reporter, choice, parameters};
use probes::{LampColumns, LitProbes, Scene, SceneLighting, ScenePart};
use sh::{Degree, Expansion, Light, Transform, energy_per_degree, image_energy_of_rows};
use stages::artifacts;
use stages::plugin::UntilStopped;

use crate::baking::{listed, place_text};
use crate::ground::{Ground, under_image, under_series};
use crate::scene_port::check;
use crate::suns;

/// How many times the sky's irradiance lamps bring before a warning.
const BRIGHT: f64 = 1000.0;
/// The share of the sky's energy above which what is left out is noted.
const NOTED: f64 = 1e-4;

/// A lamp's columns, and its colour times its intensity.
type LitLamp<'a> = (&'a LampColumns, [f64; 3]);

choice! {
    /// What of a light counts.
    pub(crate) enum Share {
        /// What surfaces reflect.
        Indirect = "indirect",
        /// That, and what arrives straight from it.
        All = "all",
    }
}

choice! {
    /// What softens the series of a probe.
    pub(crate) enum WindowName {
        /// The weakest window that leaves no irradiance below zero.
        NonNegative = "non-negative",
        /// No window.
        None = "none",
    }
}

parameters! {
    /// Parameters of `light-probes`.
    pub(crate) struct Parameters {
        /// What of the lamps' light counts.
        lamps: Share = Share::Indirect,
        /// What of the emissive materials' light counts.
        emission: Share = Share::All,
        /// What the light of lamps is multiplied by.
        #[range(0.0..=1e9)]
        lamps_scale: f64 = 1.0,
        /// What the light of emissive materials is multiplied by.
        #[range(0.0..=1e9)]
        emission_scale: f64 = 1.0,
        /// What is below the horizon: what the sky has there, or a plain with this albedo, under the upper
        /// half of the sky.
        ground: Ground = Ground::Sky,
        /// What softens the series of each probe; see Windows.
        window: WindowName = WindowName::NonNegative,
    }
}

/// The kind `light-probes`.
pub(crate) struct LightProbes;

impl Kind for LightProbes {
    type Parameters = Parameters;

    const NAME: &'static str = "light-probes";
    const REVISION: u32 = 1;
    const KERNELS: &'static [u32] = &[probes::revisions::PROBES, sh::revisions::TRANSFORM];
    const TEXT: &'static str = include_str!("light_probes.rs");

    fn ports() -> Vec<Port> {
        vec![
            Port::one::<artifacts::ProbeTransport>("transport"),
            Port::one::<artifacts::Scene>("scene"),
            Port::one::<artifacts::ProbeLamps>("lamps").optional(),
            Port::one::<artifacts::Lighting>("lighting").or::<artifacts::Environment>().optional(),
        ]
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Artifact(artifacts::Probes::TYPE)
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let transport = context.inputs.get::<artifacts::ProbeTransport>("transport")?;
        let ProbeTransport { transport, places, surfaces, .. } = &transport.0;
        let stored = &context.inputs.get::<artifacts::Scene>("scene")?.0;
        check(stored, ScenePart::All)?;
        if *surfaces != stored.surfaces {
            return Err(Failure::new("the transport is that of another scene")
                .help("connect `scene` to the stage of import-scene that bake-probes has its scene from"));
        }
        let baked = context.inputs.optional::<artifacts::ProbeLamps>("lamps")?;
        let baked = baked.as_ref().map(|baked| &baked.0);
        if let Some(baked) = baked {
            check_lamps(baked, &context.inputs)?;
        }
        let (suns, blurred) = split_suns(&context.inputs, baked)?;
        let sky = sky(&context.inputs, &blurred, parameters.ground, transport.sky_degree(), reporter)?;
        let materials = &stored.scene.parts().materials;
        let radiance = |material: u32| {
            let emission = materials.get(material as usize).and_then(|material| material.emission);
            let radiance = emission.map_or([0.0; 3], |emission| emission.radiance);
            radiance.map(|channel| f64::from(channel) * parameters.emission_scale)
        };
        let emission: Vec<[f64; 3]> = stored.scene.emitters().into_iter().map(radiance).collect();
        let mut lamps = lamps(&stored.scene, baked, parameters.lamps_scale, reporter);
        // Suns have the unit of the sky, and are as bright as they are.
        let of_scene = lamps.len();
        lamps.extend(suns);
        let lighting = SceneLighting {
            sky: sky.as_ref(),
            emission: &emission,
            lamps: &lamps,
            with_direct: [parameters.lamps == Share::All, parameters.emission == Share::All],
            is_windowed: parameters.window == WindowName::NonNegative,
        };
        let light = LitProbes::new(places, transport, &lighting)?;
        if let Some(probe) =
            light.rows().iter().position(|rows| !rows.as_flattened().iter().all(|x| x.is_finite()))
        {
            return Err(Failure::new(format!(
                "the light of probe {} is above the largest number of single precision",
                place_text(places, probe)
            ))
            .help("lower `lamps-scale` or `emission-scale`, or import the sky with a lower exposure"));
        }
        reporter.check_cancelled()?;
        let brightness = Brightness::of(transport, sky.as_ref(), &lamps[..of_scene]);
        brightness.report(parameters.lamps_scale, reporter);
        if sky.is_none() && emission.is_empty() && lamps.is_empty() {
            reporter.warn("nothing shines: there is no sky, no lamp and no emissive material");
        }
        report_windows(&light, |probe| place_text(places, probe), reporter);
        Output::artifact(artifacts::Probes(tensors::Probes { places: places.clone(), light }))
    }
}

/// An error if lamps were baked for other probes, or as light of another degree.
fn check_lamps(lamps: &ProbeLamps, inputs: &Inputs) -> Result<(), Failure> {
    let transport = &inputs.get::<artifacts::ProbeTransport>("transport")?.0;
    if lamps.places_digest != transport.places_digest {
        return Err(Failure::new("the lamps were baked at other places than the transport")
            .help("connect bake-lamps and bake-probes to the same stage of place-probes"));
    }
    if lamps.surfaces != transport.surfaces {
        return Err(Failure::new("the lamps were baked in another scene than the transport")
            .help("connect bake-lamps and bake-probes to parts of the same scene"));
    }
    let (of_lamps, of_transport) = (lamps.degree.get(), transport.transport.degree().get());
    if of_lamps != of_transport {
        return Err(Failure::new(format!(
            "the lamps have degree {of_lamps}, and the transport has degree {of_transport}"
        ))
        .help("give bake-lamps and bake-probes the same `degree`"));
    }
    Ok(())
}

/// The lights beside a lighting's series: the columns and irradiances of those that were baked as lamps, and
/// the others.
fn split_suns<'a>(
    inputs: &Inputs,
    baked: Option<&'a ProbeLamps>,
) -> Result<(Vec<LitLamp<'a>>, Vec<Light>), Failure> {
    let (mut lit, mut blurred) = (Vec::new(), Vec::new());
    if inputs.type_at("lighting") != Some(artifacts::Lighting::TYPE) {
        return Ok((lit, blurred));
    }
    for light in &inputs.get::<artifacts::Lighting>("lighting")?.0.lights {
        let name = suns::lamp(light).name;
        let columns = baked.and_then(|baked| {
            let own = baked.names.iter().position(|other| *other == name)?;
            baked.columns.get(own)
        });
        match columns {
            Some(columns) => lit.push((columns, light.irradiance)),
            None => blurred.push(*light),
        }
    }
    Ok((lit, blurred))
}

/// The sky up to the degree of a transport, with some lights in its series; `None` if there is none.
fn sky(
    inputs: &Inputs,
    blurred: &[Light],
    ground: Ground,
    degree: Degree,
    reporter: &Reporter,
) -> Result<Option<Expansion>, Failure> {
    let left_out = |share: f64| {
        if share > NOTED {
            reporter.note(format!(
                "{:.2} % of the sky's energy is above degree {}, that of the transport, and left out",
                100.0 * share,
                degree.get()
            ));
        }
    };
    match inputs.type_at("lighting") {
        None => Ok(None),
        Some(artifacts::Environment::TYPE) => {
            let environment = &inputs.get::<artifacts::Environment>("lighting")?.0;
            let grid = environment.grid();
            let transform = Transform::new(grid, degree).map_err(|error| {
                Failure::from(error).help("import a larger image, or bake a lower sky-degree")
            })?;
            if let Ground::Albedo(albedo) = ground {
                let mut pixels = environment.pixels().to_vec();
                under_image(grid, &mut pixels, albedo);
                return Ok(Some(transform.analyse(&pixels)));
            }
            let series = reporter.until_stopped(|stop| transform.analyse_rows(environment, stop))?;
            let all = reporter.until_stopped(|stop| image_energy_of_rows(grid, environment, stop))?;
            let (held, all): (f64, f64) =
                (energy_per_degree(&series).iter().flatten().sum(), all.iter().sum());
            left_out(if all > 0.0 { 1.0 - held / all } else { 0.0 });
            Ok(Some(series))
        }
        Some(_) => {
            let lighting = &inputs.get::<artifacts::Lighting>("lighting")?.0;
            if !blurred.is_empty() {
                reporter.note(format!(
                    "{} lights beside the sky's series are blurred into it, up to degree {}; bake-lamps makes lamps \
                     of them if its port lights has the same lighting",
                    blurred.len(),
                    lighting.series.degree().get()
                ));
            }
            let series = lighting.series.clone();
            let series = sh::Lighting { series, lights: blurred.to_vec() }.whole();
            let energy: Vec<f64> = energy_per_degree(&series).iter().map(|rgb| rgb.iter().sum()).collect();
            let all: f64 = energy.iter().sum();
            let above: f64 = energy.iter().skip(degree.get() + 1).sum();
            left_out(if all > 0.0 { above / all } else { 0.0 });
            Ok(Some(match ground {
                Ground::Sky => series,
                Ground::Albedo(albedo) => under_series(&series, albedo, degree),
            }))
        }
    }
}

/// The baked lamps with their colours: each lamp of the scene with the next column of its name.
fn lamps<'a>(
    scene: &Scene,
    baked: Option<&'a ProbeLamps>,
    scale: f64,
    reporter: &Reporter,
) -> Vec<LitLamp<'a>> {
    let Some(baked) = baked else {
        let count = scene.parts().lamps.len();
        if count > 0 {
            reporter.note(format!("{count} lamps of the scene are dark: port lamps is not connected"));
        }
        return Vec::new();
    };
    let mut is_used = vec![false; baked.names.len()];
    let (mut lit, mut dark) = (Vec::new(), Vec::new());
    for lamp in &scene.parts().lamps {
        let own = (0..baked.names.len()).find(|&at| !is_used[at] && baked.names[at] == lamp.name);
        let Some(own) = own else {
            dark.push(lamp.name.clone());
            continue;
        };
        is_used[own] = true;
        let color = lamp.color.map(|channel| f64::from(channel) * f64::from(lamp.intensity) * scale);
        lit.push((&baked.columns[own], color));
    }
    if !dark.is_empty() {
        let count = dark.len();
        let names = listed(count, dark.into_iter());
        reporter
            .note(format!("{count} lamps of the scene are dark, since bake-lamps left them out: {names}"));
    }
    lit
}

/// The mean irradiance around the probes, from all sides, summed over channels.
struct Brightness {
    sky: f64,
    lamps: f64,
}

impl Brightness {
    fn of(transport: &probes::Transport, sky: Option<&Expansion>, lamps: &[LitLamp<'_>]) -> Self {
        let count = transport.len().max(1);
        let (rows, columns) = (transport.degree().rows(), transport.sky_degree().rows());
        let channels = transport.channels();
        // Row 0 of radiance, times the integral of Y_0 and a quarter for the mean over normals.
        let irradiance = 2.0 * PI.sqrt() / (4.0 * count as f64);
        let of_sky = sky.map_or(0.0, |sky| {
            let first = transport.sky().chunks_exact(rows * columns * channels);
            let row = |t: &[f32]| {
                let columns = t[..columns * channels].chunks_exact(channels).zip(sky.coefficients());
                let light = |(t, sky): (&[f32], &[f64; 3])| -> f64 {
                    (0..3).map(|channel| f64::from(t[channel % channels]) * sky[channel]).sum()
                };
                columns.map(light).sum::<f64>()
            };
            first.map(row).sum()
        });
        let lamp = |(column, color): &LitLamp<'_>| {
            let all = [&column.direct, &column.indirect].map(|column| {
                let first = column.chunks_exact(3 * rows);
                let row = |t: &[f32]| (0..3).map(|k| f64::from(t[k]) * color[k]).sum::<f64>();
                first.map(row).sum::<f64>()
            });
            all[0] + all[1]
        };
        Self { sky: irradiance * of_sky, lamps: irradiance * lamps.iter().map(lamp).sum::<f64>() }
    }

    /// Warns if lamps are so much brighter than the sky that their units must differ.
    fn report(&self, scale: f64, reporter: &Reporter) {
        if self.sky > 0.0 && self.lamps > BRIGHT * self.sky {
            reporter.warn(format!(
                "the lamps bring {:.0} times the irradiance of the sky to the probes, {:.3e} against {:.3e}: their \
                 units differ; set `lamps-scale` (it is {scale}), for a scene that Blender exported to 0.0014641, \
                 which is 1 / 683",
                self.lamps / self.sky,
                self.lamps,
                self.sky
            ));
        }
    }
}

/// Notes how many probes have a window, and which is the strongest.
fn report_windows(light: &LitProbes, name: impl Fn(usize) -> String, reporter: &Reporter) {
    let windows = light.windows();
    let count = windows.iter().filter(|lambda| **lambda > 0.0).count();
    let strongest = (0..windows.len()).max_by(|a, b| windows[*a].total_cmp(&windows[*b]));
    if let Some(strongest) = strongest.filter(|_| count > 0) {
        reporter.note(format!(
            "{count} of {} probes are softened, so that no irradiance is below zero; most of all probe {}, with \
             lambda = {:.2e}",
            windows.len(),
            name(strongest),
            windows[strongest]
        ));
    }
}
