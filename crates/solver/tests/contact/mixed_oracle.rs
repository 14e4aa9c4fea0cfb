//! Whether a problem with rows and moments must have a solution, from a cone program given to clarabel.

use crate::contact::oracle::{columns, minimum};
use carom_math::Space;
use carom_solver::delassus::delassus;
use carom_solver::prepared::Prepared;
use carom_solver::{ContactProblem, Impulses};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{NonnegativeConeT, SecondOrderConeT, SupportedConeT, ZeroConeT};

/// A part of a contact's friction: its normal row, its coefficient, its own rows.
type Part = (usize, f64, Vec<usize>);

fn parts<S: Space>(problem: &ContactProblem<S>) -> Vec<Part> {
    let width = 1 + S::SLIP;
    let moments = problem.contacts.len() * width + problem.rows.len();
    let sliding = problem.contacts.iter().enumerate();
    let sliding = sliding.map(|(i, c)| (i * width, c.friction, (i * width + 1..(i + 1) * width).collect()));
    let turning = problem.resistances.iter().enumerate().flat_map(|(k, r)| {
        let (head, first) = (r.contact * width, moments + k * S::SPIN);
        let rolling = (head, r.rolling, (first..first + S::SPIN.min(2)).collect());
        let spinning = (head, r.spinning, (first + 2..first + S::SPIN).collect());
        [rolling, spinning].into_iter().take(if S::SPIN == 1 { 1 } else { 2 })
    });
    sliding.chain(turning).collect()
}

/// The largest t <= 1 with u_n >= sum over the parts of c |u_part| + t q at every contact, q the largest velocity without
/// impulses, and u = 0 at every equality row: above 0 a solution exists.
pub fn strict_feasibility<S: Space>(problem: &ContactProblem<S>) -> f64 {
    let w = delassus(problem).dense();
    let q = Prepared::of(problem).velocity_errors(problem, &Impulses::zero(problem));
    let (n, width, parts) = (q.len(), 1 + S::SLIP, parts(problem));
    let speed = q.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let mass = (0..n).map(|i| w[i][i]).sum::<f64>() / n as f64;
    // unknowns: impulses, t, and a bound of |u_part| for every part
    let unknowns = n + 1 + parts.len();
    let (mut a, mut b) = (Vec::new(), Vec::new());
    let mut cones: Vec<SupportedConeT<f64>> = Vec::new();
    let mut push = |velocity: Option<usize>, others: &[(usize, f64)], one: f64| {
        let mut row = vec![0.0; unknowns];
        if let Some(k) = velocity {
            (0..n).for_each(|j| row[j] = -w[k][j] / mass);
        }
        others.iter().for_each(|(j, x)| row[*j] = *x);
        a.push(row);
        b.push(velocity.map_or(one, |k| q[k] / speed));
    };
    let moments = problem.contacts.len() * width + problem.rows.len();
    for k in problem.contacts.len() * width..moments {
        push(Some(k), &[], 0.0);
        cones.push(ZeroConeT(1));
    }
    push(None, &[(n, 1.0)], 1.0);
    cones.push(NonnegativeConeT(1));
    for head in (0..problem.contacts.len()).map(|i| i * width) {
        let bounds = parts.iter().enumerate().filter(|(_, p)| p.0 == head).map(|(k, p)| (n + 1 + k, p.1));
        push(Some(head), &[(n, 1.0)].into_iter().chain(bounds).collect::<Vec<_>>(), 0.0);
        cones.push(NonnegativeConeT(1));
    }
    for (k, (_, _, rows)) in parts.iter().enumerate() {
        push(None, &[(n + 1 + k, -1.0)], 0.0);
        rows.iter().for_each(|&row| push(Some(row), &[], 0.0));
        cones.push(SecondOrderConeT(1 + rows.len()));
    }
    let mut cost = vec![0.0; unknowns];
    cost[n] = -1.0;
    let none = CscMatrix::new(unknowns, unknowns, vec![0; unknowns + 1], Vec::new(), Vec::new());
    minimum(&none, &cost, &columns(&a, unknowns), &b, &cones).map_or(f64::NEG_INFINITY, |x| x[n])
}
