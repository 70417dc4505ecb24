//! What features cost scenes which do not use them: whole renders by this program and by one of before, in turn.
//!
//! ```text
//! git worktree add ../before COMMIT
//! cargo build --release --manifest-path ../before/Cargo.toml
//! cargo bench --bench speed -- --only absent --before ../before/target/release/kinora
//! ```
//!
//! CPU-seconds of both; the ratio is the median over pairs. Without `--before` this program is compared to itself, which tells
//! how far ratios repeat. Whether both make the same pictures, bit for bit, is told as well.

use crate::Options;
use crate::clock::{children_seconds, median};
use crate::report::{Report, section};
use std::path::Path;
use std::process::Command;

/// Scenes without media, without dispersion, at rest and in motion: name, frame, size and samples.
const SCENES: [(&str, &str, &str, &str); 2] =
    [("cornell", "0", "160x160", "32"), ("ball", "6", "192x108", "64")];

/// Renders a scene; CPU-seconds, and the bytes of the picture.
fn render(
    program: &Path,
    (name, frame, size, samples): (&str, &str, &str, &str),
    out: &Path,
) -> Result<(f64, Vec<u8>), Box<dyn std::error::Error>> {
    let before = children_seconds().ok_or("this system does not tell the time of processes")?;
    let finished = Command::new(program)
        .arg("render")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.ron")))
        .args(["--fresh", "--progress", "none", "--threads", "2", "--frames", frame])
        .args(["--size", size, "--samples", samples, "--out"])
        .arg(out)
        .output()?;
    if !finished.status.success() {
        return Err(String::from_utf8_lossy(&finished.stderr).into());
    }
    let spent = children_seconds().ok_or("no time")? - before;
    let frame: i32 = frame.parse()?;
    Ok((spent, std::fs::read(out.join(format!("{name}.{frame:04}.png")))?))
}

fn compare(options: &Options, report: &mut Report) -> Result<(), Box<dyn std::error::Error>> {
    let own = Path::new(env!("CARGO_BIN_EXE_kinora"));
    let before = options.before.as_deref().unwrap_or(own);
    let folder = tempfile::tempdir()?;
    let pairs = if options.quick { 3 } else { 9 };
    for scene in SCENES {
        // One of each that does not count: files are read from the disk.
        render(before, scene, folder.path())?;
        render(own, scene, folder.path())?;
        let (mut ratios, mut times, mut same) = (Vec::new(), Vec::new(), true);
        for pair in 0..pairs {
            // Neither is always first.
            let first = render(if pair % 2 == 0 { own } else { before }, scene, folder.path())?;
            let second = render(if pair % 2 == 0 { before } else { own }, scene, folder.path())?;
            same &= first.1 == second.1;
            let (now, then) = if pair % 2 == 0 { (first.0, second.0) } else { (second.0, first.0) };
            ratios.push(now / then);
            times.push(now);
        }
        let (same, name) = (f64::from(u8::from(same)), format!("absent.{}", scene.0));
        let values = [("ratio", median(ratios), ""), ("cpu_s", median(times), "")];
        report.row(&name, &[values[0], values[1], ("same_bits", same, "")]);
    }
    Ok(())
}

/// The ratios of time.
pub fn run(options: &Options, report: &mut Report) {
    section("absent: whole renders of scenes without media and dispersion, time by that of before");
    if let Err(error) = compare(options, report) {
        println!("  not measured: {error}");
    }
}
