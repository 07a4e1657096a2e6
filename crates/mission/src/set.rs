//! Overrides (`--set NAME=VALUE`) of measured attributes of the knowledge base, and of fluents and
//! facts of the problem.

use num_rational::BigRational;
use ontology::vocab::local_name;
use pddl::ast::{Atom, Declaration, InitialElement, Name, Span, Term};

use crate::binding::identifier;
use crate::joined::Mission;
use crate::message::{Message, did_you_mean};

impl Mission {
    /// Sets a value. The first matching case applies:
    /// - an attribute of the knowledge base whose measured values have an effect (`ambient_light=0.9`); the value also
    ///   replaces those that the problem states for functions bound to the attribute;
    /// - a numeric function of the problem with its arguments (`battery=30`, `travel_time wp1
    ///   wp2=3`);
    /// - a predicate with all its arguments, set to true or false (`pipeline_found pl1=true`);
    /// - a predicate without its last argument, which is given as the value (`robot_at=wp2`): the new fact
    ///   replaces all facts that differ in the last argument only.
    ///
    /// # Errors
    /// No case matches, a value is not a decimal number, measured values of the attribute have no effect, inference
    /// exceeds its limits, or the knowledge base decides on the availability of the design or states a fact that the
    /// setting would remove.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), Message> {
        self.forget();
        let (name, value) = (name.trim(), value.trim());
        if let Some(knowledge) = &mut self.knowledge
            && knowledge.uses_measurement(name)
        {
            knowledge.measure(name, value)?;
            // A value that the problem states would take precedence over the measurement.
            for function in self.fed_by(local_name(name)) {
                if self.value(&function).is_some() {
                    self.set_in_problem(&function, value)?;
                }
            }
            return Ok(());
        }
        let is_attribute = self.knowledge.as_ref().is_some_and(|knowledge| knowledge.has_attribute(name));
        // The designs of an action determine the value of such a function.
        if is_attribute && self.stands_for_designs(&Name::new(name)) {
            return Err(Message::error("M106", unused_measurement(name)));
        }
        self.set_in_problem(name, value).map(|_| ())
    }

    /// Sets a numeric function or fact of the problem. Like [`Mission::set`], but ignores the measured attributes
    /// of the knowledge base. Returns `false` if the initial state already agrees with the setting.
    ///
    /// # Errors
    /// No symbol of the problem matches, a value is not a decimal number, or the knowledge base decides on
    /// the availability of the design or states a fact that the setting would remove.
    pub fn set_in_problem(&mut self, name: &str, value: &str) -> Result<bool, Message> {
        let value = value.trim();
        let words: Vec<&str> = name.split_whitespace().collect();
        let Some((symbol, arguments)) = words.split_first() else {
            return Err(Message::error("M106", "`--set` needs a name before the equals sign"));
        };
        let symbol = Name::new(symbol);
        let is_own = matches!(arguments, [design] if self.decides_on(design));
        if self.knowledge.is_some() && self.bindings.is_availability(&symbol) && !is_own {
            let text = format!(
                "the knowledge base determines `{symbol}`; use `--fail` for failed components, or the events \
                 `component_status` and `design_status` of a running loop"
            );
            return Err(Message::error("M106", text));
        }
        let arguments: Vec<Name> = arguments.iter().map(|argument| Name::new(argument)).collect();
        let function = self.domain.functions.iter().find(|declared| declared.identifier.name == symbol);
        if function.is_some_and(|declared| declared.parameters.len() == arguments.len()) {
            return self.set_value(&symbol, &arguments, value);
        }
        let mut predicates = self.domain.predicates.iter().filter(|declared| self.is_settable(declared));
        let arity = predicates
            .find(|declared| declared.identifier.name == symbol)
            .map(|declared| declared.parameters.len());
        match (arity, value.to_ascii_lowercase().as_str()) {
            (Some(arity), truth @ ("true" | "false")) if arity == arguments.len() => {
                let holds = truth == "true";
                if !holds {
                    self.check_removal(&symbol, &|own| same_terms(own, &arguments))?;
                }
                Ok(self.set_fact(&symbol, &arguments, holds))
            }
            (Some(arity), _) if arity == arguments.len() + 1 => {
                let last = Name::new(value);
                self.check_removal(&symbol, &|own| match own.split_last() {
                    Some((own_last, others)) => *own_last.name() != last && same_terms(others, &arguments),
                    None => false,
                })?;
                Ok(self.replace_last(&symbol, arguments, last))
            }
            _ => Err(self.unknown_setting(name, value)),
        }
    }

    /// Fails if the knowledge base states a fact of the predicate that a setting would remove: one for whose arguments
    /// `is_removed` returns `true`.
    fn check_removal(&self, predicate: &Name, is_removed: &dyn Fn(&[Term]) -> bool) -> Result<(), Message> {
        let is_known = self.completed_predicates().is_some_and(|known| known.contains(predicate));
        if self.knowledge.is_none() || !is_known && !self.bindings.is_bound_predicate(predicate) {
            return Ok(());
        }
        let removed = |element: &InitialElement| match element {
            InitialElement::Fact(atom) if atom.predicate.name == *predicate => is_removed(&atom.arguments),
            _ => false,
        };
        let mut problem = self.problem.clone();
        problem.init.retain(|element| !removed(element));
        self.fill(&mut problem);
        let Some(InitialElement::Fact(atom)) = problem.init.iter().find(|element| removed(element)) else {
            return Ok(());
        };
        let words: Vec<&str> = atom.arguments.iter().map(|argument| argument.name().as_str()).collect();
        let text = format!(
            "the knowledge base states `({predicate} {})`, which a setting cannot remove; change it in the knowledge base",
            words.join(" ")
        );
        Err(Message::error("M106", text))
    }

    fn set_value(&mut self, function: &Name, arguments: &[Name], value: &str) -> Result<bool, Message> {
        let Some(number) = decimal(value) else {
            return Err(Message::error(
                "M102",
                format!("the value `{value}` of {function} is not a decimal number"),
            ));
        };
        Ok(self.assign(function, arguments, &number))
    }

    /// Sets the value of a numeric function of the problem, given as `name arguments`, to an exact number.
    pub fn set_number(&mut self, name: &str, number: &BigRational) {
        let words: Vec<Name> = name.split_whitespace().map(Name::new).collect();
        if let Some((function, arguments)) = words.split_first() {
            self.assign(function, arguments, number);
        }
    }

    fn assign(&mut self, function: &Name, arguments: &[Name], number: &BigRational) -> bool {
        let is_target = |element: &InitialElement| matches!(element, InitialElement::Value(a, _, _) if same_atom(a, function, arguments));
        let is_equal = |element: &InitialElement| matches!(element, InitialElement::Value(_, value, _) if value == number);
        if self.has_only(is_target, is_equal) {
            return false;
        }
        let value = InitialElement::Value(constants(function, arguments), number.clone(), Span::default());
        self.replace(is_target, Some(value));
        true
    }

    fn set_fact(&mut self, predicate: &Name, arguments: &[Name], holds: bool) -> bool {
        let is_fact = |element: &InitialElement| matches!(element, InitialElement::Fact(a) if same_atom(a, predicate, arguments));
        if self.problem.init.iter().any(is_fact) == holds {
            return false;
        }
        let is_target = |element: &InitialElement| match element {
            InitialElement::Fact(a) | InitialElement::NegatedFact(a) => same_atom(a, predicate, arguments),
            _ => false,
        };
        self.replace(is_target, holds.then(|| InitialElement::Fact(constants(predicate, arguments))));
        true
    }

    fn replace_last(&mut self, predicate: &Name, mut arguments: Vec<Name>, last: Name) -> bool {
        let prefix = arguments.clone();
        let is_target = |element: &InitialElement| match element {
            InitialElement::Fact(a) => {
                let shorter = &a.arguments[..a.arguments.len().saturating_sub(1)];
                a.predicate.name == *predicate && same_terms(shorter, &prefix)
            }
            _ => false,
        };
        arguments.push(last);
        let is_equal = |element: &InitialElement| matches!(element, InitialElement::Fact(a) if same_terms(&a.arguments, &arguments));
        if self.has_only(is_target, is_equal) {
            return false;
        }
        self.replace(is_target, Some(InitialElement::Fact(constants(predicate, &arguments))));
        true
    }

    fn has_only(
        &self,
        is_target: impl Fn(&InitialElement) -> bool,
        is_equal: impl Fn(&InitialElement) -> bool,
    ) -> bool {
        let mut targets = self.problem.init.iter().filter(|element| is_target(element)).peekable();
        targets.peek().is_some() && targets.all(is_equal)
    }

    fn replace(&mut self, is_target: impl Fn(&InitialElement) -> bool, replacement: Option<InitialElement>) {
        self.forget();
        self.problem.init.retain(|element| !is_target(element));
        self.problem.init.extend(replacement);
    }

    /// Returns `true` unless only the explicit form of a plain domain has the symbol. Users cannot set such predicates.
    fn is_settable(&self, declared: &Declaration) -> bool {
        self.adaptation.as_ref().is_none_or(|adaptation| !adaptation.is_added(&declared.identifier.name))
    }

    /// Returns the fault of a setting with a known name: it is an attribute, which [`Mission::set_in_problem`] does not
    /// set, or its value or the number of its arguments is wrong. Returns `None` if the name is unknown.
    fn misused_name(&self, name: &str, value: &str) -> Option<String> {
        let name = name.trim();
        if let Some(knowledge) = &self.knowledge
            && knowledge.has_attribute(name)
        {
            return Some(if knowledge.uses_measurement(name) {
                format!(
                    "`{name}` is an attribute of the knowledge base, and not a value or fact of the problem; report it \
                     with the event `measured`"
                )
            } else {
                unused_measurement(name)
            });
        }
        let mut words = name.split_whitespace();
        let symbol = Name::new(words.next()?);
        let argument_count = words.count();
        let arity = |declared: &[Declaration]| {
            let mut declared = declared.iter().filter(|declared| self.is_settable(declared));
            declared
                .find(|declared| declared.identifier.name == symbol)
                .map(|declaration| declaration.parameters.len())
        };
        match (arity(&self.domain.functions), arity(&self.domain.predicates)) {
            (_, Some(arity)) if arity == argument_count => Some(format!(
                "the value of `{name}` is `{value}`, but should be `true` or `false`, because `{name}` is a predicate \
                 with all its arguments"
            )),
            (Some(arity), _) => Some(format!(
                "`{symbol}` is a numeric function; number of its arguments: {arity}, but `{name}` has {argument_count}"
            )),
            (None, Some(arity)) => Some(format!(
                "`{symbol}` is a predicate; number of its arguments: {arity}, but `{name}` has {argument_count}; give all of \
                 them and the value `true` or `false`, or all but the last and the last as the value"
            )),
            (None, None) => None,
        }
    }

    fn unknown_setting(&self, name: &str, value: &str) -> Message {
        if let Some(text) = self.misused_name(name, value) {
            return Message::error("M106", text);
        }
        let attributes = self.knowledge.iter().flat_map(|knowledge| knowledge.view().attribute_types());
        let attributes: Vec<_> = attributes.map(|attribute| attribute.name).collect();
        let is_settable = |declared: &&Declaration| self.is_settable(declared);
        let declared = |all: &[Declaration]| {
            let each = |d: &Declaration| d.identifier.name.to_string();
            all.iter().filter(is_settable).map(each).collect::<Vec<_>>().join(", ")
        };
        let text = format!(
            "`{name}` is neither an attribute of the knowledge base ({}), nor a numeric function ({}) with its arguments, \
             nor a predicate ({}) with its arguments or all but the last",
            attributes.join(", "),
            declared(&self.domain.functions),
            declared(&self.domain.predicates),
        );
        let declared = self.domain.functions.iter().chain(&self.domain.predicates).filter(is_settable);
        let names = declared
            .map(|symbol| symbol.identifier.name.as_str())
            .chain(attributes.iter().map(String::as_str));
        let symbol = name.split_whitespace().next().unwrap_or(name);
        Message::error("M106", text + &did_you_mean(symbol, names))
    }
}

fn constants(symbol: &Name, arguments: &[Name]) -> Atom {
    let arguments = arguments.iter().map(|argument| Term::Constant(identifier(argument))).collect();
    Atom { predicate: identifier(symbol), arguments, span: Span::default() }
}

fn same_atom(atom: &Atom, predicate: &Name, arguments: &[Name]) -> bool {
    atom.predicate.name == *predicate && same_terms(&atom.arguments, arguments)
}

fn same_terms(terms: &[Term], arguments: &[Name]) -> bool {
    terms.iter().map(Term::name).eq(arguments)
}

/// Parses a decimal as an exact number: `-12`, `0.25`, `1e2`.
fn decimal(text: &str) -> Option<BigRational> {
    rules::Literal::parse(text, Some("http://www.w3.org/2001/XMLSchema#decimal"), None).as_rational()
}

/// Returns the reason why a measurement of an attribute is refused, if
/// [`uses_measurement`](crate::knowledge::Knowledge::uses_measurement) is `false` for it.
pub fn unused_measurement(attribute: &str) -> String {
    format!(
        "`{attribute}` is estimated for designs; nothing measures it, no design has a bound on it, and no rule reads it"
    )
}
