//! Random and low-discrepancy streams, warps, tabulated distributions, MIS weights.
