//! Random programs under random scripts of changes. After every step, the engine holds exactly the facts of
//! naive evaluation from scratch, reports exactly the difference, and can prove every fact.

use std::collections::{BTreeMap, BTreeSet};

use metaplan_rules::replay::{Fault, replay};
use metaplan_rules::{
    Aggregate, Atom, BuiltIn, Cause, Delta, Derivation, DerivationStep, Engine, Fact, Literal, Program,
    Reason, Rule, RuleIdentity, Symbol, Symbols, Term, Variable,
};

use crate::oracle::{
    self, Binding, close_under_equality, ground, holds, is_reflexive, matches, naive, normal,
    representatives, value,
};

const PREDICATES: u8 = 9;
/// Number of predicates per level, with one, two and three arguments.
const PER_LEVEL: u8 = 3;
/// Number of the predicate that is `owl:sameAs` in scripts with equality.
const EQUALITY: u8 = 1;
const SAME_AS: &str = "http://www.w3.org/2002/07/owl#sameAs";
/// Number of the predicate that is `owl:differentFrom` in scripts with equality.
const DIFFERENCE: u8 = 4;
const DIFFERENT_FROM: &str = "http://www.w3.org/2002/07/owl#differentFrom";
const VARIABLES: u8 = 4;
const CONSTANTS: u8 = 4;
/// Numbers of the predicates in changes. Frequent predicates occur several times. There are only few
/// predicates, so that different conclusions interact. [`CONCLUDED`] contains the predicates in heads.
const CHANGED: [u8; 16] = [0, 0, 0, 0, 1, 1, 1, 1, 0, 1, 2, 3, 3, 4, 6, 7];
const CONCLUDED: [u8; 9] = [0, 1, 2, 3, 3, 4, 4, 6, 7];

/// An unprocessed random atom: kind, predicate, arguments.
pub type RawAtom = (u8, u8, [u8; 3]);
/// An unprocessed random rule: head predicates and arguments, body.
pub type RawRule = (Vec<(u8, [u8; 3])>, Vec<RawAtom>);
/// A random change: insertion flag, predicate, arguments.
pub type RawChange = (bool, u8, [u8; 3]);

fn arity(predicate: u8) -> usize {
    1 + usize::from(predicate % PER_LEVEL)
}

struct World {
    symbols: Symbols,
    predicates: Vec<Symbol>,
    constants: Vec<Symbol>,
    equality: bool,
}

impl World {
    fn new(equality: bool) -> Self {
        let mut symbols = Symbols::new();
        let name = |number| match number {
            EQUALITY if equality => SAME_AS.into(),
            DIFFERENCE if equality => DIFFERENT_FROM.into(),
            _ => format!("p{number}"),
        };
        let predicates = (0..PREDICATES).map(|number| symbols.name(&name(number))).collect();
        for name in ["integer", "string"] {
            let iri = format!("http://www.w3.org/2001/XMLSchema#{name}");
            symbols.literal(Literal::Uri(iri.into()));
        }
        let names = ["a", "b"].map(|name| symbols.name(name));
        let numbers = [1, 2].map(|number| symbols.literal(Literal::integer(number)));
        Self { symbols, predicates, equality, constants: names.into_iter().chain(numbers).collect() }
    }

    fn level(&self, predicate: Symbol) -> usize {
        self.predicates
            .iter()
            .position(|&candidate| candidate == predicate)
            .map_or(0, |position| position / usize::from(PER_LEVEL))
    }

    fn fact(&self, predicate: u8, arguments: [u8; 3]) -> Fact {
        let predicate = CHANGED[usize::from(predicate % 16)];
        let arguments = arguments.iter().take(arity(predicate));
        let constant = |&number: &u8| self.constants[usize::from(number % CONSTANTS)];
        Fact::new(self.predicates[usize::from(predicate)], arguments.map(constant))
    }

    fn term(&self, number: u8) -> Term {
        match number % (VARIABLES + CONSTANTS) {
            variable if variable < VARIABLES => Term::Variable(Variable(variable.into())),
            constant => Term::Constant(self.constants[usize::from(constant - VARIABLES)]),
        }
    }

    fn relation(&self, predicate: u8, arguments: &[u8]) -> Atom {
        let arguments = arguments.iter().take(arity(predicate)).map(|&number| self.term(number));
        Atom::relation(self.predicates[usize::from(predicate)], arguments)
    }

