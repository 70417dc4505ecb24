//! Distances along a ray, even by the angle under which a point beside it sees them.

use glam::DVec3;

/// Distances from the start of a segment whose density falls off with `1/(D² + s²)`, as the light of a lamp at the
/// distance `D` from the ray does, `s` from the foot of its perpendicular.
///
/// Kulla and Fajardo 2012, "Importance Sampling Techniques for Path Tracing in Participating Media", Computer Graphics Forum
/// 31(4), section 4. Angles are differences from the start, which keeps their digits where a lamp is far beyond an end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equiangular {
    /// Distance of the lamp from the ray, squared and not.
    d: f64,
    d_squared: f64,
    /// The start, from the foot of the perpendicular.
    start: f64,
    /// Length of the segment; may be infinite.
    end: f64,
    /// Angle under which the lamp sees the segment.
    angle: f64,
}

impl Equiangular {
    /// Around a lamp of this radius at `lamp`, for the segment from `o` along the unit vector `direction` to `end`. A lamp with an extent
    /// is as far away as it is large, at least. `None` where the ray meets a lamp without one.
    pub fn new(o: DVec3, direction: DVec3, end: f64, lamp: DVec3, radius: f64) -> Option<Self> {
        let to = lamp - o;
        let foot = to.dot(direction);
        let d_squared = (to - direction * foot).length_squared() + radius * radius;
        let (d, start) = (d_squared.sqrt(), -foot);
        let angle = if end == f64::INFINITY {
            d.atan2(start)
        } else {
            (d * end).atan2(d_squared + start * (start + end))
        };
        let is_drawable = d_squared > 0.0 && d_squared.is_finite() && angle > 0.0;
        is_drawable.then_some(Self { d, d_squared, start, end, angle })
    }

    /// A distance by a number in `[0, 1)`.
    pub fn sample(&self, u: f64) -> f64 {
        let (sin, cos) = (u * self.angle).sin_cos();
        let across = self.d * cos - self.start * sin;
        // Rounding may put the last angle beyond a right one.
        let t = if across > 0.0 {
            sin * (self.d_squared + self.start * self.start) / across
        } else {
            self.end
        };
        t.min(self.end)
    }

    /// The density of a distance, per metre.
    pub fn pdf(&self, t: f64) -> f64 {
        let s = self.start + t;
        self.d / (self.angle * (self.d_squared + s * s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lamp 1 m beside a ray, seen from 2 m before to 3 m behind: the closed form at a quarter of the angle.
    #[test]
    fn a_quarter_of_the_angle() {
        let lamp = DVec3::new(0.0, 1.0, 0.0);
        let start = DVec3::new(0.0, 0.0, 2.0);
        let drawn = Equiangular::new(start, DVec3::NEG_Z, 5.0, lamp, 0.0).expect("lamp beside it");
        let t = drawn.sample(0.25);
        assert!((t - 2.0 - -0.570_041_8).abs() < 1e-7, "{t}");
        assert!((drawn.pdf(t) - 0.320_324_5).abs() < 1e-7, "{}", drawn.pdf(t));
    }

    /// Lamps beside, before and far behind a ray, near and far from it, to an end and without: what is drawn lies on the
    /// segment, in order, and the density is the inverse of the derivative of the distance by the number.
    #[test]
    fn densities_are_those_of_what_is_drawn() {
        for (along, beside, radius) in [
            (0.5, 1.0, 0.0),
            (-3.0, 0.2, 0.0),
            (1e6, 1.0, 0.0),
            (-1e6, 1e-3, 0.0),
            (0.3, 1e-7, 0.0),
            (0.3, 0.0, 0.02),
            (0.3, 1e9, 0.0),
        ] {
            for end in [1e-3, 1.0, 1e4, f64::INFINITY] {
                let lamp = DVec3::new(along, beside, 0.0);
                let drawn = Equiangular::new(DVec3::ZERO, DVec3::X, end, lamp, radius);
                let drawn = drawn.expect("the lamp is not on the ray");
                assert_eq!(drawn.sample(0.0), 0.0);
                let mut last = 0.0;
                for k in 0..64 {
                    let (u, h) = ((f64::from(k) + 0.5) / 64.0, 1e-5);
                    let [before, t, after] = [u - h, u, u + h].map(|u| drawn.sample(u));
                    assert!(last < t && t <= end, "{along} {beside} {end} {u}: {t}");
                    let expected = 2.0 * h / (after - before);
                    let error = (drawn.pdf(t) / expected - 1.0).abs();
                    assert!(error < 1e-3, "{along} {beside} {end} {u}: {error}");
                    last = t;
                }
            }
        }
        let on_the_ray = Equiangular::new(DVec3::ZERO, DVec3::X, 1.0, DVec3::X * 0.5, 0.0);
        assert_eq!(on_the_ray, None);
    }
}
