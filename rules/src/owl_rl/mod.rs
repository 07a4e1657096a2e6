//! OWL axioms to rules, by the tables of OWL 2 RL/RDF (section 4.3 of \[1\]), instantiated per axiom.
//!
//! A rule of the tables speaks of triples; here each class is a relation with one argument and each property one with
//! two, so every axiom gives rules of its own and no join ever runs over all triples. The schema table (`scm-*`) derives
//! axioms from axioms. Of these, only subclasses between restrictions (scm-svf1, scm-svf2, scm-avf1, scm-avf2) become
//! rules: whatever assertion another derived axiom yields follows from the chained rules of the axioms it comes from.
//!
//! Not covered are rules without a counterpart here: `owl:Thing` and `owl:Nothing` as classes of their own, annotation
//! properties, declarations (prp-ap, cls-thing, cls-nothing1, dt-type1, scm-cls, scm-op, scm-dp), and individuals that
//! are equal as properties (eq-rep-p).
//!
//! Equality (table 4) is evaluated by representatives, see [`with_equality`]. Datatype clashes need no rule: see
//! [`crate::Engine::violations`].
//!
//! \[1\] W3C OWL 2 Web Ontology Language Profiles (Second Edition), 2012.

mod axiom;
mod schema;

use crate::rule::{Atom, Program, Rule, RuleIdentity, Term};
use crate::safety::bound_variables;
use crate::swrl::{Prefixes, parse_rules};
use crate::symbol::{Symbol, Symbols};
use crate::vocabulary::{DIFFERENT_FROM, SAME_AS};

pub use axiom::Axiom;

/// The source of the rules' identities.
pub const SOURCE: &str = "OWL 2 RL";

/// Whether two names can stand for one individual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Names {
    /// They can, and differ only where that is entailed: the semantics of OWL.
    #[default]
    Owl,
    /// They cannot: the semantics of databases and of PDDL. Axioms that would equate names conclude nothing.
    Unique,
}

/// The rules of axioms. Equality itself comes from [`with_equality`], which every program needs that concludes,
/// states or asks for `owl:sameAs` or `owl:differentFrom` under [`Names::Owl`].
pub fn rules(axioms: &[Axiom], names: Names) -> Program {
    let mut program = Program::default();
    for axiom in axioms.iter().chain(&schema::subclasses(axioms)) {
        let (text, parts) = template(axiom);
        let merges = text.contains("-> sameAs");
        if names == Names::Owl || !merges {
            instantiate(&text, &parts, &mut program);
        }
    }
    program
}

/// Rules for `owl:differentFrom` by entailment: from disjoint classes and from different values of functional
/// properties. They conclude a fact for each pair of individuals that differ, so add them only where a rule asks.
pub fn difference(axioms: &[Axiom], symbols: &mut Symbols) -> Program {
    let mut program = Program::default();
    for axiom in axioms {
        let (text, parts) = difference_template(axiom, symbols.name(DIFFERENT_FROM));
        instantiate(text, &parts, &mut program);
    }
    program
}

/// A program under [`Names::Owl`]: `owl:sameAs` is equality ([`Program::equality`]), and `differentFrom` in bodies asks
/// for what is entailed, where it would compare names.
///
/// `sameAs` in a body compares individuals where one of its terms is a variable that other atoms bind. Between two constants,
/// or two variables that nothing else binds, it asks for pairs of names of individuals that have several; an individual with
/// one name is then not the same as itself unless that is stated.
pub fn with_equality(program: &Program, symbols: &mut Symbols) -> Program {
    let (same, different) = (symbols.name(SAME_AS), symbols.name(DIFFERENT_FROM));
    let mut result = Program { equality: true, ..program.clone() };
    for rule in result.rules.iter_mut().filter(|rule| &*rule.identity.source != SOURCE) {
        let bound = bound_variables(rule);
        let is_bound = |term: Term| term.as_variable().is_some_and(|v| bound[usize::from(v.0)]);
        for atom in &mut rule.body {
            match *atom {
                Atom::Same(left, right) if left != right && !is_bound(left) && !is_bound(right) => {
                    *atom = Atom::relation(same, [left, right]);
                }
                Atom::Different(left, right) => *atom = Atom::relation(different, [left, right]),
                _ => {}
            }
        }
    }
    instantiate(EQUALITY, &[different], &mut result);
    result
}

const EQUALITY: &str = "[eq-diff-sym] a0(?x, ?y) -> a0(?y, ?x) . [eq-diff1] a0(?x, ?x) -> .";

