//! Wavefront OBJ: polygons over lists of positions, texture coordinates and normals.
//!
//! Of the format (Wavefront 1992, *Advanced Visualizer* manual, appendix B1) the statements `v`,
//! `vt`, `vn` and `f` are read, with negative indices, which count back from the newest, and lines
//! continued by `\`. Colours of vertices after the numbers of a `v` are an extension that tools agree on. Groups, materials, lines, points and free-form surfaces are skipped.
//!
//! Many programs write files that are not quite of the format. What can only mean one thing is read as that, and told:
//! the number 0, which counts nothing, for a texture coordinate or a normal that is not there; coordinates and normals
//! which are no numbers (`nan`), of corners that have none. A corner that a face names twice in a row is one corner.

use super::{AssetError, MAX_MESH_ELEMENTS, polygon, too_large};
use crate::description::{Rgb, TriangleMesh};
use glam::{DVec3, Vec2, Vec3};
use std::collections::HashMap;
use std::path::Path;

/// A corner of a face: indices of its position, texture coordinate and normal.
type Corner = (u32, Option<u32>, Option<u32>);

/// Reads the faces of a file; corners which agree in all three indices share a vertex.
///
/// Where only some corners have a normal, the others get zero; likewise texture coordinates. What was read otherwise than
/// it is written is told in `remarks`.
///
/// # Errors
/// At the first statement that is malformed, with its line.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    remarks: &mut Vec<String>,
) -> Result<TriangleMesh, AssetError> {
    // Names and comments may be in any encoding; everything that counts is ASCII.
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    // Where no line ends as they do today, it ends as on an old Macintosh.
    let lines: Box<dyn Iterator<Item = &str>> =
        if text.contains('\n') { Box::new(text.lines()) } else { Box::new(text.split('\r')) };
    let mut reader = Reader::default();
    let mut joined = String::new();
    for (index, line) in lines.enumerate() {
        reader.line = index + 1;
        let line = without_comment(line);
        if let Some(start) = line.trim_end().strip_suffix('\\') {
            joined.push_str(start);
            joined.push(' ');
            continue;
        }
        let statement = if joined.is_empty() {
            reader.statement(line)
        } else {
            joined.push_str(line);
            reader.statement(&std::mem::take(&mut joined))
        };
        statement.map_err(|message| AssetError::Obj {
            path: path.to_owned(),
            line: index + 1,
            message,
        })?;
        if reader.mesh.positions.len().max(reader.mesh.triangles.len()) > MAX_MESH_ELEMENTS {
            return Err(too_large(path, "more triangles".to_owned(), MAX_MESH_ELEMENTS));
        }
    }
    remarks.extend(reader.remarks(path));
    Ok(reader.finish())
}

#[derive(Default)]
struct Reader {
    positions: Vec<Vec3>,
    /// One for each position; 1 where none is given.
    colors: Vec<Rgb>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    /// Vertices of the mesh by their corner.
    vertices: HashMap<Corner, u32>,
    mesh: TriangleMesh,
    any_uv: bool,
    any_normal: bool,
    any_color: bool,
    /// The line that is read, from 1.
    line: usize,
    /// How many corners have the number 0 for their texture coordinate or normal, and the first such line.
    zeros: (usize, usize),
    /// How many texture coordinates and normals are no numbers, and the first such line.
    nans: (usize, usize),
}

/// One more of a kind that was first met in a line.
fn count((count, first): &mut (usize, usize), line: usize) {
    if *count == 0 {
        *first = line;
    }
    *count += 1;
}

