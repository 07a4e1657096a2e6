//! What a certificate consists of and claims, and what came of checking it.

use serde::{Deserialize, Serialize};

/// The version of the format.
pub const FORMAT: &str = "metaplan-certificate/3";
/// All files that are never in memory as a whole are together at most this large, in bytes.
pub const SIZE_LIMIT: u64 = 1 << 30;
/// All files that are in memory as a whole are together at most this large, in bytes.
pub const TEXT_LIMIT: u64 = 1 << 28;
/// The PDDL domain as it was planned with.
pub const DOMAIN: &str = "domain.pddl";
/// The problem as it was planned with: availability and values filled in.
pub const PROBLEM: &str = "problem.pddl";
/// The plan; missing if there is none.
pub const PLAN: &str = "plan.txt";
/// The ground task.
pub const TASK: &str = "task.json";
/// The atoms that may ever hold, and the values that numbers may have.
pub const WITNESS: &str = "witness.json";
/// Why no plan is cheaper.
pub const ARGUMENT: &str = "argument.json";
/// For small tasks: "a cheaper plan has at most so many steps", in DIMACS.
pub const FORMULA: &str = "formula.cnf";
/// What the variables of the formula mean.
pub const LEGEND: &str = "legend.txt";
/// The refutation of the formula.
pub const PROOF: &str = "proof.drat";
/// What each line of the refutation follows from.
pub const HINTS: &str = "hints.txt";
/// These may be large, and are never in memory as a whole.
pub const STREAMED: [&str; 4] = [FORMULA, LEGEND, PROOF, HINTS];
/// A proof and its hints are at most this large each, in bytes.
pub const PROOF_LIMIT: u64 = 1 << 28;

/// What a certificate claims, and of which files it consists.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// [`FORMAT`].
    pub format: String,
    /// What is claimed.
    pub claim: Claim,
    /// Whether there is a formula.
    pub refutation: Refutation,
    /// All files but the manifest.
    pub files: Vec<File>,
}

/// Whether there is a formula with a proof besides the argument.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Refutation {
    /// For plans of at most so many steps; longer ones are not cheaper.
    Steps(usize),
    /// Why not.
    None(String),
}

/// What is claimed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
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

/// A file of a certificate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Its name in the directory.
    pub name: String,
    /// Its size.
    pub bytes: u64,
    /// Its SHA-256 in hexadecimal digits.
    pub sha256: String,
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
#[non_exhaustive]
pub struct Verification {
    /// The claim; none if the manifest does not say.
    pub claim: Option<Claim>,
    /// In order; what rests on a part that fails is left out.
    pub parts: Vec<VerifiedPart>,
}

impl Verification {
    /// Whether the claim is proved.
    pub fn verified(&self) -> bool {
        self.claim.is_some() && self.parts.iter().all(|part| part.result.is_ok())
    }
}
