//! The sRGB transfer function between linear light and display codes.
//!
//! ```text
//! code = 12.92·c                      c <= 0.0031308
//!        1.055·c^(1/2.4) − 0.055      otherwise
//! ```
//!
//! IEC 61966-2-1:1999, section 5.2. It is evaluated in f64, so that 8-bit codes are exact: rounding to the
//! nearest code and decoding are inverse on all 256.

use std::sync::LazyLock;

/// Linear value of each 8-bit code.
static DECODED: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| decode_f64(code as f64 / 255.0) as f32));

/// Encodes a linear value in `[0, 1]` to a display value in `[0, 1]`. Values outside are not clipped;
/// negative ones follow the straight part.
pub fn encode(linear: f32) -> f32 {
    encode_f64(f64::from(linear)) as f32
}

/// Decodes a display value in `[0, 1]` to linear light in `[0, 1]`; the inverse of [`encode`].
pub fn decode(display: f32) -> f32 {
    decode_f64(f64::from(display)) as f32
}

/// Encodes a linear value to the nearest 8-bit code; what lies outside `[0, 1]` is clipped.
pub fn encode_u8(linear: f32) -> u8 {
    quantize_u8(encode_f64(f64::from(linear)))
}

/// Decodes an 8-bit code to linear light in `[0, 1]`.
pub fn decode_u8(code: u8) -> f32 {
    DECODED[usize::from(code)]
}

/// Rounds a display value to the nearest 8-bit code; what lies outside `[0, 1]` is clipped, and a NaN
/// becomes 0.
pub fn quantize_u8(display: f64) -> u8 {
    (display.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

fn encode_f64(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

fn decode_f64(display: f64) -> f64 {
    if display <= 0.04045 { display / 12.92 } else { ((display + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_256_codes_survive_decoding_and_encoding() {
        for code in 0..=255 {
            assert_eq!(encode_u8(decode_u8(code)), code);
        }
    }

    /// Oracle: the decoded midpoint between two codes is where the rounding must change. The threshold
    /// is found by bisection in f64 over the *encoded* value, independent of the f32 path.
    #[test]
    fn codes_change_exactly_half_way_between_two() {
        for code in 0..255_u8 {
            let middle = decode_f64((f64::from(code) + 0.5) / 255.0);
            let (below, above) = ((middle * (1.0 - 1e-6)) as f32, (middle * (1.0 + 1e-6)) as f32);
            assert_eq!((encode_u8(below), encode_u8(above)), (code, code + 1));
        }
    }

    /// Values of the standard's formula, computed with 30 digits elsewhere.
    #[test]
    fn known_values_are_met() {
        for (linear, display) in [(0.18, 0.461_356_1), (0.5, 0.735_357), (0.003_130_8, 0.040_449_9)]
        {
            assert!((encode(linear) - display).abs() < 1e-6, "{linear}: {}", encode(linear));
        }
        assert_eq!(encode_u8(0.18), 118);
        assert!((decode_u8(118) - 0.18).abs() < 0.002);
        assert_eq!((encode_u8(0.0), encode_u8(1.0)), (0, 255));
    }

    #[test]
    fn decoding_inverts_encoding_everywhere() {
        for i in 0..=10_000 {
            let linear = i as f32 / 10_000.0;
            assert!(
                (decode(encode(linear)) - linear).abs() <= 3.0 * f32::EPSILON * (linear + 0.001)
            );
        }
    }

    #[test]
    fn what_is_outside_is_clipped() {
        assert_eq!([encode_u8(-1.0), encode_u8(7.0), encode_u8(f32::INFINITY)], [0, 255, 255]);
        assert_eq!(encode_u8(f32::NAN), 0);
    }
}
