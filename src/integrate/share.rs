//! Paths of neighbouring pixels use each other's continuations.
//!
//! A path leaves the first surface that scatters at random, its *departure* `xᵢ`, and meets another, its
//! *landing* `yᵢ`. What leaves a diffuse landing is the same in all directions, so that it serves the
//! paths of the neighbours as well: each connects its own departure to all landings of the group, at
//! the price of a shadow ray, where a continuation of its own would take several rays. With the densities
//! `pₖ(y)` per unit area with which each path of the group lands at `y`, the estimate
//!
//! ```text
//! Lᵢ = Σⱼ βᵢ·f(yⱼ → xᵢ)·G(xᵢ, yⱼ)·V(xᵢ, yⱼ)·L(yⱼ) / Σₖ V(xₖ, yⱼ)·pₖ(yⱼ)
//! ```
//!
//! is that of multiple importance sampling with the balance heuristic over the techniques "land where
//! path k lands". It has the same mean for every pixel as the path alone. The shadow rays for `V` are
//! those of the connections: where a path could not have landed it is not counted among the techniques.
//!
//! Bekaert, Sbert and Halton 2002, "Accelerating Path Tracing by Re-Using Paths", Eurographics Workshop on
//! Rendering, sections 3 and 4. There the groups are fixed tiles; here their borders move from sample to
//! sample, so that no grid shows, and landings which are not diffuse or are seen from the wrong side of
//! their shading normal stay with their own path.
//!
//! The noise of neighbouring pixels is no longer independent: there is less of it, in softer blotches.

use super::PathTracer;
use super::path::PathCounters;
use super::vertex::Vertex;
use crate::build::bvh::SurfacePoint;
use crate::build::light::{Receiver, ShadowEnd, shadow_ray};
use crate::description::Rgb;
use crate::film::PixelSample;
use crate::shade::Bsdf;
use crate::shade::nesting::{Inside, SolidStack};
use glam::{DVec3, Vec3};

/// A path with what its neighbours may use.
pub(super) struct SharedPath<'a> {
    /// What the path gathered, without what leaves the landing.
    pub(super) sample: PixelSample,
    pub(super) departure: Option<Departure<'a>>,
    pub(super) landing: Option<Landing>,
}

/// The first surface that scattered a path at random.
pub(super) struct Departure<'a> {
    pub(super) vertex: Vertex<'a>,
    /// Surface interactions before it.
    pub(super) depth: u32,
    /// Throughput of the path up to it.
    pub(super) throughput: Rgb,
    /// `f·|cos θ|/pdf` of the direction that was drawn.
    pub(super) weight: Rgb,
    /// Density of that direction per unit solid angle.
    pub(super) pdf: f32,
}

/// The diffuse surface where a path landed from its departure.
pub(super) struct Landing {
    p: DVec3,
    p_error: DVec3,
    ng: Vec3,
    ns: Vec3,
    /// Density per unit area with which its own path lands there.
    density: f64,
    /// Radiance which leaves it, without its own emission.
    pub(super) leaving: Rgb,
}

impl Landing {
    /// A landing seen along `wo`; `None` where it cannot be shared.
    pub(super) fn new(
        surface: &SurfacePoint,
        wo: Vec3,
        bsdf: &Bsdf,
        departure: &Departure,
    ) -> Option<Self> {
        let SurfacePoint { p, p_error, ng, ns, .. } = *surface;
        // Turned to the side from which it was reached.
        let (ng, ns) = if wo.dot(ng) < 0.0 { (-ng, -ns) } else { (ng, ns) };
        if !matches!(bsdf, Bsdf::Diffuse(_)) || wo.dot(ns) <= 0.0 {
            return None;
        }
        let to = p - departure.vertex.ray_origin.p;
        let density = f64::from(departure.pdf) * area_per_solid_angle(to, wo.dot(ng));
        (density > 0.0 && density.is_finite()).then_some(Self {
            p,
            p_error,
            ng,
            ns,
            density,
            leaving: Rgb::ZERO,
        })
    }
}

/// `cos θ/d²`: solid angle per unit area of a surface at the end of `to`.
#[inline]
fn area_per_solid_angle(to: DVec3, cos: f32) -> f64 {
    f64::from(cos) / to.length_squared()
}

/// What a path of the group makes of a landing.
#[derive(Clone, Copy)]
struct Connection {
    path: usize,
    /// `f·|cos θ|·G·V` over the cosine at the departure, and the throughput up to there.
    value: Rgb,
    /// `cos θ/d²` at the landing.
    geometry: f64,
    /// Density per unit area with which this path would have landed here.
    density: f64,
}

impl<const OPACITY: bool, I: Inside> PathTracer<'_, OPACITY, I> {
    /// Adds to each path of a group what leaves all its landings.
    ///
    /// `GROUP` is at least the number of paths.
    pub(super) fn connect<const GROUP: usize>(
        &self,
        paths: &mut [SharedPath],
        counters: &mut PathCounters,
    ) {
        const NONE: Connection =
            Connection { path: 0, value: Rgb::ZERO, geometry: 0.0, density: 0.0 };
        for own in 0..paths.len() {
            let (Some(landing), Some(departure)) = (&paths[own].landing, &paths[own].departure)
            else {
                continue;
            };
            let leaving = landing.leaving;
            if leaving == Rgb::ZERO {
                continue;
            }
            let mut connections = [NONE; GROUP];
            let mut count = 0;
            let mut density = landing.density;
            for (other, path) in paths.iter().enumerate() {
                if other == own {
                    continue;
                }
                let Some(from) = path.departure.as_ref().filter(|d| d.depth == departure.depth)
                else {
                    continue;
                };
                if let Some(connection) = self.connection(other, from, landing, counters) {
                    density += connection.density;
                    connections[count] = connection;
                    count += 1;
                }
            }
            let share = (landing.density / density) as f32;
            let own_light = departure.throughput * departure.weight * leaving * share;
            for connection in &connections[..count] {
                let scale = (connection.geometry / density) as f32;
                paths[connection.path].sample.radiance += connection.value * leaving * scale;
            }
            paths[own].sample.radiance += own_light;
        }
    }

    /// The connection of a departure to another path's landing; `None` where nothing passes.
    fn connection(
        &self,
        path: usize,
        from: &Departure,
        landing: &Landing,
        counters: &mut PathCounters,
    ) -> Option<Connection> {
        let to = landing.p - from.vertex.ray_origin.p;
        let wi = to.as_vec3().try_normalize()?;
        let cos = -wi.dot(landing.ng);
        if cos <= 0.0 || -wi.dot(landing.ns) <= 0.0 {
            return None;
        }
        let (f_cos, pdf) = from.vertex.evaluate(wi);
        let geometry = area_per_solid_angle(to, cos);
        if !(pdf > 0.0 && geometry.is_finite()) {
            return None;
        }
        let receiver: Receiver = from.vertex.receiver();
        let end = ShadowEnd::Surface { p: landing.p, p_error: landing.p_error, n: landing.ng };
        let (ray, t_max) = shadow_ray(&receiver, wi, &end, 0.0);
        counters.rays += 1;
        let outside = I::new(&SolidStack::default());
        (self.visible(&ray, t_max, &outside) > 0.0).then(|| Connection {
            path,
            value: from.throughput * f_cos,
            geometry,
            density: f64::from(pdf) * geometry,
        })
    }
}
