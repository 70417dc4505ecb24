//! EXR files: one part per layer, or one for all, and the facts of the run in every header.
//!
//! The display window is the picture, the data window what was rendered of it.
//!
//! The custom facts are **one** text attribute `kinora` holding a JSON object. The encoder keeps custom
//! attributes in a hash map with a random order; with a single entry equal frames are equal files,
//! byte for byte. Standard attributes carry what they can: `software`, `chromaticities`, `framesPerSecond`, and of the
//! camera, as it is when the shutter opens: `worldToCamera`, `worldToNDC`, `screenWindowWidth`, `expTime`, `focus`
//! and `aperture`. Text is UTF-8, as OpenEXR has it since its version 2.0.

use super::picture::to_half;
use super::seal::{BLANK, seal};
use super::{Fingerprint, OutputError, SOFTWARE, write_atomically};
use crate::color::CHROMATICITIES;
use crate::description::{ExrLayout, Layer, RenderSettings, SceneDescription};
use crate::extract::CameraFacts;
use crate::film::{Film, Plane, PlaneSamples, Tile};
use crate::frame::{FrameReport, RenderedFrame};
use crate::world::{FrameClock, Settings};
use bevy_ecs::world::World;
use exr::error::Error as ExrError;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, LineOrder, Text};
use exr::meta::header::{ImageAttributes, LayerAttributes};
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layers, Vec2,
    WritableImage, f16,
};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::path::Path;

/// The name of the attribute with our facts.
const ATTRIBUTE: &str = "kinora";

/// What a file tells about its frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameMetadata {
    /// Of everything that decides the pixels.
    pub fingerprint: Fingerprint,
    /// The frame.
    pub frame: i32,
    /// When its shutter opens, in seconds.
    pub time: f64,
    /// Frames per second.
    pub fps: f64,
    /// When the shutter opens and closes, in fractions of a frame after the frame's time.
    pub shutter: (f64, f64),
    /// Seed of every random decision, as text: JSON readers round large integers.
    pub seed: String,
    /// Samples per pixel.
    pub samples: u32,
    /// The camera entity.
    pub camera: String,
    /// The integrator that ran.
    pub integrator: String,
    /// Name and version of the software.
    pub software: String,
    /// Units of the layers.
    pub units: String,
    /// The camera when the shutter opens and when it closes.
    pub view: CameraFacts,
    /// The names of the objects by their numbers; in a file, in the part `object_id` alone and of what is seen.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub objects: BTreeMap<u32, String>,
}

impl FrameMetadata {
    /// What [`FrameMetadata::units`] says.
    pub const UNITS: &str = "radiance W/(m^2 sr); depth, position m; motion px from shutter opening to closing, x right, y down; \
        linear BT.709 primaries, D65";

    /// Gathers the facts of a frame.
    pub fn new(
        fingerprint: Fingerprint,
        scene: &SceneDescription,
        report: &FrameReport,
        objects: BTreeMap<u32, String>,
    ) -> Self {
        let (clock, frame) = (scene.clock, report.frame);
        Self {
            fingerprint,
            frame,
            time: (f64::from(frame) + clock.shutter.0) / clock.fps,
            fps: clock.fps,
            shutter: clock.shutter,
            seed: scene.render.seed.to_string(),
            samples: scene.render.samples,
            camera: scene.camera.clone(),
            integrator: report.integrator.clone(),
            software: SOFTWARE.to_owned(),
            units: Self::UNITS.to_owned(),
            view: report.camera,
            objects,
        }
    }

    /// Gathers the facts of a frame of a world that no scene file describes: the fingerprint, which
    /// stands for files, is 0, and the camera is nameless.
    pub fn of_world(world: &World, rendered: &RenderedFrame) -> Self {
        let clock = world.get_resource::<FrameClock>().copied().unwrap_or_default().clock;
        let render = world.get_resource::<Settings>().cloned().unwrap_or_default().0;
        let scene = SceneDescription { clock, render, ..Default::default() };
        Self::new(Fingerprint(0), &scene, &rendered.report, rendered.objects.clone())
    }
}

