//! Hand-written evaluation of `tomasys.swrl`: relations with only the needed hash indexes, and a worklist
//! of derived facts. Each derived fact is stored once, without a record of its derivation.

use metaplan_rules::{Fact, Literal, Prefixes, Symbol, Symbols, TOMASYS_RULES, parse_rules};
use rustc_hash::{FxHashMap, FxHashSet};

use super::{Random, Task};

const TOMASYS: &str = "http://metacontrol.org/tomasys#";

/// Knowledge base with about fourteen facts per design. Every second component has failed.
pub(crate) fn knowledge_base(designs: u64) -> Task {
    let mut symbols = Symbols::new();
    let program = parse_rules(TOMASYS_RULES, "tomasys", &mut symbols, &Prefixes::new()).expect("rules");
    let (mut facts, mut random) = (Vec::new(), Random(3));
    let failed = symbols.literal(Literal::string("FALSE"));
    let less_than = symbols.literal(Literal::string("<"));
    for number in 0..designs {
        let tenth = number / 10;
        let (component, attribute) = (format!("c{tenth}"), format!("qa{}", number % 50));
        let names = |text: &str| text.replace('#', &number.to_string());
        for (predicate, first, second) in [
            ("typeFD", "fg#", "fd#"),
            ("requiresC", "fd#", component.as_str()),
            ("solvesO", "fg#", "o#"),
            ("hasQAvalue", "fg#", "m#"),
            ("isQAtype", "m#", attribute.as_str()),
            ("hasQAestimation", "fd#", "e#"),
            ("isQAtype", "e#", attribute.as_str()),
            ("binding_component", "b#", component.as_str()),
            ("hasBindings", "fg#", "b#"),
            ("binding_role", "b#", "r#"),
            ("roleDef", "r#", "cs#"),
            ("roles", "fd#", "r#"),
            ("requiresO", "fg#", "above"),
        ] {
            let second =
                if second == "above" { format!("o{}", (number + 1) % designs) } else { names(second) };
            // One objective in ten depends on the next one.
            if predicate == "requiresO" && number % 10 != 0 {
                continue;
            }
            let arguments = [symbols.name(&names(first)), symbols.name(&second)];
            facts.push(Fact::new(symbols.name(&format!("{TOMASYS}{predicate}")), arguments));
        }
        let mut state = |predicate: &str, subject: &str, value: Symbol| {
            let subject = symbols.name(&names(subject));
            facts.push(Fact::new(symbols.name(&format!("{TOMASYS}{predicate}")), [subject, value]));
        };
        if number % 20 == 0 {
            state("c_status", &component, failed);
        }
        if number < 50 {
            state("qa_comparison_operator", &attribute, less_than);
        }
        for subject in ["m#", "e#"] {
            let value = Literal::integer(random.below(1000) as i64);
            let value = symbols.literal(value);
            let subject = symbols.name(&names(subject));
            facts.push(Fact::new(symbols.name(&format!("{TOMASYS}hasValue")), [subject, value]));
        }
    }
    (symbols, program, facts)
}

/// Rows by the value of one column, as linked lists in a vector, similar to the engine's store.
#[derive(Default)]
struct Index {
    heads: FxHashMap<Symbol, u32>,
    next: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Index {
    fn push(&mut self, key: Symbol) {
        let row = self.next.len() as u32;
        self.next.push(self.heads.insert(key, row).unwrap_or(NONE));
    }

    fn rows(&self, key: Symbol) -> impl Iterator<Item = u32> {
        let head = self.heads.get(&key).copied().filter(|&row| row != NONE);
        std::iter::successors(head, |&row| Some(self.next[row as usize]).filter(|&row| row != NONE))
    }
}

#[derive(Default)]
struct Pairs {
    members: FxHashSet<(Symbol, Symbol)>,
    rows: Vec<(Symbol, Symbol)>,
    by_first: Option<Index>,
    by_second: Option<Index>,
}

impl Pairs {
    fn insert(&mut self, first: Symbol, second: Symbol) -> bool {
        let is_new = self.members.insert((first, second));
        if is_new {
            self.rows.push((first, second));
            if let Some(index) = &mut self.by_first {
                index.push(first);
            }
            if let Some(index) = &mut self.by_second {
                index.push(second);
            }
        }
        is_new
    }

    fn after(&self, first: Symbol) -> impl Iterator<Item = Symbol> {
        let index = self.by_first.iter();
        index.flat_map(move |index| index.rows(first)).map(|row| self.rows[row as usize].1)
    }

