//! Datatypes derived from `xsd:string`: treatment of white space, and valid forms (XML Schema Part 2,
//! section 3.4).

pub(super) fn parse(lexical: &str, local: &str) -> Option<String> {
    if local == "normalizedString" {
        return Some(lexical.replace(['\t', '\n', '\r'], " "));
    }
    let white = |c: char| matches!(c, ' ' | '\t' | '\n' | '\r');
    let words: Vec<&str> = lexical.split(white).filter(|word| !word.is_empty()).collect();
    let collapsed = words.join(" ");
    let valid = match local {
        "language" => is_language(&collapsed),
        "NMTOKEN" => !collapsed.is_empty() && collapsed.chars().all(is_name_character),
        "Name" => is_name(&collapsed),
        "NCName" => is_name(&collapsed) && !collapsed.contains(':'),
        _ => true,
    };
    valid.then_some(collapsed)
}

fn is_language(text: &str) -> bool {
    let part = |(position, part): (usize, &str)| {
        let letter = |c: char| c.is_ascii_alphabetic() || (position > 0 && c.is_ascii_digit());
        (1..=8).contains(&part.len()) && part.chars().all(letter)
    };
    text.split('-').enumerate().all(part)
}

fn is_name(text: &str) -> bool {
    // Deviation from XML 1.0: combining marks (U+0300 to U+036F), U+203F and U+2040 may start a name, too.
    let start = |c: char| is_name_character(c) && !c.is_ascii_digit() && !matches!(c, '-' | '.' | '\u{B7}');
    text.chars().next().is_some_and(start) && text.chars().all(is_name_character)
}

/// Returns `true` for a `NameChar` of XML 1.0, fifth edition.
fn is_name_character(c: char) -> bool {
    matches!(c, ':' | '_' | '-' | '.' | '0'..='9' | 'A'..='Z' | 'a'..='z' | '\u{B7}' | '\u{C0}'..='\u{D6}'
        | '\u{D8}'..='\u{F6}' | '\u{F8}'..='\u{37D}' | '\u{37F}'..='\u{1FFF}' | '\u{200C}' | '\u{200D}'
        | '\u{203F}' | '\u{2040}' | '\u{2070}'..='\u{218F}' | '\u{2C00}'..='\u{2FEF}' | '\u{3001}'..='\u{D7FF}'
        | '\u{F900}'..='\u{FDCF}' | '\u{FDF0}'..='\u{FFFD}' | '\u{10000}'..='\u{EFFFF}')
}
