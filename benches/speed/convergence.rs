//! CPU-seconds of whole renders to a relative mean squared error of 10⁻³, in fog of 0.1 and 0.05.
//!
//! Every render is a process of its own, so that reading the scene, building its trees and writing its
//! pictures count. With two independent references `R₁`, `R₂` of mean `R` the error of a picture `I` is
//!
//! ```text
//! relMSE = mean((I − R₁)·(I − R₂) / (R² + 0.01))
//! ```
//!
//! over pixels and channels, which the noise of the references does not raise. Samples per pixel are
//! multiplied by four until the error falls below the goal; the time to it is interpolated between the
//! last two renders, logarithm by logarithm.

use crate::Options;
use crate::clock::children_seconds;
use crate::meshes::RawMesh;
use crate::report::{Report, section};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The error asked for.
const GOAL: f64 = 1e-3;
/// The errors asked for in fog, whose noise is that of many scatterings.
const GOALS_IN_FOG: [f64; 2] = [0.1, 0.05];
/// Width and height of the pictures.
const SIZE: &str = "256x256";

/// What went wrong; this is a program for developers.
type Failure = Box<dyn std::error::Error>;

/// Beauty of a picture, channel by channel.
fn beauty(path: &Path) -> Result<Vec<f32>, Failure> {
    let image = exr::prelude::read_first_flat_layer_from_file(path)?;
    let mut values = Vec::new();
    for channel in &image.layer_data.channel_data.list {
        values.extend(channel.sample_data.values_as_f32());
    }
    Ok(values)
}

/// A render of `scene`: CPU-seconds, and the memory that it took at most, in megabytes.
fn render(scene: &Path, samples: u32, seed: u32, out: &Path) -> Result<(f64, f64), Failure> {
    let before = children_seconds();
    let finished = Command::new(env!("CARGO_BIN_EXE_kinora"))
        .arg("render")
        .arg(scene)
        .args(["--fresh", "--progress", "none", "--threads", "2", "--size", SIZE])
        .args(["--samples", &samples.to_string(), "--seed", &seed.to_string()])
        .arg("--out")
        .arg(out)
        .output()?;
    if !finished.status.success() {
        return Err(String::from_utf8_lossy(&finished.stderr).into());
    }
    let spent = children_seconds().zip(before).map(|(after, before)| after - before);
    let text = std::fs::read_to_string(out.join("manifest.json"))?;
    let manifest: serde_json::Value = serde_json::from_str(&text)?;
    let peak = manifest["frames"][0]["peak_memory_bytes"].as_f64();
    Ok((spent.ok_or("the system does not tell CPU time")?, peak.unwrap_or(0.0) * 1e-6))
}

/// Two references, rendered once and kept.
fn references(scene: &Path, folder: &Path, samples: u32) -> Result<[Vec<f32>; 2], Failure> {
    let name = scene.file_stem().ok_or("a scene has a name")?.to_string_lossy().into_owned();
    let one = |seed: u32| {
        // A changed scene gets other references.
        let facts = format!("{samples} {SIZE}\n{}", std::fs::read_to_string(scene)?);
        let out = folder.join(format!("{name}-reference-{seed}"));
        let picture = out.join(format!("{name}.0000.exr"));
        let marker = out.join("facts.txt");
        if std::fs::read_to_string(&marker).ok().as_ref() != Some(&facts) || !picture.exists() {
            eprintln!("rendering a reference of {name} with {samples} samples, once");
            render(scene, samples, seed, &out)?;
            std::fs::write(&marker, facts)?;
        }
        beauty(&picture)
    };
    Ok([one(1001)?, one(1002)?])
}

/// The error of a picture.
fn rel_mse(picture: &[f32], [first, second]: &[Vec<f32>; 2]) -> f64 {
    let sum: f64 = picture
        .iter()
        .zip(first)
        .zip(second)
        .map(|((&i, &a), &b)| {
            let (i, a, b) = (f64::from(i), f64::from(a), f64::from(b));
            (i - a) * (i - b) / (a.midpoint(b).powi(2) + 0.01)
        })
        .sum();
    sum / picture.len() as f64
}

