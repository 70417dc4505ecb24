//! Mistakes in scene files and how they are told; whole scenes and what becomes of them.

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

#[test]
fn an_unknown_field_is_told_with_the_one_that_was_meant() {
    insta::assert_snapshot!(mistakes(&with_entity("shape: Sphere(raduis: 1)")), @r#"
    error[scene::unknown-field]: `Sphere` has no field `raduis`
     --> scene.ron:2:22
      |
    2 | "it": (shape: Sphere(raduis: 1))})
      |                      ^^^^^^ entities.it.shape.Sphere.raduis
      |
      = help: did you mean `radius`?
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("shap: Sphere()")), @r#"
    error[scene::unknown-field]: an entity has no field `shap`
     --> scene.ron:2:8
      |
    2 | "it": (shap: Sphere())})
      |        ^^^^ entities.it.shap
      |
      = help: did you mean `shape`?
    "#);
    insta::assert_snapshot!(mistakes(&with_part("rendr: ()")), @r#"
    error[scene::unknown-field]: a scene has no field `rendr`
     --> scene.ron:2:1
      |
    2 | rendr: ())
      | ^^^^^ rendr
      |
      = help: did you mean `render`?
    "#);
    insta::assert_snapshot!(mistakes(&with_part("render: (max_dept: 3, sampels: 1)")), @r#"
    error[scene::unknown-field]: `render` has no field `max_dept`
     --> scene.ron:2:10
      |
    2 | render: (max_dept: 3, sampels: 1))
      |          ^^^^^^^^ render.max_dept
      |
      = help: did you mean `max_depth`?

    error[scene::unknown-field]: `render` has no field `sampels`
     --> scene.ron:2:23
      |
    2 | render: (max_dept: 3, sampels: 1))
      |                       ^^^^^^^ render.sampels
      |
      = help: did you mean `samples`?
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("transform: (translatoin: (0, 0, 0))")), @r#"
    error[scene::unknown-field]: `transform` has no field `translatoin`
     --> scene.ron:2:20
      |
    2 | "it": (transform: (translatoin: (0, 0, 0)))})
      |                    ^^^^^^^^^^^ entities.it.transform.translatoin
      |
      = help: did you mean `translation`?
    "#);
}

#[test]
fn an_unknown_variant_is_told_with_the_one_that_was_meant() {
    insta::assert_snapshot!(mistakes(&with_entity("shape: Spere(radius: 1)")), @r#"
    error[scene::unknown-variant]: there is no `Spere` to choose here
     --> scene.ron:2:15
      |
    2 | "it": (shape: Spere(radius: 1))})
      |               ^^^^^ entities.it.shape
      |
      = help: did you mean `Sphere`?
    "#);
    insta::assert_snapshot!(mistakes(&with_material("Conductor(metal: Goold)")), @r#"
    error[scene::unknown-variant]: there is no `Goold` to choose here
     --> scene.ron:2:36
      |
    2 | materials: {"it": Conductor(metal: Goold)})
      |                                    ^^^^^ materials.it.Conductor.metal
      |
      = help: did you mean `Gold`?
    "#);
}

#[test]
fn a_wrong_type_is_told_with_what_was_expected() {
    insta::assert_snapshot!(mistakes(&with_entity("shape: Sphere(radius: \"big\")")), @r#"
    error[scene::wrong-type]: expected a number, found `"big"`
     --> scene.ron:2:30
      |
    2 | "it": (shape: Sphere(radius: "big"))})
      |                              ^^^^^ entities.it.shape.Sphere.radius
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("hidden_from_camera: 1")), @r#"
    error[scene::wrong-type]: expected `true` or `false`, found `1`
     --> scene.ron:2:28
      |
    2 | "it": (hidden_from_camera: 1)})
      |                            ^ entities.it.hidden_from_camera
    "#);
    insta::assert_snapshot!(mistakes(&with_material("Diffuse(albedo: true)")), @r#"
    error[scene::wrong-type]: expected a number, a colour (r, g, b) or the name of a texture, found the boolean `true`
     --> scene.ron:2:35
      |
    2 | materials: {"it": Diffuse(albedo: true)})
      |                                   ^^^^ materials.it.Diffuse.albedo
    "#);
    insta::assert_snapshot!(mistakes(&with_material("Diffuse(albedo: (1, 0))")), @r#"
    error[scene::wrong-type]: expected three numbers (r, g, b), found 2 values
     --> scene.ron:2:35
      |
    2 | materials: {"it": Diffuse(albedo: (1, 0))})
      |                                   ^^^^^^ materials.it.Diffuse.albedo
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("transform: (translation: (1, 2))")), @r#"
    error[scene::wrong-type]: expected a sequence of 3 f64 values, found 2 values
     --> scene.ron:2:33
      |
    2 | "it": (transform: (translation: (1, 2)))})
      |                                 ^^^^^^ entities.it.transform.translation
    "#);
    insta::assert_snapshot!(mistakes(&with_part("render: (samples: -1)")), @r#"
    error[scene::out-of-range]: `-1` is out of the range of this integer
     --> scene.ron:2:19
      |
    2 | render: (samples: -1))
      |                   ^^ render.samples
    "#);
    insta::assert_snapshot!(mistakes(&with_part("render: (seed: 99999999999999999999999999)")), @r#"
    error[scene::out-of-range]: `999999999999999999999999…` is out of the range of this integer
     --> scene.ron:2:16
      |
    2 | render: (seed: 99999999999999999999999999))
      |                ^^^^^^^^^^^^^^^^^^^^^^^^^^ render.seed
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("light: Spot(angle: 3)")), @r#"
    error[scene::missing-field]: `Spot` needs a field `intensity`
     --> scene.ron:2:15
      |
    2 | "it": (light: Spot(angle: 3))})
      |               ^^^^^^^^^^^^^^ entities.it.light
    "#);
}

