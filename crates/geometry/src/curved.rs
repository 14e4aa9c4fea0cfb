//! The direction of the largest s(n) when a core is curved. Axes, face normals and side normals are candidates,
//! exact where a flat or straight part touches; the distance search finds the rest. Overlapping cores are first
//! moved apart along the best direction, which leaves the best direction what it is, until nothing is gained.
//! Knows no radii. Deep overlaps may have a better direction elsewhere than the one found.

use crate::core_spatial::{Round, SpatialCore};
use crate::geometry::Guess;
use crate::gjk::{Outcome, nearest};
use crate::kernel::Separation;
use crate::separate::{Pair, ROUNDING, apart, label_of};
use carom_math::{Column, Space, Spatial, Vec3, vec3};
use std::cell::Cell;

/// Distance at which curved cores are compared: below this fraction of the scale they are moved apart \[1\].
const CLEAR: f64 = 1e-5;
/// Overlaps beyond this fraction of the scale are looked at from several sides \[1\].
const DEEP: f64 = 1e-3;
/// Most refinements of a direction; shallow overlaps need two or three.
const REFINEMENTS: usize = 24;
/// A refinement that gains less than this fraction of the scale ends the search \[1\].
const SETTLED: f64 = 1e-13;

/// Which core has the corner that meets the other's face or side, and with it the witnesses.
#[derive(Clone, Copy)]
enum Meets {
    CornerOfA,
    CornerOfB,
    Unknown,
}

