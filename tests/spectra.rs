//! Spectral scenes: colours that come back, and spectra against quadrature in f64.

mod common;

use common::{Estimate, Picture, render, render_description, scene};
use glam::Vec3;
use kinora::color::Blackbody;
use kinora::color::spectrum::color_of;
use kinora::description::SpectrumData;

/// The mean of a channel with its standard error as the variance between the samples of green tells it: an upper bound
/// for stratified wavelengths.
fn assert_color(picture: &Picture, what: &str, expected: Vec3, precision: f64) {
    let found = picture.mean_of_channels();
    let scale = f64::from(expected.abs().max_element());
    for (channel, (found, expected)) in found.into_iter().zip(expected.to_array()).enumerate() {
        let off = (found - f64::from(expected)).abs();
        assert!(off < precision * scale, "{what}, channel {channel}: {found}, not {expected}");
    }
}

/// A wall seen square on in light from the front.
fn wall(settings: &str, textures: &str, wall: &str, light: &str) -> String {
    format!(
        r#"(render: (filter: Box(), integrator: Path, max_depth: 2, {settings}),
        textures: {{ {textures} }},
        materials: {{ "wall": {wall} }},
        entities: {{
            "camera": (transform: (translation: (0, 0, 2), look_at: (0, 0, 0)), camera: (orthographic: Some(0.1))),
            "wall": (shape: Rectangle(size: (4, 4)), material: "wall"),
            {light} }})"#
    )
}

const SUN: &str = r#""sun": (light: Directional(irradiance: (3.1415927, 3.1415927, 3.1415927)))"#;

