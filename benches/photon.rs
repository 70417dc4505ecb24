//! Photons: emitted per second, building and asking the map, whole pictures to a given error.
//!
//! `cargo bench --bench photon` measures with criterion; the figures of whole pictures (seconds of CPU to an error
//! against a reference, share of the map) are printed after that, by `figures`.

mod common;

use common::{Uniforms, clustered, scattered};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use kinora::build::photon::{Photon, PhotonMap, PhotonStore, QueryPoint};
use kinora::description::{LoadOptions, SceneDescription, parse_scene_str};
use kinora::frame::{FrameReport, RenderControl, Simulation};
use std::hint::black_box;

/// A box of 2 m with a glass ball, a mirror ball and a small lamp.
const BOX: &str = include_str!("photon_box.ron");

/// A sorted grid of cells hashed into a table, the alternative to the tree: photons in the order of their
/// cell, eight cells for each disk. For one radius alone; the tree serves all.
struct HashGrid {
    starts: Vec<u32>,
    photons: Vec<Photon>,
    cell: f32,
}

impl HashGrid {
    fn build(photons: &[Photon], radius: f32) -> Self {
        let size = photons.len().next_power_of_two().max(2);
        let mut grid = Self { starts: vec![0; size + 1], photons: Vec::new(), cell: 2.0 * radius };
        let slots: Vec<u32> = photons.iter().map(|p| grid.slot(grid.cell_of(p.position))).collect();
        for &slot in &slots {
            grid.starts[slot as usize + 1] += 1;
        }
        for k in 0..size {
            grid.starts[k + 1] += grid.starts[k];
        }
        let mut next = grid.starts.clone();
        grid.photons = vec![Photon::default(); photons.len()];
        for (photon, slot) in photons.iter().zip(slots) {
            grid.photons[next[slot as usize] as usize] = *photon;
            next[slot as usize] += 1;
        }
        grid
    }

    fn cell_of(&self, p: Vec3) -> [i32; 3] {
        (p / self.cell).floor().to_array().map(|x| x as i32)
    }

    fn slot(&self, cell: [i32; 3]) -> u32 {
        let hash = (cell[0] as u32).wrapping_mul(0x8da6_b343)
            ^ (cell[1] as u32).wrapping_mul(0xd816_3841)
            ^ (cell[2] as u32).wrapping_mul(0xcb1a_b31f);
        hash & (self.starts.len() as u32 - 2)
    }

    /// Photons of another cell in the same slot are left out by their own cell: none counts twice.
    fn gather(&self, p: Vec3, radius: f32, mut visit: impl FnMut(&Photon, f32)) {
        let (low, high) = (self.cell_of(p - radius), self.cell_of(p + radius));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let slot = self.slot([x, y, z]) as usize;
                    let range = self.starts[slot] as usize..self.starts[slot + 1] as usize;
                    for photon in &self.photons[range] {
                        let d2 = photon.position.distance_squared(p);
                        if d2 <= radius * radius && self.cell_of(photon.position) == [x, y, z] {
                            visit(photon, d2);
                        }
                    }
                }
            }
        }
    }
}

/// Photons on the six sides of a cube, or around a few points of them, as a caustic has them.
fn photons(points: &[Vec3]) -> PhotonStore {
    let mut store = PhotonStore::default();
    for (k, &p) in points.iter().enumerate() {
        let axis = k % 3;
        let side = if p[axis] < 0.0 { -1.0 } else { 1.0 };
        let mut normal = Vec3::ZERO;
        normal[axis] = -side;
        let mut position = p;
        position[axis] = side;
        store.push(Photon::new(position, Vec3::ONE, normal, normal, 1, false));
    }
    store
}

