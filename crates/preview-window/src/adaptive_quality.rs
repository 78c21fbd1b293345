//! How well a picture is drawn, by how long it takes: coarse while things move, so that the hand is followed, fine at rest.

use std::collections::HashMap;

use preview::{Mode, Show};

/// How well a picture is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fineness {
    /// By what the sides of the picture are divided.
    pub(crate) coarse: u32,
    /// Samples along each side of a pixel.
    pub(crate) samples: u32,
}

impl Fineness {
    /// Every pixel once.
    pub(crate) const FULL: Self = Self { coarse: 1, samples: 1 };

    /// From fine to coarse.
    const LADDER: [Self; 7] = [
        Self { coarse: 1, samples: 2 },
        Self::FULL,
        Self { coarse: 2, samples: 1 },
        Self { coarse: 3, samples: 1 },
        Self { coarse: 4, samples: 1 },
        Self { coarse: 6, samples: 1 },
        Self { coarse: 8, samples: 1 },
    ];

    /// The size of a picture that fills `size`.
    pub(crate) fn size(self, size: [u32; 2]) -> [u32; 2] {
        size.map(|side| side.div_ceil(self.coarse).max(1))
    }

    fn of(self, size: [u32; 2]) -> f64 {
        let [width, height] = self.size(size).map(f64::from);
        width * height * f64::from(self.samples).powi(2)
    }
}

/// A picture is to follow the hand within this many seconds.
const MOVING: f64 = 0.04;

/// A picture at rest that takes longer than this many seconds comes after one of half its sides.
const LONG: f64 = 0.5;

/// A picture at rest may take this many seconds for smoother outlines.
const RESTING: f64 = 1.5;

/// What is known of how long pictures take.
#[derive(Debug, Default)]
pub(crate) struct AdaptiveQuality {
    known: HashMap<(Mode, Option<Mode>), Known>,
}

/// How long pictures of a kind took: samples and seconds of one of the smallest and of one of the largest.
#[derive(Clone, Copy, Debug)]
struct Known {
    small: [f64; 2],
    large: [f64; 2],
}

impl AdaptiveQuality {
    /// Learns from a picture.
    pub(crate) fn learn(&mut self, show: Show, size: [u32; 2], fineness: Fineness, seconds: f64) {
        let samples = fineness.of(size);
        let now = [samples, seconds];
        let known = self.known.entry(modes(show)).or_insert(Known { small: now, large: now });
        // A slow picture, as the first one with new maps, is soon forgotten; a slower one is believed at once.
        let eased = |[of, before]: [f64; 2]| {
            let same = (of - samples).abs() < 0.1 * samples;
            [samples, if same && before > seconds { 0.5 * (before + seconds) } else { seconds }]
        };
        if samples <= 1.1 * known.small[0] {
            known.small = eased(known.small);
        }
        if samples >= 0.9 * known.large[0] {
            known.large = eased(known.large);
        }
    }

    /// How fine a picture is while things move: the finest that follows the hand. The first one of its kind is coarse.
    pub(crate) fn moving(&self, show: Show, size: [u32; 2]) -> Fineness {
        let [.., coarsest] = Fineness::LADDER;
        let Some(known) = self.known.get(&modes(show)) else { return Fineness { coarse: 4, samples: 1 } };
        // Where even an empty picture is late, one that takes twice as long is a good one.
        let most = MOVING.max(2.0 * known.seconds(0.0));
        let fits = |fineness: &Fineness| known.seconds(fineness.of(size)) <= most;
        Fineness::LADDER.into_iter().find(fits).unwrap_or(coarsest)
    }

