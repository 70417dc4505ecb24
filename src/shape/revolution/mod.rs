//! A profile turned around the y axis. Faces: the pieces of the profile in their order, then the disk that
//! closes its beginning, then the one that closes its end.
//!
//! A closed surface, one which bounds a solid, faces outwards; an open one faces to the right of the way along
//! its profile, radii growing to the right and heights upwards.

#![expect(
    clippy::inline_always,
    reason = "vector instructions are used only where this is inlined into a function that has them"
)]

mod meet;
mod meridian;

use super::{AreaFactor, CanonicalPoint, LocalHit, LocalRay, LocalSurface, longitude};
use crate::math::{Aabb, Chart, Piece, Profile};
use crate::sampling::warp::square_to_disk;
use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// A surface of revolution; lengths are those of its profile.
#[derive(Clone, Debug, PartialEq)]
pub struct Revolution {
    profile: Arc<Profile>,
    capped: bool,
}

impl Revolution {
    /// The profile turned around the y axis; `capped`: ends which are not on the axis are closed by disks.
    pub fn new(profile: Arc<Profile>, capped: bool) -> Self {
        Self { profile, capped }
    }

    /// The profile.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// (radius, height) of the rim of the disk at the beginning (0) or the end (1).
    fn cap(&self, end: usize) -> Option<DVec2> {
        if self.capped { self.profile.open_ends[end] } else { None }
    }

    /// 1 if the outside is to the right of the way along the profile, −1 if to the left.
    fn outward(&self) -> f64 {
        self.profile.outward(self.capped)
    }

    fn cap_area(&self, end: usize) -> f64 {
        self.cap(end).map_or(0.0, |rim| PI * rim.x * rim.x)
    }

    /// Area of the surface with its disks.
    pub fn area(&self) -> f64 {
        self.profile.area() + self.cap_area(0) + self.cap_area(1)
    }

    pub(super) fn bounds(&self) -> Aabb {
        let (radius, [low, high]) = self.profile.extent;
        let error = self.profile.error();
        let corner = |r: f64, y: f64| Vec3::new(r as f32, y as f32, r as f32);
        Aabb {
            min: corner(-radius - error, low - error).map(f32::next_down),
            max: corner(radius + error, high + error).map(f32::next_up),
        }
    }

    /// The nearest hit with `0 < t < t_max`.
    pub(super) fn intersect(&self, ray: &LocalRay, t_max: f64) -> Option<LocalHit> {
        meet::nearest(&self.profile, [self.cap(0), self.cap(1)], ray, t_max)
    }

    pub(super) fn surface(&self, p: DVec3, face: u32, needs_uv: bool) -> LocalSurface {
        let error = self.profile.error();
        let count = self.profile.pieces.len();
        let end = (face as usize).saturating_sub(count);
        if face as usize >= count
            && let Some(rim) = self.cap(end)
        {
            return LocalSurface { error, ..self.disk(p, rim, end) };
        }
        let piece = &self.profile.pieces[(face as usize).min(count - 1)];
        let radius = (p.x * p.x + p.z * p.z).sqrt();
        let u = piece.parameter_of(DVec2::new(radius, p.y));
        let on_profile = piece.jet(u).p;
        let radial = DVec3::new(p.x, 0.0, p.z).normalize_or(DVec3::Z);
        let along = piece.direction(u) * self.outward();
        let normal = radial * along.y - DVec3::Y * along.x;
        let uv = if needs_uv {
            (longitude(radial), piece.v.0 + (piece.v.1 - piece.v.0) * u)
        } else {
            (0.0, 0.0)
        };
        let across = DVec3::new(radial.z, 0.0, -radial.x);
        let p = radial * on_profile.x.max(0.0) + DVec3::Y * on_profile.y;
        LocalSurface { error, ..LocalSurface::smooth(p, normal, uv, self.profile.chart(), across) }
    }

