//! What a camera ray sees first, for the layers that tell of geometry.
//!
//! The first surface that is there for the ray: holes of a mask let it pass, and the inside of a solid is no surface,
//! whatever it does to light. So the layers are the same whichever integrator takes the picture, and in and behind
//! clouds and fog they show what solid surface stands there; glass is seen itself. This is looked for apart from the path
//! that brings the light, which may be scattered before it meets anything.

use super::PathTracer;
use super::scene_view::SceneView;
use crate::build::bvh::{Hit, SurfacePoint};
use crate::build::nesting::Meeting;
use crate::extract::{CameraRay, NOTHING};
use crate::film::{Film, FirstHit, Seen, Tile};
use crate::math::{Ray, offset_ray_origin};
use crate::sampling::{Sampler, dimension};
use crate::shade::Bsdf;
use crate::shade::nesting::{Inside, NestingFaults};
use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Stands for a random number where none is drawn: a surface is there if its opacity is more than half, and of mixed
/// materials the greater share counts.
const MIDDLE: f32 = 0.5;

/// What holds at the centres of pixels is seen through the middle of the lens when the shutter opens, as the poses in a
/// file's header are.
const OPENING: f32 = 0.0;

impl<const OPACITY: bool, I: Inside> PathTracer<'_, OPACITY, I> {
    /// What a camera ray sees first, with the random numbers of a sample or, without, one for all samples.
    pub(super) fn seen(
        &self,
        camera_ray: &CameraRay,
        sampler: Option<&Sampler>,
        rays: &mut u64,
    ) -> Seen {
        let SceneView { geometry, surfaces, camera, .. } = self.scene;
        let (mut ray, mut cone) = (camera_ray.ray, self.pixel);
        let mut inside = self.start(&ray);
        // What is found wrong is counted on the paths.
        let mut faults = NestingFaults::default();
        let mut met = 0;
        loop {
            *rays += 1;
            let Some(hit) = geometry.closest_hit(&ray, f64::INFINITY, true) else {
                let film = |time: f32| camera.project_direction(ray.d.as_dvec3(), time);
                return Seen { first_hit: None, motion: between(film(0.0), film(1.0)) };
            };
            cone.advance(hit.t);
            let meeting = self.scene.nested().meet(&ray, hit, &mut inside, &mut faults);
            let passed = match meeting {
                Meeting::Nothing { surface, beyond } => {
                    inside = beyond;
                    surface
                }
                Meeting::Surface { hit, mut surface, mut beyond, outside } => {
                    let dimensions = dimension::vertex(met);
                    met += 1;
                    let number = |which| sampler.map_or(MIDDLE, |s| s.one(dimensions + which));
                    let material = geometry.instances[hit.instance as usize].material;
                    let at = geometry.texture_point_in(cone, &ray, &hit, &surface);
                    let stops = !OPACITY || material == NOTHING || {
                        let u = || number(dimension::ROULETTE);
                        surfaces.materials.stopped(material, &at, u).is_some()
                    };
                    if stops {
                        let bsdf = (material != NOTHING).then(|| {
                            let sides = [&mut inside, &mut beyond];
                            let media = (material, outside);
                            let medium = match sampler {
                                Some(sampler) => {
                                    let mut throughput = Vec3::ONE;
                                    self.disperse(media, sides, &mut throughput, sampler)
                                }
                                None => (outside, None),
                            };
                            let mut lobe = if surfaces.materials.needs_lobe(material) {
                                number(dimension::LOBE)
                            } else {
                                0.0
                            };
                            let seen = (&ray, cone);
                            let chosen = self.choose(seen, &hit, &mut surface, &at, &mut lobe);
                            self.bsdf(chosen, &at, medium)
                        });
                        return self.seen_at(camera_ray, &ray, &hit, &surface, bsdf.as_ref());
                    }
                    surface
                }
            };
            ray.o = offset_ray_origin(passed.p, passed.p_error, passed.ng, ray.d);
        }
    }

    /// What the layers say of the surface that was met.
    fn seen_at(
        &self,
        camera_ray: &CameraRay,
        ray: &Ray,
        hit: &Hit,
        surface: &SurfacePoint,
        bsdf: Option<&Bsdf>,
    ) -> Seen {
        let scene = &self.scene;
        let normal = if surface.ns.dot(ray.d) > 0.0 { -surface.ns } else { surface.ns };
        let depth = (surface.p - camera_ray.ray.o.as_dvec3()).dot(camera_ray.axis);
        let albedo = bsdf.map_or(Vec3::ZERO, |bsdf| bsdf.albedo(surface.frame().to_local(-ray.d)));
        let film = |time: f32| scene.camera.project(scene.geometry.point_at(ray, hit, time), time);
        let first_hit = FirstHit {
            albedo,
            normal,
            depth: depth as f32,
            position: surface.p + self.origin,
            object_id: scene.geometry.instances[hit.instance as usize].object_id,
        };
        Seen { first_hit: Some(first_hit), motion: between(film(0.0), film(1.0)) }
    }
}

