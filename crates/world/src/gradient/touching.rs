//! How a contact's normal, point and gap change with the poses of its bodies. The narrow phase is asked again at poses
//! near by, for the same feature, and differences of fourth order are taken: that serves every pair of shapes, to
//! about 1e-11 of the derivative where surfaces are smooth. One body is moved; what the other does follows, for
//! contacts do not change when both move as one.

use super::lift;
use crate::bodies::Bodies;
use crate::contact_id::contact_id;
use carom_geometry::{ContactPoint, Geometry};
use carom_math::{Column, Pose, Rotation};

/// Steps of the differences over the pair's size, and turns \[rad\].
const STEP: f64 = 2e-4;
/// Gap up to which features are looked for, over the pair's size \[1\].
const REACH: f64 = 0.02;
/// Cosine below which a contact of the same name is another one \[1\].
const ONE_SIDE: f64 = 0.7;
/// How far a feature may go in a difference that changes its name, in steps \[1\].
const NEAR: f64 = 20.0;
/// The multiples of the step, and their weights.
const STENCIL: [(f64, f64); 4] =
    [(1.0, 8.0 / 12.0), (-1.0, -8.0 / 12.0), (2.0, -1.0 / 12.0), (-2.0, 1.0 / 12.0)];

/// A contact's place: normal, point, gap.
#[derive(Clone, Copy, Debug, Default)]
pub struct Spot {
    /// Unit normal from b to a, or its change.
    pub normal: [f64; 3],
    /// The common point \[m\], or its change.
    pub point: [f64; 3],
    /// Distance of the surfaces \[m\], or its change.
    pub gap: f64,
}

impl Spot {
    fn add(&mut self, other: &Spot, k: f64) {
        for i in 0..3 {
            self.normal[i] += k * other.normal[i];
            self.point[i] += k * other.point[i];
        }
        self.gap += k * other.gap;
    }
}

/// Changes of a contact with a's place, a's turn, b's place and b's turn, 3 + 3 + 3 + 3.
pub type SpotSlopes = [Spot; 12];

/// Two bodies at given poses of their centres of mass, and the contacts at poses near by.
pub struct Nearby<S: Geometry> {
    pair: (u64, u64),
    /// True when a is the one that was moved.
    moves_a: bool,
    poses: [Pose<S>; 2],
    step: f64,
    /// The contacts at the poses themselves.
    pub here: Vec<ContactPoint<S>>,
    /// For each coordinate of the moved body (place, turn: 3 + 3; unused ones empty) the contacts of the stencil.
    samples: [Vec<Vec<ContactPoint<S>>>; 6],
}

impl<S: Geometry> Nearby<S> {
    /// Looks around poses of bodies `a` and `b`; `None` when one has no shape.
    pub fn of(bodies: &Bodies<S>, (a, b): (usize, usize), poses: [Pose<S>; 2]) -> Option<Self> {
        let data = [&bodies.data[a], &bodies.data[b]];
        let colliders = [data[0].collider.as_ref()?, data[1].collider.as_ref()?];
        let moves_a = data[0].extent <= data[1].extent;
        let moved = usize::from(!moves_a);
        let size = data[moved].extent;
        let step = STEP * size;
        // near the origin rounding is that of the bodies' size
        let origin = poses[moved].position;
        let contacts = |change: &dyn Fn(&mut Pose<S>)| {
            let mut here = poses.map(|p| Pose::new(p.position - origin, p.rotation));
            change(&mut here[moved]);
            let place = |k: usize| {
                let p = &here[k];
                Pose::new(p.position - p.rotation.rotate(data[k].mass_properties.center), p.rotation)
            };
            let mut out = Vec::new();
            S::contacts(colliders[0], &place(0), colliders[1], &place(1), REACH * size, &mut out);
            for p in &mut out {
                p.point += origin;
            }
            out
        };
        let mut samples: [Vec<Vec<ContactPoint<S>>>; 6] = std::array::from_fn(|_| Vec::new());
        for &k in lift::ways::<S>() {
            let unit = |h: f64| {
                lift::to_vector::<S>(&std::array::from_fn::<f64, 3, _>(|i| if i == k { h } else { 0.0 }))
            };
            samples[k] = STENCIL.map(|(m, _)| contacts(&|p| p.position += unit(m * step))).into();
        }
        for &k in lift::turns::<S>() {
            let unit = |h: f64| {
                lift::to_spin::<S>(&std::array::from_fn::<f64, 3, _>(|i| if i == k { h } else { 0.0 }))
            };
            let turn = |m: f64| S::Rotation::about(unit(m * STEP));
            samples[3 + k] =
                STENCIL.map(|(m, _)| contacts(&|p| p.rotation = p.rotation.then(&turn(m)))).into();
        }
        let here = contacts(&|_| ());
        Some(Nearby { pair: (data[0].serial, data[1].serial), moves_a, poses, step, here, samples })
    }

