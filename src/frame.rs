//! The stages of one frame, and [`Simulation`], which runs them.

use crate::build::bvh::{MeshTrees, RestingTree, TopLevel};
use crate::build::density::Densities;
use crate::build::light::{LightTable, PhotonSource};
use crate::build::{TreeMemory, trees_fit};
use crate::description::{Layer, SceneDescription};
use crate::extract::{
    CameraFacts, ChosenIntegrator, DicingRefused, Emissions, Feature, Instance, Instances, Meshes,
    Requirements, Surfaces, ViewCamera, meshes_fit, method_suffices,
};
use crate::film::{Film, FilmError, Tile};
use crate::integrate::{IntegrateStatus, PhotonReport, film_memory, radius_limit};
use crate::memory::Shortage;
use crate::shade::nesting::NestingFaults;
use crate::world::{Camera, FrameClock, Settings};
use crate::{build, extract, integrate, step};
use bevy_ecs::prelude::*;
use bevy_ecs::schedule::{
    IntoScheduleConfigs, LogLevel, ScheduleBuildSettings, SingleThreadedExecutor,
};
use bevy_ecs::system::ScheduleSystem;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::time::Instant;

/// The stages of one frame, in order. A stage reads only what earlier stages wrote.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameSystems {
    /// Where everything is over the shutter.
    Step,
    /// What changed is copied into flat arrays.
    Extract,
    /// Acceleration structures and light tables over those arrays.
    Build,
    /// Light is simulated.
    Integrate,
}

/// How a caller watches and stops a render. Cheap to clone; every clone is the same control.
#[derive(Clone, Debug, Default, Resource)]
pub struct RenderControl {
    /// Set to true to stop: the frame being rendered is given up.
    pub cancel: Arc<AtomicBool>,
    /// Pixel samples finished in the current frame.
    pub samples_done: Arc<AtomicU64>,
    /// Pixel samples of the current frame in all.
    pub samples_total: Arc<AtomicU64>,
    /// Rays traced in the current frame.
    pub rays: Arc<AtomicU64>,
    /// Hears of the integrator before light is simulated.
    pub on_method: MethodListener,
}

/// What is called in every frame, before light is simulated, with the integrator that runs, why, and what is
/// out of its reach. Nothing by default.
#[derive(Clone, Default)]
pub struct MethodListener(Option<Arc<dyn Fn(&ChosenIntegrator) + Send + Sync>>);

impl MethodListener {
    /// One which calls this.
    pub fn new(listen: impl Fn(&ChosenIntegrator) + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(listen)))
    }
}

impl fmt::Debug for MethodListener {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(if self.0.is_some() { "MethodListener(..)" } else { "MethodListener(none)" })
    }
}

/// Tells who listens which integrator runs.
fn tell_method(control: Res<RenderControl>, chosen: Res<ChosenIntegrator>) {
    if let Some(listen) = &control.on_method.0 {
        listen(&chosen);
    }
}