fn map(c: &mut Criterion) {
    const COUNT: usize = 200_000;
    for (name, points) in [("walls", scattered(COUNT)), ("caustic", clustered(COUNT))] {
        let store = photons(&points);
        let list: Vec<Photon> = store.iter().copied().collect();
        // A picture looks where the photons are.
        let queries: Vec<(Vec3, Vec3)> =
            list.iter().step_by(10).map(|p| (p.position, p.normal())).collect();
        let mut group = c.benchmark_group(format!("photon/build/{name}"));
        group.throughput(Throughput::Elements(COUNT as u64));
        group.sample_size(10);
        let mut tree = PhotonMap::default();
        group.bench_function("tree", |b| b.iter(|| tree.rebuild(&store, |_| true)));
        group.bench_function("grid", |b| b.iter(|| HashGrid::build(black_box(&list), 0.02)));
        group.finish();
        let mut group = c.benchmark_group(format!("photon/gather/{name}"));
        group.throughput(Throughput::Elements(queries.len() as u64));
        group.sample_size(10);
        // One radius for the whole picture, and radii over a factor as perspective makes them: a grid has
        // cells for the largest.
        for (radii, spread) in [("one", 1.0), ("eightfold", 8.0), ("hundredfold", 100.0)] {
            let mut uniforms = Uniforms::new(3);
            let sized: Vec<(Vec3, Vec3, f32)> = queries
                .iter()
                .map(|&(p, n)| (p, n, 0.02 / 1.0_f32.max(spread * uniforms.one())))
                .collect();
            group.bench_function(BenchmarkId::new("tree", radii), |b| {
                b.iter(|| {
                    let mut sum = 0.0;
                    for &(position, normal, radius) in &sized {
                        tree.gather(&QueryPoint { position, normal, radius }, |p, _| {
                            sum += p.power.x;
                        });
                    }
                    sum
                });
            });
            let grid = HashGrid::build(&list, 0.02);
            group.bench_function(BenchmarkId::new("grid", radii), |b| {
                b.iter(|| {
                    let mut sum = 0.0;
                    for &(position, normal, radius) in &sized {
                        grid.gather(position, radius, |p, _| {
                            let height = (p.position - position).dot(normal).abs();
                            if height <= 0.1 * radius && p.normal().dot(normal) > 0.9 {
                                sum += p.power.x;
                            }
                        });
                    }
                    sum
                });
            });
        }
        group.finish();
    }
}

fn box_scene(settings: &str, size: (u32, u32), samples: u32) -> SceneDescription {
    let text = BOX.replace("SETTINGS", settings);
    let scene = parse_scene_str("box.ron", &text, None, &LoadOptions::default());
    let mut scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
    (scene.render.size, scene.render.samples) = (size, samples);
    scene
}

/// Seconds of CPU that this program has used.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let ticks: f64 = stat
        .rsplit(')')
        .next()
        .into_iter()
        .flat_map(|fields| fields.split_whitespace().skip(11).take(2))
        .filter_map(|ticks| ticks.parse::<f64>().ok())
        .sum();
    ticks / 100.0
}

struct Shot {
    pixels: Vec<Vec3>,
    seconds: f64,
    report: FrameReport,
}

fn shoot(settings: &str, size: (u32, u32), samples: u32) -> Shot {
    let mut simulation = Simulation::from_description(&box_scene(settings, size, samples));
    let start = cpu_seconds();
    let frame = simulation.render_frame(0, &RenderControl::default()).expect("a sound scene");
    let seconds = cpu_seconds() - start;
    let pixels = (0..size.1)
        .flat_map(|y| (0..size.0).map(move |x| (x, y)))
        .map(|(x, y)| frame.film.radiance(x, y))
        .collect();
    Shot { pixels, seconds, report: frame.report }
}

/// `mean((I − R)²/(R² + 0.01))` over the pixels chosen.
fn rel_mse(image: &[Vec3], reference: &[Vec3], chosen: impl Fn(usize) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (_, (a, r)) in image.iter().zip(reference).enumerate().filter(|(k, _)| chosen(*k)) {
        let error = (*a - *r).as_dvec3();
        let square = r.as_dvec3() * r.as_dvec3() + 0.01;
        sum += (error * error / square).element_sum() / 3.0;
        count += 1.0;
    }
    sum / count
}

