//! The number of light samples that are submitted at once.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::device::{Device, POLL_INTERVAL};
use crate::RenderError;

/// The light samples of each frame of a window: as many as the frame rate allows.
#[derive(Debug)]
pub(super) struct SampleBudget {
    count: u32,
    last_submission: Option<Instant>,
    /// Whether each of the last frames is done, the oldest first.
    done: VecDeque<Arc<AtomicBool>>,
}

/// The time of a frame below which the number of light samples rises.
const SMOOTH: Duration = Duration::from_millis(40);
/// The time of a frame above which the number of light samples falls.
const MAX_FRAME: Duration = Duration::from_millis(80);
/// The most light samples of a frame.
const MAX_LIGHT_SAMPLES: u32 = 256;
/// The most frames that may be in flight.
const IN_FLIGHT: usize = 2;

impl Default for SampleBudget {
    fn default() -> Self {
        Self { count: 1, last_submission: None, done: VecDeque::new() }
    }
}

impl SampleBudget {
    /// Waits until at most [`IN_FLIGHT`] frames are in flight, so that their number is bounded.
    pub(super) fn wait(&mut self, device: &Device) -> Result<(), RenderError> {
        while let Some(oldest) = self.done.front() {
            device.check()?;
            if oldest.load(Ordering::Acquire) {
                self.done.pop_front();
            } else if self.done.len() > IN_FLIGHT {
                std::thread::sleep(POLL_INTERVAL);
            } else {
                break;
            }
        }
        Ok(())
    }

    /// The light samples of the next frame, by the time of the last one.
    pub(super) fn next(&mut self) -> u32 {
        match self.last_submission.map(|at| at.elapsed()) {
            Some(since) if since < SMOOTH => self.count = (self.count * 2).min(MAX_LIGHT_SAMPLES),
            Some(since) if since > MAX_FRAME => self.count = (self.count / 2).max(1),
            _ => {}
        }
        self.count
    }

    /// Records that a frame was submitted.
    pub(super) fn submitted(&mut self, queue: &wgpu::Queue) {
        let done = Arc::new(AtomicBool::new(false));
        self.done.push_back(Arc::clone(&done));
        self.last_submission = Some(Instant::now());
        queue.on_submitted_work_done(move || done.store(true, Ordering::Release));
    }
}

/// The light samples of a finished picture. They are split into parts of at most a million, or one per pixel,
/// and into batches that take some hundredths of a second, so that the picture can be cancelled between them.
#[derive(Debug)]
pub(super) struct Batches {
    part: u32,
    parts: u32,
    next: u32,
    end: u32,
    start: Instant,
}

const PART: u64 = 1_000_000;
const MIN_FRAME: Duration = Duration::from_millis(50);

impl Batches {
    /// The batches of a picture with this size and number of light samples per pixel.
    pub(super) fn new(size: [u32; 2], light_samples: u32) -> Self {
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let part = (PART / pixels.max(1)).clamp(1, 256) as u32;
        Self { part, parts: 1, next: 0, end: light_samples, start: Instant::now() }
    }

    /// The parts of the next batch; `None` after the last.
    pub(super) fn next(&mut self) -> Option<Vec<Range<u32>>> {
        self.start = Instant::now();
        let mut batch = Vec::new();
        for _ in 0..self.parts {
            let end = self.next.saturating_add(self.part).min(self.end);
            if self.next < end {
                batch.push(self.next..end);
                self.next = end;
            }
        }
        (!batch.is_empty()).then_some(batch)
    }

    /// Records that the batch is done: the next one is larger if it was fast.
    pub(super) fn done(&mut self) {
        self.parts = if self.start.elapsed() < MIN_FRAME {
            (self.parts * 2).min(1024)
        } else {
            (self.parts / 2).max(1)
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_cover_all_light_samples() {
        for (size, count) in [([1, 1], 1000), ([1920, 1080], 7), ([100, 100], 3001)] {
            let (mut batches, mut next) = (Batches::new(size, count), 0);
            while let Some(batch) = batches.next() {
                for part in batch {
                    assert_eq!(part.start, next);
                    assert!(
                        u64::from(part.end - part.start) * u64::from(size[0] * size[1]) <= PART
                            || part.len() == 1
                    );
                    next = part.end;
                }
                batches.done();
            }
            assert_eq!(next, count);
        }
    }
}
