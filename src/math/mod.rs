//! Frames, bounds, rounding bounds and rigid motion: geometry that knows nothing of light.

mod bernstein;
mod bounds;
mod chart;
mod cone;
mod cubic;
mod frame;
mod graph;
pub(crate) mod instructions;
mod motion;
pub(crate) mod profile;
mod ray;
mod rounding;
mod swept;
mod time_curve;
mod twofold;

pub use bounds::Aabb;
pub use chart::{Chart, Edge};
pub use cone::Cone;
pub use cubic::{Control, Cubic, bezier_of_spline, clamped_knots, spline};
pub use frame::Frame;
pub use graph::{GraphFault, MAX_PARTS_DEPTH, parts_first};
pub use motion::{Decomposed, MotionTransform, curve_slopes, place_between};
pub(crate) use profile::bracketed_root;
pub use profile::{Jet, Piece, Profile, ProfileError};
pub use ray::Ray;
pub use rounding::{gamma, gamma_f64, offset_ray_origin};
pub use swept::swept_bounds;
pub use time_curve::TimeCurve;
pub(crate) use twofold::TwofoldVec3;
