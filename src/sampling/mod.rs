//! Random and low-discrepancy streams, warps of the unit square, tabulated distributions, MIS
//! weights.

mod distribution;
mod mis;
mod sobol;
pub mod warp;

pub use distribution::{Piecewise1D, Piecewise2D};
pub use mis::power_heuristic;
pub use sobol::{Sampler, dimension};