/// A binary glTF file of one mesh without anything else.
fn glb(raw: &RawMesh) -> Vec<u8> {
    let positions: &[u8] = bytemuck::cast_slice(&raw.positions);
    let indices: &[u8] = bytemuck::cast_slice(&raw.triangles);
    let bounds = kinora::math::Aabb::from_points(raw.positions.iter().copied());
    let (vertices, corners) = (raw.positions.len(), 3 * raw.triangles.len());
    let json = serde_json::json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "byteLength": positions.len() + indices.len() }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": positions.len() },
            { "buffer": 0, "byteOffset": positions.len(), "byteLength": indices.len() },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3",
              "min": bounds.min.to_array(), "max": bounds.max.to_array() },
            { "bufferView": 1, "componentType": 5125, "count": corners, "type": "SCALAR" },
        ],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "nodes": [{ "mesh": 0 }], "scenes": [{ "nodes": [0] }], "scene": 0,
    });
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + json.len() + 8 + positions.len() + indices.len();
    let word = |n: usize| (n as u32).to_le_bytes();
    let mut file = [*b"glTF", word(2), word(total), word(json.len()), *b"JSON"].concat();
    file.extend(json);
    file.extend([word(positions.len() + indices.len()), *b"BIN\0"].concat());
    file.extend(positions);
    file.extend(indices);
    file
}

/// A ball of 1.3 M triangles with dents of many sizes, under a sky and a lamp.
fn displaced(folder: &Path) -> Result<PathBuf, Failure> {
    let mesh = folder.join("displaced.glb");
    if !mesh.exists() {
        let ball = RawMesh::icosphere(8).map(|p| {
            let dents = (0..6).fold(0.0, |sum, k| {
                let f = 3.0 * 1.9_f32.powi(k);
                let w = glam::Vec3::new(p.y, p.z, p.x) * f + f;
                sum + (p * f + w.map(f32::sin)).map(f32::sin).element_sum() / f
            });
            p * (1.0 + 0.1 * dents)
        });
        std::fs::write(&mesh, glb(&ball))?;
    }
    let scene = folder.join("displaced.ron");
    let text = r#"Scene(
    render: (filter: Box(radius: 0.5)),
    materials: { "clay": Diffuse(albedo: (0.7, 0.6, 0.5)) },
    meshes: { "ball": File("displaced.glb") },
    entities: {
        "camera": (transform: (translation: (0, 0.6, 4), look_at: (0, 0, 0)), camera: (fov: 40)),
        "ball": (shape: Mesh("ball"), material: "clay"),
        "sky": (light: Sky(radiance: (0.5, 0.6, 0.8))),
        "lamp": (
            transform: (translation: (2, 3, 2), look_at: (2, 6, 2.001)),
            shape: Rectangle(size: (1, 1)), emission: Radiance((20, 18, 15)),
        ),
    },
)
"#;
    std::fs::write(&scene, text)?;
    Ok(scene)
}

/// Balls which cross the picture in every direction while the shutter is open, behind a lens.
fn moving(folder: &Path) -> Result<PathBuf, Failure> {
    let mut balls = String::new();
    for k in 0..12_u32 {
        let angle = f64::from(k) * 30.0_f64.to_radians();
        let (x, z) = (1.6 * angle.cos(), 1.6 * angle.sin());
        let (vx, vy, vz) = (-12.0 * angle.sin(), 6.0 * (3.0 * angle).cos(), 12.0 * angle.cos());
        let material = ["red", "white", "blue"][k as usize % 3];
        writeln!(
            balls,
            r#"        "ball {k}": (
            transform: (translation: ({x:.4}, 0.5, {z:.4})), velocity: (linear: ({vx:.4}, {vy:.4}, {vz:.4})),
            shape: Sphere(radius: 0.35), material: "{material}",
        ),"#
        )?;
    }
    let text = format!(
        r#"Scene(
    clock: (fps: 24, frames: (0, 0), shutter: (0, 1)),
    render: (filter: Box(radius: 0.5)),
    materials: {{
        "floor": Diffuse(albedo: (0.6, 0.6, 0.6)), "red": Diffuse(albedo: (0.7, 0.2, 0.1)),
        "white": Diffuse(albedo: (0.8, 0.8, 0.8)), "blue": Diffuse(albedo: (0.1, 0.2, 0.7)),
    }},
    entities: {{
        "camera": (
            transform: (translation: (0, 2, 5), look_at: (0, 0.4, 0)),
            camera: (fov: 45, aperture: 0.1, focus: 4),
        ),
        "floor": (
            transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: (20, 20)), material: "floor",
        ),
        "sky": (light: Sky(radiance: (0.3, 0.4, 0.6))),
        "lamp": (
            transform: (translation: (0, 4, 0), rotation: (90, 0, 0)),
            shape: Rectangle(size: (1.5, 1.5)), emission: Radiance((15, 14, 12)),
        ),
{balls}    }},
)
"#
    );
    let scene = folder.join("moving-balls.ron");
    std::fs::write(&scene, text)?;
    Ok(scene)
}

