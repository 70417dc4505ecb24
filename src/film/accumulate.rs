//! The film and the tiles that are merged into it.

use super::{FirstHit, PixelSample, Seen, Tile, moments};
use crate::color::spectrum::WavelengthSet;
use crate::description::{Background, Layer, LayerFilter, RenderSettings, Rgb};
use crate::memory::{Shortage, ask};
use glam::{DVec2, DVec3};

/// Side of a tile in pixels: small enough to balance the load, large enough that its buffer (some
/// 100 kB with every layer) is filled from the cache.
const TILE: u32 = 32;

/// Why a film cannot be made.
#[expect(missing_docs, reason = "each message names its fields")]
#[derive(Debug, thiserror::Error)]
pub enum FilmError {
    #[error("a picture of {width} × {height} pixels: both sides must be at least 1")]
    Empty { width: u32, height: u32 },
    #[error(
        "no memory for a film of {width} × {height} pixels; render it smaller or with fewer layers"
    )]
    Memory { width: u32, height: u32, source: Shortage },
    #[error(
        "no memory for the photons of a pass; set `photons.per_pass` or `photons.max_memory` lower"
    )]
    Photons(#[source] Shortage),
}

/// Sums over all samples of all pixels, row by row from the top left.
#[derive(Clone, Debug)]
pub struct Film {
    /// Of the picture.
    size: (u32, u32),
    /// What of the picture the film holds.
    window: Tile,
    pub(super) layers: Vec<Layer>,
    pub(super) alpha: bool,
    layer_filter: LayerFilter,
    pub(super) sums: Sums,
    non_finite: u64,
}

/// The samples of one tile, on their way to the film.
#[derive(Debug)]
pub struct TileBuffer {
    tile: Tile,
    layer_filter: LayerFilter,
    sums: Sums,
    non_finite: u64,
}

/// Sums over a rectangle of pixels. A vector which no layer asked for is empty.
#[derive(Clone, Debug, Default)]
pub(super) struct Sums {
    /// Samples per pixel, dropped ones not included.
    pub count: Vec<u32>,
    /// Mean radiance.
    pub mean: Vec<DVec3>,
    /// Of the transmittances.
    pub transmittance: Vec<f64>,
    /// Sum of squared deviations from the mean.
    pub m2: Vec<DVec3>,
    /// Samples whose ray met a surface: of those which count for the albedo, and of those for the layers of geometry.
    pub lit_hits: Vec<u32>,
    pub hits: Vec<u32>,
    pub albedo: Vec<DVec3>,
    pub normal: Vec<DVec3>,
    pub depth: Vec<f64>,
    pub position: Vec<DVec3>,
    /// Samples which count for the motion.
    pub followed: Vec<u32>,
    pub motion: Vec<DVec2>,
    pub object: Vec<Vote>,
}

/// A vote which a majority always wins: the id that leads and by how much.
///
/// Boyer and Moore 1991, "MJRTY — A Fast Majority Vote Algorithm". Where no id has more than half
/// of the hits, one of those seen is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Vote {
    pub id: u32,
    lead: u32,
}

impl Vote {
    fn cast(&mut self, other: Self) {
        if self.id == other.id {
            self.lead += other.lead;
        } else if other.lead > self.lead {
            *self = Self { id: other.id, lead: other.lead - self.lead };
        } else {
            self.lead -= other.lead;
        }
    }
}

impl Film {
    /// An empty film of `size` pixels (width, height) which collects what `layers` need, those of geometry as means over
    /// the samples.
    ///
    /// # Errors
    /// When a side is 0 or the memory cannot be had.
    pub fn new(size: (u32, u32), layers: &[Layer]) -> Result<Self, FilmError> {
        Self::of_window(size, Tile::whole(size), layers, false)
    }

