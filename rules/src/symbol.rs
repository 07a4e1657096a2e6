//! Interner: maps names and literal values to dense numbers, so that joins compare integers.
//!
//! Two literals with the same value share one symbol (see [`Literal`]); therefore `1.50` joins `1.5`.

use std::borrow::Borrow;
use std::fmt;

use rustc_hash::FxHashMap;

use crate::literal::Literal;

/// A name or a literal, interned in a [`Symbols`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct Symbol(pub(crate) u32);

impl Symbol {
    /// Returns the position of the symbol in its interner, counted from 0.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Name or literal that a symbol denotes.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Value {
    /// An individual, class or property: usually an IRI, and any text in plain Datalog.
    Name(Box<str>),
    /// A data value.
    Literal(Literal),
}

impl Value {
    /// Returns the literal if the value is a literal.
    pub fn as_literal(&self) -> Option<&Literal> {
        match self {
            Self::Literal(literal) => Some(literal),
            Self::Name(_) => None,
        }
    }

    /// Returns the name if the value is a name.
    pub fn as_name(&self) -> Option<&str> {
        match self {
            Self::Name(name) => Some(name),
            Self::Literal(_) => None,
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => write!(f, "<{name}>"),
            Self::Literal(literal) => literal.fmt(f),
        }
    }
}

/// Prefix of the names of fresh individuals.
const FRESH: &str = "urn:metaplan:any:";

/// Returns `true` if two different names denote different individuals under the unique name assumption. A fresh
/// individual differs only from the others of its group.
fn names_differ(left: &str, right: &str) -> bool {
    match (left.strip_prefix(FRESH), right.strip_prefix(FRESH)) {
        (None, None) => true,
        (Some(left), Some(right)) => match (left.split_once(':'), right.split_once(':')) {
            (Some((left, _)), Some((right, _))) => left == right,
            _ => false,
        },
        _ => false,
    }
}

#[derive(Clone, PartialEq, Eq, Hash, Debug)]
struct NameKey(Box<str>);

impl Borrow<str> for NameKey {
    fn borrow(&self) -> &str {
        &self.0
    }
}

/// Interner with both directions: symbols to values, and values to symbols.
#[derive(Clone, Default, Debug)]
pub struct Symbols {
    values: Vec<Value>,
    names: FxHashMap<NameKey, Symbol>,
    literals: FxHashMap<Literal, Symbol>,
    ill_typed: usize,
}

impl Symbols {
    /// Creates an empty interner.
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the symbol of a name, which is interned on first use.
    pub fn name(&mut self, name: &str) -> Symbol {
        if let Some(&symbol) = self.names.get(name) {
            return symbol;
        }
        let symbol = self.push(Value::Name(name.into()));
        self.names.insert(NameKey(name.into()), symbol);
        symbol
    }

    /// Returns the symbol of a literal, which is interned by value on first use.
    pub fn literal(&mut self, literal: Literal) -> Symbol {
        if let Some(&symbol) = self.literals.get(&literal) {
            return symbol;
        }
        self.ill_typed += usize::from(literal.is_ill_typed());
        let symbol = self.push(Value::Literal(literal.clone()));
        self.literals.insert(literal, symbol);
        symbol
    }

    fn push(&mut self, value: Value) -> Symbol {
        let symbol = Symbol(self.values.len() as u32);
        self.values.push(value);
        symbol
    }

    /// Returns the name or literal that a symbol denotes.
    ///
    /// # Panics
    /// If the interner has no symbol with this index.
    pub fn value(&self, symbol: Symbol) -> &Value {
        &self.values[symbol.index()]
    }

    /// Returns the symbol of a name if it is interned.
    pub fn find_name(&self, name: &str) -> Option<Symbol> {
        self.names.get(name).copied()
    }

    /// Returns the symbol of a literal's value if it is interned.
    pub fn find_literal(&self, literal: &Literal) -> Option<Symbol> {
        self.literals.get(literal).copied()
    }

    /// Returns the number of symbols. Every smaller [`Symbol::index`] is in use.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns `true` if nothing is interned.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Returns `true` if two symbols certainly denote different things under the unique name assumption. Returns
    /// `false` for two literals whose difference is undecided. A fresh individual differs only from literals and from
    /// fresh individuals of its group; see [`Self::fresh_name`].
    pub(crate) fn differ(&self, left: Symbol, right: Symbol) -> bool {
        left != right
            && match (self.value(left), self.value(right)) {
                (Value::Literal(left), Value::Literal(right)) => left.differs(right),
                (Value::Name(left), Value::Name(right)) => names_differ(left, right),
                _ => true,
            }
    }

    /// Returns `true` if two symbols are different, except for two literals that may have the same value.
    pub(crate) fn are_distinct(&self, left: Symbol, right: Symbol) -> bool {
        left != right
            && match (self.as_literal(left), self.as_literal(right)) {
                (Some(left), Some(right)) => left.differs(right),
                _ => true,
            }
    }

    /// Returns the name of a fresh individual, for conclusions about an arbitrary individual. It can be any
    /// individual, so the unique name assumption does not apply to it. Only fresh individuals of one `group` with
    /// different numbers differ.
    pub fn fresh_name(group: Option<usize>, number: usize) -> String {
        match group {
            Some(group) => format!("{FRESH}{group}:{number}"),
            None => format!("{FRESH}{number}"),
        }
    }

    pub(crate) fn any_ill_typed(&self) -> bool {
        self.ill_typed > 0
    }

    pub(crate) fn as_literal(&self, symbol: Symbol) -> Option<&Literal> {
        self.values.get(symbol.index()).and_then(Value::as_literal)
    }
}
