//! The materials of a frame, compiled: what can be computed before a ray arrives is.
//!
//! A material says what a surface is made of; at a point (uv) it becomes a [`Bsdf`]. Constants are
//! resolved once: metals to their indices, roughness to the GGX width `α = roughness²`, the energy
//! tables of rough interfaces.

use super::bsdf::{
    AlbedoTable, Bsdf, ConductorFresnel, Diffuse, Mirror, Principled, PrincipledParameters,
    ReflectorLobe, ReflectorTable, RoughConductor, RoughDielectric, RoughPlastic,
    SMOOTH_BELOW_ALPHA, SmoothConductor, SmoothDielectric, SmoothPlastic, ThinGlass, Widths,
    coat_table, dielectric_average, glass_table, reflector_table, reflector_table_at,
};
use super::metals;
use super::relative::RelativeTables;
use super::texture::{self, RenderTexture};
use crate::description::{Material, Rgb, Value};
use crate::extract::NOTHING;
use glam::Vec2;
use std::collections::HashMap;

/// All materials of a frame and the textures which they read.
///
/// References between materials must not form a cycle (see [`material_cycle`]), and every index must be
/// valid: the description sees to both. Reflectances, roughness and other shares read from a texture
/// are limited to `[0, 1]`, which is where they are defined.
#[derive(Clone, Debug)]
pub struct MaterialTable {
    materials: Vec<Compiled>,
    textures: Vec<RenderTexture>,
    coats: Vec<AlbedoTable<1>>,
    glasses: Vec<AlbedoTable<2>>,
    reflectors: Vec<ReflectorTable>,
    /// Rough interfaces to other media than air.
    relative: RelativeTables,
}

/// What is inside a solid dielectric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interior {
    /// Index of refraction relative to vacuum.
    pub ior: f32,
    /// Absorption coefficient per metre; `None` is perfectly clear.
    pub sigma_a: Option<Rgb>,
    /// Where solids overlap, the one of the highest priority is there.
    pub priority: i32,
}

/// A [`Material`] with all that does not depend on the point resolved.
#[derive(Clone, Debug)]
struct Compiled {
    kind: Kind,
    /// Whether it, or one that it is mixed of, is masked.
    has_opacity: bool,
    /// Whether it chooses among lobes or sides.
    needs_lobe: bool,
    /// Whether it, or the first solid that it is mixed of, encloses a medium.
    interior: Option<Interior>,
}

#[derive(Clone, Debug)]
enum Kind {
    Diffuse {
        albedo: Value<Rgb, u32>,
    },
    Mirror {
        reflectance: Value<Rgb, u32>,
    },
    Dielectric {
        eta: f32,
        width: Width,
        average: f32,
        table: Option<u32>,
    },
    ThinGlass {
        eta: f32,
        tint: Value<Rgb, u32>,
    },
    Conductor {
        fresnel: MetalColor,
        width: Width,
        table: Option<u32>,
    },
    Plastic {
        albedo: Value<Rgb, u32>,
        eta: f32,
        width: Width,
        average: f32,
        table: Option<u32>,
    },
    Principled {
        base_color: Value<Rgb, u32>,
        metallic: Value<f32, u32>,
        width: Width,
        table: Option<u32>,
        ior: f32,
        transmission: Value<f32, u32>,
    },
    Mix {
        a: u32,
        b: u32,
        amount: Value<f32, u32>,
    },
    Masked {
        material: u32,
        opacity: Value<f32, u32>,
    },
}

/// How a metal reflects.
#[derive(Clone, Debug)]
enum MetalColor {
    /// One reflectance everywhere, and its cosine-weighted mean.
    Same(ConductorFresnel, Rgb),
    /// Reflectance at normal incidence.
    F0(Value<Rgb, u32>),
}

/// Width `α` of the microfacets.
#[derive(Clone, Copy, Debug)]
pub(super) enum Width {
    Smooth,
    Constant(f32),
    /// The texture holds the roughness.
    Texture(u32),
}

