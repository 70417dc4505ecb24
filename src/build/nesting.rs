//! Solids which may overlap: what a ray meets at their surfaces, and what it begins in.
//!
//! [`SolidStack`] has the rule of what is where. Here the surfaces come in.
//!
//! # Surfaces at the same place
//! Water fills a glass to its wall: two surfaces at one place, which rounding puts into any order, and of
//! which the next ray, beginning beyond the rounding bound of the one it met, may miss the other. So
//! where a ray meets a solid, the surfaces of all others which lie within the bound are met with it: those
//! between the origins of rays which leave on the one and on the other side. The ray passes all of them
//! or none. The bound is that of the point four times: the other surface has one of its own, and either
//! has corners which were rounded when they were written down.
//!
//! # Where a ray begins
//! A solid is around a point if a ray straight up from there leaves it before it enters it. That is also
//! right for water whose only surface is that on top, if nothing else lies between. Where a shape is closed
//! whatever its measures are, the ray that begins there is asked instead: on the border itself, where the point
//! is neither inside nor outside, the ray is in what it goes through first.
//!
//! # Solids of several meshes
//! A bottle may be made of a body and a neck, each with a border. Open meshes of one material whose boxes overlap are one
//! solid, which may be entered through the one and left through the other.

use super::bvh::{Hit, MeshTree, MeshTrees, SceneGeometry, SurfacePoint};
use super::density::Densities;
use crate::color::wavelength::{self, DrawnWavelength};
use crate::description::{Rgb, TriangleMesh};
use crate::extract::{Geometry, Instance, Instances, NOTHING, Surfaces, overlapping_pairs, solids};
use crate::math::{Aabb, Ray, offset_ray_origin};
use crate::sampling::Sampler;
use crate::shade::MaterialTable;
use crate::shade::medium::Passage;
use crate::shade::nesting::{Inside, NestingFaults, Solid, SolidStack};
use bevy_ecs::prelude::*;
use glam::Vec3;
use std::collections::HashMap;
use std::sync::Arc;

/// How much wider than the rounding bound of a point other surfaces count as being at the same place.
const SAME_PLACE: f64 = 4.0;
/// Surfaces of other solids which can lie at the same place.
const MOST_AT_ONCE: usize = 7;

/// All solids of a frame, where the scene requires that they nest.
#[derive(Resource, Clone, Debug, Default)]
pub struct Solids {
    list: Vec<Entry>,
    /// For each instance its place in the list, or [`NOTHING`].
    places: Vec<u32>,
    /// Places of those which overlap an entry, entry by entry.
    neighbours: Vec<u32>,
    /// Of the meshes for which it mattered, whether they are open.
    open: KnownMeshes,
}

/// Meshes with something that is known of them.
type KnownMeshes = Vec<(Arc<TriangleMesh>, bool)>;

#[derive(Clone, Debug)]
struct Entry {
    /// The instance whose surface it is.
    instance: u32,
    /// What it encloses, with others perhaps: the solid has the index of the first of them.
    solid: Solid,
    bounds: Aabb,
    is_mesh: bool,
    /// Whether it is a shape which is always closed.
    is_closed: bool,
    /// Whether it is thinner than what rays which leave its surface are rounded to.
    is_thin: bool,
    /// The tree of a mesh which has none of its own, being in that of the resting meshes.
    tree: Option<Arc<MeshTree>>,
    /// First and last of its neighbours.
    neighbours: (u32, u32),
}

/// What a ray has met, when the solids around it are taken into account.
#[derive(Clone, Copy, Debug)]
pub enum Meeting<I> {
    /// A surface inside a solid of higher priority: the ray goes straight on from here.
    Nothing {
        /// Where it goes on.
        surface: SurfacePoint,
        /// What is beyond.
        beyond: I,
    },
    /// A surface.
    Surface {
        /// The hit which counts.
        hit: Hit,
        /// The surface there.
        surface: SurfacePoint,
        /// What is beyond.
        beyond: I,
        /// Material on the outside of the surface; `None` is air.
        outside: Option<u32>,
    },
}

/// A surface which is crossed.
#[derive(Clone, Copy)]
struct Crossing {
    hit: Hit,
    surface: SurfacePoint,
    solid: Solid,
    entering: bool,
}

