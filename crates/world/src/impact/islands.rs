//! Which contacts hang together: sets of bodies joined by contacts, obstacles joining nothing (they do not move,
//! so no blow passes through them). Knows no velocities.

use crate::bodies::Bodies;
use carom_geometry::Geometry;

/// A partition of the bodies, with a mark per part.
pub struct Islands {
    parent: Vec<usize>,
    marked: Vec<bool>,
}

impl Islands {
    /// The partition that pairs of bodies make.
    pub fn of<S: Geometry>(bodies: &Bodies<S>, pairs: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut islands = Islands { parent: (0..bodies.len()).collect(), marked: vec![false; bodies.len()] };
        for (a, b) in pairs {
            if bodies.is_dynamic(a) && bodies.is_dynamic(b) {
                let (a, b) = (islands.root(a), islands.root(b));
                // the smaller index stays the root: the same partition in any order of the pairs
                islands.parent[a.max(b)] = a.min(b);
            }
        }
        islands
    }
    /// The body that stands for a body's island.
    pub fn root(&mut self, mut body: usize) -> usize {
        while self.parent[body] != body {
            self.parent[body] = self.parent[self.parent[body]];
            body = self.parent[body];
        }
        body
    }
    /// The island of a contact: that of its body that moves.
    pub fn of_contact<S: Geometry>(&mut self, bodies: &Bodies<S>, a: usize, b: usize) -> usize {
        self.root(if bodies.is_dynamic(a) { a } else { b })
    }
    /// Marks a contact's island.
    pub fn mark<S: Geometry>(&mut self, bodies: &Bodies<S>, a: usize, b: usize) {
        let root = self.of_contact(bodies, a, b);
        self.marked[root] = true;
    }
    /// True when a contact's island is marked.
    pub fn is_marked<S: Geometry>(&mut self, bodies: &Bodies<S>, a: usize, b: usize) -> bool {
        let root = self.of_contact(bodies, a, b);
        self.marked[root]
    }
}
