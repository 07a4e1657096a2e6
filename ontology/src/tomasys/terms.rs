//! The vocabulary table: the IRIs of each TOMASys term in the vocabularies in use.
//!
//! A term may have several IRIs. Queries use all of them, and updates use the one in the vocabulary of the
//! individual's class. A new vocabulary needs constants in `vocab` and entries here and in the lists of `mission`'s
//! `Catalogue` and of `mapek::analyze::unavailable`. Other words for statuses are added in `change::spellings`.

use crate::vocab::{mros, navigation, pddl_tomasys as www, suave, tomasys as t};

/// The IRIs of a term, in order of preference.
pub(crate) type Term = &'static [&'static str];

pub(crate) const FUNCTION: Term = &[t::FUNCTION, www::FUNCTION, suave::FUNCTION];
pub(crate) const FUNCTION_DESIGN: Term = &[t::FUNCTION_DESIGN, www::FUNCTION_DESIGN, suave::FUNCTION_DESIGN];
pub(crate) const FUNCTION_GROUNDING: Term = &[t::FUNCTION_GROUNDING];
pub(crate) const COMPONENT: Term = &[t::COMPONENT, www::COMPONENT, suave::COMPONENT];
pub(crate) const ATTRIBUTE_TYPE: Term =
    &[t::QUALITY_ATTRIBUTE_TYPE, www::QUALITY_ATTRIBUTE_TYPE, suave::QUALITY_ATTRIBUTE_TYPE];
pub(crate) const QA_VALUE: Term = &[t::QA_VALUE, www::QA_VALUE, suave::QA_VALUE];
pub(crate) const ACTION: Term = &[t::ACTION, www::ACTION, suave::ACTION];

pub(crate) const SOLVES_F: Term = &[t::SOLVES_F, www::SOLVES_F, suave::SOLVES_F];
pub(crate) const REQUIRES_F: Term = &[t::REQUIRES_F, www::REQUIRES_F, suave::REQUIRES_F];
/// Relates a design to a component.
pub(crate) const REQUIRES_C: Term = &[t::REQUIRES_C, www::REQUIRES_C, suave::REQUIRES_C];
/// Relates a component to a design.
pub(crate) const REQUIRED_BY: Term = &[mros::REQUIRED_BY, navigation::REQUIRED_BY];
pub(crate) const HAS_ESTIMATION: Term =
    &[t::HAS_QA_ESTIMATION, www::HAS_QA_ESTIMATION, suave::HAS_QA_ESTIMATION];
pub(crate) const IS_TYPE: Term = &[t::IS_QA_TYPE, www::IS_QA_TYPE, suave::IS_QA_TYPE];
pub(crate) const HAS_VALUE: Term = &[t::HAS_VALUE, www::QA_HAS_VALUE, suave::HAS_VALUE];
pub(crate) const REQUIREMENT: Term = &[t::REQUIREMENT];
pub(crate) const HAS_REQUIREMENT: Term = &[t::HAS_REQUIREMENT];
pub(crate) const HAS_MINIMUM: Term = &[t::HAS_MINIMUM];
pub(crate) const HAS_MAXIMUM: Term = &[t::HAS_MAXIMUM];
/// Relates an action to bounds on the designs that are selected for it.
pub(crate) const REQUIRES_QUALITY: Term = &[t::REQUIRES_QUALITY];
pub(crate) const IN_CONTEXT: Term = &[t::IN_CONTEXT];
pub(crate) const IS_MEASURED: Term = &[t::IS_MEASURED];
pub(crate) const STATUS: Term = &[t::C_STATUS, www::C_STATUS, suave::C_STATUS];
pub(crate) const REALISABILITY: Term = &[t::FD_REALISABILITY, www::FD_REALISABILITY, suave::FD_REALISABILITY];
pub(crate) const AVAILABLE: Term = &[t::FD_AVAILABLE];
pub(crate) const UTILITY: Term = &[www::FD_UTILITY, suave::FD_UTILITY, t::FD_EFFICACY];
/// Utility of a design that the rules of a knowledge base conclude.
pub(crate) const CONCLUDED_UTILITY: Term = &[www::FD_UTILITY, suave::FD_UTILITY];
pub(crate) const TYPE_FD: Term = &[t::TYPE_FD];
pub(crate) const HAS_QA_VALUE: Term = &[t::HAS_QA_VALUE];
pub(crate) const OBJECTIVE: Term = &[t::OBJECTIVE];
pub(crate) const TYPE_F: Term = &[t::TYPE_F];
pub(crate) const HAS_NFR: Term = &[t::HAS_NFR];
pub(crate) const OBJECTIVE_STATUS: Term = &[t::O_STATUS];
pub(crate) const UPDATABLE: Term = &[t::O_UPDATABLE];
pub(crate) const ALWAYS_IMPROVE: Term = &[t::O_ALWAYS_IMPROVE];
/// Relates a grounding to its objective.
pub(crate) const SOLVES_O: Term = &[t::SOLVES_O];
pub(crate) const GROUNDING_STATUS: Term = &[t::FG_STATUS];
/// Relates a design to the objectives for which it failed.
pub(crate) const ERROR_LOG: Term = &[t::FD_ERROR_LOG];
pub(crate) const OPERATOR: Term = &[t::QA_COMPARISON_OPERATOR];

/// Returns the IRI of a term in the vocabulary of the IRI `other`, or the preferred IRI if that
/// vocabulary lacks the term.
pub(crate) fn term_for(term: Term, other: &str) -> &'static str {
    let namespace = |iri: &str| iri.len() - crate::vocab::local_name(iri).len();
    let prefix = &other[..namespace(other)];
    term.iter().copied().find(|name| name[..namespace(name)] == *prefix).unwrap_or(term[0])
}
