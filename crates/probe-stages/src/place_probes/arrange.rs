//! Where the volumes are: the boxes, or the rooms in them, and what leaks before and after that.

use engine::{Failure, Reporter, Steps};
use probes::{
    Blend, LEAK_POINTS, LEAST_ROOM_STEP, Leaks, PlacesError, ProbePlaces, Surfaces, Volume, leaks, room_step,
    rooms,
};
use stages::plugin::UntilStopped;

/// The most probes that are placed: each takes more than a kilobyte of memory until it is repaired.
const MOST_PLACED: usize = 1 << 21;

/// A box with its name.
pub(super) type NamedBounds = (String, [[f32; 3]; 2]);

/// What leaks in the engines that blend without visibility.
struct Measured {
    three: Leaks,
    bevy: Leaks,
}

impl Measured {
    fn of(surfaces: &Surfaces<'_>, places: &ProbePlaces, reporter: &Reporter) -> Result<Self, Failure> {
        let of = |blend| {
            reporter.until_stopped(|stop| {
                leaks(surfaces, places, blend, LEAK_POINTS, stop)
                    .map_err(|stopped| failure(PlacesError::from(stopped)))
            })
        };
        Ok(Self { three: of(Blend::Three)?, bevy: of(Blend::Bevy)? })
    }

    fn text(&self) -> String {
        let [three, bevy] = [&self.three, &self.bevy].map(|leaks| 100.0 * leaks.mean());
        format!("{three:.2} % in three.js 187 and {bevy:.2} % in Bevy")
    }
}

/// The volumes of boxes.
type VolumesOf<'a> = dyn Fn(&[NamedBounds]) -> Result<Vec<Volume>, Failure> + 'a;

/// How boxes become volumes.
pub(super) struct Arrangement<'a> {
    /// The volumes of boxes as they are.
    pub(super) volumes: &'a VolumesOf<'a>,
    /// The openings that end a room, in metres, if boxes are split into rooms.
    pub(super) opening: Option<f32>,
}

impl Arrangement<'_> {
    /// The places of probes in some boxes and at some points.
    pub(super) fn places(
        &self,
        surfaces: &Surfaces<'_>,
        boxes: &[NamedBounds],
        points: &[[f32; 3]],
        reporter: &Reporter,
    ) -> Result<ProbePlaces, Failure> {
        let place = |volumes: Vec<Volume>| {
            let count = volumes.iter().map(Volume::len).sum::<usize>() + points.len();
            check_count(count)?;
            let steps = Steps::new(reporter, 2 * count);
            steps.until_stopped(|stop| ProbePlaces::new(surfaces, volumes, points, stop).map_err(failure))
        };
        let places = place((self.volumes)(boxes)?)?;
        let Some(opening) = self.opening.filter(|_| !boxes.is_empty()) else { return Ok(places) };
        let before = Measured::of(surfaces, &places, reporter)?.text();
        let rooms = split(boxes, surfaces, opening, reporter)?;
        let places = place((self.volumes)(&rooms)?)?;
        let after = Measured::of(surfaces, &places, reporter)?.text();
        reporter.note(format!(
            "the share of surfaces' light from probes that cannot see them is {before} in the boxes as given, \
             {after} in the {} boxes of rooms",
            rooms.len()
        ));
        Ok(places)
    }
}

/// An error if there are more probes than are placed.
pub(super) fn check_count(count: usize) -> Result<(), Failure> {
    if count <= MOST_PLACED {
        return Ok(());
    }
    Err(Failure::new(format!("there are {count} probes, and at most {MOST_PLACED} are placed"))
        .help("a larger spacing gives fewer; half as dense along each axis is an eighth"))
}

/// The rooms in boxes; a box without rooms stays as it is.
fn split(
    boxes: &[NamedBounds],
    surfaces: &Surfaces<'_>,
    opening: f32,
    reporter: &Reporter,
) -> Result<Vec<NamedBounds>, Failure> {
    let mut all = Vec::new();
    for (name, bounds) in boxes {
        let found = reporter.until_stopped(|stop| {
            rooms(surfaces, *bounds, opening, stop).map_err(|stopped| failure(PlacesError::from(stopped)))
        })?;
        let step = room_step(*bounds);
        if step > LEAST_ROOM_STEP {
            reporter.note(format!(
                "{name} is large: its rooms are found in steps of {step:.2} m, where {LEAST_ROOM_STEP} is usual, and \
                 spaces less wide than a few of them may be missed; smaller `boxes` have shorter steps"
            ));
        }
        if found.is_empty() {
            reporter.note(format!("{name} is not split: it has no free space that is half a metre wide"));
            all.push((name.clone(), *bounds));
        }
        let named = |(room, bounds): (usize, _)| (format!("{name}, room {}", room + 1), bounds);
        all.extend(found.into_iter().enumerate().map(named));
    }
    Ok(all)
}

/// What went wrong, with what helps.
pub(super) fn failure(error: PlacesError) -> Failure {
    let help = match &error {
        PlacesError::AllInside { .. } => {
            Some("turn the triangles of that node around, or make its material double-sided")
        }
        PlacesError::Nothing | PlacesError::NotFinite(_) | PlacesError::Stopped(_) => None,
    };
    let failure = Failure::from(error);
    match help {
        Some(help) => failure.help(help),
        None => failure,
    }
}
