//! Mistakes in scene files and how they are told.

mod numbers;
mod profiles;
mod references;
mod surfaces;
mod words;
