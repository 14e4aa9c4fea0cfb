//! Which bodies may meet within a step: pairs whose reaches overlap. A reach is a guess that is checked: a body that
//! outgrows its own gets a larger one, and where that brings a pair that may have met, the step begins again.

use super::limits::Limits;
use crate::bodies::Bodies;
use crate::force::Wrench;
use crate::settings::Settings;
use carom_geometry::broad_phase::BroadPhase;
use carom_geometry::{Aabb, Geometry};
use carom_math::Column;

/// Margin of a first guess of a reach over the way at the present velocity and acceleration \[1\].
pub const MARGIN: f64 = 1.25;

/// The reach of a body that outgrew its own over the way that it came \[1\].
const GROWTH: f64 = 2.0;
/// A neighbour's reach over a body's own up to which the body keeps its own \[1\].
const LITTLE: f64 = 1.1;

/// Room around a body's box in which it may move before the search is made anew, over its reach, and over its size at most
/// \[1\].
const ROOM: (f64, f64) = (6.0, 1.0);

/// Pairs of bodies that may meet; holds memory, nothing that changes an answer.
#[derive(Default)]
pub struct Candidates<S: Geometry> {
    broad: BroadPhase<S>,
    bounds: Vec<Aabb<S>>,
    indices: Vec<usize>,
    movable: Vec<bool>,
    /// Boxes with room around those that the last search was made for, and their pairs, sorted.
    roomy: Vec<Aabb<S>>,
    near: Vec<(u32, u32)>,
    /// What the bodies of that search were, as `indices` and `movable`.
    searched: (Vec<usize>, Vec<bool>),
    /// The pairs, sorted.
    pub pairs: Vec<(usize, usize)>,
    /// For each body, where its pairs begin in `of`.
    starts: Vec<usize>,
    of: Vec<usize>,
}

/// How far the surface of each body may come in a step \[m\]: the first guess.
pub fn reaches<S: Geometry>(
    bodies: &Bodies<S>,
    settings: &Settings<S>,
    wrenches: &[Wrench<S>],
    dt: f64,
) -> Vec<f64> {
    let guess = |i: usize| {
        let d = &bodies.data[i];
        let linear = bodies.motion.velocity[i].norm();
        let spin = bodies.motion.angular_velocity[i].norm();
        let turning = if spin > 0.0 { d.turning_arm * spin } else { 0.0 };
        let pushed = if bodies.is_dynamic(i) {
            settings.gravity.norm() + wrenches[i].force.norm() * d.inverse_mass
        } else {
            0.0
        };
        MARGIN * (linear + turning + pushed * dt) * dt
    };
    (0..bodies.len()).map(guess).collect()
}

/// True for bodies that contacts may join.
fn may_meet<S: Geometry>(bodies: &Bodies<S>, i: usize, j: usize) -> bool {
    let (a, b) = (&bodies.data[i], &bodies.data[j]);
    let moves = a.inverse_mass > 0.0 || b.inverse_mass > 0.0;
    let groups = a.groups & b.collides_with != 0 && b.groups & a.collides_with != 0;
    moves && groups && !bodies.joints.keeps_apart(i, j)
}

/// The box of a body with a shape, around all that it may come to.
fn box_of<S: Geometry>(bodies: &Bodies<S>, i: usize, reach: f64, limits: &Limits) -> Aabb<S> {
    let d = &bodies.data[i];
    let collider = d.collider.as_ref().expect("a body with a shape");
    // pairs touch by the smaller body's size: an obstacle adds nothing
    let touching = if d.inverse_mass > 0.0 { limits.touching(d, d) } else { 0.0 };
    let room = reach + touching;
    match d.ball_radius {
        Some(radius) => Aabb::of_point(bodies.motion.position[i]).grown(radius).grown(room),
        None => S::bounds(collider, &bodies.shape_pose(i), room),
    }
}

impl<S: Geometry> Candidates<S> {
    /// Finds the pairs for a step's first guess of the reaches, which bodies that may meet share.
    pub fn begin(&mut self, bodies: &Bodies<S>, reaches: &mut [f64], limits: &Limits) {
        self.bound(bodies, reaches, limits);
        self.pair(bodies, reaches);
        let own = reaches.to_vec();
        self.share(bodies, &own, reaches);
        if own != reaches {
            for k in 0..self.indices.len() {
                let i = self.indices[k];
                if own[i] != reaches[i] {
                    self.bounds[k] = box_of(bodies, i, reaches[i], limits);
                }
            }
            self.pair(bodies, reaches);
        }
        self.sort_by_body(bodies.len());
    }

    /// Finds the pairs for these reaches.
    pub fn update(&mut self, bodies: &Bodies<S>, reaches: &[f64], limits: &Limits) {
        self.bound(bodies, reaches, limits);
        self.pair(bodies, reaches);
        self.sort_by_body(bodies.len());
    }

