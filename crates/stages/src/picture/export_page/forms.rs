//! The forms in which a page shows a material under an environment.

use std::sync::Arc;

use engine::{Digest, ExportedFiles, Failure, Inputs, ItemKey, Reporter};
use preview::{Light, Look, MapSizes};
use preview_page::Form;

use super::pairs::{Pair, fits};
use crate::map::{ShrmSettings, ShrmSizes};
use crate::values::{LampsName, parts, quantity};

/// The port of the stage that exports a form; those without one are no material.
pub(crate) fn port(form: Form) -> Option<&'static str> {
    match form {
        Form::Compact => Some("compact"),
        Form::Shrm => Some("shrm"),
        Form::Cabral => Some("cabral"),
        Form::KautzMcCool => Some("kautz-mccool"),
        Form::Plain => Some("reflection-map"),
        Form::Table | Form::Transfer | Form::Irradiance | Form::Mirror => None,
    }
}

/// What is exported.
pub(crate) struct Forms {
    exported: Vec<Exported>,
    sizes: MapSizes,
    /// Whether a mesh has a transfer.
    has_transfer: bool,
}

/// The files of an export.
struct Exported {
    form: Form,
    key: ItemKey,
    files: Arc<ExportedFiles>,
    /// The digest of what is known of them.
    digest: Digest,
}

/// The look of a form.
pub(crate) struct FormLook {
    pub(crate) look: Look,
    /// The bytes of the exported files, if they are connected.
    pub(crate) bytes: Option<u64>,
    /// The digest of what is known of the exported files, if they are connected.
    pub(crate) export: Option<Digest>,
    /// Whether suns and lamps are in the map, rather than beside it.
    pub(crate) has_lamps_in_map: bool,
    /// Whether each part of the material has a map of its own.
    pub(crate) has_map_of_each_part: bool,
    /// Whether its cubes have fewer texels than those of the exported files.
    pub(crate) is_smaller: bool,
    /// What a reader ought to know.
    pub(crate) notes: Vec<String>,
}

/// The texels along the edge of a cube that is as fine as exported maps, if their resolution is given. The
/// rows of a lat-long image are twice as many.
fn cube_edge(files: &ExportedFiles) -> Option<usize> {
    let resolution = number(files, "resolution")?;
    Some(if files.parameters["layout"] == "cube" { resolution } else { resolution.div_ceil(2) })
}

/// A number among the parameters of an export.
fn number(files: &ExportedFiles, name: &str) -> Option<usize> {
    files.parameters[name].as_u64().map(|number| number as usize)
}

impl Forms {
    /// The forms whose exports are connected, and the sizes of others.
    pub(crate) fn of(inputs: &Inputs, edge: usize, slices: usize) -> Result<Self, Failure> {
        let mut exported = Vec::new();
        for form in Form::ALL {
            let Some(port) = port(form) else { continue };
            let digests = inputs.many_digests(port);
            for ((key, files), digest) in inputs.many::<ExportedFiles>(port)?.into_iter().zip(digests) {
                exported.push(Exported { form, key, files, digest });
            }
        }
        let has_transfer = inputs.type_at("transfer").is_some();
        Ok(Self { exported, sizes: MapSizes { edge, slices }, has_transfer })
    }

    /// The exported files of a form of a pair.
    fn export(&self, form: Form, pair: &Pair) -> Option<&Exported> {
        self.exported.iter().find(|export| export.form == form && fits(&export.key, &pair.key))
    }

    /// Whether a page shows a pair in this form.
    pub(crate) fn shows(&self, form: Form, pair: &Pair) -> bool {
        let can = match form {
            Form::Compact => pair.compact_map.is_some(),
            Form::Table => pair.table.is_some(),
            Form::Transfer => self.has_transfer,
            Form::Irradiance | Form::Mirror => true,
            _ => pair.reflection.is_some(),
        };
        let is_chosen = port(form).is_none()
            || self.exported.is_empty()
            || self.exported.iter().any(|export| export.form == form);
        can && is_chosen
    }

    /// The look with which a form of a pair is drawn, on cubes whose texels along an edge are divided by a
    /// number. A mirror shows the sky as the background does.
    pub(crate) fn look(
        &self,
        form: Form,
        pair: &Pair,
        sky: &Arc<Light>,
        divisor: usize,
        reporter: &Reporter,
    ) -> Result<FormLook, Failure> {
        let export = self.export(form, pair);
        let files = export.map(|export| &*export.files);
        let edge = files.and_then(cube_edge).unwrap_or(self.sizes.edge);
        let slices = files.and_then(|files| number(files, "slices")).unwrap_or(self.sizes.slices);
        let sizes = |edge: usize| MapSizes { edge: (edge / divisor).max(1), slices };
        let is_baked = files.is_some_and(|files| files.parameters["lamps"] == "baked");
        let joins_parts = files.is_some_and(parts::are_together);
        let mut notes = Vec::new();
        let material = pair.material.clone();
        let light = Arc::clone(if form == Form::Mirror { sky } else { &pair.light });
        let (edge, look) = match &pair.reflection {
            Some(reflection) if form == Form::Shrm => {
                let reflection = &reflection.0;
                let settings = match files {
                    Some(files) => ShrmSettings::of_files(files)?,
                    None => None,
                };
                let lamps = if is_baked { LampsName::Baked } else { LampsName::Separate };
                let settings = settings.unwrap_or_else(|| ShrmSettings::of_cube(edge, lamps));
                let ShrmSizes { edge, degrees_in_view } = settings.sizes(reflection, reporter)?;
                let degrees = degrees_in_view.iter().map(|[p, _]| p.get().to_string());
                notes.push(format!("P = {}", degrees.collect::<Vec<_>>().join(" and ")));
                let look = Look::new(light, reflection.clone(), material, sizes(edge));
                (edge, look.with_degrees_in_view(Some(degrees_in_view)))
            }
            Some(reflection) if form != Form::Compact => {
                (edge, Look::new(light, reflection.0.clone(), material, sizes(edge)))
            }
            _ => (edge, Look::of_light(light, material, sizes(edge))),
        };
        let is_smaller = form.has_cube() && look.cube().edge < edge;
        if is_smaller {
            notes.push(format!("{} texels along an edge here, not {edge}", look.cube().edge));
        }
        if let Some(table) = pair.table.as_ref().filter(|_| form == Form::Table) {
            notes.push(format!("F = {}, {} x {1} views", table.degree().get(), table.size()));
        }
        if let Some(map) = pair.compact_map.as_ref().filter(|_| form == Form::Compact) {
            let taps = map.taps.table().taps();
            notes.push(format!("{} here", quantity::count(taps, "tap")));
        }
        let has_parts = pair.reflection.as_ref().is_some_and(|reflection| reflection.0.parts().is_some());
        let has_map_of_each_part = form.has_cube() && has_parts && !joins_parts;
        if has_map_of_each_part {
            notes.push("a map of each part of the material".to_owned());
        }
        if form == Form::Transfer {
            notes.push("computed at the vertices of the mesh".to_owned());
        }
        let look = look.with_lamps_in_maps(is_baked).with_parts_in_one_map(joins_parts);
        let look = look.with_compact_map(pair.compact_map.clone());
        let look = look.with_table(pair.table.clone());
        Ok(FormLook {
            look,
            bytes: files.map(ExportedFiles::total),
            export: export.map(|export| export.digest),
            has_lamps_in_map: is_baked,
            has_map_of_each_part,
            is_smaller,
            notes,
        })
    }
}
