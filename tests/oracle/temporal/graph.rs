//! A best way through a graph with costs of any sign, by Bellman-Ford.

use super::model::{Q, q};

/// Nodes by number, the first one is the beginning.
#[derive(Debug, Default)]
pub struct Graph {
    pub nodes: usize,
    /// From, to, cost.
    pub edges: Vec<(usize, usize, Q)>,
    /// Last steps: from, and the cost with all that is still to be added.
    pub goals: Vec<(usize, Q)>,
}

/// Edges, and the number of the last step.
pub type Way = (Vec<usize>, usize);

#[derive(Debug)]
pub enum Optimum {
    /// There is no way to a goal.
    None,
    /// A cycle of negative cost lies on the way; some way.
    Unbounded(Way),
    Best(Q, Way),
}

/// The least cost to a node, with the last edge.
type Found = Vec<Option<(Q, Option<usize>)>>;

impl Graph {
    /// The best way to a goal.
    pub fn optimum(&self) -> Optimum {
        let useful = self.useful();
        let (found, cycle) = self.distances(&useful);
        if cycle {
            let first = self.shortest();
            let goal = self.goals.iter().position(|(from, _)| first[*from].is_some());
            let goal = goal.expect("a useful node is reached");
            return Optimum::Unbounded((first[self.goals[goal].0].clone().expect("a way"), goal));
        }
        let value = |(goal, (from, rest)): (usize, &(usize, Q))| {
            found[*from].map(|(distance, _)| (distance + rest, goal))
        };
        match self.goals.iter().enumerate().filter_map(value).min() {
            None => Optimum::None,
            Some((value, goal)) => Optimum::Best(value, (self.way(&found, self.goals[goal].0), goal)),
        }
    }

    /// The nodes from which a goal is reached.
    fn useful(&self) -> Vec<bool> {
        let mut useful = vec![false; self.nodes];
        let mut into: Vec<Vec<usize>> = vec![Vec::new(); self.nodes];
        self.edges.iter().for_each(|(from, to, _)| into[*to].push(*from));
        let mut stack: Vec<usize> = self.goals.iter().map(|(from, _)| *from).collect();
        while let Some(node) = stack.pop() {
            if !std::mem::replace(&mut useful[node], true) {
                stack.extend(&into[node]);
            }
        }
        useful
    }

    /// The least cost to each useful node; and whether there is a cycle of negative cost among them.
    fn distances(&self, useful: &[bool]) -> (Found, bool) {
        let mut found: Found = vec![None; self.nodes];
        found[0] = useful[0].then_some((q(0), None));
        for round in 0..=self.nodes {
            let mut changed = false;
            for (number, (from, to, cost)) in self.edges.iter().enumerate().filter(|(_, edge)| useful[edge.1])
            {
                let Some((distance, _)) = found[*from] else { continue };
                let distance = distance + cost;
                if found[*to].is_none_or(|(old, _)| distance < old) {
                    found[*to] = Some((distance, Some(number)));
                    changed = true;
                }
            }
            if !changed {
                return (found, false);
            }
            // Where the last edges form a cycle, its cost is negative.
            if round % 8 == 7 && self.cyclic(&found) {
                break;
            }
        }
        (found, true)
    }

    fn cyclic(&self, found: &Found) -> bool {
        (0..found.len()).any(|start| {
            let mut node = start;
            for _ in 0..=found.len() {
                match found[node] {
                    Some((_, Some(edge))) => node = self.edges[edge].0,
                    _ => return false,
                }
            }
            true
        })
    }

    fn way(&self, found: &Found, mut node: usize) -> Vec<usize> {
        let mut edges = Vec::new();
        while let Some((_, Some(edge))) = found[node] {
            edges.push(edge);
            node = self.edges[edge].0;
        }
        edges.reverse();
        edges
    }

    /// Some way to each node. Nodes are numbered as they are found, so an edge to a new node is the first one to it.
    fn shortest(&self) -> Vec<Option<Vec<usize>>> {
        let mut ways: Vec<Option<Vec<usize>>> = vec![None; self.nodes];
        ways[0] = Some(Vec::new());
        for (number, (from, to, _)) in self.edges.iter().enumerate() {
            if let (Some(way), None) = (ways[*from].clone(), &ways[*to]) {
                ways[*to] = Some([&way[..], &[number]].concat());
            }
        }
        ways
    }
}
