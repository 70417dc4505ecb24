//! Rays against surfaces: brute force, watertightness, and rays which leave what they hit.

mod common;

use common::icosphere;
use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, Vec3};
use kinora::build::bvh::{Hit, MeshTree, SceneGeometry, TopLevel};
use kinora::description::{BvhQuality, TriangleMesh};
use kinora::extract::{Geometry, Instance, NOTHING};
use kinora::math::{Aabb, Cubic, MotionTransform, Profile, Ray, offset_ray_origin};
use kinora::sampling::Sampler;
use kinora::shade::TextureNeeds;
use kinora::shape::{LocalRay, Primitive, Revolution};
use std::sync::Arc;

/// A stream of uniforms.
struct Uniforms(Sampler, u32);

impl Uniforms {
    fn new(seed: u64, index: u32) -> Self {
        Self(Sampler::new(seed, 0, (index, 0), 0), 0)
    }

    fn next(&mut self) -> f64 {
        self.1 += 1;
        f64::from(self.0.one(self.1))
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let d = self.point() * 2.0 - 1.0;
            if (1e-3..1.0).contains(&d.length_squared()) {
                return d.normalize();
            }
        }
    }

    fn affine(&mut self) -> DAffine3 {
        let turn = |u: &mut Self| DQuat::from_scaled_axis(u.direction() * 3.0 * u.next());
        let stretch = DMat3::from_diagonal((self.point() + 0.2) * 0.3);
        let mirror = if self.next() < 0.3 { -1.0 } else { 1.0 };
        let matrix3 =
            DMat3::from_quat(turn(self)) * stretch * DMat3::from_quat(turn(self)) * mirror;
        DAffine3 { matrix3, translation: self.point() * 3.0 }
    }
}

