//! Equality of individuals (`owl:sameAs`) by representatives: facts are stored once for each class of
//! equal names ([1]).
//!
//! The store, the compiled rules and the recorded derivations mention only the representative of each class.
//! This module translates between names and representatives. A stated or derived pair merges two
//! classes: one representative replaces the other in the stated facts and in the constants of the rules.
//! Each equality records its premises at the time of derivation: stated facts and earlier equalities
//! ([`classes`]). If one of these facts or a rule of the derivation is deleted, the equalities that
//! depend on it are deleted, too. Their classes are split, the stated facts about their names are
//! restated, and all equalities that still follow are derived again. This differs from [2], which
//! over-deletes along all derivations and needs no record of equalities.
//!
//! To a client, every name of an individual has all facts of the individual. A literal is never equal to a name or to
//! another literal: a pair with a literal merges nothing. It is a violation unless both are literals that may be
//! equal. The pair of a name with itself holds only if it is stated. In rule bodies, an individual with several names
//! is equal to itself.
//!
//! [1] Motik, Nenov, Piro, Horrocks, "Handling owl:sameAs via rewriting", AAAI 2015.
//! [2] Motik, Nenov, Piro, Horrocks, "Combining rewriting and incremental materialisation maintenance for Datalog
//!     programs with equality", IJCAI 2015.

mod classes;
mod proof;
mod update;
mod view;

use std::collections::BTreeSet;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::fact::Fact;
use crate::rule::{Atom, Program, Rule, RuleIdentity, Term, Variable};
use crate::safety::binding;
use crate::symbol::{Symbol, Symbols};
use crate::vocabulary::{DIFFERENT_FROM, SAME_AS};
use classes::Classes;