impl Pair<'_> {
    /// The direction of the largest s(n) when at least one core is curved; the best of a few local bests where they
    /// overlap.
    pub fn curved(&self, reach: f64, guess: &mut Guess<Spatial>) -> Option<Separation<Spatial>> {
        let support = |d| self.corner(d, Vec3::ZERO);
        let outcome = nearest(&support, self.between_centers(), reach, self.scale);
        if let Outcome::Beyond(direction, apart) = outcome {
            *guess = Guess { direction: direction.normalized(), apart };
            return None;
        }
        let best = self.best_candidate();
        if let Outcome::Apart(point, simplex) = outcome {
            let distance = point.norm();
            if distance > CLEAR * self.scale {
                let (on_a, on_b) = simplex.witnesses();
                // curved cores stop the search a little short: s(n) is what its direction is worth
                let gap = self.along(point * (1.0 / distance)).gap;
                if gap <= best.gap + 4.0 * ROUNDING * self.scale {
                    return Some(if self.is_matched(&best) {
                        best
                    } else {
                        Separation { on_a, on_b, ..best }
                    });
                }
                return Some(Separation { gap, ..apart(point, on_a, on_b, label_of(simplex.corners())) });
            }
        }
        let found = self.refined(best);
        // a facet's seams have the last word on its direction: no need to look further for it
        let facet =
            matches!(self.a, SpatialCore::Triangle(..)) || matches!(self.b, SpatialCore::Triangle(..));
        Some(if found.gap < -DEEP * self.scale && !facet { self.elsewhere(found) } else { found })
    }

    /// A better local best than the one found, if a look from the centres and from the sides shows one.
    fn elsewhere(&self, found: Separation<Spatial>) -> Separation<Spatial> {
        let n = found.normal;
        let (t, u) = (Spatial::tangent(n, 0), Spatial::tangent(n, 1));
        let starts = [self.between_centers(), n + t, n - t, n + u, n - u];
        let steps = starts.iter().filter_map(|d| d.normalized()).map(|d| self.moved_apart(&self.along(d)));
        let other = steps.reduce(|best, s| if s.gap > best.gap { s } else { best });
        let other = other.map_or(found, |s| self.refined(s));
        if other.gap > found.gap + SETTLED * self.scale { other } else { found }
    }

    /// The local best of s(n) near a direction.
    fn refined(&self, start: Separation<Spatial>) -> Separation<Spatial> {
        let mut best = start;
        for _ in 0..REFINEMENTS {
            let refined = self.moved_apart(&best);
            if refined.gap <= best.gap + SETTLED * self.scale {
                if !self.is_matched(&best) {
                    (best.on_a, best.on_b) = (refined.on_a, refined.on_a - best.normal * best.gap);
                }
                break;
            }
            best = self.further(&best, refined);
        }
        best
    }

    /// Goes on from a better direction the way it came, in doubling steps, while s(n) grows: deep inside, moving
    /// apart gains only a part of the way each time.
    fn further(&self, from: &Separation<Spatial>, to: Separation<Spatial>) -> Separation<Spatial> {
        let way = to.normal - from.normal;
        let (mut best, mut stride) = (to, 1.0);
        while let Some(unit) = (to.normal + way * stride).normalized() {
            let s = self.along(unit);
            if s.gap <= best.gap {
                break;
            }
            best = Separation { normal: unit, gap: s.gap, ..to };
            stride *= 2.0;
        }
        best
    }

    /// The distance direction of the cores after moving them apart along a direction, judged where they are.
    fn moved_apart(&self, from: &Separation<Spatial>) -> Separation<Spatial> {
        let clear = from.gap.abs().max(CLEAR * self.scale);
        let shift = from.normal * (clear - from.gap);
        let support = |d| self.corner(d, shift);
        match nearest(&support, from.normal, f64::INFINITY, self.scale) {
            Outcome::Apart(point, simplex) => {
                let (on_a, on_b) = simplex.witnesses();
                let unit = point * (1.0 / point.norm());
                let s = self.along(unit);
                Separation { on_a, on_b, ..s }
            }
            _ => *from,
        }
    }

    /// True when the witnesses face each other along the normal.
    fn is_matched(&self, s: &Separation<Spatial>) -> bool {
        (s.on_a - s.on_b - s.normal * s.gap).norm() <= 1e-12 * self.scale
    }

    /// The best of the directions that flat and straight parts of the two cores suggest.
    fn best_candidate(&self) -> Separation<Spatial> {
        let centers = self.between_centers();
        let best = Cell::new(self.along(centers.normalized().unwrap_or(vec3(0.0, 0.0, 1.0))));
        // cores that are their own mirror images about their centres overlap least on the side they are on
        let symmetric = is_symmetric(self.a) && is_symmetric(self.b);
        let consider = |direction: Vec3, meets: Meets| {
            let Some(unit) = direction.normalized() else { return };
            let unit = if unit.dot(centers) < 0.0 { -unit } else { unit };
            for normal in [unit, -unit].into_iter().take(if symmetric { 1 } else { 2 }) {
                let mut s = self.along(normal);
                match meets {
                    Meets::CornerOfA => s.on_b = s.on_a - normal * s.gap,
                    Meets::CornerOfB => s.on_a = s.on_b + normal * s.gap,
                    Meets::Unknown => {}
                }
                if s.gap > best.get().gap + ROUNDING * self.scale {
                    best.set(s);
                }
            }
        };
        let up = vec3(0.0, 0.0, 1.0);
        match (self.a, self.b) {
            (SpatialCore::Round(_), SpatialCore::Round(_)) => {
                let (axis, across) = (self.to_frame_a(up), |d: Vec3, axis: Vec3| d - axis * d.dot(axis));
                consider(up, Meets::CornerOfB);
                consider(axis, Meets::CornerOfA);
                for d in [up.cross(axis), across(centers, up), across(centers, axis)] {
                    consider(d, Meets::Unknown);
                }
            }
            (SpatialCore::Round(round), flat) => self.flat_candidates(round, flat, true, &consider),
            (flat, SpatialCore::Round(round)) => self.flat_candidates(round, flat, false, &consider),
            _ => {}
        }
        best.get()
    }

    /// Candidates of a curved and a flat core: the cap's axis, the flat core's faces, directions across the axis
    /// and an edge, normals of the side over each corner.
    fn flat_candidates(
        &self,
        round: &Round,
        flat: &SpatialCore,
        round_is_a: bool,
        consider: &dyn Fn(Vec3, Meets),
    ) {
        let Some(view) = flat.view() else { return };
        let up = vec3(0.0, 0.0, 1.0);
        // asked for in the round core's frame
        let out = |d: Vec3| if round_is_a { d } else { self.to_frame_a(d) };
        let into = |d: Vec3| if round_is_a { self.to_frame_a(d) } else { self.to_frame_b(d) };
        let place =
            |p: Vec3| if round_is_a { self.point_in_a(p) } else { self.to_frame_b(p - self.place.position) };
        let (of_round, of_flat) = if round_is_a {
            (Meets::CornerOfA, Meets::CornerOfB)
        } else {
            (Meets::CornerOfB, Meets::CornerOfA)
        };
        consider(out(up), of_flat);
        view.faces.iter().for_each(|f| consider(out(into(f.normal)), of_round));
        view.directions().for_each(|e| consider(out(into(e).cross(up)), Meets::Unknown));
        view.points.iter().for_each(|p| consider(out(round.side_normal(Round::radial(place(*p)))), of_flat));
    }
}

fn is_symmetric(core: &SpatialCore) -> bool {
    match core {
        SpatialCore::Round(round) => !round.apex,
        SpatialCore::Polytope(p) => p.half.is_some(),
        SpatialCore::Point(_) | SpatialCore::Segment(_) => true,
        SpatialCore::Triangle(..) => false,
    }
}
