//! Stratification: orders relations such that each is complete before a rule negates it. The strata are the
//! strongly connected components of the relation "is used to derive", dependencies first ([1]).
//!
//! Every component is a stratum, even without negation. Thus rows that are over-deleted in a component are
//! rederived before later components see them.
//!
//! [1] Tarjan, "Depth-first search and linear graph algorithms", SIAM Journal on Computing 1(2), 1972.

/// Returns the strongly connected component of each node. Components are numbered such that every edge
/// leads to the same or a larger number.
pub(crate) fn components(successors: &[Vec<usize>]) -> Vec<usize> {
    let mut search = Search {
        successors,
        order: vec![None; successors.len()],
        low: vec![0; successors.len()],
        component: vec![None; successors.len()],
        stack: Vec::new(),
        visited: 0,
        component_count: 0,
    };
    for node in 0..successors.len() {
        if search.order[node].is_none() {
            search.visit(node);
        }
    }
    // Tarjan's algorithm finds sinks first, so the numbers are reversed.
    search.component.iter().map(|number| search.component_count - 1 - number.unwrap_or(0)).collect()
}

struct Search<'a> {
    successors: &'a [Vec<usize>],
    order: Vec<Option<usize>>,
    low: Vec<usize>,
    component: Vec<Option<usize>>,
    stack: Vec<usize>,
    visited: usize,
    component_count: usize,
}

impl Search<'_> {
    /// Visits the nodes reachable from `root`, depth first. The explicit stack prevents that long chains
    /// of rules overflow the thread's stack.
    fn visit(&mut self, root: usize) {
        let mut path = vec![(root, 0)];
        self.open(root);
        while let Some((node, position)) = path.pop() {
            let Some(&child) = self.successors[node].get(position) else {
                self.close(node);
                if let Some(&(parent, _)) = path.last() {
                    self.low[parent] = self.low[parent].min(self.low[node]);
                }
                continue;
            };
            // The node stays on the path until all its successors are visited.
            path.push((node, position + 1));
            match self.order[child] {
                None => {
                    self.open(child);
                    path.push((child, 0));
                }
                Some(order) if self.component[child].is_none() => self.low[node] = self.low[node].min(order),
                Some(_) => {}
            }
        }
    }

    fn open(&mut self, node: usize) {
        self.order[node] = Some(self.visited);
        self.low[node] = self.visited;
        self.visited += 1;
        self.stack.push(node);
    }

    fn close(&mut self, node: usize) {
        if self.order[node] != Some(self.low[node]) {
            return;
        }
        while let Some(member) = self.stack.pop() {
            self.component[member] = Some(self.component_count);
            if member == node {
                break;
            }
        }
        self.component_count += 1;
    }
}