impl Width {
    pub(super) fn new(roughness: Value<f32, u32>) -> Self {
        match roughness {
            Value::Constant(roughness) => match alpha(roughness) {
                Some(alpha) => Self::Constant(alpha),
                None => Self::Smooth,
            },
            Value::Texture(texture) => Self::Texture(texture),
        }
    }

    /// Bounds of the width over the surface; a texture may ask for any.
    fn narrowest(self) -> f32 {
        if let Self::Constant(alpha) = self { alpha } else { 0.0 }
    }

    fn widest(self) -> f32 {
        match self {
            Self::Smooth => 0.0,
            Self::Constant(alpha) => alpha,
            Self::Texture(_) => 1.0,
        }
    }

    pub(super) fn widths(self) -> Option<Widths> {
        match self {
            Self::Smooth => None,
            Self::Constant(alpha) => Some(Widths::One(alpha)),
            Self::Texture(_) => Some(Widths::All),
        }
    }
}

/// The GGX width of a perceptual roughness; `None` is smooth.
#[inline]
pub(super) fn alpha(roughness: f32) -> Option<f32> {
    let roughness = roughness.clamp(0.0, 1.0);
    let alpha = roughness * roughness;
    (alpha >= SMOOTH_BELOW_ALPHA).then_some(alpha)
}

/// A material which refers to itself through mixes and masks, if there is one.
///
/// # Panics
/// If a reference is out of range.
pub fn material_cycle(materials: &[Material<u32>]) -> Option<u32> {
    #[derive(Clone, Copy, PartialEq)]
    enum Visit {
        Not,
        Open,
        Done,
    }
    fn visit(index: u32, materials: &[Material<u32>], visits: &mut [Visit]) -> Option<u32> {
        match visits[index as usize] {
            Visit::Done => return None,
            Visit::Open => return Some(index),
            Visit::Not => visits[index as usize] = Visit::Open,
        }
        let found = match materials[index as usize] {
            Material::Mix { a, b, .. } => {
                visit(a, materials, visits).or_else(|| visit(b, materials, visits))
            }
            Material::Masked { material, .. } => visit(material, materials, visits),
            _ => None,
        };
        visits[index as usize] = Visit::Done;
        found
    }
    let mut visits = vec![Visit::Not; materials.len()];
    (0..materials.len() as u32).find_map(|index| visit(index, materials, &mut visits))
}

impl MaterialTable {
    /// Compiles the materials of a frame; their references are indices into `materials` and `textures`.
    ///
    /// # Panics
    /// If a reference is out of range or [`material_cycle`] finds a cycle.
    pub fn new(materials: &[Material<u32>], textures: Vec<RenderTexture>) -> Self {
        assert_eq!(material_cycle(materials), None, "the description rejects cycles of materials");
        let mut table = Self {
            materials: Vec::new(),
            textures,
            coats: Vec::new(),
            glasses: Vec::new(),
            reflectors: Vec::new(),
            relative: RelativeTables::new(materials),
        };
        let mut known = KnownTables::default();
        let kinds: Vec<Kind> =
            materials.iter().map(|material| table.compile(material, &mut known)).collect();
        table.materials = kinds
            .iter()
            .enumerate()
            .map(|(index, kind)| Compiled {
                kind: kind.clone(),
                has_opacity: has_opacity(index as u32, &kinds),
                needs_lobe: needs_lobe(index as u32, &kinds),
                interior: interior(index as u32, materials),
            })
            .collect();
        table
    }