    /// An empty film of what the settings ask for: of the whole picture or a part of it, with an alpha channel
    /// where the background is transparent.
    ///
    /// # Errors
    /// When nothing of the picture is to be rendered or the memory cannot be had.
    pub fn for_settings(settings: &RenderSettings) -> Result<Self, FilmError> {
        let alpha = settings.background == Background::Transparent;
        let film =
            Self::of_window(settings.size, Tile::rendered(settings), &settings.layers, alpha)?;
        Ok(Self { layer_filter: settings.layer_filter, ..film })
    }

    fn of_window(
        size: (u32, u32),
        window: Tile,
        layers: &[Layer],
        alpha: bool,
    ) -> Result<Self, FilmError> {
        let (width, height) = window.size();
        if width == 0 || height == 0 {
            return Err(FilmError::Empty { width, height });
        }
        let failed = |source| FilmError::Memory { width, height, source };
        let each = Sums::bytes_each(layers, alpha);
        ask((window.area() as u64).saturating_mul(each)).map_err(failed)?;
        let sums = Sums::new(window.area(), layers, alpha);
        let layers = layers.to_vec();
        let layer_filter = LayerFilter::Mean;
        Ok(Self { size, window, layers, alpha, layer_filter, sums, non_finite: 0 })
    }

    /// Bytes that the film of these settings takes.
    pub fn forecast(settings: &RenderSettings) -> u64 {
        let alpha = settings.background == Background::Transparent;
        let pixels = Tile::rendered(settings).area() as u64;
        pixels.saturating_mul(Sums::bytes_each(&settings.layers, alpha))
    }

    /// Width and height of the picture in pixels.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// What of the picture the film holds.
    pub fn window(&self) -> Tile {
        self.window
    }

    /// Whether any layer needs [`PixelSample::seen`].
    pub fn wants_seen(&self) -> bool {
        let albedo = self.layers.contains(&Layer::Albedo);
        albedo || (self.wants_geometry() && self.layer_filter == LayerFilter::Mean)
    }

    /// Whether any layer needs what is seen at the centre of the pixel, see [`TileBuffer::add_centre`].
    pub fn wants_centres(&self) -> bool {
        self.wants_geometry() && self.layer_filter == LayerFilter::Center
    }

    fn wants_geometry(&self) -> bool {
        self.layers.iter().any(|layer| layer.is_geometry())
    }

    /// The tiles of the picture that hold pixels of the film, row by row; together they cover every pixel once.
    ///
    /// They are those of the whole picture, since pixels of one tile may share paths: so the film of a part has the
    /// bits of the whole.
    pub fn tiles(&self) -> Vec<Tile> {
        let (width, height) = self.size;
        let starts = |length: u32| (0..length).step_by(TILE as usize);
        let end = |start: u32, length: u32| start.saturating_add(TILE).min(length);
        starts(height)
            .flat_map(|y0| starts(width).map(move |x0| (x0, y0)))
            .map(|(x0, y0)| Tile { x0, y0, x1: end(x0, width), y1: end(y0, height) })
            .filter(|tile| tile.common(self.window).area() > 0)
            .collect()
    }

    /// An empty buffer for a tile of this film.
    ///
    /// # Panics
    /// When the tile is not part of the film.
    pub fn tile_buffer(&self, tile: Tile) -> TileBuffer {
        assert!(
            tile.x0 <= tile.x1
                && tile.x1 <= self.size.0
                && tile.y0 <= tile.y1
                && tile.y1 <= self.size.1,
            "{tile:?} reaches beyond a film of {:?}",
            self.size
        );
        let sums = Sums::new(tile.area(), &self.layers, self.alpha);
        TileBuffer { tile, layer_filter: self.layer_filter, sums, non_finite: 0 }
    }

    /// Adds the samples of a tile, as far as the film goes.
    pub fn merge(&mut self, buffer: TileBuffer) {
        let tile = buffer.tile;
        let tile_width = (tile.x1 - tile.x0) as usize;
        let kept = tile.common(self.window);
        for y in kept.y0..kept.y1 {
            let from = (y - tile.y0) as usize * tile_width + (kept.x0 - tile.x0) as usize;
            let to = self.index(kept.x0, y);
            for column in 0..(kept.x1 - kept.x0) as usize {
                self.sums.join(to + column, &buffer.sums, from + column);
            }
        }
        self.non_finite += buffer.non_finite;
    }

