//! Bodies that stand: a step looks at them only where somebody may have written to them, so that its work goes with the
//! bodies that can move. What a step keeps of them is named by a number that changes whenever one of them does.

use super::World;
use crate::ahead::Ahead;
use crate::bodies::Bodies;
use crate::error::StepError;
use crate::integrate::is_unit;
use carom_geometry::Geometry;

/// What may have happened to the bodies since the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Written {
    /// Nothing but the step's own doing.
    Nothing,
    /// Their motion may be another.
    Motion,
    /// Everything may be another.
    #[default]
    All,
}

impl<S: Geometry> World<S> {
    /// Notes what somebody may write.
    pub(super) fn may_write(&mut self, what: Written) {
        self.written = self.written.max(what);
        self.known_energy = None;
        self.bodies.distrust();
    }

    /// The bodies, about to be written by somebody.
    pub(super) fn written_bodies(&mut self, what: Written) -> &mut Bodies<S> {
        self.may_write(what);
        &mut self.bodies
    }

    /// True where the fixed bodies are as the last step that began found them.
    pub(super) fn stand_as_before(&mut self) -> bool {
        match self.written {
            Written::Nothing => true,
            Written::Motion => self.bodies.stand_as_in(&self.checkpoint.0),
            Written::All => {
                self.bodies.find_roles();
                false
            }
        }
    }

    /// Keeps the motion as it is before a step; of fixed bodies only where they are others than before.
    pub(super) fn keep_motion(&mut self, as_before: bool) {
        let motion = &self.bodies.motion;
        if as_before {
            self.checkpoint.0.copy_some(motion, self.bodies.movers());
        } else {
            self.checkpoint.0.copy_from(motion);
        }
        self.bodies.trust(as_before);
        self.written = Written::Nothing;
    }

