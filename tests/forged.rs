//! Small files which say that they are huge: the program tells of them without taking memory for what they say.
#![cfg(target_os = "linux")]

use exr::prelude::{Image, SpecificChannels, WritableImage};
use std::fs;
use std::io::Cursor;
use std::process::Command;

/// Address space that the program may have, kilobytes: far more than it takes to read a scene, and a sixteenth of a byte for
/// each pixel that the files speak of.
const LIMIT_KB: u64 = 262_144;

/// Width and height that the files speak of. At 4 bytes a pixel this is 17 GB.
const SIDE: u32 = 65_535;

/// The head of a PNG of 8 bits and four channels. Its CRC is that of PNG, annex D, bit by bit.
fn png() -> Vec<u8> {
    let side = SIDE.to_be_bytes();
    let header = [b"IHDR", &side[..], &side, &[8, 6, 0, 0, 0]].concat();
    let crc = !header.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| (c >> 1) ^ (0xedb8_8320 * (c & 1)))
    });
    [
        b"\x89PNG\r\n\x1a\n\0\0\0\x0d",
        &header[..],
        &crc.to_be_bytes(),
        b"\0\0\0\0IDAT\x35\xaf\x06\x1e",
    ]
    .concat()
}

/// The head of a JPEG with three components.
fn jpeg() -> Vec<u8> {
    let mut bytes = Vec::new();
    let white = image::ImageBuffer::from_pixel(8, 8, image::Rgb([255_u8; 3]));
    let format = image::ImageFormat::Jpeg;
    white.write_to(&mut Cursor::new(&mut bytes), format).expect("memory takes everything");
    let frame = bytes.windows(2).position(|marker| marker == [0xff, 0xc0]).expect("a frame");
    bytes[frame + 5..frame + 9].fill(0xff);
    bytes
}

fn hdr() -> Vec<u8> {
    format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {SIDE} +X {SIDE}\n\x02\x02").into_bytes()
}

fn exr() -> Vec<u8> {
    let mut bytes = Vec::new();
    let white = |_: exr::math::Vec2<usize>| (1.0_f32, 1.0_f32, 1.0_f32);
    let image = Image::from_channels((2, 2), SpecificChannels::rgb(white));
    image.write().to_buffered(Cursor::new(&mut bytes)).expect("memory takes everything");
    let name = b"dataWindow\0box2i\0";
    let window = bytes.windows(name.len()).position(|w| w == name).expect("every EXR has one");
    let last = window + name.len() + 4 + 8;
    let corner = (SIDE - 1).to_le_bytes();
    bytes[last..last + 8].copy_from_slice(&[corner, corner].concat());
    bytes
}

/// Oracle: the system, which refuses more address space than a fraction of what the files speak of.
#[test]
fn no_memory_is_taken_for_a_size_that_a_header_claims() {
    for (name, bytes) in [("a.png", png()), ("a.jpg", jpeg()), ("a.hdr", hdr()), ("a.exr", exr())] {
        assert!(bytes.len() < 4096, "{name}");
        let folder = tempfile::tempdir().expect("temporary folder");
        let scene = format!(
            r#"(textures: {{"t": Image(file: "{name}")}}, entities: {{"eye": (camera: ())}})"#
        );
        fs::write(folder.path().join(name), bytes).expect("writable");
        fs::write(folder.path().join("a.ron"), scene).expect("writable");
        let limited = format!("ulimit -v {LIMIT_KB} && exec \"$0\" check a.ron");
        let output = Command::new("sh")
            .args(["-c", &limited, env!("CARGO_BIN_EXE_kinora")])
            .env("RAYON_NUM_THREADS", "2")
            .current_dir(folder.path())
            .output()
            .expect("the program starts");
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{name}: {told}");
        let size = format!("{SIDE} × {SIDE} pixels, where at most");
        assert!(told.contains(&size), "{name}: {told}");
    }
}
