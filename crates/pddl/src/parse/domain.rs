//! Parses domains and their actions.

use diagnostics::nearest;

use crate::ast::{Action, ActionBody, Condition, Derived, Domain, Effect, Identifier};
use crate::sexp::{Item, SECTIONS};

use super::object::with_needs;
use super::typed::Entries;
use super::{Parser, at_start, list_start};

const DECLARATIONS: [&str; 5] = [":requirements", ":types", ":constants", ":predicates", ":functions"];
const ACTION_KEYS: [&str; 4] = [":parameters", ":vars", ":precondition", ":effect"];
const DURATIVE_KEYS: [&str; 4] = [":parameters", ":duration", ":condition", ":effect"];

impl Parser<'_> {
    pub(super) fn domain(&mut self, define: Item<'_>) -> Option<Domain> {
        let (name, sections) = self.header(define, "domain")?;
        let mut domain = Domain {
            name,
            requirements: Vec::new(),
            types: Vec::new(),
            constants: Vec::new(),
            predicates: Vec::new(),
            functions: Vec::new(),
            object_fluents: Vec::new(),
            derived: Vec::new(),
            constraints: Vec::new(),
            actions: Vec::new(),
        };
        // The meaning of an action depends on the set of object fluents, so declarations are read first.
        let (declarations, remaining): (Vec<_>, Vec<_>) =
            sections.partition(|section| DECLARATIONS.iter().any(|keyword| section.is_headed(keyword)));
        for section in declarations.into_iter().chain(remaining) {
            self.domain_section(section, &mut domain);
        }
        self.object_fluents_clash(&domain);
        Some(domain)
    }

    /// Returns the name in `(define (KIND NAME)` and the sections that follow. If the text defines another
    /// kind, reports an error and returns `None`.
    pub(super) fn header<'t>(
        &mut self,
        define: Item<'t>,
        kind: &str,
    ) -> Option<(Identifier, impl Iterator<Item = Item<'t>> + use<'t>)> {
        let mut items = define.rest();
        let Some(header) = items.next().filter(|header| header.is_headed(kind)) else {
            let place = define.rest().next().unwrap_or(define);
            let opposite = if kind == "domain" { "problem" } else { "domain" };
            let help = if place.is_headed(opposite) {
                format!("this is a {opposite} file; were the two files exchanged?")
            } else {
                format!("write `(define ({kind} name) …)`")
            };
            self.sink.error("P104", at_start(place), format!("expected `({kind} name)`")).help(help);
            return None;
        };
        let name = if let Some(item) = header.rest().next() {
            self.name_item(item, &format!("a name of a {kind}"))
        } else {
            self.sink.error("P106", header.span(), format!("the {kind} has no name"));
            None
        };
        // A definition without a name can still be checked.
        let name = name.unwrap_or_else(|| self.identifier("unnamed", header.span()));
        Some((name, items))
    }

    fn domain_section(&mut self, section: Item<'_>, domain: &mut Domain) {
        let message_count = self.sink.len();
        let keyword = section.head().unwrap_or_default().to_ascii_lowercase();
        match keyword.as_str() {
            ":requirements" => self.requirements(section, &mut domain.requirements),
            ":types" => {
                domain.types.extend(self.typed_list(section.rest(), Entries::Names));
                self.objects.set_types(domain);
            }
            ":constants" => domain.constants.extend(self.typed_list(section.rest(), Entries::Names)),
            ":predicates" => {
                let declarations = section.rest().filter_map(|item| self.declaration(item, "a predicate"));
                domain.predicates.extend(declarations);
            }
            ":functions" => self.function_list(section.rest(), domain),
            ":constraints" => return self.constraints(section, &mut domain.constraints),
            ":derived" => return domain.derived.extend(self.derived(section)),
            ":action" => return domain.actions.extend(self.action(section)),
            ":durative-action" => return domain.actions.extend(self.durative_action(section)),
            _ => return self.other_section(section, "domain"),
        }
        // If this section caused an error, declarations may be missing. In a file with an error, a warning about
        // the section counts as well, which only suppresses later messages about names.
        if self.sink.len() > message_count && self.sink.has_errors() {
            self.declarations_intact = false;
        }
    }

    pub(super) fn requirements(&mut self, section: Item<'_>, flags: &mut Vec<Identifier>) {
        for item in section.rest() {
            match item.symbol().and_then(|symbol| symbol.strip_prefix(':')) {
                Some(flag) => flags.push(self.identifier(flag, item.span())),
                None => {
                    self.expected(item, "a requirement such as `:typing`");
                }
            }
        }
    }

    pub(super) fn other_section(&mut self, section: Item<'_>, kind: &str) {
        let keyword = section.head().unwrap_or_default().to_ascii_lowercase();
        let refused = match keyword.as_str() {
            ":process" | ":event" => Some((
                "processes and events (PDDL+)",
                "only actions, and timed initial literals at known times, change the state here",
            )),
            ":task" | ":method" | ":htn" => Some((
                "hierarchical tasks and methods (HDDL)",
                "a plan here reaches a goal; state the result of the tasks as `:goal`",
            )),
            ":axiom" => {
                Some(("axioms of PDDL 1.2 (`:axiom`)", "write `(:derived (predicate ?x) (condition))`"))
            }
            _ => None,
        };
        if let Some((construct, alternative)) = refused {
            self.refuse(section, construct).help(alternative);
            return;
        }
        if keyword == ":length" {
            self.sink.warning("P109", at_start(section), "`:length` is ignored");
            return;
        }
        if !section.is_headed(&keyword) || !keyword.starts_with(':') {
            self.expected(section, "a section such as `(:init …)`");
            return;
        }
        self.declarations_intact = false;
        self.has_unknown_section = true;
        let help = match nearest(&keyword, SECTIONS) {
            Some(suggestion) => format!("did you mean `{suggestion}`?"),
            None => "known sections are those of PDDL 3".to_owned(),
        };
        let message = format!("a {kind} has no section `{keyword}`");
        self.sink.error("P109", list_start(section), message).help(help);
    }

    fn derived(&mut self, section: Item<'_>) -> Option<Derived> {
        let [head, condition] = self.operands(section, "(:derived (predicate ?x) (condition))")?;
        let (head, condition) = (self.declaration(head, "a predicate"), self.condition(condition));
        Some(Derived { head: head?, condition: condition?, span: section.span() })
    }

    fn action(&mut self, section: Item<'_>) -> Option<Action> {
        let (identifier, fields) = self.action_fields(section, &ACTION_KEYS)?;
        self.begin_effects();
        let (mut parameters, mut precondition, mut effect) = (Vec::new(), None, None);
        let (mut variables, mut preferences) = (Vec::new(), Vec::new());
        for (keyword, value) in fields {
            match keyword {
                ":parameters" => parameters = self.parameters(value),
                // PDDL 1.2: variables that the precondition binds and the effect uses.
                ":vars" => {
                    self.sink
                        .warning("P109", at_start(value), "`:vars` are read as further parameters")
                        .help("plans name their objects, too, after those of `:parameters`");
                    variables = self.parameters(value);
                }
                ":precondition" => precondition = self.precondition(value, &mut preferences),
                _ => effect = self.effect(value),
            }
        }
        parameters.append(&mut variables);
        let needs = self.needs_of_effects().into_iter().map(|(_, need)| need).collect();
        let body = ActionBody::Instantaneous {
            precondition: with_needs(precondition.unwrap_or(Condition::And(Vec::new())), needs),
            effect: effect.unwrap_or(Effect::And(Vec::new())),
        };
        Some(Action { identifier, parameters, body, preferences, span: section.span() })
    }

    fn durative_action(&mut self, section: Item<'_>) -> Option<Action> {
        let (identifier, fields) = self.action_fields(section, &DURATIVE_KEYS)?;
        self.begin_effects();
        if !fields.iter().any(|(keyword, _)| *keyword == ":duration") {
            self.sink
                .error(
                    "P110",
                    identifier.span,
                    format!("the durative action `{}` has no `:duration`", identifier.name),
                )
                .help("write `:duration (= ?duration 5)`");
        }
        let mut parameters = Vec::new();
        let (mut duration, mut conditions, mut effects) = (Vec::new(), Vec::new(), Vec::new());
        let mut preferences = Vec::new();
        for (keyword, value) in fields {
            match keyword {
                ":parameters" => parameters = self.parameters(value),
                ":duration" => self.duration(value, &mut duration),
                ":condition" => self.durative_condition(value, &mut conditions, &mut preferences),
                _ => self.timed_effects(value, &mut effects),
            }
        }
        conditions.extend(self.needs_of_effects());
        let body = ActionBody::Durative { duration, conditions, effects };
        Some(Action { identifier, parameters, body, preferences, span: section.span() })
    }

    fn action_fields<'t>(
        &mut self,
        section: Item<'t>,
        keys: &[&'static str],
    ) -> Option<(Identifier, Vec<(&'static str, Item<'t>)>)> {
        let mut items = section.rest().peekable();
        let Some(name) = items.next() else {
            self.sink.error("P106", section.span(), "the action has no name");
            return None;
        };
        let identifier = self.name_item(name, "a name of an action")?;
        let mut fields: Vec<(&'static str, Item<'t>)> = Vec::new();
        while let Some(item) = items.next() {
            let Some(symbol) = item.symbol().filter(|symbol| symbol.starts_with(':')) else {
                self.expected(item, "a keyword such as `:effect`").help(
                    "each keyword of an action has one value; several conditions or effects need `(and …)`",
                );
                continue;
            };
            let is_value = |item: &Item<'_>| !item.symbol().is_some_and(|symbol| symbol.starts_with(':'));
            let Some(value) = items.next_if(is_value) else {
                self.sink.error("P106", item.span(), format!("`{symbol}` has no value"));
                continue;
            };
            match keys.iter().find(|key| key.eq_ignore_ascii_case(symbol)) {
                Some(key) if fields.iter().any(|(present, _)| present == key) => {
                    self.sink.error("P111", item.span(), format!("`{symbol}` is repeated"));
                }
                Some(key) => fields.push((*key, value)),
                None => self.unknown_keyword(item, symbol, keys),
            }
        }
        Some((identifier, fields))
    }

    fn unknown_keyword(&mut self, item: Item<'_>, symbol: &str, keys: &[&'static str]) {
        let help = match (symbol.to_ascii_lowercase().as_str(), nearest(symbol, keys.iter().copied())) {
            (":condition", _) => "instantaneous actions have a `:precondition`".to_owned(),
            (":precondition", _) => "durative actions have a `:condition`".to_owned(),
            (":observe", _) => {
                "observations are not supported: every plan here is a sequence that needs to sense nothing"
                    .to_owned()
            }
            (":duration", _) => "actions with a duration are `:durative-action`".to_owned(),
            (_, Some(key)) => format!("did you mean `{key}`?"),
            _ => format!("known keywords are {}", keys.join(", ")),
        };
        self.sink.error("P109", item.span(), format!("this action cannot have `{symbol}`")).help(help);
    }
}
