//! Which integrator takes a frame, and which paths of it that integrator cannot find.

use super::caustic_noise::{CausticFacts, CausticNoise};
use super::{
    Emissions, Feature, Geometry, Instance, Instances, NOTHING, PunctualLights, Requirements,
    Surfaces,
};
use crate::description::{Caustics, IntegratorChoice, Light, RenderSettings};
use crate::shape::Primitive;
use crate::world::Settings;
use bevy_ecs::prelude::*;

/// From this relative variance of caustics on photons bring them: it is that of all else on a path. The decision
/// note `auto.md` has the measurements.
const NOISE_FOR_PHOTONS: f64 = 1.0;
/// Passes below which what moves looks like under a stroboscope, since all of a pass has one time. Caustics of this
/// relative variance are not found even by so many paths: then a stroboscope is the lesser evil.
const PASSES_FOR_MOTION: u32 = 64;

/// The integrators as they are run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Method {
    /// Path tracing.
    #[default]
    Path,
    /// Path tracing, the caustics from photons.
    PathWithPhotons,
    /// Photon mapping in two passes.
    PhotonMap,
    /// Stochastic progressive photon mapping.
    Sppm,
}

impl Method {
    /// Whether photons are traced.
    pub fn has_photons(self) -> bool {
        self != Self::Path
    }

    /// Whether photons bring all that is lit at second hand: what no photons start from lights nothing then.
    pub(crate) fn lights_by_photons(self) -> bool {
        matches!(self, Self::PhotonMap | Self::Sppm)
    }

    /// Its name, as the record of a run has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "Path",
            Self::PathWithPhotons => "Path with photon caustics",
            Self::PhotonMap => "PhotonMap",
            Self::Sppm => "Sppm",
        }
    }
}

/// The integrator of this frame.
#[derive(Resource, Clone, Debug, Default, PartialEq, Eq)]
pub struct ChosenIntegrator {
    /// Which.
    pub method: Method,
    /// For `Auto`, why.
    pub reason: Option<String>,
    /// What it cannot find, in words for the user.
    pub warnings: Vec<String>,
}

impl ChosenIntegrator {
    /// The integrator, and for `Auto` why it is taken.
    pub fn description(&self) -> String {
        match &self.reason {
            None => self.method.name().to_owned(),
            Some(reason) => format!("{} (Auto takes it: {reason})", self.method.name()),
        }
    }
}

/// What decides for `Auto`.
struct Facts<'a> {
    settings: &'a RenderSettings,
    requirements: &'a Requirements,
    /// Lights without any extent.
    points: usize,
    /// Emitting planes, which photons cannot start from.
    planes: usize,
    /// Relative variance of caustics on a path.
    noise: CausticNoise,
}

impl Facts<'_> {
    /// The integrator which suits the scene, and why.
    fn automatic(&self) -> (Method, String) {
        let &Self { settings, requirements, points, planes, noise } = self;
        let by_photons = if requirements.has(Feature::Caustics) { noise.for_photons } else { 0.0 };
        let all = by_photons + noise.others;
        if all == 0.0 {
            return (Method::Path, "nothing casts caustics".to_owned());
        }
        if by_photons == f64::INFINITY {
            let what = if points == 1 { "a point-like light" } else { "point-like lights" };
            return (Method::PathWithPhotons, format!("paths cannot find the caustics of {what}"));
        }
        let compared = format!("{all:.2} times as noisy as all else");
        if all < NOISE_FOR_PHOTONS {
            return (
                Method::Path,
                format!(
                    "caustics are {compared}, by the size and the roughness of what casts them and the sizes of the \
                     lamps"
                ),
            );
        }
        if by_photons < NOISE_FOR_PHOTONS {
            return (
                Method::Path,
                format!(
                    "caustics are {compared}, but of what is so rough, or a coat, photons bring none"
                ),
            );
        }
        let noise = by_photons;
        if planes > 0 {
            return (Method::Path, "photons cannot start from emitting planes".to_owned());
        }
        let found_by_paths = noise < f64::from(PASSES_FOR_MOTION);
        if requirements.need_time() && settings.samples < PASSES_FOR_MOTION && found_by_paths {
            return (
                Method::Path,
                format!(
                    "with caustics from photons every pass has one time, and {} passes are too few for what moves",
                    settings.samples
                ),
            );
        }
        (Method::PathWithPhotons, format!("without photons caustics would be {compared}"))
    }
}

