//! Textures: their numbers, and the names they use.

use super::Names;
use super::decode::{Report, decode};
use super::limits;
use super::source::Cursor;
use super::surface::Parameters;
use crate::description::Texture;
use glam::Vec3;

/// Reads a texture and checks its numbers and names; its file is only named.
pub(super) fn read_texture(
    cursor: &Cursor,
    names: &Names,
    report: &mut Report,
) -> Option<Texture<String, String, String>> {
    let texture: Texture<String, String, String> = decode(cursor, report)?;
    let mut check = Parameters { cursor, names, report };
    match &texture {
        Texture::Image { repeat, offset, .. } => {
            check.uv("repeat", *repeat);
            check.uv("offset", *offset);
        }
        Texture::Checker { size, a, b } => {
            check.number("size", *size, &limits::UV_LENGTH);
            check.colors([("a", a), ("b", b)]);
        }
        Texture::Stripes { size, share, a, b } => {
            check.number("size", *size, &limits::UV_LENGTH);
            check.number("share", *share, &limits::SHARE);
            check.colors([("a", a), ("b", b)]);
        }
        Texture::Gradient { a, b } | Texture::Multiply { a, b } => {
            check.colors([("a", a), ("b", b)]);
        }
        Texture::Bricks { size, mortar, bevel, shift, period: _, seed: _, a, b, between } => {
            for (axis, length) in size.to_array().into_iter().enumerate() {
                let place = cursor.at("size").nth(axis);
                limits::number(check.report, &place, length, &limits::UV_LENGTH);
            }
            check.number("mortar", *mortar, &limits::UV_LENGTH_OR_ZERO);
            check.number("bevel", *bevel, &limits::UV_LENGTH_OR_ZERO);
            check.number("shift", *shift, &limits::SHARE);
            check.colors([("a", a), ("b", b), ("between", between)]);
        }
        Texture::Mix { a, b, amount } => {
            check.colors([("a", a), ("b", b)]);
            check.scalar("amount", amount);
        }
        Texture::Remap { of, from, to, smooth: _ } => {
            check.texture(&cursor.at("of"), of);
            for (field, (low, high)) in [("from", from), ("to", to)] {
                let ends = [*low, *high].map(f64::from);
                limits::vector(check.report, &cursor.at(field), &ends, &limits::UV);
            }
            if from.0 == from.1 {
                let message =
                    format!("`from` must be two different numbers, but both are {}", from.0);
                check.report.at("scene::empty-range", &cursor.at("from"), message);
            }
        }
        Texture::Placed { of, repeat, rotation, offset } => {
            check.texture(&cursor.at("of"), of);
            check.uv("repeat", *repeat);
            check.number("rotation", *rotation, &limits::ANGLE);
            check.uv("offset", *offset);
        }
        Texture::Triplanar { of, size, sharpness } => {
            check.texture(&cursor.at("of"), of);
            check.number("size", *size, &limits::LENGTH);
            check.number("sharpness", *sharpness, &limits::POWER);
        }
        Texture::Spectrum { values, scale } => {
            for (k, (_, value)) in values.points().iter().enumerate() {
                let place = cursor.at("values").nth(k);
                limits::number(check.report, &place, *value, &limits::STRENGTH);
            }
            check.number("scale", *scale, &limits::STRENGTH);
        }
        Texture::VertexColor {} => {}
        _ => check_in_space(&mut check, &texture),
    }
    Some(texture)
}

/// Checks what is a function of the place.
fn check_in_space(check: &mut Parameters, texture: &Texture<String, String, String>) {
    let cursor = check.cursor;
    match texture {
        Texture::Noise { size, octaves, gain, turbulence: _, seed: _, a, b } => {
            check.number("size", *size, &limits::LENGTH);
            check.number("octaves", *octaves, &limits::OCTAVES);
            check.number("gain", *gain, &limits::SHARE);
            check.colors([("a", a), ("b", b)]);
        }
        Texture::Cells { size, shows: _, jitter, seed: _, a, b } => {
            check.number("size", *size, &limits::LENGTH);
            check.number("jitter", *jitter, &limits::SHARE);
            check.colors([("a", a), ("b", b)]);
        }
        Texture::Marble { size, distortion, sharpness, seed: _, a, b } => {
            check.number("size", *size, &limits::LENGTH);
            check.number("distortion", *distortion, &limits::DISTORTION);
            check.number("sharpness", *sharpness, &limits::POWER);
            check.colors([("a", a), ("b", b)]);
        }
        Texture::Wood { size, distortion, grain, seed: _, a, b } => {
            check.number("size", *size, &limits::LENGTH);
            check.number("distortion", *distortion, &limits::DISTORTION);
            check.number("grain", *grain, &limits::SHARE);
            check.colors([("a", a), ("b", b)]);
        }
        Texture::Ramp { from, to, falloff: _, a, b } => {
            for (field, place) in [("from", from), ("to", to)] {
                check.place(field, *place);
            }
            if from == to {
                let message = "a ramp needs two different ends, but `from` and `to` are the same";
                check.report.at("scene::empty-range", cursor, message);
            }
            check.colors([("a", a), ("b", b)]);
        }
        Texture::Radial { centre, radius, falloff: _, a, b } => {
            check.place("centre", *centre);
            check.number("radius", *radius, &limits::LENGTH);
            check.colors([("a", a), ("b", b)]);
        }
        Texture::Grid { file: _, size, centre } => {
            for (axis, length) in size.iter().flat_map(Vec3::to_array).enumerate() {
                let place = cursor.at("size").nth(axis);
                limits::number(check.report, &place, length, &limits::LENGTH);
            }
            check.place("centre", *centre);
            if let Some(centre) = cursor.field("centre").filter(|_| size.is_none()) {
                let message = "the file says where its box is, unless `size` is given";
                check.report.at("scene::conflict", &centre, message);
            }
        }
        Texture::Drift { of, velocity } => {
            check.texture(&cursor.at("of"), of);
            check.place("velocity", *velocity);
        }
        _ => unreachable!("patterns are checked by themselves"),
    }
}