    /// Creates a safe, stratified rule from random numbers. Negated predicates have a lower level than the
    /// heads. Unbound variables become constants.
    fn rule(&self, position: usize, raw: &RawRule) -> Rule {
        let (heads, body) = raw;
        let constraint = heads[0].0 % 9 == 8;
        let heads = heads.iter().map(|(head, arguments)| {
            (if constraint { 8 } else { CONCLUDED[usize::from(head % 9)] }, arguments)
        });
        let heads: Vec<(u8, &[u8; 3])> = heads.collect();
        let level = heads.iter().map(|(head, _)| head / PER_LEVEL).min().unwrap_or(0);
        let positive = body.iter().filter(|(kind, ..)| kind % 13 < 4 || level == 0 && kind % 13 < 7);
        let relations =
            positive.map(|(_, p, arguments)| self.relation(p % (PER_LEVEL * (level + 1)), arguments));
        let mut atoms: Vec<Atom> = relations.collect();
        let mut bound: BTreeSet<Term> = atoms.iter().flat_map(Atom::terms).collect();
        let safe = |term: Term, bound: &BTreeSet<Term>| match term {
            Term::Variable(_) if !bound.contains(&term) => Term::Constant(self.constants[0]),
            other => other,
        };
        for &(kind, p, [a, b, c]) in body {
            let [left, right] = [a, b].map(|number| safe(self.term(number), &bound));
            match kind % 13 {
                4..=6 if level > 0 => {
                    let p = p % (PER_LEVEL * level);
                    let arguments = [left, right].into_iter().chain([left]).take(arity(p)).collect();
                    atoms.push(Atom::Not { predicate: self.predicates[usize::from(p)], arguments });
                }
                7 => {
                    let built_in = if p % 2 == 0 { BuiltIn::LessThan } else { BuiltIn::NotEqual };
                    let test = Atom::BuiltIn { built_in, arguments: vec![left, right] };
                    atoms.push(if c % 2 == 0 { test } else { test.negated() });
                }
                // Under equality, `differentFrom` is a relation of level 1.
                8 if p % 2 == 0 && self.equality && level == 0 => {}
                8 if p % 2 == 0 && c % 3 == 0 && (!self.equality || level > 1) => {
                    atoms.push(Atom::NotDifferent(left, right));
                }
                8 if p % 2 == 0 => atoms.push(Atom::Different(left, right)),
                // Under equality, `sameAs` is a relation of level 0.
                8 if c % 5 == 0 && (!self.equality || level > 0) => atoms.push(Atom::NotSame(left, right)),
                8 => {
                    let result = Term::Variable(Variable(u16::from(c % VARIABLES)));
                    bound.insert(result);
                    atoms.push(Atom::Same(result, right));
                }
                9 if level > 0 && atoms.iter().all(|atom| self.is_below(atom, level)) => {
                    let result = Term::Variable(Variable(u16::from(VARIABLES + c % 2)));
                    bound.insert(result);
                    let arguments = vec![result, left, right];
                    atoms.push(Atom::BuiltIn { built_in: BuiltIn::Subtract, arguments });
                }
                10 if p % 3 > 0 => {
                    let datatype = ["integer", "string"].map(|name| self.datatype(name))[usize::from(p % 2)];
                    let arguments = vec![left, datatype];
                    atoms.push(Atom::BuiltIn { built_in: BuiltIn::DataRange, arguments });
                }
                11 | 12 if level > 0 => {
                    let result = Term::Variable(Variable(u16::from(VARIABLES + c % 2)));
                    // Outer atoms that bind variables of an aggregate must have a lower level, too.
                    let differs = self.equality && level == 1 && body.iter().any(|(kind, ..)| kind % 13 == 8);
                    let below = !differs && atoms.iter().all(|atom| self.is_below(atom, level));
                    let outer_variables = if below { bound.clone() } else { BTreeSet::new() };
                    atoms.push(self.aggregate(result, (kind / 13, p, [a, b, c]), level, &outer_variables));
                    bound.insert(result);
                }
                _ => {}
            }
        }
        let computed = Term::Variable(Variable(u16::from(VARIABLES)));
        let head = |&(head, arguments): &(u8, &[u8; 3])| {
            let mut terms = arguments.map(|number| safe(self.term(number), &bound));
            if bound.contains(&computed) {
                terms[0] = computed;
            }
            Atom::relation(self.predicates[usize::from(head)], terms.into_iter().take(arity(head)))
        };
        let heads: Vec<Atom> = heads.iter().map(head).collect();
        let identity = RuleIdentity::new("random", position as u32);
        Rule::new(identity, if constraint { vec![] } else { heads }, atoms)
    }

