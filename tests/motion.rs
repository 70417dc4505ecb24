//! Motion blur: coverage over the shutter against closed forms, stills, and other ways to say the
//! same motion.

mod common;

use common::{Picture, render, render_description, scene};
use glam::{DAffine3, DQuat, DVec3};
use kinora::description::{Extend, Interpolation, Key, Keyframes, Track};

/// Emitters in the dark before an orthographic camera of 1 pixel per metre, over a shutter of one second.
fn before_camera(pixels: u32, things: &str) -> String {
    format!(
        r#"(
        clock: (fps: 1, shutter: (0, 1)),
        render: (filter: Box(), max_depth: 1),
        entities: {{
            "camera": (transform: (translation: (0, 0, 200)), camera: (orthographic: Some({pixels}))),
            {things}
        }})"#
    )
}

const GLOW: &str = "emission: Radiance((1, 1, 1))";

fn difference(a: &Picture, b: &Picture) -> f64 {
    a.green().iter().zip(b.green()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// A ball of radius 10 from rational curves.
const BALL: &str = "Revolution(profile: Bezier(points: [(0, -10), (5.857864376269049, -10), (10, -5.857864376269049), (10, 0), (10, 5.857864376269049), (5.857864376269049, 10), (0, 10)], weights: [1, 0.8047378541243649, 0.8047378541243649, 1, 0.8047378541243649, 0.8047378541243649, 1]))";

/// Oracle: a disk of radius 10 which moves by L = 100 covers a point y off its line for the share
/// `2√(r² − y²)/L` of the time: 0.2 on the line and 0.16 for y = 6; the box filter of a pixel averages it.
/// So does a ball, made by turning a circle.
#[test]
fn a_moving_disk_covers_each_point_for_its_share_of_the_time() {
    for shape in ["Disk(radius: 10)", BALL] {
        let disk = format!(
            r#""disk": (transform: (translation: (-50, 0, 0)), velocity: (linear: (100, 0, 0)), shape: {shape}, {GLOW})"#
        );
        let picture = render(&before_camera(31, &disk), (31, 31), 1024);
        // ∫√(r² − y²) dy over a pixel
        let area = |y: f64| {
            0.5 * (y * (100.0 - y * y).max(0.0).sqrt() + 100.0 * (y / 10.0).clamp(-1.0, 1.0).asin())
        };
        for row in 0..31 {
            let y = 15.0 - f64::from(row);
            let expected = 2.0 * (area(y + 0.5) - area(y - 0.5)) / 100.0;
            let row_mean = picture.mean_where(|x, at| at == row && (10..21).contains(&x));
            assert!(
                (row_mean.mean - expected).abs() <= 3.0 * row_mean.error + 1e-4,
                "y = {y}: {row_mean:?} instead of {expected}"
            );
        }
        let line = picture.mean_where(|x, y| y == 15 && (10..21).contains(&x)).mean;
        let off = picture.mean_where(|x, y| (y == 9 || y == 21) && (10..21).contains(&x)).mean;
        assert!((line - 0.2).abs() < 2e-3 && (off - 0.16).abs() < 2e-3, "{line}, {off}");
    }
}

/// Oracle: an edge which moves by L pixels covers a point x behind its start for `clamp(1 − x/L, 0, 1)`.
#[test]
fn a_moving_edge_leaves_a_linear_ramp() {
    let wall = format!(
        r#""wall": (transform: (translation: (-108, 0, 0)), velocity: (linear: (16, 0, 0)), shape: Rectangle(size: (200, 100)), {GLOW})"#
    );
    let picture = render(&before_camera(1, &wall).replacen("Some(1)", "Some(4)", 1), (24, 4), 1024);
    for x in 0..24 {
        let behind = f64::from(x) + 0.5 - 4.0;
        let expected = (1.0 - behind / 16.0).clamp(0.0, 1.0);
        let column = picture.mean_where(|at, _| at == x);
        assert!(
            (column.mean - expected).abs() <= 3.0 * column.error + 2e-3,
            "x = {x}: {column:?}, {expected}"
        );
    }
}

/// Oracle: a blade of 40° which makes ten whole turns covers every point of its ring for one ninth of
/// the time; also with half a turn more.
#[test]
fn a_blade_of_ten_turns_covers_a_ninth() {
    let (sin, cos) = 20_f64.to_radians().sin_cos();
    let far = 20.0 / cos;
    let blade = format!(
        r#"meshes: {{"blade": Triangles(positions: [(0, 0, 0), ({}, {}, 0), ({}, {}, 0)], triangles: [(0, 1, 2)])}}, entities"#,
        far * cos,
        -far * sin,
        far * cos,
        far * sin
    );
    for motion in [
        "velocity: (angular: (0, 0, 3600))",
        "keyframes: (turn: (axis: (0, 0, 1), keys: [(0, 0), (1, 3600)]))",
        "keyframes: (turn: (axis: (0, 0, 1), keys: [(0, 0), (1, -3600)]))",
    ] {
        let things =
            format!(r#""blade": ({motion}, shape: Mesh("blade"), two_sided: true, {GLOW})"#);
        let text = before_camera(25, &things).replacen("entities", &blade, 1);
        let picture = render(&text, (25, 25), 1024);
        let ring = |x: u32, y: u32| {
            let r = f64::hypot(f64::from(x) - 12.0, f64::from(y) - 12.0);
            (3.0..11.0).contains(&r)
        };
        picture.mean_where(ring).assert_agrees(motion, 1.0 / 9.0, 5e-3);
        for y in 0..25 {
            for x in 0..25 {
                let value = f64::from(picture.at(x, y).y);
                // binomial with p = 1/9: σ = 0.0098 at most for 1024 samples; level 1e-6 for each
                assert!(
                    !ring(x, y) || (value - 1.0 / 9.0).abs() < 0.048,
                    "{motion} ({x}, {y}): {value}"
                );
            }
        }
    }
}

/// Oracle: a point which turns by 90° about a centre runs along the arc: the chord's middle lies inside
/// the sagitta of 0.293 r and is never covered, the arc's middle is.
#[test]
fn rotations_follow_the_arc_and_not_the_chord() {
    let ball = format!(
        r#""arm": (velocity: (angular: (0, 0, 90))),
           "ball": (parent: "arm", transform: (translation: (20, 0, 0)), shape: Sphere(radius: 1), {GLOW})"#
    );
    let picture = render(&before_camera(48, &ball), (48, 48), 256);
    let at = |p: DVec3| picture.at((24.0 + p.x) as u32, (24.0 - p.y) as u32).y;
    let middle = DQuat::from_rotation_z(45_f64.to_radians()) * DVec3::X * 20.0;
    assert!(at(middle) > 0.0, "the arc's middle is covered");
    assert_eq!(at(DVec3::new(10.0, 10.0, 0.0)), 0.0, "the chord's middle is not");
    // The total light does not depend on the motion: the ball's area, π.
    let total: f64 = picture.green().iter().sum();
    assert!((total - std::f64::consts::PI).abs() < 0.03, "{total}");
}

/// A wheel with a coloured spoke on an accelerating, turning cart, lit by a lamp; `{}` is where the
/// entities of the motion go.
fn stage(things: &str) -> String {
    format!(
        r#"(
        clock: (fps: 10, frames: (0, 9), shutter: (0, 1)),
        render: (filter: Box(), size: (24, 24), samples: 64),
        materials: {{"white": Diffuse(albedo: (0.8, 0.8, 0.8)), "mirror": Mirror()}},
        entities: {{
            "camera": (transform: (translation: (0, 1, 6), look_at: (0, 0.5, 0)), camera: (fov: 40)),
            "floor": (shape: Plane(), material: "white"),
            "sky": (light: Sky(radiance: (0.3, 0.4, 0.5))),
            "lamp": (transform: (translation: (1, 4, 2)), shape: Sphere(radius: 0.5), emission: Radiance((20, 20, 20))),
            {things}
        }})"#
    )
}

/// Oracle: a child which moves in the frame of a moving parent is at the product of both poses. The
/// same motion written as keys of one entity, at 65 instants per frame, gives the same picture
/// but for what joins the keys.
#[test]
fn a_moving_child_of_a_moving_parent_equals_the_motion_flattened() {
    let nested = stage(
        r#""cart": (transform: (translation: (-1, 0.8, 0)), velocity: (linear: (6, 0, 0), angular: (0, 90, 0)), acceleration: (0, 5, 0)),
           "wheel": (parent: "cart", transform: (translation: (0.3, 0, 0.4)), velocity: (angular: (0, 0, 300)), shape: Box(size: (1.2, 0.3, 0.3)), emission: Radiance((2, 2, 2)))"#,
    );
    let pose = |t: f64| {
        let cart = DAffine3::from_rotation_translation(
            DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2 * t),
            DVec3::new(-1.0 + 6.0 * t, 0.8 + 2.5 * t * t, 0.0),
        );
        cart * DAffine3::from_rotation_translation(
            DQuat::from_rotation_z(300_f64.to_radians() * t),
            DVec3::new(0.3, 0.0, 0.4),
        )
    };
    let flat = stage(
        r#""wheel": (transform: (), shape: Box(size: (1.2, 0.3, 0.3)), emission: Radiance((2, 2, 2)))"#,
    );
    let mut flat = scene(&flat);
    let times: Vec<f64> = (0..=64).map(|k| 0.3 + 0.1 * f64::from(k) / 64.0).collect();
    let translation = times
        .iter()
        .map(|&time| Key { time, value: pose(time).translation, tangents: None })
        .collect();
    let rotation = times
        .iter()
        .map(|&time| Key { time, value: DQuat::from_mat3(&pose(time).matrix3), tangents: None })
        .collect();
    let (interpolation, extend) = (Interpolation::Linear, Extend::Hold);
    flat.entities["wheel"].keyframes = Some(Keyframes {
        translation: Some(Track { keys: translation, interpolation, extend }),
        rotation: Some(Track { keys: rotation, interpolation, extend }),
        ..Keyframes::default()
    });
    let a = render_description(&scene(&nested), 3);
    let b = render_description(&flat, 3);
    // Equal seeds: only rays within a thousandth of the motion of an edge differ.
    let mean = a.green().iter().zip(b.green()).map(|(a, b)| (a - b).abs()).sum::<f64>() / 576.0;
    assert!(mean < 2e-3, "mean difference {mean}");
    assert!(
        a.report.rebuilt.iter().any(|what| what.contains("instances")),
        "{:?}",
        a.report.rebuilt
    );
    // and the motion is there at all
    let still = nested.replace("shutter: (0, 1)", "shutter: (0, 0)");
    let still = render_description(&scene(&still), 3);
    let moved =
        a.green().iter().zip(still.green()).map(|(a, b)| (a - b).abs()).sum::<f64>() / 576.0;
    assert!(moved > 0.01, "{moved}");
}

const TUMBLING: &str = r#"
    "box": (transform: (translation: (-1, 1, 0), scale: (1, 0.5, 0.7)), velocity: (linear: (15, 3, 0), angular: (100, 700, 50)),
            shape: Box(), material: "white"),
    "ball": (transform: (translation: (1, 0.6, -1)), velocity: (linear: (0, 0, 8)), shape: Sphere(radius: 0.6), material: "mirror")"#;

/// Oracle: a frame is the mean of the stills over its shutter: 64 of them, at the middles of as many
/// parts. Level: the mean over the picture within 3 standard errors, no pixel beyond 6.
#[test]
fn a_frame_is_the_mean_of_the_stills_over_its_shutter() {
    let mut blurred = scene(&stage(TUMBLING));
    blurred.render.samples = 256;
    let blurred = render_description(&blurred, 0);
    let mut mean = vec![0.0; 576];
    let mut variance = vec![0.0; 576];
    for k in 0..64 {
        let mut still = scene(&stage(TUMBLING));
        let middle = (f64::from(k) + 0.5) / 64.0;
        (still.clock.shutter, still.render.samples, still.render.seed) =
            ((middle, middle), 8, k as u64 + 1);
        let still = render_description(&still, 0);
        for (pixel, (value, v)) in still.green().into_iter().zip(still.variance()).enumerate() {
            mean[pixel] += value / 64.0;
            variance[pixel] += v / 4096.0;
        }
    }
    let (mut sum, mut sum_variance) = (0.0, 0.0);
    for (pixel, (value, v)) in blurred.green().into_iter().zip(blurred.variance()).enumerate() {
        let error = (v + variance[pixel]).sqrt();
        let difference = value - mean[pixel];
        // an edge which moves by a pixel between two stills is stepped: 1/64 of its contrast
        assert!(
            difference.abs() < 6.0 * error + 0.02,
            "pixel {pixel}: {value}, stills {}",
            mean[pixel]
        );
        sum += difference;
        sum_variance += v + variance[pixel];
    }
    assert!(
        sum.abs() < 3.0 * sum_variance.sqrt() + 0.5,
        "{sum}, standard error {}",
        sum_variance.sqrt()
    );
}

/// A shutter which opens and closes at once sees what stands still, bit for bit.
#[test]
fn a_shutter_of_no_length_equals_a_world_at_rest() {
    let mut moving = scene(&stage(TUMBLING));
    moving.clock.shutter = (0.0, 0.0);
    let mut at_rest = moving.clone();
    for (_, entity) in &mut at_rest.entities {
        entity.velocity = None;
    }
    let (a, b) = (render_description(&moving, 0), render_description(&at_rest, 0));
    assert!(a.same_bits(&b), "difference {}", difference(&a, &b));
    // a reversed shutter is refused, not swapped
    moving.clock.shutter = (1.0, 0.0);
    let mut simulation = kinora::frame::Simulation::from_description(&moving);
    assert!(simulation.render_frame(0, &kinora::frame::RenderControl::default()).is_err());
}

/// Oracle: relativity: a camera which moves by v sees what a camera at rest sees of a world that moves by
/// −v; the same samples, so that pictures agree to rounding except on edges.
#[test]
fn a_moving_camera_sees_the_opposite_motion() {
    let text = |camera: &str, wall: &str| {
        format!(
            r#"(
            clock: (fps: 1, shutter: (0, 1)),
            render: (filter: Box(), max_depth: 1),
            textures: {{"checks": Checker(size: 0.2, a: (1, 1, 1), b: (0, 0, 0))}},
            entities: {{
                "camera": ({camera} camera: (fov: 40)),
                "wall": (transform: (translation: (0.05, 0, -3)), {wall} shape: Rectangle(size: (2, 1.5)), emission: Radiance("checks")),
            }})"#
        )
    };
    let pairs = [
        ("velocity: (linear: (0.7, -0.2, 0.4)),", "velocity: (linear: (-0.7, 0.2, -0.4)),"),
        (
            "velocity: (angular: (0, 0, 40)),",
            "keyframes: (turn: (axis: (0, 0, 1), keys: [(0, 0), (1, -40)])),",
        ),
    ];
    for (camera, wall) in pairs {
        // The second pair turns both about the camera's axis: the wall's centre must be on it.
        let centred = |text: String| {
            text.replace(
                "(0.05, 0, -3)",
                if camera.contains("angular") { "(0, 0, -3)" } else { "(0.05, 0, -3)" },
            )
        };
        let a = render(&centred(text(camera, "")), (24, 24), 128);
        let b = render(&centred(text("", wall)), (24, 24), 128);
        let mean = a.green().iter().zip(b.green()).map(|(a, b)| (a - b).abs()).sum::<f64>() / 576.0;
        assert!(mean < 1e-3, "{camera}: mean difference {mean}");
        let still = render(&centred(text("", "")), (24, 24), 128);
        assert!(difference(&a, &still) > 0.2, "{camera}: the motion shows");
    }
}

