//! What a scene requires, with the reason; everything else is left out of the work.

use super::{
    Emissions, Instances, Meshes, NOTHING, PunctualLight, PunctualLights, Surfaces, ViewCamera,
    may_enclose, overlapping_pairs, solids,
};
use crate::description::{Light, Rgb, Value};
use crate::math::Aabb;
use crate::shade::MaterialTable;
use crate::world::{Deformation, Name, Settings, Shape, ShutterMotion, VertexMotion};
use bevy_ecs::prelude::*;

/// Something that a scene may require.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Feature {
    /// Objects or lights which move within the shutter.
    Motion,
    /// A camera which moves, turns or zooms within the shutter.
    CameraMotion,
    /// A lens with an aperture.
    Lens,
    /// Meshes whose vertices move within the shutter.
    Deformation,
    /// Textures which drift while the shutter is open.
    TextureMotion,
    /// Surfaces with holes.
    Opacity,
    /// Solids which absorb light inside.
    Absorption,
    /// Solids which may overlap, or absorb around the camera or a light: rays must know all that they
    /// are inside of.
    NestedDielectrics,
    /// Solids whose index of refraction depends on the wavelength: paths must know theirs, and what they are inside of.
    Dispersion,
    /// Solids which scatter light inside, or glow.
    Scattering,
    /// Solids which glow inside.
    GlowingSolids,
    /// Solids whose inside is denser here than there.
    UnevenDensity,
    /// Smooth solids of index 1, such as fog: what is inside matters, and their surfaces are none.
    InvisibleSurfaces,
    /// Spectra: paths must carry wavelengths in place of red, green and blue.
    Spectra,
    /// Light from all around.
    Sky,
    /// Light which reaches diffuse surfaces or media through mirrors or glass.
    Caustics,
}

/// What the scene of this frame requires.
#[derive(Resource, Clone, Debug, Default, PartialEq, Eq)]
pub struct Requirements {
    /// Each feature once, with what asks for it.
    pub features: Vec<(Feature, String)>,
}

impl Requirements {
    /// Whether a feature is required.
    pub fn has(&self, feature: Feature) -> bool {
        self.features.iter().any(|(f, _)| *f == feature)
    }

    /// Whether anything is different at another time of the shutter.
    pub fn need_time(&self) -> bool {
        [Feature::Motion, Feature::CameraMotion, Feature::Deformation, Feature::TextureMotion]
            .into_iter()
            .any(|feature| self.has(feature))
    }

    /// Whether paths must know all that can matter in solids: [`Whole`](crate::shade::nesting::Whole).
    pub fn need_whole(&self) -> bool {
        [Feature::Dispersion, Feature::Scattering, Feature::InvisibleSurfaces]
            .into_iter()
            .any(|feature| self.has(feature))
    }
}

/// How many objects are made of materials of a kind.
#[derive(Debug, Default)]
pub struct Census {
    masked: usize,
    absorbing: usize,
    solid: usize,
    dispersive: usize,
    scattering: usize,
    glowing: usize,
    uneven: usize,
    spectral: usize,
    invisible: usize,
    /// Those which cast caustics worth having, and those on which photons may be gathered.
    specular: usize,
    storable: usize,
}

impl Census {
    /// Counts the objects; each material is looked at once.
    fn take(instances: &Instances, surfaces: &Surfaces, min_alpha: f32) -> Self {
        let mut objects = vec![0; surfaces.default_material as usize + 1];
        for instance in &instances.list {
            if let Some(count) = objects.get_mut(instance.material as usize) {
                *count += 1;
            }
        }
        let materials = &surfaces.materials;
        let mut census = Self::default();
        for (material, count) in (0..).zip(objects).filter(|(_, count)| *count > 0) {
            census.masked += if materials.has_opacity(material) { count } else { 0 };
            census.absorbing += if materials.attenuation(material).is_some() { count } else { 0 };
            census.solid += if materials.is_dielectric(material) { count } else { 0 };
            census.dispersive += if materials.disperses(material) { count } else { 0 };
            let medium = materials.medium(material);
            census.scattering += if medium.is_some() { count } else { 0 };
            let glows = medium.is_some_and(|medium| medium.emission != Rgb::ZERO);
            census.glowing += if glows { count } else { 0 };
            census.spectral += if materials.has_spectrum(material) { count } else { 0 };
            let uneven = materials.interior(material).is_some_and(|i| i.density.is_some());
            census.uneven += if uneven { count } else { 0 };
            let invisible = materials.is_invisible(material, None);
            census.invisible += if invisible { count } else { 0 };
            let specular = !invisible && materials.casts_caustics(material, min_alpha);
            census.specular += if specular { count } else { 0 };
            let storable = materials.may_be_storable(material, min_alpha);
            census.storable += if storable { count } else { 0 };
        }
        census
    }
}

