//! SWRL and Datalog rules over interned facts, maintained incrementally.
#![doc = include_str!("../README.md")]

mod aggregate;
mod apply;
mod builder;
mod builtin;
mod codes;
mod cost;
mod derivation;
mod engine;
mod equality;
mod error;
mod explain;
mod fact;
mod fixpoint;
mod forest;
mod limits;
mod literal;
mod lower;
mod maintain;
mod network;
mod plan;
mod record;
pub mod replay;
mod revision;
mod rule;
mod safety;
mod solve;
mod source;
mod store;
mod strata;
mod swrl;
mod symbol;
mod vocabulary;
mod why_not;

pub use builder::EngineBuilder;
pub use builtin::{BuiltIn, CustomBuiltIn, Definition, SWRLB};
pub use codes::CODES;
pub use derivation::{Aggregated, Cause, Derivation, DerivationStep, Reason, Violation};
pub use engine::{Delta, Engine};
pub use error::{Error, Errors};
pub use fact::{Arguments, Fact};
pub use limits::{DEFAULT_STEP_BUDGET, Interrupt, Limits};
pub use literal::{Decimal, Duration, Literal, Moment, MomentKind, is_subsumed};
pub use rule::{Aggregate, Atom, Program, Rule, RuleIdentity, Term, Variable};
pub use swrl::{Prefixes, Syntax, parse_rules, parse_rules_as, parse_rules_together, print_rules};
pub use symbol::{Symbol, Symbols, Value};
pub use why_not::{NearMiss, Obstacle};
pub use {num_rational::BigRational, smallvec::SmallVec};

/// Status rules of the `TOMASys` metamodel as rule text. Every status is derived, so it is retracted
/// when its cause no longer holds. Names are in `http://metacontrol.org/tomasys#` and `http://ros/mros#`.
pub const TOMASYS_RULES: &str = include_str!("../swrl/tomasys.swrl");

/// Rules for the availability of function designs, and the errors of groundings and objectives, as rule text. The
/// names are those of [`TOMASYS_RULES`].
pub const COADAPTATION_RULES: &str = include_str!("../swrl/coadaptation.swrl");