#[test]
fn a_misspelt_reference_is_told_with_the_name_that_was_meant() {
    let text = r#"(
        textures: {"checks": Checker()},
        materials: {"floor": Diffuse(albedo: "cheks"), "mix": Mix(a: "flor", b: "floor")},
        meshes: {"tri": Triangles(positions: [(0,0,0), (1,0,0), (0,1,0)], triangles: [(0,1,2)])},
        camera: "camra",
        entities: {
            "camera": (camera: (focus: "bal")),
            "ball": (shape: Mesh("try"), material: "metal", parent: "camer"),
        },
    )"#;
    insta::assert_snapshot!(mistakes(text), @r#"
    error[scene::unknown-name]: there is no texture named `cheks`
     --> scene.ron:3:46
      |
    3 |         materials: {"floor": Diffuse(albedo: "cheks"), "mix": Mix(a: "flor", b: "floor")},
      |                                              ^^^^^^^ materials.floor.Diffuse.albedo
      |
      = help: did you mean `checks`?

    error[scene::unknown-name]: there is no material named `flor`
     --> scene.ron:3:70
      |
    3 |         materials: {"floor": Diffuse(albedo: "cheks"), "mix": Mix(a: "flor", b: "floor")},
      |                                                                      ^^^^^^ materials.mix.Mix.a
      |
      = help: did you mean `floor`?

    error[scene::unknown-name]: there is no entity named `camra`
     --> scene.ron:5:17
      |
    5 |         camera: "camra",
      |                 ^^^^^^^ camera
      |
      = help: did you mean `camera`?

    error[scene::unknown-name]: there is no entity named `bal`
     --> scene.ron:7:40
      |
    7 |             "camera": (camera: (focus: "bal")),
      |                                        ^^^^^ entities.camera.camera.focus
      |
      = help: did you mean `ball`?

    error[scene::unknown-name]: there is no mesh named `try`
     --> scene.ron:8:34
      |
    8 |             "ball": (shape: Mesh("try"), material: "metal", parent: "camer"),
      |                                  ^^^^^ entities.ball.shape.Mesh
      |
      = help: did you mean `tri`?

    error[scene::unknown-name]: there is no material named `metal`
     --> scene.ron:8:52
      |
    8 |             "ball": (shape: Mesh("try"), material: "metal", parent: "camer"),
      |                                                    ^^^^^^^ entities.ball.material
      |
      = help: materials: `floor`, `mix`

    error[scene::unknown-name]: there is no entity named `camer`
     --> scene.ron:8:69
      |
    8 |             "ball": (shape: Mesh("try"), material: "metal", parent: "camer"),
      |                                                                     ^^^^^^^ entities.ball.parent
      |
      = help: did you mean `camera`?
    "#);
}

#[test]
fn cycles_are_told_with_the_way_around() {
    let text = r#"(entities: {"cam": (camera: ()),
        "a": (parent: "b"), "b": (parent: "c"), "c": (parent: "a"), "d": (parent: "a")},
        materials: {"m": Mix(a: "n", b: "o"), "n": Masked(material: "m", opacity: 1), "o": Diffuse()})"#;
    insta::assert_snapshot!(mistakes(text), @r#"
    error[scene::cycle]: `c` is its own ancestor: `a` → `b` → `c` → `a`
     --> scene.ron:2:63
      |
    2 |         "a": (parent: "b"), "b": (parent: "c"), "c": (parent: "a"), "d": (parent: "a")},
      |                                                               ^^^ entities.c.parent

    error[scene::cycle]: the material `n` is made of itself: `m` → `n` → `m`
     --> scene.ron:3:69
      |
    3 |         materials: {"m": Mix(a: "n", b: "o"), "n": Masked(material: "m", opacity: 1), "o": Diffuse()})
      |                                                                     ^^^ materials.n.Masked.material
    "#);
}

