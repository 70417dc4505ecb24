//! Where rays leave a mesh with smooth normals.
//!
//! Light that grazes a coarse mesh is cut off along its triangles: one which is turned away from the light is
//! dark, though the normals between its corners still face it, and one which faces it lies in the shadow of its
//! neighbours. The edge of the light is then a staircase. The surface that the normals mean is rounder: at each corner
//! it touches the plane across the normal there. A point P which is below these planes is moved to them, and
//! rays leave from there,
//!
//! ```text
//! P' = P + Σ wᵢ·nᵢ·max(0, (Vᵢ − P)·nᵢ)
//! ```
//!
//! with the corners Vᵢ, their unit normals nᵢ and the weights wᵢ of P, all on the side from which P is seen (Hanika
//! 2021, "Hacking the Shadow Terminator", *Ray Tracing Gems II*, chapter 4). There its horizon is that of the smooth
//! normal: light below the triangle's own horizon counts, and whether it arrives is for the ray to say. So a white
//! coarse ball in a white sky loses nothing that it lost when such directions were dropped.
//!
//! Where the mesh is hollow no point is below the planes, and nothing is moved. What is nearer to a mesh than P' to P does
//! not shadow P: that is the price.

use super::surface::{Facet, interpolated};
use super::{Hit, SceneGeometry, SurfacePoint};
use crate::extract::Geometry;
use crate::math::{MotionTransform, Ray, offset_ray_origin};
use glam::{DAffine3, DVec2, DVec3, Vec3};

/// Where rays leave a surface.
#[derive(Clone, Copy, Debug)]
pub struct RayOrigin {
    /// The point.
    pub p: DVec3,
    /// Bound of its error per axis, before it is rounded to `f32`.
    pub p_error: DVec3,
    /// Unit normal: its plane divides what leaves on either side.
    pub n: Vec3,
}

impl RayOrigin {
    /// The origin of a ray which leaves in this direction.
    #[inline]
    pub fn towards(&self, wi: Vec3) -> Vec3 {
        offset_ray_origin(self.p, self.p_error, self.n, wi)
    }
}

impl From<&SurfacePoint> for RayOrigin {
    #[inline]
    fn from(&SurfacePoint { p, p_error, ng, .. }: &SurfacePoint) -> Self {
        Self { p, p_error, n: ng }
    }
}

impl SceneGeometry<'_> {
    /// Where rays leave that are reflected where `ray` hit; `None` where that is the surface itself.
    pub fn smooth_ray_origin(
        &self,
        ray: &Ray,
        hit: &Hit,
        surface: &SurfacePoint,
    ) -> Option<RayOrigin> {
        let instance = &self.instances[hit.instance as usize];
        let Geometry::Mesh(mesh) = instance.geometry else { return None };
        let mesh = &self.meshes[mesh as usize];
        let normals = mesh.normals(hit.primitive, ray.time)?;
        let smooth = interpolated(Some(normals), hit.weights)?;
        let facet = Facet::new(mesh.corners(hit.primitive, ray.time), hit.weights);
        let leave = |forward: &DAffine3, inverse: &DAffine3| {
            // Normals may point to the other side than the triangle does.
            let behind = inverse.transform_vector3(ray.d.as_dvec3()).dot(facet.ng) > 0.0;
            let side = if behind == (smooth.dot(facet.ng) < 0.0) { 1.0 } else { -1.0 };
            let lift = forward.transform_vector3(facet.lift(normals, hit.weights, side));
            surface.lifted(lift, (inverse.matrix3.transpose() * smooth).normalize().as_vec3())
        };
        match &instance.motion {
            MotionTransform::Static { forward, inverse } => leave(forward, inverse),
            moving => {
                let (forward, inverse) = moving.both_at(ray.time);
                leave(&forward, &inverse)
            }
        }
    }
}

impl Facet {
    /// From the point to the planes across the normals of the corners, as far as it lies below them; `side` is 1 where
    /// above is where the normals point to, −1 where it is behind.
    #[inline]
    fn lift(&self, normals: [DVec3; 3], weights: DVec2, side: f64) -> DVec3 {
        let weights = [1.0 - weights.x - weights.y, weights.x, weights.y];
        let mut lift = DVec3::ZERO;
        for ((corner, n), weight) in self.corners().into_iter().zip(normals).zip(weights) {
            // Of a normal which is 0 nothing comes: the larger of a NaN and 0 is 0.
            let depth = ((corner - self.p).dot(n) * side / n.length_squared()).max(0.0);
            lift += n * (weight * depth * side);
        }
        lift
    }
}

impl SurfacePoint {
    /// Where rays leave above the point, with the normal `n`, given to either side.
    #[inline]
    fn lifted(&self, lift: DVec3, n: Vec3) -> Option<RayOrigin> {
        let cos = n.dot(self.ng);
        if lift == DVec3::ZERO || cos.is_nan() || cos == 0.0 {
            return None;
        }
        let (n, cos) = (if cos < 0.0 { -n } else { n }, f64::from(cos.abs()));
        // The origin is moved along n and rounded to its side, by up to a unit in the last place along each axis
        // against the normal of the triangle: by so much more, of which cos is left there, it has to move.
        let p = self.p + lift;
        let error = (self.p_error + p.abs() * f64::from(f32::EPSILON)).max_element();
        Some(RayOrigin { p, p_error: DVec3::splat(error * (3.0 / cos)), n })
    }
}
