//! Writes a page for browsers: materials under environments on meshes, live, in one file.
//!
//! ```toml
//! [stage.page]
//! kind = "export-page"
//! inputs = { environment = "environment", scale-space = "light", taps = "taps" }
//! path = "page"
//! ```
//!
//! Open the file, or send it: it needs no network, no server and no other file, and works in every browser
//! that has WebGL 2. docs/page.md explains what it shows and its keys.
//!
//! ## What is shown
//!
//! Each material under each environment, in every form whose inputs are connected:
//!
//! | form | needs |
//! | --- | --- |
//! | compact map (`taps`) | `scale-space` and `taps` |
//! | SHRM (`local-shrm`) | `reflection` |
//! | Cabral (`cabral`), Kautz-McCool (`kautz-mccool`), plain reflection map (`prefiltered`) | `reflection` |
//! | BRDF table (`table`), looked up at each pixel | `table`, of one material each (`tabulate-brdf`) |
//! | matte white in its own shadow (`transfer`), of meshes that have one | `mesh` and `transfer` (`precompute-transfer` with `form = "matte"`) |
//! | matte white (`irradiance`), perfect mirror (`mirror`) | `environment` |
//!
//! A material with a matte base under a highlight has a map of each part, whose light is added, unless the
//! connected export has `parts = "together"`.
//!
//! A BRDF table holds a series of the light and of the material, up to its degree; suns and lamps that are
//! beside the series of a `reflection` are added by the material's model.
//!
//! Connect the exports of the pipeline too, `shrm`, `cabral`, `kautz-mccool`, `reflection-map` and `compact`
//! (the `export-taps`): then only the forms that are exported are shown, with the resolution, the degree P
//! and the treatment of lamps of that stage, and with the sizes of its files. The page runs after them, and
//! again only if a size or a parameter changes. Connect a `report` on the same pairs, too: see Errors.
//!
//! Meshes at `mesh` are shown in their own coordinates, and Specula's own sphere and knot besides.
//!
//! A mesh of a glTF file is shown in its own materials: while the chosen material is one of them, each
//! triangle has its own, with the texture of its base colour, and the chosen one if the page lacks it. They
//! are found by their names: `NAME` in the file is `NAME` or `MESH-NAME` on the page, as `specula init` names
//! material files. Any other material covers the whole mesh, without a texture. A mesh of which the page has
//! no material shows the texture of any by its own coordinates, as the kind `preview` does. Textures need
//! `material`.
//!
//! ## Shaders
//!
//! The browser runs the shaders of Specula's preview, translated to GLSL; they draw what `specula preview`
//! and the kind `preview` draw. Of lights beside a map, each is added by the material's own model.
//!
//! ## Errors
//!
//! The page shows within how many stops of brute force 95 % and 99 % of the pixels of a sphere are. With
//! `report` connected, these are the figures of the report, over all views; if the export of a form is not
//! connected here, the size of its files is that of the report, too. They are read from its JSON in the
//! cache, so the page runs after the report, and again if one of them changes. The report has to have the
//! pair by name, and to be made from the same environment, material and reflection; if the export of a form
//! is connected here, the same export has to be connected to the report. The page says what was measured,
//! which need not be what it draws: the compact map of a report has the least taps that are good enough, and
//! that of the page has those of `taps`.
//!
//! With `material` connected, the page measures forms that no report has in a picture of one view, less
//! exactly, and says so. It also has a picture of each pair for browsers without WebGL 2. `measure = false`
//! leaves both out.
//!
//! ## Size
//!
//! Texels are three channels of nine bits with a common exponent where that is within 0.01 stops, otherwise
//! half floats; tables, lights and textures of base colours are exact. All is compressed. If the page would
//! be larger than `size-limit`, forms are left out, those of the end of the table above first, and the page
//! says which. The first form of each pair stays: if those of all pairs do not fit, their cubes have a half
//! of their texels along an edge, or a quarter, or an eighth. A matte transfer is left out if its mesh
//! would take more than a third of the page with it. The background and the mirror show at most `sky` rows
//! of an environment, and fewer where skies would take more than a quarter of the page; reflections are
//! made from all of it. Textures of base colours are means of their texels where they would take more than
//! a third.
//!
//! ## Files
//!
//! `.html`: the page.

mod comparison;
mod forms;
mod meshes;
mod pairs;
mod pictures;
mod reported;
mod views;

