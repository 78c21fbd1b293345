//! Chooses a picture's quality by how long pictures take: coarse while the view moves, so that it follows the
//! pointer, and fine at rest.

use std::collections::HashMap;

use preview::{Mode, Show};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Quality {
    /// The divisor of the picture's width and height.
    pub(crate) downscale: u32,
    /// Samples along each side of a pixel.
    pub(crate) samples: u32,
}

impl Quality {
    /// The quality of one sample for every pixel.
    pub(crate) const FULL: Self = Self { downscale: 1, samples: 1 };

    /// The qualities from fine to coarse.
    const LEVELS: [Self; 7] = [
        Self { downscale: 1, samples: 2 },
        Self::FULL,
        Self { downscale: 2, samples: 1 },
        Self { downscale: 3, samples: 1 },
        Self { downscale: 4, samples: 1 },
        Self { downscale: 6, samples: 1 },
        Self { downscale: 8, samples: 1 },
    ];

    /// The size of a picture that fills `size`.
    pub(crate) fn size(self, size: [u32; 2]) -> [u32; 2] {
        size.map(|side| side.div_ceil(self.downscale).max(1))
    }

    /// The number of samples of a picture that fills `size`.
    fn sample_count(self, size: [u32; 2]) -> f64 {
        let [width, height] = self.size(size).map(f64::from);
        width * height * f64::from(self.samples).powi(2)
    }
}

/// The most seconds for a picture while the view moves.
const MOVING: f64 = 0.04;

/// If a picture at rest takes longer than this many seconds, one of half its width and height is drawn first.
const MAX_STILL_SECONDS: f64 = 0.5;

/// The most seconds for a picture at rest with smoother outlines.
const RESTING: f64 = 1.5;

/// Chooses the quality by the times of earlier pictures.
#[derive(Debug, Default)]
pub(crate) struct AdaptiveQuality {
    timings: HashMap<(Mode, Option<Mode>), Timing>,
}

/// Samples and seconds of one of the smallest and one of the largest pictures of some modes.
#[derive(Clone, Copy, Debug)]
struct Timing {
    small: [f64; 2],
    large: [f64; 2],
}

impl AdaptiveQuality {
    pub(crate) fn record(&mut self, show: Show, size: [u32; 2], quality: Quality, seconds: f64) {
        let samples = quality.sample_count(size);
        let now = [samples, seconds];
        let timing = self.timings.entry(modes(show)).or_insert(Timing { small: now, large: now });
        // A slower time counts at once; a faster one moves halfway, so that the slow first picture with new
        // maps is forgotten after a few.
        let smoothed = |[of, before]: [f64; 2]| {
            let same = (of - samples).abs() < 0.1 * samples;
            [samples, if same && before > seconds { 0.5 * (before + seconds) } else { seconds }]
        };
        if samples <= 1.1 * timing.small[0] {
            timing.small = smoothed(timing.small);
        }
        if samples >= 0.9 * timing.large[0] {
            timing.large = smoothed(timing.large);
        }
    }

    /// The best quality that is fast enough while the view moves. The first picture of its modes is coarse.
    pub(crate) fn moving(&self, show: Show, size: [u32; 2]) -> Quality {
        let [.., coarsest] = Quality::LEVELS;
        let Some(timing) = self.timings.get(&modes(show)) else {
            return Quality { downscale: 4, samples: 1 };
        };
        // If even an empty picture is too slow, allow twice its time.
        let most = MOVING.max(2.0 * timing.seconds(0.0));
        let fits = |quality: &Quality| timing.seconds(quality.sample_count(size)) <= most;
        Quality::LEVELS.into_iter().find(fits).unwrap_or(coarsest)
    }

    /// The qualities of the pictures at rest, in order, after one that was drawn in motion.
    ///
    /// Brute force starts over with smoother outlines only if that is fast: light samples smooth it as well.
    pub(crate) fn resting(&self, show: Show, size: [u32; 2], after: Quality) -> Vec<Quality> {
        let smooth = Quality { samples: 2, ..Quality::FULL };
        let most = if show.modes().any(Mode::is_brute_force) { MOVING } else { RESTING };
        let timing = self.timings.get(&modes(show));
        let smooth_fits = timing.is_some_and(|timing| timing.seconds(smooth.sample_count(size)) <= most);
        let mut rest = Vec::new();
        if after.downscale > 1 {
            let full = Quality::FULL.sample_count(size);
            let long = timing.is_some_and(|timing| timing.seconds(full) > MAX_STILL_SECONDS);
            if long && after.downscale > 2 {
                rest.push(Quality { downscale: 2, samples: 1 });
            }
            rest.push(Quality::FULL);
        }
        if after != smooth && smooth_fits {
            rest.push(smooth);
        }
        rest
    }
}

