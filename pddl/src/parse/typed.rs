//! Typed lists: `?x ?y - place ?z`, objects, types, and the declarations made of them.

use crate::ast::{Declaration, Identifier, Span, TypeExpression, TypedName};
use crate::sexp::{Item, Items};

use super::{Parser, at_start};

/// What a typed list introduces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Entries {
    /// With question marks.
    Variables,
    /// Objects, constants or types.
    Names,
}

impl Parser<'_> {
    /// The entries of a typed list. A dash that is glued to its neighbour counts as one of its own.
    pub(super) fn typed_list(&mut self, items: Items<'_>, entries: Entries) -> Vec<TypedName> {
        let mut list: Vec<TypedName> = Vec::new();
        let mut untyped_from = 0;
        let mut items = items;
        while let Some(item) = items.next() {
            let Some(symbol) = item.symbol() else {
                self.expected(item, if entries == Entries::Variables { "a variable" } else { "a name" });
                continue;
            };
            if let Some(glued) = symbol.strip_prefix('-') {
                let r#type = self.type_after_dash(item, glued, &mut items);
                if untyped_from == list.len() {
                    self.sink.warning(
                        "P107",
                        item.span(),
                        "there is nothing before this `-` that it could type",
                    );
                }
                list[untyped_from..].iter_mut().for_each(|entry| entry.r#type = r#type.clone());
                untyped_from = list.len();
            } else if let Some(identifier) = self.entry(item, symbol, entries) {
                list.push(TypedName { identifier, r#type: TypeExpression::default() });
            }
        }
        list
    }

    /// The type behind a dash; `glued` is what follows it without a space.
    #[expect(clippy::arithmetic_side_effects, reason = "a dash is a byte of the text")]
    fn type_after_dash(&mut self, dash: Item<'_>, glued: &str, items: &mut Items<'_>) -> TypeExpression {
        if glued.starts_with(['?', ':']) {
            self.sink.error("P106", dash.span(), format!("`{glued}` is not a type"));
            return TypeExpression::default();
        }
        if !glued.is_empty() {
            let span = Span { start: dash.span().start + 1, ..dash.span() };
            self.sink
                .warning("P107", dash.span(), format!("`-{glued}` is read as `- {glued}`"))
                .help("put a space behind the dash: other planners read one name here");
            return self.one_type(glued, span);
        }
        let Some(item) = items.next() else {
            self.sink.error("P107", dash.span(), "a type is missing behind this `-`");
            return TypeExpression::default();
        };
        self.type_expression(item)
    }

    /// One type or `(either …)`.
    fn type_expression(&mut self, item: Item<'_>) -> TypeExpression {
        if !item.is_headed("either") {
            let name = self.name_item(item, "a type");
            return name
                .map_or_else(TypeExpression::default, |name| self.one_type(name.name.as_str(), name.span));
        }
        if item.rest().next().is_none() {
            self.sink
                .error("P108", item.span(), "`either` names no type")
                .help("write `(either place robot)`");
        }
        let alternatives = item.rest().filter_map(|item| self.name_item(item, "a type"));
        TypeExpression { alternatives: alternatives.collect() }
    }

    /// The type with a name; that of everything is the same as none.
    fn one_type(&mut self, name: &str, span: Span) -> TypeExpression {
        if name.eq_ignore_ascii_case("object") {
            return TypeExpression::default();
        }
        TypeExpression { alternatives: vec![self.identifier(name, span)] }
    }

    fn entry(&mut self, item: Item<'_>, symbol: &str, entries: Entries) -> Option<Identifier> {
        if entries == Entries::Names {
            return self.name_item(item, "a name");
        }
        self.variable(item, symbol)
    }

    /// A variable, without its question mark.
    fn variable(&mut self, item: Item<'_>, symbol: &str) -> Option<Identifier> {
        match symbol.strip_prefix('?') {
            Some(name) if !name.is_empty() => Some(self.identifier(name, item.span())),
            _ => {
                self.sink
                    .error("P106", item.span(), format!("expected a variable, found `{symbol}`"))
                    .help(format!("variables begin with a question mark: `?{}`", symbol.trim_matches('?')));
                None
            }
        }
    }

    /// The parenthesised parameters of an action or a quantifier.
    pub(super) fn parameters(&mut self, item: Item<'_>) -> Vec<TypedName> {
        if !item.is_list() {
            self.expected(item, "a list of variables").help("write `(?x ?y - type)`");
            return Vec::new();
        }
        self.typed_list(item.items(), Entries::Variables)
    }

    /// `(name ?x ?y - type)`.
    pub(super) fn declaration(&mut self, item: Item<'_>, what: &str) -> Option<Declaration> {
        let Some(first) = item.items().next() else {
            self.expected(item, what).help("write `(name ?x ?y - type)`");
            return None;
        };
        let identifier = self.name_item(first, what)?;
        let parameters = self.typed_list(item.rest(), Entries::Variables);
        Some(Declaration { identifier, parameters })
    }

    /// The declarations of `:functions`, with their result types: `(f ?x) - number`, `(g)`.
    pub(super) fn function_list(&mut self, items: Items<'_>) -> Vec<Declaration> {
        let mut list = Vec::new();
        let mut items = items;
        while let Some(item) = items.next() {
            match item.symbol() {
                None => list.extend(self.declaration(item, "a function")),
                Some("-") => self.result_type(items.next()),
                Some("-number") => {}
                Some(_) => {
                    self.expected(item, "a function").help("write `(name ?x - type)`");
                }
            }
        }
        list
    }

    fn result_type(&mut self, item: Option<Item<'_>>) {
        let Some(item) = item else { return };
        if item.symbol().is_some_and(|name| name.eq_ignore_ascii_case("number")) {
            return;
        }
        let r#type = item.symbol().unwrap_or("either …");
        self.sink
            .error(
                "P113",
                at_start(item),
                format!("functions with values of type `{type}` (object fluents) are not supported"),
            )
            .help("use a predicate with one more argument; numeric functions are `- number`");
    }
}
