//! The joints of a world, or of some of its bodies.

use super::frame::{Frame, Joint};
use crate::bodies::Bodies;
use crate::error::BuildError;
use carom_geometry::Geometry;
use carom_math::Space;
use carom_solver::{BoundedRow, ContactProblem};

/// Joints between bodies, in the order in which they were added.
#[derive(Clone, Debug, Default)]
pub struct Joints<S: Space> {
    /// The joints.
    pub all: Vec<Joint<S>>,
    /// Their names.
    pub names: Vec<String>,
    /// Numbers of the joints in the list that these were taken out of; empty for a world's own.
    pub numbers: Vec<usize>,
    /// For each body the joints that name it.
    of_body: Vec<Vec<usize>>,
    /// Pairs of bodies that do not collide with each other, ascending.
    apart: Vec<(usize, usize)>,
    pub(crate) serials: u64,
}

impl<S: Space> Joints<S> {
    /// Number of joints.
    pub fn len(&self) -> usize {
        self.all.len()
    }
    /// True when there are none.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }
    /// Index of a named joint.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }
    /// The joints that name a body.
    pub fn of_body(&self, body: usize) -> &[usize] {
        self.of_body.get(body).map_or(&[], Vec::as_slice)
    }
    /// True when a joint keeps two bodies from colliding with each other.
    pub fn keeps_apart(&self, a: usize, b: usize) -> bool {
        !self.apart.is_empty() && self.apart.binary_search(&(a.min(b), a.max(b))).is_ok()
    }
    /// True when joints keep no two bodies from colliding with each other.
    pub fn keep_nobody_apart(&self) -> bool {
        self.apart.is_empty()
    }
    /// The error for a name that no joint has.
    pub fn unknown(&self, name: &str) -> BuildError {
        let near = crate::bodies::nearest(self.names.iter(), name);
        let remedy = near.map_or("the world has no joints yet".into(), |n| format!("did you mean '{n}'?"));
        BuildError::joint(name, "name", "is not in this world", remedy)
    }
    /// Adds a joint that has been checked.
    pub(crate) fn push(&mut self, name: &str, joint: Joint<S>) {
        self.all.push(joint);
        self.names.push(name.into());
        self.index();
    }
    /// Removes a joint.
    pub(crate) fn remove(&mut self, number: usize) {
        self.all.remove(number);
        self.names.remove(number);
        self.index();
    }
    /// A body that no joint names is gone: those after it move up.
    pub(crate) fn forget_body(&mut self, body: usize) {
        let up = |i: &mut usize| *i -= usize::from(*i > body);
        for joint in &mut self.all {
            up(&mut joint.a);
            joint.b.iter_mut().for_each(up);
        }
        self.index();
    }
    fn index(&mut self) {
        let bodies = self.all.iter().flat_map(|j| [j.a, j.b.unwrap_or(j.a)]).max().map_or(0, |i| i + 1);
        self.of_body = vec![Vec::new(); bodies];
        self.apart.clear();
        for (k, j) in self.all.iter().enumerate() {
            self.of_body[j.a].push(k);
            if let Some(b) = j.b {
                self.of_body[b].push(k);
                if !j.collide {
                    self.apart.push((j.a.min(b), j.a.max(b)));
                }
            }
        }
        self.apart.sort_unstable();
        self.apart.dedup();
    }
    /// The joints all of whose bodies are among some (ascending), in their indices.
    pub(crate) fn some(&self, bodies: &[usize]) -> Joints<S> {
        let mut joints = Joints { serials: self.serials, ..Joints::default() };
        if self.is_empty() {
            return joints;
        }
        let mut numbers: Vec<usize> = bodies.iter().flat_map(|&i| self.of_body(i)).copied().collect();
        numbers.sort_unstable();
        numbers.dedup();
        for number in numbers {
            let mut joint = self.all[number];
            let Ok(a) = bodies.binary_search(&joint.a) else { continue };
            joint.a = a;
            if let Some(b) = joint.b {
                let Ok(b) = bodies.binary_search(&b) else { continue };
                joint.b = Some(b);
            }
            joints.all.push(joint);
            joints.numbers.push(number);
        }
        joints.index();
        joints
    }
    /// Scalar rows of all joints.
    pub fn rows(&self) -> usize {
        self.all.iter().map(Joint::rows).sum()
    }
}

impl<S: Geometry> Bodies<S> {
    /// Errors g of all joints at the present poses, row by row \[m\].
    pub fn joint_errors(&self) -> Vec<f64> {
        let mut errors = Vec::new();
        self.joints.all.iter().for_each(|j| j.errors(&self.motion, &mut errors));
        errors
    }
    /// Largest error of the joints over their size \[1\].
    pub fn torn(&self) -> f64 {
        let mut errors = Vec::new();
        let of = |j: &Joint<S>| {
            errors.clear();
            j.errors(&self.motion, &mut errors);
            errors.iter().fold(0.0, |m: f64, e| m.max(e.abs())) / j.size
        };
        self.joints.all.iter().map(of).fold(0.0, f64::max)
    }
    /// Where all joints act now.
    pub fn joint_frames(&self) -> Vec<Frame<S>> {
        self.joints.all.iter().map(|j| j.frame(self)).collect()
    }
    /// Appends the rows of all joints at these frames to a problem, asking for these velocities.
    pub fn push_joints(&self, frames: &[Frame<S>], targets: &[f64], problem: &mut ContactProblem<S>) {
        let first = problem.rows.len();
        for (j, frame) in self.joints.all.iter().zip(frames) {
            j.push_rows(&self.motion, frame, &mut problem.rows);
        }
        for (row, target) in problem.rows[first..].iter_mut().zip(targets) {
            row.target = *target;
        }
    }
    /// Pairs of movable bodies that a joint joins.
    pub fn jointed(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let moves = |i: usize| self.is_dynamic(i);
        let pair = move |j: &Joint<S>| j.b.filter(|&b| moves(j.a) && moves(b)).map(|b| (j.a, b));
        self.joints.all.iter().filter_map(pair)
    }
}

/// A body of a joint that moves.
pub(crate) fn mover<S: Geometry>(bodies: &Bodies<S>, j: &Joint<S>) -> usize {
    match j.b {
        Some(b) if !bodies.is_dynamic(j.a) => b,
        _ => j.a,
    }
}

/// The rows of one joint.
pub fn rows_of<'a, S: Space>(
    rows: &'a [BoundedRow<S>],
    first: &mut usize,
    j: &Joint<S>,
) -> &'a [BoundedRow<S>] {
    let from = *first;
    *first += j.rows();
    &rows[from..*first]
}
