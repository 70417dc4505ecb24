//! Meshes made from other meshes and from numbers.

mod grid;
mod subdivide;
mod weld;

pub use grid::grid;
pub use subdivide::{Subdivision, subdivided};
pub use weld::{Weld, smooth_normals};
