//! Numeric functions that actions change, with their values.

use num_rational::BigRational;
use rustc_hash::FxHashSet;

use super::changeable::changeable_functions;
use super::world::{State, Symbol, World};

pub(super) fn changeable(world: &World<'_>) -> FxHashSet<Symbol> {
    changeable_functions(world.domain).into_iter().map(|name| world.symbol(name)).collect()
}

pub(super) fn changeable_values(world: &World<'_>, state: &State) -> Vec<(String, BigRational)> {
    let symbols = changeable(world);
    let changeable = state.values.iter().filter(|((symbol, _), _)| symbols.contains(symbol));
    let mut values: Vec<_> = changeable
        .map(|((symbol, arguments), value)| (world.show(*symbol, arguments), value.clone()))
        .collect();
    values.sort();
    values
}
