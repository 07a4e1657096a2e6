//! What a certificate consists of and claims, and what came of checking it.

use serde::{Deserialize, Serialize};

pub(super) const FORMAT: &str = "metaplan-certificate/3";
/// All files that are never in memory as a whole are together at most this large, in bytes.
pub(super) const SIZE_LIMIT: u64 = 1 << 30;
/// All files that are in memory as a whole are together at most this large, in bytes.
pub(super) const TEXT_LIMIT: u64 = 1 << 28;
pub(super) const DOMAIN: &str = "domain.pddl";
pub(super) const PROBLEM: &str = "problem.pddl";
pub(super) const PLAN: &str = "plan.txt";
pub(super) const TASK: &str = "task.json";
pub(super) const WITNESS: &str = "witness.json";
pub(super) const ARGUMENT: &str = "argument.json";
pub(super) const FORMULA: &str = "formula.cnf";
pub(super) const LEGEND: &str = "legend.txt";
pub(super) const PROOF: &str = "proof.drat";
pub(super) const HINTS: &str = "hints.txt";
/// What the solver writes, before it is shortened.
pub(super) const DRAFT: &str = "draft.drat";
/// These may be large, and are never in memory as a whole.
pub(super) const STREAMED: [&str; 4] = [FORMULA, LEGEND, PROOF, HINTS];
/// A proof and its hints are at most this large each, in bytes.
pub(super) const PROOF_LIMIT: u64 = 1 << 28;

/// What a certificate claims, and of which files it consists.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Manifest {
    pub(super) format: String,
    pub(super) claim: Claim,
    pub(super) refutation: Refutation,
    pub(super) files: Vec<File>,
}

/// Whether there is a formula with a proof besides the argument.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Refutation {
    /// For plans of at most so many steps; longer ones are not cheaper.
    Steps(usize),
    /// Why not.
    None(String),
}

/// What is claimed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Claim {
    /// The plan is valid, this is its metric, and no plan has a better one.
    Optimal {
        /// Exact: a decimal or a fraction.
        metric: String,
    },
    /// There is no plan.
    Unsolvable,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    pub(super) name: String,
    pub(super) bytes: u64,
    pub(super) sha256: String,
}

/// What came of one part of a verification.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct VerifiedPart {
    /// `files`, `derivations`, `knowledge`, `plan`, `task`, `argument`, `formula`, `proof`, `steps` or `mission`; or
    /// `limits`, where time or memory was up.
    pub part: &'static str,
    /// What was checked; or why it fails, with the first thing that is wrong.
    pub result: Result<String, String>,
}

/// What came of a verification.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verification {
    /// The claim; none if the manifest does not say.
    pub claim: Option<Claim>,
    /// In order; what rests on a part that fails is left out.
    pub parts: Vec<VerifiedPart>,
}
