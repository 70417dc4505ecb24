//! From a point on a surface to how it scatters light.
//!
//! ```text
//! material (of the frame) + uv ── MaterialTable::bsdf ──> Bsdf ── sample, evaluate ──> wi, weight, pdf
//! ```
//!
//! [`MaterialTable`] holds the materials and textures of a frame; at a point one of them becomes a
//! [`Bsdf`], a small value which draws directions and evaluates pairs of them in the local shading
//! frame. A new model is one file in `bsdf/` and one variant of [`Bsdf`]; the quality of the energy
//! balance is stated in `bsdf/energy.rs`.

mod bsdf;
mod material;
pub mod medium;
mod metals;
pub mod nesting;
mod relative;
mod shading_normal;
pub mod texture;

pub use bsdf::{
    Bsdf, BsdfSample, BsdfValue, Diffuse, Mirror, Principled, RoughConductor, RoughDielectric,
    RoughPlastic, SmoothConductor, SmoothDielectric, SmoothPlastic, ThinGlass, TransportMode,
};
pub use material::{
    CausticLobe, Chosen, Interior, MaterialTable, Surroundings, bent_normal, material_order,
};
pub use shading_normal::{InnerReflections, ShadedBsdf};
pub use texture::{Moments, Pyramids, RenderTexture, TextureNeeds, TexturePoint, Textures};
