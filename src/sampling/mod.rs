//! Random and low-discrepancy streams, warps of the unit square, tabulated distributions, MIS
//! weights.

mod distribution;
mod equiangular;
mod mis;
mod sobol;
mod stream;
pub mod warp;

pub use distribution::{Piecewise1D, Piecewise2D};
pub use equiangular::Equiangular;
pub use mis::power_heuristic;
pub use sobol::{Sampler, dimension};
pub use stream::Stream;
