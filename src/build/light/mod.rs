//! Lights: which there are, choosing one, drawing a direction towards it, and drawing a photon which
//! leaves it.

mod aim;
mod choice;
mod emission;
mod sky;
mod table;
mod towards;
mod tree;

pub use aim::{Aim, BoundingSphere};
pub use emission::{EmittedPhoton, PhotonNumbers, PhotonSource, rebuild_photon_source};
pub use sky::SkyLight;
pub use table::{Emitted, Emitter, LightTable, rebuild_light_table};
pub use towards::{LightSample, Lights, Receiver, ShadowEnd};
