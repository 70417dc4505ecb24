//! CPU-seconds and megabytes of the tree of a mesh, by the number of its triangles.

use crate::clock::{median, pool, process_seconds, thread_seconds};
use crate::meshes::RawMesh;
use crate::rays::compressed_tree;
use crate::report::Report;
use crate::{Options, mesh_of};
use kinora::build::bvh::WideTree;
use std::hint::black_box;

/// Builds hills of 10,000 to a million triangles.
pub fn run(options: &Options, report: &mut Report) {
    let repetitions = if options.quick { 1 } else { 3 };
    report.section("build: the tree of a mesh of hills and blobs");
    let sizes = [
        (10_000, RawMesh::terrain(45, 8, 8)),
        (100_000, RawMesh::terrain(141, 81, 8)),
        (1_000_000, RawMesh::terrain(447, 810, 8)),
    ];
    for (count, raw) in sizes {
        let mesh = mesh_of(raw);
        let (one, two) = (pool(1), pool(2));
        let build = || WideTree::build(black_box(&mesh), 0.1);
        let mut times = [const { Vec::new() }; 3];
        for _ in 0..repetitions {
            times[0].push(one.install(|| thread_seconds(build).0));
            times[1].push(process_seconds(|| two.install(build)).0);
            times[2].push(thread_seconds(|| compressed_tree(black_box(&mesh))).0);
        }
        let [cpu, cpu_2, obvhs] = times.map(median);
        let memory = build().memory() as f64 * 1e-6;
        report.row(
            &format!("build.{count}"),
            &[
                ("cpu_s", cpu, ""),
                ("cpu_s_2_threads", cpu_2, ""),
                ("obvhs_cpu_s", obvhs, ""),
                ("mb", memory, ""),
            ],
        );
    }
}
