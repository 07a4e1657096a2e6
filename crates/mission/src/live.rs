//! State of a running mission: changes of the problem and the knowledge base as the robot acts and
//! reports.

use std::borrow::Cow;
use std::sync::Arc;

use num_rational::BigRational;
use ontology::tomasys::FunctionDesign;
use ontology::vocab::local_name;
use pddl::ast::{Atom, Condition, Declaration, Domain, InitialElement, Name, Problem, Term};
use pddl::visit::Node;
use pddl::{self, Severity, Source};
use rules::{Delta, Fact};

use crate::binding;
use crate::joined::Mission;
use crate::knowledge::Knowledge;
use crate::message::{Errors, Message};
use crate::planta::Planta;
use crate::withdraw::withdraw;

impl Mission {
    /// Adds the current objects, facts and values of the knowledge base to a problem of this mission. Returns
    /// warnings and errors.
    pub fn fill(&self, problem: &mut Problem) -> Vec<Message> {
        self.knowledge.as_ref().map_or_else(Vec::new, |knowledge| {
            if let Some(planta) = &self.planta {
                let stated = knowledge.stated().into_iter();
                return planta.fill(&self.domain, problem, knowledge.engine(), stated);
            }
            if let Some(adaptation) = &self.adaptation {
                adaptation.fill(problem, knowledge.catalogue().designs());
            }
            let is_replaced = |name: &Name| self.stands_for_designs(name);
            binding::fill(&self.domain, problem, knowledge, &self.bindings, &self.own, &is_replaced)
        })
    }

    /// Returns the problem with the contributions of the knowledge base ([`Mission::fill`]), without checks. The
    /// result is cached until the mission changes.
    pub fn current(&self) -> Arc<Problem> {
        let fill = || {
            let mut problem = self.problem.clone();
            self.fill(&mut problem);
            Arc::new(problem)
        };
        Arc::clone(self.current.get_or_init(fill))
    }

    /// Returns the problem of [`Mission::current`], and empties its cache. Copies the problem only if it is shared.
    pub fn take_current(&mut self) -> Problem {
        // The domain needs the filled problem, too, and is cached longer.
        self.domain();
        let filled = self.current();
        self.current.take();
        Arc::unwrap_or_clone(filled)
    }

    /// Returns `true` if a numeric function of a plain domain (without a type of designs) is
    /// replaced by a sum over the chosen or the newly chosen designs.
    pub(crate) fn stands_for_designs(&self, function: &Name) -> bool {
        self.adaptation.as_ref().is_some_and(|adaptation| adaptation.stands_for_designs(function))
    }

    /// Returns the knowledge base for modification, if the mission has one.
    pub fn knowledge_mut(&mut self) -> Option<&mut Knowledge> {
        self.forget();
        self.knowledge.as_mut()
    }

    /// Returns the problem in its current state, without the contributions of the knowledge base.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// Returns the numeric functions of the domain whose value is the measured value of an attribute, given by local
    /// name.
    pub fn fed_by(&self, attribute: &str) -> Vec<String> {
        let fed = |declared: &&Declaration| self.bindings.is_measured(declared, attribute);
        let functions = self.domain.functions.iter().filter(fed);
        functions.map(|declared| declared.identifier.name.to_string()).collect()
    }

    /// Returns `true` if a measured value of the attribute, given by local name, can have an effect: on the knowledge
    /// base, or as the value of a function.
    pub fn uses_measurement(&self, attribute: &str) -> bool {
        self.knowledge.as_ref().is_some_and(|knowledge| knowledge.uses_measurement(attribute))
            || !self.fed_by(attribute).is_empty()
    }

