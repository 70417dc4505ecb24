//! What holds for every model: densities, reciprocity, energy, and no wild numbers.

#![expect(
    clippy::float_cmp,
    reason = "deltas have exactly 0, parameters are compared with themselves"
)]

use super::statistics::{Random, direction, even_points, integrate_cells, p_value, sidak_level};
use super::*;
use std::f32::consts::FRAC_1_PI;
use std::sync::Mutex;

const MODES: [TransportMode; 2] = [TransportMode::Radiance, TransportMode::Importance];
const COSINES: [f32; 4] = [1.0, 0.7, 0.1, 0.01];
const GOLD: ConductorFresnel = ConductorFresnel::Complex {
    eta: Rgb::new(0.223, 0.428, 1.335),
    k: Rgb::new(3.204, 2.460, 1.872),
};
const WHITE_METAL: ConductorFresnel = ConductorFresnel::Schlick { f0: Rgb::ONE };

/// The lobe of one width, its table made for it and kept for the run of the tests.
fn lobe(alpha: f32) -> ReflectorLobe<'static> {
    static TABLES: Mutex<Vec<(f32, &ReflectorTable)>> = Mutex::new(Vec::new());
    let mut tables = TABLES.lock().unwrap();
    let known = tables.iter().find(|(known, _)| *known == alpha).map(|&(_, table)| table);
    let table = known.unwrap_or_else(|| {
        let table: &'static _ = Box::leak(Box::new(reflector_table_at(alpha)));
        tables.push((alpha, table));
        table
    });
    ReflectorLobe::new(table.at(alpha))
}

fn metal(fresnel: ConductorFresnel, alpha: f32) -> Bsdf<'static> {
    Bsdf::RoughConductor(RoughConductor::new(fresnel, fresnel.average(), lobe(alpha)))
}

fn smooth_plastic(rho: Rgb, eta: f32) -> Bsdf<'static> {
    Bsdf::SmoothPlastic(SmoothPlastic::new(rho, eta, dielectric_average(eta)))
}

fn principled(
    base_color: Rgb,
    metallic: f32,
    alpha: Option<f32>,
    transmission: f32,
) -> Bsdf<'static> {
    let parameters = PrincipledParameters { base_color, metallic, ior: 1.5, transmission };
    Bsdf::Principled(Principled::new(&parameters, alpha.map(lobe)))
}

/// Tables which a test keeps for its BSDFs.
struct Tables {
    coats: Vec<(f32, f32, AlbedoTable<1>)>,
    glasses: Vec<(f32, f32, AlbedoTable<2>)>,
}

impl Tables {
    fn new(eta: f32, alphas: &[f32]) -> Self {
        let one = |&alpha: &f32| (eta, alpha, Widths::One(alpha));
        Self {
            coats: alphas.iter().map(one).map(|(e, a, w)| (e, a, coat_table(e, w))).collect(),
            glasses: alphas.iter().map(one).map(|(e, a, w)| (e, a, glass_table(e, w))).collect(),
        }
    }

    fn plastics(&self, rho: Rgb) -> impl Iterator<Item = Bsdf<'_>> {
        self.coats.iter().map(move |(eta, alpha, table)| {
            Bsdf::RoughPlastic(RoughPlastic::new(rho, *eta, table.at(*alpha)))
        })
    }

    fn glasses(&self) -> impl Iterator<Item = Bsdf<'_>> {
        self.glasses.iter().map(|(eta, alpha, table)| {
            let average = dielectric_average(*eta);
            Bsdf::RoughDielectric(RoughDielectric::new(*eta, table.at(*alpha), average))
        })
    }
}

/// One of each model, and more where a parameter changes the lobes.
fn zoo(tables: &Tables) -> Vec<Bsdf<'_>> {
    let color = Rgb::new(0.9, 0.5, 0.1);
    let mut all = vec![
        Bsdf::Diffuse(Diffuse { albedo: color }),
        Bsdf::Mirror(Mirror { reflectance: color }),
        Bsdf::SmoothDielectric(SmoothDielectric::new(1.5)),
        Bsdf::ThinGlass(ThinGlass { eta: 1.5, tint: color }),
        Bsdf::SmoothConductor(SmoothConductor { fresnel: GOLD }),
        Bsdf::SmoothDielectric(SmoothDielectric { eta: 1.5, tint: color }),
        metal(GOLD, 0.1),
        metal(GOLD, 0.6),
        metal(ConductorFresnel::Schlick { f0: color }, 1.0),
        smooth_plastic(color, 1.5),
        principled(color, 0.0, None, 0.0),
        principled(color, 0.3, None, 0.6),
        principled(color, 0.0, Some(0.25), 0.0),
        principled(color, 0.4, Some(0.5), 0.0),
        principled(color, 0.2, Some(0.3), 0.7),
        principled(color, 1.0, Some(0.15), 0.0),
    ];
    all.extend(tables.plastics(color));
    all.extend(tables.glasses());
    all
}

