//! The arithmetic of this machine: results are shared only between machines that compute alike.
//!
//! Kernels fix the order of their sums and where they fuse, so that their bytes are the same on every
//! processor. The elementary functions (sine, exponential, power ...) are those of the system's library,
//! which rounds differently with and without fused multiply-add and from one version to the next; and the
//! decoder of DWA-compressed OpenEXR has code for several levels of x86. So the name of a platform has the
//! processor's family, the vector extensions that change results, and a digest of the values of all these
//! functions at many places.

use engine::Digest;

/// The places at which each function is evaluated.
const PLACES: u32 = 2000;

/// The platform's name, with the version of this program: `0.1.0 x86_64 avx2 fma 5f2c81d0a7b34e96`.
pub(crate) fn platform() -> String {
    let mut name = format!("{} {}", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH);
    for (extension, is_there) in extensions() {
        if is_there {
            name += &format!(" {extension}");
        }
    }
    let digest = Digest::of(&values()).to_string();
    format!("{name} {}", &digest[..16])
}

#[cfg(target_arch = "x86_64")]
fn extensions() -> [(&'static str, bool); 4] {
    [
        ("sse4.1", std::arch::is_x86_feature_detected!("sse4.1")),
        ("avx2", std::arch::is_x86_feature_detected!("avx2")),
        ("fma", std::arch::is_x86_feature_detected!("fma")),
        ("f16c", std::arch::is_x86_feature_detected!("f16c")),
    ]
}

#[cfg(not(target_arch = "x86_64"))]
fn extensions() -> [(&'static str, bool); 0] {
    []
}

/// The bits of the functions' values.
fn values() -> Vec<u8> {
    let mut bytes = Vec::new();
    for place in 0..PLACES {
        // From 0.0007 to 12, with bits in every place.
        let x = (f64::from(place) + 0.61803) * 0.006_021_7;
        let (unit, y) = ((x / 13.0).min(1.0), 0.37 + f64::from(place % 97) * 0.0713);
        let doubles = [
            x.sin(),
            x.cos(),
            x.tan(),
            unit.asin(),
            unit.acos(),
            x.atan(),
            x.atan2(y),
            x.sinh(),
            x.cosh(),
            x.tanh(),
            x.asinh(),
            x.exp(),
            x.exp2(),
            x.exp_m1(),
            x.ln(),
            x.log2(),
            x.log10(),
            x.ln_1p(),
            x.powf(y),
            x.cbrt(),
            x.hypot(y),
        ];
        doubles.iter().for_each(|value| bytes.extend(value.to_bits().to_le_bytes()));
        let (x, unit, y) = (x as f32, unit as f32, y as f32);
        let singles = [
            x.sin(),
            x.cos(),
            unit.acos(),
            x.atan2(y),
            x.exp(),
            x.exp2(),
            x.ln(),
            x.log2(),
            x.powf(y),
            x.cbrt(),
        ];
        singles.iter().for_each(|value| bytes.extend(value.to_bits().to_le_bytes()));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_has_one_platform() {
        assert_eq!(platform(), platform());
        assert!(platform().contains(std::env::consts::ARCH));
        // The values are real: a part of them differs from the neighbours everywhere.
        let values = values();
        let row = 21 * 8 + 10 * 4;
        assert_eq!(values.len(), PLACES as usize * row);
        assert!(values.chunks(row).zip(values.chunks(row).skip(1)).all(|(one, next)| one != next));
    }
}
