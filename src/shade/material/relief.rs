//! Relief that is not there: bump maps and normal maps turn the shading normal.
//!
//! A bump map is a height `d` above the surface, in metres. The normal of the surface moved by it is, to first order,
//! `n − ∇d` with the gradient in the plane of the surface (Blinn 1978, "Simulation of Wrinkled
//! Surfaces"; in this form Mikkelsen 2010, "Bump Mapping Unparametrized Surfaces on the GPU"). It does
//! not depend on how the surface is parameterised. The gradient is a difference over the footprint of the
//! sample, so that what is finer than a sample fades.
//!
//! A normal map holds the normal itself: red along a tangent, green along a bitangent, blue along the shading normal. On
//! shapes the tangent is the direction in which u grows, on meshes the one that tools agree on
//! ([`crate::build::bvh::Tangents`]).

use super::MaterialTable;
use crate::description::Green;
use crate::shade::TexturePoint;
use glam::{Vec2, Vec3};

/// A relief of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Relief {
    Bump {
        /// Texture of the height.
        height: u32,
        /// Metres of a height of 1.
        strength: f32,
    },
    Normals {
        map: u32,
        strength: f32,
        green: Green,
    },
}

/// The points around one of a surface, as textures see them.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings {
    /// Orthogonal unit vectors in the plane of the shading normal.
    pub axes: [Vec3; 2],
    /// Metres from the point to each of those around it.
    pub step: f32,
    /// The points at `−step` and `+step` along each axis.
    pub around: [[TexturePoint; 2]; 2],
}

impl MaterialTable {
    /// The shading normal of a material with a relief where the surface has the unit shading normal `ns`, on the
    /// same side. It asks for the surroundings of the point, or for what red and green of a normal map count along
    /// there: the tangent and the bitangent.
    pub fn relief_normal(
        &self,
        material: u32,
        ns: Vec3,
        at: &TexturePoint,
        surroundings: impl FnOnce() -> Surroundings,
        tangents: impl FnOnce() -> Option<[Vec3; 2]>,
    ) -> Vec3 {
        let Some(relief) = self.materials[material as usize].relief else { return ns };
        let normal = match relief {
            Relief::Bump { height, strength } => {
                let near = surroundings();
                let slope = |axis: usize| {
                    let [before, after] = &near.around[axis];
                    let rise =
                        self.textures.scalar(height, after) - self.textures.scalar(height, before);
                    rise * strength / (2.0 * near.step)
                };
                ns - near.axes[0] * slope(0) - near.axes[1] * slope(1)
            }
            Relief::Normals { map, strength, green } => {
                let coded = self.textures.vector(map, at) * 2.0 - 1.0;
                let up = if green == Green::Up { coded.y } else { -coded.y };
                let across = Vec2::new(coded.x, up) * strength;
                let Some([tangent, bitangent]) = tangents() else { return ns };
                // Filtered normals are shorter, but never point into the surface.
                tangent * across.x + bitangent * across.y + ns * coded.z.max(0.0)
            }
        };
        match normal.try_normalize() {
            Some(normal) if normal.dot(ns) > 0.0 => normal,
            _ => ns,
        }
    }
}

/// Turns a shading normal so far towards the geometric one that a mirror would not reflect into the surface what comes
/// from the unit direction `wo`; both normals are on the side of `wo` or both on the other.
///
/// Keller et al. 2017, "The Iray Light Transport Simulation and Rendering System", section on "Bump Mapping":
/// the reflected direction is lifted to the horizon, and the normal is half way to it.
pub fn bent_normal(ns: Vec3, ng: Vec3, wo: Vec3) -> Vec3 {
    let side = if wo.dot(ng) < 0.0 { -1.0 } else { 1.0 };
    // In f64: seen from the side the two directions nearly cancel.
    let [n, g, wo] = [ns * side, ng * side, wo].map(|v| v.as_dvec3().normalize());
    let reflected = n * (2.0 * n.dot(wo)) - wo;
    let below = reflected.dot(g);
    if n.dot(wo) > 0.0 && below > 0.0 {
        return ns;
    }
    // Seen from behind it is as if it were seen from the side: the ray goes straight on.
    let (reflected, below) = if n.dot(wo) > 0.0 { (reflected, below) } else { (-wo, -wo.dot(g)) };
    let half = wo + (reflected - g * below).normalize_or(g);
    (half.normalize_or(g) * f64::from(side)).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sampler, warp::uniform_sphere};

    /// Whatever the normals: a mirror with the bent one reflects to the outside, sees the viewer, and a normal
    /// that does both already is left alone.
    #[test]
    fn bent_normals_reflect_to_the_outside() {
        let (mut bent, mut kept) = (0, 0);
        for k in 0..50_000 {
            let s = Sampler::new(6, 0, (k, 0), 0);
            let (ng, ns, wo) =
                (uniform_sphere(s.two(0)), uniform_sphere(s.two(2)), uniform_sphere(s.two(4)));
            let ns = if ns.dot(ng) < 0.0 { -ns } else { ns };
            let n = bent_normal(ns, ng, wo);
            assert!((n.length() - 1.0).abs() < 1e-5);
            let side = wo.dot(ng).signum();
            let reflected = n * (2.0 * n.dot(wo)) - wo;
            assert!(reflected.dot(ng) * side > -1e-5, "{ns} {ng} {wo}");
            assert!(n.dot(wo) * side > -1e-6, "{ns} {ng} {wo}");
            let before = ns * (2.0 * ns.dot(wo)) - wo;
            if ns.dot(wo) * side > 0.0 && before.dot(ng) * side > 0.0 {
                kept += 1;
                assert_eq!(n, ns);
            } else {
                bent += 1;
            }
        }
        assert!(bent > 10_000 && kept > 10_000, "{bent} bent, {kept} kept");
    }
}
