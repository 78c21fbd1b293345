//! The settings of the window, and their form in the file that saves them.

use envmap::ToneMap;
use serde::{Deserialize, Serialize};
use sphere::Rotation;

use crate::{
    Background, Camera, Catalog, Framing, List, Mode, PointSet, Scene, Shot, Show, Subject, SubjectRequest,
};

/// The arrangement of the two modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Arrangement {
    /// The first mode alone.
    One,
    /// The first mode left of the divider, the second right of it.
    Split,
    /// The absolute difference of the two modes.
    Difference,
}

/// Two angles in radians, as in [`Rotation::from_yaw_pitch_roll`] or [`Camera`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Aim {
    /// The angle about the vertical axis.
    pub yaw: f64,
    /// The angle about the horizontal axis.
    pub pitch: f64,
}

/// The settings of the window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", default)]
pub struct ViewSettings {
    /// The selected subject; names that are not chosen yet are empty.
    pub subject: Subject,
    /// The first mode; `None` until one is chosen: that of the scene ([`Scene::first_mode`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<Mode>,
    /// The mode that it is compared with.
    pub second: Mode,
    /// The arrangement of the two.
    pub arrangement: Arrangement,
    /// The place of the divider as a share of the width, 0 to 1.
    pub divider: f32,
    /// The factor that a difference is multiplied with.
    pub amplify: f32,
    /// The points of the unit square that light samples and the diagram of samples are made from.
    pub points: PointSet,
    /// The background: one of [`crate::Named::ALL`].
    #[serde(rename = "backdrop", with = "crate::named")]
    pub background: Background,
    /// The number of stops by which pictures are brighter than the exposure of their light.
    pub exposure: f64,
    /// The tone curve.
    #[serde(with = "crate::named")]
    pub tone: ToneMap,
    /// The rotation of the light.
    pub light: Aim,
    /// The direction of the camera.
    pub camera: Aim,
    /// The magnification; 1 fits the mesh to the picture.
    pub zoom: f64,
    /// Whether the lists on the left are open.
    pub lists: bool,
    /// Whether the inspector on the right is open.
    pub inspector: bool,
    /// The size of the window's content in points while it is not maximised.
    pub size: [f32; 2],
    /// Whether the window fills the screen.
    pub maximized: bool,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            subject: Subject::default(),
            mode: None,
            second: Mode::BruteForce,
            arrangement: Arrangement::One,
            divider: 0.5,
            amplify: 8.0,
            points: PointSet::Even,
            background: Background::Environment,
            exposure: 0.0,
            tone: ToneMap::Filmic,
            light: Aim::default(),
            camera: Aim { yaw: 0.0, pitch: 0.2 },
            zoom: 0.85,
            lists: true,
            inspector: true,
            size: [1280.0, 800.0],
            maximized: false,
        }
    }
}

/// The light samples of each sample of a pixel in brute force.
const LIGHT_SAMPLES: u32 = 1024;

/// The version of the saved form. Raise it if older settings would be misread.
const VERSION: u64 = 1;

impl ViewSettings {
    /// The exposures that can be set, in stops.
    pub const EXPOSURES: std::ops::RangeInclusive<f64> = -12.0..=12.0;
    /// The amplifications of a difference that can be set.
    pub const AMPLIFICATIONS: std::ops::RangeInclusive<f32> = 1.0..=256.0;
    /// The magnifications that can be set.
    pub const ZOOMS: std::ops::RangeInclusive<f64> = 0.25..=16.0;
    /// The largest pitch of the camera, a little below straight up, where dragging would make it spin.
    const STEEPEST: f64 = 1.55;

    /// The settings in a saved file, or the default ones if there is no file. If the file cannot be read, the
    /// default settings and the reason.
    pub fn from_json(saved: Option<&str>) -> (Self, Option<String>) {
        let Some(saved) = saved else { return (Self::default(), None) };
        match Self::parse(saved) {
            Ok(settings) => (settings.within_bounds(), None),
            Err(reason) => {
                (Self::default(), Some(format!("the saved settings of the window are ignored: {reason}")))
            }
        }
    }

    fn parse(saved: &str) -> Result<Self, String> {
        let value: serde_json::Value = serde_json::from_str(saved).map_err(|error| error.to_string())?;
        match value.get("version").and_then(serde_json::Value::as_u64) {
            Some(VERSION) => {}
            Some(version) => {
                return Err(format!("their version is {version}, and this program reads version {VERSION}"));
            }
            None => return Err("they have no version".into()),
        }
        let settings = value.get("settings").cloned().ok_or("they have no settings")?;
        serde_json::from_value(settings).map_err(|error| error.to_string())
    }