/// Writes the layers which `settings` asks for, the beauty first and always.
///
/// Returns how many numbers lay beyond the range of f16 (±65504) and were written as its end: 0 for
/// 32-bit files. Only the beauty is ever 16 bits; the other layers keep 32.
///
/// # Errors
/// When the file cannot be encoded or written.
pub fn write_exr(
    path: &Path,
    film: &Film,
    settings: &RenderSettings,
    metadata: &FrameMetadata,
) -> Result<u64, OutputError> {
    let mut layers = Layers::<AnyChannels<FlatSamples>>::new();
    let mut saturated = 0;
    let others = settings.layers.iter().copied().filter(|&layer| layer != Layer::Beauty);
    let mut written = Vec::new();
    for layer in [Layer::Beauty].into_iter().chain(others) {
        if written.contains(&layer) {
            continue; // parts of a file must differ in name
        }
        written.push(layer);
        let Some(planes) = film.image(layer) else { continue };
        let halves = layer == Layer::Beauty && settings.exr_bits == 16;
        let has_ids = layer == Layer::ObjectId || settings.exr_layout == ExrLayout::Single;
        let ids = film.image(Layer::ObjectId).filter(|_| has_ids).unwrap_or_default();
        let facts = FrameMetadata { objects: seen(&ids, metadata), ..metadata.clone() };
        let channels = planes.into_iter().map(|plane| channel(plane, halves, &mut saturated));
        match (settings.exr_layout, layers.first_mut()) {
            (ExrLayout::Single, Some(first)) => {
                let mut all = std::mem::take(&mut first.channel_data.list);
                all.extend(channels.map(|channel| in_layer(layer, channel)));
                first.channel_data = AnyChannels::sort(all);
            }
            _ => layers.push(exr::image::Layer::new(
                size_of(film.window()),
                layer_attributes(layer, film, &facts)?,
                encoding(layer),
                AnyChannels::sort(channels.collect()),
            )),
        }
    }
    let mut bytes = Vec::new();
    Image::from_layers(image_attributes(film), layers)
        .write()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(|source| OutputError::Exr { path: path.to_owned(), source })?;
    seal(&mut bytes);
    write_atomically(path, &bytes)?;
    Ok(saturated)
}

/// Reads the facts of a frame from the header of its first part; `None` where the file has none.
///
/// # Errors
/// When the file cannot be opened or is not an EXR file.
pub fn read_metadata(path: &Path) -> Result<Option<FrameMetadata>, ExrError> {
    let headers = MetaData::read_from_file(path, false)?.headers;
    let attribute =
        headers.first().and_then(|header| header.own_attributes.other.get(ATTRIBUTE.as_bytes()));
    Ok(match attribute {
        Some(AttributeValue::Text(text)) => serde_json::from_slice(text.as_slice()).ok(),
        _ => None,
    })
}

/// The names of those objects whose numbers are in the pixels of a layer.
fn seen(planes: &[Plane], metadata: &FrameMetadata) -> BTreeMap<u32, String> {
    let [Plane { name: "id", samples: PlaneSamples::U32(ids) }] = planes else {
        return BTreeMap::new();
    };
    let ids: BTreeSet<u32> = ids.iter().copied().collect();
    let named = |id| Some((id, metadata.objects.get(&id)?.clone()));
    ids.into_iter().filter_map(named).collect()
}

fn size_of(part: Tile) -> Vec2<usize> {
    Vec2(part.size().0 as usize, part.size().1 as usize)
}

/// What the attribute holds: the facts, and in the first part, which is the beauty, the checksum of the file.
#[derive(Serialize)]
struct Facts<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    checksum: Option<&'a str>,
    #[serde(flatten)]
    metadata: &'a FrameMetadata,
}

/// The display window is the whole picture.
fn image_attributes(film: &Film) -> ImageAttributes {
    let whole = size_of(Tile::whole(film.size()));
    let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions(whole));
    let [red, green, blue, white] = CHROMATICITIES.map(|(x, y)| Vec2(x, y));
    attributes.chromaticities = Some(Chromaticities { red, green, blue, white });
    attributes
}

/// The data window begins where the film does.
fn layer_attributes(
    layer: Layer,
    film: &Film,
    metadata: &FrameMetadata,
) -> Result<LayerAttributes, OutputError> {
    let facts = Facts { checksum: (layer == Layer::Beauty).then_some(BLANK), metadata };
    let json = serde_json::to_string(&facts).map_err(|source| OutputError::Json { source })?;
    let mut attributes = LayerAttributes::named(layer_name(layer));
    attributes.layer_position = Vec2(film.window().x0 as i32, film.window().y0 as i32);
    attributes.software_name = Some(text(&metadata.software));
    let camera = &metadata.view.opening;
    attributes.world_to_camera = Some(row_vector_convention(camera.world_to_camera));
    attributes.world_to_normalized_device = Some(row_vector_convention(camera.world_to_ndc()));
    attributes.screen_window_width = camera.screen_window.0 as f32;
    // Not in the standard's list, but what several programs write and read.
    attributes.horizontal_field_of_view = camera.fov_deg.map(|(across, _)| across as f32);
    attributes.vertical_field_of_view = camera.fov_deg.map(|(_, up)| up as f32);
    attributes.focus = camera.focus.map(|metres| metres as f32);
    attributes.aperture = camera.f_number.map(|stops| stops as f32);
    attributes.exposure = Some(((metadata.shutter.1 - metadata.shutter.0) / metadata.fps) as f32);
    attributes.frames_per_second = rational(metadata.fps);
    attributes.other.insert(text(ATTRIBUTE), AttributeValue::Text(text(&json)));
    Ok(attributes)
}

