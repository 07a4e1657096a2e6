//! What follows whatever the robot does, decided once: derived predicates to initial facts.
//!
//! A derived predicate of the knowledge base is *settled* if no action and no event changes anything that it depends on. Its rules
//! are conjunctions of atoms, equalities and comparisons without negated predicates, so that what it holds of is the least
//! fixpoint of the settled rules over the initial facts: the same set in every state. It is computed by naive evaluation, in
//! which each rule asks first for what restricts most.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use pddl::ast::{Condition, Derived, Domain, Name, Term};

/// Facts by name.
type Said = (Name, Vec<Name>);

/// The settled derived predicates, and their rules.
#[derive(Debug, Clone, Default)]
pub(super) struct Folded {
    heads: BTreeSet<Name>,
    rules: Vec<Rule>,
}

/// `head(parameters) ← body`, a disjunction of conjunctions.
#[derive(Debug, Clone)]
struct Rule {
    head: Name,
    parameters: Vec<Name>,
    body: Vec<Vec<Literal>>,
}

/// A conjunct.
#[derive(Debug, Clone)]
enum Literal {
    Holds(Name, Vec<Operand>),
    Equal(bool, Operand, Operand),
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Operand {
    Variable(Name),
    Constant(Name),
}

impl Folded {
    /// What is settled of the rules of a knowledge base in a domain whose actions and events change some predicates.
    pub fn new(derived: &[Derived], domain: &Domain, changed: &BTreeSet<Name>) -> Self {
        let mut open: BTreeSet<Name> = changed.clone();
        open.extend(domain.derived.iter().map(|own| own.head.identifier.name.clone()));
        let rules: Vec<(Name, Option<Rule>)> =
            derived.iter().map(|own| (own.head.identifier.name.clone(), rule(own))).collect();
        loop {
            let before = open.len();
            for (head, rule) in &rules {
                let depends = |own: &Rule| {
                    own.body.iter().flatten().any(|part| matches!(part, Literal::Holds(name, _) if open.contains(name)))
                };
                if rule.as_ref().is_none_or(depends) {
                    open.insert(head.clone());
                }
            }
            if open.len() == before {
                break;
            }
        }
        let rules: Vec<Rule> =
            rules.into_iter().filter(|(head, _)| !open.contains(head)).filter_map(|(_, rule)| rule).collect();
        Self { heads: rules.iter().map(|rule| rule.head.clone()).collect(), rules }
    }

    /// Takes what is settled out of the axioms of a domain.
    pub fn shorten(&self, domain: &mut Domain) {
        domain.derived.retain(|own| !self.heads.contains(&own.head.identifier.name));
    }

    /// What is settled, given what is stated of which objects.
    pub fn facts<'f>(
        &self,
        stated: impl Iterator<Item = &'f Said>,
        objects: &BTreeSet<Name>,
    ) -> BTreeSet<Said> {
        let mut known = Known { relations: HashMap::new(), objects };
        for (predicate, arguments) in stated {
            known.insert(predicate, arguments.clone());
        }
        let mut facts = BTreeSet::new();
        loop {
            let mut new = Vec::new();
            for rule in &self.rules {
                for body in &rule.body {
                    let order = known.order(body);
                    known.matches(&order, 0, &mut BTreeMap::new(), &mut |found| {
                        known.heads(rule, found, &mut |head| new.push((rule.head.clone(), head)));
                    });
                }
            }
            let mut grown = false;
            for (head, arguments) in new {
                if known.insert(&head, arguments.clone()) {
                    grown = true;
                    facts.insert((head, arguments));
                }
            }
            if !grown {
                return facts;
            }
        }
    }
}

/// What variables stand for.
type Found = BTreeMap<Name, Name>;

/// What holds so far.
struct Known<'o> {
    relations: HashMap<Name, (Vec<Vec<Name>>, HashSet<Vec<Name>>)>,
    objects: &'o BTreeSet<Name>,
}