    fn before(&self, second: Symbol) -> impl Iterator<Item = Symbol> {
        let index = self.by_second.iter();
        index.flat_map(move |index| index.rows(second)).map(|row| self.rows[row as usize].0)
    }
}

/// Names of the relations, each with two flags: whether the first and the second column has an index.
const INDEXES: [(&str, bool, bool); 19] = [
    ("requiresC", false, true),
    ("typeFD", true, true),
    ("binding_component", false, true),
    ("hasBindings", false, true),
    ("typeC", true, true),
    ("cc_unique", true, false),
    ("roleDef", true, true),
    ("roles", false, true),
    ("binding_role", true, false),
    ("hasQAvalue", true, false),
    ("isQAtype", true, false),
    ("hasValue", true, false),
    ("hasQAestimation", true, false),
    ("qa_comparison_operator", true, false),
    ("solvesO", true, true),
    ("requiresO", false, true),
    ("c_status", false, true),
    ("fg_status", false, false),
    ("o_status", false, false),
];

struct Run {
    relations: FxHashMap<Symbol, Pairs>,
    names: FxHashMap<&'static str, Symbol>,
    open: Vec<(&'static str, Symbol, Symbol)>,
    derived: usize,
}

pub(crate) fn run(symbols: &Symbols, facts: &[Fact]) -> usize {
    let mut symbols = symbols.clone();
    let derived = ["fd_realisability", "b_status", "cc_availability", "cspec_availability", "fd_error_log"];
    let indexed = INDEXES.iter().copied().chain(derived.map(|name| (name, false, false)));
    let mut run =
        Run { relations: FxHashMap::default(), names: FxHashMap::default(), open: Vec::new(), derived: 0 };
    for (name, first, second) in indexed {
        let symbol = symbols.name(&format!("{TOMASYS}{name}"));
        run.names.insert(name, symbol);
        let index = |wanted: bool| wanted.then(Index::default);
        let pairs = Pairs { by_first: index(first), by_second: index(second), ..Pairs::default() };
        run.relations.insert(symbol, pairs);
    }
    for fact in facts {
        run.relations.entry(fact.predicate).or_default().insert(fact.arguments[0], fact.arguments[1]);
    }
    run.derive(&mut symbols);
    run.derived
}

impl Run {
    fn pairs(&self, name: &'static str) -> &Pairs {
        &self.relations[&self.names[name]]
    }

    fn after(&self, name: &'static str, first: Symbol) -> Vec<Symbol> {
        self.pairs(name).after(first).collect()
    }

    fn before(&self, name: &'static str, second: Symbol) -> Vec<Symbol> {
        self.pairs(name).before(second).collect()
    }

    fn conclude(&mut self, name: &'static str, first: Symbol, second: Symbol) {
        let symbol = self.names[name];
        if self.relations.get_mut(&symbol).is_some_and(|pairs| pairs.insert(first, second)) {
            self.derived += 1;
            self.open.push((name, first, second));
        }
    }

    fn derive(&mut self, symbols: &mut Symbols) {
        let no = symbols.literal(Literal::Boolean(false));
        let yes = symbols.literal(Literal::Boolean(true));
        let [failed, component, quality, function, less_than] =
            ["FALSE", "IN_ERROR_COMPONENT", "IN_ERROR_NFR", "IN_ERROR_FR", "<"]
                .map(|text| symbols.literal(Literal::string(text)));
        self.missed(symbols, less_than, quality);
        let broken = [failed, no].map(|status| self.before("c_status", status)).concat();
        for broken in broken {
            for design in self.before("requiresC", broken) {
                self.conclude("fd_realisability", design, no);
                for grounding in self.before("typeFD", design) {
                    self.conclude("fg_status", grounding, component);
                }
            }
            for binding in self.before("binding_component", broken) {
                self.conclude("b_status", binding, no);
            }
            for class in self.after("typeC", broken) {
                if self.after("cc_unique", class).contains(&yes) {
                    self.conclude("cc_availability", class, no);
                }
            }
        }
        while let Some((name, first, second)) = self.open.pop() {
            match name {
                "b_status" => {
                    for grounding in self.before("hasBindings", first) {
                        self.conclude("fg_status", grounding, component);
                    }
                    for role in self.after("binding_role", first) {
                        for specification in self.after("roleDef", role) {
                            self.conclude("cspec_availability", specification, no);
                        }
                    }
                }
                "cc_availability" => {
                    for specification in self.before("typeC", first) {
                        self.unrealisable(specification, no);
                    }
                }
                "cspec_availability" => self.unrealisable(first, no),
                "fg_status" => {
                    for objective in self.after("solvesO", first) {
                        self.conclude("o_status", objective, second);
                    }
                }
                "o_status" => {
                    for grounding in self.before("requiresO", first) {
                        self.conclude("fg_status", grounding, second);
                    }
                    for grounding in self.before("solvesO", first).into_iter().filter(|_| second == function)
                    {
                        for design in self.after("typeFD", grounding) {
                            self.conclude("fd_error_log", design, first);
                        }
                    }
                }
                _ => {}
            }
        }
    }

    fn unrealisable(&mut self, specification: Symbol, no: Symbol) {
        for role in self.before("roleDef", specification) {
            for design in self.before("roles", role) {
                self.conclude("fd_realisability", design, no);
            }
        }
    }

    /// Derives the status of the groundings for which a measured value is less than the estimated one, for
    /// attributes with the comparison operator `<`.
    fn missed(&mut self, symbols: &Symbols, less_than: Symbol, quality: Symbol) {
        let measured: Vec<(Symbol, Symbol)> = self.pairs("hasQAvalue").rows.clone();
        for (grounding, measurement) in measured {
            let mut is_missed = false;
            for kind in self.pairs("isQAtype").after(measurement) {
                if !self.pairs("qa_comparison_operator").after(kind).any(|sign| sign == less_than) {
                    continue;
                }
                for value in self.pairs("hasValue").after(measurement) {
                    for design in self.pairs("typeFD").after(grounding) {
                        for estimation in self.pairs("hasQAestimation").after(design) {
                            let fits = self.pairs("isQAtype").members.contains(&(estimation, kind));
                            let literal = |symbol| symbols.value(symbol).as_literal();
                            let is_less = |estimated: Symbol| {
                                let order =
                                    literal(value).zip(literal(estimated)).and_then(|(a, b)| a.compare(b));
                                order == Some(std::cmp::Ordering::Less)
                            };
                            is_missed |= fits && self.pairs("hasValue").after(estimation).any(is_less);
                        }
                    }
                }
            }
            if is_missed {
                self.conclude("fg_status", grounding, quality);
            }
        }
    }
}
