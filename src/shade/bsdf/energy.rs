//! Directional albedos of rough surfaces, tabulated: what single scattering loses.
//!
//! A microfacet model with one bounce drops the light that meets a second facet. With
//! `E(μ)` the share of light from the cosine `μ` which a single-scattering model returns, Kulla
//! and Conty 2017, "Revisiting Physically Based Shading at Imageworks" (SIGGRAPH course *Physically
//! Based Shading*), give the rest back as a diffuse lobe,
//!
//! ```text
//! f_ms = (1 − E(μ_o)) (1 − E(μ_i)) / (π (1 − Ē)),    Ē = 2 ∫ E(μ) μ dμ
//! ```
//!
//! which is reciprocal and integrates to exactly what is missing. The albedos have no closed form:
//! they are integrated once per table and looked up.
//!
//! `1 − E` varies over `μ ~ α` and hardly beyond, Fresnel's reflectance over all `μ`, so the nodes in
//! `μ` are equidistant in `x = ½ μ (1 + α) / (μ + α) + ½ √μ`, half of them for either. In the first term
//! curves of different `α` nearly coincide. Values are kept as `1 − E`, which stays accurate where
//! `E` comes close to 1. A table for all widths interpolates in `α^¼` as well;
//! where the roughness is constant a table of one row spares that error.

use super::fresnel::{dielectric, gauss_legendre, schlick_weight};
use super::ggx::{Ggx, SMOOTH_BELOW_ALPHA, reflect, refract};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::{FRAC_1_PI, TAU};
use std::fmt;
use std::sync::OnceLock;

/// Nodes in `x`.
const NODES: usize = 48;
/// `c/α` of [`AlbedoAt::sample_returned`]: with it the weight of a returned direction is at most 1.6
/// for `α ≥ 0.1`, and 3 for narrow lobes, which hardly ever return any.
const RETURNED_SPREAD: f32 = 2.0;
/// Rows of a table over all widths.
const ROWS: usize = 48;

/// `C` functions of a cosine, for one width `α` or for all.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AlbedoTable<const C: usize> {
    rows: Vec<Row<C>>,
}

#[derive(Clone, Debug, PartialEq)]
struct Row<const C: usize> {
    values: [[f32; C]; NODES],
    average: [f32; C],
}

/// A table at one width: what a BSDF keeps.
#[derive(Clone, Copy)]
pub(crate) struct AlbedoAt<'t, const C: usize> {
    table: &'t AlbedoTable<C>,
    alpha: f32,
    row: u32,
    fraction: f32,
    /// `1 / ln(1 + 1/c²)` of [`AlbedoAt::sample_returned`].
    inverse_log: f32,
}

impl<const C: usize> fmt::Debug for AlbedoAt<'_, C> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "AlbedoAt {{ alpha: {}, .. }}", self.alpha)
    }
}

impl<const C: usize> AlbedoTable<C> {
    /// A table for one width.
    pub fn single(alpha: f32, f: &impl Fn(f32, f32) -> [f64; C]) -> Self {
        Self { rows: vec![Row::new(alpha, f)] }
    }

    /// A table for all widths from [`SMOOTH_BELOW_ALPHA`] to 1. `f(α, μ)` gives the values.
    pub fn full(f: &(impl Fn(f32, f32) -> [f64; C] + Sync)) -> Self {
        Self { rows: (0..ROWS).into_par_iter().map(|row| Row::new(row_alpha(row), f)).collect() }
    }

    /// The table at one width. A table made for a single width is taken as it is.
    #[inline]
    pub fn at(&self, alpha: f32) -> AlbedoAt<'_, C> {
        let inverse_log = 1.0 / (RETURNED_SPREAD * alpha).powi(-2).ln_1p();
        if self.rows.len() == 1 {
            return AlbedoAt { table: self, alpha, row: 0, fraction: 0.0, inverse_log };
        }
        let lowest = SMOOTH_BELOW_ALPHA.sqrt().sqrt();
        let x = (alpha.sqrt().sqrt() - lowest) / (1.0 - lowest) * (ROWS - 1) as f32;
        let row = (x as usize).min(ROWS - 2);
        AlbedoAt { table: self, alpha, row: row as u32, fraction: x - row as f32, inverse_log }
    }
}

