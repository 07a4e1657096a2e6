//! Parses typed lists (`?x ?y - place ?z`, objects, types) and declarations with typed lists.

use crate::ast::{Declaration, Domain, Identifier, Span, TypeExpression, TypedName};
use crate::sexp::{Item, Items};

use super::Parser;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Entries {
    Variables,
    Names,
}

impl Parser<'_> {
    /// Parses the entries of a typed list. A dash that is joined to the following word, as in `-type`, is
    /// read as a separate dash.
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
                    self.sink.warning("P107", item.span(), "there are no names before this `-`");
                }
                list[untyped_from..].iter_mut().for_each(|entry| entry.r#type = r#type.clone());
                untyped_from = list.len();
            } else if let Some(identifier) = self.entry(item, symbol, entries) {
                list.push(TypedName { identifier, r#type: TypeExpression::default() });
            }
        }
        list
    }

    /// Parses the type after a dash. `glued` is the text that follows the dash without a space.
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
                .help("put a space after the dash: other planners read one name here");
            return self.named_type(glued, span);
        }
        let Some(item) = items.next() else {
            self.sink.error("P107", dash.span(), "a type is missing after this `-`");
            return TypeExpression::default();
        };
        self.type_expression(item)
    }

    fn type_expression(&mut self, item: Item<'_>) -> TypeExpression {
        if !item.is_headed("either") {
            let name = self.name_item(item, "a type");
            return name
                .map_or_else(TypeExpression::default, |name| self.named_type(name.name.as_str(), name.span));
        }
        if item.rest().next().is_none() {
            self.sink
                .error("P108", item.span(), "`either` names no type")
                .help("write `(either place robot)`");
        }
        let alternatives = item.rest().filter_map(|item| self.name_item(item, "a type"));
        TypeExpression { alternatives: alternatives.collect() }
    }

    fn named_type(&mut self, name: &str, span: Span) -> TypeExpression {
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

    pub(super) fn parameters(&mut self, item: Item<'_>) -> Vec<TypedName> {
        if !item.is_list() {
            self.expected(item, "a list of variables").help("write `(?x ?y - type)`");
            return Vec::new();
        }
        self.typed_list(item.items(), Entries::Variables)
    }

    pub(super) fn declaration(&mut self, item: Item<'_>, description: &str) -> Option<Declaration> {
        let Some(first) = item.items().next() else {
            self.expected(item, description).help("write `(name ?x ?y - type)`");
            return None;
        };
        let identifier = self.name_item(first, description)?;
        let parameters = self.typed_list(item.rest(), Entries::Variables);
        Some(Declaration { identifier, parameters })
    }

    /// Parses the declarations of `:functions` with the types of their values: `(f ?x) - number`, `(place-of
    /// ?x) - place`, `(g)`. Functions with other values than numbers are declared as object fluents.
    pub(super) fn function_list(&mut self, items: Items<'_>, domain: &mut Domain) {
        let mut untyped = Vec::new();
        let mut items = items;
        while let Some(item) = items.next() {
            let Some(symbol) = item.symbol() else {
                untyped.extend(self.declaration(item, "a function"));
                continue;
            };
            let Some(glued) = symbol.strip_prefix('-') else {
                self.expected(item, "a function").help("write `(name ?x - type)`");
                continue;
            };
            let written =
                if glued.is_empty() { items.clone().next().and_then(Item::symbol) } else { Some(glued) };
            if written.is_some_and(|name| name.eq_ignore_ascii_case("number")) {
                if glued.is_empty() {
                    items.next();
                }
                domain.functions.append(&mut untyped);
                continue;
            }
            let r#type = self.type_after_dash(item, glued, &mut items);
            for declaration in untyped.drain(..) {
                self.object_fluent(declaration, r#type.clone(), domain);
            }
        }
        domain.functions.append(&mut untyped);
    }
}