/// From place to place on the film; nothing where one of them is behind the camera.
fn between(from: Option<DVec2>, to: Option<DVec2>) -> Vec2 {
    match (from, to) {
        (Some(from), Some(to)) => (to - from).as_vec2(),
        _ => Vec2::ZERO,
    }
}

/// Puts into a film that wants it what is seen at the centres of its pixels; returns how many rays that took.
pub(super) fn fill_centres<const OPACITY: bool, I: Inside>(
    film: &mut Film,
    tracer: &PathTracer<OPACITY, I>,
) -> u64 {
    if !film.wants_centres() {
        return 0;
    }
    let tiles = film.tiles();
    let film = Mutex::new(film);
    let lock = || film.lock().unwrap_or_else(PoisonError::into_inner);
    let fill = |tile: Tile| {
        let mut rays = 0;
        let mut buffer = lock().tile_buffer(tile);
        for (y, x) in (tile.y0..tile.y1).flat_map(|y| (tile.x0..tile.x1).map(move |x| (y, x))) {
            let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let ray = tracer.scene.camera.ray_through_centre(centre, OPENING);
            buffer.add_centre(x, y, &tracer.seen(&ray, None, &mut rays));
        }
        lock().merge(buffer);
        rays
    };
    tiles.into_par_iter().map(fill).sum()
}

#[cfg(test)]
mod tests {
    use crate::description::{Layer, LoadOptions, parse_scene_str};
    use crate::film::{Film, PlaneSamples};
    use crate::frame::{RenderControl, Simulation};

    fn film(text: &str) -> Film {
        let scene = parse_scene_str("test.ron", text, None, &LoadOptions::default());
        let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
        let frame = Simulation::from_description(&scene).render_frame(0, &RenderControl::default());
        frame.unwrap_or_else(|error| panic!("{error}")).film
    }

    fn numbers(film: &Film, layer: Layer, channel: usize) -> Vec<f32> {
        match &film.image(layer).expect("asked for")[channel].samples {
            PlaneSamples::F32(values) => values.clone(),
            PlaneSamples::U32(_) => panic!("{layer:?} holds integers"),
        }
    }

    fn ids(film: &Film) -> Vec<u32> {
        match &film.image(Layer::ObjectId).expect("asked for")[0].samples {
            PlaneSamples::U32(values) => values.clone(),
            PlaneSamples::F32(_) => panic!("ids are integers"),
        }
    }