/// What colours say is what is seen, in red, green and blue and by wavelengths: walls, a metal, lamps, textures.
#[test]
fn colours_are_the_same_by_wavelengths() {
    for (material, light) in [
        ("Diffuse(albedo: (0.8, 0.3, 0.05))", SUN),
        ("Diffuse(albedo: (0.02, 0.6, 0.9))", SUN),
        ("Diffuse(albedo: \"checks\")", SUN),
        ("Mirror()", r#""sky": (light: Sky(radiance: (2, 0.5, 4)))"#),
        (
            "Diffuse(albedo: 0.5)",
            r#""lamp": (transform: (translation: (0, 0, 3), rotation: (0, 180, 0)), shape: Disk(radius: 1), emission: Radiance((9, 4, 2)))"#,
        ),
        (
            "Diffuse(albedo: 0.5)",
            r#""lamp": (transform: (translation: (1, 0, 3)), light: Point(intensity: (9, 4, 2)))"#,
        ),
    ] {
        let checks = r#""checks": Checker(size: 0.01, a: (0.9, 0.1, 0.1), b: (0.1, 0.2, 0.7))"#;
        let text = |spectral: bool| wall(&format!("spectral: {spectral}"), checks, material, light);
        let rgb = render(&text(false), (16, 16), 256).mean_of_channels();
        let expected = Vec3::from_array(rgb.map(|channel| channel as f32));
        let seen = render(&text(true), (16, 16), 256);
        // 256 samples take each set four times: what is left is what a bin of the spectrum is coarse.
        assert_color(&seen, material, expected, 2e-3);
    }
}

/// Copper and gold keep their hue: their indices are known at three wavelengths.
#[test]
fn metals_keep_their_colour() {
    for metal in ["Copper", "Gold", "Silver"] {
        let text = |spectral: bool| {
            let sky = r#""sky": (light: Sky(radiance: 1))"#;
            let metal = format!("Conductor(metal: {metal})");
            wall(&format!("spectral: {spectral}"), "", &metal, sky)
        };
        let rgb = render(&text(false), (8, 8), 64).mean_of_channels();
        let expected = Vec3::from_array(rgb.map(|channel| channel as f32));
        // Straight lines between three wavelengths are not the curve of the metal: a tenth.
        assert_color(&render(&text(true), (8, 8), 256), metal, expected, 0.1);
    }
}

/// Closed form in f64: the product of two spectra has another colour than the product of their colours.
#[test]
fn lamps_and_paints_are_multiplied_by_wavelength() {
    let (lamp, paint) = (
        vec![(580.0, 0.0), (589.0, 40.0), (598.0, 0.0)],
        vec![(400.0, 0.1), (560.0, 0.1), (600.0, 0.9), (700.0, 0.9)],
    );
    let points = |points: &[(f32, f32)]| format!("{points:?}");
    let textures = format!(
        r#""lamp": Spectrum(values: {}), "paint": Spectrum(values: {})"#,
        points(&lamp),
        points(&paint)
    );
    let text = wall(
        "",
        &textures,
        r#"Diffuse(albedo: "paint")"#,
        r#""sky": (light: Sky(radiance: "lamp"))"#,
    );
    let (lamp, paint) = (SpectrumData::new(lamp), SpectrumData::new(paint));
    let product = (0..3500)
        .map(|k| 380.0 + 0.1 * (k as f32 + 0.5))
        .map(|nm| (nm, lamp.at(nm) * paint.at(nm)));
    let expected = color_of(&SpectrumData::new(product.collect()));
    let apart = color_of(&lamp) * color_of(&paint);
    assert!((apart - expected).abs().max_element() > 0.1 * expected.max_element());
    // The line of the lamp is 9 nm wide at half its height, bins are up to 2 nm there.
    assert_color(&render(&text, (16, 16), 1024), "sodium", expected, 0.01);
}

/// A blackbody's spectrum is that of its temperature: seen in a mirror it has the colour of that, within what a bin is coarse.
#[test]
fn blackbodies_shine_by_wavelength() {
    let text = wall(
        "spectral: true",
        "",
        "Mirror()",
        r#""lamp": (transform: (translation: (0, 0, 3), rotation: (0, 180, 0)), shape: Rectangle(size: (9, 9)), emission: Temperature(kelvin: 3000, radiance: 5))"#,
    )
    .replace("translation: (0, 0, 2)", "translation: (0, 0, 2.5)");
    let expected = 5.0 * color_of(&Blackbody::new(3000.0).spectrum);
    assert_color(&render(&text, (4, 4), 64), "3000 K", expected, 2e-3);
}

/// Beer and Lambert by wavelength, closed form in f64: light that is absorbed twice is absorbed by the sum, which its colours
/// would get wrong; towards the light as well.
#[test]
fn absorption_goes_by_wavelength() {
    let points = vec![(400.0, 0.2), (500.0, 0.05), (560.0, 3.0), (600.0, 0.1), (700.0, 2.0)];
    let sea = format!(r#""sea": Spectrum(values: {points:?})"#);
    let spectrum = SpectrumData::new(points);
    let text = wall(
        "",
        &sea,
        "Diffuse(albedo: 1)",
        &format!(
            r#"{SUN},
            "near": (transform: (translation: (0, 0, 0.9)), shape: Box(size: (4, 4, 0.4)), material: "sea"),
            "far": (transform: (translation: (0, 0, 0.4)), shape: Box(size: (4, 4, 0.4)), material: "sea")"#
        ),
    )
    .replace(r#""wall": D"#, r#""sea": Dielectric(ior: 1, absorption: "sea"), "wall": D"#);
    // 0.8 m both ways.
    let left = (0..3500)
        .map(|k| 380.0 + 0.1 * (k as f32 + 0.5))
        .map(|nm| (nm, (-1.6 * f64::from(spectrum.at(nm))).exp() as f32));
    let expected = color_of(&SpectrumData::new(left.collect()));
    assert_color(&render(&text, (16, 16), 256), "sea", expected, 3e-3);
}

/// White through glass without dispersion stays white where it is split by wavelength all the same, and as much of it arrives
/// as in red, green and blue.
#[test]
fn white_stays_white_through_glass() {
    let text = |spectral: bool, dispersion: &str, integrator: &str| {
        format!(
            r#"(render: (filter: Box(), integrator: {integrator}, spectral: {spectral}),
            materials: {{ "glass": Dielectric(ior: 1.5, {dispersion}), "white": Diffuse(albedo: 0.7) }},
            entities: {{
                "camera": (transform: (translation: (0, 2.5, 0.01), look_at: (0, 0, 0)), camera: (fov: 40)),
                "ball": (transform: (translation: (0, 1, 0)), shape: Sphere(radius: 0.5), material: "glass"),
                "floor": (transform: (rotation: (-90, 0, 0)), shape: Rectangle(size: (6, 6)), material: "white"),
                "lamp": (transform: (translation: (0.3, 4, 0)), shape: Sphere(radius: 0.6), emission: Radiance((8, 8, 8))) }})"#
        )
    };
    let mean = |text: &str, samples: u32| -> ([f64; 3], Estimate) {
        let mut described = scene(text);
        (described.render.size, described.render.samples) = ((16, 16), samples);
        let mut pictures = Vec::new();
        for seed in 0..4 {
            described.render.seed = seed;
            pictures.push(render_description(&described, 0).mean_of_channels());
        }
        let n = pictures.len() as f64;
        let channel = |c: usize| pictures.iter().map(|p| p[c]).sum::<f64>() / n;
        let green = channel(1);
        let variance = pictures.iter().map(|p| (p[1] - green).powi(2)).sum::<f64>() / (n - 1.0);
        let error = (variance / n).sqrt();
        ([channel(0), green, channel(2)], Estimate { mean: green, error })
    };
    // Photons blur alike in both.
    for (dispersion, integrator, samples, precision) in [
        ("dispersion: Abbe(1000000)", "Path", 1024, 0.01),
        ("dispersion: Abbe(1000000)", "Path, caustics: Photons", 256, 0.01),
        ("", "Sppm, photons: (per_pass: Some(16384))", 128, 0.01),
        ("dispersion: Abbe(1000000)", "PhotonMap, photons: (per_pass: Some(131072))", 16, 0.02),
    ] {
        let (_, plain) = mean(&text(false, "", integrator), samples);
        let (channels, split) = mean(&text(true, dispersion, integrator), samples);
        println!("{integrator} {channels:?} {split:?} {plain:?}");
        let error = split.error.hypot(plain.error);
        assert!(error < precision * plain.mean, "{integrator}: {error}");
        assert!((split.mean - plain.mean).abs() < 4.0 * error + 0.005 * plain.mean);
        // All channels have the same noise but for that of their wavelengths.
        for channel in channels {
            assert!((channel / channels[1] - 1.0).abs() < 0.02, "{integrator}: {channels:?}");
        }
    }
}
