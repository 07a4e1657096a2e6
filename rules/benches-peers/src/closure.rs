//! Transitive closure of a random graph by each peer: computes the number of paths.

use std::collections::HashMap;

use metaplan_rules::{Engine, Fact, Prefixes, Symbols, parse_rules};
use rustc_hash::{FxBuildHasher, FxHashSet};

use crate::Random;

type Edge = (u32, u32);
type Run = fn(&[Edge]) -> usize;

/// Implementations with their names. Printed ratios refer to the first.
pub const PEERS: [(&str, Run); 5] = [
    ("metaplan-rules", engine),
    ("hand-written worklist", worklist),
    ("crepe", by_crepe),
    ("ascent", by_ascent),
    ("datafrog", by_datafrog),
];

pub fn edges() -> Vec<Edge> {
    let mut random = Random(1);
    let mut edges: Vec<Edge> = (0..5000).map(|_| (random.below(1000), random.below(1000))).collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}

fn engine(edges: &[Edge]) -> usize {
    let mut symbols = Symbols::new();
    let rules = "edge(?x, ?y) -> path(?x, ?y) path(?x, ?y) ^ edge(?y, ?z) -> path(?x, ?z)";
    let program = parse_rules(rules, "closure", &mut symbols, &Prefixes::new()).expect("rules");
    let (edge, path) = (symbols.name("edge"), symbols.name("path"));
    let mut node = |number: u32| symbols.name(&format!("n{number}"));
    let facts: Vec<Fact> = edges.iter().map(|&(x, y)| Fact::new(edge, [node(x), node(y)])).collect();
    let engine = Engine::new(symbols, program, facts).expect("safe rules");
    engine.matching(path, &[None, None]).count()
}

fn worklist(edges: &[Edge]) -> usize {
    let mut successors: HashMap<u32, Vec<u32>, FxBuildHasher> = HashMap::default();
    for &(x, y) in edges {
        successors.entry(x).or_default().push(y);
    }
    let mut paths: FxHashSet<Edge> = edges.iter().copied().collect();
    let mut open: Vec<Edge> = paths.iter().copied().collect();
    while let Some((x, y)) = open.pop() {
        for &z in successors.get(&y).into_iter().flatten() {
            if paths.insert((x, z)) {
                open.push((x, z));
            }
        }
    }
    paths.len()
}

mod crepe_closure {
    use crepe::crepe;

    crepe! {
        @input
        pub struct Edge(pub u32, pub u32);

        @output
        pub struct Path(pub u32, pub u32);

        Path(x, y) <- Edge(x, y);
        Path(x, z) <- Path(x, y), Edge(y, z);
    }
}

fn by_crepe(edges: &[Edge]) -> usize {
    let mut runtime = crepe_closure::Crepe::new();
    runtime.extend(edges.iter().map(|&(x, y)| crepe_closure::Edge(x, y)));
    let (paths,) = runtime.run();
    paths.len()
}

mod ascent_closure {
    ascent::ascent! {
        pub struct Closure;
        relation edge(u32, u32);
        relation path(u32, u32);
        path(x, y) <-- edge(x, y);
        path(x, z) <-- path(x, y), edge(y, z);
    }
}

fn by_ascent(edges: &[Edge]) -> usize {
    let mut program = ascent_closure::Closure::default();
    program.edge = edges.to_vec();
    program.run();
    program.path.len()
}

fn by_datafrog(edges: &[Edge]) -> usize {
    let mut iteration = datafrog::Iteration::new();
    let edge: datafrog::Relation<Edge> = edges.iter().copied().collect();
    // Reversed paths, because datafrog joins on the first column.
    let path = iteration.variable::<Edge>("path");
    path.extend(edges.iter().map(|&(x, y)| (y, x)));
    while iteration.changed() {
        path.from_join(&path, &edge, |_, &x, &z| (z, x));
    }
    path.complete().len()
}
