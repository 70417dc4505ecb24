//! As many keys of a deforming mesh over the shutter as its motion needs.
//!
//! Keys are joined by straight lines, vertex by vertex. As for the poses of objects
//! ([`super::sample_shutter`]), the smallest number of segments (a power of two) is taken whose lines
//! pass through the true positions between them within the tolerance: a share of the greatest
//! distance that a vertex moves during the shutter.

use super::waves::WaterSurface;
use crate::world::{Deformation, FrameClock, Mesh, Settings, ShutterSpan, VertexMotion, Vertices};
use bevy_ecs::prelude::*;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Segments of the coarsest grid on which motion is examined.
const COARSEST_GRID: usize = 4;
/// Most segments of a motion; one that needs more is given these. Each key is a copy of all vertices.
const MOST_SEGMENTS: usize = 64;
/// Vertices on which the number of keys is decided, spread evenly over the mesh.
const EXAMINED: usize = 1024;

/// Writes the [`VertexMotion`] of every deforming mesh for this frame's shutter.
///
/// What is the same as before is left untouched, so that `Changed<VertexMotion>` downstream means
/// that the mesh has another form.
pub fn deform_meshes(
    clock: Res<FrameClock>,
    settings: Res<Settings>,
    mut meshes: Query<(Ref<Mesh>, Ref<Deformation>, &mut VertexMotion)>,
) {
    let (open, close) = clock.shutter();
    let span = ShutterSpan { open, close, tolerance: settings.0.motion_tolerance };
    for (mesh, deformation, mut motion) in &mut meshes {
        let edited = mesh.is_changed() || deformation.is_changed();
        if motion.made_for == Some(span) && !edited {
            continue;
        }
        let keys = keys_over(&deformation, &mesh.data().positions, span);
        let now = VertexMotion::new(&mesh, keys, span);
        if motion.is_same(&now) {
            motion.bypass_change_detection().made_for = now.made_for;
        } else {
            *motion = now;
        }
    }
}

/// The vertices at the times of the keys.
fn keys_over(deformation: &Deformation, rest: &[Vec3], span: ShutterSpan) -> Vec<Vertices> {
    let segments = if span.close > span.open { segments(deformation, rest, span) } else { 0 };
    (0..=segments)
        .map(|k| {
            let share = if segments == 0 { 0.0 } else { k as f64 / segments as f64 };
            vertices(deformation, rest, span.open + (span.close - span.open) * share)
        })
        .collect()
}

/// All vertices at `t` seconds.
fn vertices(deformation: &Deformation, rest: &[Vec3], t: f64) -> Vertices {
    let Deformation::Waves(waves) = deformation;
    let surface = WaterSurface::new(waves, t);
    let vertex = |p: &Vec3| {
        let (p, n) = surface.vertex(f64::from(p.x), f64::from(p.z));
        (p.as_vec3(), n.as_vec3())
    };
    let (positions, normals) = rest.par_iter().map(vertex).unzip();
    Vertices { positions, normals }
}

/// The fewest segments that follow the motion; 0 for what rests.
fn segments(deformation: &Deformation, rest: &[Vec3], span: ShutterSpan) -> usize {
    let stride = rest.len().div_ceil(EXAMINED).max(1);
    let examined: Vec<Vec3> = rest.iter().step_by(stride).copied().collect();
    let at = |share: f64| -> Vec<DVec3> {
        let Deformation::Waves(waves) = deformation;
        let surface = WaterSurface::new(waves, span.open + (span.close - span.open) * share);
        let moved = |p: &Vec3| surface.position(f64::from(p.x), f64::from(p.z));
        examined.par_iter().map(moved).collect()
    };
    let mut grid = COARSEST_GRID;
    loop {
        let samples: Vec<Vec<DVec3>> =
            (0..=grid).into_par_iter().map(|k| at(k as f64 / grid as f64)).collect();
        let moved = samples.iter().map(|now| greatest_distance(now, &samples[0]));
        let moved = moved.fold(0.0, f64::max);
        if moved == 0.0 {
            return 0;
        }
        let fits = |segments: &usize| strays(&samples, grid / segments) <= span.tolerance * moved;
        let candidates = std::iter::successors(Some(1), |n| Some(2 * n));
        if let Some(fewest) = candidates.take_while(|n| *n < grid).find(fits) {
            return fewest;
        }
        if grid >= MOST_SEGMENTS {
            return MOST_SEGMENTS;
        }
        grid *= 2;
    }
}

/// How far straight lines between every `stride`-th sample stray from the samples between.
fn strays(samples: &[Vec<DVec3>], stride: usize) -> f64 {
    let stray = |k: usize| {
        let (a, share) = (k / stride * stride, (k % stride) as f64 / stride as f64);
        let between = |i: usize| samples[a][i].lerp(samples[a + stride][i], share);
        (0..samples[k].len()).map(|i| between(i).distance(samples[k][i])).fold(0.0, f64::max)
    };
    (0..samples.len() - 1).filter(|k| k % stride != 0).map(stray).fold(0.0, f64::max)
}

