//! Eight children of a node of the light tree, and how much each matters to a point.
//!
//! The *importance* of a child for a receiving point is its flux, times the cosine under which it shines
//! there, times the cosine under which its light arrives, over the square of the distance:
//!
//! ```text
//! I = Φ·c(θ_w − θ_o)·c(θ_i) / (d² + ½σ²),      c(θ) = ¼·cos max(0, θ − θ_b) + ¾·max(0, cos θ)
//! ```
//!
//! with `θ_w` the angle between the cone's axis and the direction to the point, `θ_o` the half angle of
//! the cone, `θ_i` that at the receiver, `θ_b` half the angle under which the sphere around the child's
//! box is seen, `d` the distance of its centre and `σ²` the flux-weighted mean of the squared distances
//! of the lights from there. It is 0 where no light of the child can contribute, and only there.
//!
//! Conty Estevez and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting",
//! section 4.3, in the form of Pharr, Jakob, Humphreys 2023, *Physically Based Rendering*, 4th ed.,
//! section 12.6.3, eq. 12.38. They take the bounds alone: for a point below a wide group these are 1
//! and the least distance, so that it looks as if all its lights were overhead. We mix each bound of a
//! cosine with the cosine of the middle, and take for the distance what is nearly right for lights
//! spread evenly in a ball of radius `r` with the point in the midst of them: the mean of `1/d²` is `3/r²`
//! there, and ours, with `σ² = ⅗r²`, is `3.3/r²`. For 10,000 lamps under a ceiling this takes the
//! relative variance of the choice from 0.67 to 0.13 (`the_choice_is_nearly_that_by_contribution`).
//!
//! The children's numbers lie side by side, lane by lane, and the code has no branches, so that the
//! compiler works on several lanes at a time.

use super::bounds::LightBounds;
use crate::math::Aabb;
use glam::Vec3;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// What of the receiver matters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// The point.
    pub p: Vec3,
    /// Where an opaque receiver faces; `None` for one which light can reach from all sides.
    pub normal: Option<Vec3>,
}

/// Number of lanes, one for each child.
type Lanes = [f32; WIDTH];

/// A node: its children in the form in which their importance is computed.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    x: Lanes,
    y: Lanes,
    z: Lanes,
    radius_squared: Lanes,
    half_spread_squared: Lanes,
    axis_x: Lanes,
    axis_y: Lanes,
    axis_z: Lanes,
    /// 0 in a lane without a child.
    flux: Lanes,
    sin_o: Lanes,
    cos_o: Lanes,
    cos_e: Lanes,
    /// −1 for what shines backwards as well, 1 otherwise.
    back: Lanes,
    /// A node, or with [`LEAF`] a light.
    pub links: [u32; WIDTH],
}

/// Marks a link to a light.
pub(super) const LEAF: u32 = 1 << 31;

impl Node {
    /// A node without children.
    pub const EMPTY: Self = Self {
        x: [0.0; WIDTH],
        y: [0.0; WIDTH],
        z: [0.0; WIDTH],
        radius_squared: [0.0; WIDTH],
        // Not 0: an empty lane has the importance 0 everywhere.
        half_spread_squared: [1.0; WIDTH],
        axis_x: [0.0; WIDTH],
        axis_y: [0.0; WIDTH],
        axis_z: [1.0; WIDTH],
        flux: [0.0; WIDTH],
        sin_o: [0.0; WIDTH],
        cos_o: [-1.0; WIDTH],
        cos_e: [0.0; WIDTH],
        back: [1.0; WIDTH],
        links: [LEAF; WIDTH],
    };

    /// Puts a child into a lane. `spread_squared` is the mean square of the distances of its lights
    /// from the middle of its box.
    pub fn set(&mut self, lane: usize, child: &LightBounds, spread_squared: f64, link: u32) {
        let Aabb { min, max } = child.bounds;
        let center = child.bounds.center();
        let axis = child.cone.axis.as_vec3();
        // Rounded so that the node shines rather too far than too short.
        let cos_o = (child.cone.theta_o.cos() as f32).next_down().max(-1.0);
        (self.x[lane], self.y[lane], self.z[lane]) = center.into();
        self.radius_squared[lane] = ((max - min) * 0.5).length_squared();
        self.half_spread_squared[lane] = (0.5 * spread_squared) as f32;
        (self.axis_x[lane], self.axis_y[lane], self.axis_z[lane]) = axis.into();
        self.flux[lane] = child.flux as f32;
        self.sin_o[lane] = (1.0 - cos_o * cos_o).max(0.0).sqrt();
        self.cos_o[lane] = cos_o;
        self.cos_e[lane] = (child.cone.theta_e.cos() as f32).next_down();
        self.back[lane] = if child.two_sided { -1.0 } else { 1.0 };
        self.links[lane] = link;
    }

