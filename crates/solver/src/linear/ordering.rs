//! Elimination orders that keep factors sparse: approximate minimum degree (Amestoy, Davis and Duff 1996; from
//! faer), weighed by what it costs afterwards. Small graphs keep their order.

use super::graph::Graph;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

/// Up to this many nodes any order is as good as another.
const TOO_SMALL: usize = 4;

/// Nodes in the order of their elimination.
pub fn minimum_degree(graph: &Graph) -> Vec<u32> {
    let n = graph.nodes();
    let natural = || (0..n as u32).collect();
    if n <= TOO_SMALL {
        return natural();
    }
    let pattern = SymbolicSparseColMatRef::<u32>::new_checked(n, n, &graph.starts, None, &graph.neighbours);
    let (mut order, mut inverse) = (vec![0u32; n], vec![0u32; n]);
    let mut memory = MemBuffer::new(amd::order_scratch::<u32>(n, graph.neighbours.len()));
    let ordered =
        amd::order(&mut order, &mut inverse, pattern, amd::Control::default(), MemStack::new(&mut memory));
    if ordered.is_ok() { order } else { natural() }
}

/// Where every node stands in an order.
pub fn inverse(order: &[u32]) -> Vec<u32> {
    let mut position = vec![0; order.len()];
    order.iter().enumerate().for_each(|(k, &i)| position[i as usize] = k as u32);
    position
}
