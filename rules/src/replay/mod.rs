//! Independent checker of derivations: checks each step by itself, and completeness by plain joins, without
//! the engine.
//!
//! The facts that hold are the perfect model of a stratified program \[1\]. This model is the only set of
//! facts that is *founded* and *closed*, because a stratified program has exactly one stable model \[2\]. A
//! set is founded if each fact is stated, or derived by a rule from earlier facts while the negated atoms of
//! the rule are not in the set. It is closed if it contains all stated facts, and all facts that rules derive
//! from it. Therefore [`replay`] checks three properties: the rules are stratified, every step is founded,
//! and no fact is missing. The last check is essential, since a rule may negate a missing fact. Contradictory
//! facts are rejected, too.
//!
//! With equality, facts are compared by the first name of each class of equal names. The supports of a step may use
//! only equalities of earlier steps.
//!
//! The checker uses nothing of the engine's store, plans, strata or records. It shares the data types of rules, facts
//! and literals, and the evaluation of single built-ins and aggregates.
//!
//! \[1\] Przymusinski, "On the declarative semantics of deductive databases and logic programs", 1988.
//! \[2\] Gelfond, Lifschitz, "The stable model semantics for logic programming", ICLP 1988.

mod facts;
mod fault;
mod levels;
mod matches;
mod names;
mod write;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::derivation::{Derivation, DerivationStep, Reason};
use crate::fact::Fact;
use crate::literal::Literal;
use crate::rule::{Atom, Program, Rule, RuleIdentity, Variable};
use crate::symbol::{Symbol, Symbols};
use facts::Facts;
use matches::{Matcher, Values, instance};
use names::Names;

pub use fault::Fault;

const SAME_AS: &str = "http://www.w3.org/2002/07/owl#sameAs";
const DIFFERENT_FROM: &str = "http://www.w3.org/2002/07/owl#differentFrom";

/// Statistics of a successful [`replay`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Replayed {
    /// Number of facts in the derivation.
    pub facts: usize,
    /// Number of these facts whose reason is a rule.
    pub derived: usize,
    /// Number of rule matches that the completeness check enumerated.
    pub matches: usize,
}

/// Checks that the steps of a derivation are exactly the facts that hold for a program and stated facts. (Under
/// equality, a fact may be present under any names of its individuals.) Each step must come after its supports.
/// Values that rules compute are interned in `symbols`.
///
/// # Errors
/// Returns the first [`Fault`]: rules without stratification, a step that does not follow, a missing fact, a
/// contradiction, or something that the checker cannot decide (too many matches, or names that must differ
/// but may be equal).
pub fn replay(
    program: &Program,
    symbols: &mut Symbols,
    stated: &[Fact],
    derivation: &Derivation,
) -> Result<Replayed, Fault> {
    let (same_as, different) = (symbols.name(SAME_AS), symbols.name(DIFFERENT_FROM));
    let program = &without_guards(program);
    levels::check(program, same_as, different)?;
    let mut names = Names::default();
    for step in &derivation.steps {
        if program.equality && step.fact.predicate == same_as && step.fact.arguments.len() == 2 {
            names.join(step.fact.arguments[0], step.fact.arguments[1]);
        }
    }
    let facts = Facts::new(derivation.steps.iter().map(|step| names.normal(&step.fact)));
    let matcher = Matcher {
        symbols,
        facts: &facts,
        names: &names,
        equality: program.equality,
        compares_names: false,
        too_many: false,
    };
    let mut replayer = Replayer { program, same_as, different, matcher };
    replayer.consistent(derivation)?;
    replayer.founded(stated, derivation)?;
    let matches = replayer.closed(stated)?;
    if replayer.matcher.compares_names {
        return Err(Fault::Difference);
    }
    let is_derived = |step: &&DerivationStep| matches!(step.reason, Reason::Rule { .. });
    Ok(Replayed {
        facts: derivation.steps.len(),
        derived: derivation.steps.iter().filter(is_derived).count(),
        matches,
    })
}

struct Replayer<'r> {
    program: &'r Program,
    same_as: Symbol,
    different: Symbol,
    matcher: Matcher<'r>,
}

