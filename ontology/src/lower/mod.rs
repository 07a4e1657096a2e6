//! An [`Ontology`] to what the engine evaluates: assertions become facts, axioms of OWL 2 RL and SWRL rules become
//! rules, and every axiom that has no rule form is reported.
//!
//! A class is a relation with one argument and a property one with two, both named by their IRI. The rules for axioms
//! are those of the OWL 2 RL profile [1], instantiated with each axiom's own classes and properties (so that the engine
//! indexes by class and property instead of joining with a schema). `sameAs` and `differentFrom` are relations of that
//! name; functional and inverse functional properties conclude equality. Where an axiom forbids something, the rule has
//! an empty head and is an integrity constraint.
//!
//! Not every axiom that OWL 2 RL lists outside its profile is useless: what can be had of it (one direction of an
//! equivalence, say) is lowered, and the rest reported, so conclusions are always sound and possibly incomplete.
//!
//! - [1] OWL 2 Web Ontology Language Profiles, W3C 2012, section 4.3.

mod axiom;
mod class;
mod context;
mod equality;
mod groups;
mod inclusion;
mod range;
mod swrl;
mod vocabulary;

use rules::{Atom, Error, Fact, Program, Rule, RuleIdentity, Symbols};
use tracing::field::Empty;
use tracing::info_span;

use crate::error::Warning;
use crate::owl::{AnnotatedAxiom, Ontology};
use context::Context;

pub use context::{AXIOM_SOURCE, Equality, INTERNAL};

/// An ontology as rules and facts.
#[derive(Clone, Debug)]
pub struct Lowered {
    /// The rules of the knowledge base, then those that stand for axioms.
    pub program: Program,
    /// The assertions.
    pub facts: Vec<Fact>,
    /// How many SWRL rules were left out because another ontology states the same rule.
    pub duplicates: usize,
    /// Axioms and rules that were left out, or kept against their annotation.
    pub warnings: Vec<Warning>,
}

/// Lowers an ontology with the semantics of OWL; names and literals are interned in `symbols`.
pub fn lower(ontology: &Ontology, symbols: &mut Symbols) -> Lowered {
    lower_with(ontology, Equality::Owl, symbols)
}

/// As [`lower()`], under the given semantics of names.
pub fn lower_with(ontology: &Ontology, equality: Equality, symbols: &mut Symbols) -> Lowered {
    lower_together(ontology, Vec::new(), equality, symbols)
}

/// As [`lower_with`], together with rules that somebody else has made, whose names are among the symbols: they mean by
/// `owl:Thing`, `owl:Nothing`, `sameAs` and `differentFrom` what the ontology means. They come last.
pub fn lower_together(
    ontology: &Ontology,
    own: Vec<Rule>,
    equality: Equality,
    symbols: &mut Symbols,
) -> Lowered {
    let span = info_span!("lower", rules = Empty, facts = Empty).entered();
    let mut context = Context::new(symbols, equality, ontology);
    let duplicates = swrl::lower(&ontology.rules, &mut context);
    axiom::lower_rules(&ontology.axioms, &mut context);
    class::lower_inclusions(&mut context, ontology.axioms.len());
    context.drop_unusable();
    axiom::lower_assertions(&ontology.axioms, &mut context);
    let stated = context.rules.len();
    context.take_in(own);
    let taken = context.rules.len();
    vocabulary::lower(ontology, &mut context);
    let equality = equality == Equality::Owl && equality::lower(&ontology.axioms, &mut context);
    // Rules of others stay last.
    context.rules[stated..].rotate_left(taken - stated);
    let Context { rules, facts, mut warnings, .. } = context;
    span.record("rules", rules.len()).record("facts", facts.len());
    warnings.sort();
    warnings.dedup();
    Lowered { program: Program { rules, equality }, facts, duplicates, warnings }
}

/// The facts that axioms state, in the order of the axioms; rules for axioms are not among them.
pub(crate) fn lower_assertions(axioms: &[AnnotatedAxiom], symbols: &mut Symbols) -> Vec<Fact> {
    let mut context = Context::new(symbols, Equality::Owl, &Ontology::default());
    axiom::lower_assertions(axioms, &mut context);
    context.facts
}

impl Context<'_> {
    /// Takes in rules of others. Two names that differ may stand for one individual, so that their `differentFrom` asks for
    /// what is entailed.
    fn take_in(&mut self, own: Vec<Rule>) {
        let owl = self.equality == Equality::Owl;
        for mut rule in own {
            for atom in &mut rule.body {
                if let (true, Atom::Different(left, right)) = (owl, &*atom) {
                    *atom = self.different(*left, *right);
                }
            }
            self.rules.push(rule);
        }
    }

    /// Takes out the rules that the engine rejects (unsafe variables, for one): it would reject the whole program. A
    /// rule for an axiom binds its variables by the relations of its body, or by names that they stand for.
    fn drop_unusable(&mut self) {
        let binds = |atom: &Atom| match atom {
            Atom::Relation { .. } => true,
            Atom::Same(left, right) => [left, right].iter().any(|term| term.as_variable().is_none()),
            _ => false,
        };
        let is_bound = |rule: &&Rule| *rule.identity.source == *AXIOM_SOURCE && rule.body.iter().any(binds);
        let rules = self.rules.iter().filter(|rule| !is_bound(rule)).cloned().collect();
        let program = Program { rules, ..Program::default() };
        let Err(errors) = rules::Engine::new(self.symbols.clone(), program, []) else { return };
        for error in errors {
            let Some(identity) = culprit(&error) else { continue };
            let identity = identity.clone();
            self.rules.retain(|rule: &Rule| rule.identity != identity);
            self.warnings.push(Warning::UnusableRule {
                ontology: identity.source.to_string(),
                position: identity.position,
                label: identity.label.as_ref().map(ToString::to_string),
                reason: error.to_string(),
            });
        }
    }
}

/// The rule that an error is about.
fn culprit(error: &Error) -> Option<&RuleIdentity> {
    match error {
        Error::UnsafeHead { rule, .. }
        | Error::UnsafeBody { rule, .. }
        | Error::BuiltInArity { rule, .. }
        | Error::HeadAtom { rule, .. }
        | Error::Pattern { rule, .. }
        | Error::Unstratified { rule, .. }
        | Error::Arity { rule, .. } => Some(rule),
        _ => None,
    }
}
