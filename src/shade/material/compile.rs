//! Materials, compiled: what does not depend on the point is resolved.

use super::relief::Relief;
use super::{Compiled, Interior, MaterialTable, material_order};
use crate::color::spectrum::WavelengthSet;
use crate::description::{Material, Rgb, Scattering, Value, index_at_d};
use crate::shade::bsdf::{
    AlbedoTable, ConductorFresnel, ReflectorTable, RoughDielectric, SMOOTH_BELOW_ALPHA, Widths,
    coat_table, dielectric_average, glass_table, reflector_table, reflector_table_at,
};
use crate::shade::metals;
use crate::shade::relative::RelativeTables;
use crate::shade::texture::{TexturePoint, Textures};
use std::collections::HashMap;

/// A material with its constants resolved.
#[derive(Clone, Debug)]
pub(super) enum Kind {
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
        tint: Value<Rgb, u32>,
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
    Relief {
        material: u32,
    },
}

/// How a metal reflects.
#[derive(Clone, Debug)]
pub(super) enum MetalColor {
    /// One reflectance everywhere, and its cosine-weighted mean.
    Same(ConductorFresnel, Rgb),
    /// Reflectance at normal incidence.
    F0(Value<Rgb, u32>),
}

/// Width `α` of the microfacets.
#[derive(Clone, Copy, Debug)]
pub(in crate::shade) enum Width {
    Smooth,
    Constant(f32),
    /// The texture holds the roughness.
    Texture(u32),
}

impl Width {
    pub(in crate::shade) fn new(roughness: Value<f32, u32>) -> Self {
        match roughness {
            Value::Constant(roughness) => match alpha(roughness) {
                Some(alpha) => Self::Constant(alpha),
                None => Self::Smooth,
            },
            Value::Texture(texture) => Self::Texture(texture),
        }
    }

    /// Whether it depends on the place.
    pub(super) fn is_textured(self) -> bool {
        matches!(self, Self::Texture(_))
    }

    /// Bounds of the width over the surface; a texture may ask for any.
    pub(super) fn narrowest(self) -> f32 {
        if let Self::Constant(alpha) = self { alpha } else { 0.0 }
    }

    pub(super) fn widest(self) -> f32 {
        match self {
            Self::Smooth => 0.0,
            Self::Constant(alpha) => alpha,
            Self::Texture(_) => 1.0,
        }
    }

    pub(in crate::shade) fn widths(self) -> Option<Widths> {
        match self {
            Self::Smooth => None,
            Self::Constant(alpha) => Some(Widths::One(alpha)),
            Self::Texture(_) => Some(Widths::All),
        }
    }
}

/// The GGX width of a perceptual roughness; `None` is smooth.
#[inline]
pub(in crate::shade) fn alpha(roughness: f32) -> Option<f32> {
    let roughness = roughness.clamp(0.0, 1.0);
    let alpha = roughness * roughness;
    (alpha >= SMOOTH_BELOW_ALPHA).then_some(alpha)
}

impl MaterialTable {
    /// Compiles the materials of a frame; their references are indices into `materials` and `textures`.
    ///
    /// # Panics
    /// If a reference is out of range or [`material_order`] finds none.
    pub fn new(materials: &[Material<u32>], textures: Textures) -> Self {
        let order = material_order(materials).expect("the description rejects what has no order");
        let mut table = Self {
            materials: Vec::new(),
            textures,
            coats: Vec::new(),
            glasses: Vec::new(),
            reflectors: Vec::new(),
            curves: Vec::new(),
            relative: RelativeTables::new(materials),
            spectral: Vec::new(),
            seen_at: None,
        };
        let parts = parts(&order, materials, &table.textures);
        table.spectral = parts.iter().map(|parts| parts.has_spectrum).collect();
        let mut known = KnownTables::default();
        let kinds: Vec<Kind> =
            materials.iter().map(|material| table.compile(material, &mut known)).collect();
        let curves: Vec<Option<u32>> =
            materials.iter().map(|material| table.curve(material)).collect();
        table.materials = kinds
            .into_iter()
            .zip(&parts)
            .zip(materials)
            .map(|((kind, parts), material)| Compiled {
                kind,
                has_opacity: parts.has_opacity,
                lookups: parts.lookups,
                needs_lobe: parts.needs_lobe,
                interior: parts
                    .solid
                    .map(|solid| interior(&materials[solid as usize], &table.textures)),
                curve: parts.solid.and_then(|solid| curves[solid as usize]),
                disperses: parts.disperses,
                relief: relief(material),
            })
            .collect();
        table
    }

    /// Keeps the curve of a dispersive solid.
    fn curve(&mut self, material: &Material<u32>) -> Option<u32> {
        let Material::Dielectric { ior, dispersion: Some(dispersion), .. } = material else {
            return None;
        };
        self.curves.push(dispersion.curve(*ior));
        Some((self.curves.len() - 1) as u32)
    }

