//! From what a user says of a joint to the joint, checked where it enters.

use super::frame::{Joint, JointKind};
use super::reaction::Reaction;
use super::spec::{Anchor, JointSpec};
use crate::bodies::Bodies;
use crate::error::BuildError;
use crate::world::World;
use carom_geometry::Geometry;
use carom_math::{Column, Inertia, Rotation};

/// Distance of anchors over the joint's size beyond which a joint is refused \[1\].
const TORN: f64 = 1e-2;

impl<S: Geometry> World<S> {
    /// Adds a joint between bodies as they are now, and returns its index. Anchors that are a little apart are put
    /// together by the first step.
    ///
    /// # Errors
    /// [`BuildError`] naming joint, field, value and remedy; the world is unchanged then.
    pub fn add_joint(&mut self, name: &str, spec: JointSpec<S>) -> Result<usize, BuildError> {
        let mut joint = self.bodies.joint_of(name, &spec)?;
        self.bodies.joints.serials += 1;
        joint.serial = self.bodies.joints.serials;
        self.bodies.joints.push(name, joint);
        self.forget_step();
        Ok(self.bodies.joints.len() - 1)
    }
    /// Removes a joint.
    ///
    /// # Errors
    /// [`BuildError`] when no joint has this name.
    pub fn remove_joint(&mut self, name: &str) -> Result<(), BuildError> {
        let number = self.bodies.joints.find(name).ok_or_else(|| self.bodies.joints.unknown(name))?;
        self.bodies.joints.remove(number);
        self.forget_step();
        Ok(())
    }
    /// What body a of a joint got from b in the last step; zeros before the first.
    ///
    /// # Errors
    /// [`BuildError`] when no joint has this name.
    pub fn reaction(&self, joint: &str) -> Result<Reaction<S>, BuildError> {
        let number = self.bodies.joints.find(joint).ok_or_else(|| self.bodies.joints.unknown(joint))?;
        Ok(self.reactions().get(number).copied().unwrap_or_default())
    }
}

impl<S: Geometry> Bodies<S> {
    /// The joint that a user asks for, without a serial number.
    fn joint_of(&self, name: &str, spec: &JointSpec<S>) -> Result<Joint<S>, BuildError> {
        let refuse =
            |field: &str, problem: String, remedy: &str| Err(BuildError::joint(name, field, problem, remedy));
        if name.is_empty() {
            return refuse("name", "is empty".into(), "give each joint a name");
        }
        if self.joints.find(name).is_some() {
            return refuse("name", "is taken".into(), "give each joint a name of its own");
        }
        let a = self.joined(name, "a", &spec.a)?;
        let b = spec.b.as_deref().map(|b| self.joined(name, "b", b)).transpose()?;
        if b == Some(a) {
            return refuse("b", format!("must be another body, got '{}' twice", spec.a), "join two bodies");
        }
        if !self.is_dynamic(a) && !b.is_some_and(|b| self.is_dynamic(b)) {
            let other = spec.b.as_deref().unwrap_or("the world");
            let problem = format!("must be a body that moves, as '{}' and '{other}' do not", spec.a);
            return refuse("a", problem, "join a dynamic body");
        }
        let (on_a, on_b) = self.places(name, spec, a, b)?;
        let own = |i: usize, p: S::Vector| self.motion.rotation[i].unrotate(p - self.motion.position[i]);
        let (anchor_a, anchor_b) = (own(a, on_a), b.map_or(on_b, |b| own(b, on_b)));
        let distance = (on_a - on_b).norm();
        let length = self.length(name, spec, distance)?;
        let held = match b {
            Some(b) => self.motion.rotation[a].then(&self.motion.rotation[b].inverse()),
            None => self.motion.rotation[a],
        };
        let arm_b = if b.is_some() { anchor_b.norm() } else { 0.0 };
        let unit = self.gyration(a).max(b.map_or(0.0, |b| self.gyration(b)));
        if spec.kind == JointKind::Fixed && unit == 0.0 {
            return refuse(
                "kind",
                "is fixed between bodies that do not turn".into(),
                "join them by a point joint",
            );
        }
        let sizes = [a].into_iter().chain(b).map(|i| self.data[i].extent).filter(|e| e.is_finite());
        let size = sizes.chain([anchor_a.norm(), arm_b, length, unit]).fold(0.0, f64::max);
        let size = if size > 0.0 { size } else { 1.0 };
        let torn = if spec.kind == JointKind::Distance { (distance - length).abs() } else { distance };
        let is_near = torn <= TORN * size;
        if !is_near {
            let problem = format!(
                "is {torn:.3e} m off what the joint holds, more than {TORN} of its size {size:.3e} m"
            );
            let (field, remedy) = if spec.kind == JointKind::Distance {
                ("length", "give the present distance of the anchors, or put the bodies there first")
            } else {
                ("anchor_b", "give anchors that are at one place now, or put the bodies there first")
            };
            return refuse(field, problem, remedy);
        }
        Ok(Joint {
            kind: spec.kind,
            a,
            b,
            anchor_a,
            anchor_b,
            length,
            rotation: held,
            collide: spec.collide,
            unit: if unit > 0.0 { unit } else { 1.0 },
            size,
            serial: 0,
        })
    }

