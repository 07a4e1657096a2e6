//! Decodes documents to UTF-8: byte order marks, UTF-16, and the encoding of an XML declaration.

use std::borrow::Cow;

pub(super) fn decoded(bytes: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    let marked = encoding_rs::Encoding::for_bom(bytes);
    let unmarked = match bytes {
        [b'<', 0, ..] => Some(encoding_rs::UTF_16LE),
        [0, b'<', ..] => Some(encoding_rs::UTF_16BE),
        _ => None,
    };
    let bytes = marked.map_or(bytes, |(_, length)| &bytes[length..]);
    let detected = marked.map(|(encoding, _)| encoding).or(unmarked);
    let declared = declared(bytes);
    let encoding = match (detected, declared) {
        (Some(encoding), _) => encoding,
        (None, Some(label)) => encoding_rs::Encoding::for_label(label)
            .ok_or_else(|| format!("the encoding `{}` is not known", String::from_utf8_lossy(label)))?,
        (None, None) => encoding_rs::UTF_8,
    };
    if encoding == encoding_rs::UTF_8 {
        return Ok(Cow::Borrowed(bytes));
    }
    let (text, has_errors) = encoding.decode_without_bom_handling(bytes);
    if has_errors {
        // Different invalid bytes would become the same character, so different names would become equal.
        return Err(format!("the text is not valid {}", encoding.name()));
    }
    Ok(Cow::Owned(as_utf8(text.into_owned().into_bytes())))
}

fn declared(text: &[u8]) -> Option<&[u8]> {
    let label = label(text)?;
    Some(&text[label])
}

fn label(text: &[u8]) -> Option<std::ops::Range<usize>> {
    if !text.starts_with(b"<?xml") {
        return None;
    }
    let end = text.windows(2).position(|window| window == b"?>")?;
    let start = text[..end].windows(8).position(|window| window == b"encoding")? + 8;
    let quote = start + text[start..end].iter().position(|byte| matches!(byte, b'"' | b'\''))?;
    let length = text[quote + 1..end].iter().position(|byte| *byte == text[quote])?;
    Some(quote + 1..quote + 1 + length)
}

/// Replaces the declared encoding by UTF-8. Spaces keep the columns of the following text, if the old label is
/// long enough.
fn as_utf8(text: Vec<u8>) -> Vec<u8> {
    let Some(label) = label(&text) else { return text };
    let mut result = text[..label.start].to_vec();
    result.extend_from_slice(b"UTF-8");
    result.push(text[label.end]);
    result.extend(std::iter::repeat_n(b' ', label.len().saturating_sub(5)));
    result.extend_from_slice(&text[label.end + 1..]);
    result
}

#[cfg(test)]
mod tests {
    use super::decoded;

    #[test]
    fn every_encoding_becomes_utf_8() {
        let utf16 = |text: &str, big: bool| -> Vec<u8> {
            text.encode_utf16()
                .flat_map(|unit| if big { unit.to_be_bytes() } else { unit.to_le_bytes() })
                .collect()
        };
        let latin = |text: &str| -> Vec<u8> { text.chars().map(|c| c as u8).collect() };
        for (bytes, expected) in [
            (b"\xef\xbb\xbf<a/>".to_vec(), "<a/>"),
            ("é".as_bytes().to_vec(), "é"),
            ([&[0xff, 0xfe][..], &utf16("@prefix é", false)].concat(), "@prefix é"),
            ([&[0xfe, 0xff][..], &utf16("@prefix é", true)].concat(), "@prefix é"),
            (
                utf16("<?xml version='1.0' encoding='UTF-16'?><a/>", false),
                "<?xml version='1.0' encoding='UTF-8' ?><a/>",
            ),
            (
                latin("<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?><a>é</a>"),
                "<?xml version=\"1.0\" encoding=\"UTF-8\"     ?><a>é</a>",
            ),
        ] {
            let text = decoded(&bytes).expect("known");
            assert_eq!(String::from_utf8_lossy(&text), expected);
        }
        assert!(
            decoded(b"<?xml version='1.0' encoding='klingon'?>")
                .is_err_and(|message| message.contains("klingon"))
        );
        let lone_surrogate = [0xff, 0xfe, b'a', 0, 0, 0xd8, b'b', 0];
        assert!(decoded(&lone_surrogate).is_err_and(|message| message.contains("not valid UTF-16LE")));
    }
}
