//! What the designer has set, and how it survives the window.

use envmap::ToneMap;
use serde::{Deserialize, Serialize};
use sphere::Rotation;

use crate::{Background, Camera, Catalog, Framing, List, Mode, Shot, Show, Subject, SubjectRequest};

/// What lies behind, without its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backdrop {
    /// The environment itself.
    Environment,
    /// Its spherical harmonics.
    Harmonics,
    /// A grey.
    Flat,
}

impl Backdrop {
    /// All, in the order of the list.
    pub const ALL: [Self; 3] = [Self::Environment, Self::Harmonics, Self::Flat];

    /// What the window calls it.
    pub fn label(self) -> &'static str {
        match self {
            Self::Environment => "environment",
            Self::Harmonics => "harmonics",
            Self::Flat => "flat",
        }
    }
}

/// The tone curve, by its name in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Tone {
    /// Rolls off highlights.
    Filmic,
    /// Clips highlights.
    Plain,
}

impl Tone {
    /// All, in the order of the list.
    pub const ALL: [Self; 2] = [Self::Filmic, Self::Plain];

    /// What the window calls it.
    pub fn label(self) -> &'static str {
        match self {
            Self::Filmic => "filmic",
            Self::Plain => "plain",
        }
    }
}

/// How the two modes share the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Arrangement {
    /// The first mode alone.
    One,
    /// The first left of the divider, the second right of it.
    Split,
    /// The first less the second.
    Difference,
}

/// Two angles in radians, as [`Rotation::from_yaw_pitch_roll`] or [`Camera`] has them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Aim {
    /// About the vertical axis.
    pub yaw: f64,
    /// About the horizontal axis.
    pub pitch: f64,
}

/// All that the designer has set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", default)]
pub struct ViewSettings {
    /// The selection, by name; empty names are not chosen yet.
    pub subject: Subject,
    /// The map that shades the picture.
    pub mode: Mode,
    /// The map that it is compared with.
    pub second: Mode,
    /// How the two share the picture.
    pub arrangement: Arrangement,
    /// The share of the width left of the divider, 0 to 1.
    pub divider: f32,
    /// How many times stronger a difference is shown.
    pub amplify: f32,
    /// What is seen behind the mesh.
    pub backdrop: Backdrop,
    /// In stops.
    pub exposure: f64,
    /// The tone curve.
    pub tone: Tone,
    /// The turn of the light.
    pub light: Aim,
    /// Where the camera is.
    pub camera: Aim,
    /// The magnification; 1 fits the mesh to the picture.
    pub zoom: f64,
    /// The panel of lists on the left, and the inspector on the right.
    pub lists: bool,
    /// Whether the inspector on the right is open.
    pub inspector: bool,
    /// Of the window's inside, in points, where it is not maximised.
    pub size: [f32; 2],
    /// Whether the window fills the screen.
    pub maximized: bool,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            subject: Subject::default(),
            mode: Mode::LocalShrm,
            second: Mode::BruteForce,
            arrangement: Arrangement::One,
            divider: 0.5,
            amplify: 8.0,
            backdrop: Backdrop::Environment,
            exposure: 0.0,
            tone: Tone::Filmic,
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

/// The light samples of each sample of a pixel, by brute force.
const LIGHT_SAMPLES: u32 = 1024;

/// The radiance of a flat background: a mid grey, before which highlights and shadows are judged alike.
const GREY: f32 = 0.18;

/// The form of kept settings. Raised when old ones would be read wrongly.
const VERSION: u64 = 1;

impl ViewSettings {
    /// The exposures that can be set, in stops.
    pub const EXPOSURES: std::ops::RangeInclusive<f64> = -12.0..=12.0;
    /// The amplifications of a difference that can be set.
    pub const AMPLIFICATIONS: std::ops::RangeInclusive<f32> = 1.0..=256.0;
    /// The magnifications that can be set.
    pub const ZOOMS: std::ops::RangeInclusive<f64> = 0.25..=16.0;
    /// Short of straight up, where a dragged camera would spin.
    const STEEPEST: f64 = 1.55;

    /// The settings that a window kept; of none, the default ones. Where they cannot be read, the default ones and why.
    pub fn read(kept: Option<&str>) -> (Self, Option<String>) {
        let Some(kept) = kept else { return (Self::default(), None) };
        match Self::parse(kept) {
            Ok(settings) => (settings.within_bounds(), None),
            Err(reason) => (Self::default(), Some(format!("the window's kept state is left out: {reason}"))),
        }
    }

