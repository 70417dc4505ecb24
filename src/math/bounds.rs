//! Axis-aligned boxes.

use glam::{DAffine3, DVec3, Vec3};

/// An axis-aligned box in `f32`; empty when `min > max` on any axis.
#[derive(bytemuck::Zeroable, Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

impl Default for Aabb {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Aabb {
    /// The box which contains nothing and is neutral under [`Aabb::union`].
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The box of all points of `points`.
    pub fn from_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The smallest box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// The middle of the box; meaningless for an empty one.
    pub fn center(&self) -> Vec3 {
        // Halved before they are added, so that boxes near the end of the range do not overflow.
        self.min * 0.5 + self.max * 0.5
    }

    /// How far its farthest coordinate is from 0; infinite for an empty box.
    pub fn reach(&self) -> f32 {
        self.min.abs().max(self.max.abs()).max_element()
    }

    /// Metres from corner to corner; not finite for a box without end, 0 for an empty one.
    pub fn diagonal(&self) -> f64 {
        if self.is_empty() { 0.0 } else { (self.max.as_dvec3() - self.min.as_dvec3()).length() }
    }

    /// Surface area of the box, 0 for an empty one.
    pub fn area(&self) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        let d = self.max - self.min;
        2.0 * (d.x * d.y + d.y * d.z + d.z * d.x)
    }

    /// Whether `p` lies in the closed box.
    pub fn contains(&self, p: Vec3) -> bool {
        self.min.cmple(p).all() && p.cmple(self.max).all()
    }

    /// The eight corners.
    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|k| {
            Vec3::new(
                if k & 1 == 0 { self.min.x } else { self.max.x },
                if k & 2 == 0 { self.min.y } else { self.max.y },
                if k & 4 == 0 { self.min.z } else { self.max.z },
            )
        })
    }

    /// The box around the image of this box under `m`, rounded outwards to `f32`.
    #[must_use]
    pub fn transformed(&self, m: &DAffine3) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        let mut min = DVec3::INFINITY;
        let mut max = DVec3::NEG_INFINITY;
        for corner in self.corners() {
            let p = m.transform_point3(corner.as_dvec3());
            min = min.min(p);
            max = max.max(p);
        }
        Self { min: round_down(min), max: round_up(max) }
    }

    /// The box enlarged by `margin` on every side, rounded outwards.
    #[must_use]
    pub fn inflated(&self, margin: f32) -> Self {
        if self.is_empty() {
            return *self;
        }
        Self {
            min: (self.min - margin).map(f32::next_down),
            max: (self.max + margin).map(f32::next_up),
        }
    }
}

/// Rounds each component to the nearest `f32` not above it (within one unit in the last place).
fn round_down(v: DVec3) -> Vec3 {
    v.as_vec3().map(f32::next_down)
}

/// Rounds each component to the nearest `f32` not below it (within one unit in the last place).
fn round_up(v: DVec3) -> Vec3 {
    v.as_vec3().map(f32::next_up)
}
