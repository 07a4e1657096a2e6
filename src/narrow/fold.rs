//! Partial evaluation of the derived predicates of a knowledge base's vocabulary: predicates that no action
//! can change become initial facts. Others get upper bounds, where possible. A derived predicate outside of
//! the vocabulary is included only if its axioms mention only included predicates and bind all their
//! variables.
//!
//! The clauses of settled predicates, which no action can change (`settle`), have no negated atoms. Their
//! extension is therefore the least fixpoint over the initial facts, the same set in every state. It is
//! computed by repeated evaluation of the clauses; each clause matches its most restrictive atoms first.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use pddl::ast::{Domain, Name};

use super::clause::{self, Clause, Fact, Literal, Operand};
use super::possible::Possible;
use super::settle::{Guards, settle};

#[derive(Debug, Clone, Default)]
pub(super) struct Folded {
    settled: BTreeMap<Name, Vec<Clause>>,
    possible: Possible,
}

impl Folded {
    /// Determines which derived predicates of the domain are settled, i.e. no action can change them, and which
    /// others get an upper bound. Candidates for both are the predicates in `vocabulary_of_base`, and
    /// predicates whose axioms mention only candidates and bind all their variables. `changed` contains the
    /// predicates that actions or timed initial literals change, `timed` those that timed initial literals
    /// change.
    pub fn new(
        domain: &Domain,
        (changed, timed): (&BTreeSet<Name>, &BTreeSet<Name>),
        guards: &Guards,
        vocabulary_of_base: &HashSet<Name>,
    ) -> Self {
        let axioms: Vec<(&Name, Option<Vec<Clause>>)> = domain
            .derived
            .iter()
            .map(|axiom| (&axiom.head.identifier.name, clause::clauses(axiom)))
            .collect();
        let vocabulary = with_small(&axioms, vocabulary_of_base.clone());
        let mut clauses_by_head: BTreeMap<Name, Option<Vec<Clause>>> = BTreeMap::new();
        for (head, clauses) in axioms {
            add(&mut clauses_by_head, head, clauses.filter(|_| vocabulary.contains(head)));
        }
        let (settled, open) = settle(clauses_by_head, changed, guards);
        let possible = Possible::new(domain, &open, (changed, timed), &|class| vocabulary.contains(class));
        Self { settled, possible }
    }

    /// Returns the predicates in the bodies of the clauses that [`facts`](Self::facts) evaluates. Its result depends on
    /// the initial facts of these predicates and of the vocabulary.
    pub fn premises(&self) -> BTreeSet<&Name> {
        let clauses = self.settled.values().flatten().chain(self.possible.clauses());
        clauses.flat_map(|clause| &clause.body).filter_map(Literal::name).collect()
    }

    pub fn shorten(&self, domain: &mut Domain) {
        domain.derived.retain(|axiom| !self.settled.contains_key(&axiom.head.identifier.name));
        self.possible.restrict(domain);
    }

    /// Returns the derived facts of settled predicates, without those in `stated` (the initial facts of the
    /// vocabulary and of [`premises`](Self::premises)), and the bounds of other derived predicates as facts,
    /// e.g. `(possible-p a)`. `is_of(object, type)` returns `true` if an object has a type.
    pub fn facts(
        &self,
        stated: &BTreeSet<Fact>,
        objects: &BTreeSet<Name>,
        is_of: &dyn Fn(&Name, &Name) -> bool,
    ) -> BTreeSet<Fact> {
        let settled: Vec<&Clause> = self.settled.values().flatten().collect();
        let mut facts = fixpoint(&settled, stated, objects, is_of);
        let mut fixed: BTreeSet<Fact> = stated.union(&facts).cloned().collect();
        fixed.extend(self.possible.added(&fixed));
        let open: Vec<&Clause> = self.possible.clauses().collect();
        facts.extend(self.possible.bounds(fixpoint(&open, &fixed, objects, is_of)));
        facts
    }
}

