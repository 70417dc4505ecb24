//! Meshes moved by a texture, and diced before where that is asked for.

use super::{SurfaceSlots, Surfaces};
use crate::description::modelling::{
    TooFine, View, Weld, divided_where_long, longest_span, smooth_normals,
};
use crate::description::{Relief, RenderSettings, TriangleMesh};
use crate::math::Aabb;
use crate::shade::{TexturePoint, Textures};
use crate::world::{Displacement, Mesh, Settings, Views};
use bevy_ecs::prelude::*;
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// A mesh as its [`Displacement`] leaves it.
#[derive(Component, Clone, Debug)]
pub struct Displaced {
    /// The mesh; the one at rest where the texture does not exist.
    pub mesh: Arc<TriangleMesh>,
    /// The box around it.
    pub bounds: Aabb,
}

impl Displaced {
    /// Bytes that the mesh took while it was made, by which `dicing_memory` is counted.
    pub fn memory(&self) -> usize {
        bytes_of(self.mesh.triangles.len(), self.mesh.positions.len())
    }
}

/// Why a mesh was not diced.
#[derive(Resource, Clone, Debug, Default, PartialEq, Eq)]
pub struct DicingRefused(pub Option<Refusal>);

/// A mesh which would have taken too much memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// Its entity.
    pub mesh: Entity,
    /// Triangles that it would have had at least.
    pub triangles: usize,
    /// Bytes that they would have taken.
    pub bytes: usize,
}

/// Whether no mesh was refused.
pub(crate) fn meshes_fit(refused: Res<DicingRefused>) -> bool {
    refused.0.is_none()
}

/// Displaces meshes anew whose form, displacement, texture or views have changed, or the settings.
///
/// Textures are looked at in the space of the mesh.
pub fn displace_meshes(
    mut meshes: Query<(
        Entity,
        Ref<Mesh>,
        Ref<Displacement>,
        Option<Ref<Views>>,
        Option<&Displaced>,
    )>,
    surfaces: Res<Surfaces>,
    slots: Res<SurfaceSlots>,
    settings: Res<Settings>,
    mut refused: ResMut<DicingRefused>,
    mut commands: Commands,
) {
    refused.set_if_neq(DicingRefused::default());
    for (entity, mesh, displacement, views, displaced) in &mut meshes {
        let seen = views.as_ref().is_some_and(DetectChanges::is_changed) || settings.is_changed();
        let changed = mesh.is_changed()
            || displacement.is_changed()
            || surfaces.is_changed()
            || displacement.adaptive && seen;
        if !changed && displaced.is_some() {
            continue;
        }
        let data = match slots.textures.get(&displacement.texture) {
            Some(&texture) => {
                let textures = surfaces.materials.textures();
                let relief = (textures, texture, &*displacement);
                let views = views.as_ref().map_or(&[][..], |views| &views.list);
                let dicing = Dicing { views, settings: &settings.0 };
                match raised(mesh.data(), relief, displacement.adaptive.then_some(dicing)) {
                    Ok(raised) => Arc::new(raised),
                    Err(TooFine { triangles }) => {
                        let bytes = bytes_of(triangles, triangles / 2);
                        let refusal = Refusal { mesh: entity, triangles, bytes };
                        *refused = DicingRefused(Some(refusal));
                        mesh.data().clone()
                    }
                }
            }
            None => mesh.data().clone(),
        };
        match displaced {
            // What is the same is not built again.
            Some(before) if before.mesh == data => {}
            _ => {
                let bounds = Aabb::from_points(data.positions.iter().copied());
                commands.entity(entity).insert(Displaced { mesh: data, bounds });
            }
        }
    }
}

/// For whom a mesh is diced, and how finely.
#[derive(Clone, Copy)]
struct Dicing<'a> {
    views: &'a [View],
    settings: &'a RenderSettings,
}

/// Where a relief is steep an edge may be long although its ends were near each other. It is divided on down to this
/// share of the length that is asked for; a step, which would be steep at any length, ends there.
const STEEPEST: f64 = 1.0 / 8.0;

