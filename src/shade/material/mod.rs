//! The materials of a frame, compiled: what can be computed before a ray arrives is.
//!
//! A material says what a surface is made of; at a point it becomes a [`Bsdf`]. Constants are
//! resolved once: metals to their indices, roughness to the GGX width `α = roughness²`, the energy
//! tables of rough interfaces.

mod caustics;
mod compile;
mod relief;

pub use caustics::CausticLobe;
pub(super) use compile::{Width, alpha, glass_width};
pub use relief::{Surroundings, bent_normal};

use super::bsdf::{
    AlbedoTable, Bsdf, ConductorFresnel, Diffuse, Mirror, Principled, PrincipledParameters,
    ReflectorLobe, ReflectorTable, RoughConductor, RoughDielectric, RoughPlastic, SmoothConductor,
    SmoothDielectric, SmoothPlastic, ThinGlass, reflector_table,
};
use super::medium::Medium;
use super::relative::RelativeTables;
use super::texture::{Known, REMEMBER_ABOVE, TexturePoint, Textures};
use crate::color::spectrum::WavelengthSet;
use crate::description::{IndexCurve, Material, Rgb, Scattering, Value};
use crate::extract::NOTHING;
use crate::math::{GraphFault, parts_first};
use compile::{Kind, MetalColor};
use relief::Relief;
use std::collections::{HashMap, HashSet};

/// All materials of a frame and the textures which they read.
///
/// References between materials must have an order (see [`material_order`]), and every index must be
/// valid: the description sees to both. Reflectances, roughness and other shares read from a texture
/// are limited to `[0, 1]`, which is where they are defined.
#[derive(Clone, Debug)]
pub struct MaterialTable {
    materials: Vec<Compiled>,
    textures: Textures,
    coats: Vec<AlbedoTable<1>>,
    glasses: Vec<AlbedoTable<2>>,
    reflectors: Vec<ReflectorTable>,
    /// Indices of refraction which depend on the wavelength.
    curves: Vec<IndexCurve>,
    /// Rough interfaces to other media than air.
    relative: RelativeTables,
    /// By material, whether it, or one that it is made of, looks at a spectrum.
    spectral: Vec<bool>,
    /// The wavelengths that stand in for red, green and blue, in a spectral scene.
    seen_at: Option<&'static WavelengthSet>,
}

/// What is inside a solid dielectric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interior {
    /// Index of refraction relative to vacuum.
    pub ior: f32,
    /// Absorption coefficient per metre; `None` is perfectly clear.
    pub sigma_a: Option<Rgb>,
    /// The spectrum by which it absorbs, and a factor; `sigma_a` is its colour.
    pub absorption: Option<(u32, f32)>,
    /// What is scattered; `None` where light goes straight on.
    pub scattering: Option<Scattering>,
    /// What the inside emits per metre, W·m⁻³·sr⁻¹.
    pub emission: Rgb,
    /// The texture whose number is a factor on absorption, scattering and emission, if the density is uneven.
    pub density: Option<u32>,
    /// Where solids overlap, the one of the highest priority is there.
    pub priority: i32,
}

impl Interior {
    /// The same seen at wavelengths.
    fn seen_at(self, seen: impl Fn(Rgb) -> Rgb, textures: &Textures) -> Self {
        let by_spectrum = |(spectrum, factor): (u32, f32)| {
            textures.color(spectrum, &TexturePoint::at(glam::Vec2::ZERO)) * factor
        };
        let absorbed = self.absorption.map(by_spectrum);
        let scattering = self.scattering.map(|scattering| Scattering {
            coefficient: seen(scattering.coefficient),
            ..scattering
        });
        Self {
            sigma_a: absorbed.or(self.sigma_a.map(&seen)),
            scattering,
            emission: seen(self.emission),
            ..self
        }
    }
}

