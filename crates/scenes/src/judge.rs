//! The judge: how deep bodies overlap, found in f64 from poses alone, whoever made them. Knows no step and no contact of
//! an engine.

use carom::geometry::broad_phase::BroadPhase;
use carom::geometry::{Aabb, Geometry};
use carom::{Column, Pose, Rotation, World};

/// The shapes of a scene.
pub struct Judge<S: Geometry> {
    colliders: Vec<Option<S::Collider>>,
    /// Largest extent of each body \[m\].
    sizes: Vec<f64>,
    movable: Vec<bool>,
    broad: BroadPhase<S>,
}

/// How deep two bodies overlap.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Overlap {
    /// Depth \[m\].
    pub depth: f64,
    /// Depth over the largest extent of the smaller body \[1\].
    pub over_size: f64,
    /// The bodies, by index.
    pub bodies: (usize, usize),
}

impl<S: Geometry> Judge<S> {
    /// A judge of the bodies of a world.
    pub fn of(world: &World<S>) -> Self {
        let data = &world.bodies().data;
        Judge {
            colliders: data.iter().map(|d| d.collider.clone()).collect(),
            sizes: data.iter().map(|d| d.extent).collect(),
            movable: data.iter().map(|d| d.inverse_mass > 0.0).collect(),
            broad: BroadPhase::default(),
        }
    }
    /// Deepest overlap of any two bodies \[m\]; infinite when a pose is not finite.
    pub fn deepest(&mut self, poses: &[Pose<S>]) -> f64 {
        self.worst_by(poses, |overlap| overlap.depth).depth
    }
    /// The overlap that is deepest over its bodies' size; infinite when a pose is not finite, zero without any.
    pub fn worst(&mut self, poses: &[Pose<S>]) -> Overlap {
        self.worst_by(poses, |overlap| overlap.over_size)
    }
    /// The same of a world as it is.
    pub fn worst_of(&mut self, world: &World<S>) -> Overlap {
        let bodies = world.bodies();
        let poses: Vec<Pose<S>> = (0..bodies.len()).map(|i| bodies.shape_pose(i)).collect();
        self.worst(&poses)
    }

    fn worst_by(&mut self, poses: &[Pose<S>], measure: impl Fn(&Overlap) -> f64) -> Overlap {
        if poses.iter().any(|p| !p.position.is_finite() || !p.rotation.is_finite()) {
            return Overlap { depth: f64::INFINITY, over_size: f64::INFINITY, bodies: (0, 0) };
        }
        let with_shape: Vec<usize> = (0..poses.len()).filter(|&i| self.colliders[i].is_some()).collect();
        let collider = |k: usize| self.colliders[with_shape[k]].as_ref().expect("chosen for its shape");
        let pose = |k: usize| &poses[with_shape[k]];
        let bounds: Vec<Aabb<S>> =
            (0..with_shape.len()).map(|k| S::bounds(collider(k), pose(k), 0.0)).collect();
        let movable: Vec<bool> = with_shape.iter().map(|&i| self.movable[i]).collect();
        let (mut worst, mut points) = (Overlap::default(), Vec::new());
        for &(i, j) in self.broad.update(&bounds, &movable, &|_, _| true) {
            let (i, j) = (i as usize, j as usize);
            points.clear();
            S::contacts(collider(i), pose(i), collider(j), pose(j), 0.0, &mut points);
            let depth = points.iter().fold(0.0, |d: f64, p| d.max(-p.gap));
            let bodies = (with_shape[i], with_shape[j]);
            let size = self.sizes[bodies.0].min(self.sizes[bodies.1]);
            let found = Overlap { depth, over_size: depth / size, bodies };
            if measure(&found) > measure(&worst) {
                worst = found;
            }
        }
        worst
    }
}
