//! What surfaces are made of, as a scene file says it.

use super::{Dispersion, Rgb, Value};
use serde::Deserialize;

/// A surface material. `R` refers to textures and to other materials.
///
/// `roughness` is the perceptual roughness in `[0, 1]` of glTF and Disney 2012: the GGX width is
/// `α = roughness²`; 0 is perfectly smooth.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[serde(bound(
    deserialize = "R: Deserialize<'de>, Value<Rgb, R>: Deserialize<'de>, Value<f32, R>: Deserialize<'de>"
))]
pub enum Material<R> {
    /// Lambert's ideal diffuse reflector.
    Diffuse {
        /// Share of the light which is reflected, per channel, in `[0, 1]`.
        #[serde(default = "half")]
        albedo: Value<Rgb, R>,
    },
    /// A perfect mirror whose reflectance does not depend on the angle.
    Mirror {
        /// Share of the light which is reflected, per channel, in `[0, 1]`.
        #[serde(default = "one")]
        reflectance: Value<Rgb, R>,
    },
    /// A solid of clear glass, water, crystal: the shape must enclose a volume.
    Dielectric {
        /// Index of refraction relative to vacuum, at the d line where there is dispersion; that counts which says the
        /// index itself.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// How the index depends on the wavelength; `None`: not at all.
        #[serde(default)]
        dispersion: Option<Dispersion>,
        /// Perceptual roughness of the interface.
        #[serde(default = "smooth")]
        roughness: Value<f32, R>,
        /// Share of the refracted light that each crossing of the surface lets through, per channel, in `[0, 1]`.
        #[serde(default = "one")]
        tint: Value<Rgb, R>,
        /// Absorption inside; `None` is perfectly clear.
        #[serde(default)]
        attenuation: Option<Attenuation>,
        /// Absorption by wavelength, per metre, in place of `attenuation`: a texture which is a spectrum.
        #[serde(default = "nothing")]
        absorption: Option<R>,
        /// Scattering inside; `None`: light goes straight on.
        #[serde(default)]
        scattering: Option<Scattering>,
        /// What the inside emits per metre, W·m⁻³·sr⁻¹.
        #[serde(default, deserialize_with = "super::value::color")]
        emission: Rgb,
        /// How much of the medium is where: a factor on attenuation, scattering and emission.
        #[serde(default = "one_scalar")]
        density: Value<f32, R>,
        /// Where solids overlap, the one of the highest priority is there; the surface of another is
        /// not seen inside it. Among equal ones the solid that the scene names first wins.
        #[serde(default)]
        priority: i32,
    },
    /// A pane so thin that light is not displaced: both interfaces of the sheet at once.
    ThinGlass {
        /// Index of refraction relative to vacuum.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// Transmittance of one crossing at normal incidence, per channel.
        #[serde(default = "one")]
        tint: Value<Rgb, R>,
    },
    /// A metal. Exactly one of `metal`, `f0`, or both `eta` and `k` says which.
    Conductor {
        /// A measured metal by name.
        #[serde(default)]
        metal: Option<Metal>,
        /// Reflectance at normal incidence (Schlick's approximation is used).
        #[serde(default)]
        f0: Option<Value<Rgb, R>>,
        /// Real part of the index of refraction per channel.
        #[serde(default, deserialize_with = "super::value::some_color")]
        eta: Option<Rgb>,
        /// Imaginary part of the index of refraction per channel.
        #[serde(default, deserialize_with = "super::value::some_color")]
        k: Option<Rgb>,
        /// Perceptual roughness.
        #[serde(default = "smooth")]
        roughness: Value<f32, R>,
    },
    /// A diffuse base under a clear coat of the given index: plastic, varnish, glazed tiles.
    Plastic {
        /// Albedo of the base.
        #[serde(default = "half")]
        albedo: Value<Rgb, R>,
        /// Index of refraction of the coat.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// Perceptual roughness of the coat.
        #[serde(default = "smooth")]
        roughness: Value<f32, R>,
    },
    /// The metallic–roughness model of glTF 2.0.
    Principled {
        /// Base colour: albedo of the dielectric part, reflectance at normal incidence of the metal.
        #[serde(default = "half")]
        base_color: Value<Rgb, R>,
        /// 0 is a dielectric, 1 a metal.
        #[serde(default = "smooth")]
        metallic: Value<f32, R>,
        /// Perceptual roughness.
        #[serde(default = "half_scalar")]
        roughness: Value<f32, R>,
        /// Index of refraction of the dielectric part.
        #[serde(default = "glass_ior")]
        ior: f32,
        /// Share of the diffuse part which is transmitted instead (thin walled).
        #[serde(default = "smooth")]
        transmission: Value<f32, R>,
    },
    /// Two materials side by side below what the eye resolves: `(1 − amount)·a + amount·b`.
    Mix {
        /// The material at amount 0.
        a: R,
        /// The material at amount 1.
        b: R,
        /// Share of `b`, in `[0, 1]`.
        #[serde(default = "half_scalar")]
        amount: Value<f32, R>,
    },
    /// A material with holes: leaves, nets, lace.
    Masked {
        /// What is there where it is opaque.
        material: R,
        /// Coverage in `[0, 1]`: the share of rays which the surface stops.
        opacity: Value<f32, R>,
    },
    /// A material whose normals are turned as if its surface were raised by a texture.
    Bump {
        /// What is raised.
        material: R,
        /// The texture whose number is the height.
        height: R,
        /// Metres of a height of 1; negative turns hills into hollows.
        #[serde(default = "centimetre")]
        strength: f32,
    },
    /// A material whose normals a texture holds, in the frame of the surface coordinates: red along u, green along
    /// v, blue outwards, each from −1 at black to 1 at white.
    NormalMap {
        /// What has these normals.
        material: R,
        /// The texture; an image of data, with `encoding: Linear`.
        map: R,
        /// Factor on red and green: 0 is flat.
        #[serde(default = "full")]
        strength: f32,
        /// Whether green grows with v or against it.
        #[serde(default)]
        green: Green,
    },
}

