//! The outlines of words.

use super::extrude::flattened;
use crate::math::Cubic;
use glam::DVec2;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// How lines of a text stand above each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
pub enum Alignment {
    /// They begin at x = 0.
    #[default]
    Left,
    /// Their middles are at x = 0.
    Center,
    /// They end at x = 0.
    Right,
}

/// Why there are no outlines of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TextError {
    /// The file is none, or broken.
    #[error("this is not a font in TrueType or OpenType format: {0}")]
    NotAFont(ttf_parser::FaceParsingError),
    /// A character is not in the font.
    #[error("the font has no glyph for {0:?}")]
    NoGlyph(char),
    /// There are only blanks.
    #[error("there is nothing to be seen of this text")]
    Blank,
}

/// The contours of a text, `size` metres for an em, the baseline of the first line at y = 0. Glyphs are set side by side
/// with the kerning of the font's `kern` table. Contours may overlap; they fill what they go around.
///
/// # Errors
/// When the font cannot be read or lacks a character, or nothing is to be seen.
pub fn text_contours(
    font: &[u8],
    text: &str,
    (size, tolerance): (f64, f64),
    alignment: Alignment,
) -> Result<Vec<Vec<DVec2>>, TextError> {
    let face = Face::parse(font, 0).map_err(TextError::NotAFont)?;
    let unit = size / f64::from(face.units_per_em());
    let leading =
        f64::from(face.ascender()) - f64::from(face.descender()) + f64::from(face.line_gap());
    let mut contours = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let first = contours.len();
        let (mut x, mut before) = (0.0, None);
        for letter in line.chars() {
            let glyph = face.glyph_index(letter).ok_or(TextError::NoGlyph(letter))?;
            x += before.map_or(0.0, |before| kerning(&face, before, glyph));
            let origin = DVec2::new(x, -leading * number as f64);
            let mut pen = Pen {
                origin,
                unit,
                tolerance,
                curves: Vec::new(),
                start: None,
                at: DVec2::ZERO,
                contours: &mut contours,
            };
            face.outline_glyph(glyph, &mut pen);
            pen.finish();
            x += f64::from(face.glyph_hor_advance(glyph).unwrap_or(0));
            before = Some(glyph);
        }
        let shift = match alignment {
            Alignment::Left => 0.0,
            Alignment::Center => -0.5 * x,
            Alignment::Right => -x,
        };
        let shift = DVec2::X * (shift * unit);
        contours[first..].iter_mut().flatten().for_each(|p: &mut DVec2| *p += shift);
    }
    if contours.is_empty() { Err(TextError::Blank) } else { Ok(contours) }
}

/// By how much two glyphs are moved together or apart, in units of the font.
fn kerning(face: &Face, left: GlyphId, right: GlyphId) -> f64 {
    let tables = face.tables().kern.iter().flat_map(|kern| kern.subtables);
    let along = tables.filter(|table| table.horizontal && !table.variable);
    along.filter_map(|table| table.glyphs_kerning(left, right)).map(f64::from).sum()
}

/// Takes down the outline of a glyph.
struct Pen<'a> {
    /// In units of the font, as all but the contours.
    origin: DVec2,
    /// Metres.
    unit: f64,
    tolerance: f64,
    curves: Vec<Cubic>,
    start: Option<DVec2>,
    at: DVec2,
    contours: &'a mut Vec<Vec<DVec2>>,
}

impl Pen<'_> {
    fn place(&self, x: f32, y: f32) -> DVec2 {
        (self.origin + DVec2::new(f64::from(x), f64::from(y))) * self.unit
    }

    fn curve(&mut self, a: DVec2, b: DVec2, to: DVec2) {
        self.curves.push(Cubic::new([self.at, a, b, to], [1.0; 4]));
        self.at = to;
    }

    /// Ends the contour: it goes straight back to where it began.
    fn finish(&mut self) {
        if self.start.take().is_some() {
            let points = flattened(&std::mem::take(&mut self.curves), self.tolerance);
            self.contours.extend(Some(points).filter(|points| points.len() > 2));
        }
    }
}