/// A [`Material`] with all that does not depend on the point resolved.
#[derive(Clone, Debug)]
struct Compiled {
    kind: Kind,
    /// Whether it, or one that it is mixed of, is masked.
    has_opacity: bool,
    /// How many lookups of opacity one would take that forgets what it has found.
    lookups: u64,
    /// Whether it chooses among lobes or sides.
    needs_lobe: bool,
    /// Whether it, or the first solid that it is mixed of, encloses a medium.
    interior: Option<Interior>,
    /// How the index inside depends on the wavelength, if it does: a place in the table's curves.
    curve: Option<u32>,
    /// Whether it, or one that it is mixed of, has a curve.
    disperses: bool,
    /// What turns its normals.
    relief: Option<Relief>,
}

/// A material chosen of those that one is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chosen {
    /// One which is made of no other.
    pub material: u32,
    /// The one that turns the normals; of several around one another, the innermost.
    pub relief: Option<u32>,
}

/// An order in which each material comes after those that it is made of.
///
/// # Errors
/// When one is made of itself or of too many in a row.
///
/// # Panics
/// If a reference is out of range.
pub fn material_order(materials: &[Material<u32>]) -> Result<Vec<u32>, GraphFault> {
    parts_first(materials.len() as u32, |index| match materials[index as usize] {
        Material::Mix { a, b, .. } => vec![a, b],
        Material::Masked { material, .. }
        | Material::Bump { material, .. }
        | Material::NormalMap { material, .. } => vec![material],
        _ => Vec::new(),
    })
}

impl MaterialTable {
    /// Chooses what of a material is at a point.
    ///
    /// A mix chooses one of its sides with `u_lobe`, uniform in `[0, 1)`, and stretches what is
    /// left of the number back to `[0, 1)`: it can choose the lobe of the BSDF afterwards. A
    /// masked material is taken as opaque: ask [`MaterialTable::opacity`] first. The sides of
    /// a mix are then weighted by their opacity, as they are where a ray has been stopped.
    #[inline]
    pub fn choose(&self, material: u32, at: &TexturePoint, u_lobe: &mut f32) -> Chosen {
        let mut chosen = Chosen { material, relief: None };
        loop {
            chosen.material = match &self.materials[chosen.material as usize].kind {
                Kind::Mix { a, b, amount } => self.choose_side(*a, *b, *amount, at, u_lobe),
                Kind::Masked { material, .. } => *material,
                Kind::Relief { material } => {
                    chosen.relief = Some(chosen.material);
                    *material
                }
                _ => return chosen,
            };
        }
    }

