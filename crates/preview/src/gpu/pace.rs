//! How many light samples go to the device at once.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::device::{Device, LOOK};
use crate::RenderError;

/// The light samples of each frame of a window: as many as leave it smooth.
#[derive(Debug)]
pub(super) struct Pace {
    count: u32,
    sent: Option<Instant>,
    /// Whether each of the last frames is done, the oldest first.
    done: VecDeque<Arc<AtomicBool>>,
}

/// A window that is slower than this is not given more to do.
const SMOOTH: Duration = Duration::from_millis(40);
/// And one that is slower than this less.
const SLOW: Duration = Duration::from_millis(80);
/// No frame needs more.
const MOST: u32 = 256;
/// Frames that the device may have before it.
const AHEAD: usize = 2;

impl Default for Pace {
    fn default() -> Self {
        Self { count: 1, sent: None, done: VecDeque::new() }
    }
}

impl Pace {
    /// Returns when the device is not far behind: who draws faster than it does would never see an end.
    pub(super) fn keep(&mut self, device: &Device) -> Result<(), RenderError> {
        while let Some(oldest) = self.done.front() {
            device.sound()?;
            if oldest.load(Ordering::Acquire) {
                self.done.pop_front();
            } else if self.done.len() > AHEAD {
                std::thread::sleep(LOOK);
            } else {
                break;
            }
        }
        Ok(())
    }

    /// How many samples the next frame takes, by the time that the last one took.
    pub(super) fn next(&mut self) -> u32 {
        match self.sent.map(|sent| sent.elapsed()) {
            Some(since) if since < SMOOTH => self.count = (self.count * 2).min(MOST),
            Some(since) if since > SLOW => self.count = (self.count / 2).max(1),
            _ => {}
        }
        self.count
    }

    /// A frame was submitted.
    pub(super) fn sent(&mut self, queue: &wgpu::Queue) {
        let done = Arc::new(AtomicBool::new(false));
        self.done.push_back(Arc::clone(&done));
        self.sent = Some(Instant::now());
        queue.on_submitted_work_done(move || done.store(true, Ordering::Release));
    }
}

/// The light samples of a whole picture: parts of a million at most or of one for each pixel, in batches that take some
/// hundredths of a second, so that somebody may stop between them.
#[derive(Debug)]
pub(super) struct Batches {
    part: u32,
    parts: u32,
    next: u32,
    end: u32,
    begun: Instant,
}

const PART: u64 = 1_000_000;
const QUICK: Duration = Duration::from_millis(50);

impl Batches {
    /// Of a picture, and the light samples of each of its pixels.
    pub(super) fn new(size: [u32; 2], light_samples: u32) -> Self {
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let part = (PART / pixels.max(1)).clamp(1, 256) as u32;
        Self { part, parts: 1, next: 0, end: light_samples, begun: Instant::now() }
    }

    /// The parts of the next batch; `None` after the last.
    pub(super) fn next(&mut self) -> Option<Vec<Range<u32>>> {
        self.begun = Instant::now();
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

    /// The batch is done: the next is larger where this one was quick.
    pub(super) fn done(&mut self) {
        self.parts =
            if self.begun.elapsed() < QUICK { (self.parts * 2).min(1024) } else { (self.parts / 2).max(1) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_make_the_whole() {
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
