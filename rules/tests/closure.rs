//! Transitive relation with pairs that are stated, derived by another rule, or both, under random
//! changes. After each change, the relation equals the closure by Warshall's algorithm. A link of a
//! chain can become a conclusion of the closure later.

use std::collections::BTreeSet;

use metaplan_rules::{Delta, Engine, Fact, Prefixes, Symbol, Symbols, parse_rules};

const NODES: usize = 7;

type Pairs = BTreeSet<(usize, usize)>;

struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 20) as usize % bound
    }
}

fn closed(links: &Pairs) -> Pairs {
    let mut closure = links.clone();
    for middle in 0..NODES {
        for from in 0..NODES {
            for to in 0..NODES {
                if closure.contains(&(from, middle)) && closure.contains(&(middle, to)) {
                    closure.insert((from, to));
                }
            }
        }
    }
    closure
}

fn check(seed: u64, rules: &str) {
    let mut random = Random(seed);
    let mut symbols = Symbols::new();
    let program = parse_rules(rules, "test", &mut symbols, &Prefixes::new()).expect("rules");
    let [part, next] = ["part", "next"].map(|name| symbols.name(name));
    let nodes: Vec<Symbol> = (0..NODES).map(|node| symbols.name(&format!("n{node}"))).collect();
    let fact = |predicate, (from, to): (usize, usize)| Fact::new(predicate, [nodes[from], nodes[to]]);
    let (mut parts, mut nexts) = (Pairs::new(), Pairs::new());
    let mut engine = Engine::new(symbols, program, []).expect("safe");
    for step in 0..120 {
        let mut delta = Delta { insert: Vec::new(), delete: Vec::new() };
        for _ in 0..=random.below(3) {
            let pair = (random.below(NODES), random.below(NODES));
            let (predicate, stated) =
                if random.below(2) == 0 { (part, &mut parts) } else { (next, &mut nexts) };
            let fact = fact(predicate, pair);
            if delta.insert.contains(&fact) || delta.delete.contains(&fact) {
                continue;
            }
            if stated.remove(&pair) {
                delta.delete.push(fact);
            } else {
                stated.insert(pair);
                delta.insert.push(fact);
            }
        }
        engine.apply(delta).expect("it ends");
        let expected = closed(&parts.union(&nexts).copied().collect());
        for from in 0..NODES {
            for to in 0..NODES {
                let fact = fact(part, (from, to));
                assert_eq!(engine.holds(&fact), expected.contains(&(from, to)), "seed {seed}, step {step}");
                assert_eq!(engine.why(&fact).is_some(), engine.holds(&fact), "seed {seed}, step {step}");
            }
        }
    }
}

#[test]
fn a_transitive_relation_equals_its_closure_after_every_change() {
    let first = "part(?x, ?y) ^ part(?y, ?z) -> part(?x, ?z) . next(?x, ?y) -> part(?x, ?y)";
    let last = "next(?x, ?y) -> part(?x, ?y) . part(?x, ?y) ^ part(?y, ?z) -> part(?x, ?z)";
    for seed in 1..=8 {
        check(seed, first);
        check(seed, last);
    }
}
