//! Unit tests of the materials.

use super::*;
use crate::description::{
    Attenuation, Channel, Dispersion, Encoding, ImageData, ImagePixels, Metal, Texture,
    TextureFilter, TextureFiltering, Wrap,
};
use crate::shade::bsdf::TransportMode;
use crate::shade::metals;
use crate::shade::texture::Pyramids;
use glam::{Vec2, Vec3};
use std::sync::Arc;

fn diffuse(albedo: f32) -> Material<u32> {
    Material::Diffuse { albedo: Rgb::splat(albedo).into() }
}

fn glass(roughness: Value<f32, u32>, attenuation: Option<Attenuation>) -> Material<u32> {
    Material::Dielectric {
        ior: 1.5,
        dispersion: None,
        roughness,
        tint: Rgb::ONE.into(),
        attenuation,
        absorption: None,
        scattering: None,
        emission: Rgb::ZERO,
        density: Value::Constant(1.0),
        priority: 0,
    }
}

fn red(bsdf: &Bsdf) -> f32 {
    bsdf.albedo(Vec3::Z).x
}

/// An image of 2 × 1 texels with these values, looked up without filtering.
fn two_texels(left: f32, right: f32) -> Textures {
    let pixels = [left, right].map(|v| [v, v, v, 1.0]).to_vec();
    let texture = Texture::Image {
        file: Arc::new(ImageData { width: 2, height: 1, pixels: ImagePixels::Rgba32F(pixels) }),
        encoding: Encoding::Linear,
        wrap: Wrap::Repeat,
        filter: TextureFilter::Nearest,
        channel: Channel::Luminance,
        repeat: Vec2::ONE,
        offset: Vec2::ZERO,
    };
    Textures::new(vec![texture], TextureFiltering::Point, &Pyramids::default())
}

const HERE: TexturePoint = TexturePoint::at(Vec2::ZERO);
const LEFT: TexturePoint = TexturePoint::at(Vec2::new(0.25, 0.5));
const RIGHT: TexturePoint = TexturePoint::at(Vec2::new(0.75, 0.5));

/// Oracle: counting over evenly spaced lobe numbers; what is left of them is even again.
#[test]
fn a_mix_chooses_its_sides_by_their_amount() {
    let mix = Material::Mix { a: 0, b: 1, amount: 0.3.into() };
    let table = MaterialTable::new(&[diffuse(0.2), diffuse(0.9), mix], Textures::default());
    let n = 10_000;
    let (mut count, mut left) = (0, 0.0);
    for i in 0..n {
        let mut u = (i as f32 + 0.5) / n as f32;
        count += u32::from(red(&table.bsdf(2, &HERE, &mut u)) > 0.5);
        assert!((0.0..1.0).contains(&u));
        left += f64::from(u);
    }
    assert_eq!(count, 3000);
    assert!((left / f64::from(n) - 0.5).abs() < 1e-4, "mean {}", left / f64::from(n));
}

#[test]
fn a_side_of_amount_zero_is_never_chosen() {
    let mix = |amount: f32| Material::Mix { a: 0, b: 1, amount: amount.into() };
    let table =
        MaterialTable::new(&[diffuse(0.2), diffuse(0.9), mix(0.0), mix(1.0)], Textures::default());
    for u in [0.0, 0.5, 1.0_f32.next_down()] {
        assert_eq!(red(&table.bsdf(2, &HERE, &mut u.clone())), 0.2);
        assert_eq!(red(&table.bsdf(3, &HERE, &mut u.clone())), 0.9);
    }
}

/// Oracle: a leaf of coverage 0.5 mixed half and half with a solid stops ¾ of the rays, a third of them
/// on the leaf.
#[test]
fn opacity_goes_through_mixes_and_masks() {
    let leaf = Material::Masked { material: 0, opacity: 0.5.into() };
    let mix = Material::Mix { a: 1, b: 2, amount: 0.5.into() };
    let nested = Material::Masked { material: 3, opacity: 0.5.into() };
    let table =
        MaterialTable::new(&[diffuse(0.9), diffuse(0.2), leaf, mix, nested], Textures::default());
    let opacity = [0, 1, 2, 3, 4].map(|material| table.opacity(material, &HERE));
    assert_eq!(opacity, [1.0, 1.0, 0.5, 0.75, 0.375]);
    assert_eq!([0, 2, 3, 4].map(|material| table.has_opacity(material)), [false, true, true, true]);
    let n = 3000;
    let on_leaf = (0..n)
        .filter(|&i| {
            let mut u = (i as f32 + 0.5) / n as f32;
            red(&table.bsdf(3, &HERE, &mut u)) > 0.5
        })
        .count();
    assert!((on_leaf as f32 / n as f32 - 1.0 / 3.0).abs() < 1e-3, "{on_leaf} of {n}");
}

