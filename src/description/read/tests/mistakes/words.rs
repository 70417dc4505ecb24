//! Words that are no scene: broken texts, unknown fields and variants, wrong types.

use super::super::*;

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
    error[scene::wrong-type]: expected three numbers `(x, y, z)`, found `(1, 2)`
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

/// What is told of a text: where, what, and what to do.
fn told(text: &str) -> String {
    let mistakes = with_settings(text, &[]).expect_err("it is wrong");
    let told = |mistake: &Diagnostic| {
        let help = mistake.help.as_deref().unwrap_or_default();
        format!("{mistake} [{help}]")
    };
    mistakes.0.iter().map(told).collect::<Vec<_>>().join("\n")
}

/// Each text is what somebody writes who does not know the format yet.
#[test]
fn what_to_write_instead_is_told() {
    for (entity, column, expected) in [
        ("shape: Sphere(1)", 22, "[write `Sphere(radius: 1)`]"),
        ("shape: Box(1, 1, 1)", 19, "[write `Box(size: (1, 1, 1))`]"),
        ("shape: Cylinder(1, 2)", 24, "[write `Cylinder(radius: 1, height: 2)`]"),
        ("shape: Plane", 15, "[write `Plane()`]"),
        ("shape: Sphere", 15, "[write `Sphere()`]"),
        ("shape: Plane(5)", 21, "[write `Plane()`]"),
        ("shape: \"sphere\"", 15, "[write `Sphere(…)`, without quotes]"),
        ("shape: Cube()", 15, "[here that is `Box(size: (1, 1, 1))`]"),
        ("shape: Mesh(rabbit)", 20, "[write `\"rabbit\"`]"),
        (
            "velocity: (angular: 90)",
            28,
            "three numbers `(x, y, z)`, found `90` [write all of them, as in `(0, 90, 0)`]",
        ),
        ("velocity: (1, 0, 0)", 19, "[write `(linear: (1, 0, 0))`]"),
        ("transform: (0, 1, 0)", 20, "[write `(translation: (0, 1, 0))`]"),
        ("transform: (position: (0, 1, 0))", 20, "[here that is `translation`]"),
        ("transform: (rotation: 90)", 30, "as in `(0, 90, 0)`"),
        ("position: (0, 1, 0)", 8, "[here that is `transform: (translation: (x, y, z))`]"),
        ("shape: Sphere(), emission: 5", 35, "[write `Radiance(5)`]"),
        ("light: Sun()", 15, "`Directional(irradiance: …, angle: 0.53)`"),
        ("light: Point(10)", 21, "[write `Point(intensity: 10)`]"),
        ("hidden_from_camera: maybe", 28, "expected `true` or `false`, found `maybe`"),
    ] {
        let told = told(&with_entity(entity));
        assert!(
            told.contains(&format!("scene.ron:2:{column}: ")) && told.contains(expected),
            "{entity}: {told}"
        );
    }
    for (material, column, expected) in [
        ("Glass(ior: 1.5)", 19, "[here that is `Dielectric(ior: 1.5)`"),
        ("Lambert()", 19, "`Diffuse(albedo: …)`"),
        ("Metal()", 19, "`Conductor(metal: Gold, roughness: 0.1)`"),
        ("Emissive(1)", 19, "`emission: Radiance(…)`"),
        ("Translucent()", 19, "`scattering`"),
        ("Diffuse(color: (1, 0, 0))", 27, "[here that is `albedo`]"),
        ("Diffuse(0.5)", 27, "[write `Diffuse(albedo: 0.5)`]"),
        ("Plastic(roughness: 0,2)", 40, "[write `Plastic(roughness: 0.2)`]"),
        ("Conductor(Gold)", 29, "[write `Conductor(metal: Gold)`]"),
        ("Conductor(metal: \"Gold\")", 36, "[write `Gold`, without quotes]"),
        ("Dielectric(attenuation: (0.5, 0.9, 0.9))", 44, "[write `(color: (0.5, 0.9, 0.9))`]"),
    ] {
        let told = told(&with_material(material));
        assert!(
            told.contains(&format!("scene.ron:2:{column}: ")) && told.contains(expected),
            "{material}: {told}"
        );
    }
    for (part, column, expected) in [
        (
            "profiles: {\"p\": Bezier([(0, 0), (1, 1)])}",
            24,
            "[write `Bezier(points: [(0, 0), (1, 1)])`]",
        ),
        ("textures: {\"t\": Image(\"a.png\")}", 23, "[write `Image(file: \"a.png\")`]"),
        ("meshes: {\"m\": \"a.obj\"}", 15, "[write `File(\"a.obj\")`]"),
        ("render: (size: 640)", 16, "two numbers"),
        ("render: (samples: 1.5)", 19, "expected a whole number, found `1.5`"),
        ("render: (samples: \"64\")", 19, "expected a whole number, found `\"64\"` [write `64`]"),
        ("render: (width: 640)", 10, "[here that is `size: (width, height)`]"),
        ("lights: {}", 1, "an entity with a `light`"),
        ("camera: (position: (0, 0, 5))", 9, "[a camera is an entity: "),
    ] {
        let told = told(&with_part(part));
        assert!(
            told.contains(&format!("scene.ron:2:{column}: ")) && told.contains(expected),
            "{part}: {told}"
        );
    }
    let told = with_settings(VALID, &[("render.samples", "banana")]).expect_err("it is none");
    assert_eq!(told.to_string(), "--set:1:16: expected a whole number, found `banana`");
}

/// A number is a grey wherever a colour stands, whether or not a texture might.
#[test]
fn a_number_is_a_grey_everywhere() {
    let grey = scene(
        r#"(entities: {"cam": (camera: ()),
            "a": (light: Point(intensity: 10)), "b": (light: Spot(intensity: 10)), "c": (light: Point(power: 10)),
            "d": (light: Directional(irradiance: 10)), "e": (shape: Sphere(), emission: Power(10)),
            "f": (shape: Sphere(), material: "m"), "g": (shape: Sphere(), material: "n")},
        materials: {"m": Dielectric(attenuation: (color: 0.5), scattering: (coefficient: 3), emission: 2),
            "n": Conductor(eta: 1, k: 3)})"#,
    );
    let rgb = scene(
        r#"(entities: {"cam": (camera: ()),
            "a": (light: Point(intensity: (10, 10, 10))), "b": (light: Spot(intensity: (10, 10, 10))),
            "c": (light: Point(power: (10, 10, 10))), "d": (light: Directional(irradiance: (10, 10, 10))),
            "e": (shape: Sphere(), emission: Power((10, 10, 10))),
            "f": (shape: Sphere(), material: "m"), "g": (shape: Sphere(), material: "n")},
        materials: {"m": Dielectric(attenuation: (color: (0.5, 0.5, 0.5)), scattering: (coefficient: (3, 3, 3)),
            emission: (2, 2, 2)), "n": Conductor(eta: (1, 1, 1), k: (3, 3, 3))})"#,
    );
    assert_eq!((grey.entities, grey.materials), (rgb.entities, rgb.materials));
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
