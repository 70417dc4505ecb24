//! The resources that every stage reads.

use crate::description::{Clock, RenderSettings};
use bevy_ecs::prelude::*;

/// The clock and the frame which is being made.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameClock {
    /// Frames, rate and shutter.
    pub clock: Clock,
    /// The frame being made.
    pub frame: u32,
}

impl FrameClock {
    /// Opening and closing of the shutter, in seconds.
    pub fn shutter(&self) -> (f64, f64) {
        let (open, close) = self.clock.shutter;
        let frame = f64::from(self.frame);
        ((frame + open) / self.clock.fps, (frame + close) / self.clock.fps)
    }
}

/// The instant for which the pose systems are asked where things are.
///
/// Within one frame they run several times, once per shutter sample, not in order: a system which
/// moves things must be a pure function of this time and of what does not change.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct SceneTime {
    /// Seconds; frame 0 opens at 0.
    pub seconds: f64,
}

/// The settings of the render.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub struct Settings(pub RenderSettings);
