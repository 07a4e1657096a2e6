//! Computes strongly connected components in reverse topological order, without recursion.
//!
//! Tarjan's algorithm with a single number per node (Pearce, "A Space-Efficient Algorithm for
//! Finding Strongly Connected Components", IPL 116(1), 2016). Most components have one node; they
//! never enter the stack. Each component is reported as soon as it is complete.

use crate::mdp::dense;

const UNSEEN: u32 = 0;
/// Number that marks a node whose component is complete.
const DONE: u32 = u32::MAX;

/// Number of nodes from which on a component is large. Before a large component is reported, unused memory of
/// the depth-first search is released.
const SHRINK_THRESHOLD: usize = 100_000;

struct Frame {
    node: u32,
    visit_number: u32,
    followed: u32,
}

/// Calls `take` for each strongly connected component of the nodes `0..n`. Components are reported
/// in reverse topological order: successors first.
///
/// # Errors
/// The first error that `take` returns; it ends the search.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "nodes are numbered from 1 to n, which is below the greatest number of 32 bits; begin is above 0"
)]
pub fn visit_components<'a, E>(
    n: usize,
    successors: impl Fn(u32) -> &'a [u32],
    mut take: impl FnMut(&[u32]) -> Result<(), E>,
) -> Result<(), E> {
    // For each node, the least visit number of the nodes that are known to be reachable from it and whose
    // component is incomplete.
    let mut low = vec![UNSEEN; n];
    let mut stack: Vec<u32> = Vec::new();
    let mut frames: Vec<Frame> = Vec::new();
    let mut next = 0_u32;
    for root in 0..dense(n) {
        if low[root as usize] != UNSEEN {
            continue;
        }
        next += 1;
        low[root as usize] = next;
        frames.push(Frame { node: root, visit_number: next, followed: 0 });
        while let Some(frame) = frames.last_mut() {
            let v = frame.node as usize;
            let edges = &successors(frame.node)[frame.followed as usize..];
            let mut least = low[v];
            let mut child = None;
            for target in edges {
                let number = low[*target as usize];
                if number == UNSEEN {
                    child = Some(*target);
                    break;
                }
                least = least.min(number);
                frame.followed += 1;
            }
            low[v] = least;
            if let Some(child) = child {
                next += 1;
                low[child as usize] = next;
                frames.push(Frame { node: child, visit_number: next, followed: 0 });
                continue;
            }
            let Frame { node, visit_number, .. } = *frame;
            frames.pop();
            if least != visit_number {
                stack.push(node);
                continue;
            }
            let mut begin = stack.len();
            while begin > 0 && low[stack[begin - 1] as usize] >= visit_number {
                begin -= 1;
                low[stack[begin] as usize] = DONE;
            }
            low[v] = DONE;
            if begin == stack.len() {
                take(&[node])?;
            } else {
                stack.push(node);
                if stack.len() - begin >= SHRINK_THRESHOLD {
                    // A deep search has allocated many frames. Processing a large component may
                    // need this memory.
                    frames.shrink_to_fit();
                }
                take(&stack[begin..])?;
                stack.truncate(begin);
            }
        }
    }
    Ok(())
}

/// Strongly connected components in reverse topological order.
#[derive(Debug, Clone)]
pub struct Components {
    nodes: Vec<u32>,
    /// The start of each component in `nodes`, followed by the length of `nodes`.
    starts: Vec<u32>,
}

impl Components {
    /// Iterates over the components in reverse topological order (successors first).
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &[u32]> {
        self.starts.windows(2).map(|window| &self.nodes[window[0] as usize..window[1] as usize])
    }

    /// Returns the number of components.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the end is listed, too, so that the list is never empty"
    )]
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns `true` if there are no components.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Computes the strongly connected components of the nodes `0..n`.
pub fn components<'a>(n: usize, successors: impl Fn(u32) -> &'a [u32]) -> Components {
    let mut result = Components { nodes: Vec::with_capacity(n), starts: vec![0] };
    let Ok(()) = visit_components(n, successors, |component| {
        result.nodes.extend_from_slice(component);
        result.starts.push(dense(result.nodes.len()));
        Ok::<(), std::convert::Infallible>(())
    });
    result
}
