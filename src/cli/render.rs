//! `kinora render`: the frames of a scene to files.

use super::arguments::RenderArguments;
use super::engine::{self, Engine};
use super::failure::Failure;
use super::format;
use super::frames::FrameList;
use super::interrupt::cancel_on_signal;
use super::progress::Progress;
use super::summary::Summary;
use super::survey::scene_warnings;
use kinora::description::{RenderSettings, SceneDescription};
use kinora::frame::{RenderControl, RenderedFrame};
use kinora::output::{
    FrameEntry, FrameFiles, FrameMetadata, FrameState, JobFingerprint, Manifest, RunFacts,
    SOFTWARE, check_writable, develop_exr, frame_state, peak_memory_bytes, write_exr, write_png,
};
use rayon::prelude::*;
use serde_json::json;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// What is to be rendered and where it goes.
struct Job {
    scene: SceneDescription,
    scene_path: PathBuf,
    /// All frames that were asked for.
    frames: FrameList,
    /// Those of them which are not on disk yet.
    pending: Vec<i32>,
    /// Those of them which are rendered, and whose PNG is missing or developed otherwise.
    undeveloped: Vec<i32>,
    folder: PathBuf,
    /// The stem of the scene file, and so of the pictures.
    name: String,
    fingerprint: JobFingerprint,
    control: RenderControl,
}

pub fn run(arguments: &RenderArguments) -> Result<(), Failure> {
    let control = RenderControl::default();
    cancel_on_signal(&control);
    if let Some(threads) = arguments.threads {
        start_threads(threads)?;
    }
    let mut job = Job::new(arguments, control)?;
    let facts = RunFacts::new(&job.scene, &arguments.scene.overrides, rayon::current_num_threads());
    let mut manifest = Manifest::open(&job.folder, facts, &job.fingerprint)?;
    job.find_pending(arguments.fresh);

    let mut summary = Summary::new(job.kept(), job.undeveloped.len());
    let mut progress = Progress::new(arguments.progress, &job.control, job.pending.len());
    job.control.on_method = progress.method_listener();
    progress.start(&job.opening(), job.opening_facts());
    for warning in scene_warnings(&job.scene, false) {
        progress.warn(&warning);
    }
    let outcome =
        job.develop().and_then(|()| job.render_pending(&mut manifest, &mut progress, &mut summary));
    for warning in summary.warnings() {
        progress.warn(&warning);
    }
    let (text, state) = match &outcome {
        Ok(()) => (summary.for_people(&job.folder), "done"),
        Err(Failure::Interrupted { .. }) => (String::new(), "interrupted"),
        Err(_) => (String::new(), "failed"),
    };
    let told = progress.end(&text, summary.for_programs(state, &job.folder));
    outcome.and(told)
}

fn start_threads(threads: u32) -> Result<(), Failure> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads as usize)
        .build_global()
        .map_err(|error| Failure::Usage(format!("cannot start {threads} threads: {error}")))
}

/// Which part of the picture is rendered, if not all of it.
fn part(render: &RenderSettings) -> String {
    render.region.map_or_else(String::new, |(x, y, width, height)| {
        format!(" (of which {width} × {height} from ({x}, {y}) on)")
    })
}

impl Job {
    fn new(arguments: &RenderArguments, control: RenderControl) -> Result<Self, Failure> {
        let scene = engine::load(&arguments.scene)?;
        let scene_path = arguments.scene.path.clone();
        let stem = match scene_path.file_stem() {
            _ if engine::is_stdin(&scene_path) => OsStr::new("stdin"),
            stem => stem.unwrap_or(scene_path.as_os_str()),
        };
        let name = stem.to_string_lossy().into_owned();
        let folder = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(stem));
        check_writable(&folder)?;

