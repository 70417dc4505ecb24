//! A ray which leaves a point does not meet the surface that it leaves.
//!
//! Oracle: geometry. A plane is left for good; so is a convex solid by a ray to its outside, and a ray through
//! its inside meets it on the other side only.

use super::{MeshTree, RestingTree, SceneGeometry, SurfacePoint, TopLevel};
use crate::description::{BvhQuality, TriangleMesh};
use crate::extract::{FrameOrigin, Geometry, Instance, NOTHING, RestingMesh};
use crate::math::{Aabb, MotionTransform, Ray, offset_ray_origin, swept_bounds};
use crate::sampling::Sampler;
use crate::shade::TextureNeeds;
use crate::shape::Primitive;
use crate::world::Vertices;
use glam::{DAffine3, DQuat, DVec3, Vec3};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Distances of a plane from the origin of render space: through it, within rounding of it, and away from it.
const OFFSETS: [f64; 8] = [0.0, 1e-40, -1e-20, 3e-17, -1e-12, 3e-8, 0.1, -1e3];

struct Scene {
    instances: Vec<Instance>,
    meshes: Vec<Arc<MeshTree>>,
    top: TopLevel,
}

impl Scene {
    fn new(geometry: Geometry, around: Aabb, keys: &[DAffine3], mesh: Option<MeshTree>) -> Self {
        let instances = vec![instance(geometry, around, keys)];
        let top = TopLevel::build(&instances);
        Self { instances, meshes: mesh.into_iter().map(Arc::new).collect(), top }
    }

    fn primitive(primitive: &Primitive, keys: &[DAffine3]) -> Self {
        Self::new(Geometry::Primitive(primitive.clone()), primitive.bounds(), keys, None)
    }

    fn mesh(mesh: TriangleMesh, keys: &[DAffine3]) -> Self {
        let around = Aabb::from_points(mesh.positions.iter().copied());
        let tree = MeshTree::build(Arc::new(mesh), BvhQuality::default());
        Self::new(Geometry::Mesh(0), around, keys, Some(tree))
    }

    /// The mesh sheared along its own plane while the shutter is open.
    fn deforming(mesh: TriangleMesh, map: DAffine3) -> Self {
        let moved = |p: &Vec3| Vec3::new(p.x + 0.3 * p.y, p.y * 1.1, p.z);
        let positions: Vec<Vec3> = mesh.positions.iter().map(moved).collect();
        let around = Aabb::from_points(mesh.positions.iter().chain(&positions).copied());
        let later = vec![Vertices { positions, normals: Vec::new() }];
        let tree = MeshTree::deforming(Arc::new(mesh), Arc::new(later), BvhQuality::default());
        Self::new(Geometry::Mesh(0), around, &[map], Some(tree))
    }

    /// The mesh in one tree with another, far behind it.
    fn joined(mesh: TriangleMesh, map: DAffine3, origin: DVec3) -> Self {
        let other = DAffine3::from_translation(map.transform_vector3(DVec3::new(0.0, 0.0, -9.0)));
        let maps = [map, other * map].map(|m| DAffine3::from_translation(origin) * m);
        let around = Aabb::from_points(mesh.positions.iter().copied());
        let mesh = Arc::new(mesh);
        let resting: Vec<RestingMesh> = (0..)
            .zip(maps)
            .map(|(k, world_from_mesh)| RestingMesh { instance: k, mesh: k, world_from_mesh })
            .collect();
        let tree =
            RestingTree::build(&resting, &[mesh.clone(), mesh.clone()], BvhQuality::default());
        assert!(tree.built, "two may be joined");
        let from_world = DAffine3::from_translation(-origin);
        let instances: Vec<Instance> = (0..)
            .zip(maps)
            .map(|(k, m)| instance(Geometry::Mesh(k), around, &[from_world * m]))
            .collect();
        let top = TopLevel::with_resting(&instances, &[around; 2], &tree, &FrameOrigin(origin));
        let own = || Arc::new(MeshTree::build(mesh.clone(), BvhQuality::default()));
        Self { instances, meshes: vec![own(), own()], top }
    }