    fn compile(&mut self, material: &Material<u32>, known: &mut KnownTables) -> Kind {
        match *material {
            Material::Diffuse { albedo } => Kind::Diffuse { albedo },
            Material::Mirror { reflectance } => Kind::Mirror { reflectance },
            Material::Dielectric { ior, ref dispersion, roughness, tint, .. } => {
                let ior = index_at_d(ior, dispersion.as_ref());
                let width = glass_width(ior, Width::new(roughness));
                let table = known.glass(&mut self.glasses, ior, width);
                let average = dielectric_average(ior);
                Kind::Dielectric { eta: ior, width, average, table, tint }
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
            Material::Bump { material, .. } | Material::NormalMap { material, .. } => {
                Kind::Relief { material }
            }
        }
    }
}

/// The width of a rough dielectric, or smooth where its transmitted lobe can nowhere be resolved.
pub(in crate::shade) fn glass_width(eta: f32, width: Width) -> Width {
    if RoughDielectric::resolves(eta, width.widest()) { width } else { Width::Smooth }
}

impl Kind {
    /// The same with metals seen at the wavelengths of a set; other colours are seen where they are looked up.
    pub(super) fn seen_at(&self, set: &WavelengthSet) -> Self {
        let Self::Conductor { fresnel: MetalColor::Same(fresnel, _), width, table } = self else {
            return self.clone();
        };
        let fresnel = match *fresnel {
            ConductorFresnel::Complex { eta, k } => {
                ConductorFresnel::Complex { eta: set.between(eta), k: set.between(k) }
            }
            ConductorFresnel::Schlick { f0 } => ConductorFresnel::Schlick { f0: set.from_rgb * f0 },
        };
        let fresnel = MetalColor::Same(fresnel, fresnel.average());
        Self::Conductor { fresnel, width: *width, table: *table }
    }
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

/// What is true of a material because of those that it is made of.
#[derive(Clone, Copy, Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is asked by itself")]
struct Parts {
    has_opacity: bool,
    /// As in [`Compiled`].
    lookups: u64,
    needs_lobe: bool,
    has_spectrum: bool,
    disperses: bool,
    /// The first solid, itself perhaps.
    solid: Option<u32>,
}

/// [`Parts`] of each material, asked in an order in which its parts come first.
fn parts(order: &[u32], materials: &[Material<u32>], textures: &Textures) -> Vec<Parts> {
    let mut all = vec![Parts::default(); materials.len()];
    for &index in order {
        let material = &materials[index as usize];
        let mut own = Parts { lookups: 1, ..Parts::default() };
        match material {
            Material::Dielectric { dispersion, .. } => {
                own.solid = Some(index);
                own.disperses = dispersion.is_some();
                own.needs_lobe = true;
            }
            Material::Masked { .. } => own.has_opacity = true,
            Material::Diffuse { .. }
            | Material::Mirror { .. }
            | Material::Bump { .. }
            | Material::NormalMap { .. } => {}
            _ => own.needs_lobe = true,
        }
        let mut texture = |texture: u32| {
            own.has_spectrum |= textures.is_spectrum(texture);
            Ok::<_, std::convert::Infallible>(())
        };
        let mut found = Vec::new();
        let Ok(_) = material.clone().map_refs(&mut texture, &mut |part: u32| {
            found.push(part);
            Ok(())
        });
        for part in found {
            let part = all[part as usize];
            own = Parts {
                has_opacity: own.has_opacity || part.has_opacity,
                lookups: own.lookups.saturating_add(part.lookups),
                needs_lobe: own.needs_lobe || part.needs_lobe,
                has_spectrum: own.has_spectrum || part.has_spectrum,
                disperses: own.disperses || part.disperses,
                solid: own.solid.or(part.solid),
            };
        }
        all[index as usize] = own;
    }
    all
}

fn relief(material: &Material<u32>) -> Option<Relief> {
    match *material {
        Material::Bump { height, strength, .. } => Some(Relief::Bump { height, strength }),
        Material::NormalMap { map, strength, green, .. } => {
            Some(Relief::Normals { map, strength, green })
        }
        _ => None,
    }
}

/// What is inside a solid.
fn interior(solid: &Material<u32>, textures: &Textures) -> Interior {
    let Material::Dielectric {
        ior,
        dispersion,
        attenuation,
        absorption,
        scattering,
        emission,
        density,
        priority,
        ..
    } = solid
    else {
        unreachable!("a solid is a dielectric")
    };
    // What there is nothing of is not there.
    let (factor, texture) = match *density {
        Value::Constant(factor) => (factor, None),
        Value::Texture(texture) => (1.0, Some(texture)),
    };
    let absorption = absorption.filter(|_| factor > 0.0).map(|spectrum| (spectrum, factor));
    let by_spectrum = |(spectrum, factor): (u32, f32)| {
        // Where wavelengths are not told apart its colour counts; nothing absorbs less than nothing.
        let color = textures.color(spectrum, &TexturePoint::at(glam::Vec2::ZERO));
        (color * factor).max(Rgb::ZERO)
    };
    let sigma_a = attenuation.filter(|_| factor > 0.0).map(|a| a.sigma_a() * factor);
    let sigma_a = absorption.map(by_spectrum).or(sigma_a);
    let scattering = scattering.filter(|_| factor > 0.0).map(|scattering| Scattering {
        coefficient: scattering.coefficient * factor,
        ..scattering
    });
    let emission = *emission * factor;
    let empty = sigma_a.is_none() && scattering.is_none() && emission == Rgb::ZERO;
    Interior {
        ior: index_at_d(*ior, dispersion.as_ref()),
        sigma_a,
        absorption,
        scattering,
        emission,
        density: texture.filter(|_| !empty),
        priority: *priority,
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
