//! Which contacts and rows hang together: sets of movable bodies that they join. Obstacles join nothing: they do
//! not move, so nothing passes through them, and each island can be solved by itself. Knows no velocities.

use crate::problem::{ContactProblem, Impulses};
use crate::resistance::Resistance;
use carom_math::Space;

/// A partition of bodies; the smallest index of a set stands for it, in whatever order pairs were joined.
#[derive(Clone, Debug, Default)]
pub struct Partition {
    parent: Vec<usize>,
}

impl Partition {
    /// Starts anew with every body by itself.
    pub fn reset(&mut self, bodies: usize) {
        self.parent.clear();
        self.parent.extend(0..bodies);
    }
    /// Makes one set of two bodies' sets.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b);
    }
    /// The body that stands for a body's set.
    pub fn root(&mut self, mut body: usize) -> usize {
        while self.parent[body] != body {
            self.parent[body] = self.parent[self.parent[body]];
            body = self.parent[body];
        }
        body
    }
}

/// Lists of indices, one per island, one after another.
#[derive(Clone, Debug, Default)]
struct Members {
    starts: Vec<usize>,
    all: Vec<usize>,
}

impl Members {
    /// Sorts entries into islands, keeping their order.
    fn update(&mut self, islands: usize, island_of: impl Iterator<Item = usize> + Clone) {
        self.starts.clear();
        self.starts.resize(islands + 1, 0);
        island_of.clone().for_each(|i| self.starts[i + 1] += 1);
        for i in 0..islands {
            self.starts[i + 1] += self.starts[i];
        }
        self.all.clear();
        self.all.resize(self.starts[islands], 0);
        for (k, i) in island_of.enumerate() {
            self.all[self.starts[i]] = k;
            self.starts[i] += 1;
        }
        // every start has moved to its island's end, which is the next one's start
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }
    fn of(&self, island: usize) -> &[usize] {
        &self.all[self.starts[island]..self.starts[island + 1]]
    }
}

/// The islands of a contact problem, numbered by their first entry (contacts before rows).
#[derive(Clone, Debug, Default)]
pub struct Islands {
    partition: Partition,
    /// Island of each root.
    number: Vec<usize>,
    of_contact: Vec<usize>,
    of_row: Vec<usize>,
    contacts: Members,
    rows: Members,
    /// Movable bodies of each island, and the smallest index among them.
    bodies: Vec<(usize, usize)>,
    known: Graph,
}

/// What islands depend on: whom contacts and rows join, how many of these are contacts, and which bodies move.
#[derive(Clone, Debug, Default)]
struct Graph {
    pairs: Vec<(u32, u32)>,
    contacts: usize,
    moves: Vec<bool>,
}

impl Graph {
    /// Takes in a problem's; true where it is as it was.
    fn stands<S: Space>(&mut self, problem: &ContactProblem<S>) -> bool {
        let of_contacts = problem.contacts.iter().map(|c| (c.a as u32, c.b as u32));
        let now = of_contacts.chain(problem.rows.iter().map(|r| (r.a as u32, r.b as u32)));
        let moves = problem.inverse_masses.iter().map(|mass| !mass.is_fixed());
        let Graph { pairs, contacts, moves: moved } = self;
        if *contacts == problem.contacts.len()
            && now.clone().eq(pairs.iter().copied())
            && moves.clone().eq(moved.iter().copied())
        {
            return true;
        }
        *contacts = problem.contacts.len();
        pairs.clear();
        pairs.extend(now);
        moved.clear();
        moved.extend(moves);
        false
    }
}

/// Bodies that belong to no island.
const NONE: usize = usize::MAX;

impl Islands {
    /// The islands of a problem.
    pub fn of<S: Space>(problem: &ContactProblem<S>) -> Self {
        let mut islands = Islands::default();
        islands.update(problem);
        islands
    }
    /// Finds the islands of a problem, reusing memory; they stand while the problem joins the same bodies.
    pub fn update<S: Space>(&mut self, problem: &ContactProblem<S>) {
        if self.known.stands(problem) {
            return;
        }
        let known = std::mem::take(&mut self.known);
        self.find(problem, &known.moves);
        self.known = known;
    }

    fn find<S: Space>(&mut self, problem: &ContactProblem<S>, moves: &[bool]) {
        let moves = |i: usize| moves[i];
        let pairs = problem.contacts.iter().map(|c| (c.a, c.b));
        let pairs = pairs.chain(problem.rows.iter().map(|r| (r.a, r.b)));
        let bodies = problem.inverse_masses.len();
        self.partition.reset(bodies);
        pairs.clone().filter(|&(a, b)| moves(a) && moves(b)).for_each(|(a, b)| self.partition.join(a, b));
        self.number.clear();
        self.number.resize(bodies, NONE);
        self.of_contact.clear();
        self.of_row.clear();
        let mut count = 0;
        for (k, (a, b)) in pairs.enumerate() {
            let root = self.partition.root(if moves(a) { a } else { b });
            if self.number[root] == NONE {
                self.number[root] = count;
                count += 1;
            }
            let list = if k < problem.contacts.len() { &mut self.of_contact } else { &mut self.of_row };
            list.push(self.number[root]);
        }
        self.contacts.update(count, self.of_contact.iter().copied());
        self.rows.update(count, self.of_row.iter().copied());
        self.bodies.clear();
        self.bodies.resize(count, (0, NONE));
        for body in (0..bodies).filter(|&i| moves(i)) {
            if let Some(island) = self.of_body(body) {
                let (number, first) = &mut self.bodies[island];
                *number += 1;
                *first = body.min(*first);
            }
        }
    }
    /// Number of islands.
    pub fn count(&self) -> usize {
        self.bodies.len()
    }
    /// Contacts of an island, ascending.
    pub fn contacts(&self, island: usize) -> &[usize] {
        self.contacts.of(island)
    }
    /// Bounded rows of an island, ascending.
    pub fn rows(&self, island: usize) -> &[usize] {
        self.rows.of(island)
    }
    /// Number of movable bodies of an island, and the smallest index among them.
    pub fn bodies(&self, island: usize) -> (usize, usize) {
        self.bodies[island]
    }
    /// Island of a movable body; `None` for one that nothing touches.
    pub fn of_body(&mut self, body: usize) -> Option<usize> {
        let root = self.partition.root(body);
        Some(self.number[root]).filter(|&island| island != NONE)
    }
    /// Island of a contact.
    pub fn of_contact(&self, contact: usize) -> usize {
        self.of_contact[contact]
    }
    /// Island of a bounded row.
    pub fn of_row(&self, row: usize) -> usize {
        self.of_row[row]
    }
}

