//! Symbolic analyses, kept while the graphs of contacts and bodies stand.

use crate::linear::{Analysis, Graph};
use std::sync::Arc;

/// Most analyses kept: islands of one shape share one.
const MOST: usize = 64;

/// The analyses used last, the latest first.
#[derive(Clone, Debug, Default)]
pub struct Analyses {
    kept: Vec<Arc<Analysis>>,
}

impl Analyses {
    /// The analysis of a graph: the kept one where the graph has been seen, else a new one.
    pub fn of(&mut self, graph: &Arc<Graph>) -> Arc<Analysis> {
        if let Some(k) = self.kept.iter().position(|a| a.fits(graph)) {
            self.kept[..=k].rotate_right(1);
        } else {
            self.kept.truncate(MOST - 1);
            self.kept.insert(0, Arc::new(Analysis::of(graph)));
        }
        self.kept[0].clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of so many nodes.
    fn chain(nodes: u32) -> Arc<Graph> {
        let (mut starts, mut neighbours) = (vec![0], Vec::new());
        for i in 0..nodes {
            neighbours.extend(i.saturating_sub(1)..(i + 2).min(nodes));
            starts.push(neighbours.len() as u32);
        }
        Arc::new(Graph::new(vec![3; nodes as usize], starts, neighbours))
    }

    #[test]
    fn a_graph_that_stands_is_analysed_once() {
        let mut analyses = Analyses::default();
        let first = analyses.of(&chain(5));
        let other = analyses.of(&chain(6));
        assert!(Arc::ptr_eq(&first, &analyses.of(&chain(5))));
        assert!(Arc::ptr_eq(&other, &analyses.of(&chain(6))));
        assert!(!Arc::ptr_eq(&first, &other) && other.fits(&chain(6)));
    }

    #[test]
    fn the_analyses_used_last_are_kept() {
        let mut analyses = Analyses::default();
        let (old, used) = (analyses.of(&chain(2)), analyses.of(&chain(3)));
        for nodes in 4..MOST as u32 + 10 {
            analyses.of(&chain(nodes));
            assert!(Arc::ptr_eq(&used, &analyses.of(&chain(3))), "after {nodes}");
        }
        assert!(!Arc::ptr_eq(&old, &analyses.of(&chain(2))));
        assert_eq!(analyses.kept.len(), MOST);
    }
}
