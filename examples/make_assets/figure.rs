//! Animals of smoothly joined ellipsoids, as signed distance fields.
//!
//! Both face +x and are symmetric in z. Lengths in metres, before a scene scales them.

use glam::{DMat3, DVec3};

/// An ellipsoid: centre, radii, degrees about x, then y, then z, and the width over which it blends with
/// what came before it.
type Part = ([f64; 3], [f64; 3], [f64; 3], f64);

const RABBIT: [Part; 15] = [
    // Torso, rump, chest, neck, head, muzzle, cheek, ear.
    ([-0.060, 0.330, 0.0], [0.330, 0.250, 0.225], [0.0, 0.0, 14.0], 0.0),
    ([-0.235, 0.275, 0.0], [0.250, 0.262, 0.245], [0.0; 3], 0.10),
    ([0.165, 0.350, 0.0], [0.165, 0.225, 0.160], [0.0, 0.0, -8.0], 0.10),
    ([0.235, 0.560, 0.0], [0.120, 0.150, 0.110], [0.0, 0.0, -20.0], 0.10),
    ([0.330, 0.715, 0.0], [0.180, 0.140, 0.130], [0.0, 0.0, -16.0], 0.05),
    ([0.455, 0.668, 0.0], [0.080, 0.068, 0.075], [0.0, 0.0, -12.0], 0.05),
    ([0.375, 0.665, 0.062], [0.085, 0.068, 0.062], [0.0; 3], 0.045),
    ([0.215, 1.000, 0.088], [0.036, 0.235, 0.066], [7.0, 40.0, 16.0], 0.045),
    // Thigh, hind foot, foreleg, forepaw, tail, nose, eye.
    ([-0.160, 0.215, 0.180], [0.195, 0.185, 0.095], [0.0, 0.0, 25.0], 0.025),
    ([0.010, 0.046, 0.190], [0.180, 0.046, 0.058], [0.0; 3], 0.03),
    ([0.235, 0.190, 0.082], [0.060, 0.180, 0.055], [0.0, 0.0, 6.0], 0.05),
    ([0.280, 0.040, 0.085], [0.085, 0.040, 0.048], [0.0; 3], 0.03),
    ([-0.500, 0.215, 0.0], [0.085, 0.085, 0.085], [0.0; 3], 0.03),
    ([0.528, 0.690, 0.0], [0.020, 0.016, 0.024], [0.0; 3], 0.012),
    ([0.402, 0.762, 0.098], [0.030, 0.034, 0.022], [0.0; 3], 0.006),
];

/// What is taken out of the rabbit's ear.
const EAR_HOLLOW: Part = ([0.246, 1.020, 0.062], [0.026, 0.175, 0.040], [7.0, 40.0, 16.0], 0.02);

const FISH: [Part; 8] = [
    // Body, head, stalk of the tail, both fins of the tail, back fin, side fin, eye.
    ([0.0; 3], [0.200, 0.075, 0.045], [0.0; 3], 0.0),
    ([0.085, 0.004, 0.0], [0.110, 0.066, 0.046], [0.0; 3], 0.05),
    ([-0.185, 0.0, 0.0], [0.080, 0.028, 0.016], [0.0; 3], 0.05),
    ([-0.265, 0.048, 0.0], [0.075, 0.026, 0.009], [0.0, 0.0, -40.0], 0.03),
    ([-0.265, -0.048, 0.0], [0.075, 0.026, 0.009], [0.0, 0.0, 40.0], 0.03),
    ([-0.010, 0.082, 0.0], [0.080, 0.034, 0.008], [0.0, 0.0, -10.0], 0.02),
    ([0.060, -0.035, 0.050], [0.050, 0.018, 0.010], [30.0, 25.0, 30.0], 0.015),
    ([0.140, 0.020, 0.036], [0.012, 0.012, 0.008], [0.0; 3], 0.003),
];

/// An ellipsoid ready to be measured from.
#[derive(Clone, Copy)]
struct Ellipsoid {
    centre: DVec3,
    /// Into the frame of its axes.
    axes_from_figure: DMat3,
    radii: DVec3,
    blend: f64,
}

impl Ellipsoid {
    fn new(&(centre, radii, degrees, blend): &Part) -> Self {
        let [x, y, z] = degrees.map(f64::to_radians);
        let turn =
            DMat3::from_rotation_z(z) * DMat3::from_rotation_y(y) * DMat3::from_rotation_x(x);
        Self {
            centre: centre.into(),
            axes_from_figure: turn.transpose(),
            radii: radii.into(),
            blend,
        }
    }

    /// About the distance: exact at the surface to first order, negative inside (Quilez 2008,
    /// "Ellipsoids: distance bound").
    fn distance(&self, p: DVec3) -> f64 {
        let q = self.axes_from_figure * (p - self.centre);
        let (k0, k1) = ((q / self.radii).length(), (q / (self.radii * self.radii)).length());
        if k1 == 0.0 { -self.radii.min_element() } else { k0 * (k0 - 1.0) / k1 }
    }
}

/// The union of both, rounded where they are nearer to each other than `k` (the quadratic polynomial
/// smooth minimum).
fn smooth_union(a: f64, b: f64, k: f64) -> f64 {
    let near = (k - (a - b).abs()).max(0.0);
    a.min(b) - if k > 0.0 { near * near / (4.0 * k) } else { 0.0 }
}

/// What is in both, rounded likewise.
fn smooth_intersection(a: f64, b: f64, k: f64) -> f64 {
    -smooth_union(-a, -b, k)
}

/// A signed distance field, about; negative inside.
#[derive(Clone)]
pub struct Figure {
    parts: Vec<Ellipsoid>,
    hollow: Option<Ellipsoid>,
    /// Whether it is cut off, with a rounded rim, at y = 0.
    stands: bool,
    /// A box which holds it.
    pub min: DVec3,
    pub max: DVec3,
}

/// A rabbit which sits on y = 0.
pub fn rabbit() -> Figure {
    Figure {
        parts: RABBIT.iter().map(Ellipsoid::new).collect(),
        hollow: Some(Ellipsoid::new(&EAR_HOLLOW)),
        stands: true,
        min: DVec3::new(-0.60, -0.01, -0.29),
        max: DVec3::new(0.56, 1.25, 0.29),
    }
}

/// A fish around the origin.
pub fn fish() -> Figure {
    Figure {
        parts: FISH.iter().map(Ellipsoid::new).collect(),
        hollow: None,
        stands: false,
        min: DVec3::new(-0.352, -0.131, -0.11),
        max: DVec3::new(0.21, 0.13, 0.11),
    }
}

impl Figure {
    /// The field at a point.
    pub fn distance(&self, p: DVec3) -> f64 {
        let p = DVec3::new(p.x, p.y, p.z.abs());
        let first = self.parts[0].distance(p);
        let join = |d, part: &Ellipsoid| smooth_union(d, part.distance(p), part.blend);
        let mut d = self.parts[1..].iter().fold(first, join);
        if let Some(hollow) = self.hollow {
            d = smooth_intersection(d, -hollow.distance(p), hollow.blend);
        }
        if self.stands { smooth_intersection(d, -p.y, 0.01) } else { d }
    }

    /// Its gradient, by central differences over 2 mm: about a unit vector near the surface, outwards.
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        let h = 1e-3;
        let along = |axis: DVec3| self.distance(p + h * axis) - self.distance(p - h * axis);
        DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)) / (2.0 * h)
    }
}