    /// Samples that were dropped because they held a NaN, an infinity or negative radiance.
    pub fn non_finite(&self) -> u64 {
        self.non_finite
    }

    /// Mean radiance of a pixel of the picture, W·m⁻²·sr⁻¹ per channel; 0 without samples.
    ///
    /// # Panics
    /// When the pixel lies outside of the film.
    pub fn radiance(&self, x: u32, y: u32) -> Rgb {
        self.sums.mean[self.index(x, y)].as_vec3()
    }

    /// Samples of a pixel of the picture, dropped ones not included.
    ///
    /// # Panics
    /// When the pixel lies outside of the film.
    pub fn samples(&self, x: u32, y: u32) -> u32 {
        self.sums.count[self.index(x, y)]
    }

    fn index(&self, x: u32, y: u32) -> usize {
        let Tile { x0, y0, x1, y1 } = self.window;
        let inside = (x0..x1).contains(&x) && (y0..y1).contains(&y);
        assert!(inside, "pixel ({x}, {y}) outside {:?}", self.window);
        (y - y0) as usize * (x1 - x0) as usize + (x - x0) as usize
    }
}

impl TileBuffer {
    /// The rectangle of the film which this buffer collects.
    pub fn tile(&self) -> Tile {
        self.tile
    }

    /// Adds a sample to the pixel in column `x` and row `y` of the **film**.
    ///
    /// A sample with a NaN, an infinity or negative radiance is dropped and counted, never averaged; a
    /// first hit with a NaN or an infinity is dropped alone, and counted as well.
    ///
    /// # Panics
    /// When the pixel lies outside the tile.
    pub fn add(&mut self, x: u32, y: u32, sample: &PixelSample) {
        self.add_seen(x, y, sample, None);
    }

    /// The same for a sample that was seen at wavelengths, if it was: it is dropped by what was found there. Its colour may
    /// have a negative channel.
    ///
    /// # Panics
    /// When the pixel lies outside the tile.
    pub fn add_seen(
        &mut self,
        x: u32,
        y: u32,
        sample: &PixelSample,
        seen_at: Option<&WavelengthSet>,
    ) {
        let index = self.index(x, y);
        let finite = sample.radiance.is_finite() && sample.transmittance.is_finite();
        if !finite || sample.radiance.min_element() < 0.0 {
            self.non_finite += 1;
            return;
        }
        let to_rgb = |seen: Rgb| seen_at.map_or(seen, |set| set.to_rgb * seen);
        self.sums.push(index, to_rgb(sample.radiance));
        add(&mut self.sums.transmittance, index, f64::from(sample.transmittance));
        let Some(seen) = &sample.seen else { return };
        if !is_finite(seen) {
            self.non_finite += 1;
            return;
        }
        if let Some(hit) = &seen.first_hit {
            self.sums.push_albedo(index, to_rgb(hit.albedo));
        }
        if self.layer_filter == LayerFilter::Mean {
            self.sums.push_geometry(index, seen);
        }
    }

    /// Sets the layers of geometry of the pixel in column `x` and row `y` of the **film** to what is seen at its centre:
    /// once for each pixel, where [`Film::wants_centres`]. What holds a NaN or an infinity is dropped and counted.
    ///
    /// # Panics
    /// When the pixel lies outside the tile.
    pub fn add_centre(&mut self, x: u32, y: u32, seen: &Seen) {
        let index = self.index(x, y);
        if is_finite(seen) {
            self.sums.push_geometry(index, seen);
        } else {
            self.non_finite += 1;
        }
    }

