//! Scenes of several files, and files which cannot be used.

use super::*;

#[test]
fn included_files_are_merged_and_the_including_file_has_the_last_word() {
    let folder = folder(&[
        (
            "scene.ron",
            r#"(include: ["parts/studio.ron", "parts/set.ron"], render: (samples: 8),
            entities: {"ball": (shape: Sphere(), material: "red")})"#,
        ),
        (
            "parts/studio.ron",
            r#"(include: ["set.ron"], render: (samples: 2, max_depth: 3),
            clock: (fps: 30), entities: {"eye": (camera: ())})"#,
        ),
        ("parts/set.ron", r#"(materials: {"red": Diffuse(albedo: (1, 0, 0))})"#),
    ]);
    let path = folder.path().join("scene.ron");
    let scene = load_scene(&path, &LoadOptions::default()).expect("it is right");
    assert_eq!((scene.render.samples, scene.render.max_depth), (8, 3));
    assert!((scene.clock.fps - 30.0).abs() < f64::EPSILON);
    assert_eq!(scene.entities.keys().collect::<Vec<_>>(), ["eye", "ball"]);
    assert_eq!((scene.camera.as_str(), scene.files.len()), ("eye", 3));
    let overrides = vec![
        ("render.max_depth".into(), "5".into()),
        ("entities.eye.camera.fov".into(), "20".into()),
    ];
    let options = LoadOptions { overrides, ..LoadOptions::default() };
    let changed = load_scene(&path, &options).expect("it is right");
    assert_eq!((changed.render.samples, changed.render.max_depth), (8, 5));
    let fov = changed.entities["eye"].camera.as_ref().expect("it has one").fov;
    assert!((fov - 20.0).abs() < f64::EPSILON);
}

