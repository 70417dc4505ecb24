//! From a point on a surface to how it scatters light.
