//! The geometry of a glTF 2.0 asset, as `.gltf` with its buffers or as one `.glb`.
//!
//! All triangles of the default scene (or the first, or of all root nodes where there is none)
//! become one mesh in the scene's space. Whatever does not concern geometry is left out before the
//! document is parsed, so that a material or an animation from an unknown extension does no harm.

use super::accessor::Source;
use super::gather::Gathered;
use super::tidy::malformed;
use super::{AssetError, MAX_FILE_BYTES, read_file, too_large};
use crate::description::TriangleMesh;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::scene::Node;
use gltf::json::{Index, Root, deserialize};
use gltf::{Glb, buffer};
use serde_json::Value;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// The top-level properties which say where triangles are.
const GEOMETRY: [&str; 9] = [
    "accessors",
    "asset",
    "bufferViews",
    "buffers",
    "extensionsRequired",
    "meshes",
    "nodes",
    "scene",
    "scenes",
];

/// Extensions that may be required without a change to where triangles are, by how they begin, and
/// quantisation, which is only the permission to store integers.
const HARMLESS_EXTENSIONS: [&str; 6] = [
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "KHR_lights_",
    "KHR_animation_",
    "KHR_mesh_quantization",
];

/// A parsed document with the bytes that came in the same file.
pub(super) struct Asset<'a> {
    path: &'a Path,
    root: Root,
    blob: Option<Vec<u8>>,
}

impl<'a> Asset<'a> {
    pub fn open(path: &'a Path) -> Result<Self, AssetError> {
        Self::parse(&read_file(path)?, path)
    }

    fn parse(bytes: &[u8], path: &'a Path) -> Result<Self, AssetError> {
        let (json, blob) = split(bytes).map_err(|message| malformed(path, message))?;
        let failed =
            |error: serde_json::Error| malformed(path, format!("not a glTF document: {error}"));
        let mut document: Value = serde_json::from_slice(&json).map_err(failed)?;
        if let Some(properties) = document.as_object_mut() {
            properties.retain(|name, _| GEOMETRY.contains(&name.as_str()));
        }
        let root: Root = deserialize::from_value(document).map_err(failed)?;
        let unknown =
            |name: &&String| !HARMLESS_EXTENSIONS.iter().any(|known| name.starts_with(known));
        if let Some(name) = root.extensions_required.iter().find(unknown) {
            let message = format!(
                "requires the extension `{name}`, which is not read: export it without (for \
                 geometry: uncompressed)"
            );
            return Err(malformed(path, message));
        }
        Ok(Self { path, root, blob })
    }

    /// The file that a relative URI names, which must not lead out of the folder.
    fn beside(&self, uri: &str) -> Result<PathBuf, AssetError> {
        let outside =
            || AssetError::OutsideFile { path: self.path.to_owned(), uri: uri.to_owned() };
        let name = percent_decode(uri).ok_or_else(outside)?;
        let name = Path::new(&name);
        let inside =
            name.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        // A colon is a scheme or a drive, a backslash a separator on some systems.
        if !inside || name.as_os_str().is_empty() || uri.contains([':', '\\']) {
            return Err(outside());
        }
        let folder = match self.path.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        let file = folder.join(name);
        // Links are followed first: one could lead out as well.
        let real = |path: &Path| {
            fs::canonicalize(path)
                .map_err(|cause| AssetError::Read { path: path.to_owned(), cause })
        };
        if real(&file)?.starts_with(real(folder)?) { Ok(file) } else { Err(outside()) }
    }

