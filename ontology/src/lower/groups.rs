//! Many individuals that differ pairwise, and many classes that are pairwise disjoint, without a rule or fact for each pair:
//! each member has a number, and nothing has two.

use rules::{Atom, RuleIdentity, Symbol, Term};

use super::context::{Context, INTERNAL, Variables};
use crate::vocab::owl;

/// So many members are still related by pairs, which explain themselves.
pub(crate) const PAIRS: usize = 16;

/// The relation between members and numbers of a group that an axiom describes. It goes by the axiom's text, so that two
/// ontologies lowered into the same symbols share it only where they should.
pub(crate) fn relation(context: &mut Context, axiom: &str) -> Symbol {
    // FNV-1a: the same on every machine.
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let hash = axiom.bytes().fold(0xcbf2_9ce4_8422_2325, step);
    context.name(&format!("{INTERNAL}member:{hash:016x}"))
}

/// The number of a member.
pub(crate) fn number(context: &mut Context, place: usize) -> Symbol {
    context.symbols.literal(rules::Literal::integer(place as i64))
}

/// Two members and their numbers, which differ.
fn two(member: Symbol, [x, y]: [Term; 2], [i, j]: [Term; 2]) -> Vec<Atom> {
    vec![Atom::relation(member, [x, i]), Atom::relation(member, [y, j]), Atom::Different(i, j)]
}

/// Forbids that one individual has two numbers.
pub(crate) fn forbid(context: &mut Context, identity: &RuleIdentity, member: Symbol) {
    let mut variables = Variables::default();
    let [x, i, j] = ["x", "i", "j"].map(|name| variables.fresh(name));
    context.rule(identity, Vec::new(), two(member, [x, x], [i, j]), &variables);
}

/// Concludes that individuals with different numbers differ.
pub(crate) fn differ(context: &mut Context, identity: &RuleIdentity, member: Symbol) {
    let mut variables = Variables::default();
    let [x, y, i, j] = ["x", "y", "i", "j"].map(|name| variables.fresh(name));
    let head = vec![context.relation(owl::DIFFERENT_FROM, [x, y])];
    context.rule(identity, head, two(member, [x, y], [i, j]), &variables);
}
