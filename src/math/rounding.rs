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

/// Moves `x` by one unit in the last place: up for a positive direction, down for a negative one, not
/// at all for zero.
fn step_along(x: f32, direction: f64) -> f32 {
    if direction > 0.0 {
        x.next_up()
    } else if direction < 0.0 {
        x.next_down()
    } else {
        x
    }
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
/// Jakob, Humphreys 2023, *Physically Based Rendering*, 4th ed., section 6.8.6).
pub fn offset_ray_origin(p: DVec3, p_error: DVec3, ng: Vec3, dir: Vec3) -> Vec3 {
    let n = ng.as_dvec3();
    // Rounding p itself to f32 may move it half a unit in the last place along each axis; stepping
    // one unit outward below undoes that on the axes along which the offset points.
    let half_ulp = p.abs() * (f64::from(f32::EPSILON) * 0.5);
    let distance = n.abs().dot(p_error + half_ulp);
    let side = if dir.dot(ng) < 0.0 { -1.0 } else { 1.0 };
    let offset = n * (distance * side);
    let moved = p + offset;
    Vec3::new(
        step_along(moved.x as f32, offset.x),
        step_along(moved.y as f32, offset.y),
        step_along(moved.z as f32, offset.z),
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
