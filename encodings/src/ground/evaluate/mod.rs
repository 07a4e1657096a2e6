//! What expressions and conditions of the lifted task come to under a binding of their parameters.

pub(crate) mod condition;
pub(crate) mod expression;
pub(crate) mod join;
pub(crate) mod normal_form;
pub(crate) mod reads;
pub(crate) mod slots;
