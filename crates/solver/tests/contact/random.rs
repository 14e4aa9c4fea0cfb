//! Friction problems in matrix form whose solution is chosen first: per contact an impulse and a velocity that
//! Coulomb's law allows together (take-off, stick, slip, or the borders between them), then W and
//! q = u - W r. Numbered: a family, a dimension, a size and a seed name a problem for ever. Knows no solver.

use crate::common::Random;
use carom_solver::{Csr, FrictionProblem};

/// What a problem is like; the names are those of the project's list of property tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// W = A A^T with more columns than rows.
    FullRank,
    /// W = A A^T of 0.6 of the rank.
    RankDeficient,
    /// Contacts between pairs out of a few bodies: W sparse, its rank at most the bodies' freedoms.
    Sparse,
    /// No friction.
    Frictionless,
    /// Coefficients of friction from 1 to 10.
    HighFriction,
    /// W off symmetry by 1e-3 of its largest entry.
    Asymmetric,
    /// Contacts repeated one to three times; copies share the impulse.
    Duplicated,
    /// Contacts at the borders between take-off, stick and slip.
    Degenerate,
    /// Another unit of impulse for the whole problem, from 1e-4 to 1e12.
    Units,
    /// D W D with D^2 from 1 to 1e12 by contact, as from light and heavy bodies.
    Masses,
    /// Another unit of impulse for every contact, from 1 to 1e12.
    Columns,
}

impl Family {
    /// All families.
    pub const ALL: [Family; 11] = [
        Family::FullRank,
        Family::RankDeficient,
        Family::Sparse,
        Family::Frictionless,
        Family::HighFriction,
        Family::Asymmetric,
        Family::Duplicated,
        Family::Degenerate,
        Family::Units,
        Family::Masses,
        Family::Columns,
    ];
    /// True when some impulses make every contact part (W reaches all velocities), which is enough for a solution
    /// to exist however q is changed.
    pub fn has_full_rank(self) -> bool {
        !matches!(self, Family::RankDeficient | Family::Sparse | Family::Duplicated)
    }
}

/// A problem with one of its solutions.
#[derive(Clone, Debug)]
pub struct Known {
    pub problem: FrictionProblem,
    pub solution: Vec<f64>,
    /// Names the problem: pass it to `known` again.
    pub name: (Family, usize, usize, u64),
}

/// The problem of a family with this dimension (1, 2, 3), number of contacts and seed.
pub fn known(family: Family, dimension: usize, contacts: usize, seed: u64) -> Known {
    let salt = (family as u64) << 48 | (dimension as u64) << 40 | (contacts as u64) << 24;
    let random = &mut Random::new(salt ^ seed);
    let friction: Vec<f64> = (0..contacts)
        .map(|_| match family {
            _ if dimension == 1 => 0.0,
            Family::Frictionless => 0.0,
            Family::HighFriction => random.between(1.0, 10.0),
            _ => random.between(0.1, 1.0),
        })
        .collect();
    let states: Vec<(Vec<f64>, Vec<f64>)> =
        friction.iter().map(|&mu| state(random, family, dimension, mu)).collect();
    let mut w = operator(random, family, dimension, contacts);
    let mut r: Vec<f64> = states.iter().flat_map(|s| s.0.clone()).collect();
    let u: Vec<f64> = states.iter().flat_map(|s| s.1.clone()).collect();
    rescale(random, family, dimension, &mut w, &mut r);
    let (friction, w, r, u) = match family {
        Family::Duplicated => repeated(random, dimension, &friction, &w, &r, &u),
        _ => (friction, w, r, u),
    };
    let q: Vec<f64> =
        w.iter().zip(&u).map(|(row, u)| u - row.iter().zip(&r).map(|(a, b)| a * b).sum::<f64>()).collect();
    let problem = FrictionProblem { dimension, matrix: compressed(&w).into(), velocity: q, friction };
    Known { problem, solution: r, name: (family, dimension, contacts, seed) }
}