#[test]
fn a_scene_needs_one_camera_or_a_choice() {
    insta::assert_snapshot!(mistakes(r#"(entities: {"a": (camera: ()), "b": (camera: ())})"#), @r#"
    error[scene::camera]: the scene has 2 cameras and chooses none
     --> scene.ron:1:19
      |
    1 | (entities: {"a": (camera: ()), "b": (camera: ())})
      |                   ^^^^^^             ------ entities.b.camera
      |                   |
      |                   entities.a.camera
      |
      = help: choose one, as in `camera: "a"`
    "#);
    insta::assert_snapshot!(mistakes(r#"(entities: {"a": ()})"#), @r#"
    error[scene::camera]: the scene has no camera
     |
     = help: add an entity such as "camera": (transform: (translation: (0, 1, 5)), camera: ())
    "#);
    insta::assert_snapshot!(mistakes(r#"(camera: "b", entities: {"a": (camera: ()), "b": ()})"#), @r#"
    error[scene::camera]: the entity `b` has no camera
     --> scene.ron:1:10
      |
    1 | (camera: "b", entities: {"a": (camera: ()), "b": ()})
      |          ^^^ camera
      |
      = help: did you mean `a`?
    "#);
    let chosen = scene(r#"(camera: "b", entities: {"a": (camera: ()), "b": (camera: ())})"#);
    assert_eq!(chosen.camera, "b");
}

#[test]
fn numbers_out_of_range_are_told_with_the_range() {
    insta::assert_snapshot!(mistakes(&with_entity("shape: Sphere(radius: -1)")), @r#"
    error[scene::out-of-range]: `radius` must be at least 1e-12 and at most 1e15 metres, but is -1
     --> scene.ron:2:30
      |
    2 | "it": (shape: Sphere(radius: -1))})
      |                              ^^ entities.it.shape.Sphere.radius
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("shape: Box(size: (1, 0, 1))")), @r#"
    error[scene::out-of-range]: `size` must be at least 1e-12 and at most 1e15 metres, but is 0
     --> scene.ron:2:29
      |
    2 | "it": (shape: Box(size: (1, 0, 1)))})
      |                             ^ entities.it.shape.Box.size.1
    "#);
    insta::assert_snapshot!(mistakes(&with_material("Diffuse(albedo: (0.5, 1.5, 0.5))")), @r#"
    error[scene::out-of-range]: `albedo` must be at least 0 and at most 1, but is 1.5
     --> scene.ron:2:41
      |
    2 | materials: {"it": Diffuse(albedo: (0.5, 1.5, 0.5))})
      |                                         ^^^ materials.it.Diffuse.albedo.1
    "#);
    insta::assert_snapshot!(mistakes(&with_material("Dielectric(ior: 0.9)")), @r#"
    error[scene::out-of-range]: `ior` must be at least 1 and at most 10, but is 0.9
     --> scene.ron:2:35
      |
    2 | materials: {"it": Dielectric(ior: 0.9)})
      |                                   ^^^ materials.it.Dielectric.ior
    "#);
    insta::assert_snapshot!(mistakes(&with_part("render: (size: (0, 480))")), @r#"
    error[scene::out-of-range]: `size` must be at least 1 and at most 65536 pixels, but is 0
     --> scene.ron:2:17
      |
    2 | render: (size: (0, 480)))
      |                 ^ render.size.0
    "#);
    insta::assert_snapshot!(mistakes(&with_part("render: (size: (60000, 60000))")), @r#"
    error[scene::out-of-range]: `size` must be at least 1 and at most 268435456 pixels in all, but is 3600000000
     --> scene.ron:2:16
      |
    2 | render: (size: (60000, 60000)))
      |                ^^^^^^^^^^^^^^ render.size
    "#);
    insta::assert_snapshot!(
        mistakes(&with_entity("shape: Sphere(), transform: (scale: (1, 0, 1))")), @r#"
    error[scene::out-of-range]: the scale of a shape must not be zero
     --> scene.ron:2:44
      |
    2 | "it": (shape: Sphere(), transform: (scale: (1, 0, 1)))})
      |                                            ^^^^^^^^^ entities.it.transform.scale
    "#);
    insta::assert_snapshot!(mistakes(r#"(entities: {"cam": (camera: (fov: 180, blades: 2))})"#), @r#"
    error[scene::out-of-range]: `fov` must be greater than 0 and less than 180 degrees, but is 180
     --> scene.ron:1:35
      |
    1 | (entities: {"cam": (camera: (fov: 180, blades: 2))})
      |                                   ^^^ entities.cam.camera.fov

    error[scene::out-of-range]: `blades` must be at least 3 and at most 64 blades (or 0 for a round aperture), but is 2
     --> scene.ron:1:48
      |
    1 | (entities: {"cam": (camera: (fov: 180, blades: 2))})
      |                                                ^ entities.cam.camera.blades
    "#);
}

#[test]
fn numbers_which_are_not_finite_are_found_wherever_they_stand() {
    insta::assert_snapshot!(mistakes(&with_entity("shape: Sphere(radius: NaN)")), @r#"
    error[scene::not-finite]: `NaN` is not a finite number
     --> scene.ron:2:30
      |
    2 | "it": (shape: Sphere(radius: NaN))})
      |                              ^^^ entities.it.shape.Sphere.radius
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("acceleration: (0, -inf, 1e400)")), @r#"
    error[scene::not-finite]: `-inf` is not a finite number
     --> scene.ron:2:26
      |
    2 | "it": (acceleration: (0, -inf, 1e400))})
      |                          ^^^^ entities.it.acceleration.1

    error[scene::not-finite]: `1e400` is not a finite number
     --> scene.ron:2:32
      |
    2 | "it": (acceleration: (0, -inf, 1e400))})
      |                                ^^^^^ entities.it.acceleration.2
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("light: Point(power: (nan, 1, 1))")), @r#"
    error[scene::not-finite]: `nan` is not a finite number
     --> scene.ron:2:29
      |
    2 | "it": (light: Point(power: (nan, 1, 1)))})
      |                             ^^^ entities.it.light.Point.power.0
    "#);
    // 1e39 is a number of 64 bits, but not of 32.
    insta::assert_snapshot!(mistakes(&with_entity("light: Point(power: (1e39, 1, 1))")), @r#"
    error[scene::not-finite]: `power` must be at least 0 and at most 1e18, but is not a finite number
     --> scene.ron:2:29
      |
    2 | "it": (light: Point(power: (1e39, 1, 1)))})
      |                             ^^^^ entities.it.light.Point.power.0
    "#);
}