    fn index(&self, x: u32, y: u32) -> usize {
        let tile = self.tile;
        assert!(
            (tile.x0..tile.x1).contains(&x) && (tile.y0..tile.y1).contains(&y),
            "pixel ({x}, {y}) outside {tile:?}"
        );
        (y - tile.y0) as usize * (tile.x1 - tile.x0) as usize + (x - tile.x0) as usize
    }
}

fn is_finite(seen: &Seen) -> bool {
    let is_finite = |hit: &FirstHit| {
        hit.albedo.is_finite()
            && hit.normal.is_finite()
            && hit.depth.is_finite()
            && hit.position.is_finite()
    };
    seen.motion.is_finite() && seen.first_hit.as_ref().is_none_or(is_finite)
}

/// `count` copies of the default, or none where they are not wanted.
fn filled<T: Clone + Default>(wanted: bool, count: usize) -> Vec<T> {
    vec![T::default(); if wanted { count } else { 0 }]
}

impl Sums {
    fn new(pixels: usize, layers: &[Layer], alpha: bool) -> Self {
        let wants = |layer| layers.contains(&layer);
        Self {
            count: filled(true, pixels),
            mean: filled(true, pixels),
            transmittance: filled(alpha, pixels),
            m2: filled(wants(Layer::Variance), pixels),
            lit_hits: filled(wants(Layer::Albedo), pixels),
            hits: filled(layers.iter().any(|layer| layer.is_geometry()), pixels),
            albedo: filled(wants(Layer::Albedo), pixels),
            normal: filled(wants(Layer::Normal), pixels),
            depth: filled(wants(Layer::Depth), pixels),
            position: filled(wants(Layer::Position), pixels),
            followed: filled(wants(Layer::Motion), pixels),
            motion: filled(wants(Layer::Motion), pixels),
            object: filled(wants(Layer::ObjectId), pixels),
        }
    }

    /// Bytes of one pixel: of a film of one.
    fn bytes_each(layers: &[Layer], alpha: bool) -> u64 {
        let one = Self::new(1, layers, alpha);
        let bytes = size_of_val(&one.count[..])
            + size_of_val(&one.mean[..])
            + size_of_val(&one.transmittance[..])
            + size_of_val(&one.m2[..])
            + size_of_val(&one.lit_hits[..])
            + size_of_val(&one.hits[..])
            + size_of_val(&one.albedo[..])
            + size_of_val(&one.normal[..])
            + size_of_val(&one.depth[..])
            + size_of_val(&one.position[..])
            + size_of_val(&one.followed[..])
            + size_of_val(&one.motion[..])
            + size_of_val(&one.object[..]);
        bytes as u64
    }

    fn push(&mut self, i: usize, radiance: Rgb) {
        self.count[i] += 1;
        let spread = moments::push(&mut self.mean[i], self.count[i], radiance.as_dvec3());
        if let Some(m2) = self.m2.get_mut(i) {
            *m2 += spread;
        }
    }

    fn push_albedo(&mut self, i: usize, albedo: Rgb) {
        add(&mut self.lit_hits, i, 1);
        add(&mut self.albedo, i, albedo.as_dvec3());
    }

    fn push_geometry(&mut self, i: usize, seen: &Seen) {
        add(&mut self.followed, i, 1);
        add(&mut self.motion, i, seen.motion.as_dvec2());
        let Some(hit) = &seen.first_hit else { return };
        add(&mut self.hits, i, 1);
        add(&mut self.normal, i, hit.normal.as_dvec3());
        add(&mut self.depth, i, f64::from(hit.depth));
        add(&mut self.position, i, hit.position);
        if let Some(vote) = self.object.get_mut(i) {
            vote.cast(Vote { id: hit.object_id, lead: 1 });
        }
    }

