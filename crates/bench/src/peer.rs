//! Rapier as a contender. Its two crates have one text, which stands here once as a macro; shapes and numbers are
//! translated in `shapes_planar` and `shapes_spatial`. Everything is at its default but: no body may sleep, the
//! scene's step length, gravity, masses and coefficients. Knows no scene.

use carom::{Geometry, Mixing, World};

use crate::contender::Contender;

/// A space that has a Rapier.
pub trait Peer: Geometry {
    /// The same bodies in Rapier.
    ///
    /// # Errors
    /// The shape or the rule that Rapier has no counterpart of.
    fn rapier(world: &World<Self>) -> Result<Box<dyn Contender<Self>>, String>;
}

/// A coefficient as it must be stored so that Rapier's rule gives carom's mixture.
pub fn stored(mixing: Mixing, value: f64) -> f32 {
    // the geometric mean is the product of square roots
    if mixing == Mixing::Geometric { value.sqrt() as f32 } else { value as f32 }
}

/// One contender for `rapier2d` and `rapier3d`.
macro_rules! contender {
    ($rapier:ident, $space:ty, $shapes:path) => {
        use carom::{BodyKind, Column, Mixing, Pose, World};
        use $rapier::prelude::{
            CoefficientCombineRule, ColliderBuilder, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle,
        };
        use $shapes as shapes;

        /// A world of Rapier.
        struct Rapier {
            world: PhysicsWorld,
            handles: Vec<RigidBodyHandle>,
        }

        fn rule(mixing: Mixing) -> Result<CoefficientCombineRule, String> {
            match mixing {
                Mixing::Min => Ok(CoefficientCombineRule::Min),
                Mixing::Max => Ok(CoefficientCombineRule::Max),
                Mixing::Mean => Ok(CoefficientCombineRule::Average),
                Mixing::Product | Mixing::Geometric => Ok(CoefficientCombineRule::Multiply),
                Mixing::Harmonic => Err("Rapier has no harmonic mean of coefficients".into()),
            }
        }

        impl $crate::peer::Peer for $space {
            fn rapier(world: &World<Self>) -> Result<Box<dyn $crate::contender::Contender<Self>>, String> {
                let (bodies, settings) = (world.bodies(), world.settings());
                let mut peer = PhysicsWorld::new();
                peer.gravity = shapes::vector(settings.gravity);
                peer.integration_parameters.dt = settings.dt as f32;
                let friction_rule = rule(settings.friction_mixing)?;
                let restitution_rule = rule(settings.restitution_mixing)?;
                let mut handles = Vec::new();
                for (i, data) in bodies.data.iter().enumerate() {
                    let builder = match data.kind {
                        BodyKind::Dynamic => RigidBodyBuilder::dynamic(),
                        BodyKind::Fixed => RigidBodyBuilder::fixed(),
                        BodyKind::Kinematic => RigidBodyBuilder::kinematic_velocity_based(),
                    };
                    let mut builder = builder
                        .pose(shapes::pose(&bodies.shape_pose(i)))
                        .linvel(shapes::vector(bodies.motion.velocity[i]))
                        .angvel(shapes::spin(bodies.motion.angular_velocity[i]))
                        .linear_damping(data.linear_damping as f32)
                        .angular_damping(data.angular_damping as f32)
                        .can_sleep(false);
                    if data.kind == BodyKind::Dynamic {
                        builder = builder.additional_mass_properties(shapes::mass(&data.mass_properties));
                    }
                    let handle = peer.bodies.insert(builder.build());
                    for (place, shape) in
                        data.shape.iter().map(shapes::parts).collect::<Result<Vec<_>, _>>()?.concat()
                    {
                        let collider = ColliderBuilder::new(shape)
                            .position(place)
                            .density(0.0)
                            .friction($crate::peer::stored(settings.friction_mixing, data.friction))
                            .friction_combine_rule(friction_rule)
                            .restitution($crate::peer::stored(settings.restitution_mixing, data.restitution))
                            .restitution_combine_rule(restitution_rule);
                        peer.colliders.insert_with_parent(collider.build(), handle, &mut peer.bodies);
                    }
                    handles.push(handle);
                }
                Ok(Box::new(Rapier { world: peer, handles }))
            }
        }

        impl $crate::contender::Contender<$space> for Rapier {
            fn step(&mut self) -> Result<$crate::contender::Told, String> {
                self.world.step();
                Ok($crate::contender::Told::default())
            }
            fn poses(&self) -> Vec<Pose<$space>> {
                self.handles.iter().map(|h| shapes::pose_back(self.world.bodies[*h].position())).collect()
            }
            fn top_speed(&self) -> f64 {
                let speed = |h: &RigidBodyHandle| shapes::vector_back(self.world.bodies[*h].linvel()).norm();
                self.handles.iter().map(speed).fold(0.0, f64::max)
            }
            fn contacts(&self) -> usize {
                let pairs = self.world.narrow_phase.contact_pairs();
                pairs.flat_map(|p| p.manifolds()).map(|m| m.data.solver_contacts.len()).sum()
            }
        }
    };
}

mod planar {
    contender!(rapier2d, carom::Planar, carom_bench::shapes_planar);
}
mod spatial {
    contender!(rapier3d, carom::Spatial, carom_bench::shapes_spatial);
}
