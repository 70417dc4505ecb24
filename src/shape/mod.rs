//! Shapes: bounds, intersection, parameterisation and sampling, one shape per file.
//!
//! A shape lives in a *canonical space* in which it has one fixed size (a unit sphere, a unit
//! square); radius, width and height are part of the map from there to the world, which is kept in
//! `f64`. Intersections are computed in `f64` too, so that a hit point is exact to far below the
//! resolution of the `f32` rays, whatever the size of the shape and its distance: what is left as
//! its error is the rounding of the map, [`rounding_error`].

mod cone;
mod cuboid;
mod cylinder;
mod derivatives;
mod disk;
mod plane;
mod plane_of_triangle;
mod rectangle;
mod revolution;
mod sphere;
mod triangle;

pub use rectangle::{RectangleSampler, sample_solid_angle as sample_rectangle};
pub use revolution::Revolution;
pub use sphere::{ConeOfSphere, sample_cone as sample_sphere};
pub(crate) use triangle::{INEXACT, OPEN};
pub use triangle::{TriangleTest, area_of as triangle_area, sample_triangle, triangle_pdf};

use crate::description::Rgb;
use crate::math::{Aabb, Chart, gamma_f64};
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};

/// [`LocalSurface::error`] of the shapes whose size is 1.
///
/// A quadric is met where `t = s ± √(1 − |o + s·d|²)` or a like expression is; whether that is positive for a ray
/// which leaves from outside is decided once the height above the surface is more than the error of the radicand.
/// The point next to the axis is rounded 4 times, its square 3 times more with twice the error: 11 roundings of
/// numbers of size 1, and the point itself 3 times.
const UNIT_ERROR: f64 = gamma_f64(16);

/// A ray in the canonical space of a shape; `d` has any length and `t` counts in it.
#[derive(Clone, Copy, Debug)]
pub struct LocalRay {
    /// Origin.
    pub o: DVec3,
    /// Direction.
    pub d: DVec3,
}

impl LocalRay {
    /// The point at parameter `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.o + self.d * t
    }
}

/// Where a ray meets a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalHit {
    /// Ray parameter.
    pub t: f64,
    /// Which face of the shape.
    pub face: u32,
}

/// A point of a surface, in the shape's space.
#[derive(Clone, Copy, Debug)]
pub struct LocalSurface {
    /// The point, on the surface to `f64` precision.
    pub p: DVec3,
    /// Geometric normal to the outside, any positive length.
    pub ng: DVec3,
    /// Shading normal, any positive length.
    pub ns: DVec3,
    /// Surface coordinates.
    pub uv: Vec2,
    /// Where they end.
    pub chart: Chart,
    /// Direction in which u grows; may be 0.
    pub dpdu: DVec3,
    /// Colour of a mesh, interpolated between its corners; 1 of all else.
    pub color: Rgb,
    /// Bound per axis of how far the point lies from what a ray meets here: by its own rounding, and by
    /// that of the test that the next ray makes.
    pub error: f64,
}

impl LocalSurface {
    fn smooth(p: DVec3, normal: DVec3, uv: (f64, f64), chart: Chart, dpdu: DVec3) -> Self {
        Self {
            p,
            ng: normal,
            ns: normal,
            uv: Vec2::new(uv.0 as f32, uv.1 as f32),
            chart,
            dpdu,
            color: Rgb::ONE,
            error: UNIT_ERROR,
        }
    }
}

/// A point drawn on a shape in canonical space.
#[derive(Clone, Copy, Debug)]
pub struct CanonicalPoint {
    /// The point.
    pub p: DVec3,
    /// Which face it is on.
    pub face: u32,
    /// Density per unit of canonical area.
    pub pdf_area: f64,
}

/// An analytic shape in its canonical space.
#[derive(Clone, Debug, PartialEq)]
pub enum Primitive {
    /// Radius 1 around the origin, poles on y.
    Sphere,
    /// The square `[−½, ½]²` at z = 0, facing +z.
    Rectangle,
    /// Radius 1 at z = 0, facing +z.
    Disk,
    /// y = 0, facing +y; infinite.
    Plane,
    /// The cube `[−½, ½]³`.
    Cuboid,
    /// Radius 1 around y, from −½ to ½.
    Cylinder {
        /// Whether the ends are closed.
        capped: bool,
    },
    /// Radius 1 at y = −½, tip at y = ½.
    Cone {
        /// Whether the base is closed.
        capped: bool,
    },
    /// A profile turned around y; its space has the unit of the profile.
    Revolution(Revolution),
}

