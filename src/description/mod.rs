//! Scene files to plain, validated data: no ECS, no rendering.

pub mod assets;
mod camera;
mod diagnostic;
mod dispersion;
mod light;
mod material;
pub mod modelling;
mod motion;
mod photons;
mod profile;
mod read;
mod scene;
mod settings;
mod shape;
mod spectrum;
mod texture;
mod value;
mod waves;

pub use camera::{Camera, Focus, SENSOR_HEIGHT};
pub use diagnostic::{Diagnostic, Diagnostics, Place, Severity, SourceText};
pub use dispersion::{D_LINE, Dispersion, DispersionError, IndexCurve, index_at_d};
pub use light::{Emission, EmissionStrength, Light};
pub use material::{Attenuation, Green, Material, Metal, PhaseFunction, Scattering};
pub use motion::{
    Acceleration, Extend, Interpolation, Key, Keyframes, LookAt, Track, Transform, Turn, Velocity,
};
pub use photons::{Caustics, DirectLight, Kernel, PhotonSettings};
pub use profile::{Curve, CurveError};
pub use read::{LoadOptions, load_scene, parse_scene_str, read_scene};
pub use scene::{Displacement, EntityDescription, Relief, SceneDescription};
pub use settings::{
    Background, BvhQuality, Clock, Development, ExrLayout, Filter, IntegratorChoice, Layer,
    LayerFilter, RenderSettings, Terminator, ToneMap,
};
pub use shape::{Shape, TriangleMesh};
pub use spectrum::SpectrumData;
pub use texture::{
    CellFeature, Channel, Encoding, Falloff, GridData, ImageData, ImagePixels, SceneTexture,
    Texture, TextureFilter, TextureFiltering, Wrap,
};
pub use value::{Rgb, Value};
pub use waves::{Wave, Waves};
