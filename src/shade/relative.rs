//! Rough interfaces between two media, neither of which is air.
//!
//! The energy tables of a rough dielectric hold for one relative index of refraction. Where solids are
//! nested there is one for each pair of a rough material and a medium around it, of which a scene shows
//! few: a table is made when the first ray asks for it. What it holds follows from the pair alone, so
//! that it does not matter which ray that is.

use super::bsdf::{
    AlbedoTable, Bsdf, RoughDielectric, SmoothDielectric, dielectric_average, glass_table,
};
use super::material::{Width, alpha, glass_width};
use crate::description::{Material, Rgb, index_at_d};
use std::sync::OnceLock;

/// The tables of all pairs that can be met.
#[derive(Clone, Debug, Default)]
pub(super) struct RelativeTables {
    /// By material, those that it may be surrounded by; none for what is not rough.
    pairs: Vec<Vec<Pair>>,
}

/// A rough material in a medium.
#[derive(Clone, Debug)]
pub(super) struct Pair {
    outside: f32,
    /// Index inside over outside.
    eta: f32,
    width: Width,
    made: OnceLock<(AlbedoTable<2>, f32)>,
}

impl RelativeTables {
    pub(super) fn new(materials: &[Material<u32>]) -> Self {
        let mut indices: Vec<f32> = materials
            .iter()
            .filter_map(|material| match material {
                Material::Dielectric { ior, dispersion, .. } => {
                    Some(index_at_d(*ior, dispersion.as_ref()))
                }
                _ => None,
            })
            .collect();
        indices.sort_unstable_by(f32::total_cmp);
        indices.dedup();
        let pairs_of = |material: &Material<u32>| match *material {
            Material::Dielectric { ior, ref dispersion, roughness, .. } => {
                let ior = index_at_d(ior, dispersion.as_ref());
                let around = |&outside: &f32| Pair::new(ior, outside, Width::new(roughness));
                indices.iter().filter_map(around).collect()
            }
            _ => Vec::new(),
        };
        Self { pairs: materials.iter().map(pairs_of).collect() }
    }

    /// The interface of a material with a medium of this index around it; `None` if it is smooth.
    #[inline]
    #[expect(clippy::float_cmp, reason = "the index of a material, passed through unchanged")]
    pub(super) fn find(&self, material: u32, outside: f32) -> Option<&Pair> {
        self.pairs[material as usize].iter().find(|pair| pair.outside == outside)
    }
}

impl Pair {
    /// `None` where the interface is smooth.
    fn new(inside: f32, outside: f32, width: Width) -> Option<Self> {
        let eta = inside / outside;
        let width = glass_width(eta, width);
        width.widths()?;
        Some(Self { outside, eta, width, made: OnceLock::new() })
    }

    /// How the interface scatters; `roughness` reads a texture.
    pub(super) fn bsdf(&self, eta: f32, tint: Rgb, roughness: impl FnOnce(u32) -> f32) -> Bsdf<'_> {
        let width = match self.width {
            Width::Smooth => None,
            Width::Constant(alpha) => Some(alpha),
            Width::Texture(texture) => alpha(roughness(texture))
                .filter(|&alpha| RoughDielectric::resolves(self.eta, alpha)),
        };
        match width.zip(self.width.widths()) {
            None => Bsdf::SmoothDielectric(SmoothDielectric { eta, tint }),
            Some((alpha, widths)) => {
                let make = || (glass_table(self.eta, widths), dielectric_average(self.eta));
                let (table, average) = self.made.get_or_init(make);
                let rough = RoughDielectric::new(eta, table.at(alpha), *average);
                Bsdf::RoughDielectric(rough.tinted(tint))
            }
        }
    }
}
