//! Stressed friction problems: q + a |q| W y / |W y| with y uniform in \[-1, 1\], and friction times a factor. What
//! is added lies in the range of W, as the velocities that impulses make do.

use crate::chance::Chance;
use carom::solver::FrictionProblem;

/// Sizes of the added velocities over |q| \[1\].
pub const AMPLITUDES: [f64; 5] = [0.01, 0.1, 0.5, 2.0, 0.0];
/// Factors on friction \[1\].
pub const FRICTION_FACTORS: [f64; 3] = [0.3, 1.0, 1.7];

fn length(x: &[f64]) -> f64 {
    x.iter().map(|a| a * a).sum::<f64>().sqrt()
}

/// The problem with random velocities of the given size over |q| added and friction times a factor.
pub fn stressed(
    problem: &FrictionProblem,
    amplitude: f64,
    friction_factor: f64,
    seed: u64,
) -> FrictionProblem {
    let mut chance = Chance::new(seed);
    let y: Vec<f64> = problem.velocity.iter().map(|_| chance.between(-1.0, 1.0)).collect();
    let added = problem.matrix.times(&y);
    let mut out = problem.clone();
    let size = length(&added);
    if size > 0.0 {
        let scale = amplitude * length(&problem.velocity) / size;
        out.velocity.iter_mut().zip(&added).for_each(|(q, w)| *q += scale * w);
    }
    out.friction.iter_mut().for_each(|mu| *mu *= friction_factor);
    out
}
