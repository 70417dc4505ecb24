//! How sharply, and how strongly, a material passes light on.

use super::compile::{Kind, MetalColor, Width};
use super::{MaterialTable, TexturePoint};
use crate::color::luminance;
use crate::description::{Rgb, Value};
use crate::shade::bsdf::{SCHLICK_AVERAGE, normal_reflectance};
use glam::Vec2;
use std::collections::{HashMap, HashSet};

/// Places along each side of the unit square at which a material is looked at.
const PLACES: u32 = 8;

/// What weaker lobes pass on is lost beside the diffuse base on which they lie: more than the 9 % which a smooth coat of index
/// 1.5 reflects of light from all around.
const LEAST_SHARE: f64 = 0.125;

/// A lobe by which light can make a caustic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CausticLobe {
    /// Share of the surface which has it.
    pub area: f64,
    /// Share of the light from all around which it passes on there, as luminance.
    pub share: f64,
    /// Its GGX width; 0 is a lobe without extent.
    pub alpha: f64,
    /// Whether it lies on a diffuse base.
    pub is_coat: bool,
    /// Whether photons of caustics are kept behind it: nothing around it gathers photons.
    pub for_photons: bool,
}

impl CausticLobe {
    /// Whether what it casts is worth having.
    pub fn is_strong(&self) -> bool {
        self.share >= LEAST_SHARE
    }
}

impl MaterialTable {
    /// The lobes of a material, where its textures vary of some places.
    pub fn caustic_lobes(&self, material: u32, min_alpha: f32) -> Vec<CausticLobe> {
        let mut lobes = Vec::new();
        for k in 0..PLACES * PLACES {
            let uv = Vec2::new((k % PLACES) as f32 + 0.5, (k / PLACES) as f32 + 0.5);
            let uv = uv / PLACES as f32;
            let at = TexturePoint { p: uv.extend(0.0).as_dvec3(), ..TexturePoint::at(uv) };
            let weight = 1.0 / f64::from(PLACES * PLACES);
            for (part, area) in self.areas(material, &at) {
                self.add_lobes(part, &at, weight * area, min_alpha, &mut lobes);
            }
        }
        lobes
    }

    /// The materials which one is made of at a point, those that are made of no others, and how much of the area each has.
    ///
    /// Each is asked once, when all that is made of it is known: as many ways as there are may lead to it.
    fn areas(&self, material: u32, at: &TexturePoint) -> Vec<(u32, f64)> {
        let mut order = Vec::new();
        self.put_parts_first(material, &mut HashSet::new(), &mut order);
        let mut areas: HashMap<u32, f64> = HashMap::from([(material, 1.0)]);
        let number = |value: &Value<f32, u32>| f64::from(self.scalar(value, at).clamp(0.0, 1.0));
        let mut leaves = Vec::new();
        for part in order.into_iter().rev() {
            let area = areas[&part];
            let mut give = |part: u32, share: f64| *areas.entry(part).or_default() += area * share;
            match &self.materials[part as usize].kind {
                Kind::Mix { a, b, amount } => {
                    let amount = number(amount);
                    give(*a, 1.0 - amount);
                    give(*b, amount);
                }
                Kind::Masked { material, opacity } => give(*material, number(opacity)),
                Kind::Relief { material } => give(*material, 1.0),
                _ => leaves.push((part, area)),
            }
        }
        leaves
    }

    /// The parts of a material and itself, each after its own parts.
    fn put_parts_first(&self, material: u32, seen: &mut HashSet<u32>, order: &mut Vec<u32>) {
        if !seen.insert(material) {
            return;
        }
        match &self.materials[material as usize].kind {
            Kind::Mix { a, b, .. } => {
                // The first of them is the last of the order, and so the first to be asked.
                self.put_parts_first(*b, seen, order);
                self.put_parts_first(*a, seen, order);
            }
            Kind::Masked { material, .. } | Kind::Relief { material } => {
                self.put_parts_first(*material, seen, order);
            }
            _ => {}
        }
        order.push(material);
    }

    /// Whether some lobe of a material casts caustics which photons bring and which are worth having.
    pub fn casts_caustics(&self, material: u32, min_alpha: f32) -> bool {
        let mut lobes = self.caustic_lobes(material, min_alpha).into_iter();
        lobes.any(|lobe| lobe.for_photons && lobe.is_strong())
    }

    /// Adds what a material that is made of no others has at a point.
    fn add_lobes(
        &self,
        material: u32,
        at: &TexturePoint,
        area: f64,
        min_alpha: f32,
        lobes: &mut Vec<CausticLobe>,
    ) {
        let mut add = |share: f64, width: Width, is_coat: bool| {
            let alpha = self.alpha(width, at).map_or(0.0, f64::from);
            // What is gathered at once with a diffuse base, or at a lobe as wide as this, is no caustic to photons.
            let for_photons = alpha == 0.0 || !(is_coat || alpha >= f64::from(min_alpha));
            if share <= 0.0 || area <= 0.0 {
                return;
            }
            let lobe = CausticLobe { area, share, alpha, is_coat, for_photons };
            match lobes.last_mut() {
                Some(last) if *last == (CausticLobe { area: last.area, ..lobe }) => {
                    last.area += area;
                }
                _ => lobes.push(lobe),
            }
        };
        let number = |value: &Value<f32, u32>| f64::from(self.scalar(value, at).clamp(0.0, 1.0));
        let share = |value: &Value<Rgb, u32>| f64::from(luminance(self.share(value, at)));
        match &self.materials[material as usize].kind {
            Kind::Diffuse { .. } => {}
            Kind::Mirror { reflectance } => add(share(reflectance), Width::Smooth, false),
            Kind::ThinGlass { tint, .. } => add(share(tint), Width::Smooth, false),
            Kind::Dielectric { width, .. } => add(1.0, *width, false),
            Kind::Conductor { fresnel, width, .. } => {
                let reflected = match fresnel {
                    MetalColor::Same(_, average) => f64::from(luminance(*average)),
                    MetalColor::F0(f0) => schlick_average(share(f0)),
                };
                add(reflected, *width, false);
            }
            Kind::Plastic { average, width, .. } => add(f64::from(*average), *width, true),
            Kind::Principled { base_color, metallic, width, ior, transmission, .. } => {
                let (metallic, transmission) = (number(metallic), number(transmission));
                let base = share(base_color);
                let f0 = f64::from(normal_reflectance(*ior));
                let reflected = schlick_average(f0 + (base - f0) * metallic);
                let below = base * (1.0 - metallic);
                let diffuse = below * (1.0 - transmission) > 0.0;
                add(reflected, *width, diffuse);
                add((1.0 - schlick_average(f0)) * below * transmission, *width, diffuse);
            }
            Kind::Mix { .. } | Kind::Masked { .. } | Kind::Relief { .. } => {
                unreachable!("its parts are asked")
            }
        }
    }
}

/// What Schlick's approximation reflects of light from all around.
fn schlick_average(f0: f64) -> f64 {
    f0 + (1.0 - f0) * f64::from(SCHLICK_AVERAGE)
}