/// Whether pixel `k` of a square picture sees neither of the balls: in closed form, from the camera of
/// the scene, with a pixel to spare.
fn sees_no_ball(k: usize, side: u32) -> bool {
    let half = 20.0_f32.to_radians().tan();
    let plane = |x: u32| (2.0 * (x as f32 + 0.5) / side as f32 - 1.0) * half;
    let d = Vec3::new(plane(k as u32 % side), -plane(k as u32 / side), -1.0).normalize();
    let eye = Vec3::new(0.0, 1.0, 3.8);
    [Vec3::new(-0.45, 0.4, -0.4), Vec3::new(0.45, 0.4, 0.3)].iter().all(|centre| {
        let to = *centre - eye;
        (to - d * to.dot(d)).length() > 0.4 + 2.0 * half / side as f32 * to.length()
    })
}

fn figures(_: &mut Criterion) {
    let size = (256, 256);
    // Another method than those measured most: paths for all but the caustics. Its own noise, some
    // 0.002, is part of every figure below.
    let reference =
        shoot("integrator: Path, caustics: Photons, photons: (radius: 2), seed: 9", size, 512);
    println!("reference: {:.1} CPU s", reference.seconds);
    let small = quartered(&reference.pixels, 256);
    for samples in [32, 128, 512] {
        let shot = shoot("integrator: Sppm", (64, 64), samples);
        let (all, most) = luminance_rmse(&shot.pixels, &small);
        println!(
            "64 × 64, Sppm, {samples} passes: {:.2} CPU s, RMSE {:.2} %, of 99 in 100 pixels {:.2} %",
            shot.seconds,
            100.0 * all,
            100.0 * most
        );
    }
    for settings in ["integrator: Sppm", "integrator: Path, caustics: Photons", "integrator: Path"]
    {
        for samples in [4, 8, 16, 32] {
            let shot = shoot(settings, size, samples);
            let all = rel_mse(&shot.pixels, &reference.pixels, |_| true);
            let plain = rel_mse(&shot.pixels, &reference.pixels, |k| sees_no_ball(k, size.0));
            print!(
                "{settings}, {samples} passes: {:.2} CPU s, relMSE {all:.4}, without balls {plain:.4}",
                shot.seconds
            );
            if let Some(photons) = &shot.report.photons {
                let wall = photons.trace_seconds + photons.build_seconds + photons.gather_seconds;
                print!(
                    ", {:.2} M photons, map {:.1} % of the passes, tracing {:.1} %",
                    photons.emitted as f64 * 1e-6,
                    100.0 * photons.build_seconds / wall,
                    100.0 * photons.trace_seconds / wall
                );
            }
            println!();
        }
    }
}

/// The reference for a quarter of the size: the box filter of a large pixel is the mean of 16 small ones.
fn quartered(pixels: &[Vec3], side: usize) -> Vec<Vec3> {
    let small = side / 4;
    let mean = |k: usize| {
        let (x, y) = (k % small * 4, k / small * 4);
        let sum: Vec3 = (0..16).map(|j| pixels[(y + j / 4) * side + x + j % 4]).sum();
        sum / 16.0
    };
    (0..small * small).map(mean).collect()
}

/// Root of the mean squared error of luminance over the mean luminance: over all pixels, and over the 99 of 100
/// whose error is least. The rest are rims of the lamp and its mirror images, hundreds of times as bright as
/// the room, which no photon lights.
fn luminance_rmse(image: &[Vec3], reference: &[Vec3]) -> (f64, f64) {
    let luminance = |v: &Vec3| f64::from(kinora::color::luminance(*v));
    let mut pixels: Vec<(f64, f64)> = image
        .iter()
        .zip(reference)
        .map(|(a, b)| ((luminance(a) - luminance(b)).powi(2), luminance(b)))
        .collect();
    pixels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let over = |pixels: &[(f64, f64)]| {
        let squares: f64 = pixels.iter().map(|p| p.0).sum();
        let sum: f64 = pixels.iter().map(|p| p.1).sum();
        (squares * pixels.len() as f64).sqrt() / sum
    };
    (over(&pixels), over(&pixels[..pixels.len() * 99 / 100]))
}

criterion_group!(benches, map, figures);
criterion_main!(benches);
