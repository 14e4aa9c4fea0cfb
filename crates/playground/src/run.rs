//! A world that a page drives: steps, settings while it runs, coefficients of all bodies at once, the hand, its state as
//! a text. One text for the plane and for space; the page holds it as [`Run`].

use crate::frame::{self, Worst};
use crate::hand::Hand;
use crate::{fingerprint, scene};
use carom::{BodyKind, Column, Geometry, Inertia, World};
use serde_json::{Map, Value, json};

/// What a page asks of a world of either space.
pub trait Run {
    /// What does not change while it runs, and its settings, as a table.
    fn about(&self) -> Value;
    /// Takes up to `count` steps of the settings' length, and writes the frame after them.
    ///
    /// # Errors
    /// The sentence of a refused step; the world is then as it was before it.
    fn steps(&mut self, count: u32, out: &mut Vec<f64>) -> Result<(), String>;
    /// Writes the frame of the present state.
    fn frame(&self, out: &mut Vec<f64>);
    /// Changes settings.
    ///
    /// # Errors
    /// Naming the setting; the old ones stay then.
    fn set(&mut self, settings: Map<String, Value>) -> Result<(), String>;
    /// Gives all bodies these coefficients of friction and restitution \[1\]; what is `None` becomes what the scene says.
    ///
    /// # Errors
    /// For a coefficient out of range.
    fn set_coefficients(&mut self, friction: Option<f64>, restitution: Option<f64>) -> Result<(), String>;
    /// Tells friction and restitution that bodies have in the scene \[1\], which those of all bodies hide in a snapshot.
    ///
    /// # Errors
    /// For another number of bodies, or a coefficient out of range.
    fn know_own(&mut self, own: Vec<(f64, f64)>) -> Result<(), String>;
    /// Takes hold of a body at a place \[m\]; false when forces do not move it.
    fn hold(&mut self, body: usize, place: &[f64]) -> bool;
    /// Pulls what is held to a place \[m\].
    fn pull(&mut self, place: &[f64]);
    /// Lets go.
    fn release(&mut self);
    /// The whole state as a text, from which [`crate::page::Page`] goes on bit for bit.
    fn snapshot(&mut self) -> String;
    /// One number for the bits of the motion.
    fn fingerprint(&self) -> u64;
}

/// See the file's head.
pub struct Live<S: Geometry> {
    world: World<S>,
    about: scene::About,
    /// Friction and restitution of the bodies as the scene has them \[1\].
    own: Vec<(f64, f64)>,
    hand: Option<Hand<S>>,
}

impl<S: Geometry> Live<S> {
    /// Drives a world.
    pub fn new(world: World<S>, about: scene::About) -> Self {
        let own = world.bodies().data.iter().map(|d| (d.friction, d.restitution)).collect();
        Live { world, about, own, hand: None }
    }
}

