//! Finished frames to files.