    fn datatype(&self, name: &str) -> Term {
        let iri = format!("http://www.w3.org/2001/XMLSchema#{name}");
        Term::Constant(self.symbols.find_literal(&Literal::Uri(iri.into())).expect("interned"))
    }

    /// Creates an aggregate over one or two atoms of lower levels. The second may contain variables that
    /// are bound outside.
    fn aggregate(&self, result: Term, (way, p, numbers): RawAtom, level: u8, bound: &BTreeSet<Term>) -> Atom {
        let below = PER_LEVEL * level;
        let first = self.relation(p % below, &numbers);
        let terms = first.terms();
        let value = terms[usize::from(way) % terms.len()];
        let outer_variable =
            bound.iter().nth(usize::from(p) % bound.len().max(1)).copied().unwrap_or(terms[0]);
        let second = match way / 4 % 5 {
            0 => Some(self.relation((p / 3) % below, &[numbers[2], numbers[1], numbers[0]])),
            1 => Some(Atom::Not { predicate: self.predicates[0], arguments: vec![value] }),
            2 => Some(Atom::BuiltIn { built_in: BuiltIn::LessThan, arguments: vec![value, outer_variable] }),
            _ => None,
        };
        let aggregate = match way % 4 {
            0 => Aggregate::Count,
            1 => Aggregate::Sum(value),
            2 => Aggregate::Min(value),
            _ => Aggregate::Max(value),
        };
        Atom::Aggregate { aggregate, result, body: std::iter::once(first).chain(second).collect() }
    }

    fn is_below(&self, atom: &Atom, level: u8) -> bool {
        match atom {
            Atom::Relation { predicate, .. } => self.level(*predicate) < usize::from(level),
            Atom::Different(..) | Atom::NotDifferent(..) => !self.equality || level > 1,
            Atom::NotSame(..) => !self.equality || level > 0,
            _ => true,
        }
    }
}

