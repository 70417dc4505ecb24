//! Names that refer to nothing, to themselves, or to too much, and what lacks its partner.

use super::super::*;

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

/// A chain of so many that reading it by recursion would end the program, for every kind that is made of others.
#[test]
fn long_chains_are_refused_where_they_are_too_deep() {
    let count = 30_000;
    let chain = |of: &dyn Fn(usize) -> String, last: &str| -> String {
        let links = (0..count).map(|k| format!("\"a{k}\": {},\n", of(k + 1)));
        links.collect::<String>() + &format!("\"a{count}\": {last}")
    };
    let first = count - 128;
    for (part, text) in [
        ("texture", chain(&|k| format!("Placed(of: \"a{k}\")"), "Gradient()")),
        ("texture", chain(&|k| format!("Mix(b: \"a{k}\")"), "Gradient()")),
        ("material", chain(&|k| format!("Masked(material: \"a{k}\", opacity: 1)"), "Diffuse()")),
        (
            "mesh",
            chain(
                &|k| format!("Subdivided(of: \"a{k}\", levels: 0)"),
                "Grid(size: (1, 1), cells: (1, 1))",
            ),
        ),
    ] {
        let plural = if part == "mesh" { "meshes".to_owned() } else { format!("{part}s") };
        let told = with_settings(&with_part(&format!("{plural}: {{{text}}}")), &[]);
        let told = told.expect_err("it is too deep").to_string();
        let expected = format!("the {part} `a{first}` is made of more than 128 others in a row");
        assert!(told.contains(&expected), "{told}");
    }
    // Parents are followed without recursion.
    let parents = chain(&|k| format!("(parent: \"a{k}\")"), "()");
    let scene = scene(&format!("(entities: {{\"cam\": (camera: ()), {parents}}})"));
    assert_eq!(scene.entities.len(), count + 2);
}

/// Sixty levels, on each of which both parts are the next one, are read at once; sixty of two that look elsewhere are refused.
#[test]
fn graphs_are_read_in_linear_time() {
    let levels = |of: &dyn Fn(usize) -> String, last: &str| -> String {
        (0..60).map(|k| of(k) + ",\n").collect::<String>() + last
    };
    let both = |k: usize| format!("\"t{k}\": Multiply(a: \"t{0}\", b: \"t{0}\")", k + 1);
    let mixed = |k: usize| format!("\"m{k}\": Mix(a: \"m{0}\", b: \"m{0}\", amount: 0.5)", k + 1);
    let textures = levels(&both, "\"t60\": Gradient()");
    let materials = levels(&mixed, "\"m60\": Diffuse(albedo: \"t0\")");
    let text = with_part(&format!("textures: {{{textures}}}, materials: {{{materials}}}"));
    assert_eq!(scene(&text).textures.len(), 61);
    let moved = |k: usize| {
        let next = k + 1;
        format!(
            "\"t{k}\": Multiply(a: \"p{k}\", b: \"q{k}\"), \"p{k}\": Placed(of: \"t{next}\"), \
             \"q{k}\": Placed(of: \"t{next}\", repeat: (2, 1))"
        )
    };
    let textures = levels(&moved, "\"t60\": Gradient()");
    let told = mistakes(&with_part(&format!("textures: {{{textures}}}")));
    assert!(told.contains("looks up more than 65536 others for every point"), "{told}");
}
