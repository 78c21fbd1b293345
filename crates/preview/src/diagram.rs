//! The picture of [`crate::Mode::Samples`]: three mirror balls with the light, the lobe and their product,
//! and over each the points that importance sampling draws from it.
//!
//! The CPU draws it for both renderers, so that their pictures are the same. The balls turn with the camera.
//! Light and product have the exposure and the tone curve of the shot; the lobe has its largest value at 1,
//! and the product is the light times that.

#[cfg(test)]
mod tests;

use std::sync::{Arc, Weak};

use envmap::ToneMap;
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use sphere::Rotation;

use crate::drawing::{Align, Canvas, Rect, Style, Weight};
use crate::lobe::{Lobe, SurfaceFrame};
use crate::mirror_ball::MirrorBall;
use crate::sample_sets::{SampleSets, SampleSource};
use crate::shading::develop::{codes, develop};
use crate::shading::lat_long;
use crate::{Light, Look, Scene, Shot};

const SURROUND: [u8; 3] = [24, 24, 25];
const TEXT: [u8; 3] = [236, 236, 238];
const POINT: [u8; 3] = [255, 120, 30];
const OUTLINE: [u8; 3] = [0; 3];

/// The radius of a point, and of what is dark around it, as shares of the radius of a ball.
const POINT_RADIUS: f32 = 0.011;
const OUTLINE_RADIUS: f32 = 0.017;

/// What a ball shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Light,
    Lobe,
    Product,
}

impl Part {
    /// From left to right.
    const ALL: [Self; 3] = [Self::Light, Self::Lobe, Self::Product];

    fn name(self) -> &'static str {
        match self {
            Self::Light => "light",
            Self::Lobe => "lobe",
            Self::Product => "product",
        }
    }

    fn points(self, sets: &SampleSets) -> Result<&[[f32; 3]], &'static str> {
        let drawn = match self {
            Self::Light => &sets.light,
            Self::Lobe => &sets.lobe,
            Self::Product => &sets.product,
        };
        drawn.as_deref().map_err(|why| *why)
    }
}

/// Draws the diagrams of one shot after another.
#[derive(Debug, Default)]
pub(crate) struct Diagram {
    source: SampleSource,
    last: Option<(Seen, Vec<[u8; 3]>)>,
}

/// What determines a diagram.
#[derive(Clone, Debug)]
struct Seen {
    look: Weak<Look>,
    size: [usize; 2],
    samples: u32,
    camera: [f64; 2],
    turn: Rotation,
    exposure: f64,
    tone: ToneMap,
}

impl PartialEq for Seen {
    fn eq(&self, other: &Self) -> bool {
        let view = |seen: &Self| (seen.size, seen.samples, seen.camera, seen.turn, seen.exposure, seen.tone);
        self.look.ptr_eq(&other.look) && view(self) == view(other)
    }
}

impl Diagram {
    /// The codes of a picture so wide, as high as the shot. It is the last one if nothing in it changed.
    pub(crate) fn draw(&mut self, scene: &Scene, shot: &Shot, width: u32) -> &[[u8; 3]] {
        let size = [width as usize, shot.size[1] as usize];
        let look = scene.objects.first().map(|object| &object.look);
        let seen = Seen {
            look: look.map(Arc::downgrade).unwrap_or_default(),
            size,
            samples: shot.samples.clamp(1, 4),
            camera: [shot.camera.yaw, shot.camera.pitch],
            turn: shot.turn,
            exposure: shot.exposure,
            tone: shot.tone,
        };
        let (_, codes) = match self.last.take() {
            Some(last) if last.0 == seen => self.last.insert(last),
            _ => {
                let codes = match look {
                    Some(look) => self.balls(look, shot, size),
                    None => Layout::new(size).caption("the scene has no surface"),
                };
                self.last.insert((seen, codes))
            }
        };
        codes
    }

    fn balls(&mut self, look: &Arc<Look>, shot: &Shot, size: [usize; 2]) -> Vec<[u8; 3]> {
        let frame = SurfaceFrame::new(shot);
        let sets = self.source.draw(look, frame);
        let functions = Functions { light: look.light(), lobe: self.source.lobe(), frame, shot };
        let (layout, ball) = (Layout::new(size), MirrorBall::new(shot));
        let mut canvas = layout.canvas();
        for (part, place) in Part::ALL.into_iter().zip(layout.balls()) {
            match part.points(&sets) {
                Ok(points) => {
                    place.shade(&mut canvas, shot.samples.clamp(1, 4), |at| {
                        ball.direction(at).map(|direction| functions.display(part, direction))
                    });
                    place.mark(&mut canvas, points.iter().map(|point| ball.place(Vec3::from(*point))));
                }
                Err(why) => {
                    layout.style(Weight::Regular).draw(&mut canvas, place.middle, Align::Centre, why);
                }
            }
            layout.style(Weight::SemiBold).draw(&mut canvas, place.label, Align::Centre, part.name());
        }
        canvas.pixels().to_vec()
    }
}

/// The functions that the balls show, in the light's frame.
struct Functions<'a> {
    light: &'a Light,
    lobe: Option<&'a Lobe>,
    frame: SurfaceFrame,
    shot: &'a Shot,
}

impl Functions<'_> {
    /// The display values of a function in a direction.
    fn display(&self, part: Part, direction: Vec3) -> Vec3 {
        let lobe = || self.lobe.map_or(Vec3::ZERO, |lobe| lobe.value(self.frame, direction));
        let light = || {
            let environment = self.light.environment();
            let size = [environment.grid().width as u32, environment.grid().height as u32];
            lat_long::sample(size, environment.pixels(), direction)
        };
        let gain = self.shot.exposure.exp2() as f32;
        match part {
            Part::Light => develop(light(), gain, self.shot.tone),
            Part::Lobe => develop(lobe(), 1.0, self.shot.tone),
            Part::Product => develop(light() * lobe(), gain, self.shot.tone),
        }
    }
}

