//! From sums to pictures: one plane of numbers per channel of a layer.

use super::Film;
use crate::description::Layer;
use glam::DVec3;

/// One channel of a layer: its name and a number per pixel, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// As in an EXR file: `R`, `G`, `B`, `A`, `X`, `Y`, `Z`, `id`, `samples`.
    pub name: &'static str,
    /// The numbers.
    pub samples: PlaneSamples,
}

/// The numbers of a plane.
#[derive(Clone, Debug, PartialEq)]
pub enum PlaneSamples {
    /// Quantities.
    F32(Vec<f32>),
    /// Counts and ids.
    U32(Vec<u32>),
}

impl Film {
    /// Develops a layer into linear planes, or `None` where the film does not collect it.
    ///
    /// * `Beauty`: mean radiance, and where the film has it alpha, 1 − the mean transmittance: radiance is premultiplied
    ///   by it (Porter and Duff 1984, "Compositing Digital Images", section 3). `Samples`: how many it is the mean of.
    /// * `Albedo`: mean over the samples that met a surface, 0 without a hit.
    /// * `Normal`, `Position`, `Depth`: by [`LayerFilter`](crate::description::LayerFilter) what is at the centre of the
    ///   pixel, or the mean over the samples that met a surface; such normals are not made unit again, so that their
    ///   length tells how much they agree. Without a hit they are 0, and the depth is +∞.
    /// * `Motion`: the same, of the sky as well.
    /// * `ObjectId`: the object at the centre, or the one which most samples met; 0 without a hit.
    /// * `Variance`: of the pixel's mean, `M₂ / (n (n − 1))`, +∞ where fewer than 2 samples say nothing
    ///   about it.
    ///
    /// What exceeds the range of f32 becomes its largest number.
    pub fn image(&self, layer: Layer) -> Option<Vec<Plane>> {
        if !matches!(layer, Layer::Beauty | Layer::Samples) && !self.layers.contains(&layer) {
            return None;
        }
        let sums = &self.sums;
        Some(match layer {
            Layer::Beauty => {
                let mut planes = colors(["R", "G", "B"], &sums.mean);
                planes.extend(self.alpha.then(|| self.alpha_plane()));
                planes
            }
            Layer::Albedo => colors(["R", "G", "B"], &means(&sums.albedo, &sums.lit_hits)),
            Layer::Normal => colors(["X", "Y", "Z"], &means(&sums.normal, &sums.hits)),
            Layer::Position => colors(["X", "Y", "Z"], &means(&sums.position, &sums.hits)),
            Layer::Motion => {
                let motion: Vec<_> = sums.motion.iter().map(|m| m.extend(0.0)).collect();
                let mut planes = colors(["X", "Y", "Z"], &means(&motion, &sums.followed));
                planes.truncate(2);
                planes
            }
            Layer::Depth => vec![Plane { name: "Z", samples: PlaneSamples::F32(self.depth()) }],
            Layer::ObjectId => {
                let ids = sums.object.iter().map(|vote| vote.id).collect();
                vec![Plane { name: "id", samples: PlaneSamples::U32(ids) }]
            }
            Layer::Samples => {
                vec![Plane { name: "samples", samples: PlaneSamples::U32(sums.count.clone()) }]
            }
            Layer::Variance => colors(["R", "G", "B"], &self.variance_of_mean()),
        })
    }

    fn alpha_plane(&self) -> Plane {
        let alpha = |(sum, &n): (&f64, &u32)| match n {
            0 => 0.0, // nothing was seen
            n => (1.0 - sum / f64::from(n)) as f32,
        };
        let pixels = self.sums.transmittance.iter().zip(&self.sums.count);
        Plane { name: "A", samples: PlaneSamples::F32(pixels.map(alpha).collect()) }
    }

    fn depth(&self) -> Vec<f32> {
        let mean = |(&sum, &hits): (&f64, &u32)| {
            if hits == 0 { f32::INFINITY } else { (sum / f64::from(hits)) as f32 }
        };
        self.sums.depth.iter().zip(&self.sums.hits).map(mean).collect()
    }

    fn variance_of_mean(&self) -> Vec<DVec3> {
        let of_pixel = |(&m2, &n): (&DVec3, &u32)| match n {
            0 | 1 => DVec3::INFINITY,
            _ => m2 / (f64::from(n) * f64::from(n - 1)),
        };
        self.sums.m2.iter().zip(&self.sums.count).map(of_pixel).collect()
    }
}

fn means(sums: &[DVec3], counts: &[u32]) -> Vec<DVec3> {
    // A sum of nothing is 0, and stays 0.
    sums.iter().zip(counts).map(|(&sum, &n)| sum / f64::from(n.max(1))).collect()
}

