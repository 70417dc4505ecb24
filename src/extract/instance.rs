//! One object as the renderer sees it: what it is made of, and where it is over the shutter.

use super::Meshes;
use crate::math::{Aabb, MotionTransform, swept_bounds};
use crate::shade::TextureNeeds;
use crate::shape::{Primitive, Revolution};
use crate::world::{Shape, ShutterMotion};
use glam::{DAffine3, DMat3, DVec3};

/// The index which stands for "none": no material, no emission.
pub const NOTHING: u32 = u32::MAX;

/// The form of an instance.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// An analytic shape in its canonical space.
    Primitive(Primitive),
    /// Index into the [`Meshes`].
    Mesh(u32),
}

/// An object as the renderer sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// Its form.
    pub geometry: Geometry,
    /// Render space from the space of the geometry.
    pub motion: MotionTransform,
    /// Around the geometry during the whole shutter, in render space; infinite for a plane.
    pub bounds: Aabb,
    /// Index into the materials; [`NOTHING`] absorbs everything.
    pub material: u32,
    /// Index into the emissions, or [`NOTHING`].
    pub emission: u32,
    /// From 1, in the order of names.
    pub object_id: u32,
    /// Whether its material or emission looks at uv.
    pub needs_uv: bool,
    /// What its textures need to know of a point beside uv.
    pub needs: TextureNeeds,
    /// What the canonical space of its shape is stretched by to become that of the object; 1 for a mesh.
    pub size: DVec3,
    /// Whether camera rays pass through it.
    pub hidden_from_camera: bool,
}

/// What decides where an object at rest is seen from an origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// World position of the origin of its shape.
    pub translation: DVec3,
    /// Around the geometry in its own space.
    pub bounds: Aabb,
}

/// What changes of an instance when it moves.
pub(super) struct Placed {
    pub geometry: Geometry,
    pub size: DVec3,
    pub motion: MotionTransform,
    pub bounds: Aabb,
    pub place: Place,
}

impl Instance {
    /// Sees an object at rest from another origin; gives the same bits as [`placed`] does. What moves in
    /// the shutter is left as it is.
    pub(super) fn follow(&mut self, place: &Place, origin: DVec3) {
        let MotionTransform::Static { forward, inverse } = &mut self.motion else { return };
        forward.translation = place.translation - origin;
        inverse.translation = -(inverse.matrix3 * forward.translation);
        if !matches!(self.geometry, Geometry::Primitive(Primitive::Plane)) {
            self.bounds = place.bounds.transformed(forward);
        }
    }
}

/// Where an object is; `None` for a shape without extent or a mesh which does
/// not exist.
pub(super) fn placed(
    shape: &Shape,
    motion: &ShutterMotion,
    origin: DVec3,
    meshes: &Meshes,
) -> Option<Placed> {
    let (geometry, scale, bounds) = match *shape {
        Shape::Sphere { radius } => canonical(Primitive::Sphere, DVec3::splat(radius)),
        Shape::Rectangle { size } => canonical(Primitive::Rectangle, size.extend(1.0)),
        Shape::Disk { radius } => canonical(Primitive::Disk, DVec3::new(radius, radius, 1.0)),
        Shape::Plane {} => canonical(Primitive::Plane, DVec3::ONE),
        Shape::Box { size } => canonical(Primitive::Cuboid, size),
        Shape::Cylinder { radius, height, capped } => {
            canonical(Primitive::Cylinder { capped }, DVec3::new(radius, height, radius))
        }
        Shape::Cone { radius, height, capped } => {
            canonical(Primitive::Cone { capped }, DVec3::new(radius, height, radius))
        }
        Shape::Revolution { ref profile, capped } => {
            let turned = Revolution::new(profile.clone(), capped);
            canonical(Primitive::Revolution(turned), DVec3::ONE)
        }
        Shape::Mesh(mesh) => {
            let (slot, bounds) = meshes.slot(mesh)?;
            (Geometry::Mesh(slot), DVec3::ONE, bounds)
        }
    };
    let keys: Vec<DAffine3> = motion
        .keys
        .iter()
        .map(|key| DAffine3 {
            matrix3: key.matrix3 * DMat3::from_diagonal(scale),
            translation: key.translation - origin,
        })
        .collect();
    // A map which flattens space has no inverse, and its surface no area to hit.
    if keys.iter().any(|key| key.matrix3.determinant() == 0.0 || !key.is_finite()) {
        return None;
    }
    let place = Place { translation: motion.keys.first()?.translation, bounds };
    let motion = MotionTransform::through(&keys, motion.curved);
    let bounds = match geometry {
        Geometry::Primitive(Primitive::Plane) => bounds,
        _ => swept_bounds(&bounds, &motion, 0.0, 1.0),
    };
    Some(Placed { geometry, size: scale, motion, bounds, place })
}

