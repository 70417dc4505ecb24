//! CPU-seconds and megabytes of the tree of a mesh by the number of its triangles, and what the setting
//! `bvh` trades.

use crate::clock::{median, pool, process_seconds, thread_seconds};
use crate::meshes::RawMesh;
use crate::rays::{compressed_tree, rates_by_quality};
use crate::report::{Report, section};
use crate::{Options, mesh_of};
use kinora::build::bvh::WideTree;
use kinora::description::BvhQuality;
use std::hint::black_box;

/// Builds hills of 10,000 to a million triangles.
pub fn run(options: &Options, report: &mut Report) {
    let repetitions = if options.quick { 1 } else { 3 };
    section("build: the tree of a mesh of hills and blobs");
    let sizes = [
        (10_000, RawMesh::terrain(45, 8, 8)),
        (100_000, RawMesh::terrain(141, 81, 8)),
        (1_000_000, RawMesh::terrain(447, 810, 8)),
    ];
    let (one, two) = (pool(1), pool(2));
    for (count, raw) in sizes {
        let mesh = mesh_of(raw);
        let build = |quality| WideTree::build(black_box(&mesh), quality);
        let mut times = [const { Vec::new() }; 5];
        for _ in 0..repetitions {
            for (times, quality) in times.iter_mut().zip(BvhQuality::ALL) {
                times.push(one.install(|| thread_seconds(|| build(quality)).0));
            }
            times[3].push(process_seconds(|| two.install(|| build(BvhQuality::Balanced))).0);
            times[4].push(thread_seconds(|| compressed_tree(black_box(&mesh))).0);
        }
        let [fast, balanced, best, two_threads, obvhs] = times.map(median);
        let mb = |quality| build(quality).memory() as f64 * 1e-6;
        let prefix = format!("build.{count}");
        report.row(
            &prefix,
            &[
                ("cpu_s", balanced, ""),
                ("mb", mb(BvhQuality::Balanced), ""),
                ("cpu_s_2_threads", two_threads, ""),
                ("obvhs_cpu_s", obvhs, ""),
            ],
        );
        for (name, quality, time) in
            [("fast", BvhQuality::Fast, fast), ("best", BvhQuality::Best, best)]
        {
            let values = [("cpu_s", time, ""), ("mb", mb(quality), "")];
            report.row(&format!("{prefix}.{name}"), &values);
        }
    }
    rates_by_quality(options, report);
}