    fn buffers(&mut self) -> Result<Vec<Vec<u8>>, AssetError> {
        let mut total = 0_u64;
        let mut buffers = Vec::with_capacity(self.root.buffers.len());
        for index in 0..self.root.buffers.len() {
            let uri = self.root.buffers[index].uri.as_deref();
            let bytes = match uri {
                Some(uri) if uri.starts_with("data:") => {
                    let source = buffer::Source::Uri(uri);
                    let data = buffer::Data::from_source(source, None);
                    data.map_err(|e| malformed(self.path, format!("buffer {index}: {e}")))?.0
                }
                Some(uri) => {
                    let file = self.beside(uri)?;
                    // Naming one large file often must not take its size as often.
                    total += fs::metadata(&file).map_or(0, |metadata| metadata.len());
                    if total > MAX_FILE_BYTES {
                        let found = format!("buffers of {total} bytes");
                        return Err(too_large(self.path, found, MAX_FILE_BYTES));
                    }
                    read_file(&file)?
                }
                None => self.blob.take().ok_or_else(|| {
                    malformed(
                        self.path,
                        format!("buffer {index} has neither a URI nor a GLB chunk"),
                    )
                })?,
            };
            let expected = self.root.buffers[index].byte_length.0;
            if (bytes.len() as u64) < expected {
                let message =
                    format!("buffer {index} has {} bytes, expected {expected}", bytes.len());
                return Err(malformed(self.path, message));
            }
            buffers.push(bytes);
        }
        Ok(buffers)
    }

    /// All triangles, in the space of the scene.
    pub fn triangles(mut self) -> Result<TriangleMesh, AssetError> {
        let buffers = self.buffers()?;
        let source = Source { root: &self.root, buffers: &buffers };
        let mut gathered = Gathered::default();
        for (node, transform) in self.placed_nodes().map_err(|e| malformed(self.path, e))? {
            let Some(mesh) = self.root.nodes[node].mesh.map(|mesh| mesh.value()) else { continue };
            let found = self.root.meshes.get(mesh).ok_or_else(|| {
                malformed(
                    self.path,
                    format!("node {node} refers to mesh {mesh}, which does not exist"),
                )
            })?;
            for (index, primitive) in found.primitives.iter().enumerate() {
                gathered.add(&source, primitive, transform).map_err(|message| {
                    malformed(self.path, format!("mesh {mesh}, primitive {index}: {message}"))
                })?;
            }
        }
        Ok(gathered.finish())
    }

    /// Every node of the scene with its transform to the scene's space. Nodes form trees: one that
    /// is reached twice is an error, which also excludes cycles.
    fn placed_nodes(&self) -> Result<Vec<(usize, DAffine3)>, String> {
        let root = &self.root;
        let scene = root.scene.map_or(0, |scene| scene.value());
        let roots: Vec<usize> = match root.scenes.get(scene) {
            Some(scene) => scene.nodes.iter().map(Index::value).collect(),
            None if root.scene.is_some() => {
                return Err(format!("the default scene is {scene}, which does not exist"));
            }
            None => {
                let children = |node: &Node| node.children.clone().unwrap_or_default();
                let mut is_child = vec![false; root.nodes.len()];
                for child in root.nodes.iter().flat_map(children) {
                    if let Some(flag) = is_child.get_mut(child.value()) {
                        *flag = true;
                    }
                }
                (0..root.nodes.len()).filter(|&node| !is_child[node]).collect()
            }
        };
        let mut seen = vec![false; root.nodes.len()];
        let mut waiting: Vec<_> =
            roots.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
        let mut placed = Vec::new();
        while let Some((index, parent)) = waiting.pop() {
            let node =
                root.nodes.get(index).ok_or_else(|| format!("node {index} does not exist"))?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(format!("node {index} has two parents, or is its own ancestor"));
            }
            let transform = parent * local_transform(node);
            if !transform.is_finite() {
                return Err(format!("the transform of node {index} is not finite"));
            }
            placed.push((index, transform));
            let children = node.children.iter().flatten().rev();
            waiting.extend(children.map(|child| (child.value(), transform)));
        }
        Ok(placed)
    }
}

/// Splits a file into its JSON and the chunk of bytes that a `.glb` may carry.
fn split(bytes: &[u8]) -> Result<(Vec<u8>, Option<Vec<u8>>), String> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.to_vec(), None));
    }
    // The crate subtracts the header's 12 bytes from the length in the header unchecked.
    let length = bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    if length.is_none_or(|length| length < 12) {
        return Err("is cut off inside its header".to_owned());
    }
    let glb =
        Glb::from_slice(bytes).map_err(|error| format!("not a sound GLB container: {error}"))?;
    Ok((glb.json.into_owned(), glb.bin.map(Into::into)))
}