/// Text as UTF-8. The encoder's own conversion takes each letter for a byte and panics beyond Latin-1.
fn text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

/// OpenEXR (Imath) multiplies row vectors from the left and stores rows: that is our column-major order
/// for column vectors, number by number.
fn row_vector_convention(columns: [f64; 16]) -> [f32; 16] {
    columns.map(|value| value as f32)
}

/// Frames per second as a fraction in thousandths, or nothing where that is not exact enough: 23.976
/// becomes 23976/1000.
fn rational(fps: f64) -> Option<(i32, u32)> {
    let thousandths = (fps * 1000.0).round();
    let exact = (1.0..=f64::from(i32::MAX)).contains(&thousandths);
    exact.then_some((thousandths as i32, 1000))
}

fn layer_name(layer: Layer) -> &'static str {
    match layer {
        Layer::Beauty => "beauty",
        Layer::Albedo => "albedo",
        Layer::Normal => "normal",
        Layer::Depth => "depth",
        Layer::Position => "position",
        Layer::Motion => "motion",
        Layer::ObjectId => "object_id",
        Layer::Samples => "samples",
        Layer::Variance => "variance",
    }
}

/// Every compression used here is lossless. Ids and counts run long: run lengths suit them.
fn encoding(layer: Layer) -> Encoding {
    let compression = match layer {
        Layer::ObjectId | Layer::Samples => Compression::RLE,
        _ => Compression::ZIP16,
    };
    Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing }
}

fn channel(plane: Plane, halves: bool, saturated: &mut u64) -> AnyChannel<FlatSamples> {
    let samples = match plane.samples {
        PlaneSamples::U32(values) => FlatSamples::U32(values),
        PlaneSamples::F32(values) if halves => {
            let limit = f16::MAX.to_f32();
            *saturated += values.iter().filter(|value| value.abs() > limit).count() as u64;
            FlatSamples::F16(values.into_iter().map(to_half).collect())
        }
        PlaneSamples::F32(values) => FlatSamples::F32(values),
    };
    AnyChannel::new(plane.name, samples)
}

