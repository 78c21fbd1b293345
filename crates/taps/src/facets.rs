//! The taps of a material that depends on the direction of its tangent, such as brushed metal: each is a
//! facet that is tilted against the surface.
//!
//! In the frame of the surface, +X the tangent and +Z the normal, tap j has the half vector
//! h_j = (p_j, q_j, 1) and looks along V mirrored about it,
//!
//! > d_j = 2 (V.h_j) / (h_j.h_j) h_j - V.
//!
//! p_j and q_j, its width and its weight depend on the view. They are tabulated over a disc, whose centre is
//! the view along the normal and whose rim is the horizon:
//!
//! > (x, y) = (V_x, V_y) / sqrt((1 + V_z) (1 + sqrt(V_z))), at a distance of sqrt(1 - sqrt(V_z)) from the
//! > centre
//!
//! so that rows lie densest toward grazing views, and a look-up takes no angle. The table is a square about
//! the disc, or about a quarter of it if mirrors along the tangent and across it change nothing.

use sphere::{DVec3, Direction};

use crate::ScaleSpace;
use crate::table::{NormalTap, Tap, TapTable};

/// A look-up in the levels of a scale space along the view mirrored about a tilted facet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FacetTap {
    /// The facet's slope along the tangent and across it: p and q of its half vector (p, q, 1).
    pub slope: [f64; 2],
    /// The standard deviation of the blur, in radians.
    pub std: f64,
    /// The weight, RGB.
    pub weight: [f64; 3],
}

/// The facet taps toward one view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FacetNode {
    /// The look-ups in the levels.
    pub taps: Vec<FacetTap>,
    /// The look-ups about the normal.
    pub normals: Vec<NormalTap>,
}

impl FacetNode {
    /// The taps of a table by the angle from the normal, as facets, toward a view in the frame of the
    /// surface. A tap that is turned from R toward the normal by delta is a facet that leans toward the
    /// viewer by half of it.
    pub(crate) fn from_row(table: &TapTable, view: DVec3) -> Self {
        let row = table.at(view.z);
        let across = DVec3::new(view.x, view.y, 0.0).normalize_or_zero();
        let tap = |tap: &Tap| {
            let slope = math::tan(0.5 * tap.delta);
            FacetTap { slope: [slope * across.x, slope * across.y], std: tap.std, weight: tap.weight }
        };
        Self { taps: row.taps.iter().map(tap).collect(), normals: row.normals }
    }
}

/// The frame of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceFrame {
    x: DVec3,
    y: DVec3,
    z: DVec3,
}

impl SurfaceFrame {
    /// The frame with this normal (+Z) and this tangent, less what of it is along the normal (+X). If nothing
    /// is left of the tangent, +X is any direction at a right angle to the normal.
    pub fn new(normal: Direction, tangent: Direction) -> Self {
        let (z, t) = (normal.vector(), tangent.vector());
        let across = t - z.dot(t) * z;
        let x = if across.length_squared() > 1e-12 { across.normalize() } else { z.any_orthonormal_vector() };
        Self { x, y: z.cross(x), z }
    }

    /// The normal.
    pub fn normal(&self) -> Direction {
        Direction::from_unit(self.z)
    }

    /// A direction of the world in the frame.
    pub fn to_local(&self, direction: Direction) -> Direction {
        let v = direction.vector();
        Direction::normalised(DVec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z)))
    }

    /// A direction of the frame in the world.
    pub fn to_world(&self, direction: Direction) -> Direction {
        let v = direction.vector();
        Direction::normalised(v.x * self.x + v.y * self.y + v.z * self.z)
    }
}

/// The place in the disc of a view in the frame of the surface; one below the horizon counts as at it.
pub(crate) fn disc(view: DVec3) -> [f64; 2] {
    let z = view.z.clamp(0.0, 1.0);
    let scale = 1.0 / ((1.0 + z) * (1.0 + z.sqrt())).sqrt();
    [view.x * scale, view.y * scale]
}

/// The view at a place in the disc; a place beyond its rim counts as at the rim.
pub(crate) fn view_at([x, y]: [f64; 2]) -> DVec3 {
    let squared_length = x * x + y * y;
    let z = math::powi(1.0 - squared_length.min(1.0), 2);
    let across = (1.0 - z * z).max(0.0).sqrt();
    let length = squared_length.sqrt();
    if length < 1e-12 { DVec3::Z } else { DVec3::new(across * x / length, across * y / length, z) }
}

/// The view mirrored about a facet of a slope, in the frame of the surface.
pub(crate) fn mirrored(view: DVec3, [p, q]: [f64; 2]) -> DVec3 {
    let h = DVec3::new(p, q, 1.0);
    2.0 * view.dot(h) / h.length_squared() * h - view
}

/// The facet taps of a material by the view.
#[derive(Clone, Debug, PartialEq)]
pub struct FacetTable {
    is_quarter: bool,
    nodes: Vec<FacetNode>,
}

impl FacetTable {
    /// The nodes along a side of the square about a quarter of the disc.
    pub const QUARTER: usize = 25;

    /// The nodes along a side of the square about the whole disc.
    pub const WHOLE: usize = 2 * Self::QUARTER - 1;