/// Whether the integrator knows all that the frame requires: no photons start inside what glows, and `Sppm` and
/// `PhotonMap` have all that it lights from them.
pub(crate) fn method_suffices(
    chosen: Res<ChosenIntegrator>,
    requirements: Res<Requirements>,
) -> bool {
    !(chosen.method.lights_by_photons() && requirements.has(Feature::GlowingSolids))
}

/// Writes [`ChosenIntegrator`] when it is different from before.
#[expect(clippy::too_many_arguments, reason = "the signature lists what the choice depends on")]
pub fn choose_integrator(
    settings: Res<Settings>,
    requirements: Res<Requirements>,
    instances: Res<Instances>,
    lights: Res<PunctualLights>,
    emissions: Res<Emissions>,
    surfaces: Res<Surfaces>,
    mut facts: Local<CausticFacts>,
    mut chosen: ResMut<ChosenIntegrator>,
) {
    if surfaces.is_changed() || settings.is_changed() {
        facts.clear();
    }
    let settings = &settings.0;
    let min_alpha = settings.photons.min_alpha();
    let (points, planes) = (count_points(&lights), count_planes(&instances));
    let caustics = requirements.has(Feature::Caustics);
    let (method, reason) = match (settings.integrator, settings.caustics) {
        (IntegratorChoice::Path, Caustics::Traced) => (Method::Path, None),
        (IntegratorChoice::Path, Caustics::Photons) => (Method::PathWithPhotons, None),
        (IntegratorChoice::PhotonMap, _) => (Method::PhotonMap, None),
        (IntegratorChoice::Sppm, _) => (Method::Sppm, None),
        (IntegratorChoice::Auto, _) => {
            let noise = facts.noise(&instances, &lights.0, &emissions, &surfaces, min_alpha);
            let requirements = &requirements;
            let facts = Facts { settings, requirements, points, planes, noise };
            let (method, reason) = facts.automatic();
            (method, Some(reason))
        }
    };
    let mut warnings = Vec::new();
    let out_of_reach = method == Method::Path && caustics && points > 0;
    if out_of_reach && facts.has_mirrors(&instances, &surfaces.materials, min_alpha) {
        warnings.push(format!(
            "paths from {points} point-like lights over mirrors or through glass are out of reach of \
             `Path`: their caustics and what stands behind glass stay dark; use `caustics: Photons`, \
             `Sppm`, or give the light a size"
        ));
    }
    if method.has_photons() {
        warnings.extend(beyond_photons(method, &requirements, &instances, &lights, &surfaces));
    }
    chosen.set_if_neq(ChosenIntegrator { method, reason, warnings });
}

/// What neither photons nor paths find of the light that comes from infinitely far away to planes without an end.
fn beyond_photons(
    method: Method,
    requirements: &Requirements,
    instances: &Instances,
    lights: &PunctualLights,
    surfaces: &Surfaces,
) -> Option<String> {
    let is_far =
        |light: &Light<u32>| matches!(light, Light::Directional { .. } | Light::Sky { .. });
    let is_sharp = |light: &Light<u32>| matches!(light, Light::Directional { angle: 0.0, .. });
    let any = |kind: fn(&Light<u32>) -> bool| lights.0.iter().any(|l| kind(&l.light));
    let planes: Vec<&Instance> =
        instances.list.iter().filter(|i| !i.bounds.min.is_finite()).collect();
    if planes.is_empty() || !any(is_far) {
        return None;
    }
    let casts = |plane: &&Instance| {
        let material = plane.material;
        // Lobes of any width are found by paths.
        material != NOTHING && surfaces.materials.may_cast_caustics(material, f32::MIN_POSITIVE)
    };
    if any(is_sharp) && planes.len() > 1 && planes.iter().any(casts) {
        return Some(
            "a `Directional` light without an angle meets a smooth `Plane`: what that sends on to another `Plane` far from \
             all else stays dark; use a `Rectangle` in place of the smooth `Plane`"
                .to_owned(),
        );
    }
    (method.lights_by_photons() && requirements.has(Feature::Scattering)).then(|| {
        format!(
            "what a `Plane` far from all else sends into fog is not seen by `{}`; use `Path`, or a `Rectangle` in place \
             of the `Plane`",
            method.name()
        )
    })
}

/// Lights without any extent.
fn count_points(lights: &PunctualLights) -> usize {
    let is_point = |light: &Light<u32>| {
        matches!(
            light,
            Light::Point { .. } | Light::Spot { .. } | Light::Directional { angle: 0.0, .. }
        )
    };
    lights.0.iter().filter(|l| is_point(&l.light)).count()
}