/// A channel of a layer that shares a part with others, such as `albedo.R` (OpenEXR, "Technical Introduction",
/// section on layers).
fn in_layer(layer: Layer, mut channel: AnyChannel<FlatSamples>) -> AnyChannel<FlatSamples> {
    channel.name = text(&format!("{}.{}", layer_name(layer), channel.name));
    channel
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::description::{Rgb, SceneDescription};
    use crate::extract::CameraState;
    use crate::film::{PixelSample, Tile};
    use crate::output::picture::Picture;
    use exr::prelude::{ReadChannels, ReadLayers, read};
    use glam::{DMat4, DVec3};

    pub fn metadata(fingerprint: u128) -> FrameMetadata {
        let mut scene = SceneDescription { camera: "eye".into(), ..Default::default() };
        scene.render.seed = u64::MAX;
        let mut opening =
            CameraState { screen_window: (3.0, 1.5), focus: Some(4.0), ..CameraState::default() };
        opening.f_number = Some(2.8);
        opening.world_to_camera =
            DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)).to_cols_array();
        let camera = CameraFacts { opening, ..CameraFacts::default() };
        let report =
            FrameReport { frame: 12, integrator: "Path".into(), camera, ..FrameReport::default() };
        FrameMetadata::new(Fingerprint(fingerprint), &scene, &report, BTreeMap::new())
    }

    pub fn film(values: &[f32], layers: &[Layer]) -> Film {
        let mut film = Film::new((values.len() as u32, 1), layers).expect("small");
        let mut buffer = film.tile_buffer(Tile { x0: 0, y0: 0, x1: values.len() as u32, y1: 1 });
        for (x, &value) in values.iter().enumerate() {
            let radiance = Rgb::new(value, 0.5 * value, 0.0);
            let sample = PixelSample { radiance, ..PixelSample::default() };
            buffer.add(x as u32, 0, &sample);
        }
        film.merge(buffer);
        film
    }

    #[test]
    fn what_is_written_is_read_back() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("f.exr");
        let layers = vec![Layer::Samples, Layer::Depth, Layer::Beauty, Layer::Samples];
        let film = film(&[0.0, 0.1, 1e30, 1e-30], &layers);
        let settings = RenderSettings { layers, ..Default::default() };
        assert_eq!(write_exr(&path, &film, &settings, &metadata(7)).expect("writable"), 0);
        assert_eq!(read_metadata(&path).expect("just written"), Some(metadata(7)));

        let back = read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_file(&path)
            .expect("just written");
        let names: Vec<String> = back
            .layer_data
            .iter()
            .map(|l| l.attributes.layer_name.clone().expect("named").to_string())
            .collect();
        assert_eq!(names, ["beauty", "samples", "depth"]);
        let channel = |layer: usize, index: usize| {
            back.layer_data[layer].channel_data.list[index].sample_data.clone()
        };
        assert_eq!(
            channel(0, 2),
            FlatSamples::F32(vec![0.0, 0.1, 1e30, 1e-30]),
            "red is last: B, G, R"
        );
        assert_eq!(channel(1, 0), FlatSamples::U32(vec![1; 4]));
        assert_eq!(channel(2, 0), FlatSamples::F32(vec![f32::INFINITY; 4]));
        let attributes = &back.layer_data[0].attributes;
        assert_eq!(attributes.world_to_camera.expect("set")[12..15], [1.0, 2.0, 3.0]);
        assert_eq!(attributes.frames_per_second, Some((24_000, 1000)));
        assert_eq!(attributes.screen_window_width, 3.0);
        assert_eq!((attributes.focus, attributes.aperture), (Some(4.0), Some(2.8)));
        // Half of a frame of 1/24 s.
        assert_eq!(attributes.exposure, Some(0.5 / 24.0));
        // An orthographic camera, for it has no angle: 2/3 of x = 1, and z is the depth.
        let ndc = attributes.world_to_normalized_device.expect("set");
        assert_eq!((ndc[0], ndc[12], ndc[14]), (2.0 / 3.0, 2.0 / 3.0, -3.0));
        assert!(back.attributes.chromaticities.is_some());
    }

    /// What reads the first part alone finds all layers there, and the beauty under its plain names.
    #[test]
    fn one_part_may_hold_all_layers() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("f.exr");
        let layers = vec![Layer::Albedo, Layer::Depth, Layer::Samples, Layer::Variance];
        let film = film(&[0.25, 0.5], &layers);
        let settings =
            RenderSettings { layers, exr_layout: ExrLayout::Single, ..Default::default() };
        write_exr(&path, &film, &settings, &metadata(7)).expect("writable");
        assert_eq!(read_metadata(&path).expect("just written"), Some(metadata(7)));
        let back = exr::prelude::read_all_flat_layers_from_file(&path).expect("just written");
        assert_eq!(back.layer_data.len(), 1);
        let channels = &back.layer_data[0].channel_data.list;
        let names: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
        let expected = "B G R albedo.B albedo.G albedo.R depth.Z samples.samples variance.B variance.G variance.R";
        assert_eq!(names.join(" "), expected);
        assert_eq!(channels[2].sample_data, FlatSamples::F32(vec![0.25, 0.5]));
        assert_eq!(channels[7].sample_data, FlatSamples::U32(vec![1, 1]));
        assert_eq!(Picture::read(&path).expect("just written"), Picture::of_film(&film, &settings));
    }

    #[test]
    fn names_in_any_script_are_written_and_read_back() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("f.exr");
        let settings = RenderSettings::default();
        let film = film(&[0.5], &settings.layers);
        for name in ["камера", "カメラ", "κάμερα", "żółć", "é\u{301}", "📷", "\0\u{10ffff}\"\\"]
        {
            let metadata = FrameMetadata { camera: name.to_owned(), ..metadata(7) };
            write_exr(&path, &film, &settings, &metadata).expect("writable");
            assert_eq!(read_metadata(&path).expect("just written"), Some(metadata));
        }
    }

    #[test]
    fn halves_saturate_and_say_how_often() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("f.exr");
        let settings = RenderSettings { exr_bits: 16, ..Default::default() };
        let film = film(&[1e30, 65504.0, 100_000.0, 1.0], &settings.layers);
        // Red twice, green (half of it) once.
        assert_eq!(write_exr(&path, &film, &settings, &metadata(7)).expect("writable"), 3);
        let back = exr::prelude::read_all_flat_layers_from_file(&path).expect("just written");
        let FlatSamples::F16(red) = &back.layer_data[0].channel_data.list[2].sample_data else {
            panic!("beauty is not f16")
        };
        assert_eq!(
            red.iter().map(|v| v.to_f32()).collect::<Vec<_>>(),
            [65504.0, 65504.0, 65504.0, 1.0]
        );
    }

    #[test]
    fn equal_frames_are_equal_files() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let settings = RenderSettings::default();
        let film = film(&[0.3, 0.7], &settings.layers);
        let bytes = |name| {
            let path = folder.path().join(name);
            write_exr(&path, &film, &settings, &metadata(7)).expect("writable");
            std::fs::read(path).expect("just written")
        };
        assert_eq!(bytes("a.exr"), bytes("b.exr"));
    }
}