impl Known<'_> {
    fn insert(&mut self, predicate: &Name, arguments: Vec<Name>) -> bool {
        let (rows, all) = self.relations.entry(predicate.clone()).or_default();
        let is_new = all.insert(arguments.clone());
        if is_new {
            rows.push(arguments);
        }
        is_new
    }

    /// The conjuncts, each behind what binds its variables if something does, small relations first.
    fn order<'b>(&self, body: &'b [Literal]) -> Vec<&'b Literal> {
        let (mut left, mut order): (Vec<&Literal>, Vec<&Literal>) = (body.iter().collect(), Vec::new());
        let mut bound: BTreeSet<&Name> = BTreeSet::new();
        while !left.is_empty() {
            let cost = |part: &Literal| {
                let free = operands(part).into_iter().filter(|own| {
                    matches!(own, Operand::Variable(name) if !bound.contains(name))
                });
                let free = free.count();
                match part {
                    // Equality binds one variable by the other, and never ranges over all objects if that can be helped.
                    Literal::Equal(same, ..) => if free == 0 || (*same && free == 1) { (0, 0) } else { (9, free) },
                    Literal::Holds(name, _) => {
                        let rows = self.relations.get(name).map_or(0, |(rows, _)| rows.len());
                        (if rows == 0 { 0 } else { free }, rows)
                    }
                }
            };
            let best = (0..left.len()).min_by_key(|&index| cost(left[index])).unwrap_or(0);
            let next = left.remove(best);
            bound.extend(operands(next).into_iter().filter_map(|own| match own {
                Operand::Variable(name) => Some(name),
                Operand::Constant(_) => None,
            }));
            order.push(next);
        }
        order
    }

    fn matches(&self, order: &[&Literal], at: usize, found: &mut Found, each: &mut dyn FnMut(&mut Found)) {
        let Some(part) = order.get(at) else { return each(found) };
        match part {
            Literal::Equal(same, left, right) => match (value(left, found), value(right, found)) {
                (Some(left), Some(right)) => {
                    if (left == right) == *same {
                        self.matches(order, at + 1, found, each);
                    }
                }
                (Some(known), None) if *same => self.bind(right, known, (order, at), found, each),
                (None, Some(known)) if *same => self.bind(left, known, (order, at), found, each),
                (left_known, _) => {
                    let free = if left_known.is_none() { left } else { right };
                    for object in self.objects {
                        if let Operand::Variable(name) = free {
                            found.insert(name.clone(), object.clone());
                            self.matches(order, at, found, each);
                            found.remove(name);
                        }
                    }
                }
            },
            Literal::Holds(predicate, operands) => {
                let rows = self.relations.get(predicate).map_or(&[][..], |(rows, _)| rows);
                for row in rows {
                    let mut own = Vec::new();
                    let fits = row.len() == operands.len()
                        && operands.iter().zip(row).all(|(operand, argument)| {
                            match (operand, value(operand, found)) {
                                (_, Some(known)) => known == *argument,
                                (Operand::Variable(name), None) => {
                                    found.insert(name.clone(), argument.clone());
                                    own.push(name);
                                    true
                                }
                                (Operand::Constant(_), None) => false,
                            }
                        });
                    if fits {
                        self.matches(order, at + 1, found, each);
                    }
                    for name in own {
                        found.remove(name);
                    }
                }
            }
        }
    }

    fn bind(
        &self,
        free: &Operand,
        known: Name,
        (order, at): (&[&Literal], usize),
        found: &mut Found,
        each: &mut dyn FnMut(&mut Found),
    ) {
        if let Operand::Variable(name) = free {
            found.insert(name.clone(), known);
            self.matches(order, at + 1, found, each);
            found.remove(name);
        }
    }

    /// The instances of a head; parameters that the body does not bind stand for anything.
    fn heads(&self, rule: &Rule, found: &Found, each: &mut dyn FnMut(Vec<Name>)) {
        let mut rows: Vec<Vec<Name>> = vec![Vec::new()];
        for parameter in &rule.parameters {
            let values: Vec<&Name> = match found.get(parameter) {
                Some(value) => vec![value],
                None => self.objects.iter().collect(),
            };
            let longer = |row: &Vec<Name>, value: &Name| row.iter().chain([value]).cloned().collect();
            rows = rows.iter().flat_map(|row| values.iter().map(move |value| longer(row, value))).collect();
        }
        rows.into_iter().for_each(each);
    }
}

fn value(operand: &Operand, found: &Found) -> Option<Name> {
    match operand {
        Operand::Variable(name) => found.get(name).cloned(),
        Operand::Constant(name) => Some(name.clone()),
    }
}

fn operands(part: &Literal) -> Vec<&Operand> {
    match part {
        Literal::Holds(_, operands) => operands.iter().collect(),
        Literal::Equal(_, left, right) => vec![left, right],
    }
}

/// A derived predicate as a rule; none if its body is not of the form that this room knows.
fn rule(derived: &Derived) -> Option<Rule> {
    let parameters = derived.head.parameters.iter().map(|own| own.identifier.name.clone()).collect();
    Some(Rule { head: derived.head.identifier.name.clone(), parameters, body: body(&derived.condition)? })
}

/// A condition as a disjunction of conjunctions. All variables of a rule of a knowledge base have names of their own.
fn body(condition: &Condition) -> Option<Vec<Vec<Literal>>> {
    match condition {
        Condition::And(parts) => {
            let mut all = vec![Vec::new()];
            for part in parts {
                let part = body(part)?;
                let both = |left: &Vec<Literal>, right: &Vec<Literal>| [left.clone(), right.clone()].concat();
                all = all.iter().flat_map(|left| part.iter().map(move |right| both(left, right))).collect();
            }
            Some(all)
        }
        Condition::Or(parts) => {
            let parts: Option<Vec<_>> = parts.iter().map(body).collect();
            Some(parts?.concat())
        }
        Condition::Exists(variables, inner) if variables.iter().all(|own| own.r#type.alternatives.is_empty()) => {
            body(inner)
        }
        Condition::Atom(atom) => {
            let operands = atom.arguments.iter().map(operand).collect();
            Some(vec![vec![Literal::Holds(atom.predicate.name.clone(), operands)]])
        }
        Condition::Equal(left, right, _) => {
            Some(vec![vec![Literal::Equal(true, operand(left), operand(right))]])
        }
        Condition::Not(inner) => match &**inner {
            Condition::Equal(left, right, _) => {
                Some(vec![vec![Literal::Equal(false, operand(left), operand(right))]])
            }
            _ => None,
        },
        _ => None,
    }
}

fn operand(term: &Term) -> Operand {
    match term {
        Term::Variable(own) => Operand::Variable(own.name.clone()),
        Term::Constant(own) => Operand::Constant(own.name.clone()),
    }
}
