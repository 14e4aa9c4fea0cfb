//! The whole state of a world as a text, and back, bit for bit: settings, bodies, motion, warm starts, ledger,
//! forces waiting for the next step. A restored world continues the same trajectory. Force fields are code and
//! are not part of it: their names are, so that a missing one is noticed.

use crate::bodies::Motion;
use crate::body::{BodyKind, BodySpec, MassSource};
use crate::error::BuildError;
use crate::force::Wrench;
use crate::joint::{Joint, JointKind};
use crate::material::MaterialPair;
use crate::observe::ledger::Ledger;
use crate::settings::Settings;
use crate::warm_start::WarmStart;
use crate::world::World;
use carom_geometry::{Geometry, MassProperties};
use carom_math::Inertia;
use serde::{Deserialize, Serialize};

/// Number that changes when the form of snapshots does.
pub const VERSION: u32 = 1;

#[derive(Serialize, Deserialize)]
#[serde(bound = "")]
struct SavedBody<S: Geometry> {
    name: String,
    kind: BodyKind,
    shape: Option<S::Shape>,
    mass: MassProperties<S>,
    can_rotate: bool,
    friction: f64,
    #[serde(default)]
    rolling_friction: f64,
    #[serde(default)]
    spinning_friction: f64,
    restitution: f64,
    #[serde(default, skip_serializing_if = "is_nothing")]
    tangential_restitution: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    material: Option<String>,
    linear_damping: f64,
    angular_damping: f64,
    groups: u32,
    collides_with: u32,
    serial: u64,
    position: S::Vector,
    rotation: S::Rotation,
    velocity: S::Vector,
    angular_velocity: S::Spin,
    waiting: (S::Vector, S::Spin),
}

#[derive(Serialize, Deserialize)]
#[serde(bound = "", deny_unknown_fields)]
struct Saved<S: Geometry> {
    version: u32,
    space: String,
    settings: Settings<S>,
    time: f64,
    steps: u64,
    serials: u64,
    bodies: Vec<SavedBody<S>>,
    warm: WarmStart<S>,
    ledger: Ledger,
    force_fields: Vec<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pairs: Vec<(String, String, MaterialPair)>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    joints: Vec<SavedJoint<S>>,
    #[serde(default, skip_serializing_if = "is_zero")]
    joint_serials: u64,
}

fn is_zero(n: &u64) -> bool {
    *n == 0
}

fn is_nothing(x: &f64) -> bool {
    *x == 0.0
}

/// A joint, its bodies by name.
#[derive(Serialize, Deserialize)]
#[serde(bound = "", deny_unknown_fields)]
struct SavedJoint<S: Geometry> {
    name: String,
    kind: JointKind,
    a: String,
    b: Option<String>,
    anchor_a: S::Vector,
    anchor_b: S::Vector,
    length: f64,
    rotation: S::Rotation,
    collide: bool,
    unit: f64,
    size: f64,
    serial: u64,
}

fn unreadable(problem: String) -> BuildError {
    BuildError::setting("snapshot", problem, "give a snapshot of the same space and version")
}

impl<S: Geometry> World<S> {
    /// The whole state as a text.
    pub fn snapshot(&mut self) -> String {
        self.wake_stirred();
        let waiting = self.waiting().clone();
        let bodies = (0..self.bodies.len()).map(|i| self.saved_body(i, &waiting[i])).collect();
        let saved = Saved {
            version: VERSION,
            space: S::NAME.into(),
            settings: self.settings().clone(),
            time: self.time,
            steps: self.steps,
            serials: self.bodies.serials(),
            bodies,
            warm: self.warm.clone(),
            ledger: self.ledger,
            force_fields: self.force_fields().map(String::from).collect(),
            pairs: self.pairs().map(|(a, b, pair)| (a.into(), b.into(), pair)).collect(),
            joints: self.saved_joints(),
            joint_serials: self.bodies.joints.serials,
        };
        serde_json::to_string(&saved).expect("a snapshot is plain data")
    }

    fn saved_joints(&self) -> Vec<SavedJoint<S>> {
        let name = |i: usize| self.bodies.names[i].clone();
        let saved = |(j, joint): (&Joint<S>, &String)| SavedJoint {
            name: joint.clone(),
            kind: j.kind,
            a: name(j.a),
            b: j.b.map(name),
            anchor_a: j.anchor_a,
            anchor_b: j.anchor_b,
            length: j.length,
            rotation: j.rotation,
            collide: j.collide,
            unit: j.unit,
            size: j.size,
            serial: j.serial,
        };
        let joints = &self.bodies.joints;
        joints.all.iter().zip(&joints.names).map(saved).collect()
    }