#[test]
fn components_without_their_partners_are_told() {
    let text = with_entity(
        "material: \"m\", emission: Radiance(1), two_sided: true, keyframes: (fov: (keys: [(0, 40)]))",
    );
    insta::assert_snapshot!(mistakes(&text.replace("(entities", "(materials: {\"m\": Mirror()}, entities")), @r#"
    error[scene::lonely]: `material` needs a `shape` in the same entity
     --> scene.ron:2:8
      |
    2 | "it": (material: "m", emission: Radiance(1), two_sided: true, keyframes: (fov: (keys: [(0, 40)])))})
      |        ^^^^^^^^ entities.it.material

    error[scene::lonely]: `emission` needs a `shape` in the same entity
     --> scene.ron:2:23
      |
    2 | "it": (material: "m", emission: Radiance(1), two_sided: true, keyframes: (fov: (keys: [(0, 40)])))})
      |                       ^^^^^^^^ entities.it.emission

    error[scene::lonely]: `keyframes.fov` needs a `camera` in the same entity
     --> scene.ron:2:75
      |
    2 | "it": (material: "m", emission: Radiance(1), two_sided: true, keyframes: (fov: (keys: [(0, 40)])))})
      |                                                                           ^^^ entities.it.keyframes.fov
    "#);
}

#[test]
fn empty_ranges_are_told() {
    insta::assert_snapshot!(mistakes(&with_part("clock: (frames: (9, 3), shutter: (0.5, 0.1))")), @r#"
    error[scene::empty-range]: no frames: the last frame, 3, comes before the first, 9
     --> scene.ron:2:17
      |
    2 | clock: (frames: (9, 3), shutter: (0.5, 0.1)))
      |                 ^^^^^^ clock.frames

    error[scene::empty-range]: the shutter closes at 0.1, before it opens at 0.5
     --> scene.ron:2:34
      |
    2 | clock: (frames: (9, 3), shutter: (0.5, 0.1)))
      |                                  ^^^^^^^^^^ clock.shutter
    "#);
}

#[test]
fn names_given_twice_are_told_with_both_places() {
    let text = "(entities: {\n\"cam\": (camera: (fov: 40, fov: 50)),\n\"cam\": ()},\n clock: (), clock: ())";
    insta::assert_snapshot!(mistakes(text), @r#"
    error[scene::duplicate]: `fov` is given twice
     --> scene.ron:2:27
      |
    2 | "cam": (camera: (fov: 40, fov: 50)),
      |                  ---      ^^^ entities.cam.camera.fov
      |                  |
      |                  first given here

    error[scene::duplicate]: `cam` is given twice
     --> scene.ron:3:1
      |
    2 | "cam": (camera: (fov: 40, fov: 50)),
      | ----- first given here
    3 | "cam": ()},
      | ^^^^^ entities.cam

    error[scene::duplicate]: `clock` is given twice
     --> scene.ron:4:13
      |
    4 |  clock: (), clock: ())
      |  -----      ^^^^^ clock
      |  |
      |  first given here
    "#);
}

#[test]
fn settings_which_exclude_each_other_are_told() {
    insta::assert_snapshot!(mistakes(&with_material("Conductor(roughness: 0.1)")), @r#"
    error[scene::conflict]: a `Conductor` needs exactly one of `metal`, `f0`, or `eta` and `k`
     --> scene.ron:2:19
      |
    2 | materials: {"it": Conductor(roughness: 0.1)})
      |                   ^^^^^^^^^^^^^^^^^^^^^^^^^ materials.it
    "#);
    insta::assert_snapshot!(mistakes(&with_material("Conductor(metal: Gold, f0: 1)")), @r#"
    error[scene::conflict]: a `Conductor` needs exactly one of `metal`, `f0`, or `eta` and `k`
     --> scene.ron:2:19
      |
    2 | materials: {"it": Conductor(metal: Gold, f0: 1)})
      |                   ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^ materials.it
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("light: Point()")), @r#"
    error[scene::conflict]: a `Point` needs exactly one of `intensity` and `power`
     --> scene.ron:2:15
      |
    2 | "it": (light: Point())})
      |               ^^^^^^^ entities.it.light
    "#);
    insta::assert_snapshot!(
        mistakes(r#"(entities: {"cam": (camera: (aperture: 0.1, f_number: 2))})"#), @r#"
    error[scene::conflict]: `aperture` and `f_number` exclude each other
     --> scene.ron:1:55
      |
    1 | (entities: {"cam": (camera: (aperture: 0.1, f_number: 2))})
      |                                                       ^ entities.cam.camera.f_number
    "#);
    insta::assert_snapshot!(
        mistakes(&with_entity("transform: (rotation: (0, 90, 0), look_at: (0, 0, 1))")), @r#"
    error[scene::conflict]: `rotation` and `look_at` both turn the entity
     --> scene.ron:2:30
      |
    2 | "it": (transform: (rotation: (0, 90, 0), look_at: (0, 0, 1)))})
      |                              ^^^^^^^^^^ entities.it.transform.rotation
      |
      = help: leave one of them out
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("shape: Plane(), emission: Power((1, 1, 1))")), @r#"
    error[scene::conflict]: a `Plane` is infinite: `Power` would be spread to nothing
     --> scene.ron:2:34
      |
    2 | "it": (shape: Plane(), emission: Power((1, 1, 1)))})
      |                                  ^^^^^^^^^^^^^^^^ entities.it.emission
      |
      = help: give its `Radiance`
    "#);
}