/// Checks that the first step follows from its supports by its rule, and that no fact supports itself. The
/// other steps need no check here, because each of them is the first step of the derivation of its own fact.
fn check_derivation(engine: &Engine, derivation: &Derivation, facts: &BTreeSet<Fact>) {
    let mut supported = vec![false; derivation.steps.len()];
    // The number of passes is at most the length of the longest chain. A circle is never resolved.
    for _ in 0..derivation.steps.len() {
        for (position, step) in derivation.steps.iter().enumerate() {
            supported[position] |= match &step.reason {
                Reason::Asserted => engine.is_asserted(&step.fact),
                Reason::Equality { supports } => supports.iter().all(|&support| supported[support]),
                Reason::Rule { supports, aggregates, .. } => {
                    let matched = aggregates.iter().flat_map(|aggregate| aggregate.matches.iter().flatten());
                    supports.iter().chain(matched).all(|&support| supported[support])
                }
            };
        }
    }
    assert!(supported.iter().all(|&supported| supported), "circular: {derivation:?}");
    assert!(derivation.steps.iter().all(|step| facts.contains(&step.fact)), "{derivation:?}");
    let names = representatives(engine.symbols(), facts);
    let find = |symbol: Symbol| names.get(&symbol).copied().unwrap_or(symbol);
    if let Reason::Equality { supports } = &derivation.steps[0].reason {
        let supporting: Vec<&Fact> =
            supports.iter().map(|&support| &derivation.steps[support].fact).collect();
        check_equality(engine, &derivation.steps[0].fact, &supporting);
    }
    for step in &derivation.steps[..1] {
        let Reason::Rule { identity, bindings, supports, absent, aggregates } = &step.reason else {
            continue;
        };
        let rule =
            engine.program().rules.iter().find(|rule| rule.identity == *identity).expect("an active rule");
        let number = |name: &String| {
            let mut variables = (0..rule.variable_count() as u16).map(Variable);
            variables.find(|&variable| rule.variable_name(variable) == *name).expect("a variable of the rule")
        };
        let values: Binding = bindings.iter().map(|(name, value)| (number(name), *value)).collect();
        let mut aggregates = aggregates.iter();
        assert!(rule.head.iter().any(|head| ground(head, &values) == step.fact), "{step:?}");
        let body = |negated: bool| {
            let atoms = rule.body.iter().filter(move |atom| match atom {
                Atom::Relation { .. } => !negated,
                Atom::Not { .. } => negated,
                _ => false,
            });
            atoms.map(|atom| ground(atom, &values)).collect::<Vec<_>>()
        };
        let supporting: Vec<Fact> =
            supports.iter().map(|&support| derivation.steps[support].fact.clone()).collect();
        assert_eq!(body(false), supporting);
        assert_eq!(&body(true), absent);
        assert!(absent.iter().all(|fact| !engine.holds(fact)));
        for atom in &rule.body {
            assert!(match atom {
                Atom::BuiltIn { built_in, arguments } =>
                    holds(*built_in, arguments, &values, engine.symbols()),
                Atom::Same(left, right) => {
                    value(*left, &values).map(find) == value(*right, &values).map(find)
                }
                Atom::Different(left, right) => value(*left, &values) != value(*right, &values),
                Atom::NotBuiltIn { built_in, arguments } =>
                    !holds(*built_in, arguments, &values, engine.symbols()),
                Atom::NotSame(left, right) => {
                    value(*left, &values).map(find) != value(*right, &values).map(find)
                }
                Atom::NotDifferent(left, right) => value(*left, &values) == value(*right, &values),
                Atom::Aggregate { aggregate, result, .. } => {
                    let aggregated = aggregates.next().expect("one for each");
                    let bound: BTreeSet<Term> = values.keys().map(|&variable| variable.into()).collect();
                    let mut symbols = engine.symbols().clone();
                    let expected = oracle::aggregate(atom, &values, &mut symbols, facts, &bound);
                    value(*result, &values) == Some(aggregated.result)
                        && expected.as_ref() == engine.symbols().value(aggregated.result).as_literal()
                        && (*aggregate != Aggregate::Count
                            || expected == Some(Literal::integer(aggregated.matches.len() as i64)))
                }
                Atom::Relation { .. } | Atom::Not { .. } => true,
            });
        }
    }
}

/// Checks that a fact follows from the corresponding fact about other names, or a pair of names from a path
/// of pairs.
fn check_equality(engine: &Engine, fact: &Fact, supporting: &[&Fact]) {
    let same_as = engine.symbols().find_name(SAME_AS).expect("a name");
    let is_name = |&symbol: &Symbol| engine.symbols().value(symbol).as_name().is_some();
    let is_pair = |fact: &Fact| fact.predicate == same_as && fact.arguments.iter().all(is_name);
    let (first, pairs) =
        if is_pair(fact) { (None, supporting) } else { (Some(supporting[0]), &supporting[1..]) };
    assert!(pairs.iter().all(|pair| is_pair(pair)));
    let mut pairs: BTreeSet<Fact> = pairs.iter().map(|&pair| pair.clone()).collect();
    close_under_equality(engine.symbols(), &BTreeSet::new(), &mut pairs);
    let are_one = |a: Symbol, b: Symbol| a == b || pairs.contains(&Fact::new(same_as, [a, b]));
    match first {
        None => assert!(are_one(fact.arguments[0], fact.arguments[1])),
        Some(other) => {
            assert_eq!(fact.predicate, other.predicate);
            assert!(fact.arguments.iter().zip(&other.arguments).all(|(&a, &b)| are_one(a, b)));
        }
    }
}

/// Returns the positions of the violated constraints, each with the number of its distinct matches.
fn violations(program: &Program, symbols: &mut Symbols, facts: &BTreeSet<Fact>) -> BTreeMap<u32, usize> {
    let random = program.rules.iter().filter(|rule| is_random(rule));
    let constraints = random.filter(|rule| rule.head.is_empty());
    let names = representatives(symbols, facts);
    let counts = constraints.map(|rule| {
        let bindings = matches(rule, symbols, facts);
        let individuals: BTreeSet<Binding> = bindings.iter().map(|binding| normal(binding, &names)).collect();
        (rule.identity.position, individuals.len())
    });
    counts.filter(|&(_, count)| count > 0).collect()
}

