//! Some of a world's bodies as a set of their own, for those who deal with a part at a time. Knows nobody of the rest.

use super::roles::Roles;
use super::{Bodies, BodyData, Motion};
use carom_geometry::Geometry;
use carom_math::Column;
use std::collections::BTreeMap;

impl<S: Geometry> Bodies<S> {
    /// Some of the bodies, ascending, without names and shapes as stated: what a step needs of them.
    pub(crate) fn some(&self, indices: &[usize]) -> Bodies<S> {
        let m = &self.motion;
        let data: Vec<_> = indices.iter().map(|&i| self.data[i].without_shape()).collect();
        Bodies {
            roles: Roles::of(&data, 0),
            data,
            motion: Motion {
                position: indices.iter().map(|&i| m.position[i]).collect(),
                rotation: indices.iter().map(|&i| m.rotation[i]).collect(),
                velocity: indices.iter().map(|&i| m.velocity[i]).collect(),
                angular_velocity: indices.iter().map(|&i| m.angular_velocity[i]).collect(),
            },
            names: Vec::new(),
            materials: self.materials.clone(),
            joints: self.joints.some(indices),
            index: BTreeMap::new(),
            serials: self.serials,
            shapes: Vec::new(),
            asleep_moment: S::Vector::ZERO,
        }
    }
}

impl<S: Geometry> BodyData<S> {
    /// A copy without the shape as stated, which may be long.
    fn without_shape(&self) -> Self {
        BodyData {
            kind: self.kind,
            serial: self.serial,
            mass_properties: self.mass_properties,
            inverse_mass: self.inverse_mass,
            inverse_inertia: self.inverse_inertia,
            principal: self.principal,
            axes: self.axes,
            shape: None,
            collider: self.collider.clone(),
            extent: self.extent,
            turning_arm: self.turning_arm,
            ball_radius: self.ball_radius,
            is_angular: self.is_angular,
            friction: self.friction,
            rolling_friction: self.rolling_friction,
            spinning_friction: self.spinning_friction,
            restitution: self.restitution,
            tangential_restitution: self.tangential_restitution,
            material: self.material,
            linear_damping: self.linear_damping,
            angular_damping: self.angular_damping,
            groups: self.groups,
            collides_with: self.collides_with,
        }
    }
}
