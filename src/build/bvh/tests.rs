//! The nearest hit among many objects, against asking each of them.

use super::movers::{Mover, Movers, mover};
use super::{SceneGeometry, TopLevel};
use crate::extract::{FrameOrigin, Geometry, Instance, NOTHING};
use crate::math::{MotionTransform, Ray, swept_bounds};
use crate::sampling::Sampler;
use crate::shade::TextureNeeds;
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
    let bounds = swept_bounds(&primitive.bounds(), &motion, 0.0, 1.0);
    Instance {
        geometry: Geometry::Primitive(primitive),
        motion,
        bounds,
        material: NOTHING,
        emission: NOTHING,
        object_id: 1,
        needs_uv: false,
        needs: TextureNeeds::default(),
        size: DVec3::ONE,
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
                let Geometry::Primitive(primitive) = &instance.geometry else { continue };
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
    top.refit(&instances, &[], &moved, &FrameOrigin::default());
    assert!(assert_each_is_found(&instances, &top, &times, 2000) > 500);
    // One which turns cannot stay in its block.
    let last = moved[moved.len() - 1];
    instances[last as usize] = object(Primitive::Sphere, &[placed(last, 0.05, 1.0)], false);
    assert!(!top.refit(&instances, &[], &[last], &FrameOrigin::default()), "it is built anew");
}

/// Shapes which go far: along lines, through keys, turning, and as camera rays do not see.
fn swarm(count: u32) -> Vec<Instance> {
    (0..count)
        .map(|k| {
            let size = 0.02 * f64::from(1 + k % 3);
            let turn = if k % 3 == 0 { 0.0 } else { 1.5 };
            let keys: Vec<DAffine3> = (0..2 + k % 4)
                .map(|key| placed(1000 * key + k, size, turn * f64::from(key)))
                .collect();
            let primitive = if k % 2 == 0 { Primitive::Sphere } else { Primitive::Cuboid };
            object(primitive, &keys, k % 11 == 5)
        })
        .collect()
}

/// Oracle: each instance by itself, at random times, both ends of the shutter and all borders of segments
/// with the numbers next to them; for any number of segments, next to what is at rest and moves little.
#[test]
fn what_moves_far_is_found_in_any_number_of_segments() {
    let mut instances = swarm(150);
    instances.extend(crowd(50));
    let mut times: Vec<f32> = (0..37).map(|k| Sampler::new(60, 0, (k, 0), 0).one(0)).collect();
    for border in 0..=64 {
        let time = f32::from(border as u8) / 64.0;
        times.extend([time, time.next_up().min(1.0), time.next_down().max(0.0)]);
    }
    let mut top = TopLevel::build(&instances);
    assert!(top.segments() > 4, "{} segments", top.segments());
    let far: Vec<Mover> =
        (0..).zip(&instances).filter_map(|(k, instance)| mover(k, instance, &[])).collect();
    assert!(far.len() > 100);
    for segments in [1, 2, 8, 64] {
        top.movers = Movers::with_segments(&far, &instances, segments);
        assert!(assert_each_is_found(&instances, &top, &times, 1000) > 100);
    }
}

/// What moves far goes on elsewhere, and comes to rest.
#[test]
fn what_moves_far_is_followed() {
    let mut instances = swarm(40);
    instances.extend(crowd(50));
    let mut top = TopLevel::build(&instances);
    let all: Vec<u32> = (0..instances.len() as u32).collect();
    let shift = DAffine3::from_translation(DVec3::new(0.3, -0.2, 0.1));
    let keys = [placed(3, 0.05, 0.0), shift * placed(9, 0.05, 0.0)];
    instances[3] = object(Primitive::Sphere, &keys, false);
    assert!(top.refit(&instances, &[], &all, &FrameOrigin::default()));
    assert!(assert_each_is_found(&instances, &top, &[0.0, 0.4, 1.0], 1000) > 100);
    instances[3] = object(Primitive::Sphere, &keys[..1], false);
    assert!(!top.refit(&instances, &[], &[3], &FrameOrigin::default()), "it is built anew");
}

/// Slow motion is not worth a tree of its own; the faster, the more segments.
#[test]
fn segments_follow_from_the_motion() {
    let segments = |radii: f64| {
        let ball = |k| {
            let start = placed(k, 0.02, 0.0);
            let way = three(70, k).as_dvec3().normalize() * 0.02 * radii;
            object(Primitive::Sphere, &[start, DAffine3::from_translation(way) * start], false)
        };
        let instances: Vec<Instance> = (0..100).map(ball).collect();
        TopLevel::build(&instances).segments()
    };
    let numbers = [0.5, 1.0, 8.0, 50.0, 1e4].map(segments);
    assert_eq!(numbers[..2], [1, 1], "a ball which moves by its radius");
    assert!(numbers.is_sorted() && numbers[2] > 1 && numbers[3] > numbers[2], "{numbers:?}");
    assert_eq!(numbers[4], 64, "as many as there may be");
}