/// Rule text in which `a0`, `a1`, … stand for the parts of an axiom.
fn template(axiom: &Axiom) -> (String, Vec<Symbol>) {
    use Axiom as A;
    let (text, parts): (&str, Vec<Symbol>) = match axiom {
        A::SubClass(c, d) => ("[cax-sco] a0(?x) -> a1(?x) .", vec![*c, *d]),
        A::EquivalentClasses(c, d) => {
            ("[cax-eqc1] a0(?x) -> a1(?x) . [cax-eqc2] a1(?x) -> a0(?x) .", vec![*c, *d])
        }
        A::DisjointClasses(c, d) => ("[cax-dw] a0(?x) ^ a1(?x) -> .", vec![*c, *d]),
        A::Complement(c, d) => ("[cls-com] a0(?x) ^ a1(?x) -> .", vec![*c, *d]),
        A::Nothing(c) => ("[cls-nothing2] a0(?x) -> .", vec![*c]),
        A::SomeValuesFrom(c, p, Some(d)) => ("[cls-svf1] a1(?x, ?y) ^ a2(?y) -> a0(?x) .", vec![*c, *p, *d]),
        A::SomeValuesFrom(c, p, None) => ("[cls-svf2] a1(?x, ?y) -> a0(?x) .", vec![*c, *p]),
        A::AllValuesFrom(c, p, d) => ("[cls-avf] a0(?x) ^ a1(?x, ?y) -> a2(?y) .", vec![*c, *p, *d]),
        A::HasValue(c, p, v) => {
            ("[cls-hv1] a0(?x) -> a1(?x, a2) . [cls-hv2] a1(?x, a2) -> a0(?x) .", vec![*c, *p, *v])
        }
        A::MaxZero(c, p, None) => ("[cls-maxc1] a0(?x) ^ a1(?x, ?y) -> .", vec![*c, *p]),
        A::MaxZero(c, p, Some(d)) => ("[cls-maxqc1] a0(?x) ^ a1(?x, ?y) ^ a2(?y) -> .", vec![*c, *p, *d]),
        A::MaxOne(c, p, None) => {
            let text =
                "[cls-maxc2] a0(?x) ^ a1(?x, ?y) ^ a1(?x, ?z) ^ differentFrom(?y, ?z) -> sameAs(?y, ?z) .";
            (text, vec![*c, *p])
        }
        A::MaxOne(c, p, Some(d)) => {
            let text =
                "[cls-maxqc3] a0(?x) ^ a1(?x, ?y) ^ a2(?y) ^ a1(?x, ?z) ^ a2(?z) ^ differentFrom(?y, ?z)
                -> sameAs(?y, ?z) .";
            (text, vec![*c, *p, *d])
        }
        A::Domain(p, c) => ("[prp-dom] a0(?x, ?y) -> a1(?x) .", vec![*p, *c]),
        A::Range(p, c) => ("[prp-rng] a0(?x, ?y) -> a1(?y) .", vec![*p, *c]),
        A::DataRange(p, d) => ("[prp-rng] a0(?x, ?y) ^ not rdfs:Literal(?y) -> .", vec![*p, *d]),
        A::FunctionalObject(p) => {
            ("[prp-fp] a0(?x, ?y) ^ a0(?x, ?z) ^ differentFrom(?y, ?z) -> sameAs(?y, ?z) .", vec![*p])
        }
        A::FunctionalData(p) => ("[prp-fp] a0(?x, ?y) ^ a0(?x, ?z) ^ differentFrom(?y, ?z) -> .", vec![*p]),
        A::InverseFunctional(p) => {
            ("[prp-ifp] a0(?x, ?z) ^ a0(?y, ?z) ^ differentFrom(?x, ?y) -> sameAs(?x, ?y) .", vec![*p])
        }
        A::Irreflexive(p) => ("[prp-irp] a0(?x, ?x) -> .", vec![*p]),
        A::Symmetric(p) => ("[prp-symp] a0(?x, ?y) -> a0(?y, ?x) .", vec![*p]),
        A::Asymmetric(p) => ("[prp-asyp] a0(?x, ?y) ^ a0(?y, ?x) -> .", vec![*p]),
        A::Transitive(p) => ("[prp-trp] a0(?x, ?y) ^ a0(?y, ?z) -> a0(?x, ?z) .", vec![*p]),
        A::SubProperty(p, q) => ("[prp-spo1] a0(?x, ?y) -> a1(?x, ?y) .", vec![*p, *q]),
        A::EquivalentProperties(p, q) => {
            ("[prp-eqp1] a0(?x, ?y) -> a1(?x, ?y) . [prp-eqp2] a1(?x, ?y) -> a0(?x, ?y) .", vec![*p, *q])
        }
        A::DisjointProperties(p, q) => ("[prp-pdw] a0(?x, ?y) ^ a1(?x, ?y) -> .", vec![*p, *q]),
        A::Inverse(p, q) => {
            ("[prp-inv1] a0(?x, ?y) -> a1(?y, ?x) . [prp-inv2] a1(?x, ?y) -> a0(?y, ?x) .", vec![*p, *q])
        }
        A::Negative(p, x, y) => ("[prp-npa1] a0(a1, a2) -> .", vec![*p, *x, *y]),
        A::Intersection(..) | A::Union(..) | A::OneOf(..) | A::Chain(..) | A::Key(..) => {
            return list_template(axiom);
        }
    };
    (text.into(), parts)
}

