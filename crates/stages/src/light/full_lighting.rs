//! The lighting of an environment with more than enough degrees.

use engine::{Failure, Reporter};
use envmap::Environment;
use sh::{Degree, Transform};
use sphere::LatLong;

use crate::values::UntilStopped;

/// The highest degree of a series that `convolve` cuts later: see [`brdf::Choice::Full`].
pub(crate) const MAX_UNCUT_DEGREE: usize = 255;

/// The lighting as the default parameters make it: lamps beside a series of more than enough degrees.
pub(crate) fn full(environment: &Environment, reporter: &Reporter) -> Result<sh::Lighting, Failure> {
    let separated = reporter.until_stopped(|stop| environment.separate_lamps(stop))?;
    let degree = highest_degree(environment.grid()).min(Degree::new(MAX_UNCUT_DEGREE)?);
    let transform = Transform::new(environment.grid(), degree)?;
    let series = reporter.until_stopped(|stop| transform.analyse_rows(&separated.soft, stop))?;
    Ok(sh::Lighting { series, lights: separated.lights })
}

/// The highest degree that an image can hold.
pub(crate) fn highest_degree(grid: LatLong) -> Degree {
    let highest = (grid.width.saturating_sub(1) / 2).min(grid.height.saturating_sub(1));
    Degree::new(highest).unwrap_or(Degree::MAX)
}
