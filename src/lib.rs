//! Kinora renders animated scenes by simulating light.

pub mod build;
pub mod color;
pub mod description;
pub mod extract;
pub mod film;
pub mod frame;
pub mod integrate;
pub mod math;
pub mod output;
pub mod sampling;
pub mod shade;
pub mod shape;
pub mod step;
pub mod world;
