//! `manifest.json`: what was rendered, how, and what it took.
//!
//! One object: the run at the top, then `frames`, sorted by number. It is written anew, atomically, after
//! every frame, so that it is right at any moment. A run which goes on with earlier frames keeps
//! their entries; entries whose fingerprint no longer fits are dropped, for they describe
//! pictures of another scene.

use super::{Fingerprint, FrameFiles};
use super::{JobFingerprint, MANIFEST_NAME, OutputError, SOFTWARE, write_atomically};
use crate::description::{Clock, Layer, RenderSettings, SceneDescription};
use crate::extract::object_ids;
use crate::frame::FrameReport;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The run as a whole.
#[derive(Clone, Debug, Serialize)]
pub struct RunFacts {
    /// Name and version of the software.
    pub software: String,
    /// The scene file, its includes and assets, in the order of reading; U+FFFD stands for what is not Unicode.
    pub scene_files: Vec<String>,
    /// XXH3-128 over those files, 32 hexadecimal digits.
    pub scene_hash: String,
    /// The camera entity.
    pub camera: String,
    /// Frame rate and shutter.
    pub clock: Clock,
    /// The settings in effect, the command line's included.
    pub settings: RenderSettings,
    /// What `--set` changed.
    pub overrides: Vec<String>,
    /// Threads that rendered.
    pub threads: usize,
    /// The names of all objects by their numbers in the layer `ObjectId`; empty without that layer.
    pub objects: BTreeMap<u32, String>,
}

impl RunFacts {
    /// Describes a run of this scene, with every setting applied.
    pub fn new(scene: &SceneDescription, overrides: &[String], threads: usize) -> Self {
        Self {
            software: SOFTWARE.to_owned(),
            scene_files: scene.files.iter().map(|path| path.display().to_string()).collect(),
            scene_hash: format!("{:032x}", scene.content_hash),
            camera: scene.camera.clone(),
            clock: scene.clock,
            settings: scene.render.clone(),
            overrides: overrides.to_vec(),
            threads,
            objects: objects(scene),
        }
    }
}

/// The names of all objects by number, where they are asked for.
fn objects(scene: &SceneDescription) -> BTreeMap<u32, String> {
    if !scene.render.layers.contains(&Layer::ObjectId) {
        return BTreeMap::new();
    }
    let shapes = scene.entities.iter().filter(|(_, entity)| entity.shape.is_some());
    let mut names: Vec<&str> = shapes.map(|(name, _)| name.as_str()).collect();
    names.sort_unstable();
    object_ids(names.iter().copied()).zip(names.iter().map(|name| (*name).to_owned())).collect()
}

/// What the manifest says of one frame.
#[derive(Clone, Debug, Serialize)]
pub struct FrameEntry {
    /// The frame.
    pub frame: i32,
    /// Of everything that decides its pixels.
    pub fingerprint: Fingerprint,
    /// The names of its files, relative to the manifest.
    pub files: Vec<String>,
    /// From the start of the frame until its files were on disk, in seconds.
    pub wall_seconds: f64,
    /// Spent on developing the picture and writing its files, in seconds.
    pub write_seconds: f64,
    /// The most memory that the program had used by then, in bytes.
    pub peak_memory_bytes: Option<u64>,
    /// Numbers of the beauty which exceeded 16 bits and were written as 65504.
    pub saturated: u64,
    /// What the renderer reports.
    pub report: FrameReport,
}

impl FrameEntry {
    /// The names of a frame's files without their folder.
    pub fn file_names(files: &FrameFiles) -> Vec<String> {
        [&files.exr, &files.png]
            .into_iter()
            .filter_map(|path| Some(path.file_name()?.to_string_lossy().into_owned()))
            .collect()
    }
}

/// The record of the run in an output folder.
#[derive(Debug)]
pub struct Manifest {
    path: PathBuf,
    run: RunFacts,
    frames: BTreeMap<i32, Value>,
}