impl Timing {
    /// How long a picture takes: a constant, plus a time for each sample.
    fn seconds(self, samples: f64) -> f64 {
        let [[few, quick], [many, slow]] = [self.small, self.large];
        if many < 1.5 * few {
            return samples * slow / many;
        }
        let each = ((slow - quick) / (many - few)).max(0.0);
        (slow + each * (samples - many)).max(0.0)
    }
}

fn modes(show: Show) -> (Mode, Option<Mode>) {
    let mut modes = show.modes();
    (modes.next().unwrap_or(Mode::LocalShrm), modes.next())
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [1280, 800];
    const SHOW: Show = Show::One(Mode::LocalShrm);

    fn adaptive(seconds_of_a_full_picture: f64) -> AdaptiveQuality {
        let mut adaptive = AdaptiveQuality::default();
        adaptive.record(SHOW, SIZE, Quality::FULL, seconds_of_a_full_picture);
        adaptive
    }

    #[test]
    fn a_fast_device_draws_the_best_quality_at_once() {
        let fast = adaptive(0.002);
        let moving = fast.moving(SHOW, SIZE);
        assert_eq!(moving, Quality { downscale: 1, samples: 2 });
        assert_eq!(fast.resting(SHOW, SIZE, moving), []);
    }

    #[test]
    fn a_slow_device_is_coarse_in_motion_and_fine_at_rest() {
        for seconds in [0.05, 0.2, 1.0, 10.0] {
            let slow = adaptive(seconds);
            let moving = slow.moving(SHOW, SIZE);
            assert!(moving.downscale > 1 && moving.samples == 1, "{moving:?}");
            let share = moving.sample_count(SIZE) / Quality::FULL.sample_count(SIZE);
            assert!(share * seconds <= MOVING || moving.downscale == 8);
            let rest = slow.resting(SHOW, SIZE, moving);
            assert!(rest.contains(&Quality::FULL), "{rest:?}");
            assert_eq!(
                rest[0].downscale,
                if seconds > MAX_STILL_SECONDS { 2 } else { 1 },
                "a long wait is cut in two"
            );
        }
        assert_eq!(adaptive(0.2).resting(SHOW, SIZE, Quality::FULL).len(), 1, "0.8 s are allowed");
        assert_eq!(adaptive(1.0).resting(SHOW, SIZE, Quality::FULL), [], "4 s are not");
    }

    /// A mesh of many triangles takes as long in a small picture as in a large one.
    #[test]
    fn two_pictures_show_the_constant_part_of_the_time() {
        let mut adaptive = adaptive(0.5);
        let coarse = Quality { downscale: 8, samples: 1 };
        adaptive.record(SHOW, SIZE, coarse, 0.08);
        let moving = adaptive.moving(SHOW, SIZE);
        assert_eq!(
            moving,
            Quality { downscale: 3, samples: 1 },
            "0.073 s for any and 0.427 s for all pixels"
        );
        assert_eq!(adaptive.resting(SHOW, SIZE, moving).len(), 1, "1.8 s are too long for smooth outlines");
    }

    #[test]
    fn modes_are_timed_separately_and_a_slow_picture_is_soon_forgotten() {
        let mut adaptive = adaptive(0.002);
        let other = Show::One(Mode::BruteForce);
        assert_eq!(adaptive.moving(other, SIZE), Quality { downscale: 4, samples: 1 }, "it was never timed");
        adaptive.record(SHOW, SIZE, Quality::FULL, 1.0);
        assert!(adaptive.moving(SHOW, SIZE).downscale > 1);
        for _ in 0..16 {
            adaptive.record(SHOW, SIZE, Quality::FULL, 0.002);
        }
        assert_eq!(adaptive.moving(SHOW, SIZE), Quality { downscale: 1, samples: 2 });
    }

    #[test]
    fn no_picture_is_empty() {
        let coarse = Quality { downscale: 8, samples: 1 };
        assert_eq!(coarse.size([1281, 3]), [161, 1]);
        assert_eq!(coarse.size([0, 0]), [1, 1]);
    }
}