impl OutlineBuilder for Pen<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.finish();
        self.at = self.place(x, y);
        self.start = Some(self.at);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (from, to) = (self.at, self.place(x, y));
        self.curve(from.lerp(to, 1.0 / 3.0), from.lerp(to, 2.0 / 3.0), to);
    }

    /// The same curve as one of degree 3.
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (from, by, to) = (self.at, self.place(x1, y1), self.place(x, y));
        self.curve(from.lerp(by, 2.0 / 3.0), to.lerp(by, 2.0 / 3.0), to);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let (a, b, to) = (self.place(x1, y1), self.place(x2, y2), self.place(x, y));
        self.curve(a, b, to);
    }

    fn close(&mut self) {
        if let Some(start) = self.start.filter(|start| *start != self.at) {
            let from = self.at;
            self.curve(from.lerp(start, 1.0 / 3.0), from.lerp(start, 2.0 / 3.0), start);
        }
        self.finish();
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::description::modelling::solids::volume;
    use crate::description::modelling::{Filling, extruded};

    /// A font of three glyphs in 1000 units: nothing, `o`, a square of 600 with a square hole of 200, and `i`, 100 wide and
    /// 600 high; each 800 wide.
    pub(crate) fn font() -> Vec<u8> {
        let be16 =
            |list: &[i32]| list.iter().flat_map(|v| (*v as u16).to_be_bytes()).collect::<Vec<u8>>();
        let glyph = |contours: &[&[(i32, i32)]]| {
            let points: Vec<(i32, i32)> = contours.concat();
            let mut data = be16(&[contours.len() as i32, 0, 0, 600, 600]);
            let mut end = -1;
            for contour in contours {
                end += contour.len() as i32;
                data.extend(be16(&[end]));
            }
            data.extend(be16(&[0]));
            // All on the curve, coordinates as differences of two bytes.
            data.extend(points.iter().map(|_| 1_u8));
            for axis in 0..2 {
                let mut before = 0;
                for p in &points {
                    let v = if axis == 0 { p.0 } else { p.1 };
                    data.extend(be16(&[v - before]));
                    before = v;
                }
            }
            data.resize(data.len().next_multiple_of(4), 0);
            data
        };
        let o = glyph(&[
            &[(100, 0), (100, 600), (700, 600), (700, 0)],
            &[(300, 200), (500, 200), (500, 400), (300, 400)],
        ]);
        let i = glyph(&[&[(0, 0), (0, 600), (100, 600), (100, 0)]]);
        let (o_end, i_end) = (o.len() as u32, (o.len() + i.len()) as u32);
        let loca: Vec<u8> =
            [0, 0, o_end, i_end].iter().flat_map(|v: &u32| v.to_be_bytes()).collect();
        let mut head = be16(&[1, 0, 1, 0, 0, 0, 0x5F0F, 0x3CF5, 0, 1000]);
        head.extend([0; 16]);
        head.extend(be16(&[0, 0, 800, 600, 0, 8, 2, 1, 0]));
        let mut hhea = be16(&[1, 0, 800, -200, 0, 800, 0, 0, 800, 1, 0, 0, 0, 0, 0, 0, 0]);
        hhea.extend(be16(&[3]));
        let maxp = [be16(&[1, 0, 3]), vec![0; 26]].concat();
        let hmtx = be16(&[800, 0, 800, 0, 800, 0]);
        // One table of segments: `i`, `o`, and the end.
        let segments = be16(&[
            4,
            40,
            0,
            6,
            4,
            1,
            2,
            0x69,
            0x6F,
            0xFFFF,
            0,
            0x69,
            0x6F,
            0xFFFF,
            2 - 0x69,
            1 - 0x6F,
            1,
            0,
            0,
            0,
        ]);
        let cmap = [be16(&[0, 1, 3, 1, 0, 12]), segments].concat();
        let glyf = [o, i].concat();
        let tables: [(&[u8; 4], Vec<u8>); 7] = [
            (b"cmap", cmap),
            (b"glyf", glyf),
            (b"head", head),
            (b"hhea", hhea),
            (b"hmtx", hmtx),
            (b"loca", loca),
            (b"maxp", maxp),
        ];
        let mut font = be16(&[1, 0, 7, 64, 2, 48]);
        let mut offset = 12 + 16 * tables.len() as u32;
        for (name, data) in &tables {
            font.extend(*name);
            for v in [0, offset, data.len() as u32] {
                font.extend(v.to_be_bytes());
            }
            offset += data.len().next_multiple_of(4) as u32;
        }
        for (_, mut data) in tables {
            data.resize(data.len().next_multiple_of(4), 0);
            font.extend(data);
        }
        font
    }

    fn extent(contours: &[Vec<DVec2>]) -> (DVec2, DVec2) {
        let points = || contours.iter().flatten();
        let low = points().fold(DVec2::INFINITY, |low, p| low.min(*p));
        (low, points().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p)))
    }

    /// Closed form: areas and places of the glyphs of a known font.
    #[test]
    fn words_stand_where_their_font_says() {
        let font = font();
        let set = |text: &str, alignment| {
            text_contours(&font, text, (0.1, 1e-5), alignment).expect("both letters are there")
        };
        let word = set("oi", Alignment::Left);
        let mesh = extruded(&word, Filling::NonZero, 0.02, 30.0);
        let area = 0.06 * 0.06 - 0.02 * 0.02 + 0.01 * 0.06;
        assert!((volume(&mesh) / (area * 0.02) - 1.0).abs() < 1e-5, "{}", volume(&mesh));
        let close = |a: DVec2, b: [f64; 2]| a.distance(DVec2::from(b)) < 1e-7;
        let (low, high) = extent(&word);
        assert!(close(low, [0.01, 0.0]) && close(high, [0.09, 0.06]), "{low} {high}");
        let (low, high) = extent(&set("oi", Alignment::Center));
        assert!(close(low, [-0.07, 0.0]) && close(high, [0.01, 0.06]), "{low} {high}");
        let (low, high) = extent(&set("o\no", Alignment::Right));
        assert!(close(low, [-0.07, -0.1]) && close(high, [-0.01, 0.06]), "{low} {high}");
    }

    #[test]
    fn what_cannot_be_set_says_why() {
        let font = font();
        let set = |font: &[u8], text| text_contours(font, text, (1.0, 1e-3), Alignment::Left);
        assert_eq!(set(&font, "oxo"), Err(TextError::NoGlyph('x')));
        assert_eq!(set(&font, ""), Err(TextError::Blank));
        assert!(matches!(set(b"no font at all", "o"), Err(TextError::NotAFont(_))));
        for cut in 0..font.len() {
            // Broken files give an error, or fewer outlines.
            let _ = set(&font[..cut], "oi");
        }
    }
}