impl Manifest {
    /// Starts the record of a run in `folder`, with the entries of earlier runs that still hold: those
    /// whose fingerprint is the one that `job` gives their frame.
    ///
    /// A record that cannot be read is started anew; the pictures themselves say what is done.
    pub fn open(folder: &Path, run: RunFacts, job: &JobFingerprint) -> Self {
        let path = folder.join(MANIFEST_NAME);
        let earlier: Option<Value> =
            std::fs::read(&path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
        let entries = earlier.as_ref().and_then(|record| record.get("frames")?.as_array());
        let frames = entries
            .into_iter()
            .flatten()
            .filter_map(|entry| {
                let frame = i32::try_from(entry.get("frame")?.as_i64()?).ok()?;
                let fingerprint = entry.get("fingerprint")?.as_str()?;
                (fingerprint == job.of_frame(frame).to_string()).then(|| (frame, entry.clone()))
            })
            .collect();
        Self { path, run, frames }
    }

    /// Adds a frame, in the place of an earlier entry for it, and writes the record.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn record(&mut self, entry: &FrameEntry) -> Result<(), OutputError> {
        let value = serde_json::to_value(entry).map_err(|source| OutputError::Json { source })?;
        self.frames.insert(entry.frame, value);
        self.save()
    }

    /// Writes the record as it is.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn save(&self) -> Result<(), OutputError> {
        #[derive(Serialize)]
        struct Record<'a> {
            #[serde(flatten)]
            run: &'a RunFacts,
            frames: Vec<&'a Value>,
        }
        let record = Record { run: &self.run, frames: self.frames.values().collect() };
        let mut bytes =
            serde_json::to_vec_pretty(&record).map_err(|source| OutputError::Json { source })?;
        bytes.push(b'\n');
        write_atomically(&self.path, &bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(frame: i32, job: &JobFingerprint) -> FrameEntry {
        let files = FrameFiles::new(Path::new("out"), "a", frame);
        FrameEntry {
            frame,
            fingerprint: job.of_frame(frame),
            files: FrameEntry::file_names(&files),
            wall_seconds: 1.5,
            write_seconds: 0.1,
            peak_memory_bytes: None,
            saturated: 0,
            report: FrameReport { frame, integrator: "Path".into(), ..Default::default() },
        }
    }

    fn frames_of(folder: &Path) -> Vec<u64> {
        let bytes = std::fs::read(folder.join(MANIFEST_NAME)).expect("was written");
        let record: Value = serde_json::from_slice(&bytes).expect("is JSON");
        assert_eq!(record["settings"]["samples"], 64);
        let frames = record["frames"].as_array().expect("a list");
        frames.iter().map(|f| f["report"]["frame"].as_u64().expect("a number")).collect()
    }

    #[test]
    fn a_later_run_keeps_the_entries_that_still_hold() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let mut scene = SceneDescription::default();
        let job = JobFingerprint::new(&scene);
        let facts = RunFacts::new(&scene, &[], 2);
        let mut first = Manifest::open(folder.path(), facts.clone(), &job);
        first.record(&entry(10, &job)).expect("writable");
        first.record(&entry(2, &job)).expect("writable");
        assert_eq!(frames_of(folder.path()), [2, 10]);

        let mut second = Manifest::open(folder.path(), facts.clone(), &job);
        second.record(&entry(3, &job)).expect("writable");
        assert_eq!(frames_of(folder.path()), [2, 3, 10]);

        scene.content_hash = 99;
        let other = JobFingerprint::new(&scene);
        let mut third = Manifest::open(folder.path(), facts, &other);
        third.record(&entry(1, &other)).expect("writable");
        assert_eq!(frames_of(folder.path()), [1]);
    }

    #[test]
    fn a_broken_record_is_started_anew() {
        let folder = tempfile::tempdir().expect("temporary folder");
        std::fs::write(folder.path().join(MANIFEST_NAME), b"{ \"frames\": [ {").expect("writable");
        let scene = SceneDescription::default();
        let job = JobFingerprint::new(&scene);
        let mut manifest = Manifest::open(folder.path(), RunFacts::new(&scene, &[], 1), &job);
        manifest.record(&entry(0, &job)).expect("writable");
        assert_eq!(frames_of(folder.path()), [0]);
    }
}
