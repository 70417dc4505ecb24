//! Mistakes in scene files and how they are told.

use super::*;

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
    insta::assert_snapshot!(mistakes(&with_material("Mirror(reflectance: 99999999999999999999)")), @r#"
    error[scene::out-of-range]: `reflectance` must be at least 0 and at most 1, but is 99999999999999999999
     --> scene.ron:2:39
      |
    2 | materials: {"it": Mirror(reflectance: 99999999999999999999)})
      |                                       ^^^^^^^^^^^^^^^^^^^^ materials.it.Mirror.reflectance
    "#);
    insta::assert_snapshot!(mistakes(&with_part("textures: {checks: Checker(), \"\": Checker()}")), @r#"
    error[scene::structure]: a name stands in double quotes and is not empty
     --> scene.ron:2:12
      |
    2 | textures: {checks: Checker(), "": Checker()})
      |            ^^^^^^ textures.checks

    error[scene::structure]: a name stands in double quotes and is not empty
     --> scene.ron:2:31
      |
    2 | textures: {checks: Checker(), "": Checker()})
      |                               ^^ textures
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
fn mistakes_in_water_are_told_with_their_place() {
    let water = |fields: &str| {
        let text = with_part(&format!("meshes: {{\"sea\": Waves({fields})}}"));
        with_settings(&text, &[]).map(|_| ()).expect_err("it is wrong").to_string()
    };
    insta::assert_snapshot!(water("size: (3, 0), cells: (0, 10), steepness: 1.5, gravity: -1, waves: []"), @r"
    scene.ron:2:33: `size` must be at least 1e-12 and at most 1e15 metres, but is 0
    scene.ron:2:45: `cells` must be at least 1 and at most 65536 cells, but is 0
    scene.ron:2:64: `steepness` must be at least 0 and at most 1, but is 1.5
    scene.ron:2:78: `gravity` must be greater than 0 and at most 1000000 metres per second squared, but is -1
    scene.ron:2:89: `waves` needs 1 to 1024 waves, but has 0
    ");
    insta::assert_snapshot!(water("size: (3, 2), cells: (30, 20), waves: [(amplitude: -1, frequency: 0, height: 1)]"), @"scene.ron:2:92: `0` has no field `height`");
    insta::assert_snapshot!(water("size: (3, 2), cells: (30, 20), waves: [(amplitude: -1, frequency: 0), (frequency: 1)]"), @"scene.ron:2:17: `wave` needs a field `amplitude`");
    insta::assert_snapshot!(water("size: (3, 2), cells: (30, 20), waves: [(amplitude: -1, frequency: 0)]"), @r"
    scene.ron:2:74: `amplitude` must be at least 0 and at most 1e15 metres, but is -1
    scene.ron:2:89: `frequency` must be greater than 0 and at most 1000000 periods per second, but is 0
    ");
    insta::assert_snapshot!(water("size: (3, 2), cells: (65536, 65536), waves: [(amplitude: 1, frequency: 1)]"), @"scene.ron:2:44: a surface has at most 4194304 cells, but this has 4294967296");
    // a·k = 0.5·(2π)²/9.81 = 2.01
    insta::assert_snapshot!(water("size: (3, 2), cells: (30, 20), steepness: 0.7, waves: [(amplitude: 0.5, frequency: 1)]"), @"scene.ron:2:77: the surface may fold over itself: `steepness` times the sum of amplitude times wave number is 1.409, and must be at most 1");
}

#[test]
fn a_wrong_profile_is_told_with_its_place() {
    let turned =
        |profile: &str| mistakes(&with_entity(&format!("shape: Revolution(profile: {profile})")));
    insta::assert_snapshot!(turned("Bezier(points: [(1, 0)])"), @r#"
    error[scene::profile]: `Bezier` needs 3·n + 1 points (4, 7, 10, …), but there are 1
     --> scene.ron:2:50
      |
    2 | "it": (shape: Revolution(profile: Bezier(points: [(1, 0)])))})
      |                                                  ^^^^^^^^ entities.it.shape.Revolution.profile.Bezier.points
    "#);
    insta::assert_snapshot!(turned("Lines(points: [(1, 1), (1, 1), (1, 1)])"), @r#"
    error[scene::profile]: no surface comes of this profile
     --> scene.ron:2:49
      |
    2 | "it": (shape: Revolution(profile: Lines(points: [(1, 1), (1, 1), (1, 1)])))})
      |                                                 ^^^^^^^^^^^^^^^^^^^^^^^^ entities.it.shape.Revolution.profile.Lines.points
      |
      = help: it needs points at different places, not all of them on the axis
    "#);
    insta::assert_snapshot!(turned("Lines(points: [(1, 0), (2, 1), (-0.5, 2)])"), @r#"
    error[scene::profile]: the curve of this point and those after it reaches the radius -5.000e-1, and must not cross the axis
     --> scene.ron:2:58
      |
    2 | "it": (shape: Revolution(profile: Lines(points: [(1, 0), (2, 1), (-0.5, 2)])))})
      |                                                          ^^^^^^ entities.it.shape.Revolution.profile.Lines.points.1
      |
      = help: the first number of a point is its distance from the axis: at least 0
    "#);
    insta::assert_snapshot!(turned("Spline(points: [(1, 0), (2, 1), (1, 2), (1, 3)], weights: [1, 0, 1, 1])"), @r#"
    error[scene::out-of-range]: `weights` must be at least 1e-6 and at most 1000000, but is 0
     --> scene.ron:2:97
      |
    2 | "it": (shape: Revolution(profile: Spline(points: [(1, 0), (2, 1), (1, 2), (1, 3)], weights: [1, 0, 1, 1])))})
      |                                                                                                 ^ entities.it.shape.Revolution.profile.Spline.weights.1
    "#);
    insta::assert_snapshot!(turned("Spline(points: [(1, 0), (2, 1), (1, 2), (1, 3)], knots: [0, 1, 2, 3, 4, 5, 6, 5])"), @r#"
    error[scene::profile]: knot 7 is less than the one before it
     --> scene.ron:2:113
      |
    2 | "it": (shape: Revolution(profile: Spline(points: [(1, 0), (2, 1), (1, 2), (1, 3)], knots: [0, 1, 2, 3, 4, 5, 6, 5])))})
      |                                                                                                                 ^ entities.it.shape.Revolution.profile.Spline.knots.7
    "#);
    insta::assert_snapshot!(turned("Bezier(points: [(1, 0), (2, 1), (1, inf), (1, 3)])"), @r#"
    error[scene::not-finite]: `inf` is not a finite number
     --> scene.ron:2:71
      |
    2 | "it": (shape: Revolution(profile: Bezier(points: [(1, 0), (2, 1), (1, inf), (1, 3)])))})
      |                                                                       ^^^ entities.it.shape.Revolution.profile.Bezier.points.2.1
    "#);
    insta::assert_snapshot!(turned("\"vase\""), @r#"
    error[scene::unknown-name]: there is no profile named `vase`
     --> scene.ron:2:35
      |
    2 | "it": (shape: Revolution(profile: "vase"))})
      |                                   ^^^^^^ entities.it.shape.Revolution.profile
    "#);
    insta::assert_snapshot!(mistakes(&with_entity("shape: Revolution(caped: true)")), @r#"
    error[scene::unknown-field]: `Revolution` has no field `caped`
     --> scene.ron:2:26
      |
    2 | "it": (shape: Revolution(caped: true))})
      |                          ^^^^^ entities.it.shape.Revolution.caped
      |
      = help: did you mean `capped`?
    "#);
}

