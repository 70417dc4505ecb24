//! Profiles which make no surface, and odd ones which do.

use super::super::*;

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

/// Too few points, or all of them in one place or on the axis, are no surface, and a radius below 0 is none, for every kind
/// of curve; each mistake is told with the place of its list or point.
#[test]
fn no_kind_of_profile_is_a_point_or_crosses_the_axis() {
    let few = "points, but there are 1";
    let nothing = "no surface comes of this profile";
    let negative = "must not cross the axis";
    for (profile, message, place) in [
        ("Lines(points: [])", "but there are 0", "Lines.points"),
        ("Lines(points: [(1, 0)])", few, "Lines.points"),
        ("Spline(points: [(1, 0)])", few, "Spline.points"),
        ("Spline(points: [(1, 0)], closed: true)", few, "Spline.points"),
        ("Bezier(points: [(1, 1), (1, 1), (1, 1), (1, 1)])", nothing, "Bezier.points"),
        ("Spline(points: [(1, 1), (1, 1), (1, 1), (1, 1)])", nothing, "Spline.points"),
        (
            "Spline(points: [(1, 1), (1, 1), (1, 1), (1, 1)], closed: true)",
            nothing,
            "Spline.points",
        ),
        ("Lines(points: [(0, 0), (0, 1), (0, 2)])", nothing, "Lines.points"),
        ("Bezier(points: [(1, 0), (-3, 1), (-3, 2), (1, 3)])", negative, "Bezier.points.0"),
        ("Spline(points: [(1, 0), (-3, 1), (-3, 2), (1, 3)])", negative, "Spline.points.0"),
        ("Lines(points: [(-1, 0), (-1, 1)])", negative, "Lines.points.0"),
    ] {
        let told = mistakes(&with_entity(&format!("shape: Revolution(profile: {profile})")));
        assert!(told.contains(message), "{profile}: {told}");
        assert!(told.contains(&format!("profile.{place}\n")), "{profile}: {told}");
    }
}
