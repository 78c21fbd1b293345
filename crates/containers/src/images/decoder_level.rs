//! Which of the decoders' variants this machine runs.

/// The variant of the decoders whose results differ between processors: `x86_64 avx2+fma`, `x86_64` or
/// `aarch64`.
///
/// The decoder of DWA-compressed OpenEXR has code for AVX2 with FMA, for SSE2 and for every other processor,
/// and the conversion by ICC profiles made of tables has code for aarch64. Their results differ in last bits;
/// those of all other decoders do not.
pub fn decoder_level() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
        return "x86_64 avx2+fma";
    }
    std::env::consts::ARCH
}
