//! The entities of an XML document, expanded within bounds: ten of them can stand for gigabytes, and neither parser knows all
//! spellings of their declarations.

use std::collections::HashMap;

use super::syntax::Flattened;

/// A document may grow by this factor ...
const GROWTH: usize = 16;
/// ... and by so many bytes besides, by all of its entities together.
const ALLOWANCE: usize = 1 << 20;
/// Entities may contain entities so deep.
const DEPTH: usize = 16;

/// The entities that XML itself declares.
const PREDEFINED: [&[u8]; 5] = [b"lt", b"gt", b"amp", b"quot", b"apos"];

/// Why a document's entities cannot be expanded, and where in the document.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Fault {
    pub offset: usize,
    pub message: String,
}

/// The internal subset of a document type declaration, and where it ends.
struct Declarations<'a> {
    entities: HashMap<&'a [u8], &'a [u8]>,
    /// Where `<!DOCTYPE` stands.
    start: usize,
    end: usize,
}

/// The document without its declarations of entities, each reference replaced by what it stands for.
pub(super) fn expanded(text: &[u8]) -> Result<Flattened<'_>, Fault> {
    let Some(declarations) = declarations(text) else { return Ok(Flattened::unchanged(text)) };
    let mut expansion = Expansion {
        entities: &declarations.entities,
        known: HashMap::new(),
        left: text.len().saturating_mul(GROWTH).saturating_add(ALLOWANCE),
    };
    let mut flat = text[..declarations.start].to_vec();
    let (mut moved, mut at) = (vec![(flat.len(), declarations.end)], declarations.end);
    while let Some(next) = text[at..].iter().position(|byte| matches!(byte, b'<' | b'&')) {
        flat.extend_from_slice(&text[at..at + next]);
        at += next;
        let rest = &text[at..];
        let verbatim: Option<&[u8]> = match rest {
            [b'<', b'!', b'-', b'-', ..] => Some(b"-->"),
            _ if rest.starts_with(b"<![CDATA[") => Some(b"]]>"),
            [b'<', b'?', ..] => Some(b"?>"),
            [b'<', ..] => Some(b"<"),
            _ => None,
        };
        if let Some(end) = verbatim {
            let length = rest.windows(end.len()).position(|window| window == end);
            let length = length.map_or(rest.len(), |position| position + end.len());
            flat.extend_from_slice(&rest[..length]);
            at += length;
            continue;
        }
        let Some((name, length)) = reference(rest) else {
            flat.push(b'&');
            at += 1;
            continue;
        };
        if PREDEFINED.contains(&name) {
            flat.extend_from_slice(&rest[..length]);
        } else {
            let message = expansion.append(name, &mut flat, 0).err();
            if let Some(message) = message {
                return Err(Fault { offset: at, message });
            }
            moved.push((flat.len(), at + length));
        }
        at += length;
    }
    flat.extend_from_slice(&text[at..]);
    Ok(Flattened { text: flat.into(), moved })
}

/// The name of the entity that a text which starts with `&` refers to, and the length of the reference.
fn reference(text: &[u8]) -> Option<(&[u8], usize)> {
    let end = text.iter().take(256).position(|&byte| byte == b';')?;
    let name = &text[1..end];
    let plain = |byte: &u8| byte.is_ascii_alphanumeric() || *byte >= 0x80 || b"_-.:".contains(byte);
    (!name.is_empty() && name.iter().all(plain)).then_some((name, end + 1))
}

struct Expansion<'a> {
    entities: &'a HashMap<&'a [u8], &'a [u8]>,
    /// What short entities stand for, so that each is resolved once.
    known: HashMap<&'a [u8], Vec<u8>>,
    /// Bytes that may still be added.
    left: usize,
}

impl<'a> Expansion<'a> {
    fn append(&mut self, name: &[u8], to: &mut Vec<u8>, depth: usize) -> Result<(), String> {
        let shown = || String::from_utf8_lossy(name).into_owned();
        let Some((&name, &value)) = self.entities.get_key_value(name) else {
            return Err(format!("the entity `&{};` is not declared", shown()));
        };
        if depth == DEPTH {
            return Err(format!(
                "the entity `&{};` contains itself, or others more than {DEPTH} deep",
                shown()
            ));
        }
        if !self.known.contains_key(name) {
            let resolved = self.resolved(value, depth)?;
            self.known.insert(name, resolved);
        }
        let value = &self.known[name];
        if value.len() > self.left {
            let limit = format!("more than {GROWTH} times the document and {ALLOWANCE} bytes");
            return Err(format!("the entities of the document, `&{};` the last, stand for {limit}", shown()));
        }
        self.left -= value.len();
        to.extend_from_slice(value);
        Ok(())
    }

    fn resolved(&mut self, value: &'a [u8], depth: usize) -> Result<Vec<u8>, String> {
        let (mut resolved, mut at) = (Vec::new(), 0);
        // Quotation marks are text in an entity, unless it has markup of its own.
        let is_text = !value.contains(&b'<');
        while at < value.len() {
            match (value[at], reference(&value[at..])) {
                (b'&', Some((name, length))) if !PREDEFINED.contains(&name) => {
                    self.append(name, &mut resolved, depth + 1)?;
                    at += length;
                    continue;
                }
                (b'"', _) if is_text => resolved.extend_from_slice(b"&quot;"),
                (b'\'', _) if is_text => resolved.extend_from_slice(b"&apos;"),
                (byte, _) => resolved.push(byte),
            }
            at += 1;
        }
        Ok(resolved)
    }
}

