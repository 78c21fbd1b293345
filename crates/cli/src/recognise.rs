//! What a build can read of the files of a folder, and as what: the layout of each image by its shape and
//! name, and a trial of everything.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use containers::{ReadOptions, Shows, is_light_texture, read_image_header};
use engine::{BuildOptions, Cancel, Event, Kinds, Plan, path_text};
use envmap::Layout;

use crate::arguments::MANIFEST;
use crate::assets::{Assets, Environments, Recognised};
use crate::standard_pipeline;

/// The layouts that the shape of an image shows. A square is taken for an angular probe, as mirror balls are
/// rare.
const SHOWN: [Layout; 4] = [Layout::LatLong, Layout::Probe, Layout::CubeCross, Layout::CubeStrip];

/// Recognises the files of a folder by their names and headers, and by a trial: everything is imported once,
/// as a build does it.
pub(crate) fn of_folder(assets: Assets, folder: &Path, kinds: &Kinds) -> Recognised {
    let Assets { environments, materials, meshes } = assets;
    let mut sorting = Sorting(Recognised::default());
    sorting.sort_environments(environments, folder);
    sorting.0.materials = sorting.unlike(materials);
    sorting.sort_meshes(meshes);
    sorting.try_all(kinds);
    sorting.0
}

/// The layout that all of these images show, and the sources that they are: six faces are one. `None` if they
/// show several, or one of them none.
pub(crate) fn one_layout(images: &[PathBuf]) -> Option<Environments> {
    let mut sorting = Sorting(Recognised::default());
    sorting.sort_environments(images.to_vec(), Path::new(""));
    let Recognised { mut environments, left_out, .. } = sorting.0;
    let is_one = environments.len() == 1 && left_out.is_empty();
    environments.pop().filter(|_| is_one)
}

/// Files that are being sorted.
struct Sorting(Recognised);

impl Sorting {
    /// Leaves out files without triangles, such as those that hold lights alone.
    fn sort_meshes(&mut self, meshes: Vec<PathBuf>) {
        for mesh in self.unlike(meshes) {
            let has = File::open(&mesh).map_err(|error| error.to_string()).and_then(|mut file| {
                containers::gltf_has_triangles(&mut file).map_err(|error| error.to_string())
            });
            match has {
                Ok(true) => self.0.meshes.push(mesh),
                Ok(false) => self.0.left_out.push((mesh, "its scene has no triangles".into())),
                Err(error) => self.0.left_out.push((mesh, error)),
            }
        }
    }

    /// The files without those that have the stem of another: it is the name of their item.
    fn unlike(&mut self, files: Vec<PathBuf>) -> Vec<PathBuf> {
        let mut stems: BTreeMap<String, PathBuf> = BTreeMap::new();
        let mut kept = Vec::new();
        for file in files {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            match stems.get(&stem) {
                Some(other) => {
                    let reason = format!("{} has the same name, {stem:?}", path_text(other));
                    self.0.left_out.push((file, reason));
                }
                None => {
                    stems.insert(stem, file.clone());
                    kept.push(file);
                }
            }
        }
        kept
    }

    /// Sorts images by their layouts. Six faces count as one environment.
    fn sort_environments(&mut self, images: Vec<PathBuf>, base: &Path) {
        let mut folders: BTreeMap<PathBuf, Vec<String>> = BTreeMap::new();
        for image in &images {
            let name = image.file_name().unwrap_or_default().to_string_lossy().into_owned();
            folders.entry(image.parent().unwrap_or(Path::new("")).to_path_buf()).or_default().push(name);
        }
        let (mut cubes, mut faces) = (Vec::new(), Vec::new());
        for (folder, names) in &folders {
            let sets = stages::face_sets(names);
            match sets.as_slice() {
                [_] if folder != base => cubes.push(folder.clone()),
                sets => cubes.extend(sets.iter().map(|set| folder.join(&set[0]))),
            }
            faces.extend(sets.iter().flatten().map(|name| folder.join(name)));
        }
        let mut groups: Vec<Environments> = Vec::new();
        for image in images.into_iter().filter(|image| !faces.contains(image)) {
            let layout = match layout_of(&image) {
                Ok(layout) => layout,
                Err(reason) => {
                    self.0.left_out.push((image, reason));
                    continue;
                }
            };
            match groups.iter_mut().find(|group| group.layout == layout) {
                Some(group) => group.sources.push(image),
                None => groups.push(Environments { layout, sources: vec![image] }),
            }
        }
        if !cubes.is_empty() {
            groups.push(Environments { layout: Some(Layout::Cube.name()), sources: cubes });
        }
        groups.sort_by_key(|group| group.layout);
        for group in &mut groups {
            group.sources = self.unlike(std::mem::take(&mut group.sources));
        }
        self.0.environments = groups;
    }