/// Adds to `vocabulary` the predicates whose axioms mention only predicates of the vocabulary and bind all their
/// variables. Other predicates, for example about maps, may have very large extensions.
fn with_small(axioms: &[(&Name, Option<Vec<Clause>>)], mut vocabulary: HashSet<Name>) -> HashSet<Name> {
    let is_small = |clauses: &[Clause], vocabulary: &HashSet<Name>| {
        let is_known = |part: &Literal| match part {
            Literal::Holds(name, _) => part.is_type() || vocabulary.contains(name),
            Literal::Equal(..) => true,
        };
        clauses.iter().all(|clause| clause.is_bound() && clause.body.iter().all(is_known))
    };
    let mut large: BTreeSet<&Name> = axioms.iter().map(|(head, _)| *head).collect();
    large.retain(|head| !vocabulary.contains(*head));
    loop {
        let is_small = |(_, clauses): &&(&Name, Option<Vec<Clause>>)| {
            clauses.as_ref().is_some_and(|clauses| is_small(clauses, &vocabulary))
        };
        let next = large.iter().copied().find(|head| {
            let mut matching = axioms.iter().filter(|(other, _)| other == head);
            matching.all(|axiom| is_small(&axiom))
        });
        let Some(next) = next else { return vocabulary };
        large.remove(next);
        vocabulary.insert(next.clone());
    }
}

fn fixpoint(
    clauses: &[&Clause],
    stated: &BTreeSet<Fact>,
    objects: &BTreeSet<Name>,
    is_of: &dyn Fn(&Name, &Name) -> bool,
) -> BTreeSet<Fact> {
    let mut relations = Relations { relations: HashMap::new(), objects };
    let parts = clauses.iter().flat_map(|clause| &clause.body);
    let types: BTreeSet<&Name> = parts.filter(|part| part.is_type()).filter_map(Literal::name).collect();
    for relation in types {
        let r#type = Name::new(relation.as_str().split(' ').nth(1).unwrap_or_default());
        for object in objects.iter().filter(|object| is_of(object, &r#type)) {
            relations.insert(relation, vec![object.clone()]);
        }
    }
    for (predicate, arguments) in stated {
        relations.insert(predicate, arguments.clone());
    }
    let mut facts = BTreeSet::new();
    // Predicates that have grown in the last round; clauses without any of them are skipped. `None`
    // in the first round.
    let mut grown: Option<BTreeSet<Name>> = None;
    loop {
        let has_grown = |part: &Literal| {
            part.name().is_some_and(|name| grown.as_ref().is_none_or(|grown| grown.contains(name)))
        };
        let is_due = |clause: &&Clause| grown.is_none() || clause.body.iter().any(has_grown);
        let mut new = Vec::new();
        for clause in clauses.iter().copied().filter(is_due) {
            let order = relations.order(&clause.body);
            relations.matches(&order, &mut BTreeMap::new(), &mut |bindings| {
                relations.heads(clause, bindings, &mut new);
            });
        }
        let mut changed = BTreeSet::new();
        for (head, arguments) in new {
            if relations.insert(&head, arguments.clone()) {
                changed.insert(head.clone());
                facts.insert((head, arguments));
            }
        }
        if changed.is_empty() {
            return facts;
        }
        grown = Some(changed);
    }
}

fn add(clauses_by_head: &mut BTreeMap<Name, Option<Vec<Clause>>>, head: &Name, clauses: Option<Vec<Clause>>) {
    let entry = clauses_by_head.entry(head.clone()).or_insert_with(|| Some(Vec::new()));
    match (entry.as_mut(), clauses) {
        (Some(earlier), Some(clauses)) => earlier.extend(clauses),
        _ => *entry = None,
    }
}

type Bindings<'k> = BTreeMap<&'k Name, &'k Name>;

/// Argument tuples for which a predicate holds, in the order of their discovery and as a set.
type Rows = (Vec<Vec<Name>>, HashSet<Vec<Name>>);

struct Relations<'o> {
    relations: HashMap<Name, Rows>,
    objects: &'o BTreeSet<Name>,
}

