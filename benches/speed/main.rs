//! How fast the renderer is, in one table: rays, surfaces of revolution, builds, samples, what filtered textures are worth, frames, and how they grow.
//!
//! `cargo bench --bench speed` runs everything but the convergence; after `--`:
//!
//! ```text
//! --quick         smaller meshes, fewer repetitions
//! --json FILE     the same numbers by the same names
//! --only A,B      of rays, revolution, build, shapes, motion, samples, textures, frame, growth, absent
//! --before FILE   the program of an earlier commit, to which `absent` compares
//! --convergence   CPU-seconds of whole renders to a relMSE of 1e-3 (fog: 0.1, 0.05), and their memory
//! ```
//!
//! Speeds are per CPU-second, which a busy machine disturbs less; what is compared runs in turn, and
//! medians are given. Ratios repeat to a few percent, absolute numbers less well.

mod absent;
mod builds;
mod clock;
mod convergence;
mod frames;
mod growth;
mod motion;
mod rays;
mod report;
mod revolution;
mod samples;
mod shapes;
mod textures;

#[path = "../common/mod.rs"]
mod common;
#[expect(dead_code, reason = "shared with tests, which need more of it")]
#[path = "../../src/build/bvh/wide/meshes.rs"]
mod meshes;

use kinora::description::TriangleMesh;
use meshes::RawMesh;
use report::Report;
use std::path::PathBuf;
use std::process::ExitCode;

/// What was asked for.
#[derive(Default)]
pub struct Options {
    quick: bool,
    json: Option<PathBuf>,
    only: Option<Vec<String>>,
    convergence: bool,
    before: Option<PathBuf>,
}

impl Options {
    fn parse(words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self::default();
        let mut words = words;
        while let Some(word) = words.next() {
            let mut value = || words.next().ok_or(format!("{word} needs a value"));
            match word.as_str() {
                "--quick" => options.quick = true,
                "--convergence" => options.convergence = true,
                "--before" => options.before = Some(value()?.into()),
                "--json" => options.json = Some(value()?.into()),
                "--only" => options.only = Some(value()?.split(',').map(str::to_owned).collect()),
                // Cargo says that this is a bench.
                "--bench" => {}
                _ => return Err(format!("unknown option {word}")),
            }
        }
        Ok(options)
    }

    fn wants(&self, section: &str) -> bool {
        match &self.only {
            Some(only) => only.iter().any(|word| word == section),
            None => !self.convergence,
        }
    }
}

fn mesh_of(raw: RawMesh) -> TriangleMesh {
    TriangleMesh { positions: raw.positions, triangles: raw.triangles, ..Default::default() }
}

fn main() -> ExitCode {
    let options = match Options::parse(std::env::args().skip(1)) {
        Ok(options) => options,
        Err(message) => {
            eprintln!("{message}");
            return ExitCode::from(2);
        }
    };
    let mut report = Report::default();
    let sections: [(&str, fn(&Options, &mut Report)); 10] = [
        ("rays", rays::run),
        ("revolution", revolution::run),
        ("build", builds::run),
        ("shapes", shapes::run),
        ("motion", motion::run),
        ("samples", samples::run),
        ("textures", textures::run),
        ("frame", frames::run),
        ("growth", growth::run),
        ("absent", absent::run),
    ];
    for (name, run) in sections {
        if options.wants(name) {
            run(&options, &mut report);
        }
    }
    if options.convergence {
        convergence::run(&options, &mut report);
    }
    if let Some(path) = &options.json
        && let Err(error) = report.write(path)
    {
        eprintln!("{}: {error}", path.display());
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
