//! RGB working space and tone curves.
