//! Vectors in manifests.

use engine::{Diagnostic, Parameter, Value, unexpected};
use serde_json::json;
use sphere::{DVec3, Direction};

/// A vector in a manifest: three numbers [x, y, z] in Specula's frame, not all 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vector(pub [f64; 3]);

impl Vector {
    /// The direction of the vector.
    pub fn direction(self) -> Direction {
        Direction::new(DVec3::from_array(self.0)).unwrap_or(Direction::Z)
    }
}

impl Parameter for Vector {
    fn expected() -> String {
        "[x, y, z], not all 0".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let vector = <[f64; 3]>::try_from(Vec::<f64>::parse(value)?).ok();
        let vector = vector.filter(|vector| Direction::new(DVec3::from_array(*vector)).is_some());
        vector.map(Self).ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        self.0.iter().map(Parameter::canonical).collect()
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "array", "items": f64::schema(), "minItems": 3, "maxItems": 3 })
    }
}

/// A place in a manifest: [x, y, z] in Specula's frame, in the unit of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place(pub [f64; 3]);

impl Parameter for Place {
    fn expected() -> String {
        "[x, y, z]".into()
    }

    fn parse(value: &Value) -> Result<Self, Diagnostic> {
        let place = <[f64; 3]>::try_from(Vec::<f64>::parse(value)?).ok();
        place.map(Self).ok_or_else(|| unexpected(value, &Self::expected()))
    }

    fn canonical(&self) -> serde_json::Value {
        self.0.iter().map(Parameter::canonical).collect()
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "array", "items": f64::schema(), "minItems": 3, "maxItems": 3 })
    }
}
