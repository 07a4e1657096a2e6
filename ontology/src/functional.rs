//! Formats axioms in functional-style syntax and rules in SWRL's human-readable syntax, with full IRIs except for
//! variables: for messages, and as labels of the rules that are lowered from axioms.

use std::fmt::{Display, Formatter, Result};

use crate::owl::{
    ANONYMOUS, Argument, Atom, Axiom, Bound, Characteristic, ClassExpression, DataRange, Iri, Literal,
    ObjectPropertyExpression, Rule,
};
use crate::vocab::{local_name, xsd};

fn call(f: &mut Formatter<'_>, name: &str, arguments: &[&dyn Display]) -> Result {
    write!(f, "{name}(")?;
    for (index, argument) in arguments.iter().enumerate() {
        write!(f, "{}{argument}", if index == 0 { "" } else { " " })?;
    }
    f.write_str(")")
}

fn calls<T: Display>(f: &mut Formatter<'_>, name: &str, arguments: &[T]) -> Result {
    let arguments: Vec<&dyn Display> = arguments.iter().map(|argument| argument as &dyn Display).collect();
    call(f, name, &arguments)
}

struct Angle<'a>(&'a Iri);

impl Display for Angle<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self.0.strip_prefix(ANONYMOUS) {
            Some(label) => write!(f, "_:{label}"),
            None => write!(f, "<{}>", self.0),
        }
    }
}

struct Joined<'a, T>(&'a [T]);

impl<T: Display> Display for Joined<'_, T> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        for (index, argument) in self.0.iter().enumerate() {
            write!(f, "{}{argument}", if index == 0 { "" } else { " " })?;
        }
        Ok(())
    }
}

fn angles(iris: &[Iri]) -> Vec<Angle<'_>> {
    iris.iter().map(Angle).collect()
}

impl Display for Literal {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "\"{}\"", self.lexical.replace('\\', "\\\\").replace('"', "\\\""))?;
        match (&self.language, &self.datatype) {
            (Some(language), _) => write!(f, "@{language}"),
            (None, Some(datatype)) if &**datatype != xsd::STRING => write!(f, "^^<{datatype}>"),
            _ => Ok(()),
        }
    }
}

impl Display for ObjectPropertyExpression {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::Property(iri) => Angle(iri).fmt(f),
            Self::Inverse(iri) => call(f, "ObjectInverseOf", &[&Angle(iri)]),
        }
    }
}

impl Display for DataRange {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::Datatype(iri) => Angle(iri).fmt(f),
            Self::OneOf(literals) => calls(f, "DataOneOf", literals),
            Self::IntersectionOf(ranges) => calls(f, "DataIntersectionOf", ranges),
            Self::UnionOf(ranges) => calls(f, "DataUnionOf", ranges),
            Self::ComplementOf(range) => call(f, "DataComplementOf", &[range]),
            Self::Restriction(datatype, facets) => {
                write!(f, "DatatypeRestriction(<{datatype}>")?;
                for (facet, bound) in facets {
                    write!(f, " <{facet}> {bound}")?;
                }
                f.write_str(")")
            }
        }
    }
}

impl Display for Bound {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        f.write_str(match self {
            Self::Min => "Min",
            Self::Max => "Max",
            Self::Exact => "Exact",
        })
    }
}

impl Display for ClassExpression {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::Class(iri) => Angle(iri).fmt(f),
            Self::IntersectionOf(classes) => calls(f, "ObjectIntersectionOf", classes),
            Self::UnionOf(classes) => calls(f, "ObjectUnionOf", classes),
            Self::ComplementOf(class) => call(f, "ObjectComplementOf", &[class]),
            Self::OneOf(individuals) => calls(f, "ObjectOneOf", &angles(individuals)),
            Self::SomeValuesFrom(property, class) => call(f, "ObjectSomeValuesFrom", &[property, class]),
            Self::AllValuesFrom(property, class) => call(f, "ObjectAllValuesFrom", &[property, class]),
            Self::HasValue(property, individual) => {
                call(f, "ObjectHasValue", &[property, &Angle(individual)])
            }
            Self::HasSelf(property) => call(f, "ObjectHasSelf", &[property]),
            Self::Cardinality(bound, n, property, class) => {
                call(f, &format!("Object{bound}Cardinality"), &[n, property, class])
            }
            Self::DataSomeValuesFrom(property, range) => {
                call(f, "DataSomeValuesFrom", &[&Angle(property), range])
            }
            Self::DataAllValuesFrom(property, range) => {
                call(f, "DataAllValuesFrom", &[&Angle(property), range])
            }
            Self::DataHasValue(property, value) => call(f, "DataHasValue", &[&Angle(property), value]),
            Self::DataCardinality(bound, n, property, range) => {
                call(f, &format!("Data{bound}Cardinality"), &[n, &Angle(property), range])
            }
        }
    }
}

impl Display for Characteristic {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        write!(f, "{self:?}ObjectProperty")
    }
}