fn row_alpha(row: usize) -> f32 {
    let lowest = f64::from(SMOOTH_BELOW_ALPHA).sqrt().sqrt();
    let root = lowest + (1.0 - lowest) * row as f64 / (ROWS - 1) as f64;
    root.powi(4) as f32
}

/// Where the cosine `mu` lies between the nodes, in `[0, 1]`.
#[inline]
fn coordinate(alpha: f32, mu: f32) -> f32 {
    0.5 * (mu * (1.0 + alpha) / (mu + alpha) + mu.sqrt())
}

/// The cosine of a node: the inverse of [`coordinate`], which increases, by bisection.
fn node_cosine(alpha: f32, node: usize) -> f32 {
    let x = node as f32 / (NODES - 1) as f32;
    let (mut low, mut high) = (0.0, 1.0);
    // 40 halvings go below the spacing of f32 at the smallest node.
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if coordinate(alpha, middle) < x { low = middle } else { high = middle }
    }
    high
}

impl<const C: usize> Row<C> {
    fn new(alpha: f32, f: &impl Fn(f32, f32) -> [f64; C]) -> Self {
        let cosines: [f32; NODES] = std::array::from_fn(|node| node_cosine(alpha, node));
        let values = cosines.map(|mu| f(alpha, mu).map(|v| v as f32));
        let mut row = Self { values, average: [0.0; C] };
        // 2 ∫ v μ dμ of the interpolated curve, which is smooth between nodes.
        let rule = gauss_legendre::<4>();
        let mut average = [0.0; C];
        for ends in cosines.windows(2) {
            let (start, length) = (f64::from(ends[0]), f64::from(ends[1] - ends[0]));
            for (t, weight) in rule {
                let mu = start + length * t;
                let value = row.interpolate(coordinate(alpha, mu as f32));
                for (sum, v) in average.iter_mut().zip(value) {
                    *sum += 2.0 * f64::from(v) * mu * weight * length;
                }
            }
        }
        row.average = average.map(|v| v as f32);
        row
    }

    #[inline]
    fn interpolate(&self, x: f32) -> [f32; C] {
        let x = x * (NODES - 1) as f32;
        let node = (x as usize).min(NODES - 2);
        let t = x - node as f32;
        std::array::from_fn(|c| {
            let (a, b) = (self.values[node][c], self.values[node + 1][c]);
            a + (b - a) * t
        })
    }
}

impl<const C: usize> AlbedoAt<'_, C> {
    /// The width.
    #[inline]
    pub fn alpha(&self) -> f32 {
        self.alpha
    }

    /// The values at the cosine `mu` in `[0, 1]`.
    #[inline]
    pub fn value(&self, mu: f32) -> [f32; C] {
        let x = coordinate(self.alpha, mu);
        self.blend(|row| row.interpolate(x))
    }

    /// The cosine-weighted means.
    #[inline]
    pub fn average(&self) -> [f32; C] {
        self.blend(|row| row.average)
    }

    /// Draws a direction for light which returns after several bounces: `z > 0`, with the density
    /// [`AlbedoAt::returned_pdf`]. `u` in `[0, 1)²`.
    ///
    /// `(1 − E(μ)) μ` is what such light follows. `1 − E` begins at `½` and falls like `(α/μ)²` beyond `μ ~ α`: close to
    /// the horizon where `α` is small, and nearly as the cosine where it is 1. With `c` of the size of `α`,
    ///
    /// ```text
    /// p(μ) = μ / (π (μ² + c²) ln(1 + 1/c²)),      μ = c √((1 + 1/c²)^u − 1)
    /// ```
    ///
    /// does the same, and keeps the weights near 1 at every width.
    #[inline]
    pub fn sample_returned(&self, u: Vec2) -> Vec3 {
        let mu = RETURNED_SPREAD * self.alpha * (u.x / self.inverse_log).exp_m1().sqrt();
        let mu = mu.clamp(f32::MIN_POSITIVE, 1.0);
        let r = ((1.0 - mu) * (1.0 + mu)).sqrt();
        let (sin, cos) = (TAU * u.y).sin_cos();
        Vec3::new(r * cos, r * sin, mu)
    }

    /// Its density per solid angle.
    #[inline]
    pub fn returned_pdf(&self, mu: f32) -> f32 {
        let c = RETURNED_SPREAD * self.alpha;
        self.inverse_log * mu * FRAC_1_PI / (mu * mu + c * c)
    }

    #[inline]
    fn blend(&self, f: impl Fn(&Row<C>) -> [f32; C]) -> [f32; C] {
        let row = self.row as usize;
        let a = f(&self.table.rows[row]);
        if self.fraction == 0.0 {
            return a;
        }
        let b = f(&self.table.rows[row + 1]);
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * self.fraction)
    }
}

