//! How a block of BC6H is stored: modes, partitions, and the bits of numbers and indices.
//!
//! All numbers are the bits of halves, taken as integers, so a line between two colours is about straight in
//! logarithms. They are stored in 6 to 16 bits, and in most modes as differences from the block's first.

/// Texels along the edge of a block.
pub(crate) const EDGE: usize = 4;

/// The texels of a block.
pub(crate) const TEXELS: usize = EDGE * EDGE;

/// The bytes of a block.
pub(crate) const BYTES: usize = 16;

/// The colours of a block's texels, row by row: the bits of halves.
pub(crate) type Colours = [[i32; 3]; TEXELS];

/// Some texels of a block: a bit for each, the lowest for the first.
pub(crate) type TexelSet = u16;

/// Every texel of a block.
pub(crate) const WHOLE: TexelSet = TexelSet::MAX;

/// Whether a texel is in a set.
pub(crate) const fn contains(set: TexelSet, texel: usize) -> bool {
    set >> texel & 1 == 1
}

/// The place of each index on one line through all colours, in 64ths.
const PLACES_OF_ONE: [i32; 16] = [0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64];

/// The place of each index on one of two lines.
const PLACES_OF_TWO: [i32; 8] = [0, 9, 18, 27, 37, 46, 55, 64];

/// One of the fourteen ways in which a block stores its lines.
pub(crate) struct BlockMode {
    /// The first bits of a block in the mode, and their number.
    code: (u128, u32),
    /// 1, or 2 if each texel is on one of two lines, as a partition says.
    pub(crate) lines: usize,
    /// The number of bits of each of the first colour's numbers.
    pub(crate) bits: u32,
    /// The numbers of bits of the other colours' red, green and blue: all of them, or those of a difference.
    pub(crate) others: [u32; 3],
    /// The numbers in their order, as in the specification: the channel, the colour (w to z), and its bits
    /// from the highest down to the first that is stored.
    layout: &'static str,
}

/// Modes 11 to 14.
pub(crate) const ONE_LINE: [BlockMode; 4] = [
    BlockMode {
        code: (0b00011, 5),
        lines: 1,
        bits: 10,
        others: [10, 10, 10],
        layout: "rw9:0 gw9:0 bw9:0 rx9:0 gx9:0 bx9:0",
    },
    BlockMode {
        code: (0b00111, 5),
        lines: 1,
        bits: 11,
        others: [9, 9, 9],
        layout: "rw9:0 gw9:0 bw9:0 rx8:0 rw10 gx8:0 gw10 bx8:0 bw10",
    },
    BlockMode {
        code: (0b01011, 5),
        lines: 1,
        bits: 12,
        others: [8, 8, 8],
        layout: "rw9:0 gw9:0 bw9:0 rx7:0 rw10:11 gx7:0 gw10:11 bx7:0 bw10:11",
    },
    BlockMode {
        code: (0b01111, 5),
        lines: 1,
        bits: 16,
        others: [4, 4, 4],
        layout: "rw9:0 gw9:0 bw9:0 rx3:0 rw10:15 gx3:0 gw10:15 bx3:0 bw10:15",
    },
];

