//! Oracle: naive evaluation of a program from scratch, round by round. It shares only the evaluation of
//! single built-ins with the engine.

use std::collections::{BTreeMap, BTreeSet};

use metaplan_rules::{
    Aggregate, Atom, BuiltIn, Fact, Literal, Program, Rule, Symbol, Symbols, Term, Variable,
};

pub type Binding = BTreeMap<Variable, Symbol>;

/// Computes all facts that hold. `level` is the stratum of a predicate. Rules run level by level, so that
/// negated predicates are complete. `close` adds the consequences of equality.
pub fn naive(
    program: &Program,
    symbols: &mut Symbols,
    stated: &BTreeSet<Fact>,
    level: impl Fn(Symbol) -> usize,
    close: impl Fn(&Symbols, &mut BTreeSet<Fact>),
) -> BTreeSet<Fact> {
    let mut facts = stated.clone();
    close(symbols, &mut facts);
    let heads = program.rules.iter().flat_map(|rule| rule.head.iter().map(move |head| (rule, head)));
    let heads: Vec<(usize, &Rule, &Atom)> =
        heads.map(|(rule, head)| (level(predicate(head)), rule, head)).collect();
    for current in heads.iter().map(|&(level, ..)| level).collect::<BTreeSet<_>>() {
        loop {
            let mut new = BTreeSet::new();
            for (_, rule, head) in heads.iter().filter(|(level, ..)| *level == current) {
                new.extend(matches(rule, symbols, &facts).iter().map(|binding| ground(head, binding)));
            }
            let before = facts.len();
            facts.append(&mut new);
            close(symbols, &mut facts);
            if facts.len() == before {
                break;
            }
        }
    }
    facts
}

const SAME_AS: &str = "http://www.w3.org/2002/07/owl#sameAs";

/// Returns the equality classes of names, from the `owl:sameAs` pairs among the facts. Literals are never
/// equal to anything else.
fn classes(symbols: &Symbols, facts: &BTreeSet<Fact>) -> Vec<BTreeSet<Symbol>> {
    let mut classes: Vec<BTreeSet<Symbol>> = Vec::new();
    let Some(same_as) = symbols.find_name(SAME_AS) else { return classes };
    for fact in facts.iter().filter(|fact| is_pair(fact, same_as, symbols)) {
        let (mut joined, other_classes): (Vec<_>, Vec<_>) =
            classes.into_iter().partition(|class| fact.arguments.iter().any(|symbol| class.contains(symbol)));
        joined.push(fact.arguments.iter().copied().collect());
        classes = other_classes;
        classes.push(joined.into_iter().flatten().collect());
    }
    classes
}

fn is_pair(fact: &Fact, same_as: Symbol, symbols: &Symbols) -> bool {
    let is_name = |&symbol: &Symbol| symbols.value(symbol).as_name().is_some();
    fact.predicate == same_as && fact.arguments.iter().all(is_name)
}

pub fn representatives(symbols: &Symbols, facts: &BTreeSet<Fact>) -> BTreeMap<Symbol, Symbol> {
    let classes = classes(symbols, facts);
    let first = |class: &BTreeSet<Symbol>| *class.first().expect("a name");
    classes
        .iter()
        .flat_map(|class| class.iter().map(|&name| (name, first(class))).collect::<Vec<_>>())
        .collect()
}

pub fn normal(binding: &Binding, representatives: &BTreeMap<Symbol, Symbol>) -> Binding {
    let find = |symbol| representatives.get(&symbol).copied().unwrap_or(symbol);
    binding.iter().map(|(&variable, &symbol)| (variable, find(symbol))).collect()
}

pub fn is_reflexive(symbols: &Symbols, fact: &Fact) -> bool {
    symbols.find_name(SAME_AS) == Some(fact.predicate) && fact.arguments[0] == fact.arguments[1]
}

