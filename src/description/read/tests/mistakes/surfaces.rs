//! Meshes, water and textures.

use super::super::*;
use crate::description::EmissionStrength;

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
            &["the mesh `s` is made of itself", "meshes.s.Subdivided.of"][..],
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

/// What is wrong with a displacement says so where it is.
#[test]
fn displacements_say_what_is_missing() {
    let with = |fields: &str| {
        format!(
            r#"textures: {{"t": Checker()}}, meshes: {{"g": Grid(size: (1, 1), cells: (2, 2)), "d": Displaced(of: "g"{fields})}}"#
        )
    };
    for (fields, message) in [
        ("", "give it a `height` or an `offset`"),
        (r#", height: "t", offset: "t""#, "`height` and `offset` exclude each other"),
        (r#", offset: "no""#, "there is no texture named `no`"),
        (r#", offset: "t", space: World"#, "`World`"),
        (r#", height: "t", strength: inf"#, "strength"),
    ] {
        let told = mistakes(&with_part(&with(fields)));
        assert!(told.contains(message) && told.contains("meshes.d"), "{fields}: {told}");
    }
    for (setting, message) in [("dicing", "`dicing`"), ("dicing_memory", "`dicing_memory`")] {
        let told = with_settings(&with_part(""), &[(&format!("render.{setting}"), "0")]);
        let told = told.expect_err("nothing is 0 pixels long").render(false);
        assert!(told.contains(message), "{told}");
    }
}

/// Patches of wrong numbers: each is told at its place, and none makes a panic or a mesh without end.
#[test]
fn patches_say_what_does_not_fit() {
    let point = |k: usize| format!("({}, {}, 0)", k % 4, k / 4);
    let points = (0..16).map(point).collect::<Vec<_>>().join(", ");
    let bezier = |fields: &str| format!("Patches(points: [{points}], {fields})");
    let all = "patches: [[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]]";
    let rows = (0..4)
        .map(|v| format!("[{}]", (0..4).map(|u| point(4 * v + u)).collect::<Vec<_>>().join(", ")));
    let rows = rows.collect::<Vec<_>>().join(", ");
    let spline = |fields: &str| format!("Spline(rows: [{rows}], {fields})");
    let same = "(1, 1, 1), ".repeat(16);
    for (mesh, message) in [
        (bezier(all), "tolerance"),
        (bezier(&format!("{all}, tolerance: 0")), "tolerance"),
        (bezier("patches: [], tolerance: 1"), "at least one"),
        (bezier("patches: [[0, 1, 2]], tolerance: 1"), "not 3"),
        (bezier(&all.replace("15]", "16]")).replace("]])", "]], tolerance: 1)"), "only 16 points"),
        (bezier(&format!("{all}, tolerance: 1, weights: [1, 2]")), "one weight for each point"),
        (format!("Patches(points: [{same}], {all}, tolerance: 1)"), "no surface comes of these"),
        (
            format!(
                "Patches(points: [{}], {all}, tolerance: 1)",
                points.replacen("(0,", "(NaN,", 1)
            ),
            "`NaN` is not a finite number",
        ),
        (spline("tolerance: 1, weights: [[1, 1, 1, -1]]"), "weights"),
        (spline("tolerance: 1, knots_u: [0, 0, 0, 0, 1]"), "knots"),
        (spline("tolerance: 1, knots_u: [0, 0, 0, 0, 1, 1, 1, 0.5]"), "less than the one before"),
        (spline("tolerance: 1, closed: (true, false), knots_u: [0]"), "leave out `knots_u`"),
        ("Spline(rows: [[(0, 0, 0)]], tolerance: 1)".to_owned(), "at least 4 rows"),
        (spline("tolerance: 1").replacen("(0, 0, 0), ", "", 1), "at least 4 rows"),
    ] {
        let told = mistakes(&with_part(&format!(r#"meshes: {{"m": {mesh}}}"#)));
        assert!(told.contains(message) && told.contains("meshes.m"), "{mesh}: {told}");
    }
    // Beyond what a mesh may be, whatever the numbers.
    let bent = points.replacen("(1, 1, 0)", "(1, 1, 9000000)", 1);
    let mesh = format!("Patches(points: [{bent}], {all}, tolerance: 1e-9)");
    let told = mistakes(&with_part(&format!(r#"meshes: {{"m": {mesh}}}"#)));
    assert!(told.contains("at most 67108864 triangles"), "{told}");
}

/// A shape which becomes a mesh: what is wrong with it, or with how closely it is followed.
#[test]
fn tessellations_say_what_is_wrong() {
    for (fields, message) in [
        ("shape: Sphere(radius: 1)", "tolerance"),
        ("tolerance: 1", "shape"),
        ("shape: Sphere(radius: 1), tolerance: -1", "tolerance"),
        ("shape: Sphere(radius: NaN), tolerance: 1", "`NaN` is not a finite number"),
        ("shape: Spere(radius: 1), tolerance: 1", "`Sphere`"),
        ("shape: Plane(), tolerance: 1", "shapes with an end"),
        ("shape: Mesh(\"m\"), tolerance: 1", "no meshes"),
        ("shape: Sphere(radius: 1e6), tolerance: 1e-9", "at most 67108864 triangles"),
        ("shape: Revolution(profile: \"vase\"), tolerance: 1", "there is no profile named `vase`"),
    ] {
        let told = mistakes(&with_part(&format!(r#"meshes: {{"m": Tessellated({fields})}}"#)));
        assert!(told.contains(message) && told.contains("meshes.m"), "{fields}: {told}");
    }
}

/// What is wrong with an outline or a text says so where it is.
#[test]
fn extrusions_say_what_is_wrong() {
    let ring = "Lines(points: [(0, 0), (1, 0), (1, 1)])";
    let drawn = |outline: &str, rest: &str| format!("Extrusion(outline: [{outline}], {rest})");
    for (mesh, message) in [
        (drawn(ring, "depth: 0, tolerance: 1"), "depth"),
        (drawn(ring, "depth: 1, tolerance: -1"), "tolerance"),
        (drawn(ring, "depth: 1"), "tolerance"),
        (drawn(ring, "depth: 1, tolerance: 1, smooth: 200"), "smooth"),
        (drawn("", "depth: 1, tolerance: 1"), "goes around nothing"),
        (drawn("Lines(points: [(0, 0), (1, 0)])", "depth: 1, tolerance: 1"), "goes around nothing"),
        (drawn("Lines(points: [(0, 0)])", "depth: 1, tolerance: 1"), "2 points"),
        (drawn("Lines(points: [(NaN, 0), (1, 0)])", "depth: 1, tolerance: 1"), "not a finite"),
        (
            drawn("Bezier(points: [(0, 0), (1, 0), (1, 1)])", "depth: 1, tolerance: 1"),
            "3·n + 1 points",
        ),
        (
            r#"Text(text: "a", font: "none.ttf", size: 1, depth: 1, tolerance: 1)"#.to_owned(),
            "none.ttf",
        ),
    ] {
        let told = mistakes(&with_part(&format!(r#"meshes: {{"m": {mesh}}}"#)));
        assert!(told.contains(message) && told.contains("meshes.m"), "{mesh}: {told}");
    }
}

/// A dispersion which is no clear solid's, or says the index beside another; scattering out of range.
#[test]
fn solids_say_what_is_wrong() {
    for (fields, message) in [
        ("dispersion: Glas", "`Glas`"),
        ("dispersion: Abbe(0)", "at least 1"),
        ("dispersion: Abbe(NaN)", "`NaN` is not a finite number"),
        ("dispersion: Cauchy(a: 0.5, b: 0)", "outside of 1 to 10"),
        ("dispersion: Sellmeier(b: [1, 1], c: [0.01])", "as many of one as of the other"),
        ("dispersion: Sellmeier(b: [1], c: [0.3])", "outside of 1 to 10"),
        ("ior: 1.5, dispersion: Bk7", "says the index of refraction itself"),
        ("scattering: (coefficient: (-1, 0, 0))", "at least 0"),
        ("scattering: (coefficient: (1, 1, 1), phase: HenyeyGreenstein(1))", "less than 1"),
        ("scattering: (phase: Rayleigh)", "coefficient"),
        ("scattering: (coefficient: (1, 1, 1), phase: Rayleig)", "Rayleigh"),
        ("emission: (-1, 0, 0)", "at least 0"),
    ] {
        let part = format!(r#"materials: {{"m": Dielectric({fields})}}"#);
        let told = mistakes(&with_part(&part));
        assert!(told.contains(message) && told.contains("materials.m"), "{fields}: {told}");
    }
}

/// A temperature gives the colour of a blackbody with the luminance asked for.
#[test]
fn lamps_glow_by_their_temperature() {
    let lamp = |fields: &str| {
        format!(
            r#"(entities: {{"eye": (camera: ()), "lamp": (shape: Sphere(), emission: Temperature({fields}))}})"#
        )
    };
    let scene = with_settings(&lamp("kelvin: 2700, radiance: 12"), &[]).expect("it is a lamp");
    let emission = scene.entities["lamp"].emission.as_ref().expect("it shines");
    assert_eq!(emission.strength, EmissionStrength::Temperature { kelvin: 2700.0, radiance: 12.0 });
    let color = crate::color::Blackbody::new(2700.0).color;
    assert!((crate::color::luminance(color) - 1.0).abs() < 1e-4);
    assert!(color.x > color.y && color.y > color.z, "{color}");
    for (fields, message) in [
        ("kelvin: 100, radiance: 1", "at least 500"),
        ("kelvin: NaN, radiance: 1", "not a finite number"),
        ("kelvin: 3000, radiance: -1", "`radiance` must be"),
        ("kelvin: 3000", "radiance"),
        ("kelvin: 3000, radiance: 1, power: 1", "power"),
    ] {
        let told = mistakes(&lamp(fields));
        assert!(told.contains(message) && told.contains("entities.lamp"), "{fields}: {told}");
    }
}