use std::collections::BTreeMap;
use std::sync::Arc;

use brdf::BaseColorTexture;
use engine::{Context, ExportedFiles, Failure, Kind, Output, Port, Product, parameters};
use preview::{Light, Look, MapSizes, web};
use preview_page::{Blobs, Document, EnvironmentEntry, Form, PairEntry};

use self::comparison::Comparison;
use self::forms::{Forms, port};
use self::meshes::Meshes;
use self::pairs::{Pair, name, pairs};
use self::reported::Reports;
use self::views::Views;
use crate::values::{artifacts, quantity};

parameters! {
    /// Parameters of `export-page`.
    pub(crate) struct Parameters {
        /// The most megabytes of the page.
        #[range(0.1..=1000.0)]
        size_limit: f64 = 8.0,
        /// Texels along the edge of a cube's face, of maps whose export is not connected.
        #[range(4..=256)]
        resolution: usize = 32,
        /// Slices of Kautz and McCool's texture, if its export is not connected.
        #[range(2..=64)]
        slices: usize = 16,
        /// The most rows of the sky in the background.
        #[range(MIN_SKY..=2048)]
        sky: usize = 256,
        /// Whether forms that no report has are compared with brute force, and pictures are drawn; see
        /// Errors.
        measure: bool = true,
    }
}

/// The bytes of a page beside its textures, shaders, meshes and pictures, and the most of a picture.
const PAGE_BYTES: usize = 95_000;
const PICTURE_BYTES: usize = 50_000;

/// The part of a page that its skies take at most, unless they have few rows, and these.
const SKIES: usize = 4;
const MIN_SKY: usize = 16;

/// The part of a page that the textures of base colours take at most, unless they have few texels along a
/// side, and these.
const TEXTURES: usize = 3;
const MIN_SIDE: usize = 32;

/// The kind `export-page`.
pub(crate) struct ExportPage;

impl Kind for ExportPage {
    type Parameters = Parameters;