/// Writes [`Requirements`] when something that they follow from changed and they are different from
/// before. Objects are counted anew only when there are others or their materials changed.
#[expect(clippy::too_many_arguments, reason = "the signature lists what the table depends on")]
pub fn derive_requirements(
    instances: Res<Instances>,
    meshes: Res<Meshes>,
    surfaces: Res<Surfaces>,
    emissions: Res<Emissions>,
    lights: Res<PunctualLights>,
    camera: Res<ViewCamera>,
    settings: Res<Settings>,
    named: Query<(&ShutterMotion, &Name), With<Shape>>,
    names: Query<&Name, With<Shape>>,
    mut census: Local<Census>,
    deforming: Query<(Option<&Name>, &VertexMotion), With<Deformation>>,
    mut requirements: ResMut<Requirements>,
) {
    let rewritten = instances.is_changed();
    let looks = surfaces.is_changed() || lights.is_changed() || camera.is_changed();
    let looks = looks || (emissions.is_changed() && emissions.restructured);
    if !(rewritten || looks || meshes.is_changed() || settings.is_changed()) {
        return;
    }
    if surfaces.is_changed() || settings.is_changed() || (rewritten && instances.restructured) {
        *census = Census::take(&instances, &surfaces, settings.0.photons.min_alpha());
    }
    let mut found = Requirements::default();
    let mut require = |feature, reason: String| found.features.push((feature, reason));
    let moving = instances.moving + lights.0.iter().filter(|l| !l.motion.is_static()).count();
    if moving > 0 {
        let who = first_names(named);
        let who = if who.is_empty() { String::new() } else { format!(": {who}") };
        require(Feature::Motion, format!("{moving} moving in the shutter{who}"));
    }
    let mut forms: Vec<_> = deforming
        .iter()
        .filter(|(_, motion)| !motion.later.is_empty())
        .map(|(name, motion)| (name.map_or("", |name| name.as_str()), motion.later.len() + 1))
        .collect();
    forms.sort_unstable();
    if let Some((name, keys)) = forms.first() {
        let count = forms.len();
        let reason = format!("{count} deforming in the shutter: `{name}` with {keys} keys");
        require(Feature::Deformation, reason);
    }
    if !camera.is_static() {
        require(Feature::CameraMotion, "the camera moves in the shutter".to_owned());
    }
    if camera.has_lens() {
        require(Feature::Lens, "the camera has an aperture".to_owned());
    }
    if surfaces.materials.textures().drift() {
        require(Feature::TextureMotion, "textures drift in the shutter".to_owned());
    }
    if census.masked > 0 {
        require(Feature::Opacity, format!("{} objects with a mask", census.masked));
    }
    if census.absorbing > 0 {
        require(Feature::Absorption, format!("{} absorbing solids", census.absorbing));
    }
    let tables = (&*instances, &surfaces.materials);
    let name = |index: u32| {
        let entity = instances.entity(index);
        entity.and_then(|entity| names.get(entity).ok()).map_or("", |name| name.as_str())
    };
    if let Some(reason) = nesting(tables, &census, &camera, &lights, name) {
        require(Feature::NestedDielectrics, reason);
    }
    if census.dispersive > 0 {
        let reason = format!("{} solids whose index depends on the wavelength", census.dispersive);
        require(Feature::Dispersion, reason);
    }
    if census.scattering > 0 {
        let reason = format!("{} solids which scatter light or glow", census.scattering);
        require(Feature::Scattering, reason);
    }
    if census.glowing > 0 {
        let reason = format!("{} solids which glow inside", census.glowing);
        require(Feature::GlowingSolids, reason);
    }
    if census.uneven > 0 {
        let reason = format!("{} solids of uneven density", census.uneven);
        require(Feature::UnevenDensity, reason);
    }
    if census.invisible > 0 {
        let reason = format!("{} smooth solids of index 1", census.invisible);
        require(Feature::InvisibleSurfaces, reason);
    }
    let textures = surfaces.materials.textures();
    let is_spectrum = |texture: u32| textures.is_spectrum(texture);
    let shining = instances.list.iter().filter_map(|i| emissions.texture(i.emission));
    let sky = |light: &PunctualLight| match light.light {
        Light::Sky { radiance: Value::Texture(texture), .. } => Some(texture),
        _ => None,
    };
    let shining = shining.chain(lights.0.iter().filter_map(sky));
    let shining = shining.filter(|texture| is_spectrum(*texture)).count();
    if settings.0.spectral {
        require(Feature::Spectra, "the setting `spectral`".to_owned());
    } else if census.spectral + shining > 0 {
        let objects = census.spectral;
        let reason = format!("{objects} objects and {shining} lights with spectra");
        require(Feature::Spectra, reason);
    }
    let skies = lights.0.iter().filter(|l| matches!(l.light, Light::Sky { .. })).count();
    if skies > 0 {
        require(Feature::Sky, format!("{skies} sky lights"));
    }
    if census.specular > 0 && census.storable + census.scattering > 0 {
        let reason = format!("{} mirrors, clear or polished objects", census.specular);
        require(Feature::Caustics, reason);
    }
    requirements.set_if_neq(found);
}

