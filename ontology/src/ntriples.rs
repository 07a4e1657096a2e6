//! Writes facts as a sorted N-Triples document without duplicates.

use rules::{Fact, Symbol, Symbols, Value};
use rustc_hash::FxHashMap;

use crate::lower::INTERNAL;
use crate::owl::ANONYMOUS;
use crate::vocab::{owl, rdf};

/// Formats facts about individuals: unary facts as `rdf:type` triples, binary facts as triples of
/// properties.
///
/// Omits facts of other arities, facts whose first argument is a literal, the auxiliary relations of
/// [`crate::lower`], membership in `owl:Thing`, and `sameAs` of an individual with itself. Anonymous individuals
/// become blank nodes again.
pub fn ntriples<'a>(symbols: &Symbols, facts: impl IntoIterator<Item = &'a Fact>) -> String {
    let mut terms = Terms::new(symbols);
    let mut triples: Vec<[u32; 3]> = facts.into_iter().filter_map(|fact| terms.triple(fact)).collect();
    let ranked = terms.rank(&mut triples);
    triples.sort_unstable();
    triples.dedup();
    let length =
        |triple: &[u32; 3]| triple.iter().map(|term| ranked[*term as usize].len()).sum::<usize>() + 2;
    let mut text = String::with_capacity(triples.iter().map(length).sum());
    for triple in triples {
        for term in triple {
            text.push_str(&ranked[term as usize]);
        }
        text.push_str(".\n");
    }
    text
}

struct Terms<'a> {
    symbols: &'a Symbols,
    /// Text of each term with a trailing space, so that the order of the terms is the order of the
    /// lines. Indexed by term number.
    texts: Vec<String>,
    /// Maps symbols to term numbers; `None` if there are too many terms for a number.
    numbers: FxHashMap<Symbol, Option<u32>>,
}

const TYPE: u32 = 0;

impl<'a> Terms<'a> {
    fn new(symbols: &'a Symbols) -> Self {
        Self { symbols, texts: vec![format!("<{}> ", rdf::TYPE)], numbers: FxHashMap::default() }
    }

    fn triple(&mut self, fact: &Fact) -> Option<[u32; 3]> {
        let name = |symbol| self.symbols.value(symbol).as_name();
        let predicate = name(fact.predicate).filter(|name| !name.starts_with(INTERNAL))?;
        match fact.arguments[..] {
            // Every individual is a thing.
            [_] if predicate == owl::THING => None,
            [subject] => Some([self.node(subject)?, TYPE, self.term(fact.predicate)?]),
            [subject, object] if subject == object && predicate == owl::SAME_AS => None,
            [subject, object] => Some([self.node(subject)?, self.term(fact.predicate)?, self.term(object)?]),
            _ => None,
        }
    }

    fn node(&mut self, symbol: Symbol) -> Option<u32> {
        self.symbols.value(symbol).as_name()?;
        self.term(symbol)
    }

    fn term(&mut self, symbol: Symbol) -> Option<u32> {
        if let Some(number) = self.numbers.get(&symbol) {
            return *number;
        }
        let text = match self.symbols.value(symbol) {
            Value::Name(name) => match name.strip_prefix(ANONYMOUS) {
                Some(label) => ["_:", label, " "].concat(),
                None => ["<", name, "> "].concat(),
            },
            Value::Literal(literal) => format!("{literal} "),
        };
        let number = u32::try_from(self.texts.len()).ok();
        self.texts.push(text);
        self.numbers.insert(symbol, number);
        number
    }

    /// Replaces the term numbers in `triples` by the ranks of the terms' texts. Returns the sorted
    /// texts.
    fn rank(self, triples: &mut [[u32; 3]]) -> Vec<String> {
        let mut texts: Vec<(String, u32)> = self.texts.into_iter().zip(0..).collect();
        texts.sort_unstable();
        let (mut ranks, mut ranked) = (vec![0; texts.len()], Vec::<String>::with_capacity(texts.len()));
        for (text, number) in texts {
            // Two symbols may have the same text, and then get the same rank.
            if ranked.last() != Some(&text) {
                ranked.push(text);
            }
            ranks[number as usize] = (ranked.len() - 1) as u32;
        }
        for term in triples.iter_mut().flatten() {
            *term = ranks[*term as usize];
        }
        ranked
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rules::Literal;

    /// Terms that are prefixes of other terms must not change the order.
    #[test]
    fn lines_are_sorted_and_unique() {
        let mut symbols = Symbols::new();
        let anonymous = ["d0b1", "d0b10", "d0b2"].map(|label| format!("{ANONYMOUS}{label}"));
        let names = [
            "http://e/a",
            "http://e/ab",
            "http://e/a#b",
            "http://e/a/b",
            "http://e/\u{e9}",
            "tag:a",
            rdf::TYPE,
        ];
        let names = names.iter().copied().chain(anonymous.iter().map(String::as_str));
        let names: Vec<Symbol> = names.map(|name| symbols.name(name)).collect();
        let xsd = "http://www.w3.org/2001/XMLSchema#";
        let literals = [
            Literal::string("x"),
            Literal::string("x y"),
            Literal::string(""),
            Literal::parse("x", None, Some("en")),
            Literal::parse("x", Some("http://e/D"), None),
            Literal::parse("5", Some(&format!("{xsd}integer")), None),
            Literal::parse("5.0", Some(&format!("{xsd}float")), None),
        ];
        let literals: Vec<Symbol> = literals.into_iter().map(|literal| symbols.literal(literal)).collect();
        let mut facts = Vec::new();
        for &subject in &names {
            for &predicate in &names {
                let objects = names.iter().chain(&literals);
                facts.extend(objects.map(|&object| Fact::new(predicate, [subject, object])));
                facts.push(Fact::new(predicate, [subject]));
            }
        }
        let text = ntriples(&symbols, &facts);
        let lines: Vec<&str> = text.lines().collect();
        let mut sorted = lines.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(lines, sorted);
        // Ten subjects, seven predicates (the IRIs) and 17 objects. Facts with one argument give triples of
        // `rdf:type` that exist already.
        assert_eq!(lines.len(), 10 * 7 * 17);
        assert!(lines.contains(&"_:d0b10 <http://e/ab> \"x\"@en ."), "{text}");
    }
}
