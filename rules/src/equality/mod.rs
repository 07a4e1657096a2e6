//! Equality of individuals by representatives: facts are stored once for each class of equal names ([1]).
//!
//! The engine's store, rules and recorded derivations speak of representatives only; this module translates. A pair that
//! is stated or concluded joins two classes: the facts about one representative are restated about the other, and the
//! rules' constants follow. What an equality rested on when it came about, down to stated facts and earlier equalities,
//! is kept ([`classes`]). When one of these facts or a rule of the derivation is deleted, so are the equalities that rest on it; their classes are taken
//! apart, what was stated about their names is restated, and whatever equality still follows is found again. This
//! differs from [2], which over-deletes along all derivations and needs no record of equalities.
//!
//! From outside every name of an individual has all its facts. Literals are never one with anything else: a pair with a
//! literal joins nothing and is reported as a violation. Pairs of a name with itself are shown only where they are stated;
//! in bodies an individual that has several names is the same as itself.
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
use crate::safety::bound_variables;
use crate::symbol::{Symbol, Symbols};
use crate::vocabulary::{DIFFERENT_FROM, SAME_AS};
use classes::Classes;

impl Program {
    /// Returns the program under OWL's reading of names: `owl:sameAs` is equality, and `differentFrom` in bodies matches
    /// stated and concluded facts of `owl:differentFrom`; without equality it compares names.
    ///
    /// `sameAs` in a body compares individuals where one of its terms is a variable that another atom binds. Between two
    /// constants, or two variables that no other atom binds, it matches pairs of names of individuals that have several
    /// names; an individual with one name then equals itself only where that is stated.
    #[must_use]
    pub fn with_equality(&self, symbols: &mut Symbols) -> Self {
        let (same, different) = (symbols.name(SAME_AS), symbols.name(DIFFERENT_FROM));
        let mut program = Self { equality: true, ..self.clone() };
        for rule in &mut program.rules {
            let bound = bound_variables(rule);
            let is_bound = |term: Term| term.as_variable().is_some_and(|v| bound[usize::from(v.0)]);
            for atom in &mut rule.body {
                match *atom {
                    Atom::Same(left, right) if left != right && !is_bound(left) && !is_bound(right) => {
                        *atom = Atom::relation(same, [left, right]);
                    }
                    Atom::Different(left, right) => *atom = Atom::relation(different, [left, right]),
                    _ => {}
                }
            }
        }
        let [x, y] = [0, 1].map(|number| Term::from(Variable(number)));
        let differ = |left, right| vec![Atom::relation(different, [left, right])];
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

/// Which names are one, and what is stated about them.
#[derive(Clone, Debug)]
pub(crate) struct Equality {
    /// The relation that equality is stated and concluded in.
    same: Symbol,
    classes: Classes,
    /// By row about representatives: the stated facts that it stands for, where that is not the row alone.
    originals: FxHashMap<Fact, BTreeSet<Fact>>,
    /// By name: the pairs of names that are stated with it.
    pairs: FxHashMap<Symbol, BTreeSet<Fact>>,
    /// The rules over representatives, in the order of the engine's.
    pub program: Arc<Program>,
    /// What the rules mention.
    constants: FxHashSet<Symbol>,
}

impl Equality {
    pub fn new(same: Symbol, program: &Arc<Program>) -> Self {
        let (classes, originals, pairs) = (Classes::default(), FxHashMap::default(), FxHashMap::default());
        let constants = constants(program).collect();
        Self { same, classes, originals, pairs, program: Arc::clone(program), constants }
    }

    /// The same without any facts.
    pub fn emptied(&self, program: &Arc<Program>) -> Self {
        Self::new(self.same, program)
    }

    /// Whether a fact relates two names by equality, or anything to itself.
    fn is_pair(&self, fact: &Fact, symbols: &Symbols) -> bool {
        fact.predicate == self.same
            && fact.arguments.len() == 2
            && (fact.arguments[0] == fact.arguments[1]
                || fact.arguments.iter().all(|&symbol| symbols.as_literal(symbol).is_none()))
    }

    fn is_stated_pair(&self, fact: &Fact) -> bool {
        self.pairs.get(&fact.arguments[0]).is_some_and(|pairs| pairs.contains(fact))
    }

    /// Whether a row about representatives says that an individual is itself, for rules that ask.
    fn is_reflexive(&self, row: &Fact) -> bool {
        row.predicate == self.same && row.arguments.len() == 2 && row.arguments[0] == row.arguments[1]
    }

    /// The fact about representatives.
    pub fn normal(&self, fact: &Fact) -> Fact {
        self.classes.normal(fact)
    }

    /// The names of a representative's class, where there are several.
    fn names(&self, representative: Symbol) -> Option<&[Symbol]> {
        self.classes.members(representative).map(|members| &**members)
    }

    /// The program over representatives.
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

/// The names and values that rules mention.
fn constants(program: &Program) -> impl Iterator<Item = Symbol> {
    let atoms = program.rules.iter().flat_map(|rule| rule.head.iter().chain(&rule.body));
    atoms.flat_map(Atom::terms).filter_map(|term| match term {
        Term::Constant(symbol) => Some(symbol),
        Term::Variable(_) => None,
    })
}

impl Atom {
    /// The atom with other terms.
    fn map(&self, term: &impl Fn(Term) -> Term) -> Self {
        let all = |terms: &[Term]| terms.iter().copied().map(term).collect();
        match self {
            Self::Relation { predicate, arguments } => {
                Self::Relation { predicate: *predicate, arguments: all(arguments) }
            }
            Self::Not { predicate, arguments } => {
                Self::Not { predicate: *predicate, arguments: all(arguments) }
            }
            Self::BuiltIn { built_in, arguments } => {
                Self::BuiltIn { built_in: *built_in, arguments: all(arguments) }
            }
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
