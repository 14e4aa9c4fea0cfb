//! Which bodies may meet within a step: sets of movable bodies whose reaches overlap, with the obstacles in their
//! way. Each set is advanced by itself, so that the cost of an event is that of its set. A reach is a guess that is
//! checked: a body that outgrows its own gets a larger one, and the step begins again.

use crate::bodies::Bodies;
use crate::force::Wrench;
use crate::settings::Settings;
use carom_geometry::broad_phase::BroadPhase;
use carom_geometry::{Aabb, Geometry};
use carom_math::Column;
use carom_solver::Partition;

/// Bodies that may meet, by their indices in the world.
#[derive(Clone, Debug, Default)]
pub struct Group {
    /// Movable bodies and the obstacles near them, ascending.
    pub bodies: Vec<usize>,
    /// Pairs that may meet, as indices into `bodies`, sorted.
    pub pairs: Vec<(usize, usize)>,
}

/// Memory of the search.
#[derive(Default)]
pub struct Groups<S: Geometry> {
    broad: BroadPhase<S>,
    bounds: Vec<Aabb<S>>,
    indices: Vec<usize>,
    movable: Vec<bool>,
}

/// Margin of a first guess of a reach over the way at the present velocity and acceleration \[1\].
const MARGIN: f64 = 1.25;

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

impl<S: Geometry> Groups<S> {
    /// The groups for these reaches, in order of their first bodies. Bodies without a shape are groups of their own.
    pub fn find(&mut self, bodies: &Bodies<S>, reaches: &[f64], touching: f64) -> Vec<Group> {
        self.bounds.clear();
        self.indices.clear();
        self.movable.clear();
        for (i, d) in bodies.data.iter().enumerate() {
            let Some(collider) = &d.collider else { continue };
            self.bounds.push(S::bounds(collider, &bodies.shape_pose(i), reaches[i] + touching));
            self.indices.push(i);
            self.movable.push(d.inverse_mass > 0.0);
        }
        let (data, indices) = (&bodies.data, &self.indices);
        let may_pair = |i: usize, j: usize| {
            let (a, b) = (&data[indices[i]], &data[indices[j]]);
            let moves = a.inverse_mass > 0.0 || b.inverse_mass > 0.0;
            moves && a.groups & b.collides_with != 0 && b.groups & a.collides_with != 0
        };
        let found = self.broad.update(&self.bounds, &self.movable, &may_pair);
        let pairs: Vec<(usize, usize)> =
            found.iter().map(|&(i, j)| (indices[i as usize], indices[j as usize])).collect();
        grouped(bodies, &pairs)
    }
}

/// Sorts pairs into groups.
fn grouped<S: Geometry>(bodies: &Bodies<S>, pairs: &[(usize, usize)]) -> Vec<Group> {
    let mut sets = Partition::default();
    sets.reset(bodies.len());
    for &(a, b) in pairs {
        if bodies.is_dynamic(a) && bodies.is_dynamic(b) {
            sets.join(a, b);
        }
    }
    let mut number = vec![usize::MAX; bodies.len()];
    let mut groups: Vec<Group> = Vec::new();
    for i in (0..bodies.len()).filter(|&i| bodies.is_dynamic(i)) {
        let root = sets.root(i);
        if number[root] == usize::MAX {
            number[root] = groups.len();
            groups.push(Group::default());
        }
        groups[number[root]].bodies.push(i);
    }
    let mut mine: Vec<Vec<(usize, usize)>> = vec![Vec::new(); groups.len()];
    for &(a, b) in pairs {
        let mover = if bodies.is_dynamic(a) { a } else { b };
        let g = number[sets.root(mover)];
        mine[g].push((a, b));
        groups[g].bodies.extend([a, b].into_iter().filter(|&i| !bodies.is_dynamic(i)));
    }
    for (group, pairs) in groups.iter_mut().zip(mine) {
        group.bodies.sort_unstable();
        group.bodies.dedup();
        let local = |i: usize| group.bodies.binary_search(&i).expect("a pair's bodies are in its group");
        group.pairs = pairs.into_iter().map(|(a, b)| (local(a), local(b))).collect();
    }
    groups
}
