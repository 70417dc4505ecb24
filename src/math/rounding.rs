//! Bounds of rounding error, and the ray origins which follow from them.
//!
//! `γₙ = n·u / (1 − n·u)` bounds the relative error of `n` successive roundings, with `u` half
//! the distance from 1 to the next float (Higham 2002, *Accuracy and Stability of Numerical
//! Algorithms*, 2nd ed., lemma 3.1).

use glam::{DVec3, Vec3};

/// `γₙ` for `f32`: the relative error bound of `n` successive roundings.
pub const fn gamma(n: u32) -> f32 {
    let nu = n as f64 * (f32::EPSILON as f64 * 0.5);
    (nu / (1.0 - nu)) as f32
}

/// `γₙ` for `f64`: the relative error bound of `n` successive roundings.
pub const fn gamma_f64(n: u32) -> f64 {
    let nu = n as f64 * (f64::EPSILON * 0.5);
    nu / (1.0 - nu)
}

/// Rounds `x` to `f32`, not against the sign of `direction`: up for a positive one, down for a negative
/// one, to the nearest for zero. At most one unit in the last place farther than need be.
///
/// Half a unit in the last place of `x`, `u·|x|` or for the smallest numbers half their step, is added
/// before the nearest number is taken, which can take away as much. `1 + 2⁻²⁰` makes up for the
/// rounding of the sum, and for `x` crossing a power of two.
#[inline]
fn round_along(x: f64, direction: f64) -> f32 {
    const HALF_UNIT: f64 = f32::EPSILON as f64 * 0.5 * (1.0 + 1.0 / 1_048_576.0);
    let step = (x.abs() * HALF_UNIT).max(f32::MIN_POSITIVE as f64 * HALF_UNIT);
    let step = if direction == 0.0 { 0.0 } else { step };
    (x + step.copysign(direction)) as f32
}

/// The origin of a ray which leaves a surface, outside the error box of the hit point.
///
/// * `p` — the hit point in render space, before it is rounded to `f32`.
/// * `p_error` — bound of its error per axis, in the same unit, **without** the rounding to `f32`.
/// * `ng` — unit geometric normal; either side.
/// * `dir` — direction of the new ray: decides to which side of the surface the origin moves.
///
/// The error box projected on the normal is `d = |n|·δ`; the origin moves by `d` along the normal
/// and is then rounded away from the surface, so that the rounding cannot bring it back (Pharr,
/// Jakob, Humphreys 2023, *Physically Based Rendering*, 4th ed., section 6.8.6). It is rounded away
/// also where `d` is 0, as on a plane through the origin of render space.
#[inline]
pub fn offset_ray_origin(p: DVec3, p_error: DVec3, ng: Vec3, dir: Vec3) -> Vec3 {
    let n = ng.as_dvec3();
    // Where the offset has no component the nearest number is taken, which may move the point by half
    // a unit in the last place; rounding along the offset undoes that on the other axes.
    let half_ulp = p.abs() * (f64::from(f32::EPSILON) * 0.5);
    // A component of the normal that is nothing but rounding may have either sign.
    let tilt = half_ulp.max_element() * gamma_f64(8);
    let distance = n.abs().dot(p_error + half_ulp) + tilt;
    // In f64, in which the products are exact: near the horizon the sum of rounded ones may have either sign.
    let side = if dir.as_dvec3().dot(n) < 0.0 { -1.0 } else { 1.0 };
    let away = n * side;
    let moved = p + away * distance;
    Vec3::new(
        round_along(moved.x, away.x),
        round_along(moved.y, away.y),
        round_along(moved.z, away.z),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: γ(3), γ(5), γ(7) of f32 by the definition with u = 2⁻²⁴.
    #[test]
    fn gamma_matches_its_definition() {
        for (n, expected) in [(3, 1.788_14e-7), (5, 2.980_233e-7), (7, 4.172_327e-7)] {
            assert!((gamma(n) / expected - 1.0).abs() < 1e-6, "γ({n}) = {:e}", gamma(n));
        }
    }

    /// Oracle: the numbers next to the exact value, in f64.
    #[test]
    fn rounding_along_a_direction_never_goes_against_it() {
        for k in 0..200_000_u32 {
            let bits = k.wrapping_mul(0x9e37_79b9) & 0x7f7f_ffff;
            let x = f64::from(f32::from_bits(bits)) * (1.0 + f64::from(k % 17) * 1e-8);
            for x in [x, -x] {
                let (up, down) = (round_along(x, 1.0), round_along(x, -1.0));
                assert!(f64::from(up) >= x && f64::from(down) <= x, "{x:e}: {down:e}, {up:e}");
                let near = x as f32;
                assert!(
                    up <= near.next_up() && down >= near.next_down(),
                    "{x:e}: {down:e}, {up:e}"
                );
                assert_eq!(round_along(x, 0.0), near);
            }
        }
        assert!(round_along(0.0, 1.0) > 0.0 && round_along(0.0, -1.0) < 0.0);
    }

    /// Oracle: the signed distance to the plane, evaluated in f64, is positive on the side of the
    /// new direction for every scale and every distance from the origin.
    #[test]
    fn offset_origin_is_on_the_side_of_the_new_ray() {
        for exponent in -20..20 {
            let scale = 2.0_f64.powi(exponent);
            for k in 0..200 {
                let a = f64::from(k) * 0.7;
                let n = DVec3::new(a.sin() * 0.6, a.cos(), (1.7 * a).sin()).normalize();
                let p = DVec3::new(a.cos() * 3.1, (2.3 * a).sin(), a * 0.1) * scale;
                let n32 = n.as_vec3();
                for dir in [n32, -n32] {
                    let o = offset_ray_origin(p, DVec3::splat(scale * 1e-12), n32, dir);
                    let distance = (o.as_dvec3() - p).dot(n32.as_dvec3());
                    assert!(
                        distance * f64::from(dir.dot(n32)) > 0.0,
                        "scale 2^{exponent}, k = {k}"
                    );
                    // and not farther than a few units in the last place of the point
                    assert!(
                        distance.abs() <= 4.0 * p.abs().max_element() * f64::from(f32::EPSILON)
                    );
                }
            }
        }
    }
}