    /// A table of nodes, row by row: x goes from -1 to 1 in each row and y from -1 to 1 from row to row, or
    /// both from 0 if only a quarter is stored. `None` if the number of nodes is neither
    /// [`FacetTable::WHOLE`] squared nor [`FacetTable::QUARTER`] squared, they have not the same numbers of
    /// taps, or a width is not above 0.
    pub fn new(nodes: Vec<FacetNode>) -> Option<Self> {
        let is_quarter = nodes.len() == Self::QUARTER * Self::QUARTER;
        let is_square = is_quarter || nodes.len() == Self::WHOLE * Self::WHOLE;
        let counts = |node: &FacetNode| (node.taps.len(), node.normals.len());
        let is_even = nodes.windows(2).all(|nodes| counts(&nodes[0]) == counts(&nodes[1]));
        let is_wide = nodes.iter().flat_map(|node| &node.taps).all(|tap| tap.std > 0.0);
        (is_square && is_even && is_wide).then_some(Self { is_quarter, nodes })
    }

    /// Whether only views with x >= 0 and y >= 0 are stored, and the others are their mirror images.
    pub fn is_quarter(&self) -> bool {
        self.is_quarter
    }

    /// The nodes along a side of the square.
    pub fn side(&self) -> usize {
        if self.is_quarter { Self::QUARTER } else { Self::WHOLE }
    }

    /// The nodes, row by row.
    pub fn nodes(&self) -> &[FacetNode] {
        &self.nodes
    }

    /// The number J of look-ups in the levels.
    pub fn taps(&self) -> usize {
        self.nodes[0].taps.len()
    }

    /// The number K of look-ups about the normal.
    pub fn normals(&self) -> usize {
        self.nodes[0].normals.len()
    }

    /// A table of nodes that were made alike.
    pub(crate) fn from_nodes(nodes: Vec<FacetNode>) -> Self {
        Self { is_quarter: nodes.len() == Self::QUARTER * Self::QUARTER, nodes }
    }

    /// The number of nodes of a table about the whole disc or a quarter of it.
    pub(crate) fn nodes_of(is_quarter: bool) -> usize {
        if is_quarter { Self::QUARTER * Self::QUARTER } else { Self::WHOLE * Self::WHOLE }
    }

    /// The place in the disc of a node.
    pub(crate) fn place(is_quarter: bool, index: usize) -> [f64; 2] {
        let (side, first) = if is_quarter { (Self::QUARTER, 0.0) } else { (Self::WHOLE, -1.0) };
        [index % side, index / side].map(|step| first + (1.0 - first) * step as f64 / (side - 1) as f64)
    }

    /// The taps toward a view in the frame of the surface: bilinear between nodes, the width in its
    /// logarithm.
    pub fn at(&self, view: Direction) -> FacetNode {
        let [x, y] = disc(view.vector());
        let signs =
            if self.is_quarter { [x, y].map(|value| if value < 0.0 { -1.0 } else { 1.0 }) } else { [1.0; 2] };
        let side = self.side();
        let first = if self.is_quarter { 0.0 } else { -1.0 };
        let place = |value: f64| {
            let x = ((value - first) / (1.0 - first)).clamp(0.0, 1.0) * (side - 1) as f64;
            let step = (x as usize).min(side - 2);
            (step, x - step as f64)
        };
        let ((column, s), (row, t)) = (place(signs[0] * x), place(signs[1] * y));
        let node = |dx: usize, dy: usize| &self.nodes[(row + dy) * side + column + dx];
        let nodes = [node(0, 0), node(1, 0), node(0, 1), node(1, 1)];
        let shares = [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t];
        let blend = |value: &dyn Fn(&FacetNode) -> f64| -> f64 {
            nodes.iter().zip(shares).map(|(node, share)| share * value(node)).sum()
        };
        let tap = |j: usize| FacetTap {
            slope: std::array::from_fn(|axis| signs[axis] * blend(&|node| node.taps[j].slope[axis])),
            std: math::exp(blend(&|node| math::ln(node.taps[j].std))),
            weight: std::array::from_fn(|channel| blend(&|node| node.taps[j].weight[channel])),
        };
        let normal = |j: usize| NormalTap {
            y: blend(&|node| node.normals[j].y),
            weight: std::array::from_fn(|channel| blend(&|node| node.normals[j].weight[channel])),
        };
        FacetNode {
            taps: (0..self.taps()).map(tap).collect(),
            normals: (0..self.normals()).map(normal).collect(),
        }
    }

    /// The radiance toward a view in the world, RGB; the lights beside the scale space are not in it. A view
    /// below the horizon counts as at it.
    pub fn radiance(&self, light: &ScaleSpace, frame: SurfaceFrame, view: Direction) -> [f64; 3] {
        let v = frame.to_local(view).vector();
        let local = Direction::normalised(DVec3::new(v.x, v.y, v.z.max(0.0)));
        let node = self.at(local);
        let mut sum = [0.0; 3];
        let mut add = |weight: [f64; 3], light: [f64; 3]| {
            (0..3).for_each(|channel| sum[channel] += weight[channel] * light[channel]);
        };
        for tap in &node.taps {
            let toward = frame.to_world(Direction::normalised(mirrored(local.vector(), tap.slope)));
            add(tap.weight, light.blurred(toward, tap.std));
        }
        for tap in &node.normals {
            add(tap.weight, light.about_normal(frame.normal(), tap.y));
        }
        sum
    }
}