/// The scene as rays see it which know what they are inside of.
#[derive(Clone, Copy, Debug)]
pub struct NestedGeometry<'a> {
    /// What rays meet.
    pub geometry: SceneGeometry<'a>,
    /// What it is made of.
    pub materials: &'a MaterialTable,
    /// Which solids may overlap.
    pub solids: &'a Solids,
    /// Those of uneven density.
    pub densities: &'a Densities,
}

impl<'a> NestedGeometry<'a> {
    /// The way of a ray through the medium that it is in; `None` where its density is even.
    #[inline]
    pub fn passage<I: Inside>(&self, inside: &I, ray: &Ray) -> Option<Passage<'a>> {
        let index = inside.stack()?.first()?.instance;
        let instance = &self.geometry.instances[index as usize];
        self.densities.passage((index, instance), self.materials.textures(), ray)
    }
}

impl NestedGeometry<'_> {
    /// What a ray meets at a hit, when it has come there inside `inside`. If it turns out that it must have
    /// been inside something else, that is put right, so that a ray which is reflected knows it as well.
    #[inline]
    pub fn meet<I: Inside>(
        &self,
        ray: &Ray,
        hit: Hit,
        inside: &mut I,
        faults: &mut NestingFaults,
    ) -> Meeting<I> {
        let surface = self.geometry.surface(ray, &hit);
        let plain = |beyond| Meeting::Surface { hit, surface, beyond, outside: None };
        if !I::ABSORBS {
            return plain(*inside);
        }
        if inside.stack().is_some() {
            return match self.solids.places.get(hit.instance as usize) {
                Some(&place) if place != NOTHING => {
                    let (before, meeting) =
                        self.meet_solid(ray, place, hit, surface, inside, faults);
                    *inside = inside.within(&before);
                    meeting
                }
                _ => plain(*inside),
            };
        }
        let material = self.geometry.instances[hit.instance as usize].material;
        if material == NOTHING || !self.materials.is_dielectric(material) {
            return plain(*inside);
        }
        plain(inside.beyond(material, ray.d.dot(surface.ng) < 0.0))
    }

    /// The same at a solid, with all surfaces that lie there, and what the ray has been inside of.
    fn meet_solid<I: Inside>(
        &self,
        ray: &Ray,
        place: u32,
        hit: Hit,
        surface: SurfacePoint,
        inside: &I,
        faults: &mut NestingFaults,
    ) -> (SolidStack, Meeting<I>) {
        let stack = inside.stack().copied().unwrap_or_default();
        let entry = &self.solids.list[place as usize];
        let entering = ray.d.dot(surface.ng) < 0.0;
        let mut crossings =
            [Crossing { hit, surface, solid: entry.solid, entering }; 1 + MOST_AT_ONCE];
        let count = self.find_others(entry, ray, &mut crossings);
        let crossings = &crossings[..count];
        let (mut before, mut beyond) = (stack, stack);
        for crossing in crossings {
            let Crossing { solid, entering, hit, .. } = crossing;
            let room = if *entering {
                beyond.enter(*solid)
            } else if beyond.leave(solid.instance) {
                true
            } else {
                // It must have been inside: from now on it was.
                if !self.has_holes(hit) {
                    faults.add(solid.instance, stack.first().map(|first| first.instance));
                }
                before.enter(*solid)
            };
            faults.forgotten += u64::from(!room);
        }
        let owner = match (before.first(), beyond.first()) {
            (Some(a), Some(b)) if a.instance == b.instance => None,
            (Some(a), Some(b)) if a.outranks(b) => Some((a, Some(b))),
            (Some(a), Some(b)) => Some((b, Some(a))),
            (Some(a), None) | (None, Some(a)) => Some((a, None)),
            (None, None) => None,
        };
        let owner = owner.and_then(|(owner, outside)| {
            let crossing = crossings.iter().find(|c| c.solid.instance == owner.instance)?;
            Some((crossing, outside.map(|solid| solid.material)))
        });
        let beyond = inside.within(&beyond);
        let is_seen = |(crossing, outside): &(&Crossing, Option<u32>)| {
            !(I::SCATTERS && self.materials.is_invisible(crossing.solid.material, *outside))
        };
        let meeting = match owner.filter(is_seen) {
            Some((&Crossing { hit, surface, .. }, outside)) => {
                Meeting::Surface { hit, surface, beyond, outside }
            }
            None => Meeting::Nothing { surface: crossings[0].surface, beyond },
        };
        (before, meeting)
    }

    /// Finds the surfaces of other solids at the place of the first crossing, and widens the bounds of all
    /// so that rays leave them together. Returns how many there are with the first.
    fn find_others(
        &self,
        entry: &Entry,
        ray: &Ray,
        crossings: &mut [Crossing; 1 + MOST_AT_ONCE],
    ) -> usize {
        let (first, last) = entry.neighbours;
        if first == last && !entry.is_thin {
            return 1;
        }
        let surface = &mut crossings[0].surface;
        surface.p_error *= SAME_PLACE;
        let SurfacePoint { p, p_error, ng, .. } = *surface;
        let (near, far) =
            (offset_ray_origin(p, p_error, ng, -ray.d), offset_ray_origin(p, p_error, ng, ray.d));
        let probe = Ray { o: near, d: far - near, time: ray.time };
        let ends = Aabb::from_points([near, far]);
        let mut count = 1;
        if entry.is_thin && crossings[0].entering {
            // Seen from beyond, the far side is what is met first.
            let back = Ray { o: far, d: near - far, time: ray.time };
            if let Some(hit) = self.hit(entry, &back, 1.0) {
                let mut surface = self.geometry.surface(&back, &hit);
                if back.d.dot(surface.ng) < 0.0 {
                    surface.p_error += p_error + (surface.p - p).abs();
                    let solid = entry.solid;
                    crossings[count] = Crossing { hit, surface, solid, entering: false };
                    count += 1;
                }
            }
        }
        for &other in &self.solids.neighbours[first as usize..last as usize] {
            let other = &self.solids.list[other as usize];
            let apart = !crate::extract::overlap(&other.bounds, &ends);
            // At the seam of two parts of a solid it is crossed once.
            let same = other.solid.instance == entry.solid.instance;
            if count > MOST_AT_ONCE || apart || same {
                continue;
            }
            let Some(hit) = self.hit(other, &probe, 1.0) else { continue };
            let mut surface = self.geometry.surface(&probe, &hit);
            let entering = probe.d.dot(surface.ng) < 0.0;
            // Whoever leaves from here leaves the first surface as well.
            surface.p_error += p_error + (surface.p - p).abs();
            crossings[count] = Crossing { hit, surface, solid: other.solid, entering };
            count += 1;
        }
        count
    }

    /// The nearest hit of one solid.
    fn hit(&self, entry: &Entry, ray: &Ray, t_max: f64) -> Option<Hit> {
        self.geometry.hit_of(entry.instance, entry.tree.as_deref(), ray, t_max)
    }

    fn has_holes(&self, hit: &Hit) -> bool {
        self.materials.has_opacity(self.geometry.instances[hit.instance as usize].material)
    }

    /// Draws the wavelength of a path where it first meets a surface at which the wavelength matters: of a material, with
    /// what is on its outside. Returns what the path then counts; the path is told on both sides.
    #[inline]
    pub fn disperse<I: Inside>(
        &self,
        (material, outside): (u32, Option<u32>),
        [here, beyond]: [&mut I; 2],
        sampler: &Sampler,
        dimension: u32,
    ) -> Rgb {
        if !I::DISPERSES || material == NOTHING || here.wavelength().is_some() {
            return Rgb::ONE;
        }
        let disperses = |material| self.materials.disperses(material);
        if !(disperses(material) || outside.is_some_and(disperses)) {
            return Rgb::ONE;
        }
        let u = sampler.one(dimension);
        let DrawnWavelength { nm, weight } = match self.materials.wavelengths() {
            None => wavelength::draw(u),
            Some(set) => set.draw(u),
        };
        (*here, *beyond) = (here.tuned(nm), beyond.tuned(nm));
        weight
    }

    /// The solids around a point, in whatever direction rays begin there; `None` where that matters.
    pub fn all_around(&self, p: Vec3, time: f32) -> Option<SolidStack> {
        // Along no face or axis that a scene is likely to have.
        let d = Vec3::new(0.36, 0.48, 0.8);
        let [one, other] = [d, -d].map(|d| self.around(&Ray { o: p, d, time }));
        (one == other).then_some(one)
    }

    /// The solids around the point where a ray begins.
    pub fn around(&self, ray: &Ray) -> SolidStack {
        let mut stack = SolidStack::default();
        let p = ray.o;
        let up = Ray { d: Vec3::Y, ..*ray };
        for entry in &self.solids.list {
            let closed = entry.bounds.contains(p);
            let below = entry.is_mesh && {
                let Aabb { min, max } = entry.bounds;
                (min.x..=max.x).contains(&p.x) && (min.z..=max.z).contains(&p.z) && p.y <= max.y
            };
            if !(closed || below) {
                continue;
            }
            let way = if entry.is_closed { ray } else { &up };
            let leaves = |hit: &Hit| self.geometry.surface(way, hit).ng.dot(way.d) > 0.0;
            let Some(hit) = self.hit(entry, way, f64::INFINITY).filter(leaves) else { continue };
            let first = || self.geometry.closest_hit(way, hit.t.next_up(), false);
            if closed || first().is_none_or(|first| first.instance == hit.instance) {
                // Without room it is the lowest in rank that is not known of.
                stack.enter(entry.solid);
            }
        }
        stack
    }

    /// A ray went off to infinity, which it cannot do inside a solid that has an end.
    pub fn escape<I: Inside>(&self, inside: &I, faults: &mut NestingFaults) {
        let Some(stack) = inside.stack() else { return };
        let ends = |solid: &&Solid| {
            let place = self.solids.places[solid.instance as usize];
            self.solids.list[place as usize].bounds.min.is_finite()
        };
        if let Some(solid) = stack.solids().iter().rev().find(ends) {
            faults.add(solid.instance, stack.first().map(|first| first.instance));
        }
    }
}