impl<S: Geometry> Run for Live<S> {
    fn about(&self) -> Value {
        let bodies = self.world.bodies();
        let kind = |k: BodyKind| match k {
            BodyKind::Dynamic => 0,
            BodyKind::Fixed => 1,
            BodyKind::Kinematic => 2,
        };
        let mut shapes: Vec<&S::Shape> = Vec::new();
        let mut rows: Vec<i64> = Vec::new();
        for data in &bodies.data {
            let Some(shape) = &data.shape else {
                rows.push(-1);
                continue;
            };
            // copies stand together: looking back from the end finds theirs at once
            let known = shapes.iter().rev().take(64).position(|s| *s == shape);
            rows.push(known.map_or(shapes.len(), |back| shapes.len() - 1 - back) as i64);
            if known.is_none() {
                shapes.push(shape);
            }
        }
        let inverse = |i: usize| if bodies.is_dynamic(i) { bodies.data[i].inverse_mass } else { 0.0 };
        let turning = |i: usize| bodies.data[i].inverse_inertia.entries();
        json!({
            "space": S::NAME,
            "name": self.about.name,
            "description": self.about.description,
            "duration": self.about.duration,
            "gravity": self.world.settings().gravity,
            "settings": self.world.settings(),
            "solver": self.world.settings().solver_kind().name(),
            "impact": self.world.settings().impact_law().name(),
            "names": bodies.names,
            "kind": bodies.data.iter().map(|d| kind(d.kind)).collect::<Vec<_>>(),
            "shapes": shapes,
            "shape": rows,
            "center": bodies.data.iter().flat_map(|d| d.mass_properties.center.as_slice().to_vec()).collect::<Vec<_>>(),
            "own": self.own,
            "jointed": bodies.jointed().collect::<Vec<_>>(),
            "inverse_mass": (0..bodies.len()).map(inverse).collect::<Vec<_>>(),
            "inverse_inertia": (0..bodies.len()).map(turning).collect::<Vec<_>>(),
        })
    }
    fn steps(&mut self, count: u32, out: &mut Vec<f64>) -> Result<(), String> {
        let dt = self.world.settings().dt;
        let mut worst = Worst::default();
        let mut taken = Ok(());
        for _ in 0..count {
            if let Some(hand) = &self.hand {
                hand.pull(&mut self.world, dt);
            }
            match self.world.step(dt) {
                Ok(report) => worst.add(&report),
                Err(error) => {
                    taken = Err(error.to_string());
                    break;
                }
            }
        }
        frame::write(&self.world, &worst, out);
        taken
    }
    fn frame(&self, out: &mut Vec<f64>) {
        frame::write(&self.world, &Worst::default(), out);
    }
    fn set(&mut self, settings: Map<String, Value>) -> Result<(), String> {
        let wanted = scene::settings(self.world.settings(), settings)?;
        self.world.set_settings(wanted).map_err(|e| e.to_string())
    }
    fn set_coefficients(&mut self, friction: Option<f64>, restitution: Option<f64>) -> Result<(), String> {
        check(friction, restitution)?;
        for (data, own) in self.world.bodies_mut().data.iter_mut().zip(&self.own) {
            data.friction = friction.unwrap_or(own.0);
            data.restitution = restitution.unwrap_or(own.1);
        }
        Ok(())
    }
    fn know_own(&mut self, own: Vec<(f64, f64)>) -> Result<(), String> {
        if own.len() != self.own.len() {
            return Err(format!("own: {} coefficients for {} bodies", own.len(), self.own.len()));
        }
        own.iter().try_for_each(|&(friction, restitution)| check(Some(friction), Some(restitution)))?;
        self.own = own;
        Ok(())
    }
    fn hold(&mut self, body: usize, place: &[f64]) -> bool {
        let place = S::Vector::from_slice(&place[..S::DIM.min(place.len())]);
        self.hand = place.and_then(|place| Hand::on(&self.world, body, place));
        self.hand.is_some()
    }
    fn pull(&mut self, place: &[f64]) {
        let place = S::Vector::from_slice(&place[..S::DIM.min(place.len())]);
        if let (Some(hand), Some(place)) = (&mut self.hand, place.filter(|p| p.is_finite())) {
            hand.target = place;
        }
    }
    fn release(&mut self) {
        self.hand = None;
    }
    fn snapshot(&mut self) -> String {
        self.world.snapshot()
    }
    fn fingerprint(&self) -> u64 {
        fingerprint::of(&self.world)
    }
}

/// Coefficients that bodies may have.
fn check(friction: Option<f64>, restitution: Option<f64>) -> Result<(), String> {
    if let Some(mu) = friction.filter(|mu| !(*mu >= 0.0 && mu.is_finite())) {
        return Err(format!("friction must be finite and >= 0, got {mu}"));
    }
    if let Some(e) = restitution.filter(|e| !(0.0..=1.0).contains(e)) {
        return Err(format!("restitution must be in [0, 1], got {e}"));
    }
    Ok(())
}