/// The two functions which give the albedo of a GGX reflector under Schlick's Fresnel term.
///
/// Channel 0 is what is lost at reflectance 1, `1 − E(μ)`. Channel 1 is
/// `B(μ) = ∫ D V (1 − o·m)⁵ μ_i dω_i`, so that the albedo at `F₀` is `F₀ (E − B) + B`.
pub(crate) type ReflectorTable = AlbedoTable<2>;

/// The table of [`ReflectorTable`] for all widths, made at the first call.
pub(crate) fn reflector_table() -> &'static ReflectorTable {
    static TABLE: OnceLock<ReflectorTable> = OnceLock::new();
    TABLE.get_or_init(|| AlbedoTable::full(&reflector_albedo(&Lattice::COARSE)))
}

/// The table of [`ReflectorTable`] for one width.
pub(crate) fn reflector_table_at(alpha: f32) -> ReflectorTable {
    AlbedoTable::single(alpha, &reflector_albedo(&Lattice::FINE))
}

fn reflector_albedo(lattice: &Lattice) -> impl Fn(f32, f32) -> [f64; 2] {
    |alpha, mu| {
        let mut sums = [0.0; 2];
        let n = lattice.visible_normals(alpha, mu, |ggx, wo, m| {
            let wi = reflect(wo, m);
            if wi.z > 0.0 {
                let out = f64::from(ggx.shadowing(wo.z, wi.z));
                sums[0] += out;
                sums[1] += out * f64::from(schlick_weight(wo.dot(m)));
            }
        });
        [lost(sums[0] / n), sums[1] / n]
    }
}

/// Which widths a table is made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Widths {
    /// The roughness is constant.
    One(f32),
    /// The roughness is textured.
    All,
}

impl Widths {
    fn lattice(self) -> Lattice {
        match self {
            Self::One(_) => Lattice::FINE,
            Self::All => Lattice::COARSE,
        }
    }
}

/// Albedo of single reflection at a rough dielectric coat of relative index `eta`.
pub(crate) fn coat_table(eta: f32, widths: Widths) -> AlbedoTable<1> {
    let lattice = widths.lattice();
    let f = |alpha, mu| [dielectric_albedo(&lattice, alpha, mu, eta).0];
    match widths {
        Widths::One(alpha) => AlbedoTable::single(alpha, &f),
        Widths::All => AlbedoTable::full(&f),
    }
}

/// What single scattering loses at a rough interface of glass with index `eta` over its
/// surroundings: channel 0 for light from outside, channel 1 from inside.
pub(crate) fn glass_table(eta: f32, widths: Widths) -> AlbedoTable<2> {
    let lattice = widths.lattice();
    let f = |alpha, mu| {
        [eta, 1.0 / eta].map(|eta| {
            let (reflected, transmitted) = dielectric_albedo(&lattice, alpha, mu, eta);
            lost(reflected + transmitted)
        })
    };
    match widths {
        Widths::One(alpha) => AlbedoTable::single(alpha, &f),
        Widths::All => AlbedoTable::full(&f),
    }
}

/// `1 − e`, not below zero: what is returned cannot exceed 1 but for rounding, since `G₂ ≤ G₁`.
fn lost(e: f64) -> f64 {
    (1.0 - e).max(0.0)
}

