//! Cuts a polygon into triangles.
//!
//! A fan from the first corner is right for convex polygons only. Any simple polygon can be cut by
//! clipping ears: a corner is an ear when it is convex and no other corner lies in its triangle,
//! and every simple polygon has at least two (Meisters 1975, "Polygons Have Ears", American
//! Mathematical Monthly 82(6)). The test against the other corners is the one of Eberly 2002,
//! "Triangulation by Ear Clipping", section 2: reflex corners alone can lie inside, and corners at
//! the position of one of the ear's own do not count, so that a hole may be joined to the outline
//! by a doubled edge.

use glam::{DVec2, DVec3};

/// Most corners of one concave polygon: clipping takes time with the square of their number, and
/// with the cube for one that was made to be slow.
pub(super) const MAX_CONCAVE_CORNERS: usize = 1 << 12;

/// Cuts the polygon with these corners into `n − 2` triangles, or fewer where corners are collinear;
/// their indices refer to `corners` and go round the same way.
///
/// A polygon which crosses itself has no right answer: it gets triangles between its corners, and
/// no error. `None` for a concave polygon of more than [`MAX_CONCAVE_CORNERS`] corners.
pub(super) fn triangulate(corners: &[DVec3]) -> Option<Vec<[usize; 3]>> {
    let n = corners.len();
    if n <= 3 {
        return Some(if n == 3 { vec![[0, 1, 2]] } else { Vec::new() });
    }
    let points = project(corners);
    let fan = || (1..n - 1).map(|i| [0, i, i + 1]).collect();
    if is_convex(&points) {
        return Some(fan());
    }
    if n > MAX_CONCAVE_CORNERS {
        return None;
    }
    Some(Clipper::new(&points).clip())
}

/// Drops the axis along which the polygon faces most, such that it goes counter-clockwise.
fn project(corners: &[DVec3]) -> Vec<DVec2> {
    // Newell's normal: the sum of the cross products of neighbours, twice the area vector.
    let origin = corners[0];
    let normal: DVec3 = (0..corners.len())
        .map(|i| (corners[i] - origin).cross(corners[(i + 1) % corners.len()] - origin))
        .sum();
    let size = normal.abs();
    let (axis, u, v) = if size.z >= size.x && size.z >= size.y {
        (2, 0, 1)
    } else if size.x >= size.y {
        (0, 1, 2)
    } else {
        (1, 2, 0)
    };
    let (u, v) = if normal[axis] >= 0.0 { (u, v) } else { (v, u) };
    corners.iter().map(|p| DVec2::new(p[u] - origin[u], p[v] - origin[v])).collect()
}

/// Twice the signed area of a triangle; positive when it goes counter-clockwise.
fn area2(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Whether a fan from corner 0 covers a counter-clockwise polygon: every corner turns left and so
/// does every triangle of the fan (which excludes stars, whose corners all turn left as well).
fn is_convex(points: &[DVec2]) -> bool {
    let n = points.len();
    let corner = |i: usize| points[i % n];
    (0..n).all(|i| area2(corner(i), corner(i + 1), corner(i + 2)) > 0.0)
        && (1..n - 1).all(|i| area2(points[0], points[i], points[i + 1]) > 0.0)
}

/// A ring of the corners that are left.
struct Clipper<'a> {
    points: &'a [DVec2],
    next: Vec<usize>,
    previous: Vec<usize>,
    left: usize,
    triangles: Vec<[usize; 3]>,
}

impl<'a> Clipper<'a> {
    fn new(points: &'a [DVec2]) -> Self {
        let n = points.len();
        Self {
            points,
            next: (0..n).map(|i| (i + 1) % n).collect(),
            previous: (0..n).map(|i| (i + n - 1) % n).collect(),
            left: n,
            triangles: Vec::with_capacity(n - 2),
        }
    }

    fn clip(mut self) -> Vec<[usize; 3]> {
        let mut at = 0;
        let mut refused = 0;
        while self.left > 3 {
            // Once round without an ear: rounding, collinear corners, or a ring which crosses
            // itself. One corner has to go so that the clipping ends.
            let forced = refused >= self.left;
            if forced {
                at = self.flattest(at);
            }
            if forced || self.is_ear(at) {
                at = self.cut(at);
                refused = 0;
            } else {
                at = self.next[at];
                refused += 1;
            }
        }
        self.emit(at);
        self.triangles
    }

    fn turn(&self, at: usize) -> f64 {
        area2(self.points[self.previous[at]], self.points[at], self.points[self.next[at]])
    }

    fn is_ear(&self, at: usize) -> bool {
        if self.turn(at) <= 0.0 {
            return false;
        }
        let [a, b, c] = [self.previous[at], at, self.next[at]].map(|i| self.points[i]);
        let mut other = self.next[self.next[at]];
        while other != self.previous[at] {
            let p = self.points[other];
            let inside = area2(a, b, p) >= 0.0 && area2(b, c, p) >= 0.0 && area2(c, a, p) >= 0.0;
            if inside && p != a && p != b && p != c && self.turn(other) <= 0.0 {
                return false;
            }
            other = self.next[other];
        }
        true
    }