/// The declarations of a document that has an internal subset; external entities are not looked at.
fn declarations(text: &[u8]) -> Option<Declarations<'_>> {
    let start = text.windows(9).position(|window| window == b"<!DOCTYPE")?;
    // Nothing but the declaration of XML, comments and instructions stands before it.
    let mut at = 0;
    while at < start {
        let next = at + text[at..].iter().position(|&byte| byte == b'<')?;
        let end: &[u8] = match &text[next..] {
            [b'<', b'!', b'-', b'-', ..] => b"-->",
            [b'<', b'?', ..] => b"?>",
            _ if next == start => break,
            _ => return None,
        };
        at = next + text[next..].windows(end.len()).position(|window| window == end)? + end.len();
    }
    let subset = text[start..].iter().position(|&byte| byte == b'[' || byte == b'>')? + start;
    if text[subset] == b'>' {
        return None;
    }
    let (mut entities, mut at) = (HashMap::new(), subset + 1);
    loop {
        let rest = &text[at..];
        match rest.first()? {
            b']' => {
                let end = at + rest.iter().position(|&byte| byte == b'>')? + 1;
                return Some(Declarations { entities, start, end });
            }
            b'<' if rest.starts_with(b"<!--") => {
                at += rest.windows(3).position(|window| window == b"-->")? + 3;
            }
            b'<' => {
                let length = declaration_length(rest)?;
                if let Some((name, value)) = entity(&rest[..length]) {
                    // The first declaration counts.
                    entities.entry(name).or_insert(value);
                }
                at += length;
            }
            _ => at += 1,
        }
    }
}

/// How long a declaration is, whose `>` may stand in quotes.
fn declaration_length(text: &[u8]) -> Option<usize> {
    let mut quote = None;
    for (at, &byte) in text.iter().enumerate() {
        match (quote, byte) {
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), _) if open == byte => quote = None,
            (None, b'>') => return Some(at + 1),
            _ => {}
        }
    }
    None
}

/// The name and the value of `<!ENTITY name "value">`, in quotes of either kind.
fn entity(declaration: &[u8]) -> Option<(&[u8], &[u8])> {
    let rest = declaration.strip_prefix(b"<!ENTITY")?.trim_ascii_start();
    let end = rest.iter().position(u8::is_ascii_whitespace)?;
    let (name, rest) = rest.split_at(end);
    let rest = rest.trim_ascii_start();
    let quote = *rest.first().filter(|byte| matches!(byte, b'"' | b'\''))?;
    let length = rest[1..].iter().position(|&byte| byte == quote)?;
    Some((name, &rest[1..=length]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: Result<&str, (usize, &str)>) {
        let found = expanded(text.as_bytes());
        let found = found.as_ref().map(|flat| {
            assert_eq!(flat.origin(flat.text.len()), text.len(), "{text}");
            String::from_utf8_lossy(&flat.text).into_owned()
        });
        match (found, expected) {
            (Ok(found), Ok(expected)) => assert_eq!(found, expected, "{text}"),
            (Err(fault), Err((offset, message))) => {
                assert!(fault.offset == offset && fault.message.contains(message), "{text}: {fault:?}");
            }
            (found, expected) => panic!("{text}: {found:?}, not {expected:?}"),
        }
    }

    #[test]
    fn entities_stand_for_their_text() {
        check("<a>&lt;</a>", Ok("<a>&lt;</a>"));
        check("<!DOCTYPE a [<!ENTITY b 'c'>]><a d='&b;e'>&b;&amp;</a>", Ok("<a d='ce'>c&amp;</a>"));
        check(
            "<!DOCTYPE a [ <!ENTITY b \"c'\"> <!ENTITY d '&b;&b;'> ] >\n<a>&d;</a>",
            Ok("\n<a>c&apos;c&apos;</a>"),
        );
        check("<!DOCTYPE a [<!-- ]> --><!ENTITY b '>'><!ELEMENT a ANY>]><a>&b;</a>", Ok("<a>></a>"));
        check(
            "<!DOCTYPE a [<!ENTITY b 'c'>]><a><!-- &x; --><![CDATA[&x;]]></a>",
            Ok("<a><!-- &x; --><![CDATA[&x;]]></a>"),
        );
        check("<!DOCTYPE a SYSTEM 'x'><a>&b;</a>", Ok("<!DOCTYPE a SYSTEM 'x'><a>&b;</a>"));
        check("<a>&#65;&b</a>", Ok("<a>&#65;&b</a>"));
        check(
            "<!DOCTYPE a [<!ENTITY b SYSTEM 'file:///etc/passwd'>]><a>&b;</a>",
            Err((57, "`&b;` is not declared")),
        );
        check("<!DOCTYPE a [<!ENTITY b '&b;'>]><a>&b;</a>", Err((35, "contains itself")));
    }

    #[test]
    fn a_bomb_is_refused_at_once() {
        let mut text = "<!DOCTYPE a [<!ENTITY e0 'aaaaaaaaaa'>".to_owned();
        for level in 1..12 {
            text.extend([format!("<!ENTITY e{level} '{}'>", format!("&e{};", level - 1).repeat(10))]);
        }
        let start = text.len() + "]><a>".len();
        check(&format!("{text}]><a>&e11;</a>"), Err((start, "more than 16 times")));
        let many = "&e5;".repeat(1_000);
        assert!(expanded(format!("{text}]><a>{many}</a>").as_bytes()).is_err());
    }
}