/// Beer–Lambert: the colour is what is left after the distance.
#[test]
fn solids_know_their_interior() {
    let color = Rgb::new(0.9, 0.5, 0.1);
    let amber = glass(0.0.into(), Some(Attenuation { color, distance: 0.02 }));
    let mask = Material::Masked { material: 0, opacity: 0.5.into() };
    let table = MaterialTable::new(
        &[amber, mask, glass(0.0.into(), None), diffuse(0.5)],
        Textures::default(),
    );
    for material in [0, 1] {
        let sigma_a = table.attenuation(material).expect("amber absorbs");
        let left = (-sigma_a * 0.02).exp();
        assert!((left - color).abs().max_element() < 1e-6, "{left}");
    }
    assert_eq!(
        table.interior(2),
        Some(Interior {
            ior: 1.5,
            sigma_a: None,
            absorption: None,
            scattering: None,
            emission: Rgb::ZERO,
            density: None,
            priority: 0
        })
    );
    assert_eq!(table.attenuation(2), None);
    assert!(table.is_dielectric(2) && !table.is_dielectric(3));
}

/// Roughness from a texture: smooth on one side, rough on the other, of every model which has it.
#[test]
fn textured_roughness_switches_between_smooth_and_rough() {
    let roughness: Value<f32, u32> = Value::Texture(0);
    let materials = [
        glass(roughness, None),
        Material::Conductor { metal: Some(Metal::Gold), f0: None, eta: None, k: None, roughness },
        Material::Plastic { albedo: Rgb::ONE.into(), ior: 1.5, roughness },
        Material::Principled {
            base_color: Rgb::ONE.into(),
            metallic: 1.0.into(),
            roughness,
            ior: 1.5,
            transmission: 0.0.into(),
        },
    ];
    let table = MaterialTable::new(&materials, two_texels(0.0, 0.6));
    let wo = Vec3::new(0.6, 0.0, 0.8);
    for material in 0..4 {
        for (at, rough) in [(LEFT, false), (RIGHT, true)] {
            let bsdf = table.bsdf(material, &at, &mut 0.5);
            let sample = bsdf
                .sample(wo, 0.01, Vec2::new(0.3, 0.2), TransportMode::Radiance)
                .expect("the number 0.01 chooses the mirror lobe");
            assert_eq!(sample.delta, !rough, "material {material} at {:?}", at.uv);
        }
    }
}

/// A conductor is what its metal, its index or its reflectance says, in this order of the scene file.
#[test]
fn conductors_take_any_of_their_three_forms() {
    let conductor = |metal, f0: Option<Rgb>, eta, k| Material::Conductor {
        metal,
        f0: f0.map(Value::Constant),
        eta,
        k,
        roughness: 0.0.into(),
    };
    let gold = Rgb::new(0.924, 0.788, 0.404);
    let (eta, k) = metals::index_of_refraction(Metal::Gold);
    let materials = [
        conductor(Some(Metal::Gold), None, None, None),
        conductor(None, Some(gold), None, None),
        conductor(None, None, Some(eta), Some(k)),
    ];
    let table = MaterialTable::new(&materials, Textures::default());
    for material in 0..3 {
        let albedo = table.bsdf(material, &HERE, &mut 0.5).albedo(Vec3::Z);
        assert!((albedo - gold).abs().max_element() < 1e-3, "{material}: {albedo}");
    }
}

#[test]
fn cycles_of_materials_are_found() {
    let mask = |material| Material::Masked { material, opacity: 0.5.into() };
    let mix = |a, b| Material::Mix { a, b, amount: 0.5.into() };
    assert_eq!(
        material_order(&[diffuse(0.5), mix(0, 0), mask(1), mix(1, 2)]),
        Ok(vec![0, 1, 2, 3])
    );
    assert_eq!(material_order(&[mask(0)]), Err(GraphFault::Cycle(0)));
    assert_eq!(material_order(&[diffuse(0.5), mix(0, 2), mask(1)]), Err(GraphFault::Cycle(1)));
}

/// Closed form: 60 mixes, both sides of each the next one, are as opaque as the last; asking all ways would take 2^60.
#[test]
fn a_material_that_many_ways_lead_to_is_asked_once() {
    let last = 60;
    let mut materials: Vec<_> = (0..last)
        .map(|k| Material::Mix { a: k + 1, b: k + 1, amount: Value::Constant(0.5) })
        .collect();
    materials.push(Material::Masked { material: last + 1, opacity: 0.25.into() });
    materials.push(diffuse(0.5));
    let table = MaterialTable::new(&materials, Textures::default());
    assert_eq!(table.opacity(0, &HERE), 0.25);
    assert!(table.may_be_storable(0, 0.1) && !table.may_cast_caustics(0, 0.1));
    assert!(table.caustic_lobes(0, 0.1).is_empty());
    assert!(!table.disperses(0) && !table.has_spectrum(0) && table.interior(0).is_none());
    assert_eq!(table.choose(0, &HERE, &mut 0.3).material, last + 1);
}

