//! The parameters of `export-shrm`, and the maps that they ask for.

use engine::{ExportedFiles, Failure, OrAuto, Parameters, Reporter, choice, parameters};
use serde_json::json;
use sh::Degree;
use shrm::{MapGrid, MapLayout, Reflection, View};

use super::component_files::{Components, FormName};
use super::degree_choice::{Accept, DegreeChoice, MAX_P};
use super::map_input::{MapInput, MapShape, PartOfMaterial, SmallMap};
use crate::values::{
    Container, Encoding, FileFormat, LampsName, MAX_RESOLUTION, MapLayoutName, Numbers, PartsName,
    PrecisionName, Resolution, ViewName,
};

/// The kind's name.
pub(super) const EXPORT_SHRM: &str = "export-shrm";

choice! {
    /// The container.
    pub(crate) enum ShrmFormat {
        /// Safetensors.
        Safetensors = "safetensors",
        /// OpenEXR.
        Exr = "exr",
        /// KTX2.
        Ktx2 = "ktx2",
    }
}

impl FileFormat for ShrmFormat {
    fn container(self) -> Container {
        match self {
            Self::Safetensors => Container::Safetensors,
            Self::Exr => Container::Exr,
            Self::Ktx2 => Container::Ktx2,
        }
    }
}

parameters! {
    /// Parameters of `export-shrm`.
    pub(crate) struct ShrmParameters {
        /// The layout of the texels. Default: "cube", or the layout of the map that arrives.
        layout: Option<MapLayoutName> = None,
        /// Edge of a cube's face; rows of a lat-long map, which has twice as many columns. Default: "auto",
        /// or the resolution of the map that arrives.
        #[range(1..=MAX_RESOLUTION)]
        resolution: Option<Resolution> = None,
        /// The errors in stops that 5 % of the views, and 1 %, may exceed by the degree P, see Degree, or by
        /// the number of components. Default: [0.15, 0.4], unless `error` is given.
        accept: Option<Accept> = None,
        /// The RMS error that the map may have, as a share of the RMS radiance, in place of `accept`: by its
        /// degree P, and with resolution "auto" by bilinear look-ups, of which 0.01 is aimed at otherwise.
        #[range(1e-6..1.0)]
        error: Option<f64> = None,
        /// The highest P that is tried. Default: 4 or 16, see Degree, or the P that the manifest names.
        #[range(0..=MAX_P)]
        most_p: Option<usize> = None,
        /// The frame in which the views are given. Default: "local", or the frame of the map that arrives.
        view: Option<ViewName> = None,
        /// Whether suns and lamps are in the map or beside it; see Lamps.
        lamps: LampsName = LampsName::Baked,
        /// The maps of a material with a matte base under a highlight: one for each part, or one for both.
        parts: PartsName = PartsName::Separate,
        /// The container; see Files. Safetensors hold 32-bit numbers.
        format: ShrmFormat = ShrmFormat::Safetensors,
        /// What the map's numbers are; see Components.
        form: FormName = FormName::Harmonics,
        /// The number of components. Default: "auto", the least that `accept` allows.
        #[range(1..=shrm::components::MAX_COMPONENTS)]
        components: Option<OrAuto<usize>> = None,
        /// Whether components have 8 bits, and half the resolution from the fifth on; in safetensors.
        packed: bool = false,
        ..numbers: Numbers,
    }
}

impl ShrmParameters {
    pub(super) fn input(&self) -> MapInput {
        let (layout, view) = (self.layout.map(|name| name.0), self.view.map(|name| name.0));
        let small = Some(SmallMap {
            degree: DegreeChoice { accept: self.accept, error: self.error, most_p: self.most_p },
            per_coefficient: match (self.format, self.numbers.precision) {
                (ShrmFormat::Safetensors, _) | (ShrmFormat::Exr, PrecisionName::Float) => 12,
                (ShrmFormat::Exr, _) => 6,
                (ShrmFormat::Ktx2, PrecisionName::Float) => 16,
                (ShrmFormat::Ktx2, _) => 8,
            },
            with_zeros: self.format != ShrmFormat::Ktx2,
        });
        MapInput { layout, resolution: self.resolution, error: self.error, view, lamps: self.lamps, small }
    }

    pub(super) fn components(&self) -> Components {
        Components {
            resolution: self.resolution,
            count: self.components,
            accept: self.accept,
            packed: self.packed,
            bake: self.lamps == LampsName::Baked,
        }
    }

    /// The errors of parameters that the form does not use.
    pub(super) fn check_form(&self) -> Vec<(&'static str, String)> {
        let text = |form: &str| format!("only form = \"{form}\" uses it");
        let mut errors = Vec::new();
        if self.form == FormName::Harmonics {
            let given = [("components", self.components.is_some()), ("packed", self.packed)];
            errors
                .extend(given.into_iter().filter(|given| given.1).map(|(key, _)| (key, text("components"))));
            return errors;
        }
        let given = [
            ("view", self.view.is_some()),
            ("error", self.error.is_some()),
            ("most-p", self.most_p.is_some()),
        ];
        errors.extend(given.into_iter().filter(|given| given.1).map(|(key, _)| (key, text("harmonics"))));
        if self.layout.is_some_and(|layout| layout.0 != MapLayout::Cube) {
            errors.push(("layout", "components are on a cube".into()));
        }
        if self.format == ShrmFormat::Exr {
            errors.push(("format", "components are in safetensors or ktx2".into()));
        }
        if self.packed && self.format != ShrmFormat::Safetensors {
            errors.push(("packed", "only format = \"safetensors\" uses it".into()));
        }
        if self.accept.is_some() && matches!(self.components, Some(OrAuto::Fixed(_))) {
            errors.push(("accept", "only components = \"auto\" uses it".into()));
        }
        errors
    }

