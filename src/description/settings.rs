//! The clock and the settings of a render.

use super::{Caustics, PhotonSettings, TextureFiltering};
use serde::{Deserialize, Serialize};

/// The frames of a scene and when they are taken.
///
/// Frame `n` opens at `t = n / fps` seconds; the shutter is an interval from there, in fractions of
/// a frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Clock {
    /// Frames per second.
    pub fps: f64,
    /// First and last frame, both included; frames before time 0 have negative numbers.
    pub frames: (i32, i32),
    /// When the shutter opens and closes, in fractions of a frame after the frame's time; 0.5 is
    /// film's 180°.
    pub shutter: (f64, f64),
}

impl Default for Clock {
    fn default() -> Self {
        Self { fps: 24.0, frames: (0, 0), shutter: (0.0, 0.5) }
    }
}

/// Everything that trades accuracy for speed, and the shape of the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RenderSettings {
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// The part of the picture that is rendered: left, top, width and height in pixels. `None` is all of it.
    pub region: Option<(u32, u32, u32, u32)>,
    /// What the camera sees behind everything.
    pub background: Background,
    /// Samples per pixel. Trades noise for time: the error falls with the square root.
    pub samples: u32,
    /// Greatest number of surface interactions of a path. Trades the light of longer paths (bias)
    /// for time; 1 is direct light alone.
    pub max_depth: u32,
    /// Interactions before Russian roulette may end a path. Trades variance for time; no bias.
    pub roulette_depth: u32,
    /// What the throughput of a path is multiplied by to be its probability to survive Russian
    /// roulette. Trades variance for time; no bias.
    pub roulette_gain: f32,
    /// Reflections in a row inside of a solid, about interpolated or bumped normals, after which light leaves
    /// it straight on. Trades the length of light guides against paths caught in closed orbits.
    pub inner_reflections: u32,
    /// Side, in pixels, of the groups of pixels whose paths use each other's continuations; 1 for none.
    /// Trades the independence of the noise of neighbouring pixels, and shadow rays, for less of it; no
    /// bias.
    pub share: u32,
    /// Whether paths carry wavelengths also where no spectrum asks for them.
    pub spectral: bool,
    /// How light is simulated.
    pub integrator: IntegratorChoice,
    /// Where caustics come from with the integrator `Path`.
    pub caustics: Caustics,
    /// How photons are traced and gathered.
    pub photons: PhotonSettings,
    /// Rays which gather indirect light at the first diffuse surface, with the integrator
    /// `PhotonMap`; 0 reads it from the photons there. Trades time for blotches (bias).
    pub final_gather: u32,
    /// Seed of every random decision.
    pub seed: u64,
    /// The pixel filter.
    pub filter: Filter,
    /// Upper limit of the radiance that one sample may bring after its first bounce, per channel.
    /// Trades energy (bias) for fewer bright specks; off by default.
    pub clamp_indirect: Option<f32>,
    /// How far interpolated motion may stray from the true motion, as a fraction of the distance
    /// that the object moves during the shutter. Trades the shape of curved blur for motion keys.
    pub motion_tolerance: f64,
    /// How much work goes into the trees of meshes. Trades time and memory before the first ray for
    /// the time of every ray; the picture is the same.
    pub bvh: BvhQuality,
    /// The longest edge of a displaced mesh that is divided adaptively, in pixels. Trades the form of the relief for
    /// time and memory.
    pub dicing: f64,
    /// Mebibytes that such a mesh may take, without its tree; one that would take more is an error.
    pub dicing_memory: u32,
    /// What is done about textures which are finer than what a sample stands for. Trades sharpness at a slant and
    /// time for noise.
    pub texture_filter: TextureFiltering,
    /// Where light ends on meshes with smooth normals. Trades shadows of what is nearer to a coarse mesh than its
    /// triangles are to the round form they stand for, for an edge of light without steps.
    pub terminator: Terminator,
    /// Exposure in stops: the picture is multiplied by `2^exposure` before the tone curve.
    pub exposure: f32,
    /// The tone curve of the PNG; the EXR stays linear.
    pub tonemap: ToneMap,
    /// What the EXR holds.
    pub layers: Vec<Layer>,
    /// Of which part of a pixel its layers of geometry tell.
    pub layer_filter: LayerFilter,
    /// Bits per channel of the beauty layers in the EXR: 16 or 32.
    pub exr_bits: u32,
    /// How the EXR holds its layers.
    pub exr_layout: ExrLayout,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            size: (640, 480),
            region: None,
            background: Background::default(),
            samples: 64,
            max_depth: 1000,
            roulette_depth: 2,
            roulette_gain: 2.5,
            inner_reflections: 100,
            share: 4,
            spectral: false,
            integrator: IntegratorChoice::Auto,
            caustics: Caustics::default(),
            photons: PhotonSettings::default(),
            final_gather: 0,
            seed: 0,
            filter: Filter::default(),
            clamp_indirect: None,
            motion_tolerance: 0.001,
            bvh: BvhQuality::default(),
            dicing: 1.0,
            dicing_memory: 1024,
            texture_filter: TextureFiltering::default(),
            terminator: Terminator::default(),
            exposure: 0.0,
            tonemap: ToneMap::Srgb,
            layers: vec![Layer::Beauty],
            layer_filter: LayerFilter::default(),
            exr_bits: 32,
            exr_layout: ExrLayout::default(),
        }
    }
}