/// Planes which emit.
fn count_planes(instances: &Instances) -> usize {
    let plane = Geometry::Primitive(Primitive::Plane);
    let emits = |instance: &&Instance| instance.emission != NOTHING && instance.geometry == plane;
    instances.list.iter().filter(emits).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{LoadOptions, parse_scene_str};
    use crate::frame::Simulation;

    /// What `Auto` takes for a ball of glass and a lamp of one metre squared over a floor, all `scale` times as large.
    fn taken(radius: f32, scale: f32, samples: u32, motion: &str, more: &str) -> Method {
        let (r, s, h) = (radius * scale, scale, 2.0 * scale);
        let text = format!(
            r#"(
            render: (samples: {samples}),
            materials: {{"white": Diffuse(albedo: 0.6), "glass": Dielectric(ior: 1.5)}},
            entities: {{
                "camera": (transform: (translation: (0, {h}, {h}), look_at: (0, 0, 0)), camera: ()),
                "floor": (transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: ({h}, {h})), material: "white"),
                "ball": (transform: (translation: (0, {s}, 0)), shape: Sphere(radius: {r}), material: "glass" {motion}),
                "lamp": (transform: (translation: (0, {h}, 0), rotation: (90, 0, 0)), shape: Rectangle(size: ({s}, {s})), emission: Radiance((5, 5, 5))),
                {more}
            }})"#
        );
        let scene = parse_scene_str("auto.ron", &text, None, &LoadOptions::default());
        let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
        let mut simulation = Simulation::from_description(&scene);
        simulation.prepare_frame(0).expect("a camera");
        simulation.world().resource::<ChosenIntegrator>().method
    }

    /// Oracle: the boxes of the ball and of the lamp have the areas 24·r² and 2: equal for r = 0.2887.
    #[test]
    fn auto_takes_photons_where_what_casts_caustics_is_larger_than_the_lamp() {
        for scale in [1e-3, 1.0, 1e3] {
            assert_eq!(taken(0.28, scale, 64, "", ""), Method::Path, "{scale}");
            assert_eq!(taken(0.3, scale, 64, "", ""), Method::PathWithPhotons, "{scale}");
        }
    }

    /// Another lamp.
    fn second(side: f32, radiance: f32) -> String {
        format!(
            r#""second": (transform: (translation: (0.9, 1.9, 0)), shape: Rectangle(size: ({side}, {side})), emission: Radiance(({radiance}, {radiance}, {radiance}))),"#
        )
    }

    /// With a second lamp of area `a` and radiance `L` the sums are `2·5² + 2a·L²` and `2·5 + 2a·L`: what is as bright
    /// adds to the area, what is dim changes nothing, a bright spark decides.
    #[test]
    fn lamps_count_by_what_they_contribute() {
        for (second, expected) in [
            (second(0.01, 5.0), Method::Path),
            (second(0.01, 0.1), Method::Path),
            // 1.88·(50 + 2e-4·1e10)/(10 + 2e-4·1e5)² = 4200
            (second(0.01, 1e5), Method::PathWithPhotons),
        ] {
            assert_eq!(taken(0.28, 1.0, 64, "", &second), expected, "{second}");
        }
        // As large and as bright: half of the noise.
        assert_eq!(taken(0.3, 1.0, 64, "", &second(1.0, 5.0)), Method::Path);
    }

    #[test]
    fn points_planes_and_motion_have_their_own_rules() {
        let point = r#""bulb": (transform: (translation: (0, 1.9, 0.5)), light: Point(intensity: Some((1, 1, 1)))),"#;
        assert_eq!(taken(0.1, 1.0, 64, "", point), Method::PathWithPhotons);
        let plane = r#""glow": (transform: (translation: (0, -1, 0)), shape: Plane(), emission: Radiance((1, 1, 1))),"#;
        assert_eq!(taken(0.5, 1.0, 64, "", plane), Method::Path);
        let moving = ", velocity: (linear: (1, 0, 0))";
        assert_eq!(taken(0.5, 1.0, 63, moving, ""), Method::Path);
        assert_eq!(taken(0.5, 1.0, 64, moving, ""), Method::PathWithPhotons);
        assert_eq!(taken(0.5, 1.0, 4, "", ""), Method::PathWithPhotons);
        assert_eq!(taken(0.5, 1.0, 4, moving, &second(0.01, 1e5)), Method::PathWithPhotons);
    }

    /// What `Auto` takes for something of this material on a floor in this light, and why; how many times as noisy its caustics
    /// are said to be, and how often the user is warned.
    fn judged(material: &str, textures: &str, light: &str) -> (Method, f64, usize) {
        let text = format!(
            r#"(
            textures: {{ {textures} }},
            materials: {{ "caster": {material}, "floor": Diffuse() }},
            entities: {{
                "camera": (transform: (translation: (0, 6, 7), look_at: (0, 0, 0)), camera: ()),
                "floor": (transform: (rotation: (-90, 0, 0)), shape: Disk(radius: 3), material: "floor"),
                "caster": (transform: (translation: (0, 0.5, 0)), shape: Box(), material: "caster"),
                "light": (transform: (translation: (3, 4, 2), look_at: (0, 0, 0)), {light}),
            }})"#
        );
        let scene = parse_scene_str("auto.ron", &text, None, &LoadOptions::default());
        let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
        let mut simulation = Simulation::from_description(&scene);
        simulation.prepare_frame(0).expect("a camera");
        let chosen = simulation.world().resource::<ChosenIntegrator>();
        let reason = chosen.reason.as_deref().expect("from Auto");
        let number = |word: &str| word.parse::<f64>().ok();
        let noise = reason.split(' ').find_map(number).unwrap_or(0.0);
        (chosen.method, noise, chosen.warnings.len())
    }

    const SUN: &str = "light: Directional(irradiance: (3, 3, 3), angle: 0.53)";

    fn gold(roughness: f32) -> String {
        format!("Conductor(metal: Gold, roughness: {roughness})")
    }

    /// Oracle: the variance measured in pictures of this box by `Path`, over that of the picture with a black box; the
    /// estimate is within a factor of two, and nothing jumps where photons stop to be gathered apart.
    #[test]
    fn the_noise_of_caustics_falls_with_the_roughness_of_what_casts_them() {
        for (roughness, measured) in
            [(0.2, 3.81), (0.3, 0.911), (0.39, 0.302), (0.41, 0.244), (0.6, 0.0452)]
        {
            let (_, noise, _) = judged(&gold(roughness), "", SUN);
            assert!(noise > 0.5 * measured && noise < 2.0 * measured, "{roughness}: {noise}");
        }
        let at = |roughness| judged(&gold(roughness), "", SUN).1;
        assert!(at(0.399) / at(0.401) < 1.05);
        assert!(at(0.0) > 1000.0);
    }

    /// A sun makes caustics noisy also where it is kept in the texture of a sky, here as a bright lune of 1/500 of all directions:
    /// by closed form the mean square over the squared mean is 0.002·9·10⁸/61² = 484. An even sky does not.
    #[test]
    fn a_sun_in_a_sky_weighs_as_a_sun() {
        let sky =
            |bright: f32| format!("\"sky\": Stripes(size: 1, share: 0.002, a: {bright}, b: 1)");
        let light = "light: Sky(radiance: \"sky\")";
        let (even, low, _) = judged("Dielectric()", &sky(1.0), light);
        let (bright, high, _) = judged("Dielectric()", &sky(3e4), light);
        assert_eq!((even, bright), (Method::Path, Method::PathWithPhotons));
        assert!(low < 0.2 && high > 300.0 * low && high < 600.0 * low, "{low} {high}");
    }

    /// The gloss of what has a diffuse base is gathered along with the base: it casts nothing that photons bring, and nothing
    /// is out of reach. Mirrors and bare polished metal are; metal rough enough for paths to draw the light is not.
    #[test]
    fn only_what_casts_caustics_worth_having_counts() {
        let point = "light: Point(intensity: (20, 20, 20))";
        for (material, expected) in [
            ("Principled(roughness: 0.2)", Method::Path),
            ("Principled(roughness: 0)", Method::Path),
            ("Plastic(roughness: 0)", Method::Path),
            ("Principled(roughness: 0.6, metallic: 1)", Method::Path),
            ("Principled(roughness: 0, metallic: 1)", Method::PathWithPhotons),
            ("Principled(roughness: 0, transmission: 1)", Method::PathWithPhotons),
            ("Mirror()", Method::PathWithPhotons),
            ("Dielectric()", Method::PathWithPhotons),
        ] {
            let (method, _, warnings) = judged(material, "", point);
            assert_eq!(method, expected, "{material}");
            assert_eq!(warnings, 0, "{material}");
        }
    }
}