    fn compile(&mut self, material: &Material<u32>, known: &mut KnownTables) -> Kind {
        match *material {
            Material::Diffuse { albedo } => Kind::Diffuse { albedo },
            Material::Mirror { reflectance } => Kind::Mirror { reflectance },
            Material::Dielectric { ior, roughness, .. } => {
                let width = glass_width(ior, Width::new(roughness));
                let table = known.glass(&mut self.glasses, ior, width);
                Kind::Dielectric { eta: ior, width, average: dielectric_average(ior), table }
            }
            Material::ThinGlass { ior, tint } => Kind::ThinGlass { eta: ior, tint },
            Material::Conductor { metal, f0, eta, k, roughness } => {
                let width = Width::new(roughness);
                let table = known.reflector(&mut self.reflectors, width);
                Kind::Conductor { fresnel: metal_color(metal, f0, eta, k), width, table }
            }
            Material::Plastic { albedo, ior, roughness } => {
                let width = Width::new(roughness);
                let table = known.coat(&mut self.coats, ior, width);
                Kind::Plastic { albedo, eta: ior, width, average: dielectric_average(ior), table }
            }
            Material::Principled { base_color, metallic, roughness, ior, transmission } => {
                let width = Width::new(roughness);
                let table = known.reflector(&mut self.reflectors, width);
                Kind::Principled { base_color, metallic, width, table, ior, transmission }
            }
            Material::Mix { a, b, amount } => Kind::Mix { a, b, amount },
            Material::Masked { material, opacity } => Kind::Masked { material, opacity },
        }
    }