    pub(super) fn encoding(&self) -> Encoding<ShrmFormat> {
        Encoding::new(self.format, self.numbers)
    }
}

/// How a stage of the kind `export-shrm` makes its maps, for who measures them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShrmSettings {
    input: MapInput,
    parts: PartsName,
}

/// A map of a file: of a reflection, or of one of its parts.
#[derive(Clone, Copy)]
pub(crate) struct PlannedMap<'a> {
    pub(crate) field: &'a Reflection,
    pub(crate) shape: MapShape,
}

/// The sizes of the maps that a stage makes of a reflection.
pub(crate) struct ShrmSizes {
    /// The texels along the edge of a cube that is as fine as the largest map.
    pub(crate) edge: usize,
    /// For each map its degree P, and that of the field that it is fitted to.
    pub(crate) degrees_in_view: Vec<[Degree; 2]>,
}

impl ShrmSettings {
    /// The settings of a stage without parameters.
    pub(crate) fn of_default_stage() -> Option<Self> {
        let parameters = ShrmParameters::from_canonical(&json!({}))?;
        Some(Self { input: parameters.input(), parts: parameters.parts })
    }

    /// The settings by which `export-shrm` makes a KTX2 file of halves if its parameters set nothing but the
    /// edge of the cube and whether the map holds the lamps.
    pub(crate) fn of_cube(edge: usize, lamps: LampsName) -> Self {
        let small = SmallMap { degree: DegreeChoice::default(), per_coefficient: 8, with_zeros: false };
        let input = MapInput {
            layout: Some(MapLayout::Cube),
            resolution: Some(Resolution::Fixed(edge)),
            error: None,
            view: Some(View::Local),
            lamps,
            small: Some(small),
        };
        Self { input, parts: PartsName::Separate }
    }

    /// The settings of the stage that exported some files; `None` if its kind is not `export-shrm`.
    ///
    /// # Errors
    /// If the files hold components.
    pub(crate) fn of_files(files: &ExportedFiles) -> Result<Option<Self>, Failure> {
        if files.kind != EXPORT_SHRM {
            return Ok(None);
        }
        let Some(parameters) = ShrmParameters::from_canonical(&files.parameters) else { return Ok(None) };
        if parameters.form == FormName::Components {
            return Err(Failure::new("the files of export-shrm hold components, not harmonics")
                .help("connect a stage without form = \"components\""));
        }
        Ok(Some(Self { input: parameters.input(), parts: parameters.parts }))
    }

    /// Whether the map holds the lamps.
    pub(crate) fn lamps(&self) -> LampsName {
        self.input.lamps
    }

    /// Returns the settings with one map of a material that has two parts, or a map of each part.
    pub(crate) fn with_parts_in_one_map(self, joins_parts: bool) -> Self {
        Self { parts: if joins_parts { PartsName::Together } else { PartsName::Separate }, ..self }
    }

    /// Returns the settings with another choice of P.
    pub(crate) fn with_degree(self, degree: DegreeChoice) -> Self {
        let small = self.input.small.map(|small| SmallMap { degree, ..small });
        Self { input: MapInput { small, ..self.input }, ..self }
    }

    /// Returns the settings with a cube of another resolution.
    pub(crate) fn with_cube(self, edge: usize) -> Self {
        let (layout, resolution) = (Some(MapLayout::Cube), Some(Resolution::Fixed(edge)));
        Self { input: MapInput { layout, resolution, ..self.input }, ..self }
    }

    /// The sizes of the maps that the stage makes of a reflection.
    ///
    /// # Errors
    /// If the stage makes no map of the reflection.
    pub(crate) fn sizes(&self, reflection: &Reflection, reporter: &Reporter) -> Result<ShrmSizes, Failure> {
        let maps = self.maps(reflection, reporter)?;
        let edge = |map: &PlannedMap<'_>| match map.shape.grid {
            MapGrid::Cube(cube) => cube.edge,
            MapGrid::LatLong(grid) => grid.height.div_ceil(2),
        };
        Ok(ShrmSizes {
            edge: maps.iter().map(edge).max().unwrap_or(1),
            degrees_in_view: maps.iter().map(|map| [map.shape.p, map.shape.field]).collect(),
        })
    }

    /// The maps that the stage makes of a reflection: one, or that of the diffuse part and that of the
    /// specular one.
    pub(crate) fn maps<'a>(
        &self,
        reflection: &'a Reflection,
        reporter: &Reporter,
    ) -> Result<Vec<PlannedMap<'a>>, Failure> {
        let map = |field: &'a Reflection, part| -> Result<_, Failure> {
            Ok(PlannedMap { field, shape: self.input.shape(field, part, reporter)? })
        };
        match (self.parts, reflection.parts()) {
            (PartsName::Separate, Some([diffuse, specular])) => Ok(vec![
                map(diffuse, PartOfMaterial::Diffuse)?,
                map(specular, PartOfMaterial::Specular(diffuse))?,
            ]),
            _ => Ok(vec![map(reflection, PartOfMaterial::All)?]),
        }
    }
}
