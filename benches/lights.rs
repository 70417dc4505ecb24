//! What the light tree is worth: the error at equal time, beside a choice by power.
//!
//! A hall with 10 to 10,000 lamps of equal power below its ceiling is rendered by both; the error is
//! `relMSE = mean((I − R)² / (R² + 0.01))` over pixels and channels, with `R` made by the tree from many
//! samples of another seed. Time is that of the processor, on one thread. The tree gets as many samples
//! as fit into the time that the choice by power took. Lamps are hidden from the camera: as bright dots
//! smaller than a pixel they would drown the error of what they light, which they do for both.
//!
//! `cargo bench --bench lights` prints a table; `-- --quick` renders fewer samples, `-- --visible` lets the camera
//! see the lamps, and `-- --million` adds what a million lamps take to build, in memory and per sample.

mod common;

use bevy_ecs::prelude::*;
use kinora::build::light::LightTable;
use kinora::film::Film;
use kinora::frame::{RenderControl, Simulation};
use kinora::world::{Emission, HiddenFromCamera, Settings};
use std::time::Instant;

const SIZE: (u32, u32) = (64, 36);

/// One way to choose, in a hall of this many lamps.
struct Hall {
    simulation: Simulation,
}

/// A picture and the processor time it took, in seconds.
struct Rendered {
    film: Film,
    seconds: f64,
}

impl Hall {
    fn new(lamps: usize, by_power: bool, visible: bool) -> Self {
        let mut simulation = common::hall(lamps, SIZE, 1);
        let world = simulation.world_mut();
        let mut emitting = world.query_filtered::<Entity, With<Emission>>();
        let emitting: Vec<Entity> = emitting.iter(world).collect();
        for lamp in emitting.into_iter().filter(|_| !visible) {
            world.entity_mut(lamp).insert(HiddenFromCamera);
        }
        world.resource_mut::<LightTable>().by_power = by_power;
        simulation.prepare_frame(0).expect("the hall has a camera");
        Self { simulation }
    }

    fn render(&mut self, samples: u32, seed: u64) -> Rendered {
        let mut settings = self.simulation.world_mut().resource_mut::<Settings>();
        (settings.0.samples, settings.0.seed) = (samples, seed);
        // What the settings change is prepared outside of the time.
        self.simulation.prepare_frame(0).expect("the hall has a camera");
        let start = processor_seconds();
        let frame = self.simulation.render_frame(0, &RenderControl::default());
        let film = frame.expect("the hall has a camera").film;
        Rendered { film, seconds: processor_seconds() - start }
    }
}

/// Processor time of this thread in seconds; the time of the clock where the system does not tell.
fn processor_seconds() -> f64 {
    use std::sync::OnceLock;
    static START: OnceLock<Instant> = OnceLock::new();
    let clock = START.get_or_init(Instant::now).elapsed().as_secs_f64();
    let line = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = line.and_then(|line| line.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or(clock, |nanoseconds| nanoseconds * 1e-9)
}

fn rel_mse(image: &Film, reference: &Film) -> f64 {
    let mut sum = 0.0;
    for y in 0..SIZE.1 {
        for x in 0..SIZE.0 {
            let (i, r) = (image.radiance(x, y), reference.radiance(x, y));
            for channel in 0..3 {
                let (i, r) = (f64::from(i[channel]), f64::from(r[channel]));
                sum += (i - r).powi(2) / (r * r + 0.01);
            }
        }
    }
    sum / f64::from(3 * SIZE.0 * SIZE.1)
}

/// Mean error and time of several renders with different seeds.
fn measure(hall: &mut Hall, samples: u32, seeds: u64, reference: &Film) -> (f64, f64) {
    let mut total = (0.0, 0.0);
    for seed in 1..=seeds {
        let Rendered { film, seconds } = hall.render(samples, seed);
        total = (total.0 + rel_mse(&film, reference), total.1 + seconds);
    }
    (total.0 / seeds as f64, total.1 / seeds as f64)
}

fn row(lamps: usize, visible: bool, (samples, reference_samples, seeds): (u32, u32, u64)) {
    let mut by_power = Hall::new(lamps, true, visible);
    let mut by_tree = Hall::new(lamps, false, visible);
    let reference = by_tree.render(reference_samples, 1000).film;
    let (_, tree_seconds) = measure(&mut by_tree, samples, seeds, &reference);
    let (power_error, power_seconds) = measure(&mut by_power, samples, seeds, &reference);
    let affordable = f64::from(samples) * power_seconds / tree_seconds;
    let (tree_error, tree_time) =
        measure(&mut by_tree, affordable.round().max(1.0) as u32, seeds, &reference);
    println!(
        "{lamps:>8} {samples:>8} {power_error:>10.4} {power_seconds:>9.3} s {:>8.0} {tree_error:>10.4} {tree_time:>9.3} s {:>8.2}",
        affordable.round(),
        power_error * power_seconds / (tree_error * tree_time),
    );
}

fn million() {
    const LAMPS: usize = 1_000_000;
    let start = Instant::now();
    let mut hall = Hall::new(LAMPS, false, false);
    println!(
        "{LAMPS} lamps: {:.1} s from the world to the first tree",
        start.elapsed().as_secs_f64()
    );
    let frame = hall.simulation.render_frame(0, &RenderControl::default());
    let bytes = frame.expect("the hall has a camera").report.table_bytes;
    println!("bytes: {bytes:?}");
    let Rendered { seconds, .. } = hall.render(16, 1);
    let samples = f64::from(16 * SIZE.0 * SIZE.1);
    println!("{:.2} µs per sample", seconds / samples * 1e6);
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let has = |flag: &str| arguments.iter().any(|argument| argument == flag);
    let effort = if has("--quick") { (16, 512, 1) } else { (16, 4096, 4) };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    pool.install(|| {
        println!("   lamps  samples   by power       time  samples    by tree       time    gain");
        for lamps in [1, 2, 10, 100, 1000, 10_000] {
            row(lamps, has("--visible"), effort);
        }
        if has("--million") {
            million();
        }
    });
}
