//! Partial evaluation of derived predicates: those that no action can change become initial facts.
//!
//! The clauses of settled predicates (`settle`) have no negated atoms, so their extension is the
//! least fixpoint over the stated facts, the same set in every state. It is computed by naive
//! evaluation, in which each clause matches its most restrictive atoms first.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use pddl::ast::{Domain, Name};

use super::clause::{self, Clause, Fact, Literal, Operand};
use super::possible::Possible;
use super::settle::{Guards, settle};

/// The settled derived predicates, and their clauses.
#[derive(Debug, Clone, Default)]
pub(super) struct Folded {
    settled: BTreeMap<Name, Vec<Clause>>,
    possible: Possible,
}

impl Folded {
    /// Settles predicates in `known`, and predicates whose axioms mention no others, as far as
    /// possible. Actions and timed initial literals change the predicates in `changed`; of these,
    /// timed initial literals change those in `timed`.
    pub fn new(
        domain: &Domain,
        (changed, timed): (&BTreeSet<Name>, &BTreeSet<Name>),
        guards: &Guards,
        known: &HashSet<Name>,
    ) -> Self {
        let axioms: Vec<(&Name, Option<Vec<Clause>>)> = domain
            .derived
            .iter()
            .map(|axiom| (&axiom.head.identifier.name, clause::clauses(axiom)))
            .collect();
        let vocabulary = with_small(&axioms, known.clone());
        let mut clauses_by_head: BTreeMap<Name, Option<Vec<Clause>>> = BTreeMap::new();
        for (head, clauses) in axioms {
            add(&mut clauses_by_head, head, clauses.filter(|_| vocabulary.contains(head)));
        }
        let (settled, open) = settle(clauses_by_head, changed, guards);
        let possible = Possible::new(domain, &open, (changed, timed), &|class| vocabulary.contains(class));
        Self { settled, possible }
    }

    /// Removes the axioms of settled predicates from a domain.
    pub fn shorten(&self, domain: &mut Domain) {
        domain.derived.retain(|axiom| !self.settled.contains_key(&axiom.head.identifier.name));
        self.possible.restrict(domain);
    }

    /// Returns the facts of settled predicates and the bounds of the open ones, given the stated
    /// facts and the types of objects.
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

/// Adds to `known` the predicates whose axioms mention only predicates in it. Other axioms, for
/// example about maps, may have very large extensions.
fn with_small(axioms: &[(&Name, Option<Vec<Clause>>)], mut known: HashSet<Name>) -> HashSet<Name> {
    let is_small = |clauses: &[Clause], known: &HashSet<Name>| {
        let is_known = |part: &Literal| match part {
            Literal::Holds(name, _) => part.is_type() || known.contains(name),
            Literal::Equal(..) => true,
        };
        clauses.iter().all(|clause| clause.is_bound() && clause.body.iter().all(is_known))
    };
    let mut large: BTreeSet<&Name> = axioms.iter().map(|(head, _)| *head).collect();
    large.retain(|head| !known.contains(*head));
    loop {
        let is_small = |(_, clauses): &&(&Name, Option<Vec<Clause>>)| {
            clauses.as_ref().is_some_and(|clauses| is_small(clauses, &known))
        };
        let next = large.iter().copied().find(|head| {
            let mut matching = axioms.iter().filter(|(other, _)| other == head);
            matching.all(|axiom| is_small(&axiom))
        });
        let Some(next) = next else { return known };
        large.remove(next);
        known.insert(next.clone());
    }
}

/// Computes the least fixpoint of clauses over the stated facts.
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

fn add(all: &mut BTreeMap<Name, Option<Vec<Clause>>>, head: &Name, more: Option<Vec<Clause>>) {
    let entry = all.entry(head.clone()).or_insert_with(|| Some(Vec::new()));
    match (entry.as_mut(), more) {
        (Some(known), Some(more)) => known.extend(more),
        _ => *entry = None,
    }
}

/// Variable bindings.
type Bindings<'k> = BTreeMap<&'k Name, &'k Name>;

/// The arguments for which a predicate holds, in the order of their discovery and as a set.
type Rows = (Vec<Vec<Name>>, HashSet<Vec<Name>>);

/// Derived facts, by predicate.
struct Relations<'o> {
    relations: HashMap<Name, Rows>,
    objects: &'o BTreeSet<Name>,
}