fn mesh_of(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Arc<MeshTree> {
    let mesh = TriangleMesh { positions, triangles, ..Default::default() };
    Arc::new(MeshTree::build(Arc::new(mesh), BvhQuality::default()))
}

/// An instance whose bounds come from many poses, with room: not from the code under test.
fn instance(geometry: Geometry, local: Aabb, keys: &[DAffine3]) -> Instance {
    let motion = MotionTransform::new(keys);
    let mut bounds = Aabb::EMPTY;
    for k in 0..=64_u8 {
        bounds = bounds.union(local.transformed(&motion.at(f32::from(k) / 64.0)));
    }
    let bounds = if bounds.min.is_finite() { bounds.inflated(0.05) } else { local };
    Instance {
        geometry,
        motion,
        bounds,
        material: NOTHING,
        emission: NOTHING,
        object_id: 1,
        hidden_from_camera: false,
        needs_uv: true,
        needs: TextureNeeds::default(),
        size: DVec3::ONE,
    }
}

fn turned(points: &[[f64; 2]]) -> Primitive {
    let lines: Vec<Cubic> =
        points.windows(2).map(|p| Cubic::line(p[0].into(), p[1].into())).collect();
    let profile = Profile::new(&lines).expect("off its axis");
    Primitive::Revolution(Revolution::new(Arc::new(profile), true))
}

/// The last is the only one without bounds.
fn primitives() -> Vec<Primitive> {
    let curve =
        Cubic::new([[0.5, 0.0], [1.2, 0.3], [0.2, 0.9], [0.8, 1.2]].map(DVec2::from), [1.0; 4]);
    let vase = Profile::new(&[curve]).expect("off its axis");
    vec![
        Primitive::Sphere,
        Primitive::Rectangle,
        Primitive::Disk,
        Primitive::Cuboid,
        Primitive::Cylinder { capped: true },
        Primitive::Cylinder { capped: false },
        Primitive::Cone { capped: true },
        Primitive::Cone { capped: false },
        Primitive::Revolution(Revolution::new(Arc::new(vase), false)),
        turned(&[[0.4, -0.5], [0.8, 0.1], [0.3, 0.5]]),
        Primitive::Plane,
    ]
}

fn ray(u: &mut Uniforms, time: bool) -> Ray {
    let o = u.point() * 4.0 - 0.5;
    let d = if u.next() < 0.2 { u.point() * 3.0 - o } else { u.direction() };
    let time = if time { u.next() as f32 } else { 0.0 };
    Ray { o: o.as_vec3(), d: d.as_vec3(), time }
}

/// Oracle: every object and every triangle tested alone, in the instance's own space; the nearest of all,
/// to the bit. All shapes and meshes under random affine maps, mirrored ones among them, at rest and in
/// motion, 10⁵ rays; and whether a segment meets anything at all.
#[test]
fn the_tree_of_instances_equals_brute_force() {
    let ball = icosphere(0, false);
    let meshes = [mesh_of(ball.positions.clone(), ball.triangles.clone())];
    let singles: Vec<Arc<MeshTree>> =
        ball.triangles.iter().map(|t| mesh_of(ball.positions.clone(), vec![*t])).collect();
    let mut u = Uniforms::new(1, 0);
    let primitives = primitives();
    for moving in [false, true] {
        let instances: Vec<Instance> = (0..60)
            .map(|k| {
                let first = u.affine();
                let turn = DAffine3::from_quat(DQuat::from_scaled_axis(u.direction() * 0.5));
                let second = DAffine3::from_translation(u.point()) * first * turn;
                let keys = if moving && k % 3 > 0 { vec![first, second] } else { vec![first] };
                if k % 4 == 0 {
                    let local = Aabb::from_points(ball.positions.iter().copied());
                    instance(Geometry::Mesh(0), local, &keys)
                } else {
                    // one plane is enough
                    let primitive = primitives[if k == 1 { 10 } else { k % 10 }].clone();
                    let bounds = primitive.bounds();
                    instance(Geometry::Primitive(primitive), bounds, &keys)
                }
            })
            .collect();
        let top = TopLevel::build(&instances);
        let tops: Vec<TopLevel> =
            instances.iter().map(|one| TopLevel::build(std::slice::from_ref(one))).collect();
        let scene = SceneGeometry { instances: &instances, meshes: &meshes, top: &top };
        let mut hits = 0;
        for k in 0..50_000 {
            let ray = ray(&mut Uniforms::new(2, k), moving);
            let mut nearest: Option<(f64, u32, u32)> = None;
            let mut offer = |t: f64, instance: u32, primitive: u32| {
                if nearest.is_none_or(|best| (t, instance, primitive) < best) {
                    nearest = Some((t, instance, primitive));
                }
            };
            for (index, object) in (0..).zip(&instances) {
                let inverse = object.motion.inverse_at(ray.time);
                let local = LocalRay {
                    o: inverse.transform_point3(ray.o.as_dvec3()),
                    d: inverse.transform_vector3(ray.d.as_dvec3()),
                };
                match &object.geometry {
                    Geometry::Primitive(primitive) => {
                        if let Some(hit) = primitive.intersect(&local, f64::INFINITY) {
                            offer(hit.t, index, hit.face);
                        }
                    }
                    Geometry::Mesh(_) => {
                        let instances = std::slice::from_ref(object);
                        let top = &tops[index as usize];
                        for (triangle, tree) in (0..).zip(&singles) {
                            let meshes = std::slice::from_ref(tree);
                            let single = SceneGeometry { instances, meshes, top };
                            if let Some(hit) = single.closest_hit(&ray, f64::INFINITY, false) {
                                offer(hit.t, index, triangle);
                            }
                        }
                    }
                }
            }
            let found = scene.closest_hit(&ray, f64::INFINITY, false);
            assert_eq!(
                found.map(|hit| (hit.t, hit.instance, hit.primitive)),
                nearest,
                "ray {k}: {ray:?}"
            );
            if let Some((t, ..)) = nearest {
                hits += 1;
                assert!(scene.occluded(&ray, t * (1.0 + 1e-9)), "ray {k}");
                assert!(!scene.occluded(&ray, t * (1.0 - 1e-9)), "ray {k}");
                assert!(
                    scene.closest_hit(&ray, t, false).is_none(),
                    "the end is not included: ray {k}"
                );
            } else {
                assert!(!scene.occluded(&ray, f64::INFINITY), "ray {k}");
            }
        }
        assert!(hits > 20_000, "{hits} hits");
    }
}

/// Möller and Trumbore's test in `f64`, with how far the hit is from an edge.
fn by_cramer(ray: &Ray, [a, b, c]: [Vec3; 3]) -> Option<(f64, f64)> {
    let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let det = e1.dot(p);
    if det == 0.0 {
        return None;
    }
    let s = o - a;
    let u = s.dot(p) / det;
    let q = s.cross(e1);
    let v = d.dot(q) / det;
    Some((e2.dot(q) / det, u.min(v).min(1.0 - u - v)))
}

/// Oracle: another intersection algorithm over all triangles. Random soups, slivers, triangles of no area
/// (never hit), copies, and all centres on one line.
#[test]
fn triangle_soups_equal_another_algorithm() {
    let mut u = Uniforms::new(3, 0);
    let mut soup = |kind: u32| -> Vec<[Vec3; 3]> {
        (0..600)
            .map(|k| {
                let a = u.point();
                let (b, c) = (u.point() - 0.5, u.point() - 0.5);
                let (a, b, c) = match kind {
                    0 => (a, a + b * 0.3, a + c * 0.3),
                    1 => (a, a + b, a + b * 0.5 + c * 1e-6),
                    2 if k % 3 == 0 => (a, a, a + c),
                    2 => (a, a + b * 1e-3, a + c),
                    3 => (DVec3::ZERO, DVec3::X, DVec3::Y),
                    _ => (DVec3::splat(f64::from(k)) * 1e-3, DVec3::X * f64::from(k) * 1e-3 + b, c),
                };
                [a, b, c].map(DVec3::as_vec3)
            })
            .collect()
    };
    for kind in 0..5 {
        let triangles = soup(kind);
        let positions: Vec<Vec3> = triangles.iter().flatten().copied().collect();
        let indices = (0..600).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        let bounds = Aabb::from_points(positions.iter().copied());
        let meshes = [mesh_of(positions, indices)];
        let instances = [instance(Geometry::Mesh(0), bounds, &[DAffine3::IDENTITY])];
        let top = TopLevel::build(&instances);
        let scene = SceneGeometry { instances: &instances, meshes: &meshes, top: &top };
        let mut hits = 0;
        for k in 0..4000 {
            let mut u = Uniforms::new(4, k);
            let mut ray = ray(&mut u, false);
            if k % 2 == 0 {
                // few rays find a sliver by chance
                let [a, b, c] = triangles[k as usize % 600].map(Vec3::as_dvec3);
                let (v, w) = (0.5 * u.next(), 0.5 * u.next());
                ray.d = (a + (b - a) * v + (c - a) * w - ray.o.as_dvec3()).as_vec3();
            }
            let all: Vec<(f64, f64)> = triangles
                .iter()
                .filter_map(|t| by_cramer(&ray, *t))
                .filter(|hit| hit.0 > 0.0)
                .collect();
            // A hit clear of every edge must be found; one clear of the triangle must not.
            let sure = all
                .iter()
                .filter(|hit| hit.1 > 1e-9)
                .map(|hit| hit.0)
                .fold(f64::INFINITY, f64::min);
            match scene.closest_hit(&ray, f64::INFINITY, false) {
                Some(Hit { t, primitive, .. }) => {
                    hits += 1;
                    assert!(
                        t <= sure * (1.0 + 1e-6),
                        "kind {kind}, ray {k}: {t}, nearer one at {sure}"
                    );
                    let own = by_cramer(&ray, triangles[primitive as usize]);
                    let (own_t, inside) = own.unwrap_or((t, 0.0));
                    assert!(
                        inside > -1e-6 && (own_t / t - 1.0).abs() < 1e-3,
                        "kind {kind}, ray {k}: {own:?}, {t}"
                    );
                }
                None => assert_eq!(sure, f64::INFINITY, "kind {kind}, ray {k}"),
            }
        }
        assert!(hits > 100, "kind {kind}: {hits} hits");
    }
}

/// Oracle: a closed mesh has no way out: from inside, 10⁶ random rays and rays at every vertex and edge
/// middle all hit, under a map which rounds.
#[test]
fn no_ray_escapes_from_a_closed_mesh() {
    let ball = icosphere(4, false);
    let meshes = [mesh_of(ball.positions.clone(), ball.triangles.clone())];
    let local = Aabb::from_points(ball.positions.iter().copied());
    let map = DAffine3::from_scale_rotation_translation(
        DVec3::new(1.3, 0.7, 1.1),
        DQuat::from_scaled_axis(DVec3::new(0.3, 1.0, -0.4)),
        DVec3::new(0.1, -0.2, 0.3),
    );
    for map in [DAffine3::IDENTITY, map] {
        let instances = [instance(Geometry::Mesh(0), local, &[map])];
        let top = TopLevel::build(&instances);
        let scene = SceneGeometry { instances: &instances, meshes: &meshes, top: &top };
        let escapes = |o: Vec3, d: Vec3| {
            scene.closest_hit(&Ray { o, d, time: 0.0 }, f64::INFINITY, false).is_none()
        };
        let centre = map.translation.as_vec3();
        for [a, b, c] in &ball.triangles {
            let [a, b, c] = [a, b, c]
                .map(|k| map.transform_point3(ball.positions[*k as usize].as_dvec3()).as_vec3());
            for target in [a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5] {
                assert!(!escapes(centre, target - centre), "at {target}");
            }
        }
        for k in 0..500_000 {
            let mut u = Uniforms::new(5, k);
            let o = centre + (u.point() - 0.5).as_vec3() * 0.5;
            let d = u.direction().as_vec3();
            assert!(!escapes(o, d), "ray {k} from {o} along {d}");
        }
    }
}

/// Oracle: fifty parallel squares, 10⁻⁴ of their size apart: a ray which is sent on from each hit meets
/// exactly fifty, steeply and at grazing angles, at any scale and place.
#[test]
fn a_stack_of_fifty_squares_is_crossed_fifty_times() {
    for (scale, place) in [
        (1.0, DVec3::ZERO),
        (1e-6, DVec3::ZERO),
        (1e6, DVec3::ZERO),
        (1.0, DVec3::new(30.0, -20.0, 10.0)),
    ] {
        let turn = DAffine3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.4, 0.3, 0.2)));
        let instances: Vec<Instance> = (0..50)
            .map(|k| {
                let up = DAffine3::from_translation(DVec3::Z * (1e-4 * f64::from(k)));
                let key = DAffine3::from_translation(place)
                    * DAffine3::from_scale(DVec3::splat(scale))
                    * turn
                    * up;
                instance(
                    Geometry::Primitive(Primitive::Rectangle),
                    Primitive::Rectangle.bounds(),
                    &[key],
                )
            })
            .collect();
        let top = TopLevel::build(&instances);
        let scene = SceneGeometry { instances: &instances, meshes: &[], top: &top };
        for k in 0..500 {
            let mut u = Uniforms::new(6, k);
            let target = DVec3::new(u.next() - 0.5, u.next() - 0.5, 0.0) * 0.8;
            let slope = if k % 2 == 0 { 0.3 } else { 5.0 };
            let across = DVec3::new(u.next() - 0.5, u.next() - 0.5, 0.0) * slope * 0.01;
            let world = DAffine3::from_translation(place)
                * DAffine3::from_scale(DVec3::splat(scale))
                * turn;
            let o = world.transform_point3(target - across + DVec3::NEG_Z * 0.01);
            let d = world.transform_vector3(across + DVec3::Z * 0.01).normalize();
            let mut ray = Ray { o: o.as_vec3(), d: d.as_vec3(), time: 0.0 };
            let mut met = Vec::new();
            while let Some(hit) = scene.closest_hit(&ray, f64::INFINITY, false) {
                met.push(hit.instance);
                let surface = scene.surface(&ray, &hit);
                ray.o = offset_ray_origin(surface.p, surface.p_error, surface.ng, ray.d);
                assert!(met.len() <= 50, "scale {scale:e}: {met:?}");
            }
            assert_eq!(met, (0..50).collect::<Vec<_>>(), "scale {scale:e}, place {place}, ray {k}");
        }
    }
}

