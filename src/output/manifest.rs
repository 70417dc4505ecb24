//! `manifest.json`: what was rendered, how, and what it took.
//!
//! One object: the run at the top, then `frames`, one on each line. It is right after every frame, and sorted by number
//! when nobody is at work in the folder, see [`Record`]. A run which goes on with earlier frames keeps
//! their entries; entries whose fingerprint no longer fits are dropped, for they describe
//! pictures of another scene.

use super::atomic::remove_abandoned;
use super::claim::FolderClaim;
use super::record::{Places, Record, to_json};
use super::{Fingerprint, FrameFiles, JobFingerprint, MANIFEST_NAME, OutputError, SOFTWARE};
use crate::description::{Clock, Layer, RenderSettings, SceneDescription};
use crate::extract::object_ids;
use crate::frame::FrameReport;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use xxhash_rust::xxh3::xxh3_128;

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

    /// What runs that may share a folder agree in: the job, and how its pictures are developed and stored.
    fn id(&self, job: &JobFingerprint) -> Result<Fingerprint, OutputError> {
        let settings = to_json(&self.settings)?;
        Ok(Fingerprint(xxh3_128(&[job.of_frame(0).to_string().as_bytes(), &settings].concat())))
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

/// The record of the run in an output folder, and this process's claim on that folder.
#[derive(Debug)]
pub struct Manifest {
    record: Record,
    claim: FolderClaim,
    /// Where the entries of earlier runs stand.
    earlier: Places,
}

impl Manifest {
    /// Starts the record of a run in `folder`, with the entries of earlier runs that still hold: those
    /// whose fingerprint is the one that `job` gives their frame. Temporary files of runs that were killed go.
    ///
    /// Runs of one job may share a folder, each with other frames; the first of them starts the record. Of a record that
    /// breaks off, what stands before that is kept; the pictures themselves say what is done.
    ///
    /// # Errors
    /// When a run of another job is at work in the folder, or when the record cannot be written.
    pub fn open(folder: &Path, run: RunFacts, job: &JobFingerprint) -> Result<Self, OutputError> {
        remove_abandoned(folder);
        let scene = run.scene_files.first().map_or("a scene", String::as_str);
        let by = format!("`{scene}` (process {})", std::process::id());
        let id = run.id(job)?;
        let record = Record::new(folder.join(MANIFEST_NAME), &run, job)?;
        let mut earlier = Places::new();
        let renew = || record.renew().map(|places| earlier = places);
        let claim = FolderClaim::new(folder, id, &by, renew)?;
        Ok(Self { record, claim, earlier })
    }

    /// Adds a frame, in the place of an earlier entry for it.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn record(&mut self, entry: &FrameEntry) -> Result<(), OutputError> {
        let text = to_json(entry)?;
        if !self.record.append(&text)? {
            self.earlier = self.record.renew()?; // somebody has removed or changed the file
            self.record.append(&text)?;
        }
        match self.earlier.remove(&entry.frame) {
            Some(place) => self.record.blank(entry.frame, place),
            None => Ok(()),
        }
    }
}

impl Drop for Manifest {
    /// Puts the entries in order, if nobody else is at work in the folder.
    fn drop(&mut self) {
        // Where that fails, every frame is in the record all the same.
        self.claim.leave(|| drop(self.record.renew()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;
    use std::fs;

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
        let bytes = fs::read(folder.join(MANIFEST_NAME)).expect("was written");
        let record: Value = serde_json::from_slice(&bytes).expect("is JSON");
        assert_eq!(record["settings"]["samples"], 64);
        let frames = record["frames"].as_array().expect("a list");
        frames.iter().map(|f| f["report"]["frame"].as_u64().expect("a number")).collect()
    }

    /// A run of a scene with this content, which records `frames`.
    fn record(folder: &Path, content: u128, frames: &[i32]) -> Manifest {
        let scene = SceneDescription { content_hash: content, ..Default::default() };
        let job = JobFingerprint::new(&scene);
        let facts = RunFacts::new(&scene, &[], 2);
        let mut manifest = Manifest::open(folder, facts, &job).expect("writable");
        for &frame in frames {
            manifest.record(&entry(frame, &job)).expect("writable");
        }
        manifest
    }

    #[test]
    fn a_later_run_keeps_the_entries_that_still_hold() {
        let folder = tempfile::tempdir().expect("temporary folder");
        drop(record(folder.path(), 1, &[10, 2]));
        assert_eq!(frames_of(folder.path()), [2, 10]);
        drop(record(folder.path(), 1, &[3]));
        assert_eq!(frames_of(folder.path()), [2, 3, 10]);
        drop(record(folder.path(), 99, &[1]));
        assert_eq!(frames_of(folder.path()), [1]);
    }

    #[test]
    fn a_frame_rendered_again_replaces_its_entry_at_once() {
        let folder = tempfile::tempdir().expect("temporary folder");
        drop(record(folder.path(), 1, &[0, 1, 2]));
        let run = record(folder.path(), 1, &[1, 2, 7]);
        assert_eq!(frames_of(folder.path()), [0, 1, 2, 7]);
        drop(run);
        assert_eq!(frames_of(folder.path()), [0, 1, 2, 7]);
        let only = record(folder.path(), 1, &[0, 1, 2, 7]);
        assert_eq!(frames_of(folder.path()), [0, 1, 2, 7]);
        drop(only);
    }

    #[test]
    fn runs_of_one_job_share_a_folder_and_those_of_another_wait() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let first = record(folder.path(), 1, &[0, 2]);
        let second = record(folder.path(), 1, &[1, 3]);
        let scene = SceneDescription::default();
        let other = |scene: &SceneDescription| {
            Manifest::open(folder.path(), RunFacts::new(scene, &[], 2), &JobFingerprint::new(scene))
        };
        assert!(matches!(other(&scene), Err(OutputError::InUse { .. })));
        drop(first);
        assert!(matches!(other(&scene), Err(OutputError::InUse { .. })));
        assert_eq!(frames_of(folder.path()), [0, 2, 1, 3]);
        drop(second);
        assert_eq!(frames_of(folder.path()), [0, 1, 2, 3]);
        other(&scene).expect("nobody is at work any more");
        let names =
            fs::read_dir(folder.path()).expect("exists").map(|e| e.expect("name").file_name());
        assert_eq!(names.collect::<Vec<_>>(), [MANIFEST_NAME], "and nothing else remains");
    }

    #[test]
    fn a_record_that_breaks_off_is_kept_up_to_there() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join(MANIFEST_NAME);
        for broken in [&b"{ \"frames\": [ {"[..], b"", b"5", b"[1, 2", b"{\"frames\": 7}", b"\xff"]
        {
            fs::write(&path, broken).expect("writable");
            drop(record(folder.path(), 1, &[0]));
            assert_eq!(frames_of(folder.path()), [0]);
        }
        drop(record(folder.path(), 1, &[1, 2]));
        let whole = fs::read(&path).expect("was written");
        fs::write(&path, &whole[..whole.len() - 60]).expect("writable");
        drop(record(folder.path(), 1, &[5]));
        assert_eq!(frames_of(folder.path()), [0, 1, 5]);
    }
}
