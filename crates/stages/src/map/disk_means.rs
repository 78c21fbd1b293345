//! The means over the disks of lights, which a build computes once for all materials.

use std::convert::Infallible;
use std::sync::Arc;

use engine::{DerivedValues, Digest};
use sh::Light;
use shrm::DiskMeans;

/// The means over the disks of these lights.
pub(crate) fn disk_means(lights: &[Light], derived: &DerivedValues<'_>) -> Arc<DiskMeans> {
    // They depend on the radii alone.
    let radii: Vec<u8> = lights.iter().flat_map(|light| light.radius.to_le_bytes()).collect();
    let made = derived.get("means over disks", Digest::of(&radii), &[], || {
        let disks = DiskMeans::new(lights);
        let bytes = disks.bytes();
        Ok::<_, Infallible>((disks, bytes))
    });
    match made {
        Ok(disks) => disks,
        Err(never) => match never {},
    }
}