/// Directions of the viewer at the cosines of [`COSINES`], from outside and from inside.
fn viewers() -> impl Iterator<Item = Vec3> {
    COSINES.into_iter().flat_map(|mu| [mu, -mu]).map(|mu| direction(f64::from(mu), 0.4))
}

/// Mean weight of a draw: the share of the light from `wo` which is scattered.
fn furnace(bsdf: &Bsdf, wo: Vec3, mode: TransportMode, n: u32) -> Rgb {
    let sum: glam::DVec3 = even_points(n)
        .filter_map(|(u_lobe, u)| bsdf.sample(wo, u_lobe, u, mode))
        .map(|sample| sample.weight.as_dvec3())
        .sum();
    (sum / f64::from(n)).as_vec3()
}

/// Pearson's χ² for every model, viewer and side; family level 0.01 after Šidák. And the integral of
/// the density is the share of draws which are neither deltas nor `None`: within 4 standard errors and the precision of
/// the tables which hold how often light returns, and 1 for Lambert to the precision of the quadrature.
#[test]
fn samples_follow_their_pdf() {
    let tables = Tables::new(1.5, &[0.1, 0.5]);
    let zoo = zoo(&tables);
    let bsdfs: Vec<_> = zoo.iter().filter(|bsdf| bsdf.has_non_delta()).collect();
    let level = sidak_level(bsdfs.len() * 2 * COSINES.len());
    let mut random = Random::new(11);
    let n = 50_000;
    for bsdf in bsdfs {
        for wo in viewers() {
            let mode = TransportMode::Radiance;
            let cells = integrate_cells(|wi| bsdf.evaluate(wo, wi, mode).pdf);
            let mut drawn = 0;
            let p = p_value(&cells, n, || {
                let sample = bsdf.sample(wo, random.uniform(), random.square(), mode)?;
                drawn += u32::from(!sample.delta);
                (!sample.delta).then_some(sample.wi)
            });
            assert!(p > level, "wo = {wo}: p = {p:e} below {level:e} for {bsdf:?}");
            let integral: f64 = cells.iter().sum();
            let share = f64::from(drawn) / f64::from(n);
            let sigma = (integral * (1.0 - integral)).max(0.0).sqrt() / f64::from(n).sqrt();
            assert!(
                (share - integral).abs() < 4.0 * sigma + 1e-3,
                "wo = {wo}: ∫pdf = {integral}, drawn {share}, {bsdf:?}"
            );
            if let Bsdf::Diffuse(_) = bsdf {
                assert!((integral - 1.0).abs() < 1e-5, "∫pdf = {integral}");
            }
        }
    }
}

/// The test above is able to fail: directions uniform in a box, normalised, are not cosine
/// distributed; neither are those of another roughness.
#[test]
fn a_wrong_sampler_is_rejected() {
    let mut random = Random::new(5);
    let diffuse = Bsdf::Diffuse(Diffuse { albedo: Rgb::ONE });
    let wo = Vec3::Z;
    let mode = TransportMode::Radiance;
    let cells = integrate_cells(|wi| diffuse.evaluate(wo, wi, mode).pdf);
    let p = p_value(&cells, 20_000, || {
        let u = random.square();
        Some(Vec3::new(2.0 * u.x - 1.0, 2.0 * u.y - 1.0, random.uniform()).normalize())
    });
    assert!(p < 1e-9, "p = {p}");
    let (stated, other) = (metal(GOLD, 0.30), metal(GOLD, 0.33));
    let cells = integrate_cells(|wi| stated.evaluate(wo, wi, mode).pdf);
    let p = p_value(&cells, 100_000, || {
        other.sample(wo, random.uniform(), random.square(), mode).map(|sample| sample.wi)
    });
    assert!(p < 1e-6, "p = {p}");
}