/// Oracle: the total light of a ball that flies 10⁵ pixels within the shutter is its own, spread: each
/// pixel on its line has `2r/L` of the time, give or take binomial noise.
#[test]
fn an_object_which_crosses_the_scene_within_one_shutter_is_not_lost() {
    let ball = format!(
        r#""ball": (transform: (translation: (-5e4, 0, 0)), velocity: (linear: (1e5, 0, 0)), shape: Rectangle(size: (1000, 40)), {GLOW})"#
    );
    let picture = render(&before_camera(16, &ball), (16, 16), 4096);
    picture.mean().assert_agrees("share of the time", 0.01, 1e-1);
}

/// Oracle: light through a moving scene keeps its time: a mirror and a lamp fixed to it fly together, and
/// the lamp's mirror image is as sharp and bright as when both stand still (to a camera that flies along).
#[test]
fn one_path_has_one_time() {
    let text = |velocity: &str| {
        format!(
            r#"(
            clock: (fps: 1, shutter: (0, 1)),
            render: (filter: Box(), integrator: Path),
            materials: {{"mirror": Mirror(), "white": Diffuse(albedo: (0.8, 0.8, 0.8))}},
            entities: {{
                "ship": ({velocity}),
                "camera": (parent: "ship", transform: (translation: (0, 1, 4), look_at: (0, 0, 0)), camera: (fov: 40)),
                "wall": (parent: "ship", transform: (translation: (-0.8, 0.6, 0), rotation: (0, 60, 0)), shape: Rectangle(size: (3, 3)), material: "white"),
                "mirror": (parent: "ship", transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: (3, 3)), material: "mirror"),
                "ball": (parent: "ship", transform: (translation: (0, 0.5, 0)), shape: Sphere(radius: 0.4), material: "white"),
                "lamp": (parent: "ship", transform: (translation: (1, 2, 1)), shape: Sphere(radius: 0.2), emission: Radiance((9, 9, 9))),
            }})"#
        )
    };
    let fly = render(&text("velocity: (linear: (300, -70, 40))"), (16, 16), 64);
    let rest = render(&text("velocity: (linear: (0, 0, 0))"), (16, 16), 64);
    let mean =
        fly.green().iter().zip(rest.green()).map(|(a, b)| (a - b).abs()).sum::<f64>() / 256.0;
    let level = rest.green().iter().sum::<f64>() / 256.0;
    assert!(mean < 1e-3 * level.max(0.1), "mean difference {mean} of {level}");
}