    /// Lays boxes around all bodies that have a shape.
    fn bound(&mut self, bodies: &Bodies<S>, reaches: &[f64], limits: &Limits) {
        self.bounds.clear();
        self.indices.clear();
        self.movable.clear();
        for (i, d) in bodies.data.iter().enumerate().filter(|(_, d)| d.collider.is_some()) {
            self.bounds.push(box_of(bodies, i, reaches[i], limits));
            self.indices.push(i);
            self.movable.push(d.inverse_mass > 0.0);
        }
    }

    /// Finds the pairs whose boxes overlap.
    fn pair(&mut self, bodies: &Bodies<S>, reaches: &[f64]) {
        self.search(bodies, reaches);
        let (indices, bounds) = (&self.indices, &self.bounds);
        let meet = |&&(i, j): &&(u32, u32)| {
            let (i, j) = (i as usize, j as usize);
            bounds[i].overlaps(&bounds[j]) && may_meet(bodies, indices[i], indices[j])
        };
        let found = self.near.iter().filter(meet);
        self.pairs.clear();
        self.pairs.extend(found.map(|&(i, j)| (indices[i as usize], indices[j as usize])));
    }

    /// Finds the pairs whose boxes overlap with room around them, unless all are still within that room.
    fn search(&mut self, bodies: &Bodies<S>, reaches: &[f64]) {
        let are_within = || self.bounds.iter().zip(&self.roomy).all(|(b, roomy)| roomy.contains(b));
        if self.searched.0 == self.indices && self.searched.1 == self.movable && are_within() {
            return;
        }
        self.searched.0.clone_from(&self.indices);
        self.searched.1.clone_from(&self.movable);
        let roomy = |(b, &i): (&Aabb<S>, &usize)| {
            let size = ROOM.1 * bodies.data[i].extent;
            b.grown((ROOM.0 * reaches[i]).min(size))
        };
        self.roomy.clear();
        self.roomy.extend(self.bounds.iter().zip(&self.indices).map(roomy));
        let found = self.broad.update(&self.roomy, &self.movable, &|_, _| true);
        self.near.clear();
        self.near.extend_from_slice(found);
    }

    fn sort_by_body(&mut self, bodies: usize) {
        self.starts.clear();
        self.starts.resize(bodies + 1, 0);
        for &(a, b) in &self.pairs {
            self.starts[a + 1] += 1;
            self.starts[b + 1] += 1;
        }
        for i in 0..bodies {
            self.starts[i + 1] += self.starts[i];
        }
        let mut next = self.starts.clone();
        self.of.clear();
        self.of.resize(2 * self.pairs.len(), 0);
        for (k, &(a, b)) in self.pairs.iter().enumerate() {
            for i in [a, b] {
                self.of[next[i]] = k;
                next[i] += 1;
            }
        }
    }

    /// What meets a body may make it as fast as itself: each reach becomes that of the farthest-reaching body which it
    /// may meet, where that is more than a little.
    fn share(&self, bodies: &Bodies<S>, own: &[f64], reaches: &mut [f64]) {
        for &(a, b) in &self.pairs {
            for (i, j) in [(a, b), (b, a)] {
                if bodies.is_dynamic(i) && own[j] > LITTLE * reaches[i] {
                    reaches[i] = own[j];
                }
            }
        }
    }

    /// Bodies that a body may meet as well once reaches are so much larger than those that the pairs were found for
    /// \[m\].
    pub fn newcomers(&self, bodies: &Bodies<S>, body: usize, more: impl Fn(usize) -> f64) -> Vec<usize> {
        let Ok(own) = self.indices.binary_search(&body) else { return Vec::new() };
        let grown = |k: usize| self.bounds[k].grown(more(self.indices[k]));
        let mine = grown(own);
        let is_known =
            |j: usize| self.of_body(body).iter().any(|&p| [self.pairs[p].0, self.pairs[p].1].contains(&j));
        let near = (0..self.bounds.len()).filter(|&k| k != own && mine.overlaps(&grown(k)));
        near.map(|k| self.indices[k]).filter(|&j| may_meet(bodies, body, j) && !is_known(j)).collect()
    }

    /// Larger reaches for bodies that outgrew theirs by coming so far \[m\], and for those near them: what made one fast
    /// may make its neighbours so. In the end they are without bound.
    pub fn grow(&self, bodies: &Bodies<S>, reaches: &mut [f64], outgrown: &[(usize, f64)], at_last: bool) {
        for &(i, way) in outgrown {
            let grown = if at_last { f64::MAX } else { GROWTH * way };
            let near = self.of_body(i).iter().flat_map(|&p| [self.pairs[p].0, self.pairs[p].1]);
            for j in near.chain([i]).filter(|&j| bodies.is_dynamic(j)) {
                reaches[j] = reaches[j].max(grown);
            }
        }
    }

    /// The pairs of a body, by index, ascending.
    pub fn of_body(&self, body: usize) -> &[usize] {
        &self.of[self.starts[body]..self.starts[body + 1]]
    }
}
