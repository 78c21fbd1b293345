// The points of the unit square for light samples. The twin of sequence.rs, with the same integers, which
// cites the sources and puts the numbers of sets before this text.

// 2^32 / g and 2^32 / g^2, odd.
const SEQUENCE_STEP = vec2u(0xc13fa9a9u, 0x91e10da5u);

// The points of one sample of a pixel.
struct Sequence {
    // The number of a set.
    points: u32,
    // The shift of even points; the index of the sample, for random ones.
    of_sample: vec2u,
}

fn sequence_new(points: u32, sample_index: u32) -> Sequence {
    if points == SEQUENCE_RANDOM {
        return Sequence(points, vec2u(sample_index, 0u));
    }
    let first = sequence_hash(sample_index);
    return Sequence(points, vec2u(first, sequence_hash(first ^ 0x9e3779b9u)));
}

// Point `i`, each coordinate at least 0 and below 1.
fn sequence_point(sequence: Sequence, i: u32) -> vec2f {
    var bits = sequence.of_sample + i * SEQUENCE_STEP;
    if sequence.points == SEQUENCE_RANDOM {
        bits = sequence_hash_pair(vec2u(i, sequence.of_sample.x));
    }
    return vec2f(bits >> vec2u(8u)) * (1.0 / 16777216.0);
}

// O'Neill's PCG.
fn sequence_hash(value: u32) -> u32 {
    let state = value * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// pcg2d.
fn sequence_hash_pair(pair: vec2u) -> vec2u {
    var v = pair * 1664525u + 1013904223u;
    for (var round = 0u; round < 2u; round++) {
        v.x += v.y * 1664525u;
        v.y += v.x * 1664525u;
        v ^= v >> vec2u(16u);
    }
    return v;
}