/// A loop which crosses itself, repeated points and a touch of the axis are surfaces; a profile by its name is one for all.
#[test]
fn ugly_profiles_are_surfaces_and_names_share_them() {
    let text = r#"(profiles: {
            "loop": Bezier(points: [(0.2, 0), (2, 1), (-0.5, 1), (1, 0)]),
            "cusp": Bezier(points: [(0.3, 0), (1.3, 1), (0.3, 1), (1.3, 0)]),
            "stop": Bezier(points: [(1, 0), (1, 0), (1, 0), (0.5, 1)]),
        },
        entities: {
            "camera": (camera: ()), "sky": (light: Sky(radiance: (1, 1, 1))),
            "a": (shape: Revolution(profile: "loop")), "b": (shape: Revolution(profile: "loop", capped: true)),
            "c": (shape: Revolution(profile: "cusp")), "d": (shape: Revolution(profile: "stop")),
        })"#;
    let scene = parse_scene_str("scene.ron", text, None, &LoadOptions::default());
    let scene = scene.unwrap_or_else(|mistakes| panic!("{}", mistakes.render(false)));
    assert!(scene.warnings.0.is_empty(), "{}", scene.warnings.render(false));
    let profile = |name: &str| match &scene.entities[name].shape {
        Some(crate::description::Shape::Revolution { profile, capped }) => {
            (profile.clone(), *capped)
        }
        other => panic!("{other:?}"),
    };
    let ((a, open), (b, capped)) = (profile("a"), profile("b"));
    assert!(std::sync::Arc::ptr_eq(&a, &b) && !open && capped);
    assert_eq!(a.open_ends[1], Some(glam::DVec2::new(1.0, 0.0)));
}

#[test]
fn wrong_textures_and_meshes_made_of_others_are_told() {
    for (part, messages) in [
        (
            r#"textures: {"a": Mix(a: "b"), "b": Placed(of: "a")}"#,
            &["the texture `b` is made of itself: `a` → `b` → `a`", "textures.b.Placed.of"][..],
        ),
        (
            r#"textures: {"n": Noise(octaves: 99, size: -1), "r": Remap(of: "x", from: (1, 1))}"#,
            &[
                "`octaves` must be at least 1 and at most 32",
                "textures.n.Noise.size",
                "there is no texture named `x`",
                "`from` must be two different numbers, but both are 1",
            ][..],
        ),
        (
            r#"meshes: {"s": Subdivided(of: "s", levels: 3)}"#,
            &["the mesh `s` is made from itself", "meshes.s.Subdivided.of"][..],
        ),
        (
            r#"meshes: {"g": Grid(size: (1, 1), cells: (2, 2)), "big": Subdivided(of: "g", levels: 40)}"#,
            &["a mesh has at most 67108864 triangles", "meshes.big.Subdivided.levels"][..],
        ),
        (
            r#"meshes: {"g": Grid(size: (1, 1), cells: (2, 2)), "d": Displaced(of: "g", height: "no")}"#,
            &["there is no texture named `no`", "meshes.d.Displaced.height"][..],
        ),
    ] {
        let told = mistakes(&with_part(part));
        for message in messages {
            assert!(told.contains(message), "{part}: {told}");
        }
    }
}