    /// Returns `true` if a fact of the knowledge base can be part of the filled problem by its predicate: a class that is
    /// bound to a type, or in PLANTA's form a predicate that the domain file or the goal uses.
    pub fn contains_fact(&self, fact: &Fact) -> bool {
        let Some(engine) = self.knowledge.as_ref().map(Knowledge::engine) else { return false };
        if let Some(planta) = &self.planta {
            return planta.uses(fact, engine, &self.problem.goal);
        }
        let iri = engine.symbols().value(fact.predicate).as_name().unwrap_or_default();
        let is_class = |class: String| class == *iri || class == local_name(iri);
        let mut types = self.domain.types.iter().map(|declared| &declared.identifier.name);
        fact.arguments.len() == 1 && types.any(|name| self.bindings.class(name).is_some_and(is_class))
    }

    /// Returns `true` if the domain has a numeric function, given as `name arguments`, with this
    /// number of arguments.
    pub fn is_function(&self, name: &str) -> bool {
        let mut words = name.split_whitespace();
        let symbol = words.next().map(Name::new);
        let arguments = words.count();
        let is_meant =
            |d: &Declaration| Some(&d.identifier.name) == symbol.as_ref() && d.parameters.len() == arguments;
        self.domain.functions.iter().any(is_meant)
    }

    /// Returns `true` if the problem states a fact, given without parentheses: `predicate
    /// arguments`.
    pub fn holds(&self, fact: &str) -> bool {
        let words: Vec<Name> = fact.split_whitespace().map(Name::new).collect();
        let is_meant = |element: &InitialElement| matches!(element, InitialElement::Fact(atom) if is_named(atom, &words));
        self.problem.init.iter().any(is_meant)
    }

    /// Returns the numeric functions without parameters that have a value in the problem, with
    /// their values.
    pub fn values(&self) -> Vec<(String, BigRational)> {
        let values = self.problem.init.iter().filter_map(|element| match element {
            InitialElement::Value(atom, value, _) if atom.arguments.is_empty() => {
                Some((atom.predicate.name.to_string(), value.clone()))
            }
            _ => None,
        });
        values.collect()
    }

    /// Returns the value that the problem states for a numeric function, given as `name arguments`.
    pub fn value(&self, name: &str) -> Option<BigRational> {
        let words: Vec<Name> = name.split_whitespace().map(Name::new).collect();
        self.problem.init.iter().find_map(|element| match element {
            InitialElement::Value(atom, value, _) if is_named(atom, &words) => Some(value.clone()),
            _ => None,
        })
    }

    /// Adds a number to the value that a problem states for a numeric function, given as `name arguments`. Does nothing
    /// if it states none.
    pub fn add_to_value(problem: &mut Problem, name: &str, change: &BigRational) {
        let words: Vec<Name> = name.split_whitespace().map(Name::new).collect();
        for element in &mut problem.init {
            match element {
                InitialElement::Value(atom, value, _) if is_named(atom, &words) => *value += change,
                _ => {}
            }
        }
    }

    /// Returns `true` if the problem decides on the availability of a design, because the knowledge
    /// base has neither the design nor a function that the design solves.
    pub fn decides_on(&self, design: &str) -> bool {
        self.own.contains(&Name::new(design))
    }

    /// Returns `true` if the availability of a design is stated only by the problem (see
    /// [`decides_on`](Self::decides_on)), and the problem states that the design is available.
    pub fn provides(&self, design: &str) -> bool {
        let declared = self.domain.predicates.iter().map(|declared| &declared.identifier.name);
        let mut predicates = declared.filter(|name| self.bindings.is_availability(name));
        self.decides_on(design) && predicates.any(|predicate| self.holds(&format!("{predicate} {design}")))
    }

    /// Returns `true` if a design of the knowledge base is available in the initial state of a filled problem. In PLANTA's
    /// form, the axioms of the domain decide, which also read the facts of the problem. Otherwise, the conclusions of the
    /// knowledge base decide.
    pub fn is_available(&self, problem: &Problem, design: &FunctionDesign) -> bool {
        let name = &design.individual.name;
        self.planta
            .as_ref()
            .map_or(design.available, |planta| planta.is_available(&self.domain, problem, name))
    }

