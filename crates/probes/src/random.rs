//! Numbers that look random, and depend on their arguments alone.

/// A number whose bits all depend on all bits of another (the finaliser of SplitMix64, Steele et al. 2014).
pub(crate) fn hash(number: u64) -> u64 {
    let mut z = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A hash of words, one after the other, and of a seed.
pub(crate) fn hash_words(seed: u64, words: impl IntoIterator<Item = u64>) -> u64 {
    words.into_iter().fold(seed, |seed, word| hash(seed ^ word))
}

/// A hash of numbers, bit by bit, and of a seed.
pub(crate) fn hash_of(seed: u64, numbers: impl IntoIterator<Item = f32>) -> u64 {
    hash_words(seed, numbers.into_iter().map(|number| u64::from(number.to_bits())))
}

/// A hash as a number in [0, 1).
pub(crate) fn share_of(hash: u64) -> f32 {
    (hash >> 40) as f32 / (1_u64 << 24) as f32
}