    const NAME: &'static str = "export-page";
    const REVISION: u32 = 8;
    const KERNELS: &'static [u32] = &[
        sh::revisions::TRANSFORM,
        sh::revisions::WINDOW,
        sh::revisions::ROTATION,
        brdf::revisions::MODELS,
        shrm::revisions::SYNTHESIS,
        shrm::revisions::RESAMPLING,
        shrm::revisions::BAKING,
        shrm::revisions::DEGREES,
        shrm::revisions::MEAN_LOBE,
        envmap::revisions::RESAMPLING,
    ];
    const TEXT: &'static str = include_str!("export_page.rs");
    const SHOWS_KEYS: bool = true;
    const SLOW: bool = true;

    fn ports() -> Vec<Port> {
        let inputs = [
            Port::many::<artifacts::Environment>("environment"),
            Port::many::<artifacts::Material>("material").optional(),
            Port::many::<artifacts::Reflection>("reflection").optional(),
            Port::many::<artifacts::ScaleSpace>("scale-space").optional(),
            Port::many::<artifacts::Taps>("taps").optional(),
            Port::many::<artifacts::BrdfTable>("table").optional(),
            Port::many::<artifacts::Mesh>("mesh").optional(),
            Port::many::<artifacts::Transfer>("transfer").optional(),
        ];
        let exports = Form::ALL.into_iter().filter_map(port);
        let exports = exports.map(|name| Port::many::<ExportedFiles>(name).optional());
        let reports = Port::many_files(reported::PORT, reported::ENDING).optional();
        inputs.into_iter().chain(exports).chain([reports]).collect()
    }

    fn product(_: &Parameters, _: &[(&str, &'static str)]) -> Product {
        Product::Files(vec![".html".into()])
    }

    fn run(parameters: &Parameters, context: &Context<'_>) -> Result<Output, Failure> {
        let reporter = &context.reporter;
        let forms = Forms::of(&context.inputs, parameters.resolution, parameters.slices)?;
        let reports = Reports::of(&context.inputs)?;
        let environments = context.inputs.many::<artifacts::Environment>("environment")?;
        let lights: Vec<Arc<Light>> = environments
            .iter()
            .map(|(_, environment)| Arc::new(Light::new(environment.0.clone(), None)))
            .collect();
        let keys: Vec<_> = environments.iter().map(|(key, _)| key.clone()).collect();
        let pairs = pairs(&context.inputs, &keys, &lights, reporter)?;
        if pairs.is_empty() {
            return Err(Failure::new("no material is connected under an environment")
                .help("connect scale-space and taps, reflection, or a table of one material"));
        }

        let limit = (parameters.size_limit * 1e6) as usize;
        let mut blobs = Blobs::default();
        let title = context.key().map(ToString::to_string).filter(|title| !title.is_empty());
        let mut document = Document::new(title.as_deref().unwrap_or("Reflections"), &mut blobs);
        let shaders = blobs.next();
        let environments = keys.iter().zip(&lights).map(|(key, light)| EnvironmentEntry {
            name: name(key, "environment"),
            exposure: light.exposure().stops,
        });
        document.environments = environments.collect();
        // Skies get fewer rows until all of them together take at most their part of the page.
        let mut rows = parameters.sky;
        let skies = loop {
            let skies: Vec<_> = lights.iter().map(|light| light.in_rows(rows)).collect::<Result<_, _>>()?;
            document.skies = skies.iter().map(|sky| blobs.view(web::WebView::sky(sky))).collect();
            if blobs.since(shaders) <= limit / SKIES || rows / 2 < MIN_SKY {
                break skies;
            }
            blobs.forget(shaders);
            rows /= 2;
        };
        if rows < parameters.sky {
            document.left_out.push(format!("skies in more than {rows} rows"));
        }
        document.pairs = pairs
            .iter()
            .map(|pair| PairEntry::new(pair.environment, document.material(&pair.name)))
            .collect();
        add_meshes(&mut document, &mut blobs, &pairs, limit / TEXTURES, context)?;

        let of_pictures = if parameters.measure { pairs.len() * PICTURE_BYTES } else { 0 };
        let mut comparison = Comparison::new(reports, parameters.measure);
        let mut views = Views {
            forms: &forms,
            pairs: &pairs,
            skies: &skies,
            document: &mut document,
            blobs: &mut blobs,
            comparison: &mut comparison,
            room: limit.saturating_sub(PAGE_BYTES + of_pictures),
            reporter,
        };
        views.add_all()?;
        if let [first, more @ ..] = &document.left_out[..] {
            let more = if more.is_empty() { String::new() } else { format!(", and {} more", more.len()) };
            reporter.warn(format!(
                "the page would be larger than {} MB, so it leaves out {first}{more}",
                parameters.size_limit
            ));
        }
        comparison.note(reporter);
        let page = document.file(&blobs, context.recipe(), &comparison.figures()?)?;
        reporter.note(format!(
            "{}: {} materials under {} environments",
            quantity::size(page.len() as u64),
            document.materials.len(),
            keys.len()
        ));
        Ok(Output::files(vec![page.into_bytes()]))
    }
}

/// Adds the meshes, and the textures of the materials that they show, in fewer texels until all of them
/// together take at most so many bytes.
fn add_meshes(
    document: &mut Document,
    blobs: &mut Blobs,
    pairs: &[Pair],
    most: usize,
    context: &Context<'_>,
) -> Result<(), Failure> {
    let mut placements = BTreeMap::new();
    for pair in pairs {
        if let Some(texture) = &pair.texture {
            placements.entry(document.material(&pair.name)).or_insert(*texture.placement());
        }
    }
    let meshes = Meshes::of(context, &document.materials, &placements)?;
    document.meshes = meshes.entries(blobs, most, &mut document.left_out);
    let look = |pair: &Pair| {
        let look = Look::of_light(Arc::clone(&pair.light), pair.material.clone(), MapSizes::default());
        look.with_base_color(pair.texture.clone())
    };
    let shown = pairs.iter().zip(&mut document.pairs);
    let mut shown: Vec<_> = shown
        .filter(|(_, entry)| meshes.show_texture(entry.material()))
        .map(|(pair, entry)| (look(pair), entry))
        .collect();
    let (first, mut side) = (blobs.next(), BaseColorTexture::LONGEST_SIDE);
    loop {
        for (look, entry) in &mut shown {
            let base_color = web::WebBaseColor::of(look, side);
            entry.base_color = base_color.map(|base_color| blobs.base_color(base_color));
        }
        if blobs.since(first) <= most || side / 2 < MIN_SIDE {
            break;
        }
        blobs.forget(first);
        side /= 2;
    }
    if side < BaseColorTexture::LONGEST_SIDE {
        document.left_out.push(format!("textures in more than {side} texels along a side"));
    }
    Ok(())
}