    /// Changes which designs of a filled problem are available and returns the domain for that problem. All predicates
    /// that are bound to availability change. Without such a predicate, the problem is unchanged.
    ///
    /// `allowed` is called with the name of each design of the knowledge base. The design is then available or not as
    /// in the result, throughout the plan; with `None` as without this call. Designs whose availability is stated by
    /// the problem are kept.
    pub fn allow(&self, problem: &mut Problem, allowed: &dyn Fn(&str) -> Option<bool>) -> Cow<'_, Domain> {
        let designs = self.knowledge.iter().flat_map(|knowledge| knowledge.catalogue().designs());
        let designs = designs.map(|design| (design.individual.name.as_str(), design.available));
        // In PLANTA's form, derived predicates of the domain express availability.
        if let Some(planta) = &self.planta {
            let changes = designs.filter_map(|(design, _)| Some((design, allowed(design)?)));
            return planta.allow(&self.domain, problem, changes);
        }
        let allowed: Vec<&str> = designs
            .filter(|(design, available)| allowed(design).unwrap_or(*available))
            .map(|(design, _)| design)
            .collect();
        let declared = self.domain.predicates.iter().filter(|declared| declared.parameters.len() == 1);
        let names = declared.map(|declared| &declared.identifier.name);
        for predicate in names.filter(|name| self.bindings.is_availability(name)) {
            let decides = |atom: &Atom| atom.arguments.iter().any(|term| self.own.contains(term.name()));
            let is_known = |element: &InitialElement| matches!(element, InitialElement::Fact(atom) if atom.predicate.name == *predicate && !decides(atom));
            problem.init.retain(|element| !is_known(element));
            let fact = |design: &&str| InitialElement::Fact(binding::atom(predicate, &[design]));
            problem.init.extend(allowed.iter().map(fact));
        }
        Cow::Borrowed(self.domain())
    }

    /// Withdraws from a filled problem and its `domain` that designs solve functions, given by their names: each of the
    /// designs solves none of the functions.
    pub fn withdraw_functions(
        &self,
        domain: &mut Cow<'_, Domain>,
        problem: &mut Problem,
        designs: &[&str],
        functions: &[&str],
    ) {
        let predicates = self.solves();
        if self.planta.is_some() {
            return Planta::withdraw_functions(domain, problem, &predicates, (designs, functions));
        }
        let [designs, functions] =
            [designs, functions].map(|names| names.iter().map(|name| Name::new(name)).collect::<Vec<_>>());
        for predicate in predicates {
            withdraw(domain, problem, &predicate, (&designs, &functions));
        }
    }

    /// Returns the number of parameters of an action in the domain file if the knowledge base has
    /// added design parameters. `None` for other actions.
    pub fn written_arguments(&self, action: &str) -> Option<usize> {
        self.adaptation.as_ref().and_then(|adaptation| adaptation.parameters(action))
    }

    /// Returns the functions for whose designs the knowledge base has added parameters to an action, in the order of
    /// these parameters.
    pub fn added_functions(&self, action: &str) -> Vec<&str> {
        self.adaptation.as_ref().map(|adaptation| adaptation.functions_of(action)).unwrap_or_default()
    }

    /// Applies the facts that an action has added and deleted to the assertions from which a problem in PLANTA's form is
    /// filled. Otherwise, [`Mission::fill`] would restore deleted facts and replaced values. Other missions are
    /// unchanged. Returns the change of all facts of the knowledge base.
    ///
    /// # Errors
    /// Inference exceeds its limits; the knowledge base is then unchanged.
    pub fn assert_effects(&mut self, added: &[Atom], deleted: &[Atom]) -> Result<Delta, Message> {
        self.forget();
        let (Some(planta), Some(knowledge)) = (&self.planta, &mut self.knowledge) else {
            return Ok(Delta::default());
        };
        if !added.iter().chain(deleted).any(|atom| planta.known().contains(&atom.predicate.name)) {
            return Ok(Delta::default());
        }
        knowledge.change_assertions(|stated, engine| planta.effects(stated, engine, (added, deleted)))
    }

    /// Returns `true` if the loss of designs may make plans possible or better: a condition, an axiom or the goal reads
    /// the availability of designs in another way than as a positive fact. In PLANTA's form, axioms decide on the
    /// availability, and the facts that they read are reported as changes of the problem.
    pub fn may_gain_by_loss(&self) -> bool {
        if self.planta.is_some() {
            return false;
        }
        let is_availability = |atom: &Atom| self.bindings.is_availability(&atom.predicate.name);
        let domain = self.domain();
        let mut mentions = 0;
        let mut count = |node: Node<'_>| mentions += usize::from(node.atom().is_some_and(is_availability));
        domain.walk(&mut count);
        self.problem.walk(&mut count);
        let conditions = domain.actions.iter().flat_map(|action| action.body.conditions());
        let required = conditions.chain([&self.problem.goal]);
        mentions > required.map(|condition| positive_atoms(condition, &is_availability)).sum()
    }

    /// Replaces the initial state of the problem.
    pub fn set_init(&mut self, init: Vec<InitialElement>) {
        self.forget();
        self.problem.init = init;
    }

    /// Replaces the goal.
    pub fn set_goal(&mut self, goal: Condition) {
        self.forget();
        self.problem.goal = goal;
    }

    /// Parses a goal and checks it against the domain and all objects.
    ///
    /// # Errors
    /// The syntax errors of the goal. Without such errors: its type errors.
    pub fn goal(&self, text: &str) -> Result<Condition, Errors> {
        let text = format!("(define (problem goal) (:domain {}) (:goal {text}))", self.domain.name.name);
        let source = Source::new("goal", text);
        let (tree, diagnostics) = pddl::parse_problem_of(&self.domain, &source);
        let messages = Message::from_pddl(&diagnostics, &[&source]);
        let Some(tree) = tree.filter(|_| !pddl::has_errors(&diagnostics)) else {
            return Err(messages.into());
        };
        let mut problem = self.problem.clone();
        problem.goal = tree.goal;
        self.fill(&mut problem);
        let mut errors = pddl::check_goal(&self.domain, &problem, &source);
        errors.retain(|diagnostic| diagnostic.severity == Severity::Error);
        if errors.is_empty() { Ok(problem.goal) } else { Err(Message::from_pddl(&errors, &[&source]).into()) }
    }

    /// Returns the functions of the knowledge base that at least one design solves, in alphabetical
    /// order.
    pub fn functions(&self) -> Vec<String> {
        let designs = self.knowledge.iter().flat_map(|knowledge| knowledge.catalogue().designs());
        let names: std::collections::BTreeSet<String> =
            designs.flat_map(|design| design.solves.iter().map(|function| function.name.clone())).collect();
        names.into_iter().collect()
    }

    /// Returns the object names of the designs that solve a function, including unavailable
    /// designs and designs that only the problem has. Empty without a knowledge base.
    pub fn designs_of(&self, function: &str) -> Vec<String> {
        let Some(knowledge) = &self.knowledge else { return Vec::new() };
        let solves = |design: &&FunctionDesign| design.solves.iter().any(|solved| solved.name == function);
        let designs = knowledge.catalogue().designs().iter().filter(solves);
        let designs = designs.map(|design| design.individual.name.clone());
        let function = Name::new(function);
        let problem_designs = self.own.iter().filter(|design| {
            self.problem.init.iter().any(|element| match element {
                InitialElement::Fact(atom) => {
                    self.bindings.solves().contains(&atom.predicate.name)
                        && atom.arguments.iter().map(Term::name).eq([*design, &function])
                }
                _ => false,
            })
        });
        designs.chain(problem_designs.map(ToString::to_string)).collect()
    }
}

