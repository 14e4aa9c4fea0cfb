//! Rapier with 8 lanes. Its two crates have one text, which stands here once as a macro; shapes and numbers are translated by
//! the bench's library. Everything at its default but gravity, friction, sleeping, the step's length and the worker count.

/// One engine for `rapier2d` and `rapier3d`.
macro_rules! engine {
    ($rapier:ident, $space:ty, $shapes:path) => {
        use crate::engine::{Choice, Engine, Phases, Spent, timed};
        use crate::scene::{DT, FRICTION, Kind, Scene};
        use carom::Pose;
        use $rapier::prelude::{ColliderBuilder, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle};
        use $shapes as shapes;

        /// A world of Rapier.
        struct Rapier {
            world: PhysicsWorld,
            handles: Vec<RigidBodyHandle>,
        }

        /// A scene in Rapier.
        ///
        /// # Errors
        /// The shape that Rapier has no counterpart of, or threads that cannot be had.
        pub fn build(scene: &Scene<$space>, choice: Choice) -> Result<Box<dyn Engine<$space>>, String> {
            let mut world = PhysicsWorld::new();
            world.configure_thread_pool(choice.threads).map_err(|e| e.to_string())?;
            world.gravity = shapes::vector(Scene::<$space>::gravity());
            world.integration_parameters.dt = DT as f32;
            let mut handles = Vec::with_capacity(scene.bodies.len());
            let mut shared = crate::engines::Shared::<$space, _>::new();
            for body in &scene.bodies {
                let builder = match body.kind {
                    Kind::Dynamic => RigidBodyBuilder::dynamic(),
                    Kind::Fixed => RigidBodyBuilder::fixed(),
                    Kind::Kinematic => RigidBodyBuilder::kinematic_velocity_based(),
                };
                let builder = builder
                    .pose(shapes::pose(&body.pose))
                    .linvel(shapes::vector(body.velocity))
                    .angvel(shapes::spin(body.spin))
                    .can_sleep(choice.sleeping);
                let handle = world.bodies.insert(builder.build());
                let parts = shared.get(&body.shape, body.density, || shapes::parts(&body.shape))?;
                for (place, shape) in parts {
                    let collider = ColliderBuilder::new(shape)
                        .position(place)
                        .density(body.density as f32)
                        .friction(FRICTION as f32);
                    world.colliders.insert_with_parent(collider.build(), handle, &mut world.bodies);
                }
                handles.push(handle);
            }
            Ok(Box::new(Rapier { world, handles }))
        }

        impl Engine<$space> for Rapier {
            fn step(&mut self) -> Result<Spent, String> {
                let ((), spent) = timed(|| self.world.step());
                Ok(spent)
            }
            fn poses(&mut self) -> Result<Vec<Pose<$space>>, String> {
                let pose = |h: &RigidBodyHandle| shapes::pose_back(self.world.bodies[*h].position());
                Ok(self.handles.iter().map(pose).collect())
            }
            fn contacts(&mut self) -> Option<usize> {
                let pairs = self.world.narrow_phase.contact_pairs();
                Some(pairs.flat_map(|p| p.manifolds()).map(|m| m.data.solver_contacts.len()).sum())
            }
            fn phases(&self) -> Option<Phases> {
                let c = &self.world.physics_pipeline.counters;
                let pairs = c.cd.broad_phase_time.time_ms() + c.cd.final_broad_phase_time.time_ms();
                let collide = c.cd.narrow_phase_time.time_ms();
                Some(Phases::of(c.step_time_ms(), pairs, collide, c.stages.solver_time.time_ms()))
            }
        }
    };
}

/// Rapier of the plane.
pub mod planar {
    engine!(rapier2d, carom::Planar, carom_bench::shapes_planar);
}

/// Rapier of space.
pub mod spatial {
    engine!(rapier3d, carom::Spatial, carom_bench::shapes_spatial);
}
