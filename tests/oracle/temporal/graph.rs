//! Shortest paths with costs of any sign, by the Bellman-Ford algorithm.

use super::model::{Q, q};

/// Node 0 is the source.
#[derive(Debug, Default)]
pub struct Graph {
    pub nodes: usize,
    /// Edges: from, to, cost.
    pub edges: Vec<(usize, usize, Q)>,
    /// Final steps: the preceding node, and the cost of the step including all final costs.
    pub goals: Vec<(usize, Q)>,
}

/// A path: numbers of its edges, and the number of the final step.
pub type Path = (Vec<usize>, usize);

#[derive(Debug)]
pub enum Optimum {
    None,
    /// A cycle of negative cost lies on a path to a goal. The field is any path to a goal.
    Unbounded(Path),
    Best(Q, Path),
}

/// For each node, the minimum cost of a path to it, with the number of the path's last edge.
type Distances = Vec<Option<(Q, Option<usize>)>>;

impl Graph {
    pub fn optimum(&self) -> Optimum {
        let useful = self.useful();
        let (distances, cycle) = self.distances(&useful);
        if cycle {
            let some_paths = self.shortest();
            let goal = self.goals.iter().position(|(from, _)| some_paths[*from].is_some());
            let goal = goal.expect("a useful node is reached");
            return Optimum::Unbounded((some_paths[self.goals[goal].0].clone().expect("a way"), goal));
        }
        let value = |(goal, (from, final_cost)): (usize, &(usize, Q))| {
            distances[*from].map(|(distance, _)| (distance + final_cost, goal))
        };
        match self.goals.iter().enumerate().filter_map(value).min() {
            None => Optimum::None,
            Some((value, goal)) => Optimum::Best(value, (self.path(&distances, self.goals[goal].0), goal)),
        }
    }

    fn useful(&self) -> Vec<bool> {
        let mut useful = vec![false; self.nodes];
        let mut predecessors: Vec<Vec<usize>> = vec![Vec::new(); self.nodes];
        self.edges.iter().for_each(|(from, to, _)| predecessors[*to].push(*from));
        let mut stack: Vec<usize> = self.goals.iter().map(|(from, _)| *from).collect();
        while let Some(node) = stack.pop() {
            if !std::mem::replace(&mut useful[node], true) {
                stack.extend(&predecessors[node]);
            }
        }
        useful
    }

    /// Returns the minimum costs of paths through useful nodes. The flag is `true` if these nodes have a
    /// cycle of negative cost.
    fn distances(&self, useful: &[bool]) -> (Distances, bool) {
        let mut distances: Distances = vec![None; self.nodes];
        distances[0] = useful[0].then_some((q(0), None));
        for round in 0..=self.nodes {
            let mut changed = false;
            for (number, (from, to, cost)) in self.edges.iter().enumerate().filter(|(_, edge)| useful[edge.1])
            {
                let Some((distance, _)) = distances[*from] else { continue };
                let distance = distance + cost;
                if distances[*to].is_none_or(|(previous, _)| distance < previous) {
                    distances[*to] = Some((distance, Some(number)));
                    changed = true;
                }
            }
            if !changed {
                return (distances, false);
            }
            // A cycle formed by the last edges has negative cost. The test takes linear time, so it runs only
            // in every eighth round.
            if round % 8 == 7 && self.has_cycle(&distances) {
                break;
            }
        }
        (distances, true)
    }

    fn has_cycle(&self, distances: &Distances) -> bool {
        (0..distances.len()).any(|start| {
            let mut node = start;
            for _ in 0..=distances.len() {
                match distances[node] {
                    Some((_, Some(edge))) => node = self.edges[edge].0,
                    _ => return false,
                }
            }
            true
        })
    }

    fn path(&self, distances: &Distances, mut node: usize) -> Vec<usize> {
        let mut edges = Vec::new();
        while let Some((_, Some(edge))) = distances[node] {
            edges.push(edge);
            node = self.edges[edge].0;
        }
        edges.reverse();
        edges
    }

    /// Returns any path to each node. Nodes are numbered as they are discovered, so the first edge to a node
    /// comes from a node that already has a path.
    fn shortest(&self) -> Vec<Option<Vec<usize>>> {
        let mut paths: Vec<Option<Vec<usize>>> = vec![None; self.nodes];
        paths[0] = Some(Vec::new());
        for (number, (from, to, _)) in self.edges.iter().enumerate() {
            if let (Some(path), None) = (paths[*from].clone(), &paths[*to]) {
                paths[*to] = Some([&path[..], &[number]].concat());
            }
        }
        paths
    }
}