/// Shares of light from `mu` which a rough dielectric reflects and transmits once.
fn dielectric_albedo(lattice: &Lattice, alpha: f32, mu: f32, eta: f32) -> (f64, f64) {
    let (mut reflected, mut transmitted) = (0.0, 0.0);
    let n = lattice.visible_normals(alpha, mu, |ggx, wo, m| {
        let cos = wo.dot(m);
        let interface = dielectric(cos, ((1.0 - cos) * (1.0 + cos)).max(0.0), eta);
        let f = f64::from(interface.reflectance);
        let wi = reflect(wo, m);
        if wi.z > 0.0 {
            reflected += f * f64::from(ggx.shadowing(wo.z, wi.z));
        }
        let wt = refract(wo, m, eta);
        if f < 1.0 && wt.z < 0.0 {
            transmitted += (1.0 - f) * f64::from(ggx.shadowing(wo.z, -wt.z));
        }
    });
    (reflected / n, transmitted / n)
}

/// A lattice over the square which [`Ggx::sample_visible`] maps to visible normals.
///
/// The integrands are continuous, with kinks along curves where the reflected or refracted ray meets
/// the horizon and where total reflection begins. Product rules resolve such curves badly; a
/// Fibonacci lattice covers them evenly from all directions (Niederreiter 1992, *Random Number
/// Generation and Quasi-Monte Carlo Methods*, section 5.2).
struct Lattice {
    points: u32,
    /// The Fibonacci number before `points`.
    generator: u32,
}

impl Lattice {
    /// For one row: within 10⁻³, mostly far below.
    const FINE: Self = Self { points: 987, generator: 610 };
    /// For the rows of a table over all widths.
    const COARSE: Self = Self { points: 377, generator: 233 };