    /// How the material scatters at `uv`.
    ///
    /// A mix chooses one of its sides with `u_lobe`, uniform in `[0, 1)`, and stretches what is
    /// left of the number back to `[0, 1)`: it can choose the lobe of the BSDF afterwards. A
    /// masked material is taken as opaque: ask [`MaterialTable::opacity`] first. The sides of
    /// a mix are then weighted by their opacity, as they are where a ray has been stopped.
    #[inline]
    pub fn bsdf(&self, material: u32, uv: Vec2, u_lobe: &mut f32) -> Bsdf<'_> {
        match &self.materials[material as usize].kind {
            Kind::Diffuse { albedo } => Bsdf::Diffuse(Diffuse { albedo: self.share(albedo, uv) }),
            Kind::Mirror { reflectance } => {
                Bsdf::Mirror(Mirror { reflectance: self.share(reflectance, uv) })
            }
            Kind::Dielectric { eta, width, average, table } => {
                match self.alpha(*width, uv).zip(*table) {
                    None => Bsdf::SmoothDielectric(SmoothDielectric { eta: *eta }),
                    Some((alpha, table)) => {
                        let lost = self.glasses[table as usize].at(alpha);
                        Bsdf::RoughDielectric(RoughDielectric::new(*eta, lost, *average))
                    }
                }
            }
            Kind::ThinGlass { eta, tint } => {
                Bsdf::ThinGlass(ThinGlass { eta: *eta, tint: self.share(tint, uv) })
            }
            Kind::Conductor { fresnel, width, table } => {
                let (fresnel, average) = match fresnel {
                    MetalColor::Same(fresnel, average) => (*fresnel, *average),
                    MetalColor::F0(f0) => {
                        let fresnel = ConductorFresnel::Schlick { f0: self.share(f0, uv) };
                        (fresnel, fresnel.average())
                    }
                };
                match self.reflector(*width, *table, uv) {
                    None => Bsdf::SmoothConductor(SmoothConductor { fresnel }),
                    Some(lobe) => Bsdf::RoughConductor(RoughConductor::new(fresnel, average, lobe)),
                }
            }
            Kind::Plastic { albedo, eta, width, average, table } => {
                let rho = self.share(albedo, uv);
                match self.alpha(*width, uv).zip(*table) {
                    None => Bsdf::SmoothPlastic(SmoothPlastic::new(rho, *eta, *average)),
                    Some((alpha, table)) => {
                        let coat = self.coats[table as usize].at(alpha);
                        Bsdf::RoughPlastic(RoughPlastic::new(rho, *eta, coat))
                    }
                }
            }
            Kind::Principled { base_color, metallic, width, table, ior, transmission } => {
                let parameters = PrincipledParameters {
                    base_color: self.share(base_color, uv),
                    metallic: self.scalar(metallic, uv).clamp(0.0, 1.0),
                    ior: *ior,
                    transmission: self.scalar(transmission, uv).clamp(0.0, 1.0),
                };
                let lobe = self.reflector(*width, *table, uv);
                Bsdf::Principled(Principled::new(&parameters, lobe))
            }
            Kind::Mix { a, b, amount } => {
                let side = self.choose_side(*a, *b, *amount, uv, u_lobe);
                self.bsdf(side, uv, u_lobe)
            }
            Kind::Masked { material, .. } => self.bsdf(*material, uv, u_lobe),
        }
    }

    /// Like [`MaterialTable::bsdf`] for a surface which has a solid of the material `outside` on its
    /// outside, or air where that is `None`.
    pub fn bsdf_within(
        &self,
        material: u32,
        uv: Vec2,
        u_lobe: &mut f32,
        outside: Option<u32>,
    ) -> Bsdf<'_> {
        let Some(index) = outside.and_then(|outside| self.interior(outside)) else {
            return self.bsdf(material, uv, u_lobe);
        };
        match &self.materials[material as usize].kind {
            Kind::Dielectric { eta, .. } => {
                let eta = eta / index.ior;
                let Some(pair) = self.relative.find(material, index.ior) else {
                    return Bsdf::SmoothDielectric(SmoothDielectric { eta });
                };
                let roughness =
                    |texture: u32| texture::scalar(&self.textures[texture as usize], uv);
                pair.bsdf(eta, roughness)
            }
            Kind::Mix { a, b, amount } => {
                let side = self.choose_side(*a, *b, *amount, uv, u_lobe);
                self.bsdf_within(side, uv, u_lobe, outside)
            }
            Kind::Masked { material, .. } => self.bsdf_within(*material, uv, u_lobe, outside),
            _ => self.bsdf(material, uv, u_lobe),
        }
    }

    /// Share of the rays which the surface stops, in `[0, 1]`: 1 unless it is masked.
    #[inline]
    pub fn opacity(&self, material: u32, uv: Vec2) -> f32 {
        let compiled = &self.materials[material as usize];
        if !compiled.has_opacity {
            return 1.0;
        }
        match &compiled.kind {
            Kind::Masked { material, opacity } => {
                self.scalar(opacity, uv).clamp(0.0, 1.0) * self.opacity(*material, uv)
            }
            Kind::Mix { a, b, amount } => {
                let amount = self.scalar(amount, uv).clamp(0.0, 1.0);
                (1.0 - amount) * self.opacity(*a, uv) + amount * self.opacity(*b, uv)
            }
            _ => 1.0,
        }
    }

    /// Whether a surface stops a ray: `None` where it passes through a hole.
    ///
    /// One number decides that and, stretched back to the whole interval `[0, 1)`, is left for another
    /// choice; where nothing is to be decided it is not drawn.
    #[inline]
    pub fn stopped(&self, material: u32, uv: Vec2, u: impl FnOnce() -> f32) -> Option<Option<f32>> {
        let opacity = self.opacity(material, uv);
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

    /// Whether [`Bsdf::is_storable`] can be true of a point of the material.
    pub fn may_be_storable(&self, material: u32, min_alpha: f32) -> bool {
        match &self.materials[material as usize].kind {
            Kind::Diffuse { .. } | Kind::Plastic { .. } | Kind::Principled { .. } => true,
            Kind::Mirror { .. } | Kind::ThinGlass { .. } => false,
            Kind::Dielectric { width, .. } | Kind::Conductor { width, .. } => {
                width.widest() >= min_alpha
            }
            Kind::Mix { a, b, .. } => {
                self.may_be_storable(*a, min_alpha) || self.may_be_storable(*b, min_alpha)
            }
            Kind::Masked { material, .. } => self.may_be_storable(*material, min_alpha),
        }
    }

    /// Whether the material can pass light on so sharply that it makes caustics: by a lobe without
    /// extent, or because it is not storable at some point.
    pub fn may_cast_caustics(&self, material: u32, min_alpha: f32) -> bool {
        match &self.materials[material as usize].kind {
            Kind::Diffuse { .. } => false,
            Kind::Mirror { .. } | Kind::ThinGlass { .. } => true,
            Kind::Dielectric { width, .. }
            | Kind::Conductor { width, .. }
            | Kind::Principled { width, .. } => width.narrowest() < min_alpha,
            // The rough coat goes with its base, which is diffuse.
            Kind::Plastic { width, .. } => width.narrowest() == 0.0,
            Kind::Mix { a, b, .. } => {
                self.may_cast_caustics(*a, min_alpha) || self.may_cast_caustics(*b, min_alpha)
            }
            Kind::Masked { material, .. } => self.may_cast_caustics(*material, min_alpha),
        }
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

    /// A colour which is constant or textured, as it is: not limited to any range.
    #[inline]
    pub fn color(&self, value: &Value<Rgb, u32>, uv: Vec2) -> Rgb {
        match *value {
            Value::Constant(color) => color,
            Value::Texture(texture) => texture::color(&self.textures[texture as usize], uv),
        }
    }

    /// A number which is constant or textured, as it is: not limited to any range.
    #[inline]
    pub fn scalar(&self, value: &Value<f32, u32>, uv: Vec2) -> f32 {
        match *value {
            Value::Constant(number) => number,
            Value::Texture(texture) => texture::scalar(&self.textures[texture as usize], uv),
        }
    }

    /// The textures, in the order given.
    pub fn textures(&self) -> &[RenderTexture] {
        &self.textures
    }

    /// A colour which is a share of light.
    #[inline]
    fn share(&self, value: &Value<Rgb, u32>, uv: Vec2) -> Rgb {
        self.color(value, uv).map(|v| v.clamp(0.0, 1.0))
    }

    #[inline]
    fn alpha(&self, width: Width, uv: Vec2) -> Option<f32> {
        match width {
            Width::Smooth => None,
            Width::Constant(alpha) => Some(alpha),
            Width::Texture(texture) => alpha(texture::scalar(&self.textures[texture as usize], uv)),
        }
    }

    /// The lobe of a rough reflector; `table` is the one made for a constant width.
    #[inline]
    fn reflector(&self, width: Width, table: Option<u32>, uv: Vec2) -> Option<ReflectorLobe<'_>> {
        let alpha = self.alpha(width, uv)?;
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
        uv: Vec2,
        u_lobe: &mut f32,
    ) -> u32 {
        let amount = self.scalar(&amount, uv).clamp(0.0, 1.0);
        let weight_a = (1.0 - amount) * self.opacity(a, uv);
        let weight_b = amount * self.opacity(b, uv);
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

/// The width of a rough dielectric, or smooth where its transmitted lobe could not be resolved.
pub(super) fn glass_width(eta: f32, width: Width) -> Width {
    let strength = (eta - 1.0).abs();
    let resolved = match width {
        Width::Smooth => false,
        Width::Constant(alpha) => strength * alpha >= RoughDielectric::SMOOTH_BELOW_WIDTH,
        // At the smallest width the texture can ask for.
        Width::Texture(_) => strength * SMOOTH_BELOW_ALPHA >= RoughDielectric::SMOOTH_BELOW_WIDTH,
    };
    if resolved { width } else { Width::Smooth }
}

fn metal_color(
    metal: Option<crate::description::Metal>,
    f0: Option<Value<Rgb, u32>>,
    eta: Option<Rgb>,
    k: Option<Rgb>,
) -> MetalColor {
    let same = |eta, k| {
        let fresnel = ConductorFresnel::Complex { eta, k };
        MetalColor::Same(fresnel, fresnel.average())
    };
    match (metal, f0, eta.zip(k)) {
        (Some(metal), ..) => {
            let (eta, k) = metals::index_of_refraction(metal);
            same(eta, k)
        }
        (None, Some(Value::Constant(f0)), _) => {
            let fresnel = ConductorFresnel::Schlick { f0 };
            MetalColor::Same(fresnel, fresnel.average())
        }
        (None, Some(f0), _) => MetalColor::F0(f0),
        (None, None, Some((eta, k))) => same(eta, k),
        // The description demands one of the three; a world built by hand may lack all of them.
        (None, None, None) => MetalColor::F0(Value::Constant(Rgb::ONE)),
    }
}

fn has_opacity(index: u32, kinds: &[Kind]) -> bool {
    match &kinds[index as usize] {
        Kind::Masked { .. } => true,
        Kind::Mix { a, b, .. } => has_opacity(*a, kinds) || has_opacity(*b, kinds),
        _ => false,
    }
}

fn needs_lobe(index: u32, kinds: &[Kind]) -> bool {
    match &kinds[index as usize] {
        Kind::Diffuse { .. } | Kind::Mirror { .. } => false,
        Kind::Masked { material, .. } => needs_lobe(*material, kinds),
        _ => true,
    }
}

fn interior(index: u32, materials: &[Material<u32>]) -> Option<Interior> {
    match &materials[index as usize] {
        Material::Dielectric { ior, attenuation, priority, .. } => Some(Interior {
            ior: *ior,
            sigma_a: attenuation.map(|attenuation| attenuation.sigma_a()),
            priority: *priority,
        }),
        Material::Masked { material, .. } => interior(*material, materials),
        Material::Mix { a, b, .. } => interior(*a, materials).or_else(|| interior(*b, materials)),
        _ => None,
    }
}

/// Tables already made, by index of refraction and width: equal materials share them.
#[derive(Default)]
struct KnownTables {
    coats: HashMap<(u32, Option<u32>), u32>,
    glasses: HashMap<(u32, Option<u32>), u32>,
    reflectors: HashMap<u32, u32>,
}

impl KnownTables {
    fn coat(&mut self, tables: &mut Vec<AlbedoTable<1>>, eta: f32, width: Width) -> Option<u32> {
        Self::find(&mut self.coats, tables, eta, width, coat_table)
    }

    fn glass(&mut self, tables: &mut Vec<AlbedoTable<2>>, eta: f32, width: Width) -> Option<u32> {
        Self::find(&mut self.glasses, tables, eta, width, glass_table)
    }

    /// `None` where the width is not constant: all such materials share one table.
    fn reflector(&mut self, tables: &mut Vec<ReflectorTable>, width: Width) -> Option<u32> {
        let Width::Constant(alpha) = width else {
            if let Width::Texture(_) = width {
                reflector_table(); // made now rather than under the first ray
            }
            return None;
        };
        Some(*self.reflectors.entry(alpha.to_bits()).or_insert_with(|| {
            tables.push(reflector_table_at(alpha));
            (tables.len() - 1) as u32
        }))
    }

    fn find<const C: usize>(
        known: &mut HashMap<(u32, Option<u32>), u32>,
        tables: &mut Vec<AlbedoTable<C>>,
        eta: f32,
        width: Width,
        make: impl FnOnce(f32, Widths) -> AlbedoTable<C>,
    ) -> Option<u32> {
        let widths = width.widths()?;
        let width_bits = match widths {
            Widths::One(alpha) => Some(alpha.to_bits()),
            Widths::All => None,
        };
        Some(*known.entry((eta.to_bits(), width_bits)).or_insert_with(|| {
            tables.push(make(eta, widths));
            (tables.len() - 1) as u32
        }))
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "values which are passed through unchanged")]
mod tests {
    use super::*;
    use crate::description::{
        Attenuation, Channel, Encoding, ImageData, ImagePixels, Metal, Texture, TextureFilter, Wrap,
    };
    use crate::shade::bsdf::TransportMode;
    use glam::Vec3;
    use std::sync::Arc;

    fn diffuse(albedo: f32) -> Material<u32> {
        Material::Diffuse { albedo: Rgb::splat(albedo).into() }
    }

    fn glass(roughness: Value<f32, u32>, attenuation: Option<Attenuation>) -> Material<u32> {
        Material::Dielectric { ior: 1.5, roughness, attenuation, priority: 0 }
    }

    fn red(bsdf: &Bsdf) -> f32 {
        bsdf.albedo(Vec3::Z).x
    }

    /// An image of 2 × 1 texels with these values, looked up without filtering.
    fn two_texels(left: f32, right: f32) -> RenderTexture {
        let pixels = [left, right].map(|v| [v, v, v, 1.0]).to_vec();
        Texture::Image {
            file: Arc::new(ImageData { width: 2, height: 1, pixels: ImagePixels::Rgba32F(pixels) }),
            encoding: Encoding::Linear,
            wrap: Wrap::Repeat,
            filter: TextureFilter::Nearest,
            channel: Channel::Luminance,
            repeat: Vec2::ONE,
            offset: Vec2::ZERO,
        }
    }

    const LEFT: Vec2 = Vec2::new(0.25, 0.5);
    const RIGHT: Vec2 = Vec2::new(0.75, 0.5);

    /// Oracle: counting over evenly spaced lobe numbers; what is left of them is even again.
    #[test]
    fn a_mix_chooses_its_sides_by_their_amount() {
        let mix = Material::Mix { a: 0, b: 1, amount: 0.3.into() };
        let table = MaterialTable::new(&[diffuse(0.2), diffuse(0.9), mix], Vec::new());
        let n = 10_000;
        let (mut count, mut left) = (0, 0.0);
        for i in 0..n {
            let mut u = (i as f32 + 0.5) / n as f32;
            count += u32::from(red(&table.bsdf(2, Vec2::ZERO, &mut u)) > 0.5);
            assert!((0.0..1.0).contains(&u));
            left += f64::from(u);
        }
        assert_eq!(count, 3000);
        assert!((left / f64::from(n) - 0.5).abs() < 1e-4, "mean {}", left / f64::from(n));
    }

    #[test]
    fn a_side_of_amount_zero_is_never_chosen() {
        let mix = |amount: f32| Material::Mix { a: 0, b: 1, amount: amount.into() };
        let table =
            MaterialTable::new(&[diffuse(0.2), diffuse(0.9), mix(0.0), mix(1.0)], Vec::new());
        for u in [0.0, 0.5, 1.0_f32.next_down()] {
            assert_eq!(red(&table.bsdf(2, Vec2::ZERO, &mut u.clone())), 0.2);
            assert_eq!(red(&table.bsdf(3, Vec2::ZERO, &mut u.clone())), 0.9);
        }
    }

    /// Oracle: a leaf of coverage 0.5 mixed half and half with a solid stops ¾ of the rays, a third of them
    /// on the leaf.
    #[test]
    fn opacity_goes_through_mixes_and_masks() {
        let leaf = Material::Masked { material: 0, opacity: 0.5.into() };
        let mix = Material::Mix { a: 1, b: 2, amount: 0.5.into() };
        let nested = Material::Masked { material: 3, opacity: 0.5.into() };
        let table =
            MaterialTable::new(&[diffuse(0.9), diffuse(0.2), leaf, mix, nested], Vec::new());
        let opacity = [0, 1, 2, 3, 4].map(|material| table.opacity(material, Vec2::ZERO));
        assert_eq!(opacity, [1.0, 1.0, 0.5, 0.75, 0.375]);
        assert_eq!(
            [0, 2, 3, 4].map(|material| table.has_opacity(material)),
            [false, true, true, true]
        );
        let n = 3000;
        let on_leaf = (0..n)
            .filter(|&i| {
                let mut u = (i as f32 + 0.5) / n as f32;
                red(&table.bsdf(3, Vec2::ZERO, &mut u)) > 0.5
            })
            .count();
        assert!((on_leaf as f32 / n as f32 - 1.0 / 3.0).abs() < 1e-3, "{on_leaf} of {n}");
    }

    /// Beer–Lambert: the colour is what is left after the distance.
    #[test]
    fn solids_know_their_interior() {
        let color = Rgb::new(0.9, 0.5, 0.1);
        let amber = glass(0.0.into(), Some(Attenuation { color, distance: 0.02 }));
        let mask = Material::Masked { material: 0, opacity: 0.5.into() };
        let table =
            MaterialTable::new(&[amber, mask, glass(0.0.into(), None), diffuse(0.5)], Vec::new());
        for material in [0, 1] {
            let sigma_a = table.attenuation(material).expect("amber absorbs");
            let left = (-sigma_a * 0.02).exp();
            assert!((left - color).abs().max_element() < 1e-6, "{left}");
        }
        assert_eq!(table.interior(2), Some(Interior { ior: 1.5, sigma_a: None, priority: 0 }));
        assert_eq!(table.attenuation(2), None);
        assert!(table.is_dielectric(2) && !table.is_dielectric(3));
    }

    /// Roughness from a texture: smooth on one side, rough on the other, of every model which has it.
    #[test]
    fn textured_roughness_switches_between_smooth_and_rough() {
        let roughness: Value<f32, u32> = Value::Texture(0);
        let materials = [
            glass(roughness, None),
            Material::Conductor {
                metal: Some(Metal::Gold),
                f0: None,
                eta: None,
                k: None,
                roughness,
            },
            Material::Plastic { albedo: Rgb::ONE.into(), ior: 1.5, roughness },
            Material::Principled {
                base_color: Rgb::ONE.into(),
                metallic: 1.0.into(),
                roughness,
                ior: 1.5,
                transmission: 0.0.into(),
            },
        ];
        let table = MaterialTable::new(&materials, vec![two_texels(0.0, 0.6)]);
        let wo = Vec3::new(0.6, 0.0, 0.8);
        for material in 0..4 {
            for (uv, rough) in [(LEFT, false), (RIGHT, true)] {
                let bsdf = table.bsdf(material, uv, &mut 0.5);
                let sample = bsdf
                    .sample(wo, 0.01, Vec2::new(0.3, 0.2), TransportMode::Radiance)
                    .expect("the number 0.01 chooses the mirror lobe");
                assert_eq!(sample.delta, !rough, "material {material} at {uv}");
            }
        }
    }

    /// A conductor is what its metal, its index or its reflectance says, in this order of the scene file.
    #[test]
    fn conductors_take_any_of_their_three_forms() {
        let conductor = |metal, f0: Option<Rgb>, eta, k| Material::Conductor {
            metal,
            f0: f0.map(Value::Constant),
            eta,
            k,
            roughness: 0.0.into(),
        };
        let gold = Rgb::new(0.924, 0.788, 0.404);
        let (eta, k) = metals::index_of_refraction(Metal::Gold);
        let materials = [
            conductor(Some(Metal::Gold), None, None, None),
            conductor(None, Some(gold), None, None),
            conductor(None, None, Some(eta), Some(k)),
        ];
        let table = MaterialTable::new(&materials, Vec::new());
        for material in 0..3 {
            let albedo = table.bsdf(material, Vec2::ZERO, &mut 0.5).albedo(Vec3::Z);
            assert!((albedo - gold).abs().max_element() < 1e-3, "{material}: {albedo}");
        }
    }

    #[test]
    fn cycles_of_materials_are_found() {
        let mask = |material| Material::Masked { material, opacity: 0.5.into() };
        let mix = |a, b| Material::Mix { a, b, amount: 0.5.into() };
        assert_eq!(material_cycle(&[diffuse(0.5), mix(0, 0), mask(1), mix(1, 2)]), None);
        assert_eq!(material_cycle(&[mask(0)]), Some(0));
        assert_eq!(material_cycle(&[diffuse(0.5), mix(0, 2), mask(1)]), Some(1));
    }

    #[test]
    fn equal_materials_share_their_tables() {
        let rough = glass(0.5.into(), None);
        let table =
            MaterialTable::new(&[rough.clone(), rough, glass(0.6.into(), None)], Vec::new());
        assert_eq!(table.glasses.len(), 2);
    }

    /// A picture brighter than white is not a reflectance: the furnace would gain energy.
    #[test]
    fn shares_of_light_are_limited_to_one() {
        let bright = Material::Diffuse { albedo: Value::Texture(0) };
        let table = MaterialTable::new(&[bright], vec![two_texels(7.0, -1.0)]);
        assert_eq!(red(&table.bsdf(0, LEFT, &mut 0.5)), 1.0);
        assert_eq!(red(&table.bsdf(0, RIGHT, &mut 0.5)), 0.0);
        assert_eq!(table.color(&Value::Texture(0), LEFT), Rgb::splat(7.0));
    }
}