#[test]
fn equal_materials_share_their_tables() {
    let rough = glass(0.5.into(), None);
    let table =
        MaterialTable::new(&[rough.clone(), rough, glass(0.6.into(), None)], Textures::default());
    assert_eq!(table.glasses.len(), 2);
}

/// A picture brighter than white is not a reflectance: the furnace would gain energy.
#[test]
fn shares_of_light_are_limited_to_one() {
    let bright = Material::Diffuse { albedo: Value::Texture(0) };
    let table = MaterialTable::new(&[bright], two_texels(7.0, -1.0));
    assert_eq!(red(&table.bsdf(0, &LEFT, &mut 0.5)), 1.0);
    assert_eq!(red(&table.bsdf(0, &RIGHT, &mut 0.5)), 0.0);
    assert_eq!(table.color(&Value::Texture(0), &LEFT), Rgb::splat(7.0));
}

/// Oracle: Snell's law in f64 with published indices: how much prisms of 60° turn light of the lines F, d and C, at least
/// deviation and at 50° (BK7).
#[test]
fn a_prism_turns_each_line_by_its_angle() {
    let (glass, air) = (Some(Dispersion::Bk7), None);
    let material = |dispersion| Material::Dielectric {
        ior: 1.5,
        dispersion,
        roughness: 0.0.into(),
        tint: Rgb::ONE.into(),
        attenuation: None,
        absorption: None,
        scattering: None,
        emission: Rgb::ZERO,
        density: Value::Constant(1.0),
        priority: 0,
    };
    let table = MaterialTable::new(&[material(glass), material(air)], Textures::default());
    assert!(table.disperses(0) && !table.disperses(1));
    let lines = [486.1327, 587.5618, 656.2725];
    let least = [39.138_108_7_f64, 38.646_698_5, 38.429_136_7];
    let at_50 = [39.140_973_6_f64, 38.653_636_8, 38.438_411_8];
    for (line, (least, at_50)) in lines.into_iter().zip(least.into_iter().zip(at_50)) {
        let index = f64::from(table.index(0, line));
        let symmetric = (index * 0.5).asin().to_degrees();
        for (incidence, expected) in [(symmetric, least), (50.0, at_50)] {
            // The angle to the normal after a face, of light which arrives at an angle on its outside or inside.
            let refracted = |angle: f64, enters: bool| {
                let (sin, cos) = angle.to_radians().sin_cos();
                let wo = Vec3::new(sin as f32, 0.0, if enters { cos } else { -cos } as f32);
                let bsdf = table.chosen_bsdf_tuned(0, &HERE, None, Some(line));
                let drawn = bsdf.sample(wo, 0.999, Vec2::splat(0.5), TransportMode::Radiance);
                let drawn = drawn.expect("it passes");
                assert!(drawn.transmitted);
                f64::from(-drawn.wi.x).atan2(f64::from(drawn.wi.z.abs())).to_degrees()
            };
            let inside = refracted(incidence, true);
            let leaves = refracted(60.0 - inside, false);
            let deviation = (incidence + leaves - 60.0).to_radians();
            let error = deviation - expected.to_radians();
            assert!(error.abs() < 3e-6, "{line} nm at {incidence}°: off by {error} rad");
        }
    }
}

/// The lobe is there down to where f32 ends, for constants and textures; of glass while the transmitted one can be resolved.
#[test]
fn only_what_f32_cannot_tell_is_smooth() {
    let metal = |roughness: Value<f32, u32>| Material::Conductor {
        metal: Some(Metal::Gold),
        f0: None,
        eta: None,
        k: None,
        roughness,
    };
    let textured = Value::Texture(0);
    let materials = [
        metal(0.031.into()),
        metal(9.7e-4.into()),
        glass(0.031.into(), None),
        glass(1e-3.into(), None),
        metal(textured),
        glass(textured, None),
    ];
    let table = MaterialTable::new(&materials, two_texels(0.031, 9e-4));
    let is_rough = |material, at: &TexturePoint| {
        matches!(
            table.chosen_bsdf(material, at),
            Bsdf::RoughConductor(_) | Bsdf::RoughDielectric(_)
        )
    };
    assert_eq!([0, 1, 2, 3].map(|material| is_rough(material, &HERE)), [true, false, true, false]);
    for material in [4, 5] {
        assert!(is_rough(material, &LEFT) && !is_rough(material, &RIGHT), "{material}");
    }
}
