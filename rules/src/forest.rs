//! Which symbols are connected, by union-find: linear in the pairs, whatever the sizes of classes.

use rustc_hash::FxHashMap;

use crate::symbol::Symbol;

/// Classes of symbols, each a tree.
#[derive(Default, Debug)]
pub(crate) struct Forest(FxHashMap<Symbol, Symbol>);

impl Forest {
    fn root(&mut self, symbol: Symbol) -> Symbol {
        let mut at = symbol;
        while let Some(&above) = self.0.get(&at) {
            // Halves the path.
            if let Some(&higher) = self.0.get(&above) {
                self.0.insert(at, higher);
            }
            at = above;
        }
        at
    }

    /// Connects two symbols; `false` where they were connected already.
    pub fn connect(&mut self, left: Symbol, right: Symbol) -> bool {
        let (left, right) = (self.root(left), self.root(right));
        if left != right {
            self.0.insert(left.max(right), left.min(right));
        }
        left != right
    }
}
