//! The stages of one frame, in order.

use crate::film::Film;
use bevy_ecs::prelude::*;
use serde::Serialize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64};

/// The stages of one frame, in order. A stage reads only what earlier stages wrote.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameSystems {
    /// Where everything is over the shutter.
    Step,
    /// What changed is copied into flat arrays.
    Extract,
    /// Acceleration structures and light tables over those arrays.
    Build,
    /// Light is simulated.
    Integrate,
}

/// How a caller watches and stops a render. Cheap to clone; every clone is the same control.
#[derive(Clone, Debug, Default, Resource)]
pub struct RenderControl {
    /// Set to true to stop: the frame being rendered is given up at the next tile.
    pub cancel: Arc<AtomicBool>,
    /// Pixel samples finished in the current frame.
    pub samples_done: Arc<AtomicU64>,
    /// Pixel samples of the current frame in all.
    pub samples_total: Arc<AtomicU64>,
    /// Rays traced in the current frame.
    pub rays: Arc<AtomicU64>,
}

/// What happened in a frame: times, counts, warnings. Goes into the manifest.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FrameReport {
    /// The frame.
    pub frame: u32,
    /// Seconds spent in each stage, in order: `step`, `extract`, `build`, `integrate`.
    pub stage_seconds: Vec<(&'static str, f64)>,
    /// What was rebuilt, in words: `"instances: 3 of 10"`, `"top level"`, `"mesh rabbit"`.
    pub rebuilt: Vec<String>,
    /// Pixel samples taken.
    pub samples: u64,
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Samples with a NaN or an infinity, dropped and counted.
    pub non_finite: u64,
    /// Paths cut off at `max_depth`.
    pub truncated_paths: u64,
    /// Which integrator ran.
    pub integrator: String,
    /// Things the user should know.
    pub warnings: Vec<String>,
}

/// A rendered frame.
#[derive(Debug)]
pub struct RenderedFrame {
    /// Sums of all samples.
    pub film: Film,
    /// What happened.
    pub report: FrameReport,
    /// World to camera at shutter opening, column-major, for the EXR header.
    pub world_to_camera: glam::DMat4,
}
