//! The surface where a ray hit it, in render space.

use super::top::Joined;
use super::{Hit, MeshTree, SceneGeometry};
use crate::description::{Rgb, TriangleMesh};
use crate::extract::{Geometry, Instance};
use crate::math::{Chart, Frame, MotionTransform, Ray, gamma_f64};
use crate::shape::{LocalSurface, rounding_error};
use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};

/// A point of a surface in render space.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// The point.
    pub p: DVec3,
    /// Bound of its error per axis, before it is rounded to `f32`.
    pub p_error: DVec3,
    /// Unit geometric normal, to the outside of the object.
    pub ng: Vec3,
    /// Unit shading normal, on the same side as `ng`.
    pub ns: Vec3,
    /// Surface coordinates.
    pub uv: Vec2,
    /// Where they end.
    pub chart: Chart,
    /// Direction in which u grows, of any length; may be 0.
    pub dpdu: Vec3,
    /// Colour of a mesh, interpolated between its corners; 1 of all else.
    pub color: Rgb,
}

impl SurfacePoint {
    /// A point given in the space of its shape, carried to render space.
    pub fn new(local: &LocalSurface, forward: &DAffine3, inverse: &DAffine3) -> Self {
        let p = forward.transform_point3(local.p);
        // The next ray goes back to the space of the shape, by a map which is the inverse up to rounding. So
        // what counts is where the point comes to lie there, whatever was rounded on the way: that is seen, up
        // to the rounding of the maps of the point and of the ray.
        let back = (inverse.transform_point3(p) - local.p).abs()
            + rounding_error(inverse, p)
            + DVec3::splat(local.error);
        let m = &forward.matrix3;
        let p_error = m.x_axis.abs() * back.x + m.y_axis.abs() * back.y + m.z_axis.abs() * back.z;
        // Normals go by the transposed inverse, which keeps the outside outside for mirroring maps.
        let normal = |n: DVec3| (inverse.matrix3.transpose() * n).normalize();
        let ng = normal(local.ng);
        let ns = if local.ns == local.ng { ng } else { normal(local.ns) };
        let ns = if ns.dot(ng) < 0.0 { -ns } else { ns };
        let ns = if ns.is_finite() { ns } else { ng };
        let dpdu = forward.transform_vector3(local.dpdu);
        Self {
            p,
            p_error,
            ng: ng.as_vec3(),
            ns: ns.as_vec3(),
            uv: local.uv,
            chart: local.chart,
            dpdu: dpdu.as_vec3(),
            color: local.color,
        }
    }

    /// The normal by which what is seen from `wo` is shaded: from beyond its horizon a shading normal cannot say what is
    /// reflected where.
    #[inline]
    pub fn normal_seen_from(&self, wo: Vec3) -> Vec3 {
        if wo.dot(self.ns) * wo.dot(self.ng) <= 0.0 { self.ng } else { self.ns }
    }

    /// The shading frame around `ns`. No material yet distinguishes a direction of the tangent plane.
    pub fn frame(&self) -> Frame {
        Frame::from_z(self.ns)
    }
}

impl SceneGeometry<'_> {
    /// The surface where `ray` hit.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let instance = &self.instances[hit.instance as usize];
        if let (Some(joined), Geometry::Mesh(mesh)) = (&self.top.joined, &instance.geometry)
            && let Some(first) = joined.members.first_triangle(hit.instance)
        {
            return joined.surface(&self.meshes[*mesh as usize], first, hit, instance);
        }
        let surface = |forward: &DAffine3, inverse: &DAffine3| {
            let local = match &instance.geometry {
                Geometry::Primitive(primitive) => {
                    let p = inverse.transform_point3(ray.at(hit.t));
                    primitive.surface(p, hit.primitive, instance.needs_uv)
                }
                Geometry::Mesh(mesh) => {
                    let mesh = &self.meshes[*mesh as usize];
                    mesh.surface(hit.primitive, hit.weights, ray.time, instance.needs_uv)
                }
            };
            SurfacePoint::new(&local, forward, inverse)
        };
        match &instance.motion {
            MotionTransform::Static { forward, inverse } => surface(forward, inverse),
            moving => {
                let (forward, inverse) = moving.both_at(ray.time);
                surface(&forward, &inverse)
            }
        }
    }

    /// Where the point of the surface that `ray` hit is at another time of the shutter.
    pub fn point_at(&self, ray: &Ray, hit: &Hit, time: f32) -> DVec3 {
        let Instance { motion, geometry, .. } = &self.instances[hit.instance as usize];
        let local = match geometry {
            Geometry::Mesh(mesh) if self.meshes[*mesh as usize].deforms() => {
                let corners = self.meshes[*mesh as usize].corners(hit.primitive, time);
                Facet::new(corners, hit.weights).p
            }
            _ => motion.inverse_at(ray.time).transform_point3(ray.at(hit.t)),
        };
        motion.at(time).transform_point3(local)
    }
}

