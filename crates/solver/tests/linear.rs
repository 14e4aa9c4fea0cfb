//! The sparse block LU against a dense solution.

use carom_solver::linear::{Analysis, Factor, Graph};

/// Numbers in \[-1, 1\), the same every time.
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A pattern: a lattice with a few long couplings, nodes of the given sizes in turn.
fn lattice(side: usize, sizes: &[u32]) -> Graph {
    let n = side * side;
    let mut near: Vec<Vec<u32>> = (0..n as u32).map(|i| vec![i]).collect();
    let mut couple = |i: usize, j: usize| {
        near[i].push(j as u32);
        near[j].push(i as u32);
    };
    for y in 0..side {
        for x in 0..side {
            let i = y * side + x;
            if x + 1 < side {
                couple(i, i + 1);
            }
            if y + 1 < side {
                couple(i, i + side);
            }
            if i % 17 == 3 && i + 2 * side + 5 < n {
                couple(i, i + 2 * side + 5);
            }
        }
    }
    let mut starts = vec![0];
    let mut neighbours = Vec::new();
    for row in &mut near {
        row.sort_unstable();
        row.dedup();
        neighbours.extend_from_slice(row);
        starts.push(neighbours.len() as u32);
    }
    Graph::new((0..n).map(|i| sizes[i % sizes.len()]).collect(), starts, neighbours)
}

/// Values with heavy diagonal blocks, not symmetric, and the dense product with x.
fn values(graph: &Graph, dice: &mut Dice) -> Vec<f64> {
    let mut values: Vec<f64> = (0..graph.values()).map(|_| dice.roll()).collect();
    for i in 0..graph.nodes() {
        let at = graph.offsets[graph.position(i, i).expect("a diagonal")] as usize;
        let size = graph.sizes[i] as usize;
        (0..size).for_each(|k| values[at + k * size + k] += 12.0);
    }
    values
}

fn product(graph: &Graph, values: &[f64], x: &[f64]) -> Vec<f64> {
    let mut y = vec![0.0; graph.scalars()];
    for i in 0..graph.nodes() {
        for k in graph.row(i) {
            let j = graph.neighbours[k] as usize;
            let columns = graph.sizes[j] as usize;
            for r in 0..graph.sizes[i] as usize {
                for c in 0..columns {
                    let value = values[graph.offsets[k] as usize + r * columns + c];
                    y[graph.first[i] as usize + r] += value * x[graph.first[j] as usize + c];
                }
            }
        }
    }
    y
}

