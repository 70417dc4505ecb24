//! Lights: which there are, choosing one, drawing a direction towards it, and drawing a photon which
//! leaves it.

mod aim;
mod bounds;
mod choice;
mod emission;
mod node;
mod pivot;
mod shapes;
mod sky;
mod split;
mod table;
mod towards;
mod tree;

pub use aim::{Aim, BoundingSphere};
pub use emission::{EmittedPhoton, Endless, PhotonNumbers, PhotonSource, rebuild_photon_source};
pub use pivot::Pivot;
pub use shapes::{ShapeLights, prepare_shape_lights};
pub use sky::SkyLight;
pub use table::{Emitted, Emitter, LightTable, rebuild_light_table};
pub use towards::{LightSample, Lights, Receiver, ShadowEnd, shadow_ray};