    fn parse(kept: &str) -> Result<Self, String> {
        let value: serde_json::Value = serde_json::from_str(kept).map_err(|error| error.to_string())?;
        match value.get("version").and_then(serde_json::Value::as_u64) {
            Some(VERSION) => {}
            Some(version) => return Err(format!("its version is {version}, this program reads {VERSION}")),
            None => return Err("it has no version".into()),
        }
        let settings = value.get("settings").cloned().ok_or("it has no settings")?;
        serde_json::from_value(settings).map_err(|error| error.to_string())
    }

    /// What [`ViewSettings::read`] takes.
    pub fn write(&self) -> String {
        // Bounded numbers and names always have a form in JSON.
        serde_json::json!({ "version": VERSION, "settings": self }).to_string()
    }

    /// The nearest settings that the window can show: what is no number becomes what it is at first.
    pub fn within_bounds(mut self) -> Self {
        let first = Self::default();
        let angle = |angle: f64, first: f64| if angle.is_finite() { wrapped(angle) } else { first };
        self.divider = bounded(self.divider.into(), 0.0..=1.0, first.divider.into()) as f32;
        let (least, most) = (*Self::AMPLIFICATIONS.start(), *Self::AMPLIFICATIONS.end());
        self.amplify = bounded(self.amplify.into(), least.into()..=most.into(), first.amplify.into()) as f32;
        self.exposure = bounded(self.exposure, Self::EXPOSURES, first.exposure);
        self.zoom = bounded(self.zoom, Self::ZOOMS, first.zoom);
        self.light = Aim { yaw: angle(self.light.yaw, 0.0), pitch: angle(self.light.pitch, 0.0) };
        let steep = -Self::STEEPEST..=Self::STEEPEST;
        self.camera = Aim {
            yaw: angle(self.camera.yaw, first.camera.yaw),
            pitch: bounded(self.camera.pitch, steep, first.camera.pitch),
        };
        self.size = std::array::from_fn(|side| {
            bounded(self.size[side].into(), 320.0..=16384.0, first.size[side].into()) as f32
        });
        self
    }

    /// Which modes a picture shows.
    pub fn show(&self) -> Show {
        match self.arrangement {
            Arrangement::One => Show::One(self.mode),
            Arrangement::Split => Show::Split { left: self.mode, right: self.second, at: self.divider },
            Arrangement::Difference => {
                Show::Difference { of: self.mode, from: self.second, amplify: self.amplify }
            }
        }
    }

    /// What is drawn behind the mesh.
    pub fn background(&self) -> Background {
        match self.backdrop {
            Backdrop::Environment => Background::Environment,
            Backdrop::Harmonics => Background::Harmonics,
            Backdrop::Flat => Background::Flat([GREY; 3]),
        }
    }

    /// The tone curve that is applied.
    pub fn tone_map(&self) -> ToneMap {
        match self.tone {
            Tone::Filmic => ToneMap::Filmic,
            Tone::Plain => ToneMap::Plain,
        }
    }

    /// The turn of the light, as the kind `rotate` takes its yaw and pitch.
    pub fn turn(&self) -> Rotation {
        Rotation::from_yaw_pitch_roll(self.light.yaw, self.light.pitch, 0.0)
    }

    /// The camera for a scene with this framing.
    pub fn camera(&self, framing: Framing) -> Camera {
        let Aim { yaw, pitch } = self.camera;
        Camera { yaw, pitch, zoom: self.zoom, ..Camera::new(framing) }
    }

    /// How a scene with this framing is seen, with one sample a pixel.
    pub fn shot(&self, framing: Framing, size: [u32; 2]) -> Shot {
        Shot {
            size,
            samples: 1,
            camera: self.camera(framing),
            turn: self.turn(),
            show: self.show(),
            background: self.background(),
            exposure: self.exposure,
            tone: self.tone_map(),
            light_samples: LIGHT_SAMPLES,
        }
    }
}

/// What a preview shows first.
#[derive(Clone, Debug, Default)]
pub struct InitialView {
    /// The settings that the last window kept, as JSON. If they cannot be read, the default settings are used.
    pub state: Option<String>,
    /// What is asked for; it takes precedence over the kept settings.
    pub request: SubjectRequest,
}

impl InitialView {
    /// The settings to begin with, and why those that were kept cannot be used.
    pub fn settings(&self) -> (ViewSettings, Option<String>) {
        let (mut settings, note) = ViewSettings::read(self.state.as_deref());
        let SubjectRequest { environment, material, mesh, mode } = &self.request;
        for (list, requested) in List::ALL.into_iter().zip([environment, material, mesh]) {
            if let Some(requested) = requested {
                list.chosen(&mut settings.subject).clone_from(requested);
            }
        }
        if let Some(mode) = *mode {
            (settings.mode, settings.arrangement) = (mode, Arrangement::One);
        }
        (settings, note)
    }

