//! A graph to its strongly connected components in reverse topological order (Tarjan 1972, without recursion).

const UNSEEN: u32 = u32::MAX;

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
    let mut index = vec![UNSEEN; n];
    let mut low = vec![0_u32; n];
    let mut stack: Vec<u32> = Vec::new();
    let mut calls: Vec<(u32, u32)> = Vec::new();
    let (mut nodes, mut starts) = (Vec::with_capacity(n), vec![0_u32]);
    let mut next = 0_u32;
    // A node that has left the stack has `low` = UNSEEN, so that it never lowers another.
    for root in 0..n as u32 {
        if index[root as usize] != UNSEEN {
            continue;
        }
        calls.push((root, 0));
        while let Some((node, edge)) = calls.pop() {
            let v = node as usize;
            if edge == 0 {
                index[v] = next;
                low[v] = next;
                next += 1;
                stack.push(node);
            }
            let edges = successors(node);
            let mut at = edge as usize;
            let mut descended = false;
            while at < edges.len() {
                let w = edges[at] as usize;
                at += 1;
                if index[w] == UNSEEN {
                    calls.push((node, at as u32));
                    calls.push((w as u32, 0));
                    descended = true;
                    break;
                }
                low[v] = low[v].min(low[w]);
            }
            if descended {
                continue;
            }
            if low[v] == index[v] {
                while let Some(member) = stack.pop() {
                    low[member as usize] = UNSEEN;
                    nodes.push(member);
                    if member == node {
                        break;
                    }
                }
                starts.push(nodes.len() as u32);
            } else if let Some((parent, _)) = calls.last() {
                let parent = *parent as usize;
                low[parent] = low[parent].min(low[v]);
            }
        }
    }
    Components { nodes, starts }
}
