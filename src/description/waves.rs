//! A surface of water, as a scene file says it.
//!
//! Gravity waves on deep water: a particle whose place at rest is `(x, z)` moves on a circle, the
//! surface is a sum of trochoids (Gerstner 1802, "Theorie der Wellen"; as a sum in Tessendorf 2001,
//! "Simulating Ocean Water", section 3.1). A wave of amplitude `a`, of `f` periods a second, which
//! travels along `D = (cos θ, sin θ)` in the plane (x, z), has
//!
//! ```text
//! ω = 2π·f,   k = ω²/g  (the dispersion of deep water),   ψ = k·D·(x, z) − ω·t + φ
//! ```

use super::TriangleMesh;
use crate::math::Chart;
use glam::{DVec2, Vec2, Vec3};
use serde::Deserialize;
use std::f64::consts::TAU;

/// A sheet of water around the origin, its mean height y = 0, its front towards +y.
#[derive(Clone, Debug, PartialEq)]
pub struct Waves {
    /// Extent along x and z at rest, metres.
    pub size: DVec2,
    /// Cells along x and z, each of two triangles.
    pub cells: (u32, u32),
    /// Share of the horizontal motion: 0 is a sum of sines in height, 1 the full circles with their
    /// sharp crests.
    pub steepness: f64,
    /// Metres per second squared.
    pub gravity: f64,
    /// What is summed.
    pub waves: Vec<Wave>,
}

/// One train of waves.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename = "wave", deny_unknown_fields)]
pub struct Wave {
    /// Half the height from trough to crest, metres.
    pub amplitude: f64,
    /// Periods per second.
    pub frequency: f64,
    /// Where it travels: degrees from +x towards +z.
    #[serde(default)]
    pub direction: f64,
    /// Degrees; at 0 a crest passes the origin at time 0.
    #[serde(default)]
    pub phase: f64,
}

impl Wave {
    /// Radians per second.
    pub fn angular_frequency(&self) -> f64 {
        TAU * self.frequency
    }

    /// Radians per metre on deep water.
    pub fn number(&self, gravity: f64) -> f64 {
        self.angular_frequency().powi(2) / gravity
    }
}

impl Waves {
    /// The greatest share by which the surface can be pushed together anywhere; above 1 it may fold
    /// over itself.
    pub fn greatest_compression(&self) -> f64 {
        let each = self.waves.iter().map(|wave| wave.amplitude * wave.number(self.gravity));
        self.steepness * each.sum::<f64>()
    }

    /// The sheet at rest; uv is the unit square, (0, 0) at −x and +z.
    pub fn at_rest(&self) -> TriangleMesh {
        let (nx, nz) = self.cells;
        let share = |k: u32, n: u32| f64::from(k) / f64::from(n);
        let (mut positions, mut uvs) = (Vec::new(), Vec::new());
        for j in 0..=nz {
            for i in 0..=nx {
                let (u, w) = (share(i, nx), share(j, nz));
                let (x, z) = ((u - 0.5) * self.size.x, (w - 0.5) * self.size.y);
                positions.push(Vec3::new(x as f32, 0.0, z as f32));
                uvs.push(Vec2::new(u as f32, (1.0 - w) as f32));
            }
        }
        let mut triangles = Vec::new();
        for j in 0..nz {
            for i in 0..nx {
                let a = j * (nx + 1) + i;
                let [b, c, d] = [a + nx + 1, a + nx + 2, a + 1];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        let normals = vec![Vec3::Y; positions.len()];
        let chart = Chart::SQUARE;
        TriangleMesh { positions, normals, uvs, chart, triangles, ..Default::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet() -> Waves {
        let wave = Wave { amplitude: 0.01, frequency: 1.5, direction: 0.0, phase: 0.0 };
        let waves = vec![wave];
        Waves { size: DVec2::new(3.0, 2.0), cells: (6, 5), steepness: 0.7, gravity: 9.81, waves }
    }

    /// Oracle: the area of the rectangle, seen from above.
    #[test]
    fn the_sheet_at_rest_faces_up_and_covers_its_rectangle() {
        let mesh = sheet().at_rest();
        let area: Vec3 = mesh
            .triangles
            .iter()
            .map(|t| t.map(|k| mesh.positions[k as usize]))
            .map(|[a, b, c]| {
                let vector = (b - a).cross(c - a) * 0.5;
                assert!(vector.y > 0.0);
                vector
            })
            .sum();
        assert!(area.distance(Vec3::Y * 6.0) < 1e-5, "{area}");
        assert_eq!(mesh.positions.len(), 7 * 6);
        for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
            let expected = Vec2::new(p.x / 3.0 + 0.5, 0.5 - p.z / 2.0);
            assert!(uv.distance(expected) < 1e-6, "{uv} at {p}");
        }
    }

    /// Oracle: a wave of 2/3 s on deep water is 0.694 m long.
    #[test]
    fn deep_water_carries_waves_of_the_known_length() {
        let length = TAU / sheet().waves[0].number(9.81);
        assert!((length - 0.694).abs() < 5e-4, "{length}");
    }
}