/// As [`template`], for axioms with lists.
fn list_template(axiom: &Axiom) -> (String, Vec<Symbol>) {
    use Axiom as A;
    let atoms = |list: &[Symbol], atom: &dyn Fn(usize) -> String| {
        (0..list.len()).map(atom).collect::<Vec<_>>().join(" ^ ")
    };
    let each =
        |list: &[Symbol], rule: &dyn Fn(usize) -> String| (1..=list.len()).map(rule).collect::<String>();
    let with = |first: Symbol, list: &[Symbol]| [&[first], list].concat();
    match axiom {
        A::Intersection(c, list) if !list.is_empty() => {
            let all = atoms(list, &|at| format!("a{}(?x)", at + 1));
            (format!("[cls-int1] {all} -> a0(?x) . [cls-int2] a0(?x) -> {all} ."), with(*c, list))
        }
        A::Union(c, list) => (each(list, &|at| format!("[cls-uni] a{at}(?x) -> a0(?x) .")), with(*c, list)),
        A::OneOf(c, list) => (each(list, &|at| format!("[cls-oo] -> a0(a{at}) .")), with(*c, list)),
        A::Chain(list, p) if !list.is_empty() => {
            let all = atoms(list, &|at| format!("a{}(?x{at}, ?x{})", at + 1, at + 1));
            (format!("[prp-spo2] {all} -> a0(?x0, ?x{}) .", list.len()), with(*p, list))
        }
        A::Key(c, list) if !list.is_empty() => {
            let all = atoms(list, &|at| format!("a{0}(?x, ?z{at}) ^ a{0}(?y, ?z{at})", at + 1));
            let text =
                format!("[prp-key] a0(?x) ^ a0(?y) ^ {all} ^ differentFrom(?x, ?y) -> sameAs(?x, ?y) .");
            (text, with(*c, list))
        }
        _ => (String::new(), Vec::new()),
    }
}

/// What makes two individuals different without saying so: the contraposition of the rules that equate, and of
/// disjointness.
fn difference_template(axiom: &Axiom, different: Symbol) -> (&'static str, Vec<Symbol>) {
    use Axiom as A;
    match axiom {
        A::DisjointClasses(c, d) | A::Complement(c, d) => {
            ("[different] a0(?x) ^ a1(?y) -> differentFrom(?x, ?y) .", vec![*c, *d])
        }
        A::FunctionalObject(p) => (
            "[different] a0(?x, ?p) ^ a0(?y, ?q) ^ a1(?p, ?q) -> differentFrom(?x, ?y) .",
            vec![*p, different],
        ),
        A::InverseFunctional(p) => (
            "[different] a0(?p, ?x) ^ a0(?q, ?y) ^ a1(?p, ?q) -> differentFrom(?x, ?y) .",
            vec![*p, different],
        ),
        A::FunctionalData(p) => (
            "[different] a0(?x, ?p) ^ a0(?y, ?q) ^ differentFrom(?p, ?q) -> differentFrom(?x, ?y) .",
            vec![*p],
        ),
        _ => ("", Vec::new()),
    }
}

/// Reads a template and puts the parts of an axiom in the place of `a0`, `a1`, ….
fn instantiate(text: &str, parts: &[Symbol], program: &mut Program) {
    let mut scratch = Symbols::new();
    // Templates are rules; the tests instantiate each.
    let Ok(parsed) = parse_rules(text, SOURCE, &mut scratch, &Prefixes::new()) else { return };
    let part = |symbol: Symbol| -> Option<Symbol> {
        let place = scratch.value(symbol).as_name()?.strip_prefix('a')?;
        parts.get(place.parse::<usize>().ok()?).copied()
    };
    let term = |term: Term| match term {
        Term::Constant(symbol) => Term::Constant(part(symbol).unwrap_or(symbol)),
        variable @ Term::Variable(_) => variable,
    };
    let atom = |atom: &Atom| match atom {
        Atom::Relation { predicate, arguments } => {
            let arguments = arguments.iter().copied().map(term);
            Atom::relation(part(*predicate).unwrap_or(*predicate), arguments)
        }
        // The datatype of a template is a place for that of the axiom, its second part.
        Atom::BuiltIn { built_in, arguments } => {
            let datatype = parts.get(1).copied().map(Term::Constant);
            let arguments = arguments.iter().take(1).copied().chain(datatype).collect();
            Atom::BuiltIn { built_in: *built_in, arguments }
        }
        other => other.clone(),
    };
    for rule in parsed.rules {
        let position = program.rules.len() as u32;
        let identity = RuleIdentity { position, ..rule.identity };
        let head = rule.head.iter().map(atom).collect();
        let body = rule.body.iter().map(atom).collect();
        program.rules.push(Rule { identity, head, body, variables: rule.variables });
    }
}
