//! Reading scenes: what the tests have in common.

mod files;
mod mistakes;
mod scenes;

use super::*;

/// The loaded scene, for texts that are right.
fn scene(text: &str) -> SceneDescription {
    match parse_scene_str("scene.ron", text, None, &LoadOptions::default()) {
        Ok(scene) => scene,
        Err(mistakes) => panic!("{}", mistakes.render(false)),
    }
}

/// The report, for texts that are wrong.
fn mistakes(text: &str) -> String {
    with_settings(text, &[]).expect_err("it is wrong").render(false)
}

fn with_settings(text: &str, settings: &[(&str, &str)]) -> Result<SceneDescription, Diagnostics> {
    let overrides = settings.iter().map(|&(path, value)| (path.into(), value.into())).collect();
    let options = LoadOptions { overrides, ..LoadOptions::default() };
    parse_scene_str("scene.ron", text, None, &options)
}

/// A scene with a camera and one more entity.
fn with_entity(entity: &str) -> String {
    format!("(entities: {{\"cam\": (camera: ()),\n\"it\": ({entity})}})")
}

/// A scene with a camera and one material.
fn with_material(material: &str) -> String {
    format!("(entities: {{\"cam\": (camera: ())}},\nmaterials: {{\"it\": {material}}})")
}

/// A scene with a camera and one more part.
fn with_part(part: &str) -> String {
    format!("(entities: {{\"cam\": (camera: ())}},\n{part})")
}

/// The scene of the design page, with an image and no mesh file.
const VALID: &str = r#"// A glass ball rolls over a chequered floor.
Scene(
    clock: (fps: 24, frames: (0, 47), shutter: (0.0, 0.5)),
    render: (size: (640, 480), samples: 128, max_depth: 16, tonemap: Agx,
             filter: Gaussian(sigma: 0.4), layers: [Beauty, Depth], clamp_indirect: 10),
    textures: { "checks": Checker(size: 0.5, a: (0.8, 0.8, 0.8), b: (0.1, 0.1, 0.1)) },
    materials: {
        "glass": Dielectric(ior: 1.5, attenuation: (color: (0.5, 0.9, 0.9), distance: 0.1)),
        "gold": Conductor(metal: Gold, roughness: 0.1),
        "floor": Diffuse(albedo: "checks"),
        "half": Mix(a: "gold", b: "floor", amount: 0.25),
    },
    meshes: { "tri": Triangles(positions: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], triangles: [(0, 1, 2)]) },
    entities: {
        "camera": (transform: (translation: (0, 1, 5), look_at: (0, 1, 0)),
                   camera: (fov: 40, aperture: 0.05, focus: "ball")),
        "ball": (transform: (translation: (-2, 1, 0)), shape: Sphere(radius: 1), material: "glass",
                 velocity: (linear: (1, 0, 0), angular: (0, 0, -60))),
        "moon": (parent: "ball", shape: Mesh("tri"), material: "half", acceleration: (0, -9.81, 0),
                 keyframes: (turn: (axis: (0, 2, 0), keys: [(0, 0), (2, 720)], extend: Loop),
                             scale: (keys: [(0, 1), (1, (1, 2, 3))]),
                             translation: (keys: [(0, (0, 0, 0)), (1, (1, 0, 0), (0, 1, 0))], interpolation: Cubic))),
        "floor": (shape: Plane(), material: "floor"),
        "lamp": (transform: (translation: (0, 4, 0), rotation: (90, 0, 0)), shape: Rectangle(size: (1, 1)),
                 emission: Radiance((12, 12, 10)), two_sided: true, hidden_from_camera: true),
        "sky": (light: Sky(radiance: 0.1)),
    },
)
"#;

static LOOSE: LoadOptions = LoadOptions {
    asset_dirs: Vec::new(),
    allow_outside: false,
    overrides: Vec::new(),
    camera: None,
};

/// Writes files into a fresh folder.
fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("it has one")).expect("fresh folder");
        std::fs::write(path, text).expect("writable");
    }
    folder
}

/// The report of a scene file, with the temporary folder's name taken out.
fn mistakes_of_file(folder: &tempfile::TempDir, name: &str) -> String {
    let path = folder.path().join(name);
    let mistakes = load_scene(&path, &LoadOptions::default()).expect_err("it is wrong");
    let plain = folder.path().display().to_string();
    let real = folder.path().canonicalize().expect("it exists").display().to_string();
    mistakes.render(false).replace(&real, "…").replace(&plain, "…")
}