/// Scale and shear over the shutter: a square which grows from 4 to 12 covers a point x from its middle
/// while its half side is greater: `clamp((6 − x)/4, 0, 1)`.
#[test]
fn growth_over_the_shutter_is_blurred_too() {
    let square = format!(
        r#""square": (keyframes: (scale: (keys: [(0, 4), (1, 12)])), shape: Rectangle(), {GLOW})"#
    );
    let picture = render(&before_camera(16, &square), (16, 16), 1024);
    for x in 0..16 {
        let from_middle = (f64::from(x) - 7.5).abs();
        let column = picture.mean_where(|at, y| at == x && (7..9).contains(&y));
        let expected = ((6.0 - from_middle) / 4.0).clamp(0.0, 1.0);
        // the box filter rounds the ends of the ramp by 1/32 at most
        assert!(
            (column.mean - expected).abs() < 3.0 * column.error + 0.035,
            "x = {x}: {column:?}, {expected}"
        );
    }
}

/// Oracle: the integral of the track by hand, 1 for every one of them; the shutter is one second.
#[test]
fn flashes_and_jumps_of_a_lamp_within_the_shutter_are_not_missed() {
    let triangle = |width: f64| {
        let (a, b) = (0.371 - 0.5 * width, 0.371 + 0.5 * width);
        format!("(keys: [({a}, 0), (0.371, {}), ({b}, 0)])", 2.0 / width)
    };
    let step = |width: f64| {
        let (a, b) = (0.371 - 0.5 * width, 0.371 + 0.5 * width);
        format!("(interpolation: Step, keys: [(0, 0), ({a}, {}), ({b}, 0)])", 1.0 / width)
    };
    let mut tracks = vec!["(interpolation: Step, keys: [(-1, 0), (0.5, 2)])".to_owned()];
    for width in [0.5, 0.05, 0.01, 0.001] {
        tracks.extend([triangle(width), step(width)]);
    }
    for track in tracks {
        let lamp = format!(
            r#""lamp": (shape: Rectangle(size: (9, 9)), {GLOW}, keyframes: (emission: {track}))"#
        );
        let seen = render(&before_camera(3, &lamp), (3, 3), 4).mean().mean;
        assert!((seen - 1.0).abs() < 1e-6, "{track}: {seen}");
    }
}

