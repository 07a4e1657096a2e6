//! Recognises documents in unsupported syntaxes, for the error message.

pub(super) fn recognized(text: &[u8]) -> Option<&'static str> {
    let head = text.trim_ascii_start();
    if head.is_empty() {
        return Some("an empty document; an ontology has at least one statement");
    }
    let starts = |marks: &[&[u8]]| marks.iter().any(|mark| head.starts_with(mark));
    // In Turtle, a blank node with a property list begins with the same bracket as an array of JSON.
    let is_array = head
        .strip_prefix(b"[")
        .is_some_and(|tail| matches!(tail.trim_ascii_start().first(), Some(b'{' | b'[' | b'"')));
    if text.starts_with(b"\x1f\x8b") || text.starts_with(b"PK\x03\x04") || text.starts_with(b"BZh") {
        Some("a compressed file; unpack it first")
    } else if starts(&[b"{"]) || is_array {
        Some("JSON, perhaps JSON-LD, which is not read; convert it to Turtle")
    } else if starts(&[b"format-version:", b"ontology:", b"[Term]"]) {
        Some(
            "OBO format, which is not read; convert it with ROBOT: `robot convert --input FILE --output FILE.ofn`",
        )
    } else if is_manchester(head) {
        Some(
            "Manchester syntax, which is not read; convert it with ROBOT: `robot convert --input FILE --output FILE.ofn`",
        )
    } else if starts(&[b"<!DOCTYPE html", b"<!doctype html", b"<html", b"<HTML"]) {
        Some("a web page, not an ontology")
    } else {
        None
    }
}

fn is_manchester(head: &[u8]) -> bool {
    let mut lines = head.split(|&byte| byte == b'\n').map(<[u8]>::trim_ascii);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with(b"#")).unwrap_or_default();
    let keywords = ["Prefix:", "Ontology:", "Class:", "ObjectProperty:", "DataProperty:", "Individual:"];
    keywords.iter().any(|keyword| {
        let tail = first.strip_prefix(keyword.as_bytes());
        tail.is_some_and(|tail| tail.is_empty() || tail[0].is_ascii_whitespace())
    })
}

#[cfg(test)]
mod tests {
    use super::recognized;

    #[test]
    fn unsupported_formats_are_recognised() {
        for (text, expected) in [
            ("", "empty"),
            (" \n\t", "empty"),
            ("Prefix: : <http://x#>", "Manchester"),
            ("# c\nOntology: <http://x>\n", "Manchester"),
            ("{\"@context\": {}}", "JSON"),
            ("\u{1f}\u{8b}", ""),
            ("format-version: 1.2\n", "OBO"),
            ("<!DOCTYPE html><html/>", "web page"),
            ("[] a <http://x> .", ""),
            ("[ a <http://x> ] .", ""),
            ("[\n  a <http://x> ] .", ""),
            ("[ # c\n <http://x#p> 1 ] .", ""),
            ("[\n  {\"@id\": \"http://x\"}\n]", "JSON"),
            ("[{}]", "JSON"),
            ("@prefix : <http://x#> .", ""),
            ("Prefix(:=<http://x#>)", ""),
        ] {
            let message = recognized(text.as_bytes());
            let fits = message
                .map_or(expected.is_empty(), |message| !expected.is_empty() && message.contains(expected));
            assert!(fits, "{text}: {message:?}");
        }
        assert!(recognized(b"\x1f\x8b\x08").is_some_and(|message| message.contains("compressed")));
    }
}
