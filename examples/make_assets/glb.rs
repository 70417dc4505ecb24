//! Meshes as binary glTF 2.0, as small as single precision and 16-bit indices allow.

use glam::DVec3;

/// A mesh with a normal at every vertex, metres.
#[derive(Clone, Default)]
pub struct Mesh {
    pub positions: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The file: a header, a chunk of JSON, a chunk of indices, positions and normals.
    pub fn to_glb(&self) -> Vec<u8> {
        let mut data = Vec::new();
        let short = self.positions.len() <= 1 << 16;
        for index in self.triangles.as_flattened() {
            if short {
                data.extend((*index as u16).to_le_bytes());
            } else {
                data.extend(index.to_le_bytes());
            }
        }
        let indices = data.len();
        data.resize(indices.next_multiple_of(4), 0);
        let start = data.len();
        for vector in self.positions.iter().chain(&self.normals) {
            data.extend(vector.as_vec3().to_array().iter().flat_map(|c| c.to_le_bytes()));
        }
        let mut json = self.json(short, indices, start, data.len()).into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let length = 12 + 8 + json.len() + 8 + data.len();
        let mut file = b"glTF".to_vec();
        file.extend([2, length as u32].iter().flat_map(|word: &u32| word.to_le_bytes()));
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &data)] {
            file.extend((chunk.len() as u32).to_le_bytes());
            file.extend(kind);
            file.extend(chunk);
        }
        file
    }

    fn json(&self, short: bool, indices: usize, start: usize, total: usize) -> String {
        let (vertices, corners) = (self.positions.len(), 3 * self.triangles.len());
        let each = (total - start) / 2;
        let normals = start + each;
        let component = if short { 5123 } else { 5125 };
        let first = self.positions[0].as_vec3();
        let (min, max) = self
            .positions
            .iter()
            .map(|p| p.as_vec3())
            .fold((first, first), |(min, max), p| (min.min(p), max.max(p)));
        let (min, max) = (min.to_array(), max.to_array());
        format!(
            r#"{{"asset":{{"version":"2.0","generator":"make_assets"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"indices":0,"attributes":{{"POSITION":1,"NORMAL":2}}}}]}}],"buffers":[{{"byteLength":{total}}}],"bufferViews":[{{"buffer":0,"byteLength":{indices},"target":34963}},{{"buffer":0,"byteOffset":{start},"byteLength":{each},"target":34962}},{{"buffer":0,"byteOffset":{normals},"byteLength":{each},"target":34962}}],"accessors":[{{"bufferView":0,"componentType":{component},"count":{corners},"type":"SCALAR"}},{{"bufferView":1,"componentType":5126,"count":{vertices},"type":"VEC3","min":{min:?},"max":{max:?}}},{{"bufferView":2,"componentType":5126,"count":{vertices},"type":"VEC3"}}]}}"#
        )
    }
}
