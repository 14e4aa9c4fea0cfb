//! The judge: how deep bodies overlap, found in f64 from poses alone, whoever made them.

use carom::geometry::broad_phase::BroadPhase;
use carom::geometry::{Aabb, Geometry};
use carom::{Pose, World};

/// The shapes of a scene.
pub struct Judge<S: Geometry> {
    colliders: Vec<Option<S::Collider>>,
    movable: Vec<bool>,
    broad: BroadPhase<S>,
}

impl<S: Geometry> Judge<S> {
    /// A judge of the bodies of a world.
    pub fn of(world: &World<S>) -> Self {
        let data = &world.bodies().data;
        Judge {
            colliders: data.iter().map(|d| d.collider.clone()).collect(),
            movable: data.iter().map(|d| d.inverse_mass > 0.0).collect(),
            broad: BroadPhase::default(),
        }
    }
    /// Deepest overlap of any two bodies \[m\]; infinite when a pose is not finite.
    pub fn deepest(&mut self, poses: &[Pose<S>]) -> f64 {
        use carom::{Column, Rotation};
        if poses.iter().any(|p| !p.position.is_finite() || !p.rotation.is_finite()) {
            return f64::INFINITY;
        }
        let with_shape: Vec<usize> = (0..poses.len()).filter(|&i| self.colliders[i].is_some()).collect();
        let collider = |k: usize| self.colliders[with_shape[k]].as_ref().expect("chosen for its shape");
        let pose = |k: usize| &poses[with_shape[k]];
        let bounds: Vec<Aabb<S>> =
            (0..with_shape.len()).map(|k| S::bounds(collider(k), pose(k), 0.0)).collect();
        let movable: Vec<bool> = with_shape.iter().map(|&i| self.movable[i]).collect();
        let (mut deepest, mut points) = (0.0, Vec::new());
        for &(i, j) in self.broad.update(&bounds, &movable, &|_, _| true) {
            let (i, j) = (i as usize, j as usize);
            points.clear();
            S::contacts(collider(i), pose(i), collider(j), pose(j), 0.0, &mut points);
            deepest = points.iter().fold(deepest, |d: f64, p| d.max(-p.gap));
        }
        deepest
    }
}
