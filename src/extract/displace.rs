//! Meshes moved along their normals by a texture.

use super::{SurfaceSlots, Surfaces};
use crate::description::TriangleMesh;
use crate::description::modelling::{Weld, smooth_normals};
use crate::math::Aabb;
use crate::shade::{TexturePoint, Textures};
use crate::world::{Displacement, Mesh};
use bevy_ecs::prelude::*;
use glam::{DVec3, Vec2};
use rayon::prelude::*;
use std::sync::Arc;

/// A mesh as its [`Displacement`] leaves it.
#[derive(Component, Clone, Debug)]
pub struct Displaced {
    /// The mesh; the one at rest where the texture does not exist.
    pub mesh: Arc<TriangleMesh>,
    /// The box around it.
    pub bounds: Aabb,
}

/// Displaces meshes anew whose form, displacement or texture has changed.
///
/// Textures are looked at in the space of the mesh.
pub fn displace_meshes(
    mut meshes: Query<(Entity, Ref<Mesh>, Ref<Displacement>, Option<&mut Displaced>)>,
    surfaces: Res<Surfaces>,
    slots: Res<SurfaceSlots>,
    mut commands: Commands,
) {
    for (entity, mesh, displacement, displaced) in &mut meshes {
        let changed = mesh.is_changed() || displacement.is_changed() || surfaces.is_changed();
        if !changed && displaced.is_some() {
            continue;
        }
        let texture = slots.textures.get(&displacement.height);
        let data = match texture {
            Some(&texture) => {
                let textures = surfaces.materials.textures();
                Arc::new(moved(mesh.data(), textures, texture, &displacement))
            }
            None => mesh.data().clone(),
        };
        match displaced {
            // What is the same is not built again.
            Some(before) if before.mesh == data => {}
            _ => {
                let bounds = Aabb::from_points(data.positions.iter().copied());
                commands.entity(entity).insert(Displaced { mesh: data, bounds });
            }
        }
    }
}

/// The mesh with each place moved along its normal. What lies at the same place moves together, by the mean of what the
/// texture says of its vertices, so that seams of uv do not tear.
fn moved(
    mesh: &TriangleMesh,
    textures: &Textures,
    texture: u32,
    displacement: &Displacement,
) -> TriangleMesh {
    let weld = Weld::new(mesh);
    let faces = smooth_normals(mesh, &weld);
    let heights: Vec<f32> = (0..mesh.positions.len())
        .into_par_iter()
        .map(|k| {
            let at = TexturePoint {
                p: mesh.positions[k].as_dvec3(),
                n: faces[k],
                color: mesh.colors.get(k).copied().unwrap_or(glam::Vec3::ONE),
                ..TexturePoint::at(mesh.uvs.get(k).copied().unwrap_or(Vec2::ZERO))
            };
            textures.scalar(texture, &at)
        })
        .collect();
    let normals = if mesh.normals.is_empty() { &faces } else { &mesh.normals };
    let mut sums = vec![(0.0_f64, DVec3::ZERO, 0.0_f64); weld.count];
    for (k, &place) in weld.place.iter().enumerate() {
        let (height, normal, count) = &mut sums[place as usize];
        *height += f64::from(heights[k]);
        *normal += normals[k].as_dvec3();
        *count += 1.0;
    }
    let mut moved = mesh.clone();
    for (p, &place) in moved.positions.iter_mut().zip(&weld.place) {
        let (height, normal, count) = sums[place as usize];
        let by =
            (height / count - f64::from(displacement.middle)) * f64::from(displacement.strength);
        *p = (p.as_dvec3() + normal.normalize_or_zero() * by).as_vec3();
    }
    moved.normals = smooth_normals(&moved, &weld);
    // Those given belong to the surface at rest.
    moved.tangents = Vec::new();
    moved
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::modelling::solids::{octahedron, volume};
    use crate::description::modelling::{Subdivision, grid, subdivided};
    use crate::description::{Texture, TextureFiltering, Value};
    use crate::shade::Pyramids;
    use glam::{DVec2, Vec3};

    fn ramp() -> Textures {
        let [a, b] = [0.0, 1.0].map(|v| Value::Constant(Vec3::splat(v)));
        Textures::new(
            vec![Texture::Gradient { a, b }],
            TextureFiltering::Point,
            &Pyramids::default(),
        )
    }

    fn by(strength: f32, middle: f32) -> Displacement {
        Displacement { height: Entity::PLACEHOLDER, strength, middle }
    }

    /// Closed form: a square raised by a ramp is a plane at an angle.
    #[test]
    fn a_ramp_makes_a_slope() {
        let mesh = grid(DVec2::new(2.0, 1.0), (7, 3));
        let slope = moved(&mesh, &ramp(), 0, &by(0.5, 0.5));
        for ((p, uv), n) in slope.positions.iter().zip(&mesh.uvs).zip(&slope.normals) {
            assert!((p.z - 0.5 * (uv.x - 0.5)).abs() < 1e-6);
            assert!((*n - Vec3::new(-0.25, 0.0, 1.0).normalize()).length() < 1e-5, "{n}");
        }
    }

    /// Closed form: a sphere raised evenly by h has the volume of one of radius 1 + h, and no edge opens: every
    /// edge has two triangles by its places.
    #[test]
    fn an_even_height_makes_a_larger_sphere() {
        let mut sphere = subdivided(&octahedron(), 5, Subdivision::Flat);
        for p in &mut sphere.positions {
            *p = p.normalize();
        }
        sphere.normals.clone_from(&sphere.positions);
        // Every second triangle has vertices of its own, of which the texture says another height.
        sphere.uvs = sphere.positions.iter().map(|p| Vec2::splat(p.x)).collect();
        for k in (0..sphere.triangles.len()).step_by(2) {
            for corner in 0..3 {
                let vertex = sphere.triangles[k][corner] as usize;
                sphere.triangles[k][corner] = sphere.positions.len() as u32;
                sphere.positions.push(sphere.positions[vertex]);
                sphere.normals.push(sphere.normals[vertex]);
                sphere.uvs.push(sphere.uvs[vertex] + 0.3);
            }
        }
        let one = Value::Constant(Vec3::ONE);
        let even = vec![Texture::Gradient { a: one, b: one }];
        let even = Textures::new(even, TextureFiltering::Point, &Pyramids::default());
        let raised = moved(&sphere, &even, 0, &by(0.25, 0.0));
        let ratio = volume(&raised) / volume(&sphere);
        assert!((ratio - 1.25_f64.powi(3)).abs() < 1e-4, "{ratio}");
        let uneven = moved(&sphere, &ramp(), 0, &by(0.25, 0.0));
        assert_eq!(Weld::new(&uneven).count, Weld::new(&sphere).count, "nothing tears");
    }
}
