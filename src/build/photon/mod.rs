//! Photons: tracing them from the lights, and the map in which they are found again.
//!
//! ```text
//! PhotonSource::emit ──> PhotonTracer ─┬─ deposits at storable surfaces ──> PhotonMap ── disks ──> integrators
//!                                      └─ deposits in media ─────────────> VolumeMap ── rays ───> integrators
//! ```
//!
//! A surface is *storable* if it scatters into so many directions that light found there tells what
//! it looks like: diffuse, or rougher than a setting. All else, mirrors, glass, polished metal, is
//! called specular here: photons and camera paths pass on over it until something storable is met.
//!
//! Jensen 2001, *Realistic Image Synthesis Using Photon Mapping*, chapters 5 to 8.

mod fly;
mod irradiance;
mod kernel;
mod map;
mod record;
mod scattering;
mod trace;
mod tree;
mod volume;

pub use irradiance::{IrradianceMap, KnownIrradiance, PlaceSettings};
pub use map::{PhotonMap, QueryPoint, least_radius};
pub use record::Photon;
pub use trace::{Keep, PhotonCounters, PhotonPass, PhotonStore, PhotonTracer, TextureView};
pub use volume::{VolumeMap, VolumeRadius};
