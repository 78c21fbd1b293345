// The points of the unit square for light samples: Roberts' R2, shifted by a hash. The twin of sequence.rs,
// with the same integers.

// 2^32 / g and 2^32 / g^2, odd.
const SEQUENCE_STEP = vec2u(0xc13fa9a9u, 0x91e10da5u);

// The shift of a sample of a pixel.
fn sequence_shift(sample_index: u32) -> vec2u {
    let first = sequence_hash(sample_index);
    return vec2u(first, sequence_hash(first ^ 0x9e3779b9u));
}

// Point `i` of a shift, each coordinate at least 0 and below 1.
fn sequence_point(shift: vec2u, i: u32) -> vec2f {
    return vec2f((shift + i * SEQUENCE_STEP) >> vec2u(8u)) * (1.0 / 16777216.0);
}

// O'Neill's PCG.
fn sequence_hash(value: u32) -> u32 {
    let state = value * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}
