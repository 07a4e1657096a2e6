//! The names of OWL that mean something to the engine.

/// The relation in which equal individuals are concluded.
pub(crate) const SAME_AS: &str = "http://www.w3.org/2002/07/owl#sameAs";
/// The relation in which different individuals are concluded.
pub(crate) const DIFFERENT_FROM: &str = "http://www.w3.org/2002/07/owl#differentFrom";