        let frames = match &arguments.frames {
            Some(list) => list.clone(),
            None => FrameList::from_range(scene.clock.frames.0, scene.clock.frames.1).map_err(
                |error| Failure::Usage(format!("the scene's clock: {error}; use --frames")),
            )?,
        };
        let fingerprint = JobFingerprint::new(&scene);
        Ok(Self {
            scene,
            scene_path,
            frames,
            pending: Vec::new(),
            undeveloped: Vec::new(),
            folder,
            name,
            fingerprint,
            control,
        })
    }

    /// Looks which frames are to be rendered, or to be developed at least.
    fn find_pending(&mut self, fresh: bool) {
        let development = self.scene.render.development();
        let state = |&frame: &i32| {
            if fresh {
                return FrameState::Missing;
            }
            let files = FrameFiles::new(&self.folder, &self.name, frame);
            frame_state(&files, self.fingerprint.of_frame(frame), development)
        };
        let states: Vec<FrameState> = self.frames.frames().par_iter().map(state).collect();
        let those = |wanted: FrameState| {
            let all = self.frames.frames().iter().zip(&states);
            all.filter(|&(_, &state)| state == wanted).map(|(&frame, _)| frame).collect()
        };
        (self.pending, self.undeveloped) =
            (those(FrameState::Missing), those(FrameState::Undeveloped));
    }

    /// How many frames were found finished.
    fn kept(&self) -> usize {
        self.frames.frames().len() - self.pending.len()
    }

    fn opening(&self) -> String {
        let render = &self.scene.render;
        let (total, kept) = (self.frames.frames().len(), self.kept());
        let scene = self.scene_path.display();
        let mut text = format!(
            "{SOFTWARE}: {scene}, {} of {} × {} pixels{}, {} per pixel, {}",
            format::plural(total, "frame"),
            render.size.0,
            render.size.1,
            part(render),
            format::plural(render.samples as usize, "sample"),
            format::plural(rayon::current_num_threads(), "thread"),
        );
        if kept > 0 {
            let which = if kept == total { "all".to_owned() } else { format!("{kept} of {total}") };
            text.push('\n');
            text.push_str(&which);
            text.push_str(" are there already and are kept (--fresh renders them again)");
        }
        if !self.undeveloped.is_empty() {
            text.push('\n');
            text.push_str(&format::plural(self.undeveloped.len(), "PNG"));
            text.push_str(" of them developed again from the EXR");
        }
        text
    }

    fn opening_facts(&self) -> serde_json::Value {
        let render = &self.scene.render;
        json!({
            "software": SOFTWARE, "scene": self.scene_path.display().to_string(),
            "out": self.folder.display().to_string(),
            "frames": self.frames.frames().len(), "kept": self.kept(),
            "developed": self.undeveloped.len(), "width": render.size.0, "height": render.size.1, "region": render.region, "samples_per_pixel": render.samples,
            "threads": rayon::current_num_threads(),
        })
    }

    /// Develops what only has another exposure or tone curve, or lost its PNG.
    fn develop(&self) -> Result<(), Failure> {
        self.undeveloped.par_iter().try_for_each(|&frame| {
            let files = FrameFiles::new(&self.folder, &self.name, frame);
            Ok(develop_exr(&files.exr, &files.png, self.scene.render.development())?)
        })
    }

    fn render_pending(
        &self,
        manifest: &mut Manifest,
        progress: &mut Progress,
        summary: &mut Summary,
    ) -> Result<(), Failure> {
        if self.pending.is_empty() {
            return Ok(());
        }
        let mut engine = Engine::new(&self.scene);
        for &frame in &self.pending {
            self.control.samples_done.store(0, Ordering::Relaxed);
            self.control.rays.store(0, Ordering::Relaxed);
            progress.frame_started(frame);
            let start = Instant::now();
            let rendered = if self.control.cancel.load(Ordering::SeqCst) {
                None
            } else {
                engine.render_frame(frame, &self.control)?
            };
            let Some(rendered) = rendered else {
                return Err(Failure::Interrupted {
                    finished: summary.kept + summary.rendered,
                    total: self.frames.frames().len(),
                    folder: self.folder.clone(),
                });
            };
            let entry = self.write(frame, rendered, start)?;
            manifest.record(&entry)?;
            summary.add(&entry);
            for warning in &entry.report.warnings {
                progress.warn(&format::harmless(warning));
            }
            progress.frame_done(&entry);
        }
        Ok(())
    }

    /// Puts a frame on disk, and tells how long it took since `start`.
    fn write(
        &self,
        frame: i32,
        rendered: RenderedFrame,
        start: Instant,
    ) -> Result<FrameEntry, Failure> {
        let RenderedFrame { film, report, objects } = rendered;
        let files = FrameFiles::new(&self.folder, &self.name, frame);
        let settings = &self.scene.render;
        let fingerprint = self.fingerprint.of_frame(frame);
        let metadata = FrameMetadata::new(fingerprint, &self.scene, &report, objects);
        let finished = Instant::now();
        // The larger file first: on a full disk nothing of the frame remains.
        let saturated = write_exr(&files.exr, &film, settings, &metadata)?;
        write_png(&files.png, &film, settings, &metadata)?;
        Ok(FrameEntry {
            frame,
            fingerprint,
            files: FrameEntry::file_names(&files),
            wall_seconds: start.elapsed().as_secs_f64(),
            write_seconds: finished.elapsed().as_secs_f64(),
            peak_memory_bytes: peak_memory_bytes(),
            saturated,
            report,
        })
    }
}
