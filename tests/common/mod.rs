//! What the tests of whole pictures share: rendering a scene's text, and judging an estimate by its
//! standard error.
#![allow(dead_code, reason = "each test uses a part of it")]

use glam::Vec3;
use kinora::description::{Layer, LoadOptions, SceneDescription, TriangleMesh, parse_scene_str};
use kinora::film::{Film, PlaneSamples};
use kinora::frame::{FrameReport, RenderControl, Simulation};

/// Reads a scene from text, or tells what is wrong with it.
pub fn scene(text: &str) -> SceneDescription {
    let scene = parse_scene_str("test.ron", text, None, &LoadOptions::default());
    scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)))
}

/// A rendered picture.
pub struct Picture {
    pub film: Film,
    pub report: FrameReport,
}

/// Renders a frame of a description with the variance layer added; no sample may be non-finite. Pixels
/// do not share their paths, so that their noise is independent.
pub fn render_description(description: &SceneDescription, frame: i32) -> Picture {
    let mut description = description.clone();
    description.render.share = 1;
    render_as_described(&description, frame)
}

/// Like [`render_description`], with what the description says of sharing.
pub fn render_as_described(description: &SceneDescription, frame: i32) -> Picture {
    let mut description = description.clone();
    if !description.render.layers.contains(&Layer::Variance) {
        description.render.layers.push(Layer::Variance);
    }
    let mut simulation = Simulation::from_description(&description);
    let frame = simulation.render_frame(frame, &RenderControl::default());
    let frame = frame.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(frame.report.non_finite, 0, "samples which are not numbers");
    Picture { film: frame.film, report: frame.report }
}

/// Renders the first frame of a scene's text.
pub fn render(text: &str, size: (u32, u32), samples: u32) -> Picture {
    let mut description = scene(text);
    (description.render.size, description.render.samples) = (size, samples);
    render_description(&description, description.clock.frames.0)
}

/// A mean with its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub mean: f64,
    pub error: f64,
}

impl Estimate {
    /// Tests the hypothesis that the estimate's expectation is `expected`.
    ///
    /// It is rejected beyond 3 standard errors (level 0.0027 for each test; the seeds are fixed). The
    /// error comes from the variance between samples, which for stratified samples is greater than
    /// the true one: the level is smaller than said. So that the test means something, the standard
    /// error must be below `precision` of the expected value. `f32` is granted 4e-6.
    #[track_caller]
    pub fn assert_agrees(self, what: &str, expected: f64, precision: f64) {
        let Self { mean, error } = self;
        let difference = mean - expected;
        assert!(
            difference.abs() <= 3.0 * error + 4e-6 * expected.abs(),
            "{what}: {mean:.7} instead of {expected:.7}, off by {:.2} standard errors of {error:e} ({:+.4} %)",
            difference / error,
            100.0 * difference / expected,
        );
        assert!(
            error <= precision * expected.abs(),
            "{what}: standard error {error:e} of {expected}, more than {precision:e} of it"
        );
    }
}

/// Mean over the pictures of six seeds, green, and its standard error. Where pixels share photons, only pictures tell how far
/// their means are off.
pub fn mean_of_seeds(text: &str, size: (u32, u32), samples: u32) -> Estimate {
    let mut described = scene(text);
    (described.render.size, described.render.samples) = (size, samples);
    let means: Vec<f64> = (0..6)
        .map(|seed| {
            described.render.seed = seed;
            render_description(&described, 0).mean().mean
        })
        .collect();
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n - 1.0);
    Estimate { mean, error: (variance / n).sqrt() }
}

impl Picture {
    /// Radiance of a pixel.
    pub fn at(&self, x: u32, y: u32) -> Vec3 {
        self.film.radiance(x, y)
    }

    /// Green of every pixel, row by row from the top.
    pub fn green(&self) -> Vec<f64> {
        let (width, height) = self.film.size();
        (0..height)
            .flat_map(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| f64::from(self.at(x, y).y))
            .collect()
    }

    /// Variance of every pixel's mean, green.
    pub fn variance(&self) -> Vec<f64> {
        let planes = self.film.image(Layer::Variance).expect("the layer is always asked for");
        let PlaneSamples::F32(green) = &planes[1].samples else { panic!("variances are numbers") };
        green.iter().map(|&v| f64::from(v)).collect()
    }

    /// The mean of each channel over all pixels.
    pub fn mean_of_channels(&self) -> [f64; 3] {
        let (width, height) = self.film.size();
        let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let sum: glam::DVec3 = all.map(|(x, y)| self.at(x, y).as_dvec3()).sum();
        (sum / f64::from(width * height)).to_array()
    }

    /// The mean over all pixels, green; pixels have independent seeds.
    pub fn mean(&self) -> Estimate {
        self.mean_where(|_, _| true)
    }

    /// The mean over the chosen pixels, green.
    pub fn mean_where(&self, chosen: impl Fn(u32, u32) -> bool) -> Estimate {
        let width = self.film.size().0;
        let (values, variances) = (self.green(), self.variance());
        let (mut sum, mut variance, mut count) = (0.0, 0.0, 0.0);
        for (k, (value, v)) in values.iter().zip(&variances).enumerate() {
            if chosen(k as u32 % width, k as u32 / width) {
                sum += value;
                variance += v;
                count += 1.0;
            }
        }
        Estimate { mean: sum / count, error: variance.sqrt() / count }
    }

    /// Whether two pictures are equal bit by bit, in every layer that both have.
    pub fn same_bits(&self, other: &Self) -> bool {
        Layer::ALL.into_iter().all(|layer| {
            match (self.film.image(layer), other.film.image(layer)) {
                (Some(a), Some(b)) => {
                    a.iter().zip(&b).all(|(a, b)| match (&a.samples, &b.samples) {
                        (PlaneSamples::F32(a), PlaneSamples::F32(b)) => {
                            a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
                        }
                        (a, b) => a == b,
                    })
                }
                (a, b) => a.is_none() && b.is_none(),
            }
        })
    }
}

/// A sphere of radius 1 of `20·4^levels` triangles with the exact normals at its vertices, facing
/// outwards.
pub fn icosphere(levels: u32, smooth: bool) -> TriangleMesh {
    let golden = 0.5 * (1.0 + 5.0_f32.sqrt());
    let mut positions: Vec<Vec3> = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        positions.extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)]);
    }
    for p in &mut positions {
        *p = p.normalize();
    }
    // The faces are the triples at the shortest distance from each other.
    let near = |a: usize, b: usize| (positions[a] - positions[b]).length() < 1.1;
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let n = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
                    let outward = n.dot(positions[a]) > 0.0;
                    let [a, b, c] = [a as u32, b as u32, c as u32];
                    triangles.push(if outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    assert_eq!(triangles.len(), 20);
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let normals = if smooth { positions.clone() } else { Vec::new() };
    TriangleMesh { positions, normals, triangles, ..Default::default() }
}

/// A mesh as a scene says it, under the name `name`.
pub fn mesh_text(name: &str, mesh: &TriangleMesh) -> String {
    let vectors = |list: &[Vec3]| {
        list.iter()
            .map(|p| format!("({:?}, {:?}, {:?})", p.x, p.y, p.z))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let triangles: Vec<String> =
        mesh.triangles.iter().map(|[a, b, c]| format!("({a}, {b}, {c})")).collect();
    format!(
        r#""{name}": Triangles(positions: [{}], triangles: [{}], normals: [{}])"#,
        vectors(&mesh.positions),
        triangles.join(", "),
        vectors(&mesh.normals),
    )
}