/// Any byte of any file counts, and where the folder lies does not.
#[test]
fn the_content_hash_covers_all_files() {
    let files = [
        ("scene.ron", r#"(include: ["eye.ron"])"#),
        ("eye.ron", r#"(entities: {"eye": (camera: ())})"#),
    ];
    let hash = |folder: &tempfile::TempDir| {
        let path = folder.path().join("scene.ron");
        load_scene(&path, &LoadOptions::default()).expect("it is right").content_hash
    };
    let (first, second) = (folder(&files), folder(&files));
    assert_eq!(hash(&first), hash(&second));
    let [scene, (eye, text)] = files;
    assert_ne!(hash(&first), hash(&folder(&[scene, (eye, &format!("{text} "))])));
}

/// They tell for themselves what they change.
#[test]
fn the_content_hash_leaves_clock_and_settings_out() {
    let hash = |settings: &str| {
        let text = format!(r#"({settings} entities: {{"eye": (camera: ())}})"#);
        let scene = parse_scene_str("a.ron", &text, None, &LoadOptions::default());
        scene.expect("it is right").content_hash
    };
    let plain = hash("render: (samples: 3), clock: (fps: 25),");
    assert_eq!(hash("render: (/* more */ samples: 4), clock: (frames: (0, 9)),"), plain);
    assert_ne!(hash(r#"render: (), clock: (), textures: {"t": Gradient()},"#), plain);
}

#[test]
fn names_defined_in_two_files_are_told_with_both_places() {
    let folder = folder(&[
        ("scene.ron", r#"(include: ["eye.ron"], entities: {"eye": (camera: ())})"#),
        ("eye.ron", r#"(entities: {"eye": (camera: ())})"#),
    ]);
    insta::assert_snapshot!(mistakes_of_file(&folder, "scene.ron"), @r#"
    error[scene::duplicate]: `eye` is given twice
     --> …/scene.ron:1:35
      |
    1 | (include: ["eye.ron"], entities: {"eye": (camera: ())})
      |                                   ^^^^^ entities.eye
      |
     ::: …/eye.ron:1:13
      |
    1 | (entities: {"eye": (camera: ())})
      |             ----- first given here
    "#);
}

#[test]
fn files_which_include_themselves_or_are_missing_are_told() {
    let folder = folder(&[
        ("a.ron", r#"(include: ["b.ron", "c.rno", "."])"#),
        ("b.ron", r#"(include: ["a.ron", "d.ron"])"#),
        ("c.ron", "()"),
        ("d.ron", "(entities: {"),
    ]);
    insta::assert_snapshot!(mistakes_of_file(&folder, "a.ron"), @r#"
    error[scene::include]: `a.ron` includes itself
     --> …/b.ron:1:12
      |
    1 | (include: ["a.ron", "d.ron"])
      |            ^^^^^^^ include.0

    error[scene::syntax]: this `{` is never closed by a `}`
     --> …/d.ron:1:12
      |
    1 | (entities: {
      |            ^

    error[scene::missing-file]: the file `c.rno` does not exist
     --> …/a.ron:1:21
      |
    1 | (include: ["b.ron", "c.rno", "."])
      |                     ^^^^^^^ include.1
      |
      = help: did you mean `c.ron`?

    error[scene::not-a-file]: `.` is not a regular file
     --> …/a.ron:1:30
      |
    1 | (include: ["b.ron", "c.rno", "."])
      |                              ^^^ include.2
    "#);
}

#[test]
fn what_is_probably_not_meant_is_told_as_a_warning() {
    let text = r#"(entities: {"eye": (camera: ()), "ball": (shape: Sphere(), material: "used")},
        textures: {"deep": Checker(), "idle": Checker()},
        materials: {"part": Diffuse(albedo: "deep"), "used": Masked(material: "part", opacity: 1),
                    "idle": Mirror()})"#;
    insta::assert_snapshot!(scene(text).warnings.to_string(), @r#"
    scene.ron:2:39: nothing uses the texture `idle`
    scene.ron:4:21: nothing uses the material `idle`
    the scene has no light: every picture of it is black
    "#);
}

/// The scenes which come with the program.
#[test]
fn the_scenes_of_the_repository_are_right() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut count = 0;
    for entry in folder.read_dir().expect("the scenes are there") {
        let path = entry.expect("readable").path();
        if path.extension().is_some_and(|ending| ending == "ron") {
            let scene = load_scene(&path, &LoadOptions::default());
            let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
            assert_eq!(scene.warnings.render(false), "", "{}", path.display());
            count += 1;
        }
    }
    assert!(count > 0);
}

#[test]
fn files_which_cannot_be_used_are_told_where_they_are_named() {
    let folder = folder(&[
        (
            "scene.ron",
            r#"(textures: {"a": Image(file: "gone.png"), "b": Image(file: "../../b.png"),
            "c": Image(file: "text.png")}, meshes: {"m": File("text.obj")},
            entities: {"eye": (camera: ())})"#,
        ),
        ("text.png", "this is no image"),
        ("text.obj", "f 1 2 3"),
    ]);
    insta::assert_snapshot!(mistakes_of_file(&folder, "scene.ron"), @r#"
    error[scene::missing-file]: the file `gone.png` does not exist
     --> …/scene.ron:1:30
      |
    1 | (textures: {"a": Image(file: "gone.png"), "b": Image(file: "../../b.png"),
      |                              ^^^^^^^^^^ textures.a.Image.file
      |
      = help: files are looked for beside the scene, in `assets/` beside it or beside its folder, and in the asset folders of the command line

    error[scene::missing-file]: the file `../../b.png` does not exist
     --> …/scene.ron:1:60
      |
    1 | (textures: {"a": Image(file: "gone.png"), "b": Image(file: "../../b.png"),
      |                                                            ^^^^^^^^^^^^^ textures.b.Image.file
      |
      = help: files are looked for beside the scene, in `assets/` beside it or beside its folder, and in the asset folders of the command line

    error[scene::asset]: this image cannot be used: `…/text.png` is of an unknown format; expected an image: PNG, JPEG, Radiance HDR or OpenEXR
     --> …/scene.ron:2:30
      |
    2 |             "c": Image(file: "text.png")}, meshes: {"m": File("text.obj")},
      |                              ^^^^^^^^^^ textures.c.Image.file

    error[scene::asset]: this mesh cannot be used: `…/text.obj`, line 1: found position 1, expected one of the 0 given so far
     --> …/scene.ron:2:63
      |
    2 |             "c": Image(file: "text.png")}, meshes: {"m": File("text.obj")},
      |                                                               ^^^^^^^^^^ meshes.m.File
    "#);
}

#[test]
fn scenes_which_are_no_files_are_told() {
    let folder = folder(&[("empty.ron", "")]);
    insta::assert_snapshot!(mistakes_of_file(&folder, ""), @"error[scene::not-a-file]: `…/` is not a regular file");
    insta::assert_snapshot!(mistakes_of_file(&folder, "gone.ron"), @"error[scene::missing-file]: the file `…/gone.ron` does not exist");
    insta::assert_snapshot!(mistakes_of_file(&folder, "empty.ron"), @r#"
    error[scene::syntax]: expected a value, found the end of the text
     --> …/empty.ron:1:1
      |
    1 |
      | ^
    "#);
}
