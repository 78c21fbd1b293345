//! What the designer has set, and how it survives the window.

use envmap::ToneMap;
use serde::{Deserialize, Serialize};
use sphere::Rotation;

use super::Subject;
use crate::{Background, Camera, Framing, Mode, Shot, Show};

/// What lies behind, without its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Backdrop {
    Environment,
    Harmonics,
    Flat,
}

impl Backdrop {
    pub(super) const ALL: [Self; 3] = [Self::Environment, Self::Harmonics, Self::Flat];

    pub(super) fn label(self) -> &'static str {
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
pub(super) enum Tone {
    Filmic,
    Plain,
}

impl Tone {
    pub(super) const ALL: [Self; 2] = [Self::Filmic, Self::Plain];

    pub(super) fn label(self) -> &'static str {
        match self {
            Self::Filmic => "filmic",
            Self::Plain => "plain",
        }
    }
}

/// How the two modes share the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Arrangement {
    /// The first mode alone.
    One,
    /// The first left of the divider, the second right of it.
    Split,
    /// The first less the second.
    Difference,
}

/// Two angles in radians, as [`Rotation::from_yaw_pitch_roll`] or [`Camera`] has them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Aim {
    pub(super) yaw: f64,
    pub(super) pitch: f64,
}

/// All that the designer has set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", default)]
pub(super) struct Settings {
    /// The selection, by name; empty names are not chosen yet.
    #[serde(with = "Names")]
    pub(super) subject: Subject,
    pub(super) mode: Mode,
    pub(super) second: Mode,
    pub(super) arrangement: Arrangement,
    /// The share of the width left of the divider, 0 to 1.
    pub(super) divider: f32,
    /// How many times stronger a difference is shown.
    pub(super) amplify: f32,
    pub(super) backdrop: Backdrop,
    /// In stops.
    pub(super) exposure: f64,
    pub(super) tone: Tone,
    pub(super) light: Aim,
    pub(super) camera: Aim,
    pub(super) zoom: f64,
    /// The panel of lists on the left, and the inspector on the right.
    pub(super) lists: bool,
    pub(super) inspector: bool,
    /// Of the window's inside, in points, where it is not maximised.
    pub(super) size: [f32; 2],
    pub(super) maximized: bool,
}

/// [`Subject`] in files.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Subject")]
struct Names {
    environment: String,
    material: String,
    mesh: String,
}

impl Default for Settings {
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

impl Settings {
    pub(super) const EXPOSURES: std::ops::RangeInclusive<f64> = -12.0..=12.0;
    pub(super) const AMPLIFICATIONS: std::ops::RangeInclusive<f32> = 1.0..=256.0;
    pub(super) const ZOOMS: std::ops::RangeInclusive<f64> = 0.25..=16.0;
    /// Short of straight up, where a dragged camera would spin.
    const STEEPEST: f64 = 1.55;

    /// The settings that a window kept; of none, the default ones. Where they cannot be read, the default ones and why.
    pub(super) fn read(kept: Option<&str>) -> (Self, Option<String>) {
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

    /// What [`Settings::read`] takes.
    pub(super) fn write(&self) -> String {
        // Bounded numbers and names always have a form in JSON.
        serde_json::json!({ "version": VERSION, "settings": self }).to_string()
    }

    /// The nearest settings that the window can show: what is no number becomes what it is at first.
    pub(super) fn within_bounds(mut self) -> Self {
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
    pub(super) fn show(&self) -> Show {
        match self.arrangement {
            Arrangement::One => Show::One(self.mode),
            Arrangement::Split => Show::Split { left: self.mode, right: self.second, at: self.divider },
            Arrangement::Difference => {
                Show::Difference { of: self.mode, from: self.second, amplify: self.amplify }
            }
        }
    }

    pub(super) fn background(&self) -> Background {
        match self.backdrop {
            Backdrop::Environment => Background::Environment,
            Backdrop::Harmonics => Background::Harmonics,
            Backdrop::Flat => Background::Flat([GREY; 3]),
        }
    }

    pub(super) fn tone_map(&self) -> ToneMap {
        match self.tone {
            Tone::Filmic => ToneMap::Filmic,
            Tone::Plain => ToneMap::Plain,
        }
    }

    /// The turn of the light, as the kind `rotate` takes its yaw and pitch.
    pub(super) fn turn(&self) -> Rotation {
        Rotation::from_yaw_pitch_roll(self.light.yaw, self.light.pitch, 0.0)
    }

    pub(super) fn camera(&self, framing: Framing) -> Camera {
        let Aim { yaw, pitch } = self.camera;
        Camera { yaw, pitch, zoom: self.zoom, ..Camera::new(framing) }
    }

    /// How a scene with this framing is seen, with one sample a pixel.
    pub(super) fn shot(&self, framing: Framing, size: [u32; 2]) -> Shot {
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
        let settings = Settings {
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
            ..Settings::default()
        };
        assert_eq!(Settings::read(Some(&settings.write())), (settings, None));
    }

    #[test]
    fn what_cannot_be_read_is_left_out_and_told() {
        let future = Settings::default().write().replace("\"version\":1", "\"version\":99");
        let wrong = Settings::default().write().replace("\"local-shrm\"", "\"x-ray\"");
        for (kept, word) in [
            ("", "EOF"),
            ("{", "EOF"),
            ("[1, 2]", "no version"),
            ("{\"version\":1}", "no settings"),
            (future.as_str(), "version is 99"),
            (wrong.as_str(), "x-ray"),
        ] {
            let (settings, note) = Settings::read(Some(kept));
            assert_eq!(settings, Settings::default(), "{kept}");
            assert!(note.as_ref().is_some_and(|note| note.contains(word)), "{kept}: {note:?}");
        }
        assert_eq!(Settings::read(None), (Settings::default(), None));
    }

    #[test]
    fn a_truncated_state_never_panics() {
        let whole = Settings::default().write();
        for length in 0..whole.len() {
            let _ = Settings::read(Some(&whole[..length]));
        }
    }

    #[test]
    fn what_is_missing_is_as_at_first_and_what_is_new_is_left_out() {
        let (settings, note) =
            Settings::read(Some(r#"{"version": 1, "settings": {"exposure": 2.5, "telescope": true}}"#));
        assert_eq!(settings, Settings { exposure: 2.5, ..Settings::default() });
        assert_eq!(note, None);
    }

    #[test]
    fn numbers_out_of_bounds_are_brought_back() {
        let kept = r#"{"version": 1, "settings": {"exposure": 1e300, "zoom": 0, "divider": -3, "size": [1, 1e30],
            "camera": {"yaw": 7.0, "pitch": 100}, "light": {"yaw": -1e3, "pitch": 0}, "amplify": 0}}"#;
        let (settings, note) = Settings::read(Some(kept));
        assert_eq!(note, None);
        assert_eq!((settings.exposure, settings.zoom, settings.divider), (12.0, 0.25, 0.0));
        assert_eq!((settings.size, settings.amplify), ([320.0, 16384.0], 1.0));
        assert!((settings.camera.yaw - (7.0 - std::f64::consts::TAU)).abs() < 1e-12);
        assert_eq!(settings.camera.pitch, Settings::STEEPEST);
        assert!(settings.light.yaw.abs() <= std::f64::consts::PI);
        let nothing = Settings { zoom: f64::NAN, size: [f32::NAN; 2], ..Settings::default() };
        assert_eq!(nothing.within_bounds(), Settings::default());
    }
}
