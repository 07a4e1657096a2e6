//! Turns names and literal values into dense numbers, so that joins compare integers.
//!
//! Two literals with the same value share one symbol (see [`Literal`]), which is what makes `1.50` join `1.5`.

use std::borrow::Borrow;
use std::fmt;

use rustc_hash::FxHashMap;

use crate::literal::Literal;

/// A name or a literal, interned in a [`Symbols`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct Symbol(pub(crate) u32);

impl Symbol {
    /// The position of the symbol in its interner, counted from 0.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// What a symbol stands for.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum Value {
    /// An individual, class or property: usually an IRI, any text in plain Datalog.
    Name(Box<str>),
    /// A data value.
    Literal(Literal),
}

impl Value {
    /// The literal, where the value is one.
    pub fn as_literal(&self) -> Option<&Literal> {
        match self {
            Self::Literal(literal) => Some(literal),
            Self::Name(_) => None,
        }
    }

    /// The name, where the value is one.
    pub fn as_name(&self) -> Option<&str> {
        match self {
            Self::Name(name) => Some(name),
            Self::Literal(_) => None,
        }
    }
}

/// N-Triples form: `<name>` or the literal's canonical form.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => write!(f, "<{name}>"),
            Self::Literal(literal) => literal.fmt(f),
        }
    }
}

/// The key of a name in the look-up table; borrows as `str`, so that a look-up allocates nothing.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
struct NameKey(Box<str>);

impl Borrow<str> for NameKey {
    fn borrow(&self) -> &str {
        &self.0
    }
}

/// The interner: symbols to values and back.
#[derive(Clone, Default, Debug)]
pub struct Symbols {
    values: Vec<Value>,
    names: FxHashMap<NameKey, Symbol>,
    literals: FxHashMap<Literal, Symbol>,
    ill_typed: usize,
}

impl Symbols {
    /// An empty interner.
    pub fn new() -> Self {
        Self::default()
    }

    /// The symbol of a name, interned on first use.
    pub fn name(&mut self, name: &str) -> Symbol {
        if let Some(&symbol) = self.names.get(name) {
            return symbol;
        }
        let symbol = self.push(Value::Name(name.into()));
        self.names.insert(NameKey(name.into()), symbol);
        symbol
    }

    /// The symbol of a literal, interned by value on first use.
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

    /// What a symbol stands for.
    ///
    /// # Panics
    /// When the symbol comes from another, longer interner.
    pub fn value(&self, symbol: Symbol) -> &Value {
        &self.values[symbol.index()]
    }

    /// The symbol of a name, if it was interned.
    pub fn find_name(&self, name: &str) -> Option<Symbol> {
        self.names.get(name).copied()
    }

    /// The symbol of a literal's value, if it was interned.
    pub fn find_literal(&self, literal: &Literal) -> Option<Symbol> {
        self.literals.get(literal).copied()
    }

    /// How many symbols there are; every smaller [`Symbol::index`] is in use.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether nothing was interned yet.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Whether two symbols certainly stand for two things, where names stand for individuals of their own: not of two
    /// literals of which that is undecided.
    pub(crate) fn differ(&self, left: Symbol, right: Symbol) -> bool {
        left != right
            && match (self.as_literal(left), self.as_literal(right)) {
                (Some(left), Some(right)) => left.differs(right),
                _ => true,
            }
    }

    /// Whether any literal was interned whose lexical form its datatype forbids.
    pub(crate) fn any_ill_typed(&self) -> bool {
        self.ill_typed > 0
    }

    /// The literal of a symbol that stands for one.
    pub(crate) fn as_literal(&self, symbol: Symbol) -> Option<&Literal> {
        self.values.get(symbol.index()).and_then(Value::as_literal)
    }
}
