//! The program from outside: exit codes, files, going on after an interruption.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const SCENE: &str = r#"
Scene(
    entities: {
        "camera": (transform: (translation: (0, 0, 4)), camera: (fov: 40)),
        "ball": (shape: Sphere(radius: 1), emission: Radiance((0.5, 0.25, 0.125))),
    },
)
"#;

/// Runs `kinora` in `folder` on a scene of 8 × 8 pixels which is there as `a.ron`.
fn render(folder: &Path, more: &[&str]) -> Output {
    fs::write(folder.join("a.ron"), SCENE).expect("temporary folder is writable");
    let common = ["render", "a.ron", "--size", "8x8", "--samples", "2"];
    kinora(folder, &[&common, more].concat())
}

fn kinora(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kinora"));
    command.current_dir(folder).args(arguments).output().expect("the program starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("temporary folder")
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("exists");
    let mut names: Vec<_> =
        entries.map(|e| e.expect("readable").file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn help_and_version_succeed_and_misuse_is_code_2() {
    let folder = folder();
    for good in [&["--help"][..], &["--version"], &["render", "--help"], &["check", "-h"]] {
        let output = kinora(folder.path(), good);
        assert_eq!(output.status.code(), Some(0), "{good:?}");
        assert!(output.stdout.len() > 5);
    }
    for wrong in [
        &[][..],
        &["paint"],
        &["render"],
        &["render", "a.ron", "--size", "8"],
        &["render", "a.ron", "--size", "0x8"],
        &["render", "a.ron", "--samples", "0"],
        &["render", "a.ron", "--threads", "0"],
        &["render", "a.ron", "--frames", "9-3"],
        &["render", "a.ron", "--set", "render.samples"],
        &["render", "a.ron", "--integrator", "magic"],
    ] {
        let output = kinora(folder.path(), wrong);
        assert_eq!(output.status.code(), Some(2), "{wrong:?}: {}", stderr(&output));
    }
}

#[test]
fn a_scene_without_a_command_is_answered_with_the_command() {
    let folder = folder();
    fs::write(folder.path().join("a.ron"), SCENE).expect("writable");
    for words in [&["a.ron"][..], &["a.ron", "-f", "3"], &["-s", "4", "a.ron"]] {
        let output = kinora(folder.path(), words);
        assert_eq!(output.status.code(), Some(2), "{words:?}");
        let meant = format!("did you mean: kinora render {}\n", words.join(" "));
        assert!(stderr(&output).ends_with(&meant), "{}", stderr(&output));
    }
}

#[test]
fn short_options_stand_for_the_long_ones() {
    let folder = folder();
    let long = ["--frames", "1", "--samples", "3", "--threads", "1", "--out", "long"];
    let short = ["-f1", "-s", "3", "-j1", "-o", "short"];
    for options in [&long[..], &short] {
        fs::write(folder.path().join("a.ron"), SCENE).expect("writable");
        let arguments = [&["render", "a.ron", "--size", "8x8"], options].concat();
        assert_eq!(kinora(folder.path(), &arguments).status.code(), Some(0));
    }
    let read = |path: &str| fs::read(folder.path().join(path)).expect("was written");
    assert!(read("long/a.0001.exr") == read("short/a.0001.exr"));
}

/// Roff begins with its title line; the page of a command has that command's options.
#[test]
fn the_manual_and_the_completions_are_printed() {
    let folder = folder();
    let printed = |words: &[&str]| {
        let output = kinora(folder.path(), words);
        assert_eq!(output.status.code(), Some(0), "{words:?}: {}", stderr(&output));
        String::from_utf8(output.stdout).expect("UTF-8")
    };
    assert!(printed(&["man"]).contains(".TH kinora 1"));
    let page = printed(&["man", "render"]);
    assert!(page.contains(".TH kinora-render 1") && page.contains("threads"), "{page}");
    assert!(printed(&["completions", "bash"]).contains("--threads"));
    assert_eq!(kinora(folder.path(), &["man", "paint"]).status.code(), Some(2));
}

#[test]
fn a_missing_scene_is_code_1_and_leaves_no_folder() {
    let folder = folder();
    for command in ["render", "check"] {
        let output = kinora(folder.path(), &[command, "nowhere.ron"]);
        assert_eq!(output.status.code(), Some(1), "{command}");
        assert!(stderr(&output).contains("nowhere.ron"), "{}", stderr(&output));
    }
    assert!(names_in(folder.path()).is_empty());
}

#[test]
fn an_output_folder_that_cannot_be_is_code_74() {
    let folder = folder();
    fs::write(folder.path().join("file"), "").expect("writable");
    let output = render(folder.path(), &["--out", "file/deep"]);
    assert_eq!(output.status.code(), Some(74));
    assert!(stderr(&output).contains("file/deep"), "{}", stderr(&output));
}

/// The scene names a file which lies in the folder where the program runs.
#[test]
fn a_scene_may_come_from_the_standard_input() {
    let folder = folder();
    fs::write(folder.path().join("part.ron"), SCENE).expect("writable");
    let run = |arguments: &[&str], text: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinora"));
        command.current_dir(folder.path()).args(arguments);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program starts");
        let mut stdin = child.stdin.take().expect("it is piped");
        stdin.write_all(text.as_bytes()).expect("the program reads");
        drop(stdin);
        child.wait_with_output().expect("it ends")
    };
    let scene = r#"(include: ["part.ron"], render: (size: (8, 8), samples: 2))"#;
    let output = run(&["render", "-", "-f", "-1"], scene);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let out = folder.path().join("out/stdin");
    assert_eq!(names_in(&out), ["manifest.json", "stdin.-0001.exr", "stdin.-0001.png"]);
    assert_eq!(run(&["check", "-"], scene).status.code(), Some(0));
    let output = run(&["check", "-"], "(include: 3)");
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("<stdin>:1:11"), "{}", stderr(&output));
}

#[test]
fn frames_before_time_0_are_rendered_and_resumed() {
    let folder = folder();
    let made = |frames| rendered_and_developed(folder.path(), &["--frames", frames]);
    assert_eq!(made("-2-0").0, [-2, -1, 0]);
    assert_eq!(made("-3--1").0, [-3]);
    let bytes = fs::read(folder.path().join("out/a/manifest.json")).expect("was written");
    let record: serde_json::Value = serde_json::from_slice(&bytes).expect("is JSON");
    let frames = record["frames"].as_array().expect("a list").iter();
    assert_eq!(frames.map(|f| f["frame"].as_i64()).collect::<Vec<_>>(), [-3, -2, -1, 0].map(Some));
}

#[test]
fn a_render_leaves_exactly_its_frames_and_the_record() {
    let folder = folder();
    let output = render(folder.path(), &["--frames", "7,3"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let out = folder.path().join("out/a");
    assert_eq!(
        names_in(&out),
        ["a.0003.exr", "a.0003.png", "a.0007.exr", "a.0007.png", "manifest.json"]
    );
    let bytes = fs::read(out.join("manifest.json")).expect("was written");
    let record: serde_json::Value = serde_json::from_slice(&bytes).expect("is JSON");
    let frames: Vec<_> =
        record["frames"].as_array().expect("list").iter().map(|f| &f["frame"]).collect();
    assert_eq!(frames, [3, 7]);
    assert_eq!(record["settings"]["size"], serde_json::json!([8, 8]));
}

/// Runs as `render` does, and tells which frames were rendered and how many only developed.
fn rendered_and_developed(folder: &Path, more: &[&str]) -> (Vec<i64>, u64) {
    let output = render(folder, &[&["--progress", "json"], more].concat());
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let events: Vec<serde_json::Value> =
        text.lines().map(|line| serde_json::from_str(line).expect("one object a line")).collect();
    let frames = events.iter().filter(|event| event["event"] == "frame");
    let frames = frames.map(|event| event["frame"].as_i64().expect("number")).collect();
    let end = events.last().expect("the end is told");
    (frames, end["developed"].as_u64().expect("number"))
}

#[test]
fn only_what_is_missing_or_damaged_is_made_again() {
    let folder = folder();
    let out = folder.path().join("out/a");
    let made = |more: &[&str]| {
        rendered_and_developed(folder.path(), &[&["--frames", "0-3"], more].concat())
    };
    assert_eq!(made(&[]), (vec![0, 1, 2, 3], 0));
    let files = ["a.0002.exr", "a.0000.png"];
    let whole = files.map(|name| fs::read(out.join(name)).expect("was written"));
    assert_eq!(made(&[]), (vec![], 0));
    fs::write(out.join(files[0]), &whole[0][..whole[0].len() / 2]).expect("writable");
    fs::remove_file(out.join(files[1])).expect("was written");
    let mut flipped = fs::read(out.join("a.0003.exr")).expect("was written");
    let last = flipped.len() - 1; // of the pixels of the last layer
    flipped[last] ^= 1;
    fs::write(out.join("a.0003.exr"), flipped).expect("writable");
    assert_eq!(made(&[]), (vec![2, 3], 1));
    let again = files.map(|name| fs::read(out.join(name)).expect("was written"));
    assert!(again == whole, "to the byte");
    assert_eq!(made(&["--seed", "5"]), (vec![0, 1, 2, 3], 0));
    assert_eq!(made(&["--seed", "5", "--fresh"]), (vec![0, 1, 2, 3], 0));
}

/// Both from the command line and in the file, for an EXR of 32 and of 16 bits: the PNG is what a
/// render with these settings would have made, to the byte.
#[test]
fn another_exposure_or_tone_curve_renders_nothing() {
    for bits in ["render.exr_bits=32", "render.exr_bits=16"] {
        let folder = folder();
        let read = |path: &str| fs::read(folder.path().join(path)).expect("was written");
        let made = |more: &[&str]| {
            rendered_and_developed(
                folder.path(),
                &[&["--frames", "0-1", "--set", bits], more].concat(),
            )
        };
        let agx = ["--set", "render.tonemap=Agx", "--set", "render.exposure=1.5"];
        assert_eq!(made(&[]).0, [0, 1]);
        let (exr, png) = (read("out/a/a.0001.exr"), read("out/a/a.0001.png"));
        assert_eq!(made(&agx), (vec![], 2));
        assert_eq!(made(&agx), (vec![], 0));
        assert!(read("out/a/a.0001.exr") == exr);
        assert_eq!(made(&[&agx[..], &["--out", "fresh"]].concat()).0, [0, 1]);
        assert!(
            read("out/a/a.0001.png") == read("fresh/a.0001.png") && png != read("fresh/a.0001.png")
        );
    }
}

#[test]
fn settings_in_the_file_count_as_those_of_the_command_line() {
    let folder = folder();
    let run = |settings: &str| {
        let scene = SCENE.replacen('(', &format!("({settings}, "), 1);
        fs::write(folder.path().join("b.ron"), scene).expect("writable");
        let arguments = ["render", "b.ron", "--progress", "json"];
        let output = kinora(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        String::from_utf8_lossy(&output.stdout).matches("\"event\":\"frame\"").count()
    };
    let first = "render: (size: (8, 8), samples: 2), clock: (frames: (0, 1))";
    assert_eq!(run(first), 2);
    assert_eq!(run(&first.replace("samples: 2", "samples: 2, tonemap: Agx /* less red */")), 0);
    assert_eq!(run(&first.replace("(0, 1)", "(0, 2)")), 1);
    assert_eq!(run(&first.replace("samples: 2", "samples: 3")), 2);
}

/// The EXR says where the part lies in the picture, the PNG is as large as the part; going on from one to the
/// other renders again.
#[test]
fn a_region_is_rendered_alone() {
    let folder = folder();
    let made = |more: &[&str]| rendered_and_developed(folder.path(), more);
    let part = ["--region", "2,3,4,5", "--exr-layout", "single", "-o", "part"];
    assert_eq!(made(&part).0, [0]);
    assert_eq!(made(&part), (vec![], 0));
    let whole = ["--exr-layout", "single", "-o", "whole"];
    assert_eq!(made(&whole).0, [0]);
    let read = |name: &str| {
        exr::prelude::read_all_flat_layers_from_file(folder.path().join(name))
            .expect("just written")
    };
    let image = read("part/a.0000.exr");
    let (display, layer) = (image.attributes.display_window, &image.layer_data[0]);
    assert_eq!((display.size.0, display.size.1), (8, 8));
    assert_eq!((layer.size.0, layer.size.1), (4, 5));
    let corner = layer.attributes.layer_position;
    assert_eq!((corner.0, corner.1), (2, 3));
    let png = |name: &str| image::open(folder.path().join(name)).expect("just written").into_rgb8();
    let (part_png, whole_png) = (png("part/a.0000.png"), png("whole/a.0000.png"));
    assert_eq!(part_png.dimensions(), (4, 5));
    for (x, y, pixel) in part_png.enumerate_pixels() {
        assert_eq!(pixel, whole_png.get_pixel(x + 2, y + 3));
    }
    assert_eq!(made(&[&part[..4], &["-o", "whole"]].concat()).0, [0]);
    let output = render(folder.path(), &["--region", "5,0,4,4"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("8 × 8 pixels"), "{}", stderr(&output));
}

#[test]
fn a_folder_is_developed_again() {
    let folder = folder();
    let read = |path: &str| fs::read(folder.path().join(path)).expect("was written");
    assert_eq!(render(folder.path(), &["--frames", "0-2"]).status.code(), Some(0));
    let sure = |arguments: &[&str]| {
        let output = kinora(folder.path(), &[&["develop"], arguments].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    };
    sure(&["out/a", "--set", "render.tonemap=Agx"]);
    // What is not named stays as it is.
    sure(&["out/a/a.0000.exr", "out/a/a.0002.exr", "--set", "render.exposure=1.5"]);
    sure(&["out/a/a.0001.exr", "--set", "render.exposure=1.5", "--out", "there"]);
    let agx = ["--set", "render.tonemap=Agx", "--set", "render.exposure=1.5", "--out", "fresh"];
    render(folder.path(), &[&["--frames", "0-2"], &agx[..]].concat());
    for (developed, rendered) in [
        ("out/a/a.0000.png", "fresh/a.0000.png"),
        ("out/a/a.0002.png", "fresh/a.0002.png"),
        ("there/a.0001.png", "fresh/a.0001.png"),
    ] {
        assert!(read(developed) == read(rendered), "{developed}");
    }
    assert!(read("out/a/a.0001.png") != read("fresh/a.0001.png"));
}

#[test]
fn what_cannot_be_developed_is_told() {
    let folder = folder();
    render(folder.path(), &["--frames", "0-1"]);
    fs::create_dir(folder.path().join("empty")).expect("writable");
    for (arguments, code, words) in [
        (&["nowhere"][..], 1, &["nowhere"][..]),
        (&["empty"], 1, &["no EXR file in `empty`", "kinora render"]),
        (&["a.ron"], 1, &["cannot read a picture from `a.ron`"]),
        (&["out/a", "--set", "render.samples=8"], 2, &["render.samples", "render.tonemap"]),
        (&["out/a", "--set", "render.tonemap=Agfx"], 1, &["Agfx", "Agx"]),
        (&["out/a", "--set", "render.exposure=99"], 1, &["render.exposure", "60"]),
        (&["out/a", "out/a/a.0001.exr"], 2, &["a.0001.png"]),
    ] {
        let output = kinora(folder.path(), &[&["develop"], arguments].concat());
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", stderr(&output));
        let told = stderr(&output);
        assert!(words.iter().all(|word| told.contains(word)), "{arguments:?}: {told}");
    }
    // One broken file does not keep the others.
    fs::write(folder.path().join("out/a/a.0000.exr"), "broken").expect("writable");
    fs::remove_file(folder.path().join("out/a/a.0001.png")).expect("was written");
    let output = kinora(folder.path(), &["develop", "out/a"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("a.0000.exr") && stderr(&output).contains("1 PNG developed"));
    assert!(folder.path().join("out/a/a.0001.png").exists());
}

#[test]
fn warnings_are_told_once_and_not_for_every_frame() {
    let folder = folder();
    let suspicious = SCENE
        .replace(
            "entities:",
            r#"render: (integrator: Path), materials: { "spare": Mirror(), "glass": Dielectric() }, entities:"#,
        )
        .replace("emission: Radiance((0.5, 0.25, 0.125))", r#"material: "glass""#)
        .replace(r#""ball""#, r#""spot": (light: Point(power: (1, 1, 1))), "floor": (shape: Plane()), "ball""#);
    fs::write(folder.path().join("b.ron"), suspicious).expect("writable");
    let small = ["render", "b.ron", "--size", "8x8", "--samples", "1", "--frames", "0-3"];
    let output = kinora(folder.path(), &small);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let told = stderr(&output);
    assert_eq!(told.matches("nothing uses the material `spare`").count(), 1, "{told}");
    assert_eq!(told.matches("out of reach").count(), 1, "{told}");
    assert!(!told.contains("warning: warning"), "{told}");
    let check = kinora(folder.path(), &["check", "b.ron"]);
    let text = String::from_utf8_lossy(&check.stdout).into_owned();
    for part in ["requires", "caustics:", "integrator", "nothing uses", "out of reach"] {
        assert!(text.contains(part), "no {part:?} in: {text}");
    }
}

/// Before the first frame, and again at the end.
#[test]
fn a_render_says_which_integrator_runs_and_why() {
    let folder = folder();
    let told = stderr(&render(folder.path(), &["--frames", "0-1"]));
    let reason = "Path (Auto takes it: nothing casts caustics)";
    assert_eq!(told.matches(reason).count(), 2, "{told}");
    let start = told.find(&format!("integrator: {reason}\n")).expect("at the start");
    let frame = told.find("frame 0 done").expect("a line for each frame");
    let end = told.find(&format!("  integrator {reason}\n")).expect("in the summary");
    assert!(start < frame && frame < end, "{told}");
    let set = stderr(&render(folder.path(), &["--integrator", "sppm", "--fresh"]));
    assert!(set.contains("integrator: Sppm (as the settings say)"), "{set}");
}

#[test]
fn the_files_do_not_depend_on_the_number_of_threads() {
    let folder = folder();
    for threads in ["1", "2", "5"] {
        let arguments =
            ["--threads", threads, "--out", threads, "--frames", "2", "--size", "70x40"];
        fs::write(folder.path().join("a.ron"), SCENE).expect("writable");
        let output = kinora(
            folder.path(),
            &[&["render", "a.ron", "--samples", "3"][..], &arguments].concat(),
        );
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        for name in ["a.0002.exr", "a.0002.png"] {
            let read = |of: &str| fs::read(folder.path().join(of).join(name)).expect("was written");
            assert!(read(threads) == read("1"), "{name} with {threads} threads");
        }
    }
}

#[test]
fn a_camera_may_be_named_in_any_script() {
    let folder = folder();
    fs::write(folder.path().join("a.ron"), SCENE.replace("camera\"", "камера 写真機\""))
        .expect("writable");
    let small = ["render", "a.ron", "--size", "8x8", "--samples", "1", "--frames", "0"];
    for arguments in [&small[..], &[&small[..], &["--camera", "камера 写真機"]].concat()] {
        let output = kinora(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
    let metadata = kinora::output::read_metadata(&folder.path().join("out/a/a.0000.exr"));
    let metadata = metadata.expect("just written").expect("has facts");
    assert_eq!(metadata.camera, "камера 写真機");
}

/// `/dev/full` refuses every byte; a pipe whose reader is gone breaks.
#[cfg(target_os = "linux")]
#[test]
fn streams_that_refuse_the_report_change_no_exit_code_of_stderr_and_make_74_of_stdout() {
    let folder = folder();
    fs::write(folder.path().join("a.ron"), SCENE).expect("writable");
    fs::write(folder.path().join("wrong.ron"), "Scene(entities: 5)").expect("writable");
    let run = |words: &str, redirected: &str| {
        let program = env!("CARGO_BIN_EXE_kinora");
        let script =
            format!("exec 3>&1; {{ {program} {words} {redirected}; echo $? >&3; }} | exec true");
        let output = Command::new("sh").current_dir(folder.path()).args(["-c", &script]).output();
        let code = String::from_utf8(output.expect("sh exists").stdout).expect("a number");
        code.trim().parse::<i32>().unwrap_or_else(|_| panic!("{words} {redirected}: {code:?}"))
    };
    let render = "render a.ron --size 8x8 --samples 1 --frames 0-1 --fresh";
    for redirected in ["2>/dev/full", "2>&1 1>/dev/null", "2>&-"] {
        assert_eq!(run("check wrong.ron", redirected), 1, "{redirected}");
        assert_eq!(run("render nowhere.ron", redirected), 1, "{redirected}");
        assert_eq!(run("paint", redirected), 2, "{redirected}");
        assert_eq!(run("check a.ron", redirected), 0, "{redirected}");
        assert_eq!(run(render, redirected), 0, "{redirected}");
        assert_eq!(run("render a.ron --out a.ron/deep", redirected), 74, "{redirected}");
    }
    for words in ["check a.ron", "--help", "--version", &format!("{render} --progress json")] {
        assert_eq!(run(words, ">/dev/full"), 74, "{words}");
        assert_eq!(run(words, ">/dev/full 2>&1"), 74, "{words}");
        assert_eq!(run(words, ""), 0, "{words}: a reader that has seen enough is no failure");
    }
    assert!(folder.path().join("out/a/a.0001.png").exists(), "what was rendered is kept");
}

#[cfg(target_os = "linux")]
#[test]
fn paths_that_are_not_unicode_work() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let folder = folder();
    let at = |name: &[u8]| folder.path().join(OsStr::from_bytes(name));
    for name in [&b"sc\xff"[..], b"as\xfe"] {
        fs::create_dir(at(name)).expect("Linux takes any bytes");
    }
    let scene = SCENE.replace("Scene(", "Scene(include: [\"more.ron\"],");
    fs::write(at(b"sc\xff/\xfd.ron"), scene).expect("writable");
    fs::write(at(b"as\xfe/more.ron"), "Scene()").expect("writable");
    for (out, progress) in [(None, "json"), (Some(at(b"o\xfc")), "human")] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kinora"));
        command.current_dir(folder.path()).arg("render").arg(at(b"sc\xff/\xfd.ron"));
        command.args(["--size", "8x8", "--samples", "1", "--frames", "0", "--progress", progress]);
        command.arg("--assets").arg(at(b"as\xfe"));
        command.args(out.iter().flat_map(|out| [OsStr::new("--out"), out.as_os_str()]));
        let output = command.output().expect("the program starts");
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let out = out.unwrap_or_else(|| at(b"out/\xfd"));
        let record = fs::read(out.join("manifest.json")).expect("was written");
        let record: serde_json::Value = serde_json::from_slice(&record).expect("is JSON");
        for file in record["frames"][0]["files"].as_array().expect("list") {
            assert!(out.join(file.as_str().expect("text")).exists(), "{file} of the record");
        }
    }
}

/// One run of 100,000 small frames is at work; it is killed in the end, and never finishes.
#[cfg(unix)]
#[test]
fn a_folder_belongs_to_one_job_at_a_time_until_its_process_ends_however_it_ends() {
    let folder = folder();
    let film = folder.path().join("film");
    for (name, emission) in [("one", "0.5"), ("two", "0.6")] {
        fs::create_dir(folder.path().join(name)).expect("writable");
        let scene = SCENE.replace("(0.5, 0.25", &format!("({emission}, 0.25"));
        fs::write(folder.path().join(name).join("a.ron"), scene).expect("writable");
    }
    let words = |scene: &'static str, frames: &'static str| {
        ["render", scene, "--size", "8x8", "--samples", "2", "--out", "film", "--frames", frames]
    };
    let mut command = Command::new(env!("CARGO_BIN_EXE_kinora"));
    command.current_dir(folder.path()).args(words("one/a.ron", "0-99999"));
    let mut first = command.stderr(Stdio::null()).spawn().expect("it starts");
    wait_for(&film.join("a.0002.exr"));

    let other = kinora(folder.path(), &words("two/a.ron", "0"));
    assert_eq!(other.status.code(), Some(74));
    for part in ["film", "one/a.ron", &first.id().to_string(), "--out"] {
        assert!(stderr(&other).contains(part), "no {part:?} in: {}", stderr(&other));
    }
    let same = kinora(folder.path(), &words("one/a.ron", "200000-200002"));
    assert_eq!(same.status.code(), Some(0), "side by side: {}", stderr(&same));
    fs::write(film.join(".kinora-killed.tmp"), "half a picture").expect("writable");
    let living = fs::File::create(film.join(".kinora-living.tmp")).expect("writable");
    living.lock().expect("nobody else has it");
    first.kill().expect("SIGKILL");
    first.wait().expect("was started");

    let recorded = |film: &Path| {
        let record = fs::read(film.join("manifest.json")).expect("was written");
        let record: serde_json::Value = serde_json::from_slice(&record).expect("is JSON");
        let frames = record["frames"].as_array().expect("list").iter();
        frames.map(|f| f["frame"].as_u64().expect("number")).collect::<Vec<_>>()
    };
    let frames = recorded(&film);
    for frame in [0, 1, 200_000, 200_001, 200_002] {
        assert!(frames.contains(&frame), "{frame} of {frames:?}");
    }
    let other = kinora(folder.path(), &words("two/a.ron", "0-1"));
    assert_eq!(other.status.code(), Some(0), "{}", stderr(&other));
    assert_eq!(recorded(&film), [0, 1]);
    let hidden: Vec<_> = names_in(&film).into_iter().filter(|n| n.starts_with('.')).collect();
    assert_eq!(hidden, [".kinora-living.tmp"], "what the living hold is left to them");
}

fn wait_for(file: &Path) {
    for _ in 0..2000 {
        if file.exists() {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    panic!("{} does not come", file.display());
}

/// The manifest is the first file of a run: when it is there, the render is under way.
#[cfg(unix)]
#[test]
fn a_termination_signal_ends_with_code_75_and_nothing_torn() {
    let folder = folder();
    fs::write(folder.path().join("a.ron"), SCENE).expect("writable");
    let mut child = Command::new(env!("CARGO_BIN_EXE_kinora"))
        .current_dir(folder.path())
        .args(["render", "a.ron", "--frames", "0-99", "--size", "256x256", "--samples", "1000"])
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    wait_for(&folder.path().join("out/a/manifest.json"));
    let killed = Command::new("kill").arg(child.id().to_string()).status().expect("kill exists");
    assert!(killed.success());
    let status = child.wait().expect("was started");
    assert_eq!(status.code(), Some(75));
    let names = names_in(&folder.path().join("out/a"));
    assert!(names.iter().all(|name| !name.contains("tmp")), "{names:?}");
}