impl Program {
    /// Returns the program under OWL's semantics of names: `owl:sameAs` is equality, and `differentFrom` in rule
    /// bodies, also inside aggregates, matches stated and derived facts of `owl:differentFrom`. Without equality,
    /// `differentFrom` compares names. Two rules are added: `owl:differentFrom` is symmetric and irreflexive.
    ///
    /// `sameAs` in a body compares individuals, unless its terms are two different constants, or two variables that
    /// no other atom binds. Then the atom matches `owl:sameAs` facts between the names of individuals with several
    /// names. The pair of an individual's only name with itself matches only if it is stated.
    #[must_use]
    pub fn with_equality(&self, symbols: &mut Symbols) -> Self {
        let (same_as, different) = (symbols.name(SAME_AS), symbols.name(DIFFERENT_FROM));
        let mut program = Self { equality: true, ..self.clone() };
        for rule in &mut program.rules {
            // The rules are not checked yet, so that their variables need not be bound.
            let bound = binding(rule).bound.0;
            let is_bound = |term: Term| term.as_variable().is_some_and(|v| bound[usize::from(v.0)]);
            for atom in &mut rule.body {
                if let Atom::Same(left, right) = *atom
                    && left != right
                    && !is_bound(left)
                    && !is_bound(right)
                {
                    *atom = Atom::relation(same_as, [left, right]);
                }
                atom.replace_different(&mut |left, right| Atom::relation(different, [left, right]));
            }
        }
        let [x, y] = [0, 1].map(|number| Term::from(Variable(number)));
        let differ = |left, right| vec![Atom::relation(different, [left, right])];
        // Rules eq-diff-sym and eq-diff1 of OWL 2 RL: `differentFrom` is symmetric and irreflexive.
        for (label, head, body) in
            [("eq-diff-sym", differ(y, x), differ(x, y)), ("eq-diff1", Vec::new(), differ(x, x))]
        {
            let position = program.rules.len() as u32;
            let identity = RuleIdentity { source: "OWL 2 RL".into(), label: Some(label.into()), position };
            program.rules.push(Rule::new(identity, head, body));
        }
        program
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Equality {
    same_as: Symbol,
    classes: Classes,
    /// Maps each row (fact about representatives) to the stated facts that it represents, unless these are just the
    /// row itself.
    originals: FxHashMap<Fact, BTreeSet<Fact>>,
    /// Maps each name to the stated `owl:sameAs` pairs that contain it.
    pairs: FxHashMap<Symbol, BTreeSet<Fact>>,
    /// Rules with representatives as constants, in the order of the engine's rules.
    pub program: Arc<Program>,
    constants: FxHashSet<Symbol>,
}

impl Equality {
    pub fn new(same_as: Symbol, program: &Arc<Program>) -> Self {
        let (classes, originals, pairs) = (Classes::default(), FxHashMap::default(), FxHashMap::default());
        let constants = constants(program).collect();
        Self { same_as, classes, originals, pairs, program: Arc::clone(program), constants }
    }

    pub fn without_facts(&self, program: &Arc<Program>) -> Self {
        Self::new(self.same_as, program)
    }

    /// Returns `true` if a fact is an `owl:sameAs` pair of two names, or of anything with itself.
    fn is_pair(&self, fact: &Fact, symbols: &Symbols) -> bool {
        fact.predicate == self.same_as
            && fact.arguments.len() == 2
            && (fact.arguments[0] == fact.arguments[1]
                || fact.arguments.iter().all(|&symbol| symbols.as_literal(symbol).is_none()))
    }

    fn is_stated_pair(&self, fact: &Fact) -> bool {
        self.pairs.get(&fact.arguments[0]).is_some_and(|pairs| pairs.contains(fact))
    }

    fn is_reflexive(&self, row: &Fact) -> bool {
        row.predicate == self.same_as && row.arguments.len() == 2 && row.arguments[0] == row.arguments[1]
    }

    pub fn normal(&self, fact: &Fact) -> Fact {
        self.classes.normal(fact)
    }

    fn names(&self, representative: Symbol) -> Option<&[Symbol]> {
        self.classes.members(representative).map(|members| &**members)
    }

    pub fn normal_program(&self, program: &Program) -> Program {
        let term = |term: Term| match term {
            Term::Constant(symbol) => Term::Constant(self.classes.find(symbol)),
            variable @ Term::Variable(_) => variable,
        };
        let rules = program.rules.iter().map(|rule| {
            let head = rule.head.iter().map(|atom| atom.map(&term)).collect();
            let body = rule.body.iter().map(|atom| atom.map(&term)).collect();
            Rule { head, body, ..rule.clone() }
        });
        Program { rules: rules.collect(), ..program.clone() }
    }
}

fn constants(program: &Program) -> impl Iterator<Item = Symbol> {
    let atoms = program.rules.iter().flat_map(|rule| rule.head.iter().chain(&rule.body));
    atoms.flat_map(Atom::terms).filter_map(|term| match term {
        Term::Constant(symbol) => Some(symbol),
        Term::Variable(_) => None,
    })
}

impl Atom {
    /// Replaces a comparison of names (`differentFrom`), also inside an aggregate, by the atom that `replacement` returns,
    /// and a negated comparison by the negation of that atom.
    pub fn replace_different(&mut self, replacement: &mut impl FnMut(Term, Term) -> Self) {
        match self {
            Self::Different(left, right) => *self = replacement(*left, *right),
            Self::NotDifferent(left, right) => *self = replacement(*left, *right).negated(),
            Self::Aggregate { body, .. } => {
                for atom in body {
                    atom.replace_different(replacement);
                }
            }
            _ => {}
        }
    }

    fn map(&self, term: &impl Fn(Term) -> Term) -> Self {
        let map_terms = |terms: &[Term]| terms.iter().copied().map(term).collect();
        match self {
            Self::Relation { predicate, arguments } => {
                Self::Relation { predicate: *predicate, arguments: map_terms(arguments) }
            }
            Self::Not { predicate, arguments } => {
                Self::Not { predicate: *predicate, arguments: map_terms(arguments) }
            }
            Self::BuiltIn { built_in, arguments } => {
                Self::BuiltIn { built_in: *built_in, arguments: map_terms(arguments) }
            }
            Self::NotBuiltIn { built_in, arguments } => {
                Self::NotBuiltIn { built_in: *built_in, arguments: map_terms(arguments) }
            }
            Self::NotSame(left, right) => Self::NotSame(term(*left), term(*right)),
            Self::NotDifferent(left, right) => Self::NotDifferent(term(*left), term(*right)),
            Self::Same(left, right) => Self::Same(term(*left), term(*right)),
            Self::Different(left, right) => Self::Different(term(*left), term(*right)),
            Self::Aggregate { aggregate, result, body } => Self::Aggregate {
                aggregate: aggregate.map(term),
                result: term(*result),
                body: body.iter().map(|atom| atom.map(term)).collect(),
            },
        }
    }
}