    /// What is shown first of a catalog. A name that the catalog does not offer is empty, or the one that was asked for.
    pub fn subject(&self, catalog: &Catalog) -> Subject {
        let wanted = self.settings().0.subject;
        catalog.nearest(&wanted, &self.request, &wanted)
    }

    /// How it is shown in a picture that is kept.
    pub fn shot(&self, framing: Framing, size: [u32; 2]) -> Shot {
        self.settings().0.shot(framing, size).to_keep()
    }
}

/// The same angle, -pi to pi.
fn wrapped(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle - turn * (angle / turn).round()
}

fn bounded(value: f64, bounds: std::ops::RangeInclusive<f64>, first: f64) -> f64 {
    if value.is_nan() { first } else { value.clamp(*bounds.start(), *bounds.end()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_is_read_back() {
        let settings = ViewSettings {
            subject: Subject {
                environment: "studio".into(),
                material: "gold \"24\"".into(),
                mesh: "torus-knot".into(),
            },
            mode: Mode::Cabral,
            arrangement: Arrangement::Split,
            divider: 0.25,
            exposure: -1.0 / 3.0,
            tone: Tone::Plain,
            backdrop: Backdrop::Flat,
            light: Aim { yaw: 1.0, pitch: -0.5 },
            zoom: 2.0,
            inspector: false,
            maximized: true,
            ..ViewSettings::default()
        };
        assert_eq!(ViewSettings::read(Some(&settings.write())), (settings, None));
    }

    #[test]
    fn what_cannot_be_read_is_left_out_and_told() {
        let future = ViewSettings::default().write().replace("\"version\":1", "\"version\":99");
        let wrong = ViewSettings::default().write().replace("\"local-shrm\"", "\"x-ray\"");
        for (kept, word) in [
            ("", "EOF"),
            ("{", "EOF"),
            ("[1, 2]", "no version"),
            ("{\"version\":1}", "no settings"),
            (future.as_str(), "version is 99"),
            (wrong.as_str(), "x-ray"),
        ] {
            let (settings, note) = ViewSettings::read(Some(kept));
            assert_eq!(settings, ViewSettings::default(), "{kept}");
            assert!(note.as_ref().is_some_and(|note| note.contains(word)), "{kept}: {note:?}");
        }
        assert_eq!(ViewSettings::read(None), (ViewSettings::default(), None));
    }

    #[test]
    fn a_truncated_state_never_panics() {
        let whole = ViewSettings::default().write();
        for length in 0..whole.len() {
            let _ = ViewSettings::read(Some(&whole[..length]));
        }
    }

    #[test]
    fn what_is_missing_is_as_at_first_and_what_is_new_is_left_out() {
        let (settings, note) =
            ViewSettings::read(Some(r#"{"version": 1, "settings": {"exposure": 2.5, "telescope": true}}"#));
        assert_eq!(settings, ViewSettings { exposure: 2.5, ..ViewSettings::default() });
        assert_eq!(note, None);
    }

    #[test]
    fn numbers_out_of_bounds_are_brought_back() {
        let kept = r#"{"version": 1, "settings": {"exposure": 1e300, "zoom": 0, "divider": -3, "size": [1, 1e30],
            "camera": {"yaw": 7.0, "pitch": 100}, "light": {"yaw": -1e3, "pitch": 0}, "amplify": 0}}"#;
        let (settings, note) = ViewSettings::read(Some(kept));
        assert_eq!(note, None);
        assert_eq!((settings.exposure, settings.zoom, settings.divider), (12.0, 0.25, 0.0));
        assert_eq!((settings.size, settings.amplify), ([320.0, 16384.0], 1.0));
        assert!((settings.camera.yaw - (7.0 - std::f64::consts::TAU)).abs() < 1e-12);
        assert_eq!(settings.camera.pitch, ViewSettings::STEEPEST);
        assert!(settings.light.yaw.abs() <= std::f64::consts::PI);
        let nothing = ViewSettings { zoom: f64::NAN, size: [f32::NAN; 2], ..ViewSettings::default() };
        assert_eq!(nothing.within_bounds(), ViewSettings::default());
    }
}
