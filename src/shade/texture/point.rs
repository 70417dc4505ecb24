//! What a texture looks at: a point of a surface, and how much of the surface one sample stands for.

use super::domain::Domain;
use crate::description::Rgb;
use crate::math::Chart;
use glam::{DMat2, DVec2, DVec3, Vec2, Vec3};

/// A point of a surface, as textures see it.
#[derive(Clone, Copy, Debug)]
pub struct TexturePoint {
    /// Surface coordinates.
    pub uv: Vec2,
    /// Which uv there are.
    pub domain: Domain,
    /// Place in the space of the object, metres before its transform. Only where a texture asks for it, as
    /// all that follows; 0 elsewhere.
    pub p: DVec3,
    /// Unit normal in the space of the object.
    pub n: Vec3,
    /// Colour of a mesh, interpolated between its corners.
    pub color: Rgb,
    /// The axes of the ellipse that a sample stands for, as changes of uv from end to end.
    pub axes: [Vec2; 2],
    /// Its greatest diameter, metres in the space of the object.
    pub width: f32,
    /// Time in the shutter, from 0 to 1.
    pub time: f32,
    /// Whether it is a place inside a solid, where x and y stand for uv.
    pub is_inside: bool,
}

impl TexturePoint {
    /// A point of which nothing is known but uv; textures are not filtered there.
    pub const fn at(uv: Vec2) -> Self {
        Self::on(Chart::ENDLESS, uv)
    }

    /// The same where surface coordinates end as a chart says.
    pub const fn on(chart: Chart, uv: Vec2) -> Self {
        Self {
            uv,
            domain: Domain::new(chart),
            p: DVec3::ZERO,
            n: Vec3::Z,
            color: Rgb::ONE,
            axes: [Vec2::ZERO; 2],
            width: 0.0,
            time: 0.0,
            is_inside: false,
        }
    }

    /// The same point, of which a sample stands for itself alone: textures are not filtered there.
    #[must_use]
    pub fn unfiltered(&self) -> Self {
        Self { axes: [Vec2::ZERO; 2], width: 0.0, ..*self }
    }

    /// A place inside a solid at a time in the shutter: x and y stand for uv.
    pub fn inside(p: DVec3, time: f32) -> Self {
        Self { p, time, is_inside: true, ..Self::at(p.truncate().as_vec2()) }
    }

    /// The same point at another place; inside a solid uv goes along.
    #[must_use]
    pub(super) fn moved(mut self, by: DVec3) -> Self {
        self.p += by;
        if self.is_inside {
            self.uv = self.p.truncate().as_vec2();
        }
        self
    }

    /// The same point with other surface coordinates: `m·uv + offset`.
    #[must_use]
    pub(super) fn placed(mut self, m: DMat2, offset: DVec2) -> Self {
        self.uv = (m * self.uv.as_dvec2() + offset).as_vec2();
        self.domain = self.domain.placed(m, offset);
        self.axes = self.axes.map(|axis| (m * axis.as_dvec2()).as_vec2());
        self
    }

    /// The sides of the box around the ellipse in uv.
    pub(super) fn extent(&self) -> Vec2 {
        (self.axes[0] * self.axes[0] + self.axes[1] * self.axes[1]).map(f32::sqrt)
    }
}
