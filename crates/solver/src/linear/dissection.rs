//! Nested dissection (George 1973): a few nodes part the graph in two, the parts are eliminated first and the
//! separator last; parts are parted again. A cut lies half way between two nodes far from each other, and of the cuts
//! between several such nodes the smallest is taken: in a box, those between opposite corners run askew, those between
//! neighbouring corners straight, and which of them part the fewest nodes is for the graph to say. Single nodes then
//! move while the separator shrinks (Fiduccia and Mattheyses 1982, for vertex separators).

use super::graph::Graph;

/// A part of at most this many nodes is left to minimum degree.
const LEAF: usize = 128;
/// Neither side may hold more than this share.
const UNEVEN: f64 = 0.6;
/// Nodes from which nodes far away are looked for, beside the two far from each other.
const SEEDS: usize = 6;
/// Far nodes between which cuts are tried.
const CORNERS: usize = 6;
/// Cuts whose separators are refined.
const TRIED: usize = 3;
/// Passes over a separator, each as long as it shrinks it.
const PASSES: usize = 8;

const FIRST: u8 = 0;
const SECOND: u8 = 1;
const BETWEEN: u8 = 2;

/// Nodes in the order of their elimination; small parts as `leaf` orders them.
pub fn dissected(graph: &Graph, leaf: impl Fn(&Graph) -> Vec<u32>) -> Vec<u32> {
    let n = graph.nodes();
    let mut dissection = Dissection {
        graph,
        label: vec![0; n],
        labels: 0,
        distance: vec![vec![0; n]; CORNERS],
        side: vec![FIRST; n],
        weight: [vec![0; n], vec![0; n]],
        locked: vec![false; n],
        seen: vec![0; n],
        local: vec![0; n],
        order: Vec::with_capacity(n),
    };
    let all: Vec<u32> = (0..n as u32).collect();
    dissection.divide(&all, &leaf);
    dissection.order
}

struct Dissection<'a> {
    graph: &'a Graph,
    /// The part that a node belongs to.
    label: Vec<u32>,
    labels: u32,
    /// Steps from each of several far nodes.
    distance: Vec<Vec<u32>>,
    side: Vec<u8>,
    /// Scalars among a node's neighbours on either side.
    weight: [Vec<u32>; 2],
    locked: Vec<bool>,
    /// The last leaf that a node lay around.
    seen: Vec<u32>,
    /// Place of a node in a leaf.
    local: Vec<u32>,
    order: Vec<u32>,
}

/// What a separator holds and leaves.
#[derive(Clone, Copy)]
struct Balance {
    /// Scalars on the first side, on the second, between.
    held: [u32; 3],
}

impl Balance {
    /// Smaller is better: the separator, then how uneven the sides are.
    fn cost(self) -> (u32, u32) {
        (self.held[2], self.held[0].abs_diff(self.held[1]))
    }
}

const UNREACHED: u32 = u32::MAX;