    /// Makes what the first step would make beside its own work: columns over all bodies, and the tree over those that stand.
    /// Where there are a million of them, the first step of length `dt` \[s\] is then like all others. No bit of a trajectory
    /// hangs on it, and it may be called at any time.
    ///
    /// # Errors
    /// [`StepError`] for what a step would refuse before it begins; nothing has changed then.
    pub fn prepare(&mut self, dt: f64) -> Result<(), StepError> {
        let as_before = self.stand_as_before();
        self.check_before(dt, as_before)?;
        // a step gives rotations that are not their length back, those of bodies that stand too
        if as_before || !self.bodies.motion.rotation.iter().all(is_unit::<S>) {
            return Ok(());
        }
        self.stir();
        self.keep_motion(false);
        self.schemes.soft_step.prepare(&self.bodies);
        self.spare.1.soft_step.prepare(&self.bodies);
        let ahead = Ahead::new(&self.bodies, &self.settings, dt, &self.pushes.pulls);
        self.narrow_phase.arrange(&ahead);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::{
        BodySpec, Geometry, OnInaccurate, PlanarShape, Scheme, Settings, SpatialShape, StepReport, World,
        World2, vec2,
    };
    use carom_math::{Column, Planar, Spatial};
    use std::sync::Arc;

    fn stack(count: usize) -> World2 {
        let mut world = World2::new(Settings { scheme: Scheme::SoftStep, ..Settings::default() }).unwrap();
        world.add("floor", BodySpec::fixed(PlanarShape::HalfPlane { normal: vec2(0.0, 1.0) })).unwrap();
        for k in 0..count {
            let block = BodySpec::dense(PlanarShape::Box { size: [1.0, 1.0] }, 1.0);
            world.add(&format!("block {k}"), block.at(vec2(0.0, 0.5 + k as f64))).unwrap();
        }
        world
    }

    #[test]
    fn what_was_seen_of_contacts_that_stand_is_not_copied() {
        let mut world = stack(3);
        for _ in 0..100 {
            world.step(1.0 / 60.0).unwrap();
        }
        let (now, before) = (&world.warm.patches, &world.checkpoint.1.patches);
        assert!(now.seen.len() == 3 && Arc::ptr_eq(&now.seen, &before.seen));
        // a push makes them others
        world.motion_mut().velocity[3] = vec2(3.0, 0.0);
        for _ in 0..10 {
            world.step(1.0 / 60.0).unwrap();
        }
        assert!(!Arc::ptr_eq(&world.warm.patches.seen, &world.checkpoint.1.patches.seen));
    }

    #[test]
    fn a_step_that_is_refused_leaves_the_touches_of_the_one_before() {
        let mut world = stack(2);
        for _ in 0..20 {
            world.step(1.0 / 60.0).unwrap();
        }
        let touches = world.touches().to_vec();
        assert!(touches.len() == 4 && world.step(f64::NAN).is_err() && world.touches() == touches);
        world.bodies_mut().data[2].tangential_restitution = 0.5;
        assert!(world.step(1.0 / 60.0).is_err());
        assert_eq!(world.touches(), touches);
        let bears: f64 = world.last_problem().1.contacts.iter().map(|c| c.normal).sum();
        assert!(bears > 0.0);
    }

    /// A wall of `rows` rows on a floor that it spins and bounces on, a little out of line.
    fn wall<S: Geometry>(rows: usize, up: usize, block: S::Shape, floor: S::Shape) -> World<S> {
        let gravity = S::Vector::from_fn(|k| if k == up { -9.81 } else { 0.0 });
        let settings = Settings { scheme: Scheme::SoftStep, gravity, ..Settings::default() };
        let mut world = World::new(settings).unwrap();
        let rough = |spec: BodySpec<S>| BodySpec { spinning_friction: 0.01, ..spec.friction(0.6) };
        world.add("floor", rough(BodySpec::fixed(floor))).unwrap();
        for row in 0..rows {
            for k in 0..rows - row {
                let (along, high) = (k as f64 - 0.5 * (rows - row) as f64, 0.5 + row as f64);
                let lean = 1e-3 * ((7 * k + 3 * row) % 5) as f64;
                let place = S::Vector::from_fn(|c| match c {
                    0 => along + lean,
                    _ if c == up => high,
                    _ => lean,
                });
                let spec = BodySpec { restitution: 0.1, ..rough(BodySpec::dense(block.clone(), 1.0)) };
                world.add(&format!("{row} {k}"), spec.at(place)).unwrap();
            }
        }
        world
    }

    /// Steps that go by the faces of the step before change nothing: beside them a world that is thought to be written before each
    /// step, and therefore looks at all pairs. Tells how many steps went by them, and how many faces were looked at anew.
    fn goes_as_if_all_were_looked_at<S: Geometry>(mut world: World<S>, workers: usize) -> (usize, usize) {
        let (mut other, _) = World::from_snapshot(&world.snapshot()).unwrap();
        world.set_threads(workers).unwrap();
        let (mut again, mut anew) = (0, 0);
        for step in 0..240 {
            let settings = world.settings().clone();
            for world in [&mut world, &mut other] {
                match step {
                    60 => world.motion_mut().velocity[5] = S::Vector::from_fn(|_| 0.3),
                    75 => {
                        let pushed = world.motion_mut().velocity.iter_mut().skip(1).step_by(5);
                        pushed.zip(1..).for_each(|(v, k)| v[0] = 0.3 * f64::from(k % 7 - 3));
                    }
                    90 => world.motion_mut().angular_velocity[3] = S::Spin::from_fn(|_| 2.0),
                    120 => world.set_settings(Settings { tolerance: 2e-6, ..settings.clone() }).unwrap(),
                    150 => world.motion_mut().position[7] += S::Vector::from_fn(|_| 4e-3),
                    180 => *world = World::from_snapshot(&world.snapshot()).unwrap().0,
                    // a step that is refused loses nothing
                    200 => assert!(world.step(f64::NAN).is_err()),
                    210 => {
                        let slack = Settings {
                            on_inaccurate: OnInaccurate::Raise,
                            tolerance: 1e-300,
                            ..settings.clone()
                        };
                        world.set_settings(slack).unwrap();
                        assert!(world.step(1.0 / 60.0).is_err());
                        world.set_settings(settings.clone()).unwrap();
                    }
                    _ => {}
                }
            }
            other.bodies_mut();
            let (one, two) = (world.step(1.0 / 60.0).unwrap(), other.step(1.0 / 60.0).unwrap());
            assert_eq!(world.bodies.motion, other.bodies.motion, "step {step}");
            assert_eq!(world.warm.patches, other.warm.patches, "step {step}");
            assert_eq!((one.contacts, one.deepest), (two.contacts, two.deepest), "step {step}");
            assert_eq!(world.touches(), other.touches(), "step {step}");
            let solve = |report: &StepReport<S>| report.contact_solve.as_ref().map(|s| (s.residual, s.worst));
            assert_eq!(solve(&one), solve(&two), "step {step}");
            assert_eq!(other.schemes.soft_step.went_again(), None);
            if let Some(faces) = world.schemes.soft_step.went_again() {
                (again, anew) = (again + 1, anew + faces);
            }
        }
        (again, anew)
    }

    #[test]
    fn what_stands_side_by_side_goes_as_if_all_pairs_were_looked_at() {
        for workers in [1, 3] {
            let (block, floor) =
                (PlanarShape::Box { size: [1.0; 2] }, PlanarShape::HalfPlane { normal: vec2(0.0, 1.0) });
            let told = goes_as_if_all_were_looked_at::<Planar>(wall(40, 1, block, floor), workers);
            assert!(told.0 > 100 && told.1 > 20, "{told:?}");
            let (block, floor) =
                (SpatialShape::Box { size: [1.0; 3] }, SpatialShape::Box { size: [60.0, 60.0, 1e-3] });
            let told = goes_as_if_all_were_looked_at::<Spatial>(wall(30, 2, block, floor), workers);
            assert!(told.0 > 100 && told.1 > 20, "{told:?}");
        }
    }
}