    /// Thick fog before a wall, 5 m from the camera, and a mask of opacity 0.3 before all of it.
    fn fog(settings: &str, more: &str) -> String {
        format!(
            r#"(
    render: (size: (8, 8), samples: 4, layers: [Albedo, Normal, Depth, Position, Motion, ObjectId], {settings}),
    materials: {{
        "fog": Dielectric(ior: 1, scattering: Some((coefficient: (20, 20, 20)))),
        "net": Masked(material: "white", opacity: 0.3), "white": Diffuse(),
    }},
    entities: {{
        "camera": (transform: (translation: (0, 0, 5)), camera: (orthographic: 1)),
        "wall": (shape: Rectangle(size: (9, 9)), material: "white"),
        "ball": (transform: (translation: (0, 0, 2)), shape: Sphere(radius: 1), material: "fog"),
        "net": (transform: (translation: (0, 0, 4)), shape: Rectangle(size: (9, 9)), material: "net"),
        "lamp": (transform: (translation: (0, 3, 4), rotation: (45, 0, 0)), shape: Disk(radius: 0.5), emission: Radiance(9)),
        {more}
    }},
)"#
        )
    }

    /// Oracles: the plan of the scene, and that the way light is simulated changes nothing that is seen, to the bit: neither
    /// what is at the centre nor, at rest, the means over samples.
    #[test]
    fn layers_do_not_depend_on_the_integrator() {
        for filter in ["Center", "Mean"] {
            let with = |integrator: &str| {
                film(&fog(&format!("layer_filter: {filter}, integrator: {integrator}"), ""))
            };
            let path = with("Path");
            if filter == "Center" {
                let depth = numbers(&path, Layer::Depth, 0);
                assert!(depth.iter().all(|d| (d - 5.0).abs() < 1e-5), "{depth:?}");
            }
            for other in ["Path, caustics: Photons", "Sppm", "PhotonMap"] {
                let other = with(other);
                for layer in
                    Layer::ALL.into_iter().filter(|l| *l == Layer::Albedo || l.is_geometry())
                {
                    assert_eq!(path.image(layer), other.image(layer), "{filter} {layer:?}");
                }
            }
        }
    }

    /// Numbers stay when an object comes which is not seen and stands before all others in the order of names.
    #[test]
    fn an_unseen_object_shifts_no_number() {
        let wall = |more: &str| ids(&film(&fog("integrator: Path", more)));
        let alone = wall("");
        assert!(alone.iter().all(|id| *id == alone[0] && *id != 0), "{alone:?}");
        let more = r#""a": (transform: (translation: (0, 0, 90)), shape: Sphere(radius: 1)), "b": (light: Sky(radiance: 1)),"#;
        assert_eq!(alone, wall(more));
    }

    /// A disk before a wall: every depth at the centres is one of the two; a mean over samples is between them at the edge.
    #[test]
    fn a_depth_at_the_centre_is_that_of_one_object() {
        let depths = |filter: &str| {
            let text = format!(
                r#"(
    render: (size: (16, 16), samples: 16, layers: [Depth, ObjectId], layer_filter: {filter}),
    entities: {{
        "camera": (transform: (translation: (0, 0, 5)), camera: (aperture: 0.05, focus: 3)),
        "wall": (shape: Rectangle(size: (99, 99))),
        "disk": (transform: (translation: (0, 0, 2)), shape: Disk(radius: 0.5)),
    }},
)"#
            );
            let film = film(&text);
            let depths = numbers(&film, Layer::Depth, 0);
            let between = depths.iter().filter(|d| (**d - 3.0).abs().min((**d - 5.0).abs()) > 1e-4);
            let between = between.count();
            (between, depths, ids(&film))
        };
        let (between, depths_at_centres, ids) = depths("Center");
        assert_eq!(between, 0);
        assert!(depths("Mean").0 > 10);
        let near = |k: &usize| depths_at_centres[*k] < 4.0;
        let disk: Vec<usize> = (0..256).filter(near).collect();
        assert!(disk.iter().all(|k| ids[*k] == ids[disk[0]]));
        // Closed form: a circle of radius 0.5 m at 3 m in a picture 2·3·tan 20° = 2.184 m high: 16/2.184 pixels per metre.
        assert!((disk.len() as f64 - 42.2).abs() < 8.0, "{}", disk.len());
    }

    /// Closed form: a direction at the angle θ to the axis is at 32·(1 + tan θ) of 64 pixels. The camera turns to the left
    /// by 1° in the shutter, so that the sky goes to the right by 0.558 pixels in the middle; the same for what stands far away.
    #[test]
    fn the_sky_moves_against_a_panning_camera() {
        for filter in ["Center", "Mean"] {
            let text = format!(
                r#"(
    clock: (fps: 24, shutter: (0, 1)),
    render: (size: (64, 64), samples: 4, layers: [Motion], layer_filter: {filter}, filter: Box()),
    entities: {{
        "camera": (velocity: (angular: (0, 24, 0)), camera: (fov: 90)),
        "far": (transform: (translation: (0, 900, -1000)), shape: Rectangle(size: (2000, 900))),
    }},
)"#
            );
            let film = film(&text);
            let motion = numbers(&film, Layer::Motion, 0);
            for row in [8, 40] {
                // A pixel is at tan θ = (x + 0.5 − 32)/32, whatever its height.
                for x in [10_usize, 31, 32, 50] {
                    let tan = (x as f64 + 0.5 - 32.0) / 32.0;
                    let turned = (tan.atan() + 1_f64.to_radians()).tan();
                    let expected = 32.0 * (turned - tan);
                    let found = f64::from(motion[row * 64 + x]);
                    let tolerance = if filter == "Center" { 1e-4 } else { 0.02 };
                    assert!((found - expected).abs() < tolerance, "{x} {row}: {found} {expected}");
                }
            }
        }
    }
}