impl Relations<'_> {
    fn insert(&mut self, predicate: &Name, arguments: Vec<Name>) -> bool {
        let (rows, all) = self.relations.entry(predicate.clone()).or_default();
        let is_new = all.insert(arguments.clone());
        if is_new {
            rows.push(arguments);
        }
        is_new
    }

    fn rows(&self, predicate: &Name) -> &[Vec<Name>] {
        self.relations.get(predicate).map_or(&[], |(rows, _)| rows)
    }

    /// Orders the conjuncts: atoms that share variables with earlier ones first, small relations
    /// first; types and inequalities as soon as their variables are bound.
    fn order<'b>(&self, body: &'b [Literal]) -> Vec<&'b Literal> {
        // Greedy join ordering: each step takes the cheapest remaining conjunct.
        let (mut left, mut order): (Vec<&Literal>, Vec<&Literal>) = (body.iter().collect(), Vec::new());
        let mut bound: BTreeSet<&Name> = BTreeSet::new();
        while !left.is_empty() {
            let cost = |part: &Literal| {
                let operands = part.operands();
                let is_free =
                    |operand: &&&Operand| matches!(operand, Operand::Variable(name) if !bound.contains(name));
                let free = operands.iter().filter(is_free).count();
                let rows = part.name().map_or(0, |name| self.rows(name).len());
                let is_test = part.name().is_none() || part.is_type();
                let is_apart = free == operands.len() && !bound.is_empty();
                // Lexicographic: fully bound conjuncts, no unbound tests, no Cartesian products,
                // few new variables, and small relations come first.
                (free > 0, is_test && free > 0, is_apart && free > 0, free, rows)
            };
            let best = (0..left.len()).min_by_key(|&index| cost(left[index])).unwrap_or(0);
            let next = left.remove(best);
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
        found: &mut Bindings<'k>,
        each: &mut dyn FnMut(&Bindings<'k>),
    ) {
        let Some((part, rest)) = order.split_first() else { return each(found) };
        let free = part.operands().into_iter().find(|operand| value(operand, found).is_none());
        match (part, free) {
            // No atom binds this variable, so it ranges over all objects.
            (Literal::Equal(..), Some(Operand::Variable(name))) => {
                for object in self.objects {
                    found.insert(name, object);
                    self.matches(order, found, each);
                    found.remove(name);
                }
            }
            (Literal::Equal(same, left, right), _) => {
                if (value(left, found) == value(right, found)) == *same {
                    self.matches(rest, found, each);
                }
            }
            (Literal::Holds(predicate, operands), _) => {
                for row in self.rows(predicate) {
                    // A partial match may have bound some variables before it failed.
                    let before = found.clone();
                    if row.len() == operands.len()
                        && operands.iter().zip(row).all(|(operand, argument)| bind(operand, argument, found))
                    {
                        self.matches(rest, found, each);
                    }
                    *found = before;
                }
            }
        }
    }

    /// Adds the instances of a head. Arguments that the body does not bind range over all objects.
    fn heads(&self, clause: &Clause, found: &Bindings<'_>, new: &mut Vec<Fact>) {
        let mut rows: Vec<(Vec<Name>, Bindings<'_>)> = vec![(Vec::new(), found.clone())];
        for argument in &clause.arguments {
            rows = rows
                .into_iter()
                .flat_map(|(row, found)| {
                    let values = match (value(argument, &found), argument) {
                        (Some(known), _) => vec![(known.clone(), found)],
                        (None, Operand::Variable(name)) => {
                            let with = |object| {
                                let mut extended = found.clone();
                                extended.insert(name, object);
                                (Name::clone(object), extended)
                            };
                            self.objects.iter().map(with).collect()
                        }
                        (None, Operand::Constant(_)) => Vec::new(),
                    };
                    values.into_iter().map(move |(value, found)| ([row.clone(), vec![value]].concat(), found))
                })
                .collect();
        }
        new.extend(rows.into_iter().map(|(row, _)| (clause.head.clone(), row)));
    }
}

fn value<'k>(operand: &'k Operand, found: &Bindings<'k>) -> Option<&'k Name> {
    match operand {
        Operand::Variable(name) => found.get(name).copied(),
        Operand::Constant(name) => Some(name),
    }
}

fn bind<'k>(operand: &'k Operand, argument: &'k Name, found: &mut Bindings<'k>) -> bool {
    match operand {
        Operand::Constant(name) => name == argument,
        Operand::Variable(name) => {
            if let Some(known) = found.get(name) {
                return *known == argument;
            }
            found.insert(name, argument);
            true
        }
    }
}
