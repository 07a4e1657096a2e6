//! The axioms of OWL 2 RL.

use crate::symbol::Symbol;

/// An axiom within OWL 2 RL over named classes and properties; the name of its rule in the tables follows.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Axiom {
    /// Each instance of the first is one of the second (cax-sco).
    SubClass(Symbol, Symbol),
    /// Both have the same instances (cax-eqc1, cax-eqc2).
    EquivalentClasses(Symbol, Symbol),
    /// No individual is in both (cax-dw, cax-adc).
    DisjointClasses(Symbol, Symbol),
    /// No individual is in it (cls-nothing2).
    Nothing(Symbol),
    /// The first is the intersection of the others (cls-int1, cls-int2).
    Intersection(Symbol, Vec<Symbol>),
    /// The first is the union of the others (cls-uni).
    Union(Symbol, Vec<Symbol>),
    /// The first is the complement of the second (cls-com).
    Complement(Symbol, Symbol),
    /// The first contains what the property relates to an instance of the class, or to anything (cls-svf1, cls-svf2).
    SomeValuesFrom(Symbol, Symbol, Option<Symbol>),
    /// The property relates instances of the first only to instances of the last (cls-avf).
    AllValuesFrom(Symbol, Symbol, Symbol),
    /// The first is what the property relates to the value (cls-hv1, cls-hv2).
    HasValue(Symbol, Symbol, Symbol),
    /// The property relates no instance of the first to any instance of the class (cls-maxc1, cls-maxqc1, cls-maxqc2).
    MaxZero(Symbol, Symbol, Option<Symbol>),
    /// ... to at most one individual of the class (cls-maxc2, cls-maxqc3, cls-maxqc4).
    MaxOne(Symbol, Symbol, Option<Symbol>),
    /// The individuals are instances of the first (cls-oo).
    OneOf(Symbol, Vec<Symbol>),
    /// What the property relates to anything is in the class (prp-dom).
    Domain(Symbol, Symbol),
    /// What anything is related to is in the class (prp-rng).
    Range(Symbol, Symbol),
    /// What anything is related to is in the datatype, an `xsd:anyURI` literal (prp-rng with dt-type2 and dt-not-type).
    DataRange(Symbol, Symbol),
    /// At most one value, an individual (prp-fp).
    FunctionalObject(Symbol),
    /// At most one value, a literal (prp-fp, where two literals are never one).
    FunctionalData(Symbol),
    /// At most one subject for each value (prp-ifp).
    InverseFunctional(Symbol),
    /// Relates nothing to itself (prp-irp).
    Irreflexive(Symbol),
    /// Holds in both directions (prp-symp).
    Symmetric(Symbol),
    /// Holds in one direction at most (prp-asyp).
    Asymmetric(Symbol),
    /// Is its own chain (prp-trp).
    Transitive(Symbol),
    /// The first implies the second (prp-spo1).
    SubProperty(Symbol, Symbol),
    /// The chain implies the last (prp-spo2).
    Chain(Vec<Symbol>, Symbol),
    /// Both relate the same (prp-eqp1, prp-eqp2).
    EquivalentProperties(Symbol, Symbol),
    /// Nothing is related by both (prp-pdw, prp-adp).
    DisjointProperties(Symbol, Symbol),
    /// Each is the other backwards (prp-inv1, prp-inv2).
    Inverse(Symbol, Symbol),
    /// Instances of the class that agree on all properties are one (prp-key).
    Key(Symbol, Vec<Symbol>),
    /// The property does not relate the individual to the value (prp-npa1, prp-npa2).
    Negative(Symbol, Symbol, Symbol),
}
