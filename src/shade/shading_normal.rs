//! Scattering where the shading normal `n_s` is not the normal `n_g` of the surface.
//!
//! A BSDF around `n_s` sends some of its light to the other side of the surface than it means to: a mirror into
//! what it belongs to, glass back to where the light came from. Dropped, that light is missing: glass gets dark
//! specks, rough metal dark rims. The rule, for every lobe of every model:
//!
//! ```text
//! what is scattered to the wrong side is thrown back by the surface:   w' = w − 2 (w·n_g) n_g
//! f'(w) = f(w) + f(w'),   p'(w) = p(w) + p(w'),   the second terms where w' is on the wrong side,
//! ```
//!
//! and both are 0 for a `w` which is on the wrong side itself. Mirroring keeps solid angles, so that `∫ f'|cos| = ∫ f|cos|`
//! whatever the normals, and a direction which crosses the horizon leads on without a jump. Thrown back is what a
//! facet in the plane of the surface does in Schüssler et al. 2017, "Microfacet-based Normal Mapping for Robust Monte
//! Carlo Path Tracing", ACM Trans. Graph. 36(6), section 3: there all facets are part of the model, here the surface is one. Bending
//! `n_s` instead (Keller et al. 2017, "The Iray Light Transport Simulation and Rendering System", section "Bump Mapping") is
//! done for reliefs, whose mirror images it keeps in place, but it serves one lobe at a time.
//!
//! # Closed orbits
//! Reflections about `n_g` keep volumes of phase space, those about `n_s` do not: inside of glass whose normals are bent they can draw
//! paths into closed orbits of total reflections, which no depth ends. A solid whose surface had these normals would be left by that
//! light at last; where it goes cannot be said. So after a number of reflections in a row inside of a solid, about normals that are not
//! those of its surface, light leaves straight on: nothing is lost, and how much went that way is told.

use super::bsdf::{Bsdf, BsdfSample, BsdfValue, TransportMode};
use crate::math::Frame;
use glam::{Vec2, Vec3};

/// Cosines to the geometric normal below this have no certain sign: direction, normal and product are rounded, each to less than ε.
/// A path which was taken for inside would begin outside.
const CERTAIN_HEIGHT: f32 = 4.0 * f32::EPSILON;

/// How a point of a surface scatters what it sends along `wo`, in the space of its normals.
#[derive(Clone, Copy, Debug)]
pub struct ShadedBsdf<'v, 't> {
    /// In the frame of the shading normal.
    pub bsdf: &'v Bsdf<'t>,
    /// The frame of the shading normal, which is on the side of `wo` where the geometric one is.
    pub frame: &'v Frame,
    /// Geometric normal.
    pub ng: Vec3,
    /// Where the path comes from.
    pub wo: Vec3,
}

/// Reflections in a row inside of a solid, about normals that are not those of its surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InnerReflections {
    count: u32,
    most: u32,
    let_out: bool,
}

impl InnerReflections {
    /// None so far; `most` is after how many the path is let out.
    pub fn new(most: u32) -> Self {
        Self { count: 0, most, let_out: false }
    }

    /// Whether the path was let out where it was scattered last.
    pub fn was_let_out(&self) -> bool {
        self.let_out
    }
}

impl ShadedBsdf<'_, '_> {
    /// Whether `wi` leaves on the other side of the surface than the path arrived from.
    #[inline]
    pub fn crosses(&self, wi: Vec3) -> bool {
        (wi.dot(self.ng) > 0.0) != (self.wo.dot(self.ng) > 0.0)
    }

    /// Whether `wi` leaves by the side on which the BSDF places it.
    #[inline]
    pub fn is_consistent(&self, wi: Vec3) -> bool {
        self.crosses(wi) == self.is_beyond(wi)
    }

    /// The same by the shading normal as [`ShadedBsdf::crosses`] is by the geometric one.
    #[inline]
    fn is_beyond(&self, wi: Vec3) -> bool {
        (wi.dot(self.frame.z) > 0.0) != (self.wo.dot(self.frame.z) > 0.0)
    }