impl Reader {
    fn statement(&mut self, line: &str) -> Result<(), String> {
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let words: Vec<&str> = words.collect();
                let (place, color) = words.split_at(words.len().min(3));
                let place = numbers(place.iter().copied(), "v x y z")?;
                self.positions.push(Vec3::from_array(place));
                // A single number is a weight, used by curves alone; it may stand before a colour.
                let color = if color.len() == 4 { &color[1..] } else { color };
                self.any_color |= color.len() == 3;
                self.colors.push(match color {
                    [] | [_] => Rgb::ONE,
                    [..] if color.len() == 3 => colour(color)?,
                    _ => {
                        return Err(format!(
                            "found {} numbers after `v`, expected `x y z`, perhaps a weight, and perhaps `r g b`",
                            words.len()
                        ));
                    }
                });
            }
            Some("vt") => {
                // v may be left out of a one-dimensional texture.
                let (u, v) = (words.next(), words.next().unwrap_or("0"));
                let uv = self.measured(u.into_iter().chain([v]), "vt u v")?;
                self.uvs.push(Vec2::from_array(uv));
            }
            Some("vn") => {
                let normal = self.measured(words, "vn x y z")?;
                self.normals.push(Vec3::from_array(normal));
            }
            // `fo` is what the format said before.
            Some("f" | "fo") => self.face(words)?,
            _ => {}
        }
        Ok(())
    }

    fn face<'a>(&mut self, words: impl Iterator<Item = &'a str>) -> Result<(), String> {
        let mut corners = words.map(|word| self.corner(word)).collect::<Result<Vec<_>, _>>()?;
        if corners.len() < 3 {
            return Err(format!(
                "found a face with {} corners, expected at least 3",
                corners.len()
            ));
        }
        // Programs that know of quads alone write a triangle as one.
        corners.dedup_by_key(|corner| corner.0);
        while corners.len() > 1 && corners[0].0 == corners[corners.len() - 1].0 {
            corners.pop();
        }
        if corners.len() < 3 {
            // Without area, as others that are left out when the mesh is tidied.
            let vertex = self.vertex(corners[0]);
            self.mesh.triangles.push([vertex; 3]);
            return Ok(());
        }
        let outline: Vec<DVec3> =
            corners.iter().map(|corner| self.positions[corner.0 as usize].as_dvec3()).collect();
        let triangles = polygon::triangulate(&outline).ok_or_else(|| {
            format!(
                "found a concave face with {} corners, expected at most {}: triangulate the mesh \
                 before it is exported",
                corners.len(),
                polygon::MAX_CONCAVE_CORNERS
            )
        })?;
        let vertices: Vec<u32> = corners.iter().map(|&corner| self.vertex(corner)).collect();
        self.mesh.triangles.extend(triangles.iter().map(|t| t.map(|i| vertices[i])));
        Ok(())
    }

    /// Reads `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&mut self, word: &str) -> Result<Corner, String> {
        let mut parts = word.split('/');
        let mut zero = false;
        let mut next = |count: usize, what: &str| match parts.next() {
            None | Some("") => Ok(None),
            Some("0") if what != "position" => {
                zero = true;
                Ok(None)
            }
            Some(index) => resolve(index, count, what).map(Some),
        };
        let position = next(self.positions.len(), "position")?;
        let uv = next(self.uvs.len(), "texture coordinate")?;
        let normal = next(self.normals.len(), "normal")?;
        if zero {
            count(&mut self.zeros, self.line);
        }
        let uv = uv.filter(|&i| self.uvs[i as usize].is_finite());
        let normal = normal.filter(|&i| self.normals[i as usize].is_finite());
        match (position, parts.next()) {
            (Some(position), None) => Ok((position, uv, normal)),
            _ => Err(format!(
                "found the corner `{word}`, expected `v`, `v/vt`, `v//vn` or `v/vt/vn`"
            )),
        }
    }

    /// The numbers of a texture coordinate or a normal; not finite where a program wrote that it knows none.
    fn measured<'a, const N: usize>(
        &mut self,
        words: impl Iterator<Item = &'a str>,
        expected: &str,
    ) -> Result<[f32; N], String> {
        let words: Vec<&str> = words.collect();
        // C libraries write `nan`, `-nan(ind)` or `1.#IND`, and `inf` or `1.#INF`.
        let unknown = |word: &&str| {
            let word = word.to_ascii_lowercase();
            ["nan", "inf", "#ind", "#qnan"].iter().any(|name| word.contains(name))
        };
        if words.len() >= N && words[..N].iter().any(unknown) {
            count(&mut self.nans, self.line);
            return Ok([f32::NAN; N]);
        }
        numbers(words.into_iter(), expected)
    }

    /// What was read otherwise than it is written, in words.
    fn remarks(&self, path: &Path) -> impl Iterator<Item = String> {
        let path = path.display();
        let zeros = (self.zeros.0 > 0).then(|| {
            let (count, line) = self.zeros;
            format!(
                "`{path}`: {count} corners, the first in line {line}, have the number 0 for a texture coordinate or a \
                 normal, where 1 is the first: read as none"
            )
        });
        let nans = (self.nans.0 > 0).then(|| {
            let (count, line) = self.nans;
            format!(
                "`{path}`: {count} texture coordinates or normals, the first in line {line}, are no numbers: corners \
                 that name them are read as having none"
            )
        });
        zeros.into_iter().chain(nans)
    }

    fn vertex(&mut self, corner: Corner) -> u32 {
        *self.vertices.entry(corner).or_insert_with(|| {
            let (position, uv, normal) = corner;
            self.any_uv |= uv.is_some();
            self.any_normal |= normal.is_some();
            let mesh = &mut self.mesh;
            mesh.positions.push(self.positions[position as usize]);
            mesh.colors.push(self.colors[position as usize]);
            mesh.uvs.push(uv.map_or(Vec2::ZERO, |i| self.uvs[i as usize]));
            mesh.normals.push(normal.map_or(Vec3::ZERO, |i| self.normals[i as usize]));
            mesh.positions.len() as u32 - 1
        })
    }

    fn finish(mut self) -> TriangleMesh {
        if !self.any_uv {
            self.mesh.uvs = Vec::new();
        }
        if !self.any_normal {
            self.mesh.normals = Vec::new();
        }
        if !self.any_color {
            self.mesh.colors = Vec::new();
        }
        self.mesh
    }
}