fn local_transform(node: &Node) -> DAffine3 {
    if let Some(matrix) = &node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from)));
    }
    let vector =
        |v: Option<[f32; 3]>, default| v.map_or(default, |v| DVec3::from(v.map(f64::from)));
    let rotation = node.rotation.as_ref().map_or(DQuat::IDENTITY, |q| {
        let q = DQuat::from_array(q.0.map(f64::from));
        // A zero quaternion has no direction; anything else is brought to unit length.
        if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
    });
    let (scale, translation) =
        (vector(node.scale, DVec3::ONE), vector(node.translation, DVec3::ZERO));
    DAffine3::from_scale_rotation_translation(scale, rotation, translation)
}

/// Decodes `%20` and its like; `None` when that is malformed or not text.
fn percent_decode(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, tail)) = rest.split_first() {
        if first == b'%' {
            let digits = std::str::from_utf8(tail.get(..2)?).ok()?;
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = &tail[2..];
        } else {
            bytes.push(first);
            rest = tail;
        }
    }
    // A zero byte would end the name early for the operating system.
    String::from_utf8(bytes).ok().filter(|name| !name.contains('\0'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::assets::{load_mesh, tidy};
    use glam::{Vec2, Vec3, Vec4};
    use serde_json::json;
    use std::borrow::Cow;

    fn glb(document: &Value, bytes: &[u8]) -> Vec<u8> {
        let header = gltf::binary::Header { magic: *b"glTF", version: 2, length: 0 };
        let json = Cow::from(document.to_string().into_bytes());
        Glb { header, json, bin: Some(Cow::from(bytes)) }.to_vec().unwrap()
    }

    fn floats(values: &[f32]) -> Vec<u8> {
        values.iter().flat_map(|v| v.to_le_bytes()).collect()
    }

    /// The unit square in xy as 4 corners: positions (48 bytes), then uvs (32), then 6 u16 indices
    /// (12), then 6 u8 indices.
    fn square() -> (Value, Vec<u8>) {
        let mut bytes = floats(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
        bytes.extend(floats(&[0., 1., 1., 1., 1., 0., 0., 0.]));
        bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
        bytes.extend([0_u8, 1, 3, 2, 0, 0]);
        let document = json!({
            "asset": {"version": "2.0"},
            "buffers": [{"byteLength": bytes.len()}],
            "bufferViews": [
                {"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32},
                {"buffer": 0, "byteOffset": 80, "byteLength": 12},
                {"buffer": 0, "byteOffset": 92, "byteLength": 6},
            ],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
                {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
                {"bufferView": 3, "componentType": 5121, "count": 4, "type": "SCALAR"},
            ],
            "meshes": [{"primitives": [{
                "attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2,
            }]}],
            "nodes": [{"mesh": 0}],
            "scenes": [{"nodes": [0]}],
            "scene": 0,
        });
        (document, bytes)
    }

    fn read(document: &Value, bytes: &[u8]) -> Result<TriangleMesh, AssetError> {
        let path = Path::new("m.glb");
        tidy::tidy(Asset::parse(&glb(document, bytes), path)?.triangles()?, path)
    }

    fn area_vector(mesh: &TriangleMesh) -> Vec3 {
        let vector = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            (b - a).cross(c - a) * 0.5
        };
        mesh.triangles.iter().map(vector).sum()
    }

    #[test]
    fn an_indexed_square_is_read_and_v_grows_upwards() {
        let (document, bytes) = square();
        let mesh = read(&document, &bytes).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert!(mesh.normals.is_empty());
        // In the file (0, 1) is the lower left corner; here it is (0, 0), like the position.
        let corners = mesh.positions.iter().map(|p| p.truncate());
        assert!(corners.eq(mesh.uvs.iter().copied()));
    }

    /// Strip 0 1 3 2 and fan 0 1 2 3 cover the same square as the list, with the same front.
    #[test]
    fn strips_and_fans_cover_what_a_list_covers() {
        let (mut document, bytes) = square();
        for (mode, indices) in [(5, json!(3)), (6, Value::Null), (4, json!(2))] {
            let primitive = &mut document["meshes"][0]["primitives"][0];
            primitive["mode"] = json!(mode);
            primitive["indices"] = indices;
            if primitive["indices"].is_null() {
                primitive.as_object_mut().unwrap().remove("indices");
            }
            let mesh = read(&document, &bytes).unwrap();
            assert_eq!((mesh.triangles.len(), area_vector(&mesh)), (2, Vec3::Z), "mode {mode}");
        }
    }

    #[test]
    fn points_and_lines_are_left_out() {
        let (mut document, bytes) = square();
        for mode in 0..4 {
            document["meshes"][0]["primitives"][0]["mode"] = json!(mode);
            assert!(read(&document, &bytes).unwrap_err().to_string().contains("no triangles"));
        }
    }

    /// Oracle: the area vector of the square, (0, 0, 1), turned and scaled by hand.
    #[test]
    fn transforms_of_parents_and_children_apply_and_mirrors_keep_the_front() {
        let (mut document, bytes) = square();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        document["nodes"] = json!([
            {"children": [1, 2], "translation": [10, 0, 0], "rotation": [half, 0, 0, half]},
            {"mesh": 0, "scale": [2, 3, 1]},
            {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 0, 1]},
        ]);
        let mesh = read(&document, &bytes).unwrap();
        assert_eq!(mesh.triangles.len(), 4);
        // The parent turns z to −y. Each square keeps its front, the mirrored one too.
        assert!(area_vector(&mesh).distance(Vec3::new(0.0, -7.0, 0.0)) < 1e-5);
        let at = |i: usize| mesh.positions[i];
        assert!(at(2).distance(Vec3::new(12.0, 0.0, 3.0)) < 1e-5, "{}", at(2));
        assert!(at(6).distance(Vec3::new(9.0, 0.0, 6.0)) < 1e-5, "{}", at(6));
    }

    /// Oracle: on the plane x + y + z = const the normal stays perpendicular under any scale.
    #[test]
    fn normals_stay_perpendicular_under_uneven_and_mirroring_scales() {
        let (mut document, _) = square();
        let n = 1.0 / 3.0_f32.sqrt();
        let bytes = floats(&[1., 0., 0., 0., 1., 0., 0., 0., 1., n, n, n, n, n, n, n, n, n]);
        document["buffers"] = json!([{"byteLength": 72}]);
        document["bufferViews"] = json!([
            {"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 36}]);
        document["accessors"] = json!([
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"}]);
        document["meshes"] =
            json!([{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}}]}]);
        for scale in [[1.0, 2.0, 5.0], [-1.0, 2.0, 5.0], [-0.1, -7.0, -3.0]] {
            document["nodes"][0]["scale"] = json!(scale);
            let mesh = read(&document, &bytes).unwrap();
            let face = area_vector(&mesh).normalize();
            for &normal in &mesh.normals {
                assert!(normal.distance(face) < 1e-6, "{normal} {face} at {scale:?}");
            }
        }
    }

    /// A sparse accessor without a view starts from zeros; interleaving and integers as well.
    #[test]
    fn sparse_interleaved_and_normalised_accessors_are_read() {
        let (mut document, mut bytes) = square();
        let start = bytes.len();
        bytes.extend([1, 2]);
        bytes.extend(floats(&[1., 0., 0., 0., 1., 0.]));
        bytes.extend([0_u8, 255, 9, 9, 255, 0, 9, 9, 51, 102]);
        document["buffers"][0]["byteLength"] = json!(bytes.len());
        document["bufferViews"] = json!([
            {"buffer": 0, "byteOffset": start, "byteLength": 2},
            {"buffer": 0, "byteOffset": start + 2, "byteLength": 24},
            {"buffer": 0, "byteOffset": start + 26, "byteLength": 10, "byteStride": 4}]);
        document["accessors"] = json!([
            {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": {"count": 2,
             "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 1}}},
            {"bufferView": 2, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC2"}]);
        document["meshes"] =
            json!([{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}]);
        let mesh = read(&document, &bytes).unwrap();
        assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
        let expected = [Vec2::new(0.0, 0.0), Vec2::new(1.0, 1.0), Vec2::new(0.2, 0.6)];
        assert!(mesh.uvs.iter().zip(expected).all(|(&found, e)| found.distance(e) < 1e-6));
    }

    /// Closed form: the tangents of a file go along with its node; a mirroring one turns their hand. Without normals they
    /// do not count.
    #[test]
    fn tangents_go_along_with_their_node() {
        let (mut document, mut bytes) = square();
        let start = bytes.len();
        bytes.extend(floats(&[0., 0., 1.].repeat(4)));
        bytes.extend(floats(&[0., 1., 0., -1.].repeat(4)));
        document["buffers"][0]["byteLength"] = json!(bytes.len());
        let views = document["bufferViews"].as_array_mut().unwrap();
        views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": 48}));
        views.push(json!({"buffer": 0, "byteOffset": start + 48, "byteLength": 64}));
        let accessors = document["accessors"].as_array_mut().unwrap();
        accessors.push(json!({"bufferView": 4, "componentType": 5126, "count": 4, "type": "VEC3"}));
        accessors.push(json!({"bufferView": 5, "componentType": 5126, "count": 4, "type": "VEC4"}));
        let attributes = "/meshes/0/primitives/0/attributes";
        document.pointer_mut(attributes).unwrap()["TANGENT"] = json!(5);
        assert!(read(&document, &bytes).unwrap().tangents.is_empty(), "there are no normals");
        document.pointer_mut(attributes).unwrap()["NORMAL"] = json!(4);
        for (scale, expected) in [
            (json!([1, 1, 1]), Vec4::new(0.0, 1.0, 0.0, -1.0)),
            (json!([3, 3, 3]), Vec4::new(0.0, 1.0, 0.0, -1.0)),
            (json!([-1, 1, 1]), Vec4::new(0.0, 1.0, 0.0, 1.0)),
            (json!([1, -2, 1]), Vec4::new(0.0, -1.0, 0.0, 1.0)),
        ] {
            document["nodes"][0]["scale"] = scale;
            assert_eq!(read(&document, &bytes).unwrap().tangents, [expected; 4]);
        }
        document["accessors"][5]["count"] = json!(3);
        let error = read(&document, &bytes).unwrap_err().to_string();
        assert!(error.contains("3 tangents for 4 positions"), "{error}");
    }

    #[test]
    fn what_lies_beyond_its_container_is_an_error() {
        let faults: [(&str, Value, &str); 12] = [
            ("/accessors/0/count", json!(5), "end beyond"),
            ("/accessors/0/count", json!(u64::MAX), "at most"),
            ("/accessors/0/bufferView", json!(9), "buffer view 9"),
            ("/accessors/0/type", json!("VEC2"), "expected Vec3"),
            ("/accessors/2/componentType", json!(5126), "unsigned indices"),
            ("/bufferViews/0/byteLength", json!(u64::MAX), "ends beyond"),
            ("/bufferViews/2/byteOffset", json!(u64::MAX), "ends beyond"),
            ("/buffers/0/byteLength", json!(1000), "expected 1000"),
            ("/nodes/0/mesh", json!(3), "mesh 3"),
            ("/scenes/0/nodes", json!([0, 0]), "two parents"),
            ("/scenes/0/nodes", json!([7]), "node 7"),
            ("/meshes/0/primitives/0/attributes/TEXCOORD_0", json!(0), "expected Vec2"),
        ];
        for (pointer, value, words) in faults {
            let (mut document, bytes) = square();
            if pointer.ends_with("byteOffset") {
                document["bufferViews"][2]["byteOffset"] = json!(0);
            }
            *document.pointer_mut(pointer).unwrap() = value;
            let error = read(&document, &bytes).unwrap_err().to_string();
            assert!(error.contains(words), "{pointer}: {error}");
        }
        let (mut document, bytes) = square();
        document["nodes"] = json!([{"children": [1]}, {"children": [0], "mesh": 0}]);
        assert!(read(&document, &bytes).unwrap_err().to_string().contains("own ancestor"));
        let (mut document, mut bytes) = square();
        bytes[92 - 2] = 4;
        assert!(read(&document, &bytes).unwrap_err().to_string().contains("index 4"));
        document["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
        assert!(read(&document, &bytes).unwrap_err().to_string().contains("draco"));
    }

    /// Foreign materials, animations and extensions do not matter for geometry.
    #[test]
    fn what_is_not_geometry_may_be_anything() {
        let (mut document, bytes) = square();
        document["animations"] = json!([{"channels": [{"target": {"path": "pointer"}}]}]);
        document["materials"] = json!("none");
        document["extensionsRequired"] = json!(["KHR_materials_volume"]);
        assert_eq!(read(&document, &bytes).unwrap().triangles.len(), 2);
    }

    #[test]
    fn buffers_come_from_beside_the_file_and_from_nowhere_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("square.gltf");
        let (mut document, bytes) = square();
        std::fs::create_dir(folder.path().join("my data")).unwrap();
        std::fs::write(folder.path().join("my data/b.bin"), &bytes).unwrap();
        document["buffers"][0]["uri"] = json!("my%20data/b.bin");
        std::fs::write(&path, document.to_string()).unwrap();
        assert_eq!(load_mesh(&path, &mut Vec::new()).unwrap().triangles.len(), 2);
        let absolute = folder.path().join("my data/b.bin").display().to_string();
        let hostile =
            ["../b.bin", "%2e%2e/b.bin", "a/../../b", "http://host/b", "", "%", "%00", &absolute];
        for uri in hostile {
            document["buffers"][0]["uri"] = json!(uri);
            std::fs::write(&path, document.to_string()).unwrap();
            let error = load_mesh(&path, &mut Vec::new()).unwrap_err();
            assert!(matches!(error, AssetError::OutsideFile { .. }), "{uri}: {error}");
        }
        document["buffers"][0]["uri"] = json!("absent.bin");
        std::fs::write(&path, document.to_string()).unwrap();
        assert!(load_mesh(&path, &mut Vec::new()).unwrap_err().to_string().contains("absent.bin"));
        document["buffers"][0]["uri"] = json!("data:application/octet-stream;base64,AAAA");
        std::fs::write(&path, document.to_string()).unwrap();
        assert!(load_mesh(&path, &mut Vec::new()).unwrap_err().to_string().contains("expected 98"));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_that_leads_out_of_the_folder_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("inside");
        std::fs::create_dir(&inside).unwrap();
        let (mut document, bytes) = square();
        std::fs::write(folder.path().join("secret.bin"), &bytes).unwrap();
        std::os::unix::fs::symlink(folder.path().join("secret.bin"), inside.join("b.bin")).unwrap();
        document["buffers"][0]["uri"] = json!("b.bin");
        let path = inside.join("square.gltf");
        std::fs::write(&path, document.to_string()).unwrap();
        assert!(matches!(
            load_mesh(&path, &mut Vec::new()).unwrap_err(),
            AssetError::OutsideFile { .. }
        ));
    }

    /// Whatever the bytes: an error or a sound mesh.
    #[test]
    fn cut_and_mutated_files_never_panic() {
        let (document, bytes) = square();
        let whole = glb(&document, &bytes);
        let path = Path::new("m.glb");
        let attempt = |bytes: &[u8]| {
            Asset::parse(bytes, path).and_then(Asset::triangles).and_then(|m| tidy::tidy(m, path))
        };
        assert!(attempt(&whole).is_ok());
        for at in 0..whole.len() {
            assert!(at == 0 || attempt(&whole[..at]).is_err(), "cut at {at}");
            for byte in [0, 1, b'0', b'9', b'-', b'e', b'"', b',', 0x7f, 0xff] {
                let mut mutant = whole.clone();
                mutant[at] = byte;
                let _ = attempt(&mutant);
            }
        }
    }
}
