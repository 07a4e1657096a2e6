//! IRIs of OWL with a fixed meaning for the engine.

pub(crate) const SAME_AS: &str = "http://www.w3.org/2002/07/owl#sameAs";
pub(crate) const DIFFERENT_FROM: &str = "http://www.w3.org/2002/07/owl#differentFrom";