    fn restore_joints(&mut self, saved: Vec<SavedJoint<S>>, serials: u64) -> Result<(), BuildError> {
        for j in saved {
            let body = |name: &str| self.bodies.find(name).ok_or_else(|| self.bodies.unknown(name));
            let (a, b) = (body(&j.a)?, j.b.as_deref().map(body).transpose()?);
            let SavedJoint {
                kind, anchor_a, anchor_b, length, rotation, collide, unit, size, serial, ..
            } = j;
            let joint =
                Joint { kind, a, b, anchor_a, anchor_b, length, rotation, collide, unit, size, serial };
            self.bodies.joints.push(&j.name, joint);
        }
        self.bodies.joints.serials = serials;
        Ok(())
    }

    fn saved_body(&self, i: usize, waiting: &Wrench<S>) -> SavedBody<S> {
        let (d, m) = (&self.bodies.data[i], &self.bodies.motion);
        SavedBody {
            name: self.bodies.names[i].clone(),
            kind: d.kind,
            shape: d.shape.clone(),
            mass: d.mass_properties,
            can_rotate: d.inverse_inertia != S::Inertia::ZERO,
            friction: d.friction,
            rolling_friction: d.rolling_friction,
            spinning_friction: d.spinning_friction,
            restitution: d.restitution,
            tangential_restitution: d.tangential_restitution,
            material: self.bodies.material(i).map(String::from),
            linear_damping: d.linear_damping,
            angular_damping: d.angular_damping,
            groups: d.groups,
            collides_with: d.collides_with,
            serial: d.serial,
            position: m.position[i],
            rotation: m.rotation[i],
            velocity: m.velocity[i],
            angular_velocity: m.angular_velocity[i],
            waiting: (waiting.force, waiting.torque),
        }
    }

    /// A world from a snapshot, and the names of the force fields that it had and that must be set again.
    ///
    /// # Errors
    /// [`BuildError`] when the text is no snapshot of this space and version or holds impossible numbers.
    pub fn from_snapshot(text: &str) -> Result<(Self, Vec<String>), BuildError> {
        let saved: Saved<S> = serde_json::from_str(text).map_err(|e| unreadable(e.to_string()))?;
        if saved.version != VERSION || saved.space != S::NAME {
            return Err(unreadable(format!("got version {} of space {:?}", saved.version, saved.space)));
        }
        let mut world = World::new(saved.settings)?;
        let mut motion = Motion::<S>::default();
        let mut waiting = Vec::new();
        for b in &saved.bodies {
            world.add(&b.name, spec_of(b))?;
            world.bodies.set_serial(world.bodies.len() - 1, b.serial);
            motion.position.push(b.position);
            motion.rotation.push(b.rotation);
            motion.velocity.push(b.velocity);
            motion.angular_velocity.push(b.angular_velocity);
            waiting.push(Wrench { force: b.waiting.0, torque: b.waiting.1 });
        }
        for (a, b, pair) in &saved.pairs {
            // of a material whose last body is gone there may be pairs left
            world.bodies.materials.learn(a);
            world.bodies.materials.learn(b);
            world.set_pair(a, b, *pair)?;
        }
        // written over what `add` normalised, so that every bit is the saved one
        world.motion_mut().copy_from(&motion);
        world.restore_joints(saved.joints, saved.joint_serials)?;
        world.bodies.set_serials(saved.serials);
        world.set_trajectory(saved.time, saved.steps, saved.warm, saved.ledger);
        *world.waiting() = waiting;
        Ok((world, saved.force_fields))
    }
}

fn spec_of<S: Geometry>(b: &SavedBody<S>) -> BodySpec<S> {
    let mut spec = match (b.kind, &b.shape) {
        (BodyKind::Dynamic, shape) => BodySpec::given(shape.clone(), b.mass),
        (kind, shape) => BodySpec { kind, shape: shape.clone(), ..BodySpec::given(None, b.mass) },
    };
    spec.mass = MassSource::Given(b.mass);
    spec.can_rotate = b.can_rotate;
    spec.position = b.position;
    spec.rotation = b.rotation;
    spec.velocity = b.velocity;
    spec.angular_velocity = b.angular_velocity;
    spec.friction = b.friction;
    spec.rolling_friction = b.rolling_friction;
    spec.spinning_friction = b.spinning_friction;
    spec.restitution = b.restitution;
    spec.tangential_restitution = b.tangential_restitution;
    spec.material.clone_from(&b.material);
    spec.linear_damping = b.linear_damping;
    spec.angular_damping = b.angular_damping;
    spec.groups = b.groups;
    spec.collides_with = b.collides_with;
    spec
}