impl Primitive {
    /// The box around the shape; not finite for a plane.
    pub fn bounds(&self) -> Aabb {
        let half = Vec3::splat(0.5);
        let (min, max) = match self {
            Self::Sphere => (Vec3::NEG_ONE, Vec3::ONE),
            Self::Rectangle => (Vec3::new(-0.5, -0.5, 0.0), Vec3::new(0.5, 0.5, 0.0)),
            Self::Disk => (Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0)),
            Self::Plane => (Vec3::NEG_INFINITY, Vec3::INFINITY),
            Self::Cuboid => (-half, half),
            Self::Cylinder { .. } | Self::Cone { .. } => {
                (Vec3::new(-1.0, -0.5, -1.0), Vec3::new(1.0, 0.5, 1.0))
            }
            Self::Revolution(revolution) => return revolution.bounds(),
        };
        Aabb { min, max }
    }

    /// Whether it divides space into an inside and an outside, whatever its measures.
    pub fn is_closed(&self) -> bool {
        match self {
            Self::Sphere | Self::Cuboid => true,
            Self::Cylinder { capped } | Self::Cone { capped } => *capped,
            Self::Rectangle | Self::Disk | Self::Plane | Self::Revolution(_) => false,
        }
    }

    /// The nearest hit with `0 < t < t_max`.
    #[inline]
    pub fn intersect(&self, ray: &LocalRay, t_max: f64) -> Option<LocalHit> {
        match self {
            Self::Sphere => sphere::intersect(ray, t_max),
            Self::Rectangle => rectangle::intersect(ray, t_max),
            Self::Disk => disk::intersect(ray, t_max),
            Self::Plane => plane::intersect(ray, t_max),
            Self::Cuboid => cuboid::intersect(ray, t_max),
            Self::Cylinder { capped } => cylinder::intersect(ray, t_max, *capped),
            Self::Cone { capped } => cone::intersect(ray, t_max, *capped),
            Self::Revolution(revolution) => revolution.intersect(ray, t_max),
        }
    }

    /// The surface at a point on (or within rounding of) the given face. The uv of round shapes takes inverse
    /// trigonometric functions; for spheres and revolutions they are left out, and uv is 0, unless `needs_uv`.
    pub fn surface(&self, p: DVec3, face: u32, needs_uv: bool) -> LocalSurface {
        match self {
            Self::Sphere => sphere::surface(p, needs_uv),
            Self::Rectangle => rectangle::surface(p),
            Self::Disk => disk::surface(p),
            Self::Plane => plane::surface(p),
            Self::Cuboid => cuboid::surface(p, face),
            Self::Cylinder { .. } => cylinder::surface(p, face),
            Self::Cone { .. } => cone::surface(p, face),
            Self::Revolution(revolution) => revolution.surface(p, face, needs_uv),
        }
    }

    /// Draws a point of the surface from two uniforms and one for the face.
    ///
    /// Faces are chosen by their area under `world_from_shape`; within a face the density is even in
    /// canonical area. `None` for a plane, which has no finite area.
    pub fn sample(&self, u: Vec2, world_from_shape: &DAffine3) -> Option<CanonicalPoint> {
        match self {
            Self::Sphere => Some(sphere::sample(u)),
            Self::Rectangle => Some(rectangle::sample(u)),
            Self::Disk => Some(disk::sample(u)),
            Self::Plane => None,
            Self::Cuboid => Some(cuboid::sample(u, world_from_shape)),
            Self::Cylinder { capped } => Some(cylinder::sample(u, world_from_shape, *capped)),
            Self::Cone { capped } => Some(cone::sample(u, world_from_shape, *capped)),
            Self::Revolution(revolution) => Some(revolution.sample(u)),
        }
    }

    /// The density of [`Primitive::sample`] at a point of `face`, per unit of canonical area.
    pub fn pdf_area(&self, face: u32, world_from_shape: &DAffine3) -> f64 {
        match self {
            Self::Sphere => sphere::PDF_AREA,
            Self::Rectangle => 1.0,
            Self::Disk => disk::PDF_AREA,
            Self::Plane => 0.0,
            Self::Cuboid => cuboid::face_probabilities(world_from_shape)[face as usize],
            Self::Cylinder { capped } => cylinder::pdf_area(face, world_from_shape, *capped),
            Self::Cone { capped } => cone::pdf_area(face, world_from_shape, *capped),
            Self::Revolution(revolution) => revolution.pdf_area(),
        }
    }

    /// The area of the shape in the world, square metres; infinite for a plane.
    ///
    /// The mean of the map's area factor over the surface: exact where it is constant on a face,
    /// otherwise a rule of 256² points, good to about six digits; of a revolution, of Gauss's points along its profile.
    pub fn world_area(&self, world_from_shape: &DAffine3) -> f64 {
        const N: u32 = 256;
        match self {
            Self::Plane => return f64::INFINITY,
            Self::Revolution(revolution) => return revolution.world_area(world_from_shape),
            _ => {}
        }
        let flat = matches!(self, Self::Rectangle | Self::Disk);
        let n = if flat { 1 } else { N };
        let factor = AreaFactor::new(&world_from_shape.matrix3);
        let mut sum = 0.0;
        for k in 0..n * n {
            let u = Vec2::new((k % n) as f32 + 0.5, (k / n) as f32 + 0.5) / n as f32;
            if let Some(point) = self.sample(u, world_from_shape) {
                sum += factor.at(self.surface(point.p, point.face, false).ng) / point.pdf_area;
            }
        }
        sum / f64::from(n * n)
    }
}

