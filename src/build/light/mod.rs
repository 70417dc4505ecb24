//! Lights: which there are, choosing one, and drawing a direction towards it.

mod bounds;
mod choice;
mod node;
mod shapes;
mod sky;
mod split;
mod table;
mod towards;
mod tree;

pub use shapes::{ShapeLights, prepare_shape_lights};
pub use sky::SkyLight;
pub use table::{Emitted, Emitter, LightTable, rebuild_light_table};
pub use towards::{LightSample, Lights, Receiver, ShadowEnd, shadow_ray};