    /// How fine the pictures at rest are, one after the other, after one that was drawn in motion.
    ///
    /// Brute force smooths by its light samples: it begins anew with smoother outlines only where that costs nothing.
    pub(crate) fn resting(&self, show: Show, size: [u32; 2], after: Fineness) -> Vec<Fineness> {
        let smooth = Fineness { samples: 2, ..Fineness::FULL };
        let most = if show.modes().any(|mode| mode == Mode::BruteForce) { MOVING } else { RESTING };
        let known = self.known.get(&modes(show));
        let smooth_fits = known.is_some_and(|known| known.seconds(smooth.of(size)) <= most);
        let mut rest = Vec::new();
        if after.coarse > 1 {
            let long = known.is_some_and(|known| known.seconds(Fineness::FULL.of(size)) > LONG);
            if long && after.coarse > 2 {
                rest.push(Fineness { coarse: 2, samples: 1 });
            }
            rest.push(Fineness::FULL);
        }
        if after != smooth && smooth_fits {
            rest.push(smooth);
        }
        rest
    }
}

impl Known {
    /// How long a picture will take: so much for any, and so much for a sample.
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

    fn pace(seconds_of_a_full_picture: f64) -> AdaptiveQuality {
        let mut pace = AdaptiveQuality::default();
        pace.learn(SHOW, SIZE, Fineness::FULL, seconds_of_a_full_picture);
        pace
    }

    #[test]
    fn a_fast_device_draws_the_finest_at_once_and_rests() {
        let fast = pace(0.002);
        let moving = fast.moving(SHOW, SIZE);
        assert_eq!(moving, Fineness { coarse: 1, samples: 2 });
        assert_eq!(fast.resting(SHOW, SIZE, moving), []);
    }

    #[test]
    fn a_slow_one_is_coarse_in_motion_and_fine_at_rest() {
        for seconds in [0.05, 0.2, 1.0, 10.0] {
            let slow = pace(seconds);
            let moving = slow.moving(SHOW, SIZE);
            assert!(moving.coarse > 1 && moving.samples == 1, "{moving:?}");
            assert!(moving.of(SIZE) * seconds / Fineness::FULL.of(SIZE) <= MOVING || moving.coarse == 8);
            let rest = slow.resting(SHOW, SIZE, moving);
            assert!(rest.contains(&Fineness::FULL), "{rest:?}");
            assert_eq!(rest[0].coarse, if seconds > LONG { 2 } else { 1 }, "a long wait is cut in two");
        }
        assert_eq!(pace(0.2).resting(SHOW, SIZE, Fineness::FULL).len(), 1, "0.8 s are worth it");
        assert_eq!(pace(1.0).resting(SHOW, SIZE, Fineness::FULL), [], "4 s are not");
    }

    /// A mesh of many triangles takes as long in a small picture as in a large one.
    #[test]
    fn what_every_picture_costs_is_known_after_two() {
        let mut pace = pace(0.5);
        let coarse = Fineness { coarse: 8, samples: 1 };
        pace.learn(SHOW, SIZE, coarse, 0.08);
        let moving = pace.moving(SHOW, SIZE);
        assert_eq!(moving, Fineness { coarse: 3, samples: 1 }, "0.073 s for any and 0.427 s for all pixels");
        assert_eq!(pace.resting(SHOW, SIZE, moving).len(), 1, "1.8 s are too long for smooth outlines");
    }

    #[test]
    fn every_kind_of_picture_has_its_own_pace_and_a_slow_one_is_soon_forgotten() {
        let mut pace = pace(0.002);
        let other = Show::One(Mode::BruteForce);
        assert_eq!(pace.moving(other, SIZE), Fineness { coarse: 4, samples: 1 }, "nothing is known of it");
        pace.learn(SHOW, SIZE, Fineness::FULL, 1.0);
        assert!(pace.moving(SHOW, SIZE).coarse > 1);
        for _ in 0..16 {
            pace.learn(SHOW, SIZE, Fineness::FULL, 0.002);
        }
        assert_eq!(pace.moving(SHOW, SIZE), Fineness { coarse: 1, samples: 2 });
    }

    #[test]
    fn no_picture_is_empty() {
        let coarse = Fineness { coarse: 8, samples: 1 };
        assert_eq!(coarse.size([1281, 3]), [161, 1]);
        assert_eq!(coarse.size([0, 0]), [1, 1]);
    }
}
