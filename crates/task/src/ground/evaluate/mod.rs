//! What expressions and conditions of the lifted task come to under a binding of their parameters.

pub mod condition;
pub mod expression;
pub mod join;
pub mod normal_form;
pub mod reads;
pub mod slots;