/// Number of the wanted atoms of a condition that are not in a negation or implication.
fn positive_atoms(condition: &Condition, is_wanted: &dyn Fn(&Atom) -> bool) -> usize {
    match condition {
        Condition::Atom(atom) => usize::from(is_wanted(atom)),
        Condition::Not(_) | Condition::Imply(..) => 0,
        _ => condition.parts().map(|part| positive_atoms(part, is_wanted)).sum(),
    }
}

fn is_named(atom: &Atom, words: &[Name]) -> bool {
    std::iter::once(&atom.predicate.name).chain(atom.arguments.iter().map(Term::name)).eq(words)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use pddl::Source;
    use pddl::ast::InitialElement;

    use crate::binding::Bindings;
    use crate::joined::Mission;
    use crate::knowledge::{COADAPTATION, Knowledge, Sources};

    const DOMAIN: &str = "(define (domain d) (:types function functiondesign action place)
      (:predicates (fd_available ?d - functiondesign) (usable ?d - functiondesign) (a_req_f ?a - action ?f - function)
        (at ?p - place))
      (:action go :parameters (?d - functiondesign ?p - place) :precondition (usable ?d) :effect (at ?p)))";

    /// Mission with the knowledge base of the ground vehicle and some bindings.
    fn mission(objects: &str, bindings: &[(&str, &str)]) -> Mission {
        let document = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../ontology/kb/ugv.ttl");
        let rules = vec![COADAPTATION.to_owned()];
        let sources = Sources { documents: vec![document], rules, ..Sources::default() };
        let bindings: BTreeMap<String, String> =
            bindings.iter().map(|(symbol, query)| ((*symbol).to_owned(), (*query).to_owned())).collect();
        let problem =
            format!("(define (problem p) (:domain d) (:objects {objects}) (:init) (:goal (at here)))");
        Mission::new(
            "ugv",
            Some(Knowledge::read(&sources)),
            Bindings::with(&bindings).expect("bindings"),
            Ok(Source::new("domain", DOMAIN)),
            Ok(Source::new("problem", problem)),
        )
        .unwrap_or_else(|errors| panic!("{errors}"))
    }

    #[test]
    fn all_predicates_for_availability_change() {
        let mission = mission("here - place", &[("usable", "available")]);
        let mut problem = mission.current().as_ref().clone();
        let mut available = |allowed: &dyn Fn(&str) -> Option<bool>| {
            mission.allow(&mut problem, allowed);
            ["fd_available", "usable"].map(|predicate| {
                let is_fact = |element: &&InitialElement| matches!(element, InitialElement::Fact(atom) if atom.predicate.name.as_str() == predicate);
                problem.init.iter().filter(is_fact).count()
            })
        };
        let [first, second] = available(&|_| Some(true));
        assert!(first > 1 && first == second, "{first} {second}");
        assert_eq!(available(&|design| Some(design == "fd_amcl_lidar")), [1, 1]);
        assert_eq!(available(&|_| Some(false)), [0, 0]);
    }

    /// Only the errors of a goal are reported with the positions of its text.
    #[test]
    fn errors_of_the_problem_are_not_errors_of_a_goal() {
        let mission = mission("here - place there - nowhere", &[]);
        assert!(mission.filled().is_err());
        assert!(mission.goal("(at here)").is_ok());
        let errors = mission.goal("(at elsewhere)").expect_err("an unknown object");
        assert!(errors.to_string().contains("elsewhere"), "{errors}");
    }

    #[test]
    fn a_binding_that_is_used_is_not_idle() {
        let idle = |query: &str| {
            let doubts = mission("here - place", &[("a_req_f", query)]).doubts();
            let is_idle = doubts.iter().any(|message| message.code == "M227");
            assert!(doubts.iter().all(|message| !message.is_error()));
            is_idle
        };
        assert_eq!(["requires:A_Move", "requires:a_move", "requires:fly"].map(idle), [false, false, true]);
    }
}
