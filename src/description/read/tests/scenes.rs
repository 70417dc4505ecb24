//! Whole scenes: what becomes of them, with settings, and whatever bytes they are made of.

use super::*;

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

/// Oracle: the same pose in angles; a shear, which no angles have, by its matrix.
#[test]
fn poses_are_given_as_a_quaternion_or_a_matrix_as_well() {
    use glam::{DAffine3, DMat3, DVec3};
    let pose = |transform: &str| {
        let text = with_entity(&format!("transform: ({transform})"));
        let t = scene(&text).entities["it"].transform.unwrap();
        DAffine3::from_scale_rotation_translation(t.scale, t.rotation, t.translation)
            * DAffine3::from_mat3(t.stretch)
    };
    let angles = pose("translation: (1, 2, 3), rotation: (0, 90, 0), scale: (2, 1, 1)");
    for same in [
        "translation: (1, 2, 3), quaternion: (0, 3, 0, 3), scale: (2, 1, 1)",
        "matrix: [(0, 0, 1, 1), (0, 1, 0, 2), (-2, 0, 0, 3)]",
        "matrix: [(0, 0, 1, 1), (0, 1, 0, 2), (-2, 0, 0, 3), (0, 0, 0, 1)]",
    ] {
        assert!(pose(same).abs_diff_eq(angles, 1e-14), "{same}: {:?}", pose(same));
    }
    let sheared = pose("matrix: [(-1, 0.5, 0, 0), (0, 1, 0, 0), (0, 0, 3, 0)]");
    let expected = DMat3::from_cols(DVec3::NEG_X, DVec3::new(0.5, 1.0, 0.0), DVec3::Z * 3.0);
    assert!(sheared.matrix3.abs_diff_eq(expected, 1e-14), "{sheared:?}");
    for (wrong, words) in [
        ("matrix: [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)], scale: 2", "`matrix` and `scale`"),
        ("quaternion: (0, 0, 0, 1), rotation: (0, 0, 0)", "`quaternion` and `rotation`"),
        ("quaternion: (0, 0, 0, 0)", "must not be zero"),
        ("matrix: [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (5, 6, 7, 1)]", "its columns"),
        ("matrix: [(1, 0, 0, 0), (0, 1, 0, 0)]", "three rows"),
        ("matrix: [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 0)]", "flattens"),
    ] {
        let text = with_entity(&format!("transform: ({wrong})"));
        let told = mistakes(&text);
        assert!(told.contains(words), "{wrong}: {told}");
    }
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
        ("camera", "\"camera\" // not the other one"),
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

/// Work grows with the length of a text, not with its square.
#[test]
fn a_long_mesh_full_of_mistakes_is_refused_quickly() {
    let positions = "(0, NaN, 1e39), ".repeat(20_000);
    let text = with_part(&format!(
        "meshes: {{\"m\": Triangles(positions: [{positions}], triangles: [(0, 1, 20000)])}}"
    ));
    let mistakes = with_settings(&text, &[]).expect_err("no number is right");
    assert_eq!(mistakes.0.len(), 40_001);
    assert!(mistakes.render(false).ends_with("… and 39951 more\n"));
}