fn check_state(engine: &Engine, world: &World, stated: &BTreeSet<Fact>) -> BTreeSet<Fact> {
    let mut symbols = engine.symbols().clone();
    let close = |symbols: &Symbols, facts: &mut BTreeSet<Fact>| {
        if world.equality {
            close_under_equality(symbols, stated, facts);
        }
    };
    let level = |predicate| world.level(predicate);
    let rules = engine.program().rules.iter().filter(|rule| !rule.head.is_empty()).cloned().collect();
    let program = Program { rules, ..Program::default() };
    let expected = naive(&program, &mut symbols, stated, level, close);
    let facts: BTreeSet<Fact> = engine.facts().collect();
    // The pair of a name with itself holds only if it is stated.
    let is_shown = |fact: &&Fact| !is_reflexive(&symbols, fact) || stated.contains(fact);
    assert_eq!(facts, expected.iter().filter(is_shown).cloned().collect());
    for fact in &facts {
        assert_eq!(engine.is_asserted(fact), stated.contains(fact));
        check_derivation(engine, &engine.why(fact).expect("a derivation of what holds"), &expected);
        let pattern: Vec<Option<Symbol>> =
            fact.arguments.iter().enumerate().map(|(at, &symbol)| (at != 1).then_some(symbol)).collect();
        assert!(engine.matching(fact.predicate, &pattern).any(|row| row == fact.arguments));
    }
    for (predicate, constant) in (0..PREDICATES).step_by(3).flat_map(|p| (0..CONSTANTS).map(move |c| (p, c)))
    {
        let (predicate, constant) = (usize::from(predicate), usize::from(constant));
        let fact = Fact::new(world.predicates[predicate], [world.constants[constant]]);
        let misses = engine.why_not(&fact);
        assert!(misses.iter().all(|miss| !miss.obstacles.is_empty()), "{fact:?} {misses:?}");
        assert!(misses.is_empty() || !facts.contains(&fact));
    }
    let mut counts = BTreeMap::new();
    for violation in engine.violations() {
        if let Cause::Constraint(identity) = violation.cause {
            assert!(violation.supports.iter().all(|fact| facts.contains(fact)));
            if &*identity.source == "random" {
                *counts.entry(identity.position).or_insert(0) += 1;
            }
        }
    }
    assert_eq!(counts, violations(engine.program(), &mut symbols, &expected));
    check_replay(engine, stated, &facts);
    facts
}

/// Checks that the derivation of all facts is accepted by `replay` and, without equality, that a missing or an
/// invented step is rejected.
fn check_replay(engine: &Engine, stated: &BTreeSet<Fact>, facts: &BTreeSet<Fact>) {
    let rules = engine.program().rules.iter().filter(|rule| !rule.head.is_empty()).cloned().collect();
    let program = Program { rules, ..engine.program().clone() };
    let stated: Vec<Fact> = stated.iter().cloned().collect();
    let mut symbols = engine.symbols().clone();
    let mut everything = engine.everything();
    let replayed = replay(&program, &mut symbols, &stated, &everything);
    if engine.violations().iter().any(|violation| violation.cause == Cause::Clash) {
        assert!(matches!(replayed, Err(Fault::Inconsistent(_))), "{replayed:?}");
        return;
    }
    replayed.expect("what holds");
    let proved: BTreeSet<&Fact> = everything.steps.iter().map(|step| &step.fact).collect();
    let hidden = |fact: &&Fact| !facts.contains(fact);
    assert!(facts.iter().all(|fact| proved.contains(fact)));
    assert!(proved.iter().copied().filter(hidden).all(|fact| is_reflexive(&symbols, fact)));
    // Under equality, the pair of the last step may follow from other pairs.
    if !program.equality
        && let Some(last) = everything.steps.pop()
    {
        assert!(replay(&program, &mut symbols, &stated, &everything).is_err(), "without {last:?}");
        let made_up = Fact::new(last.fact.predicate, last.fact.arguments.iter().rev().copied());
        if !facts.contains(&made_up) {
            everything.steps.extend([last.clone(), DerivationStep { fact: made_up, ..last }]);
            assert!(replay(&program, &mut symbols, &stated, &everything).is_err(), "{everything:?}");
        }
    }
}