/// The weight is `f cos / pdf` and the density the same from either call.
#[test]
fn sampling_and_evaluating_agree() {
    let tables = Tables::new(1.5, &[0.1, 0.5]);
    for bsdf in zoo(&tables) {
        for wo in viewers() {
            for mode in MODES {
                for (u_lobe, u) in even_points(500) {
                    let Some(sample) = bsdf.sample(wo, u_lobe, u, mode) else { continue };
                    assert!((sample.wi.length() - 1.0).abs() < 1e-5, "{sample:?}");
                    assert_eq!(sample.transmitted, (sample.wi.z < 0.0) != (wo.z < 0.0));
                    if sample.delta {
                        assert_eq!(sample.pdf, 0.0);
                        continue;
                    }
                    let value = bsdf.evaluate(wo, sample.wi, mode);
                    let weight = value.f_cos / value.pdf;
                    assert!((value.pdf / sample.pdf - 1.0).abs() < 1e-4, "{value:?} {sample:?}");
                    let relative = (weight - sample.weight).abs() / sample.weight;
                    assert!(relative.max_element() < 1e-4, "{weight} {sample:?} {bsdf:?}");
                }
            }
        }
    }
}

/// Oracle: Helmholtz reciprocity, `f(o, i) n_o⁻² = f(i, o) n_i⁻²` for radiance.
#[test]
fn every_model_is_reciprocal() {
    let tables = Tables::new(1.5, &[0.1, 0.5]);
    let mode = TransportMode::Radiance;
    let mut random = Random::new(17);
    for bsdf in zoo(&tables) {
        let mut compared = 0;
        for _ in 0..2000 {
            let (o, i) = (random.direction(), random.direction());
            let forward = bsdf.evaluate(o, i, mode).f_cos.x / i.z.abs();
            let backward = bsdf.evaluate(i, o, mode).f_cos.x / o.z.abs();
            let index = |z: f32| if z < 0.0 { 1.5 } else { 1.0_f32 };
            let solid = matches!(bsdf, Bsdf::RoughDielectric(_));
            let scale = if solid { (index(i.z) / index(o.z)).powi(2) } else { 1.0 };
            if forward > 1e-6 {
                let error = (forward * scale / backward - 1.0).abs();
                assert!(error < 2e-3, "o = {o}, i = {i}: {forward} {backward} {bsdf:?}");
                compared += 1;
            }
        }
        assert_eq!(compared > 100, bsdf.has_non_delta(), "{bsdf:?}");
    }
}

/// White furnace: what reflects everything returns everything, at every width and angle.
#[test]
fn white_materials_return_all_light() {
    for alpha in [0.001, 0.01, 0.03, 0.1, 0.25, 0.5, 0.75, 1.0] {
        // Near the smooth end the loss is a narrow dip at the horizon, which the table rounds off.
        let tolerance = if alpha < 0.01 { 4e-3 } else { 2e-3 };
        let tables = Tables::new(1.5, &[alpha]);
        let mut bsdfs = vec![metal(WHITE_METAL, alpha)];
        bsdfs.extend(tables.plastics(Rgb::ONE));
        for metallic in [0.0, 0.5, 1.0] {
            for transmission in [0.0, 0.5, 1.0] {
                bsdfs.push(principled(Rgb::ONE, metallic, Some(alpha), transmission));
            }
        }
        for bsdf in bsdfs {
            for mu in [1.0, 0.3, 0.03, 0.001] {
                let wo = direction(mu, 0.0);
                let total = furnace(&bsdf, wo, TransportMode::Radiance, 30_000).x;
                assert!((total - 1.0).abs() < tolerance, "α = {alpha}, μ = {mu}: {total} {bsdf:?}");
            }
        }
    }
}

/// The same with the table which textured roughness interpolates between rows.
#[test]
fn white_materials_with_textured_roughness_return_nearly_all_light() {
    for alpha in [0.0013, 0.012, 0.06, 0.17, 0.4, 0.8] {
        let lobe = ReflectorLobe::new(reflector_table().at(alpha));
        let parameters = PrincipledParameters {
            base_color: Rgb::ONE,
            metallic: 0.0,
            ior: 1.5,
            transmission: 0.3,
        };
        for bsdf in [
            Bsdf::RoughConductor(RoughConductor::new(WHITE_METAL, Rgb::ONE, lobe)),
            Bsdf::Principled(Principled::new(&parameters, Some(lobe))),
        ] {
            for mu in [1.0, 0.5, 0.2, 0.03, 0.001] {
                let total = furnace(&bsdf, direction(mu, 0.0), TransportMode::Radiance, 30_000).x;
                assert!((total - 1.0).abs() < 5e-3, "α = {alpha}, μ = {mu}: {total} {bsdf:?}");
            }
        }
    }
}