#[test]
fn wrong_keys_are_told() {
    insta::assert_snapshot!(
        mistakes(&with_entity("keyframes: (translation: (keys: [(0, (0, 0, 0)), (0, (1, 0, 0))]))")), @r#"
    error[scene::key-order]: the times of keys must increase, but 0 comes after 0
     --> scene.ron:2:58
      |
    2 | "it": (keyframes: (translation: (keys: [(0, (0, 0, 0)), (0, (1, 0, 0))])))})
      |                                                          ^ entities.it.keyframes.translation.keys.1.0
    "#);
    insta::assert_snapshot!(
        mistakes(&with_entity("keyframes: (rotation: (keys: [(0, (0, 0, 0), (1, 0, 0))]))")), @r#"
    error[scene::conflict]: keys of a rotation have no tangents
     --> scene.ron:2:53
      |
    2 | "it": (keyframes: (rotation: (keys: [(0, (0, 0, 0), (1, 0, 0))])))})
      |                                                     ^^^^^^^^^ entities.it.keyframes.rotation.keys.0.2
      |
      = help: `turn` turns about one axis and takes tangents
    "#);
    insta::assert_snapshot!(
        mistakes(&with_entity("keyframes: (turn: (axis: (0, 0, 0), keys: []))")), @r#"
    error[scene::out-of-range]: the axis of a turn must not be zero
     --> scene.ron:2:33
      |
    2 | "it": (keyframes: (turn: (axis: (0, 0, 0), keys: [])))})
      |                                 ^^^^^^^^^ entities.it.keyframes.turn.axis

    error[scene::empty]: `turn` needs at least one key
     --> scene.ron:2:50
      |
    2 | "it": (keyframes: (turn: (axis: (0, 0, 0), keys: [])))})
      |                                                  ^^ entities.it.keyframes.turn.keys
    "#);
    insta::assert_snapshot!(
        mistakes(&with_entity("keyframes: (scale: (keys: [(0, 1), (1, 2, 0.5)]))")), @r#"
    error[scene::conflict]: tangents have no meaning without `interpolation: Cubic`
     --> scene.ron:2:50
      |
    2 | "it": (keyframes: (scale: (keys: [(0, 1), (1, 2, 0.5)])))})
      |                                                  ^^^ entities.it.keyframes.scale.keys.1.2
    "#);
}

#[test]
fn wrong_meshes_are_told() {
    let text = with_part(
        r#"meshes: {"tri": Triangles(positions: [(0, 0, 0)], triangles: [(0, 0, 1)],
           normals: [(0, 0, 0)], uvs: [(0, 0), (1, 1)]), "gone": File("gone.obj")}"#,
    );
    insta::assert_snapshot!(mistakes(&text), @r#"
    error[scene::mesh]: there are only 1 positions, counted from 0
     --> scene.ron:2:70
      |
    2 | meshes: {"tri": Triangles(positions: [(0, 0, 0)], triangles: [(0, 0, 1)],
      |                                                                      ^ meshes.tri.Triangles.triangles.0.2

    error[scene::out-of-range]: a normal must be a direction other than zero
     --> scene.ron:3:22
      |
    3 |            normals: [(0, 0, 0)], uvs: [(0, 0), (1, 1)]), "gone": File("gone.obj")})
      |                      ^^^^^^^^^ meshes.tri.Triangles.normals.0

    error[scene::mesh]: `uvs` has 2 entries for 1 positions
     --> scene.ron:3:39
      |
    3 |            normals: [(0, 0, 0)], uvs: [(0, 0), (1, 1)]), "gone": File("gone.obj")})
      |                                       ^^^^^^^^^^^^^^^^ meshes.tri.Triangles.uvs

    error[scene::missing-file]: the file `gone.obj` does not exist
     --> scene.ron:3:71
      |
    3 |            normals: [(0, 0, 0)], uvs: [(0, 0), (1, 1)]), "gone": File("gone.obj")})
      |                                                                       ^^^^^^^^^^ meshes.gone.File
      |
      = help: files are looked for beside the scene, in `assets/` beside it or beside its folder, and in the asset folders of the command line
    "#);
}