/// A box of 2 m full of fog, with a lamp of 4 cm and a ball in it.
fn fog(folder: &Path) -> Result<PathBuf, Failure> {
    let scene = folder.join("fog.ron");
    let text = r#"Scene(
    render: (filter: Box(radius: 0.5), integrator: Path),
    materials: {
        "grey": Diffuse(albedo: (0.6, 0.6, 0.6)), "red": Diffuse(albedo: (0.6, 0.06, 0.05)),
        "green": Diffuse(albedo: (0.1, 0.45, 0.08)), "black": Diffuse(albedo: 0),
        "fog": Dielectric(
            ior: 1, scattering: (coefficient: (0.45, 0.45, 0.45)), attenuation: (color: (0.951, 0.951, 0.951)),
        ),
    },
    entities: {
        "camera": (transform: (translation: (0, 1, 3.4), look_at: (0, 1, 0)), camera: (fov: 39)),
        "floor": (transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: (2, 2)), material: "grey"),
        "ceiling": (
            transform: (translation: (0, 2, 0), rotation: (90, 0, 0)), shape: Rectangle(size: (2, 2)), material: "grey",
        ),
        "back": (transform: (translation: (0, 1, -1)), shape: Rectangle(size: (2, 2)), material: "grey"),
        "left": (
            transform: (translation: (-1, 1, 0), rotation: (0, 90, 0)), shape: Rectangle(size: (2, 2)), material: "red",
        ),
        "right": (
            transform: (translation: (1, 1, 0), rotation: (0, -90, 0)), shape: Rectangle(size: (2, 2)), material: "green",
        ),
        "ball": (transform: (translation: (0.35, 0.35, 0.2)), shape: Sphere(radius: 0.35), material: "grey"),
        "air": (transform: (translation: (0, 1, 0)), shape: Box(size: (1.999, 1.999, 1.999)), material: "fog"),
        "lamp": (
            transform: (translation: (-0.1, 1.6, 0)), shape: Sphere(radius: 0.04), material: "black",
            emission: Radiance((90, 80, 65)),
        ),
    },
)
"#;
    std::fs::write(&scene, text)?;
    Ok(scene)
}

/// Renders with ever more samples until the goal is met; CPU-seconds to it, and memory.
fn converge(
    scene: &Path,
    folder: &Path,
    reference: u32,
    goal: f64,
    report: &mut Report,
) -> Result<(), Failure> {
    let name = scene.file_stem().ok_or("a scene has a name")?.to_string_lossy().into_owned();
    let references = references(scene, folder, reference)?;
    let out = folder.join(format!("{name}-test"));
    let mut last: Option<(f64, f64)> = None;
    let mut samples = if goal > GOAL { 1 } else { 4 };
    loop {
        let (seconds, peak) = render(scene, samples, 1, &out)?;
        let error = rel_mse(&beauty(&out.join(format!("{name}.0000.exr")))?, &references);
        report.row(
            &format!("convergence.{name}.{samples}"),
            &[("cpu_s", seconds, ""), ("rel_mse", error, ""), ("peak_mb", peak, "")],
        );
        if error <= goal || samples >= reference {
            let (before, worse) = last.unwrap_or((seconds, error));
            let slope =
                if error < worse { (goal / error).ln() / (worse / error).ln() } else { 0.0 };
            let to_goal = seconds * (before / seconds).powf(slope);
            report.row(
                &format!("convergence.{name}.to {goal}"),
                &[("cpu_s", to_goal, ""), ("peak_mb", peak, "")],
            );
            return Ok(());
        }
        last = Some((seconds, error));
        samples *= 4;
    }
}

/// Writes a scene, and tells where it is.
type Scene<'a> = &'a dyn Fn() -> Result<PathBuf, Failure>;

/// Measures four scenes; what goes wrong is told, and the others go on.
pub fn run(options: &Options, report: &mut Report) {
    section("convergence: CPU-seconds of the whole render to a relMSE, 256 × 256");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("speed");
    let cornell = || Ok(Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.ron"));
    let scenes: [(Scene, &[f64]); 4] = [
        (&cornell, &[GOAL]),
        (&|| displaced(&folder), &[GOAL]),
        (&|| moving(&folder), &[GOAL]),
        (&|| fog(&folder), &GOALS_IN_FOG),
    ];
    let samples = if options.quick { 256 } else { 1024 };
    for (scene, goals) in scenes {
        let done = std::fs::create_dir_all(&folder).map_err(Failure::from).and_then(|()| {
            let scene = scene()?;
            goals.iter().try_for_each(|&goal| converge(&scene, &folder, samples, goal, report))
        });
        if let Err(failure) = done {
            eprintln!("convergence: {failure}");
        }
    }
}
