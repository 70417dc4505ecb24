//! Tests of pieces, their tree, and root finding.

use super::*;
use crate::sampling::Sampler;
use glam::DVec3;

/// Curves of all kinds: bulging, folded, with cusps and weights, all off the axis.
fn curve(k: u32) -> Cubic {
    let s = Sampler::new(12, 0, (k, 0), 0);
    let point = |i: u32| s.two(2 * i).as_dvec2() * 2.0 + DVec2::new(1.0, -1.0);
    let mut points = [0, 1, 2, 3].map(point);
    if k.is_multiple_of(5) {
        // A derivative of 0 in the middle.
        points[2] = points[0];
        points[3] = points[1];
        points.swap(2, 1);
        points[2] = points[1] * 2.0 - points[0];
    }
    let weight =
        |i: u32| if k.is_multiple_of(2) { 1.0 } else { 0.2 + 3.0 * f64::from(s.one(20 + i)) };
    Cubic::new(points, [0, 1, 2, 3].map(weight))
}

/// Oracle: the curve at many places. They lie in the box of their piece and run one way in both coordinates,
/// and directions lie between those at the ends; pieces follow each other to the bit, and their union is the
/// curve.
#[test]
fn pieces_are_monotone_bend_one_way_and_make_up_the_curve() {
    for k in 0..400 {
        let curve = curve(k);
        let profile = Profile::new(&[curve]).expect("off its axis");
        let (radius, _) = profile.extent;
        let rounding = 16.0 * f64::EPSILON * radius.max(1.0);
        assert!(profile.pieces.len() < 60, "{}", profile.pieces.len());
        for pair in profile.pieces.windows(2) {
            assert_eq!((pair[0].end, pair[0].v.1), (pair[1].start, pair[1].v.0));
        }
        for piece in &profile.pieces {
            let across = piece.end - piece.start;
            let mut before = piece.start;
            for i in 0..=50_u8 {
                let u = f64::from(i) / 50.0;
                let jet = piece.jet(u);
                let step = (jet.p - before) * across.signum();
                assert!(step.min_element() >= -rounding, "curve {k}, {piece:?} at {u}: {step}");
                before = jet.p;
                let t = piece.v.0 + (piece.v.1 - piece.v.0) * u;
                assert!(jet.p.distance(curve.at(t)) <= 4.0 * rounding, "curve {k} at {t}");
                let [first, last] = piece.directions;
                let turn = first.perp_dot(last);
                let direction = piece.direction(u);
                let outside = [first.perp_dot(direction), direction.perp_dot(last)];
                let slack = 1e-6;
                assert!(
                    outside.iter().all(|o| o * turn.signum() > -slack),
                    "curve {k}, {piece:?} at {u}: {direction}"
                );
            }
        }
    }
}

/// Oracle: a difference quotient.
#[test]
fn derivatives_are_those_of_the_points() {
    for k in 0..100 {
        for piece in &Profile::new(&[curve(k)]).expect("off its axis").pieces {
            let h = 1e-6;
            let quotient = (piece.jet(0.4 + h).p - piece.jet(0.4 - h).p) / (2.0 * h);
            assert!(piece.jet(0.4).d.distance(quotient) < 1e-8, "curve {k}");
        }
    }
}

/// Oracle: the inverse maps return their input.
#[test]
fn parameters_are_found_again_by_point_and_by_area() {
    for k in 0..100 {
        for piece in &Profile::new(&[curve(k)]).expect("off its axis").pieces {
            for u in [0.0, 1e-9, 0.3, 0.9, 1.0] {
                let p = piece.jet(u).p;
                let found = piece.jet(piece.parameter_of(p)).p;
                assert!(found.distance(p) < 1e-14, "curve {k} at {u}: {found} {p}");
                let area = |u: f64| {
                    let ring = |jet: Jet| std::f64::consts::TAU * jet.p.x * jet.d.length();
                    piece.integral(u, ring) / piece.area
                };
                let share = area(u);
                let again = area(piece.parameter_at_area(share));
                assert!((again - share).abs() < 1e-13, "curve {k} at {u}");
            }
        }
    }
}

/// Oracle: every point of a piece is in the ring of the piece, and that in those above it; each piece is in the
/// tree once.
#[test]
fn every_piece_is_in_its_rings() {
    let lines: Vec<Cubic> = (0..300)
        .map(|k| {
            let at = |k: u32| DVec2::new(2.0 + f64::from(k).sin(), f64::from(k) * 0.1 + 100.0);
            Cubic::line(at(k), at(k + 1))
        })
        .collect();
    let profile = Profile::new(&lines).expect("off its axis");
    let (middle, unit) = profile.sphere;
    let mut seen = vec![0; profile.pieces.len()];
    let mut open = vec![(0_usize, Vec::<[f64; 4]>::new())];
    while let Some((index, above)) = open.pop() {
        let node = &profile.rings[index];
        for ring in (0..WIDTH).filter(|&ring| node.outer[ring] >= 0.0) {
            let bounds = [node.low[ring], node.high[ring], node.inner[ring], node.outer[ring]];
            let mut around = above.clone();
            around.push(bounds.map(f64::from));
            let child = node.children[ring];
            if !child.is_piece() {
                open.push((child.index(), around));
                continue;
            }
            seen[child.index()] += 1;
            let piece = &profile.pieces[child.index()];
            for u in [0.0, 0.3, 0.8, 1.0] {
                let p = piece.jet(u).p;
                let (r2, y) = ((p.x / unit).powi(2), (p.y - middle) / unit);
                let inside = |[low, high, inner, outer]: &[f64; 4]| {
                    (*low..=*high).contains(&y) && (*inner..=*outer).contains(&r2)
                };
                assert!(around.iter().all(inside), "{around:?}: {y}, {r2}");
            }
        }
    }
    assert!(seen.iter().all(|count| *count == 1));
}

/// Oracle: the roots in closed form, of functions with a steep end, a flat end, and noise-free lines.
#[test]
fn bracketed_roots_are_found_to_the_last_digits() {
    for k in 0..500 {
        let root = 10.0_f64.powf(-12.0 * f64::from(Sampler::new(13, 0, (k, 0), 0).one(0)));
        let cases: [(&str, Box<dyn Fn(f64) -> (f64, f64)>); 3] = [
            (
                "root",
                Box::new(|u| {
                    let value = u.sqrt() - root.sqrt();
                    (value, value * 2.0 * u.sqrt())
                }),
            ),
            (
                "square",
                Box::new(|u| {
                    let value = u * u - root * root;
                    (value, value / (2.0 * u))
                }),
            ),
            ("line", Box::new(|u| (u - root, u - root))),
        ];
        for (name, f) in cases {
            let found = bracketed_root((0.0, 1.0), (f(0.0).0, f(1.0).0), f);
            assert!((found / root - 1.0).abs() < 1e-9, "{name}: {found} instead of {root}");
            assert!((found - root).abs() < 4.0 * f64::EPSILON, "{name}: {found} instead of {root}");
        }
    }
}

/// A profile of more pieces than its tree can hold is an error, not a panic.
#[test]
fn a_profile_that_is_too_long_is_an_error() {
    let at = |k: u32| DVec3::new(2.0, f64::from(k), 1.0);
    let lines: Vec<Cubic> =
        (0..262_145).map(|k| Cubic([at(k), at(k), at(k + 1), at(k + 1)])).collect();
    let made = |count: usize| Profile::new(&lines[..count]);
    assert!(made(1000).is_ok());
    assert!(matches!(made(lines.len()), Err(ProfileError::TooLong { .. })));
}