/// How much a linear map stretches areas, by their normal.
#[derive(Clone, Copy, Debug)]
pub struct AreaFactor {
    /// `|det M|·M⁻ᵀ`.
    cofactor: DMat3,
}

impl AreaFactor {
    /// For the linear map `m`.
    pub fn new(m: &DMat3) -> Self {
        // The columns of the cofactor matrix are the cross products of the others: also for a
        // singular map.
        let cofactor = DMat3::from_cols(
            m.y_axis.cross(m.z_axis),
            m.z_axis.cross(m.x_axis),
            m.x_axis.cross(m.y_axis),
        );
        Self { cofactor }
    }

    /// World area per unit of canonical area where the canonical normal has this direction.
    pub fn at(&self, normal: DVec3) -> f64 {
        (self.cofactor * normal.normalize()).length()
    }
}

/// Bound per axis, in the world's unit, of the error of the image of `p` under `m` in `f64`.
///
/// Three products, three sums and the rounding of the entries themselves, which come out of the
/// inversion and composition of matrices: γ₁₆ covers both with room for the point's own rounding.
pub fn rounding_error(m: &DAffine3, p: DVec3) -> DVec3 {
    let magnitude = m.matrix3.x_axis.abs() * p.x.abs()
        + m.matrix3.y_axis.abs() * p.y.abs()
        + m.matrix3.z_axis.abs() * p.z.abs()
        + m.translation.abs();
    magnitude * gamma_f64(16)
}

/// Moves the origin of `ray` to the point nearest to the canonical origin and returns how far.
///
/// Quadratic formulas then work on coordinates of the size of the shape instead of its distance,
/// and their discriminants do not cancel (Haines et al. 2019, "Precision Improvements for Ray/Sphere
/// Intersection", *Ray Tracing Gems*, chapter 7).
fn recentred(ray: &LocalRay) -> (LocalRay, f64) {
    let shift = -ray.o.dot(ray.d) / ray.d.length_squared();
    (LocalRay { o: ray.at(shift), d: ray.d }, shift)
}

/// Longitude as a share of a turn: ½ at +z, growing towards +x.
fn longitude(p: DVec3) -> f64 {
    0.5 + p.x.atan2(p.z) / std::f64::consts::TAU
}

#[cfg(test)]
mod tests;