/// Whether a shape is so thin that a ray which begins on one side of it, rounded to `f32`, may be on the other.
fn is_thin(instance: &Instance) -> bool {
    /// Units in the last place of a coordinate that the beginning of a ray is off by.
    const ROUNDED: f64 = 64.0;
    if matches!(instance.geometry, Geometry::Mesh(_)) || !instance.bounds.min.is_finite() {
        return false;
    }
    let forward = instance.motion.at(0.0).matrix3;
    // From side to side, as far as the plane of the other two axes is away.
    let volume = forward.determinant().abs();
    let [x, y, z] = [forward.x_axis, forward.y_axis, forward.z_axis];
    let widest = x.cross(y).length().max(y.cross(z).length()).max(z.cross(x).length());
    let spacing = f64::from(instance.bounds.reach()) * f64::from(f32::EPSILON);
    volume / widest < ROUNDED * spacing
}

/// Finds which open meshes enclose a solid together.
struct OpenMeshes<'a> {
    instances: &'a [Instance],
    meshes: &'a [Arc<MeshTree>],
    before: &'a KnownMeshes,
}

impl OpenMeshes<'_> {
    /// Makes one solid of open meshes of one material whose boxes overlap, those of `pairs` of places: the one with the
    /// lowest index. Where such meshes do not close each other nothing is lost by that, since a solid can be entered twice.
    fn unite(&self, list: &mut [Entry], pairs: &[(u32, u32)]) -> KnownMeshes {
        let mut known = KnownMeshes::new();
        // The lower place comes first in a pair, and has the lowest place of its solid when its turn comes.
        for &(a, b) in pairs.iter().filter(|(a, b)| a < b) {
            let (first, second) = (&list[a as usize], &list[b as usize]);
            let same = first.solid.material == second.solid.material;
            if same && [first, second].iter().all(|entry| self.is_open(entry, &mut known)) {
                let (from, to) = (second.solid.instance, first.solid.instance);
                let (lowest, other) = (from.min(to), from.max(to));
                let members = list.iter_mut().filter(|entry| entry.solid.instance == other);
                members.for_each(|entry| entry.solid.instance = lowest);
            }
        }
        known
    }

    fn is_open(&self, entry: &Entry, known: &mut KnownMeshes) -> bool {
        let Geometry::Mesh(mesh) = &self.instances[entry.instance as usize].geometry else {
            return false;
        };
        let mesh = &self.meshes[*mesh as usize].mesh;
        let find = |list: &KnownMeshes| {
            list.iter().find(|(other, _)| Arc::ptr_eq(other, mesh)).map(|(_, open)| *open)
        };
        if let Some(open) = find(known) {
            return open;
        }
        let open = find(self.before).unwrap_or_else(|| has_border(mesh));
        known.push((mesh.clone(), open));
        open
    }
}

