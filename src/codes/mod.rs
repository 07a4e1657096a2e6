//! Catalogue of all message codes, with meaning, cause and remedy. It joins the catalogues of all
//! crates.

mod fleet;
mod own;
mod ros;

/// A message code with its explanation. The meaning of a code never changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Code {
    /// Name of the code: a letter and three digits.
    pub code: &'static str,
    /// Meaning of the code, in a sentence.
    pub meaning: &'static str,
    /// Cause of the message.
    pub cause: &'static str,
    /// Remedy for the cause.
    pub remedy: &'static str,
}

/// Returns all codes of all crates, sorted by name.
pub fn all() -> Vec<Code> {
    let tables = [
        rules::CODES,
        ontology::CODES,
        pddl::CODES,
        ::mission::CODES,
        ::verify::CODES,
        planner::CODES,
        probabilistic::CODES,
        own::CODES,
        ros::CODES,
        fleet::CODES,
    ];
    let code = |&[code, meaning, cause, remedy]: &[&'static str; 4]| Code { code, meaning, cause, remedy };
    let mut codes: Vec<Code> = tables.into_iter().flatten().map(code).collect();
    codes.sort_unstable_by_key(|code| code.code);
    codes
}

/// Returns the code with this name, in upper or lower case, or `None` if it does not exist.
///
/// ```
/// assert_eq!(metaplan::codes::find(&"M110".to_lowercase()).map(|code| code.code), Some("M110"));
/// ```
pub fn find(name: &str) -> Option<Code> {
    all().into_iter().find(|code| code.code.eq_ignore_ascii_case(name))
}

/// Returns `true` if a text has the form of a code: a letter and three digits.
pub fn is_code(text: &str) -> bool {
    let (letter, digits) = text.split_at_checked(1).unwrap_or(("", ""));
    letter.chars().all(|c| c.is_ascii_alphabetic())
        && digits.len() == 3
        && digits.chars().all(|c| c.is_ascii_digit())
}