/// A line up to its comment; a `#` within a word, as in the `1.#IND` of a C library, begins none.
fn without_comment(line: &str) -> &str {
    let begins = |at: &usize| *at == 0 || line.as_bytes()[at - 1].is_ascii_whitespace();
    let comment = line.match_indices('#').map(|(at, _)| at).find(begins);
    &line[..comment.unwrap_or(line.len())]
}

/// The index of an element, counted from 0, by its number in a face: from 1, or back from −1.
fn resolve(number: &str, count: usize, what: &str) -> Result<u32, String> {
    let found: i64 =
        number.parse().map_err(|_| format!("found `{number}`, expected the number of a {what}"))?;
    let count = count as i64;
    let index = if found > 0 { found - 1 } else { count.saturating_add(found) };
    if found == 0 || index < 0 || index >= count {
        return Err(format!("found {what} {found}, expected one of the {count} given so far"));
    }
    u32::try_from(index).map_err(|_| format!("{what} {found} is beyond 2³²"))
}

/// A colour from three words.
fn colour(words: &[&str]) -> Result<Rgb, String> {
    let color = Rgb::from_array(numbers(words.iter().copied(), "r g b")?);
    if color.min_element() < 0.0 || color.max_element() > 1.0 {
        return Err(format!(
            "found the colour `{}`, expected linear numbers from 0 to 1: divide those from 0 to 255 by 255",
            words.join(" ")
        ));
    }
    Ok(color)
}