/// Whether a mesh has an edge that is not met by another of the opposite direction. Corners at one place are one corner.
fn has_border(mesh: &TriangleMesh) -> bool {
    // −0 and 0 are one place.
    let place = |corner: u32| (mesh.positions[corner as usize] + 0.0).to_array().map(f32::to_bits);
    let mut balance: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    for [a, b, c] in mesh.triangles.iter().map(|triangle| triangle.map(place)) {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let (edge, step) = if from < to { ([from, to], 1) } else { ([to, from], -1) };
            *balance.entry(edge).or_default() += step;
        }
    }
    balance.values().any(|&balance| balance != 0)
}

/// Writes [`Solids`] when objects or materials changed.
pub fn find_solids(
    instances: Res<Instances>,
    surfaces: Res<Surfaces>,
    meshes: Res<MeshTrees>,
    mut table: ResMut<Solids>,
) {
    if !(instances.is_changed() || surfaces.is_changed() || meshes.is_changed()) {
        return;
    }
    let found = solids(&instances.list, &surfaces.materials);
    let mut list: Vec<Entry> = found
        .iter()
        .map(|&index| {
            let instance = &instances.list[index as usize];
            let interior = surfaces.materials.interior(instance.material);
            let priority = interior.map_or(0, |interior| interior.priority);
            let solid = Solid { instance: index, material: instance.material, priority };
            let tree = match instance.geometry {
                Geometry::Mesh(mesh) => table.tree_of(&meshes.list[mesh as usize]),
                Geometry::Primitive(_) => None,
            };
            let is_thin = is_thin(instance);
            let (is_mesh, is_closed) = match &instance.geometry {
                Geometry::Mesh(_) => (true, false),
                Geometry::Primitive(primitive) => (false, primitive.is_closed()),
            };
            Entry {
                instance: index,
                solid,
                bounds: instance.bounds,
                is_mesh,
                is_closed,
                is_thin,
                tree,
                neighbours: (0, 0),
            }
        })
        .collect();
    let mut places = vec![NOTHING; instances.list.len()];
    for (place, &index) in (0..).zip(&found) {
        places[index as usize] = place;
    }
    let mut pairs: Vec<(u32, u32)> = overlapping_pairs(&instances.list, &found)
        .into_iter()
        .map(|(a, b)| (places[a as usize], places[b as usize]))
        .flat_map(|(a, b)| [(a, b), (b, a)])
        .collect();
    pairs.sort_unstable();
    let open = OpenMeshes { instances: &instances.list, meshes: &meshes.list, before: &table.open };
    let open = open.unite(&mut list, &pairs);
    for (place, entry) in (0..).zip(&mut list) {
        let start = |place: u32| pairs.partition_point(|pair| pair.0 < place) as u32;
        entry.neighbours = (start(place), start(place + 1));
    }
    let neighbours = pairs.into_iter().map(|pair| pair.1).collect();
    *table = Solids { list, places, neighbours, open };
}

impl Solids {
    /// A tree for a mesh which has none of its own; that of the frame before, if there was one.
    fn tree_of(&self, mesh: &MeshTree) -> Option<Arc<MeshTree>> {
        if !mesh.is_elsewhere() {
            return None;
        }
        let known = self.list.iter().filter_map(|entry| entry.tree.as_ref());
        let same = |tree: &&Arc<MeshTree>| Arc::ptr_eq(&tree.mesh, &mesh.mesh);
        let known = known.into_iter().find(same).cloned();
        Some(known.unwrap_or_else(|| Arc::new(MeshTree::build(mesh.mesh.clone(), mesh.quality()))))
    }

    /// Bytes held.
    pub fn memory(&self) -> usize {
        let trees: usize = self
            .list
            .iter()
            .filter_map(|entry| entry.tree.as_ref())
            .map(|tree| tree.memory())
            .sum();
        let words = (self.places.capacity() + self.neighbours.capacity()) * size_of::<u32>();
        trees + words + self.list.capacity() * size_of::<Entry>()
    }
}
