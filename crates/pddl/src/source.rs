//! Source texts, with conversion of byte offsets to lines and columns.

use super::ast::Span;

/// Converts a byte offset to 32 bits; larger offsets become `u32::MAX`. Texts beyond 4 GB are rejected by the
/// parser.
pub(crate) fn place(at: usize) -> u32 {
    u32::try_from(at).unwrap_or(u32::MAX)
}

const BYTE_ORDER_MARK: char = '\u{feff}';

/// Text to parse with its file name.
#[derive(Debug, Clone)]
pub struct Source {
    name: String,
    text: String,
    line_starts: Vec<u32>,
}

/// Position for display. Line and column start at 1; the column counts characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position {
    /// Line number.
    pub line: usize,
    /// Column number.
    pub column: usize,
}

impl Source {
    /// Creates a source from the text of the file `name`. A byte order mark is removed.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        let mut text = text.into();
        if text.starts_with(BYTE_ORDER_MARK) {
            text.remove(0);
        }
        let newlines = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let line_starts = std::iter::once(0)
            .chain(newlines.map_while(|(at, _)| u32::try_from(at).ok()?.checked_add(1)))
            .collect();
        Self { name: name.into(), text, line_starts }
    }

    /// Decodes the bytes of the file `name`: as UTF-16 if they begin with a UTF-16 byte order mark, else as
    /// UTF-8. Windows PowerShell's `>` writes UTF-16. Invalid sequences become U+FFFD, because comments of
    /// older files are often Latin-1. The parser accepts U+FFFD only in comments.
    pub fn from_bytes(name: impl Into<String>, bytes: &[u8]) -> Self {
        match bytes {
            [0xff, 0xfe, content @ ..] => Self::new(name, utf16(content, u16::from_le_bytes)),
            [0xfe, 0xff, content @ ..] => Self::new(name, utf16(content, u16::from_be_bytes)),
            _ => Self::new(name, String::from_utf8_lossy(bytes)),
        }
    }

    /// Name of the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Text at `span`, which must be a span of this text; empty if it exceeds the text.
    pub fn slice(&self, span: Span) -> &str {
        self.text.get(span.start as usize..span.end as usize).unwrap_or("")
    }

    /// Line and column of a byte offset. An offset beyond the end is treated as the end.
    #[expect(
        clippy::arithmetic_side_effects,
        reason = "positions in a text in memory, which are at most its length"
    )]
    pub fn position(&self, byte: u32) -> Position {
        let index = self.line_index(byte);
        let start = self.line_starts[index] as usize;
        let before = &self.text.as_bytes()[start..(byte as usize).clamp(start, self.text.len())];
        // Each UTF-8 byte except continuation bytes (10xxxxxx) begins a character.
        let column = 1 + before.iter().filter(|byte| **byte & 0xc0 != 0x80).count();
        Position { line: index + 1, column }
    }

    fn line_index(&self, byte: u32) -> usize {
        // The first line starts at 0, so at least one start is not after `byte`.
        self.line_starts.partition_point(|start| *start <= byte).saturating_sub(1)
    }
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let units: Vec<u16> = bytes.chunks(2).map(|pair| pair.try_into().map_or(0xfffd, unit)).collect();
    String::from_utf16_lossy(&units)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_count_lines_and_characters() {
        let source = Source::new("f", "ab\r\n→c\n\nx");
        let cases = [(0, 1, 1), (1, 1, 2), (4, 2, 1), (7, 2, 2), (9, 3, 1), (10, 4, 1), (99, 4, 2)];
        for (byte, line, column) in cases {
            assert_eq!(source.position(byte), Position { line, column }, "byte {byte}");
        }
        assert_eq!(source.slice(Span { start: 90, end: 91 }), "");
    }

    #[test]
    fn invalid_utf_8_becomes_replacement_characters() {
        assert_eq!(Source::from_bytes("f", b"; caf\xe9").text(), "; caf\u{fffd}");
    }

    #[test]
    fn byte_order_marks_are_removed() {
        let encoded = |unit: fn(u16) -> [u8; 2]| -> Vec<u8> {
            "\u{feff}(é 𝄞)".encode_utf16().flat_map(unit).collect()
        };
        let cases = [
            "\u{feff}(é 𝄞)".as_bytes().to_vec(),
            "(é 𝄞)".as_bytes().to_vec(),
            encoded(u16::to_le_bytes),
            encoded(u16::to_be_bytes),
        ];
        for bytes in cases {
            assert_eq!(Source::from_bytes("f", &bytes).text(), "(é 𝄞)", "{bytes:?}");
        }
        assert_eq!(Source::from_bytes("f", b"\xff\xfea\0b").text(), "a\u{fffd}");
    }
}
