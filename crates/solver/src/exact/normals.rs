//! W and q of the normals alone, for contacts without friction: W_ij = J_i M^-1 J_j^T over the bodies that two contacts
//! share, q = J v - target. Contacts stand in the order in which a walk over the bodies comes to them (Cuthill and McKee
//! 1969), so that those who share a body are near each other. Knows no method.

use crate::problem::{Contact, ContactProblem, InverseMass};
use carom_math::{Column, Inertia, Space};

/// A contact's normal row on one of its bodies: a direction with its sign, its moment, and what the inverse inertia makes of that.
#[derive(Clone, Copy, Debug)]
struct Side<S: Space> {
    body: u32,
    direction: S::Vector,
    moment: S::Spin,
    turn: S::Spin,
}

impl<S: Space> Side<S> {
    /// The row of a contact on a body, with its share of the diagonal of W and of the normal velocity.
    #[inline(always)]
    fn of(
        problem: &ContactProblem<S>,
        body: usize,
        arm: S::Vector,
        direction: S::Vector,
    ) -> (Side<S>, f64, f64) {
        let (mass, v) = (&problem.inverse_masses[body], &problem.velocities[body]);
        let moment = S::moment(arm, direction);
        let turn = mass.angular.apply(moment);
        let own = mass.linear * direction.norm_squared() + moment.dot(turn);
        let normal = direction.dot(v.linear) + moment.dot(v.angular);
        (Side { body: body as u32, direction, moment, turn }, own, normal)
    }
}

/// W by rows, q, and the order of the contacts.
#[derive(Clone, Debug, Default)]
pub struct Normals<S: Space> {
    /// The contact of the problem in each place.
    pub order: Vec<u32>,
    /// The diagonal of W \[1/kg\].
    pub diagonal: Vec<f64>,
    /// q \[m/s\].
    pub velocity: Vec<f64>,
    /// Where each row of W starts; columns are places, and one may come twice.
    starts: Vec<u32>,
    columns: Vec<u32>,
    values: Vec<f64>,
    sides: Vec<[Side<S>; 2]>,
    /// For each body, where its contacts begin in `touching`; for none that stands.
    bodies: Vec<u32>,
    touching: Vec<u32>,
    place: Vec<u32>,
    is_seen: Vec<bool>,
    /// The last contact of each set that hangs together, as a walk comes to them.
    ends: Vec<u32>,
    /// The root of each body's inverse mass.
    roots: Vec<f64>,
    graph: Graph,
}

/// Who touches whom, which contacts are asked for, and which bodies stand.
#[derive(Clone, Debug, Default)]
struct Graph {
    pairs: Vec<(u32, u32)>,
    asked: Vec<bool>,
    is_fixed: Vec<bool>,
}

/// No place yet.
const NONE: u32 = u32::MAX;

impl<S: Space> Normals<S> {
    /// Takes the contacts that are asked for of a problem with contacts alone.
    pub fn update(&mut self, problem: &ContactProblem<S>, asked: &[bool]) {
        if !self.is_known(problem, asked) {
            self.find_touching(problem);
            // each set that hangs together from where a first walk through it ends
            self.walk(problem, 0..asked.len());
            let ends = std::mem::take(&mut self.ends);
            self.walk(problem, ends.iter().map(|&k| k as usize));
            self.ends = ends;
            self.turn_round();
        }
        self.find_sides(problem);
        self.couple();
    }
    /// Number of contacts.
    pub fn count(&self) -> usize {
        self.order.len()
    }
    /// A row of W off the diagonal: places and values.
    #[inline(always)]
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> {
        let row = self.starts[i] as usize..self.starts[i + 1] as usize;
        self.columns[row.clone()].iter().zip(&self.values[row]).map(|(j, w)| (*j as usize, *w))
    }
    /// Entry i of W z + q.
    #[inline(always)]
    pub fn velocity_after(&self, i: usize, z: &[f64]) -> f64 {
        let others: f64 = self.row(i).map(|(j, w)| w * z[j]).sum();
        self.velocity[i] + self.diagonal[i] * z[i] + others
    }

    /// True where the graph is that of the problem before: the order and who touches whom stand. Takes it in otherwise.
    fn is_known(&mut self, problem: &ContactProblem<S>, now_asked: &[bool]) -> bool {
        let Graph { pairs, asked, is_fixed } = &mut self.graph;
        let now = problem.contacts.iter().map(|c| (c.a as u32, c.b as u32));
        let fixed = problem.inverse_masses.iter().map(InverseMass::is_fixed);
        let is_same = now_asked == *asked && now.clone().eq(pairs.iter().copied());
        if is_same && fixed.clone().eq(is_fixed.iter().copied()) {
            return true;
        }
        asked.clear();
        asked.extend_from_slice(now_asked);
        pairs.clear();
        pairs.extend(now);
        is_fixed.clear();
        is_fixed.extend(fixed);
        false
    }

