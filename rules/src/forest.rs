//! Connected components of symbols, by union-find. The time is nearly linear in the number of pairs.

use rustc_hash::FxHashMap;

use crate::symbol::Symbol;

/// Disjoint-set forest of symbols: the parent of each symbol that is not a root.
#[derive(Default, Debug)]
pub(crate) struct Forest(FxHashMap<Symbol, Symbol>);

impl Forest {
    fn root(&mut self, symbol: Symbol) -> Symbol {
        let mut current = symbol;
        while let Some(&above) = self.0.get(&current) {
            // Path splitting: links each symbol on the path to its grandparent.
            if let Some(&higher) = self.0.get(&above) {
                self.0.insert(current, higher);
            }
            current = above;
        }
        current
    }

    /// Connects two symbols. Returns `false` if they were already connected.
    pub fn connect(&mut self, left: Symbol, right: Symbol) -> bool {
        let (left, right) = (self.root(left), self.root(right));
        if left != right {
            self.0.insert(left.max(right), left.min(right));
        }
        left != right
    }
}