impl Dissection<'_> {
    fn neighbours(&self, i: u32) -> &[u32] {
        &self.graph.neighbours[self.graph.row(i as usize)]
    }

    /// Orders the nodes of a part.
    fn divide(&mut self, nodes: &[u32], leaf: &impl Fn(&Graph) -> Vec<u32>) {
        self.labels += 1;
        nodes.iter().for_each(|&i| self.label[i as usize] = self.labels);
        if nodes.len() <= LEAF {
            return self.order_leaf(nodes, leaf);
        }
        let reached = self.search(nodes, nodes[0], 0);
        if reached.len() < nodes.len() {
            return self.divide_pieces(nodes, reached, leaf);
        }
        let corners = self.corners(nodes, reached[reached.len() - 1]);
        self.cut(nodes, corners);
        let side = |wanted: u8| -> Vec<u32> {
            nodes.iter().copied().filter(|&i| self.side[i as usize] == wanted).collect()
        };
        let (first, second, between) = (side(FIRST), side(SECOND), side(BETWEEN));
        if first.is_empty() || second.is_empty() {
            return self.order_leaf(nodes, leaf);
        }
        self.divide(&first, leaf);
        self.divide(&second, leaf);
        self.order.extend_from_slice(&between);
    }

    /// Leaves the distances from nodes far from each other, one of them the given one; how many there are.
    fn corners(&mut self, nodes: &[u32], first: u32) -> usize {
        let mut corners = vec![first];
        let mut far = *self.search(nodes, first, 0).last().unwrap_or(&first);
        for seed in 0..=SEEDS {
            if !corners.contains(&far) {
                self.search(nodes, far, corners.len());
                corners.push(far);
            }
            if corners.len() == CORNERS || seed == SEEDS {
                break;
            }
            // the next memory serves for the search from a seed too
            let start = nodes[(2 * seed + 1) * nodes.len() / (2 * SEEDS)];
            far = *self.search(nodes, start, corners.len()).last().unwrap_or(&start);
        }
        corners.len()
    }

    /// Parts the nodes by the best cut between two of the corners.
    fn cut(&mut self, nodes: &[u32], corners: usize) {
        let pairs = (0..corners).flat_map(|b| (0..b).map(move |a| [a, b]));
        let mut cuts: Vec<_> = pairs.map(|pair| (self.halve(nodes, pair).cost(), pair)).collect();
        cuts.sort_unstable();
        cuts.truncate(TRIED);
        let mut best: Option<((u32, u32), Vec<u8>)> = None;
        for (_, pair) in cuts {
            let balance = self.halve(nodes, pair);
            let cost = self.refine(nodes, balance).cost();
            if best.as_ref().is_none_or(|b| cost < b.0) {
                best = Some((cost, nodes.iter().map(|&i| self.side[i as usize]).collect()));
            }
        }
        if let Some((_, sides)) = best {
            nodes.iter().zip(sides).for_each(|(&i, side)| self.side[i as usize] = side);
        }
    }

    /// Orders a part that is not connected, piece by piece.
    fn divide_pieces(&mut self, nodes: &[u32], first: Vec<u32>, leaf: &impl Fn(&Graph) -> Vec<u32>) {
        let own = self.labels;
        let mut pieces = vec![first];
        let mut seen = vec![false; self.graph.nodes()];
        pieces[0].iter().for_each(|&i| seen[i as usize] = true);
        for &i in nodes {
            if seen[i as usize] {
                continue;
            }
            let (mut piece, mut at) = (vec![i], 0);
            seen[i as usize] = true;
            while at < piece.len() {
                for &j in self.neighbours(piece[at]) {
                    if self.label[j as usize] == own && !seen[j as usize] {
                        seen[j as usize] = true;
                        piece.push(j);
                    }
                }
                at += 1;
            }
            pieces.push(piece);
        }
        pieces.iter().for_each(|piece| self.divide(piece, leaf));
    }

    /// Orders a part with its surroundings in view: what lies around it is eliminated later, as one front, so its
    /// nodes count as neighbours of each other.
    fn order_leaf(&mut self, nodes: &[u32], leaf: &impl Fn(&Graph) -> Vec<u32>) {
        let own = self.labels;
        let mut around = Vec::new();
        nodes.iter().enumerate().for_each(|(k, &i)| self.local[i as usize] = k as u32);
        for &i in nodes {
            for k in self.graph.row(i as usize) {
                let j = self.graph.neighbours[k];
                // only separators lie around a part, and they keep the label of their time
                if self.label[j as usize] != own && self.seen[j as usize] != own {
                    self.seen[j as usize] = own;
                    self.local[j as usize] = (nodes.len() + around.len()) as u32;
                    around.push(j);
                }
            }
        }
        let all = (nodes.len() + around.len()) as u32;
        let (mut starts, mut neighbours) = (vec![0], Vec::new());
        for (k, &i) in nodes.iter().chain(&around).enumerate() {
            let first = neighbours.len();
            let known =
                |j: u32| self.label[j as usize] == own || (k < nodes.len() && self.seen[j as usize] == own);
            let near = self.neighbours(i).iter().filter(|&&j| known(j));
            neighbours.extend(near.map(|&j| self.local[j as usize]));
            if k >= nodes.len() {
                neighbours.extend(nodes.len() as u32..all);
            }
            neighbours[first..].sort_unstable();
            starts.push(neighbours.len() as u32);
        }
        let sizes = nodes.iter().chain(&around).map(|&i| self.graph.sizes[i as usize]).collect();
        let order = leaf(&Graph::new(sizes, starts, neighbours));
        self.order.extend(order.iter().filter(|&&k| (k as usize) < nodes.len()).map(|&k| nodes[k as usize]));
    }

    /// The nodes of a part in the order of their distance from one of them.
    fn search(&mut self, nodes: &[u32], start: u32, which: usize) -> Vec<u32> {
        let own = self.label[start as usize];
        nodes.iter().for_each(|&i| self.distance[which][i as usize] = UNREACHED);
        self.distance[which][start as usize] = 0;
        let mut reached = vec![start];
        let mut at = 0;
        while at < reached.len() {
            let i = reached[at];
            let next = self.distance[which][i as usize] + 1;
            for &j in &self.graph.neighbours[self.graph.row(i as usize)] {
                if self.label[j as usize] == own && self.distance[which][j as usize] == UNREACHED {
                    self.distance[which][j as usize] = next;
                    reached.push(j);
                }
            }
            at += 1;
        }
        reached
    }

    /// Cuts half way between two far nodes; the separator is the boundary of the lighter kind.
    fn halve(&mut self, nodes: &[u32], [a, b]: [usize; 2]) -> Balance {
        let size = |i: u32| self.graph.sizes[i as usize];
        let total: u32 = nodes.iter().map(|&i| size(i)).sum();
        let mut along = nodes.to_vec();
        let place =
            |i: u32| i64::from(self.distance[a][i as usize]) - i64::from(self.distance[b][i as usize]);
        along.sort_by_key(|&i| (place(i), i));
        let mut held = 0;
        for &i in &along {
            self.side[i as usize] = if 2 * held < total { FIRST } else { SECOND };
            held += size(i);
        }
        let boundary = |wanted: u8| -> Vec<u32> {
            let crosses = |i: u32| {
                self.neighbours(i).iter().any(|&j| {
                    self.label[j as usize] == self.label[i as usize]
                        && self.side[j as usize] != self.side[i as usize]
                })
            };
            nodes.iter().copied().filter(|&i| self.side[i as usize] == wanted && crosses(i)).collect()
        };
        let weight = |nodes: &[u32]| nodes.iter().map(|&i| size(i)).sum::<u32>();
        let (first, second) = (boundary(FIRST), boundary(SECOND));
        let between = if weight(&first) <= weight(&second) { first } else { second };
        between.iter().for_each(|&i| self.side[i as usize] = BETWEEN);
        let mut balance = Balance { held: [0; 3] };
        for &i in nodes {
            balance.held[self.side[i as usize] as usize] += self.graph.sizes[i as usize];
        }
        balance
    }

    /// Moves nodes out of the separator while that makes it smaller.
    fn refine(&mut self, nodes: &[u32], mut balance: Balance) -> Balance {
        for &i in nodes {
            let own = self.label[i as usize];
            let mut weight = [0; 3];
            for &j in &self.graph.neighbours[self.graph.row(i as usize)] {
                if self.label[j as usize] == own {
                    weight[self.side[j as usize] as usize] += self.graph.sizes[j as usize];
                }
            }
            (self.weight[0][i as usize], self.weight[1][i as usize]) = (weight[0], weight[1]);
        }
        for _ in 0..PASSES {
            let before = balance.cost();
            balance = self.pass(nodes, balance);
            if balance.cost() >= before {
                break;
            }
        }
        balance
    }

    /// One pass: the best move again and again, even where it costs; then back to the best separator met.
    fn pass(&mut self, nodes: &[u32], start: Balance) -> Balance {
        nodes.iter().for_each(|&i| self.locked[i as usize] = false);
        let mut between: Vec<u32> =
            nodes.iter().copied().filter(|&i| self.side[i as usize] == BETWEEN).collect();
        let patience = 20 + between.len();
        let total: u32 = start.held.iter().sum();
        let most = (UNEVEN * f64::from(total)) as u32;
        let (mut balance, mut best) = (start, start);
        let mut moves: Vec<(u32, u8)> = Vec::new();
        let (mut kept, mut since) = (0, 0);
        while since < patience {
            let Some((place, to)) = self.best_move(&between, &balance, most) else { break };
            let i = between.swap_remove(place);
            self.locked[i as usize] = true;
            self.put(i, to, &mut balance, &mut moves);
            for k in self.graph.row(i as usize) {
                let j = self.graph.neighbours[k];
                if self.label[j as usize] == self.label[i as usize] && self.side[j as usize] == 1 - to {
                    self.put(j, BETWEEN, &mut balance, &mut moves);
                    between.push(j);
                }
            }
            since += 1;
            if balance.cost() < best.cost() {
                (best, kept, since) = (balance, moves.len(), 0);
            }
        }
        let mut undone = Vec::new();
        for (i, side) in moves.split_off(kept).into_iter().rev() {
            self.put(i, side, &mut balance, &mut undone);
        }
        best
    }

    /// The move that leaves the smallest separator: place in the list, side.
    fn best_move(&self, between: &[u32], balance: &Balance, most: u32) -> Option<(usize, u8)> {
        let mut best: Option<(i64, u32, usize, u8)> = None;
        for (place, &i) in between.iter().enumerate() {
            if self.locked[i as usize] {
                continue;
            }
            let size = self.graph.sizes[i as usize];
            for to in [FIRST, SECOND] {
                let after = balance.held[to as usize] + size;
                if after > most {
                    continue;
                }
                let loss = i64::from(self.weight[1 - to as usize][i as usize]) - i64::from(size);
                if best.is_none_or(|(least, held, ..)| (loss, after) < (least, held)) {
                    best = Some((loss, after, place, to));
                }
            }
        }
        best.map(|(_, _, place, to)| (place, to))
    }

    /// Puts a node on a side and notes where it was.
    fn put(&mut self, i: u32, to: u8, balance: &mut Balance, moves: &mut Vec<(u32, u8)>) {
        let (from, size) = (self.side[i as usize], self.graph.sizes[i as usize]);
        moves.push((i, from));
        self.side[i as usize] = to;
        balance.held[from as usize] -= size;
        balance.held[to as usize] += size;
        for k in self.graph.row(i as usize) {
            let j = self.graph.neighbours[k] as usize;
            if self.label[j] == self.label[i as usize] {
                if from != BETWEEN {
                    self.weight[from as usize][j] -= size;
                }
                if to != BETWEEN {
                    self.weight[to as usize][j] += size;
                }
            }
        }
    }
}