impl Joined {
    /// The surface of a triangle of an instance whose first triangle in the shared tree is `first`.
    fn surface(&self, tree: &MeshTree, first: u32, hit: &Hit, instance: &Instance) -> SurfacePoint {
        let corners = self.tree.corners(first + hit.primitive, 0.0);
        let facet = Facet::new(corners, hit.weights);
        let MotionTransform::Static { forward, inverse } = &instance.motion else {
            unreachable!("what moves is not joined");
        };
        // A mirroring map turns the order of the corners: the outside stays outside.
        let outward = if forward.matrix3.determinant() < 0.0 { -facet.ng } else { facet.ng };
        let ng = outward.normalize().as_vec3();
        let ns = interpolated(tree.normals(hit.primitive, 0.0), hit.weights)
            .map(|n| (inverse.matrix3.transpose() * n).normalize())
            .filter(|n| n.is_finite())
            .map_or(ng, DVec3::as_vec3);
        let ns = if ns.dot(ng) < 0.0 { -ns } else { ns };
        let (uv, dpdu, color) = if instance.needs_uv {
            facet.parameters(&tree.mesh, hit.primitive, hit.weights)
        } else {
            (Vec2::ZERO, DVec3::ZERO, Rgb::ONE)
        };
        let p = facet.p + self.shift;
        // Beyond the error of the facet: of the shift here, and of that back by the next ray.
        let p_error = (p.abs() + self.shift.abs()) * gamma_f64(4) + DVec3::splat(facet.error);
        let chart = tree.mesh.chart;
        SurfacePoint { p, p_error, ng, ns, uv, chart, dpdu: dpdu.as_vec3(), color }
    }
}

impl MeshTree {
    /// The surface of a triangle at these weights of its second and third corner, at a time in the
    /// shutter. Texture coordinates are left out, and uv is 0, unless `needs_uv`.
    pub fn surface(
        &self,
        triangle: u32,
        weights: DVec2,
        time: f32,
        needs_uv: bool,
    ) -> LocalSurface {
        let facet = Facet::new(self.corners(triangle, time), weights);
        let ns = interpolated(self.normals(triangle, time), weights).unwrap_or(facet.ng);
        let (uv, dpdu, color) = if needs_uv {
            facet.parameters(&self.mesh, triangle, weights)
        } else {
            (Vec2::ZERO, DVec3::ZERO, Rgb::ONE)
        };
        let (chart, error) = (self.mesh.chart, facet.error);
        LocalSurface { p: facet.p, ng: facet.ng, ns, uv, chart, dpdu, color, error }
    }
}

/// A point of a triangle, with what follows from the corners alone.
pub(super) struct Facet {
    pub(super) p: DVec3,
    a: DVec3,
    /// Normal of any positive length.
    pub(super) ng: DVec3,
    e1: DVec3,
    e2: DVec3,
    /// Bound per axis of how far the point lies from the plane that the next ray meets.
    ///
    /// The point is a sum of three products with weights which add up to 1 but for two roundings: 6 roundings of
    /// the largest coordinate R of a corner. Seen from near the triangle no coordinate is above 2·R, and the
    /// test of a triangle about as wide as long errs by some 40 roundings of R; of others it knows that it
    /// cannot decide, and then decides exactly ([`TriangleTest`](crate::shape::TriangleTest)).
    error: f64,
}

impl Facet {
    #[inline]
    pub(super) fn new([a, b, c]: [DVec3; 3], weights: DVec2) -> Self {
        let (e1, e2) = (b - a, c - a);
        // The product of two numbers of f32 neither under- nor overflows in f64.
        let ng = e1.cross(e2);
        let p = a * (1.0 - weights.x - weights.y) + b * weights.x + c * weights.y;
        let error = a.abs().max(b.abs()).max(c.abs()).max_element() * gamma_f64(48);
        Self { p, a, ng, e1, e2, error }
    }

    /// The corners.
    pub(super) fn corners(&self) -> [DVec3; 3] {
        [self.a, self.a + self.e1, self.a + self.e2]
    }

    /// Texture coordinates, the direction in which u grows, and the colour.
    fn parameters(&self, mesh: &TriangleMesh, triangle: u32, weights: DVec2) -> (Vec2, DVec3, Rgb) {
        let [a, b, c] = uvs_of(mesh, triangle);
        let uv = a * (1.0 - weights.x - weights.y) + b * weights.x + c * weights.y;
        let (d1, d2) = (b - a, c - a);
        let det = d1.perp_dot(d2);
        let (e1, e2) = (self.e1, self.e2);
        let dpdu = if det == 0.0 { e1 } else { (e1 * d2.y - e2 * d1.y) * det.signum() };
        let color = if mesh.colors.is_empty() {
            Rgb::ONE
        } else {
            let corners = mesh.triangles[triangle as usize];
            let [a, b, c] = corners.map(|k| mesh.colors[k as usize]);
            let (second, third) = (weights.x as f32, weights.y as f32);
            a * (1.0 - second - third) + b * second + c * third
        };
        (uv.as_vec2(), dpdu, color)
    }