    /// The changes of one contact; `None` where it is not found near by.
    pub fn slopes(&self, id: u64, normal: S::Vector, point: S::Vector) -> Option<SpotSlopes> {
        let mut moved = [Spot::default(); 6];
        let axes = lift::ways::<S>().iter().map(|&k| (k, self.step));
        for (k, step) in axes.chain(lift::turns::<S>().iter().map(|&k| (3 + k, STEP))) {
            for (found, (_, weight)) in self.samples[k].iter().zip(STENCIL) {
                let p = self.same(found, id, normal, point)?;
                moved[k].add(&spot::<S>(p), weight / step);
            }
        }
        Some(self.both(&moved, lift::vector::<S>(normal), lift::vector::<S>(point)))
    }

    /// The same feature among contacts near by, by name or else by place.
    fn same<'a>(
        &self,
        found: &'a [ContactPoint<S>],
        id: u64,
        normal: S::Vector,
        point: S::Vector,
    ) -> Option<&'a ContactPoint<S>> {
        let sided = || found.iter().filter(|p| p.normal.dot(normal) > ONE_SIDE);
        let named = sided().find(|p| contact_id(self.pair.0, self.pair.1, p.feature) == id);
        let far = |p: &&ContactPoint<S>| (p.point - point).norm();
        named.or_else(|| {
            let nearest = sided().min_by(|x, y| far(x).total_cmp(&far(y)))?;
            ((nearest.point - point).norm() <= NEAR * self.step).then_some(nearest)
        })
    }

    /// From the moved body's changes those of both: contacts go along with a common motion.
    fn both(&self, moved: &[Spot; 6], normal: [f64; 3], point: [f64; 3]) -> SpotSlopes {
        let [a, b] = self.poses.map(|p| lift::vector::<S>(p.position));
        let (mover, other) = if self.moves_a { (a, b) } else { (b, a) };
        let (first, second) = if self.moves_a { (0, 6) } else { (6, 0) };
        let mut all = [Spot::default(); 12];
        all[first..first + 6].copy_from_slice(moved);
        let between = [0, 1, 2].map(|k| mover[k] - other[k]);
        let arm = [0, 1, 2].map(|k| point[k] - other[k]);
        for &k in lift::ways::<S>() {
            let unit: [f64; 3] = std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
            let mut common = Spot { point: unit, ..Spot::default() };
            common.add(&moved[k], -1.0);
            all[second + k] = common;
        }
        for &k in lift::turns::<S>() {
            let unit: [f64; 3] = std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
            let mut common = Spot { normal: cross(unit, normal), point: cross(unit, arm), gap: 0.0 };
            common.add(&moved[3 + k], -1.0);
            let swung = cross(unit, between);
            (0..3).for_each(|j| common.add(&moved[j], -swung[j]));
            all[second + 3 + k] = common;
        }
        all
    }
}

fn spot<S: Geometry>(p: &ContactPoint<S>) -> Spot {
    Spot { normal: lift::vector::<S>(p.normal), point: lift::vector::<S>(p.point), gap: p.gap }
}

/// A contact that goes along with both bodies half and half (with one alone where the other is an obstacle), its normal
/// held: where it is not found near by.
pub fn carried(movable: (bool, bool)) -> SpotSlopes {
    let mut all = [Spot::default(); 12];
    let (a, b) = match movable {
        (true, true) => (0.5, 0.5),
        (true, false) => (1.0, 0.0),
        (false, _) => (0.0, 1.0),
    };
    for k in 0..3 {
        all[k].point[k] = a;
        all[6 + k].point[k] = b;
    }
    all
}

/// Vector product of plain columns.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Scalar product of plain columns.
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