/// The places of balls and labels in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Layout {
    size: [usize; 2],
    /// Pixels per em.
    em: f32,
    radius: f32,
}

/// The place of a ball.
#[derive(Clone, Copy, Debug, PartialEq)]
struct BallPlace {
    centre: Vec2,
    radius: f32,
    /// The line of text in its middle.
    middle: Rect,
    /// The line of text below.
    label: Rect,
}

impl Layout {
    /// The largest balls that fit side by side, each above its label.
    fn new(size: [usize; 2]) -> Self {
        let [column, height] = [size[0] as f32 / Part::ALL.len() as f32, size[1] as f32];
        let em = (column / 16.0).min(height / 20.0).clamp(8.0, 28.0);
        let radius = (0.47 * column).min((height - 3.0 * em) / 2.0).max(0.0);
        Self { size, em, radius }
    }

    fn canvas(&self) -> Canvas {
        Canvas::new(self.size[0], self.size[1], SURROUND)
    }

    fn style(&self, weight: Weight) -> Style {
        Style { weight, size: self.em, colour: TEXT }
    }

    /// A picture of a line of text.
    fn caption(&self, text: &str) -> Vec<[u8; 3]> {
        let mut canvas = self.canvas();
        let whole = Rect::new(0, 0, self.size[0], self.size[1]);
        self.style(Weight::Regular).draw(&mut canvas, whole, Align::Centre, text);
        canvas.pixels().to_vec()
    }

    /// The balls from left to right.
    fn balls(&self) -> [BallPlace; 3] {
        let [column, height] = [self.size[0] as f32 / Part::ALL.len() as f32, self.size[1] as f32];
        let line = 2.0 * self.em;
        let centre = (height - line) / 2.0;
        let below = centre + self.radius;
        let row = |part: usize, top: f32| {
            let left = part as f32 * column;
            Rect::new(left as usize, top.max(0.0) as usize, column as usize, line as usize)
        };
        [0, 1, 2].map(|part| BallPlace {
            centre: Vec2::new((part as f32 + 0.5) * column, centre),
            radius: self.radius,
            middle: row(part, centre - line / 2.0),
            label: row(part, below),
        })
    }
}

impl BallPlace {
    /// The point of the unit disk at a point of the picture, with y upward.
    fn on_disk(&self, at: Vec2) -> Vec2 {
        (at - self.centre) * Vec2::new(1.0, -1.0) / self.radius
    }

    /// Draws the ball: `display` has the linear display values on the unit disk. Each pixel is the mean of
    /// samples along both sides.
    fn shade(&self, canvas: &mut Canvas, samples: u32, display: impl Fn(Vec2) -> Option<Vec3> + Sync) {
        if self.radius < 1.0 {
            return;
        }
        let least = (self.centre - self.radius).max(Vec2::ZERO).floor();
        let most =
            (self.centre + self.radius).ceil().min(Vec2::new(canvas.width() as f32, canvas.height() as f32));
        let [left, top] = [least.x as usize, least.y as usize];
        let [width, height] = [most.x as usize - left, most.y as usize - top];
        let mut pixels = vec![([0.0; 3], 0.0); width * height];
        pixels.par_chunks_mut(width).enumerate().for_each(|(row, pixels)| {
            for (column, pixel) in pixels.iter_mut().enumerate() {
                let corner = Vec2::new((left + column) as f32, (top + row) as f32);
                let (mut sum, mut count) = (Vec3::ZERO, 0.0);
                for sample in 0..samples * samples {
                    let inside = Vec2::new((sample % samples) as f32, (sample / samples) as f32);
                    let at = corner + (inside + 0.5) / samples as f32;
                    if let Some(value) = display(self.on_disk(at)) {
                        sum += value;
                        count += 1.0;
                    }
                }
                let colour = if count > 0.0 { sum / count } else { sum };
                *pixel = (colour.to_array(), count / (samples * samples) as f32);
            }
        });
        let (colours, cover): (Vec<_>, Vec<_>) = pixels.into_iter().unzip();
        for (index, (code, cover)) in codes(&colours).into_iter().zip(cover).enumerate() {
            canvas.blend((left + index % width) as i64, (top + index / width) as i64, code, cover);
        }
    }

    /// Draws points of the unit disk.
    fn mark(&self, canvas: &mut Canvas, points: impl Iterator<Item = Vec2>) {
        let dot = (POINT_RADIUS * self.radius).max(0.8);
        let outline = (OUTLINE_RADIUS * self.radius).max(1.4);
        for point in points {
            let at = self.centre + point * Vec2::new(1.0, -1.0) * self.radius;
            disk(canvas, at, outline, OUTLINE);
            disk(canvas, at, dot, POINT);
        }
    }
}

/// Draws a disk with smooth edges.
fn disk(canvas: &mut Canvas, centre: Vec2, radius: f32, colour: [u8; 3]) {
    let [least, most] = [(centre - radius - 1.0).floor(), (centre + radius + 1.0).ceil()];
    for y in least.y as i64..most.y as i64 {
        for x in least.x as i64..most.x as i64 {
            let distance = (Vec2::new(x as f32, y as f32) + 0.5).distance(centre);
            canvas.blend(x, y, colour, (radius + 0.5 - distance).clamp(0.0, 1.0));
        }
    }
}