    fn joined(&self, joint: &str, field: &str, body: &str) -> Result<usize, BuildError> {
        self.find(body).ok_or_else(|| {
            let near = crate::bodies::nearest(self.names.iter(), body);
            let remedy = near.map_or("add the body first".into(), |n| format!("did you mean '{n}'?"));
            BuildError::joint(joint, field, format!("names no body, got '{body}'"), remedy)
        })
    }

    /// Where the anchors are now.
    fn places(
        &self,
        name: &str,
        spec: &JointSpec<S>,
        a: usize,
        b: Option<usize>,
    ) -> Result<(S::Vector, S::Vector), BuildError> {
        let place = |field: &str, body: Option<usize>, anchor: &Anchor<S>| {
            let (given, at) = match (anchor, body) {
                (Anchor::Center, Some(i)) => (S::Vector::ZERO, self.motion.position[i]),
                (Anchor::Body(r), Some(i)) => {
                    (*r, self.shape_pose(i).position + self.motion.rotation[i].rotate(*r))
                }
                (Anchor::World(p), _) => (*p, *p),
                (_, None) => {
                    let problem = "must be a place of the world for a joint to the world";
                    return Err(BuildError::joint(name, field, problem, "give it in world axes"));
                }
            };
            if !given.is_finite() {
                let problem = format!("must be finite, got {:?}", given.as_slice());
                return Err(BuildError::joint(name, field, problem, "give finite numbers in m"));
            }
            Ok(at)
        };
        let on_a = spec.anchor_a.as_ref().map(|p| place("anchor_a", Some(a), p)).transpose()?;
        let on_b = spec.anchor_b.as_ref().map(|p| place("anchor_b", b, p)).transpose()?;
        let missing = |field: &str, remedy: &str| BuildError::joint(name, field, "is missing", remedy);
        match (spec.kind, on_a, on_b) {
            (_, Some(on_a), Some(on_b)) => Ok((on_a, on_b)),
            (JointKind::Distance, on_a, on_b) => {
                let center = |i: usize| self.motion.position[i];
                let on_b = on_b.or(b.map(center));
                let on_b =
                    on_b.ok_or_else(|| missing("anchor_b", "give the place of the world that a is tied to"))?;
                Ok((on_a.unwrap_or_else(|| center(a)), on_b))
            }
            (_, Some(one), None) | (_, None, Some(one)) => Ok((one, one)),
            (JointKind::Fixed, None, None) => Ok((self.motion.position[a], self.motion.position[a])),
            (JointKind::Point, None, None) => {
                Err(missing("anchor_a", "give the place where the joint holds the bodies"))
            }
        }
    }

    fn length(&self, name: &str, spec: &JointSpec<S>, distance: f64) -> Result<f64, BuildError> {
        match (spec.kind, spec.length) {
            (JointKind::Distance, length) => {
                let length = length.unwrap_or(distance);
                if length > 0.0 && length.is_finite() {
                    return Ok(length);
                }
                let problem = format!("must be > 0, got {length}");
                let remedy = "give a length in m, or join the points by a point joint";
                Err(BuildError::joint(name, "length", problem, remedy))
            }
            (_, None) => Ok(0.0),
            (kind, Some(length)) => {
                let problem = format!("has no meaning for a {} joint, got {length}", kind.name());
                Err(BuildError::joint(name, "length", problem, "leave it out, or make it a distance joint"))
            }
        }
    }

    /// Largest radius of gyration of a body \[m\]; 0 where nothing turns it.
    fn gyration(&self, i: usize) -> f64 {
        let d = &self.data[i];
        if d.inverse_inertia == S::Inertia::ZERO {
            return 0.0;
        }
        let largest = d.principal.as_slice().iter().fold(0.0, |m: f64, p| m.max(*p));
        (largest / d.mass_properties.mass).sqrt()
    }
}
