//! Overrides (`--set NAME=VALUE`) of measured attributes of the knowledge base, and of fluents and
//! facts of the problem.

use num_rational::BigRational;
use pddl::ast::{InitialElement, Name, Span, Term};

use crate::binding::atom;
use crate::joined::Mission;
use crate::knowledge::Knowledge;
use crate::message::{Message, did_you_mean};

impl Mission {
    /// Sets a value. The first matching case applies:
    /// - a measured attribute of the knowledge base (`ambient_light=0.9`);
    /// - a numeric function of the problem with its arguments (`battery=30`, `travel_time wp1
    ///   wp2=3`);
    /// - a predicate with all its arguments, set to true or false (`pipeline_found pl1=true`);
    /// - a predicate without its last argument, which becomes the value (`robot_at=wp2`): it
    ///   replaces all facts that differ in the last argument only.
    ///
    /// # Errors
    /// No case matches, a value is not a decimal number, an attribute is only estimated, or the knowledge
    /// base decides on the availability of the design.
    pub fn set(&mut self, name: &str, value: &str) -> Result<(), Message> {
        self.current.take();
        let value = value.trim();
        if let Some(knowledge) = &mut self.knowledge
            && knowledge.has_attribute(name.trim())
        {
            if !is_measured(knowledge, name.trim()) {
                let text = format!(
                    "`{name}` is estimated for designs; nothing measures it, and no design has a bound on it"
                );
                return Err(Message::error("M106", text));
            }
            return knowledge.measure(name.trim(), value).map(|_| ());
        }
        self.set_in_problem(name, value)
    }

    /// Sets a numeric function or fact of the problem. Like [`Mission::set`], but ignores the
    /// measured attributes of the knowledge base.
    ///
    /// # Errors
    /// No symbol of the problem matches, a value is not a decimal number, or the knowledge base decides on
    /// the availability of the design.
    pub fn set_in_problem(&mut self, name: &str, value: &str) -> Result<(), Message> {
        self.current.take();
        let value = value.trim();
        let words: Vec<&str> = name.split_whitespace().collect();
        let Some((symbol, arguments)) = words.split_first() else {
            return Err(Message::error("M106", "`--set` needs a name before the equals sign"));
        };
        let symbol = Name::new(symbol);
        let is_own = matches!(arguments, [design] if self.decides_on(design));
        if self.knowledge.is_some() && self.bindings.is_availability(&symbol) && !is_own {
            let text = format!("the knowledge base decides on `{symbol}`; let components fail with `--fail`");
            return Err(Message::error("M106", text));
        }
        let arity = |declared: &[pddl::ast::Declaration]| {
            declared.iter().find(|d| d.identifier.name == symbol).map(|d| d.parameters.len())
        };
        if arity(&self.domain.functions) == Some(arguments.len()) {
            return self.set_value(&symbol, arguments, value);
        }
        match (arity(&self.domain.predicates), value.to_ascii_lowercase().as_str()) {
            (Some(arity), truth @ ("true" | "false")) if arity == arguments.len() => {
                self.set_fact(&symbol, arguments, truth == "true");
                Ok(())
            }
            (Some(arity), _) if arity == arguments.len() + 1 => {
                self.replace_last(&symbol, arguments, value);
                Ok(())
            }
            _ => Err(self.unknown_setting(name)),
        }
    }

    fn set_value(&mut self, function: &Name, arguments: &[&str], value: &str) -> Result<(), Message> {
        let Some(number) = decimal(value) else {
            return Err(Message::error(
                "M102",
                format!("the value `{value}` of {function} is not a decimal number"),
            ));
        };
        let target = atom(function, arguments);
        let is_target = |element: &InitialElement| matches!(element, InitialElement::Value(a, _, _) if same_atom(a, function, arguments));
        self.problem.init.retain(|element| !is_target(element));
        self.problem.init.push(InitialElement::Value(target, number, Span::default()));
        Ok(())
    }

    fn set_fact(&mut self, predicate: &Name, arguments: &[&str], holds: bool) {
        let is_target = |element: &InitialElement| match element {
            InitialElement::Fact(a) | InitialElement::NegatedFact(a) => same_atom(a, predicate, arguments),
            _ => false,
        };
        self.problem.init.retain(|element| !is_target(element));
        if holds {
            self.problem.init.push(InitialElement::Fact(atom(predicate, arguments)));
        }
    }

    fn replace_last(&mut self, predicate: &Name, prefix: &[&str], last: &str) {
        let is_target = |element: &InitialElement| match element {
            InitialElement::Fact(a) => {
                let shorter = &a.arguments[..a.arguments.len().saturating_sub(1)];
                a.predicate.name == *predicate && same_terms(shorter, prefix)
            }
            _ => false,
        };
        self.problem.init.retain(|element| !is_target(element));
        let arguments: Vec<&str> = prefix.iter().copied().chain([last]).collect();
        self.problem.init.push(InitialElement::Fact(atom(predicate, &arguments)));
    }

    fn unknown_setting(&self, name: &str) -> Message {
        let attributes = self.knowledge.iter().flat_map(|knowledge| knowledge.view().attribute_types());
        let attributes: Vec<_> = attributes.map(|attribute| attribute.name).collect();
        // The user cannot set symbols that only the explicit form of a plain domain has.
        let adaptation = self.adaptation.as_ref();
        let is_settable = |d: &&pddl::ast::Declaration| {
            adaptation.is_none_or(|is_settable| !is_settable.is_added(&d.identifier.name))
        };
        let declared = |all: &[pddl::ast::Declaration]| {
            let each = |d: &pddl::ast::Declaration| d.identifier.name.to_string();
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

fn same_atom(atom: &pddl::ast::Atom, predicate: &Name, arguments: &[&str]) -> bool {
    atom.predicate.name == *predicate && same_terms(&atom.arguments, arguments)
}

fn same_terms(terms: &[Term], arguments: &[&str]) -> bool {
    let is_equal = |(term, argument): (&Term, &&str)| match term {
        Term::Constant(identifier) | Term::Variable(identifier) => identifier.name == Name::new(argument),
    };
    terms.len() == arguments.len() && terms.iter().zip(arguments).all(is_equal)
}

/// Parses a decimal as an exact number: `-12`, `0.25`, `1e2`.
fn decimal(text: &str) -> Option<BigRational> {
    rules::Literal::parse(text, Some("http://www.w3.org/2001/XMLSchema#decimal"), None).as_rational()
}

/// Returns `true` if an attribute has a measured value, or if a design has a requirement that
/// bounds it.
fn is_measured(knowledge: &Knowledge, attribute: &str) -> bool {
    let view = knowledge.view();
    let local = ontology::vocab::local_name(attribute);
    view.measurements().iter().any(|measurement| measurement.attribute == local)
        || view
            .function_designs()
            .iter()
            .any(|design| design.requirements.iter().any(|r| r.attribute == local))
}