fn greatest_distance(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Clock, RenderSettings, Wave, Waves};
    use glam::DVec2;
    use std::sync::Arc;

    fn ripples(amplitude: f64) -> Waves {
        let wave = |amplitude, frequency, direction| Wave {
            amplitude,
            frequency,
            direction,
            phase: 40.0 * frequency,
        };
        Waves {
            size: DVec2::new(3.0, 2.0),
            cells: (30, 20),
            steepness: 0.7,
            gravity: 9.81,
            waves: vec![wave(amplitude, 1.0, 20.0), wave(amplitude / 5.0, 3.0, 95.0)],
        }
    }

    /// A world with the system alone, and its mesh.
    fn pool(waves: Waves) -> (World, Schedule, Entity) {
        let mut world = World::new();
        let clock = Clock { fps: 24.0, frames: (0, 47), shutter: (0.0, 0.5) };
        world.insert_resource(FrameClock { clock, frame: 0 });
        world.insert_resource(Settings(RenderSettings::default()));
        let mesh = Mesh::new(Arc::new(waves.at_rest()));
        let entity = world.spawn((mesh, Deformation::Waves(waves))).id();
        let mut schedule = Schedule::default();
        schedule.add_systems(deform_meshes);
        (world, schedule, entity)
    }

    fn motion(world: &World, entity: Entity) -> VertexMotion {
        world.get::<VertexMotion>(entity).expect("required by the deformation").clone()
    }

    /// Oracle: the surface in `f64` at many times of the shutter; the lines between the keys stay
    /// within the tolerance, and half as many keys would not.
    #[test]
    fn keys_follow_the_surface_within_the_tolerance() {
        let waves = ripples(0.01);
        let (mut world, mut schedule, entity) = pool(waves.clone());
        schedule.run(&mut world);
        let motion = motion(&world, entity);
        let rest = waves.at_rest();
        let keys: Vec<&[Vec3]> = motion.positions().collect();
        let segments = keys.len() - 1;
        let close = 0.5 / 24.0;
        let true_at = |share: f64, i: usize| {
            let p = rest.positions[i];
            WaterSurface::new(&waves, close * share).position(p.x.into(), p.z.into())
        };
        let stray = |stride: usize| {
            let mut greatest = 0.0_f64;
            for k in 0..=96 {
                let share = f64::from(k) / 96.0;
                let along = share * (segments / stride) as f64;
                let a = (along.floor() as usize).min(segments / stride - 1);
                for i in (0..rest.positions.len()).step_by(7) {
                    let [from, to] = [a, a + 1].map(|key| keys[key * stride][i].as_dvec3());
                    let line = from.lerp(to, along - a as f64);
                    greatest = greatest.max(line.distance(true_at(share, i)));
                }
            }
            greatest
        };
        let moved = (0..rest.positions.len())
            .map(|i| true_at(1.0, i).distance(true_at(0.0, i)))
            .fold(0.0, f64::max);
        // Positions are f32: 6e-8 of at most 1.5 m, at both keys.
        let rounding = 2.0 * 1.5 * f64::from(f32::EPSILON);
        assert!((2..MOST_SEGMENTS).contains(&segments), "{segments}");
        assert!(stray(1) <= 0.001 * moved + rounding, "{:e} of {moved:e}", stray(1));
        assert!(stray(2) > 0.001 * moved, "{:e} of {moved:e}", stray(2));
    }

    /// Every frequency is a whole number of periods in 2 s: frame 48 is frame 0 up to the rounding of
    /// the phase, 2·10⁻¹⁵ of a turn at each, far below one unit of `f32`.
    #[test]
    fn the_film_is_a_loop() {
        let (mut world, mut schedule, entity) = pool(ripples(0.01));
        schedule.run(&mut world);
        let first = motion(&world, entity);
        world.resource_mut::<FrameClock>().frame = 48;
        schedule.run(&mut world);
        let again = motion(&world, entity);
        assert_eq!(first.later.len(), again.later.len());
        for (a, b) in first.positions().flatten().zip(again.positions().flatten()) {
            let unit = f32::EPSILON * a.abs().max_element();
            assert!((*a - *b).abs().max_element() <= unit, "{a} {b}");
        }
        world.resource_mut::<FrameClock>().frame = 12;
        schedule.run(&mut world);
        assert!(!first.is_same(&motion(&world, entity)), "between them it is another surface");
    }

    /// The same frame again and a surface without waves are no change; another frame is one.
    #[test]
    fn only_what_moves_is_a_change() {
        for (amplitude, moves) in [(0.01, true), (0.0, false)] {
            let (mut world, mut schedule, entity) = pool(ripples(amplitude));
            schedule.run(&mut world);
            assert_eq!(motion(&world, entity).later.is_empty(), !moves);
            let mut changed = |world: &mut World, frame: i32| {
                world.clear_trackers();
                world.resource_mut::<FrameClock>().frame = frame;
                schedule.run(world);
                world.query_filtered::<(), Changed<VertexMotion>>().iter(world).count() > 0
            };
            assert!(!changed(&mut world, 0));
            assert_eq!(changed(&mut world, 1), moves);
            assert!(!changed(&mut world, 1));
        }
    }

    /// A closed shutter sees one form, the one of its instant.
    #[test]
    fn a_closed_shutter_has_one_key() {
        let (mut world, mut schedule, entity) = pool(ripples(0.01));
        world.resource_mut::<FrameClock>().clock.shutter = (0.5, 0.5);
        schedule.run(&mut world);
        let motion = motion(&world, entity);
        assert!(motion.later.is_empty());
        let surface = WaterSurface::new(&ripples(0.01), 0.5 / 24.0);
        for (rest, now) in ripples(0.01).at_rest().positions.iter().zip(&motion.opening.positions) {
            assert_eq!(*now, surface.position(rest.x.into(), rest.z.into()).as_vec3());
        }
    }
}
