//! Spheres at rest, four side by side.
//!
//! A scene of particles is a million small spheres. Asked one by one each costs the ray a read of a whole
//! [`Instance`] somewhere in memory and two roots and quotients one after the other. Here the numbers of
//! four neighbours lie together and are worked on together: a block takes a tenth of the memory of its
//! four instances, and as long as one of them to test.
//!
//! A sphere joins when the map into its space is one scale and a shift, without rotation: the unit ball
//! then has a centre and a radius, and the scale takes one number of `f64` instead of nine. The operations
//! are those of the sphere by itself in the same order (products with the zeros of the matrix add
//! nothing), so that hits have the same bits.

#![expect(
    clippy::inline_always,
    reason = "vector instructions are used only where this is inlined into a function that has them"
)]

use crate::extract::{Geometry, Instance, NOTHING};
use crate::math::MotionTransform;
use crate::math::instructions::{Lanewise, widest};
use crate::shape::{LocalRay, Primitive};

/// Spheres of a block.
pub(super) const LANES: usize = 4;

/// A number for each sphere of a block.
type Row = [f64; LANES];

/// The test of a block.
struct Test<'a> {
    block: &'a SphereBlock,
    ray: &'a LocalRay,
    t_max: f64,
}

impl Lanewise for Test<'_> {
    type Output = Row;

    #[inline(always)]
    fn run(self) -> Row {
        self.block.hits_here(self.ray, self.t_max)
    }
}

/// Four spheres.
#[repr(C, align(32))]
#[derive(Clone, Copy, Debug)]
pub(super) struct SphereBlock {
    /// Unit sphere from render space: the scale.
    scale: Row,
    /// The shift, by axis.
    shift: [Row; 3],
    /// The instances; [`NOTHING`] in an unused lane.
    pub(super) instances: [u32; LANES],
}

impl SphereBlock {
    /// No sphere: what is not a number is never hit.
    pub(super) const EMPTY: Self = Self {
        scale: [f64::NAN; LANES],
        shift: [[f64::NAN; LANES]; 3],
        instances: [NOTHING; LANES],
    };

    /// Puts an instance into a lane.
    pub(super) fn set(&mut self, lane: usize, index: u32, (scale, shift): (f64, [f64; 3])) {
        self.instances[lane] = index;
        self.scale[lane] = scale;
        for (row, value) in self.shift.iter_mut().zip(shift) {
            row[lane] = value;
        }
    }

    /// Where a ray in render space meets each sphere with `0 < t < t_max`; lanes which are not met hold
    /// infinity.
    ///
    /// The steps of [`Primitive::intersect`] in the space of each sphere, each for all lanes.
    #[inline]
    pub(super) fn hits(&self, ray: &LocalRay, t_max: f64) -> Row {
        widest(Test { block: self, ray, t_max })
    }

    /// The same with the instructions of whatever calls it.
    #[inline(always)]
    fn hits_here(&self, ray: &LocalRay, t_max: f64) -> Row {
        let o: [Row; 3] = each(|axis| {
            let (o, shift) = (ray.o[axis], &self.shift[axis]);
            each(|k| self.scale[k] * o + shift[k])
        });
        let d: [Row; 3] = each(|axis| {
            let d = ray.d[axis];
            each(|k| self.scale[k] * d)
        });
        let squared: Row = each(|k| d[0][k] * d[0][k] + d[1][k] * d[1][k] + d[2][k] * d[2][k]);
        let along: Row = each(|k| o[0][k] * d[0][k] + o[1][k] * d[1][k] + o[2][k] * d[2][k]);
        let shift: Row = each(|k| -along[k] / squared[k]);
        let near: [Row; 3] = each(|axis| each(|k| o[axis][k] + d[axis][k] * shift[k]));
        let discriminant: Row = each(|k| {
            1.0 - (near[0][k] * near[0][k] + near[1][k] * near[1][k] + near[2][k] * near[2][k])
        });
        let half_chord: Row = each(|k| (discriminant[k] / squared[k]).sqrt());
        let entry: Row = each(|k| shift[k] - half_chord[k]);
        let exit: Row = each(|k| shift[k] + half_chord[k]);
        each(|k| {
            let t = if entry[k] > 0.0 { entry[k] } else { exit[k] };
            let met = discriminant[k] >= 0.0 && t > 0.0 && t < t_max;
            if met { t } else { f64::INFINITY }
        })
    }
}

/// An array by index.
#[inline(always)]
fn each<T, const N: usize>(of: impl Fn(usize) -> T) -> [T; N] {
    std::array::from_fn(of)
}

