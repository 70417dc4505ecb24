//! Aiming photons at the objects which make caustics.
//!
//! A small glass in a large hall meets few of the photons that the lamps of the hall emit. A caustic
//! photon has to meet such an object first, so that only directions towards one of them have to be
//! drawn. The objects are wrapped into spheres; one sphere is chosen by how large it appears, a
//! direction is drawn evenly within its cone, and the density is that of the whole mixture,
//!
//! ```text
//! p(ω) = Σ_k w_k·[ω in cone k] / Ω_k,       Σ_k w_k = 1,
//! ```
//!
//! so that a photon has the same weight whichever of two overlapping spheres it was drawn for. Every
//! direction in which an object can be met has a density above 0: nothing is lost. This does for
//! any light what the projection map of Jensen 2001, *Realistic Image Synthesis Using Photon
//! Mapping*, section 5.3, does on a grid around a point light.

use crate::math::{Aabb, Frame};
use crate::sampling::warp::{square_to_disk, uniform_cone};
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::TAU;
use std::f64::consts::PI;

/// Most spheres that are kept: each is looked at for every photon. More objects share spheres.
const MOST_SPHERES: usize = 32;

/// A sphere in render space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// Centre, metres.
    pub center: DVec3,
    /// Radius, metres.
    pub radius: f64,
}

impl BoundingSphere {
    /// The sphere around a box, a little larger than its rounding; `None` if it is empty or infinite.
    pub fn around(bounds: &Aabb) -> Option<Self> {
        if bounds.is_empty() || !bounds.min.is_finite() || !bounds.max.is_finite() {
            return None;
        }
        let center = (bounds.min.as_dvec3() + bounds.max.as_dvec3()) * 0.5;
        let corner = (bounds.max.as_dvec3() - center).length();
        // Rays start from f32 points: a few units in the last place of the farthest coordinate.
        let slack = 4.0 * f64::from(f32::EPSILON) * (center.abs().max_element() + corner);
        Some(Self { center, radius: corner + slack })
    }
}

/// What photons are aimed at.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aim {
    spheres: Vec<BoundingSphere>,
}

/// How one sphere is seen from a point.
#[derive(Clone, Copy)]
struct Cone {
    axis: Vec3,
    one_minus_cos: f32,
}

impl Aim {
    /// Spheres around these boxes; `None` if there are none, or if one has no bounds, for then no
    /// direction can be left out.
    pub fn new(boxes: &[Aabb]) -> Option<Self> {
        let boxes = gathered(boxes.to_vec(), MOST_SPHERES);
        let spheres: Option<Vec<_>> = boxes.iter().map(BoundingSphere::around).collect();
        spheres.filter(|spheres| !spheres.is_empty()).map(|spheres| Self { spheres })
    }

    /// How a sphere is seen from `p`; `None` from inside, where it is all around.
    fn cone(sphere: &BoundingSphere, p: DVec3) -> Option<Cone> {
        let to = sphere.center - p;
        let distance = to.length();
        let sin = sphere.radius / distance;
        if sin.is_nan() || sin >= 1.0 {
            return None;
        }
        let sin2 = sin * sin;
        let one_minus_cos = sin2 / (1.0 + (1.0 - sin2).sqrt());
        // The axis is rounded to f32; the cone grows by that much.
        let slack = f64::from(f32::EPSILON) * 4.0;
        let one_minus_cos = one_minus_cos + slack * (sin + slack);
        Some(Cone { axis: (to / distance).as_vec3(), one_minus_cos: one_minus_cos as f32 })
    }

    /// Draws a direction from `p` and returns it with its density per unit solid angle. `natural`
    /// draws a direction as the light would, and `natural_pdf` is its density: they serve where `p`
    /// is inside a sphere.
    pub fn direction(
        &self,
        p: DVec3,
        choose: f32,
        u: Vec2,
        natural: impl FnOnce(Vec2) -> Vec3,
        natural_pdf: impl Fn(Vec3) -> f32,
    ) -> (Vec3, f32) {
        let mut total = 0.0;
        for sphere in &self.spheres {
            total += Self::cone(sphere, p).map_or(2.0, |cone| cone.one_minus_cos);
        }
        let mut left = choose * total;
        let mut chosen = None;
        for sphere in &self.spheres {
            let cone = Self::cone(sphere, p);
            let weight = cone.map_or(2.0, |cone| cone.one_minus_cos);
            chosen = Some(cone);
            if left < weight {
                break;
            }
            left -= weight;
        }
        let wi = match chosen.flatten() {
            Some(cone) => {
                let local = uniform_cone(u, cone.one_minus_cos);
                Frame::from_z(cone.axis).from_local(local).normalize()
            }
            None => natural(u),
        };
        // w_k/Ω_k = (1 − cos θ_k)/total / (2π(1 − cos θ_k)): the same for every cone.
        let each = 1.0 / (TAU * total);
        let pdf = self
            .spheres
            .iter()
            .map(|sphere| match Self::cone(sphere, p) {
                Some(cone) => {
                    let inside = 0.5 * (wi - cone.axis).length_squared() <= cone.one_minus_cos;
                    if inside { each } else { 0.0 }
                }
                None => natural_pdf(wi) * (2.0 / total),
            })
            .sum::<f32>();
        // Rounding may put a direction at the rim outside its own cone.
        (wi, pdf.max(if chosen.flatten().is_some() { each } else { 0.0 }))
    }

