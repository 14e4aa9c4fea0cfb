//! What a page shows of a world, as one row of numbers: figures of the last steps, the motion, the contacts. The layout
//! is stated here once; `player/playground/live.ts` reads it.

use carom::observe::push::pushes;
use carom::{Column, Geometry, Rotation, StepReport, World};

/// Figures before the motion: time, steps, residual, relative residual, worst a, worst b, iterations, deepest gap,
/// kinetic, potential, contacts, fingerprint's place (unused), then three of momentum, three of angular momentum, and
/// the ledger's fifteen lines.
pub const FIGURES: usize = 33;

/// Figures over the steps since the last frame: the largest residual and its pair, the deepest overlap, iterations.
#[derive(Clone, Copy, Debug)]
pub struct Worst {
    /// Largest residual \[m/s\].
    pub residual: f64,
    /// The same over that of no impulses \[1\].
    pub relative: f64,
    /// Bodies of the worst contact.
    pub between: Option<(usize, usize)>,
    /// Most iterations of a step.
    pub iterations: usize,
    /// Smallest gap \[m\]; NaN without contacts.
    pub gap: f64,
}

impl Default for Worst {
    fn default() -> Self {
        Worst { residual: 0.0, relative: 0.0, between: None, iterations: 0, gap: f64::NAN }
    }
}

impl Worst {
    /// Takes a step in.
    pub fn add<S: Geometry>(&mut self, report: &StepReport<S>) {
        if report.residual() >= self.residual {
            (self.residual, self.relative) = (report.residual(), report.relative_residual());
            self.between = report.worst();
        }
        self.iterations = self.iterations.max(report.iterations());
        self.gap = self.gap.min(report.deepest.map_or(f64::NAN, |(gap, _, _)| gap));
    }
}

/// Writes a world's frame into `out`, in place of what was there.
pub fn write<S: Geometry>(world: &World<S>, worst: &Worst, out: &mut Vec<f64>) {
    out.clear();
    let (energy, momenta) = (world.energy(), world.momenta());
    let (a, b) = worst.between.map_or((-1.0, -1.0), |(a, b)| (a as f64, b as f64));
    let contacts = world.touches().len() as f64;
    out.extend([world.time(), world.steps() as f64, worst.residual, worst.relative, a, b]);
    out.extend([worst.iterations as f64, worst.gap, energy.kinetic(), energy.potential, contacts, 0.0]);
    padded(momenta.linear.as_slice(), out);
    padded(momenta.angular.as_slice(), out);
    out.extend(world.ledger().lines());
    debug_assert_eq!(out.len(), FIGURES);
    let motion = &world.bodies().motion;
    motion.position.iter().for_each(|v| out.extend(v.as_slice()));
    motion.rotation.iter().for_each(|v| out.extend(v.as_slice()));
    motion.velocity.iter().for_each(|v| out.extend(v.as_slice()));
    motion.angular_velocity.iter().for_each(|v| out.extend(v.as_slice()));
    for (touch, push) in world.touches().iter().zip(pushes(world)) {
        out.extend([touch.a as f64, touch.b as f64]);
        out.extend(touch.point.as_slice());
        out.extend(touch.normal.as_slice());
        out.extend([touch.gap, push.total.normal]);
        out.extend(push.friction(touch).as_slice());
        out.extend(push.slip.as_slice());
        out.push(push.status(touch) as f64);
    }
}

/// Three numbers, zeros where a space has fewer.
fn padded(values: &[f64], out: &mut Vec<f64>) {
    out.extend((0..3).map(|k| values.get(k).copied().unwrap_or(0.0)));
}