/// Power is conserved at a rough interface of glass, from both sides, for indices below and above 1.
#[test]
fn rough_glass_passes_on_all_power() {
    for eta in [0.75, 1.1, 1.33, 1.5, 2.4] {
        let tables = Tables::new(eta, &[0.01, 0.05, 0.2, 0.5, 1.0]);
        for bsdf in tables.glasses() {
            for mu in [1.0, 0.7, 0.4, 0.1, 0.01, -0.01, -0.1, -0.4, -0.7, -1.0] {
                let wo = direction(mu, 0.0);
                let total = furnace(&bsdf, wo, TransportMode::Importance, 30_000).x;
                assert!((total - 1.0).abs() < 5e-3, "η = {eta}, μ = {mu}: {total} {bsdf:?}");
            }
        }
    }
}

/// Oracle: a smooth coat over a white base, thin glass without tint and the smooth principled
/// white reflect exactly 1.
#[test]
fn smooth_white_materials_return_exactly_all_light() {
    for bsdf in [
        smooth_plastic(Rgb::ONE, 1.5),
        smooth_plastic(Rgb::ONE, 1.0),
        smooth_plastic(Rgb::ONE, 2.4),
        Bsdf::ThinGlass(ThinGlass { eta: 1.5, tint: Rgb::ONE }),
        Bsdf::Mirror(Mirror { reflectance: Rgb::ONE }),
        Bsdf::SmoothConductor(SmoothConductor { fresnel: WHITE_METAL }),
        principled(Rgb::ONE, 0.0, None, 0.0),
        principled(Rgb::ONE, 0.5, None, 0.5),
        principled(Rgb::ONE, 0.0, None, 1.0),
    ] {
        for mu in [1.0, 0.5, 0.1, 0.01] {
            let total = furnace(&bsdf, direction(mu, 1.0), TransportMode::Radiance, 50_000).x;
            assert!((total - 1.0).abs() < 1e-3, "μ = {mu}: {total} {bsdf:?}");
            assert!((bsdf.albedo(direction(mu, 1.0)).x - 1.0).abs() < 1e-5);
        }
    }
}

/// Nothing returns more than it receives, and the albedo for the auxiliary layer is what a furnace
/// measures. The metal's is approximate: it takes Schlick's term for the exact one.
#[test]
fn the_albedo_is_what_a_furnace_measures() {
    let tables = Tables::new(1.5, &[0.1, 0.5]);
    for bsdf in zoo(&tables) {
        for wo in viewers() {
            let total = furnace(&bsdf, wo, TransportMode::Importance, 30_000);
            let difference = (total - bsdf.albedo(wo)).abs().max_element();
            let tolerance = if matches!(bsdf, Bsdf::RoughConductor(_)) { 0.03 } else { 5e-3 };
            assert!(difference < tolerance, "{wo}: {total} {} {bsdf:?}", bsdf.albedo(wo));
            assert!(total.max_element() < 1.0 + 5e-3, "{wo}: {total} {bsdf:?}");
        }
    }
}

/// Oracle: a camera in glass of index 1.5 which looks out along the normal at radiance 1 reads
/// `n² (1 − F) = 2.16`; the power that gets out of the glass is `1 − F = 0.96`.
#[test]
fn a_camera_in_glass_sees_the_outside_brighter() {
    let tables = Tables::new(1.5, &[0.001]);
    let smooth = Bsdf::SmoothDielectric(SmoothDielectric::new(1.5));
    for (bsdf, tolerance) in [(smooth, 1e-3), (tables.glasses().next().unwrap(), 3e-3)] {
        for (mode, expected) in [(TransportMode::Radiance, 2.16), (TransportMode::Importance, 0.96)]
        {
            let n = 20_000;
            let out: f32 = even_points(n)
                .filter_map(|(u_lobe, u)| bsdf.sample(-Vec3::Z, u_lobe, u, mode))
                .filter(|sample| sample.transmitted)
                .map(|sample| sample.weight.x)
                .sum();
            let out = out / n as f32;
            assert!((out - expected).abs() < tolerance, "{mode:?}: {out}");
        }
    }
}

