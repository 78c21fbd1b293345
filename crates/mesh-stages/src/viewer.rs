//! Who looks at a mesh.

use stages::plugin::{Place, Vector};
use transfer::Viewer;

/// The error of a camera that is given though a view is.
pub(crate) fn given_twice(camera: Option<Place>, view: Option<Vector>) -> Option<(&'static str, String)> {
    (camera.is_some() && view.is_some()).then(|| ("camera", "view already sets the viewer".into()))
}

/// The viewer at a place, or far away in a direction; by default in front.
pub(crate) fn viewer(camera: Option<Place>, view: Option<Vector>) -> Viewer {
    match camera {
        Some(Place(place)) => Viewer::At(place),
        None => Viewer::Distant(view.unwrap_or(Vector([1.0, 0.0, 0.0])).direction()),
    }
}