impl Replayer<'_> {
    fn show(&self, fact: &Fact) -> String {
        fact.display(self.matcher.symbols).to_string()
    }

    /// Checks that no literal is ill-typed, and that no literal equals another literal or a name.
    fn consistent(&self, derivation: &Derivation) -> Result<(), Fault> {
        let symbols = &*self.matcher.symbols;
        let literal = |symbol: Symbol| symbols.value(symbol).as_literal();
        let inconsistent = derivation.steps.iter().map(|step| &step.fact).find(|fact| {
            let [first, tail @ ..] = fact.arguments.as_slice() else { return false };
            let clash = self.is_pair(fact)
                && tail[0] != *first
                && (literal(*first).is_some() || literal(tail[0]).is_some());
            clash || fact.arguments.iter().any(|symbol| literal(*symbol).is_some_and(Literal::is_ill_typed))
        });
        inconsistent.map_or(Ok(()), |fact| Err(Fault::Inconsistent(self.show(fact))))
    }

    fn is_pair(&self, fact: &Fact) -> bool {
        self.program.equality && fact.predicate == self.same_as && fact.arguments.len() == 2
    }

    fn founded(&mut self, stated: &[Fact], derivation: &Derivation) -> Result<(), Fault> {
        let stated: FxHashSet<&Fact> = stated.iter().collect();
        let mut rules: FxHashMap<&RuleIdentity, Vec<&Rule>> = FxHashMap::default();
        for rule in &self.program.rules {
            rules.entry(&rule.identity).or_default().push(rule);
        }
        // State before a step: the equal names and, under equality, the facts of all earlier steps.
        let mut names = Names::default();
        let mut established: FxHashSet<Fact> = FxHashSet::default();
        // Set by a new equality, which changes the first names of established facts.
        let mut is_outdated = false;
        for (position, step) in derivation.steps.iter().enumerate() {
            let checked = match &step.reason {
                Reason::Asserted => {
                    stated.contains(&step.fact).then_some(()).ok_or("is not stated".to_owned())
                }
                Reason::Equality { .. } => {
                    let is_one = self.is_pair(&step.fact)
                        && names.find(step.fact.arguments[0]) == names.find(step.fact.arguments[1]);
                    if is_outdated && !is_one {
                        established = established.iter().map(|fact| names.normal(fact)).collect();
                        is_outdated = false;
                    }
                    let follows =
                        self.program.equality && (is_one || established.contains(&names.normal(&step.fact)));
                    follows.then_some(()).ok_or("does not follow by equality".to_owned())
                }
                Reason::Rule { identity, bindings, supports, .. } => {
                    let candidates = rules.get(identity).map_or(&[][..], Vec::as_slice);
                    let mut result = Err(format!("there is no rule {identity}"));
                    for rule in candidates {
                        result = self.follows(rule, bindings, supports, (position, derivation), &names);
                        if result.is_ok() {
                            break;
                        }
                    }
                    result
                }
            };
            if let (Err(_), true, Reason::Rule { identity, .. }) =
                (&checked, self.matcher.too_many, &step.reason)
            {
                // Without all matches, the value of an aggregate is unknown.
                return Err(Fault::TooMany(identity.clone()));
            }
            checked.map_err(|reason| Fault::Step { step: position, fact: self.show(&step.fact), reason })?;
            if self.program.equality {
                is_outdated |=
                    self.is_pair(&step.fact) && names.join(step.fact.arguments[0], step.fact.arguments[1]);
                established.insert(names.normal(&step.fact));
            }
        }
        Ok(())
    }

    fn follows(
        &mut self,
        rule: &Rule,
        bindings: &[(String, Symbol)],
        supports: &[usize],
        (position, derivation): (usize, &Derivation),
        names: &Names,
    ) -> Result<(), String> {
        let mut values: Values = vec![None; rule.variable_count()];
        for (name, value) in bindings {
            let mut variables = 0..rule.variable_count() as u16;
            let number = variables.find(|number| rule.variable_name(Variable(*number)) == *name);
            let number = number.ok_or_else(|| format!("rule {} has no variable {name}", rule.identity))?;
            values[usize::from(number)] = Some(*value);
        }
        let mut supports = supports.iter();
        for atom in &rule.body {
            let holds = if let Atom::Relation { predicate, arguments } = atom {
                let instance =
                    instance(*predicate, arguments, &values).ok_or("a variable without a value")?;
                let support = supports.next().copied().filter(|support| *support < position);
                let support = support.ok_or("a support that does not come before")?;
                names.normal(&derivation.steps[support].fact) == names.normal(&instance)
            } else {
                self.matcher.holds(atom, rule, &values, names)
            };
            if !holds {
                return Err(format!("rule {} does not apply", rule.identity));
            }
        }
        let fact = names.normal(&derivation.steps[position].fact);
        let mut heads = rule.head.iter().filter_map(|head| self.concluded(head, &values));
        if supports.next().is_none() && heads.any(|head| names.normal(&head) == fact) {
            Ok(())
        } else {
            Err(format!("rule {} concludes something else", rule.identity))
        }
    }

    fn concluded(&self, head: &Atom, values: &Values) -> Option<Fact> {
        match head {
            Atom::Relation { predicate, arguments } => instance(*predicate, arguments, values),
            Atom::Same(left, right) => instance(self.same_as, &[*left, *right], values),
            Atom::Different(left, right) => instance(self.different, &[*left, *right], values),
            _ => None,
        }
    }

    fn closed(&mut self, stated: &[Fact]) -> Result<usize, Fault> {
        if let Some(fact) =
            stated.iter().find(|fact| !self.matcher.facts.contains(&self.matcher.names.normal(fact)))
        {
            return Err(Fault::MissingStatement(self.show(fact)));
        }
        let mut count = 0;
        for rule in &self.program.rules {
            let matches = self.matcher.matches_of(rule);
            if self.matcher.too_many {
                return Err(Fault::TooMany(rule.identity.clone()));
            }
            count += matches.len();
            for values in matches {
                if rule.head.is_empty() {
                    return Err(Fault::Inconsistent(rule.identity.to_string()));
                }
                for fact in rule.head.iter().filter_map(|head| self.concluded(head, &values)) {
                    let normal = self.matcher.names.normal(&fact);
                    // Every name equals itself, even without a step.
                    let is_trivial = self.is_pair(&normal) && normal.arguments[0] == normal.arguments[1];
                    if !is_trivial && !self.matcher.facts.contains(&normal) {
                        let fact = self.show(&fact);
                        return Err(Fault::MissingConclusion { fact, rule: rule.identity.clone() });
                    }
                }
            }
        }
        Ok(count)
    }
}

/// Removes the condition that the two terms in the head of an equality rule differ. Without the condition, the rule
/// additionally derives only pairs of terms that are already equal, and pairs of literals that may have the same value.
fn without_guards(program: &Program) -> Program {
    let mut program = program.clone();
    for rule in program.rules.iter_mut().filter(|_| program.equality) {
        if let [Atom::Same(left, right)] = rule.head[..] {
            rule.body.retain(|atom| *atom != Atom::Different(left, right));
        }
    }
    program
}