    /// Contacts of each body that can move.
    fn find_touching(&mut self, problem: &ContactProblem<S>) {
        let count = problem.inverse_masses.len();
        let moves = |body: &usize| !problem.inverse_masses[*body].is_fixed();
        let bodies = &mut self.bodies;
        bodies.clear();
        bodies.resize(count + 2, 0);
        // one place further than it begins: filling brings each to its own
        let sides = |c: &Contact<S>| [c.a, c.b].into_iter().filter(moves);
        let contacts = || problem.contacts.iter().enumerate().filter(|(k, _)| self.graph.asked[*k]);
        contacts().flat_map(|(_, c)| sides(c)).for_each(|b| bodies[b + 2] += 1);
        (2..count + 2).for_each(|b| bodies[b] += bodies[b - 1]);
        self.touching.clear();
        self.touching.resize(bodies[count + 1] as usize, 0);
        for (k, c) in contacts() {
            for b in sides(c) {
                self.touching[bodies[b + 1] as usize] = k as u32;
                bodies[b + 1] += 1;
            }
        }
    }

    /// Puts the contacts in the order in which walks come to them that begin at these, and notes where each walk ends.
    fn walk(&mut self, problem: &ContactProblem<S>, from: impl Iterator<Item = usize>) {
        let Normals { order, place, is_seen, bodies, touching, graph, ends, .. } = self;
        order.clear();
        ends.clear();
        place.clear();
        place.resize(problem.contacts.len(), NONE);
        is_seen.clear();
        is_seen.resize(problem.inverse_masses.len(), false);
        let mut next = 0;
        for first in from {
            if place[first] != NONE || !graph.asked[first] {
                continue;
            }
            place[first] = order.len() as u32;
            order.push(first as u32);
            while next < order.len() {
                let c = &problem.contacts[order[next] as usize];
                next += 1;
                for b in [c.a, c.b] {
                    if std::mem::replace(&mut is_seen[b], true) {
                        continue;
                    }
                    for &k in &touching[bodies[b] as usize..bodies[b + 1] as usize] {
                        if place[k as usize] == NONE {
                            place[k as usize] = order.len() as u32;
                            order.push(k);
                        }
                    }
                }
            }
            ends.extend(order.last());
        }
    }

    /// The order backwards: the envelope of all contacts is never larger, and mostly smaller (George and Liu 1981).
    fn turn_round(&mut self) {
        self.order.reverse();
        for (place, &k) in self.order.iter().enumerate() {
            self.place[k as usize] = place as u32;
        }
    }

    /// Rows on bodies, the diagonal of W, and q.
    fn find_sides(&mut self, problem: &ContactProblem<S>) {
        let Normals { order, sides, diagonal, velocity, roots, .. } = self;
        roots.clear();
        roots.extend(problem.inverse_masses.iter().map(|mass| mass.linear.sqrt()));
        sides.clear();
        diagonal.clear();
        velocity.clear();
        for &k in order.iter() {
            let c = &problem.contacts[k as usize];
            let (a, own_a, normal_a) = Side::of(problem, c.a, c.arm_a, c.normal);
            let (b, own_b, normal_b) = Side::of(problem, c.b, c.arm_b, -c.normal);
            diagonal.push(own_a + own_b);
            velocity.push(normal_a + normal_b - c.target);
            // of what the couplings need, the masses go into the directions
            let weighed =
                |side: Side<S>| Side { direction: side.direction * roots[side.body as usize], ..side };
            sides.push([weighed(a), weighed(b)]);
        }
    }

    /// The rows of W.
    fn couple(&mut self) {
        let Normals { order, place, sides, bodies, touching, starts, columns, values, .. } = self;
        let of_body = |b: u32| bodies[b as usize] as usize..bodies[b as usize + 1] as usize;
        // one place further than a row begins: filling brings each to its own
        starts.clear();
        starts.extend([0, 0]);
        let mut end = 0;
        for sides in sides.iter() {
            let others = |side: &Side<S>| of_body(side.body).len().saturating_sub(1);
            end += others(&sides[0]) + others(&sides[1]);
            starts.push(end as u32);
        }
        columns.clear();
        columns.resize(end, 0);
        values.clear();
        values.resize(end, 0.0);
        for i in 0..order.len() {
            for mine in &sides[i] {
                for &k in &touching[of_body(mine.body)] {
                    let j = place[k as usize] as usize;
                    if j <= i {
                        continue;
                    }
                    let other = &sides[j][usize::from(sides[j][0].body != mine.body)];
                    let value = mine.direction.dot(other.direction) + mine.moment.dot(other.turn);
                    for (row, column) in [(i, j), (j, i)] {
                        let at = starts[row + 1] as usize;
                        (columns[at], values[at]) = (column as u32, value);
                        starts[row + 1] += 1;
                    }
                }
            }
        }
    }
}
