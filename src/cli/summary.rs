//! What a run came to, told at its end.

use super::format;
use kinora::integrate::PhotonReport;
use kinora::output::{FrameEntry, MANIFEST_NAME, peak_memory_bytes};
use serde_json::{Value, json};
use std::path::Path;
use std::time::{Duration, Instant};

/// Sums over the frames of a run.
pub struct Summary {
    start: Instant,
    /// Seconds by stage, in the order of the stages.
    stages: Vec<(&'static str, f64)>,
    samples: u64,
    rays: u64,
    /// Samples which were not finite, and numbers too large for 16 bits.
    non_finite: u64,
    saturated: u64,
    /// Most bytes of images in a frame.
    texture_bytes: u64,
    /// The integrators that ran and why, each with the first frame of which this is told.
    integrators: Vec<(i32, String)>,
    /// What the photons of all frames came to.
    photons: Option<PhotonReport>,
    /// Frames rendered by this run, and frames found finished.
    pub rendered: usize,
    pub kept: usize,
    /// Kept frames whose PNG was developed again.
    developed: usize,
}

impl Summary {
    pub fn new(kept: usize, developed: usize) -> Self {
        Self {
            start: Instant::now(),
            stages: Vec::new(),
            samples: 0,
            rays: 0,
            non_finite: 0,
            saturated: 0,
            texture_bytes: 0,
            integrators: Vec::new(),
            photons: None,
            rendered: 0,
            kept,
            developed,
        }
    }

    pub fn add(&mut self, entry: &FrameEntry) {
        self.rendered += 1;
        self.samples += entry.report.samples;
        self.rays += entry.report.rays;
        self.non_finite += entry.report.non_finite;
        self.saturated += entry.saturated;
        let integrator = &entry.report.integrator;
        if !self.integrators.iter().any(|(_, known)| name_of(known) == name_of(integrator)) {
            self.integrators.push((entry.frame, integrator.clone()));
        }
        let textures = entry.report.table_bytes.iter().find(|(name, _)| *name == "textures");
        self.texture_bytes = self.texture_bytes.max(textures.map_or(0, |(_, bytes)| *bytes));
        if let Some(photons) = &entry.report.photons {
            self.photons = Some(self.photons.take().map_or(*photons, |sum| sum.plus(photons)));
        }
        let in_stages: f64 = entry.report.stage_seconds.iter().map(|(_, seconds)| seconds).sum();
        let files = ("develop and write", (entry.wall_seconds - in_stages).max(0.0));
        for &(stage, seconds) in entry.report.stage_seconds.iter().chain([&files]) {
            match self.stages.iter_mut().find(|(name, _)| *name == stage) {
                Some((_, sum)) => *sum += seconds,
                None => self.stages.push((stage, seconds)),
            }
        }
    }

    /// What went wrong in some frames, told once for all of them; the manifest has it by frame.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.non_finite > 0 {
            warnings.push(format!(
                "{} of {} samples were not finite numbers and were left out: {MANIFEST_NAME} tells \
                 in which frames",
                self.non_finite, self.samples
            ));
        }
        if self.saturated > 0 {
            warnings.push(format!(
                "{} numbers were too large for 16 bits and were written as 65504; \
                 `--set render.exr_bits=32` keeps them",
                self.saturated
            ));
        }
        warnings
    }

    pub fn for_people(&self, folder: &Path) -> String {
        if self.rendered == 0 {
            let frames = format::plural(self.kept, "frame");
            let developed = match self.developed {
                0 => String::new(),
                count => format!(", {} developed again", format::plural(count, "PNG")),
            };
            return format!("nothing to render: {frames} in {}{developed}", folder.display());
        }
        let seconds = self.start.elapsed();
        let frames = format::plural(self.rendered, "frame");
        let mut lines = vec![match self.kept {
            0 => format!("{frames} rendered in {}", format::duration(seconds)),
            kept => format!("{frames} rendered in {}, {kept} kept", format::duration(seconds)),
        }];
        let stage = |&(name, s): &(&str, f64)| {
            format!("{name} {}", format::duration(Duration::from_secs_f64(s)))
        };
        let stages: Vec<_> = self.stages.iter().map(stage).collect();
        lines.push(format!("  time     {}", stages.join(", ")));
        lines.push(format!("  integrator {}", self.integrators()));
        lines.push(format!("  samples  {}", format::count(self.samples as f64)));
        lines.push(format!(
            "  rays     {} ({} rays/s)",
            format::count(self.rays as f64),
            format::count(self.rays as f64 / seconds.as_secs_f64().max(f64::MIN_POSITIVE))
        ));
        if let Some(photons) = &self.photons {
            lines.push(format!("  photons  {}", photon_line(photons)));
        }
        if self.texture_bytes > 0 {
            let bytes = format::bytes(self.texture_bytes);
            lines.push(format!("  textures {bytes} of images and their smaller copies"));
        }
        if let Some(bytes) = peak_memory_bytes() {
            lines.push(format!("  memory   {} at most", format::bytes(bytes)));
        }
        lines.push(format!("  files    {} (record: {MANIFEST_NAME})", folder.display()));
        lines.join("\n")
    }

    /// What lighted the frames; where it changed, from which frame on.
    fn integrators(&self) -> String {
        match self.integrators.as_slice() {
            [(_, only)] => only.clone(),
            several => {
                let each =
                    several.iter().map(|(frame, text)| format!("{text} (from frame {frame})"));
                each.collect::<Vec<_>>().join("; ")
            }
        }
    }

    pub fn for_programs(&self, outcome: &str, folder: &Path) -> Value {
        let stages: serde_json::Map<_, _> =
            self.stages.iter().map(|&(name, seconds)| (name.to_owned(), seconds.into())).collect();
        json!({
            "outcome": outcome, "rendered": self.rendered, "kept": self.kept, "developed": self.developed,
            "seconds": self.start.elapsed().as_secs_f64(), "stage_seconds": stages,
            "integrators": self.integrators.iter().map(|(_, text)| text).collect::<Vec<_>>(),
            "samples": self.samples, "rays": self.rays, "photons": self.photons, "texture_bytes": self.texture_bytes,
            "peak_memory_bytes": peak_memory_bytes(), "out": folder.display().to_string(),
        })
    }
}

/// Of an integrator with its reason the name alone: the reason has numbers in it which change from frame to frame.
fn name_of(integrator: &str) -> &str {
    integrator.split_once(" (").map_or(integrator, |(name, _)| name)
}

/// Photons of all frames in one line.
fn photon_line(photons: &PhotonReport) -> String {
    let PhotonReport { emitted, stored, global, caustics, radii, memory_bytes, .. } = photons;
    let seconds = |s: f64| format::duration(Duration::from_secs_f64(s));
    format!(
        "{} emitted in {}, {} kept; {} at once in the map, {} caustic, in {} and {}; radii {:.3e} to {:.3e} m",
        format::count(*emitted as f64),
        seconds(photons.trace_seconds),
        format::count(*stored as f64),
        format::count(*global as f64),
        format::count(*caustics as f64),
        format::bytes(*memory_bytes),
        seconds(photons.build_seconds),
        radii.0,
        radii.1
    )
}
