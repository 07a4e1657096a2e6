//! Large sets of pairwise different individuals or pairwise disjoint classes, without a rule or a stated fact
//! for each pair.
//!
//! Each individual or class of the set has a number, and the members of a class get the number of the class.
//! A constraint forbids that an individual has two numbers. If a rule depends on `owl:differentFrom`, a
//! further rule derives it for each pair of individuals with different numbers.

use rules::{Atom, RuleIdentity, Symbol, Term};

use super::context::{Context, INTERNAL, Variables};
use crate::vocab::owl;

/// Maximum number of members of a set of different individuals or disjoint classes for which pairs are
/// used. Explanations with pairs are easier to read.
pub(crate) const MAX_PAIRED_MEMBERS: usize = 16;

/// Returns the auxiliary relation that assigns numbers to individuals. For pairwise different individuals,
/// each individual has its own number; for disjoint classes, it has the numbers of its classes. The
/// relation's name is a hash of the axiom's text, so that ontologies lowered with the same symbols share the
/// relation only for equal axioms.
pub(crate) fn relation(context: &mut Context, axiom: &str) -> Symbol {
    // FNV-1a gives equal names on every machine.
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let hash = axiom.bytes().fold(0xcbf2_9ce4_8422_2325, step);
    context.name(&format!("{INTERNAL}member:{hash:016x}"))
}

pub(crate) fn number(context: &mut Context, index: usize) -> Symbol {
    context.symbols.literal(rules::Literal::integer(index as i64))
}

fn differently_numbered(member: Symbol, [x, y]: [Term; 2], [i, j]: [Term; 2]) -> Vec<Atom> {
    vec![Atom::relation(member, [x, i]), Atom::relation(member, [y, j]), Atom::Different(i, j)]
}

pub(crate) fn forbid(context: &mut Context, identity: &RuleIdentity, member: Symbol) {
    let mut variables = Variables::default();
    let [x, i, j] = ["x", "i", "j"].map(|name| variables.fresh(name));
    context.rule(identity, Vec::new(), differently_numbered(member, [x, x], [i, j]), &variables);
}

pub(crate) fn differ(context: &mut Context, identity: &RuleIdentity, member: Symbol) {
    let mut variables = Variables::default();
    let [x, y, i, j] = ["x", "y", "i", "j"].map(|name| variables.fresh(name));
    let head = vec![context.relation(owl::DIFFERENT_FROM, [x, y])];
    context.rule(identity, head, differently_numbered(member, [x, y], [i, j]), &variables);
}
