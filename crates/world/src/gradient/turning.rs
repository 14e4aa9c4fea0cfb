//! Free rotation and its derivative: the rotation methods of `integrate` in dual numbers (theory eqs. 2.8 to 2.12),
//! so that what is differentiated is what was done. Attitudes change by small rotation vectors in world axes.

use super::dual::{Attitude, Column3, Dual};
use super::lift;
use crate::bodies::Bodies;
use crate::integrate::{Integrator, turns_steadily};
use carom_geometry::Geometry;

/// Fixed-point rounds of the midpoint rule; values and derivatives settle together.
const ROUNDS: usize = 60;
/// Most halvings where the fixed point does not settle, as the integrator has it.
const HALVINGS: usize = 12;

/// How a body turns freely.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Manner {
    Steady,
    Split,
    Midpoint,
}

/// What free rotation needs of a body.
pub struct Spinning {
    manner: Manner,
    inertia: [[f64; 3]; 3],
    inverse: [[f64; 3]; 3],
    principal: [f64; 3],
    axes: [f64; 4],
}

/// Derivative of a rotation: for each input (turn, spin, time: 3 + 3 + 1) the turn and the spin at the end.
pub struct Slopes(Vec<[f64; 6]>);

impl Slopes {
    /// Takes cotangents of turn and spin at the end to those at the start and of the time.
    pub fn pull(&self, turn: [f64; 3], spin: [f64; 3]) -> ([f64; 3], [f64; 3], f64) {
        let of = |row: &[f64; 6]| -> f64 { (0..3).map(|k| row[k] * turn[k] + row[3 + k] * spin[k]).sum() };
        let at = |first: usize| std::array::from_fn(|k| of(&self.0[first + k]));
        (at(0), at(3), of(&self.0[6]))
    }
}

impl Spinning {
    /// What body `i` needs.
    pub fn of<S: Geometry>(bodies: &Bodies<S>, i: usize, integrator: Integrator) -> Self {
        let d = &bodies.data[i];
        let manner = match integrator {
            _ if turns_steadily(bodies, i) => Manner::Steady,
            Integrator::ImplicitMidpoint => Manner::Midpoint,
            _ => Manner::Split,
        };
        let p = lift::spin::<S>(d.principal);
        Spinning {
            manner,
            inertia: lift::inertia::<S>(&d.mass_properties.inertia),
            inverse: lift::inertia::<S>(&d.inverse_inertia),
            principal: p,
            axes: lift::rotation::<S>(&d.axes),
        }
    }

    /// The derivative of the same rotation.
    pub fn slopes(&self, q: [f64; 4], w: [f64; 3], time: f64) -> Slopes {
        let unit = |on: bool, k: usize| std::array::from_fn(|i| if on && i == k { 1.0 } else { 0.0 });
        let along = |k: usize| {
            let attitude = Attitude::turned(q, unit(k < 3, k));
            let spin = Column3::new(w, unit((3..6).contains(&k), k.wrapping_sub(3)));
            let time = Dual::new(time, if k == 6 { 1.0 } else { 0.0 });
            let (q, w) = self.flow(attitude, spin, time, HALVINGS);
            let ([a, b, c], [x, y, z]) = (q.slope(), w.slope());
            [a, b, c, x, y, z]
        };
        Slopes((0..7).map(along).collect())
    }

    fn flow(&self, q: Attitude, w: Column3, time: Dual, halvings: usize) -> (Attitude, Column3) {
        if self.manner == Manner::Steady {
            return (q.then(Attitude::about(w.times(time))), w);
        }
        let momentum = q.rotate(apply(&self.inertia, q.unrotate(w)));
        let end = match self.manner {
            Manner::Midpoint => match self.midpoint(q, momentum, time) {
                Some(end) => end,
                None if halvings == 0 => return (q, w),
                None => {
                    let (q, w) = self.flow(q, w, time * 0.5, halvings - 1);
                    return self.flow(q, w, time * 0.5, halvings - 1);
                }
            },
            _ => self.split(q, momentum, time),
        };
        (end, end.rotate(apply(&self.inverse, end.unrotate(momentum))))
    }

    fn split(&self, q: Attitude, momentum: Column3, time: Dual) -> Attitude {
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| self.principal[i].total_cmp(&self.principal[j]));
        let [small, middle, large] = order;
        let reference = 1.0 / self.principal[middle];
        let axes = Attitude::turned(self.axes, [0.0; 3]);
        let mut frame = axes.then(q);
        for (axis, share) in [(small, 0.5), (large, 1.0), (small, 0.5)] {
            let excess = 1.0 / self.principal[axis] - reference;
            if excess != 0.0 {
                let along = frame.unrotate(momentum).0[axis];
                let unit = Column3::fixed(std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 }));
                frame =
                    frame.then(Attitude::about(frame.rotate(unit).times(time * along * (share * excess))));
            }
        }
        axes.inverse().then(frame.then(Attitude::about(momentum.times(time * reference))))
    }

    fn midpoint(&self, q: Attitude, momentum: Column3, time: Dual) -> Option<Attitude> {
        let start = q.unrotate(momentum);
        let mut middle = start;
        let size = |c: [f64; 3]| c.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let (large, steep) = (size(start.value()), size(start.slope()) + size(start.value()));
        let mut settled = false;
        for _ in 0..ROUNDS {
            let next = start + middle.cross(apply(&self.inverse, middle)).times(time * 0.5);
            let change = next - middle;
            middle = next;
            settled = size(change.value()) <= 4e-16 * large;
            if settled && size(change.slope()) <= 1e-15 * steep {
                break;
            }
        }
        let turn = Attitude::cayley(apply(&self.inverse, middle).times(time));
        settled.then(|| turn.then(q))
    }
}

/// A matrix times a column.
fn apply(m: &[[f64; 3]; 3], c: Column3) -> Column3 {
    Column3(std::array::from_fn(|i| (0..3).fold(Dual::default(), |sum, j| sum + c.0[j] * m[i][j])))
}