/// Radiance and power differ by `1/η²` in transmission and by nothing in reflection.
#[test]
fn radiance_and_power_differ_by_the_squared_index() {
    let tables = Tables::new(1.5, &[0.5]);
    let bsdf = tables.glasses().next().unwrap();
    let mut random = Random::new(23);
    for _ in 0..1000 {
        let (o, i) = (random.direction(), random.direction());
        let radiance = bsdf.evaluate(o, i, TransportMode::Radiance);
        let power = bsdf.evaluate(o, i, TransportMode::Importance);
        let factor = match (o.z > 0.0, i.z > 0.0) {
            (true, false) => 1.0 / 2.25,
            (false, true) => 2.25,
            _ => 1.0,
        };
        assert_eq!(radiance.pdf, power.pdf);
        assert!((radiance.f_cos.x - factor * power.f_cos.x).abs() <= 1e-5 * radiance.f_cos.x);
    }
}

/// A lobe of probability zero is not chosen, not even by the number 0.
#[test]
fn a_lobe_without_weight_is_never_chosen() {
    let black_base = smooth_plastic(Rgb::ZERO, 1.5);
    let no_coat = smooth_plastic(Rgb::ONE, 1.0);
    let no_glass = Bsdf::SmoothDielectric(SmoothDielectric::new(1.0));
    let metal = principled(Rgb::ONE, 1.0, None, 1.0);
    let wo = direction(0.6, 2.0);
    for u_lobe in [0.0, 0.5, 1.0_f32.next_down()] {
        for u in [Vec2::ZERO, Vec2::splat(0.4), Vec2::splat(1.0_f32.next_down())] {
            let sample = |bsdf: &Bsdf| bsdf.sample(wo, u_lobe, u, TransportMode::Radiance);
            assert!(sample(&black_base).is_none_or(|sample| sample.delta));
            assert!(sample(&no_coat).is_none_or(|sample| !sample.delta));
            assert!(sample(&no_glass).unwrap().transmitted);
            assert!(sample(&metal).is_none_or(|sample| !sample.transmitted));
        }
    }
}

/// White of every model, at one width.
fn white_zoo(tables: &Tables, alpha: f32) -> Vec<Bsdf<'_>> {
    let mut all = vec![metal(WHITE_METAL, alpha)];
    all.extend(tables.plastics(Rgb::ONE));
    all.extend(tables.glasses());
    for (metallic, transmission) in [(0.0, 0.0), (1.0, 0.0), (0.5, 0.5), (0.0, 1.0)] {
        all.push(principled(Rgb::ONE, metallic, Some(alpha), transmission));
    }
    all
}

/// In a white world every path brings 1 if its draws are worth 1 each. They are spread by less than a quarter, and the most that one is
/// worth is 1.7; for glass narrower than 0.1, where one draw in a thousand returns from a second facet, it is 3.2. Drawn
/// by the cosine and by tables alone they were spread by 1, up to 3.2, and up to 6.7 where a facet reflects
/// more than the mean: five bounces inside of frosted glass made 300 of that.
#[test]
fn no_draw_in_a_white_world_is_worth_far_more_than_one() {
    for alpha in [0.01, 0.1, 0.3, 0.6, 1.0] {
        let tables = Tables::new(1.5, &[alpha]);
        for bsdf in white_zoo(&tables, alpha) {
            let glass = matches!(bsdf, Bsdf::RoughDielectric(_));
            let most = if glass && alpha < 0.1 { 3.2 } else { 1.7 };
            for wo in viewers().filter(|wo| glass || wo.z > 0.0) {
                let (mut sum, mut squares) = (0.0, 0.0);
                let n = 4000;
                for (u_lobe, u) in even_points(n) {
                    let sample = bsdf.sample(wo, u_lobe, u, TransportMode::Importance);
                    let weight = f64::from(sample.map_or(0.0, |sample| sample.weight.x));
                    assert!(weight < most, "α = {alpha}, {wo}: {weight} {bsdf:?}");
                    (sum, squares) = (sum + weight, squares + weight * weight);
                }
                let mean = sum / f64::from(n);
                let spread = (squares / f64::from(n) - mean * mean).max(0.0).sqrt();
                assert!(spread < 0.25, "α = {alpha}, {wo}: {spread} {bsdf:?}");
            }
        }
    }
}

