//! What a scene requires, found by preparing some of its frames without rendering them.

use super::failure::Failure;
use bevy_ecs::prelude::With;
use kinora::description::{Diagnostics, SceneDescription};
use kinora::extract::{Displaced, Requirements};
use kinora::frame::Simulation;
use kinora::world::{Name, Views};

/// What was found at the frames looked at.
pub struct Survey {
    /// The first frame, the middle one and the last: what happens only between them is not seen.
    pub frames: Vec<i32>,
    /// Each feature once, in words, and what asks for it.
    pub features: Vec<(String, String)>,
    /// The integrator that will run, and why.
    pub integrator: String,
    /// Meshes that are divided for the camera: their names, triangles and bytes.
    pub diced: Vec<(String, usize, usize)>,
    /// Bytes that a frame takes, by what holds them: the most of the frames looked at.
    pub memory: Vec<(&'static str, u64)>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl Survey {
    pub fn new(scene: &SceneDescription) -> Result<Self, Failure> {
        let (first, last) = scene.clock.frames;
        let mut frames = vec![first, first + last.saturating_sub(first) / 2, last];
        frames.dedup();
        let mut simulation = Simulation::from_description(scene);
        let (mut found, mut warnings) = (Vec::new(), Vec::new());
        let mut memory = Vec::new();
        for &frame in &frames {
            let prepared = simulation.prepare_frame(frame);
            prepared.map_err(|error| Failure::Scene(error.into()))?;
            for (feature, reason) in &simulation.world().resource::<Requirements>().features {
                found.push((frame, words(&format!("{feature:?}")), reason.clone()));
            }
            let taken = simulation.memory();
            memory = [memory, taken].into_iter().max_by_key(|taken| sum(taken)).unwrap_or_default();
            for warning in simulation.warnings() {
                if !warnings.contains(&warning) {
                    warnings.push(warning);
                }
            }
        }
        let features = union(&frames, found);
        let (diced, integrator) = (diced(&mut simulation), simulation.integrator());
        Ok(Self { frames, features, integrator, diced, memory, warnings })
    }
}

/// Bytes of all together.
pub fn sum(memory: &[(&'static str, u64)]) -> u64 {
    memory.iter().map(|(_, bytes)| bytes).sum()
}

/// What was divided for the camera, in the order of the names.
fn diced(simulation: &mut Simulation) -> Vec<(String, usize, usize)> {
    let world = simulation.world_mut();
    let mut diced = world.query_filtered::<(&Name, &Displaced), With<Views>>();
    let told = |(name, displaced): (&Name, &Displaced)| {
        (name.as_str().to_owned(), displaced.mesh.triangles.len(), displaced.memory())
    };
    let mut diced: Vec<_> = diced.iter(world).map(told).collect();
    diced.sort();
    diced
}

/// Each feature once, with its first reason, and with the frame where it is not required at all of
/// them.
fn union(frames: &[i32], found: Vec<(i32, String, String)>) -> Vec<(String, String)> {
    let mut union: Vec<(String, String)> = Vec::new();
    for (frame, feature, reason) in &found {
        if union.iter().any(|(known, _)| known == feature) {
            continue;
        }
        let everywhere = found.iter().filter(|(_, other, _)| other == feature).count();
        let reason = if everywhere == frames.len() {
            reason.clone()
        } else {
            format!("{reason} (frame {frame})")
        };
        union.push((feature.clone(), reason));
    }
    union
}

/// `CameraMotion` as `camera motion`.
fn words(name: &str) -> String {
    let mut words = String::new();
    for letter in name.chars() {
        if letter.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(letter.to_lowercase());
    }
    words
}

/// What the reader of the scene found suspicious, each with its excerpt.
///
/// That a scene has no light is left to the renderer, which says so of worlds without a file as well.
pub fn scene_warnings(scene: &SceneDescription, styled: bool) -> Vec<String> {
    let suspicious = scene.warnings.0.iter().filter(|warning| warning.code != "scene::dark");
    suspicious
        .map(|warning| Diagnostics(vec![warning.clone()]).render(styled).trim_end().to_owned())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinora::description::{LoadOptions, parse_scene_str};

    fn survey(text: &str) -> Survey {
        let scene = parse_scene_str("test.ron", text, None, &LoadOptions::default());
        let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
        Survey::new(&scene).unwrap_or_else(|failure| panic!("{failure}"))
    }

    /// The ball stands still while the first frame is taken, and moves in the middle one.
    #[test]
    fn what_moves_only_in_the_middle_is_seen_and_its_frame_is_named() {
        let found = survey(
            r#"(clock: (frames: (0, 24)), entities: {
                "eye": (transform: (translation: (0, 0, 4)), camera: (aperture: 0.1, focus: 4)),
                "ball": (shape: Sphere(), emission: Radiance(1), keyframes: (translation: (keys: [
                    (0.25, (0, 0, 0)), (0.75, (1, 0, 0)),
                ]))),
            })"#,
        );
        assert_eq!(found.frames, [0, 12, 24]);
        let names: Vec<&str> = found.features.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["lens", "motion"]);
        assert!(!found.features[0].1.contains("frame"), "the lens is always there");
        let motion = &found.features[1].1;
        assert!(motion.contains("`ball`") && motion.ends_with("(frame 12)"), "{motion}");
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    }

    /// Closed form: an edge of 1 m at 2 m, where a pixel of 100 in 90° is at least 2·2/100/√3 m.
    #[test]
    fn what_is_diced_is_counted() {
        let found = survey(
            r#"(render: (size: (100, 100), dicing: 44), textures: {"t": Gradient()},
            meshes: {"flat": Grid(size: (1, 1), cells: (1, 1)),
                "fine": Displaced(of: "flat", height: "t", strength: 0, adaptive: true),
                "coarse": Displaced(of: "flat", height: "t", strength: 0)},
            entities: {
                "eye": (transform: (translation: (0, 0, 2)), camera: (fov: 90)),
                "one": (shape: Mesh("fine")), "two": (shape: Mesh("coarse")),
                "sky": (light: Sky(radiance: 1))})"#,
        );
        // The sides span 41 pixels, the diagonal 58: it is divided, its halves are not.
        let names: Vec<_> =
            found.diced.iter().map(|(name, triangles, _)| (name.as_str(), *triangles)).collect();
        assert_eq!(names, [("fine", 4)]);
    }

    #[test]
    fn a_dark_scene_is_warned_of_once() {
        let found = survey(r#"(clock: (frames: (3, 9)), entities: {"eye": (camera: ())})"#);
        assert_eq!(found.warnings.len(), 1, "{:?}", found.warnings);
        assert!(found.features.is_empty());
    }
}