/// Modes 1 to 10, from the one whose first colour has the most bits to the one that has the fewest.
pub(crate) const TWO_LINES: [BlockMode; 10] = [
    BlockMode {
        code: (0b00010, 5),
        lines: 2,
        bits: 11,
        others: [5, 4, 4],
        layout: "rw9:0 gw9:0 bw9:0 rx4:0 rw10 gy3:0 gx3:0 gw10 bz0 gz3:0 bx3:0 bw10 bz1 \
                 by3:0 ry4:0 bz2 rz4:0 bz3",
    },
    BlockMode {
        code: (0b00110, 5),
        lines: 2,
        bits: 11,
        others: [4, 5, 4],
        layout: "rw9:0 gw9:0 bw9:0 rx3:0 rw10 gz4 gy3:0 gx4:0 gw10 gz3:0 bx3:0 bw10 bz1 \
                 by3:0 ry3:0 bz0 bz2 rz3:0 gy4 bz3",
    },
    BlockMode {
        code: (0b01010, 5),
        lines: 2,
        bits: 11,
        others: [4, 4, 5],
        layout: "rw9:0 gw9:0 bw9:0 rx3:0 rw10 by4 gy3:0 gx3:0 gw10 bz0 gz3:0 bx4:0 bw10 \
                 by3:0 ry3:0 bz1 bz2 rz3:0 bz3:4",
    },
    BlockMode {
        code: (0b00, 2),
        lines: 2,
        bits: 10,
        others: [5, 5, 5],
        layout: "gy4 by4 bz4 rw9:0 gw9:0 bw9:0 rx4:0 gz4 gy3:0 gx4:0 bz0 gz3:0 bx4:0 bz1 \
                 by3:0 ry4:0 bz2 rz4:0 bz3",
    },
    BlockMode {
        code: (0b01110, 5),
        lines: 2,
        bits: 9,
        others: [5, 5, 5],
        layout: "rw8:0 by4 gw8:0 gy4 bw8:0 bz4 rx4:0 gz4 gy3:0 gx4:0 bz0 gz3:0 bx4:0 bz1 \
                 by3:0 ry4:0 bz2 rz4:0 bz3",
    },
    BlockMode {
        code: (0b10010, 5),
        lines: 2,
        bits: 8,
        others: [6, 5, 5],
        layout: "rw7:0 gz4 by4 gw7:0 bz2 gy4 bw7:0 bz3 bz4 rx5:0 gy3:0 gx4:0 bz0 gz3:0 bx4:0 \
                 bz1 by3:0 ry5:0 rz5:0",
    },
    BlockMode {
        code: (0b10110, 5),
        lines: 2,
        bits: 8,
        others: [5, 6, 5],
        layout: "rw7:0 bz0 by4 gw7:0 gy4:5 bw7:0 gz5 bz4 rx4:0 gz4 gy3:0 gx5:0 gz3:0 bx4:0 \
                 bz1 by3:0 ry4:0 bz2 rz4:0 bz3",
    },
    BlockMode {
        code: (0b11010, 5),
        lines: 2,
        bits: 8,
        others: [5, 5, 6],
        layout: "rw7:0 bz1 by4 gw7:0 by5 gy4 bw7:0 bz4:5 rx4:0 gz4 gy3:0 gx4:0 bz0 gz3:0 \
                 bx5:0 by3:0 ry4:0 bz2 rz4:0 bz3",
    },
    BlockMode {
        code: (0b01, 2),
        lines: 2,
        bits: 7,
        others: [6, 6, 6],
        layout: "gy5 gz4 gz5 rw6:0 bz0 bz1 by4 gw6:0 by5 bz2 gy4 bw6:0 bz3 bz4:5 rx5:0 gy3:0 \
                 gx5:0 gz3:0 bx5:0 by3:0 ry5:0 rz5:0",
    },
    BlockMode {
        code: (0b11110, 5),
        lines: 2,
        bits: 6,
        others: [6, 6, 6],
        layout: "rw5:0 gz4 bz0 bz1 by4 gw5:0 gy5 by5 bz2 gy4 bw5:0 gz5 bz3 bz4:5 rx5:0 gy3:0 \
                 gx5:0 gz3:0 bx5:0 by3:0 ry5:0 rz5:0",
    },
];

/// Which texels are on the second of two lines.
pub(crate) struct Partition {
    /// The texels on the second line.
    pub(crate) second: TexelSet,
    /// The texel of the second line whose index has a bit less.
    pub(crate) short: usize,
}

/// The 32 partitions, in the order of their numbers.
pub(crate) const PARTITIONS: [Partition; 32] = {
    const fn partition(second: TexelSet, short: usize) -> Partition {
        Partition { second, short }
    }
    [
        partition(0xcccc, 15),
        partition(0x8888, 15),
        partition(0xeeee, 15),
        partition(0xecc8, 15),
        partition(0xc880, 15),
        partition(0xfeec, 15),
        partition(0xfec8, 15),
        partition(0xec80, 15),
        partition(0xc800, 15),
        partition(0xffec, 15),
        partition(0xfe80, 15),
        partition(0xe800, 15),
        partition(0xffe8, 15),
        partition(0xff00, 15),
        partition(0xfff0, 15),
        partition(0xf000, 15),
        partition(0xf710, 15),
        partition(0x008e, 2),
        partition(0x7100, 8),
        partition(0x08ce, 2),
        partition(0x008c, 2),
        partition(0x7310, 8),
        partition(0x3100, 8),
        partition(0x8cce, 15),
        partition(0x088c, 2),
        partition(0x3110, 8),
        partition(0x6666, 2),
        partition(0x366c, 2),
        partition(0x17e8, 8),
        partition(0x0ff0, 8),
        partition(0x718e, 2),
        partition(0x399c, 2),
    ]
};

