//! Enumerates the paths in the graph of all cheapest plans. Shorter paths come first; paths of equal length
//! are in the order of their operators and designs in the task.

use rustc_hash::FxHashSet;
use task::limits::Limits;
use task::plan::ground::GroundStep;

use crate::alternatives::graph::{Edge, Graph, ROOT};

const MAX_WORK: usize = 2_000_000;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    Exhausted,
    Stopped,
}

pub(super) struct Paths<'g> {
    graph: &'g Graph,
    limits: &'g Limits,
    first: Vec<usize>,
    /// Pairs of a label and a number of steps in which no path leads from the label to a goal.
    dead: FxHashSet<(u32, usize)>,
    work: usize,
}

struct Branch {
    label: u32,
    next: usize,
}

impl<'g> Paths<'g> {
    pub(super) fn new(graph: &'g Graph, limits: &'g Limits) -> Self {
        let labels = graph.goals.len();
        let mut first = vec![graph.edges.len(); labels.saturating_add(1)];
        for (position, edge) in graph.edges.iter().enumerate().rev() {
            first[edge.from as usize] = position;
        }
        for label in (0..labels).rev() {
            first[label] = first[label].min(first[label.saturating_add(1)]);
        }
        Self { graph, limits, first, dead: FxHashSet::default(), work: MAX_WORK }
    }

    pub(super) fn edges(&self, label: u32) -> impl Iterator<Item = &'g Edge> + use<'_, 'g> {
        let (from, to) = (self.first[label as usize], self.first[(label as usize).saturating_add(1)]);
        self.graph.edges[from..to].iter().filter(|edge| self.graph.alive[edge.to as usize])
    }

    /// Calls `visit` with the steps of each path from the initial label to a goal label, in order of length.
    /// Stops early if `visit` returns `false`, a limit is reached, or [`MAX_WORK`] edges have been followed.
    pub(super) fn each(&mut self, visit: &mut dyn FnMut(Vec<GroundStep>) -> bool) -> End {
        if !self.graph.alive.first().is_some_and(|is_alive| *is_alive) {
            return End::Exhausted;
        }
        let longest = self.longest();
        for length in 0.. {
            if longest.is_some_and(|longest| length > longest) {
                return End::Exhausted;
            }
            if self.each_of(length, visit) == End::Stopped {
                return End::Stopped;
            }
        }
        End::Stopped
    }

    fn each_of(&mut self, length: usize, visit: &mut dyn FnMut(Vec<GroundStep>) -> bool) -> End {
        let mut path: Vec<u32> = Vec::new();
        let mut branches = vec![Branch { label: ROOT, next: self.first[ROOT as usize] }];
        // For each label on the path: whether a goal was reached through it.
        let mut fruitful = vec![false];
        let mut pulse = self.limits.pulse();
        while let Some(branch) = branches.last_mut() {
            let steps_left = length.saturating_sub(path.len());
            let end = self.first[(branch.label as usize).saturating_add(1)];
            if steps_left == 0 || branch.next == end {
                let is_goal = steps_left == 0 && self.graph.goals[branch.label as usize];
                if is_goal {
                    let step = |step: &u32| self.graph.steps[*step as usize].clone();
                    if !visit(path.iter().map(step).collect()) {
                        return End::Stopped;
                    }
                }
                let label = branch.label;
                branches.pop();
                path.pop();
                let is_fruitful = fruitful.pop().unwrap_or_default() || is_goal;
                match fruitful.last_mut() {
                    Some(before) if is_fruitful => *before = true,
                    _ => {}
                }
                if !is_fruitful {
                    self.dead.insert((label, steps_left));
                }
                continue;
            }
            let edge = self.graph.edges[branch.next];
            branch.next = branch.next.saturating_add(1);
            let Some(work) = self.work.checked_sub(1).filter(|_| pulse.beat().is_ok()) else {
                return End::Stopped;
            };
            self.work = work;
            let to = edge.to;
            if self.graph.alive[to as usize] && !self.dead.contains(&(to, steps_left.saturating_sub(1))) {
                path.push(edge.step);
                branches.push(Branch { label: to, next: self.first[to as usize] });
                fruitful.push(false);
            }
        }
        End::Exhausted
    }

    /// Returns the number of steps of a longest path to a goal label, or `None` if the graph has a
    /// cycle.
    fn longest(&self) -> Option<usize> {
        let labels = self.graph.goals.len();
        let mut into = vec![0_usize; labels];
        let (mut reached, mut open) = (vec![false; labels], vec![ROOT]);
        reached[ROOT as usize] = true;
        while let Some(label) = open.pop() {
            for edge in self.edges(label) {
                let count = &mut into[edge.to as usize];
                *count = count.saturating_add(1);
                if !std::mem::replace(&mut reached[edge.to as usize], true) {
                    open.push(edge.to);
                }
            }
        }
        // Topological order [A. Kahn: Topological sorting of large networks, CACM 5(11), 1962].
        let mut unsorted = reached.iter().filter(|is_reached| **is_reached).count();
        let mut depth = vec![0_usize; labels];
        open.extend((into[ROOT as usize] == 0).then_some(ROOT));
        while let Some(label) = open.pop() {
            unsorted = unsorted.saturating_sub(1);
            let below = depth[label as usize].saturating_add(1);
            for edge in self.edges(label) {
                let to = edge.to as usize;
                depth[to] = depth[to].max(below);
                into[to] = into[to].saturating_sub(1);
                if into[to] == 0 {
                    open.push(edge.to);
                }
            }
        }
        let ends = depth.iter().zip(&self.graph.goals).filter(|(_, is_goal)| **is_goal);
        (unsorted == 0).then(|| ends.map(|(depth, _)| *depth).max().unwrap_or(0))
    }

    /// Returns the distinct steps that cheapest plans have at each of the first `length` positions. Entries are
    /// `None` from the first position at which some cheapest plan has already ended.
    pub(super) fn layers(&self, length: usize) -> Vec<Option<Vec<&'g GroundStep>>> {
        let mut layer: Vec<u32> = vec![ROOT];
        let mut layers = Vec::new();
        for _ in 0..length {
            if layers.last().is_some_and(Option::is_none)
                || layer.iter().any(|label| self.graph.goals[*label as usize])
            {
                layers.push(None);
                continue;
            }
            let edges: Vec<&Edge> = layer.iter().flat_map(|label| self.edges(*label)).collect();
            let mut steps: Vec<u32> = edges.iter().map(|edge| edge.step).collect();
            steps.sort_unstable();
            steps.dedup();
            layers.push(Some(steps.into_iter().map(|step| &self.graph.steps[step as usize]).collect()));
            layer = edges.iter().map(|edge| edge.to).collect();
            layer.sort_unstable();
            layer.dedup();
        }
        layers
    }
}
