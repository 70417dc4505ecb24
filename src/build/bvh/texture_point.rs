//! What the textures of a surface look at.

use super::surface::Facet;
use super::{Hit, SceneGeometry, SurfacePoint};
use crate::extract::Geometry;
use crate::math::{Cone, Frame, Ray};
use crate::shade::{MaterialTable, Surroundings, TexturePoint, bent_normal};
use glam::{DVec2, DVec3, Vec3};

/// Where nothing says how much of a surface a sample stands for, slopes are measured over this share of the distance
/// over which u grows by 1: a texel of an image of 1024, to either side.
const LEAST_STEP: f64 = 1.0 / 1024.0;

impl SceneGeometry<'_> {
    /// The point of a surface as the textures of an instance see it, at a time of the shutter.
    #[inline]
    pub fn texture_point(&self, instance: u32, surface: &SurfacePoint, time: f32) -> TexturePoint {
        let at = TexturePoint { time, ..TexturePoint::on(surface.chart, surface.uv) };
        let instance = &self.instances[instance as usize];
        if !instance.needs.place {
            return at;
        }
        let (forward, inverse) = instance.motion.both_at(time);
        let p = inverse.transform_point3(surface.p) * instance.size;
        // Normals go by the transposed inverse of the map from the object, which is the transposed map back.
        let n = forward.matrix3.transpose() * surface.ng.as_dvec3() / instance.size;
        let n = n.normalize_or(surface.ng.as_dvec3()).as_vec3();
        TexturePoint { p, n, color: surface.color, ..at }
    }

    /// The same where a ray hit, with what of the surface lies in a cone around the ray.
    #[inline]
    pub fn texture_point_in(
        &self,
        cone: Cone,
        ray: &Ray,
        hit: &Hit,
        surface: &SurfacePoint,
    ) -> TexturePoint {
        let at = self.texture_point(hit.instance, surface, ray.time);
        if cone.is_ray() || !self.instances[hit.instance as usize].needs.footprint {
            return at;
        }
        self.with_footprint(at, cone, ray, hit, surface)
    }

    fn with_footprint(
        &self,
        at: TexturePoint,
        cone: Cone,
        ray: &Ray,
        hit: &Hit,
        surface: &SurfacePoint,
    ) -> TexturePoint {
        let section = cone.section(ray.d.as_dvec3(), surface.ng.as_dvec3());
        let instance = &self.instances[hit.instance as usize];
        // Solid textures are seen through a circle: they have no direction to be filtered along.
        let shrink = if instance.needs.place {
            let inverse = instance.motion.inverse_at(ray.time);
            let size = |axis: DVec3| (inverse.transform_vector3(axis) * instance.size).length();
            section.map(size)[1]
        } else {
            0.0
        };
        let axes = match self.derivatives(hit, surface, ray.time) {
            Some([u, v]) => section.map(|axis| change_of_uv(axis, u, v).as_vec2()),
            None => at.axes,
        };
        TexturePoint { axes, width: shrink as f32, ..at }
    }

    /// Turns the shading normal where a ray hit as the relief of a material says, for who looks along the ray.
    pub fn turn_normal(
        &self,
        turn: (&MaterialTable, u32),
        cone: Cone,
        ray: &Ray,
        hit: &Hit,
        surface: &mut SurfacePoint,
        at: &TexturePoint,
    ) {
        let ns = self.relief_normal(turn, cone, ray, hit, surface, at);
        surface.ns = bent_normal(ns, surface.ng, -ray.d);
    }

    /// The shading normal where a ray hit as the relief of a material says, whoever looks at it.
    pub fn relief_normal(
        &self,
        (materials, relief): (&MaterialTable, u32),
        cone: Cone,
        ray: &Ray,
        hit: &Hit,
        surface: &SurfacePoint,
        at: &TexturePoint,
    ) -> Vec3 {
        let around = || self.surroundings(cone, ray, hit, surface, at);
        let along = || self.tangents(ray, hit, surface);
        materials.relief_normal(relief, surface.ns, at, around, along)
    }

    /// The points around one, as textures see them.
    fn surroundings(
        &self,
        cone: Cone,
        ray: &Ray,
        hit: &Hit,
        surface: &SurfacePoint,
        at: &TexturePoint,
    ) -> Surroundings {
        let instance = &self.instances[hit.instance as usize];
        let derivatives = self.derivatives(hit, surface, ray.time);
        let step = if cone.width > 0.0 {
            0.5 * f64::from(cone.width)
        } else {
            LEAST_STEP * derivatives.map_or(instance.bounds.diagonal(), |[u, _]| u.length())
        };
        let frame = Frame::from_z(surface.ns);
        let inverse = instance.motion.inverse_at(ray.time);
        let moved = |by: DVec3| {
            let uv = derivatives.map_or(DVec2::ZERO, |[u, v]| change_of_uv(by, u, v));
            let p = if instance.needs.place {
                at.p + inverse.transform_vector3(by) * instance.size
            } else {
                at.p
            };
            TexturePoint { uv: at.uv + uv.as_vec2(), p, ..*at }
        };
        let around = [frame.x, frame.y].map(|axis| {
            let axis = axis.as_dvec3() * step;
            [moved(-axis), moved(axis)]
        });
        Surroundings { axes: [frame.x, frame.y], step: step as f32, around }
    }

    /// The tangent and the bitangent of a normal map where a ray hit, in render space, as long as they are where the
    /// shading normal is 1 long; `None` where uv has no direction.
    fn tangents(&self, ray: &Ray, hit: &Hit, surface: &SurfacePoint) -> Option<[Vec3; 2]> {
        let instance = &self.instances[hit.instance as usize];
        if let Geometry::Mesh(mesh) = &instance.geometry {
            let tree = &self.meshes[*mesh as usize];
            let frame = tree.tangent_frame(hit.primitive, hit.weights, ray.time)?;
            // What it makes of a map is a normal, and goes to render space as normals do.
            let cofactors = instance.motion.inverse_at(ray.time).matrix3.transpose();
            let [tangent, bitangent, normal] = frame.map(|axis| cofactors * axis);
            let unit = normal.length().recip();
            return Some([tangent, bitangent].map(|axis| (axis * unit).as_vec3()));
        }
        let [u, v] = self.derivatives(hit, surface, ray.time)?;
        let (ns, ng) = (surface.ns.as_dvec3(), surface.ng.as_dvec3());
        let tangent = (u - ns * u.dot(ns)).try_normalize()?;
        // Where v grows to the right of u, seen from outside, uv is mirrored.
        let side = u.cross(v).dot(ng).signum();
        Some([tangent.as_vec3(), (ns.cross(tangent) * side).as_vec3()])
    }

    /// `∂p/∂u` and `∂p/∂v` where a ray hit, in render space; `None` where uv does not change in one of
    /// its directions.
    pub fn derivatives(&self, hit: &Hit, surface: &SurfacePoint, time: f32) -> Option<[DVec3; 2]> {
        let instance = &self.instances[hit.instance as usize];
        let (forward, inverse) = instance.motion.both_at(time);
        let local = match &instance.geometry {
            Geometry::Primitive(primitive) => {
                primitive.derivatives(inverse.transform_point3(surface.p), hit.primitive)
            }
            Geometry::Mesh(mesh) => {
                let tree = &self.meshes[*mesh as usize];
                let facet = Facet::new(tree.corners(hit.primitive, time), hit.weights);
                facet.derivatives(&tree.mesh, hit.primitive)?
            }
        };
        let derivatives = local.map(|derivative| forward.transform_vector3(derivative));
        let [u, v] = derivatives;
        (u.cross(v).length_squared() > 0.0).then_some(derivatives)
    }
}

/// The change of uv over a step in the plane of its derivatives: least squares, for a step beside the plane.
fn change_of_uv(step: DVec3, u: DVec3, v: DVec3) -> DVec2 {
    let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
    let (a, b) = (step.dot(u), step.dot(v));
    DVec2::new(vv * a - uv * b, uu * b - uv * a) / (uu * vv - uv * uv)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Oracle: the step built from its change.
    #[test]
    fn steps_are_taken_apart() {
        let (u, v) = (DVec3::new(1.0, 2.0, -0.5), DVec3::new(0.3, -1.0, 4.0));
        let change = change_of_uv(u * 0.2 - v * 3.0 + u.cross(v), u, v);
        assert!((change - DVec2::new(0.2, -3.0)).length() < 1e-12, "{change}");
    }
}