fn numbers<'a, const N: usize>(
    mut words: impl Iterator<Item = &'a str>,
    expected: &str,
) -> Result<[f32; N], String> {
    let mut values = [0.0_f32; N];
    for value in &mut values {
        let word =
            words.next().ok_or_else(|| format!("found too few numbers, expected `{expected}`"))?;
        *value = word.parse().map_err(|_| format!("found `{word}`, expected a number"))?;
        if !value.is_finite() {
            return Err(format!("found `{word}`, expected a finite number"));
        }
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::assets::tidy;

    fn mesh(text: &str) -> TriangleMesh {
        parse(text.as_bytes(), Path::new("m.obj"), &mut Vec::new()).unwrap()
    }

    const CUBE_CORNER: &str = "\
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 2
vn 0 1 0
f 1/1/1 2/2/1 3/3/1 4/4/1
f -5/1/2 -1/4/2 2/2/2
";

    #[test]
    fn corners_which_agree_share_a_vertex_and_others_do_not() {
        let mesh = mesh(CUBE_CORNER);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 6]]);
        assert_eq!(mesh.positions[4], mesh.positions[0]);
        assert_eq!((mesh.normals[0], mesh.normals[4]), (Vec3::Z * 2.0, Vec3::Y));
        assert_eq!(mesh.uvs[2], Vec2::ONE);
    }

    #[test]
    fn comments_groups_continued_lines_and_foreign_endings_are_read() {
        let mesh = mesh(
            "# a\r\ng \u{fffd}x\r\nusemtl y\r\nv 0 0 0 1 # b\r\nv 1 0 \\\r\n 0\r\nv 0 1 0\r\nl 1 2\r\nf 1 \\\r\n2 3\r\n",
        );
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert!(mesh.normals.is_empty() && mesh.uvs.is_empty());
        assert_eq!(mesh.positions[1], Vec3::X);
    }

    /// Oracle: the numbers of the file. What has none is white, a weight is no colour, and without any there are none.
    #[test]
    fn colours_of_vertices_are_read() {
        let found = mesh("v 0 0 0 0.25 0.5 1\nv 1 0 0\nv 0 1 0 1.0 1 0 0\nf 1 2 3\nf 3 2 1\n");
        let expected = [Rgb::new(0.25, 0.5, 1.0), Rgb::ONE, Rgb::new(1.0, 0.0, 0.0)];
        assert_eq!(found.colors, expected);
        assert!(mesh("v 0 0 0 1\nv 1 0 0\nv 0 1 0 0.5\nf 1 2 3\n").colors.is_empty());
        for (line, words) in [
            ("v 0 0 0 1 2", "found 5 numbers"),
            ("v 0 0 0 1 1 1 1 1", "found 8 numbers"),
            ("v 0 0 0 255 0 128", "divide those from 0 to 255"),
            ("v 0 0 0 1 nan 0", "found `nan`"),
            ("v 0 0 0 1 -0.1 0", "from 0 to 1"),
        ] {
            let error = parse(line.as_bytes(), Path::new("m.obj"), &mut Vec::new())
                .unwrap_err()
                .to_string();
            assert!(error.contains("line 1:") && error.contains(words), "{error}");
        }
    }

    /// An L of area 3 cut wrongly by a fan would cover more.
    #[test]
    fn a_concave_face_is_cut_along_inner_diagonals() {
        let mesh = mesh("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 2 3 4 5 6 1\n");
        let area: f32 = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                (b - a).cross(c - a).length() * 0.5
            })
            .sum();
        assert_eq!((mesh.triangles.len(), area), (4, 3.0));
    }

    #[test]
    fn a_normal_missing_at_some_corners_becomes_the_face_s() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 1 0 0\nf 1//1 2 3\n";
        let mesh = tidy::tidy(mesh(text), Path::new("m.obj")).unwrap();
        let at = |p: Vec3| mesh.normals[mesh.positions.iter().position(|&q| q == p).unwrap()];
        assert_eq!((at(Vec3::ZERO), at(Vec3::X), at(Vec3::Y)), (Vec3::X, Vec3::Z, Vec3::Z));
    }

    /// What programs of students write: each is the quad that it means, and what is not of the format is told, once.
    #[test]
    fn files_that_are_not_quite_of_the_format_are_read_and_told() {
        let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
        let numbered = "vt 0.5 1\nvn 0 0 1\n";
        for (text, remark) in [
            (
                format!("{corners}{numbered}f 1/0/1 2/0/1 3/0/1 4/0/1\n"),
                "4 corners, the first in line 7",
            ),
            (format!("{corners}{numbered}f 1/1/0 2/1/0 3/1/0 4/1/0\n"), "4 corners"),
            (format!("{corners}f 1/0/0 2/0/0 3/0/0 4/0/0\n"), "4 corners, the first in line 5"),
            (format!("{corners}f 1/0 2/0 3/0 4/0\n"), "4 corners"),
            (
                format!("{corners}vn nan nan nan\nf 1//1 2//1 3//1 4//1\n"),
                "1 texture coordinates or normals, the first in line 5",
            ),
            (
                format!("{corners}vn -nan(ind) 0 0\nvt 1.#QNAN 0\nf 1/1/1 2/1/1 3/1/1 4/1/1\n"),
                "2 texture",
            ),
            (format!("{corners}f 1// 2// 3// 4//\n"), ""),
            (format!("{corners}f 1/ 2/ 3/ 4/\n"), ""),
            (format!("{corners}f -4 -3 -2 -1\n"), ""),
            (format!("{corners}f 1 1 2 3 4\nf 1 2 2 1\n"), ""),
            (format!("{corners}f 1 2 3 4 1\n"), ""),
            (format!("{corners}f 1 2 3 3\nf 1 3 4 4\nf 2 2 2\n"), ""),
            (format!("\u{feff}{corners}f 1 2 3 4\n"), ""),
            (format!("{corners}f 1 2 3 4\n").replace('\n', "\r"), ""),
            (format!("{corners}fo 1 2 3 4\n"), ""),
        ] {
            let mut remarks = Vec::new();
            let path = Path::new("m.obj");
            let mesh = parse(text.as_bytes(), path, &mut remarks).expect(&text);
            let mesh = tidy::tidy(mesh, path).expect(&text);
            assert_eq!(remarks.len(), usize::from(!remark.is_empty()), "{text}: {remarks:?}");
            assert!(remarks.iter().all(|told| told.contains(remark)), "{remarks:?}");
            let area = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                (b - a).cross(c - a) * 0.5
            };
            assert_eq!(mesh.triangles.iter().map(area).sum::<Vec3>(), Vec3::Z, "{text}");
            let has = |values: bool, used: &str| assert_eq!(values, text.contains(used), "{text}");
            has(!mesh.normals.is_empty(), "f 1/0/1");
            has(!mesh.uvs.is_empty(), "f 1/1/0");
            assert!(mesh.normals.iter().all(|n| *n == Vec3::Z), "{text}");
        }
    }

    #[test]
    fn errors_name_the_line_what_was_found_and_what_was_expected() {
        for (text, line, words) in [
            ("v 0 0\n", 1, ["too few", "v x y z"]),
            ("\nv 0 zero 0\n", 2, ["`zero`", "a number"]),
            ("v 0 0 nan\n", 1, ["`nan`", "finite"]),
            ("v 0 0 1e99\n", 1, ["`1e99`", "finite"]),
            ("v 0 0 0\nf 1 1 2\n", 2, ["position 2", "the 1 given"]),
            ("v 0 0 0\nf 0 1 1\n", 2, ["position 0", "the 1 given"]),
            ("v 0 0 0\nf 1 1 -2\n", 2, ["position -2", "the 1 given"]),
            ("v 0 0 0\nf 1/1 1 1\n", 2, ["texture coordinate 1", "the 0 given"]),
            ("v 0 0 0\nf 1 1\n", 2, ["2 corners", "at least 3"]),
            ("v 0 0 0\nf 1/// 1 1\n", 2, ["`1///`", "`v/vt/vn`"]),
            ("v 0 0 0\nf a 1 1\n", 2, ["`a`", "position"]),
            ("v 0 0 0\nf 1 1 -9223372036854775808\n", 2, ["position", "given"]),
        ] {
            let error = parse(text.as_bytes(), Path::new("m.obj"), &mut Vec::new())
                .unwrap_err()
                .to_string();
            assert!(error.contains(&format!("line {line}:")), "{error}");
            assert!(words.iter().all(|word| error.contains(word)), "{error}");
        }
    }

    /// Whatever the bytes: an error, or a mesh whose indices are in range (tidy checks them).
    #[test]
    fn cut_and_mutated_files_never_panic() {
        let path = Path::new("m.obj");
        for at in 0..CUBE_CORNER.len() {
            let _ = parse(&CUBE_CORNER.as_bytes()[..at], path, &mut Vec::new())
                .and_then(|m| tidy::tidy(m, path));
            for byte in 0..=255 {
                let mut mutant = CUBE_CORNER.as_bytes().to_vec();
                mutant[at] = byte;
                let _ = parse(&mutant, path, &mut Vec::new()).and_then(|m| tidy::tidy(m, path));
            }
        }
    }
}