/// Impulse and velocity of one contact that fit together.
fn state(random: &mut Random, family: Family, dimension: usize, mu: f64) -> (Vec<f64>, Vec<f64>) {
    let (mut r, mut u) = (vec![0.0; dimension], vec![0.0; dimension]);
    let direction = unit(random, dimension - 1);
    let tangent = |x: &mut [f64], length: f64| {
        x[1..].iter_mut().zip(&direction).for_each(|(x, e)| *x = e * length);
    };
    if family == Family::Degenerate && random.chance(0.4) {
        match random.below(3) {
            // touches without load and without parting; slides without load; is about to slide
            0 => {}
            1 => tangent(&mut u, random.between(0.1, 2.0)),
            _ => {
                r[0] = random.between(0.1, 3.0);
                let limit = mu * r[0];
                tangent(&mut r, limit);
            }
        }
        return (r, u);
    }
    match random.below(3) {
        0 => {
            u[0] = random.between(0.1, 1.0);
            tangent(&mut u, random.between(0.0, 2.0));
        }
        1 if mu > 0.0 => {
            r[0] = random.between(0.1, 3.0);
            let limit = mu * r[0];
            tangent(&mut r, limit * random.between(0.0, 0.9));
        }
        _ => {
            r[0] = random.between(0.1, 3.0);
            let limit = mu * r[0];
            tangent(&mut r, -limit);
            tangent(&mut u, random.between(0.1, 2.0));
        }
    }
    (r, u)
}

/// A unit vector with 0, 1 or 2 entries.
fn unit(random: &mut Random, entries: usize) -> Vec<f64> {
    match entries {
        0 => Vec::new(),
        1 => vec![if random.chance(0.5) { 1.0 } else { -1.0 }],
        _ => {
            let v: carom_math::Vec2 = random.unit();
            vec![v[0], v[1]]
        }
    }
}

/// W before any change of units, dense.
fn operator(random: &mut Random, family: Family, dimension: usize, contacts: usize) -> Vec<Vec<f64>> {
    let n = dimension * contacts;
    let columns = match family {
        Family::RankDeficient => (0.6 * n as f64).ceil() as usize,
        Family::Sparse => 0,
        _ => n + 4,
    };
    let mut a: Vec<Vec<f64>> =
        (0..n).map(|_| (0..columns).map(|_| random.between(-1.0, 1.0)).collect()).collect();
    if family == Family::Sparse {
        let freedoms = [1, 3, 6][dimension - 1];
        let bodies = 1 + contacts * dimension / freedoms;
        a = vec![vec![0.0; bodies * freedoms]; n];
        for i in 0..contacts {
            for body in [random.below(bodies), random.below(bodies)] {
                for row in &mut a[dimension * i..dimension * (i + 1)] {
                    row[body * freedoms..(body + 1) * freedoms].fill_with(|| random.between(-1.0, 1.0));
                }
            }
        }
    }
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(a, b)| a * b).sum::<f64>();
    let mut w: Vec<Vec<f64>> = a.iter().map(|x| a.iter().map(|y| dot(x, y)).collect()).collect();
    if family == Family::Asymmetric {
        let size = w.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (i, j) in (0..n).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let off = 0.5e-3 * size * random.between(-1.0, 1.0);
            w[i][j] += off;
            w[j][i] -= off;
        }
    }
    w
}

/// Changes units: impulses of contact i become r / c_i, its rows of W are multiplied by b_i and its columns by c_i.
fn rescale(random: &mut Random, family: Family, dimension: usize, w: &mut [Vec<f64>], r: &mut [f64]) {
    let contacts = r.len() / dimension;
    let global = 10f64.powf(random.between(-4.0, 12.0));
    for i in 0..contacts {
        let own = 10f64.powf(random.between(0.0, 12.0));
        let (row, column, impulse) = match family {
            Family::Units => (1.0, global, global),
            Family::Masses => (own.sqrt(), own.sqrt(), own),
            Family::Columns => (1.0, own, own),
            _ => (1.0, 1.0, 1.0),
        };
        for k in dimension * i..dimension * (i + 1) {
            r[k] /= impulse;
            w[k].iter_mut().for_each(|x| *x *= row);
            w.iter_mut().for_each(|line| line[k] *= column);
        }
    }
}

type Parts = (Vec<f64>, Vec<Vec<f64>>, Vec<f64>, Vec<f64>);

/// Each contact one to three times; the copies share its impulse.
fn repeated(
    random: &mut Random,
    dimension: usize,
    friction: &[f64],
    w: &[Vec<f64>],
    r: &[f64],
    u: &[f64],
) -> Parts {
    let copies: Vec<usize> = friction.iter().map(|_| 1 + random.below(3)).collect();
    let source: Vec<usize> =
        copies.iter().enumerate().flat_map(|(i, &c)| std::iter::repeat_n(i, c)).collect();
    let rows: Vec<usize> = source.iter().flat_map(|&i| dimension * i..dimension * (i + 1)).collect();
    (
        source.iter().map(|&i| friction[i]).collect(),
        rows.iter().map(|&k| rows.iter().map(|&l| w[k][l]).collect()).collect(),
        rows.iter().map(|&k| r[k] / copies[k / dimension] as f64).collect(),
        rows.iter().map(|&k| u[k]).collect(),
    )
}

