//! Every code that a message can have: what it means, what causes it, and what to do. Each crate lists its own; here they are one.

mod fleet;
mod own;
mod ros;

/// A code of a message. Codes are stable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Code {
    /// A letter and three digits.
    pub code: &'static str,
    /// What it means, in a sentence.
    pub meaning: &'static str,
    /// What causes it.
    pub cause: &'static str,
    /// What to do.
    pub remedy: &'static str,
}

/// All codes, sorted.
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
    let mut all: Vec<Code> = tables.into_iter().flatten().map(code).collect();
    all.sort_unstable_by_key(|code| code.code);
    all
}

/// The code of that name, in capitals or not.
///
/// ```
/// assert_eq!(metaplan::codes::find(&"M110".to_lowercase()).map(|code| code.code), Some("M110"));
/// ```
pub fn find(name: &str) -> Option<Code> {
    all().into_iter().find(|code| code.code.eq_ignore_ascii_case(name))
}

/// Whether a text has the form of a code.
pub fn is_code(text: &str) -> bool {
    let (letter, digits) = text.split_at_checked(1).unwrap_or(("", ""));
    letter.chars().all(|c| c.is_ascii_alphabetic())
        && digits.len() == 3
        && digits.chars().all(|c| c.is_ascii_digit())
}