    fn geometry(&self) -> SceneGeometry<'_> {
        SceneGeometry { instances: &self.instances, meshes: &self.meshes, top: &self.top }
    }

    /// Points of the first instance which rays meet, with their times.
    fn met(&self, name: &str, number: u32) -> Vec<(SurfacePoint, f32)> {
        let geometry = self.geometry();
        let found: Vec<_> = (0..6)
            .filter_map(|k| {
                let s = Sampler::new(3, 0, (number, k), 0);
                let time = s.one(0);
                let map = self.instances[0].motion.at(time);
                let around = |k| (s.two(k).extend(s.one(k + 2)) - 0.5).as_dvec3();
                let (from, to) = (around(1) * 6.0 + DVec3::Z * 4.0, around(4) * 0.8);
                let from = map.transform_point3(if k % 2 == 0 { from } else { -from });
                let d = (map.transform_point3(to.with_z(0.0)) - from).normalize().as_vec3();
                let ray = Ray { o: from.as_vec3(), d, time };
                let hit = geometry.closest_hit(&ray, f64::INFINITY, false)?;
                (hit.instance == 0).then(|| (geometry.surface(&ray, &hit), time))
            })
            .collect();
        assert!(!found.is_empty(), "{name}: nothing is met");
        found
    }

    /// Holds that nothing is met behind the surface: nothing at all, or not on the sides which are left.
    fn assert_left_for_good(&self, name: &str, number: u32, inside: bool) {
        let geometry = self.geometry();
        for (surface, time) in self.met(name, number) {
            for d in directions(&surface, number, inside) {
                let o = offset_ray_origin(surface.p, surface.p_error, surface.ng, d);
                let ray = Ray { o, d, time };
                let hit = geometry.closest_hit(&ray, f64::INFINITY, false);
                let again = hit.filter(|hit| hit.instance == 0);
                assert!(again.is_none(), "{name}: {surface:?}\n{ray:?}\n{again:?}");
                // And not by lifting it farther than the next numbers.
                let lifted = (o.as_dvec3() - surface.p).abs();
                let size = surface.p.abs() * f64::from(f32::EPSILON) * 4.0 + 1e-12;
                assert!(lifted.cmple(size.max(DVec3::splat(size.max_element()))).all(), "{name}");
            }
        }
    }
}

fn instance(geometry: Geometry, around: Aabb, keys: &[DAffine3]) -> Instance {
    let motion = MotionTransform::new(keys);
    let bounds = swept_bounds(&around, &motion, 0.0, 1.0);
    Instance {
        geometry,
        motion,
        bounds,
        material: NOTHING,
        emission: NOTHING,
        object_id: 1,
        needs_uv: false,
        needs: TextureNeeds::default(),
        size: DVec3::ONE,
        hidden_from_camera: false,
    }
}

/// Directions to either side, or to the outside alone, down to a millionth of a radian above the surface.
fn directions(surface: &SurfacePoint, number: u32, inside: bool) -> Vec<Vec3> {
    let n = surface.ng.as_dvec3();
    let (x, y) = n.any_orthonormal_pair();
    (0..12)
        .map(|k| {
            let s = Sampler::new(4, 0, (number, k), 0);
            let (sin, cos) = (f64::from(s.one(0)) * 4.0 * FRAC_PI_2).sin_cos();
            let height = 10.0_f64.powf(-6.0 * f64::from(s.one(1)));
            let side = if inside && k % 2 == 1 { -1.0 } else { 1.0 };
            (x * cos + y * sin + n * (side * height)).normalize().as_vec3()
        })
        .collect()
}

/// A square at z = `height` of its own space.
fn square(height: f32) -> TriangleMesh {
    let corner = |x, y| Vec3::new(x, y, height);
    TriangleMesh {
        positions: vec![corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    }
}

/// Maps whose z goes along `axis`, with names: at rest, mirrored, stretched, turned.
fn maps(axis: usize, offset: f64) -> [(&'static str, DAffine3); 7] {
    // By quaternions, whose matrices hold what rounding makes of 0.
    let turn = [
        DQuat::from_rotation_y(FRAC_PI_2),
        DQuat::from_rotation_x(-FRAC_PI_2),
        DQuat::from_rotation_z(0.7),
    ][axis];
    let turned = DAffine3::from_quat(turn);
    let along = DVec3::AXES[axis] * offset;
    let exact = DAffine3::from_mat3(glam::DMat3::from_cols(
        DVec3::AXES[(axis + 1) % 3],
        DVec3::AXES[(axis + 2) % 3],
        DVec3::AXES[axis],
    ));
    let scaled = |x, y, z| exact * DAffine3::from_scale(DVec3::new(x, y, z));
    let aside = DAffine3::from_translation(exact.transform_vector3(DVec3::new(0.3, -50.0, 0.0)));
    let sheared = DAffine3::from_scale(DVec3::new(30.0, 0.2, 7.0))
        * DAffine3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.3, -0.9, 2.0)))
        * DAffine3::from_scale(DVec3::new(0.3, 1.0, 4.0));
    [
        ("at rest", exact),
        ("aside", aside * exact),
        ("mirrored", scaled(-1.0, 1.0, 1.0)),
        ("mirrored in its plane", scaled(1.0, 1.0, -2.0)),
        ("stretched", scaled(40.0, 0.1, 3.0)),
        ("turned", turned),
        ("sheared", sheared),
    ]
    .map(|(name, map)| (name, DAffine3::from_translation(along) * map))
}