    /// Calls `f(distribution, wo, m)` for every point of equal weight; returns the number of points.
    fn visible_normals(&self, alpha: f32, mu: f32, mut f: impl FnMut(Ggx, Vec3, Vec3)) -> f64 {
        let ggx = Ggx { alpha };
        // At exactly grazing incidence the shadowing ratio is 0/0; its limit is reached long before.
        let mu = mu.max(1e-6 * alpha);
        let wo = Vec3::new(((1.0 - mu) * (1.0 + mu)).max(0.0).sqrt(), 0.0, mu);
        for i in 0..self.points {
            let u2 = (i as f32 + 0.5) / self.points as f32;
            // The integrand is even in the azimuth: half a turn, u₁ in [0, ½], is enough.
            let u1 = 0.5 * (i * self.generator % self.points) as f32 / self.points as f32;
            f(ggx, wo, ggx.sample_visible(wo, Vec2::new(u1, u2)));
        }
        f64::from(self.points)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shade::bsdf::statistics::{Random, direction};

    /// Oracle: directional albedos of GGX by high-order quadrature; at α = 1 and normal incidence it
    /// is `1 − ln 2`.
    #[test]
    fn a_single_bounce_returns_what_it_should() {
        for (alpha, mu, expected) in [
            (0.1, 1.0, 0.988_304_1),
            (0.25, 1.0, 0.915_812_4),
            (0.5, 1.0, 0.687_848_5),
            (0.75, 1.0, 0.463_916_5),
            (1.0, 1.0, 1.0 - std::f32::consts::LN_2),
            (0.1, 0.5, 0.969_205),
            (0.25, 0.5, 0.857_263_4),
            (0.5, 0.5, 0.698_250_7),
            (1.0, 0.5, 0.450_693_9),
            (0.5, 0.25, 0.765_203_3),
            (1.0, 0.25, 0.597_640_5),
        ] {
            let e = 1.0 - reflector_table().at(alpha).value(mu)[0];
            assert!((e - expected).abs() < 1e-3, "α = {alpha}, μ = {mu}: {e}, not {expected}");
        }
        for (alpha, expected) in [(0.25, 0.882_323), (0.5, 0.700_240)] {
            let e = 1.0 - reflector_table().at(alpha).average()[0];
            assert!((e - expected).abs() < 1e-3, "α = {alpha}: mean {e}, not {expected}");
        }
    }

    /// Oracle: the reflected and transmitted shares of a rough interface with index 1.5, α = ½; from
    /// inside, along the normal, it returns 0.754 in all.
    #[test]
    fn a_rough_interface_splits_light_as_it_should() {
        let lattice = Lattice::FINE;
        for (mu, reflected, transmitted) in
            [(1.0, 0.028_174_8, 0.939_931_7), (0.5, 0.043_935_4, 0.848_695_7)]
        {
            let (r, t) = dielectric_albedo(&lattice, 0.5, mu, 1.5);
            assert!(
                (r - reflected).abs() < 2e-4 && (t - transmitted).abs() < 2e-4,
                "{mu}: {r} {t}"
            );
            let lost = glass_table(1.5, Widths::One(0.5)).at(0.5).value(mu)[0];
            assert!(
                (f64::from(lost) - (1.0 - reflected - transmitted)).abs() < 5e-4,
                "{mu}: {lost}"
            );
        }
        let (r, t) = dielectric_albedo(&lattice, 0.5, 1.0, 1.0 / 1.5);
        assert!((r + t - 0.754).abs() < 1e-3, "{r} + {t}");
    }

    /// Oracle: drawing visible normals at random; 4 standard errors of 200 000 draws are below 4·10⁻³.
    #[test]
    fn glass_loses_what_a_simulation_loses() {
        let mut random = Random::new(41);
        let n = 200_000;
        for (alpha, mu) in [(0.05, 0.1), (0.3, 0.65), (0.5, 0.7), (0.77, 0.35), (1.0, 0.01)] {
            let ggx = Ggx { alpha };
            let wo = direction(f64::from(mu), 0.0);
            let one = glass_table(1.5, Widths::One(alpha)).at(alpha).value(mu);
            for (side, eta) in [1.5, 1.0 / 1.5].into_iter().enumerate() {
                let mut returned = 0.0;
                for _ in 0..n {
                    let m = ggx.sample_visible(wo, random.square());
                    let cos = wo.dot(m).clamp(0.0, 1.0);
                    let f = dielectric(cos, (1.0 - cos) * (1.0 + cos), eta).reflectance;
                    let (wr, wt) = (reflect(wo, m), refract(wo, m, eta));
                    if wr.z > 0.0 {
                        returned += f64::from(f * ggx.shadowing(wo.z, wr.z));
                    }
                    if f < 1.0 && wt.z < 0.0 {
                        returned += f64::from((1.0 - f) * ggx.shadowing(wo.z, -wt.z));
                    }
                }
                let lost = 1.0 - returned / f64::from(n);
                let difference = (f64::from(one[side]) - lost).abs();
                assert!(difference < 4e-3, "α = {alpha}, μ = {mu}: {} and {lost}", one[side]);
            }
        }
    }

    /// A table over all widths agrees with the table made for one of them.
    #[test]
    fn interpolating_between_widths_is_accurate() {
        let all = glass_table(1.5, Widths::All);
        for alpha in [0.002, 0.015, 0.07, 0.3, 0.77] {
            let one = glass_table(1.5, Widths::One(alpha));
            for k in 1..=40 {
                let mu = k as f32 / 40.0;
                let (a, b) = (all.at(alpha).value(mu), one.at(alpha).value(mu));
                for side in 0..2 {
                    let difference = (a[side] - b[side]).abs();
                    assert!(difference < 5e-3, "α = {alpha}, μ = {mu}, side {side}: {a:?} {b:?}");
                }
            }
        }
    }

    /// Oracle: with no roughness to speak of the coat reflects by Fresnel.
    #[test]
    fn a_nearly_smooth_coat_reflects_by_fresnel() {
        let table = coat_table(1.5, Widths::One(SMOOTH_BELOW_ALPHA));
        for mu in [1.0, 0.7, 0.3, 0.1] {
            let f = dielectric(mu, 1.0 - mu * mu, 1.5).reflectance;
            let a = table.at(SMOOTH_BELOW_ALPHA).value(mu)[0];
            assert!((a - f).abs() < 5e-3, "μ = {mu}: {a}, not {f}");
        }
    }
}