/// A dense matrix without its zeros.
pub fn compressed(dense: &[Vec<f64>]) -> Csr {
    let rows = dense
        .iter()
        .map(|row| row.iter().copied().enumerate().filter(|e| e.1 != 0.0).collect::<Vec<(usize, f64)>>());
    Csr::from_rows(dense.len(), rows.collect::<Vec<_>>().into_iter())
}

/// A problem from a dense W.
pub fn from_dense(dimension: usize, w: &[Vec<f64>], q: &[f64], friction: &[f64]) -> FrictionProblem {
    FrictionProblem {
        dimension,
        matrix: compressed(w).into(),
        velocity: q.to_vec(),
        friction: friction.to_vec(),
    }
}

/// Two problems as one that does not couple them.
pub fn beside(one: &FrictionProblem, other: &FrictionProblem) -> FrictionProblem {
    let (a, b) = (one.matrix.dense(), other.matrix.dense());
    let (n, m) = (a.len(), b.len());
    let mut w = vec![vec![0.0; n + m]; n + m];
    a.iter().enumerate().for_each(|(i, row)| w[i][..n].copy_from_slice(row));
    b.iter().enumerate().for_each(|(i, row)| w[n + i][n..].copy_from_slice(row));
    let q = [&one.velocity[..], &other.velocity[..]].concat();
    from_dense(one.dimension, &w, &q, &[&one.friction[..], &other.friction[..]].concat())
}

/// Problems that have no solution, with the reason why: no velocities meet the contacts, or friction jams.
pub fn hopeless(dimension: usize) -> Vec<(&'static str, FrictionProblem)> {
    let d = dimension;
    let outer =
        |v: &[f64]| -> Vec<Vec<f64>> { v.iter().map(|a| v.iter().map(|b| a * b).collect()).collect() };
    let mut q = vec![0.0; 2 * d];
    (q[0], q[d]) = (-1.0, -1.0);
    let mut opposed = vec![0.0; 2 * d];
    (opposed[0], opposed[d]) = (1.0, -1.0);
    let mu = if d == 1 { 0.0 } else { 0.4 };
    let mut immovable = q[..d].to_vec();
    immovable[d - 1] -= 0.5;
    let mut all = vec![
        ("one body between two walls that approach", from_dense(d, &outer(&opposed), &q, &[mu, mu])),
        ("two fixed bodies that approach", from_dense(d, &vec![vec![0.0; d]; d], &immovable, &[mu])),
    ];
    if d > 1 {
        // a particle on a rail, u = (1, 2) s: stopped by the wall it must have s = 1 and slides, and friction
        // against that slip pushes it back faster than the wall pushes it off (mu times the slope > 1)
        let mut rail = vec![0.0; d];
        (rail[0], rail[1]) = (1.0, 2.0);
        let mut q = vec![0.0; d];
        q[0] = -1.0;
        all.push(("a particle on a rail that friction jams", from_dense(d, &outer(&rail), &q, &[0.6])));
    }
    all
}

/// Problems with nothing in them, or whose answer is no impulse at all.
pub fn nothing_to_do(dimension: usize) -> Vec<(&'static str, FrictionProblem)> {
    let d = dimension;
    let some = known(Family::FullRank, d, 4, 1).problem;
    let mu = if d == 1 { 0.0 } else { 0.3 };
    let still = FrictionProblem { velocity: vec![0.0; 4 * d], ..some.clone() };
    let mut parting = some;
    parting.velocity.iter_mut().enumerate().for_each(|(k, q)| *q = if k % d == 0 { 1.0 } else { 0.5 });
    let sliding: Vec<f64> = (0..d).map(|k| if k == 0 { 0.0 } else { 1.0 }).collect();
    vec![
        ("no contacts", from_dense(d, &[], &[], &[])),
        ("no velocity", still),
        ("parting contacts", parting),
        ("two fixed bodies that touch", from_dense(d, &vec![vec![0.0; d]; d], &vec![0.0; d], &[mu])),
        ("two fixed bodies that slide", from_dense(d, &vec![vec![0.0; d]; d], &sliding, &[mu])),
    ]
}
