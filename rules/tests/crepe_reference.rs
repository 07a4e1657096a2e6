//! Comparison with a plain crepe program of the same rules, evaluated from scratch after every change.

use std::collections::{BTreeMap, BTreeSet};

use crate::text::engine;
use metaplan_rules::{Delta, Fact, Literal, Symbol};
use proptest::prelude::*;

mod reference {
    //! Graph rules with recursion, negation, a self join and a comparison.

    use crepe::crepe;

    crepe! {
        @input
        pub struct Edge(pub u8, pub u8);

        @output
        #[derive(Debug)]
        pub struct Path(pub u8, pub u8);
        @output
        pub struct Source(pub u8);
        @output
        pub struct Rising(pub u8, pub u8);

        struct Target(u8);

        Path(x, y) <- Edge(x, y);
        Path(x, z) <- Path(x, y), Path(y, z);
        Target(y) <- Edge(_, y);
        Source(x) <- Edge(x, _), !Target(x);
        Rising(x, z) <- Path(x, y), Edge(y, z), (x < z), !Edge(x, z);
    }
}

const RULES: &str = "
    edge(?x, ?y) -> path(?x, ?y) .
    path(?x, ?y) ^ path(?y, ?z) -> path(?x, ?z) .
    edge(?x, ?y) -> target(?y) .
    edge(?x, ?y) ^ not target(?x) -> source(?x) .
    path(?x, ?y) ^ edge(?y, ?z) ^ swrlb:lessThan(?x, ?z) ^ not edge(?x, ?z) -> rising(?x, ?z) .
";

type Relations = BTreeMap<&'static str, BTreeSet<Vec<u8>>>;

fn expected(edges: &BTreeSet<(u8, u8)>) -> Relations {
    let mut runtime = reference::Crepe::new();
    runtime.extend(edges.iter().map(|&(x, y)| reference::Edge(x, y)));
    let (paths, sources, rising) = runtime.run();
    let paths = paths.into_iter().map(|path| vec![path.0, path.1]).collect();
    let sources = sources.into_iter().map(|source| vec![source.0]).collect();
    let rising = rising.into_iter().map(|pair| vec![pair.0, pair.1]).collect();
    BTreeMap::from([("path", paths), ("source", sources), ("rising", rising)])
}

fn check(script: &[(bool, u8, u8)]) {
    let mut engine = engine(RULES, "").expect("rules");
    let symbols = engine.symbols_mut();
    let nodes: Vec<Symbol> = (0..8).map(|node| symbols.literal(Literal::integer(node))).collect();
    let edge = symbols.name("edge");
    let mut edges = BTreeSet::new();
    for &(insert, x, y) in script {
        let fact = Fact::new(edge, [nodes[usize::from(x)], nodes[usize::from(y)]]);
        let mut delta = Delta::default();
        if insert {
            edges.insert((x, y));
            delta.insert.push(fact);
        } else {
            edges.remove(&(x, y));
            delta.delete.push(fact);
        }
        engine.apply(delta).expect("no budget needed");
        for (name, rows) in expected(&edges) {
            let predicate = engine.symbols().find_name(name).expect("a predicate of the rules");
            let any = vec![None; if name == "source" { 1 } else { 2 }];
            let number =
                |symbol: &Symbol| nodes.iter().position(|node| node == symbol).expect("a node") as u8;
            let rows_found = engine.matching(predicate, &any).map(|row| row.iter().map(number).collect());
            assert_eq!(rows_found.collect::<BTreeSet<Vec<u8>>>(), rows, "{name} of {edges:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]
    #[test]
    fn the_engine_agrees_with_plain_crepe(script in prop::collection::vec((any::<bool>(), 0..8_u8, 0..8_u8), 1..60)) {
        check(&script);
    }
}