impl Display for Axiom {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::SubClassOf(sub, sup) => call(f, "SubClassOf", &[sub, sup]),
            Self::EquivalentClasses(classes) => calls(f, "EquivalentClasses", classes),
            Self::DisjointClasses(classes) => calls(f, "DisjointClasses", classes),
            Self::DisjointUnion(class, parts) => call(f, "DisjointUnion", &[&Angle(class), &Joined(parts)]),
            Self::SubObjectPropertyOf(sub, sup) => call(f, "SubObjectPropertyOf", &[sub, sup]),
            Self::SubPropertyChainOf(chain, sup) => {
                write!(f, "SubObjectPropertyOf(ObjectPropertyChain({}) {sup})", Joined(chain))
            }
            Self::EquivalentObjectProperties(properties) => {
                calls(f, "EquivalentObjectProperties", properties)
            }
            Self::DisjointObjectProperties(properties) => calls(f, "DisjointObjectProperties", properties),
            Self::InverseObjectProperties(first, second) => {
                call(f, "InverseObjectProperties", &[&Angle(first), &Angle(second)])
            }
            Self::ObjectPropertyDomain(property, class) => {
                call(f, "ObjectPropertyDomain", &[property, class])
            }
            Self::ObjectPropertyRange(property, class) => call(f, "ObjectPropertyRange", &[property, class]),
            Self::ObjectPropertyCharacteristic(characteristic, property) => {
                call(f, &characteristic.to_string(), &[property])
            }
            _ => fmt_data_or_assertion(self, f),
        }
    }
}

fn fmt_data_or_assertion(axiom: &Axiom, f: &mut Formatter<'_>) -> Result {
    match axiom {
        Axiom::SubDataPropertyOf(sub, sup) => call(f, "SubDataPropertyOf", &[&Angle(sub), &Angle(sup)]),
        Axiom::EquivalentDataProperties(iris) => calls(f, "EquivalentDataProperties", &angles(iris)),
        Axiom::DisjointDataProperties(iris) => calls(f, "DisjointDataProperties", &angles(iris)),
        Axiom::DataPropertyDomain(property, class) => {
            call(f, "DataPropertyDomain", &[&Angle(property), class])
        }
        Axiom::DataPropertyRange(property, range) => call(f, "DataPropertyRange", &[&Angle(property), range]),
        Axiom::FunctionalDataProperty(property) => call(f, "FunctionalDataProperty", &[&Angle(property)]),
        Axiom::DatatypeDefinition(name, range) => call(f, "DatatypeDefinition", &[&Angle(name), range]),
        Axiom::HasKey(class, objects, data) => {
            write!(f, "HasKey({class} ({}) ({}))", Joined(objects), Joined(&angles(data)))
        }
        Axiom::SameIndividual(iris) => calls(f, "SameIndividual", &angles(iris)),
        Axiom::DifferentIndividuals(iris) => calls(f, "DifferentIndividuals", &angles(iris)),
        Axiom::ClassAssertion(class, individual) => call(f, "ClassAssertion", &[class, &Angle(individual)]),
        Axiom::ObjectPropertyAssertion(property, from, to) => {
            call(f, "ObjectPropertyAssertion", &[property, &Angle(from), &Angle(to)])
        }
        Axiom::NegativeObjectPropertyAssertion(property, from, to) => {
            call(f, "NegativeObjectPropertyAssertion", &[property, &Angle(from), &Angle(to)])
        }
        Axiom::DataPropertyAssertion(property, from, to) => {
            call(f, "DataPropertyAssertion", &[&Angle(property), &Angle(from), to])
        }
        Axiom::NegativeDataPropertyAssertion(property, from, to) => {
            call(f, "NegativeDataPropertyAssertion", &[&Angle(property), &Angle(from), to])
        }
        axiom => write!(f, "{axiom:?}"),
    }
}

impl Display for Argument {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::Variable(iri) => write!(f, "?{}", local_name(iri)),
            Self::Individual(iri) => Angle(iri).fmt(f),
            Self::Literal(literal) => literal.fmt(f),
        }
    }
}

impl Display for Atom {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::Class(class, x) => write!(f, "{class}({x})"),
            Self::DataRange(range, x) => write!(f, "{range}({x})"),
            Self::ObjectProperty(property, x, y) => write!(f, "{property}({x}, {y})"),
            Self::DataProperty(property, x, y) => write!(f, "<{property}>({x}, {y})"),
            Self::SameIndividual(x, y) => write!(f, "sameAs({x}, {y})"),
            Self::DifferentIndividuals(x, y) => write!(f, "differentFrom({x}, {y})"),
            Self::BuiltIn(built_in, arguments) => {
                let arguments: Vec<_> = arguments.iter().map(ToString::to_string).collect();
                write!(f, "<{built_in}>({})", arguments.join(", "))
            }
        }
    }
}

impl Display for Rule {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let join = |atoms: &[Atom]| atoms.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ^ ");
        write!(f, "{} -> {}", join(&self.body), join(&self.head))
    }
}
