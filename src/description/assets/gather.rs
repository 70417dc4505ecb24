//! Gathers the triangles of glTF primitives in one mesh, each brought to the space of the scene.

use super::MAX_MESH_ELEMENTS;
use super::accessor::Source;
use crate::description::{Rgb, TriangleMesh};
use crate::memory::ask;
use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};
use gltf::json::Index;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;

/// Place, normal, coordinates, tangent and colour, and three indices.
const VERTEX_BYTES: usize = 60;
const TRIANGLE_BYTES: usize = 12;

/// The mesh so far.
#[derive(Default)]
pub(super) struct Gathered {
    mesh: TriangleMesh,
    any_uv: bool,
    any_normal: bool,
    any_color: bool,
}

impl Gathered {
    /// Adds the triangles of a primitive; points and lines have none.
    pub(super) fn add(
        &mut self,
        source: &Source,
        primitive: &Primitive,
        transform: DAffine3,
    ) -> Result<(), String> {
        let Checked::Valid(mode) = primitive.mode else { return Err("unknown mode".to_owned()) };
        if matches!(mode, Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            return Ok(());
        }
        let attribute =
            |semantic| primitive.attributes.get(&Checked::Valid(semantic)).map(Index::value);
        // Without positions there is nothing to draw (specification, section 3.7.2.1).
        let Some(positions) = attribute(Semantic::Positions) else { return Ok(()) };
        let positions = source.vectors::<3>(positions)?;
        let count = positions.len();
        let normals = optional::<3>(source, attribute(Semantic::Normals), count, "normals")?;
        let uvs =
            optional::<2>(source, attribute(Semantic::TexCoords(0)), count, "texture coordinates")?;
        // Without normals they must be ignored (specification, section 3.7.2.1).
        let tangents = attribute(Semantic::Tangents).filter(|_| normals.is_some());
        let tangents = optional::<4>(source, tangents, count, "tangents")?;
        let colors = match attribute(Semantic::Colors(0)) {
            Some(colors) => Some(source.colors(colors)?).filter(|colors| colors.len() == count),
            None => None,
        };
        let indices = if let Some(indices) = primitive.indices {
            source.indices(indices.value())?
        } else {
            ask(4 * count as u64).map_err(|shortage| format!("its indices: {shortage}"))?;
            (0..count as u32).collect()
        };
        if let Some(index) = indices.iter().find(|&&index| index as usize >= count) {
            return Err(format!("index {index} is beyond its {count} vertices"));
        }
        let first = self.mesh.positions.len();
        if first + count > MAX_MESH_ELEMENTS
            || self.mesh.triangles.len() + indices.len() > MAX_MESH_ELEMENTS
        {
            return Err(format!(
                "the asset has more than {MAX_MESH_ELEMENTS} vertices or triangles"
            ));
        }
        // All of it grows at once, and while a list grows its old place is still there.
        let bytes =
            2 * (self.mesh.memory() + count * VERTEX_BYTES + indices.len() * TRIANGLE_BYTES);
        ask(bytes as u64).map_err(|shortage| format!("its mesh: {shortage}"))?;
        self.any_uv |= uvs.is_some();
        self.any_normal |= normals.is_some();
        self.any_color |= colors.is_some();
        let place =
            |p: &[f32; 3]| transform.transform_point3(DVec3::from(p.map(f64::from))).as_vec3();
        self.mesh.positions.extend(positions.iter().map(place));
        let turn = normal_matrix(transform.matrix3);
        let orient =
            |n: [f32; 3]| (turn * DVec3::from(n.map(f64::from))).normalize_or_zero().as_vec3();
        extend(&mut self.mesh.normals, normals, count, orient, Vec3::ZERO);
        // glTF counts v downwards.
        extend(&mut self.mesh.uvs, uvs, count, |[u, v]| Vec2::new(u, 1.0 - v), Vec2::ZERO);
        let mirrored = transform.matrix3.determinant() < 0.0;
        let along = |[x, y, z, sign]: [f32; 4]| {
            let tangent = transform.transform_vector3(DVec3::new(x.into(), y.into(), z.into()));
            // A mirror turns the hand of the three axes.
            let sign = if (sign < 0.0) == mirrored { 1.0 } else { -1.0 };
            match tangent.try_normalize() {
                Some(tangent) if tangent.is_finite() => tangent.as_vec3().extend(sign),
                _ => Vec4::ZERO,
            }
        };
        extend(&mut self.mesh.tangents, tangents, count, along, Vec4::ZERO);
        extend(&mut self.mesh.colors, colors, count, Rgb::from_array, Rgb::ONE);
        let offset = first as u32;
        self.mesh.triangles.extend(assemble(&indices, mode).map(|[a, b, c]| {
            // A mirror turns fronts into backs; going round the other way turns them again.
            let [b, c] = if mirrored { [c, b] } else { [b, c] };
            [a, b, c].map(|i| i + offset)
        }));
        Ok(())
    }

    pub(super) fn finish(mut self) -> TriangleMesh {
        if !self.any_uv {
            self.mesh.uvs = Vec::new();
        }
        if !self.any_normal {
            self.mesh.normals = Vec::new();
        }
        if self.mesh.tangents.iter().all(|tangent| tangent.w == 0.0) {
            self.mesh.tangents = Vec::new();
        }
        if !self.any_color {
            self.mesh.colors = Vec::new();
        }
        self.mesh
    }
}

fn optional<const N: usize>(
    source: &Source,
    accessor: Option<usize>,
    count: usize,
    what: &str,
) -> Result<Option<Vec<[f32; N]>>, String> {
    let Some(accessor) = accessor else { return Ok(None) };
    let values = source.vectors::<N>(accessor)?;
    if values.len() == count {
        Ok(Some(values))
    } else {
        Err(format!("has {} {what} for {count} positions", values.len()))
    }
}

fn extend<T, V: Copy>(
    all: &mut Vec<V>,
    values: Option<Vec<T>>,
    count: usize,
    convert: impl Fn(T) -> V,
    missing: V,
) {
    match values {
        Some(values) => all.extend(values.into_iter().map(convert)),
        None => all.extend(std::iter::repeat_n(missing, count)),
    }
}

/// Takes normals along with points: the inverse transpose up to a positive factor. It is the matrix
/// of cofactors with the sign of the determinant, and so exists for a flattened mesh as well.
fn normal_matrix(m: DMat3) -> DMat3 {
    let cofactors = DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    );
    if m.determinant() < 0.0 { -1.0 * cofactors } else { cofactors }
}

/// Triples of indices by the primitive's mode (specification, section 3.7.2.1).
fn assemble(indices: &[u32], mode: Mode) -> Box<dyn Iterator<Item = [u32; 3]> + '_> {
    match mode {
        Mode::TriangleStrip => Box::new(indices.windows(3).enumerate().map(|(i, w)| {
            // Every second triangle of a strip goes round the other way.
            if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] }
        })),
        Mode::TriangleFan => {
            Box::new(indices.windows(2).skip(1).map(move |w| [w[0], w[1], indices[0]]))
        }
        _ => Box::new(indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]])),
    }
}