    /// The direction on the wrong side whose light is thrown back into `wi`, which is consistent; `None` where there is none.
    #[inline]
    pub fn thrown_back(&self, wi: Vec3) -> Option<Vec3> {
        if self.frame.z == self.ng {
            return None;
        }
        let from = wi - 2.0 * wi.dot(self.ng) * self.ng;
        (self.is_beyond(from) == self.crosses(wi)).then_some(from)
    }

    #[inline]
    fn evaluate_shaded(&self, wi: Vec3, mode: TransportMode) -> BsdfValue {
        let local = |v: Vec3| match self.bsdf {
            // It looks at cosines alone, and is asked for the most connections.
            Bsdf::Diffuse(_) => Vec3::Z * v.dot(self.frame.z),
            _ => self.frame.to_local(v),
        };
        self.bsdf.evaluate(local(self.wo), local(wi), mode)
    }

    /// `f'·|cos θ|` and `p'` of a direction, all lobes which are not deltas.
    #[inline]
    pub fn evaluate(&self, wi: Vec3, mode: TransportMode) -> BsdfValue {
        if !self.is_consistent(wi) {
            return BsdfValue::ZERO;
        }
        let value = self.evaluate_shaded(wi, mode);
        match self.thrown_back(wi) {
            None => value,
            Some(from) => {
                let back = self.evaluate_shaded(from, mode);
                BsdfValue { f_cos: value.f_cos + back.f_cos, pdf: value.pdf + back.pdf }
            }
        }
    }

    /// Draws where the path goes on; [`Bsdf::sample`]. `wi` of the sample is local, and as it was drawn.
    #[inline]
    pub fn sample(
        &self,
        lobe: f32,
        u: Vec2,
        mode: TransportMode,
        inner: &mut InnerReflections,
    ) -> Option<(Vec3, BsdfSample)> {
        let wo = self.frame.to_local(self.wo);
        inner.let_out = false;
        if inner.count >= inner.most
            && let Some(sample) = self.let_out(wo, mode)
        {
            *inner = InnerReflections { let_out: true, ..InnerReflections::new(inner.most) };
            return Some((-self.wo, sample));
        }
        let mut sample = self.bsdf.sample(wo, lobe, u, mode)?;
        let mut wi = self.frame.from_local(sample.wi).normalize();
        let side = if (self.wo.dot(self.ng) > 0.0) == sample.transmitted { -1.0 } else { 1.0 };
        let height = side * wi.dot(self.ng);
        if height < CERTAIN_HEIGHT {
            wi = self.throw_back(wi, side);
            if height < 0.0 && !sample.delta && self.is_consistent(wi) {
                sample.pdf += self.evaluate_shaded(wi, mode).pdf;
            }
        } else if !sample.delta
            && let Some(from) = self.thrown_back(wi)
        {
            sample.pdf += self.evaluate_shaded(from, mode).pdf;
        }
        if sample.transmitted {
            inner.count = 0;
        } else if self.is_bent_inside() && self.bsdf.refracts(wo).is_some() {
            inner.count += 1;
        }
        Some((wi, sample))
    }

    /// Mirrors a direction at the surface, to the side on which it was meant to be, at a height which leaves no doubt of that.
    fn throw_back(&self, wi: Vec3, side: f32) -> Vec3 {
        let height = wi.dot(self.ng);
        let lifted = height.abs().max(CERTAIN_HEIGHT);
        (wi - height * self.ng + side * lifted * self.ng).normalize()
    }

    /// Whether the path is behind a surface whose shading normal is bent.
    #[inline]
    fn is_bent_inside(&self) -> bool {
        self.wo.dot(self.ng) < 0.0 && self.frame.z != self.ng
    }

    /// Out of a solid, straight on, where normals are bent.
    #[cold]
    fn let_out(&self, wo: Vec3, mode: TransportMode) -> Option<BsdfSample> {
        let crossing = self.bsdf.refracts(wo).filter(|_| self.is_bent_inside())?;
        Some(BsdfSample::let_through(wo, crossing, mode))
    }
}