fn largest_error(graph: &Graph, dice: &mut Dice) -> f64 {
    let values = values(graph, dice);
    let x: Vec<f64> = (0..graph.scalars()).map(|_| dice.roll()).collect();
    let mut y = product(graph, &values, &x);
    let analysis = Analysis::new(graph);
    let mut factor = Factor::default();
    assert!(factor.factorize(&analysis, &values));
    factor.solve(&analysis, &mut y);
    x.iter().zip(&y).fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

#[test]
fn solutions_agree_with_the_product_for_blocks_of_every_size() {
    let mut dice = Dice(7);
    for sizes in [&[1][..], &[2], &[3], &[6], &[1, 3, 6, 2], &[20, 3]] {
        for side in [1, 2, 3, 7, 20] {
            let error = largest_error(&lattice(side, sizes), &mut dice);
            assert!(error < 1e-12, "sizes {sizes:?}, side {side}: {error:e}");
        }
    }
}

#[test]
fn a_singular_matrix_is_told() {
    let graph = lattice(3, &[2]);
    let zeros = vec![0.0; graph.values()];
    assert!(!Factor::default().factorize(&Analysis::new(&graph), &zeros));
}

#[test]
fn a_pivot_block_with_a_zero_on_its_diagonal_is_solved() {
    let graph = Graph::new(vec![2], vec![0, 1], vec![0]);
    let mut factor = Factor::default();
    let analysis = Analysis::new(&graph);
    assert!(factor.factorize(&analysis, &[0.0, 2.0, 4.0, 1.0]));
    let mut x = [2.0, 9.0];
    factor.solve(&analysis, &mut x);
    assert_eq!(x, [2.0, 1.0]);
}

/// Sign of the determinant by dense elimination with pivoting.
fn dense_sign(graph: &Graph, values: &[f64]) -> f64 {
    let n = graph.scalars();
    let unit = |k: usize| (0..n).map(|i| if i == k { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
    // columns of the matrix as rows: the determinant is the same
    let mut a: Vec<Vec<f64>> = (0..n).map(|k| product(graph, values, &unit(k))).collect();
    let mut sign = 1.0;
    for c in 0..n {
        let best = (c..n).fold(c, |b, r| if a[r][c].abs() > a[b][c].abs() { r } else { b });
        if best != c {
            a.swap(best, c);
            sign = -sign;
        }
        sign *= a[c][c].signum();
        let own = a[c].clone();
        for row in &mut a[c + 1..] {
            let factor = row[c] / own[c];
            row.iter_mut().zip(&own).for_each(|(x, o)| *x -= factor * o);
        }
    }
    sign
}

#[test]
fn the_sign_of_the_determinant_is_that_of_a_dense_elimination() {
    let mut dice = Dice(11);
    let mut seen = [0, 0];
    for sizes in [&[1][..], &[2], &[3], &[6], &[1, 3, 6, 2], &[20, 3]] {
        for side in [1, 2, 3, 5] {
            let graph = lattice(side, sizes);
            let mut values = values(&graph, &mut dice);
            // a row turned round changes the sign
            for i in 0..graph.nodes() {
                if dice.roll() > 0.0 {
                    for k in graph.row(i) {
                        let columns = graph.sizes[graph.neighbours[k] as usize] as usize;
                        let first = graph.offsets[k] as usize;
                        values[first..first + columns].iter_mut().for_each(|x| *x = -*x);
                    }
                }
            }
            let (analysis, mut factor) = (Analysis::new(&graph), Factor::default());
            assert!(factor.factorize(&analysis, &values));
            let sign = factor.determinant_sign(&analysis);
            assert_eq!(sign, dense_sign(&graph, &values), "sizes {sizes:?}, side {side}");
            seen[usize::from(sign > 0.0)] += 1;
        }
    }
    assert!(seen.iter().all(|&n| n > 3), "both signs are tried: {seen:?}");
}

/// Nodes of six scalars, each coupled to the next along three axes.
fn lattice_in_space(side: usize) -> Graph {
    let place = |x: usize, y: usize, z: usize| (x + side * (y + side * z)) as u32;
    let (mut starts, mut neighbours) = (vec![0], Vec::new());
    for z in 0..side {
        for y in 0..side {
            for x in 0..side {
                let mut near = vec![place(x, y, z)];
                for (axis, at) in [x, y, z].into_iter().enumerate() {
                    let step = side.pow(axis as u32) as u32;
                    if at > 0 {
                        near.push(near[0] - step);
                    }
                    if at + 1 < side {
                        near.push(near[0] + step);
                    }
                }
                near.sort_unstable();
                neighbours.extend_from_slice(&near);
                starts.push(neighbours.len() as u32);
            }
        }
    }
    Graph::new(vec![6; side.pow(3)], starts, neighbours)
}

/// Contacts between the nodes of a lattice in space, and of the lowest with a floor: three scalars each, coupled where
/// they share a node.
fn contacts_of_a_lattice(side: usize) -> Graph {
    let place = |x: usize, y: usize, z: usize| x + side * (y + side * z);
    let mut at_node = vec![Vec::new(); side.pow(3)];
    let mut pairs: Vec<Vec<usize>> = Vec::new();
    for z in 0..side {
        for y in 0..side {
            for x in 0..side {
                let own = place(x, y, z);
                let below = if z > 0 { vec![own, place(x, y, z - 1)] } else { vec![own] };
                let left = (x > 0).then(|| vec![own, place(x.max(1) - 1, y, z)]);
                let front = (y > 0).then(|| vec![own, place(x, y.max(1) - 1, z)]);
                for pair in [Some(below), left, front].into_iter().flatten() {
                    pair.iter().for_each(|&node| at_node[node].push(pairs.len() as u32));
                    pairs.push(pair);
                }
            }
        }
    }
    let (mut starts, mut neighbours) = (vec![0], Vec::new());
    for pair in &pairs {
        let mut near: Vec<u32> = pair.iter().flat_map(|&node| at_node[node].iter().copied()).collect();
        near.sort_unstable();
        near.dedup();
        neighbours.extend_from_slice(&near);
        starts.push(neighbours.len() as u32);
    }
    Graph::new(vec![3; pairs.len()], starts, neighbours)
}

/// Cuts half way between opposite corners run askew, through three contacts per node where a straight cut parts one:
/// with them and with minimum degree 4,896 contacts took 2.3e9 multiply-adds.
#[test]
fn contacts_of_a_lattice_are_parted_by_straight_cuts() {
    let analysis = Analysis::new(&contacts_of_a_lattice(12));
    assert!(analysis.flops < 1e9, "{:e} multiply-adds", analysis.flops);
}

#[test]
fn a_large_lattice_in_space_is_solved_and_twice_with_the_same_bits() {
    let graph = lattice_in_space(9);
    let analysis = Analysis::new(&graph);
    assert!(analysis.flops > 1e8, "{:e}: too small to be dissected", analysis.flops);
    let values: Vec<f64> = {
        let mut values = values(&graph, &mut Dice(3));
        for i in 0..graph.nodes() {
            let at = graph.offsets[graph.position(i, i).expect("a diagonal")] as usize;
            (0..6).for_each(|k| values[at + 7 * k] += 60.0);
        }
        values
    };
    let x: Vec<f64> = (0..graph.scalars()).map(|k| (k as f64).sin()).collect();
    let right = product(&graph, &values, &x);
    let mut factor = Factor::default();
    let mut solved = || {
        let mut y = right.clone();
        assert!(factor.factorize(&analysis, &values));
        factor.solve(&analysis, &mut y);
        y
    };
    let (first, second) = (solved(), solved());
    let error = x.iter().zip(&first).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(error < 1e-13, "{error:e}");
    assert!(first.iter().zip(&second).all(|(a, b)| a.to_bits() == b.to_bits()));
    let mut again = right.clone();
    let mut fresh = Factor::default();
    let other = Analysis::new(&graph);
    assert!(fresh.factorize(&other, &values));
    fresh.solve(&other, &mut again);
    assert!(first.iter().zip(&again).all(|(a, b)| a.to_bits() == b.to_bits()));
}

/// Five contacts of one pair of bodies that all stick: fifteen rows span six directions, and next to W stands 1e-12.
/// With the inverses of twelve rows at a time the residual was 1e-4.
#[test]
fn contacts_of_one_pair_that_stick_keep_their_digits() {
    let graph = Graph::new(vec![3; 5], vec![0, 5, 10, 15, 20, 25], (0..25).map(|k| k % 5).collect());
    let mut dice = Dice(5);
    let rows: Vec<[f64; 6]> = (0..15).map(|_| std::array::from_fn(|_| dice.roll())).collect();
    let dot = |a: &[f64; 6], b: &[f64; 6]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut values = vec![0.0; graph.values()];
    for i in 0..15 {
        for j in 0..15 {
            let block = graph.position(i / 3, j / 3).expect("all are coupled");
            let at = graph.offsets[block] as usize + i % 3 * 3 + j % 3;
            values[at] = dot(&rows[i], &rows[j]) + if i == j { 1e-12 } else { 0.0 };
        }
    }
    let right: Vec<f64> = rows.iter().map(|row| dot(row, &[1.0, -0.5, 0.3, 0.8, -0.2, 0.6])).collect();
    let analysis = Analysis::new(&graph);
    let (mut factor, mut x) = (Factor::default(), right.clone());
    assert!(factor.factorize(&analysis, &values));
    factor.solve(&analysis, &mut x);
    let left = product(&graph, &values, &x);
    let residual = left.iter().zip(&right).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(residual < 1e-9, "{residual:e}");
}

#[test]
fn an_analysis_knows_its_pattern() {
    let analysis = Analysis::new(&lattice(5, &[3]));
    assert!(analysis.fits(&lattice(5, &[3])));
    assert!(!analysis.fits(&lattice(5, &[3, 2])));
    assert!(!analysis.fits(&lattice(4, &[3])));
}
