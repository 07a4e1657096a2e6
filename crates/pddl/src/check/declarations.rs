//! Checks requirements, types, constants, objects, predicates, functions and parameters, and the domain that
//! the problem names.

use rustc_hash::FxHashMap;

use crate::ast::{Declaration, Domain, Identifier, Name, Problem, Span, TypeExpression, TypedName};
use crate::source::Source;

use super::Checker;

/// Known requirement flags: those of PDDL 1.2 to 3.1, PDDL+ and HDDL, and further flags that planners accept.
const REQUIREMENTS: [&str; 35] = [
    "strips",
    "typing",
    "negative-preconditions",
    "disjunctive-preconditions",
    "equality",
    "existential-preconditions",
    "universal-preconditions",
    "quantified-preconditions",
    "conditional-effects",
    "fluents",
    "numeric-fluents",
    "object-fluents",
    "adl",
    "durative-actions",
    "duration-inequalities",
    "continuous-effects",
    "derived-predicates",
    "timed-initial-literals",
    "preferences",
    "constraints",
    "action-costs",
    "time",
    "hierarchy",
    "method-preconditions",
    "domain-axioms",
    "action-expansions",
    "foreach-expansions",
    "dag-expansions",
    "safety-constraints",
    "subgoal-through-axioms",
    "expression-evaluation",
    "true-negation",
    "ucpop",
    "open-world",
    "goal-utilities",
];

impl<'a> Checker<'a> {
    pub(super) fn requirements(&mut self, flags: &[Identifier]) {
        for flag in flags {
            let is_known = REQUIREMENTS.iter().any(|name| name.eq_ignore_ascii_case(flag.name.as_str()));
            if !is_known {
                let proposal = diagnostics::nearest(flag.name.as_str(), REQUIREMENTS);
                let help = proposal.map(|name| format!("did you mean `:{name}`?"));
                let message = format!("unknown requirement `:{}`", flag.name);
                self.sink.warning("P132", flag.span, message).help = help;
            }
        }
    }

    pub(super) fn domain_name(&mut self, domain: &Domain, source: &Source, problem: &Problem) {
        // A missing domain name was reported by the parser.
        if domain.name.name == problem.domain.name || problem.domain.span == problem.name.span {
            return;
        }
        let message = format!("the problem belongs to the domain `{}`", problem.domain.name);
        self.sink
            .warning("P131", problem.domain.span, message)
            .related(source, domain.name.span, "this domain has another name")
            .help(format!("write `(:domain {})`; other planners reject the problem", domain.name.name));
    }

    pub(super) fn types(&mut self, domain: &'a Domain) {
        let mut declared: FxHashMap<&Name, Span> = FxHashMap::default();
        for entry in &domain.types {
            let Identifier { name, span } = &entry.identifier;
            if let Some(earlier) = declared.insert(name, *span) {
                self.repeated(*span, &format!("the type `{name}`"), earlier);
            }
            if self.symbols.types.is_cyclic(name) {
                self.sink.error("P128", *span, format!("the type `{name}` is a subtype of itself"));
            }
        }
    }

    fn repeated(&mut self, span: Span, noun: &str, earlier: Span) {
        let source = self.sink.source();
        self.sink.warning("P127", span, format!("{noun} is declared twice")).related(
            source,
            earlier,
            "the first declaration is here",
        );
    }

    pub(super) fn constants(&mut self, domain: &'a Domain) {
        let mut declared = FxHashMap::default();
        for entry in &domain.constants {
            self.object(entry, "constant", &mut declared);
        }
    }