/// Splits colours or vectors into planes.
fn colors(names: [&'static str; 3], values: &[DVec3]) -> Vec<Plane> {
    let plane = |axis: usize| values.iter().map(|value| to_f32(value[axis])).collect();
    names
        .into_iter()
        .enumerate()
        .map(|(axis, name)| Plane { name, samples: PlaneSamples::F32(plane(axis)) })
        .collect()
}

/// Rounds to f32; what is finite stays finite.
fn to_f32(value: f64) -> f32 {
    if value.is_infinite() {
        return value as f32;
    }
    value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::Rgb;
    use crate::description::{LayerFilter, RenderSettings};
    use crate::film::{FirstHit, PixelSample, Seen, Tile};
    use glam::{Vec2, Vec3};

    fn seen(depth: f32) -> Seen {
        let first_hit = FirstHit {
            albedo: Rgb::new(depth, 0.0, 0.0),
            normal: Vec3::Y,
            depth,
            position: glam::DVec3::new(0.0, f64::from(depth), 0.0),
            object_id: 9,
        };
        Seen { first_hit: Some(first_hit), motion: Vec2::new(1.0, -depth) }
    }

    /// Two pixels: the left one is met by two samples of three, the right one by none.
    fn film() -> Film {
        let mut film = Film::new((2, 1), &Layer::ALL).expect("small");
        let mut buffer = film.tile_buffer(Tile { x0: 0, y0: 0, x1: 2, y1: 1 });
        let sky = Seen { first_hit: None, motion: Vec2::new(1.0, 0.0) };
        let sample =
            |radiance, seen| PixelSample { radiance, seen: Some(seen), ..PixelSample::default() };
        for seen in [seen(1.0), sky, seen(2.0)] {
            let radiance = Rgb::splat(seen.first_hit.map_or(0.0, |h| h.depth));
            buffer.add(0, 0, &sample(radiance, seen));
        }
        buffer.add(1, 0, &sample(Rgb::ONE, sky));
        film.merge(buffer);
        film
    }

    fn f32s(film: &Film, layer: Layer, channel: usize) -> Vec<f32> {
        match &film.image(layer).expect("collected")[channel].samples {
            PlaneSamples::F32(values) => values.clone(),
            PlaneSamples::U32(_) => panic!("{layer:?} holds integers"),
        }
    }

    /// Worked by hand: radiances 1, 0, 2 have the mean 1 and M₂ = 2, so the mean's variance is 2/6.
    #[test]
    fn every_layer_has_the_value_worked_by_hand() {
        let film = film();
        assert_eq!(f32s(&film, Layer::Beauty, 0), [1.0, 1.0]);
        assert_eq!(f32s(&film, Layer::Variance, 2), [1.0 / 3.0, f32::INFINITY]);
        assert_eq!(f32s(&film, Layer::Depth, 0), [1.5, f32::INFINITY]);
        assert_eq!(f32s(&film, Layer::Albedo, 0), [1.5, 0.0]);
        assert_eq!(f32s(&film, Layer::Normal, 1), [1.0, 0.0]);
        assert_eq!(f32s(&film, Layer::Position, 1), [1.5, 0.0]);
        assert_eq!(f32s(&film, Layer::Motion, 0), [1.0, 1.0], "the sky moves as well");
        assert_eq!(f32s(&film, Layer::Motion, 1), [-1.0, 0.0]);
        assert_eq!(film.image(Layer::Motion).expect("collected").len(), 2);
        let integers = |layer| film.image(layer).expect("collected")[0].samples.clone();
        assert_eq!(integers(Layer::ObjectId), PlaneSamples::U32(vec![9, 0]));
        assert_eq!(integers(Layer::Samples), PlaneSamples::U32(vec![3, 1]));
    }

    /// Of geometry the centre alone counts, of the albedo the samples.
    #[test]
    fn layers_of_geometry_hold_what_is_at_the_centre() {
        let layers = Layer::ALL.to_vec();
        let settings = RenderSettings { size: (1, 1), layers, ..RenderSettings::default() };
        assert_eq!(settings.layer_filter, LayerFilter::Center, "the default");
        let mut film = Film::for_settings(&settings).expect("small");
        assert!(film.wants_centres() && film.wants_seen());
        let tile = Tile { x0: 0, y0: 0, x1: 1, y1: 1 };
        let mut buffer = film.tile_buffer(tile);
        buffer.add_centre(0, 0, &seen(4.0));
        film.merge(buffer);
        let mut buffer = film.tile_buffer(tile);
        for depth in [1.0, 2.0] {
            let seen = Some(seen(depth));
            let radiance = Rgb::ONE;
            buffer.add(0, 0, &PixelSample { radiance, seen, ..PixelSample::default() });
        }
        film.merge(buffer);
        assert_eq!(f32s(&film, Layer::Depth, 0), [4.0]);
        assert_eq!(f32s(&film, Layer::Position, 1), [4.0]);
        assert_eq!(f32s(&film, Layer::Motion, 1), [-4.0]);
        assert_eq!(f32s(&film, Layer::Albedo, 0), [1.5]);
    }

    #[test]
    fn a_layer_that_was_not_asked_for_is_none() {
        let film = Film::new((1, 1), &[Layer::Beauty]).expect("small");
        assert!(film.image(Layer::Depth).is_none());
        assert!(film.image(Layer::Samples).is_some());
    }

    #[test]
    fn the_brightest_radiance_stays_finite() {
        let mut film = Film::new((1, 1), &[Layer::Variance]).expect("small");
        let mut buffer = film.tile_buffer(Tile { x0: 0, y0: 0, x1: 1, y1: 1 });
        for value in [f32::MAX, f32::MAX, 0.0] {
            let radiance = Rgb::splat(value);
            buffer.add(0, 0, &PixelSample { radiance, ..PixelSample::default() });
        }
        film.merge(buffer);
        assert!(f32s(&film, Layer::Beauty, 0)[0].is_finite());
        assert_eq!(f32s(&film, Layer::Variance, 0), [f32::MAX]);
    }
}