impl Relations<'_> {
    fn insert(&mut self, predicate: &Name, arguments: Vec<Name>) -> bool {
        let (rows, distinct_rows) = self.relations.entry(predicate.clone()).or_default();
        let is_new = distinct_rows.insert(arguments.clone());
        if is_new {
            rows.push(arguments);
        }
        is_new
    }

    fn rows(&self, predicate: &Name) -> &[Vec<Name>] {
        self.relations.get(predicate).map_or(&[], |(rows, _)| rows)
    }

    /// Orders the conjuncts of a body for matching: atoms that share variables with earlier atoms
    /// and have few rows come first, type tests and inequalities as soon as their variables are
    /// bound.
    fn order<'b>(&self, body: &'b [Literal]) -> Vec<&'b Literal> {
        // Greedy join ordering: each step takes the cheapest remaining conjunct.
        let (mut remaining, mut order): (Vec<&Literal>, Vec<&Literal>) = (body.iter().collect(), Vec::new());
        let mut bound: BTreeSet<&Name> = BTreeSet::new();
        while !remaining.is_empty() {
            let cost = |part: &Literal| {
                let operands = part.operands();
                let is_free =
                    |operand: &&&Operand| matches!(operand, Operand::Variable(name) if !bound.contains(name));
                let free = operands.iter().filter(is_free).count();
                let rows = part.name().map_or(0, |name| self.rows(name).len());
                let is_test = part.name().is_none() || part.is_type();
                let is_apart = free == operands.len() && !bound.is_empty();
                // Lexicographic cost: fully bound conjuncts come first. Tests with unbound variables come last,
                // after Cartesian products. The others are ordered by the number of new variables, then by the
                // number of rows.
                (free > 0, is_test && free > 0, is_apart && free > 0, free, rows)
            };
            let best = (0..remaining.len()).min_by_key(|&index| cost(remaining[index])).unwrap_or(0);
            let next = remaining.remove(best);
            bound.extend(next.operands().into_iter().filter_map(|operand| match operand {
                Operand::Variable(name) => Some(name),
                Operand::Constant(_) => None,
            }));
            order.push(next);
        }
        order
    }

    fn matches<'k>(
        &'k self,
        order: &[&'k Literal],
        bindings: &mut Bindings<'k>,
        visit: &mut dyn FnMut(&Bindings<'k>),
    ) {
        let Some((part, remaining)) = order.split_first() else { return visit(bindings) };
        let free = part.operands().into_iter().find(|operand| value(operand, bindings).is_none());
        match (part, free) {
            // No conjunct before the inequality binds this variable, so it ranges over all objects.
            (Literal::Equal(..), Some(Operand::Variable(name))) => {
                for object in self.objects {
                    bindings.insert(name, object);
                    self.matches(order, bindings, visit);
                    bindings.remove(name);
                }
            }
            (Literal::Equal(is_equality, left, right), _) => {
                if (value(left, bindings) == value(right, bindings)) == *is_equality {
                    self.matches(remaining, bindings, visit);
                }
            }
            (Literal::Holds(predicate, operands), _) => {
                for row in self.rows(predicate) {
                    // A partial match may have bound some variables before it failed.
                    let before = bindings.clone();
                    if row.len() == operands.len()
                        && operands
                            .iter()
                            .zip(row)
                            .all(|(operand, argument)| bind(operand, argument, bindings))
                    {
                        self.matches(remaining, bindings, visit);
                    }
                    *bindings = before;
                }
            }
        }
    }

    /// Appends to `new` the instances of the clause's head for the bindings. Arguments that the
    /// body does not bind range over all objects.
    fn heads(&self, clause: &Clause, bindings: &Bindings<'_>, new: &mut Vec<Fact>) {
        let mut rows: Vec<(Vec<Name>, Bindings<'_>)> = vec![(Vec::new(), bindings.clone())];
        for argument in &clause.arguments {
            rows = rows
                .into_iter()
                .flat_map(|(row, bindings)| {
                    let values = match (value(argument, &bindings), argument) {
                        (Some(value_of_argument), _) => vec![(value_of_argument.clone(), bindings)],
                        (None, Operand::Variable(name)) => {
                            let with = |object| {
                                let mut extended = bindings.clone();
                                extended.insert(name, object);
                                (Name::clone(object), extended)
                            };
                            self.objects.iter().map(with).collect()
                        }
                        (None, Operand::Constant(_)) => Vec::new(),
                    };
                    values
                        .into_iter()
                        .map(move |(value, bindings)| ([row.clone(), vec![value]].concat(), bindings))
                })
                .collect();
        }
        new.extend(rows.into_iter().map(|(row, _)| (clause.head.clone(), row)));
    }
}

fn value<'k>(operand: &'k Operand, bindings: &Bindings<'k>) -> Option<&'k Name> {
    match operand {
        Operand::Variable(name) => bindings.get(name).copied(),
        Operand::Constant(name) => Some(name),
    }
}

fn bind<'k>(operand: &'k Operand, argument: &'k Name, bindings: &mut Bindings<'k>) -> bool {
    match operand {
        Operand::Constant(name) => name == argument,
        Operand::Variable(name) => {
            if let Some(bound_value) = bindings.get(name) {
                return *bound_value == argument;
            }
            bindings.insert(name, argument);
            true
        }
    }
}