/// The scale and the shift of an instance which may join a block.
pub(super) fn joinable(instance: &Instance) -> Option<(f64, [f64; 3])> {
    let Geometry::Primitive(Primitive::Sphere) = instance.geometry else { return None };
    let MotionTransform::Static { inverse, .. } = &instance.motion else { return None };
    let m = inverse.matrix3;
    let scale = m.x_axis.x;
    let plain = m == glam::DMat3::from_diagonal(glam::DVec3::splat(scale));
    (plain && !instance.hidden_from_camera).then_some((scale, inverse.translation.to_array()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Aabb;
    use crate::sampling::Sampler;
    use crate::shade::TextureNeeds;
    use glam::{DAffine3, DQuat, DVec3};

    fn sphere(forward: DAffine3) -> Instance {
        Instance {
            geometry: Geometry::Primitive(Primitive::Sphere),
            motion: MotionTransform::new(&[forward]),
            bounds: Aabb::EMPTY,
            material: NOTHING,
            emission: NOTHING,
            object_id: 1,
            needs_uv: false,
            needs: TextureNeeds::default(),
            size: DVec3::ONE,
            hidden_from_camera: false,
        }
    }

    /// Oracle: the sphere by itself. Bit by bit, with the instructions of this processor and in plain Rust,
    /// for radii of a nanometre to a thousand kilometres, mirrored ones, rays which begin inside, end before
    /// the sphere, or have no direction.
    #[test]
    fn a_block_hits_what_its_spheres_hit() {
        let mut seen = [0; 2];
        for number in 0..40_000 {
            let s = Sampler::new(31, 0, (number, 0), 0);
            let three = |k| (s.two(k).extend(s.one(k + 2)) - 0.5).as_dvec3();
            let size = 10.0_f64.powf(f64::from(s.one(3)) * 15.0 - 9.0);
            let mut block = SphereBlock::EMPTY;
            let spheres: Vec<Instance> = (0..3)
                .map(|k| {
                    let scale = size * (f64::from(k) - 1.5);
                    let place = three(10 + 3 * k) * size * 3.0;
                    sphere(
                        DAffine3::from_translation(place)
                            * DAffine3::from_scale(DVec3::splat(scale)),
                    )
                })
                .collect();
            for (lane, instance) in spheres.iter().enumerate() {
                block.set(lane, lane as u32, joinable(instance).expect("a scale and a shift"));
            }
            let o = (three(4) * size * 6.0).as_vec3();
            let towards = (three(7) * size * 3.0).as_vec3() - o;
            let d = if number % 50 == 0 { glam::Vec3::ZERO } else { towards };
            let ray = LocalRay { o: o.as_dvec3(), d: d.as_dvec3() };
            // The end of a ray is not included: one ends where it would hit.
            let ends = [f64::INFINITY, 1.0, block.hits_here(&ray, f64::INFINITY)[0]];
            let t_max = ends[number as usize % 3];
            for hits in [block.hits_here(&ray, t_max), block.hits(&ray, t_max)] {
                for (instance, t) in spheres.iter().zip(hits) {
                    let inverse = instance.motion.inverse_at(0.0);
                    let local = LocalRay {
                        o: inverse.transform_point3(ray.o),
                        d: inverse.transform_vector3(ray.d),
                    };
                    let alone = Primitive::Sphere.intersect(&local, t_max);
                    let expected = alone.map_or(f64::INFINITY, |hit| hit.t);
                    assert_eq!(t.to_bits(), expected.to_bits(), "{number}: {ray:?}");
                    seen[usize::from(alone.is_some())] += 1;
                }
                assert_eq!(hits[3], f64::INFINITY, "an unused lane");
            }
        }
        assert!(seen[0] > 20_000 && seen[1] > 20_000, "{seen:?}");
    }

    #[test]
    fn what_is_turned_stretched_hidden_or_moving_stays_alone() {
        let plain = sphere(DAffine3::from_scale(DVec3::splat(2.0)));
        assert!(joinable(&plain).is_some());
        let turned = DAffine3::from_quat(DQuat::from_rotation_x(1e-9));
        let stretched = DAffine3::from_scale(DVec3::new(1.0, 1.0, 1.0 + f64::EPSILON));
        for forward in [turned, stretched] {
            assert!(joinable(&sphere(forward)).is_none());
        }
        assert!(joinable(&Instance { hidden_from_camera: true, ..plain.clone() }).is_none());
        let keys = [DAffine3::IDENTITY, DAffine3::from_translation(DVec3::X)];
        let moving = Instance { motion: MotionTransform::new(&keys), ..plain.clone() };
        assert!(joinable(&moving).is_none());
        let disk = Instance { geometry: Geometry::Primitive(Primitive::Disk), ..plain };
        assert!(joinable(&disk).is_none());
    }
}