/// Bytes of a diced mesh, with its form at rest.
fn bytes_of(triangles: usize, vertices: usize) -> usize {
    const VERTEX: usize = size_of::<[f32; 3 + 3 + 2 + 3]>();
    2 * (triangles * size_of::<[u32; 3]>() + vertices * VERTEX)
}

/// The displaced mesh, diced before.
///
/// # Errors
/// When it would take more than the memory that the settings allow.
fn raised(
    mesh: &TriangleMesh,
    relief: (&Textures, u32, &Displacement),
    dicing: Option<Dicing>,
) -> Result<TriangleMesh, TooFine> {
    let Some(Dicing { views, settings }) = dicing else { return Ok(moved(mesh, relief)) };
    let mut rest = mesh.clone();
    if rest.normals.is_empty() {
        // Those of the mesh as it was given: between its corners they turn evenly.
        rest.normals = smooth_normals(&rest, &Weld::new(&rest));
    }
    let room = settings.dicing_memory as usize * (1 << 20);
    let fits = |triangles: usize, vertices: usize| bytes_of(triangles, vertices) <= room;
    let span = |mesh: &TriangleMesh, a: u32, b: u32| {
        longest_span(views, mesh.positions[a as usize], mesh.positions[b as usize])
    };
    while let Some(finer) =
        divided_where_long(&rest, |a, b| span(&rest, a, b) > settings.dicing, fits)?
    {
        rest = finer;
    }
    loop {
        let raised = moved(&rest, relief);
        let long = |a: u32, b: u32| {
            span(&raised, a, b) > settings.dicing && span(&rest, a, b) > settings.dicing * STEEPEST
        };
        match divided_where_long(&rest, long, fits)? {
            Some(finer) => rest = finer,
            None => return Ok(raised),
        }
    }
}

/// The mesh with each place moved as the texture says. What lies at the same place moves together, by the mean of what
/// the texture says of its vertices, so that seams of uv do not tear.
fn moved(
    mesh: &TriangleMesh,
    (textures, texture, displacement): (&Textures, u32, &Displacement),
) -> TriangleMesh {
    let weld = Weld::new(mesh);
    let faces = smooth_normals(mesh, &weld);
    let normals = if mesh.normals.is_empty() { &faces } else { &mesh.normals };
    let mut outward = vec![DVec3::ZERO; weld.count];
    for (normal, &place) in normals.iter().zip(&weld.place) {
        outward[place as usize] += normal.as_dvec3();
    }
    let tangents = if displacement.says == Relief::Tangent { tangents(mesh) } else { Vec::new() };
    let (middle, strength) = (f64::from(displacement.middle), f64::from(displacement.strength));
    let offset = |k: usize| {
        let at = TexturePoint {
            p: mesh.positions[k].as_dvec3(),
            n: faces[k],
            color: mesh.colors.get(k).copied().unwrap_or(Vec3::ONE),
            ..TexturePoint::on(mesh.chart, mesh.uvs.get(k).copied().unwrap_or(Vec2::ZERO))
        };
        let outward = outward[weld.place[k] as usize].normalize_or_zero();
        let vector = || (textures.vector(texture, &at).as_dvec3() - middle) * strength;
        match displacement.says {
            Relief::Height => {
                outward * ((f64::from(textures.scalar(texture, &at)) - middle) * strength)
            }
            Relief::Object => vector(),
            Relief::Tangent => {
                let [u, v] = across(outward, tangents[k]);
                let by = vector();
                u * by.x + v * by.y + outward * by.z
            }
        }
    };
    let offsets: Vec<DVec3> = (0..mesh.positions.len()).into_par_iter().map(offset).collect();
    let mut sums = vec![(DVec3::ZERO, 0.0_f64); weld.count];
    for (offset, &place) in offsets.iter().zip(&weld.place) {
        let (sum, count) = &mut sums[place as usize];
        *sum += *offset;
        *count += 1.0;
    }
    let mut moved = mesh.clone();
    moved.positions.par_iter_mut().zip(&weld.place).for_each(|(p, &place)| {
        let (sum, count) = sums[place as usize];
        *p = (p.as_dvec3() + sum / count).as_vec3();
    });
    moved.normals = smooth_normals(&moved, &weld);
    // Those given belong to the surface at rest.
    moved.tangents = Vec::new();
    moved
}