/// Widths down to the last one which is not smooth, with those to either side of 10⁻³.
const NARROW: [f32; 7] = [SMOOTH_BELOW_ALPHA, 2e-6, 1e-5, 1e-4, 9.61e-4, 1.005e-3, 1e-2];

/// A facet of the slope `tan θ = α √(s/(1 − s))`: a share `s` of all is less steep.
fn facet(alpha: f32, s: f64, phi: f64) -> glam::DVec3 {
    let t = f64::from(alpha) * (s / (1.0 - s)).sqrt();
    glam::DVec3::new(t * phi.cos(), t * phi.sin(), 1.0).normalize()
}

/// Glass of index 1.5; its transmitted lobe is half as wide, and ends at twice the width.
fn narrow_glass(tables: &Tables) -> Bsdf<'_> {
    tables.glasses().next().expect("one was made")
}

/// Oracle: half of the facets of GGX are less steep than α, and of narrow lobes half of the visible ones. The half vectors of what is
/// drawn, formed in f64, are so at every width, down to the end. Level: 4 standard errors and the square
/// of the rounding relative to the width.
#[test]
fn lobes_are_as_wide_as_their_roughness_until_f32_ends() {
    let n = 4000;
    let wo = direction(0.8, 0.3);
    for alpha in NARROW {
        let tables = Tables::new(1.5, &[alpha]);
        for bsdf in [metal(GOLD, alpha), narrow_glass(&tables)] {
            let (mut within, mut all) = (0.0, 0.0);
            for (u_lobe, u) in even_points(n) {
                let sample = bsdf.sample(wo, u_lobe, u, TransportMode::Importance).unwrap();
                let index = if sample.transmitted { 1.5 } else { 1.0 };
                let m = wo.as_dvec3().normalize() + sample.wi.as_dvec3().normalize() * index;
                let slope = m.x.hypot(m.y) / m.z.abs();
                within += f64::from(slope < f64::from(alpha));
                all += 1.0;
            }
            let bound = 2.0 / f64::from(n).sqrt() + 4.0 * f64::from(f32::EPSILON / alpha).powi(2);
            let share: f64 = within / all;
            assert!((share - 0.5).abs() < bound, "α = {alpha}: {share} {bsdf:?}");
        }
    }
}

/// Oracle: over facets drawn in f64, the mean of the density over the one with which their directions come is the integral of
/// the density, which is the share of light that the lobe has, with directions rounded to f32.
#[test]
fn densities_of_narrow_lobes_integrate_to_their_share() {
    let n = 4000;
    let wo = direction(0.8, 0.3);
    let o = wo.as_dvec3().normalize();
    for alpha in NARROW {
        let tables = Tables::new(1.5, &[alpha]);
        let glass = narrow_glass(&tables);
        let f = f64::from(fresnel::dielectric_reflectance(0.8, 1.5));
        for (bsdf, eta, share) in
            [(metal(GOLD, alpha), 1.0, 1.0), (glass, 1.0, f), (glass, 1.5, 1.0 - f)]
        {
            let sum: f64 = even_points(n)
                .map(|(_, u)| {
                    let m = facet(alpha, f64::from(u.x), std::f64::consts::TAU * f64::from(u.y));
                    let a2 = f64::from(alpha).powi(2);
                    let d = a2
                        / (std::f64::consts::PI * (a2 * m.z * m.z + m.x * m.x + m.y * m.y).powi(2));
                    let cos = o.dot(m);
                    let (wi, jacobian) = if eta == 1.0 {
                        (m * (2.0 * cos) - o, 0.25 / cos)
                    } else {
                        let cos_t = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
                        let wi = m * (cos / eta - cos_t) - o / eta;
                        (wi, eta * eta * cos_t / (cos - eta * cos_t).powi(2))
                    };
                    let value = bsdf.evaluate(wo, wi.as_vec3(), TransportMode::Importance);
                    f64::from(value.pdf) / (d * m.z * jacobian)
                })
                .sum();
            let integral = sum / f64::from(n) / share;
            let rounding = f64::from(f32::EPSILON / alpha).powi(2);
            assert!(
                (integral - 1.0).abs() < 3e-3 + 4.0 * rounding,
                "α = {alpha}, η = {eta}: {integral} {bsdf:?}"
            );
        }
    }
}

