//! IRIs of the vocabularies that this crate uses, as constants in one module per vocabulary.
//!
//! Each module has its namespace `NS` and a constant for each term in use. A constant is named after the
//! local name of its IRI. The IRIs of OWL are those of the mapping to RDF graphs, for example
//! `owl:someValuesFrom`.
//!
//! Knowledge bases in use spread TOMASys over several namespaces, for example with and without `www`.
//! Therefore the typed view in [`crate::tomasys`] uses a table of these constants instead of one namespace.

macro_rules! vocabulary {
    ($(#[$doc:meta])* $module:ident = $ns:literal { $($name:ident = $local:literal),* $(,)? }) => {
        $(#[$doc])*
        pub mod $module {
            /// The namespace of this vocabulary.
            pub const NS: &str = $ns;
            $(
                #[doc = concat!("`", $ns, $local, "`")]
                pub const $name: &str = concat!($ns, $local);
            )*
        }
    };
}

vocabulary! {
    /// RDF.
    rdf = "http://www.w3.org/1999/02/22-rdf-syntax-ns#" {
        TYPE = "type", FIRST = "first", REST = "rest", NIL = "nil", LIST = "List", PROPERTY = "Property",
        PLAIN_LITERAL = "PlainLiteral", LANG_STRING = "langString", DIR_LANG_STRING = "dirLangString",
        XML_LITERAL = "XMLLiteral",
    }
}

vocabulary! {
    /// RDF Schema.
    rdfs = "http://www.w3.org/2000/01/rdf-schema#" {
        CLASS = "Class", DATATYPE = "Datatype", LITERAL = "Literal", SUB_CLASS_OF = "subClassOf",
        SUB_PROPERTY_OF = "subPropertyOf", DOMAIN = "domain", RANGE = "range", LABEL = "label",
        COMMENT = "comment", SEE_ALSO = "seeAlso", IS_DEFINED_BY = "isDefinedBy",
    }
}

vocabulary! {
    /// OWL 2.
    owl = "http://www.w3.org/2002/07/owl#" {
        ONTOLOGY = "Ontology", IMPORTS = "imports", VERSION_IRI = "versionIRI", VERSION_INFO = "versionInfo",
        THING = "Thing", NOTHING = "Nothing", CLASS = "Class", RESTRICTION = "Restriction",
        OBJECT_PROPERTY = "ObjectProperty", DATATYPE_PROPERTY = "DatatypeProperty",
        ANNOTATION_PROPERTY = "AnnotationProperty", NAMED_INDIVIDUAL = "NamedIndividual",
        FUNCTIONAL_PROPERTY = "FunctionalProperty",
        TOP_OBJECT_PROPERTY = "topObjectProperty", TOP_DATA_PROPERTY = "topDataProperty",
        BOTTOM_OBJECT_PROPERTY = "bottomObjectProperty", BOTTOM_DATA_PROPERTY = "bottomDataProperty",
        SAME_AS = "sameAs", DIFFERENT_FROM = "differentFrom", MEMBERS = "members",
        DISTINCT_MEMBERS = "distinctMembers",
        ALL_DISJOINT_CLASSES = "AllDisjointClasses", ALL_DISJOINT_PROPERTIES = "AllDisjointProperties",
        DISJOINT_WITH = "disjointWith", PROPERTY_DISJOINT_WITH = "propertyDisjointWith",
        EQUIVALENT_CLASS = "equivalentClass", EQUIVALENT_PROPERTY = "equivalentProperty",
        PROPERTY_CHAIN_AXIOM = "propertyChainAxiom", INVERSE_OF = "inverseOf", ON_PROPERTY = "onProperty",
        HAS_VALUE = "hasValue", ONE_OF = "oneOf", AXIOM = "Axiom", ANNOTATION = "Annotation",
        ANNOTATED_SOURCE = "annotatedSource", ANNOTATED_PROPERTY = "annotatedProperty",
        ANNOTATED_TARGET = "annotatedTarget", DISJOINT_UNION_OF = "disjointUnionOf",
        REAL = "real", RATIONAL = "rational",
        INTERSECTION_OF = "intersectionOf", UNION_OF = "unionOf", COMPLEMENT_OF = "complementOf",
        DATATYPE_COMPLEMENT_OF = "datatypeComplementOf", ON_DATATYPE = "onDatatype", DATA_RANGE = "DataRange",
        ON_PROPERTIES = "onProperties", SOME_VALUES_FROM = "someValuesFrom", ALL_VALUES_FROM = "allValuesFrom",
        HAS_SELF = "hasSelf", CARDINALITY = "cardinality", MIN_CARDINALITY = "minCardinality",
        MAX_CARDINALITY = "maxCardinality", QUALIFIED_CARDINALITY = "qualifiedCardinality",
        MIN_QUALIFIED_CARDINALITY = "minQualifiedCardinality",
        MAX_QUALIFIED_CARDINALITY = "maxQualifiedCardinality", ON_CLASS = "onClass", ON_DATA_RANGE = "onDataRange",
        ALL_DIFFERENT = "AllDifferent", NEGATIVE_PROPERTY_ASSERTION = "NegativePropertyAssertion",
    }
}

vocabulary! {
    /// XML Schema datatypes.
    xsd = "http://www.w3.org/2001/XMLSchema#" {
        STRING = "string", BOOLEAN = "boolean", DECIMAL = "decimal", INTEGER = "integer", FLOAT = "float",
        DOUBLE = "double",
    }
}

vocabulary! {
    /// SWRL in its RDF syntax.
    swrl = "http://www.w3.org/2003/11/swrl#" {
        IMP = "Imp", BODY = "body", HEAD = "head", ATOM_LIST = "AtomList", VARIABLE = "Variable",
        CLASS_ATOM = "ClassAtom", DATA_RANGE_ATOM = "DataRangeAtom",
        INDIVIDUAL_PROPERTY_ATOM = "IndividualPropertyAtom",
        DATAVALUED_PROPERTY_ATOM = "DatavaluedPropertyAtom", SAME_INDIVIDUAL_ATOM = "SameIndividualAtom",
        DIFFERENT_INDIVIDUALS_ATOM = "DifferentIndividualsAtom", BUILTIN_ATOM = "BuiltinAtom",
        CLASS_PREDICATE = "classPredicate", PROPERTY_PREDICATE = "propertyPredicate", DATA_RANGE = "dataRange",
        ARGUMENT1 = "argument1", ARGUMENT2 = "argument2", BUILTIN = "builtin", ARGUMENTS = "arguments",
    }
}

vocabulary! {
    /// SWRL built-ins.
    swrlb = "http://www.w3.org/2003/11/swrlb#" {
        LESS_THAN = "lessThan", GREATER_THAN = "greaterThan",
    }
}

vocabulary! {
    /// Rule annotations of Protégé.
    swrla = "http://swrl.stanford.edu/ontologies/3.3/swrla.owl#" {
        IS_RULE_ENABLED = "isRuleEnabled",
    }
}

vocabulary! {
    /// TOMASys in the knowledge bases of Metacontrol and MROS, with the additional terms of `kb/tomasys.ttl`.
    tomasys = "http://metacontrol.org/tomasys#" {
        FUNCTION = "Function", FUNCTION_DESIGN = "FunctionDesign", FUNCTION_GROUNDING = "FunctionGrounding",
        OBJECTIVE = "Objective", COMPONENT = "Component", QUALITY_ATTRIBUTE_TYPE = "QualityAttributeType",
        QA_VALUE = "QAvalue", ACTION = "Action", REQUIREMENT = "Requirement",
        SOLVES_F = "solvesF", REQUIRES_F = "requiresF", REQUIRES_C = "requiresC",
        HAS_REQUIREMENT = "hasRequirement", HAS_MINIMUM = "hasMinimum", HAS_MAXIMUM = "hasMaximum",
        REQUIRES_QUALITY = "requiresQuality", IN_CONTEXT = "inContext",
        IS_QA_TYPE = "isQAtype", HAS_VALUE = "hasValue", HAS_QA_ESTIMATION = "hasQAestimation",
        IS_MEASURED = "isMeasured", C_STATUS = "c_status", FD_REALISABILITY = "fd_realisability",
        FD_AVAILABLE = "fd_available", FD_EFFICACY = "fd_efficacy",
        QA_COMPARISON_OPERATOR = "qa_comparison_operator", TYPE_FD = "typeFD", HAS_QA_VALUE = "hasQAvalue",
        TYPE_F = "typeF", HAS_NFR = "hasNFR", O_STATUS = "o_status", O_UPDATABLE = "o_updatable",
        O_ALWAYS_IMPROVE = "o_always_improve", SOLVES_O = "solvesO", FG_STATUS = "fg_status",
        FD_ERROR_LOG = "fd_error_log",
    }
}

vocabulary! {
    /// TOMASys in the knowledge bases of PLANTA (with `www`).
    pddl_tomasys = "http://www.metacontrol.org/tomasys#" {
        FUNCTION = "Function", FUNCTION_DESIGN = "FunctionDesign", COMPONENT = "Component",
        QUALITY_ATTRIBUTE_TYPE = "QualityAttributeType", QA_VALUE = "QAvalue", ACTION = "Action",
        SOLVES_F = "solvesF", REQUIRES_F = "requiresF", REQUIRES_C = "requiresC", IS_QA_TYPE = "isQAtype",
        QA_HAS_VALUE = "qa_has_value", HAS_QA_ESTIMATION = "hasQAestimation", C_STATUS = "c_status",
        FD_REALISABILITY = "fd_realisability", FD_UTILITY = "fd_utility",
        FUNCTION_GROUNDING = "functionGrounding", FD_UNGROUND = "fd_unground",
    }
}

vocabulary! {
    /// TOMASys in knowledge bases of SUAVE that were merged with their imports under the IRI of the importing
    /// ontology.
    suave = "http://www.metacontrol.org/suave#" {
        FUNCTION = "Function", FUNCTION_DESIGN = "FunctionDesign", COMPONENT = "Component",
        QUALITY_ATTRIBUTE_TYPE = "QualityAttributeType", QA_VALUE = "QAvalue", ACTION = "Action",
        SOLVES_F = "solvesF", REQUIRES_F = "requiresF", REQUIRES_C = "requiresC", IS_QA_TYPE = "isQAtype",
        HAS_VALUE = "hasValue", HAS_QA_ESTIMATION = "hasQAestimation", C_STATUS = "c_status",
        FD_REALISABILITY = "fd_realisability", FD_UTILITY = "fd_utility",
    }
}

vocabulary! {
    /// The extension of TOMASys by MROS.
    mros = "http://ros/mros#" {
        REQUIRED_BY = "requiredBy",
    }
}

vocabulary! {
    /// The predecessor of [`mros`], in older knowledge bases.
    navigation = "http://ros/navigation#" {
        REQUIRED_BY = "requiredBy",
    }
}

vocabulary! {
    /// PDDL names of ontology entities, from annotations of PLANTA.
    pddl = "http://www.metacontrol.org/pddl#" {
        HAS_PDDL_TYPE = "hasPddlType", PDDL_NAME = "pddlName",
    }
}

/// Returns the local name of an IRI: the part after the last `#` or, without `#`, after the last `/`.
/// Returns the whole IRI if that part is empty.
///
/// ```
/// assert_eq!(ontology::vocab::local_name("http://metacontrol.org/tomasys#Function"), "Function");
/// ```
pub fn local_name(iri: &str) -> &str {
    let start = iri.rfind('#').or_else(|| iri.rfind('/')).map_or(0, |index| index + 1);
    if start < iri.len() { &iri[start..] } else { iri }
}

pub(crate) fn is_reserved(iri: &str) -> bool {
    [rdf::NS, rdfs::NS, owl::NS, swrl::NS, xsd::NS].iter().any(|ns| iri.starts_with(ns))
}
