//! Tests of the rule engine through its public interface.

mod aggregates;
mod built_ins;
mod closure;
mod consequences;
mod crepe_reference;
mod dialects;
mod equality;
mod explanations;
mod incremental;
mod oracle;
mod replay;
mod robustness;
mod script;
mod syntax;
mod text;
mod values;
