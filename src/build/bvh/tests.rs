//! The nearest hit among many objects, against asking each of them.

use super::{SceneGeometry, TopLevel};
use crate::extract::{FrameOrigin, Geometry, Instance, NOTHING};
use crate::math::{MotionTransform, Ray};
use crate::sampling::Sampler;
use crate::shape::{LocalRay, Primitive};
use glam::{DAffine3, DQuat, DVec3, Vec3};

/// A vector in `[-½, ½]³`, by number.
fn three(seed: u64, number: u32) -> Vec3 {
    let s = Sampler::new(seed, 0, (number, 0), 0);
    s.two(0).extend(s.one(2)) - 0.5
}

/// A shape which goes through `keys`.
fn object(primitive: Primitive, keys: &[DAffine3], hidden: bool) -> Instance {
    let motion = MotionTransform::new(keys);
    let bounds = Instance::bounds_of(&primitive.bounds(), keys, &motion);
    Instance {
        geometry: Geometry::Primitive(primitive),
        motion,
        bounds,
        material: NOTHING,
        emission: NOTHING,
        object_id: 1,
        needs_uv: false,
        hidden_from_camera: hidden,
    }
}

/// The map of an object at rest.
fn placed(number: u32, size: f64, turn: f64) -> DAffine3 {
    let turn = DQuat::from_scaled_axis(three(41, number).as_dvec3() * turn);
    let place = three(40, number).as_dvec3() * 2.0;
    DAffine3::from_scale_rotation_translation(DVec3::splat(size), turn, place)
}

fn ray(number: u32, time: f32) -> Ray {
    let o = three(50, number) * 4.0;
    let towards = three(51, number) * 2.0;
    Ray { o, d: (towards - o).normalize(), time }
}

/// Holds that rays meet what asking each instance in turn says, bit by bit; returns how many met anything.
fn assert_each_is_found(instances: &[Instance], top: &TopLevel, times: &[f32], rays: u32) -> usize {
    let scene = SceneGeometry { instances, meshes: &[], top };
    let mut met = 0;
    for number in 0..rays {
        let ray = ray(number, times[number as usize % times.len()]);
        for from_camera in [false, true] {
            let mut nearest: Option<(f64, u32, u32)> = None;
            for (index, instance) in (0..).zip(instances) {
                let Geometry::Primitive(primitive) = instance.geometry else { continue };
                let inverse = instance.motion.inverse_at(ray.time);
                let local = LocalRay {
                    o: inverse.transform_point3(ray.o.as_dvec3()),
                    d: inverse.transform_vector3(ray.d.as_dvec3()),
                };
                let seen = !(from_camera && instance.hidden_from_camera);
                if let Some(hit) = primitive.intersect(&local, f64::INFINITY)
                    && seen
                    && nearest.is_none_or(|best| (hit.t, index, hit.face) < best)
                {
                    nearest = Some((hit.t, index, hit.face));
                }
            }
            let found = scene.closest_hit(&ray, f64::INFINITY, from_camera);
            let found = found.map(|hit| (hit.t, hit.instance, hit.primitive));
            assert_eq!(found, nearest, "ray {number}: {ray:?}");
            met += usize::from(nearest.is_some());
            if !from_camera {
                let end = nearest.map_or(f64::INFINITY, |(t, ..)| t.next_up());
                assert_eq!(scene.occluded(&ray, end), nearest.is_some(), "ray {number}: {ray:?}");
            }
        }
    }
    met
}

/// Spheres of three sizes, some in the same place as another, between other shapes.
fn crowd(count: u32) -> Vec<Instance> {
    (0..count)
        .map(|k| {
            let twin = if k % 50 == 7 { k - 1 } else { k };
            let size = 0.02 * f64::from(1 + k % 3);
            match k % 10 {
                0 => object(Primitive::Cuboid, &[placed(k, size, 1.0)], false),
                1 => object(Primitive::Sphere, &[placed(k, size, 1.0)], false),
                2 => object(Primitive::Sphere, &[placed(k, size, 0.0)], true),
                3 => object(
                    Primitive::Sphere,
                    &[placed(k, size, 0.0), placed(k + 1, size, 0.0)],
                    false,
                ),
                _ => object(Primitive::Sphere, &[placed(twin, 0.04, 0.0)], false),
            }
        })
        .collect()
}

/// Oracle: each instance by itself. Spheres in blocks next to what is turned, hidden or moving; then some
/// are elsewhere, and the tree with its blocks follows them.
#[test]
fn spheres_in_blocks_are_found_before_and_after_they_moved() {
    let mut instances = crowd(400);
    let mut top = TopLevel::build(&instances);
    let times = [0.0, 0.3, 1.0];
    assert!(!top.spheres.is_empty());
    assert!(assert_each_is_found(&instances, &top, &times, 2000) > 500);
    let moved: Vec<u32> = (0..400).filter(|k| k % 10 > 3 && k % 7 == 0).collect();
    for &index in &moved {
        let keys = [placed(index + 1000, 0.05, 0.0)];
        instances[index as usize] = object(Primitive::Sphere, &keys, false);
    }
    top.refit(&instances, &moved, &FrameOrigin::default());
    assert!(assert_each_is_found(&instances, &top, &times, 2000) > 500);
    // One which turns cannot stay in its block.
    let last = moved[moved.len() - 1];
    instances[last as usize] = object(Primitive::Sphere, &[placed(last, 0.05, 1.0)], false);
    assert!(!top.refit(&instances, &[last], &FrameOrigin::default()), "it is built anew");
}