    /// `∂p/∂u` and `∂p/∂v` at a point of a face.
    pub(super) fn derivatives(&self, p: DVec3, face: u32) -> [DVec3; 2] {
        let count = self.profile.pieces.len();
        let end = (face as usize).saturating_sub(count);
        if face as usize >= count
            && let Some(rim) = self.cap(end)
        {
            let side = if end == 0 { -self.outward() } else { self.outward() };
            return [DVec3::X * (2.0 * rim.x), DVec3::Z * (-2.0 * rim.x * side)];
        }
        let piece = &self.profile.pieces[(face as usize).min(count - 1)];
        let radius = (p.x * p.x + p.z * p.z).sqrt();
        let jet = piece.jet(piece.parameter_of(DVec2::new(radius, p.y)));
        let radial = DVec3::new(p.x, 0.0, p.z).normalize_or(DVec3::Z);
        let along = (radial * jet.d.x + DVec3::Y * jet.d.y) / (piece.v.1 - piece.v.0);
        [DVec3::new(p.z, 0.0, -p.x) * TAU, along]
    }

    /// A disk with this rim, seen from outside with +x to the right.
    fn disk(&self, p: DVec3, rim: DVec2, end: usize) -> LocalSurface {
        // As the part of a profile which comes from the axis, or goes there.
        let side = if end == 0 { -self.outward() } else { self.outward() };
        let (x, z) = (p.x / rim.x, p.z / rim.x);
        let uv = (0.5 + 0.5 * x, 0.5 - 0.5 * z * side);
        LocalSurface::smooth(
            DVec3::new(p.x, rim.y, p.z),
            DVec3::Y * side,
            uv,
            Chart::SQUARE,
            DVec3::X,
        )
    }

    /// Evenly by area over all faces.
    pub(super) fn sample(&self, u: Vec2) -> CanonicalPoint {
        let profile = &*self.profile;
        let pdf_area = self.pdf_area();
        let mut wanted = f64::from(u.x) * self.area();
        for end in 0..2 {
            let area = self.cap_area(end);
            if let Some(rim) = self.cap(end)
                && wanted < area
            {
                let disk =
                    square_to_disk(Vec2::new((wanted / area) as f32, u.y)).as_dvec2() * rim.x;
                let p = DVec3::new(disk.x, rim.y, disk.y);
                let face = (profile.pieces.len() + end) as u32;
                return CanonicalPoint { p, face, pdf_area };
            }
            wanted -= area;
        }
        let index = profile.areas.partition_point(|before| *before <= wanted);
        let index = index.clamp(1, profile.pieces.len()) - 1;
        let piece = &profile.pieces[index];
        let share = (wanted - profile.areas[index]) / piece.area;
        let at = piece.jet(piece.parameter_at_area(share)).p;
        let (sin, cos) = (TAU * f64::from(u.y)).sin_cos();
        CanonicalPoint { p: DVec3::new(at.x * sin, at.y, at.x * cos), face: index as u32, pdf_area }
    }

    /// The area under a map: Gauss's rule along each piece, even steps around the axis.
    pub(super) fn world_area(&self, world_from_shape: &DAffine3) -> f64 {
        /// For a map which stretches by a factor `s` across the axis the error falls as `((s − 1)/(s +
        /// 1))^AROUND`.
        const AROUND: u32 = 64;
        let factor = AreaFactor::new(&world_from_shape.matrix3);
        let around = |along: DVec2| {
            let normal = |k: u32| {
                let (sin, cos) = (TAU * f64::from(k) / f64::from(AROUND)).sin_cos();
                DVec3::new(along.y * sin, -along.x, along.y * cos)
            };
            (0..AROUND).map(|k| factor.at(normal(k))).sum::<f64>() / f64::from(AROUND)
        };
        let strip = |piece: &Piece| {
            piece.integral(1.0, |jet| {
                let length = jet.d.length();
                if length > 0.0 { TAU * jet.p.x.max(0.0) * length * around(jet.d) } else { 0.0 }
            })
        };
        let caps = (self.cap_area(0) + self.cap_area(1)) * factor.at(DVec3::Y);
        self.profile.pieces.iter().map(strip).sum::<f64>() + caps
    }

    pub(super) fn pdf_area(&self) -> f64 {
        1.0 / self.area()
    }
}