/// An exact ball from rational curves.
fn turned_ball() -> Primitive {
    let (w, h) = ((1.0 + 2.0_f64.sqrt()) / 3.0, 2.0 - 2.0_f64.sqrt());
    let quarter = |s: f64| {
        let points = [[0.0, s], [h, s], [1.0, s * h], [1.0, 0.0]].map(DVec2::from);
        Cubic::new(points, [1.0, w, w, 1.0])
    };
    let [lower, upper] = [-1.0, 1.0].map(quarter);
    let upper = Cubic([upper.0[3], upper.0[2], upper.0[1], upper.0[0]]);
    let profile = Profile::new(&[lower, upper]).expect("off its axis");
    Primitive::Revolution(Revolution::new(Arc::new(profile), false))
}

/// Oracle: a ray sent on from a convex surface to the outside meets nothing, one sent inside meets the
/// far side. Every shape, scales from 10⁻⁶ to 10⁶ and places up to 10⁶ times as far; a triangle never
/// meets itself.
#[test]
fn rays_do_not_meet_the_surface_which_they_leave() {
    let closed = [
        Geometry::Primitive(Primitive::Sphere),
        Geometry::Primitive(Primitive::Cuboid),
        Geometry::Primitive(Primitive::Cylinder { capped: true }),
        Geometry::Primitive(Primitive::Cone { capped: true }),
        Geometry::Primitive(turned(&[[0.3, -0.5], [0.8, -0.2], [0.9, 0.1], [0.0, 0.5]])),
        Geometry::Primitive(turned_ball()),
        Geometry::Mesh(0),
    ];
    let ball = icosphere(1, false);
    let meshes = [mesh_of(ball.positions.clone(), ball.triangles.clone())];
    let (mut outward, mut inward) = (0, 0);
    for k in 0..200_000 {
        let mut u = Uniforms::new(7, k);
        let geometry = closed[k as usize % closed.len()].clone();
        let scale = 10_f64.powf(12.0 * u.next() - 6.0);
        // f32 rays resolve a shape as long as its distance is below some 10⁵ sizes
        let away = u.direction() * scale * 10_f64.powf(4.0 * u.next()) * u.next().round();
        let shape = u.affine().matrix3;
        let key = DAffine3 { matrix3: shape * scale, translation: away };
        let local = match &geometry {
            Geometry::Primitive(primitive) => primitive.bounds(),
            Geometry::Mesh(_) => Aabb::from_points(ball.positions.iter().copied()),
        };
        let instances = [instance(geometry.clone(), local, &[key])];
        let mut instances = instances;
        instances[0].bounds = local.transformed(&key).inflated((away.length() * 1e-6) as f32);
        let top = TopLevel::build(&instances);
        let scene = SceneGeometry { instances: &instances, meshes: &meshes, top: &top };
        let inside = key.transform_point3((u.point() - 0.5) * 0.2);
        let o = inside + u.direction() * scale * 3.0;
        let ray = Ray { o: o.as_vec3(), d: (inside - o).normalize().as_vec3(), time: 0.0 };
        let Some(hit) = scene.closest_hit(&ray, f64::INFINITY, false) else { continue };
        let surface = scene.surface(&ray, &hit);
        let mut wi = u.direction().as_vec3();
        if wi.dot(surface.ng).abs() < 1e-3 {
            wi = surface.ng;
        }
        let next = Ray {
            o: offset_ray_origin(surface.p, surface.p_error, surface.ng, wi),
            d: wi,
            time: 0.0,
        };
        let again = scene.closest_hit(&next, f64::INFINITY, false);
        if wi.dot(surface.ng) > 0.0 {
            outward += 1;
            assert!(
                again.is_none(),
                "case {k}, {geometry:?}, scale {scale:e}, away {away}: {again:?}"
            );
        } else if let Some(again) = again {
            inward += 1;
            let flat = !matches!(
                geometry,
                Geometry::Primitive(Primitive::Sphere | Primitive::Revolution(_))
            );
            let curved = again.primitive == 0
                && !matches!(geometry, Geometry::Mesh(_) | Geometry::Primitive(Primitive::Cuboid));
            assert!(
                !flat || curved || again.primitive != hit.primitive,
                "case {k}: a flat face meets itself"
            );
        }
    }
    assert!(outward > 50_000 && inward > 50_000, "{outward}, {inward}");
}