/// At the width where GGX gives way to a mirror the two agree: nearly all light within ten
/// widths of the mirror direction, the same reflectance.
#[test]
fn the_narrowest_lobe_agrees_with_a_mirror() {
    let rough = metal(GOLD, SMOOTH_BELOW_ALPHA);
    let smooth = Bsdf::SmoothConductor(SmoothConductor { fresnel: GOLD });
    let n = 20_000;
    for mu in [1.0, 0.7, 0.1] {
        let wo = direction(mu, 0.3);
        let mode = TransportMode::Radiance;
        let difference = furnace(&rough, wo, mode, n) - furnace(&smooth, wo, mode, 1);
        assert!(difference.abs().max_element() < 2e-3, "μ = {mu}: {difference}");
        let mirror = Vec3::new(-wo.x, -wo.y, wo.z);
        let near = even_points(n)
            .filter_map(|(u_lobe, u)| rough.sample(wo, u_lobe, u, mode))
            .filter(|sample| sample.wi.distance(mirror) < 20.0 * SMOOTH_BELOW_ALPHA)
            .count();
        // Half vectors within 10 α of the normal hold 100/101 of D: directions within 20 α.
        assert!(near as f64 > 0.985 * f64::from(n), "μ = {mu}: {near} of {n}");
    }
}

/// Indices from vanishing to enormous, every angle, both sides: finite, and power is conserved.
#[test]
fn smooth_interfaces_of_any_index_conserve_power() {
    for eta in [0.01, 0.5, 0.999_999, 1.0, 1.000_001, 1.5, 4.0, 100.0] {
        let bsdf = Bsdf::SmoothDielectric(SmoothDielectric::new(eta));
        for k in 0..=200 {
            for z in [k as f32 / 200.0, -(k as f32) / 200.0, 1e-6, -1e-6, 1e-30, f32::MIN_POSITIVE]
            {
                let wo = direction(f64::from(z), 0.7).with_z(z);
                let mut u = Random::new(k);
                let Some(sample) =
                    bsdf.sample(wo, u.uniform(), Vec2::ZERO, TransportMode::Importance)
                else {
                    assert_eq!(z, 0.0);
                    continue;
                };
                assert_eq!(sample.weight, Rgb::ONE);
                assert!(
                    sample.wi.is_finite() && (sample.wi.length() - 1.0).abs() < 1e-5,
                    "{sample:?}"
                );
                if eta == 1.0 {
                    assert_eq!(sample.wi, -wo);
                }
            }
        }
    }
}

/// Oracle: Snell's law, in both directions.
#[test]
fn refraction_follows_snell() {
    for eta in [1.33, 1.5, 2.4] {
        let bsdf = Bsdf::SmoothDielectric(SmoothDielectric::new(eta));
        for k in 1..90 {
            let theta = f64::from(k).to_radians();
            for side in [1.0, -1.0] {
                let wo = direction(side * theta.cos(), 0.0);
                let relative = if side > 0.0 { f64::from(eta) } else { 1.0 / f64::from(eta) };
                let last = 1.0_f32.next_down(); // transmits wherever that is possible
                let sample = bsdf.sample(wo, last, Vec2::ZERO, TransportMode::Importance).unwrap();
                let sin_t = theta.sin() / relative;
                assert_eq!(sample.transmitted, sin_t < 1.0);
                if sample.transmitted {
                    assert!((f64::from(sample.wi.x) + sin_t).abs() < 1e-6);
                    assert!((f64::from(sample.eta) - relative).abs() < 1e-6);
                }
            }
        }
    }
}