/// Closes facts under equality: replaces each name by all members of its class. Pairs relate all members of
/// a class. The pair of a name without other names with itself holds only if it is stated.
pub fn close_under_equality(symbols: &Symbols, stated: &BTreeSet<Fact>, facts: &mut BTreeSet<Fact>) {
    let Some(same_as) = symbols.find_name(SAME_AS) else { return };
    facts.retain(|fact| !is_reflexive(symbols, fact) || stated.contains(fact));
    let classes = classes(symbols, facts);
    let class_of = |symbol: Symbol| {
        let class = classes.iter().find(|class| class.contains(&symbol));
        class.map_or_else(|| vec![symbol], |class| class.iter().copied().collect())
    };
    let mut closed = BTreeSet::new();
    for fact in facts.iter().filter(|fact| !is_pair(fact, same_as, symbols)) {
        let mut rows = vec![Vec::new()];
        for &symbol in &fact.arguments {
            let members = class_of(symbol);
            let extend_row = |row: &Vec<Symbol>| {
                let row = row.clone();
                members.iter().map(move |&member| [row.as_slice(), &[member]].concat()).collect::<Vec<_>>()
            };
            rows = rows.iter().flat_map(extend_row).collect();
        }
        closed.extend(rows.into_iter().map(|row| Fact::new(fact.predicate, row)));
    }
    for class in &classes {
        let pairs = class.iter().flat_map(|&a| class.iter().map(move |&b| [a, b]));
        let pairs = pairs.filter(|_| class.len() > 1);
        closed.extend(pairs.map(|pair| Fact::new(same_as, pair)));
    }
    facts.append(&mut closed);
}

fn predicate(atom: &Atom) -> Symbol {
    match atom {
        Atom::Relation { predicate, .. } | Atom::Not { predicate, .. } => *predicate,
        other => panic!("{other:?} has no predicate"),
    }
}

pub fn ground(atom: &Atom, binding: &Binding) -> Fact {
    Fact::new(predicate(atom), atom.terms().into_iter().map(|term| value(term, binding).expect("bound")))
}

pub fn value(term: Term, binding: &Binding) -> Option<Symbol> {
    match term {
        Term::Constant(symbol) => Some(symbol),
        Term::Variable(variable) => binding.get(&variable).copied(),
    }
}

/// Returns all matches of a body: relation atoms in textual order, then the other atoms as soon as their
/// variables are bound.
pub fn matches(rule: &Rule, symbols: &mut Symbols, facts: &BTreeSet<Fact>) -> BTreeSet<Binding> {
    extensions(&rule.body, Binding::new(), symbols, facts)
}

fn extensions(
    body: &[Atom],
    binding: Binding,
    symbols: &mut Symbols,
    facts: &BTreeSet<Fact>,
) -> BTreeSet<Binding> {
    let mut partial = vec![binding];
    for atom in body.iter().filter(|atom| matches!(atom, Atom::Relation { .. })) {
        partial = partial.iter().flat_map(|binding| extend(atom, binding, facts)).collect();
    }
    let mut remaining: Vec<&Atom> =
        body.iter().filter(|atom| !matches!(atom, Atom::Relation { .. })).collect();
    while !remaining.is_empty() {
        let is_ready = |atom: &Atom, binding: &Binding| {
            if let Atom::Aggregate { .. } = atom {
                let outside = outside(body, atom);
                let inner_terms = atom.terms()[1..].to_vec();
                return inner_terms
                    .iter()
                    .all(|term| !outside.contains(term) || value(*term, binding).is_some());
            }
            let unbound = atom.terms().iter().filter(|&&term| value(term, binding).is_none()).count();
            let binds = match atom {
                Atom::Same(..) => 1,
                Atom::BuiltIn { built_in, arguments } if built_in.is_function() => {
                    usize::from(value(arguments[0], binding).is_none())
                }
                _ => 0,
            };
            unbound <= binds
        };
        let Some(example) = partial.first() else { return BTreeSet::new() };
        let index = remaining.iter().position(|atom| is_ready(atom, example)).expect("a safe rule");
        let atom = remaining.remove(index);
        let outside = outside(body, atom);
        let pass = |binding| filter(atom, binding, symbols, facts, &outside);
        partial = partial.into_iter().filter_map(pass).collect();
    }
    partial.into_iter().collect()
}

fn extend(atom: &Atom, binding: &Binding, facts: &BTreeSet<Fact>) -> Vec<Binding> {
    let terms = atom.terms();
    let of_predicate = facts.range(Fact::new(predicate(atom), [])..);
    let rows = of_predicate
        .take_while(|fact| fact.predicate == predicate(atom))
        .filter(|fact| fact.arguments.len() == terms.len());
    rows.filter_map(|fact| {
        let mut extended = binding.clone();
        for (&term, &symbol) in terms.iter().zip(&fact.arguments) {
            match term {
                Term::Variable(variable) => {
                    if *extended.entry(variable).or_insert(symbol) != symbol {
                        return None;
                    }
                }
                Term::Constant(constant) if constant != symbol => return None,
                Term::Constant(_) => {}
            }
        }
        Some(extended)
    })
    .collect()
}

/// Returns the terms of `body` outside of `aggregate`. Other aggregates contribute only their results.
fn outside(body: &[Atom], aggregate: &Atom) -> BTreeSet<Term> {
    let other_atoms = body.iter().filter(|&other| !std::ptr::eq(other, aggregate));
    let visible = other_atoms.flat_map(|other| match other {
        Atom::Aggregate { result, .. } => vec![*result],
        other => other.terms(),
    });
    visible.collect()
}

