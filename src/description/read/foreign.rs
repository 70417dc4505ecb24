//! Files which are no scenes, given as one: what they are, and what can be done with them.

use crate::description::diagnostic::{Diagnostic, Diagnostics, Severity};
use std::path::Path;

/// How files of other kinds begin.
const BEGINNINGS: [(&[u8], &str); 9] = [
    (b"glTF", "glb"),
    (b"\x89PNG", "png"),
    (b"\xff\xd8\xff", "jpg"),
    (b"\x76\x2f\x31\x01", "exr"),
    (b"#?RADIANCE", "hdr"),
    (b"#?RGBE", "hdr"),
    (b"VOL", "vol"),
    (b"BLENDER", "blend"),
    (b"%PDF", "pdf"),
];

/// What a file is, and what can be done with it, by how it begins and how its name ends; `None` of what may be a scene.
pub(super) fn recognised(path: &Path, bytes: &[u8]) -> Option<Diagnostics> {
    let begins =
        BEGINNINGS.iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, kind)| *kind);
    let ending = path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    let kind = begins.or(ending.as_deref())?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let (what, help) = match kind {
        "glb" | "gltf" | "obj" => (
            "a mesh",
            format!(
                "write a scene that shows it: `meshes: {{\"m\": File(\"{name}\")}}`, and in `entities` \
                 a shape `Mesh(\"m\")`, a light and a camera"
            ),
        ),
        "png" | "jpg" | "jpeg" | "hdr" => (
            "an image",
            format!("a scene can use it: `textures: {{\"t\": Image(file: \"{name}\")}}`"),
        ),
        "exr" => (
            "an OpenEXR image",
            format!(
                "a scene can use it: `textures: {{\"t\": Image(file: \"{name}\")}}`; \
                 `kinora develop` makes a PNG of a frame"
            ),
        ),
        "vol" => (
            "a grid of numbers",
            format!("a scene can use it: `textures: {{\"t\": Grid(file: \"{name}\")}}`"),
        ),
        "ttf" | "otf" => (
            "a font",
            "a scene can use it for a mesh: `Text(text: …, font: …, size: …, depth: …, tolerance: …)`"
                .to_owned(),
        ),
        "blend" | "pbrt" | "xml" | "pov" | "lxs" | "scn" | "usd" | "usda" | "usdc" | "fbx" | "dae" | "stl"
        | "ply" | "3ds" | "abc" => (
            "of another program",
            "its meshes can be read from OBJ and glTF, if that program writes them; \
             docs/from-other-renderers.md tells how the rest is said here"
                .to_owned(),
        ),
        "md" | "txt" | "html" | "htm" | "pdf" | "json" | "toml" | "yaml" | "yml" | "csv" | "rs" | "py"
            if !begins_as_a_scene(bytes) =>
        (
            "not one",
            "a scene is a text in RON, `Scene(entities: {…})`, in a file such as `ball.ron`; \
             docs/scene-format.md describes it"
                .to_owned(),
        ),
        _ => return None,
    };
    Some(Diagnostics(vec![Diagnostic {
        severity: Severity::Error,
        code: "scene::not-a-scene",
        message: format!("a scene was expected, but `{name}` is {what}"),
        place: None,
        label: String::new(),
        related: Vec::new(),
        help: Some(help),
    }]))
}

/// Whether a text begins as a scene does, whatever its name: with a parenthesis, its name or a comment.
fn begins_as_a_scene(bytes: &[u8]) -> bool {
    let begin = bytes.trim_ascii_start();
    [&b"("[..], b"Scene", b"//", b"/*"].iter().any(|start| begin.starts_with(start))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_files_are_known_by_how_they_begin_and_by_their_names() {
        let told = |name: &str, bytes: &[u8]| {
            recognised(Path::new(name), bytes).map(|told| told.render(false)).unwrap_or_default()
        };
        assert!(told("a/model.glb", b"glTF").contains("`model.glb` is a mesh"));
        assert!(told("model.obj", b"v 0 0 0").contains("File(\"model.obj\")"));
        assert!(told("README.md", b"# Kinora").contains("docs/scene-format.md"));
        assert!(told("frame.png", b"\x89PNG\r\n").contains("an image"));
        assert!(told("noname", b"\x89PNG\r\n").contains("an image"));
        assert!(told("cornell.pbrt", b"").contains("from-other-renderers"));
        // Whatever else a scene is called.
        for name in ["ball.ron", "ball", "ball.scene", "ball.txt"] {
            assert_eq!(told(name, b"(entities: {})"), "", "{name}");
        }
    }
}
