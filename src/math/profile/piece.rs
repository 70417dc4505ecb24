//! A piece of a profile: radius and height run one way, and it bends one way.

use super::cut::Cut;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Nodes and weights of Gauss's rule with 8 points on `[0, 1]`: exact for polynomials of degree 15.
const GAUSS: [(f64, f64); 8] = [
    (0.019_855_071_751_231_884, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_63, 0.111_190_517_226_687_24),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_65),
    (0.408_282_678_752_175_1, 0.181_341_891_689_180_98),
    (0.591_717_321_247_825, 0.181_341_891_689_180_98),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_65),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_24),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_13),
];

/// A piece, its parameter `u` in `[0, 1]`; points are (radius, height).
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Where it begins: the bits of where the one before ends.
    pub start: DVec2,
    /// Where it ends.
    pub end: DVec2,
    /// Unit directions at its ends; all others lie between them.
    pub directions: [DVec2; 2],
    /// The profile's parameter at its ends.
    pub v: (f64, f64),
    /// Area of the surface that it turns into.
    pub area: f64,
    /// Coefficients of the powers of `u`: of the point times its weight …
    powers: [DVec2; 4],
    /// … and of the weight; `None` where that is 1.
    weights: Option<[f64; 4]>,
    /// Rounding of the length of the derivative.
    still: f64,
}

/// Point and derivative.
#[derive(Clone, Copy, Debug)]
pub struct Jet {
    /// (radius, height).
    pub p: DVec2,
    /// By `u`.
    pub d: DVec2,
}

impl Piece {
    pub(super) fn new(cut: &Cut, start: DVec2, end: DVec2, v: (f64, f64)) -> Self {
        let polynomial = cut.curve.is_polynomial();
        let [a, b, c, d] =
            if polynomial { cut.curve.points().map(|p| p.extend(1.0)) } else { cut.curve.0 };
        let powers = [a, (b - a) * 3.0, ((a - b) + (c - b)) * 3.0, (d - a) + (b - c) * 3.0];
        let weights = (!polynomial).then(|| powers.map(|p| p.z));
        let powers = powers.map(DVec3::truncate);
        // A derivative adds up 7 products of the coefficients, some by 3 and some over the weight, and each
        // rounds.
        let least_weight = cut.curve.0.iter().fold(f64::INFINITY, |m, p| m.min(p.z));
        let greatest = powers.iter().map(|p| p.abs().max_element()).sum::<f64>();
        let still = 32.0 * f64::EPSILON * greatest / if polynomial { 1.0 } else { least_weight };
        let directions = cut.directions;
        let mut piece = Self { start, end, directions, v, area: 0.0, powers, weights, still };
        piece.area = piece.area_up_to(1.0);
        piece
    }

    /// The point at `u` and its derivative.
    #[inline]
    pub fn jet(&self, u: f64) -> Jet {
        let [a, b, c, d] = self.powers;
        let p = ((d * u + c) * u + b) * u + a;
        let dp = (d * (3.0 * u) + c * 2.0) * u + b;
        let Some([a, b, c, d]) = self.weights else { return Jet { p, d: dp } };
        let w = ((d * u + c) * u + b) * u + a;
        let dw = (d * (3.0 * u) + c * 2.0) * u + b;
        let point = p / w;
        Jet { p: point, d: (dp - point * dw) / w }
    }

    /// The unit direction at `u`, also where the derivative vanishes.
    pub fn direction(&self, u: f64) -> DVec2 {
        let nearest = self.directions[usize::from(u > 0.5)];
        let derivative = self.jet(u).d;
        let speed = derivative.length();
        if speed > self.still { derivative / speed } else { nearest }
    }

    /// Where the piece has the radius and height of a point on it, which are known to within rounding.
    ///
    /// Along the coordinate which changes more the other is a function with a bounded slope.
    pub fn parameter_of(&self, p: DVec2) -> f64 {
        let across = (self.end - self.start).abs();
        let axis = usize::from(across.y >= across.x);
        let (from, to) = (self.start[axis] - p[axis], self.end[axis] - p[axis]);
        if (from > 0.0) == (to > 0.0) {
            return if from.abs() < to.abs() { 0.0 } else { 1.0 };
        }
        bracketed_root((0.0, 1.0), (from, to), |u| {
            let jet = self.jet(u);
            let value = jet.p[axis] - p[axis];
            (value, value / jet.d[axis])
        })
    }

    /// Area of the surface turned by the piece from 0 to `u`: `2π·∫ r·|P'| du`.
    fn area_up_to(&self, u: f64) -> f64 {
        TAU * self.integral(u, |jet| jet.p.x.max(0.0) * jet.d.length())
    }

    /// The integral of a function from 0 to `u`, by Gauss's rule with 8 points.
    pub fn integral(&self, u: f64, f: impl Fn(Jet) -> f64) -> f64 {
        u * GAUSS.iter().map(|(x, weight)| weight * f(self.jet(x * u))).sum::<f64>()
    }

    /// Where this share of the area is reached.
    pub fn parameter_at_area(&self, share: f64) -> f64 {
        let wanted = share * self.area;
        if wanted <= 0.0 {
            return 0.0;
        }
        if wanted >= self.area {
            return 1.0;
        }
        bracketed_root((0.0, 1.0), (-wanted, self.area - wanted), |u| {
            let jet = self.jet(u);
            let value = self.area_up_to(u) - wanted;
            (value, value / (TAU * jet.p.x.max(0.0) * jet.d.length()))
        })
    }
}

/// The root of `f` (its value, and that over its derivative) between `low` and `high`, where it has the values
/// `ends` of unlike signs, 0 counting as negative.
///
/// Newton's steps, and halvings where they leave the bracket. Newton's error squares, up to the factor
/// `f''/2f'`. For an `f` which is monotone in the bracket, with an end like a square root or an extremum at
/// worst, that is about one over twice the distance to the end. A step shorter than `2⁻³²`, and than `2⁻²⁰` of
/// that distance, therefore leaves less than the rounding of 1.
#[inline]
pub fn bracketed_root(
    (mut low, mut high): (f64, f64),
    (at_low, at_high): (f64, f64),
    f: impl Fn(f64) -> (f64, f64),
) -> f64 {
    const LAST_STEP: f64 = 1.0 / 4_294_967_296.0;
    const SHARE: f64 = 1.0 / 1_048_576.0;
    /// Halvings down to a unit in the last place of 1, and as many of Newton's steps between them.
    const MAX_STEPS: u32 = 2 * f64::MANTISSA_DIGITS;
    let ends = (low, high);
    let low_is_positive = at_low > 0.0;
    let secant = low + (high - low) * (at_low / (at_low - at_high));
    let mut u = if secant >= low && secant <= high { secant } else { f64::midpoint(low, high) };
    let mut width = high - low;
    for count in 0..MAX_STEPS {
        let (value, step) = f(u);
        if (value > 0.0) == low_is_positive {
            low = u;
        } else {
            high = u;
        }
        let newton = u - step;
        let stays = newton >= low && newton <= high;
        let room = (u - ends.0).min(ends.1 - u);
        if stays && step.abs() < LAST_STEP.min(SHARE * room) {
            return newton;
        }
        // Where Newton crawls along one end, every fourth step halves.
        let fourth = count % 4 == 3;
        let crawls = fourth && high - low > 0.5 * width;
        if fourth {
            width = high - low;
        }
        if stays && !crawls {
            u = newton;
        } else {
            let middle = f64::midpoint(low, high);
            if middle <= low || middle >= high {
                return middle;
            }
            u = middle;
        }
    }
    u
}