fn canonical(primitive: Primitive, scale: DVec3) -> (Geometry, DVec3, Aabb) {
    let bounds = primitive.bounds();
    (Geometry::Primitive(primitive), scale, bounds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, Vec3};

    /// Oracle: points of the box carried along the motion at many times lie within the bounds; the
    /// bounds are not much larger than they need to be.
    #[test]
    fn bounds_hold_the_whole_motion() {
        let shape = Aabb { min: Vec3::new(-1.0, -0.2, 0.0), max: Vec3::new(2.0, 0.3, 0.5) };
        for case in 0..40_u8 {
            let a = f64::from(case);
            let key = |t: f64| {
                DAffine3::from_scale_rotation_translation(
                    DVec3::new(1.0 + 0.3 * t * a.sin(), 1.0, 1.0 + 0.5 * t),
                    DQuat::from_scaled_axis(DVec3::new(a.sin(), a.cos(), 0.3) * t * 0.5),
                    DVec3::new(a, 2.0 * t, -t) * 0.3,
                ) * DAffine3::from_scale(DVec3::new(1.0, 1.0 + 0.2 * a.cos(), 1.0))
            };
            let keys: Vec<_> = (0..3).map(|k| key(f64::from(k) / 2.0)).collect();
            let motion = MotionTransform::new(&keys);
            let bounds = swept_bounds(&shape, &motion, 0.0, 1.0);
            let mut tight = Aabb::EMPTY;
            for k in 0..=200_u16 {
                tight = tight.union(shape.transformed(&motion.at(f32::from(k) / 200.0)));
            }
            assert_eq!(bounds.union(tight).inflated(0.0), bounds.inflated(0.0), "case {case}");
            assert!(bounds.area() < 1.6 * tight.area(), "case {case}");
        }
    }

    /// Oracle: the object made anew. Bit by bit, for objects of all kinds of maps and origins.
    #[test]
    fn an_object_which_follows_the_origin_is_the_object_made_anew() {
        let mut seen = 0;
        for case in 0..50_u8 {
            let a = f64::from(case);
            let key = DAffine3::from_scale_rotation_translation(
                DVec3::new(1.0 + 0.1 * a, 0.5, -1.0),
                DQuat::from_scaled_axis(DVec3::new(a.sin(), a.cos(), 0.3)),
                DVec3::new(a * 1e3, 2.0, -a),
            );
            let motion = ShutterMotion { keys: vec![key], curved: false };
            let shapes =
                [Shape::Sphere { radius: 0.3 }, Shape::Plane {}, Shape::Disk { radius: 2.0 }];
            let shape = &shapes[usize::from(case) % shapes.len()];
            let at = |origin| placed(shape, &motion, origin, &Meshes::default()).expect("not flat");
            let origin = DVec3::new(a.cos() * 1e4, a, 0.1 * a);
            let (before, after) = (at(DVec3::ZERO), at(origin));
            let mut instance = Instance {
                geometry: before.geometry,
                motion: before.motion,
                bounds: before.bounds,
                material: NOTHING,
                emission: NOTHING,
                object_id: 1,
                needs_uv: false,
                needs: TextureNeeds::default(),
                size: DVec3::ONE,
                hidden_from_camera: false,
            };
            seen += usize::from(instance.motion != after.motion);
            instance.follow(&before.place, origin);
            assert_eq!((&instance.motion, instance.bounds), (&after.motion, after.bounds));
        }
        assert!(seen > 40, "the origins differ");
    }
}
