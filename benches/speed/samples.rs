//! Pixel samples per second of the scenes of the repository, and what a second thread brings.

use crate::Options;
use crate::clock::{median, pool, process_seconds};
use crate::common;
use crate::report::{Report, section};
use kinora::frame::{RenderControl, Simulation};
use std::time::Instant;

/// Renders small pictures of every scene: the other stages are done once, before.
pub fn run(options: &Options, report: &mut Report) {
    let (size, samples, repetitions) =
        if options.quick { ((64, 64), 16, 3) } else { ((128, 128), 32, 5) };
    section("samples: millions of pixel samples per second of one and of two threads");
    let pools = [pool(1), pool(2)];
    let control = RenderControl::default();
    // In frame 12 the ball is in the air and the knife in the middle of the picture.
    for (name, frame) in [("cornell", 0), ("ball", 12), ("moving", 12)] {
        let scene = common::scene(&format!("{name}.ron"), size, samples);
        let mut simulation = Simulation::from_description(&scene);
        simulation.prepare_frame(frame).expect("the scene is valid");
        let mut times = [const { Vec::new() }; 3];
        for _ in 0..repetitions {
            for (k, pool) in pools.iter().enumerate() {
                let start = Instant::now();
                let (cpu, _) = process_seconds(|| {
                    pool.install(|| simulation.render_frame(frame, &control)).expect("as before")
                });
                times[k].push(start.elapsed().as_secs_f64());
                if k == 0 {
                    times[2].push(cpu);
                }
            }
        }
        let [wall_1, wall_2, cpu] = times.map(median);
        let total = f64::from(size.0 * size.1 * samples) * 1e-6;
        report.row(
            &format!("samples.{name}"),
            &[
                ("per_cpu_s", total / cpu, ""),
                ("1_thread", total / wall_1, ""),
                ("2_threads", total / wall_2, ""),
                ("scaling", wall_1 / wall_2, ""),
            ],
        );
    }
}