#[test]
fn broken_texts_are_told() {
    insta::assert_snapshot!(mistakes(""), @r#"
    error[scene::syntax]: expected a value, found the end of the text
     --> scene.ron:1:1
      |
    1 |
      | ^
    "#);
    insta::assert_snapshot!(mistakes("(entities: {\"a\": (camera: ()"), @r#"
    error[scene::syntax]: this `(` is never closed by a `)`
     --> scene.ron:1:18
      |
    1 | (entities: {"a": (camera: ()
      |                  ^
    "#);
    insta::assert_snapshot!(mistakes("(entities: {\"a\": (camera: ()]})"), @r#"
    error[scene::syntax]: expected `)`, found `]`
     --> scene.ron:1:29
      |
    1 | (entities: {"a": (camera: ()]})
      |                  -          ^
      |                  |
      |                  opened here
    "#);
    insta::assert_snapshot!(mistakes("(clock: () render: ())"), @r#"
    error[scene::syntax]: expected `,` or `)`, found `r`
     --> scene.ron:1:12
      |
    1 | (clock: () render: ())
      |            ^
    "#);
    insta::assert_snapshot!(mistakes("[1, 2]"), @r#"
    error[scene::structure]: a scene file holds `Scene(entities: {…}, …)`
     --> scene.ron:1:1
      |
    1 | [1, 2]
      | ^^^^^^
    "#);
    insta::assert_snapshot!(mistakes("(entities: [(camera: ())])"), @r#"
    error[scene::structure]: `entities` is written as `{"name": …, …}`
     --> scene.ron:1:12
      |
    1 | (entities: [(camera: ())])
      |            ^^^^^^^^^^^^^^ entities
    "#);
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

#[test]
fn many_mistakes_of_one_file_are_told_together() {
    let mut text = VALID.to_owned();
    for (right, wrong) in [
        ("frames: (0, 47)", "frames: (47, 0)"),
        ("tonemap: Agx", "tonemap: Agfx"),
        ("albedo: \"checks\"", "albedo: \"cheks\""),
        ("amount: 0.25", "amount: 2.5"),
        ("Sphere(radius: 1)", "Sphere(raduis: 1)"),
        ("linear: (1, 0, 0)", "linear: (1, NaN, 0)"),
        ("parent: \"ball\"", "parent: \"moon\""),
        ("(2, 720)", "(-2, 720)"),
        ("two_sided: true", "two_sided: yes"),
        ("material: \"floor\"", "matter: \"floor\""),
    ] {
        assert!(text.contains(right), "{right}");
        text = text.replace(right, wrong);
    }
    let told = with_settings(&text, &[]).expect_err("ten mistakes").to_string();
    insta::assert_snapshot!(told, @r#"
    scene.ron:3:30: no frames: the last frame, 0, comes before the first, 47
    scene.ron:4:70: there is no `Agfx` to choose here
    scene.ron:10:34: there is no texture named `cheks`
    scene.ron:11:52: `amount` must be at least 0 and at most 1, but is 2.5
    scene.ron:17:70: `Sphere` has no field `raduis`
    scene.ron:18:41: `NaN` is not a finite number
    scene.ron:19:26: `moon` is its own ancestor: `moon` → `moon`
    scene.ron:20:70: the times of keys must increase, but -2 comes after 0
    scene.ron:23:35: an entity has no field `matter`
    scene.ron:25:63: expected `true` or `false`, found `yes`
    "#);
}

#[test]
fn a_valid_scene_becomes_what_it_says() {
    use crate::description::*;
    use glam::{DQuat, DVec3};
    let scene = scene(VALID);
    assert_eq!(scene.camera, "camera");
    assert_eq!(scene.clock.frames, (0, 47));
    assert_eq!(scene.render.tonemap, ToneMap::Agx);
    assert_eq!(scene.render.clamp_indirect, Some(10.0));
    assert_eq!(scene.render.filter, Filter::Gaussian { sigma: 0.4, radius: 1.5 });
    assert_eq!(
        scene.materials["floor"],
        Material::Diffuse { albedo: Value::Texture("checks".into()) }
    );
    assert_eq!(
        scene.entities["camera"].camera.as_ref().unwrap().focus,
        Some(Focus::Entity("ball".into()))
    );
    let ball = &scene.entities["ball"];
    assert_eq!(ball.transform.unwrap().translation, DVec3::new(-2.0, 1.0, 0.0));
    let turns = ball.velocity.unwrap().angular - DVec3::new(0.0, 0.0, -std::f64::consts::FRAC_PI_3);
    assert!(turns.length() < 1e-15);
    let keys = scene.entities["moon"].keyframes.as_ref().unwrap();
    let turn = keys.turn.as_ref().unwrap();
    assert_eq!((turn.axis, turn.angle.extend), (DVec3::Y, Extend::Loop));
    assert!((turn.angle.keys[1].value - 4.0 * std::f64::consts::PI).abs() < 1e-14);
    assert_eq!(keys.scale.as_ref().unwrap().keys[0].value, DVec3::ONE);
    assert_eq!(keys.scale.as_ref().unwrap().keys[1].value, DVec3::new(1.0, 2.0, 3.0));
    let slope = keys.translation.as_ref().unwrap().keys[1].tangents;
    assert_eq!(slope, Some((DVec3::Y, DVec3::Y)));
    let lamp = &scene.entities["lamp"];
    let down = lamp.transform.unwrap().rotation * DVec3::Z;
    assert!((down - DVec3::NEG_Y).length() < 1e-15, "{down}");
    assert!(lamp.hidden_from_camera && lamp.emission.as_ref().unwrap().two_sided);
    assert_eq!(scene.entities["sky"].transform, None);
    assert_eq!(scene.entities["camera"].transform.unwrap().rotation, DQuat::IDENTITY);
}

/// Oracle: rotation matrices written out by hand.
#[test]
fn rotations_turn_about_x_first_and_z_last() {
    use glam::DVec3;
    let text = with_entity("transform: (rotation: (90, 90, 0))");
    let rotation = scene(&text).entities["it"].transform.unwrap().rotation;
    // About x by 90°: y goes to z; then about y by 90°: z goes to x.
    assert!((rotation * DVec3::Y - DVec3::X).length() < 1e-15);
    let text = with_entity("transform: (rotation: (0, 90, 90))");
    let rotation = scene(&text).entities["it"].transform.unwrap().rotation;
    // About y by 90°: z goes to x; then about z by 90°: x goes to y.
    assert!((rotation * DVec3::Z - DVec3::Y).length() < 1e-15);
}

/// Oracle: where the axes must point, worked out by hand.
#[test]
fn look_at_aims_cameras_backwards_and_shapes_forwards() {
    use glam::DVec3;
    let text = r#"(entities: {
        "cam": (camera: (), transform: (translation: (5, 0, 0), look_at: (0, 0, 0))),
        "lamp": (shape: Disk(), transform: (translation: (0, 3, 0), look_at: (0, 0, 0))),
        "spot": (light: Spot(intensity: (1, 1, 1)), transform: (translation: (0, 0, 2), look_at: (0, 0, 9))),
        "roll": (shape: Disk(), transform: (look_at: (0, 0, 1), up: (1, 0, 0))),
    })"#;
    let scene = scene(text);
    let axis = |name: &str, axis: DVec3| scene.entities[name].transform.unwrap().rotation * axis;
    assert!((axis("cam", DVec3::NEG_Z) - DVec3::NEG_X).length() < 1e-15);
    assert!((axis("cam", DVec3::Y) - DVec3::Y).length() < 1e-15);
    assert!((axis("lamp", DVec3::Z) - DVec3::NEG_Y).length() < 1e-15);
    assert!((axis("spot", DVec3::NEG_Z) - DVec3::Z).length() < 1e-15);
    assert!((axis("roll", DVec3::Z) - DVec3::Z).length() < 1e-15);
    assert!((axis("roll", DVec3::Y) - DVec3::X).length() < 1e-15);
    assert!(scene.entities.values().all(|entity| entity.look_at.is_none()));
}

#[test]
fn look_at_is_kept_for_what_moves() {
    let text = with_entity(
        "shape: Disk(), velocity: (linear: (1, 0, 0)), transform: (look_at: (0, 0, 1))",
    );
    assert!(scene(&text).entities["it"].look_at.is_some());
    let spin = text.replace("(linear: (1, 0, 0))", "(angular: (0, 90, 0))");
    assert!(scene(&spin).entities["it"].look_at.is_none());
    let both = text.replace("linear: (1, 0, 0)", "linear: (1, 0, 0), angular: (0, 90, 0)");
    insta::assert_snapshot!(mistakes(&both), @r#"
    error[scene::conflict]: `look_at` and `angular` both turn the moving entity
     --> scene.ron:2:62
      |
    2 | "it": (shape: Disk(), velocity: (linear: (1, 0, 0), angular: (0, 90, 0)), transform: (look_at: (0, 0, 1)))})
      |                                                              ^^^^^^^^^^ entities.it.velocity.angular
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("transform: (look_at: (0, 0, 0))")), @r#"
    error[scene::look-at]: the entity stands at the very point at which it should look
     --> scene.ron:2:29
      |
    2 | "it": (transform: (look_at: (0, 0, 0)))})
      |                             ^^^^^^^^^ entities.it.transform.look_at
    "#);
}

#[test]
fn settings_replace_and_add_values() {
    use crate::description::*;
    use glam::DVec3;
    let settings = [
        ("render.max_depth", "8"),
        ("render.seed", "7"),
        ("clock.frames", "(3, 4)"),
        ("render.size.0", "320"),
        ("entities.ball.velocity.linear", "(2, 0, 0)"),
        ("entities.ball.shape.radius", "0.5"),
        ("entities.ball.shape.Sphere.radius", "0.25"),
        ("entities.floor.transform.translation", "(0, -1, 0)"),
        ("entities.moon.keyframes.turn.keys.1.1", "90"),
        ("entities.lamp.emission", "Power((1, 1, 1))"),
        ("entities.lamp.emission.Power", "(2, 2, 2)"),
        ("materials.glass.ior", "1.33"),
        ("render.filter", "Box()"),
        ("render.filter.radius", "2"),
        ("camera", "\"camera\""),
    ];
    let scene = with_settings(VALID, &settings).expect("all settings are right");
    assert_eq!((scene.render.max_depth, scene.render.seed), (8, 7));
    assert_eq!((scene.clock.frames, scene.render.size), ((3, 4), (320, 480)));
    let ball = &scene.entities["ball"];
    assert_eq!(ball.velocity.unwrap().linear, DVec3::new(2.0, 0.0, 0.0));
    assert_eq!(ball.shape, Some(Shape::Sphere { radius: 0.25 }));
    assert_eq!(scene.entities["floor"].transform.unwrap().translation, DVec3::NEG_Y);
    let strength = &scene.entities["lamp"].emission.as_ref().unwrap().strength;
    assert_eq!(*strength, EmissionStrength::Power(Rgb::splat(2.0)));
    assert!(matches!(scene.materials["glass"], Material::Dielectric { ior: 1.33, .. }));
    assert_eq!(scene.render.filter, Filter::Box { radius: 2.0 });
    let plain = self::scene(VALID);
    assert_ne!(scene.content_hash, plain.content_hash);
}

#[test]
fn wrong_settings_are_told_in_their_own_text() {
    let settings = [
        ("render.max_dept", "8"),
        ("entities.ball.shape.radius", "-1"),
        ("entities.bal.shape.radius", "1"),
        ("material.glass.ior", "1"),
        ("entities.ball.material", "\"gls\""),
        ("render.samples", "1), evil: ("),
        ("entities.ball.shape.radius.x", "1"),
        ("meshes.tri.positions.7", "(0, 0, 0)"),
        ("entities.ball.velocity.linear", "(1, nan, 0)"),
    ];
    let told = with_settings(VALID, &settings).expect_err("all of them are wrong").render(false);
    insta::assert_snapshot!(told, @r#"
    error[scene::unknown-setting]: there is no `bal.shape.radius` in `entities`
     --> --set:1:1
      |
    1 | entities.bal.shape.radius=1
      | ^^^^^^^^^^^^^^^^^^^^^^^^^ entities.bal.shape.radius
      |
      = help: did you mean `ball`?

    error[scene::unknown-setting]: there is no setting `material.glass.ior`
     --> --set:1:1
      |
    1 | material.glass.ior=1
      | ^^^^^^^^^^^^^^^^^^ material.glass.ior
      |
      = help: did you mean `materials`?

    error[scene::syntax]: expected nothing more after the end of the value
     --> --set:1:17
      |
    1 | render.samples=1), evil: (
      |                 ^ render.samples

    error[scene::unknown-setting]: there is no `x` in `entities.ball.shape.radius`
     --> --set:1:1
      |
    1 | entities.ball.shape.radius.x=1
      | ^^^^^^^^^^^^^^^^^^^^^^^^^^^^ entities.ball.shape.radius.x

    error[scene::unknown-setting]: there is no `7` in `meshes.tri.positions`
     --> --set:1:1
      |
    1 | meshes.tri.positions.7=(0, 0, 0)
      | ^^^^^^^^^^^^^^^^^^^^^^ meshes.tri.positions.7

    error[scene::not-finite]: `nan` is not a finite number
     --> --set:1:35
      |
    1 | entities.ball.velocity.linear=(1, nan, 0)
      |                                   ^^^ entities.ball.velocity.linear.1

    error[scene::unknown-field]: `render` has no field `max_dept`
     --> --set:1:8
      |
    1 | render.max_dept=8
      |        ^^^^^^^^ render.max_dept
      |
      = help: did you mean `max_depth`?

    error[scene::out-of-range]: `radius` must be at least 1e-12 and at most 1e15 metres, but is -1
     --> --set:1:28
      |
    1 | entities.ball.shape.radius=-1
      |                            ^^ entities.ball.shape.Sphere.radius

    error[scene::unknown-name]: there is no material named `gls`
     --> --set:1:24
      |
    1 | entities.ball.material="gls"
      |                        ^^^^^ entities.ball.material
      |
      = help: did you mean `glass`?
    "#);
}

/// No panic, whatever is cut off; and only the whole scene is right.
#[test]
fn a_scene_cut_at_any_byte_is_an_error() {
    let end = VALID.trim_end().len();
    for cut in 0..end {
        let mut loader = Loader::new(&LOOSE);
        loader.read_bytes("scene.ron", "scene.ron", VALID.as_bytes()[..cut].to_vec(), None);
        let mistakes = loader.finish().expect_err("it is cut off");
        assert!(!mistakes.render(false).is_empty(), "cut at {cut}");
    }
}

static LOOSE: LoadOptions = LoadOptions {
    asset_dirs: Vec::new(),
    allow_outside: false,
    overrides: Vec::new(),
    camera: None,
};

/// Neither a panic nor a hang, whatever a byte is changed to, left out or doubled.
#[test]
fn a_scene_with_any_byte_changed_is_read_or_refused() {
    for at in 0..VALID.len() {
        for byte in [b'(', b')', b'"', b',', b':', b'9', b'-', b'x', 0x00, 0xff] {
            // Every byte meets some of the changes, every change some of the bytes.
            if !(at * 7 + usize::from(byte)).is_multiple_of(5) {
                continue;
            }
            let mut bytes = VALID.as_bytes().to_vec();
            match at % 3 {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                _ => {
                    bytes.remove(at);
                }
            }
            let mut loader = Loader::new(&LOOSE);
            loader.read_bytes("scene.ron", "scene.ron", bytes, None);
            if let Err(mistakes) = loader.finish() {
                assert!(!mistakes.render(false).is_empty(), "{byte} at {at}");
            }
        }
    }
}

#[test]
fn deep_nesting_and_invalid_text_are_told() {
    let deep = format!("(entities: {}", "(a:".repeat(100_000));
    let told = with_settings(&deep, &[]).expect_err("too deep").to_string();
    assert!(told.contains("deeper than 64"), "{told}");
    let mut loader = Loader::new(&LOOSE);
    loader.read_bytes("scene.ron", "scene.ron", b"(camera: \"a\xff\")".to_vec(), None);
    insta::assert_snapshot!(loader.finish().expect_err("not UTF-8").render(false), @r#"
    error[scene::encoding]: the file is not valid UTF-8 here
     --> scene.ron:1:12
      |
    1 | (camera: "a�")
      |            ^
    "#);
}

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
    mistakes.render(false).replace(&folder.path().display().to_string(), "…")
}

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
