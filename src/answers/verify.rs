//! What `metaplan verify` answers.

use serde::Serialize;

use crate::certificate::{Claim, Verification, VerifiedPart};

/// What a certificate claims, and whether each part of it holds.
#[derive(Debug, Clone, Serialize)]
pub struct VerificationAnswer<'a> {
    format: &'static str,
    verified: bool,
    claim: Option<&'a Claim>,
    parts: Vec<PartAnswer<'a>>,
}

#[derive(Debug, Clone, Serialize)]
struct PartAnswer<'a> {
    part: &'static str,
    verified: bool,
    message: &'a str,
}

impl<'a> VerificationAnswer<'a> {
    /// What came of a verification.
    pub fn new(report: &'a Verification) -> Self {
        let part = |part: &'a VerifiedPart| PartAnswer {
            part: part.part,
            verified: part.result.is_ok(),
            message: part.result.as_ref().unwrap_or_else(|reason| reason),
        };
        Self {
            format: "metaplan-verification/1",
            verified: report.verified(),
            claim: report.claim.as_ref(),
            parts: report.parts.iter().map(part).collect(),
        }
    }
}
