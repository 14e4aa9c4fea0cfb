//! The judge of overlap: how deep bodies overlap, found in f64 from poses alone, whoever made them. Knows no engine.

use crate::scene::{Kind, Scene, finite};
use carom::geometry::{Aabb, BroadPhase};
use carom::{Geometry, Pose};

/// The shapes of a scene, made ready for looking.
pub struct Judge<S: Geometry> {
    colliders: Vec<S::Collider>,
    movable: Vec<bool>,
    /// Bounds of the bodies where they began; those of fixed ones stay.
    bounds: Vec<Aabb<S>>,
    broad: BroadPhase<S>,
}

/// Overlap of a whole scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Overlap {
    /// Of the pair that overlaps deepest \[m\]; infinite when a pose is not finite.
    pub deepest: f64,
    /// Mean over the pairs that overlap \[m\]; 0 when none does.
    pub mean: f64,
    /// Pairs that overlap.
    pub pairs: usize,
}

impl<S: Geometry> Judge<S> {
    /// A judge of a scene.
    ///
    /// # Errors
    /// The shape that is none.
    pub fn of(scene: &Scene<S>) -> Result<Self, String> {
        let colliders = scene.bodies.iter().map(|b| S::collider(&b.shape)).collect::<Result<Vec<_>, _>>();
        let colliders = colliders.map_err(|e| format!("{}: {e}", scene.name))?;
        let bounds = colliders.iter().zip(&scene.bodies).map(|(c, b)| S::bounds(c, &b.pose, 0.0)).collect();
        let movable = scene.bodies.iter().map(|b| b.kind != Kind::Fixed).collect();
        Ok(Judge { colliders, movable, bounds, broad: BroadPhase::default() })
    }

    /// Looks at the poses of all bodies. Two bodies overlap as deep as the deepest of their contact points.
    pub fn look(&mut self, poses: &[Pose<S>]) -> Overlap {
        if !poses.iter().all(finite) {
            return Overlap { deepest: f64::INFINITY, mean: f64::INFINITY, pairs: 0 };
        }
        for (i, pose) in poses.iter().enumerate().filter(|(i, _)| self.movable[*i]) {
            self.bounds[i] = S::bounds(&self.colliders[i], pose, 0.0);
        }
        let (mut found, mut sum, mut points) = (Overlap::default(), 0.0, Vec::new());
        for &(i, j) in self.broad.update(&self.bounds, &self.movable, &|_, _| true) {
            let (i, j) = (i as usize, j as usize);
            points.clear();
            S::contacts(&self.colliders[i], &poses[i], &self.colliders[j], &poses[j], 0.0, &mut points);
            let depth = points.iter().fold(0.0, |d: f64, p| d.max(-p.gap));
            if depth > 0.0 {
                found.pairs += 1;
                sum += depth;
                found.deepest = found.deepest.max(depth);
            }
        }
        found.mean = if found.pairs > 0 { sum / found.pairs as f64 } else { 0.0 };
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Arena, Asks, Body};
    use carom::{Planar, Spatial};

    fn two_boxes_overlap_as_deep_as_they_were_put<S: Arena>() {
        let body = |x: f64| Body::<S>::new(Kind::Dynamic, S::block(1.0, 1.0, 1.0), S::place(x, 0.0));
        let scene = Scene {
            name: "two:1".into(),
            steps: 1,
            bodies: vec![body(0.0), body(0.99), body(3.0)],
            asks: Asks::default(),
        };
        let poses: Vec<Pose<S>> = scene.bodies.iter().map(|b| b.pose).collect();
        let found = Judge::of(&scene).expect("boxes").look(&poses);
        assert!((found.deepest - 0.01).abs() < 1e-12, "{found:?}");
        assert!((found.mean - 0.01).abs() < 1e-12 && found.pairs == 1, "{found:?}");
    }

    #[test]
    fn two_boxes_overlap_as_deep_as_they_were_put_in_both_spaces() {
        two_boxes_overlap_as_deep_as_they_were_put::<Planar>();
        two_boxes_overlap_as_deep_as_they_were_put::<Spatial>();
    }
}