    /// Whether there is a child in a lane.
    pub fn has(&self, lane: usize) -> bool {
        self.flux[lane] > 0.0
    }

    /// Adds `by` to the links to nodes.
    pub fn shift(&mut self, by: u32) {
        for link in &mut self.links {
            if *link & LEAF == 0 {
                *link += by;
            }
        }
    }

    /// The importance of every child; 0 in empty lanes.
    #[inline]
    pub fn importance(&self, seen: &Seen) -> Lanes {
        match seen.normal {
            Some(normal) => self.lanes::<true>(seen.p, normal),
            None => self.lanes::<false>(seen.p, Vec3::ZERO),
        }
    }

    fn lanes<const HORIZON: bool>(&self, p: Vec3, normal: Vec3) -> Lanes {
        let mut importance = [0.0; WIDTH];
        for (lane, importance) in importance.iter_mut().enumerate() {
            *importance = self.lane::<HORIZON>(lane, p, normal);
        }
        importance
    }

    #[inline]
    fn lane<const HORIZON: bool>(&self, k: usize, p: Vec3, normal: Vec3) -> f32 {
        let (x, y, z) = (p.x - self.x[k], p.y - self.y[k], p.z - self.z[k]);
        let d2 = x * x + y * y + z * z;
        let per_metre = if d2 > 0.0 { 1.0 / d2.sqrt() } else { 0.0 };
        // The cone under which the sphere is seen; everything from inside.
        let inside = d2 <= self.radius_squared[k];
        let sin2_b = self.radius_squared[k] / d2;
        let sin_b = if inside { 0.0 } else { sin2_b.sqrt() };
        let cos_b = if inside { -1.0 } else { (1.0 - sin2_b).sqrt() };
        let along = (self.axis_x[k] * x + self.axis_y[k] * y + self.axis_z[k] * z) * per_metre;
        let cos_w = along.max(along * self.back[k]);
        let (sin_x, cos_x) = minus((sine(cos_w), cos_w), (self.sin_o[k], self.cos_o[k]));
        let (_, cos_emitted) = minus((sin_x, cos_x), (sin_b, cos_b));
        let shines = cos_emitted >= self.cos_e[k];
        let emitted = if shines { likely(cos_emitted, cos_x) } else { 0.0 };
        let arriving = if HORIZON {
            let cos_i = -(normal.x * x + normal.y * y + normal.z * z) * per_metre;
            likely(minus((sine(cos_i), cos_i), (sin_b, cos_b)).1, cos_i)
        } else {
            1.0
        };
        let importance = self.flux[k] * emitted * arriving / (d2 + self.half_spread_squared[k]);
        // At the light itself the quotient is 0/0 or infinite: as important as can be.
        if importance < f32::MAX { importance } else { f32::MAX }
    }
}

/// Share of the bound in a cosine; the rest is that of the middle.
const BOUND: f32 = 0.25;

/// What to expect of a cosine that is at most `bound` anywhere in a group and `middle` in its middle; 0
/// only where the bound is.
#[inline]
fn likely(bound: f32, middle: f32) -> f32 {
    let mean = BOUND * bound + (1.0 - BOUND) * middle.max(0.0);
    if bound > 0.0 { mean } else { 0.0 }
}

fn sine(cosine: f32) -> f32 {
    (1.0 - cosine * cosine).max(0.0).sqrt()
}

/// Sine and cosine of `max(0, a − b)` for angles in `[0, π]` given as sine and cosine.
#[inline]
fn minus((sin_a, cos_a): (f32, f32), (sin_b, cos_b): (f32, f32)) -> (f32, f32) {
    let (sin, cos) = (sin_a * cos_b - cos_a * sin_b, cos_a * cos_b + sin_a * sin_b);
    if cos_a > cos_b { (0.0, 1.0) } else { (sin, cos) }
}