/// One island as a problem of its own, over its own bodies and the obstacles that it touches.
#[derive(Clone, Debug)]
pub struct Part<S: Space> {
    /// The island's problem; entries keep their order.
    pub problem: ContactProblem<S>,
    /// Its impulses.
    pub impulses: Impulses<S>,
    /// Body of the whole problem for each of its bodies.
    pub bodies: Vec<usize>,
    /// Resistance of the whole problem for each of its resistances.
    resistances: Vec<usize>,
    /// Where each body of the whole problem went, and in which extraction.
    place: Vec<(usize, usize)>,
    extraction: usize,
}

impl<S: Space> Default for Part<S> {
    fn default() -> Self {
        let problem = ContactProblem::new(Vec::new(), Vec::new());
        let impulses = Impulses::zero(&problem);
        Part {
            problem,
            impulses,
            bodies: Vec::new(),
            resistances: Vec::new(),
            place: Vec::new(),
            extraction: 0,
        }
    }
}

impl<S: Space> Part<S> {
    /// Takes an island and its impulses out of a problem, reusing memory.
    pub fn take(
        &mut self,
        whole: &ContactProblem<S>,
        impulses: &Impulses<S>,
        islands: &Islands,
        island: usize,
    ) {
        self.extraction += 1;
        self.place.resize(whole.inverse_masses.len(), (0, 0));
        self.bodies.clear();
        self.resistances.clear();
        let part = &mut self.problem;
        part.friction_law = whole.friction_law;
        part.inverse_masses.clear();
        part.velocities.clear();
        part.contacts.clear();
        part.rows.clear();
        part.resistances.clear();
        self.impulses.contacts.clear();
        self.impulses.rows.clear();
        self.impulses.moments.clear();
        for &k in islands.contacts(island) {
            let mut contact = whole.contacts[k];
            (contact.a, contact.b) = (self.place(whole, contact.a), self.place(whole, contact.b));
            self.problem.contacts.push(contact);
            self.impulses.contacts.push(impulses.contacts[k]);
            if let Ok(at) = whole.resistances.binary_search_by_key(&k, |r| r.contact) {
                let contact = self.problem.contacts.len() - 1;
                self.problem.resistances.push(Resistance { contact, ..whole.resistances[at] });
                self.impulses.moments.push(impulses.moments[at]);
                self.resistances.push(at);
            }
        }
        for &k in islands.rows(island) {
            let mut row = whole.rows[k];
            (row.a, row.b) = (self.place(whole, row.a), self.place(whole, row.b));
            self.problem.rows.push(row);
            self.impulses.rows.push(impulses.rows[k]);
        }
    }
    /// Index of a body in the part; it is added when it is new there.
    fn place(&mut self, whole: &ContactProblem<S>, body: usize) -> usize {
        if self.place[body].0 != self.extraction {
            self.place[body] = (self.extraction, self.bodies.len());
            self.bodies.push(body);
            self.problem.inverse_masses.push(whole.inverse_masses[body]);
            self.problem.velocities.push(whole.velocities[body]);
        }
        self.place[body].1
    }
    /// Puts the part's impulses back into those of the whole.
    pub fn give(&self, impulses: &mut Impulses<S>, islands: &Islands, island: usize) {
        give((&self.impulses, &self.resistances), impulses, islands, island);
    }
}

/// Impulses of an island, for who puts them back later.
#[derive(Clone, Debug, Default)]
pub struct Answer<S: Space> {
    impulses: Impulses<S>,
    /// Resistance of the whole problem for each of the island's.
    resistances: Vec<usize>,
}

impl<S: Space> Answer<S> {
    /// Takes over the impulses of the island that was taken out.
    pub fn copy_from(&mut self, part: &Part<S>) {
        self.impulses.copy_from(&part.impulses);
        self.resistances.clone_from(&part.resistances);
    }
    /// Puts them back into those of the whole.
    pub fn give(&self, impulses: &mut Impulses<S>, islands: &Islands, island: usize) {
        give((&self.impulses, &self.resistances), impulses, islands, island);
    }
}

fn give<S: Space>(
    (own, resistances): (&Impulses<S>, &[usize]),
    impulses: &mut Impulses<S>,
    islands: &Islands,
    island: usize,
) {
    for (&k, g) in islands.contacts(island).iter().zip(&own.contacts) {
        impulses.contacts[k] = *g;
    }
    for (&k, &l) in islands.rows(island).iter().zip(&own.rows) {
        impulses.rows[k] = l;
    }
    for (&k, &m) in resistances.iter().zip(&own.moments) {
        impulses.moments[k] = m;
    }
}