    pub(super) fn objects(&mut self, domain: &'a Domain, domain_source: &Source, problem: &'a Problem) {
        let mut declared = FxHashMap::default();
        let constants: FxHashMap<&Name, &TypedName> =
            domain.constants.iter().map(|entry| (&entry.identifier.name, entry)).collect();
        for entry in &problem.objects {
            let Identifier { name, span } = &entry.identifier;
            self.object(entry, "object", &mut declared);
            let Some(constant) = constants.get(name) else { continue };
            let place = constant.identifier.span;
            if self.symbols.types.overlap(&constant.r#type, &entry.r#type) {
                self.sink
                    .warning(
                        "P127",
                        *span,
                        format!("the object `{name}` is a constant of the domain already"),
                    )
                    .related(domain_source, place, "it is declared here");
            } else {
                self.sink
                    .error("P127", *span, format!("the object `{name}` is a constant of another type"))
                    .related(domain_source, place, "it is declared here");
            }
        }
    }

    fn object(
        &mut self,
        entry: &'a TypedName,
        noun: &str,
        declared: &mut FxHashMap<&'a Name, &'a TypedName>,
    ) {
        let Identifier { name, span } = &entry.identifier;
        self.check_type(&entry.r#type);
        let Some(earlier) = declared.insert(name, entry) else { return };
        if self.symbols.types.overlap(&earlier.r#type, &entry.r#type) {
            self.repeated(*span, &format!("the {noun} `{name}`"), earlier.identifier.span);
        } else {
            let source = self.sink.source();
            self.sink
                .warning(
                    "P127",
                    *span,
                    format!("the {noun} `{name}` is declared with two types; it is of both"),
                )
                .related(source, earlier.identifier.span, "the first declaration is here");
        }
    }

    pub(super) fn check_type(&mut self, r#type: &TypeExpression) {
        for alternative in &r#type.alternatives {
            if !self.symbols.types.contains(&alternative.name) {
                let types = self.symbols.types.names();
                self.undeclared("P120", alternative.span, "type", &alternative.name, types);
            }
        }
    }

    pub(super) fn predicates_and_functions(&mut self, domain: &'a Domain) {
        self.declarations(&domain.predicates, "predicate");
        self.declarations(&domain.functions, "function");
    }

    fn declarations(&mut self, declarations: &'a [Declaration], noun: &str) {
        let mut first_declarations: FxHashMap<&Name, &Declaration> = FxHashMap::default();
        for declaration in declarations {
            let Identifier { name, span } = &declaration.identifier;
            for parameter in &declaration.parameters {
                self.lenient_type(&parameter.r#type, noun);
            }
            let Some(earlier) = first_declarations.get(name) else {
                first_declarations.insert(name, declaration);
                continue;
            };
            let place = earlier.identifier.span;
            if earlier.parameters.len() == declaration.parameters.len() {
                self.repeated(*span, &format!("the {noun} `{name}`"), place);
            } else {
                let source = self.sink.source();
                self.sink
                    .error(
                        "P127",
                        *span,
                        format!("the {noun} `{name}` is declared with two numbers of arguments"),
                    )
                    .related(source, place, "the first declaration is here");
            }
        }
    }

    /// Warns about an undeclared type in the declaration of a predicate or a function. The type restricts
    /// nothing. Generated files contain such types.
    fn lenient_type(&mut self, r#type: &TypeExpression, noun: &str) {
        for alternative in &r#type.alternatives {
            if !self.symbols.types.contains(&alternative.name) {
                let help = if self.sink.is_full() {
                    None
                } else {
                    super::did_you_mean(alternative.name.as_str(), self.symbols.types.names())
                };
                let message = format!("unknown type `{}`, this {noun} takes any object", alternative.name);
                self.sink.warning("P136", alternative.span, message).help = help;
            }
        }
    }

    pub(super) fn parameters(&mut self, parameters: &[TypedName]) {
        let mut declared: FxHashMap<&Name, Span> = FxHashMap::default();
        for parameter in parameters {
            self.check_type(&parameter.r#type);
            let Identifier { name, span } = &parameter.identifier;
            if let Some(earlier) = declared.get(name) {
                let source = self.sink.source();
                self.sink.error("P127", *span, format!("the variable `?{name}` is declared twice")).related(
                    source,
                    *earlier,
                    "the first declaration is here",
                );
            } else {
                declared.insert(name, *span);
            }
        }
    }
}