/// How the linear picture becomes the PNG: all that may change without rendering anything again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Development {
    /// In stops.
    pub exposure: f32,
    /// The tone curve.
    pub tonemap: ToneMap,
}

impl RenderSettings {
    /// What of the settings concerns the PNG alone.
    pub fn development(&self) -> Development {
        Development { exposure: self.exposure, tonemap: self.tonemap }
    }

    /// The settings as far as they decide what is rendered: the same for every development.
    #[must_use]
    pub fn without_development(&self) -> Self {
        let Development { exposure, tonemap } = Development::default();
        Self { exposure, tonemap, ..self.clone() }
    }
}

/// Where light ends on meshes with smooth normals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Terminator {
    /// Where the smooth normals turn away from it: what is reflected leaves from the round surface that they mean.
    #[default]
    Smooth,
    /// Where the triangles turn away from it, or shadow each other.
    Faceted,
}

/// The integrators by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum IntegratorChoice {
    /// Picks by what the scene requires, and says why.
    #[default]
    Auto,
    /// Unidirectional path tracing.
    Path,
    /// Photon mapping in two passes: photons, then the picture.
    PhotonMap,
    /// Stochastic progressive photon mapping.
    Sppm,
}

/// How the trees of meshes are built.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum BvhQuality {
    /// Soon done: for previews and for meshes that change in every frame.
    Fast,
    /// Large triangles are cut into parts.
    #[default]
    Balanced,
    /// In addition parts of the tree are moved to better places: for long renders.
    Best,
}

impl BvhQuality {
    /// Every quality once, from the fastest build to the fastest rays.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Balanced, Self::Best];
}

/// Pixel filters, in pixels; sampled by importance, so that each sample has weight 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Filter {
    /// Constant over a square of side `2·radius`.
    Box {
        /// Half the side.
        #[serde(default = "box_radius")]
        radius: f32,
    },
    /// A Gaussian, cut off at `radius`, per axis.
    Gaussian {
        /// Standard deviation.
        #[serde(default = "gaussian_sigma")]
        sigma: f32,
        /// Where it ends.
        #[serde(default = "gaussian_radius")]
        radius: f32,
    },
    /// The four-term Blackman–Harris window over `[−radius, radius]`, per axis.
    BlackmanHarris {
        /// Where it ends.
        #[serde(default = "gaussian_radius")]
        radius: f32,
    },
}

impl Default for Filter {
    fn default() -> Self {
        Self::Gaussian { sigma: gaussian_sigma(), radius: gaussian_radius() }
    }
}

/// What the camera's own rays see where they leave the scene without having met anything.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Background {
    /// Skies and the disks of suns.
    #[default]
    Sky,
    /// Nothing: skies and suns light the scene, are mirrored and refracted, and the picture has an alpha channel.
    Transparent,
}

/// How the EXR holds several layers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum ExrLayout {
    /// One part for each layer, by its name.
    #[default]
    Parts,
    /// All in one part, the channels of all but the beauty as `albedo.R`: for programs that read the first part alone.
    Single,
}

/// Tone curves of the PNG.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum ToneMap {
    /// No curve but sRGB's own; values above 1 are clipped.
    #[default]
    Srgb,
    /// Troy Sobotka's `AgX`: bright colours fade to white gently.
    Agx,
    /// The fit of the ACES film curve by Narkowicz 2015.
    Aces,
    /// Reinhard et al. 2002 on luminance.
    Reinhard,
}

/// Layers of the EXR.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Layer {
    /// Linear radiance.
    Beauty,
    /// Reflectance at the first surface.
    Albedo,
    /// Shading normal at the first surface, world space.
    Normal,
    /// Distance along the camera's axis to the first surface, metres.
    Depth,
    /// Position of the first surface, metres, world space.
    Position,
    /// Motion on the film of the first surface, or of the sky, from the opening of the shutter to its closing, pixels: x to the
    /// right, y down.
    Motion,
    /// Number of the object at the first surface, which follows from its name; 0 is none.
    ObjectId,
    /// Number of samples.
    Samples,
    /// Variance of the pixel's mean per channel.
    Variance,
}

impl Layer {
    /// Every layer once.
    pub const ALL: [Self; 9] = [
        Self::Beauty,
        Self::Albedo,
        Self::Normal,
        Self::Depth,
        Self::Position,
        Self::Motion,
        Self::ObjectId,
        Self::Samples,
        Self::Variance,
    ];

    /// Whether it tells of the geometry that is seen first, as [`LayerFilter`] says.
    pub fn is_geometry(self) -> bool {
        matches!(self, Self::Normal | Self::Depth | Self::Position | Self::Motion | Self::ObjectId)
    }
}

/// Of which part of a pixel its layers of geometry tell: normal, depth, position, motion and object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum LayerFilter {
    /// Its centre, seen through the middle of the lens when the shutter opens: one place of one object, which is there. No
    /// noise.
    #[default]
    Center,
    /// The mean over its samples, as the beauty: smooth edges, for denoisers; but a mean depth at an edge is one that
    /// nothing has.
    Mean,
}

fn box_radius() -> f32 {
    0.5
}
fn gaussian_sigma() -> f32 {
    0.5
}
fn gaussian_radius() -> f32 {
    1.5
}