    /// Adds pixel `j` of `other`, which collects the same layers, to pixel `i`.
    fn join(&mut self, i: usize, other: &Self, j: usize) {
        let spread = moments::join(&mut self.mean[i], self.count[i], other.mean[j], other.count[j]);
        self.count[i] += other.count[j];
        if let Some(m2) = self.m2.get_mut(i) {
            *m2 += spread + other.m2[j];
        }
        join(&mut self.transmittance, i, &other.transmittance, j);
        join(&mut self.lit_hits, i, &other.lit_hits, j);
        join(&mut self.hits, i, &other.hits, j);
        join(&mut self.albedo, i, &other.albedo, j);
        join(&mut self.normal, i, &other.normal, j);
        join(&mut self.depth, i, &other.depth, j);
        join(&mut self.position, i, &other.position, j);
        join(&mut self.followed, i, &other.followed, j);
        join(&mut self.motion, i, &other.motion, j);
        if let Some(vote) = self.object.get_mut(i) {
            vote.cast(other.object[j]);
        }
    }
}

fn add<T: std::ops::AddAssign>(sums: &mut [T], i: usize, value: T) {
    if let Some(sum) = sums.get_mut(i) {
        *sum += value;
    }
}

fn join<T: std::ops::AddAssign + Copy>(sums: &mut [T], i: usize, others: &[T], j: usize) {
    if let Some(sum) = sums.get_mut(i) {
        *sum += others[j];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec2, Vec3};

    fn gray(value: f32) -> PixelSample {
        PixelSample { radiance: Rgb::splat(value), ..PixelSample::default() }
    }

    fn whole(film: &Film) -> Tile {
        Tile { x0: 0, y0: 0, x1: film.size.0, y1: film.size.1 }
    }

    fn hit(object_id: u32) -> Seen {
        let first_hit = FirstHit {
            albedo: Rgb::splat(0.5),
            normal: Vec3::Z,
            depth: 2.0,
            position: DVec3::new(1.0, 2.0, 3.0),
            object_id,
        };
        Seen { first_hit: Some(first_hit), motion: Vec2::new(4.0, -1.0) }
    }

    /// A plain f32 sum of 0.1 is 1 % off after 10⁶ terms already.
    #[test]
    fn ten_million_samples_of_a_constant_average_to_it() {
        let mut film = Film::new((1, 1), &[Layer::Variance]).expect("small");
        let mut buffer = film.tile_buffer(whole(&film));
        for _ in 0..10_000_000 {
            buffer.add(0, 0, &gray(0.1));
        }
        film.merge(buffer);
        assert!((film.sums.mean[0].x - 0.1).abs() < 1e-6);
        assert_eq!(film.samples(0, 0), 10_000_000);
        assert!(film.sums.m2[0].x < 1e-12);
    }

    #[test]
    fn tiles_cover_every_pixel_once() {
        for size in [(1, 1), (32, 32), (33, 31), (640, 7), (5, 97)] {
            let film = Film::new(size, &[]).expect("small");
            let mut seen = vec![0; (size.0 * size.1) as usize];
            for tile in film.tiles() {
                for y in tile.y0..tile.y1 {
                    for x in tile.x0..tile.x1 {
                        seen[(y * size.0 + x) as usize] += 1;
                    }
                }
            }
            assert!(seen.iter().all(|&count| count == 1), "{size:?}");
        }
    }

    /// Tiles in any order give the bits of one buffer over the whole film.
    #[test]
    fn merged_tiles_equal_a_single_accumulation_to_the_bit() {
        let layers = [Layer::Variance, Layer::ObjectId, Layer::Position];
        let empty = Film::new((70, 50), &layers).expect("small");
        let sample = |x: u32, y: u32, s: u32| PixelSample {
            radiance: Rgb::new(x as f32 * 0.1, y as f32 * 0.37, s as f32 / 3.0),
            seen: (s != 1).then(|| hit(x + 1)),
            ..PixelSample::default()
        };
        let fill = |tile: Tile| {
            let mut buffer = empty.tile_buffer(tile);
            for y in tile.y0..tile.y1 {
                for x in tile.x0..tile.x1 {
                    (0..5).for_each(|s| buffer.add(x, y, &sample(x, y, s)));
                }
            }
            buffer
        };
        let mut single = empty.clone();
        single.merge(fill(whole(&empty)));
        let mut backwards = empty.clone();
        empty.tiles().into_iter().rev().for_each(|tile| backwards.merge(fill(tile)));
        assert_eq!(single.sums.mean, backwards.sums.mean);
        assert_eq!(single.sums.m2, backwards.sums.m2);
        assert_eq!(single.sums.position, backwards.sums.position);
        assert_eq!(single.sums.object, backwards.sums.object);
    }

    #[test]
    fn two_passes_equal_one_pass_of_all_samples_but_for_rounding() {
        let value = |s: u32| (s as f32 * 0.7).sin() + 1.0;
        let film_of = |cuts: &[u32]| {
            let mut film = Film::new((1, 1), &[Layer::Variance]).expect("small");
            for pass in cuts.windows(2) {
                let mut buffer = film.tile_buffer(whole(&film));
                (pass[0]..pass[1]).for_each(|s| buffer.add(0, 0, &gray(value(s))));
                film.merge(buffer);
            }
            film
        };
        let (one, two) = (film_of(&[0, 100]), film_of(&[0, 37, 100]));
        assert!((one.sums.mean[0] - two.sums.mean[0]).length() < 1e-14);
        assert!((one.sums.m2[0] - two.sums.m2[0]).length() < 1e-12);
    }

    #[test]
    fn broken_samples_are_dropped_and_counted() {
        let mut film = Film::new((2, 1), &[Layer::Depth]).expect("small");
        let mut buffer = film.tile_buffer(whole(&film));
        buffer.add(1, 0, &gray(3.0));
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0] {
            let radiance = Rgb::new(1.0, bad, 1.0);
            let seen = Some(hit(1));
            buffer.add(1, 0, &PixelSample { radiance, seen, ..PixelSample::default() });
        }
        let seen = Some(Seen { motion: Vec2::NAN, ..hit(1) });
        let radiance = Rgb::ONE;
        buffer.add(0, 0, &PixelSample { radiance, seen, ..PixelSample::default() });
        film.merge(buffer);
        assert_eq!(film.radiance(1, 0), Rgb::splat(3.0));
        assert_eq!(film.radiance(0, 0), Rgb::ONE);
        assert_eq!((film.samples(0, 0), film.samples(1, 0)), (1, 1));
        assert_eq!(film.sums.hits, [0, 0]);
        assert_eq!(film.non_finite(), 5);
    }

    #[test]
    fn the_object_with_most_hits_names_the_pixel() {
        let ids = [3, 7, 7, 1, 7, 3, 7, 7];
        for cut in 0..=ids.len() {
            let mut film = Film::new((1, 1), &[Layer::ObjectId]).expect("small");
            for part in [&ids[..cut], &ids[cut..]] {
                let mut buffer = film.tile_buffer(whole(&film));
                for &id in part {
                    let seen = Some(hit(id));
                    buffer.add(0, 0, &PixelSample { seen, ..PixelSample::default() });
                }
                film.merge(buffer);
            }
            assert_eq!(film.sums.object[0].id, 7, "cut at {cut}");
        }
    }

    #[test]
    fn memory_is_taken_only_for_the_layers_asked_for() {
        let film = Film::new((8, 8), &[Layer::Beauty]).expect("small");
        assert!(!film.wants_seen());
        assert!(film.sums.m2.is_empty() && film.sums.albedo.is_empty());
        let film = Film::new((8, 8), &[Layer::Beauty, Layer::Albedo]).expect("small");
        assert!(film.wants_seen() && !film.wants_centres());
        assert!(film.sums.normal.is_empty());
    }

    #[test]
    fn impossible_sizes_are_errors() {
        assert!(matches!(Film::new((0, 4), &[]), Err(FilmError::Empty { .. })));
        assert!(matches!(Film::new((u32::MAX, u32::MAX), &[]), Err(FilmError::Memory { .. })));
    }
}
