//! Facts as an N-Triples document: sorted, each once, one triple a line.

use rules::{Fact, Symbol, Symbols, Value};
use rustc_hash::FxHashMap;

use crate::lower::INTERNAL;
use crate::owl::ANONYMOUS;
use crate::vocab::{owl, rdf};

/// Writes facts about individuals: a fact with one argument as `rdf:type`, one with two as a property.
///
/// Left out are facts that no triple can state (other arities), the relations that [`crate::lower`] invents, and that
/// an individual is one (an `owl:Thing`), or the same as itself. Anonymous individuals become blank nodes again.
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

/// The terms of triples, each written once.
struct Terms<'a> {
    symbols: &'a Symbols,
    /// What each is written as, with a blank behind it, so that lines are in the order of their terms.
    texts: Vec<String>,
    /// By symbol; `None` for what is not a term.
    numbers: FxHashMap<Symbol, Option<u32>>,
}

/// The number of `rdf:type`.
const TYPE: u32 = 0;

impl<'a> Terms<'a> {
    fn new(symbols: &'a Symbols) -> Self {
        Self { symbols, texts: vec![format!("<{}> ", rdf::TYPE)], numbers: FxHashMap::default() }
    }

    /// The numbers of subject, predicate and object.
    fn triple(&mut self, fact: &Fact) -> Option<[u32; 3]> {
        let name = |symbol| self.symbols.value(symbol).as_name();
        let predicate = name(fact.predicate).filter(|name| !name.starts_with(INTERNAL))?;
        match fact.arguments[..] {
            [_] if predicate == owl::THING => None,
            [subject] => Some([self.node(subject)?, TYPE, self.term(fact.predicate)?]),
            [subject, object] if subject == object && predicate == owl::SAME_AS => None,
            [subject, object] => Some([self.node(subject)?, self.term(fact.predicate)?, self.term(object)?]),
            _ => None,
        }
    }

    /// The number of what is not a literal.
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

    /// Numbers the terms of triples anew, in the order of what they are written as, which is returned.
    fn rank(self, triples: &mut [[u32; 3]]) -> Vec<String> {
        let mut texts: Vec<(String, u32)> = self.texts.into_iter().zip(0..).collect();
        texts.sort_unstable();
        let (mut ranks, mut ranked) = (vec![0; texts.len()], Vec::<String>::with_capacity(texts.len()));
        for (text, number) in texts {
            // Two terms may be written the same.
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

    /// Lines are in the order of their texts, however terms go on where others end.
    #[test]
    fn lines_are_sorted_and_once() {
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
        // Predicates are the seven IRIs; `rdf:type` says the same as a class does.
        assert_eq!(lines.len(), 10 * 7 * 17);
        assert!(lines.contains(&"_:d0b10 <http://e/ab> \"x\"@en ."), "{text}");
    }
}
