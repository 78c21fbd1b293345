//! Which triangles are the surface of a solid, and which are sheets.
//!
//! Triangles that share corners are a piece. A piece is closed if each of its edges is passed as often in one
//! direction as in the other: it has an inside, in which a probe sees backs. The back of a sheet, such as a
//! floor of one side, says nothing of where a probe is.

/// For each triangle, whether its piece is closed.
pub(crate) fn closed(triangles: &[[[f32; 3]; 3]]) -> Vec<bool> {
    // Corners at one place are one; -0 is 0.
    let key = |corner: &[f32; 3]| corner.map(|x| (x + 0.0).to_bits());
    let mut places: Vec<[u32; 3]> = triangles.as_flattened().iter().map(key).collect();
    places.sort_unstable();
    places.dedup();
    let place = |corner: &[f32; 3]| places.binary_search(&key(corner)).unwrap_or(0) as u32;
    let corners: Vec<[u32; 3]> =
        triangles.iter().map(|triangle| [0, 1, 2].map(|k| place(&triangle[k]))).collect();
    let mut pieces = Pieces { above: (0..places.len() as u32).collect() };
    for &[a, b, c] in &corners {
        pieces.join(a, b);
        pieces.join(b, c);
    }
    // Each edge from the corner of the lower number, and the direction in which a triangle passes it.
    let mut edges: Vec<(u32, u32, i32)> = corners
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)])
        .filter(|(from, to)| from != to)
        .map(|(from, to)| if from < to { (from, to, 1) } else { (to, from, -1) })
        .collect();
    edges.sort_unstable();
    let mut is_open = vec![false; places.len()];
    for edge in edges.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
        if edge.iter().map(|(_, _, way)| way).sum::<i32>() != 0 {
            is_open[pieces.first(edge[0].0) as usize] = true;
        }
    }
    corners.iter().map(|&[a, ..]| !is_open[pieces.first(a) as usize]).collect()
}

/// Sets of corners, each known by one of them.
struct Pieces {
    above: Vec<u32>,
}

impl Pieces {
    fn first(&mut self, corner: u32) -> u32 {
        let mut at = corner;
        while self.above[at as usize] != at {
            let above = self.above[at as usize];
            self.above[at as usize] = self.above[above as usize];
            at = self.above[at as usize];
        }
        at
    }

    fn join(&mut self, one: u32, other: u32) {
        let (one, other) = (self.first(one), self.first(other));
        self.above[one.max(other) as usize] = one.min(other);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_is_closed_and_a_floor_is_not() {
        let [a, b, c, d] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.0, 0.0, 1.0]];
        let solid = [[a, c, b], [a, b, d], [b, c, d], [c, a, d]];
        let far = |corner: [f32; 3]| corner.map(|x| x + 5.0);
        let floor = [[far(a), far(b), far(c)]];
        let all = [&solid[..], &floor].concat();
        assert_eq!(closed(&all), [true, true, true, true, false]);
        assert_eq!(closed(&solid[1..]), [false; 3]);
    }
}