/// Keys of a motion which keeps the plane: along it, and turning in it as well.
fn motions(map: DAffine3) -> [[DAffine3; 2]; 2] {
    let along = map * DAffine3::from_translation(DVec3::new(0.3, -0.2, 0.0));
    [[map, along], [map, along * DAffine3::from_rotation_z(0.4)]]
}

/// Every kind of scene with this plane.
fn planes(map: DAffine3) -> Vec<(&'static str, Scene)> {
    let [slide, turn] = motions(map);
    let mut scenes = vec![
        ("mesh", Scene::mesh(square(0.0), &[map])),
        ("sliding mesh", Scene::mesh(square(0.0), &slide)),
        ("turning mesh", Scene::mesh(square(0.0), &turn)),
        ("deforming mesh", Scene::deforming(square(0.0), map)),
        ("joined mesh", Scene::joined(square(0.0), map, DVec3::ZERO)),
        ("joined mesh elsewhere", Scene::joined(square(0.0), map, DVec3::new(4.0, 0.1, -7.0))),
    ];
    for (name, shape) in [
        ("rectangle", Primitive::Rectangle),
        ("disk", Primitive::Disk),
        ("sphere", Primitive::Sphere),
        ("cuboid", Primitive::Cuboid),
        ("cylinder", Primitive::Cylinder { capped: true }),
        ("cone", Primitive::Cone { capped: true }),
    ] {
        scenes.push((name, Scene::primitive(&shape, &[map])));
        scenes.push((name, Scene::primitive(&shape, &turn)));
    }
    scenes
}

#[test]
fn a_ray_which_leaves_a_surface_does_not_meet_it_wherever_it_lies() {
    for axis in 0..3 {
        for (number, offset) in (0..).zip(OFFSETS) {
            for (name, map) in maps(axis, offset) {
                for (kind, scene) in planes(map) {
                    let solid = !(kind.ends_with("mesh")
                        || kind.ends_with("elsewhere")
                        || matches!(kind, "rectangle" | "disk"));
                    let name = format!("{kind}, {name}, axis {axis}, at {offset:e}");
                    scene.assert_left_for_good(&name, number, !solid);
                }
            }
        }
    }
}

/// The plane is in the mesh instead of in the map, with corners of its own height that no power of two divides.
#[test]
fn a_mesh_whose_own_plane_is_off_its_origin_does_not_shadow_itself() {
    for (number, height) in (0..).zip([0.1_f32, -1e-7, 3.3, 1e3]) {
        for axis in 0..3 {
            // So that the plane goes through the origin of render space, up to rounding.
            for (name, map) in maps(axis, 0.0) {
                let back = DAffine3::from_translation(DVec3::Z * -f64::from(height));
                let scene = Scene::mesh(square(height), &[map * back]);
                let name = format!("{name}, axis {axis}, height {height}");
                let geometry = scene.geometry();
                for k in 0..8 {
                    let s = Sampler::new(9, 0, (number, k), 0);
                    let weights = s.two(0).as_dvec2() * 0.5;
                    let map = scene.instances[0].motion.both_at(0.0);
                    let local = scene.meshes[0].surface(k % 2, weights, 0.0, false);
                    let surface = SurfacePoint::new(&local, &map.0, &map.1);
                    for d in directions(&surface, number, true) {
                        let o = offset_ray_origin(surface.p, surface.p_error, surface.ng, d);
                        let ray = Ray { o, d, time: 0.0 };
                        assert!(!geometry.occluded(&ray, f64::INFINITY), "{name}: {ray:?}");
                    }
                }
            }
        }
    }
}