impl BlockMode {
    /// Whether a block is in the mode.
    #[cfg(test)]
    pub(crate) fn is_of(&self, block: &[u8; BYTES]) -> bool {
        u128::from(block[0]) & ((1 << self.code.1) - 1) == self.code.0
    }

    /// The place of each index on a line, in 64ths.
    #[inline(always)]
    pub(crate) fn places(&self) -> &'static [i32] {
        if self.lines == 2 { &PLACES_OF_TWO } else { &PLACES_OF_ONE }
    }

    /// Whether the mode stores these colours, of which the first is the base of differences.
    #[inline(always)]
    pub(crate) fn stores(&self, colours: &[[i32; 3]]) -> bool {
        let reaches = |colour: &[i32; 3]| {
            (0..3).all(|channel| self.reaches(channel, colours[0][channel], colour[channel]))
        };
        colours.iter().all(reaches)
    }

    /// Whether the mode stores a channel of a colour beside that of the first.
    #[inline(always)]
    pub(crate) fn reaches(&self, channel: usize, first: i32, other: i32) -> bool {
        let far = 1 << (self.others[channel] - 1);
        !self.has_differences() || (-far..far).contains(&(other - first))
    }

    /// Whether colours after the first are stored as differences from it.
    #[inline(always)]
    fn has_differences(&self) -> bool {
        self.others[0] != self.bits
    }

    /// A block of two colours, or four of two lines, and of the places of texels on their lines, of which
    /// those with a bit less are in the first half. The partition is that of two lines.
    pub(crate) fn store(
        &self,
        colours: &[[i32; 3]],
        partition: usize,
        indices: &[usize; TEXELS],
    ) -> [u8; BYTES] {
        let (mut block, mut at) = self.code;
        let mut put = |value: i32, bits: u32| {
            let mask = (1_u128 << bits) - 1;
            block |= (value as u128 & mask) << at;
            at += bits;
        };
        for number in self.layout.split(' ') {
            let (name, bits) = number.split_at(2);
            let (channel, colour) = (place("rgb", name, 0), place("wxyz", name, 1));
            let (last, first) = bits.split_once(':').unwrap_or((bits, bits));
            let [first, last] = [first, last].map(|bit| bit.parse().unwrap_or(0_u32));
            let base = if colour > 0 && self.has_differences() { colours[0][channel] } else { 0 };
            let value = colours[colour][channel] - base;
            if first <= last {
                put(value >> first, last - first + 1);
            } else {
                (last..=first).rev().for_each(|bit| put(value >> bit, 1));
            }
        }
        let (mut short, mut bits) = (WHOLE & 1, 4);
        if self.lines == 2 {
            put(partition as i32, 5);
            short |= 1 << PARTITIONS[partition].short;
            bits = 3;
        }
        for (texel, &index) in indices.iter().enumerate() {
            put(index as i32, if contains(short, texel) { bits - 1 } else { bits });
        }
        block.to_le_bytes()
    }
}

/// The place in a text of the letter at a place in another.
fn place(letters: &str, name: &str, at: usize) -> usize {
    let letter = name.as_bytes().get(at);
    letters.bytes().position(|known| Some(&known) == letter).unwrap_or(0)
}

/// The number of `bits` bits that stands for about a half's integer.
#[inline(always)]
pub(crate) fn quantise(value: f32, bits: u32) -> i32 {
    // What it stands for is rounded down.
    let wide = (value.clamp(0.0, 31743.0) + 0.5) * (64.0 / 31.0);
    let code = if bits >= 15 { wide } else { wide * (1 << bits) as f32 / 65536.0 - 0.5 };
    ((code + 0.5) as i32).clamp(0, (1 << bits) - 1)
}

/// The 16 bits that a stored number stands for.
#[inline(always)]
pub(crate) fn unquantise(code: i32, bits: u32) -> i32 {
    match code {
        _ if bits >= 15 => code,
        0 => 0,
        _ if code == (1 << bits) - 1 => 0xffff,
        _ => ((code << 16) + 0x8000) >> bits,
    }
}

/// Converts 16 bits to the bits of a half, at most those of 65504.
#[inline(always)]
fn finish(wide: i32) -> i32 {
    (wide * 31) >> 6
}

/// The bits of the half at a place between two ends.
#[inline(always)]
pub(crate) fn between(wide: [i32; 2], weight: i32) -> i32 {
    finish((wide[0] * (64 - weight) + wide[1] * weight + 32) >> 6)
}