pub fn check(rules: &[RawRule], start: &[RawChange], script: &[Vec<RawChange>], equality: bool) {
    let world = World::new(equality);
    let rules = program(rules.iter().enumerate().map(|(at, raw)| world.rule(at, raw)).collect());
    // The engine evaluates identical rules once, under the identity of the first.
    let mut contents = BTreeSet::new();
    let distinct = |rule: &Rule| contents.insert(format!("{:?}{:?}", rule.head, rule.body));
    let program = program(rules.rules.into_iter().filter(distinct).collect());
    let program = renumber(program);
    let mut symbols = world.symbols.clone();
    let complete = |program: Program, symbols: &mut Symbols| {
        if equality { program.with_equality(symbols) } else { program }
    };
    let mut stated: BTreeSet<Fact> =
        start.iter().map(|&(_, p, arguments)| world.fact(p, arguments)).collect();
    let full = complete(program, &mut symbols);
    let program = Program {
        rules: full.rules.iter().filter(|rule| is_random(rule)).cloned().collect(),
        ..full.clone()
    };
    let mut engine = Engine::new(symbols, full, stated.iter().cloned()).expect("safe rules");
    let mut before = check_state(&engine, &world, &stated);
    let mut absent = BTreeSet::new();
    for step in script {
        if let Some(&(_, kind, [number, ..])) =
            step.first().filter(|(_, kind, _)| kind % 8 == 7 && !program.rules.is_empty())
        {
            let position = usize::from(number) % program.rules.len();
            let change = switch(&mut engine, &program, position, kind / 8, &mut absent);
            let after = check_state(&engine, &world, &stated);
            assert_difference(&change, &before, &after);
            before = after;
        }
        let facts = |is_insertion: bool| {
            let chosen = step.iter().filter(move |(insert, ..)| *insert == is_insertion);
            chosen.map(|&(_, p, arguments)| world.fact(p, arguments)).collect::<Vec<_>>()
        };
        let delta = Delta { insert: facts(true), delete: facts(false) };
        delta.delete.iter().for_each(|fact| {
            stated.remove(fact);
        });
        stated.extend(delta.insert.iter().cloned());
        let change = engine.apply(delta).expect("within the budget");
        let after = check_state(&engine, &world, &stated);
        assert_difference(&change, &before, &after);
        before = after;
    }
    let active = program.rules.into_iter().filter(|rule| !absent.contains(&rule.identity.position));
    let mut symbols = engine.symbols().clone();
    let reversed = complete(renumber(self::program(active.rev().collect())), &mut symbols);
    let engine = Engine::new(symbols, reversed, stated.into_iter().rev()).expect("safe rules");
    assert_eq!(engine.facts().collect::<BTreeSet<_>>(), before);
}

fn assert_difference(change: &Delta, before: &BTreeSet<Fact>, after: &BTreeSet<Fact>) {
    assert_eq!(change.insert, after.difference(before).cloned().collect::<Vec<_>>());
    assert_eq!(change.delete, before.difference(after).cloned().collect::<Vec<_>>());
}

/// Removes an active rule, or adds an absent rule, by one of several functions of the engine.
fn switch(
    engine: &mut Engine,
    program: &Program,
    position: usize,
    way: u8,
    absent: &mut BTreeSet<u32>,
) -> Delta {
    let rule = &program.rules[position];
    let number = rule.identity.position;
    let is_absent = absent.remove(&number);
    if !is_absent {
        absent.insert(number);
    }
    let change = match way % 2 {
        0 if !is_absent => engine.remove_rule(&rule.identity),
        0 => engine.add_rules([rule.clone()]),
        _ => {
            let mut rules = engine.program().rules.clone();
            rules.retain(|other| other != rule);
            if is_absent {
                rules.insert(0, rule.clone());
            }
            engine.set_program(Program { rules, ..engine.program().clone() })
        }
    };
    let random = engine.program().rules.iter().filter(|rule| is_random(rule));
    let active: BTreeSet<u32> = random.map(|rule| rule.identity.position).collect();
    let expected = program.rules.iter().map(|rule| rule.identity.position).filter(|n| !absent.contains(n));
    assert_eq!(active, expected.collect());
    change.expect("safe rules")
}

fn is_random(rule: &Rule) -> bool {
    &*rule.identity.source == "random"
}

fn program(rules: Vec<Rule>) -> Program {
    Program { rules, ..Program::default() }
}

fn renumber(rules: Program) -> Program {
    let number = |(position, rule)| Rule { identity: RuleIdentity::new("random", position as u32), ..rule };
    program(rules.rules.into_iter().enumerate().map(number).collect())
}
