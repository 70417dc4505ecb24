//! The materials of a frame, compiled: what can be computed before a ray arrives is.
//!
//! A material says what a surface is made of; at a point (uv) it becomes a [`Bsdf`]. Constants are
//! resolved once: metals to their indices, roughness to the GGX width `α = roughness²`, the energy
//! tables of rough interfaces.

use super::bsdf::{
    AlbedoTable, Bsdf, ConductorFresnel, Diffuse, Mirror, Principled, PrincipledParameters,
    ReflectorLobe, ReflectorTable, RoughConductor, RoughDielectric, RoughPlastic,
    SMOOTH_BELOW_ALPHA, SmoothConductor, SmoothDielectric, SmoothPlastic, ThinGlass, Widths,
    coat_table, dielectric_average, glass_table, reflector_table,
};
use super::metals;
use super::texture::{self, RenderTexture};
use crate::description::{Material, Rgb, Value};
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
}

/// What is inside a solid dielectric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interior {
    /// Index of refraction relative to vacuum.
    pub ior: f32,
    /// Absorption coefficient per metre; `None` is perfectly clear.
    pub sigma_a: Option<Rgb>,
}

/// A [`Material`] with all that does not depend on the point resolved.
#[derive(Clone, Debug)]
struct Compiled {
    kind: Kind,
    /// Whether it, or one that it is mixed of, is masked.
    has_opacity: bool,
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
enum Width {
    Smooth,
    Constant(f32),
    /// The texture holds the roughness.
    Texture(u32),
}

impl Width {
    fn new(roughness: &Value<f32, u32>) -> Self {
        match *roughness {
            Value::Constant(roughness) => match alpha(roughness) {
                Some(alpha) => Self::Constant(alpha),
                None => Self::Smooth,
            },
            Value::Texture(texture) => Self::Texture(texture),
        }
    }

    fn widths(self) -> Option<Widths> {
        match self {
            Self::Smooth => None,
            Self::Constant(alpha) => Some(Widths::One(alpha)),
            Self::Texture(_) => Some(Widths::All),
        }
    }
}

/// The GGX width of a perceptual roughness; `None` is smooth.
#[inline]
fn alpha(roughness: f32) -> Option<f32> {
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
        let mut table =
            Self { materials: Vec::new(), textures, coats: Vec::new(), glasses: Vec::new() };
        let mut known = KnownTables::default();
        let kinds: Vec<Kind> =
            materials.iter().map(|material| table.compile(material, &mut known)).collect();
        table.materials = kinds
            .iter()
            .enumerate()
            .map(|(index, kind)| Compiled {
                kind: kind.clone(),
                has_opacity: has_opacity(index as u32, &kinds),
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
                let width = glass_width(ior, Width::new(&roughness));
                let table = known.glass(&mut self.glasses, ior, width);
                Kind::Dielectric { eta: ior, width, average: dielectric_average(ior), table }
            }
            Material::ThinGlass { ior, tint } => Kind::ThinGlass { eta: ior, tint },
            Material::Conductor { metal, f0, eta, k, roughness } => {
                let width = Width::new(&roughness);
                Kind::Conductor { fresnel: metal_color(metal, f0, eta, k), width }
            }
            Material::Plastic { albedo, ior, roughness } => {
                let width = Width::new(&roughness);
                let table = known.coat(&mut self.coats, ior, width);
                Kind::Plastic { albedo, eta: ior, width, average: dielectric_average(ior), table }
            }
            Material::Principled { base_color, metallic, roughness, ior, transmission } => {
                Kind::Principled {
                    base_color,
                    metallic,
                    width: Width::new(&roughness),
                    ior,
                    transmission,
                }
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
            Kind::Conductor { fresnel, width } => {
                let (fresnel, average) = match fresnel {
                    MetalColor::Same(fresnel, average) => (*fresnel, *average),
                    MetalColor::F0(f0) => {
                        let fresnel = ConductorFresnel::Schlick { f0: self.share(f0, uv) };
                        (fresnel, fresnel.average())
                    }
                };
                match self.reflector(*width, uv) {
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
            Kind::Principled { base_color, metallic, width, ior, transmission } => {
                let parameters = PrincipledParameters {
                    base_color: self.share(base_color, uv),
                    metallic: self.scalar(metallic, uv).clamp(0.0, 1.0),
                    ior: *ior,
                    transmission: self.scalar(transmission, uv).clamp(0.0, 1.0),
                };
                Bsdf::Principled(Principled::new(&parameters, self.reflector(*width, uv)))
            }
            Kind::Mix { a, b, amount } => {
                let side = self.choose_side(*a, *b, amount, uv, u_lobe);
                self.bsdf(side, uv, u_lobe)
            }
            Kind::Masked { material, .. } => self.bsdf(*material, uv, u_lobe),
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

    /// Whether [`MaterialTable::opacity`] can be other than 1.
    #[inline]
    pub fn has_opacity(&self, material: u32) -> bool {
        self.materials[material as usize].has_opacity
    }

    /// What a solid of this material holds; `None` for all but [`Material::Dielectric`], masked or
    /// mixed with something else. Of a mix of two dielectrics the first counts.
    #[inline]
    pub fn interior(&self, material: u32) -> Option<Interior> {
        self.materials[material as usize].interior
    }

    /// Absorption coefficient inside, per metre; `None` where nothing is absorbed.
    #[inline]
    pub fn attenuation(&self, material: u32) -> Option<Rgb> {
        self.interior(material).and_then(|interior| interior.sigma_a)
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

    #[inline]
    fn reflector(&self, width: Width, uv: Vec2) -> Option<ReflectorLobe<'static>> {
        self.alpha(width, uv).map(|alpha| {
            let table: &'static ReflectorTable = reflector_table();
            ReflectorLobe::new(table.at(alpha))
        })
    }

    /// Chooses a side of a mix by `u_lobe < p` and leaves in it a number uniform in `[0, 1)`.
    fn choose_side(
        &self,
        a: u32,
        b: u32,
        amount: &Value<f32, u32>,
        uv: Vec2,
        u_lobe: &mut f32,
    ) -> u32 {
        let amount = self.scalar(amount, uv).clamp(0.0, 1.0);
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
fn glass_width(eta: f32, width: Width) -> Width {
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

fn interior(index: u32, materials: &[Material<u32>]) -> Option<Interior> {
    match &materials[index as usize] {
        Material::Dielectric { ior, attenuation, .. } => Some(Interior {
            ior: *ior,
            sigma_a: attenuation.map(|attenuation| attenuation.sigma_a()),
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
}

impl KnownTables {
    fn coat(&mut self, tables: &mut Vec<AlbedoTable<1>>, eta: f32, width: Width) -> Option<u32> {
        Self::find(&mut self.coats, tables, eta, width, coat_table)
    }

    fn glass(&mut self, tables: &mut Vec<AlbedoTable<2>>, eta: f32, width: Width) -> Option<u32> {
        Self::find(&mut self.glasses, tables, eta, width, glass_table)
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
