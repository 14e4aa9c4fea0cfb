//! In which registers an operation runs. What runs in the widest that there are works number by number, or sums as `whole`
//! does, and has the same bits in all of them. What would leave wide registers half empty runs in those of four; where a
//! machine has none most of it multiplies and adds one after another, and has other bits. Knows no operation.

use pulp::{Arch, WithSimd};

/// Numbers that a sum is made of side by side, in registers of any width: as many as the widest holds.
pub const ABREAST: usize = 8;

/// Runs an operation with the widest registers of the machine.
pub fn in_widest<O: WithSimd>(operation: O) -> O::Output {
    #[cfg(test)]
    let operation = match tests::asked(operation) {
        Ok(out) => return out,
        Err(operation) => operation,
    };
    Arch::new().dispatch(operation)
}

/// Runs an operation with registers of four where the machine has them: wider ones would be half empty.
pub fn in_fours<O: WithSimd>(operation: O) -> O::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return pulp::Simd::vectorize(simd, operation);
    }
    Arch::new().dispatch(operation)
}

/// The sum of numbers that were summed side by side: of halves, then of halves of these, whatever registers they came in.
#[inline(always)]
pub fn whole(abreast: [f64; ABREAST]) -> f64 {
    let [a, b, c, d, e, f, g, h] = abreast;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, ContactProblem, Impulses, InverseMass, Progress, SolveSettings, SolverKind, Twist};
    use carom_math::{Column, Inertia, Planar, Space, Spatial};
    use std::cell::Cell;

    thread_local! {
        /// What this thread takes for the widest registers; the machine's where nothing is said.
        static ASKED: Cell<Option<usize>> = const { Cell::new(None) };
    }

    /// Runs an operation in registers of the width that was asked for; gives it back where none was.
    pub fn asked<O: WithSimd>(operation: O) -> Result<O::Output, O> {
        match ASKED.get() {
            None => Err(operation),
            Some(1) => Ok(operation.with_simd(pulp::Scalar::new())),
            _ => in_eights(operation),
        }
    }

    /// Two registers of four side by side are one of eight.
    #[cfg(target_arch = "x86_64")]
    fn in_eights<O: WithSimd>(operation: O) -> Result<O::Output, O> {
        match pulp::x86::V3::try_new() {
            Some(simd) => Ok(pulp::Simd::vectorize(pulp::x86::V3_512b(simd), operation)),
            None => Err(operation),
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    fn in_eights<O: WithSimd>(operation: O) -> Result<O::Output, O> {
        Err(operation)
    }

    /// What `work` comes to where the widest registers are of this width.
    fn at_width<T>(width: Option<usize>, work: impl FnOnce() -> T) -> T {
        ASKED.set(width);
        let out = work();
        ASKED.set(None);
        out
    }

    fn axis<C: Column>(k: usize, length: f64) -> C {
        C::from_fn(|i| if i == k { length } else { 0.0 })
    }

    /// An upright square of n x n balls on a floor, body 0, each pushed another way.
    fn square<S: Space>(n: usize, friction: f64) -> ContactProblem<S> {
        let up = S::DIM - 1;
        let fixed = InverseMass { linear: 0.0, angular: S::Inertia::ZERO };
        let mut problem = ContactProblem::new(vec![fixed], vec![Twist::default()]);
        let place = |i: usize, j: usize| 1 + j * n + i;
        for k in 0..n * n {
            let entries: Vec<f64> =
                if S::SPIN == 1 { vec![8.0] } else { vec![10.0, 10.0, 10.0, 0.0, 0.0, 0.0] };
            let angular = S::Inertia::from_entries(&entries).expect("a ball has six numbers in space");
            problem.inverse_masses.push(InverseMass { linear: 1.0 / (1.0 + 0.1 * k as f64), angular });
            let push = |i: usize| ((7 * k + 3 * i) as f64).sin() - if i == up { 0.5 } else { 0.0 };
            problem.velocities.push(Twist::new(S::Vector::from_fn(push), S::Spin::ZERO));
        }
        for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
            let below = if j == 0 { 0 } else { place(i, j - 1) };
            let beside = (i > 0).then(|| (0, place(i - 1, j)));
            for (k, other) in [(up, below)].into_iter().chain(beside) {
                problem.contacts.push(Contact {
                    id: problem.contacts.len() as u64,
                    a: place(i, j),
                    b: other,
                    normal: axis(k, 1.0),
                    arm_a: axis(k, -0.5),
                    arm_b: axis(k, 0.5),
                    gap: 0.0,
                    target: 0.0,
                    slip_target: S::Slip::ZERO,
                    restitution: 0.0,
                    friction,
                });
            }
        }
        problem
    }

    /// Impulses, factorisations and stages of a solve.
    fn solved<S: Space>(
        problem: &ContactProblem<S>,
        width: Option<usize>,
    ) -> (Vec<u64>, usize, Vec<&'static str>) {
        at_width(width, || {
            let (mut impulses, mut stages) = (Impulses::zero(problem), Vec::new());
            let settings = SolveSettings { tolerance: 1e-10, ..SolveSettings::default() };
            let mut watch = |progress: &Progress| {
                stages.push(progress.stage);
                true
            };
            let mut solver = SolverKind::Exact.make();
            let outcome = solver.solve_watched(problem, &settings, &mut impulses, &mut watch);
            let bits = impulses.contacts.iter().flat_map(|g| {
                let tangent = (0..S::DIM - 1).map(|k| g.tangent[k].to_bits());
                std::iter::once(g.normal.to_bits()).chain(tangent)
            });
            let bits = bits.collect();
            stages.dedup();
            (bits, outcome.factorisations, stages)
        })
    }

    fn a_solve_has_the_same_bits<S: Space>() {
        for (n, friction) in [(6, 0.5), (7, 0.2), (9, 0.0)] {
            let problem = square::<S>(n, friction);
            let own = solved(&problem, None);
            let passes = friction == 0.0 || own.2.contains(&"interior point");
            assert!(passes && own.1 > 0, "{n} {friction}: {} factorisations, {:?}", own.1, own.2);
            for width in [1, 8] {
                assert!(solved(&problem, Some(width)) == own, "{n} {friction} in registers of {width}");
            }
        }
    }

    #[test]
    fn an_exact_solve_has_the_same_bits_in_registers_of_one_of_eight_and_of_the_machine() {
        a_solve_has_the_same_bits::<Planar>();
        a_solve_has_the_same_bits::<Spatial>();
    }
}
