//! The constraint functions of joints and their rows, in body poses and nothing else:
//!   point     g = p_a - p_b, p = x + R r;
//!   distance  g = |p_a - p_b| - length;
//!   fixed     g = p_a - p_b, and u times the rotation vector of R_a (R_b Q)^-1, u a length that makes it metres.
//! Rows of points act at one point c of both bodies, half-way between p_a and p_b, or on an obstacle's; those of a distance
//! along the line through both: equal and opposite forces keep the angular momentum.

use crate::bodies::{Bodies, Motion};
use carom_geometry::Geometry;
use carom_math::{Column, Rotation, Space};
use carom_solver::{BoundedRow, Twist};
use serde::{Deserialize, Serialize};

/// What a joint holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointKind {
    /// A point of a at a point of b: a hinge in the plane, a ball joint in space.
    Point,
    /// The distance of two points.
    Distance,
    /// The relative pose.
    Fixed,
}

impl JointKind {
    /// The name as users write it.
    pub fn name(self) -> &'static str {
        match self {
            JointKind::Point => "point",
            JointKind::Distance => "distance",
            JointKind::Fixed => "fixed",
        }
    }
    /// Scalar rows.
    pub fn rows<S: Space>(self) -> usize {
        match self {
            JointKind::Point => S::DIM,
            JointKind::Distance => 1,
            JointKind::Fixed => S::DIM + S::SPIN,
        }
    }
}

/// A joint between bodies given by their index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint<S: Space> {
    /// What it holds.
    pub kind: JointKind,
    /// Index of body a.
    pub a: usize,
    /// Index of body b; `None`: the world itself.
    pub b: Option<usize>,
    /// From a's centre of mass to the anchor, in a's axes \[m\].
    pub anchor_a: S::Vector,
    /// From b's centre of mass to the anchor, in b's axes; with the world the place itself \[m\].
    pub anchor_b: S::Vector,
    /// Length of a distance joint \[m\]; 0 for others.
    pub length: f64,
    /// Rotation of a in b's axes that a fixed joint holds.
    pub rotation: S::Rotation,
    /// True when the bodies collide with each other.
    pub collide: bool,
    /// Length that makes angles displacements, about the radius of gyration \[m\].
    pub unit: f64,
    /// Size that errors are measured by \[m\].
    pub size: f64,
    /// Never used twice in a world; names the joint's rows.
    pub serial: u64,
}

/// Where a joint acts at given poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<S: Space> {
    /// Where its force acts on a \[m\].
    pub on_a: S::Vector,
    /// Where its force acts on b \[m\].
    pub on_b: S::Vector,
    /// Unit vector of a distance joint from b's anchor to a's; zero for others.
    pub along: S::Vector,
}

impl<S: Space> Joint<S> {
    /// Scalar rows.
    pub fn rows(&self) -> usize {
        self.kind.rows::<S>()
    }
    /// The anchors on a and on b \[m\].
    pub fn anchors(&self, m: &Motion<S>) -> (S::Vector, S::Vector) {
        let on_a = m.position[self.a] + m.rotation[self.a].rotate(self.anchor_a);
        let on_b = match self.b {
            Some(b) => m.position[b] + m.rotation[b].rotate(self.anchor_b),
            None => self.anchor_b,
        };
        (on_a, on_b)
    }
    /// The rotation vector by which a is off b, world axes \[rad\].
    fn turned(&self, m: &Motion<S>) -> S::Spin {
        let wanted = match self.b {
            Some(b) => self.rotation.then(&m.rotation[b]),
            None => self.rotation,
        };
        wanted.inverse().then(&m.rotation[self.a]).vector()
    }
    /// Appends g \[m\].
    pub fn errors(&self, m: &Motion<S>, out: &mut Vec<f64>) {
        let (on_a, on_b) = self.anchors(m);
        match self.kind {
            JointKind::Distance => out.push((on_a - on_b).norm() - self.length),
            JointKind::Point => out.extend_from_slice((on_a - on_b).as_slice()),
            JointKind::Fixed => {
                out.extend_from_slice((on_a - on_b).as_slice());
                out.extend_from_slice((self.turned(m) * self.unit).as_slice());
            }
        }
    }
    /// Where it acts.
    pub fn frame(&self, bodies: &Bodies<S>) -> Frame<S>
    where
        S: Geometry,
    {
        let (on_a, on_b) = self.anchors(&bodies.motion);
        if self.kind == JointKind::Distance {
            let way = on_a - on_b;
            let length = way.norm();
            let unit = S::Vector::from_fn(|k| if k == 0 { 1.0 } else { 0.0 });
            let along = if length > 0.0 { way * (1.0 / length) } else { unit };
            return Frame { on_a, on_b, along };
        }
        let moves = |i: usize| bodies.is_dynamic(i);
        let common = match (moves(self.a), self.b.is_some_and(moves)) {
            (true, true) => (on_a + on_b) * 0.5,
            // about a pivot that stays the angular momentum stays
            (true, false) => on_b,
            (false, _) => on_a,
        };
        Frame { on_a: common, on_b: common, along: S::Vector::ZERO }
    }
    /// Appends the rows at a frame, asking for velocities 0.
    pub fn push_rows(&self, m: &Motion<S>, frame: &Frame<S>, rows: &mut Vec<BoundedRow<S>>) {
        let arm_a = frame.on_a - m.position[self.a];
        let arm_b = self.b.map(|b| frame.on_b - m.position[b]);
        let id = |k: usize| crate::contact_id::contact_id(u64::MAX, self.serial, k as u64);
        let row = |k: usize, on_a: Twist<S>, on_b: Twist<S>| BoundedRow {
            id: id(k),
            a: self.a,
            b: self.b.unwrap_or(self.a),
            on_a,
            on_b: if self.b.is_some() { on_b } else { Twist::default() },
            target: 0.0,
            lo: f64::NEG_INFINITY,
            hi: f64::INFINITY,
        };
        let push = |k: usize, n: S::Vector| {
            let arm_b = arm_b.unwrap_or(S::Vector::ZERO);
            row(k, Twist::new(n, S::moment(arm_a, n)), Twist::new(-n, -S::moment(arm_b, n)))
        };
        if self.kind == JointKind::Distance {
            rows.push(push(0, frame.along));
            return;
        }
        for k in 0..S::DIM {
            rows.push(push(k, S::Vector::from_fn(|i| if i == k { 1.0 } else { 0.0 })));
        }
        if self.kind == JointKind::Fixed {
            for k in 0..S::SPIN {
                let axis = S::Spin::from_fn(|i| if i == k { self.unit } else { 0.0 });
                let turn = |axis| Twist::new(S::Vector::ZERO, axis);
                rows.push(row(S::DIM + k, turn(axis), turn(-axis)));
            }
        }
    }
    /// Rounding of its errors at these poses \[m\].
    pub fn rounding(&self, m: &Motion<S>) -> f64 {
        let far = |i: usize| m.position[i].max_abs();
        let other = self.b.map_or(self.anchor_b.max_abs(), far);
        4.0 * f64::EPSILON * (far(self.a).max(other) + self.size)
    }
}