    /// Draws a point of the plane through the origin of render space and perpendicular to the unit
    /// vector `d`, over the shadows of the spheres on it, and its density per unit area.
    pub fn point_across(&self, d: Vec3, choose: f32, u: Vec2) -> (DVec3, f64) {
        let axis = d.as_dvec3().normalize();
        let on_plane = |p: DVec3| p - axis * axis.dot(p);
        let total: f64 = self.spheres.iter().map(|s| s.radius * s.radius).sum();
        let mut left = f64::from(choose) * total;
        let mut chosen = self.spheres[0];
        for sphere in &self.spheres {
            chosen = *sphere;
            let weight = sphere.radius * sphere.radius;
            if left < weight {
                break;
            }
            left -= weight;
        }
        let disk = (square_to_disk(u).as_dvec2() * chosen.radius).extend(0.0).as_vec3();
        let p = on_plane(chosen.center) + on_plane(Frame::from_z(d).from_local(disk).as_dvec3());
        let shadows = self
            .spheres
            .iter()
            .filter(|s| (on_plane(s.center) - p).length_squared() <= s.radius * s.radius);
        (p, shadows.count().max(1) as f64 / (PI * total))
    }
}

/// At most `most` boxes around all of `boxes`: neighbours along the longest side of the whole share one.
fn gathered(mut boxes: Vec<Aabb>, most: usize) -> Vec<Aabb> {
    if boxes.len() <= most {
        return boxes;
    }
    let whole = boxes.iter().fold(Aabb::EMPTY, |whole, b| whole.union(*b));
    let size = whole.max - whole.min;
    let axis = usize::from(size.y > size.x);
    let axis = if size.z > size[axis] { 2 } else { axis };
    boxes.sort_by(|a, b| a.center()[axis].total_cmp(&b.center()[axis]));
    if most == 1 {
        return vec![whole];
    }
    let right = boxes.split_off(boxes.len() / 2);
    let mut halves = gathered(boxes, most / 2);
    halves.extend(gathered(right, most - most / 2));
    halves
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    fn boxes() -> Vec<Aabb> {
        [(0.0, 0.5), (0.8, 0.4), (3.0, 1.0)]
            .map(|(x, r)| Aabb {
                min: Vec3::new(x - r, -r, 4.0 - r),
                max: Vec3::new(x + r, r, 4.0 + r),
            })
            .to_vec()
    }

    /// Oracle: the solid angle of the union of the cones, counted on an even grid of directions, against
    /// the mean of 1/p over directions drawn by `direction`.
    #[test]
    fn directions_cover_the_union_of_the_cones_by_their_density() {
        let aim = Aim::new(&boxes()).expect("bounded");
        let cones: Vec<Cone> =
            aim.spheres.iter().map(|s| Aim::cone(s, DVec3::ZERO).expect("outside")).collect();
        let n = 200_000;
        let (mut grid, mut drawn) = (0.0, 0.0);
        for k in 0..n {
            let s = Sampler::new(3, 0, (0, 0), k);
            let d = crate::sampling::warp::uniform_sphere(s.two(0));
            let seen = |c: &Cone| 0.5 * (d - c.axis).length_squared() <= c.one_minus_cos;
            grid += f64::from(u8::from(cones.iter().any(seen))) * 4.0 * PI / f64::from(n);
            let (_, pdf) =
                aim.direction(DVec3::ZERO, s.one(2), s.two(3), |_| unreachable!(), |_| 0.0);
            drawn += 1.0 / f64::from(pdf) / f64::from(n);
        }
        assert!((drawn / grid - 1.0).abs() < 0.01, "{drawn} against {grid}");
    }

    /// Oracle: the area of the union of the shadows, on a grid of the plane.
    #[test]
    fn points_cover_the_union_of_the_shadows_by_their_density() {
        let aim = Aim::new(&boxes()).expect("bounded");
        let d = Vec3::new(0.1, 0.2, -1.0).normalize();
        let n = 100_000;
        let (mut drawn, mut spread) = (0.0, 0.0_f64);
        for k in 0..n {
            let s = Sampler::new(4, 0, (0, 0), k);
            let (p, pdf) = aim.point_across(d, s.one(0), s.two(1));
            drawn += 1.0 / pdf / f64::from(n);
            spread = spread.max(p.dot(d.as_dvec3()).abs());
        }
        let frame = Frame::from_z(d);
        let (mut covered, side) = (0.0, 12.0);
        for k in 0..n {
            let q = (Sampler::new(5, 0, (0, 0), k).two(0) - 0.5) * side;
            let p = frame.from_local(q.extend(0.0)).as_dvec3();
            let axis = d.as_dvec3();
            let hit = aim.spheres.iter().any(|s| {
                let c = s.center - axis * axis.dot(s.center);
                (c - p).length() <= s.radius
            });
            covered += f64::from(u8::from(hit)) * f64::from(side * side) / f64::from(n);
        }
        assert!((drawn / covered - 1.0).abs() < 0.02, "{drawn} against {covered}");
        assert!(spread < 1e-5, "points lie in the plane: {spread}");
    }

    /// A crowd of objects is wrapped into few spheres, none of them left out.
    #[test]
    fn many_objects_share_few_spheres() {
        let crowd: Vec<Aabb> = (0..500)
            .map(|k| {
                let s = Sampler::new(1, 0, (k, 0), 0);
                let c = s.two(0).extend(s.one(2)) * 100.0;
                Aabb { min: c - 0.1, max: c + 0.1 }
            })
            .collect();
        let aim = Aim::new(&crowd).expect("bounded");
        assert!(aim.spheres.len() <= MOST_SPHERES);
        for b in &crowd {
            let c = b.center().as_dvec3();
            assert!(aim.spheres.iter().any(|s| (s.center - c).length() < s.radius));
        }
        let infinite = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
        assert_eq!(Aim::new(&[crowd[0], infinite]), None);
    }
}