/// Which way the green channel of a normal map points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
pub enum Green {
    /// Along v, as in OpenGL, glTF and Blender.
    #[default]
    Up,
    /// Against v, as in DirectX and Unreal.
    Down,
}

/// Absorption inside a solid, by its colour after a distance.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Attenuation {
    /// Transmittance per channel after `distance`, in `(0, 1]`.
    #[serde(deserialize_with = "super::value::color")]
    pub color: Rgb,
    /// Metres.
    #[serde(default = "one_metre")]
    pub distance: f32,
}

impl Attenuation {
    /// Absorption coefficient `σ_a = −ln(color) / distance`, per metre.
    pub fn sigma_a(&self) -> Rgb {
        -self.color.map(f32::ln) / self.distance
    }
}

/// How a solid scatters light inside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scattering {
    /// Scattering coefficient per metre and channel.
    #[serde(deserialize_with = "super::value::color")]
    pub coefficient: Rgb,
    /// Into which directions.
    #[serde(default)]
    pub phase: PhaseFunction,
}

/// How light that a medium scatters is spread over directions: a density per steradian by the angle of deflection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
pub enum PhaseFunction {
    /// Evenly.
    #[default]
    Isotropic,
    /// By the mean cosine of the deflection, in (−1, 1): 0 is isotropic, positive is forwards (Henyey and Greenstein 1941,
    /// "Diffuse radiation in the Galaxy", Astrophysical Journal 93).
    HenyeyGreenstein(f32),
    /// As what is much smaller than the wavelength does, `3/16π·(1 + cos²)`.
    Rayleigh,
}

/// A metal with measured indices of refraction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[expect(missing_docs, reason = "the names say it")]
pub enum Metal {
    Aluminium,
    Chromium,
    Copper,
    Gold,
    Iron,
    Nickel,
    Platinum,
    Silver,
    Titanium,
    Tungsten,
}

impl<R> Material<R> {
    /// The same material with every reference replaced: `textures` for textures, `materials`
    /// for other materials.
    ///
    /// # Errors
    /// The first error of either function.
    pub fn map_refs<S, E>(
        self,
        textures: &mut impl FnMut(R) -> Result<S, E>,
        materials: &mut impl FnMut(R) -> Result<S, E>,
    ) -> Result<Material<S>, E> {
        Ok(match self {
            Self::Diffuse { albedo } => Material::Diffuse { albedo: albedo.map_ref(textures)? },
            Self::Mirror { reflectance } => {
                Material::Mirror { reflectance: reflectance.map_ref(textures)? }
            }
            Self::Dielectric {
                ior,
                dispersion,
                roughness,
                tint,
                attenuation,
                absorption,
                scattering,
                emission,
                density,
                priority,
            } => Material::Dielectric {
                ior,
                dispersion,
                roughness: roughness.map_ref(textures)?,
                tint: tint.map_ref(textures)?,
                attenuation,
                absorption: absorption.map(&mut *textures).transpose()?,
                scattering,
                emission,
                density: density.map_ref(textures)?,
                priority,
            },
            Self::ThinGlass { ior, tint } => {
                Material::ThinGlass { ior, tint: tint.map_ref(textures)? }
            }
            Self::Conductor { metal, f0, eta, k, roughness } => Material::Conductor {
                metal,
                f0: f0.map(|f0| f0.map_ref(textures)).transpose()?,
                eta,
                k,
                roughness: roughness.map_ref(textures)?,
            },
            Self::Plastic { albedo, ior, roughness } => Material::Plastic {
                albedo: albedo.map_ref(textures)?,
                ior,
                roughness: roughness.map_ref(textures)?,
            },
            Self::Principled { base_color, metallic, roughness, ior, transmission } => {
                Material::Principled {
                    base_color: base_color.map_ref(textures)?,
                    metallic: metallic.map_ref(textures)?,
                    roughness: roughness.map_ref(textures)?,
                    ior,
                    transmission: transmission.map_ref(textures)?,
                }
            }
            Self::Mix { a, b, amount } => Material::Mix {
                a: materials(a)?,
                b: materials(b)?,
                amount: amount.map_ref(textures)?,
            },
            Self::Masked { material, opacity } => Material::Masked {
                material: materials(material)?,
                opacity: opacity.map_ref(textures)?,
            },
            Self::Bump { material, height, strength } => Material::Bump {
                material: materials(material)?,
                height: textures(height)?,
                strength,
            },
            Self::NormalMap { material, map, strength, green } => Material::NormalMap {
                material: materials(material)?,
                map: textures(map)?,
                strength,
                green,
            },
        })
    }
}

fn half<R>() -> Value<Rgb, R> {
    Value::Constant(Rgb::splat(0.5))
}
fn one<R>() -> Value<Rgb, R> {
    Value::Constant(Rgb::ONE)
}
fn smooth<R>() -> Value<f32, R> {
    Value::Constant(0.0)
}
fn half_scalar<R>() -> Value<f32, R> {
    Value::Constant(0.5)
}
fn nothing<R>() -> Option<R> {
    None
}
fn one_scalar<R>() -> Value<f32, R> {
    Value::Constant(1.0)
}
fn glass_ior() -> f32 {
    1.5
}
fn one_metre() -> f32 {
    1.0
}
fn centimetre() -> f32 {
    0.01
}
fn full() -> f32 {
    1.0
}