    /// The form that [`ViewSettings::from_json`] reads.
    pub fn to_json(&self) -> String {
        // Bounded numbers and names always have a JSON form.
        serde_json::json!({ "version": VERSION, "settings": self }).to_string()
    }

    /// The nearest settings within the bounds. A number that is NaN gets its default value.
    pub fn within_bounds(mut self) -> Self {
        let default = Self::default();
        let angle = |angle: f64, default: f64| if angle.is_finite() { wrapped(angle) } else { default };
        self.divider = bounded(self.divider.into(), 0.0..=1.0, default.divider.into()) as f32;
        let (least, most) = (*Self::AMPLIFICATIONS.start(), *Self::AMPLIFICATIONS.end());
        self.amplify =
            bounded(self.amplify.into(), least.into()..=most.into(), default.amplify.into()) as f32;
        self.exposure = bounded(self.exposure, Self::EXPOSURES, default.exposure);
        self.zoom = bounded(self.zoom, Self::ZOOMS, default.zoom);
        self.light = Aim { yaw: angle(self.light.yaw, 0.0), pitch: angle(self.light.pitch, 0.0) };
        let steep = -Self::STEEPEST..=Self::STEEPEST;
        self.camera = Aim {
            yaw: angle(self.camera.yaw, default.camera.yaw),
            pitch: bounded(self.camera.pitch, steep, default.camera.pitch),
        };
        self.size = std::array::from_fn(|side| {
            bounded(self.size[side].into(), 320.0..=16384.0, default.size[side].into()) as f32
        });
        self
    }

    /// The first mode of a picture of a scene.
    pub fn first_mode(&self, scene: &Scene) -> Mode {
        self.mode.unwrap_or_else(|| scene.first_mode())
    }

    /// The modes of a picture of a scene.
    pub fn show(&self, scene: &Scene) -> Show {
        let (first, second) = (self.first_mode(scene), self.second);
        match self.arrangement {
            Arrangement::One => Show::One(first),
            Arrangement::Split => Show::Split { left: first, right: second, at: self.divider },
            Arrangement::Difference => Show::Difference { of: first, from: second, amplify: self.amplify },
        }
    }

    /// The rotation of the light, with yaw and pitch as in the kind `rotate`.
    pub fn turn(&self) -> Rotation {
        Rotation::from_yaw_pitch_roll(self.light.yaw, self.light.pitch, 0.0)
    }

    /// The camera for a scene with this framing.
    pub fn camera(&self, framing: Framing) -> Camera {
        let Aim { yaw, pitch } = self.camera;
        Camera { yaw, pitch, zoom: self.zoom, ..Camera::new(framing) }
    }

    /// The shot of a scene with this framing, with one sample per pixel.
    pub fn shot(&self, scene: &Scene, framing: Framing, size: [u32; 2]) -> Shot {
        Shot {
            size,
            samples: 1,
            camera: self.camera(framing.within(size)),
            turn: self.turn(),
            show: self.show(scene),
            background: self.background,
            exposure: scene.light.exposure().stops + self.exposure,
            tone: self.tone,
            light_samples: LIGHT_SAMPLES,
            points: self.points,
        }
    }
}

/// The settings and subject that a preview shows first.
#[derive(Clone, Debug, Default)]
pub struct InitialView {
    /// The settings that the last window saved, as JSON. The default ones replace unreadable ones.
    pub state: Option<String>,
    /// The parts of the subject that the user asked for; they take precedence over the saved settings.
    pub request: SubjectRequest,
}

impl InitialView {
    /// The first settings, and why the saved ones cannot be used.
    pub fn settings(&self) -> (ViewSettings, Option<String>) {
        let (mut settings, note) = ViewSettings::from_json(self.state.as_deref());
        let SubjectRequest { environment, material, mesh, mode } = &self.request;
        for (list, requested) in List::ALL.into_iter().zip([environment, material, mesh]) {
            if let Some(requested) = requested {
                list.chosen(&mut settings.subject).clone_from(requested);
            }
        }
        if let Some(mode) = *mode {
            (settings.mode, settings.arrangement) = (Some(mode), Arrangement::One);
        }
        (settings, note)
    }

    /// The first subject from a catalog. Its names are empty if the catalog has no subject.
    pub fn subject(&self, catalog: &Catalog) -> Subject {
        let wanted = self.settings().0.subject;
        catalog.nearest(&wanted, &self.request, &wanted)
    }

