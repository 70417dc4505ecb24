//! Frames, bounds, rounding bounds and rigid motion: geometry that knows nothing of light.

mod bounds;
mod cone;
mod frame;
mod motion;
mod ray;

mod rounding;
mod swept;

pub use bounds::Aabb;
pub use cone::Cone;
pub use frame::Frame;
pub use motion::{Decomposed, MotionTransform};
pub use ray::Ray;

pub use rounding::{gamma, gamma_f64, offset_ray_origin};
pub use swept::swept_bounds;
