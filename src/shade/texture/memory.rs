//! Textures that many ways lead to, looked up once.
//!
//! A `Multiply` both of whose sides are the next one looks that up twice, and a chain of thirty of them a thousand million
//! times. Where a texture would take many lookups of others at one point, what each of them was found to be there is
//! remembered. What moves the point (`Placed`, `Triplanar`, `Drift`) asks anew.

use super::{Rgb, Sample};
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// A texture which takes more lookups of others than this remembers what it has found. The values are the same; below,
/// looking up again is quicker than looking for what is known.
pub(in crate::shade) const REMEMBER_ABOVE: u64 = 64;

/// What was found, by index.
pub(in crate::shade) type Known<T> = HashMap<u32, T, BuildHasherDefault<IndexHasher>>;

/// Indices are small numbers: one multiplication spreads them over all bits.
#[derive(Default)]
pub(in crate::shade) struct IndexHasher(u64);

impl Hasher for IndexHasher {
    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u32(u32::from(byte));
        }
    }

    #[inline]
    fn write_u32(&mut self, index: u32) {
        // 2^64 over the golden ratio: Knuth 1998, The Art of Computer Programming 3, 2nd ed., section 6.4.
        self.0 = (self.0 ^ u64::from(index)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    #[inline]
    fn finish(&self) -> u64 {
        self.0
    }
}

/// What textures were found to be at a point.
pub(super) trait Memory {
    /// What is known of a texture.
    fn recall<T: Sample>(&self, index: u32) -> Option<T>;
    /// Keeps what a texture was found to be.
    fn keep<T: Sample>(&mut self, index: u32, value: T);
    /// What is known at another point: nothing.
    fn elsewhere() -> Self;
}

/// Remembers nothing, and costs nothing.
pub(super) struct Forgetful;

impl Memory for Forgetful {
    #[inline]
    fn recall<T: Sample>(&self, _: u32) -> Option<T> {
        None
    }

    #[inline]
    fn keep<T: Sample>(&mut self, _: u32, _: T) {}

    #[inline]
    fn elsewhere() -> Self {
        Self
    }
}

/// Remembers all.
#[derive(Default)]
pub(super) struct Remembering {
    pub(super) colors: Known<Rgb>,
    pub(super) numbers: Known<f32>,
}

impl Memory for Remembering {
    fn recall<T: Sample>(&self, index: u32) -> Option<T> {
        T::known(self).get(&index).copied()
    }

    fn keep<T: Sample>(&mut self, index: u32, value: T) {
        T::known_mut(self).insert(index, value);
    }

    fn elsewhere() -> Self {
        Self::default()
    }
}

#[cfg(test)]
mod tests {
    use crate::description::{Falloff, Rgb, TextureFiltering, Value};
    use crate::shade::texture::{Pyramids, Ranges, Region, Texture, TexturePoint, Textures};
    use glam::{DVec3, Vec2, Vec3};

    fn textures(
        list: Vec<
            Texture<
                std::sync::Arc<crate::description::ImageData>,
                std::sync::Arc<crate::description::GridData>,
                u32,
            >,
        >,
    ) -> Textures {
        Textures::new(list, TextureFiltering::Point, &Pyramids::default())
    }

    /// Closed form: 60 textures, each the product of the next one with itself, are the last to the power of 2^60, which is
    /// 1 of 1; each halfway between the next and itself, by the next, are the last. Following all ways would take
    /// 2^60 and 3^60 lookups.
    #[test]
    fn a_texture_that_many_ways_lead_to_is_looked_up_once() {
        let next = |k: u32| Value::Texture(k + 1);
        let amount = |k: u32| Value::Texture(k + 1);
        let color = Value::Constant;
        let last = |value: Rgb| Texture::Gradient { a: color(value), b: color(value) };
        let mut products: Vec<_> =
            (0..60).map(|k| Texture::Multiply { a: next(k), b: next(k) }).collect();
        products.push(last(Rgb::ONE));
        let mut means: Vec<_> =
            (0..60).map(|k| Texture::Mix { a: next(k), b: next(k), amount: amount(k) }).collect();
        means.push(last(Rgb::splat(0.25)));
        let at = TexturePoint::at(Vec2::splat(0.5));
        for (list, value) in [(products, 1.0), (means, 0.25)] {
            let textures = textures(list);
            assert!((textures.color(0, &at) - value).abs().max_element() < 1e-5);
            assert_eq!(textures.resolution(0), (1024, 512));
            assert!(!textures.needs(0).place);
            let region = Region::new(DVec3::ZERO, DVec3::ONE);
            let [low, high] = Ranges::new(&textures, 0).over(&region);
            assert!((low - value).abs() < 1e-5 && (high - value).abs() < 1e-5, "{low} to {high}");
        }
    }

    /// Oracle: a list of so few textures that nothing is remembered, whose values are the same bits at any point.
    #[test]
    fn what_is_remembered_belongs_to_its_point() {
        let (a, b) = (Value::Constant(Rgb::new(0.1, 0.4, 0.2)), Value::Constant(Rgb::ONE));
        let noise =
            Texture::Noise { size: 0.2, octaves: 3, gain: 0.5, turbulence: false, seed: 1, a, b };
        let ramp =
            Texture::Radial { centre: Vec3::ZERO, radius: 2.0, falloff: Falloff::Smooth, a, b };
        let mix = |k: u32| Texture::Mix {
            a: Value::Texture(k),
            b: Value::Texture(k + 1),
            amount: Value::Texture(k),
        };
        let triplanar = |of| Texture::Triplanar { of, size: 0.7, sharpness: 2.0 };
        let drift = |of| Texture::Drift { of, velocity: Vec3::new(0.3, 0.0, 0.1) };
        let plain = textures(vec![noise.clone(), ramp.clone(), triplanar(0), drift(1), mix(2)]);
        // The same behind eight levels both of whose sides are the same, at a share of a half.
        let same = |k| Texture::Mix {
            a: Value::Texture(k),
            b: Value::Texture(k),
            amount: Value::Constant(0.5),
        };
        let mut list = vec![noise, ramp, triplanar(0), drift(1), mix(2)];
        list.extend((4..12).map(same));
        let many = textures(list).at_time((0.5, 1.0));
        let plain = plain.at_time((0.5, 1.0));
        for k in 0..200 {
            let p = DVec3::new(0.01, 0.02, 0.03) * f64::from(k);
            let at = TexturePoint {
                p,
                n: Vec3::new(0.6, 0.0, 0.8),
                ..TexturePoint::at(Vec2::splat(0.1))
            };
            assert_eq!(many.color(12, &at), plain.color(4, &at), "{k}");
            assert_eq!(many.scalar(12, &at), plain.scalar(4, &at), "{k}");
        }
    }
}
