//! The resources that every stage reads.

use crate::description::{Clock, RenderSettings};
use bevy_ecs::prelude::*;

/// The clock and the frame which is being made.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameClock {
    /// Frames, rate and shutter.
    pub clock: Clock,
    /// The frame being made.
    pub frame: i32,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_before_time_0_are_the_same_motion_continued() {
        let clock = Clock { fps: 24.0, frames: (-24, 24), shutter: (0.0, 0.5) };
        let shutter = |frame| FrameClock { clock, frame }.shutter();
        assert_eq!(shutter(-12), (-0.5, -11.5 / 24.0));
        assert_eq!(shutter(0), (0.0, 0.5 / 24.0));
    }
}
