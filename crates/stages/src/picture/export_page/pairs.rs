//! The materials under environments that a page shows.

use std::sync::Arc;

use brdf::{BaseColorTexture, BrdfTable};
use engine::{Digest, Failure, Inputs, ItemKey, Reporter};
use preview::{CompactMap, Light};

use crate::light::light_mismatch;
use crate::values::artifacts;

/// A material under an environment.
pub(crate) struct Pair {
    /// The sources of both.
    pub(crate) key: ItemKey,
    /// The place of the environment.
    pub(crate) environment: usize,
    /// The names of the environment and of the material.
    pub(crate) environment_name: String,
    pub(crate) name: String,
    pub(crate) light: Arc<Light>,
    pub(crate) reflection: Option<Arc<artifacts::Reflection>>,
    pub(crate) compact_map: Option<Arc<CompactMap>>,
    pub(crate) table: Option<Arc<BrdfTable>>,
    /// The environment, the material and the reflection as far as they are connected: the ports, and the
    /// digests of the artifacts there.
    pub(crate) made_from: Vec<(&'static str, Digest)>,
    /// The material, if it is known.
    pub(crate) material: Option<brdf::Material>,
    /// The texture of the material's base colour, if it has one.
    pub(crate) texture: Option<Arc<BaseColorTexture>>,
}

impl Pair {
    /// The pair in words.
    pub(crate) fn title(&self) -> String {
        format!("{} under {}", self.name, self.environment_name)
    }
}

/// Whether an item's key says nothing else than a pair's.
pub(crate) fn fits(key: &ItemKey, pair: &ItemKey) -> bool {
    key.iter().all(|(stage, stem)| pair.get(stage).is_none_or(|own| own == stem))
}

/// Whether a pair's key names all that an item's does.
fn has(pair: &ItemKey, key: &ItemKey) -> bool {
    key.iter().all(|(stage, stem)| pair.get(stage) == Some(stem))
}

/// An item's name.
pub(crate) fn name(key: &ItemKey, otherwise: &str) -> String {
    match key.is_empty() {
        true => otherwise.to_owned(),
        false => key.stems().collect::<Vec<_>>().join(" · "),
    }
}

/// A connected material.
struct TexturedMaterial {
    digest: Digest,
    material: brdf::Material,
    texture: Option<Arc<BaseColorTexture>>,
}

fn materials(inputs: &Inputs) -> Result<Vec<(ItemKey, TexturedMaterial)>, Failure> {
    let materials = inputs.many::<artifacts::Material>("material")?.into_iter();
    let stored = inputs.many_bytes("material")?.into_iter().zip(inputs.many_digests("material"));
    let mut found = Vec::new();
    for ((key, material), (bytes, digest)) in materials.zip(stored) {
        let texture = match material.0 {
            brdf::Material::Standard(_) => artifacts::Material::texture(&bytes)?,
            _ => None,
        };
        found.push((key, TexturedMaterial { digest, material: material.0.clone(), texture }));
    }
    Ok(found)
}

/// All pairs, environment by environment.
pub(crate) fn pairs(
    inputs: &Inputs,
    environments: &[ItemKey],
    lights: &[Arc<Light>],
    reporter: &Reporter,
) -> Result<Vec<Pair>, Failure> {
    let reflections = inputs.many::<artifacts::Reflection>("reflection")?;
    let scales = inputs.many::<artifacts::ScaleSpace>("scale-space")?;
    let taps = inputs.many::<artifacts::Taps>("taps")?;
    let tables = inputs.many::<artifacts::BrdfTable>("table")?;
    let materials = materials(inputs)?;
    let (of_environments, of_reflections) =
        (inputs.many_digests("environment"), inputs.many_digests("reflection"));
    if scales.is_empty() != taps.is_empty() {
        let (is, lacks) = if taps.is_empty() { ("scale-space", "taps") } else { ("taps", "scale-space") };
        return Err(Failure::new(format!("{is} is connected, but {lacks} is not"))
            .help("a compact map needs both: connect `scale-space` and `fit-taps`"));
    }
    let mut pairs: Vec<Pair> = Vec::new();
    for (environment, (own, light)) in environments.iter().zip(lights).enumerate() {
        let first = pairs.len();
        let known = |key: &ItemKey| {
            let rest: ItemKey = key.iter().filter(|(stage, _)| own.get(stage).is_none()).collect();
            let material = materials.iter().find(|(of, _)| !of.is_empty() && has(key, of));
            let only = materials.first().filter(|_| materials.len() == 1);
            let material = material.or(only);
            let of_material = material.map(|(_, material)| ("material", material.digest));
            Pair {
                key: key.clone(),
                environment,
                environment_name: name(own, "environment"),
                name: name(&rest, "material"),
                light: Arc::clone(light),
                reflection: None,
                compact_map: None,
                table: None,
                made_from: [("environment", of_environments[environment])]
                    .into_iter()
                    .chain(of_material)
                    .collect(),
                material: material.map(|(_, material)| material.material.clone()),
                texture: material.and_then(|(_, material)| material.texture.clone()),
            }
        };
        let reflections = reflections.iter().zip(&of_reflections);
        for ((key, reflection), digest) in reflections.filter(|((key, _), _)| has(key, own)) {
            if let Some(difference) = light_mismatch::difference(light.environment(), &reflection.0) {
                reporter.warn(format!("{key}: {difference}"));
            }
            let mut pair = Pair { reflection: Some(Arc::clone(reflection)), ..known(key) };
            pair.made_from.push(("reflection", *digest));
            pairs.push(pair);
        }
        // The pair of an item that holds for every environment, as the items of materials do.
        let pair_of = |key: &ItemKey, pairs: &mut Vec<Pair>| {
            let whole: ItemKey = own.iter().chain(key.iter()).collect();
            let place = pairs[first..].iter().position(|pair| pair.key == whole).map(|place| first + place);
            place.unwrap_or_else(|| {
                pairs.push(known(&whole));
                pairs.len() - 1
            })
        };
        for (key, table) in tables.iter().filter(|(_, table)| table.0.count() == 1) {
            let place = pair_of(key, &mut pairs);
            pairs[place].table = Some(Arc::new(table.0.clone()));
        }
        let scales = scales.iter().find(|(key, _)| key == own || has(own, key));
        let Some((_, scales)) = scales else { continue };
        if let Some(difference) = light_mismatch::difference_from_scales(light.environment(), &scales.0.space)
        {
            reporter.warn(format!("{own}: {difference}"));
        }
        let space = Arc::new(scales.0.space.clone());
        for (key, taps) in &taps {
            let map = Arc::new(CompactMap {
                scales: Arc::clone(&space),
                taps: Arc::new(taps.0.table().into()),
                material: taps.0.material.clone(),
            });
            let place = pair_of(key, &mut pairs);
            let pair = &mut pairs[place];
            pair.material.get_or_insert_with(|| taps.0.material.clone());
            pair.compact_map = Some(map);
        }
    }
    for (key, table) in tables.iter().filter(|(_, table)| table.0.count() > 1) {
        let (table, count) = (name(key, "the table"), table.0.count());
        reporter.warn(format!("{table} has {count} materials, and a page shows tables of one"));
    }
    Ok(pairs)
}