/// What happened in a frame: times, counts, warnings. Goes into the manifest.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FrameReport {
    /// The frame.
    pub frame: i32,
    /// Seconds spent in each stage, in order: `step`, `extract`, `build`, `integrate`.
    pub stage_seconds: Vec<(&'static str, f64)>,
    /// Seconds spent in each system, in order: `poses` of the first stage; `camera`, `surfaces`,
    /// `emissions`, `instances`, `lights` and `requirements` of the second; `mesh trees`, `top level` and
    /// `light table` of the third.
    pub system_seconds: Vec<(&'static str, f64)>,
    /// What was rebuilt, in words: `"instances: 3 of 10"`, `"top level"`, `"meshes: 1"`.
    pub rebuilt: Vec<String>,
    /// Bytes held by the images (each counted once, its smaller copies with it), the tables and the trees of the scene, by name.
    pub table_bytes: Vec<(&'static str, u64)>,
    /// Pixel samples taken.
    pub samples: u64,
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Samples with a NaN or an infinity, dropped and counted.
    pub non_finite: u64,
    /// Paths cut off at `max_depth`.
    pub truncated_paths: u64,
    /// What the photons of the frame came to, if there were any.
    pub photons: Option<PhotonReport>,
    /// Which integrator ran.
    pub integrator: String,
    /// The camera when the shutter opened and closed.
    pub camera: CameraFacts,
    /// Things the user should know.
    pub warnings: Vec<String>,
}

/// A rendered frame.
#[derive(Debug)]
pub struct RenderedFrame {
    /// Sums of all samples.
    pub film: Film,
    /// What happened.
    pub report: FrameReport,
    /// The names of the objects by their numbers in the layer `ObjectId`; empty without that layer.
    pub objects: BTreeMap<u32, String>,
}

/// Why a frame could not be rendered.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The control's `cancel` was set.
    #[error("the render was cancelled")]
    Cancelled,
    /// There is nothing to look through.
    #[error("the world has no entity with a `Camera`: spawn one")]
    NoCamera,
    /// A component refers to an entity which is not what it should be.
    #[error("{0}")]
    Dangling(String),
    /// Systems which touch the same data have no order.
    #[error("the systems of the frame cannot be put in order: {0}")]
    Systems(String),
    /// The picture cannot be made.
    #[error(transparent)]
    Film(#[from] FilmError),
    /// There is no memory for the trees over new meshes.
    #[error("no memory for {megabytes} MB of trees over the triangles of the scene")]
    TreeMemory {
        /// What they would take.
        megabytes: usize,
        /// What there is.
        source: Shortage,
    },
    /// What glows is to be lit by photons.
    #[error(
        "{0} has no photons from solids which glow inside (`emission` of a material): set \
         `integrator: Path`, or `Auto`"
    )]
    GlowingSolids(&'static str),
    /// A solid whose density follows a texture has no end.
    #[error(
        "`{0}` is endless, and the `density` of its material is a texture: use a shape which ends, such as a `Box`, or an \
         even density"
    )]
    EndlessDensity(String),
    /// A mesh that is divided for the camera would take too much memory.
    #[error(
        "dicing the mesh `{mesh}` takes at least {triangles} triangles, {megabytes} MB, and \
         `dicing_memory` is {limit} MiB: set a larger `dicing`, displace a smaller mesh, keep it farther from the \
         camera, or allow more"
    )]
    Dicing {
        /// Its name.
        mesh: String,
        /// Triangles that it would have at least.
        triangles: usize,
        /// What they would take.
        megabytes: usize,
        /// What is allowed.
        limit: u32,
    },
    /// The shutter closes before it opens, or the rate is not positive.
    #[error("the clock cannot run: {0}")]
    Clock(String),
}

/// A world and the schedule which makes a frame of it.
pub struct Simulation {
    world: World,
    schedule: Schedule,
}

/// Share of rays which may find solids nested inconsistently in a scene where they are not: those which
/// meet an edge, or the place where a solid stands on something, within rounding, and miss a surface. Of
/// glasses on a table 14 in 2.8·10⁷ did.
const NESTING_BY_CHANCE: f64 = 1e-6;

/// Share of paths let out of closed orbits which is not worth a word: where they go is the mean of what they would have
/// seen, within a thousandth of the picture.
const LET_OUT_UNSEEN: f64 = 1e-3;

/// When stages began and how long systems took, written by the marker systems between them.
#[derive(Resource, Default)]
pub(crate) struct StageClock {
    stages: Vec<Instant>,
    systems: Vec<(&'static str, f64)>,
    last: Option<Instant>,
}

fn mark(mut clock: ResMut<StageClock>) {
    let now = Instant::now();
    clock.stages.push(now);
    clock.last = Some(now);
}

/// A system which notes how long it has been since the last note, under the name of the system between.
pub(crate) fn stamp(name: &'static str) -> impl FnMut(ResMut<StageClock>) {
    move |mut clock: ResMut<StageClock>| {
        let now = Instant::now();
        let seconds = clock.last.map_or(0.0, |last| (now - last).as_secs_f64());
        clock.systems.push((name, seconds));
        clock.last = Some(now);
    }
}

/// Markers before the first stage and after each one.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Marks {
    Opening,
    Stepped,
    Extracted,
    Built,
    Integrated,
}

impl Default for Simulation {
    fn default() -> Self {
        Self::new()
    }
}

impl Simulation {
    /// An empty world with the default clock and settings.
    pub fn new() -> Self {
        let mut world = World::new();
        world.insert_resource(FrameClock::default());
        world.insert_resource(Settings::default());
        world.insert_resource(RenderControl::default());
        world.insert_resource(StageClock::default());
        let schedule = frame_schedule(&mut world);
        Self { world, schedule }
    }

    /// The world of a description.
    pub fn from_description(scene: &SceneDescription) -> Self {
        let mut simulation = Self::new();
        crate::world::spawn_scene(&mut simulation.world, scene);
        simulation
    }