    /// Imports everything into a temporary folder, and leaves out what fails.
    fn try_all(&mut self, kinds: &Kinds) {
        for (file, reason) in self.failures(kinds) {
            for group in &mut self.0.environments {
                group.sources.retain(|source| *source != file);
            }
            self.0.materials.retain(|source| *source != file);
            self.0.meshes.retain(|source| *source != file);
            self.0.left_out.push((file, reason));
        }
        self.0.environments.retain(|group| !group.sources.is_empty());
        self.0.left_out.sort();
    }

    /// The sources that a build cannot import, with the reasons.
    fn failures(&self, kinds: &Kinds) -> Vec<(PathBuf, String)> {
        let Ok(folder) = tempfile::Builder::new().prefix("specula-").tempdir() else { return Vec::new() };
        let manifest = folder.path().join(MANIFEST);
        // A source that is given as it is found: relative ones start at the current folder.
        let absolute: BTreeMap<PathBuf, PathBuf> = self
            .sources()
            .filter_map(|source| Some((std::path::absolute(source).ok()?, source.clone())))
            .collect();
        let place = |source: &Path| std::path::absolute(source).unwrap_or_default();
        let text = standard_pipeline::imports(&self.0, place);
        if fs::write(&manifest, text).is_err() {
            return Vec::new();
        }
        let Ok(plan) = Plan::load(&manifest, kinds) else { return Vec::new() };
        let sources: BTreeMap<String, PathBuf> = (plan.items.iter().enumerate())
            .filter_map(|(index, item)| Some((plan.item_name(index).to_string(), item.source.clone()?)))
            .collect();
        let failures = parking_lot::Mutex::new(Vec::new());
        let options = BuildOptions { keep_going: true, ..BuildOptions::default() };
        let built = engine::build(&plan, &options, &Cancel::default(), &|event: Event| {
            if let Event::Failed { item, error, .. } = event
                && let Some(source) = sources.get(&item.to_string()).and_then(|source| absolute.get(source))
            {
                failures.lock().push((source.clone(), error.join(": ")));
            }
        });
        if built.is_err() { Vec::new() } else { failures.into_inner() }
    }

    fn sources(&self) -> impl Iterator<Item = &PathBuf> {
        let environments = self.0.environments.iter().flat_map(|group| &group.sources);
        environments.chain(&self.0.materials).chain(&self.0.meshes)
    }
}

/// The layout of an image that a stage has to name, or why it is none of an environment.
fn layout_of(image: &Path) -> Result<Option<&'static str>, String> {
    let mut file = BufReader::new(File::open(image).map_err(|error| error.to_string())?);
    // Cubes in textures, which say so themselves.
    if is_light_texture(file.fill_buf().map_err(|error| error.to_string())?) {
        return Ok(None);
    }
    let header = read_image_header(&mut file, &ReadOptions::default());
    let header = header.map_err(|error| error.to_string())?;
    match header.panorama.map(|panorama| (panorama.source, panorama.shows)) {
        Some((source, Shows::Unclear(why))) => return Err(format!("{source}: {why}")),
        Some((_, Shows::Part(..))) => return Ok(None),
        Some((_, Shows::Whole)) | None if header.openexr_envmap.is_some() => return Ok(None),
        Some((_, Shows::Whole)) | None => {}
    }
    let name = image.file_name().unwrap_or_default().to_string_lossy();
    let (width, height) = (header.width, header.height);
    match SHOWN.into_iter().find(|layout| layout.check(width, height).is_ok()) {
        Some(Layout::LatLong) => Ok(None),
        Some(Layout::Probe) if stages::is_face(&name) => {
            Err("it is one face of a cube, but the other faces are missing".into())
        }
        Some(layout) => Ok(Some(layout.name())),
        None => Err(format!("no layout of an environment has the shape {width} x {height}")),
    }
}
