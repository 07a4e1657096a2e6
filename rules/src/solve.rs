//! Join step for a built-in with unbound arguments: enumerates the values for which the built-in holds.

use crate::builtin::BuiltIn;
use crate::fixpoint::{Round, intern, resolve};
use crate::literal::Literal;
use crate::source::Source;
use crate::symbol::Symbol;

impl Round<'_> {
    /// Extends each match by the values of the unbound arguments for which the built-in holds. Returns
    /// no match if the evaluation has to stop.
    pub fn solve(
        &self,
        block: &[Symbol],
        width: usize,
        rule: u32,
        built_in: BuiltIn,
        (arguments, is_known): (&[Source], &[bool]),
    ) -> Vec<Symbol> {
        let mut symbols = self.symbols.borrow_mut();
        let mut extended = Vec::new();
        for bound in block.chunks_exact(width) {
            let literal = |(&source, is_known): (&Source, &bool)| {
                if *is_known { symbols.as_literal(resolve(source, bound)).map(Some) } else { Some(None) }
            };
            let inputs: Option<Vec<Option<&Literal>>> = arguments.iter().zip(is_known).map(literal).collect();
            for values in inputs.map(|inputs| built_in.solve(&inputs)).unwrap_or_default() {
                let before = symbols.len();
                let values: Vec<Symbol> =
                    values.into_iter().map(|value| intern(&mut symbols, value)).collect();
                let is_new = symbols.len() > before;
                // Several new values of one solution are charged once, by the size of the largest.
                let largest = values.iter().filter_map(|&value| symbols.as_literal(value));
                let largest = largest.max_by_key(|value| value.size());
                if !self.budget.spend(1, rule) || (is_new && !self.budget.spend_on_value(largest, rule)) {
                    return Vec::new();
                }
                extended.extend(bind_open(bound, (arguments, is_known), &values).unwrap_or_default());
            }
        }
        extended
    }
}

/// Extends a match by values for the unbound arguments. Returns `None` if a variable would have two
/// values.
fn bind_open(
    bound: &[Symbol],
    (arguments, is_known): (&[Source], &[bool]),
    values: &[Symbol],
) -> Option<Vec<Symbol>> {
    let (mut extended, mut assigned) = (bound.to_vec(), Vec::new());
    let open = arguments.iter().zip(is_known).filter(|(_, is_known)| !**is_known);
    for ((source, _), &value) in open.zip(values) {
        let Source::Variable(number) = *source else { continue };
        if assigned.contains(&number) && extended[usize::from(number)] != value {
            return None;
        }
        assigned.push(number);
        extended[usize::from(number)] = value;
    }
    Some(extended)
}