/// Oracle: a lens that jumps at half the shutter shows either view for half the time: the corner of the picture sees the
/// emitter with the narrow one alone. Something that is away for a hundredth of the shutter is there for the rest.
#[test]
fn what_jumps_within_the_shutter_jumps_at_its_key() {
    let text = format!(
        r#"(
        clock: (fps: 1, shutter: (0, 1)),
        render: (filter: Box(), max_depth: 1),
        entities: {{
            "camera": (camera: (), keyframes: (fov: (interpolation: Step, keys: [(0, 20), (0.5, 60)]))),
            "lamp": (transform: (translation: (0, 0, -2)), shape: Rectangle(size: (1, 1)), {GLOW}),
        }})"#
    );
    let corner = render(&text, (9, 9), 1024).mean_where(|x, y| x == 0 && y == 0).mean;
    assert!((corner - 0.5).abs() < 2e-3, "{corner}");
    let away = format!(
        r#""lamp": (shape: Rectangle(size: (9, 9)), {GLOW}, keyframes: (translation: (interpolation: Step, keys: [
            (0, (0, 0, 0)), (0.62, (90, 0, 0)), (0.63, (0, 0, 0))])))"#
    );
    let seen = render(&before_camera(3, &away), (3, 3), 4096).mean_where(|x, _| x == 1).mean;
    assert!((seen - 0.99).abs() < 2e-3, "{seen}");
}
