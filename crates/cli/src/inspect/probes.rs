//! How `specula inspect` describes scenes, and light probes in them.

use containers::tensors;
use probes::{ProbePlaces, Repair};
use serde_json::Value;

use super::SH_FRAME;
use super::facts::{Facts, range};

/// A scene: its size, lamps and boxes.
pub(super) fn scene(bytes: &[u8]) -> Result<Facts, containers::Error> {
    let scene = tensors::decode_scene(bytes)?.scene;
    let parts = scene.parts();
    let names = |names: Vec<&str>| Value::from(names);
    let [least, most] = scene.bounds();
    Ok(vec![
        ("triangles", parts.triangles.len().into()),
        ("bounds", format!("{least:?} to {most:?}, in metres, +Z up").into()),
        ("materials", names(parts.materials.iter().map(|material| material.name.as_str()).collect())),
        ("emissive", scene.emitters().len().into()),
        ("lamps", names(parts.lamps.iter().map(|lamp| lamp.name.as_str()).collect())),
        ("boxes", names(parts.boxes.iter().map(|named| named.name.as_str()).collect())),
    ])
}

/// Where probes stand, and how many were repaired.
pub(super) fn places(places: &ProbePlaces) -> Facts {
    let volume = |volume: &probes::Volume| {
        let ([nx, ny, nz], [least, most]) = (volume.counts, volume.bounds);
        Value::from(format!("{}: {nx} x {ny} x {nz} from {least:?} to {most:?}", volume.name))
    };
    let count = |is: fn(&Repair) -> bool| places.repairs().iter().filter(|repair| is(repair)).count();
    let (moved, filled) =
        (count(|repair| *repair == Repair::Moved), count(|repair| matches!(repair, Repair::Filled(_))));
    let lost = count(|repair| matches!(repair, Repair::Lost(_)));
    vec![
        ("probes", places.len().into()),
        ("volumes", places.volumes().iter().map(volume).collect()),
        ("repaired", format!("{moved} moved, {filled} filled from neighbours, {lost} lost").into()),
    ]
}

/// The transport to probes: its degrees and its errors.
pub(super) fn transport(bytes: &[u8]) -> Result<Facts, containers::Error> {
    let stored = tensors::decode_probe_transport(bytes)?;
    let transport = &stored.transport;
    let degrees = format!("F = {}, O = {}", transport.degree().get(), transport.sky_degree().get());
    let mut facts = vec![
        ("degrees", degrees.into()),
        ("colour", if transport.channels() == 1 { "grey" } else { "RGB" }.into()),
        ("emissive", transport.emitters().into()),
        ("error", worst(transport.errors())),
    ];
    facts.extend(places(&stored.places));
    Ok(facts)
}

/// The transport from lamps to probes.
pub(super) fn lamps(bytes: &[u8]) -> Result<Facts, containers::Error> {
    let lamps = tensors::decode_probe_lamps(bytes)?;
    let errors: Vec<f32> = lamps.columns.iter().flat_map(|columns| &columns.errors).copied().collect();
    Ok(vec![
        ("lamps", lamps.names.clone().into()),
        ("degree", lamps.degree.get().into()),
        ("probes", lamps.probes.into()),
        ("error", worst(&errors)),
    ])
}

/// Probes with their light.
pub(super) fn lit(bytes: &[u8]) -> Result<Facts, containers::Error> {
    let tensors::Probes { places: stand, light } = tensors::decode_probes(bytes)?;
    let softened = light.windows().iter().filter(|lambda| **lambda > 0.0).count();
    let mut facts = places(&stand);
    facts.push(("softened", softened.into()));
    facts.push(("frame", SH_FRAME.into()));
    let rows = light.rows().as_flattened().iter();
    facts.extend(range("coefficients of radiance", rows.map(|row| row.map(f64::from))));
    Ok(facts)
}

/// The largest of some standard errors.
fn worst(errors: &[f32]) -> Value {
    let worst = errors.iter().copied().fold(0.0_f32, f32::max);
    format!("{:.2} % of irradiance at the worst probe", 100.0 * worst).into()
}
