//! Expands the entities of an XML document within limits: ten declarations can expand to gigabytes, and the
//! parsers do not support all forms of declarations.

use std::collections::HashMap;

use super::syntax::Flattened;

/// Factor of the limit on the bytes that expansions add: `MAX_GROWTH_FACTOR * size + EXTRA_BYTES` for a document of
/// `size` bytes.
const MAX_GROWTH_FACTOR: usize = 16;
/// Constant term, in bytes, of the limit on the bytes that expansions add.
const EXTRA_BYTES: usize = 1 << 20;
const MAX_ENTITY_DEPTH: usize = 16;

const PREDEFINED: [&[u8]; 5] = [b"lt", b"gt", b"amp", b"quot", b"apos"];

#[derive(Debug, PartialEq, Eq)]
pub(super) struct EntityError {
    /// Byte offset in the document.
    pub offset: usize,
    pub message: String,
}

struct Declarations<'a> {
    entities: HashMap<&'a [u8], &'a [u8]>,
    /// Byte offset of `<!DOCTYPE`.
    start: usize,
    /// Byte offset after the declaration.
    end: usize,
}

/// Returns the document without the document type declaration and with expanded entity references. A document without
/// declarations ([`declarations`]) is returned unchanged.
pub(super) fn expanded(text: &[u8]) -> Result<Flattened<'_>, EntityError> {
    let Some(declarations) = declarations(text) else { return Ok(Flattened::unchanged(text)) };
    let mut expansion = Expansion {
        entities: &declarations.entities,
        cache: HashMap::new(),
        budget: text.len().saturating_mul(MAX_GROWTH_FACTOR).saturating_add(EXTRA_BYTES),
    };
    let mut flat = text[..declarations.start].to_vec();
    let (mut offsets, mut cursor) = (vec![(flat.len(), declarations.end)], declarations.end);
    while let Some(next) = text[cursor..].iter().position(|byte| matches!(byte, b'<' | b'&')) {
        flat.extend_from_slice(&text[cursor..cursor + next]);
        cursor += next;
        let tail = &text[cursor..];
        // References are not expanded in comments, CDATA sections and processing instructions.
        let verbatim: Option<&[u8]> = match tail {
            [b'<', b'!', b'-', b'-', ..] => Some(b"-->"),
            _ if tail.starts_with(b"<![CDATA[") => Some(b"]]>"),
            [b'<', b'?', ..] => Some(b"?>"),
            [b'<', ..] => Some(b"<"),
            _ => None,
        };
        if let Some(end) = verbatim {
            let length = tail.windows(end.len()).position(|window| window == end);
            let length = length.map_or(tail.len(), |position| position + end.len());
            flat.extend_from_slice(&tail[..length]);
            cursor += length;
            continue;
        }
        let Some((name, length)) = reference(tail) else {
            flat.push(b'&');
            cursor += 1;
            continue;
        };
        if PREDEFINED.contains(&name) {
            flat.extend_from_slice(&tail[..length]);
        } else {
            let message = expansion.append(name, &mut flat, 0).err();
            if let Some(message) = message {
                return Err(EntityError { offset: cursor, message });
            }
            offsets.push((flat.len(), cursor + length));
        }
        cursor += length;
    }
    flat.extend_from_slice(&text[cursor..]);
    Ok(Flattened { text: flat.into(), offsets })
}

/// Parses the entity reference (`&name;`) at the start of a text, without a check of the first character.
/// Returns the name of the entity and the length of the reference. `None` if no name with a semicolon follows
/// the first character.
fn reference(text: &[u8]) -> Option<(&[u8], usize)> {
    // Names of entities are short; a longer text is not a reference.
    let end = text.iter().take(256).position(|&byte| byte == b';')?;
    let name = &text[1..end];
    let plain = |byte: &u8| byte.is_ascii_alphanumeric() || *byte >= 0x80 || b"_-.:".contains(byte);
    (!name.is_empty() && name.iter().all(plain)).then_some((name, end + 1))
}

struct Expansion<'a> {
    entities: &'a HashMap<&'a [u8], &'a [u8]>,
    cache: HashMap<&'a [u8], Vec<u8>>,
    /// Number of bytes that expansions, including nested ones, may still produce.
    budget: usize,
}

impl<'a> Expansion<'a> {
    fn append(&mut self, name: &[u8], target: &mut Vec<u8>, depth: usize) -> Result<(), String> {
        let display_name = || String::from_utf8_lossy(name).into_owned();
        let Some((&name, &value)) = self.entities.get_key_value(name) else {
            return Err(format!("the entity `&{};` is not declared", display_name()));
        };
        // The depth limit also stops cyclic entities.
        if depth == MAX_ENTITY_DEPTH {
            return Err(format!(
                "the entity `&{};` contains itself, or others more than {MAX_ENTITY_DEPTH} deep",
                display_name()
            ));
        }
        if !self.cache.contains_key(name) {
            let resolved = self.resolved(value, depth)?;
            self.cache.insert(name, resolved);
        }
        let value = &self.cache[name];
        // Checked before copying, so that memory stays bounded.
        if value.len() > self.budget {
            let limit = format!("more than {MAX_GROWTH_FACTOR} times the document and {EXTRA_BYTES} bytes");
            return Err(format!(
                "the entities of the document, `&{};` the last, stand for {limit}",
                display_name()
            ));
        }
        self.budget -= value.len();
        target.extend_from_slice(value);
        Ok(())
    }

