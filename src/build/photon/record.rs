//! A photon where it met a surface, in 32 bytes.

use crate::description::Rgb;
use glam::{Vec2, Vec3};

/// A photon where it met a storable surface.
///
/// Its time is that of the pass it belongs to. The direction is kept to 16 bits and the normal to 8
/// bits per component of the octahedral map (Cigolle et al. 2014, "A Survey of Efficient
/// Representations for Independent Unit Vectors", JCGT 3(2)): errors of at most 6.5·10⁻⁵ and 0.0167
/// radians. Half a step `h` on both axes moves a point of the octahedron by `(h, h, −2h)`, `√6·h` long, and no
/// point is nearer to the middle than `1/√3`: together `3√2·h`, with `h = 1/(2·32767)` and `1/(2·127)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Photon {
    /// Where, in render space.
    pub position: Vec3,
    /// Watts per channel.
    pub power: Rgb,
    direction: [i16; 2],
    normal: [i8; 2],
    /// Surface interactions before this one, 255 for more.
    pub depth: u8,
    /// Whether all interactions before this one, at least one, were specular.
    pub caustic: bool,
}

const _: () = assert!(size_of::<Photon>() == 32, "a photon takes 32 bytes");

impl Photon {
    /// * `wi` — unit direction back to where the photon came from.
    /// * `normal` — unit geometric normal of the surface.
    /// * `depth` — surface interactions before this one.
    pub fn new(
        position: Vec3,
        power: Rgb,
        wi: Vec3,
        normal: Vec3,
        depth: u32,
        caustic: bool,
    ) -> Self {
        let direction = octahedral(wi).to_array().map(|x| (x * f32::from(i16::MAX)).round() as i16);
        let normal = packed_normal(normal);
        let depth = depth.min(u32::from(u8::MAX)) as u8;
        Self { position, power, direction, normal, depth, caustic }
    }

    /// Unit direction back to where the photon came from.
    #[inline]
    pub fn wi(&self) -> Vec3 {
        from_octahedral(Vec2::from(self.direction.map(f32::from)) / f32::from(i16::MAX))
    }

    /// Unit geometric normal of the surface.
    #[inline]
    pub fn normal(&self) -> Vec3 {
        unpacked_normal(self.normal)
    }
}

/// A unit normal in 16 bits.
pub(super) fn packed_normal(normal: Vec3) -> [i8; 2] {
    octahedral(normal).to_array().map(|x| (x * f32::from(i8::MAX)).round() as i8)
}

/// The unit normal of [`packed_normal`].
#[inline]
pub(super) fn unpacked_normal(packed: [i8; 2]) -> Vec3 {
    from_octahedral(Vec2::from(packed.map(f32::from)) / f32::from(i8::MAX))
}

/// A unit vector as a point of `[−1, 1]²`: the octahedron unfolded.
fn octahedral(v: Vec3) -> Vec2 {
    let p = v.truncate() / (v.x.abs() + v.y.abs() + v.z.abs());
    if v.z >= 0.0 { p } else { folded(p) }
}

#[inline]
fn from_octahedral(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let p = if z >= 0.0 { p } else { folded(p) };
    p.extend(z).normalize()
}

/// Turns the corners of the square over its edges: the lower half of the octahedron.
#[inline]
fn folded(p: Vec2) -> Vec2 {
    let turned = Vec2::new(1.0 - p.y.abs(), 1.0 - p.x.abs());
    Vec2::new(turned.x.copysign(p.x), turned.y.copysign(p.y))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Sampler, warp::uniform_sphere};

    #[test]
    fn directions_come_back_within_the_stated_error() {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X, -Vec3::Y, -Vec3::Z];
        let random = (0..20_000).map(|k| uniform_sphere(Sampler::new(2, 0, (0, 0), k).two(0)));
        for v in axes.into_iter().chain(random) {
            let photon = Photon::new(Vec3::ZERO, Rgb::ONE, v, v, 300, true);
            // 3√2·h, and the rounding of the coordinates to f32.
            let bound = |steps: f32| 18.0_f32.sqrt() * 0.5 / steps + 8.0 * f32::EPSILON;
            assert!((photon.wi() - v).length() < bound(32_767.0), "{v}: {}", photon.wi());
            assert!((photon.normal() - v).length() < bound(127.0), "{v}: {}", photon.normal());
            assert_eq!(photon.depth, 255);
        }
    }
}