/// Why rays must know all solids that they are inside of, if they must.
fn nesting<'a>(
    (instances, materials): (&Instances, &MaterialTable),
    census: &Census,
    camera: &ViewCamera,
    lights: &PunctualLights,
    name: impl Fn(u32) -> &'a str,
) -> Option<String> {
    if census.solid < 2 && census.absorbing == 0 {
        return None;
    }
    let list = &instances.list;
    let found = solids(list, materials);
    let pairs = overlapping_pairs(list, &found);
    if let Some(&(a, b)) = pairs.first() {
        let more =
            if pairs.len() > 1 { format!(" and {} more", pairs.len() - 1) } else { String::new() };
        return Some(format!("the boxes of `{}` and `{}` overlap{more}", name(a), name(b)));
    }
    if census.absorbing == 0 {
        return None;
    }
    let eye = camera.reach();
    let point = |light: &PunctualLight| {
        let p = light.motion.at(0.0).translation.as_vec3();
        matches!(light.light, Light::Point { .. } | Light::Spot { .. })
            .then(|| Aabb::from_points([p]))
    };
    let shining = list.iter().filter(|instance| instance.emission != NOTHING).map(|i| i.bounds);
    let lamps: Vec<Aabb> = shining.chain(lights.0.iter().filter_map(point)).collect();
    found
        .into_iter()
        .filter(|&solid| materials.attenuation(list[solid as usize].material).is_some())
        .find_map(|solid| {
            let may_hold = |place: &Aabb| may_enclose(&list[solid as usize], place);
            let what = if may_hold(&eye) {
                "the camera"
            } else {
                lamps.iter().any(may_hold).then_some("a light")?
            };
            Some(format!("{what} may be inside `{}`, which absorbs", name(solid)))
        })
}

/// The first three names of what moves, in the order of names.
fn first_names(named: Query<(&ShutterMotion, &Name), With<Shape>>) -> String {
    let mut first: Vec<&str> = Vec::with_capacity(4);
    for (_, name) in named.iter().filter(|(motion, _)| motion.keys.len() > 1) {
        let name = name.as_str();
        let place = first.partition_point(|known| *known <= name);
        if place < 3 {
            first.insert(place, name);
            first.truncate(3);
        }
    }
    first.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}
