//! Which solids overlap, as far as their boxes tell.

use super::{Geometry, Instance};
use crate::math::Aabb;
use crate::shade::MaterialTable;

/// The instances made of a solid dielectric, ascending.
pub fn solids(instances: &[Instance], materials: &MaterialTable) -> Vec<u32> {
    let is_solid = |instance: &Instance| {
        (instance.material as usize) < materials.len() && materials.is_dielectric(instance.material)
    };
    (0..).zip(instances).filter(|(_, instance)| is_solid(instance)).map(|(k, _)| k).collect()
}

/// All pairs among `solids` whose boxes overlap, each once with the lower index first, ascending.
pub fn overlapping_pairs(instances: &[Instance], solids: &[u32]) -> Vec<(u32, u32)> {
    let bounds = |solid: u32| &instances[solid as usize].bounds;
    let mut sweep = solids.to_vec();
    sweep.sort_by(|&a, &b| bounds(a).min.x.total_cmp(&bounds(b).min.x));
    let mut open: Vec<u32> = Vec::new();
    let mut pairs = Vec::new();
    for solid in sweep {
        open.retain(|&other| bounds(other).max.x >= bounds(solid).min.x);
        let met = open.iter().filter(|&&other| overlap(bounds(other), bounds(solid)));
        pairs.extend(met.map(|&other| (other.min(solid), other.max(solid))));
        open.push(solid);
    }
    pairs.sort_unstable();
    pairs
}

/// Whether two boxes share a point.
pub fn overlap(a: &Aabb, b: &Aabb) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}

/// Whether a point of `place` may be inside a solid. The surface of a pool is an open sheet with
/// everything below it inside: of a mesh that counts as well.
pub fn may_enclose(instance: &Instance, place: &Aabb) -> bool {
    let mut reach = instance.bounds;
    if matches!(instance.geometry, Geometry::Mesh(_)) {
        reach.min.y = f32::NEG_INFINITY;
    }
    overlap(&reach, place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::extract::NOTHING;
    use crate::math::MotionTransform;
    use crate::sampling::Sampler;
    use crate::shade::TextureNeeds;
    use crate::shape::Primitive;
    use glam::{DVec3, Vec3};

    /// Oracle: every pair by itself.
    #[test]
    fn pairs_are_those_of_brute_force() {
        let boxes: Vec<Instance> = (0..200)
            .map(|k| {
                let s = Sampler::new(1, 0, (k, 0), 0);
                let min = s.two(0).extend(s.one(2));
                let size = s.two(3).extend(s.one(5)) * 0.2;
                let infinite = k == 17;
                let bounds = if infinite {
                    Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY }
                } else {
                    Aabb { min, max: min + size }
                };
                Instance {
                    geometry: Geometry::Primitive(Primitive::Cuboid),
                    motion: MotionTransform::new(&[]),
                    bounds,
                    material: 0,
                    emission: NOTHING,
                    object_id: 1,
                    needs_uv: false,
                    needs: TextureNeeds::default(),
                    size: DVec3::ONE,
                    hidden_from_camera: false,
                }
            })
            .collect();
        let solids: Vec<u32> = (0..200).filter(|k| k % 3 != 1).collect();
        let mut expected = Vec::new();
        for (k, &a) in solids.iter().enumerate() {
            for &b in &solids[k + 1..] {
                let (p, q) = (&boxes[a as usize].bounds, &boxes[b as usize].bounds);
                if (0..3).all(|i| p.min[i] <= q.max[i] && q.min[i] <= p.max[i]) {
                    expected.push((a, b));
                }
            }
        }
        assert!(expected.len() > 150, "{}", expected.len());
        assert_eq!(overlapping_pairs(&boxes, &solids), expected);
    }
}
