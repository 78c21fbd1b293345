//! The engines that load light. Each has a file with all that is known of it, and a line in the list.
//!
//! The facts of an engine were read in its source, and seen in the engine where it runs in a browser.

mod babylon;
mod bevy;
mod blender;
mod filament;
mod gltf;
mod godot;
mod three;
mod unity;
mod unreal;

// What they share.
mod cube_light;
mod definition;
mod engine_format;
mod engine_lights;
mod engine_tables;
mod exported_light;
mod levels;
mod tap_shaders;

use std::fmt;
use std::ops::Deref;

use engine::Choice;

pub(crate) use cube_light::{CubeLight, texture};
pub use definition::Engine;
pub(crate) use definition::Skybox;
pub(crate) use engine_format::EngineFormat;
pub(crate) use exported_light::{ExportedLight, LightInFile};
pub(crate) use levels::nearest_power_of_two;
pub(crate) use tap_shaders::{TapFileNames, TapPreset, tap_texts};

/// Every engine that loads light, in the order of schemas, manuals and messages. A new one is the last.
pub const ENGINES: &[&Engine] = &[
    &three::ENGINE,
    &filament::ENGINE,
    &babylon::ENGINE,
    &bevy::ENGINE,
    &gltf::ENGINE,
    &godot::ENGINE,
    &blender::ENGINE,
    &unity::ENGINE,
    &unreal::ENGINE,
];

/// An engine that a manifest names.
#[derive(Clone, Copy)]
pub(crate) struct EnginePreset(&'static Engine);

impl EnginePreset {
    /// The engine for which light is made if nothing names one.
    pub(crate) const DEFAULT: Self = Self(&three::ENGINE);

    /// The engine in whose frame the cubes of `.env` and of glTF are.
    pub(crate) const BABYLON: Self = Self(&babylon::ENGINE);

    /// All that is known of the engine.
    pub(crate) fn engine(self) -> &'static Engine {
        self.0
    }

    /// The preset of the kind that wrote a file with this recipe.
    pub(crate) fn of_recipe(recipe: &str) -> Option<Self> {
        let recipe: serde_json::Value = serde_json::from_str(recipe).ok()?;
        let name = recipe.pointer("/parameters/preset")?.as_str()?;
        ENGINES.iter().find(|engine| engine.name == name).map(|engine| Self(engine))
    }
}

impl Choice for EnginePreset {
    fn words() -> Vec<(&'static str, &'static str, Self)> {
        ENGINES.iter().map(|engine| (engine.name, engine.meaning, Self(engine))).collect()
    }
}

impl Deref for EnginePreset {
    type Target = Engine;

    fn deref(&self) -> &Engine {
        self.0
    }
}

impl PartialEq for EnginePreset {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl fmt::Debug for EnginePreset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// Fills the tables and lists of engines into a manual that has places for them.
pub(crate) fn fill_in(manual: &str) -> String {
    engine_tables::fill_in(manual, ENGINES)
}

#[cfg(test)]
mod tests;