    /// How the material scatters at a point, [chosen](Self::choose) by `u_lobe`.
    #[inline]
    pub fn bsdf(&self, material: u32, at: &TexturePoint, u_lobe: &mut f32) -> Bsdf<'_> {
        self.chosen_bsdf(self.choose(material, at, u_lobe).material, at)
    }

    /// How a material scatters that is made of no other.
    ///
    /// # Panics
    /// If it is.
    #[inline]
    pub fn chosen_bsdf(&self, material: u32, at: &TexturePoint) -> Bsdf<'_> {
        match &self.materials[material as usize].kind {
            Kind::Diffuse { albedo } => Bsdf::Diffuse(Diffuse { albedo: self.share(albedo, at) }),
            Kind::Mirror { reflectance } => {
                Bsdf::Mirror(Mirror { reflectance: self.share(reflectance, at) })
            }
            Kind::Dielectric { eta, width, average, table, tint } => {
                let tint = self.share(tint, at);
                let alpha = self.alpha(*width, at);
                match alpha.filter(|&alpha| RoughDielectric::resolves(*eta, alpha)).zip(*table) {
                    None => Bsdf::SmoothDielectric(SmoothDielectric { eta: *eta, tint }),
                    Some((alpha, table)) => {
                        let lost = self.glasses[table as usize].at(alpha);
                        let rough = RoughDielectric::new(*eta, lost, *average);
                        Bsdf::RoughDielectric(rough.tinted(tint))
                    }
                }
            }
            Kind::ThinGlass { eta, tint } => {
                Bsdf::ThinGlass(ThinGlass { eta: *eta, tint: self.share(tint, at) })
            }
            Kind::Conductor { fresnel, width, table } => {
                let (fresnel, average) = match fresnel {
                    MetalColor::Same(fresnel, average) => (*fresnel, *average),
                    MetalColor::F0(f0) => {
                        let fresnel = ConductorFresnel::Schlick { f0: self.share(f0, at) };
                        (fresnel, fresnel.average())
                    }
                };
                match self.reflector(*width, *table, at) {
                    None => Bsdf::SmoothConductor(SmoothConductor { fresnel }),
                    Some(lobe) => Bsdf::RoughConductor(RoughConductor::new(fresnel, average, lobe)),
                }
            }
            Kind::Plastic { albedo, eta, width, average, table } => {
                let rho = self.share(albedo, at);
                match self.alpha(*width, at).zip(*table) {
                    None => Bsdf::SmoothPlastic(SmoothPlastic::new(rho, *eta, *average)),
                    Some((alpha, table)) => {
                        let coat = self.coats[table as usize].at(alpha);
                        Bsdf::RoughPlastic(RoughPlastic::new(rho, *eta, coat))
                    }
                }
            }
            Kind::Principled { base_color, metallic, width, table, ior, transmission } => {
                let parameters = PrincipledParameters {
                    base_color: self.share(base_color, at),
                    metallic: self.scalar(metallic, at).clamp(0.0, 1.0),
                    ior: *ior,
                    transmission: self.scalar(transmission, at).clamp(0.0, 1.0),
                };
                let lobe = self.reflector(*width, *table, at);
                Bsdf::Principled(Principled::new(&parameters, lobe))
            }
            Kind::Mix { .. } | Kind::Masked { .. } | Kind::Relief { .. } => {
                unreachable!("a material was chosen")
            }
        }
    }

    /// Like [`MaterialTable::chosen_bsdf`] for a surface which has a solid of the material `outside` on its
    /// outside, or air where that is `None`.
    pub fn chosen_bsdf_within(
        &self,
        material: u32,
        at: &TexturePoint,
        outside: Option<u32>,
    ) -> Bsdf<'_> {
        let index = outside.and_then(|outside| self.interior(outside));
        match (index, &self.materials[material as usize].kind) {
            (Some(index), Kind::Dielectric { eta, tint, .. }) => {
                let (eta, tint) = (eta / index.ior, self.share(tint, at));
                let Some(pair) = self.relative.find(material, index.ior) else {
                    return Bsdf::SmoothDielectric(SmoothDielectric { eta, tint });
                };
                pair.bsdf(eta, tint, |texture| self.textures.scalar(texture, at))
            }
            _ => self.chosen_bsdf(material, at),
        }
    }

    /// Like [`MaterialTable::chosen_bsdf_within`], at a wavelength in nm if there is one.
    ///
    /// Energy that a rough interface loses to a second bounce is that at the d line.
    #[inline]
    pub fn chosen_bsdf_tuned(
        &self,
        material: u32,
        at: &TexturePoint,
        outside: Option<u32>,
        nm: Option<f32>,
    ) -> Bsdf<'_> {
        let bsdf = self.chosen_bsdf_within(material, at, outside);
        let Some(nm) = nm else { return bsdf };
        let index = |solid: u32| self.index(solid, nm);
        let eta = |outside: Option<u32>| index(material) / outside.map_or(1.0, index);
        match bsdf {
            Bsdf::SmoothDielectric(smooth) => {
                Bsdf::SmoothDielectric(SmoothDielectric { eta: eta(outside), ..smooth })
            }
            Bsdf::RoughDielectric(rough) => Bsdf::RoughDielectric(rough.with_index(eta(outside))),
            other => other,
        }
    }

    /// The index of refraction of a solid of this material at a wavelength in nm; 1 of what is none.
    #[inline]
    pub fn index(&self, material: u32, nm: f32) -> f32 {
        let Compiled { curve, interior, .. } = &self.materials[material as usize];
        match curve {
            Some(curve) => self.curves[*curve as usize].index(f64::from(nm)) as f32,
            None => interior.map_or(1.0, |interior| interior.ior),
        }
    }

    /// Takes the textures to the time of another frame: when its shutter opens and closes, in seconds.
    pub fn go_to(&mut self, shutter: (f64, f64)) {
        self.textures = std::mem::take(&mut self.textures).at_time(shutter);
    }

    /// The medium inside a solid of this material which scatters, glows or is uneven; `None` for air ([`NOTHING`]) and all
    /// others.
    #[inline]
    pub fn medium(&self, material: u32) -> Option<Medium> {
        if material == NOTHING {
            return None;
        }
        let interior = self.interior(material)?;
        let Interior { sigma_a, scattering, emission, density, .. } = interior;
        let Scattering { coefficient: sigma_s, phase } = scattering.unwrap_or_default();
        if sigma_s == Rgb::ZERO && emission == Rgb::ZERO && density.is_none() {
            return None;
        }
        let sigma_t = sigma_s + sigma_a.unwrap_or(Rgb::ZERO);
        Some(Medium { sigma_s, sigma_t, emission, phase })
    }

    /// Whether a smooth surface without tint and with equal indices on both sides, at all wavelengths, is no surface: only what is inside
    /// matters.
    pub fn is_invisible(&self, material: u32, outside: Option<u32>) -> bool {
        let Compiled { kind, disperses, .. } = &self.materials[material as usize];
        let Kind::Dielectric { eta, width: Width::Smooth, tint, .. } = kind else { return false };
        if *tint != Value::Constant(Rgb::ONE) {
            return false;
        }
        let around = outside.and_then(|outside| self.interior(outside)).map_or(1.0, |i| i.ior);
        !disperses && outside.is_none_or(|outside| !self.disperses(outside)) && *eta == around
    }

    /// Whether a material, or one that it is made of, has a spectrum.
    pub fn has_spectrum(&self, material: u32) -> bool {
        self.spectral[material as usize]
    }

    /// Whether the wavelength matters at a surface of this material, or inside it.
    #[inline]
    pub fn disperses(&self, material: u32) -> bool {
        self.materials[material as usize].disperses
    }

    /// Share of the rays which the surface stops, in `[0, 1]`: 1 unless it is masked.
    #[inline]
    pub fn opacity(&self, material: u32, at: &TexturePoint) -> f32 {
        let compiled = &self.materials[material as usize];
        if !compiled.has_opacity {
            return 1.0;
        }
        if compiled.lookups <= REMEMBER_ABOVE {
            return self.opacity_of(&compiled.kind, at, &mut |part| self.opacity(part, at));
        }
        self.opacity_once(material, at, &mut Known::default())
    }

    /// [`MaterialTable::opacity`] of what many ways lead to, each looked up once.
    fn opacity_once(&self, material: u32, at: &TexturePoint, known: &mut Known<f32>) -> f32 {
        let compiled = &self.materials[material as usize];
        if !compiled.has_opacity {
            return 1.0;
        }
        if let Some(&opacity) = known.get(&material) {
            return opacity;
        }
        let parts = &mut |part| self.opacity_once(part, at, known);
        let opacity = self.opacity_of(&compiled.kind, at, parts);
        known.insert(material, opacity);
        opacity
    }

    /// The opacity of a material from that of those which it is made of.
    fn opacity_of(&self, kind: &Kind, at: &TexturePoint, part: &mut impl FnMut(u32) -> f32) -> f32 {
        match kind {
            Kind::Masked { material, opacity } => {
                self.scalar(opacity, at).clamp(0.0, 1.0) * part(*material)
            }
            Kind::Mix { a, b, amount } => {
                let amount = self.scalar(amount, at).clamp(0.0, 1.0);
                (1.0 - amount) * part(*a) + amount * part(*b)
            }
            Kind::Relief { material } => part(*material),
            _ => 1.0,
        }
    }

    /// Whether something is true of a material or of one that it is made of, asked of each once.
    fn any_part(&self, material: u32, is_true: impl Fn(&Kind) -> bool) -> bool {
        let mut open = vec![material];
        let mut seen = HashSet::new();
        while let Some(part) = open.pop() {
            match &self.materials[part as usize].kind {
                _ if !seen.insert(part) => {}
                Kind::Mix { a, b, .. } => open.extend([*b, *a]),
                Kind::Masked { material, .. } | Kind::Relief { material } => open.push(*material),
                kind if is_true(kind) => return true,
                _ => {}
            }
        }
        false
    }

    /// About the mean of [`MaterialTable::opacity`] over a surface, to choose lamps by; above 0 where any of it may be.
    pub fn mean_opacity(&self, material: u32) -> f32 {
        self.mean_opacity_once(material, &mut HashMap::new())
    }

    /// [`MaterialTable::mean_opacity`], computed of each part once.
    fn mean_opacity_once(&self, material: u32, known: &mut HashMap<u32, f32>) -> f32 {
        if let Some(&mean) = known.get(&material) {
            return mean;
        }
        let mean = |value: &Value<f32, u32>| match *value {
            Value::Constant(number) => number.clamp(0.0, 1.0),
            Value::Texture(texture) => self.textures.mean_share(texture),
        };
        let opacity = match &self.materials[material as usize].kind {
            Kind::Masked { material, opacity } => {
                mean(opacity) * self.mean_opacity_once(*material, known)
            }
            Kind::Mix { a, b, amount } => {
                let (a, b) = (self.mean_opacity_once(*a, known), self.mean_opacity_once(*b, known));
                a + (b - a) * mean(amount)
            }
            Kind::Relief { material } => self.mean_opacity_once(*material, known),
            _ => 1.0,
        };
        known.insert(material, opacity);
        opacity
    }

    /// Whether a surface stops a ray: `None` where it passes through a hole.
    ///
    /// One number decides that and, stretched back to the whole interval `[0, 1)`, is left for another
    /// choice; where nothing is to be decided it is not drawn.
    #[inline]
    pub fn stopped(
        &self,
        material: u32,
        at: &TexturePoint,
        u: impl FnOnce() -> f32,
    ) -> Option<Option<f32>> {
        let opacity = self.opacity(material, at);
        if opacity >= 1.0 {
            return Some(None);
        }
        let u = u();
        (u < opacity).then(|| Some(u / opacity))
    }

    /// Whether [`MaterialTable::opacity`] can be other than 1.
    #[inline]
    pub fn has_opacity(&self, material: u32) -> bool {
        self.materials[material as usize].has_opacity
    }

    /// Whether photons are gathered at a point of a material that is made of no other: whether it scatters into so many
    /// directions there that photons tell what it looks like, by a diffuse lobe or one at least as wide as `min_alpha`. Beside
    /// that, where its textures are to be looked up.
    ///
    /// Photons and camera paths must agree about every place, or light is counted twice or not at all; but each
    /// sees another footprint of it. So where textures decide, they are looked up at the point itself, whoever asks and
    /// whatever the filter, and so is all else of the material: its lobes are those of the place.
    #[inline]
    pub fn storable_at(
        &self,
        material: u32,
        at: &TexturePoint,
        min_alpha: f32,
    ) -> (TexturePoint, bool) {
        let wide = |width, at| self.alpha(width, at).is_some_and(|alpha| alpha >= min_alpha);
        match &self.materials[material as usize].kind {
            Kind::Diffuse { .. } | Kind::Plastic { .. } => (*at, true),
            Kind::Mirror { .. } | Kind::ThinGlass { .. } => (*at, false),
            Kind::Dielectric { width, .. } | Kind::Conductor { width, .. } => {
                let at = if width.is_textured() { at.unfiltered() } else { *at };
                (at, wide(*width, &at))
            }
            Kind::Principled { base_color, metallic, width, transmission, .. } => {
                let textured = |value: &Value<f32, u32>| matches!(value, Value::Texture(_));
                // Whether it is black at some place says nothing about the others.
                let black = *base_color == Value::Constant(Rgb::ZERO);
                let bare = |value: &Value<f32, u32>| *value == Value::Constant(1.0);
                let diffuse = !(black || bare(metallic) || bare(transmission));
                let decides = (diffuse && (textured(metallic) || textured(transmission)))
                    || (!diffuse && width.is_textured());
                let at = if decides { at.unfiltered() } else { *at };
                let below_one = |value: &Value<f32, u32>| self.scalar(value, &at) < 1.0;
                let diffuse = diffuse && below_one(metallic) && below_one(transmission);
                (at, diffuse || wide(*width, &at))
            }
            Kind::Mix { .. } | Kind::Masked { .. } | Kind::Relief { .. } => {
                unreachable!("a material was chosen")
            }
        }
    }

    /// Whether [`MaterialTable::storable_at`] can be true of a point of the material.
    pub fn may_be_storable(&self, material: u32, min_alpha: f32) -> bool {
        self.any_part(material, |kind| match kind {
            Kind::Diffuse { .. } | Kind::Plastic { .. } | Kind::Principled { .. } => true,
            Kind::Dielectric { width, .. } | Kind::Conductor { width, .. } => {
                width.widest() >= min_alpha
            }
            _ => false,
        })
    }

    /// Whether the material can pass light on so sharply that it makes caustics: by a lobe without
    /// extent, or because it is not storable at some point.
    pub fn may_cast_caustics(&self, material: u32, min_alpha: f32) -> bool {
        self.any_part(material, |kind| match kind {
            Kind::Mirror { .. } | Kind::ThinGlass { .. } => true,
            Kind::Dielectric { width, .. } | Kind::Conductor { width, .. } => {
                width.narrowest() < min_alpha
            }
            Kind::Principled { base_color, metallic, width, transmission, .. } => {
                // Only where nothing diffuse is below is a rough gloss apart.
                let may_be_one =
                    |share: &Value<f32, u32>| !matches!(share, Value::Constant(s) if *s < 1.0);
                let bare = *base_color == Value::Constant(Rgb::ZERO)
                    || may_be_one(metallic)
                    || may_be_one(transmission);
                width.narrowest() == 0.0 || (bare && width.narrowest() < min_alpha)
            }
            // The rough coat goes with its base, which is diffuse.
            Kind::Plastic { width, .. } => width.narrowest() == 0.0,
            _ => false,
        })
    }

    /// Number of materials.
    pub fn len(&self) -> usize {
        self.materials.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.materials.is_empty()
    }

    /// What a solid of this material holds; `None` for all but [`Material::Dielectric`], masked or
    /// mixed with something else. Of a mix of two dielectrics the first counts.
    #[inline]
    pub fn interior(&self, material: u32) -> Option<Interior> {
        self.materials[material as usize].interior
    }

    /// Whether [`MaterialTable::bsdf`] and what it returns look at the number for the choice of a lobe.
    #[inline]
    pub fn needs_lobe(&self, material: u32) -> bool {
        self.materials[material as usize].needs_lobe
    }

    /// Absorption coefficient inside, per metre; `None` where nothing is absorbed.
    #[inline]
    pub fn attenuation(&self, material: u32) -> Option<Rgb> {
        self.interior(material).and_then(|interior| interior.sigma_a)
    }

    /// Beer and Lambert's law: the share of light left after a distance in metres inside a solid of this
    /// material; 1 in air ([`NOTHING`]).
    #[inline]
    pub fn transmittance(&self, material: u32, distance: f64) -> Rgb {
        if material == NOTHING {
            return Rgb::ONE;
        }
        // A channel which absorbs nothing stays 1 at any distance, 0·∞ included.
        self.attenuation(material).map_or(Rgb::ONE, |sigma_a| {
            sigma_a.map(|sigma| if sigma == 0.0 { 1.0 } else { (-sigma * distance as f32).exp() })
        })
    }

    /// Whether light can be inside the object: [`MaterialTable::interior`] is something.
    #[inline]
    pub fn is_dielectric(&self, material: u32) -> bool {
        self.interior(material).is_some()
    }

    /// A colour, or in a spectral scene its values at the wavelengths.
    #[inline]
    pub fn seen(&self, color: Rgb) -> Rgb {
        match self.seen_at {
            None => color,
            Some(set) => set.from_rgb * color,
        }
    }

    /// The wavelengths at which the materials are seen, in a spectral scene.
    #[inline]
    pub fn wavelengths(&self) -> Option<&'static WavelengthSet> {
        self.seen_at
    }

    /// The same materials seen at the wavelengths of a set, which stand in for red, green and blue.
    #[must_use]
    pub fn seen_at(&self, set: &'static WavelengthSet) -> Self {
        let textures = self.textures.seen_at(set);
        let seen = |color: Rgb| set.from_rgb * color;
        let materials = self.materials.iter().map(|material| Compiled {
            kind: material.kind.seen_at(set),
            interior: material.interior.map(|interior| interior.seen_at(seen, &textures)),
            ..material.clone()
        });
        let materials = materials.collect();
        Self { materials, textures, seen_at: Some(set), ..self.clone() }
    }

    /// A colour which is constant or textured, as it is: not limited to any range.
    #[inline]
    pub fn color(&self, value: &Value<Rgb, u32>, at: &TexturePoint) -> Rgb {
        match *value {
            Value::Constant(color) => self.seen(color),
            Value::Texture(texture) => self.textures.color(texture, at),
        }
    }

    /// A number which is constant or textured, as it is: not limited to any range.
    #[inline]
    pub fn scalar(&self, value: &Value<f32, u32>, at: &TexturePoint) -> f32 {
        match *value {
            Value::Constant(number) => number,
            Value::Texture(texture) => self.textures.scalar(texture, at),
        }
    }

    /// The textures.
    pub fn textures(&self) -> &Textures {
        &self.textures
    }

    /// A colour which is a share of light.
    #[inline]
    fn share(&self, value: &Value<Rgb, u32>, at: &TexturePoint) -> Rgb {
        self.color(value, at).map(|v| v.clamp(0.0, 1.0))
    }

    #[inline]
    fn alpha(&self, width: Width, at: &TexturePoint) -> Option<f32> {
        match width {
            Width::Smooth => None,
            Width::Constant(alpha) => Some(alpha),
            Width::Texture(texture) => alpha(self.textures.scalar(texture, at)),
        }
    }

    /// The lobe of a rough reflector; `table` is the one made for a constant width.
    #[inline]
    fn reflector(
        &self,
        width: Width,
        table: Option<u32>,
        at: &TexturePoint,
    ) -> Option<ReflectorLobe<'_>> {
        let alpha = self.alpha(width, at)?;
        let table = match table {
            Some(table) => &self.reflectors[table as usize],
            None => reflector_table(),
        };
        Some(ReflectorLobe::new(table.at(alpha)))
    }

    /// Chooses a side of a mix by `u_lobe < p` and leaves in it a number uniform in `[0, 1)`.
    fn choose_side(
        &self,
        a: u32,
        b: u32,
        amount: Value<f32, u32>,
        at: &TexturePoint,
        u_lobe: &mut f32,
    ) -> u32 {
        let amount = self.scalar(&amount, at).clamp(0.0, 1.0);
        let weight_a = (1.0 - amount) * self.opacity(a, at);
        let weight_b = amount * self.opacity(b, at);
        // Where both are holes nothing is hit; any answer will do.
        let p = if weight_b > 0.0 { weight_b / (weight_a + weight_b) } else { 0.0 };
        let below_one = 1.0_f32.next_down();
        if *u_lobe < p {
            *u_lobe = (*u_lobe / p).min(below_one);
            b
        } else {
            *u_lobe = ((*u_lobe - p) / (1.0 - p)).min(below_one);
            a
        }
    }
}

#[cfg(test)]
mod tests;
