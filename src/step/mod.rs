//! Advances time: where everything is over the shutter.
//!
//! Nothing is stepped from one frame to the next. The *pose systems* say where things are at the
//! instant of [`SceneTime`], in closed form; [`sample_shutter`] runs them at several instants of the
//! frame's shutter and keeps as many poses of each entity as its motion needs. Any frame can
//! therefore be evaluated alone, and a system added by a program gets motion blur without doing
//! anything for it.

mod deform;
mod hierarchy;
mod pose;
mod shutter;
mod track;
mod views;
mod waves;

pub use deform::deform_meshes;
pub use hierarchy::propagate_poses;
pub use pose::{PoseInput, evaluate_fov_at, local_pose, pose_moving_entities};
pub(crate) use shutter::ROUNDING;
pub use shutter::sample_shutter;
pub use views::survey_views;

use bevy_ecs::prelude::*;
use bevy_ecs::schedule::{LogLevel, ScheduleBuildSettings, ScheduleLabel, SingleThreadedExecutor};

use crate::frame::{FrameSystems, StageClock, stamp};
use crate::world::SceneTime;

/// The schedule of the pose systems; it runs once for every sample of the shutter.
#[derive(ScheduleLabel, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Pose;

/// The order of the pose systems.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PoseSystems {
    /// Systems of the program: write [`Transform`](crate::world::Transform) and other inputs as a
    /// function of [`SceneTime`].
    Custom,
    /// Velocities, accelerations, keyframes and aims make the pose in the parent's frame.
    Animate,
    /// Parents carry their children.
    Propagate,
}

/// Adds the pose schedule and the resources of this stage to the world, and its system to `frame`.
pub(crate) fn install(world: &mut World, frame: &mut Schedule) {
    world.insert_resource(SceneTime::default());
    world.init_resource::<StageClock>();
    let mut poses = Schedule::new(Pose);
    poses.set_executor(SingleThreadedExecutor::new());
    let ambiguity_detection = LogLevel::Error;
    poses.set_build_settings(ScheduleBuildSettings { ambiguity_detection, ..Default::default() });
    poses.configure_sets(
        (PoseSystems::Custom, PoseSystems::Animate, PoseSystems::Propagate).chain(),
    );
    poses.add_systems((
        pose_moving_entities.in_set(PoseSystems::Animate),
        propagate_poses.in_set(PoseSystems::Propagate),
    ));
    world.add_schedule(poses);
    let systems =
        (survey_views, sample_shutter, stamp("poses"), deform_meshes, stamp("deformation"));
    frame.add_systems(systems.chain().in_set(FrameSystems::Step));
}