    /// The shot of a scene for a still, from these settings.
    pub fn shot(&self, scene: &Scene, size: [u32; 2]) -> Shot {
        self.settings().0.shot(scene, scene.framing(), size).for_screenshot()
    }
}

/// Wraps an angle to between -pi and pi.
fn wrapped(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle - turn * (angle / turn).round()
}

fn bounded(value: f64, bounds: std::ops::RangeInclusive<f64>, default: f64) -> f64 {
    if value.is_nan() { default } else { value.clamp(*bounds.start(), *bounds.end()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saved_settings_are_read_back() {
        let settings = ViewSettings {
            subject: Subject {
                environment: "studio".into(),
                material: "gold \"24\"".into(),
                mesh: "torus-knot".into(),
            },
            mode: Some(Mode::Cabral),
            arrangement: Arrangement::Split,
            divider: 0.25,
            points: PointSet::Random,
            exposure: -1.0 / 3.0,
            tone: ToneMap::Plain,
            background: Background::MIDDLE_GREY,
            light: Aim { yaw: 1.0, pitch: -0.5 },
            zoom: 2.0,
            inspector: false,
            maximized: true,
            ..ViewSettings::default()
        };
        assert_eq!(ViewSettings::from_json(Some(&settings.to_json())), (settings, None));
    }

    /// Windows of older versions saved these names.
    #[test]
    fn background_and_tone_curve_are_saved_by_name() {
        let saved = r#"{"version": 1, "settings": {"backdrop": "flat", "tone": "plain"}}"#;
        let (background, tone) = (Background::MIDDLE_GREY, ToneMap::Plain);
        let settings = ViewSettings { background, tone, ..ViewSettings::default() };
        assert_eq!(ViewSettings::from_json(Some(saved)), (settings.clone(), None));
        let json = settings.to_json();
        assert!(json.contains(r#""backdrop":"flat""#) && json.contains(r#""tone":"plain""#), "{json}");
    }

    #[test]
    fn unreadable_settings_are_ignored_and_reported() {
        let future = ViewSettings::default().to_json().replace("\"version\":1", "\"version\":99");
        let wrong = ViewSettings::default().to_json().replace("\"brute-force\"", "\"x-ray\"");
        for (saved, word) in [
            ("", "EOF"),
            ("{", "EOF"),
            ("[1, 2]", "no version"),
            ("{\"version\":1}", "no settings"),
            (future.as_str(), "version is 99"),
            (wrong.as_str(), "x-ray"),
        ] {
            let (settings, note) = ViewSettings::from_json(Some(saved));
            assert_eq!(settings, ViewSettings::default(), "{saved}");
            assert!(note.as_ref().is_some_and(|note| note.contains(word)), "{saved}: {note:?}");
        }
        assert_eq!(ViewSettings::from_json(None), (ViewSettings::default(), None));
    }

    #[test]
    fn truncated_settings_never_panic() {
        let whole = ViewSettings::default().to_json();
        for length in 0..whole.len() {
            let _ = ViewSettings::from_json(Some(&whole[..length]));
        }
    }

    #[test]
    fn missing_settings_have_their_default_and_unknown_ones_are_ignored() {
        let (settings, note) = ViewSettings::from_json(Some(
            r#"{"version": 1, "settings": {"exposure": 2.5, "telescope": true}}"#,
        ));
        assert_eq!(settings, ViewSettings { exposure: 2.5, ..ViewSettings::default() });
        assert_eq!(note, None);
    }

    #[test]
    fn numbers_are_clamped_to_their_bounds() {
        let saved = r#"{"version": 1, "settings": {"exposure": 1e300, "zoom": 0, "divider": -3, "size": [1, 1e30],
            "camera": {"yaw": 7.0, "pitch": 100}, "light": {"yaw": -1e3, "pitch": 0}, "amplify": 0}}"#;
        let (settings, note) = ViewSettings::from_json(Some(saved));
        assert_eq!(note, None);
        assert_eq!((settings.exposure, settings.zoom, settings.divider), (12.0, 0.25, 0.0));
        assert_eq!((settings.size, settings.amplify), ([320.0, 16384.0], 1.0));
        assert!((settings.camera.yaw - (7.0 - std::f64::consts::TAU)).abs() < 1e-12);
        assert_eq!(settings.camera.pitch, ViewSettings::STEEPEST);
        assert!(settings.light.yaw.abs() <= std::f64::consts::PI);
        let nan = ViewSettings { zoom: f64::NAN, size: [f32::NAN; 2], ..ViewSettings::default() };
        assert_eq!(nan.within_bounds(), ViewSettings::default());
    }
}
