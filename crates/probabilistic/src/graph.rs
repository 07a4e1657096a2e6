//! A graph to its strongly connected components in reverse topological order, without recursion.
//!
//! Tarjan's algorithm with one number for each node (Pearce, "A Space-Efficient Algorithm for Finding Strongly Connected
//! Components", IPL 116(1), 2016): nodes that are components by themselves, most of them in practice, never get on the
//! stack, and each component is handed over as soon as it is complete.

use crate::mdp::dense;

/// A node that has not been visited.
const UNSEEN: u32 = 0;
/// A node whose component is complete.
const DONE: u32 = u32::MAX;

/// Nodes of a component that is worth the time to give memory back.
const LARGE: usize = 100_000;

/// A visit that has begun.
struct Frame {
    node: u32,
    /// The number that the node got.
    own: u32,
    /// How many of its edges were followed.
    followed: u32,
}

/// Hands over the strongly connected components of the nodes `0..n`, each after all that can be reached from it.
///
/// # Errors
/// What `take` says, at once.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "nodes are numbered from 1 to n, which is below the greatest number of 32 bits; begin is above 0"
)]
pub fn visit_components<'a, E>(
    n: usize,
    successors: impl Fn(u32) -> &'a [u32],
    mut take: impl FnMut(&[u32]) -> Result<(), E>,
) -> Result<(), E> {
    // The least number of a node that is known to be reachable and not complete.
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
        frames.push(Frame { node: root, own: next, followed: 0 });
        while let Some(frame) = frames.last_mut() {
            let v = frame.node as usize;
            let edges = &successors(frame.node)[frame.followed as usize..];
            let mut least = low[v];
            let mut child = None;
            for target in edges {
                let found = low[*target as usize];
                if found == UNSEEN {
                    child = Some(*target);
                    break;
                }
                least = least.min(found);
                frame.followed += 1;
            }
            low[v] = least;
            if let Some(child) = child {
                next += 1;
                low[child as usize] = next;
                frames.push(Frame { node: child, own: next, followed: 0 });
                continue;
            }
            let Frame { node, own, .. } = *frame;
            frames.pop();
            if least != own {
                stack.push(node);
                continue;
            }
            let mut begin = stack.len();
            while begin > 0 && low[stack[begin - 1] as usize] >= own {
                begin -= 1;
                low[stack[begin] as usize] = DONE;
            }
            low[v] = DONE;
            if begin == stack.len() {
                take(&[node])?;
            } else {
                stack.push(node);
                if stack.len() - begin >= LARGE {
                    // What took many visits takes much memory, which is better left to whom it is handed over.
                    frames.shrink_to_fit();
                }
                take(&stack[begin..])?;
                stack.truncate(begin);
            }
        }
    }
    Ok(())
}

/// Strongly connected components; each comes after all that can be reached from it.
#[derive(Debug, Clone)]
pub struct Components {
    /// The nodes, component by component.
    nodes: Vec<u32>,
    /// Where each component starts in `nodes`, and the end.
    starts: Vec<u32>,
}

impl Components {
    /// The components in reverse topological order: successors first.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &[u32]> {
        self.starts.windows(2).map(|window| &self.nodes[window[0] as usize..window[1] as usize])
    }

    /// How many there are.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "the end is listed, too, so that the list is never empty"
    )]
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// The strongly connected components of the nodes `0..n` with the successors that a function tells.
pub fn components<'a>(n: usize, successors: impl Fn(u32) -> &'a [u32]) -> Components {
    let mut found = Components { nodes: Vec::with_capacity(n), starts: vec![0] };
    let Ok(()) = visit_components(n, successors, |component| {
        found.nodes.extend_from_slice(component);
        found.starts.push(dense(found.nodes.len()));
        Ok::<(), std::convert::Infallible>(())
    });
    found
}
