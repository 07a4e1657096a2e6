//! Partial evaluation of lifted expressions and conditions under a binding of their parameters.

pub mod condition;
pub mod expression;
pub mod join;
pub mod normal_form;
pub mod reads;
pub mod slots;
