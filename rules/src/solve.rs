//! The step of a join that gives values to the arguments of a built-in that have none, in all ways in which it holds.

use crate::builtin::BuiltIn;
use crate::fixpoint::{Round, intern, resolve};
use crate::literal::Literal;
use crate::source::Source;
use crate::symbol::Symbol;

impl Round<'_> {
    /// Extends matches by all values that a built-in gives to the arguments that are not known.
    pub fn solve(
        &self,
        block: &[Symbol],
        width: usize,
        rule: u32,
        built_in: BuiltIn,
        (arguments, known): (&[Source], &[bool]),
    ) -> Vec<Symbol> {
        let mut symbols = self.symbols.borrow_mut();
        let mut longer = Vec::new();
        for bound in block.chunks_exact(width) {
            let literal = |(&source, known): (&Source, &bool)| {
                if *known { symbols.as_literal(resolve(source, bound)).map(Some) } else { Some(None) }
            };
            let given: Option<Vec<Option<&Literal>>> = arguments.iter().zip(known).map(literal).collect();
            for values in given.map(|given| built_in.solve(&given)).unwrap_or_default() {
                let before = symbols.len();
                let values: Vec<Symbol> =
                    values.into_iter().map(|value| intern(&mut symbols, value)).collect();
                let is_new = symbols.len() > before;
                let largest = values.iter().filter_map(|&value| symbols.as_literal(value));
                let largest = largest.max_by_key(|value| value.size());
                if !self.budget.spend(1, rule) || (is_new && !self.budget.spend_on_value(largest, rule)) {
                    return Vec::new();
                }
                longer.extend(bind_open(bound, (arguments, known), &values).unwrap_or_default());
            }
        }
        longer
    }
}

/// A match with values for the arguments that were not known; none where one variable would have two.
fn bind_open(
    bound: &[Symbol],
    (arguments, known): (&[Source], &[bool]),
    values: &[Symbol],
) -> Option<Vec<Symbol>> {
    let (mut longer, mut seen) = (bound.to_vec(), Vec::new());
    let open = arguments.iter().zip(known).filter(|(_, known)| !**known);
    for ((source, _), &value) in open.zip(values) {
        let Source::Variable(number) = *source else { continue };
        if seen.contains(&number) && longer[usize::from(number)] != value {
            return None;
        }
        seen.push(number);
        longer[usize::from(number)] = value;
    }
    Some(longer)
}
