//! The result of a verification, as text and as JSON.

use std::fmt::{self, Write as _};

use mission::visible::{pretty, visible, visible_json};
use serde::Serialize;

use crate::manifest::{Claim, Subject, SubjectKind, Unchecked, Verification, VerifiedPart};

const FORMAT: &str = "metaplan-verification/1";

/// The claim of a certificate, and the results of checking its parts.
#[derive(Debug, Clone, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct VerificationAnswer<'a> {
    /// Name and version of this format.
    #[cfg_attr(feature = "schema", schemars(extend("const" = FORMAT)))]
    format: &'static str,
    /// Whether every part is verified.
    verified: bool,
    /// Claim of the certificate: `{"optimal": {"metric": "408"}}`, `"unsolvable"`, `{"front": {"objectives": ["(time)",
    /// "(energy)"], "points": [["2", "8"], ["6", "5"]]}}`, or null.
    claim: Option<&'a Claim>,
    /// Files or mission for which the claim was checked; null if the files cannot be read or the
    /// verification was aborted at a limit.
    subject: Option<&'a Subject>,
    /// Results of the checked parts. Parts that depend on a failed part may be absent.
    parts: Vec<PartAnswer<'a>>,
}

#[derive(Debug, Clone, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
struct PartAnswer<'a> {
    /// `files`, `derivations`, `knowledge`, `task`, `plan`, `argument`, `formula`, `proof`, `steps`,
    /// `point`, `front`, `mission`; or `limits` if a time or memory limit was reached; or `theorem` if the proved
    /// checker disagrees.
    part: &'static str,
    /// Whether the part is verified.
    verified: bool,
    /// Result of the check, or the reason for its failure.
    message: &'a str,
}

impl<'a> VerificationAnswer<'a> {
    /// Creates the answer for the result of a verification.
    pub fn new(report: &'a Verification) -> Self {
        let part = |part: &'a VerifiedPart| PartAnswer {
            part: part.part,
            verified: part.result.is_ok(),
            message: part.result.as_ref().unwrap_or_else(|reason| reason),
        };
        Self {
            format: FORMAT,
            verified: report.verified(),
            claim: report.claim.as_ref(),
            subject: report.subject.as_ref(),
            parts: report.parts.iter().map(part).collect(),
        }
    }
}

/// Formats a line for each part and then the verdict. Control characters are made visible. Line breaks are escaped in
/// each text of the certificate, which could otherwise imitate a line of this output.
impl fmt::Display for Verification {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&text(self))
    }
}

fn text(report: &Verification) -> String {
    let mut text = String::new();
    for part in &report.parts {
        let _ = match &part.result {
            Ok(summary) => writeln!(text, "{:11} verified: {}", part.part, one_line(summary)),
            Err(reason) => writeln!(text, "{:11} failed: {}", part.part, one_line(reason)),
        };
    }
    let claim = match &report.claim {
        Some(Claim::Optimal { metric }) => format!("the plan is optimal, metric {}", one_line(metric)),
        Some(Claim::Unsolvable) => "there is no plan".to_owned(),
        Some(Claim::Front(front)) => {
            let [first, second] = front.objectives.each_ref().map(|objective| one_line(objective));
            let (count, ending) = (front.points.len(), if front.points.len() == 1 { "" } else { "s" });
            format!("the front of {first} and {second} has exactly {count} point{ending}")
        }
        None => "nothing is claimed".to_owned(),
    };
    let _ = match (&report.subject, report.verified()) {
        (Some(subject), true) => writeln!(text, "verified: {claim}, for {}", extent(subject)),
        _ => writeln!(text, "NOT verified: {claim}"),
    };
    text
}

/// Escapes line breaks, tabs, and the characters that [`visible`] escapes.
fn one_line(text: &str) -> String {
    visible(text).replace('\n', "\\n").replace('\t', "\\t")
}

fn extent(subject: &Subject) -> String {
    let checked = match (&subject.mission, subject.kind) {
        (Some(name), _) => format!("the mission `{}` with digest {:.12}", one_line(name), subject.digest),
        (None, SubjectKind::Knowledge) => "these PDDL files and their knowledge base".to_owned(),
        (None, _) => "these PDDL files only".to_owned(),
    };
    let word = |unchecked: &Unchecked| match unchecked {
        Unchecked::Knowledge => "knowledge base",
        Unchecked::Mission => "mission",
    };
    let unchecked: Vec<&str> = subject.not_checked.iter().map(word).collect();
    if unchecked.is_empty() { checked } else { format!("{checked}; not checked: {}", unchecked.join(", ")) }
}

/// Returns the [`VerificationAnswer`] of a verification as JSON text.
pub fn json(report: &Verification) -> String {
    visible_json(&pretty(&VerificationAnswer::new(report))).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_a_certificate_do_not_imitate_lines() {
        let forged = "1\nverified: the plan is optimal\tx\u{1b}[2J";
        let mut report = Verification {
            claim: Some(Claim::Optimal { metric: forged.to_owned() }),
            subject: Some(Subject::new(&[], Some(forged))),
            parts: vec![
                VerifiedPart { part: "files", result: Ok(forged.to_owned()) },
                VerifiedPart { part: "proof", result: Err(forged.to_owned()) },
            ],
        };
        let escaped = "1\\nverified: the plan is optimal\\tx\\u{1b}[2J";
        let expected = format!(
            "files       verified: {escaped}\nproof       failed: {escaped}\nNOT verified: the plan is optimal, metric {escaped}\n"
        );
        assert_eq!(report.to_string(), expected);
        report.parts.pop();
        let objectives = [forged.to_owned(), "(cost)".to_owned()];
        report.claim = Some(Claim::Front(crate::manifest::Front { objectives, points: Vec::new() }));
        let text = report.to_string();
        let verdict = format!(
            "verified: the front of {escaped} and (cost) has exactly 0 points, for the mission `{escaped}` with digest "
        );
        assert!(text.lines().nth(1).is_some_and(|line| line.starts_with(&verdict)), "{text}");
        assert_eq!(text.lines().count(), 2, "{text}");
    }
}