/// For each vertex the direction in which u grows, by the areas of the triangles around it, and the side (1 or −1) on
/// which v grows.
fn tangents(mesh: &TriangleMesh) -> Vec<(DVec3, f64)> {
    let mut tangents = vec![(DVec3::ZERO, 0.0); mesh.positions.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|k| mesh.positions[k as usize].as_dvec3());
        let uv = |k: u32| mesh.uvs.get(k as usize).copied().unwrap_or(Vec2::ZERO).as_dvec2();
        let [ta, tb, tc] = triangle.map(uv);
        let (d1, d2) = (tb - ta, tc - ta);
        let turns = d1.perp_dot(d2).signum() * f64::from(u8::from(d1.perp_dot(d2) != 0.0));
        let along = ((b - a) * d2.y - (c - a) * d1.y) * turns;
        let weight = (b - a).cross(c - a).length();
        for &corner in triangle {
            let (sum, side) = &mut tangents[corner as usize];
            *sum += along.normalize_or_zero() * weight;
            *side += turns * weight;
        }
    }
    tangents.into_iter().map(|(along, side)| (along, if side < 0.0 { -1.0 } else { 1.0 })).collect()
}

/// The tangents along u and v that go with a normal; any two where u does not grow.
fn across(normal: DVec3, (along, side): (DVec3, f64)) -> [DVec3; 2] {
    let u = (along - normal * normal.dot(along)).normalize_or(normal.any_orthonormal_vector());
    [u, normal.cross(u) * side]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::bvh::WideTree;
    use crate::description::modelling::solids::{assert_closed, octahedron, volume};
    use crate::description::modelling::{Subdivision, grid, subdivided};
    use crate::description::{LoadOptions, Texture, TextureFiltering, Value, parse_scene_str};
    use crate::frame::Simulation;
    use crate::shade::Pyramids;
    use crate::shape::LocalRay;
    use glam::{DAffine3, DVec2};

    fn ramp() -> Textures {
        let [a, b] = [0.0, 1.0].map(|v| Value::Constant(Vec3::splat(v)));
        Textures::new(
            vec![Texture::Gradient { a, b }],
            TextureFiltering::Point,
            &Pyramids::default(),
        )
    }

    fn by(strength: f32, middle: f32) -> Displacement {
        let texture = Entity::PLACEHOLDER;
        Displacement { texture, says: Relief::Height, strength, middle, adaptive: false }
    }

    /// Closed form: a square raised by a ramp is a plane at an angle.
    #[test]
    fn a_ramp_makes_a_slope() {
        let mesh = grid(DVec2::new(2.0, 1.0), (7, 3));
        let slope = moved(&mesh, (&ramp(), 0, &by(0.5, 0.5)));
        for ((p, uv), n) in slope.positions.iter().zip(&mesh.uvs).zip(&slope.normals) {
            assert!((p.z - 0.5 * (uv.x - 0.5)).abs() < 1e-6);
            assert!((*n - Vec3::new(-0.25, 0.0, 1.0).normalize()).length() < 1e-5, "{n}");
        }
    }

    /// Closed form: a sphere raised evenly by h has the volume of one of radius 1 + h, and no edge opens: every
    /// edge has two triangles by its places.
    #[test]
    fn an_even_height_makes_a_larger_sphere() {
        let mut sphere = subdivided(&octahedron(), 5, Subdivision::Flat);
        for p in &mut sphere.positions {
            *p = p.normalize();
        }
        sphere.normals.clone_from(&sphere.positions);
        // Every second triangle has vertices of its own, of which the texture says another height.
        sphere.uvs = sphere.positions.iter().map(|p| Vec2::splat(p.x)).collect();
        for k in (0..sphere.triangles.len()).step_by(2) {
            for corner in 0..3 {
                let vertex = sphere.triangles[k][corner] as usize;
                sphere.triangles[k][corner] = sphere.positions.len() as u32;
                sphere.positions.push(sphere.positions[vertex]);
                sphere.normals.push(sphere.normals[vertex]);
                sphere.uvs.push(sphere.uvs[vertex] + 0.3);
            }
        }
        let one = Value::Constant(Vec3::ONE);
        let even = vec![Texture::Gradient { a: one, b: one }];
        let even = Textures::new(even, TextureFiltering::Point, &Pyramids::default());
        let raised = moved(&sphere, (&even, 0, &by(0.25, 0.0)));
        let ratio = volume(&raised) / volume(&sphere);
        assert!((ratio - 1.25_f64.powi(3)).abs() < 1e-4, "{ratio}");
        let uneven = moved(&sphere, (&ramp(), 0, &by(0.25, 0.0)));
        assert_eq!(Weld::new(&uneven).count, Weld::new(&sphere).count, "nothing tears");
    }

    /// A sphere of flat triangles with its own normals, and the views of a camera close to its right side.
    fn seen_sphere() -> (TriangleMesh, Vec<View>) {
        let mut sphere = subdivided(&octahedron(), 3, Subdivision::Flat);
        for p in &mut sphere.positions {
            *p = p.normalize();
        }
        sphere.normals.clone_from(&sphere.positions);
        sphere.uvs = sphere.positions.iter().map(|p| Vec2::new(p.x, p.y)).collect();
        let from = |x: f64| {
            let camera_from_mesh = DAffine3::from_translation(DVec3::new(-x, 0.0, 0.0));
            View { camera_from_mesh, pixel: (0.0, 2e-3) }
        };
        (sphere, vec![from(3.0), from(2.0)])
    }

    fn waves() -> Textures {
        let noise = Texture::Noise {
            size: 0.5,
            octaves: 3,
            gain: 0.5,
            turbulence: false,
            seed: 0,
            a: Value::Constant(Vec3::ZERO),
            b: Value::Constant(Vec3::ONE),
        };
        Textures::new(vec![noise], TextureFiltering::Point, &Pyramids::default())
    }

    /// Of a sphere raised by noise no edge looks longer than asked for, neither at rest nor raised; each edge lies
    /// between two triangles; and rays through all corners and edges meet it: from inside a closed surface there is
    /// no way out.
    #[test]
    fn what_is_diced_is_closed_and_fine_where_it_is_near() {
        let (sphere, views) = seen_sphere();
        let settings = RenderSettings { dicing: 20.0, ..Default::default() };
        let dicing = Dicing { views: &views, settings: &settings };
        let by = by(0.2, 0.5);
        let fine = raised(&sphere, (&waves(), 0, &by), Some(dicing)).expect("it is not large");
        assert_closed(&fine);
        let tree = WideTree::build(&fine, settings.bvh);
        let leaves = |p: DVec3| {
            let ray = LocalRay { o: DVec3::ZERO, d: p };
            assert!(tree.closest_hit(&ray, f64::INFINITY).is_some(), "a way out at {p}");
        };
        for triangle in &fine.triangles {
            for k in 0..3 {
                let (a, b) = (triangle[k] as usize, triangle[(k + 1) % 3] as usize);
                let (a, b) = (fine.positions[a], fine.positions[b]);
                let span = longest_span(&views, a, b);
                assert!(span <= 20.0, "{span} pixels from {a} to {b}");
                leaves(a.as_dvec3());
                for share in [0.1, 0.5, 0.7] {
                    leaves(a.as_dvec3() * (1.0 - share) + b.as_dvec3() * share);
                }
            }
        }
        let near = fine.positions.iter().filter(|p| p.x > 0.5).count();
        let far = fine.positions.iter().filter(|p| p.x < -0.5).count();
        assert!(near > 3 * far, "{near} vertices near the camera, {far} far");
    }

    /// Closed form: the volume between two spheres of radius 1 and 1.25 over the same facets, which are diced to chords
    /// of 1/40: the facets of the sphere at rest are its chords of 1/8, whose volume is known from the mesh.
    #[test]
    fn an_even_height_keeps_its_volume_when_diced() {
        let one = Value::Constant(Vec3::ONE);
        let even = vec![Texture::Gradient { a: one, b: one }];
        let even = Textures::new(even, TextureFiltering::Point, &Pyramids::default());
        let mut sphere = subdivided(&octahedron(), 5, Subdivision::Flat);
        for p in &mut sphere.positions {
            *p = p.normalize();
        }
        sphere.normals.clone_from(&sphere.positions);
        let view = View { camera_from_mesh: DAffine3::IDENTITY, pixel: (1e-3, 0.0) };
        let settings = RenderSettings { dicing: 25.0, ..Default::default() };
        let dicing = Dicing { views: &[view], settings: &settings };
        let fine = raised(&sphere, (&even, 0, &by(0.25, 0.0)), Some(dicing)).expect("it fits");
        assert!(fine.triangles.len() > 3 * sphere.triangles.len());
        let ratio = volume(&fine) / volume(&sphere);
        // The facets at rest are up to 2·10⁻⁴ inside of the sphere, and raised along normals which are of length 1
        // everywhere, so that this is the error of the radius, three times that of the volume.
        assert!((ratio - 1.25_f64.powi(3)).abs() < 1.953 * 3.0 * 2e-4, "{ratio}");
    }

    /// A vector along the normal does what a height does, and one in the space of the mesh moves by itself: a square
    /// sheared by a ramp is a parallelogram.
    #[test]
    fn vectors_move_along_tangents_or_axes() {
        let gradient = |b: Vec3| {
            let a = Value::Constant(Vec3::ZERO);
            let list = vec![Texture::Gradient { a, b: Value::Constant(b) }];
            Textures::new(list, TextureFiltering::Point, &Pyramids::default())
        };
        let mesh = grid(DVec2::new(2.0, 1.0), (7, 3));
        let vector = |says| Displacement { says, ..by(0.5, 0.0) };
        let height = moved(&mesh, (&ramp(), 0, &by(0.5, 0.0)));
        let normal = moved(&mesh, (&gradient(Vec3::Z), 0, &vector(Relief::Tangent)));
        let sheared = moved(&mesh, (&gradient(Vec3::Y), 0, &vector(Relief::Object)));
        let slid = moved(&mesh, (&gradient(Vec3::new(1.0, 0.5, 0.0)), 0, &vector(Relief::Tangent)));
        for (k, uv) in mesh.uvs.iter().enumerate() {
            let rest = mesh.positions[k];
            assert!(height.positions[k].distance(normal.positions[k]) < 1e-6);
            let expected = rest + Vec3::Y * 0.5 * uv.x;
            assert!(sheared.positions[k].distance(expected) < 1e-6);
            // u grows along x, v along y.
            let expected = rest + Vec3::new(0.5, 0.25, 0.0) * uv.x;
            assert!(slid.positions[k].distance(expected) < 1e-6, "{}", slid.positions[k]);
        }
        // Seen from behind u still grows along x, but the other side is out.
        let mut mirrored = mesh.clone();
        mirrored.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mirrored.normals.iter_mut().for_each(|n| *n = -*n);
        let slid = moved(&mirrored, (&gradient(Vec3::Y), 0, &vector(Relief::Tangent)));
        for (k, uv) in mesh.uvs.iter().enumerate() {
            let expected = mesh.positions[k] + Vec3::Y * 0.5 * uv.x;
            assert!(slid.positions[k].distance(expected) < 1e-6, "{}", slid.positions[k]);
        }
    }

    /// What would take more than is allowed is an error with its name and numbers, and not made.
    #[test]
    fn too_much_is_refused_in_words() {
        let text = r#"(
            render: (dicing: 0.01, dicing_memory: 64),
            textures: {"noise": Noise()},
            meshes: {
                "flat": Grid(size: (1, 1), cells: (1, 1)),
                "hills": Displaced(of: "flat", height: "noise", adaptive: true),
            },
            entities: {
                "eye": (transform: (translation: (0, 0, 2)), camera: ()),
                "hills": (shape: Mesh("hills")),
                "sky": (light: Sky(radiance: 1)),
            },
        )"#;
        let scene = parse_scene_str("test.ron", text, None, &LoadOptions::default());
        let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
        let error = Simulation::from_description(&scene).prepare_frame(0).expect_err("too fine");
        let message = error.to_string();
        for part in ["`hills`", "triangles", "`dicing_memory` is 64 MiB", "larger `dicing`"] {
            assert!(message.contains(part), "{message}");
        }
    }
}
