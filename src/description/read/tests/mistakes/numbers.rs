//! Numbers out of range or not finite, ranges, settings and keys.

use super::super::*;

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
