//! Answer of `metaplan verify`, as JSON and as text.

use std::fmt::Write as _;

use schemars::JsonSchema;
use serde::Serialize;
use verify::{Verification, VerificationAnswer};

use crate::certificate::Theorem;
use crate::visible::visible;

/// The claim of a certificate, and the results of checking its parts.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct VerifyAnswer<'a> {
    #[serde(flatten)]
    verification: VerificationAnswer<'a>,
    /// With `--proved`: what follows from a theorem.
    #[serde(skip_serializing_if = "Option::is_none")]
    theorem: Option<TheoremPart<'a>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct TheoremPart<'a> {
    /// Whether the claim follows from the theorem.
    proved: bool,
    /// Name of the theorem in `proved/Optimal.v`, `proved/Fronts.v` or `proved/TimelineProof.v`; null if it does not apply.
    name: Option<&'static str>,
    /// Parts that the theorem covers.
    parts: &'a [&'static str],
    /// The proved statement, or the reason why nothing is proved.
    message: &'a str,
    /// If a theorem covers the claim, and the certificate has a knowledge base: whether theorem `knowledge` of `proved/Derivations.v` covers its derivations.
    #[serde(skip_serializing_if = "Option::is_none")]
    derivations: Option<TheoremAnswer<'a>>,
    /// If a theorem covers the claim, and the certificate has a knowledge base: whether theorem `mission_optimal` or `mission_front` of `proved/MissionProof.v` covers the problem that follows from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    knowledge: Option<TheoremAnswer<'a>>,
}

#[derive(Debug, Clone, Serialize, JsonSchema)]
struct TheoremAnswer<'a> {
    /// Whether the theorem applies.
    proved: bool,
    /// The proved statement, or the reason why nothing is proved.
    message: &'a str,
}

impl<'a> VerifyAnswer<'a> {
    /// Creates the answer for the result of a verification, and of the proved checker if it was run.
    pub fn new(report: &'a Verification, theorem: Option<&'a Theorem>) -> Self {
        let theorem = theorem.map(|theorem| match theorem {
            Theorem::Holds { name, statement: message, parts, derivations, mission } => {
                let derivations = derivations.as_ref().map(TheoremAnswer::new);
                let knowledge = mission.as_ref().map(TheoremAnswer::new);
                TheoremPart { proved: true, name: Some(name), parts, message, derivations, knowledge }
            }
            Theorem::None(message) => {
                let (derivations, knowledge) = (None, None);
                TheoremPart { proved: false, name: None, parts: &[], message, derivations, knowledge }
            }
        });
        Self { verification: VerificationAnswer::new(report), theorem }
    }
}

impl<'a> TheoremAnswer<'a> {
    fn new(result: &'a Result<String, String>) -> Self {
        match result {
            Ok(message) => Self { proved: true, message },
            Err(message) => Self { proved: false, message },
        }
    }
}

/// Formats a line that states which parts the theorem covers, or why it does not apply. If it applies and there is a
/// knowledge base, two lines before it state the same for the derivations and for the problem that follows from them.
pub fn theorem_line(theorem: &Theorem) -> String {
    let mut lines = String::new();
    match theorem {
        Theorem::Holds { name, parts, derivations, mission, .. } => {
            let for_mission = if *name == "front_optimal" { "mission_front" } else { "mission_optimal" };
            for (part, theorem, result) in
                [("derivations", "knowledge", derivations), ("knowledge", for_mission, mission)]
            {
                let _ = match result {
                    Some(Ok(_)) => writeln!(lines, "proved: theorem `{theorem}` covers the part {part}"),
                    Some(Err(reason)) => writeln!(lines, "{part} NOT proved by a theorem: {reason}"),
                    None => Ok(()),
                };
            }
            let _ = writeln!(lines, "proved: theorem `{name}` covers the parts {}", parts.join(", "));
        }
        Theorem::None(reason) => {
            let _ = writeln!(lines, "NOT proved by a theorem: {reason}");
        }
    }
    visible(&lines).into_owned()
}
