//! Words of other renderers, and what they are called here.

/// A word that people know from elsewhere, in small letters without `_`; a name that must be possible where it stands; and
/// what to do.
type Word = (&'static str, &'static str, &'static str);

/// In their order: the first whose name is possible counts.
const WORDS: [Word; 97] = [
    // Where things are.
    ("position", "translation", "`translation`"),
    ("location", "translation", "`translation`"),
    ("translate", "translation", "`translation`"),
    ("pos", "translation", "`translation`"),
    ("origin", "translation", "`translation`"),
    ("rotate", "rotation", "`rotation`, degrees about x, then y, then z"),
    ("euler", "rotation", "`rotation`, degrees about x, then y, then z"),
    ("target", "look_at", "`look_at`"),
    ("lookat", "look_at", "`look_at`"),
    ("position", "transform", "`transform: (translation: (x, y, z))`"),
    ("location", "transform", "`transform: (translation: (x, y, z))`"),
    ("translation", "transform", "`transform: (translation: (x, y, z))`"),
    ("translate", "transform", "`transform: (translation: (x, y, z))`"),
    ("rotation", "transform", "`transform: (rotation: (x, y, z))`, in degrees"),
    ("rotate", "transform", "`transform: (rotation: (x, y, z))`, in degrees"),
    ("scale", "transform", "`transform: (scale: s)`"),
    ("lookat", "transform", "`transform: (translation: (x, y, z), look_at: (x, y, z))`"),
    ("target", "transform", "`transform: (translation: (x, y, z), look_at: (x, y, z))`"),
    // What an entity has.
    ("mesh", "shape", "`shape: Mesh(\"name\")`, of a mesh in `meshes`"),
    ("geometry", "shape", "`shape`"),
    ("primitive", "shape", "`shape`"),
    ("bsdf", "material", "`material: \"name\"`, of a material in `materials`"),
    ("shader", "material", "`material: \"name\"`, of a material in `materials`"),
    ("emitter", "emission", "`emission: Radiance(…)` beside a `shape`, or a `light`"),
    ("emissive", "emission", "`emission: Radiance(…)` beside a `shape`"),
    ("animation", "keyframes", "`keyframes`"),
    ("visible", "hidden_from_camera", "`hidden_from_camera: true`"),
    ("name", "transform", "the key before the colon: `\"name\": (…)` in `entities`"),
    // Materials.
    ("glass", "Dielectric", "`Dielectric(ior: 1.5)`, or `ThinGlass()` for a pane"),
    ("water", "Dielectric", "`Dielectric(ior: 1.33)`"),
    ("refractive", "Dielectric", "`Dielectric(ior: 1.5)`"),
    ("transparent", "Dielectric", "`Dielectric(ior: 1.5)`, or `Masked` for what has holes"),
    ("roughdielectric", "Dielectric", "`Dielectric(ior: 1.5, roughness: 0.2)`"),
    ("thindielectric", "ThinGlass", "`ThinGlass()`"),
    ("lambert", "Diffuse", "`Diffuse(albedo: …)`"),
    ("lambertian", "Diffuse", "`Diffuse(albedo: …)`"),
    ("matte", "Diffuse", "`Diffuse(albedo: …)`"),
    ("metal", "Conductor", "`Conductor(metal: Gold, roughness: 0.1)`"),
    ("metallic", "Conductor", "`Conductor(metal: Gold, roughness: 0.1)`"),
    ("roughconductor", "Conductor", "`Conductor(metal: Gold, roughness: 0.1)`"),
    ("gold", "Conductor", "`Conductor(metal: Gold)`"),
    ("silver", "Conductor", "`Conductor(metal: Silver)`"),
    ("specular", "Mirror", "`Mirror()`, or `Conductor` and `Dielectric` for metal and glass"),
    ("reflective", "Mirror", "`Mirror()`, or `Conductor` for metal"),
    ("glossy", "Plastic", "`Plastic(albedo: …, roughness: 0.2)`, or `Conductor` for metal"),
    ("phong", "Plastic", "`Plastic(albedo: …, roughness: 0.2)`"),
    ("coateddiffuse", "Plastic", "`Plastic(albedo: …, roughness: 0.2)`"),
    ("roughplastic", "Plastic", "`Plastic(albedo: …, roughness: 0.2)`"),
    ("uber", "Principled", "`Principled(base_color: …)`"),
    ("disney", "Principled", "`Principled(base_color: …)`"),
    ("pbr", "Principled", "`Principled(base_color: …)`"),
    ("standard", "Principled", "`Principled(base_color: …)`"),
    ("principledbsdf", "Principled", "`Principled(base_color: …)`"),
    (
        "emissive",
        "Diffuse",
        "no material: an entity with a `shape` shines by `emission: Radiance(…)`",
    ),
    (
        "emission",
        "Diffuse",
        "no material: an entity with a `shape` shines by `emission: Radiance(…)`",
    ),
    ("light", "Diffuse", "no material: an entity with a `shape` shines by `emission: Radiance(…)`"),
    (
        "arealight",
        "Diffuse",
        "no material: an entity with a `shape` shines by `emission: Radiance(…)`",
    ),
    (
        "translucent",
        "Dielectric",
        "`Dielectric(…)` with `scattering`, a solid that light wanders through",
    ),
    (
        "subsurface",
        "Dielectric",
        "`Dielectric(…)` with `scattering`, a solid that light wanders through",
    ),
    ("volume", "Dielectric", "`Dielectric(ior: 1, …)` with `scattering`, a solid of mist"),
    ("null", "Dielectric", "`Dielectric(ior: 1)`, which is not seen"),
    ("blend", "Mix", "`Mix(a: …, b: …, amount: …)`"),
    ("mask", "Masked", "`Masked(material: …, opacity: …)`"),
    // Parameters.
    ("color", "albedo", "`albedo`"),
    ("diffuse", "albedo", "`albedo`"),
    ("reflectance", "albedo", "`albedo`"),
    ("basecolor", "albedo", "`albedo`"),
    ("color", "base_color", "`base_color`"),
    ("color", "reflectance", "`reflectance`"),
    ("color", "f0", "`f0`, or `metal` for one that is known"),
    ("intior", "ior", "`ior`, that of the inside; the outside is air or the solid around"),
    ("eta", "ior", "`ior`"),
    ("alpha", "roughness", "`roughness`, the square root of the width of the microfacets"),
    ("shininess", "roughness", "`roughness`, 0 for a mirror and 1 for a matt surface"),
    // Shapes.
    ("cube", "Box", "`Box(size: (1, 1, 1))`"),
    ("cuboid", "Box", "`Box(size: (1, 1, 1))`"),
    ("quad", "Rectangle", "`Rectangle(size: (1, 1))`"),
    ("torus", "Revolution", "`Revolution(profile: \"name\")` of a circle in `profiles`"),
    ("lathe", "Revolution", "`Revolution(profile: \"name\")` of a profile in `profiles`"),
    ("trianglemesh", "Mesh", "`Mesh(\"name\")` of a mesh in `meshes`"),
    ("obj", "Mesh", "`Mesh(\"name\")` of `\"name\": File(\"it.obj\")` in `meshes`"),
    ("obj", "File", "`File(\"it.obj\")`"),
    // Lights and cameras.
    ("sun", "Directional", "`Directional(irradiance: …, angle: 0.53)`, shining along its −z"),
    ("distant", "Directional", "`Directional(irradiance: …)`, shining along its −z"),
    (
        "area",
        "Directional",
        "no light of its own: an entity with a `shape` shines by `emission: Radiance(…)`",
    ),
    ("environment", "Sky", "`Sky(radiance: \"texture\")`"),
    ("envmap", "Sky", "`Sky(radiance: \"texture\")`"),
    ("infinite", "Sky", "`Sky(radiance: …)`"),
    ("hdri", "Sky", "`Sky(radiance: \"texture\")`"),
    ("color", "intensity", "`intensity`, a number or a colour in W/sr"),
    ("focallength", "fov", "`fov_x` in degrees: 2·atan(18 / f) for f mm on a frame 36 mm wide"),
    ("fstop", "f_number", "`f_number`"),
    // The scene and its settings.
    (
        "lights",
        "entities",
        "an entity with a `light`, or with a `shape` and `emission`, in `entities`",
    ),
    ("objects", "entities", "`entities`"),
    ("width", "size", "`size: (width, height)`"),
    ("height", "size", "`size: (width, height)`"),
    ("resolution", "size", "`size: (width, height)`"),
];

/// What is said here for a word of another renderer, where these names are possible.
pub(super) fn hint(word: &str, possible: &[&str]) -> Option<String> {
    let plain: String = word.chars().filter(|c| *c != '_').flat_map(char::to_lowercase).collect();
    // What is only spelt otherwise is no word of another renderer.
    if possible.iter().any(|name| name.replace('_', "").eq_ignore_ascii_case(&plain)) {
        return None;
    }
    let known = |(known, name, _): &&Word| *known == plain && possible.contains(name);
    WORDS.iter().find(known).map(|(_, _, ours)| format!("here that is {ours}"))
}