/// Returns the value of an aggregate of integers under a binding of its group; `None` if there is no value.
pub fn aggregate(
    atom: &Atom,
    binding: &Binding,
    symbols: &mut Symbols,
    facts: &BTreeSet<Fact>,
    outside: &BTreeSet<Term>,
) -> Option<Literal> {
    let Atom::Aggregate { aggregate, body, .. } = atom else { panic!("{atom:?} is not an aggregate") };
    let mut group = binding.clone();
    group.retain(|variable, _| outside.contains(&Term::Variable(*variable)));
    let matches = extensions(body, group, symbols, facts);
    let representatives = representatives(symbols, facts);
    let matches: BTreeSet<Binding> =
        matches.iter().map(|binding| normal(binding, &representatives)).collect();
    let values = matches.iter().map(|binding| literal(aggregate.value()?, binding, symbols)?.as_rational());
    if let Aggregate::Count = aggregate {
        return Some(Literal::integer(matches.len() as i64));
    }
    let values: Vec<_> = values.collect::<Option<_>>()?;
    let result = match aggregate {
        Aggregate::Sum(_) => values.iter().sum(),
        Aggregate::Min(_) => values.into_iter().min()?,
        _ => values.into_iter().max()?,
    };
    Some(Literal::parse(&result.to_string(), Some("http://www.w3.org/2001/XMLSchema#integer"), None))
}

fn filter(
    atom: &Atom,
    binding: Binding,
    symbols: &mut Symbols,
    facts: &BTreeSet<Fact>,
    outside: &BTreeSet<Term>,
) -> Option<Binding> {
    match atom {
        Atom::Aggregate { result, .. } => {
            let result_value = aggregate(atom, &binding, symbols, facts, outside)?;
            let result_value = symbols.literal(result_value);
            match value(*result, &binding) {
                Some(expected) => (expected == result_value).then_some(binding),
                None => bind(*result, result_value, binding),
            }
        }
        Atom::Not { .. } => (!facts.contains(&ground(atom, &binding))).then_some(binding),
        Atom::Same(left, right) => match (value(*left, &binding), value(*right, &binding)) {
            (Some(a), Some(b)) => {
                let names = representatives(symbols, facts);
                let find = |symbol| names.get(&symbol).copied().unwrap_or(symbol);
                (find(a) == find(b)).then_some(binding)
            }
            (Some(symbol), None) => bind(*right, symbol, binding),
            (None, Some(symbol)) => bind(*left, symbol, binding),
            (None, None) => panic!("an unsafe equality"),
        },
        Atom::Different(left, right) => {
            (value(*left, &binding) != value(*right, &binding)).then_some(binding)
        }
        Atom::BuiltIn { built_in, arguments } if value(arguments[0], &binding).is_some() => {
            holds(*built_in, arguments, &binding, symbols).then_some(binding)
        }
        Atom::BuiltIn { built_in, arguments } => {
            let values: Option<Vec<&Literal>> =
                arguments[1..].iter().map(|&term| literal(term, &binding, symbols)).collect();
            let result = built_in.compute(&values?)?;
            let result = symbols.literal(result);
            bind(arguments[0], result, binding)
        }
        Atom::NotBuiltIn { built_in, arguments } => {
            (!holds(*built_in, arguments, &binding, symbols)).then_some(binding)
        }
        Atom::NotSame(left, right) => {
            let names = representatives(symbols, facts);
            let find =
                |term| value(term, &binding).map(|symbol| names.get(&symbol).copied().unwrap_or(symbol));
            (find(*left) != find(*right)).then_some(binding)
        }
        Atom::NotDifferent(left, right) => {
            (value(*left, &binding) == value(*right, &binding)).then_some(binding)
        }
        Atom::Relation { .. } => panic!("relations come first"),
    }
}

fn bind(term: Term, symbol: Symbol, mut binding: Binding) -> Option<Binding> {
    binding.insert(term.as_variable()?, symbol);
    Some(binding)
}

pub fn holds(built_in: BuiltIn, arguments: &[Term], binding: &Binding, symbols: &Symbols) -> bool {
    let values: Option<Vec<&Literal>> =
        arguments.iter().map(|&term| literal(term, binding, symbols)).collect();
    values.is_some_and(|values| built_in.holds(&values))
}

fn literal<'s>(term: Term, binding: &Binding, symbols: &'s Symbols) -> Option<&'s Literal> {
    symbols.value(value(term, binding)?).as_literal()
}