    /// The corner whose triangle changes the covered area least.
    fn flattest(&self, start: usize) -> usize {
        let mut best = start;
        let mut at = self.next[start];
        while at != start {
            if self.turn(at).abs() < self.turn(best).abs() {
                best = at;
            }
            at = self.next[at];
        }
        best
    }

    fn emit(&mut self, at: usize) {
        if self.turn(at) != 0.0 {
            self.triangles.push([self.previous[at], at, self.next[at]]);
        }
    }

    /// Cuts off the triangle at this corner and returns the corner to go on with. Going on after
    /// the next corner keeps the triangles from all sharing one corner.
    fn cut(&mut self, at: usize) -> usize {
        self.emit(at);
        let (before, after) = (self.previous[at], self.next[at]);
        self.next[before] = after;
        self.previous[after] = before;
        self.left -= 1;
        self.next[after]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        let vector = |t: &[usize; 3]| {
            let [a, b, c] = t.map(|i| corners[i]);
            (b - a).cross(c - a) * 0.5
        };
        triangles.iter().map(|t| vector(t).length()).sum()
    }

    /// Area of a polygon by its area vector: independent of any triangulation.
    fn shoelace(corners: &[DVec3]) -> f64 {
        let n = corners.len();
        (0..n).map(|i| corners[i].cross(corners[(i + 1) % n])).sum::<DVec3>().length() * 0.5
    }

    /// In all the planes and both ways round; the sum of unsigned areas equals the polygon's area
    /// only if no triangle lies outside and none overlap.
    fn check(outline: &[(f64, f64)]) {
        type Lift = fn(f64, f64) -> DVec3;
        let lifts: [Lift; 4] = [
            |x, y| DVec3::new(x, y, 3.0),
            |x, y| DVec3::new(3.0, x, y),
            |x, y| DVec3::new(x, 3.0, y),
            |x, y| DVec3::new(x + 1.0, y - 2.0, 0.3 * x - 0.7 * y),
        ];
        for lift in lifts {
            let mut corners: Vec<DVec3> = outline.iter().map(|&(x, y)| lift(x, y)).collect();
            for _ in 0..2 {
                for turn in 0..corners.len() {
                    corners.rotate_left(usize::from(turn > 0));
                    let triangles = triangulate(&corners).unwrap();
                    let (found, expected) = (area(&corners, &triangles), shoelace(&corners));
                    assert!(
                        (found - expected).abs() < 1e-12 * expected.max(1.0),
                        "{found} {expected}"
                    );
                }
                corners.reverse();
            }
        }
    }

    #[test]
    fn the_triangles_of_simple_polygons_cover_their_area_once() {
        check(&[(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)]); // L
        check(&[(0.0, 0.0), (2.0, 1.0), (4.0, 0.0), (2.0, 4.0)]); // arrow head
        check(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (2.0, 2.0), (0.0, 2.0)]); // collinear
        let comb = (0..9).flat_map(|i| {
            let x = f64::from(i);
            [(x, 0.0), (x + 0.5, 3.0)].map(|(x, y)| (x, y + 0.1))
        });
        let comb: Vec<_> = comb.chain([(10.0, -1.0), (-1.0, -1.0)]).collect();
        check(&comb);
    }

    /// A square with a square hole, joined by a doubled edge: area 16 − 4.
    #[test]
    fn a_hole_joined_by_a_doubled_edge_stays_open() {
        let outline = [
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 4.0),
            (0.0, 4.0),
            (0.0, 0.0),
            (1.0, 1.0),
            (1.0, 3.0),
            (3.0, 3.0),
            (3.0, 1.0),
            (1.0, 1.0),
        ];
        check(&outline);
        let corners: Vec<DVec3> = outline.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
        let found = area(&corners, &triangulate(&corners).unwrap());
        assert!((found - 12.0).abs() < 1e-12, "{found}");
    }

    /// Triangles keep the direction of the outline, so that the front stays the front.
    #[test]
    fn triangles_go_round_like_the_polygon() {
        let corners =
            [(0.0, 0.0), (2.0, 1.0), (4.0, 0.0), (2.0, 4.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        for [a, b, c] in triangulate(&corners).unwrap() {
            assert!((corners[b] - corners[a]).cross(corners[c] - corners[a]).z > 0.0);
        }
    }

    /// Bow ties, points, and rings of equal corners end; a concave giant is refused.
    #[test]
    fn degenerate_polygons_end() {
        let bow = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.2)];
        let bow = bow.map(|(x, y)| DVec3::new(x, y, 0.0));
        assert!(triangulate(&bow).unwrap().len() <= 3);
        assert!(triangulate(&[DVec3::ONE; 7]).unwrap().is_empty());
        assert!(triangulate(&[DVec3::ONE; 2]).unwrap().is_empty());
        assert!(triangulate(&[DVec3::splat(f64::NAN); 6]).is_some());
        assert!(triangulate(&vec![DVec3::ZERO; MAX_CONCAVE_CORNERS + 1]).is_none());
    }
}
