//! Patches of faces that are seen anew, laid eight at a time: what is found of pairs waits until so many are together. A patch is
//! what it would be alone, bit for bit.

use super::again::Sight;
use super::batch::HALF;
use super::face::{Laid, Outline};
use super::memory::{PatchForce, Seen};
use super::patches::{Begun, write_patches};
use crate::abreast::{Abreast, Quartet};
use crate::material::Coefficients;
use carom_geometry::Geometry;
use carom_math::lanes::{Four, Job, Lanes, WIDTH, dispatch};
use carom_solver::soft::{EightPatches, Numbers, Patch, Patches};

/// Faces whose patches are not laid yet, at most eight.
pub(super) struct Waiting<S: Geometry> {
    faces: Vec<New<S>>,
    room: EightPatches<S>,
    laid: [Patch<S>; WIDTH],
}

/// A face that was seen anew.
#[derive(Clone, Copy)]
struct New<S: Geometry> {
    /// Place of its patch, and of what was seen of it.
    patch: usize,
    seen: usize,
    /// What it starts from.
    force: PatchForce<S>,
    friction: f32,
    spinning: f32,
}

impl<S: Geometry> Default for Waiting<S> {
    fn default() -> Self {
        Waiting { faces: Vec::new(), room: EightPatches::default(), laid: [Patch::none(); WIDTH] }
    }
}

impl<S: Geometry> Waiting<S> {
    /// Forgets those that wait.
    pub fn clear(&mut self) {
        self.faces.clear();
    }

    /// Adds a face with the forces that it starts from, by the places of its patch and of what was seen of it; true where eight are
    /// together.
    #[inline]
    pub fn add(
        &mut self,
        (patch, seen): (usize, usize),
        force: PatchForce<S>,
        coefficients: &Coefficients,
    ) -> bool {
        let (friction, spinning) = (coefficients.friction as f32, coefficients.spinning as f32);
        self.faces.push(New { patch, seen, force, friction, spinning });
        self.faces.len() == WIDTH
    }

    /// Lays those that wait, for a step whose substeps have length `h` \[s\].
    pub fn lay(&mut self, seen: &[Seen<S>], h: f32, patches: &mut Patches<S>) {
        if self.faces.is_empty() {
            return;
        }
        let Waiting { faces, room, laid } = self;
        dispatch(Laying { faces, seen, h, room, laid });
        for (face, patch) in faces.iter().zip(laid) {
            patches.replace(face.patch, patch);
        }
        faces.clear();
    }
}

/// Lays patches of faces.
struct Laying<'a, S: Geometry> {
    faces: &'a [New<S>],
    seen: &'a [Seen<S>],
    h: f32,
    room: &'a mut EightPatches<S>,
    laid: &'a mut [Patch<S>; WIDTH],
}

impl<S: Geometry> Job for Laying<'_, S> {
    type Output = ();
    #[inline(always)]
    fn work<L: Lanes>(mut self, lanes: L) {
        self.half(lanes, 0);
        if self.faces.len() > HALF {
            self.half(lanes, HALF);
        }
        self.room.part(lanes, self.laid);
    }
}

impl<S: Geometry> Laying<'_, S> {
    /// Lays four of them, from this one on; the last one stands for those that are not there.
    #[inline(always)]
    fn half<L: Lanes>(&mut self, lanes: L, first: usize) {
        let face = |lane: usize| &self.faces[(first + lane).min(self.faces.len() - 1)];
        // an outline does not ask who is small
        let sight = |face: &New<S>| Sight { seen: &self.seen[face.seen], a_is_small: false };
        let faces = [face(0), face(1), face(2), face(3)];
        let sights = [sight(faces[0]), sight(faces[1]), sight(faces[2]), sight(faces[3])];
        let (faces, sights) = (Quartet(lanes, &faces), Quartet(lanes, &sights));
        let outline = Outline::of(sights);
        let places = [sights.several(|s, k| s.seen.places[0][k]), sights.several(|s, k| s.seen.places[1][k])];
        let begun = Begun {
            normal: faces.several(|face, i| face.force.normal[i]),
            rubbing: Some((
                faces.several(|face, k| face.force.friction[k]),
                faces.read(|face| face.force.twist),
            )),
        };
        let mut room = self.room.half(first > 0);
        let lever = write_patches(&mut room, (&outline, &Laid::of(&outline)), places, &begun, self.h);
        let (levers, mut friction, mut twisting) = (lever.store(), [0.0; HALF], [0.0; HALF]);
        for k in 0..HALF {
            let New { friction: own, spinning, .. } = faces.1[k];
            (friction[k], twisting[k]) = (*own, own * levers[k] as f32 + spinning);
        }
        room.set_friction(friction, twisting);
    }
}
