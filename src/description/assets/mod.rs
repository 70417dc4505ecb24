//! Image and mesh files to plain data.

use super::{Encoding, ImageData, TriangleMesh};
use std::path::Path;

/// Why an asset file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum AssetError {
    /// Not a format that is read.
    #[error("this kind of file is not supported")]
    Unsupported,
}

/// Reads an image.
///
/// # Errors
/// Always.
pub fn load_image(_path: &Path, _encoding: Encoding) -> Result<ImageData, AssetError> {
    Err(AssetError::Unsupported)
}

/// Reads a mesh.
///
/// # Errors
/// Always.
pub fn load_mesh(_path: &Path) -> Result<TriangleMesh, AssetError> {
    Err(AssetError::Unsupported)
}