    /// The world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// The world, to spawn entities into and to change resources.
    pub fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// Adds systems which move things: they run before velocities and keyframes are applied, once
    /// for every sample of the shutter, and must be pure functions of
    /// [`SceneTime`](crate::world::SceneTime).
    pub fn add_step_systems<M>(
        &mut self,
        systems: impl IntoScheduleConfigs<ScheduleSystem, M>,
    ) -> &mut Self {
        self.world.schedule_scope(step::Pose, |_, poses| {
            poses.add_systems(systems.in_set(step::PoseSystems::Custom));
        });
        self
    }

    /// Runs all stages but the last for a frame: afterwards the tables of the frame stand in the
    /// world's resources.
    ///
    /// # Errors
    /// When there is no camera, a reference dangles or the clock cannot run.
    pub fn prepare_frame(&mut self, frame: i32) -> Result<(), RenderError> {
        let control = RenderControl::default();
        control.cancel.store(true, Relaxed);
        match self.run(frame, &control) {
            Err(RenderError::Cancelled) | Ok(_) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Renders a frame.
    ///
    /// The result depends on the world and the frame alone: not on the frames rendered before, and not
    /// on the number of threads.
    ///
    /// # Errors
    /// When the control cancels it, there is no camera, a reference dangles, the clock cannot run
    /// or there is no memory for the film.
    pub fn render_frame(
        &mut self,
        frame: i32,
        control: &RenderControl,
    ) -> Result<RenderedFrame, RenderError> {
        self.run(frame, control)
    }

    fn run(&mut self, frame: i32, control: &RenderControl) -> Result<RenderedFrame, RenderError> {
        self.check_clock()?;
        if self.world.query::<&Camera>().iter(&self.world).next().is_none() {
            return Err(RenderError::NoCamera);
        }
        let settings = &self.world.resource::<Settings>().0;
        let total = Tile::rendered(settings).area() as u64 * u64::from(settings.samples);
        control.samples_done.store(0, Relaxed);
        control.samples_total.store(total, Relaxed);
        control.rays.store(0, Relaxed);
        self.world.insert_resource(control.clone());
        self.world.resource_mut::<FrameClock>().frame = frame;
        let mut clock = self.world.resource_mut::<StageClock>();
        clock.stages.clear();
        clock.systems.clear();
        self.check_systems()?;
        self.schedule.run(&mut self.world);
        self.world.clear_trackers();
        if let Some(first) = self.dangling() {
            self.world.resource_mut::<Instances>().mark_unseen();
            return Err(RenderError::Dangling(first));
        }
        let method = self.world.resource::<ChosenIntegrator>().method;
        let glows = self.world.resource::<Requirements>().has(Feature::GlowingSolids);
        if glows && method.lights_by_photons() {
            self.world.resource_mut::<Instances>().mark_unseen();
            return Err(RenderError::GlowingSolids(method.name()));
        }
        if let Some(index) = self.world.resource::<Densities>().endless {
            let name = self.name_of(index).to_owned();
            self.world.resource_mut::<Instances>().mark_unseen();
            return Err(RenderError::EndlessDensity(name));
        }
        if let Some(refusal) = self.world.resource::<DicingRefused>().0.clone() {
            let name = self.world.get::<Name>(refusal.mesh);
            let mesh = name.map_or_else(String::new, |name| name.as_str().to_owned());
            let (triangles, megabytes) = (refusal.triangles, refusal.bytes / 1_000_000);
            let limit = self.world.resource::<Settings>().0.dicing_memory;
            self.world.resource_mut::<Instances>().mark_unseen();
            return Err(RenderError::Dicing { mesh, triangles, megabytes, limit });
        }
        let memory = self.world.resource::<TreeMemory>();
        if let Some(source) = memory.refused {
            let megabytes = memory.forecast / 1_000_000;
            self.world.resource_mut::<Instances>().mark_unseen();
            return Err(RenderError::TreeMemory { megabytes, source });
        }
        let mut status = self.world.resource_mut::<IntegrateStatus>();
        let status = std::mem::take(&mut *status);
        if let Some(error) = status.error {
            return Err(error.into());
        }
        let film = status.film.ok_or(RenderError::Cancelled)?;
        let report = FrameReport {
            frame,
            stage_seconds: self.stage_seconds(),
            system_seconds: self.world.resource::<StageClock>().systems.clone(),
            rebuilt: self.rebuilt(),
            table_bytes: self.table_bytes(),
            samples: total,
            rays: status.counters.rays,
            non_finite: film.non_finite(),
            truncated_paths: status.counters.truncated,
            photons: status.photons,
            integrator: self.integrator(),
            camera: CameraFacts::new(self.world.resource(), self.world.resource()),
            warnings: self
                .warnings()
                .into_iter()
                .chain(status.warnings)
                .chain(self.nesting_warnings(&status.counters.nesting, status.counters.rays))
                .chain(self.density_warning())
                .chain(self.orbit_warning(status.counters.let_out, total))
                .collect(),
        };
        Ok(RenderedFrame { film, report, objects: self.objects() })
    }

    /// The names of the objects by number, where they are asked for.
    fn objects(&self) -> BTreeMap<u32, String> {
        if !self.world.resource::<Settings>().0.layers.contains(&Layer::ObjectId) {
            return BTreeMap::new();
        }
        let ids = self.world.resource::<Instances>().list.iter().map(|i| i.object_id);
        let named = ids.zip(0..).map(|(id, index)| (id, self.name_of(index).to_owned()));
        named.filter(|(_, name)| !name.is_empty()).collect()
    }

    /// The first reference of a component to an entity which is not what it should be.
    fn dangling(&self) -> Option<String> {
        let surfaces = self.world.resource::<Surfaces>().dangling.first();
        let emissions = || self.world.resource::<Emissions>().dangling.first();
        let instances = || self.world.resource::<Instances>().dangling.first();
        let camera = || self.world.resource::<ViewCamera>().dangling.as_ref();
        surfaces.or_else(emissions).or_else(instances).or_else(camera).cloned()
    }

    /// Builds the schedules, which fails when systems conflict without an order between them.
    fn check_systems(&mut self) -> Result<(), RenderError> {
        let conflict = |schedule: &mut Schedule, world: &mut World| match schedule.initialize(world)
        {
            Ok(_) => Ok(()),
            Err(error) => Err(RenderError::Systems(error.to_string(schedule.graph(), world))),
        };
        self.world.schedule_scope(step::Pose, |world, poses| conflict(poses, world))?;
        conflict(&mut self.schedule, &mut self.world)
    }

    fn check_clock(&self) -> Result<(), RenderError> {
        let clock = self.world.resource::<FrameClock>().clock;
        let (open, close) = clock.shutter;
        if !(clock.fps > 0.0 && clock.fps.is_finite()) {
            return Err(RenderError::Clock(format!("{} frames per second", clock.fps)));
        }
        if !(open.is_finite() && close.is_finite() && open <= close) {
            return Err(RenderError::Clock(format!(
                "the shutter opens at {open} and closes at {close}"
            )));
        }
        Ok(())
    }

    fn stage_seconds(&self) -> Vec<(&'static str, f64)> {
        let marks = &self.world.resource::<StageClock>().stages;
        ["step", "extract", "build", "integrate"]
            .into_iter()
            .zip(marks.windows(2).map(|pair| (pair[1] - pair[0]).as_secs_f64()))
            .collect()
    }

    fn rebuilt(&self) -> Vec<String> {
        let mut rebuilt = Vec::new();
        let instances = self.world.resource::<Instances>();
        let rewritten = instances.rewritten_slots.len();
        if rewritten > 0 {
            rebuilt.push(format!("instances: {rewritten} of {}", instances.list.len()));
        }
        let meshes = self.world.resource::<MeshTrees>();
        if meshes.built > 0 {
            rebuilt.push(format!("mesh trees: {} of {}", meshes.built, meshes.list.len()));
        }
        if self.world.resource::<RestingTree>().built {
            rebuilt.push("tree of resting meshes".to_owned());
        }
        let top = self.world.resource::<TopLevel>();
        if top.built {
            rebuilt.push("top level".to_owned());
        } else if top.refitted > 0 {
            rebuilt.push(format!("top level, refitted: {}", top.refitted));
        }
        let lights = self.world.resource::<LightTable>();
        if lights.built {
            rebuilt.push(format!("lights: {}", lights.len()));
        }
        rebuilt
    }

    /// Bytes that the frame prepared last takes, by what holds them, before it is rendered: its tables, trees that are
    /// built already, and the film. Photons come on top, as many as `photons.max_memory` allows.
    pub fn memory(&self) -> Vec<(&'static str, u64)> {
        let settings = &self.world.resource::<Settings>().0;
        let mut all = self.table_bytes();
        let meshes = &self.world.resource::<Meshes>().list;
        all.push(("meshes", meshes.iter().map(|mesh| mesh.memory() as u64).sum()));
        let method = self.world.resource::<ChosenIntegrator>().method;
        all.push(("film", film_memory(settings, method)));
        all
    }

    fn table_bytes(&self) -> Vec<(&'static str, u64)> {
        let instances = self.world.resource::<Instances>().list.capacity() * size_of::<Instance>();
        let lights = self.world.resource::<LightTable>().memory();
        let trees: usize =
            self.world.resource::<MeshTrees>().list.iter().map(|tree| tree.memory()).sum();
        let resting = self.world.resource::<RestingTree>().memory();
        let top = self.world.resource::<TopLevel>().memory();
        let textures = self.world.resource::<Surfaces>().materials.textures().memory();
        vec![
            ("textures", textures as u64),
            ("instances", instances as u64),
            ("mesh trees", trees as u64),
            ("tree of resting meshes", resting as u64),
            ("top level", top as u64),
            ("light table", lights as u64),
        ]
    }

    /// The integrator which the settings ask for, and for `Auto` why it is taken.
    pub fn integrator(&self) -> String {
        self.world.resource::<ChosenIntegrator>().description()
    }

    /// The name of the object of an instance.
    fn name_of(&self, index: u32) -> &str {
        let entity = self.world.resource::<Instances>().entity(index);
        let name = entity.and_then(|entity| self.world.get::<Name>(entity));
        name.map_or("", |name| name.as_str())
    }

    /// Whether densities were found above their bounds.
    fn density_warning(&self) -> Option<String> {
        let count = self.world.resource::<Densities>().take_exceeded();
        (count > 0).then(|| {
            format!(
                "{count} times a density was found above its bound: the picture is right on average, but noisier there. \
                 Please report the scene"
            )
        })
    }

    /// Whether many paths were let out of closed orbits.
    fn orbit_warning(&self, let_out: u64, samples: u64) -> Option<String> {
        let most = self.world.resource::<Settings>().0.inner_reflections;
        (let_out as f64 > LET_OUT_UNSEEN * samples as f64).then(|| {
            format!(
                "{let_out} paths of {samples} were let out of glass after {most} reflections inside, which they would not have \
                 left: its normals are bent too far from its surface. Make the mesh finer, or the relief weaker; for long \
                 light guides raise `render.inner_reflections`"
            )
        })
    }

    /// Where rays found solids nested in a way that cannot be.
    fn nesting_warnings(&self, faults: &NestingFaults, rays: u64) -> Vec<String> {
        let name = |index: u32| self.name_of(index);
        let mut warnings = Vec::new();
        let seldom = faults.count as f64 <= NESTING_BY_CHANCE * rays as f64;
        if let Some((a, b)) = faults.pair.filter(|_| !seldom) {
            let (count, a) = (faults.count, name(a));
            let within = match name(b) {
                b if a == b => "in air".to_owned(),
                b => format!("in `{b}`"),
            };
            warnings.push(format!(
                "{count} times a ray left the solid `{a}` without having entered it, or never left it, \
                 when it was {within}: is each of them closed, with normals to the outside?"
            ));
        }
        if faults.forgotten > 0 {
            let count = faults.forgotten;
            warnings
                .push(format!("{count} times a ray was inside more solids than it can remember"));
        }
        warnings
    }

    /// What becomes of a radius that was asked for.
    fn radius_warning(&self) -> Option<String> {
        let world = &self.world;
        let chosen = world.resource::<ChosenIntegrator>();
        let source =
            world.get_resource::<PhotonSource>().filter(|_| chosen.method.has_photons())?;
        let (camera, bounds) =
            (world.resource::<ViewCamera>(), world.resource::<TopLevel>().bounds());
        radius_limit(&world.resource::<Settings>().0.photons, chosen.method, source, camera, bounds)
    }

    /// What the user should know of the frame that was prepared or rendered last.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.world.resource::<ChosenIntegrator>().warnings.clone();
        warnings.extend(self.world.resource::<ViewCamera>().warning.clone());
        warnings.extend(self.radius_warning());
        if self.world.resource::<LightTable>().is_empty() {
            warnings.push(
                "the scene has no light: give an entity an `emission` or a `light`".to_owned(),
            );
        }
        warnings
    }
}

/// Whether every reference between entities leads to what it should.
fn nothing_dangles(
    surfaces: Res<Surfaces>,
    emissions: Res<Emissions>,
    instances: Res<Instances>,
    camera: Res<ViewCamera>,
) -> bool {
    surfaces.dangling.is_empty()
        && emissions.dangling.is_empty()
        && instances.dangling.is_empty()
        && camera.dangling.is_none()
}

/// Builds the frame schedule; every stage installs its own systems and resources.
fn frame_schedule(world: &mut World) -> Schedule {
    use FrameSystems::{Build, Extract, Integrate, Step};
    let mut frame = Schedule::default();
    frame.set_executor(SingleThreadedExecutor::new());
    let ambiguity_detection = LogLevel::Error;
    frame.set_build_settings(ScheduleBuildSettings { ambiguity_detection, ..Default::default() });
    frame.configure_sets((Marks::Opening, Step, Marks::Stepped, Extract).chain());
    frame.configure_sets((Extract, Marks::Extracted, Build, Marks::Built).chain());
    frame.configure_sets((Marks::Built, Integrate, Marks::Integrated).chain());
    frame.configure_sets(Build.run_if(nothing_dangles).run_if(meshes_fit));
    frame.configure_sets(
        Integrate
            .run_if(nothing_dangles)
            .run_if(meshes_fit)
            .run_if(trees_fit)
            .run_if(method_suffices),
    );
    for set in [Marks::Opening, Marks::Stepped, Marks::Extracted, Marks::Built, Marks::Integrated] {
        frame.add_systems(mark.in_set(set));
    }
    frame.add_systems(tell_method.in_set(Marks::Built));
    step::install(world, &mut frame);
    extract::install(world, &mut frame);
    build::install(world, &mut frame);
    integrate::install(world, &mut frame);
    frame
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every two systems which touch the same data are ordered.
    #[test]
    fn the_schedule_has_no_ambiguities() {
        let mut simulation = Simulation::new();
        simulation.schedule.initialize(&mut simulation.world).expect("no ambiguities");
    }

    /// The test above can fail: an unordered writer of the same resource is an error.
    #[test]
    fn an_unordered_conflict_is_found() {
        fn meddle(mut settings: ResMut<Settings>) {
            settings.0.samples += 1;
        }
        let mut simulation = Simulation::new();
        simulation.schedule.add_systems(meddle);
        assert!(simulation.schedule.initialize(&mut simulation.world).is_err());
    }

    /// Every system of the first three stages is in the report, and together they take no longer than
    /// their stages.
    #[test]
    fn the_report_times_every_system() {
        let mut simulation = Simulation::new();
        let settings =
            crate::description::RenderSettings { size: (2, 2), samples: 1, ..Default::default() };
        simulation.world.insert_resource(Settings(settings));
        simulation.world.spawn(Camera::default());
        let frame = simulation.render_frame(0, &RenderControl::default()).expect("a camera");
        let FrameReport { system_seconds, stage_seconds, .. } = frame.report;
        let names: Vec<&str> = system_seconds.iter().map(|(name, _)| *name).collect();
        let step = ["poses", "deformation"];
        let extract = ["camera", "surfaces", "emissions", "instances", "resting meshes", "lights"];
        let build =
            ["tree of resting meshes", "mesh trees", "top level", "light table", "photon source"];
        assert_eq!(names, [&step[..], &extract, &["requirements"], &build].concat());
        let sum = |list: &[(&str, f64)]| list.iter().map(|(_, seconds)| seconds).sum::<f64>();
        assert!(sum(&system_seconds) > 0.0 && sum(&system_seconds) < sum(&stage_seconds[..3]));
    }

    /// Two systems of a program which move the same things without an order are an error which names
    /// them.
    #[test]
    fn unordered_step_systems_are_an_error() {
        fn push(mut all: Query<&mut crate::world::Transform>) {
            all.iter_mut().for_each(|mut t| t.translation.x += 1.0);
        }
        fn pull(mut all: Query<&mut crate::world::Transform>) {
            all.iter_mut().for_each(|mut t| t.translation.x -= 1.0);
        }
        let mut simulation = Simulation::new();
        simulation.add_step_systems((push, pull));
        simulation.world.spawn(Camera::default());
        let error = simulation.render_frame(0, &RenderControl::default());
        let error = error.expect_err("a conflict").to_string();
        assert!(error.contains("push") && error.contains("pull"), "{error}");
    }
}
