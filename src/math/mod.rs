//! Frames, bounds, rounding bounds and rigid motion: geometry that knows nothing of light.

mod bernstein;
mod bounds;
mod cubic;
mod frame;
mod motion;
pub mod profile;
mod ray;

mod rounding;

pub use bounds::Aabb;
pub use cubic::{Cubic, clamped_knots, spline};
pub use frame::Frame;
pub use motion::{Decomposed, MotionTransform};
pub use profile::{Jet, Piece, Profile, ProfileError, bracketed_root};
pub use ray::Ray;

pub use rounding::{gamma, gamma_f64, offset_ray_origin};
