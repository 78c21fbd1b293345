//! The picture of [`crate::Mode::Samples`]: three mirror balls with the light, the lobe and their product,
//! and over each the points that importance sampling draws from it.
//!
//! The CPU draws it for both renderers, so that their pictures are the same. The balls turn with the camera.
//! The light has the exposure of the shot. The product has that too, scaled so that it is as bright as the
//! light in the mean: points follow densities. The lobe's largest value is two stops above white. All have
//! the tone curve of the shot.

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
use crate::{Light, Look, PointSet, Scene, Shot};

const SURROUND: [u8; 3] = [24, 24, 25];
const TEXT: [u8; 3] = [236, 236, 238];
const POINT: [u8; 3] = [255, 120, 30];
const OUTLINE: [u8; 3] = [0; 3];

/// The factor by which the largest value of a lobe is brighter than white, so that its flanks are seen.
const LOBE_GAIN: f32 = 4.0;

/// The radius of a point as a share of the radius of a ball, smaller than that of the dark around it.
const POINT_RADIUS: f32 = 0.011;
const OUTLINE_RADIUS: f32 = 0.017;

/// The function that a ball shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Light,
    Lobe,
    Product,
}

impl Part {
    /// The parts from left to right.
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

/// The inputs that determine a diagram.
#[derive(Clone, Debug)]
struct Seen {
    look: Weak<Look>,
    size: [usize; 2],
    samples: u32,
    camera: [f64; 2],
    turn: Rotation,
    exposure: f64,
    tone: ToneMap,
    points: PointSet,
}

impl PartialEq for Seen {
    fn eq(&self, other: &Self) -> bool {
        let view = |seen: &Self| (seen.size, seen.samples, seen.camera, seen.turn, seen.exposure, seen.tone);
        self.look.ptr_eq(&other.look) && self.points == other.points && view(self) == view(other)
    }
}

impl Diagram {
    /// Returns the codes of a picture so wide, as high as the shot: those of the last one if nothing in it
    /// changed.
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
            points: shot.points,
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
        let sets = self.source.draw(look, frame, shot.points);
        let product_gain = sets.product_gain;
        let functions =
            Functions { light: look.light(), lobe: self.source.lobe(), product_gain, frame, shot };
        let (layout, ball) = (Layout::new(size), MirrorBall::new(shot));
        let shaded = layout.shade(shot.samples.clamp(1, 4), |at| {
            ball.direction(at).map(|direction| functions.display(direction))
        });
        let mut canvas = layout.canvas();
        for (part, (colours, place)) in Part::ALL.into_iter().zip(shaded.colours.iter().zip(layout.balls())) {
            match part.points(&sets) {
                Ok(points) => {
                    place.draw(&mut canvas, colours, &shaded.cover);
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
    product_gain: f32,
    frame: SurfaceFrame,
    shot: &'a Shot,
}

impl Functions<'_> {
    /// The display values of each part in a direction.
    fn display(&self, direction: Vec3) -> [Vec3; 3] {
        let environment = self.light.environment();
        let size = [environment.grid().width as u32, environment.grid().height as u32];
        let light = lat_long::sample(size, environment.pixels(), direction);
        let lobe = self.lobe.map_or(Vec3::ZERO, |lobe| lobe.value(self.frame, direction));
        let (gain, tone) = (math::exp2(self.shot.exposure) as f32, self.shot.tone);
        Part::ALL.map(|part| match part {
            Part::Light => develop(light, gain, tone),
            Part::Lobe => develop(lobe, LOBE_GAIN, tone),
            Part::Product => develop(light * lobe, self.product_gain * gain, tone),
        })
    }
}

/// The places of balls and labels in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Layout {
    size: [usize; 2],
    /// The size of text in pixels per em.
    em: f32,
    radius: f32,
}

/// The pixels of the square around each ball.
struct Shaded {
    /// The codes of each part.
    colours: [Vec<[u8; 3]>; 3],
    /// The share of each pixel that a ball covers.
    cover: Vec<f32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct BallPlace {
    centre: Vec2,
    radius: f32,
    /// The line of text in the middle of the ball.
    middle: Rect,
    /// The line of text below the ball.
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

    /// Half the edge of the squares around the balls, in pixels.
    fn half_edge(&self) -> usize {
        self.radius.ceil() as usize
    }

    /// The balls from left to right. Their centres are corners of pixels, so that pixels of all balls show
    /// the same directions.
    fn balls(&self) -> [BallPlace; 3] {
        let [column, height] = [self.size[0] as f32 / Part::ALL.len() as f32, self.size[1] as f32];
        let line = 2.0 * self.em;
        let centre = ((height - line) / 2.0).round();
        let row = |part: usize, top: f32| {
            let left = part as f32 * column;
            Rect::new(left as usize, top.max(0.0) as usize, column as usize, line as usize)
        };
        [0, 1, 2].map(|part| BallPlace {
            centre: Vec2::new(((part as f32 + 0.5) * column).round(), centre),
            radius: self.radius,
            middle: row(part, centre - line / 2.0),
            label: row(part, centre + self.radius),
        })
    }

    /// Draws all balls at once: `display` has their linear display values on the unit disk. Each pixel is the
    /// mean of samples along both sides.
    fn shade(&self, samples: u32, display: impl Fn(Vec2) -> Option<[Vec3; 3]> + Sync) -> Shaded {
        let edge = 2 * self.half_edge();
        let mut pixels = vec![([Vec3::ZERO; 3], 0.0); edge * edge];
        pixels.par_chunks_mut(edge.max(1)).enumerate().for_each(|(row, pixels)| {
            for (column, (sums, cover)) in pixels.iter_mut().enumerate() {
                let corner = Vec2::new(column as f32, row as f32) - self.half_edge() as f32;
                let mut count = 0.0;
                for sample in 0..samples * samples {
                    let inside = Vec2::new((sample % samples) as f32, (sample / samples) as f32);
                    let at = corner + (inside + 0.5) / samples as f32;
                    if let Some(values) = display(at * Vec2::new(1.0, -1.0) / self.radius) {
                        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
                        count += 1.0;
                    }
                }
                if count > 0.0 {
                    sums.iter_mut().for_each(|sum| *sum /= count);
                }
                *cover = count / (samples * samples) as f32;
            }
        });
        let of =
            |part: usize| -> Vec<[f32; 3]> { pixels.iter().map(|(sums, _)| sums[part].to_array()).collect() };
        Shaded {
            colours: [0, 1, 2].map(|part| codes(&of(part))),
            cover: pixels.iter().map(|(_, cover)| *cover).collect(),
        }
    }
}

impl BallPlace {
    /// Draws the ball, whose square has these codes and is covered so far.
    fn draw(&self, canvas: &mut Canvas, colours: &[[u8; 3]], cover: &[f32]) {
        let half = self.radius.ceil();
        let [left, top] = [self.centre.x - half, self.centre.y - half].map(|corner| corner as i64);
        let edge = 2 * half as usize;
        for (index, (code, cover)) in colours.iter().zip(cover).enumerate() {
            canvas.blend(left + (index % edge) as i64, top + (index / edge) as i64, *code, *cover);
        }
    }

    /// Draws points of the unit disk.
    fn mark(&self, canvas: &mut Canvas, points: impl Iterator<Item = Vec2>) {
        let dot = (POINT_RADIUS * self.radius).max(0.8);
        let outline = (OUTLINE_RADIUS * self.radius).max(1.4);
        let places: Vec<Vec2> =
            points.map(|point| self.centre + point * Vec2::new(1.0, -1.0) * self.radius).collect();
        // First all outlines: where points are dense, none hides another.
        for (radius, colour) in [(outline, OUTLINE), (dot, POINT)] {
            places.iter().for_each(|at| disk(canvas, *at, radius, colour));
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