/// A million random evaluations and draws: finite, never negative, unit directions.
#[test]
fn random_input_gives_no_wild_numbers() {
    let edge = [0.0, f32::MIN_POSITIVE, 1e-30, 1e-6, 0.5, 1.0_f32.next_down()];
    let mut random = Random::new(29);
    let alphas = [SMOOTH_BELOW_ALPHA, 0.01, 0.3, 1.0];
    let tables: Vec<_> = [0.3, 1.2, 1.5, 4.0, 100.0].map(|eta| Tables::new(eta, &alphas)).into();
    let mut bsdfs: Vec<_> = tables.iter().flat_map(zoo).collect();
    for alpha in alphas {
        bsdfs.push(metal(GOLD, alpha));
        bsdfs.push(principled(Rgb::ONE, 0.5, Some(alpha), 0.5));
        bsdfs.push(principled(Rgb::ZERO, 0.0, Some(alpha), 0.0));
    }
    bsdfs.push(smooth_plastic(Rgb::ZERO, 1.0));
    let pick = |random: &mut Random| {
        if random.uniform() < 0.2 {
            edge[(random.uniform() * edge.len() as f32) as usize]
        } else {
            random.uniform()
        }
    };
    let near_horizon = |random: &mut Random| {
        let d = random.direction();
        let z = d.z * pick(random);
        if random.uniform() < 0.3 {
            direction(f64::from(z), f64::from(d.x) * 9.0).with_z(z)
        } else {
            d
        }
    };
    let rounds = 1_000_000 / bsdfs.len();
    for bsdf in &bsdfs {
        for round in 0..rounds {
            let (o, i) = (near_horizon(&mut random), near_horizon(&mut random));
            let mode = MODES[round % 2];
            let value = bsdf.evaluate(o, i, mode);
            let fine = value.f_cos.is_finite() && value.f_cos.min_element() >= 0.0;
            assert!(
                fine && value.pdf.is_finite() && value.pdf >= 0.0,
                "{o} {i} {value:?} {bsdf:?}"
            );
            let u = Vec2::new(pick(&mut random), pick(&mut random));
            if let Some(sample) = bsdf.sample(o, pick(&mut random), u, mode) {
                let fine = sample.weight.is_finite() && sample.weight.min_element() >= 0.0;
                assert!(fine && sample.pdf.is_finite(), "{o} {sample:?} {bsdf:?}");
                assert!((sample.wi.length() - 1.0).abs() < 1e-4, "{o} {sample:?} {bsdf:?}");
            }
        }
    }
}

/// A BSDF stays small enough to be passed around.
#[test]
fn a_bsdf_is_at_most_96_bytes() {
    assert!(size_of::<Bsdf>() <= 96, "{}", size_of::<Bsdf>());
}

/// Oracle: Lambert's `ρ cos θ / π`, and darkness on the other side.
#[test]
fn diffuse_is_lambertian_on_both_sides() {
    let bsdf = Bsdf::Diffuse(Diffuse { albedo: Rgb::new(0.2, 0.5, 0.8) });
    for z in [1.0, -1.0] {
        let wo = direction(0.3 * z, 0.0);
        let value = bsdf.evaluate(wo, direction(0.6 * z, 2.0), TransportMode::Radiance);
        let expected = Rgb::new(0.2, 0.5, 0.8) * 0.6 * FRAC_1_PI;
        assert!((value.f_cos - expected).abs().max_element() < 1e-7);
        let behind = bsdf.evaluate(wo, direction(-0.6 * z, 2.0), TransportMode::Radiance);
        assert_eq!(behind, BsdfValue::ZERO);
    }
}

/// The number that chooses a lobe chooses the mirror image below the probability that is told, and the other ray from
/// there on; where there are not two deltas nothing is told.
#[test]
fn the_share_of_the_mirror_image_is_the_one_that_is_drawn_by() {
    use crate::sampling::{Sampler, warp::uniform_sphere};
    for k in 0..2000 {
        let s = Sampler::new(21, 0, (0, 0), k);
        let wo = uniform_sphere(s.two(0));
        let eta = 0.6 + 1.4 * s.one(2);
        for bsdf in [
            Bsdf::SmoothDielectric(SmoothDielectric::new(eta)),
            Bsdf::ThinGlass(ThinGlass { eta, tint: Rgb::new(0.9, 0.5, 0.2) }),
        ] {
            let Some(p) = bsdf.first_of_two_deltas(wo) else {
                let total = bsdf.sample(wo, 0.999_999, Vec2::ZERO, TransportMode::Radiance);
                assert!(total.is_none_or(|total| !total.transmitted), "{bsdf:?}, {wo}");
                continue;
            };
            for u in [0.0, p * 0.5, p * 0.999, p * 1.001, 0.5 * (1.0 + p)] {
                let drawn = bsdf.sample(wo, u, Vec2::ZERO, TransportMode::Radiance);
                let drawn = drawn.expect("either has energy");
                assert_eq!(drawn.transmitted, u >= p, "{bsdf:?}, {wo}, {u} of {p}");
            }
        }
    }
    let diffuse = Bsdf::Diffuse(Diffuse { albedo: Rgb::ONE });
    assert_eq!(diffuse.first_of_two_deltas(Vec3::Z), None);
}