    /// `∂p/∂u` and `∂p/∂v`; `None` where the corners have the same uv or lie on a line of it.
    pub(super) fn derivatives(&self, mesh: &TriangleMesh, triangle: u32) -> Option<[DVec3; 2]> {
        let [a, b, c] = uvs_of(mesh, triangle);
        let (d1, d2) = (b - a, c - a);
        let det = d1.perp_dot(d2);
        let (e1, e2) = (self.e1, self.e2);
        (det != 0.0).then(|| [(e1 * d2.y - e2 * d1.y) / det, (e2 * d1.x - e1 * d2.x) / det])
    }
}

/// Texture coordinates of the corners of a triangle; half a square where the mesh has none.
pub(super) fn uvs_of(mesh: &TriangleMesh, triangle: u32) -> [DVec2; 3] {
    if mesh.uvs.is_empty() {
        [DVec2::ZERO, DVec2::X, DVec2::ONE]
    } else {
        mesh.triangles[triangle as usize].map(|k| mesh.uvs[k as usize].as_dvec2())
    }
}

/// The normal between those of the corners, of any length; `None` where there are none, or where
/// opposite normals cancel.
#[inline]
pub(super) fn interpolated(normals: Option<[DVec3; 3]>, weights: DVec2) -> Option<DVec3> {
    let [a, b, c] = normals?;
    let sum = a * (1.0 - weights.x - weights.y) + b * weights.x + c * weights.y;
    (sum.length_squared() > 0.0).then_some(sum)
}

#[cfg(test)]
mod tests {
    use super::super::TopLevel;
    use super::*;
    use crate::description::{BvhQuality, TriangleMesh};
    use crate::extract::{Instance, NOTHING};
    use crate::math::{Aabb, offset_ray_origin};
    use crate::sampling::Sampler;
    use crate::shade::TextureNeeds;
    use glam::DQuat;
    use std::sync::Arc;

    /// Oracle: a ray which leaves a triangle to the side of its direction does not meet it again,
    /// for triangles of a micrometre to a thousand kilometres, as far away, turned and stretched.
    #[test]
    fn no_ray_meets_the_triangle_that_it_leaves() {
        for number in 0..20_000 {
            let s = Sampler::new(8, 0, (number, 0), 0);
            let three = |k| s.two(k).extend(s.one(k + 2)) - 0.5;
            let positions = vec![three(0), three(3), three(6)];
            let triangles = vec![[0, 1, 2]];
            let mesh = TriangleMesh { positions, triangles, ..Default::default() };
            let tree = Arc::new(MeshTree::build(Arc::new(mesh), BvhQuality::default()));
            let size = 10.0_f64.powf(f64::from(s.one(9)) * 12.0 - 6.0);
            let distance = 10.0_f64.powf(f64::from(s.one(10)) * 14.0 - 7.0);
            let forward = DAffine3::from_scale_rotation_translation(
                DVec3::new(size, size * 0.01, -3.0 * size),
                DQuat::from_scaled_axis(three(11).as_dvec3() * 6.0),
                three(14).as_dvec3() * distance,
            );
            let inverse = forward.inverse();
            let around = Aabb::from_points(tree.mesh.positions.iter().copied());
            let instance = Instance {
                geometry: Geometry::Mesh(0),
                motion: MotionTransform::Static { forward, inverse },
                bounds: around.transformed(&forward),
                material: NOTHING,
                emission: NOTHING,
                object_id: 1,
                needs_uv: false,
                needs: TextureNeeds::default(),
                size: DVec3::ONE,
                hidden_from_camera: false,
            };
            let instances = [instance];
            let top = TopLevel::build(&instances);
            let meshes = [tree.clone()];
            let scene = SceneGeometry { instances: &instances, meshes: &meshes, top: &top };
            let root = s.one(17).sqrt();
            let weights = DVec2::new(f64::from(1.0 - root), f64::from(root * s.one(18)));
            let surface =
                SurfacePoint::new(&tree.surface(0, weights, 0.0, false), &forward, &inverse);
            for k in 0..4 {
                let d = (three(20 + 3 * k)).normalize();
                let o = offset_ray_origin(surface.p, surface.p_error, surface.ng, d);
                let ray = Ray { o, d, time: 0.0 };
                assert!(!scene.occluded(&ray, f64::INFINITY), "triangle {number}, ray {k}");
                assert_eq!(scene.closest_hit(&ray, f64::INFINITY, false), None);
            }
        }
    }
}