    fn resolved(&mut self, value: &'a [u8], depth: usize) -> Result<Vec<u8>, String> {
        let (mut resolved, mut cursor) = (Vec::new(), 0);
        // Quotation marks are escaped in a value without markup, because the reference may be in an attribute.
        let is_text = !value.contains(&b'<');
        while cursor < value.len() {
            match (value[cursor], reference(&value[cursor..])) {
                (b'&', Some((name, length))) if !PREDEFINED.contains(&name) => {
                    self.append(name, &mut resolved, depth + 1)?;
                    cursor += length;
                    continue;
                }
                (b'"', _) if is_text => resolved.extend_from_slice(b"&quot;"),
                (b'\'', _) if is_text => resolved.extend_from_slice(b"&apos;"),
                (byte, _) => resolved.push(byte),
            }
            cursor += 1;
        }
        Ok(resolved)
    }
}

/// Parses the document type declaration of an XML document. Returns `None` without a declaration, if the
/// declaration has no internal subset (part in `[…]`), or if it is malformed. External entities are ignored.
fn declarations(text: &[u8]) -> Option<Declarations<'_>> {
    // Only the XML declaration, comments and processing instructions may precede the document type declaration.
    let mut start = 0;
    loop {
        start += text[start..].iter().position(|&byte| byte == b'<')?;
        let end: &[u8] = match &text[start..] {
            [b'<', b'!', b'-', b'-', ..] => b"-->",
            [b'<', b'?', ..] => b"?>",
            tail if tail.starts_with(b"<!DOCTYPE") => break,
            _ => return None,
        };
        start += text[start..].windows(end.len()).position(|window| window == end)? + end.len();
    }
    let subset = text[start..].iter().position(|&byte| byte == b'[' || byte == b'>')? + start;
    if text[subset] == b'>' {
        return None;
    }
    let (mut entities, mut cursor) = (HashMap::new(), subset + 1);
    loop {
        let tail = &text[cursor..];
        match tail.first()? {
            b']' => {
                let end = cursor + tail.iter().position(|&byte| byte == b'>')? + 1;
                return Some(Declarations { entities, start, end });
            }
            b'<' if tail.starts_with(b"<!--") => {
                cursor += tail.windows(3).position(|window| window == b"-->")? + 3;
            }
            b'<' => {
                let length = declaration_length(tail)?;
                if let Some((name, value)) = entity(&tail[..length]) {
                    // XML: the first declaration of an entity is binding.
                    entities.entry(name).or_insert(value);
                }
                cursor += length;
            }
            _ => cursor += 1,
        }
    }
}

fn declaration_length(text: &[u8]) -> Option<usize> {
    let mut quote = None;
    for (index, &byte) in text.iter().enumerate() {
        match (quote, byte) {
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), _) if open == byte => quote = None,
            (None, b'>') => return Some(index + 1),
            _ => {}
        }
    }
    None
}

fn entity(declaration: &[u8]) -> Option<(&[u8], &[u8])> {
    let tail = declaration.strip_prefix(b"<!ENTITY")?.trim_ascii_start();
    let end = tail.iter().position(u8::is_ascii_whitespace)?;
    let (name, tail) = tail.split_at(end);
    let tail = tail.trim_ascii_start();
    let quote = *tail.first().filter(|byte| matches!(byte, b'"' | b'\''))?;
    let length = tail[1..].iter().position(|&byte| byte == quote)?;
    Some((name, &tail[1..=length]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, expected: Result<&str, (usize, &str)>) {
        let actual = expanded(text.as_bytes());
        let actual = actual.as_ref().map(|flat| {
            assert_eq!(flat.origin(flat.text.len()), text.len(), "{text}");
            String::from_utf8_lossy(&flat.text).into_owned()
        });
        match (actual, expected) {
            (Ok(actual), Ok(expected)) => assert_eq!(actual, expected, "{text}"),
            (Err(fault), Err((offset, message))) => {
                assert!(fault.offset == offset && fault.message.contains(message), "{text}: {fault:?}");
            }
            (actual, expected) => panic!("{text}: {actual:?}, not {expected:?}"),
        }
    }

    #[test]
    fn references_are_replaced_by_the_value_of_the_entity() {
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
    fn declarations_in_comments_are_ignored() {
        let comment = "<!-- <!DOCTYPE a [<!ENTITY b 'x'>]> -->";
        check(&format!("{comment}<a>&b;</a>"), Ok(&format!("{comment}<a>&b;</a>")));
        check(
            &format!("<?xml version='1.0'?>{comment}<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>"),
            Ok(&format!("<?xml version='1.0'?>{comment}<a>c</a>")),
        );
        check(
            "<a><!-- <!DOCTYPE a [<!ENTITY b 'x'>]> -->&b;</a>",
            Ok("<a><!-- <!DOCTYPE a [<!ENTITY b 'x'>]> -->&b;</a>"),
        );
    }

    #[test]
    fn exponential_expansion_is_rejected() {
        let mut text = "<!DOCTYPE a [<!ENTITY e0 'aaaaaaaaaa'>".to_owned();
        for level in 1..12 {
            text.extend([format!("<!ENTITY e{level} '{}'>", format!("&e{};", level - 1).repeat(10))]);
        }
        let start = text.len() + "]><a>".len();
        check(&format!("{text}]><a>&e11;</a>"), Err((start, "more than 16 times")));
        let references = "&e5;".repeat(1_000);
        assert!(expanded(format!("{text}]><a>{references}</a>").as_bytes()).is_err());
    }
}