/// An empty world, and one of 10⁵ copies of a triangle, end in a tree and an answer; ties go to the
/// first.
#[test]
fn degenerate_worlds_have_answers() {
    let top = TopLevel::build(&[]);
    let empty = SceneGeometry { instances: &[], meshes: &[], top: &top };
    let down = Ray { o: Vec3::new(0.2, 0.2, 1.0), d: Vec3::NEG_Z, time: 0.0 };
    assert!(
        empty.closest_hit(&down, f64::INFINITY, true).is_none() && !empty.occluded(&down, 1e30)
    );
    let meshes = [mesh_of(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]; 100_000])];
    let local = Aabb { min: Vec3::ZERO, max: Vec3::new(1.0, 1.0, 0.0) };
    let instances = [instance(Geometry::Mesh(0), local, &[DAffine3::IDENTITY])];
    let top = TopLevel::build(&instances);
    let scene = SceneGeometry { instances: &instances, meshes: &meshes, top: &top };
    let hit = scene.closest_hit(&down, f64::INFINITY, true).expect("in the middle");
    assert_eq!((hit.t, hit.primitive, hit.instance), (1.0, 0, 0));
    assert!((hit.weights - DVec2::new(0.2, 0.2)).length() < 1e-6, "{}", hit.weights);
    let mesh = mesh_of(Vec::new(), Vec::new());
    assert!(mesh.mesh.triangles.is_empty());
}
